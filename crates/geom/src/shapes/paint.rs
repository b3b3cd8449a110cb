//! Maps painted by formula: every texel that a chart covers asks a function of the point in space.

use crate::{Map, Mesh, NONE, Vec3};
use rayon::prelude::*;

/// Rounds of spreading outward from the charts, texels: bilinear samples and one level of shrinking at a chart's border
/// read painted values only. Below 8 a map shrunk eightfold would mix in zeros; above, neighbouring charts meet anyway.
const SPREAD: usize = 12;

/// A one-channel map of `size` by `size` texels. Texel centres covered by a chart get `f(position, unit smooth normal)`;
/// the rest is filled outward from the charts over at least 8 texels and is 0 beyond. Where charts overlap the lowest
/// triangle paints.
pub fn paint(mesh: &Mesh, size: usize, f: impl Fn(Vec3, Vec3) -> f32 + Sync) -> Map {
    render(mesh, size, &|p, n| [f(p, n)])
}

/// As [`paint`], with three channels.
pub fn paint3(mesh: &Mesh, size: usize, f: impl Fn(Vec3, Vec3) -> [f32; 3] + Sync) -> Map {
    render(mesh, size, &f)
}

fn render<const N: usize>(mesh: &Mesh, size: usize, f: &(dyn Fn(Vec3, Vec3) -> [f32; N] + Sync)) -> Map {
    let owner = owners(mesh, size);
    let normal = normals(mesh);
    let mut texel: Vec<[f32; N]> = owner
        .par_iter()
        .enumerate()
        .map(|(k, &t)| {
            if t == NONE {
                return [0.0; N];
            }
            let w = weights(&mesh.corner_uv[t as usize], size, [(k % size) as f64, (k / size) as f64]);
            let c = mesh.corners(t);
            let m = mesh.triangle[t as usize].map(|v| normal[v as usize]);
            let n = m[0] * w[0] + m[1] * w[1] + m[2] * w[2];
            f(c[0] * w[0] + c[1] * w[1] + c[2] * w[2], n / n.norm().max(1e-12))
        })
        .collect();
    spread(&mut texel, owner.iter().map(|&t| t != NONE).collect(), size);
    Map { width: size, height: size, channels: N, data: texel.into_iter().flatten().collect() }
}

/// Triangle at each texel centre, [`NONE`] where there is none.
fn owners(mesh: &Mesh, size: usize) -> Vec<u32> {
    let mut owner = vec![NONE; size * size];
    for (t, c) in mesh.corner_uv.iter().enumerate() {
        let range = |k: usize| {
            let (lo, hi) = c.iter().fold((f32::MAX, f32::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
            let at = |x: f32| (f64::from(x) * size as f64 - 0.5).clamp(-1.0, size as f64);
            (at(lo).ceil().max(0.0) as usize)..((at(hi).floor() + 1.0) as usize).min(size)
        };
        for y in range(1) {
            for x in range(0) {
                let o = &mut owner[y * size + x];
                if *o == NONE && weights(c, size, [x as f64, y as f64]).iter().all(|w| (-1e-9..=2.0).contains(w)) {
                    *o = t as u32;
                }
            }
        }
    }
    owner
}

/// Corner weights of a texel's centre; not finite for a triangle without area.
fn weights(c: &[[f32; 2]; 3], size: usize, texel: [f64; 2]) -> [f64; 3] {
    let p = c.map(|p| p.map(|x| f64::from(x) * size as f64 - 0.5));
    let side = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let all = side(p[0], p[1], p[2]);
    [side(p[1], p[2], texel) / all, side(p[2], p[0], texel) / all, side(p[0], p[1], texel) / all]
}

/// Unit normals by area, the same at vertices of equal position.
fn normals(mesh: &Mesh) -> Vec<Vec3> {
    let key = |v: usize| mesh.position[v].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<usize> = (0..mesh.position.len()).collect();
    order.sort_unstable_by_key(|&v| (key(v), v));
    let mut sum = vec![Vec3::zeros(); order.len()];
    for (t, corner) in mesh.triangle.iter().enumerate() {
        let [a, b, c] = mesh.corners(t as u32);
        let n = (b - a).cross(&(c - a));
        corner.iter().for_each(|&v| sum[v as usize] += n);
    }
    let mut normal = vec![Vec3::zeros(); order.len()];
    for group in order.chunk_by(|&a, &b| key(a) == key(b)) {
        let n = group.iter().fold(Vec3::zeros(), |s, &v| s + sum[v]);
        group.iter().for_each(|&v| normal[v] = n / n.norm().max(1e-12));
    }
    normal
}

/// Fills texels next to filled ones with the mean of those, [`SPREAD`] times.
fn spread<const N: usize>(texel: &mut [[f32; N]], mut filled: Vec<bool>, size: usize) {
    for _ in 0..SPREAD {
        let new: Vec<Option<[f32; N]>> = (0..texel.len())
            .into_par_iter()
            .map(|k| {
                if filled[k] {
                    return None;
                }
                let (x, y) = (k % size, k / size);
                let (mut sum, mut count) = ([0.0; N], 0.0);
                for j in y.saturating_sub(1)..(y + 2).min(size) {
                    for i in x.saturating_sub(1)..(x + 2).min(size) {
                        if filled[j * size + i] {
                            (0..N).for_each(|c| sum[c] += texel[j * size + i][c]);
                            count += 1.0;
                        }
                    }
                }
                (count > 0.0).then(|| sum.map(|s| s / count))
            })
            .collect();
        for (k, value) in new.into_iter().enumerate() {
            if let Some(value) = value {
                (texel[k], filled[k]) = (value, true);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::bodies::{cube_sphere, plane};
    use crate::{SurfacePoint, Wrap};

    #[test]
    fn a_linear_function_is_painted_exactly_on_a_plane() {
        let mesh = plane(3, 3, 2.0);
        let map = paint(&mesh, 16, |p, n| (p.x + 0.5 * p.z) as f32 * n.y as f32);
        for y in 0..16 {
            for x in 0..16 {
                let (u, v) = ((x as f64 + 0.5) / 16.0, (y as f64 + 0.5) / 16.0);
                let want = (u - 0.5) * 2.0 + 0.5 * (0.5 - v) * 2.0;
                assert!((f64::from(map.data[y * 16 + x]) - want).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn samples_agree_across_chart_borders() {
        let mesh = cube_sphere(8, 1.0);
        let map = paint(&mesh, 256, |p, _| (p.x + p.y * p.z) as f32);
        for t in 0..mesh.triangle.len() as u32 {
            for bary in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5]] {
                let s = SurfacePoint { triangle: t, bary };
                let p = mesh.point(&s);
                let got = f64::from(map.sample(mesh.uv(&s), Wrap::Clamp)[0]);
                assert!((got - p.x - p.y * p.z).abs() < 0.03, "{got} {p}");
            }
        }
    }
}
