//! Texture coordinates of one chart: a piece of a surface laid flat without a flip and with little stretch.
//!
//! Starts from the embedding of Tutte (1963, "How to draw a graph") on a circle, which has no flips, and descends the
//! symmetric Dirichlet energy (Smith, Schaefer 2015, "Bijective Parameterization with Free Boundaries"), which grows
//! without bound before a triangle flips. Steps are quasi-Newton (L-BFGS) with the cotangent Laplacian as metric.

use super::banded::Banded;
use crate::Vec3;
use std::collections::VecDeque;

type Uv = Vec<[f64; 2]>;

/// One triangle at rest: `jacobian = [d1 d2] * inverse` for the uv differences of corners 1 and 2 to corner 0.
struct Rest {
    area: f64,
    inverse: [[f64; 2]; 2],
    cotangent: [f64; 3],
}

/// Most steps of descent. With a third of them charts with holes keep visible shear; more cost time and change stretch by
/// less than a percent.
const STEPS: usize = 120;

/// Lays a chart flat: one (u, v) a vertex in scene units, counter-clockwise where `triangle` is counter-clockwise from
/// outside. The chart must be connected; holes are left free.
pub fn unwrap(position: &[Vec3], triangle: &[[u32; 3]]) -> Uv {
    let rest: Vec<Rest> = triangle.iter().map(|t| Rest::new(t.map(|v| position[v as usize]))).collect();
    let mut uv = tutte(position, triangle);
    let area: f64 = rest.iter().map(|r| r.area).sum();
    let radius = (area / std::f64::consts::PI).sqrt();
    uv.iter_mut().for_each(|p| *p = p.map(|c| c * radius));
    let metric = laplacian(position.len(), triangle, &rest);
    descend(&mut uv, triangle, &rest, &metric);
    uv
}

impl Rest {
    fn new(c: [Vec3; 3]) -> Rest {
        let (a, b) = (c[1] - c[0], c[2] - c[0]);
        let double = a.cross(&b).norm().max(1e-12);
        let (x1, x2) = (a.norm(), a.dot(&b) / a.norm());
        let y2 = double / x1;
        let cot = |i: usize| {
            let (p, q) = (c[(i + 1) % 3] - c[i], c[(i + 2) % 3] - c[i]);
            p.dot(&q) / double
        };
        Rest {
            area: 0.5 * double,
            inverse: [[1.0 / x1, -x2 / (x1 * y2)], [0.0, 1.0 / y2]],
            cotangent: [cot(0), cot(1), cot(2)],
        }
    }
}

/// Border vertices in order, counter-clockwise in the flat chart; of several loops the longest.
pub fn border(vertices: usize, triangle: &[[u32; 3]]) -> Vec<u32> {
    let mut edge: Vec<[u32; 2]> = triangle.iter().flat_map(|t| (0..3).map(|i| [t[i], t[(i + 1) % 3]])).collect();
    edge.sort_unstable();
    let mut next = vec![u32::MAX; vertices];
    for e in &edge {
        if edge.binary_search(&[e[1], e[0]]).is_err() {
            next[e[0] as usize] = e[1];
        }
    }
    let mut best = Vec::new();
    for start in 0..vertices {
        let (mut ring, mut at) = (Vec::new(), start);
        while next[at] != u32::MAX {
            ring.push(at as u32);
            at = std::mem::replace(&mut next[at], u32::MAX) as usize;
        }
        if ring.len() > best.len() {
            best = ring;
        }
    }
    best
}

/// Border on the unit circle by arc length, every other vertex at the mean of its neighbours.
fn tutte(position: &[Vec3], triangle: &[[u32; 3]]) -> Uv {
    let ring = border(position.len(), triangle);
    let step = |i: usize| (position[ring[(i + 1) % ring.len()] as usize] - position[ring[i] as usize]).norm();
    let total: f64 = (0..ring.len()).map(step).sum();
    let mut uv = vec![[0.0; 2]; position.len()];
    let (mut inner, mut run) = (vec![true; position.len()], 0.0);
    for (i, &v) in ring.iter().enumerate() {
        let (s, c) = libm::sincos(std::f64::consts::TAU * run / total);
        uv[v as usize] = [c, s];
        inner[v as usize] = false;
        run += step(i);
    }
    let mut number = vec![usize::MAX; position.len()];
    let mut inside = Vec::new();
    for v in (0..position.len()).filter(|&v| inner[v]) {
        number[v] = inside.len();
        inside.push(v);
    }
    let (mut diagonal, mut entries, mut right) = (vec![0.0; inside.len()], Vec::new(), vec![[0.0; 2]; inside.len()]);
    let mut edge: Vec<[u32; 2]> =
        triangle.iter().flat_map(|t| (0..3).map(|i| [t[i].min(t[(i + 1) % 3]), t[i].max(t[(i + 1) % 3])])).collect();
    edge.sort_unstable();
    edge.dedup();
    for [a, b] in edge.iter().map(|e| e.map(|v| v as usize)) {
        if inner[a] && inner[b] {
            entries.push((number[a], number[b], -1.0));
        }
        for (v, w) in [(a, b), (b, a)] {
            if inner[v] {
                diagonal[number[v]] += 1.0;
                if !inner[w] {
                    (0..2).for_each(|c| right[number[v]][c] += uv[w][c]);
                }
            }
        }
    }
    let solved = Banded::new(&diagonal, &entries).solve(&right);
    inside.iter().zip(solved).for_each(|(&v, p)| uv[v] = p);
    uv
}

/// Cotangent Laplacian, made regular by a trace of mass.
fn laplacian(vertices: usize, triangle: &[[u32; 3]], rest: &[Rest]) -> Banded {
    let (mut diagonal, mut entries) = (vec![1e-4; vertices], Vec::with_capacity(triangle.len() * 3));
    for (t, r) in triangle.iter().zip(rest) {
        for i in 0..3 {
            let (a, b) = (t[(i + 1) % 3] as usize, t[(i + 2) % 3] as usize);
            // Twice the usual half: near the rest shape the energy's second derivative is about this.
            let w = r.cotangent[i].max(0.02);
            diagonal[a] += w;
            diagonal[b] += w;
            entries.push((a, b, -w));
        }
    }
    Banded::new(&diagonal, &entries)
}

/// Jacobian of a triangle: columns are the images of the rest triangle's axes.
fn jacobian(uv: &[[f64; 2]], t: [u32; 3], r: &Rest) -> [[f64; 2]; 2] {
    let [a, b, c] = t.map(|v| uv[v as usize]);
    let d = [[b[0] - a[0], c[0] - a[0]], [b[1] - a[1], c[1] - a[1]]];
    let m = &r.inverse;
    std::array::from_fn(|i| std::array::from_fn(|j| d[i][0] * m[0][j] + d[i][1] * m[1][j]))
}

/// Energy, infinite if a triangle is flipped; adds the gradient to `gradient` if given.
fn energy(uv: &[[f64; 2]], triangle: &[[u32; 3]], rest: &[Rest], mut gradient: Option<&mut Uv>) -> f64 {
    let mut sum = 0.0;
    for (t, r) in triangle.iter().zip(rest) {
        let j = jacobian(uv, *t, r);
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        if det <= 1e-9 {
            return f64::INFINITY;
        }
        let square = j[0][0] * j[0][0] + j[0][1] * j[0][1] + j[1][0] * j[1][0] + j[1][1] * j[1][1];
        let inverse = 1.0 / (det * det);
        sum += r.area * square * (1.0 + inverse);
        if let Some(g) = gradient.as_deref_mut() {
            let (a, b) = (2.0 * r.area * (1.0 + inverse), -2.0 * r.area * square * inverse / det);
            let d = [
                [a * j[0][0] + b * j[1][1], a * j[0][1] - b * j[1][0]],
                [a * j[1][0] - b * j[0][1], a * j[1][1] + b * j[0][0]],
            ];
            for i in 0..2 {
                let one = d[i][0] * r.inverse[0][0] + d[i][1] * r.inverse[0][1];
                let two = d[i][0] * r.inverse[1][0] + d[i][1] * r.inverse[1][1];
                g[t[1] as usize][i] += one;
                g[t[2] as usize][i] += two;
                g[t[0] as usize][i] -= one + two;
            }
        }
    }
    sum
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum()
}

fn add(a: &mut [[f64; 2]], b: &[[f64; 2]], s: f64) {
    a.iter_mut().zip(b).for_each(|(a, b)| (0..2).for_each(|c| a[c] += s * b[c]));
}

/// Largest step along `d` before some triangle loses its area.
fn limit(uv: &[[f64; 2]], d: &[[f64; 2]], triangle: &[[u32; 3]]) -> f64 {
    let mut best = f64::INFINITY;
    for t in triangle {
        let e = |x: &[[f64; 2]], k: usize, c: usize| x[t[k] as usize][c] - x[t[0] as usize][c];
        let cross = |x: &[[f64; 2]], y: &[[f64; 2]]| e(x, 1, 0) * e(y, 2, 1) - e(x, 1, 1) * e(y, 2, 0);
        let (a, b, c) = (cross(d, d), cross(uv, d) + cross(d, uv), cross(uv, uv));
        // First positive root of a s^2 + b s + c, c > 0, in the form without cancellation.
        let disc = b * b - 4.0 * a * c;
        if disc >= 0.0 {
            let den = -b + disc.sqrt() * if b > 0.0 { -1.0 } else { 1.0 };
            for s in [2.0 * c / den, den / (2.0 * a)] {
                if s > 0.0 && s < best {
                    best = s;
                }
            }
        }
    }
    best
}

/// L-BFGS of eight pairs with backtracking that keeps every triangle's sign.
fn descend(uv: &mut Uv, triangle: &[[u32; 3]], rest: &[Rest], metric: &Banded) {
    let mut g = vec![[0.0; 2]; uv.len()];
    let mut value = energy(uv, triangle, rest, Some(&mut g));
    let mut memory: VecDeque<(Uv, Uv, f64)> = VecDeque::new();
    for _ in 0..STEPS {
        let mut q = g.clone();
        let mut weight = Vec::new();
        for (s, y, sy) in memory.iter().rev() {
            let a = dot(s, &q) / sy;
            add(&mut q, y, -a);
            weight.push(a);
        }
        let mut d = metric.solve(&q);
        for ((s, y, sy), a) in memory.iter().zip(weight.iter().rev()) {
            let b = dot(y, &d) / sy;
            add(&mut d, s, a - b);
        }
        let slope = -dot(&d, &g);
        if slope >= 0.0 {
            memory.clear();
            continue;
        }
        d.iter_mut().for_each(|x| *x = x.map(|c| -c));
        let mut step = (0.9 * limit(uv, &d, triangle)).min(1.0);
        let (old, before) = (uv.clone(), value);
        loop {
            uv.clone_from(&old);
            add(uv, &d, step);
            value = energy(uv, triangle, rest, None);
            if value <= before + 1e-4 * step * slope || step < 1e-12 {
                break;
            }
            step *= 0.5;
        }
        let mut new = vec![[0.0; 2]; uv.len()];
        value = energy(uv, triangle, rest, Some(&mut new));
        let (mut s, mut y) = (uv.clone(), new.clone());
        add(&mut s, &old, -1.0);
        add(&mut y, &g, -1.0);
        let sy = dot(&s, &y);
        if sy > 1e-12 {
            memory.push_back((s, y, sy));
            if memory.len() > 8 {
                memory.pop_front();
            }
        }
        g = new;
        if before - value < 1e-6 * before {
            break;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bent sheet of n x n vertices.
    fn sheet(n: usize, bend: impl Fn(f64, f64) -> Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let at = |i: usize| i as f64 / (n - 1) as f64;
        let position = (0..n * n).map(|k| bend(at(k % n), at(k / n))).collect();
        let mut triangle = Vec::new();
        for k in (0..n * (n - 1)).filter(|k| k % n + 1 < n) {
            let (a, b, c, d) = (k as u32, k as u32 + 1, (k + n) as u32, (k + n) as u32 + 1);
            triangle.extend([[a, b, d], [a, d, c]]);
        }
        (position, triangle)
    }

    #[test]
    fn a_rolled_sheet_comes_out_without_stretch() {
        let (p, t) = sheet(15, |x, y| Vec3::new(libm::sin(2.0 * x), y, libm::cos(2.0 * x)));
        let uv = unwrap(&p, &t);
        for t in &t {
            for i in 0..3 {
                let (a, b) = (t[i] as usize, t[(i + 1) % 3] as usize);
                let flat = libm::hypot(uv[a][0] - uv[b][0], uv[a][1] - uv[b][1]);
                assert!((flat / (p[a] - p[b]).norm() - 1.0).abs() < 0.01);
            }
        }
    }

    #[test]
    fn the_energy_gradient_matches_differences() {
        let (p, t) = sheet(4, |x, y| Vec3::new(x, y, x * y));
        let rest: Vec<Rest> = t.iter().map(|t| Rest::new(t.map(|v| p[v as usize]))).collect();
        let mut uv: Uv = p.iter().map(|p| [1.2 * p.x + 0.1 * p.y * p.y, 0.9 * p.y]).collect();
        let mut g = vec![[0.0; 2]; uv.len()];
        energy(&uv, &t, &rest, Some(&mut g));
        for v in [0, 5, 10] {
            for c in 0..2 {
                let x = uv[v][c];
                uv[v][c] = x + 1e-5;
                let high = energy(&uv, &t, &rest, None);
                uv[v][c] = x - 1e-5;
                let low = energy(&uv, &t, &rest, None);
                uv[v][c] = x;
                assert!(((high - low) / 2e-5 - g[v][c]).abs() < 1e-6 * (1.0 + g[v][c].abs()));
            }
        }
    }
}
