//! Which clump a hair belongs to: found once, on the rest pose, in space and not in texture coordinates, so that chart
//! seams do not matter (production-pipeline paper §4.2.1 measures in a patch's u and v).
//!
//! Some hairs are centres. A hair joins the nearest centre whose radius it is within: clump density goes before clump
//! size, and no hair is in two clumps of a level. Roots whose normals are more than 90 degrees apart lie on different
//! sides of something thin, and roots on different sides of a parting are combed apart: they never share a clump.

use super::CHUNK;
use crate::candidates::rank;
use crate::control::Skin;
use pelage_geom::curve::closest_on_polyline;
use pelage_geom::{NONE, StrandId, SurfacePoint, Vec3};
use rayon::prelude::*;

/// Rest roots of hairs. N entries each.
#[derive(Clone, Copy, Debug)]
pub struct Sites<'a> {
    /// \[N\] scene units.
    pub position: &'a [[f32; 3]],
    /// \[N\] unit normals.
    pub normal: &'a [[f32; 3]],
    /// \[N\] partings near the root: bit `p % 64` of the first number if it lies left of parting p, of the second if right.
    /// Empty without partings.
    pub side: &'a [[u64; 2]],
}

/// Clumps of a level: C centres, N hairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    /// \[C\] centre hair of each clump.
    pub centre: Vec<u32>,
    /// \[N\] clump of each hair, or [`NONE`].
    pub clump: Vec<u32>,
    /// \[N\] distance of the root from the centre's, over the clump's radius: 0 to 1; 0 without a clump.
    pub reach: Vec<f32>,
}

/// Squared distance of two points.
#[inline(always)]
fn square(p: [f32; 3], q: [f32; 3]) -> f32 {
    let d: [f32; 3] = std::array::from_fn(|x| p[x] - q[x]);
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

impl Sites<'_> {
    /// Squared distance of two roots.
    #[inline(always)]
    pub(super) fn square(&self, a: usize, b: usize) -> f32 {
        square(self.position[a], self.position[b])
    }

    /// Squared distance of two roots; infinite if they can't share a clump.
    #[inline(always)]
    pub(super) fn apart(&self, a: usize, b: usize) -> f32 {
        let (m, n) = (self.normal[a], self.normal[b]);
        let faces = m[0] * n[0] + m[1] * n[1] + m[2] * n[2] > 0.0;
        let parted = !self.side.is_empty() && {
            let ([l, r], [m, s]) = (self.side[a], self.side[b]);
            (l & s) | (r & m) != 0
        };
        if faces && !parted { self.square(a, b) } else { f32::INFINITY }
    }
}

/// On which side of each parting roots lie, of those that are within `near` of it and beside it (not beyond its ends).
pub fn sides(partings: &[Vec<Vec3>], near: f64, sites: &Sites) -> Vec<[u64; 2]> {
    if partings.is_empty() {
        return Vec::new();
    }
    let of = |(p, n): (&[f32; 3], &[f32; 3])| {
        let (p, n) = (Vec3::from(p.map(f64::from)), Vec3::from(n.map(f64::from)));
        let mut out = [0u64; 2];
        for (k, line) in partings.iter().enumerate() {
            let (segment, t, q, distance) = closest_on_polyline(line, p);
            let beyond = (segment == 0 && t == 0.0) || (segment + 2 == line.len() && t == 1.0);
            if line.len() < 2 || distance > near || beyond {
                continue;
            }
            let left = n.cross(&(line[segment + 1] - line[segment])).dot(&(p - q));
            if left != 0.0 {
                out[usize::from(left < 0.0)] |= 1 << (k % 64);
            }
        }
        out
    };
    sites.position.par_iter().zip(sites.normal).map(of).collect()
}

/// Hairs that are centres: those whose candidate rank is below the clump density, so the centres are as even as the
/// candidates are, raising the density only adds clumps, and the clumps of a coarse level are among those of a fine one.
/// `density` is that at a hair, clumps per square scene unit; `area` that of the rest skin; `open` says which hairs may be
/// centres (empty: all).
pub fn centres(id: &[StrandId], area: f64, density: &dyn Fn(usize) -> f64, open: &[bool]) -> Vec<u32> {
    let is = |h: &u32| {
        let h = *h as usize;
        open.get(h).copied().unwrap_or(true) && rank(id[h]) / area <= density(h)
    };
    (0..id.len() as u32).filter(is).collect()
}

/// Positions in a hashed grid of cubes.
pub(crate) struct Grid {
    cell: f32,
    mask: u32,
    start: Vec<u32>,
    entry: Vec<u32>,
}

impl Grid {
    pub(crate) fn new(cell: f32, position: impl Iterator<Item = [f32; 3]> + Clone) -> Self {
        let n = position.clone().count();
        let slots = (2 * n).next_power_of_two().max(2);
        let mut grid = Grid { cell, mask: slots as u32 - 1, start: vec![0; slots + 1], entry: vec![0; n] };
        let slot: Vec<usize> = position.map(|p| grid.slot(grid.cube(p))).collect();
        slot.iter().for_each(|s| grid.start[s + 1] += 1);
        (0..slots).for_each(|s| grid.start[s + 1] += grid.start[s]);
        let mut next = grid.start.clone();
        for (i, s) in slot.iter().enumerate() {
            grid.entry[next[*s] as usize] = i as u32;
            next[*s] += 1;
        }
        grid
    }

    fn cube(&self, p: [f32; 3]) -> [i32; 3] {
        p.map(|x| (x / self.cell).floor() as i32)
    }

    fn slot(&self, [x, y, z]: [i32; 3]) -> usize {
        let h = (x as u32).wrapping_mul(0x9e37_79b1)
            ^ (y as u32).wrapping_mul(0x85eb_ca77)
            ^ (z as u32).wrapping_mul(0xc2b2_ae3d);
        ((h ^ (h >> 15)) & self.mask) as usize
    }

    /// Entries that may lie in cubes at `ring` steps from the cube of a point.
    pub(crate) fn ring(&self, p: [f32; 3], ring: i32, mut each: impl FnMut(usize)) {
        let [x, y, z] = self.cube(p);
        for dz in -ring..=ring {
            for dy in -ring..=ring {
                let shell = dz.abs() == ring || dy.abs() == ring;
                let step = if shell || ring == 0 { 1 } else { 2 * ring };
                for dx in (-ring..=ring).step_by(step as usize) {
                    let s = self.slot([x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)]);
                    let range = self.start[s] as usize..self.start[s + 1] as usize;
                    self.entry[range].iter().for_each(|&i| each(i as usize));
                }
            }
        }
    }
}

/// Cubes beyond which a grid is not searched cube by cube: at more, all centres are looked at instead.
const RINGS: f32 = 8.0;

/// Members of clumps. `radius` has one entry a centre, scene units; `spacing` is about the distance between centres (it
/// only decides how fast this is); `open` says which hairs may join (empty: all). Centres are members of themselves.
pub fn members(sites: &Sites, centre: Vec<u32>, radius: &[f32], spacing: f32, open: &[bool]) -> Members {
    assert_eq!(centre.len(), radius.len(), "a radius for every centre");
    let n = sites.position.len();
    let most = radius.iter().fold(0.0f32, |a, &b| a.max(b));
    let cell = spacing.min(most).max(most / RINGS);
    let mut own = vec![NONE; n];
    centre.iter().enumerate().for_each(|(c, &h)| own[h as usize] = c as u32);
    let mut clump = vec![NONE; n];
    let mut reach = vec![0.0; n];
    if cell > 0.0 && cell.is_finite() {
        let grid = Grid::new(cell, centre.iter().map(|&h| sites.position[h as usize]));
        clump.par_chunks_mut(CHUNK).zip(reach.par_chunks_mut(CHUNK)).enumerate().for_each(|(chunk, (clump, reach))| {
            for (k, (clump, reach)) in clump.iter_mut().zip(reach).enumerate() {
                let h = chunk * CHUNK + k;
                if own[h] == NONE && open.get(h).copied().unwrap_or(true) {
                    (*clump, *reach) = nearest(sites, &grid, &centre, radius, most, h);
                }
            }
        });
    }
    // A centre is in its own clump, however near another one stands.
    (0..n).filter(|&h| own[h] != NONE).for_each(|h| (clump[h], reach[h]) = (own[h], 0.0));
    Members { centre, clump, reach }
}

fn nearest(sites: &Sites, grid: &Grid, centre: &[u32], radius: &[f32], most: f32, h: usize) -> (u32, f32) {
    let (mut best, mut found) = (f32::INFINITY, NONE);
    let mut ring = 0;
    loop {
        grid.ring(sites.position[h], ring, |c| {
            let d2 = sites.apart(h, centre[c] as usize);
            let nearer = d2 < best || (d2 == best && (c as u32) < found);
            if nearer && d2 <= radius[c] * radius[c] {
                (best, found) = (d2, c as u32);
            }
        });
        // What has not been seen is at least this far away (a little less, for rounding).
        let seen = ring as f32 * grid.cell * 0.999;
        if seen > most || best <= seen * seen {
            break;
        }
        ring += 1;
    }
    if found == NONE { (NONE, 0.0) } else { (found, (best.sqrt() / radius[found as usize]).min(1.0)) }
}

/// [`members`] said plainly: every hair against every centre.
pub fn members_plain(sites: &Sites, centre: Vec<u32>, radius: &[f32], open: &[bool]) -> Members {
    let n = sites.position.len();
    let mut out = Members { centre, clump: vec![NONE; n], reach: vec![0.0; n] };
    for h in 0..n {
        let mut best = f32::INFINITY;
        for (c, &hair) in out.centre.iter().enumerate() {
            if hair as usize == h {
                (out.clump[h], out.reach[h]) = (c as u32, 0.0);
                break;
            }
            let d2 = sites.apart(h, hair as usize);
            if d2 < best && d2 <= radius[c] * radius[c] && open.get(h).copied().unwrap_or(true) {
                best = d2;
                (out.clump[h], out.reach[h]) = (c as u32, (d2.sqrt() / radius[c]).min(1.0));
            }
        }
    }
    out
}

/// Clumps of clumps: hairs of one clump of the level before (`fine`) go where its centre goes. `coarse` are the members
/// among the centres and the hairs without a clump; others of it are replaced.
pub fn whole_clumps(sites: &Sites, fine: &Members, radius: &[f32], mut coarse: Members) -> Members {
    for h in 0..coarse.clump.len() {
        let f = fine.clump[h];
        if f == NONE || fine.centre[f as usize] as usize == h {
            continue;
        }
        let c = coarse.clump[fine.centre[f as usize] as usize];
        coarse.clump[h] = c;
        coarse.reach[h] = match c {
            NONE => 0.0,
            c => (sites.square(h, coarse.centre[c as usize] as usize).sqrt() / radius[c as usize]).min(1.0),
        };
    }
    coarse
}

/// For each hair the centre of its clump; itself without a clump.
pub fn centre_of_each(m: &Members) -> Vec<u32> {
    let centre = |(h, &c): (usize, &u32)| if c == NONE { h as u32 } else { m.centre[c as usize] };
    m.clump.iter().enumerate().map(centre).collect()
}

/// Hairs that stand for themselves in a level above `fine`: its centres, and hairs without a clump.
pub fn representatives(fine: &Members) -> Vec<bool> {
    centre_of_each(fine).into_iter().enumerate().map(|(h, centre)| centre as usize == h).collect()
}

/// Rest roots of hairs as [`Sites`] have them, scene units relative to `origin`: positions and normals.
pub fn rest_sites(skin: &Skin, root: &[SurfacePoint], origin: [f64; 3]) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let of = |p: &SurfacePoint| {
        let f = skin.frame(p);
        let to_f32 = |v: Vec3| [v.x as f32, v.y as f32, v.z as f32];
        (to_f32(f.origin - Vec3::from(origin)), to_f32(f.n))
    };
    root.par_iter().map(of).unzip()
}

/// Roots by whose distance the density at a root is told. Half of it doubles the noise of even roots (5 % now), four times
/// as many blur partings.
const AROUND: usize = 16;

/// Hairs per square scene unit around each root: so many lie within the distance of the 16th nearest one, on skin
/// that is taken as flat. Changes gradually where roots move.
pub fn densities(position: &[[f32; 3]]) -> Vec<f32> {
    let n = position.len();
    if n < 2 {
        return vec![0.0; n];
    }
    let (low, high) = position.iter().fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), |(l, h), p| {
        (std::array::from_fn(|i| l[i].min(p[i])), std::array::from_fn(|i| h[i].max(p[i])))
    });
    let [x, y, z] = std::array::from_fn(|i| high[i] - low[i]);
    // As if the roots lay evenly on their box: a cube then holds a few.
    let cell = (2.0 * (x * y + y * z + z * x) / n as f32).sqrt().max(1e-6 * (x + y + z)).max(f32::MIN_POSITIVE);
    let grid = Grid::new(2.0 * cell, position.iter().copied());
    let around = AROUND.min(n - 1);
    let of = |p: &[f32; 3]| {
        let mut near: Vec<(f32, u32)> = Vec::with_capacity(4 * AROUND);
        for ring in 0..RINGS as i32 {
            grid.ring(*p, ring, |i| near.push((square(position[i], *p), i as u32)));
            // Cubes that share a slot are looked at with each other, so an entry may be met again.
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.dedup();
            let safe = ring as f32 * grid.cell;
            if near.len() > around && near[around].0 <= safe * safe {
                return around as f32 / (std::f32::consts::PI * near[around].0);
            }
        }
        let mut all: Vec<f32> = position.iter().map(|q| square(*q, *p)).collect();
        let (_, far, _) = all.select_nth_unstable_by(around, f32::total_cmp);
        around as f32 / (std::f32::consts::PI * *far)
    };
    position.par_iter().map(of).collect()
}

/// The hair whose root is nearest to each of some points (the lowest of equally near ones).
pub fn nearest_hairs(position: &[[f32; 3]], points: &[[f32; 3]]) -> Vec<u32> {
    let nearest = |q: &[f32; 3]| {
        let before = |a: (u32, f32), b: (u32, f32)| if b.1 < a.1 { b } else { a };
        let all = position.iter().enumerate().map(|(h, p)| (h as u32, square(*p, *q)));
        all.fold((0, f32::INFINITY), before).0
    };
    points.iter().map(nearest).collect()
}
