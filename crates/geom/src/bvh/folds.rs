//! Inside and outside of a skin that runs through itself.
//!
//! Where a thigh enters the belly, a point between the two is in front of the nearest skin and still inside. What tells is
//! the winding number, the number of skins around a point: it is the same everywhere where no skin is between, so it is
//! kept for the front of each triangle that nothing cuts, and the closest one says it for a point. Where the closest one is
//! cut, a ray does: each skin that it leaves counts 1, each that it enters -1.

use super::ray::Shear;
use super::{Bvh, Closest, Hit, closest_on_triangle, face_normal};
use crate::{NONE, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Directions of rays, one after another until one meets neither an edge nor a lid. No symmetry of a mesh has them.
const DIRECTIONS: [[f64; 3]; 6] = [
    [0.137, 0.962, 0.237],
    [0.951, 0.173, -0.257],
    [-0.211, 0.283, 0.936],
    [0.607, -0.523, 0.598],
    [-0.571, 0.611, -0.548],
    [0.319, -0.887, -0.334],
];

/// A triangle that others cut is parted into this many by this many where a way out is sought. At 1 ways out near a cut are
/// missed; at 16 they take seven times as long to find as at 6.
const PARTS: usize = 6;

/// Winding numbers next to the mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Folds {
    /// By slot, the winding number in front, less that of the outside; `None` where other triangles cut.
    front: Vec<Option<i32>>,
    /// By slot of those, the parts that have the outside on one side all over, and the same number there.
    way_out: Vec<Vec<([Vec3; 3], i32)>>,
    /// By slot, that its piece of the mesh has no border. The others have no inside, and the sign near them is that of
    /// [`Bvh::closest`].
    closed: Vec<bool>,
    /// Winding number of the outside: 0, but for a mesh that is inside out.
    outside: i32,
    /// False if what [`Bvh::closest`] says is right everywhere.
    any: bool,
}

/// True if the outside is in front of a skin, or behind one that is turned inside out.
fn leads_out(front: i32) -> bool {
    front == 0 || front == -1
}

/// What a ray met.
struct Crossings {
    /// Skins left less skins entered.
    winding: i32,
    /// It ran through an edge or a corner, where triangles count twice or not at all.
    edge: bool,
    /// It ran through a lid.
    lid: bool,
}

impl Bvh {
    /// True if the mesh runs through itself, has parts inside others, or parts turned inside out, so that
    /// [`Bvh::closest_outside`] says other than [`Bvh::closest`]. The first call takes about as long as building; not to be
    /// made first on many threads at once.
    pub fn is_folded(&self) -> bool {
        self.folds().any
    }

    /// The point closest to a query of those where the outside begins, its distance negative in all that is inside: in
    /// front of the closest skin too, if another part of the mesh is around it, or if that skin is turned inside out.
    /// Where others cut a part it is about the closest; elsewhere exactly that. The normal points to the outside.
    pub fn closest_outside(&self, query: Vec3, limit: f64) -> Option<Closest> {
        let (slot, hit) = self.closest_hit(query, limit)?;
        let c = self.signed(query, slot, &hit);
        let folds = self.folds();
        if !folds.any || !folds.closed[slot] || self.is_on_lid(slot, hit.feature) {
            return Some(c);
        }
        let winding = match folds.front[slot] {
            Some(front) => front + i32::from(c.signed_distance < 0.0),
            None => self.winding(query) - folds.outside,
        };
        let distance = c.signed_distance.abs();
        if winding == 0 {
            // The outside is on the side that the point is on.
            let normal = if c.signed_distance < 0.0 { -c.normal } else { c.normal };
            return Some(Closest { signed_distance: distance, normal, ..c });
        }
        let (slot, hit, front) = match folds.front[slot] {
            Some(front) if leads_out(front) => (slot, hit, front),
            _ => self.closest_way_out(query).unwrap_or((slot, hit, 0)),
        };
        let c = self.signed(query, slot, &hit);
        let normal = if front == 0 { c.normal } else { -c.normal };
        Some(Closest { signed_distance: -c.signed_distance.abs(), normal, ..c })
    }

    /// In how much of the mesh the front of the skin closest to a point is: 0 outside; above 0 for skin that other parts of
    /// the mesh cover, below for skin that is turned inside out.
    pub fn winding_in_front(&self, query: Vec3) -> i32 {
        let folds = self.folds();
        match self.closest_hit(query, f64::INFINITY) {
            Some((slot, hit)) if folds.any && folds.closed[slot] => {
                folds.front[slot].unwrap_or_else(|| self.seen_from(&folds.closed, slot, hit.position) - folds.outside)
            }
            _ => 0,
        }
    }

    /// The closest place of the mesh that has the outside on one side; of triangles that are cut, of the parts that lead out.
    /// With it, the winding number in front.
    fn closest_way_out(&self, query: Vec3) -> Option<(usize, Hit, i32)> {
        let folds = self.folds();
        let mut best: Option<(usize, Hit, i32)> = None;
        self.descend(
            f64::INFINITY,
            |n| n.square_distance(&query),
            |slot, reach| {
                let corner = self.corners(slot);
                let hit = closest_on_triangle(&query, corner);
                if hit.square >= reach {
                    return reach;
                }
                let found = match folds.front[slot] {
                    _ if !folds.closed[slot] => Some((slot, hit, 0)),
                    Some(front) => leads_out(front).then_some((slot, hit, front)),
                    None => folds.way_out[slot]
                        .iter()
                        .map(|(part, front)| (closest_on_triangle(&query, *part), *front))
                        .min_by(|a, b| a.0.square.total_cmp(&b.0.square))
                        // The same place as one of the whole triangle.
                        .map(|(h, f)| (slot, Hit { square: h.square, ..closest_on_triangle(&h.position, corner) }, f)),
                };
                match found {
                    Some(found) if found.1.square < reach => best.insert(found).1.square,
                    _ => reach,
                }
            },
        );
        best
    }

    fn corners(&self, slot: usize) -> [Vec3; 3] {
        crate::mesh::corners(&self.position, self.triangle[slot])
    }

    fn folds(&self) -> &Folds {
        self.folds.get_or_init(|| Folds::new(self))
    }

    /// Winding number in front of a place of a triangle.
    fn seen_from(&self, closed: &[bool], slot: usize, at: Vec3) -> i32 {
        let normal = self.face_normal(slot);
        let along = |d: [f64; 3]| Vec3::from(d) * if normal.dot(&Vec3::from(d)) < 0.0 { -1.0 } else { 1.0 };
        // Those nearest to the normal first: rays along the skin meet what is next to it.
        let mut d = DIRECTIONS.map(along);
        d.sort_by(|a, b| normal.dot(b).total_cmp(&normal.dot(a)));
        self.first_sure(d.iter().map(|d| self.crossings(closed, at, *d, Some(slot))))
    }

    /// Winding number of a point among the closed pieces.
    fn winding(&self, at: Vec3) -> i32 {
        let closed = &self.folds().closed;
        self.first_sure(DIRECTIONS.iter().map(|d| self.crossings(closed, at, Vec3::from(*d), None)))
    }

    /// What the first ray says that met neither edge nor lid; the first that met no edge; the first.
    fn first_sure(&self, rays: impl Iterator<Item = Crossings>) -> i32 {
        let mut fair: Option<Crossings> = None;
        for ray in rays {
            if !ray.edge && !ray.lid {
                return ray.winding;
            }
            if fair.as_ref().is_none_or(|f| f.edge && !ray.edge) {
                fair = Some(ray);
            }
        }
        fair.map_or(0, |f| f.winding)
    }

    fn crossings(&self, closed: &[bool], from: Vec3, direction: Vec3, but: Option<usize>) -> Crossings {
        let mut out = Crossings { winding: 0, edge: false, lid: false };
        let Some(shear) = Shear::new(from, direction) else { return out };
        let inverse = direction.map(|d| 1.0 / d);
        self.descend(
            f64::MAX,
            |n| n.enter(&from, &inverse),
            |slot, reach| {
                if Some(slot) != but
                    && closed[slot]
                    && !self.collapsed[slot]
                    && let Some((_, [v, w])) = shear.hit(self.corners(slot))
                {
                    let [a, b, c] = self.corners(slot);
                    out.winding += if (b - a).cross(&(c - a)).dot(&direction) > 0.0 { 1 } else { -1 };
                    out.edge |= v == 0.0 || w == 0.0 || v + w >= 1.0;
                    out.lid |= self.index[slot] >= self.lids;
                }
                reach
            },
        );
        out
    }

    /// Triangles that an edge of the one in `slot` runs through, other than at its ends, and those that have that edge. Edges
    /// to triangles before it are left to them.
    fn cuts(&self, slot: usize) -> Vec<u32> {
        let mut out = Vec::new();
        let corner = self.corners(slot);
        for i in 0..3 {
            let beside = self.neighbour[slot][i];
            if beside != NONE && (beside as usize) < slot {
                continue;
            }
            let (from, to) = (corner[i], corner[(i + 1) % 3]);
            let direction = to - from;
            let Some(shear) = Shear::new(from, direction) else { continue };
            let inverse = direction.map(|d| 1.0 / d);
            self.descend(
                1.0,
                |n| n.enter(&from, &inverse),
                |other, reach| {
                    let c = self.corners(other);
                    let touches = c.iter().any(|c| *c == from || *c == to);
                    if !touches && shear.hit(c).is_some_and(|(t, _)| t <= 1.0) {
                        out.extend([slot as u32, other as u32, beside]);
                    }
                    reach
                },
            );
        }
        out
    }
}

impl Folds {
    fn new(bvh: &Bvh) -> Self {
        let n = bvh.index.len();
        let mut cut: Vec<bool> = (0..n).map(|k| bvh.collapsed[k]).collect();
        let found: Vec<Vec<u32>> = (0..n).into_par_iter().map(|k| bvh.cuts(k)).collect();
        for t in found.into_iter().flatten().filter(|t| *t != NONE) {
            cut[t as usize] = true;
        }
        let mut folds = Folds { front: vec![None; n], closed: vec![true; n], ..Folds::default() };
        for piece in pieces(bvh, &vec![true; n]) {
            let open = |&k: &usize| !bvh.collapsed[k] && bvh.neighbour[k].contains(&NONE);
            if piece.iter().any(open) {
                piece.iter().for_each(|&k| folds.closed[k] = false);
            }
        }
        let whole: Vec<bool> = (0..n).map(|k| !cut[k] && folds.closed[k]).collect();
        let pieces = pieces(bvh, &whole);
        let winding: Vec<Option<i32>> = pieces.par_iter().map(|p| in_front_of(bvh, &folds.closed, p)).collect();
        // The outside is what most of the mesh faces.
        let mut area = BTreeMap::new();
        for (piece, w) in pieces.iter().zip(&winding) {
            let of: f64 = piece.iter().map(|&k| double_area(bvh, k)).sum();
            w.iter().for_each(|w| *area.entry(*w).or_insert(0.0) += of);
        }
        let most = area.iter().fold((0, 0.0), |m, (w, a)| if *a > m.1 { (*w, *a) } else { m });
        folds.outside = most.0;
        for (piece, w) in pieces.iter().zip(&winding) {
            piece.iter().for_each(|&k| folds.front[k] = w.map(|w| w - folds.outside));
        }
        let cut = |k: usize| if whole[k] || !folds.closed[k] { Vec::new() } else { folds.parts_out(bvh, k) };
        folds.way_out = (0..n).into_par_iter().map(cut).collect();
        folds.any = (0..n).any(|k| folds.closed[k] && !bvh.collapsed[k] && folds.front[k] != Some(0));
        folds
    }

    /// Parts of a triangle that have the outside on one side, by their corners, which are drawn in a little: places on a cut
    /// are on neither side.
    fn parts_out(&self, bvh: &Bvh, slot: usize) -> Vec<([Vec3; 3], i32)> {
        let front = |p: Vec3| bvh.seen_from(&self.closed, slot, p) - self.outside;
        let out = |[a, b, c]: [Vec3; 3]| {
            let inner = [a * 18.0 + b + c, b * 18.0 + c + a, c * 18.0 + a + b].map(|p| p / 20.0);
            let f = inner.map(front);
            (leads_out(f[0]) && f[1] == f[0] && f[2] == f[0]).then_some((inner, f[0]))
        };
        parts(bvh.corners(slot)).filter_map(out).collect()
    }
}

/// Winding number in front of a piece that nothing cuts.
fn in_front_of(bvh: &Bvh, closed: &[bool], piece: &[usize]) -> Option<i32> {
    let slot = piece.iter().copied().max_by(|a, b| double_area(bvh, *a).total_cmp(&double_area(bvh, *b)))?;
    let corner = bvh.corners(slot);
    // A line has no front.
    let solid = face_normal(corner) != Vec3::zeros();
    solid.then(|| bvh.seen_from(closed, slot, (corner[0] + corner[1] + corner[2]) / 3.0))
}

fn double_area(bvh: &Bvh, slot: usize) -> f64 {
    let [a, b, c] = bvh.corners(slot);
    (b - a).cross(&(c - a)).norm()
}

/// Slots joined over edges, among those of which it is `of` true.
fn pieces(bvh: &Bvh, of: &[bool]) -> Vec<Vec<usize>> {
    let mut seen: Vec<bool> = of.iter().map(|o| !o).collect();
    let mut out = Vec::new();
    for start in 0..seen.len() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut piece = vec![start];
        let mut next = 0;
        while next < piece.len() {
            for t in bvh.neighbour[piece[next]].into_iter().filter(|t| *t != NONE) {
                if !std::mem::replace(&mut seen[t as usize], true) {
                    piece.push(t as usize);
                }
            }
            next += 1;
        }
        out.push(piece);
    }
    out
}

/// A triangle in equal parts.
fn parts([a, b, c]: [Vec3; 3]) -> impl Iterator<Item = [Vec3; 3]> {
    let at = move |i: usize, j: usize| a + (b - a) * (i as f64 / PARTS as f64) + (c - a) * (j as f64 / PARTS as f64);
    (0..PARTS).flat_map(move |i| {
        (0..PARTS - i).flat_map(move |j| {
            let low = [at(i, j), at(i + 1, j), at(i, j + 1)];
            let high = (i + j + 1 < PARTS).then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            [Some(low), high].into_iter().flatten()
        })
    })
}
