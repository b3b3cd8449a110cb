//! Draws `docs/pictures/look/` and `docs/pictures/light/`: every parameter of the look, and the settings of lights and
//! pictures, in three pictures side by side.
//!
//! `cargo run --release -p pelage-tests --example parameter_pictures [KEY ...]`; with keys (or beginnings of keys), only those.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, RgbImage};
use pelage::progress::Progress;
use pelage::project::Project;
use pelage::stage::{Options, Runner, Stage};
use pelage_tests::parameters::light::LIT;
use pelage_tests::parameters::parameters;
use pelage_tests::{ShotFolder, indexed_png};
use std::path::Path;

/// Columns between two pictures.
const GAP: u32 = 3;

/// Colours of a picture: fewer show as bands on the skin, twice as many make the files a fifth larger.
const COLORS: usize = 24;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let pictures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/pictures");
    let is_wanted = |key: &str| wanted.is_empty() || wanted.iter().any(|w| key.starts_with(w));
    let mut bytes = 0;
    let mut write = |folder: &str, name: String, three: [RgbImage; 3]| {
        let png = quantised(&row(&three));
        bytes += png.len();
        std::fs::create_dir_all(pictures.join(folder)).expect("a folder");
        std::fs::write(pictures.join(folder).join(&name), png).expect("a picture");
        println!("{folder}/{name}");
    };
    for shown in parameters().filter(|s| is_wanted(s.key)) {
        write("look", shown.file(), shown.settings.map(|s| drawn(shown.key, s, shown.files(s))));
    }
    for lit in LIT.iter().filter(|l| is_wanted(l.key)) {
        write("light", lit.file(), lit.settings.map(|s| drawn(lit.key, s, lit.files(s))));
    }
    println!("{bytes} bytes");
}

/// The still of the shot that shows a setting.
fn drawn(key: &str, setting: &str, files: Vec<(String, Vec<u8>)>) -> RgbImage {
    let shot = ShotFolder::new("");
    files.iter().for_each(|(name, bytes)| shot.write(name, bytes));
    let made = || {
        let project = Project::open(&shot.path().join("pipeline.toml"))?;
        let frames = Some([project.still_frame()].into());
        let options = Options { frames, without: Some(Stage::Export), ..Options::default() };
        Runner::new(&project, options, &mut Progress::new(true))?.run()
    };
    let report = made().unwrap_or_else(|e| panic!("{key} with `{setting}`: {e:?}"));
    for stage in &report.stages {
        stage.warnings.iter().for_each(|w| println!("  {key} `{setting}`: {w}"));
        let told = stage.counts.iter().filter(|(k, n)| **n > 0 && k.contains("in the skin"));
        told.for_each(|(k, n)| println!("  {key} `{setting}`: {n} {k}"));
    }
    let picture = shot.read("out/shown/preview.png");
    image::load_from_memory(&picture).expect("a picture").into_rgb8()
}

/// Pictures side by side.
fn row(pictures: &[RgbImage]) -> RgbImage {
    let (w, h) = pictures[0].dimensions();
    let n = pictures.len() as u32;
    let mut out = RgbImage::from_pixel(n * (w + GAP) - GAP, h, image::Rgb([255; 3]));
    for (k, picture) in (0..).zip(pictures) {
        image::imageops::replace(&mut out, picture, i64::from(k * (w + GAP)), 0);
    }
    out
}

/// A PNG of few colours: hair is noise to a packer, and the sheer number of shades is what fills a file.
fn quantised(picture: &RgbImage) -> Vec<u8> {
    let pixels: Vec<[i32; 3]> = picture.pixels().map(|p| p.0.map(i32::from)).collect();
    let distance = |a: [i32; 3], b: [i32; 3]| (0..3).map(|x| (a[x] - b[x]) * (a[x] - b[x])).sum::<i32>();
    let nearest = |palette: &[[i32; 3]], p: [i32; 3]| {
        (0..palette.len()).min_by_key(|k| distance(palette[*k], p)).expect("a palette")
    };
    // Each colour of the palette begins as the pixel farthest from those before it, and goes to the mean of its pixels.
    let mut palette = vec![[255; 3]];
    let mut left: Vec<i32> = pixels.iter().map(|p| distance(*p, palette[0])).collect();
    while palette.len() < COLORS {
        let far = (0..pixels.len()).max_by_key(|i| left[*i]).expect("pixels");
        palette.push(pixels[far]);
        left.iter_mut().zip(&pixels).for_each(|(l, p)| *l = (*l).min(distance(*p, pixels[far])));
    }
    for _ in 0..8 {
        let mut sum = vec![[0i64; 4]; palette.len()];
        for p in &pixels {
            let s = &mut sum[nearest(&palette, *p)];
            (0..3).for_each(|x| s[x] += i64::from(p[x]));
            s[3] += 1;
        }
        let mean = |s: &[i64; 4]| std::array::from_fn(|x| (s[x] / s[3]) as i32);
        palette.iter_mut().zip(&sum).filter(|(_, s)| s[3] > 0).for_each(|(c, s)| *c = mean(s));
    }
    let index: Vec<u8> = pixels.iter().map(|p| nearest(&palette, *p) as u8).collect();
    let mut grey = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut grey, CompressionType::Best, FilterType::NoFilter);
    encoder.write_image(&index, picture.width(), picture.height(), ExtendedColorType::L8).expect("a picture");
    let palette: Vec<[u8; 3]> = palette.iter().map(|c| c.map(|x| x as u8)).collect();
    indexed_png(&grey, &palette)
}
