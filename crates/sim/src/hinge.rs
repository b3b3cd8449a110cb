//! Edges and hinges of a rod: curvature and twist, and their derivatives.

use crate::lanes::{L3, Lanes, add3, cross, dot, mul_add3, neg_mul_add3, scale3, sub3};

/// 1 + cosine of the angle between edges is kept above this: at 177 degrees a fold's stiffness stops growing. Smaller,
/// forces overflow in single steps; larger, folds pass through.
pub(crate) const FOLDED: f64 = 1e-3;

/// An edge's direction and inverse length.
#[derive(Clone, Copy)]
pub(crate) struct Edge<L> {
    pub(crate) t: L3<L>,
    pub(crate) inverse: L,
    pub(crate) length: L,
}

#[inline(always)]
pub(crate) fn edge<L: Lanes>(a: L3<L>, b: L3<L>) -> Edge<L> {
    let e = sub3(b, a);
    // An edge of no length has no direction: that is not a number, and its strand is held.
    let length = dot(e, e).sqrt();
    let inverse = L::splat(1.0) / length;
    Edge { t: scale3(e, inverse), inverse, length }
}

/// A hinge's measures and their derivatives. `a[k]` is the derivative of measure k by the first edge, `b[k]` by the
/// second, `turn[k]` by the turns of both.
pub(crate) struct Hinge<L> {
    pub(crate) value: [L; 3],
    pub(crate) a: [L3<L>; 3],
    pub(crate) b: [L3<L>; 3],
    pub(crate) turn: [[L; 2]; 3],
    /// By how much the mean of both frames is too short.
    pub(crate) longer: L,
    /// The share by which `longer` grows with the angle between the frames.
    pub(crate) grows: L,
}

/// Curvature factor G of the cosine c: kappa = (t0 x t1) G(c); its derivatives, and 1 / (1 + c).
#[derive(Clone, Copy)]
pub(crate) struct Factor<L> {
    pub(crate) g: L,
    pub(crate) slope: L,
    pub(crate) second: L,
    pub(crate) folded: L,
}

/// Curvature factor at a cosine.
#[inline(always)]
pub(crate) fn angle_factor<L: Lanes>(c: L) -> Factor<L> {
    // With q = tan^2(angle / 2): angle / sin(angle) = (1 + q) (15 + 4 q) / (15 + 9 q), a Pade approximant.
    let p = (c + L::splat(1.0)).max(L::splat(FOLDED));
    let n = L::splat(11.0).mul_add(p, L::splat(8.0));
    let d = p * L::splat(3.0).mul_add(p, L::splat(9.0));
    let inverse = L::splat(1.0) / d;
    let g = n * inverse;
    let rise = L::splat(6.0).mul_add(p, L::splat(9.0));
    let slope = (L::splat(11.0) - g * rise) * inverse;
    let second = -((slope + slope).mul_add(rise, L::splat(6.0) * g) * inverse);
    Factor { g, slope, second, folded: L::splat(1.0) / p }
}

/// The gradient of (t0 x t1) . d G by both edges.
#[inline(always)]
pub(crate) fn bend_gradient<L: Lanes>(
    e0: &Edge<L>,
    e1: &Edge<L>,
    d: L3<L>,
    factor: &Factor<L>,
    c: L,
) -> (L, L3<L>, L3<L>) {
    let Factor { g, slope, .. } = *factor;
    let t1_d = cross(e1.t, d);
    let d_t0 = cross(d, e0.t);
    let beta = dot(e0.t, t1_d);
    let change = beta * slope;
    let along = change.mul_add(c, g * beta);
    let a = neg_mul_add3(e0.t, along, mul_add3(e1.t, change, scale3(t1_d, g)));
    let b = neg_mul_add3(e1.t, along, mul_add3(e0.t, change, scale3(d_t0, g)));
    (beta * g, scale3(a, e0.inverse), scale3(b, e1.inverse))
}

/// Curvature in the scene's axes: for hair that is straight by nature, where twist can't act.
#[inline(always)]
pub(crate) fn straight_hinge<L: Lanes>(e0: &Edge<L>, e1: &Edge<L>) -> Hinge<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let c = dot(e0.t, e1.t);
    let factor = angle_factor(c);
    let mut h = Hinge {
        value: [zero; 3],
        a: [[zero; 3]; 3],
        b: [[zero; 3]; 3],
        turn: [[zero; 2]; 3],
        longer: one,
        grows: zero,
    };
    for k in 0..3 {
        let mut d = [zero; 3];
        d[k] = one;
        (h.value[k], h.a[k], h.b[k]) = bend_gradient(e0, e1, d, &factor, c);
    }
    h
}

/// Blocks of a hinge's tangent by its two edges: first-first, first-second (rows: first edge), second-second.
pub(crate) struct Blocks<L> {
    pub(crate) aa: [L3<L>; 3],
    pub(crate) ab: [L3<L>; 3],
    pub(crate) bb: [L3<L>; 3],
}

/// How a hinge's moments act through its frames.
pub(crate) struct Moment<L> {
    /// What of the bending moment turns with each edge's frame.
    pub(crate) n: [L3<L>; 2],
    /// The energy's first and second derivative by the angle between the frames, the second through the mean frame alone.
    torque: L,
    torque_grows: L,
    /// [`Hinge::grows`].
    grows: L,
}

/// The moment of a hinge whose measures have the forces `force`.
#[inline(always)]
pub(crate) fn moment<L: Lanes>(e: [&Edge<L>; 2], m: [L3<L>; 2], h: &Hinge<L>, force: [L; 3]) -> Moment<L> {
    let [f1, f2, f3] = force;
    // Half of the moment, in each edge's frame, as long as both halves make it.
    let longer = L::splat(0.5) * h.longer;
    let n0 = scale3(neg_mul_add3(m[0], f2, scale3(cross(e[0].t, m[0]), f1)), longer);
    let n1 = scale3(neg_mul_add3(m[1], f2, scale3(cross(e[1].t, m[1]), f1)), longer);
    let bending = f1.mul_add(h.value[0], f2 * h.value[1]);
    Moment {
        n: [n0, n1],
        torque: f3.mul_add(h.turn[2][1], h.grows * bending),
        torque_grows: bending * (h.grows + h.grows).mul_add(h.grows, L::splat(0.25)),
        grows: h.grows,
    }
}

/// An entry of `a b^T + b a^T + to`.
#[inline(always)]
fn both<L: Lanes>(a: L3<L>, b: L3<L>, x: usize, y: usize, to: L) -> L {
    a[x].mul_add(b[y], b[x].mul_add(a[y], to))
}

/// What the moments add to the tangent: the second derivative by both edges of `kappa . sigma`, sigma the bending moment
/// in the scene's axes, and of the angle between the frames. Without it (Gauss-Newton) an iteration leaves a fifth of the
/// error in groomed hair, with it a hundredth.
///
/// The angle's gradients are `b / |e0|` and `b / |e1|`, b = t0 x t1 / (1 + c). Its second derivatives (M. Bergou et al.,
/// "Discrete Viscous Threads", 2010) are `-(b s^T + s b^T) / (2 |e0|^2)`, s = t0 + (t0 + t1) / (1 + c), for the
/// first edge, so for the second, and `([t0]x (1 - t1 t1^T) - b r^T) / (1 + c) / (|e0| |e1|)`, r = t0 - c t1, for both. They
/// have the form of those of curvature and go into the same products.
#[inline(always)]
pub(crate) fn second<L: Lanes>(e0: &Edge<L>, e1: &Edge<L>, sigma: L3<L>, moment: Option<Moment<L>>) -> Blocks<L> {
    let zero = L::splat(0.0);
    let half = L::splat(0.5);
    let (t0, t1) = (e0.t, e1.t);
    let c = dot(t0, t1);
    let Factor { g, slope, second, folded } = angle_factor(c);
    let (t1_s, s_t0) = (cross(t1, sigma), cross(sigma, t0));
    let beta = dot(t0, t1_s);
    let (curve, bend) = (half * beta * second, beta * slope);
    let along = bend.mul_add(c, g * beta);
    // Everything across its own edge.
    let (p, r) = (neg_mul_add3(t0, c, t1), neg_mul_add3(t1, c, t0));
    let (q0, q1) = (neg_mul_add3(t0, beta, t1_s), neg_mul_add3(t1, beta, s_t0));
    let u = mul_add3(p, bend, scale3(q0, g));
    let w = mul_add3(r, bend, scale3(q1, g));
    let (p0, r1) = (mul_add3(p, curve, scale3(q0, slope)), mul_add3(r, curve, scale3(q1, slope)));
    let (u0, w1) = (neg_mul_add3(t0, half * along, u), neg_mul_add3(t1, half * along, w));
    let (mut left, mut s) = (p0, scale3(sigma, -g));
    let binormal = cross(t0, t1);
    // No closures here: one that is not inlined is compiled without wide registers.
    let mut frames = None;
    if let Some(m) = moment {
        let (torque, grows) = (m.torque * folded, m.grows * folded);
        let more = scale3(binormal, half * m.torque_grows * folded * folded);
        let (u, w) = (mul_add3(u, grows, more), mul_add3(w, grows, more));
        let sum = scale3(add3(t0, t1), folded);
        let (n, g, torque_half) = (m.n, half * g, half * torque);
        left = neg_mul_add3(binormal, torque * folded, left);
        s = mul_add3(t0, torque, s);
        let a = mul_add3(n[0], g, neg_mul_add3(add3(t0, sum), torque_half, u));
        let b = mul_add3(n[1], g, neg_mul_add3(add3(t1, sum), torque_half, w));
        frames = Some((a, u, w, b));
    }
    // The star of s across both edges, and the identity.
    let ahead = neg_mul_add3(t1, along, mul_add3(t0, bend, cross(t0, s)));
    let behind = mul_add3(t1, bend, cross(s, t1));
    let star = [[bend, -s[2], s[1]], [s[2], bend, -s[0]], [-s[1], s[0], bend]];
    let (i00, i01, i11) = (e0.inverse * e0.inverse, e0.inverse * e1.inverse, e1.inverse * e1.inverse);
    // Every entry is set below; zeros here would become a call of memset.
    let mut out = Blocks { aa: [[half; 3]; 3], ab: [[half; 3]; 3], bb: [[half; 3]; 3] };
    for x in 0..3 {
        for y in 0..3 {
            if y <= x {
                let start = if x == y { -along } else { zero };
                let mut a = t0[x].neg_mul_add(u0[y], u0[x].neg_mul_add(t0[y], start));
                let mut b = t1[x].neg_mul_add(w1[y], w1[x].neg_mul_add(t1[y], start));
                (a, b) = (both(p, p0, x, y, a), both(r, r1, x, y, b));
                if let Some((m, _, _, n)) = frames {
                    (a, b) = (both(binormal, m, x, y, a), both(binormal, n, x, y, b));
                }
                (out.aa[x][y], out.bb[x][y]) = (a * i00, b * i11);
                (out.aa[y][x], out.bb[y][x]) = (out.aa[x][y], out.bb[x][y]);
            }
            let across = t0[x].neg_mul_add(ahead[y], behind[x].neg_mul_add(t1[y], star[x][y]));
            let mut ab = left[x].mul_add(r[y], p[x].mul_add(r1[y], across));
            if let Some((_, u, w, _)) = frames {
                ab = u[x].mul_add(binormal[y], binormal[x].mul_add(w[y], ab));
            }
            out.ab[x][y] = ab * i01;
        }
    }
    out
}

/// Parallel transport of `m` from direction `t0` to `t1`; `folded` is 1 / (1 + cosine).
#[inline(always)]
pub(crate) fn transport<L: Lanes>(m: L3<L>, t0: L3<L>, t1: L3<L>, folded: L) -> L3<L> {
    neg_mul_add3(add3(t0, t1), dot(m, t1) * folded, m)
}

/// Curvature in both material directions and twist.
#[inline(always)]
pub(crate) fn twisting_hinge<L: Lanes>(e0: &Edge<L>, e1: &Edge<L>, m0: L3<L>, m1: L3<L>) -> Hinge<L> {
    let (half, one) = (L::splat(0.5), L::splat(1.0));
    let c = dot(e0.t, e1.t);
    let factor = angle_factor(c);
    let folded = factor.folded;
    let n0 = cross(e0.t, m0);
    let n1 = cross(e1.t, m1);
    // Twist: from the transported frame of the first edge to that of the second.
    let p = transport(m0, e0.t, e1.t, folded);
    let tan = -dot(p, n1) / (dot(p, m1) + one).max(L::splat(FOLDED));
    let q = tan * tan;
    let d = one / L::splat(9.0).mul_add(q, L::splat(15.0));
    let twist = tan * L::splat(8.0).mul_add(q, L::splat(30.0)) * d;
    let by_tan = (L::splat(24.0).mul_add(q, L::splat(30.0)) - twist * L::splat(18.0) * tan) * d;
    let by_angle = by_tan * half * (q + one);
    let binormal = scale3(cross(e0.t, e1.t), folded);
    let (turn0, turn1) = (scale3(binormal, e0.inverse), scale3(binormal, e1.inverse));
    // Directions half-way between the frames, of length 1 in the plane that matters.
    let longer = (q + one).sqrt();
    let d1 = scale3(add3(n0, n1), half * longer);
    let d2 = scale3(add3(m0, m1), -(half * longer));
    let (k1, a1, b1) = bend_gradient(e0, e1, d1, &factor, c);
    let (k2, a2, b2) = bend_gradient(e0, e1, d2, &factor, c);
    let (f1, f2) = (half * tan * k1, half * tan * k2);
    let (h1, h2) = (half * k1, half * k2);
    Hinge {
        value: [k1, k2, twist],
        a: [mul_add3(turn0, f1, a1), mul_add3(turn0, f2, a2), scale3(turn0, by_angle)],
        b: [mul_add3(turn1, f1, b1), mul_add3(turn1, f2, b2), scale3(turn1, by_angle)],
        turn: [[h2, h2], [-h1, -h1], [-by_angle, by_angle]],
        longer,
        grows: half * tan,
    }
}

/// A frame near `guess` on the edge `old`, carried in parallel to the edge `new` and turned.
#[cfg(test)]
pub(crate) fn moved_frame(
    old: [[f64; 3]; 2],
    new: [[f64; 3]; 2],
    guess: [f64; 3],
    turn: f64,
) -> L3<crate::lanes::Plain> {
    use crate::lanes::Plain;
    let along = |x: [[f64; 3]; 2]| edge(x[0].map(Plain::splat), x[1].map(Plain::splat)).t;
    let (old, new, guess) = (along(old), along(new), guess.map(Plain::splat));
    let m = neg_mul_add3(old, dot(old, guess), guess);
    let m = scale3(m, Plain::splat(1.0) / dot(m, m).sqrt());
    let folded = Plain::splat(1.0) / (dot(old, new) + Plain::splat(1.0));
    let m = transport(m, old, new, folded);
    let (s, c) = (libm::sin(turn), libm::cos(turn));
    mul_add3(cross(new, m), Plain::splat(s), scale3(m, Plain::splat(c)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Pack, Plain};

    fn value(v: Plain) -> f64 {
        let mut p = Pack::default();
        v.store(&mut p);
        p.0[0]
    }

    fn lanes3(v: [f64; 3]) -> L3<Plain> {
        v.map(Plain::splat)
    }

    /// Measures after moving three nodes and turning both frames, frames carried by parallel transport.
    fn moved(d: &[f64; 11]) -> Hinge<Plain> {
        let x = [[0.0, 0.0, 0.0], [1.1, 0.2, -0.1], [1.9, 0.9, 0.3]];
        let at = |k: usize| -> [f64; 3] { std::array::from_fn(|c| x[k][c] + d[3 * k + c]) };
        let after = [0, 1].map(|k| edge(lanes3(at(k)), lanes3(at(k + 1))));
        let frame = |k: usize, guess: [f64; 3]| moved_frame([x[k], x[k + 1]], [at(k), at(k + 1)], guess, d[9 + k]);
        let (m0, m1) = (frame(0, [0.1, 1.0, 0.4]), frame(1, [-0.3, 0.5, 0.9]));
        twisting_hinge(&after[0], &after[1], m0, m1)
    }

    #[test]
    fn derivatives_of_the_measures_are_their_finite_differences() {
        let h = moved(&[0.0; 11]);
        for k in 0..3 {
            for q in 0..11 {
                let e = 1e-6;
                let shifted = |s: f64| {
                    let mut d = [0.0; 11];
                    d[q] = s;
                    value(moved(&d).value[k])
                };
                let difference = (shifted(e) - shifted(-e)) / (2.0 * e);
                let (node, c) = (q / 3, q % 3);
                let (a, b) = (value(h.a[k][c % 3]), value(h.b[k][c % 3]));
                let exact = match node {
                    0 => -a,
                    1 => a - b,
                    2 => b,
                    _ => value(h.turn[k][q - 9]),
                };
                assert!((difference - exact).abs() < 2e-8, "measure {k}, unknown {q}: {exact} against {difference}");
            }
        }
    }

    #[test]
    fn measures_are_the_angle_and_the_twist() {
        for angle in [0.0, 0.05, 0.3, 0.8, 1.2] {
            for twist in [0.0, -0.2, 0.7] {
                let (s, c) = (libm::sin(angle), libm::cos(angle));
                let e0 = edge(lanes3([0.0; 3]), lanes3([1.0, 0.0, 0.0]));
                let e1 = edge(lanes3([0.0; 3]), lanes3([c, s, 0.0]));
                // Frames: z turned by a start angle, and by the twist more.
                let frame = |t: [f64; 3], turn: f64| {
                    let side = cross(lanes3(t), lanes3([0.0, 0.0, 1.0]));
                    mul_add3(side, Plain::splat(libm::sin(turn)), lanes3([0.0, 0.0, libm::cos(turn)]))
                };
                let h = twisting_hinge(&e0, &e1, frame([1.0, 0.0, 0.0], 0.4), frame([c, s, 0.0], 0.4 + twist));
                let [k1, k2, m] = h.value.map(value);
                let bend = (k1 * k1 + k2 * k2).sqrt();
                let bound = if angle < 1.0 { 2e-4 } else { 2e-3 };
                assert!((bend - angle).abs() < bound * angle.max(1e-9), "{bend} against {angle}");
                assert!((m - twist).abs() < 1e-4 * twist.abs().max(1e-9), "{m} against {twist}");
            }
        }
    }
}
