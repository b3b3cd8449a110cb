//! Strands against closed forms and laws.

use pelage_geom::Offsets;
use pelage_sim::{Body, End, Hairs, Material, Model, Rigid, Root, Settings, Simulation, Span};

fn still(_: f64) -> Rigid {
    Rigid::default()
}

/// Material with the given w L^3 / B for a rod of length 1 m under 9.81 m/s2, hardly extensible.
fn material(gamma: f64) -> Material {
    let m = Material { drag_factor: 0.0, damping: 0.0, diameter: 1e-3, ..Material::default() };
    let area = std::f64::consts::FRAC_PI_4 * 1e-6;
    let bend = m.density * area * 9.81 / gamma;
    Material { young: bend / (area * 1e-6 / 16.0), ..m }
}

fn straight(segments: usize) -> Vec<[f64; 3]> {
    (0..=segments).map(|i| [i as f64 / segments as f64, 0.0, 0.0]).collect()
}

fn released(model: Model, segments: usize, steps: u32, gamma: f64, tolerance: f64) -> Vec<[f64; 3]> {
    let points = straight(segments);
    let settings = Settings {
        model,
        root: End::Clamped,
        material: material(gamma),
        substeps: Some(steps),
        sag_free: false,
        tolerance,
        largest_turn: 10.0,
        sleep: false,
        ..Settings::default()
    };
    let offsets = Offsets::uniform(1, points.len());
    let hairs = Hairs { offsets: &offsets, position: &points, id: &[1] };
    let g = [0.0, -9.81, 0.0];
    let (mut sim, _) = Simulation::new(&hairs, &settings, g).unwrap();
    let root = [Root { position: points[0], rotation: [0.0, 0.0, 0.0, 1.0] }];
    let body = Body::default();
    let seconds = (1.0f64 / 9.81).sqrt();
    let mut tips = Vec::new();
    for k in 0..3 {
        let span = Span {
            seconds,
            time: f64::from(k) * seconds,
            motion: &still,
            roots: [&root, &root],
            tips: None,
            body: &body,
            gravity: [g, g],
            wind: None,
        };
        let r = sim.advance(&span, &|_| true).unwrap();
        let p = sim.positions();
        tips.push(p[segments]);
        println!(
            "{segments} segments, {steps} steps: tip {:?} strain {:.1e} solves per node and stage {:.2} subdivided {}",
            p[segments],
            r.largest_strain,
            r.particle_solves as f64 / r.particle_steps as f64 / 2.0,
            r.subdivided
        );
    }
    tips
}

#[test]
fn a_horizontal_rod_swings_as_it_should() {
    let exact = [[0.75934, -0.60859], [0.01636, -0.84852], [0.73460, -0.63972]];
    for (model, segments, steps) in [
        (Model::Rod, 50, 100),
        (Model::Rod, 50, 200),
        (Model::Rod, 100, 400),
        (Model::Springs, 50, 200),
        (Model::Paper, 50, 1000),
    ] {
        let tips = released(model, segments, steps, 9.45, 1e-5);
        for (t, e) in tips.iter().zip(&exact) {
            let error = ((t[0] - e[0]).powi(2) + (t[1] - e[1]).powi(2)).sqrt();
            assert!(error < 5e-3, "{model:?} {segments} segments, {steps} steps: {error}");
        }
    }
}

/// A hair of human thickness, its root at the origin.
fn human(length: f64, direction: [f64; 3], curl: f64, segments: usize) -> Vec<[f64; 3]> {
    (0..=segments)
        .map(|i| {
            let s = length * i as f64 / segments as f64;
            let a = 60.0 * s;
            let side = [curl * (libm::cos(a) - 1.0), curl * libm::sin(a)];
            [direction[0] * s + side[0], direction[1] * s + side[1], direction[2] * s]
        })
        .collect()
}

#[test]
fn a_groomed_pose_stays() {
    for (length, direction, curl) in [
        (0.1, [1.0, 0.0, 0.0], 0.0),
        (0.2, [1.0, 0.0, 0.0], 0.0),
        (0.3, [1.0, 0.0, 0.0], 0.0),
        (0.2, [0.6, -0.8, 0.0], 0.004),
        (0.2, [0.0, 1.0, 0.0], 0.0),
        (0.05, [0.0, 1.0, 0.0], 0.0),
    ] {
        let points = human(length, direction, curl, 40);
        let offsets = Offsets::uniform(1, points.len());
        let settings = Settings {
            material: Material { drag_factor: 0.0, ..Material::default() },
            sleep: false,
            ..Settings::default()
        };
        let g = [0.0, -9.81, 0.0];
        let hairs = Hairs { offsets: &offsets, position: &points, id: &[1] };
        let (mut sim, started) = Simulation::new(&hairs, &settings, g).unwrap();
        let root = [Root { position: points[0], rotation: [0.0, 0.0, 0.0, 1.0] }];
        let body = Body::default();
        for k in 0..24 {
            let span = Span {
                seconds: 1.0 / 24.0,
                time: f64::from(k) / 24.0,
                motion: &still,
                roots: [&root, &root],
                tips: None,
                body: &body,
                gravity: [g, g],
                wind: None,
            };
            sim.advance(&span, &|_| true).unwrap();
        }
        let p = sim.positions();
        let drift = p
            .iter()
            .zip(&points)
            .map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt())
            .fold(0.0, f64::max);
        println!(
            "length {length} direction {direction:?} curl {curl}: drift {:.1e} L, gamma {:.1}, stiffened {:?}",
            drift / length,
            started.largest_gamma,
            started.stiffened
        );
    }
}

#[test]
fn a_violent_shake_stays_bounded_at_every_step() {
    // 10 g at 5 Hz, sideways.
    let amplitude = 98.1 / (2.0 * std::f64::consts::PI * 5.0f64).powi(2);
    for fps in [1667.0, 480.0, 120.0, 24.0, 12.0, 1.0] {
        let points = human(0.2, [0.0, -1.0, 0.0], 0.0, 50);
        let offsets = Offsets::uniform(1, points.len());
        let settings = Settings {
            material: Material { drag_factor: 0.0, ..Material::default() },
            substeps: Some(1),
            ..Settings::default()
        };
        let g = [0.0, -9.81, 0.0];
        let hairs = Hairs { offsets: &offsets, position: &points, id: &[1] };
        let (mut sim, _) = Simulation::new(&hairs, &settings, g).unwrap();
        let root = [Root { position: points[0], rotation: [0.0, 0.0, 0.0, 1.0] }];
        let body = Body::default();
        let (mut strain, mut fast, mut solves, mut steps, mut held) = (0.0f64, 0.0f64, 0, 0, 0);
        for k in 0..(2.0 * fps) as usize {
            let start = k as f64 / fps;
            let motion = move |f: f64| Rigid {
                translation: [amplitude * libm::sin(2.0 * std::f64::consts::PI * 5.0 * (start + f / fps)), 0.0, 0.0],
                ..Rigid::default()
            };
            let span = Span {
                seconds: 1.0 / fps,
                time: start,
                motion: &motion,
                roots: [&root, &root],
                tips: None,
                body: &body,
                gravity: [g, g],
                wind: None,
            };
            let r = sim.advance(&span, &|_| true).unwrap();
            strain = strain.max(r.largest_strain);
            held += r.held.len();
            solves += r.particle_solves;
            steps += r.particle_steps;
            fast =
                sim.velocities().iter().map(|v| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()).fold(fast, f64::max);
        }
        println!(
            "fps {fps}: strain {strain:.1e} fastest {fast:.1} m/s solves/step {:.2} steps {} held {held}",
            solves as f64 / steps as f64,
            steps / 52
        );
        assert!(strain <= 0.01 && held == 0);
    }
}
