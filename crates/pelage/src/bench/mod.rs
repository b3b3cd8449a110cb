//! Studies of error against run time: `pelage bench`.
//!
//! A study is a function that asks for points by name and makes findings of them. A point is a handful of numbers that are
//! measured together, such as an error and the seconds that it cost. Points are kept in `points.jsonl` as soon as they are
//! measured, so that a bench that was ended goes on where it was, and each can be measured alone.

mod collision;
mod guides;
mod instancing;
mod lod;
mod machine;
mod papers;
mod plot;
mod report;
mod scaling;
mod shadow;
mod shot;
mod shots;
mod skips;
mod strand;

use crate::Error;
use crate::progress::Progress;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// A study.
#[derive(Clone, Copy, Debug)]
pub struct Study {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it asks.
    pub about: &'static str,
    /// Measures what is not known yet.
    run: fn(&mut Bench<'_>) -> Result<Findings, Error>,
}

/// All studies in the order of the report.
pub const STUDIES: [Study; 10] = [
    strand::STUDY,
    shot::STUDY,
    guides::STUDY,
    collision::STUDY,
    shadow::STUDY,
    instancing::STUDY,
    lod::STUDY,
    skips::STUDY,
    papers::STUDY,
    scaling::STUDY,
];

/// What a study found.
#[derive(Debug, Default)]
pub struct Findings {
    /// What it comes to, in sentences; they stand at the top of the report.
    pub answers: Vec<String>,
    /// Its parts.
    pub sections: Vec<Section>,
}

/// A table with what belongs to it.
#[derive(Debug, Default)]
pub struct Section {
    /// Above it.
    pub title: String,
    /// How it was measured, against what, and what is to be seen; a paragraph each.
    pub text: Vec<String>,
    /// Names and units of the numbers.
    pub columns: Vec<&'static str>,
    /// Point and numbers.
    pub rows: Vec<(String, Vec<f64>)>,
    /// SVG files.
    pub plots: Vec<String>,
    /// PNG files in the bench's folder, with what they show.
    pub pictures: Vec<(String, String)>,
}

impl Section {
    /// An empty table.
    pub fn new(title: &str, columns: &[&'static str]) -> Section {
        Section { title: title.to_owned(), columns: columns.to_vec(), ..Section::default() }
    }

    /// Adds a paragraph.
    pub fn says(mut self, text: impl Into<String>) -> Section {
        self.text.push(text.into());
        self
    }

    /// Adds a row: a point of `bench`, one number a column.
    pub fn row<const N: usize>(
        &mut self,
        bench: &mut Bench<'_>,
        point: &str,
        measure: impl FnOnce() -> Result<[f64; N], Error>,
    ) -> Result<[f64; N], Error> {
        assert_eq!(N, self.columns.len(), "a number for each column of {}", self.title);
        let values = bench.point(point, measure)?;
        self.rows.push((point.to_owned(), values.to_vec()));
        Ok(values)
    }
}

/// What is to be done with points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode<'a> {
    /// Those that are not kept yet are measured.
    Measure,
    /// None is measured, all are named; numbers are NaN.
    List,
    /// Only this one (`study/point`) is measured, and then the study is over.
    Only(&'a str),
}

/// Where studies get their points.
#[derive(Debug)]
pub struct Bench<'a> {
    /// Few points, small shots: the whole in about two minutes.
    pub quick: bool,
    /// The folder of the report.
    pub folder: &'a Path,
    mode: Mode<'a>,
    study: &'static str,
    kept: BTreeMap<String, Vec<f64>>,
    file: Option<File>,
    /// Points in the order in which they were asked for, with their numbers.
    asked: Vec<(String, Vec<f64>)>,
    progress: &'a mut Progress,
}

const POINTS: &str = "points.jsonl";

impl<'a> Bench<'a> {
    /// A bench in a folder, with what is kept there of this very program on this machine.
    pub fn open(folder: &'a Path, quick: bool, progress: &'a mut Progress) -> Result<Bench<'a>, Error> {
        std::fs::create_dir_all(folder).map_err(Error::disk(folder))?;
        let path = folder.join(POINTS);
        let head = format!("{{\"program\":\"{}\"}}", machine::program());
        let before = std::fs::read_to_string(&path).unwrap_or_default();
        let ours = before.lines().next() == Some(head.as_str());
        if !ours && !before.is_empty() {
            progress.say(&format!("note: {} is of another program or machine: measured anew", path.display()));
        }
        let kept: BTreeMap<String, Vec<f64>> = before.lines().skip(1).filter(|_| ours).filter_map(parse).collect();
        // Written anew: the last line may have been cut.
        let mut file = File::create(&path).map_err(Error::disk(&path))?;
        let lines: String = kept.iter().map(|(name, values)| line(name, values)).collect();
        file.write_all(format!("{head}\n{lines}").as_bytes()).map_err(Error::disk(&path))?;
        let (mode, study, asked) = (Mode::Measure, "", Vec::new());
        Ok(Bench { quick, folder, mode, study, kept, file: Some(file), asked, progress })
    }

    /// A bench that measures nothing, or one point.
    fn aside(folder: &'a Path, quick: bool, mode: Mode<'a>, progress: &'a mut Progress) -> Bench<'a> {
        Bench { quick, folder, mode, study: "", kept: BTreeMap::new(), file: None, asked: Vec::new(), progress }
    }

    /// The numbers of a point of the study, by name. What `measure` shares with other points must be computed in it, or when
    /// first used: where all points are kept or listed nothing should be.
    pub fn point<const N: usize>(
        &mut self,
        name: &str,
        measure: impl FnOnce() -> Result<[f64; N], Error>,
    ) -> Result<[f64; N], Error> {
        let whole = format!("{}/{name}", self.study);
        let wanted = match self.mode {
            Mode::Measure => true,
            Mode::List => false,
            Mode::Only(one) => one == whole,
        };
        let known = self.kept.get(&whole).and_then(|v| <[f64; N]>::try_from(v.clone()).ok());
        let values = match known {
            Some(values) => values,
            None if !wanted => [f64::NAN; N],
            None => {
                self.progress.working(&whole);
                let values = measure()?;
                if let Some(file) = &mut self.file {
                    let path = self.folder.join(POINTS);
                    file.write_all(line(&whole, &values).as_bytes()).map_err(Error::disk(&path))?;
                }
                values
            }
        };
        self.progress.step();
        self.asked.push((whole, values.to_vec()));
        if wanted && self.mode != Mode::Measure {
            return Err(Error::Stopped);
        }
        Ok(values)
    }

    /// A PNG file of the study in the bench's folder, made if it is not there.
    pub fn picture(&mut self, name: &str, draw: impl FnOnce() -> Result<Vec<u8>, Error>) -> Result<String, Error> {
        let file = format!("{}-{name}.png", self.study);
        let path = self.folder.join(&file);
        // A picture counts as there once its point is kept.
        let whole = format!("{}/picture/{name}", self.study);
        if self.mode == Mode::Measure && !(self.kept.contains_key(&whole) && path.exists()) {
            self.progress.working(&whole);
            let bytes = draw()?;
            crate::files::write_whole(&path, |f| f.write_all(&bytes)).map_err(Error::disk(&path))?;
            if let Some(kept) = &mut self.file {
                kept.write_all(line(&whole, &[]).as_bytes()).map_err(Error::disk(&path))?;
            }
        }
        Ok(file)
    }
}

/// A kept point as a line of JSON.
fn line(name: &str, values: &[f64]) -> String {
    serde_json::to_string(&(name, values)).expect("plain JSON") + "\n"
}

fn parse(line: &str) -> Option<(String, Vec<f64>)> {
    let (name, values): (String, Vec<Option<f64>>) = serde_json::from_str(line).ok()?;
    Some((name, values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect()))
}

/// Runs studies and writes the report.
pub fn run(studies: &[Study], folder: &Path, quick: bool, progress: &mut Progress) -> Result<(), Error> {
    let mut bench = Bench::open(folder, quick, progress)?;
    let mut found = Vec::new();
    for study in studies {
        let total = points(study, folder, quick)?.len();
        bench.study = study.name;
        bench.progress.begin(study.name, total);
        let findings = (study.run)(&mut bench)?;
        bench.progress.end(&format!("{total} points"));
        found.push((*study, findings));
        report::write(&found, folder, quick)?;
        clear_shots(folder);
    }
    Ok(())
}

/// Removes the shots that studies ran.
fn clear_shots(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let ours = entry.file_name().to_str().is_some_and(|n| n == "shots" || n.starts_with("shot-"));
        if ours && entry.path().is_dir() {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// Names of the points of a study.
pub fn points(study: &Study, folder: &Path, quick: bool) -> Result<Vec<String>, Error> {
    let mut silent = Progress::new(true);
    let mut bench = Bench::aside(folder, quick, Mode::List, &mut silent);
    bench.study = study.name;
    (study.run)(&mut bench)?;
    Ok(bench.asked.into_iter().map(|(name, _)| name).collect())
}

/// Measures one point, `study/point`; `None` if there is none of this name.
pub fn one(point: &str, folder: &Path, quick: bool, progress: &mut Progress) -> Result<Option<Vec<f64>>, Error> {
    let of = |s: &&Study| point.strip_prefix(s.name).is_some_and(|rest| rest.starts_with('/'));
    let Some(study) = STUDIES.iter().find(of) else { return Ok(None) };
    let mut bench = Bench::aside(folder, quick, Mode::Only(point), progress);
    bench.study = study.name;
    let done = (study.run)(&mut bench);
    clear_shots(folder);
    match done {
        Err(Error::Stopped) => Ok(bench.asked.pop().map(|(_, values)| values)),
        other => other.map(|_| None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    static MEASURED: AtomicUsize = AtomicUsize::new(0);

    fn three(bench: &mut Bench<'_>) -> Result<Findings, Error> {
        let mut section = Section::new("Three", &["value", "other"]);
        for k in 0..3 {
            section.row(bench, &format!("point-{k}"), || {
                MEASURED.fetch_add(1, Ordering::Relaxed);
                Ok([f64::from(k), f64::NAN])
            })?;
        }
        let sum: f64 = section.rows.iter().map(|r| r.1[0]).sum();
        Ok(Findings { answers: vec![format!("sum {sum} <3")], sections: vec![section] })
    }

    /// Points are measured once, kept at once, measured again where the file was cut, and listed without being measured.
    #[test]
    fn points_are_kept() {
        let study = Study { name: "three", about: "Three points.", run: three };
        let folder = tempfile::tempdir().unwrap();
        let mut progress = Progress::new(true);
        let mut bench = |expected: usize| {
            MEASURED.store(0, Ordering::Relaxed);
            run(&[study], folder.path(), true, &mut progress).unwrap();
            assert_eq!(MEASURED.load(Ordering::Relaxed), expected);
            std::fs::read_to_string(folder.path().join("report.html")).unwrap()
        };
        assert_eq!(points(&study, folder.path(), true).unwrap(), ["three/point-0", "three/point-1", "three/point-2"]);
        let first = bench(3);
        assert!(first.contains("sum 3 &lt;3") && first.contains("point-2") && !first.contains("NaN"));
        assert_eq!(bench(0), first);
        let kept = folder.path().join(POINTS);
        let text = std::fs::read_to_string(&kept).unwrap();
        std::fs::write(&kept, &text[..text.len() - 9]).unwrap();
        assert_eq!(bench(1), first);
        std::fs::write(&kept, text.replacen("{", "{ ", 1)).unwrap();
        bench(3);
        let csv = std::fs::read_to_string(folder.path().join("points.csv")).unwrap();
        assert!(csv.contains("three,\"Three\",\"point-1\",\"value\",1e0"), "{csv}");
    }

    /// Every study can be listed without measuring anything, and no two points have one name.
    #[test]
    fn all_studies_can_be_listed() {
        let folder = Path::new("nowhere");
        for (study, quick) in STUDIES.iter().flat_map(|s| [(s, false), (s, true)]) {
            let mut names = points(study, folder, quick).unwrap();
            assert!(!names.is_empty() && !folder.exists(), "{}", study.name);
            let count = names.len();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), count, "{}", study.name);
        }
    }
}
