//! Time of a strand step without contact, nanoseconds per node, on one thread.
//!
//! `cargo run --release -p pelage-sim --example strand_speed`
#![allow(clippy::disallowed_methods, missing_docs)]

use pelage_geom::Offsets;
use pelage_sim::{Body, Hairs, Material, Rigid, Root, Settings, Simulation, Span};
use std::time::Instant;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for (hairs, curve, wide) in [(64, 0.3, true), (64, 0.3, false), (4096, 0.3, true), (4096, 0.0, true)] {
            measure(hairs, 50, curve, wide);
        }
    });
}

fn measure(count: usize, segments: usize, curve: f64, wide: bool) {
    let mut position = Vec::new();
    let mut roots = Vec::new();
    let id: Vec<u64> = (0..count as u64).collect();
    for h in 0..count {
        let z = h as f64 * 1e-3;
        roots.push(Root { position: [0.0, 0.0, z], rotation: [0.0, 0.0, 0.0, 1.0] });
        for i in 0..=segments {
            let s = 0.2 * i as f64 / segments as f64;
            position.push([s, -curve * s * s, z]);
        }
    }
    let offsets = Offsets::uniform(count, segments + 1);
    let settings = Settings {
        material: Material { drag_factor: 0.0, ..Material::default() },
        substeps: Some(8),
        sag_free: false,
        sleep: false,
        wide,
        ..Settings::default()
    };
    let hairs = Hairs { offsets: &offsets, position: &position, id: &id, material: &[] };
    let g = [0.0, -9.81, 0.0];
    let (mut sim, _) = Simulation::new(&hairs, &settings, g).unwrap();
    let body = Body::default();
    let still = |_: f64| Rigid::default();
    let mut best = f64::INFINITY;
    let mut solve = f64::INFINITY;
    let mut ratio = 0.0;
    for k in 0..if wide { 12 } else { 3 } {
        let span = Span {
            seconds: 1.0 / 24.0,
            time: f64::from(k) / 24.0,
            motion: &still,
            roots: [&roots, &roots],
            tips: None,
            body: &body,
            gravity: [g, g],
            wind: None,
            still: &[],
        };
        let start = Instant::now();
        let r = sim.advance(&span, &|_| true).unwrap();
        let t = start.elapsed().as_secs_f64() * 1e9;
        best = best.min(t / r.particle_steps as f64);
        solve = solve.min(t / r.particle_solves as f64);
        ratio = r.particle_solves as f64 / r.particle_steps as f64;
    }
    println!(
        "{count} hairs x {segments}, curved by {curve}, wide {wide}: {best:.1} ns a node and step, {solve:.1} a node and solve; {ratio:.2} solves a step"
    );
}
