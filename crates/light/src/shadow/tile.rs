//! One tile of a map: spreads its segments, samples its points.

use super::bins::{Chunk, Segment};
use super::line::Line;
use super::planes::{Deposits, Planes};
use super::project::Projection;
use super::sample::{Around, Own, Taps, Window, dark};
use super::settings::{Interpolation, ShadowSettings};
use super::slices::Slices;
use super::solid::{self, Cover, Solid};
use super::{ShadowHair, TILE};
use pelage_geom::registers::{Kernel, Lanes, Width, fetch, run_at};
use std::sync::atomic::{AtomicU32, Ordering};

/// Points ahead for which memory is asked for: lists jump about in memory.
const AHEAD: usize = 24;

/// Points ahead for which memory is asked for.
const SOON: usize = 3;

/// What one thread needs for its tiles.
pub(crate) struct Work<'a> {
    projection: &'a Projection,
    settings: &'a ShadowSettings,
    solids: &'a [Solid<'a>],
    cover: &'a Cover,
    width: Width,
    /// Texels along a side, with the border.
    side: usize,
    slices: Slices,
    deposits: Deposits,
    planes: Planes,
    segment: Vec<Cast>,
    receiver: Vec<Receiver>,
    /// Lines of the hairs that have points here, and where those of each hair lie.
    line: Vec<Line>,
    run: Vec<Run>,
    /// Receivers by the plane before them: plane k has `order[start[k]..start[k + 1]]`.
    order: Vec<u32>,
    start: Vec<u32>,
    taps: Taps,
    window: Window,
}

/// A segment in texels of the tile and the strand it is of.
struct Cast {
    segment: Segment,
    strand: u32,
}

/// A point whose value the tile gives.
#[derive(Clone, Copy)]
struct Receiver {
    /// Texels, and depth; then how far it is from its plane to the next.
    at: [f32; 3],
    /// The plane before it.
    plane: u32,
    /// Strand; then its place in the list of runs.
    strand: u32,
    layer: u32,
    point: u32,
    /// No solid lies between it and the light.
    clear: bool,
}

/// A strand's lines, and the optical depth from which on no light is left.
struct Run {
    from: u32,
    to: u32,
    dark: f32,
}

/// What came of a tile.
#[derive(Clone, Copy, Default)]
pub(crate) struct Done {
    /// 1 if the tile had points.
    pub tiles: usize,
    /// Points behind solids.
    pub hidden: usize,
    /// What hairs leave in its texels.
    pub deposits: usize,
    /// Memory of the tile.
    pub bytes: usize,
}

impl Done {
    /// Of two parts of the work.
    pub fn and(self, o: Done) -> Done {
        let bytes = self.bytes.max(o.bytes);
        let (tiles, hidden) = (self.tiles + o.tiles, self.hidden + o.hidden);
        Done { tiles, hidden, deposits: self.deposits + o.deposits, bytes }
    }
}

/// Spreads and samples at some width.
struct Spread<'w, 'a>(&'w mut Work<'a>, &'w [ShadowHair<'w>], &'w [Vec<AtomicU32>]);

impl Kernel for Spread<'_, '_> {
    type Out = usize;
    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        self.0.fill::<L>();
        match self.0.settings.interpolation {
            Interpolation::OpticalDepth => self.0.receive::<L, 1>(self.1, self.2),
            Interpolation::Transmittance => self.0.receive::<L, 2>(self.1, self.2),
            Interpolation::Cubic => self.0.receive::<L, 4>(self.1, self.2),
        }
    }
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
            width: Width::widest(),
            side: TILE + 2 * projection.border(),
            slices: Slices::new(settings.slices),
            deposits: Deposits::new(),
            planes: Planes::new(settings.interpolation),
            segment: Vec::new(),
            receiver: Vec::new(),
            line: Vec::new(),
            run: Vec::new(),
            order: Vec::new(),
            start: Vec::new(),
            taps: Taps::new(),
            window: Window::new(),
        }
    }

    /// Works tile `t` at `place`.
    pub fn run(
        &mut self,
        chunks: &[Chunk],
        layers: &[ShadowHair],
        place: [usize; 2],
        t: usize,
        cells: &[Vec<AtomicU32>],
    ) -> Done {
        let Some([from, to]) = self.gather(chunks, layers, place, t) else { return Done::default() };
        let middles = self.segment.iter().map(|Cast { segment: s, .. }| 0.5 * (s.a[2] + s.b[2]));
        self.slices.place(from, to, self.settings.placement, middles);
        self.deposits.clear(self.side, self.settings.slices);
        let hidden = run_at(self.width, Spread(self, layers, cells));
        Done { tiles: 1, hidden, deposits: self.deposits.count(), bytes: self.bytes() }
    }

    /// Memory in use.
    fn bytes(&self) -> usize {
        let lists = size_of::<Cast>() * self.segment.len()
            + (size_of::<Receiver>() + 4) * self.receiver.len()
            + size_of::<Line>() * self.line.len();
        lists + self.deposits.bytes() + self.planes.bytes()
    }

    /// Spreads all segments, keeps the lines of strands that have points here, and sorts the points by planes.
    #[inline(always)]
    fn fill<L: Lanes>(&mut self) {
        let Work { segment, receiver, line, run, slices, deposits, .. } = self;
        line.clear();
        run.clear();
        let side = self.side as f32;
        // Segments and receivers are in the same order of strands.
        let mut r = 0;
        let mut s = 0;
        while s < segment.len() {
            let strand = segment[s].strand;
            while r < receiver.len() && receiver[r].strand < strand {
                r = name(receiver, r, run, Run { from: 0, to: 0, dark: dark(&[]) });
            }
            let keep = r < receiver.len() && receiver[r].strand == strand;
            let from = line.len();
            while s < segment.len() && segment[s].strand == strand {
                Line::of(&segment[s].segment, side, slices, |l| line.push(l));
                s += 1;
            }
            for l in &line[from..] {
                deposits.add::<L>(l, slices);
            }
            if !keep {
                line.truncate(from);
            } else {
                let dark = dark(&line[from..]);
                r = name(receiver, r, run, Run { from: from as u32, to: line.len() as u32, dark });
            }
        }
        while r < receiver.len() {
            r = name(receiver, r, run, Run { from: 0, to: 0, dark: dark(&[]) });
        }
        let (order, start) = (&mut self.order, &mut self.start);
        start.clear();
        start.resize(slices.count() + 1, 0);
        for r in receiver.iter_mut() {
            let (plane, f) = slices.point(r.at[2]);
            (r.plane, r.at[2]) = (plane as u32, f);
            start[plane + 1] += 1;
        }
        for k in 0..slices.count() {
            start[k + 1] += start[k];
        }
        order.clear();
        order.resize(receiver.len(), 0);
        // From the end on, so that starts of lists are left.
        let mut next = start.clone();
        for (i, r) in receiver.iter().enumerate() {
            let at = &mut next[r.plane as usize];
            order[*at as usize] = i as u32;
            *at += 1;
        }
    }

    /// Asks for what the points after the `i`th need: their order jumps about in memory.
    #[inline(always)]
    fn ask(&self, i: usize) {
        let receiver = |ahead: usize| self.order.get(i + ahead).map(|r| &self.receiver[*r as usize]);
        fetch(receiver(3 * SOON));
        fetch(receiver(2 * SOON).map(|r| &self.run[r.strand as usize]));
        if let Some(r) = receiver(SOON) {
            let from = self.run[r.strand as usize].from as usize;
            (from..from + 3).for_each(|l| fetch(self.line.get(l)));
        }
    }

    /// Gives points their values, plane after plane; how many are behind solids.
    #[inline(always)]
    fn receive<L: Lanes, const PLANES: usize>(&mut self, layers: &[ShadowHair], cells: &[Vec<AtomicU32>]) -> usize {
        let mut hidden = 0;
        self.planes.begin(&self.deposits, self.side);
        for k in 0..self.slices.count() {
            let range = self.start[k] as usize..self.start[k + 1] as usize;
            if range.is_empty() {
                continue;
            }
            self.planes.go(&self.deposits, k);
            for i in range {
                self.ask(i);
                let r = &self.receiver[self.order[i] as usize];
                self.window.put::<L>(r.at[0], r.at[1], self.projection.filter);
                let run = &self.run[r.strand as usize];
                let own = Own { lines: &self.line[run.from as usize..run.to as usize], dark: run.dark };
                let (map, f) = (self.planes.maps(), r.at[2]);
                let around = Around { map, side: self.side, plane: k, f, slices: &self.slices };
                let mut light = around.light::<L, PLANES>(&self.window, &own, &mut self.taps);
                if !r.clear && light > 0.0 {
                    let p = layers[r.layer as usize].point(r.point as usize);
                    if solid::is_hidden(self.solids, p, self.projection) {
                        light = 0.0;
                        hidden += 1;
                    }
                }
                cells[r.layer as usize][r.point as usize].store(light.to_bits(), Ordering::Relaxed);
            }
        }
        hidden
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
        let side = self.side as f32;
        let point = |chunk: usize, i: usize| chunks.get(chunk).and_then(|c| c.point.get(*c.tile(t).get(i)? as usize));
        for (c, chunk) in chunks.iter().enumerate() {
            (0..AHEAD).for_each(|i| fetch(point(c + 1, i)));
            let list = chunk.tile(t);
            for (i, &k) in list.iter().enumerate() {
                fetch(list.get(i + AHEAD).map(|k| &chunk.point[*k as usize]));
                let k = k as usize;
                let strand = chunk.point[k].strand();
                if chunk.point[k].receives() {
                    let p = chunk.point[k].at;
                    let p = [p[0].clamp(0.0, top), p[1].clamp(0.0, top), p[2]];
                    let inside = |i: usize| (p[i] * (1.0 / TILE as f32)) as usize == place[i];
                    if inside(0) && inside(1) {
                        from = from.min(p[2]);
                        to = to.max(p[2]);
                        let point = (chunk.first + k) as u32;
                        let (layer, clear) = (chunk.layer as u32, self.cover.is_clear(p));
                        self.receiver.push(Receiver { at: shift(p), plane: 0, strand, layer, point, clear });
                    }
                }
                if let Some(s) = chunk.segment(k, &layers[chunk.layer], self.projection) {
                    let s = Segment { a: shift(s.a), b: shift(s.b), ..s };
                    self.segment.extend(s.over(side).map(|segment| Cast { segment, strand }));
                }
            }
        }
        (from <= to).then_some([from, to])
    }
}

/// Gives the receivers from `first` on that are of its strand their run; the first of the next strand.
fn name(receiver: &mut [Receiver], first: usize, run: &mut Vec<Run>, lines: Run) -> usize {
    let strand = receiver[first].strand;
    let mut r = first;
    while r < receiver.len() && receiver[r].strand == strand {
        receiver[r].strand = run.len() as u32;
        r += 1;
    }
    run.push(lines);
    r
}
