//! The plain model against laws and closed forms.

use super::calibrate::{Section, calibrate};
use super::kernel;
use super::layout::{only_straight, zigzag};
use super::plain::{Choice, Model, choose, energy, gradient, tangent};
use super::sag::{LIMIT, without_sag};
use super::tetrahedron::volume;
use crate::band::{self, Column, HELD, Panel, RING, Window};
use crate::lanes::{self, Kernel, LANES, Lanes, Pack, Width};
use crate::settings::End;
use crate::{Material, Vec3};
use pelage_geom::rng;

const SEGMENT: f64 = 4e-3;

/// A straight hair downwards from the origin.
fn straight(segments: usize) -> Vec<Vec3> {
    (0..=segments).map(|i| Vec3::new(0.0, -SEGMENT * i as f64, 0.0)).collect()
}

fn helix(segments: usize) -> Vec<Vec3> {
    let at = |a: f64| Vec3::new(libm::cos(a), libm::sin(a), 0.3 * a) * 0.02;
    (0..=segments).map(|i| at(0.2 * i as f64)).collect()
}

struct Strand {
    model: Model,
    choices: Vec<Choice>,
    x: Vec<Vec3>,
}

fn strand(points: &[Vec3], ends: [End; 2], section: &Section) -> Strand {
    let calibration = calibrate(section.twisting / section.bending);
    let layout = zigzag(points, ends, calibration.height).unwrap();
    let model = Model::new(&layout, section, &calibration);
    Strand { choices: model.choices(), x: layout.position, model }
}

fn hair() -> Section {
    Section::round(&Material::default())
}

fn shaken(x: &[Vec3], seed: u64, size: f64) -> Vec<Vec3> {
    let off = |i: usize| Vec3::from_fn(|c, _| rng::uniform(seed, i as u64, 3, c as u64) - 0.5) * size;
    x.iter().enumerate().map(|(i, p)| p + off(i)).collect()
}

/// Solves `(tangent + diagonal) d = rhs` by scalar banded elimination; held particles stay.
pub(super) fn solve(
    model: &Model,
    choices: &[Choice],
    x: &[Vec3],
    diagonal: impl Fn(usize) -> f64,
    rhs: &[Vec3],
) -> Vec<Vec3> {
    let n = x.len();
    let mut rows = vec![[0.0; 12]; 3 * n];
    for (i, blocks) in tangent(model, choices, x, true).iter().enumerate() {
        for (k, block) in blocks.iter().enumerate().take(i + 1) {
            for r in 0..3 {
                for c in 0..3 {
                    let (row, column) = (3 * i + r, 3 * (i - k) + c);
                    if column <= row {
                        rows[row][row - column] += block[(r, c)];
                    }
                }
            }
        }
        for r in 0..3 {
            rows[3 * i + r][0] += diagonal(i) + if model.held[i] { 1e40 } else { 0.0 };
        }
    }
    let mut y: Vec<f64> = rhs.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
    for j in 0..3 * n {
        for r in j + 1..(j + 12).min(3 * n) {
            let l = rows[r][r - j] / rows[j][0];
            for k in j + 1..=r {
                rows[r][r - k] -= l * rows[k][k - j];
            }
        }
        for r in j + 1..(j + 12).min(3 * n) {
            rows[r][r - j] /= rows[j][0];
            y[r] -= rows[r][r - j] * y[j];
        }
    }
    for j in (0..3 * n).rev() {
        y[j] /= rows[j][0];
        for r in j + 1..(j + 12).min(3 * n) {
            y[j] -= rows[r][r - j] * y[r];
        }
    }
    y.chunks(3).map(|v| Vec3::new(v[0], v[1], v[2])).collect()
}

/// Backward Euler steps with one linear solve each and the velocity damped by `exp(-20 t)`. Returns how many altitudes
/// changed in the last tenth.
fn settle(s: &mut Strand, force: &dyn Fn(usize) -> Vec3, step: f64, steps: usize) -> usize {
    let mut v = vec![Vec3::zeros(); s.x.len()];
    let mut late = 0;
    for t in 0..steps {
        let changed = choose(&s.model, &mut s.choices, &mut s.x, 20.0 * step);
        let g = gradient(&s.model, &s.choices, &s.x);
        let rhs: Vec<Vec3> = (0..s.x.len()).map(|i| v[i] * (s.model.mass[i] / step) + force(i) - g[i]).collect();
        let d = solve(&s.model, &s.choices, &s.x, |i| s.model.mass[i] / (step * step), &rhs);
        for (i, d) in d.iter().enumerate() {
            s.x[i] += d;
            v[i] = d / step * (1.0 - 20.0 * step);
        }
        late += if 10 * t >= 9 * steps { changed } else { 0 };
    }
    late
}

#[test]
fn forces_are_the_gradient_of_the_energy() {
    for (seed, points) in [straight(6), helix(6)].iter().enumerate() {
        let mut s = strand(points, [End::Clamped, End::Free], &hair());
        s.x = shaken(&s.x, seed as u64, 0.3 * SEGMENT);
        choose(&s.model, &mut s.choices, &mut s.x, 0.1);
        let g = gradient(&s.model, &s.choices, &s.x);
        let scale = g.iter().fold(0.0_f64, |m, v| m.max(v.norm()));
        let d = 1e-5 * SEGMENT;
        for i in 0..s.x.len() {
            for c in 0..3 {
                let at = |d: f64| {
                    let mut x = s.x.clone();
                    x[i][c] += d;
                    energy(&s.model, &s.choices, &x)
                };
                let difference = (at(d) - at(-d)) / (2.0 * d);
                assert!((difference - g[i][c]).abs() < 1e-6 * scale, "{i} {c}: {difference} {}", g[i][c]);
            }
        }
    }
}

#[test]
fn the_tangent_is_the_hessian() {
    // At rest, and bent: segments as long as they were, hinges and altitudes far from rest.
    for turn in [0.0, 0.1, 0.3] {
        let mut s = strand(&straight(5), [End::Free; 2], &hair());
        let mut points = vec![Vec3::zeros()];
        for i in 0..5 {
            let (a, b) = (turn * f64::from(i), 0.3 * turn * f64::from(i));
            let along = Vec3::new(libm::sin(a) * libm::cos(b), -libm::cos(a) * libm::cos(b), libm::sin(b));
            points.push(points[points.len() - 1] + along * SEGMENT);
        }
        s.x = strand(&points, [End::Free; 2], &hair()).x;
        let a = tangent(&s.model, &s.choices, &s.x, true);
        let d = 1e-6 * SEGMENT;
        for i in 0..s.x.len() {
            for c in 0..3 {
                let at = |d: f64| {
                    let mut x = s.x.clone();
                    x[i][c] += d;
                    gradient(&s.model, &s.choices, &x)
                };
                let (plus, minus) = (at(d), at(-d));
                for k in 0..=3.min(i) {
                    for r in 0..3 {
                        let difference = (plus[i - k][r] - minus[i - k][r]) / (2.0 * d);
                        let scale = a[i][0].norm();
                        assert!((difference - a[i][k][(c, r)]).abs() < 1e-7 * scale, "turn {turn}: {i} {k}");
                    }
                }
            }
        }
    }
}

#[test]
fn forces_have_no_resultant_and_no_moment() {
    let mut s = strand(&helix(8), [End::Free; 2], &hair());
    s.x = shaken(&s.x, 4, SEGMENT);
    choose(&s.model, &mut s.choices, &mut s.x, 0.1);
    let g = gradient(&s.model, &s.choices, &s.x);
    let scale: f64 = g.iter().map(|g| g.norm()).sum();
    let sum: Vec3 = g.iter().sum();
    let moment: Vec3 = g.iter().zip(&s.x).map(|(g, x)| x.cross(g)).sum();
    assert!(sum.norm() < 1e-13 * scale);
    assert!(moment.norm() < 1e-14 * scale);
    // The tangent does not resist translation either.
    let a = tangent(&s.model, &s.choices, &s.x, true);
    for i in 0..s.x.len() {
        let mut row = a[i].iter().take(4.min(i + 1)).sum::<nalgebra::Matrix3<f64>>();
        for k in 1..4 {
            if i + k < s.x.len() {
                row += a[i + k][k].transpose();
            }
        }
        assert!(row.norm() < 1e-12 * a[i][0].norm());
    }
}

/// Stiffness in bending (two azimuths) and twisting, over the section's, of a straight clamped strand under a pair of
/// forces at its end.
fn stiffness(section: &Section, segments: usize, uneven: bool) -> [f64; 3] {
    let mut points = straight(segments);
    if uneven {
        for (i, p) in points.iter_mut().enumerate() {
            p.y -= 0.2 * SEGMENT * (i % 2) as f64;
        }
    }
    let s = strand(&points, [End::Clamped, End::Free], section);
    let n = s.x.len();
    let free = |force: &dyn Fn(usize) -> Vec3| -> Vec<Vec3> {
        let rhs: Vec<Vec3> = (0..n).map(force).collect();
        solve(&s.model, &s.choices, &s.x, |_| 0.0, &rhs)
    };
    let length = points[0].y - points[segments].y;
    let bend = |across: Vec3| {
        // A moment on the last segment: slope at the end is M L / EI, measured on the last segment's middle; clamped at
        // point 0 with the hinge there half a segment's.
        let last = (s.x[n - 1] - s.x[n - 3]).norm();
        let d = free(&|i| across * (f64::from(u8::from(i == n - 1)) - f64::from(u8::from(i == n - 3))));
        let slope = (d[n - 1] - d[n - 3]).dot(&across) / last;
        let moment = last;
        moment * (length - 0.5 * last) / slope / section.bending
    };
    let twist = {
        // A pair of forces on the last extra particle and the axis below it: only its moment about the axis matters.
        let axis = Vec3::y();
        let arm = s.x[n - 2] - (s.x[n - 1] + s.x[n - 3]) * 0.5;
        let side = axis.cross(&arm).normalize();
        let d = free(&|i| {
            if i == n - 2 {
                side
            } else if i == n - 1 || i == n - 3 {
                side * -0.5
            } else {
                Vec3::zeros()
            }
        });
        let turn = (d[n - 2] - (d[n - 1] + d[n - 3]) * 0.5).dot(&side) / arm.norm();
        let last = (s.x[n - 1] - s.x[n - 3]).norm();
        arm.norm() * (length - 0.5 * last) / turn / section.twisting
    };
    [bend(Vec3::x()), bend((Vec3::x() + Vec3::z()).normalize()), twist]
}

#[test]
fn stiffness_is_the_sections() {
    for poisson in [-0.9, -0.5, 0.0, 0.3, 0.5] {
        let section = Section::round(&Material { poisson, ..Material::default() });
        // A whole number of turns of the azimuth, with the clamp's hinge counting half.
        for (uneven, bound) in [(false, 0.01), (true, 0.02)] {
            let found = stiffness(&section, 64, uneven);
            println!("poisson {poisson} uneven {uneven}: {found:.4?}");
            assert!(found.iter().all(|f| (f - 1.0).abs() < bound), "poisson {poisson}, uneven {uneven}: {found:?}");
        }
    }
}

/// A second's recovery.
fn recover(s: &mut Strand) {
    let late = settle(s, &|_| Vec3::zeros(), 1e-3, 1000);
    assert_eq!(late, 0, "altitudes chatter");
}

/// Largest difference of a length or altitude sign from the rest shape's.
fn misfit(s: &Strand, rest: &[Vec3]) -> (f64, usize) {
    let mut worst = 0.0_f64;
    let mut inverted = 0;
    for i in 1..rest.len() {
        for k in 1..=3.min(i) {
            let (l, l0) = ((s.x[i] - s.x[i - k]).norm(), (rest[i] - rest[i - k]).norm());
            worst = worst.max((l / l0 - 1.0).abs());
        }
        if i >= 3 {
            let of = |x: &[Vec3]| volume([x[i], x[i - 1], x[i - 2], x[i - 3]]).value;
            inverted += usize::from(of(&s.x) * of(rest) <= 0.0);
        }
    }
    (worst, inverted)
}

#[test]
fn spoilt_tetrahedra_recover() {
    let points = helix(8);
    let rest = strand(&points, [End::Clamped, End::Free], &hair()).x;
    type Spoil = fn(usize, Vec3) -> Vec3;
    let spoil: [(&str, Spoil); 5] = [
        ("coplanar", |_, p| Vec3::new(p.x, p.y, 0.0)),
        ("inverted", |_, p| Vec3::new(p.x, p.y, -p.z)),
        ("colinear", |_, p| Vec3::new(0.0, 0.0, p.z)),
        ("colinear in order", |i, _| Vec3::new(0.0, 0.0, 1e-3 * i as f64)),
        ("to a point", |_, _| Vec3::zeros()),
    ];
    for (name, f) in spoil {
        let mut s = strand(&points, [End::Clamped, End::Free], &hair());
        for i in 3..s.x.len() {
            s.x[i] = f(i, s.x[i]);
        }
        recover(&mut s);
        let found = misfit(&s, &rest);
        println!("{name}: {found:?} energy {:e}", energy(&s.model, &s.choices, &s.x));
        assert!(found.0 < 1e-3 && found.1 == 0, "{name}: {found:?}");
    }
}

#[test]
fn planar_curls_of_the_paper_are_at_rest_and_recover() {
    let points: Vec<Vec3> = (0..12)
        .map(|i| {
            let a = 0.4 * i as f64;
            Vec3::new(libm::sin(a), -libm::cos(a), 0.0) * 0.01
        })
        .collect();
    let section = hair();
    let calibration = calibrate(section.twisting / section.bending);
    let layout = only_straight(&points, [End::Clamped, End::Free]).unwrap();
    let model = Model::new(&layout, &section, &calibration);
    let mut s = Strand { choices: model.choices(), x: layout.position.clone(), model };
    let g = gradient(&s.model, &s.choices, &s.x);
    assert!(g.iter().all(|g| g.norm() < 1e-15), "not at rest");
    s.x[3..].copy_from_slice(&shaken(&layout.position, 3, 1e-3)[3..]);
    recover(&mut s);
    let found = misfit(&s, &layout.position);
    assert!(found.0 < 1e-3, "{found:?} energy {:e}", energy(&s.model, &s.choices, &s.x));
}

#[test]
fn choices_at_rest_stay() {
    let mut s = strand(&straight(20), [End::Clamped, End::Free], &hair());
    let first = s.choices.clone();
    for round in 0..100 {
        let mut x = shaken(&s.x, round, 1e-3 * SEGMENT);
        assert_eq!(choose(&s.model, &mut s.choices, &mut x, 0.0), 0);
    }
    assert_eq!(s.choices, first);
}

#[test]
fn changes_of_altitude_keep_the_energy() {
    let mut s = strand(&straight(12), [End::Free; 2], &hair());
    let mut changes = 0;
    for round in 0..50 {
        let mut x = shaken(&s.x, round, 1.5 * SEGMENT);
        let before = energy(&s.model, &s.choices, &x);
        changes += choose(&s.model, &mut s.choices, &mut x, 0.0);
        let after = energy(&s.model, &s.choices, &x);
        assert!((after / before - 1.0).abs() < 1e-10);
    }
    assert!(changes > 100);
}

#[test]
fn mass_is_the_hairs() {
    let s = strand(&straight(10), [End::Clamped, End::Free], &hair());
    let real: f64 = s.model.mass[2..].iter().sum();
    // Half the ghost segment's mass sits on the ghosts, none on point 0.
    assert!((real / (hair().line_density * 10.0 * SEGMENT) - 1.0).abs() < 1e-12);
}

fn along(segments: usize, length: f64, at: impl Fn(f64) -> Vec3) -> Vec<Vec3> {
    (0..=segments).map(|i| at(length * i as f64 / segments as f64)).collect()
}

#[test]
fn a_groomed_pose_stands() {
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    let poses: [(&str, f64, Vec<Vec3>); 4] = [
        ("horizontal 10 cm", 0.1, along(50, 0.1, |s| Vec3::new(s, 0.0, 0.0))),
        // Horizontal and straight, hair beyond 12 cm is in equilibrium but turns over sideways.
        ("steeply down 20 cm", 0.2, along(50, 0.2, |s| Vec3::new(0.3, -0.954, 0.0) * s)),
        ("hanging 20 cm", 0.2, along(50, 0.2, |s| Vec3::new(0.0, -s, 0.0))),
        (
            "arc 20 cm",
            0.2,
            along(50, 0.2, |s| {
                let a = 0.8 + 4.0 * s;
                Vec3::new(libm::sin(a) - libm::sin(0.8), libm::cos(a) - libm::cos(0.8), 0.0) * 0.25
            }),
        ),
    ];
    for (name, length, points) in poses {
        let mut s = strand(&points, [End::Clamped, End::Free], &hair());
        let sagged = without_sag(&mut s.model, &s.x, gravity).unwrap();
        let start = s.x.clone();
        let mass = s.model.mass.clone();
        settle(&mut s, &|i| gravity * mass[i], 1e-3, 1000);
        let drift = s.x.iter().zip(&start).fold(0.0_f64, |m, (a, b)| m.max((a - b).norm())) / length;
        println!("{name}: {sagged:?}, drift {drift:e} L");
        assert!(drift < 1e-9, "{name}: {drift:e}");
        // The arc turns over sideways, growing by e in 30 ms, unless it is stiffened.
        assert_eq!(sagged.factor > 1.0, name == "arc 20 cm");
    }
}

#[test]
fn long_hair_is_stiffened_to_stand_in_a_hard_pose() {
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    let mut s = strand(&along(50, 0.5, |s| Vec3::new(s, 0.0, 0.0)), [End::Clamped, End::Free], &hair());
    let mut again = s.model.clone();
    let sagged = without_sag(&mut again, &s.x, gravity).unwrap();
    assert!(sagged.load > LIMIT && sagged.factor > 1.0, "{sagged:?}");
    let g = gradient(&again, &s.choices, &s.x);
    for i in 3..s.x.len() {
        assert!((g[i] - gravity * again.mass[i]).norm() < 1e-12);
    }
    s.model.held[50] = true;
    assert!(without_sag(&mut s.model, &s.x, gravity).is_none());
}

/// Tip of a clamped horizontal rod, over its length, and its drop: `theta'' = -Gamma (1 - s) cos theta` by shooting.
fn elastica(gamma: f64) -> [f64; 2] {
    let shoot = |k0: f64| {
        let n = 4000;
        let h = 1.0 / n as f64;
        let f = |s: f64, y: [f64; 4]| [y[1], -gamma * (1.0 - s) * libm::cos(y[0]), libm::cos(y[0]), libm::sin(y[0])];
        let mut y = [0.0, k0, 0.0, 0.0];
        for i in 0..n {
            let s = i as f64 * h;
            let add = |a: [f64; 4], b: [f64; 4], t: f64| -> [f64; 4] { std::array::from_fn(|c| a[c] + t * b[c]) };
            let k1 = f(s, y);
            let k2 = f(s + 0.5 * h, add(y, k1, 0.5 * h));
            let k3 = f(s + 0.5 * h, add(y, k2, 0.5 * h));
            let k4 = f(s + h, add(y, k3, h));
            y = std::array::from_fn(|c| y[c] + h / 6.0 * (k1[c] + 2.0 * k2[c] + 2.0 * k3[c] + k4[c]));
        }
        y
    };
    let (mut low, mut high) = (0.0, gamma);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if shoot(middle)[1] > 0.0 { high = middle } else { low = middle }
    }
    let y = shoot(low);
    [y[2], y[3]]
}

#[test]
fn cantilever_bends_as_the_elastica() {
    for (gamma, segments, bound) in [(1.0, 50, 0.01), (10.0, 50, 0.01), (100.0, 50, 0.01), (100.0, 100, 0.005)] {
        let section = hair();
        let length = (gamma * section.bending / (section.line_density * 9.81)).cbrt();
        let mut s = strand(&along(segments, length, |s| Vec3::new(s, 0.0, 0.0)), [End::Clamped, End::Free], &section);
        let gravity = Vec3::new(0.0, -9.81, 0.0);
        let mass = s.model.mass.clone();
        let late = settle(&mut s, &|i| gravity * mass[i], 2e-3, 1000);
        assert_eq!(late, 0, "altitudes chatter");
        let tip = s.x[s.x.len() - 1] / length;
        let [x, drop] = elastica(gamma);
        let error = (Vec3::new(x, -drop, 0.0) - tip).norm();
        println!("Gamma {gamma}, {segments} segments: tip {tip:?}, elastica {x:.5} {drop:.5}, error {error:.5} L");
        assert!(error < bound);
    }
}

/// One solve of `(1 + tangent) d = forces` for a group, after choosing altitudes; and the energy.
struct GroupSolve<'a> {
    group: &'a kernel::Group,
    altitudes: &'a [kernel::NodeAltitude],
    x: &'a [[Pack; 3]],
}

impl Kernel for GroupSolve<'_> {
    type Out = (Vec<[Pack; 3]>, Vec<kernel::NodeAltitude>, Vec<[Pack; 3]>, Pack);
    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Out {
        let n = self.x.len();
        let mut x = self.x.to_vec();
        let mut altitudes = self.altitudes.to_vec();
        for i in 3..n {
            kernel::choose_node::<L>(i, &self.group.candidates[i], &mut altitudes[i], &mut x, L::splat(0.1));
        }
        for i in 1..n {
            kernel::pull_node::<L>(i, &self.group.model[i], &mut altitudes[i], &x, None);
        }
        let mut energy = L::splat(0.0);
        let mut rhs = vec![[Pack::default(); 3]; n + 3];
        let mut factor: Vec<Column<3, 12>> = vec![[[Pack::default(); 3]; 12]; n];
        let mut window: Window<L, 3, 12> = [Panel::zero(); RING];
        for i in 0..n + 3 {
            if i < n {
                window[i % RING] = Panel::zero();
                for c in 0..3 {
                    window[i % RING].0[c][c] = L::load(&self.group.held[i]).mul_add(L::splat(HELD), L::splat(1.0));
                }
                let (model, altitude) = (&self.group.model[i], &altitudes[i]);
                kernel::add_node::<L, true>(i, model, altitude, &x, &x, L::splat(0.0), &mut window, &mut rhs);
                energy = energy + kernel::energy_node::<L>(i, model, altitude, &x);
            }
            if i >= 3 {
                band::eliminate(i - 3, &mut window, &mut factor[i - 3], &mut rhs);
            }
        }
        for r in &mut rhs[n..] {
            *r = [Pack::default(); 3];
        }
        for i in (0..n).rev() {
            band::substitute::<L, 3, 12>(i, &factor[i], &mut rhs);
        }
        let mut total = Pack::default();
        energy.store(&mut total);
        (rhs, altitudes, x, total)
    }
}

#[test]
fn lanes_do_as_the_plain_model() {
    let mut strands: Vec<Strand> = (0..7)
        .map(|lane: usize| {
            let points = if lane.is_multiple_of(2) { straight(9 + lane) } else { helix(12 - lane) };
            strand(&points, [End::Clamped, End::Free], &hair())
        })
        .collect();
    let models: Vec<&Model> = strands.iter().map(|s| &s.model).collect();
    let group = kernel::pack(&models);
    let choices: Vec<(&Model, &[Choice])> = strands.iter().map(|s| (&s.model, &s.choices[..])).collect();
    let mut altitudes = kernel::pack_altitudes(&choices);
    for round in 0..20 {
        let mut x = vec![[Pack::default(); 3]; group.mass.len()];
        for (lane, s) in strands.iter_mut().enumerate() {
            let size = [0.01, 0.3, 1.5][round % 3] * SEGMENT;
            let from = s.x.clone();
            s.x = shaken(&s.x, (8 * round + lane) as u64, size);
            if lane == 6 && round % 5 == 0 {
                s.x.iter_mut().enumerate().for_each(|(i, p)| *p = Vec3::new(1e-3 * i as f64, 0.0, 0.0));
            }
            s.x[..3].copy_from_slice(&from[..3]);
            for (i, p) in s.x.iter().enumerate() {
                for c in 0..3 {
                    x[i][c].0[lane] = p[c];
                }
            }
        }
        let run = |w| lanes::run(w, GroupSolve { group: &group, altitudes: &altitudes, x: &x });
        let found = run(Width::Plain);
        for w in Width::available() {
            assert!(run(w) == found, "{w:?}");
        }
        let mut expected = Vec::new();
        for s in &mut strands {
            choose(&s.model, &mut s.choices, &mut s.x, 0.1);
            let g: Vec<Vec3> = gradient(&s.model, &s.choices, &s.x).iter().map(|g| -g).collect();
            let d = solve(&s.model, &s.choices, &s.x, |_| 1.0, &g);
            expected.push((d, energy(&s.model, &s.choices, &s.x)));
        }
        for (lane, (d, e)) in expected.iter().enumerate() {
            let scale = d.iter().fold(0.0_f64, |m, v| m.max(v.norm()));
            for i in 0..d.len() {
                for c in 0..3 {
                    let (a, b) = (found.0[i][c].0[lane], d[i][c]);
                    assert!((a - b).abs() < 1e-10 * scale, "round {round} lane {lane} particle {i}: {a:e} {b:e}");
                }
            }
            assert!((found.3.0[lane] / e - 1.0).abs() < 1e-11);
        }
        for i in 0..group.mass.len() {
            for lane in strands.len()..LANES {
                assert_eq!(found.0[i][0].0[lane], 0.0);
            }
        }
        altitudes = found.1;
        let choices: Vec<(&Model, &[Choice])> = strands.iter().map(|s| (&s.model, &s.choices[..])).collect();
        for (i, (a, b)) in altitudes.iter().zip(kernel::pack_altitudes(&choices)).enumerate().skip(3) {
            for (lane, _) in strands.iter().enumerate().filter(|(_, s)| i < s.x.len()) {
                assert!((0..3).all(|j| a.face[j].0[lane] == b.face[j].0[lane]), "round {round} particle {i}");
                assert!((a.offset.0[lane] - b.offset.0[lane]).abs() < 1e-10);
            }
        }
    }
}
