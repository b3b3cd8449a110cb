//! Hair of one side of a plane, mirrored onto the other.

use super::{CombCounts, Hair, slerp};
use crate::control::{ControlHairs, to_local, to_world, vec3};
use crate::near::Near;
use pelage_geom::{Frame, Mesh, Vec3};

/// Roots within this part of the mesh's diagonal are at one place, and lie on the plane. At 0, hair of a mesh with mirrored
/// vertices would be a blend because of rounding; at 1e-3, neighbours of a dense groom would count as one.
const SAME_PLACE: f64 = 1e-6;

/// Hairs in front of a plane, as they were before any was mirrored.
pub(super) struct Front {
    point: Vec3,
    /// Unit normal of the plane.
    normal: Vec3,
    /// Distance within which roots are at one place, scene units.
    same: f64,
    hair: Vec<Source>,
}

struct Source {
    /// Root, scene space.
    at: Vec3,
    side: i8,
    /// Segments, scene space.
    segment: Vec<Vec3>,
    /// Length it was cut to; infinite if it never was.
    cut: f64,
}

/// Collects the hairs in front; `None` for a plane without a normal or if there are none.
pub(super) fn front(point: Vec3, normal: Vec3, mesh: &Mesh, frames: &[Frame], hairs: &ControlHairs) -> Option<Front> {
    let normal = normal.try_normalize(0.0)?;
    let (low, high) = mesh.bounds();
    let same = SAME_PLACE * (Vec3::from(high) - Vec3::from(low)).norm();
    let source = |(h, f): (usize, &Frame)| {
        let segment = hairs.hair(h).windows(2).map(|w| to_world(f, vec3(w[1]) - vec3(w[0]))).collect();
        Source { at: f.origin, side: hairs.side[h], segment, cut: f64::from(hairs.cut[h]) }
    };
    let in_front = |(_, f): &(usize, &Frame)| (f.origin - point).dot(&normal) >= -same;
    let hair: Vec<Source> = frames.iter().enumerate().filter(in_front).map(source).collect();
    (!hair.is_empty()).then_some(Front { point, normal, same, hair })
}

impl Front {
    fn reflect(&self, v: Vec3) -> Vec3 {
        v - self.normal * (2.0 * v.dot(&self.normal))
    }

    /// Turns a hair behind the plane the part `weight` of the way to what stands in front.
    pub(super) fn apply(&self, weight: f64, hair: Hair<'_>) -> CombCounts {
        let Hair { frame, side, local, cut, .. } = hair;
        let from_plane = frame.origin - self.point;
        let a = weight.clamp(0.0, 1.0);
        if from_plane.dot(&self.normal) >= -self.same || a == 0.0 {
            return CombCounts::default();
        }
        let source = &self.hair;
        // A reflection swaps left and right of a parting.
        let accept = |i: usize| side == 0 || source[i].side == 0 || source[i].side == -side;
        let at = self.point + self.reflect(from_plane);
        let Some(near) = Near::find(source.iter().map(|s| s.at), at, accept) else { return CombCounts::default() };
        let near = if near.squared <= self.same * self.same { near.only_nearest() } else { near };

        let own: Vec<Vec3> = local.windows(2).map(|w| vec3(w[1]) - vec3(w[0])).collect();
        let mut end = vec3(local[0]);
        for (k, (v, out)) in own.iter().zip(&mut local[1..]).enumerate() {
            let unit = |i: usize| source[i].segment[k].try_normalize(0.0).unwrap_or_default();
            let target = to_local(frame, self.reflect(near.direction(unit)));
            let length = near.mean(|i| source[i].segment[k].norm());
            end += match v.try_normalize(0.0) {
                Some(d) if a < 1.0 => slerp(d, target, a) * (v.norm() + a * (length - v.norm())),
                _ => target * (a * length),
            };
            *out = [end.x as f32, end.y as f32, end.z as f32];
        }

        // One that never was cut counts with its length, as in blends of drawn hair; nothing is cut if none was.
        let whole = |segment: &[Vec3]| segment.iter().map(|v| v.norm()).sum::<f64>();
        let left = f64::from(*cut);
        let uncut = near.all(|i| source[i].cut.is_infinite());
        if !(uncut && (a == 1.0 || left.is_infinite())) {
            let target = near.mean(|i| source[i].cut.min(whole(&source[i].segment)));
            let left = left.min(whole(&own));
            *cut = (left + a * (target - left)) as f32;
        } else {
            *cut = f32::INFINITY;
        }
        CombCounts { combed: 1, unpainted: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comb::tests::op;
    use crate::comb::{CombKind, CombOp, comb};
    use crate::test_skin::TestSkin;
    use pelage_geom::SurfacePoint;
    use pelage_geom::rng::uniform;

    const POINTS: usize = 5;

    /// Hairs of random shapes and lengths on vertices of a skin that z -> -z leaves as it is; and the vertices.
    fn on_vertices() -> (TestSkin, ControlHairs, Vec<usize>) {
        let s = TestSkin::new(24, 12, 0.5);
        let mut hairs = ControlHairs { points: POINTS, ..ControlHairs::default() };
        let vertices: Vec<usize> = (1..s.mesh.position.len() - 1).collect();
        for &v in &vertices {
            let triangle = s.mesh.triangle.iter().position(|t| t.contains(&(v as u32))).unwrap();
            let corner = s.mesh.triangle[triangle].iter().position(|&c| c == v as u32).unwrap();
            let bary = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][corner];
            let mut at = vec![Vec3::zeros()];
            for k in 1..POINTS {
                let r = |c| uniform(2, (v * POINTS + k) as u64, 9, c);
                at.push(at[k - 1] + Vec3::new(0.2 + r(0), r(1) - 0.5, r(2) - 0.5));
            }
            hairs.push(SurfacePoint { triangle: triangle as u32, bary }, &at);
        }
        (s, hairs, vertices)
    }

    fn mirror() -> CombKind<'static> {
        CombKind::Mirror { point: Vec3::new(3.0, -2.0, 0.0), normal: Vec3::z() * 2.5 }
    }

    /// Points of a hair minus its root, scene space.
    fn shape(s: &TestSkin, hairs: &ControlHairs, h: usize) -> Vec<Vec3> {
        let frame = s.skin().frame(&hairs.root[h]);
        hairs.hair(h).iter().map(|&p| to_world(&frame, vec3(p))).collect()
    }

    fn flip(v: Vec3) -> Vec3 {
        Vec3::new(v.x, v.y, -v.z)
    }

    #[test]
    fn symmetric_roots_get_the_exact_reflection_once_and_for_all() {
        let (s, mut hairs, vertices) = on_vertices();
        let at: Vec<Vec3> = vertices.iter().map(|&v| s.mesh.position[v].into()).collect();
        hairs.cut.iter_mut().enumerate().filter(|(h, _)| h % 3 == 0).for_each(|(h, c)| *c = 1.0 + h as f32);
        let before = hairs.clone();
        let counts = comb(&s.skin(), &[], &[op(mirror())], &mut hairs);
        let mut behind = 0;
        for h in 0..hairs.len() {
            if at[h].z > -1e-9 {
                assert_eq!((hairs.hair(h), hairs.cut[h]), (before.hair(h), before.cut[h]));
                continue;
            }
            behind += 1;
            let twin = (0..hairs.len()).find(|&o| (at[o] - flip(at[h])).norm() < 1e-9).expect("the skin is symmetric");
            for (a, b) in shape(&s, &hairs, h).iter().zip(shape(&s, &before, twin)) {
                assert!((a - flip(b)).norm() < 1e-6, "{a} {b}");
            }
            // No more than its length is left of it, if it was cut.
            let left = before.cut[twin];
            let expected = if left.is_infinite() { left } else { left.min(before.length(twin) as f32) };
            assert_eq!(hairs.cut[h], expected);
        }
        assert_eq!((counts[0].combed, behind), (behind, 11 * 11));
        let once = hairs.clone();
        comb(&s.skin(), &[], &[op(mirror())], &mut hairs);
        assert_eq!(once, hairs);
    }

    #[test]
    fn between_roots_the_near_ones_are_blended() {
        let (s, full, vertices) = on_vertices();
        // In front only every third hair; all of one direction, their lengths of two kinds.
        let d = Vec3::new(0.3, 0.8, 0.5).normalize();
        let mut hairs = ControlHairs { points: POINTS, ..ControlHairs::default() };
        for (h, &v) in vertices.iter().enumerate() {
            let front = s.mesh.position[v][2] > 1e-9;
            if front && h % 3 != 0 {
                continue;
            }
            let frame = s.skin().frame(&full.root[h]);
            let step = if h % 2 == 0 { 1.0 } else { 2.0 };
            let line: Vec<Vec3> = (0..POINTS).map(|k| to_local(&frame, d * (k as f64 * step))).collect();
            hairs.push(full.root[h], &line);
        }
        let before = hairs.clone();
        comb(&s.skin(), &[], &[op(mirror())], &mut hairs);
        let mut between = 0;
        for h in (0..hairs.len()).filter(|&h| s.skin().frame(&hairs.root[h]).origin.z < -1e-9) {
            let line = shape(&s, &hairs, h);
            assert!(line.windows(2).all(|w| ((w[1] - w[0]).normalize() - flip(d)).norm() < 1e-5));
            let length = hairs.length(h);
            assert!((4.0 - 1e-5..8.0 + 1e-5).contains(&length));
            between += usize::from((4.1..7.9).contains(&length));
        }
        assert!(between > 10, "{between}");
        // Half the weight is half the turn, and the mean of the lengths.
        let mut half = before.clone();
        comb(&s.skin(), &[], &[CombOp { weight: 0.5.into(), ..op(mirror()) }], &mut half);
        for h in (0..hairs.len()).filter(|&h| half.hair(h) != before.hair(h)) {
            assert!((half.length(h) - 0.5 * (hairs.length(h) + before.length(h))).abs() < 1e-5);
            let line = shape(&s, &half, h);
            let middle = (d + flip(d)).normalize();
            assert!(line.windows(2).all(|w| ((w[1] - w[0]).normalize() - middle).norm() < 1e-5));
        }
        // Nothing in front, or no plane: nothing is done.
        for (point, normal) in [(Vec3::z() * 100.0, Vec3::z()), (Vec3::zeros(), Vec3::zeros())] {
            let mut none = before.clone();
            let counts = comb(&s.skin(), &[], &[op(CombKind::Mirror { point, normal })], &mut none);
            assert_eq!((counts[0].combed, &none), (0, &before));
        }
    }

    #[test]
    fn a_side_of_a_parting_takes_the_mirrored_side() {
        let (s, mut hairs, vertices) = on_vertices();
        let z = |h: usize| s.mesh.position[vertices[h]][2];
        let behind = (0..hairs.len()).find(|&h| z(h) < -2.0).unwrap();
        let at = flip(s.mesh.position[vertices[behind]].into());
        let twin = (0..hairs.len()).find(|&h| (Vec3::from(s.mesh.position[vertices[h]]) - at).norm() < 1e-9).unwrap();
        // A second hair at the twin's root, as on a parting.
        let other: Vec<Vec3> = hairs.hair(twin).iter().map(|p| vec3([p[0], -p[1], p[2]]) * 0.5).collect();
        hairs.push(hairs.root[twin], &other);
        let last = hairs.len() - 1;
        (hairs.side[twin], hairs.side[last]) = (1, -1);
        for (side, from) in [(1, last), (-1, twin)] {
            let mut out = hairs.clone();
            out.side[behind] = side;
            comb(&s.skin(), &[], &[op(mirror())], &mut out);
            for (a, b) in shape(&s, &out, behind).iter().zip(shape(&s, &hairs, from)) {
                assert!((a - flip(b)).norm() < 1e-6, "{side}");
            }
        }
    }
}
