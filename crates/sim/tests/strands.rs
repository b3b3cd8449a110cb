//! Strands in motion, at rest and under abuse.

mod common;

use common::{GRAVITY, Rig, Vec3, plain, rod, straight};
use pelage_sim::{Body, Material, Model, Rigid, Settings};

/// Tips of a horizontal rod at 1, 2, 3 sqrt(L / g) after its release.
fn released(model: Model, segments: usize, steps: u32, gamma: f64, tolerance: f64) -> Vec<Vec3> {
    let settings = Settings { substeps: Some(steps), tolerance, ..plain(model, rod(gamma)) };
    let mut shot = Rig::under(&[straight(segments, Vec3::x())], &settings, GRAVITY).unwrap();
    let tip = |_| {
        shot.wait((1.0f64 / common::G).sqrt()).unwrap();
        shot.tip(0)
    };
    (0..3).map(tip).collect()
}

#[test]
fn a_horizontal_rod_swings_as_it_should() {
    let exact = [[0.75934, -0.60859], [0.01636, -0.84852], [0.73460, -0.63972]];
    for (model, segments, steps) in [
        (Model::Rod, 50, 100),
        (Model::Rod, 50, 200),
        (Model::Rod, 100, 400),
        // Springs are second order in space too, with a larger constant.
        (Model::Springs, 100, 400),
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

fn without_air() -> Material {
    Material { drag_factor: 0.0, ..Material::default() }
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
        let settings = Settings { material: without_air(), sleep: false, ..Settings::default() };
        let mut shot = Rig::under(std::slice::from_ref(&points), &settings, GRAVITY).unwrap();
        shot.steps(24, 1.0 / 24.0).unwrap();
        let hair = shot.hair(0);
        let drift = hair.iter().zip(&points).map(|(a, b)| (a - Vec3::from(*b)).norm()).fold(0.0, f64::max);
        assert!(drift < 1e-9 * length, "length {length} direction {direction:?} curl {curl}: {drift} m");
    }
}

#[test]
fn a_violent_shake_stays_bounded_at_every_step() {
    // 10 g at 5 Hz, sideways.
    let rate = 2.0 * std::f64::consts::PI * 5.0;
    let amplitude = 98.1 / (rate * rate);
    let settings = Settings { material: without_air(), substeps: Some(1), ..Settings::default() };
    for fps in [1667.0, 480.0, 120.0, 24.0, 12.0, 1.0] {
        let mut shot = Rig::under(&[human(0.2, [0.0, -1.0, 0.0], 0.0, 50)], &settings, GRAVITY).unwrap();
        for k in 0..(2.0 * fps) as usize {
            let start = k as f64 / fps;
            let motion = move |f: f64| Rigid {
                translation: [amplitude * libm::sin(rate * (start + f / fps)), 0.0, 0.0],
                ..Rigid::default()
            };
            shot.go(1.0 / fps, &motion, &Body::default(), None).unwrap();
            let last = &shot.last;
            assert!(last.largest_strain <= 0.01 && last.held.is_empty(), "{fps} steps a second: {last:?}");
        }
    }
}

#[test]
fn the_papers_nine_steps_run_in_a_shot() {
    // Let go level and at rest: in a tenth of a second rods and springs have hardly parted.
    let level: Vec<[f64; 3]> = (0..=20).map(|i| [0.005 * f64::from(i), 0.0, 0.0]).collect();
    let fall = |model| {
        let settings = Settings { model, sag_free: false, material: common::in_vacuum(), ..Settings::default() };
        let mut shot = Rig::under(std::slice::from_ref(&level), &settings, GRAVITY).unwrap();
        shot.steps(3, 1.0 / 24.0).unwrap();
        assert!(shot.last.held.is_empty());
        shot.tip(0)
    };
    let (paper, rod) = (fall(Model::Paper), fall(Model::Rod));
    println!("{paper:?} {rod:?}");
    assert!(rod.y < -0.02 && (paper - rod).norm() < 0.01);
    // Curls have flat tetrahedra that bear no load: stiffened within bounds, and never longer than twice themselves.
    let curls: Vec<Vec<[f64; 3]>> = (0..6)
        .map(|k| {
            let at = |i: i32| {
                let s = 0.2 * f64::from(i) / 40.0;
                let turn = 100.0 * s + f64::from(k);
                [0.004 * libm::sin(turn), -s * (0.2 * f64::from(k) - 0.5), 0.004 * libm::cos(turn) + 0.5 * s]
            };
            (0..=40).map(at).collect()
        })
        .collect();
    let settings = Settings { model: Model::Paper, ..Settings::default() };
    let mut shot = Rig::under(&curls, &settings, GRAVITY).unwrap();
    assert!(shot.started.stiffened.iter().all(|s| s.factor <= 64.0), "{:?}", shot.started.stiffened);
    for _ in 0..12 {
        shot.wait(1.0 / 24.0).unwrap();
        for (h, curl) in curls.iter().enumerate() {
            let long = |p: &[Vec3]| p.windows(2).map(|w| (w[1] - w[0]).norm()).sum::<f64>();
            let natural: Vec<Vec3> = curl.iter().map(|p| Vec3::from(*p)).collect();
            assert!(long(&shot.hair(h)) <= 2.001 * long(&natural), "hair {h}");
        }
    }
}
