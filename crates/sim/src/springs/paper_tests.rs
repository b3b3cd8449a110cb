//! Mode `paper`.

use super::calibrate::{Section, calibrate};
use super::kernel::{self, Group};
use super::layout::only_straight;
use super::paper::{Drive, Scratch, Settings, State, limit_strain, step};
use super::plain::Model;
use crate::lanes::{self, Kernel, Lanes, Pack, Width};
use crate::settings::End;
use crate::{Material, Vec3};
use pelage_geom::rng;

const SEGMENT: f64 = 4e-3;

const PLAIN: Settings = Settings { step: 3e-4, strain_limit: f64::INFINITY, damping: 0.0, backward_euler: false };

/// Eight strands: straight, curly, and one of each in turn; free if asked.
fn group(ends: [End; 2]) -> (Group, State) {
    let section = Section::round(&Material::default());
    let calibration = calibrate(section.twisting / section.bending);
    let strands: Vec<(Model, Vec<Vec3>)> = (0..8)
        .map(|lane| {
            let turn = 0.3 * f64::from(lane % 4);
            let mut at = Vec3::zeros();
            let mut points = vec![at];
            for i in 0..10 + lane {
                let a = turn * f64::from(i);
                let d = Vec3::new(0.5 * libm::cos(a), -1.0, 0.5 * libm::sin(a));
                at += if turn == 0.0 { Vec3::new(0.6, -0.8, 0.0) } else { d.normalize() } * SEGMENT;
                points.push(at);
            }
            let layout = only_straight(&points, ends).unwrap();
            (Model::new(&layout, &section, &calibration), layout.position)
        })
        .collect();
    let choices: Vec<_> = strands.iter().map(|s| s.0.choices()).collect();
    let models: Vec<&Model> = strands.iter().map(|s| &s.0).collect();
    let pairs: Vec<_> = strands.iter().zip(&choices).map(|(s, c)| (&s.0, &c[..])).collect();
    let group = kernel::pack(&models);
    let mut x = vec![[Pack::default(); 3]; group.mass.len()];
    for (lane, s) in strands.iter().enumerate() {
        for (i, p) in s.1.iter().enumerate() {
            for c in 0..3 {
                x[i][c].0[lane] = p[c];
            }
        }
    }
    let state = State { v: vec![[Pack::default(); 3]; x.len()], altitude: kernel::pack_altitudes(&pairs), x };
    (group, state)
}

fn stir(state: &mut State, group: &Group, speed: f64) {
    for (i, v) in state.v.iter_mut().enumerate() {
        for (c, v) in v.iter_mut().enumerate() {
            for lane in 0..8 {
                let u = rng::uniform(5, (8 * i + lane) as u64, 1, c as u64) - 0.5;
                v.0[lane] = speed * u * (1.0 - group.held[i].0[lane]);
            }
        }
    }
}

fn still<'a>(state: &'a State, gravity: f64) -> Drive<'a> {
    Drive { gravity: [0.0, gravity, 0.0], target: &state.x }
}

#[test]
fn every_width_steps_to_the_same_bits() {
    let (group, mut state) = group([End::Clamped, End::Free]);
    stir(&mut state, &group, 1.0);
    let target = state.x.clone();
    for backward_euler in [false, true] {
        let settings = Settings { strain_limit: 0.1, backward_euler, ..PLAIN };
        let run = |width| {
            let mut s = state.clone();
            let drive = Drive { gravity: [0.0, -9.81, 0.0], target: &target };
            for t in 0..20 {
                let mut push = |x: &mut [[Pack; 3]], v: &mut [[Pack; 3]]| {
                    x[8][0].0[3] += 1e-5;
                    v[8][0].0[3] *= 0.5;
                    t % 3 == 0
                };
                step(width, &group, &mut s, &mut Scratch::default(), &settings, &drive, &mut push);
            }
            s
        };
        let expected = run(Width::Plain);
        assert!(expected.x.iter().flatten().all(|p| p.0.iter().all(|v| v.is_finite() && v.abs() < 1.0)));
        for width in Width::available() {
            assert!(run(width) == expected, "{width:?}");
        }
    }
}

#[test]
fn without_collisions_a_step_is_the_implicit_midpoint() {
    let (group, mut state) = group([End::Clamped, End::Free]);
    stir(&mut state, &group, 1.0);
    let before = state.clone();
    let drive = still(&before, -9.81);
    // Untouched, and touched by nothing: the second solve must find the first's answer.
    let mut again = state.clone();
    step(Width::widest(), &group, &mut state, &mut Scratch::default(), &PLAIN, &drive, &mut |_, _| false);
    step(Width::widest(), &group, &mut again, &mut Scratch::default(), &PLAIN, &drive, &mut |_, _| true);
    for i in 0..before.x.len() {
        for c in 0..3 {
            for lane in 0..8 {
                let moved = state.x[i][c].0[lane] - before.x[i][c].0[lane];
                let mean = 0.5 * (state.v[i][c].0[lane] + before.v[i][c].0[lane]);
                if group.held[i].0[lane] == 0.0 {
                    assert!((moved - PLAIN.step * mean).abs() < 1e-15, "{i} {lane}: {moved:e} {mean:e}");
                }
                assert!((state.v[i][c].0[lane] - again.v[i][c].0[lane]).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn free_strands_fall_and_keep_their_momentum() {
    let (group, mut state) = group([End::Free; 2]);
    stir(&mut state, &group, 0.01);
    let momentum = |s: &State, lane: usize, c: usize| -> f64 {
        (0..s.x.len()).map(|i| (1.0 - group.held[i].0[lane]) * group.mass[i].0[lane] * s.v[i][c].0[lane]).sum()
    };
    let weight = |lane: usize| -> f64 {
        (0..state.x.len()).map(|i| (1.0 - group.held[i].0[lane]) * group.mass[i].0[lane]).sum::<f64>() * 9.81
    };
    let mut s = state.clone();
    for _ in 0..50 {
        let before = s.clone();
        step(Width::widest(), &group, &mut s, &mut Scratch::default(), &PLAIN, &still(&before, -9.81), &mut |_, _| {
            false
        });
    }
    for lane in 0..8 {
        for c in 0..3 {
            let gained = momentum(&s, lane, c) - momentum(&state, lane, c);
            let due = if c == 1 { -weight(lane) * 50.0 * PLAIN.step } else { 0.0 };
            let all: f64 = (0..s.x.len())
                .map(|i| group.mass[i].0[lane] * s.v[i][c].0[lane].abs() * (1.0 - group.held[i].0[lane]))
                .sum();
            assert!((gained - due).abs() < 1e-8 * all, "lane {lane} axis {c}: {gained:e} {due:e} of {all:e}");
        }
    }
}

struct Limit<'a>(&'a Group, Vec<[Pack; 3]>);

impl Kernel for Limit<'_> {
    type Out = Vec<[Pack; 3]>;
    #[inline(always)]
    fn run<L: Lanes>(mut self) -> Self::Out {
        limit_strain::<L>(self.0, &mut self.1, 0.01, L::splat(1.0));
        self.1
    }
}

#[test]
fn limiting_leaves_held_particles_and_no_larger_strain() {
    let (group, mut state) = group([End::Clamped, End::Free]);
    stir(&mut state, &group, 1.0);
    let moved: Vec<[Pack; 3]> = (0..state.x.len())
        .map(|i| {
            std::array::from_fn(|c| {
                Pack(std::array::from_fn(|l| state.v[i][c].0[l].mul_add(SEGMENT, state.x[i][c].0[l])))
            })
        })
        .collect();
    let limited = lanes::run(Width::widest(), Limit(&group, moved.clone()));
    for lane in 0..8 {
        for i in 1..limited.len() {
            let free = group.held[i].0[lane] == 0.0;
            let k = if group.skip[i].0[lane] > 0.0 { 2 } else { 1 };
            let d = |x: &[[Pack; 3]]| -> f64 {
                (0..3).map(|c| (x[i][c].0[lane] - x[i - k][c].0[lane]).powi(2)).sum::<f64>().sqrt()
            };
            if free {
                let strain = d(&limited) / group.model[i].length[k - 1].0[lane] - 1.0;
                assert!(strain.abs() < 0.01 + 1e-12, "lane {lane} particle {i}: {strain}");
            } else {
                assert!((0..3).all(|c| limited[i][c].0[lane] == moved[i][c].0[lane]));
            }
        }
    }
}
