//! Strands in motion against closed forms: frequencies, pendulums, chains, and a rod released from rest.

mod common;

use common::{G, GRAVITY, MODELS, Rig, Vec3, bending_time, plain, rod, straight};
use pelage_sim::reference::{chain, vibration};
use pelage_sim::{End, Material, Model, Settings};
use std::f64::consts::PI;

/// Mean angular frequency of a signal sampled every `dt`, from its first to its last passage through 0.
fn frequency(signal: &[f64], dt: f64) -> f64 {
    let zero = |k: usize| k as f64 + signal[k] / (signal[k] - signal[k + 1]);
    let at: Vec<f64> =
        (0..signal.len() - 1).filter(|&k| (signal[k] > 0.0) != (signal[k + 1] > 0.0)).map(zero).collect();
    assert!(at.len() > 2, "no oscillation");
    PI * (at.len() - 1) as f64 / ((at[at.len() - 1] - at[0]) * dt)
}

/// Angular frequencies of the first three oscillations of a hanging rod about its axis, across both `planes`, in units
/// of sqrt(B / (rho A L^4)). `gamma` 0: without gravity.
fn first_three(model: Model, gamma: f64, n: usize, planes: [Vec3; 2]) -> [[f64; 3]; 2] {
    let material = if gamma > 0.0 { rod(gamma) } else { rod(1.0) };
    let unit = bending_time(gamma.max(1e-300)).max(if gamma > 0.0 { 0.0 } else { bending_time(1.0) });
    let down = Vec3::new(0.0, if gamma > 0.0 { -G } else { 0.0 }, 0.0);
    let exact = vibration::hanging_rod(gamma, 12);
    let weigh = chain::projections(gamma, n);
    let mut out = [[0.0; 3]; 2];
    for (mode, periods) in [(0, 3.0), (1, 5.0), (2, 7.0)] {
        // The higher the oscillation, the smaller its step.
        let dt = 2.0 * PI / exact[mode] / 48.0;
        let count = (periods * 48.0) as usize;
        let mut shot = Rig::under(&[straight(n, -Vec3::y())], &plain(model, material), down.into()).unwrap();
        // A blow from the side moves all oscillations of both planes.
        shot.gravity = (down + (planes[0] + planes[1]) * (0.01 / dt)).into();
        shot.wait(1e-2 * dt * unit).unwrap();
        shot.gravity = down.into();
        let mut signal = [Vec::new(), Vec::new()];
        for _ in 0..count {
            shot.wait(dt * unit).unwrap();
            let p = shot.hair(0);
            for (s, plane) in signal.iter_mut().zip(&planes) {
                s.push(p.windows(2).zip(&weigh[mode]).map(|(w, f)| (w[1] - w[0]).dot(plane) * f).sum());
            }
        }
        for k in 0..2 {
            out[k][mode] = frequency(&signal[k], dt);
        }
    }
    out
}

#[test]
fn the_first_three_frequencies_of_a_rod() {
    let n = 50;
    for model in MODELS {
        for gamma in [0.0, 10.0, 85.0] {
            for turn in [0.0, 0.4] {
                let plane = [
                    Vec3::new(libm::cos(turn), 0.0, libm::sin(turn)),
                    Vec3::new(-libm::sin(turn), 0.0, libm::cos(turn)),
                ];
                let measured = first_three(model, gamma, n, plane);
                let exact = vibration::hanging_rod(gamma, 12);
                for k in 0..3 {
                    let (a, b) = (measured[0][k], measured[1][k]);
                    println!("{model:?} Gamma {gamma} mode {k}: {:.2e} {:.2e}", a / exact[k] - 1.0, b / exact[k] - 1.0);
                    assert!((a / exact[k] - 1.0).abs() < 0.02 && (b / exact[k] - 1.0).abs() < 0.02);
                    assert!((a / b - 1.0).abs() < 0.005);
                }
            }
        }
    }
}

#[test]
fn frequencies_tend_to_the_rods_in_second_order() {
    for model in MODELS {
        let exact = vibration::hanging_rod(10.0, 12);
        let planes = [Vec3::x(), Vec3::z()];
        // The step's own error is the same for all: the chain's exact frequencies show it.
        let error = [12, 24, 48].map(|n| {
            let own = chain::frequencies(10.0, n);
            let m = first_three(model, 10.0, n, planes)[0];
            (m[1] / exact[1] - 1.0, m[1] / own[1] - 1.0)
        });
        println!("{model:?}: {error:?}");
        if model == Model::Springs {
            let order = [0, 1].map(|k| libm::log2(error[k].0 / error[k + 1].0));
            println!("order {order:?}");
            assert!(order.iter().all(|o| (1.5..2.5).contains(o)));
        } else {
            let space = error.map(|e| e.0 - e.1);
            let order = libm::log2(space[0] / space[1]);
            assert!((1.8..2.2).contains(&order));
            assert!(error.iter().all(|e| e.1.abs() < 2e-3), "the step in time: {error:?}");
        }
    }
}

#[test]
fn a_bob_on_a_thread_is_a_pendulum() {
    for model in MODELS {
        for angle in [0.1, 1.0, 2.0] {
            let direction = Vec3::new(libm::sin(angle), -libm::cos(angle), 0.0);
            // As stiff against stretching as 20 cm of hair.
            let settings = Settings { root: End::Pinned, ..plain(model, rod(10.0)) };
            let mut shot = Rig::under(&[straight(1, direction)], &settings, GRAVITY).unwrap();
            let dt = 2.0 * PI * (1.0 / G).sqrt() * vibration::pendulum_period(angle) / 200.0;
            let swing: Vec<f64> = (0..700)
                .map(|_| {
                    shot.wait(dt).unwrap();
                    shot.tip(0).x
                })
                .collect();
            let period = 2.0 * PI / frequency(&swing, dt) / (200.0 * dt);
            let highest = swing[500..].iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let most = if angle < 0.5 * PI { libm::sin(angle) } else { 1.0 };
            println!(
                "{model:?} released at {angle}: period {:.1e} amplitude {:.1e}",
                period - 1.0,
                highest / most - 1.0
            );
            assert!((period - 1.0).abs() < 1e-2);
        }
    }
}

#[test]
fn a_chain_of_beads_swings_as_bernoulli_says() {
    let n = 12;
    for model in MODELS {
        // The extra particles of springs must not turn freely.
        let gamma = if model == Model::Rod { 1e8 } else { 1e4 };
        let exact: Vec<f64> = chain::frequencies(gamma, n).iter().map(|f| f / f64::sqrt(gamma)).collect();
        let hanging = vibration::hanging_chain(1);
        assert!((exact[0] / hanging - 1.0).abs() < 0.01);
        let weigh = chain::projections(gamma, n);
        let material = Material { bend_factor: 1.0 / gamma, ..rod(1.0) };
        // Rolling freely about their axis, springs take up a blow of the higher ones.
        for mode in 0..if model == Model::Rod { 3 } else { 1 } {
            let settings = Settings { root: End::Pinned, ..plain(model, material) };
            let mut shot = Rig::under(&[straight(n, -Vec3::y())], &settings, GRAVITY).unwrap();
            let unit = (1.0 / G).sqrt();
            let dt = 2.0 * PI / exact[mode] / 60.0;
            shot.gravity[0] = 0.1 / dt;
            shot.wait(1e-2 * dt * unit).unwrap();
            shot.gravity = GRAVITY;
            let swing: Vec<f64> = (0..240)
                .map(|_| {
                    shot.wait(dt * unit).unwrap();
                    let p = shot.hair(0);
                    p.windows(2).zip(&weigh[mode]).map(|(w, f)| (w[1] - w[0]).x * f).sum()
                })
                .collect();
            let error = frequency(&swing, dt) / exact[mode] - 1.0;
            println!("{model:?} {mode}: {error:.1e}");
            assert!(error.abs() < 5e-3);
        }
    }
}

/// Tips of a horizontal rod released from rest with Gamma = 9.45, at t = 1, 2, 3 sqrt(L / g).
fn released(model: Model, n: usize, steps: u32) -> [[f64; 2]; 3] {
    released_at(9.45, model, n, steps)
}

/// As [`released`], for any Gamma.
fn released_at(gamma: f64, model: Model, n: usize, steps: u32) -> [[f64; 2]; 3] {
    let settings = Settings { substeps: Some(steps), ..plain(model, rod(gamma)) };
    let mut shot = Rig::under(&[straight(n, Vec3::x())], &settings, GRAVITY).unwrap();
    std::array::from_fn(|_| {
        shot.wait((1.0 / G).sqrt()).unwrap();
        let tip = shot.tip(0);
        [tip.x, tip.y]
    })
}

/// Largest distance of tips.
fn apart(a: &[[f64; 2]; 3], b: &[[f64; 2]; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| libm::hypot(a[0] - b[0], a[1] - b[1])).fold(0.0, f64::max)
}

#[test]
fn a_released_rod_swings_as_it_should() {
    // Computed by two methods in closed_form.rs, and by an outside one.
    let exact = [[0.75925, -0.60856], [0.01737, -0.84883], [0.73612, -0.63801]];
    let outside = [[0.75934, -0.60859], [0.01636, -0.84852], [0.73460, -0.63972]];
    for model in MODELS {
        // Springs err by their hinges' turns squared: twice as far off at 50 segments.
        let resolutions =
            if model == Model::Rod { [(50, 100), (50, 200), (100, 200)] } else { [(100, 100), (100, 200), (100, 400)] };
        for (n, steps) in resolutions {
            let tips = released(model, n, steps);
            let error = (apart(&tips, &exact), apart(&tips, &outside));
            println!("{model:?} {n} segments, {steps} steps: {error:?}");
            assert!(error.0 < 5e-3 && error.1 < 5e-3);
        }
    }
}

#[test]
fn the_step_is_of_second_order_in_time() {
    // The chain of links is the same discretisation in space; its own steps are far smaller.
    let (n, gamma) = (16, 9.45f64);
    let mut c = chain::Chain::straight(gamma, 0.0, n);
    let exact: [[f64; 2]; 3] = std::array::from_fn(|_| {
        c.advance(1.0, 1.0 / (4.0 * (n * n) as f64 / gamma.sqrt()));
        c.tip()
    });
    for model in MODELS {
        // Springs are another discretisation in space: against themselves, and bent little.
        let (gamma, exact) = if model == Model::Rod { (gamma, exact) } else { (2.0, released_at(2.0, model, n, 3200)) };
        let error = [50, 100, 200, 400].map(|steps| apart(&released_at(gamma, model, n, steps), &exact));
        let order = [0, 1, 2].map(|k| libm::log2(error[k] / error[k + 1]));
        println!("{model:?}: {error:?}, order {order:?}");
        if model == Model::Rod {
            assert!(order.iter().all(|o| (1.7..2.6).contains(o)) && error[3] < 2e-4);
        } else {
            // Over all three halvings: below 1e-4 altitudes that change once a step show.
            assert!(order.iter().sum::<f64>() > 3.0 * 1.3 && error[3] < 2e-4);
        }
    }
}

#[test]
fn internal_damping_takes_what_it_should() {
    // One oscillation of a rod without gravity: x'' + (beta omega^2) x' + omega^2 x = 0.
    let n = 20;
    for model in MODELS {
        let unit = bending_time(1.0);
        let omega = chain::frequencies(0.0, n)[0];
        let weigh = &chain::projections(0.0, n)[0];
        for zeta in [0.02, 0.2] {
            let damping = 2.0 * zeta / omega * unit;
            let mut shot =
                Rig::under(&[straight(n, Vec3::x())], &plain(model, Material { damping, ..rod(1.0) }), [0.0; 3])
                    .unwrap();
            let dt = 2.0 * PI / omega / 100.0;
            shot.gravity[1] = 0.1 / dt;
            shot.wait(1e-3 * dt * unit).unwrap();
            shot.gravity = [0.0; 3];
            let swing: Vec<f64> = (0..260)
                .map(|_| {
                    shot.wait(dt * unit).unwrap();
                    shot.hair(0).windows(2).zip(weigh).map(|(w, f)| (w[1] - w[0]).y * f).sum()
                })
                .collect();
            // The first peak, and the one two periods later.
            let peak = |from: usize| swing[from..from + 50].iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let decrement = libm::log(peak(0) / peak(204)) / (4.0 * PI);
            let exact = zeta / f64::sqrt(1.0 - zeta * zeta);
            println!("{model:?} zeta {zeta}: {decrement:.5} for {exact:.5}");
            assert!((decrement / exact - 1.0).abs() < 0.02);
        }
    }
}
