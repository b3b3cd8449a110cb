//! Hairs that swing: frequencies, periods and damping.

use super::{At, Case, Clock, Finer, HAIRS, Row, lines, logarithmic, median, second_order, section, work_precision};
use crate::Error;
use crate::bench::{Bench, Findings};
use pelage_sim::reference::{chain, vibration};
use pelage_sim::rig::{G, Rig, bending_time, plain, rod, straight};
use pelage_sim::{End, Material, Model, Settings, SimError, Vec3};
use std::f64::consts::PI;

const BOTH: &[Model] = &[Model::Rod, Model::Springs];

/// Mean angular frequency of a signal sampled every `dt`, from its first to its last passage through 0.
fn frequency(signal: &[f64], dt: f64) -> f64 {
    let zero = |k: usize| k as f64 + signal[k] / (signal[k] - signal[k + 1]);
    let at: Vec<f64> =
        (0..signal.len().saturating_sub(1)).filter(|&k| (signal[k] > 0.0) != (signal[k + 1] > 0.0)).map(zero).collect();
    match at[..] {
        [first, .., last] => PI * (at.len() - 1) as f64 / ((last - first) * dt),
        _ => f64::NAN,
    }
}

/// Amplitude of one of a hair's oscillations after a blow across it: `weight` takes it out of the links' directions.
struct Swing<'a> {
    hair: Vec<[f64; 3]>,
    settings: Settings,
    gravity: Vec3,
    /// Across the hair.
    blow: Vec3,
    weight: &'a [f64],
    dt: f64,
    count: usize,
}

impl Swing<'_> {
    fn signal(self, clock: &mut Clock) -> Result<Vec<f64>, SimError> {
        let calm: [f64; 3] = self.gravity.into();
        let mut rig = Rig::under(&vec![self.hair; HAIRS], &self.settings, calm)?;
        let across = self.blow.normalize();
        rig.gravity = (self.gravity + self.blow).into();
        clock.time(|| rig.wait(1e-2 * self.dt))?;
        rig.gravity = calm;
        (0..self.count)
            .map(|_| {
                clock.time(|| rig.wait(self.dt))?;
                let p = rig.hair(0);
                Ok(p.windows(2).zip(self.weight).map(|(w, f)| (w[1] - w[0]).dot(&across) * f).sum())
            })
            .collect()
    }
}

/// Frequency of oscillation `mode` of a clamped hair, hanging with `gamma` or without gravity (0): against the rod and the
/// chain of as many links.
fn hanging(gamma: f64, mode: usize, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let stiff = if gamma > 0.0 { gamma } else { 1.0 };
    let exact = vibration::hanging_rod(gamma, 12)[mode];
    let own = chain::frequencies(gamma, at.segments)[mode];
    let dt = 2.0 * PI / exact / f64::from(at.steps);
    let swing = Swing {
        hair: straight(at.segments, -Vec3::y()),
        settings: plain(at.model, rod(stiff)),
        gravity: Vec3::new(0.0, if gamma > 0.0 { -G } else { 0.0 }, 0.0),
        blow: Vec3::x() * (0.01 / dt),
        weight: &chain::projections(gamma, at.segments)[mode],
        dt: dt * bending_time(stiff),
        count: (2 * mode + 3) * at.steps as usize,
    };
    let found = frequency(&swing.signal(clock)?, dt);
    Ok([(found / exact - 1.0).abs(), (found / own - 1.0).abs()])
}

/// Frequency `mode` of a hair almost without bending stiffness, pinned, in units of sqrt(g / L).
fn thread(mode: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let mode = mode as usize;
    // The extra particles of springs must not turn freely.
    let gamma = if at.model == Model::Rod { 1e8 } else { 1e4 };
    let exact = vibration::hanging_chain(mode + 1);
    let own = chain::frequencies(gamma, at.segments)[mode] / f64::sqrt(gamma);
    let dt = 2.0 * PI / exact / f64::from(at.steps);
    let swing = Swing {
        hair: straight(at.segments, -Vec3::y()),
        settings: Settings { root: End::Pinned, ..plain(at.model, Material { bend_factor: 1.0 / gamma, ..rod(1.0) }) },
        gravity: Vec3::new(0.0, -G, 0.0),
        blow: Vec3::x() * (0.1 / dt),
        weight: &chain::projections(gamma, at.segments)[mode],
        dt: dt * (1.0 / G).sqrt(),
        count: 4 * at.steps as usize,
    };
    let found = frequency(&swing.signal(clock)?, dt);
    Ok([(found / exact - 1.0).abs(), (found / own - 1.0).abs()])
}

/// Period of a bob on one stiff segment released at `angle`.
fn pendulum(angle: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let direction = Vec3::new(libm::sin(angle), -libm::cos(angle), 0.0);
    let settings = Settings { root: End::Pinned, ..plain(at.model, rod(10.0)) };
    let hairs = vec![straight(at.segments, direction); HAIRS];
    let mut rig = Rig::new(&hairs, &settings)?;
    let exact = 2.0 * PI * (1.0 / G).sqrt() * vibration::pendulum_period(angle);
    let dt = exact / f64::from(at.steps);
    let swing = (0..at.steps * 7 / 2)
        .map(|_| {
            clock.time(|| rig.wait(dt))?;
            Ok(rig.tip(0).x)
        })
        .collect::<Result<Vec<f64>, SimError>>()?;
    Ok([(2.0 * PI / frequency(&swing, dt) / exact - 1.0).abs(), f64::NAN])
}

/// Logarithmic decrement of the first oscillation of a clamped hair without gravity.
fn damped(zeta: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    let unit = bending_time(1.0);
    let omega = chain::frequencies(0.0, at.segments)[0];
    let (steps, dt) = (at.steps as usize, 2.0 * PI / omega / f64::from(at.steps));
    let swing = Swing {
        hair: straight(at.segments, Vec3::x()),
        settings: plain(at.model, Material { damping: 2.0 * zeta / omega * unit, ..rod(1.0) }),
        gravity: Vec3::zeros(),
        blow: Vec3::y() * (0.1 / dt),
        weight: &chain::projections(0.0, at.segments)[0],
        dt: dt * unit,
        count: 5 * steps / 2 + steps / 4,
    }
    .signal(clock)?;
    // The first peak, and the one two periods later; a parabola through each and its neighbours.
    let peak = |from: usize| {
        let k = (from.max(1)..from + steps / 2).max_by(|a, b| swing[*a].abs().total_cmp(&swing[*b].abs())).unwrap_or(1);
        let [a, b, c] = [k - 1, k, k + 1].map(|i| swing[i].abs());
        b + (a - c) * (a - c) / (8.0 * (2.0 * b - a - c))
    };
    let decrement = libm::log(peak(0) / peak(2 * steps)) / (4.0 * PI);
    let exact = zeta / f64::sqrt(1.0 - zeta * zeta);
    Ok([(decrement / exact - 1.0).abs(), f64::NAN])
}

/// The first three oscillations of a hair with this Gamma as variants.
fn modes(gamma: f64) -> impl Fn(f64, At, &mut Clock) -> Result<[f64; 2], SimError> {
    move |mode, at, clock| hanging(gamma, mode as usize, at, clock)
}

struct Family<'a> {
    title: &'a str,
    text: &'a str,
    error: &'static str,
    case: Case<'a>,
}

pub(super) fn study(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    const MODES: &[(&str, f64)] = &[("mode=2", 1.0), ("mode=1", 0.0), ("mode=3", 2.0)];
    let quick = bench.quick;
    let few = |all: &'static [(&'static str, f64)]| if quick { &all[..1] } else { all };
    let pick = |some: &'static [usize], all: &'static [usize]| if quick { some } else { all };
    let steps: &[u32] = if quick { &[12, 24, 48] } else { &[12, 24, 48, 96, 192] };
    let (beam, hung, long) = (modes(0.0), modes(10.0), modes(85.0));
    let error = "error of the frequency, relative";
    let over = |name, variants, segments, measure| Case {
        name,
        variants: few(variants),
        at: At::all(BOTH, segments, &[192]),
        finer: Finer::Segments,
        measure,
    };
    let mut families = vec![
        Family {
            title: "Oscillations of a hanging hair",
            text: "Small oscillations after a blow, by the mean time between passages through zero; 192 steps a period. w'''' - Gamma \
                   ((1 - s) w')' = Omega^2 w, clamped at 0, free at 1, Omega = omega sqrt(rho A L^4 / B), Gamma = 10. Reference: \
                   Rayleigh-Ritz with twelve Legendre polynomials; second column: the eigenvalues of as many rigid links.",
            error,
            case: over("hanging-Gamma=10", MODES, pick(&[6, 12, 24], &[6, 12, 24, 48]), &hung),
        },
        Family {
            title: "Oscillations of a hanging hair: steps",
            text: "The same over steps a period, with 24 segments; the order is that of the second column, the error of the \
                   step alone. To be seen: second order; 24 steps a period are good to 1 %.",
            error,
            case: Case {
                name: "hanging-Gamma=10-steps",
                variants: few(MODES),
                at: At::all(BOTH, &[24], steps),
                finer: Finer::Steps,
                measure: &hung,
            },
        },
        Family {
            title: "A pendulum",
            text: "A bob on one stiff segment, released at an angle, over steps a period: T = T0 / AGM(1, cos(angle / 2)), T0 = 2 pi \
                   sqrt(l / g).",
            error: "error of the period, relative",
            case: Case {
                name: "pendulum",
                variants: few(&[("angle=1", 1.0), ("angle=0.1", 0.1), ("angle=2", 2.0)]),
                at: At::all(BOTH, &[1], if quick { &[25, 50, 100] } else { &[12, 25, 50, 100, 200] }),
                finer: Finer::Steps,
                measure: &pendulum,
            },
        },
        Family {
            title: "Internal damping",
            text: "The first oscillation of a clamped hair of 20 segments without gravity: x'' + 2 zeta omega x' + omega^2 x = 0, decrement \
                   zeta / sqrt(1 - zeta^2) a radian, from two peaks two periods apart; over steps a period. To be seen: what the \
                   method damps by itself, beside the little that hair does.",
            error: "error of the decrement, relative",
            case: Case {
                name: "damping",
                variants: few(&[("zeta=0.02", 0.02), ("zeta=0.2", 0.2)]),
                at: At::all(BOTH, &[20], if quick { &[24, 48, 96] } else { &[24, 48, 96, 192] }),
                finer: Finer::Steps,
                measure: &damped,
            },
        },
    ];
    if !quick {
        families.push(Family {
            title: "Oscillations of a beam",
            text: "As above without gravity: cos b cosh b = -1, omega = b^2 sqrt(B / (rho A L^4)).",
            error,
            case: over("beam", MODES, &[6, 12, 24, 48], &beam),
        });
        families.push(Family {
            title: "Oscillations of a long hair",
            text: "As above with Gamma = 85, hair of 20 cm.",
            error,
            case: over("hanging-Gamma=85", MODES, &[6, 12, 24, 48], &long),
        });
        families.push(Family {
            title: "A thread",
            text: "A hair almost without bending stiffness, pinned: J0(2 omega sqrt(L / g)) = 0 (D. Bernoulli); 60 steps a period. \
                   Springs are stiffer here (Gamma = 1e4 instead of 1e8), or their extra particles would turn freely, and are \
                   held to the first oscillation.",
            error,
            case: Case {
                name: "thread",
                variants: &[("mode=1", 0.0), ("mode=2", 1.0)],
                at: At::all(&[Model::Rod], &[6, 12, 24, 48], &[60]),
                finer: Finer::Segments,
                measure: &thread,
            },
        });
    }
    let mut all: Vec<Row> = Vec::new();
    for f in families {
        let rows = f.case.rows(bench)?;
        let mut s = section(f.title, f.error, "against as many links", &rows).says(f.text);
        let finer = f.case.finer;
        let (axis, x): (&str, fn(&Row) -> f64) = match finer {
            Finer::Segments => ("segments", |r| r.at.segments as f64),
            Finer::Steps => ("steps a period", |r| f64::from(r.at.steps)),
        };
        let mut series = lines(&rows, finer, x, |r| r.error);
        if let Some(first) = series.first().and_then(|s| s.points.first()).copied() {
            series.push(second_order(first, 8.0));
        }
        s.plots.push(logarithmic(f.title, [axis, f.error], series));
        s.plots.push(work_precision(f.title, f.error, &rows));
        findings.sections.push(s);
        all.extend(rows);
    }
    let need = |model: Model| {
        let fits = |r: &&Row| r.at.model == model && r.point.starts_with("hanging-Gamma=10-steps/mode=2");
        all.iter().filter(fits).find(|r| r.own <= 0.01).map_or("more than tried".to_owned(), |r| r.at.steps.to_string())
    };
    let order = |model: Model| {
        let fits = |r: &&Row| r.at.model == model && r.point.starts_with("hanging-Gamma=10-steps");
        median(all.iter().filter(fits).map(|r| r.order))
    };
    findings.answers.push(format!(
        "Oscillations: a frequency is right within 1 % from {} steps a period on (rod; springs {}); order in time {:.2} (springs \
         {:.2}).",
        need(Model::Rod),
        need(Model::Springs),
        order(Model::Rod),
        order(Model::Springs)
    ));
    Ok(())
}
