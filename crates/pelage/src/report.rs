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
