//! Opacity shadow maps: error against cost, what solids cost, and speed.
//!
//! `cargo bench -p pelage-light --bench shadow` prints all; with `-- measured` only the errors of the settings in `MEASURED`,
//! with `-- speed` only times, with `-- once SCENE` it works one scene (long, shot, thin) four times, for a profiler.
// A benchmark has to read the clock, which the crate itself must not.
#![allow(clippy::disallowed_methods)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{BALL, Body, Groom, ball, curly, fur, long, some_points};
use pelage_geom::Vec3;
use pelage_light::shadow::{
    Footprint, Interpolation, MEASURED, Placement, Quality, Sample, ShadowError, ShadowHair, ShadowSettings, Solid,
    Source, transmittance, transmittance_exact,
};
use std::hint::black_box;
use std::time::Instant;

const SOURCE: Source = Source::Directional { direction: Vec3::new(-0.4, -1.0, -0.3) };
const RUNS: usize = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    match arguments.first().map(String::as_str) {
        Some("speed") => return speed(),
        Some("once") => return once(arguments.get(1).map_or("long", String::as_str)),
        _ => {}
    }
    let measured = arguments.first().is_some_and(|a| a == "measured");
    println!("groom,texels,slices,placement,interpolation,filter,rms,p95,bias,seconds,megabytes");
    let grooms: [(&str, Groom); 3] =
        [("long", long(40_000, 26)), ("fur", fur(100_000, 9)), ("curly", curly(10_000, 101))];
    for (name, groom) in &grooms {
        errors(name, groom, measured);
    }
    if !measured {
        speed();
    }
}

/// Prints the table of one groom.
fn errors(name: &str, groom: &Groom, measured: bool) {
    let layers = [groom.view()];
    let points = some_points(&layers, 1500);
    let footprint = Footprint { side: 1.0 / 256.0, rays: 1024, seed: 1 };
    let start = Instant::now();
    let truth = transmittance_exact(SOURCE, &layers, &[], &footprint, &points).expect("light");
    let each = start.elapsed().as_secs_f64() / points.len() as f64 / 1058.0;
    println!("# {name}: {} points, exact {:.2} us a ray", groom.position.len(), 1e6 * each);
    let row = |settings| row(name, &layers, &points, &truth, settings);
    for m in MEASURED {
        row(ShadowSettings { texels: m.texels, slices: m.slices, ..Default::default() });
    }
    if measured {
        return;
    }
    for texels in [256, 512, 1024, 2048] {
        for slices in [16, 32, 64, 128] {
            for placement in [Placement::Uniform, Placement::Histogram] {
                row(ShadowSettings { texels, slices, placement, ..Default::default() });
            }
        }
    }
    for interpolation in [Interpolation::Transmittance, Interpolation::Cubic] {
        row(ShadowSettings { slices: 32, interpolation, ..Default::default() });
        row(ShadowSettings { interpolation, ..Default::default() });
    }
    for filter in [1.0 / 512.0, 1.0 / 320.0, 1.0 / 192.0, 1.0 / 128.0] {
        row(ShadowSettings { filter, ..Default::default() });
    }
    for quality in [Quality::Draft, Quality::Fine] {
        row(quality.settings());
    }
}

fn row(name: &str, layers: &[ShadowHair], points: &[[usize; 2]], truth: &[Sample], settings: ShadowSettings) {
    let start = Instant::now();
    let (light, counts) = transmittance(SOURCE, layers, &[], &settings).expect("light");
    let seconds = start.elapsed().as_secs_f64();
    let ShadowError { rms, p95, bias } = ShadowError::of(&light, points, truth);
    let ShadowSettings { texels, slices, placement, interpolation, filter } = settings;
    println!(
        "{name},{texels},{slices},{placement:?},{interpolation:?},1/{:.0},{rms:.4},{p95:.4},{bias:+.4},{seconds:.3},{:.1}",
        1.0 / filter,
        counts.bytes as f64 / 1e6
    );
}

/// Median of some runs on some threads.
fn median(threads: usize, layers: &[ShadowHair], solids: &[Solid], settings: &ShadowSettings) -> f64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let mut seconds: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            black_box(pool.install(|| transmittance(SOURCE, layers, solids, settings))).expect("light");
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[RUNS / 2]
}

/// Hair as a shot has it: few guides, 0.3 mm wide, in segments of a centimetre, over a skin of 27,000 triangles.
fn shot() -> (Groom, Body) {
    let mut groom = long(14_600, 26);
    groom.width.fill(300e-6);
    (groom, Body::new(ball(82, BALL)))
}

/// Works one scene on one thread.
fn once(scene: &str) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
    let (groom, solids) = match scene {
        "shot" => (shot().0, true),
        "thin" => (shot().0, false),
        _ => (long(100_000, 26), false),
    };
    let body = shot().1;
    let solids = if solids { vec![body.view()] } else { Vec::new() };
    for _ in 0..4 {
        let start = Instant::now();
        let settings = ShadowSettings::default();
        let (light, counts) =
            pool.install(|| transmittance(SOURCE, &[groom.view()], &solids, &settings)).expect("light");
        let mean = light[0].iter().map(|t| f64::from(*t)).sum::<f64>() / light[0].len() as f64;
        println!("# {scene}: {:.3} s, mean {mean:.6}, {counts:?}", start.elapsed().as_secs_f64());
    }
}

/// Prints times for 100,000 hairs of 25 segments and for a shot.
fn speed() {
    let groom = long(100_000, 26);
    let layers = [groom.view()];
    let body = Body::new(ball(100, BALL));
    let solids = [body.view()];
    for quality in [Quality::Draft, Quality::Default] {
        for threads in [1, 2] {
            let seconds = median(threads, &layers, &[], &quality.settings());
            println!("# {quality:?}: 2,500,000 segments, {threads} threads: median {seconds:.3} s");
        }
    }
    let seconds = median(2, &layers, &solids, &Quality::Default.settings());
    println!("# Default with a skin of {} triangles, 2 threads: median {seconds:.3} s", body.triangle.len());
    let (groom, body) = shot();
    let triangles = body.triangle.len();
    for (solids, count) in [(vec![], 0), (vec![body.view()], triangles)] {
        let seconds = median(1, &[groom.view()], &solids, &Quality::Default.settings());
        println!("# shot, {} points, {count} triangles, 1 thread: median {seconds:.3} s", groom.position.len());
    }
}
