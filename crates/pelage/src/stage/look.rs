//! The look: what displaces a layer's hairs at rest or at a frame, part after part.

use super::clumps::{self, RestSites};
use super::plan_look::{Effect, by_clump, changes_hairs, collides, look_in, overridden};
use super::run::{Counts, Runner};
use super::skin::Texel;
use super::{SkinPose, What, clusters, groom, instance, interpolate, layer_seed};
use crate::Error;
use crate::config::{self, CurlKind, LookValue, WaveShape};
use crate::format::HairLayer;
use crate::project::SkinAt;
use pelage_geom::{Bvh, NONE, Offsets, Vec3, curve, rng};
use pelage_groom::along::scaled;
use pelage_groom::cluster;
use pelage_groom::depenetrate::{Depenetrate, depenetrate};
use pelage_groom::instance::Roots;
use pelage_groom::look::axes::{RootAxes, carried, rest_axes};
use pelage_groom::look::clump::{Clump, bind_lines, centre_lines, clump, dilations, drawn_lines, wet};
use pelage_groom::look::curl::{Curl, Wave as CurlWave, curl, dished, helix, uniplanar};
use pelage_groom::look::gather::gather;
use pelage_groom::look::member::{Members, centre_of_each};
use pelage_groom::look::noise::{Noise, noise};
use pelage_groom::look::refine::refine;
use pelage_groom::look::vary::Drawn;
use pelage_groom::look::wave::{Axis, RootVariable, Shape, Stations, Waves, root_variable, wave};
use pelage_groom::look::wind::{Wind, wind};
use pelage_groom::look::{Param, perlin};
use pelage_sim::body::Closed;
use std::cell::OnceCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Points a turn below which a curl is drawn with visible corners.
const SMOOTH: f64 = 8.0;

/// What the look reads of a layer that does not change over the shot.
#[derive(Debug, Default)]
pub struct LayerLook {
    /// How parameters vary from hair to hair, by operator and key.
    column: BTreeMap<String, Column>,
    /// Root variables of waves, by their number.
    root: BTreeMap<usize, Vec<f32>>,
    /// Axes of the roots at rest, in their root frames; empty if nothing needs them.
    axes: Vec<RootAxes>,
}

/// Lines that are no hairs, in the axes of the hairs that carry them.
#[derive(Debug, Default)]
pub struct CarriedLines {
    /// Places of hairs in clusters.
    clusters: InClusters,
    /// Lines of clumps, by level.
    drawn: BTreeMap<usize, Vec<[f32; 3]>>,
}

/// How a parameter varies from hair to hair: factors on its value, or what is added to it.
#[derive(Debug)]
struct Column {
    added: bool,
    value: Vec<f32>,
}

/// Hairs as they are displaced.
pub struct Displaced {
    /// Points, scene units relative to the skin's origin.
    pub position: Vec<[f32; 3]>,
    /// Factors on width and opacity of each hair, and how wet it is, 0 to 1; empty if nothing is wet.
    pub wet: Vec<[f32; 3]>,
}

impl Displaced {
    /// Diameters at the points and opacities of wet hairs, those of `layer` times their factors; empty if nothing is wet.
    pub fn wet_columns(&self, layer: Option<&HairLayer>) -> (Vec<f32>, Vec<f32>) {
        match layer.filter(|_| !self.wet.is_empty()) {
            Some(l) => scaled(&l.offsets, &l.width, &l.opacity, &self.wet),
            None => Default::default(),
        }
    }
}

/// Hairs that come into a step as they leave it: with their finished number of points, displaced, out of the skin.
pub fn finish(
    run: &mut Runner<'_>,
    what: What,
    at: &SkinAt,
    base: Vec<[f32; 3]>,
    counts: &mut Counts,
) -> Result<Displaced, Error> {
    let (acting, last) = look_in(run.project, what);
    let i = what.layer().expect("hairs are of a layer");
    let mut out = Displaced { position: base, wet: Vec::new() };
    if !changes_hairs(run.project, i, &acting, last) {
        return Ok(out);
    }
    let from = run.project.base_points(i);
    let points = if last { run.project.points(i) } else { from };
    let (skin, pose) = (groom::skin(run)?, groom::pose(run, at)?);
    out.position = refined(out.position, from, points);
    let collides = last && collides(run.project, i);
    let kept = collides && !acting.is_empty() || acting.iter().any(|e| e.has_lines(run.project, i));
    let came = if kept { Some(out.position.clone()) } else { None };
    if !acting.is_empty() {
        let (look, lines) = prepared(run, what, &acting, points, &out.position)?;
        let roots = instance::roots(run, i)?;
        let axes = match look.axes.is_empty() {
            true => Vec::new(),
            false => carried(&skin.mesh, &skin.topology, &pose, &roots.root, &look.axes),
        };
        let sites = clumps::sites(run, i)?;
        let frame = what.frame();
        let came = came.as_deref().unwrap_or_default();
        let (look, lines) = (&*look, &*lines);
        let mut job =
            Job { i, points, frame, look, lines, axes: &axes, roots: &roots, sites: &sites, came, out: &mut out };
        for effect in acting {
            job.act(run, effect)?;
        }
    }
    if collides {
        collide(run, i, at, &pose, came.as_deref(), &mut out.position, counts)?;
    }
    Ok(out)
}

/// A skin with its holes closed, and the hierarchy over its rest pose.
#[derive(Debug)]
pub struct Barrier {
    /// The mesh.
    pub closed: Closed,
    /// Made when hairs are first pushed.
    rest: OnceCell<Bvh>,
}

/// The skin with its holes closed.
pub fn barrier(run: &mut Runner<'_>) -> Result<Rc<Barrier>, Error> {
    if let Some(found) = &run.barrier {
        return Ok(found.clone());
    }
    let skin = groom::skin(run)?;
    let closed = Closed::new(&skin.mesh, &skin.topology);
    Ok(run.barrier.insert(Rc::new(Barrier { closed, rest: OnceCell::new() })).clone())
}

/// Pushes finished hairs out of the skin, to the side that they came `from` before they were displaced.
fn collide(
    run: &mut Runner<'_>,
    i: usize,
    at: &SkinAt,
    pose: &SkinPose,
    from: Option<&[[f32; 3]]>,
    position: &mut [[f32; 3]],
    counts: &mut Counts,
) -> Result<(), Error> {
    let (skin, barrier) = (groom::skin(run)?, barrier(run)?);
    let hierarchy = |position: &[[f64; 3]]| barrier.closed.bvh(&barrier.closed.extend(position));
    let rest = || barrier.rest.get_or_init(|| hierarchy(&skin.mesh.position));
    let posed;
    let (bvh, motion) = match at {
        SkinAt::Rest => (rest(), None),
        SkinAt::Rigid(t) => (rest(), Some(t)),
        SkinAt::File(_) => {
            posed = hierarchy(&pose.position);
            (&posed, None)
        }
    };
    let c = run.project.groom.value.layer[i].collision;
    let millimetre = 1e-3 / run.project.shot.value.shot.meters_per_unit;
    let settings = Depenetrate { step: millimetre, clearance: c.clearance * millimetre, held: c.held * millimetre };
    let points = run.project.points(i);
    let offsets = Offsets::uniform(position.len() / points, points);
    let found = depenetrate(bvh, &settings, motion, &offsets, skin.origin(), from, position);
    counts.insert("hairs pushed out of the skin".to_owned(), found.pushed as u64);
    counts.insert("hairs shortened for want of room".to_owned(), found.shortened as u64);
    counts.insert("hairs that grow within the skin".to_owned(), found.buried as u64);
    counts.insert("hairs still in the skin".to_owned(), (found.uncleared - found.buried) as u64);
    Ok(())
}

/// What does not change over the shot, made once a run for each set of parts: at rest and for the frames. Lines that hair is
/// brought to are made for each frame where key frames move them, or the hair that carries them, so that hair is where it
/// would be in a groom of that frame's values. `now` are the hairs that come into the step.
fn prepared(
    run: &mut Runner<'_>,
    what: What,
    acting: &[Effect],
    points: usize,
    now: &[[f32; 3]],
) -> Result<(Rc<LayerLook>, Rc<CarriedLines>), Error> {
    let i = what.layer().expect("hairs are of a layer");
    let shaping = matches!(what, What::Rest(_));
    let combed = run.project.combs_move();
    let moves = |e: &Effect| e.has_lines(run.project, i) && (combed || run.project.clusters_move());
    let moment = what.frame().filter(|_| acting.iter().any(moves));
    let at = (i, shaping);
    let at_rest = |run: &mut Runner<'_>| match what {
        What::Frame(..) => {
            Ok::<_, Error>(refined(interpolate::undisplaced(run, i)?, run.project.base_points(i), points))
        }
        _ => Ok(now.to_vec()),
    };
    let mut rest = None;
    let look = match run.looks.get(&at) {
        Some(found) => found.clone(),
        None => {
            let (skin, roots) = (groom::skin(run)?, instance::roots(run, i)?);
            let mut look = LayerLook::default();
            if acting.iter().any(|e| e.has_axes(run.project, i)) {
                let rest = rest.insert(at_rest(run)?);
                look.axes = rest_axes(&skin.mesh, &skin.topology, &skin.rest, &roots.root, points, rest);
            }
            for effect in acting {
                columns(run, i, *effect, &mut look)?;
            }
            note_coarse_curls(run, i, acting, points)?;
            run.looks.entry(at).or_insert(Rc::new(look)).clone()
        }
    };
    if !acting.iter().any(|e| e.has_lines(run.project, i)) {
        return Ok((look, Rc::default()));
    }
    if let Some((_, found)) = run.lines.get(&at).filter(|(then, _)| *then == moment) {
        return Ok((look, found.clone()));
    }
    let rest = match (moment, rest) {
        (Some(frame), _) => refined(interpolate::undisplaced_at(run, i, frame)?, run.project.base_points(i), points),
        (None, Some(rest)) => rest,
        (None, None) => at_rest(run)?,
    };
    let lines = Rc::new(carried_lines(run, i, moment, acting, points, &rest, &look.axes)?);
    run.lines.insert(at, (moment, lines.clone()));
    Ok((look, lines))
}

/// Lines at a frame, or at rest, in the axes of the hairs `rest` that carry them.
fn carried_lines(
    run: &mut Runner<'_>,
    i: usize,
    frame: Option<i32>,
    acting: &[Effect],
    points: usize,
    rest: &[[f32; 3]],
    axes: &[RootAxes],
) -> Result<CarriedLines, Error> {
    let mut out = CarriedLines::default();
    if acting.contains(&Effect::Cluster) {
        out.clusters = in_clusters(run, i, frame, points, rest, axes)?;
    }
    for effect in acting {
        if let Effect::Clump(k) = effect
            && let Some(lines) = clump_lines(run, i, frame, *k, points)?
        {
            let (skin, roots) = (groom::skin(run)?, instance::roots(run, i)?);
            let members = clumps::clumps(run, i, *k)?;
            let axes = carried(&skin.mesh, &skin.topology, &skin.rest, &roots.root, axes);
            let line = sampled(&lines, Vec3::from(skin.origin()), points);
            out.drawn.insert(*k, bind_lines(points, rest, &members.centre, &axes, &line));
        }
    }
    Ok(out)
}

fn refined(position: Vec<[f32; 3]>, from: usize, to: usize) -> Vec<[f32; 3]> {
    if from == to { position } else { refine(from, to, &position) }
}

/// The lines of a level's clumps where these are no hairs, scene units.
fn clump_lines(
    run: &mut Runner<'_>,
    i: usize,
    frame: Option<i32>,
    k: usize,
    points: usize,
) -> Result<Option<Vec<Vec<Vec3>>>, Error> {
    let c = &run.project.groom.value.layer[i].clump[k];
    if let Some(lines) = &c.curves {
        return Ok(Some(lines.iter().map(|l| l.iter().map(|p| Vec3::from(*p)).collect()).collect()));
    }
    let Some(level) = c.clusters else { return Ok(None) };
    let (members, roots, tree) = (clumps::clumps(run, i, k)?, instance::roots(run, i)?, clusters::tree(run, frame)?);
    let centre: Vec<_> = members.centre.iter().map(|h| roots.root[*h as usize]).collect();
    let of = clusters::owners(&tree, &clusters::coordinates(run, &centre)?, Some(level));
    let line = |k: &u32| cluster::line(&tree.shape(*k).expect("the tree was checked"), points);
    Ok(Some(of.iter().map(line).collect()))
}

/// Hairs of a layer in clusters: their places, in the axes of the hairs that carry them.
#[derive(Debug, Default)]
struct InClusters {
    /// Hairs that are in one, cluster after cluster.
    hair: Vec<u32>,
    /// The hair that carries each.
    carrier: Vec<u32>,
    /// \[hairs * P\] points in its axes.
    local: Vec<[f32; 3]>,
    /// \[P\] how far a hair's own root counts at each point.
    rooted: Vec<f32>,
}

fn in_clusters(
    run: &mut Runner<'_>,
    i: usize,
    frame: Option<i32>,
    points: usize,
    rest: &[[f32; 3]],
    axes: &[RootAxes],
) -> Result<InClusters, Error> {
    let layer = run.project.groom.value.layer[i].cluster.clone().expect("the layer has clusters");
    let (skin, tree, roots) = (groom::skin(run)?, clusters::tree(run, frame)?, instance::roots(run, i)?);
    let uv = clusters::coordinates(run, &roots.root)?;
    let top = clusters::owners(&tree, &uv, Some(0));
    let middle = cluster::middles(&tree, &top, &uv);
    clusters::check_level(run, &tree, &format!("layer[{i}].cluster.level"), layer.level)?;
    let of = clusters::owners(&tree, &uv, layer.level);
    let origin = Vec3::from(skin.origin());
    let at: Vec<Vec3> = roots.root.iter().map(|p| skin.mesh.point(p)).collect();
    let length: Vec<f64> = rest.chunks_exact(points).map(curve::length).collect();
    let wrong = |e: String| run.project.groom.error(&format!("layer[{i}].cluster"), e, "");
    let lines = cluster::lines(&tree, &of, &uv, &at, Some(&length), points, layer.start).map_err(wrong)?;
    let mut hair: Vec<u32> = (0..of.len() as u32).filter(|h| of[*h as usize] != NONE).collect();
    // Hairs of one carrier side by side.
    hair.sort_by_key(|h| (top[*h as usize], *h));
    let carrier: Vec<u32> = hair.iter().map(|h| middle[top[*h as usize] as usize]).collect();
    let single = |p: &Vec3| {
        let p = p - origin;
        [p.x as f32, p.y as f32, p.z as f32]
    };
    let line: Vec<[f32; 3]> =
        hair.iter().flat_map(|h| lines[*h as usize * points..][..points].iter().map(single)).collect();
    let now = carried(&skin.mesh, &skin.topology, &skin.rest, &roots.root, axes);
    let local = bind_lines(points, rest, &carrier, &now, &line);
    let fade = |k: usize| cluster::fade(k as f64 / (points - 1) as f64 / layer.start) as f32;
    Ok(InClusters { hair, carrier, local, rooted: (0..points).map(fade).collect() })
}

/// C lines, scene units, as C times P points relative to an origin.
fn sampled(lines: &[Vec<Vec3>], origin: Vec3, points: usize) -> Vec<[f32; 3]> {
    let sampled = |line: &Vec<Vec3>| {
        let line: Vec<Vec3> = line.iter().map(|p| p - origin).collect();
        curve::resample(&line, points)
    };
    lines.iter().flat_map(sampled).map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect()
}

/// Columns of a part's parameters.
fn columns(run: &mut Runner<'_>, i: usize, effect: Effect, look: &mut LayerLook) -> Result<(), Error> {
    let project = run.project;
    let (roots, sites) = (instance::roots(run, i)?, clumps::sites(run, i)?);
    let layer = &project.groom.value.layer[i];
    let (key, seed) = (effect.key(), u64::from(layer_seed(&layer.name)));
    let own = Drawn { id: &roots.id, uv: &roots.uv, position: &sites.position, seed };
    // Hairs of a clump curl as its centre does.
    let centres = match by_clump(project, i).filter(|_| effect == Effect::Curl) {
        Some(k) => centre_of_each(&*clumps::clumps(run, i, k)?),
        None => Vec::new(),
    };
    let of = |h: &u32| *h as usize;
    let id: Vec<_> = centres.iter().map(|h| roots.id[of(h)]).collect();
    let uv: Vec<_> = centres.iter().map(|h| roots.uv[of(h)]).collect();
    let position: Vec<_> = centres.iter().map(|h| sites.position[of(h)]).collect();
    let hairs = if centres.is_empty() { own } else { Drawn { id: &id, uv: &uv, position: &position, seed } };
    for v in layer.acting(&key) {
        let name = format!("{key}.{}", v.name);
        let value = clumps::column(run, &hairs, &name, v.value, v.added)?;
        look.column.insert(name, Column { added: v.added, value });
    }
    if let Effect::Wave(k) = effect {
        let w = &layer.wave[k];
        let map = w.map.as_ref().map(|m| run.map(m, Texel::Value)).transpose()?;
        let channel = rng::channel(&key);
        let v = RootVariable { map: map.as_ref(), size: w.size as f32, stray: w.stray as f32, channel };
        look.root.insert(k, root_variable(&own, &v));
    }
    Ok(())
}

/// Curls that the hair has too few points to draw are told.
fn note_coarse_curls(run: &mut Runner<'_>, i: usize, acting: &[Effect], points: usize) -> Result<(), Error> {
    let project = run.project;
    let layer = &project.groom.value.layer[i];
    let Some(c) = layer.curl.as_ref().filter(|c| acting.contains(&Effect::Curl) && c.kind != CurlKind::Custom) else {
        return Ok(());
    };
    let length = instance::column(run, What::Length(i), i)?;
    let longest = length.iter().fold(0.0f32, |a, b| a.max(*b));
    let pitch = c.pitch.as_ref().map_or(1.0, |p| p.at(project.moment(None)));
    let turns = f64::from(longest) / pitch;
    let found = (points - 1) as f64 / turns;
    if turns > 0.0 && found < SMOOTH {
        let enough = ((turns * 2.0 * SMOOTH).ceil() as usize).saturating_add(1);
        let help = match enough {
            0..=config::MOST_POINTS => format!("layer.points = {enough} draws them round"),
            _ => format!("{} points draw no turn as short as {pitch}", config::MOST_POINTS),
        };
        let text =
            format!("layer {}: a turn of its curls has {found:.1} segments on the longest hair: {help}", layer.name);
        // At rest and for the frames it is the same.
        run.warn_once(text);
    }
    Ok(())
}

/// One layer at one moment.
struct Job<'a, 'b> {
    i: usize,
    points: usize,
    /// `None` at rest.
    frame: Option<i32>,
    look: &'a LayerLook,
    lines: &'a CarriedLines,
    axes: &'a [RootAxes],
    roots: &'a Roots,
    sites: &'a RestSites,
    /// Hairs as they came into the step, which carry lines; empty if there are none.
    came: &'a [[f32; 3]],
    out: &'b mut Displaced,
}

impl<'a> Job<'a, '_> {
    /// A parameter at this moment.
    fn param(&self, run: &Runner<'_>, effect: Effect, name: &str, v: &LookValue) -> Param<'a> {
        let value = v.at(run.project.moment(self.frame)) as f32;
        match self.look.column.get(&format!("{}.{name}", effect.key())) {
            Some(Column { added: true, value: shift }) => Param { value, factor: &[], shift },
            Some(Column { added: false, value: factor }) => Param { value, factor, shift: &[] },
            None => Param { value, ..Param::default() },
        }
    }

    fn act(&mut self, run: &mut Runner<'_>, effect: Effect) -> Result<(), Error> {
        let project = run.project;
        let layer = &project.groom.value.layer[self.i];
        let seed = u64::from(layer_seed(&layer.name));
        let channel = rng::channel(&effect.key());
        let points = self.points;
        match effect {
            Effect::Cluster => {
                let c = layer.cluster.as_ref().expect("the layer has clusters");
                let own = &self.lines.clusters;
                let line = drawn_lines(points, self.came, &own.carrier, self.axes, &own.local);
                let percent = self.param(run, effect, "percent", &c.percent);
                gather(points, &own.hair, percent, &own.rooted, &line, &mut self.out.position);
            }
            Effect::Clump(k) => self.clump(run, k, seed)?,
            Effect::Curl => {
                let c = layer.curl.as_ref().expect("the layer has curls");
                let one = LookValue::constant(1.0);
                let profile = single(c.profile.as_deref());
                let settings = Curl {
                    wave: wave_of(c),
                    radius: self.param(run, effect, "radius", c.radius.as_ref().unwrap_or(&one)),
                    pitch: self.param(run, effect, "pitch", c.pitch.as_ref().unwrap_or(&one)),
                    phase: self.param(run, effect, "phase", &c.phase),
                    angle: self.param(run, effect, "angle", &c.angle),
                    tighten: self.param(run, effect, "tighten", &c.tighten),
                    start: c.start as f32,
                    profile: &profile,
                    keep_length: c.keep_length,
                    axes: self.axes,
                };
                curl(points, &settings, &mut self.out.position);
                if !self.out.position.iter().flatten().all(|x| x.is_finite()) {
                    let what = "the offset grows beyond all numbers on a hair as long as those of this layer";
                    let help = "lower gamma, or move t0 to the tip";
                    return Err(project.groom.error(&format!("layer[{}].curl", self.i), what, help).into());
                }
            }
            Effect::Wave(k) => {
                let w = &layer.wave[k];
                let settings = Waves {
                    shape: if w.shape == WaveShape::Sine { Shape::Sine } else { Shape::Noise },
                    axis: [axis_of(&w.x), axis_of(&w.y)],
                    strength: self.param(run, effect, "strength", &w.strength),
                    r: &self.look.root[&k],
                    keep_length: w.keep_length,
                    axes: self.axes,
                    seed,
                    channel,
                };
                wave(points, &settings, &mut self.out.position);
            }
            Effect::Noise(k) => {
                let n = &layer.noise[k];
                let profile = single(n.profile.as_deref());
                let settings = Noise {
                    amplitude: self.param(run, effect, "amplitude", &n.amplitude),
                    size: n.size as f32,
                    across: n.across as f32,
                    profile: &profile,
                    keep_length: n.keep_length,
                    id: &self.roots.id,
                    root: &self.sites.position,
                    axes: self.axes,
                    seed,
                    channel,
                };
                noise(points, &settings, &mut self.out.position);
            }
            // The rest pose is without wind.
            Effect::Wind if self.frame.is_none() => {}
            Effect::Wind => {
                let w = layer.wind.as_ref().expect("the layer has wind");
                let settings = Wind {
                    amplitude: self.param(run, effect, "amplitude", &w.amplitude),
                    direction: w.direction.map(|x| x as f32),
                    frequency: w.frequency as f32,
                    size: w.size as f32,
                    gust: w.gust as f32,
                    time: project.seconds(self.frame),
                    root: &self.sites.position,
                    seed,
                    channel,
                };
                wind(points, &settings, &mut self.out.position);
            }
        }
        Ok(())
    }

    fn clump(&mut self, run: &mut Runner<'_>, k: usize, seed: u64) -> Result<(), Error> {
        let project = run.project;
        let layer = &project.groom.value.layer[self.i];
        let (c, effect, points) = (&layer.clump[k], Effect::Clump(k), self.points);
        let m = clumps::clumps(run, self.i, k)?;
        let moment = project.moment(self.frame);
        let mut params = [Param::default(); 5];
        for (p, v) in params.iter_mut().zip(c.varied()) {
            *p = self.param(run, effect, v.name, v.value);
            if let Some((_, keyed)) = overridden(project, self.i, k, &v) {
                p.value = keyed.at(moment) as f32;
            }
        }
        let [mut percent, mut rate, falloff, splay, weave] = params;
        let areas = match (c.areas.is_empty(), self.frame) {
            (true, _) => None,
            (false, None) => return Ok(()),
            (false, Some(frame)) => Some(super::areas::strengths(run, self.i, k, frame, &m, self.sites)?),
        };
        if let Some([area_percent, area_rate]) = &areas {
            (percent, rate) = (in_areas(area_percent), in_areas(area_rate));
        }
        let dilation = c.dilation.as_ref().map(|d| dilation(run, self.i, k, d, &m, self.roots)).transpose()?;
        let drawn = self.lines.drawn.get(&k);
        let line = match drawn {
            Some(d) => drawn_lines(points, self.came, &m.centre, self.axes, d),
            None => centre_lines(points, &self.out.position, &m.centre),
        };
        let moving = vec![NONE; if drawn.is_some() { m.centre.len() } else { 0 }];
        let settings = Clump {
            clump: &m.clump,
            reach: &m.reach,
            centre: if drawn.is_some() { &moving } else { &m.centre },
            percent,
            rate,
            falloff,
            splay,
            weave,
            taper: c.taper as f32,
            dilation: dilation.as_deref().unwrap_or_default(),
            hold: c.hold.map_or(f32::INFINITY, |x| x as f32),
            keep_length: c.keep_length,
            id: &self.roots.id,
            seed: seed ^ rng::channel(&effect.key()),
        };
        clump(points, &settings, &line, &mut self.out.position);
        if let Some(w) = &c.wet {
            self.out.wet.resize(self.roots.id.len(), [1.0, 1.0, 0.0]);
            wet(&settings, w.width as f32, w.opacity as f32, &mut self.out.wet);
        }
        Ok(())
    }
}

/// Values by hair as a parameter.
fn in_areas(column: &[f32]) -> Param<'_> {
    Param { value: 1.0, factor: column, shift: &[] }
}

/// Sizes of the clumps of a level by their root variable: the regions' value, or a number of each clump's own.
fn dilation(
    run: &mut Runner<'_>,
    i: usize,
    k: usize,
    d: &config::Dilation,
    m: &Members,
    roots: &Roots,
) -> Result<Vec<[f32; 4]>, Error> {
    let layer = &run.project.groom.value.layer[i];
    let (seed, c) = (u64::from(layer_seed(&layer.name)), &layer.clump[k]);
    let channel = rng::channel(&format!("clump[{k}].dilation"));
    let map = c.regions.as_ref().map(|r| run.map(r, Texel::Value)).transpose()?;
    let of = |h: &u32| match &map {
        Some(map) => map.nearest(roots.uv[*h as usize]),
        None => rng::uniform(seed, roots.id[*h as usize], channel, 0) as f32,
    };
    let r: Vec<f32> = m.centre.iter().map(of).collect();
    let single = |v: [f64; 4]| v.map(|x| x as f32);
    Ok(dilations(&r, single(d.mean), single(d.deviation), d.scale as f32, perlin::key(seed, 0, channel)))
}

fn single(v: Option<&[f64]>) -> Vec<f32> {
    v.unwrap_or_default().iter().map(|x| *x as f32).collect()
}

fn wave_of(c: &config::Curl) -> [CurlWave; 2] {
    let custom = |w: &Option<config::CurlWave>| {
        let [a, b, alpha, c, beta, d, gamma, t0, r, p0, phase, bias] =
            w.as_ref().map_or([0.0; 12], |w| w.values().map(|(_, x)| x as f32));
        CurlWave { a, b, alpha, c, beta, d, gamma, t0, r, p0, phase, bias }
    };
    match c.kind {
        CurlKind::Helix => helix(),
        CurlKind::Uniplanar => uniplanar(),
        CurlKind::Dished => dished(c.depth.unwrap_or(0.5) as f32),
        CurlKind::Custom => [custom(&c.x), custom(&c.y)],
    }
}

fn axis_of(a: &config::WaveAxis) -> Axis {
    let stations = |mean: [f64; 4], deviation: [f64; 4], scale: [f64; 4]| {
        let single = |v: [f64; 4]| v.map(|x| x as f32);
        Stations { mean: single(mean), deviation: single(deviation), scale: single(scale) }
    };
    Axis {
        amplitude: stations(a.amplitude, a.amplitude_deviation, a.amplitude_scale),
        frequency: stations(a.frequency, a.frequency_deviation, a.frequency_scale),
        phase: [a.phase as f32, a.phase_deviation as f32, a.phase_scale as f32],
    }
}
