//! Instance: roots, ids, weights and features of every hair, on the rest pose, once per groom. One cache entry a column.

use super::plan_kept::hairs_of;
use super::run::{Counts, Runner};
use super::skin::Texel;
use super::tables::{decode, encode, id_columns, ids_of, root_columns, roots_of, table, vector_columns, vectors_of};
use super::{Skin, What, candidate_density, clumps, clusters, comb, groom, guides, kept, layer_seed};
use crate::Error;
use crate::config::{Feature, Guard, GuideChoice};
use crate::format::ply::Column;
use pelage_geom::{StrandId, SurfacePoint, TiledMap, rng};
use pelage_groom::candidates::{Candidates, candidates as find_candidates, strand_id};
use pelage_groom::choose::{self, respect};
use pelage_groom::comb::Amount;
use pelage_groom::control::ControlHairs;
use pelage_groom::instance::{Density, Feature as FeatureSource, Roots, colour_column, feature_column, scale_guards};
use pelage_groom::instance::{roots as find_roots, weights as find_weights};
use pelage_groom::keep::kept as kept_roots;
use pelage_groom::look::vary::Drawn;
use pelage_groom::triangulate::{mirrored_charts, triangulate};
use std::rc::Rc;

/// How many doublings of a layer's density are looked for in the cache: more have hardly been there.
const MOST_LEVELS: u32 = 12;

/// Blue-noise candidate roots of a layer.
pub fn candidates(run: &mut Runner<'_>, i: usize) -> Result<Candidates, Error> {
    let what = What::Candidates(i);
    let skin = groom::skin(run)?;
    if let Some(entry) = run.fetch(what)
        && let Some(root) = entry.payload.first().and_then(|b| roots_of(decode(b)?.get("candidate")?))
    {
        return Ok(Candidates { root, area: skin.area() });
    }
    let layer = &run.project.groom.value.layer[i];
    let density = candidate_density(layer.density.value) * run.project.cm2_per_unit2();
    let count = (density * skin.area()).ceil() as usize;
    check_count(run, i, count)?;
    let found = match longer(run, i, count) {
        Some(root) => Candidates { root, area: skin.area() },
        None => search(&skin, layer_seed(&layer.name), count),
    };
    let file = encode(
        "candidate roots in blue-noise order: a prefix is as even as the whole",
        &[table("candidate", root_columns(&found.root))],
    );
    run.keep(what, Counts::from([("candidates".to_owned(), found.root.len() as u64)]), &[("data.ply", &file)])?;
    Ok(found)
}

/// The first `count` of a longer list in the cache, from a time when the layer was denser: a prefix is the same list.
fn longer(run: &Runner<'_>, i: usize, count: usize) -> Option<Vec<SurfacePoint>> {
    let mut recipe = run.plan.step(What::Candidates(i)).recipe.clone();
    let field = recipe.fields.iter().position(|f| f.name == "per_cm2")?;
    let level: f64 = recipe.fields[field].value.parse().ok()?;
    let mut keys = (1..=MOST_LEVELS).map(|k| {
        recipe.fields[field].value = (level * f64::from(1u32 << k)).to_string();
        recipe.key()
    });
    let key = keys.find(|key| run.store.contains(key))?;
    let mut root = roots_of(decode(run.store.get(&key)?.payload.first()?)?.get("candidate")?)?;
    root.truncate(count);
    (root.len() == count).then_some(root)
}

/// Ids number the candidates of a layer with 32 bits.
fn check_count(run: &Runner<'_>, i: usize, count: usize) -> Result<(), Error> {
    if u32::try_from(count).is_ok() {
        return Ok(());
    }
    let what = format!("asks for {count} candidate roots on this skin, more than 2^32");
    let help = "lower the density, or check shot.meters_per_unit";
    Err(run.project.groom.error(&format!("layer[{i}].density.value"), what, help).into())
}

fn search(skin: &Skin, seed: u32, count: usize) -> Candidates {
    find_candidates(&skin.mesh, &skin.topology, u64::from(seed), count, &mut |_| true)
        .expect("nothing stops the search")
}

/// Roots of a layer's hairs, of those that the shot needs.
pub fn roots(run: &mut Runner<'_>, i: usize) -> Result<Rc<Roots>, Error> {
    if let Some(found) = run.roots.get(&i) {
        return Ok(found.clone());
    }
    let found = match hairs_of(run.project, i) {
        What::Kept(_) => kept::kept_hairs(run, i)?.roots,
        _ => Rc::new(grown(run, i)?),
    };
    run.roots.insert(i, found.clone());
    Ok(found)
}

/// Roots of all of a layer's hairs: the candidates whose rank is below the local density.
pub fn grown(run: &mut Runner<'_>, i: usize) -> Result<Roots, Error> {
    match run.fetch(What::Roots(i)).and_then(|e| decode_roots(e.payload.first()?)) {
        Some(found) => Ok(found),
        None => grow(run, i),
    }
}

/// What makes a layer's hairs exist, with its maps.
pub(super) struct LayerDensity {
    value: f64,
    map: Option<TiledMap>,
    on_off: Option<TiledMap>,
}

impl LayerDensity {
    /// As hairs are grown by it.
    pub fn view(&self) -> Density<'_> {
        Density { value: self.value, map: self.map.as_ref(), on_off: self.on_off.as_ref() }
    }
}

/// Reads what makes a layer's hairs exist.
pub(super) fn density(run: &mut Runner<'_>, i: usize) -> Result<LayerDensity, Error> {
    let layer = &run.project.groom.value.layer[i];
    let map = feature_map(run, &layer.density)?;
    let on_off = layer.on_off.as_ref().map(|m| run.map(m, Texel::Value)).transpose()?;
    Ok(LayerDensity { value: layer.density.value * run.project.cm2_per_unit2(), map, on_off })
}

/// True if a layer consists of control hairs placed one by one.
pub(super) fn is_by_hand(run: &Runner<'_>, i: usize) -> bool {
    !run.project.groom.value.layer[i].hairs.is_empty()
}

/// The control hair that a hair of such a layer is: its id ends in the number of that among those placed one by one.
fn by_hand(control: &ControlHairs, id: StrandId) -> usize {
    control.placed_alone(id as u32).expect("hairs of the layer are control hairs")
}

/// Roots of such a layer, in the order of the file.
fn roots_by_hand(run: &mut Runner<'_>, i: usize) -> Result<Roots, Error> {
    let (skin, control) = (groom::skin(run)?, comb::combed(run)?);
    let groom = &run.project.groom.value;
    let seed = layer_seed(&groom.layer[i].name);
    let named = groom.control.named(&groom.layer[i].hairs);
    let id: Vec<StrandId> = named
        .into_iter()
        .filter(|single| control.placed_alone(*single).is_some())
        .map(|single| strand_id(seed, single))
        .collect();
    let root: Vec<SurfacePoint> = id.iter().map(|id| control.root[by_hand(&control, *id)]).collect();
    Ok(Roots {
        uv: root.iter().map(|p| groom::view(&skin).uv(p)).collect(),
        chart: root.iter().map(|p| skin.topology.chart[p.triangle as usize]).collect(),
        root,
        id,
    })
}

fn grow(run: &mut Runner<'_>, i: usize) -> Result<Roots, Error> {
    if is_by_hand(run, i) {
        let found = roots_by_hand(run, i)?;
        return kept_roots_of(run, i, found);
    }
    let skin = groom::skin(run)?;
    let mut candidates = candidates(run, i)?;
    let layer = &run.project.groom.value.layer[i];
    let maps = density(run, i)?;
    let density = maps.view();
    let seed = layer_seed(&layer.name);
    let needed = density.needed_candidates(skin.area());
    if needed > candidates.root.len() {
        check_count(run, i, needed)?;
        run.warnings
            .push(format!("layer {}: the density map exceeds 1; candidates beyond the cached ones", layer.name));
        candidates = search(&skin, seed, needed);
    }
    let mut found = find_roots(&skin.mesh, &skin.topology, &candidates, &density, seed);
    let growing = clusters::growing(run, i, &found.root)?;
    if !growing.is_empty() {
        let name = &run.project.groom.value.layer[i].name;
        if !found.id.is_empty() && !growing.contains(&true) {
            run.warnings.push(format!(
                "layer {name}: none of its {} hairs is where `scalp.growth` and `in_clusters` let it grow",
                found.id.len()
            ));
        }
        found = kept_roots(&found, &growing);
    }
    kept_roots_of(run, i, found)
}

/// Writes roots to the cache.
fn kept_roots_of(run: &mut Runner<'_>, i: usize, found: Roots) -> Result<Roots, Error> {
    let layer = &run.project.groom.value.layer[i];
    let counts = Counts::from([
        ("hairs".to_owned(), found.id.len() as u64),
        (format!("hairs in layer {}", layer.name), found.id.len() as u64),
    ]);
    let comment = "hairs: id, root on the rest skin, texture coordinates, chart";
    let file = encode(comment, &[table("hair", roots_columns(&found))]);
    run.keep(What::Roots(i), counts, &[("data.ply", &file)])?;
    Ok(found)
}

/// Columns of hairs.
pub(super) fn roots_columns(roots: &Roots) -> Vec<(&'static str, Column)> {
    let columns = [
        id_columns(&roots.id),
        root_columns(&roots.root),
        vector_columns(["u", "v"], &roots.uv),
        vec![("chart", Column::U32(roots.chart.clone()))],
    ];
    columns.concat()
}

/// Reads them.
pub(super) fn decode_roots(bytes: &[u8]) -> Option<Roots> {
    let file = decode(bytes)?;
    let hair = file.get("hair")?;
    Some(Roots {
        root: roots_of(hair)?,
        uv: vectors_of(hair, ["u", "v"])?,
        chart: hair.u32("chart")?.to_vec(),
        id: ids_of(hair)?,
    })
}

/// Control hairs of every hair, and their weights.
pub type Weights = (Vec<[u32; 3]>, Vec<[f32; 3]>);

/// The three control hairs around every hair and their barycentric weights.
pub fn weights(run: &mut Runner<'_>, i: usize) -> Result<Weights, Error> {
    let what = What::Weights(i);
    if let Some(found) = run.fetch(what).and_then(|e| decode_weights(e.payload.first()?)) {
        return Ok(found);
    }
    if is_by_hand(run, i) {
        let (control, roots) = (comb::combed(run)?, roots(run, i)?);
        let hair: Vec<[u32; 3]> = roots.id.iter().map(|id| [by_hand(&control, *id) as u32; 3]).collect();
        let weight = vec![[1.0, 0.0, 0.0]; hair.len()];
        return keep_weights(run, what, Counts::new(), hair, weight);
    }
    let skin = groom::skin(run)?;
    let sites = groom::placed(run)?;
    let roots = roots(run, i)?;
    let triangulation = triangulate(&sites, &mirrored_charts(&skin.mesh, &skin.topology));
    let mut found = find_weights(&roots, &triangulation);
    let groom = &run.project.groom.value;
    let dividers = guides::dividers(groom);
    let layer = &groom.layer[i];
    let (choice, seed) = (layer.guides, u64::from(layer_seed(&layer.name)));
    let mut divided = 0;
    if !dividers.is_empty() {
        let control = comb::combed(run)?;
        let at = |roots: &[SurfacePoint]| roots.iter().map(|p| skin.mesh.point(p)).collect::<Vec<_>>();
        divided = respect(&dividers, &at(&roots.root), &at(&control.root), &mut found.hair, &mut found.weight);
    }
    let choice = match choice {
        GuideChoice::Blend => choose::Guides::Blend,
        GuideChoice::Nearest => choose::Guides::Nearest,
        GuideChoice::Copy => choose::Guides::Copy,
    };
    choose::choose(choice, &roots.id, seed, &mut found.hair, &mut found.weight);
    let c = triangulation.counts;
    let counts = Counts::from(
        [
            ("hairs outside the control triangulation", found.outside),
            ("hairs in charts without control hairs", found.orphans),
            ("hairs beside a divider", divided),
            ("control sites at the place of another", c.duplicates),
            ("control edges left out because they cross", c.crossing),
            ("charts with an open outline", c.open_outlines),
            ("control corners without a side of the parting", c.no_side),
        ]
        .map(|(name, n)| (name.to_owned(), n as u64)),
    );
    keep_weights(run, what, counts, found.hair, found.weight)
}

fn keep_weights(
    run: &mut Runner<'_>,
    what: What,
    counts: Counts,
    hair: Vec<[u32; 3]>,
    weight: Vec<[f32; 3]>,
) -> Result<Weights, Error> {
    let index: [Vec<u32>; 3] = std::array::from_fn(|k| hair.iter().map(|h| h[k]).collect());
    let names = ["a", "b", "c"];
    let mut columns: Vec<(&str, Column)> = names.into_iter().zip(index.map(Column::U32)).collect();
    columns.extend(vector_columns(["wa", "wb", "wc"], &weight));
    let file = encode("control hairs a, b, c of every hair and their weights", &[table("hair", columns)]);
    run.keep(what, counts, &[("data.ply", &file)])?;
    Ok((hair, weight))
}

fn decode_weights(bytes: &[u8]) -> Option<Weights> {
    let file = decode(bytes)?;
    let t = file.get("hair")?;
    let (a, b, c) = (t.u32("a")?, t.u32("b")?, t.u32("c")?);
    Some(((0..t.rows).map(|i| [a[i], b[i], c[i]]).collect(), vectors_of(t, ["wa", "wb", "wc"])?))
}

fn feature_map(run: &mut Runner<'_>, f: &Feature) -> Result<Option<TiledMap>, Error> {
    f.map().map(|m| run.map(&m, Texel::Value)).transpose()
}

/// A column of one number per hair: length in scene units, root diameter in micrometres, opacity.
pub fn column(run: &mut Runner<'_>, what: What, i: usize) -> Result<Vec<f32>, Error> {
    let name = match what {
        What::Length(_) => "length",
        What::Width(_) => "width",
        _ => "opacity",
    };
    let read = |bytes: &Vec<u8>| Some(decode(bytes)?.get("hair")?.f32(name)?.to_vec());
    if let Some(found) = run.fetch(what).and_then(|e| read(e.payload.first()?)) {
        return Ok(found);
    }
    let roots = roots(run, i)?;
    let mut values = feature(run, what, i, &roots)?;
    if matches!((what, hairs_of(run.project, i)), (What::Width(_), What::Kept(_))) {
        let wider = kept::kept_hairs(run, i)?.wider;
        values.iter_mut().zip(wider).for_each(|(w, wider)| *w *= wider);
    }
    let file = encode(&format!("{name} of every hair"), &[table("hair", vec![(name, Column::F32(values.clone()))])]);
    run.keep(what, Counts::new(), &[("data.ply", &file)])?;
    Ok(values)
}

/// A column of one number for some of a layer's hairs.
pub(super) fn feature(run: &mut Runner<'_>, what: What, i: usize, roots: &Roots) -> Result<Vec<f32>, Error> {
    let layer = &run.project.groom.value.layer[i];
    let guard = |factor: fn(&Guard) -> f64| layer.guard.as_ref().map(|g| factor(g) as f32);
    let (name, feature, guard) = match what {
        What::Length(_) => ("length", layer.length.clone(), guard(|g| g.length)),
        What::Width(_) => ("width", layer.width.feature(), guard(|g| g.width)),
        What::Opacity(_) => ("opacity", layer.opacity.clone(), None),
        other => unreachable!("{other:?} is not a column"),
    };
    let map = feature_map(run, &feature)?;
    let source = FeatureSource {
        value: feature.value as f32,
        map: map.as_ref(),
        noise: feature.noise as f32,
        channel: rng::channel(name),
    };
    let seed = u64::from(layer_seed(&layer.name));
    let mut values = feature_column(roots, &source, seed);
    if name == "length" && is_by_hand(run, i) {
        let control = comb::combed(run)?;
        let own = |id: &StrandId| control.length(by_hand(&control, *id)) as f32;
        values.iter_mut().zip(&roots.id).for_each(|(value, id)| *value *= own(id));
    }
    if let Some(factor) = guard {
        scale_guard_hairs(run, i, roots, factor, &mut values)?;
    }
    Ok(values)
}

/// Multiplies what some of a layer's hairs have by a factor where they are guard hairs.
pub(super) fn scale_guard_hairs(
    run: &mut Runner<'_>,
    i: usize,
    roots: &Roots,
    by: f32,
    values: &mut [f32],
) -> Result<(), Error> {
    let layer = &run.project.groom.value.layer[i];
    let (percent, seed) = match &layer.guard {
        Some(guard) => (&guard.percent, u64::from(layer_seed(&layer.name))),
        None => return Ok(()),
    };
    let mut position = Vec::new();
    if !percent.0.vary.is_empty() {
        position = groom::places(&*groom::skin(run)?, &roots.root).1;
    }
    let hairs = Drawn { id: &roots.id, uv: &roots.uv, position: &position, seed };
    let factor = clumps::column(run, &hairs, "guard.percent", percent, false)?;
    scale_guards(values, roots, Amount { value: percent.at(0.0), factor: &factor }, by, seed);
    Ok(())
}

/// Linear colour of every hair.
pub fn color(run: &mut Runner<'_>, i: usize) -> Result<Vec<[f32; 3]>, Error> {
    let what = What::Color(i);
    let read = |bytes: &Vec<u8>| vectors_of(decode(bytes)?.get("hair")?, ["r", "g", "b"]);
    if let Some(found) = run.fetch(what).and_then(|e| read(e.payload.first()?)) {
        return Ok(found);
    }
    let roots = roots(run, i)?;
    let color = &run.project.groom.value.layer[i].color;
    let map = color.map();
    let map = map.map(|m| run.map(&m, Texel::Color)).transpose()?;
    let value = color.value.map(|x| x as f32);
    let seed = u64::from(layer_seed(&run.project.groom.value.layer[i].name));
    let values = colour_column(&roots, value, map.as_ref(), color.noise as f32, rng::channel("color"), seed);
    let file = encode("linear colour of every hair", &[table("hair", vector_columns(["r", "g", "b"], &values))]);
    run.keep(what, Counts::new(), &[("data.ply", &file)])?;
    Ok(values)
}
