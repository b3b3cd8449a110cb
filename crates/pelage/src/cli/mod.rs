//! The command line: arguments, and one function a command. Results go to stdout, talk to stderr.

mod bench;
mod cache;
mod compare;
mod depenetrate;
mod init;
mod inspect;
mod intersect;
mod preview;
mod run;
mod stress;
mod watch;

use crate::Error;
use crate::stage::Stage;
use crate::stage::heat::Column;
use clap::{Parser, Subcommand};
use std::path::PathBuf;

/// Grows, combs and exports every hair of a character, shot by shot.
#[derive(Debug, Parser)]
#[command(name = "pelage", version, arg_required_else_help = true)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make a new shot folder that runs as it is
    Init {
        /// Folder to make; must be empty or absent
        dir: PathBuf,
        /// Skin to copy into it (PLY with texture coordinates); the sample bust if none is given
        #[arg(long)]
        skin: Option<PathBuf>,
        /// Metres per unit of that skin
        #[arg(long, default_value_t = 0.01)]
        meters_per_unit: f64,
        /// Sample to make when no skin is given
        #[arg(long, value_enum, default_value_t = Sample::Bust)]
        sample: Sample,
    },
    /// Bring every output up to date
    Run(RunArguments),
    /// Say what would run, and why; run nothing
    Plan(RunArguments),
    /// Make the pictures: a still and a contact sheet, or part of a still; --watch draws it again after every edit
    Preview(PreviewArguments),
    /// Say what is in a file: counts, bounds, units, ids, warnings
    Inspect {
        /// A skin, curves, map, cache entry or motion
        file: PathBuf,
        /// JSON instead of text
        #[arg(long)]
        json: bool,
    },
    /// Say how far two results differ; exit code 1 if they do
    Compare {
        /// Curves
        a: PathBuf,
        /// Curves
        b: PathBuf,
        /// Largest distance that still counts as equal, scene units
        #[arg(long, default_value_t = 0.0)]
        tolerance: f64,
        /// JSON instead of text
        #[arg(long)]
        json: bool,
    },
    /// Say which hairs run through each other, or through ellipsoids; exit code 1 if any do
    Intersect(intersect::IntersectArguments),
    /// Push curves out of a skin
    Depenetrate(depenetrate::DepenetrateArguments),
    /// Measure error against run time, and write a report
    Bench(bench::BenchArguments),
    /// Do to hair what no shot should, and say what it bore
    Stress(stress::StressArguments),
    /// Look after the cache
    Cache {
        /// What to do with it
        #[command(subcommand)]
        action: CacheAction,
    },
    /// Print the JSON Schema of a configuration file, for editors
    Schema {
        /// Which file
        #[arg(value_enum)]
        file: SchemaFile,
    },
}

/// Arguments of commands that work on a shot.
#[derive(Debug, clap::Args)]
pub struct RunArguments {
    /// Shot file
    #[arg(default_value = "pipeline.toml")]
    pub shot: PathBuf,
    /// Last stage to bring up to date
    #[arg(long, value_enum)]
    pub to: Option<Stage>,
    /// Frames: 1001-1010,1020
    #[arg(long, value_parser = parse_frames, allow_hyphen_values = true)]
    pub frames: Option<Frames>,
    /// Threads; all cores if not given
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Stage that runs again whether its results are there or not
    #[arg(long, value_enum)]
    pub force: Option<Stage>,
    /// Say what was not computed, what that saved, and what error it leaves
    #[arg(long)]
    pub explain_skips: bool,
    /// Report as JSON on stdout
    #[arg(long)]
    pub json: bool,
    /// No progress
    #[arg(long, short)]
    pub quiet: bool,
}

/// Arguments of `pelage preview`.
#[derive(Debug, clap::Args)]
pub struct PreviewArguments {
    /// Those that all commands on a shot share.
    #[command(flatten)]
    pub run: RunArguments,
    /// Draw the still again whenever an input changes, with few hairs first; Ctrl-C ends it
    #[arg(long, conflicts_with_all = ["to", "frames", "force", "json"])]
    pub watch: bool,
    /// A picture of every frame (or of those of --frames), into preview.####.png
    #[arg(long, conflicts_with_all = ["watch", "to", "hairs", "crop", "turntable", "show"])]
    pub sequence: bool,
    /// The still's frame from all sides, into turntable.###.png
    #[arg(long, conflicts_with_all = ["watch", "to", "frames", "hairs", "crop", "show"])]
    pub turntable: bool,
    /// A column of the hairs as colours with a legend, into preview-COLUMN.png: length, density, width, opacity, strain,
    /// penetration, transmittance, transmittance:LIGHT, clump, clump:LEVEL, wetness
    #[arg(long, value_name = "COLUMN", conflicts_with_all = ["watch", "to", "frames"])]
    pub show: Option<Column>,
    /// Ends of the scale of --show: LOW,HIGH; the smallest and the largest value if not given
    #[arg(long, value_name = "LOW,HIGH", value_parser = parse_range, allow_hyphen_values = true, requires = "show")]
    pub range: Option<Range>,
    /// Only this percentage of the hairs, into preview-draft.png; with --watch those of the draft, 10 if not given, 100
    /// for no draft
    #[arg(long, value_name = "PERCENT", value_parser = parse_percent, conflicts_with_all = ["to", "frames"])]
    pub hairs: Option<f64>,
    /// Only a region of the still, into preview-crop.png: X0,Y0,X1,Y1 in fractions of the picture, from the upper left
    #[arg(long, value_parser = parse_crop, allow_hyphen_values = true, conflicts_with_all = ["to", "frames"])]
    pub crop: Option<Crop>,
}

/// A region of a picture: left, upper, right and lower border in [0, 1].
#[derive(Clone, Copy, Debug)]
pub struct Crop(pub [f64; 4]);

/// Ends of a scale.
#[derive(Clone, Copy, Debug)]
pub struct Range(pub [f32; 2]);

/// A parsed list of frames.
#[derive(Clone, Debug)]
pub struct Frames(pub std::collections::BTreeSet<i32>);

/// What to do with the cache.
#[derive(Debug, Subcommand)]
pub enum CacheAction {
    /// Entries and bytes by stage
    Stats(CacheArguments),
    /// Remove entries that the last run of no shot used
    Prune(CacheArguments),
    /// Read every byte of every entry and check it
    Verify(CacheArguments),
}

/// Arguments of cache commands.
#[derive(Debug, clap::Args)]
pub struct CacheArguments {
    /// Shot file that names the cache
    #[arg(default_value = "pipeline.toml")]
    pub shot: PathBuf,
    /// JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Samples that `init` makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Sample {
    /// A human bust with long hair, shaking its head.
    Bust,
    /// The same bust turning and nodding: a deforming sequence.
    BustNod,
    /// A short-furred animal with undercoat and overcoat.
    Animal,
}

/// Configuration files that have a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SchemaFile {
    /// `pipeline.toml`.
    Shot,
    /// `grooms/*.toml`.
    Groom,
}

/// "1001-1010,1020" -> the frames. Negative numbers are frames too: "-5--2".
fn parse_frames(text: &str) -> Result<Frames, String> {
    let bad = || format!("`{text}` is not a list of frames: write for example 1001-1010,1020");
    let mut frames = std::collections::BTreeSet::new();
    for part in text.split(',') {
        let cut = part.char_indices().skip(1).find(|(_, c)| *c == '-').map(|(i, _)| i);
        let (first, last) = cut.map_or((part, part), |i| (&part[..i], &part[i + 1..]));
        let first: i32 = first.trim().parse().map_err(|_| bad())?;
        let last: i32 = last.trim().parse().map_err(|_| bad())?;
        if first > last || i64::from(last) - i64::from(first) > 1_000_000 {
            return Err(bad());
        }
        frames.extend(first..=last);
    }
    Ok(Frames(frames))
}

/// "10" -> 10, above 0 and at most 100.
fn parse_percent(text: &str) -> Result<f64, String> {
    let value = text.trim().trim_end_matches('%').parse().ok().filter(|x: &f64| *x > 0.0 && *x <= 100.0);
    value.ok_or_else(|| format!("`{text}` is not a percentage above 0 and up to 100"))
}

/// "0.2,0,0.5,1" -> the region.
fn parse_crop(text: &str) -> Result<Crop, String> {
    let bad = || format!("`{text}` is not a region: write X0,Y0,X1,Y1 with 0 <= X0 < X1 <= 1 and 0 <= Y0 < Y1 <= 1");
    let list: Option<Vec<f64>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    let crop: [f64; 4] = list.and_then(|l| l.try_into().ok()).ok_or_else(bad)?;
    let ordered = |i: usize| 0.0 <= crop[i] && crop[i] < crop[i + 2] && crop[i + 2] <= 1.0;
    if ordered(0) && ordered(1) { Ok(Crop(crop)) } else { Err(bad()) }
}

/// "0,12.5" -> the ends.
fn parse_range(text: &str) -> Result<Range, String> {
    let ends: Option<Vec<f32>> = text.split(',').map(|x| x.trim().parse().ok()).collect();
    match ends.and_then(|e| <[f32; 2]>::try_from(e).ok()) {
        Some([low, high]) if low < high && (high - low).is_finite() => Ok(Range([low, high])),
        _ => Err(format!("`{text}` is not a scale: write LOW,HIGH with LOW < HIGH")),
    }
}

/// Does what the arguments say; true if the exit code is 0.
pub fn execute(arguments: Arguments) -> Result<bool, Error> {
    match arguments.command {
        Command::Init { dir, skin, meters_per_unit, sample } => {
            init::init(&dir, skin.as_deref(), meters_per_unit, sample)
        }
        Command::Run(a) => run::run(a),
        Command::Preview(a) => preview::preview(a),
        Command::Plan(a) => run::plan(a),
        Command::Inspect { file, json } => inspect::inspect(&file, json),
        Command::Compare { a, b, tolerance, json } => compare::compare(&a, &b, tolerance, json),
        Command::Intersect(a) => intersect::run(&a),
        Command::Depenetrate(a) => depenetrate::run(&a),
        Command::Bench(a) => bench::run(&a),
        Command::Stress(a) => stress::run(&a),
        Command::Cache { action } => cache::cache(action),
        Command::Schema { file } => {
            let text = match file {
                SchemaFile::Shot => crate::config::schema::<crate::config::ShotFile>(),
                SchemaFile::Groom => crate::config::groom_schema(),
            };
            print(&text);
            Ok(true)
        }
    }
}

/// Writes to stdout; a reader that closed the pipe is no error.
fn print(text: &str) {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_lists_of_ranges() {
        let frames = |t| parse_frames(t).map(|f| f.0.into_iter().collect::<Vec<_>>());
        assert_eq!(frames("1001-1003,1007").unwrap(), [1001, 1002, 1003, 1007]);
        assert_eq!(frames("-5--3,-1").unwrap(), [-5, -4, -3, -1]);
        for bad in ["", "a", "3-1", "1,,2", "1-", "1-99999999"] {
            assert!(frames(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn crops_and_percentages_are_checked() {
        assert_eq!(parse_crop("0,0.25, 0.5,1").unwrap().0, [0.0, 0.25, 0.5, 1.0]);
        for bad in ["", "0,0,1", "0,0,1,1,1", "0.5,0,0.5,1", "0,0.8,1,0.2", "-0.1,0,1,1", "0,0,1,1.01", "NaN,0,1,1"] {
            assert!(parse_crop(bad).is_err(), "{bad}");
        }
        assert_eq!((parse_percent("2.5"), parse_percent("100%")), (Ok(2.5), Ok(100.0)));
        assert!(["0", "-1", "100.1", "NaN", "inf", "ten", ""].iter().all(|bad| parse_percent(bad).is_err()));
    }

    #[test]
    fn scales_and_columns_are_checked() {
        assert_eq!(parse_range("-0.5, 12").unwrap().0, [-0.5, 12.0]);
        assert!(["", "1", "2,1", "1,1", "a,b", "0,inf", "nan,1", "0,1,2"].iter().all(|bad| parse_range(bad).is_err()));
        for name in ["length", "clump:2", "transmittance:key", "transmittance", "density"] {
            assert!(name.parse::<Column>().is_ok(), "{name}");
        }
        for bad in ["", "lenght", "clump:x", "length:1", "clump:-1"] {
            assert!(bad.parse::<Column>().is_err(), "{bad}");
        }
    }

    #[test]
    fn arguments_are_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }
}
