//! Time and memory against the size of the work, and how much of the machine the hot loops use.

use super::{Bench, Findings, Section, Study, machine};
use crate::Error;

pub(super) const STUDY: Study =
    Study { name: "scaling", about: "Time and memory against hairs, points, frames and threads.", run };

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let mut section = Section::new("The machine", &["rate"]).says(
        "Bytes a second read and written by all threads, a = b + 3 c; double-precision operations a second, a \
               multiply-add counted as two.",
    );
    section.row(bench, "machine/bandwidth", || Ok([machine::bandwidth()]))?;
    section.row(bench, "machine/peak", || Ok([machine::peak()]))?;
    Ok(Findings { answers: Vec::new(), sections: vec![section] })
}
