//! Hairs to try the look on.

use pelage_geom::Vec3;
use pelage_geom::rng::uniform;
use pelage_groom::look::axes::RootAxes;

pub type V = Vec3;

/// Random number in -1..1.
pub fn r(seed: u64, id: u64, k: u64) -> f64 {
    2.0 * uniform(seed, id, 99, k) - 1.0
}

/// `n` bent hairs of `points` points over a field of side `side`.
pub fn hairs(n: usize, points: usize, side: f64) -> Vec<[f32; 3]> {
    let mut out = Vec::new();
    for h in 0..n as u64 {
        let mut p = V::new(r(1, h, 0) * side, 0.0, r(1, h, 1) * side);
        let bend = V::new(r(2, h, 0), r(2, h, 1), r(2, h, 2)) * 0.1;
        let mut d = V::new(r(3, h, 0) * 0.4, 1.0, r(3, h, 1) * 0.4);
        for _ in 0..points {
            out.push(single(p));
            d = (d + bend).normalize();
            p += d * (4.0 / (points - 1) as f64);
        }
    }
    out
}

/// A straight hair of `points` points and length `length` along y.
pub fn straight(points: usize, length: f64) -> Vec<[f32; 3]> {
    (0..points).map(|k| [0.5, (length * k as f64 / (points - 1) as f64) as f32, -0.25]).collect()
}

pub fn single(p: V) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

pub fn double(p: [f32; 3]) -> V {
    V::from(p.map(f64::from))
}

/// Axes of the roots as the first segments have them, x somewhere across.
pub fn axes(points: usize, position: &[[f32; 3]]) -> Vec<RootAxes> {
    let of = |hair: &[[f32; 3]]| {
        let t = (double(hair[1]) - double(hair[0])).normalize();
        let x = V::z() - t * t.z;
        RootAxes { tangent: single(t), normal: single(x.normalize()) }
    };
    position.chunks_exact(points).map(of).collect()
}

/// Tangents and x axes along a hair in double precision: tangents halve the angle between segments, the axis is carried by
/// the smallest rotation, as a rotation about the cross product.
pub fn frames(hair: &[[f32; 3]], root: &RootAxes) -> Vec<[V; 3]> {
    let p: Vec<V> = hair.iter().map(|p| double(*p)).collect();
    let n = p.len();
    let d: Vec<V> = (0..n - 1).map(|k| (p[k + 1] - p[k]).normalize()).collect();
    let tangent = |k: usize| match k {
        0 => d[0],
        k if k == n - 1 => d[n - 2],
        k => (d[k - 1] + d[k]).normalize(),
    };
    let (mut t0, mut x) = (double(root.tangent), double(root.normal));
    (0..n)
        .map(|k| {
            let t = tangent(k);
            let (axis, angle) = (t0.cross(&t), t0.dot(&t).clamp(-1.0, 1.0));
            if axis.norm() > 1e-12 {
                let a = axis.normalize();
                let (cos, sin) = (angle, axis.norm());
                x = x * cos + a.cross(&x) * sin + a * (a.dot(&x) * (1.0 - cos));
            }
            t0 = t;
            [t, x, t.cross(&x)]
        })
        .collect()
}

pub fn length(hair: &[[f32; 3]]) -> f64 {
    hair.windows(2).map(|w| (double(w[1]) - double(w[0])).norm()).sum()
}

/// Largest distance between two lists of points.
pub fn apart(a: &[[f32; 3]], b: &[V]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (double(*a) - b).norm()).fold(0.0, f64::max)
}
