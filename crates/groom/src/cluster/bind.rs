//! Bind and update: children in the coordinates of their parent, and back when it has changed.

use super::{Curve, Cylinder, Shape, Tree};
use pelage_geom::{NONE, Vec3};

/// What a way along the skeleton counts against a way across it, where a point lies in several sections: with 0, a
/// child of a tight curl is bound to whichever turn is near; with much more than 1, a child that is more curled than
/// its parent is bound too near to its tip.
const ALONG: f64 = 0.5;

/// A section whose narrow side is less than this fraction of the cluster's largest width has no room to tell points
/// apart: they are bound to its centre. Less, and points bound near a pointed tip fly off when it is widened; more, and
/// tips of slender clusters do not follow their parent's scale.
const FLAT: f64 = 1e-3;

/// A point in the coordinates of a cluster.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Coordinates {
    /// Section, 0 to 1.
    pub t: f64,
    /// 0 on the skeleton, 1 on the contour.
    pub r: f64,
    /// Angle, radians.
    pub theta: f64,
    /// What is left, beyond the ends and where sections are flat: along T and the turned N and B
    /// ([`super::Section::turned_axes`]), in lengths of the skeleton.
    pub beyond: [f64; 3],
}

/// Coordinates of a point of space in a cluster. Of several sections that go through it, one near to it and to the
/// section `near` is taken. [`position`] is its inverse everywhere.
pub fn coordinates(shape: &Shape, p: Vec3, near: f64) -> Coordinates {
    let length = shape.skeleton().length();
    let cost = |t: &f64| {
        let along = (t - near) * length * ALONG;
        (shape.skeleton().place(*t).at - p).norm_squared() + along * along
    };
    let feet = shape.skeleton().feet(p);
    let t = if let [only] = feet[..] {
        only
    } else {
        feet.into_iter().map(|t| (cost(&t), t)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |b| b.1)
    };
    let section = shape.section(t);
    let [n, b] = section.scale;
    let narrow = section.girth() * (n.min(b) / n.max(b)).sqrt();
    let [r, theta] = if narrow > FLAT * shape.widest() { section.coordinates(p) } else { [0.0; 2] };
    let left = (p - section.point(r, theta)) / length;
    Coordinates { t, r, theta, beyond: section.turned_axes().map(|a| a.dot(&left)) }
}

/// The point with these coordinates.
pub fn position(shape: &Shape, c: &Coordinates) -> Vec3 {
    let section = shape.section(c.t);
    section.point(c.r, c.theta) + sum(section.turned_axes(), c.beyond) * shape.skeleton().length()
}

fn sum(axes: [Vec3; 3], by: [f64; 3]) -> Vec3 {
    axes[0] * by[0] + axes[1] * by[1] + axes[2] * by[2]
}

/// A cluster in the coordinates of its parent.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The cluster.
    pub cluster: u32,
    /// \[M\] its control points.
    pub point: Vec<Coordinates>,
    /// Its axis and its side, along the parent's T and turned N and B where its root is bound.
    pub root: [[f64; 3]; 2],
    /// Its scales as they were.
    pub scale: [Curve; 2],
    /// Section of the parent at each station of these, and its girth there, scene units: 0 where it is flat, and the
    /// scale stays.
    pub girth: [Vec<[f64; 2]>; 2],
}

impl Bound {
    /// `child` in the coordinates of `parent`.
    pub fn new(cluster: u32, child: &Cylinder, parent: &Shape) -> Result<Self, String> {
        let own = Shape::new(child)?;
        let way = own.skeleton().length() / parent.skeleton().length();
        let first = coordinates(parent, child.control[0], 0.0).t;
        let t = own.skeleton().control_t();
        let point: Vec<Coordinates> =
            child.control.iter().zip(&t).map(|(p, t)| coordinates(parent, *p, first + way * t)).collect();
        let axes = parent.section(point[0].t).turned_axes();
        let at = |s: &f64| section_of(&point, &t, *s);
        let wide = |girth: f64| if girth > FLAT * parent.widest() { girth } else { 0.0 };
        let girth = |c: &Curve| c.t.iter().map(at).map(|t| [t, wide(parent.section(t).girth())]).collect();
        Ok(Bound {
            cluster,
            root: [child.axis, child.side].map(|v| axes.map(|a| a.dot(&v))),
            girth: [girth(&child.scale[0]), girth(&child.scale[1])],
            scale: child.scale.clone(),
            point,
        })
    }

    /// `child`, which was bound to a parent, where the parent is now. Where the parent has become wider or narrower,
    /// its scales follow.
    pub fn updated(&self, child: &Cylinder, parent: &Shape) -> Cylinder {
        let mut out = child.clone();
        out.control = self.point.iter().map(|c| position(parent, c)).collect();
        let axes = parent.section(self.point[0].t).turned_axes();
        [out.axis, out.side] = self.root.map(|v| sum(axes, v));
        for ((to, from), girth) in out.scale.iter_mut().zip(&self.scale).zip(&self.girth) {
            *to = from.clone();
            for (v, [t, before]) in to.value.iter_mut().zip(girth) {
                let now = parent.section(*t).girth();
                *v *= if *before > 0.0 { now / before } else { 1.0 };
            }
        }
        out
    }
}

/// Section of the parent at a child's parameter `s`, between those of the control points at `t`.
fn section_of(point: &[Coordinates], t: &[f64], s: f64) -> f64 {
    let k = t.partition_point(|t| *t <= s).clamp(1, t.len() - 1);
    let f = ((s - t[k - 1]) / (t[k] - t[k - 1])).clamp(0.0, 1.0);
    point[k - 1].t + (point[k].t - point[k - 1].t) * f
}

/// Binds all that was split from a cluster, each to its own parent, before the cluster is edited.
pub fn bind(tree: &Tree, cluster: u32) -> Result<Vec<Bound>, String> {
    tree.of(cluster)?;
    let of = |k: u32| {
        let c = tree.of(k)?;
        Bound::new(k, &c.cylinder, &tree.shape(c.parent)?).map_err(|e| format!("cluster {k}: {e}"))
    };
    tree.below(cluster).into_iter().map(of).collect()
}

/// Brings clusters to where their parents are after an edit, parents before their children (as [`bind`] gives them). A
/// tree that can't be updated stays as it is.
pub fn update(tree: &mut Tree, bound: &[Bound]) -> Result<(), String> {
    let mut out = tree.clone();
    for b in bound {
        let c = out.of(b.cluster)?;
        if c.parent == NONE || b.point.len() != c.cylinder.control.len() {
            return Err(format!("cluster {} is not what was bound", b.cluster));
        }
        let next = b.updated(&c.cylinder, &out.shape(c.parent)?);
        Shape::new(&next).map_err(|e| format!("cluster {} after the edit: {e}", b.cluster))?;
        out.cluster[b.cluster as usize].cylinder = next;
    }
    *tree = out;
    Ok(())
}

/// Edits the cylinder of a cluster and brings along all that was split from it. A tree that can't be edited stays as it is.
pub fn edit(tree: &mut Tree, cluster: u32, change: impl FnOnce(&mut Cylinder)) -> Result<(), String> {
    let bound = bind(tree, cluster)?;
    let mut out = tree.clone();
    change(&mut out.cluster[cluster as usize].cylinder);
    out.shape(cluster)?;
    update(&mut out, &bound)?;
    *tree = out;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::test_clusters::{far, motion, plain, samples, upright};
    use super::super::{Cluster, split};
    use super::*;
    use pelage_geom::rng::uniform;

    #[test]
    fn coordinates_are_taken_back_everywhere() {
        for c in samples() {
            let shape = Shape::new(&c).expect("a shape");
            let length = shape.skeleton().length();
            let mut inside = 0;
            for k in 0..200u64 {
                let x = |i| uniform(1, k, 2, i);
                let near = shape.point(2.0 * x(0), 7.0 * x(1), x(2));
                let stray = c.control[0] + Vec3::new(x(3) - 0.5, x(4) - 0.5, x(5) - 0.5) * (3.0 * length);
                for p in [near, stray] {
                    let got = coordinates(&shape, p, x(2));
                    assert!((position(&shape, &got) - p).norm() < 1e-9 * length, "{got:?}");
                    // Nothing is left between the ends.
                    if got.t > 0.0 && got.t < 1.0 && shape.section(got.t).girth() > 0.01 * shape.widest() {
                        assert!(Vec3::from(got.beyond).norm() < 1e-9, "{got:?}");
                        inside += 1;
                    }
                }
            }
            assert!(inside > 100, "{inside}");
        }
    }

    #[test]
    fn coordinates_are_those_of_the_formula() {
        for c in samples() {
            let shape = Shape::new(&c).expect("a shape");
            for k in 0..100u64 {
                let x = |i| uniform(2, k, 2, i);
                let (r, theta, t) = (0.1 + 0.8 * x(0), 6.0 * x(1), 0.05 + 0.85 * x(2));
                let got = coordinates(&shape, shape.point(r, theta, t), t);
                let turns = (got.theta - theta) / std::f64::consts::TAU;
                let off = (got.t - t).abs() + (got.r - r).abs() + (turns - turns.round()).abs();
                assert!(off < 1e-6, "{r} {theta} {t}: {got:?}");
            }
        }
    }

    #[test]
    fn an_unchanged_parent_changes_nothing_and_a_rigid_motion_carries_all() {
        for parent in samples() {
            let size = parent.contour.radius[0];
            let mut tree = Tree { cluster: vec![Cluster { cylinder: parent.clone(), ..upright([0.0; 2], 1.0) }] };
            let children = split(&mut tree, 0, 3, 5).expect("children");
            split(&mut tree, children[1], 2, 5).expect("children");
            // A child that leaves its parent sideways and beyond both ends.
            for p in &mut tree.cluster[children[2] as usize].cylinder.control {
                *p += Vec3::new(2.0, -1.0, 1.5) * size;
            }
            let bound = bind(&tree, 0).expect("bound");
            assert_eq!(bound.len(), 5);
            let mut same = tree.clone();
            update(&mut same, &bound).expect("updated");
            assert!(far(&same, &tree) < 1e-9 * size, "{}", far(&same, &tree));

            let by = motion();
            let mut moved = tree.clone();
            moved.cluster[0].cylinder = parent.moved(&by);
            update(&mut moved, &bound).expect("updated");
            let mut wanted = tree.clone();
            wanted.cluster.iter_mut().for_each(|c| c.cylinder = c.cylinder.moved(&by));
            assert!(far(&moved, &wanted) < 1e-9 * size, "{}", far(&moved, &wanted));
            assert!(far(&moved, &tree) > size);

            // After any edit and back, all is as it was.
            let mut edited = tree.clone();
            edited.cluster[0].cylinder.twist.value[0] += 2.0;
            edited.cluster[0].cylinder.control[1] += Vec3::new(1.0, 0.5, 0.2) * size;
            edited.cluster[0].cylinder.scale[0].value[0] *= 2.0;
            update(&mut edited, &bound).expect("updated");
            assert!(far(&edited, &tree) > 0.1 * size);
            edited.cluster[0].cylinder = parent;
            update(&mut edited, &bound).expect("updated");
            assert!(far(&edited, &tree) < 1e-9 * size);
        }
    }

    #[test]
    fn a_wider_parent_has_wider_children_farther_out() {
        let mut tree = Tree { cluster: vec![upright([0.0; 2], 1.0)] };
        split(&mut tree, 0, 4, 5).expect("children");
        let before = tree.clone();
        let bound = bind(&tree, 0).expect("bound");
        tree.cluster[0].cylinder.scale = [0, 1].map(|_| Curve { t: vec![0.0, 1.0], value: vec![1.0, 3.0] });
        update(&mut tree, &bound).expect("updated");
        for k in 1..5 {
            let (now, was) = (&tree.cluster[k].cylinder, &before.cluster[k].cylinder);
            for (p, q) in now.control.iter().zip(&was.control) {
                let wider = 1.0 + 2.0 * q.z / was.control[4].z;
                assert!((p - Vec3::new(q.x * wider, q.y * wider, q.z)).norm() < 1e-9);
            }
            let (a, b) = (Shape::new(now).expect("a shape"), Shape::new(was).expect("a shape"));
            assert!((a.section(1.0).girth() / b.section(1.0).girth() - 3.0).abs() < 1e-9);
            assert!((a.section(0.0).girth() / b.section(0.0).girth() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn children_of_a_curl_stay_with_their_turn() {
        // A tight curl, whose turns lie nearer to each other than its width.
        let curl = |k: usize| {
            let a = 0.6 * k as f64;
            Vec3::new(libm::cos(a), libm::sin(a), 0.05 * a)
        };
        let c = plain((0..40).map(curl).collect(), 0.4);
        let shape = Shape::new(&c).expect("a shape");
        for k in 0..60 {
            let t = f64::from(k) / 60.0;
            let p = shape.point(1.0, 1.1, t);
            assert!((coordinates(&shape, p, (t + 0.03).min(1.0)).t - t).abs() < 1e-6, "{t}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let mut tree = Tree { cluster: vec![upright([0.0; 2], 1.0)] };
        split(&mut tree, 0, 2, 4).expect("children");
        assert!(bind(&tree, 9).unwrap_err().contains("no cluster 9"));
        let bound = bind(&tree, 0).expect("bound");
        let before = tree.clone();
        tree.cluster[2].cylinder.control.pop();
        let changed = tree.clone();
        assert!(update(&mut tree, &bound).unwrap_err().contains("cluster 2 is not what was bound"));
        assert!(tree == changed && tree != before);
    }
}
