//! What a hair asks of the skin: what of it is inside, how deep, and which way is out.

use super::Depenetrate;
use pelage_geom::{Bvh, Closest, Vec3};

/// Distance in steps beyond which a bound is asked for before the distance. At 1 both are asked for near the skin; at 20
/// the distance is, where it is dear.
const FAR: f64 = 4.0;

/// Part of `held` down to which a root may lie in the skin for the rest of that length to be enough to get out.
pub(super) const SHALLOW: f64 = 0.75;

/// The deepest point of a segment inside the skin.
#[derive(Clone, Copy)]
pub(super) struct Dip {
    /// Parameter on the segment.
    pub(super) t: f64,
    pub(super) depth: f64,
    /// Unit vector to the nearest point of the skin.
    pub(super) out: Vec3,
    /// Unit vector from there away from the skin, if that is another one: at the rim of a fold.
    pub(super) away: Option<Vec3>,
}

impl Dip {
    /// Direction and way to a distance from the skin.
    pub(super) fn way(&self, clearance: f64) -> (Vec3, f64) {
        let Some(away) = self.away else { return (self.out, self.depth + clearance) };
        let way = self.out * self.depth + away * clearance;
        let length = way.norm();
        if length > 0.0 { (way / length, length) } else { (away, clearance) }
    }
}

/// What is known about a hair ahead of the point reached.
#[derive(Clone, Copy)]
pub(super) struct Ahead {
    /// Length that is outside.
    sure: f64,
    /// About the distance at the last sample, negative inside.
    last: f64,
}

impl Ahead {
    pub(super) const UNKNOWN: Ahead = Ahead { sure: 0.0, last: -1.0 };
}

/// The skin as hair asks for it.
#[derive(Clone, Copy)]
pub(super) struct Probe<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) settings: &'a Depenetrate,
    /// The skin runs through itself.
    pub(super) folded: bool,
}

impl Probe<'_> {
    /// Nearest skin, its distance negative inside.
    pub(super) fn closest(&self, at: Vec3, limit: f64) -> Option<Closest> {
        if self.folded { self.bvh.closest_outside(at, limit) } else { self.bvh.closest(at, limit) }
    }

    /// How deep a root is inside, and whether hair on it grows inside: where another part of the skin covers it by more
    /// than the held length gets out of, or the skin is turned inside out.
    pub(super) fn root(&self, at: Vec3) -> (f64, bool) {
        let front = if self.folded { self.bvh.winding_in_front(at) } else { 0 };
        // Skin that leads out is no farther than the nearest.
        let nearest = if front == 0 { self.bvh.closest(at, f64::INFINITY) } else { self.closest(at, f64::INFINITY) };
        let depth = nearest.map_or(0.0, |c| -c.signed_distance);
        (depth, front < 0 || (front > 0 && depth > SHALLOW * self.settings.held))
    }

    /// Length of a hair from its root to where it is first outside; `None` if it never is.
    pub(super) fn comes_out(&self, line: &[Vec3]) -> Option<f64> {
        let (mut before, mut s) = (0.0, self.settings.held);
        for w in line.windows(2) {
            let length = (w[1] - w[0]).norm();
            while s < before + length {
                let at = w[0] + (w[1] - w[0]) * ((s - before) / length);
                if self.closest(at, f64::INFINITY).is_none_or(|c| c.signed_distance >= 0.0) {
                    return Some(s);
                }
                s += self.settings.step;
            }
            before += length;
        }
        None
    }

    /// Greatest depth beyond the arc length `held`, 0 if nothing is inside; and which segments are, into `open`.
    pub(super) fn depth(&self, line: &[Vec3], held: f64, open: &mut Vec<bool>) -> f64 {
        open.clear();
        let mut left: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let (mut before, mut ahead, mut deepest) = (0.0, Ahead::UNKNOWN, 0.0f64);
        for w in line.windows(2) {
            let length = (w[1] - w[0]).norm();
            let from = (held - before).max(0.0);
            let dip = if from < length { self.dip(w[0], w[1], from, left, &mut ahead) } else { None };
            open.push(dip.is_some());
            deepest = deepest.max(dip.map_or(0.0, |d| d.depth));
            before += length;
            left -= length;
        }
        deepest
    }

    /// Deepest point of a segment beyond `from`. `left`: length from its beginning to where nothing matters any more.
    pub(super) fn dip(&self, a: Vec3, b: Vec3, from: f64, left: f64, ahead: &mut Ahead) -> Option<Dip> {
        let length = (b - a).norm();
        let mut s = from.max(ahead.sure);
        if s >= length {
            ahead.sure -= length;
            return None;
        }
        let direction = (b - a) / length;
        let step = self.settings.step;
        // Distance or a lower bound of it, and the dip where it is negative.
        let sample = |s: f64, last: f64| {
            let at = a + direction * s;
            // From an outside point on, only the skin within reach matters, and far out not on which side it is.
            let limit = if last >= 0.0 { (left - s).max(0.0) + step } else { f64::INFINITY };
            if last >= FAR * step {
                let bound = self.bvh.distance_bound(at, limit);
                if bound >= 0.5 * FAR * step {
                    return (bound, None);
                }
            }
            let Some(c) = self.closest(at, limit) else { return (f64::INFINITY, None) };
            let depth = -c.signed_distance;
            let out = (c.position - at).try_normalize(1e-6 * step).unwrap_or(c.normal);
            let away = self.folded.then_some(c.normal);
            (c.signed_distance, (depth > 0.0).then_some(Dip { t: s / length, depth, out, away }))
        };
        let (mut deepest, mut untested) = (None, true);
        let (mut now, dip) = sample(s, ahead.last);
        deeper(&mut deepest, dip);
        loop {
            if now >= 0.0 && s + now >= length {
                *ahead = Ahead { sure: s + now - length, last: now };
                return deepest;
            }
            if now >= 0.0 && untested {
                untested = false;
                // Sure up to s + now; a ray tells about the rest.
                if self.bvh.ray(a + direction * (s + now), direction, length - s - now).is_none() {
                    *ahead = Ahead { sure: 0.0, last: now };
                    return deepest;
                }
            }
            let end = (s + step.max(now)).min(length);
            let (next, dip) = sample(end, now);
            deeper(&mut deepest, dip);
            if now >= 0.0 && next >= 0.0 && now + next < end - s {
                // Both are outside, and what is between may not be.
                let between = self.crossing(a + direction * s, direction, end - s).map(|t| sample(s + t, -1.0));
                deeper(&mut deepest, between.and_then(|b| b.1));
            }
            if end >= length {
                *ahead = Ahead { sure: next.max(0.0), last: next };
                return deepest;
            }
            (s, now) = (end, next);
        }
    }

    /// Middle between the first two places where a line meets the skin within `length`.
    fn crossing(&self, from: Vec3, direction: Vec3, length: f64) -> Option<f64> {
        let (enter, _) = self.bvh.ray(from, direction, length)?;
        let beyond = enter + 1e-6 * length;
        let (leave, _) = self.bvh.ray(from + direction * beyond, direction, length - beyond)?;
        Some(0.5 * (enter + beyond + leave))
    }
}

fn deeper(deepest: &mut Option<Dip>, dip: Option<Dip>) {
    if dip.is_some_and(|d| deepest.is_none_or(|e| d.depth > e.depth)) {
        *deepest = dip;
    }
}
