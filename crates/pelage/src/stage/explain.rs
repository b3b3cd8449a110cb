//! What a run did not compute, and what that saved: `run --explain-skips`, and `skips` in the report.

use super::kept::LEFT_OUT;
use super::plan_light::is_shadowed;
use super::run::Runner;
use super::{Stage, simulate};
use crate::config::ExportFormat;
use crate::report::{Report, Skipped};
use std::collections::BTreeMap;

/// Time that strands take which twist, over that of strands which can't, less one (a step of curved and of straight hair; see the
/// benchmarks).
const TWIST: f64 = 0.95;

/// Seconds that steps took when they ran last, by name, with their keys then.
pub(super) type Seconds = BTreeMap<String, (String, f64)>;

impl Runner<'_> {
    /// What was skipped in a run. Seconds are those of the steps when they ran, in this run or an earlier one; where a step
    /// never ran, those of its like.
    pub(super) fn skips(&self, report: &Report) -> Vec<Skipped> {
        let mut out = Vec::new();
        let stage_report = |stage: Stage| report.stages.iter().find(|s| s.name == stage.name());
        for stage in self.stages() {
            let Some(done) = stage_report(stage) else { continue };
            if done.from_cache > 0 {
                let saved = done.known_s - done.spent_s;
                let all = (done.from_cache + done.made) as u64;
                out.push(Skipped::new(
                    stage.name(),
                    "steps in the cache",
                    done.from_cache as u64,
                    all,
                    Some(saved),
                    "none",
                ));
            }
            if done.alike > 0 {
                let each = done.spent_s / done.made.max(1) as f64;
                let saved = each * done.alike as f64;
                let all = (done.alike + done.made + done.from_cache) as u64;
                out.push(Skipped::new(stage.name(), "steps like another", done.alike as u64, all, Some(saved), "none"));
            }
        }
        let known = |stage: Stage| stage_report(stage).map_or(0.0, |s| s.known_s);
        let of = |stage: Stage, name: &str| {
            stage_report(stage).and_then(|s| s.skipped.get(name).or(s.counts.get(name))).copied().unwrap_or(0)
        };
        let all = of(Stage::Instance, "hairs");
        let left = of(Stage::Instance, "hairs that the shot needs");
        let later: f64 = [Stage::Simulate, Stage::Interpolate, Stage::Shadow, Stage::Export].map(known).iter().sum();
        for name in LEFT_OUT {
            let count = of(Stage::Instance, name);
            let error = match name {
                "hairs thinned by distance" => "as many pixels are covered; single pixels differ (bench study lod)",
                _ => "none on the hair that is left; shadows of hair farther away than skip.margin are missing",
            };
            // Without any hair left nothing is known of what one costs.
            let saved = (left > 0).then(|| later * count as f64 / left as f64);
            out.push(Skipped::new("instance", name, count, all, saved, error));
        }
        let [asleep, frames] = simulate::SKIPPED.map(|name| of(Stage::Simulate, name));
        let saved = known(Stage::Simulate) * asleep as f64 / frames.saturating_sub(asleep).max(1) as f64;
        let error = "a micrometre; in contact up to a tenth of a millimetre";
        out.push(Skipped::new("simulate", "hairs asleep, times frames", asleep, frames, Some(saved), error));
        let (plain, simulated) = (of(Stage::Simulate, simulate::UNTWISTED), of(Stage::Simulate, "simulated"));
        let saved = known(Stage::Simulate) * TWIST * plain as f64 / simulated.max(1) as f64;
        out.push(Skipped::new("simulate", "twist of hairs that can't twist", plain, simulated, Some(saved), "none"));
        let shot = &self.project.shot.value;
        let frames = || self.project.frames.keys().filter(|f| self.wants(**f));
        let pairs = (shot.light.len() * frames().count()) as u64;
        let written = |l: usize, f: i32| is_shadowed(self.project, l, f, true) || self.shows(f);
        let lit: usize = (0..shot.light.len()).map(|l| frames().filter(|f| written(l, **f)).count()).sum();
        let each = known(Stage::Shadow) / lit.max(1) as f64;
        let unlit = pairs - lit as u64;
        let saved = (lit > 0).then_some(each * unlit as f64);
        out.push(Skipped::new("shadow", "lights off or read by nothing, times frames", unlit, pairs, saved, "none"));
        let formats = [ExportFormat::Usd, ExportFormat::Mcap, ExportFormat::Ply];
        let unasked = formats.iter().filter(|f| !shot.export.formats.contains(f)).count() as u64;
        out.push(Skipped::new("export", "formats that are not asked for", unasked, formats.len() as u64, None, "none"));
        out.retain(|s| s.count > 0);
        out
    }
}
