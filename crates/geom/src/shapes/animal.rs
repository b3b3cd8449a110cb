//! A small fox modelled by formula: centimetres, y up, facing +z, paws on y = 0.

use super::Sample;
use super::atlas::{Part, assemble};
use super::field::{ball, bump, chain, ellipsoid, fold, join, limb, meet, ridge, segment, smoothstep, spline, turn, v};
use super::nets::{Grid, polygonise, relax};
use super::remesh::remesh;
use crate::{Mesh, Vec3};
use std::sync::LazyLock;

/// The tail's middle line with radii, root first.
pub(super) static TAIL: LazyLock<Vec<(Vec3, f64)>> = LazyLock::new(|| {
    spline(&[
        (v(0.0, 12.4, -7.5), 1.3),
        (v(0.0, 12.0, -10.2), 1.0),
        (v(0.0, 10.2, -12.8), 1.15),
        (v(0.0, 8.2, -15.2), 1.3),
        (v(0.0, 7.0, -18.0), 1.1),
        (v(0.0, 7.2, -20.6), 0.6),
        (v(0.0, 7.8, -22.0), 0.3),
    ])
});

/// Root of the ear, and how it leans outward and forward, degrees.
const EAR: [f64; 3] = [1.55, 19.5, 9.4];

/// A point in the ear's frame: x across, y to the tip, z to the opening.
fn ear_space(q: Vec3) -> Vec3 {
    let c = Vec3::from(EAR);
    turn(turn(q, c, 2, 16.0), c, 1, -18.0) - c
}

/// Signed field of the whole animal.
fn field(p: Vec3) -> f64 {
    let q = fold(p, 0.12);
    let mut f = trunk(p, q);
    f = join(f, legs(q), 1.6);
    if p.z < -5.0 {
        f = join(f, chain(p, &TAIL, 0.05), 1.2);
    }
    if p.z > 2.0 && p.y > 9.0 {
        f = join(f, head(p, q), 1.6);
    }
    f
}

/// Chest, belly, rump and neck.
fn trunk(p: Vec3, q: Vec3) -> f64 {
    let spine = chain(p, &[(v(0.0, 11.9, 3.6), 3.1), (v(0.0, 12.2, -1.0), 2.7), (v(0.0, 12.0, -5.6), 2.9)], 1.5);
    let chest = ellipsoid(p, v(0.0, 10.9, 3.8), v(2.9, 3.6, 3.6));
    let shoulder = ellipsoid(q, v(1.9, 11.0, 3.8), v(1.4, 2.9, 2.1));
    let neck = limb(p, v(0.0, 12.6, 5.0), v(0.0, 17.0, 9.0), 2.7, 2.1);
    join(join(join(spine, chest, 1.5), shoulder, 1.4), neck, 2.2)
}

/// Fore and hind legs with paws and toes.
fn legs(q: Vec3) -> f64 {
    let fore = chain(
        q,
        &[(v(1.9, 10.5, 4.0), 1.5), (v(1.95, 6.2, 3.4), 0.95), (v(1.95, 2.6, 3.9), 0.7), (v(1.95, 1.0, 4.2), 0.75)],
        0.6,
    );
    let thigh = ellipsoid(q, v(1.75, 9.6, -5.6), v(1.4, 3.4, 2.6));
    let hind = chain(
        q,
        &[
            (v(1.95, 8.0, -5.2), 1.5),
            (v(2.05, 4.6, -7.6), 0.85),
            (v(2.05, 1.7, -7.0), 0.68),
            (v(2.05, 0.9, -6.4), 0.75),
        ],
        0.6,
    );
    let paw = |z: f64, x: f64| {
        let sole = ellipsoid(q, v(x, 0.72, z), v(0.92, 0.78, 1.3));
        let toe = |s: f64| ridge(q, &[v(x + s, 0.2, z + 1.4), v(x + s * 0.7, 1.1, z + 0.8)], 0.3);
        meet(sole + 0.14 * (toe(0.0) + toe(-0.45) + toe(0.45)), -0.02 - (q.y - 0.04), 0.5)
    };
    let hind = join(join(thigh, hind, 1.2), paw(-5.9, 2.05), 0.5);
    join(fore, paw(4.7, 1.95), 0.5).min(hind)
}

/// Skull, cheeks, snout, nose, eyes and ears.
fn head(p: Vec3, q: Vec3) -> f64 {
    let skull = ellipsoid(p, v(0.0, 18.2, 9.8), v(2.55, 2.35, 2.75));
    let cheek = ellipsoid(q, v(1.3, 17.2, 10.3), v(1.35, 1.3, 1.6));
    let snout = limb(p, v(0.0, 17.45, 11.2), v(0.0, 16.9, 15.1), 1.6, 0.7);
    let jaw = limb(q, v(0.5, 16.5, 10.8), v(0.2, 16.2, 14.2), 0.9, 0.45);
    let mut f = join(join(skull, cheek, 1.0), snout, 1.3);
    f = join(f, jaw, 0.9);
    let brow = bump(q, v(1.05, 19.15, 12.1), v(1.0, 0.8, 1.2));
    let socket = bump(q, v(1.25, 18.35, 12.6), v(0.85, 0.7, 1.2));
    f += 0.32 * socket - 0.16 * brow;
    let lid = ridge(q, &[v(0.75, 18.1, 12.7), v(1.2, 18.65, 12.5), v(1.75, 18.45, 11.9)], 0.3);
    f = join(f, ball(q, v(1.27, 18.35, 11.86), 0.62), 0.12) - 0.08 * lid;
    let nose = ellipsoid(p, v(0.0, 17.12, 15.6), v(0.56, 0.45, 0.5));
    f = join(f, nose, 0.18) + 0.12 * bump(q, v(0.3, 17.05, 16.0), v(0.2, 0.18, 0.35));
    f += 0.12 * ridge(q, &[v(0.0, 16.5, 15.5), v(0.55, 16.5, 14.4), v(1.15, 16.75, 12.4)], 0.55);
    if p.y > 17.5 && p.z < 13.0 { ear(f, q) } else { f }
}

/// A cone in the ear's frame, flattened along z, from height `low`, thinner by `w`, moved forward by `z`.
fn cone(e: Vec3, w: f64, z: f64, low: f64) -> f64 {
    let s = v(e.x, e.y, (e.z - z) * 1.4);
    let (t, d) = segment(s, v(0.0, low, 0.0), v(0.0, 3.6 - 0.8 * low.max(0.0), 0.0));
    (d - w * (1.4 - 1.12 * t)) / 1.2
}

/// A pointed shell, hollow in front.
fn ear(f: f64, q: Vec3) -> f64 {
    let e = ear_space(q);
    join(f, meet(cone(e, 1.0, 0.0, -0.3), -cone(e, 0.68, 0.66, 0.7), 0.4), 0.6)
}

/// Wanted edge length, cm: fine on the face and paws.
fn size(p: Vec3) -> f64 {
    let q = fold(p, 0.0);
    let near = |c: Vec3, r: f64| ((q - c).norm() - r).max(0.0);
    let eye = near(v(1.25, 18.3, 12.3), 0.6).min(near(v(0.2, 17.0, 15.6), 0.6));
    let ear = near(Vec3::from(EAR) + v(0.4, 1.8, 0.2), 1.6);
    let tip = near(Vec3::from(EAR) + v(1.0, 3.3, 0.2), 0.4);
    let face = near(v(0.0, 17.0, 13.5), 2.2);
    let paw = (q.y - 1.2).max(0.0);
    let tail = (-10.0 - q.z).max(0.0);
    (0.16 + 0.1 * eye)
        .min(0.16 + 0.08 * tip)
        .min(0.25 + 0.08 * ear)
        .min(0.21 + 0.06 * face)
        .min(0.3 + 0.06 * paw)
        .min(0.55 - 0.015 * tail)
}

const UP: [f64; 3] = [0.0, 1.0, 0.0];
const FORE: [f64; 3] = [0.0, 0.0, 1.0];

/// Charts of the half x >= 0: (0) upper head, (1) throat and jaw, (2, 3) ear in front and behind, (4) back and flanks,
/// (5) belly, (6, 7) fore leg outside and inside, (8, 9) hind leg, (10, 11) tail above and below.
const PARTS: [Part; 12] = [
    Part { joined: true, up: UP, scale: 1.3 },
    Part { joined: true, up: FORE, scale: 1.0 },
    Part { joined: false, up: UP, scale: 1.0 },
    Part { joined: false, up: UP, scale: 1.0 },
    Part { joined: true, up: FORE, scale: 1.0 },
    Part { joined: true, up: FORE, scale: 0.7 },
    Part { joined: false, up: UP, scale: 1.0 },
    Part { joined: false, up: UP, scale: 0.8 },
    Part { joined: false, up: UP, scale: 1.0 },
    Part { joined: false, up: UP, scale: 0.8 },
    Part { joined: true, up: FORE, scale: 1.0 },
    Part { joined: true, up: FORE, scale: 1.0 },
];

/// Height of the tail's middle line at `z`, and whether `z` lies on the free tail.
fn tail_line(z: f64) -> (f64, bool) {
    let k = TAIL.partition_point(|t| t.0.z > z).clamp(1, TAIL.len() - 1);
    let (a, b) = (TAIL[k - 1].0, TAIL[k].0);
    (a.y + (b.y - a.y) * ((z - a.z) / (b.z - a.z)).clamp(0.0, 1.0), z < -9.4)
}

/// Part of a point on the half x >= 0.
fn part(p: Vec3) -> usize {
    let e = ear_space(p);
    if e.y > 0.45 && cone(e, 1.0, 0.0, -0.3) < 0.2 {
        return if e.z > 0.1 { 2 } else { 3 };
    }
    let (line, tail) = tail_line(p.z);
    if tail {
        return if p.y > line { 10 } else { 11 };
    }
    let neck = 0.55 * (p.y - 15.0) + 0.83 * (p.z - 7.5);
    if neck > 0.0 && p.y > 13.0 {
        return usize::from(p.y < 16.9 - 1.1 * (9.0 - p.z).max(0.0));
    }
    if p.y < 7.0 && p.z > 0.0 {
        return if p.x > 1.95 { 6 } else { 7 };
    }
    if p.y < 7.0 && p.z < -2.0 {
        return if p.x > 2.05 { 8 } else { 9 };
    }
    let chest = p.x < 1.6 && p.z > 4.0 && 0.74 * (p.z - 5.0) > 0.67 * (p.y - 12.6) - 0.3;
    let rump = p.x < 1.1 && p.z < -7.0 && p.y < line;
    if (p.y < 10.0 && p.x < 1.5 && p.z < 5.6) || chest || rump { 5 } else { 4 }
}

/// A standing fox: centimetres, y up, facing +z, 22 cm high and 38 cm from nose to tail. Symmetric about x = 0.
pub fn animal() -> Sample {
    Sample { mesh: mesh(), regions: vec![("undercoat", undercoat), ("overcoat", overcoat)] }
}

fn mesh() -> Mesh {
    let grid = Grid {
        centre: v(0.0, 16.0, 10.0),
        inner: 7.0,
        cell: 0.26,
        growth: 0.02,
        bounds: [v(-0.8, -1.0, -23.5), v(5.5, 24.5, 17.5)],
    };
    let mut quads = polygonise(&grid, &field);
    relax(&mut quads, &field, 3);
    let (position, triangle) = remesh(&quads, &field, &size, 6);
    assemble(&position, &triangle, &PARTS, &part)
}

/// Undercoat: everywhere but nose, eyes, inner ears and the soles of the paws.
pub fn undercoat(p: Vec3) -> f32 {
    let q = fold(p, 0.0);
    let nose = smoothstep(0.0, 0.3, ellipsoid(p, v(0.0, 17.12, 15.7), v(0.62, 0.5, 0.55)));
    let eye = smoothstep(0.02, 0.2, ball(q, v(1.27, 18.35, 11.9), 0.6));
    let e = ear_space(q);
    let hollow = ellipsoid(e, v(0.0, 1.5, 0.75), v(0.75, 1.45, 0.85));
    let sole = smoothstep(0.12, 0.4, p.y);
    (nose * eye * smoothstep(0.0, 0.35, hollow) * sole) as f32
}

/// Overcoat (guard hair): full on back, flanks, tail, cheeks and mane; less on belly; little on face and legs.
pub fn overcoat(p: Vec3) -> f32 {
    let q = fold(p, 0.0);
    let body = smoothstep(6.0, 10.0, q.y);
    let (line, _) = tail_line(p.z);
    let tail = smoothstep(-9.0, -10.5, p.z) * smoothstep(3.5, 2.5, (p.y - line).abs());
    let snout = smoothstep(11.6, 13.0, p.z) * smoothstep(14.5, 15.5, p.y);
    let face = smoothstep(10.6, 12.0, p.z) * smoothstep(17.6, 18.4, p.y);
    let ear = smoothstep(0.2, 1.0, ear_space(q).y) * smoothstep(19.0, 20.0, p.y);
    let bare = snout.max(face).max(ear);
    let under = 0.5 * smoothstep(9.8, 8.4, p.y) * smoothstep(-2.5, -1.5, p.z) * smoothstep(3.0, 2.0, p.z);
    let coat = body.max(tail) * (1.0 - under) * (1.0 - 0.85 * bare);
    (coat.max(0.15) * f64::from(undercoat(p))) as f32
}

/// Unit direction in which fur lies at a point `p` with unit normal `n`, tangent to the skin: from the nose backward over
/// head and body, down the legs, along the tail, up the ears.
pub fn fur_direction(p: Vec3, n: Vec3) -> Vec3 {
    let q = fold(p, 0.0);
    let side = if p.x < 0.0 { -1.0 } else { 1.0 };
    // On the body: backward, sinking on the flanks.
    let mut d = v(0.0, -0.25 - 0.35 * smoothstep(1.0, 3.0, q.x), -1.0);
    // Head: away from the nose's tip.
    let head = smoothstep(7.5, 10.0, p.z) * smoothstep(14.5, 16.0, p.y);
    let away = (p - v(0.0, 17.3, 16.4)).normalize();
    d = d * (1.0 - head) + away * head;
    // Neck and chest: down and back.
    let chest = smoothstep(4.5, 6.5, p.z) * smoothstep(15.5, 14.0, p.y);
    d = d * (1.0 - chest) + v(0.0, -1.0, -0.2) * chest;
    let leg = smoothstep(9.5, 7.0, p.y) * smoothstep(-11.0, -9.0, p.z);
    d = d * (1.0 - leg) + v(0.0, -1.0, -0.15) * leg;
    // Paws: to the toes.
    let paw = smoothstep(1.6, 0.7, p.y);
    d = d * (1.0 - paw) + v(0.0, -0.3, 1.0) * paw;
    let tail = smoothstep(-8.5, -10.5, p.z);
    let k = TAIL.partition_point(|t| t.0.z > p.z).clamp(1, TAIL.len() - 1);
    d = d * (1.0 - tail) + (TAIL[k].0 - TAIL[k - 1].0).normalize() * tail;
    let ear = smoothstep(0.3, 1.0, ear_space(q).y) * smoothstep(19.3, 20.0, p.y);
    d = d * (1.0 - ear) + v(0.27 * side, 1.0, 0.0) * ear;
    let flat = d - n * d.dot(&n);
    if flat.norm() > 1e-3 * d.norm() {
        return flat.normalize();
    }
    // Where the flow meets the skin head on (the very tip of nose or tail): any direction along the skin.
    let other = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    (other - n * other.dot(&n)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::check::{crossings, facts, fingerprint, uv_overlap};

    #[test]
    fn the_animal_is_a_clean_closed_mesh() {
        let mesh = animal().mesh;
        let f = facts(&mesh);
        assert_eq!((f.open_edges, f.bad_edges, f.euler), (0, 0, 2));
        assert_eq!((f.charts, f.flipped_uv, uv_overlap(&mesh, 1024), crossings(&mesh)), (18, 0, 0, 0));
        assert!((8_000..20_000).contains(&mesh.triangle.len()), "{}", mesh.triangle.len());
        assert!(mesh.corner_uv.iter().flatten().flatten().all(|x| (0.015..=0.985).contains(x)));
        assert!(f.volume > 300.0);
        assert!(f.min_angle.iter().all(|&a| a > 12.0));
        let well = f.min_angle.iter().filter(|&&a| a > 30.0).count();
        assert!(well * 100 > mesh.triangle.len() * 97, "{well}");
    }

    #[test]
    fn the_animal_is_fixed_for_ever() {
        assert_eq!(fingerprint(&animal().mesh), FINGERPRINT, "positions or texture coordinates changed");
    }

    /// Of positions and texture coordinates; a change here changes every sample groom.
    const FINGERPRINT: u64 = 2639873670013854544;

    #[test]
    fn coats_lie_where_they_should() {
        for (p, under, over) in [
            (v(0.0, 15.1, -1.0), 1.0, 1.0),
            (v(2.8, 12.0, -2.0), 1.0, 1.0),
            (v(0.0, 17.1, 16.1), 0.0, 0.0),
            (v(1.95, 0.02, 4.7), 0.0, 0.0),
            (v(0.0, 9.5, -15.0), 1.0, 1.0),
        ] {
            assert_eq!((undercoat(p), overcoat(p)), (under, over), "{p}");
        }
        assert!(overcoat(v(2.6, 3.0, 3.9)) < 0.2);
    }

    #[test]
    fn fur_lies_along_the_skin_from_nose_to_tail() {
        let mesh = animal().mesh;
        for t in 0..mesh.triangle.len() as u32 {
            let [a, b, c] = mesh.corners(t);
            let n = (b - a).cross(&(c - a)).normalize();
            let d = fur_direction((a + b + c) / 3.0, n);
            assert!((d.norm() - 1.0).abs() < 1e-9 && d.dot(&n).abs() < 1e-9);
        }
        assert!(fur_direction(v(0.0, 15.0, 0.0), Vec3::y()).z < -0.99);
        assert!(fur_direction(v(2.9, 4.0, 3.6), Vec3::x()).y < -0.9);
    }
}
