//! What stands for a body in collisions: distance fields, tables and ellipsoids against the exact distance to the mesh.

use super::plot::{Plot, Series};
use super::{Bench, Findings, Section, Study, machine, shots};
use crate::Error;
use pelage_geom::shapes::{bust, bust_pose, scalp};
use pelage_geom::{Bvh, Mesh, Topology, Vec3, rng};
use pelage_sim::body::{Closed, Deforming, Ellipsoid, Field, FieldSettings, Hit, Rigid, rigid_fit};
use pelage_sim::{Settings, Table};
use std::cell::OnceCell;

pub(super) const STUDY: Study = Study {
    name: "collision",
    about: "Distance fields, in time too, tables and ellipsoids against the exact distance to the mesh.",
    run,
};

/// Spacings of the field, millimetres.
const SPACINGS: [f64; 7] = [16.0, 8.0, 6.0, 4.0, 3.0, 2.0, 1.0];
const QUICK_SPACINGS: [f64; 3] = [16.0, 8.0, 4.0];

/// Samples of a table around and along.
const TABLES: [[usize; 2]; 4] = [[64, 32], [128, 64], [256, 128], [512, 256]];
const QUICK_TABLES: [[usize; 2]; 1] = [[256, 128]];

/// Points whose distance is asked for, and how far from the surface they are, metres: where contacts are.
const POINTS: u64 = 20_000;
const NEAR: f64 = 2e-3;

/// Frames a second.
const RATE: f64 = 24.0;

const METRES: f64 = 0.01;

/// A bust that turns and nods, metres, closed.
struct Body {
    mesh: Mesh,
    solid: Closed,
    rest: Pose,
    /// Vertices where hair grows.
    scalp: Vec<usize>,
}

/// The bust at one moment.
struct Pose {
    position: Vec<[f64; 3]>,
    bvh: Bvh,
}

/// A point near the surface and the exact answer.
#[derive(Clone, Copy)]
struct Asked {
    point: Vec3,
    distance: f64,
    normal: Vec3,
    /// On the scalp.
    hairy: bool,
}

fn body() -> Body {
    let mesh = bust().mesh;
    let solid = Closed::new(&mesh, &Topology::new(&mesh));
    let scalp = (0..mesh.position.len()).filter(|v| scalp(Vec3::from(mesh.position[*v])) > 0.5).collect();
    let rest = posed(&solid, &mesh.position);
    Body { mesh, solid, rest, scalp }
}

/// Of vertices in centimetres.
fn posed(solid: &Closed, position: &[[f64; 3]]) -> Pose {
    let position: Vec<[f64; 3]> = solid.extend(position).iter().map(|p| p.map(|x| x * METRES)).collect();
    let bvh = solid.bvh(&position);
    Pose { position, bvh }
}

impl Body {
    fn at(&self, seconds: f64) -> Pose {
        posed(&self.solid, &bust_pose(seconds, &self.mesh))
    }

    /// Points within [`NEAR`] of the surface of a pose, evenly over its area.
    fn ask(&self, pose: &Pose, count: u64) -> Vec<Asked> {
        let triangle = &self.solid.mesh.triangle[..self.mesh.triangle.len()];
        let corner = |t: [u32; 3]| t.map(|v| Vec3::from(pose.position[v as usize]));
        let mut sum = 0.0;
        let upto: Vec<f64> = triangle
            .iter()
            .map(|t| {
                let [a, b, c] = corner(*t);
                sum += (b - a).cross(&(c - a)).norm();
                sum
            })
            .collect();
        let random = |k: u64, step: u64| rng::uniform(5, k, 0, step);
        let one = |k: u64| {
            let t = upto.partition_point(|s| *s < random(k, 0) * sum).min(upto.len() - 1);
            let ([a, b, c], root) = (corner(triangle[t]), random(k, 1).sqrt());
            let w = [1.0 - root, root * (1.0 - random(k, 2)), root * random(k, 2)];
            let n = (b - a).cross(&(c - a)).normalize();
            let point = a * w[0] + b * w[1] + c * w[2] + n * ((2.0 * random(k, 3) - 1.0) * NEAR);
            let at = pose.bvh.closest(point, f64::INFINITY).expect("a mesh");
            let away = (point - at.position).try_normalize(1e-9).map_or(at.normal, |n| n * at.signed_distance.signum());
            let rest = Vec3::from(self.mesh.position[triangle[t][0] as usize]);
            Asked { point, distance: at.signed_distance, normal: away, hairy: scalp(rest) > 0.5 }
        };
        (0..count).map(one).collect()
    }

    /// Middle of the scalp at rest and the box of its vertices, metres.
    fn head(&self) -> (Vec3, [Vec3; 2]) {
        let all = || self.scalp.iter().map(|v| Vec3::from(self.rest.position[*v]));
        let (low, high) =
            all().fold((all().next(), all().next()), |(l, h), p| (l.map(|l| l.inf(&p)), h.map(|h| h.sup(&p))));
        let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
        ((low + high) * 0.5, [low, high])
    }

    fn field(&self, pose: &Pose, spacing: f64) -> Field {
        let settings = FieldSettings { voxel: spacing * 1e-3, ..FieldSettings::default() };
        let (triangle, topology) = (&self.solid.mesh.triangle, &self.solid.topology);
        Field::build(&pose.position, triangle, topology, &pose.bvh, &settings, None, None)
    }

    /// A table around the middle of the scalp, or around the upright line through it.
    fn table(&self, round: bool, size: [usize; 2]) -> Table {
        let (middle, [low, high]) = self.head();
        let far = |f: &dyn Fn(Vec3) -> f64| {
            let all = self.scalp.iter().map(|v| f(Vec3::from(self.rest.position[*v]) - middle));
            1.1 * all.fold(0.0, f64::max)
        };
        if round {
            return Table::sphere(&self.rest.bvh, middle, Vec3::y(), far(&|d| d.norm()), size);
        }
        let end = |y: f64| Vec3::new(middle.x, y, middle.z);
        Table::cylinder(&self.rest.bvh, end(low.y), end(high.y), far(&|d| leg(d.x, d.z)), size)
    }

    /// The ellipsoid of the head: of points even over all above the nape.
    fn ellipsoid(&self) -> Ellipsoid {
        let (_, [low, _]) = self.head();
        let points = self.ask(&self.rest, POINTS).into_iter().map(|a| a.point);
        let head: Vec<[f64; 3]> = points.filter(|p| p.y > low.y).map(Into::into).collect();
        Ellipsoid::fit(&head, &[]).expect("a head has a surface")
    }

    /// The rigid part of the way from rest to a pose, by the scalp.
    fn placement(&self, pose: &Pose) -> Rigid {
        let of = |p: &Pose| self.scalp.iter().map(|v| p.position[*v]).collect::<Vec<_>>();
        rigid_fit(&of(&self.rest), &of(pose)).motion
    }
}

fn leg(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

/// RMS on the scalp, RMS, largest (millimetres), RMS angle of the normal (degrees) and nanoseconds a query.
fn error(asked: &[Asked], sample: &(dyn Fn(Vec3) -> Hit + Sync)) -> [f64; 5] {
    let (mut all, mut hairy, mut angle, mut largest) = ([0.0; 2], [0.0; 2], [0.0; 2], 0.0f64);
    for a in asked {
        let hit = sample(a.point);
        let e = 1e3 * (hit.distance - a.distance);
        let add = |s: &mut [f64; 2], x: f64| *s = [s[0] + x * x, s[1] + 1.0];
        add(&mut all, e);
        largest = largest.max(e.abs());
        if a.hairy {
            add(&mut hairy, e);
            add(&mut angle, libm::acos(hit.normal.dot(&a.normal).clamp(-1.0, 1.0)).to_degrees());
        }
    }
    let rms = |[s, n]: [f64; 2]| (s / n).sqrt();
    let (_, seconds) =
        machine::alone(|| std::hint::black_box(asked.iter().map(|a| sample(a.point).distance).sum::<f64>()));
    [rms(hairy), rms(all), largest, rms(angle), 1e9 * seconds / asked.len() as f64]
}

fn run(bench: &mut Bench<'_>) -> Result<Findings, Error> {
    let cell = OnceCell::new();
    let known = || {
        shots::lazily(&cell, || {
            let body = body();
            let asked = body.ask(&body.rest, POINTS);
            Ok((body, asked))
        })
    };
    let stands = stands(bench, &known)?;
    let time = between(bench, &known)?;
    let moving = moving(bench, &known)?;
    let answers = answers(&stands, &time, &moving);
    Ok(Findings { answers, sections: vec![stands, time, moving] })
}

type Known<'a> = dyn Fn() -> Result<&'a (Body, Vec<Asked>), Error> + 'a;

const STANDS: [&str; 7] =
    ["RMS on the scalp, mm", "RMS, mm", "largest, mm", "RMS of the normal, degrees", "ns a query", "s to make", "MB"];

fn stands(bench: &mut Bench<'_>, known: &Known<'_>) -> Result<Section, Error> {
    let mut section = Section::new("What stands for a body", &STANDS).says(
        "The sample bust at rest. The exact signed distance to its triangles (closest point of a hierarchy, sign by \
         angle-weighted pseudo-normals) is the reference, asked for at 20,000 points within 2 mm of the surface. Columns \
         are the error of distance where hair grows and everywhere, the angle between the normals on the scalp, and the \
         cost on one thread, in processor time. Tables (Kurihara, Anjyo, Thalmann 1993) and the ellipsoid are of the head: \
         their largest error is that on the scalp too. The ellipsoid's time is mostly that of choosing points to fit it to.",
    );
    let spacings: &[f64] = if bench.quick { &QUICK_SPACINGS } else { &SPACINGS };
    for &spacing in spacings {
        section.row(bench, &format!("field/{spacing}-mm"), || {
            let (body, asked) = known()?;
            let (field, seconds) = machine::alone(|| body.field(&body.rest, spacing));
            Ok(costed(error(asked, &|p| field.sample(p)), seconds, field.bytes()))
        })?;
    }
    let tables: &[[usize; 2]] = if bench.quick { &QUICK_TABLES } else { &TABLES };
    for (name, round) in [("cylinder", false), ("sphere", true)] {
        for &size in tables {
            section.row(bench, &format!("table/{name}/{}x{}", size[0], size[1]), || {
                let (body, asked) = known()?;
                let (table, seconds) = machine::alone(|| body.table(round, size));
                Ok(of_head(asked, &|p| table.sample(p), seconds, 16 * size[0] * size[1]))
            })?;
        }
    }
    section.row(bench, "ellipsoid", || {
        let (body, asked) = known()?;
        let (ellipsoid, seconds) = machine::alone(|| body.ellipsoid());
        Ok(of_head(asked, &|p| ellipsoid.sample(p), seconds, size_of::<Ellipsoid>()))
    })?;
    section.row(bench, "exact", || {
        let (body, asked) = known()?;
        let (bvh, seconds) = machine::alone(|| body.solid.bvh(&body.rest.position));
        let exact = |p: Vec3| {
            let at = bvh.closest(p, f64::INFINITY).expect("a mesh");
            Hit { distance: at.signed_distance, normal: at.normal, velocity: Vec3::zeros() }
        };
        let [a, b, c, d, e, f, _] = costed(error(asked, &exact), seconds, 0);
        Ok([a, b, c, d, e, f, f64::NAN])
    })?;
    let default = 1e3 * FieldSettings::default().voxel;
    let of = |x: &dyn Fn(&Vec<f64>, f64) -> f64, k: usize| {
        let row = |(n, v): &(String, Vec<f64>)| {
            Some((n.strip_prefix("field/")?.strip_suffix("-mm")?.parse().ok()?, v.clone()))
        };
        let rows: Vec<(f64, Vec<f64>)> = section.rows.iter().filter_map(row).collect();
        let points: Vec<[f64; 2]> = rows.iter().map(|(s, v)| [x(v, *s), v[k]]).collect();
        let mark = rows.iter().position(|(s, _)| *s == default).map(|i| points[i]);
        (points, mark)
    };
    let line = |name: &str, x: &dyn Fn(&Vec<f64>, f64) -> f64, k: usize| {
        let (points, mark) = of(x, k);
        Series { mark, ..Series::new(name, points) }
    };
    let plot = |title: &str, axis: &str, x: &dyn Fn(&Vec<f64>, f64) -> f64| {
        let series = vec![line("RMS on the scalp", x, 0), line("RMS", x, 1), line("largest", x, 2)];
        Plot { title, axes: [axis, "error of distance, mm"], log: [true, true], series }.svg()
    };
    section.plots = vec![
        plot("Distance field: error against spacing", "distance between samples, mm", &|_, s| s),
        plot("Distance field: error against time to make it", "processor seconds", &|v, _| v[5]),
    ];
    Ok(section)
}

/// Of something that stands for the head alone.
fn of_head(asked: &[Asked], sample: &(dyn Fn(Vec3) -> Hit + Sync), seconds: f64, bytes: usize) -> [f64; 7] {
    let hairy: Vec<Asked> = asked.iter().filter(|a| a.hairy).copied().collect();
    let [rms, _, largest, angle, ns] = error(&hairy, sample);
    costed([rms, f64::NAN, largest, angle, ns], seconds, bytes)
}

fn costed([a, b, c, d, e]: [f64; 5], seconds: f64, bytes: usize) -> [f64; 7] {
    [a, b, c, d, e, seconds, bytes as f64 * 1e-6]
}

const BETWEEN: [&str; 5] =
    ["farthest vertex, mm", "RMS, mm", "largest, mm", "RMS against the motion itself, mm", "ns a query"];

/// Half-way between two frames.
fn between(bench: &mut Bench<'_>, known: &Known<'_>) -> Result<Section, Error> {
    let mut section = Section::new("Between frames", &BETWEEN).says(
        "The bust turns and nods. Fields at the default spacing of the poses at both ends of a span give the distance at \
         its middle: mixed as they are, or looked up where the surface came from and goes to, as it is done. The \
         reference is the exact distance to the mesh with its vertices half-way on straight lines, at points within 2 mm of \
         it; and once more to the mesh where the motion has it then, which no two frames can know. The end row is the \
         field of a pose itself: what its spacing is wrong by.",
    );
    let spans: &[f64] = if bench.quick { &[1.0, 8.0] } else { &[1.0, 2.0, 4.0, 8.0, 16.0] };
    let spacing = 1e3 * FieldSettings::default().voxel;
    const START: f64 = 1.2;
    for &frames in spans {
        let cell = OnceCell::new();
        let span = || {
            shots::lazily(&cell, || {
                let body = &known()?.0;
                let seconds = frames / RATE;
                let pose = [body.at(START), body.at(START + seconds)];
                let field = [0, 1].map(|i| body.field(&pose[i], spacing));
                let mix = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|x| 0.5 * (a[x] + b[x]));
                let middle: Vec<[f64; 3]> = pose[0].position.iter().zip(&pose[1].position).map(mix).collect();
                let rate = |(a, b): (&[f64; 3], &[f64; 3])| std::array::from_fn(|x| (b[x] - a[x]) / seconds);
                let velocity: Vec<[f64; 3]> = pose[0].position.iter().zip(&pose[1].position).map(rate).collect();
                let flow = [0, 1].map(|i| field[i].flow(&body.solid.mesh.triangle, &velocity));
                let bvh = body.solid.bvh(&middle);
                let asked = body.ask(&Pose { position: middle, bvh }, POINTS);
                let truly = body.at(START + 0.5 * seconds);
                let fastest = 1e3 * seconds * flow[0].fastest;
                Ok((seconds, field, flow, asked, truly, fastest))
            })
        };
        let measure = |naive: bool| {
            let (seconds, field, flow, asked, truly, fastest) = span()?;
            let d = Deforming { field: [&field[0], &field[1]], flow: [&flow[0], &flow[1]], seconds: *seconds };
            let mixed = |p: Vec3| {
                let [a, b] = [field[0].sample(p), field[1].sample(p)];
                Hit { distance: 0.5 * (a.distance + b.distance), ..a }
            };
            let carried = |p: Vec3| d.sample(p, 0.5);
            let sample: &(dyn Fn(Vec3) -> Hit + Sync) = if naive { &mixed } else { &carried };
            let [_, rms, largest, _, ns] = error(asked, sample);
            let exact = |p: Vec3| truly.bvh.closest(p, f64::INFINITY).map_or(f64::NAN, |c| c.signed_distance);
            let off = |a: &Asked| (1e3 * (sample(a.point).distance - exact(a.point))).powi(2);
            let itself = (asked.iter().map(off).sum::<f64>() / asked.len() as f64).sqrt();
            Ok([*fastest, rms, largest, itself, ns])
        };
        for (name, naive) in [("mixed", true), ("followed", false)] {
            section.row(bench, &format!("{frames}-frames/{name}"), || measure(naive))?;
        }
    }
    section.row(bench, "end", || {
        let body = &known()?.0;
        let pose = body.at(START);
        let field = body.field(&pose, spacing);
        let asked = body.ask(&pose, POINTS);
        let [_, rms, largest, _, ns] = error(&asked, &|p| field.sample(p));
        Ok([0.0, rms, largest, rms, ns])
    })?;
    let line = |scheme: &str, k: usize| {
        let rows = section.rows.iter().filter(|(n, _)| n.ends_with(scheme));
        Series::new(
            format!("{scheme}, {}", BETWEEN[k].trim_end_matches(", mm")),
            rows.map(|(_, v)| [v[0], v[k]]).collect(),
        )
    };
    let series = vec![line("mixed", 1), line("followed", 1), line("mixed", 2), line("followed", 2)];
    let title = "Half-way between two frames";
    let axes = ["way of the farthest vertex in the span, mm", "error of distance, mm"];
    section.plots = vec![Plot { title, axes, log: [true, true], series }.svg()];
    Ok(section)
}

/// What is rigid against a body that deforms.
fn moving(bench: &mut Bench<'_>, known: &Known<'_>) -> Result<Section, Error> {
    let mut section = Section::new(
        "Rigid stand-ins on a head that nods",
        &["RMS on the scalp, mm", "largest there, mm"],
    )
    .says(
        "The same motion at four moments: stand-ins of the rest pose, carried along by the rigid motion that fits the \
             scalp best, against the exact distance to the posed mesh where hair grows.",
    );
    let default = 1e3 * FieldSettings::default().voxel;
    for name in ["field", "table/cylinder", "table/sphere", "ellipsoid"] {
        section.row(bench, &format!("nod/{name}"), || {
            let body = &known()?.0;
            let field = (name == "field").then(|| body.field(&body.rest, default));
            let table = name.starts_with("table").then(|| body.table(name.ends_with("sphere"), [256, 128]));
            let ellipsoid = body.ellipsoid();
            let sample = |p: Vec3| match (&field, &table) {
                (Some(f), _) => f.sample(p),
                (_, Some(t)) => t.sample(p),
                _ => ellipsoid.sample(p),
            };
            let (mut square, mut largest) = (0.0, 0.0f64);
            let moments = [0.5, 1.0, 1.5, 2.5];
            for t in moments {
                let pose = body.at(t);
                let (at, mut asked) = (body.placement(&pose), body.ask(&pose, POINTS / 2));
                asked.retain(|a| a.hairy);
                let [rms, _, most, _, _] = error(&asked, &|p| sample(at.invert(p)));
                square += rms * rms / moments.len() as f64;
                largest = largest.max(most);
            }
            Ok([square.sqrt(), largest])
        })?;
    }
    Ok(section)
}

fn answers(stands: &Section, time: &Section, moving: &Section) -> Vec<String> {
    let row =
        |s: &Section, name: &str| s.rows.iter().find(|(n, _)| n == name).map(|(_, v)| v.clone()).unwrap_or_default();
    let default = FieldSettings::default().voxel * 1e3;
    let (own, exact) = (row(stands, &format!("field/{default}-mm")), row(stands, "exact"));
    let coarse = row(stands, &format!("field/{}-mm", 2.0 * default));
    let (table, sphere, ellipsoid) =
        (row(stands, "table/cylinder/256x128"), row(stands, "table/sphere/256x128"), row(stands, "ellipsoid"));
    let (mixed, followed, end) = (row(time, "1-frames/mixed"), row(time, "1-frames/followed"), row(time, "end"));
    let far = time.rows.iter().rev().find_map(|(n, _)| n.strip_suffix("-frames/followed")).unwrap_or_default();
    let [far_mixed, far_followed] = ["mixed", "followed"].map(|n| row(time, &format!("{far}-frames/{n}")));
    let (f, t, e) = (row(moving, "nod/field"), row(moving, "nod/table/sphere"), row(moving, "nod/ellipsoid"));
    let at = |v: &Vec<f64>, k: usize| v.get(k).copied().unwrap_or(f64::NAN);
    let fine = row(stands, &format!("field/{}-mm", 0.5 * default));
    let half = if fine.is_empty() {
        String::new()
    } else {
        format!(
            "; half the spacing gives {:.3} mm for {:.0} times the time and {:.0} times the memory",
            at(&fine, 0),
            at(&fine, 5) / at(&own, 5),
            at(&fine, 6) / at(&own, 6)
        )
    };
    vec![
        format!(
            "A field with the default {default} mm between samples is wrong by {:.3} mm RMS on the scalp (hair keeps {} mm from \
             the skin) and by {:.2} mm at most anywhere; {} mm gives {:.3} and {:.2} mm{half}. A query takes {:.0} ns where the \
             exact distance takes {:.0}.",
            at(&own, 0),
            Settings::default().offset * 1e3,
            at(&own, 2),
            2.0 * default,
            at(&coarse, 0),
            at(&coarse, 2),
            at(&own, 4),
            at(&exact, 4)
        ),
        format!(
            "Half-way through a frame in which the skin moves {:.0} mm, fields mixed in time are wrong by {:.2} mm RMS, \
             followed by their flow by {:.3} mm, the field of a frame itself by {:.3} mm; over {far} such frames, where it \
             moves {:.0} mm, by {:.2} and {:.3} mm.",
            at(&mixed, 0),
            at(&mixed, 1),
            at(&followed, 1),
            at(&end, 1),
            at(&far_mixed, 0),
            at(&far_mixed, 1),
            at(&far_followed, 1)
        ),
        format!(
            "Of the early stand-ins the cylinder's table is wrong by {:.2} mm on the scalp, the ball's by {:.2}, one \
             ellipsoid by {:.1} mm. On the nodding head, carried rigidly: field {:.2}, ball's table {:.2}, ellipsoid {:.1} mm.",
            at(&table, 0),
            at(&sphere, 0),
            at(&ellipsoid, 0),
            at(&f, 0),
            at(&t, 0),
            at(&e, 0)
        ),
    ]
}
