//! Interpolation of 1,000,000 hairs x 12 points from 1,000 control hairs: nanoseconds a point, wall clock, on one and two
//! threads, beside the rate at which the same threads fill the same memory with a constant.
//!
//! `cargo bench -p pelage-groom --bench interpolate`
// A benchmark has to read the clock, which the crate itself must not.
#![allow(clippy::disallowed_methods)]

mod common;

use common::{CONTROLS, controls, u};
use pelage_groom::interpolate::{Blend, interpolate};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

const HAIRS: usize = 1_000_000;
const RUNS: usize = 15;

fn main() {
    for points in [12, 4, 8, 16] {
        measure(points, false);
    }
    measure(12, true);
}

/// Times one case. `scattered` gives every hair three arbitrary control hairs instead of those of its neighbours.
fn measure(points: usize, scattered: bool) {
    let controls = controls(points);
    let control = |i: usize, k: u64| {
        let near = i * CONTROLS / HAIRS;
        let any = (u(i, k) * CONTROLS as f64) as usize;
        (if scattered { any } else { (near + any % 40) % CONTROLS }) as u32
    };
    let root: Vec<[f32; 3]> = (0..HAIRS).map(|i| std::array::from_fn(|k| u(i, k as u64 + 9) as f32 * 20.0)).collect();
    let hair: Vec<[u32; 3]> = (0..HAIRS).map(|i| [control(i, 0), control(i, 1), control(i, 2)]).collect();
    let weight: Vec<[f32; 3]> = (0..HAIRS)
        .map(|i| {
            let (a, b) = (u(i, 4) as f32 * 0.5, u(i, 5) as f32 * 0.5);
            [1.0 - a - b, a, b]
        })
        .collect();
    let length: Vec<f32> = (0..HAIRS).map(|i| 2.0 + u(i, 6) as f32).collect();
    let hairs = Blend { root: &root, hair: &hair, weight: &weight, length: &length };
    let mut out = vec![[0.0f32; 3]; HAIRS * points];
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        let (fill, blend) = pool.install(|| {
            let fill = best(|| out.par_chunks_mut(12_288).for_each(|c| c.fill(black_box([1.0; 3]))));
            let zero = best(|| out.par_chunks_mut(12_288).for_each(|c| c.as_flattened_mut().fill(0.0)));
            (fill.min(zero), best(|| _ = black_box(interpolate(&hairs, &controls, &mut out))))
        });
        let total = (HAIRS * points) as f64;
        println!(
            "{HAIRS} hairs x {points:2} points, {} controls, {threads} thread(s): {:5.2} ns/point ({:5.1} ms), \
             writes {:4.1} GB/s = {:3.0} % of a plain fill ({:4.1} GB/s)",
            if scattered { "scattered" } else { "near" },
            blend * 1e9 / total,
            blend * 1e3,
            total * 12.0 / blend / 1e9,
            100.0 * fill / blend,
            total * 12.0 / fill / 1e9,
        );
    }
}

/// The shortest of some runs, seconds.
fn best(mut f: impl FnMut()) -> f64 {
    (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            f();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}
