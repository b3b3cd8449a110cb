//! One hair against references: released, at rest, and at different tolerances.

use crate::plot::{Plot, Series};
use crate::{Write, cpu_seconds, on_threads};
use nalgebra::{DMatrix, DVector};
use pelage_sim::reference::{chain, elastica, spectral};
use pelage_sim::rig::{GRAVITY, Rig};
use pelage_sim::{Material, Model, Settings};
use std::f64::consts::FRAC_PI_4;

const GAMMA: f64 = 9.45;

/// A tolerance that leaves the error of the step alone, radians.
const TIGHT: f64 = 1e-9;

/// Hair of 70 micrometres without air, internal damping or twist, and the length at which `w L^3 / B` is `gamma`.
fn hair(gamma: f64) -> (Material, f64) {
    let m = Material { drag_factor: 0.0, damping: 0.0, ..Material::default() };
    let area = FRAC_PI_4 * m.diameter * m.diameter;
    let bending = m.young * area * m.diameter * m.diameter / 16.0;
    (m, libm::cbrt(gamma * bending / (m.density * area * 9.81)))
}

fn straight(length: f64, segments: usize) -> Vec<[f64; 3]> {
    (0..=segments).map(|i| [length * i as f64 / segments as f64, 0.0, 0.0]).collect()
}

/// Tips at t = 1, 2, 3 `sqrt(L / g)` in units of L; processor seconds a hair (eight at a time, one thread); solves a step.
struct Run {
    tips: [[f64; 2]; 3],
    seconds: f64,
    solves: f64,
}

fn run(model: Model, segments: usize, substeps: Option<u32>, tolerance: f64) -> Run {
    let (material, length) = hair(GAMMA);
    let settings = Settings {
        model,
        material,
        substeps,
        tolerance,
        // The default halves steps by itself; elsewhere every step is as long as it says.
        largest_turn: if substeps.is_some() { 10.0 } else { Settings::default().largest_turn },
        sag_free: false,
        sleep: false,
        ..Settings::default()
    };
    let hairs = vec![straight(length, segments); 8];
    let mut best = Run { tips: [[0.0; 2]; 3], seconds: f64::INFINITY, solves: 0.0 };
    for _ in 0..if model == Model::Rod { 3 } else { 1 } {
        let mut shot = Rig::under(&hairs, &settings, GRAVITY).unwrap();
        let (mut seconds, mut steps, mut solves) = (0.0, 0, 0);
        for k in 0..3 {
            let start = cpu_seconds();
            shot.wait((length / 9.81).sqrt()).unwrap();
            seconds += cpu_seconds() - start;
            let tip = shot.tip(0);
            best.tips[k] = [tip.x / length, tip.y / length];
            steps += shot.last.particle_steps;
            solves += shot.last.particle_solves;
        }
        best.seconds = best.seconds.min(seconds / 8.0);
        best.solves = solves as f64 / steps as f64;
    }
    best
}

fn distance(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]) -> f64 {
    (0..3).map(|k| libm::hypot(a[k][0] - b[k][0], a[k][1] - b[k][1])).fold(0.0, f64::max)
}

/// The continuous rod.
fn limit() -> [[f64; 2]; 3] {
    let mut rod = spectral::Rod::straight(GAMMA, 10);
    std::array::from_fn(|_| {
        rod.advance(1.0, 800);
        rod.tip()
    })
}

pub fn released(write: Write) {
    let limit = limit();
    println!("# continuous limit {limit:?}");
    let issue = [[0.75934, -0.60859], [0.01636, -0.84852], [0.73460, -0.63972]];
    println!("# distance of other published figures from it: {:.1e}", distance(&issue, &limit));
    println!(
        "segments,steps_per_unit,tip_error_over_L,error_in_time_over_L,order_in_time,us_per_hair,solves_per_step,tight_error_in_time,tight_us,tight_solves"
    );
    let (mut time, mut dt, mut alone) = (Vec::new(), Vec::new(), Vec::new());
    on_threads(1, || {
        for segments in [25, 50, 100] {
            let fine = run(Model::Rod, segments, Some(2560), TIGHT);
            let mut last = None;
            let mut lines = [Vec::new(), Vec::new(), Vec::new()];
            let mut tight = Vec::new();
            for steps in [5, 10, 20, 40, 80, 160, 320, 640] {
                let r = run(Model::Rod, segments, Some(steps), Settings::default().tolerance);
                let t = run(Model::Rod, segments, Some(steps), TIGHT);
                tight.push([1.0 / f64::from(steps), distance(&t.tips, &fine.tips)]);
                let (error, own) = (distance(&r.tips, &limit), distance(&r.tips, &fine.tips));
                let order = last.map_or(f64::NAN, |l: f64| libm::log2(l / own));
                last = Some(own);
                let us = r.seconds * 1e6;
                println!(
                    "{segments},{steps},{error:.3e},{own:.3e},{order:.2},{us:.1},{:.2},{:.3e},{:.1},{:.2}",
                    r.solves,
                    tight.last().expect("just pushed")[1],
                    t.seconds * 1e6,
                    t.solves
                );
                let step = 1.0 / f64::from(steps);
                lines[0].push([us * 1e-6, error]);
                lines[1].push([step, error]);
                lines[2].push([step, own]);
            }
            let r = run(Model::Rod, segments, None, Settings::default().tolerance);
            let (error, own) = (distance(&r.tips, &limit), distance(&r.tips, &fine.tips));
            println!("{segments},default,{error:.3e},{own:.3e},,{:.1},{:.2}", r.seconds * 1e6, r.solves);
            let (_, length) = hair(GAMMA);
            let step = 1.0 / ((length / 9.81).sqrt() * 192.0).ceil();
            for (to, x, y, line) in
                [(&mut time, r.seconds, error, 0), (&mut dt, step, error, 1), (&mut alone, step, own, 2)]
            {
                let s = Series::new(format!("rod, {segments} segments"), std::mem::take(&mut lines[line]));
                to.push(Series { mark: Some([x, y]), ..s });
            }
            if segments == 50 {
                alone.push(Series::new("50, tolerance 1e-9", tight));
            }
        }
    });
    on_threads(1, || {
        println!("model,segments,steps_per_unit,tip_error_over_L,us_per_hair,solves_per_step");
        for (model, segments, all) in
            [(Model::Springs, 50, &[20, 40, 80, 160][..]), (Model::Paper, 50, &[160, 320, 640, 1280])]
        {
            let (mut lines, name) =
                ([Vec::new(), Vec::new()], format!("{model:?}, {segments} segments").to_lowercase());
            for &steps in all {
                let r = run(model, segments, Some(steps), Settings::default().tolerance);
                let error = distance(&r.tips, &limit);
                println!("{model:?},{segments},{steps},{error:.3e},{:.1},{:.2}", r.seconds * 1e6, r.solves);
                if error < 2.0 {
                    lines[0].push([r.seconds, error]);
                    lines[1].push([1.0 / f64::from(steps), error]);
                }
            }
            let [a, b] = lines;
            time.push(Series::new(name.clone(), a));
            dt.push(Series::new(name, b));
        }
    });
    let guide = vec![[0.0125, 0.5e-4], [0.2, 0.5e-4 * 256.0]];
    alone.push(Series { name: "second order".into(), points: guide, mark: None, guide: true });
    let error = "largest tip error at t = 1, 2, 3 &#8730;(L/g), lengths";
    let title = "Released horizontal hair, &#915; = 9.45 (ring: default)";
    let svg = |axes, title, series| Plot { title, axes, log: [true; 2], series }.svg();
    write("released-time", svg(["processor seconds a hair", error], title, time));
    write("released-step", svg(["step, &#8730;(L/g)", error], title, dt));
    let title = "The same against its own limit in time (ring: default)";
    write("released-order", svg(["step, &#8730;(L/g)", error], title, alone));
}

/// Rests a hair that was straight and horizontal; where its tip comes to, in lengths, and its last speed.
fn rested(gamma: f64, segments: usize) -> ([f64; 2], f64) {
    let (material, length) = hair(gamma);
    let settings = Settings {
        material: Material { damping: 0.02, drag_factor: 10.0, ..material },
        sag_free: false,
        sleep: false,
        tolerance: 1e-9,
        ..Settings::default()
    };
    let mut shot = Rig::under(&[straight(length, segments)], &settings, GRAVITY).unwrap();
    for _ in 0..60 {
        shot.wait(0.25).unwrap();
    }
    let speed = shot.sim.velocities().iter().map(|v| libm::hypot(v[0], v[1])).fold(0.0, f64::max);
    let tip = shot.tip(0) / length;
    ([tip.x, tip.y], speed)
}

pub fn cantilever(write: Write) {
    println!("gamma,segments,H_over_W,error_vs_continuous,error_vs_discrete,tip_error_over_L,last_speed");
    let mut series = Vec::new();
    for gamma in [1.0, 10.0, 100.0, 300.0] {
        let load = elastica::Load { gamma, ..elastica::Load::default() };
        let exact = elastica::continuous(&load, 4000);
        let mut points = Vec::new();
        for segments in [10, 25, 50, 100, 200] {
            let discrete = elastica::discrete(&load, segments).height_over_width();
            let (tip, speed) = rested(gamma, segments);
            let found = -tip[1] / tip[0];
            let error = (found / exact.height_over_width() - 1.0).abs();
            let off = libm::hypot(tip[0] - exact.x, tip[1] + exact.drop);
            println!(
                "{gamma},{segments},{found:.6},{error:.3e},{:.3e},{off:.3e},{speed:.1e}",
                (found / discrete - 1.0).abs()
            );
            points.push([segments as f64, error]);
        }
        series.push(Series::new(format!("rod, &#915; = {gamma}"), points));
    }
    let guide = vec![[10.0, 1e-3], [200.0, 1e-3 / 400.0]];
    series.push(Series { name: "second order".into(), points: guide, mark: None, guide: true });
    let axes = ["segments", "error of H/W, relative"];
    write("cantilever", Plot { title: "Hair under its own weight", axes, log: [true; 2], series }.svg());
}

pub fn tolerance(write: Write) {
    println!("tolerance,steps_per_unit,error_over_L,solves_per_step");
    let (mut errors, mut solves) = (Vec::new(), Vec::new());
    for steps in [20, 80] {
        let exact = run(Model::Rod, 50, Some(steps), 1e-12);
        let (mut e, mut s) = (Vec::new(), Vec::new());
        for exponent in 2..=9 {
            let tolerance = libm::pow(10.0, -f64::from(exponent));
            let r = run(Model::Rod, 50, Some(steps), tolerance);
            let error = distance(&r.tips, &exact.tips);
            println!("{tolerance:.0e},{steps},{error:.3e},{:.3}", r.solves);
            e.push([tolerance, error.max(1e-12)]);
            s.push([tolerance, r.solves]);
        }
        let marked = |points: Vec<[f64; 2]>| {
            let mark = Some(points[3]);
            Series { mark, ..Series::new(format!("{steps} steps a &#8730;(L/g)"), points) }
        };
        errors.push(marked(e));
        solves.push(marked(s));
    }
    let axis = "tolerance, radians";
    let title = "What the tolerance costs in accuracy (ring: default)";
    let axes = [axis, "change of the tip from an exact solution, lengths"];
    write("tolerance-error", Plot { title, axes, log: [true; 2], series: errors }.svg());
    let title = "What the tolerance costs in time (ring: default)";
    let axes = [axis, "linear solves a step (two stages)"];
    write("tolerance-solves", Plot { title, axes, log: [true, false], series: solves }.svg());
}

/// The rod's time integrator (SDIRK2, R. Alexander 1977) on the chain of rigid links in its angles: the same method
/// without stretching, without lanes, and with Newton's method to rounding.
fn step_chain(c: &mut chain::Chain, dt: f64) {
    let n = c.angle.len();
    let gamma = 1.0 - 0.5f64.sqrt();
    let h = gamma * dt;
    let (mut q0, mut v0) = (c.angle.clone(), c.rate.clone());
    for second in [false, true] {
        let mut v = v0.clone();
        let place = |v: &[f64]| -> Vec<f64> { (0..n).map(|i| q0[i] + h * v[i]).collect() };
        for _ in 0..12 {
            let f = |v: &[f64]| -> Vec<f64> {
                let a = c.acceleration(&place(v), v);
                (0..n).map(|i| v[i] - v0[i] - h * a[i]).collect()
            };
            let here = f(&v);
            let mut jacobian = DMatrix::zeros(n, n);
            for k in 0..n {
                let mut moved = v.clone();
                moved[k] += 1e-6;
                let there = f(&moved);
                for i in 0..n {
                    jacobian[(i, k)] = (there[i] - here[i]) / 1e-6;
                }
            }
            let by = jacobian.lu().solve(&DVector::from_vec(here)).expect("regular");
            for i in 0..n {
                v[i] -= by[i];
            }
            if by.amax() < 1e-9 {
                break;
            }
        }
        let (q, a): (Vec<f64>, Vec<f64>) = (place(&v), (0..n).map(|i| (v[i] - v0[i]) / h).collect());
        if second {
            (c.angle, c.rate) = (q, v);
        } else {
            let rest = dt - h;
            for i in 0..n {
                q0[i] = c.angle[i] + rest * v[i];
                v0[i] = c.rate[i] + rest * a[i];
            }
        }
    }
}

/// How far the method itself is from the chain it moves.
pub fn method() {
    let tips = |steps: u32, n: usize| -> [[f64; 2]; 3] {
        let mut c = chain::Chain::straight(GAMMA, 0.0, n);
        std::array::from_fn(|_| {
            for _ in 0..steps {
                step_chain(&mut c, 1.0 / f64::from(steps));
            }
            c.tip()
        })
    };
    let n = 25;
    let mut exact = chain::Chain::straight(GAMMA, 0.0, n);
    let exact: [[f64; 2]; 3] = std::array::from_fn(|_| {
        exact.advance(1.0, 1.0 / (4.0 * (n * n) as f64 / GAMMA.sqrt()));
        exact.tip()
    });
    println!("steps_per_unit,method_on_rigid_links,rod_tight");
    for steps in [5, 10, 20, 40, 80, 160, 320] {
        let fine = run(Model::Rod, n, Some(2560), TIGHT);
        let rod = run(Model::Rod, n, Some(steps), TIGHT);
        println!("{steps},{:.3e},{:.3e}", distance(&tips(steps, n), &exact), distance(&rod.tips, &fine.tips));
    }
}
