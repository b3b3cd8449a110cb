#![allow(clippy::disallowed_methods, missing_docs)]
use pelage_geom::{Bvh, Offsets, Topology, shapes};
use pelage_sim::*;
use std::time::Instant as Clock;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let every: usize = a[1].parse().unwrap();
    let segments: usize = a[2].parse().unwrap();
    let frames: usize = a[3].parse().unwrap();
    let friction: f64 = a[4].parse().unwrap();
    let substeps: Option<u32> = a.get(5).and_then(|s| s.parse().ok());
    let bytes = std::fs::read("/tmp/s2/out/sample/hair.1001.ply").unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let head = String::from_utf8_lossy(&bytes[..end]).to_string();
    let vprops =
        head.split("element vertex").nth(1).unwrap().split("element").next().unwrap().matches("property").count();
    let n = 175152;
    let f = |i: usize, k: usize| {
        f32::from_le_bytes(bytes[end + (i * vprops + k) * 4..][..4].try_into().unwrap()) as f64 * 0.01
    };
    let hairs: Vec<usize> = (0..n / 12).step_by(every).collect();
    let mut position = vec![];
    for &h in &hairs {
        for i in 0..12 {
            position.push([f(h * 12 + i, 0), f(h * 12 + i, 1), f(h * 12 + i, 2)]);
        }
    }
    let offsets = Offsets::uniform(hairs.len(), 12);
    let id: Vec<u64> = hairs.iter().map(|h| *h as u64).collect();
    let tolerance: f64 = a.get(6).map_or(1e-5, |s| s.parse().unwrap());
    let settings = Settings { tolerance, segments: Some(segments), friction, substeps, ..Settings::default() };
    let g = [0.0, -9.81, 0.0];
    let t = Clock::now();
    let (mut sim, started) =
        Simulation::new(&Hairs { offsets: &offsets, position: &position, id: &id }, &settings, g).unwrap();
    println!(
        "{} hairs, new {:.2} s, stiffened {} (unstable {}) gamma {:.0} hinge {:.2} bytes {:.0} MB",
        hairs.len(),
        t.elapsed().as_secs_f64(),
        started.stiffened.len(),
        started.stiffened.iter().filter(|s| s.factor == 0.0).count(),
        started.largest_gamma,
        started.largest_hinge,
        started.bytes as f64 / 1e6
    );
    let sample = shapes::bust();
    let mesh = sample.mesh;
    let topology = Topology::new(&mesh);
    let closed = Closed::new(&mesh, &topology);
    let metres: Vec<[f64; 3]> = closed.mesh.position.iter().map(|p| p.map(|x| x * 0.01)).collect();
    let bvh = Bvh::build(&metres, &closed.mesh.triangle, &closed.topology);
    let t = Clock::now();
    let field = Field::build(&metres, &closed.mesh.triangle, &closed.topology, &bvh, &FieldSettings::default(), None);
    println!("field {:.2} s", t.elapsed().as_secs_f64());
    let shake = shapes::head_shake();
    let roots: Vec<Root> =
        (0..hairs.len()).map(|h| Root { position: position[12 * h], rotation: [0.0, 0.0, 0.0, 1.0] }).collect();
    let pivot = shapes::BUST_PIVOT;
    let before = 12.0;
    let total = Clock::now();
    for k in 0..frames {
        let motion = |f: f64| {
            let t = shake.at((k as f64 + f - before) / 24.0, pivot.map(|x| x * 0.01));
            Rigid { rotation: t.rotation, translation: t.apply(Vec3::zeros()).into() }
        };
        let body = Body {
            parts: vec![Part {
                motion: &motion,
                shape: Shape::Field(&field),
                exact: Some(Exact { bvh: &bvh, triangle: &closed.mesh.triangle, velocity: None }),
            }],
            seconds: 1.0 / 24.0,
        };
        let t = Clock::now();
        let span = Span {
            seconds: 1.0 / 24.0,
            time: k as f64 / 24.0,
            motion: &motion,
            roots: [&roots, &roots],
            tips: None,
            body: &body,
            gravity: [g, g],
            wind: None,
        };
        let r = sim.advance(&span, &|_| true).unwrap();
        let s = t.elapsed().as_secs_f64();
        println!(
            "frame {k}: {s:.2} s, {:.0} ns/node/step(2thr) steps {} shortest {:.1e} sub {} solves/step {:.2} strain {:.1e} corrected {} deepest {:.2e} sleeping {} held {} nodesteps {}",
            s * 2e9 / r.particle_steps as f64,
            r.steps,
            r.shortest_step,
            r.subdivided,
            r.particle_solves as f64 / r.particle_steps as f64,
            r.largest_strain,
            r.corrected,
            r.deepest,
            r.sleeping,
            r.held.len(),
            r.particle_steps
        );
    }
    println!("total {:.2} s", total.elapsed().as_secs_f64());
}
