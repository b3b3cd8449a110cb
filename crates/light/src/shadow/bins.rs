//! Segments sorted into the tiles they touch.

use super::line::{part_over, thickness};
use super::numbers::{least, most};
use super::project::{Place, Projection};
use super::{ShadowHair, TILE};
use rayon::prelude::*;
use std::ops::Range;

/// Points per chunk of work, about. Each chunk keeps its own lists by tile: much smaller chunks scatter a tile's list
/// over more memory, much larger ones leave threads idle at the end.
const CHUNK: usize = 32_768;

/// Entries of all lists per point above which the map is made coarser, by halves, until they are fewer: only hairs wider
/// or longer than many tiles come here, and their lists would grow as the square of the resolution.
const CROWDED: usize = 64;

/// Marks points whose value this map gives.
const RECEIVES: u32 = 1 << 31;

/// A point on the light's plane; x is not a number where the map has no place for it. With it, what the segment to the
/// next point takes of the light: see [`Segment`]; 0 where there is none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub at: [f32; 3],
    strand: u32,
    width: f32,
    thickness: f32,
}

impl Point {
    pub fn strand(&self) -> u32 {
        self.strand & !RECEIVES
    }

    pub fn receives(&self) -> bool {
        self.strand & RECEIVES != 0
    }
}

/// Some strands of a layer, and which of their segments each tile has. A segment is named by its first point, and the
/// last point of a strand stands for itself.
#[derive(Debug, Default)]
pub(crate) struct Chunk {
    pub layer: usize,
    /// Its first point in the layer.
    pub first: usize,
    /// Added to strands of the layer: distinct over layers.
    strand_shift: usize,
    pub point: Vec<Point>,
    /// Tile t has `list[start[t]..start[t + 1]]`, in order of the points.
    start: Vec<u32>,
    pub list: Vec<u32>,
    /// Points of the layer outside the cone.
    pub masked: Vec<u32>,
    pub receivers: usize,
    pub segments: usize,
}

/// A segment on the plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    pub a: [f32; 3],
    pub b: [f32; 3],
    /// Width in texels.
    pub width: f32,
    /// Optical depth per area covered.
    pub thickness: f32,
}

impl Segment {
    /// The part that may reach a square of `side` texels from zero on. Slices are placed for what lies over a tile: where
    /// the rest of a long segment lies says nothing, and depths between its ends would be taken for slices between theirs.
    #[inline(always)]
    pub fn over(&self, side: f32) -> Option<Segment> {
        let (a, b, margin) = (self.a, self.b, 0.5 * self.width + 1.0);
        let in_square = |p: &[f32; 3]| least(p[0], p[1]) >= -margin && most(p[0], p[1]) < side + margin;
        if in_square(&a) && in_square(&b) {
            return Some(*self);
        }
        self.cut(side, margin)
    }

    fn cut(&self, side: f32, margin: f32) -> Option<Segment> {
        let (a, b) = (self.a, self.b);
        let [from, to] = part_over(&a, &b, -margin, side + margin)?;
        let at = |t: f32| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t);
        Some(Segment { a: if from > 0.0 { at(from) } else { a }, b: if to < 1.0 { at(to) } else { b }, ..*self })
    }
}

impl Chunk {
    /// Points of the chunk that tile `t` has to look at.
    pub fn tile(&self, t: usize) -> &[u32] {
        &self.list[self.start[t] as usize..self.start[t + 1] as usize]
    }

    /// Memory, with the tiles of each point that are known while lists are made.
    pub fn bytes(&self) -> usize {
        32 * self.point.len() + 4 * (self.start.len() + self.list.len() + self.masked.len())
    }

    /// Strand in the layer of point `k` of the chunk.
    pub fn layer_strand(&self, k: usize) -> usize {
        self.point[k].strand() as usize - self.strand_shift
    }

    /// Where the segment from point `k` of the chunk to the next lies, if there is one and this map sees some of it.
    #[inline]
    fn ends(&self, k: usize, layer: &ShadowHair, projection: &Projection) -> Option<[[f32; 3]; 2]> {
        let (p, n) = (self.point[k], self.point.get(k + 1)?);
        if p.strand() != n.strand() {
            return None;
        }
        if p.at[0].is_nan() || n.at[0].is_nan() {
            let i = self.first + k;
            return projection.clip_points(layer.point(i), layer.point(i + 1));
        }
        Some([p.at, n.at])
    }

    /// The segment from point `k` of the chunk to the next, if it casts shadow here.
    #[inline]
    pub fn segment(&self, k: usize, layer: &ShadowHair, projection: &Projection) -> Option<Segment> {
        let Point { width, thickness, .. } = self.point[k];
        if width == 0.0 {
            return None;
        }
        let [a, b] = self.ends(k, layer, projection)?;
        Some(Segment { a, b, width, thickness })
    }

    /// Fills in what the segments take of the light.
    fn weigh(&mut self, layer: &ShadowHair, projection: &Projection) {
        for k in 0..self.point.len() {
            let i = self.first + k;
            let s = self.layer_strand(k);
            let Some([a, b]) = self.ends(k, layer, projection) else { continue };
            let width = 0.5 * (layer.width(i) + layer.width(i + 1));
            let opacity = 0.5 * (layer.opacity(s, i) + layer.opacity(s, i + 1));
            let width = width * projection.per_unit(0.5 * (a[2] + b[2])) * projection.stretch(&a, &b);
            if opacity > 0.0 && width > 0.0 && width < f32::MAX {
                self.point[k].width = width;
                let (x, y) = ((b[0] - a[0]).abs(), (b[1] - a[1]).abs());
                let slope = x.min(y) / x.max(y).max(1e-30);
                self.point[k].thickness = thickness(width, (1.0 + slope * slope).sqrt(), opacity);
                self.segments += 1;
            }
        }
    }
}

/// All hairs in chunks, and the tiles along a side of the map, which is made coarser where there is no other way.
pub(crate) fn chunks(projection: &mut Projection, layers: &[ShadowHair]) -> (Vec<Chunk>, usize) {
    let points: usize = layers.iter().map(|l| l.position.len()).sum();
    loop {
        let room = if projection.texels > TILE { CROWDED * points.max(1024) } else { usize::MAX };
        if let Some(done) = try_chunks(projection, layers, room) {
            return done;
        }
        projection.halve();
    }
}

fn try_chunks(projection: &Projection, layers: &[ShadowHair], room: usize) -> Option<(Vec<Chunk>, usize)> {
    let mut jobs: Vec<(usize, Range<usize>, usize)> = Vec::new();
    let mut shift = 0;
    for (l, layer) in layers.iter().enumerate() {
        let mut from = 0;
        while from < layer.offsets.len() {
            let mut to = from + 1;
            let first = layer.offsets.range(from).start;
            while to < layer.offsets.len() && layer.offsets.range(to).end - first <= CHUNK {
                to += 1;
            }
            jobs.push((l, from..to, shift));
            from = to;
        }
        shift += layer.offsets.len();
    }
    assert!(shift < RECEIVES as usize, "more than 2^31 strands");
    let grid = projection.texels.div_ceil(TILE);
    let mut done: Vec<(Chunk, Vec<Tiles>)> = jobs
        .into_par_iter()
        .map(|(l, strands, shift)| {
            let mut chunk = place(projection, &layers[l], l, strands, shift);
            chunk.weigh(&layers[l], projection);
            let touched = touched(&chunk, projection, &layers[l], grid);
            let mut start = vec![0; grid * grid + 1];
            if touched.iter().map(Tiles::block).sum::<usize>() / 64 > room {
                start[grid * grid] = u32::MAX;
                chunk.start = start;
                return (chunk, touched);
            }
            for (k, r) in touched.iter().enumerate() {
                r.each(&chunk, k, &layers[l], projection, |t| start[t + 1] += 1);
            }
            for t in 0..grid * grid {
                start[t + 1] += start[t];
            }
            chunk.start = start;
            (chunk, touched)
        })
        .collect();
    let pairs: usize = done.iter().map(|(chunk, _)| chunk.start[grid * grid] as usize).sum();
    if pairs > room {
        return None;
    }
    done.par_iter_mut().for_each(|(chunk, touched)| sort(chunk, touched, &layers[chunk.layer], projection));
    Some((done.into_iter().map(|d| d.0).collect(), grid))
}

/// A block of tiles: first and last column, first and last row; nothing if a last is before its first.
#[derive(Clone, Copy)]
struct Tiles([u16; 4]);

impl Tiles {
    const NONE: Tiles = Tiles([1, 0, 1, 0]);

    /// Tiles of the block.
    fn block(&self) -> usize {
        let [x0, x1, y0, y1] = self.0.map(usize::from);
        (x1 + 1 - x0) * (y1 + 1 - y0)
    }

    /// Visits those of the block that point `k`, or the segment that begins there, touches: in blocks more than one tile
    /// high and wide, row by row, as much of each as the segment reaches.
    #[inline]
    fn each(self, chunk: &Chunk, k: usize, layer: &ShadowHair, projection: &Projection, mut visit: impl FnMut(usize)) {
        let [x0, x1, y0, y1] = self.0.map(usize::from);
        let grid = projection.texels.div_ceil(TILE);
        let slanted = if x1 > x0 && y1 > y0 { chunk.segment(k, layer, projection) } else { None };
        for y in y0..=y1 {
            let (mut from, mut to) = (x0, x1);
            if let Some(s) = &slanted {
                let pad = 0.5 * s.width + projection.border() as f32 + 0.01;
                let [low, high] = [y * TILE, (y + 1) * TILE].map(|v| v as f32);
                let slope = (s.b[0] - s.a[0]) / (s.b[1] - s.a[1]);
                let at = |v: f32| s.a[0] + (v.clamp(s.a[1].min(s.b[1]), s.a[1].max(s.b[1])) - s.a[1]) * slope;
                let (u, v) = (at(low - pad), at(high + pad));
                // A segment along the rows has no slope, and is in all columns.
                if u.is_finite() && v.is_finite() {
                    let tile = |v: f32| (v * (1.0 / TILE as f32)).clamp(0.0, (grid - 1) as f32) as usize;
                    from = from.max(tile(u.min(v) - pad));
                    to = to.min(tile(u.max(v) + pad));
                }
            }
            for x in from..=to {
                visit(y * grid + x);
            }
        }
    }
}

/// The layer's strand that point `i` of layer `l` is on, in the numbers of [`Point::strand`].
pub(crate) fn strand_of(layers: &[ShadowHair], l: usize, i: usize) -> u32 {
    let before: usize = layers[..l].iter().map(|l| l.offsets.len()).sum();
    (before + layers[l].offsets.run_of(i)) as u32
}

/// Puts points on the plane.
fn place(
    projection: &Projection,
    layer: &ShadowHair,
    index: usize,
    strands: Range<usize>,
    strand_shift: usize,
) -> Chunk {
    let end = layer.position.len();
    let first = layer.offsets.range(strands.start).start.min(end);
    let mut chunk = Chunk { layer: index, first, strand_shift, ..Chunk::default() };
    chunk.point.reserve(layer.offsets.range(strands.end - 1).end.min(end) - first);
    for s in strands {
        let range = layer.offsets.range(s);
        let name = (s + strand_shift) as u32;
        for i in range.start.min(end)..range.end.min(end) {
            let nowhere = [f32::NAN; 3];
            let (at, receives) = match projection.place(layer.point(i)) {
                Place::At(at, receives) => (at, receives),
                Place::Beyond | Place::Bad => (nowhere, false),
                Place::Masked(at) => {
                    chunk.masked.push(i as u32);
                    (at.unwrap_or(nowhere), false)
                }
            };
            chunk.receivers += usize::from(receives);
            let strand = name | if receives { RECEIVES } else { 0 };
            chunk.point.push(Point { at, strand, width: 0.0, thickness: 0.0 });
        }
    }
    chunk
}

/// The tiles that each point of a chunk, or the segment that begins there, touches.
fn touched(chunk: &Chunk, projection: &Projection, layer: &ShadowHair, grid: usize) -> Vec<Tiles> {
    let border = projection.border() as f32;
    let side = grid as f32;
    (0..chunk.point.len())
        .map(|k| {
            let p = chunk.point[k];
            let segment = chunk.segment(k, layer, projection);
            let (lo, hi) = match &segment {
                Some(s) => {
                    let pad = 0.5 * s.width + border;
                    ([0, 1].map(|i| s.a[i].min(s.b[i]) - pad), [0, 1].map(|i| s.a[i].max(s.b[i]) + pad))
                }
                None if p.receives() => ([p.at[0], p.at[1]], [p.at[0], p.at[1]]),
                None => return Tiles::NONE,
            };
            let tile = |v: f32| v * (1.0 / TILE as f32);
            let (lo, hi) = (lo.map(tile), hi.map(tile));
            if hi[0] < 0.0 || hi[1] < 0.0 || lo[0] >= side || lo[1] >= side {
                return Tiles::NONE;
            }
            let into = |v: f32| v.clamp(0.0, side - 1.0) as u16;
            Tiles([into(lo[0]), into(hi[0]), into(lo[1]), into(hi[1])])
        })
        .collect()
}

/// Fills the lists by tile: a counting sort, in order of the points.
fn sort(chunk: &mut Chunk, touched: &mut Vec<Tiles>, layer: &ShadowHair, projection: &Projection) {
    let mut next = chunk.start.clone();
    let mut list = vec![0; next[next.len() - 1] as usize];
    for (k, r) in std::mem::take(touched).into_iter().enumerate() {
        r.each(chunk, k, layer, projection, |t| {
            list[next[t] as usize] = k as u32;
            next[t] += 1;
        });
    }
    chunk.list = list;
}
