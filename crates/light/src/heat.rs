//! Heat maps: a column of hairs as colours, and the legend that says which.

use crate::image::{Image, LETTER, linear};
use colorous::{Color, PAIRED, VIRIDIS};

/// Shades of each of the colours that tell categories apart.
const SHADES: u64 = 3;

fn of(c: Color) -> [f32; 3] {
    [c.r, c.g, c.b].map(linear)
}

/// Colour of what is not a number.
pub const NO_VALUE: [f32; 3] = [0.35, 0.35, 0.35];

/// Linear colour of a value on a scale from `low` to `high`: dark violet over green to yellow, as bright as it is large.
/// Beyond the ends it is that of the end.
pub fn heat_color(value: f32, [low, high]: [f32; 2]) -> [f32; 3] {
    let at = if high > low { (value - low) / (high - low) } else { 0.5 };
    if at.is_nan() { NO_VALUE } else { of(VIRIDIS.eval_continuous(f64::from(at.clamp(0.0, 1.0)))) }
}

/// Linear colour of a category: the same number has the same colour, neighbours mostly different ones.
pub fn category_color(number: u64) -> [f32; 3] {
    let hash = pelage_geom::rng::mix(number);
    let shade = 1.0 - 0.25 * (hash / PAIRED.len() as u64 % SHADES) as f32;
    of(PAIRED[(hash % PAIRED.len() as u64) as usize]).map(|v| v * shade)
}

/// Smallest and largest finite value; 0 and 1 without one.
pub fn range_of(values: impl Iterator<Item = f32>) -> [f32; 2] {
    let none = [f32::INFINITY, f32::NEG_INFINITY];
    let range = values.filter(|v| v.is_finite()).fold(none, |[a, b], v| [a.min(v), b.max(v)]);
    if range[0] <= range[1] { range } else { [0.0, 1.0] }
}

impl Image {
    /// Draws a legend into the lower left corner: a title, and a bar of [`heat_color`] with the values at its ends and its
    /// middle. For values that do not make a scale, `range` is `None` and the title stands alone.
    pub fn draw_legend(&mut self, title: &str, range: Option<[f32; 2]>) {
        let s = (self.width / 640).max(1);
        let line = (LETTER * s) as i64;
        let (left, bottom) = (2 * line, self.height as i64 - 2 * line);
        let Some([low, high]) = range else { return self.draw_text(title, [left, bottom - line], s) };
        let wide = (self.width as i64 / 3).max(1);
        self.draw_text(title, [left, bottom - 5 * line], s);
        self.fill([left - 1, bottom - 7 * line / 2 - 1], [wide + 2, 2 * line + 2], [0.01; 3]);
        for x in 0..wide {
            let value = low + (high - low) * (x as f32 + 0.5) / wide as f32;
            self.fill([left + x, bottom - 7 * line / 2], [1, 2 * line], heat_color(value, [low, high]));
        }
        for (k, value) in [low, 0.5 * (low + high), high].into_iter().enumerate() {
            let text = short(value, high - low);
            let x = left + wide * k as i64 / 2 - line * (text.len() * k) as i64 / 2;
            self.draw_text(&text, [x, bottom - line], s);
        }
    }
}

/// A number to three figures of the scale that it stands on.
fn short(value: f32, span: f32) -> String {
    let large = value.abs().max(span.abs());
    match large {
        1e6.. => format!("{value:.2e}"),
        100.0.. => format!("{value:.0}"),
        10.0.. => format!("{value:.1}"),
        1.0.. => format!("{value:.2}"),
        1e-3.. => format!("{value:.3}"),
        _ if large == 0.0 => "0".to_owned(),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_grow_brighter_with_the_value() {
        let bright = |v: f32| {
            let [r, g, b] = heat_color(v, [-2.0, 3.0]);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let steps: Vec<f32> = (0..=50).map(|k| bright(-2.0 + 0.1 * k as f32)).collect();
        assert!(steps.windows(2).all(|w| w[1] > w[0]), "{steps:?}");
        assert_eq!((bright(-9.0), bright(f32::INFINITY)), (steps[0], steps[50]));
        assert_eq!(heat_color(f32::NAN, [0.0, 1.0]), NO_VALUE);
        assert!(heat_color(1.0, [1.0, 1.0]).iter().all(|v| v.is_finite()));
    }

    #[test]
    fn categories_differ_mostly() {
        let same = (0..1000u64).filter(|k| category_color(*k) == category_color(k + 1)).count();
        assert!(same < 60, "{same}");
    }

    #[test]
    fn ranges_pass_over_what_is_not_a_number() {
        assert_eq!(range_of([f32::NAN, 2.0, -1.0, f32::INFINITY].into_iter()), [-1.0, 2.0]);
        assert_eq!(range_of(std::iter::empty()), [0.0, 1.0]);
    }

    #[test]
    fn a_legend_shows_the_scale_and_fits_small_pictures() {
        let mut image = Image::filled(320, 240, [0.2; 3]);
        image.draw_legend("length, cm", Some([0.0, 12.5]));
        for v in [0.1, 6.0, 12.4] {
            let c = heat_color(v, [0.0, 12.5]);
            let close = |p: &[f32; 3]| p.iter().zip(c).all(|(a, b)| (a - b).abs() < 0.03);
            assert!(image.rgb.iter().filter(|p| close(p)).count() > 10, "{v}");
        }
        Image::filled(3, 2, [0.0; 3]).draw_legend("x", Some([1.0, 1.0]));
        Image::default().draw_legend("x", None);
    }

    #[test]
    fn numbers_are_short() {
        let all = [short(0.0, 0.0), short(0.5, 1.0), short(12.34, 12.34), short(1234.5, 1.0), short(2e-5, 2e-5)];
        assert_eq!(all, ["0", "0.50", "12.3", "1234", "2.00e-5"]);
    }
}
