//! The preview of a ball of hair at 1280 x 960: wall clock on one and two threads.
//!
//! `cargo bench -p pelage-light --bench preview`
// A benchmark has to read the clock, which the crate itself must not.
#![allow(clippy::disallowed_methods)]

use pelage_geom::{Offsets, Vec3, rng};
use pelage_light::shadow::{ShadowHair, ShadowSettings, Source, transmittance};
use pelage_light::{Camera, HairView, Scene, Settings, SkinView, render, studio_lights};
use std::hint::black_box;
use std::time::Instant;

const SIZE: [usize; 2] = [1280, 960];
const RUNS: usize = 5;

fn main() {
    println!("{:>8} {:>7} {:>6} {:>8} {:>10} {:>10}", "hairs", "points", "maps", "threads", "best s", "median s");
    for (hairs, points, maps) in [(0, 2, false), (25_000, 12, false), (100_000, 25, false), (100_000, 25, true)] {
        measure(hairs, points, maps);
    }
}

/// Times one case: hairs of two radii all over a ball, bent downwards; with `maps`, what reaches them of each light is known.
fn measure(hairs: usize, points: usize, maps: bool) {
    let u = |id: usize, k: u64| rng::uniform(1, id as u64, 2, k);
    let mut position = Vec::with_capacity(hairs * points);
    let mut normal: Vec<[f32; 3]> = Vec::with_capacity(hairs);
    for i in 0..hairs {
        let (z, a) = (2.0 * u(i, 0) - 1.0, std::f64::consts::TAU * u(i, 1));
        let r = (1.0 - z * z).max(0.0).sqrt();
        let n = Vec3::new(r * libm::cos(a), z, r * libm::sin(a));
        let length = 1.6 + 0.8 * u(i, 2);
        for k in 0..points {
            let s = k as f64 / (points - 1) as f64;
            let out = 1.0 + 0.35 * length * s * (1.0 - 0.5 * s);
            let p = n * out - Vec3::y() * (0.7 * length * s * s);
            position.push(p.cast::<f32>().into());
        }
        normal.push(n.cast::<f32>().into());
    }
    let offsets = Offsets::uniform(hairs, points);
    let camera = Camera::frame(([-1.4, -2.0, -1.4], [1.4; 3]), [-0.4, -0.2, -1.0], [0.0, 1.0, 0.0], 4.0 / 3.0);
    let lights = studio_lights(&camera);
    let width = vec![0.002; position.len()];
    let shadow = ShadowHair { offsets: &offsets, position: &position, origin: [0.0; 3], width: &width, opacity: &[] };
    let known: Vec<Vec<f32>> = lights[..if maps { lights.len() } else { 0 }]
        .iter()
        .map(|l| {
            let source = Source::Directional { direction: Vec3::from(l.direction) };
            let (mut light, _) = transmittance(source, &[shadow], &[], &ShadowSettings::default()).expect("a light");
            light.remove(0)
        })
        .collect();
    let layers = [HairView {
        offsets: &offsets,
        position: &position,
        origin: [0.0; 3],
        width: &width,
        color: &[],
        opacity: &[],
        root_normal: &normal,
        shine: &[],
        side: &[],
        transmittance: &known,
    }];
    let (vertex, triangle) = ball(120);
    let smooth: Vec<[f32; 3]> = vertex.iter().map(|p| p.map(|v| v as f32)).collect();
    let skin = SkinView { position: &vertex, triangle: &triangle, normal: &smooth, color: [0.42, 0.31, 0.26] };
    let scene = Scene { skin: Some(skin), layers: &layers, lights: &lights, background: [0.16; 3] };
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let mut seconds: Vec<f64> = (0..RUNS)
            .map(|_| {
                let start = Instant::now();
                black_box(pool.install(|| render(&scene, &camera, SIZE[0], SIZE[1], &Settings::default())));
                start.elapsed().as_secs_f64()
            })
            .collect();
        seconds.sort_by(f64::total_cmp);
        println!("{hairs:>8} {points:>7} {maps:>6} {threads:>8} {:>10.3} {:>10.3}", seconds[0], seconds[RUNS / 2]);
    }
}

/// A unit ball of 4 n^2 triangles.
fn ball(n: usize) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut vertex = Vec::new();
    let mut triangle = Vec::new();
    for j in 0..=n {
        let polar = std::f64::consts::PI * j as f64 / n as f64;
        for i in 0..2 * n {
            let a = std::f64::consts::PI * i as f64 / n as f64;
            let (s, c) = (libm::sin(polar), libm::cos(polar));
            vertex.push([s * libm::cos(a), c, s * libm::sin(a)]);
            if j < n {
                let at = |i: usize, j: usize| (j * 2 * n + i % (2 * n)) as u32;
                triangle.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                triangle.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    (vertex, triangle)
}
