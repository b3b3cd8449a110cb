//! `pelage compare`: how far two results differ.

use super::print;
use crate::Error;
use crate::curves::{self, CurveSet};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Differences of one layer over all frames that both files have.
#[derive(Debug, Default, Serialize)]
struct LayerDifference {
    layer: String,
    hairs: [usize; 2],
    only_in: [usize; 2],
    other_point_count: usize,
    frames: usize,
    max_distance: f64,
    rms_distance: f64,
    worst: Vec<Worst>,
    #[serde(skip)]
    sum: f64,
    #[serde(skip)]
    points: u64,
}

#[derive(Clone, Debug, Serialize)]
struct Worst {
    id: u64,
    frame: Option<f64>,
    distance: f64,
}

/// Hairs that the report names.
const WORST: usize = 5;

/// Compares two files of curves; true if they agree within the tolerance.
pub fn compare(a: &Path, b: &Path, tolerance: f64, json: bool) -> Result<bool, Error> {
    let (first_a, first_b) = (curves::read(a, None)?, curves::read(b, None)?);
    let shared: Vec<f64> = first_a.frames.iter().filter(|f| first_b.frames.contains(f)).copied().collect();
    let timed = !first_a.frames.is_empty() && !first_b.frames.is_empty();
    if timed && shared.is_empty() {
        return Err(Error::input(
            "the two files have no frame in common",
            "`pelage inspect` lists the frames of a file",
        ));
    }
    let mut layers: BTreeMap<String, LayerDifference> = BTreeMap::new();
    let moments: Vec<Option<f64>> = if timed { shared.iter().map(|f| Some(*f)).collect() } else { vec![None] };
    for frame in &moments {
        let (fa, fb) = (curves::read(a, *frame)?, curves::read(b, *frame)?);
        for (i, la) in fa.layers.iter().enumerate() {
            let named = fb.layers.iter().find(|l| l.name == la.name && !la.name.is_empty());
            let empty = CurveSet { name: String::new(), strands: Default::default(), width: Vec::new() };
            let lb = named.or_else(|| fb.layers.get(i).filter(|l| l.name.is_empty() || la.name.is_empty()));
            let entry = layers.entry(la.name.clone()).or_default();
            add(entry, la, lb.unwrap_or(&empty), *frame);
        }
        for lb in fb
            .layers
            .iter()
            .filter(|l| !l.name.is_empty() && !fa.layers.iter().any(|m| m.name == l.name || m.name.is_empty()))
        {
            let entry = layers.entry(lb.name.clone()).or_default();
            let empty = CurveSet { name: lb.name.clone(), strands: Default::default(), width: Vec::new() };
            add(entry, &empty, lb, *frame);
        }
    }
    let frames = [first_a.frames.len(), first_b.frames.len()];
    let same_frames = first_a.frames == first_b.frames || !timed;
    let layers: Vec<LayerDifference> = layers.into_values().map(finish).collect();
    let close = |l: &LayerDifference| l.only_in == [0, 0] && l.other_point_count == 0 && l.max_distance <= tolerance;
    let equal = same_frames && layers.iter().all(close);
    if json {
        let report =
            serde_json::json!({"equal": equal, "frames": frames, "compared_frames": moments.len(), "layers": layers});
        print(&(serde_json::to_string_pretty(&report).expect("plain JSON") + "\n"));
    } else {
        let mut out: String = layers.iter().map(describe).collect();
        if !same_frames {
            out.push_str(&format!("frames: {} and {}, {} compared\n", frames[0], frames[1], moments.len()));
        }
        out.push_str(if equal { "equal\n" } else { "different\n" });
        print(&out);
    }
    Ok(equal)
}

fn add(out: &mut LayerDifference, a: &CurveSet, b: &CurveSet, frame: Option<f64>) {
    out.layer = a.name.clone();
    out.frames += 1;
    out.hairs = [a.strands.len(), b.strands.len()];
    let name = |s: &CurveSet, i: usize| s.strands.id.get(i).copied().unwrap_or(i as u64);
    let of_b: BTreeMap<u64, usize> = (0..b.strands.len()).map(|i| (name(b, i), i)).collect();
    let mut shared = 0;
    out.other_point_count = 0;
    for i in 0..a.strands.len() {
        let Some(&j) = of_b.get(&name(a, i)) else { continue };
        shared += 1;
        let (p, q) = (a.strands.points(i), b.strands.points(j));
        if p.len() != q.len() {
            out.other_point_count += 1;
            continue;
        }
        let at = |s: &CurveSet, p: &[f32; 3], x: usize| f64::from(p[x]) + s.strands.origin[x];
        let square = |(p, q): (&[f32; 3], &[f32; 3])| (0..3).map(|x| (at(a, p, x) - at(b, q, x)).powi(2)).sum::<f64>();
        let mut worst = 0.0f64;
        for d in p.iter().zip(q).map(square) {
            out.sum += d;
            worst = if d.is_nan() { f64::INFINITY } else { worst.max(d) };
        }
        out.points += p.len() as u64;
        let distance = worst.sqrt();
        if distance > 0.0 && (out.worst.len() < WORST || distance > out.worst[WORST - 1].distance) {
            out.worst.push(Worst { id: name(a, i), frame, distance });
            out.worst.sort_by(|x, y| y.distance.total_cmp(&x.distance));
            out.worst.truncate(WORST);
        }
        out.max_distance = out.max_distance.max(distance);
    }
    out.only_in = [a.strands.len() - shared, b.strands.len() - shared];
}

fn finish(mut l: LayerDifference) -> LayerDifference {
    l.rms_distance = if l.points > 0 { (l.sum / l.points as f64).sqrt() } else { 0.0 };
    l
}

fn describe(l: &LayerDifference) -> String {
    let name = if l.layer.is_empty() { "curves" } else { &l.layer };
    let mut out = format!("{name}: {} and {} hairs", l.hairs[0], l.hairs[1]);
    if l.only_in != [0, 0] {
        out.push_str(&format!(", {} only in the first, {} only in the second", l.only_in[0], l.only_in[1]));
    }
    if l.other_point_count > 0 {
        out.push_str(&format!(", {} with another number of points", l.other_point_count));
    }
    out.push_str(&format!("; distance: largest {:.6}, RMS {:.6}\n", l.max_distance, l.rms_distance));
    for w in &l.worst {
        let frame = w.frame.map(|f| format!(" at frame {f}")).unwrap_or_default();
        out.push_str(&format!("  hair {}{frame}: {:.6}\n", w.id, w.distance));
    }
    out
}
