//! Borders of patches: which of their vertices are one, and which lie on another patch's border.

use super::Patch;
use crate::Vec3;

/// Pieces that a border edge is looked at in when a point's place on it is sought: enough that a cell's border turns by
/// less than a right angle in each.
const PIECES: usize = 8;

/// Steps of the golden section, which shrink a place's range to a thousandth.
const STEPS: usize = 15;

/// Gauss-Newton steps after it, each of which doubles the digits where a point lies on the curve.
const POLISH: usize = 4;

/// A patch with its cells and the number of its first vertex; u runs faster.
pub(super) struct Border<'a> {
    pub patch: &'a Patch,
    pub cells: [usize; 2],
    pub first: u32,
}

/// A vertex of one patch on a side of a cell of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inserted {
    pub patch: usize,
    pub cell: [usize; 2],
    /// 0 to 3: v low, u high, v high, u low; along each the cell is run around counter-clockwise.
    pub side: usize,
    pub vertex: u32,
    pub uv: [f64; 2],
}

/// An edge of a patch's border.
struct Edge {
    patch: usize,
    cell: [usize; 2],
    side: usize,
    vertex: [u32; 2],
    from: [f64; 2],
    to: [f64; 2],
}

impl Edge {
    fn uv(&self, t: f64) -> [f64; 2] {
        std::array::from_fn(|i| self.from[i] * (1.0 - t) + self.to[i] * t)
    }
}

impl Border<'_> {
    /// Edges around the patch, each in the direction of its cell.
    fn edges(&self, patch: usize) -> Vec<Edge> {
        let [nu, nv] = self.cells;
        let edge = |cell: [usize; 2], side: usize| {
            let corner = |k: usize| {
                let [i, j] = [cell[0] + usize::from(k == 1 || k == 2), cell[1] + usize::from(k >= 2)];
                (self.first + (j * (nu + 1) + i) as u32, [i as f64 / nu as f64, j as f64 / nv as f64])
            };
            let ((a, from), (b, to)) = (corner(side), corner((side + 1) % 4));
            Edge { patch, cell, side, vertex: [a, b], from, to }
        };
        let along_u = (0..nu).flat_map(|i| [edge([i, 0], 0), edge([i, nv - 1], 2)]);
        let along_v = (0..nv).flat_map(|j| [edge([0, j], 3), edge([nu - 1, j], 1)]);
        along_u.chain(along_v).collect()
    }
}

/// For every vertex the lowest one that it is the same as; and vertices to insert in cells' sides, by patch, cell (u
/// running faster), side and place along it.
pub(super) fn join(position: &[[f64; 3]], borders: &[Border], tolerance: f64) -> (Vec<u32>, Vec<Inserted>) {
    let edges: Vec<Edge> = borders.iter().enumerate().flat_map(|(k, b)| b.edges(k)).collect();
    let at = |v: u32| Vec3::from(position[v as usize]);
    // Every border vertex begins one edge.
    let mut order: Vec<u32> = edges.iter().map(|e| e.vertex[0]).collect();
    let x = |v: u32| position[v as usize][0];
    order.sort_unstable_by(|&a, &b| x(a).total_cmp(&x(b)).then(a.cmp(&b)));
    order.dedup();

    let mut same: Vec<u32> = (0..position.len() as u32).collect();
    for (k, &a) in order.iter().enumerate() {
        for &b in order[k + 1..].iter().take_while(|&&b| x(b) - x(a) <= tolerance) {
            if (at(a) - at(b)).norm() <= tolerance {
                let (a, b) = (lowest(&same, a), lowest(&same, b));
                same[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let same: Vec<u32> = (0..same.len() as u32).map(|v| lowest(&same, v)).collect();
    order.retain(|v| same[*v as usize] == *v);

    let mut inserted: Vec<(f64, Inserted)> = Vec::new();
    for e in &edges {
        let patch = borders[e.patch].patch;
        let point = |t: f64| patch.point(e.uv(t));
        let samples: [Vec3; PIECES + 1] = std::array::from_fn(|k| point(k as f64 / PIECES as f64));
        let middle = samples[PIECES / 2];
        // The curve leaves the ball of its samples by less than their own size.
        let around = samples.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max) * 1.5 + tolerance;
        let first = order.partition_point(|&v| x(v) < middle.x - around);
        for &v in order[first..].iter().take_while(|&&v| x(v) <= middle.x + around) {
            if e.vertex.iter().any(|w| same[*w as usize] == v) || (at(v) - middle).norm() > around {
                continue;
            }
            let far = |t: f64| (point(t) - at(v)).norm_squared();
            let near = (0..=PIECES)
                .min_by(|&a, &b| (samples[a] - at(v)).norm_squared().total_cmp(&(samples[b] - at(v)).norm_squared()))
                .unwrap_or(0);
            let piece = |k: usize| k as f64 / PIECES as f64;
            let mut t = least(far, piece(near.saturating_sub(1)), piece((near + 1).min(PIECES)));
            for _ in 0..POLISH {
                let (p, [du, dv]) = patch.at(e.uv(t));
                let along = du * (e.to[0] - e.from[0]) + dv * (e.to[1] - e.from[1]);
                let next = (t + (at(v) - p).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                if far(next) < far(t) {
                    t = next;
                }
            }
            if far(t) <= tolerance * tolerance {
                let (cell, side) = (e.cell, e.side);
                inserted.push((t, Inserted { patch: e.patch, cell, side, vertex: v, uv: e.uv(t) }));
            }
        }
    }
    let key = |i: &Inserted| (i.patch, i.cell[1], i.cell[0], i.side);
    inserted.sort_by(|a, b| key(&a.1).cmp(&key(&b.1)).then(a.0.total_cmp(&b.0)));
    (same, inserted.into_iter().map(|i| i.1).collect())
}

fn lowest(same: &[u32], mut v: u32) -> u32 {
    while same[v as usize] != v {
        v = same[v as usize];
    }
    v
}

/// Place of the least value between two, by golden section.
fn least(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    let cut = |low: f64, high: f64| (high - (high - low) * golden, low + (high - low) * golden);
    let (mut a, mut b) = cut(low, high);
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..STEPS {
        if fa <= fb {
            (high, b, fb) = (b, a, fa);
            a = cut(low, high).0;
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = cut(low, high).1;
            fb = f(b);
        }
    }
    0.5 * (low + high)
}
