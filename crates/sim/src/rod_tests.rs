use super::*;
use crate::hinge::moved_frame;
use crate::lanes::Plain;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

const H: f64 = 0.1;
const MASS: f64 = 1.0;

/// Two edges, bent and twisted away from their natural shape and stretched a little.
fn elastic(bend: f64, twist: f64) -> (Vec<Node>, Vec<Elastic>) {
    let (mass, spin) = (Pack::splat(MASS), Pack::splat(MASS));
    let nodes = [1.1, 1.0, 0.0].map(|l| Node { mass, length: Pack::splat(l), ..Node::default() });
    let stretch = Pack::splat(3.0);
    let end = Elastic { stretch, spin, ..Elastic::default() };
    let rest = [0.05, -0.1, 0.03].map(Pack::splat);
    let hinge = Elastic { bend: Pack::splat(bend), twist: Pack::splat(twist), rest, ..end };
    (nodes.to_vec(), vec![end, hinge, end])
}

/// Three nodes and two turns moved by `d` from a bent pose with `twist` between the frames, in radians.
fn pose(twist: f64, d: &DVector<f64>) -> Vec<Motion> {
    let x = [[0.0, 0.0, 0.0], [1.1, 0.2, -0.1], [1.9, 0.9, 0.3]];
    let at = |k: usize| -> [f64; 3] { std::array::from_fn(|c| x[k][c] + d[4 * k + c]) };
    (0..3)
        .map(|k| {
            let mut m = Motion { x: at(k).map(Pack::splat), ..Motion::default() };
            if k < 2 {
                let turn = d[4 * k + 3] + if k == 1 { twist } else { 0.0 };
                let frame = moved_frame([x[k], x[k + 1]], [at(k), at(k + 1)], [0.1, 1.0, 0.4], turn);
                store3(frame, &mut m.m);
            }
            m
        })
        .collect()
}

/// The gradient at `motion`, and if asked for the tangent, inertia left out.
fn assembled(model: &(Vec<Node>, Vec<Elastic>), motion: &[Motion], tangent: bool) -> (DVector<f64>, DMatrix<f64>) {
    let mut scratch = Scratch::<4, 11>::default();
    scratch.reserve(3);
    let at: Vec<[Pack; 3]> = motion.iter().map(|m| m.x).collect();
    for i in 0..2 {
        let edge = edge::<Plain>(load3(&at[i]), load3(&at[i + 1]));
        let (rest, stretch) = (Plain::load(&model.0[i].length), Plain::load(&model.1[i].stretch));
        (stretch * (edge.length - rest)).store(&mut scratch.pull[i]);
    }
    let turned = [Pack::default(); 3];
    let mut run = |eliminate: bool| {
        let mut stage = Stage::free(H, &at, &at);
        let damping = Damping(0.0);
        if eliminate {
            sweep::<Plain, 4, 11, true>(&model.0, &model.1, motion, &turned, damping, &mut stage, &mut scratch);
        } else {
            sweep::<Plain, 4, 11, false>(&model.0, &model.1, motion, &turned, damping, &mut stage, &mut scratch);
        }
        scratch.clone()
    };
    let rhs = run(false).rhs;
    let gradient = DVector::from_fn(12, |i, _| -rhs[i / 4][i % 4].0[0]);
    if !tangent {
        return (gradient, DMatrix::zeros(0, 0));
    }
    let factor = run(true).factor;
    let entry = |r: usize, c: usize| factor[c / 4][r - c / 4 * 4][c % 4].0[0];
    let lower = DMatrix::from_fn(12, 12, |r, c| match r {
        _ if r == c => 1.0,
        _ if r > c && r - c / 4 * 4 < 11 => entry(r, c),
        _ => 0.0,
    });
    let pivots = DMatrix::from_diagonal(&DVector::from_fn(12, |i, _| 1.0 / entry(i, i)));
    assert!((0..12).all(|i| pivots[(i, i)] > 0.0));
    (gradient, &lower * pivots * lower.transpose() - DMatrix::identity(12, 12) * (MASS / (H * H)))
}

#[test]
fn the_tangent_is_the_gradients_finite_difference() {
    for (twist, bend, stiff, bound) in
        [(0.1, 1.0, 0.0, 1e-8), (0.1, 0.8, 0.7, 1e-5), (0.8, 1.0, 0.0, 1e-8), (0.8, 0.8, 0.7, 2e-3)]
    {
        let model = elastic(bend, stiff);
        let none = DVector::zeros(12);
        let motion = pose(twist, &none);
        let (gradient, tangent) = assembled(&model, &motion, true);
        let e = 1e-5;
        let mut difference = DMatrix::zeros(12, 12);
        for q in 0..12 {
            let shifted = |s: f64| {
                let mut d = none.clone();
                d[q] = s;
                assembled(&model, &pose(twist, &d), false).0
            };
            difference.set_column(q, &((shifted(e) - shifted(-e)) / (2.0 * e)));
        }
        // Frames carried in parallel come back turned: the difference is not symmetric where an edge's turn is not in
        // balance. Its antisymmetric part is T / (2 |e|^2) [t]x by the edge, T the derivative by its turn.
        for i in 0..2 {
            let p = |k: usize| Vector3::from_fn(|c, _| motion[k].x[c].0[0]);
            let edge = p(i + 1) - p(i);
            let length = edge.norm();
            let by_edge: Matrix3<f64> =
                (edge / length).cross_matrix() * (gradient[4 * i + 3] / (2.0 * length * length));
            for (r, c, sign) in [(i, i, 1.0), (i + 1, i + 1, 1.0), (i, i + 1, -1.0), (i + 1, i, -1.0)] {
                let mut block = difference.fixed_view_mut::<3, 3>(4 * r, 4 * c);
                block -= by_edge * sign;
            }
        }
        let off = (&tangent - &difference).amax();
        println!("twist {twist} bend {bend} {stiff}: {off:.1e} of {:.1}", difference.amax());
        // All of bending; of twisting, what is left out is how its measure departs from the angle.
        assert!(off < bound && difference.amax() > 1.0 && gradient.amax() > 0.1);
    }
}
