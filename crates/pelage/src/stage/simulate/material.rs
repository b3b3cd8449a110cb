//! What each hair of a layer is made of, where that varies from hair to hair.

use super::moment::Source;
use crate::Error;
use crate::config::{Target, check_material_value};
use crate::stage::groom::{self, CONTROL_SEED};
use crate::stage::run::Runner;
use crate::stage::{clumps, layer_seed};
use pelage_groom::look::vary::Drawn;
use pelage_sim::Material;
use std::collections::BTreeMap;

/// Least factor of a map and variation: nothing is without mass or stiffness. At 0 a strand has no equation to solve; a hundredth
/// is softer than anybody paints.
const LEAST: f32 = 0.01;

/// What each hair of a layer is made of; empty if all are of the same.
pub(super) fn materials(run: &mut Runner<'_>, i: usize, source: &Source) -> Result<Vec<Material>, Error> {
    let (at, material) = run.project.material(i);
    if run.project.curves.is_some() || !material.varied().iter().any(|(_, v)| v.varies()) {
        return Ok(Vec::new());
    }
    let (skin, every) = (groom::skin(run)?, run.project.target(i) == Target::EveryHair);
    let seed = if every { u64::from(layer_seed(&run.project.groom.value.layer[i].name)) } else { CONTROL_SEED };
    let (uv, position) = groom::places(&skin, &source.root);
    let hairs = Drawn { id: &source.id, uv: &uv, position: &position, seed };
    let mut factor: BTreeMap<&str, Vec<f32>> = BTreeMap::new();
    for (key, v) in material.varied() {
        let mut column = clumps::column(run, &hairs, &format!("material.{key}"), v, false)?;
        if key != "drag_factor" {
            let less = column.iter_mut().filter(|f| **f < LEAST).map(|f| *f = LEAST).count();
            if less > 0 {
                let what =
                    format!("{at}.{key}: its map and variation say less than {LEAST} for {less} hairs, which get that");
                run.warn_once(what);
            }
        }
        let value = |f: &f32| v.at(0.0) * f64::from(*f);
        for (id, x) in source.id.iter().zip(column.iter().map(value)) {
            let groom = &run.project.groom;
            check_material_value(groom, &format!("{at}.{key}"), x).map_err(|mut e| {
                e.what = format!("{} (hair {id}, by its map and variation)", e.what);
                e
            })?;
        }
        factor.insert(key, column);
    }
    let of = |h: usize| material.si(|key| factor[key].get(h).map_or(1.0, |f| f64::from(*f)));
    Ok((0..source.id.len()).map(of).collect())
}
