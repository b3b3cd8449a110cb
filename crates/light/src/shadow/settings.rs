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
}

impl Quality {
    /// The settings of this name.
    pub fn settings(self) -> ShadowSettings {
        let (texels, slices) = match self {
            Quality::Draft => (512, 32),
            Quality::Default => (1024, 96),
            Quality::Fine => (2048, 128),
        };
        ShadowSettings { texels, slices, ..ShadowSettings::default() }
    }
}

/// Default side of the footprint, as a fraction of the map's side.
const FOOTPRINT: f64 = 1.0 / 256.0;

/// The default is where the measured curve bends: half the texels raise the RMS error (worst groom, see [`MEASURED`]) from
/// 0.019 to 0.033 for half the time, twice the texels lower it to 0.013 for twice the time. With 32 slices it is 0.022.
/// Slices at equal distances need four times as many for the same error, and the three interpolations differ by less
/// than the sampling noise. A filter wider or narrower than the footprint by a quarter raises the error by a third.
impl Default for ShadowSettings {
    fn default() -> Self {
        ShadowSettings {
            texels: 1024,
            slices: 96,
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

/// Settings with their measured error: the worst of three grooms (see [`MEASURED`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// As [`ShadowSettings::texels`].
    pub texels: usize,
    /// As [`ShadowSettings::slices`].
    pub slices: usize,
    /// Root mean square of the error of transmittance, sampling noise of the truth taken out in quadrature.
    pub rms: f64,
    /// 95th percentile of the size of the error, noise of the truth (0.006) included.
    pub p95: f64,
}

/// Errors at the default placement, interpolation and footprint, cheapest first, under slanted parallel light, against
/// 1058 exact rays from the footprint of each of 1500 points: long hair (40,000 hairs, 20 cm, on a ball of 10 cm), fur
/// (100,000, 2 cm), curls (10,000), 80 um wide, opacity 0.5 to 1 (benches/shadow.rs, `-- measured`). The size of the
/// bias is 0.0033 at most, at the default 0.0012.
pub const MEASURED: [Measured; 7] = [
    Measured { texels: 256, slices: 16, rms: 0.055, p95: 0.118 },
    Measured { texels: 512, slices: 32, rms: 0.033, p95: 0.070 },
    Measured { texels: 1024, slices: 32, rms: 0.022, p95: 0.047 },
    Measured { texels: 1024, slices: 96, rms: 0.0191, p95: 0.041 },
    Measured { texels: 2048, slices: 64, rms: 0.0133, p95: 0.030 },
    Measured { texels: 2048, slices: 128, rms: 0.0127, p95: 0.0285 },
    Measured { texels: 4096, slices: 256, rms: 0.0076, p95: 0.019 },
];

/// The cheapest measured settings whose RMS error is at most `rms`; the finest if none is.
pub fn for_error(rms: f64) -> ShadowSettings {
    let found = MEASURED.iter().find(|m| m.rms <= rms).unwrap_or(&MEASURED[MEASURED.len() - 1]);
    ShadowSettings { texels: found.texels, slices: found.slices, ..ShadowSettings::default() }
}
