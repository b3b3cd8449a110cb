use super::*;
use crate::place::{PlaceSettings, Placement, place};
use crate::spline::BSpline;
use crate::test_skin::TestSkin;
use pelage_geom::rng::uniform;
use pelage_geom::{Map, Wrap};

pub(super) fn groomed() -> (TestSkin, ControlHairs) {
    let s = TestSkin::new(24, 12, 0.5);
    let placement = Placement::Grid { u: 5, v: 6, even: false };
    let settings = PlaceSettings { placement, points: 6, length: 3.0, ..PlaceSettings::default() };
    let (hairs, _, _) = place(&s.skin(), &s.bvh, &settings);
    (s, hairs)
}

pub(super) fn op(kind: CombKind<'_>) -> CombOp<'_> {
    CombOp { kind, weight: 1.0.into(), region: None, side: None, only: None }
}

#[test]
fn hair_that_follows_a_line_takes_its_shape_and_keeps_its_length() {
    let (s, before) = groomed();
    // Quarter circles in a tilted plane, each of its hair's length.
    let arc = |starts: &[Start]| {
        let points = before.points;
        let at = starts.iter().flat_map(|start| {
            let radius = start.length / std::f64::consts::FRAC_PI_2;
            (0..points).map(move |k| {
                let a = std::f64::consts::FRAC_PI_2 * k as f64 / (points - 1) as f64;
                start.at + (Vec3::y() * libm::sin(a) + Vec3::new(0.6, 0.0, 0.8) * (1.0 - libm::cos(a))) * radius
            })
        });
        Lines { points, at: at.collect(), straight_from: vec![points as u32; starts.len()] }
    };
    let follow = |bend| CombKind::Follow { guides: Guides(&arc), bend: Amount::from(bend), curvature: 0.0.into() };
    let mut whole = before.clone();
    let counts = comb(&s.skin(), &[], &[op(follow(1.0))], &mut whole);
    assert_eq!(counts[0].combed, before.len());
    let skin = s.skin();
    for h in 0..before.len() {
        let frame = skin.frame(&before.root[h]);
        let line = world_points(&frame, whole.hair(h));
        let start = Start { at: frame.origin, direction: frame.n, length: before.length(h) };
        let guide = arc(&[start]).at;
        for (w, g) in line.windows(2).zip(guide.windows(2)) {
            let (w, g) = (w[1] - w[0], g[1] - g[0]);
            assert!(w.normalize().dot(&g.normalize()) > 1.0 - 1e-9, "{w} {g}");
        }
        assert!((whole.length(h) - before.length(h)).abs() < 1e-5);
    }
    let mut none = before.clone();
    comb(&s.skin(), &[], &[op(follow(0.0))], &mut none);
    assert_eq!(none, before);
    let mut half = before.clone();
    comb(&s.skin(), &[], &[op(follow(0.5))], &mut half);
    assert!(half != before && half != whole);
}

#[test]
fn cut_hair_ends_at_its_plane_and_is_never_longer() {
    use crate::field::lengths::Plane;
    let (s, before) = groomed();
    let skin = s.skin();
    let frame = |h: usize| skin.frame(&before.root[h]);
    // Through the middle of all hair, across the normal of the first.
    let tip = |hairs: &ControlHairs, h: usize| *world_points(&frame(h), hairs.hair(h)).last().unwrap();
    let (point, normal) = (tip(&before, 0) - frame(0).n * 1.2, frame(0).n);
    let shear = Shear::Cut { plane: Plane { point, normal } };
    let mut hairs = before.clone();
    let counts = comb(&skin, &[], &[op(CombKind::Cut { shear: &shear, scalp: None })], &mut hairs);
    assert!(counts[0].combed > 0);
    for h in 0..before.len() {
        let (old, new) = (before.length(h), hairs.length(h));
        let crosses = (frame(h).origin - point).dot(&normal) <= 0.0 && (tip(&before, h) - point).dot(&normal) > 0.0;
        if crosses {
            assert!((tip(&hairs, h) - point).dot(&normal).abs() < 1e-5 && new < old, "{h}");
            assert_eq!(hairs.cut[h], new as f32);
        } else if (frame(h).origin - point).dot(&normal) <= 0.0 {
            assert_eq!((hairs.hair(h), hairs.cut[h]), (before.hair(h), f32::INFINITY));
        }
        assert!(new <= old * (1.0 + 1e-6));
    }
}

fn curve(radius: f64, bend: f64, curvature: f64) -> CombKind<'static> {
    let points = vec![Vec3::new(-20.0, 12.0, 0.0), Vec3::new(20.0, 12.0, 5.0)];
    CombKind::DirectionCurve {
        points,
        radius: radius.into(),
        falloff: 0.5.into(),
        bend: bend.into(),
        curvature: curvature.into(),
    }
}

fn flat(value: &[f32]) -> TiledMap {
    let map = Map { width: 1, height: 1, channels: value.len(), data: value.to_vec() };
    TiledMap { tiles: vec![(0, map)], wrap: Wrap::Clamp }
}

fn all_ops<'a>(rgb: &'a TiledMap, half: &'a TiledMap) -> Vec<CombOp<'a>> {
    [
        curve(f64::INFINITY, 0.7, 0.6),
        CombKind::DirectionMap { map: rgb, space: DirectionSpace::Root, bend: 0.5.into(), curvature: 0.3.into() },
        CombKind::Bend { angle: 40.0.into(), map: Some(half), curvature: 1.0.into() },
        CombKind::LayDown { amount: 0.8.into(), map: None },
        CombKind::Length { value: 1.5.into(), map: Some(half) },
    ]
    .into_iter()
    .map(op)
    .collect()
}

#[test]
fn weight_zero_changes_no_byte() {
    let (s, mut hairs) = groomed();
    let (rgb, half, zero) = (flat(&[0.9, 0.7, 0.2]), flat(&[0.5]), flat(&[0.0]));
    comb(&s.skin(), &[], &all_ops(&rgb, &half), &mut hairs);
    let before = hairs.clone();
    let mut ops = all_ops(&rgb, &half);
    ops.iter_mut().for_each(|o| o.weight = 0.0.into());
    let mut regions = all_ops(&rgb, &half);
    regions.iter_mut().for_each(|o| o.region = Some(&zero));
    ops.extend(regions);
    ops.push(op(curve(0.5, 1.0, 0.0)));
    let counts = comb(&s.skin(), &[], &ops, &mut hairs);
    assert!(counts.iter().all(|c| c.combed == 0));
    assert_eq!(before, hairs);
}

#[test]
fn only_the_length_operation_changes_lengths() {
    let (s, mut hairs) = groomed();
    let (rgb, half) = (flat(&[0.9, 0.7, 0.2]), flat(&[0.5]));
    for (i, o) in all_ops(&rgb, &half).into_iter().enumerate() {
        let factor = if i == 4 { 0.75 } else { 1.0 };
        let before = hairs.clone();
        let counts = comb(&s.skin(), &[], &[o], &mut hairs);
        assert_eq!(counts[0].combed, hairs.len());
        assert_ne!(before, hairs);
        for h in 0..hairs.len() {
            assert!((hairs.length(h) - factor * before.length(h)).abs() < 1e-6 * 3.0);
            assert_eq!(hairs.hair(h)[0], [0.0; 3]);
        }
    }
}

#[test]
fn a_full_bend_without_curvature_aligns_with_the_curve() {
    let (s, mut hairs) = groomed();
    comb(&s.skin(), &[], &[op(curve(f64::INFINITY, 1.0, 0.0))], &mut hairs);
    let target = Vec3::new(40.0, 0.0, 5.0).normalize();
    for h in 0..hairs.len() {
        let line = world_points(&s.skin().frame(&hairs.root[h]), hairs.hair(h));
        for w in line.windows(2) {
            assert!(((w[1] - w[0]).normalize() - target).norm() < 1e-5);
        }
    }
}

#[test]
fn curvature_leaves_the_root_and_bends_the_tip() {
    let (s, mut hairs) = groomed();
    comb(&s.skin(), &[], &[op(curve(f64::INFINITY, 1.0, 1.0))], &mut hairs);
    let target = Vec3::new(40.0, 0.0, 5.0).normalize();
    for h in 0..hairs.len() {
        let f = s.skin().frame(&hairs.root[h]);
        let line = world_points(&f, hairs.hair(h));
        let angle: Vec<f64> =
            line.windows(2).map(|w| (w[1] - w[0]).normalize().dot(&target).min(1.0).acos_()).collect();
        assert!(((line[1] - line[0]).normalize() - f.n).norm() < 1e-5);
        assert!(angle[4] < 1e-3);
        // Equal steps along the great circle.
        for k in 0..5 {
            assert!((angle[k] - angle[0] * (1.0 - k as f64 / 4.0)).abs() < 1e-3, "{angle:?}");
        }
    }
}

trait Acos {
    fn acos_(self) -> f64;
}
impl Acos for f64 {
    fn acos_(self) -> f64 {
        libm::acos(self)
    }
}

#[test]
fn influence_ends_at_the_radius_and_fades_as_told() {
    assert_eq!(influence(1e9, f64::INFINITY, 0.5), 1.0);
    assert_eq!(influence(1.99, 2.0, 0.0), 1.0);
    assert_eq!(influence(2.0, 2.0, 0.0), 0.0);
    assert_eq!(influence(1.0, 2.0, 0.5), 1.0);
    assert!((influence(1.5, 2.0, 0.5) - 0.5).abs() < 1e-12);
    assert!((influence(1.0, 2.0, 1.0) - 0.5).abs() < 1e-12);
}

#[test]
fn laying_down_keeps_the_azimuth_and_ends_near_the_tangent_plane() {
    let (s, mut hairs) = groomed();
    comb(&s.skin(), &[], &[op(curve(f64::INFINITY, 0.4, 0.5))], &mut hairs);
    let before = hairs.clone();
    comb(&s.skin(), &[], &[op(CombKind::LayDown { amount: 1.0.into(), map: None })], &mut hairs);
    for h in 0..hairs.len() {
        for k in 0..5 {
            let segment = |c: &ControlHairs| (vec3(c.hair(h)[k + 1]) - vec3(c.hair(h)[k])).normalize();
            let (a, b) = (segment(&before), segment(&hairs));
            assert!((b.x - libm::sin(FLAT_ELEVATION)).abs() < 1e-4);
            assert!((a.y * b.z - a.z * b.y).abs() < 1e-4);
        }
    }
}

#[test]
fn a_bend_turns_the_tip_by_its_angle() {
    let (s, mut hairs) = groomed();
    comb(&s.skin(), &[], &[op(CombKind::Bend { angle: 90.0.into(), map: None, curvature: 1.0.into() })], &mut hairs);
    for h in 0..hairs.len() {
        let p = hairs.hair(h);
        assert!((p[1][0] - 0.6).abs() < 1e-6 && (p[5][0] - p[4][0]).abs() < 1e-6 && p[5][1] - p[4][1] > 0.599);
    }
}

#[test]
fn painted_directions_are_read_in_their_space_and_grey_says_nothing() {
    let (s, mut hairs) = groomed();
    let upright = hairs.clone();
    let grey = flat(&[128.0 / 255.0; 3]);
    let map = |map, space| op(CombKind::DirectionMap { map, space, bend: 1.0.into(), curvature: 0.0.into() });
    let counts = comb(&s.skin(), &[], &[map(&grey, DirectionSpace::World)], &mut hairs);
    assert_eq!((counts[0].unpainted, &hairs), (hairs.len(), &upright));
    let along_z = flat(&[0.5, 0.5, 1.0]);
    comb(&s.skin(), &[], &[map(&along_z, DirectionSpace::Root)], &mut hairs);
    assert!((0..hairs.len()).all(|h| (vec3(hairs.hair(h)[5]) - Vec3::z() * 3.0).norm() < 1e-5));
    comb(&s.skin(), &[], &[map(&along_z, DirectionSpace::World)], &mut hairs);
    for h in 0..hairs.len() {
        let line = world_points(&s.skin().frame(&hairs.root[h]), hairs.hair(h));
        assert!((line[5] - line[0] - Vec3::z() * 3.0).norm() < 1e-5);
    }
}

#[test]
fn sides_of_a_parting() {
    let line = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 1.0, 0.0)];
    let up = Vec3::z();
    assert_eq!(side_of(&line, Vec3::new(0.5, 0.1, 0.3), up), 1);
    assert_eq!(side_of(&line, Vec3::new(0.5, -0.1, 0.0), up), -1);
    assert_eq!(side_of(&line, Vec3::new(0.9, 0.5, 0.0), up), 1);
    assert_eq!(side_of(&line, Vec3::new(1.4, -0.3, 0.0), up), -1);
    assert_eq!(side_of(&line, Vec3::new(0.5, 0.1, 0.3), -up), -1);
    assert_eq!(side_of(&line, Vec3::new(0.5, 0.0, 0.0), up), 0);
    let (s, mut hairs) = groomed();
    let parting = vec![vec![Vec3::new(-10.0, 10.0, 0.0), Vec3::new(10.0, 10.0, 0.0)]];
    let before = hairs.clone();
    let left = CombOp { side: Some((0, 1)), ..op(curve(f64::INFINITY, 1.0, 0.0)) };
    comb(&s.skin(), &parting, &[left], &mut hairs);
    for h in 0..hairs.len() {
        let f = s.skin().frame(&hairs.root[h]);
        let side = side_of(&parting[0], f.origin, f.n);
        assert_eq!(before.hair(h) == hairs.hair(h), side == -1, "{side}");
    }
}

#[test]
fn only_the_hairs_that_are_named_are_combed() {
    let (s, mut hairs) = groomed();
    (hairs.single[3], hairs.single[20], hairs.single[21]) = (0, 1, 2);
    let before = hairs.clone();
    for (only, combed) in [(&[][..], &[][..]), (&[2, 0], &[3, 21]), (&[NONE], &[])] {
        let mut hairs = before.clone();
        let named = CombOp { only: Some(only), ..op(curve(f64::INFINITY, 1.0, 0.0)) };
        let counts = comb(&s.skin(), &[], &[named], &mut hairs);
        assert_eq!(counts[0].combed, combed.len());
        assert!((0..hairs.len()).all(|h| combed.contains(&h) == (hairs.hair(h) != before.hair(h))));
    }
}

#[test]
fn opposite_directions_turn_over_the_normal() {
    let half = slerp(Vec3::y(), -Vec3::y(), 0.5);
    assert!((half - Vec3::x()).norm() < 1e-12, "{half}");
    assert!((slerp(Vec3::x(), -Vec3::x(), 1.0) + Vec3::x()).norm() < 1e-12);
    assert!((slerp(Vec3::x(), Vec3::z(), 1.0) - Vec3::z()).norm() < 1e-12);
}

#[test]
fn amounts_may_differ_from_hair_to_hair() {
    let (s, before) = groomed();
    let mut factor = vec![0.0; before.len()];
    factor[1] = 0.5;
    let kind = |angle: f64| CombKind::Bend { angle: angle.into(), map: None, curvature: 0.0.into() };
    let (mut each, mut half) = (before.clone(), before.clone());
    let vary = CombOp { weight: Amount { value: 1.0, factor: &factor }, ..op(kind(60.0)) };
    assert_eq!(comb(&s.skin(), &[], &[vary], &mut each)[0].combed, 1);
    comb(&s.skin(), &[], &[op(kind(30.0))], &mut half);
    assert_eq!(each.hair(0), before.hair(0));
    assert_eq!(each.hair(1), half.hair(1));
}

#[test]
fn hair_is_trimmed_where_it_runs_through_a_surface() {
    let (s, before) = groomed();
    // A ball around the first root.
    let radius = 1.25;
    let centre = s.skin().frame(&before.root[0]).origin;
    let ball = pelage_geom::shapes::cube_sphere(48, radius);
    let position: Vec<[f64; 3]> = ball.position.iter().map(|p| (Vec3::from(*p) + centre).into()).collect();
    let surface = Bvh::build(&position, &ball.triangle, &pelage_geom::Topology::new(&ball));
    let mut hairs = before.clone();
    comb(&s.skin(), &[], &[op(CombKind::Trim { surface: &surface })], &mut hairs);
    assert!((hairs.length(0) - radius).abs() < 5e-3, "{}", hairs.length(0));
    assert!((f64::from(hairs.cut[0]) - hairs.length(0)).abs() < 1e-6);
    let apart = |h: usize| (s.skin().frame(&before.root[h]).origin - centre).norm();
    for h in (0..hairs.len()).filter(|h| apart(*h) > radius + before.length(*h)) {
        assert_eq!((hairs.hair(h), hairs.cut[h]), (before.hair(h), f32::INFINITY));
    }
}

#[test]
fn hair_is_cut_to_lengths_between_keys() {
    let (s, before) = groomed();
    let at = |h: usize| s.skin().frame(&before.root[h]).origin;
    let centre = at(0) - Vec3::y() * 9.0;
    let key = vec![(at(0), 1.5), (at(20), 0.75), (at(9), 40.0)];
    let mut hairs = before.clone();
    comb(&s.skin(), &[], &[op(CombKind::Keys { centre, key: key.clone() })], &mut hairs);
    assert!((hairs.length(0) - 1.5).abs() < 1e-5 && (hairs.length(20) - 0.75).abs() < 1e-5);
    assert_eq!(hairs.length(9), before.length(9), "hair is not made longer");
    for h in 0..hairs.len() {
        let asked = between_keys(centre, &key, at(h)).min(before.length(h));
        assert!((hairs.length(h) - asked).abs() < 1e-5);
    }
}

#[test]
fn smoothing_takes_kinks_out_and_leaves_splines() {
    let (s, mut hairs) = groomed();
    let n = hairs.points;
    let smooth = |weight: f64, control: usize| CombOp {
        weight: weight.into(),
        ..op(CombKind::Smooth { control, bend: 1.0.into(), curvature: 0.0.into() })
    };
    // Points of a spline stay on it, those of other hairs zigzag.
    for h in 0..hairs.len() {
        let random = |k: usize, c| uniform(5, (h * n + k) as u64, 1, c) - 0.5;
        let spline = BSpline { control: (0..4).map(|k| Vec3::new(k as f64, random(k, 0), random(k, 1))).collect() };
        let first = spline.at(0.0);
        for k in 0..n {
            let p = (spline.at(k as f64 / (n - 1) as f64) - first) * 3.0
                + if h % 2 == 1 { Vec3::z() * 0.2 * (k % 2) as f64 } else { Vec3::zeros() };
            hairs.local[h * n + k] = [p.x as f32, p.y as f32, p.z as f32];
        }
    }
    let before = hairs.clone();
    let kinks = |c: &ControlHairs, h: usize| -> f64 {
        let d: Vec<Vec3> = c.hair(h).windows(2).map(|w| (vec3(w[1]) - vec3(w[0])).normalize()).collect();
        d.windows(2).map(|w| w[0].cross(&w[1]).norm()).fold(0.0, f64::max)
    };
    let mut none = before.clone();
    let counts = comb(&s.skin(), &[], &[smooth(0.0, 4)], &mut none);
    assert_eq!((counts[0].combed, &none), (0, &before));
    let counts = comb(&s.skin(), &[], &[smooth(1.0, 4)], &mut hairs);
    assert_eq!(counts[0].combed, hairs.len());
    let mut half = before.clone();
    comb(&s.skin(), &[], &[smooth(0.5, 4)], &mut half);
    for h in 0..hairs.len() {
        assert!((hairs.length(h) - before.length(h)).abs() < 1e-5 * before.length(h));
        let moved = hairs.hair(h).iter().zip(before.hair(h)).map(|(a, b)| (vec3(*a) - vec3(*b)).norm());
        if h % 2 == 0 {
            let most = moved.fold(0.0, f64::max);
            assert!(most < 0.03 * before.length(h), "hair {h} on a spline moved by {most}");
        } else {
            let [was, middle, now] = [&before, &half, &hairs].map(|c| kinks(c, h));
            assert!(now < 0.6 * was && middle < was && now < middle, "{was} {middle} {now}");
        }
    }
    // A hair without length is left as it is.
    let mut short = before.clone();
    (0..n).for_each(|k| short.local[k] = [0.0; 3]);
    let was = short.hair(0).to_vec();
    comb(&s.skin(), &[], &[smooth(1.0, 4)], &mut short);
    assert_eq!(short.hair(0), was);
}
