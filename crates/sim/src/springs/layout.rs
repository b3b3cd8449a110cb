//! Where a strand's particles are: the hair's points, and extra particles off its axis (section 3.2).

use crate::Vec3;
use crate::settings::End;
use pelage_geom::NONE;

/// Particles of a strand in the order of its matrix.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layout {
    /// Positions, metres.
    pub position: Vec<Vec3>,
    /// Point of the hair that a particle is; [`NONE`] for extra particles and ghosts. Only these collide, feel the air
    /// and are seen.
    pub point: Vec<u32>,
    /// True for extra particles, off the axis.
    pub extra: Vec<bool>,
    /// True for particles whose position is prescribed.
    pub held: Vec<bool>,
    /// Particles before the hair's first point: the ghost segment of a clamped root.
    pub ghosts: usize,
}

/// Distance of the extra particles from the axis over the segment's length that makes triangles equilateral, as the
/// paper has them.
pub const EQUILATERAL: f64 = 0.866_025_403_784_438_6;

/// Segments whose directions differ by less than this sine are colinear in [`only_straight`]. At 0.02 the bending
/// springs of a triangle that is left unperturbed keep 1e-4 of their stiffness; below 1e-3 they are as good as absent,
/// above 0.1 most curls would be perturbed too.
pub const COLINEAR: f64 = 0.02;

/// Particles with an extra one in every segment, `height` segment lengths off its middle.
///
/// The azimuth steps by 90 degrees from segment to segment in a rotation-minimising frame: the step that makes bending
/// isotropic. `None` with fewer than two points or a segment shorter than 1e-6 of the mean.
pub fn zigzag(points: &[Vec3], ends: [End; 2], height: f64) -> Option<Layout> {
    build(points, ends, height, |_| true)
}

/// Particles as the paper has them: only segments colinear with a neighbour are divided and their middles perturbed,
/// forming equilateral triangles; consecutive ones are rotated about the axis by 90 degrees.
///
/// Refusals as in [`zigzag`].
pub fn only_straight(points: &[Vec3], ends: [End; 2]) -> Option<Layout> {
    let axis = extended(points, ends)?;
    let colinear = |a: usize| {
        let (u, v) = (axis[a] - axis[a - 1], axis[a + 1] - axis[a]);
        u.cross(&v).norm() < COLINEAR * u.norm() * v.norm()
    };
    build(points, ends, EQUILATERAL, |s| (s > 0 && colinear(s)) || (s + 2 < axis.len() && colinear(s + 1)))
}

/// The points with the ghosts of clamped ends.
fn extended(points: &[Vec3], ends: [End; 2]) -> Option<Vec<Vec3>> {
    let n = points.len();
    if n < 2 {
        return None;
    }
    let mean = points.windows(2).map(|p| (p[1] - p[0]).norm()).sum::<f64>() / (n - 1) as f64;
    if !points.windows(2).all(|p| (p[1] - p[0]).norm() > 1e-6 * mean) {
        return None;
    }
    let mut axis = Vec::with_capacity(n + 2);
    if ends[0] == End::Clamped {
        axis.push(points[0] * 2.0 - points[1]);
    }
    axis.extend_from_slice(points);
    if ends[1] == End::Clamped {
        axis.push(points[n - 1] * 2.0 - points[n - 2]);
    }
    Some(axis)
}

fn build(points: &[Vec3], ends: [End; 2], height: f64, perturbed: impl Fn(usize) -> bool) -> Option<Layout> {
    let axis = extended(points, ends)?;
    let first = usize::from(ends[0] == End::Clamped);
    let last = first + points.len() - 1;
    let mut layout = Layout::default();
    let mut tangent = (axis[1] - axis[0]).normalize();
    let mut normal = perpendicular(tangent);
    let mut quarter = 0;
    for a in 0..axis.len() {
        let ghost = a < first || a > last;
        let held = ghost || (a == first && ends[0] != End::Free) || (a == last && ends[1] != End::Free);
        layout.push(axis[a], if ghost { NONE } else { (a - first) as u32 }, false, held);
        if a + 1 == axis.len() {
            break;
        }
        let segment = axis[a + 1] - axis[a];
        let next = segment.normalize();
        normal = transport(normal, tangent, next);
        tangent = next;
        if perturbed(a) {
            let side = match quarter % 4 {
                0 => normal,
                1 => tangent.cross(&normal),
                2 => -normal,
                _ => -tangent.cross(&normal),
            };
            quarter += 1;
            let off = axis[a] + segment * 0.5 + side * (height * segment.norm());
            layout.push(off, NONE, true, a < first || a >= last);
        }
    }
    layout.ghosts = layout.point.iter().position(|&p| p == 0).unwrap_or(0);
    Some(layout)
}

impl Layout {
    fn push(&mut self, position: Vec3, point: u32, extra: bool, held: bool) {
        self.position.push(position);
        self.point.push(point);
        self.extra.push(extra);
        self.held.push(held);
    }
}

/// A unit vector across `t`.
pub(crate) fn perpendicular(t: Vec3) -> Vec3 {
    let a = t.abs();
    let e = if a.x <= a.y && a.x <= a.z {
        Vec3::x()
    } else if a.y <= a.z {
        Vec3::y()
    } else {
        Vec3::z()
    };
    t.cross(&e).normalize()
}

/// Turns `v` by the smallest rotation from unit vector `a` to unit vector `b`; made orthogonal to `b`.
fn transport(v: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let c = a.dot(&b);
    let axis = a.cross(&b);
    // Rodrigues' formula with (1 - cos) / sin^2 = 1 / (1 + cos); a reversal leaves v as it is.
    let turned = if c > -1.0 + 1e-12 { v * c + axis.cross(&v) + axis * (axis.dot(&v) / (1.0 + c)) } else { v };
    let across = turned - b * b.dot(&turned);
    if across.norm() > 1e-6 { across.normalize() } else { perpendicular(b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn helix(n: usize) -> Vec<Vec3> {
        (0..n)
            .map(|i| {
                let a = 0.4 * i as f64;
                Vec3::new(libm::cos(a), libm::sin(a), 0.2 * a) * 0.01
            })
            .collect()
    }

    #[test]
    fn triangles_are_equilateral_and_turn_by_quarters() {
        let l = zigzag(&helix(12), [End::Clamped, End::Free], EQUILATERAL).unwrap();
        assert_eq!(l.position.len(), 2 * 13 - 1);
        assert_eq!(l.ghosts, 2);
        assert_eq!(l.held.iter().filter(|&&h| h).count(), 3);
        let q: Vec<usize> = (0..l.extra.len()).filter(|&i| l.extra[i]).collect();
        for &i in &q {
            let [a, b, c] = [l.position[i - 1], l.position[i], l.position[i + 1]];
            let length = (c - a).norm();
            assert!(((b - a).norm() - length).abs() < 1e-15 && ((b - c).norm() - length).abs() < 1e-15);
        }
        // A straight hair: neighbours are at right angles.
        let line: Vec<Vec3> = (0..6).map(|i| Vec3::new(0.0, -0.01 * i as f64, 0.0)).collect();
        let l = zigzag(&line, [End::Free, End::Clamped], EQUILATERAL).unwrap();
        let side = |i: usize| l.position[i] - (l.position[i - 1] + l.position[i + 1]) * 0.5;
        for i in (1..9).step_by(2) {
            assert!(side(i).dot(&side(i + 2)).abs() < 1e-18);
        }
        assert_eq!(l.held[8..], [false, false, true, true, true]);
    }

    #[test]
    fn only_straight_segments_are_perturbed_in_the_paper() {
        let l = only_straight(&helix(12), [End::Free, End::Free]).unwrap();
        assert_eq!(l.extra.iter().filter(|&&e| e).count(), 0);
        let line: Vec<Vec3> = (0..6).map(|i| Vec3::new(0.0, -0.01 * i as f64, 0.0)).collect();
        let l = only_straight(&line, [End::Free, End::Free]).unwrap();
        assert_eq!(l.extra.iter().filter(|&&e| e).count(), 5);
        // Straight, then a corner: the last segment stays whole.
        let mut bent = line[..4].to_vec();
        bent.push(Vec3::new(0.01, -0.03, 0.0));
        let l = only_straight(&bent, [End::Free, End::Free]).unwrap();
        assert_eq!(l.extra, [false, true, false, true, false, true, false, false]);
    }

    #[test]
    fn points_without_a_segment_are_refused() {
        let one = [Vec3::zeros()];
        assert!(zigzag(&one, [End::Free; 2], EQUILATERAL).is_none());
        assert!(zigzag(&[one[0], one[0]], [End::Free; 2], EQUILATERAL).is_none());
        assert!(zigzag(&[one[0], Vec3::x(), Vec3::x()], [End::Free; 2], EQUILATERAL).is_none());
        assert!(zigzag(&[one[0], Vec3::new(f64::NAN, 0.0, 0.0)], [End::Free; 2], EQUILATERAL).is_none());
    }
}
