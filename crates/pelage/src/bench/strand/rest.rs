//! Hairs at rest, and the loads under which they buckle.

use super::{
    At, Case, Clock, Finer, HAIRS, Row, lines, logarithmic, median, name, second_order, section, work_precision,
};
use crate::Error;
use crate::bench::{Bench, Findings, Section};
use pelage_sim::reference::elastica::{self, Load};
use pelage_sim::reference::{cable, formula, helix, root};
use pelage_sim::rig::{G, GRAVITY, Rig, bending_time, links, placed, placed_turned, plain, rod, straight, turned};
use pelage_sim::{End, Material, Model, Root, Settings, SimError, Vec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

const ROD: &[Model] = &[Model::Rod];
const BOTH: &[Model] = &[Model::Rod, Model::Springs];

/// A rod that comes to rest soon. Springs' triangles must be rigid against their hinges (EA l^2 >> EI), or the error grows
/// again with finer segments.
fn calm(model: Model, gamma: f64) -> Settings {
    let stretch_factor = if model == Model::Springs { 100.0 } else { 1.0 };
    plain(model, Material { damping: 0.3, stretch_factor, ..rod(gamma) })
}

/// Several of the same hair at rest, and their first.
fn rested(
    hair: Vec<[f64; 3]>,
    settings: &Settings,
    gravity: [f64; 3],
    clock: &mut Clock,
) -> Result<Vec<Vec3>, SimError> {
    let mut rig = Rig::under(&vec![hair; HAIRS], settings, gravity)?;
    clock.time(|| rig.rest())?;
    Ok(rig.hair(0))
}

/// Tip of a horizontal cantilever against the elastica and against the chain of as many links, lengths.
fn cantilever(gamma: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let p = rested(straight(at.segments, Vec3::x()), &calm(at.model, gamma), GRAVITY, clock)?;
    let tip = p[at.segments];
    let load = Load { gamma, ..Load::default() };
    let off = |s: &elastica::Shape| libm::hypot(tip.x - s.x, tip.y + s.drop);
    let own = if at.model == Model::Rod { off(&elastica::discrete(&load, at.segments)) } else { f64::NAN };
    Ok([off(&elastica::continuous(&load, 2000)), own])
}

/// Tip of a hair that curls down by itself.
fn curl(curvature: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let n = at.segments;
    let load = Load { gamma: 5.0, curvature, ..Load::default() };
    let natural: Vec<f64> = (0..n).map(|i| -curvature * (i as f64 + 0.5) / n as f64).collect();
    let p = rested(links(&natural), &calm(at.model, load.gamma), GRAVITY, clock)?;
    let off = |s: &elastica::Shape| libm::hypot(p[n].x - s.x, p[n].y + s.drop);
    let own = if at.model == Model::Rod { off(&elastica::discrete(&load, n)) } else { f64::NAN };
    Ok([off(&elastica::continuous(&load, 2000)), own])
}

/// Sinking of a horizontal quarter circle's tip.
fn hook(poisson: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let gamma = 0.05;
    let step = FRAC_PI_2 / at.segments as f64;
    let angle: Vec<f64> = (0..at.segments).map(|i| (i as f64 + 0.5) * step).collect();
    let settings = plain(at.model, Material { poisson, damping: 0.3, ..rod(gamma) });
    let p = rested(links(&angle), &settings, [0.0, 0.0, -G], clock)?;
    let radius: f64 = 2.0 / PI;
    let twisting = (1.0 + poisson) * (PI * PI / 8.0 - FRAC_PI_2 + 0.5);
    let exact = gamma * radius.powi(4) * (0.5 + twisting);
    Ok([(-p[at.segments].z / exact - 1.0).abs(), f64::NAN])
}

/// Farthest point from the half circle to which an end moment bends a hair.
fn half_circle(angle: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let settings = Settings { tip: End::Clamped, ..calm(at.model, 1.0) };
    let mut rig = Rig::under(&vec![straight(at.segments, Vec3::x()); HAIRS], &settings, [0.0; 3])?;
    let place = |a: f64| {
        let [x, y] = formula::bent_by_moment(a);
        Some(vec![placed_turned([x, y, 0.0], Vec3::z(), a); HAIRS])
    };
    clock.time(|| {
        for k in 1..=30 {
            rig.carry(0.02, rig.roots.clone(), place(angle * f64::from(k) / 30.0))?;
        }
        rig.rest()
    })?;
    let bent = rig.hair(0);
    let far = bent.iter().enumerate().map(|(i, p)| {
        let s = i as f64 / at.segments as f64;
        let [x, y] = formula::bent_by_moment(angle * s).map(|c| c * s);
        (p - Vec3::new(x, y, 0.0)).norm()
    });
    Ok([far.fold(0.0, f64::max), f64::NAN])
}

/// Sag of a hair without bending stiffness between two points at equal height.
fn hung_cable(length: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let n = at.segments;
    let settings = Settings {
        root: End::Pinned,
        tip: End::Pinned,
        ..plain(at.model, Material { bend_factor: 1e-8, drag_factor: 300.0, ..rod(1.0) })
    };
    // A tent, upside down, of length 1.
    let lean = libm::acos(1.0 / length);
    let tent: Vec<f64> = (0..n).map(|i| if i < n / 2 { -lean } else { lean }).collect();
    let p = rested(links(&tent), &settings, GRAVITY, clock)?;
    let sag = -p.iter().map(|p| p.y).fold(0.0, f64::min) * length;
    let off = |c: cable::Cable| (sag / c.sag - 1.0).abs();
    Ok([off(cable::catenary(length)), off(cable::discrete(length, n))])
}

/// How much longer a hanging hair gets.
fn stretched(strain: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    // Triangles of springs are rigid if edges are far stiffer than hinges.
    let m = rod(if at.model == Model::Rod { 100.0 } else { 1e5 });
    let area = FRAC_PI_4 * m.diameter * m.diameter;
    let weight = m.density * area * G;
    let stretch_factor = weight / (2.0 * m.young * area * strain);
    let settings = plain(at.model, Material { stretch_factor, damping: 0.3, ..m });
    let settings = Settings { strain_limit: 0.1, ..settings };
    let p = rested(straight(at.segments, -Vec3::y()), &settings, GRAVITY, clock)?;
    let exact = formula::stretch_under_weight(weight, 1.0, m.young * area * stretch_factor);
    Ok([((-p[at.segments].y - 1.0) / exact - 1.0).abs(), f64::NAN])
}

/// Length of a hanging helix of ten turns, `w L^3 / B` = gamma.
fn hung_helix(gamma: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let (turns, slope, n) = (10, 0.2, at.segments);
    let each = n / turns;
    // Curvature k and torsion slope k: k sqrt(1 + slope^2) L = 2 pi turns.
    let omega = 2.0 * PI * turns as f64;
    let curvature = omega / f64::sqrt(1.0 + slope * slope);
    let (radius, rise) = (curvature / (omega * omega), slope * curvature / omega);
    let natural = (0..=n).map(|i| {
        let s = i as f64 / n as f64;
        [radius * libm::cos(omega * s), -rise * s, radius * libm::sin(omega * s)]
    });
    // Forces in units of B k^2.
    let force = |s: f64| gamma * (1.0 - s) / (curvature * curvature);
    let stretch_factor = if at.model == Model::Rod { 1.0 } else { 1e3 };
    let m = Material { damping: 0.03, drag_factor: 200.0, stretch_factor, ..rod(gamma) };
    let settings = Settings { tolerance: 1e-5, ..plain(at.model, m) };
    let mut rig = Rig::under(&vec![natural.collect(); HAIRS], &settings, GRAVITY)?;
    clock.time(|| rig.steps(160, 0.02))?;
    // The clamp holds the first turns at their natural pitch: measured beyond them.
    let p = rig.hair(0);
    let start = 1.0 / turns as f64;
    let at_s = |i: i32| start + (1.0 - start) * (f64::from(i) + 0.5) / 200.0;
    let c_over_b = 1.0 / (1.0 + m.poisson);
    let pitch = |i: i32| helix::helix(c_over_b, slope, force(at_s(i))).sin_pitch;
    let exact = (0..200).map(pitch).sum::<f64>() * (1.0 - start) / 200.0;
    Ok([((p[each].y - p[n].y) / exact - 1.0).abs(), f64::NAN])
}

/// A family of hairs at rest.
struct Family<'a> {
    title: &'a str,
    text: [&'a str; 2],
    error: &'static str,
    case: Case<'a>,
}

pub(super) fn study(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let mut all: Vec<Row> = Vec::new();
    for f in families(bench.quick) {
        let rows = f.case.rows(bench)?;
        let mut s = section(f.title, f.error, "against as many links", &rows);
        s.text = f.text.map(str::to_owned).into();
        let mut series = lines(&rows, Finer::Segments, |r| r.at.segments as f64, |r| r.error);
        if let Some(first) = series.first().and_then(|s| s.points.first()).copied() {
            series.push(second_order(first, 4.0));
        }
        s.plots.push(logarithmic(f.title, ["segments", f.error], series));
        s.plots.push(work_precision(f.title, f.error, &rows));
        findings.sections.push(s);
        all.extend(rows);
    }
    let fits = |model| {
        let mut need: Vec<(String, Option<usize>)> = Vec::new();
        for r in all.iter().filter(|r| r.at.model == model) {
            let case = r.point.split(&format!("/{}/", name(model))).next().unwrap_or_default().to_owned();
            if need.iter().all(|(c, _)| *c != case) {
                need.push((case, None));
            }
            // Rows go from few segments to many.
            if let Some(last) = need.last_mut().filter(|l| l.1.is_none() && r.error <= 0.01) {
                last.1 = Some(r.at.segments);
            }
        }
        let say = |(case, n): &(String, Option<usize>)| match n {
            Some(n) => format!("{case} {n}"),
            None => format!("{case} not reached"),
        };
        need.iter().map(say).collect::<Vec<_>>().join(", ")
    };
    let order = |model| median(all.iter().filter(|r| r.at.model == model && r.error > 1e-5).map(|r| r.order));
    findings.answers.push(format!(
        "Hair at rest, segments for 1 % (of those tried): rod: {}; springs: {}. Order in space, median: rod {:.2}, springs \
         {:.2}.",
        fits(Model::Rod),
        fits(Model::Springs),
        order(Model::Rod),
        order(Model::Springs)
    ));
    thresholds(bench, findings)
}

fn families(quick: bool) -> Vec<Family<'static>> {
    let at = |models: &[Model], few: &[usize], all: &[usize]| At::all(models, if quick { few } else { all }, &[0]);
    let case = |name, variants: &'static [(&'static str, f64)], at, measure| {
        let variants = if quick { &variants[..1] } else { variants };
        Case { name, variants, at, finer: Finer::Segments, measure }
    };
    let tip = "tip error, lengths";
    vec![
        Family {
            title: "A heavy cantilever",
            text: [
                "A straight hair, clamped horizontally, comes to rest under its weight: theta'' = -Gamma (1 - s) cos theta, \
                 theta(0) = 0, theta'(1) = 0, x = int cos theta, drop = int sin theta. Reference: Numerov's scheme with Newton's \
                 method on 2,000 intervals (fourth order; held against outside figures to 1e-9 by tests). Second column: the \
                 chain of as many rigid links with the rod's weight at its nodes.",
                "Seconds are those of coming to rest from horizontal in 140 long steps, a hair. To be seen: second order in \
                 space; the rod is the chain of rigid links but for its stretch; long hair (large Gamma) needs segments \
                 shorter than the bend at its root, sqrt(2 / Gamma) of its length.",
            ],
            error: tip,
            case: case(
                "cantilever",
                &[("Gamma=10", 10.0), ("Gamma=1", 1.0), ("Gamma=100", 100.0)],
                at(BOTH, &[12, 25, 50], &[6, 12, 25, 50, 100]),
                &cantilever,
            ),
        },
        Family {
            title: "A curl in its plane",
            text: [
                "A hair with the natural curvature k, Gamma = 5, clamped horizontally, curls down: theta'' = -Gamma (1 - s) cos \
                 theta, theta(0) = 0, theta'(1) = k.",
                "Reference and columns as above. To be seen: springs, linear up to hinges of 0.15 rad only, need more segments.",
            ],
            error: tip,
            case: case("curl", &[("k=2", 2.0), ("k=5", 5.0)], at(BOTH, &[12, 25], &[12, 25, 50, 100]), &curl),
        },
        Family {
            title: "A horizontal hook",
            text: [
                "A quarter circle in the plane across gravity sinks by bending and by twisting: w R^4 / B (1/2 + (B / C) (pi^2 / 8 - \
                 pi / 2 + 1/2)), B / C = 1 + Poisson's ratio, by Castigliano's theorem, for small sinking (Gamma = 0.05).",
                "To be seen: twisting stiffness is right at every Poisson's ratio; springs count their four azimuths alike only \
                 over many turns of them.",
            ],
            error: "error of the sinking, relative",
            case: case(
                "hook",
                &[("Poisson=0.3", 0.3), ("Poisson=0", 0.0), ("Poisson=0.5", 0.5)],
                at(BOTH, &[12, 25], &[6, 12, 25, 50, 100]),
                &hook,
            ),
        },
        Family {
            title: "Bent to a half circle",
            text: [
                "Without gravity the clamped tip is carried to where an end moment M = pi B / L alone holds it: (sin a, 1 - cos a) / \
                 a, a = M L / B. Every point should lie on the circle.",
                "To be seen: bending is right far beyond small angles.",
            ],
            error: "farthest from the circle, lengths",
            case: case("half-circle", &[("a=pi", PI)], at(BOTH, &[12, 25], &[6, 12, 25, 50, 100]), &half_circle),
        },
        Family {
            title: "A catenary",
            text: [
                "A hair without bending stiffness hangs between two points at equal height, D apart: 2 a sinh(D / (2 a)) = L, sag = a \
                 (cosh(D / (2 a)) - 1); the points name L / D. Second column: as many rigid links, i-th with vertical force w l (i - (n - 1) / 2).",
                "Rod only: without bending stiffness the extra particles of springs turn about the axis for ever.",
            ],
            error: "error of the sag, relative",
            case: case(
                "catenary",
                &[("length=1.2", 1.2), ("length=2", 2.0)],
                at(ROD, &[12, 24], &[6, 12, 24, 48]),
                &hung_cable,
            ),
        },
        Family {
            title: "Stretched by its weight",
            text: [
                "A hanging hair of stretching stiffness E A gets longer by w L^2 / (2 E A), here 0.5 %.",
                "To be seen: masses at the nodes, half at the tip, make this exact for any number of segments; springs stretch \
                 their altitudes a little too.",
            ],
            error: "error of the lengthening, relative",
            case: case("stretch", &[("strain=0.005", 0.005)], at(BOTH, &[10, 40], &[10, 20, 40]), &stretched),
        },
        Family {
            title: "A hanging helix",
            text: [
                "A helix of ten turns hangs from its clamp; each piece bears the weight F below it: m_t sin a + m_b cos a = 0, F r = m_t \
                 cos a - m_b sin a, m_b = B (kappa - kappa0), m_t = C (tau - tau0) (Love's helix, sections 270 and 271), summed over the \
                 hair beyond its first turn.",
                "To be seen: segments a turn (a tenth of the number) decide; about a dozen are needed.",
            ],
            error: "error of the length, relative",
            case: case(
                "helix",
                &[("Gamma=2000", 2e3), ("Gamma=1000", 1e3)],
                if quick { At::all(ROD, &[120, 240], &[0]) } else { At::all(BOTH, &[80, 120, 240, 480], &[0]) },
                &hung_helix,
            ),
        },
    ]
}

/// Whether a small push sideways grows within `count` steps: the distance to the same hair without the push.
fn grows(rig: &mut Rig, push: Vec3, count: usize, seconds: f64) -> Result<bool, SimError> {
    let mut calm = rig.clone();
    let gravity = rig.gravity;
    rig.gravity = (Vec3::from(gravity) + push).into();
    rig.wait(seconds)?;
    rig.gravity = gravity;
    calm.wait(seconds)?;
    let (mut early, mut late) = (0.0f64, 0.0f64);
    for k in 0..count {
        rig.wait(seconds)?;
        calm.wait(seconds)?;
        let away = rig.apart(&calm, 0);
        if k < count / 40 { early = early.max(away) } else { late = late.max(away) }
    }
    Ok(late > 60.0 * early)
}

/// Turns both ends against each other about the x axis, their direction. One end alone would roll a ring along: round
/// hair has no favourite plane.
fn twist_ends(rig: &mut Rig, tip: [f64; 3], at_rest: f64, angle: f64) -> Result<(), SimError> {
    let count = 60;
    (1..=count).try_for_each(|k| {
        let half = 0.5 * angle * f64::from(k) / f64::from(count);
        let q = turned(Vec3::x(), half).quaternion() * turned(Vec3::z(), at_rest).quaternion();
        let end = Root { rotation: [q.i, q.j, q.k, q.w], ..placed(tip) };
        rig.carry(0.01, vec![placed_turned([0.0; 3], Vec3::x(), -half)], Some(vec![end]))
    })
}

/// Whether a clamped upright hair of `factor` times the critical Gamma falls over.
fn falls(model: Model, n: usize, factor: f64) -> Result<bool, SimError> {
    let settings = plain(model, Material { damping: 5e-3, ..rod(formula::self_buckling() * factor) });
    let mut rig = Rig::under(&[straight(n, Vec3::y())], &settings, GRAVITY)?;
    grows(&mut rig, Vec3::new(1e-4, 0.0, 0.7e-4), 600, 0.03)
}

/// Whether a hair pushed together by `factor` times a load buckles.
fn pushed(ends: [End; 2], load: f64, model: Model, n: usize, factor: f64) -> Result<bool, SimError> {
    let m = rod(1.0);
    // The compression that carries the load: P L / (E A), with B / (E A) = d^2 / 16.
    let softer = 1e-2;
    let shorter = factor * load * m.diameter * m.diameter / (16.0 * softer);
    let m = Material { damping: 1e-2, stretch_factor: softer, ..m };
    let settings = Settings { root: ends[0], tip: ends[1], tolerance: 1e-9, ..plain(model, m) };
    let mut rig = Rig::under(&[straight(n, Vec3::x())], &settings, [0.0; 3])?;
    rig.carry(0.05, vec![placed([0.0; 3])], Some(vec![placed([1.0 - shorter, 0.0, 0.0])]))?;
    grows(&mut rig, Vec3::new(0.0, 1e-6, 0.6e-6), 300, 0.03 * bending_time(1.0))
}

/// Whether a hair clamped at both ends and twisted by `factor` times the critical angle buckles.
fn twisted(model: Model, n: usize, factor: f64) -> Result<bool, SimError> {
    let half = root(|x| libm::sin(x) - x * libm::cos(x), 4.0, 4.7);
    let m = rod(1.0);
    let angle = factor * 2.0 * half * (1.0 + m.poisson);
    let material = Material { damping: 1e-4, stretch_factor: 1e-2, ..m };
    let settings = Settings { tip: End::Clamped, tolerance: 1e-9, ..plain(model, material) };
    let mut rig = Rig::under(&[straight(n, Vec3::x())], &settings, [0.0; 3])?;
    twist_ends(&mut rig, [1.0, 0.0, 0.0], 0.0, angle)?;
    grows(&mut rig, Vec3::new(0.0, 1e-6, 0.6e-6), 400, 0.03 * bending_time(1.0))
}

/// Whether a ring twisted by `factor` times the critical angle leaves its plane.
fn ring(model: Model, n: usize, factor: f64) -> Result<bool, SimError> {
    let m = rod(1.0);
    let settings = Settings { tip: End::Clamped, tolerance: 1e-9, ..plain(model, Material { damping: 2e-3, ..m }) };
    // A straight rod bent to a ring: every inner hinge by 2 pi / n, the clamps' by half of that.
    let mut rig = Rig::under(&[straight(n, Vec3::x())], &settings, [0.0; 3])?;
    let bent = |a: f64| {
        let angle: Vec<f64> = (0..n).map(|i| a * (i as f64 + 0.5) / n as f64).collect();
        links(&angle)[n]
    };
    for k in 1..=100 {
        let a = 2.0 * PI * f64::from(k) / 100.0;
        rig.carry(0.01, rig.roots.clone(), Some(vec![placed_turned(bent(a), Vec3::z(), a)]))?;
    }
    rig.steps(40, 0.05)?;
    let flat = rig.clone();
    let angle = factor * formula::ring_twist(2, 1.0 / (1.0 + m.poisson));
    twist_ends(&mut rig, bent(2.0 * PI), 2.0 * PI, angle)?;
    rig.steps(400, 0.03 * bending_time(1.0))?;
    Ok(rig.apart(&flat, 0) > 0.03)
}

type Buckles = Box<dyn Fn(Model, usize, f64) -> Result<bool, SimError>>;

/// Where straight and round hair buckles.
fn thresholds(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let mut s = Section::new("Buckling", &["stands at, of the threshold", "buckles at"])
        .says(
            "A load is a fraction of its threshold. Searched by halving between 0.9 and 1.1 for the load at which a push of a \
             millionth grows to 60 times what it was in the first moments (the ring: leaves its plane by 3 % of its length). \
             Thresholds: upright under its weight (Greenhill 1881), Gamma = (9 / 4) j^2 with J_-1/3(j) = 0; pushed ends (Euler), P \
             L^2 / B = pi^2 pinned, k^2 with tan k = k clamped and pinned, 4 pi^2 clamped; twisted between clamps (Greenhill 1883), \
             tan(m / 2) = m / 2 with m = M L / B; a ring (Michell 1889), twist 2 pi sqrt(3) B / C.",
        )
        .says(
            "To be seen: thresholds of the rod are met within 2 to 3 %. Slow growth just above a threshold counts as \
             standing, so that the figures lie a little high. Springs are held to the first: edges as soft as the others need do \
             not keep their triangles rigid, and their figures only show that.",
        );
    let euler = |ends: [End; 2], load: f64| -> Buckles { Box::new(move |m, n, f| pushed(ends, load, m, n, f)) };
    let (pinned, clamped) = (End::Pinned, End::Clamped);
    let mut cases: Vec<(&str, Model, usize, Buckles)> = vec![
        ("upright", Model::Rod, 50, Box::new(falls)),
        ("pushed-pinned-pinned", Model::Rod, 50, euler([pinned, pinned], PI * PI)),
        ("twisted", Model::Rod, 60, Box::new(twisted)),
    ];
    if !bench.quick {
        cases.extend::<[(&str, Model, usize, Buckles); 9]>([
            ("upright", Model::Rod, 25, Box::new(falls)),
            ("upright", Model::Springs, 50, Box::new(falls)),
            ("pushed-clamped-pinned", Model::Rod, 50, euler([clamped, pinned], formula::euler_clamped_pinned())),
            ("pushed-clamped-clamped", Model::Rod, 50, euler([clamped, clamped], formula::euler_clamped_clamped())),
            ("ring", Model::Rod, 60, Box::new(ring)),
            ("pushed-pinned-pinned", Model::Springs, 50, euler([pinned, pinned], PI * PI)),
            ("pushed-clamped-clamped", Model::Springs, 50, euler([clamped, clamped], formula::euler_clamped_clamped())),
            ("twisted", Model::Springs, 60, Box::new(twisted)),
            ("ring", Model::Springs, 60, Box::new(ring)),
        ]);
    }
    let steps = if bench.quick { 3 } else { 5 };
    for (case, model, n, buckles) in &cases {
        let point = format!("threshold/{case}/{}/{n}-segments", name(*model));
        s.threshold(bench, &point, steps, |factor| buckles(*model, *n, factor))?;
    }
    let off = |model: Model| {
        let of = s.rows.iter().filter(|(point, _)| point.contains(&format!("/{}/", name(model))));
        of.map(|(_, v)| (0.5 * (v[0] + v[1]) - 1.0).abs()).filter(|v| v.is_finite()).fold(f64::NAN, f64::max) * 100.0
    };
    findings.answers.push(format!(
        "Buckling: {} thresholds; the rod meets its own within {:.1} % (springs {:.1} %; 10 is the end of the search).",
        s.rows.len(),
        off(Model::Rod),
        off(Model::Springs)
    ));
    findings.sections.push(s);
    Ok(())
}
