//! Transmittance against closed forms, brute force and the exact reference; laws; bad input.

mod common;

use common::{BALL, Body, Groom, ball, curly, fur, long, some_points};
use pelage_geom::{Offsets, Vec3, rng};
use pelage_light::shadow::{
    BadSource, Footprint, Interpolation, Placement, Quality, ShadowError, ShadowHair, ShadowSettings, Solid, Source,
    for_error, transmittance, transmittance_exact,
};

const DOWN: Source = Source::Directional { direction: Vec3::new(0.0, -1.0, 0.0) };
const SLANTED: Source = Source::Directional { direction: Vec3::new(-0.4, -1.0, -0.3) };
const FOOTPRINT: Footprint = Footprint { side: 1.0 / 256.0, rays: 512, seed: 1 };

fn u(id: usize, k: u64) -> f64 {
    rng::uniform(7, id as u64, 3, k)
}

fn map(source: Source, layers: &[ShadowHair], settings: &ShadowSettings) -> Vec<Vec<f32>> {
    let (light, _) = transmittance(source, layers, &[], settings).expect("light");
    assert!(light.iter().flatten().all(|t| (0.0..=1.0).contains(t)));
    light
}

/// Straight hairs from pairs of points.
fn straight(ends: &[[Vec3; 2]], width: f32, opacity: f32) -> Groom {
    Groom {
        offsets: Offsets::uniform(ends.len(), 2),
        position: ends.iter().flatten().map(|p| p.cast::<f32>().into()).collect(),
        origin: [0.0; 3],
        width: vec![width; 2 * ends.len()],
        opacity: vec![opacity; ends.len()],
    }
}

/// Points that only receive: strands of one point without width.
fn receivers(points: &[Vec3]) -> Groom {
    Groom {
        offsets: Offsets::uniform(points.len(), 1),
        position: points.iter().map(|p| p.cast::<f32>().into()).collect(),
        origin: [0.0; 3],
        width: vec![0.0; points.len()],
        opacity: Vec::new(),
    }
}

fn mean(light: &[f32]) -> f64 {
    light.iter().map(|t| f64::from(*t)).sum::<f64>() / light.len() as f64
}

/// Points all over the middle of a unit square at height y.
fn sheet(count: usize, y: f64) -> Vec<Vec3> {
    (0..count).map(|i| Vec3::new(0.1 + 0.8 * u(i, 10), y, 0.1 + 0.8 * u(i, 11))).collect()
}

#[test]
fn layers_of_parallel_hairs_dim_by_what_they_cover() {
    // Eight layers of hairs every 2 mm, 0.4 mm wide, each layer turned, so that no two keep step.
    let mut ends = Vec::new();
    for layer in 0..8 {
        let angle = 0.37 * layer as f64;
        let along = Vec3::new(libm::cos(angle), 0.0, libm::sin(angle));
        let across = Vec3::new(-along.z, 0.0, along.x) * 0.002;
        let centre = Vec3::new(0.5, 1.0 + 0.05 * layer as f64, 0.5);
        ends.extend((-350..350).map(|k| [-0.7, 0.7].map(|t| centre + along * t + across * f64::from(k))));
    }
    let hair = straight(&ends, 0.0004, 0.7);
    let below = receivers(&sheet(4000, 0.9));
    let layers = [hair.view(), below.view()];
    let truth = (1.0f64 - 0.7 * 0.2).powi(8);
    let points: Vec<[usize; 2]> = (0..4000).map(|i| [1, i]).collect();
    let exact = transmittance_exact(DOWN, &layers, &[], &FOOTPRINT, &points).expect("light");
    let exact = exact.iter().map(|s| s.mean).sum::<f64>() / 4000.0;
    assert!((exact - truth).abs() < 0.003, "exact {exact} of {truth}");
    // Coarser texels hold several hairs of a layer, which stand side by side by rule and so cover more than by chance.
    for texels in [2048, 4096] {
        let light = map(DOWN, &layers, &ShadowSettings { texels, ..ShadowSettings::default() });
        assert!((mean(&light[1]) / truth - 1.0).abs() < 0.02, "{texels}: {} of {truth}", mean(&light[1]));
    }
}

#[test]
fn random_hairs_dim_by_beer_and_lambert() {
    // Long enough to cross the square: nothing ends over the points.
    let (count, width, opacity) = (40_000usize, 0.0005, 0.6);
    let ends: Vec<[Vec3; 2]> = (0..count)
        .map(|i| {
            let a = std::f64::consts::TAU * u(i, 0);
            let along = Vec3::new(libm::cos(a), u(i, 3) - 0.5, libm::sin(a));
            let at = Vec3::new(3.0 * u(i, 1) - 1.0, 1.0 + u(i, 2), 3.0 * u(i, 4) - 1.0);
            [at - along * 0.4, at + along * 0.4]
        })
        .collect();
    let hair = straight(&ends, width as f32, opacity as f32);
    let below = receivers(&sheet(4000, 0.2));
    let layers = [hair.view(), below.view()];
    // Area of light that a hair takes over the area in which it lies.
    let taken = opacity * width * 0.8 / 9.0;
    let truth = libm::exp(count as f64 * libm::log(1.0 - taken));
    let points: Vec<[usize; 2]> = (0..4000).map(|i| [1, i]).collect();
    let exact = transmittance_exact(DOWN, &layers, &[], &FOOTPRINT, &points).expect("light");
    let exact = exact.iter().map(|s| s.mean).sum::<f64>() / 4000.0;
    // The 8000 hairs over the points give the mean a spread of 0.004.
    assert!((exact - truth).abs() < 0.012, "exact {exact} of {truth}");
    let light = map(DOWN, &layers, &ShadowSettings::default());
    assert!((mean(&light[1]) - exact).abs() < 0.003, "map {} of {exact}", mean(&light[1]));
}

/// All other hairs that a ray from `p` crosses, in plain double precision, every segment tried.
fn brute(layers: &[ShadowHair], own: (usize, usize), p: Vec3, toward: Vec3, reach: f64) -> usize {
    let mut count = 0;
    for (l, layer) in layers.iter().enumerate() {
        let at = |i: usize| Vec3::from(layer.position[i].map(f64::from)) + Vec3::from(layer.origin);
        for s in (0..layer.offsets.len()).filter(|&s| (l, s) != own) {
            let range = layer.offsets.range(s);
            for i in range.start..range.end - 1 {
                let (a, along) = (at(i), at(i + 1) - at(i));
                let normal = along.cross(&toward);
                let apart = (a - p).dot(&normal).abs() / normal.norm();
                let flat = along - toward * along.dot(&toward);
                let t = (p - a).dot(&flat) / flat.norm_squared();
                let deep = (a + along * t - p).dot(&toward);
                let width = f64::from(layer.width[i]) * (1.0 - t) + f64::from(layer.width[i + 1]) * t;
                count += usize::from((0.0..1.0).contains(&t) && deep > 0.0 && deep < reach && apart < 0.5 * width);
            }
        }
    }
    count
}

#[test]
fn exact_crossings_are_those_of_brute_force() {
    let mut groom = long(600, 14);
    // Wide enough that rays cross many, of widths that change.
    groom.width = (0..groom.position.len()).map(|i| 0.002 + 0.004 * u(i, 0) as f32).collect();
    groom.opacity = vec![0.5];
    groom.opacity.resize(600, 0.5);
    let layers = [groom.view()];
    let ray = Footprint { side: 0.0, rays: 1, seed: 0 };
    let points = some_points(&layers, 150);
    let lights = [Vec3::new(0.4, 0.5, 0.1), Vec3::new(0.05, 0.12, 0.03), Vec3::new(0.0, -0.3, 0.02)];
    let sources = lights.map(|position| Source::Point { position }).into_iter().chain([SLANTED]);
    for source in sources {
        let exact = transmittance_exact(source, &layers, &[], &ray, &points).expect("light");
        let mut crossed = 0;
        for (&[_, i], e) in points.iter().zip(&exact) {
            let p = Vec3::from(groom.position[i].map(f64::from));
            let (toward, reach) = match source {
                Source::Point { position } => ((position - p).normalize(), (position - p).norm()),
                _ => (Vec3::new(0.4, 1.0, 0.3).normalize(), f64::INFINITY),
            };
            let count = brute(&layers, (0, i / 14), p, toward, reach);
            crossed += count;
            assert_eq!(e.mean, 0.5f64.powi(count as i32), "{source:?} point {i}: {count}");
        }
        assert!(crossed > 100, "{source:?}: {crossed}");
    }
}

fn grooms() -> [(&'static str, Groom); 3] {
    [("long", long(25_000, 26)), ("fur", fur(60_000, 9)), ("curly", curly(5_000, 101))]
}

#[test]
fn the_default_is_within_its_bars() {
    for (name, groom) in grooms() {
        let layers = [groom.view()];
        let points = some_points(&layers, 1500);
        let truth = transmittance_exact(SLANTED, &layers, &[], &FOOTPRINT, &points).expect("light");
        let light = map(SLANTED, &layers, &Quality::Default.settings());
        let ShadowError { rms, p95, bias } = ShadowError::of(&light, &points, &truth);
        println!("{name}: rms {rms:.4} p95 {p95:.4} bias {bias:+.4}");
        assert!(rms <= 0.02 && p95 <= 0.05 && bias.abs() <= 0.005, "{name}: {rms} {p95} {bias}");
    }
}

#[test]
fn lights_near_and_inside_are_as_right_as_far_ones() {
    let groom = long(25_000, 26);
    let layers = [groom.view()];
    let points = some_points(&layers, 800);
    let at = |x, y, z| Source::Point { position: Vec3::new(x, y, z) };
    let direction = Vec3::new(-0.3, -1.0, -0.2);
    let spot = Source::Spot { position: Vec3::new(0.1, 0.5, 0.1), direction, cone: 0.2, softness: 0.05 };
    for source in [at(0.3, 0.6, 0.2), at(0.14, 0.16, 0.05), spot] {
        let truth = transmittance_exact(source, &layers, &[], &FOOTPRINT, &points).expect("light");
        let light = map(source, &layers, &Quality::Default.settings());
        let ShadowError { rms, bias, .. } = ShadowError::of(&light, &points, &truth);
        println!("{source:?}: rms {rms:.4} bias {bias:+.4}");
        assert!(rms <= 0.02 && bias.abs() <= 0.005, "{source:?}: {rms} {bias}");
    }
    let (light, counts) = transmittance(spot, &layers, &[], &ShadowSettings::default()).expect("light");
    let dark = light[0].iter().filter(|t| **t == 0.0).count();
    assert!(counts.masked > 0, "{counts:?}");
    assert!(dark >= counts.masked && counts.points + counts.masked == light[0].len(), "{dark} {counts:?}");
    let far = map(at(0.4e9, 1e9, 0.3e9), &layers, &ShadowSettings::default());
    let parallel = map(SLANTED, &layers, &ShadowSettings::default());
    let apart = far[0].iter().zip(&parallel[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(apart < 1e-3, "{apart}");
}

#[test]
fn error_falls_with_resolution_and_the_mean_stays() {
    let groom = fur(60_000, 9);
    let layers = [groom.view()];
    let points = some_points(&layers, 3000);
    let truth = transmittance_exact(SLANTED, &layers, &[], &FOOTPRINT, &points).expect("light");
    let mut before: Option<(f64, f64)> = None;
    for texels in [128, 256, 512] {
        let settings =
            ShadowSettings { texels, slices: texels / 4, placement: Placement::Uniform, ..Default::default() };
        let light = map(SLANTED, &layers, &settings);
        let rms = ShadowError::of(&light, &points, &truth).rms;
        let all = mean(&light[0]);
        println!("{texels}: rms {rms:.4} mean {all:.4}");
        if let Some((r, m)) = before {
            assert!(r / rms >= 1.4, "{texels}: {r} to {rms}");
            assert!((all / m - 1.0).abs() < 0.01, "{texels}: {m} to {all}");
        }
        before = Some((rms, all));
    }
    let light = map(SLANTED, &layers, &ShadowSettings { texels: 2048, ..Default::default() });
    assert!((mean(&light[0]) / before.expect("three").1 - 1.0).abs() < 0.01);
}

#[test]
fn a_hair_takes_its_area_of_light_wherever_it_lies() {
    // A hair of half the square's side over a dense sheet, from a twentieth of a texel to three texels wide.
    for (k, width) in [0.05, 0.2, 0.5, 1.0, 3.0].into_iter().enumerate() {
        let texel = 1.0 / 128.0;
        let a = 1.0 + k as f64;
        let along = Vec3::new(libm::cos(a), 0.3, libm::sin(a)) * 0.25;
        let centre = Vec3::new(0.47 + 0.01 * u(k, 0), 2.0, 0.52);
        let hair = straight(&[[centre - along, centre + along]], (width * texel) as f32, 0.8);
        let n = 512;
        let grid: Vec<Vec3> =
            (0..n * n).map(|i| Vec3::new((i % n) as f64 + 0.5, 0.0, (i / n) as f64 + 0.5) / n as f64).collect();
        let below = receivers(&grid);
        let settings = ShadowSettings { texels: 128, filter: 1.0 / 128.0, ..Default::default() };
        let light = map(DOWN, &[hair.view(), below.view()], &settings);
        let taken = light[1].iter().map(|t| 1.0 - f64::from(*t)).sum::<f64>() / (n * n) as f64;
        let area = 0.8 * width * texel * 0.5;
        assert!((taken / area - 1.0).abs() < 0.01, "{width} texels: {taken} of {area}");
    }
}

#[test]
fn a_hair_does_not_shadow_itself() {
    // Curls cross their own shadow many times; alone they stay lit, at every resolution and interpolation.
    let groom = curly(1, 400);
    for interpolation in [Interpolation::OpticalDepth, Interpolation::Transmittance, Interpolation::Cubic] {
        for texels in [32, 512, 4096] {
            let settings = ShadowSettings { texels, interpolation, ..Default::default() };
            let light = map(SLANTED, &[groom.view()], &settings);
            let least = light[0].iter().copied().fold(1.0, f32::min);
            assert!(least > 0.99999, "{interpolation:?} {texels}: {least}");
        }
    }
}

#[test]
fn every_way_to_interpolate_and_to_place_slices_agrees() {
    let groom = fur(30_000, 9);
    let layers = [groom.view()];
    let settings = ShadowSettings { slices: 256, ..Default::default() };
    let base = map(SLANTED, &layers, &settings);
    for placement in [Placement::Uniform, Placement::Histogram] {
        for interpolation in [Interpolation::OpticalDepth, Interpolation::Transmittance, Interpolation::Cubic] {
            let light = map(SLANTED, &layers, &ShadowSettings { placement, interpolation, ..settings });
            let n = base[0].len() as f64;
            let square = base[0].iter().zip(&light[0]).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / n;
            assert!(square.sqrt() < 0.012, "{placement:?} {interpolation:?}: {}", square.sqrt());
        }
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let groom = long(6_000, 26);
    let body = Body::new(ball(24, BALL));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| transmittance(SLANTED, &[groom.view()], &[body.view()], &ShadowSettings::default()))
    };
    let one = run(1).expect("light");
    for threads in [2, 3, 5] {
        assert_eq!(one, run(threads).expect("light"));
    }
}

#[test]
fn solids_hide_what_is_behind_them_but_not_their_own_lit_side() {
    let groom = groom_on_ball();
    let body = Body::new(ball(48, BALL));
    let solids = [body.view()];
    let sources = [
        DOWN,
        Source::Point { position: Vec3::new(0.0, 0.5, 0.0) },
        Source::Point { position: Vec3::new(0.0, 1e9, 0.0) },
    ];
    for source in sources {
        let (light, counts) = transmittance(source, &[groom.view()], &solids, &Default::default()).expect("light");
        let ray = Footprint { side: 0.0, rays: 1, seed: 0 };
        let points = some_points(&[groom.view()], 500);
        let exact = transmittance_exact(source, &[groom.view()], &solids, &ray, &points).expect("light");
        for (i, t) in light[0].iter().enumerate() {
            let p = Vec3::from(groom.position[i].map(f64::from));
            let facing = p.normalize().y;
            let lit_from = if matches!(source, Source::Point { position } if position.y < 1.0) { 0.2 } else { 0.0 };
            if facing > lit_from + 0.06 {
                assert!(*t > 0.5, "point {i} at {p:?}: {t}");
            }
            // Roots turned away from the light, and what is just above them.
            if facing < lit_from - 0.15 && i % 3 < 2 {
                assert_eq!(*t, 0.0, "point {i} at {p:?}");
            }
        }
        assert!(counts.behind_solid > 500);
        for (&[l, i], e) in points.iter().zip(&exact) {
            assert_eq!(e.mean == 0.0, light[l][i] == 0.0, "point {i}");
        }
    }
    let inside = receivers(&[Vec3::zeros(), Vec3::new(0.0, BALL * 0.99, 0.0), Vec3::new(0.0, BALL * 1.01, 0.0)]);
    let (light, _) = transmittance(DOWN, &[inside.view()], &solids, &Default::default()).expect("light");
    assert_eq!(light[0], [0.0, 0.0, 1.0]);
}

/// Sparse hairs of three points that stand on the ball's facets, roots exactly on them to single precision.
fn groom_on_ball() -> Groom {
    let (vertex, triangle) = ball(48, BALL);
    let ends: Vec<[Vec3; 3]> = (0..triangle.len())
        .step_by(5)
        .filter_map(|t| {
            let [a, b, c] = triangle[t].map(|v| Vec3::from(vertex[v as usize]));
            let normal = (b - a).cross(&(c - a)).try_normalize(1e-9)?;
            let root = a * 0.5 + b * 0.3 + c * 0.2;
            Some([root, root + normal * 0.0005, root + normal * 0.004])
        })
        .collect();
    Groom {
        offsets: Offsets::uniform(ends.len(), 3),
        position: ends.iter().flatten().map(|p| p.cast::<f32>().into()).collect(),
        origin: [0.0; 3],
        width: vec![80e-6; 3 * ends.len()],
        opacity: vec![0.5; ends.len()],
    }
}

#[test]
fn bad_lights_are_refused() {
    let groom = fur(10, 5);
    let settings = ShadowSettings::default();
    let run = |source| transmittance(source, &[groom.view()], &[], &settings).map(|_| ());
    for direction in [Vec3::zeros(), Vec3::new(f64::NAN, 0.0, 1.0), Vec3::new(f64::INFINITY, 0.0, 0.0)] {
        assert_eq!(run(Source::Directional { direction }), Err(BadSource::Direction));
        let position = Vec3::zeros();
        assert_eq!(run(Source::Spot { position, direction, cone: 0.5, softness: 0.0 }), Err(BadSource::Direction));
    }
    assert_eq!(run(Source::Point { position: Vec3::new(0.0, f64::NAN, 0.0) }), Err(BadSource::Position));
    assert_eq!(run(Source::Directional { direction: Vec3::new(0.0, 1e-300, 1e-300) }), Ok(()));
}

#[test]
fn strange_input_gives_finite_results() {
    let mut odd = fur(300, 6);
    let vertex = Vec3::from(odd.position[13].map(f64::from));
    odd.position[7] = [f32::NAN, 0.0, 0.0];
    odd.position[100] = [f32::INFINITY, 1.0, 0.0];
    odd.position[200] = [0.0, f32::MAX, 0.0];
    odd.width[20] = f32::NAN;
    odd.width[21] = f32::INFINITY;
    odd.width[22] = -1.0;
    odd.width[23] = 0.0;
    odd.opacity[5] = f32::NAN;
    odd.opacity[6] = 7.0;
    odd.opacity[7] = 0.0;
    let mut wide = fur(300, 6);
    wide.width = vec![1e6; wide.width.len()];
    let mut opaque = fur(300, 6);
    opaque.width = vec![0.02; opaque.width.len()];
    opaque.opacity = vec![1.0; opaque.position.len()];
    let line: Vec<[Vec3; 2]> = (0..50).map(|k| [Vec3::y() * k as f64, Vec3::y() * (k as f64 + 0.5)]).collect();
    let line = straight(&line, 0.001, 1.0);
    let point = receivers(&[Vec3::new(1.0, 2.0, 3.0); 4]);
    let nothing = receivers(&[]);
    let mut lost = receivers(&[Vec3::zeros()]);
    lost.position[0] = [f32::NAN; 3];
    let mut away = fur(300, 6);
    away.origin = [1e17, -1e17, 0.0];
    let all = [&odd, &wide, &opaque, &line, &point, &nothing, &lost, &away];
    let place = |position| {
        [Source::Point { position }, Source::Spot { position, direction: -Vec3::y(), cone: 2.0, softness: f64::NAN }]
    };
    let mut sources = vec![DOWN, SLANTED];
    for p in [Vec3::zeros(), vertex, vertex * 1.0001, Vec3::new(0.0, 1e30, 0.0), Vec3::new(1e300, 1e300, 0.0)] {
        sources.extend(place(p));
    }
    let points = |g: &Groom| (0..g.position.len().min(20)).map(|i| [0, i]).collect::<Vec<_>>();
    for (k, groom) in all.into_iter().enumerate() {
        for source in &sources {
            for (texels, slices) in [(1, 1), (300, 8), (2048, 4)] {
                let settings = ShadowSettings { texels, slices, ..Default::default() };
                let (light, counts) = transmittance(*source, &[groom.view()], &[], &settings).expect("light");
                assert_eq!(light[0].len(), groom.position.len());
                assert!(light[0].iter().all(|t| (0.0..=1.0).contains(t)), "groom {k} {source:?}");
                assert!(counts.bytes < 300_000_000, "groom {k} {source:?}: {counts:?}");
            }
            let footprint = Footprint { rays: 8, ..FOOTPRINT };
            let exact = transmittance_exact(*source, &[groom.view()], &[], &footprint, &points(groom)).expect("light");
            assert!(exact.iter().all(|s| (0.0..=1.0).contains(&s.mean)), "groom {k} {source:?}");
        }
    }
    let (light, counts) = transmittance(DOWN, &[odd.view()], &[], &Default::default()).expect("light");
    assert_eq!((counts.bad_points, light[0][7]), (3, 1.0));
    let none: [Solid; 0] = [];
    let (light, _) = transmittance(DOWN, &[], &none, &Default::default()).expect("light");
    assert!(light.is_empty());
    let mad = ShadowSettings { texels: usize::MAX, slices: 0, filter: f64::NAN, ..Default::default() };
    let few = straight(&[[Vec3::zeros(), Vec3::y()]], 0.01, 0.5);
    assert_eq!(map(DOWN, &[few.view()], &mad)[0], [1.0, 1.0]);
}

#[test]
fn a_target_error_finds_settings() {
    let texels: Vec<usize> = [0.05, 0.03, 0.02, 0.0].map(|e| for_error(e).texels).into();
    assert!(texels.windows(2).all(|w| w[0] <= w[1]) && texels[0] < texels[3], "{texels:?}");
    assert!(Quality::Default.settings() == ShadowSettings::default());
}
