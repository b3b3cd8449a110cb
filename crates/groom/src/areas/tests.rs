//! Laws of particles, hits and areas.

use super::*;
use crate::test_skin::TestSkin;

const FPS: f64 = 24.0;

/// Travels at constant speed.
fn emitter() -> Emitter {
    let corner = 1001.0 + 10.0 * 15.0 / (15.0 + 250.0f64.sqrt());
    Emitter {
        position: vec![(1001.0, [-15.0, 25.0, 0.0]), (corner, [0.0, 25.0, 0.0]), (1011.0, [15.0, 25.0, 5.0])],
        direction: [0.0, -2.0, 0.0],
        spread: 20.0,
        rate: 1000.0,
        seed: 7,
        frames: [1001, 1010],
    }
}

fn u(i: u64, c: u64) -> f64 {
    rng::uniform(11, i, c, 0)
}

/// Places of a skin's points at rest.
fn place(skin: &TestSkin) -> impl Fn(&SurfacePoint) -> ([f64; 3], [f32; 3]) + Sync + '_ {
    |p| {
        let frame = skin.rest.frame(&skin.mesh, &skin.topology, p);
        (frame.origin.into(), [frame.n.x as f32, frame.n.y as f32, frame.n.z as f32])
    }
}

/// Points all over a skin.
fn scattered(skin: &TestSkin, n: u64) -> Vec<SurfacePoint> {
    let at = |i: u64| {
        let (a, b) = (u(i, 1), u(i, 2));
        let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
        let triangle = (u(i, 0) * skin.mesh.triangle.len() as f64) as u32;
        SurfacePoint { triangle, bary: [a as f32, b as f32] }
    };
    (0..n).map(at).collect()
}

/// What [`wetness`] computes, area by area.
fn plain(areas: &[Area], root: &[[f64; 3]], normal: &[[f32; 3]]) -> Vec<[f32; 2]> {
    let of = |i: usize| {
        let inside = |a: &&Area| {
            let apart = (Vec3::from(root[i]) - Vec3::from(a.centre)).norm();
            let n = |n: [f32; 3]| Vec3::from(n.map(f64::from));
            apart <= a.radius && n(normal[i]).dot(&n(a.normal)) > 0.0
        };
        let sum = |f: fn(&Area) -> f64| areas.iter().filter(inside).map(f).sum::<f64>().min(1.0) as f32;
        [sum(|a| a.percent), sum(|a| a.rate)]
    };
    (0..root.len()).map(of).collect()
}

#[test]
fn keys_are_linear_between_and_held_beyond() {
    let keys = [(2.0, 1.0), (4.0, 5.0), (4.0, 0.0), (5.0, 2.0)];
    for (t, x) in [(-9.0, 1.0), (2.0, 1.0), (3.0, 3.0), (3.75, 4.5), (4.0, 0.0), (4.5, 1.0), (5.0, 2.0), (99.0, 2.0)] {
        assert_eq!(keyed(&keys, t), Some(x), "{t}");
    }
    assert_eq!(keyed(&[], 1.0), None);
}

#[test]
fn particles_leave_at_their_rate_however_frames_are_split() {
    for rate in [1000.0, 24.0, 7.0, 0.3, 23.976] {
        let e = Emitter { rate, ..emitter() };
        let all = e.particles(900..1200, FPS);
        // Ten frames at `rate`, the first one at once.
        let expected = 10.0 * rate / FPS;
        assert!((all.len() as f64 - expected).abs() <= 1.0, "{} instead of {expected} at {rate}", all.len());
        for (k, p) in all.iter().enumerate() {
            assert!(p.number == k as u64 && (p.time - 1001.0 - k as f64 * FPS / rate).abs() < 1e-9);
            assert!((1001.0..1011.0).contains(&p.time));
        }
        let each: Vec<Particle> = (1000..1015).flat_map(|f| e.particles(f..f + 1, FPS)).collect();
        assert_eq!(all, each);
        let (mut one, two) = (e.particles(1001..1004, FPS), e.particles(1004..1020, FPS));
        one.extend(two);
        assert_eq!(all, one);
    }
    assert_ne!(emitter().particles(1001..1002, FPS), Emitter { seed: 8, ..emitter() }.particles(1001..1002, FPS));
    let nothing = [
        Emitter { rate: 0.0, ..emitter() },
        Emitter { rate: f64::NAN, ..emitter() },
        Emitter { position: Vec::new(), ..emitter() },
        Emitter { direction: [0.0; 3], ..emitter() },
        Emitter { frames: [1010, 1001], ..emitter() },
    ];
    assert!(nothing.iter().all(|e| e.particles(0..2000, FPS).is_empty()));
    assert!(emitter().particles(1005..1005, FPS).is_empty() && emitter().particles(1011..1020, FPS).is_empty());
}

#[test]
fn particles_fill_their_cone_evenly() {
    for spread in [0.0, 5.0, 60.0, 180.0f64] {
        let e = Emitter { spread, rate: 24e3, direction: [1.0, -2.0, 0.5], ..emitter() };
        let (axis, narrow) = (Vec3::from(e.direction).normalize(), libm::cos(spread.to_radians()));
        let all = e.particles(1001..1006, FPS);
        let (mut height, mut sum) = (0.0, Vec3::zeros());
        for p in &all {
            let d = Vec3::from(p.direction);
            assert!((d.norm() - 1.0).abs() < 1e-12 && d.dot(&axis) >= narrow - 1e-12);
            (height, sum) = (height + d.dot(&axis), sum + d);
        }
        // Cosines are uniform in [cos spread, 1]; no side is preferred. Within five standard deviations of the means.
        let n = all.len() as f64;
        let deviation = (1.0 - narrow) / (12.0 * n).sqrt();
        assert!((height / n - 0.5 * (1.0 + narrow)).abs() <= 5.0 * deviation + 1e-12, "{spread}");
        let square = (1.0 + narrow + narrow * narrow) / 3.0;
        let aside = (sum / n - axis * (height / n)).norm();
        assert!(aside <= 5.0 * ((1.0 - square).max(0.0) / n).sqrt() + 1e-12, "{spread}: {aside}");
    }
}

#[test]
fn the_emitter_travels() {
    let e = emitter();
    let all = e.particles(1001..1011, FPS);
    for p in &all {
        let s = (p.time - 1001.0) / 10.0 * (15.0 + 250.0f64.sqrt());
        let beyond = (s - 15.0).max(0.0) / 250.0f64.sqrt();
        let at = [-15.0 + s.min(15.0) + 15.0 * beyond, 25.0, 5.0 * beyond];
        assert!((Vec3::from(p.origin) - Vec3::from(at)).norm() < 1e-9, "{p:?}");
    }
}

#[test]
fn hits_lie_on_the_skin_where_the_ray_goes() {
    let skin = TestSkin::new(48, 24, 1.0);
    let placement = RigidMotionSample::turned();
    let posed = skin.posed(|p| placement.apply(p));
    let moved = Bvh::build(&posed.position, &skin.mesh.triangle, &skin.topology);
    let particles = emitter().particles(1001..1011, FPS);
    for (bvh, placement, pose) in
        [(&skin.bvh, None, &skin.rest), (&skin.bvh, Some(&placement), &posed), (&moved, None, &posed)]
    {
        let found = hits(&particles, bvh, placement);
        assert!(found.len() > 50 && found.len() < particles.len(), "{} of {}", found.len(), particles.len());
        for hit in &found {
            let p = &particles[hit.number as usize];
            assert_eq!((p.number, p.time), (hit.number, hit.time));
            let at = hit
                .point
                .blend(pelage_geom::mesh::corners(&pose.position, skin.mesh.triangle[hit.point.triangle as usize]));
            let away = at - Vec3::from(p.origin);
            let along = away.dot(&Vec3::from(p.direction));
            assert!(along > 0.0 && (away - Vec3::from(p.direction) * along).norm() < 1e-6, "{hit:?}");
        }
        // However frames are split.
        let split: Vec<Hit> =
            (1001..1011).flat_map(|f| hits(&emitter().particles(f..f + 1, FPS), bvh, placement)).collect();
        assert_eq!(found, split);
    }
    let (a, b) = (hits(&particles, &skin.bvh, Some(&placement)), hits(&particles, &moved, None));
    assert!(a.iter().zip(&b).all(|(a, b)| a.number == b.number) && a.len() == b.len());
}

/// A turn by an eighth about an axis, and a shift.
struct RigidMotionSample;

impl RigidMotionSample {
    fn turned() -> RigidTransform {
        let h = std::f64::consts::PI / 8.0;
        let (s, c) = (libm::sin(h), libm::cos(h));
        RigidTransform { rotation: [0.6 * s, 0.0, 0.8 * s, c], translation: [3.0, -1.0, 0.5], pivot: [1.0, 2.0, -4.0] }
    }
}

#[test]
fn areas_live_by_their_age() {
    let skin = TestSkin::new(24, 12, 0.5);
    let point = scattered(&skin, 3);
    let hit = |number: u64, time: f64| Hit { number, time, point: point[number as usize] };
    let hits = [hit(0, 1001.0), hit(1, 1003.5), hit(2, 1010.25)];
    let law = AreaLaw {
        radius: vec![(0.0, 0.5), (2.0, 2.5)],
        percent: vec![(0.0, 0.0), (1.0, 1.0), (10.0, 1.0), (12.0, 0.0)],
        rate: vec![(0.0, 0.25)],
    };
    let at = |frame: f64| areas(&hits, &law, frame, place(&skin));
    assert!(at(1000.0).is_empty());
    // At its own moment it has only a rate yet.
    let now = at(1001.0);
    assert_eq!((now.len(), now[0].radius, now[0].percent, now[0].rate), (1, 0.5, 0.0, 0.25));
    let two = at(1004.0);
    let values: Vec<_> = two.iter().map(|a| (a.radius, a.percent)).collect();
    assert_eq!(values, [(2.5, 1.0), (1.0, 0.5)]);
    assert_eq!((two[1].centre, two[1].normal), place(&skin)(&point[1]));
    assert_eq!(at(1012.0).iter().map(|a| a.percent).collect::<Vec<_>>(), [0.5, 1.0, 1.0]);
    let dry = AreaLaw { rate: Vec::new(), ..law.clone() };
    assert_eq!(areas(&hits, &dry, 1013.0, place(&skin)).len(), 2, "the first is dry again");
}

/// Centre hairs and areas on a skin: (roots, normals, areas).
fn wet(
    skin: &TestSkin,
    clumps: u64,
    count: u64,
    radius: impl Fn(u64) -> f64,
) -> (Vec<[f64; 3]>, Vec<[f32; 3]>, Vec<Area>) {
    let points = scattered(skin, clumps + count);
    let (root, normal): (Vec<_>, Vec<_>) = points[..clumps as usize].iter().map(place(skin)).unzip();
    let area = |(i, p): (u64, &SurfacePoint)| {
        let (centre, normal) = place(skin)(p);
        Area { centre, normal, radius: radius(i), percent: 0.15 * u(i, 20), rate: 0.1 * u(i, 21) }
    };
    let areas = (0..count).zip(&points[clumps as usize..]).map(area).collect();
    (root, normal, areas)
}

#[test]
fn wetness_is_what_every_area_by_itself_says() {
    let skin = TestSkin::new(48, 24, 1.0);
    let radii: [fn(u64) -> f64; 4] = [
        |_| 1.5,
        |i| 4.0 * u(i, 22),
        // From dust to more than the whole skin.
        |i| libm::exp(12.0 * u(i, 22) - 9.0),
        |i| if i % 7 == 0 { [0.0, -1.0, f64::NAN, 0.4][i as usize % 4] } else { 1e-3 * i as f64 },
    ];
    for radius in radii {
        let (root, normal, areas) = wet(&skin, 4000, 300, radius);
        let fast = wetness(&areas, &Centres { root: &root, normal: &normal });
        let slow = plain(&areas, &root, &normal);
        assert!(slow.iter().any(|w| w[0] > 0.0) && slow.iter().any(|w| w[0] < 1.0));
        for (i, (a, b)) in fast.iter().zip(&slow).enumerate() {
            assert!((0..2).all(|k| (a[k] - b[k]).abs() < 1e-6), "clump {i}: {a:?} instead of {b:?}");
        }
    }
    let none = wetness(&[], &Centres { root: &[[0.0; 3]], normal: &[[0.0, 1.0, 0.0]] });
    assert_eq!(none, [[0.0; 2]]);
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let skin = TestSkin::new(48, 24, 1.0);
    let (root, normal, areas) = wet(&skin, 20_000, 500, |i| 3.0 * u(i, 22));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| wetness(&areas, &Centres { root: &root, normal: &normal }))
    };
    assert!(with(1) == with(3));
}

#[test]
fn overlapping_areas_add_up_to_one() {
    let area = |x: f64, percent: f64, rate: f64| Area {
        centre: [x, 0.0, 0.0],
        normal: [0.0, 1.0, 0.0],
        radius: 1.0,
        percent,
        rate,
    };
    let areas = [area(0.0, 0.25, 0.125), area(1.0, 0.5, 0.125), area(1.5, 0.75, 0.25)];
    // On the border counts as inside.
    let root = [-1.5, -1.0, 0.25, 0.75, 1.25, 2.5, 2.75].map(|x| [x, 0.0, 0.0]);
    let found = wetness(&areas, &Centres { root: &root, normal: &[[0.0, 1.0, 0.0]; 7] });
    let expected = [[0.0, 0.0], [0.25, 0.125], [0.75, 0.25], [1.0, 0.5], [1.0, 0.375], [0.75, 0.25], [0.0, 0.0]];
    assert_eq!(found, expected);
}

#[test]
fn the_other_side_of_an_ear_stays_dry() {
    let area = Area { centre: [0.0; 3], normal: [0.0, 0.0, 1.0], radius: 2.0, percent: 1.0, rate: 0.5 };
    let root = [[0.5, 0.0, 0.0], [0.5, 0.0, -0.1], [0.0, 1.0, 0.0]];
    let normal = [[0.0, 0.6, 0.8], [0.0, 0.6, -0.8], [1.0, 0.0, 0.0]];
    let found = wetness(&[area], &Centres { root: &root, normal: &normal });
    assert_eq!(found, [[1.0, 0.5], [0.0; 2], [0.0; 2]]);
}

#[test]
fn areas_know_no_seams() {
    let skin = TestSkin::new(48, 24, 0.5);
    let points = scattered(&skin, 20_000);
    let (root, normal): (Vec<_>, Vec<_>) = points.iter().map(place(&skin)).unzip();
    // The charts meet where z = 0: centres on it and near it.
    for seed in 0..20 {
        let angle = std::f64::consts::TAU * u(seed, 30);
        let from = Vec3::new(20.0 * libm::cos(angle), 20.0 * libm::sin(angle), 2.0 * u(seed, 31) - 1.0);
        let particle = Particle { number: 0, time: 0.0, origin: from.into(), direction: (-from).into() };
        let hit = hits(&[particle], &skin.bvh, None);
        let radius = 2.5 + u(seed, 32);
        let law = AreaLaw { radius: vec![(0.0, radius)], percent: vec![(0.0, 1.0)], rate: Vec::new() };
        let area = areas(&hit, &law, 0.0, place(&skin));
        let found = wetness(&area, &Centres { root: &root, normal: &normal });
        let mut inside = [0; 2];
        for ((p, root), wet) in points.iter().zip(&root).zip(&found) {
            let apart = (Vec3::from(*root) - Vec3::from(area[0].centre)).norm();
            assert_eq!(wet[0] == 1.0, apart <= radius, "{apart} of {radius} in area {seed}");
            inside[skin.topology.chart[p.triangle as usize] as usize] += usize::from(wet[0] == 1.0);
        }
        assert!(inside[0] > 20 && inside[1] > 20, "{inside:?}");
    }
}
