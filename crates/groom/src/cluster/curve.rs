//! Numbers along a cluster and around it: smooth curves that stay within their stations.

use std::f64::consts::TAU;

/// A smooth curve through values at stations: cubic pieces with one slope where they meet. Between two stations it
/// stays between their values, so that a scale that tapers to 0 does not go below it. Before the first station and
/// after the last it is constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// \[S\] where, from 0 at the root to 1 at the tip, each beyond the one before; at least one.
    pub t: Vec<f64>,
    /// \[S\] values there.
    pub value: Vec<f64>,
}

impl Curve {
    /// The same value everywhere.
    pub fn constant(value: f64) -> Self {
        Curve { t: vec![0.0], value: vec![value] }
    }

    /// Values at equal distances from root to tip.
    pub fn even(value: Vec<f64>) -> Self {
        let last = (value.len().max(2) - 1) as f64;
        Curve { t: (0..value.len()).map(|k| k as f64 / last).collect(), value }
    }

    /// What `join` makes of this curve and another, at the stations of both.
    pub fn joined(&self, other: &Curve, join: impl Fn(f64, f64) -> f64) -> Self {
        let mut t: Vec<f64> = self.t.iter().chain(&other.t).copied().collect();
        t.sort_by(f64::total_cmp);
        t.dedup();
        let value = t.iter().map(|s| join(self.at(*s), other.at(*s))).collect();
        Curve { t, value }
    }

    /// Value at `t`; 0 without stations.
    pub fn at(&self, t: f64) -> f64 {
        self.both(t).0
    }

    /// Derivative by `t` there; 0 beyond the ends.
    pub fn slope(&self, t: f64) -> f64 {
        self.both(t).1
    }

    fn both(&self, t: f64) -> (f64, f64) {
        through(&self.t, |k| self.value.get(k).copied().unwrap_or(0.0), t)
    }

    /// Sum of the ways up and down.
    pub fn variation(&self) -> f64 {
        self.value.windows(2).map(|w| (w[1] - w[0]).abs()).sum()
    }

    /// Says what is wrong with it.
    pub fn check(&self, name: &str) -> Result<(), String> {
        check_stations(&self.t, name)?;
        if self.value.len() != self.t.len() {
            return Err(format!("{name} has {} stations and {} values", self.t.len(), self.value.len()));
        }
        if self.value.iter().all(|v| v.is_finite()) {
            Ok(())
        } else {
            Err(format!("{name} has a value that is no number"))
        }
    }
}

/// Says what is wrong with stations.
pub(super) fn check_stations(t: &[f64], name: &str) -> Result<(), String> {
    if t.is_empty() {
        Err(format!("{name} has no stations"))
    } else if !t.iter().all(|t| (0.0..=1.0).contains(t)) {
        Err(format!("{name} has a station that is not between 0 and 1"))
    } else if t.windows(2).any(|w| w[1] <= w[0]) {
        Err(format!("the stations of {name} must go up from root to tip"))
    } else {
        Ok(())
    }
}

/// Value and derivative at `at` of the curve through `value(k)` at the stations `t`.
///
/// Slopes at inner stations are weighted harmonic means of those of the two chords, zero where these differ in sign
/// (Fritsch, Butland 1984); at the ends the slope of the only chord.
pub(super) fn through(t: &[f64], value: impl Fn(usize) -> f64, at: f64) -> (f64, f64) {
    let Some(last) = t.len().checked_sub(1) else { return (0.0, 0.0) };
    if at <= t[0] || last == 0 {
        return (value(0), 0.0);
    }
    if at >= t[last] {
        return (value(last), 0.0);
    }
    let k = t.partition_point(|s| *s <= at) - 1;
    let chord = |k: usize| (value(k + 1) - value(k)) / (t[k + 1] - t[k]);
    let slope = |k: usize| {
        if k == 0 || k == last {
            return chord(k.min(last - 1));
        }
        let (a, b) = (chord(k - 1), chord(k));
        let (h, g) = (t[k] - t[k - 1], t[k + 1] - t[k]);
        let (wa, wb) = (2.0 * g + h, g + 2.0 * h);
        if a * b > 0.0 { (wa + wb) / (wa / a + wb / b) } else { 0.0 }
    };
    let step = t[k + 1] - t[k];
    let (w, d) = weights((at - t[k]) / step);
    let p = [value(k), slope(k) * step, value(k + 1), slope(k + 1) * step];
    (dot(w, p), dot(d, p) / step)
}

/// Value, derivative by the angle, and derivative by time of the closed curve through `ring` at equal angles from 0, at
/// angle `theta`; `change` are the derivatives of `ring` by time (none: zero). Slopes as in [`through`].
pub(super) fn around(ring: &[f64], change: &[f64], theta: f64) -> [f64; 3] {
    let n = ring.len();
    if n < 2 {
        let only = |of: &[f64]| of.first().copied().unwrap_or(0.0);
        return [only(ring), 0.0, only(change)];
    }
    let turn = theta / TAU;
    let place = (turn - turn.floor()) * n as f64;
    let k = (place as usize).min(n - 1);
    let four = |from: &[f64]| [k + n - 1, k, k + 1, k + 2].map(|i| from.get(i % n).copied().unwrap_or(0.0));
    let (p, c) = (four(ring), four(change));
    // Slope at a corner of the ring, and how it changes.
    let slope = |i: usize| {
        let (a, b) = (p[i] - p[i - 1], p[i + 1] - p[i]);
        if a * b <= 0.0 {
            return [0.0; 2];
        }
        let (da, db) = (c[i] - c[i - 1], c[i + 1] - c[i]);
        [2.0 * a * b / (a + b), 2.0 * (b * b * da + a * a * db) / ((a + b) * (a + b))]
    };
    let (m, m_next) = (slope(1), slope(2));
    let (w, d) = weights(place - k as f64);
    let value = [p[1], m[0], p[2], m_next[0]];
    [dot(w, value), dot(d, value) * n as f64 / TAU, dot(w, [c[1], m[1], c[2], m_next[1]])]
}

/// Weights of value, slope, next value, next slope in a cubic piece at `u` in [0, 1], and their derivatives.
fn weights(u: f64) -> ([f64; 4], [f64; 4]) {
    let v = 1.0 - u;
    let w = [(1.0 + 2.0 * u) * v * v, u * v * v, u * u * (3.0 - 2.0 * u), -u * u * v];
    (w, [-6.0 * u * v, v * (v - 2.0 * u), 6.0 * u * v, u * (u - 2.0 * v)])
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng::uniform;

    #[test]
    fn a_curve_goes_through_its_stations_and_stays_between_them() {
        let c = Curve { t: vec![0.0, 0.1, 0.4, 0.7, 1.0], value: vec![1.0, 3.0, 3.5, 0.0, 0.2] };
        assert!(c.check("it").is_ok());
        assert!(c.t.iter().zip(&c.value).all(|(t, v)| (c.at(*t) - v).abs() < 1e-12));
        for i in 0..2000 {
            let t = (f64::from(i) + 0.5) / 2000.0;
            let k = c.t.partition_point(|s| *s <= t) - 1;
            let (low, high) = (c.value[k].min(c.value[k + 1]), c.value[k].max(c.value[k + 1]));
            assert!((low..=high).contains(&c.at(t)), "{t}");
            let h = 1e-6;
            assert!(((c.at(t + h) - c.at(t - h)) / (2.0 * h) - c.slope(t)).abs() < 1e-3, "{t}");
        }
        // One slope from both sides of a station, and straight lines stay straight.
        assert!(c.t[1..4].iter().all(|t| (c.slope(t - 1e-9) - c.slope(t + 1e-9)).abs() < 1e-5));
        let line = Curve { t: vec![0.0, 0.3, 1.0], value: vec![1.0, 1.6, 3.0] };
        assert!((0..=50).map(|k| f64::from(k) / 50.0).all(|t| (line.at(t) - (1.0 + 2.0 * t)).abs() < 1e-12));
        assert_eq!((Curve::constant(2.0).at(0.3), Curve::constant(2.0).slope(0.3)), (2.0, 0.0));
        assert!((c.variation() - 6.2).abs() < 1e-12);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let of =
            |t: &[f64], value: &[f64]| Curve { t: t.to_vec(), value: value.to_vec() }.check("the twist").unwrap_err();
        assert!(of(&[], &[]).contains("the twist has no stations"));
        assert!(of(&[0.0, 1.5], &[1.0, 1.0]).contains("not between 0 and 1"));
        assert!(of(&[0.5, 0.5], &[1.0, 1.0]).contains("go up"));
        assert!(of(&[0.5], &[1.0, 1.0]).contains("1 stations and 2 values"));
        assert!(of(&[0.5], &[f64::NAN]).contains("no number"));
    }

    #[test]
    fn a_ring_is_closed_smooth_and_positive() {
        let ring: Vec<f64> = (0..11).map(|k| 0.01 + uniform(3, k, 0, 0)).collect();
        let change: Vec<f64> = (0..11).map(|k| uniform(4, k, 0, 0) - 0.5).collect();
        let h = 1e-6;
        let later: Vec<f64> = ring.iter().zip(&change).map(|(r, c)| r + h * c).collect();
        let sooner: Vec<f64> = ring.iter().zip(&change).map(|(r, c)| r - h * c).collect();
        for i in 0..1000 {
            let a = f64::from(i) * 0.0173 - 7.0;
            let [v, by_angle, by_time] = around(&ring, &change, a);
            assert!(v > 0.0 && (around(&ring, &[], a + TAU)[0] - v).abs() < 1e-12);
            let fd = (around(&ring, &[], a + h)[0] - around(&ring, &[], a - h)[0]) / (2.0 * h);
            assert!((fd - by_angle).abs() < 1e-4, "{fd} {by_angle}");
            let fd = (around(&later, &[], a)[0] - around(&sooner, &[], a)[0]) / (2.0 * h);
            assert!((fd - by_time).abs() < 1e-4, "{fd} {by_time}");
        }
        assert!((0..11).all(|k| (around(&ring, &[], TAU * k as f64 / 11.0)[0] - ring[k]).abs() < 1e-9));
        assert_eq!(around(&[2.0], &[3.0], 1.0), [2.0, 0.0, 3.0]);
        assert_eq!(around(&[2.0, 2.0], &[], 1.0)[..2], [2.0, 0.0]);
    }
}
