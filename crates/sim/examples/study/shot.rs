//! Hair on a ball: the change from a step to half of it, and how long many hairs take.

use crate::plot::{Plot, Series};
use crate::{Write, on_threads};
use pelage_sim::rig::{GRAVITY, Rig, ball, tuft, turned};
use pelage_sim::{Body, Field, Part, Rigid, Settings, Shape, Vec3};
use std::f64::consts::TAU;
use std::time::Instant;

const RADIUS: f64 = 0.09;
const FPS: f64 = 24.0;

/// The ball shakes once a second by 1 rad to both sides.
fn shake(frame: usize, f: f64) -> Rigid {
    turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(TAU * (frame as f64 + f) / FPS))
}

fn advance(shot: &mut Rig, frame: usize, field: Option<&Field>) {
    let motion = move |f: f64| shake(frame, f);
    let parts = field.iter().map(|f| Part { motion: &motion, shape: Shape::Field(f), exact: None }).collect();
    shot.go(1.0 / FPS, &motion, &Body { parts, seconds: 1.0 / FPS }, None).unwrap();
}

/// Points of all frames.
fn play(hairs: &[Vec<[f64; 3]>], substeps: u32, field: Option<&Field>) -> (Vec<Vec<[f64; 3]>>, f64, u64) {
    let settings = Settings { substeps: Some(substeps), ..Settings::default() };
    let mut shot = Rig::under(hairs, &settings, GRAVITY).unwrap();
    let start = Instant::now();
    let mut own = 0;
    let frames = (0..24)
        .map(|frame| {
            advance(&mut shot, frame, field);
            own += shot.last.subdivided;
            shot.sim.positions()
        })
        .collect();
    (frames, start.elapsed().as_secs_f64(), own)
}

/// Lower, middle or upper values of a list.
fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q).round() as usize]
}

pub fn halved(write: Write) {
    let field = ball(RADIUS).field;
    let (length, segments) = (0.2, 40);
    let hairs = tuft(RADIUS, 200, length, segments + 1);
    let mut series = Vec::new();
    println!(
        "body,substeps,rms_all,frame_rms_median,frame_rms_p95,hair_rms_median,hair_rms_p95,seconds,strands_halved"
    );
    for (name, body) in [("free", None), ("ball", Some(&field))] {
        let mut coarse = play(&hairs, 4, body);
        let (mut all, mut median, mut high) = (Vec::new(), Vec::new(), Vec::new());
        for substeps in [4, 8, 16, 32] {
            let fine = play(&hairs, 2 * substeps, body);
            let (mut frames, mut each, mut sum) = (Vec::new(), Vec::new(), 0.0);
            for (a, b) in coarse.0.iter().zip(&fine.0) {
                let square = |p: &[f64; 3], q: &[f64; 3]| (Vec3::from(*p) - Vec3::from(*q)).norm_squared();
                let mut whole = 0.0;
                for (p, q) in a.chunks(segments + 1).zip(b.chunks(segments + 1)) {
                    let mean = p.iter().zip(q).map(|(p, q)| square(p, q)).sum::<f64>() / p.len() as f64;
                    each.push(mean.sqrt() / length);
                    whole += mean / hairs.len() as f64;
                }
                frames.push(whole.sqrt() / length);
                sum += whole / (24.0 * length * length);
            }
            let found = [
                sum.sqrt(),
                quantile(&mut frames, 0.5),
                quantile(&mut frames, 0.95),
                quantile(&mut each, 0.5),
                quantile(&mut each, 0.95),
            ];
            let text: Vec<String> = found.iter().map(|f| format!("{f:.3e}")).collect();
            println!("{name},{substeps},{},{:.2},{}", text.join(","), coarse.1, coarse.2);
            all.push([f64::from(substeps), found[1]]);
            median.push([f64::from(substeps), found[3]]);
            high.push([f64::from(substeps), found[2]]);
            coarse = fine;
        }
        let who = if body.is_some() { "on the ball" } else { "no body" };
        let mark = Some(all[1]);
        series.push(Series { mark, ..Series::new(format!("{who}: median frame"), all) });
        series.push(Series::new(format!("{who}: 95th percentile"), high));
        series.push(Series::new(format!("{who}: median hair"), median));
    }
    let axes = ["steps a frame (24 a second)", "RMS change when the step is halved, lengths"];
    let title = "200 hairs of 20 cm on a shaking ball, in air (ring: default)";
    write("shot-step", Plot { title, axes, log: [true; 2], series }.svg());
}

/// Peak memory of the process, megabytes.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("0 0");
    line.split_whitespace().nth(1).and_then(|v| v.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

/// Processor time of the process, seconds.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or_default();
    // Fields 14 and 15 of the line, in hundredths of a second.
    after.split_whitespace().skip(11).take(2).filter_map(|v| v.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Seconds a frame on two threads. A third argument is the number of hairs.
pub fn many() {
    let count = std::env::args().nth(3).and_then(|v| v.parse().ok()).unwrap_or(10_000);
    let field = ball(RADIUS).field;
    let hairs = tuft(RADIUS, count, 0.2, 51);
    let frames = 2;
    on_threads(2, || {
        for solid in [true, false] {
            let start = Instant::now();
            let mut shot = Rig::under(&hairs, &Settings::default(), GRAVITY).unwrap();
            println!("# {count} hairs x 50 segments, body {solid}: prepared in {:.2} s", start.elapsed().as_secs_f64());
            println!(
                "frame,seconds,processor_seconds,steps,solves_per_step,subdivided,ns_per_node_and_step,held,peak_MB"
            );
            for frame in 0..frames {
                let (start, cpu) = (Instant::now(), processor());
                advance(&mut shot, frame, solid.then_some(&field));
                let (t, cpu) = (start.elapsed().as_secs_f64(), processor() - cpu);
                let r = &shot.last;
                println!(
                    "{frame},{t:.2},{cpu:.2},{},{:.2},{},{:.0},{},{:.0}",
                    r.steps,
                    r.particle_solves as f64 / r.particle_steps as f64,
                    r.subdivided,
                    cpu * 1e9 / r.particle_steps as f64,
                    r.held.len(),
                    peak()
                );
            }
        }
    });
}
