//! How much work the solver does on small fixed inputs: a gate for speed that needs no clock.
//!
//! Times change with the machine, counts of operations do not. What makes one operation dearer is not seen here but in the
//! benchmarks.

mod common;

use common::{GRAVITY, Rig, Vec3, ball, tuft, turned};
use pelage_sim::{Body, Model, Part, Settings, Shape};

/// A count may be this part away from what it was. More work wants a reason; less is written down here too.
const TOLERANCE: f64 = 0.02;

#[test]
fn a_nodding_ball_of_hair_takes_as_many_steps_and_solves() {
    let body = ball(0.1);
    let count = |model: Model| {
        let settings = Settings { model, ..Settings::default() };
        let mut shot = Rig::under(&tuft(0.1, 40, 0.12, 20), &settings, GRAVITY).unwrap();
        let mut found = [0, 0];
        for frame in 0..12 {
            let nod = move |f: f64| turned(Vec3::x(), 0.4 * libm::sin(0.4 * (f64::from(frame) + f)));
            let part = Part { motion: &nod, shape: Shape::Field(&body.field), exact: None };
            shot.go(1.0 / 24.0, &nod, &Body { parts: vec![part], seconds: 1.0 / 24.0 }, None).unwrap();
            found[0] += shot.last.particle_steps;
            found[1] += shot.last.particle_solves;
        }
        found
    };
    let near = |f: u64, e: u64| (f as f64 / e as f64 - 1.0).abs() < TOLERANCE;
    // Points times steps, and points times solves.
    for (model, before) in [(Model::Rod, [80_640, 548_583]), (Model::Springs, [158_096, 1_116_348])] {
        let now = count(model);
        assert!(near(now[0], before[0]) && near(now[1], before[1]), "{model:?}: {now:?} instead of {before:?}");
    }
}
