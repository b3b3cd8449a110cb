//! One hair against closed forms: error against processor time for each model, step and number of segments.

mod friction;
mod motion;
mod released;
mod rest;

use super::machine::{on_threads, thread_seconds};
use super::plot::{Plot, Series};
use super::{Bench, Findings, Section, Study};
use crate::Error;
use pelage_sim::{Model, SimError};
use std::fmt::Write;

pub(super) const STUDY: Study = Study {
    name: "strand",
    about: "Which model, how many segments and which step does a single hair need? Error against closed forms and \
            semi-analytic references, and processor time.",
    run,
};

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let mut findings = Findings::default();
    released::study(bench, &mut findings)?;
    rest::study(bench, &mut findings)?;
    motion::study(bench, &mut findings)?;
    friction::study(bench, &mut findings)?;
    Ok(findings)
}

/// An input that a simulation refused is a mistake of the study.
pub(super) fn refused(e: SimError) -> Error {
    Error::input(e.to_string(), "a study asks for something that can't be simulated")
}

/// A model's name in a point.
pub(super) fn name(model: Model) -> &'static str {
    match model {
        Model::Rod => "rod",
        Model::Springs => "springs",
        Model::Paper => "paper",
    }
}

/// Hairs that are simulated side by side: as many as there are lanes.
const HAIRS: usize = pelage_sim::lanes::LANES;

/// What takes longer, seconds a hair, is timed once.
const LONG: f64 = 0.01;

/// Processor time of the simulation alone, seconds a hair.
#[derive(Default)]
struct Clock(f64);

impl Clock {
    fn time<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = thread_seconds();
        let out = work();
        self.0 += (thread_seconds() - start) / HAIRS as f64;
        out
    }
}

/// A resolution.
#[derive(Clone, Copy, Debug, PartialEq)]
struct At {
    model: Model,
    segments: usize,
    /// In whatever the case counts in; 0 where it has none.
    steps: u32,
}

impl At {
    fn all(models: &[Model], segments: &[usize], steps: &[u32]) -> Vec<At> {
        let mut out = Vec::new();
        for &model in models {
            for &segments in segments {
                out.extend(steps.iter().map(|&steps| At { model, segments, steps }));
            }
        }
        out
    }
}

/// Takes the variant's value and the resolution.
type Measure<'a> = dyn Fn(f64, At, &mut Clock) -> Result<[f64; 2], SimError> + Sync + 'a;

/// A case of several sizes at some resolutions.
struct Case<'a> {
    name: &'a str,
    /// Name and value of what is varied besides resolution.
    variants: &'a [(&'a str, f64)],
    at: Vec<At>,
    /// What finer resolution is: the order is measured over it.
    finer: Finer,
    /// Error against the reference, against the reference cut into as many segments (NaN where there is none); the clock
    /// takes the time.
    measure: &'a Measure<'a>,
}

#[derive(Clone, Copy, PartialEq)]
enum Finer {
    Segments,
    Steps,
}

/// A measured point.
#[derive(Clone, Debug)]
struct Row {
    point: String,
    variant: String,
    at: At,
    error: f64,
    own: f64,
    seconds: f64,
    /// `log(error ratio) / log(resolution ratio)` to the coarser row before; of `own` where it is known and steps are varied.
    order: f64,
}

impl Case<'_> {
    fn rows(&self, bench: &mut Bench<'_>) -> Result<Vec<Row>, Error> {
        let mut rows: Vec<Row> = Vec::new();
        for &(variant, value) in self.variants {
            for &at in &self.at {
                let mut point = format!("{}/{variant}/{}/{}-segments", self.name, name(at.model), at.segments);
                if at.steps > 0 {
                    let _ = write!(point, "/{}-steps", at.steps);
                }
                let measure = || {
                    // Short ones are timed again: the fastest of three.
                    let (mut found, mut seconds) = ([f64::NAN; 2], f64::INFINITY);
                    for _ in 0..3 {
                        let mut clock = Clock::default();
                        found = on_threads(1, || (self.measure)(value, at, &mut clock).map_err(refused))?;
                        seconds = clock.0.min(seconds);
                        if clock.0 > LONG {
                            break;
                        }
                    }
                    Ok([found[0], found[1], seconds])
                };
                let [error, own, seconds] = bench.point(&point, measure)?;
                let mut row = Row { point, variant: variant.to_owned(), at, error, own, seconds, order: f64::NAN };
                row.order = self.order(&row, &rows);
                rows.push(row);
            }
        }
        Ok(rows)
    }

    fn order(&self, row: &Row, before: &[Row]) -> f64 {
        let size = |a: At| match self.finer {
            Finer::Segments => (a.segments as f64, At { segments: 0, ..a }),
            Finer::Steps => (f64::from(a.steps), At { steps: 0, ..a }),
        };
        let what = |r: &Row| if self.finer == Finer::Steps && !r.own.is_nan() { r.own } else { r.error };
        let ((fine, same), last) = (size(row.at), before.last());
        last.map_or(f64::NAN, |b| match size(b.at) {
            (coarse, s) if s == same && b.variant == row.variant => {
                libm::log(what(b) / what(row)) / libm::log(fine / coarse)
            }
            _ => f64::NAN,
        })
    }
}

/// Rows of the same variant, model, and segments or steps as lines of `x` and `y`.
fn lines(rows: &[Row], finer: Finer, x: fn(&Row) -> f64, y: fn(&Row) -> f64) -> Vec<Series> {
    let mut out: Vec<Series> = Vec::new();
    for r in rows {
        let mut label = format!("{} {}", r.variant, name(r.at.model));
        if finer == Finer::Steps {
            let _ = write!(label, ", {} seg.", r.at.segments);
        }
        let label = label.trim().to_owned();
        match out.iter_mut().find(|s| s.name == label) {
            Some(s) => s.points.push([x(r), y(r)]),
            None => out.push(Series::new(label, vec![[x(r), y(r)]])),
        }
    }
    out
}

/// A dashed line of second order through `from`, over a factor of `by`.
fn second_order(from: [f64; 2], by: f64) -> Series {
    let points = vec![from, [from[0] * by, from[1] / (by * by)]];
    Series { name: "second order".into(), points, mark: None, guide: true }
}

/// A plot with logarithmic axes.
fn logarithmic(title: &str, axes: [&str; 2], series: Vec<Series>) -> String {
    Plot { title, axes, log: [true; 2], series }.svg()
}

/// Error against processor time, a line a model and size.
fn work_precision(title: &str, error: &str, rows: &[Row]) -> String {
    let lines = lines(rows, Finer::Segments, |r| r.seconds, |r| r.error);
    logarithmic(&format!("{title}: what it costs"), ["processor s a hair", error], lines)
}

/// The table of a case.
fn section(title: &str, error: &'static str, own: &'static str, rows: &[Row]) -> Section {
    let mut section = Section::new(title, &[error, own, "order", "processor s a hair"]);
    section.rows = rows.iter().map(|r| (r.point.clone(), vec![r.error, r.own, r.order, r.seconds])).collect();
    section
}

impl Section {
    /// A row that searches by halving, so many times, between 0.9 and 1.1 for the part of a threshold from which on something
    /// happens: where it does not, and where it does.
    fn threshold(
        &mut self,
        bench: &mut Bench<'_>,
        point: &str,
        halvings: u32,
        happens: impl Fn(f64) -> Result<bool, SimError>,
    ) -> Result<(), Error> {
        self.row(bench, &format!("{point}/{halvings}-halvings"), || {
            let (mut low, mut high) = (0.9, 1.1);
            for _ in 0..halvings {
                let middle = 0.5 * (low + high);
                let over = happens(middle).map_err(refused)?;
                if over { high = middle } else { low = middle }
            }
            Ok([low, high])
        })?;
        Ok(())
    }
}

/// The middle of the numbers that are some; NaN of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}
