//! A curve through all of a mesh's area: position t in [0, area) names a place, and a stretch of the curve of length
//! a is a compact patch of area a.
//!
//! Triangles are put in the order of a tree that halves the area along the longest extent; inside a triangle the
//! curve is Sierpinski's, which bisects the longest edge again and again and so halves the area at every step.

use pelage_geom::{Mesh, SurfacePoint, Vec3};

/// Slices shorter than this are sorted to find the middle of their area; longer ones are cut at one of [`BINS`]
/// thresholds, which costs no sort. Speed alone depends on it.
const SORTED: usize = 1024;
/// Thresholds tried along the longest extent of a long slice. Fewer make stretches of the curve that straddle two
/// branches of the tree; more cost time.
const BINS: usize = 128;
/// Normals that spread over more than this along some axis are split apart, so that the two sides of an ear or a lip
/// lie on different stretches. Lower values tear apart patches that are merely curved; at 2 nothing is ever split.
const NORMAL_SPREAD: f32 = 1.4;
/// Slices with fewer triangles than the mesh over this are small enough to be split by normals: a larger slice is
/// first cut in space.
const NORMAL_PARTS: usize = 64;

/// The area of a mesh laid out along a line.
pub(crate) struct AreaCurve<'a> {
    mesh: &'a Mesh,
    /// Triangles with area, in the order of the curve.
    triangle: Vec<u32>,
    /// First corner of the longest edge of each.
    turn: Vec<u8>,
    /// Position on the curve where each begins; one more at the end. Square scene units.
    start: Vec<f64>,
}

/// A place on the curve.
pub(crate) struct Place {
    /// On the mesh.
    pub root: SurfacePoint,
    /// Entry in the curve's triangle order.
    pub entry: usize,
    /// In space.
    pub position: Vec3,
}

impl<'a> AreaCurve<'a> {
    pub fn new(mesh: &'a Mesh) -> Self {
        let n = mesh.triangle.len();
        let area: Vec<f64> = (0..n as u32).map(|t| mesh.area(t)).collect();
        let mut triangle: Vec<u32> = (0..n as u32).filter(|&t| is_area(area[t as usize])).collect();
        let seed: Vec<Item> = (0..n as u32)
            .map(|t| {
                let [a, b, c] = mesh.corners(t);
                let (centre, normal) = ((a + b + c) / 3.0, (b - a).cross(&(c - a)));
                let normal = normal / normal.norm();
                Item {
                    key: std::array::from_fn(|i| if i < 3 { centre[i] as f32 } else { normal[i - 3] as f32 }),
                    area: area[t as usize] as f32,
                }
            })
            .collect();
        let parts = triangle.len() / NORMAL_PARTS;
        order(&mut triangle, &seed, parts);
        let mut start = Vec::with_capacity(triangle.len() + 1);
        let mut total = 0.0;
        start.push(0.0);
        for &t in &triangle {
            total += area[t as usize];
            start.push(total);
        }
        let turn = triangle.iter().map(|&t| longest_edge(mesh.corners(t))).collect();
        AreaCurve { mesh, triangle, turn, start }
    }

    /// Total area, square scene units.
    pub fn area(&self) -> f64 {
        self.start[self.triangle.len()]
    }

    /// Entries whose stretches touch [low, high).
    pub fn entries(&self, low: f64, high: f64) -> std::ops::Range<usize> {
        let last = self.triangle.len();
        let first = self.start.partition_point(|&s| s <= low).clamp(1, last) - 1;
        // A stretch holds few entries: step from the first.
        let mut end = first + 1;
        while end < last && self.start[end] < high {
            end += 1;
        }
        first..end
    }

    /// Unit normal of an entry's triangle.
    pub fn normal(&self, entry: usize) -> Vec3 {
        let [a, b, c] = self.mesh.corners(self.triangle[entry]);
        (b - a).cross(&(c - a)).normalize()
    }

    /// The place at `t`, which lies on one of `entries`: exact to a patch of area `grain`, inside of which `random`
    /// (two numbers in [0, 1)) decides.
    pub fn place(&self, t: f64, entries: std::ops::Range<usize>, grain: f64, random: [f64; 2]) -> Place {
        let e = entries.start + self.start[entries.start + 1..entries.end].partition_point(|&s| s <= t);
        let size = self.start[e + 1] - self.start[e];
        let mut f = ((t - self.start[e]) / size).clamp(0.0, 1.0);
        let corner = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        let k = self.turn[e] as usize;
        let (mut a, mut b, mut c) = (corner[k], corner[(k + 1) % 3], corner[(k + 2) % 3]);
        let mut left = size;
        while left > grain {
            // The curve runs from a to b; the newest vertex is c. Halves: a to c and c to b, over the middle of ab.
            let m: [f64; 2] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            f *= 2.0;
            if f < 1.0 {
                b = c;
            } else {
                f -= 1.0;
                a = c;
            }
            c = m;
            left *= 0.5;
        }
        let [mut r, mut s] = random;
        if r + s > 1.0 {
            (r, s) = (1.0 - r, 1.0 - s);
        }
        let at = |i: usize| a[i] + r * (b[i] - a[i]) + s * (c[i] - a[i]);
        let root = SurfacePoint { triangle: self.triangle[e], bary: inside([at(0), at(1)]) };
        Place { root, entry: e, position: self.mesh.point(&root) }
    }
}

/// Rounds two weights to `f32` such that the third is not negative.
fn inside(w: [f64; 2]) -> [f32; 2] {
    let mut b = w.map(|x| x.clamp(0.0, 1.0) as f32);
    while f64::from(b[0]) + f64::from(b[1]) > 1.0 {
        let k = usize::from(b[1] > b[0]);
        b[k] = b[k].next_down();
    }
    b
}

fn is_area(a: f64) -> bool {
    a > 0.0 && a.is_finite()
}

fn longest_edge(c: [Vec3; 3]) -> u8 {
    let l: [f64; 3] = std::array::from_fn(|k| (c[(k + 1) % 3] - c[k]).norm_squared());
    (0..3).fold(0, |best, k| if l[k] > l[best] { k } else { best }) as u8
}

/// What the order looks at: centre and normal of a triangle, and its area.
struct Item {
    key: [f32; 6],
    area: f32,
}

/// Orders triangles by halving their area along the longest extent, down to single ones.
fn order(slice: &mut [u32], item: &[Item], normal_below: usize) {
    if slice.len() < 2 {
        return;
    }
    let (mut low, mut high) = ([f32::INFINITY; 6], [f32::NEG_INFINITY; 6]);
    for &t in slice.iter() {
        for (d, k) in item[t as usize].key.iter().enumerate() {
            low[d] = low[d].min(*k);
            high[d] = high[d].max(*k);
        }
    }
    let widest = |r: std::ops::Range<usize>| {
        r.reduce(|best, d| if high[d] - low[d] > high[best] - low[best] { d } else { best }).unwrap_or(0)
    };
    let normal = widest(3..6);
    let cut = if slice.len() <= normal_below && high[normal] - low[normal] > NORMAL_SPREAD {
        partition(slice, |t| item[t as usize].key[normal] < 0.5 * (low[normal] + high[normal]))
    } else {
        let d = widest(0..3);
        if slice.len() <= SORTED { cut_sorted(slice, item, d) } else { cut_binned(slice, item, d, low[d], high[d]) }
    };
    let (a, b) = slice.split_at_mut(cut.clamp(1, slice.len() - 1));
    if a.len() + b.len() > 4 * SORTED {
        rayon::join(|| order(a, item, normal_below), || order(b, item, normal_below));
    } else {
        order(a, item, normal_below);
        order(b, item, normal_below);
    }
}

/// Stable partition; number of elements that satisfy `left`.
fn partition(slice: &mut [u32], left: impl Fn(u32) -> bool) -> usize {
    let (a, b): (Vec<u32>, Vec<u32>) = slice.iter().partition(|&&t| left(t));
    slice[..a.len()].copy_from_slice(&a);
    slice[a.len()..].copy_from_slice(&b);
    a.len()
}

/// Sorts along axis `d` and cuts where the area left of the cut is closest to half.
fn cut_sorted(slice: &mut [u32], item: &[Item], d: usize) -> usize {
    slice.sort_unstable_by(|&a, &b| item[a as usize].key[d].total_cmp(&item[b as usize].key[d]).then(a.cmp(&b)));
    middle(slice.iter().map(|&t| f64::from(item[t as usize].area)))
}

/// Cuts at the threshold along axis `d` that comes closest to half of the area.
fn cut_binned(slice: &mut [u32], item: &[Item], d: usize, low: f32, high: f32) -> usize {
    let scale = BINS as f32 / (high - low).max(f32::MIN_POSITIVE);
    let bin = |t: u32| (((item[t as usize].key[d] - low) * scale) as usize).min(BINS - 1);
    let mut sum = [0.0f64; BINS];
    for &t in slice.iter() {
        sum[bin(t)] += f64::from(item[t as usize].area);
    }
    let cut = middle(sum.iter().copied());
    let at = partition(slice, |t| bin(t) < cut);
    if at == 0 || at == slice.len() { slice.len() / 2 } else { at }
}

/// Number of leading elements whose sum is closest to half of the total.
fn middle(area: impl Iterator<Item = f64> + Clone) -> usize {
    let half = 0.5 * area.clone().sum::<f64>();
    let mut total = 0.0;
    for (k, a) in area.enumerate() {
        if total + a >= half {
            return if total + a - half < half - total { k + 1 } else { k };
        }
        total += a;
    }
    0
}
