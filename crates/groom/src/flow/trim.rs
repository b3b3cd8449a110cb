//! Hair cut where it meets a surface.

use pelage_geom::{Bvh, Vec3, curve::resample};

/// Length of a polyline from its root to where it first runs through a surface, from either side; none if it never
/// does. The trimming tool of Hadap, Magnenat-Thalmann §3.
pub fn length_to(line: &[Vec3], surface: &Bvh) -> Option<f64> {
    let mut before = 0.0;
    for w in line.windows(2) {
        let side = w[1] - w[0];
        if let Some((t, _)) = surface.ray(w[0], side, 1.0 + 1e-12) {
            return Some(before + t.min(1.0) * side.norm());
        }
        before += side.norm();
    }
    None
}

/// Length of a polyline from its root to where it first runs through the plane through `point` across `normal`, from
/// either side; none if it never does.
pub fn length_to_plane(line: &[Vec3], point: Vec3, normal: Vec3) -> Option<f64> {
    let mut before = 0.0;
    for w in line.windows(2) {
        let (a, b) = ((w[0] - point).dot(&normal), (w[1] - point).dot(&normal));
        let length = (w[1] - w[0]).norm();
        if (a <= 0.0) != (b <= 0.0) {
            return Some(before + length * (a / (a - b)));
        }
        before += length;
    }
    None
}

/// `n` points with equal chords on the first `length` of a polyline; on all of it if it is shorter.
pub fn cut(line: &[Vec3], length: f64, n: usize) -> Vec<Vec3> {
    let mut kept: Vec<Vec3> = line.first().copied().into_iter().collect();
    let mut left = length.max(0.0);
    for w in line.windows(2) {
        let side = (w[1] - w[0]).norm();
        if side >= left {
            if side > 0.0 {
                kept.push(w[0] + (w[1] - w[0]) * (left / side));
            }
            break;
        }
        left -= side;
        kept.push(w[1]);
    }
    resample(&kept, n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::{Topology, shapes::cube_sphere};

    #[test]
    fn lines_are_cut_where_they_leave_and_where_they_enter() {
        let mesh = cube_sphere(24, 2.0);
        let bvh = Bvh::build(&mesh.position, &mesh.triangle, &Topology::new(&mesh));
        let line: Vec<Vec3> = (0..31).map(|k| Vec3::new(0.2 * f64::from(k) - 0.5, 0.1, 0.05)).collect();
        let leaves = (4.0f64 - 0.01 - 0.0025).sqrt() + 0.5;
        assert!((length_to(&line, &bvh).expect("it leaves") - leaves).abs() < 0.01);
        let outside: Vec<Vec3> = line.iter().map(|p| p - Vec3::x() * 4.0).collect();
        assert!((length_to(&outside, &bvh).expect("it enters") - (4.5 - (leaves - 0.5))).abs() < 0.01);
        let beside: Vec<Vec3> = line.iter().map(|p| p + Vec3::y() * 3.0).collect();
        assert_eq!(length_to(&beside, &bvh), None);
        assert!((length_to_plane(&line, Vec3::x() * 1.25, -Vec3::x()).expect("it meets it") - 1.75).abs() < 1e-12);
        assert_eq!(length_to_plane(&line, Vec3::x() * 7.0, Vec3::x()), None);
        let short = cut(&line, 1.75, 8);
        assert!(short.len() == 8 && (short[7] - Vec3::new(1.25, 0.1, 0.05)).norm() < 1e-9);
        assert!(cut(&line, 99.0, 3)[2] == line[30] && cut(&line, 0.0, 3) == vec![line[0]; 3]);
    }
}
