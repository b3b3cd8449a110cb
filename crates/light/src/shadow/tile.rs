//! One tile of a map: fills its volume, samples its points.

use super::bins::{Chunk, Point, Segment};
use super::line::Line;
use super::project::Projection;
use super::settings::{Placement, ShadowSettings};
use super::solid::{self, Cover, Solid};
use super::volume::{Own, Taps, Volume, Window};
use super::{ShadowHair, TILE};
use std::sync::atomic::{AtomicU32, Ordering};

/// Bins of the depth histogram.
const BINS: usize = 256;

/// Part of the slices that is spread evenly whatever the histogram says: without it a few hairs far from the rest share
/// one slice.
const EVEN: f32 = 0.25;

/// Points that are read ahead of their use: lists jump about in memory, and loads that do not wait for each other
/// overlap.
const AHEAD: usize = 64;

/// Times that a segment is halved until it is straight in slices.
const SPLITS: u32 = 5;

/// Slices that the middle of a segment may be off by: more puts hair before its neighbour that lies behind it.
const STRAIGHT: f32 = 0.25;

/// Hands out a segment in pieces whose depths are right between their ends too when `at` puts them into slices; `a` and `b`
/// are the slices of its own ends.
fn straighten(s: Segment, [a, b]: [f32; 2], at: &impl Fn(f32) -> f32, splits: u32, emit: &mut impl FnMut(Segment)) {
    let middle: [f32; 3] = std::array::from_fn(|i| 0.5 * (s.a[i] + s.b[i]));
    let m = at(middle[2]);
    if splits > 0 && (m - 0.5 * (a + b)).abs() > STRAIGHT {
        straighten(Segment { b: middle, ..s }, [a, m], at, splits - 1, emit);
        straighten(Segment { a: middle, ..s }, [m, b], at, splits - 1, emit);
    } else {
        emit(Segment { a: [s.a[0], s.a[1], a], b: [s.b[0], s.b[1], b], ..s });
    }
}

/// What one thread needs for its tiles.
pub(crate) struct Work<'a> {
    projection: &'a Projection,
    settings: &'a ShadowSettings,
    solids: &'a [Solid<'a>],
    cover: &'a Cover,
    /// Points of the tile behind solids.
    hidden: usize,
    volume: Volume,
    segment: Vec<Cast>,
    /// Room for segments while they are cut where slices change their distances.
    bent: Vec<Cast>,
    receiver: Vec<Receiver>,
    line: Vec<Line>,
    warp: Vec<f32>,
    taps: Taps,
    window: Window,
}

/// A segment in texels of the volume and the strand it is of.
struct Cast {
    segment: Segment,
    strand: u32,
}

/// A point whose value the tile gives.
struct Receiver {
    at: [f32; 3],
    strand: u32,
    layer: u32,
    point: u32,
    /// No solid lies between it and the light.
    clear: bool,
}

impl<'a> Work<'a> {
    pub fn new(
        projection: &'a Projection,
        settings: &'a ShadowSettings,
        solids: &'a [Solid<'a>],
        cover: &'a Cover,
    ) -> Work<'a> {
        Work {
            projection,
            settings,
            solids,
            cover,
            hidden: 0,
            volume: Volume::new(projection.filter, settings.slices),
            segment: Vec::new(),
            bent: Vec::new(),
            receiver: Vec::new(),
            line: Vec::new(),
            warp: Vec::new(),
            taps: Taps::new(),
            window: Window::new(),
        }
    }

    /// Works tile `t` at `place`; how many of its points are behind solids; `None` if it has nothing to give.
    pub fn run(
        &mut self,
        chunks: &[Chunk],
        layers: &[ShadowHair],
        place: [usize; 2],
        t: usize,
        cells: &[Vec<AtomicU32>],
    ) -> Option<usize> {
        let [from, to] = self.gather(chunks, layers, place, t)?;
        self.hidden = 0;
        self.place_slices(from, to);
        self.volume.clear();
        self.line.clear();
        // Segments and receivers are in the same order of strands.
        let (mut s, mut r) = (0, 0);
        let mut runs = Vec::new();
        while r < self.receiver.len() {
            let strand = self.receiver[r].strand;
            let first = r;
            while r < self.receiver.len() && self.receiver[r].strand == strand {
                r += 1;
            }
            self.fill(&mut s, |other| other < strand);
            let line = self.line.len();
            self.fill(&mut s, |other| other == strand);
            runs.push((first..r, line..self.line.len()));
        }
        self.fill(&mut s, |_| true);
        self.volume.sum();
        for (receivers, lines) in runs {
            self.receive(receivers, lines, layers, cells);
        }
        Some(self.hidden)
    }

    /// Puts segments from `next` on into the volume while their strand is of a kind.
    fn fill(&mut self, next: &mut usize, of: impl Fn(u32) -> bool) {
        while let Some(own) = self.segment.get(*next)
            && of(own.strand)
        {
            Line::of(&own.segment, self.volume.side(), self.settings.slices, |l| {
                self.volume.add(&l);
                self.line.push(l);
            });
            *next += 1;
        }
    }

    /// Lists what the tile has, in texels of the volume; the depths of its first and last receiver.
    fn gather(&mut self, chunks: &[Chunk], layers: &[ShadowHair], place: [usize; 2], t: usize) -> Option<[f32; 2]> {
        self.segment.clear();
        self.receiver.clear();
        let border = self.projection.border() as f32;
        let low = place.map(|v| (v * TILE) as f32 - border);
        let (mut from, mut to) = (f32::INFINITY, f32::NEG_INFINITY);
        let shift = |p: [f32; 3]| [p[0] - low[0], p[1] - low[1], p[2]];
        let top = self.projection.texels as f32 - 0.001;
        let side = self.volume.side() as f32;
        let mut word = [0u32; AHEAD];
        for chunk in chunks {
            for list in chunk.tile(t).chunks(AHEAD) {
                for (w, &k) in word.iter_mut().zip(list) {
                    *w = chunk.point[k as usize].word();
                }
                for (&w, &k) in word.iter().zip(list) {
                    let k = k as usize;
                    let strand = Point::strand_of(w);
                    if Point::receives_of(w) {
                        let p = chunk.point[k].at;
                        let p = [p[0].clamp(0.0, top), p[1].clamp(0.0, top), p[2]];
                        let inside = |i: usize| (p[i] * (1.0 / TILE as f32)) as usize == place[i];
                        if inside(0) && inside(1) {
                            from = from.min(p[2]);
                            to = to.max(p[2]);
                            let point = (chunk.first + k) as u32;
                            let (layer, clear) = (chunk.layer as u32, self.cover.is_clear(p));
                            self.receiver.push(Receiver { at: shift(p), strand, layer, point, clear });
                        }
                    }
                    if let Some(s) = chunk.segment(k, &layers[chunk.layer], self.projection) {
                        let s = Segment { a: shift(s.a), b: shift(s.b), ..s };
                        self.segment.extend(s.over(side).map(|segment| Cast { segment, strand }));
                    }
                }
            }
        }
        (from <= to).then_some([from, to])
    }

    /// Places the slices between depths `from` and `to`, and turns depths into slice coordinates.
    fn place_slices(&mut self, from: f32, to: f32) {
        let slices = self.settings.slices as f32;
        // Points of one depth still lie behind what is nearer the light.
        let scale = BINS as f32 / (to - from).max(1e-6 * from.abs().max(to.abs())).max(1e-30);
        self.warp.clear();
        match self.settings.placement {
            Placement::Uniform => self.warp.extend((0..=BINS).map(|b| b as f32 * slices / BINS as f32)),
            Placement::Histogram => {
                let mut count = [0u32; BINS];
                for Cast { segment: s, .. } in &self.segment {
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
        self.bent.clear();
        for Cast { segment, strand } in &self.segment {
            let mut emit = |segment| self.bent.push(Cast { segment, strand: *strand });
            straighten(*segment, [at(segment.a[2]), at(segment.b[2])], &at, SPLITS, &mut emit);
        }
        std::mem::swap(&mut self.segment, &mut self.bent);
        for r in &mut self.receiver {
            r.at[2] = at(r.at[2]);
        }
    }

    /// Gives points of one strand their values.
    fn receive(
        &mut self,
        receivers: std::ops::Range<usize>,
        lines: std::ops::Range<usize>,
        layers: &[ShadowHair],
        cells: &[Vec<AtomicU32>],
    ) {
        let interpolation = self.settings.interpolation;
        let own = Own::new(&self.line[lines]);
        for r in &self.receiver[receivers] {
            let window = &mut self.window;
            window.put(r.at[0], r.at[1], self.projection.filter);
            let mut light = self.volume.sample(window, r.at[2], &own, &mut self.taps, interpolation);
            if !r.clear && light > 0.0 {
                let p = layers[r.layer as usize].point(r.point as usize);
                if solid::is_hidden(self.solids, p, self.projection) {
                    light = 0.0;
                    self.hidden += 1;
                }
            }
            cells[r.layer as usize][r.point as usize].store(light.to_bits(), Ordering::Relaxed);
        }
    }
}
