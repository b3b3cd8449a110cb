//! Candidate roots: the places where hairs may stand, in an order such that every beginning of the list is an even,
//! irregular (blue-noise) sample of the skin by area.
//!
//! The list depends on the rest mesh and a seed, never on maps or values; asking for more candidates only appends.
//! A hair exists where its rank is below the local density, so raising a density only adds hairs and an edit of a map
//! changes only what lies under it. Paper §3.3 asks for counts that depend neither on map resolution nor on patch
//! size; ranks by area give both.
//!
//! Method: the skin's area is laid out along a curve (module `area_curve`) and cut into equal stretches. Round by
//! round every stretch gets one more point, the best of a few darts by distance to the points so far (Mitchell 1991,
//! "Spectrally optimal sampling for distribution ray tracing"), and when the stretches are full they are halved. The
//! stretches hold the local density to its share at every moment; the choice of darts makes the noise blue.

use crate::area_curve::AreaCurve;
use crate::point_grid::PointGrid;
use pelage_geom::{Mesh, NONE, StrandId, SurfacePoint, Topology, Vec3, rng};
use rayon::prelude::*;

/// Points that a stretch holds when it is new; it is halved at twice as many. At 1 each new point is forced into the
/// empty half of its stretch and crowds its neighbours; at 32 counts over small areas waver.
const FILL: usize = 8;
/// Darts thrown for one point. Fewer leave holes and close pairs (nearest-neighbour distance drops), more cost time
/// in proportion.
const DARTS: usize = 16;
/// Interleaved parts of a round. Points of one part are chosen at once against all earlier points, and chosen again
/// where two of them come too close; fewer parts mean more second choices.
const PARTS: usize = 4;
/// Rounds over fewer stretches than this run in one part.
const SMALL: usize = 256;
/// Distance between the points that stand for an open edge, in spacings. Wider, darts slip between them; narrower costs
/// time and memory on long borders.
const RIM_STEP: f64 = 0.25;
/// How far an open edge keeps points away: a dart at distance b counts as sqrt(this) * b from a neighbour. Without it
/// the best darts of a border are those right on it, where nothing is beyond, and hairs line up along the edge (twice
/// the density within an eighth of the spacing); at 4 an edge repels like a mirror and leaves a bare strip. Here the strip
/// of half a spacing has 1.07 times the density of the rest.
const RIM_WEIGHT: f32 = 16.0;
/// Stretches a thread takes at a time.
const CHUNK: usize = 256;

/// Candidate roots in rank order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Candidates {
    /// Roots on the rest skin; entry i has rank i.
    pub root: Vec<SurfacePoint>,
    /// Area of the rest skin, square scene units.
    pub area: f64,
}

impl Candidates {
    /// Lowest local density, hairs per square scene unit, at which candidate `i` grows a hair.
    pub fn threshold(&self, i: usize) -> f64 {
        (i as f64 + 0.5) / self.area
    }
}

/// Rank of a hair among its layer's candidates, in their middle: it is there from a density of this many hairs over the skin on.
pub fn rank(id: StrandId) -> f64 {
    (id & 0xffff_ffff) as f64 + 0.5
}

/// Name of the hair at candidate `index` in a layer. The top bit of `layer_seed` must be 0.
pub fn strand_id(layer_seed: u32, index: u32) -> StrandId {
    (u64::from(layer_seed) << 32) | u64::from(index)
}

/// The first `count` candidates of a rest mesh. Triangles without area carry none; a mesh without area has none at
/// all. `progress` hears of the candidates found so far and stops the work by returning false (then the result is
/// `None`).
pub fn candidates(
    mesh: &Mesh,
    topology: &Topology,
    seed: u64,
    count: usize,
    progress: &mut dyn FnMut(usize) -> bool,
) -> Option<Candidates> {
    let curve = AreaCurve::new(mesh);
    let area = curve.area();
    if area == 0.0 {
        return Some(Candidates::default());
    }
    let (low, high) = mesh.bounds();
    let centre = 0.5 * (Vec3::from(low) + Vec3::from(high));
    let mut sampler = Sampler {
        rim: open_edges(mesh, topology),
        curve,
        seed,
        centre,
        grid: PointGrid::new(),
        rim_grid: PointGrid::new(),
        at: Vec::new(),
        root: Vec::new(),
    };
    let mut level = 0u32;
    while sampler.root.len() < count {
        if !sampler.level(level, count, progress) {
            return None;
        }
        level += 1;
    }
    sampler.root.truncate(count);
    Some(Candidates { root: sampler.root, area })
}

/// A dart that was chosen.
struct Pick {
    root: SurfacePoint,
    /// Position on the curve.
    at: f64,
    position: [f32; 3],
    normal: [f32; 3],
    /// Squared distance to the nearest earlier point.
    distance2: f32,
}

struct Sampler<'a> {
    curve: AreaCurve<'a>,
    seed: u64,
    /// Origin of single-precision positions.
    centre: Vec3,
    grid: PointGrid,
    /// Ends of the skin's open edges and the normals of their triangles.
    rim: Vec<[Vec3; 3]>,
    /// Points along the open edges, a part of the spacing apart.
    rim_grid: PointGrid,
    /// Position on the curve of every point, in the order of the grid.
    at: Vec<f64>,
    /// Roots by rank.
    root: Vec<SurfacePoint>,
}

impl Sampler<'_> {
    /// Fills 2^level stretches up to twice [`FILL`] points each. False if stopped.
    fn level(&mut self, level: u32, enough: usize, progress: &mut dyn FnMut(usize) -> bool) -> bool {
        let stretches = 1usize << level;
        // Cubes as wide as the spacing at the beginning of the level: no hole is wider, and few points share a cube.
        let spacing = (self.curve.area() / (FILL * stretches) as f64).sqrt();
        self.grid.resize(spacing as f32, 2 * FILL * stretches);
        self.line_rim(spacing);
        let mut held = vec![[0u8; 2]; stretches];
        for &t in &self.at {
            let h = self.half(t, stretches);
            held[h / 2][h % 2] += 1;
        }
        let parts = if stretches < SMALL { 1 } else { PARTS };
        for round in self.root.len() / stretches..2 * FILL {
            for part in 0..parts {
                self.part(&mut held, round, part, parts);
                if self.root.len() >= enough {
                    return true;
                }
                if !progress(self.root.len()) {
                    return false;
                }
            }
        }
        true
    }

    /// Points along the open edges for a level of the given spacing.
    fn line_rim(&mut self, spacing: f64) {
        self.rim_grid = PointGrid::new();
        let steps = |e: &[Vec3; 3]| ((e[1] - e[0]).norm() / (RIM_STEP * spacing)).ceil().max(1.0) as usize;
        self.rim_grid.resize(spacing as f32, self.rim.iter().map(steps).sum());
        for e in &self.rim {
            let n = steps(e);
            for k in 0..n {
                let p = e[0] + (e[1] - e[0]) * ((k as f64 + 0.5) / n as f64) - self.centre;
                self.rim_grid.push(single(p), single(e[2]));
            }
        }
    }

    /// Squared distance of a dart from the nearest earlier point; less near an open edge, beyond which there are none.
    fn room(&self, position: [f32; 3], normal: [f32; 3], enough: f32) -> f32 {
        let d = self.grid.nearest(position, normal, enough, 0);
        if d <= enough || self.rim.is_empty() {
            return d;
        }
        d.min(RIM_WEIGHT * self.rim_grid.nearest(position, normal, enough / RIM_WEIGHT, 0))
    }

    /// The half stretch (twice the number of the stretch, plus one for its second half) that `t` lies in.
    fn half(&self, t: f64, stretches: usize) -> usize {
        ((t / self.curve.area() * (2 * stretches) as f64) as usize).min(2 * stretches - 1)
    }

    /// One more point for every stretch of a part.
    fn part(&mut self, held: &mut [[u8; 2]], round: usize, part: usize, parts: usize) {
        let stretches = held.len();
        let size = stretches / parts;
        let scramble =
            rng::squares64(round as u64, rng::key(self.seed, stretches as u64, rng::channel("candidate order")));
        let offset = bit_reverse(part as u32, parts.trailing_zeros()) as usize ^ (scramble as usize & (parts - 1));
        let picks: Vec<Pick> = (0..size)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|j| self.pick(j * parts + offset, stretches, held[j * parts + offset]))
            .collect();
        let since = self.grid.len() as u32;
        let base = self.root.len();
        self.root.resize(base + size, SurfacePoint::default());
        // Ranks go by bit reversal, so that the beginning of a part is spread over the whole skin.
        let swap = (scramble >> 32) as usize & (size - 1);
        for (j, mut pick) in picks.into_iter().enumerate() {
            let s = j * parts + offset;
            // Points of this part were chosen without knowledge of each other.
            if self.grid.nearest(pick.position, pick.normal, 0.0, since) < pick.distance2 {
                pick = self.pick(s, stretches, held[s]);
            }
            self.grid.push(pick.position, pick.normal);
            held[s][self.half(pick.at, stretches) % 2] += 1;
            self.at.push(pick.at);
            self.root[base + bit_reverse((j ^ swap) as u32, size.trailing_zeros()) as usize] = pick.root;
        }
    }

    /// The best of [`DARTS`] darts at a stretch whose halves hold `held` points: at the half that holds fewer, so that
    /// both halves begin the next level with [`FILL`] each.
    fn pick(&self, s: usize, stretches: usize, held: [u8; 2]) -> Pick {
        let half = 0.5 * self.curve.area() / stretches as f64;
        let [first, end] = [usize::from(held[0] > held[1]), 2 - usize::from(held[1] > held[0])];
        let (low, length) = ((2 * s + first) as f64 * half, (end - first) as f64 * half);
        let entries = self.curve.entries(low, low + length);
        let grain = half / FILL as f64;
        let turn = u64::from(held[0] + held[1]);
        let key = rng::key(self.seed, (stretches + s) as u64, rng::channel("candidate dart").wrapping_add(turn));
        let mut best: Option<Pick> = None;
        let mut normal_of = (usize::MAX, [0.0; 3]);
        for dart in 0..DARTS as u64 {
            let [a, b] = [2 * dart, 2 * dart + 1].map(|c| rng::squares64(c, key));
            let unit = |bits: u64| (bits >> 32) as f64 * (1.0 / 4_294_967_296.0);
            let at = low + (dart as f64 + unit(a)) / DARTS as f64 * length;
            let place = self.curve.place(at, entries.clone(), grain, [unit(b), unit(b << 32)]);
            let position = single(place.position - self.centre);
            if normal_of.0 != place.entry {
                normal_of = (place.entry, single(self.curve.normal(place.entry)));
            }
            let enough = best.as_ref().map_or(-1.0, |p| p.distance2);
            let distance2 = self.room(position, normal_of.1, enough);
            if distance2 > enough {
                best = Some(Pick { root: place.root, at, position, normal: normal_of.1, distance2 });
            }
        }
        best.expect("at least one dart")
    }
}

fn single(v: Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// Both ends of every open edge of a triangle with area, and that triangle's normal.
fn open_edges(mesh: &Mesh, topology: &Topology) -> Vec<[Vec3; 3]> {
    let mut rim = Vec::new();
    for (t, across) in topology.neighbour.iter().enumerate() {
        let c = mesh.corners(t as u32);
        let normal = (c[1] - c[0]).cross(&(c[2] - c[0]));
        if normal.norm() > 0.0 {
            rim.extend((0..3).filter(|&i| across[i] == NONE).map(|i| [c[i], c[(i + 1) % 3], normal.normalize()]));
        }
    }
    rim
}

/// The lowest `bits` bits of `x` in reverse.
fn bit_reverse(x: u32, bits: u32) -> u32 {
    if bits == 0 { 0 } else { x.reverse_bits() >> (32 - bits) }
}
