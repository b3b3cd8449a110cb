//! The exact reference: rays from points to the light, past every hair that they cross.

use super::bins::{Chunk, chunks};
use super::project::{Place, Projection, fit};
use super::settings::ShadowSettings;
use super::solid::{self, Solid};
use super::{BadSource, ShadowHair, Source, TILE};
use pelage_geom::{Vec3, rng};
use rayon::prelude::*;

/// Texels of the grid in which hairs are looked up. Coarser, a cell holds more hairs than a ray has to be tested with;
/// finer, hairs are listed in more cells than rays visit.
const TEXELS: usize = 1024;

/// Channel of the random numbers.
const JITTER: u64 = rng::channel("shadow footprint");

/// What a point's truth is the mean of: rays from a square around the point, across the light. Along one ray light is
/// there or not at the scale of a hair's width, which no map resolves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Side of the square, as [`ShadowSettings::filter`]; 0 for one ray from the point itself.
    pub side: f64,
    /// Least number of rays: two in each cell of the coarsest square grid of strata that has so many.
    pub rays: usize,
    /// Seed of the places of the rays.
    pub seed: u64,
}

/// Mean of transmittance over a footprint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Mean over the rays.
    pub mean: f64,
    /// Variance of that mean as an estimate of the footprint's, from the two rays of each stratum.
    pub variance: f64,
}

/// How far maps are from the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ShadowError {
    /// Root mean square, the truth's own noise taken out in quadrature.
    pub rms: f64,
    /// 95th percentile of the size.
    pub p95: f64,
    /// Mean.
    pub bias: f64,
}

impl ShadowError {
    /// Of what [`super::transmittance`] gives, at points whose truth is known (one or more).
    pub fn of(light: &[Vec<f32>], points: &[[usize; 2]], truth: &[Sample]) -> ShadowError {
        let error: Vec<f64> = points.iter().zip(truth).map(|(&[l, i], t)| f64::from(light[l][i]) - t.mean).collect();
        let n = error.len() as f64;
        let noise = truth.iter().map(|t| t.variance).sum::<f64>() / n;
        let square = error.iter().map(|e| e * e).sum::<f64>() / n;
        let mut size: Vec<f64> = error.iter().map(|e| e.abs()).collect();
        size.sort_by(f64::total_cmp);
        ShadowError {
            rms: (square - noise).max(0.0).sqrt(),
            p95: size[size.len() * 95 / 100],
            bias: error.iter().sum::<f64>() / n,
        }
    }
}

/// A segment in space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub a: Vec3,
    pub along: Vec3,
    /// Half the width at either end.
    pub radius: [f64; 2],
    pub opacity: [f64; 2],
    pub strand: u32,
    /// Least depth on the light's plane.
    first: f32,
}

impl Axis {
    /// Segment from point `i` of strand `s` to the next.
    pub(crate) fn new(layer: &ShadowHair, s: usize, i: usize, strand: u32, first: f32) -> Axis {
        let a = layer.point(i);
        Axis {
            a,
            along: layer.point(i + 1) - a,
            radius: [i, i + 1].map(|i| 0.5 * f64::from(layer.width(i))),
            opacity: [i, i + 1].map(|i| f64::from(layer.opacity(s, i))),
            strand,
            first,
        }
    }

    /// Opacity where the ray from `origin` along the unit vector `toward`, `reach` long, crosses the hair: where the
    /// lines come closest they are less than half the width apart, on the segment (without its end, so that joints
    /// count once) and in front of the origin.
    #[inline]
    pub(crate) fn crossed(&self, origin: &Vec3, toward: &Vec3, reach: f64) -> Option<f64> {
        let r = self.a - origin;
        let (uu, ud, ur, rd) = (self.along.norm_squared(), self.along.dot(toward), self.along.dot(&r), r.dot(toward));
        let square = uu - ud * ud;
        if square <= 1e-14 * uu {
            return None;
        }
        let t = (ud * rd - ur) / square;
        if !(0.0..1.0).contains(&t) {
            return None;
        }
        let s = rd + t * ud;
        let radius = self.radius[0] + (self.radius[1] - self.radius[0]) * t;
        let apart = (r + self.along * t - toward * s).norm_squared();
        (s > 0.0 && s < reach && apart < radius * radius)
            .then(|| self.opacity[0] + (self.opacity[1] - self.opacity[0]) * t)
    }
}

/// Transmittance of points, each named by its layer and its index there, by rays.
pub fn transmittance_exact(
    source: Source,
    layers: &[ShadowHair],
    solids: &[Solid],
    footprint: &Footprint,
    points: &[[usize; 2]],
) -> Result<Vec<Sample>, BadSource> {
    let settings = ShadowSettings { texels: TEXELS, filter: footprint.side, ..ShadowSettings::default() }.clamped();
    let (mut projections, _) = fit(source, layers, &settings)?;
    let mut out = vec![Sample { mean: 1.0, variance: 0.0 }; points.len()];
    for projection in &mut projections {
        let (chunks, grid) = chunks(projection, layers);
        let projection = &*projection;
        let mut wanted: Vec<(usize, usize, [f32; 3])> = Vec::new();
        for (k, &[l, i]) in points.iter().enumerate() {
            match projection.place(layers[l].point(i)) {
                Place::At(at, true) => {
                    let tile = |v: f32| (v.max(0.0) as usize / TILE).min(grid - 1);
                    wanted.push((tile(at[1]) * grid + tile(at[0]), k, at));
                }
                Place::Masked(_) => out[k].mean = 0.0,
                _ => {}
            }
        }
        wanted.sort_unstable_by_key(|w| (w.0, w.1));
        let tiles: Vec<&[(usize, usize, [f32; 3])]> = wanted.chunk_by(|a, b| a.0 == b.0).collect();
        let found: Vec<Vec<Sample>> = tiles
            .par_iter()
            .map(|wanted| {
                let cells = Cells::new(projection, &chunks, layers, wanted[0].0, grid);
                let sample = |w: &(usize, usize, [f32; 3])| {
                    let [l, i] = points[w.1];
                    cells.sample(projection, layers, solids, footprint, [l, i], w.2)
                };
                wanted.iter().map(sample).collect()
            })
            .collect();
        for (w, s) in tiles.iter().zip(&found) {
            for (w, s) in w.iter().zip(s) {
                out[w.1] = *s;
            }
        }
    }
    Ok(out)
}

/// Segments of one tile by texel.
struct Cells {
    side: usize,
    low: [f32; 2],
    axis: Vec<Axis>,
    start: Vec<u32>,
    list: Vec<u32>,
}

impl Cells {
    fn new(projection: &Projection, chunks: &[Chunk], layers: &[ShadowHair], tile: usize, grid: usize) -> Cells {
        let border = projection.border();
        let side = TILE + 2 * border;
        let low = [tile % grid, tile / grid].map(|t| (t * TILE) as f32 - border as f32);
        let mut axis = Vec::new();
        let mut pairs: Vec<[u32; 2]> = Vec::new();
        for chunk in chunks {
            let layer = &layers[chunk.layer];
            for &k in chunk.tile(tile) {
                let k = k as usize;
                let Some(s) = chunk.segment(k, layer, projection) else { continue };
                let i = chunk.first + k;
                let index = axis.len() as u32;
                axis.push(Axis::new(layer, chunk.layer_strand(k), i, chunk.point[k].strand(), s.a[2].min(s.b[2])));
                // Wide enough for either end's width and for rounding.
                let unit = projection.per_unit(s.a[2]).max(projection.per_unit(s.b[2]));
                let width = layer.width(i).max(layer.width(i + 1)) * unit * projection.stretch(&s.a, &s.b);
                let pad = 0.55 * width + 0.02;
                let [a, b] = [s.a, s.b].map(|p| [p[0] - low[0], p[1] - low[1]]);
                covered(a, b, pad, side, |cell| pairs.push([cell as u32, index]));
            }
        }
        let mut start = vec![0u32; side * side + 1];
        for p in &pairs {
            start[p[0] as usize + 1] += 1;
        }
        for c in 0..side * side {
            start[c + 1] += start[c];
        }
        let mut next = start.clone();
        let mut list = vec![0; pairs.len()];
        for [cell, index] in pairs {
            let at = &mut next[cell as usize];
            list[*at as usize] = index;
            *at += 1;
        }
        Cells { side, low, axis, start, list }
    }

    /// Truth of point `i` of layer `l`, which lies at `at` on the plane.
    fn sample(
        &self,
        projection: &Projection,
        layers: &[ShadowHair],
        solids: &[Solid],
        footprint: &Footprint,
        [l, i]: [usize; 2],
        at: [f32; 3],
    ) -> Sample {
        let layer = &layers[l];
        let p = layer.point(i);
        if solid::is_hidden(solids, p, projection) {
            return Sample::default();
        }
        let strand = super::bins::strand_of(layers, l, i);
        let behind = at[2] + 1e-4 * projection.size as f32;
        let light = |x: f64, y: f64| {
            let [u, v] = projection.texel_steps(p);
            let origin = p + u * x + v * y;
            let Some((toward, reach)) = projection.toward(origin) else { return 1.0 };
            let cell = [x as f32 + at[0] - self.low[0], y as f32 + at[1] - self.low[1]];
            let last = self.side as f32 - 0.5;
            let c = cell[1].clamp(0.0, last) as usize * self.side + cell[0].clamp(0.0, last) as usize;
            let mut product = 1.0;
            for &k in &self.list[self.start[c] as usize..self.start[c + 1] as usize] {
                let axis = &self.axis[k as usize];
                if axis.strand != strand
                    && axis.first <= behind
                    && let Some(o) = axis.crossed(&origin, &toward, reach)
                {
                    product *= 1.0 - o;
                }
            }
            product
        };
        let side = footprint.side * projection.texels as f64;
        if side.is_nan() || side <= 0.0 || footprint.rays <= 1 {
            return Sample { mean: light(0.0, 0.0), variance: 0.0 };
        }
        let strata = ((footprint.rays as f64 / 2.0).sqrt().ceil() as usize).max(1);
        let (mut sum, mut spread) = (0.0, 0.0);
        let name = rng::mix((l as u64) << 40 | i as u64);
        for k in 0..strata * strata {
            let draw = |j: u64| {
                let u = |d: u64| rng::uniform(footprint.seed, name, JITTER, 4 * k as u64 + 2 * j + d);
                let place = |c: usize, r: f64| ((c as f64 + r) / strata as f64 - 0.5) * side;
                light(place(k % strata, u(0)), place(k / strata, u(1)))
            };
            let (a, b) = (draw(0), draw(1));
            sum += a + b;
            spread += (a - b) * (a - b);
        }
        let n = (strata * strata) as f64;
        Sample { mean: sum / (2.0 * n), variance: spread / (4.0 * n * n) }
    }
}

/// Cells of a grid that a line of half width `pad` may touch.
fn covered(a: [f32; 2], b: [f32; 2], pad: f32, side: usize, mut visit: impl FnMut(usize)) {
    let last = side as f32 - 1.0;
    let (low, high) = ([0, 1].map(|i| a[i].min(b[i]) - pad), [0, 1].map(|i| a[i].max(b[i]) + pad));
    if high[0] < 0.0 || high[1] < 0.0 || low[0] >= last + 1.0 || low[1] >= last + 1.0 {
        return;
    }
    let slope = (b[0] - a[0]) / (b[1] - a[1]);
    for y in low[1].clamp(0.0, last) as usize..=high[1].clamp(0.0, last) as usize {
        // The part of the line whose surroundings reach into this row.
        let (mut from, mut to) = (low[0], high[0]);
        if slope.is_finite() {
            let x = |v: f32| a[0] + (v.clamp(a[1].min(b[1]), a[1].max(b[1])) - a[1]) * slope;
            let ends = [x(y as f32 - pad), x(y as f32 + 1.0 + pad)];
            from = from.max(ends[0].min(ends[1]) - pad);
            to = to.min(ends[0].max(ends[1]) + pad);
        }
        if to < 0.0 || from >= last + 1.0 {
            continue;
        }
        for x in from.clamp(0.0, last) as usize..=to.clamp(0.0, last) as usize {
            visit(y * side + x);
        }
    }
}
