//! A human bust modelled by formula: centimetres, y up, facing +z, the chin at y = 0 and the crown at y = 23.

use super::Sample;
use super::atlas::{Part, assemble};
use super::field::{ball, bump, chain, ellipsoid, fold, join, limb, meet, ridge, segment, smoothstep, spline, turn, v};
use super::nets::{Grid, polygonise, relax};
use super::remesh::remesh;
use crate::{Mesh, Vec3};
use std::sync::LazyLock;

/// Where the chest is cut, cm.
const FLOOR: f64 = -20.0;

/// The grid that the half x >= 0 (and a little beyond) is polygonised on: finest over the face.
fn grid() -> Grid {
    Grid {
        centre: v(0.0, 8.8, 5.0),
        inner: 5.5,
        cell: 0.33,
        growth: 0.055,
        bounds: [v(-1.0, FLOOR - 1.5, -15.0), v(23.0, 25.0, 13.0)],
    }
}

/// Signed field of the whole bust.
fn field(p: Vec3) -> f64 {
    let mut f = torso(p);
    if p.y > -9.0 {
        let g = head(p);
        f = join(f, g, 2.6);
    }
    meet(f, FLOOR - p.y, 2.5)
}

/// Neck, shoulders and chest.
fn torso(p: Vec3) -> f64 {
    let q = fold(p, 0.3);
    let neck = chain(p, &[(v(0.0, 8.0, -2.6), 5.6), (v(0.0, -1.0, -3.2), 5.4), (v(0.0, -9.0, -4.6), 6.0)], 1.0);
    let chest = ellipsoid(p, v(0.0, -21.0, -3.6), v(16.5, 12.5, 9.6));
    let trapezius = limb(q, v(2.0, -3.5, -6.2), v(15.0, -13.4, -5.0), 2.7, 3.2);
    let deltoid = ellipsoid(q, v(16.0, -15.9, -4.4), v(4.6, 5.6, 4.8));
    let arm = limb(q, v(16.4, -16.0, -4.4), v(17.0, -26.0, -4.0), 4.6, 4.0);
    let mut f = join(neck, trapezius, 4.0);
    f = join(f, chest, 5.0);
    f = join(f, join(deltoid, arm, 2.0), 4.0);
    let clavicle = ridge(q, &[v(1.6, -9.6, 3.0), v(7.0, -9.2, 1.8), v(14.0, -9.8, -2.6)], 2.2);
    let sternomastoid = ridge(q, &[v(1.2, -8.8, 2.6), v(5.6, 5.0, -2.4)], 2.2);
    let notch = bump(p, v(0.0, -8.8, 2.6), v(1.6, 1.6, 2.5));
    let throat = bump(p, v(0.0, -2.6, 3.0), v(1.9, 2.2, 2.0));
    f - 0.4 * clavicle - 0.3 * sternomastoid + 0.5 * notch - 0.2 * throat
}

/// Head with face and ears.
fn head(p: Vec3) -> f64 {
    let q = fold(p, 0.3);
    let mut f = skull(p, q);
    f -= relief(p, q);
    f = eyes(f, q);
    f = nose(f, p, q);
    f = mouth(f, p, q);
    if q.x > 3.0 && p.y > 3.0 && p.y < 17.0 {
        f = ear(f, q);
    }
    f
}

/// Cranium, face block, jaw and chin.
fn skull(p: Vec3, q: Vec3) -> f64 {
    let back = ellipsoid(p, v(0.0, 14.2, -3.2), v(7.5, 8.2, 7.3));
    let front = ellipsoid(p, v(0.0, 14.6, 1.2), v(6.4, 7.8, 7.1));
    let crown = ellipsoid(p, v(0.0, 14.8, -1.0), v(6.6, 8.1, 8.0));
    let mut f = join(join(back, front, 4.0), crown, 2.0);
    let face = ellipsoid(p, v(0.0, 8.4, 2.7), v(5.6, 7.0, 5.9));
    f = join(f, face, 2.5);
    let cheek = ellipsoid(q, v(4.0, 8.4, 4.3), v(2.1, 2.6, 2.7));
    f = join(f, cheek, 3.0);
    let muzzle = ellipsoid(p, v(0.0, 4.9, 5.2), v(3.4, 3.3, 3.5));
    f = join(f, muzzle, 2.0);
    let jaw = chain(q, &[(v(0.8, 2.0, 6.2), 1.6), (v(3.2, 4.0, 2.0), 1.8), (v(4.5, 9.0, 0.2), 1.7)], 2.5);
    f = join(f, jaw, 3.5);
    let chin = ellipsoid(p, v(0.0, 1.7, 7.0), v(1.8, 1.6, 1.75));
    join(f, chin, 2.2)
}

/// Brow ridge, temples, cheeks: soft additions to the skull, cm.
fn relief(p: Vec3, q: Vec3) -> f64 {
    let brow = ridge(q, &[v(1.0, 12.9, 8.6), v(3.2, 13.5, 8.2), v(5.4, 12.8, 6.2)], 1.6);
    let glabella = bump(p, v(0.0, 12.9, 8.6), v(1.8, 1.6, 2.0));
    let temple = bump(q, v(7.0, 13.0, 4.0), v(2.5, 3.4, 3.4));
    let socket = bump(q, v(3.25, 11.5, 8.6), v(2.5, 1.9, 2.6));

    let nape = bump(p, v(0.0, 5.0, -9.5), v(5.0, 3.5, 4.0));
    0.3 * brow + 0.25 * glabella - 0.3 * temple - 0.85 * socket - 0.3 * nape
}

/// Eyeballs behind closed lids, with the line between the lids and the fold of the upper one.
fn eyes(f: f64, q: Vec3) -> f64 {
    let globe = ellipsoid(q, v(3.2, 11.35, 6.35), v(1.75, 1.2, 1.45));
    let mut f = join(f, globe, 1.3);
    let line = ridge(q, &[v(1.8, 11.0, 7.6), v(2.5, 10.85, 8.05), v(3.3, 10.8, 8.1), v(4.7, 11.1, 6.7)], 0.55);
    let fold_line = ridge(q, &[v(1.9, 11.8, 7.8), v(3.1, 12.2, 8.0), v(4.7, 11.9, 6.8)], 0.65);
    f += 0.3 * line + 0.16 * fold_line;
    f
}

/// Bridge, tip, wings and nostrils.
fn nose(f: f64, p: Vec3, q: Vec3) -> f64 {
    let bridge = chain(p, &[(v(0.0, 12.2, 7.9), 0.75), (v(0.0, 9.8, 8.8), 0.8), (v(0.0, 8.0, 9.7), 0.95)], 0.6);
    let flank = limb(q, v(0.5, 11.4, 7.4), v(0.85, 7.8, 8.3), 0.75, 1.05);
    let wing = ellipsoid(q, v(1.08, 7.35, 8.9), v(0.68, 0.68, 0.95));
    let tip = ball(p, v(0.0, 7.75, 9.95), 0.9);
    let mut g = join(bridge, flank, 1.6);
    g = join(g, tip, 0.6);
    g = join(g, wing, 0.5);
    let f = join(f, g, 1.3);
    let nostril = bump(q, v(0.75, 6.75, 9.6), v(0.55, 0.55, 0.75));
    f + 0.35 * nostril
}

/// Lips, the line between them, philtrum and the crease above the chin.
fn mouth(f: f64, p: Vec3, q: Vec3) -> f64 {
    let upper = ridge(q, &[v(0.4, 5.15, 9.2), v(1.2, 4.95, 8.9), v(2.6, 4.55, 7.5)], 0.75);
    let lower = ridge(q, &[v(0.0, 3.95, 9.0), v(1.0, 4.0, 8.8), v(2.2, 4.35, 7.8)], 0.85);
    let line = ridge(q, &[v(0.0, 4.5, 9.4), v(0.6, 4.58, 9.3), v(1.3, 4.5, 8.9), v(2.7, 4.4, 7.7)], 0.5);
    let philtrum = ridge(p, &[v(0.0, 6.5, 9.2), v(0.0, 5.5, 9.2)], 0.75);
    let crease = ridge(q, &[v(0.0, 3.0, 9.0), v(1.6, 3.2, 8.2)], 0.9);
    let corner = bump(q, v(2.8, 4.3, 7.6), v(1.0, 1.0, 1.2));
    f - 0.24 * upper - 0.3 * lower + 0.36 * line + 0.2 * philtrum + 0.22 * crease + 0.1 * corner
}

/// The ear's centre.
const EAR: [f64; 3] = [7.3, 9.6, -0.6];

/// A point in the ear's frame (x outward, y up, z forward): the ear flares from the head and tilts backward.
fn ear_space(q: Vec3) -> Vec3 {
    let c = Vec3::from(EAR);
    turn(turn(q, c, 1, 24.0), c, 0, 10.0) - c
}

/// Rim of the ear, in the ear's frame: (x outward, y up, z forward), with radii.
static RIM: LazyLock<Vec<(Vec3, f64)>> = LazyLock::new(|| {
    spline(&[
        (v(-0.05, -0.1, 0.85), 0.26),
        (v(0.1, 0.9, 1.3), 0.32),
        (v(0.15, 2.1, 1.15), 0.36),
        (v(0.25, 2.85, 0.2), 0.38),
        (v(0.3, 2.4, -1.0), 0.38),
        (v(0.32, 1.1, -1.65), 0.36),
        (v(0.28, -0.3, -1.5), 0.33),
        (v(0.18, -1.5, -0.9), 0.3),
        (v(0.1, -2.2, -0.2), 0.3),
    ])
});

/// Ridge inside the rim, above and behind the bowl.
static INNER_RIM: LazyLock<Vec<(Vec3, f64)>> = LazyLock::new(|| {
    spline(&[
        (v(0.0, 1.6, 0.3), 0.28),
        (v(0.12, 0.95, -0.45), 0.32),
        (v(0.2, 0.1, -0.85), 0.35),
        (v(0.2, -0.9, -0.6), 0.34),
        (v(0.15, -1.35, 0.1), 0.3),
    ])
});

/// Pinna: plate, rim, inner rim, bowl, tragus and lobe, flared from the head and tilted backward.
fn ear(f: f64, q: Vec3) -> f64 {
    let e = ear_space(q);
    if e.norm() > 5.0 {
        return f;
    }
    let o = Vec3::zeros();
    let plate = ellipsoid(e, o + v(-0.15, 0.3, -0.15), v(0.5, 2.6, 1.65));
    let lobe = ellipsoid(e, v(0.0, -2.1, 0.45), v(0.45, 0.95, 0.8));
    let rim = chain(e, &RIM, 0.04);
    let inner = chain(e, &INNER_RIM, 0.04);
    let mut g = join(plate, lobe, 0.6);
    g = join(g, rim, 0.35);
    g = join(g, inner, 0.3);
    let tragus = ellipsoid(e, v(0.2, -0.5, 1.15), v(0.5, 0.65, 0.45));
    let mut f = join(f, g, 0.7);
    f = meet(f, -ellipsoid(e, v(0.55, -0.35, 0.25), v(0.75, 0.95, 0.8)), 0.35);
    join(f, tragus, 0.4)
}

/// Wanted edge length, cm: fine on lids, lips, nose and ears, coarse on the chest.
fn size(p: Vec3) -> f64 {
    let q = fold(p, 0.0);
    let near = |c: Vec3, r: f64| ((q - c).norm() - r).max(0.0);
    let fine = near(v(3.2, 11.3, 8.0), 1.7).min(near(v(0.0, 4.6, 9.0), 2.4)).min(near(v(0.3, 7.5, 9.8), 1.5));
    let ears = near(Vec3::from(EAR), 3.0);
    let face = near(v(0.0, 8.0, 7.0), 5.5);
    let low = (-4.0 - p.y).max(0.0);
    let head = (0.24 + 0.09 * fine).min(0.3 + 0.1 * ears).min(0.42 + 0.08 * face).min(0.75);
    let rim = 0.8 + 0.15 * ((p.y - FLOOR - 0.8).abs() - 0.8).max(0.0);
    (head + 0.05 * low).min(1.3).min(rim)
}

/// The charts: face with the forehead, half of the scalp behind it, ear, chest, back, underside.
const PARTS: [Part; 6] = [
    Part { joined: true, up: [0.0, 1.0, 0.0], scale: 1.0 },
    Part { joined: false, up: [0.0, 1.0, 0.0], scale: 1.0 },
    Part { joined: false, up: [0.0, 1.0, 0.0], scale: 1.0 },
    Part { joined: true, up: [0.0, 1.0, 0.0], scale: 0.6 },
    Part { joined: true, up: [0.0, 1.0, 0.0], scale: 0.6 },
    Part { joined: true, up: [0.0, 0.0, 1.0], scale: 0.3 },
];

/// Part of a point on the half x >= 0.
fn part(p: Vec3) -> usize {
    if ellipsoid(ear_space(p), v(0.35, 0.15, -0.2), v(1.5, 3.7, 2.5)) < 0.0 {
        return 2;
    }
    if p.y < FLOOR + 0.7 {
        return 5;
    }
    // The neck line rises from under the chin to the nape.
    let jaw = 0.5 + 0.28 * (2.0 - p.z);
    if p.y < jaw {
        return if p.z > -4.4 { 3 } else { 4 };
    }
    if p.z > -0.8 { 0 } else { 1 }
}

/// The bust's mesh.
fn mesh() -> Mesh {
    let mut quads = polygonise(&grid(), &field);
    relax(&mut quads, &field, 3);
    let (position, triangle) = remesh(&quads, &field, &size, 6);
    assemble(&position, &triangle, &PARTS, &part)
}

/// A human bust: centimetres, y up, facing +z, chin at y = 0, crown at y = 23, cut flat and closed at the chest. Eight
/// charts; their seams run across the crown from ear to ear, down the middle of the back of the head, around the ears and
/// along the jaw. Symmetric about x = 0.
pub fn bust() -> Sample {
    Sample { mesh: mesh(), regions: vec![("scalp", scalp), ("brow", brow)] }
}

/// Hairline: (degrees around the vertical axis through the head from the face, height y of the line, cm).
const HAIRLINE: [(f64, f64); 12] = [
    (0.0, 18.0),
    (18.0, 18.2),
    (36.0, 18.3),
    (48.0, 16.8),
    (58.0, 15.0),
    (70.0, 12.6),
    (80.0, 11.2),
    (92.0, 12.2),
    (106.0, 11.2),
    (122.0, 7.4),
    (145.0, 4.6),
    (180.0, 3.6),
];

/// Scalp: 1 where the head bears hair, 0 on the face, ears and neck, with a soft border of about a centimetre at the
/// hairline over forehead, temples, ears and nape.
pub fn scalp(p: Vec3) -> f32 {
    let q = fold(p, 0.0);
    let angle = libm::atan2(q.x, q.z + 1.0).to_degrees();
    let k = HAIRLINE.partition_point(|h| h.0 <= angle).clamp(1, HAIRLINE.len() - 1);
    let ((a0, y0), (a1, y1)) = (HAIRLINE[k - 1], HAIRLINE[k]);
    let t = (angle - a0) / (a1 - a0);
    let line = y0 + (y1 - y0) * t * t * (3.0 - 2.0 * t);
    // Arc length per degree at the head's mean radius of 8 cm.
    let slope = (y1 - y0) / ((a1 - a0) * 0.14);
    let inside = (q.y - line) / (1.0 + slope * slope).sqrt();
    let pinna = ellipsoid(ear_space(q), v(0.35, 0.15, -0.2), v(1.3, 3.5, 2.3));
    (smoothstep(-0.5, 0.6, inside) * smoothstep(0.0, 0.6, pinna)) as f32
}

/// Eyebrows: 1 along the middle of the brow, 0 a centimetre beside it.
pub fn brow(p: Vec3) -> f32 {
    let q = fold(p, 0.0);
    let flat = v(q.x, q.y, 0.0);
    let line = [v(1.3, 12.9, 0.0), v(2.6, 13.35, 0.0), v(4.0, 13.5, 0.0), v(5.5, 12.9, 0.0)];
    let d = line.windows(2).map(|w| segment(flat, w[0], w[1]).1).fold(f64::INFINITY, f64::min);
    let outward = smoothstep(1.0, 5.5, q.x);
    let front = smoothstep(3.0, 4.5, q.z);
    (front * (1.0 - smoothstep(0.28 - 0.14 * outward, 0.62 - 0.26 * outward, d))) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::check::{crossings, facts, fingerprint, uv_overlap};

    #[test]
    fn the_bust_is_a_clean_closed_mesh() {
        let mesh = bust().mesh;
        let f = facts(&mesh);
        assert_eq!((f.open_edges, f.bad_edges, f.euler), (0, 0, 2));
        assert_eq!((f.charts, f.flipped_uv, uv_overlap(&mesh, 1024), crossings(&mesh)), (8, 0, 0, 0));
        assert!((10_000..24_000).contains(&mesh.triangle.len()), "{}", mesh.triangle.len());
        assert!(mesh.corner_uv.iter().flatten().flatten().all(|x| (0.015..=0.985).contains(x)));
        assert!(f.volume > 10_000.0);
        assert!(f.min_angle.iter().all(|&a| a > 15.0));
        let well = f.min_angle.iter().filter(|&&a| a > 30.0).count();
        assert!(well * 100 > mesh.triangle.len() * 98, "{well}");
        assert!(mesh.position.iter().flatten().all(|&x| x == f64::from(x as f32)));
    }

    #[test]
    fn the_bust_has_human_measures() {
        let (low, high) = bust().mesh.bounds();
        let near = |x: f64, y: f64| assert!((x - y).abs() < 0.5, "{x} {y}");
        near(high[1], 23.0);
        near(high[0] - low[0], 42.0);
        // Width and depth of the cranium, from the field.
        let reach = |d: Vec3| {
            let o = v(0.0, 15.0, -2.0);
            (0..2000).map(|i| f64::from(i) * 0.01).find(|&s| field(o + d * s) > 0.0).unwrap_or(0.0)
        };
        near(2.0 * reach(Vec3::x()), 15.3);
        near(reach(Vec3::z()) + reach(-Vec3::z()), 19.0);
    }

    #[test]
    fn the_bust_is_fixed_for_ever() {
        assert_eq!(fingerprint(&bust().mesh), FINGERPRINT, "positions or texture coordinates changed");
    }

    /// Of positions and texture coordinates; a change here changes every sample groom.
    const FINGERPRINT: u64 = 2537451377447437911;

    #[test]
    fn hair_grows_where_it_should() {
        for (p, hair) in [
            (v(0.0, 23.0, -1.0), 1.0),
            (v(0.0, 14.0, -10.5), 1.0),
            (v(7.4, 16.0, -2.0), 1.0),
            (v(0.0, 15.0, 8.5), 0.0),
            (v(3.2, 11.0, 8.0), 0.0),
            (v(6.0, 8.0, 3.0), 0.0),
            (v(8.0, 10.0, -0.8), 0.0),
            (v(0.0, 0.0, -8.6), 0.0),
        ] {
            assert_eq!((scalp(p), scalp(v(-p.x, p.y, p.z))), (hair, hair), "{p}");
        }
        assert_eq!((brow(v(3.3, 13.42, 8.3)), brow(v(-3.3, 13.42, 8.3))), (1.0, 1.0));
        assert_eq!((brow(v(3.3, 11.0, 8.3)), brow(v(0.0, 13.4, 8.8))), (0.0, 0.0));
    }
}
