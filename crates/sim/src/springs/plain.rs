//! The mass-spring model of one strand, scalar: energy, gradient and tangent (sections 3.1, 3.2, 4.1).
//!
//! The reference for the lane kernel. A spring's energy is `k/2 l0 (l/l0 - 1)^2`, its force `k (l/l0 - 1)` as in section
//! 4.1, `k` in newtons. An altitude spring's is `K/2 e^2` (more where it is nearly flat, [`HALF`]) with the strain `e = h s/h0 - rest + carried`: `h0` the
//! rest height of the altitude in use, `s` the sign of the rest tetrahedron, `rest` 1 (less for tetrahedra nearly flat at
//! rest), and `carried` what keeps the energy continuous when the altitude changes.

use super::calibrate::{Calibration, Section};
use super::layout::Layout;
use super::tetrahedron::{CANDIDATES, TINY, largest, turns, volume};
use crate::Vec3;
use nalgebra::Matrix3;
use pelage_geom::NONE;

/// Share of a segment's mass that its extra particle carries, taken from the segment's ends: the hair's mass stays. At
/// 0.1 the extra particles' weight off the axis and their inertia in twisting show (first twisting frequency of a 20 cm
/// hair: 300 Hz at 1e-3, 30 Hz at 0.1); nothing is
/// gained below.
pub const EXTRA_MASS: f64 = 1e-3;

/// A tetrahedron whose least altitude at rest is below this fraction of its size is measured against this instead:
/// strains of a flat one would be infinite. Larger values soften good tetrahedra (a straight hair's are at 0.4).
pub const FLAT: f64 = 0.05;

/// Strain below which an altitude spring is [`FIRM`] times as stiff: a tetrahedron that is nearly flat or inverted. Bent
/// hair stays above (a hinge of 0.5 rad: -0.4); with the soft constant alone inverted tetrahedra stay so, held by the
/// torsion springs' other rest state.
pub const HALF: f64 = -0.5;

/// How much stiffer altitude springs are below [`HALF`]: then as stiff as torsion springs.
pub const FIRM: f64 = 10.0;

/// The altitude in use changes when another's `|u x v|` is this much larger, squared (20 %). Nearer 1 the two equal
/// altitudes of a straight hair take turns for ever; the larger, the farther are weights from the paper's 0 to 1.
pub const HYSTERESIS: f64 = 1.44;

/// Squared sine below which four particles count as colinear.
pub const COLINEAR: f64 = 1e-10;

/// A colinear tetrahedron's last particle is moved off the line by this fraction of the tetrahedron's length, so that the
/// altitude has a direction, orthogonal to the line.
pub const NUDGE: f64 = 3e-5;

/// Least `1 - l0 / l` of a bending or torsion spring that its tangent's geometric term follows.
pub const LOWEST: f64 = -0.5;

/// A length too small for any edge: gives the springs between coincident particles a direction, an axis each.
pub const COINCIDENT: f64 = 1e-100;

/// A spring to an earlier particle; stiffness 0 where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spring {
    /// `k / l0`, newtons per metre.
    pub stiffness: f64,
    /// Rest length `l0`, metres.
    pub length: f64,
}

/// The altitude spring of the four particles that end at one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tetrahedron {
    /// `K`, joules; 0 where there is none.
    pub stiffness: f64,
    /// `s / h0` of each candidate, per metre.
    pub inverse_height: [f64; CANDIDATES],
    /// Strain is measured from this.
    pub rest: f64,
}

/// Which altitude is in use: state of a tetrahedron.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choice {
    /// The candidate.
    pub candidate: u8,
    /// Strain carried over changes.
    pub carried: f64,
}

/// Constants of a strand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// Masses, kilograms.
    pub mass: Vec<f64>,
    /// Particles whose position is prescribed.
    pub held: Vec<bool>,
    /// Point of the hair that a particle is, or [`NONE`].
    pub point: Vec<u32>,
    /// True for extra particles, off the axis.
    pub extra: Vec<bool>,
    /// Springs from particle `i` to `i - 1`, `i - 2`, `i - 3`.
    pub spring: Vec<[Spring; 3]>,
    /// Altitude springs of particles `i - 3 ..= i`.
    pub tetrahedron: Vec<Tetrahedron>,
    /// Relaxation time of bending and twisting, seconds.
    pub damping: f64,
}

impl Model {
    /// Model whose natural shape is `layout`.
    pub fn new(layout: &Layout, section: &Section, calibration: &Calibration) -> Model {
        let n = layout.position.len();
        let constants = Constants { layout, section, calibration };
        let mut model = Model {
            mass: masses(layout, section.line_density),
            held: layout.held.clone(),
            point: layout.point.clone(),
            extra: layout.extra.clone(),
            spring: vec![[Spring::default(); 3]; n],
            tetrahedron: vec![Tetrahedron::default(); n],
            damping: section.damping,
        };
        for i in 0..n {
            for k in 1..=3.min(i) {
                if layout.held[i] && layout.held[i - k] {
                    continue;
                }
                let length = (layout.position[i] - layout.position[i - k]).norm();
                let constant = match k {
                    1 => section.stretching,
                    2 => constants.second(i),
                    _ => constants.third(i),
                };
                model.spring[i][k - 1] = Spring { stiffness: constant / length, length };
            }
            if i >= 3 {
                let constant = calibration.altitude * constants.third(i);
                model.tetrahedron[i] = Tetrahedron::at_rest(corners(&layout.position, i), constant);
            }
        }
        model
    }

    /// Choices at rest.
    pub fn choices(&self) -> Vec<Choice> {
        let first = |t: &Tetrahedron| {
            // inverse_height is proportional to |u x v|.
            let candidate = largest(&t.inverse_height.map(|v| v * v)) as u8;
            Choice { candidate, carried: 0.0 }
        };
        self.tetrahedron.iter().map(first).collect()
    }
}

/// Positions of the tetrahedron that ends at particle `i`, vertex 0 first.
pub(crate) fn corners(x: &[Vec3], i: usize) -> [Vec3; 4] {
    [x[i], x[i - 1], x[i - 2], x[i - 3]]
}

impl Tetrahedron {
    fn at_rest(x: [Vec3; 4], constant: f64) -> Tetrahedron {
        let v = volume(x);
        let areas = v.areas_squared().map(f64::sqrt);
        let widest = areas.iter().fold(0.0_f64, |a, &b| a.max(b));
        let size = (x[0] - x[3]).norm().max((x[1] - x[2]).norm());
        let reference = v.value.abs().max(FLAT * size * widest);
        let sign = if v.value < 0.0 { -1.0 } else { 1.0 };
        Tetrahedron {
            stiffness: constant * reference / widest,
            // A candidate that is far from the least altitude at rest counts as one of moderate height.
            inverse_height: areas.map(|a| sign * a.max(0.05 * widest) / reference),
            rest: v.value.abs() / reference,
        }
    }
}

fn masses(layout: &Layout, line_density: f64) -> Vec<f64> {
    let n = layout.position.len();
    let mut mass = vec![0.0; n];
    let axis: Vec<usize> = (0..n).filter(|&i| !layout.extra[i]).collect();
    for w in axis.windows(2) {
        let m = line_density * (layout.position[w[1]] - layout.position[w[0]]).norm();
        let ghost = layout.point[w[0]] == NONE || layout.point[w[1]] == NONE;
        let extra = if w[1] == w[0] + 2 { EXTRA_MASS * m } else { 0.0 };
        if w[1] == w[0] + 2 {
            mass[w[0] + 1] = extra;
        }
        for &i in w {
            // A ghost segment weighs nothing on the hair; its own particles get a mass that no one feels.
            if !ghost || layout.point[i] == NONE {
                mass[i] += 0.5 * (m - extra);
            }
        }
    }
    mass
}

/// Constants of springs, newtons.
struct Constants<'a> {
    layout: &'a Layout,
    section: &'a Section,
    calibration: &'a Calibration,
}

impl Constants<'_> {
    /// The axis particle before or after `h`.
    fn neighbour(&self, h: usize, after: bool) -> Option<usize> {
        let step =
            |i: usize| if after { Some(i + 1).filter(|&j| j < self.layout.extra.len()) } else { i.checked_sub(1) };
        let next = step(h)?;
        if self.layout.extra[next] { step(next) } else { Some(next) }
    }

    /// Length of hair that the hinge at axis particle `h` stands for, and the axis' direction there: half of each real
    /// segment, so a clamp's hinge is twice as stiff.
    fn hinge(&self, h: usize) -> (f64, Vec3) {
        let (mut length, mut along) = (0.0, Vec3::zeros());
        for after in [false, true] {
            if let Some(j) = self.neighbour(h, after) {
                let d = (self.layout.position[j] - self.layout.position[h]) * if after { 1.0 } else { -1.0 };
                along += d;
                if self.layout.point[j] != NONE && self.layout.point[h] != NONE {
                    length += 0.5 * d.norm();
                }
            }
        }
        // Between a ghost and another ghost nothing moves; any length will do.
        (if length > 0.0 { length } else { along.norm() }, along.normalize())
    }

    /// `stiffness l0^3 / (length row^2)`, at most ten times what it is on a straight hair: where a triangle is nearly
    /// flat a spring can't give the stiffness, and would only make the rest stiff.
    fn against(&self, stiffness: f64, length: f64, l0: f64, row2: f64) -> f64 {
        let most = 10.0 * 12.0 / 3f64.sqrt() * stiffness / (length * length);
        if row2 * most * length > stiffness * l0 * l0 * l0 { stiffness * l0 * l0 * l0 / (length * row2) } else { most }
    }

    /// From `i - 2` to `i`: the axis itself over an extra particle, else a bending spring.
    fn second(&self, i: usize) -> f64 {
        let (x, extra) = (&self.layout.position, &self.layout.extra);
        if extra[i - 1] {
            return self.section.stretching;
        }
        let (length, along) = self.hinge(i - 1);
        let area = (x[i - 2] - x[i - 1]).cross(&(x[i] - x[i - 1]));
        let l0 = (x[i] - x[i - 2]).norm();
        if extra[i] && extra[i - 2] {
            let row = area.dot(&along);
            self.calibration.bending * self.against(self.section.bending, length, l0, row * row)
        } else {
            self.against(self.section.bending, length, l0, area.norm_squared())
        }
    }

    /// From `i - 3` to `i`: bends the hinge between the two, or twists the segment between the two.
    fn third(&self, i: usize) -> f64 {
        let (x, extra) = (&self.layout.position, &self.layout.extra);
        let l0 = (x[i] - x[i - 3]).norm();
        let about = |h: usize| (x[i - 3] - x[h]).cross(&(x[i] - x[h]));
        if extra[i - 2] || extra[i - 1] {
            let h = if extra[i - 2] { i - 1 } else { i - 2 };
            let (length, _) = self.hinge(h);
            let factor = self.calibration.torsion;
            factor * self.against(self.section.bending, length, l0, about(h).norm_squared())
        } else {
            let middle = x[i - 1] - x[i - 2];
            let row = about(i - 2).dot(&middle) / middle.norm();
            self.against(self.section.twisting, middle.norm(), l0, row * row)
        }
    }
}

/// Direction and length of a spring from `i - k` to `i`.
fn direction(x: &[Vec3], i: usize, k: usize) -> (Vec3, f64) {
    let mut d = x[i] - x[i - k];
    d[k - 1] += COINCIDENT;
    let length = d.norm();
    (d / length, length)
}

/// Strain, direction and weights of the altitude spring at `i`.
fn altitude(model: &Model, choices: &[Choice], x: &[Vec3], i: usize) -> (f64, Vec3, [f64; 4]) {
    let (t, c) = (&model.tetrahedron[i], &choices[i]);
    let (h, n, w) = volume(corners(x, i)).altitude(c.candidate as usize);
    (h * t.inverse_height[c.candidate as usize] - t.rest + c.carried, n, w)
}

/// Energy of an altitude spring of constant 1, its derivative in the strain, and the second.
fn altitude_law(strain: f64) -> (f64, f64, f64) {
    let below = (strain - HALF).min(0.0);
    let energy = 0.5 * (strain * strain + (FIRM - 1.0) * below * below);
    (energy, (FIRM - 1.0).mul_add(below, strain), if strain < HALF { FIRM } else { 1.0 })
}

/// Elastic energy, joules.
pub fn energy(model: &Model, choices: &[Choice], x: &[Vec3]) -> f64 {
    let mut sum = 0.0;
    for i in 0..x.len() {
        for k in 1..=3.min(i) {
            let s = &model.spring[i][k - 1];
            let stretch = direction(x, i, k).1 - s.length;
            sum += 0.5 * s.stiffness * stretch * stretch;
        }
        if i >= 3 {
            let strain = altitude(model, choices, x, i).0;
            sum += model.tetrahedron[i].stiffness * altitude_law(strain).0;
        }
    }
    sum
}

/// Gradient of the energy: minus the forces, newtons.
pub fn gradient(model: &Model, choices: &[Choice], x: &[Vec3]) -> Vec<Vec3> {
    let mut g = vec![Vec3::zeros(); x.len()];
    for i in 0..x.len() {
        for k in 1..=3.min(i) {
            let s = &model.spring[i][k - 1];
            let (d, length) = direction(x, i, k);
            let f = d * (s.stiffness * (length - s.length));
            g[i] += f;
            g[i - k] -= f;
        }
        if i >= 3 {
            let (strain, n, w) = altitude(model, choices, x, i);
            let t = &model.tetrahedron[i];
            let f = t.stiffness * altitude_law(strain).1 * t.inverse_height[choices[i].candidate as usize];
            for k in 0..4 {
                g[i - k] += n * (f * w[k]);
            }
        }
    }
    g
}

/// Block row `i` of a tangent: blocks `[i][k]` couple particle `i` with `i - k`.
pub type Tangent = Vec<[Matrix3<f64>; 4]>;

/// Tangent. Of a spring `k/l0 (d d^T + a (I - d d^T))` with `a = 1 - l0/l`, at least 0 for edges and [`LOWEST`] for
/// bending and torsion springs; of an altitude spring `E'' w w^T n n^T + E' h''` ([`turns`]) unless it is below
/// [`HALF`]. Without the geometric terms (`geometric` false, section 4.1's fixed directions) tension does not resist
/// turning.
pub fn tangent(model: &Model, choices: &[Choice], x: &[Vec3], geometric: bool) -> Tangent {
    let mut a = vec![[Matrix3::zeros(); 4]; x.len()];
    for i in 0..x.len() {
        for k in 1..=3.min(i) {
            let s = &model.spring[i][k - 1];
            let (d, length) = direction(x, i, k);
            let least = LOWEST * model.spring[i][2].stiffness;
            let across = if geometric { (s.stiffness * (1.0 - s.length / length)).max(least) } else { 0.0 };
            let m = d * d.transpose() * (s.stiffness - across) + Matrix3::identity() * across;
            a[i][0] += m;
            a[i - k][0] += m;
            a[i][k] -= m;
        }
        if i >= 3 {
            let (strain, n, w) = altitude(model, choices, x, i);
            let t = &model.tetrahedron[i];
            let candidate = choices[i].candidate as usize;
            let f = t.inverse_height[candidate];
            let (_, first, second) = altitude_law(strain);
            let pull = if geometric && strain > HALF { t.stiffness * first * f } else { 0.0 };
            let v = volume(corners(x, i));
            let (q, h) = (turns(corners(x, i), candidate), v.altitude(candidate).0);
            for k in 0..4 {
                for back in k..4 {
                    let along = t.stiffness * second * f * f * w[k] * w[back] - pull * h * q[k].dot(&q[back]);
                    let across = q[back] * n.transpose() * w[k] + n * q[k].transpose() * w[back];
                    a[i - k][back - k] += n * n.transpose() * along - across * pull;
                }
            }
        }
    }
    a
}

/// Chooses the altitudes anew: once a step, before it.
///
/// Moves the last particle of a colinear tetrahedron off its line ([`NUDGE`]). `relax` in 0..=1 is the fraction of the
/// carried strain to forget: where that lowers the energy, as far as it does, and where the tetrahedron is flat or
/// inverted ([`HALF`]), whatever it takes: else the carried strain could hold it so. Returns how many changed.
pub fn choose(model: &Model, choices: &mut [Choice], x: &mut [Vec3], relax: f64) -> usize {
    let mut changed = 0;
    for i in 3..x.len() {
        let t = &model.tetrahedron[i];
        let mut v = volume(corners(x, i));
        let mut areas = v.areas_squared();
        let most = areas.iter().fold(0.0_f64, |a, &b| a.max(b));
        let long = x[i] - x[i - 3];
        let other = x[i - 1] - x[i - 2];
        let longest = if long.norm_squared() > other.norm_squared() { long } else { other };
        let size2 = longest.norm_squared();
        if COLINEAR * size2 * size2 > most && !model.held[i] {
            x[i] += super::layout::perpendicular(longest) * (NUDGE * size2.sqrt());
            v = volume(corners(x, i));
            areas = v.areas_squared();
        }
        let strain_of = |c: usize| v.altitude(c).0 * t.inverse_height[c] - t.rest;
        let now = choices[i].candidate as usize;
        let strain = strain_of(now) + choices[i].carried;
        let best = (0..CANDIDATES).fold(now, |b, c| if areas[c] > areas[b] { c } else { b });
        if areas[best] > HYSTERESIS * areas[now] + TINY {
            choices[i] = Choice { candidate: best as u8, carried: strain - strain_of(best) };
            changed += 1;
        }
        let carried = choices[i].carried;
        let fade = if strain - carried < HALF {
            relax * carried.abs()
        } else if carried * strain > 0.0 {
            (relax * carried.abs()).min(strain.abs())
        } else {
            0.0
        };
        choices[i].carried -= fade.copysign(carried);
    }
    changed
}
