//! A human bust modelled by formula: centimetres, y up, facing +z, the chin at y = 0 and the crown at y = 23.

use super::atlas::{Part, assemble};
use super::field::{ball, bump, chain, ellipsoid, fold, join, limb, meet, ridge, turn, v};
use super::nets::{Grid, polygonise, relax};
use super::remesh::remesh;
use crate::{Mesh, Vec3};

/// Where the chest is cut, cm.
const FLOOR: f64 = -20.0;

/// The grid that the bust is polygonised on: finest over the face.
pub fn grid() -> Grid {
    Grid {
        centre: v(0.0, 8.8, 5.0),
        inner: 5.5,
        cell: 0.33,
        growth: 0.055,
        bounds: [v(-23.0, FLOOR - 1.5, -15.0), v(23.0, 25.0, 13.0)],
    }
}

/// Signed field of the whole bust.
pub fn field(p: Vec3) -> f64 {
    let mut f = torso(p);
    if p.y > -9.0 {
        let g = head(p);
        f = join(f, g, 2.6);
    }
    meet(f, FLOOR - p.y, 2.0)
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
    let front = ellipsoid(p, v(0.0, 14.6, 1.2), v(6.4, 8.0, 7.2));
    let mut f = join(back, front, 4.0);
    let face = ellipsoid(p, v(0.0, 8.0, 2.7), v(5.7, 6.8, 5.9));
    f = join(f, face, 2.5);
    let cheek = ellipsoid(q, v(4.1, 8.8, 4.4), v(2.0, 2.2, 2.5));
    f = join(f, cheek, 2.0);
    let muzzle = ellipsoid(p, v(0.0, 4.9, 5.2), v(3.4, 3.3, 3.5));
    f = join(f, muzzle, 2.0);
    let jaw = chain(q, &[(v(0.8, 2.0, 6.2), 1.6), (v(3.5, 4.0, 2.0), 1.8), (v(4.6, 9.0, 0.2), 1.7)], 2.5);
    f = join(f, jaw, 3.5);
    let chin = ellipsoid(p, v(0.0, 1.7, 7.0), v(1.8, 1.6, 1.75));
    join(f, chin, 2.2)
}

/// Brow ridge, temples, cheeks: soft additions to the skull, cm.
fn relief(p: Vec3, q: Vec3) -> f64 {
    let brow = ridge(q, &[v(1.0, 12.9, 8.6), v(3.2, 13.5, 8.2), v(5.4, 12.8, 6.2)], 1.6);
    let glabella = bump(p, v(0.0, 12.9, 8.6), v(1.8, 1.6, 2.0));
    let temple = bump(q, v(7.0, 13.0, 4.0), v(2.5, 3.4, 3.4));
    let socket = bump(q, v(3.1, 11.4, 8.6), v(2.5, 1.75, 2.6));
    let hollow = bump(q, v(5.4, 5.6, 5.0), v(2.4, 2.8, 3.0));
    let nape = bump(p, v(0.0, 5.0, -9.5), v(5.0, 3.5, 4.0));
    0.3 * brow + 0.25 * glabella - 0.3 * temple - 0.85 * socket - 0.12 * hollow - 0.3 * nape
}

/// Eyeballs behind closed lids, with the line between the lids and the fold of the upper one.
fn eyes(f: f64, q: Vec3) -> f64 {
    let globe = ellipsoid(q, v(3.2, 11.2, 6.35), v(1.8, 1.35, 1.4));
    let mut f = join(f, globe, 1.0);
    let line = ridge(q, &[v(1.8, 11.0, 7.6), v(2.5, 10.85, 8.05), v(3.3, 10.8, 8.1), v(4.6, 11.05, 7.2)], 0.55);
    let fold_line = ridge(q, &[v(1.9, 11.8, 7.8), v(3.1, 12.2, 8.0), v(4.6, 11.9, 7.2)], 0.6);
    f += 0.24 * line + 0.14 * fold_line;
    f
}

/// Bridge, tip, wings and nostrils.
fn nose(f: f64, p: Vec3, q: Vec3) -> f64 {
    let bridge = chain(p, &[(v(0.0, 12.2, 7.9), 0.75), (v(0.0, 9.8, 8.8), 0.8), (v(0.0, 8.0, 9.7), 0.95)], 0.6);
    let flank = limb(q, v(0.55, 11.2, 7.5), v(1.0, 7.7, 8.5), 0.7, 1.0);
    let wing = ellipsoid(q, v(1.15, 7.35, 8.9), v(0.72, 0.68, 0.95));
    let tip = ball(p, v(0.0, 7.75, 9.95), 0.9);
    let mut g = join(bridge, flank, 1.0);
    g = join(g, tip, 0.6);
    g = join(g, wing, 0.5);
    let f = join(f, g, 1.2);
    let nostril = bump(q, v(0.75, 6.75, 9.6), v(0.55, 0.55, 0.75));
    f + 0.35 * nostril
}

/// Lips, the line between them, philtrum and the crease above the chin.
fn mouth(f: f64, p: Vec3, q: Vec3) -> f64 {
    let upper = ridge(q, &[v(0.4, 5.15, 9.2), v(1.2, 4.95, 8.9), v(2.6, 4.5, 7.8)], 0.75);
    let lower = ridge(q, &[v(0.0, 3.95, 9.0), v(1.0, 4.0, 8.8), v(2.3, 4.4, 8.0)], 0.85);
    let line = ridge(q, &[v(0.0, 4.5, 9.4), v(0.6, 4.58, 9.3), v(1.3, 4.5, 8.9), v(2.7, 4.4, 7.7)], 0.5);
    let philtrum = ridge(p, &[v(0.0, 6.5, 9.2), v(0.0, 5.5, 9.4)], 0.6);
    let crease = ridge(q, &[v(0.0, 3.0, 9.0), v(1.6, 3.2, 8.2)], 0.9);
    let corner = bump(q, v(2.7, 4.3, 7.8), v(0.7, 0.7, 0.9));
    f - 0.26 * upper - 0.34 * lower + 0.36 * line + 0.14 * philtrum + 0.22 * crease + 0.15 * corner
}

/// The ear's centre.
const EAR: [f64; 3] = [7.3, 9.6, -0.6];

/// Pinna: plate, rim, inner rim, bowl, tragus and lobe, flared from the head and tilted backward.
fn ear(f: f64, q: Vec3) -> f64 {
    let c = Vec3::from(EAR);
    let e = turn(turn(q, c, 1, 24.0), c, 0, 10.0) - c;
    if e.norm() > 5.0 {
        return f;
    }
    let o = Vec3::zeros();
    let plate = ellipsoid(e, o + v(-0.15, 0.3, -0.15), v(0.5, 2.6, 1.65));
    let lobe = ellipsoid(e, v(0.0, -2.1, 0.45), v(0.45, 0.95, 0.8));
    let rim = chain(
        e,
        &[
            (v(0.0, 0.2, 1.0), 0.3),
            (v(0.15, 1.8, 1.25), 0.36),
            (v(0.25, 2.75, 0.3), 0.38),
            (v(0.3, 2.3, -1.15), 0.38),
            (v(0.3, 0.6, -1.75), 0.36),
            (v(0.2, -1.1, -1.2), 0.32),
            (v(0.1, -2.1, -0.2), 0.3),
        ],
        0.3,
    );
    let inner = chain(e, &[(v(0.05, 1.5, 0.0), 0.3), (v(0.2, 0.3, -0.85), 0.36), (v(0.2, -1.1, -0.5), 0.34)], 0.3);
    let mut g = join(plate, lobe, 0.6);
    g = join(g, rim, 0.35);
    g = join(g, inner, 0.3);
    let tragus = ellipsoid(e, v(0.2, -0.5, 1.15), v(0.5, 0.65, 0.45));
    let mut f = join(f, g, 0.7);
    f = meet(f, -ellipsoid(e, v(0.55, -0.35, 0.25), v(0.75, 0.95, 0.8)), 0.35);
    join(f, tragus, 0.4)
}

/// Wanted edge length, cm: fine on lids, lips, nose and ears, coarse on the chest.
pub fn size(p: Vec3) -> f64 {
    let q = fold(p, 0.0);
    let near = |c: Vec3, r: f64| ((q - c).norm() - r).max(0.0);
    let fine = near(v(3.2, 11.3, 8.0), 1.7).min(near(v(0.0, 4.6, 9.0), 2.4)).min(near(v(0.3, 7.5, 9.8), 1.5));
    let ears = near(Vec3::from(EAR), 3.0);
    let face = near(v(0.0, 8.0, 7.0), 5.5);
    let low = (-4.0 - p.y).max(0.0);
    let head = (0.27 + 0.09 * fine).min(0.3 + 0.1 * ears).min(0.42 + 0.08 * face).min(0.75);
    (head + 0.06 * low).min(1.45)
}

/// The charts: face with the forehead, half of the scalp behind it, ear, chest, back, underside.
const PARTS: [Part; 6] = [
    Part { joined: true, up: [0.0, 1.0, 0.0], scale: 1.0 },
    Part { joined: false, up: [0.0, 1.0, 0.0], scale: 1.0 },
    Part { joined: false, up: [0.0, 1.0, 0.0], scale: 1.0 },
    Part { joined: true, up: [0.0, 1.0, 0.0], scale: 0.5 },
    Part { joined: true, up: [0.0, 1.0, 0.0], scale: 0.5 },
    Part { joined: true, up: [0.0, 0.0, 1.0], scale: 0.3 },
];

/// Part of a point on the half x >= 0.
fn part(p: Vec3) -> usize {
    let c = Vec3::from(EAR);
    let e = turn(turn(p, c, 1, 24.0), c, 0, 10.0) - c;
    if ellipsoid(e, v(0.35, 0.15, -0.2), v(1.5, 3.7, 2.5)) < 0.0 {
        return 2;
    }
    if p.y < FLOOR + 0.7 {
        return 5;
    }
    // The neck line rises from under the chin to the nape.
    let jaw = 1.2 + 0.28 * (2.0 - p.z).max(0.0);
    if p.y < jaw {
        return if p.z > -4.4 { 3 } else { 4 };
    }
    if p.z > -0.8 { 0 } else { 1 }
}

/// The bust's mesh.
pub fn mesh() -> Mesh {
    let mut quads = polygonise(&grid(), &field);
    relax(&mut quads, &field, 3);
    let (position, triangle) = remesh(&quads, &field, &size, 6);
    assemble(&position, &triangle, &PARTS, &part)
}
