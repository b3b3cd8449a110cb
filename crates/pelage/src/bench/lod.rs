//! Levels of detail: what is kept of coverage and shadow where fewer, wider hairs stand for all.

use super::plot::{Plot, Series};
use super::shots::{self, Still};
use super::{Bench, Findings, Section, Study, machine};
use crate::Error;
use crate::cli::Sample;
use crate::format::HairLayer;
use pelage_geom::{StrandId, Vec3, rng};
use pelage_light::shadow::{ShadowHair, ShadowSettings, Source, transmittance};
use pelage_light::{Camera, Image, Settings};
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::path::Path;

pub(super) const STUDY: Study =
    Study { name: "lod", about: "Coverage and shadow kept where fewer, wider hairs stand for all.", run };

const SHARES: [usize; 6] = [2, 4, 8, 16, 32, 64];
const QUICK_SHARES: [usize; 2] = [4, 16];

/// Heights of the picture, pixels.
const SIZES: [usize; 6] = [16, 32, 64, 128, 256, 512];
const QUICK_SIZES: [usize; 2] = [64, 256];

/// Height of the picture that smaller ones are means of: the truth.
const LARGE: usize = 2048;

/// How hairs are chosen.
#[derive(Clone, Copy, PartialEq)]
enum Choice {
    /// The first candidates: evenly spread.
    Rank,
    /// A random number by name below the share.
    Hash,
}

impl Choice {
    fn name(self) -> &'static str {
        if self == Choice::Rank { "rank" } else { "hash" }
    }
}

/// Coverage below this is nothing: such pixels are not compared.
const NOTHING: f32 = 0.005;

const COLUMNS: [&str; 6] = [
    "width drawn, pixels",
    "coverage, %",
    "of all hairs drawn, %",
    "of the truth, %",
    "RMS difference of pixels from all hairs drawn, %",
    "from the truth, %",
];

const SHADOW: [&str; 5] = ["points", "mean of all, %", "mean, %", "RMS difference, %", "processor s"];

/// A sample at rest, and what is drawn of it.
struct Shot {
    shares: &'static [usize],
    still: Still,
    /// Names by layer and share of those chosen by rank.
    ranked: Vec<Vec<Vec<StrandId>>>,
    camera: Camera,
    /// Mean diameter, scene units, and distance of its hair from the camera.
    width: f64,
    /// All hairs in the largest picture.
    large: Image,
    /// By height: all hairs in the picture, and the mean of the largest picture.
    whole: RefCell<BTreeMap<usize, [Image; 2]>>,
}

fn shot(folder: &Path, kind: Sample, shares: &'static [usize]) -> Result<Shot, Error> {
    let project = shots::project(folder, kind)?;
    let still = shots::still(&project)?;
    let names = |i: usize| shares.iter().map(move |&s| (i, s));
    let ranked = (0..still.layers.len())
        .map(|i| names(i).map(|(i, s)| shots::names(&shots::thinned(&project, 1.0 / s as f64), i)).collect())
        .collect::<Result<Vec<_>, Error>>()?;
    let camera = shots::camera(&still.layers, still.origin, project.shot.value.preview.from(), 1.0);
    let widths = || still.layers.iter().flat_map(|l| &l.width);
    let width = widths().map(|w| f64::from(*w)).sum::<f64>() / widths().count() as f64;
    let large = drawn(&still, &still.layers, &camera, LARGE);
    Ok(Shot { shares, still, ranked, camera, width, large, whole: RefCell::default() })
}

/// White hair before black skin and nothing: a pixel is what hair covers of it.
fn drawn(still: &Still, layers: &[HairLayer], camera: &Camera, size: usize) -> Image {
    let views: Vec<_> = layers.iter().map(|l| (l, vec![[1.0f32; 3]; l.id.len()])).collect();
    let views: Vec<_> =
        views.iter().map(|(l, color)| pelage_light::HairView { color, ..shots::view(l, still.origin) }).collect();
    let settings = Settings { ambient: [1.0; 3], shadow: 0.0, ..Settings::default() };
    shots::draw((&still.skin, &still.pose, [0.0; 3]), &views, camera, [size; 2], &[], &settings)
}

impl Shot {
    /// One hair of `share`, that many times as wide.
    fn chosen(&self, choice: Choice, share: usize) -> Vec<HairLayer> {
        let at = self.shares.iter().position(|s| *s == share);
        let keep = |i: usize, id: StrandId| match (choice, at) {
            (_, None) => true,
            (Choice::Rank, Some(k)) => self.ranked[i][k].binary_search(&id).is_ok(),
            (Choice::Hash, _) => rng::uniform(0, id, rng::channel("lod"), 0) * (share as f64) < 1.0,
        };
        let layers = self.still.layers.iter().enumerate();
        layers.map(|(i, l)| shots::kept(l, |_, id| keep(i, id), share as f32)).collect()
    }

    /// Coverage of one hair of `share` in a picture of this height, against that of all hairs and the truth.
    fn coverage(&self, choice: Choice, share: usize, size: usize) -> [f64; 6] {
        let draw = |layers: &[HairLayer]| drawn(&self.still, layers, &self.camera, size);
        let mut whole = self.whole.borrow_mut();
        let whole = whole
            .entry(size)
            .or_insert_with(|| [draw(&self.still.layers), self.large.shrunk(self.large.height / size)]);
        let found = draw(&self.chosen(choice, share));
        let mean = |i: &Image| i.rgb.iter().map(|c| f64::from(c[0])).sum::<f64>() / i.rgb.len() as f64;
        let rms = |other: &Image| {
            let pairs = || found.rgb.iter().zip(&other.rgb).filter(|(a, b)| a[0].max(b[0]) > NOTHING);
            let square: f64 = pairs().map(|(a, b)| f64::from(a[0] - b[0]).powi(2)).sum();
            100.0 * (square / pairs().count() as f64).sqrt()
        };
        let view = self.camera.view(size, size);
        let far = (Vec3::from(self.camera.target) - Vec3::from(self.camera.eye)).norm();
        let (width, covered) = (self.width * view.scale(far) * share as f64, 100.0 * mean(&found));
        let [of_all, of_truth] = [0, 1].map(|k| covered / mean(&whole[k]));
        [width, covered, of_all, of_truth, rms(&whole[0]), rms(&whole[1])]
    }

    /// Light that arrives at the hairs kept, past those kept and past all.
    fn shadow(&self, choice: Choice, share: usize, all: &[Vec<f32>]) -> [f64; 5] {
        let chosen = self.chosen(choice, share);
        let origin = self.still.origin;
        let (found, seconds) = machine::alone(|| shadows(&chosen, origin));
        let (mut n, mut sums) = (0.0, [0.0; 3]);
        for ((layer, some), (found, all)) in self.still.layers.iter().zip(&chosen).zip(found.iter().zip(all)) {
            for (k, id) in some.id.iter().enumerate() {
                let h = layer.id.binary_search(id).expect("a hair of the layer");
                for (p, q) in some.offsets.range(k).zip(layer.offsets.range(h)) {
                    let (a, b) = (f64::from(found[p]), f64::from(all[q]));
                    sums = [sums[0] + b, sums[1] + a, sums[2] + (a - b).powi(2)];
                    n += 1.0;
                }
            }
        }
        [n, 100.0 * sums[0] / n, 100.0 * sums[1] / n, 100.0 * (sums[2] / n).sqrt(), seconds]
    }
}

fn shadows(layers: &[HairLayer], origin: [f64; 3]) -> Vec<Vec<f32>> {
    let hair: Vec<ShadowHair<'_>> = layers
        .iter()
        .map(|l| ShadowHair { offsets: &l.offsets, position: &l.rest, origin, width: &l.width, opacity: &l.opacity })
        .collect();
    let source = Source::Directional { direction: Vec3::new(-0.4, -0.8, -0.45) };
    let found = transmittance(source, &hair, &[], &ShadowSettings::default());
    found.expect("a light with a direction").0
}

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let (folder, quick) = (bench.folder.to_path_buf(), bench.quick);
    let (shares, sizes): (&'static [usize], &[usize]) =
        if quick { (&QUICK_SHARES, &QUICK_SIZES) } else { (&SHARES, &SIZES) };
    let mut coverage = Section::new("Coverage", &COLUMNS)
        .says(
            "White hair at rest before black skin: the mean of the picture is what hair covers of it. One hair of n is \
             drawn n times as wide: the first candidates, which are evenly spread (rank), or those whose random number \
             by name is below 1/n (hash). Both are compared with the picture of all hairs of the same size, and with the \
             truth: all hairs in a picture of 2048 pixels, averaged over the pixels of the small one. The row of all \
             hairs shows what the rasteriser itself is wrong by. Pixels are compared where hair covers one of them.",
        )
        .says(
            "How the pixels differ goes by the width at which the hairs are drawn, whatever their share: hairs drawn \
             thinner than a pixel blur into each other, wider ones are seen one by one. How the mean differs goes by \
             the number of hairs kept: by rank they are even, by hash their number and place are random.",
        );
    let mut shadow = Section::new("Shadow", &SHADOW).says(
        "Light that arrives at the points of the hairs kept, past the hairs kept (n times as wide) and past all, by \
         shadow maps at their default under a slanted parallel light; processor time of one thread.",
    );
    let mut answers = Vec::new();
    for kind in [Sample::Bust, Sample::Animal] {
        let cell = OnceCell::new();
        let shot = || shots::lazily(&cell, || shot(&folder, kind, shares));
        let name = format!("{kind:?}").to_lowercase();
        let mut found: Vec<Line> = Vec::new();
        for choice in [Choice::Rank, Choice::Hash] {
            let all: &[usize] = if choice == Choice::Rank { &[1] } else { &[] };
            for &share in all.iter().chain(shares) {
                let mut of = Vec::new();
                for &size in sizes {
                    let point = format!("{name}/{}/1-of-{share}/{size}-px", choice.name());
                    of.push(coverage.row(bench, &point, || Ok(shot()?.coverage(choice, share, size)))?);
                }
                found.push((choice, share, of));
            }
        }
        coverage.plots.extend(plots(&name, &found));
        answers.push(answer(&name, &found));
        let all = OnceCell::new();
        for choice in [Choice::Rank, Choice::Hash] {
            for &share in shares {
                let point = format!("{name}/{}/1-of-{share}/shadow", choice.name());
                shadow.row(bench, &point, || {
                    let shot = shot()?;
                    let all = shots::lazily(&all, || Ok(shadows(&shot.still.layers, shot.still.origin)))?;
                    Ok(shot.shadow(choice, share, all))
                })?;
            }
        }
    }
    Ok(Findings { answers, sections: vec![coverage, shadow] })
}

/// A line of points: choice, one of how many, and the numbers by size.
type Line = (Choice, usize, Vec<[f64; 6]>);

/// Errors against the width at which hairs are drawn.
fn plots(name: &str, found: &[Line]) -> Vec<String> {
    let plot = |title: String, axis: &str, y: &dyn Fn(&[f64; 6]) -> f64| {
        let line = |(choice, share, of): &Line| {
            Series::new(format!("1 of {share}, {}", choice.name()), of.iter().map(|v| [v[0], y(v)]).collect())
        };
        // As many lines as there are colours.
        let wanted =
            |l: &&Line| if l.0 == Choice::Rank { [2, 4, 16, 64].contains(&l.1) } else { [4, 16].contains(&l.1) };
        let series = found.iter().filter(wanted).map(line).collect();
        Plot { title: &title, axes: ["width of the hairs drawn, pixels", axis], log: [true, true], series }.svg()
    };
    vec![
        plot(format!("{name}: error of coverage"), "difference of the mean from all hairs', %", &|v| {
            (v[2] - 100.0).abs()
        }),
        plot(format!("{name}: difference of pixels"), "RMS difference from all hairs, %", &|v| v[4]),
    ]
}

/// Up to which width of the hairs drawn what is kept, the worst of all shares.
fn answer(name: &str, found: &[Line]) -> String {
    let lines = |choice: Choice| found.iter().filter(move |l| l.1 > 1 && l.0 == choice).flat_map(|l| &l.2);
    let mut widths: Vec<f64> = lines(Choice::Rank).map(|v| v[0]).filter(|w| w.is_finite()).collect();
    widths.sort_by(f64::total_cmp);
    widths.dedup_by(|a, b| (*a / *b - 1.0).abs() < 0.01);
    let worst = |choice: Choice, width: f64, y: &dyn Fn(&[f64; 6]) -> f64| {
        lines(choice).filter(|v| (v[0] / width - 1.0).abs() < 0.01).map(y).fold(f64::NAN, f64::max)
    };
    let upto = |choice: Choice, limit: f64, y: &dyn Fn(&[f64; 6]) -> f64| {
        let widest = widths.iter().copied().take_while(|w| worst(choice, *w, y) <= limit).last();
        widest.map_or("none".to_owned(), |w| format!("{w:.2}"))
    };
    let mean = |v: &[f64; 6]| (v[2] - 100.0).abs();
    let pixels = |v: &[f64; 6]| v[4];
    let both = |limit: f64, y: &dyn Fn(&[f64; 6]) -> f64| {
        format!("{} and {}", upto(Choice::Rank, limit, y), upto(Choice::Hash, limit, y))
    };
    format!(
        "{name}, whatever the share: the mean coverage is within 1.5 % of that of all hairs as long as hairs are drawn at \
         most {} pixels wide (by rank and by hash), within 3 % at {}, and pixels differ by at most 5 % RMS at {}, by 10 % \
         at {}.",
        both(1.5, &mean),
        both(3.0, &mean),
        both(5.0, &pixels),
        both(10.0, &pixels)
    )
}
