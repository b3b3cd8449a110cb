//! A chain over a control hair, moved by forward and inverse kinematics, and the neighbours that go along.
//!
//! The inverse kinematics are damped least squares (Wampler 1986) over the directions of the segments: each step turns them
//! all by the least amount, in the sum of squares, that brings the tip to its target to first order. That gets there also
//! where the hair is nearly straight, at which methods that go from joint to joint slow down: pulled to 99.9 % of their
//! length, chains of 5 to 30 segments are still up to 1e-3 to 5e-3 of it off after 200 passes of FABRIK.

use super::{CombCounts, Hair, Handle, arc, influence, rebuild, rotate};
use crate::control::{ControlHairs, to_local, vec3};
use nalgebra::Matrix3;
use pelage_geom::{Frame, Vec3};

/// Steps of inverse kinematics at most. Random chains of 5 to 30 segments take about 30, of two or three up to 100 at the
/// inner and outer rim of their reach.
const STEPS: usize = 200;

/// Largest turn of a segment in one step, radians. Without a limit two segments overshoot for ever; at 0.1 two segments do
/// not get to where they go within the steps. From 0.5 to 2 all do.
const LARGEST_TURN: f64 = 0.5;

/// The tip is at its target within this part of the hair's length.
const TOLERANCE: f64 = 1e-9;

/// A hair whose segments are within this angle of one line (radians, as a sine) is bowed to an arc before the steps. On a
/// straight line no small turn shortens the way to the tip; much below, rounding of the points would choose the shape;
/// above 0.1 a hair that is visibly bent would lose its bend.
const STRAIGHT: f64 = 1e-3;

/// What the handle of a chain did.
pub(super) struct Motion {
    handle: usize,
    /// Root of the handle, scene space.
    at: Vec3,
    /// Turn of each segment in the root frame: axis and angle in radians.
    turn: Vec<Option<(Vec3, f64)>>,
}

/// The hair that a handle names.
pub(super) fn find(handle: &Handle, frames: &[Frame], hairs: &ControlHairs) -> Option<usize> {
    match *handle {
        Handle::Single(number) => hairs.placed_alone(number),
        Handle::Nearest(point) => {
            let distance = |h: usize| (frames[h].origin - point).norm_squared();
            (0..frames.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        }
    }
}

/// Moves the handle: `local` are its points in the frame of its root, the rest as in [`super::CombKind::Chain`].
pub(super) fn motion(
    handle: usize,
    frame: &Frame,
    local: &[[f32; 3]],
    turn: &[(usize, Vec3)],
    reach: Option<Vec3>,
) -> Motion {
    let segment: Vec<Vec3> = local.windows(2).map(|w| vec3(w[1]) - vec3(w[0])).collect();
    let length: Vec<f64> = segment.iter().map(|v| v.norm()).collect();
    let before: Vec<Vec3> = segment.iter().map(|v| v.try_normalize(0.0).unwrap_or_else(Vec3::x)).collect();
    let mut after = before.clone();
    for (joint, vector) in turn {
        let angle = vector.norm().to_radians();
        if let Some(axis) = vector.try_normalize(0.0) {
            after.iter_mut().skip(*joint).for_each(|d| *d = rotate(*d, axis, angle).normalize());
        }
    }
    if let Some(point) = reach {
        bring_tip(&length, &mut after, to_local(frame, point - frame.origin));
    }
    let mut turn: Vec<Option<(Vec3, f64)>> = before.iter().zip(&after).map(|(a, b)| arc(*a, *b)).collect();
    // A segment without length goes along with the one before.
    for k in (1..turn.len()).filter(|&k| length[k] == 0.0) {
        turn[k] = turn[k - 1];
    }
    Motion { handle, at: frame.origin, turn }
}

impl Motion {
    /// Moves one hair along, within a radius.
    pub(super) fn apply(&self, weight: f64, radius: f64, falloff: f64, hair: Hair<'_>) -> CombCounts {
        let distance = (hair.frame.origin - self.at).norm();
        let influence = if hair.index == self.handle { 1.0 } else { influence(distance, radius, falloff) };
        let a = (weight * influence).clamp(0.0, 1.0);
        if a == 0.0 || self.turn.iter().all(Option::is_none) {
            return CombCounts::default();
        }
        let mut turn = self.turn.iter();
        rebuild(hair.local, |d, _| match turn.next() {
            Some(Some((axis, angle))) => rotate(d, *axis, a * angle),
            _ => d,
        });
        CombCounts { combed: 1, unpainted: 0 }
    }
}

/// Turns segments of given lengths so that their sum is `target`, or as near to it as they can come.
fn bring_tip(length: &[f64], direction: &mut [Vec3], target: Vec3) {
    let whole: f64 = length.iter().sum();
    let longest = length.iter().copied().fold(0.0, f64::max);
    let tip = |direction: &[Vec3]| direction.iter().zip(length).map(|(d, l)| d * *l).sum::<Vec3>();
    if (target - tip(direction)).norm() <= TOLERANCE * whole {
        return;
    }
    let distance = target.norm();
    let ahead = target.try_normalize(1e-12 * whole).or_else(|| tip(direction).try_normalize(1e-12 * whole));
    let ahead = ahead.unwrap_or(direction[0]);
    if distance >= whole {
        direction.fill(ahead);
        return;
    }
    if distance <= 2.0 * longest - whole {
        // The others together are shorter than the longest: straight back from where it ends is the nearest.
        let kept = length.iter().position(|&l| l == longest);
        direction.iter_mut().enumerate().for_each(|(k, d)| *d = if Some(k) == kept { ahead } else { -ahead });
        return;
    }
    let first = direction[length.iter().position(|&l| l > 0.0).unwrap_or(0)];
    if direction.iter().zip(length).all(|(d, l)| *l == 0.0 || d.cross(&first).norm() < STRAIGHT) {
        bow(length, direction, first, ahead, distance / whole);
    }
    for _ in 0..STEPS {
        let error = target - tip(direction);
        if error.norm() <= TOLERANCE * whole {
            return;
        }
        // Tip over turns: J J^T is the sum of l^2 (1 - d d^T). The damping only keeps it from being singular.
        let mut matrix = Matrix3::identity() * (1e-12 * whole * whole);
        for (d, l) in direction.iter().zip(length) {
            matrix += (Matrix3::identity() - d * d.transpose()) * (l * l);
        }
        let Some(solved) = matrix.cholesky().map(|m| m.solve(&error)) else { return };
        let step = |d: &Vec3, l: f64| (solved - d * d.dot(&solved)) * l;
        let largest = direction.iter().zip(length).map(|(d, l)| step(d, *l).norm()).fold(0.0, f64::max);
        let part = if largest > LARGEST_TURN { LARGEST_TURN / largest } else { 1.0 };
        for (d, l) in direction.iter_mut().zip(length) {
            *d = (*d + step(d, *l) * part).normalize();
        }
    }
}

/// Gives a straight hair the shape of the circular arc whose chord is `part` of its length and lies along `ahead`. It bows
/// toward `from`, where the hair pointed; along `ahead` itself over y (in the root frame dU), or x.
fn bow(length: &[f64], direction: &mut [Vec3], from: Vec3, ahead: Vec3, part: f64) {
    let across = |v: Vec3| (v - ahead * ahead.dot(&v)).try_normalize(STRAIGHT);
    let side = across(from).or_else(|| across(Vec3::y())).or_else(|| across(Vec3::x())).unwrap_or_default();
    // Half the angle of the arc: sin(a) / a = part.
    let (mut low, mut high) = (0.0, std::f64::consts::PI);
    for _ in 0..60 {
        let a: f64 = 0.5 * (low + high);
        if libm::sin(a) > part * a { low = a } else { high = a }
    }
    let whole: f64 = length.iter().sum();
    let mut before = 0.0;
    for (d, l) in direction.iter_mut().zip(length) {
        let middle = (before + 0.5 * l) / whole;
        *d = rotate(ahead, ahead.cross(&side), low * (1.0 - 2.0 * middle));
        before += l;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comb::tests::{groomed, op};
    use crate::comb::{CombKind, CombOp, comb, world_points};
    use crate::control::{Skin, to_world};
    use nalgebra::Rotation3;
    use pelage_geom::rng::uniform;

    fn random(seed: u64, i: u64) -> Vec3 {
        Vec3::from_fn(|k, _| uniform(seed, i, 7, k as u64) - 0.5)
    }

    /// Directions around x that differ by about `bend` radians, and their lengths.
    fn random_chain(seed: u64, n: usize, bend: f64) -> (Vec<f64>, Vec<Vec3>) {
        let length = (0..n as u64).map(|k| 0.5 + uniform(seed, k, 8, 0)).collect();
        (length, (0..n as u64).map(|k| (Vec3::x() + random(seed, k) * bend).normalize()).collect())
    }

    fn tip(length: &[f64], direction: &[Vec3]) -> Vec3 {
        direction.iter().zip(length).map(|(d, l)| d * *l).sum()
    }

    fn chain(handle: Handle, turn: Vec<(usize, Vec3)>, reach: Option<Vec3>, radius: f64) -> CombKind<'static> {
        CombKind::Chain { handle, turn, reach, radius: radius.into(), falloff: 0.5.into() }
    }

    /// All hairs with one bent shape.
    fn bent(hairs: &mut ControlHairs) {
        let (length, direction) = random_chain(5, hairs.points - 1, 0.8);
        for h in 0..hairs.len() {
            let mut at = Vec3::zeros();
            for k in 1..hairs.points {
                at += direction[k - 1] * length[k - 1];
                hairs.local[h * hairs.points + k] = [at.x as f32, at.y as f32, at.z as f32];
            }
        }
    }

    fn lengths_stay(before: &ControlHairs, after: &ControlHairs) {
        for h in 0..before.len() {
            for (a, b) in before.hair(h).windows(2).zip(after.hair(h).windows(2)) {
                let length = |w: &[[f32; 3]]| (vec3(w[1]) - vec3(w[0])).norm();
                assert!((length(a) - length(b)).abs() < 1e-6 * before.length(h), "{} {}", length(a), length(b));
            }
        }
    }

    fn tip_in_space(skin: &Skin, hairs: &ControlHairs, h: usize) -> Vec3 {
        *world_points(&skin.frame(&hairs.root[h]), hairs.hair(h)).last().unwrap()
    }

    #[test]
    fn turns_of_joints_are_products_of_rotations() {
        let (s, mut hairs) = groomed();
        bent(&mut hairs);
        let before = hairs.clone();
        let turn = vec![
            (2, Vec3::new(20.0, -70.0, 5.0)),
            (0, Vec3::new(0.0, 30.0, 60.0)),
            (4, Vec3::z() * -120.0),
            (9, Vec3::x()),
        ];
        let at = s.skin().frame(&hairs.root[30]).origin;
        comb(&s.skin(), &[], &[op(chain(Handle::Nearest(at), turn.clone(), None, 0.0))], &mut hairs);
        let rotation = |v: Vec3| Rotation3::new(v.map(f64::to_radians));
        let mut expected = Vec3::zeros();
        for k in 0..5 {
            let product = turn.iter().filter(|t| t.0 <= k).fold(Rotation3::identity(), |r, t| rotation(t.1) * r);
            expected += product * (vec3(before.hair(30)[k + 1]) - vec3(before.hair(30)[k]));
            assert!((vec3(hairs.hair(30)[k + 1]) - expected).norm() < 2e-6, "{k}");
        }
        lengths_stay(&before, &hairs);
        assert!((0..hairs.len()).all(|h| h == 30 || hairs.hair(h) == before.hair(h)), "the handle alone");
    }

    #[test]
    fn the_tip_gets_to_all_that_is_in_reach() {
        for n in [2, 3, 5, 11, 30] {
            for (i, bend) in [0.0, 1e-4, 1.1e-3, 1e-2, 0.3, 2.0].iter().cycle().take(36).enumerate() {
                let seed = (100 * n + i) as u64;
                let (length, start) = random_chain(seed, n, *bend);
                let whole: f64 = length.iter().sum();
                let hole = (2.0 * length.iter().copied().fold(0.0, f64::max) - whole).max(0.0);
                for part in [0.0, 1e-6, 0.01, 0.3, 0.7, 0.99, 0.999_999, 1.0 - 1e-9] {
                    // Also along the hair itself.
                    let ahead = [random(seed, 99).normalize(), Vec3::x(), -Vec3::x()][i / 6 % 3];
                    let target = ahead * (hole + part * (whole - hole));
                    let mut direction = start.clone();
                    bring_tip(&length, &mut direction, target);
                    let error = (tip(&length, &direction) - target).norm() / whole;
                    assert!(error < 2e-9, "{n} {bend} {part} {i}: {error}");
                    assert!(direction.iter().all(|d| (d.norm() - 1.0).abs() < 1e-12));
                }
            }
        }
    }

    #[test]
    fn what_is_out_of_reach_is_pointed_at() {
        let (length, start) = random_chain(3, 6, 0.8);
        let ahead = random(4, 0).normalize();
        let mut direction = start.clone();
        bring_tip(&length, &mut direction, ahead * 50.0);
        assert!(direction.iter().all(|d| (d - ahead).norm() < 1e-12));
        // A segment of 5 and five of about 1 leave a hole, in which the nearest is toward the target.
        let mut length = length;
        length[2] = 10.0;
        let hole = 20.0 - length.iter().sum::<f64>();
        for distance in [0.5 * hole, 1e-3 * hole] {
            let mut direction = start.clone();
            bring_tip(&length, &mut direction, ahead * distance);
            assert!((tip(&length, &direction) - ahead * hole).norm() < 1e-12);
        }
        let mut direction = start.clone();
        bring_tip(&length, &mut direction, Vec3::zeros());
        assert!((tip(&length, &direction).norm() - hole).abs() < 1e-12);
        // One segment only points.
        let mut one = [Vec3::x()];
        bring_tip(&[2.0], &mut one, Vec3::y());
        assert_eq!(one[0], Vec3::y());
    }

    #[test]
    fn a_straight_hair_bows_to_an_arc() {
        let mut direction = vec![Vec3::x(); 40];
        bring_tip(&[0.025; 40], &mut direction, Vec3::x() * (2.0 / std::f64::consts::PI));
        // A half circle: the first segment leans toward y, the last away, each by nearly 90 degrees; equal turns between.
        assert!(direction[0].y > 0.99 && direction[39].y < -0.99);
        let turn = |w: &[Vec3]| libm::acos(w[0].dot(&w[1]));
        assert!(direction.windows(2).all(|w| (turn(w) - std::f64::consts::PI / 40.0).abs() < 1e-3));
    }

    #[test]
    fn the_handle_reaches_a_point_of_the_scene_after_its_turns() {
        let (s, mut hairs) = groomed();
        hairs.single[40] = 7;
        let before = hairs.clone();
        let frame = s.skin().frame(&hairs.root[40]);
        let target = frame.origin + to_world(&frame, Vec3::new(1.2, -0.9, 1.1));
        let turn = vec![(0, Vec3::y() * 30.0)];
        let reach = |turn| chain(Handle::Single(7), turn, Some(target), 10.0);
        let counts = comb(&s.skin(), &[], &[op(reach(turn))], &mut hairs);
        assert!(counts[0].combed > 1);
        assert!((tip_in_space(&s.skin(), &hairs, 40) - target).norm() < 1e-6);
        lengths_stay(&before, &hairs);
        let mut other = before.clone();
        comb(&s.skin(), &[], &[op(reach(Vec::new()))], &mut other);
        assert_ne!(other.hair(40), hairs.hair(40), "the turns are where it starts from");
        let mut none = before.clone();
        let counts = comb(&s.skin(), &[], &[op(chain(Handle::Single(8), vec![(0, Vec3::y())], None, 5.0))], &mut none);
        assert_eq!((counts[0].combed, none), (0, before));
    }

    #[test]
    fn no_turn_and_its_own_tip_change_no_byte() {
        let (s, mut hairs) = groomed();
        bent(&mut hairs);
        let before = hairs.clone();
        for h in [0, 17, 44] {
            let reach = Some(tip_in_space(&s.skin(), &hairs, h));
            let handle = Handle::Nearest(s.skin().frame(&hairs.root[h]).origin);
            let none = chain(handle, vec![(0, Vec3::zeros()), (3, Vec3::x() * 0.0)], reach, f64::INFINITY);
            let counts = comb(&s.skin(), &[], &[op(none)], &mut hairs);
            assert_eq!((counts[0].combed, &hairs), (0, &before));
        }
    }

    #[test]
    fn congruent_neighbours_move_alike_and_far_ones_not_at_all() {
        let (s, mut hairs) = groomed();
        bent(&mut hairs);
        let before = hairs.clone();
        let skin = s.skin();
        let at: Vec<Vec3> = hairs.root.iter().map(|p| skin.frame(p).origin).collect();
        let turn = vec![(0, Vec3::new(10.0, 40.0, -20.0)), (3, Vec3::z() * 70.0)];
        let kind = || chain(Handle::Nearest(at[30]), turn.clone(), Some(at[30] + Vec3::new(1.0, 1.5, 0.5)), 14.0);
        let counts = comb(&skin, &[], &[op(kind())], &mut hairs);
        let (mut full, mut faded, mut far) = (0, 0, 0);
        let axis_angle = |h: usize, c: &ControlHairs, k: usize| {
            let segment = |c: &ControlHairs| (vec3(c.hair(h)[k + 1]) - vec3(c.hair(h)[k])).normalize();
            libm::acos(segment(&before).dot(&segment(c)).min(1.0))
        };
        for h in 0..hairs.len() {
            let distance = (at[h] - at[30]).norm();
            let a = influence(distance, 14.0, 0.5);
            if distance >= 14.0 {
                assert_eq!(hairs.hair(h), before.hair(h));
                far += 1;
            } else if distance <= 7.0 {
                assert_eq!(hairs.hair(h), hairs.hair(30));
                full += 1;
            } else {
                let close = |k| (axis_angle(h, &hairs, k) - a * axis_angle(30, &hairs, k)).abs() < 1e-5;
                assert!((0..5).all(close), "{h}");
                faded += 1;
            }
        }
        assert!(full > 1 && faded > 1 && far > 1, "{full} {faded} {far}");
        assert_eq!(counts[0].combed, full + faded);
        lengths_stay(&before, &hairs);
        // Half the weight is half the turn, of the handle too.
        let mut half = before.clone();
        comb(&skin, &[], &[CombOp { weight: 0.5.into(), ..op(kind()) }], &mut half);
        assert!((0..5).all(|k| (axis_angle(30, &half, k) - 0.5 * axis_angle(30, &hairs, k)).abs() < 1e-5));
    }
}
