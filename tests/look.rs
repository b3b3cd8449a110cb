//! Laws of the look on exported hair.

use pelage::curves::{self, CurveSet};
use pelage_tests::{ShotFolder, deformed, grey_png, look_shot, small_shot};
use std::collections::{BTreeMap, BTreeSet};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";
const SHOT: &str = "pipeline.toml";

type V3 = [f64; 3];

/// The shot without collision, hair as its formulas leave it; only the frames are made and written.
fn open(shot: ShotFolder) -> ShotFolder {
    let text = String::from_utf8(shot.read(SHOT)).expect("text");
    shot.write(SHOT, format!("{text}\n[look]\ncollision = false\n").replace("\"usd\", ", ""));
    shot.report(&["--to", "export"]);
    shot
}

/// One layer with a look of its own on 0.5 hairs per square centimetre, nothing in the other.
fn with_look(frames: u32, look: &str) -> ShotFolder {
    let shot = small_shot(COMMAND, frames);
    shot.edit(GROOM, "value = 4.0", "value = 0.1");
    let groom = String::from_utf8(shot.read(GROOM)).expect("text");
    shot.write(GROOM, groom + "points = 13\n" + look);
    shot
}

fn layers(shot: &ShotFolder, frame: i32) -> Vec<CurveSet> {
    let file = shot.path().join("out/ball/hair.mcap");
    curves::read(&file, Some(f64::from(frame))).unwrap_or_else(|e| panic!("{e}")).layers
}

/// Hairs of the layer "over" at a frame by id, bit by bit.
fn over(shot: &ShotFolder, frame: i32) -> BTreeMap<u64, Vec<[f32; 3]>> {
    let layer = layers(shot, frame).into_iter().find(|l| l.name == "over").expect("the layer");
    let s = &layer.strands;
    (0..s.len()).map(|i| (s.id[i], s.points(i).to_vec())).collect()
}

fn minus(a: &[f32; 3], b: &[f32; 3]) -> V3 {
    std::array::from_fn(|x| f64::from(a[x]) - f64::from(b[x]))
}

fn dot(a: &V3, b: &V3) -> f64 {
    (0..3).map(|x| a[x] * b[x]).sum()
}

fn norm(a: &V3) -> f64 {
    dot(a, a).sqrt()
}

fn length(hair: &[[f32; 3]]) -> f64 {
    hair.windows(2).map(|w| norm(&minus(&w[1], &w[0]))).sum()
}

/// Angle between two vectors.
fn angle(a: &V3, b: &V3) -> f64 {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    norm(&cross).atan2(dot(a, b))
}

#[test]
fn every_effect_leaves_roots_names_and_counts() {
    let looked = open(look_shot(COMMAND, 4));
    let plain = small_shot(COMMAND, 4);
    plain.edit(GROOM, "color =", "points = 25\ncolor =");
    let plain = open(plain);
    let mut bent = 0;
    for frame in 1..=4 {
        for (a, b) in layers(&looked, frame).iter().zip(&layers(&plain, frame)) {
            let (s, t) = (&a.strands, &b.strands);
            assert_eq!((&s.id, &s.offsets, s.origin), (&t.id, &t.offsets, t.origin));
            assert!(s.len() > 300 && s.position.iter().flatten().all(|x| x.is_finite()));
            for i in 0..s.len() {
                assert_eq!(s.points(i)[0], t.points(i)[0], "the root of hair {} of {} moved", s.id[i], a.name);
                bent += usize::from(s.points(i) != t.points(i));
            }
        }
    }
    // Wind, waves and frizz spare no hair.
    assert_eq!(bent, 4 * layers(&plain, 1).iter().map(|l| l.strands.len()).sum::<usize>());
}

#[test]
fn lengths_are_those_of_the_mode() {
    let plain = over(&open(with_look(1, "")), 1);
    let clump = "[[layer.clump]]\ndensity = 0.25\npercent = 0.9\nrate = 0.5\nkeep_length = ";
    let curl = "[layer.curl]\nkind = \"helix\"\nradius = 0.1\npitch = 1.2\nkeep_length = ";
    let noise = "[[layer.noise]]\namplitude = 0.05\nsize = 0.5\nkeep_length = ";
    let wave = "[[layer.wave]]\nx = { amplitude = [0.1, 0.1, 0.1, 0.1], frequency = [2, 2, 2, 2] }\nkeep_length = ";
    let wind = "[layer.wind]\namplitude = 0.5\ndirection = [1, 0, 0]\nsize = 3\n# ";
    for (name, look) in [("clump", clump), ("curl", curl), ("noise", noise), ("wave", wave), ("wind", wind)] {
        let kept = over(&open(with_look(1, &format!("{look}true\n"))), 1);
        let worst = plain.iter().map(|(id, h)| (length(&kept[id]) / length(h) - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-5, "{name} changes a length by {worst}");
        assert!(kept != plain);
        if name == "wind" {
            continue;
        }
        let free = over(&open(with_look(1, &format!("{look}false\n"))), 1);
        let changes: Vec<f64> = plain.iter().map(|(id, h)| length(&free[id]) / length(h) - 1.0).collect();
        let mean = changes.iter().sum::<f64>() / changes.len() as f64;
        match name {
            // A hair drawn to a neighbour may become shorter or longer.
            "clump" => assert!(changes.iter().any(|c| c.abs() > 1e-3)),
            // A helix of radius r and pitch p is sqrt(1 + (2 pi r / p)^2) as long: 1.129, less where it begins at the
            // root, and drawn with corners.
            "curl" => assert!((0.06..0.13).contains(&mean), "curls make hair longer by {mean}"),
            _ => assert!(mean > 0.01, "{name} makes hair longer by {mean}"),
        }
    }
}

#[test]
fn at_full_percent_and_no_rate_tips_meet_at_their_centres() {
    let plain = open(with_look(2, ""));
    let clumped = |density: &str| {
        let look = format!("[[layer.clump]]\ndensity = {density}\npercent = 1\nrate = 0\n");
        let shot = open(with_look(2, &look));
        let report: serde_json::Value = serde_json::from_slice(&shot.read("out/ball/report.json")).expect("a report");
        let counts = &report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == "instance");
        let n = counts.expect("the stage")["counts"]["clumps in level 0 of layer over"].as_u64().expect("a count");
        (shot, n as usize)
    };
    let (few, n) = clumped("0.125");
    let (more, m) = clumped("0.25");
    assert!(n > 20 && m > n, "{n} and {m} clumps");
    let mut centres = [BTreeSet::new(), BTreeSet::new()];
    for frame in [1, 2] {
        let straight = over(&plain, frame);
        for ((shot, n), centres) in [(&few, n), (&more, m)].into_iter().zip(&mut centres) {
            let hairs = over(shot, frame);
            let own: BTreeMap<u64, [u32; 3]> = hairs
                .iter()
                .filter(|(id, h)| straight[*id] == **h)
                .map(|(id, h)| (*id, h[12].map(f32::to_bits)))
                .collect();
            // Only centres stay, and every tip is one of theirs, bit for bit.
            assert_eq!(own.len(), n);
            let tips: BTreeSet<[u32; 3]> = own.values().copied().collect();
            assert!(hairs.values().all(|h| tips.contains(&h[12].map(f32::to_bits))));
            let ids: BTreeSet<u64> = own.into_keys().collect();
            assert!(centres.is_empty() || *centres == ids, "other centres at another frame");
            *centres = ids;
        }
    }
    assert!(centres[0].is_subset(&centres[1]), "a higher clump density takes centres away");
}

#[test]
fn under_a_rigid_motion_curls_move_rigidly() {
    let look = "[[layer.clump]]\ndensity = 0.25\n[layer.curl]\nkind = \"dished\"\nradius = 0.1\npitch = 0.8\n\
                [[layer.wave]]\nx = { amplitude = [0.1, 0.1, 0.1, 0.1], frequency = [2, 2, 2, 2] }\nsize = 1\n\
                [[layer.noise]]\namplitude = 0.05\nsize = 0.5\n";
    let shot = open(with_look(4, look));
    let first = over(&shot, 1);
    for frame in 2..=4 {
        // The motion's table: 0.05 rad about y and 0.1 cm along x a frame.
        let k = f64::from(frame - 1);
        let (sin, cos) = (0.05 * k).sin_cos();
        let mut worst = 0.0f64;
        for (id, hair) in over(&shot, frame) {
            for (p, q) in first[&id].iter().zip(&hair) {
                let [x, y, z] = p.map(f64::from);
                let there = [cos * x + sin * z + 0.1 * k, y, cos * z - sin * x];
                worst = (0..3).map(|x| (there[x] - f64::from(q[x])).abs()).fold(worst, f64::max);
            }
        }
        assert!(worst < 1e-5 * 2.5, "frame {frame}: {worst} cm off");
    }
}

#[test]
fn on_a_deforming_skin_offsets_turn_with_the_hair() {
    let curl = "[layer.curl]\nkind = \"helix\"\nradius = 0.1\npitch = 0.8\nkeep_length = false\n";
    let [plain, curled] = ["", curl].map(|look| {
        let shot = with_look(6, look);
        for frame in 1..=6 {
            shot.write(&format!("anim/ball.{frame:04}.ply"), deformed(2.0 * f64::from(frame)));
        }
        shot.edit(SHOT, "motion = \"grooms/ball.csv\"", "frames = \"anim/ball.####.ply\"");
        open(shot)
    });
    type Hairs = BTreeMap<u64, Vec<[f32; 3]>>;
    let (mut before, mut most, mut worst) = (None::<(Hairs, Hairs)>, 0.0f64, 0.0f64);
    for frame in 1..=6 {
        let now = (over(&plain, frame), over(&curled, frame));
        if let Some((straight, bent)) = &before {
            for (id, b) in &now.1 {
                let (a, s, t) = (&bent[id], &straight[id], &now.0[id]);
                // How far segments of the middle line turn from frame to frame, at most up to each point.
                let mut turn = 0.0f64;
                for k in 1..13 {
                    turn = turn.max(angle(&minus(&s[k], &s[k - 1]), &minus(&t[k], &t[k - 1])));
                    let (o, p) = (minus(&a[k], &s[k]), minus(&b[k], &t[k]));
                    // Where curls begin at the root offsets are too small to have a direction.
                    if norm(&o) > 0.03 && norm(&p) > 0.03 {
                        most = most.max(angle(&o, &p));
                        worst = worst.max(angle(&o, &p) - 2.0 * turn);
                    }
                }
            }
        }
        before = Some(now);
    }
    assert!(most > 0.01, "nothing turned");
    assert!(
        most < 0.2 && worst < 0.05,
        "offsets turn by {most} rad in a frame, {worst} more than twice the hair's turn"
    );
}

#[test]
fn edits_of_maps_of_the_look_touch_only_hairs_under_them() {
    let block = |x: u32, y: u32| (96..128).contains(&x) && (96..128).contains(&y);
    let paint = |x: u32, y: u32| (128 + (x + y) % 32) as u8;
    let look = "[[layer.clump]]\ndensity = 0.25\npercent = { value = 0.9, map = \"../maps/percent.png\" }\n\
                [layer.curl]\nkind = \"helix\"\npitch = 0.8\nradius = { value = 0.2, map = \"../maps/radius.png\" }\n";
    let shot = with_look(1, look);
    let maps = ["maps/percent.png", "maps/radius.png"];
    maps.iter().for_each(|m| shot.write(m, grey_png(256, 256, paint)));
    let shot = open(shot);
    let hairs = |shot: &ShotFolder| pelage_tests::exported_hairs(&shot.path().join("out/ball/hair.mcap"));
    let before = hairs(&shot);
    for map in maps {
        shot.write(map, grey_png(256, 256, |x, y| if block(x, y) { 20 } else { paint(x, y) }));
        shot.report(&["--to", "export"]);
        let after = hairs(&shot);
        let (mut inside, mut changed) = (0, 0);
        for (key, hair) in &before {
            let [u, v] = hair.uv().map(|x| 256.0 * x);
            let under = (95.0..=129.0).contains(&u) && (127.0..=161.0).contains(&v);
            inside += usize::from(under);
            changed += usize::from(after[key] != *hair);
            assert!(under || after[key] == *hair, "hair {key:?} outside the edit of {map} is another");
        }
        assert!(inside > 3 && changed > 0, "{changed} of {inside} hairs under the edit of {map} changed");
        shot.write(map, grey_png(256, 256, paint));
    }
}

#[test]
fn wet_hair_is_wider_where_particles_have_hit() {
    let shot = look_shot(COMMAND, 4);
    let report = shot.report(&["--to", "export"]);
    let counts = |report: &serde_json::Value| {
        let counts = &report["stages"].as_array().expect("stages")[3]["counts"];
        ["on", "past"].map(|n| counts[&format!("particles {n} the skin")].as_u64().expect("a count"))
    };
    // Two a frame, all of which hit the ball: counted once, not once a frame.
    assert_eq!(counts(&report), [8, 0], "{report}");
    let under = |frame: i32| layers(&shot, frame).into_iter().find(|l| l.name == "under").expect("the layer");
    let mut seen = 0;
    for frame in 1..=4 {
        let layer = under(frame);
        let dry = (0..layer.strands.len()).filter(|i| layer.width[layer.strands.offsets.range(*i).start] < 41e-4);
        let wet = layer.strands.len() - dry.count();
        assert!(wet >= seen && wet < layer.strands.len() / 2, "{wet} wet hairs at frame {frame}, {seen} before");
        seen = wet;
    }
    assert!(seen > 5, "{seen} wet hairs");
    shot.edit(GROOM, "spread = 10", "spread = 180\nframes = [-3, 2]");
    let report = shot.report(&["--to", "export"]);
    let [on, past] = counts(&report);
    assert!(on + past == 4 && past > 0, "{on} and {past} particles");
    assert!(report.to_string().contains("emitter hose: particles that leave before frame 1 open no areas"), "{report}");
}
