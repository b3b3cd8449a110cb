//! Bounding-volume hierarchy over a triangle mesh: closest point with a sign, and rays.

use crate::mesh::corners;
use crate::{NONE, SurfacePoint, Topology, Vec3};
use rayon::prelude::*;
use std::sync::OnceLock;

mod bound;
mod folds;
mod lids;
mod ray;

/// Triangles per leaf. With 1 the hierarchy doubles and building takes longer; from 8 up queries test more triangles
/// than boxes they save.
const LEAF: usize = 4;

/// Bins of the surface-area heuristic. Below 8 queries slow down; above 32 building does.
const BINS: usize = 16;

/// From this depth on nodes are halved by count, which bounds the depth by this plus 32 and so the traversal stack.
const SAH_DEPTH: usize = 40;
const STACK: usize = SAH_DEPTH + 40;

/// Ranges with fewer triangles are built on one thread: below 1000 the overhead shows, above 100,000 threads idle.
const PARALLEL: usize = 16_384;

/// A triangle is a line when its height is at most this fraction of its longest side; its closest point is then sought
/// on its sides, off by no more than that. Above it that error grows; below it the rounding of its plane does, as
/// 1e-16 over the height.
const LINE: f64 = 1e-8;

/// The point of a mesh closest to a query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Where on the mesh.
    pub point: SurfacePoint,
    /// Its position.
    pub position: Vec3,
    /// Distance, scene units: negative inside, by the angle-weighted pseudo-normal of the closest feature (Baerentzen,
    /// Aanaes 2005, "Signed distance computation using the angle weighted pseudonormal"). Positive where the closest
    /// feature is an open border.
    pub signed_distance: f64,
    /// Unit pseudo-normal there.
    pub normal: Vec3,
}

/// Hierarchy over the triangles of one pose. Triangles with a coordinate that is not finite are left out.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    root: Option<Node>,
    pair: Vec<Pair>,
    /// Triangles in the order of the leaves: index, vertices, places of the neighbours in this order.
    index: Vec<u32>,
    triangle: Vec<[u32; 3]>,
    neighbour: Vec<[u32; 3]>,
    /// Triangles with two corners welded together; they lose ties, since they know no neighbours.
    collapsed: Vec<bool>,
    /// Vertices in the order in which the leaves first use them: a leaf reads neighbouring memory.
    position: Vec<[f64; 3]>,
    /// Angle-weighted unit normal of each vertex, the same for all that are welded; zero where there is none.
    vertex_normal: Vec<[f32; 3]>,
    /// Vertices on an open or non-manifold edge.
    open: Vec<bool>,
    /// Triangles from this one on are lids of holes, see [`Bvh::with_lids`].
    lids: u32,
    /// Vertices of lids.
    rim: Vec<bool>,
    /// Where the mesh runs through itself; found when first asked for.
    folds: OnceLock<folds::Folds>,
}

/// Two children, side by side in one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Pair([Node; 2]);

/// Box of single precision that surely holds its triangles. A leaf has `count` > 0 triangles from `start`; the
/// children of an inner node are pair `start`.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: [f32; 3],
    start: u32,
    high: [f32; 3],
    count: u32,
}

/// A box around a triangle, while building.
#[derive(Clone, Copy)]
struct Item {
    low: [f32; 3],
    high: [f32; 3],
    triangle: u32,
}

/// Where on a triangle the closest point lies.
#[derive(Clone, Copy, PartialEq)]
enum Feature {
    Face,
    /// From corner i to corner i + 1.
    Edge(usize),
    Corner(usize),
}

/// Closest point of one triangle.
#[derive(Clone, Copy)]
struct Hit {
    square: f64,
    position: Vec3,
    feature: Feature,
    /// On a face the weights of corners 1 and 2; on an edge the weight of its end, and 0.
    weight: [f64; 2],
}

impl Bvh {
    /// Builds over `triangle` with vertices `position` (scene units). `topology` is that of the rest mesh and supplies
    /// neighbours for the pseudo-normals.
    pub fn build(position: &[[f64; 3]], triangle: &[[u32; 3]], topology: &Topology) -> Self {
        let mut item: Vec<Item> = triangle
            .par_iter()
            .enumerate()
            .filter_map(|(t, tri)| Item::new(t as u32, tri.map(|v| position[v as usize])))
            .collect();
        let mut pair = Vec::with_capacity(item.len() / 2);
        let root = (!item.is_empty()).then(|| build(&mut item, 0, 0, &mut pair));
        let index: Vec<u32> = item.iter().map(|i| i.triangle).collect();
        let mut place = vec![NONE; triangle.len()];
        for (k, &t) in index.iter().enumerate() {
            place[t as usize] = k as u32;
        }
        let at = |t: u32| if t == NONE { NONE } else { place[t as usize] };
        let (order, renumbered) = by_first_use(&index, triangle, position.len());
        let (vertex_normal, open) = vertex_normals(position, triangle, &order, topology);
        Bvh {
            root,
            pair,
            neighbour: index.par_iter().map(|&t| topology.neighbour[t as usize].map(at)).collect(),
            collapsed: index.par_iter().map(|&t| is_collapsed(topology, t)).collect(),
            position: order.par_iter().map(|&v| position[v as usize]).collect(),
            index,
            triangle: renumbered,
            vertex_normal,
            open,
            lids: NONE,
            rim: Vec::new(),
            folds: OnceLock::new(),
        }
    }

    /// Closest point; `None` for an empty mesh or if nothing is nearer than `limit`. Ties go to the lowest triangle.
    pub fn closest(&self, query: Vec3, limit: f64) -> Option<Closest> {
        self.closest_hit(query, limit).map(|(slot, hit)| self.signed(query, slot, &hit))
    }

    /// Closest place: its slot and where on that triangle.
    #[inline(always)]
    fn closest_hit(&self, query: Vec3, limit: f64) -> Option<(usize, Hit)> {
        // Max and min pass over NaN, so that it would come near everything.
        if query.iter().chain([&limit]).any(|x| x.is_nan()) {
            return None;
        }
        let mut best: Option<(usize, Hit)> = None;
        self.descend(
            limit * limit,
            |n| n.square_distance(&query),
            |slot, reach| {
                let hit = closest_on_triangle(&query, corners(&self.position, self.triangle[slot]));
                let better = hit.square < reach
                    || (hit.square == reach && best.as_ref().is_some_and(|(b, _)| self.rank(slot) < self.rank(*b)));
                if !better {
                    return reach;
                }
                let square = hit.square;
                best = Some((slot, hit));
                square
            },
        );
        best
    }

    /// Visits the triangles of all leaves within `reach` by the `distance` of their boxes, near ones first. A visit takes a
    /// triangle's slot and the reach, and says what the reach is from there on.
    #[inline(always)]
    fn descend(&self, mut reach: f64, distance: impl Fn(&Node) -> f64, mut visit: impl FnMut(usize, f64) -> f64) {
        let mut stack = [Waiting::default(); STACK];
        let mut depth = 0;
        let Some(root) = &self.root else { return };
        let mut node = root.waiting(&distance);
        if node.far > reach {
            return;
        }
        loop {
            if node.count > 0 {
                for slot in node.start as usize..(node.start + node.count) as usize {
                    reach = visit(slot, reach);
                }
            } else {
                let (near, next) = self.pair[node.start as usize].order(&distance);
                if near.far <= reach {
                    if next.far <= reach {
                        stack[depth] = next;
                        depth += 1;
                    }
                    node = near;
                    continue;
                }
            }
            loop {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                if stack[depth].far <= reach {
                    node = stack[depth];
                    break;
                }
            }
        }
    }

    /// Order in which equally close triangles are preferred.
    fn rank(&self, slot: usize) -> (bool, u32) {
        (self.collapsed[slot], self.index[slot])
    }

    /// Adds sign and normal to a hit.
    fn signed(&self, query: Vec3, slot: usize, hit: &Hit) -> Closest {
        let tri = self.triangle[slot];
        let vertex = |i: usize| Vec3::from(self.vertex_normal[tri[i] as usize].map(f64::from));
        let (sum, open, corner) = match hit.feature {
            Feature::Face => (self.face_normal(slot), false, 0),
            Feature::Edge(i) => {
                let other = self.neighbour[slot][i];
                let beyond = if other == NONE { Vec3::zeros() } else { self.face_normal(other as usize) };
                (self.face_normal(slot) + beyond, other == NONE, i)
            }
            Feature::Corner(i) => (vertex(i), self.open[tri[i] as usize], i),
        };
        let away = query - hit.position;
        let normal = [sum, vertex(corner), vertex((corner + 1) % 3)]
            .into_iter()
            .find_map(|v| v.try_normalize(1e-6))
            .or_else(|| away.try_normalize(0.0))
            .unwrap_or_else(Vec3::y);
        let inside =
            !open && away.dot(&normal) < 0.0 && (!self.is_on_lid(slot, hit.feature) || self.is_behind(query, away));
        let distance = hit.square.sqrt();
        Closest {
            point: match hit.feature {
                Feature::Face => surface_point(self.index[slot], hit.weight),
                Feature::Edge(i) => edge_point(self.index[slot], i, hit.weight[0]),
                Feature::Corner(i) => edge_point(self.index[slot], i, 0.0),
            },
            position: hit.position,
            signed_distance: if inside { -distance } else { distance },
            normal,
        }
    }

    fn face_normal(&self, slot: usize) -> Vec3 {
        face_normal(corners(&self.position, self.triangle[slot]))
    }
}

impl Item {
    /// Box of a triangle, each side moved out by one unit in the last place or more; `None` if it is not finite.
    fn new(triangle: u32, corner: [[f64; 3]; 3]) -> Option<Self> {
        if !corner.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let low = |i: usize| corner[0][i].min(corner[1][i]).min(corner[2][i]) as f32;
        let high = |i: usize| corner[0][i].max(corner[1][i]).max(corner[2][i]) as f32;
        Some(Item {
            low: [low(0).next_down(), low(1).next_down(), low(2).next_down()],
            high: [high(0).next_up(), high(1).next_up(), high(2).next_up()],
            triangle,
        })
    }

    /// Twice the centre along an axis.
    fn centre(&self, axis: usize) -> f32 {
        self.low[axis] + self.high[axis]
    }
}

/// A growing box.
#[derive(Clone, Copy)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    const EMPTY: Bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    fn add(&mut self, low: &[f32; 3], high: &[f32; 3]) {
        for i in 0..3 {
            self.low[i] = self.low[i].min(low[i]);
            self.high[i] = self.high[i].max(high[i]);
        }
    }

    /// Half the surface.
    fn surface(&self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|i| self.high[i] - self.low[i]);
        x * y + y * z + z * x
    }
}

/// Node over `item`, whose first element has place `start` among all; what is below it is appended.
fn build(item: &mut [Item], start: usize, depth: usize, out: &mut Vec<Pair>) -> Node {
    let (mut all, mut centres) = (Bounds::EMPTY, Bounds::EMPTY);
    for i in item.iter() {
        all.add(&i.low, &i.high);
        let c = [i.centre(0), i.centre(1), i.centre(2)];
        centres.add(&c, &c);
    }
    let mut node = Node { low: all.low, high: all.high, start: start as u32, count: item.len() as u32 };
    if item.len() <= LEAF {
        return node;
    }
    let middle = split(item, &centres, depth);
    node.start = out.len() as u32;
    node.count = 0;
    out.push(Pair([node; 2]));
    let parallel = item.len() > PARALLEL;
    let (left, right) = item.split_at_mut(middle);
    let children = if parallel {
        let half = |item: &mut [Item], start: usize| {
            let mut below = Vec::with_capacity(item.len() / 2);
            (build(item, start, depth + 1, &mut below), below)
        };
        let (l, r) = rayon::join(|| half(left, start), || half(right, start + middle));
        [l, r].map(|(mut child, below)| {
            let shift = out.len() as u32;
            let moved = |n: &mut Node| n.start += if n.count == 0 { shift } else { 0 };
            moved(&mut child);
            out.extend(below.into_iter().map(|mut p| {
                p.0.iter_mut().for_each(moved);
                p
            }));
            child
        })
    } else {
        [build(left, start, depth + 1, out), build(right, start + middle, depth + 1, out)]
    };
    out[node.start as usize] = Pair(children);
    node
}

/// Parts a range in two by the binned surface-area heuristic along the longest side of its centres, or in halves where
/// that does not part it or the tree is deep; returns the size of the first part, never all or none.
fn split(item: &mut [Item], centres: &Bounds, depth: usize) -> usize {
    let side = [0, 1, 2].map(|i| centres.high[i] - centres.low[i]);
    let axis = if side[0] >= side[1] && side[0] >= side[2] { 0 } else { 1 + usize::from(side[2] > side[1]) };
    let (low, scale) = (centres.low[axis], BINS as f32 / side[axis]);
    if !(side[axis] > 0.0 && scale.is_finite()) || depth >= SAH_DEPTH {
        let half = item.len() / 2;
        item.select_nth_unstable_by(half, |a, b| {
            a.centre(axis).total_cmp(&b.centre(axis)).then(a.triangle.cmp(&b.triangle))
        });
        return half;
    }
    let bin = |i: &Item| (((i.centre(axis) - low) * scale) as usize).min(BINS - 1);
    let mut bins = [(Bounds::EMPTY, 0usize); BINS];
    for i in item.iter() {
        let b = &mut bins[bin(i)];
        b.0.add(&i.low, &i.high);
        b.1 += 1;
    }
    // cost[k]: of everything in bins up to k on the left.
    let mut cost = [f32::INFINITY; BINS];
    let (mut box_, mut count) = (Bounds::EMPTY, 0);
    for k in 0..BINS - 1 {
        box_.add(&bins[k].0.low, &bins[k].0.high);
        count += bins[k].1;
        cost[k] = if count > 0 { box_.surface() * count as f32 } else { f32::INFINITY };
    }
    (box_, count) = (Bounds::EMPTY, 0);
    for k in (1..BINS).rev() {
        box_.add(&bins[k].0.low, &bins[k].0.high);
        count += bins[k].1;
        cost[k - 1] += if count > 0 { box_.surface() * count as f32 } else { f32::INFINITY };
    }
    let mut best = 0;
    for k in 1..BINS - 1 {
        if cost[k] < cost[best] {
            best = k;
        }
    }
    // The lowest and the highest centre lie in the first and the last bin, so that neither part is empty.
    let (mut i, mut j) = (0, item.len());
    while i < j {
        if bin(&item[i]) <= best {
            i += 1;
        } else {
            j -= 1;
            item.swap(i, j);
        }
    }
    i
}

/// A node still to be looked into.
#[derive(Clone, Copy, Default)]
struct Waiting {
    far: f64,
    start: u32,
    count: u32,
}

impl Pair {
    /// Both children, the nearer first (the left one if equal).
    fn order(&self, distance: impl Fn(&Node) -> f64) -> (Waiting, Waiting) {
        let [a, b] = self.0.map(|n| n.waiting(&distance));
        if a.far <= b.far { (a, b) } else { (b, a) }
    }
}

impl Node {
    fn waiting(&self, distance: impl Fn(&Node) -> f64) -> Waiting {
        Waiting { far: distance(self), start: self.start, count: self.count }
    }

    /// Square distance from a point, 0 inside.
    fn square_distance(&self, q: &Vec3) -> f64 {
        let d = |i: usize| (f64::from(self.low[i]) - q[i]).max(q[i] - f64::from(self.high[i])).max(0.0);
        let (x, y, z) = (d(0), d(1), d(2));
        x * x + y * y + z * z
    }

    /// Parameter at which a ray enters; infinite if it misses or the box lies behind. `inverse`: one over its direction.
    fn enter(&self, origin: &Vec3, inverse: &Vec3) -> f64 {
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for i in 0..3 {
            // 0 * infinity is NaN on a face of the box; max and min pass over it.
            let a = (f64::from(self.low[i]) - origin[i]) * inverse[i];
            let b = (f64::from(self.high[i]) - origin[i]) * inverse[i];
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        // Three roundings on either side (Ize 2013, "Robust BVH Ray Traversal").
        if near <= far * (1.0 + 8.0 * f64::EPSILON) { near * (1.0 - 8.0 * f64::EPSILON) } else { f64::INFINITY }
    }
}

/// True for a triangle with two corners welded together.
fn is_collapsed(topology: &Topology, t: u32) -> bool {
    let [a, b, c] = [0, 1, 2].map(|i| topology.welded(t, i));
    a == b || b == c || c == a
}

/// Unit normal of a triangle; zero for a line.
fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let n = (b - a).cross(&(c - a));
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    let norm = n.norm();
    if norm > LINE * longest { n / norm } else { Vec3::zeros() }
}

/// Vertices in the order in which the triangles, taken in the order of `index`, first use them; and those triangles
/// over the vertices so numbered.
fn by_first_use(index: &[u32], triangle: &[[u32; 3]], vertices: usize) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut number = vec![NONE; vertices];
    let mut order = Vec::with_capacity(vertices);
    let renumbered = index.iter().map(|&t| {
        triangle[t as usize].map(|v| {
            let n = &mut number[v as usize];
            if *n == NONE {
                *n = order.len() as u32;
                order.push(v);
            }
            *n
        })
    });
    let renumbered = renumbered.collect();
    (order, renumbered)
}

/// Angle-weighted normals of the vertices `order`, and which lie on an open edge.
fn vertex_normals(
    position: &[[f64; 3]],
    triangle: &[[u32; 3]],
    order: &[u32],
    topology: &Topology,
) -> (Vec<[f32; 3]>, Vec<bool>) {
    let of = |&v: &u32| {
        let (mut sum, mut open) = (Vec3::zeros(), false);
        for &c in topology.incident_welded(topology.weld[v as usize]) {
            let (t, i) = (c / 3, (c % 3) as usize);
            let corner = corners(position, triangle[t as usize]);
            let (a, b) = (corner[(i + 1) % 3] - corner[i], corner[(i + 2) % 3] - corner[i]);
            let (la, lb) = (a.norm(), b.norm());
            if la > 0.0 && lb > 0.0 {
                sum += face_normal(corner) * libm::acos((a.dot(&b) / (la * lb)).clamp(-1.0, 1.0));
            }
            let beside = topology.neighbour[t as usize];
            open |= (beside[i] == NONE || beside[(i + 2) % 3] == NONE) && !is_collapsed(topology, t);
        }
        let n = sum.try_normalize(1e-9).unwrap_or_default();
        ([n.x as f32, n.y as f32, n.z as f32], open)
    };
    order.par_iter().map(of).unzip()
}

/// Closest point of a triangle.
fn closest_on_triangle(q: &Vec3, corner: [Vec3; 3]) -> Hit {
    let [a, b, c] = corner;
    let (ab, ac, aq) = (b - a, c - a, q - a);
    let (d00, d01, d11) = (ab.dot(&ab), ab.dot(&ac), ac.dot(&ac));
    let (d20, d21) = (aq.dot(&ab), aq.dot(&ac));
    // Square of twice the area; weights of the foot of the perpendicular times that.
    let mut area = d00 * d11 - d01 * d01;
    let (mut v, mut w) = (d11 * d20 - d01 * d21, d00 * d21 - d01 * d20);
    let longest = d00.max(d11).max(d00 + d11 - 2.0 * d01);
    let mut line = false;
    if area <= 1e-6 * longest * longest {
        // A sliver: the differences above lose what cross products keep.
        let n = ab.cross(&ac);
        area = n.norm_squared();
        (v, w) = (n.dot(&aq.cross(&ac)), n.dot(&ab.cross(&aq)));
        line = area <= LINE * LINE * longest * longest;
    }
    let u = area - v - w;
    if !line && u > 0.0 && v > 0.0 && w > 0.0 {
        let weight = [v / area, w / area];
        let position = a + ab * weight[0] + ac * weight[1];
        return Hit { square: (q - position).norm_squared(), position, feature: Feature::Face, weight };
    }
    // The closest point of a triangle lies on a side that has the query on its outside.
    let mut best = Hit { square: f64::INFINITY, position: a, feature: Feature::Corner(0), weight: [0.0; 2] };
    for (i, opposite) in [w, u, v].into_iter().enumerate() {
        if line || opposite <= 0.0 {
            let hit = closest_on_edge(q, corner, i);
            if hit.square < best.square {
                best = hit;
            }
        }
    }
    best
}

/// Closest point of the side from corner `i` to the next, computed alike from both triangles that share it.
fn closest_on_edge(q: &Vec3, corner: [Vec3; 3], i: usize) -> Hit {
    let j = (i + 1) % 3;
    let turned = (corner[j].x, corner[j].y, corner[j].z) < (corner[i].x, corner[i].y, corner[i].z);
    let (from, to) = if turned { (j, i) } else { (i, j) };
    let side = corner[to] - corner[from];
    let along = side.dot(&(q - corner[from]));
    let square = side.norm_squared();
    let (position, feature, t) = if along <= 0.0 {
        (corner[from], Feature::Corner(from), 0.0)
    } else if along >= square {
        (corner[to], Feature::Corner(to), 0.0)
    } else {
        let t = along / square;
        (corner[from] + side * t, Feature::Edge(i), if turned { 1.0 - t } else { t })
    };
    Hit { square: (q - position).norm_squared(), position, feature, weight: [t, 0.0] }
}

/// Barycentric coordinates are given in steps of 2^-24: exact in single precision, and so is what is left to 1.
const STEPS: f64 = 16_777_216.0;

/// Point of a triangle from the weights of corners 1 and 2, which are limited to it.
pub(crate) fn surface_point(triangle: u32, weight: [f64; 2]) -> SurfacePoint {
    let b = (weight[0].clamp(0.0, 1.0) * STEPS).round();
    let c = (weight[1].clamp(0.0, 1.0) * STEPS).round().min(STEPS - b);
    SurfacePoint { triangle, bary: [(b / STEPS) as f32, (c / STEPS) as f32] }
}

/// Point exactly on the edge from corner `edge` to the next, whose end has weight `t`.
pub(crate) fn edge_point(triangle: u32, edge: usize, t: f64) -> SurfacePoint {
    let t = (t.clamp(0.0, 1.0) * STEPS).round() / STEPS;
    let mut w = [0.0; 3];
    w[edge] = 1.0 - t;
    w[(edge + 1) % 3] = t;
    SurfacePoint { triangle, bary: [w[1] as f32, w[2] as f32] }
}
