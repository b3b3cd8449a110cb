//! Groom: control hairs combed on the rest skin.

use super::What;
use super::clumps::column;
use super::groom::{CONTROL_SEED, partings, place_hairs, places, skin, view};
use super::guides;
use super::run::{Counts, Runner};
use super::skin::Texel;
use super::tables::{self, decode, encode, root_columns, roots_of, table, vector_columns, vectors_of};
use crate::Error;
use crate::config::{Comb, CombKind as Kind, LookValue, Side, Space};
use crate::format::ply;
use pelage_geom::{Bvh, TiledMap, Topology, Vec3};
use pelage_groom::comb::{Amount, CombKind, CombOp, DirectionSpace, Guides, Handle, comb};
use pelage_groom::control::ControlHairs;
use pelage_groom::field::lengths::Shear;
use pelage_groom::flow::trace::{Guard, Start};
use pelage_groom::look::vary::Drawn;
use pelage_groom::push_up::{PushUp, push_up};
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// Control hairs after combing, at rest.
pub fn combed(run: &mut Runner<'_>) -> Result<Rc<ControlHairs>, Error> {
    if let Some(found) = &run.control {
        return Ok(found.clone());
    }
    let hairs = Rc::new(hairs(run, What::Comb)?);
    run.control = Some(hairs.clone());
    Ok(hairs)
}

/// Control hairs after combing, at a frame.
pub fn combed_at(run: &mut Runner<'_>, frame: i32) -> Result<Rc<ControlHairs>, Error> {
    match &run.control_at {
        Some((at, found)) if *at == frame => Ok(found.clone()),
        _ => {
            let found = Rc::new(hairs(run, What::CombAt(frame))?);
            run.control_at = Some((frame, found.clone()));
            Ok(found)
        }
    }
}

fn hairs(run: &mut Runner<'_>, what: What) -> Result<ControlHairs, Error> {
    match run.fetch(what).and_then(|e| decode_hairs(e.payload.first()?)) {
        Some(found) => Ok(found),
        None => comb_hairs(run, what),
    }
}

fn comb_hairs(run: &mut Runner<'_>, what: What) -> Result<ControlHairs, Error> {
    let mut hairs = match run.placed.clone() {
        Some(hairs) => hairs,
        None => {
            let placed = place_hairs(run)?.0;
            run.placed.insert(placed).clone()
        }
    };
    let skin = skin(run)?;
    let project = run.project;
    let combs = &project.shape(what.comb_frame()).comb;
    let lines = partings(run);
    let id: Vec<u64> = (0..hairs.len() as u64).collect();
    let (uv, position) = places(&skin, &hairs.root);
    let drawn = Drawn { id: &id, uv: &uv, position: &position, seed: CONTROL_SEED };
    let read = combs.iter().enumerate().map(|(i, c)| Read::new(run, i, c, &drawn)).collect::<Result<Vec<_>, _>>()?;
    let control = &project.groom.value.control;
    let millimetre = 1e-3 / project.shot.value.shot.meters_per_unit;
    let clearance = control.clearance * millimetre;
    let guard = Guard { surface: skin.bvh(), clearance };
    let (guides, points) = (guides::guides(run, what.comb_frame(), combs, &hairs, &drawn)?, hairs.points);
    let trace: Vec<_> =
        guides.iter().map(|g| g.as_ref().map(|g| |starts: &[Start]| g.lines(points, &guard, starts))).collect();
    let ops: Vec<CombOp<'_>> = combs
        .iter()
        .enumerate()
        .map(|(i, c)| operation(run, c, &read[i], trace[i].as_ref().map(|t| Guides(t))))
        .collect();
    let done = comb(&view(&skin), &lines, &ops, &mut hairs);
    let idle = |c: &Comb| c.kind == Kind::Mirror && c.weight.at(0.0) > 0.0;
    for (i, _) in combs.iter().zip(&done).enumerate().filter(|(_, (c, d))| idle(c) && d.combed == 0) {
        run.warn_once(format!("comb[{i}] mirrors no hair: there is none on one side of its plane"));
    }
    let mut counts = Counts::from([
        ("control hairs combed".to_owned(), done.iter().map(|c| c.combed).max().unwrap_or(0) as u64),
        ("control hairs without a painted direction".to_owned(), done.iter().map(|c| c.unpainted as u64).sum()),
    ]);
    if control.push_up && control.clearance > 0.0 {
        let settings = PushUp { step: millimetre, clearance };
        let pushed = push_up(&view(&skin), skin.bvh(), &settings, &mut hairs);
        for (name, n) in [
            ("control hairs pushed out of the skin", pushed.pushed),
            ("control hairs pushed past the normal", pushed.escaped),
            ("control hairs that could not be cleared", pushed.uncleared),
        ] {
            counts.insert(name.to_owned(), n as u64);
        }
    }
    run.keep(what, counts, &[("data.ply", &encode_hairs(&hairs))])?;
    Ok(hairs)
}

/// What an operation reads besides its numbers.
struct Read {
    region: Option<TiledMap>,
    map: Option<TiledMap>,
    shear: Option<Shear>,
    /// What trims hair.
    trim: Option<Bvh>,
    /// Numbers of the hairs that it acts on.
    only: Option<Vec<u32>>,
    /// Factors on its numbers from hair to hair, by key.
    factor: BTreeMap<&'static str, Vec<f32>>,
}

impl Read {
    fn new(run: &mut Runner<'_>, i: usize, c: &Comb, hairs: &Drawn<'_>) -> Result<Read, Error> {
        let texel = if c.kind == Kind::DirectionMap { Texel::Direction } else { Texel::Value };
        let mut factor = BTreeMap::new();
        for (key, v) in c.varied() {
            factor.insert(key, column(run, hairs, &format!("comb[{i}].{key}"), v, false)?);
        }
        Ok(Read {
            region: c.region.as_ref().map(|m| run.map(m, Texel::Value)).transpose()?,
            map: c.map.as_ref().map(|m| run.map(m, texel)).transpose()?,
            shear: c.shear.as_ref().map(guides::shear),
            trim: run.project.trims.get(&i).map(|f| trimmer(&f.path)).transpose()?,
            only: c.hairs.as_ref().map(|names| run.project.groom.value.control.named(names)),
            factor,
        })
    }

    /// A number of the operation.
    fn amount(&self, key: &str, v: Option<&LookValue>, default: f64) -> Amount<'_> {
        Amount { value: v.map_or(default, |v| v.at(0.0)), factor: self.factor.get(key).map_or(&[], Vec::as_slice) }
    }
}

fn trimmer(path: &Path) -> Result<Bvh, Error> {
    let mesh = ply::read_mesh(path)?.mesh;
    Ok(Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(&mesh)))
}

fn operation<'a>(run: &Runner<'_>, c: &Comb, read: &'a Read, guides: Option<Guides<'a>>) -> CombOp<'a> {
    let curvature = read.amount("curvature", Some(&c.curvature), 0.0);
    let bend = read.amount("bend", c.bend.as_ref(), 1.0);
    let radius = read.amount("radius", c.radius.as_ref(), f64::INFINITY);
    let falloff = read.amount("falloff", c.falloff.as_ref(), 1.0);
    let map = read.map.as_ref();
    let kind = match c.kind {
        Kind::DirectionCurve => CombKind::DirectionCurve {
            points: c.points.iter().flatten().map(|p| Vec3::from(*p)).collect(),
            radius,
            falloff,
            bend,
            curvature,
        },
        Kind::DirectionMap => CombKind::DirectionMap {
            map: map.expect("checked: the operation has a map"),
            space: match c.space.unwrap_or_default() {
                Space::Root => DirectionSpace::Root,
                Space::World => DirectionSpace::World,
            },
            bend,
            curvature,
        },
        Kind::Bend => CombKind::Bend { angle: read.amount("angle", c.angle.as_ref(), 0.0), map, curvature },
        Kind::LayDown => CombKind::LayDown { amount: read.amount("amount", c.amount.as_ref(), 0.0), map },
        Kind::Field | Kind::Flow | Kind::Cluster => {
            CombKind::Follow { guides: guides.expect("made for these kinds"), bend, curvature }
        }
        Kind::Smooth => CombKind::Smooth { control: c.control_points.unwrap_or(4), bend, curvature },
        Kind::Cut if !c.key.is_empty() => CombKind::Keys {
            centre: c.scalp.map_or(Vec3::zeros(), |b| b.centre.into()),
            key: c.key.iter().map(|k| (Vec3::from(k.at), k.length)).collect(),
        },
        Kind::Cut => CombKind::Cut {
            shear: read.shear.as_ref().expect("checked: a cut has its planes"),
            scalp: c.scalp.as_ref().map(guides::ball),
        },
        Kind::Trim => CombKind::Trim { surface: read.trim.as_ref().expect("checked: a trim has its mesh") },
        Kind::Length => CombKind::Length { value: read.amount("value", c.value.as_ref(), 1.0), map },
        Kind::Chain => {
            let control = &run.project.groom.value.control;
            let handle = match c.hair.as_ref().and_then(|n| control.named(std::slice::from_ref(n)).first().copied()) {
                Some(k) => Handle::Single(k),
                None => Handle::Nearest(c.at.unwrap_or_default().into()),
            };
            CombKind::Chain {
                handle,
                turn: c.turn.iter().map(|t| (t.joint, t.turn.into())).collect(),
                reach: c.reach.map(Vec3::from),
                radius,
                falloff,
            }
        }
        Kind::Mirror => {
            let plane = c.plane.expect("checked: a mirror has its plane");
            CombKind::Mirror { point: plane.point.into(), normal: plane.normal.into() }
        }
    };
    let parting = |name: &String| run.project.groom.value.parting.iter().position(|p| p.name == *name);
    let side = match (c.parting.as_ref().and_then(parting), c.side) {
        (Some(p), Some(Side::Left)) => Some((p as u32, 1)),
        (Some(p), Some(Side::Right)) => Some((p as u32, -1)),
        _ => None,
    };
    let weight = read.amount("weight", Some(&c.weight), 1.0);
    CombOp { kind, weight, region: read.region.as_ref(), side, only: read.only.as_deref() }
}

fn encode_hairs(hairs: &ControlHairs) -> Vec<u8> {
    let mut columns = root_columns(&hairs.root);
    columns.push(("side", ply::Column::I32(hairs.side.iter().map(|s| i32::from(*s)).collect())));
    columns.push(("parting", ply::Column::U32(hairs.parting.clone())));
    columns.push(("border", ply::Column::U8(hairs.border.iter().map(|b| u8::from(*b)).collect())));
    columns.push(("single", ply::Column::U32(hairs.single.clone())));
    columns.push(("cut", ply::Column::F32(hairs.cut.clone())));
    let comment = format!("control hairs, {} points each: n, du, dv along [N, dU, N x dU] from the root", hairs.points);
    encode(
        &comment,
        &[
            table("hair", columns),
            table("point", vector_columns(["n", "du", "dv"], &hairs.local)),
            table("shape", vec![("points", ply::Column::U32(vec![hairs.points as u32]))]),
        ],
    )
}

fn decode_hairs(bytes: &[u8]) -> Option<ControlHairs> {
    let file: tables::Tables = decode(bytes)?;
    let (hair, point) = (file.get("hair")?, file.get("point")?);
    let points = *file.get("shape")?.u32("points")?.first()? as usize;
    let ply::Column::I32(side) = hair.column("side")? else { return None };
    let ply::Column::U8(border) = hair.column("border")? else { return None };
    let local = vectors_of(point, ["n", "du", "dv"])?;
    (local.len() == hair.rows * points).then_some(())?;
    Some(ControlHairs {
        points,
        root: roots_of(hair)?,
        local,
        side: side.iter().map(|s| *s as i8).collect(),
        parting: hair.u32("parting")?.to_vec(),
        border: border.iter().map(|b| *b != 0).collect(),
        single: hair.u32("single")?.to_vec(),
        cut: hair.f32("cut")?.to_vec(),
    })
}
