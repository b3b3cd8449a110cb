//! Radius tables: a part of a body as its radius over azimuth and height, or over azimuth and polar angle (Kurihara,
//! Anjyo, Thalmann 1993, §3).

use super::Hit;
use crate::Vec3;
use nalgebra::Matrix3;
use pelage_geom::Bvh;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Least cosine between a stored normal and the direction away from the axis or centre: steeper ones are bent. With
/// less, slopes that run along the look-up give distances of almost nothing for points far outside.
const LEAST: f64 = 0.2;

/// What a table is indexed by.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Map {
    /// Azimuth and height along the axis, up to this one, metres.
    Cylinder(f64),
    /// Azimuth and polar angle from the axis.
    Sphere,
}

/// One part of a body by its radius.
#[derive(Clone, Debug)]
pub struct Table {
    /// Samples that no ray hit; their radius is 0.
    pub missed: usize,
    map: Map,
    origin: Vec3,
    /// Rows: across, axis, across.
    axes: Matrix3<f64>,
    /// Samples around and along.
    size: [usize; 2],
    /// Metres; azimuth fastest.
    radius: Vec<f32>,
    /// Unit normals in the table's axes.
    normal: Vec<[f32; 3]>,
    largest: f64,
}

impl Table {
    /// Table over the cylinder of `radius` metres around the axis from `from` to `to`: of what lies in it, the outermost
    /// surface by rays at right angles to the axis, `size` samples around and along (at least 3 and 2). The ends are
    /// flat.
    pub fn cylinder(bvh: &Bvh, from: Vec3, to: Vec3, radius: f64, size: [usize; 2]) -> Self {
        Table::build(bvh, Map::Cylinder((to - from).norm()), from, to - from, radius, size)
    }

    /// Table over the ball of `radius` metres around `centre`: the outermost surface in it by rays towards the centre,
    /// `size` samples around `axis` and from it to its opposite (at least 3 and 2).
    pub fn sphere(bvh: &Bvh, centre: Vec3, axis: Vec3, radius: f64, size: [usize; 2]) -> Self {
        Table::build(bvh, Map::Sphere, centre, axis, radius, size)
    }

    fn build(bvh: &Bvh, map: Map, origin: Vec3, axis: Vec3, radius: f64, size: [usize; 2]) -> Self {
        let y = axis.try_normalize(0.0).unwrap_or_else(Vec3::y);
        let side = if y.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
        let x = y.cross(&side).normalize();
        let axes = Matrix3::from_rows(&[x.transpose(), y.transpose(), x.cross(&y).transpose()]);
        let size = [size[0].max(3), size[1].max(2)];
        let sample = |k: usize| {
            let (height, out) = direction(map, size, k);
            let (foot, away) = (origin + y * height, axes.transpose() * out);
            let hit = bvh.ray(foot + away * radius, -away, radius);
            hit.map_or((0.0, out, false), |(t, _)| {
                let at = foot + away * (radius - t);
                let normal = bvh.closest(at, 1e-6 * radius).map_or(away, |c| c.normal);
                (radius - t, bent(axes * normal, out), true)
            })
        };
        let samples: Vec<(f64, Vec3, bool)> = (0..size[0] * size[1]).into_par_iter().map(sample).collect();
        Table {
            missed: samples.iter().filter(|s| !s.2).count(),
            map,
            origin,
            axes,
            size,
            largest: samples.iter().map(|s| s.0).fold(0.0, f64::max),
            radius: samples.iter().map(|s| s.0 as f32).collect(),
            normal: samples.iter().map(|s| [s.1.x as f32, s.1.y as f32, s.1.z as f32]).collect(),
        }
    }

    /// Point Q of the table with the azimuth and the height (or polar angle) of P gives normal N and the nearest point T:
    /// PT = (PQ.N) N (equation 11). Inside or outside goes by the radii.
    pub fn sample(&self, p: Vec3) -> Hit {
        let l = self.axes * (p - self.origin);
        let around = libm::atan2(l.z, l.x) * (self.size[0] as f64 / TAU);
        let (along, r, beyond) = match self.map {
            Map::Cylinder(height) => {
                let y = l.y.max(0.0).min(height);
                (if height > 0.0 { y / height } else { 0.0 }, leg(l.x, l.z), (l.y - height).max(-l.y))
            }
            Map::Sphere => (libm::atan2(leg(l.x, l.z), l.y) / PI, l.norm(), f64::NEG_INFINITY),
        };
        let (radius, normal) = self.look_up(around, along * (self.size[1] - 1) as f64);
        let out = match self.map {
            Map::Cylinder(_) => Vec3::new(l.x, 0.0, l.z),
            Map::Sphere => l,
        };
        let out = out.try_normalize(1e-12).unwrap_or(normal);
        let slope = normal.dot(&out);
        let side = (r - radius) * slope.max(LEAST);
        let (distance, normal) = self.with_ends(side, normal, beyond, l.y);
        Hit { distance, normal: self.axes.transpose() * normal, velocity: Vec3::zeros() }
    }

    /// Lower bound of the distance to what the table holds, outside; below zero inside: that of the cylinder or ball of
    /// its largest radius. No trigonometry, so that it serves as a cull.
    pub fn distance_bound(&self, p: Vec3) -> f64 {
        let l = self.axes * (p - self.origin);
        match self.map {
            Map::Sphere => l.norm() - self.largest,
            Map::Cylinder(height) => {
                let (side, end) = (leg(l.x, l.z) - self.largest, (l.y - height).max(-l.y));
                if side > 0.0 && end > 0.0 { leg(side, end) } else { side.max(end) }
            }
        }
    }

    /// Cuts a cylinder's table off at its ends: `beyond` is the distance past the nearer of them.
    fn with_ends(&self, side: f64, normal: Vec3, beyond: f64, y: f64) -> (f64, Vec3) {
        let end = if y > 0.0 { Vec3::y() } else { -Vec3::y() };
        if side > 0.0 && beyond > 0.0 {
            let distance = leg(side, beyond);
            let blended = normal * side + end * beyond;
            (distance, blended.try_normalize(1e-12 * distance).unwrap_or(end))
        } else if beyond > side {
            // Inside, nearer to the end in the lower half is the lower end.
            let end = match self.map {
                Map::Cylinder(height) if 2.0 * y < height => -Vec3::y(),
                _ => Vec3::y(),
            };
            (beyond, end)
        } else {
            (side, normal)
        }
    }

    /// Bilinear radius and unit normal (equations 8 to 10); the azimuth wraps.
    fn look_up(&self, around: f64, along: f64) -> (f64, Vec3) {
        let [m, n] = self.size;
        let around = if around < 0.0 { around + m as f64 } else { around };
        let (i, j) = ((around as usize).min(m - 1), (along as usize).min(n - 2));
        let (s, t) = (around - i as f64, along - j as f64);
        let next = if i + 1 == m { 0 } else { i + 1 };
        let corner = [i + m * j, next + m * j, i + m * (j + 1), next + m * (j + 1)];
        let weight = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        let (mut radius, mut normal) = (0.0, Vec3::zeros());
        for (k, w) in corner.into_iter().zip(weight) {
            radius += w * f64::from(self.radius[k]);
            normal += Vec3::from(self.normal[k].map(f64::from)) * w;
        }
        (radius, normal.try_normalize(1e-6).unwrap_or_else(Vec3::y))
    }
}

/// Height on the axis and direction away from it, in the table's axes, of sample `k`.
fn direction(map: Map, [m, n]: [usize; 2], k: usize) -> (f64, Vec3) {
    let (sin, cos) = libm::sincos((k % m) as f64 * (TAU / m as f64));
    let along = (k / m) as f64 / (n - 1) as f64;
    match map {
        Map::Cylinder(height) => (height * along, Vec3::new(cos, 0.0, sin)),
        Map::Sphere => {
            let (across, up) = libm::sincos(PI * along);
            (0.0, Vec3::new(cos * across, up, sin * across))
        }
    }
}

/// A normal brought to [`LEAST`] along `out` if it has less.
fn bent(normal: Vec3, out: Vec3) -> Vec3 {
    let c = normal.dot(&out);
    if c >= LEAST {
        return normal;
    }
    let across = (normal - out * c).try_normalize(1e-9).unwrap_or_else(Vec3::zeros);
    (out * LEAST + across * (1.0 - LEAST * LEAST).sqrt()).normalize()
}

/// Length of two legs from products and a root, which is the same on every machine.
fn leg(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
