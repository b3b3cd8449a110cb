//! One tile of a map: fills its volume, samples its points.

use super::bins::{Chunk, Segment};
use super::project::Projection;
use super::settings::{Placement, ShadowSettings};
use super::volume::{Fragment, Own, Volume, Window, fragments};
use super::{ShadowHair, TILE};
use std::sync::atomic::{AtomicU32, Ordering};

/// Bins of the depth histogram.
const BINS: usize = 256;

/// Part of the slices that is spread evenly whatever the histogram says: without it a few hairs far from the rest share
/// one slice.
const EVEN: f32 = 0.25;

/// What one thread needs for its tiles.
pub(crate) struct Work<'a> {
    projection: &'a Projection,
    settings: &'a ShadowSettings,
    volume: Volume,
    entry: Vec<Entry>,
    warp: Vec<f32>,
    own: Own,
    fragment: Vec<Fragment>,
    run: Vec<Run>,
}

/// A point of the tile's list with the segment that begins there.
struct Entry {
    segment: Option<Segment>,
    strand: u32,
    /// Layer and point in it, and where it is in the volume; for points whose value this tile gives.
    receiver: Option<(u32, u32, [f32; 3])>,
}

/// Fragments of one segment and the texels they lie in.
struct Run {
    fragments: std::ops::Range<usize>,
    low: [i32; 2],
    high: [i32; 2],
}

impl<'a> Work<'a> {
    pub fn new(projection: &'a Projection, settings: &'a ShadowSettings) -> Work<'a> {
        Work {
            projection,
            settings,
            volume: Volume::new(projection.filter, settings.slices),
            entry: Vec::new(),
            warp: Vec::new(),
            own: Own::new(),
            fragment: Vec::new(),
            run: Vec::new(),
        }
    }

    /// Works tile `t` at `place`; false if it has nothing to give.
    pub fn run(
        &mut self,
        chunks: &[Chunk],
        layers: &[ShadowHair],
        place: [usize; 2],
        t: usize,
        cells: &[Vec<AtomicU32>],
    ) -> bool {
        let Some([from, to]) = self.gather(chunks, layers, place, t) else { return false };
        self.place_slices(from, to);
        self.volume.clear();
        for e in &self.entry {
            if let Some(s) = &e.segment {
                self.volume.splat(s);
            }
        }
        self.volume.sum();
        let mut first = 0;
        while first < self.entry.len() {
            let strand = self.entry[first].strand;
            let count = self.entry[first..].iter().take_while(|e| e.strand == strand).count();
            self.receive(first..first + count, cells);
            first += count;
        }
        true
    }

    /// Lists what the tile has, in texels of the volume; the depths of its first and last receiver.
    fn gather(
        &mut self,
        chunks: &[Chunk],
        layers: &[ShadowHair],
        place: [usize; 2],
        t: usize,
    ) -> Option<[f32; 2]> {
        self.entry.clear();
        let border = self.projection.border() as f32;
        let low = place.map(|v| (v * TILE) as f32 - border);
        let (mut from, mut to) = (f32::INFINITY, f32::NEG_INFINITY);
        let shift = |p: [f32; 3]| [p[0] - low[0], p[1] - low[1], p[2]];
        let top = self.projection.texels as f32 - 0.001;
        for chunk in chunks {
            for &k in chunk.tile(t) {
                let k = k as usize;
                let p = &chunk.point[k];
                let mut receiver = None;
                if p.receives() {
                    let inside = |i: usize| (p.at[i].clamp(0.0, top) * (1.0 / TILE as f32)) as usize == place[i];
                    if inside(0) && inside(1) {
                        from = from.min(p.at[2]);
                        to = to.max(p.at[2]);
                        let at = shift([p.at[0].clamp(0.0, top), p.at[1].clamp(0.0, top), p.at[2]]);
                        receiver = Some((chunk.layer as u32, (chunk.first + k) as u32, at));
                    }
                }
                let segment = chunk
                    .segment(k, &layers[chunk.layer], self.projection)
                    .map(|s| Segment { a: shift(s.a), b: shift(s.b), ..s });
                self.entry.push(Entry { segment, strand: p.strand(), receiver });
            }
        }
        (from <= to).then_some([from, to])
    }

    /// Places the slices between depths `from` and `to`, and turns depths into slice coordinates.
    fn place_slices(&mut self, from: f32, to: f32) {
        let slices = self.settings.slices as f32;
        let range = (to - from).max(f32::MIN_POSITIVE);
        let scale = BINS as f32 / range;
        let scale = if scale.is_finite() { scale } else { 0.0 };
        self.warp.clear();
        match self.settings.placement {
            Placement::Uniform => self.warp.extend((0..=BINS).map(|b| b as f32 * slices / BINS as f32)),
            Placement::Histogram => {
                let mut count = [0u32; BINS];
                for s in self.entry.iter().filter_map(|e| e.segment.as_ref()) {
                    let b = (0.5 * (s.a[2] + s.b[2]) - from) * scale;
                    if b >= 0.0 && b < BINS as f32 {
                        count[b as usize] += 1;
                    }
                }
                let all = count.iter().sum::<u32>().max(1) as f32;
                let mut sum = 0.0;
                self.warp.push(0.0);
                for c in count {
                    sum += (1.0 - EVEN) * c as f32 / all + EVEN / BINS as f32;
                    self.warp.push(sum);
                }
                let end = slices / sum;
                self.warp.iter_mut().for_each(|v| *v *= end);
            }
        }
        let warp = &self.warp;
        let at = |z: f32| {
            let b = (z - from) * scale;
            if b < 0.0 {
                b.max(-1e6)
            } else if b >= BINS as f32 {
                slices + (b - BINS as f32).min(1e6)
            } else {
                let i = b as usize;
                warp[i] + (warp[i + 1] - warp[i]) * (b - i as f32)
            }
        };
        for e in &mut self.entry {
            if let Some(s) = &mut e.segment {
                s.a[2] = at(s.a[2]);
                s.b[2] = at(s.b[2]);
            }
            if let Some((_, _, p)) = &mut e.receiver {
                p[2] = at(p[2]);
            }
        }
    }

    /// Gives the points of one strand their values.
    fn receive(&mut self, entries: std::ops::Range<usize>, cells: &[Vec<AtomicU32>]) {
        let entry = &self.entry[entries];
        if entry.iter().all(|e| e.receiver.is_none()) {
            return;
        }
        self.fragment.clear();
        self.run.clear();
        for s in entry.iter().filter_map(|e| e.segment.as_ref()) {
            let start = self.fragment.len();
            let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
            fragments(s, self.volume.side, self.settings.slices, |x, y, layer, depth| {
                low = [low[0].min(x), low[1].min(y)];
                high = [high[0].max(x), high[1].max(y)];
                self.fragment.push(Fragment { x: x as i16, y: y as i16, layer: layer as i16, depth });
            });
            self.run.push(Run { fragments: start..self.fragment.len(), low, high });
        }
        for (layer, point, at) in entry.iter().filter_map(|e| e.receiver) {
            let window = Window::new(at[0], at[1], self.projection.filter);
            let (plane, f) = self.volume.plane(at[2]);
            let interpolation = self.settings.interpolation;
            self.own.clear(&window, interpolation);
            for r in &self.run {
                let apart = r.low[0] >= window.x + window.across as i32
                    || r.low[1] >= window.y + window.down as i32
                    || r.high[0] < window.x
                    || r.high[1] < window.y;
                if apart {
                    continue;
                }
                let own = &self.fragment[r.fragments.clone()];
                self.own.add(&window, own, plane as i32, f, interpolation);
            }
            let light = self.volume.sample(&window, at[2], &self.own, interpolation);
            cells[layer as usize][point as usize].store(light.to_bits(), Ordering::Relaxed);
        }
    }
}
