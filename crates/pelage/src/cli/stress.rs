//! `pelage stress`: what hair must bear, as a table.

use super::print;
use crate::Error;
use crate::progress::Progress;
use pelage_sim::Model;
use pelage_sim::stress::{CASES, Case, Measures};
use serde_json::{Value, json};

/// Arguments of `pelage stress`.
#[derive(Debug, clap::Args)]
pub struct StressArguments {
    /// Only these cases (or beginnings of their names)
    pub cases: Vec<String>,
    /// Say what the cases are, and run none
    #[arg(long)]
    pub list: bool,
    /// JSON instead of a table
    #[arg(long)]
    pub json: bool,
    /// No progress
    #[arg(long, short)]
    pub quiet: bool,
}

/// Runs cases of abuse; true if every bound holds.
pub fn run(a: &StressArguments) -> Result<bool, Error> {
    let wanted = |c: &&Case| a.cases.is_empty() || a.cases.iter().any(|w| c.name.starts_with(w.as_str()));
    let cases: Vec<&Case> = CASES.iter().filter(wanted).collect();
    if let Some(none) = a.cases.iter().find(|w| !CASES.iter().any(|c| c.name.starts_with(w.as_str()))) {
        let names = CASES.iter().map(|c| c.name).collect::<Vec<_>>().join(", ");
        return Err(Error::input(format!("there is no case `{none}`"), format!("the cases are: {names}")));
    }
    if a.list {
        print(&cases.iter().map(|c| format!("{:<22} {}\n", c.name, c.about)).collect::<String>());
        return Ok(true);
    }
    let mut progress = Progress::new(a.quiet);
    progress.begin("stress", cases.iter().map(|c| c.models.len()).sum());
    let mut found = Vec::new();
    for case in cases {
        for &model in case.models {
            progress.working(&format!("{} ({})", case.name, name(model)));
            found.push((case, model, case.measure(model)));
            progress.step();
        }
    }
    let held = found.iter().flat_map(|f| &f.2.all).filter(|m| m.holds()).count();
    let all: usize = found.iter().map(|f| f.2.all.len()).sum();
    progress.end(&format!("{held} of {all} bounds hold"));
    print(&if a.json { as_json(&found) } else { table(&found, held, all) });
    Ok(held == all)
}

type Found<'a> = (&'a Case, Model, Measures);

fn name(model: Model) -> &'static str {
    match model {
        Model::Rod => "rod",
        Model::Springs => "springs",
        Model::Paper => "paper",
    }
}

fn table(found: &[Found<'_>], held: usize, all: usize) -> String {
    let mut out = String::new();
    for (case, model, measures) in found {
        out += &format!("{} ({}): {}\n", case.name, name(*model), case.about);
        for m in &measures.all {
            let mark = if m.holds() { "ok" } else { "BROKEN" };
            out += &format!("  {:<46} {:>10.3e}  <= {:>9.3e}  {mark}\n", m.what, m.value, m.bound);
        }
    }
    out + &format!("{held} of {all} bounds hold\n")
}

fn as_json(found: &[Found<'_>]) -> String {
    let case = |(case, model, measures): &Found<'_>| {
        let all: Vec<Value> = measures
            .all
            .iter()
            .map(|m| json!({ "what": m.what, "value": m.value, "bound": m.bound, "holds": m.holds() }))
            .collect();
        json!({ "case": case.name, "about": case.about, "model": name(*model), "measures": all })
    };
    let all: Vec<Value> = found.iter().map(case).collect();
    serde_json::to_string_pretty(&all).expect("plain JSON") + "\n"
}
