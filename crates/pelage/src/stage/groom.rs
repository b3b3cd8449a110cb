//! Groom: control hairs placed on the rest skin and combed.

use super::run::{Counts, Runner};
use super::skin::Texel;
use super::tables::{decode, encode, table, vector_columns, vectors_of};
use super::{Skin, SkinPose, What};
use crate::Error;
use crate::config::LookValue;
use crate::curves;
use crate::format::ply;
use crate::project::SkinAt;
use pelage_geom::{Offsets, SurfacePoint, Vec3};
use pelage_groom::candidates::{candidates, rank};
use pelage_groom::control::{self, ControlHairs, PartingPiece, Sites};
use pelage_groom::look::member::rest_sites;
use pelage_groom::place::{Line, PlaceSettings, Placement, Single, place};
use std::rc::Rc;

/// Seed of the blue-noise roots of control hairs; no layer's seed has the upper half set.
pub(super) const CONTROL_SEED: u64 = 1 << 32;

/// Control hairs are combed by a person: more of them are a mistake of units.
const MAX_CONTROL: usize = 1_000_000;

/// The rest skin, read once a run.
pub fn skin(run: &mut Runner<'_>) -> Result<Rc<Skin>, Error> {
    if let Some(found) = &run.skin {
        return Ok(found.clone());
    }
    let read = Rc::new(Skin::read(run.project)?);
    run.warnings.extend(read.warnings.iter().cloned());
    run.skin = Some(read.clone());
    Ok(read)
}

/// Where control hairs stand in texture space.
pub fn placed(run: &mut Runner<'_>) -> Result<Sites, Error> {
    let found = run.fetch(What::Place).and_then(|e| decode_sites(e.payload.first()?));
    if let Some(sites) = found {
        return Ok(sites);
    }
    let (hairs, sites, counts) = place_hairs(run)?;
    let file = encode(
        "sites of control hairs: chart, u, v, left and right hair; borders; partings",
        &[
            table(
                "site",
                [
                    vec![("chart", ply::Column::U32(sites.chart.clone()))],
                    vector_columns(["u", "v"], &sites.uv),
                    pair_columns(["left", "right"], &sites.hair),
                ]
                .concat(),
            ),
            table("border", pair_columns(["a", "b"], &sites.border_edges)),
            table(
                "piece",
                vec![
                    ("parting", ply::Column::U32(sites.partings.iter().map(|p| p.parting).collect())),
                    ("chart", ply::Column::U32(sites.partings.iter().map(|p| p.chart).collect())),
                    ("count", ply::Column::U32(sites.partings.iter().map(|p| p.site.len() as u32).collect())),
                ],
            ),
            table(
                "piece_site",
                vec![("site", ply::Column::U32(sites.partings.iter().flat_map(|p| p.site.clone()).collect()))],
            ),
        ],
    );
    run.keep(What::Place, counts, &[("data.ply", &file)])?;
    run.placed = Some(hairs);
    Ok(sites)
}

fn pair_columns(names: [&'static str; 2], pairs: &[[u32; 2]]) -> Vec<(&'static str, ply::Column)> {
    (0..2).map(|x| (names[x], ply::Column::U32(pairs.iter().map(|p| p[x]).collect()))).collect()
}

fn pairs_of(t: &ply::Table, names: [&str; 2]) -> Option<Vec<[u32; 2]>> {
    let (a, b) = (t.u32(names[0])?, t.u32(names[1])?);
    Some(a.iter().zip(b).map(|(a, b)| [*a, *b]).collect())
}

fn decode_sites(bytes: &[u8]) -> Option<Sites> {
    let file = decode(bytes)?;
    let (site, border) = (file.get("site")?, file.get("border")?);
    let (piece, member) = (file.get("piece")?, file.get("piece_site")?.u32("site")?);
    let offsets = Offsets::from_counts(piece.u32("count")?.iter().map(|n| *n as usize));
    let (parting, chart) = (piece.u32("parting")?, piece.u32("chart")?);
    let part = |i: usize| {
        Some(PartingPiece { parting: parting[i], chart: chart[i], site: member.get(offsets.range(i))?.to_vec() })
    };
    Some(Sites {
        chart: site.u32("chart")?.to_vec(),
        uv: vectors_of(site, ["u", "v"])?,
        hair: pairs_of(site, ["left", "right"])?,
        border_edges: pairs_of(border, ["a", "b"])?,
        partings: (0..offsets.len()).map(part).collect::<Option<_>>()?,
    })
}

/// Places control hairs at their length before combing.
pub(super) fn place_hairs(run: &mut Runner<'_>) -> Result<(ControlHairs, Sites, Counts), Error> {
    let skin = skin(run)?;
    let groom = &run.project.groom.value;
    let (_, length) = run.project.control_length();
    let length_map = length.map().map(|m| run.map(&m, Texel::Value)).transpose()?;
    let partings: Vec<Vec<Vec3>> = partings(run);
    let p = &groom.control.placement;
    let per_unit2 = p.per_cm2.as_ref().map_or(0.0, |d| d.at(0.0)) * run.project.cm2_per_unit2();
    let root: Vec<SurfacePoint> = match &p.per_cm2 {
        Some(density) => {
            let count = (per_unit2 * skin.area()).round() as usize;
            if count > MAX_CONTROL {
                let what = format!("asks for {count} control hairs on this skin, at most {MAX_CONTROL} are placed");
                let help = "lower it, or check shot.meters_per_unit";
                return Err(run.project.groom.error("control.placement.per_cm2", what, help).into());
            }
            let root = candidates(&skin.mesh, &skin.topology, CONTROL_SEED, count, &mut |_| true)
                .map(|c| c.root)
                .unwrap_or_default();
            thinned(run, &skin, density, root)?
        }
        None => Vec::new(),
    };
    let drawn =
        run.project.drawn.as_ref().map(|f| Ok::<_, Error>(curves::read(&f.path, None)?.joined())).transpose()?;
    // Partings and drawn hairs keep the distance that the density asks for, or half a centimetre.
    let half_cm = 0.5 / run.project.cm2_per_unit2().sqrt();
    let spacing = if per_unit2 > 0.0 { (0.5 / per_unit2.sqrt()).min(2.0 * half_cm) } else { half_cm };
    let placement = match (&drawn, p.grid, &p.per_cm2) {
        (Some(drawn), ..) => Placement::Curves { drawn, spacing: 0.1 * half_cm },
        (None, Some([u, v]), _) => Placement::Grid { u, v, even: p.even },
        (None, None, Some(_)) => Placement::PerArea { density: per_unit2, root: &root },
        (None, None, None) => Placement::None,
    };
    let points = |p: &[[f64; 3]]| p.iter().map(|q| Vec3::from(*q)).collect::<Vec<_>>();
    let lines: Vec<Line> =
        groom.control.line.iter().map(|l| Line { points: points(&l.points), count: l.count }).collect();
    let single: Vec<Single> = groom
        .control
        .hair
        .iter()
        .map(|h| Single {
            at: h.root.into(),
            line: h.points.as_ref().map(|p| [vec![Vec3::from(h.root)], points(p)].concat()),
        })
        .collect();
    let settings = PlaceSettings {
        placement,
        lines: &lines,
        single: &single,
        relax: p.relax,
        points: groom.control.points,
        length: length.value,
        length_map: length_map.as_ref(),
        partings: &partings,
        parting_spacing: spacing,
    };
    let (hairs, sites, c) = place(&view(&skin), skin.bvh(), &settings);
    let mut counts = Counts::new();
    for (name, n) in [
        ("control hairs", hairs.len()),
        ("control hairs on chart borders", c.border),
        ("control hairs on partings", c.partings.hairs),
        ("control hairs on lines", c.on_lines),
        ("control hairs one by one", c.single),
        ("control hairs too near to others", c.dropped),
        ("drawn hairs without length", c.skipped_short),
    ] {
        counts.insert(name.to_owned(), n as u64);
    }
    for (i, parting) in groom.parting.iter().enumerate() {
        if !sites.partings.iter().any(|p| p.parting as usize == i) {
            run.warnings.push(format!("parting {} has no length on the skin and does nothing", parting.name));
        }
    }
    if c.lines_cut_short + c.lines_skipped > 0 {
        let n = c.lines_cut_short + c.lines_skipped;
        run.warnings
            .push(format!("{n} lines of control hairs stop at a gap or border of the skin, or have no length on it"));
    }
    if c.single_straight > 0 {
        run.warnings
            .push(format!("{} control hairs have points without a length and stand straight", c.single_straight));
    }
    if c.partings.cut_short > 0 {
        run.warnings.push(format!("{} partings stop at a gap or border of the skin", c.partings.cut_short));
    }
    if drawn.is_some() {
        let unit = run.project.shot.value.shot.meters_per_unit * 1e3;
        let (mean, max) = (c.bind_mean * unit, c.bind_max * unit);
        run.warnings
            .push(format!("drawn hairs were moved onto the skin by {mean:.2} mm on average, {max:.2} mm at most"));
    }
    Ok((hairs, sites, counts))
}

/// The candidates, in their order, whose rank is below what a density's map says there; one without a map leaves them all.
fn thinned(
    run: &mut Runner<'_>,
    skin: &Skin,
    density: &LookValue,
    root: Vec<SurfacePoint>,
) -> Result<Vec<SurfacePoint>, Error> {
    let Some(map) = density.map().map(|m| run.map(&m, Texel::Value)).transpose()? else { return Ok(root) };
    let (view, all) = (view(skin), root.len() as f64);
    let grows = |k: usize, p: &SurfacePoint| rank(k as u64) < f64::from(map.value(view.uv(p))) * all;
    Ok(root.into_iter().enumerate().filter(|(k, p)| grows(*k, p)).map(|(_, p)| p).collect())
}

/// The skin at a moment. Layers and stages ask for the same one after another: the last is kept.
pub fn pose(run: &mut Runner<'_>, at: &SkinAt) -> Result<Rc<SkinPose>, Error> {
    if let Some((_, pose)) = run.pose.as_ref().filter(|(last, _)| last == at) {
        return Ok(pose.clone());
    }
    let pose = Rc::new(skin(run)?.pose(at)?);
    run.pose = Some((at.clone(), pose.clone()));
    Ok(pose)
}

/// Texture coordinates of roots, and where they stand at rest: what their numbers are drawn by.
pub(super) fn places(skin: &Skin, roots: &[SurfacePoint]) -> (Vec<[f32; 2]>, Vec<[f32; 3]>) {
    let view = view(skin);
    (roots.iter().map(|p| view.uv(p)).collect(), rest_sites(&view, roots, skin.origin()).0)
}

pub(super) fn view(skin: &Skin) -> control::Skin<'_> {
    control::Skin { mesh: &skin.mesh, topology: &skin.topology, rest: &skin.rest }
}

pub(super) fn partings(run: &Runner<'_>) -> Vec<Vec<Vec3>> {
    let groom = &run.project.groom.value;
    groom.parting.iter().map(|p| p.points.iter().map(|q| Vec3::from(*q)).collect()).collect()
}
