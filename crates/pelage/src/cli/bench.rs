//! `pelage bench`: error against run time.

use super::print;
use crate::Error;
use crate::bench::{self, STUDIES, Study};
use crate::progress::Progress;
use std::path::PathBuf;

/// Arguments of `pelage bench`.
#[derive(Debug, clap::Args)]
pub struct BenchArguments {
    /// Few points and small shots: about two minutes instead of an hour
    #[arg(long)]
    pub quick: bool,
    /// Only this study; may be given several times
    #[arg(long, value_name = "NAME")]
    pub study: Vec<String>,
    /// Measure one point, STUDY/POINT, and print its numbers; no report
    #[arg(long, conflicts_with_all = ["study", "list"])]
    pub point: Option<String>,
    /// Say what the studies and their points are, and measure none
    #[arg(long)]
    pub list: bool,
    /// Folder of the report; what is kept there is not measured again
    #[arg(long, value_name = "FOLDER", default_value = "out/bench")]
    pub out: PathBuf,
    /// Threads; all cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// No progress
    #[arg(long, short)]
    pub quiet: bool,
}

/// Runs studies and writes the report.
pub fn run(a: &BenchArguments) -> Result<bool, Error> {
    super::run::threads(a.jobs)?;
    let mut progress = Progress::new(a.quiet);
    if cfg!(debug_assertions) {
        progress.say("warning: this program is not built with --release: its times say little");
    }
    if let Some(point) = &a.point {
        let help = "`pelage bench --list` names the points; add --quick for those of the quick bench";
        let none = || Error::input(format!("there is no point `{point}`"), help);
        // What a point needs on the way goes where nobody looks for results.
        let aside = std::env::temp_dir().join(format!("pelage-bench-{}", std::process::id()));
        std::fs::create_dir_all(&aside).map_err(Error::disk(&aside))?;
        let values = bench::one(point, &aside, a.quick, &mut progress);
        let _ = std::fs::remove_dir_all(&aside);
        let values = values?.ok_or_else(none)?;
        print(&(values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" ") + "\n"));
        return Ok(true);
    }
    if let Some(none) = a.study.iter().find(|w| STUDIES.iter().all(|s| s.name != w.as_str())) {
        let names = STUDIES.iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
        return Err(Error::input(format!("there is no study `{none}`"), format!("the studies are: {names}")));
    }
    let wanted = |s: &&Study| a.study.is_empty() || a.study.iter().any(|w| w == s.name);
    let studies: Vec<Study> = STUDIES.iter().filter(wanted).copied().collect();
    if a.list {
        for study in &studies {
            print(&format!("{:<12} {}\n", study.name, study.about));
            let points = bench::points(study, &a.out, a.quick)?;
            print(&points.iter().map(|p| format!("  {p}\n")).collect::<String>());
        }
        return Ok(true);
    }
    bench::run(&studies, &a.out, a.quick, &mut progress)?;
    print(&format!("report in {}\n", a.out.join("report.html").display()));
    Ok(true)
}
