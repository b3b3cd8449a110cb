//! How parameters vary over the skin and from hair to hair.
//!
//! Sparse-guide-hairs paper §2.4.3: curls of neighbours are alike and change smoothly over the scalp, at several scales,
//! each with its own deviation. The paper lays a grid over polar coordinates of a scalp; here the noise is in space, at the
//! rest roots, which needs neither poles nor charts.

use super::CHUNK;
use super::perlin::{key, perlin3};
use pelage_geom::rng::uniform;
use pelage_geom::{StrandId, TiledMap};
use rayon::prelude::*;

/// Hairs that parameters are drawn for. N entries each.
#[derive(Clone, Copy, Debug)]
pub struct Drawn<'a> {
    /// \[N\] names.
    pub id: &'a [StrandId],
    /// \[N\] texture coordinates of the roots.
    pub uv: &'a [[f32; 2]],
    /// \[N\] rest roots, scene units.
    pub position: &'a [[f32; 3]],
    /// With a hair's name keys its random numbers.
    pub seed: u64,
}

/// Smooth variation over the skin at one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Distance over which values change, scene units.
    pub size: f32,
    /// Standard deviation.
    pub deviation: f32,
}

/// How a parameter varies.
#[derive(Clone, Copy, Debug, Default)]
pub struct Vary<'a> {
    /// Painted factor.
    pub map: Option<&'a TiledMap>,
    /// Random part from hair to hair, spread evenly over plus and minus this.
    pub noise: f32,
    /// Smooth parts.
    pub scales: &'a [Scale],
    /// Name of the random numbers, see [`pelage_geom::rng::channel`].
    pub channel: u64,
}

/// Random and smooth part of every hair, mean 0.
fn deviation(hairs: &Drawn, v: &Vary, h: usize) -> f32 {
    let mut d = 0.0;
    if v.noise != 0.0 {
        d += v.noise * (2.0 * uniform(hairs.seed, hairs.id[h], v.channel, 0) - 1.0) as f32;
    }
    for (k, s) in v.scales.iter().enumerate() {
        let p = hairs.position[h].map(|x| x / s.size);
        d += s.deviation * perlin3(key(hairs.seed, k as u64, v.channel), p)[0];
    }
    d
}

/// \[N\] factors `map (1 + deviation)`, none negative; empty if nothing varies.
pub fn factors(hairs: &Drawn, v: &Vary) -> Vec<f32> {
    if v.map.is_none() && v.noise == 0.0 && v.scales.is_empty() {
        return Vec::new();
    }
    let one = |h: usize| v.map.map_or(1.0, |m| m.value(hairs.uv[h])) * (1.0 + deviation(hairs, v, h));
    (0..hairs.id.len()).into_par_iter().with_min_len(CHUNK).map(|h| one(h).max(0.0)).collect()
}

/// \[N\] shifts `map + deviation` (a map is 0 where there is none); empty if nothing varies.
pub fn shifts(hairs: &Drawn, v: &Vary) -> Vec<f32> {
    if v.map.is_none() && v.noise == 0.0 && v.scales.is_empty() {
        return Vec::new();
    }
    let one = |h: usize| v.map.map_or(0.0, |m| m.value(hairs.uv[h])) + deviation(hairs, v, h);
    (0..hairs.id.len()).into_par_iter().with_min_len(CHUNK).map(one).collect()
}
