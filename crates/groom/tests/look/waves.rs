use crate::common::*;
use pelage_geom::rng::channel;
use pelage_groom::look::noise::{Noise, noise};
use pelage_groom::look::perlin::{key, perlin1};
use pelage_groom::look::vary::{Drawn, Scale, Vary, factors, shifts};
use pelage_groom::look::wave::{Axis, RootVariable, Shape, Stations, Waves, root_variable, wave};
use pelage_groom::look::wind::{Wind, wind};
use pelage_groom::look::{Param, station_weights};
use std::f64::consts::TAU;

fn stations(mean: [f32; 4], deviation: f32) -> Stations {
    Stations { mean, deviation: [deviation; 4], scale: [5.0, 7.0, 9.0, 11.0] }
}

fn axis() -> Axis {
    Axis {
        amplitude: stations([0.05, 0.1, 0.15, 0.3], 0.1),
        frequency: stations([2.0, 2.5, 3.0, 4.0], 0.5),
        phase: [0.25, 0.5, 3.0],
    }
}

#[test]
fn waves_are_those_of_the_printed_formulas() {
    let (n, points) = (80usize, 25);
    let position = hairs(n, points, 3.0);
    let axes = axes(points, &position);
    let r: Vec<f32> = (0..n).map(|h| h as f32 / 80.0).collect();
    for shape in [Shape::Sine, Shape::Noise] {
        let axis = [axis(), Axis { phase: [0.0, 0.2, 2.0], ..axis() }];
        let w = Waves {
            shape,
            axis,
            strength: Param::constant(0.8),
            r: &r,
            keep_length: false,
            axes: &axes,
            seed: 5,
            channel: 6,
        };
        let mut found = position.clone();
        wave(points, &w, &mut found);
        let random =
            |what: &str, a: usize, i: u32, x: f32| f64::from(perlin1(key(5 ^ channel(what), a as u64, 6) ^ i, x));
        let curve = |v: [f64; 5], l: f64| {
            // Catmull-Rom through stations at 0, 1/4 .. 1, the ends' slopes of the parabola.
            let x = (l * 4.0).min(4.0);
            let i = (x as usize).min(3);
            let t = x - i as f64;
            let slope = |j: usize| match j {
                0 => -1.5 * v[0] + 2.0 * v[1] - 0.5 * v[2],
                4 => 1.5 * v[4] - 2.0 * v[3] + 0.5 * v[2],
                j => 0.5 * (v[j + 1] - v[j - 1]),
            };
            let (a, b) = (v[i], v[i + 1]);
            a + (b - a) * t * t * (3.0 - 2.0 * t) + slope(i) * t * (1.0 - t) * (1.0 - t)
                - slope(i + 1) * t * t * (1.0 - t)
        };
        let mut expected = Vec::new();
        for h in 0..n {
            let hair = &position[h * points..][..points];
            let frames = frames(hair, &axes[h]);
            let total = length(hair);
            let mut arc = 0.0;
            for k in 0..points {
                if k > 0 {
                    arc += (double(hair[k]) - double(hair[k - 1])).norm();
                }
                let l = arc / total;
                let at = |a: usize| {
                    let value = |what: &str, s: &Stations, i: usize| {
                        f64::from(s.mean[i])
                            + f64::from(s.deviation[i]) * random(what, a, i as u32 + 1, r[h] * s.scale[i])
                    };
                    let amplitude: Vec<f64> = (0..4).map(|i| 0.8 * value("amplitude", &axis[a].amplitude, i)).collect();
                    let t: Vec<f64> = (0..4).map(|i| value("frequency", &axis[a].frequency, i)).collect();
                    let p = axis[a].phase;
                    let phase = f64::from(p[0]) + f64::from(p[1]) * random("phase", a, 0, r[h] * p[2]);
                    let amplitude =
                        curve([0.0, amplitude[0], amplitude[1], amplitude[2], amplitude[3]], k as f64 / 24.0);
                    let turns = phase + curve([t[0], t[0], t[1], t[2], t[3]], k as f64 / 24.0) * l;
                    amplitude
                        * match shape {
                            Shape::Sine => (TAU * turns).sin(),
                            Shape::Noise => {
                                f64::from(perlin1(key(5 ^ channel("phase"), a as u64, 6) ^ 0x5bd1_e995, turns as f32))
                            }
                        }
                };
                expected.push(double(hair[k]) + frames[k][1] * at(0) + frames[k][2] * at(1));
            }
        }
        assert!(apart(&found, &expected) < 1e-5, "{shape:?} {}", apart(&found, &expected));
        assert!((0..n).all(|h| found[h * points] == position[h * points]));
        let mut kept = position.clone();
        wave(points, &Waves { keep_length: true, ..w }, &mut kept);
        let same = |(a, b): (&[[f32; 3]], &[[f32; 3]])| (length(a) - length(b)).abs() < 1e-5 * length(b);
        assert!(kept.chunks_exact(points).zip(position.chunks_exact(points)).all(same) && kept != position);
    }
}

#[test]
fn only_strays_leave_where_the_root_variable_is_zero() {
    let (n, points) = (2000usize, 12);
    let position = hairs(n, points, 3.0);
    let axes = axes(points, &position);
    let id: Vec<u64> = (0..n as u64).collect();
    let roots: Vec<[f32; 3]> = position.iter().step_by(points).copied().collect();
    let uv = vec![[0.5; 2]; n];
    let drawn = Drawn { id: &id, uv: &uv, position: &roots, seed: 4 };
    let strays = |stray: f32| root_variable(&drawn, &RootVariable { stray, channel: 8, ..RootVariable::default() });
    let r = strays(0.05);
    let count = r.iter().filter(|r| **r != 0.0).count();
    assert!((70..130).contains(&count), "{count}");
    // A higher share only adds strays.
    assert!(r.iter().zip(strays(0.1)).all(|(a, b)| *a == 0.0 || *a == b));
    let zero = Stations { mean: [0.0; 4], ..stations([0.0; 4], 0.5) };
    let a = Axis { amplitude: zero, ..axis() };
    let w = Waves {
        shape: Shape::Sine,
        axis: [a, a],
        strength: Param::constant(1.0),
        r: &r,
        keep_length: true,
        axes: &axes,
        seed: 5,
        channel: 6,
    };
    let mut out = position.clone();
    wave(points, &w, &mut out);
    for (h, (a, b)) in out.chunks_exact(points).zip(position.chunks_exact(points)).enumerate() {
        assert_eq!(a == b, r[h] == 0.0, "{h}");
    }
}

#[test]
fn noise_has_the_size_asked_for_and_neighbours_are_alike_as_asked() {
    let (n, points) = (3000usize, 60);
    let mut position = Vec::new();
    for h in 0..n as u64 {
        let root = [(r(31, h, 0) * 6.0) as f32, 0.0, (r(31, h, 1) * 6.0) as f32];
        position.extend((0..points).map(|k| [root[0], 0.2 * k as f32, root[2]]));
    }
    let axes = axes(points, &position);
    let id: Vec<u64> = (0..n as u64).collect();
    let roots: Vec<[f32; 3]> = position.iter().step_by(points).copied().collect();
    for across in [0.0, 2.0] {
        let settings = Noise {
            amplitude: Param::constant(0.05),
            size: 1.0,
            across,
            profile: &[],
            keep_length: false,
            id: &id,
            root: &roots,
            axes: &axes,
            seed: 1,
            channel: 2,
        };
        let mut out = position.clone();
        noise(points, &settings, &mut out);
        let (mut square, mut count, mut near, mut pairs) = (0.0, 0.0, 0.0, 0.0);
        let offset = |h: usize, k: usize| double(out[h * points + k]) - double(position[h * points + k]);
        for h in 0..n {
            assert!(out[h * points] == position[h * points]);
            for k in 10..points {
                square += offset(h, k).norm_squared();
                count += 2.0;
            }
            let close = (0..n).filter(|o| *o != h && (double(roots[h]) - double(roots[*o])).norm() < 0.1).take(1);
            for o in close {
                near += (offset(h, 30) - offset(o, 30)).norm_squared();
                pairs += 2.0;
            }
        }
        let (rms, different) = ((square / count).sqrt(), (near / pairs).sqrt());
        assert!((rms / 0.05 - 1.0).abs() < 0.05, "{across} {rms}");
        assert!(if across > 0.0 { different < 0.01 } else { different > 0.05 }, "{across} {different}");
    }
}

#[test]
fn wind_keeps_lengths_and_roots_and_changes_smoothly_in_time() {
    let (n, points) = (300usize, 12);
    let position = hairs(n, points, 3.0);
    let roots: Vec<[f32; 3]> = position.iter().step_by(points).copied().collect();
    let blown = |time: f64, amplitude: f32| {
        let settings = Wind {
            amplitude: Param::constant(amplitude),
            direction: [2.0, 0.0, 0.0],
            frequency: 0.5,
            size: 4.0,
            gust: 0.6,
            time,
            root: &roots,
            seed: 1,
            channel: 2,
        };
        let mut out = position.clone();
        wind(points, &settings, &mut out);
        out
    };
    assert!(blown(1.0, 0.0) == position);
    let now = blown(1.0, 0.8);
    for (a, b) in now.chunks_exact(points).zip(position.chunks_exact(points)) {
        assert!((length(a) - length(b)).abs() < 1e-5 * length(b) && a[0] == b[0]);
    }
    let drift: f64 =
        (0..n).map(|h| f64::from(now[h * points + 11][0] - position[h * points + 11][0])).sum::<f64>() / n as f64;
    assert!((0.4..0.9).contains(&drift), "{drift}");
    let (soon, later) = (blown(1.0 + 1.0 / 96.0, 0.8), blown(2.0, 0.8));
    let moved = |a: &[[f32; 3]]| apart(a, &now.iter().map(|p| double(*p)).collect::<Vec<_>>());
    assert!(moved(&soon) < 0.06 && moved(&later) > 0.2, "{} {}", moved(&soon), moved(&later));
}

#[test]
fn parameters_vary_with_the_deviations_asked_for() {
    let n = 40_000usize;
    let id: Vec<u64> = (0..n as u64).collect();
    let uv = vec![[0.5; 2]; n];
    let position: Vec<[f32; 3]> =
        (0..n as u64).map(|i| [r(41, i, 0), r(41, i, 1), r(41, i, 2)].map(|x| (x * 200.0) as f32)).collect();
    let hairs = Drawn { id: &id, uv: &uv, position: &position, seed: 3 };
    let scales = [Scale { size: 5.0, deviation: 0.15 }, Scale { size: 1.0, deviation: 0.05 }];
    let vary = Vary { map: None, noise: 0.1, scales: &scales, channel: 1 };
    let (f, s) = (factors(&hairs, &vary), shifts(&hairs, &vary));
    for (values, mean) in [(&f, 1.0), (&s, 0.0)] {
        let m = values.iter().map(|x| f64::from(*x)).sum::<f64>() / n as f64;
        let sd = (values.iter().map(|x| (f64::from(*x) - m).powi(2)).sum::<f64>() / n as f64).sqrt();
        let asked = (0.15f64.powi(2) + 0.05f64.powi(2) + 0.1f64.powi(2) / 3.0).sqrt();
        assert!((m - mean).abs() < 0.01 && (sd / asked - 1.0).abs() < 0.05, "{m} {sd} {asked}");
    }
    assert!(factors(&hairs, &Vary::default()).is_empty());
}

#[test]
fn the_weights_of_four_points_are_the_identity() {
    let w = station_weights(4, 4);
    for (k, row) in w.iter().enumerate() {
        for (s, x) in row.iter().enumerate() {
            assert!((x - f32::from(u8::from(k == s))).abs() < 1e-6);
        }
    }
}
