//! Every hair from three control hairs: the interpolator.
//!
//! "Course notes 2003, A production pipeline for hair", §3.4. Its steps 1 to 3 (control hairs to the skin of the frame,
//! segment vectors, normalised) are done once a frame for all control hairs by [`pose_controls`]; steps 4 to 6 (blend by
//! weight, scale to the hair's length, build up from the root) run for every hair in [`interpolate`]; step 7, handing the
//! curves on, is the caller's.
//!
//! One thing is added to the paper: a blend of unit vectors is shorter than one, so each blended segment is normalised
//! again before it is scaled. A hair's length is then exactly what its map says.

use crate::control::{ControlHairs, to_local, to_world, vec3};
use pelage_geom::curve::resample;
use pelage_geom::{Mesh, Pose, SurfacePoint, Topology, Vec3};
use rayon::prelude::*;

/// Where a blend of unit vectors counts as cancelled: below this length its direction is noise of the weights. At 1e-7
/// rounding of `f32` weights would turn the hair freely; at 1e-1 hairs between controls 170 degrees apart, which still
/// have a steady blend, would snap to one of them.
pub const CANCEL: f32 = 1e-3;

/// Hairs a task: large enough that handing out tasks costs nothing, small enough that two threads end together.
const CHUNK: usize = 1024;

/// Directions of the control hairs in one pose: steps 1 to 3 of the paper's interpolator.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlPose {
    /// Points per hair P, one more than the segments.
    pub points: usize,
    /// Segments per block: 4, 8, 12 or 16. A hair has as many blocks as hold its segments.
    pub lanes: usize,
    /// Unit world direction of each segment: hair after hair, block after block, the x of all lanes, then y, then z.
    /// Spare lanes of a hair's last block hold (1, 0, 0), which never cancels.
    pub unit: Vec<f32>,
    /// Segments without a length, which took the direction of the segment before (or, at the root, after) them.
    pub degenerate: usize,
}

/// The columns of instanced hairs that interpolation reads, one entry a hair.
#[derive(Clone, Copy, Debug)]
pub struct Blend<'a> {
    /// Roots on the skin in this pose, scene units relative to the output's origin.
    pub root: &'a [[f32; 3]],
    /// Control hairs of each hair.
    pub hair: &'a [[u32; 3]],
    /// Their weights: non-negative, sum 1.
    pub weight: &'a [[f32; 3]],
    /// Length of each hair, scene units.
    pub length: &'a [f32],
}

/// What happened on the way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InterpolateCounts {
    /// Segments whose blended directions cancelled, and which took the direction of the heaviest control hair.
    pub cancelled_segments: usize,
    /// Hairs with at least one such segment.
    pub cancelled_hairs: usize,
}

impl ControlPose {
    /// Values of [`ControlPose::unit`] per hair.
    fn stride(&self) -> usize {
        3 * self.lanes * self.points.saturating_sub(1).div_ceil(self.lanes.max(1))
    }

    /// Number of control hairs.
    pub fn len(&self) -> usize {
        self.unit.len().checked_div(self.stride()).unwrap_or(0)
    }

    /// True if there are no control hairs.
    pub fn is_empty(&self) -> bool {
        self.unit.is_empty()
    }

    /// Unit direction of segment `s` of control hair `h`.
    pub fn direction(&self, h: usize, s: usize) -> [f32; 3] {
        let at = h * self.stride() + slot(self.lanes, s);
        std::array::from_fn(|x| self.unit[at + x * self.lanes])
    }

    /// From control hairs as world polylines: hair `h` is `position[h * from..][..from]`. With `points` other than
    /// `from`, each is first resampled to `points` points with equal segments.
    pub fn from_polylines(position: &[Vec3], from: usize, points: usize) -> Self {
        assert!(from >= 2 && points >= 2, "a hair has at least two points");
        let lanes = lanes_for(points - 1);
        let stride = 3 * lanes * (points - 1).div_ceil(lanes);
        let mut unit = vec![0.0; position.len() / from * stride];
        let degenerate = unit
            .par_chunks_mut(stride)
            .zip(position.par_chunks(from))
            .map(|(unit, line)| match points == from {
                true => directions(line, lanes, unit),
                false => directions(&resample(line, points), lanes, unit),
            })
            .sum();
        ControlPose { points, lanes, unit, degenerate }
    }
}

/// The block size with the fewest spare lanes; of equal ones the largest.
fn lanes_for(segments: usize) -> usize {
    let spare = |lanes: usize| segments.div_ceil(lanes) * lanes - segments;
    [16, 12, 8, 4].into_iter().min_by_key(|&lanes| spare(lanes)).unwrap_or(4)
}

/// Where the x of segment `s` stands among the values of its hair.
fn slot(lanes: usize, s: usize) -> usize {
    s / lanes * 3 * lanes + s % lanes
}

/// Control hairs to the skin of `pose`, their segment vectors normalised (paper §3.4, steps 1 to 3). `points` is the
/// number of points of the hairs to come; control hairs of another number are resampled.
pub fn pose_controls(
    controls: &ControlHairs,
    mesh: &Mesh,
    topology: &Topology,
    pose: &Pose,
    points: usize,
) -> ControlPose {
    let mut world = vec![Vec3::zeros(); controls.local.len()];
    world.par_chunks_mut(controls.points).enumerate().for_each(|(h, out)| {
        // Relative to the root: directions need no more, and stay exact far from the scene's origin.
        let frame = pose.frame(mesh, topology, &controls.root[h]);
        for (o, &p) in out.iter_mut().zip(controls.hair(h)) {
            *o = to_world(&frame, vec3(p));
        }
    });
    ControlPose::from_polylines(&world, controls.points, points)
}

/// Control hairs as seen from their roots, for hairs that are blended there: their own coordinates are those of the root frame.
pub fn local_controls(controls: &ControlHairs, points: usize) -> ControlPose {
    let local: Vec<Vec3> = controls.local.iter().map(|p| vec3(*p)).collect();
    ControlPose::from_polylines(&local, controls.points, points)
}

/// Control hairs at a pose (H polylines of P points each, any origin) as seen from their roots there.
pub fn seen_from_roots(
    line: &mut [Vec3],
    points: usize,
    root: &[SurfacePoint],
    mesh: &Mesh,
    topology: &Topology,
    pose: &Pose,
) {
    line.par_chunks_mut(points).zip(root).for_each(|(line, root)| {
        let frame = pose.frame(mesh, topology, root);
        let origin = line[0];
        line.iter_mut().for_each(|p| *p = to_local(&frame, *p - origin));
    });
}

/// Hairs that were blended as seen from their roots (root 0), to where these are at a pose: `at` are the roots' positions,
/// `out` the points of all hairs, `points` each. After the interpolation in local frames of Chang, Jin, Yu (2002, §2.2): what
/// leans the same way from the skin at every control hair does so at every hair, however the skin is bent.
pub fn to_roots(
    mesh: &Mesh,
    topology: &Topology,
    pose: &Pose,
    root: &[SurfacePoint],
    at: &[[f32; 3]],
    points: usize,
    out: &mut [[f32; 3]],
) {
    out.par_chunks_mut(points).zip(root).zip(at).for_each(|((hair, root), at)| {
        let frame = pose.frame(mesh, topology, root);
        for p in hair {
            let v = to_world(&frame, vec3(*p));
            *p = [at[0] + v.x as f32, at[1] + v.y as f32, at[2] + v.z as f32];
        }
    });
}

/// Unit segment vectors of one polyline into its blocks; returns how many segments had no length.
fn directions(line: &[Vec3], lanes: usize, unit: &mut [f32]) -> usize {
    let segments = line.len() - 1;
    let length: f64 = line.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
    let fine = |v: &Vec3| v.norm() > 1e-9 * length;
    let first = line.windows(2).map(|w| w[1] - w[0]).find(fine);
    let mut last = first.map_or(Vec3::x(), |v| v.normalize());
    let mut degenerate = 0;
    for s in 0..segments {
        let v = line[s + 1] - line[s];
        if fine(&v) {
            last = v.normalize();
        } else {
            degenerate += 1;
        }
        for (x, value) in last.iter().enumerate() {
            unit[slot(lanes, s) + x * lanes] = *value as f32;
        }
    }
    let spare = segments..segments.next_multiple_of(lanes);
    spare.for_each(|s| unit[slot(lanes, s)] = 1.0);
    degenerate
}

/// Roots on the skin of a pose, scene units relative to `origin`; computed in double precision.
pub fn root_positions(mesh: &Mesh, pose: &Pose, root: &[SurfacePoint], origin: [f64; 3]) -> Vec<[f32; 3]> {
    let origin = Vec3::from(origin);
    root.par_iter()
        .map(|p| {
            let corner = pelage_geom::mesh::corners(&pose.position, mesh.triangle[p.triangle as usize]);
            let v = p.blend(corner) - origin;
            [v.x as f32, v.y as f32, v.z as f32]
        })
        .collect()
}

/// Points of all hairs (paper §3.4, steps 4 to 6), hair after hair, `controls.points` each: every segment is the
/// normalised blend of the control hairs' unit segments times length / (P - 1). Where a blend cancels (shorter than
/// [`CANCEL`]) the segment takes the direction of the control hair of largest weight (ties: lowest index).
///
/// Panics if the columns differ in length or `out` does not hold exactly all points.
pub fn interpolate(hairs: &Blend, controls: &ControlPose, out: &mut [[f32; 3]]) -> InterpolateCounts {
    let (n, points) = (hairs.root.len(), controls.points);
    assert!(points >= 2, "a hair has at least two points");
    assert_eq!(out.len(), n * points, "output for another number of points");
    assert!(hairs.hair.len() == n && hairs.weight.len() == n && hairs.length.len() == n, "columns differ in length");
    let counted = out.par_chunks_mut(CHUNK * points).enumerate().map(|(chunk, out)| match controls.lanes {
        4 => run::<4>(hairs, controls, chunk * CHUNK, out),
        8 => run::<8>(hairs, controls, chunk * CHUNK, out),
        12 => run::<12>(hairs, controls, chunk * CHUNK, out),
        _ => run::<16>(hairs, controls, chunk * CHUNK, out),
    });
    counted.reduce(InterpolateCounts::default, |a, b| InterpolateCounts {
        cancelled_segments: a.cancelled_segments + b.cancelled_segments,
        cancelled_hairs: a.cancelled_hairs + b.cancelled_hairs,
    })
}

/// The hairs from `first` on that fill `out`, with blocks of `N` lanes.
fn run<const N: usize>(hairs: &Blend, controls: &ControlPose, first: usize, out: &mut [[f32; 3]]) -> InterpolateCounts {
    let (blocks, _) = controls.unit.as_chunks::<N>();
    let stride = controls.stride() / N;
    let step = 1.0 / (controls.points - 1) as f32;
    let mut counts = InterpolateCounts::default();
    for (i, out) in (first..).zip(out.chunks_exact_mut(controls.points)) {
        let control = hairs.hair[i].map(|h| &blocks[h as usize * stride..][..stride]);
        let least = build(control, hairs.weight[i], hairs.root[i], hairs.length[i] * step, out);
        if least < CANCEL * CANCEL {
            let cancelled = build_carefully(hairs, controls, i, out);
            counts.cancelled_segments += cancelled;
            counts.cancelled_hairs += usize::from(cancelled > 0);
        }
    }
    counts
}

/// One hair without regard to cancelled blends; returns the least squared length of a blend. Whole rows of `N` lanes with
/// no branch between them are what the compiler turns into vector code; measured, this is 1.7 times as fast as blocks of
/// one register each.
#[inline(always)]
fn build<const N: usize>(
    control: [&[[f32; N]]; 3],
    w: [f32; 3],
    root: [f32; 3],
    step: f32,
    out: &mut [[f32; 3]],
) -> f32 {
    let [first, rest @ ..] = out else { return 1.0 };
    *first = root;
    let mut at = [0.0f32; 3];
    let mut least = [1.0f32; N];
    let blocks = control.map(|c| c.as_chunks::<3>().0);
    for (((a, b), c), out) in blocks[0].iter().zip(blocks[1]).zip(blocks[2]).zip(rest.chunks_mut(N)) {
        let mut d = [[0.0f32; N]; 3];
        for l in 0..N {
            let x = a[0][l] * w[0] + b[0][l] * w[1] + c[0][l] * w[2];
            let y = a[1][l] * w[0] + b[1][l] * w[1] + c[1][l] * w[2];
            let z = a[2][l] * w[0] + b[2][l] * w[1] + c[2][l] * w[2];
            let n2 = x * x + y * y + z * z;
            least[l] = if n2 < least[l] { n2 } else { least[l] };
            let scale = step / n2.sqrt();
            d[0][l] = x * scale;
            d[1][l] = y * scale;
            d[2][l] = z * scale;
        }
        for (l, out) in out.iter_mut().take(N).enumerate() {
            for x in 0..3 {
                at[x] += d[x][l];
                out[x] = root[x] + at[x];
            }
        }
    }
    least.into_iter().fold(1.0, |a, b| if b < a { b } else { a })
}

/// One hair segment by segment, with the fallback for cancelled blends; returns how many segments took it.
#[cold]
fn build_carefully(hairs: &Blend, controls: &ControlPose, i: usize, out: &mut [[f32; 3]]) -> usize {
    let (hair, w, root) = (hairs.hair[i], hairs.weight[i], hairs.root[i]);
    let step = hairs.length[i] * (1.0 / (controls.points - 1) as f32);
    let mut at = [0.0f32; 3];
    let mut cancelled = 0;
    out[0] = root;
    for s in 0..controls.points - 1 {
        let [a, b, c] = hair.map(|h| controls.direction(h as usize, s));
        let mut d: [f32; 3] = std::array::from_fn(|x| a[x] * w[0] + b[x] * w[1] + c[x] * w[2]);
        let n2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let mut scale = step / n2.sqrt();
        if n2 < CANCEL * CANCEL {
            d = controls.direction(hair[heaviest(hair, w)] as usize, s);
            scale = step;
            cancelled += 1;
        }
        for x in 0..3 {
            at[x] += d[x] * scale;
            out[s + 1][x] = root[x] + at[x];
        }
    }
    cancelled
}

/// The corner of largest weight; of equal weights, the control hair of lowest index.
fn heaviest(hair: [u32; 3], w: [f32; 3]) -> usize {
    let before = |i: usize, j: usize| w[i] > w[j] || (w[i] == w[j] && hair[i] < hair[j]);
    let best = if before(1, 0) { 1 } else { 0 };
    if before(2, best) { 2 } else { best }
}

/// [`interpolate`] said plainly, in double precision, one hair after another: what the fast one is tested against.
pub fn interpolate_reference(hairs: &Blend, controls: &ControlPose) -> (Vec<Vec3>, InterpolateCounts) {
    let segments = controls.points - 1;
    let mut out = Vec::with_capacity(hairs.root.len() * controls.points);
    let mut counts = InterpolateCounts::default();
    for i in 0..hairs.root.len() {
        let mut at = vec3(hairs.root[i]);
        let mut cancelled = 0;
        out.push(at);
        for s in 0..segments {
            let unit = hairs.hair[i].map(|h| vec3(controls.direction(h as usize, s)));
            let w = hairs.weight[i].map(f64::from);
            let mut d = unit[0] * w[0] + unit[1] * w[1] + unit[2] * w[2];
            if d.norm() < f64::from(CANCEL) {
                d = unit[heaviest(hairs.hair[i], hairs.weight[i])];
                cancelled += 1;
            }
            at += d.normalize() * (f64::from(hairs.length[i]) / segments as f64);
            out.push(at);
        }
        counts.cancelled_segments += cancelled;
        counts.cancelled_hairs += usize::from(cancelled > 0);
    }
    (out, counts)
}

/// Lengths of hairs among control hairs of which some were cut: the blend of what each would leave of it. `hair` and `weight`
/// as in [`Blend`], `cut` as in [`crate::control::ControlHairs`].
pub fn cut_lengths(hair: &[[u32; 3]], weight: &[[f32; 3]], cut: &[f32], length: &mut [f32]) {
    for ((length, hair), weight) in length.iter_mut().zip(hair).zip(weight) {
        let left = hair.map(|c| cut[c as usize]);
        if left.iter().any(|l| *l < *length) {
            *length = (0..3).map(|k| weight[k] * left[k].min(*length)).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::rng::uniform;

    /// Random control hairs around a common direction, and random hairs over them.
    struct Case {
        lines: Vec<Vec3>,
        root: Vec<[f32; 3]>,
        hair: Vec<[u32; 3]>,
        weight: Vec<[f32; 3]>,
        length: Vec<f32>,
    }

    fn random(seed: u64, id: u64, k: u64) -> f64 {
        uniform(seed, id, 77, k) * 2.0 - 1.0
    }

    fn case(controls: usize, points: usize, hairs: usize, spread: f64) -> Case {
        let mut lines = Vec::new();
        for h in 0..controls as u64 {
            let mut p = Vec3::new(random(1, h, 0), random(1, h, 1), random(1, h, 2));
            for s in 0..points as u64 {
                lines.push(p);
                let wild = Vec3::new(random(2, h, 3 * s), random(2, h, 3 * s + 1), random(2, h, 3 * s + 2));
                p += (Vec3::new(0.2, 0.9, -0.4) + wild * spread) * (1.5 + random(3, h, s));
            }
        }
        let pick = |i: u64, k: u64| (uniform(4, i, 78, k) * controls as f64) as u32;
        let weight = |i: u64| {
            let (a, b) = (uniform(5, i, 79, 0), uniform(5, i, 79, 1));
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            [(1.0 - a - b) as f32, a as f32, b as f32]
        };
        let n = hairs as u64;
        Case {
            lines,
            root: (0..n).map(|i| std::array::from_fn(|k| random(6, i, k as u64) as f32 * 9.0)).collect(),
            hair: (0..n).map(|i| [pick(i, 0), pick(i, 1), pick(i, 2)]).collect(),
            weight: (0..n).map(weight).collect(),
            length: (0..n).map(|i| (0.1 + 20.0 * uniform(7, i, 80, 0)) as f32).collect(),
        }
    }

    impl Case {
        fn blend(&self) -> Blend<'_> {
            Blend { root: &self.root, hair: &self.hair, weight: &self.weight, length: &self.length }
        }
    }

    fn blend_all(hairs: &Blend, controls: &ControlPose) -> (Vec<[f32; 3]>, InterpolateCounts) {
        let mut out = vec![[f32::NAN; 3]; hairs.root.len() * controls.points];
        let counts = interpolate(hairs, controls, &mut out);
        (out, counts)
    }

    #[test]
    fn fast_equals_plain_for_every_number_of_points() {
        for points in [2, 3, 4, 5, 6, 8, 9, 10, 12, 13, 14, 16, 17, 18, 25, 33, 50] {
            let c = case(40, 7, 2500, 0.8);
            let pose = ControlPose::from_polylines(&c.lines, 7, points);
            let (fast, counts) = blend_all(&c.blend(), &pose);
            let (plain, plain_counts) = interpolate_reference(&c.blend(), &pose);
            assert_eq!(counts, plain_counts);
            for (i, (f, p)) in fast.iter().zip(&plain).enumerate() {
                let scale = f64::from(c.length[i / points]) + p.norm();
                assert!((vec3(*f) - p).norm() <= 1e-6 * scale, "points {points}, hair {}: {f:?} {p:?}", i / points);
            }
        }
    }

    #[test]
    fn hair_among_cut_hairs_is_as_long_as_they_leave_it() {
        let cut = [5.0, f32::INFINITY, 3.0];
        let hair = [[0, 1, 2], [1, 1, 1], [0, 1, 2], [2, 1, 0]];
        let weight = [[0.5, 0.25, 0.25], [0.5, 0.25, 0.25], [0.5, 0.25, 0.25], [1.0, 0.0, 0.0]];
        let mut length = [8.0, 8.0, 2.0, 8.0];
        cut_lengths(&hair, &weight, &cut, &mut length);
        assert_eq!(length, [0.5 * 5.0 + 0.25 * 8.0 + 0.25 * 3.0, 8.0, 2.0, 3.0]);
    }

    #[test]
    fn lengths_are_exact() {
        let c = case(64, 12, 5000, 0.9);
        let pose = ControlPose::from_polylines(&c.lines, 12, 12);
        let (out, _) = blend_all(&c.blend(), &pose);
        for (hair, &length) in out.chunks(12).zip(&c.length) {
            let sum: f64 = hair.windows(2).map(|w| (vec3(w[1]) - vec3(w[0])).norm()).sum();
            let rel = (sum / f64::from(length) - 1.0).abs();
            assert!(rel < 1e-4, "{sum} for {length}");
        }
    }

    #[test]
    fn a_single_weight_gives_that_control_hairs_directions() {
        let mut c = case(9, 8, 27, 0.8);
        for (i, w) in c.weight.iter_mut().enumerate() {
            *w = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][i % 3];
        }
        let pose = ControlPose::from_polylines(&c.lines, 8, 8);
        let (out, _) = blend_all(&c.blend(), &pose);
        for i in 0..27 {
            let h = c.hair[i][i % 3] as usize;
            for s in 0..7 {
                let d = vec3(out[i * 8 + s + 1]) - vec3(out[i * 8 + s]);
                let expected = (c.lines[h * 8 + s + 1] - c.lines[h * 8 + s]).normalize();
                assert!((d * 7.0 / f64::from(c.length[i]) - expected).norm() < 1e-4, "hair {i} segment {s}");
            }
        }
    }

    #[test]
    fn rotating_the_controls_and_roots_rotates_the_hairs() {
        let mut c = case(30, 12, 400, 0.8);
        let turn = nalgebra::Rotation3::from_matrix_unchecked(
            nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(Vec3::new(1.0, 2.0, -3.0)), 2.2)
                .into_inner(),
        );
        let (still, _) = blend_all(&c.blend(), &ControlPose::from_polylines(&c.lines, 12, 12));
        let lines: Vec<Vec3> = c.lines.iter().map(|p| turn * p).collect();
        for r in &mut c.root {
            let v = turn * vec3(*r);
            *r = [v.x as f32, v.y as f32, v.z as f32];
        }
        let (turned, _) = blend_all(&c.blend(), &ControlPose::from_polylines(&lines, 12, 12));
        for (a, b) in still.iter().zip(&turned) {
            assert!((turn * vec3(*a) - vec3(*b)).norm() < 1e-5 * 40.0);
        }
    }

    #[test]
    fn opposite_directions_fall_back_to_the_heavier_hair_and_are_counted() {
        // Hair 0 goes up, hair 1 down except for its last segment.
        let up = Vec3::y();
        let (mut a, mut b) = (vec![Vec3::zeros()], vec![Vec3::zeros()]);
        for s in 0..6 {
            a.push(a[s] + up);
            b.push(b[s] + if s == 5 { Vec3::x() } else { -up });
        }
        let pose = ControlPose::from_polylines(&[a, b].concat(), 7, 7);
        let blend = |weight: &[[f32; 3]], hair: &[[u32; 3]]| {
            let root = vec![[0.0; 3]; weight.len()];
            let length = vec![6.0; weight.len()];
            let hairs = Blend { root: &root, hair, weight, length: &length };
            let (out, counts) = blend_all(&hairs, &pose);
            assert_eq!(interpolate_reference(&hairs, &pose).1, counts);
            (out, counts)
        };
        let (out, counts) =
            blend(&[[0.4998, 0.5002, 0.0], [0.5, 0.5, 0.0], [0.6, 0.4, 0.0]], &[[0, 1, 0], [1, 0, 0], [0, 1, 0]]);
        assert_eq!(counts, InterpolateCounts { cancelled_segments: 10, cancelled_hairs: 2 });
        assert_eq!(out[1], [0.0, -1.0, 0.0]);
        assert_eq!(out[8], [0.0, 1.0, 0.0]);
        assert_eq!(out[15], [0.0, 1.0, 0.0]);
        assert!(out.iter().flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bytes() {
        let c = case(50, 12, 9000, 1.5);
        let pose = ControlPose::from_polylines(&c.lines, 12, 12);
        let with = |threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
                .install(|| blend_all(&c.blend(), &pose))
        };
        let bits = |v: Vec<[f32; 3]>| v.into_iter().flatten().map(f32::to_bits).collect::<Vec<_>>();
        let (one, two) = (with(1), with(3));
        assert_eq!(one.1, two.1);
        assert!(bits(one.0) == bits(two.0));
    }

    #[test]
    fn hairs_blended_at_their_roots_lean_from_the_skin_as_their_controls_do() {
        let s = crate::test_skin::TestSkin::new(12, 8, 1.0);
        let (skin, points) = (s.skin(), 5);
        let mut controls = ControlHairs { points, ..ControlHairs::default() };
        let lean: Vec<Vec3> = (0..points).map(|k| Vec3::new(k as f64, 0.2 * (k * k) as f64, -0.3 * k as f64)).collect();
        let root = |k: u32| SurfacePoint { triangle: 3 * k, bary: [0.2, 0.5] };
        (0..12).for_each(|k| controls.push(root(k), &lean));
        let roots: Vec<SurfacePoint> = (0..30).map(|k| SurfacePoint { triangle: k, bary: [0.4, 0.1] }).collect();
        let hair: Vec<[u32; 3]> = (0..30).map(|k| [k % 12, (k + 5) % 12, (k + 7) % 12]).collect();
        let (weight, length) = (vec![[0.3, 0.3, 0.4]; 30], vec![2.0f32; 30]);
        let at = root_positions(skin.mesh, skin.rest, &roots, [0.0; 3]);
        let blend = Blend { root: &[[0.0; 3]; 30], hair: &hair, weight: &weight, length: &length };
        let (mut out, _) = blend_all(&blend, &local_controls(&controls, points));
        let own = out[..points].to_vec();
        assert!(out.chunks(points).all(|h| h == own), "every hair is the same as seen from its root");
        to_roots(skin.mesh, skin.topology, skin.rest, &roots, &at, points, &mut out);
        for (h, root) in roots.iter().enumerate() {
            let frame = skin.frame(root);
            for (k, p) in out[h * points..][..points].iter().enumerate() {
                let local = to_local(&frame, vec3(*p) - vec3(at[h]));
                assert!((local - vec3(own[k])).norm() < 1e-5, "hair {h} point {k}");
            }
        }
        // From their points in the world, controls look the same.
        let mut line: Vec<Vec3> =
            (0..12).flat_map(|h| controls.placed(h, &skin.frame(&root(h as u32))).collect::<Vec<_>>()).collect();
        let all: Vec<SurfacePoint> = (0..12).map(root).collect();
        seen_from_roots(&mut line, points, &all, skin.mesh, skin.topology, skin.rest);
        assert!(line.iter().zip(lean.iter().cycle()).all(|(a, b)| (a - b).norm() < 1e-5));
    }

    #[test]
    fn segments_without_length_take_a_neighbours_direction() {
        let still = ControlPose::from_polylines(
            &[Vec3::x(), Vec3::x(), Vec3::new(1.0, 2.0, 0.0), Vec3::new(1.0, 2.0, 0.0)],
            4,
            4,
        );
        assert_eq!(still.degenerate, 2);
        assert!((0..3).all(|s| still.direction(0, s) == [0.0, 1.0, 0.0]));
    }
}
