//! Cases of numbers that are none, or next to nothing.

use super::Measures;
use super::bodies::{ball, on_ball};
use super::cases::{Done, shaken_10g};
use super::rig::{hair, settings, tuft};
use crate::rig::{FRAME, GRAVITY, Rig, still, turned};
use crate::{
    Body, Deforming, Ellipsoid, End, Exact, Field, FieldSettings, Hairs, Material, Model, Part, Rigid, Root, Settings,
    Shape, SimError, Simulation, Span, Vec3, Wind, rigid_fit,
};
use pelage_geom::{Bvh, Offsets, Topology};

const BAD: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

pub fn root_no_number(model: Model, m: &mut Measures) -> Done {
    // A rotation that is none is as bad as one that is not a number.
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e-310] {
        for turned in [false, true] {
            let mut rig = Rig::new(&tuft(), &settings(model))?;
            let mut same = rig.clone();
            rig.steps(2, FRAME)?;
            same.steps(14, FRAME)?;
            let good = rig.roots.clone();
            let mut broken = good.clone();
            if turned {
                broken[2].rotation = [0.0, bad, 0.0, bad];
            } else if bad.is_finite() {
                continue;
            } else {
                broken[2].position[1] = bad;
            }
            rig.carry(FRAME, broken, None)?;
            m.most("bad roots not told by their id", f64::from(u8::from(rig.last.bad_roots != [3])), 0.0);
            rig.check(m);
            rig.carry(FRAME, good, None)?;
            rig.check(m);
            rig.steps(10, FRAME)?;
            rig.check_held(m);
            m.most("bad roots told when all is well", rig.last.bad_roots.len() as f64, 0.0);
            for h in 0..rig.hairs.len() {
                let apart = rig.apart(&same, h);
                if h == 2 {
                    m.most("way from where it would have been, m", apart, 1e-6);
                } else {
                    m.most("what a neighbour notices of it, m", apart, 0.0);
                }
            }
            rig.digest(m);
        }
    }
    Ok(())
}

/// Whether something was refused by this name.
fn refused<T>(tried: Result<T, SimError>, by: &str) -> bool {
    matches!(tried, Err(SimError::Setting { name, .. }) if name == by)
}

pub fn input_no_number(model: Model, m: &mut Measures) -> Done {
    let mut taken = 0;
    for bad in BAD {
        for (h, point, c) in [(0, 0, 0), (2, 3, 1), (4, 16, 2)] {
            let mut hairs = tuft();
            hairs[h][point][c] = bad;
            let (offsets, position) = (Offsets::from_counts(hairs.iter().map(Vec::len)), hairs.concat());
            let input = Hairs { offsets: &offsets, position: &position, id: &[1, 2, 3, 4, 5], material: &[] };
            let refused = Simulation::new(&input, &settings(model), GRAVITY);
            taken +=
                u32::from(!matches!(refused, Err(SimError::NotFinite { hair, point: p }) if (hair, p) == (h, point)));
        }
        for (name, settings) in spoilt(&settings(model), bad) {
            taken += u32::from(!refused(Rig::new(&tuft(), &settings), name));
        }
        taken += u32::from(!refused(Rig::under(&tuft(), &settings(model), [0.0, bad, 0.0]), "gravity"));
    }
    m.most("bad inputs taken, or refused by another name", f64::from(taken), 0.0);
    Ok(())
}

/// A wind of which one number, by name, is bad.
fn bad_winds(bad: f64) -> Vec<(&'static str, Wind)> {
    let usual = Wind { velocity: [3.0, 0.0, 1.0], gust: 0.3, turbulence: 1.0, ..Wind::default() };
    let mut all = vec![
        ("wind.velocity", Wind { velocity: [0.0, bad, 0.0], ..usual.clone() }),
        ("wind.drift", Wind { drift: Some([0.0, 0.0, bad]), ..usual.clone() }),
        ("wind.gust", Wind { gust: bad, ..usual.clone() }),
        ("wind.turbulence", Wind { turbulence: bad, ..usual.clone() }),
        ("wind.boundary", Wind { boundary: bad, ..usual.clone() }),
    ];
    if bad != f64::INFINITY {
        all.extend([
            ("wind.gust_period", Wind { gust_period: bad, ..usual.clone() }),
            ("wind.turbulence_size", Wind { turbulence_size: bad, ..usual.clone() }),
            ("wind.turbulence_period", Wind { turbulence_period: bad, ..usual }),
        ]);
    }
    all
}

pub fn span_no_number(model: Model, m: &mut Measures) -> Done {
    let mut rig = Rig::new(&tuft(), &settings(model))?;
    rig.go(FRAME, &|f| shaken_10g(f * FRAME), &Body::default(), None)?;
    let before = rig.sim.save();
    let solid = ball(|_| {});
    let mut taken = 0;
    for bad in BAD {
        let off = move |f: f64| Rigid { translation: [0.0, if f > 0.4 { bad } else { 0.0 }, 0.0], ..Rigid::default() };
        let bent = move |f: f64| Rigid { rotation: [0.0, 0.0, bad * f, 1.0], ..Rigid::default() };
        let part = |motion| Part { motion, shape: Shape::Field(&solid.field), exact: None };
        let free = Body::default();
        taken += u32::from(!refused(rig.go(bad, &still, &free, None), "seconds"));
        taken += u32::from(!refused(rig.go(FRAME, &off, &free, None), "motion"));
        taken += u32::from(!refused(rig.go(FRAME, &bent, &free, None), "motion"));
        for body in
            [Body { parts: vec![part(&off)], seconds: FRAME }, Body { parts: vec![part(&bent)], seconds: FRAME }]
        {
            taken += u32::from(!refused(rig.go(FRAME, &still, &body, None), "body.motion"));
        }
        for (name, wind) in bad_winds(bad) {
            taken += u32::from(!refused(rig.go(FRAME, &still, &free, Some(&wind)), name));
        }
        let (time, gravity) = (rig.time, rig.gravity);
        rig.time = bad;
        taken += u32::from(!refused(rig.steps(1, FRAME), "time"));
        rig.time = time;
        rig.gravity[0] = bad;
        taken += u32::from(!refused(rig.steps(1, FRAME), "gravity"));
        rig.gravity = gravity;
    }
    m.most("bad spans taken, or refused by another name", f64::from(taken), 0.0);
    m.most("states changed by what was refused", f64::from(u8::from(rig.sim.save() != before)), 0.0);
    rig.calms(m, 24, 3.0)?;
    rig.check_held(m);
    rig.digest(m);
    Ok(())
}

pub fn skin_no_number(model: Model, m: &mut Measures) -> Done {
    for bad in BAD {
        bad_vertex(model, m, bad)?;
        bad_tip(model, m, bad)?;
    }
    Ok(())
}

/// A turning ball, as a mesh that deforms, of which a vertex is bad in some frames.
fn bad_vertex(model: Model, m: &mut Measures, bad: f64) -> Done {
    let good = ball(|_| {});
    let triangle = &good.mesh.triangle;
    // The one that a hair lies on.
    let hairs = on_ball(8);
    let off = |v: &usize| (Vec3::from(good.mesh.position[*v]) - Vec3::from(hairs[0][4])).norm();
    let under = (0..good.mesh.position.len()).min_by(|a, b| off(a).total_cmp(&off(b))).expect("vertices");
    let pose = |frame: usize| {
        let turn = turned(Vec3::y(), 0.05 * frame as f64);
        let mut at: Vec<[f64; 3]> = good.mesh.position.iter().map(|p| turn.apply(Vec3::from(*p)).into()).collect();
        if frame % 3 == 1 {
            at[under][1] = bad;
        }
        at
    };
    let topology = Topology::new(&good.mesh);
    let built = |at: &[[f64; 3]]| {
        let bvh = Bvh::build(at, triangle, &topology);
        let field = Field::build(at, triangle, &topology, &bvh, &FieldSettings::default(), None, None);
        (bvh, field)
    };
    let mut rig = Rig::new(&hairs, &Settings { sag_free: false, ..settings(model) })?;
    let mut untold = 0;
    for frame in 0..5 {
        let at = [pose(frame), pose(frame + 1)];
        let [(_, from), (bvh, to)] = [built(&at[0]), built(&at[1])];
        for (k, field) in [&from, &to].into_iter().enumerate() {
            untold += usize::from(field.not_finite != usize::from((frame + k) % 3 == 1));
        }
        let rate = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| (b[c] - a[c]) / FRAME);
        let velocity: Vec<[f64; 3]> = at[0].iter().zip(&at[1]).map(rate).collect();
        let flow = [from.flow(triangle, &velocity), to.flow(triangle, &velocity)];
        let deforming = Deforming { field: [&from, &to], flow: [&flow[0], &flow[1]], seconds: FRAME };
        let exact = Some(Exact { bvh: &bvh, triangle, velocity: Some(&velocity) });
        let round = Ellipsoid::fit(&at[1], triangle).expect("points");
        let fit = rigid_fit(&at[0], &at[1]).motion;
        let numbers =
            fit.rotation.iter().chain(&fit.translation).chain(&round.semi_axes).chain(&round.placement.rotation);
        m.most("numbers of fits that are none", numbers.filter(|x| !x.is_finite()).count() as f64, 0.0);
        for part in [
            Part { motion: &still, shape: Shape::Deforming(deforming), exact },
            Part { motion: &still, shape: Shape::Ellipsoid(&round), exact: None },
        ] {
            let body = Body { parts: vec![part], seconds: FRAME };
            let middle = body.at(0.5);
            let far = hairs.iter().flatten().map(|p| middle.sample(Vec3::from(*p)).distance);
            m.most("distances from the body that are none", far.filter(|d| !d.is_finite()).count() as f64, 0.0);
            rig.go(FRAME, &still, &body, None)?;
            rig.check(m);
            rig.check_held(m);
        }
    }
    m.most("fields that do not tell of bad vertices", untold as f64, 0.0);
    rig.calms(m, 24, 3.0)?;
    rig.digest(m);
    Ok(())
}

/// Hairs held at both ends, of which a tip is bad for a frame.
pub(super) fn bad_tip(model: Model, m: &mut Measures, bad: f64) -> Done {
    let settings = Settings { tip: End::Clamped, ..settings(model) };
    let mut rig = Rig::new(&tuft(), &settings)?;
    let mut same = rig.clone();
    let end = |h: &Vec<[f64; 3]>| Root { position: h[h.len() - 1], rotation: [0.0, 0.0, 0.0, 1.0] };
    let good: Vec<Root> = rig.hairs.iter().map(end).collect();
    let mut broken = good.clone();
    broken[2].position[0] = bad;
    // The skin goes on meanwhile.
    let speed = Vec3::new(0.1, 0.2, 0.0);
    let move_on = |rig: &mut Rig, tips: [&[Root]; 2]| -> Done {
        let roots: [&[Root]; 2] = [&rig.roots, &rig.roots];
        let (time, gravity, body) = (rig.time, [rig.gravity; 2], &Body::default());
        let span = Span {
            seconds: FRAME,
            time,
            motion: &|f| Rigid { translation: (speed * (time + f * FRAME)).into(), ..Rigid::default() },
            roots,
            tips: Some(tips),
            body,
            gravity,
            wind: None,
            still: &[],
        };
        rig.last = rig.sim.advance(&span, &|_| true)?;
        rig.time += FRAME;
        Ok(())
    };
    for frame in 0..6 {
        let tips: [&[Root]; 2] = [if frame == 2 { &broken } else { &good }, if frame == 1 { &broken } else { &good }];
        let before = rig.hair(2);
        move_on(&mut rig, tips)?;
        move_on(&mut same, [&good, &good])?;
        let held: &[u64] = if frame == 1 || frame == 2 { &[3] } else { &[] };
        m.most("hairs with bad tips not told by their id", f64::from(u8::from(rig.last.held != held)), 0.0);
        if !held.is_empty() {
            let off = |(a, b): (&Vec3, &Vec3)| (a - b - speed * FRAME).norm();
            let farthest = rig.hair(2).iter().zip(&before).map(off).fold(0.0, f64::max);
            m.most("way of held hair from where its root takes it, m", farthest, 1e-12);
        }
        // The nine steps promise less.
        if model == Model::Paper {
            rig.bounded(m, 2.0, 1.0);
        } else {
            rig.check(m);
        }
        for h in (0..rig.hairs.len()).filter(|&h| h != 2) {
            let apart = rig.apart(&same, h);
            m.most("what a neighbour notices of it, m", apart, 0.0);
        }
    }
    rig.digest(m);
    Ok(())
}

pub fn denormals(model: Model, m: &mut Measures) -> Done {
    let mut misnamed = 0;
    for tiny in [1e-310, 1e-40] {
        for (name, settings) in spoilt(&settings(model), tiny) {
            match Rig::new(&tuft(), &settings) {
                Ok(mut rig) => shaken(&mut rig, m, None)?,
                tried => misnamed += u32::from(!refused(tried, name)),
            }
        }
        let hairs: Vec<_> = [tiny, 0.1].map(|length| hair(Vec3::zeros(), length, 10, 0.1 * length)).to_vec();
        shaken(&mut Rig::new(&hairs, &settings(model))?, m, None)?;
        shaken(&mut Rig::under(&tuft(), &settings(model), [tiny, -tiny, 0.0])?, m, None)?;
        for (_, wind) in bad_winds(tiny) {
            shaken(&mut Rig::new(&tuft(), &settings(model))?, m, Some(&wind))?;
        }
        // Motions that hardly are, and times that are none.
        let mut rig = Rig::new(&tuft(), &settings(model))?;
        let creep = move |f: f64| Rigid { translation: [tiny * f; 3], rotation: [tiny, tiny * f, 0.0, 1.0] };
        rig.go(FRAME, &creep, &Body::default(), None)?;
        rig.check(m);
        rig.check_held(m);
        misnamed += u32::from(!refused(rig.go(tiny, &creep, &Body::default(), None), "seconds"));
        misnamed += u32::from(!refused(rig.go(0.0, &creep, &Body::default(), None), "seconds"));
        for seconds in [1e-9, 1e-6, FRAME] {
            rig.go(seconds, &creep, &Body::default(), None)?;
            rig.check(m);
            m.most("speed of hair at rest, m/s", rig.fastest(), 1e-3);
        }
    }
    m.most("refused by another name", f64::from(misnamed), 0.0);
    Ok(())
}

/// Shaken for two frames and let be for one; a hair may be held if it is told.
fn shaken(rig: &mut Rig, m: &mut Measures, wind: Option<&Wind>) -> Done {
    for _ in 0..2 {
        let t = rig.time;
        rig.go(FRAME, &move |f| shaken_10g(t + f * FRAME), &Body::default(), wind)?;
        rig.check(m);
    }
    rig.steps(1, FRAME)?;
    rig.check(m);
    rig.digest(m);
    Ok(())
}

/// Settings of which one, by name, has a bad value.
fn spoilt(usual: &Settings, bad: f64) -> Vec<(&'static str, Settings)> {
    let m = usual.material;
    let with = |material: Material| Settings { material, ..usual.clone() };
    vec![
        ("diameter", with(Material { diameter: bad, ..m })),
        ("young", with(Material { young: bad, ..m })),
        ("density", with(Material { density: bad, ..m })),
        ("poisson", with(Material { poisson: bad, ..m })),
        ("damping", with(Material { damping: bad, ..m })),
        ("bend_factor", with(Material { bend_factor: bad, ..m })),
        ("twist_factor", with(Material { twist_factor: bad, ..m })),
        ("stretch_factor", with(Material { stretch_factor: bad, ..m })),
        ("drag_factor", with(Material { drag_factor: bad, ..m })),
        ("tolerance", Settings { tolerance: bad, ..usual.clone() }),
        ("largest_turn", Settings { largest_turn: bad, ..usual.clone() }),
        ("strain_limit", Settings { strain_limit: bad, ..usual.clone() }),
        ("friction", Settings { friction: bad, ..usual.clone() }),
        ("offset", Settings { offset: bad, ..usual.clone() }),
        ("teleport", Settings { teleport: bad, ..usual.clone() }),
    ]
}
