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
            Quality::Draft => (1024, 256),
            Quality::Default => (2048, 384),
            Quality::Fine => (4096, 512),
        };
        ShadowSettings { texels, slices, ..ShadowSettings::default() }
    }
}

/// Default side of the footprint, as a fraction of the map's side.
const FOOTPRINT: f64 = 1.0 / 256.0;

/// The default is where the measured curve bends: RMS error below 0.02 and 95 % of errors below 0.05 on every groom of
/// [`MEASURED`]. Half the texels raise it to 0.028 for half to nine tenths of the time, twice the texels lower it to 0.011 for two to
/// three times the time. Slices cost next to nothing: with 128 thick hair in locks is wrong by 0.025 instead of 0.014. Slices
/// at equal distances are wrong there by 0.021. Linear transmittance has a better bias and, at 192 slices, the same error there
/// for 8 % more time in dense hair. A filter wider or narrower than the footprint by a quarter makes the error half as large again.
impl Default for ShadowSettings {
    fn default() -> Self {
        ShadowSettings {
            texels: 2048,
            slices: 384,
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

/// Settings with their measured error: the worst of seven grooms (see [`MEASURED`]).
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
/// about 1,000 exact rays from the footprint of each of 1,500 to 2,000 points: the worst of seven grooms. These are long
/// hair, fur and curls on a ball (benches/shadow.rs, `-- measured`), the sample bust and fox, foreign hair on an object and the
/// guides of a head (the example `shadow_error` of the crate `pelage`). The size of the bias is 0.008, 0.005, 0.003 and 0.002.
pub const MEASURED: [Measured; 4] = [
    Measured { texels: 512, slices: 128, rms: 0.056, p95: 0.126 },
    Measured { texels: 1024, slices: 256, rms: 0.028, p95: 0.061 },
    Measured { texels: 2048, slices: 384, rms: 0.0190, p95: 0.042 },
    Measured { texels: 4096, slices: 512, rms: 0.0115, p95: 0.027 },
];

/// The cheapest measured settings whose RMS error is at most `rms`; the finest if none is.
pub fn for_error(rms: f64) -> ShadowSettings {
    let found = MEASURED.iter().find(|m| m.rms <= rms).unwrap_or(&MEASURED[MEASURED.len() - 1]);
    ShadowSettings { texels: found.texels, slices: found.slices, ..ShadowSettings::default() }
}
