//! Control hairs shaped in every way: clusters, hairs one by one, chains, mirrors, key frames, dividers, skin of patches,
//! grooms of several files.

use pelage_tests::{ShotFolder, ascii_ply, exported_hairs, grey_png, small_shot};
use std::collections::BTreeMap;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";
const SHOT: &str = "pipeline.toml";

/// Points of every hair at a frame of the exported file (0 the first), by layer and id, in the skin's rest pose if `rest`.
fn positions(shot: &ShotFolder, frame: Option<usize>) -> BTreeMap<(String, u64), Vec<[f64; 3]>> {
    let mut read = pelage::format::mcap::read_hair_mcap(&shot.path().join("out/ball/hair.mcap")).expect("a file");
    let names: Vec<String> = read.layer_names().map(str::to_owned).collect();
    let mut out = BTreeMap::new();
    for (l, name) in names.into_iter().enumerate() {
        let layer = read.layer(l).expect("a layer");
        let now = frame.map(|f| read.frame(f, l).expect("a frame").position);
        for (i, id) in layer.id.iter().enumerate() {
            let all = now.as_ref().unwrap_or(&layer.rest);
            let points = all[layer.offsets.range(i)].iter().map(|p| p.map(f64::from)).collect();
            out.insert((name.clone(), *id), points);
        }
    }
    out
}

/// The small shot without motion, with another groom.
fn groomed(groom: &str) -> ShotFolder {
    let shot = small_shot(COMMAND, 3);
    shot.edit(SHOT, "motion = \"grooms/ball.csv\"\n", "");
    shot.write(GROOM, groom);
    shot
}

fn length(line: &[[f64; 3]]) -> f64 {
    line.windows(2).map(|w| apart(w[0], w[1])).sum()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|x| (a[x] - b[x]) * (a[x] - b[x])).sum::<f64>().sqrt()
}

/// The outputs are those of a run that starts from nothing.
fn is_as_from_nothing(shot: &ShotFolder) {
    let fresh = shot.fresh();
    fresh.report(&[]);
    assert!(shot.outputs() == fresh.outputs());
}

fn refused(shot: &ShotFolder, words: &[&str]) {
    let out = shot.pelage(&["run", "--quiet"]);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(2), "{said}");
    words.iter().for_each(|w| assert!(said.contains(w), "`{w}` is not said: {said}"));
}

const BRAID: &str = r#"
[control]
placement = { per_cm2 = 0.3 }
points = 10

[scalp]
centre = [0.0, 0.0, 0.0]
up = [0.0, 1.0, 0.0]
front = [0.0, 0.0, 1.0]

[[cluster]]
name = "tail"
root = [0.0, 5.0, 0.0]
radius = 3.0
points = [[0.0, 9.0, 0.0], [0.0, 13.0, 0.0], [0.0, 17.0, 0.0]]
width = [3.0, 1.5, 1.5]

[[cluster_edit]]
kind = "braid"
of = "tail"
turns = 2.0

[[cluster_edit]]
kind = "copy"
of = "tail"
to = "tail/*"

[[comb]]
kind = "cluster"

[[layer]]
name = "hair"
in_clusters = true
density = { value = 3.0 }
length = { value = 20.0 }
points = 60

[layer.cluster]
"#;

#[test]
fn a_braid_of_braids_is_within_its_cluster_and_edits_of_it_are_told() {
    let shot = groomed(BRAID);
    shot.report(&[]);
    let hairs = positions(&shot, Some(2));
    assert!(hairs.len() > 50, "{} hairs", hairs.len());
    let mut strands = [0; 9];
    for (name, line) in &hairs {
        let root = line[0];
        assert!((root[0].hypot(root[1]).hypot(root[2]) - 5.0).abs() < 0.1, "{name:?} is rooted on the ball");
        // All are as long as they should be, end near the cluster's end, and are inside of it from where they have come together.
        assert!((19.8..20.01).contains(&length(line)), "{name:?} is {} long", length(line));
        let tip = line[line.len() - 1];
        assert!(tip[1] > 13.0 && tip[1] < 18.5 && tip[0].hypot(tip[2]) < 1.6, "{name:?} ends at {tip:?}");
        for p in line.iter().filter(|p| p[1] > 10.0) {
            assert!(p[0].hypot(p[2]) < 1.65, "{name:?} at {p:?}");
        }
        // Which of nine strands: hairs of one are close to each other at the tip.
        let other = hairs.values().filter(|o| apart(o[o.len() - 1], tip) < 0.35).count();
        strands[0] = strands[0].max(other);
    }
    assert!(strands[0] < hairs.len() / 2, "hairs are in strands");
    // An edit combs and moves hair, and grows no other.
    shot.edit(GROOM, "[0.0, 17.0, 0.0]]", "[1.0, 17.0, 0.0]]");
    let (run, why) = shot.plan(&[]);
    let moved = "grooms/ball.toml: cluster[0].points [[0.0,9.0,0.0],[0.0,13.0,0.0],[0.0,17.0,0.0]] -> \
                 [[0.0,9.0,0.0],[0.0,13.0,0.0],[1.0,17.0,0.0]]";
    assert_eq!(why.iter().collect::<Vec<_>>(), [moved]);
    assert!(
        run.contains("groom/comb") && run.contains("interpolate/hair/1") && !run.contains("instance/roots/hair"),
        "{run:?}"
    );
    shot.report(&[]);
    let leaning = positions(&shot, None);
    assert!(leaning.keys().eq(hairs.keys()), "the same hairs");
    let mean = leaning.values().map(|l| l[l.len() - 1][0]).sum::<f64>() / leaning.len() as f64;
    assert!((mean - 0.85).abs() < 0.35, "{mean}");
    is_as_from_nothing(&shot);
}

#[test]
fn a_braid_with_key_frames_is_in_each_the_braid_of_its_values() {
    let [still, swung] = [
        "[[0.0, 9.0, 0.0], [0.0, 13.0, 0.0], [0.0, 17.0, 0.0]]",
        "[[2.0, 9.0, 0.0], [7.0, 10.0, 1.0], [12.0, 9.0, 3.0]]",
    ];
    let look = "[layer.cluster]\n[[layer.clump]]\nclusters = 2\npercent = 0.7\n";
    let groom = |points: &str| BRAID.replace(still, points).replace("[layer.cluster]\n", look);
    let shot = groomed(&groom(&format!("[{{ frame = 1, value = {still} }}, {{ frame = 3, value = {swung} }}]")));
    shot.report(&[]);
    let moving = [0, 2].map(|f| positions(&shot, Some(f)));
    for (points, moving) in [still, swung].into_iter().zip(&moving) {
        shot.write(GROOM, groom(points));
        shot.report(&[]);
        let alone = positions(&shot, Some(2));
        assert!(alone.keys().eq(moving.keys()));
        let off =
            |(a, b): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| a.iter().zip(b).map(|(p, q)| apart(*p, *q)).fold(0.0, f64::max);
        let most = alone.values().zip(moving.values()).map(off).fold(0.0, f64::max);
        assert!(most < 1e-3, "{points}: off by {most}");
    }
    let tip = |at: &BTreeMap<_, Vec<[f64; 3]>>| at.values().map(|l| l[l.len() - 1][0]).sum::<f64>() / at.len() as f64;
    assert!(tip(&moving[0]).abs() < 1.0 && tip(&moving[1]) > 9.0);
}

#[test]
fn a_layer_without_hairs_is_written_in_every_format() {
    let shot = groomed(&BRAID.replace("density = { value = 3.0 }", "density = { value = 0.0 }"));
    shot.edit(SHOT, "formats = [\"usd\", \"mcap\"]", "formats = [\"usd\", \"mcap\", \"ply\"]");
    shot.report(&[]);
    assert!(positions(&shot, Some(0)).is_empty());
    assert!(shot.path().join("out/ball/hair.usdc").is_file() && shot.path().join("out/ball/hair.0001.ply").is_file());
}

#[test]
fn clusters_are_clumps() {
    let shot = groomed(BRAID);
    shot.edit(GROOM, "\n[layer.cluster]\n", "\n[[layer.clump]]\nclusters = 1\npercent = 1.0\nrate = 1.0\n");
    let report = shot.report(&[]);
    assert_eq!(report["stages"][1]["counts"]["clumps in level 0 of layer hair"], 3);
    let hairs = positions(&shot, Some(0));
    // Every tip is at the end of one of three strands.
    let mut ends: Vec<[f64; 3]> = Vec::new();
    for line in hairs.values() {
        let tip = line[line.len() - 1];
        if ends.iter().all(|e| apart(*e, tip) > 0.05) {
            ends.push(tip);
        }
    }
    assert_eq!(ends.len(), 3, "{ends:?}");
}

#[test]
fn hair_grows_inside_contours_and_clusters_only() {
    let shot = groomed(BRAID);
    shot.edit(GROOM, "in_clusters = true\n", "");
    let all = shot.report(&[])["stages"][1]["counts"]["hairs"].as_u64().expect("a count");
    // A square of 30 degrees around the pole: 0.07 of the sphere.
    shot.edit(
        GROOM,
        "front = [0.0, 0.0, 1.0]",
        "front = [0.0, 0.0, 1.0]\ngrowth = [[[30, 30], [-30, 30], [-30, -30], [30, -30]]]",
    );
    let report = shot.report(&[]);
    let few = report["stages"][1]["counts"]["hairs"].as_u64().expect("a count");
    assert!(few as f64 > 0.05 * all as f64 && (few as f64) < 0.12 * all as f64, "{few} of {all}");
    for line in positions(&shot, None).values() {
        let [x, y, z] = line[0];
        let angle = x.hypot(z).atan2(y).to_degrees();
        let at = [angle * z / x.hypot(z), angle * x / x.hypot(z)];
        assert!(at.iter().all(|a| a.abs() < 30.01), "{at:?}");
    }
    let reasons = shot.plan(&[]).1;
    assert!(reasons.is_empty());
    shot.edit(GROOM, "[[[30, 30]", "[[[20, 20]");
    let (run, why) = shot.plan(&[]);
    assert!(run.contains("instance/roots/hair") && !run.contains("groom/comb"), "{run:?}");
    assert!(why.iter().all(|w| w.starts_with("grooms/ball.toml: scalp.growth[0] ")), "{why:?}");
}

const WHISKERS: &str = r#"
[control]
placement = { per_cm2 = 0.2 }
points = 5
[[control.hair]]
name = "whisker-1"
root = [5.0, 0.0, 0.0]
points = [[6.0, 0.0, 0.0], [7.0, 0.5, 0.0], [8.0, 1.5, 0.0]]
[[control.hair]]
name = "whisker-2"
root = [0.0, 0.0, 5.0]
[[control.line]]
points = [[-3.0, 4.0, 0.0], [3.0, 4.0, 0.0]]
count = 6
[[layer]]
name = "coat"
density = { value = 0.5 }
length = { value = 2.0 }
[[layer]]
name = "whiskers"
hairs = ["whisker*"]
like = "whisker"
points = 5
collision = { enabled = false }
"#;

#[test]
fn hairs_by_hand_are_a_layer() {
    let shot = groomed(WHISKERS);
    let report = shot.report(&[]);
    assert_eq!(report["stages"][0]["counts"]["control hairs one by one"], 2);
    assert_eq!(report["stages"][0]["counts"]["control hairs on lines"], 6);
    let hairs = positions(&shot, None);
    let whiskers: Vec<_> = hairs.iter().filter(|(k, _)| k.0 == "whiskers").map(|(_, l)| l).collect();
    assert_eq!(whiskers.len(), 2);
    // As it was drawn: resampled to five points of equal steps.
    let drawn = [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [7.0, 0.5, 0.0], [8.0, 1.5, 0.0]];
    assert!((length(whiskers[0]) - length(&drawn)).abs() < 0.02 * length(&drawn));
    assert!(apart(whiskers[0][4], drawn[3]) < 0.06, "{:?}", whiskers[0]);
    assert!((length(whiskers[1]) - 2.0).abs() < 1e-4);
    // A factor on their length, and an operation on one of them by name.
    shot.edit(GROOM, "hairs = [\"whisker*\"]", "hairs = [\"whisker*\"]\nlength = { value = 1.5 }");
    shot.edit(GROOM, "[[layer]]", "[[comb]]\nkind = \"bend\"\nangle = 90.0\nhairs = [\"whisker-2\"]\n[[layer]]");
    shot.report(&[]);
    let bent = positions(&shot, None);
    let keys: Vec<_> = bent.keys().filter(|k| k.0 == "whiskers").cloned().collect();
    assert!((length(&bent[&keys[0]]) - 1.5 * length(whiskers[0])).abs() < 1e-4);
    assert!(apart(bent[&keys[1]][4], whiskers[1][4]) > 1.0, "it is bent");
    let coat = |all: &BTreeMap<(String, u64), Vec<[f64; 3]>>| {
        let of = all.iter().filter(|(k, _)| k.0 == "coat").map(|(_, l)| l.clone());
        of.collect::<Vec<_>>()
    };
    // The coat beside it bends with it; on the other side of the ball it stays.
    let (before, after) = (coat(&hairs), coat(&bent));
    let far = before.iter().zip(&after).filter(|(b, _)| b[0][2] < 0.0);
    assert!(far.clone().count() > 10 && far.into_iter().all(|(b, a)| b == a));
}

#[test]
fn chains_move_hair_and_its_neighbours() {
    let shot = groomed(WHISKERS);
    let chain = "[[comb]]\nkind = \"chain\"\nhair = \"whisker-2\"\nreach = [1.0, 0.0, 6.0]\nradius = 2.0\n[[layer]]";
    shot.report(&[]);
    let before = positions(&shot, None);
    shot.edit(GROOM, "[[layer]]", chain);
    shot.report(&[]);
    let after = positions(&shot, None);
    let key = after.keys().filter(|k| k.0 == "whiskers").nth(1).expect("a whisker").clone();
    assert!(apart(after[&key][4], [1.0, 0.0, 6.0]) < 1e-4, "{:?}", after[&key]);
    assert!((length(&after[&key]) - length(&before[&key])).abs() < 1e-4);
    let moved = |k: &&(String, u64)| apart(before[*k][4], after[*k][4]) > 1e-4;
    assert!(after.keys().filter(|k| k.0 == "coat").filter(moved).count() > 2, "neighbours come along");
    assert!(after.keys().filter(moved).all(|k| apart(before[k][0], [0.0, 0.0, 5.0]) < 4.5), "the others stay");
    shot.edit(GROOM, "reach = [1.0, 0.0, 6.0]", "reach = [1.5, 0.0, 6.0]");
    let why = shot.plan(&[]).1;
    assert_eq!(why.iter().collect::<Vec<_>>(), ["grooms/ball.toml: comb[0].reach [1.0, 0.0, 6.0] -> [1.5, 0.0, 6.0]"]);
}

#[test]
fn a_mirrored_groom_is_the_same_on_both_sides() {
    let groom = r#"
[control]
placement = { grid = [9, 9] }
points = 6
[[comb]]
kind = "direction-curve"
points = [[-9.0, -3.0, 0.0], [9.0, 4.0, 2.0]]
bend = 0.8
curvature = 0.7
[[comb]]
kind = "mirror"
plane = { point = [0.0, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }
[[layer]]
name = "coat"
density = { value = 1.0 }
length = { value = 2.0 }
collision = { enabled = false }
"#;
    let shot = groomed(groom);
    shot.report(&[]);
    let hairs: Vec<Vec<[f64; 3]>> = positions(&shot, None).into_values().collect();
    let flip = |p: [f64; 3]| [-p[0], p[1], p[2]];
    let (mut most, mut pairs) = (0.0f64, 0);
    for a in hairs.iter().filter(|l| l[0][0] < -1.0) {
        // The hair on the other side that is rooted nearest to the mirrored root.
        let root = flip(a[0]);
        let near = hairs.iter().min_by(|b, c| apart(b[0], root).total_cmp(&apart(c[0], root))).expect("hairs");
        if apart(near[0], root) < 0.3 {
            let ahead = |l: &[[f64; 3]], k: usize| -> [f64; 3] { std::array::from_fn(|x| l[k][x] - l[0][x]) };
            most = most.max(apart(flip(ahead(a, 5)), ahead(near, 5)));
            pairs += 1;
        }
    }
    assert!(pairs > 20 && most < 0.5, "{pairs} pairs differ by {most}");
    shot.edit(GROOM, "kind = \"mirror\"\n", "kind = \"mirror\"\nweight = 0.0\n");
    shot.report(&[]);
    let one_way: Vec<Vec<[f64; 3]>> = positions(&shot, None).into_values().collect();
    assert!(one_way.iter().zip(&hairs).any(|(a, b)| apart(a[5], b[5]) > 1.5), "without it, sides differ");
}

#[test]
fn key_frames_move_control_hairs() {
    let shot = groomed(WHISKERS);
    let bend =
        "[[comb]]\nkind = \"bend\"\nangle = [{ frame = 1, value = 0.0 }, { frame = 3, value = 60.0 }]\n[[layer]]";
    shot.edit(GROOM, "[[layer]]", bend);
    shot.report(&[]);
    let at: Vec<_> = (0..3).map(|f| positions(&shot, Some(f))).collect();
    let tips = |f: usize| at[f].values().map(|l| l[l.len() - 1]).collect::<Vec<_>>();
    let way = |a: usize, b: usize| tips(a).iter().zip(tips(b)).map(|(p, q)| apart(*p, q)).sum::<f64>();
    assert!(way(0, 1) > 1.0 && way(1, 2) > 1.0 && way(0, 2) > 1.5 * way(0, 1));
    assert!(at[0].keys().eq(at[2].keys()));
    // A later key leaves the frames before it alone.
    shot.edit(GROOM, "{ frame = 3, value = 60.0 }", "{ frame = 2, value = 30.0 }, { frame = 3, value = 50.0 }");
    let (run, why) = shot.plan(&[]);
    assert!(run.contains("groom/comb/3") && run.contains("interpolate/coat/3"), "{run:?}");
    assert!(
        !run.contains("groom/comb/2") && !run.contains("interpolate/coat/2") && !run.contains("groom/comb"),
        "{run:?}"
    );
    assert_eq!(why.iter().collect::<Vec<_>>(), ["grooms/ball.toml: comb[0].angle 60 -> 50"]);
    shot.report(&[]);
    is_as_from_nothing(&shot);
    // Simulated hair could not follow.
    shot.edit(SHOT, "target = \"off\"", "target = \"every-hair\"");
    refused(&shot, &["comb[0].angle", "key frames", "layer coat is simulated", "simulate = \"off\""]);
    let moving = KEYED[7].replace("<0.0|0.5>", "[{ frame = 1, value = 0.0 }, { frame = 3, value = 0.5 }]");
    let still = moving.split('<').map(|p| {
        p.split_once('>').map_or(p.to_owned(), |(k, rest)| k.split_once('|').expect("two values").0.to_owned() + rest)
    });
    let layer = "[[layer]]\nname = \"coat\"\ndensity = { value = 1.0 }\nlength = { value = 2.0 }\n[layer.";
    let groom = still.collect::<String>().replace("[layer.", layer);
    shot.write(GROOM, format!("[control]\nplacement = {{ per_cm2 = 1.0 }}\n{groom}\nsimulate = true\n"));
    refused(&shot, &["cluster[0].twist", "key frames", "layer coat is simulated"]);
    let clumped = String::from_utf8(shot.read(GROOM)).expect("text");
    let clumped = clumped.replace("[layer.cluster]", "[[layer.clump]]\nclusters = 1");
    shot.write(GROOM, &clumped);
    refused(&shot, &["cluster[0].twist", "key frames", "layer coat is simulated"]);
    // What acts on every frame follows.
    shot.write(GROOM, clumped.replace("simulate = true", ""));
    shot.plan(&[]);
}

/// Combing and clusters with numbers `<at frame 1|at frame 3>`.
const KEYED: [&str; 9] = [
    "[[comb]]\nkind = \"direction-curve\"\npoints = <[[-6.0, 1.0, 0.0], [6.0, 1.0, 0.0]]|[[-6.0, 1.0, 0.0], [6.0, 9.0, 4.0]]>\n\
     radius = <5.0|7.0>\nfalloff = 0.5",
    "[[comb]]\nkind = \"bend\"\nangle = 60.0\nregion = { map = \"../maps/half.png\" }\n\
     [[comb]]\nkind = \"mirror\"\nplane = { point = <[0.0, 0.0, 0.0]|[1.5, 0.0, 0.0]>, normal = <[1.0, 0.0, 0.0]|[1.0, 0.4, 0.0]> }",
    "[[comb]]\nkind = \"cut\"\nshear = { at = { point = <[0.0, 5.5, 0.0]|[0.0, 3.0, 0.0]>, normal = [0.0, 1.0, 0.0] } }",
    "[[comb]]\nkind = \"cut\"\nshear = { at = { point = [0.0, 4.0, 0.0], normal = [0.0, 1.0, 0.0] } }\n\
     scalp = { centre = [0.0, 0.0, 0.0], radius = <5.0|3.0> }",
    "[[comb]]\nkind = \"cut\"\nscalp = { centre = [0.0, 0.0, 0.0], radius = 5.0 }\n\
     key = [{ at = [0.0, 5.0, 0.0], length = <1.0|0.5> }, { at = <[0.0, -5.0, 0.0]|[5.0, 0.0, 0.0]>, length = 1.8 }]",
    "[[comb]]\nkind = \"field\"\n[[comb.primitive]]\norientation = \"along\"\n\
     points = <[[0.0, 0.0, -9.0], [0.0, 0.0, 9.0]]|[[0.0, 0.0, -9.0], [9.0, 0.0, 9.0]]>\nshape = <[1.0, 1.0, 1.0]|[1.0, 3.0, 1.0]>\n\
     falloff = { exponent = <2.0|0.5> }\ndomain = [{ centre = [0.0, 5.0, 0.0], radii = <[3.0, 3.0, 3.0]|[5.0, 3.0, 5.0]> }]\n\
     [[comb.primitive]]\norientation = \"wave\"\ndirection = [0.0, 1.0, 0.0]\nsway = <[1.0, 0.0, 0.0]|[0.0, 0.0, 1.0]>\nwavelength = <2.0|1.0>",
    "[[comb]]\nkind = \"flow\"\npanels = { most = 60, through = { value = <1.0|0.2> } }\n[[comb.element]]\nkind = \"filament\"\n\
     points = <[[8.0, 0.0, -3.0], [8.0, 0.0, 3.0]]|[[8.0, 2.0, -3.0], [8.0, 0.0, 3.0]]>\nstrength = <3.0|9.0>\ncore = <0.1|1.0>",
    "[scalp]\ncentre = [0.0, 0.0, 0.0]\nup = [0.0, 1.0, 0.0]\nfront = [0.0, 0.0, 1.0]\n\
     [[cluster]]\nname = \"tail\"\nroot = [0.0, 5.0, 0.0]\nradius = 3.0\npoints = <[[0.0, 6.0, 0.0], [0.0, 8.0, 0.0]]|[[1.0, 6.0, 0.0], [2.0, 7.0, 3.0]]>\n\
     width = <[3.0, 1.0]|[3.0, 2.0]>\ntwist = <0.0|0.5>\n\
     [[cluster_edit]]\nkind = \"braid\"\nof = \"tail\"\nturns = <1.0|2.0>\nstart = <0.1|0.3>\n\
     [[cluster_edit]]\nkind = \"scale\"\nof = \"tail/*\"\nwidth = <[1.0, 1.0]|[0.5, 0.2]>\n\
     [layer.cluster]",
    "[scalp]\ncentre = [0.0, 0.0, 0.0]\nup = [0.0, 1.0, 0.0]\nfront = [0.0, 0.0, 1.0]\n\
     [[cluster]]\nname = \"tail\"\nroot = [0.0, 5.0, 0.0]\nradius = 3.0\npoints = <[[0.0, 6.0, 0.0], [0.0, 8.0, 0.0]]|[[1.0, 6.0, 0.0], [2.0, 7.0, 3.0]]>\n\
     [[comb]]\nkind = \"cluster\"",
];

#[test]
fn every_number_of_combing_and_clusters_may_have_key_frames() {
    let maps = |shot: &ShotFolder| shot.write("maps/half.png", grey_png(2, 1, |x, _| if x == 0 { 255 } else { 0 }));
    for (i, case) in KEYED.iter().enumerate() {
        let layer = "[[layer]]\nname = \"coat\"\ndensity = { value = 1.0 }\nlength = { value = 9.0 }\n";
        let control = "[control]\nplacement = { per_cm2 = 1.0 }\npoints = 6\n";
        // What begins with a table of the layer comes after it.
        let (before, after) =
            case.split_once("[layer.").map_or((*case, String::new()), |(b, a)| (b, format!("[layer.{a}\n")));
        let text = format!("{control}{before}\n{layer}{after}");
        let said = |of: &dyn Fn(&str, &str) -> String| {
            let each = |part: &str| match part.split_once('>') {
                Some((keys, rest)) => {
                    let (a, b) = keys.split_once('|').expect("two values");
                    of(a, b) + rest
                }
                None => part.to_owned(),
            };
            text.split('<').map(each).collect::<String>()
        };
        let keyed = said(&|a, b| format!("[{{ frame = 1, value = {a} }}, {{ frame = 3, value = {b} }}]"));
        let shot = groomed(&keyed);
        maps(&shot);
        shot.report(&[]);
        let at: Vec<_> = (0..3).map(|f| positions(&shot, Some(f))).collect();
        assert!(at[0] != at[1] && at[1] != at[2] && at[0] != at[2], "case {i} moves");
        for (frame, value) in [(0, said(&|a, _| a.to_owned())), (2, said(&|_, b| b.to_owned()))] {
            shot.write(GROOM, &value);
            shot.report(&[]);
            // Hair in clusters is bound to hair at rest, which is that of the first frame.
            assert!(positions(&shot, Some(frame)) == at[frame], "case {i} at its key frame {frame}");
        }
        // Each number is told by its own key when it is edited.
        shot.write(GROOM, &keyed);
        shot.report(&[]);
        let last = keyed.rfind("frame = 3").expect("a key frame");
        shot.write(GROOM, format!("{}frame = 2{}", &keyed[..last], &keyed[last + 9..]));
        let (run, why) = shot.plan(&[]);
        let own = |key: &str| run.iter().any(|r| r.ends_with(key));
        assert!(own("/2") && !own("/3") && !own("/1"), "case {i}: {run:?}");
        assert_eq!(why.len(), 1, "{why:?}");
    }
}

/// Numbers with a map that is 1 in the half of small u and 0 in the other: with it, without a map, and 0.
const PAINTED: [[&str; 3]; 3] = [
    [
        "[[comb]]\nkind = \"field\"\n[[comb.primitive]]\norientation = \"radial\"\n[[comb.primitive]]\norientation = \"constant\"\n\
         direction = [0.0, 3.0, 9.0]\nstrength = ",
        "{ value = 1.0, map = \"../maps/half.png\" }",
        "1.0",
    ],
    [
        "[[comb]]\nkind = \"direction-curve\"\npoints = [[-9.0, 0.0, 0.0], [9.0, 0.0, 9.0]]\nfalloff = 0.1\nradius = ",
        "{ value = 20.0, map = \"../maps/half.png\" }",
        "20.0",
    ],
    ["[layer.guard]\nlength = 3.0\npercent = ", "{ value = 0.5, map = \"../maps/half.png\" }", "0.5"],
];

#[test]
fn numbers_are_painted() {
    for [key, map, all] in PAINTED {
        let layer = "[[layer]]\nname = \"coat\"\ndensity = { value = 2.0 }\nlength = { value = 2.0 }\n";
        let control = "[control]\nplacement = { per_cm2 = 4.0 }\npoints = 6\n";
        let hairs = |value: &str| {
            let own = format!("{key}{value}\n");
            let text = if key.starts_with("[layer.") { format!("{layer}{own}") } else { format!("{own}{layer}") };
            let shot = groomed(&format!("{control}{text}"));
            shot.write("maps/half.png", grey_png(64, 1, |x, _| if x < 32 { 255 } else { 0 }));
            shot.report(&[]);
            exported_hairs(&shot.path().join("out/ball/hair.mcap"))
        };
        let (painted, full, none) = (hairs(map), hairs(all), hairs("0.0"));
        let (mut differ, mut mixed) = ([0; 2], 0);
        for (id, h) in painted.iter().filter(|(id, _)| full[*id].shape != none[*id].shape) {
            let lit = h.uv()[0] < 0.5;
            differ[usize::from(lit)] += 1;
            mixed += usize::from(h.shape != if lit { &full } else { &none }[id].shape);
        }
        // Where both halves meet, and on seams, hair is blended of control hairs of both.
        assert!(differ.iter().all(|n| *n > 50) && mixed * 5 < differ[0] + differ[1], "{key} {differ:?} {mixed}");
    }
    // Control hairs stand where the map lets them, each where it stands without the map.
    let shot = groomed(WHISKERS);
    shot.write("maps/half.png", grey_png(64, 1, |x, _| if x < 32 { 255 } else { 0 }));
    let placed = || {
        let report = shot.report(&[]);
        let groom =
            report["stages"].as_array().expect("stages").iter().find(|s| s["name"] == "groom").expect("it").clone();
        groom["counts"]["control hairs"].as_u64().expect("a count")
    };
    let before = placed();
    let from = WHISKERS.lines().find(|l| l.starts_with("placement")).expect("a placement");
    let number = from.split("per_cm2 = ").nth(1).and_then(|r| r.split([' ', ',']).next()).expect("a density");
    let to = from.replace(
        &format!("per_cm2 = {number}"),
        &format!("per_cm2 = {{ value = {number}, map = \"../maps/half.png\" }}"),
    );
    shot.edit(GROOM, from, &to);
    assert!(shot.plan(&[]).1.contains("maps/half.png added"));
    let after = placed();
    assert!(after < before && after > before / 3, "{before} -> {after}");
}

#[test]
fn hair_stays_on_its_side_of_a_divider() {
    let groom = r#"
[control]
placement = { per_cm2 = 0.4 }
points = 8
push_up = false
[[comb]]
kind = "field"
[[comb.primitive]]
orientation = "constant"
position = [1.0, 0.0, 0.0]
direction = [1.0, 0.3, 0.0]
[[comb.primitive]]
orientation = "constant"
position = [-1.0, 0.0, 0.0]
direction = [-1.0, 0.3, 0.0]
[[comb.divider]]
point = [0.0, 0.0, 0.0]
normal = [1.0, 0.0, 0.0]
[[layer]]
name = "coat"
density = { value = 3.0 }
length = { value = 3.0 }
collision = { enabled = false }
"#;
    let shot = groomed(groom);
    let report = shot.report(&[]);
    let beside = report["stages"][1]["counts"]["hairs beside a divider"].as_u64().expect("a count");
    assert!(beside > 20, "{beside}");
    let crossing = |shot: &ShotFolder| {
        let all = positions(shot, None);
        all.values().filter(|l| l.iter().any(|p| p[0] * l[0][0] < 0.0)).count()
    };
    assert_eq!(crossing(&shot), 0, "no hair crosses it");
    shot.edit(
        GROOM,
        "collision = { enabled = false }",
        "collision = { enabled = false }\n[[layer.clump]]\ndensity = 0.2\nsize = 5.0\npercent = 1.0",
    );
    shot.report(&[]);
    assert_eq!(crossing(&shot), 0, "no clump reaches across it");
    shot.edit(GROOM, "percent = 1.0", "percent = 0.0");
    // Without the divider hair is mixed across.
    shot.edit(GROOM, "[[comb.divider]]\npoint = [0.0, 0.0, 0.0]\nnormal = [1.0, 0.0, 0.0]\n", "");
    shot.report(&[]);
    assert!(crossing(&shot) > 0);
}

#[test]
fn guides_are_blended_or_copied_in_space_or_from_the_skin() {
    let shot = groomed(WHISKERS);
    shot.edit(GROOM, "[[layer]]", "[[comb]]\nkind = \"bend\"\nangle = 40.0\n[[layer]]");
    shot.report(&[]);
    let tips = |shot: &ShotFolder| {
        let of = |(_, l): (&(String, u64), &Vec<[f64; 3]>)| -> [f64; 3] { std::array::from_fn(|x| l[4][x] - l[0][x]) };
        positions(shot, None).iter().filter(|(k, _)| k.0 == "coat").map(of).collect::<Vec<_>>()
    };
    let blended = tips(&shot);
    let mut seen = vec![blended.clone()];
    for (from, to) in [
        ("name = \"coat\"\n", "name = \"coat\"\nguides = \"nearest\"\n"),
        ("\"nearest\"", "\"copy\""),
        ("guides = \"copy\"", "root_frames = true"),
    ] {
        shot.edit(GROOM, from, to);
        let (run, _) = shot.plan(&[]);
        assert!(
            run.contains("interpolate/coat/1") && !run.contains("groom/comb") && !run.contains("instance/roots/coat")
        );
        shot.report(&[]);
        let now = tips(&shot);
        assert!(seen.iter().all(|s| *s != now));
        seen.push(now);
    }
    // Copies have directions of control hairs only: there are fewer different ones.
    let different = |tips: &[[f64; 3]]| {
        let mut all: Vec<[i64; 3]> = tips.iter().map(|t| t.map(|x| (x * 1e3).round() as i64)).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    assert!(different(&seen[2]) < 3 * different(&seen[0]) / 4, "{} of {}", different(&seen[2]), different(&seen[0]));
}

#[test]
fn an_edited_element_of_a_flow_factors_nothing_again() {
    let shot = groomed(WHISKERS);
    let flow = "[[comb]]\nkind = \"flow\"\npanels = { most = 200 }\n[[comb.element]]\nkind = \"stream\"\n\
                velocity = [0.0, -1.0, 0.0]\n[[layer]]";
    shot.edit(GROOM, "[[layer]]", flow);
    shot.report(&[]);
    shot.edit(GROOM, "velocity = [0.0, -1.0, 0.0]", "velocity = [0.5, -1.0, 0.0]");
    let (run, why) = shot.plan(&[]);
    assert!(run.contains("groom/comb") && !run.contains("groom/panels[0]"), "{run:?}");
    assert_eq!(
        why.iter().collect::<Vec<_>>(),
        ["grooms/ball.toml: comb[0].element[0].velocity [0.0,-1.0,0.0] -> [0.5,-1.0,0.0]"]
    );
    shot.report(&[]);
    is_as_from_nothing(&shot);
    shot.edit(GROOM, "most = 200", "most = 150");
    assert!(shot.plan(&[]).0.contains("groom/panels[0]"));
}

#[test]
fn a_groom_of_several_files_is_the_same_groom() {
    let whole = groomed(WHISKERS);
    whole.report(&[]);
    let parts = groomed(
        "include = [\"../base/control.toml\"]\n[[layer]]\nname = \"coat\"\nlike = \"short\"\ndensity = { value = 0.5 }\n\
        [style.short]\nlength = { value = 2.0 }\n",
    );
    let (control, layers) = WHISKERS.split_once("[[layer]]\nname = \"coat\"").expect("two parts");
    let whiskers = layers.split_once("[[layer]]").expect("another layer").1;
    parts.write("base/control.toml", format!("include = \"whiskers.toml\"\n{control}"));
    // The coat is the first layer of both.
    parts.write("base/whiskers.toml", format!("[[layer]]\nname = \"coat\"\n[[layer]]{whiskers}"));
    parts.report(&[]);
    assert!(parts.outputs() == whole.outputs(), "the same bytes");
    parts.edit("base/control.toml", "[8.0, 1.5, 0.0]", "[8.0, 1.0, 0.0]");
    let why = parts.plan(&[]).1;
    assert_eq!(why.len(), 1);
    let said = why.first().expect("a reason");
    assert!(said.starts_with("base/control.toml: control.hair[0].points "), "{said}");
}

#[test]
fn patches_are_a_skin() {
    let shot = groomed(
        "[control]\nplacement = { grid = [3, 2] }\n[[layer]]\nname = \"coat\"\ndensity = { value = 2.0 }\nlength = { value = 1.0 }\n",
    );
    // A quarter of a cylinder of radius 4 and a flat patch that meets it, cut half as finely.
    let patches = |lift: f64| {
        let arc = [[4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let row = |z: f64| arc.map(|[x, y]| format!("[{x:?}, {:?}, {z:?}]", y + lift)).join(", ");
        format!(
            "[[patch]]\ndegree = [2, 1]\ncount = [3, 2]\npoints = [{}, {}]\nweights = [1.0, 0.7071067811865476, 1.0, 1.0, \
             0.7071067811865476, 1.0]\ncells = [8, 8]\n[[patch]]\ndegree = [1, 1]\ncount = [2, 2]\npoints = [[0.0, {y:?}, 0.0], \
             [-4.0, {y:?}, 0.0], [0.0, {y:?}, 6.0], [-4.0, {y:?}, 6.0]]\ncells = [4, 4]\n",
            row(0.0),
            row(6.0),
            y = 4.0 + lift
        )
    };
    shot.write("grooms/skin.toml", patches(0.0));
    shot.edit(SHOT, "grooms/ball.ply", "grooms/skin.toml");
    let report = shot.report(&[]);
    // Each patch has its own grid of six.
    assert!(report["stages"][0]["counts"]["control hairs"].as_u64().expect("a count") >= 12);
    let hairs = positions(&shot, None);
    assert!(hairs.len() > 80, "{}", hairs.len());
    for line in hairs.values() {
        let [x, y, _] = line[0];
        let on = if x > 0.0 { (x.hypot(y) - 4.0).abs() < 0.03 } else { (y - 4.0).abs() < 1e-5 };
        assert!(on, "rooted at {:?}", line[0]);
        assert!(line[3][0].hypot(line[3][1]) > 4.5, "hair stands up: {line:?}");
    }
    for frame in 1..=3 {
        shot.write(&format!("anim/skin.{frame:04}.toml"), patches(0.1 * f64::from(frame)));
    }
    shot.edit(SHOT, "[groom]", "frames = \"anim/skin.####.toml\"\n\n[groom]");
    shot.report(&[]);
    let (first, last) = (positions(&shot, Some(0)), positions(&shot, Some(2)));
    for (k, line) in &first {
        assert!((last[k][0][1] - line[0][1] - 0.2).abs() < 1e-5, "{k:?} rides up");
    }
    shot.edit("grooms/skin.toml", "count = [3, 2]", "count = [4, 2]");
    refused(&shot, &["skin.toml", "patch[0].points", "6 points are not 4 x 2"]);
}

#[test]
fn hair_is_trimmed_by_a_mesh() {
    let shot = groomed(WHISKERS);
    let mut ball = pelage_geom::shapes::cube_sphere(12, 6.0);
    ball.position.iter_mut().for_each(|p| p[1] *= 1.5);
    shot.write("grooms/shell.ply", ascii_ply(&ball));
    shot.edit(GROOM, "[[layer]]", "[[comb]]\nkind = \"trim\"\nfile = \"shell.ply\"\n[[layer]]");
    shot.report(&[]);
    let hairs = positions(&shot, None);
    let out = |p: [f64; 3]| p[0].hypot(p[1] / 1.5).hypot(p[2]);
    let coat = hairs.iter().filter(|(k, _)| k.0 == "coat").map(|(_, l)| l);
    let (mut cut, mut whole) = (0, 0);
    for line in coat {
        assert!(out(line[line.len() - 1]) < 6.25, "{line:?}");
        if length(line) < 1.5 {
            cut += 1
        } else if length(line) > 1.99 {
            whole += 1
        }
    }
    assert!(cut > 20 && whole > 5, "{cut} cut, {whole} whole");
    shot.write("grooms/shell.ply", ascii_ply(&pelage_geom::shapes::cube_sphere(12, 6.5)));
    let why = shot.plan(&[]).1;
    assert_eq!(why.iter().collect::<Vec<_>>(), ["grooms/shell.ply changed"]);
}

#[test]
fn hairs_that_meet_are_told() {
    let shot = groomed(WHISKERS);
    shot.edit(SHOT, "formats = [\"usd\", \"mcap\"]", "formats = [\"mcap\"]");
    shot.report(&[]);
    let file = "out/ball/hair.mcap";
    let json = |arguments: &[&str]| -> (Option<i32>, serde_json::Value) {
        let out = shot.pelage(&[&["intersect", file, "--json"], arguments].concat());
        (out.status.code(), serde_json::from_slice(&out.stdout).expect("JSON"))
    };
    let (code, none) = json(&[]);
    assert_eq!((code, none["meeting"].as_u64()), (Some(0), Some(0)), "{none}");
    let n = exported_hairs(&shot.path().join(file)).len() as u64;
    assert_eq!(none["hairs"].as_u64(), Some(n));
    // As thick as the ball, all meet.
    let (code, all) = json(&["--width", "10"]);
    assert_eq!((code, all["hairs_meeting"].as_u64()), (Some(1), Some(n)));
    // Every hair grows out of this ellipsoid, and out of none that lies far away.
    let (code, ball) = json(&["--ellipsoid", "0,0,0,5.2,5.2,5.2", "--ellipsoid", "90,0,0,1,2,3", "--spline", "0.01"]);
    assert_eq!((code, ball["ellipsoids"][0]["hairs_meeting"].as_u64()), (Some(1), Some(n)), "{ball}");
    assert_eq!(ball["ellipsoids"][1]["hairs_meeting"], 0);
    let text = String::from_utf8(shot.pelage(&["intersect", file]).stdout).expect("text");
    assert!(text.contains("0 pairs meet"), "{text}");
    let out = shot.pelage(&["intersect", file, "--ellipsoid", "1,2,3"]);
    assert_eq!(out.status.code(), Some(2));
}

#[test]
fn ways_of_placing_are_told_apart() {
    let shot = groomed(
        "[control]\nplacement = { grid = [4, 3] }\n[[layer]]\nname = \"coat\"\ndensity = { value = 0.5 }\nlength = { value = 1.0 }\n",
    );
    shot.report(&[]);
    for (from, to, why) in [
        ("[4, 3] }", "[4, 3], even = true }", "control.placement.even added"),
        ("even = true }", "even = true, relax = 10 }", "control.placement.relax added"),
        ("relax = 10 }", "relax = 20 }", "control.placement.relax 10 -> 20"),
    ] {
        let before = shot.entries();
        shot.edit(GROOM, from, to);
        let (run, reasons) = shot.plan(&[]);
        assert!(run.contains("groom/place"), "{run:?}");
        assert_eq!(reasons.iter().collect::<Vec<_>>(), [&format!("grooms/ball.toml: {why}")]);
        shot.report(&[]);
        assert!(shot.entries() != before);
    }
    shot.edit(GROOM, "grid = [4, 3], even = true, relax = 20", "even = true");
    refused(&shot, &["control.placement", "[[control.hair]]"]);
}
