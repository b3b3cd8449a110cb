//! Hair against solid bodies.

mod common;

use common::{GRAVITY, Rig, Vec3, ball, fall_over_drum, in_vacuum, loose, tuft, turned};
use pelage_sim::reference::formula;
use pelage_sim::{Body, Exact, Material, Model, Part, Settings, Shape};

#[test]
fn hair_on_a_shaking_ball_stays_outside() {
    let radius = 0.09;
    let b = ball(radius);
    let hairs = tuft(radius, 64, 0.2, 41);
    for (speed, friction) in [(1.0, 0.0), (1.0, 0.3), (10.0, 0.3)] {
        let mut shot = Rig::under(&hairs, &Settings { friction, ..Settings::default() }, GRAVITY).unwrap();
        for frame in 0..12 {
            let angle = |f: f64| 1.0 * libm::sin(speed * 2.0 * std::f64::consts::PI * 1.0 * (frame as f64 + f) / 24.0);
            let motion = move |f: f64| turned(Vec3::new(0.2, 1.0, 0.0), angle(f));
            let body = Body {
                parts: vec![Part {
                    motion: &motion,
                    shape: Shape::Field(&b.field),
                    exact: Some(Exact { bvh: &b.bvh, triangle: &b.mesh.triangle, velocity: None }),
                }],
                seconds: 1.0 / 24.0,
            };
            shot.go(1.0 / 24.0, &motion, &body, None).unwrap();
            let at = body.at(1.0);
            let mut deepest = 0.0f64;
            for h in 0..hairs.len() {
                for p in &shot.hair(h)[1..] {
                    if let Some(hit) = at.exact(*p, 0.0) {
                        deepest = deepest.max(-hit.distance);
                    }
                }
            }
            assert!(deepest < 1e-4, "frame {frame}: {deepest}");
        }
    }
}

#[test]
fn hair_in_contact_moves_as_if_it_were_alone() {
    let radius = 0.09;
    let b = ball(radius);
    // Some lie on the ball, some stand off, and lengths differ.
    let hairs: Vec<Vec<[f64; 3]>> = (0..11)
        .map(|k| tuft(radius, 11, 0.05 + 0.015 * f64::from(k), 12 + 2 * k as usize)[k as usize].clone())
        .collect();
    let play = |hairs: &[Vec<[f64; 3]>], wide: bool| {
        let mut shot = Rig::under(hairs, &Settings { wide, ..Settings::default() }, GRAVITY).unwrap();
        for frame in 0..6 {
            let motion = move |f: f64| turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(0.8 * (f64::from(frame) + f)));
            let part = Part { motion: &motion, shape: Shape::Field(&b.field), exact: None };
            shot.go(1.0 / 24.0, &motion, &Body { parts: vec![part], seconds: 1.0 / 24.0 }, None).unwrap();
        }
        shot
    };
    let together = play(&hairs, true);
    assert_eq!(together.sim.save(), play(&hairs, false).sim.save());
    for (h, hair) in hairs.iter().enumerate() {
        assert_eq!(together.hair(h), play(std::slice::from_ref(hair), true).hair(0), "hair {h}");
    }
}

/// Length that hangs on the far side of a drum when a string of weight w just slips: T' = mu (T + w R sin a) + w R cos a
/// (capstan with the string's own weight on the drum), from the near side's tangent point over half a turn.
fn slips_at(near: f64, radius: f64, mu: f64) -> f64 {
    let n = 20_000;
    let h = std::f64::consts::PI / f64::from(n);
    (0..n).fold(near, |t, k| {
        let slope = |a: f64, t: f64| mu * (t + radius * libm::sin(a)) + radius * libm::cos(a);
        let a = f64::from(k) * h;
        let middle = t + 0.5 * h * slope(a, t);
        t + h * slope(a + 0.5 * h, middle)
    })
}

#[test]
fn a_string_slips_over_a_drum_where_the_capstan_says() {
    let (radius, near, mu) = (0.01, 0.05, 0.3);
    let limit = slips_at(near, radius, mu);
    assert!((formula::slips_over_drum(near, radius, mu) / limit - 1.0).abs() < 1e-6);
    let soft = Material { bend_factor: 1e-3, twist_factor: 1e-3, ..in_vacuum() };
    let settings = Settings { material: soft, ..loose(Model::Rod, mu, 1e-4) };
    for (factor, slips) in [(0.96, false), (0.98, false), (1.02, true), (1.04, true)] {
        let fell = fall_over_drum(&settings, 360, radius, [near, limit * factor]).unwrap();
        println!("{factor} of the limit: fell {:.4} mm", fell * 1e3);
        assert_eq!(fell > 2e-4, slips, "{factor}: {fell}");
    }
}
