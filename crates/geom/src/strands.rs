//! Hairs as arrays: strand `s` owns `position[offsets.range(s)]`, root first.

use crate::SurfacePoint;
use std::ops::Range;

/// Stable name of a hair; the top bit is 0. It keys every random number of that hair.
pub type StrandId = u64;

/// The n + 1 offsets that cut a flat array into n runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offsets(Vec<u32>);

impl Default for Offsets {
    fn default() -> Self {
        Offsets(vec![0])
    }
}

impl Offsets {
    /// `strands` runs of `points` each. Panics if the total does not fit 32 bits.
    pub fn uniform(strands: usize, points: usize) -> Self {
        u32::try_from(strands * points).expect("more than 2^32 points");
        Offsets((0..=strands).map(|s| (s * points) as u32).collect())
    }

    /// Runs of the given lengths. Panics if the total does not fit 32 bits.
    pub fn from_counts(counts: impl IntoIterator<Item = usize>) -> Self {
        let mut total = 0usize;
        let mut v = vec![0];
        for c in counts {
            total += c;
            v.push(u32::try_from(total).expect("more than 2^32 points"));
        }
        Offsets(v)
    }

    /// Number of runs.
    pub fn len(&self) -> usize {
        self.0.len() - 1
    }

    /// True if there are no runs.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Elements of run `i`.
    pub fn range(&self, i: usize) -> Range<usize> {
        self.0[i] as usize..self.0[i + 1] as usize
    }

    /// The run that element `i`, less than the total, belongs to.
    pub fn run_of(&self, i: usize) -> usize {
        self.0[..self.len()].partition_point(|start| *start as usize <= i).saturating_sub(1)
    }

    /// Length of the flat array.
    pub fn total(&self) -> usize {
        self.0[self.0.len() - 1] as usize
    }

    /// Lengths of the runs in order.
    pub fn counts(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.windows(2).map(|w| (w[1] - w[0]) as usize)
    }

    /// The common length of all runs, if they have one (`None` when there are no runs).
    pub fn uniform_count(&self) -> Option<usize> {
        let first = self.counts().next()?;
        self.counts().all(|c| c == first).then_some(first)
    }
}

/// Hair curves at one instant. Per-strand columns that a source does not have are empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strands {
    /// Runs of `position`, one a strand.
    pub offsets: Offsets,
    /// Scene-space point that positions are relative to (keeps `f32` exact far from the scene's origin).
    pub origin: [f64; 3],
    /// Points, scene units relative to `origin`; root first.
    pub position: Vec<[f32; 3]>,
    /// Root on the rest skin, one a strand (empty without a skin).
    pub root: Vec<SurfacePoint>,
    /// Texture coordinates of the root, v up, one a strand (empty without).
    pub root_uv: Vec<[f32; 2]>,
    /// Stable names, one a strand, unique.
    pub id: Vec<StrandId>,
}

impl Strands {
    /// Points of strand `s`, root first.
    pub fn points(&self, s: usize) -> &[[f32; 3]] {
        &self.position[self.offsets.range(s)]
    }

    /// Number of strands.
    pub fn len(&self) -> usize {
        self.offsets.len()
    }

    /// True if there are no strands.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
