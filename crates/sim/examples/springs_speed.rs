//! Without an argument: nanoseconds per particle of one full step of mass-spring strands: assembly, elimination, substitution, update.
//! With `paper`: the largest strain of mode `paper` at a list of time steps.
#![allow(missing_docs, clippy::disallowed_methods, clippy::needless_range_loop)]

use pelage_sim::band::{self, Column, HELD, Panel, RING, Window};
use pelage_sim::lanes::{self, Kernel, Lanes, Pack, Width};
use pelage_sim::springs::calibrate::{Section, calibrate};
use pelage_sim::springs::kernel::{self, Group, NodeAltitude};
use pelage_sim::springs::layout::zigzag;
use pelage_sim::springs::paper::{self, Drive, Scratch, Settings};
use pelage_sim::springs::plain::Model;
use pelage_sim::{End, Material, Vec3};
use std::time::Instant;

const STEP: f64 = 6e-4;

struct State {
    group: Group,
    altitudes: Vec<NodeAltitude>,
    x: Vec<[Pack; 3]>,
    v: Vec<[Pack; 3]>,
}

struct Step<'a> {
    state: &'a mut State,
    factor: &'a mut [Column<3, 12>],
    rhs: &'a mut [[Pack; 3]],
    choose: bool,
}

impl Kernel for Step<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let State { group, altitudes, x, v } = self.state;
        let n = x.len();
        if self.choose {
            for i in 3..n {
                kernel::choose_node::<L>(i, &group.candidates[i], &mut altitudes[i], x, L::splat(0.01));
            }
        }
        let mut window: Window<L, 3, 12> = [Panel::zero(); RING];
        let (inverse, gravity) = (L::splat(1.0 / STEP), L::splat(-9.81));
        for i in 0..n {
            let mass = L::load(&group.mass[i]);
            let inertia = mass * inverse;
            let diagonal = L::load(&group.held[i]).mul_add(L::splat(HELD), inertia * inverse);
            let slot = &mut window[i % RING];
            *slot = Panel::zero();
            for c in 0..3 {
                slot.0[c][c] = diagonal;
                let mut b = L::load(&v[i][c]) * inertia;
                if c == 1 {
                    b = mass.mul_add(gravity, b);
                }
                b.store(&mut self.rhs[i][c]);
            }
            let (model, altitude) = (&group.model[i], &altitudes[i]);
            kernel::add_node::<L, true>(i, model, altitude, x, x, L::splat(0.0), &mut window, self.rhs);
            if i >= 3 {
                band::eliminate(i - 3, &mut window, &mut self.factor[i - 3], self.rhs);
            }
        }
        for j in n - 3..n {
            window[(j + 3) % RING] = Panel::zero();
            band::eliminate(j, &mut window, &mut self.factor[j], self.rhs);
        }
        for r in &mut self.rhs[n..] {
            *r = [Pack::default(); 3];
        }
        for j in (0..n).rev() {
            band::substitute::<L, 3, 12>(j, &self.factor[j], self.rhs);
            for c in 0..3 {
                let d = L::load(&self.rhs[j][c]);
                (L::load(&x[j][c]) + d).store(&mut x[j][c]);
                (d * inverse).store(&mut v[j][c]);
            }
        }
    }
}

fn state() -> State {
    along(Vec3::new(4e-3, 0.0, 0.0), 48)
}

/// A hair of 20 cm hanging, 1 degree off.
fn hanging() -> State {
    along(Vec3::new(7e-5, -3.9994e-3, 0.0), 50)
}

fn along(segment: Vec3, segments: u32) -> State {
    let section = Section::round(&Material::default());
    let calibration = calibrate(section.twisting / section.bending);
    let points: Vec<Vec3> = (0..=segments).map(|i| segment * f64::from(i)).collect();
    let layout = zigzag(&points, [End::Clamped, End::Free], calibration.height).unwrap();
    let model = Model::new(&layout, &section, &calibration);
    let choices = model.choices();
    let x: Vec<[Pack; 3]> = layout.position.iter().map(|p| [p.x, p.y, p.z].map(Pack::splat)).collect();
    State {
        group: kernel::pack(&[&model; 8]),
        altitudes: kernel::pack_altitudes(&[(&model, &choices[..]); 8]),
        v: vec![[Pack::default(); 3]; x.len()],
        x,
    }
}

/// Largest strain of the axis and speed (m/s) over a second of mode `paper`, starting with the root's velocity.
fn shaken(settings: &Settings, shake: f64) -> (f64, f64) {
    let mut s = hanging();
    let mut scratch = Scratch::default();
    let omega = 2.0 * std::f64::consts::PI * 5.0;
    let amplitude = shake * 9.81 / (omega * omega);
    let start = s.x.clone();
    for v in &mut s.v {
        v[0] = Pack::splat(amplitude * omega);
    }
    let mut state = paper::State { x: s.x, v: s.v, altitude: std::mem::take(&mut s.altitudes) };
    let (mut worst, mut speed) = (0.0_f64, 0.0_f64);
    for t in 1..=(1.0 / settings.step) as usize {
        let mut target = start.clone();
        let move_by = amplitude * libm::sin(omega * t as f64 * settings.step);
        for p in &mut target {
            p[0] = Pack::splat(p[0].0[0] + move_by);
        }
        let drive = Drive { gravity: [0.0, -9.81, 0.0], target: &target };
        paper::step(Width::widest(), &s.group, &mut state, &mut scratch, settings, &drive, &mut |_, _| false);
        for i in (4..state.x.len()).step_by(2) {
            let d: f64 = (0..3).map(|c| (state.x[i][c].0[0] - state.x[i - 2][c].0[0]).powi(2)).sum();
            let strain = (d.sqrt() / 4e-3 - 1.0).abs();
            let v: f64 = (0..3).map(|c| state.v[i][c].0[0].powi(2)).sum::<f64>().sqrt();
            if !(strain < 1e3 && v < 1e3) {
                return (f64::INFINITY, f64::INFINITY);
            }
            worst = worst.max(strain);
            speed = speed.max(v);
        }
    }
    (worst, speed)
}

fn paper_limits() {
    for shake in [0.0, 10.0] {
        for (name, strain_limit, damping, backward_euler) in [
            ("as printed, no limiting", f64::INFINITY, 0.0, false),
            ("strain limit 0.1", 0.1, 0.0, false),
            ("strain limit 0.1, damping 20/s", 0.1, 20.0, false),
            ("backward Euler, no limiting", f64::INFINITY, 0.0, true),
            ("backward Euler, strain limit 0.1", 0.1, 0.0, true),
            ("backward Euler, strain limit 0.01", 0.01, 0.0, true),
        ] {
            let mut line = format!("shake {shake} g, {name}:");
            for step in [4e-3, 2e-3, 1e-3, 6e-4, 3e-4, 1e-4, 3e-5] {
                let (worst, speed) = shaken(&Settings { step, strain_limit, damping, backward_euler }, shake);
                line += &format!("  {step:.0e} {worst:.1e} {speed:.1}");
            }
            println!("{line}");
        }
    }
}

fn main() {
    if std::env::args().nth(1).as_deref() == Some("paper") {
        return paper_limits();
    }
    for width in Width::available() {
        for (name, groups, repeats) in [("in cache", 16, 100), ("from memory", 1000, 4)] {
            let mut states: Vec<State> = (0..groups).map(|_| state()).collect();
            let n = states[0].x.len();
            let mut factor: Vec<Column<3, 12>> = vec![[[Pack::default(); 3]; 12]; n];
            let mut rhs = vec![[Pack::default(); 3]; n + 3];
            for choose in [false, true] {
                let mut best = f64::INFINITY;
                for _ in 0..repeats {
                    let start = Instant::now();
                    for state in &mut states {
                        lanes::run(width, Step { state, factor: &mut factor, rhs: &mut rhs, choose });
                    }
                    best = best.min(start.elapsed().as_secs_f64());
                }
                let ns = best * 1e9 / (groups * n * 8) as f64;
                println!(
                    "{width:?} {name}, choosing {choose}: {ns:.1} ns per particle and step ({n} particles a strand)"
                );
            }
        }
    }
}
