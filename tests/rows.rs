//! What runs again when something changes, row by row, with the reason printed.

use pelage_tests::{ShotFolder, small_shot};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");

/// Steps that ran, by stage name.
fn ran(report: &serde_json::Value) -> Vec<(String, u64)> {
    let stages = report["stages"].as_array().expect("stages");
    stages.iter().map(|s| (s["name"].as_str().expect("a name").to_owned(), s["ran"].as_u64().expect("a count"))).collect()
}

fn finished() -> ShotFolder {
    let shot = small_shot(COMMAND, 3);
    shot.report(&[]);
    shot
}

#[test]
fn a_second_run_has_nothing_to_do() {
    let shot = finished();
    assert!(ran(&shot.report(&[])).iter().all(|(_, n)| *n == 0));
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
}
