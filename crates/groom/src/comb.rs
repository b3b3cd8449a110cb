//! Combing: a list of operations that turn and scale the segments of control hairs on the rest skin.
//!
//! After "Course notes 2003, A production pipeline for hair", §3.2: combing direction curves, degree of bending and
//! curvature, region of influence with a falloff; §5: a chain over a control hair. An operation never changes the length of
//! a segment except [`CombKind::Length`], [`CombKind::Cut`], [`CombKind::Trim`] and [`CombKind::Mirror`]: directions change, the hair is built up
//! again from its root.
//!
//! With `a` the amount of an operation at a hair (its weight, region map, falloff and bend multiplied), segment k turns by
//! the fraction `a * profile(s)` of the way to its target, where `s` runs from 0 at the first segment to 1 at the last
//! (by length before the segment) and `profile(s) = 1 - c + c s` for curvature `c`: 0 tilts the whole hair at the root, 1
//! leaves the root as it is and bends the tip.

mod chain;
mod mirror;

use crate::control::{ControlHairs, Skin, to_local, to_world, vec3};
use crate::field::lengths::{Shear, Sphere, between_keys};
use crate::flow::trace::{Lines, Start};
use crate::flow::trim::{cut, length_to};
use crate::spline::BSpline;
use pelage_geom::curve::{closest_on_polyline, length as polyline_length};
use pelage_geom::{Bvh, Frame, NONE, TiledMap, Vec3};
use rayon::prelude::*;

/// Elevation over the root's tangent plane that a laid-down hair keeps, radians (2 degrees). At 0 rounding puts half of
/// the hairs under the skin and the push-up has to lift them; at 10 degrees fur laid flat visibly stands.
const FLAT_ELEVATION: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Painted directions shorter than this say nothing. Mid-grey in 8 bits (128 / 255) decodes to a length of 0.007, which
/// must not count; a painted unit vector blurred over a fan of 90 degrees still has a length of 0.6.
const UNPAINTED: f64 = 0.02;

/// A number that may differ from hair to hair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Amount<'a> {
    /// The number.
    pub value: f64,
    /// \[H\] factors on it; empty: 1 for all.
    pub factor: &'a [f32],
}

impl Amount<'_> {
    /// That of a hair.
    pub fn of(&self, h: usize) -> f64 {
        self.value * self.factor.get(h).map_or(1.0, |f| f64::from(*f))
    }
}

impl From<f64> for Amount<'_> {
    fn from(value: f64) -> Self {
        Amount { value, factor: &[] }
    }
}

/// One step of combing.
#[derive(Clone, Debug)]
pub struct CombOp<'a> {
    /// What to do.
    pub kind: CombKind<'a>,
    /// Overall weight; 0 leaves every hair byte for byte.
    pub weight: Amount<'a>,
    /// Map multiplied onto the weight, read at the texture coordinates of the hair's root.
    pub region: Option<&'a TiledMap>,
    /// Only the hairs on one side of a parting: (index of the parting, +1 left or -1 right).
    pub side: Option<(u32, i8)>,
    /// Only those of the hairs placed one by one ([`ControlHairs::single`]); an empty list is none of all hairs.
    pub only: Option<&'a [u32]>,
}

/// Lines from the roots of all hairs, of as many points as these, scene space: a field that is traced, a
/// cylinder that roots lie in. Their directions count, not their lengths.
#[derive(Clone, Copy)]
pub struct Guides<'a>(pub &'a (dyn Fn(&[Start]) -> Lines + Sync));

impl std::fmt::Debug for Guides<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Guides")
    }
}

/// The kinds of combing.
#[derive(Clone, Debug)]
pub enum CombKind<'a> {
    /// Toward the direction of a drawn curve at its point nearest to the hair's root.
    DirectionCurve {
        /// Polyline in rest scene space, at least two points; hairs turn toward its direction of travel.
        points: Vec<Vec3>,
        /// Distance of the root from the curve where its influence ends, scene units; infinite for everywhere.
        radius: Amount<'a>,
        /// Part of the radius over which influence fades (smoothstep): 0 a hard edge, 1 from the curve outward.
        falloff: Amount<'a>,
        /// How far toward the curve's direction, 0 to 1.
        bend: Amount<'a>,
        /// Where along the hair, 0 to 1 (module documentation).
        curvature: Amount<'a>,
    },
    /// Toward a direction painted as colour: 2 c - 1.
    DirectionMap {
        /// RGB in [0, 1].
        map: &'a TiledMap,
        /// What r, g, b are coordinates of.
        space: DirectionSpace,
        /// How far toward the painted direction, 0 to 1.
        bend: Amount<'a>,
        /// Where along the hair, 0 to 1.
        curvature: Amount<'a>,
    },
    /// Toward a line from the hair's root, segment by segment: with an amount of 1 the hair takes its shape.
    Follow {
        /// The lines.
        guides: Guides<'a>,
        /// How far toward the line, 0 to 1.
        bend: Amount<'a>,
        /// Where along the hair, 0 to 1.
        curvature: Amount<'a>,
    },
    /// Turns segments in the plane of the normal and the hair's lean, away from the normal. The lean is the part of
    /// root to tip in the tangent plane, for an upright hair dU.
    Bend {
        /// Angle at the tip (with curvature 0 everywhere), degrees; negative straightens up.
        angle: Amount<'a>,
        /// Map multiplied onto the angle.
        map: Option<&'a TiledMap>,
        /// Where along the hair, 0 to 1.
        curvature: Amount<'a>,
    },
    /// Lowers every segment toward the root's tangent plane and keeps its azimuth: elevation e becomes
    /// `e + a (2 degrees - e)`.
    LayDown {
        /// 0 to 1: 1 lies flat, but for 2 degrees.
        amount: Amount<'a>,
        /// Map multiplied onto the amount.
        map: Option<&'a TiledMap>,
    },
    /// Toward the cubic B-spline nearest to the hair's own shape, smoothed by Hermite pieces ("sparse guide hairs" in the same
    /// course notes, §2.2): kinks go, the fewer the control points the more. A hair that determines no spline is left.
    Smooth {
        /// Control points of the spline, 4 to those of the hair.
        control: usize,
        /// How far toward it, 0 to 1.
        bend: Amount<'a>,
        /// Where along the hair, 0 to 1.
        curvature: Amount<'a>,
    },
    /// Cuts hairs at a plane each ("sparse guide hairs" in the same course notes, §2.1); it never lengthens one. A weight of w
    /// takes off w of what the cut would.
    Cut {
        /// The planes.
        shear: &'a Shear,
        /// Hair is as long as the way around this sphere to its plane; without, it is cut where it meets the plane.
        scalp: Option<Sphere>,
    },
    /// Cuts hairs to lengths between those at key places ("sparse guide hairs", §2.1; [`between_keys`]); weights as for a cut.
    Keys {
        /// Middle of the scalp, scene space.
        centre: Vec3,
        /// Places and lengths there, scene units.
        key: Vec<(Vec3, f64)>,
    },
    /// Cuts hairs where they first run through a surface ("streamlines of flow" in the same course notes, §3); weights as for a cut.
    Trim {
        /// The surface, rest scene space.
        surface: &'a Bvh,
    },
    /// Multiplies lengths by `1 + weight (value * map - 1)`, not less than 1/1000.
    Length {
        /// Factor.
        value: Amount<'a>,
        /// Map multiplied onto the factor.
        map: Option<&'a TiledMap>,
    },
    /// Moves a control hair and its neighbours as a chain, by forward and then inverse kinematics (same course notes, §5).
    /// Segment k of a neighbour makes in its own root frame the turn that segment k of the handle makes in that of its root,
    /// from its direction before to that after, without twist. Without such a handle nothing is done.
    Chain {
        /// The hair that is moved.
        handle: Handle,
        /// Forward kinematics, in this order: (joint, rotation vector). All segments from the joint on (0 is the root) turn
        /// about the vector by its length in degrees; coordinates along N, dU, N x dU of the root. A joint beyond the last
        /// segment turns nothing.
        turn: Vec<(usize, Vec3)>,
        /// Inverse kinematics, after the turns: where the handle's tip goes, rest scene space. The hair points straight at
        /// what is out of its reach.
        reach: Option<Vec3>,
        /// Distance of a root from the handle's root where its influence ends, scene units; infinite for everywhere. The
        /// handle itself moves whatever the radius.
        radius: Amount<'a>,
        /// Part of the radius over which influence fades, as for a direction curve.
        falloff: Amount<'a>,
    },
    /// Gives hairs behind a plane the mirrored shape of those in front: the blend of the nearest to the mirrored root, or the
    /// very hair that stands there (within 1e-6 of the mesh's diagonal), put at the hair's own root. Directions, lengths of
    /// segments and what hairs were cut to are carried over. A hair on a side of a parting takes hairs of the other side or
    /// of none, if there are any: partings run in the same sense on both halves. Hairs in front and on the plane stay.
    Mirror {
        /// A point of the plane, rest scene space.
        point: Vec3,
        /// Toward the front, of any length but zero.
        normal: Vec3,
    },
}

/// Which control hair a chain moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Handle {
    /// The first of this number among those placed one by one ([`ControlHairs::single`]).
    Single(u32),
    /// The one rooted nearest to a point, rest scene space.
    Nearest(Vec3),
}

/// Space of a painted direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DirectionSpace {
    /// Red, green, blue along N, dU, N x dU of the root.
    Root,
    /// Red, green, blue along x, y, z of the scene.
    World,
}

/// What one operation did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CombCounts {
    /// Hairs it changed.
    pub combed: usize,
    /// Hairs left alone because the painted direction says nothing there.
    pub unpainted: usize,
}

/// Applies `ops` in order to all hairs on the rest skin; `partings` are the polylines of the partings, rest scene space.
/// Returns counts per operation.
pub fn comb(skin: &Skin, partings: &[Vec<Vec3>], ops: &[CombOp], hairs: &mut ControlHairs) -> Vec<CombCounts> {
    let mut counts = vec![CombCounts::default(); ops.len()];
    let frames: Vec<Frame> = hairs.root.par_iter().map(|p| skin.frame(p)).collect();
    for (op, count) in ops.iter().zip(&mut counts) {
        let given = Given::new(&op.kind, skin, &frames, hairs);
        let (root, side, parting, points) = (&hairs.root, &hairs.side, &hairs.parting, hairs.points);
        let single = &hairs.single;
        let outcome = |(h, (local, cut)): (usize, (&mut [[f32; 3]], &mut f32))| {
            if op.only.is_some_and(|only| single[h] == NONE || !only.contains(&single[h])) {
                return CombCounts::default();
            }
            let frame = &frames[h];
            let uv = skin.uv(&root[h]);
            let mut weight = op.weight.of(h) * op.region.map_or(1.0, |m| f64::from(m.value(uv)));
            if let Some((p, wanted)) = op.side {
                let known = if parting[h] == p { Some(side[h]) } else { None };
                let side = known.or_else(|| Some(side_of(partings.get(p as usize)?, frame.origin, frame.n)));
                weight *= share(side.unwrap_or(0), wanted);
            }
            if weight == 0.0 {
                return CombCounts::default();
            }
            apply(&op.kind, &given, weight, Hair { index: h, frame, uv, side: side[h], local, cut })
        };
        let each = hairs.local.par_chunks_mut(points).zip(&mut hairs.cut).enumerate();
        *count = each.map(outcome).reduce(CombCounts::default, |a, b| CombCounts {
            combed: a.combed + b.combed,
            unpainted: a.unpainted + b.unpainted,
        });
    }
    counts
}

/// What an operation reads of all hairs before it changes the first.
enum Given {
    Nothing,
    /// What hairs follow.
    Lines(Lines),
    Chain(chain::Motion),
    Mirror(mirror::Front),
}

impl Given {
    fn new(kind: &CombKind, skin: &Skin, frames: &[Frame], hairs: &ControlHairs) -> Given {
        match kind {
            CombKind::Follow { guides, .. } => Given::Lines((guides.0)(&starts(frames, hairs))),
            CombKind::Chain { handle, turn, reach, .. } => {
                let handle = chain::find(handle, frames, hairs);
                let motion = handle.map(|h| chain::motion(h, &frames[h], hairs.hair(h), turn, *reach));
                motion.map_or(Given::Nothing, Given::Chain)
            }
            CombKind::Mirror { point, normal } => {
                mirror::front(*point, *normal, skin.mesh, frames, hairs).map_or(Given::Nothing, Given::Mirror)
            }
            _ => Given::Nothing,
        }
    }
}

/// Where lines of hairs begin, which way without a better one (the normal), and their lengths.
fn starts(frames: &[Frame], hairs: &ControlHairs) -> Vec<Start> {
    let start = |(h, f): (usize, &Frame)| Start { at: f.origin, direction: f.n, length: hairs.length(h) };
    frames.par_iter().enumerate().map(start).collect()
}

/// Turns segments toward those of a line of as many points, which `along` brings into the root frame; a line without length
/// leaves a hair as it is.
fn follow(line: &[Vec3], along: impl Fn(Vec3) -> Vec3, a: f64, curvature: f64, local: &mut [[f32; 3]]) -> CombCounts {
    if a == 0.0 || line.windows(2).all(|w| w[0] == w[1]) {
        return CombCounts::default();
    }
    let mut ahead = line.windows(2).map(|w| along(w[1] - w[0]).try_normalize(0.0));
    rebuild(local, |d, s| {
        let target = ahead.next().flatten().unwrap_or(d);
        slerp(d, target, (a * (1.0 - curvature + curvature * s)).clamp(0.0, 1.0))
    });
    CombCounts { combed: 1, unpainted: 0 }
}

/// Part of an operation for one side that a hair on `side` gets; a hair on the line itself gets half.
fn share(side: i8, wanted: i8) -> f64 {
    match side {
        0 => 0.5,
        s if s == wanted => 1.0,
        _ => 0.0,
    }
}

/// Side of a point of the skin of normal `n` seen from a polyline: +1 left, -1 right (from outside, looking along it), by
/// its nearest point; 0 on the line or for less than two points.
pub fn side_of(line: &[Vec3], at: Vec3, n: Vec3) -> i8 {
    let Some((near, tangent)) = nearest(line, at) else { return 0 };
    let across = (at - near).dot(&n.cross(&tangent));
    if across > 0.0 {
        1
    } else if across < 0.0 {
        -1
    } else {
        0
    }
}

/// Nearest point of a polyline and its direction there, which turns evenly from corner to corner; `None` for a line
/// without length.
fn nearest(line: &[Vec3], at: Vec3) -> Option<(Vec3, Vec3)> {
    let direction = |i: usize| (line[i + 1] - line[i]).try_normalize(0.0);
    let (i, f, p, _) = closest_on_polyline(line, at);
    let here = (i..line.len().saturating_sub(1)).find_map(direction).or_else(|| (0..i).rev().find_map(direction))?;
    let before = (0..i).rev().find_map(direction).unwrap_or(here);
    let after = (i + 1..line.len() - 1).find_map(direction).unwrap_or(here);
    let corner = |a: Vec3, b: Vec3| (a + b).try_normalize(1e-6).unwrap_or(here);
    let tangent = corner(before, here) * (1.0 - f) + corner(here, after) * f;
    Some((p, tangent.try_normalize(1e-6).unwrap_or(here)))
}

/// A hair as an operation takes it.
struct Hair<'a> {
    index: usize,
    frame: &'a Frame,
    uv: [f32; 2],
    /// Side of a parting that it stands on.
    side: i8,
    /// Points relative to the root, in the root frame.
    local: &'a mut [[f32; 3]],
    /// Length that it was cut to.
    cut: &'a mut f32,
}

/// One operation on one hair.
fn apply(kind: &CombKind, given: &Given, weight: f64, hair: Hair<'_>) -> CombCounts {
    match (given, kind) {
        (Given::Chain(motion), CombKind::Chain { radius, falloff, .. }) => {
            return motion.apply(weight, radius.of(hair.index), falloff.of(hair.index), hair);
        }
        (Given::Mirror(front), _) => return front.apply(weight, hair),
        _ => {}
    }
    let Hair { index, frame, uv, side: _, local, cut: left } = hair;
    let value = |map: &Option<&TiledMap>| map.map_or(1.0, |m| f64::from(m.value(uv)));
    let combed = CombCounts { combed: 1, unpainted: 0 };
    match kind {
        CombKind::Follow { bend, curvature, .. } => match given {
            Given::Lines(lines) => {
                let along = |v| to_local(frame, v);
                follow(lines.line(index), along, weight * bend.of(index), curvature.of(index), local)
            }
            _ => CombCounts::default(),
        },
        CombKind::Smooth { control, bend, curvature } => {
            let points: Vec<Vec3> = local.iter().map(|p| vec3(*p)).collect();
            match BSpline::through(&points, *control) {
                Ok(line) => follow(&line, |v| v, weight * bend.of(index), curvature.of(index), local),
                Err(_) => CombCounts::default(),
            }
        }
        // No handle, or a plane without a front.
        CombKind::Chain { .. } | CombKind::Mirror { .. } => CombCounts::default(),
        CombKind::DirectionCurve { points, radius, falloff, bend, curvature } => {
            let Some((near, tangent)) = nearest(points, frame.origin) else { return CombCounts::default() };
            let a =
                weight * bend.of(index) * influence((near - frame.origin).norm(), radius.of(index), falloff.of(index));
            turn_toward(to_local(frame, tangent), a, curvature.of(index), local)
        }
        CombKind::DirectionMap { map, space, bend, curvature } => {
            let c = vec3(map.sample(uv)) * 2.0 - Vec3::repeat(1.0);
            if c.norm() < UNPAINTED {
                return CombCounts { combed: 0, unpainted: 1 };
            }
            let target = if *space == DirectionSpace::Root { c } else { to_local(frame, c) };
            turn_toward(target.normalize(), weight * bend.of(index), curvature.of(index), local)
        }
        CombKind::Bend { angle, map, curvature } => {
            let angle = (angle.of(index) * weight * value(map)).to_radians();
            let curvature = curvature.of(index);
            if angle == 0.0 {
                return CombCounts::default();
            }
            let axis = Vec3::x().cross(&lean(local));
            rebuild(local, |d, s| rotate(d, axis, angle * (1.0 - curvature + curvature * s)));
            combed
        }
        CombKind::LayDown { amount, map } => {
            let a = (amount.of(index) * weight * value(map)).clamp(0.0, 1.0);
            if a == 0.0 {
                return CombCounts::default();
            }
            let lean = lean(local);
            rebuild(local, |d, _| {
                let e = libm::asin(d.x.clamp(-1.0, 1.0));
                let e = e + a * (FLAT_ELEVATION - e);
                let azimuth = Vec3::new(0.0, d.y, d.z).try_normalize(1e-6).unwrap_or(lean);
                Vec3::x() * libm::sin(e) + azimuth * libm::cos(e)
            });
            combed
        }
        CombKind::Cut { .. } | CombKind::Keys { .. } | CombKind::Trim { .. } => {
            let line = world_points(frame, local);
            let length: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            let asked = match kind {
                CombKind::Cut { shear, scalp: Some(scalp) } => Some(shear.length(scalp, frame.origin)),
                CombKind::Cut { shear, scalp: None } => shear.length_along(&line),
                CombKind::Keys { centre, key } => Some(between_keys(*centre, key, frame.origin)),
                CombKind::Trim { surface } => length_to(&line, surface),
                _ => None,
            };
            let asked = asked.filter(|l| *l < length).map(|l| length + weight.min(1.0) * (l - length));
            let Some(asked) = asked else { return CombCounts::default() };
            // A hair keeps a little of its length: its direction is needed.
            for (p, out) in cut(&line, asked.max(1e-3 * length), local.len()).iter().zip(&mut *local).skip(1) {
                let p = to_local(frame, p - frame.origin);
                *out = [p.x as f32, p.y as f32, p.z as f32];
            }
            *left = polyline_length(local) as f32;
            combed
        }
        CombKind::Length { value: factor, map } => {
            let f = (1.0 + weight * (factor.of(index) * value(map) - 1.0)).max(1e-3);
            if f == 1.0 {
                return CombCounts::default();
            }
            local.iter_mut().flatten().for_each(|x| *x = (f64::from(*x) * f) as f32);
            combed
        }
    }
}

/// Influence at a distance from a curve.
fn influence(distance: f64, radius: f64, falloff: f64) -> f64 {
    if radius.is_infinite() {
        return 1.0;
    }
    let inner = radius * (1.0 - falloff.clamp(0.0, 1.0));
    if distance >= radius {
        0.0
    } else if distance <= inner {
        1.0
    } else {
        let t = (radius - distance) / (radius - inner);
        t * t * (3.0 - 2.0 * t)
    }
}

/// Turns segments by `a * profile` of the way to one target direction.
fn turn_toward(target: Vec3, a: f64, curvature: f64, local: &mut [[f32; 3]]) -> CombCounts {
    if a == 0.0 {
        return CombCounts::default();
    }
    rebuild(local, |d, s| slerp(d, target, (a * (1.0 - curvature + curvature * s)).clamp(0.0, 1.0)));
    CombCounts { combed: 1, unpainted: 0 }
}

/// Unit direction in the tangent plane toward which a hair leans; dU if it stands upright.
fn lean(local: &[[f32; 3]]) -> Vec3 {
    let tip = vec3(local[local.len() - 1]);
    let flat = Vec3::new(0.0, tip.y, tip.z);
    if flat.norm() <= 1e-4 * tip.norm() { Vec3::y() } else { flat.normalize() }
}

/// Gives each segment the direction `turn(direction, s)` at its old length, from the root up.
fn rebuild(local: &mut [[f32; 3]], mut turn: impl FnMut(Vec3, f64) -> Vec3) {
    let segment: Vec<Vec3> = local.windows(2).map(|w| vec3(w[1]) - vec3(w[0])).collect();
    let last: f64 = segment[..segment.len() - 1].iter().map(|v| v.norm()).sum();
    let (mut at, mut before) = (vec3(local[0]), 0.0);
    for (v, out) in segment.iter().zip(&mut local[1..]) {
        let length = v.norm();
        let s = if last > 0.0 { f64::min(before / last, 1.0) } else { 1.0 };
        // Every segment turns, one without length for nothing: what is turned toward goes along.
        let d = turn(v.try_normalize(0.0).unwrap_or_else(Vec3::x), s);
        if length > 0.0 {
            at += d.normalize() * length;
        }
        before += length;
        *out = [at.x as f32, at.y as f32, at.z as f32];
    }
}

/// Direction a fraction `f` of the way from unit `a` to unit `b` on their great circle. From opposite directions the way
/// leads over x (in the root frame the normal), or over y if they are along x.
pub(crate) fn slerp(a: Vec3, b: Vec3, f: f64) -> Vec3 {
    match arc(a, b) {
        Some((axis, angle)) => rotate(a, axis, angle * f),
        None if f >= 1.0 => b,
        None => a,
    }
}

/// Axis and angle (radians) of the turn from unit `a` to unit `b`, as [`slerp`] goes; `None` for less than 1e-9.
fn arc(a: Vec3, b: Vec3) -> Option<(Vec3, f64)> {
    let axis = a.cross(&b);
    let sine = axis.norm();
    let angle = libm::atan2(sine, a.dot(&b));
    if sine > 1e-9 {
        return Some((axis / sine, angle));
    }
    if a.dot(&b) > 0.0 {
        return None;
    }
    let over = if a.x.abs() < 0.999 { Vec3::x() } else { Vec3::y() };
    Some((a.cross(&over).normalize(), angle))
}

/// Rotation about a unit axis (Rodrigues).
pub(crate) fn rotate(v: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    let (s, c) = (libm::sin(angle), libm::cos(angle));
    v * c + axis.cross(&v) * s + axis * (axis.dot(&v) * (1.0 - c))
}

/// A hair in world space from its root frame: its points, root first.
pub(crate) fn world_points(frame: &Frame, local: &[[f32; 3]]) -> Vec<Vec3> {
    local.iter().map(|&p| frame.origin + to_world(frame, vec3(p))).collect()
}

#[cfg(test)]
#[path = "comb_tests.rs"]
mod tests;
