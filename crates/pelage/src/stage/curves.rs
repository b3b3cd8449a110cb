//! Hair from a curves file: read, named, and bound to the skin if there is one. It stands in for groom and instance.

use super::run::{Counts, Runner};
use super::tables::{decode, encode, id_columns, ids_of, root_columns, roots_of, table, vector_columns, vectors_of};
use super::{Skin, What, groom, interpolate};
use crate::Error;
use crate::curves::{self, CurveFile};
use crate::format::ply::Column;
use crate::format::{FormatError, HairLayer};
use crate::timeline::Timeline;
use pelage_geom::curve::resample;
use pelage_geom::ride::{Ride, carry, rides};
use pelage_geom::{Offsets, SurfacePoint, Vec3};
use pelage_groom::along::point_widths;
use rayon::prelude::*;
use std::rc::Rc;

/// Positions are kept relative to the middle of the hair where it is this many times its size from the scene's origin,
/// as for skins.
const FAR: f64 = 100.0;

/// Curves of a file as hair at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveHair {
    /// Runs of points.
    pub offsets: Offsets,
    /// Scene-space point that positions are relative to.
    pub origin: [f64; 3],
    /// Points, scene units relative to the origin, root first.
    pub position: Vec<[f32; 3]>,
    /// Diameters, one a point, scene units; empty if the file has none.
    pub width: Vec<f32>,
    /// Stable names.
    pub id: Vec<u64>,
    /// Texture coordinates of the roots.
    pub uv: Vec<[f32; 2]>,
    /// Closest points of the skin to the roots; empty without a skin.
    pub root: Vec<SurfacePoint>,
}

impl CurveHair {
    /// First points in the scene.
    pub fn anchors(&self) -> Vec<[f64; 3]> {
        let first = |h: usize| self.position[self.offsets.range(h).start];
        (0..self.offsets.len()).map(|h| self.scene(&first(h))).collect()
    }

    /// A point in the scene.
    pub fn scene(&self, p: &[f32; 3]) -> [f64; 3] {
        std::array::from_fn(|x| f64::from(p[x]) + self.origin[x])
    }
}

/// The hair of the curves file.
pub fn hair(run: &mut Runner<'_>) -> Result<Rc<CurveHair>, Error> {
    if let Some(found) = &run.curves {
        return Ok(found.clone());
    }
    let found = match run.fetch(What::Curves).and_then(|e| read_table(e.payload.first()?)) {
        Some(found) => found,
        None => bind(run)?,
    };
    let found = Rc::new(found);
    run.curves = Some(found.clone());
    Ok(found)
}

fn bind(run: &mut Runner<'_>) -> Result<CurveHair, Error> {
    let file = run.project.curves.clone().expect("a shot with curves");
    let read = curves::read(&file.path, None)?;
    run.warnings.extend(read.warnings.iter().map(|w| format!("{}: {w}", file.label)));
    let unit = run.project.shot.value.shot.meters_per_unit;
    if let Some(other) = read.meters_per_unit.filter(|m| (m / unit - 1.0).abs() > 1e-6) {
        let text = format!("{}: it says {other} m per unit, the shot {unit}: taken as scene units", file.label);
        run.warnings.push(text);
    }
    let mut hair = joined(&read);
    check(&hair, &file.path)?;
    let doubled = doubled_points(&hair);
    if doubled > 0 {
        run.warnings.push(format!("{}: {doubled} points lie at the place of the point before them", file.label));
    }
    if run.project.rest.is_some() {
        let skin = groom::skin(run)?;
        hair = on_skin(hair, &skin, run, unit);
    }
    let n = hair.offsets.len() as u64;
    let counts = Counts::from([
        ("hairs".to_owned(), n),
        ("points of the curves file".to_owned(), hair.position.len() as u64),
        ("points at the place of the one before".to_owned(), doubled),
    ]);
    run.keep(What::Curves, counts, &[("data.ply", &write_table(&hair))])?;
    Ok(hair)
}

/// All primitives of a file as one list; ids where the file has distinct ones, else their order.
fn joined(file: &CurveFile) -> CurveHair {
    let layers = &file.layers;
    let counts = layers.iter().flat_map(|l| l.strands.offsets.counts());
    let mut hair = CurveHair { offsets: Offsets::from_counts(counts), ..CurveHair::default() };
    let n = hair.offsets.len();
    let bounds = layers.iter().flat_map(|l| {
        let o = l.strands.origin;
        l.strands.position.iter().map(move |p| std::array::from_fn::<f64, 3, _>(|x| f64::from(p[x]) + o[x]))
    });
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in bounds {
        (0..3).for_each(|x| (low[x], high[x]) = (low[x].min(p[x]), high[x].max(p[x])));
    }
    let middle: [f64; 3] = std::array::from_fn(|x| 0.5 * (low[x] + high[x]));
    let size = (Vec3::from(high) - Vec3::from(low)).norm();
    hair.origin = if Vec3::from(middle).norm() > FAR * size { middle } else { [0.0; 3] };
    for l in layers {
        let shift: [f64; 3] = std::array::from_fn(|x| l.strands.origin[x] - hair.origin[x]);
        let placed = |p: &[f32; 3]| std::array::from_fn(|x| (f64::from(p[x]) + shift[x]) as f32);
        hair.position.extend(l.strands.position.iter().map(placed));
        hair.width.extend(&l.width);
        hair.uv.extend(&l.strands.root_uv);
        hair.id.extend(&l.strands.id);
    }
    if hair.width.len() != hair.position.len() {
        hair.width.clear();
    }
    if hair.uv.len() != n {
        hair.uv = vec![[0.0; 2]; n];
    }
    let mut sorted = hair.id.clone();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.len() != n || sorted.last().is_some_and(|id| id >> 63 != 0) {
        hair.id = (0..n as u64).collect();
    }
    hair
}

fn check(hair: &CurveHair, path: &std::path::Path) -> Result<(), Error> {
    for h in 0..hair.offsets.len() {
        for (k, i) in hair.offsets.range(h).enumerate() {
            if !hair.position[i].iter().all(|x| x.is_finite()) {
                let what = "the position is not a finite number";
                return Err(FormatError::new(path, what).at(format!("curve {h}, point {k}")).into());
            }
        }
    }
    if hair.offsets.is_empty() {
        return Err(FormatError::new(path, "holds no curves of two or more points").into());
    }
    Ok(())
}

fn doubled_points(hair: &CurveHair) -> u64 {
    let of = |h: usize| hair.position[hair.offsets.range(h)].windows(2).filter(|w| w[0] == w[1]).count() as u64;
    (0..hair.offsets.len()).map(of).sum()
}

/// Roots bound to the closest points of the skin. Curves stay where they are: a root keeps its place relative to the skin.
fn on_skin(hair: CurveHair, skin: &Skin, run: &mut Runner<'_>, unit: f64) -> CurveHair {
    let bvh = skin.bvh();
    let near = |p: [f64; 3]| bvh.closest(Vec3::from(p), f64::INFINITY).expect("a skin has triangles");
    let found: Vec<_> = hair.anchors().into_par_iter().map(near).collect();
    let distance = found.iter().map(|c| c.signed_distance.abs() * unit * 1e3);
    let (mean, most) = (distance.clone().sum::<f64>() / found.len() as f64, distance.fold(0.0, f64::max));
    run.warnings.push(format!("roots are {mean:.2} mm from the skin on average, {most:.2} mm at most"));
    let root: Vec<SurfacePoint> = found.iter().map(|c| c.point).collect();
    let origin = skin.origin();
    let move_origin = |p: &[f32; 3]| std::array::from_fn(|x| (f64::from(p[x]) + hair.origin[x] - origin[x]) as f32);
    let position = hair.position.iter().map(move_origin).collect();
    let uv = root.iter().map(|p| skin.mesh.uv(p)).collect();
    CurveHair { position, origin, uv, root, ..hair }
}

fn write_table(hair: &CurveHair) -> Vec<u8> {
    let counts = Column::U32(hair.offsets.counts().map(|n| n as u32).collect());
    let mut columns = [vec![("count", counts)], id_columns(&hair.id), vector_columns(["u", "v"], &hair.uv)].concat();
    if !hair.root.is_empty() {
        columns.extend(root_columns(&hair.root));
    }
    let mut points = vector_columns(["x", "y", "z"], &hair.position);
    if !hair.width.is_empty() {
        points.push(("width", Column::F32(hair.width.clone())));
    }
    let origin = ["x", "y", "z"].into_iter().zip(hair.origin).map(|(n, x)| (n, Column::F64(vec![x]))).collect();
    encode(
        "curves: hairs with their number of points, ids, roots on the rest skin; points relative to the origin, root first",
        &[table("hair", columns), table("point", points), table("origin", origin)],
    )
}

fn read_table(bytes: &[u8]) -> Option<CurveHair> {
    let file = decode(bytes)?;
    let (hair, point, origin) = (file.get("hair")?, file.get("point")?, file.get("origin")?);
    let coordinate = |name: &str| match origin.column(name)? {
        Column::F64(v) => v.first().copied(),
        _ => None,
    };
    Some(CurveHair {
        offsets: Offsets::from_counts(hair.u32("count")?.iter().map(|n| *n as usize)),
        origin: [coordinate("x")?, coordinate("y")?, coordinate("z")?],
        position: vectors_of(point, ["x", "y", "z"])?,
        width: point.f32("width").unwrap_or_default().to_vec(),
        id: ids_of(hair)?,
        uv: vectors_of(hair, ["u", "v"])?,
        root: roots_of(hair).unwrap_or_default(),
    })
}

/// Points of every hair in the finished frames.
pub fn offsets(run: &mut Runner<'_>) -> Result<Offsets, Error> {
    let hair = hair(run)?;
    let segments = run.project.shot.value.simulate.segments;
    Ok(segments.map_or_else(|| hair.offsets.clone(), |s| Offsets::uniform(hair.offsets.len(), s + 1)))
}

/// Hairs at rest with the points of the finished frames.
pub fn rest(run: &mut Runner<'_>) -> Result<Vec<[f32; 3]>, Error> {
    let hair = hair(run)?;
    let Some(segments) = run.project.shot.value.simulate.segments else { return Ok(hair.position.clone()) };
    let hair: &CurveHair = &hair;
    let sampled = |h: usize| {
        let points: Vec<Vec3> =
            hair.position[hair.offsets.range(h)].iter().map(|p| Vec3::from(p.map(f64::from))).collect();
        resample(&points, segments + 1).into_iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect::<Vec<_>>()
    };
    Ok((0..hair.offsets.len()).into_par_iter().flat_map_iter(sampled).collect())
}

/// Hairs at a frame that nothing is simulated at: each rides its root as it is.
pub fn ridden(run: &mut Runner<'_>, frame: i32) -> Result<Vec<[f32; 3]>, Error> {
    let (hair, offsets) = (hair(run)?, offsets(run)?);
    let mut points = interpolate::positions(run, What::Rest(0))?;
    let anchor = hair.anchors();
    let timeline = Timeline::new(run.project);
    let rides = match timeline.rigid(timeline.first, f64::from(frame)) {
        Some(t) => {
            anchor.iter().map(|a| Ride { position: t.apply(Vec3::from(*a)).into(), rotation: t.rotation }).collect()
        }
        None => {
            let skin = groom::skin(run)?;
            let pose = skin.pose(&run.project.frames[&frame])?;
            rides(&skin.mesh, &skin.topology, &skin.rest, &pose, &hair.root, &anchor)
        }
    };
    carry(&offsets, hair.origin, &anchor, &rides, &mut points);
    Ok(points)
}

/// The hair as exported, without positions.
pub fn look(run: &mut Runner<'_>) -> Result<HairLayer, Error> {
    let (hair, offsets) = (hair(run)?, offsets(run)?);
    let layer = &run.project.groom.value.layer[0];
    let unit_per_micrometre = (1e-6 / run.project.shot.value.shot.meters_per_unit) as f32;
    let width_of = |h: usize| {
        let n = offsets.range(h).len();
        let own = &hair.width[hair.offsets.range(h)];
        (0..n).map(move |k| along(own, k as f32 / (n - 1).max(1) as f32))
    };
    let width = if hair.width.is_empty() {
        let root = vec![layer.width.value as f32 * unit_per_micrometre; offsets.len()];
        point_widths(&root, &offsets, &layer.width.stations())
    } else {
        (0..offsets.len()).flat_map(width_of).collect()
    };
    let faces = |skin: &Skin| hair.root.iter().map(|p| skin.mesh.face[p.triangle as usize] as i32).collect();
    let skin = if hair.root.is_empty() { None } else { Some(groom::skin(run)?) };
    let color = layer.color.value.map(|x| x as f32);
    Ok(HairLayer {
        name: layer.name.clone(),
        width,
        skin_face: skin.as_deref().map(faces).unwrap_or_default(),
        skin_bary: hair.root.iter().map(|p| p.bary).collect(),
        id: hair.id.clone(),
        root_uv: hair.uv.clone(),
        rest: Vec::new(),
        color: vec![color; offsets.len()],
        opacity: vec![1.0; offsets.len()],
        offsets,
    })
}

/// Value at fraction `t` of a list, linear between entries.
fn along(values: &[f32], t: f32) -> f32 {
    let at = t * (values.len() - 1) as f32;
    let i = (at as usize).min(values.len().saturating_sub(2));
    let next = values[(i + 1).min(values.len() - 1)];
    values[i] + (next - values[i]) * (at - i as f32)
}
