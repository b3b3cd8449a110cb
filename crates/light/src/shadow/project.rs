//! The plane across the light: where a point falls on it and how deep it lies.

use super::settings::{ShadowSettings, WIDEST};
use super::{BadSource, ShadowCounts, ShadowHair, Source};
use crate::slab::{self, HUGE, along};
use pelage_geom::Vec3;
use rayon::prelude::*;

/// False for what is not finite or out of range.
#[inline]
pub(crate) fn is_usable(p: Vec3) -> bool {
    p.x.abs() < HUGE && p.y.abs() < HUGE && p.z.abs() < HUGE
}

/// A point light this many times the hair's size away is parallel light: the rays differ by less than 1e-6 radians, and
/// farther away double precision cannot tell the hairs apart.
const FAR: f64 = 1e6;

/// Nearest distance to a point light at which hair casts shadow, as a fraction of the hair's size.
const NEAR: f64 = 1e-5;

/// Half angle, as a tangent, up to which one map covers what a point light sees; wider, six faces of a cube do.
const WIDE: f64 = 1.5;

/// Part of a face beyond its sides in which hair is still followed exactly.
const BEYOND: f64 = 1.5;

/// Maps the world to a light's plane. Plane coordinates (u, v, q): u and v in texels, q a depth that grows along each
/// ray and is linear in u and v along straight lines.
#[derive(Clone, Debug)]
pub(crate) struct Projection {
    axis: [Vec3; 3],
    /// The light, or for parallel light the middle of the hair.
    eye: Vec3,
    /// Distance of the light from the hair's middle along axis 2; `None` for parallel light.
    reach: Option<f64>,
    near: f64,
    /// Plane coordinates (before texels) of texel 0, and texels per unit.
    low: [f64; 2],
    scale: f64,
    /// Texels along a side.
    pub texels: usize,
    /// Side of the footprint, texels.
    pub filter: f32,
    /// One face of a cube.
    cube: bool,
    /// Middle of a spot's cone and the cosine of its outer half angle.
    /// For parallel light: there only if all hair is outside.
    cone: Option<(Vec3, f64)>,
    /// Size of the hair: diagonal of its box.
    pub size: f64,
}

/// What the light's plane says of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// Coordinates; true if this map gives the point its value.
    At([f32; 3], bool),
    /// Not on this face; its segments have to be clipped.
    Beyond,
    /// Not finite.
    Bad,
    /// Outside the cone of a spot: (where, or nothing).
    Masked(Option<[f32; 3]>),
}

impl Projection {
    /// Undivided coordinates: along the axes from the eye.
    #[inline]
    fn local(&self, p: Vec3) -> Vec3 {
        let r = p - self.eye;
        Vec3::new(self.axis[0].dot(&r), self.axis[1].dot(&r), self.axis[2].dot(&r))
    }

    /// Plane coordinates from local ones.
    #[inline]
    fn divide(&self, l: Vec3) -> [f64; 3] {
        match self.reach {
            None => [l.x, l.y, l.z],
            Some(d) => {
                let inverse = 1.0 / l.z;
                [l.x * inverse, l.y * inverse, (l.z - d) * d * inverse]
            }
        }
    }

    #[inline]
    fn texel(&self, c: [f64; 3]) -> [f32; 3] {
        [((c[0] - self.low[0]) * self.scale) as f32, ((c[1] - self.low[1]) * self.scale) as f32, c[2] as f32]
    }

    /// Where a point falls.
    #[inline]
    pub fn place(&self, p: Vec3) -> Place {
        if !is_usable(p) {
            return Place::Bad;
        }
        let l = self.local(p);
        if self.reach.is_none() {
            let at = self.texel(self.divide(l));
            return if self.cone.is_some() { Place::Masked(Some(at)) } else { Place::At(at, true) };
        }
        let side = l.x.abs().max(l.y.abs());
        let at = (l.z > self.near && !(self.cube && side > BEYOND * l.z)).then(|| self.texel(self.divide(l)));
        if let Some((middle, cosine)) = self.cone {
            let r = p - self.eye;
            if r.dot(&middle) < cosine * r.norm() {
                // Counted on the first face only.
                return Place::Masked(at);
            }
        }
        match at {
            None => Place::Beyond,
            Some(c) => Place::At(c, !self.cube || self.owns(l)),
        }
    }

    /// True for what is not between the light and any point of the map: it lies behind the light.
    pub fn is_behind(&self, p: Vec3) -> bool {
        self.reach.is_some() && self.local(p).z < 0.0
    }

    /// Where a point of a solid falls, with a depth that is nearer the light by `margin` scene units; `None` where the map
    /// does not reach.
    pub fn front(&self, p: Vec3, margin: f64) -> Option<[f32; 3]> {
        let l = self.local(p);
        if self.reach.is_none() {
            return Some(self.texel(self.divide(l - Vec3::z() * margin)));
        }
        if l.z - margin <= self.near {
            return None;
        }
        let [x, y, _] = self.divide(l);
        let [.., depth] = self.divide(l - Vec3::z() * margin);
        Some(self.texel([x, y, depth]))
    }

    /// True if the face of a cube is the one that gives a point its value: one face for every point.
    fn owns(&self, l: Vec3) -> bool {
        let a = self.axis[0] * l.x + self.axis[1] * l.y + self.axis[2] * l.z;
        let k = a.iamax();
        self.axis[2][k] * a[k] > 0.5 * a[k].abs()
    }

    /// Half as many texels across the same.
    pub fn halve(&mut self) {
        let texels = (self.texels / 2).max(1);
        let factor = texels as f64 / self.texels as f64;
        self.texels = texels;
        self.scale *= factor;
        self.filter = (f64::from(self.filter) * factor).max(1.0) as f32;
    }

    /// Texels around a tile that its points may look at.
    pub fn border(&self) -> usize {
        (0.5 * self.filter).ceil() as usize
    }

    /// Plane coordinates of the part of a segment that this face follows.
    pub fn clip_points(&self, a: Vec3, b: Vec3) -> Option<[[f32; 3]; 2]> {
        if self.reach.is_none() || !(is_usable(a) && is_usable(b)) {
            return None;
        }
        let (a, b) = (self.local(a), self.local(b));
        let (mut from, mut to) = (0.0f64, 1.0f64);
        let inside =
            |l: Vec3| [l.z - self.near, BEYOND * l.z - l.x, BEYOND * l.z + l.x, BEYOND * l.z - l.y, BEYOND * l.z + l.y];
        for (x, y) in inside(a).into_iter().zip(inside(b)) {
            if x < 0.0 && y < 0.0 {
                return None;
            }
            if x < 0.0 {
                from = from.max(x / (x - y));
            } else if y < 0.0 {
                to = to.min(x / (x - y));
            }
        }
        let d = b - a;
        let ends = [a + d * from, a + d * to].map(|l| self.texel(self.divide(l)));
        (from < to && ends.iter().flatten().all(|v| v.is_finite())).then_some(ends)
    }

    /// Texels per scene unit at depth q.
    #[inline]
    pub fn per_unit(&self, q: f32) -> f32 {
        match self.reach {
            None => self.scale as f32,
            Some(d) => (self.scale * (d - f64::from(q)) / (d * d)) as f32,
        }
    }

    /// Factor of a hair's width on the plane for the hair's slant to the middle: the rays within r of an axis lie
    /// between two planes through the light, whose traces are r / z sqrt(1 + h^2) from the axis' trace, which passes
    /// the middle at h.
    #[inline]
    pub fn stretch(&self, a: &[f32; 3], b: &[f32; 3]) -> f32 {
        if self.reach.is_none() {
            return 1.0;
        }
        let inverse = 1.0 / self.scale as f32;
        let (low0, low1) = (self.low[0] as f32, self.low[1] as f32);
        let (x, y) = (a[0] * inverse + low0, a[1] * inverse + low1);
        let (dx, dy) = ((b[0] - a[0]) * inverse, (b[1] - a[1]) * inverse);
        let square = dx * dx + dy * dy;
        let cross = x * dy - y * dx;
        if square > 0.0 { (1.0 + cross * cross / square).sqrt() } else { 1.0 }
    }

    /// Unit vector towards the light at `p` and the distance to it; `None` at the light.
    pub fn toward(&self, p: Vec3) -> Option<(Vec3, f64)> {
        match self.reach {
            None => Some((-self.axis[2], f64::INFINITY)),
            Some(_) => {
                let r = self.eye - p;
                let d = r.norm();
                (d > 0.0).then(|| (r / d, d))
            }
        }
    }

    /// Steps of one texel from `p` across the light, along the two axes of the plane.
    pub fn texel_steps(&self, p: Vec3) -> [Vec3; 2] {
        let depth = if self.reach.is_some() { self.local(p).z } else { 1.0 };
        let step = depth / self.scale;
        [self.axis[0] * step, self.axis[1] * step]
    }
}

/// Box of the finite points along `axis`, seen from `eye`.
fn bounds(layers: &[ShadowHair], eye: Vec3, axis: [Vec3; 3], divide: bool) -> Option<([f64; 3], [f64; 3])> {
    let place = |shift: Vec3, p: &[f32; 3]| {
        let c = along(axis, shift + Vec3::from(p.map(f64::from)))?;
        Some(if divide { [c[0] / c[2], c[1] / c[2], c[2]] } else { c })
    };
    slab::bounds(layers.par_iter().flat_map(|layer| {
        let shift = Vec3::from(layer.origin) - eye;
        layer.position.par_iter().filter_map(move |p| place(shift, p))
    }))
}

/// Right-handed axes with `z` last.
fn axes(z: Vec3) -> [Vec3; 3] {
    let x = if z.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let x = (x - z * z.dot(&x)).normalize();
    [x, z.cross(&x), z]
}

fn unit(v: Vec3) -> Result<Vec3, BadSource> {
    let largest = v.amax();
    if v.iter().any(|x| !x.is_finite()) || largest == 0.0 {
        return Err(BadSource::Direction);
    }
    Ok((v / largest).normalize())
}

/// Texels of a cube's face for each that is asked for: hair on a face lies at all distances from the light, and much of it
/// near, where a hair spans many texels. With 1 the RMS error at the default is 0.0247 in long hair.
const FACE: f64 = 1.5;

/// Texels along a side of a cube's face.
fn face_texels(settings: &ShadowSettings) -> usize {
    let most = if settings.filter > 0.0 { (WIDEST / settings.filter) as usize } else { usize::MAX };
    ((settings.texels as f64 * FACE) as usize).min(most).max(settings.texels)
}

/// The maps of a light: one, or six where it is inside the hair or near it, or none without hair.
pub(crate) fn fit(
    source: Source,
    layers: &[ShadowHair],
    settings: &ShadowSettings,
) -> Result<(Vec<Projection>, ShadowCounts), BadSource> {
    let (position, direction, cone) = match source {
        Source::Directional { direction } => (None, unit(direction)?, None),
        Source::Point { position } => (Some(position), Vec3::zeros(), None),
        Source::Spot { position, direction, cone, softness } => {
            let angle = (cone.max(0.0) + softness.max(0.0)).min(std::f64::consts::PI);
            let middle = unit(direction)?;
            (Some(position), middle, (!angle.is_nan()).then(|| (middle, libm::cos(angle))))
        }
    };
    if position.is_some_and(|p| p.iter().any(|v| !v.is_finite())) {
        return Err(BadSource::Position);
    }
    let world = [Vec3::x(), Vec3::y(), Vec3::z()];
    let mut counts = ShadowCounts::default();
    let Some((lo, hi)) = bounds(layers, Vec3::zeros(), world, false) else {
        counts.bad_points = layers.iter().map(|l| l.position.len()).sum();
        return Ok((Vec::new(), counts));
    };
    let (lo, hi) = (Vec3::from(lo), Vec3::from(hi));
    let (centre, size) = (0.5 * (lo + hi), (hi - lo).norm().max(1e-12 * hi.amax().max(lo.amax())).max(1e-30));
    counts.bad_points =
        layers.iter().map(|l| (0..l.position.len()).into_par_iter().filter(|&i| !is_usable(l.point(i))).count()).sum();
    let common = |axis, eye, reach, low, side: f64, cube| {
        let side = side.max(1e-30);
        let texels = if cube { face_texels(settings) } else { settings.texels };
        let scale = texels as f64 / side;
        let filter = (settings.filter * texels as f64).max(1.0) as f32;
        let near = NEAR * size;
        Projection { axis, eye, reach, near, low, scale, texels, filter, cube, cone, size }
    };
    let away = position.map(|p| (p, centre - p, (centre - p).norm()));
    match away {
        Some((eye, _, distance)) if distance <= FAR * size => {
            let radius = 0.5 * size;
            let tangent = radius / (distance * distance - radius * radius).max(0.0).sqrt();
            if distance > radius && tangent <= WIDE {
                let axis = axes((centre - eye) / distance);
                let (lo, hi) = bounds(layers, eye, axis, true).unwrap_or_default();
                let side = (hi[0] - lo[0]).max(hi[1] - lo[1]).max(1e-9 * radius / distance);
                let low = [0.5 * (lo[0] + hi[0] - side), 0.5 * (lo[1] + hi[1] - side)];
                return Ok((vec![common(axis, eye, Some(distance), low, side * 1.0001, false)], counts));
            }
            let faces = (0..6).map(|f| {
                let mut z = Vec3::zeros();
                z[f % 3] = if f < 3 { 1.0 } else { -1.0 };
                let axis = [world[(f + 1) % 3], world[(f + 2) % 3], z];
                common(axis, eye, Some(0.5 * size), [-1.0; 2], 2.0, true)
            });
            Ok((faces.collect(), counts))
        }
        _ => {
            let travel = match away {
                Some((_, to, _)) => unit(to)?,
                None => direction,
            };
            // A spot this far away still has its cone, but all hair is on one side of it.
            let axis = axes(travel);
            let (lo, hi) = bounds(layers, centre, axis, false).unwrap_or_default();
            let side = (hi[0] - lo[0]).max(hi[1] - lo[1]).max(1e-9 * size);
            let low = [0.5 * (lo[0] + hi[0] - side), 0.5 * (lo[1] + hi[1] - side)];
            let mut map = common(axis, centre, None, low, side * 1.0001, false);
            if let (Some((middle, cosine)), Some(_)) = (cone, away) {
                map.cone = (travel.dot(&middle) < cosine).then_some((middle, cosine));
            } else {
                map.cone = None;
            }
            Ok((vec![map], counts))
        }
    }
}
