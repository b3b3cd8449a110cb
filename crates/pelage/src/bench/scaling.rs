//! Time and memory against the size of the work, and how much of the machine the hot loops use.

use super::machine::{self, fastest, on_threads};
use super::plot::{Plot, Series};
use super::shot::{LENGTH, RADIUS, advance};
use super::strand::refused;
use super::{Bench, Findings, Section, Study};
use crate::Error;
use pelage_geom::{Offsets, rng};
use pelage_groom::interpolate::{Blend, ControlPose, interpolate};
use pelage_light::shadow::{ShadowHair, ShadowSettings, Source, transmittance};
use pelage_sim::rig::{self, Ball, Rig};
use pelage_sim::{Settings, Vec3};
use std::sync::LazyLock;
use std::time::Instant;

pub(super) const STUDY: Study = Study {
    name: "scaling",
    about: "Time and memory against hairs, points, frames and threads, and the part of the machine that each hot loop uses.",
    run,
};

/// Double-precision operations of a rod's iteration a node, assembly and solve, a multiply-add as two: counted with a number type
/// that counts (`cargo run --release -p pelage-sim --example solver_speed`).
const OPERATIONS: f64 = 1930.0;

/// Bytes that a shadow map's point needs at least: position, width, and its transmittance.
const SHADOW_BYTES: f64 = 20.0;

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let mut findings = Findings::default();
    let mut s = Section::new("The machine", &["rate, 1e9 a second"]).says(
        "Bytes read and written by all threads, a = b + 3 c over arrays far larger than any cache; double-precision operations \
         of all threads, sixteen chains of multiply-adds that do not wait for each other, a multiply-add as two.",
    );
    let [bandwidth] = s.row(bench, "machine/bandwidth", || Ok([machine::bandwidth() * 1e-9]))?;
    let [peak] = s.row(bench, "machine/peak", || Ok([machine::peak() * 1e-9]))?;
    findings.sections.push(s);
    simulation(bench, peak, &mut findings)?;
    interpolation(bench, bandwidth, &mut findings)?;
    shadows(bench, bandwidth, &mut findings)?;
    Ok(findings)
}

/// Numbers of threads that are tried: 1, 2, 4 ... and all.
fn threads() -> Vec<usize> {
    let all = rayon::current_num_threads();
    (0..).map(|k| 1 << k).take_while(|n| *n < all).chain([all]).collect()
}

/// Seconds against hairs as a plot.
fn plot(title: &str, rows: &[(f64, f64)]) -> String {
    let points = rows.iter().map(|(n, t)| [*n, *t]).collect();
    let series = vec![Series::new("seconds", points)];
    Plot { title, axes: ["hairs", "seconds"], log: [true; 2], series }.svg()
}

fn simulation(bench: &mut Bench<'_>, peak: f64, findings: &mut Findings) -> Result<(), Error> {
    let columns =
        ["hairs", "threads", "s", "ns a node and step", "solves a step", "1e9 operations a second", "% of peak", "MB"];
    let mut s = Section::new("Simulation", &columns)
        .says(
            "Hairs of 20 cm lie round a ball that shakes by 1 rad once a second; 8 steps a frame of 1/24 s, rods, in air, the ball's \
             field as the body. Seconds on the clock of the frames after the first. Operations are those of the solver's \
             iterations (1,930 a node, counted); contact, wind, moving frames and guesses do not count, so that the part of \
             the peak is that of useful elasticity. Memory is what the process takes more when the hairs are made.",
        )
        .says(
            "Points name hairs, segments, frames and threads. A million hairs of 25 segments take 8 GB and minutes a frame; they are \
             not measured here.",
        );
    let ball: LazyLock<Ball> = LazyLock::new(|| rig::ball(RADIUS));
    let all = rayon::current_num_threads();
    let most = if bench.quick { 1_000 } else { 100_000 };
    let mut cases: Vec<[usize; 4]> =
        [1_000, 10_000, 100_000].into_iter().filter(|n| *n <= most).map(|n| [n, 25, 1, all]).collect();
    if !bench.quick {
        cases.extend([12, 50, 100, 200].map(|segments| [1_000, segments, 1, all]));
        cases.extend([2, 4, 8].map(|frames| [1_000, 25, frames, all]));
    }
    cases.extend(threads().into_iter().filter(|t| *t != all).map(|t| [1_000, 25, 1, t]));
    let mut line = Vec::new();
    for [hairs, segments, frames, threads] in cases {
        let point = format!("simulation/{hairs}-hairs/{segments}-segments/{frames}-frames/{threads}-threads");
        let row = s.row(bench, &point, || {
            on_threads(threads, || {
                let before = machine::resident_bytes();
                let mut rig =
                    Rig::new(&rig::tuft(RADIUS, hairs, LENGTH, segments + 1), &Settings::default()).map_err(refused)?;
                let taken = machine::resident_bytes() - before;
                advance(&mut rig, 0, Some(&ball.field)).map_err(refused)?;
                let (start, mut steps, mut solves) = (Instant::now(), 0, 0);
                for frame in 1..=frames {
                    advance(&mut rig, frame, Some(&ball.field)).map_err(refused)?;
                    (steps, solves) = (steps + rig.last.particle_steps, solves + rig.last.particle_solves);
                }
                let t = start.elapsed().as_secs_f64();
                let rate = solves as f64 * OPERATIONS / t * 1e-9;
                let (ns, each) = (t * 1e9 / steps as f64, solves as f64 / steps as f64);
                Ok([hairs as f64, threads as f64, t, ns, each, rate, 100.0 * rate / peak, taken / 1e6])
            })
        })?;
        if segments == 25 && frames == 1 && threads == all {
            line.push((row[0], row[2]));
        }
    }
    let last = line.last().map_or([f64::NAN; 2], |(n, t)| [*n, *t]);
    let first = s.rows.first().map_or(vec![f64::NAN; 8], |r| r.1.clone());
    findings.answers.push(format!(
        "Simulation: {:.0} hairs of 25 segments take {:.2} s a frame in contact with a body; the solver alone does {:.0} % of the \
         machine's peak meanwhile (1,000 hairs).",
        last[0], last[1], first[6]
    ));
    s.plots.push(plot("Simulation: a frame of 25 segments a hair", &line));
    findings.sections.push(s);
    Ok(())
}

/// Control hairs for interpolation.
const CONTROLS: usize = 1000;

fn u(i: usize, k: u64) -> f64 {
    rng::uniform(5, i as u64, k, 0)
}

fn interpolation(bench: &mut Bench<'_>, bandwidth: f64, findings: &mut Findings) -> Result<(), Error> {
    const POINTS: usize = 12;
    let columns = ["hairs", "threads", "s", "ns a point", "1e9 bytes a second", "% of bandwidth"];
    let mut s = Section::new("Interpolation", &columns).says(
        "Hairs of 12 points from three of 1,000 control hairs each. Bytes are those that must be read and written: weights, \
         roots, lengths and indices once, points once. Fastest of five, seconds on the clock.",
    );
    let all = rayon::current_num_threads();
    let sizes: &[usize] = if bench.quick { &[1_000, 100_000] } else { &[1_000, 10_000, 100_000, 1_000_000] };
    let most = sizes[sizes.len() - 1];
    let mut cases: Vec<[usize; 2]> = sizes.iter().map(|n| [*n, all]).collect();
    cases.extend(threads().into_iter().filter(|t| *t != all).map(|t| [most, t]));
    let mut line = Vec::new();
    for [hairs, threads] in cases {
        let row = s.row(bench, &format!("interpolation/{hairs}-hairs/{threads}-threads"), || {
            let lines: Vec<Vec3> =
                (0..CONTROLS * POINTS).map(|i| Vec3::new(u(i, 0), (i % POINTS) as f64 + u(i, 1), u(i, 2))).collect();
            let control = ControlPose::from_polylines(&lines, POINTS, POINTS);
            let root: Vec<[f32; 3]> = (0..hairs).map(|i| [0, 1, 2].map(|k| u(i, k) as f32)).collect();
            let near = |i: usize, k: usize| ((i * CONTROLS / hairs + 7 * k) % CONTROLS) as u32;
            let hair: Vec<[u32; 3]> = (0..hairs).map(|i| [near(i, 0), near(i, 1), near(i, 2)]).collect();
            let weight = vec![[0.5f32, 0.3, 0.2]; hairs];
            let length = vec![2.0f32; hairs];
            let blend = Blend { root: &root, hair: &hair, weight: &weight, length: &length };
            let mut out = vec![[0.0f32; 3]; hairs * POINTS];
            let t = on_threads(threads, || {
                fastest(5, || _ = std::hint::black_box(interpolate(&blend, &control, &mut out)))
            });
            let rate = hairs as f64 * (12.0 * POINTS as f64 + 40.0) / t * 1e-9;
            let ns = t * 1e9 / (hairs * POINTS) as f64;
            Ok([hairs as f64, threads as f64, t, ns, rate, 100.0 * rate / bandwidth])
        })?;
        if threads == all {
            line.push((row[0], row[2]));
        }
    }
    let of = s.rows.iter().rfind(|r| r.1[1] == all as f64).map_or(vec![f64::NAN; 6], |r| r.1.clone());
    findings.answers.push(format!(
        "Interpolation: {:.0} hairs of 12 points in {:.3} s, {:.1} ns a point, {:.0} % of the machine's bandwidth.",
        of[0], of[2], of[3], of[5]
    ));
    s.plots.push(plot("Interpolation: 12 points a hair", &line));
    findings.sections.push(s);
    Ok(())
}

fn shadows(bench: &mut Bench<'_>, bandwidth: f64, findings: &mut Findings) -> Result<(), Error> {
    const POINTS: usize = 26;
    let columns = ["hairs", "threads", "s", "ns a segment", "% of bandwidth", "MB"];
    let mut s = Section::new("Shadows", &columns).says(
        "Shadow maps of hairs of 25 segments round a ball at the default settings, one light. The part of the bandwidth counts \
         what must be read and written once (20 bytes a point): the loop computes, it does not stream. Memory is what the \
         tiles take. Fastest of two, seconds on the clock.",
    );
    let all = rayon::current_num_threads();
    let sizes: &[usize] = if bench.quick { &[1_000, 4_000] } else { &[1_000, 10_000, 100_000, 1_000_000] };
    let mut cases: Vec<[usize; 2]> = sizes.iter().map(|n| [*n, all]).collect();
    cases.extend(threads().into_iter().filter(|t| *t != all).map(|t| [sizes[1], t]));
    let mut line = Vec::new();
    for [hairs, threads] in cases {
        let row = s.row(bench, &format!("shadows/{hairs}-hairs/{threads}-threads"), || {
            let strands = rig::tuft(RADIUS, hairs, LENGTH, POINTS);
            let offsets = Offsets::uniform(hairs, POINTS);
            let position: Vec<[f32; 3]> = strands.iter().flatten().map(|p| p.map(|c| c as f32)).collect();
            let width = vec![80e-6; position.len()];
            let hair =
                ShadowHair { offsets: &offsets, position: &position, origin: [0.0; 3], width: &width, opacity: &[] };
            let source = Source::Directional { direction: [-0.4, -0.8, -0.4].into() };
            let settings = ShadowSettings::default();
            let mut bytes = 0;
            let t = on_threads(threads, || {
                fastest(2, || {
                    let (light, counts) =
                        transmittance(source, &[hair], &[], &settings).expect("a light with a direction");
                    bytes = counts.bytes;
                    std::hint::black_box(light.len());
                })
            });
            let rate = position.len() as f64 * SHADOW_BYTES / t * 1e-9;
            let ns = t * 1e9 / (hairs * (POINTS - 1)) as f64;
            Ok([hairs as f64, threads as f64, t, ns, 100.0 * rate / bandwidth, bytes as f64 / 1e6])
        })?;
        if threads == all {
            line.push((row[0], row[2]));
        }
    }
    s.plots.push(plot("Shadows: 25 segments a hair", &line));
    findings.sections.push(s);
    Ok(())
}
