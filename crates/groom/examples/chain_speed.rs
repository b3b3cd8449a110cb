//! Time of finding all pairs of hairs that meet: a scalp of curly hairs as polylines and as splines; and against an
//! ellipsoid.
#![allow(missing_docs, clippy::disallowed_methods)]

use nalgebra::UnitQuaternion;
use pelage_geom::{Offsets, Vec3, rng};
use pelage_groom::chain::{Chains, ellipsoid, pairs};
use pelage_groom::spline::BSpline;
use std::time::Instant;

const POINTS: usize = 12;
const RADIUS: f64 = 0.004;

/// Hairs of 6 cm on the upper half of a sphere of 10 cm: along the normal, bent down, with curls of 3 mm.
fn hairs(n: usize) -> Vec<Vec<Vec3>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..n)
        .map(|k| {
            let z = 1.0 - (k as f64 + 0.5) / n as f64;
            let (r, a) = ((1.0 - z * z).sqrt(), golden * k as f64);
            let normal = Vec3::new(r * libm::cos(a), r * libm::sin(a), z);
            let side = normal.cross(&Vec3::new(0.3, 0.5, 0.8)).normalize();
            let phase = 6.3 * rng::uniform(1, k as u64, 0, 0);
            (0..POINTS)
                .map(|i| {
                    let t = i as f64 / (POINTS - 1) as f64;
                    let curl = 0.3 * t;
                    let (s, c) = (libm::sin(phase + 9.0 * t), libm::cos(phase + 9.0 * t));
                    normal * (10.0 + 6.0 * t) - Vec3::z() * (3.0 * t * t) + (side * c + normal.cross(&side) * s) * curl
                })
                .collect()
        })
        .collect()
}

fn main() {
    for n in [10_000, 100_000] {
        let hairs = hairs(n);
        let position: Vec<[f32; 3]> = hairs.iter().flatten().map(|p| p.cast::<f32>().into()).collect();
        let offsets = Offsets::uniform(n, POINTS);
        let mut clock = Instant::now();
        let mut lap = |what: String| {
            println!("{n} hairs, {what}: {:.0} ms", clock.elapsed().as_secs_f64() * 1e3);
            clock = Instant::now();
        };
        let chains = Chains::of_polylines(&position, &offsets, &vec![RADIUS as f32; position.len()]).expect("chains");
        lap("chains".into());
        for margin in [0.0, 0.01, 0.05] {
            let c = pairs::check(&chains, margin, 10).expect("a check");
            lap(format!("margin {margin}: {} near, {} meet, {} hairs", c.near, c.meeting, c.hairs_meeting));
        }
        let axes = Vec3::new(10.5, 10.2, 10.0);
        let body = ellipsoid::Ellipsoid::new(Vec3::zeros(), UnitQuaternion::identity(), axes).expect("an ellipsoid");
        lap(format!("{} contacts with an ellipsoid", ellipsoid::contacts(&chains, &body, 0.0).len()));
        let curve: Vec<BSpline> = hairs.iter().map(|h| BSpline::near(h, 8).expect("a spline")).collect();
        lap("splines of 8 control points".into());
        for tolerance in [0.02, 0.002] {
            let bound = Chains::of_splines(&curve, &vec![RADIUS; n], tolerance).expect("chains");
            let links: usize = (0..n).map(|s| bound.links(s)).sum();
            lap(format!("fitted to {tolerance} by {:.1} links a hair", links as f64 / n as f64));
            let c = pairs::check(&bound, 0.0, 10).expect("a check");
            lap(format!("{} may meet", c.near));
        }
    }
}
