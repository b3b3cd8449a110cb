//! Clumps: which hairs of a layer belong together, once per groom.

use super::run::{Counts, Runner};
use super::skin::Texel;
use super::tables::{decode, encode, table};
use super::{What, clusters, groom, guides, instance, layer_seed, plan_look::joins_clumps};
use crate::Error;
use crate::config::{Clump, LookValue, MapRef};
use crate::format::ply::Column;
use pelage_geom::{NONE, Vec3, rng};
use pelage_groom::cluster::middles;
use pelage_groom::field::Region;
use pelage_groom::instance::Roots;
use pelage_groom::look::member::{
    Members, Sites, centres, members, nearest_hairs, representatives, rest_sites, sides, whole_clumps,
};
use pelage_groom::look::region::regions;
use pelage_groom::look::vary::{Drawn, Scale, Vary, factors, shifts};
use std::rc::Rc;

/// Map value from which an area counts.
const INSIDE: f32 = 0.5;

/// Rest roots of a layer's hairs, relative to the skin's origin, and normals there.
#[derive(Debug)]
pub struct RestSites {
    pub position: Vec<[f32; 3]>,
    pub normal: Vec<[f32; 3]>,
}

/// Rest roots of a layer, kept for the run.
pub fn sites(run: &mut Runner<'_>, i: usize) -> Result<Rc<RestSites>, Error> {
    if let Some(found) = run.sites.get(&i) {
        return Ok(found.clone());
    }
    let (skin, roots) = (groom::skin(run)?, instance::roots(run, i)?);
    let (position, normal) = rest_sites(&groom::view(&skin), &roots.root, skin.origin());
    let found = Rc::new(RestSites { position, normal });
    run.sites.insert(i, found.clone());
    Ok(found)
}

/// How a parameter of that name varies over hairs: factors on it, or what is `added` to it. Empty if it does not.
pub fn column(
    run: &mut Runner<'_>,
    hairs: &Drawn<'_>,
    name: &str,
    v: &LookValue,
    added: bool,
) -> Result<Vec<f32>, Error> {
    let map = v.map().map(|m| run.map(&m, Texel::Value)).transpose()?;
    let scales: Vec<Scale> =
        v.0.vary.iter().map(|s| Scale { size: s.size as f32, deviation: s.deviation as f32 }).collect();
    let vary = Vary { map: map.as_ref(), noise: v.0.noise as f32, scales: &scales, channel: rng::channel(name) };
    Ok(if added { shifts(hairs, &vary) } else { factors(hairs, &vary) })
}

/// Clumps of a layer's level.
pub fn clumps(run: &mut Runner<'_>, i: usize, k: usize) -> Result<Rc<Members>, Error> {
    if let Some(found) = run.members.get(&(i, k)) {
        return Ok(found.clone());
    }
    let what = What::Clump(i, k as u32);
    let found = match run.fetch(what).and_then(|e| read(e.payload.first()?)) {
        Some(found) => found,
        None => find(run, i, k, what)?,
    };
    let found = Rc::new(found);
    run.members.insert((i, k), found.clone());
    Ok(found)
}

fn find(run: &mut Runner<'_>, i: usize, k: usize, what: What) -> Result<Members, Error> {
    let groom = &run.project.groom.value;
    let (name, c) = (groom.layer[i].name.clone(), groom.layer[i].clump[k].clone());
    let (roots, at) = (instance::roots(run, i)?, sites(run, i)?);
    let open = match &c.area {
        Some(area) => {
            let map = run.map(area, Texel::Value)?;
            roots.uv.iter().map(|uv| map.value(*uv) >= INSIDE).collect()
        }
        None => Vec::new(),
    };
    let hairs = Drawn { id: &roots.id, uv: &roots.uv, position: &at.position, seed: u64::from(layer_seed(&name)) };
    let sizes = sizes(run, i, k, &hairs)?;
    let partings: Vec<Vec<Vec3>> = groom::partings(run);
    let mut sites = Sites { position: &at.position, normal: &at.normal, side: &[] };
    let origin = groom::skin(run)?.origin();
    let relative: Vec<Vec<Vec3>> =
        partings.iter().map(|l| l.iter().map(|p| p - Vec3::from(origin)).collect()).collect();
    let mut side = sides(&relative, f64::from(sizes.most()), &sites);
    part(&mut side, &guides::dividers(&run.project.groom.value), partings.len(), &at.position, Vec3::from(origin));
    sites.side = &side;
    let before = if joins_clumps(&c, k) { Some(clumps(run, i, k - 1)?) } else { None };
    let found = if let Some(level) = c.clusters {
        in_clusters(run, &format!("layer[{i}].clump[{k}].clusters"), level, &roots, &open)?
    } else if c.regions.is_some() {
        in_regions(run, &c, &roots, &sites, sizes.value, &open)?
    } else {
        let stands = before.as_ref().map(|b| representatives(b)).unwrap_or_default();
        let may: Vec<bool> = match (open.is_empty(), stands.is_empty()) {
            (_, true) => open,
            (true, false) => stands,
            (false, false) => open.iter().zip(&stands).map(|(a, b)| *a && *b).collect(),
        };
        let centre = centre_hairs(run, i, k, &hairs, &may)?;
        let radii: Vec<f32> = centre.iter().map(|h| sizes.of(*h as usize)).collect();
        let spacing = sizes.spacing.unwrap_or_else(|| sizes.most());
        let found = members(&sites, centre, &radii, spacing, &may);
        match &before {
            Some(fine) => whole_clumps(&sites, fine, &radii, found),
            None => found,
        }
    };
    let loose = found.clump.iter().filter(|c| **c == NONE).count();
    let counts = Counts::from([
        (format!("clumps in level {k} of layer {name}"), found.centre.len() as u64),
        (format!("hairs without a clump in level {k} of layer {name}"), loose as u64),
    ]);
    run.keep(what, counts, &[("data.ply", &write(&found))])?;
    Ok(found)
}

/// How far clumps of a level reach.
pub(super) struct Sizes {
    /// Scene units, where nothing varies it.
    value: f32,
    /// \[N\] factors of hairs on it; empty: 1.
    factor: Vec<f32>,
    /// Scene units between clumps, as far as the level says.
    spacing: Option<f32>,
}

impl Sizes {
    fn of(&self, h: usize) -> f32 {
        self.value * self.factor.get(h).unwrap_or(&1.0)
    }

    /// The largest.
    pub fn most(&self) -> f32 {
        self.value * if self.factor.is_empty() { 1.0 } else { self.factor.iter().fold(0.0f32, |a, b| a.max(*b)) }
    }
}

/// How far clumps of a level reach around each hair, were it a centre. What a size is when none is given covers every gap.
pub(super) fn sizes(run: &mut Runner<'_>, i: usize, k: usize, hairs: &Drawn<'_>) -> Result<Sizes, Error> {
    let layer = &run.project.groom.value.layer[i];
    let c = &layer.clump[k];
    let cm2 = run.project.cm2_per_unit2();
    let spacing = c.density.as_ref().map(|d| 1.0 / (d.at(0.0).max(1e-9) * cm2).sqrt());
    let size = c.size.clone().unwrap_or_else(|| {
        LookValue::constant(match (spacing, &c.regions) {
            (Some(s), _) => 4.0 * s,
            (None, Some(_)) => 2.0 / (layer.density.value.max(1e-9) * cm2).sqrt(),
            (None, None) => 1.0 / cm2.sqrt(),
        })
    });
    let factor = column(run, hairs, "size", &size, false)?;
    Ok(Sizes { value: size.at(0.0) as f32, factor, spacing: spacing.map(|s| s as f32) })
}

/// Hairs that are centres of a level, of those that are `open` (empty: all).
pub(super) fn centre_hairs(
    run: &mut Runner<'_>,
    i: usize,
    k: usize,
    hairs: &Drawn<'_>,
    open: &[bool],
) -> Result<Vec<u32>, Error> {
    let c = &run.project.groom.value.layer[i].clump[k];
    let origin = groom::skin(run)?.origin();
    let by_hand = c.roots.iter().flatten().copied().chain(c.curves.iter().flatten().map(|l| l[0]));
    let by_hand: Vec<[f32; 3]> = by_hand.map(|p| std::array::from_fn(|x| (p[x] - origin[x]) as f32)).collect();
    if !by_hand.is_empty() {
        if hairs.id.is_empty() {
            return Ok(Vec::new());
        }
        let found = nearest_hairs(hairs.position, &by_hand);
        // In a draft two share what hair there is: the others of a clump follow the first.
        let same = (1..found.len()).find(|k| found[..*k].contains(&found[*k]));
        if let Some(k) = same.filter(|_| !run.project.is_draft()) {
            let what = format!("number {k} of a clump placed by hand has the same nearest hair as one before it");
            let at = format!("layer[{i}].clump[{k}]");
            return Err(run.project.groom.error(&at, what, "place them farther apart, or grow more hair there").into());
        }
        return Ok(found);
    }
    let density = c.density.as_ref().expect("checked: clumps have a density");
    let value = density.at(0.0) * run.project.cm2_per_unit2();
    let factor = column(run, hairs, "density", density, false)?;
    let area = groom::skin(run)?.area();
    Ok(centres(hairs.id, area, &|h| value * f64::from(*factor.get(h).unwrap_or(&1.0)), open))
}

fn in_regions(
    run: &mut Runner<'_>,
    c: &Clump,
    roots: &Roots,
    sites: &Sites<'_>,
    near: f32,
    open: &[bool],
) -> Result<Members, Error> {
    let map: &MapRef = c.regions.as_ref().expect("a level of regions");
    let map = run.map(map, Texel::Value)?;
    let value: Vec<f32> = roots.uv.iter().map(|uv| map.nearest(*uv)).collect();
    Ok(regions(sites, &value, near, open))
}

/// Adds on which side of dividers roots lie, from side number `first` on.
fn part(side: &mut Vec<[u64; 2]>, dividers: &[Region], first: usize, position: &[[f32; 3]], origin: Vec3) {
    if !dividers.is_empty() && side.is_empty() {
        side.resize(position.len(), [0; 2]);
    }
    for (k, d) in dividers.iter().enumerate() {
        let bit = 1 << ((first + k) % 64);
        for (side, p) in side.iter_mut().zip(position) {
            side[usize::from(d.contains(origin + Vec3::from(p.map(f64::from))))] |= bit;
        }
    }
}

/// Clusters of a level as clumps; centres are the hairs nearest to their middles.
fn in_clusters(run: &mut Runner<'_>, key: &str, level: usize, roots: &Roots, open: &[bool]) -> Result<Members, Error> {
    let (tree, uv) = (clusters::tree(run, None)?, clusters::coordinates(run, &roots.root)?);
    clusters::check_level(run, &tree, key, Some(level))?;
    let mut of = clusters::owners(&tree, &uv, Some(level));
    of.iter_mut().zip(open).filter(|(_, open)| !**open).for_each(|(k, _)| *k = NONE);
    let middle = middles(&tree, &of, &uv);
    let mut number = vec![NONE; middle.len()];
    let mut found = Members::default();
    for (k, h) in middle.iter().enumerate().filter(|(_, h)| **h != NONE) {
        number[k] = found.centre.len() as u32;
        found.centre.push(*h);
    }
    for (k, at) in of.iter().zip(&uv) {
        let own = number.get(*k as usize).copied().unwrap_or(NONE);
        let r = tree.cluster.get(*k as usize).map_or(0.0, |c| c.region.polar(*at)[0]);
        found.clump.push(own);
        found.reach.push(r.min(1.0) as f32);
    }
    Ok(found)
}

fn write(m: &Members) -> Vec<u8> {
    let hair = vec![("clump", Column::U32(m.clump.clone())), ("reach", Column::F32(m.reach.clone()))];
    let comment = format!("clump of every hair ({NONE}: none) and where it stands in it; centre hair of every clump");
    encode(&comment, &[table("hair", hair), table("clump", vec![("centre", Column::U32(m.centre.clone()))])])
}

fn read(bytes: &[u8]) -> Option<Members> {
    let file = decode(bytes)?;
    let hair = file.get("hair")?;
    Some(Members {
        centre: file.get("clump")?.u32("centre")?.to_vec(),
        clump: hair.u32("clump")?.to_vec(),
        reach: hair.f32("reach")?.to_vec(),
    })
}
