//! Scalp space: a plane that roots have coordinates in, where regions of hair are drawn.
//!
//! Kim, Neumann (2002) lay roots out in such a plane; Chang, Jin, Yu (2002, §2.1) draw the contour of hair in polar
//! coordinates of the scalp.

use crate::control::Skin;
use pelage_geom::{SurfacePoint, TiledMap, Vec3};

/// How roots get coordinates.
#[derive(Clone, Copy, Debug)]
pub enum Scalp<'a> {
    /// Texture coordinates.
    Uv,
    /// Degrees from `up` seen from `centre`, laid out around it: x toward `front`, y to the left of one who looks there.
    Polar {
        /// Middle of the scalp, scene units.
        centre: Vec3,
        /// Toward the middle of the plane, any length.
        up: Vec3,
        /// Toward x, not along `up`, any length.
        front: Vec3,
    },
    /// Red and green of a map, read at texture coordinates.
    Map(&'a TiledMap),
}

impl Scalp<'_> {
    /// Coordinates of a root.
    pub fn at(&self, skin: &Skin, root: &SurfacePoint) -> [f64; 2] {
        match self {
            Scalp::Uv => skin.uv(root).map(f64::from),
            Scalp::Map(map) => {
                let [r, g, _] = map.sample(skin.uv(root));
                [f64::from(r), f64::from(g)]
            }
            Scalp::Polar { centre, up, front } => polar(skin.mesh.point(root) - centre, *up, *front),
        }
    }
}

fn polar(away: Vec3, up: Vec3, front: Vec3) -> [f64; 2] {
    let up = up.normalize();
    let x = (front - up * up.dot(&front)).normalize();
    let y = up.cross(&x);
    let (a, b) = (away.dot(&x), away.dot(&y));
    let across = (a * a + b * b).sqrt();
    if across == 0.0 {
        return [0.0; 2];
    }
    let angle = libm::atan2(across, away.dot(&up)).to_degrees();
    [angle * a / across, angle * b / across]
}

/// True if a point lies inside a polygon (by the number of sides to its right).
pub fn inside(polygon: &[[f64; 2]], at: [f64; 2]) -> bool {
    let n = polygon.len();
    let crosses = |k: &usize| {
        let (a, b) = (polygon[*k], polygon[(k + 1) % n]);
        (a[1] > at[1]) != (b[1] > at[1]) && at[0] < a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    (0..n).filter(crosses).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_skin::TestSkin;

    #[test]
    fn polar_coordinates_are_degrees_from_the_crown() {
        let (up, front) = (Vec3::y() * 3.0, Vec3::new(0.0, 1.0, 2.0));
        let at = |x: f64, y: f64, z: f64| polar(Vec3::new(x, y, z), up, front);
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12;
        assert!(near(at(0.0, 5.0, 0.0), [0.0, 0.0]));
        assert!(near(at(0.0, 0.0, 2.0), [90.0, 0.0]));
        // Left of one who looks along z with y up is x.
        assert!(near(at(2.0, 2.0, 0.0), [0.0, 45.0]));
        assert!(near(at(0.0, -1.0, -1.0), [-135.0, 0.0]));
    }

    #[test]
    fn texture_coordinates_are_those_of_the_root() {
        let s = TestSkin::new(8, 6, 1.0);
        let root = SurfacePoint { triangle: 3, bary: [0.25, 0.5] };
        assert_eq!(Scalp::Uv.at(&s.skin(), &root), s.mesh.uv(&root).map(f64::from));
    }

    #[test]
    fn a_polygon_has_an_inside() {
        // Bent: a notch from the right.
        let shape = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 2.0], [4.0, 3.0], [4.0, 4.0], [0.0, 4.0]];
        for (at, is) in [([0.5, 2.0], true), ([3.0, 2.0], false), ([3.5, 0.5], true), ([5.0, 0.5], false)] {
            assert_eq!(inside(&shape, at), is, "{at:?}");
        }
    }
}
