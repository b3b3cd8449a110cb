//! Hairs from candidates and maps: which exist, where they stand, what they are like (paper §3.3).

use crate::candidates::{Candidates, strand_id};
use crate::comb::Amount;
use crate::triangulate::Triangulation;
use pelage_geom::{Mesh, StrandId, SurfacePoint, TiledMap, Topology, rng};
use rayon::prelude::*;

/// Hairs that one task handles. Results do not depend on it.
const CHUNK: usize = 4096;

/// Where the hairs of a layer stand. N hairs in the order of their candidates, so that a denser layer has the same hairs
/// in the same order with others in between.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Roots {
    /// \[N\] roots on the rest skin.
    pub root: Vec<SurfacePoint>,
    /// \[N\] texture coordinates there.
    pub uv: Vec<[f32; 2]>,
    /// \[N\] chart there.
    pub chart: Vec<u32>,
    /// \[N\] names, see [`strand_id`].
    pub id: Vec<StrandId>,
}

/// What makes a hair exist: hairs per square scene unit, and maps that scale it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Density<'a> {
    /// Hairs per square scene unit where the maps are 1.
    pub value: f64,
    /// Scales `value`; negative values count as 0.
    pub map: Option<&'a TiledMap>,
    /// Turns areas off: scales by a value between 0 and 1.
    pub on_off: Option<&'a TiledMap>,
}

impl Density<'_> {
    /// Local density at texture coordinates, hairs per square scene unit.
    pub fn at(&self, uv: [f32; 2]) -> f64 {
        let map = self.map.map_or(1.0, |m| m.value(uv).max(0.0));
        let on = self.on_off.map_or(1.0, |m| m.value(uv).clamp(0.0, 1.0));
        self.value * f64::from(map) * f64::from(on)
    }

    /// Candidates that decide the layer on a skin of `area` square scene units: later ones are above every local
    /// density.
    pub fn needed_candidates(&self, area: f64) -> usize {
        let texels = |m: &TiledMap| {
            m.tiles.iter().flat_map(|(_, t)| t.data.iter().step_by(t.channels.max(1))).fold(0.0f32, |a, &b| a.max(b))
        };
        let most = self.value * f64::from(self.map.map_or(1.0, texels));
        // Rank i counts where i + 0.5 <= density * area.
        ((most * area + 0.5).floor().max(0.0)) as usize
    }
}

/// The hairs of a layer: candidate i exists if and only if (i + 0.5) / area <= local density. `candidates` should hold
/// at least [`Density::needed_candidates`]; `layer_seed` names the layer (top bit 0).
pub fn roots(mesh: &Mesh, topology: &Topology, candidates: &Candidates, density: &Density, layer_seed: u32) -> Roots {
    let enough = density.needed_candidates(candidates.area).min(candidates.root.len());
    let textured = !mesh.corner_uv.is_empty();
    let chunks: Vec<Roots> = candidates.root[..enough]
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(c, chunk)| {
            let mut out = Roots::default();
            for (k, p) in chunk.iter().enumerate() {
                let i = c * CHUNK + k;
                let uv = if textured { mesh.uv(p) } else { [0.0; 2] };
                if candidates.threshold(i) <= density.at(uv) {
                    out.root.push(*p);
                    out.uv.push(uv);
                    out.chart.push(topology.chart[p.triangle as usize]);
                    out.id.push(strand_id(layer_seed, i as u32));
                }
            }
            out
        })
        .collect();
    let mut all = Roots::default();
    let n = chunks.iter().map(|c| c.root.len()).sum();
    all.root.reserve_exact(n);
    all.uv.reserve_exact(n);
    all.chart.reserve_exact(n);
    all.id.reserve_exact(n);
    for c in chunks {
        all.root.extend(c.root);
        all.uv.extend(c.uv);
        all.chart.extend(c.chart);
        all.id.extend(c.id);
    }
    all
}

/// Control hairs of every hair. N hairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    /// \[N\] control hairs.
    pub hair: Vec<[u32; 3]>,
    /// \[N\] their weights: non-negative, sum 1 to 1e-6.
    pub weight: Vec<[f32; 3]>,
    /// Hairs in no triangle of control hairs: they took the nearest edge.
    pub outside: usize,
    /// Hairs in charts without control hairs: they took control hair 0.
    pub orphans: usize,
}

/// Finds the control hairs around every root.
pub fn weights(roots: &Roots, controls: &Triangulation) -> Weights {
    let n = roots.uv.len();
    let (mut hair, mut weight) = (vec![[0; 3]; n], vec![[1.0, 0.0, 0.0]; n]);
    let counted: Vec<[usize; 2]> = hair
        .par_chunks_mut(CHUNK)
        .zip(weight.par_chunks_mut(CHUNK))
        .zip(roots.uv.par_chunks(CHUNK).zip(roots.chart.par_chunks(CHUNK)))
        .map(|((hair, weight), (uv, chart))| {
            let mut count = [0; 2];
            for k in 0..uv.len() {
                match controls.locate(chart[k], uv[k]) {
                    Some(at) => {
                        (hair[k], weight[k]) = (at.hair, at.weight);
                        count[0] += usize::from(at.outside);
                    }
                    None => count[1] += 1,
                }
            }
            count
        })
        .collect();
    let sum = |k: usize| counted.iter().map(|c| c[k]).sum();
    Weights { hair, weight, outside: sum(0), orphans: sum(1) }
}

/// A feature that varies over the skin and from hair to hair: length, width, opacity.
#[derive(Clone, Copy, Debug, Default)]
pub struct Feature<'a> {
    /// Where the map is 1, in the feature's own unit.
    pub value: f32,
    /// Scales `value` (paper §3.3: absolute without a map, multiplied with one).
    pub map: Option<&'a TiledMap>,
    /// Fraction by which hairs differ at random: a hair gets 1 - noise to 1 + noise of the value.
    pub noise: f32,
    /// Name of the random numbers, see [`rng::channel`]; columns of one name vary together.
    pub channel: u64,
}

/// \[N\] values of a feature, none negative. `seed` with a hair's id keys its random number.
pub fn feature_column(roots: &Roots, feature: &Feature, seed: u64) -> Vec<f32> {
    column(roots, |id, uv| {
        let map = feature.map.map_or(1.0, |m| m.value(uv));
        (feature.value * map * vary(seed, id, feature.channel, feature.noise)).max(0.0)
    })
}

/// \[N\] linear colours: the constant, times the map where there is one (a map of one channel is grey), brighter or
/// darker at random by up to the fraction `noise`, the three channels alike. None is negative.
pub fn colour_column(
    roots: &Roots,
    constant: [f32; 3],
    map: Option<&TiledMap>,
    noise: f32,
    channel: u64,
    seed: u64,
) -> Vec<[f32; 3]> {
    let grey = map.is_some_and(|m| m.tiles.iter().all(|t| t.1.channels < 3));
    column(roots, |id, uv| {
        let mut c = map.map_or([1.0; 3], |m| m.sample(uv));
        if grey {
            c = [c[0]; 3];
        }
        let v = vary(seed, id, channel, noise);
        std::array::from_fn(|k| (constant[k] * c[k] * v).max(0.0))
    })
}

/// Whether a hair is a guard hair: one of a `share` (0 to 1) of its layer, drawn by its id, longer and thicker than the
/// rest (paper §3.4, footnote 7). A larger share has the same guard hairs and others.
pub fn is_guard(id: StrandId, share: f64, seed: u64) -> bool {
    rng::uniform(seed, id, rng::channel("guard"), 0) < share
}

/// Multiplies the values of guard hairs (see [`is_guard`]) by `factor`; leaves the others as they are. \[N\] values of
/// the hairs of `roots`.
pub fn scale_guards(values: &mut [f32], roots: &Roots, share: Amount, factor: f32, seed: u64) {
    let hairs = values.par_iter_mut().zip(&roots.id).enumerate().with_min_len(CHUNK);
    hairs.filter(|(h, (_, id))| is_guard(**id, share.of(*h), seed)).for_each(|(_, (value, _))| *value *= factor);
}

/// 1 - noise to 1 + noise.
fn vary(seed: u64, id: StrandId, channel: u64, noise: f32) -> f32 {
    if noise == 0.0 {
        return 1.0;
    }
    1.0 + noise * (2.0 * rng::uniform(seed, id, channel, 0) - 1.0) as f32
}

fn column<T: Send>(roots: &Roots, f: impl Fn(StrandId, [f32; 2]) -> T + Sync) -> Vec<T> {
    roots.id.par_iter().zip(&roots.uv).with_min_len(CHUNK).map(|(&id, &uv)| f(id, uv)).collect()
}
