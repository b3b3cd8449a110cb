//! The cases.

use super::rig::{hair, settings, tuft};
use super::{Case, Measures, inputs, paper};
use crate::rig::{FRAME, Rig, length, still, turned};
use crate::{
    Body, Ellipsoid, Exact, Field, FieldSettings, Material, Model, Part, Rigid, Settings, Shape, SimError, Vec3, Wind,
};
use pelage_geom::{Bvh, Mesh, Topology, shapes};

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
        about: "the same in steps of a frame, a twelfth of a second and a second",
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
        about: "points that coincide at root, tip and everywhere, nanometre and denormal segments",
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
    Case { name: "born-inside", about: "hair that grows through a solid ball", models: BOTH, run: born_inside },
    Case {
        name: "flat-body",
        about: "a body with faces of no area, faces twice, and hair on it",
        models: BOTH,
        run: flat_body,
    },
    Case {
        name: "shaken-body",
        about: "a ball that shakes ten times as hard as a head can",
        models: BOTH,
        run: shaken_body,
    },
    Case { name: "storm", about: "wind of 10,000 m/s, turned round every frame", models: BOTH, run: storm },
    Case {
        name: "gravity",
        about: "none, 1e-300 to 1e5 m/s2, from all sides, turned over at once",
        models: BOTH,
        run: gravity,
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
        about: "the paper's nine steps: at rest, shaken, blown up and back",
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
            let settings = Settings { sag_free, ..settings(model) };
            // Two thousand points take a second a step.
            let (frames, seconds) = if bad.len() > 100 { (1, FRAME / 32.0) } else { (3, FRAME) };
            let shake = |hairs: &[Vec<[f64; 3]>], m: &mut Measures| -> Result<Rig, SimError> {
                let mut rig = Rig::new(hairs, &settings)?;
                for _ in 0..frames {
                    let t = rig.time;
                    rig.go(seconds, &move |f| shaken_10g(t + f * seconds), &Body::default(), None)?;
                    rig.check(m);
                }
                Ok(rig)
            };
            let mut rig = shake(&hairs, m)?;
            let alone = shake(&hairs[..1], m)?;
            let apart = rig.apart(&alone, 0);
            m.most("what a neighbour notices of it, m", apart, 0.0);
            if length(bad) > 1e-6 && bad.len() <= 100 {
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

/// A ball of radius 9 cm as a solid.
pub(super) struct Ball {
    pub(super) mesh: Mesh,
    pub(super) bvh: Bvh,
    pub(super) field: Field,
}

pub(super) fn ball(change: impl Fn(&mut Mesh)) -> Ball {
    let mut mesh = shapes::cube_sphere(24, 0.09);
    change(&mut mesh);
    let topology = Topology::new(&mesh);
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    let field = Field::build(&mesh.position, &mesh.triangle, &topology, &bvh, &FieldSettings::default(), None);
    Ball { mesh, bvh, field }
}

impl Ball {
    /// Moves hairs on with the ball, and measures how deep free points are within it at the end.
    pub(super) fn go(
        &self,
        rig: &mut Rig,
        m: &mut Measures,
        frames: usize,
        motion: &(dyn Fn(f64) -> Rigid + Sync),
        deep: bool,
    ) -> Done {
        for _ in 0..frames {
            let t = rig.time;
            let at = move |f: f64| motion(t + f * FRAME);
            let exact = Exact { bvh: &self.bvh, triangle: &self.mesh.triangle, velocity: None };
            let part = Part { motion: &at, shape: Shape::Field(&self.field), exact: Some(exact) };
            let body = Body { parts: vec![part], seconds: FRAME };
            rig.go(FRAME, &at, &body, None)?;
            rig.check(m);
            let end = body.at(1.0);
            let depth = |p: &Vec3| end.exact(*p, 0.0).map_or(0.0, |hit| -hit.distance);
            let free = (0..rig.hairs.len()).flat_map(|h| rig.hair(h).into_iter().skip(2));
            let deepest = free.map(|p| depth(&p)).fold(0.0, f64::max);
            if !deep {
                m.most("deepest point in the body, m", deepest, 1e-4);
            }
        }
        rig.digest(m);
        Ok(())
    }
}

/// Hairs that stand on the ball and lie around it.
pub(super) fn on_ball(count: usize) -> Vec<Vec<[f64; 3]>> {
    let of = |k: usize| {
        let (around, up) = (2.4 * k as f64, 0.3 + 0.65 * (k as f64 + 0.5) / count as f64);
        let flat = (1.0 - up * up).sqrt();
        let n = Vec3::new(flat * libm::cos(around), up, flat * libm::sin(around));
        let down = (-Vec3::y() + n * n.y).normalize();
        let at = |s: f64| (n * libm::cos(s / 0.09) + down * libm::sin(s / 0.09)) * (0.09 * (1.0 + 0.4 * s));
        (0..25).map(|i| at(0.15 * f64::from(i) / 24.0).into()).collect()
    };
    (0..count).map(of).collect()
}

fn born_inside(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|_| {});
    // Straight through the middle, along a chord, and from inside out.
    let through =
        |from: Vec3, to: Vec3| (0..=24).map(|i| (from + (to - from) * (f64::from(i) / 24.0)).into()).collect();
    let hairs: Vec<Vec<[f64; 3]>> = vec![
        through(Vec3::new(0.0, 0.09, 0.0), Vec3::new(0.0, -0.12, 0.0)),
        through(Vec3::new(0.06, 0.067, 0.0), Vec3::new(0.06, -0.1, 0.0)),
        through(Vec3::new(0.0, 0.0, 0.08), Vec3::new(0.0, 0.02, 0.2)),
    ];
    let mut rig = Rig::new(&hairs, &settings(model))?;
    ball.go(&mut rig, m, 12, &still, true)?;
    rig.check_held(m);
    m.most("speed while it comes out, m/s", rig.fastest(), 5.0);
    Ok(())
}

fn flat_body(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|mesh| {
        let faces = mesh.triangle.len();
        for k in (0..faces).step_by(7) {
            let [a, b, c] = mesh.triangle[k];
            mesh.triangle.extend([[a, a, b], [a, b, b], [c, c, c], [a, b, c]]);
            let (uv, face) = (mesh.corner_uv[k], mesh.face[k]);
            mesh.corner_uv.extend([uv; 4]);
            mesh.face.extend([face; 4]);
        }
    });
    let mut rig = Rig::new(&on_ball(16), &settings(model))?;
    ball.go(&mut rig, m, 12, &|t| turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(6.0 * t)), false)?;
    rig.check_held(m);
    // An ellipsoid of no thickness.
    let flat: Vec<[f64; 3]> = ball.mesh.position.iter().map(|p| [p[0], 0.0, p[2]]).collect();
    let Some(flat) = Ellipsoid::fit(&flat, &ball.mesh.triangle) else { return Ok(()) };
    let mut rig = Rig::new(&on_ball(16), &settings(model))?;
    for _ in 0..6 {
        let part = Part { motion: &still, shape: Shape::Ellipsoid(&flat), exact: None };
        rig.go(FRAME, &still, &Body { parts: vec![part], seconds: FRAME }, None)?;
        rig.check(m);
    }
    rig.digest(m);
    Ok(())
}

fn shaken_body(model: Model, m: &mut Measures) -> Done {
    let ball = ball(|_| {});
    let mut rig = Rig::new(&on_ball(24), &settings(model))?;
    ball.go(&mut rig, m, 12, &|t| turned(Vec3::new(0.2, 1.0, 0.0), libm::sin(63.0 * t)), false)?;
    rig.check_held(m);
    Ok(())
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
