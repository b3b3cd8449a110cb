//! Line plots as SVG.

use std::fmt::Write;

/// A line of a plot.
pub struct Series {
    /// In the legend.
    pub name: String,
    /// Points in the axes' units.
    pub points: Vec<[f64; 2]>,
    /// Point to mark with a ring.
    pub mark: Option<[f64; 2]>,
    /// Drawn dashed and without dots.
    pub guide: bool,
}

impl Series {
    /// Points with dots.
    pub fn new(name: impl Into<String>, points: Vec<[f64; 2]>) -> Series {
        Series { name: name.into(), points, mark: None, guide: false }
    }
}

/// A plot.
pub struct Plot<'a> {
    /// Above it.
    pub title: &'a str,
    /// Names of the axes with units.
    pub axes: [&'a str; 2],
    /// Logarithmic axes.
    pub log: [bool; 2],
    /// Lines.
    pub series: Vec<Series>,
}

const COLOURS: [&str; 10] =
    ["#1b6ca8", "#c8501e", "#2e8540", "#7b3fa0", "#a08000", "#555555", "#d81b60", "#00a3a3", "#8d5a3b", "#86b300"];
const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 470.0;
/// Left, top, right, bottom.
const FRAME: [f64; 4] = [80.0, 46.0, 540.0, 410.0];

/// Range of an axis and its ticks.
struct Axis {
    log: bool,
    low: f64,
    high: f64,
    ticks: Vec<f64>,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, log: bool) -> Axis {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values {
            (low, high) = (low.min(v), high.max(v));
        }
        if log {
            let (a, b) = (libm::log10(low), libm::log10(high));
            let (a, b) = (a - 0.06 * (b - a) - 0.02, b + 0.06 * (b - a) + 0.02);
            let fine: &[f64] = if b - a > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
            let mut ticks = Vec::new();
            for e in a.floor() as i32..=b.ceil() as i32 {
                ticks.extend(fine.iter().map(|f| f * libm::pow(10.0, f64::from(e))));
            }
            ticks.retain(|t| (a..=b).contains(&libm::log10(*t)));
            return Axis { log, low: a, high: b, ticks };
        }
        let low = if low > 0.0 { 0.0 } else { low };
        let high = if high > low { high } else { low + 1.0 };
        let raw = (high - low) / 6.0;
        let ten = libm::pow(10.0, libm::floor(libm::log10(raw)));
        let step = ten * [1.0, 2.0, 5.0, 10.0].into_iter().find(|f| f * ten >= raw).unwrap_or(10.0);
        let high = (high / step).ceil() * step;
        let count = ((high - low) / step).round() as usize;
        Axis { log, low, high, ticks: (0..=count).map(|i| low + step * i as f64).collect() }
    }

    fn at(&self, v: f64) -> f64 {
        let v = if self.log { libm::log10(v) } else { v };
        (v - self.low) / (self.high - self.low)
    }
}

fn number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e5).contains(&v.abs()) {
        let s = format!("{v:.4}");
        s.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        format!("{v:.0e}")
    }
}

impl Plot<'_> {
    /// The plot as a file's text; empty where there is nothing to draw. Points that have no place on the axes are left out.
    pub fn svg(mut self) -> String {
        let log = self.log;
        let placed = |p: &[f64; 2]| (0..2).all(|c| p[c].is_finite() && (!log[c] || p[c] > 0.0));
        for s in &mut self.series {
            s.points.retain(placed);
            s.mark = s.mark.filter(placed);
        }
        self.series.retain(|s| !s.points.is_empty());
        if self.series.iter().all(|s| s.guide) {
            return String::new();
        }
        let all = |c: usize| self.series.iter().flat_map(move |s| s.points.iter().chain(&s.mark).map(move |p| p[c]));
        let axis = [Axis::new(all(0), self.log[0]), Axis::new(all(1), self.log[1])];
        let [left, top, right, bottom] = FRAME;
        let place =
            |p: [f64; 2]| [left + (right - left) * axis[0].at(p[0]), bottom - (bottom - top) * axis[1].at(p[1])];
        let mut out = String::new();
        let o = &mut out;
        let _ = writeln!(
            o,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" \
             font-size=\"13\"><title>{0}</title><rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\
             <text x=\"{left}\" y=\"26\" font-size=\"15\" font-weight=\"bold\">{0}</text>",
            self.title
        );
        for t in &axis[0].ticks {
            let x = left + (right - left) * axis[0].at(*t);
            let _ = writeln!(o, "<path d=\"M{x:.1} {top}V{bottom}\" stroke=\"#ddd\"/>");
            let _ = writeln!(
                o,
                "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\" fill=\"#333\">{}</text>",
                bottom + 18.0,
                number(*t)
            );
        }
        for t in &axis[1].ticks {
            let y = bottom - (bottom - top) * axis[1].at(*t);
            let _ = writeln!(o, "<path d=\"M{left} {y:.1}H{right}\" stroke=\"#ddd\"/>");
            let _ = writeln!(
                o,
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#333\">{}</text>",
                left - 7.0,
                y + 4.0,
                number(*t)
            );
        }
        let (w, h) = (right - left, bottom - top);
        let _ =
            writeln!(o, "<rect x=\"{left}\" y=\"{top}\" width=\"{w}\" height=\"{h}\" fill=\"none\" stroke=\"#333\"/>");
        let _ = writeln!(
            o,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(20 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            0.5 * (left + right),
            bottom + 42.0,
            self.axes[0],
            0.5 * (top + bottom),
            self.axes[1]
        );
        for (k, s) in self.series.iter().enumerate() {
            self.line(o, k, s, &place);
        }
        out + "</svg>\n"
    }

    fn line(&self, o: &mut String, k: usize, s: &Series, place: &dyn Fn([f64; 2]) -> [f64; 2]) {
        let colour = if s.guide { "#999" } else { COLOURS[k % COLOURS.len()] };
        let at: Vec<[f64; 2]> = s.points.iter().map(|p| place(*p)).collect();
        let path: Vec<String> = at.iter().map(|p| format!("{:.1},{:.1}", p[0], p[1])).collect();
        let dash = if s.guide { " stroke-dasharray=\"5 4\"" } else { "" };
        let _ = writeln!(
            o,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>",
            path.join(" ")
        );
        for p in at.iter().filter(|_| !s.guide) {
            let _ = writeln!(o, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{colour}\"/>", p[0], p[1]);
        }
        if let Some(m) = s.mark {
            let [x, y] = place(m);
            let _ = writeln!(
                o,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"8\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2.5\"/>"
            );
        }
        let y = FRAME[1] + 10.0 + 22.0 * k as f64;
        let x = FRAME[2] + 14.0;
        let _ = writeln!(
            o,
            "<path d=\"M{x} {y}h22\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/><text x=\"{}\" y=\"{}\">{}</text>",
            x + 28.0,
            y + 4.0,
            s.name
        );
    }
}
