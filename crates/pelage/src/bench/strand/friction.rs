//! Hair that slides: down an incline, and over a drum.

use super::{At, Case, Clock, Finer, HAIRS, Row, name, section, work_precision};
use crate::Error;
use crate::bench::{Bench, Findings, Section};
use pelage_sim::reference::formula;
use pelage_sim::rig::{FRAME, G, Rig, fall_over_drum, in_vacuum, loose, still, straight};
use pelage_sim::{Body, Ellipsoid, Material, Model, Part, Rigid, Settings, Shape, SimError, Vec3};
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

/// Frames that hair slides for.
const FRAMES: usize = 6;

/// Distance that hair keeps from a body, metres.
const OFFSET: f64 = 1e-4;

/// Way of a short hair down an incline of 45 degrees.
fn incline(friction: f64, at: At, clock: &mut Clock) -> Result<[f64; 2], SimError> {
    // So large that it is flat under the hair.
    let radius = 100.0;
    let placement = Rigid { translation: [0.0, -radius, 0.0], ..Rigid::default() };
    let ground = Ellipsoid { placement, semi_axes: [radius; 3] };
    let hair: Vec<[f64; 3]> = straight(at.segments, Vec3::z()).iter().map(|p| [0.0, OFFSET, 0.01 * p[2]]).collect();
    let settings = Settings { substeps: Some(at.steps), ..loose(at.model, friction, OFFSET) };
    let gravity = [G * FRAC_1_SQRT_2, -G * FRAC_1_SQRT_2, 0.0];
    let mut rig = Rig::under(&vec![hair; HAIRS], &settings, gravity)?;
    let part = Part { motion: &still, shape: Shape::Ellipsoid(&ground), exact: None };
    let body = Body { parts: vec![part], seconds: FRAME };
    clock.time(|| (0..FRAMES).try_for_each(|_| rig.go(FRAME, &still, &body, None)))?;
    let seconds = FRAME * FRAMES as f64;
    let exact = 0.5 * G * formula::incline(friction, FRAC_PI_4) * seconds * seconds;
    Ok([(rig.tip(0).x / exact - 1.0).abs(), f64::NAN])
}

/// Radius of the drum, and length that hangs from it on the near side, metres.
const DRUM: f64 = 0.01;
const NEAR: f64 = 0.05;

/// Whether a string over a drum slips when its far side is `factor` times as long as it may be.
fn slips(model: Model, segments: usize, friction: f64, factor: f64) -> Result<bool, SimError> {
    let far = formula::slips_over_drum(NEAR, DRUM, friction) * factor;
    let soft = Material { bend_factor: 1e-3, twist_factor: 1e-3, ..in_vacuum() };
    let settings = Settings { material: soft, ..loose(model, friction, OFFSET) };
    Ok(fall_over_drum(&settings, segments, DRUM, [NEAR, far])? > 2e-4)
}

pub(super) fn study(bench: &mut Bench<'_>, findings: &mut Findings) -> Result<(), Error> {
    let both = &[Model::Rod, Model::Springs];
    let error = "error of the way, relative";
    let case = Case {
        name: "incline",
        variants: if bench.quick { &[("friction=0.3", 0.3)] } else { &[("friction=0.3", 0.3), ("friction=0.1", 0.1)] },
        at: At::all(both, &[8], if bench.quick { &[4, 8, 16] } else { &[2, 4, 8, 16, 32] }),
        finer: Finer::Steps,
        measure: &incline,
    };
    let rows: Vec<Row> = case.rows(bench)?;
    let title = "Sliding down an incline";
    let mut s = section(title, error, "-", &rows).says(
        "A straight hair of 1 cm that is held nowhere lies across a slope of 45 degrees and is let go: after six film frames it \
         has come a t^2 / 2 far, a = g (sin 45 - mu cos 45). Steps are those of a frame; the default is 8.",
    );
    s.plots.push(work_precision(title, error, &rows));
    findings.sections.push(s);
    let mut s = Section::new("A string over a drum", &["holds at, of the threshold", "slips at"]).says(
        "A string, almost without bending stiffness, hangs over a drum of 1 cm, 5 cm of it on one side. Searched by halving between \
         0.9 and 1.1 for the length on the other side at which it slips: T2 = T1 e^(mu pi) (Euler, Eytelwein), with the weight of \
         the string on the drum: T' = mu (T + w R sin a) + w R cos a.",
    );
    // Springs' triangles must be rigid against their hinges: soft strings are the rod's.
    let cases: &[(usize, f64)] =
        if bench.quick { &[(180, 0.3)] } else { &[(90, 0.3), (180, 0.3), (360, 0.3), (180, 0.1), (180, 0.5)] };
    for &(segments, friction) in cases {
        let point = format!("drum/friction={friction}/{}/{segments}-segments", name(Model::Rod));
        s.threshold(bench, &point, if bench.quick { 3 } else { 5 }, |factor| {
            slips(Model::Rod, segments, friction, factor)
        })?;
    }
    let off = s.rows.iter().map(|(_, v)| (0.5 * (v[0] + v[1]) - 1.0).abs()).fold(0.0, f64::max);
    findings.sections.push(s);
    let at_default = |model: Model| {
        let rows = rows.iter().filter(|r| r.at.model == model && r.at.steps == 8);
        let each: Vec<String> = rows.map(|r| format!("{:.1} % ({})", 100.0 * r.error, r.variant)).collect();
        each.join(", ")
    };
    findings.answers.push(format!(
        "Friction: at the default step the way down an incline is wrong by {} with the rod, by {} with springs; a string over a drum \
         slips within {:.1} % of the capstan's threshold.",
        at_default(Model::Rod),
        at_default(Model::Springs),
        100.0 * off
    ));
    Ok(())
}
