//! The report of a run: what ran, what was reused and why, in `report.json`.

use serde::Serialize;
use std::collections::BTreeMap;

/// Report of a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Name of the shot.
    pub shot: String,
    /// Version of Pelage.
    pub version: String,
    /// One entry a stage, in order.
    pub stages: Vec<StageReport>,
    /// What was not computed, what that saved, and what error it leaves.
    pub skips: Vec<Skipped>,
}

/// Something that was not computed.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    /// The stage that would have.
    pub stage: String,
    /// What.
    pub what: String,
    /// How many, of how many.
    pub count: u64,
    /// How many there are with those that were computed.
    pub of: u64,
    /// About how many seconds that saved; nothing where it was never measured.
    pub saved_s: Option<f64>,
    /// Bound of the error that it leaves.
    pub error: String,
}

impl Skipped {
    /// One.
    pub fn new(stage: &str, what: &str, count: u64, of: u64, saved_s: Option<f64>, error: &str) -> Self {
        Skipped { stage: stage.to_owned(), what: what.to_owned(), count, of, saved_s, error: error.to_owned() }
    }
}

/// What happened in a stage.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StageReport {
    /// Name of the stage.
    pub name: String,
    /// Steps that ran: frames where the stage has frames, else 1, or one per file for export.
    pub ran: usize,
    /// Steps found finished.
    pub reused: usize,
    /// What changed since the last run.
    pub reasons: Vec<String>,
    /// Seconds on the clock.
    pub wall_s: f64,
    /// Seconds of processor time.
    pub cpu_s: f64,
    /// Largest memory of the process so far, bytes (0 where the system does not tell).
    pub peak_bytes: u64,
    /// Counts by name: hairs, control hairs, fallbacks and repairs.
    pub counts: BTreeMap<String, u64>,
    /// What was not computed because the shot does not need it.
    pub skipped: BTreeMap<String, u64>,
    /// Warnings.
    pub warnings: Vec<String>,
    /// Steps that ran, that were in the cache, and that turned out to be another step of this run.
    #[serde(skip)]
    pub made: usize,
    /// See `made`.
    #[serde(skip)]
    pub from_cache: usize,
    /// See `made`.
    #[serde(skip)]
    pub alike: usize,
    /// Seconds that the stage's steps took when they ran last.
    #[serde(skip)]
    pub known_s: f64,
    /// Of these, seconds of this run.
    #[serde(skip)]
    pub spent_s: f64,
}

impl Report {
    /// Readable JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain JSON") + "\n"
    }

    /// Steps that ran, over all stages.
    pub fn ran(&self) -> usize {
        self.stages.iter().map(|s| s.ran).sum()
    }
}

/// Processor seconds of this process so far; 0 where the system does not tell.
pub fn cpu_seconds() -> f64 {
    let read = || {
        let text = std::fs::read_to_string("/proc/self/stat").ok()?;
        let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        Some(ticks / 100.0)
    };
    read().unwrap_or(0.0)
}

/// Largest resident memory of this process so far, bytes; 0 where the system does not tell.
pub fn peak_bytes() -> u64 {
    let read = || {
        let text = std::fs::read_to_string("/proc/self/status").ok()?;
        let line = text.lines().find(|l| l.starts_with("VmHWM:"))?;
        Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
    };
    read().unwrap_or(0)
}
