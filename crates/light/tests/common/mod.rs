//! Hairs to throw shadow with, shared by tests and benches. Lengths are metres.
#![allow(dead_code)]

use pelage_geom::{Mesh, Offsets, Topology, Vec3, rng};
use pelage_light::shadow::{ShadowHair, Solid};

/// A layer that owns its columns.
pub struct Groom {
    pub offsets: Offsets,
    pub position: Vec<[f32; 3]>,
    pub origin: [f64; 3],
    pub width: Vec<f32>,
    pub opacity: Vec<f32>,
}

impl Groom {
    pub fn view(&self) -> ShadowHair<'_> {
        ShadowHair {
            offsets: &self.offsets,
            position: &self.position,
            origin: self.origin,
            width: &self.width,
            opacity: &self.opacity,
        }
    }
}

/// Radius of the ball that hair grows on.
pub const BALL: f64 = 0.1;

fn u(id: usize, k: u64) -> f64 {
    rng::uniform(1, id as u64, 2, k)
}

/// Any unit vector, evenly.
pub fn sphere(a: f64, b: f64) -> Vec3 {
    let z = 2.0 * a - 1.0;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let t = std::f64::consts::TAU * b;
    Vec3::new(r * libm::cos(t), z, r * libm::sin(t))
}

/// Hairs of `curve(root direction, hair, part of the length)`, 80 um wide, of opacity 0.5 to 1.
pub fn groom(hairs: usize, points: usize, curve: impl Fn(Vec3, usize, f64) -> Vec3) -> Groom {
    let mut position = Vec::with_capacity(hairs * points);
    for i in 0..hairs {
        let n = sphere(u(i, 0), u(i, 1));
        for k in 0..points {
            position.push(curve(n, i, k as f64 / (points - 1) as f64).cast::<f32>().into());
        }
    }
    Groom {
        offsets: Offsets::uniform(hairs, points),
        width: vec![80e-6; position.len()],
        opacity: (0..hairs).map(|i| 0.5 + 0.5 * u(i, 3) as f32).collect(),
        position,
        origin: [0.0; 3],
    }
}

/// Long hair: 20 cm, bent down.
pub fn long(hairs: usize, points: usize) -> Groom {
    groom(hairs, points, |n, i, s| {
        let length = 0.2 * (0.8 + 0.4 * u(i, 2));
        let side = (sphere(u(i, 4), u(i, 5)) * 0.12 + n).normalize();
        let out = BALL + 0.45 * length * s * (1.0 - 0.45 * s);
        n * BALL + side * (out - BALL) - Vec3::y() * (0.75 * length * s * s)
    })
}

/// Short fur: 2 cm, combed to one side.
pub fn fur(hairs: usize, points: usize) -> Groom {
    groom(hairs, points, |n, i, s| {
        let length = 0.02 * (0.7 + 0.6 * u(i, 2));
        let comb = (Vec3::new(0.3, -1.0, 0.2) + sphere(u(i, 4), u(i, 5)) * 0.4).normalize();
        n * (BALL + length * s * (0.9 - 0.4 * s)) + comb * (0.6 * length * s * s)
    })
}

/// Curls: helices of 4 mm radius and 2 cm pitch around long hair.
pub fn curly(hairs: usize, points: usize) -> Groom {
    groom(hairs, points, |n, i, s| {
        let length = 0.2 * (0.8 + 0.4 * u(i, 2));
        let x = n.cross(&if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() }).normalize();
        let y = n.cross(&x);
        let angle = std::f64::consts::TAU * (10.0 * length / 0.2 * s + u(i, 6));
        let radius = 0.004 * (s * 8.0).min(1.0);
        let axis = n * (BALL + 0.5 * length * s) - Vec3::y() * (0.6 * length * s * s);
        axis + (x * libm::cos(angle) + y * libm::sin(angle)) * radius
    })
}

/// A ball as a mesh of 4 n^2 triangles.
pub fn ball(n: usize, radius: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let mut vertex = Vec::new();
    let mut triangle = Vec::new();
    for j in 0..=n {
        let polar = std::f64::consts::PI * j as f64 / n as f64;
        for i in 0..2 * n {
            let a = std::f64::consts::PI * i as f64 / n as f64;
            let (s, c) = (libm::sin(polar), libm::cos(polar));
            vertex.push([radius * s * libm::cos(a), radius * c, radius * s * libm::sin(a)]);
            if j < n {
                let at = |i: usize, j: usize| (j * 2 * n + i % (2 * n)) as u32;
                triangle.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                triangle.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    (vertex, triangle)
}

/// A mesh with what a [`Solid`] needs.
pub struct Body {
    pub position: Vec<[f64; 3]>,
    pub triangle: Vec<[u32; 3]>,
    pub bvh: pelage_geom::Bvh,
}

impl Body {
    pub fn new((position, triangle): (Vec<[f64; 3]>, Vec<[u32; 3]>)) -> Body {
        let mesh = Mesh { position: position.clone(), triangle: triangle.clone(), ..Mesh::default() };
        let topology = Topology::new(&mesh);
        let bvh = pelage_geom::Bvh::build(&position, &triangle, &topology);
        Body { position, triangle, bvh }
    }

    pub fn view(&self) -> Solid<'_> {
        Solid { position: &self.position, triangle: &self.triangle, bvh: &self.bvh }
    }
}

/// Every nth point of all layers, about `count` of them, in mixed order.
pub fn some_points(layers: &[ShadowHair], count: usize) -> Vec<[usize; 2]> {
    let total: usize = layers.iter().map(|l| l.position.len()).sum();
    let mut out: Vec<[usize; 2]> = (0..count)
        .map(|k| {
            let mut i = (rng::uniform(5, k as u64, 6, 0) * total as f64) as usize;
            for (l, layer) in layers.iter().enumerate() {
                if i < layer.position.len() {
                    return [l, i];
                }
                i -= layer.position.len();
            }
            [0, 0]
        })
        .collect();
    out.sort_unstable();
    out.dedup();
    out
}
