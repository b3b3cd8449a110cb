//! Strands to shaded points in the picture: smoothed, cut to pieces that are short on the screen, clipped.

use crate::preview::{HairView, Lighting, Region, in_layer};
use crate::raster::{Point, REACH, TILE};
use crate::shade::HairPoint;
use crate::slab::HUGE;
use crate::{V3, View};
use std::ops::Range;

/// Longest piece, pixels at its depth. Pieces are what is sorted by depth and what colours run over: longer ones cross
/// in the wrong order and miss highlights, shorter ones cost time.
const PIECE: f32 = 16.0;

/// Largest distance between a curve and its pieces, pixels. Twice as much shows corners in curls.
const SAG: f32 = 0.12;

/// Largest turn within a piece, radians: so that highlights run smoothly over small curls.
const TURN: f32 = 0.6;

/// Most pieces between two points of a strand: bounds the work for hair that passes close to the eye.
const MOST: usize = 64;

/// Points nearer to each other than this on the screen, pixels, are taken as one.
const MERGE: f32 = 0.8;

/// Part of the picture's size that lines may reach beyond its border before they are cut there.
const GUARD: f32 = 0.5;

/// Picture size in tiles, and which of them are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tiling {
    pub width: usize,
    pub height: usize,
    pub across: usize,
    /// First and one past the last tile that is drawn, across and down.
    pub drawn: [[usize; 2]; 2],
}

impl Tiling {
    /// The tiles that `region` touches; it lies in the picture and is not empty.
    pub fn new(width: usize, height: usize, region: &Region) -> Tiling {
        let tiles = |r: &Range<usize>| [r.start / TILE, r.end.div_ceil(TILE)];
        let drawn = [tiles(&region.x), tiles(&region.y)];
        Tiling { width, height, across: width.div_ceil(TILE), drawn }
    }

    /// Number of tiles of the picture, drawn or not.
    pub fn count(&self) -> usize {
        self.across * self.height.div_ceil(TILE)
    }

    /// True if a tile is drawn.
    pub fn is_drawn(&self, tile: usize) -> bool {
        let at = [tile % self.across, tile / self.across];
        (0..2).all(|i| (self.drawn[i][0]..self.drawn[i][1]).contains(&at[i]))
    }

    /// First and one past the last pixel of the tiles that are drawn, along an axis.
    fn pixels(&self, axis: usize) -> [usize; 2] {
        let [first, end] = self.drawn[axis];
        [first * TILE, (end * TILE).min([self.width, self.height][axis])]
    }

    /// Calls `each` with the number of every drawn tile that a box of pixel coordinates touches.
    pub fn touched(&self, low: [f32; 2], high: [f32; 2], mut each: impl FnMut(u32)) {
        let range = |i: usize| {
            let [first, end] = self.drawn[i];
            if !(high[i] >= 0.0 && low[i] <= [self.width, self.height][i] as f32) {
                return 0..0;
            }
            let to = ((high[i] as usize / TILE).saturating_add(1)).min(end);
            (low[i].max(0.0) as usize / TILE).max(first)..to
        };
        for j in range(1) {
            for i in range(0) {
                each((j * self.across + i) as u32);
            }
        }
    }
}

/// Points and pieces of some strands.
#[derive(Clone, Debug, Default)]
pub(crate) struct Chunk {
    /// Piece p runs from point p to point p + 1.
    pub points: Vec<Point>,
    /// (tile, piece) for every tile that a piece touches.
    pub bins: Vec<(u32, u32)>,
    /// Pieces.
    pub pieces: usize,
    /// Points of strands that are not finite.
    pub bad_points: usize,
}

/// A point of a strand in camera space.
#[derive(Clone, Copy)]
struct Knot {
    p: V3,
    /// Direction of the curve: derivative by length.
    m: V3,
    width: f32,
    color: V3,
    /// Pixels per scene unit.
    scale: f32,
    /// Which point of the layer it is.
    index: usize,
}

/// Camera, picture and lights that strands are drawn with.
pub(crate) struct Draw<'a> {
    pub view: &'a View,
    pub lighting: &'a Lighting,
    pub tiling: Tiling,
    /// Factor of widths at depth 0, and its change by depth.
    pub cue: [f32; 2],
}

/// Buffers that are used again for each strand.
#[derive(Default)]
pub(crate) struct Scratch {
    knot: Vec<Knot>,
    depth: Vec<f32>,
}

impl Draw<'_> {
    /// Adds strand `s` of a layer, number `strand` over all layers.
    pub fn strand(&self, layer: &HairView, s: usize, strand: u32, scratch: &mut Scratch, out: &mut Chunk) {
        let range = layer.offsets.range(s);
        let last = range.end.min(layer.position.len());
        let mut i = range.start;
        // Runs of finite points; a point that is not finite cuts the hair.
        while i < last {
            scratch.knot.clear();
            while i < last {
                let p = self.view.to_camera(in_layer(layer, &layer.position[i]));
                if !p.iter().all(|v| v.abs() < HUGE) {
                    break;
                }
                let scale = self.view.scale(p.z.max(self.view.near)) as f32;
                let color = layer.color(s, i);
                let width = layer.width(i) * (self.cue[0] + self.cue[1] * p.z as f32).clamp(0.0, 1.0);
                let knot = Knot { p: p.cast(), m: V3::zeros(), width, color, scale, index: i };
                let end = i + 1 == last;
                let close = scratch.knot.last().is_some_and(|k| (knot.p - k.p).norm() * scale < MERGE);
                if !close || end {
                    if close && scratch.knot.len() > 1 {
                        scratch.knot.pop();
                    }
                    scratch.knot.push(knot);
                }
                i += 1;
            }
            if i < last {
                out.bad_points += 1;
                i += 1;
            }
            self.run(layer, s, strand, scratch, out);
        }
    }

    /// Adds one run of knots.
    fn run(&self, layer: &HairView, s: usize, strand: u32, scratch: &mut Scratch, out: &mut Chunk) {
        let knot = &mut scratch.knot;
        if knot.len() < 2 || !self.visible(knot) {
            return;
        }
        tangents(knot);
        let lights = self.lighting.columns();
        scratch.depth.clear();
        for k in knot.iter() {
            self.lighting.depths_of(k.p, layer.transmittance, k.index, &mut scratch.depth);
        }
        let opacity = layer.opacity(s);
        if opacity <= 0.0 {
            return;
        }
        let normal = layer.root_normal(s).map(|n| self.view.turn(n).cast());
        let shine = layer.shine(s);
        let side = |k: &Knot| match layer.side {
            [] => V3::zeros(),
            _ => self.view.turn(layer.side(k.index).cast()).cast(),
        };
        let mut depth = vec![0.0; lights];
        let mut previous: Option<(Point, bool)> = None;
        for (k, w) in knot.windows(2).enumerate() {
            let (a, b) = (&w[0], &w[1]);
            let h = (b.p - a.p).norm();
            let n = pieces(a, b, h);
            let sides = [side(a), side(b)];
            for j in usize::from(k > 0)..=n {
                let u = j as f32 / n as f32;
                let (p, t) = hermite(a, b, h, u);
                for (l, d) in depth.iter_mut().enumerate() {
                    let (d0, d1) = (scratch.depth[k * lights + l], scratch.depth[(k + 1) * lights + l]);
                    *d = d0 + (d1 - d0) * u;
                }
                let color = a.color + (b.color - a.color) * u;
                let side = sides[0] + (sides[1] - sides[0]) * u;
                let at = HairPoint { position: p, tangent: t, color, normal, shine, side };
                let rgb = self.lighting.hair(&at, &depth);
                let point =
                    Point { width: a.width + (b.width - a.width) * u, rgb: rgb.into(), strand, ..Point::default() };
                let point = Point { x: p.x, y: p.y, z: p.z, ..point };
                previous = self.piece(previous, point, out);
            }
        }
    }

    /// Projects `next` and adds the piece from the previous point to it. Points stay in camera space until here, as
    /// clipping at the near plane needs. Returns `next`, and whether its projection is the last point of `out`.
    fn piece(&self, previous: Option<(Point, bool)>, next: Point, out: &mut Chunk) -> Option<(Point, bool)> {
        let Some((before, stored)) = previous else { return Some((next, false)) };
        let near = self.view.near as f32 * 1.000_001;
        let (in_a, in_b) = (before.z >= near, next.z >= near);
        if !in_a && !in_b {
            return Some((next, false));
        }
        let cut = |from: &Point, to: &Point| mix(from, to, (near - from.z) / (to.z - from.z));
        let a = if in_a { before } else { Point { z: near, ..cut(&before, &next) } };
        let b = if in_b { next } else { Point { z: near, ..cut(&next, &before) } };
        let (mut a, mut b) = (self.project(&a), self.project(&b));
        let guard = [GUARD * self.tiling.width as f32, GUARD * self.tiling.height as f32];
        let size = [self.tiling.width as f32, self.tiling.height as f32];
        let inside =
            |p: &Point| p.x >= -guard[0] && p.y >= -guard[1] && p.x <= size[0] + guard[0] && p.y <= size[1] + guard[1];
        let whole = in_a && in_b && inside(&a) && inside(&b);
        if !whole {
            match clip(&a, &b, guard, size) {
                Some(c) => (a, b) = c,
                None => return Some((next, false)),
            }
        }
        let r = REACH + 0.5 * a.width.max(b.width);
        let (low, high) = ([a.x.min(b.x) - r, a.y.min(b.y) - r], [a.x.max(b.x) + r, a.y.max(b.y) + r]);
        if !(high[0] >= 0.0 && high[1] >= 0.0 && low[0] <= size[0] && low[1] <= size[1]) {
            return Some((next, false));
        }
        if !(stored && whole) {
            out.points.push(a);
        }
        let index = out.points.len() as u32 - 1;
        out.points.push(b);
        out.pieces += 1;
        self.tiling.touched(low, high, |tile| out.bins.push((tile, index)));
        Some((next, whole))
    }

    /// Camera space to pixels.
    fn project(&self, p: &Point) -> Point {
        let s = self.view.scale(f64::from(p.z));
        let at = |v: f32, i: usize| (self.view.centre[i] + f64::from(v) * s) as f32;
        // Wider than this covers any picture; bounds the arithmetic.
        let width = (f64::from(p.width) * s).min(1e5) as f32;
        Point { x: at(p.x, 0), y: at(p.y, 1), width, ..*p }
    }

    /// False if a whole run is in front of the near plane or beyond one border of the tiles that are drawn, curves
    /// included.
    fn visible(&self, knot: &[Knot]) -> bool {
        // From the view axis to the right and the left, the lower and the upper border, pixels.
        let side = |i: usize| {
            let ([low, high], centre) = (self.tiling.pixels(i), self.view.centre[i]);
            [(high as f64 - centre) as f32, (centre - low as f64) as f32]
        };
        let side = [side(0), side(1)];
        let focal = self.view.focal as f32;
        // Smoothed curves stay within a third of the longest span of their knots.
        let reach = knot.windows(2).fold(0.0f32, |m, w| m.max((w[1].p - w[0].p).norm())) * 0.34;
        let mut beyond = [true; 5];
        for k in knot {
            let r = reach + k.width;
            beyond[4] &= k.p.z + r < self.view.near as f32;
            for (e, beyond) in beyond[..4].iter_mut().enumerate() {
                let (i, sign) = (e / 2, if e % 2 == 0 { 1.0 } else { -1.0 });
                let slope = (side[i][e % 2] + REACH) / focal;
                // Distance from the border, times its slope: scene units.
                let (border, rim) =
                    if self.view.parallel { (slope, r) } else { (slope * k.p.z, r * (1.0 + slope.abs())) };
                *beyond &= sign * k.p[i] > border + rim;
            }
        }
        beyond == [false; 5]
    }
}

/// Number of pieces between two knots, `h` apart.
fn pieces(a: &Knot, b: &Knot, h: f32) -> usize {
    let pixels = h * a.scale.max(b.scale);
    let turn = (b.m - a.m).norm();
    // A piece of length s that turns by t strays s t / 8 from its arc.
    let by_sag = (pixels * turn * (0.125 / SAG)).sqrt();
    let n = (pixels / PIECE).max(by_sag).max((turn / TURN).min(0.5 * pixels));
    if n < MOST as f32 { (n.ceil() as usize).max(1) } else { MOST }
}

/// Catmull-Rom tangents for uneven spacing (the parabola through three knots), natural at both ends, limited to
/// length 1.5 so that a sharp corner makes no loop.
fn tangents(knot: &mut [Knot]) {
    let n = knot.len();
    let slope = |a: &Knot, b: &Knot| {
        let d = b.p - a.p;
        let h = d.norm();
        (if h > 0.0 { d / h } else { d }, h)
    };
    for i in 1..n.saturating_sub(1) {
        let ((d0, h0), (d1, h1)) = (slope(&knot[i - 1], &knot[i]), slope(&knot[i], &knot[i + 1]));
        let h = h0 + h1;
        knot[i].m = if h > 0.0 { (d0 * h1 + d1 * h0) / h } else { d0 };
    }
    let end = |d: V3, m: V3| {
        let e = d * 1.5 - m * 0.5;
        e * (1.5 / e.norm().max(1.5))
    };
    let (first, last) = (slope(&knot[0], &knot[1]).0, slope(&knot[n - 2], &knot[n - 1]).0);
    if n == 2 {
        (knot[0].m, knot[1].m) = (first, first);
    } else {
        knot[0].m = end(first, knot[1].m);
        knot[n - 1].m = end(last, knot[n - 2].m);
    }
}

/// Position and unit tangent at `u` in [0, 1] of the cubic between two knots, `h` apart.
fn hermite(a: &Knot, b: &Knot, h: f32, u: f32) -> (V3, V3) {
    let d = b.p - a.p;
    let v = 1.0 - u;
    let p = a.p + d * (u * u * (3.0 - 2.0 * u)) + (a.m * (u * v * v) - b.m * (u * u * v)) * h;
    let t = d * (6.0 * u * v) + (a.m * (v * (1.0 - 3.0 * u)) + b.m * (u * (3.0 * u - 2.0))) * h;
    let n = t.norm();
    (
        p,
        if n > 1e-6 * h && n > 0.0 {
            t / n
        } else if h > 0.0 {
            d / h
        } else {
            V3::z()
        },
    )
}

/// Everything but the strand's number, `f` of the way.
fn mix(a: &Point, b: &Point, f: f32) -> Point {
    let l = |a: f32, b: f32| a + (b - a) * f;
    Point {
        x: l(a.x, b.x),
        y: l(a.y, b.y),
        z: l(a.z, b.z),
        width: l(a.width, b.width),
        rgb: std::array::from_fn(|c| l(a.rgb[c], b.rgb[c])),
        strand: a.strand,
    }
}

/// Cuts a line at the border of the picture grown by `guard` and its width (Liang and Barsky).
fn clip(a: &Point, b: &Point, guard: [f32; 2], size: [f32; 2]) -> Option<(Point, Point)> {
    let (mut from, mut to) = (0.0f32, 1.0f32);
    let wide = a.width.max(b.width);
    for i in 0..2 {
        let (p, q) = if i == 0 { (a.x, b.x) } else { (a.y, b.y) };
        let (low, high) = (-guard[i] - wide, size[i] + guard[i] + wide);
        let d = q - p;
        if d == 0.0 {
            if p < low || p > high {
                return None;
            }
            continue;
        }
        let (f, g) = ((low - p) / d, (high - p) / d);
        from = from.max(f.min(g));
        to = to.min(f.max(g));
    }
    (from < to).then(|| (mix(a, b, from), mix(a, b, to)))
}
