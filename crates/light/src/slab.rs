//! A cue for shadows: how much hair lies between a point and a light, from a coarse grid of slabs across the light.
//!
//! This is the idea of opacity shadow maps (paper §4) at one low resolution, without their accuracy: enough to read
//! volume in a preview, not enough to export.

use crate::preview::{Scene, in_layer};
use crate::skin_map::SkinMap;
use crate::{V3, View};
use pelage_geom::Vec3;
use rayon::prelude::*;

/// Cells along each axis of the grid. Fewer lose the parting and the locks; twice as many cost eight times the memory
/// and begin to show single hairs as noise.
const CELLS: usize = 128;

/// Cells that a point is lifted towards the light before it is looked up, so that hair does not shadow itself and the
/// outermost layer stays lit. At 0 everything is dull, over 2 thin fur casts no shadow.
const LIFT: f32 = 0.75;

/// Parts that are summed apart and then together in this order: the same sum for any number of threads.
const PARTS: usize = 4;

/// Coordinates along axes, if they are usable.
pub(crate) fn along(axis: [Vec3; 3], p: Vec3) -> Option<[f64; 3]> {
    let c = axis.map(|a| a.dot(&p));
    c.iter().all(|v| v.abs() < HUGE).then_some(c)
}

/// Least and most of coordinates; `None` without any. They are the same in any order.
pub(crate) fn bounds(points: impl ParallelIterator<Item = [f64; 3]>) -> Option<([f64; 3], [f64; 3])> {
    let none = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let join = |(a, b): ([f64; 3], [f64; 3]), (c, d): ([f64; 3], [f64; 3])| {
        (std::array::from_fn(|i| a[i].min(c[i])), std::array::from_fn(|i| b[i].max(d[i])))
    };
    let (lo, hi) = points.fold(|| none, |bounds, c| join(bounds, (c, c))).reduce(|| none, join);
    (lo[0] <= hi[0]).then_some((lo, hi))
}

/// Light-aligned box cut into cells: coordinates in cells from a low corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Box3 {
    axis: [Vec3; 3],
    low: [f64; 3],
    /// Cells per scene unit along each axis.
    pub per_unit: [f64; 3],
}

impl Box3 {
    /// Bounds of points along `axis`, cut into `cells` each way; `None` without a finite point.
    pub fn around(axis: [Vec3; 3], cells: usize, points: impl ParallelIterator<Item = Vec3>) -> Option<Box3> {
        let (lo, hi) = bounds(points.filter_map(|p| along(axis, p)))?;
        let largest = (0..3).map(|i| hi[i] - lo[i]).fold(f64::NEG_INFINITY, f64::max);
        // A flat box would have cells of no size, and so shadows without bound.
        let least = if largest > 0.0 { largest / 16.0 } else { 1.0 };
        let size: [f64; 3] = std::array::from_fn(|i| (hi[i] - lo[i]).max(least) * 1.001);
        let low = std::array::from_fn(|i| 0.5 * (lo[i] + hi[i] - size[i]));
        Some(Box3 { axis, low, per_unit: size.map(|s| cells as f64 / s) })
    }

    /// Coordinates of a point of scene space, in cells.
    pub fn place(&self, p: Vec3) -> [f64; 3] {
        std::array::from_fn(|i| (self.axis[i].dot(&p) - self.low[i]) * self.per_unit[i])
    }

    /// The same coordinates from camera space.
    pub fn seen_by(&self, view: &View) -> Affine {
        let origin = self.place(view.eye);
        Affine(std::array::from_fn(|i| {
            let a = view.turn(self.axis[i]) * self.per_unit[i];
            [a.x as f32, a.y as f32, a.z as f32, origin[i] as f32]
        }))
    }
}

/// Coordinates beyond this count as not finite: their squares still fit single precision.
pub(crate) const HUGE: f64 = 1e18;

/// Camera space to cells.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Affine([[f32; 4]; 3]);

impl Affine {
    #[inline]
    pub fn apply(&self, p: V3) -> [f32; 3] {
        self.0.map(|r| r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3])
    }

    /// A direction.
    pub fn turn(&self, d: V3) -> V3 {
        self.0.map(|r| r[0] * d.x + r[1] * d.y + r[2] * d.z).into()
    }
}

/// What one light sees: optical depth of hair in a grid, and depth of skin in a map.
pub(crate) struct Slabs {
    /// Camera space to the hair's cells, and per column `CELLS + 1` sums of optical depth down from the light.
    hair: Option<(Affine, Vec<f32>)>,
    skin: Option<SkinMap>,
}

impl Slabs {
    /// Looks at a scene along a light that lies in the direction `to_light` (unit).
    pub fn new(scene: &Scene, to_light: Vec3, view: &View) -> Slabs {
        let z = -to_light;
        let x = if z.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
        let x = (x - z * z.dot(&x)).normalize();
        let axis = [x, z.cross(&x), z];
        let points = scene.layers.par_iter().flat_map(|l| l.position.par_iter().map(|p| in_layer(l, p)));
        let hair = Box3::around(axis, CELLS, points).map(|b| (b.seen_by(view), hair_grid(scene, &b)));
        let skin = scene.skin.as_ref().and_then(|s| SkinMap::new(s, axis, view));
        Slabs { hair, skin }
    }

    /// Optical depth of the hair between a point of camera space and the light.
    pub fn hair_depth(&self, p: V3) -> f32 {
        let Some((affine, sum)) = &self.hair else { return 0.0 };
        let [x, y, z] = affine.apply(p);
        let n = CELLS as f32;
        if !(x > -0.5 && y > -0.5 && x < n + 0.5 && y < n + 0.5 && z.is_finite()) {
            return 0.0;
        }
        let z = (z - LIFT).clamp(0.0, n - 1e-3);
        let (k, fz) = split(z);
        let (x, y) = ((x - 0.5).clamp(0.0, n - 1.001), (y - 0.5).clamp(0.0, n - 1.001));
        let ((i, fx), (j, fy)) = (split(x), split(y));
        let at = |i: usize, j: usize| {
            let c = (j * CELLS + i) * (CELLS + 1) + k;
            sum[c] + (sum[c + 1] - sum[c]) * fz
        };
        let low = at(i, j) * (1.0 - fx) + at(i + 1, j) * fx;
        let high = at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx;
        low * (1.0 - fy) + high * fy
    }

    /// Part of the light that no skin is in the way of, in [0, 1]. `normal` is the unit normal of the skin if the point is
    /// on it, else zero.
    pub fn skin_light(&self, p: V3, normal: V3) -> f32 {
        self.skin.as_ref().map_or(1.0, |map| map.light(p, normal))
    }
}

/// Whole and broken part of a number in [0, 2^31).
#[inline]
fn split(x: f32) -> (usize, f32) {
    let i = x as i32;
    (i as usize, x - i as f32)
}

/// Optical depth (opacity times covered part of a cell's cross-section) of all hairs, summed down each column.
fn hair_grid(scene: &Scene, cells: &Box3) -> Vec<f32> {
    let part = |k: usize| {
        let mut grid = vec![0.0f32; CELLS * CELLS * CELLS];
        for layer in scene.layers {
            let n = layer.offsets.len();
            for s in n * k / PARTS..n * (k + 1) / PARTS {
                splat(layer, s, cells, &mut grid);
            }
        }
        grid
    };
    let parts: Vec<Vec<f32>> = (0..PARTS).into_par_iter().map(part).collect();
    let mut sum = vec![0.0f32; CELLS * CELLS * (CELLS + 1)];
    sum.par_chunks_mut(CELLS + 1).enumerate().for_each(|(c, column)| {
        for k in 0..CELLS {
            let cell = parts.iter().fold(0.0, |a, p| a + p[c * CELLS + k]);
            column[k + 1] = column[k] + cell;
        }
    });
    drop(parts);
    blur(&blur(&sum, 1), CELLS)
}

/// Adds one strand to the grid: its true projected area, spread along it at less than a cell's distance.
fn splat(layer: &crate::HairView, s: usize, cells: &Box3, grid: &mut [f32]) {
    let range = layer.offsets.range(s);
    let opacity = layer.opacity(s);
    // What a cell's side is worth along the one axis, where area counts in cells.
    let [by_u, by_v] = [cells.per_unit[1], cells.per_unit[0]].map(|v| v as f32);
    let place = |i: usize| {
        let p = layer.position.get(i).map_or([0.0; 3], |p| cells.place(in_layer(layer, p)));
        (p.map(|v| v as f32), layer.width(i))
    };
    let mut b = place(range.start);
    for i in range.start + 1..range.end.min(layer.position.len()) {
        let a = std::mem::replace(&mut b, place(i));
        let d: [f32; 3] = std::array::from_fn(|c| b.0[c] - a.0[c]);
        let long = d.iter().fold(0.0f32, |m, v| m.max(v.abs()));
        if !long.is_finite() {
            continue;
        }
        let steps = ((long * 1.2) as usize).min(4 * CELLS) + 1;
        let step = 1.0 / steps as f32;
        // Length seen from the light times width.
        let (u, v) = (d[0] * by_u, d[1] * by_v);
        let each = (u * u + v * v).sqrt() * (0.5 * (a.1 + b.1)) * opacity * step;
        for k in 0..steps {
            let f = (k as f32 + 0.5) * step;
            let c: [f32; 3] = std::array::from_fn(|i| a.0[i] + d[i] * f);
            if c.iter().all(|v| *v >= 0.0 && *v < CELLS as f32) {
                let [x, y, z] = c.map(|v| v as u32 as usize);
                grid[(y * CELLS + x) * CELLS + z] += each;
            }
        }
    }
}

/// Weights 1/4, 1/2, 1/4 over columns `stride` apart within rows of [`CELLS`] (stride 1) or over rows; borders repeat.
fn blur(sum: &[f32], stride: usize) -> Vec<f32> {
    let n = CELLS + 1;
    let mut out = vec![0.0f32; sum.len()];
    out.par_chunks_mut(n).enumerate().for_each(|(c, column)| {
        let at = c / stride % CELLS;
        let low = if at > 0 { c - stride } else { c };
        let high = if at + 1 < CELLS { c + stride } else { c };
        for (k, v) in column.iter_mut().enumerate() {
            *v = 0.25 * (sum[low * n + k] + sum[high * n + k]) + 0.5 * sum[c * n + k];
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Camera, HairView};
    use pelage_geom::{Offsets, rng};

    #[test]
    fn optical_depth_of_random_hairs_is_their_projected_area() {
        let (n, width, opacity) = (20_000usize, 0.01f32, 0.7f32);
        let u = |i: usize, c: u64| rng::uniform(11, i as u64, c, 0) as f32;
        let mut position = Vec::new();
        let mut area = 0.0;
        for i in 0..n {
            let a = [4.0 * u(i, 0), 4.0 * u(i, 1), 4.0 * u(i, 2)];
            let b = [4.0 * u(i, 3), 4.0 * u(i, 4), 4.0 * u(i, 5)];
            position.extend([a, b]);
            // Seen along y.
            area += ((a[0] - b[0]).powi(2) + (a[2] - b[2]).powi(2)).sqrt() * width;
        }
        let offsets = Offsets::uniform(n, 2);
        let layers = [HairView {
            offsets: &offsets,
            position: &position,
            origin: [0.0; 3],
            width: &vec![width; 2 * n],
            color: &[],
            opacity: &vec![opacity; n],
            root_normal: &[],
            shine: &[],
            side: &[],
            transmittance: &[],
        }];
        let scene = Scene { skin: None, layers: &layers, lights: &[], background: [0.0; 3] };
        let camera = Camera {
            eye: [2.0, 2.0, 30.0],
            target: [2.0; 3],
            up: [0.0, 1.0, 0.0],
            fov_y_deg: 30.0,
            near: 0.1,
            parallel_height: None,
        };
        let view = camera.view(100, 100);
        let slabs = Slabs::new(&scene, Vec3::y(), &view);
        let depth = |x: f64, y: f64, z: f64| slabs.hair_depth(view.to_camera(Vec3::new(x, y, z)).cast());
        let (mut sum, mut last) = (0.0, 0.0);
        for i in 0..400 {
            let (x, z) = (0.2 * f64::from(i % 20) + 0.1, 0.2 * f64::from(i / 20) + 0.1);
            sum += depth(x, -1.0, z);
        }
        let mean = opacity * area / 16.0;
        assert!((sum / 400.0 / mean - 1.0).abs() < 0.03, "{} instead of {mean}", sum / 400.0);
        for k in 0..=40 {
            let d = depth(2.0, 4.0 - 0.1 * f64::from(k), 2.0);
            assert!(d >= last);
            last = d;
        }
        assert_eq!((depth(2.0, 5.0, 2.0), depth(-9.0, 0.0, 2.0)), (0.0, 0.0));
    }
}
