//! Laws that every preview obeys.

use pelage_geom::{Offsets, rng};
use pelage_light::*;

/// Hairs with all columns, in one layer.
#[derive(Clone, Default)]
struct Hairs {
    counts: Vec<usize>,
    position: Vec<[f32; 3]>,
    width: Vec<f32>,
    color: Vec<[f32; 3]>,
    opacity: Vec<f32>,
}

impl Hairs {
    fn add(&mut self, points: &[[f32; 3]], width: f32, color: [f32; 3], opacity: f32) {
        self.counts.push(points.len());
        self.position.extend_from_slice(points);
        self.width.extend(points.iter().map(|_| width));
        self.color.push(color);
        self.opacity.push(opacity);
    }

    fn view<'a>(&'a self, offsets: &'a Offsets) -> HairView<'a> {
        HairView {
            offsets,
            position: &self.position,
            origin: [0.0; 3],
            width: &self.width,
            color: &self.color,
            opacity: &self.opacity,
            root_normal: &[],
            shine: &[],
            side: &[],
            transmittance: &[],
        }
    }

    /// Renders 160 x 130 pixels of a 160 x 130 unit window at the origin, seen along -z.
    fn render(&self, skin: Option<SkinView>, lights: &[Light], background: [f32; 3], settings: &Settings) -> Image {
        let offsets = Offsets::from_counts(self.counts.iter().copied());
        let layers = [self.view(&offsets)];
        let scene = Scene { skin, layers: &layers, lights, background };
        render(&scene, &flat_camera(), 160, 130, settings).0
    }
}

fn flat_camera() -> Camera {
    Camera {
        eye: [0.0, 0.0, 100.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        fov_y_deg: 30.0,
        near: 1.0,
        parallel_height: Some(130.0),
    }
}

/// Light from all around only: a hair has the colour it is given.
fn even() -> Settings {
    Settings { ambient: [1.0; 3], shadow: 0.0, ..Settings::default() }
}

/// Random curved hairs around the origin, some in front of others.
fn tuft(n: usize) -> Hairs {
    let u = |i: usize, c: u64| (rng::uniform(3, i as u64, c, 0) as f32) - 0.5;
    let mut hairs = Hairs::default();
    for i in 0..n {
        let root = [90.0 * u(i, 0), 70.0 * u(i, 1), 40.0 * u(i, 2)];
        let bend = [30.0 * u(i, 3), 30.0 * u(i, 4), 30.0 * u(i, 5)];
        let along = [40.0 * u(i, 6), 40.0 * u(i, 7), 40.0 * u(i, 8)];
        let points: Vec<[f32; 3]> = (0..7)
            .map(|k| {
                let s = k as f32 / 6.0;
                std::array::from_fn(|c| root[c] + along[c] * s + bend[c] * s * s)
            })
            .collect();
        let color = [0.5 + u(i, 9), 0.5 + u(i, 10), 0.5 + u(i, 11)];
        hairs.add(&points, 0.2 + 1.5 * (0.5 + u(i, 12)), color, 0.9);
    }
    hairs
}

fn largest(a: &Image, b: &Image) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    a.rgb.iter().flatten().zip(b.rgb.iter().flatten()).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
}

/// Square skin of half width `r` at depth `z`.
fn square(r: f64, z: f64) -> ([[f64; 3]; 4], [[u32; 3]; 2]) {
    ([[-r, -r, z], [r, -r, z], [r, r, z], [-r, r, z]], [[0, 1, 2], [0, 2, 3]])
}

#[test]
fn a_line_covers_its_width_times_its_length() {
    for width in [0.03f32, 0.4, 1.0, 3.3] {
        for angle in [0.0f64, 11.0, 45.0, 63.0, 90.0, 155.0] {
            for (shift, points) in [(0.0f32, 2), (0.25, 2), (0.5, 9), (0.85, 90)] {
                let (c, s) = (libm::cos(angle.to_radians()) as f32, libm::sin(angle.to_radians()) as f32);
                let half = 40.0;
                let line: Vec<[f32; 3]> = (0..points)
                    .map(|k| half * (2.0 * k as f32 / (points - 1) as f32 - 1.0))
                    .map(|t| [shift + t * c, 0.7 * shift + t * s, 0.1 * t])
                    .collect();
                let mut hairs = Hairs::default();
                hairs.add(&line, width, [0.0; 3], 1.0);
                let image = hairs.render(None, &[], [1.0; 3], &even());
                let covered: f64 = image.rgb.iter().map(|c| 1.0 - f64::from(c[0])).sum();
                let area = f64::from(width) * f64::from(2.0 * half);
                assert!(
                    (covered / area - 1.0).abs() < 0.02,
                    "width {width}, angle {angle}, shift {shift}, {points} points: {covered} instead of {area}"
                );
            }
        }
    }
}

#[test]
fn opacity_scales_coverage() {
    let mut hairs = Hairs::default();
    hairs.add(&[[-40.0, 1.3, 0.0], [40.0, 5.1, 0.0]], 0.8, [0.0; 3], 0.25);
    let image = hairs.render(None, &[], [1.0; 3], &even());
    let covered: f64 = image.rgb.iter().map(|c| 1.0 - f64::from(c[0])).sum();
    assert!((covered / (0.25 * 0.8 * 80.09) - 1.0).abs() < 0.02, "{covered}");
}

#[test]
fn the_number_of_points_does_not_show() {
    let at = |s: f32| [-50.0 + 100.0 * s, 20.0 - 15.0 * s, 0.0];
    let draw = |n: usize| {
        let mut hairs = Hairs::default();
        let points: Vec<_> = (0..n).map(|k| at(k as f32 / (n - 1) as f32)).collect();
        hairs.add(&points, 2.0, [0.2, 0.5, 0.1], 1.0);
        hairs.render(None, &[], [1.0; 3], &even())
    };
    assert!(largest(&draw(2), &draw(60)) < 0.02);
    // A coarse arc is smoothed: 13 points draw the same as 65.
    let arc = |n: usize| {
        let mut hairs = Hairs::default();
        let points: Vec<[f32; 3]> = (0..n)
            .map(|k| std::f64::consts::PI * k as f64 / (n - 1) as f64)
            .map(|a| [50.0 * libm::cos(a) as f32, 50.0 * libm::sin(a) as f32 - 20.0, 0.0])
            .collect();
        hairs.add(&points, 1.5, [0.0; 3], 1.0);
        hairs.render(None, &[], [1.0; 3], &even())
    };
    let (a, b) = (arc(13), arc(65));
    let mean: f32 = a.rgb.iter().zip(&b.rgb).map(|(x, y)| (x[0] - y[0]).abs()).sum::<f32>() / 236.0;
    assert!(mean < 0.12, "mean difference along the arc: {mean}");
}

#[test]
fn a_mirrored_scene_is_a_mirrored_picture() {
    let hairs = tuft(300);
    let mut other = hairs.clone();
    for p in &mut other.position {
        p[0] = -p[0];
    }
    let lights = [Light { direction: [0.0, -1.0, -1.0], color: [1.0; 3], ..Light::default() }];
    let (position, triangle) = square(30.0, -10.0);
    let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.6, 0.5, 0.4] };
    // Samples of a pixel and texels of the skin are not symmetric, so its border and its shadow's differ in places.
    for (skin, most) in [(None, 20), (Some(skin), 1000)] {
        let a = hairs.render(skin, &lights, [0.1; 3], &Settings::default());
        let mut b = other.render(skin, &lights, [0.1; 3], &Settings::default());
        b.rgb.chunks_mut(b.width).for_each(|row| row.reverse());
        let unlike = |(x, y): &(&[f32; 3], &[f32; 3])| x.iter().zip(*y).any(|(x, y)| (x - y).abs() > 0.01);
        let differ = a.rgb.iter().zip(&b.rgb).filter(unlike).count();
        assert!(differ < most, "{differ} of {} pixels differ", a.rgb.len());
        let sum = |i: &Image| i.rgb.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
        assert!((sum(&a) / sum(&b) - 1.0).abs() < 1e-3, "{} {}", sum(&a), sum(&b));
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let hairs = tuft(1500);
    let lights = studio_lights(&flat_camera());
    let (position, triangle) = square(35.0, 0.0);
    let normal = [[0.0, 0.0, 1.0]; 4];
    let skin = SkinView { position: &position, triangle: &triangle, normal: &normal, color: [0.6, 0.5, 0.4] };
    let draw = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| hairs.render(Some(skin), &lights, [0.1; 3], &Settings::default()))
    };
    let one = draw(1);
    assert_eq!(one, draw(2));
    assert_eq!(one, draw(5));
    assert_eq!(one.to_srgb8(Tone::Shoulder), draw(3).to_srgb8(Tone::Shoulder));
}

#[test]
fn a_region_has_the_pixels_of_the_whole_picture() {
    let hairs = tuft(1500);
    let offsets = Offsets::from_counts(hairs.counts.iter().copied());
    let layer = hairs.view(&offsets);
    let (position, triangle) = square(35.0, 0.0);
    let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.6, 0.5, 0.4] };
    for camera in [flat_camera(), Camera { parallel_height: None, fov_y_deg: 50.0, ..flat_camera() }] {
        let lights = studio_lights(&camera);
        let scene = Scene { skin: Some(skin), layers: &[layer], lights: &lights, background: [0.1; 3] };
        let size = [300, 250];
        let (whole, all) = render(&scene, &camera, size[0], size[1], &Settings::default());
        let regions = [[0, 300, 0, 250], [0, 1, 0, 1], [64, 128, 64, 128], [70, 71, 30, 249], [211, 300, 190, 250]];
        for [x0, x1, y0, y1] in regions.into_iter().chain([[120, 190, 100, 150]]) {
            let region = Region { x: x0..x1, y: y0..y1 };
            let (part, counts) = render_region(&scene, &camera, size, &region, &Settings::default());
            assert_eq!((part.width, part.height), (x1 - x0, y1 - y0));
            for (row, y) in part.rgb.chunks(part.width).zip(y0..) {
                assert_eq!(row, &whole.rgb[y * size[0] + x0..y * size[0] + x1], "row {y} of {region:?}");
            }
            assert!(counts.hairs == all.hairs && counts.pieces <= all.pieces);
            assert!(x1 - x0 > 64 || counts.pieces < all.pieces / 2, "{region:?}: {} pieces", counts.pieces);
        }
        // What lies outside is left off; what holds no pixel is empty.
        let beyond = Region { x: 290..900, y: 0..9000 };
        let part = render_region(&scene, &camera, size, &beyond, &Settings::default()).0;
        assert_eq!((part.width, part.height, part.rgb[0]), (10, 250, whole.rgb[290]));
        let nothing = Region { x: 400..500, y: 0..10 };
        assert!(render_region(&scene, &camera, size, &nothing, &Settings::default()).0.rgb.is_empty());
    }
}

#[test]
fn skin_hides_hair_behind_it_only() {
    let (position, triangle) = square(30.0, 0.0);
    let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.3, 0.5, 0.2] };
    let draw = |z: f32| {
        let mut hairs = Hairs::default();
        hairs.add(&[[-20.0, -7.0, z], [21.0, 9.0, z]], 1.0, [1.0, 0.0, 0.0], 1.0);
        hairs.render(Some(skin), &[], [0.0; 3], &even())
    };
    let bare = Hairs::default().render(Some(skin), &[], [0.0; 3], &even());
    assert_eq!(draw(-5.0), bare);
    assert!(largest(&draw(5.0), &bare) > 0.5);
    // Hair that lies in the skin shows.
    assert!(largest(&draw(0.0), &bare) > 0.5);
}

#[test]
fn skin_covers_its_area() {
    let (position, triangle) = square(20.3, 0.0);
    let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.0; 3] };
    let image = Hairs::default().render(Some(skin), &[], [1.0; 3], &even());
    let covered: f64 = image.rgb.iter().map(|c| 1.0 - f64::from(c[0])).sum();
    assert!((covered / (40.6 * 40.6) - 1.0).abs() < 0.02, "{covered}");
}

#[test]
fn no_dark_dots_on_a_lit_outline() {
    // A coarse ball with the normals of a round one, lit from above: on its upper outline normals point up and away.
    let n = 40u32;
    let (mut normal, mut triangle) = (Vec::new(), Vec::new());
    for j in 0..=n {
        let polar = std::f64::consts::PI * f64::from(j) / f64::from(n);
        for i in 0..n {
            let a = std::f64::consts::TAU * (f64::from(i) + 0.37) / f64::from(n);
            let r = libm::sin(polar);
            normal.push([r * libm::cos(a), libm::cos(polar), r * libm::sin(a)]);
            if j < n {
                let at = |i: u32, j: u32| j * n + i % n;
                triangle
                    .extend([[at(i, j), at(i, j + 1), at(i + 1, j)], [at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]]);
            }
        }
    }
    let position: Vec<[f64; 3]> = normal.iter().map(|n| n.map(|v| 50.0 * v)).collect();
    let normal: Vec<[f32; 3]> = normal.iter().map(|n| n.map(|v| v as f32)).collect();
    let skin = SkinView { position: &position, triangle: &triangle, normal: &normal, color: [0.9; 3] };
    let lights = [Light { direction: [0.0, -1.0, 0.0], color: [1.0; 3], ..Light::default() }];
    let settings = Settings { ambient: [0.0; 3], ..Settings::default() };
    let image = Hairs::default().render(Some(skin), &lights, [0.9; 3], &settings);
    // Everything higher than sin 45 degrees above the middle.
    let top = image.rgb[..160 * (65 - 36)].iter().map(|c| c[0]);
    assert!(top.clone().fold(1.0, f32::min) > 0.6, "{}", top.fold(1.0, f32::min));
    assert!(image.rgb[160 * (65 + 40) + 80][0] < 0.01, "no light from below");
}

#[test]
fn depth_decides_not_the_order_of_input() {
    let u = |i: usize, c: u64| (rng::uniform(5, i as u64, c, 0) as f32) - 0.5;
    let strand = |i: usize| {
        let z = i as f32 * 0.3;
        let ends = [[120.0 * u(i, 0), 90.0 * u(i, 1), z], [120.0 * u(i, 2), 90.0 * u(i, 3), z]];
        (ends, [0.5 + u(i, 4), 0.5 + u(i, 5), 0.5 + u(i, 6)])
    };
    let draw = |order: &mut dyn Iterator<Item = usize>| {
        let mut hairs = Hairs::default();
        for i in order {
            let (ends, color) = strand(i);
            hairs.add(&ends, 3.0, color, 0.8);
        }
        hairs.render(None, &[], [0.2; 3], &even())
    };
    let forward = draw(&mut (0..200));
    assert_eq!(forward, draw(&mut (0..200).rev()));
    assert_eq!(forward, draw(&mut (0..200).map(|i| i * 77 % 200)));

    let mut two = Hairs::default();
    two.add(&[[-9.0, 0.0, 1.0], [9.0, 0.0, 1.0]], 4.0, [1.0, 0.0, 0.0], 1.0);
    two.add(&[[0.0, -9.0, 0.0], [0.0, 9.0, 0.0]], 4.0, [0.0, 1.0, 0.0], 1.0);
    let middle = two.render(None, &[], [0.0; 3], &even()).rgb[65 * 160 + 80];
    assert!(middle[0] > 0.95 && middle[1] < 0.05, "{middle:?}");
}

#[test]
fn hair_in_the_shadow_of_hair_or_skin_is_darker() {
    let lights = [Light { direction: [0.0, -1.0, 0.0], color: [1.0; 3], ..Light::default() }];
    let settings = Settings { ambient: [0.0; 3], ..Settings::default() };
    let probe = |roof: bool, skin: Option<SkinView>| {
        let mut hairs = Hairs::default();
        hairs.add(&[[-20.0, -50.0, 0.0], [20.0, -50.0, 0.0]], 2.0, [0.5; 3], 1.0);
        // The same box with and without hairs in between.
        hairs.add(&[[-60.0, 60.0, -60.0], [-60.0, 60.0, 60.0]], 0.01, [0.5; 3], 1.0);
        hairs.add(&[[60.0, 60.0, -60.0], [60.0, 60.0, 60.0]], 0.01, [0.5; 3], 1.0);
        for i in 0..if roof { 120 } else { 0 } {
            let x = -60.0 + i as f32;
            hairs.add(&[[x, 30.0, -60.0], [x, 30.0, 60.0]], 2.0, [0.5; 3], 1.0);
        }
        hairs.render(skin, &lights, [0.0; 3], &settings).rgb[(65 + 50) * 160 + 80][0]
    };
    let open = probe(false, None);
    assert!(open > 0.1, "{open}");
    assert!(probe(true, None) < 0.5 * open);
    let position = [[-60.0, 40.0, -60.0], [60.0, 40.0, -60.0], [60.0, 40.0, 60.0], [-60.0, 40.0, 60.0]];
    let skin = SkinView { position: &position, triangle: &[[0, 1, 2], [0, 2, 3]], normal: &[], color: [0.5; 3] };
    assert!(probe(false, Some(skin)) < 0.01);
}

#[test]
fn nothing_to_draw_is_background() {
    let background = [0.3, 0.2, 0.7];
    let lights = studio_lights(&flat_camera());
    let settings = Settings::default();
    let empty = Image::filled(160, 130, background);
    assert_eq!(Hairs::default().render(None, &lights, background, &settings), empty);
    let mut hairs = tuft(50);
    hairs.width.fill(0.0);
    assert!(largest(&hairs.render(None, &lights, background, &settings), &empty) < 1e-6);
    hairs = tuft(50);
    hairs.opacity.fill(0.0);
    assert_eq!(hairs.render(None, &lights, background, &settings), empty);
    hairs = tuft(50);
    hairs.position.iter_mut().for_each(|p| p[2] += 300.0);
    assert_eq!(hairs.render(None, &lights, background, &settings), empty, "behind the camera");
}

#[test]
fn colours_of_points_run_along_the_hair() {
    // The same colour at every point is the colour of the hair, bit by bit.
    let one = tuft(60);
    let mut each = one.clone();
    each.color = one.counts.iter().zip(&one.color).flat_map(|(n, c)| std::iter::repeat_n(*c, *n)).collect();
    let lights = [Light { direction: [0.3, -1.0, -0.5], color: [2.0; 3], ..Light::default() }];
    let picture = |h: &Hairs| h.render(None, &lights, [0.0; 3], &Settings::default());
    assert_eq!(picture(&one).rgb, picture(&each).rgb);
    // Of a straight hair with colours at its points, a pixel has what lies between its neighbours.
    let mut hair = Hairs::default();
    hair.add(&[[-60.0, 0.5, 0.0], [-20.0, 0.5, 0.0], [60.0, 0.5, 0.0]], 4.0, [0.0; 3], 1.0);
    hair.color = vec![[0.0, 1.0, 0.25], [1.0, 0.5, 0.25], [0.25, 0.0, 0.25]];
    let image = hair.render(None, &[], [0.0; 3], &even());
    for x in (25..135).step_by(5) {
        let at = x as f32 + 0.5 - 80.0;
        let expected = match at {
            a if a < -20.0 => [(a + 60.0) / 40.0, 1.0 - 0.5 * (a + 60.0) / 40.0, 0.25],
            a => [1.0 - 0.75 * (a + 20.0) / 80.0, 0.5 - 0.5 * (a + 20.0) / 80.0, 0.25],
        };
        let found = image.rgb[64 * 160 + x];
        assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 0.01), "pixel {x}: {found:?}, not {expected:?}");
    }
}

#[test]
fn bad_input_is_counted_and_passed_over() {
    let offsets = Offsets::from_counts([4, 1, 0, 3, 5]);
    let mut position: Vec<[f32; 3]> = (0..13).map(|i| [i as f32, 0.3 * i as f32, 0.0]).collect();
    position[1][2] = f32::NAN;
    position[6][0] = f32::INFINITY;
    position[9] = [3e30, 0.0, 0.0];
    position[10] = [2e12, 5.0, -1e12];
    let width = [f32::NAN, -1.0, 1.0, 1e30, 1.0, 1.0, 1.0];
    let layer = HairView {
        offsets: &offsets,
        position: &position,
        origin: [0.0; 3],
        width: &width,
        color: &[[f32::NAN, 2.0, -1.0]],
        opacity: &[f32::NAN, 7.0],
        root_normal: &[[0.0; 3], [f32::NAN; 3]],
        shine: &[],
        side: &[],
        transmittance: &[],
    };
    let vertex = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f64::NAN, 0.0, 0.0], [2.0, 0.0, 0.0]];
    let triangle = [[0, 1, 2], [0, 1, 3], [0, 1, 9], [0, 1, 4], [1, 1, 1]];
    let skin = SkinView { position: &vertex, triangle: &triangle, normal: &[[0.0; 3]], color: [0.5; 3] };
    let lights = [Light { direction: [0.0; 3], color: [1.0; 3], ..Light::default() }];
    let scene = Scene { skin: Some(skin), layers: &[layer], lights: &lights, background: [0.1; 3] };
    for camera in [flat_camera(), Camera { parallel_height: None, ..flat_camera() }] {
        let (image, counts) = render(&scene, &camera, 160, 130, &Settings::default());
        assert!(image.rgb.iter().flatten().all(|v| v.is_finite()));
        assert_eq!((counts.hairs, counts.bad_points, counts.bad_triangles), (5, 3, 2));
        for (w, h) in [(0, 0), (7, 0), (0, 7), (1, 1)] {
            let (image, _) = render(&scene, &camera, w, h, &Settings::default());
            assert_eq!(image.rgb.len(), w * h);
        }
    }
}

#[test]
fn hair_through_the_eye_is_cut_at_the_near_plane() {
    let mut hairs = Hairs::default();
    hairs.add(&[[3.0, -2.0, 150.0], [0.0, 0.0, -40.0]], 0.5, [1.0, 0.0, 0.0], 1.0);
    hairs.add(&[[-1e7, 1.0, 0.0], [1e7, 1.0, 0.0]], 0.5, [0.0, 1.0, 0.0], 1.0);
    let offsets = Offsets::from_counts(hairs.counts.iter().copied());
    let layer = HairView {
        offsets: &offsets,
        position: &hairs.position,
        origin: [0.0; 3],
        width: &hairs.width,
        color: &hairs.color,
        opacity: &[],
        root_normal: &[],
        shine: &[],
        side: &[],
        transmittance: &[],
    };
    let camera = Camera { parallel_height: None, ..flat_camera() };
    let scene = Scene { skin: None, layers: &[layer], lights: &[], background: [0.0; 3] };
    let (image, counts) = render(&scene, &camera, 160, 130, &even());
    let sum = image.rgb.iter().fold([0.0; 3], |s, c| [s[0] + c[0], s[1] + c[1], s[2] + c[2]]);
    assert!(sum.iter().all(|v| v.is_finite()) && sum[0] > 20.0, "{sum:?}");
    // Half a unit wide at a distance of 100 units, all across: 160 pixels by 1.21.
    let wide = 160.0 * 0.5 * camera.view(160, 130).scale(100.0) as f32;
    assert!((sum[1] / wide - 1.0).abs() < 0.25, "{} instead of {wide}", sum[1]);
    assert!(counts.pieces < 200, "{counts:?}");
}

#[test]
fn highlights_grow_with_shine_and_sides_follow_the_light() {
    let mut hairs = Hairs::default();
    hairs.add(&[[-60.0, 0.0, 0.0], [60.0, 0.0, 0.0]], 8.0, [0.3; 3], 1.0);
    let offsets = Offsets::uniform(1, 2);
    let light = [Light { direction: [0.0, -0.6, -0.8], color: [1.0; 3], ..Light::default() }];
    let settings = Settings { ambient: [0.0; 3], shadow: 0.0, ..Settings::default() };
    let bright = |shine: &[f32], side: &[[f32; 3]]| {
        let layers = [HairView { shine, side, ..hairs.view(&offsets) }];
        let scene = Scene { skin: None, layers: &layers, lights: &light, background: [0.0; 3] };
        render(&scene, &flat_camera(), 160, 130, &settings).0.rgb[65 * 160 + 80][0]
    };
    let plain = bright(&[], &[]);
    assert_eq!((bright(&[1.0], &[[0.0; 3]; 2]), bright(&[f32::NAN], &[[f32::NAN; 3]; 2]) < plain), (plain, true));
    assert!(bright(&[3.0], &[]) > 1.2 * plain && bright(&[0.0], &[]) < 0.9 * plain);
    // Half way out towards the light is half as bright again, half way out from it half as bright.
    for (out, factor) in [(0.5, 1.5), (-0.5, 0.5)] {
        let side = [[0.0, 0.6 * out, 0.8 * out]; 2];
        assert!((bright(&[], &side) / plain - factor).abs() < 1e-4, "{out}");
    }
}

#[test]
fn the_cue_for_depth_thins_far_hair() {
    let covered = |z: f32, depth_cue: f32| {
        let mut hairs = Hairs::default();
        hairs.add(&[[-60.0, -30.0, 40.0], [60.0, -30.0, 40.0]], 4.0, [1.0; 3], 1.0);
        hairs.add(&[[-60.0, 30.0, z], [60.0, 30.0, z]], 4.0, [1.0; 3], 1.0);
        let image = hairs.render(None, &[], [0.0; 3], &Settings { depth_cue, ..even() });
        let rows = |from: usize| image.rgb[from * 160..(from + 65) * 160].iter().map(|c| c[0]).sum::<f32>();
        [rows(65), rows(0)]
    };
    let [near, far] = covered(-40.0, 0.0);
    assert!((near / far - 1.0).abs() < 1e-3);
    let [near_cued, far_cued] = covered(-40.0, 0.75);
    assert!((near_cued / near - 1.0).abs() < 1e-3 && (far_cued / far - 0.25).abs() < 1e-2, "{near_cued} {far_cued}");
    // Nothing to tell apart.
    assert_eq!(covered(40.0, 0.75), covered(40.0, 0.0));
}
