//! Opacity shadow maps: how much light of a source reaches every point of every hair, past other hairs and solids.
//!
//! The method is Kim's (opacity shadow maps, SIGGRAPH 2003 course notes, §4) cut into tiles: the plane across the light
//! is divided into squares of `TILE` texels, the hair segments are sorted into them, and each tile sorts what they leave in
//! its texels by slices of its own, then goes from plane to plane away from the light: adds up optical depth, samples the
//! points behind the plane, and forgets. Tiles are independent, so the bytes are the same for any number of threads, and
//! memory is 32 bytes a point, about 7 a segment and one tile a thread (4 bytes a deposit, about one a texel that a hair
//! crosses), whatever the resolution times the slices.
//!
//! A point's own hair is taken out of its footprint by the same deposits that put it in, so no bias in depth is needed.
//! Solids are met by a ray from the point itself, so their shadows are sharp and exact (points that lie before all that
//! a map sees of the solids there need no ray); only hair is averaged over the footprint, and the reference does the same.
//!
//! Transmittance is the fraction of light that passes all *other* hairs and all solids: a hair of opacity o that lies
//! across a ray multiplies by 1 - o. Falloff with distance and the shape of a spot's beam are not in it.

mod bins;
mod exact;
mod exp;
mod line;
mod numbers;
#[cfg(test)]
mod numbers_tests;
mod planes;
mod project;
mod sample;
mod settings;
mod slices;
mod solid;
mod tile;

pub use exact::{Footprint, Sample, ShadowError, transmittance_exact};
pub use settings::{Interpolation, MEASURED, Measured, Placement, Quality, ShadowSettings, for_error};
pub use solid::Solid;

use crate::preview::{diameter, in_scene};
use bins::{Chunk, chunks};
use pelage_geom::{Offsets, Vec3};
use project::{Projection, fit};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};

/// Side of a tile, texels. Half of it repeats the work of segments that cross borders (a tenth more time); with twice as much
/// the places of a tile's texels no longer fit the 16 bits of a deposit.
pub(crate) const TILE: usize = 128;

/// Where light comes from: world space, scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// Parallel light.
    Directional {
        /// The way it travels, of any length but zero.
        direction: Vec3,
    },
    /// Light from a point to all sides. Farther than a million times the hair's size it counts as parallel.
    Point {
        /// Where.
        position: Vec3,
    },
    /// Light from a point into a cone; points outside the cone get transmittance 0 and are counted.
    Spot {
        /// Where.
        position: Vec3,
        /// Middle of the cone, of any length but zero.
        direction: Vec3,
        /// Half angle of the full beam, radians.
        cone: f64,
        /// Angle beyond it over which the beam ends, radians.
        softness: f64,
    },
}

/// The hairs of one layer that cast and receive shadow.
#[derive(Clone, Copy, Debug)]
pub struct ShadowHair<'a> {
    /// Runs of points, one a strand.
    pub offsets: &'a Offsets,
    /// Points, scene units relative to `origin`; root first.
    pub position: &'a [[f32; 3]],
    /// Scene-space point that positions are relative to.
    pub origin: [f64; 3],
    /// Diameter, scene units, one a point; what is missing, negative or not finite is 0 and casts no shadow.
    pub width: &'a [f32],
    /// Opacity of a hair's whole width in [0, 1], one a strand, or one a point (recognised by length); what is
    /// missing is 1.
    pub opacity: &'a [f32],
}

/// What was done and what could not be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowCounts {
    /// Texels along a side of the map: fewer than asked for where filter or hairs are very wide.
    pub texels: usize,
    /// Points that took a value from the map.
    pub points: usize,
    /// Segments that cast shadow; once per face of a cube.
    pub segments: usize,
    /// Points left out because they are not finite or out of range: their transmittance is 1, the hair is cut there.
    pub bad_points: usize,
    /// Points outside a spot's cone, with transmittance 0.
    pub masked: usize,
    /// Tiles that were worked, of all that the maps have.
    pub tiles: [usize; 2],
    /// Segments over all tiles: at least `segments` where all are in use, more as they cross tiles.
    pub pairs: usize,
    /// What they leave in texels, by texel and slice.
    pub deposits: usize,
    /// Points that solids hide from the light.
    pub behind_solid: usize,
    /// Most memory held at once apart from input and result, bytes, for one thread.
    pub bytes: usize,
}

/// Why nothing was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadSource {
    /// A direction of no length, or not finite.
    Direction,
    /// A position that is not finite.
    Position,
}

impl std::fmt::Display for BadSource {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            BadSource::Direction => {
                "the light's direction has no length or is not finite: give a vector like [0, -1, 0]"
            }
            BadSource::Position => "the light's position is not finite: give three numbers in scene units",
        })
    }
}

impl std::error::Error for BadSource {}

/// Transmittance of every point of every layer, from maps.
pub fn transmittance(
    source: Source,
    layers: &[ShadowHair],
    solids: &[Solid],
    settings: &ShadowSettings,
) -> Result<(Vec<Vec<f32>>, ShadowCounts), BadSource> {
    let settings = settings.clamped();
    let (mut projections, mut counts) = fit(source, layers, &settings)?;
    let cells: Vec<Vec<AtomicU32>> =
        layers.iter().map(|l| l.position.par_iter().map(|_| AtomicU32::new(1.0f32.to_bits())).collect()).collect();
    for projection in &mut projections {
        // Every face knows all that is masked.
        counts.masked = 0;
        face(projection, layers, solids, &settings, &cells, &mut counts);
    }
    let out: Vec<Vec<f32>> =
        cells.into_iter().map(|c| c.into_par_iter().map(|v| f32::from_bits(v.into_inner())).collect()).collect();
    Ok((out, counts))
}

/// Writes what one map knows. Each point belongs to one tile of one map, so every cell is written once at most.
fn face(
    projection: &mut Projection,
    layers: &[ShadowHair],
    solids: &[Solid],
    settings: &ShadowSettings,
    cells: &[Vec<AtomicU32>],
    counts: &mut ShadowCounts,
) {
    let (chunks, grid) = chunks(projection, layers);
    let projection = &*projection;
    for c in &chunks {
        counts.masked += c.masked.len();
        counts.points += c.receivers;
        counts.segments += c.segments;
        counts.pairs += c.list.len();
        for &i in &c.masked {
            cells[c.layer][i as usize].store(0, Ordering::Relaxed);
        }
    }
    let cover = solid::Cover::new(solids, projection);
    // Each thread takes the next tile that is left: some cost many times as much as others.
    let next = AtomicUsize::new(0);
    let done = (0..rayon::current_num_threads())
        .into_par_iter()
        .with_max_len(1)
        .map(|_| {
            let mut work = tile::Work::new(projection, settings, solids, &cover);
            let tiles =
                std::iter::repeat_with(|| next.fetch_add(1, Ordering::Relaxed)).take_while(|t| *t < grid * grid);
            tiles
                .map(|t| work.run(&chunks, layers, [t % grid, t / grid], t, cells))
                .fold(tile::Done::default(), tile::Done::and)
        })
        .reduce(tile::Done::default, tile::Done::and);
    counts.behind_solid += done.hidden;
    counts.deposits += done.deposits;
    counts.texels = projection.texels;
    counts.tiles[0] += done.tiles;
    counts.tiles[1] += grid * grid;
    let held: usize = chunks.iter().map(Chunk::bytes).sum();
    counts.bytes = counts.bytes.max(held + done.bytes);
}

impl ShadowHair<'_> {
    /// Diameter at point `i`, finite and >= 0.
    #[inline]
    pub(crate) fn width(&self, i: usize) -> f32 {
        diameter(self.width, i)
    }

    /// Opacity of strand `s` at its point `i` (counted over all strands), in [0, 1].
    #[inline]
    pub(crate) fn opacity(&self, s: usize, i: usize) -> f32 {
        let entry = if self.opacity.len() > self.offsets.len() { i } else { s };
        let o = self.opacity.get(entry).copied().unwrap_or(1.0);
        if o.is_nan() { 0.0 } else { o.clamp(0.0, 1.0) }
    }

    /// Point `i` in scene space.
    #[inline]
    pub(crate) fn point(&self, i: usize) -> Vec3 {
        in_scene(self.origin, &self.position[i])
    }
}
