//! A tuft on a shaking ball: distance to a refined run of the same shot, against its cost.

use super::machine::{on_threads, thread_seconds};
use super::plot::{Plot, Series};
use super::strand::{name, refused};
use super::{Bench, Findings, Section, Study};
use crate::Error;
use pelage_sim::rig::{self, FRAME, Rig, turned};
use pelage_sim::{Body, Field, Material, Model, Part, Rigid, Settings, Shape, SimError, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::{LazyLock, Mutex};

pub(super) const STUDY: Study = Study {
    name: "shot",
    about: "What do steps, segments, model, tolerance and lane width cost in a shot, and what do they buy? Distance to a \
            refined run.",
    run,
};

/// The ball's radius, metres.
pub(super) const RADIUS: f64 = 0.09;

/// Length of the hairs, metres.
pub(super) const LENGTH: f64 = 0.2;

const FRAMES: usize = 24;

/// Places along a hair at which runs are compared: segments must be a multiple.
const PLACES: usize = 10;

/// Segments and steps a frame of the refined run; its tolerance. From about 100 segments on the start changes, see [`starts`].
const REFINED: (usize, u32, f64) = (80, 64, 1e-9);

/// Segments of the hair where they are not varied.
const SEGMENTS: usize = 40;

/// Factor on the hair's stiffness with which all of it stands by itself. Below 3.4 some hairs are stiffened at the start by
/// factors that come in notches of a few percent, and runs of other segments are of other hair.
const STIFF: f64 = 4.0;

/// The ball shakes once a second by 1 rad to both sides, about an axis that leans.
pub(super) fn shake(frame: usize, f: f64) -> Rigid {
    turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(TAU * (frame as f64 + f) * FRAME))
}

/// Moves through a frame with the ball, and with it as a body.
pub(super) fn advance(rig: &mut Rig, frame: usize, field: Option<&Field>) -> Result<(), SimError> {
    let motion = move |f: f64| shake(frame, f);
    let parts = field.iter().map(|f| Part { motion: &motion, shape: Shape::Field(f), exact: None }).collect();
    rig.go(FRAME, &motion, &Body { parts, seconds: FRAME }, None)
}

/// How a shot is run.
#[derive(Clone, Debug)]
struct Run {
    hairs: usize,
    body: bool,
    segments: usize,
    settings: Settings,
}

/// What came of it.
#[derive(Clone, Debug)]
struct Played {
    /// Of each frame and hair the places along it.
    places: Vec<[Vec3; PLACES]>,
    /// Processor seconds a frame and hair, one thread.
    seconds: f64,
}

fn play(run: &Run, field: &Field) -> Result<Played, SimError> {
    let hairs = rig::tuft(RADIUS, run.hairs, LENGTH, run.segments + 1);
    on_threads(1, || {
        let mut rig = Rig::new(&hairs, &run.settings)?;
        let (mut places, mut seconds) = (Vec::new(), 0.0);
        for frame in 0..FRAMES {
            let start = thread_seconds();
            advance(&mut rig, frame, run.body.then_some(field))?;
            seconds += thread_seconds() - start;
            let all = rig.sim.positions();
            for hair in all.chunks(run.segments + 1) {
                places.push(std::array::from_fn(|k| hair[(k + 1) * run.segments / PLACES].into()));
            }
        }
        Ok(Played { places, seconds: seconds / (FRAMES * run.hairs) as f64 })
    })
}

/// Root of the mean square over all frames and hairs, 95th percentile of hairs (in a frame), and the middle one; lengths.
fn distance(a: &Played, b: &Played) -> [f64; 3] {
    let square = |(a, b): (&[Vec3; PLACES], &[Vec3; PLACES])| {
        (0..PLACES).map(|k| (a[k] - b[k]).norm_squared()).sum::<f64>() / (PLACES as f64 * LENGTH * LENGTH)
    };
    let mut each: Vec<f64> = a.places.iter().zip(&b.places).map(square).collect();
    each.sort_by(f64::total_cmp);
    let quantile = |q: f64| each[((each.len() - 1) as f64 * q).round() as usize].sqrt();
    [(each.iter().sum::<f64>() / each.len() as f64).sqrt(), quantile(0.95), quantile(0.5)]
}

/// The shots of a study, with refined runs as they are needed.
struct Shots {
    hairs: usize,
    field: LazyLock<Field, fn() -> Field>,
    refined: Mutex<BTreeMap<(bool, usize), Played>>,
}

impl Shots {
    fn settings(model: Model, steps: u32) -> Settings {
        let material = Material { bend_factor: STIFF, twist_factor: STIFF, ..Material::default() };
        Settings { model, substeps: Some(steps), material, ..Settings::default() }
    }

    fn play(&self, body: bool, segments: usize, settings: &Settings) -> Result<Played, Error> {
        let run = Run { hairs: self.hairs, body, segments, settings: settings.clone() };
        play(&run, &self.field).map_err(refused)
    }

    /// The refined run with as many segments.
    fn refined(&self, body: bool, segments: usize) -> Result<Played, Error> {
        let known = self.refined.lock().expect("no panic before").get(&(body, segments)).cloned();
        if let Some(played) = known {
            return Ok(played);
        }
        let settings = Settings { tolerance: REFINED.2, ..Shots::settings(Model::Rod, REFINED.1) };
        let played = self.play(body, segments, &settings)?;
        self.refined.lock().expect("no panic before").insert((body, segments), played.clone());
        Ok(played)
    }

    /// A point: distances to the refined run, to that with as many segments, and cost.
    fn point(
        &self,
        bench: &mut Bench<'_>,
        section: &mut Section,
        body: bool,
        segments: usize,
        settings: &Settings,
    ) -> Result<[f64; 5], Error> {
        let point = format!(
            "{}/{}-hairs/{}/{segments}-segments/{}-steps/{:e}{}",
            if body { "ball" } else { "free" },
            self.hairs,
            name(settings.model),
            settings.substeps.unwrap_or(0),
            settings.tolerance,
            if settings.wide { "" } else { "/plain-lanes" }
        );
        if let Some((_, known)) = section.rows.iter().find(|(p, _)| *p == point) {
            return Ok(known[..].try_into().expect("five columns"));
        }
        section.row(bench, &point, || {
            let played = self.play(body, segments, settings)?;
            let [rms, high, median] = distance(&played, &self.refined(body, REFINED.0)?);
            let own = distance(&played, &self.refined(body, segments)?)[0];
            Ok([rms, high, median, own, played.seconds])
        })
    }
}

/// A line of a plot: points with what they cost.
struct Varied {
    what: String,
    body: bool,
    runs: Vec<(usize, Settings)>,
}

const COLUMNS: [&str; 5] = [
    "RMS distance, lengths",
    "95th percentile of hairs",
    "median hair",
    "RMS of the same segments",
    "processor s a hair and frame",
];

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let hairs = if bench.quick { 8 } else { 100 };
    let shots = Shots { hairs, field: LazyLock::new(|| rig::ball(RADIUS).field), refined: Mutex::default() };
    let mut findings = Findings::default();
    let mut section = introduction();
    for body in [false, true] {
        let mut series = Vec::new();
        for v in varied(bench.quick, body) {
            let mut points = Vec::new();
            for (segments, settings) in &v.runs {
                let [rms, .., seconds] = shots.point(bench, &mut section, v.body, *segments, settings)?;
                points.push([seconds, rms]);
            }
            series.push(Series::new(v.what, points));
        }
        let default = shots.point(bench, &mut section, body, SEGMENTS, &Shots::settings(Model::Rod, 8))?;
        series[0].mark = Some([default[4], default[0]]);
        findings.answers.push(answer(body, &section, default));
        let title = if body { "On the ball: error against time" } else { "Without a body: error against time" };
        let axes = ["processor seconds a hair and frame", "RMS distance to the refined run, lengths"];
        section.plots.push(Plot { title, axes, log: [true; 2], series }.svg());
    }
    findings.sections.push(section);
    starts(bench, &shots, &mut findings)?;
    lanes(bench, &shots, &mut findings)?;
    Ok(findings)
}

fn introduction() -> Section {
    Section::new("A tuft on a shaking ball", &COLUMNS)
        .says(
            "Hairs of 20 cm stand on the upper half of a ball of 9 cm and lie around it. It shakes once a second by 1 rad to both \
             sides, 24 frames, from rest at once, in air, with all defaults but what the point names (model, segments, steps a \
             frame, tolerance) and hair four times as stiff, so that all of it stands by itself (see The start). Once without the ball as a body, once with its distance field.",
        )
        .says(
            "Distance at ten equal arc lengths of each hair in each frame, in lengths of the hair: the root of the mean square \
             over all, the 95th percentile and the middle one of hairs in a frame. Reference: the rod with 80 segments, 64 steps a \
             frame, tolerance 1e-9; the fourth column: the rod with as many segments as the point, 64 steps, 1e-9. That is \
             the same code refined, not an independent one: that it goes to the right limit without a body is what the study \
             `strand` shows against closed forms. On the ball, hairs that slide off to different sides part for good: a few of \
             them rule the root of the mean square, the middle hair tells of the rest.",
        )
        .says(
            "Processor seconds on one thread, all hairs of the point together, divided by hairs and frames. To be seen: without \
             a body everything falls with the step; on the ball, contact rules, and more steps, segments or a smaller tolerance \
             buy less than they cost. Rings mark the default step. Where the paper's nine steps are off by half a length, they \
             did not hold the hair: as printed they are for slow motion.",
        )
}

fn varied(quick: bool, body: bool) -> Vec<Varied> {
    let of = Shots::settings;
    let steps: &[u32] = if quick { &[4, 8, 16] } else { &[2, 4, 8, 16, 32] };
    let segments: &[usize] = if quick { &[20, 40, 80] } else { &[10, 20, 40, 80] };
    let tolerances: &[f64] = if quick { &[1e-3, 1e-7] } else { &[1e-3, 1e-4, 1e-5, 1e-7] };
    let springs: &[u32] = if quick { &[8] } else { &[8, 16, 32] };
    // 70 steps a frame are the paper's 6e-4 s.
    let paper: &[u32] = if quick { &[70] } else { &[35, 70, 140] };
    let v = |what: &str, runs| Varied { what: what.to_owned(), body, runs };
    let stepped = |model, steps: &[u32]| steps.iter().map(|s| (SEGMENTS, of(model, *s))).collect();
    vec![
        v("rod: steps", stepped(Model::Rod, steps)),
        v("rod: segments", segments.iter().map(|n| (*n, of(Model::Rod, 8))).collect()),
        v(
            "rod: tolerance",
            tolerances.iter().map(|t| (SEGMENTS, Settings { tolerance: *t, ..of(Model::Rod, 8) })).collect(),
        ),
        v("springs: steps", stepped(Model::Springs, springs)),
        v("paper: steps", stepped(Model::Paper, paper)),
    ]
}

/// The cheapest point of a model with at most 1 %, and what the default comes to.
fn answer(body: bool, section: &Section, default: [f64; 5]) -> String {
    let place = if body { "ball/" } else { "free/" };
    let mut words = Vec::new();
    for model in [Model::Rod, Model::Springs, Model::Paper] {
        let of = |p: &&(String, Vec<f64>)| p.0.starts_with(place) && p.0.contains(&format!("/{}/", name(model)));
        let fits = section.rows.iter().filter(of).filter(|r| r.1[0] <= 0.01);
        let best = fits.min_by(|a, b| a.1[4].total_cmp(&b.1[4]));
        words.push(match best {
            Some((p, v)) => {
                let way: Vec<&str> = p.split('/').skip(2).collect();
                format!("{} ({:.0} us)", way.join(" "), v[4] * 1e6)
            }
            None => format!("{}: not reached", name(model)),
        });
    }
    format!(
        "A shot {}, RMS distance to the refined run below 1 % of the length, cheapest: {}. The default (8 steps a frame, 40 \
         segments) is off by {:.2} % (median hair {:.3} %, 95th percentile {:.2} %; the step alone {:.3} %) for {:.0} us a hair and \
         frame.",
        if body { "on the ball" } else { "without a body" },
        words.join("; "),
        default[0] * 100.0,
        default[2] * 100.0,
        default[1] * 100.0,
        default[3] * 100.0,
        default[4] * 1e6
    )
}

/// What a shot starts with, by segments.
fn starts(bench: &mut Bench<'_>, shots: &Shots, findings: &mut Findings) -> Result<(), Error> {
    let columns = ["hairs stiffened", "largest factor", "sum of factors"];
    let mut s = Section::new("The start", &columns).says(
        "The same hairs with the stiffness of real hair: what could not stand in its groomed pose is stiffened by the least \
         factor with which it can, found by halving in notches of a few percent. That is a property of the hair and should \
         not depend on its segments. Where the sum of factors grows with the segments, the search errs: hair is stiffer than \
         it needs to be. No reference but the other rows.",
    );
    let all: &[usize] = if bench.quick { &[40, 80, 240] } else { &[10, 20, 40, 80, 120, 160, 240] };
    for segments in all {
        s.row(bench, &format!("start/{}-hairs/{segments}-segments", shots.hairs), || {
            let hairs = rig::tuft(RADIUS, shots.hairs, LENGTH, segments + 1);
            let started = Rig::new(&hairs, &Settings::default()).map_err(refused)?.started;
            let factors: Vec<f64> = started.stiffened.iter().map(|s| s.factor).collect();
            let most = factors.iter().copied().fold(1.0, f64::max);
            let rest = (shots.hairs - factors.len()) as f64;
            Ok([factors.len() as f64, most, factors.iter().sum::<f64>() + rest])
        })?;
    }
    let sum = |v: &[f64]| v[2];
    let usual = s.rows.iter().find(|(p, _)| p.ends_with("/40-segments")).map_or(f64::NAN, |(_, v)| sum(v));
    let strays = |r: &&(String, Vec<f64>)| (sum(&r.1) / usual - 1.0).abs() > 0.1;
    let off: Vec<&str> = s.rows.iter().filter(strays).filter_map(|(p, _)| p.rsplit('/').next()).collect();
    findings.answers.push(match off[..] {
        [] => "Stiffening at the start depends on the segments by less than 10 %.".to_owned(),
        _ => format!(
            "Stiffening at the start is off by more than 10 % from that of 40 segments with: {}.",
            off.join(", ")
        ),
    });
    findings.sections.push(s);
    Ok(())
}

/// Lane width changes no bit.
fn lanes(bench: &mut Bench<'_>, shots: &Shots, findings: &mut Findings) -> Result<(), Error> {
    let columns = ["largest distance, lengths", "wide: processor s a hair and frame", "plain"];
    let mut s = Section::new("Lane width", &columns).says(
        "The same shot, default settings, once with the widest registers of this processor, once with plain lanes. To be seen: \
         no distance at all, and what wide registers save.",
    );
    for body in [false, true] {
        let point = format!("lanes/{}/{}-hairs", if body { "ball" } else { "free" }, shots.hairs);
        s.row(bench, &point, || {
            let settings = Shots::settings(Model::Rod, 8);
            let wide = shots.play(body, SEGMENTS, &settings)?;
            let plain = shots.play(body, SEGMENTS, &Settings { wide: false, ..settings })?;
            let pairs = wide.places.iter().flatten().zip(plain.places.iter().flatten());
            let most = pairs.map(|(a, b)| (a - b).norm() / LENGTH).fold(0.0, f64::max);
            Ok([most, wide.seconds, plain.seconds])
        })?;
    }
    let worst = s.rows.iter().map(|(_, v)| v[0]).fold(f64::NAN, f64::max);
    let faster = s.rows.iter().map(|(_, v)| v[2] / v[1]).fold(f64::NAN, f64::min);
    findings
        .answers
        .push(format!("Wide registers: distance {worst}, at least {faster:.1} times as fast as plain lanes."));
    findings.sections.push(s);
    Ok(())
}
