//! Clusters for the tests of this module.

use super::{Cluster, Contour, Curve, Cylinder, Region, Tree};
use nalgebra::{Isometry3, Similarity3};
use pelage_geom::{Frame, NONE, Vec3};

/// A round cylinder of one radius from a skin whose normal is z and whose u is x.
pub fn plain(control: Vec<Vec3>, radius: f64) -> Cylinder {
    let root = Frame { origin: Vec3::zeros(), n: Vec3::z(), du: Vec3::x(), dv: Vec3::y() };
    Cylinder::new(control, &root, vec![radius])
}

/// A straight cluster of length 4 on a flat skin, in scalp space as large as in space.
pub fn upright(centre: [f64; 2], radius: f64) -> Cluster {
    let root = Vec3::new(centre[0], centre[1], 0.0);
    let cylinder = plain(vec![root, root + Vec3::z(), root + Vec3::z() * 4.0], radius);
    Cluster { parent: NONE, region: Region::circle(centre, radius), cylinder }
}

/// Straight; curved and tapered; curved, elliptical and twisted; with an irregular contour that changes; pointed.
pub fn samples() -> Vec<Cylinder> {
    let at = |p: &[[f64; 3]]| p.iter().map(|p| Vec3::from(*p)).collect::<Vec<_>>();
    let bend = at(&[[1.0, 2.0, 0.0], [1.2, 2.0, 1.0], [1.0, 2.6, 2.2], [1.8, 3.8, 2.6], [3.0, 4.8, 1.9]]);
    let curve = |t: &[f64], value: &[f64]| Curve { t: t.to_vec(), value: value.to_vec() };
    let taper =
        Cylinder { scale: [0, 1].map(|_| curve(&[0.0, 0.4, 1.0], &[1.0, 1.3, 0.3])), ..plain(bend.clone(), 0.3) };
    let twisted = Cylinder {
        scale: [curve(&[0.0, 1.0], &[1.5, 1.0]), curve(&[0.0, 0.5, 1.0], &[0.6, 0.8, 0.5])],
        twist: curve(&[0.0, 0.3, 1.0], &[0.4, 1.0, 4.0]),
        ..plain(bend.clone(), 0.25)
    };
    let ring = |k: f64, size: f64| (0..12).map(move |a| size * (1.0 + k * libm::cos(f64::from(a) * 1.047 + k)));
    let odd = Cylinder {
        contour: Contour {
            t: vec![0.0, 0.6, 1.0],
            angles: 12,
            radius: ring(0.1, 0.3).chain(ring(0.25, 0.25)).chain(ring(0.1, 0.2)).collect(),
        },
        twist: curve(&[0.1, 1.0], &[0.0, -1.5]),
        ..plain(bend.clone(), 1.0)
    };
    let pointed = Cylinder { scale: [0, 1].map(|_| curve(&[0.0, 1.0], &[1.0, 0.0])), ..plain(bend, 0.3) };
    vec![upright([0.3, 0.1], 0.5).cylinder, taper, twisted, odd, pointed]
}

/// A rigid motion.
pub fn motion() -> Similarity3<f64> {
    Similarity3::from_isometry(Isometry3::new(Vec3::new(3.0, -2.0, 0.7), Vec3::new(0.3, -1.9, 0.8)), 1.0)
}

/// The farthest that a number of a cylinder is from that of the same cylinder in another tree.
pub fn far(a: &Tree, b: &Tree) -> f64 {
    assert_eq!(a.cluster.len(), b.cluster.len());
    let numbers = |t: &Tree| -> Vec<f64> {
        let of = |c: &Cluster| {
            let c = &c.cylinder;
            let points = c.control.iter().chain([&c.axis, &c.side]).flat_map(|p| [p.x, p.y, p.z]);
            let curves = c.scale.iter().chain([&c.twist]).flat_map(|c| c.t.iter().chain(&c.value)).copied();
            points.chain(curves).chain(c.contour.t.iter().chain(&c.contour.radius).copied()).collect::<Vec<f64>>()
        };
        t.cluster.iter().flat_map(of).collect()
    };
    let (a, b) = (numbers(a), numbers(b));
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
