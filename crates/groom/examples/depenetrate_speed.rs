//! Time of depenetration on the sample bust: hair that falls from the scalp in curls, long and short, and how it ends.
#![allow(missing_docs, clippy::disallowed_methods)]

use pelage_geom::{Bvh, Offsets, Topology, Vec3, shapes};
use pelage_groom::candidates::candidates;
use pelage_groom::depenetrate::{Depenetrate, depenetrate};
use std::time::Instant;

/// A hair that leaves along the normal, turns down and winds around its way; `lift` 0 falls right through the head. With
/// `flat` it is combed along the skin instead.
fn hair(root: Vec3, normal: Vec3, points: usize, case: &Case, bvh: &Bvh) -> Vec<[f32; 3]> {
    let l = case.length / (points - 1) as f64;
    let (mut at, mut d) = (root, normal);
    let mut out = vec![[root.x as f32, root.y as f32, root.z as f32]];
    for k in 1..points {
        d = (d * case.lift - Vec3::y() * (1.0 - case.lift)).normalize();
        at += d * l;
        if let (true, Some(c)) = (case.flat, bvh.closest(at, 3.0 * l)) {
            at = c.position + c.normal * c.signed_distance.max(case.curl * 0.5);
        }
        let (a, r) = (2.0 * l * k as f64, case.curl * (k as f64 / points as f64));
        let p = at + Vec3::new(libm::cos(a), 0.0, libm::sin(a)) * r;
        out.push([p.x as f32, p.y as f32, p.z as f32]);
    }
    out
}

struct Case {
    name: &'static str,
    length: f64,
    lift: f64,
    curl: f64,
    flat: bool,
}

fn main() {
    let sample = shapes::bust();
    let mesh = &sample.mesh;
    let topology = Topology::new(mesh);
    let start = Instant::now();
    let bvh = Bvh::build(&mesh.position, &mesh.triangle, &topology);
    println!("bust: {} triangles, hierarchy {:.3} s", mesh.triangle.len(), start.elapsed().as_secs_f64());
    let settings = Depenetrate { step: 0.1, clearance: 0.005, held: 0.1 };
    let case = |name, length, lift, curl, flat| Case { name, length, lift, curl, flat };
    for (case, hairs, points) in [
        (case("long, stands off", 22.0, 0.93, 0.1, false), 14_600, 26),
        (case("long, combed flat, curled", 22.0, 0.5, 0.3, true), 14_600, 26),
        (case("long, lies on the head", 22.0, 0.85, 0.3, false), 14_600, 26),
        (case("long, falls through the head", 22.0, 0.6, 0.3, false), 14_600, 26),
        (case("short", 3.0, 0.85, 0.1, false), 100_000, 12),
        (case("short, combed flat, curled", 3.0, 0.5, 0.15, true), 100_000, 12),
    ] {
        let mut all = Vec::new();
        let roots = candidates(mesh, &topology, 7, 5 * hairs, &mut |_| true).expect("an area").root;
        for root in &roots {
            let tri = mesh.triangle[root.triangle as usize].map(|v| Vec3::from(mesh.position[v as usize]));
            let (p, n) = (root.blend(tri), (tri[1] - tri[0]).cross(&(tri[2] - tri[0])).normalize());
            if shapes::scalp(p) > 0.5 && all.len() < hairs * points {
                all.extend(hair(p, n, points, &case, &bvh));
            }
        }
        let offsets = Offsets::uniform(all.len() / points, points);
        let mut times = Vec::new();
        let mut counts = Default::default();
        for _ in 0..3 {
            let mut moved = all.clone();
            let start = Instant::now();
            counts = depenetrate(&bvh, &settings, None, &offsets, [0.0; 3], None, &mut moved);
            times.push(start.elapsed().as_secs_f64());
        }
        let best = times.iter().copied().fold(f64::INFINITY, f64::min);
        println!(
            "{}: {} hairs x {points}: {best:.3} s, {:.0} ns a point; {counts:?}",
            case.name,
            offsets.len(),
            1e9 * best / all.len() as f64
        );
    }
}
