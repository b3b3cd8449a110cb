//! `pelage preview`: the pictures of a shot, or a part of its still.

use super::{PreviewArguments, print, run, watch};
use crate::Error;
use crate::progress::Progress;
use crate::project::Project;
use crate::quality;
use crate::report::Report;
use crate::stage::preview::{Part, Show, part};
use crate::stage::{Options, Runner, Stage};
use std::path::PathBuf;

/// Makes the pictures that the arguments ask for.
pub fn preview(a: PreviewArguments) -> Result<bool, Error> {
    if a.watch {
        return watch::watch(&a);
    }
    if a.hairs.is_none() && a.crop.is_none() && a.show.is_none() {
        return run::pictures(&a);
    }
    run::threads(a.run.jobs)?;
    let project = quality::open(&a.run.shot, &mut Progress::new(a.run.quiet))?;
    let wanted = wanted(&a, a.hairs.unwrap_or(100.0));
    let name = match (&a.show, a.crop) {
        (Some(column), _) => format!("preview-{column}.png"),
        (None, Some(_)) => "preview-crop.png".to_owned(),
        (None, None) => "preview-draft.png".to_owned(),
    };
    let options = Options { force: a.run.force, ..Options::default() };
    let (path, report) = draw(&project, &wanted, &name, options, &mut Progress::new(a.run.quiet))?;
    if wanted.hairs == 100.0 {
        run::keep(&project, &report)?;
    }
    print(&if a.run.json { report.json() } else { format!("{}\n", said(&project, &wanted, &path)) });
    Ok(true)
}

/// The part of the still that is asked for, with so many of the hairs.
pub(super) fn wanted(a: &PreviewArguments, hairs: f64) -> Part {
    let show = a.show.clone().map(|column| Show { column, range: a.range.map(|r| r.0) });
    Part { hairs, crop: a.crop.map_or(Part::default().crop, |c| c.0), show }
}

/// Brings up to date what a part of the still reads, and draws it.
pub(super) fn draw(
    project: &Project,
    wanted: &Part,
    name: &str,
    options: Options,
    progress: &mut Progress,
) -> Result<(PathBuf, Report), Error> {
    let draft = wanted.hairs < 100.0;
    let thinned = draft.then(|| project.thinned(wanted.hairs));
    let frames = Some([project.still_frame()].into());
    let options = Options { to: Some(Stage::Interpolate), frames, draft, ..options };
    let mut runner = Runner::new(thinned.as_ref().unwrap_or(project), options, progress)?;
    let report = runner.run()?;
    Ok((part(&mut runner, wanted, name)?, report))
}

/// What was drawn, and where it is.
pub(super) fn said(project: &Project, wanted: &Part, path: &std::path::Path) -> String {
    let size = project.shot.value.preview.size;
    let region = wanted.region(size);
    let (w, h) = (region.x.len(), region.y.len());
    let mut out = format!("{}: {w} x {h} pixels", project.label(path));
    if [w, h] != size.map(|x| x as usize) {
        out += &format!(" from ({}, {}) of {} x {}", region.x.start, region.y.start, size[0], size[1]);
    }
    if wanted.hairs < 100.0 {
        out += &format!(", {} % of the hairs", wanted.hairs);
    }
    out
}
