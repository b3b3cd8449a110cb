//! How fast hair is written, against a plain sequential write of the same bytes to the same disk.
//!
//! `cargo bench -p pelage --bench export [-- CURVES POINTS FRAMES]`

use pelage::format::mcap::{self, McapHair, read_frame_payload, write_frame_payload};
use pelage::format::usd::{self, UsdHair};
use pelage::format::{HairFrame, HairLayer, ShotFacts};
use pelage_geom::Offsets;
use std::fs::File;
use std::io::{Cursor, Write};
use std::path::Path;
use std::time::Instant;

type Points = Vec<[f32; 3]>;

fn main() {
    let numbers: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let [curves, points, frames] = numbers.try_into().unwrap_or([100_000, 32, 6]);
    let (facts, layer) = shot(curves, points, frames);
    let layers = [layer];
    let (position, velocity) = frame(&layers[0], 0.0);
    let data = [HairFrame { position: &position, velocity: &velocity, ..HairFrame::default() }];
    let bytes = frames * 2 * size_of_val(position.as_slice());
    println!("{curves} curves x {points} points x {frames} frames: {:.1} MB of points and velocities", mb(bytes));

    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut plain = 0.0f64;
    for round in 0..3 {
        let path = folder.join("plain.bin");
        let rate = write_rate(&path, bytes, || {
            let mut file = File::create(&path).expect("a file in the target folder");
            for _ in 0..frames {
                file.write_all(bytemuck::cast_slice(&position)).expect("space on the disk");
                file.write_all(bytemuck::cast_slice(&velocity)).expect("space on the disk");
            }
        });
        plain = plain.max(rate);
        let path = folder.join("hair.usdc");
        let usdc = write_rate(&path, bytes, || {
            let mut out = UsdHair::create(&path, &facts, &layers).expect("a file in the target folder");
            facts.frames.iter().for_each(|&f| out.write_frame(f, &data).expect("space on the disk"));
            out.finish().expect("space on the disk");
        });
        let path = folder.join("hair.mcap");
        let mcap = write_rate(&path, bytes, || {
            let mut out = McapHair::create(&path, &facts, &layers).expect("a file in the target folder");
            facts.frames.iter().for_each(|&f| out.write_frame(f, &data).expect("space on the disk"));
            out.finish().expect("space on the disk");
        });
        println!("round {round}, with sync, MB/s: plain write {rate:.0}, usdc {usdc:.0}, mcap {mcap:.0}");
    }
    let path = folder.join("hair.usdc");
    report("usdc verify", bytes, || usd::verify(&path, &facts, &layers).expect("the file just written"));
    let path = folder.join("hair.mcap");
    let sizes: Vec<[usize; 2]> = layers.iter().map(|l| [l.offsets.len(), l.offsets.total()]).collect();
    report("mcap verify", bytes, || {
        mcap::verify_layers(&path, &facts, &layers).expect("the file just written");
        mcap::verify_frames(&path, &facts, &sizes).expect("the file just written");
    });
    for name in ["plain.bin", "hair.usdc", "hair.mcap"] {
        std::fs::remove_file(folder.join(name)).expect("the file just written");
    }
    payload(&position);
}

/// Writing and reading the positions of a frame in memory, against copying them.
fn payload(position: &Points) {
    let bytes = size_of_val(position.as_slice());
    for _ in 0..2 {
        let mut copy: Points = vec![[0.0; 3]; position.len()];
        report("copy in memory", bytes, || copy.copy_from_slice(position));
        let mut out = Cursor::new(Vec::with_capacity(bytes + 4096));
        report("frame payload, write to memory", bytes, || {
            write_frame_payload(&mut out, "hair", 1, &[position]).expect("memory");
        });
        let written = out.into_inner();
        let mut back = vec![];
        report("frame payload, read from memory", bytes, || back = read_frame_payload(&written).expect("the same"));
        assert!(back == [position.as_slice()] && copy == *position);
    }
}

fn mb(bytes: usize) -> f64 {
    bytes as f64 / 1e6
}

fn report(what: &str, bytes: usize, run: impl FnOnce()) {
    let start = Instant::now();
    run();
    let seconds = start.elapsed().as_secs_f64();
    println!("{what}: {seconds:.3} s, {:.2} GB/s", mb(bytes) / 1e3 / seconds);
}

/// Megabytes a second of `run`, which writes `path`, with its bytes on the disk.
fn write_rate(path: &Path, bytes: usize, run: impl FnOnce()) -> f64 {
    let start = Instant::now();
    run();
    File::open(path).and_then(|f| f.sync_all()).expect("the file just written");
    mb(bytes) / start.elapsed().as_secs_f64()
}

fn shot(curves: usize, points: usize, frames: usize) -> (ShotFacts, HairLayer) {
    let facts = ShotFacts {
        lights: vec![],
        name: "bench".into(),
        meters_per_unit: 0.01,
        up: 'Y',
        fps: 24.0,
        frames: (1..=frames as i32).collect(),
        origin: [0.0; 3],
        extra: vec![],
    };
    let total = curves * points;
    let rest = |i: usize| {
        let (curve, along) = (i / points, (i % points) as f32 / points as f32);
        [(curve % 317) as f32 * 0.05, along, (curve / 317) as f32 * 0.05 + along * along]
    };
    let layer = HairLayer {
        name: "overcoat".into(),
        offsets: Offsets::uniform(curves, points),
        id: (0..curves as u64).collect(),
        root_uv: (0..curves).map(|i| [i as f32 / curves as f32, 0.5]).collect(),
        rest: (0..total).map(rest).collect(),
        width: vec![0.008; total],
        color: vec![[0.4, 0.3, 0.2]; curves],
        opacity: vec![1.0; curves],
        ..HairLayer::default()
    };
    (facts, layer)
}

fn frame(layer: &HairLayer, time: f32) -> (Points, Points) {
    let position = layer.rest.iter().map(|p| [p[0] + time * p[1], p[1], p[2]]).collect();
    (position, layer.rest.iter().map(|p| [p[1], 0.0, 0.0]).collect())
}
