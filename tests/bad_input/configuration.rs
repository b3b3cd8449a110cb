//! Broken shot and groom files.

use super::{Corpus, run_bounded};

const SHOT: &str = "pipeline.toml";
const GROOM: &str = "grooms/ball.toml";

#[test]
fn text_that_is_no_toml() {
    let mut corpus = Corpus::new();
    for file in [SHOT, GROOM] {
        let name = file.rsplit('/').next().expect("a name");
        let says = |words: &str| format!("{name}|{words}");
        corpus.refuse("not UTF-8", file, b"[shot]\nname = \"\xff\"\n", &says("UTF-8|help:"));
        corpus.refuse("garbage", file, super::noise(2000), &says("UTF-8|help:"));
        corpus.refuse("empty", file, "", &says("missing field"));
        let text = corpus.shot.read(file);
        corpus.refuse("unterminated", file, [&text[..], b"\n[x\n"].concat(), &says("line"));
        corpus.refuse("twice", file, [&text[..], &text[..]].concat(), &says("line|duplicate"));
        corpus.refuse("half", file, &text[..text.len() / 2], name);
        corpus.refuse("nested without end", file, format!("a = {}", "[".repeat(100_000)), &says("line 1"));
        let path = corpus.shot.path().join(file);
        std::fs::remove_file(&path).expect("the file was there");
        corpus.refuse_as_it_is("no file", name);
        std::fs::create_dir(&path).expect("a folder");
        corpus.refuse_as_it_is("a folder", name);
        std::fs::remove_dir(&path).expect("an empty folder");
        corpus.shot.write(file, text);
    }
    corpus.refuse_edit(SHOT, "name = \"ball\"", "name = \"ball", "pipeline.toml, line 2");
    corpus.refuse_edit(GROOM, "per_cm2 = 0.2 }", "per_cm2 = 0.2", "ball.toml, line 3|missing comma");
    corpus.finish();
}

#[test]
fn unknown_keys_at_every_level() {
    let mut corpus = Corpus::new();
    for (from, to, key) in [
        ("[shot]", "[shoot]\n[shot]", "shoot|did you mean `shot`?"),
        ("fps =", "fsp = 24\nfps =", "fsp|did you mean `fps`?"),
        ("[export]", "mtion = 1\n[export]", "mtion"),
        ("motion =", "moton = \"x\"\nmotion =", "moton|did you mean `motion`?"),
        ("file =", "fil = 1\nfile =", "fil|did you mean `file`?"),
        ("formats =", "format = 1\nformats =", "format|did you mean `formats`?"),
        ("size =", "sizes = 1\nsize =", "sizes|did you mean `size`?"),
        ("[preview]", "[cache]\nfolder = 1\n[preview]", "folder"),
        ("\"usd\"", "\"usdc\"", "usdc|did you mean `usd`?"),
        ("fps =", "up = \"x\"\nfps =", "unknown variant `x`"),
    ] {
        corpus.refuse_edit(SHOT, from, to, &format!("pipeline.toml, line|{key}"));
    }
    for (from, to, key) in [
        ("[control]", "colour = 1\n[control]", "colour"),
        ("points = 6", "point = 6", "point|did you mean `points`?"),
        ("per_cm2", "per_cm", "per_cm|did you mean `per_cm2`?"),
        ("bend =", "band = 1\nbend =", "band|did you mean `bend`?"),
        ("direction-curve", "direction-curves", "did you mean `direction-curve`?"),
        ("[[layer]]", "[[parting]]\nname = \"a\"\npoints = []\nside = \"left\"\n[[layer]]", "side"),
        ("width =", "widht =", "did you mean `width`?"),
        ("noise = 0.2", "nosie = 0.2", "did you mean `noise`?"),
        ("tip = 0.5", "top = 0.5", "did you mean `tip`?"),
        ("[0.4, 0.2, 0.1]", "[0.4, 0.2, 0.1], rgb = 1", "rgb"),
        ("half.png\"", "half.png\", chanel = \"r\"", "did you mean `channel`?"),
        ("half.png\"", "half.png\", channel = \"red\"", "unknown variant `red`"),
        ("half.png\"", "half.png\", wrap = \"clamped\"", "did you mean `clamp`?"),
        ("bend =", "region = { map = \"x\", size = 1 }\nbend =", "size"),
    ] {
        corpus.refuse_edit(GROOM, from, to, &format!("ball.toml, line|{key}"));
    }
    corpus.finish();
}

#[test]
fn wrong_types_and_missing_tables() {
    let mut corpus = Corpus::new();
    for (from, to, words) in [
        ("fps = 24", "fps = \"24\"", "line 4|expected f64"),
        ("frames = [1, 2]", "frames = 2", "line 3"),
        ("frames = [1, 2]", "frames = [1]", "line 3"),
        ("frames = [1, 2]", "frames = [1, 2, 3]", "line 3"),
        ("frames = [1, 2]", "frames = [1.5, 2]", "line 3"),
        ("frames = [1, 2]", "frames = [1, 3000000000]", "line 3"),
        ("name = \"ball\"", "name = 7", "line 2"),
        ("\"grooms/ball.ply\"", "[\"grooms/ball.ply\"]", "line 8"),
        ("size = [160, 120]", "size = [160, -120]", "line"),
        ("[groom]\nfile = \"grooms/ball.toml\"\n", "", "groom"),
        ("[groom]\nfile = \"grooms/ball.toml\"", "[groom]", "groom|where hair comes from|help:"),
        ("rest = \"grooms/ball.ply\"\n", "", "rest"),
        ("fps = 24\n", "", "fps"),
        ("meters_per_unit = 0.01\n", "", "meters_per_unit"),
    ] {
        corpus.refuse_edit(SHOT, from, to, &format!("pipeline.toml|{words}"));
    }
    for (from, to, words) in [
        ("density = { value = 4.0", "density = { value = \"4\"", "line"),
        ("density = { value = 1.0 }", "density = 1.0", "line"),
        ("length = { value = 1.0, noise = 0.2 }\n", "", "length"),
        ("name = \"under\"\n", "", "name"),
        ("[0.4, 0.2, 0.1]", "[0.4, 0.2]", "line"),
        ("[0.4, 0.2, 0.1]", "\"#ff0000\"", "line"),
        ("points = 6", "points = 6.5", "line"),
        ("points = 6", "points = -6", "line"),
        ("placement = { per_cm2 = 0.2 }\n", "", "placement"),
        ("kind = \"direction-curve\"\n", "", "kind"),
        ("[0.0, 10.0, 0.0]", "[0.0, 10.0]", "line"),
    ] {
        corpus.refuse_edit(GROOM, from, to, &format!("ball.toml|{words}"));
    }
    let text = String::from_utf8(corpus.shot.read(GROOM)).expect("text");
    let (control, _) = text.split_once("[[layer]]").expect("a layer");
    corpus.refuse("no layer", GROOM, control, "ball.toml|layer");
    corpus.refuse("an empty list of layers", GROOM, format!("layer = []\n{control}"), "ball.toml|no layer|help:");
    corpus.finish();
}

#[test]
fn values_out_of_range_in_the_shot() {
    let mut corpus = Corpus::new();
    for (from, to, words) in [
        ("frames = [1, 2]", "frames = [2, 1]", "line 3|shot.frames|help:"),
        ("frames = [1, 2]", "frames = [1, 2000000]", "line 3|shot.frames|million"),
        ("frames = [1, 2]", "frames = [-2147483648, 2147483647]", "line 3|shot.frames|million"),
        ("fps = 24", "fps = 0", "line 4|shot.fps|help:"),
        ("fps = 24", "fps = -24", "line 4|shot.fps|help:"),
        ("fps = 24", "fps = nan", "line 4|shot.fps|help:"),
        ("meters_per_unit = 0.01", "meters_per_unit = inf", "line 5|shot.meters_per_unit|help:"),
        ("meters_per_unit = 0.01", "meters_per_unit = 0", "line 5|shot.meters_per_unit|help:"),
        ("name = \"ball\"", "name = \"\"", "line 2|shot.name|help:"),
        ("name = \"ball\"", "name = \"../elsewhere\"", "line 2|shot.name|help:"),
        ("name = \"ball\"", "name = \"..\"", "line 2|shot.name|help:"),
        ("name = \"ball\"", "name = \"/tmp\"", "line 2|shot.name|help:"),
        ("motion =", "frames = \"anim/a.####.ply\"\nmotion =", "skin.motion|skin.frames|help:"),
        ("motion =", "pivot = [nan, 0, 0]\nmotion =", "skin.pivot"),
        ("motion =", "motion_start = nan\nmotion =", "skin.motion_start"),
        ("[\"usd\", \"mcap\"]", "[\"usd\", \"usd\"]", "export.formats|twice"),
        ("size = [160, 120]", "size = [8, 8]", "preview.size"),
        ("size = [160, 120]", "size = [100000, 100000]", "preview.size"),
        ("sheet = 2", "sheet = 0", "preview.sheet"),
        ("sheet = 2", "frame = 3", "preview.frame|help:"),
        ("sheet = 2", "zoom = 0", "preview.zoom|help:"),
        ("sheet = 2", "zoom = nan", "preview.zoom|help:"),
        ("sheet = 2", "from = [0, 0, 0]", "preview.from|help:"),
        ("sheet = 2", "turntable = 0", "preview.turntable|1 and 1000"),
        ("sheet = 2", "exposure = nan", "preview.exposure|NaN is out of range"),
        ("sheet = 2", "depth_cue = 1", "preview.depth_cue|1 is out of range"),
        ("sheet = 2", "tone = \"film\"", "unknown variant `film`"),
        ("sheet = 2", "shade = { fur = 2 }", "preview.shade.fur|2 is out of range"),
        ("sheet = 2", "shade = { gloss = 2 }", "unknown field `gloss`"),
        ("sheet = 2", "camera = { eye = [0, 0, 9] }", "missing field `target`"),
        (
            "sheet = 2",
            "camera = { eye = [0, 0, 9], target = [0, 0, 9] }",
            "preview.camera.eye|where the target is|help:",
        ),
        ("sheet = 2", "camera = { eye = [0, 0, nan], target = [0, 0, 0] }", "preview.camera.eye|finite|help:"),
        (
            "sheet = 2",
            "camera = { eye = [0, 0, 9], target = [0, 0, 0], fov = 180 }",
            "preview.camera.fov|180 is out of range",
        ),
        (
            "sheet = 2",
            "camera = { eye = [0, 0, 9], target = [0, 0, 0], up = [0, 0, 0] }",
            "preview.camera.up|direction",
        ),
        ("sheet = 2", "zoom = 2\ncamera = { eye = [0, 0, 9], target = [0, 0, 0] }", "preview.zoom|is not read|help:"),
        (
            "sheet = 2",
            "from = [0, 0, 1]\ncamera = { eye = [0, 0, 9], target = [0, 0, 0] }",
            "preview.from|is not read|help:",
        ),
    ] {
        corpus.refuse_edit(SHOT, from, to, &format!("pipeline.toml, line|{words}"));
    }
    corpus.finish();
}

#[test]
fn values_of_the_simulation() {
    let mut corpus = Corpus::new();
    let simulate = |text: &str| format!("target = \"off\"\n{text}");
    for (text, words) in [
        ("segments = 0", "simulate.segments|out of range|help:"),
        ("segments = 5000", "simulate.segments|out of range|help:"),
        ("substeps = 0", "simulate.substeps|out of range|help:"),
        ("substeps = -1", "invalid value"),
        ("strain_limit = 0", "simulate.strain_limit|out of range|help:"),
        ("friction = -0.1", "simulate.friction|out of range"),
        ("friction = nan", "simulate.friction|out of range"),
        ("offset = inf", "simulate.offset|millimetres"),
        ("teleport = 0", "simulate.teleport|metres"),
        ("checkpoint = 0", "simulate.checkpoint|out of range"),
        ("model = \"rods\"", "did you mean `rod`?"),
        ("sleep = 1", "expected a boolean"),
        ("gravity = \"down\"", "expected a number, three numbers, or a list of { frame, value }"),
        ("gravity = nan", "simulate.gravity|out of range|help:"),
        ("gravity = [0, 1e300, 0]", "simulate.gravity|out of range|help:"),
        ("gravity = [{ frame = 1 }]", "missing field `value`"),
        ("gravity = [{ frame = 2, value = 1 }, { frame = 2, value = 3 }]", "simulate.gravity[1]|does not come after"),
        ("gravity = [{ frame = nan, value = 1 }]", "simulate.gravity|does not come after"),
        ("wind = { speed = 3 }", "unknown field `speed`"),
        ("wind = { velocity = 3 }", "line"),
        ("wind = { velocity = [1, 2] }", "line|array of 3 values"),
        ("wind = { velocity = [1, 2, inf] }", "simulate.wind.velocity|out of range|m/s"),
        ("frction = 0.3", "did you mean `friction`?"),
        ("wind = { velocity = [1, 0, 0], gust = -200 }", "simulate.wind.gust|out of range"),
        ("wind = { velocity = [1, 0, 0], turbulence_size = 0 }", "simulate.wind.turbulence_size|out of range"),
        ("body = { voxel = 0 }", "simulate.body.voxel|out of range|millimetres"),
        ("body = { kind = \"ball\" }", "unknown variant `ball`"),
        ("body = { axis = [[0, 0, 0], [0, 0, 0]] }", "simulate.body.axis|has no direction|help:"),
        ("body = { axis = [[0, 0, 0], [0, 1]] }", "line|array of 3 values"),
        ("body = { voxels = 1 }", "did you mean `voxel`?"),
        ("body = { mesh = [{ file = \"a\", kind = \"ball\" }] }", "unknown variant `ball`"),
        ("body = { mesh = [{ file = \"a\", pivot = [nan, 0, 0] }] }", "simulate.body.mesh[0].pivot"),
    ] {
        corpus.refuse_edit(SHOT, "target = \"off\"", &simulate(text), &format!("pipeline.toml, line|{words}"));
    }
    corpus.refuse_edit(SHOT, "target = \"off\"", "target = \"every-hairs\"", "did you mean `every-hair`?");
    corpus.refuse_edit(SHOT, "fps =", "preroll = -1\nfps =", "pipeline.toml, line|preroll|expected u32");
    corpus.refuse_edit(SHOT, "fps =", "preroll = 1000000\nfps =", "pipeline.toml, line|shot.preroll|help:");
    for (text, words) in [
        ("material = { young = 3 }", "unknown field `young`|did you mean `young_gpa`?"),
        ("material = { young_gpa = 0 }", "layer[1].material.young_gpa|out of range|help:"),
        ("material = { density = 0 }", "layer[1].material.density|out of range|help:"),
        ("material = { poisson = 0.7 }", "layer[1].material.poisson|out of range|help:"),
        ("material = { diameter = nan }", "layer[1].material.diameter|out of range|help:"),
        ("simulate = \"guides\"", "unknown variant `guides`"),
    ] {
        corpus.refuse_edit(
            GROOM,
            "name = \"over\"",
            &format!("name = \"over\"\n{text}"),
            &format!("ball.toml, line|{words}"),
        );
    }
    corpus.finish();
}

#[test]
fn values_out_of_range_in_the_groom() {
    let mut corpus = Corpus::new();
    for (from, to, words) in [
        ("per_cm2 = 0.2", "per_cm2 = -1", "line 2|control.placement.per_cm2|help:"),
        ("per_cm2 = 0.2", "per_cm2 = nan", "line 2|control.placement.per_cm2|help:"),
        ("{ per_cm2 = 0.2 }", "{}", "line 2|control.placement|help:"),
        ("per_cm2 = 0.2", "per_cm2 = 0.2, grid = [3, 3]", "line 2|control.placement|help:"),
        ("per_cm2 = 0.2", "grid = [0, 3]", "line 2|control.placement.grid|help:"),
        ("per_cm2 = 0.2", "grid = [100000, 100000]", "line 2|control.placement.grid|help:"),
        ("points = 6", "points = 1", "line 3|control.points|help:"),
        ("points = 6", "points = 100000", "line 3|control.points|help:"),
        ("points = 6", "clearance = -1", "line 3|control.clearance|help:"),
        ("points = 6", "length = { value = inf }", "line 3|control.length.value|help:"),
        ("bend = 0.6", "bend = 1.6", "comb[0].bend|help:"),
        ("bend = 0.6", "weight = -0.1", "comb[0].weight|help:"),
        ("bend = 0.6", "radius = -1", "comb[0].radius|help:"),
        ("bend = 0.6", "angle = 10", "comb[0].angle|not read|help:"),
        ("bend = 0.6", "parting = \"middle\"", "comb[0]|parting|side|help:"),
        ("bend = 0.6", "parting = \"middle\"\nside = \"left\"", "comb[0].parting|no parting `middle`|help:"),
        ("[[0.0, 10.0, 0.0], ", "[", "comb[0].points"),
        ("[0.0, 10.0, 0.0]", "[0.0, nan, 0.0]", "comb[0].points"),
        ("direction-curve", "bend", "comb[0]"),
        ("density = { value = 4.0", "density = { value = -4.0", "layer[0].density.value|help:"),
        ("density = { value = 4.0", "density = { value = 1e9", "layer[0].density.value|help:"),
        ("noise = 0.2", "noise = 1.2", "layer[0].length.noise|help:"),
        ("length = { value = 1.0", "length = { value = nan", "layer[0].length.value|help:"),
        ("tip = 0.5", "tip = -0.5", "layer[0].width.tip|help:"),
        ("width = { value = 40.0", "width = { value = -40.0", "layer[0].width.value|help:"),
        ("tip = 0.5 }", "tip = 0.5 }\nopacity = { value = 2 }", "layer[0].opacity.value|help:"),
        ("[0.4, 0.2, 0.1]", "[0.4, -0.2, 0.1]", "layer[1].color.value[1]|help:"),
        ("tip = 0.5", "profile = [1]", "layer[0].width.profile|1 stations|help:"),
        (
            "tip = 0.5",
            "profile = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]",
            "layer[0].width.profile|17 stations",
        ),
        ("tip = 0.5", "profile = [1, -0.5]", "layer[0].width.profile[1]|help:"),
        ("tip = 0.5", "tip = 0.5, profile = [1, 0.5]", "layer[0].width.profile|`tip`|help:"),
        ("[0.4, 0.2, 0.1]", "[0.4, 0.2, 0.1], ramp = []", "layer[1].color.ramp|0 stations|help:"),
        ("[0.4, 0.2, 0.1]", "[0.4, 0.2, 0.1], ramp = [[1, 1, 1], [1, nan, 1]]", "layer[1].color.ramp[1]|help:"),
        ("[0.4, 0.2, 0.1]", "[0.4, 0.2, 0.1], ramp = [[1, 1, 1], [1, 1]]", "3"),
        ("name = \"over\"", "name = \"over\"\nguard = { percent = 2 }", "layer[1].guard.percent|help:"),
        ("name = \"over\"", "name = \"over\"\nguard = { percent = 0.5, length = -1 }", "layer[1].guard.length|help:"),
        ("name = \"over\"", "name = \"over\"\nguard = { percent = 0.5, width = inf }", "layer[1].guard.width|help:"),
        ("name = \"over\"", "name = \"over\"\nguard = { length = 2 }", "percent"),
        (
            "name = \"over\"",
            "name = \"over\"\nguard = { percent = [{ frame = 1, value = 0 }, { frame = 2, value = 1 }] }",
            "layer[1].guard.percent|can't have key frames|help:",
        ),
        (
            "name = \"over\"",
            "name = \"over\"\nmaterial = { density = [{ frame = 1, value = 1 }, { frame = 2, value = 1 }] }",
            "layer[1].material.density|can't have key frames|help:",
        ),
        (
            "name = \"over\"",
            "name = \"over\"\nmaterial = { diameter = { value = 70, map = \"none.png\" } }",
            "layer[1].material.diameter.map|none.png",
        ),
        ("name = \"over\"", "name = \"over\"\nguard = { percent = 0.5, colour = 1 }", "colour"),
        ("name = \"over\"", "name = \"under\"", "layer[1].name|twice|help:"),
        ("name = \"over\"", "name = \"\"", "layer[1].name|help:"),
        ("[[layer]]", "[[parting]]\nname = \"p\"\npoints = [[0, 0, 0]]\n[[layer]]", "parting[0].points"),
    ] {
        corpus.refuse_edit(GROOM, from, to, &format!("ball.toml, line|{words}"));
    }
    corpus.finish();
}

#[test]
fn arguments_that_do_not_fit() {
    let corpus = Corpus::new();
    for (arguments, words) in [
        (vec!["run", "--frames", "7"], vec!["frame 7", "help:"]),
        (vec!["run", "--frames", "2-1"], vec!["2-1"]),
        (vec!["run", "--to", "render"], vec!["render"]),
        (vec!["run", "--jobs", "0"], vec!["0"]),
        (vec!["run", "nowhere.toml"], vec!["nowhere.toml", "help:"]),
        (vec!["plan", "nowhere.toml"], vec!["nowhere.toml", "help:"]),
        (vec!["preview", "nowhere.toml"], vec!["nowhere.toml", "help:"]),
        (vec!["inspect", "nowhere.ply"], vec!["nowhere.ply"]),
        (vec!["inspect", "grooms"], vec!["grooms"]),
        (vec!["compare", "out/ball/hair.usdc", "maps/half.png"], vec!["half.png"]),
        (vec!["cache", "stats", "nowhere.toml"], vec!["nowhere.toml"]),
        (vec!["init", "."], vec!["help:"]),
        (vec!["comb"], vec!["comb"]),
    ] {
        let said = run_bounded(corpus.shot.path(), &arguments);
        assert_eq!(said.code, Some(2), "{arguments:?}: {}", said.err);
        assert_eq!(said.err.lines().filter(|l| l.starts_with("error: ")).count(), 1, "{arguments:?}: {}", said.err);
        for word in words {
            assert!(said.err.contains(word), "{arguments:?} does not say `{word}`: {}", said.err);
        }
    }
    corpus.finish();
}

#[test]
fn fields_flows_and_cuts() {
    let mut corpus = Corpus::new();
    for (comb, words) in [
        ("kind = \"field\"", "comb[1]|needs `primitive`"),
        ("kind = \"flow\"", "comb[1]|needs `element`"),
        ("kind = \"cut\"", "comb[1]|needs `shear`"),
        ("kind = \"bend\"\nangle = 1.0\nreverse = true", "comb[1].reverse|not read"),
        ("kind = \"flow\"\nprimitive = [{ orientation = \"radial\" }]", "comb[1].primitive|not read"),
        ("kind = \"field\"\nprimitive = [{ orientation = \"constant\" }]", "primitive[0]|needs `direction`"),
        ("kind = \"field\"\nprimitive = [{ orientation = \"radial\", radius = 1.0 }]", "radius|not read"),
        ("kind = \"field\"\nprimitive = [{ orientation = \"radial\", strength = nan }]", "strength|out of range"),
        ("kind = \"field\"\nprimitive = [{ orientation = \"radial\", shape = [1.0, 0.0, 1.0] }]", "shape|out of range"),
        (
            "kind = \"field\"\nprimitive = [{ orientation = \"radial\", falloff = { from = 2.0, to = 1.0 } }]",
            "falloff.to",
        ),
        (
            "kind = \"field\"\nprimitive = [{ orientation = \"radial\", falloff = { exponent = 2.0, to = 1.0 } }]",
            "falloff.to",
        ),
        (
            "kind = \"field\"\nprimitive = [{ orientation = \"along\", points = [[0.0, 0.0, 0.0]] }]",
            "points|two or more",
        ),
        (
            "kind = \"field\"\nprimitive = [{ orientation = \"radial\" }]\ndivider = [{ point = [0.0, 0.0, 0.0] }]",
            "normal",
        ),
        (
            "kind = \"field\"\nprimitive = [{ orientation = \"radial\" }]\ndivider = [{ centre = [0.0, 0.0, 0.0], radii = [1.0, 1.0, 0.0] }]",
            "radii",
        ),
        ("kind = \"flow\"\nelement = [{ kind = \"source\" }]", "element[0]|needs `at`"),
        (
            "kind = \"flow\"\nelement = [{ kind = \"vortex\", at = [0.0, 0.0, 0.0], axis = [0.0, 0.0, 0.0] }]",
            "axis|direction",
        ),
        ("kind = \"flow\"\nelement = [{ kind = \"stream\", velocity = [0.0, inf, 0.0] }]", "velocity|out of range"),
        ("kind = \"flow\"\npanels = { most = 3 }", "panels.most|20 to"),
        ("kind = \"flow\"\npanels = { through = { value = 1.0, noise = 0.1 } }", "through.noise|not read"),
        ("kind = \"flow\"\npanels = { file = \"none.ply\" }", "none.ply"),
        ("kind = \"flow\"\npanels = { through = { value = 1.0, map = \"none.png\" } }", "none.png"),
        ("kind = \"cut\"\nshear = {}", "shear|needs `at`"),
        ("kind = \"cut\"\nshear = { part = { point = [0.0, 0.0, 0.0], normal = [1.0, 0.0, 0.0] } }", "needs `front`"),
        (
            "kind = \"cut\"\nshear = { at = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 0.0] } }",
            "shear.at|direction",
        ),
        (
            "kind = \"cut\"\nscalp = { centre = [0.0, 0.0, 0.0], radius = -1.0 }\nshear = { at = { point = [0.0, 0.0, 0.0], normal = \
             [0.0, 1.0, 0.0] } }",
            "scalp.radius|out of range",
        ),
    ] {
        corpus.refuse_edit(
            GROOM,
            "[[layer]]",
            &format!("[[comb]]\n{comb}\n\n[[layer]]"),
            &format!("ball.toml|{words}"),
        );
    }
    corpus.finish();
}

#[test]
fn clusters_chains_and_hairs_by_hand() {
    let mut corpus = Corpus::new();
    let cluster = "[[cluster]]\nname = \"a\"\nroot = [0.0, 5.0, 0.0]\nradius = 2.0\npoints = [[0.0, 9.0, 0.0]]\n";
    let used = "[[comb]]\nkind = \"cluster\"\n";
    let edit = |edit: &str| format!("{cluster}[[cluster_edit]]\n{edit}\n{used}");
    let keyed = |angle: &str| format!("[[comb]]\nkind = \"bend\"\nangle = {angle}\n");
    let hair = "[[control.hair]]\nname = \"w\"\nroot = [0.0, 5.0, 0.0]\n";
    for (text, words) in [
        (cluster.replace("radius = 2.0\n", ""), "cluster[0]|one of `radius`, `outline`"),
        (cluster.replace("2.0", "-2.0"), "cluster[0].radius|out of range"),
        (cluster.replace("[[0.0, 9.0, 0.0]]", "[]"), "cluster[0].points|one or more"),
        (cluster.replace("0.0]]", "0.0], [0.0, 9.0, 0.0]]") + used, "cluster[0]|control points 1 and 2"),
        (cluster.replace("radius = 2.0", "outline = [[0.0, 5.0, 0.0], [0.0, 5.0, 0.1]]"), "outline|three corners"),
        (cluster.replace("radius = 2.0", "radius = 2.0\nwidth = [0.0, 0.0]"), "cluster[0].width|above 0"),
        (format!("{cluster}{cluster}"), "cluster[1].name|used twice"),
        (edit("kind = \"split\"\nof = \"a\""), "cluster_edit[0]|needs `count`"),
        (edit("kind = \"split\"\nof = \"b\"\ncount = 3"), "cluster_edit[0].of|no cluster `b`"),
        (edit("kind = \"split\"\nof = \"a/0\"\ncount = 3"), "cluster_edit[0]|no cluster `a/0`"),
        (edit("kind = \"braid\"\nof = \"a\"\ncount = 4\nturns = 1.0"), "cluster_edit[0].count|no such braid"),
        (edit("kind = \"braid\"\nof = \"a\""), "cluster_edit[0]|needs `turns`"),
        (edit("kind = \"copy\"\nof = \"a\""), "cluster_edit[0]|needs `to`"),
        (edit("kind = \"twist\"\nof = \"a\"\nturns = 1.0\nwidth = [1.0]"), "cluster_edit[0].width|not read"),
        ("[[comb]]\nkind = \"cluster\"\n".to_owned(), "comb[1]|there are no clusters"),
        ("[scalp]\nup = [0.0, 1.0, 0.0]\n".to_owned(), "scalp|give `centre`, `up` and `front`"),
        ("[scalp]\ngrowth = [[[0.0, 0.0], [1.0, 0.0]]]\n".to_owned(), "scalp.growth[0]|three or more"),
        (
            "[scalp]\ncentre = [0.0, 0.0, 0.0]\nup = [0.0, 1.0, 0.0]\nfront = [0.0, 2.0, 0.0]\n".to_owned(),
            "scalp.front|not along",
        ),
        ("[[comb]]\nkind = \"chain\"\nat = [0.0, 5.0, 0.0]\n".to_owned(), "comb[1]|`turn` or `reach`"),
        ("[[comb]]\nkind = \"chain\"\nhair = \"w\"\nreach = [0.0, 5.0, 0.0]\n".to_owned(), "comb[1].hair|no hair `w`"),
        (
            "[[comb]]\nkind = \"chain\"\nat = [0, 5, 0]\nturn = [{ joint = 50, turn = [0, 0, 9] }]\n".to_owned(),
            "comb[1].turn[0].joint|no joint 50|help:",
        ),
        ("[[comb]]\nkind = \"mirror\"\n".to_owned(), "comb[1]|needs `plane`"),
        (
            "[[comb]]\nkind = \"cut\"\nkey = [{ at = [0, 5, 0], length = 1 }]\n".to_owned(),
            "comb[1].key|goes with `scalp`",
        ),
        (
            "[[comb]]\nkind = \"mirror\"\nplane = { point = [0, 0, 0], normal = [0, 0, 0] }\n".to_owned(),
            "comb[1].plane|direction",
        ),
        ("[[comb]]\nkind = \"trim\"\nfile = \"none.ply\"\n".to_owned(), "comb[1].file|none.ply"),
        ("[[comb]]\nkind = \"bend\"\nangle = []\n".to_owned(), "angle"),
        (
            "[[comb]]\nkind = \"bend\"\nangle = [{ frame = 2, value = 1.0 }, { frame = 1, value = 0.0 }]\n".to_owned(),
            "comb[1].angle|not in order",
        ),
        ("[[comb]]\nkind = \"bend\"\nangle = { value = 1.0, map = \"none.png\" }\n".to_owned(), "angle.map|none.png"),
        (keyed("[{ frame = 1, value = 1.0 }, { frame = 2, valeu = 0.0 }]"), "comb[1].angle|unknown field `valeu`"),
        (keyed("[{ frame = 1, value = 1.0 }, { frame = 2 }]"), "comb[1].angle|missing field `value`"),
        ("[[comb]]\nkind = \"smooth\"\ncontrol_points = 3\n".to_owned(), "comb[1].control_points|out of range|help:"),
        ("[[comb]]\nkind = \"smooth\"\ncontrol_points = 300\n".to_owned(), "comb[1].control_points|out of range|help:"),
        (keyed("[{ frame = 1, value = 1.0 }, 3.0]"), "comb[1].angle|no key frame"),
        (keyed("[{ frame = [1], value = 1.0 }]"), "comb[1].angle|a frame is a number"),
        (keyed("[{ frame = nan, value = 1.0 }]"), "comb[1].angle|finite numbers"),
        (
            "[[comb]]\nkind = \"field\"\nprimitive = [{ orientation = \"radial\" }]\ndivider = [{ point = \
             [{ frame = 1, value = [0, 0, 0] }, { frame = 3, value = [4, 0, 0] }], normal = [1, 0, 0] }]\n"
                .to_owned(),
            "comb[1].divider[0].point|can't have key frames|help:",
        ),
        (
            "[[comb]]\nkind = \"cut\"\nshear = { at = { point = [0, 0, 0], normal = \
             [{ frame = 1, value = [0, 1, 0] }, { frame = 3, value = [0, -1, 0] }] } }\n"
                .to_owned(),
            "comb[1].shear.at|direction|at frame 2, between key frames",
        ),
        ("[[comb]]\nkind = \"mirror\"\nplane = { point = [0, 0, 0], normal = [1e300, 0, 0] }\n".to_owned(), "comb[1].plane|direction"),
        (
            format!("{}{}", keyed("[{ frame = 3, value = 6000.0 }, { frame = 5, value = 0.0 }]"), keyed("[{ frame = 4, value = 1.0 }]")),
            "comb[1].angle|6000 is out of range",
        ),
        (format!("{cluster}{used}level = 1\n"), "comb[1].level|no clusters of level 1|help:"),
        (keyed("[{ frame = 1, value = true }]"), "comb[1].angle|key frames hold numbers"),
        (keyed("[{ frame = 1, value = 1.0 }, { frame = 2, value = 1000.0 }]"), "comb[1].angle|1000 is out of range"),
        (keyed("[{ frame = 1, value = 1.0 }, { frame = 2, value = [1.0] }]"), "comb[1].angle|different lengths"),
        (keyed("[{ frame = 1, value = [1.0] }]"), "line 13|expected f64"),
        (
            "[[comb]]\nkind = \"mirror\"\nplane = { point = [{ frame = 1, value = [0, 0, 0] }, { frame = 2, value = [1, 0] }], \
             normal = [0, 1, 0] }\n"
                .to_owned(),
            "comb[1].plane.point|different lengths",
        ),
        (
            edit("kind = \"split\"\nof = \"a\"\ncount = [{ frame = 1, value = 3 }, { frame = 2, value = 4 }]"),
            "floating point `3.0`, expected usize",
        ),
        (
            cluster.replace("2.0", "[{ frame = 1, value = 1.0 }, { frame = 2, value = 2.0 }]"),
            "cluster[0].radius|can't have key frames|help:",
        ),
        ("[[comb]]\nkind = \"bend\"\nangle = 1.0\nhairs = [\"x*\"]\n".to_owned(), "comb[1].hairs|no hair `x*`"),
        (format!("{hair}{hair}"), "control.hair[1].name|used twice"),
        (format!("{hair}points = [[0.0, 5.0, 0.0]]\n"), "control.hair[0].points|apart"),
        ("[[control.line]]\npoints = [[0.0, 5.0, 0.0], [5.0, 0.0, 0.0]]\ncount = 0\n".to_owned(), "count|out of range"),
        ("[[layer]]\nname = \"x\"\nlength = { value = 1.0 }\n".to_owned(), "layer[0]|needs `density`|help:"),
        ("[[layer]]\nname = \"x\"\nhairs = [\"w\"]\n".to_owned(), "layer[0].hairs|no hair `w`"),
        (format!("{hair}[[layer]]\nname = \"x\"\nhairs = [\"w\"]\ndensity = {{ value = 1.0 }}\n"), "density|not read"),
        (
            "[[layer]]\nname = \"x\"\nin_clusters = true\ndensity = { value = 1.0 }\nlength = { value = 1.0 }\n"
                .to_owned(),
            "in_clusters|no clusters",
        ),
    ] {
        corpus.refuse_edit(GROOM, "[[layer]]", &format!("{text}\n[[layer]]"), &format!("ball.toml|{words}"));
    }
    corpus.finish();
}
