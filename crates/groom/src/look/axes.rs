//! Axes across a hair, in which curls, waves and noise displace it.
//!
//! At the root an axis is chosen once, at rest (the sparse-guide-hairs paper §2.4.2 takes the direction away from the
//! middle of the scalp; here it is the skin's normal, which needs no middle), kept in the root frame and turned with it.
//! Along the hair it is carried without twist: from one tangent to the next by the smallest rotation between them. So on
//! every frame the axes turn no more than the hair does, and a hair that moves as a whole takes them along.

use super::V3;
use super::lanes::{Block, Lanes, Pack, Pack3, V};
use pelage_geom::{Mesh, Pose, SurfacePoint, Topology, Vec3};
use rayon::prelude::*;

/// Sine of the angle between hair and normal below which the normal gives no axis: there the tangent along u does. At
/// 1e-6 rounding would choose the axis; at 0.1 neighbours in upright fur would choose differently more often.
const UPRIGHT: f64 = 1e-3;

/// Cosine of a turn beyond which the smallest rotation is not defined: a hair that folds back on itself keeps its axis.
const FOLDED: f32 = -0.9999;

/// First direction of a hair and an axis across it, both unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RootAxes {
    /// Direction of the first segment.
    pub tangent: [f32; 3],
    /// The x axis, at right angles to it.
    pub normal: [f32; 3],
}

/// Axes of hairs at rest, in their root frames [N, dU, N x dU].
pub fn rest_axes(
    mesh: &Mesh,
    topology: &Topology,
    rest: &Pose,
    root: &[SurfacePoint],
    points: usize,
    position: &[[f32; 3]],
) -> Vec<RootAxes> {
    let axes = |(p, hair): (&SurfacePoint, &[[f32; 3]])| {
        let f = rest.frame(mesh, topology, p);
        let first = Vec3::from(hair[0].map(f64::from));
        let ahead = hair[1..].iter().map(|q| Vec3::from(q.map(f64::from)) - first).find(|d| d.norm() > 0.0);
        let t = ahead.map_or(f.n, |d| d.normalize());
        let across = |v: Vec3| v - t * t.dot(&v);
        let n = across(f.n);
        let x = if n.norm() > UPRIGHT { n } else { across(f.du) }.normalize();
        let local = |v: Vec3| [f.n.dot(&v) as f32, f.du.dot(&v) as f32, f.dv.dot(&v) as f32];
        RootAxes { tangent: local(t), normal: local(x) }
    };
    root.par_iter().zip(position.par_chunks(points)).map(axes).collect()
}

/// Axes carried by the skin into a pose, in the world.
pub fn carried(
    mesh: &Mesh,
    topology: &Topology,
    now: &Pose,
    root: &[SurfacePoint],
    local: &[RootAxes],
) -> Vec<RootAxes> {
    let carry = |(p, a): (&SurfacePoint, &RootAxes)| {
        let f = now.frame(mesh, topology, p);
        let world = |v: [f32; 3]| {
            let w = f.n * f64::from(v[0]) + f.du * f64::from(v[1]) + f.dv * f64::from(v[2]);
            [w.x as f32, w.y as f32, w.z as f32]
        };
        RootAxes { tangent: world(a.tangent), normal: world(a.normal) }
    };
    root.par_iter().zip(local).map(carry).collect()
}

/// Axes at the points of hairs side by side, used again from block to block.
#[derive(Debug)]
pub(crate) struct Beside {
    /// Unit tangents.
    tangent: Vec<Pack3>,
    /// x axes.
    pub normal: Vec<Pack3>,
    /// y axes.
    pub binormal: Vec<Pack3>,
    /// Length of the hairs up to each point.
    pub arc: Vec<Pack>,
}

impl Beside {
    /// Room for hairs of `points` points.
    pub fn new(points: usize) -> Self {
        let room = || vec![Pack3::default(); points];
        Beside { tangent: room(), normal: room(), binormal: room(), arc: vec![Pack::default(); points] }
    }

    /// Sets arc lengths only; gives back the whole length.
    #[inline(always)]
    pub fn set_arc<L: Lanes>(&mut self, hairs: &Block) -> L {
        let mut before = V::<L>::load(&hairs.point[0]);
        let mut arc = L::splat(0.0);
        for (p, to) in hairs.point.iter().zip(&mut self.arc) {
            // The root is no way from itself.
            let here = V::load(p);
            let d = here - before;
            arc = arc + d.dot(d).sqrt();
            arc.store(to);
            before = here;
        }
        arc
    }

    /// Sets tangents, axes and arc lengths: what [`Along::set`] does, lane by lane. `root` has the tangents and x axes of
    /// the lanes' roots. Gives back the whole length.
    #[inline(always)]
    pub fn set<L: Lanes>(&mut self, hairs: &Block, root: [V<L>; 2]) -> L {
        let (zero, one, short) = (L::splat(0.0), L::splat(1.0), L::splat(1e-8));
        let points = hairs.point.len();
        let (tangent, arcs) = (&mut self.tangent[..points], &mut self.arc[..points]);
        // Two loops: one of them waits for divisions, the other for the axis before.
        let (mut t_before, mut arc, mut before) = (root[0], zero, V::<L>::load(&hairs.point[0]));
        arc.store(&mut arcs[0]);
        for k in 1..points {
            let here = V::load(&hairs.point[k]);
            let d = here - before;
            before = here;
            let n = d.dot(d).sqrt();
            arc = arc + n;
            arc.store(&mut arcs[k]);
            let t = V::if_gt(n, zero, d.times(one / n), t_before);
            // A point's tangent halves the angle between its segments.
            let sum = t_before + t;
            let n2 = sum.dot(sum);
            let middle = V::if_gt(n2, short, sum.times(one / n2.sqrt()), t);
            (if k == 1 { t } else { middle }).store(&mut tangent[k - 1]);
            t_before = t;
        }
        t_before.store(&mut tangent[points - 1]);
        let (normal, binormal) = (&mut self.normal[..points], &mut self.binormal[..points]);
        let [mut t0, mut x] = root;
        for k in 0..points {
            let t = V::load(&tangent[k]);
            x = turned_lanes(x, t0, t);
            t0 = t;
            x.store(&mut normal[k]);
            t.cross(x).store(&mut binormal[k]);
        }
        arc
    }
}

/// [`turned`] in lanes.
#[inline(always)]
fn turned_lanes<L: Lanes>(x: V<L>, from: V<L>, to: V<L>) -> V<L> {
    let cosine = from.dot(to);
    let y = x - (from + to).times(x.dot(to) / (L::splat(1.0) + cosine));
    let y = y - to.times(y.dot(to));
    let y = y.times(L::splat(1.5) - L::splat(0.5) * y.dot(y));
    let folded = L::splat(FOLDED);
    if !L::any_gt(folded, cosine) {
        return y;
    }
    let across = x - to.times(x.dot(to));
    let n = across.dot(across).sqrt();
    let other = V::if_gt(n, L::splat(1e-3), across.times(L::splat(1.0) / n), x);
    V::if_gt(folded, cosine, other, y)
}

/// Axes at the points of one hair, used again from hair to hair: the plain form of [`Beside`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Along {
    /// Unit tangents.
    pub tangent: Vec<V3>,
    /// x axes; y is tangent x normal.
    pub normal: Vec<V3>,
    /// Length of the hair up to each point.
    pub arc: Vec<f32>,
}

impl Along {
    /// Sets tangents, axes and arc length of a hair.
    pub fn set(&mut self, hair: &[[f32; 3]], root: &RootAxes) {
        self.arc.clear();
        self.tangent.clear();
        self.normal.clear();
        self.arc.push(0.0);
        let (mut arc, mut before) = (0.0f32, V3::from(root.tangent));
        for w in hair.windows(2) {
            let d = V3::from(w[1]) - V3::from(w[0]);
            let n = d.norm();
            arc += n;
            self.arc.push(arc);
            let t = if n > 0.0 { d * (1.0 / n) } else { before };
            // A point's tangent halves the angle between its segments.
            self.tangent.push(if self.tangent.is_empty() { t } else { middle(before, t) });
            before = t;
        }
        self.tangent.push(before);
        let (mut t0, mut x) = (V3::from(root.tangent), V3::from(root.normal));
        for t in &self.tangent {
            x = turned(x, t0, *t);
            self.normal.push(x);
            t0 = *t;
        }
    }
}

#[inline(always)]
fn middle(a: V3, b: V3) -> V3 {
    let sum = a + b;
    let n2 = sum.norm_squared();
    if n2 > 1e-8 { sum * (1.0 / n2.sqrt()) } else { b }
}

/// `x`, at right angles to the unit vector `from`, turned by the smallest rotation that takes `from` to the unit vector
/// `to`.
#[inline(always)]
pub(crate) fn turned(x: V3, from: V3, to: V3) -> V3 {
    let cosine = from.dot(&to);
    if cosine < FOLDED {
        let across = x - to * x.dot(&to);
        let n = across.norm();
        return if n > 1e-3 { across / n } else { x };
    }
    // Rounding is taken out at every step, so that it does not add up over thousands of points.
    let y = x - (from + to) * (x.dot(&to) / (1.0 + cosine));
    let y = y - to * y.dot(&to);
    y * (1.5 - 0.5 * y.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Group, Kernel, LANES, run};
    use super::*;
    use nalgebra::{Rotation3, Unit};

    fn v(i: u64, k: u64) -> f32 {
        (pelage_geom::rng::uniform(5, i, k, 0) * 2.0 - 1.0) as f32
    }

    fn hair(seed: u64, points: usize) -> Vec<[f32; 3]> {
        let mut at = V3::zeros();
        let mut out = vec![at.into()];
        for k in 1..points as u64 {
            at += V3::new(0.3, 1.0, 0.2) + V3::new(v(seed, 3 * k), v(seed, 3 * k + 1), v(seed, 3 * k + 2)) * 0.7;
            out.push(at.into());
        }
        out
    }

    fn root(hair: &[[f32; 3]]) -> RootAxes {
        let t = (V3::from(hair[1]) - V3::from(hair[0])).normalize();
        RootAxes { tangent: t.into(), normal: t.cross(&V3::new(0.3, 0.1, 0.9)).normalize().into() }
    }

    #[test]
    fn axes_stay_unit_and_across() {
        let line = hair(1, 5000);
        let mut a = Along::default();
        a.set(&line, &root(&line));
        for (x, t) in a.normal.iter().zip(&a.tangent) {
            assert!((x.norm() - 1.0).abs() < 1e-5 && x.dot(t).abs() < 1e-5);
        }
    }

    #[test]
    fn a_turned_hair_has_turned_axes() {
        for seed in 0..20 {
            let axis = Unit::new_normalize(V3::new(v(seed, 90), v(seed, 91), v(seed, 92)));
            let turn = Rotation3::from_axis_angle(&axis, 3.0 * v(seed, 93));
            let line = hair(seed, 40);
            let moved: Vec<[f32; 3]> = line.iter().map(|p| (turn * V3::from(*p)).into()).collect();
            let r = root(&line);
            let moved_root =
                RootAxes { tangent: (turn * V3::from(r.tangent)).into(), normal: (turn * V3::from(r.normal)).into() };
            let (mut a, mut b) = (Along::default(), Along::default());
            a.set(&line, &r);
            b.set(&moved, &moved_root);
            assert!(a.normal.iter().zip(&b.normal).all(|(x, y)| (turn * x - y).norm() < 1e-5));
        }
    }

    #[test]
    fn hairs_side_by_side_have_the_axes_of_each() {
        struct Set<'a>(&'a mut Beside, &'a [[f32; 3]], &'a [RootAxes], &'a Group);
        impl Kernel for Set<'_> {
            type Out = ();
            #[inline(always)]
            fn run<L: Lanes>(self) {
                let mut block = Block::new(30);
                block.load::<L>(self.1, self.3);
                self.0.set::<L>(&block, self.3.roots(self.2));
            }
        }
        let last = LANES as u64 - 1;
        let mut all: Vec<[f32; 3]> = (0..last).flat_map(|s| hair(s, 30)).collect();
        // One hair folds back on itself and stands still in between.
        all.extend((0..30).map(|k| [[0.0, 1.0, 1.0, 0.0][k % 4], 0.0, 0.0]));
        let axes: Vec<RootAxes> = all.chunks_exact(30).map(root).collect();
        let lane: [usize; LANES] = std::array::from_fn(|l| l);
        let group = Group::new(0, &lane);
        let mut beside = Beside::new(30);
        run(Set(&mut beside, &all, &axes, &group));
        for l in 0..LANES {
            let mut one = Along::default();
            one.set(&all[l * 30..][..30], &axes[l]);
            let of = |v: &Pack3| V3::new(v[0].0[l], v[1].0[l], v[2].0[l]);
            for k in 0..30 {
                assert!((of(&beside.tangent[k]) - one.tangent[k]).norm() < 1e-5, "{l} {k}");
                assert!((of(&beside.normal[k]) - one.normal[k]).norm() < 1e-4, "{l} {k}");
                assert!((beside.arc[k].0[l] - one.arc[k]).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn axes_do_not_twist() {
        // On a plane curve the axis out of the plane stays, whatever the bends; a hair that folds back has axes too.
        let line: Vec<[f32; 3]> = (0..60).map(|k| [k as f32, libm::sinf(k as f32 * 0.9) * 3.0, 0.0]).collect();
        let t = (V3::from(line[1]) - V3::from(line[0])).normalize();
        let mut a = Along::default();
        a.set(&line, &RootAxes { tangent: t.into(), normal: [0.0, 0.0, 1.0] });
        assert!(a.normal.iter().all(|x| (x - V3::z()).norm() < 1e-5));
        let fold = [[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [1.0, 0.0, 0.0]];
        a.set(&fold, &RootAxes { tangent: [1.0, 0.0, 0.0], normal: [0.0, 1.0, 0.0] });
        assert!(a.normal.iter().all(|x| (x.norm() - 1.0).abs() < 1e-3));
        let still = [[0.5; 3]; 4];
        a.set(&still, &RootAxes { tangent: [1.0, 0.0, 0.0], normal: [0.0, 1.0, 0.0] });
        assert!(a.normal.iter().all(|x| *x == V3::y()) && a.arc == [0.0; 4]);
    }
}
