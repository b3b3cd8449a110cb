//! Broken looks, and looks at the edge of sense.

use super::edges::works;
use super::{COMMAND, Corpus, run_bounded};
use pelage_tests::{ShotFolder, grey_png, small_shot};

const GROOM: &str = "grooms/ball.toml";
const SHOT: &str = "pipeline.toml";
/// Stands where the look of the last layer is broken.
const HERE: &str = "# here";

/// The small shot with room for a look of its second layer.
fn shot() -> ShotFolder {
    let shot = small_shot(COMMAND, 2);
    let groom = String::from_utf8(shot.read(GROOM)).expect("text");
    shot.write(GROOM, format!("{groom}{HERE}\n"));
    shot
}

#[test]
fn clumps() {
    let mut corpus = Corpus::of(shot());
    let at = "layer[1].clump[0]";
    for (look, words) in [
        ("percent = 0.5", "does not say what its clumps are|density, regions, roots, curves"),
        ("density = 1\nroots = [[0, 5, 0]]", "does not say what its clumps are|help:"),
        ("density = -1", ".density|-1 is out of range|help:"),
        ("density = nan", ".density|NaN is out of range|help:"),
        ("density = inf", ".density|inf is out of range|help:"),
        ("density = { value = 1, noise = 2 }", ".density.noise|2 is out of range|help:"),
        ("density = [{ frame = 1, value = 1 }, { frame = 2, value = 2 }]", ".density|can't have key frames|help:"),
        ("density = 1\nsize = -1", ".size|-1 is out of range|help:"),
        ("density = 1\nsize = [{ frame = 1, value = 1 }, { frame = 2, value = 2 }]", ".size|can't have key frames"),
        ("density = 1\npercent = 1.5", ".percent|1.5 is out of range|from 0 to 1"),
        ("density = 1\npercent = nan", ".percent|NaN is out of range"),
        ("density = 1\npercent = [{ frame = 1, value = 0 }, { frame = 2, value = -1 }]", ".percent|-1 is out of range"),
        ("density = 1\npercent = [{ frame = 2, value = 0 }, { frame = 1, value = 1 }]", ".percent|not in order|help:"),
        ("density = 1\npercent = [{ frame = 2, value = 0 }, { frame = 2, value = 1 }]", ".percent|not in order|help:"),
        ("density = 1\npercent = [{ frame = nan, value = 0 }]", ".percent|NaN is out of range"),
        ("density = 1\nrate = 2", ".rate|2 is out of range"),
        ("density = 1\nfalloff = -0.5", ".falloff|out of range"),
        ("density = 1\nsplay = 3", ".splay|out of range"),
        ("density = 1\nweave = inf", ".weave|out of range"),
        ("density = 1\ntaper = 1.5", ".taper|out of range"),
        (
            "density = 1\npercent = { value = 1, vary = [{ size = 0, deviation = 1 }] }",
            ".percent.vary|0 is out of range",
        ),
        ("density = 1\npercent = { value = 1, vary = [{ size = 1, deviation = nan }] }", ".percent.vary|NaN"),
        ("density = 1\nof = \"clumps\"", ".of|no level before the first|help:"),
        ("density = 1\nrate = 0.5\ndilation = { mean = [1, 1, 1, 1] }", ".rate|dilation|help:"),
        ("density = 1\ndilation = { mean = [1, 1, 1, -1] }", ".dilation|out of range"),
        ("density = 1\nwet = { width = -1 }", ".wet.width|out of range"),
        (
            "density = 1\nsimulate = true\npercent = [{ frame = 1, value = 1 }, { frame = 2, value = 0 }]",
            ".percent|can't have key frames|rest shape|help:",
        ),
        ("density = 1\nhold = 0", ".hold|0 is out of range"),
        ("density = 1\nwet = { width = 1 }\nsimulate = true", ".wet|shape only|help:"),
        ("density = 1\nareas = [\"hose\"]", ".areas|no emitter `hose`|help:"),
        ("roots = []", "need finite points|help:"),
        ("curves = []", "need finite points|help:"),
        ("roots = [[0, nan, 0]]", "finite points|help:"),
        ("curves = [[[0, 5, 0]]]", "two or more|help:"),
    ] {
        corpus.refuse_edit(GROOM, HERE, &format!("[[layer.clump]]\n{look}"), &format!("ball.toml, line|{at}|{words}"));
    }
    corpus.finish();
}

#[test]
fn wrong_types_and_unknown_keys() {
    let mut corpus = Corpus::of(shot());
    for (look, words) in [
        ("[[layer.clump]]\ndensity = \"1\"", "line 23|density|\"1\"|expected a number"),
        ("[[layer.clump]]\ndensity = 1\npercent = []", "line 24|percent|expected a number"),
        ("[[layer.clump]]\ndensity = 1\npercent = [1, 2]", "line 24|percent|expected f64"),
        ("[[layer.clump]]\ndensity = 1\npercent = true", "line 24|percent|true|expected a number"),
        ("[[layer.clump]]\ndensity = 1\npercent = { value = true }", "line 24|percent|true|expected a number"),
        ("[[layer.clump]]\ndensity = 1\npercent = { map = \"a.png\" }", "line 24|missing field `value`"),
        (
            "[[layer.clump]]\ndensity = 1\npercent = [\n{ frame = 1, value = 1 },\n{ frame = 2, value = true },\n]",
            "line 26|value = true|expected f64",
        ),
        ("[[layer.clump]]\ndensity = 1\npercent = { value = 1, map = 3 }", "line 24|percent|map|expected"),
        ("[[layer.clump]]\ndensity = 1\npercent = { value = 1, noise = \"x\" }", "line 24|percent|noise|expected f64"),
        ("[[layer.clump]]\ndensity = 1\npercent = { value = 1, nosie = 1 }", "line 24|did you mean `noise`?"),
        ("[[layer.clump]]\ndensity = 1\npercent = { value = 1, vary = [{ size = 1 }] }", "line 24|vary|`deviation`"),
        ("[[layer.clump]]\ndensity = 1\npercent = [{ frame = 1, valu = 1 }]", "line 24|did you mean `value`?"),
        ("[[layer.clump]]\ndensity = 1\npercent = [{ frame = 1 }]", "line 24|missing field `value`"),
        (
            "[[layer.clump]]\ndensity = 1\npercent = [{ frame = 1, value = \"x\" }]",
            "line 24|percent|value|expected f64",
        ),
        ("[[layer.clump]]\ndensity = 1\npercnt = 1", "line 24|did you mean `percent`?"),
        ("[[layer.clump]]\ndensity = 1\nof = \"clump\"", "line 24|did you mean `clumps`?"),
        ("[[layer.clump]]\ndensity = 1\nsimulate = 1", "line 24|expected a boolean"),
        ("[[layer.clump]]\ndensity = 1\ndilation = { mean = [1, 1] }", "line 24|array of 4 values"),
        ("[[layer.clump]]\ndensity = 1\nwet = { widht = 1 }", "line 24|did you mean `width`?"),
        ("[[layer.clump]]\nroots = [[1, 2]]", "line 23|array of 3 values"),
        ("[layer.clump]\ndensity = 1", "line 22"),
        ("[layer.curl]\nradius = 1\npitch = 1", "missing field `kind`"),
        ("[layer.curl]\nkind = \"helic\"\nradius = 1\npitch = 1", "line 23|did you mean `helix`?"),
        ("[layer.curl]\nkind = \"helix\"\nradus = 1", "line 24|did you mean `radius`?"),
        ("[layer.curl]\nkind = \"custom\"\nx = { aplha = 1 }\ny = {}", "line 24|did you mean `alpha`?"),
        ("[[layer.wave]]\nshape = \"sinus\"", "line 23|unknown variant `sinus`"),
        ("[[layer.wave]]\nx = { amplitude = [1, 2, 3] }", "line 23|array of 4 values"),
        ("[[layer.wave]]\nx = { amplitud = [1, 2, 3, 4] }", "line 23|did you mean `amplitude`?"),
        ("[[layer.noise]]\namplitude = 1", "missing field `size`"),
        ("[layer.wind]\namplitude = 1\nsize = 1\ndirection = [1, 0]", "line 25|array of 3 values"),
        ("order = [\"clumps\"]", "line 22|did you mean `clump`?"),
        ("collision = { clearence = 1 }", "line 22|did you mean `clearance`?"),
        ("[[emitter]]\nname = \"a\"\nradius = 1\nspred = 1", "line 25|did you mean `spread`?"),
        ("[[emitter]]\nname = \"a\"\nradius = []", "line 24|expected"),
        ("[[emitter]]\nname = \"a\"\nradius = 1\nframes = [1]", "line 25|array of 2 values"),
    ] {
        corpus.refuse_edit(GROOM, HERE, look, &format!("ball.toml, |{words}"));
    }
    corpus.finish();
}

#[test]
fn curls_waves_noise_wind_and_their_order() {
    let mut corpus = Corpus::of(shot());
    let curl = |text: &str| format!("[layer.curl]\nkind = \"helix\"\nradius = 0.1\npitch = 1\n{text}");
    let cases = [
        ("[layer.curl]\nkind = \"helix\"\npitch = 1".to_owned(), "curl|needs `radius`|help:"),
        ("[layer.curl]\nkind = \"dished\"\nradius = 1".to_owned(), "curl|needs `pitch`|help:"),
        ("[layer.curl]\nkind = \"helix\"\nradius = 1\npitch = 0".to_owned(), "curl.pitch|must be above 0|help:"),
        ("[layer.curl]\nkind = \"helix\"\nradius = -1\npitch = 1".to_owned(), "curl.radius|-1 is out of range"),
        ("[layer.curl]\nkind = \"helix\"\nradius = 1\npitch = nan".to_owned(), "curl.pitch|NaN is out of range"),
        (curl("phase = inf"), "curl.phase|inf is out of range"),
        (curl("tighten = -1"), "curl.tighten|out of range"),
        (curl("depth = 1"), "curl.depth|\"dished\" only|help:"),
        (curl("start = -1"), "curl.start|out of range"),
        (curl("profile = [1]"), "curl.profile|2 to 64 stations|help:"),
        (curl("profile = [1, nan]"), "curl.profile|NaN is out of range"),
        (curl("per_clump = true"), "curl.per_clump|no clumps|help:"),
        (curl("x = { a = 1 }"), "curl.x|\"custom\"|help:"),
        ("[layer.curl]\nkind = \"custom\"\nx = { a = 1 }".to_owned(), "curl.y|both x and y"),
        ("[layer.curl]\nkind = \"custom\"\ny = {}\nx = { a = inf }".to_owned(), "curl.x.a|inf is out of range"),
        (
            "[layer.curl]\nkind = \"custom\"\ny = {}\nx = { d = 1, gamma = 1000 }".to_owned(),
            "curl|grows beyond all numbers|lower gamma",
        ),
        ("[[layer.wave]]\nx = { phase = nan }".to_owned(), "wave[0].x.phase|NaN is out of range"),
        ("[[layer.wave]]\nsize = -1".to_owned(), "wave[0].size|out of range"),
        ("[[layer.wave]]\nstray = 2".to_owned(), "wave[0].stray|out of range"),
        ("[[layer.noise]]\namplitude = 0.1\nsize = 0".to_owned(), "noise[0].size|0 is out of range"),
        ("[[layer.noise]]\namplitude = -0.1\nsize = 1".to_owned(), "noise[0].amplitude|out of range"),
        ("[[layer.noise]]\namplitude = 1\nsize = 1\nprofile = []".to_owned(), "noise[0].profile|2 to 64"),
        ("[layer.wind]\namplitude = 1\nsize = 1\ndirection = [0, 0, 0]".to_owned(), "wind.direction|a direction|help:"),
        ("[layer.wind]\namplitude = 1\nsize = 0\ndirection = [1, 0, 0]".to_owned(), "wind.size|out of range"),
        ("[layer.wind]\namplitude = 1\nsize = 1\ngust = 2\ndirection = [1, 0, 0]".to_owned(), "wind.gust|out of range"),
        ("order = [\"clump\", \"clump\"]".to_owned(), "order|every operator of the layer once|help:"),
        ("collision = { clearance = 0 }".to_owned(), "collision.clearance|out of range"),
        ("collision = { held = nan }".to_owned(), "collision.held|out of range"),
        (curl("simulate = true\n[[layer.clump]]\ndensity = 1"), "is simulated comes after one that is not|help:"),
    ];
    for (look, words) in &cases {
        corpus.refuse_edit(GROOM, HERE, look, &format!("ball.toml, line|layer[1]|{words}"));
    }
    corpus.finish();
}

#[test]
fn emitters_and_particle_files() {
    let shot = shot();
    shot.write("grooms/rain.csv", "frame,x,y,z,dx,dy,dz\n1,0,20,0,0,-1,0\n1.5,1,20,0,0,-1,0\n");
    let mut corpus = Corpus::of(shot);
    let aimed = "position = [0, 20, 0]\ndirection = [0, -1, 0]";
    for (emitter, words) in [
        ("radius = 1".to_owned(), "emitter[0]|where its particles come from|help:"),
        (format!("{aimed}\nfile = \"rain.csv\"\nradius = 1"), "emitter[0]|where its particles come from|help:"),
        ("position = [0, nan, 0]\ndirection = [0, 1, 0]\nradius = 1".to_owned(), "emitter[0].position|finite|help:"),
        ("position = [0, 1, 0]\ndirection = [0, 0, 0]\nradius = 1".to_owned(), "emitter[0].direction|help:"),
        (format!("{aimed}\nradius = -1"), "emitter[0].radius|out of range"),
        (format!("{aimed}\nradius = nan"), "emitter[0].radius|NaN is out of range"),
        (
            format!("{aimed}\nradius = [{{ frame = 2, value = 1 }}, {{ frame = 1, value = 1 }}]"),
            "emitter[0].radius|order|help:",
        ),
        (format!("{aimed}\nradius = [{{ frame = nan, value = 1 }}]"), "emitter[0].radius|NaN is out of range"),
        (format!("{aimed}\nradius = 1\npercent = 2"), "emitter[0].percent|out of range"),
        (format!("{aimed}\nradius = 1\nclump_rate = inf"), "emitter[0].clump_rate|out of range"),
        (format!("{aimed}\nradius = 1\nspread = 200"), "emitter[0].spread|out of range"),
        (format!("{aimed}\nradius = 1\nrate = nan"), "emitter[0].rate|out of range"),
        (format!("{aimed}\nradius = 1\nframes = [3, 1]"), "emitter[0].frames|before the first|help:"),
        ("file = \"snow.csv\"\nradius = 1".to_owned(), "emitter[0].file|snow.csv|help:"),
        ("file = \"..\"\nradius = 1".to_owned(), "emitter[0].file"),
    ] {
        let text = format!("[[layer.clump]]\ndensity = 1\nareas = [\"a\"]\n[[emitter]]\nname = \"a\"\n{emitter}");
        corpus.refuse_edit(GROOM, HERE, &text, &format!("ball.toml, line|{words}"));
    }
    let twice = format!("[[emitter]]\nname = \"a\"\n{aimed}\nradius = 1\n").repeat(2);
    corpus.refuse_edit(GROOM, HERE, &twice, "ball.toml, line|emitter[1].name|used twice|help:");
    corpus.refuse_edit(GROOM, HERE, &twice.replacen("\"a\"", "\"\"", 1), "ball.toml, line|emitter[0].name|help:");
    let rain =
        "[[layer.clump]]\ndensity = 1\nareas = [\"a\"]\n[[emitter]]\nname = \"a\"\nfile = \"rain.csv\"\nradius = 1";
    corpus.shot.edit(GROOM, HERE, rain);
    for (rows, words) in [
        ("", "rain.csv|no lines"),
        ("frame,x,y,z\n1,0,0,0\n", "rain.csv|line 1|no column 'dx'|help:"),
        ("frame,x,y,z,dx,dy,dz\n1,0,20,0,0,-1\n", "rain.csv|line 2|6 values"),
        ("frame,x,y,z,dx,dy,dz\n1,0,up,0,0,-1,0\n", "rain.csv|line 2|column y|not a number"),
        ("frame,x,y,z,dx,dy,dz\n1,0,20,0,0,-1,0\n2,0,nan,0,0,1,0\n", "rain.csv|line 3|column y|not a finite number"),
        ("frame,x,y,z,dx,dy,dz\n1,0,20,0,0,0,0\n", "rain.csv|line 2|needs a direction"),
    ] {
        corpus.refuse(&format!("particles {rows:?}"), "grooms/rain.csv", rows, words);
    }
    corpus.refuse("particles of noise", "grooms/rain.csv", super::noise(300), "rain.csv|UTF-8|help:");
    corpus.shot.edit(GROOM, rain, HERE);
    corpus.finish();
}

#[test]
fn maps_that_are_not_there() {
    let mut corpus = Corpus::of(shot());
    for (look, words) in [
        ("[[layer.clump]]\ndensity = { value = 1, map = \"no.png\" }", "clump[0].density.map"),
        ("[[layer.clump]]\ndensity = 1\narea = { map = \"no.png\" }", "clump[0].area.map"),
        ("[[layer.clump]]\nregions = { map = \"no.png\" }", "clump[0].regions.map"),
        ("[[layer.clump]]\ndensity = 1\nrate = { value = 1, map = \"no.png\" }", "clump[0].rate.map"),
        ("[layer.curl]\nkind = \"helix\"\npitch = 1\nradius = { value = 1, map = \"no.png\" }", "curl.radius.map"),
        ("[[layer.wave]]\nmap = { map = \"no.png\" }", "wave[0].map.map"),
        ("[[layer.noise]]\nsize = 1\namplitude = { value = 1, map = \"no.png\" }", "noise[0].amplitude.map"),
    ] {
        corpus.refuse_edit(GROOM, HERE, look, &format!("ball.toml, line|layer[1].{words}|no.png|help:"));
    }
    corpus.finish();
}

#[test]
fn what_shots_change() {
    let shot = shot();
    shot.edit(GROOM, HERE, "[[layer.clump]]\ndensity = 0.25\n# here");
    let mut corpus = Corpus::of(shot);
    let layer = "[[look.override]]\nlayer = \"over\"\n";
    for (look, words) in [
        ("[look]\nclumps = false".to_owned(), "did you mean `clump`?"),
        ("[look]\nclump = 0".to_owned(), "expected a boolean"),
        ("[[look.override]]\npercent = 1".to_owned(), "missing field `layer`"),
        ("[[look.override]]\nlayer = \"ovr\"\npercent = 1".to_owned(), "look.override[0].layer|no layer `ovr`|help:"),
        (format!("{layer}clump = 1\npercent = 1"), "look.override[0].clump|has no level 1|numbered from 0|help:"),
        (format!("{layer}clump = -1"), "line|expected usize"),
        (format!("{layer}percent = 1.5"), "look.override[0].percent|between 0 and 1|help:"),
        (format!("{layer}rate = nan"), "look.override[0].rate|between 0 and 1"),
        (
            format!("{layer}rate = [{{ frame = 2, value = 0 }}, {{ frame = 1, value = 0 }}]"),
            "look.override[0].rate|help:",
        ),
        (format!("{layer}rate = [{{ frame = nan, value = 0 }}]"), "look.override[0].rate|help:"),
        (format!("{layer}rate = []"), "line|expected a number"),
        (format!("{layer}percnt = 1"), "did you mean `percent`?"),
        (layer.to_owned(), "look.override[0]|changes nothing|help:"),
    ] {
        corpus.refuse_edit(SHOT, "[preview]", &format!("{look}\n[preview]"), &format!("pipeline.toml, line|{words}"));
    }
    corpus.finish();
}

/// Looks at the edge of sense: they work, and no hair is lost.
#[test]
fn looks_at_the_edge_of_sense() {
    let areas = |emitter: &str| {
        let aimed = if emitter.contains("direction") { "" } else { "direction = [0, -1, 0]\nposition = [0, 20, 0]\n" };
        let emitter = format!("[[emitter]]\nname = \"a\"\n{aimed}{emitter}");
        format!("[[layer.clump]]\ndensity = 0.25\nareas = [\"a\"]\nwet = {{ width = 2 }}\n{emitter}")
    };
    let curl =
        |radius: &str, pitch: &str| format!("[layer.curl]\nkind = \"helix\"\nradius = {radius}\npitch = {pitch}");
    let cases = [
        "[[layer.clump]]\ndensity = 0".to_owned(),
        "[[layer.clump]]\ndensity = 0\n[[layer.clump]]\ndensity = 0".to_owned(),
        "[[layer.clump]]\ndensity = 100000".to_owned(),
        "[[layer.clump]]\ndensity = { value = 1, map = \"../maps/none.png\" }".to_owned(),
        "[[layer.clump]]\ndensity = 1\narea = { map = \"../maps/none.png\" }".to_owned(),
        "[[layer.clump]]\ndensity = 1\nsize = 0".to_owned(),
        "[[layer.clump]]\ndensity = 1\nsize = 1e-9".to_owned(),
        "[[layer.clump]]\ndensity = 1\nsize = 1000000".to_owned(),
        "[[layer.clump]]\nregions = { map = \"../maps/none.png\" }".to_owned(),
        "[[layer.clump]]\nregions = { map = \"../maps/none.png\" }\nsize = 0".to_owned(),
        "[[layer.clump]]\nregions = { map = \"../maps/none.png\" }\nsize = 1e-9".to_owned(),
        "[[layer.clump]]\nregions = { map = \"../maps/half.png\" }\nsize = 1000000".to_owned(),
        "[[layer.clump]]\nroots = [[0, 5, 0], [0, -5, 0]]".to_owned(),
        "[[layer.clump]]\nroots = [[1e300, 5, 0]]".to_owned(),
        "[[layer.clump]]\ncurves = [[[0, 5, 0], [0, 5, 0]]]".to_owned(),
        "[[layer.clump]]\ncurves = [[[0, 5, 0], [0, 8, 0]]]".to_owned(),
        "[[layer.clump]]\ndensity = 0.25\nweave = 1000\ntaper = -1\nsplay = 1".to_owned(),
        "[[layer.clump]]\ndensity = 0.25\ndilation = { mean = [1000, 0, 0, 1000] }".to_owned(),
        curl("0", "1"),
        curl("3", "1"),
        curl("1000000", "1"),
        curl("0.1", "1e-9"),
        curl("0.1", "1000000"),
        curl("1000000", "1e-9"),
        curl("0.1", "1") + "\nprofile = [0, 0]",
        curl("0.1", "1") + "\ntighten = 1000\nphase = 1000000\nangle = -1000000",
        "[[layer.noise]]\namplitude = 1000000\nsize = 1e-9".to_owned(),
        "[[layer.noise]]\namplitude = 1\nsize = 1\nacross = 1e-9".to_owned(),
        "[[layer.wave]]\nx = { amplitude = [1e6, 0, 0, 1e6], frequency = [1e6, 1e6, 0, 0] }".to_owned(),
        "[layer.wind]\namplitude = 1000000\nsize = 1e-9\ndirection = [1e-300, 0, 0]".to_owned(),
        areas("radius = 0"),
        areas("radius = 1\nrate = 0"),
        areas("radius = 1\nrate = 100000"),
        areas("radius = 1\ndirection = [0, 1, 0]\nposition = [0, 20, 0]"),
        areas("radius = 1\nframes = [-100, 0]"),
        areas("radius = 1000000\npercent = 0"),
        areas("radius = [{ frame = -5, value = 1 }]"),
        areas("radius = 1\ndirection = [0, 1e-300, 0]\nposition = [1e300, 0, 0]"),
    ];
    let shot = shot();
    shot.edit(GROOM, "value = 4.0", "value = 0.5");
    shot.write("maps/none.png", grey_png(8, 8, |_, _| 0));
    let base = String::from_utf8(shot.read(GROOM)).expect("text");
    let mut wrong = Vec::new();
    for look in &cases {
        shot.write(GROOM, base.replace(HERE, look));
        let said = run_bounded(shot.path(), &["run", "--to", "export"]);
        if said.code != Some(0) || said.err.contains("panicked") || said.err.contains("NaN") {
            wrong.push(format!("--- {look}\n{said:?}"));
            continue;
        }
        let layers = pelage::curves::read(&shot.path().join("out/ball/hair.mcap"), Some(2.0)).expect("a file").layers;
        let finite = layers.iter().all(|l| l.strands.position.iter().flatten().all(|x| x.is_finite()));
        if !finite || layers[1].strands.len() != 312 {
            wrong.push(format!("--- {look}\n{} hairs, finite: {finite}", layers[1].strands.len()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn looks_of_little_hair() {
    let all = "[[layer.clump]]\ndensity = 0.25\n[[layer.clump]]\ndensity = 0.06\n[[layer.wave]]\nstray = 1\n\
               [layer.curl]\nkind = \"helix\"\nradius = 0.1\npitch = 1\nper_clump = true\n\
               [[layer.noise]]\namplitude = 0.1\nsize = 1\n[layer.wind]\namplitude = 1\nsize = 1\ndirection = [1, 0, 0]";
    for hair in ["points = 2", "guard = { percent = 0.5 }\npoints = 3"] {
        let shot = shot();
        shot.edit(GROOM, HERE, &format!("{hair}\n{all}"));
        works(&shot);
    }
    let none = shot();
    none.edit(GROOM, "density = { value = 1.0 }", "density = { value = 0.0 }");
    none.edit(GROOM, HERE, all);
    works(&none);
    for by_hand in
        ["roots = [[0, 5, 0]]", "curves = [[[0, 5, 0], [0, 7, 0]]]", "regions = { map = \"../maps/half.png\" }"]
    {
        let none = shot();
        none.edit(GROOM, "density = { value = 1.0 }", "density = { value = 0.0 }");
        none.edit(GROOM, HERE, &format!("[[layer.clump]]\n{by_hand}"));
        works(&none);
    }
    let short = shot();
    short.edit(GROOM, "length = { value = 2.5,", "length = { value = 0.0,");
    short.edit(GROOM, HERE, all);
    works(&short);
}

#[test]
fn two_roots_by_hand_at_one_hair() {
    let mut corpus = Corpus::of(shot());
    for by_hand in ["roots = [[0, 5, 0], [0, 5, 0.001]]", "curves = [[[0, 5, 0], [0, 7, 0]], [[0, 5, 0], [1, 7, 0]]]"] {
        let look = format!("[[layer.clump]]\n{by_hand}");
        let words = "ball.toml, line|layer[1].clump[0]|number 1|the same nearest hair|farther apart|help:";
        corpus.refuse_edit(GROOM, HERE, &look, words);
    }
    // A draft has fewer hairs: what is apart in the shot stays apart or is left out of the picture.
    corpus.shot.edit(GROOM, HERE, "[[layer.clump]]\nroots = [[0, 5, 0], [0.8, 4.9, 0.8], [-0.8, 4.9, 0.8]]");
    let said = run_bounded(corpus.shot.path(), &["preview", "--hairs", "2"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
}
