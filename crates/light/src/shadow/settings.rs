//! What the maps are made of, and what that costs in error.

/// Size and kind of the maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowSettings {
    /// Texels along the longer side of what the light sees of the hair; 1 to 8192.
    pub texels: usize,
    /// Slices along the light in each tile; 1 to 2048.
    pub slices: usize,
    /// Where the slices lie.
    pub placement: Placement,
    /// Side of the square over which transmittance is averaged around each point, across the light, as a fraction of
    /// the map's side (at the depth of the point, where light spreads); at least one texel is taken.
    pub filter: f64,
    /// What is interpolated between slices.
    pub interpolation: Interpolation,
}

/// Where the slices of a tile lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placement {
    /// At equal distances between the first and the last point of the tile.
    Uniform,
    /// Closer where the tile has more hair.
    Histogram,
}

/// What is interpolated between slices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Optical depth, linearly (Kim, Routine 2, line 15; the exponential interpolation of sparse guide hairs, §4).
    OpticalDepth,
    /// Transmittance, linearly.
    Transmittance,
    /// Optical depth by a cubic over four slices, kept between the nearer two.
    Cubic,
}

/// Named settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// For a look.
    Draft,
    /// For export.
    Default,
    /// For hair that is seen close.
    Fine,
    /// The finest map that is measured; the exact reference is [`super::transmittance_exact`].
    Reference,
}

impl Quality {
    /// The settings of this name.
    pub fn settings(self) -> ShadowSettings {
        let (texels, slices) = match self {
            Quality::Draft => (512, 32),
            Quality::Default => (1024, 64),
            Quality::Fine => (2048, 128),
            Quality::Reference => (4096, 256),
        };
        ShadowSettings { texels, slices, ..ShadowSettings::default() }
    }
}

/// Default side of the footprint, as a fraction of the map's side.
const FOOTPRINT: f64 = 1.0 / 256.0;

impl Default for ShadowSettings {
    fn default() -> Self {
        ShadowSettings {
            texels: 1024,
            slices: 64,
            placement: Placement::Histogram,
            filter: FOOTPRINT,
            interpolation: Interpolation::OpticalDepth,
        }
    }
}

/// Widest filter, texels: its square is summed for every point.
pub(crate) const WIDEST: f64 = 16.0;

impl ShadowSettings {
    /// Within what the maps can do.
    pub(crate) fn clamped(&self) -> ShadowSettings {
        let filter = if self.filter > 0.0 { self.filter.min(1.0) } else { 0.0 };
        let mut texels = self.texels.clamp(1, 8192);
        if filter * texels as f64 > WIDEST {
            texels = ((WIDEST / filter) as usize).max(1);
        }
        ShadowSettings { texels, slices: self.slices.clamp(1, 2048), filter, ..*self }
    }
}

/// Settings with their measured error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The settings, by texels and slices; the rest as in the default.
    pub size: [usize; 2],
    /// RMS error of transmittance against the footprint truth, sampling noise removed.
    pub rms: f64,
}

/// Errors of the default footprint, cheapest first.
pub const MEASURED: [Measured; 2] = [Measured { size: [512, 32], rms: 0.04 }, Measured { size: [1024, 64], rms: 0.02 }];

/// The cheapest measured settings whose RMS error is at most `rms`; the finest if none is.
pub fn for_error(rms: f64) -> ShadowSettings {
    let found = MEASURED.iter().find(|m| m.rms <= rms).unwrap_or(&MEASURED[MEASURED.len() - 1]);
    ShadowSettings { texels: found.size[0], slices: found.size[1], ..ShadowSettings::default() }
}
