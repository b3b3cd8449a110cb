//! Drawing the pieces of hairs into a tile: filtered lines, near to far, sixteen pixels at a time.

use super::{OPAQUE, Point, Tile, ones};
use crate::View;
use pelage_geom::registers::{Bits, COUNT, Kernel, LANES, Lanes, fetch};

/// Standard deviation of the pixel filter. A Gaussian of 0.52 pixels leaves ripples of 1 % at most in the coverage of a
/// thin line; 0.45 leaves 4 %, which shows as beads and moire, 0.7 is visibly soft.
const SIGMA: f64 = 0.52;

/// Where the filter ends, pixels.
pub(crate) const REACH: f32 = 1.5;

/// How far behind the skin's depth sample a hair may be and still show, pixels at its depth. Roots lie in the skin and
/// the sample of a sloping skin is up to a pixel beside the hair: under 1, roots flicker; over 4, hair shines through
/// ears and lips.
const BIAS: f32 = 1.5;

/// Cosine of the turn up to which two pieces of a hair share a border. Without borders hair wider than a pixel has a light tick at
/// each joint, as what is drawn in between hides that both are of one hair; borders of sharper turns would lie far along the
/// pieces.
const SHARP: f32 = 0.5;

/// Pieces ahead for which memory is asked for: sorted by depth they jump about in it.
const AHEAD: usize = 8;

/// Terms of the filter's integral: what is left out is under 1e-6.
const TERMS: usize = 9;

/// Integral of the pixel filter: a Gaussian cut at [`REACH`] and scaled to an area of exactly 1, isotropic, so that the
/// coverage of a line does not depend on its angle or its place between pixels. It is x times a polynomial of
/// 2 (x / [`REACH`])^2 - 1, by rising power.
#[derive(Clone, Debug)]
pub(crate) struct Filter([f32; TERMS]);

impl Filter {
    pub fn new() -> Filter {
        let reach = f64::from(REACH);
        let erf = |x: f64| libm::erf(x / SIGMA * std::f64::consts::FRAC_1_SQRT_2);
        // Chebyshev's interpolation: values at the nodes, coefficients, then powers.
        let n = TERMS as f64;
        let node = |k: usize| libm::cos(std::f64::consts::PI * (k as f64 + 0.5) / n);
        let value: [f64; TERMS] = std::array::from_fn(|k| {
            let x = reach * (0.5 + 0.5 * node(k)).sqrt();
            0.5 * erf(x) / erf(reach) / x
        });
        let (mut power, mut last, mut this) = ([0.0; TERMS], [0.0; TERMS], [0.0; TERMS]);
        this[0] = 1.0;
        for j in 0..TERMS {
            let factor = |k: usize| libm::cos(std::f64::consts::PI * j as f64 * (k as f64 + 0.5) / n);
            let c = (0..TERMS).map(|k| value[k] * factor(k)).sum::<f64>() * if j == 0 { 1.0 } else { 2.0 } / n;
            for (power, t) in power.iter_mut().zip(this) {
                *power += c * t;
            }
            // T(j + 1) = 2 t T(j) - T(j - 1), but T(1) = t.
            let twice = if j == 0 { 1.0 } else { 2.0 };
            let next = std::array::from_fn(|i| if i > 0 { twice * this[i - 1] } else { 0.0 } - last[i]);
            (last, this) = (this, next);
        }
        Filter(power.map(|c| c as f32))
    }

    /// Integral from 0 to `x` pixels.
    #[inline(always)]
    fn upto<L: Lanes>(&self, x: L) -> L {
        let x = x.max(L::splat(-REACH)).min(L::splat(REACH));
        let t = x * x * L::splat(2.0 / (REACH * REACH)) - L::splat(1.0);
        let mut sum = L::splat(self.0[TERMS - 1]);
        for c in self.0[..TERMS - 1].iter().rev() {
            sum = sum * t + L::splat(*c);
        }
        x * sum
    }
}

/// A piece of a hair: bits of its depth, a list of points, and the first of its two points there.
pub(crate) type Piece = [u32; 3];

/// Pieces of hairs for a tile, near to far.
pub(crate) struct Strokes<'a> {
    pub tile: &'a mut Tile,
    pub order: &'a [Piece],
    pub points: &'a [Vec<Point>],
    /// Opacity of a strand's whole width.
    pub opacity: &'a [f32],
    pub view: &'a View,
    pub filter: &'a Filter,
}

impl Kernel for Strokes<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Strokes { tile, order, points, opacity, view, filter } = self;
        for (k, [_, list, first]) in order.iter().enumerate() {
            if tile.full() {
                break;
            }
            if let Some([_, list, first]) = order.get(k + AHEAD) {
                let list = &points[*list as usize];
                fetch(list.get(*first as usize));
                fetch(list.get(*first as usize + 1));
            }
            let (list, i) = (&points[*list as usize], *first as usize);
            let (a, b) = (&list[i], &list[i + 1]);
            let bias = BIAS / view.scale(f64::from(a.z.min(b.z))) as f32;
            let before = i.checked_sub(1).map(|i| &list[i]);
            let joints = [joint(before, a, Some(b)), joint(Some(a), b, list.get(i + 2))];
            tile.line::<L>(&Stroke::new(tile, a, b, joints, opacity[a.strand as usize], bias), filter);
        }
    }
}

/// Direction of a hair where two of its pieces meet, of any length; zero at its ends and where it turns by more than
/// [`SHARP`]. Neighbours in the list are of one run of the hair unless it was cut: by a border of the picture or a bad point.
#[inline(always)]
fn joint(a: Option<&Point>, b: &Point, c: Option<&Point>) -> [f32; 2] {
    let (Some(a), Some(c)) = (a, c) else { return [0.0; 2] };
    if a.strand != b.strand || c.strand != b.strand {
        return [0.0; 2];
    }
    let unit = |x: f32, y: f32| {
        let r = (x * x + y * y).sqrt();
        if r > 1e-3 { [x / r, y / r] } else { [0.0; 2] }
    };
    let (u, v) = (unit(b.x - a.x, b.y - a.y), unit(c.x - b.x, c.y - b.y));
    let sharp = u[0] * v[0] + u[1] * v[1] < SHARP;
    if sharp { [0.0; 2] } else { [u[0] + v[0], u[1] + v[1]] }
}

/// A piece of a hair from `a` to `b` in a tile.
struct Stroke<'a> {
    a: &'a Point,
    b: &'a Point,
    opacity: f32,
    /// Depth by which the hair may be behind the skin.
    bias: f32,
    /// `a` in pixels of the tile.
    x: f32,
    y: f32,
    /// Its direction, and length.
    u: [f32; 2],
    length: f32,
    /// As from [`joint`], at both ends.
    joints: [[f32; 2]; 2],
}

impl<'a> Stroke<'a> {
    #[inline(always)]
    fn new(tile: &Tile, a: &'a Point, b: &'a Point, joints: [[f32; 2]; 2], opacity: f32, bias: f32) -> Stroke<'a> {
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let length = (dx * dx + dy * dy).sqrt();
        let u = if length > 1e-6 { [dx / length, dy / length] } else { [1.0, 0.0] };
        let (x, y) = (a.x - tile.x0 as f32, a.y - tile.y0 as f32);
        Stroke { a, b, opacity, bias, x, y, u, length, joints }
    }
}

/// Pixels that are drawn together: their centres in the tile, and their numbers.
struct Batch {
    x: [f32; LANES],
    y: [f32; LANES],
    pixel: [u16; LANES],
    count: usize,
}

impl Tile {
    /// Blends a piece of a hair behind what is there already. The coverage of a pixel is the filtered area of a rectangle
    /// of the true width: a hair of a tenth of a pixel covers a tenth.
    #[inline(always)]
    fn line<L: Lanes>(&mut self, s: &Stroke, filter: &Filter) {
        let ([ux, uy], length) = (s.u, s.length);
        let half = 0.5 * s.a.width.max(s.b.width);
        // The border of a joint runs along the piece by up to tan 30 degrees of its width.
        let (side, reach) = (REACH + half, REACH + 0.6 * half);
        let tall = uy.abs() * reach + ux.abs() * side;
        let (low, high) = (s.y + (uy * length).min(0.0), s.y + (uy * length).max(0.0));
        let Some((top, bottom)) = centres(low - tall, high + tall, self.height) else { return };
        let mut batch = Batch { x: [0.0; LANES], y: [0.0; LANES], pixel: [0; LANES], count: 0 };
        let (mut first, mut end) = ([0; LANES], [0; LANES]);
        for j in top..=bottom {
            let row = (j - top) % LANES;
            if row == 0 {
                self.rows::<L>(s, [side, reach], j as f32 + 0.5 - s.y, &mut first, &mut end);
            }
            let mut todo = self.open[j] & ones(end[row] as usize) & !ones(first[row] as usize);
            while todo != 0 {
                let i = todo.trailing_zeros() as usize;
                todo &= todo - 1;
                (batch.x[batch.count], batch.y[batch.count]) = (i as f32 + 0.5, j as f32 + 0.5);
                batch.pixel[batch.count] = (j * self.width + i) as u16;
                batch.count += 1;
                if batch.count == LANES {
                    self.draw::<L>(s, &mut batch, filter);
                }
            }
        }
        if batch.count > 0 {
            self.draw::<L>(s, &mut batch, filter);
        }
    }

    /// First pixel and one past the last in sixteen rows, of which the first is `low` pixels below the piece's beginning:
    /// |ux y - uy x| <= side, -reach <= ux x + uy y <= length + reach.
    #[inline(always)]
    fn rows<L: Lanes>(
        &self,
        s: &Stroke,
        [side, reach]: [f32; 2],
        low: f32,
        first: &mut [u32; LANES],
        end: &mut [u32; LANES],
    ) {
        let ([ux, uy], length) = (s.u, s.length);
        let y = L::read(&COUNT) + L::splat(low);
        let (mut from, mut to) = (L::splat(-s.x), L::splat(self.width as f32 - s.x));
        if uy.abs() > 1e-6 {
            let (m, r) = (y * L::splat(ux / uy), L::splat(side / uy.abs()));
            (from, to) = (from.max(m - r), to.min(m + r));
        }
        if ux.abs() > 1e-6 {
            let (m, r) =
                ((L::splat(0.5 * length) - L::splat(uy) * y) * L::splat(1.0 / ux), (0.5 * length + reach) / ux.abs());
            (from, to) = (from.max(m - L::splat(r)), to.min(m + L::splat(r)));
        }
        // Centres of pixels lie at halves. What a border touches by less than a hundredth is not seen.
        (from + L::splat(s.x + 0.49)).max(L::splat(0.0)).whole().store(first);
        (to + L::splat(s.x + 0.5)).max(L::splat(0.0)).min(L::splat(self.width as f32)).whole().store(end);
    }

    /// Blends the pixels of a batch, and empties it.
    #[inline(always)]
    fn draw<L: Lanes>(&mut self, s: &Stroke, batch: &mut Batch, filter: &Filter) {
        let (px, py) = (L::read(&batch.x), L::read(&batch.y));
        let (x, y) = (px - L::splat(s.x), py - L::splat(s.y));
        let [ux, uy] = s.u.map(L::splat);
        let (across, along) = (ux * y - uy * x, ux * x + uy * y);
        let per = if s.length > 1e-6 { 1.0 / s.length } else { 0.0 };
        let f = (along * L::splat(per)).max(L::splat(0.0)).min(L::splat(1.0));
        let half = L::splat(0.5 * s.a.width) + L::splat(0.5 * (s.b.width - s.a.width)) * f;
        let wide = filter.upto(across + half) - filter.upto(across - half);
        // At a joint each pixel is of one of both pieces, with the same numbers on either side; ends are soft.
        let (zero, half_light) = (L::splat(0.0), L::splat(0.5));
        let end = [s.b.x - self.x0 as f32, s.b.y - self.y0 as f32];
        let mut long = [filter.upto(along), filter.upto(along - L::splat(s.length))];
        for ((long, at), joint) in long.iter_mut().zip([[s.x, s.y], end]).zip(s.joints) {
            if joint != [0.0; 2] {
                let past = (px - L::splat(at[0])) * L::splat(joint[0]) + (py - L::splat(at[1])) * L::splat(joint[1]);
                *long = L::if_gt(zero, past, zero - half_light, half_light);
            }
        }
        let (mut alpha, mut z, mut rgb) = ([0.0; LANES], [0.0; LANES], [[0.0; LANES]; 3]);
        (wide * (long[0] - long[1]).max(zero) * L::splat(s.opacity)).write(&mut alpha);
        (L::splat(s.a.z - s.bias) + L::splat(s.b.z - s.a.z) * f).write(&mut z);
        for (c, rgb) in rgb.iter_mut().enumerate() {
            (L::splat(s.a.rgb[c]) + L::splat(s.b.rgb[c] - s.a.rgb[c]) * f).write(rgb);
        }
        for i in 0..batch.count {
            let k = usize::from(batch.pixel[i]);
            let color = [rgb[0][i], rgb[1][i], rgb[2][i]];
            if self.blend(k, color, alpha[i], z[i], s.a.strand) < OPAQUE {
                self.open[k / self.width] &= !(1 << (k % self.width));
                self.left -= 1;
            }
        }
        self.blended += batch.count;
        batch.count = 0;
    }
}

/// First and last of `size` pixels whose centres lie in [low, high].
#[inline]
fn centres(low: f32, high: f32, size: usize) -> Option<(usize, usize)> {
    let (low, high) = ((low - 0.5).max(0.0), high - 0.5);
    if !(high >= low && low < size as f32) {
        return None;
    }
    let first = low as usize;
    let first = if (first as f32) < low { first + 1 } else { first };
    let last = (high as usize).min(size - 1);
    (first <= last).then_some((first, last))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::registers::Plain;

    #[test]
    fn the_filter_is_the_integral_of_a_gaussian() {
        let filter = Filter::new();
        let at = |x: f32| {
            let mut y = [0.0; LANES];
            filter.upto(Plain::splat(x)).write(&mut y);
            y[0]
        };
        let full = libm::erf(f64::from(REACH) / SIGMA * std::f64::consts::FRAC_1_SQRT_2);
        for i in -2000..=2000 {
            let x = i as f32 * 1e-3;
            let truth =
                0.5 * libm::erf(f64::from(x.clamp(-REACH, REACH)) / SIGMA * std::f64::consts::FRAC_1_SQRT_2) / full;
            assert!((f64::from(at(x)) - truth).abs() < 1.5e-6, "{x}: {} instead of {truth}", at(x));
        }
    }

    #[test]
    fn pieces_of_a_wide_hair_meet_without_a_gap() {
        let filter = Filter::new();
        let view = crate::Camera::frame(([-1.0; 3], [1.0; 3]), [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 1.0).view(64, 64);
        for turn in 0..200 {
            let (a, bend) = (0.031 * f64::from(turn), 0.004 * f64::from(turn % 50));
            let mut at = [32.0 - 20.0 * libm::cos(a), 32.0 - 20.0 * libm::sin(a)];
            let mut points = Vec::new();
            for k in 0..6 {
                let (x, y) = (at[0] as f32, at[1] as f32);
                points.push(Point { x, y, z: 1.0, width: 7.0, rgb: [1.0; 3], strand: 0 });
                let way = a + bend * f64::from(k);
                at = [at[0] + 8.0 * libm::cos(way), at[1] + 8.0 * libm::sin(way)];
            }
            // Another hair in between, which takes nothing, makes pixels forget that a piece of the same was there.
            let other = |k: usize| Point { strand: 1, ..points[k] };
            let list = [points.clone(), vec![other(0), other(2), other(4), other(5)]];
            let mut tile = Tile::new(0, 0, 64, 64);
            for piece in 0..5 {
                let strokes = [[0, 0, piece], [0, 1, 0], [0, 1, 1], [0, 1, 2]];
                let (order, points, opacity) = (&strokes[..], &list[..], &[1.0, 0.0][..]);
                Strokes { tile: &mut tile, order, points, opacity, view: &view, filter: &filter }.run::<Plain>();
            }
            for i in 20..=300 {
                let f = i as f32 / 320.0 * 5.0;
                let (k, f) = (f as usize, f.fract());
                let (x, y) = (
                    points[k].x + (points[k + 1].x - points[k].x) * f,
                    points[k].y + (points[k + 1].y - points[k].y) * f,
                );
                let d = [points[k + 1].x - points[k].x, points[k + 1].y - points[k].y].map(|v| v / 8.0);
                for side in [-1.5f32, 0.0, 1.5] {
                    let pixel = (y + side * d[0]) as usize * 64 + (x - side * d[1]) as usize;
                    assert!(tile.pixel[pixel].through < 0.02, "{turn} {i} {side}: {:?}", tile.pixel[pixel]);
                }
            }
        }
    }
}
