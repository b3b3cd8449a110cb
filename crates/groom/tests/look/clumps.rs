use crate::common::*;
use pelage_geom::{NONE, StrandId};
use pelage_groom::look::Param;
use pelage_groom::look::clump::{Clump, bind_lines, centre_lines, clump, drawn_lines};

/// `n` hairs in clumps of ten; every hundredth is in none.
struct Case {
    points: usize,
    position: Vec<[f32; 3]>,
    member: Vec<u32>,
    reach: Vec<f32>,
    centre: Vec<u32>,
    id: Vec<StrandId>,
}

fn case(n: usize, points: usize) -> Case {
    let member = (0..n as u32).map(|h| if h % 100 == 99 { NONE } else { h / 10 }).collect();
    Case {
        points,
        position: hairs(n, points, 3.0),
        member,
        reach: (0..n).map(|h| (h % 10) as f32 / 10.0).collect(),
        centre: (0..n as u32 / 10).map(|c| 10 * c).collect(),
        id: (0..n as u64).map(|h| h + 7).collect(),
    }
}

impl Case {
    fn clump(&self) -> Clump<'_> {
        Clump {
            clump: &self.member,
            reach: &self.reach,
            centre: &self.centre,
            percent: Param::constant(1.0),
            rate: Param::constant(0.0),
            falloff: Param::constant(0.0),
            splay: Param::constant(0.0),
            weave: Param::constant(0.0),
            taper: 0.0,
            dilation: &[],
            hold: f32::INFINITY,
            keep_length: false,
            id: &self.id,
            seed: 3,
        }
    }

    fn run(&self, c: &Clump) -> Vec<[f32; 3]> {
        let mut out = self.position.clone();
        clump(self.points, c, &centre_lines(self.points, &self.position, &self.centre), &mut out);
        out
    }

    /// The point of hair `h`'s clump centre.
    fn towards(&self, h: usize, k: usize) -> Option<V> {
        let c = self.member[h];
        (c != NONE).then(|| double(self.position[self.centre[c as usize] as usize * self.points + k]))
    }
}

#[test]
fn hairs_of_four_points_follow_the_printed_formula() {
    let case = case(500, 4);
    for (percent, rate) in [(0.7, 0.0), (1.0, 0.3), (1.0, 1.0), (0.25, 0.5)] {
        let found = case.run(&Clump { percent: Param::constant(percent), rate: Param::constant(rate), ..case.clump() });
        let plain = |i: usize| {
            let (h, cv, p) = (i / 4, i % 4, double(case.position[i]));
            let fract = cv as f64 / 3.0;
            let delta = f64::from(percent) * (fract + f64::from(rate) * (1.0 - fract));
            match case.towards(h, cv) {
                Some(c) if cv > 0 => p + (c - p) * delta,
                _ => p,
            }
        };
        let expected: Vec<V> = (0..case.position.len()).map(plain).collect();
        assert!(apart(&found, &expected) < 1e-5, "{percent} {rate}");
    }
}

#[test]
fn between_the_stations_attraction_grows_smoothly_from_nothing() {
    let case = case(100, 301);
    for rate in [0.0, 0.5, 1.0] {
        let found = case.run(&Clump { rate: Param::constant(rate), ..case.clump() });
        let hair = 3;
        let delta: Vec<f64> = (0..301)
            .map(|k| {
                let (p, c) = (double(case.position[hair * 301 + k]), case.towards(hair, k).unwrap());
                (double(found[hair * 301 + k]) - p).dot(&(c - p)) / (c - p).norm_squared()
            })
            .collect();
        let slope: Vec<f64> = delta.windows(2).map(|w| (w[1] - w[0]) * 300.0).collect();
        assert!(delta[0].abs() < 1e-6 && (delta[300] - 1.0).abs() < 1e-5);
        // It grows, never beyond 1, and its slope has no step.
        assert!(slope.iter().all(|s| (-1e-2..6.1).contains(s)), "{rate}");
        assert!(slope.windows(2).all(|w| (w[1] - w[0]).abs() < 0.2), "{rate}");
        for station in [100, 200] {
            let f = f64::from(station) / 300.0;
            assert!((delta[station as usize] - (f + f64::from(rate) * (1.0 - f))).abs() < 1e-4);
        }
    }
}

#[test]
fn percent_one_at_rate_zero_brings_tips_together_exactly_and_percent_zero_changes_no_byte() {
    let case = case(1000, 12);
    let found = case.run(&case.clump());
    for h in 0..1000 {
        let tip = |p: &[[f32; 3]], h: usize| p[h * 12 + 11];
        match case.member[h] {
            NONE => assert_eq!(found[h * 12..][..12], case.position[h * 12..][..12]),
            c => assert_eq!(tip(&found, h), tip(&case.position, case.centre[c as usize] as usize)),
        }
        assert_eq!(found[h * 12], case.position[h * 12], "roots stay");
    }
    let mut awkward = case.position.clone();
    awkward.iter_mut().step_by(3).for_each(|p| p[1] = -0.0);
    let dry = Case { position: awkward, ..case };
    let same = dry.run(&Clump { percent: Param::constant(0.0), rate: Param::constant(1.0), ..dry.clump() });
    assert!(same.iter().zip(&dry.position).all(|(a, b)| a.map(f32::to_bits) == b.map(f32::to_bits)));
}

#[test]
fn the_profile_of_a_clump_is_as_it_says() {
    let case = case(200, 41);
    let (h, tip) = (8usize, 40);
    let left = |out: &[[f32; 3]], k: usize| {
        let (p, c) = (double(case.position[h * 41 + k]), case.towards(h, k).unwrap());
        (double(out[h * 41 + k]) - c).norm() / (p - c).norm()
    };
    // At the rim of falloff 0.5 half of the attraction is left; hair 8 stands at 0.8 of the radius.
    let falloff = case.run(&Clump { falloff: Param::constant(0.5), ..case.clump() });
    assert!((left(&falloff, tip) - 0.4).abs() < 1e-4);
    // Tapered clumps meet at the tip too, and are wider or narrower in the middle.
    let wide = case.run(&Clump { taper: 1.0, ..case.clump() });
    let narrow = case.run(&Clump { taper: -1.0, ..case.clump() });
    assert!(left(&wide, tip) < 1e-5 && left(&narrow, tip) < 1e-5);
    assert!((left(&wide, 20) - (1.0 - 0.5f64.powi(4))).abs() < 1e-4);
    assert!((left(&narrow, 20) - (1.0 - 0.5f64.powf(0.25))).abs() < 1e-4);
    // Splay opens tips and nothing below the middle.
    let plain = case.run(&case.clump());
    let splay = case.run(&Clump { splay: Param::constant(0.6), ..case.clump() });
    assert!((0..=20).all(|k| splay[h * 41 + k] == plain[h * 41 + k]));
    assert!((0.001..=0.6).contains(&left(&splay, tip)));
    // Weave turns about the centre: distances from it stay.
    let weave = case.run(&Clump { weave: Param::constant(2.0), percent: Param::constant(0.5), ..case.clump() });
    let half = case.run(&Clump { percent: Param::constant(0.5), ..case.clump() });
    assert!((0..41).all(|k| (left(&weave, k) - left(&half, k)).abs() < 1e-4));
    assert!((0..41).any(|k| (double(weave[h * 41 + k]) - double(half[h * 41 + k])).norm() > 0.05));
    // A hair that is held is drawn by less from once it is too far from the centre, and not at all from twice as far.
    let reach = |k: usize| (double(case.position[h * 41 + k]) - case.towards(h, k).unwrap()).norm();
    let farthest = (0..41).map(reach).fold(0.0, f64::max) as f32;
    let hold = |hold: f32| case.run(&Clump { hold, ..case.clump() });
    let own = h * 41..(h + 1) * 41;
    assert!(hold(1.001 * farthest)[own.clone()] == plain[own]);
    let loose = hold(0.4 * farthest);
    let mut held = 1.0f64;
    for k in 0..41 {
        let beyond = (reach(k) / (0.4 * f64::from(farthest)) - 1.0).clamp(0.0, 1.0);
        held = held.min(1.0 - beyond * beyond * (3.0 - 2.0 * beyond));
        let expected = 1.0 - (1.0 - left(&plain, k)) * held;
        assert!(reach(k) == 0.0 || (left(&loose, k) - expected).abs() < 1e-5, "{k}");
    }
    assert!(held == 0.0 && loose[h * 41 + 40] == case.position[h * 41 + 40]);
    // Dilation says the size of the cross-section at its stations.
    let sizes = vec![[0.8, 0.6, 0.3, 1.5]; 20];
    let dilated = case.run(&Clump { dilation: &sizes, ..case.clump() });
    for (k, size) in [(10, 0.8), (20, 0.6), (30, 0.3), (40, 1.5)] {
        assert!((left(&dilated, k) - size).abs() < 1e-4, "{k}");
    }
}

#[test]
fn kept_lengths_are_kept() {
    let case = case(300, 12);
    let out = case.run(&Clump { keep_length: true, rate: Param::constant(0.4), ..case.clump() });
    for (a, b) in out.chunks_exact(12).zip(case.position.chunks_exact(12)) {
        assert!((length(a) - length(b)).abs() < 1e-5 * length(b));
    }
    let moved = |h: usize| (double(out[h * 12 + 11]) - double(case.position[h * 12 + 11])).norm();
    assert!((1..10).all(|h| moved(h) > 0.05));
}

#[test]
fn lines_drawn_by_hand_are_met_at_rest_and_move_with_the_hairs_that_carry_them() {
    let (points, position) = (12, hairs(30, 12, 3.0));
    let axes = axes(points, &position);
    let carrier = [4u32, 17];
    let line: Vec<[f32; 3]> =
        (0..24).map(|k| [0.3 * k as f32, (k % 12) as f32 * 0.3, 1.0 - 0.02 * (k * k) as f32]).collect();
    let drawn = bind_lines(points, &position, &carrier, &axes, &line);
    let back = drawn_lines(points, &position, &carrier, &axes, &drawn);
    assert!(apart(&back, &line.iter().map(|p| double(*p)).collect::<Vec<_>>()) < 1e-5);
    // A turn about z by a right angle, and away.
    let turn = |p: [f32; 3]| [5.0 - p[1], p[0], p[2]];
    let moved: Vec<[f32; 3]> = position.iter().map(|p| turn(*p)).collect();
    let moved_axes: Vec<_> = axes
        .iter()
        .map(|a| {
            let v = |v: [f32; 3]| [-v[1], v[0], v[2]];
            pelage_groom::look::axes::RootAxes { tangent: v(a.tangent), normal: v(a.normal) }
        })
        .collect();
    let found = drawn_lines(points, &moved, &carrier, &moved_axes, &drawn);
    assert!(apart(&found, &line.iter().map(|p| double(turn(*p))).collect::<Vec<_>>()) < 1e-5);
}
