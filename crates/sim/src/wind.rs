//! The wind: a velocity of air at every point and time.
//!
//! `mean velocity * (1 + gust) + turbulence`, with the body as its boundary. A pure function of point and time: nothing
//! is carried from step to step, so every frame can be entered at once.

use crate::Vec3;
use pelage_geom::rng;

/// A wind field. SI units, world coordinates.
///
/// Velocities and strengths may be key-framed: see [`Wind::lerp`]. Periods, sizes and seeds are of the shot: a changing
/// period or size would sweep through the noise at the rate `time / period`.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    /// Mean velocity, metres per second.
    pub velocity: [f64; 3],
    /// How far the mean wind has carried the air since the beginning of time, metres: the integral of `velocity`.
    /// `None`: `velocity` is the same at all times. Key-framed: see [`drift`].
    pub drift: Option<[f64; 3]>,
    /// Largest change of the mean wind in a gust, as a fraction of it.
    pub gust: f64,
    /// Time from one gust to the next, seconds.
    pub gust_period: f64,
    /// Turbulence: root mean square of its speed, metres per second.
    pub turbulence: f64,
    /// Size of its largest eddies, metres.
    pub turbulence_size: f64,
    /// Time in which its largest eddies change while they drift, seconds.
    pub turbulence_period: f64,
    /// Thickness of the layer at a surface in which the air's normal velocity fades, metres.
    pub boundary: f64,
    /// Names the wind's random numbers.
    pub seed: u64,
}

impl Default for Wind {
    /// Still air, with the sizes and times of a light breeze for when strengths are set.
    fn default() -> Self {
        Wind {
            velocity: [0.0; 3],
            drift: None,
            gust: 0.0,
            gust_period: 2.0,
            turbulence: 0.0,
            turbulence_size: 0.2,
            turbulence_period: 1.0,
            boundary: 0.02,
            seed: 0,
        }
    }
}

/// The nearest solid surface, as a point of the air sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Distance, metres; negative inside.
    pub distance: f64,
    /// Outward normal.
    pub normal: Vec3,
    /// Velocity of the solid there, metres per second.
    pub velocity: Vec3,
}

/// Octaves of turbulence, each half the size of the one before. Fewer: eddies of one size, visibly a pattern; more:
/// eddies below 1/8 of the largest, which drag on a whole hair averages away.
const OCTAVES: usize = 3;

/// Speed of each octave relative to the first: Kolmogorov's `size^(1/3)`.
const OCTAVE_SPEED: [f64; OCTAVES] = [1.0, 0.793_700_525_984_099_8, 0.629_960_524_947_436_6];

impl Wind {
    /// Velocity of the air, metres per second, at a point at a time of the shot (seconds), near a surface or far from
    /// any.
    pub fn at(&self, point: Vec3, time: f64, surface: Option<&Surface>) -> Vec3 {
        let free = self.free(point, time);
        surface.map_or(free, |s| beside(free, s, self.boundary))
    }

    /// Velocity of the air far from any body, metres per second.
    pub fn free(&self, point: Vec3, time: f64) -> Vec3 {
        self.mean(time) + self.turbulence_at(point, time)
    }

    /// Velocity of the free air at the points of a strand, evaluated at every `stride`-th point and at the last, linear
    /// in the point's index between.
    ///
    /// An evaluation costs as much as a few linear solves of a point, so it pays to leave some out. Evaluations a
    /// sixteenth of [`Wind::turbulence_size`] apart leave an error of 4 % of the turbulence (RMS); an eighth, 13 %.
    pub fn free_along(&self, points: &[Vec3], stride: usize, time: f64, out: &mut [Vec3]) {
        let mean = self.mean(time);
        let Some(last) = points.len().checked_sub(1) else { return };
        let mut a = 0;
        out[0] = mean + self.turbulence_at(points[0], time);
        while a < last {
            let b = (a + stride.max(1)).min(last);
            out[b] = mean + self.turbulence_at(points[b], time);
            for i in a + 1..b {
                let f = (i - a) as f64 / (b - a) as f64;
                out[i] = out[a] * (1.0 - f) + out[b] * f;
            }
            a = b;
        }
    }

    /// Mean velocity with its gusts, the same everywhere, metres per second.
    pub fn mean(&self, time: f64) -> Vec3 {
        let mean = Vec3::from(self.velocity);
        if self.gust == 0.0 || self.gust_period <= 0.0 {
            return mean;
        }
        // Two octaves, so that gusts are not evenly spaced.
        let t = time / self.gust_period;
        let n = (2.0 * value_noise(self.seed, GUST, t) + value_noise(self.seed, GUST + 1, 2.0 * t)) / 3.0;
        mean * (1.0 + self.gust * n)
    }

    /// Turbulent velocity, metres per second: the curl of a sum of vector noises (R. Bridson, J. Hourihan,
    /// M. Nordenstam, "Curl-noise for procedural fluid flow", SIGGRAPH 2007, section 2.1), so free of divergence.
    ///
    /// The pattern drifts with the mean wind (Taylor's hypothesis), and each octave moves besides in a direction of its
    /// own by its size in its period: eddies slide through each other and the whole changes in time at no cost.
    pub fn turbulence_at(&self, point: Vec3, time: f64) -> Vec3 {
        if self.turbulence == 0.0 || self.turbulence_size <= 0.0 {
            return Vec3::zeros();
        }
        let drift = self.drift.map_or_else(|| Vec3::from(self.velocity) * time, Vec3::from);
        let total: f64 = OCTAVE_SPEED.iter().map(|s| s * s).sum();
        let mut sum = Vec3::zeros();
        let (mut size, mut period) = (self.turbulence_size, self.turbulence_period);
        for (octave, speed) in OCTAVE_SPEED.iter().enumerate() {
            let key = rng::key(self.seed, octave as u64, TURBULENCE);
            let own = if period > 0.0 {
                Vec3::from(SLOPES[(key >> 56) as usize][0]) * (time / period)
            } else {
                Vec3::zeros()
            };
            let x = (point - drift) / size + own;
            sum += curl_noise(key, x) * (speed / CURL_RMS);
            // Turn-over time goes as size / speed, with octaves' speed as size^(1/3).
            period *= 0.5 / OCTAVE_SPEED[1];
            size *= 0.5;
        }
        sum * (self.turbulence / total.sqrt())
    }

    /// Between two keys, `f` from 0 to 1: velocity, drift, strengths and boundary are linear; sizes, periods and seed
    /// are those of `a`.
    pub fn lerp(a: &Wind, b: &Wind, f: f64) -> Wind {
        let l = |x: f64, y: f64| x * (1.0 - f) + y * f;
        let v = |x: [f64; 3], y: [f64; 3]| std::array::from_fn(|i| l(x[i], y[i]));
        Wind {
            velocity: v(a.velocity, b.velocity),
            drift: a.drift.zip(b.drift).map(|(x, y)| v(x, y)),
            gust: l(a.gust, b.gust),
            turbulence: l(a.turbulence, b.turbulence),
            boundary: l(a.boundary, b.boundary),
            ..*a
        }
    }
}

/// Integral of a key-framed velocity from its first key to `time`, metres: [`Wind::drift`].
///
/// `keys` are (seconds, metres per second), in order of time; linear in between, constant before and after.
pub fn drift(keys: &[(f64, [f64; 3])], time: f64) -> [f64; 3] {
    let (Some(first), Some(last)) = (keys.first(), keys.last()) else { return [0.0; 3] };
    let mut sum = Vec3::from(first.1) * (time.min(first.0) - first.0);
    for k in keys.windows(2) {
        let ((t0, v0), (t1, v1)) = (k[0], k[1]);
        let end = time.clamp(t0, t1);
        if end > t0 {
            let (v0, v1) = (Vec3::from(v0), Vec3::from(v1));
            let at_end = v0 + (v1 - v0) * ((end - t0) / (t1 - t0));
            sum += (v0 + at_end) * (0.5 * (end - t0));
        }
    }
    (sum + Vec3::from(last.1) * (time.max(last.0) - last.0)).into()
}

/// The velocity that free air takes beside a solid: its component normal to the surface, relative to the solid, fades
/// to zero over `thickness`.
///
/// The ramp is Bridson's (2007, equation 4), on the normal component itself and not on the potential: the potential of
/// the mean wind grows with the distance from an arbitrary origin, and so would its product with the ramp's gradient.
/// So the field is free of divergence farther than `thickness` from a body, and not within.
pub fn beside(free: Vec3, surface: &Surface, thickness: f64) -> Vec3 {
    if surface.distance >= thickness {
        return free;
    }
    let r = if surface.distance > 0.0 { surface.distance / thickness } else { 0.0 };
    let ramp = r * (15.0 / 8.0 - r * r * (10.0 / 8.0 - r * r * (3.0 / 8.0)));
    let normal = (free - surface.velocity).dot(&surface.normal);
    free - surface.normal * ((1.0 - ramp) * normal)
}

const GUST: u64 = rng::channel("wind gust");
const TURBULENCE: u64 = rng::channel("wind turbulence");

/// `6 t^5 - 15 t^4 + 10 t^3` and its derivative: joins cells with continuous second derivatives.
fn quintic(t: f64) -> (f64, f64) {
    let u = t * (t - 1.0);
    (t * t * t * (10.0 - t * (15.0 - t * 6.0)), 30.0 * u * u)
}

/// 256 random triples of slopes, each component evenly spread over (-1, 1) in steps of 1/64: made once, they
/// save a fifth of an evaluation. Fewer: the eye finds equal corners in a plane of noise; more leave the nearest cache.
static SLOPES: [[[f64; 3]; 3]; 256] = slopes();

/// SplitMix64 (G. L. Steele, D. Lea, C. H. Flood 2014): 64 random bits for a number, while compiling.
const fn split_mix(i: u64) -> u64 {
    let mut x = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

const fn slopes() -> [[[f64; 3]; 3]; 256] {
    let mut table = [[[0.0; 3]; 3]; 256];
    let mut i = 0;
    while i < 256 {
        let bits = split_mix(i as u64);
        let mut k = 0;
        while k < 9 {
            table[i][k / 3][k % 3] = (((bits << (7 * k)) as i64 >> 57) as f64 + 0.5) / 64.0;
            k += 1;
        }
        i += 1;
    }
    table
}

/// Smooth noise in one variable, in [-1, 1], with a random value at every integer.
fn value_noise(seed: u64, channel: u64, t: f64) -> f64 {
    let cell = t.floor();
    let value = |i: i64| 2.0 * rng::uniform(seed, 0, channel, i as u64) - 1.0;
    let (a, b) = (value(cell as i64), value((cell as i64).wrapping_add(1)));
    a + (b - a) * quintic(t - cell).0
}

/// Root mean square of the length of `curl_noise`: a mean over corners and a cell of the squared weights and their
/// slopes, see the test that derives it.
const CURL_RMS: f64 = 1.220_08;

/// Curl of a vector potential whose three components are gradient noises (K. Perlin, SIGGRAPH 2002) on the integer
/// lattice, with random slopes in the unit box. Continuous first derivatives.
fn curl_noise(key: u64, x: Vec3) -> Vec3 {
    let cell = x.map(f64::floor);
    let f = x - cell;
    // Of both ends of the cell along an axis: weight, its slope, distance.
    let ends = |t: f64| {
        let (w, dw) = quintic(t);
        [(1.0 - w, -dw, t), (w, dw, t - 1.0)]
    };
    let (wx, wy, wz) = (ends(f.x), ends(f.y), ends(f.z));
    let lattice = |c: f64, shift: u32| [0, 1].map(|o| ((c as i64).wrapping_add(o) as u64 & 0x1f_ffff) << shift);
    let (lx, ly, lz) = (lattice(cell.x, 0), lattice(cell.y, 21), lattice(cell.z, 42));
    let mut curl = Vec3::zeros();
    for corner in 0..8 {
        let (i, j, k) = (corner & 1, corner >> 1 & 1, corner >> 2);
        let ((ax, sx, x), (ay, sy, y), (az, sz, z)) = (wx[i], wy[j], wz[k]);
        let bits = rng::mix(key ^ (lx[i] | ly[j] | lz[k]));
        let weight = ax * ay * az;
        let slope_of_weight = Vec3::new(sx * ay * az, ax * sy * az, ax * ay * sz);
        let g = &SLOPES[(bits >> 56) as usize];
        // Potential `weight * (g_i . d)`: its curl is grad(weight) x (G d) + weight * curl(G d).
        let dot = |g: &[f64; 3]| g[0] * x + g[1] * y + g[2] * z;
        let potential = Vec3::new(dot(&g[0]), dot(&g[1]), dot(&g[2]));
        let turn = Vec3::new(g[2][1] - g[1][2], g[0][2] - g[2][0], g[1][0] - g[0][1]);
        curl += slope_of_weight.cross(&potential) + turn * weight;
    }
    curl
}

#[cfg(test)]
mod tests {
    use super::*;

    fn breeze() -> Wind {
        Wind {
            velocity: [3.0, 0.5, -1.0],
            gust: 0.5,
            turbulence: 1.2,
            turbulence_size: 0.1,
            seed: 7,
            ..Wind::default()
        }
    }

    /// Points spread over many cells.
    fn points(n: u64) -> impl Iterator<Item = Vec3> {
        (0..n).map(|i| Vec3::from_fn(|a, _| rng::uniform(11, i, a as u64, 0) * 80.0 - 40.0))
    }

    #[test]
    fn turbulence_has_no_divergence_and_is_smooth() {
        let wind = Wind { turbulence: 1.0, turbulence_size: 1.0, ..Wind::default() };
        let h = 1e-4;
        let axis = |i: usize| Vec3::ith(i, h);
        for p in points(300) {
            let slope: Vec<Vec3> = (0..3)
                .map(|i| (wind.turbulence_at(p + axis(i), 0.3) - wind.turbulence_at(p - axis(i), 0.3)) / (2.0 * h))
                .collect();
            let divergence: f64 = (0..3).map(|i| slope[i][i]).sum();
            let size: f64 = slope.iter().map(|s| s.norm()).sum();
            assert!(divergence.abs() < 1e-4 * (1.0 + size), "{p}: {divergence} of {size}");
            assert!(size < 60.0);
        }
    }

    #[test]
    fn turbulence_has_the_strength_asked_for_and_no_mean() {
        // Squared weights and slopes of the quintic over a cell give the constant.
        let n = 400;
        let mean =
            |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f((f64::from(i) + 0.5) / f64::from(n))).sum::<f64>() / f64::from(n);
        // Both corners of a cell are alike by symmetry, so 8 corners are 8 times the one at 0. With w the weight and
        // G the 3 x 3 slopes, each of variance 1/3: curl = grad w x G d + w curl G.
        // |grad w x G d|^2 -> 2/3 |grad w|^2 |d|^2; |w curl G|^2 -> 2 w^2; cross term: 2 w (grad w x G d) . curl G
        // -> 4/3 w (grad w . d).
        let w = |t: f64| 1.0 - quintic(t).0;
        let dw = |t: f64| -quintic(t).1;
        let m = |f: &dyn Fn(f64) -> f64| mean(f);
        let ww = m(&|t| w(t) * w(t));
        let wwtt = m(&|t| w(t) * w(t) * t * t);
        let dd = m(&|t| dw(t) * dw(t));
        let ddtt = m(&|t| dw(t) * dw(t) * t * t);
        let wdt = m(&|t| w(t) * dw(t) * t);
        let grad_d = 3.0 * (ddtt * ww * ww + 2.0 * dd * wwtt * ww);
        let variance = 8.0 * (2.0 / 3.0 * grad_d + 2.0 * ww * ww * ww + 4.0 / 3.0 * 3.0 * wdt * ww * ww);
        assert!((variance.sqrt() / CURL_RMS - 1.0).abs() < 1e-4, "{}", variance.sqrt());

        let wind = breeze();
        let n = 20_000;
        let (mut sum, mut square) = (Vec3::zeros(), 0.0);
        for p in points(n) {
            let u = wind.turbulence_at(p, 2.5);
            sum += u;
            square += u.norm_squared();
        }
        let rms = (square / n as f64).sqrt();
        assert!((rms / wind.turbulence - 1.0).abs() < 0.02, "{rms}");
        assert!((sum / n as f64).norm() < 0.03 * wind.turbulence, "{sum}");
    }

    #[test]
    fn leaving_out_points_of_a_strand_costs_little() {
        let wind = Wind { turbulence: 1.0, turbulence_size: 0.2, ..Wind::default() };
        let error = |stride: usize| {
            let (mut square, mut n) = (0.0, 0);
            for p in points(200) {
                let hair: Vec<Vec3> =
                    (0..101).map(|i| p + Vec3::new(0.48, 0.6, -0.64) * (f64::from(i) * 2.5e-3)).collect();
                let mut out = vec![Vec3::zeros(); hair.len()];
                wind.free_along(&hair, stride, 0.2, &mut out);
                for (u, x) in out.iter().zip(&hair) {
                    square += (u - wind.free(*x, 0.2)).norm_squared();
                    n += 1;
                }
            }
            (square / f64::from(n)).sqrt()
        };
        assert_eq!(error(1), 0.0);
        let (sixteenth, eighth) = (error(5), error(10));
        assert!(sixteenth < 0.045 && eighth < 0.15, "{sixteenth} {eighth}");
        wind.free_along(&[], 3, 0.0, &mut []);
    }

    #[test]
    fn turbulence_drifts_with_the_wind_and_changes_in_its_period() {
        let frozen = Wind { turbulence_period: f64::INFINITY, ..breeze() };
        let wind = breeze();
        let (mut together, mut apart, mut square) = (0.0, 0.0, 0.0);
        for p in points(4000) {
            let now = frozen.turbulence_at(p, 1.0);
            let later = frozen.turbulence_at(p + Vec3::from(wind.velocity) * 0.7, 1.7);
            assert!((now - later).norm() < 1e-9);
            let a = wind.turbulence_at(p, 1.0);
            square += a.norm_squared();
            together += a.dot(&wind.turbulence_at(p + Vec3::from(wind.velocity) * 0.02, 1.02));
            apart += a.dot(&wind.turbulence_at(p + Vec3::from(wind.velocity) * 3.0, 4.0));
        }
        assert!(together / square > 0.9 && (apart / square).abs() < 0.1, "{} {}", together / square, apart / square);
    }

    #[test]
    fn gusts_stay_in_bounds_and_reach_near_them() {
        let wind = breeze();
        let mean = Vec3::from(wind.velocity);
        let factor = |t: f64| wind.mean(t).dot(&mean) / mean.norm_squared();
        let all: Vec<f64> = (0..20_000).map(|i| factor(f64::from(i) * 0.02)).collect();
        let (lo, hi) = all.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        assert!((0.5..0.65).contains(&lo) && (1.35..=1.5).contains(&hi), "{lo} {hi}");
        // Smooth: steps are bounded by 15/8 per unit of noise and period.
        let largest = all.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        assert!(largest <= 0.02 / wind.gust_period * 0.5 * 2.0 * 2.0 * 15.0 / 8.0, "{largest}");
        // No point or time is too far to ask for.
        for far in [1e9, -1e18, f64::INFINITY, f64::NAN] {
            let u = wind.at(Vec3::new(far, 0.0, 0.0), 1.0, None);
            assert!(u.iter().all(|x| x.is_finite()) || !far.is_finite());
        }
        // The past has wind too.
        assert!(wind.at(Vec3::zeros(), -3.2, None).iter().all(|x| x.is_finite()));
    }

    #[test]
    fn a_solid_stops_the_air_that_blows_into_it_and_no_other() {
        let wind = breeze();
        let normal = Vec3::new(0.6, 0.8, 0.0);
        let velocity = Vec3::new(0.3, -2.0, 1.0);
        let p = Vec3::new(0.4, 0.2, 0.9);
        let free = wind.at(p, 0.4, None);
        let at = |distance: f64| wind.at(p, 0.4, Some(&Surface { distance, normal, velocity }));
        for d in [-1.0, 0.0] {
            assert!((at(d) - velocity).dot(&normal).abs() < 1e-12);
        }
        assert_eq!(at(wind.boundary), free);
        assert_eq!(at(1.0), free);
        let mut last = 0.0;
        for i in 0..=20 {
            let u = at(wind.boundary * f64::from(i) / 20.0);
            let through = (u - velocity).dot(&normal) / (free - velocity).dot(&normal);
            assert!(through >= last - 1e-12 && through <= 1.0 + 1e-12);
            last = through;
            // What runs along the surface is untouched.
            let along = |x: Vec3| x - normal * x.dot(&normal);
            assert!((along(u) - along(free)).norm() < 1e-12);
        }
        // No layer: a step at the surface, still defined.
        assert!(beside(free, &Surface { distance: 0.0, normal, velocity }, 0.0).iter().all(|x| x.is_finite()));
    }

    #[test]
    fn keys_integrate_to_the_drift() {
        let keys = [(1.0, [1.0, 0.0, 0.0]), (3.0, [3.0, 2.0, 0.0]), (3.0, [0.0, 0.0, 1.0]), (4.0, [0.0, 0.0, 5.0])];
        assert_eq!(drift(&keys, 1.0), [0.0; 3]);
        assert_eq!(drift(&keys, 0.0), [-1.0, 0.0, 0.0]);
        assert_eq!(drift(&keys, 2.0), [1.5, 0.5, 0.0]);
        assert_eq!(drift(&keys, 6.0), [4.0, 2.0, 13.0]);
        assert_eq!(drift(&[], 2.0), [0.0; 3]);
        // The derivative is the velocity.
        let h = 1e-6;
        let (a, b) = (drift(&keys, 2.4 - h), drift(&keys, 2.4 + h));
        assert!(((b[0] - a[0]) / (2.0 * h) - 2.4).abs() < 1e-6);
    }

    #[test]
    fn lerp_meets_its_ends() {
        let a = breeze();
        let b = Wind { velocity: [0.0, 0.0, 4.0], gust: 0.1, turbulence: 0.0, boundary: 0.1, ..a.clone() };
        assert_eq!(Wind::lerp(&a, &b, 0.0), a);
        assert_eq!(Wind::lerp(&a, &b, 1.0), b);
        let half = Wind::lerp(&a, &b, 0.5);
        assert_eq!(half.velocity, [1.5, 0.25, 1.5]);
        assert_eq!(half.turbulence, 0.6);
    }

    #[test]
    fn values_are_fixed() {
        // The same on every machine: a change here changes every shot with wind.
        let u = breeze().at(Vec3::new(0.1, -0.2, 0.3), 1.25, None);
        assert_eq!(u, Vec3::new(3.506923487441993, -0.03811368106653579, -1.3451225467494847));
    }
}
