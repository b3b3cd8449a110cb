//! Error of opacity shadow maps on hair from a file (USD, MCAP, PLY, .hair), against the mean of exact rays over the same
//! footprint, and the time they take.
//!
//! `cargo run --release -p pelage --example shadow_error -- FILE [FRAME [WIDTH [PLOT]]]`; hair without widths is WIDTH thick
//! (in the file's units; a 2000th of its size by default) and opaque. With PLOT (0 for WIDTH: the default), many settings are
//! tried, and PLOT.csv and PLOT.svg written: error against seconds.
#![allow(missing_docs, clippy::disallowed_methods)]

#[path = "../src/bench/plot.rs"]
mod plot;

use pelage::curves;
use pelage_geom::{Vec3, rng};
use pelage_light::shadow::{
    Footprint, Interpolation, Placement, Quality, ShadowError, ShadowHair, ShadowSettings, Source, transmittance,
    transmittance_exact,
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
    if let Some(name) = arguments.get(3) {
        return sweep(name, &measure);
    }
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

/// Error and cost of resolution x slices, and of filter, interpolation and placement at the default of the others.
fn sweep(name: &str, measure: &dyn Fn(&ShadowSettings) -> Found) {
    let default = Quality::Default.settings();
    let mut csv = String::from("texels,slices,placement,filter,interpolation,rms,p95,bias,seconds,megabytes\n");
    let mut lines: Vec<plot::Series> = Vec::new();
    let mut add = |label: String, all: Vec<ShadowSettings>, line: bool| {
        let found: Vec<Found> = all.iter().map(measure).collect();
        for f in &found {
            let (s, e) = (f.settings, &f.error);
            csv += &format!(
                "{},{},{:?},{:.6},{:?},{:.4},{:.4},{:+.4},{:.2},{}\n",
                s.texels, s.slices, s.placement, s.filter, s.interpolation, e.rms, e.p95, e.bias, f.seconds, f.mb
            );
            println!("{label}: {}", f.line());
        }
        if line {
            let points: Vec<[f64; 2]> = found.iter().map(|f| [f.seconds, f.error.rms]).collect();
            let mark = found.iter().position(|f| f.settings == default).map(|k| points[k]);
            lines.push(plot::Series { mark, ..plot::Series::new(label, points) });
        }
    };
    const SLICES: [usize; 6] = [16, 32, 64, 128, 256, 384];
    let slices = |texels: usize, placement| {
        SLICES.map(|slices| ShadowSettings { texels, slices, placement, ..default }).to_vec()
    };
    for texels in [512, 1024, 2048, 4096] {
        add(format!("{texels} texels"), slices(texels, Placement::Histogram), true);
    }
    add("2048, even slices".into(), slices(2048, Placement::Uniform), true);
    for interpolation in [Interpolation::Transmittance, Interpolation::Cubic] {
        add(format!("{interpolation:?}"), vec![ShadowSettings { interpolation, ..default }], false);
    }
    for factor in [0.5, 0.75, 1.25, 1.5] {
        add(format!("filter x {factor}"), vec![ShadowSettings { filter: default.filter * factor, ..default }], false);
    }
    let title = "Shadow maps: error against time, 16 to 384 slices";
    let axes = ["seconds on two threads", "RMS error of transmittance"];
    let svg = plot::Plot { title, axes, log: [true, true], series: lines }.svg();
    std::fs::write(format!("{name}.svg"), svg).expect("a file");
    std::fs::write(format!("{name}.csv"), csv).expect("a file");
}
