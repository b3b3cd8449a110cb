//! A horizontal hair let go: the work-precision curves of models, steps and segments.

use super::{At, Case, Clock, Finer, HAIRS, Row, lines, logarithmic, name, refused, second_order, section};
use crate::Error;
use crate::bench::machine::on_threads;
use crate::bench::plot::Series;
use crate::bench::{Bench, Findings, Section};
use pelage_sim::reference::{chain::Chain, spectral};
use pelage_sim::rig::{G, GRAVITY, Rig, in_vacuum};
use pelage_sim::{Material, Model, Settings, SimError};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_4;
use std::sync::{LazyLock, Mutex};

/// `w L^3 / B` of the hair: 70 micrometres thick and 9.6 cm long.
const GAMMA: f64 = 9.45;

/// A tolerance that leaves the error of the step alone, radians.
const TIGHT: f64 = 1e-9;

/// Steps a second of the default: 8 a film frame.
const DEFAULT_RATE: f64 = 192.0;

/// Tips at t = 1, 2, 3 `sqrt(L / g)` in units of L.
type Tips = [[f64; 2]; 3];

/// Hair of 70 micrometres without air, internal damping or twist, and the length at which `w L^3 / B` is `gamma`.
pub(super) fn hair(gamma: f64) -> (Material, f64) {
    let m = in_vacuum();
    let area = FRAC_PI_4 * m.diameter * m.diameter;
    let bending = m.young * area * m.diameter * m.diameter / 16.0;
    (m, libm::cbrt(gamma * bending / (m.density * area * G)))
}

/// A horizontal hair of some length.
pub(super) fn level(length: f64, segments: usize) -> Vec<[f64; 3]> {
    (0..=segments).map(|i| [length * i as f64 / segments as f64, 0.0, 0.0]).collect()
}

/// Tips, and solves a step.
fn release(at: At, tolerance: f64, clock: &mut Clock) -> Result<(Tips, f64), SimError> {
    let (material, length) = hair(GAMMA);
    let substeps = (at.steps > 0).then_some(at.steps);
    let settings = Settings {
        model: at.model,
        material,
        substeps,
        tolerance,
        // The default halves steps by itself; elsewhere every step is as long as it says.
        largest_turn: if substeps.is_some() { 10.0 } else { Settings::default().largest_turn },
        sag_free: false,
        sleep: false,
        ..Settings::default()
    };
    let mut rig = Rig::under(&vec![level(length, at.segments); HAIRS], &settings, GRAVITY)?;
    let (mut tips, mut steps, mut solves) = ([[0.0; 2]; 3], 0, 0);
    for tip in &mut tips {
        clock.time(|| rig.wait((length / G).sqrt()))?;
        let p = rig.tip(0) / length;
        *tip = [p.x, p.y];
        steps += rig.last.particle_steps;
        solves += rig.last.particle_solves;
    }
    Ok((tips, solves as f64 / steps as f64))
}

/// Largest distance of tips.
fn apart(a: &Tips, b: &Tips) -> f64 {
    (0..3).map(|k| libm::hypot(a[k][0] - b[k][0], a[k][1] - b[k][1])).fold(0.0, f64::max)
}

/// The chain of `n` rigid links in steps far shorter than its fastest oscillation asks for.
fn exact_chain(n: usize) -> Tips {
    let mut chain = Chain::straight(GAMMA, 0.0, n);
    std::array::from_fn(|_| {
        chain.advance(1.0, 1.0 / (4.0 * (n * n) as f64 / GAMMA.sqrt()));
        chain.tip()
    })
}

pub(super) fn study(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let limit: LazyLock<Tips, _> = LazyLock::new(|| {
        let mut rod = spectral::Rod::straight(GAMMA, 10);
        std::array::from_fn(|_| {
            rod.advance(1.0, 800);
            rod.tip()
        })
    });
    let chains: Mutex<BTreeMap<usize, Tips>> = Mutex::default();
    let chain = |n: usize| *chains.lock().expect("no panic before").entry(n).or_insert_with(|| exact_chain(n));
    let fine: Mutex<BTreeMap<(&str, usize), Tips>> = Mutex::default();
    let measure = |_: f64, at: At, clock: &mut Clock| {
        let (tips, _) = release(at, Settings::default().tolerance, clock)?;
        // Springs are no chain of rigid links: their step is held against their own refined run.
        let own = match at.model {
            Model::Rod => chain(at.segments),
            model => {
                let known = fine.lock().expect("no panic before").get(&(name(model), at.segments)).copied();
                let tips = match known {
                    Some(tips) => tips,
                    None => release(At { steps: 2560, ..at }, TIGHT, &mut Clock::default())?.0,
                };
                fine.lock().expect("no panic before").insert((name(model), at.segments), tips);
                tips
            }
        };
        Ok([apart(&tips, &limit), apart(&tips, &own)])
    };
    let (rod, springs, paper) = (&[Model::Rod], &[Model::Springs], &[Model::Paper]);
    let at = match bench.quick {
        true => [
            At::all(rod, &[25, 50], &[10, 20, 40, 80, 160]),
            At::all(springs, &[25, 50], &[10, 20, 40, 80]),
            At::all(paper, &[25, 50], &[80, 160, 320]),
            At::all(rod, &[50], &[0]),
        ],
        false => [
            At::all(rod, &[12, 25, 50, 100], &[5, 10, 20, 40, 80, 160, 320, 640]),
            At::all(springs, &[25, 50, 100], &[10, 20, 40, 80, 160, 320]),
            At::all(paper, &[25, 50], &[80, 160, 320, 640, 1280]),
            At::all(rod, &[12, 25, 50, 100], &[0]),
        ],
    };
    let case = Case {
        name: "released",
        variants: &[("9.45", GAMMA)],
        at: at.concat(),
        finer: Finer::Steps,
        measure: &measure,
    };
    let mut rows = case.rows(bench)?;
    rows.iter_mut().for_each(|r| r.variant.clear());
    let (defaults, rows): (Vec<Row>, Vec<Row>) = rows.into_iter().partition(|r| r.at.steps == 0);
    findings.answers.push(answer(&rows, &defaults));
    findings.sections.push(table(&rows, &defaults));
    tolerances(bench, findings)?;
    method(bench, findings, &chain)
}

/// The cheapest row of a model whose error is at most `most`.
fn cheapest(rows: &[Row], model: Model, most: f64) -> Option<&Row> {
    let fits = |r: &&Row| r.at.model == model && r.error <= most;
    rows.iter().filter(fits).min_by(|a, b| a.seconds.total_cmp(&b.seconds))
}

/// Steps a `sqrt(L / g)` that the default comes to.
fn default_steps() -> f64 {
    ((hair(GAMMA).1 / G).sqrt() * DEFAULT_RATE).ceil()
}

/// Mean order in time with the most segments, from the longest step to the last that errs by more than 2e-5: below, the
/// rod's own stretch shows.
fn mean_order(rows: &[Row], model: Model) -> f64 {
    let segments = rows.iter().filter(|r| r.at.model == model).map(|r| r.at.segments).max().unwrap_or(0);
    let own = |r: &&Row| r.at.model == model && r.at.segments == segments && r.own > 2e-5;
    let all: Vec<&Row> = rows.iter().filter(own).collect();
    match (all.first(), all.last()) {
        (Some(a), Some(b)) if b.at.steps > a.at.steps => {
            libm::log(a.own / b.own) / libm::log(f64::from(b.at.steps) / f64::from(a.at.steps))
        }
        _ => f64::NAN,
    }
}

fn answer(rows: &[Row], defaults: &[Row]) -> String {
    let say = |model: Model| match cheapest(rows, model, 0.01) {
        Some(r) => format!(
            "{}: {} segments, {} steps a sqrt(L / g), {:.2} ms a hair",
            name(model),
            r.at.segments,
            r.at.steps,
            r.seconds * 1e3
        ),
        None => format!("{}: not reached", name(model)),
    };
    let each: Vec<String> = [Model::Rod, Model::Springs, Model::Paper].into_iter().map(say).collect();
    let row = |rows: &[Row], steps| {
        let found = rows.iter().find(|r| r.at == At { model: Model::Rod, segments: 50, steps });
        found.map_or([f64::NAN; 3], |r| [r.error * 100.0, r.own * 100.0, r.seconds * 1e3])
    };
    let ([error, own, cost], [half, _, more]) = (row(defaults, 0), row(rows, 40));
    let few = defaults.iter().find(|r| r.at.segments == 25).map_or(f64::NAN, |r| r.error * 100.0);
    let most = defaults.iter().map(|r| r.at.segments).max().unwrap_or(50);
    let why = match cheapest(rows, Model::Rod, 0.01) {
        Some(r) if r.at.segments == 25 && f64::from(r.at.steps) <= default_steps() + 1.0 => {
            " That is why these are the defaults: the cheapest within 1 % where nothing damps."
        }
        _ => "",
    };
    format!(
        "A released, undamped hair, tip within 1 % of its length at t = 1, 2, 3 sqrt(L / g), cheapest: {}. The default steps (192 \
         a second, here {:.0} a sqrt(L / g)) are off by {few:.2} % with the default 25 segments, and with 50 by {error:.2} % for \
         {cost:.2} ms, the step alone by {own:.2} %. 40 steps leave {half:.2} % for {more:.2} ms.{why} Order in time, mean over \
         steps: rod {:.2}, springs {:.2}, paper {:.2}; the rod's order in space, at the finest steps, {:.2}.",
        each.join("; "),
        default_steps(),
        mean_order(rows, Model::Rod),
        mean_order(rows, Model::Springs),
        mean_order(rows, Model::Paper),
        order_in_space(rows, most),
    )
}

/// Between half the segments and these, at the shortest step.
fn order_in_space(rows: &[Row], segments: usize) -> f64 {
    let last =
        |n: usize| rows.iter().rfind(|r| r.at.model == Model::Rod && r.at.segments == n).map_or(f64::NAN, |r| r.error);
    libm::log2(last(segments / 2) / last(segments))
}

fn table(rows: &[Row], defaults: &[Row]) -> Section {
    let mut all = rows.to_vec();
    all.extend_from_slice(defaults);
    let mut s = section(
        "A hair let go",
        "largest tip error, lengths",
        "the same, of the step alone",
        &all,
    )
    .says(
        "A straight horizontal hair, clamped at its root, is released from rest without air and internal damping: rho A \
         r_tt = (N)' - w e_y, M' + r' x N = 0, M = B kappa, with Gamma = w L^3 / B = 9.45 (70 micrometres, 9.6 cm). A bent wave \
         runs along it and nothing calms it: hard for any method. The error is the largest distance of the tip at t = 1, 2, 3 \
         sqrt(L / g), in lengths.",
    )
    .says(
        "Reference: the inextensible rod by a spectral method (theta(s) in ten integrated Legendre polynomials, virtual work, \
         classical Runge-Kutta in time), which shares nothing with the simulation. The error of the step alone is the \
         distance to a chain of as many rigid links, moved by Lagrange's equations in small Runge-Kutta steps; for springs and \
         the paper's nine steps, which are no such chain, to their own run of 2,560 steps.",
    )
    .says(
        "Processor seconds a hair for t = 0 to 3 on one thread, eight hairs side by side. Points without steps are the \
         default: 192 steps a second, tolerance 1e-5, steps halved where a hair turns too far (rings). To be seen: with few \
         steps the step rules, with many the segments; springs and the paper's steps keep an error of their own however many \
         steps they take.",
    );
    let error: fn(&Row) -> f64 = |r| r.error;
    let step: fn(&Row) -> f64 = |r| f64::from(r.at.steps);
    let ring = |mut series: Vec<Series>, x: &dyn Fn(&Row) -> f64, y: fn(&Row) -> f64| {
        for d in defaults {
            let label = format!("rod, {} seg.", d.at.segments);
            series.iter_mut().filter(|s| s.name == label).for_each(|s| s.mark = Some([x(d), y(d)]));
        }
        // Diverged runs would squeeze the rest.
        series.iter_mut().for_each(|s| s.points.retain(|p| p[1] < 1.0));
        series
    };
    let seconds = lines(rows, Finer::Steps, |r| r.seconds, error);
    let axis = "largest tip error, lengths";
    s.plots.push(logarithmic(
        "Released hair: error against time",
        ["processor seconds a hair", axis],
        ring(seconds, &|r| r.seconds, error),
    ));
    let steps = lines(rows, Finer::Steps, step, error);
    let axes = ["steps a &#8730;(L/g)", axis];
    s.plots.push(logarithmic("Released hair: error against steps", axes, ring(steps, &|_| default_steps(), error)));
    let own: fn(&Row) -> f64 = |r| r.own;
    let mut alone = ring(lines(rows, Finer::Steps, step, own), &|_| default_steps(), own);
    alone.push(second_order([10.0, 2e-2], 32.0));
    s.plots.push(logarithmic("Released hair: error of the step alone", axes, alone));
    s
}

/// What a looser end of iterations costs.
fn tolerances(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let mut s = Section::new("Tolerance", &["change of the tip, lengths", "solves a step"]).says(
        "The same hair with 50 segments, rod. A stage ends when no segment would turn by more than the tolerance in all \
         iterations to come. Change against the same steps solved to 1e-12. A step has two stages, so two solves are the \
         least. To be seen: what the tolerance adds is below the error of the step from 1e-2 on.",
    );
    let (mut errors, mut solves) = (Vec::new(), Vec::new());
    let exponents: &[u8] = if bench.quick { &[2, 5, 7] } else { &[2, 3, 4, 5, 6, 7, 8, 9] };
    for steps in [20, 80] {
        let at = At { model: Model::Rod, segments: 50, steps };
        let exact = LazyLock::new(|| on_threads(1, || release(at, 1e-12, &mut Clock::default())));
        let (mut error, mut solve, mut mark) = (Vec::new(), Vec::new(), [None; 2]);
        for e in exponents {
            let tolerance = libm::pow(10.0, -f64::from(*e));
            let point = format!("tolerance/1e-{e}/{steps}-steps");
            let [off, each] = s.row(bench, &point, || {
                let (tips, solves) =
                    on_threads(1, || release(at, tolerance, &mut Clock::default())).map_err(refused)?;
                let exact = exact.as_ref().map_err(|e| refused(e.clone()))?;
                Ok([apart(&tips, &exact.0), solves])
            })?;
            error.push([tolerance, off]);
            solve.push([tolerance, each]);
            if *e == 5 {
                mark = [Some([tolerance, off]), Some([tolerance, each])];
            }
        }
        let label = format!("{steps} steps");
        errors.push(Series { mark: mark[0], ..Series::new(label.clone(), error) });
        solves.push(Series { mark: mark[1], ..Series::new(label, solve) });
    }
    let axis = "tolerance, radians";
    s.plots.push(logarithmic("Tolerance: error", [axis, "change of the tip, lengths"], errors));
    let axes = [axis, "solves a step"];
    let title = "Tolerance: work";
    s.plots.push(crate::bench::plot::Plot { title, axes, log: [true, false], series: solves }.svg());
    findings.sections.push(s);
    Ok(())
}

/// How far the method itself is from the chain it moves.
fn method(bench: &mut Bench<'_>, findings: &mut Findings, chain: &dyn Fn(usize) -> Tips) -> Result<(), Error> {
    let n = 25;
    let columns = ["SDIRK2 on rigid links, lengths", "the rod, lengths"];
    let mut s = Section::new("Does stiff stretching cost accuracy?", &columns).says(
        "The same hair. SDIRK2 (R. Alexander 1977), the two-stage L-stable method with the same implicit coefficient as the rod's TR-BDF2, moves \
         the chain of rigid links by its angles, where nothing stretches, with Newton's method to rounding; and the rod of as \
         many segments with a tolerance of 1e-9, where stretching is a million times stiffer than bending. Both against the \
         chain in small Runge-Kutta steps. To be seen: errors of the same size; little is lost by edges that stretch.",
    );
    let steps: &[u32] = if bench.quick { &[20, 80] } else { &[5, 10, 20, 40, 80, 160, 320] };
    for &steps in steps {
        s.row(bench, &format!("method/{n}-segments/{steps}-steps"), || {
            let mut c = Chain::straight(GAMMA, 0.0, n);
            let tips = std::array::from_fn(|_| {
                (0..steps).for_each(|_| c.implicit_step(1.0 / f64::from(steps)));
                c.tip()
            });
            let at = At { model: Model::Rod, segments: n, steps };
            let rod = on_threads(1, || release(at, TIGHT, &mut Clock::default())).map_err(refused)?.0;
            let exact = chain(n);
            Ok([apart(&tips, &exact), apart(&rod, &exact)])
        })?;
    }
    let ratio = |pick: fn(f64, f64) -> f64| s.rows.iter().map(|(_, v)| v[1] / v[0]).fold(f64::NAN, pick);
    findings.answers.push(format!(
        "What stiff stretching costs in accuracy: the rod's error of the step is {:.2} to {:.2} times that of such a method \
         on rigid links.",
        ratio(f64::min),
        ratio(f64::max)
    ));
    findings.sections.push(s);
    Ok(())
}
