//! Clumping: hairs are drawn toward the centre hair of their clump.
//!
//! Production-pipeline paper §4.2.1, for control vertex i of 3 that move: `delta = percent (f + rate (1 - f))` with
//! f = i / 3, and `p += delta (centre - p)`. That formula was made for hairs of four points: taken at more points it does
//! not vanish at the root. So it is evaluated at the paper's four stations, with 0 at the root, and continued between
//! them: beyond the first third it is the formula itself, below it the parabola that meets it with its slope at rate 1
//! (and stays the straight line at rate 0). `delta` stays within 0 and 1, grows along the hair at every rate, and is
//! smooth.

use super::axes::{self, RootAxes};
use super::lanes::{Kernel, LANES, Lanes, fetch, run};
use super::member::Members;
use super::{CHUNK, Param, V3, at_station, lengths, relay, station_weights};
use pelage_geom::rng::{channel, uniform};
use pelage_geom::{NONE, StrandId};
use rayon::prelude::*;

/// A level of clumps as it acts on hairs. N hairs, C clumps.
#[derive(Clone, Copy, Debug)]
pub struct Clump<'a> {
    /// \[N\] clump of each hair, or [`NONE`].
    pub clump: &'a [u32],
    /// \[N\] where a hair stands in its clump: 0 at the centre, 1 at the rim.
    pub reach: &'a [f32],
    /// \[C\] hair that is the centre, and stays; [`NONE`] if the centre line is not a hair.
    pub centre: &'a [u32],
    /// How far tips come to the centre's tip: 0 not at all, 1 all the way.
    pub percent: Param<'a>,
    /// How early along the hair they come: 0 evenly from root to tip, 1 all within the first third.
    pub rate: Param<'a>,
    /// How much less hairs at the rim are drawn than those at the centre, 0 to 1.
    pub falloff: Param<'a>,
    /// How far tips leave the centre again, each at random between 0 and this, as a share of the way that they came.
    pub splay: Param<'a>,
    /// Turns around the centre from root to tip at percent 1, each hair at random between minus and plus this.
    pub weave: Param<'a>,
    /// Where along the hair it happens: l is replaced by l^(4^taper). Above 0 clumps stay wide until near the tip, below
    /// they are narrow from the root on.
    pub taper: f32,
    /// \[C\] size of the clump's cross-section at a quarter, half, three quarters of the hair and its tip, relative to that
    /// at the root (streamlines paper §4.5): replaces the rate. Empty: the formula.
    pub dilation: &'a [[f32; 4]],
    /// Distance from the centre's line up to which it holds a hair, scene units; hair beyond it is held less, and at twice
    /// the distance not at all, from there to the tip. Infinity: at any distance, as in the paper.
    pub hold: f32,
    /// Keep the lengths of segments instead of the points where the formula puts them.
    pub keep_length: bool,
    /// \[N\] names of the hairs.
    pub id: &'a [StrandId],
    /// With the hair's name keys its random numbers.
    pub seed: u64,
}

/// Centre lines of clumps, C times P points: the hairs as they are before this level acts.
pub fn centre_lines(points: usize, position: &[[f32; 3]], centre: &[u32]) -> Vec<[f32; 3]> {
    centre.iter().flat_map(|&h| &position[h as usize * points..][..points]).copied().collect()
}

/// `delta` at the points of a hair for percent 1, as `a + rate b`.
fn profile(points: usize, taper: f32) -> Vec<[f32; 2]> {
    let power = libm::exp2(2.0 * f64::from(taper));
    let at = |k: usize| {
        let l = k as f64 / (points - 1) as f64;
        let l = if taper == 0.0 { l } else { libm::pow(l, power) };
        [l as f32, delta_of_rate(l) as f32]
    };
    (0..points).map(at).collect()
}

/// What rate 1 adds to the straight line at `l`.
fn delta_of_rate(l: f64) -> f64 {
    let below = 1.0 - 3.0 * l;
    if below > 0.0 { 1.0 - below * below - l } else { 1.0 - l }
}

/// Where splay acts: 0 up to the middle of the hair, 1 at its tip.
fn splayed(points: usize) -> Vec<f32> {
    let at = |k: usize| (2.0 * k as f32 / (points - 1) as f32 - 1.0).max(0.0);
    (0..points).map(|k| at(k) * at(k)).collect()
}

/// Draws hairs of `points` points toward the lines of their clumps ([`centre_lines`]). A hair with percent 0, without a
/// clump, or a centre itself keeps its bytes; percent 1 at rate 0 brings a tip onto the centre's exactly.
pub fn clump(points: usize, c: &Clump, line: &[[f32; 3]], position: &mut [[f32; 3]]) {
    let each = |v: Vec<f32>| -> Vec<f32> { v.iter().flat_map(|x| [*x; 3]).collect() };
    let profile = profile(points, c.taper);
    let straight = each(profile.iter().map(|p| p[0]).collect());
    let bent = each(profile.iter().map(|p| p[1]).collect());
    let (splay, stations) = (each(splayed(points)), station_weights(5, points));
    position.par_chunks_mut(CHUNK * points).enumerate().for_each(|(chunk, hairs)| {
        let first = chunk * CHUNK;
        let along = Along { straight: &straight, bent: &bent, splay: &splay };
        run(Chunk { clump: c, line, along, stations: &stations, points, first, hairs });
    });
}

/// Hairs before its turn that the line of a hair's clump is asked for. Below about 4 it comes too late; above some
/// hundred it may be gone again.
const AHEAD: usize = 12;

/// What acts at the points of every hair, for each of a point's three coordinates.
#[derive(Clone, Copy)]
struct Along<'a> {
    /// `delta` at rate 0.
    straight: &'a [f32],
    /// What rate 1 adds.
    bent: &'a [f32],
    splay: &'a [f32],
}

/// How one hair is drawn.
#[derive(Clone, Copy)]
struct Draw<'a> {
    percent: f32,
    rate: f32,
    open: f32,
    line: &'a [f32],
    along: Along<'a>,
}

impl Draw<'_> {
    /// Draws a hair toward the line, as many of its numbers at a time as there are lanes; its root stays.
    #[inline(always)]
    fn run<L: Lanes>(&self, hair: &mut [f32]) {
        let n = hair.len();
        if n < 3 + LANES {
            let a = &self.along;
            for (k, x) in hair.iter_mut().enumerate().skip(3) {
                let d = self.percent * (a.straight[k] + self.rate * a.bent[k]) * (1.0 - self.open * a.splay[k]);
                *x = *x * (1.0 - d) + self.line[k] * d;
            }
            return;
        }
        // The last numbers are read before those that they overlap with are written.
        let last = self.drawn::<L>(hair, n - LANES);
        for first in (3..n - LANES).step_by(LANES) {
            self.drawn::<L>(hair, first).write(hair[first..].first_chunk_mut().expect(WITHIN));
        }
        last.write(hair[n - LANES..].first_chunk_mut().expect(WITHIN));
    }

    /// Numbers of the hair from `first` on.
    #[inline(always)]
    fn drawn<L: Lanes>(&self, hair: &[f32], first: usize) -> L {
        let one = L::splat(1.0);
        let [straight, bent] = [at::<L>(self.along.straight, first), at(self.along.bent, first)];
        let splay = one - L::splat(self.open) * at(self.along.splay, first);
        let d = L::splat(self.percent) * (straight + L::splat(self.rate) * bent) * splay;
        // This form meets the centre at 1 without rounding.
        at::<L>(hair, first) * (one - d) + at::<L>(self.line, first) * d
    }
}

const WITHIN: &str = "as many numbers as lanes lie within the hair";

/// Numbers from `first` on.
#[inline(always)]
fn at<L: Lanes>(of: &[f32], first: usize) -> L {
    L::read(of[first..].first_chunk().expect(WITHIN))
}

/// Hairs that one task handles.
struct Chunk<'a> {
    clump: &'a Clump<'a>,
    /// Lines of the clumps.
    line: &'a [[f32; 3]],
    along: Along<'a>,
    /// Weights of the stations at each point.
    stations: &'a [Vec<f32>],
    points: usize,
    /// The first hair's index.
    first: usize,
    hairs: &'a mut [[f32; 3]],
}

impl Kernel for Chunk<'_> {
    type Out = ();
    // One hair after another: its numbers lie side by side already.
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let (c, points, along) = (self.clump, self.points, self.along);
        let (mut size_along, mut length) = (vec![0.0f32; 3 * points], Vec::new());
        let mut held = [vec![0.0f32; 3 * points], vec![0.0f32; 3 * points]];
        for (h, hair) in (self.first..).zip(self.hairs.chunks_exact_mut(points)) {
            // Lines lie anywhere in memory: without this, hairs of few points wait for them.
            if let Some(&own) = c.clump.get(h + AHEAD).filter(|own| **own != NONE) {
                fetch(self.line[own as usize * points..][..points].as_flattened());
            }
            let own = c.clump[h];
            if own == NONE || c.centre[own as usize] as usize == h {
                continue;
            }
            let percent = c.percent.of(h).clamp(0.0, 1.0) * (1.0 - c.falloff.of(h).clamp(0.0, 1.0) * c.reach[h]);
            if percent == 0.0 {
                continue;
            }
            if c.keep_length {
                lengths(hair, &mut length);
            }
            let mut open = c.splay.of(h).clamp(0.0, 1.0);
            if open != 0.0 {
                open *= uniform(c.seed, c.id[h], channel("clump splay"), 0) as f32;
            }
            let line = &self.line[own as usize * points..][..points];
            let mut draw = Draw { percent, rate: c.rate.of(h).clamp(0.0, 1.0), open, line: line.as_flattened(), along };
            if let Some(d) = c.dilation.get(own as usize) {
                let size = [1.0, d[0], d[1], d[2], d[3]];
                for (x, w) in size_along.chunks_exact_mut(3).zip(self.stations) {
                    x.fill(1.0 - at_station(w, &size));
                }
                draw = Draw { rate: 0.0, along: Along { straight: &size_along, ..along }, ..draw };
            }
            if c.hold < f32::INFINITY {
                let [straight, bent] = &mut held;
                hold(hair, line, c.hold, &draw.along, straight, bent);
                draw.along = Along { straight, bent, ..draw.along };
            }
            draw.run::<L>(hair.as_flattened_mut());
            let weave = c.weave.of(h);
            if weave != 0.0 {
                let turns = percent * weave * (2.0 * uniform(c.seed, c.id[h], channel("clump weave"), 0) - 1.0) as f32;
                wind_around(hair, line, turns);
            }
            if c.keep_length {
                relay(hair, &length);
            }
        }
    }
}

/// What acts along a hair, less where it is farther from its line than `reach`, and from there on.
fn hold(hair: &[[f32; 3]], line: &[[f32; 3]], reach: f32, along: &Along, straight: &mut [f32], bent: &mut [f32]) {
    let mut held = 1.0f32;
    for (k, (p, q)) in hair.iter().zip(line).enumerate() {
        let beyond = ((V3::from(*p) - V3::from(*q)).norm() / reach - 1.0).clamp(0.0, 1.0);
        held = held.min(1.0 - beyond * beyond * (3.0 - 2.0 * beyond));
        straight[3 * k..3 * k + 3].fill(held * along.straight[3 * k]);
        bent[3 * k..3 * k + 3].fill(held * along.bent[3 * k]);
    }
}

/// Turns a hair around a line, more and more toward the tip.
fn wind_around(hair: &mut [[f32; 3]], line: &[[f32; 3]], turns: f32) {
    let last = line.len() - 1;
    for k in 1..=last {
        let along = V3::from(line[(k + 1).min(last)]) - V3::from(line[k - 1]);
        let n = along.norm();
        if n == 0.0 {
            continue;
        }
        let (sin, cos) = libm::sincosf(std::f32::consts::TAU * turns * k as f32 / last as f32);
        let (axis, q) = (along / n, V3::from(line[k]));
        let o = V3::from(hair[k]) - q;
        hair[k] = (q + o * cos + axis.cross(&o) * sin + axis * (axis.dot(&o) * (1.0 - cos))).into();
    }
}

/// Lines drawn by hand as centres: each rides on a hair (its `carrier`), point by point in that hair's axes, so that it
/// moves as the hair does. `drawn` holds C times P points (tangent, x, y) from the carrier's, see [`bind_lines`].
pub fn drawn_lines(
    points: usize,
    position: &[[f32; 3]],
    carrier: &[u32],
    axes: &[RootAxes],
    drawn: &[[f32; 3]],
) -> Vec<[f32; 3]> {
    in_carriers(points, position, carrier, axes, drawn, |p, [t, x, y], d| p + t * d[0] + x * d[1] + y * d[2])
}

/// Says lines at rest (C times P points) in the axes of their carriers at rest.
pub fn bind_lines(
    points: usize,
    position: &[[f32; 3]],
    carrier: &[u32],
    axes: &[RootAxes],
    line: &[[f32; 3]],
) -> Vec<[f32; 3]> {
    in_carriers(points, position, carrier, axes, line, |p, axes, q| {
        let from = V3::from(q) - p;
        V3::from(axes.map(|a| a.dot(&from)))
    })
}

/// Points of lines, each by the point of its carrier beside it and the axes there (tangent, x, y).
fn in_carriers(
    points: usize,
    position: &[[f32; 3]],
    carrier: &[u32],
    axes: &[RootAxes],
    line: &[[f32; 3]],
    point: impl Fn(V3, [V3; 3], [f32; 3]) -> V3,
) -> Vec<[f32; 3]> {
    let mut along = axes::Along::default();
    let mut out = Vec::with_capacity(line.len());
    for (&h, line) in carrier.iter().zip(line.chunks_exact(points)) {
        let hair = &position[h as usize * points..][..points];
        along.set(hair, &axes[h as usize]);
        for (k, q) in line.iter().enumerate() {
            let (t, x) = (along.tangent[k], along.normal[k]);
            out.push(point(V3::from(hair[k]), [t, x, t.cross(&x)], *q).into());
        }
    }
    out
}

/// Sizes of clumps from their root variables (streamlines paper §4.5): mean, deviation and scale at four stations.
pub fn dilations(r: &[f32], mean: [f32; 4], deviation: [f32; 4], scale: f32, key: u32) -> Vec<[f32; 4]> {
    let stations = super::wave::Stations { mean, deviation, scale: [scale; 4] };
    r.iter().map(|r| stations.at(key, *r).map(|x| x.max(0.0))).collect()
}

/// Multiplies each hair's factors on width and opacity by those of hair of percent 1, as far as it is clumped; the third
/// number is how wet it is by that, 0 to 1.
pub fn wet(c: &Clump, width: f32, opacity: f32, out: &mut [[f32; 3]]) {
    for (h, out) in out.iter_mut().enumerate().filter(|(h, _)| c.clump[*h] != NONE) {
        let percent = c.percent.of(h).clamp(0.0, 1.0);
        out[0] *= 1.0 + (width - 1.0) * percent;
        out[1] *= 1.0 + (opacity - 1.0) * percent;
        out[2] = 1.0 - (1.0 - out[2]) * (1.0 - percent);
    }
}

/// How far out on its clump each point of hairs of `points` points lies, and which way: its way from the same point of the
/// centre hair, over that of the farthest such point of the clump. Zero without a clump and on the centre.
pub fn sides(points: usize, position: &[[f32; 3]], members: &Members) -> Vec<[f32; 3]> {
    let way = |i: usize| {
        let c = members.clump[i / points];
        (c != NONE).then(|| {
            V3::from(position[i]) - V3::from(position[members.centre[c as usize] as usize * points + i % points])
        })
    };
    let mut far = vec![0.0f32; members.centre.len() * points];
    for i in 0..position.len() {
        if let Some(w) = way(i) {
            let far = &mut far[members.clump[i / points] as usize * points + i % points];
            *far = far.max(w.norm_squared());
        }
    }
    let side = |i: usize| {
        let w = way(i)?;
        let far = far[members.clump[i / points] as usize * points + i % points].sqrt();
        (far > 0.0).then(|| (w / far).into())
    };
    (0..position.len()).into_par_iter().map(|i| side(i).unwrap_or_default()).collect()
}
