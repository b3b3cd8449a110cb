//! Drawings of single hairs (Selle, Lentine, Fedkiw 2008, Figures 10 and 11 show such tests), as SVG files.
//!
//! `cargo run --release -p pelage-sim --example hair_pictures -- [FOLDER]`; the folder is `docs/pictures` if none is given.
#![allow(missing_docs, clippy::disallowed_methods)]

use pelage_sim::rig::{FRAME, Rig, still};
use pelage_sim::{Body, End, Material, Root, Settings, Span};
use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

/// A wavy or curly hair along `x`: a helix around its axis, `radius` and `pitch` in metres; 12 cm along the axis.
fn helix(radius: f64, pitch: f64, direction: [f64; 2]) -> Vec<[f64; 3]> {
    (0..=120)
        .map(|i| {
            let s = 0.12 * f64::from(i) / 120.0;
            // The curl grows from nothing, so that the root points along the axis.
            let r = radius * (s / 0.02).min(1.0);
            let (sin, cos) = libm::sincos(TAU * s / pitch);
            let up = r * (1.0 - cos);
            [direction[0] * s - direction[1] * up, direction[1] * s + direction[0] * up, r * sin]
        })
        .collect()
}

fn settings(bend: f64) -> Settings {
    let material = Material { bend_factor: bend, twist_factor: bend, ..Material::default() };
    Settings { sag_free: false, sleep: false, material, ..Settings::default() }
}

fn flat(shot: &Rig) -> Vec<[f64; 2]> {
    shot.hair(0).iter().map(|p| [p.x + 0.25 * p.z, p.y + 0.1 * p.z]).collect()
}

/// A straight hair whose clamped tip is pushed towards the root and turned about its axis.
fn looped(write: Write<'_>) {
    let length = 0.1;
    let points: Vec<[f64; 3]> = (0..=60).map(|i| [length * f64::from(i) / 60.0, 0.0, 0.0]).collect();
    let own = Settings { tip: End::Clamped, ..settings(1.0) };
    let gravity = [0.0, -0.3, 0.0];
    let mut shot = Rig::under(std::slice::from_ref(&points), &own, gravity).unwrap();
    let tip = |t: f64| {
        let angle = 0.5 * 1.6 * TAU * t;
        Root {
            position: [length * (1.0 - 0.75 * t), 0.0, 0.0],
            rotation: [libm::sin(angle), 0.0, 0.0, libm::cos(angle)],
        }
    };
    let frames = 96;
    let mut panels = vec![("ends 10 cm apart".to_string(), vec![flat(&shot)])];
    for frame in 0..frames {
        let at = |k: usize| [tip(k as f64 / frames as f64)];
        let (a, b) = (at(frame), at(frame + 1));
        let span = Span {
            seconds: FRAME,
            time: 0.0,
            motion: &still,
            roots: [&shot.roots, &shot.roots],
            tips: Some([&a, &b]),
            body: &Body::default(),
            gravity: [gravity; 2],
            wind: None,
            still: &[],
        };
        let r = shot.sim.advance(&span, &|_| true).expect("runs on");
        if (frame + 1) % 24 == 0 {
            let t = (frame + 1) as f64 / frames as f64;
            panels.push((format!("{:.1} cm, {:.1} turns", 10.0 * (1.0 - 0.75 * t), 1.6 * t), vec![flat(&shot)]));
            println!("loop: frame {frame}, strain {:.1e}, held {}", r.largest_strain, r.held.len());
        }
    }
    write(
        "hair-loop",
        drawing("A hair clamped at both ends, pushed together and twisted, buckles into a loop", &panels),
    );
}

/// Writes an SVG file's text under a name.
type Write<'a> = &'a dyn Fn(&str, String);

fn main() {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "docs/pictures".to_string());
    draw(&|name, text| {
        std::fs::write(format!("{folder}/{name}.svg"), text).expect("the folder should exist");
    });
}

fn draw(write: Write<'_>) {
    looped(write);
    let hang = [0.0, -1.0];
    // Under changing gravity: pulled straight, then let go.
    let mut shot = Rig::under(&[helix(0.004, 0.02, hang)], &settings(2.0), [0.0; 3]).unwrap();
    let mut panels = vec![("natural shape".to_string(), vec![flat(&shot)])];
    for (gravity, seconds, name) in [
        (150.0, 1.5, "stretched by 150 m/s2"),
        (9.81, 1.0 / 48.0, "1/48 s after letting go"),
        (9.81, 1.0 / 24.0, "1/16 s after"),
        (9.81, 2.0, "2 s after (9.81 m/s2)"),
    ] {
        shot.gravity = [0.0, -gravity, 0.0];
        for _ in 0..(seconds / FRAME).ceil() as usize {
            shot.wait(seconds / (seconds / FRAME).ceil()).unwrap();
        }
        println!("curl: {name}: tip {:.4} m below, strain {:.1e}", -shot.tip(0).y, shot.last.largest_strain);
        panels.push((name.to_string(), vec![flat(&shot)]));
    }
    write("hair-curl", drawing("A curl (stiffness x 2) stretched by gravity and let go", &panels));
    let mut panels = Vec::new();
    for bend in [0.2, 1.0, 5.0, 25.0] {
        let mut shot = Rig::under(&[helix(0.004, 0.02, [1.0, 0.0])], &settings(bend), [0.0, -9.81, 0.0]).unwrap();
        let mut lines = vec![flat(&shot)];
        for frame in 1..=48 {
            shot.wait(FRAME).unwrap();
            if [1, 2, 4, 48].contains(&frame) {
                lines.push(flat(&shot));
            }
        }
        println!("dropped: stiffness {bend}: tip {:?}, strain {:.1e}", shot.tip(0), shot.last.largest_strain);
        panels.push((format!("stiffness x {bend}"), lines));
    }
    let title = "A curly hair dropped: after 0, 1/24, 2/24, 4/24, 2 s (dark)";
    write("hair-stiffness", drawing(title, &panels));
    let mut panels = Vec::new();
    for radius in [0.0, 0.001, 0.002, 0.004] {
        let direction = [libm::cos(0.25 * PI), libm::sin(0.25 * PI)];
        let mut shot = Rig::under(&[helix(radius, 0.015, direction)], &settings(4.0), [0.0, -9.81, 0.0]).unwrap();
        let mut lines = vec![flat(&shot)];
        for frame in 1..=72 {
            shot.wait(FRAME).unwrap();
            if [2, 4, 72].contains(&frame) {
                lines.push(flat(&shot));
            }
        }
        println!("waviness {radius}: tip {:?}, strain {:.1e}", shot.tip(0), shot.last.largest_strain);
        panels.push((format!("waves of {} mm", radius * 1e3), lines));
    }
    let title = "More waves, dropped: after 0, 2/24, 4/24, 3 s (dark); stiffness x 4";
    write("hair-waviness", drawing(title, &panels));
}

/// Hairs side by side as projected lines, each panel with a caption. Coordinates: right, up.
fn drawing(title: &str, panels: &[(String, Vec<Vec<[f64; 2]>>)]) -> String {
    let each = 190.0;
    let width = each * panels.len() as f64 + 20.0;
    let mut bound = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
    for p in panels.iter().flat_map(|p| p.1.iter().flatten()) {
        bound = [bound[0].min(p[0]), bound[1].max(p[0]), bound[2].min(p[1]), bound[3].max(p[1])];
    }
    let scale = ((each - 24.0) / (bound[1] - bound[0])).min((330.0 - 80.0) / (bound[3] - bound[2]));
    let height = 80.0 + scale * (bound[3] - bound[2]);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"12\"><rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\
         <text x=\"14\" y=\"24\" font-size=\"15\" font-weight=\"bold\">{title}</text>\n"
    );
    for (k, (caption, lines)) in panels.iter().enumerate() {
        let x0 = 10.0 + each * (k as f64 + 0.5) - 0.5 * scale * (bound[0] + bound[1]);
        let y0 = 42.0 + scale * bound[3];
        for (i, line) in lines.iter().enumerate() {
            let path: Vec<String> =
                line.iter().map(|p| format!("{:.1},{:.1}", x0 + scale * p[0], y0 - scale * p[1])).collect();
            // Later lines are darker.
            let grey = if lines.len() > 1 { 190 - 170 * i / (lines.len() - 1) } else { 20 };
            let _ = writeln!(
                out,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"rgb({grey},{grey},{grey})\" stroke-width=\"1.6\"/>",
                path.join(" ")
            );
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{caption}</text>",
            10.0 + each * (k as f64 + 0.5),
            height - 12.0
        );
    }
    out + "</svg>\n"
}
