//! Pictures in memory: tone curve, contact sheets, text.

use font8x8::legacy::BASIC_LEGACY;
use rayon::prelude::*;

/// A picture, linear, top row first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels along a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `height` rows of `width` pixels: linear red, green, blue with the primaries of sRGB, >= 0.
    pub rgb: Vec<[f32; 3]>,
}

/// Where the shoulder of the tone curve begins, linear. Lower greys whole highlights, higher clips them hard.
const SHOULDER: f32 = 0.55;

/// Side of a letter, dots.
pub(crate) const LETTER: usize = 8;

/// How linear light becomes the values of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// Straight up to a shoulder, then towards 1 without reaching it: highlights keep their shape.
    #[default]
    Shoulder,
    /// Straight up to 1, where it is cut off: for values that are to be read.
    Straight,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, rgb: [f32; 3]) -> Image {
        Image { width, height, rgb: vec![rgb; width * height] }
    }

    /// `height` rows of `width` pixels of 3 bytes, as a PNG or PPM file wants them: tone curve, then the transfer curve
    /// of sRGB (IEC 61966-2-1).
    pub fn to_srgb8(&self, tone: Tone) -> Vec<u8> {
        let mut bytes = vec![0u8; self.rgb.len() * 3];
        let step = srgb_steps();
        bytes.par_chunks_mut(3 * 4096).zip(self.rgb.par_chunks(4096)).for_each(|(out, rgb)| {
            for (o, &c) in out.iter_mut().zip(rgb.iter().flatten()) {
                let c = if tone == Tone::Shoulder { shoulder(c) } else { c };
                *o = step.partition_point(|s| *s <= c) as u8;
            }
        });
        bytes
    }

    /// The picture `stops` brighter: light times 2^stops.
    pub fn exposed(mut self, stops: f32) -> Image {
        let gain = libm::exp2f(stops);
        self.rgb.par_iter_mut().for_each(|c| *c = c.map(|v| v * gain));
        self
    }

    /// The picture at `1 / n` of its size: means of squares of `n` x `n` pixels; rows and columns left over are dropped.
    pub fn shrunk(&self, n: usize) -> Image {
        let n = n.max(1);
        let (width, height) = (self.width / n, self.height / n);
        let mut image = Image::filled(width, height, [0.0; 3]);
        let share = 1.0 / (n * n) as f32;
        for (k, out) in image.rgb.iter_mut().enumerate() {
            for y in k / width * n..(k / width + 1) * n {
                for c in &self.rgb[y * self.width + k % width * n..][..n] {
                    *out = std::array::from_fn(|i| out[i] + share * c[i]);
                }
            }
        }
        image
    }

    /// Writes text with its upper left corner at (x, y): light letters of 8 x 8 dots with a dark rim, each dot `scale`
    /// pixels wide. What does not fit is cut off; what is not ASCII is a question mark.
    pub fn draw_text(&mut self, text: &str, [x0, y0]: [i64; 2], scale: usize) {
        let s = scale.max(1) as i64;
        let glyph = |c: char| BASIC_LEGACY[if c.is_ascii() { c as usize } else { '?' as usize }];
        let dots: Vec<(i64, i64)> = text
            .chars()
            .enumerate()
            .flat_map(|(k, c)| {
                let set = (0..LETTER * LETTER).filter(move |d| glyph(c)[d / LETTER] >> (d % LETTER) & 1 == 1);
                set.map(move |d| ((k * LETTER + d % LETTER) as i64, (d / LETTER) as i64))
            })
            .collect();
        for (rim, grey) in [((s + 1) / 2, 0.01), (0, 0.9)] {
            for &(x, y) in &dots {
                self.fill([x * s + x0 - rim, y * s + y0 - rim], [s + 2 * rim; 2], [grey; 3]);
            }
        }
    }

    /// Fills a rectangle with its upper left corner at `low`, as far as it lies in the picture.
    pub(crate) fn fill(&mut self, low: [i64; 2], size: [i64; 2], rgb: [f32; 3]) {
        let within = |i: usize, n: usize| {
            let to = |v: i64| v.clamp(0, n as i64) as usize;
            to(low[i])..to(low[i].saturating_add(size[i]))
        };
        for y in within(1, self.height) {
            self.rgb[y * self.width..][within(0, self.width)].fill(rgb);
        }
    }
}

/// Straight up to the shoulder, then a hyperbola of the same slope that tends to 1.
fn shoulder(x: f32) -> f32 {
    if x.is_nan() || x <= SHOULDER {
        return x.max(0.0);
    }
    let u = (x - SHOULDER) / (1.0 - SHOULDER);
    if u.is_finite() { SHOULDER + (1.0 - SHOULDER) * u / (1.0 + u) } else { 1.0 }
}

/// Linear values half way, in sRGB, between one 8-bit value and the next: the number of them that a value reaches is its
/// 8-bit value.
fn srgb_steps() -> [f32; 255] {
    std::array::from_fn(|v| curve((v as f32 + 0.5) / 255.0))
}

/// Transfer curve of sRGB: value in [0, 1] to linear.
fn curve(y: f32) -> f32 {
    if y <= 0.040_45 { y / 12.92 } else { libm::powf((y + 0.055) / 1.055, 2.4) }
}

/// Linear value of an 8-bit sRGB value: for colours that people write down.
pub fn linear(srgb: u8) -> f32 {
    curve(f32::from(srgb) / 255.0)
}

/// Pixels between the pictures of a contact sheet.
const GAP: usize = 4;

/// Pictures side by side, row by row, `columns` a row, on a dark ground with thin gaps. Cells are as large as the
/// largest picture; smaller ones are centred.
pub fn contact_sheet(images: &[Image], columns: usize) -> Image {
    let columns = columns.clamp(1, images.len().max(1));
    let rows = images.len().div_ceil(columns);
    let cell = images.iter().fold([0, 0], |c, i| [c[0].max(i.width), c[1].max(i.height)]);
    if rows == 0 || cell.contains(&0) {
        return Image::default();
    }
    let mut sheet = Image::filled(columns * (cell[0] + GAP) + GAP, rows * (cell[1] + GAP) + GAP, [0.012; 3]);
    for (k, image) in images.iter().enumerate() {
        let x = GAP + k % columns * (cell[0] + GAP) + (cell[0] - image.width) / 2;
        let y = GAP + k / columns * (cell[1] + GAP) + (cell[1] - image.height) / 2;
        for j in 0..image.height {
            let row = (y + j) * sheet.width + x;
            sheet.rgb[row..row + image.width].copy_from_slice(&image.rgb[j * image.width..(j + 1) * image.width]);
        }
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bit_values_survive_below_the_shoulder() {
        let grey = |c: f32| Image::filled(1, 1, [c; 3]).to_srgb8(Tone::Shoulder)[1];
        assert!((0..=190u8).all(|v| grey(linear(v)) == v));
        let rising: Vec<u8> = (0..100).map(|i| grey(i as f32 * 0.05)).collect();
        assert!(rising.windows(2).all(|w| w[0] <= w[1]) && rising[99] > 240);
        assert_eq!([grey(f32::INFINITY), grey(-1.0), grey(f32::NAN)], [255, 0, 0]);
        let straight = |c: f32| Image::filled(1, 1, [c; 3]).to_srgb8(Tone::Straight)[1];
        assert!((0..=255u8).all(|v| straight(linear(v)) == v));
        assert_eq!([straight(f32::INFINITY), straight(-1.0), straight(7.0)], [255, 0, 255]);
        let twice = Image::filled(2, 1, [0.1, 0.2, 0.3]).exposed(1.0);
        assert_eq!(twice.rgb, [[0.2, 0.4, 0.6]; 2]);
    }

    #[test]
    fn a_shrunk_picture_holds_the_means() {
        let image = Image { width: 7, height: 5, rgb: (0..35).map(|k| [k as f32, 1.0, 0.0]).collect() };
        let half = image.shrunk(2);
        assert_eq!((half.width, half.height), (3, 2));
        assert_eq!((half.rgb[0], half.rgb[5]), ([4.0, 1.0, 0.0], [22.0, 1.0, 0.0]));
        assert_eq!((image.shrunk(1), image.shrunk(0)), (image.clone(), image.clone()));
        assert_eq!(image.shrunk(9).rgb.len(), 0);
    }

    #[test]
    fn a_contact_sheet_keeps_every_pixel() {
        let images: Vec<Image> = (1..=5).map(|k| Image::filled(10 + k % 2, 6, [k as f32, 0.0, 0.0])).collect();
        let sheet = contact_sheet(&images, 3);
        assert_eq!((sheet.width, sheet.height), (3 * 15 + 4, 2 * 10 + 4));
        for (k, image) in images.iter().enumerate() {
            let n = sheet.rgb.iter().filter(|c| c[0] == (k + 1) as f32).count();
            assert_eq!(n, image.rgb.len());
        }
        assert_eq!(contact_sheet(&[], 4), Image::default());
        assert_eq!(contact_sheet(&[Image::default()], 0), Image::default());
    }

    #[test]
    fn text_is_drawn_inside_the_picture_only() {
        let mut image = Image::filled(90, 30, [0.3; 3]);
        image.draw_text("-1a,", [3, 4], 2);
        let light = image.rgb.iter().filter(|c| c[0] == 0.9).count();
        let dots: u32 = b"-1a,".iter().flat_map(|&c| BASIC_LEGACY[usize::from(c)]).map(u8::count_ones).sum();
        assert_eq!(light as u32, dots * 4);
        // The middle column of a 1 is one stroke from top to bottom.
        let column = (0..7).all(|y| image.rgb[(4 + 2 * y) * 90 + 3 + 2 * (8 + 3)] == [0.9; 3]);
        assert!(column);
        Image::filled(3, 2, [0.0; 3]).draw_text("µ9\u{1F600}", [-5, i64::MAX - 99], 9);
        Image::default().draw_text("1", [0, 0], 1);
    }
}
