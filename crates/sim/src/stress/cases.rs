//! The cases.

use super::rig::{hair, settings, tuft};
use super::{Case, Measures, bodies, inputs, paper};
use crate::rig::{FRAME, Rig, length, still, turned};
use crate::{Body, Material, Model, Rigid, Settings, SimError, Vec3, Wind};

pub(super) type Done = Result<(), SimError>;

const BOTH: &[Model] = &[Model::Rod, Model::Springs];
const NINE: &[Model] = &[Model::Paper];

/// All cases.
pub const CASES: &[Case] = &[
    Case {
        name: "violent-skin",
        about: "10 g at 5 Hz, half a turn in a frame, jumps of velocity, 10 turns a second",
        models: BOTH,
        run: violent_skin,
    },
    Case {
        name: "long-steps",
        about: "the same in steps of a frame, a twelfth of a second and a second; gravity from the side at once",
        models: BOTH,
        run: long_steps,
    },
    Case {
        name: "short-steps",
        about: "the same in steps of 1/480 s: thrown at up to 5 km/s in one",
        models: BOTH,
        run: short_steps,
    },
    Case {
        name: "teleport",
        about: "ten metres and two radians from one frame to the next",
        models: BOTH,
        run: teleport,
    },
    Case {
        name: "stiffness",
        about: "bending and twisting 1e-6 to 1e6 times as stiff, stretching 1e-3 to 1e3",
        models: BOTH,
        run: stiffness,
    },
    Case {
        name: "masses",
        about: "density 1e-6 to 1e9 times hair's, neighbouring segments of masses 1 to 1e6",
        models: BOTH,
        run: masses,
    },
    Case { name: "air", about: "no damping at all, a minute's damping, drag 1e-6 to 1e6", models: BOTH, run: air },
    Case { name: "one-segment", about: "hairs of one point, one segment and two", models: BOTH, run: one_segment },
    Case {
        name: "no-length",
        about: "points that coincide or nearly so at root, tip and everywhere, nanometre and denormal segments",
        models: BOTH,
        run: no_length,
    },
    Case {
        name: "colinear",
        about: "straight up, level, in a plane, a right angle, folded back onto itself",
        models: BOTH,
        run: colinear,
    },
    Case { name: "two-thousand-segments", about: "a hair of 2,000 segments", models: BOTH, run: two_thousand },
    Case { name: "crushed", about: "let go from a zigzag, a knot, a tenth of its length", models: BOTH, run: crushed },
    Case {
        name: "inverted",
        about: "let go from its mirror image: every tetrahedron of springs is inside out",
        models: BOTH,
        run: inverted,
    },
    Case { name: "born-inside", about: "hair that grows through a solid ball", models: BOTH, run: bodies::born_inside },
    Case {
        name: "flat-body",
        about: "a body with faces of no area, faces twice, and hair on it",
        models: BOTH,
        run: bodies::flat_body,
    },
    Case {
        name: "shaken-body",
        about: "a ball that shakes ten times as hard as a head can",
        models: BOTH,
        run: bodies::shaken_body,
    },
    Case {
        name: "thorns",
        about: "hair that falls onto thorns finer than the body's field",
        models: BOTH,
        run: bodies::thorns,
    },
    Case { name: "storm", about: "wind of 10,000 m/s, turned round every frame", models: BOTH, run: storm },
    Case {
        name: "gravity",
        about: "none, 1e-300 to 1e5 m/s2, from all sides, turned over at once",
        models: BOTH,
        run: gravity,
    },
    Case {
        name: "standing",
        about: "hair of 30 cm that stands up and sticks out, nudged: soft as it is, it would fall",
        models: BOTH,
        run: standing,
    },
    Case {
        name: "root-no-number",
        about: "a root that is not a number for a frame, and its neighbours",
        models: BOTH,
        run: inputs::root_no_number,
    },
    Case {
        name: "input-no-number",
        about: "NaN and infinity in points, gravity and every setting: refused by name",
        models: BOTH,
        run: inputs::input_no_number,
    },
    Case {
        name: "span-no-number",
        about: "NaN and infinity in a span's time, gravity, wind, motions: refused by name, nothing changed",
        models: BOTH,
        run: inputs::span_no_number,
    },
    Case {
        name: "skin-no-number",
        about: "a body with vertices that are not numbers, at rest and moving; tips that are none",
        models: BOTH,
        run: inputs::skin_no_number,
    },
    Case {
        name: "denormals",
        about: "lengths, thickness, forces, times of 1e-310 and 1e-40",
        models: BOTH,
        run: inputs::denormals,
    },
    Case {
        name: "nine-steps",
        about: "the paper's nine steps: at rest, shaken, blown up and back; tips that are no numbers",
        models: NINE,
        run: paper::nine_steps,
    },
];

type Skin = fn(f64) -> Rigid;

pub(super) fn shaken_10g(t: f64) -> Rigid {
    let w = 2.0 * std::f64::consts::PI * 5.0;
    Rigid { translation: [98.1 / (w * w) * libm::sin(w * t), 0.0, 0.0], ..Rigid::default() }
}

fn half_turn(t: f64) -> Rigid {
    turned(Vec3::new(0.1, 1.0, 0.2), std::f64::consts::PI * (t / FRAME).clamp(0.0, 1.0))
}

/// From rest to 20 m/s at once, and back to rest.
fn jump_of_velocity(t: f64) -> Rigid {
    Rigid { translation: [0.0, 0.0, 20.0 * t.clamp(0.0, 0.1)], ..Rigid::default() }
}

/// Just less than what counts as a teleport.
fn leap(t: f64) -> Rigid {
    Rigid { translation: [0.9 * (t / FRAME).clamp(0.0, 1.0), 0.0, 0.0], ..Rigid::default() }
}

fn spun(t: f64) -> Rigid {
    turned(Vec3::y(), 60.0 * t.min(0.5))
}

fn ten_metres(t: f64) -> Rigid {
    let f = (t / FRAME).clamp(0.0, 1.0);
    Rigid { translation: [10.0 * f, 0.0, 0.0], ..turned(Vec3::z(), 2.0 * f) }
}

const SKINS: [Skin; 6] = [shaken_10g, half_turn, jump_of_velocity, leap, spun, ten_metres];

/// A skin for a fifth of a second, then at rest.
fn abused(model: Model, m: &mut Measures, skin: Skin, seconds: f64, substeps: Option<u32>) -> Done {
    let mut rig = Rig::new(&tuft(), &Settings { substeps, ..settings(model) })?;
    for _ in 0..(0.2 / seconds).ceil() as usize {
        let t = rig.time;
        rig.go(seconds, &move |f| skin(t + f * seconds), &Body::default(), None)?;
        rig.check(m);
        // Thrown in a single short step, a strand may be held, and says so; springs also in a long one.
        if substeps.is_none() || (model == Model::Rod && seconds > 0.01) {
            rig.check_held(m);
        }
    }
    let end = skin(rig.time);
    let fast = rig.fastest();
    for _ in 0..24 {
        rig.go(FRAME, &move |_| end, &Body::default(), None)?;
    }
    rig.check(m);
    m.most("speed when it should have calmed, m/s", rig.fastest(), 3.0);
    // What it has then, gravity gives: a hair's own swing.
    let swing = (2.0 * 9.81 * 2.0 * length(&rig.hairs[4])).sqrt();
    m.most("speed after over that before, or a swing's", rig.fastest() / fast.max(swing), 1.0);
    rig.digest(m);
    Ok(())
}

fn violent_skin(model: Model, m: &mut Measures) -> Done {
    SKINS.iter().try_for_each(|skin| abused(model, m, *skin, FRAME, None))
}

fn long_steps(model: Model, m: &mut Measures) -> Done {
    for skin in SKINS {
        for seconds in [FRAME, 1.0 / 12.0, 1.0] {
            abused(model, m, skin, seconds, Some(1))?;
        }
    }
    toppled(model, m)
}

/// Gravity comes from the side at once: long steps must go where short ones do.
fn toppled(model: Model, m: &mut Measures) -> Done {
    let rig = |substeps: u32| -> Result<Rig, SimError> {
        let mut rig = Rig::new(&tuft(), &Settings { substeps: Some(substeps), ..settings(model) })?;
        rig.gravity = [9.81, 0.0, 0.0];
        Ok(rig)
    };
    let (mut long, mut short) = (rig(1)?, rig(160)?);
    for _ in 0..3 {
        long.steps(1, 1.0 / 12.0)?;
        short.steps(1, 1.0 / 12.0)?;
        let apart = (0..long.hairs.len()).map(|h| long.apart(&short, h)).fold(0.0, f64::max);
        m.most("way from where short steps take it, m", apart, 0.02);
    }
    long.digest(m);
    Ok(())
}

fn short_steps(model: Model, m: &mut Measures) -> Done {
    SKINS.iter().try_for_each(|skin| abused(model, m, *skin, 1.0 / 480.0, Some(1)))
}

fn teleport(model: Model, m: &mut Measures) -> Done {
    let mut rig = Rig::new(&tuft(), &settings(model))?;
    rig.steps(4, FRAME)?;
    rig.go(FRAME, &|f| ten_metres(f * FRAME), &Body::default(), None)?;
    rig.check(m);
    m.most("strands not carried along", (rig.hairs.len() as u64 - rig.last.teleported.min(5)) as f64, 0.0);
    let end = ten_metres(FRAME);
    let off = |h: usize| {
        let at = rig.hair(h);
        at.iter().zip(&rig.hairs[h]).map(|(a, b)| (a - end.apply(Vec3::from(*b))).norm()).fold(0.0, f64::max)
    };
    m.most("way from where it was taken, m", (0..rig.hairs.len()).map(off).fold(0.0, f64::max), 1e-6);
    rig.digest(m);
    Ok(())
}

/// Shaken for two frames and let be for one.
fn shaken(model: Model, m: &mut Measures, material: Material) -> Done {
    for sag_free in [true, false] {
        let mut rig = Rig::new(&tuft(), &Settings { material, sag_free, ..settings(model) })?;
        for _ in 0..2 {
            let t = rig.time;
            rig.go(FRAME, &move |f| shaken_10g(t + f * FRAME), &Body::default(), None)?;
            rig.check(m);
        }
        rig.steps(1, FRAME)?;
        rig.check(m);
        rig.digest(m);
    }
    Ok(())
}

fn stiffness(model: Model, m: &mut Measures) -> Done {
    let usual = Material::default();
    for f in [1e-6, 1e6] {
        shaken(model, m, Material { bend_factor: f, ..usual })?;
        shaken(model, m, Material { twist_factor: f, ..usual })?;
        shaken(model, m, Material { bend_factor: f, twist_factor: 1.0 / f, ..usual })?;
        shaken(model, m, Material { bend_factor: f, twist_factor: f, ..usual })?;
    }
    for f in [1e-3, 1e3] {
        shaken(model, m, Material { stretch_factor: f, ..usual })?;
    }
    for diameter in [1e-6, 1e-3] {
        shaken(model, m, Material { diameter, ..usual })?;
    }
    shaken(model, m, Material { poisson: -0.9, ..usual })
}

fn masses(model: Model, m: &mut Measures) -> Done {
    let usual = Material::default();
    for f in [1e-6, 1e6, 1e9] {
        shaken(model, m, Material { density: usual.density * f, ..usual })?;
    }
    let at = [0.0, 1e-7, 0.1, 0.1 + 1e-7, 0.2];
    degenerate(model, m, &[at.map(|y| [0.0, -y, 0.0]).to_vec()])
}

fn air(model: Model, m: &mut Measures) -> Done {
    let usual = Material::default();
    for f in [1e-6, 1e6] {
        shaken(model, m, Material { drag_factor: f, ..usual })?;
    }
    shaken(model, m, Material { damping: 0.0, drag_factor: 0.0, ..usual })?;
    shaken(model, m, Material { damping: 60.0, ..usual })
}

/// Each hair beside a good one that must not notice it, shaken for three frames and let be for a second.
fn degenerate(model: Model, m: &mut Measures, cases: &[Vec<[f64; 3]>]) -> Done {
    let good = hair(Vec3::new(0.2, 0.0, 0.0), 0.1, 14, 0.001);
    for bad in cases {
        for sag_free in [true, false] {
            let hairs = [good.clone(), bad.clone()];
            // Long enough for numbers to tell its points apart.
            let able = length(bad) > 1e-6;
            let settings = Settings { sag_free, ..settings(model) };
            // Two thousand points take a second a step.
            let (frames, seconds) = if bad.len() > 100 { (1, FRAME / 32.0) } else { (3, FRAME) };
            let shake = |hairs: &[Vec<[f64; 3]>], m: &mut Measures| -> Result<Rig, SimError> {
                let mut rig = Rig::new(hairs, &settings)?;
                for _ in 0..frames {
                    let t = rig.time;
                    rig.go(seconds, &move |f| shaken_10g(t + f * seconds), &Body::default(), None)?;
                    rig.check(m);
                    if able {
                        rig.check_held(m);
                    }
                }
                Ok(rig)
            };
            let mut rig = shake(&hairs, m)?;
            let alone = shake(&hairs[..1], m)?;
            let apart = rig.apart(&alone, 0);
            m.most("what a neighbour notices of it, m", apart, 0.0);
            if able && bad.len() <= 100 {
                rig.calms(m, 24, 0.5)?;
                rig.check_held(m);
            }
            rig.digest(m);
        }
    }
    Ok(())
}

const ROOT: Vec3 = Vec3::new(0.0, 0.1, 0.0);

fn one_segment(model: Model, m: &mut Measures) -> Done {
    degenerate(model, m, &[vec![ROOT.into()], hair(ROOT, 0.05, 1, 0.0), hair(ROOT, 0.05, 2, 0.0)])
}

fn no_length(model: Model, m: &mut Measures) -> Done {
    let tiny = f64::MIN_POSITIVE * 0.25;
    let along = |y: &[f64]| y.iter().map(|y| [0.0, -y, 0.0]).collect::<Vec<_>>();
    let twice = hair(ROOT, 0.1, 10, 0.001).iter().flat_map(|p| [*p, *p]).collect();
    let denormal = vec![[0.0; 3], [0.0, -tiny, 0.0], [0.0, -0.02, 0.0], [tiny, -0.04, 0.0]];
    // Resampled to equal segments, of which there are none.
    let mut rig =
        Rig::new(&[vec![ROOT.into(); 10], tuft()[0].clone()], &Settings { segments: Some(8), ..settings(model) })?;
    rig.steps(2, FRAME)?;
    rig.check(m);
    gaps(model, m)?;
    degenerate(
        model,
        m,
        &[
            vec![ROOT.into(); 10],
            twice,
            along(&[0.0, 0.0, 0.01, 0.03]),
            along(&[0.0, 0.01, 0.03, 0.03]),
            denormal,
            hair(ROOT, 2e-8, 10, 0.0),
            hair(ROOT, 2e-5, 10, 0.0),
        ],
    )
}

/// Points less than a nanometre apart are one point. Ten nanometres are a segment for rods; springs, which can't bear
/// it, ride with their root.
fn gaps(model: Model, m: &mut Measures) -> Done {
    let mut stopped = 0;
    let mut shaken = |at: &[f64]| -> Result<Vec<Vec3>, SimError> {
        let hair = at.iter().map(|y| [0.0, -y, 0.0]).collect();
        let mut rig = Rig::new(&[hair], &Settings { sag_free: false, ..settings(model) })?;
        for _ in 0..3 {
            let t = rig.time;
            rig.go(FRAME, &move |f| shaken_10g(t + f * FRAME), &Body::default(), None)?;
            stopped += rig.last.stopped.len();
        }
        Ok(rig.hair(0))
    };
    let close = shaken(&[0.0, 1e-10, 0.05, 0.05, 0.1])?;
    let one = shaken(&[0.0, 0.05, 0.1])?;
    shaken(&[0.0, 0.05, 0.05 + 1e-8, 0.1])?;
    let apart = [(0, 0), (1, 0), (2, 1), (3, 1), (4, 2)].map(|(a, b): (usize, usize)| (close[a] - one[b]).norm());
    m.most("way from the same hair without points too close, m", apart.into_iter().fold(0.0, f64::max), 0.0);
    m.most("strands stopped for their short segments", stopped as f64, 0.0);
    Ok(())
}

fn colinear(model: Model, m: &mut Measures) -> Done {
    let along = |y: &[f64]| y.iter().map(|y| [0.0, -y, 0.0]).collect::<Vec<_>>();
    let by = |n: u32, at: &dyn Fn(f64) -> [f64; 3]| (0..n).map(|i| at(f64::from(i))).collect::<Vec<_>>();
    degenerate(
        model,
        m,
        &[
            along(&[0.0, 0.02, 0.01, 0.03]),
            along(&[0.0, 0.02, 0.0, 0.02]),
            by(30, &|i| [0.0, 0.01 * i, 0.0]),
            by(30, &|i| [0.01 * i, 0.0, 0.0]),
            by(60, &|i| [0.01 * libm::sin(0.5 * i), -0.004 * i, 0.0]),
            by(60, &|i| [0.01 * libm::sin(0.4 * i), 0.01 * libm::cos(0.4 * i), 0.0]),
            vec![[0.0; 3], [0.0, -0.05, 0.0], [0.05, -0.05, 0.0], [0.05, -0.1, 0.0]],
        ],
    )
}

fn two_thousand(model: Model, m: &mut Measures) -> Done {
    degenerate(model, m, &[hair(ROOT, 0.3, 2000, 0.001)])
}

/// Hair of a natural shape, let go from a pose: it must come back to within `off` metres in two seconds.
fn released(model: Model, m: &mut Measures, natural: &[[f64; 3]], pose: &[[f64; 3]], off: f64) -> Done {
    let settings = Settings { sag_free: false, ..settings(model) };
    let mut rig = Rig::new(&[natural.to_vec()], &settings)?;
    rig.sim.restore(&Rig::new(&[pose.to_vec()], &settings)?.sim.save())?;
    for _ in 0..48 {
        rig.steps(1, FRAME)?;
        rig.check(m);
    }
    let far = rig.hair(0).iter().zip(natural).map(|(a, b)| (a - Vec3::from(*b)).norm()).fold(0.0, f64::max);
    m.most("way from its shape in the end, m", far, off);
    rig.digest(m);
    Ok(())
}

fn crushed(model: Model, m: &mut Measures) -> Done {
    let n = 16;
    let natural = hair(Vec3::zeros(), 0.1, n, 0.0);
    let zigzag = |i: usize| [0.0, -0.1 / n as f64 * if i == 0 { 0.0 } else { 1.0 + (i % 2) as f64 }, 1e-5 * i as f64];
    let knot = |i: usize| {
        let i = i as f64;
        [0.004 * libm::sin(2.5 * i), -0.006 - 0.003 * libm::cos(1.7 * i), 0.004 * libm::sin(3.7 * i)]
    };
    let of = |at: &dyn Fn(usize) -> [f64; 3]| (0..=n).map(at).collect::<Vec<_>>();
    released(model, m, &natural, &of(&zigzag), 0.02)?;
    released(model, m, &natural, &of(&|i| natural[i].map(|x| 0.1 * x)), 0.02)?;
    // A knot leaves springs at rest in another shape of theirs.
    released(model, m, &natural, &of(&knot), if model == Model::Springs { 0.1 } else { 0.02 })
}

fn inverted(model: Model, m: &mut Measures) -> Done {
    // A coil that is stiff enough to hold its shape, and its mirror image.
    let natural = hair(Vec3::zeros(), 0.06, 24, 0.003);
    let mirrored: Vec<[f64; 3]> = natural.iter().map(|p| [p[0], p[1], -p[2]]).collect();
    released(model, m, &natural, &mirrored, 0.02)
}

fn storm(model: Model, m: &mut Measures) -> Done {
    let mut rig = Rig::new(&tuft(), &settings(model))?;
    for frame in 0..8 {
        let speed = if frame % 2 == 0 { 1e4 } else { -1e4 };
        let wind = Wind { velocity: [speed, 0.1 * speed, 0.0], gust: 0.5, turbulence: 1e3, ..Wind::default() };
        rig.go(FRAME, &still, &Body::default(), Some(&wind))?;
        rig.check(m);
    }
    rig.calms(m, 48, 3.0)?;
    rig.check_held(m);
    rig.digest(m);
    Ok(())
}

fn gravity(model: Model, m: &mut Measures) -> Done {
    for g in [0.0, 1e-300, 1e-3, 98.1, 1e3, 1e5] {
        for direction in [Vec3::y(), -Vec3::y(), Vec3::new(1.0, 0.3, -0.2)] {
            let mut rig = Rig::under(&tuft(), &settings(model), (direction * g).into())?;
            rig.steps(3, FRAME)?;
            rig.check(m);
            rig.gravity = (direction * -g).into();
            rig.steps(3, FRAME)?;
            rig.check(m);
            rig.digest(m);
        }
    }
    Ok(())
}

fn standing(model: Model, m: &mut Measures) -> Done {
    let towards = [Vec3::x(), Vec3::y(), Vec3::new(0.7, 0.7, 0.0), Vec3::new(0.2, 1.0, 0.0)];
    let hairs = towards.map(|d| (0..=12).map(|i| (d * (0.025 * f64::from(i))).into()).collect::<Vec<[f64; 3]>>());
    let mut rig = Rig::new(&hairs, &settings(model))?;
    let nudge = |f: f64| Rigid { translation: [1e-3 * libm::sin(std::f64::consts::TAU * f); 3], ..Rigid::default() };
    rig.go(FRAME, &nudge, &Body::default(), None)?;
    for _ in 0..36 {
        rig.steps(1, FRAME)?;
        rig.check(m);
        let groomed = |h: usize| rig.hair(h).into_iter().zip(&rig.hairs[h]).map(|(a, b)| (a - Vec3::from(*b)).norm());
        let off = (0..rig.hairs.len()).flat_map(groomed).fold(0.0, f64::max);
        m.most("way from where it was groomed, m", off, 2e-3);
    }
    rig.check_held(m);
    rig.digest(m);
    Ok(())
}
