//! Push-up: control hairs that enter the skin are turned until they clear it.
//!
//! "Course notes 2003, A production pipeline for hair", §3.2: a hair whose vertex goes below the surface is rotated back
//! toward the surface normal from the previous clear vertex, just enough to clear. Here a segment has to clear along its
//! whole length, not only at its vertex. Only that segment turns; those beyond are carried along, keep the directions they
//! were combed to, and are tested in turn, so that a hair combed into the head drapes over it.
//!
//! **Clear** at arc length s from the root: signed distance at least `clearance * min(1, s / (RAMP * clearance))`. Distance
//! changes by at most the way gone, so samples `min(step, 2 * clearance)` apart beyond the ramp prove that nothing between
//! them is inside.

use crate::comb::{rotate, slerp, world_points};
use crate::control::{ControlHairs, Skin, to_local};
use pelage_geom::{Bvh, Closest, Vec3};
use rayon::prelude::*;

/// Length of the ramp at the root over which the clearance grows from 0, in clearances. At 3 hair lying flat would be
/// lifted to 20 degrees at its root; at 100 the ramp reaches so far that a hair may graze the skin for all of it.
const RAMP: f64 = 10.0;

/// Steps of the search for the first clear angle between a segment's direction and the normal, before bisection. Fewer
/// step over a narrow clear gap and lift a hair needlessly; each costs a walk along the segment.
const SCAN: usize = 12;

/// Bisections of the last step: 12 leave 1/4096 of a step, less than a hundredth of a degree.
const BISECT: usize = 12;

/// Part of the clearance at which a hair passes as it is: room for the rounding of stored points, so that a second push-up
/// changes nothing.
const SLACK: f64 = 0.99;

/// Directions tried where even the normal leads into the skin.
const ESCAPES: usize = 128;

/// Settings of [`push_up`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PushUp {
    /// Largest distance of samples along a hair, scene units; 1 mm.
    pub step: f64,
    /// Distance from the skin that hairs keep beyond the ramp at their root, scene units; 0.5 mm. Positive.
    pub clearance: f64,
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PushCounts {
    /// Hairs that were turned.
    pub pushed: usize,
    /// Of these, hairs with a segment that had to leave the way to the normal, because the normal was blocked too.
    pub escaped: usize,
    /// Hairs for which no direction was clear: they follow the directions that stay farthest out.
    pub uncleared: usize,
}

/// Turns segments of `hairs` until none enters the rest skin (`bvh` is that of the rest pose). Lengths stay as they are,
/// hairs that are clear stay byte for byte.
pub fn push_up(skin: &Skin, bvh: &Bvh, settings: &PushUp, hairs: &mut ControlHairs) -> PushCounts {
    assert!(settings.step > 0.0 && settings.clearance > 0.0, "step and clearance of the push-up are positive");
    let (root, points) = (&hairs.root, hairs.points);
    let lift = |(h, local): (usize, &mut [[f32; 3]])| {
        let frame = skin.frame(&root[h]);
        let line = world_points(&frame, local);
        let job = Job { skin: Some(skin), closest: &|at, limit| bvh.closest(at, limit), settings, normal: frame.n };
        let (line, counts) = job.clear(line);
        if counts.pushed > 0 {
            for (out, p) in local.iter_mut().zip(&line) {
                let v = to_local(&frame, p - frame.origin);
                *out = [v.x as f32, v.y as f32, v.z as f32];
            }
        }
        counts
    };
    hairs.local.par_chunks_mut(points).enumerate().map(lift).reduce(PushCounts::default, |a, b| PushCounts {
        pushed: a.pushed + b.pushed,
        escaped: a.escaped + b.escaped,
        uncleared: a.uncleared + b.uncleared,
    })
}

/// A line from the skin turned out of it segment by segment, its lengths kept; `None` if there is no way out. `normal` is
/// that of the skin at its root, `closest` finds the skin nearest to a point within a limit.
pub(crate) fn drape(closest: Find<'_>, settings: &PushUp, normal: Vec3, line: &[Vec3]) -> Option<Vec<Vec3>> {
    let (line, counts) = Job { skin: None, closest, settings, normal }.clear(line.to_vec());
    (counts.uncleared == 0).then_some(line)
}

/// Nearest skin of a point within a limit.
pub(crate) type Find<'a> = &'a dyn Fn(Vec3, f64) -> Option<Closest>;

/// One hair.
struct Job<'a> {
    /// For smooth normals; without, those of triangles do.
    skin: Option<&'a Skin<'a>>,
    closest: Find<'a>,
    settings: &'a PushUp,
    /// Normal at the root.
    normal: Vec3,
}

/// How a segment fares.
#[derive(Clone, Copy)]
enum Fit {
    Clear,
    /// By how much it misses its clearance at the first sample that does.
    Misses(f64),
}

impl Job<'_> {
    /// The hair, turned where it had to be. If it ran into a dead end, straight hairs are tried instead.
    fn clear(&self, line: Vec<Vec3>) -> (Vec<Vec3>, PushCounts) {
        let (pushed, counts) = self.follow(&line);
        if counts.uncleared == 0 {
            return (pushed, counts);
        }
        let total: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let along = |d: Vec3| {
            let mut out = vec![line[0]];
            line.windows(2).for_each(|w| out.push(out[out.len() - 1] + d * (w[1] - w[0]).norm()));
            out
        };
        for d in around(self.normal, self.normal) {
            if let Fit::Clear = self.fit(line[0], d, total, 0.0, 1.0) {
                return (along(d), PushCounts { pushed: 1, escaped: 1, uncleared: 0 });
            }
        }
        (pushed, counts)
    }

    /// Segment after segment from the root.
    fn follow(&self, line: &[Vec3]) -> (Vec<Vec3>, PushCounts) {
        let mut out = vec![line[0]];
        let mut counts = PushCounts::default();
        let mut before = 0.0;
        for w in line.windows(2) {
            let at = out[out.len() - 1];
            let v = w[1] - w[0];
            let length = v.norm();
            if length == 0.0 {
                out.push(at);
                continue;
            }
            let d = v / length;
            let turned = match self.fit(at, d, length, before, SLACK) {
                Fit::Clear => d,
                Fit::Misses(_) => {
                    counts.pushed = 1;
                    self.turn(at, d, length, before, &mut counts)
                }
            };
            out.push(at + turned * length);
            before += length;
        }
        (out, counts)
    }

    /// The direction nearest to `d`, on the way to the normal, in which a segment from `at` is clear.
    fn turn(&self, at: Vec3, d: Vec3, length: f64, before: f64, counts: &mut PushCounts) -> Vec3 {
        let n = if before == 0.0 { self.normal } else { self.normal_near(at) };
        let clear = |f: f64| matches!(self.fit(at, slerp(d, n, f), length, before, 1.0), Fit::Clear);
        if let Some(k) = (1..=SCAN).find(|&k| clear(k as f64 / SCAN as f64)) {
            let (mut low, mut high) = ((k - 1) as f64 / SCAN as f64, k as f64 / SCAN as f64);
            for _ in 0..BISECT {
                let middle = 0.5 * (low + high);
                if clear(middle) { high = middle } else { low = middle }
            }
            return slerp(d, n, high);
        }
        let mut best = (f64::INFINITY, n);
        for e in around(n, d) {
            match self.fit(at, e, length, before, 1.0) {
                Fit::Clear => {
                    counts.escaped = 1;
                    return e;
                }
                Fit::Misses(by) if by < best.0 => best = (by, e),
                Fit::Misses(_) => {}
            }
        }
        counts.uncleared = 1;
        best.1
    }

    /// Smooth normal of the skin nearest to a point.
    fn normal_near(&self, at: Vec3) -> Vec3 {
        let smooth = |c: Closest| self.skin.map_or(c.normal, |s| s.frame(&c.point).n);
        (self.closest)(at, f64::INFINITY).map_or(self.normal, smooth)
    }

    /// Walks along a segment that begins at arc length `before` of its hair (its first point was checked as the end of
    /// the segment before), asking for `share` of the clearance.
    fn fit(&self, from: Vec3, d: Vec3, length: f64, before: f64, share: f64) -> Fit {
        let PushUp { step, clearance } = *self.settings;
        let ramp = RAMP * clearance;
        let mut s = 0.0;
        let mut sure = 0.0;
        while s < length {
            // Nothing nearer than `sure` can be too near; on the ramp samples stay close.
            let fine = if before + s < ramp { (0.25 * step).min(0.05 * ramp) } else { step.min(2.0 * clearance) };
            s = (s + fine.max(sure)).min(length);
            let Some(hit) = (self.closest)(from + d * s, f64::INFINITY) else { return Fit::Clear };
            let need = clearance * ((before + s) / ramp).min(1.0) * share;
            if hit.signed_distance < need {
                return Fit::Misses(need - hit.signed_distance);
            }
            sure = hit.signed_distance - clearance;
        }
        Fit::Clear
    }
}

/// Directions spread evenly over the half-sphere around `n` (a spherical Fibonacci lattice) and `n` itself, those nearest
/// to `d` first.
pub(crate) fn around(n: Vec3, d: Vec3) -> Vec<Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0f64.sqrt());
    let side = slerp(n, if n.x.abs() < 0.9 { Vec3::x() } else { Vec3::y() }, 1.0).cross(&n).normalize();
    let mut out = vec![n];
    for k in 0..ESCAPES {
        let cosine = 1.0 - (k as f64 + 0.5) / ESCAPES as f64;
        let tilted = rotate(n, side, libm::acos(cosine));
        out.push(rotate(tilted, n, golden * k as f64));
    }
    out.sort_by(|a, b| b.dot(&d).total_cmp(&a.dot(&d)));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comb::{CombKind, CombOp, comb};
    use crate::place::{PlaceSettings, Placement, place};
    use crate::test_skin::TestSkin;

    const SETTINGS: PushUp = PushUp { step: 0.1, clearance: 0.05 };

    fn groomed(s: &TestSkin, length: f64) -> ControlHairs {
        let placement = Placement::Grid { u: 6, v: 6, even: false };
        let settings = PlaceSettings { placement, points: 8, length, ..PlaceSettings::default() };
        place(&s.skin(), &s.bvh, &settings).0
    }

    fn comb_toward(s: &TestSkin, hairs: &mut ControlHairs, d: Vec3, curvature: f64) {
        let points = vec![Vec3::zeros(), d];
        let kind = CombKind::DirectionCurve {
            points,
            radius: f64::INFINITY.into(),
            falloff: 0.0.into(),
            bend: 1.0.into(),
            curvature: curvature.into(),
        };
        comb(&s.skin(), &[], &[CombOp { kind, weight: 1.0.into(), region: None, side: None, only: None }], hairs);
    }

    /// Least signed distance of points every 0.1 along all hairs but their roots.
    fn deepest(s: &TestSkin, hairs: &ControlHairs) -> f64 {
        let mut least = f64::INFINITY;
        for h in 0..hairs.len() {
            let line = world_points(&s.skin().frame(&hairs.root[h]), hairs.hair(h));
            for w in line.windows(2) {
                let n = ((w[1] - w[0]).norm() / 0.1).ceil() as usize;
                for k in 1..=n {
                    let p = w[0] + (w[1] - w[0]) * (k as f64 / n as f64);
                    least = least.min(s.bvh.closest(p, f64::INFINITY).unwrap().signed_distance);
                }
            }
        }
        least
    }

    #[test]
    fn none_is_left_inside_a_bumpy_sphere_and_lengths_stay() {
        let s = TestSkin::new(32, 16, 1.5);
        for (d, curvature) in [(-Vec3::y(), 0.0), (Vec3::new(1.0, -0.5, 0.2), 0.4)] {
            let mut hairs = groomed(&s, 9.0);
            comb_toward(&s, &mut hairs, d, curvature);
            assert!(deepest(&s, &hairs) < -1.0);
            let before = hairs.clone();
            let counts = push_up(&s.skin(), &s.bvh, &SETTINGS, &mut hairs);
            assert_eq!(counts.uncleared, 0);
            assert!(counts.pushed > 10 && counts.pushed < hairs.len(), "{counts:?}");
            assert!(deepest(&s, &hairs) > 0.0, "{}", deepest(&s, &hairs));
            for h in 0..hairs.len() {
                assert!((hairs.length(h) - before.length(h)).abs() < 1e-5);
            }
            // A second push-up finds nothing to do.
            let done = hairs.clone();
            assert_eq!(push_up(&s.skin(), &s.bvh, &SETTINGS, &mut hairs), PushCounts::default());
            assert_eq!(done, hairs);
        }
    }

    #[test]
    fn clear_hairs_stay_byte_for_byte() {
        let s = TestSkin::new(32, 16, 1.0);
        let mut hairs = groomed(&s, 3.0);
        let before = hairs.clone();
        assert_eq!(push_up(&s.skin(), &s.bvh, &SETTINGS, &mut hairs), PushCounts::default());
        assert_eq!(before, hairs);
    }

    #[test]
    fn a_hair_is_turned_no_more_than_needed() {
        // On a plain sphere, hairs combed straight in end up grazing it: every pushed vertex stays near the clearance.
        let s = TestSkin::new(64, 32, 0.0);
        let mut hairs = groomed(&s, 6.0);
        comb_toward(&s, &mut hairs, -Vec3::y(), 0.0);
        push_up(&s.skin(), &s.bvh, &SETTINGS, &mut hairs);
        let mut grazing = 0;
        for h in 0..hairs.len() {
            let f = s.skin().frame(&hairs.root[h]);
            if f.n.y > 0.8 {
                let line = world_points(&f, hairs.hair(h));
                let far = line.iter().map(|p| p.norm() - 10.0).fold(0.0, f64::max);
                // A straight segment of 6/7 that just clears a sphere of 10 at its middle ends 0.04 above that.
                assert!(far < 0.35, "{far}");
                grazing += 1;
            }
        }
        assert!(grazing > 5);
    }

    #[test]
    fn a_closed_room_is_reported() {
        // Inside out: outside of this skin is the inside of the sphere, where a hair of 30 finds no room.
        let mut s = TestSkin::new(24, 12, 0.0);
        s.mesh.triangle.iter_mut().for_each(|t| t.swap(1, 2));
        s.mesh.corner_uv.iter_mut().for_each(|t| t.swap(1, 2));
        s.topology = pelage_geom::Topology::new(&s.mesh);
        s.rest = pelage_geom::Pose::new(&s.mesh, &s.topology, s.mesh.position.clone());
        s.bvh = Bvh::build(&s.mesh.position, &s.mesh.triangle, &s.topology);
        let mut hairs = groomed(&s, 30.0);
        let counts = push_up(&s.skin(), &s.bvh, &SETTINGS, &mut hairs);
        assert!(counts.pushed == hairs.len() && counts.uncleared <= hairs.len());
        assert!((0..hairs.len()).all(|h| (hairs.length(h) - 30.0).abs() < 1e-4));
        // Eight points bend enough to stay in a room of 20 across.
        assert!(deepest(&s, &hairs) > 0.0 || counts.uncleared > 0);
    }
}
