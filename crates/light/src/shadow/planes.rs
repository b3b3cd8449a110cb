//! Optical depth over a tile, plane after plane away from the light.

use super::line::{Line, Parts};
use super::numbers::{deposits, depth_of, place_of};
use super::sample::SPARE;
use super::settings::Interpolation;
use super::slices::{Slices, nearest};
use pelage_geom::registers::{Bits, LANES, Lanes, fetch};

/// Deposits that lie together. Larger blocks are less full, smaller ones need more of them.
const BLOCK: usize = 64;

/// What hairs leave in the texels of a tile, in lists by level (see [`Slices`]): four bytes each.
pub(crate) struct Deposits {
    side: f32,
    block: Vec<[u32; BLOCK]>,
    /// Block after each block of the same level.
    next: Vec<u32>,
    /// Where the next deposit of a level goes; its first block is the one of its number.
    end: Vec<u32>,
}

impl Deposits {
    pub fn new() -> Deposits {
        Deposits { side: 0.0, block: Vec::new(), next: Vec::new(), end: Vec::new() }
    }

    /// Forgets all, for a tile of `side` texels.
    pub fn clear(&mut self, side: usize, slices: usize) {
        self.side = side as f32;
        self.end.clear();
        self.end.extend((0..=slices).map(|level| (level * BLOCK) as u32));
        self.next.clear();
        self.next.resize(slices + 1, 0);
        if self.block.len() <= slices {
            self.block.resize(slices + 1, [0; BLOCK]);
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        // All blocks are full but the last of each level.
        let levels = self.end.len();
        self.end.iter().map(|end| *end as usize % BLOCK).sum::<usize>() + BLOCK * (self.next.len() - levels)
    }

    /// Memory in use.
    pub fn bytes(&self) -> usize {
        4 * (BLOCK + 1) * self.next.len() + 4 * self.end.len()
    }

    /// Adds a line.
    #[inline(always)]
    pub fn add<L: Lanes>(&mut self, line: &Line, slices: &Slices) {
        let (edge, last) = (L::splat(self.side - 0.5), L::splat(Slices::END));
        let count = line.count();
        let stride = [1.0, self.side];
        let (along, across) = (L::splat(stride[line.axis()]), L::splat(stride[1 - line.axis()]));
        let (mut word, mut row) = ([0u32; LANES], [0u32; LANES]);
        for k in (0..count).step_by(LANES) {
            let part: Parts<L> = line.parts(k, edge, last);
            deposits(part.depth, part.along * along + part.across * across, &mut word);
            part.row.whole().store(&mut row);
            if self.block.len() < self.next.len() + LANES {
                self.block.resize(2 * self.block.len() + LANES, [0; BLOCK]);
            }
            let (block, end) = (&mut self.block[..], &mut self.end[..]);
            for (word, row) in word.iter().zip(&row).take(count - k) {
                // Behind all points there is no list.
                let Some(end) = end.get_mut(slices.level(*row)) else { continue };
                let at = *end as usize;
                block[at / BLOCK][at % BLOCK] = *word;
                *end = if at % BLOCK == BLOCK - 1 { link(&mut self.next, at / BLOCK) } else { *end + 1 };
            }
        }
    }

    /// The last level before a plane, or the nearest that there is.
    fn before(&self, plane: isize) -> usize {
        nearest(plane, self.end.len() - 1)
    }

    /// Adds what lies in a level to the texels of a map.
    #[inline(always)]
    pub fn spread(&self, level: usize, map: &mut [f32]) {
        let end = self.end[level] as usize;
        let mut block = level;
        loop {
            let last = block == end / BLOCK;
            let count = if last { end % BLOCK } else { BLOCK };
            let next = self.block.get(self.next[block] as usize);
            (0..BLOCK).step_by(16).for_each(|i| fetch(next.map(|n| &n[i])));
            for word in &self.block[block][..count] {
                map[place_of(*word)] += depth_of(*word);
            }
            if last {
                return;
            }
            block = self.next[block] as usize;
        }
    }
}

/// Takes another block to follow a full one; its beginning.
#[cold]
#[inline(never)]
fn link(next: &mut Vec<u32>, full: usize) -> u32 {
    let new = next.len() as u32;
    next[full] = new;
    next.push(0);
    new * BLOCK as u32
}

/// Optical depth before two or four planes that follow each other, row by row of texels.
pub(crate) struct Planes {
    map: Vec<Vec<f32>>,
    /// Number of the first: -1 at first where there are four.
    first: isize,
}

impl Planes {
    pub fn new(interpolation: Interpolation) -> Planes {
        let maps = if interpolation == Interpolation::Cubic { 4 } else { 2 };
        Planes { map: vec![Vec::new(); maps], first: 0 }
    }

    /// Memory for a tile.
    pub fn bytes(&self) -> usize {
        self.map.iter().map(|m| 4 * m.len()).sum()
    }

    /// Begins a tile: a point lies between planes 0 and 1.
    pub fn begin(&mut self, deposits: &Deposits, side: usize) {
        self.first = if self.map.len() == 4 { -1 } else { 0 };
        for (plane, map) in (self.first..).zip(&mut self.map) {
            map.clear();
            map.resize(side * side + SPARE, 0.0);
            (0..=deposits.before(plane)).for_each(|level| deposits.spread(level, map));
        }
    }

    /// Goes on to points between `plane` and the next.
    pub fn go(&mut self, deposits: &Deposits, plane: usize) {
        let maps = self.map.len() as isize;
        let first = plane as isize - (maps / 2 - 1);
        while self.first < first {
            // The first becomes the last. What lies between is added to it again: a copy of the plane before costs more.
            let levels = deposits.before(self.first) + 1..=deposits.before(self.first + maps);
            self.map.rotate_left(1);
            let last = &mut self.map[maps as usize - 1];
            levels.for_each(|level| deposits.spread(level, last));
            self.first += 1;
        }
    }

    /// The maps, the first plane first.
    pub fn maps(&self) -> &[Vec<f32>] {
        &self.map
    }
}
