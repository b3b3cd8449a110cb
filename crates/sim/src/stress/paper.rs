//! A case of the paper's nine steps, which promise less than the robust integrator.

use super::Measures;
use super::bodies::{ball, on_ball};
use super::cases::{Done, shaken_10g};
use super::inputs::bad_tip;
use super::rig::{settings, tuft};
use crate::rig::{FRAME, Rig, length, turned};
use crate::{Body, Model, Settings, Vec3};

/// A strand is given up at twice its length; its limited positions may overshoot by what a last step adds.
const REACH: f64 = 2.0;

pub fn nine_steps(model: Model, m: &mut Measures) -> Done {
    at_rest(model, m)?;
    for strain_limit in [0.01, 0.1, 1e9] {
        shaken(model, m, strain_limit)?;
    }
    let ball = ball(|_| {});
    let mut rig = Rig::new(&on_ball(8), &settings(model))?;
    ball.go(&mut rig, m, 6, &|t| turned(Vec3::y(), 0.3 * libm::sin(6.0 * t)), None)?;
    bad_tip(model, m, f64::NAN)
}

/// Groomed hair at rest stays so: there is nothing but gravity.
fn at_rest(model: Model, m: &mut Measures) -> Done {
    let mut rig = Rig::new(&tuft(), &settings(model))?;
    rig.steps(12, FRAME)?;
    rig.check(m);
    rig.check_held(m);
    m.most("speed of hair left alone, m/s", rig.fastest(), 0.1);
    rig.digest(m);
    Ok(())
}

/// Shaken by 10 g, which the steps as printed may not bear: strands that blow up are told and start again from rest.
fn shaken(model: Model, m: &mut Measures, strain_limit: f64) -> Done {
    let mut rig = Rig::new(&tuft(), &Settings { strain_limit, ..settings(model) })?;
    for _ in 0..12 {
        let t = rig.time;
        rig.go(FRAME, &move |f| shaken_10g(t + f * FRAME), &Body::default(), None)?;
        rig.bounded(m, REACH, 1.0);
        for (h, hair) in rig.hairs.iter().enumerate() {
            let told = rig.last.held.contains(&(h as u64 + 1));
            let all = rig.hair(h);
            let long: f64 = all.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            let silent = !told && long > REACH * length(hair);
            m.most("strands blown up and not told", f64::from(u8::from(silent)), 0.0);
        }
    }
    let end = shaken_10g(rig.time);
    for _ in 0..24 {
        rig.go(FRAME, &move |_| end, &Body::default(), None)?;
    }
    rig.bounded(m, REACH, 1.0);
    m.most("speed a second after it, m/s", rig.fastest(), 1e3);
    rig.digest(m);
    Ok(())
}
