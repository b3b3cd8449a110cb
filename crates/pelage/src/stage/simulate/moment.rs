//! Hairs that are simulated, and the skin that they hang on from moment to moment.

use super::super::body::{self, Colliders};
use super::super::plan_kept::hairs_of;
use super::super::run::Runner;
use super::super::{Skin, What, comb, curves, groom, instance, interpolate};
use crate::Error;
use crate::config::Target;
use crate::format::ply;
use crate::project::SkinAt;
use crate::timeline::Timeline;
use pelage_geom::mesh::corners;
use pelage_geom::ride::{Ride, ease_positions, rides};
use pelage_geom::{Offsets, Pose, SurfacePoint, Vec3};
use pelage_groom::control;
use pelage_groom::keep::near;
use pelage_sim::{Bounds, Rigid, Root};
use rayon::prelude::*;
use std::rc::Rc;

/// How far roots may be from their rest pose where the simulation starts, relative to the hair's size; a turn in radians squared.
const AT_REST: f64 = 1e-6;

/// Room around the roots that fields cover, in lengths of the longest hair: hair stretches by a hundredth or so, and roots
/// of a deforming skin move apart between frames. More makes fields for nothing.
const REACH: f64 = 1.1;

/// And metres more: what hair keeps from the body, and how far ahead contacts are looked for.
const MARGIN: f64 = 0.02;

/// Hairs at rest, as they are simulated.
pub(super) struct Source {
    pub offsets: Offsets,
    /// Metres.
    pub position: Vec<[f64; 3]>,
    pub id: Vec<u64>,
    /// On the rest skin; empty without one.
    pub root: Vec<SurfacePoint>,
    /// Where the roots are at rest, scene units.
    pub anchor: Vec<[f64; 3]>,
    /// All of the layer's hairs, where the shot does without some: fields cover where they can come too, so that those that are
    /// left move as they do among them.
    pub whole: Option<Whole>,
}

/// Hairs of a layer with those that a shot does without.
pub(super) struct Whole {
    pub root: Vec<SurfacePoint>,
    /// Length of the longest, metres.
    pub longest: f64,
}

pub(super) fn source(run: &mut Runner<'_>, i: usize) -> Result<Source, Error> {
    let unit = run.project.shot.value.shot.meters_per_unit;
    if run.project.curves.is_some() {
        let (hair, offsets) = (curves::hair(run)?, curves::offsets(run)?);
        let rest = interpolate::positions(run, What::Rest(i))?;
        return Ok(Source {
            offsets,
            position: rest.iter().map(|p| hair.scene(p).map(|x| x * unit)).collect(),
            id: hair.id.clone(),
            root: hair.root.clone(),
            anchor: hair.anchors(),
            whole: None,
        });
    }
    let skin = groom::skin(run)?;
    let anchors = |root: &[SurfacePoint]| root.iter().map(|p| p.blend(skin.corners(p)).into()).collect();
    if run.project.target(i) == Target::EveryHair {
        let (roots, points) = (instance::roots(run, i)?, run.project.base_points(i));
        let rest = interpolate::positions(run, What::Rest(i))?;
        let origin = skin.origin();
        let metres = |p: &[f32; 3]| std::array::from_fn(|x| (f64::from(p[x]) + origin[x]) * unit);
        return Ok(Source {
            offsets: Offsets::uniform(roots.id.len(), points),
            position: rest.par_iter().map(metres).collect(),
            id: roots.id.clone(),
            root: roots.root.clone(),
            anchor: anchors(&roots.root),
            whole: Whole::of(run, i)?,
        });
    }
    let controls = comb::combed(run)?;
    let on = control::Skin { mesh: &skin.mesh, topology: &skin.topology, rest: &skin.rest };
    let hair = |h: usize| {
        let frame = on.frame(&controls.root[h]);
        controls.placed(h, &frame).map(|p| (p * unit).into()).collect::<Vec<[f64; 3]>>()
    };
    Ok(Source {
        offsets: Offsets::uniform(controls.len(), controls.points),
        position: (0..controls.len()).flat_map(hair).collect(),
        id: (0..controls.len() as u64).collect(),
        root: controls.root.clone(),
        anchor: anchors(&controls.root),
        whole: None,
    })
}

/// Vertices of a skin that deforms, at a frame; `None` for one that moves as a whole.
pub(super) fn skin_position(
    run: &mut Runner<'_>,
    timeline: &Timeline<'_>,
    frame: i64,
) -> Result<Option<Vec<[f64; 3]>>, Error> {
    if !body::deforms(timeline) {
        return Ok(None);
    }
    let (skin, arrival) = (groom::skin(run)?, timeline.arrival());
    let read = |frame: i64| match timeline.skin_at(frame) {
        Some(SkinAt::File(file)) => Ok(ply::read_frame(&file.path, skin.mesh.position.len(), skin.faces())?),
        _ => Ok::<_, Error>(skin.mesh.position.clone()),
    };
    if frame >= arrival {
        return read(frame).map(Some);
    }
    let target = read(arrival)?;
    let next = if timeline.skin_at(arrival + 1).is_some() { read(arrival + 1)? } else { target.clone() };
    let (s, frames) = timeline.way(arrival, frame);
    Ok(Some(ease_positions(&skin.mesh.position, &target, &next, frames, s)))
}

/// Where the roots are on a skin that deforms; at rest for one that moves as a whole.
pub(super) fn root_rides(
    run: &mut Runner<'_>,
    source: &Source,
    position: Option<&[[f64; 3]]>,
) -> Result<Vec<Ride>, Error> {
    let Some(position) = position else { return Ok(source.anchor.iter().map(|a| Ride::still(*a)).collect()) };
    let skin = groom::skin(run)?;
    let pose = Pose::new(&skin.mesh, &skin.topology, position.to_vec());
    Ok(rides(&skin.mesh, &skin.topology, &skin.rest, &pose, &source.root, &source.anchor))
}

/// Without pre-roll the simulation starts at the first frame: there the skin must be at rest.
pub(super) fn check_at_rest(run: &mut Runner<'_>, timeline: &Timeline<'_>, source: &Source) -> Result<(), Error> {
    let position = skin_position(run, timeline, timeline.first)?;
    let mut now = root_rides(run, source, position.as_deref())?;
    if let Some(t) = timeline.rigid(timeline.first, timeline.first as f64) {
        let place = |r: &mut Ride| *r = Ride { position: t.apply(Vec3::from(r.position)).into(), rotation: t.rotation };
        now.iter_mut().for_each(place);
    }
    let unit = run.project.shot.value.shot.meters_per_unit;
    let (low, high) = bounds(&source.position);
    let tolerance = AT_REST * (high - low).norm() / unit;
    let moved = |(a, b): (&[f64; 3], &Ride)| {
        (Vec3::from(*a) - Vec3::from(b.position)).norm() > tolerance || b.rotation[3].abs() < 1.0 - AT_REST
    };
    if source.anchor.iter().zip(&now).any(moved) {
        let what = format!("is 0, but roots are not at their rest pose at frame {}", timeline.first);
        let help = "give it frames to come there from the rest pose: 12 is usual";
        return Err(run.project.shot.error("shot.preroll", what, help).into());
    }
    Ok(())
}

pub(super) fn bounds(points: &[[f64; 3]]) -> (Vec3, Vec3) {
    let start = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    points.iter().fold(start, |(low, high), p| (low.inf(&Vec3::from(*p)), high.sup(&Vec3::from(*p))))
}

/// The skin and the roots on it at a frame, as hair collides with and hangs on it.
pub(super) struct Moment {
    /// Where the coordinates of the roots are: the rigid part of a deforming skin's motion.
    pub placement: Rigid,
    pub root: Vec<Root>,
    /// A skin that deforms.
    pub skin: Option<Deformed>,
    pub end: Option<Rc<body::End>>,
}

/// A skin that deforms, scene units.
pub(super) struct Deformed {
    pub position: Vec<[f64; 3]>,
    /// Roots on it, relative to the skin's origin.
    pub root: Vec<[f32; 3]>,
}

/// Hairs around which a skin that deforms stays as it is from one frame to the next. Nothing else may move.
pub(super) fn still(
    run: &mut Runner<'_>,
    source: &Source,
    before: &Deformed,
    now: &Deformed,
) -> Result<Vec<bool>, Error> {
    let skin = groom::skin(run)?;
    let (unit, origin) = (run.project.shot.value.shot.meters_per_unit, skin.origin());
    let moves = |v: &u32| before.position[*v as usize] != now.position[*v as usize];
    let (mut moving, mut longest) = (vec![false; now.position.len()], 0.0f64);
    for t in skin.mesh.triangle.iter().filter(|t| t.iter().any(moves)) {
        t.iter().for_each(|v| moving[*v as usize] = true);
        for pose in [&before.position, &now.position] {
            let corner = t.map(|v| Vec3::from(pose[v as usize]));
            longest = (0..3).map(|k| (corner[k] - corner[(k + 1) % 3]).norm()).fold(longest, f64::max);
        }
    }
    let of = |pose: &[[f64; 3]]| -> Vec<[f32; 3]> {
        let relative = |p: &[f64; 3]| std::array::from_fn(|x| (p[x] - origin[x]) as f32);
        pose.iter().zip(&moving).filter(|(_, m)| **m).map(|(p, _)| relative(p)).collect()
    };
    let place = [of(&before.position), of(&now.position)].concat();
    // What moves of a triangle is no farther from one of its corners than its longest edge.
    let reach = |h: usize| ((source.length(h) * REACH + MARGIN) / unit + longest) as f32;
    let distance: Vec<f32> = (0..source.id.len()).map(reach).collect();
    Ok(near(&now.root, &distance, &place).into_iter().map(|near| !near).collect())
}

/// Where hair can come from its rest pose, metres.
pub(super) fn rest_region(run: &mut Runner<'_>, source: &Source) -> Result<Option<Bounds>, Error> {
    let unit = run.project.shot.value.shot.meters_per_unit;
    let Some(whole) = &source.whole else {
        return Ok(source.region(source.anchor.iter().map(|p| p.map(|x| x * unit))));
    };
    let root = whole.positions(&*groom::skin(run)?, None);
    Ok(around(&root.iter().map(|p| (p * unit).into()).collect::<Vec<_>>(), whole.longest))
}

pub(super) fn moment(
    run: &mut Runner<'_>,
    timeline: &Timeline<'_>,
    source: &Source,
    colliders: &Colliders,
    frame: i64,
) -> Result<Moment, Error> {
    let unit = run.project.shot.value.shot.meters_per_unit;
    let position = skin_position(run, timeline, frame)?;
    let rides = root_rides(run, source, position.as_deref())?;
    let placement = colliders.placement(position.as_deref(), unit);
    let turn = placement.quaternion().inverse();
    let root = |r: &Ride| {
        let q = turn * Rigid { rotation: r.rotation, translation: [0.0; 3] }.quaternion();
        Root { position: placement.invert(Vec3::from(r.position) * unit).into(), rotation: [q.i, q.j, q.k, q.w] }
    };
    let root: Vec<Root> = rides.par_iter().map(root).collect();
    let region = match &source.whole {
        Some(whole) => {
            let root = whole.positions(&*groom::skin(run)?, position.as_deref());
            around(&root.iter().map(|p| placement.invert(p * unit).into()).collect::<Vec<_>>(), whole.longest)
        }
        None => source.region(root.iter().map(|r| r.position)),
    };
    let end = colliders.end(position.as_deref(), unit, &placement, region);
    let origin = run.origin()?;
    let relative = |r: &Ride| std::array::from_fn(|x| (r.position[x] - origin[x]) as f32);
    let skin = position.map(|position| Deformed { position, root: rides.iter().map(relative).collect() });
    Ok(Moment { placement, root, skin, end })
}

impl Source {
    /// Length of a hair, metres.
    pub fn length(&self, h: usize) -> f64 {
        let hair = &self.position[self.offsets.range(h)];
        hair.windows(2).map(|p| (Vec3::from(p[1]) - Vec3::from(p[0])).norm()).sum()
    }

    /// Where hair can come that hangs on these roots (metres); `None` without roots.
    pub fn region(&self, root: impl Iterator<Item = [f64; 3]>) -> Option<Bounds> {
        let longest = (0..self.id.len()).map(|h| self.length(h)).fold(0.0, f64::max);
        around(&root.collect::<Vec<_>>(), longest)
    }
}

/// Where hair of a length can come that hangs on these roots (metres); `None` without roots.
pub(super) fn around(root: &[[f64; 3]], longest: f64) -> Option<Bounds> {
    let finite: Vec<[f64; 3]> = root.iter().copied().filter(|p| p.iter().all(|x| x.is_finite())).collect();
    let (low, high) = bounds(&finite);
    let reach = Vec3::repeat(longest * REACH + MARGIN);
    (low.x <= high.x).then(|| ((low - reach).into(), (high + reach).into()))
}

impl Whole {
    pub fn of(run: &mut Runner<'_>, i: usize) -> Result<Option<Whole>, Error> {
        if matches!(hairs_of(run.project, i), What::Roots(_)) {
            return Ok(None);
        }
        let all = instance::grown(run, i)?;
        let length = instance::feature(run, What::Length(i), i, &all)?;
        let longest = f64::from(length.iter().fold(0.0f32, |a, b| a.max(*b)));
        Ok(Some(Whole { root: all.root, longest: longest * run.project.shot.value.shot.meters_per_unit }))
    }

    /// Roots on the skin at rest, or with its vertices at `position`, scene units.
    pub fn positions(&self, skin: &Skin, position: Option<&[[f64; 3]]>) -> Vec<Vec3> {
        let (position, triangle) = (position.unwrap_or(&skin.mesh.position), &skin.mesh.triangle);
        let at = |p: &SurfacePoint| p.blend(corners(position, triangle[p.triangle as usize]));
        self.root.par_iter().map(at).collect()
    }
}
