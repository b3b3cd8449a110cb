//! What a linear solve costs: counted operations, and conjugate gradients on the same systems.
//!
//! `cargo run --release -p pelage-sim --example solver_speed`
#![allow(missing_docs, clippy::disallowed_methods, clippy::needless_range_loop)]

use pelage_sim::End;
use pelage_sim::band::{self, Column, HELD, Panel, RING, Window};
use pelage_sim::group::Strand;
use pelage_sim::lanes::{self, Kernel, LANES, Lanes, Pack, Width};
use pelage_sim::rig::{GRAVITY, Rig};
use pelage_sim::rod::{self, Damping, Scratch};
use pelage_sim::springs::calibrate::{Section, calibrate};
use pelage_sim::springs::layout::zigzag;
use pelage_sim::springs::plain;
use pelage_sim::stage::Stage;
use pelage_sim::{Material, Settings, Vec3, settle};
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::time::Instant;

thread_local! {
    /// Floating-point operations: a fused multiply-add counts two, a division or a square root one.
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn count(by: u64) {
    COUNT.with(|c| c.set(c.get() + by));
}

/// The first lane only; counts what is done.
#[derive(Clone, Copy)]
struct Counting(f64);

macro_rules! counted {
    ($($name:ident $method:ident $op:tt),*) => {$(
        impl $name for Counting {
            type Output = Counting;
            fn $method(self, b: Counting) -> Counting {
                count(1);
                Counting(self.0 $op b.0)
            }
        }
    )*};
}
counted!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for Counting {
    type Output = Counting;
    fn neg(self) -> Counting {
        Counting(-self.0)
    }
}

impl Lanes for Counting {
    fn splat(v: f64) -> Self {
        Counting(v)
    }
    fn load(p: &Pack) -> Self {
        Counting(p.0[0])
    }
    fn store(self, p: &mut Pack) {
        p.0[0] = self.0;
    }
    fn mul_add(self, b: Self, c: Self) -> Self {
        count(2);
        Counting(self.0.mul_add(b.0, c.0))
    }
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        count(2);
        Counting((-self.0).mul_add(b.0, c.0))
    }
    fn sqrt(self) -> Self {
        count(1);
        Counting(self.0.sqrt())
    }
    fn if_gt(a: Self, b: Self, x: Self, y: Self) -> Self {
        if a.0 > b.0 { x } else { y }
    }
}

/// Symmetric banded systems in lanes.
struct System<const D: usize, const ROWS: usize> {
    column: Vec<Column<D, ROWS>>,
    rhs: Vec<[Pack; D]>,
}

/// Elimination and substitution of an assembled system; the solution.
struct Direct<'a, const D: usize, const ROWS: usize>(
    &'a System<D, ROWS>,
    &'a mut [Column<D, ROWS>],
    &'a mut [[Pack; D]],
);

impl<const D: usize, const ROWS: usize> Kernel for Direct<'_, D, ROWS> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Direct(s, factor, rhs) = self;
        rhs.copy_from_slice(&s.rhs);
        let load = |j: usize| {
            let mut p = Panel::<L, D, ROWS>::zero();
            if j < s.column.len() {
                for r in 0..ROWS {
                    for c in 0..D {
                        p.0[r][c] = L::load(&s.column[j][r][c]);
                    }
                }
            }
            p
        };
        let mut window: Window<L, D, ROWS> = std::array::from_fn(load);
        let n = s.column.len();
        for j in 0..n {
            band::eliminate(j, &mut window, &mut factor[j], rhs);
            window[j % RING] = load(j + RING);
        }
        rhs[n..].fill([Pack::default(); D]);
        for j in (0..n).rev() {
            band::substitute::<L, D, ROWS>(j, &factor[j], rhs);
        }
    }
}

/// Conjugate gradients with the diagonal as preconditioner, each lane a system of its own, until in every lane the
/// residual is `tolerance` of the right-hand side. Returns the iterations.
struct Gradients<'a, const D: usize, const ROWS: usize> {
    system: &'a System<D, ROWS>,
    x: &'a mut [[Pack; D]],
    tolerance: f64,
    most: usize,
}

#[inline(always)]
fn multiply<L: Lanes, const D: usize, const ROWS: usize>(a: &[Column<D, ROWS>], x: &[[Pack; D]], y: &mut [[Pack; D]]) {
    y.fill([Pack::default(); D]);
    for (j, column) in a.iter().enumerate() {
        let here: [L; D] = std::array::from_fn(|c| L::load(&x[j][c]));
        let mut sum: [L; D] = std::array::from_fn(|c| L::load(&y[j][c]));
        for r in 0..D {
            for c in 0..D {
                sum[r] = L::load(&column[r.max(c)][r.min(c)]).mul_add(here[c], sum[r]);
            }
        }
        for r in D..ROWS {
            let (other, mut to) = (L::load(&x[j + r / D][r % D]), L::load(&y[j + r / D][r % D]));
            for c in 0..D {
                let e = L::load(&column[r][c]);
                to = e.mul_add(here[c], to);
                sum[c] = e.mul_add(other, sum[c]);
            }
            to.store(&mut y[j + r / D][r % D]);
        }
        for c in 0..D {
            sum[c].store(&mut y[j][c]);
        }
    }
}

impl<const D: usize, const ROWS: usize> Kernel for Gradients<'_, D, ROWS> {
    type Out = usize;
    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let Gradients { system: s, x, tolerance, most } = self;
        let n = s.column.len();
        let mut r = s.rhs.clone();
        let (mut z, mut p, mut q) = (r.clone(), r.clone(), r.clone());
        let zero = L::splat(0.0);
        let inverse: Vec<[Pack; D]> = (0..n)
            .map(|j| {
                std::array::from_fn(|c| {
                    let mut out = Pack::default();
                    (L::splat(1.0) / L::load(&s.column[j][c][c])).store(&mut out);
                    out
                })
            })
            .collect();
        x.fill([Pack::default(); D]);
        let mut rho = zero;
        let mut start = zero;
        for j in 0..n {
            for c in 0..D {
                let v = L::load(&r[j][c]);
                let w = v * L::load(&inverse[j][c]);
                w.store(&mut z[j][c]);
                w.store(&mut p[j][c]);
                rho = v.mul_add(w, rho);
                start = v.mul_add(v, start);
            }
        }
        let mut limit = Pack::default();
        (start * L::splat(tolerance * tolerance)).store(&mut limit);
        for k in 1..=most {
            multiply::<L, D, ROWS>(&s.column, &p, &mut q);
            let mut pq = L::splat(1e-300);
            for j in 0..n {
                for c in 0..D {
                    pq = L::load(&p[j][c]).mul_add(L::load(&q[j][c]), pq);
                }
            }
            let alpha = rho / pq;
            let (mut next, mut square) = (zero, zero);
            for j in 0..n {
                for c in 0..D {
                    alpha.mul_add(L::load(&p[j][c]), L::load(&x[j][c])).store(&mut x[j][c]);
                    let v = alpha.neg_mul_add(L::load(&q[j][c]), L::load(&r[j][c]));
                    v.store(&mut r[j][c]);
                    let w = v * L::load(&inverse[j][c]);
                    w.store(&mut z[j][c]);
                    next = v.mul_add(w, next);
                    square = v.mul_add(v, square);
                }
            }
            let mut left = Pack::default();
            square.store(&mut left);
            if (0..LANES).all(|l| left.0[l] <= limit.0[l]) {
                return k;
            }
            let beta = next / (rho + L::splat(1e-300));
            rho = next;
            for j in 0..n {
                for c in 0..D {
                    beta.mul_add(L::load(&p[j][c]), L::load(&z[j][c])).store(&mut p[j][c]);
                }
            }
        }
        most
    }
}

/// Best wall time, nanoseconds.
fn best(repeats: usize, mut work: impl FnMut()) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..repeats {
        let start = Instant::now();
        work();
        best = best.min(start.elapsed().as_secs_f64() * 1e9);
    }
    best
}

/// Compares both solvers on a system.
fn compare<const D: usize, const ROWS: usize>(name: &str, s: &System<D, ROWS>) {
    let width = Width::widest();
    let n = s.column.len();
    let mut factor = vec![[[Pack::default(); D]; ROWS]; n];
    let mut exact = s.rhs.clone();
    let direct = best(200, || lanes::run(width, Direct(s, &mut factor, &mut exact)));
    let per = (n * LANES) as f64;
    let largest = exact[..n].iter().flatten().flat_map(|p| p.0).fold(0.0f64, |a, b| a.max(b.abs()));
    let few = 100;
    let mut x = s.rhs.clone();
    let iterate = || {
        lanes::run(width, Gradients { system: s, x: &mut x, tolerance: 0.0, most: few });
    };
    let each = best(40, iterate) / few as f64;
    let solve = |tolerance: f64, most: usize| {
        let mut x = s.rhs.clone();
        let k = lanes::run(width, Gradients { system: s, x: &mut x, tolerance, most });
        let t = k as f64 * each;
        let mut off = 0.0f64;
        for (a, b) in x[..n].iter().flatten().zip(exact[..n].iter().flatten()) {
            off = (0..LANES).map(|l| (a.0[l] - b.0[l]).abs()).fold(off, f64::max);
        }
        (k, t, off / largest)
    };
    let print = |what: &str, (k, t, off): (usize, f64, f64)| {
        println!("{name},{:.1},{what},{k},{:.0},{:.0},{off:.1e}", direct / per, t / per, t / direct);
    };
    print("residual 1e-6", solve(1e-6, 20_000));
    for error in [1e-2, 1e-4, 1e-6] {
        // The fewest iterations with that error; conjugate gradients come closer with each.
        let (mut low, mut high) = (1, 20_000);
        while low < high {
            let middle = (low + high) / 2;
            if solve(0.0, middle).2 <= error { high = middle } else { low = middle + 1 }
        }
        print(&format!("error {error:.0e}"), solve(0.0, high));
    }
}

fn strands() -> Vec<Strand> {
    (0..LANES)
        .map(|k| {
            let bend = 0.2 + 0.1 * k as f64;
            let point = (0..=50).map(|i| 0.2 * f64::from(i) / 50.0).map(|s| Vec3::new(s, -bend * s * s, 0.0)).collect();
            Strand { index: k, point, material: Material::default() }
        })
        .collect()
}

/// One iteration of the rod for eight strands of 20 cm and 50 segments.
struct Iteration {
    group: pelage_sim::group::Group,
    y: Vec<[Pack; 3]>,
    base: Vec<[Pack; 3]>,
    turned: Vec<Pack>,
    h: f64,
}

impl Iteration {
    fn new(dt: f64) -> Iteration {
        let material = Material { damping: 0.0, ..Material::default() };
        let settings = Settings { material, ..Settings::default() };
        let (group, _) = settle::prepare(&strands(), &settings, [0.0, -9.81, 0.0]);
        let h = dt * (1.0 - 0.5f64.sqrt());
        let n = group.node.len();
        let base: Vec<[Pack; 3]> = group.motion.iter().map(|m| m.x).collect();
        let mut y = base.clone();
        for i in 2..n {
            for c in 0..3 {
                // It swings at up to 1 m/s.
                let v = (i as f64 / n as f64) * libm::sin(0.3 * i as f64 + c as f64);
                for l in 0..LANES {
                    y[i][c].0[l] += h * v + if c == 1 { -9.81 * h * h } else { 0.0 };
                }
            }
        }
        Iteration { turned: vec![Pack::default(); n], group, y, base, h }
    }
}

impl Iteration {
    #[inline(always)]
    fn solve<L: Lanes>(&self, scratch: &mut Scratch<4, 11>) {
        let mut stage = Stage::free(self.h, &self.y, &self.base);
        let g = &self.group;
        rod::solve::<L, 4, 11>(&g.node, &g.elastic, &g.motion, &self.turned, Damping(0.0), &mut stage, scratch, false);
    }
}

struct Run<'a>(&'a Iteration, &'a mut Scratch<4, 11>);

impl Kernel for Run<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        self.0.solve::<L>(self.1);
    }
}

/// The rod's assembled matrix, multiplied out from its factor, and its right-hand side, from the solution.
fn rod_system(dt: f64) -> System<4, 11> {
    let it = Iteration::new(dt);
    let n = it.group.node.len();
    let mut scratch = Scratch::default();
    scratch.reserve(n);
    lanes::run(Width::widest(), Run(&it, &mut scratch));
    let size = 4 * n;
    let mut s = System { column: vec![[[Pack::default(); 4]; 11]; n], rhs: vec![[Pack::default(); 4]; n + 4] };
    for lane in 0..LANES {
        let low = |r: usize, m: usize| -> f64 {
            let row = r - m / 4 * 4;
            let stored = if row < 11 { scratch.factor[m / 4][row][m % 4].0[lane] } else { 0.0 };
            if r == m { 1.0 } else { stored }
        };
        let pivot = |m: usize| 1.0 / scratch.factor[m / 4][m % 4][m % 4].0[lane];
        let x = |i: usize| scratch.rhs[i / 4][i % 4].0[lane];
        for k in 0..size {
            for r in k..size.min(k / 4 * 4 + 11) {
                let first = (r / 4).saturating_sub(2) * 4;
                let a: f64 = (first..=k).map(|m| low(r, m) * pivot(m) * low(k, m)).sum();
                s.column[k / 4][r - k / 4 * 4][k % 4].0[lane] = a;
                s.rhs[r / 4][r % 4].0[lane] += a * x(k);
                if r != k {
                    s.rhs[k / 4][k % 4].0[lane] += a * x(r);
                }
            }
        }
    }
    s
}

/// The springs' matrix of a hair of 20 cm and 50 segments in one implicit Euler step.
fn springs_system(dt: f64) -> System<3, 12> {
    let section = Section::round(&Material::default());
    let calibration = calibrate(section.twisting / section.bending);
    let layout = zigzag(&strands()[0].point, [End::Clamped, End::Free], calibration.height).expect("even segments");
    let model = plain::Model::new(&layout, &section, &calibration);
    let a = plain::tangent(&model, &model.choices(), &layout.position, true);
    let n = a.len();
    let mut s = System { column: vec![[[Pack::default(); 3]; 12]; n], rhs: vec![[Pack::default(); 3]; n + 4] };
    for i in 0..n {
        for k in 0..4.min(i + 1) {
            for r in 0..3 {
                for c in 0..3 {
                    s.column[i - k][3 * k + r][c] = Pack::splat(a[i][k][(r, c)]);
                }
            }
        }
        let inertia = model.mass[i] / (dt * dt);
        for c in 0..3 {
            let held = if model.held[i] { HELD } else { 0.0 };
            let d = &mut s.column[i][c][c];
            *d = Pack::splat(d.0[0] + inertia + held);
            let v = (i as f64 / n as f64) * libm::sin(0.15 * i as f64 + c as f64);
            let b = inertia * dt * v - if c == 1 { 9.81 * model.mass[i] } else { 0.0 };
            s.rhs[i][c] = Pack::splat(if model.held[i] { 0.0 } else { b });
        }
    }
    s
}

/// Processor time of this thread, seconds: the machine may be shared.
fn cpu_seconds() -> f64 {
    // Giving way brings the figure up to date.
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
    text.split_whitespace().next().and_then(|v| v.parse::<f64>().ok()).expect("a number") * 1e-9
}

/// A second of hairs of 20 cm and 50 segments that swing without air, 8 steps a frame: processor time.
fn strands_in_motion(hairs: usize, wide: bool) {
    let one: Vec<[f64; 3]> = strands()[1].point.iter().map(|p| [p.x, p.y, p.z]).collect();
    let material = Material { drag_factor: 0.0, ..Material::default() };
    let settings = Settings { material, sag_free: false, sleep: false, wide, ..Settings::default() };
    let mut shot = Rig::under(&vec![one; hairs], &settings, GRAVITY).unwrap();
    let (mut t, mut steps, mut solves) = (0.0, 0, 0);
    for _ in 0..12 {
        let start = cpu_seconds();
        shot.wait(1.0 / 24.0).unwrap();
        t += (cpu_seconds() - start) * 1e9;
        steps += shot.last.particle_steps;
        solves += shot.last.particle_solves;
    }
    println!(
        "{hairs} hairs x 50, wide {wide}: {:.1} ns a node and step, {:.1} ns a node and solve, {:.2} solves a step",
        t / steps as f64,
        t / solves as f64,
        solves as f64 / steps as f64
    );
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("threads");
    pool.install(|| {
        for (hairs, wide) in [(64, true), (64, false)] {
            strands_in_motion(hairs, wide);
        }
        let it = Iteration::new(1.0 / 192.0);
        let n = it.group.node.len();
        let mut scratch = Scratch::default();
        scratch.reserve(n);
        it.solve::<Counting>(&mut scratch);
        let whole = COUNT.with(Cell::take) as f64 / n as f64;
        let system = rod_system(1.0 / 192.0);
        let (mut factor, mut rhs) = (vec![[[Pack::default(); 4]; 11]; n], system.rhs.clone());
        Direct(&system, &mut factor, &mut rhs).run::<Counting>();
        let banded = COUNT.with(Cell::take) as f64 / n as f64;
        for width in Width::available() {
            let t = best(400, || lanes::run(width, Run(&it, &mut scratch))) / (n * LANES) as f64;
            let d = best(400, || lanes::run(width, Direct(&system, &mut factor, &mut rhs))) / (n * LANES) as f64;
            println!(
                "{width:?}: assembly and solve {t:.1} ns a node, {whole:.0} operations, {:.1} Gflop/s; solve alone {d:.1} \
                 ns, {banded:.0} operations, {:.1} Gflop/s",
                whole / t,
                banded / d
            );
        }
        println!("system,direct_ns,until,iterations,cg_ns,times_slower,error_of_solution");
        for (name, dt) in [("6e-4 s", 6e-4), ("1/192 s", 1.0 / 192.0)] {
            compare(&format!("rod {name}"), &rod_system(dt));
            compare(&format!("springs {name}"), &springs_system(dt));
        }
    });
}
