//! A small skin for tests: a sphere with bumps, in two charts that meet along two meridians.

use crate::control::Skin;
use pelage_geom::{Bvh, Mesh, Pose, Topology, Vec3};

pub struct TestSkin {
    pub mesh: Mesh,
    pub topology: Topology,
    pub rest: Pose,
    pub bvh: Bvh,
}

impl TestSkin {
    /// Radius 10, bumps of height `bump`, `nu` x `nv` cells of longitude and latitude (`nu` even).
    pub fn new(nu: usize, nv: usize, bump: f64) -> Self {
        let tau = std::f64::consts::TAU;
        let at = |i: usize, j: usize| {
            let (a, b) = (tau * (i % nu) as f64 / nu as f64, tau * 0.5 * j as f64 / nv as f64);
            let d = Vec3::new(libm::sin(b) * libm::cos(a), libm::cos(b), -libm::sin(b) * libm::sin(a));
            d * (10.0 + bump * libm::sin(5.0 * d.x) * libm::sin(6.0 * d.y) * libm::cos(4.0 * d.z))
        };
        let mut mesh = Mesh::default();
        mesh.position.push(at(0, 0).into());
        (1..nv).for_each(|j| (0..nu).for_each(|i| mesh.position.push(at(i, j).into())));
        mesh.position.push(at(0, nv).into());
        let last = mesh.position.len() as u32 - 1;
        let vertex = |i: usize, j: usize| match j {
            0 => 0,
            j if j == nv => last,
            j => (1 + (j - 1) * nu + i % nu) as u32,
        };
        for j in 0..nv {
            for i in 0..nu {
                let shift = if i < nu / 2 { 0.0 } else { 0.25 };
                let uv =
                    |i: f64, j: usize| [(i / nu as f64 * 0.75 + shift) as f32, 1.0 - (j as f64 / nv as f64) as f32];
                let (x, y) = (i as f64, (i + 1) as f64);
                let pole = if i < nu / 2 { 0.25 * nu as f64 } else { 0.75 * nu as f64 };
                // Seen from outside, longitude runs to the right and latitude index down.
                let mut add = |t: [u32; 3], c: [[f32; 2]; 3]| {
                    mesh.triangle.push(t);
                    mesh.corner_uv.push(c);
                    mesh.face.push((j * nu + i) as u32);
                };
                if j > 0 {
                    let middle = if j + 1 == nv { pole } else { y };
                    add(
                        [vertex(i, j), vertex(i + 1, j + 1), vertex(i + 1, j)],
                        [uv(x, j), uv(middle, j + 1), uv(y, j)],
                    );
                }
                if j + 1 < nv {
                    let middle = if j == 0 { pole } else { x };
                    add(
                        [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1)],
                        [uv(middle, j), uv(x, j + 1), uv(y, j + 1)],
                    );
                }
            }
        }
        let topology = Topology::new(&mesh);
        let rest = Pose::new(&mesh, &topology, mesh.position.clone());
        let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
        TestSkin { mesh, topology, rest, bvh }
    }

    pub fn skin(&self) -> Skin<'_> {
        Skin { mesh: &self.mesh, topology: &self.topology, rest: &self.rest }
    }

    /// The skin with every vertex moved.
    pub fn posed(&self, f: impl Fn(Vec3) -> Vec3) -> Pose {
        let position = self.mesh.position.iter().map(|&p| f(Vec3::from(p)).into()).collect();
        Pose::new(&self.mesh, &self.topology, position)
    }
}

#[test]
fn the_test_skin_is_what_it_says() {
    let s = TestSkin::new(24, 12, 1.0);
    assert_eq!(s.topology.charts, 2);
    assert_eq!(s.topology.counts.open_edges, 0);
    assert_eq!(s.topology.counts.mirrored, 0);
    assert_eq!(s.topology.counts.zero_area, 0);
    assert!(s.bvh.closest(Vec3::zeros(), f64::INFINITY).unwrap().signed_distance < -5.0);
    assert!(s.bvh.closest(Vec3::new(0.0, 20.0, 3.0), f64::INFINITY).unwrap().signed_distance > 5.0);
}
