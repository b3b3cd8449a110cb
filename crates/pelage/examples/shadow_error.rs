//! Error of opacity shadow maps on hair from a file (USD, MCAP, PLY, .hair), against the mean of exact rays over the same
//! footprint, and the time they take.
//!
//! `cargo run --release -p pelage --example shadow_error -- FILE [FRAME [WIDTH]]`; hair without widths is WIDTH thick (in the
//! file's units; a 2000th of its size by default) and opaque. `pelage bench --study shadow` tries many settings on the
//! sample shots.
#![allow(missing_docs, clippy::disallowed_methods)]

use pelage::curves;
use pelage_geom::{Vec3, rng};
use pelage_light::shadow::{
    Footprint, Placement, Quality, ShadowError, ShadowHair, ShadowSettings, Source, transmittance, transmittance_exact,
};
use std::path::Path;
use std::time::Instant;

/// Points that are compared, and rays for each.
const POINTS: usize = 2_000;
const RAYS: usize = 1_024;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|a| a.parse::<f64>().ok());
    let layers = curves::read(Path::new(&arguments[0]), number(1)).expect("a file of curves").layers;
    let points: usize = layers.iter().map(|l| l.strands.position.len()).sum();
    let bound = |i: usize, s: f32| {
        let all = layers.iter().flat_map(|l| &l.strands.position);
        all.map(|p| s * p[i]).fold(f32::NEG_INFINITY, f32::max)
    };
    let size = (0..3).map(|i| bound(i, 1.0) + bound(i, -1.0)).fold(0.0, f32::max);
    let width = number(2).filter(|w| *w > 0.0).unwrap_or(f64::from(size) / 2000.0) as f32;
    let width_of = |l: &curves::CurveSet| match l.width.is_empty() {
        true => vec![width; l.strands.position.len()],
        false => l.width.clone(),
    };
    let widths: Vec<Vec<f32>> = layers.iter().map(width_of).collect();
    let hair = |(l, width)| {
        let l: &curves::CurveSet = l;
        let (offsets, position, origin) = (&l.strands.offsets, &l.strands.position[..], l.strands.origin);
        let width: &Vec<f32> = width;
        ShadowHair { offsets, position, origin, width, opacity: &[] }
    };
    let hair: Vec<ShadowHair<'_>> = layers.iter().zip(&widths).map(hair).collect();
    let hairs: usize = layers.iter().map(|l| l.strands.len()).sum();
    println!("{}: {hairs} hairs, {points} points, size {size}", arguments[0]);

    let source = Source::Directional { direction: Vec3::new(-0.4, -0.8, -0.45) };
    let all: Vec<[usize; 2]> =
        layers.iter().enumerate().flat_map(|(l, h)| (0..h.strands.position.len()).map(move |i| [l, i])).collect();
    let picked: Vec<[usize; 2]> =
        (0..POINTS as u64).map(|k| all[(rng::uniform(3, k, 0, 0) * points as f64) as usize]).collect();
    let footprint = Footprint { side: ShadowSettings::default().filter, rays: RAYS, seed: 1 };
    let start = Instant::now();
    let truth = transmittance_exact(source, &hair, &[], &footprint, &picked).expect("a light with a direction");
    let per_ray = start.elapsed().as_secs_f64() * 1e6 / (POINTS * RAYS) as f64;
    let noise = truth.iter().map(|s| s.variance).sum::<f64>() / POINTS as f64;
    println!("exact: {per_ray:.2} us a ray, noise {:.4}", noise.sqrt());
    let measure = |settings: &ShadowSettings| {
        let start = Instant::now();
        let (found, counts) = transmittance(source, &hair, &[], settings).expect("a light with a direction");
        let seconds = start.elapsed().as_secs_f64();
        Found { settings: *settings, error: ShadowError::of(&found, &picked, &truth), seconds, mb: counts.bytes >> 20 }
    };
    let default = Quality::Default.settings();
    let of = |texels: usize, slices: usize| ShadowSettings { texels, slices, ..default };
    for (name, settings) in [
        ("draft", Quality::Draft.settings()),
        ("default", default),
        ("uniform", ShadowSettings { placement: Placement::Uniform, ..default }),
        ("fine", Quality::Fine.settings()),
        ("", of(512, 128)),
        ("", of(1024, 128)),
        ("", of(2048, 64)),
        ("", of(2048, 128)),
        ("", of(2048, 256)),
        ("", of(4096, 256)),
    ] {
        println!("{name:8} {}", measure(&settings).line());
    }
    // Other lights, and hair that lets light through, at the default.
    let middle = Vec3::from_fn(|i, _| f64::from(0.5 * (bound(i, 1.0) - bound(i, -1.0))));
    let aside = Vec3::new(0.6, 0.5, 0.7).normalize() * f64::from(size);
    for (name, source, opacity) in [
        ("parallel, opacity 0.5", source, 0.5f32),
        ("parallel, opacity 0.1", source, 0.1),
        ("point at 1.5 sizes", Source::Point { position: middle + aside * 1.5 }, 1.0),
        ("point at 0.6 sizes", Source::Point { position: middle + aside * 0.6 }, 1.0),
        ("point in the middle", Source::Point { position: middle }, 1.0),
    ] {
        let opacity: Vec<Vec<f32>> = hair.iter().map(|h| vec![opacity; h.offsets.len()]).collect();
        let hair: Vec<ShadowHair<'_>> =
            hair.iter().zip(&opacity).map(|(h, opacity)| ShadowHair { opacity, ..*h }).collect();
        let truth = transmittance_exact(source, &hair, &[], &footprint, &picked).expect("a light");
        let (found, _) = transmittance(source, &hair, &[], &default).expect("a light");
        let ShadowError { rms, p95, bias } = ShadowError::of(&found, &picked, &truth);
        println!("{name}: RMS {rms:.4}  95 % {p95:.4}  bias {bias:+.4}");
    }
}

/// What settings cost and give.
struct Found {
    settings: ShadowSettings,
    error: ShadowError,
    seconds: f64,
    mb: usize,
}

impl Found {
    fn line(&self) -> String {
        let Found {
            settings: ShadowSettings { texels, slices, .. },
            error: ShadowError { rms, p95, bias },
            seconds,
            mb,
        } = self;
        format!("{texels:4} x {slices:3}: RMS {rms:.4}  95 % {p95:.4}  bias {bias:+.4}  {seconds:.2} s  {mb} MB")
    }
}
