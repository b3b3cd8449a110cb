use crate::common::*;
use pelage_groom::look::Param;
use pelage_groom::look::axes::RootAxes;
use pelage_groom::look::curl::{Curl, Wave, curl, dished, helix, uniplanar};
use std::f64::consts::TAU;

fn settings<'a>(wave: [Wave; 2], radius: f32, pitch: f32, axes: &'a [RootAxes]) -> Curl<'a> {
    Curl {
        wave,
        radius: Param::constant(radius),
        pitch: Param::constant(pitch),
        phase: Param::constant(0.0),
        angle: Param::constant(0.0),
        tighten: Param::constant(0.0),
        start: 0.5,
        profile: &[],
        keep_length: false,
        axes,
    }
}

#[test]
fn offsets_are_those_of_the_printed_functions() {
    let points = 40;
    let position = hairs(60, points, 3.0);
    let axes = axes(points, &position);
    let x = Wave {
        a: 0.1,
        b: 0.2,
        alpha: 0.7,
        c: 0.05,
        beta: 0.4,
        d: 0.02,
        gamma: 0.8,
        t0: 2.5,
        r: 0.11,
        p0: 0.4,
        phase: 0.2,
        bias: 0.03,
    };
    let y = Wave { a: 0.05, p0: 0.9, r: -0.05, phase: 0.6, ..Wave::NONE };
    let c = Curl {
        phase: Param::constant(0.15),
        angle: Param::constant(0.1),
        start: 0.8,
        ..settings([x, y], 1.0, 1.0, &axes)
    };
    let mut found = position.clone();
    curl(points, &c, &mut found);
    let wave = |w: &Wave, t: f64| {
        let f = |x: f32| f64::from(x);
        let mag = f(w.a)
            + f(w.b) * t * (-f(w.alpha) * t).exp()
            + f(w.c) * (1.0 - (-f(w.beta) * t).exp())
            + f(w.d) * (f(w.gamma) * (t - f(w.t0))).exp();
        mag * (TAU * ((f(w.r) * t + f(w.p0)) * t + f(w.phase) + 0.15)).sin() + f(w.bias)
    };
    let mut expected = Vec::new();
    for (hair, root) in position.chunks_exact(points).zip(&axes) {
        let frames = frames(hair, root);
        let mut t = 0.0;
        for k in 0..points {
            if k > 0 {
                t += (double(hair[k]) - double(hair[k - 1])).norm();
            }
            let s: f64 = (t / 0.8).min(1.0);
            let fade = s * s * (3.0 - 2.0 * s);
            let (a, b) = (fade * wave(&x, t), fade * wave(&y, t));
            let (sin, cos) = (TAU * 0.1f32 as f64).sin_cos();
            let (u, v) = (a * cos - b * sin, a * sin + b * cos);
            expected.push(double(hair[k]) + frames[k][1] * u + frames[k][2] * v);
        }
    }
    assert!(apart(&found, &expected) < 1e-5, "{}", apart(&found, &expected));
    assert!(found.iter().step_by(points).eq(position.iter().step_by(points)), "roots stay");
}

#[test]
fn a_helix_has_the_radius_and_the_pitch_asked_for() {
    let points = 401;
    for (radius, pitch) in [(0.3f32, 2.0f32), (0.05, 0.5), (1.0, 1.5)] {
        for keep_length in [false, true] {
            let mut hair = straight(points, 10.0);
            let axes = axes(points, &hair);
            curl(points, &Curl { keep_length, ..settings(helix(), radius, pitch, &axes) }, &mut hair);
            // Beyond the part where it fades in: distance from the middle line, and height gained in whole turns.
            let from = hair.iter().position(|p| p[1] > pitch).unwrap();
            let centre = (0.5, -0.25);
            let mut turns = 0.0;
            for w in hair[from..].windows(2) {
                let polar = |p: [f32; 3]| (f64::from(p[0]) - centre.0, f64::from(p[2]) - centre.1);
                let ((x, z), (a, b)) = (polar(w[0]), polar(w[1]));
                assert!(
                    ((x * x + z * z).sqrt() / f64::from(radius) - 1.0).abs() < 0.01,
                    "{radius} {pitch} {keep_length}"
                );
                turns += (x * b - z * a).atan2(x * a + z * b) / TAU;
            }
            let height = f64::from(hair[points - 1][1] - hair[from][1]);
            assert!((height / turns.abs() / f64::from(pitch) - 1.0).abs() < 0.01, "{radius} {pitch} {keep_length}");
            if keep_length {
                assert!((length(&hair) - 10.0).abs() < 1e-4);
            } else {
                assert!(length(&hair) > 10.05);
            }
        }
    }
}

#[test]
fn the_other_types_are_what_they_are_called() {
    let points = 201;
    let offsets = |wave: [Wave; 2]| {
        let mut hair = straight(points, 8.0);
        let axes = axes(points, &hair);
        curl(points, &settings(wave, 0.4, 2.0, &axes), &mut hair);
        let at = |p: &[f32; 3]| {
            let d = double(*p) - V::new(0.5, 0.0, -0.25);
            let x = double(axes[0].normal);
            let y = double(axes[0].tangent).cross(&x);
            [d.dot(&x), d.dot(&y)]
        };
        hair.iter().map(at).collect::<Vec<_>>()
    };
    let plane = offsets(uniplanar());
    assert!(
        plane.iter().all(|o| o[1].abs() < 1e-6)
            && plane.iter().any(|o| o[0] > 0.39)
            && plane.iter().any(|o| o[0] < -0.39)
    );
    let dish = offsets(dished(0.5));
    assert!(dish.iter().all(|o| o[1] > -1e-6) && dish.iter().any(|o| o[1] > 0.19));
    // Twice in a turn it is at the bottom, where the wave crosses the middle.
    for (k, dish) in dish.iter().enumerate().skip(60) {
        let t = 8.0 * k as f64 / 200.0;
        let s = (TAU * t / 2.0).sin();
        assert!((dish[0] - 0.4 * s).abs() < 1e-4 && (dish[1] - 0.2 * s * s).abs() < 1e-4, "{k}");
    }
}

#[test]
fn curls_get_tighter_toward_the_tip() {
    let points = 2001;
    let mut hair = straight(points, 10.0);
    let axes = axes(points, &hair);
    let c = Curl { tighten: Param::constant(1.0), ..settings(uniplanar(), 0.1, 1.0, &axes) };
    curl(points, &c, &mut hair);
    let crossings: Vec<f32> =
        hair.windows(2).filter(|w| (w[0][2] + 0.25) * (w[1][2] + 0.25) < 0.0).map(|w| w[0][1]).collect();
    let n = crossings.len();
    let (first, last) = (crossings[2] - crossings[0], crossings[n - 1] - crossings[n - 3]);
    // The local frequency goes from 1 to 2.
    assert!((first - 0.91).abs() < 0.08 && (last - 0.51).abs() < 0.03, "{first} {last}");
}

#[test]
fn kept_lengths_are_kept_for_bent_hairs_too() {
    let points = 100;
    let position = hairs(50, points, 3.0);
    let axes = axes(points, &position);
    let mut out = position.clone();
    curl(points, &Curl { keep_length: true, ..settings(helix(), 0.2, 0.8, &axes) }, &mut out);
    for (a, b) in out.chunks_exact(points).zip(position.chunks_exact(points)) {
        assert!((length(a) - length(b)).abs() < 2e-5 * length(b), "{} {}", length(a), length(b));
    }
}

#[test]
fn a_rigid_motion_takes_curls_along_and_radius_zero_changes_no_byte() {
    let points = 50;
    let position = hairs(200, points, 3.0);
    let root = axes(points, &position);
    let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(V::new(1.0, -2.0, 0.7)), 2.1);
    let go = |p: [f32; 3]| single(turn * double(p) + V::new(1.0, 2.0, -3.0));
    let moved: Vec<[f32; 3]> = position.iter().map(|p| go(*p)).collect();
    let turned = |v: [f32; 3]| single(turn * double(v));
    let moved_root: Vec<RootAxes> =
        root.iter().map(|a| RootAxes { tangent: turned(a.tangent), normal: turned(a.normal) }).collect();
    for keep_length in [false, true] {
        let run = |position: &[[f32; 3]], axes: &[RootAxes]| {
            let mut out = position.to_vec();
            curl(points, &Curl { keep_length, ..settings(helix(), 0.15, 0.7, axes) }, &mut out);
            out
        };
        let (still, gone) = (run(&position, &root), run(&moved, &moved_root));
        let expected: Vec<V> = still.iter().map(|p| turn * double(*p) + V::new(1.0, 2.0, -3.0)).collect();
        assert!(apart(&gone, &expected) < 1e-5, "{}", apart(&gone, &expected));
    }
    let mut same = position.clone();
    curl(points, &settings(helix(), 0.0, 0.7, &root), &mut same);
    assert!(same == position);
}

#[test]
fn axes_turn_no_more_than_the_hair_from_frame_to_frame() {
    // A hair that swings, bent up to a right angle: its axes turn by at most the largest turn of its tangents, and by the
    // area that these sweep on the sphere of directions, which no frame without twist can escape.
    let points = 40;
    let swing = |t: f64| -> Vec<[f32; 3]> {
        let mut p = V::zeros();
        (0..points)
            .map(|k| {
                let q = p;
                let a = 1.2 * (0.8 * t + 0.05 * k as f64).sin() * k as f64 / points as f64;
                let b = 0.9 * (1.7 * t + 0.03 * k as f64).cos() * k as f64 / points as f64;
                p += V::new(a.sin(), a.cos() * b.cos(), b.sin()) * 0.2;
                single(q)
            })
            .collect()
    };
    let root = RootAxes { tangent: [0.0, 1.0, 0.0], normal: [1.0, 0.0, 0.0] };
    for step in 0..60 {
        let (a, b) = (frames(&swing(step as f64 * 0.05), &root), frames(&swing((step + 1) as f64 * 0.05), &root));
        let angle = |u: V, v: V| u.cross(&v).norm().atan2(u.dot(&v));
        let hair: f64 = (0..points).map(|k| angle(a[k][0], b[k][0])).fold(0.0, f64::max);
        let axis = (0..points).map(|k| angle(a[k][1], b[k][1])).fold(0.0, f64::max);
        assert!(axis <= 1.25 * hair + 1e-6, "{axis} {hair}");
    }
}

#[test]
fn a_hair_is_curled_alike_whatever_hairs_lie_beside_it() {
    let (points, n) = (30, 40);
    let position = hairs(n, points, 3.0);
    let root = axes(points, &position);
    let radius: Vec<f32> = (0..n).map(|h| if h % 3 == 0 { 2.0 } else { 0.3 }).collect();
    let run = |position: &[[f32; 3]], axes: &[RootAxes], radius: &[f32], keep_length: bool| {
        let mut out = position.to_vec();
        let radius = Param { value: 0.5, factor: radius, shift: &[] };
        curl(points, &Curl { keep_length, radius, ..settings(helix(), 1.0, 1.1, axes) }, &mut out);
        out
    };
    for keep_length in [false, true] {
        let together = run(&position, &root, &radius, keep_length);
        for h in 0..n {
            let alone = run(&position[h * points..][..points], &root[h..=h], &radius[h..=h], keep_length);
            assert!(alone == together[h * points..][..points], "{h} {keep_length}");
        }
    }
}
