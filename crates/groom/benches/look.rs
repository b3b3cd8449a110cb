//! Every operator of the look alone and all of it together: nanoseconds of CPU a point, over 1,000,000 hairs x 12 points and
//! 100,000 x 50, on one thread.
//!
//! `cargo bench -p pelage-groom --bench look`
// A benchmark has to read the clock, which the crate itself must not.
#![allow(clippy::disallowed_methods)]

mod common;

use common::{CONTROLS, controls, u};
use pelage_geom::shapes::cube_sphere;
use pelage_geom::{Pose, SurfacePoint, Topology, Vec3};
use pelage_groom::interpolate::{Blend, interpolate};
use pelage_groom::look::Param;
use pelage_groom::look::axes::{carried, rest_axes};
use pelage_groom::look::clump::{Clump, centre_lines, clump};
use pelage_groom::look::curl::{Curl, curl, helix};
use pelage_groom::look::member::{Sites, members};
use pelage_groom::look::noise::{Noise, noise};
use pelage_groom::look::refine::refine;
use pelage_groom::look::wave::{Axis, Shape, Stations, Waves, wave};
use pelage_groom::look::wind::{Wind, wind};
use std::hint::black_box;
use std::time::Instant;

const RUNS: usize = 5;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    pool.install(|| {
        measure(1_000_000, 12);
        measure(100_000, 50);
    });
}

fn measure(hairs: usize, points: usize) {
    let mesh = cube_sphere(40, 10.0);
    let topology = Topology::new(&mesh);
    let pose = Pose::new(&mesh, &topology, mesh.position.clone());
    let triangles = mesh.triangle.len();
    let surface: Vec<SurfacePoint> = (0..hairs)
        .map(|i| {
            let (a, b) = (u(i, 0) as f32, u(i, 1) as f32);
            let bary = if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] };
            SurfacePoint { triangle: (u(i, 2) * triangles as f64) as u32, bary }
        })
        .collect();
    let frame = |p: &SurfacePoint| pose.frame(&mesh, &topology, p);
    let single = |v: Vec3| [v.x as f32, v.y as f32, v.z as f32];
    let root: Vec<[f32; 3]> = surface.iter().map(|p| single(frame(p).origin)).collect();
    let normal: Vec<[f32; 3]> = surface.iter().map(|p| single(frame(p).n)).collect();
    let controls = controls(points);
    let near = |i: usize, k: u64| ((i * CONTROLS / hairs + (u(i, k) * 40.0) as usize) % CONTROLS) as u32;
    let hair: Vec<[u32; 3]> = (0..hairs).map(|i| [near(i, 7), near(i, 8), near(i, 9)]).collect();
    let weight = vec![[0.5, 0.3, 0.2]; hairs];
    let length = vec![4.0f32; hairs];
    let blend = Blend { root: &root, hair: &hair, weight: &weight, length: &length };
    let mut out = vec![[0.0f32; 3]; hairs * points];
    let id: Vec<u64> = (0..hairs as u64).collect();
    let total = (hairs * points) as f64;
    let tell = |name: &str, seconds: f64| println!("  {name:<44} {:6.2} ns/point", seconds * 1e9 / total);
    println!("{hairs} hairs x {points} points");

    tell("interpolation", best(|| _ = black_box(interpolate(&blend, &controls, &mut out))));
    let base = out.clone();
    let local = rest_axes(&mesh, &topology, &pose, &surface, points, &base);
    let axes = carried(&mesh, &topology, &pose, &surface, &local);
    tell("axes carried by the skin", best(|| _ = black_box(carried(&mesh, &topology, &pose, &surface, &local))));

    let sites = Sites { position: &root, normal: &normal, side: &[] };
    let level = |share: usize, radius: f32| {
        let centre: Vec<u32> = (0..hairs as u32).step_by(share).collect();
        let n = centre.len();
        members(&sites, centre, &vec![radius; n], radius, &[])
    };
    let (fine, coarse) = (level(50, 0.5), level(500, 1.5));
    let percent: Vec<f32> = (0..hairs).map(|i| 0.9 + 0.1 * u(i, 20) as f32).collect();
    let one = |m: &pelage_groom::look::member::Members, out: &mut [[f32; 3]], rate, splay| {
        let line = centre_lines(points, out, &m.centre);
        clump(points, &clump_of(m, &id, &percent, rate, splay), &line, out);
    };
    tell("a level of clumps", on(&base, &mut out, |out| one(&fine, out, 0.3, 0.0)));
    tell(
        "two levels of clumps",
        on(&base, &mut out, |out| {
            one(&fine, out, 0.3, 0.2);
            one(&coarse, out, 0.0, 0.0);
        }),
    );
    let curls = |keep_length| Curl {
        wave: helix(),
        radius: Param { value: 0.2, factor: &percent, shift: &[] },
        pitch: Param::constant(1.5),
        phase: Param { value: 0.0, factor: &[], shift: &percent },
        angle: Param::constant(0.0),
        tighten: Param::constant(0.2),
        start: 0.5,
        profile: &[],
        keep_length,
        axes: &axes,
    };
    tell("curls", on(&base, &mut out, |out| curl(points, &curls(false), out)));
    tell("curls that keep lengths", on(&base, &mut out, |out| curl(points, &curls(true), out)));
    let noises = |across| Noise {
        amplitude: Param { value: 0.03, factor: &percent, shift: &[] },
        size: 0.5,
        across,
        profile: &[],
        keep_length: true,
        id: &id,
        root: &root,
        axes: &axes,
        seed: 1,
        channel: 2,
    };
    tell("frizz", on(&base, &mut out, |out| noise(points, &noises(0.0), out)));
    tell("noise over the skin", on(&base, &mut out, |out| noise(points, &noises(1.0), out)));
    let stations = Stations { mean: [0.1; 4], deviation: [0.05; 4], scale: [9.0; 4] };
    let axis = Axis { amplitude: stations, frequency: Stations { mean: [3.0; 4], ..stations }, phase: [0.0, 0.5, 5.0] };
    let waves = Waves {
        shape: Shape::Sine,
        axis: [axis; 2],
        strength: Param::constant(1.0),
        r: &percent,
        keep_length: true,
        axes: &axes,
        seed: 1,
        channel: 3,
    };
    tell("waves", on(&base, &mut out, |out| wave(points, &waves, out)));
    let winds = Wind {
        amplitude: Param::constant(1.0),
        direction: [1.0, 0.0, 0.0],
        frequency: 0.5,
        size: 3.0,
        gust: 0.5,
        time: 1.0,
        root: &root,
        seed: 1,
        channel: 4,
    };
    tell("wind", on(&base, &mut out, |out| wind(points, &winds, out)));
    tell("twice as many points on a smooth curve", best(|| _ = black_box(refine(points, 2 * points, &base))));
    for keep_length in [false, true] {
        let all = || {
            interpolate(&blend, &controls, &mut out);
            let axes = carried(&mesh, &topology, &pose, &surface, &local);
            one(&fine, &mut out, 0.3, 0.0);
            one(&coarse, &mut out, 0.0, 0.0);
            curl(points, &Curl { axes: &axes, ..curls(keep_length) }, &mut out);
            noise(points, &Noise { axes: &axes, ..noises(0.0) }, &mut out);
        };
        let kept = if keep_length { ", lengths kept" } else { "" };
        tell(&format!("all: two levels, curls, frizz{kept}"), best(all));
    }
}

fn clump_of<'a>(
    m: &'a pelage_groom::look::member::Members,
    id: &'a [u64],
    percent: &'a [f32],
    rate: f32,
    splay: f32,
) -> Clump<'a> {
    Clump {
        clump: &m.clump,
        reach: &m.reach,
        centre: &m.centre,
        percent: Param { value: 0.8, factor: percent, shift: &[] },
        rate: Param::constant(rate),
        falloff: Param::constant(0.2),
        splay: Param::constant(splay),
        weave: Param::constant(0.0),
        taper: 0.0,
        hold: f32::INFINITY,
        dilation: &[],
        keep_length: false,
        id,
        seed: 5,
    }
}

/// Seconds that this thread has run on a processor; of the clock where the system does not say.
fn cpu() -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|t| t.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| EPOCH.elapsed().as_secs_f64(), |n| n * 1e-9)
}

static EPOCH: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);

/// The shortest time of an operator on fresh hairs; copying them is not counted.
fn on(base: &[[f32; 3]], out: &mut [[f32; 3]], mut f: impl FnMut(&mut [[f32; 3]])) -> f64 {
    (0..RUNS)
        .map(|_| {
            out.copy_from_slice(base);
            let start = cpu();
            f(out);
            cpu() - start
        })
        .fold(f64::INFINITY, f64::min)
}

/// The shortest of some runs, seconds.
fn best(mut f: impl FnMut()) -> f64 {
    (0..RUNS)
        .map(|_| {
            let start = cpu();
            f();
            cpu() - start
        })
        .fold(f64::INFINITY, f64::min)
}
