//! The line that a cluster follows: a Catmull-Rom spline by its arc length, with frames that do not turn about it.

use pelage_geom::Vec3;

/// Parts that a piece of the spline is cut in, for its table of arc lengths and frames. On a helix with a control point
/// every quarter turn, frames are off by 5e-5 radians a piece with 4 parts, by 1e-6 with 8; more parts only cost time.
const PARTS: usize = 8;

/// A Catmull-Rom spline through control points, by arc length, with rotation-minimising frames.
///
/// Knots are centripetal (square roots of the distances), so that control points at unequal distances make no loops.
/// At an end the spline sets out along its chord.
#[derive(Clone, Debug)]
pub struct Skeleton {
    control: Vec<Vec3>,
    /// \[M - 1\] derivatives of each piece at its two ends, by its parameter from 0 to 1.
    ends: Vec<[Vec3; 2]>,
    /// \[(M - 1) PARTS + 1\] nodes of the table.
    node: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    arc: f64,
    at: Vec3,
    tangent: Vec3,
    normal: Vec3,
}

/// A point of a skeleton with its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The point, scene units.
    pub at: Vec3,
    /// Unit tangent T.
    pub tangent: Vec3,
    /// Unit normal N.
    pub normal: Vec3,
    /// Derivative of T by arc length, 1 over scene units.
    pub bend: Vec3,
}

impl Place {
    /// B = T x N.
    pub fn binormal(&self) -> Vec3 {
        self.tangent.cross(&self.normal)
    }
}

impl Skeleton {
    /// The spline through `control` (two points or more). Its first normal is `side` after the smallest rotation that
    /// turns `axis` into its first tangent; both are made unit and `side` orthogonal to `axis`.
    pub fn new(control: &[Vec3], axis: Vec3, side: Vec3) -> Result<Self, String> {
        if control.len() < 2 {
            return Err(format!("a skeleton needs 2 control points or more, not {}", control.len()));
        }
        if !control.iter().all(|p| p.iter().all(|x| x.is_finite())) {
            return Err("a control point of the skeleton is no number".into());
        }
        if let Some(k) = control.windows(2).position(|w| w[0] == w[1]) {
            return Err(format!("control points {k} and {} of the skeleton are the same", k + 1));
        }
        let axis = axis.try_normalize(1e-12).ok_or("the axis of the root has no direction")?;
        let side =
            (side - axis * axis.dot(&side)).try_normalize(1e-9).ok_or("the side of the root is along its axis")?;
        let ends = end_slopes(control);
        let mut out = Skeleton { control: control.to_vec(), ends, node: Vec::new() };
        let first = out.direction(0, 0.0);
        let normal = turned(side, axis, first);
        out.node.push(Node { arc: 0.0, at: control[0], tangent: first, normal });
        for piece in 0..control.len() - 1 {
            for part in 0..PARTS {
                let (from, to) = (part as f64 / PARTS as f64, (part + 1) as f64 / PARTS as f64);
                let before = out.node[out.node.len() - 1];
                let (at, tangent) = (out.point(piece, to), out.direction(piece, to));
                let normal = before.carried(at, tangent);
                out.node.push(Node { arc: before.arc + out.way(piece, from, to), at, tangent, normal });
            }
        }
        Ok(out)
    }

    /// Length, scene units.
    pub fn length(&self) -> f64 {
        self.node[self.node.len() - 1].arc
    }

    /// The control points.
    pub fn control(&self) -> &[Vec3] {
        &self.control
    }

    /// \[M\] parameters from 0 to 1 of the control points.
    pub fn control_t(&self) -> Vec<f64> {
        let length = self.length();
        let mut t: Vec<f64> = (0..self.control.len()).map(|k| self.node[k * PARTS].arc / length).collect();
        t[self.control.len() - 1] = 1.0;
        t
    }

    /// Point and frame at `t`, clamped to [0, 1].
    pub fn place(&self, t: f64) -> Place {
        let arc = t.clamp(0.0, 1.0) * self.length();
        let j = (self.node.partition_point(|n| n.arc <= arc).max(1) - 1).min(self.node.len() - 2);
        let (piece, part) = (j / PARTS, j % PARTS);
        let (low, high) = (part as f64 / PARTS as f64, (part + 1) as f64 / PARTS as f64);
        let (a, b) = (&self.node[j], &self.node[j + 1]);
        let rest = arc - a.arc;
        let mut u = low + (high - low) * (rest / (b.arc - a.arc)).clamp(0.0, 1.0);
        for _ in 0..8 {
            let off = self.way(piece, low, u) - rest;
            u = (u - off / self.derivative(piece, u).norm()).clamp(low, high);
            if off.abs() <= 1e-14 * self.length() {
                break;
            }
        }
        let (at, tangent) = (self.point(piece, u), self.direction(piece, u));
        let d = self.derivative(piece, u);
        let dd = self.second(piece, u);
        let bend = (dd - tangent * tangent.dot(&dd)) / d.norm_squared();
        Place { at, tangent, normal: a.carried(at, tangent), bend }
    }

    /// Parameters of all points whose section goes through `p` and that are nearer to it than their neighbours, and
    /// those of ends that are; at least one, from root to tip.
    pub fn feet(&self, p: Vec3) -> Vec<f64> {
        let beyond = |n: &Node| (p - n.at).dot(&n.tangent);
        let last = self.node.len() - 1;
        let mut out = Vec::new();
        if beyond(&self.node[0]) <= 0.0 {
            out.push(0.0);
        }
        for j in 0..last {
            if beyond(&self.node[j]) > 0.0 && beyond(&self.node[j + 1]) <= 0.0 {
                let piece = j / PARTS;
                let start = (j % PARTS) as f64 / PARTS as f64;
                let (mut low, mut high) = (start, (j % PARTS + 1) as f64 / PARTS as f64);
                // Halving, 50 times: 1e-16 of a piece. Points that lie on the skeleton make Newton's steps no better.
                for _ in 0..50 {
                    let u = 0.5 * (low + high);
                    let ahead = (p - self.point(piece, u)).dot(&self.derivative(piece, u)) > 0.0;
                    *(if ahead { &mut low } else { &mut high }) = u;
                }
                out.push((self.node[j].arc + self.way(piece, start, high)) / self.length());
            }
        }
        if beyond(&self.node[last]) > 0.0 {
            out.push(1.0);
        }
        out
    }

    fn point(&self, piece: usize, u: f64) -> Vec3 {
        let [da, db] = self.ends[piece];
        crate::spline::hermite(self.control[piece], da, self.control[piece + 1], db, u)
    }

    fn derivative(&self, piece: usize, u: f64) -> Vec3 {
        let (v, [da, db]) = (1.0 - u, self.ends[piece]);
        let chord = self.control[piece + 1] - self.control[piece];
        chord * (6.0 * u * v) + da * (v * (v - 2.0 * u)) + db * (u * (u - 2.0 * v))
    }

    fn second(&self, piece: usize, u: f64) -> Vec3 {
        let [da, db] = self.ends[piece];
        let chord = self.control[piece + 1] - self.control[piece];
        chord * (6.0 - 12.0 * u) + da * (6.0 * u - 4.0) + db * (6.0 * u - 2.0)
    }

    fn direction(&self, piece: usize, u: f64) -> Vec3 {
        let chord = self.control[piece + 1] - self.control[piece];
        self.derivative(piece, u).try_normalize(1e-12 * chord.norm()).unwrap_or_else(|| chord.normalize())
    }

    /// Arc length of a piece between two parameters, by Gauss' rule of five points.
    fn way(&self, piece: usize, from: f64, to: f64) -> f64 {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let speed = |x: f64| self.derivative(piece, middle + half * x).norm();
        let inner = speed(-GAUSS[0].0) + speed(GAUSS[0].0);
        let outer = speed(-GAUSS[1].0) + speed(GAUSS[1].0);
        half * (128.0 / 225.0 * speed(0.0) + GAUSS[0].1 * inner + GAUSS[1].1 * outer)
    }
}

/// Abscissae and weights of Gauss' rule of five points, beside the middle.
const GAUSS: [(f64, f64); 2] =
    [(0.538_469_310_105_683_1, 0.478_628_670_499_366_47), (0.906_179_845_938_664, 0.236_926_885_056_189_08)];

impl Node {
    /// Its normal carried to a next point with tangent `to`: two reflections, one that exchanges the points and one
    /// that brings the tangent home (Wang, Juettler, Zheng, Liu 2008, "Computation of rotation minimizing frames").
    fn carried(&self, at: Vec3, to: Vec3) -> Vec3 {
        let reflect = |v: Vec3, along: Vec3| {
            let square = along.norm_squared();
            if square > 0.0 { v - along * (2.0 * along.dot(&v) / square) } else { v }
        };
        let way = at - self.at;
        if way.norm_squared() == 0.0 {
            return self.normal;
        }
        let n = reflect(reflect(self.normal, way), to - reflect(self.tangent, way));
        (n - to * to.dot(&n)).try_normalize(0.0).unwrap_or(self.normal)
    }
}

/// `v`, at right angles to the unit vector `from`, after the smallest rotation of `from` into the unit vector `to`.
/// Where `to` is opposite, half a turn about `v`.
pub(super) fn turned(v: Vec3, from: Vec3, to: Vec3) -> Vec3 {
    let whole = 1.0 + from.dot(&to);
    if whole < 1e-9 {
        return v;
    }
    let w = v - (from + to) * (v.dot(&to) / whole);
    (w - to * to.dot(&w)).normalize()
}

/// Derivatives of the pieces at their ends.
fn end_slopes(control: &[Vec3]) -> Vec<[Vec3; 2]> {
    let step = |k: usize| (control[k + 1] - control[k]).norm().sqrt();
    let slope = |k: usize| {
        // By the knots.
        let (d, e) = (step(k - 1), step(k));
        let (a, b) = ((control[k] - control[k - 1]) / d, (control[k + 1] - control[k]) / e);
        a + b - (control[k + 1] - control[k - 1]) / (d + e)
    };
    let last = control.len() - 1;
    let piece = |k: usize| {
        let chord = control[k + 1] - control[k];
        let at = |i: usize| if i == 0 || i == last { chord } else { slope(i) * step(k) };
        [at(k), at(k + 1)]
    };
    (0..last).map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn helix(n: usize, turns: f64, radius: f64, rise: f64) -> Vec<Vec3> {
        let at = |k: usize| {
            let a = std::f64::consts::TAU * turns * k as f64 / (n - 1) as f64;
            Vec3::new(radius * libm::cos(a), radius * libm::sin(a), rise * a)
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn it_goes_through_its_control_points_at_even_speed() {
        let control = [(0.0, 0.0, 0.0), (0.1, 0.0, 1.0), (2.0, 0.3, 1.2), (2.1, 0.3, 1.2), (3.0, -1.0, 0.0)]
            .map(|(x, y, z)| Vec3::new(x, y, z));
        let s = Skeleton::new(&control, Vec3::z(), Vec3::x()).expect("a skeleton");
        let (t, length) = (s.control_t(), s.length());
        assert!(t.iter().zip(&control).all(|(t, p)| (s.place(*t).at - p).norm() < 1e-11));
        // Arc length against many chords.
        let n = 20_000;
        let points: Vec<Vec3> = (0..=n).map(|k| s.place(f64::from(k) / f64::from(n)).at).collect();
        let chords: Vec<f64> = points.windows(2).map(|w| (w[1] - w[0]).norm()).collect();
        assert!((chords.iter().sum::<f64>() / length - 1.0).abs() < 1e-6);
        assert!(chords.iter().all(|c| (c * f64::from(n) / length - 1.0).abs() < 1e-4));
        for k in 1..100 {
            let (t, h) = (f64::from(k) / 100.0, 1e-6);
            let p = s.place(t);
            let d = (s.place(t + h).at - s.place(t - h).at) / (2.0 * h * length);
            assert!((d - p.tangent).norm() < 1e-5);
            let bend = (s.place(t + h).tangent - s.place(t - h).tangent) / (2.0 * h * length);
            assert!((bend - p.bend).norm() < 1e-3 * (1.0 + bend.norm()), "{t}: {bend} {}", p.bend);
            assert!(p.tangent.dot(&p.normal).abs() < 1e-12 && (p.normal.norm() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn frames_do_not_turn_about_the_tangent() {
        let s = Skeleton::new(&helix(33, 2.0, 1.0, 0.2), Vec3::z(), Vec3::x()).expect("a skeleton");
        let turn_rate = |t: f64, h: f64| {
            let (a, b) = (s.place(t - h), s.place(t + h));
            (b.normal - a.normal).dot(&s.place(t).binormal()) / (2.0 * h * s.length())
        };
        assert!((1..200).all(|k| turn_rate(f64::from(k) / 200.0, 1e-5).abs() < 1e-3));
        // Against the inner normal of a helix, which turns about the tangent by the torsion.
        let angle = |t: f64| {
            let p = s.place(t);
            let inward = -Vec3::new(p.at.x, p.at.y, 0.0);
            libm::atan2(inward.dot(&p.binormal()), inward.dot(&p.normal))
        };
        let torsion = 0.2 / (1.0 + 0.04);
        let (from, to) = (0.2, 0.6);
        let wanted = torsion * (to - from) * s.length();
        let turns = ((angle(to) - angle(from) - wanted) / std::f64::consts::TAU).round();
        let got = angle(to) - angle(from) - turns * std::f64::consts::TAU;
        assert!((got - wanted).abs() < 5e-3, "{got} {wanted}");
        // In a plane the frame stays in it.
        let flat: Vec<Vec3> = helix(9, 0.7, 2.0, 0.0);
        let s = Skeleton::new(&flat, Vec3::y(), Vec3::z()).expect("a skeleton");
        assert!((0..=50).all(|k| (s.place(f64::from(k) / 50.0).normal - Vec3::z()).norm() < 1e-9));
    }

    #[test]
    fn feet_are_all_nearest_points() {
        let s = Skeleton::new(&helix(25, 2.0, 1.0, 0.1), Vec3::z(), Vec3::x()).expect("a skeleton");
        for k in 0..40u64 {
            let p = Vec3::from_fn(|i, _| 3.0 * pelage_geom::rng::uniform(5, k, 0, i as u64) - 1.2);
            let distance = |t: f64| (s.place(t).at - p).norm();
            let feet = s.feet(p);
            let nearest = feet.iter().map(|t| distance(*t)).fold(f64::INFINITY, f64::min);
            let scan = (0..=2000).map(|k| distance(f64::from(k) / 2000.0)).fold(f64::INFINITY, f64::min);
            assert!(nearest <= scan + 1e-12 && nearest > scan - 1e-3);
            for t in feet.into_iter().filter(|t| *t > 0.0 && *t < 1.0) {
                let place = s.place(t);
                assert!((p - place.at).dot(&place.tangent).abs() < 1e-9);
                assert!(distance(t) <= distance(t + 1e-4) + 1e-9 && distance(t) <= distance(t - 1e-4) + 1e-9);
            }
        }
        assert_eq!(s.feet(Vec3::new(1.0, -9.0, 0.0))[0], 0.0);
    }

    #[test]
    fn what_is_wrong_is_said() {
        let of = |c: &[Vec3], axis, side| Skeleton::new(c, axis, side).map(|_| ()).unwrap_err();
        assert!(of(&[Vec3::x()], Vec3::x(), Vec3::y()).contains("not 1"));
        assert!(of(&[Vec3::x(), Vec3::x()], Vec3::x(), Vec3::y()).contains("0 and 1"));
        assert!(of(&[Vec3::x(), Vec3::y() * f64::NAN], Vec3::x(), Vec3::y()).contains("no number"));
        assert!(of(&[Vec3::x(), Vec3::y()], Vec3::zeros(), Vec3::y()).contains("no direction"));
        assert!(of(&[Vec3::x(), Vec3::y()], Vec3::y(), Vec3::y()).contains("along its axis"));
        // Back into the skin: still a frame.
        let s = Skeleton::new(&[Vec3::zeros(), -Vec3::z()], Vec3::z(), Vec3::x()).expect("a skeleton");
        assert_eq!(s.place(0.5).normal, Vec3::x());
    }
}
