//! Pictures in memory: tone curve, contact sheets, frame numbers.

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

impl Image {
    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, rgb: [f32; 3]) -> Image {
        Image { width, height, rgb: vec![rgb; width * height] }
    }

    /// `height` rows of `width` pixels of 3 bytes, as a PNG or PPM file wants them: tone curve (straight up to a
    /// shoulder, then towards 1 without reaching it), then the transfer curve of sRGB (IEC 61966-2-1).
    pub fn to_srgb8(&self) -> Vec<u8> {
        let mut bytes = vec![0u8; self.rgb.len() * 3];
        let step = srgb_steps();
        bytes.par_chunks_mut(3 * 4096).zip(self.rgb.par_chunks(4096)).for_each(|(out, rgb)| {
            for (o, &c) in out.iter_mut().zip(rgb.iter().flatten()) {
                *o = step.partition_point(|s| *s <= tone(c)) as u8;
            }
        });
        bytes
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

    /// Writes a whole number into the lower left corner: light digits of 5 x 7 dots with a dark rim, each dot `scale`
    /// pixels wide. What does not fit is cut off.
    pub fn draw_number(&mut self, number: i64, scale: usize) {
        let text = number.to_string();
        let dots: Vec<(i64, i64)> = text
            .bytes()
            .enumerate()
            .flat_map(|(k, c)| {
                let glyph = glyph(c);
                (0..35).filter(move |d| glyph[d / 5] >> (4 - d % 5) & 1 == 1).map(move |d| (k * 6 + d % 5, d / 5))
            })
            .map(|(x, y)| (x as i64, y as i64))
            .collect();
        let s = scale.max(1) as i64;
        let (x0, y0) = (2 * s, self.height as i64 - 9 * s);
        for (rim, grey) in [((s + 1) / 2, 0.01), (0, 0.9)] {
            for &(x, y) in &dots {
                for j in y * s - rim..(y + 1) * s + rim {
                    for i in x * s - rim..(x + 1) * s + rim {
                        let (px, py) = (x0 + i, y0 + j);
                        if (0..self.width as i64).contains(&px) && (0..self.height as i64).contains(&py) {
                            self.rgb[py as usize * self.width + px as usize] = [grey; 3];
                        }
                    }
                }
            }
        }
    }
}

/// Straight up to the shoulder, then a hyperbola of the same slope that tends to 1.
fn tone(x: f32) -> f32 {
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

/// 5 x 7 dots of a digit or a minus sign, a row a byte, the leftmost dot in bit 4.
fn glyph(c: u8) -> [u8; 7] {
    match c {
        b'0' => [0x0e, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0e],
        b'1' => [0x04, 0x0c, 0x04, 0x04, 0x04, 0x04, 0x0e],
        b'2' => [0x0e, 0x11, 0x01, 0x06, 0x08, 0x10, 0x1f],
        b'3' => [0x0e, 0x11, 0x01, 0x06, 0x01, 0x11, 0x0e],
        b'4' => [0x02, 0x06, 0x0a, 0x12, 0x1f, 0x02, 0x02],
        b'5' => [0x1f, 0x10, 0x1e, 0x01, 0x01, 0x11, 0x0e],
        b'6' => [0x06, 0x08, 0x10, 0x1e, 0x11, 0x11, 0x0e],
        b'7' => [0x1f, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08],
        b'8' => [0x0e, 0x11, 0x11, 0x0e, 0x11, 0x11, 0x0e],
        b'9' => [0x0e, 0x11, 0x11, 0x0f, 0x01, 0x02, 0x0c],
        _ => [0, 0, 0, 0x0e, 0, 0, 0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_bit_values_survive_below_the_shoulder() {
        let grey = |c: f32| Image::filled(1, 1, [c; 3]).to_srgb8()[1];
        assert!((0..=190u8).all(|v| grey(linear(v)) == v));
        let rising: Vec<u8> = (0..100).map(|i| grey(i as f32 * 0.05)).collect();
        assert!(rising.windows(2).all(|w| w[0] <= w[1]) && rising[99] > 240);
        assert_eq!([grey(f32::INFINITY), grey(-1.0), grey(f32::NAN)], [255, 0, 0]);
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
    fn numbers_are_drawn_inside_the_picture_only() {
        let mut image = Image::filled(70, 30, [0.3; 3]);
        image.draw_number(-1007, 2);
        let light = image.rgb.iter().filter(|c| c[0] == 0.9).count();
        // Dots of '-', '1', '0', '0', '7' at 2 x 2 pixels each.
        let dots: u32 = b"-1007".iter().flat_map(|&c| glyph(c)).map(u8::count_ones).sum();
        assert_eq!(light as u32, dots * 4);
        Image::filled(3, 2, [0.0; 3]).draw_number(i64::MIN, 9);
        Image::default().draw_number(1, 1);
    }
}
