//! Direct solution of a strand's block-banded symmetric system, eight strands at a time.
//!
//! A strand's matrix couples a node only with the next few, so `L D L^T` without exchange of rows costs O(n). Pivots are
//! scalar: an explicit inverse of the diagonal blocks loses all accuracy when stretching is 1e5 times stiffer than
//! inertia. Columns are eliminated while they are assembled, in a ring of [`RING`] panels, so the matrix itself is never
//! stored; the factor is written once and read once.

use crate::lanes::{Lanes, Pack};

/// Panels that are open at a time: a column couples with at most three later ones.
pub const RING: usize = 4;

/// Added to the diagonal of an unknown that is held: the pivot becomes so large that the unknown stays 0 to the last
/// bit of anything physical. Above 1e150 squares overflow; below 1e20 the stiffest springs would show.
pub const HELD: f64 = 1e40;

/// The lower triangle of a block column: `ROWS` rows from the diagonal block on down, `D` unknowns a node.
#[derive(Clone, Copy)]
pub struct Panel<L, const D: usize, const ROWS: usize>(pub [[L; D]; ROWS]);

impl<L: Lanes, const D: usize, const ROWS: usize> Panel<L, D, ROWS> {
    /// All zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Panel([[L::splat(0.0); D]; ROWS])
    }
}

/// The open panels: column `j` is `window[j % RING]`.
pub type Window<L, const D: usize, const ROWS: usize> = [Panel<L, D, ROWS>; RING];

/// A factored block column in memory: below the diagonal the factor, on it the inverse pivots.
pub type Column<const D: usize, const ROWS: usize> = [[Pack; D]; ROWS];

/// Eliminates block column `j`: writes its factor, updates the later panels and right-hand sides.
///
/// `rhs[j]` becomes the solution of the forward and diagonal parts; `rhs` must reach `ROWS / D` nodes beyond `j`.
#[inline(always)]
pub fn eliminate<L: Lanes, const D: usize, const ROWS: usize>(
    j: usize,
    window: &mut Window<L, D, ROWS>,
    factor: &mut Column<D, ROWS>,
    rhs: &mut [[Pack; D]],
) {
    let one = L::splat(1.0);
    let here = j % RING;
    // In place and entry by entry: whole panels do not fit the registers, and copying them costs as much as the sums.
    for c in 0..D {
        let inverse = one / window[here].0[c][c];
        inverse.store(&mut factor[c][c]);
        for r in c + 1..ROWS {
            (window[here].0[r][c] * inverse).store(&mut factor[r][c]);
        }
        for k in c + 1..D {
            let u = window[here].0[k][c];
            for r in k..ROWS {
                window[here].0[r][k] = L::load(&factor[r][c]).neg_mul_add(u, window[here].0[r][k]);
            }
        }
    }
    for c in 0..D {
        let y = L::load(&rhs[j][c]);
        for r in c + 1..D {
            let l = L::load(&factor[r][c]);
            l.neg_mul_add(y, L::load(&rhs[j][r])).store(&mut rhs[j][r]);
        }
    }
    let mut first = D;
    let mut next = j + 1;
    while first < ROWS {
        let width = if ROWS - first < D { ROWS - first } else { D };
        for r in first..ROWS {
            let to = r - first;
            for k in 0..width {
                if to >= k {
                    let mut sum = window[next % RING].0[to][k];
                    for c in 0..D {
                        sum = L::load(&factor[r][c]).neg_mul_add(window[here].0[first + k][c], sum);
                    }
                    window[next % RING].0[to][k] = sum;
                }
            }
        }
        for k in 0..width {
            let mut sum = L::load(&rhs[next][k]);
            for c in 0..D {
                sum = L::load(&factor[first + k][c]).neg_mul_add(L::load(&rhs[j][c]), sum);
            }
            sum.store(&mut rhs[next][k]);
        }
        first += D;
        next += 1;
    }
    for c in 0..D {
        (L::load(&rhs[j][c]) * L::load(&factor[c][c])).store(&mut rhs[j][c]);
    }
}

/// Back substitution for node `j`, after the nodes behind it: on return `rhs[j]` holds the solution.
#[inline(always)]
pub fn substitute<L: Lanes, const D: usize, const ROWS: usize>(
    j: usize,
    factor: &Column<D, ROWS>,
    rhs: &mut [[Pack; D]],
) {
    let mut x = [L::splat(0.0); D];
    for c in 0..D {
        x[c] = L::load(&rhs[j][c]);
    }
    for r in (D..ROWS).rev() {
        let known = L::load(&rhs[j + r / D][r % D]);
        for c in 0..D {
            x[c] = L::load(&factor[r][c]).neg_mul_add(known, x[c]);
        }
    }
    for r in (1..D).rev() {
        for c in 0..r {
            x[c] = L::load(&factor[r][c]).neg_mul_add(x[r], x[c]);
        }
    }
    for c in 0..D {
        x[c].store(&mut rhs[j][c]);
    }
}

/// Solution with an existing factor: forward, diagonal, backward. `rhs` must reach `ROWS / D` nodes beyond the last.
#[inline(always)]
pub fn solve<L: Lanes, const D: usize, const ROWS: usize>(factor: &[Column<D, ROWS>], rhs: &mut [[Pack; D]]) {
    for j in 0..factor.len() {
        let f = &factor[j];
        let mut y = [L::splat(0.0); D];
        for c in 0..D {
            y[c] = L::load(&rhs[j][c]);
        }
        for c in 0..D {
            for r in c + 1..D {
                y[r] = L::load(&f[r][c]).neg_mul_add(y[c], y[r]);
            }
        }
        for r in D..ROWS {
            let to = &mut rhs[j + r / D][r % D];
            let mut sum = L::load(to);
            for c in 0..D {
                sum = L::load(&f[r][c]).neg_mul_add(y[c], sum);
            }
            sum.store(to);
        }
        for c in 0..D {
            (y[c] * L::load(&f[c][c])).store(&mut rhs[j][c]);
        }
    }
    for j in (0..factor.len()).rev() {
        substitute::<L, D, ROWS>(j, &factor[j], rhs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{self, Kernel, LANES, Width};
    use nalgebra::{DMatrix, DVector};
    use pelage_geom::rng;

    /// Random banded positive definite systems, one a lane.
    struct Systems<const D: usize, const ROWS: usize> {
        n: usize,
        columns: Vec<Column<D, ROWS>>,
        rhs: Vec<[Pack; D]>,
    }

    fn systems<const D: usize, const ROWS: usize>(n: usize, stiff: f64) -> Systems<D, ROWS> {
        let pad = ROWS.div_ceil(D);
        let mut columns = vec![[[Pack::default(); D]; ROWS]; n];
        let mut rhs = vec![[Pack::default(); D]; n + pad];
        for lane in 0..LANES {
            let u = |step: usize| rng::uniform(3, lane as u64, 2, step as u64) - 0.5;
            // A sum of g g^T over overlapping windows of unknowns is positive semidefinite and has the band.
            for j in 0..n {
                for c in 0..D {
                    columns[j][c][c].0[lane] += 1.0;
                    rhs[j][c].0[lane] = u(j * D + c);
                }
            }
            for j in 0..n {
                let rows = ROWS.min((n - j) * D);
                for k in 0..3 {
                    let g: Vec<f64> = (0..rows).map(|r| u(1000 + (j * 3 + k) * ROWS + r)).collect();
                    let weight = if k == 0 { stiff } else { 1.0 };
                    for a in 0..rows {
                        for b in 0..=a {
                            columns[j + b / D][a - b / D * D][b % D].0[lane] += weight * g[a] * g[b];
                        }
                    }
                }
            }
        }
        Systems { n, columns, rhs }
    }

    struct Solve<'a, const D: usize, const ROWS: usize>(&'a Systems<D, ROWS>);

    impl<const D: usize, const ROWS: usize> Kernel for Solve<'_, D, ROWS> {
        type Out = (Vec<[Pack; D]>, Vec<[Pack; D]>);
        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Out {
            let s = self.0;
            let mut rhs = s.rhs.clone();
            let mut factor = vec![[[Pack::default(); D]; ROWS]; s.n];
            let load = |j: usize| {
                let mut p = Panel::<L, D, ROWS>::zero();
                for r in 0..ROWS {
                    for c in 0..D {
                        p.0[r][c] = if j < s.n { L::load(&s.columns[j][r][c]) } else { L::splat(0.0) };
                    }
                }
                p
            };
            let mut window: Window<L, D, ROWS> = std::array::from_fn(load);
            for j in 0..s.n {
                eliminate::<L, D, ROWS>(j, &mut window, &mut factor[j], &mut rhs);
                window[j % RING] = load(j + RING);
            }
            for r in &mut rhs[s.n..] {
                *r = [Pack::default(); D];
            }
            for j in (0..s.n).rev() {
                substitute::<L, D, ROWS>(j, &factor[j], &mut rhs);
            }
            let mut again = s.rhs.clone();
            for r in &mut again[s.n..] {
                *r = [Pack::default(); D];
            }
            solve::<L, D, ROWS>(&factor, &mut again);
            (rhs, again)
        }
    }

    fn check<const D: usize, const ROWS: usize>(stiff: f64, bound: f64) {
        let s = systems::<D, ROWS>(23, stiff);
        let plain = lanes::run(Width::Plain, Solve(&s));
        for w in Width::available() {
            assert_eq!(lanes::run(w, Solve(&s)), plain, "{w:?}");
        }
        for lane in 0..LANES {
            let size = s.n * D;
            let mut a = DMatrix::<f64>::zeros(size, size);
            let b = DVector::from_fn(size, |i, _| s.rhs[i / D][i % D].0[lane]);
            for j in 0..s.n {
                for r in 0..ROWS.min(size - j * D) {
                    for c in 0..D {
                        if r >= c {
                            a[(j * D + r, j * D + c)] = s.columns[j][r][c].0[lane];
                            a[(j * D + c, j * D + r)] = s.columns[j][r][c].0[lane];
                        }
                    }
                }
            }
            for found in [&plain.0, &plain.1] {
                let x = DVector::from_fn(size, |i, _| found[i / D][i % D].0[lane]);
                let residual = (&a * &x - &b).norm() / (a.norm() * x.norm());
                assert!(residual < bound, "D {D} rows {ROWS} lane {lane}: {residual:e}");
            }
        }
    }

    #[test]
    fn solutions_satisfy_their_systems_at_every_width() {
        for stiff in [1.0, 1e6] {
            check::<3, 12>(stiff, 1e-14);
            check::<3, 9>(stiff, 1e-14);
            check::<4, 11>(stiff, 1e-14);
        }
    }
}
