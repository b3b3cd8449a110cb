//! The command as a person types it: exit codes, what goes to stdout and what to stderr, and what it says.

use pelage_tests::{ShotFolder, ascii_ply, files_below, small_shot};
use serde_json::Value;
use std::process::{Output, Stdio};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

/// Runs the command: (exit code, stdout, stderr).
fn typed(shot: &ShotFolder, arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } = shot.pelage(arguments);
    (status.code().expect("an exit code"), text(&stdout), text(&stderr))
}

/// What a command prints with `--json`.
fn json(shot: &ShotFolder, arguments: &[&str]) -> Value {
    serde_json::from_str(&shot.succeed(&[arguments, &["--json"]].concat())).expect("JSON")
}

/// The command refuses with exit code 2, says all of this on stderr and nothing on stdout.
fn refused(shot: &ShotFolder, arguments: &[&str], says: &[&str]) {
    let (code, out, err) = typed(shot, arguments);
    assert_eq!((code, out.as_str()), (2, ""), "{arguments:?}: {err}");
    for words in says {
        assert!(err.contains(words), "{arguments:?}: `{words}` is not in\n{err}");
    }
}

#[test]
fn help_and_version() {
    let folder = ShotFolder::new(COMMAND);
    let help = folder.succeed(&["--help"]);
    for command in ["init", "run", "plan", "preview", "inspect", "compare", "cache", "schema"] {
        assert!(help.contains(&format!("\n  {command} ")), "{command} is not in\n{help}");
        assert!(folder.succeed(&[command, "--help"]).contains("Usage: pelage"), "{command}");
    }
    assert_eq!(folder.succeed(&["--version"]), format!("pelage {}\n", env!("CARGO_PKG_VERSION")));
    refused(&folder, &[], &["Usage: pelage"]);
}

#[test]
fn mistyped_arguments_are_refused() {
    let shot = small_shot(COMMAND, 3);
    refused(&shot, &["prview"], &["prview", "preview"]);
    refused(&shot, &["run", "--jbos", "2"], &["--jbos", "--jobs"]);
    refused(&shot, &["run", "--jobs", "0"], &["--jobs"]);
    refused(&shot, &["run", "--to", "shaving"], &["shaving", "interpolate"]);
    refused(&shot, &["run", "--frames", "3-1"], &["`3-1` is not a list of frames"]);
    refused(&shot, &["run", "--frames", "2-5,9"], &["frame 4-5, 9 is not in the shot", "from 1 to 3"]);
    refused(&shot, &["plan", "--frames", "0"], &["frame 0 is not in the shot"]);
    refused(&shot, &["run", "nothing.toml"], &["nothing.toml", "pelage init DIR"]);
    refused(&shot, &["inspect", "nothing.ply"], &["nothing.ply"]);
    refused(&shot, &["inspect", GROOM], &[GROOM, "not a file that Pelage knows"]);
    refused(&shot, &["schema", "beard"], &["beard", "groom"]);
    assert!(shot.outputs().is_empty());
}

#[test]
fn a_mistyped_key_is_shown_where_it_stands() {
    let shot = small_shot(COMMAND, 3);
    shot.report(&[]);
    let before = shot.outputs();
    shot.edit(GROOM, "noise = 0.2", "niose = 0.2");
    let groom = text(&shot.read(GROOM));
    let line = groom.lines().position(|l| l.contains("niose")).expect("the line") + 1;
    let place = format!("grooms/ball.toml, line {line}:");
    for command in ["run", "plan", "preview"] {
        refused(&shot, &[command], &[&place, "did you mean `noise`?", "niose = 0.2"]);
    }
    shot.edit(GROOM, "niose = 0.2", "noise = -3.0");
    refused(&shot, &["run"], &[&place, "layer[0].length.noise"]);
    assert!(shot.outputs() == before);
}

#[test]
fn results_go_to_stdout_and_talk_to_stderr() {
    let shot = small_shot(COMMAND, 3);
    let (code, out, err) = typed(&shot, &["run"]);
    assert_eq!(code, 0);
    assert!(out.contains("interpolate     3 ran") && out.ends_with("results in out/ball\n"), "{out}");
    assert!(err.contains("interpolate  3 ran") && !out.contains('\u{1b}') && !err.contains('\u{1b}'), "{err}");
    let (code, out, err) = typed(&shot, &["run", "--quiet", "--force", "export"]);
    assert!(code == 0 && out.contains("export          2 ran") && err.is_empty(), "{out}{err}");
    let (_, out, err) = typed(&shot, &["plan", "--force", "preview"]);
    assert!(out.contains("because --force preview\n") && err.is_empty(), "{out}{err}");
    assert_eq!(typed(&shot, &["plan"]).1, "nothing to do\n");
    let said: Value = json(&shot, &["run", "--force", "preview"]);
    let kept: Value = serde_json::from_slice(&shot.read("out/ball/report.json")).expect("JSON");
    assert_eq!(said, kept);
    assert_eq!(said["stages"].as_array().expect("stages").len(), 7);
    assert_eq!(said["stages"][1]["counts"]["hairs"], said["stages"][3]["counts"]["hairs"]);
}

#[test]
fn readers_may_hang_up() {
    let shot = small_shot(COMMAND, 3);
    let commands = [&["run"][..], &["run", "--json"], &["plan"], &["schema", "groom"], &["inspect", "maps/half.png"]];
    for arguments in [commands.as_slice(), &[&["--help"], &["cache", "stats"], &["preview"]]].concat() {
        let mut child = shot.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("a child");
        drop(child.stdout.take());
        let out = child.wait_with_output().expect("an end");
        let err = text(&out.stderr);
        assert!(out.status.success() && !err.contains("panicked"), "{arguments:?}: {err}");
    }
    // Stderr too, as in `pelage run 2>&1 | head -1`, for talk and for an error.
    for (arguments, code) in [(&["run", "--force", "instance"][..], 0), (&["run", "--frames", "77"], 2)] {
        let mut child = shot.command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("a child");
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().expect("an end").code(), Some(code), "{arguments:?}");
    }
}

#[test]
fn init_never_writes_over_files() {
    let folder = ShotFolder::new(COMMAND);
    folder.write("shot/notes.txt", "mine");
    refused(&folder, &["init", "shot"], &["shot is not empty"]);
    assert_eq!(files_below(folder.path()).into_keys().collect::<Vec<_>>(), ["shot/notes.txt"]);
    folder.write("bald.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    refused(&folder, &["init", "new", "--skin", "bald.ply"], &["bald.ply has no texture coordinates"]);
    refused(&folder, &["init", "new", "--skin", "none.ply"], &["none.ply"]);
    assert!(!folder.path().join("new").exists());
}

#[test]
fn init_around_a_skin_makes_a_shot_that_runs() {
    let folder = ShotFolder::new(COMMAND);
    folder.write("ball.ply", ascii_ply(&pelage_geom::shapes::cube_sphere(8, 50.0)));
    let said = folder.succeed(&["init", "new", "--skin", "ball.ply", "--meters-per-unit", "0.001"]);
    assert_eq!(said, "made 3 files in new\nnext: cd new && pelage run\n");
    assert!(folder.read("new/grooms/skin.ply") == folder.read("ball.ply"));
    let out = folder.succeed(&["run", "new/pipeline.toml"]);
    assert!(folder.path().join("new/out").is_dir() && !folder.path().join("out").exists(), "{out}");
    assert!(folder.succeed(&["run", "new/pipeline.toml"]).starts_with("nothing to do"));
}

#[test]
fn init_of_every_sample() {
    let folder = ShotFolder::new(COMMAND);
    let samples: [(&str, &[&str]); 3] = [
        (
            "bust",
            &[
                "grooms/bust-long.toml",
                "grooms/bust-shake.csv",
                "grooms/bust.ply",
                "maps/scalp_density.png",
                "maps/scalp_length.png",
            ],
        ),
        (
            "bust-nod",
            &[
                "anim/bust.1001.ply",
                "anim/bust.1024.ply",
                "grooms/bust-long.toml",
                "grooms/bust.ply",
                "maps/scalp_length.png",
            ],
        ),
        (
            "animal",
            &[
                "grooms/animal-fur.toml",
                "grooms/animal.ply",
                "maps/direction.png",
                "maps/overcoat.png",
                "maps/undercoat.png",
            ],
        ),
    ];
    for (sample, names) in samples {
        folder.succeed(&["init", sample, "--sample", sample]);
        let files = files_below(&folder.path().join(sample));
        for name in names.iter().chain(&["pipeline.toml"]) {
            assert!(files.contains_key(*name), "{sample} has no {name}");
        }
        let shot = format!("{sample}/pipeline.toml");
        let stages = json(&folder, &["plan", &shot]);
        let idle = |s: &&Value| s["run"] == Value::Array(Vec::new());
        let idle: Vec<&Value> = stages.as_array().expect("stages").iter().filter(idle).map(|s| &s["name"]).collect();
        // The animal stands still; only the shaken bust has lights.
        let expected: Vec<&str> = match sample {
            "animal" => vec!["simulate", "shadow"],
            "bust" => vec![],
            _ => vec!["shadow"],
        };
        assert_eq!(idle, expected, "{stages}");
    }
    // Without a name it is the bust, and the same bytes each time.
    folder.succeed(&["init", "again"]);
    let again = files_below(&folder.path().join("again"));
    assert!(again.iter().all(|(name, bytes)| *bytes == folder.read(&format!("bust/{name}"))));
}

#[test]
fn inspect_knows_every_kind_of_file() {
    let shot = small_shot(COMMAND, 3);
    shot.edit("pipeline.toml", "[\"usd\", \"mcap\"]", "[\"usd\", \"mcap\", \"ply\"]");
    let report = shot.report(&[]);
    let hairs = report["stages"][1]["counts"]["hairs"].as_u64().expect("a count");
    let skin = json(&shot, &["inspect", "grooms/ball.ply"]);
    assert_eq!((&skin["kind"], &skin["charts"], &skin["open edges"]), (&"skin".into(), &6.into(), &0.into()));
    assert_eq!(skin["triangles"], 6 * 8 * 8 * 2);
    let map = json(&shot, &["inspect", "maps/half.png"]);
    assert_eq!((&map["kind"], &map["size"]), (&"map".into(), &serde_json::json!([64, 64])));
    assert_eq!(map["grey"]["histogram"], serde_json::json!([2048, 0, 0, 0, 0, 0, 0, 0, 0, 2048]));
    let motion = json(&shot, &["inspect", "grooms/ball.csv"]);
    assert_eq!((&motion["kind"], &motion["samples"]), (&"rigid motion".into(), &4.into()));
    assert_eq!(json(&shot, &["inspect", "out/ball/preview.png"])["size"], serde_json::json!([160, 120]));
    let curves = [("hair.usdc", "curves (USD)"), ("hair.mcap", "curves (MCAP)"), ("hair.0002.ply", "curves (PLY)")];
    for (name, kind) in curves {
        let found = json(&shot, &["inspect", &format!("out/ball/{name}")]);
        assert_eq!(found["kind"], kind);
        let layers = found["layer"].as_array().expect("layers");
        assert_eq!(layers.iter().map(|l| l["hairs"].as_u64().expect("a count")).sum::<u64>(), hairs, "{name}");
        assert!(layers.iter().all(|l| l["numbers that are not finite"] == 0), "{name}");
        let frames = if name.ends_with("ply") {
            Value::Null
        } else {
            serde_json::json!({"first": 1.0, "last": 3.0, "count": 3})
        };
        assert_eq!(found["frames"], frames, "{name}");
    }
    let said = shot.succeed(&["inspect", "out/ball/hair.usdc"]);
    assert!(said.contains("kind: curves (USD)\n") && said.contains("  name: under\n"), "{said}");
    let mut kinds = std::collections::BTreeMap::new();
    for name in shot.entries().into_keys() {
        let found = json(&shot, &["inspect", &format!(".pelage-cache/v1/entries/{name}")]);
        *kinds.entry(found["kind"].as_str().expect("a kind").to_owned()).or_insert(0) += 1;
    }
    // Two of the groom, seven a layer, (rest + 3 frames) a layer; manifests, and receipts of 3 formats and the still.
    let tables = 2 + 2 * 7;
    let expected = [("PLY tables", tables), ("cached frame", 8), ("record", tables + 8 + 4 + 4)];
    assert_eq!(kinds, expected.map(|(k, n)| (k.to_owned(), n)).into());
}

#[test]
fn compare_says_how_far_and_which_hairs() {
    let (one, two) = (small_shot(COMMAND, 2), small_shot(COMMAND, 2));
    two.edit(GROOM, "bend = 0.6", "bend = 0.65");
    one.report(&[]);
    two.report(&[]);
    let file = |shot: &ShotFolder, name: &str| shot.path().join("out/ball").join(name).to_string_lossy().into_owned();
    let (a, b) = (file(&one, "hair.mcap"), file(&two, "hair.mcap"));
    // The same shot in two formats.
    let (code, out, err) = typed(&one, &["compare", &a, &file(&one, "hair.usdc")]);
    assert!(code == 0 && out.ends_with("\nequal\n") && err.is_empty(), "{out}{err}");
    let (code, out, _) = typed(&one, &["compare", &a, &b]);
    assert!(code == 1 && out.ends_with("\ndifferent\n") && out.contains("  hair "), "{out}");
    let (code, out, _) = typed(&one, &["compare", &a, &b, "--json"]);
    let found: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, &found["equal"], &found["compared_frames"]), (1, &false.into(), &2.into()));
    let layers = found["layers"].as_array().expect("layers");
    let known = pelage_tests::exported_hairs(std::path::Path::new(&a));
    let mut largest = 0.0f64;
    for layer in layers {
        let (max, rms) =
            (layer["max_distance"].as_f64().expect("a number"), layer["rms_distance"].as_f64().expect("a number"));
        assert!(0.0 < rms && rms < max && max < 3.0, "{layer}");
        let worst = layer["worst"].as_array().expect("worst hairs");
        assert_eq!(worst[0]["distance"].as_f64(), Some(max));
        for w in worst {
            let name = layer["layer"].as_str().expect("a name").to_owned();
            assert!(known.contains_key(&(name, w["id"].as_u64().expect("an id"))), "{w}");
        }
        largest = largest.max(max);
    }
    let within = |tolerance: f64| typed(&one, &["compare", &a, &b, "--tolerance", &tolerance.to_string()]).0;
    assert_eq!((within(largest), within(0.99 * largest)), (0, 1));
    // Hairs that only one of the two has.
    two.edit(GROOM, "bend = 0.65", "bend = 0.6");
    two.edit(GROOM, "value = 4.0", "value = 4.5");
    two.report(&[]);
    let (code, out, _) = typed(&one, &["compare", &a, &b]);
    assert!(code == 1 && out.contains("under:") && out.contains("0 only in the first"), "{out}");
    refused(&one, &["compare", &a, "grooms/none.usdc"], &["none.usdc"]);
}

#[test]
fn the_cache_is_looked_after() {
    let shot = small_shot(COMMAND, 3);
    shot.report(&[]);
    let stages = json(&shot, &["cache", "stats"])["stages"].clone();
    assert_eq!(stages["interpolate"][0], 8);
    assert_eq!((&stages["groom/comb"][0], &stages["instance/roots"][0]), (&1.into(), &2.into()));
    assert!(shot.succeed(&["cache", "stats"]).contains("instance/roots                2 entries"));
    assert_eq!(json(&shot, &["cache", "prune"]), serde_json::json!({"entries": 0, "bytes": 0}));
    shot.edit(GROOM, "noise = 0.2", "noise = 0.25");
    shot.report(&[]);
    // One column, four poses, and the receipts of two files and a picture are of no use any more.
    let before = shot.entries();
    let pruned = json(&shot, &["cache", "prune"]);
    let after = shot.entries();
    let gone = before.iter().filter(|(name, _)| !after.contains_key(*name)).map(|(_, b)| b.len()).sum::<usize>();
    assert_eq!(pruned, serde_json::json!({"entries": 1 + 4 + 3, "bytes": gone}));
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
    assert!(json(&shot, &["cache", "verify"])["damaged"].as_array().expect("a list").is_empty());
    let (name, mut bytes) = after.into_iter().find(|(n, _)| n.ends_with("/frame.mcap")).expect("a cached frame");
    bytes[100] ^= 1;
    shot.write(&format!(".pelage-cache/v1/entries/{name}"), bytes);
    let (code, out, _) = typed(&shot, &["cache", "verify"]);
    let key = name.split('/').nth(1).expect("a key");
    assert!(code == 1 && out.contains(&format!("damaged: {key} (its step runs again when needed)\n")), "{out}");
}

#[test]
fn schemas_know_every_key_of_a_shot() {
    let shot = small_shot(COMMAND, 3);
    for (kind, file, keys) in
        [("shot", "pipeline.toml", ["shot", "skin", "export"]), ("groom", GROOM, ["control", "comb", "layer"])]
    {
        let schema: Value = serde_json::from_str(&shot.succeed(&["schema", kind])).expect("JSON");
        assert!(schema["$schema"].as_str().expect("a draft").contains("json-schema.org"));
        let properties = schema["properties"].as_object().expect("properties");
        let content = text(&shot.read(file));
        for key in keys {
            assert!(properties.contains_key(key) && content.contains(&format!("[{key}]")), "{kind}: {key}");
        }
        assert_eq!(schema["additionalProperties"], false);
    }
}

#[test]
fn previews_need_no_export() {
    let shot = small_shot(COMMAND, 4);
    let report = json(&shot, &["preview", "--quiet"]);
    assert!(report["stages"].as_array().expect("stages").iter().all(|s| s["name"] != "export"));
    assert_eq!(shot.outputs().into_keys().collect::<Vec<_>>(), ["ball/preview.png", "ball/sheet.png"]);
    // The still is in the middle, the sheet has the first and the last frame.
    assert_eq!(report["stages"][3]["ran"], 3);
    assert!(shot.succeed(&["preview"]).starts_with("nothing to do"));
}

#[test]
fn stress_tells_what_hair_bears() {
    let shot = ShotFolder::new(COMMAND);
    let list = shot.succeed(&["stress", "--list"]);
    assert!(list.lines().count() >= 20 && list.contains("storm"), "{list}");
    let table = shot.succeed(&["stress", "teleport", "--quiet"]);
    assert!(table.contains("teleport (springs)") && table.contains("strands not carried along"), "{table}");
    assert!(table.ends_with("bounds hold\n") && !table.contains("BROKEN"), "{table}");
    let cases: Value = serde_json::from_str(&shot.succeed(&["stress", "input", "--quiet", "--json"])).expect("JSON");
    assert_eq!(cases.as_array().map(Vec::len), Some(2));
    let out = shot.pelage(&["stress", "nonsense"]);
    let err = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.code() == Some(2) && err.contains("no case `nonsense`") && err.contains("teleport"), "{err}");
}

#[test]
fn bench_measures_points_by_name() {
    let shot = ShotFolder::new(COMMAND);
    let list = shot.succeed(&["bench", "--list", "--quick"]);
    let studies =
        ["strand", "shot", "guides", "collision", "shadow", "instancing", "lod", "skips", "papers", "scaling"];
    assert!(studies.iter().all(|s| list.lines().any(|l| l.starts_with(&format!("{s} ")))), "{list}");
    let point = list.lines().map(str::trim).find(|l| l.starts_with("strand/")).expect("a point");
    let numbers = shot.succeed(&["bench", "--quick", "--point", point, "--quiet"]);
    assert!(numbers.split_whitespace().all(|n| n.parse::<f64>().is_ok()), "{numbers}");
    assert!(!shot.path().join("out").exists(), "a point alone leaves nothing");
    for (arguments, says) in [(["--study", "nonsense"], "the studies are"), (["--point", "strand/nonsense"], "--list")]
    {
        let out = shot.pelage(&["bench", arguments[0], arguments[1]]);
        let err = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(2) && err.contains("nonsense") && err.contains(says), "{err}");
    }
}
