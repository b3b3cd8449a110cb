//! Where the slices of a tile lie.

use super::numbers::{least, most};
use super::settings::Placement;

/// Rows that the depths of a tile's points are divided into; a slice is a run of them. One is about a hair's width on a head
/// of hair. With fewer, planes that lie close together where much hair does fall into one.
pub(crate) const ROWS: usize = 4096;

/// Length of a table by row: a power of two, so that no number has to be checked.
const TABLE: usize = (ROWS + 2).next_power_of_two();

/// Bins of the depth histogram.
const BINS: usize = 256;

/// Part of the slices that is spread evenly whatever the histogram says: without it a few hairs far from the rest share
/// one slice.
const EVEN: f32 = 0.25;

/// The number of a plane before the last one; what stands for one that is not there is the one next to it.
#[inline(always)]
pub(crate) fn nearest(plane: isize, last: usize) -> usize {
    plane.clamp(0, last as isize) as usize
}

/// Slices between planes of equal depth. Level 0 is what lies before plane 0, level k what lies between planes k - 1 and k,
/// and the last level what lies behind the last plane, where no point is.
pub(crate) struct Slices {
    count: usize,
    from: f32,
    /// Rows per depth.
    scale: f32,
    /// Level of each row; the first lies before all points and the last behind them. What follows is not used.
    level: Box<[u16; TABLE]>,
    /// First row of what lies behind each plane.
    plane: Vec<u16>,
    histogram: [u32; BINS],
}

impl Slices {
    pub fn new(count: usize) -> Slices {
        let (level, plane) = (Box::new([0; TABLE]), vec![0; count + 1]);
        Slices { count, from: 0.0, scale: 1.0, level, plane, histogram: [0; BINS] }
    }

    /// Places them between the depths `from` and `to` of the first and last point, among segments with their middles at
    /// `depth`.
    pub fn place(&mut self, from: f32, to: f32, placement: Placement, depth: impl Iterator<Item = f32>) {
        // Points of one depth still lie behind what is nearer the light.
        self.from = from;
        self.scale = ROWS as f32 / (to - from).max(1e-6 * from.abs().max(to.abs())).max(1e-30);
        self.histogram.fill(0);
        let bin = self.scale * (BINS as f32 / ROWS as f32);
        if placement == Placement::Histogram {
            for z in depth {
                let b = (z - from) * bin;
                if b >= 0.0 && b < BINS as f32 {
                    self.histogram[b as usize] += 1;
                }
            }
        }
        let all = self.histogram.iter().sum::<u32>();
        let even = if all == 0 { 1.0 } else { EVEN };
        let (part, least) = ((1.0 - even) / all.max(1) as f32, even / BINS as f32);
        let top: f32 = self.histogram.iter().map(|c| least + part * *c as f32).sum();
        let scale = self.count as f32 / top;
        let (mut before, mut next) = (0.0, 0);
        const EACH: usize = ROWS / BINS;
        for (b, c) in self.histogram.iter().enumerate() {
            let width = scale * (least + part * *c as f32);
            for k in 0..EACH {
                let row = b * EACH + k;
                // By the row's middle.
                let slice = ((before + width * ((k as f32 + 0.5) / EACH as f32)) as usize).min(self.count - 1);
                self.level[row + 1] = slice as u16 + 1;
                while next <= slice {
                    self.plane[next] = row as u16;
                    next += 1;
                }
            }
            before += width;
        }
        self.plane[next..].fill(ROWS as u16);
        self.level[0] = 0;
        self.level[ROWS + 1] = self.count as u16 + 1;
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Row of a depth, from 1 on for what lies behind the first point; in front of it down to far below.
    #[inline(always)]
    pub fn row(&self, depth: f32) -> f32 {
        least(most((depth - self.from) * self.scale + 1.0, -1e7), 1e7)
    }

    /// What rows are kept below to be looked up.
    pub const END: f32 = ROWS as f32 + 1.5;

    /// Level of the row, kept below [`Slices::END`].
    #[inline(always)]
    pub fn level(&self, row: u32) -> usize {
        usize::from(self.level[row as usize % TABLE])
    }

    /// True for what lies behind all points.
    #[inline(always)]
    pub fn is_behind(&self, row: f32) -> bool {
        row >= ROWS as f32 + 1.0
    }

    /// How many slices two rows are apart.
    #[inline(always)]
    pub fn between(&self, a: f32, b: f32) -> f32 {
        let level = |row: f32| self.level(least(most(row, 0.0), Slices::END) as u32);
        level(a).abs_diff(level(b)) as f32
    }

    /// The first row that lies behind a plane, or the [`nearest`] that there is.
    #[inline(always)]
    pub fn behind(&self, plane: isize) -> f32 {
        f32::from(self.plane[nearest(plane, self.count)]) + 1.0
    }

    /// The plane before a point of this depth, and how far it is between that and the next.
    #[inline(always)]
    pub fn point(&self, depth: f32) -> (usize, f32) {
        let row = (self.row(depth) - 1.0).max(0.0).min(ROWS as f32);
        let k = self.level(1 + (row as u32).min(ROWS as u32 - 1)) - 1;
        let (low, high) = (f32::from(self.plane[k]), f32::from(self.plane[k + 1]));
        (k, ((row - low) / (high - low)).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_rise_and_points_lie_in_their_slice() {
        for (count, placement) in [(1, Placement::Uniform), (128, Placement::Histogram), (2048, Placement::Histogram)] {
            let mut slices = Slices::new(count);
            let depths = || (0..1000).map(|i| 0.3 + 0.001 * (i % 37) as f32);
            slices.place(0.25, 0.75, placement, depths());
            assert!(slices.level[..ROWS + 2].windows(2).all(|w| w[0] <= w[1]));
            let (mut last, mut used) = (0.0, 0);
            for i in 0..=10_000 {
                let z = 0.25 + 0.5 * i as f32 / 10_000.0;
                let (k, f) = slices.point(z);
                assert!(k < count && (0.0..=1.0).contains(&f), "{count} {z}: {k} {f}");
                let level = slices.level(slices.row(z).min(Slices::END) as u32);
                assert!(level == k + 1 || i == 10_000, "{count} {z}: {level} {k}");
                // Linear from plane to plane, whole at planes.
                assert!(k as f32 + f >= last, "{count} {z}");
                used += usize::from(k as f32 + f - last > 0.0);
                last = k as f32 + f;
            }
            assert_eq!(last, count as f32);
            assert!(used > 4000, "{count}: {used}");
            if count == 128 {
                let (a, b) = (slices.point(0.3).0, slices.point(0.337).0);
                assert!(b - a > 95, "{a} {b}");
            }
        }
    }
}
