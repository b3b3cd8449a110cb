//! Opacity shadow maps: error against cost, and speed.
//!
//! `cargo bench -p pelage-light --bench shadow`
// A benchmark has to read the clock, which the crate itself must not.
#![allow(clippy::disallowed_methods)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Groom, curly, fur, long, score, some_points};
use pelage_geom::Vec3;
use pelage_light::shadow::{Footprint, Quality, ShadowSettings, Source, transmittance, transmittance_exact};
use std::hint::black_box;
use std::time::Instant;

fn main() {
    let source = Source::Directional { direction: Vec3::new(-0.4, -1.0, -0.3) };
    let grooms: Vec<(&str, Groom)> =
        vec![("long", long(50_000, 26)), ("fur", fur(100_000, 9)), ("curly", curly(10_000, 101))];
    let footprint = Footprint { side: 1.0 / 256.0, rays: 1024, seed: 1 };
    for (name, groom) in &grooms {
        let layers = [groom.view()];
        let points = some_points(&layers, 2000);
        let start = Instant::now();
        let truth = transmittance_exact(source, &layers, &[], &footprint, &points).expect("light");
        let each = start.elapsed().as_secs_f64() / points.len() as f64;
        let mean = truth.iter().map(|t| t.mean).sum::<f64>() / truth.len() as f64;
        println!("# {name}: exact {:.1} us per point of 1058 rays, mean {mean:.4}", 1e6 * each);
        for texels in [128, 256, 512, 1024, 2048] {
            for slices in [32, 64, 128, 256] {
                let settings = ShadowSettings { texels, slices, ..Quality::Default.settings() };
                let start = Instant::now();
                let (light, counts) = transmittance(source, &layers, &[], &settings).expect("light");
                let s = start.elapsed().as_secs_f64();
                let [rms, p95, bias] = score(&light, &points, &truth);
                println!(
                    "{name},{texels},{slices},{rms:.4},{p95:.4},{bias:+.4},{s:.3},{:.1}",
                    counts.bytes as f64 / 1e6
                );
            }
        }
    }
    let groom = long(100_000, 26);
    let layers = [groom.view()];
    let mut seconds: Vec<f64> = (0..5)
        .map(|_| {
            let start = Instant::now();
            black_box(transmittance(source, &layers, &[], &Quality::Default.settings()).expect("light"));
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    println!("# speed: 2,500,000 segments, median {:.3} s, best {:.3} s", seconds[2], seconds[0]);
}
