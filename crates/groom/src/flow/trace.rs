//! Polylines that follow a field of directions: streamlines, guide hairs.
//!
//! Lines are followed by arc length with Runge-Kutta steps of fourth order; between the ends of a step runs a cubic
//! with the field's directions at both. Points are laid off on it with a pair of compasses: all chords of a line are
//! equal (to rounding) and add up to the length that was asked for, as hair that does not stretch needs it.

use crate::spline::hermite;
use pelage_geom::{Bvh, Vec3};
use rayon::prelude::*;

/// Chords that a line may run without getting one chord away from its last point before it counts as caught, as around
/// a sink. A half circle about the last point takes 3.2; higher only takes longer.
const CAUGHT: f64 = 5.0;

/// Least length of the mean direction of a step: below, the directions contradict each other (a turn by more than 120
/// degrees within a step), as at a sink or across a sheet where the field jumps.
const TORN: f64 = 0.5;

/// Rise of a guarded line from its start, per chord: where the clearance is not yet reached.
const RISE: f64 = 0.5;

/// How lines are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// P, the points of every line; at least 2.
    pub points: usize,
    /// Arc length of a step, scene units. Steps are at least 1/16 of and at most 16 chords long, and one chord if this
    /// is 0. At 1/5 of the field's radius of curvature a line goes off by 1e-5 of its length.
    pub step: f64,
    /// Against the field.
    pub reverse: bool,
    /// Speed of the field at or below which it gives no direction; 0 for nothing but rest.
    pub slow: f64,
}

/// Where a line begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Its first point.
    pub at: Vec3,
    /// Where it goes if the field gives no direction there, any length: the skin's normal.
    pub direction: Vec3,
    /// Length of the polyline, scene units. At 0 all points are the first.
    pub length: f64,
}

/// A closed surface that points of lines stay out of: the skin, or the panels where these lie above it (the flow below
/// them is that within the body).
#[derive(Clone, Copy, Debug)]
pub struct Guard<'a> {
    /// The surface.
    pub surface: &'a Bvh,
    /// Distance that points keep from it, except near the start, where it is at most half the length from there.
    pub clearance: f64,
}

/// H lines of P points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lines {
    /// P.
    pub points: usize,
    /// \[H * P\] points, line after line, scene units.
    pub at: Vec<Vec3>,
    /// \[H\] first point that went straight on because the field gave no direction before it; P if none did.
    pub straight_from: Vec<u32>,
}

impl Lines {
    /// Points of line `h`.
    pub fn line(&self, h: usize) -> &[Vec3] {
        &self.at[h * self.points..(h + 1) * self.points]
    }

    /// Number of lines that went straight on somewhere.
    pub fn stalled(&self) -> usize {
        self.straight_from.iter().filter(|&&k| (k as usize) < self.points).count()
    }
}

/// Follows the velocities `field(line, point)` from every start. Points that would be within the guard are put back
/// out, with the same distance to the point before.
pub fn trace(
    field: impl Fn(usize, Vec3) -> Vec3 + Sync,
    starts: &[Start],
    settings: &Trace,
    guard: Option<&Guard>,
) -> Lines {
    let points = settings.points.max(2);
    let mut at = vec![Vec3::zeros(); starts.len() * points];
    let straight_from = at
        .par_chunks_mut(points)
        .zip(starts)
        .enumerate()
        .map(|(h, (out, start))| trace_one(|p| field(h, p), start, settings, guard, out))
        .collect();
    Lines { points, at, straight_from }
}

/// Follows one line into `out`; returns the first point that went straight on, or the number of points.
pub fn trace_one(
    field: impl Fn(Vec3) -> Vec3,
    start: &Start,
    settings: &Trace,
    guard: Option<&Guard>,
    out: &mut [Vec3],
) -> u32 {
    out.fill(start.at);
    let points = out.len();
    let chord = start.length / (points.max(2) - 1) as f64;
    if !(chord > 0.0 && chord.is_finite()) {
        return points as u32;
    }
    let sign = if settings.reverse { -1.0 } else { 1.0 };
    let direction = |p: Vec3| {
        let v = field(p);
        let speed = v.norm();
        (speed > settings.slow && speed.is_finite()).then(|| v * (sign / speed))
    };
    let step = if settings.step > 0.0 { settings.step.clamp(chord / 16.0, chord * 16.0) } else { chord };
    let most_steps = (CAUGHT * chord / step) as usize + 2;
    let mut keeper = Keeper { guard, chord, free: 0.0 };
    let mut heading = start.direction.try_normalize(0.0).unwrap_or_else(Vec3::y);
    let (mut at, mut ahead) = (start.at, direction(start.at));
    let (mut k, mut steps) = (1, 0);
    while k < points {
        let Some(from) = ahead else { break };
        heading = from;
        let Some((to, next)) = runge_kutta(&direction, at, from, step) else { break };
        steps += 1;
        if steps > most_steps {
            break;
        }
        let arc = Arc { ends: [at, to], tangents: [from * step, next.unwrap_or(to - at) * step] };
        let (mut t, mut moved) = (0.0, None);
        while k < points && moved.is_none() && (to - out[k - 1]).norm() >= chord {
            let (laid, there) = arc.at_distance(out[k - 1], chord, t);
            t = there;
            let kept = keeper.keep(laid, out, k);
            moved = (kept != laid).then_some(kept);
            out[k] = kept;
            (k, steps) = (k + 1, 0);
        }
        (at, ahead) = match moved {
            Some(p) => (p, direction(p)),
            None => (to, next),
        };
    }
    let straight_from = k;
    while k < points {
        out[k] = keeper.keep(out[k - 1] + heading * chord, out, k);
        k += 1;
    }
    straight_from as u32
}

/// A step of fourth order from a point and its direction: the next point and the direction there; none if there is no
/// direction on the way.
fn runge_kutta(
    direction: &impl Fn(Vec3) -> Option<Vec3>,
    at: Vec3,
    first: Vec3,
    step: f64,
) -> Option<(Vec3, Option<Vec3>)> {
    let second = direction(at + first * (0.5 * step))?;
    let third = direction(at + second * (0.5 * step))?;
    let fourth = direction(at + third * step)?;
    let mean = (first + (second + third) * 2.0 + fourth) / 6.0;
    let to = at + mean * step;
    (mean.norm_squared() > TORN * TORN).then(|| (to, direction(to)))
}

/// A cubic between two points.
struct Arc {
    ends: [Vec3; 2],
    tangents: [Vec3; 2],
}

impl Arc {
    fn at(&self, t: f64) -> Vec3 {
        hermite(self.ends[0], self.tangents[0], self.ends[1], self.tangents[1], t)
    }

    /// First place beyond `t` at a distance from a point that is nearer at `t` and not at the end: regula falsi,
    /// Illinois variant. Moved along the line to the point onto that distance.
    fn at_distance(&self, from: Vec3, distance: f64, t: f64) -> (Vec3, f64) {
        let off = |t: f64| (self.at(t) - from).norm() - distance;
        let (mut low, mut high) = ((t, off(t)), (1.0, off(1.0)));
        let mut last_low = None;
        for _ in 0..40 {
            if high.1 <= 1e-9 * distance {
                break;
            }
            let guess = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let guess = if guess > low.0 && guess < high.0 { guess } else { 0.5 * (low.0 + high.0) };
            let here = off(guess);
            let is_low = here < -1e-9 * distance;
            let again = last_low == Some(is_low);
            last_low = Some(is_low);
            if is_low {
                low = (guess, here);
                high.1 *= if again { 0.5 } else { 1.0 };
            } else {
                high = (guess, here);
                low.1 *= if again { 0.5 } else { 1.0 };
            }
        }
        let way = self.at(high.0) - from;
        (from + way * (distance / way.norm()), high.0)
    }
}

/// Keeps points out of the guard.
struct Keeper<'a> {
    guard: Option<&'a Guard<'a>>,
    chord: f64,
    /// Length that is sure to be free from the last point on.
    free: f64,
}

impl Keeper<'_> {
    /// Point `k` of a line whose points before it stand, moved out if it has to.
    fn keep(&mut self, at: Vec3, line: &[Vec3], k: usize) -> Vec3 {
        let Some(guard) = self.guard else { return at };
        self.free -= self.chord;
        if self.free > 0.0 {
            return at;
        }
        let clearance = guard.clearance.min(RISE * self.chord * k as f64);
        let from = line[k - 1];
        let along = if k > 1 { from - line[k - 2] } else { at - from };
        let mut p = at;
        // The surface as a plane across the way out: the chord is turned until it ends at the clearance above it.
        for _ in 0..12 {
            let Some((distance, out)) = guard.nearest(p) else { return p };
            if distance >= clearance * (1.0 - 1e-6) {
                self.free = distance - guard.clearance;
                return p;
            }
            self.free = 0.0;
            let rise = ((p - from).dot(&out) + clearance - distance).clamp(-self.chord, self.chord);
            let flat = |v: Vec3| (v - out * v.dot(&out)).try_normalize(1e-3 * self.chord);
            // A line that runs straight into the surface goes on as it came.
            let flat = flat(p - from).or_else(|| flat(along)).unwrap_or_else(|| any_across(out));
            p = from + out * rise + flat * (self.chord * self.chord - rise * rise).sqrt();
        }
        p
    }
}

/// A unit vector across another.
fn any_across(v: Vec3) -> Vec3 {
    v.cross(&Vec3::ith(v.iamin(), 1.0)).normalize()
}

impl Guard<'_> {
    /// Signed distance from the surface and the direction away from it.
    fn nearest(&self, at: Vec3) -> Option<(f64, Vec3)> {
        let s = self.surface;
        let c = if s.is_folded() { s.closest_outside(at, f64::INFINITY) } else { s.closest(at, f64::INFINITY) }?;
        let away = (at - c.position) * c.signed_distance.signum();
        Some((c.signed_distance, away.try_normalize(1e-9).unwrap_or(c.normal)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::Element;

    const TRACE: Trace = Trace { points: 41, step: 0.0, reverse: false, slow: 0.0 };

    fn start(at: Vec3, length: f64) -> Start {
        Start { at, direction: Vec3::y(), length }
    }

    fn chords(line: &[Vec3]) -> Vec<f64> {
        line.windows(2).map(|w| (w[1] - w[0]).norm()).collect()
    }

    #[test]
    fn around_a_vortex_lines_are_circles_of_fourth_order() {
        let vortex = Element::Vortex { at: Vec3::zeros(), axis: Vec3::z(), strength: 1.0, core: 0.0 };
        let field = |_: usize, p: Vec3| vortex.velocity(p);
        let off = |step: f64| {
            let lines = trace(field, &[start(Vec3::x(), 5.0)], &Trace { step, ..TRACE }, None);
            assert!(chords(&lines.at).iter().all(|c| (c - 0.125).abs() < 1e-14));
            assert_eq!((lines.straight_from[0], lines.stalled()), (41, 0));
            let tip = lines.at[40];
            // Where 40 chords of 1/8 end on the unit circle.
            let angle = 80.0 * libm::asin(0.0625);
            (tip - Vec3::new(libm::cos(angle), libm::sin(angle), 0.0)).norm()
        };
        let (coarse, fine) = (off(0.25), off(0.125));
        println!("radius 1, length 5: step 0.25 {coarse:.1e}, 0.125 {fine:.1e}");
        assert!(coarse < 1e-4 && fine < coarse / 10.0);
    }

    #[test]
    fn back_is_the_way_that_was_come() {
        let elements = [
            Element::Stream { velocity: Vec3::new(0.2, -1.0, 0.0) },
            Element::Source { at: Vec3::new(0.3, -2.0, 0.4), strength: 4.0, core: 0.0 },
        ];
        let field = |_: usize, p: Vec3| elements.iter().fold(Vec3::zeros(), |v, e| v + e.velocity(p));
        let there = trace(field, &[start(Vec3::y(), 4.0)], &TRACE, None);
        let back = trace(field, &[start(there.at[40], 4.0)], &Trace { reverse: true, ..TRACE }, None);
        assert!((back.at[40] - Vec3::y()).norm() < 1e-5);
        assert!((there.at[20] - back.at[20]).norm() < 1e-5);
    }

    #[test]
    fn where_the_field_rests_lines_go_straight_on() {
        // A stream against itself: rest at y = 0.
        let to_rest = |_: usize, p: Vec3| Vec3::new(0.0, -p.y.max(0.0), 0.0);
        let lines = trace(to_rest, &[start(Vec3::y() * 2.0, 4.0)], &TRACE, None);
        assert!((20..=22).contains(&lines.straight_from[0]) && lines.stalled() == 1);
        assert!((lines.at[40] + Vec3::y() * 2.0).norm() < 1e-9);
        // No field at all: along the start's direction; not a number neither.
        for v in [0.0, f64::NAN] {
            let lines = trace(|_, _| Vec3::repeat(v), &[start(Vec3::x(), 4.0)], &TRACE, None);
            assert_eq!(lines.straight_from[0], 1);
            assert!((lines.at[40] - Vec3::new(1.0, 4.0, 0.0)).norm() < 1e-12);
        }
        // A sink catches lines.
        let sink = Element::Source { at: Vec3::zeros(), strength: -1.0, core: 0.0 };
        let lines = trace(|_, p| sink.velocity(p), &[start(Vec3::new(0.011, 2.0, 0.0), 4.0)], &TRACE, None);
        assert!((15..=25).contains(&lines.straight_from[0]));
        assert!(chords(&lines.at).iter().all(|c| (c - 0.1).abs() < 1e-14));
        // Nothing to follow.
        for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(trace(to_rest, &[start(Vec3::x(), length)], &TRACE, None).at, vec![Vec3::x(); 41]);
        }
    }

    #[test]
    fn guarded_points_slide_along_the_surface() {
        let mesh = pelage_geom::shapes::cube_sphere(12, 1.0);
        let bvh = Bvh::build(&mesh.position, &mesh.triangle, &pelage_geom::Topology::new(&mesh));
        let guard = Guard { surface: &bvh, clearance: 0.02 };
        // Straight down through a sphere, off its centre, from on it and from above it.
        let starts: Vec<Start> = (0..40)
            .map(|k| Vec3::new(0.02 * f64::from(k) + 0.003, 1.0, 0.1))
            .map(|d| start(d.normalize() * if d.x < 0.4 { 1.0 } else { 1.7 }, 3.0))
            .collect();
        let lines = trace(|_, _| -Vec3::y(), &starts, &TRACE, Some(&guard));
        let distance = |p: &Vec3| bvh.closest(*p, f64::INFINITY).map_or(0.0, |c| c.signed_distance);
        for h in 0..starts.len() {
            let line = lines.line(h);
            let least = line[1..].iter().map(distance).fold(f64::INFINITY, f64::min);
            assert!(least > 0.02 * 0.999, "{h}: {least}");
            assert!(chords(line).iter().all(|c| (c - 0.075).abs() < 1e-14));
            // It gets around.
            assert!(line[40].y < -0.3, "{h}: {}", line[40]);
        }
        let through = trace(|_, _| -Vec3::y(), &starts, &TRACE, None);
        assert!(through.at.iter().map(distance).fold(0.0, f64::min) < -0.5);
    }
}
