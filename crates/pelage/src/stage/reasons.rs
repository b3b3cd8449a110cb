//! Reasons as a person reads them.

use std::collections::BTreeMap;

/// Values of one key up to which each has a reason of its own.
const MANY: usize = 3;

/// Reasons with those that give one key other values in many steps, as key frames do, as one.
pub fn together(reasons: Vec<String>) -> Vec<String> {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    reasons.iter().filter_map(|r| key(r)).for_each(|k| *count.entry(k).or_default() += 1);
    let mut out: Vec<String> = Vec::new();
    for reason in reasons {
        let said = match key(&reason).map(|k| (count[&k], k)) {
            Some((n, key)) if n > MANY => format!("{key} changed at {n} frames or places"),
            _ => reason,
        };
        if !out.contains(&said) {
            out.push(said);
        }
    }
    out
}

/// File and key of "FILE: KEY 1 -> 2" or "FILE: KEY [1, 2] -> [1, 3]".
fn key(reason: &str) -> Option<String> {
    let (before, _) = reason.split_once(" -> ")?;
    let end = before.find(" [").or_else(|| before.rfind(' '))?;
    Some(before[..end].to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_many_frames_are_told_once() {
        let told = |n: usize| -> Vec<String> {
            let at =
                |k: usize| [format!("a b.toml: comb[0].at [{k}, 2] -> [{k}.5, 2]"), format!("a b.toml: x {k} -> 9")];
            together((0..n).flat_map(at).chain(["maps/a.png changed".to_owned()]).collect())
        };
        assert_eq!(told(3).len(), 7);
        let of = |key: &str| format!("a b.toml: {key} changed at 40 frames or places");
        assert_eq!(told(40), [of("comb[0].at"), of("x"), "maps/a.png changed".to_owned()]);
    }
}
