//! Time of a flow around a sphere of panels: assembling and factoring, solving, filling the grid, tracing streamlines.
#![allow(missing_docs, clippy::disallowed_methods)]

use pelage_geom::{Bvh, Topology, Vec3, shapes};
use pelage_groom::flow::trace::{Guard, Start, Trace, trace};
use pelage_groom::flow::{Body, Element, Fast, Grid, OPENING};
use std::time::Instant;

const HAIRS: usize = 20_000;
const RADIUS: f64 = 10.0;

fn main() {
    let mut clock = Instant::now();
    let mut lap = |what: &str| {
        println!("{what}: {:.0} ms", clock.elapsed().as_secs_f64() * 1e3);
        clock = Instant::now();
    };
    let mesh = shapes::cube_sphere(9, RADIUS);
    let body = Body::new(&mesh.position, &mesh.triangle).expect("a body");
    lap(&format!("{} panels assembled and factored", body.panels().len()));
    let elements = [
        Element::Stream { velocity: Vec3::new(0.0, -1.0, 0.0) },
        Element::Source { at: Vec3::new(0.0, 4.0, 16.0), strength: 400.0, core: 0.5 },
        Element::Filament {
            points: vec![Vec3::new(-12.0, -9.0, 8.0), Vec3::new(12.0, -9.0, 8.0)],
            strength: 20.0,
            core: 0.5,
        },
    ];
    let scalp = |p: Vec3| p.y > 0.3 * RADIUS;
    let normal: Vec<f64> = body.panels().iter().map(|p| if scalp(p.centre) { 0.7 } else { 0.0 }).collect();
    let strength = body.solve(&elements, &normal).expect("strengths");
    lap("solved");
    let fast = Fast::new(body.flow(&elements, &strength), OPENING);
    lap("grouped");
    let grid = Grid::fill(&fast, Vec3::new(-18.0, -30.0, -18.0), Vec3::new(18.0, 14.0, 18.0), 0.6).expect("a grid");
    lap("grid filled");
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let starts: Vec<Start> = (0..HAIRS)
        .map(|k| {
            let y = 1.0 - 0.6 * (k as f64 + 0.5) / HAIRS as f64;
            let (s, c) = libm::sincos(golden * k as f64);
            let direction = Vec3::new(c * (1.0 - y * y).sqrt(), y, s * (1.0 - y * y).sqrt());
            Start { at: direction * RADIUS, direction, length: 25.0 }
        })
        .collect();
    let settings = Trace { points: 100, step: 0.0, reverse: false, slow: 0.0 };
    clock_of("traced, steps of one chord", || trace(|_, p| grid.velocity(p), &starts, &settings, None));
    let longer = Trace { step: 0.5, ..settings };
    let lines = clock_of("traced, steps of two chords", || trace(|_, p| grid.velocity(p), &starts, &longer, None));
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(&mesh));
    let guard = Guard { surface: &bvh, clearance: 0.05 };
    clock_of("traced with a guard", || trace(|_, p| grid.velocity(p), &starts, &longer, Some(&guard)));
    let some: Vec<Start> = starts.iter().copied().step_by(20).collect();
    let plain = clock_of("traced, 1 of 20, without the grid", || trace(|_, p| fast.velocity(p), &some, &longer, None));
    let off = |h: usize| (lines.line(20 * h)[99] - plain.line(h)[99]).norm();
    let mut off: Vec<f64> = (0..some.len()).map(off).collect();
    off.sort_by(f64::total_cmp);
    println!("tips off by the grid: median {:.1e}, 95 % {:.1e}, most {:.1e}", off[500], off[950], off[999]);
}

fn clock_of<T>(what: &str, f: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let out = f();
    println!("{what}: {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
    out
}
