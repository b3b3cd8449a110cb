//! Optical depth over a tile, plane after plane away from the light.

use super::line::{Line, Parts};
use super::numbers::{deposits, depth_of, place_of};
use super::sample::SPARE;
use super::slices::Slices;
use pelage_geom::registers::{Bits, LANES, Lanes};

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

    /// Memory in use.
    pub fn bytes(&self) -> usize {
        4 * (BLOCK + 1) * self.next.len() + 4 * self.end.len()
    }

    /// Adds a line.
    #[inline(always)]
    pub fn add<L: Lanes>(&mut self, line: &Line, slices: &Slices) {
        let (edge, last) = (L::splat(self.side - 0.5), L::splat(Slices::END));
        let count = line.count();
        let (mut word, mut row) = ([0u32; LANES], [0u32; LANES]);
        for k in (0..count).step_by(LANES) {
            let part: Parts<L> = line.parts(k, edge, last);
            deposits(part.depth, part.y * L::splat(self.side) + part.x, &mut word);
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

    /// Adds what lies in a level to the texels of a map.
    #[inline(always)]
    pub fn spread(&self, level: usize, map: &mut [f32]) {
        let end = self.end[level] as usize;
        let mut block = level;
        loop {
            let last = block == end / BLOCK;
            let count = if last { end % BLOCK } else { BLOCK };
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

/// Optical depth before some planes that follow each other, row by row of texels.
pub(crate) struct Planes {
    map: [Vec<f32>; 4],
    /// Number of the second of the four.
    plane: usize,
    /// How many planes after that one are kept.
    ahead: usize,
    count: usize,
}

impl Planes {
    pub fn new() -> Planes {
        Planes { map: [const { Vec::new() }; 4], plane: 0, ahead: 1, count: 0 }
    }

    /// Memory of a tile.
    pub fn bytes(side: usize) -> usize {
        16 * (side * side + SPARE)
    }

    /// Begins a tile at plane 0; one or two planes are kept `ahead`.
    pub fn begin(&mut self, deposits: &Deposits, side: usize, ahead: usize, count: usize) {
        for map in &mut self.map {
            map.clear();
            map.resize(side * side + SPARE, 0.0);
        }
        (self.plane, self.ahead, self.count) = (0, ahead, count);
        deposits.spread(0, &mut self.map[1]);
        let [first, now, rest @ ..] = &mut self.map;
        first.copy_from_slice(now);
        let mut before = &*now;
        for (k, map) in rest[..ahead].iter_mut().enumerate() {
            map.copy_from_slice(before);
            if k < count {
                deposits.spread(k + 1, map);
            }
            before = map;
        }
    }

    /// Goes on to plane `plane`.
    pub fn go(&mut self, deposits: &Deposits, plane: usize) {
        while self.plane < plane {
            self.plane += 1;
            self.map[..2 + self.ahead].rotate_left(1);
            let [.., before, last] = &mut self.map[..2 + self.ahead] else { return };
            last.copy_from_slice(before);
            let level = self.plane + self.ahead;
            // What stands for a plane that is not there is the one next to it.
            if level <= self.count {
                deposits.spread(level, last);
            }
        }
    }

    /// The plane before the present one, that one, and two after it.
    pub fn maps(&self) -> [&[f32]; 4] {
        self.map.each_ref().map(|m| &m[..])
    }
}
