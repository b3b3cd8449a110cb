//! Error of opacity shadow maps against exact rays, and what they cost.

use super::plot::{Plot, Series};
use super::shots::{self, Still};
use super::{Bench, Findings, Section, Study, machine};
use crate::Error;
use crate::cli::Sample;
use pelage_geom::{Vec3, rng};
use pelage_light::shadow::{
    Footprint, Interpolation, Placement, Sample as Exact, ShadowError, ShadowHair, ShadowSettings, Source,
    transmittance, transmittance_exact,
};
use std::cell::OnceCell;
use std::path::Path;

pub(super) const STUDY: Study =
    Study { name: "shadow", about: "Opacity shadow maps against exact rays: error, time, memory.", run };

/// Points that are compared, and rays for each; fewer in the quick bench.
const POINTS: [u64; 2] = [2_000, 400];
const RAYS: [usize; 2] = [1_024, 512];

const TEXELS: [usize; 4] = [512, 1024, 2048, 4096];
const SLICES: [usize; 6] = [16, 32, 64, 128, 256, 384];
const QUICK_TEXELS: [usize; 2] = [1024, 2048];
const QUICK_SLICES: [usize; 2] = [64, 384];

const COLUMNS: [&str; 5] = ["RMS", "95 %", "bias", "processor s", "MB"];

/// Hair at rest and the points where its light is known.
struct Lit {
    still: Still,
    picked: Vec<[usize; 2]>,
    footprint: Footprint,
    truth: Vec<Exact>,
    /// Middle and size of the hair, scene units.
    middle: Vec3,
    size: f64,
}

const SUN: Vec3 = Vec3::new(-0.4, -0.8, -0.45);

fn lit(folder: &Path, kind: Sample, quick: bool) -> Result<Lit, Error> {
    let still = shots::still(&shots::project(folder, kind)?)?;
    let all: Vec<[usize; 2]> =
        still.layers.iter().enumerate().flat_map(|(l, h)| (0..h.rest.len()).map(move |i| [l, i])).collect();
    let pick = |k: u64| all[(rng::uniform(3, k, 0, 0) * all.len() as f64) as usize];
    let picked: Vec<[usize; 2]> = (0..POINTS[usize::from(quick)]).map(pick).collect();
    let footprint = Footprint { side: ShadowSettings::default().filter, rays: RAYS[usize::from(quick)], seed: 1 };
    let bound = |x: usize, s: f32| {
        still.layers.iter().flat_map(|l| &l.rest).map(|p| s * p[x]).fold(f32::NEG_INFINITY, f32::max)
    };
    let middle = Vec3::from_fn(|x, _| still.origin[x] + f64::from(0.5 * (bound(x, 1.0) - bound(x, -1.0))));
    let size = f64::from((0..3).map(|x| bound(x, 1.0) + bound(x, -1.0)).fold(0.0, f32::max));
    let mut lit = Lit { still, picked, footprint, truth: Vec::new(), middle, size };
    lit.truth = lit.exact(Source::Directional { direction: SUN }, None);
    Ok(lit)
}

impl Lit {
    /// The hair, of its own opacity or of another.
    fn with<T>(&self, opacity: Option<f32>, then: impl FnOnce(&[ShadowHair<'_>]) -> T) -> T {
        let other: Vec<Vec<f32>> =
            self.still.layers.iter().map(|l| opacity.map_or(l.opacity.clone(), |o| vec![o; l.id.len()])).collect();
        let hair = self.still.layers.iter().zip(&other).map(|(l, opacity)| ShadowHair {
            offsets: &l.offsets,
            position: &l.rest,
            origin: self.still.origin,
            width: &l.width,
            opacity,
        });
        then(&hair.collect::<Vec<_>>())
    }

    fn exact(&self, source: Source, opacity: Option<f32>) -> Vec<Exact> {
        let found = self.with(opacity, |h| transmittance_exact(source, h, &[], &self.footprint, &self.picked));
        found.expect("a light with a place")
    }

    /// Error and cost of some settings under a light.
    fn measure(&self, source: Source, opacity: Option<f32>, settings: &ShadowSettings, truth: &[Exact]) -> [f64; 5] {
        let (found, seconds) = self.with(opacity, |h| machine::alone(|| transmittance(source, h, &[], settings)));
        let found = found.expect("a light with a place");
        let ShadowError { rms, p95, bias } = ShadowError::of(&found.0, &self.picked, truth);
        [rms, p95, bias, seconds, found.1.bytes as f64 * 1e-6]
    }
}

/// Settings with the name of their point.
fn settings(quick: bool) -> Vec<(String, ShadowSettings)> {
    let default = ShadowSettings::default();
    let (texels, slices): (&[usize], &[usize]) =
        if quick { (&QUICK_TEXELS, &QUICK_SLICES) } else { (&TEXELS, &SLICES) };
    let mut all = Vec::new();
    for &texels in texels {
        for &slices in slices {
            all.push((format!("{texels}x{slices}"), ShadowSettings { texels, slices, ..default }));
        }
    }
    if !quick {
        all.push(("4096x512".to_owned(), ShadowSettings { texels: 4096, slices: 512, ..default }));
        for slices in SLICES {
            let even = ShadowSettings { slices, placement: Placement::Uniform, ..default };
            all.push((format!("even-slices/{}x{slices}", default.texels), even));
        }
        for factor in [0.5, 0.75, 1.25, 1.5] {
            all.push((format!("filter-x-{factor}"), ShadowSettings { filter: factor * default.filter, ..default }));
        }
    }
    for (name, interpolation) in [("transmittance", Interpolation::Transmittance), ("cubic", Interpolation::Cubic)] {
        all.push((format!("interpolation/{name}"), ShadowSettings { interpolation, ..default }));
    }
    all
}

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let (folder, quick) = (bench.folder.to_path_buf(), bench.quick);
    let default = ShadowSettings::default();
    let mut findings = Findings::default();
    for kind in [Sample::Bust, Sample::Animal] {
        let cell = OnceCell::new();
        let lit = || shots::lazily(&cell, || lit(&folder, kind, quick));
        let name = format!("{kind:?}").to_lowercase();
        let of = format!("{name}/{}-points", POINTS[usize::from(quick)]);
        let mut maps = Section::new(&format!("Settings: {name}"), &COLUMNS).says(
            "Hair of the sample at rest under a slanted parallel light. The truth is the mean of exact rays (1,024, 512 in \
             the quick bench) past every hair over the map's footprint, 1/256 of its side, around each of 2,000 points (400); \
             the noise of that mean is taken out of the RMS, not out of the 95th percentile. The rows are texels times \
             slices with all else at the default, then the default with one thing changed. Seconds are processor time \
             of one thread.",
        );
        for (point, settings) in settings(quick) {
            maps.row(bench, &format!("{of}/{point}"), || {
                let lit = lit()?;
                Ok(lit.measure(Source::Directional { direction: SUN }, None, &settings, &lit.truth))
            })?;
        }
        maps.plots = vec![plot(&name, &maps)];
        let mut lights = Section::new(&format!("Other lights: {name}"), &COLUMNS)
            .says("The default under other lights, and on hair that lets light through; each against rays of its own.");
        type Light = (&'static str, fn(&Lit) -> Source, Option<f32>);
        let all: [Light; 5] = [
            ("opacity-0.5", |_| Source::Directional { direction: SUN }, Some(0.5)),
            ("opacity-0.1", |_| Source::Directional { direction: SUN }, Some(0.1)),
            ("point-1.5-sizes-away", |l| aside(l, 1.5), None),
            ("point-0.6-sizes-away", |l| aside(l, 0.6), None),
            ("point-in-the-middle", |l| aside(l, 0.0), None),
        ];
        // The quick bench has none: each needs rays of its own.
        for (point, source, opacity) in all.into_iter().take(if quick { 0 } else { 5 }) {
            lights.row(bench, &format!("{of}/{point}"), || {
                let lit = lit()?;
                let truth = lit.exact(source(lit), opacity);
                Ok(lit.measure(source(lit), opacity, &default, &truth))
            })?;
        }
        findings.answers.push(answer(&name, &maps, &lights));
        findings.sections.push(maps);
        findings.sections.extend(Some(lights).filter(|l| !l.rows.is_empty()));
    }
    Ok(findings)
}

/// A point light some sizes of the hair away from its middle.
fn aside(lit: &Lit, sizes: f64) -> Source {
    Source::Point { position: lit.middle + Vec3::new(0.6, 0.5, 0.7).normalize() * (sizes * lit.size) }
}

/// Texels and slices of a point of the grid.
fn grid(point: &str) -> Option<[usize; 2]> {
    let (texels, slices) = point.rsplit('/').next()?.split_once('x')?;
    Some([texels.parse().ok()?, slices.parse().ok()?])
}

fn plot(name: &str, section: &Section) -> String {
    let default = ShadowSettings::default();
    let rows: Vec<(bool, [usize; 2], [f64; 2])> =
        section.rows.iter().filter_map(|(n, v)| Some((n.contains("even-slices"), grid(n)?, [v[3], v[0]]))).collect();
    let line = |label: String, even: bool, texels: usize| {
        let own = rows.iter().filter(|r| r.0 == even && r.1[0] == texels);
        let mark = own.clone().find(|r| !even && r.1 == [default.texels, default.slices]).map(|r| r.2);
        Series { mark, ..Series::new(label, own.map(|r| r.2).collect()) }
    };
    let mut series: Vec<Series> = TEXELS.map(|t| line(format!("{t} texels"), false, t)).into();
    series.push(line(format!("{}, even slices", default.texels), true, default.texels));
    let title = format!("Shadow maps on the {name}: error against time, 16 to 384 slices");
    Plot {
        title: &title,
        axes: ["processor seconds of one thread", "RMS error of transmittance"],
        log: [true, true],
        series,
    }
    .svg()
}

fn answer(name: &str, maps: &Section, lights: &Section) -> String {
    let default = ShadowSettings::default();
    let of = |wanted: [usize; 2]| {
        let found = maps.rows.iter().find(|(n, _)| !n.contains("even") && grid(n) == Some(wanted));
        found.map_or(vec![f64::NAN; 5], |(_, v)| v.clone())
    };
    let (own, half) = (of([default.texels, default.slices]), of([default.texels / 2, default.slices]));
    let twice = of([2 * default.texels, default.slices]);
    let more = match twice[0].is_nan() {
        true => String::new(),
        false => format!(", twice as many {:.4} for {:.1} times it", twice[0], twice[3] / own[3]),
    };
    let linear = maps.rows.iter().find(|(n, _)| n.ends_with("interpolation/transmittance"));
    let linear = linear.map_or(vec![f64::NAN; 5], |(_, v)| v.clone());
    let worst = lights.rows.iter().map(|(_, v)| v[0]).fold(f64::NAN, f64::max);
    let others = if worst.is_nan() { String::new() } else { format!(" Other lights: at most {worst:.4}.") };
    format!(
        "{name}: the default ({} texels, {} slices) is wrong by {:.4} RMS, {:.3} for 95 %, in {:.2} s; half the texels by \
         {:.4} for {:.1} times the time{more}. Linear transmittance between slices instead of optical depth: {:.4}.{others}",
        default.texels,
        default.slices,
        own[0],
        own[1],
        own[3],
        half[0],
        half[3] / own[3],
        linear[0]
    )
}
