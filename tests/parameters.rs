//! A small picture of every parameter of the look: what it is at a low value, as it usually is, and high.

mod features;
pub mod light;

/// Name of the picture of a key.
pub fn picture_file(key: &str) -> String {
    format!("{}.png", key.replace('.', "-"))
}

/// One parameter in three pictures.
pub struct Shown {
    /// Table and key: `clump.percent`.
    pub key: &'static str,
    /// Hair that shows it.
    pub hair: Hair,
    /// What else its table says, so that it has something to act on.
    pub with: &'static str,
    /// Three settings of it: low, usual, high. Empty for none at all.
    pub settings: [&'static str; 3],
}

/// Hair that shows a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hair {
    /// Short and dense, with a lean.
    Fur,
    /// Short and dense, upright.
    Field,
    /// Single long strands that hang.
    Long,
    /// Many long strands that hang.
    Curtain,
    /// Fur on frames, under rain.
    Rain,
    /// A ball of hair combed into the skin.
    Ball,
}

const fn shown(key: &'static str, hair: Hair, with: &'static str, settings: [&'static str; 3]) -> Shown {
    Shown { key, hair, with, settings }
}

use Hair::{Ball, Curtain, Field, Fur, Long, Rain};

const DENSE: &str = "density = 1.2\nrate = 0.4";
const HELIX: &str = "kind = \"helix\"\nradius = 0.2\npitch = 1.2";
const CUSTOM: &str = "kind = \"custom\"\nphase = 0.0\ny = { a = 0.0 }";
const EVEN: &str = "y.frequency = [3.0, 3.0, 3.0, 3.0]\nsize = 1.0";

/// Every parameter that is shown.
pub fn parameters() -> impl Iterator<Item = &'static Shown> {
    OPERATORS.iter().chain(features::FEATURES)
}

/// Parameters of the operators and of the numbers that they read.
const OPERATORS: &[Shown] = &[
    // Any number of the look.
    shown(
        "value.value",
        Field,
        DENSE,
        [
            "percent = { value = 0.2 }",
            "percent = { value = 0.7 }",
            "percent = [{ frame = 1, value = 1.0 }, { frame = 9, value = 0.0 }]",
        ],
    ),
    shown(
        "value.map",
        Field,
        DENSE,
        [
            "percent = { value = 1.0 }",
            "percent = { value = 1.0, map = \"maps/ramp.png\" }",
            "percent = { value = 1.0, map = \"maps/spot.png\" }",
        ],
    ),
    shown(
        "value.noise",
        Field,
        DENSE,
        [
            "percent = { value = 1.0 }",
            "percent = { value = 1.0, noise = 0.4 }",
            "percent = { value = 1.0, noise = 1.0 }",
        ],
    ),
    shown(
        "value.vary",
        Field,
        DENSE,
        [
            "percent = { value = 0.6 }",
            "percent = { value = 0.6, vary = [{ size = 2.0, deviation = 0.8 }] }",
            "percent = { value = 0.6, vary = [{ size = 2.0, deviation = 0.8 }, { size = 0.3, deviation = 0.5 }] }",
        ],
    ),
    shown(
        "vary.size",
        Field,
        DENSE,
        [
            "percent = { value = 0.6, vary = [{ size = 0.2, deviation = 0.8 }] }",
            "percent = { value = 0.6, vary = [{ size = 1.0, deviation = 0.8 }] }",
            "percent = { value = 0.6, vary = [{ size = 4.0, deviation = 0.8 }] }",
        ],
    ),
    shown(
        "vary.deviation",
        Field,
        DENSE,
        [
            "percent = { value = 0.6, vary = [{ size = 1.0, deviation = 0.1 }] }",
            "percent = { value = 0.6, vary = [{ size = 1.0, deviation = 0.5 }] }",
            "percent = { value = 0.6, vary = [{ size = 1.0, deviation = 2.0 }] }",
        ],
    ),
    // Clumps.
    shown("clump.density", Fur, "percent = 0.9", ["density = 0.5", "density = 2.5", "density = 10.0"]),
    shown("clump.size", Fur, "density = 0.7\npercent = 0.95", ["size = 0.25", "size = 0.45", ""]),
    shown("clump.percent", Fur, "density = 1.2", ["percent = 0.2", "percent = 0.7", "percent = 1.0"]),
    shown("clump.rate", Fur, "density = 1.2\npercent = 1.0", ["rate = 0.0", "rate = 0.4", "rate = 1.0"]),
    shown(
        "clump.area",
        Field,
        "density = 1.2\nrate = 0.6\npercent = 1.0",
        ["", "area = { map = \"maps/half.png\" }", "area = { map = \"maps/spot.png\" }"],
    ),
    shown(
        "clump.regions",
        Fur,
        "percent = 1.0\nrate = 0.2",
        [
            "regions = { map = \"maps/half.png\" }",
            "regions = { map = \"maps/cells.png\" }",
            "regions = { map = \"maps/small_cells.png\" }",
        ],
    ),
    shown(
        "clump.roots",
        Field,
        "percent = 1.0\nrate = 0.5\nsize = 0.6",
        [
            "roots = [[0.0, 0.0, 0.9]]",
            "roots = [[-1.0, 0.0, 0.9], [1.0, 0.0, 0.9]]",
            "roots = [[-1.6, 0.0, 0.9], [-0.8, 0.0, 0.9], [0.0, 0.0, 0.9], [0.8, 0.0, 0.9], [1.6, 0.0, 0.9]]",
        ],
    ),
    shown(
        "clump.curves",
        Field,
        "percent = 1.0\nsize = 0.9",
        [
            "curves = [[[0.0, 0.0, 0.5], [0.0, 1.7, 0.5]]]",
            "curves = [[[0.0, 0.0, 0.5], [0.0, 1.0, 0.5], [1.2, 1.5, 0.5]]]",
            "curves = [[[-1.0, 0.0, 0.5], [-0.9, 1.0, 0.5], [-0.1, 1.6, 0.5]], [[1.0, 0.0, 0.5], [0.9, 1.0, 0.5], [0.1, 1.6, 0.5]]]",
        ],
    ),
    shown(
        "clump.of",
        Field,
        "density = 3.0\npercent = 1.0\nrate = 0.8",
        [
            "",
            "\n[[layer.clump]]\ndensity = 0.5\npercent = 0.8\nof = \"clumps\"",
            "\n[[layer.clump]]\ndensity = 0.5\npercent = 0.8\nof = \"hairs\"",
        ],
    ),
    shown("clump.falloff", Field, "density = 0.7\npercent = 1.0", ["falloff = 0.0", "falloff = 0.5", "falloff = 1.0"]),
    shown(
        "clump.splay",
        Field,
        "density = 0.7\npercent = 1.0\nrate = 0.5",
        ["splay = 0.0", "splay = 0.5", "splay = 1.0"],
    ),
    shown("clump.weave", Field, "density = 0.7\npercent = 0.8", ["weave = 0.0", "weave = 0.5", "weave = 2.0"]),
    shown("clump.hold", Field, "density = 0.7\npercent = 1.0", ["hold = 0.1", "hold = 0.3", ""]),
    shown("clump.taper", Field, "density = 0.7\npercent = 1.0", ["taper = -0.7", "taper = 0.0", "taper = 0.7"]),
    shown(
        "clump.dilation",
        Field,
        "density = 0.7\npercent = 1.0",
        [
            "dilation = { mean = [1.0, 0.7, 0.4, 0.0] }",
            "dilation = { mean = [0.3, 0.2, 0.5, 1.2] }",
            "dilation = { mean = [1.6, 1.4, 0.6, 0.1] }",
        ],
    ),
    shown(
        "dilation.mean",
        Field,
        "",
        ["mean = [0.2, 0.2, 0.2, 0.2]", "mean = [0.7, 0.5, 0.3, 0.1]", "mean = [1.6, 1.4, 0.6, 0.1]"],
    ),
    shown(
        "dilation.deviation",
        Field,
        "mean = [0.8, 0.6, 0.5, 0.4]",
        ["", "deviation = [0.0, 0.2, 0.3, 0.4]", "deviation = [0.0, 0.4, 0.8, 1.5]"],
    ),
    shown(
        "dilation.scale",
        Field,
        "mean = [0.8, 0.6, 0.5, 0.4]\ndeviation = [0.0, 0.4, 0.8, 1.5]",
        ["scale = 0.0", "scale = 2.0", "scale = 100.0"],
    ),
    shown("clump.keep_length", Fur, "density = 0.5\npercent = 1.0", ["keep_length = false", "", "keep_length = true"]),
    shown(
        "clump.areas",
        Rain,
        "density = 3.0\npercent = 1.0\nrate = 0.3",
        ["areas = []", "areas = [\"drizzle\"]", "areas = [\"drizzle\", \"spout\"]"],
    ),
    shown(
        "clump.wet",
        Rain,
        "density = 3.0\nareas = [\"drizzle\"]",
        ["", "wet = { width = 0.6, opacity = 0.7 }", "wet = { width = 3.0 }"],
    ),
    shown("wet.width", Fur, "", ["width = 0.4", "", "width = 3.0"]),
    shown("wet.opacity", Fur, "", ["opacity = 0.1", "opacity = 0.5", ""]),
    // Curls.
    shown(
        "curl.kind",
        Long,
        "radius = 0.22\npitch = 1.2\nphase = 0.0",
        ["kind = \"uniplanar\"\nangle = 0.25", "kind = \"dished\"\nangle = 0.25", "kind = \"helix\""],
    ),
    shown("curl.radius", Long, "kind = \"helix\"\npitch = 1.2", ["radius = 0.06", "radius = 0.2", "radius = 0.4"]),
    shown("curl.pitch", Long, "kind = \"helix\"\nradius = 0.2", ["pitch = 0.5", "pitch = 1.2", "pitch = 3.0"]),
    shown(
        "curl.phase",
        Curtain,
        "kind = \"uniplanar\"\nradius = 0.2\npitch = 1.5\nangle = 0.25",
        ["phase = 0.0", "phase = { value = 0.0, vary = [{ size = 2.0, deviation = 0.3 }] }", ""],
    ),
    shown(
        "curl.angle",
        Long,
        "kind = \"uniplanar\"\nradius = 0.25\npitch = 1.2\nphase = 0.0",
        ["angle = 0.0", "angle = 0.1", "angle = 0.25"],
    ),
    shown(
        "curl.tighten",
        Long,
        "kind = \"helix\"\nradius = 0.2\npitch = 1.5",
        ["tighten = 0.0", "tighten = 1.0", "tighten = 4.0"],
    ),
    shown(
        "curl.depth",
        Long,
        "kind = \"dished\"\nradius = 0.25\npitch = 1.2\nphase = 0.0\nangle = 0.0",
        ["depth = 0.0", "depth = 0.5", "depth = 1.5"],
    ),
    shown("curl.start", Long, HELIX, ["start = 0.0", "start = 0.5", "start = 3.0"]),
    shown("curl.profile", Long, HELIX, ["profile = [2.0, 0.0]", "", "profile = [0.0, 0.2, 2.0]"]),
    shown(
        "curl.keep_length",
        Long,
        "kind = \"helix\"\nradius = 0.25\npitch = 0.9",
        ["keep_length = true", "", "keep_length = false"],
    ),
    shown(
        "curl.per_clump",
        Curtain,
        "kind = \"uniplanar\"\nradius = 0.25\npitch = 1.5\nangle = 0.25",
        [
            "per_clump = false\n[[layer.clump]]\ndensity = 3.0\npercent = 0.8\nrate = 0.4",
            "per_clump = false\n[[layer.clump]]\ndensity = 3.0\npercent = 0.8\nrate = 0.4",
            "per_clump = true\n[[layer.clump]]\ndensity = 3.0\npercent = 0.8\nrate = 0.4",
        ],
    ),
    shown(
        "curl.x",
        Long,
        CUSTOM,
        [
            "angle = 0.25\nx = { a = 0.1, p0 = 0.8 }",
            "angle = 0.25\nx = { a = 0.25, p0 = 0.8 }",
            "angle = 0.25\nx = { c = 0.5, beta = 0.5, p0 = 1.6 }",
        ],
    ),
    shown(
        "curl.y",
        Long,
        "kind = \"custom\"\nphase = 0.0\nx = { a = 0.2, p0 = 0.8, phase = 0.25 }",
        ["y = { a = 0.0 }", "y = { a = 0.2, p0 = 0.8 }", "y = { a = 0.2, p0 = 0.8, bias = 0.5 }"],
    ),
    shown("custom.a", Long, "p0 = 0.8", ["a = 0.05", "a = 0.2", "a = 0.4"]),
    shown("custom.b", Long, "p0 = 1.0\nalpha = 0.6", ["b = 0.1", "b = 0.3", "b = 0.6"]),
    shown("custom.alpha", Long, "p0 = 1.0\nb = 0.5", ["alpha = 0.3", "alpha = 0.8", "alpha = 2.0"]),
    shown("custom.c", Long, "p0 = 1.0\nbeta = 0.5", ["c = 0.1", "c = 0.25", "c = 0.5"]),
    shown("custom.beta", Long, "p0 = 1.0\nc = 0.35", ["beta = 0.05", "beta = 0.4", "beta = 4.0"]),
    shown("custom.d", Long, "p0 = 1.0\na = 0.04\ngamma = 1.5\nt0 = 2.8", ["d = 0.05", "d = 0.2", "d = 0.5"]),
    shown(
        "custom.gamma",
        Long,
        "p0 = 1.0\na = 0.04\nd = 0.15\nt0 = 2.2",
        ["gamma = 0.3", "gamma = 1.0", "gamma = 2.0"],
    ),
    shown("custom.t0", Long, "p0 = 1.0\na = 0.04\nd = 0.2\ngamma = 1.0", ["t0 = 1.5", "t0 = 2.5", "t0 = 4.0"]),
    shown("custom.r", Long, "p0 = 0.4\na = 0.15", ["r = 0.0", "r = 0.1", "r = 0.3"]),
    shown("custom.p0", Long, "a = 0.15", ["p0 = 0.3", "p0 = 0.8", "p0 = 2.0"]),
    shown("custom.phase", Long, "p0 = 0.4\na = 0.3", ["phase = 0.0", "phase = 0.25", "phase = 0.5"]),
    shown("custom.bias", Long, "p0 = 0.8\na = 0.1", ["bias = -0.5", "bias = 0.0", "bias = 0.5"]),
    // Waves.
    shown(
        "wave.shape",
        Long,
        "y = { amplitude = [0.15, 0.2, 0.2, 0.2], frequency = [4.0, 4.0, 4.0, 4.0] }\nsize = 0.5",
        ["", "shape = \"sine\"", "shape = \"noise\""],
    ),
    shown(
        "wave.x",
        Long,
        "",
        [
            "x = { amplitude = [0.05, 0.1, 0.15, 0.2], frequency = [3.0, 3.0, 3.0, 3.0] }",
            "x = { amplitude = [0.2, 0.3, 0.3, 0.3], frequency = [3.0, 3.0, 3.0, 3.0] }",
            "x = { amplitude = [0.3, 0.6, 0.6, 0.6], frequency = [3.0, 3.0, 3.0, 3.0] }",
        ],
    ),
    shown(
        "wave.y",
        Long,
        "",
        [
            "y = { amplitude = [0.05, 0.1, 0.15, 0.2], frequency = [3.0, 3.0, 3.0, 3.0] }",
            "y = { amplitude = [0.2, 0.2, 0.2, 0.2], frequency = [3.0, 3.0, 3.0, 3.0] }",
            "y = { amplitude = [0.2, 0.4, 0.4, 0.4], frequency = [2.0, 2.0, 3.0, 5.0] }",
        ],
    ),
    shown(
        "wave.strength",
        Long,
        "y = { amplitude = [0.1, 0.2, 0.2, 0.2], frequency = [3.0, 3.0, 3.0, 3.0] }",
        ["strength = 0.3", "", "strength = 2.5"],
    ),
    shown(
        "wave.map",
        Curtain,
        "y = { amplitude_deviation = [0.2, 0.3, 0.3, 0.3], amplitude_scale = [2.0, 2.0, 2.0, 2.0], frequency = [3.0, 3.0, 3.0, 3.0] }",
        ["", "map = { map = \"maps/ramp.png\" }", "map = { map = \"maps/cells.png\" }"],
    ),
    shown(
        "wave.size",
        Curtain,
        "y = { amplitude = [0.1, 0.2, 0.2, 0.2], frequency = [3.0, 3.0, 3.0, 3.0], phase_deviation = 1.0, phase_scale = 3.0 }",
        ["", "size = 5.0", "size = 0.3"],
    ),
    shown(
        "wave.stray",
        Curtain,
        "y = { amplitude_deviation = [0.3, 0.6, 0.8, 1.0], amplitude_scale = [9.0, 9.0, 9.0, 9.0], frequency = [1.0, 1.0, 1.0, 1.0] }",
        ["stray = 0.0", "stray = 0.1", "stray = 0.5"],
    ),
    shown(
        "wave.keep_length",
        Long,
        "y = { amplitude = [0.3, 0.3, 0.3, 0.3], frequency = [5.0, 5.0, 5.0, 5.0] }",
        ["keep_length = true", "", "keep_length = false"],
    ),
    shown(
        "axis.amplitude",
        Long,
        EVEN,
        [
            "y.amplitude = [0.1, 0.1, 0.1, 0.1]",
            "y.amplitude = [0.0, 0.1, 0.2, 0.4]",
            "y.amplitude = [0.4, 0.3, 0.1, 0.0]",
        ],
    ),
    shown(
        "axis.amplitude_deviation",
        Curtain,
        "y.frequency = [3.0, 3.0, 3.0, 3.0]\nsize = 0.5\ny.amplitude = [0.1, 0.1, 0.1, 0.1]\ny.amplitude_scale = [5.0, 5.0, 5.0, 5.0]",
        [
            "y.amplitude_deviation = [0.0, 0.0, 0.0, 0.0]",
            "y.amplitude_deviation = [0.1, 0.2, 0.2, 0.2]",
            "y.amplitude_deviation = [0.2, 0.4, 0.6, 0.8]",
        ],
    ),
    shown(
        "axis.amplitude_scale",
        Curtain,
        "y.frequency = [3.0, 3.0, 3.0, 3.0]\nsize = 4.0\ny.amplitude_deviation = [0.3, 0.4, 0.4, 0.4]",
        [
            "y.amplitude_scale = [0.3, 0.3, 0.3, 0.3]",
            "y.amplitude_scale = [3.0, 3.0, 3.0, 3.0]",
            "y.amplitude_scale = [50.0, 50.0, 50.0, 50.0]",
        ],
    ),
    shown(
        "axis.frequency",
        Long,
        "y.amplitude = [0.15, 0.2, 0.2, 0.2]",
        [
            "y.frequency = [1.0, 1.0, 1.0, 1.0]",
            "y.frequency = [3.0, 3.0, 3.0, 3.0]",
            "y.frequency = [1.0, 2.0, 5.0, 9.0]",
        ],
    ),
    shown(
        "axis.frequency_deviation",
        Curtain,
        "size = 0.5\ny.amplitude = [0.1, 0.2, 0.2, 0.2]\ny.frequency = [3.0, 3.0, 3.0, 3.0]\ny.frequency_scale = [5.0, 5.0, 5.0, 5.0]",
        [
            "y.frequency_deviation = [0.0, 0.0, 0.0, 0.0]",
            "y.frequency_deviation = [0.3, 0.3, 0.3, 0.3]",
            "y.frequency_deviation = [2.0, 2.0, 2.0, 2.0]",
        ],
    ),
    shown(
        "axis.frequency_scale",
        Curtain,
        "size = 4.0\ny.amplitude = [0.1, 0.2, 0.2, 0.2]\ny.frequency = [3.0, 3.0, 3.0, 3.0]\ny.frequency_deviation = [1.0, 1.0, 1.0, 1.0]",
        [
            "y.frequency_scale = [0.3, 0.3, 0.3, 0.3]",
            "y.frequency_scale = [3.0, 3.0, 3.0, 3.0]",
            "y.frequency_scale = [50.0, 50.0, 50.0, 50.0]",
        ],
    ),
    shown(
        "axis.phase",
        Long,
        "y.amplitude = [0.2, 0.3, 0.3, 0.3]\ny.frequency = [2.0, 2.0, 2.0, 2.0]",
        ["y.phase = 0.0", "y.phase = 0.25", "y.phase = 0.5"],
    ),
    shown(
        "axis.phase_deviation",
        Curtain,
        "size = 0.5\ny.amplitude = [0.1, 0.2, 0.2, 0.2]\ny.frequency = [2.0, 2.0, 2.0, 2.0]\ny.phase_scale = 5.0",
        ["y.phase_deviation = 0.0", "y.phase_deviation = 0.2", "y.phase_deviation = 1.0"],
    ),
    shown(
        "axis.phase_scale",
        Curtain,
        "size = 4.0\ny.amplitude = [0.1, 0.2, 0.2, 0.2]\ny.frequency = [2.0, 2.0, 2.0, 2.0]\ny.phase_deviation = 0.5",
        ["y.phase_scale = 0.3", "y.phase_scale = 3.0", "y.phase_scale = 50.0"],
    ),
    // Noise.
    shown("noise.amplitude", Long, "size = 0.8", ["amplitude = 0.02", "amplitude = 0.08", "amplitude = 0.25"]),
    shown("noise.size", Long, "amplitude = 0.12", ["size = 0.3", "size = 1.0", "size = 4.0"]),
    shown("noise.across", Curtain, "amplitude = 0.2\nsize = 1.5", ["", "across = 1.0", "across = 5.0"]),
    shown(
        "noise.profile",
        Long,
        "amplitude = 0.15\nsize = 0.7",
        ["profile = [1.0, 0.0]", "", "profile = [0.0, 0.2, 2.5]"],
    ),
    shown("noise.keep_length", Long, "amplitude = 0.25\nsize = 0.5", ["keep_length = true", "", "keep_length = false"]),
    // Wind.
    shown(
        "wind.amplitude",
        Long,
        "direction = [1.0, 0.0, 0.0]\nsize = 3.0",
        ["amplitude = 0.0", "amplitude = 1.0", "amplitude = 3.0"],
    ),
    shown(
        "wind.direction",
        Long,
        "amplitude = 1.5\nsize = 3.0",
        ["direction = [-1.0, 0.0, 0.0]", "direction = [1.0, 0.0, 0.0]", "direction = [1.0, 1.0, 0.0]"],
    ),
    shown(
        "wind.size",
        Field,
        "amplitude = 0.8\ndirection = [1.0, 0.0, 0.0]\ngust = 0.6",
        ["size = 0.3", "size = 2.0", "size = 20.0"],
    ),
    shown(
        "wind.gust",
        Field,
        "amplitude = 0.8\ndirection = [1.0, 0.0, 0.0]\nsize = 1.5",
        ["gust = 0.0", "", "gust = 1.0"],
    ),
    // Collision.
    shown("collision.enabled", Ball, "", ["enabled = false", "", "enabled = true"]),
    // Emitters.
    shown(
        "emitter.position",
        Rain,
        "",
        [
            "position = [-1.2, 4.0, 0.0]",
            "position = [0.6, 4.0, 0.0]",
            "position = [{ frame = 1, value = [-2.0, 4.0, 0.6] }, { frame = 12, value = [2.0, 4.0, 0.6] }]\nspread = 1.0",
        ],
    ),
    shown(
        "emitter.direction",
        Rain,
        "position = [0.0, 4.0, 0.0]\nspread = 5.0",
        ["direction = [-0.4, -1.0, 0.0]", "direction = [0.0, -1.0, 0.0]", "direction = [0.4, -1.0, 0.0]"],
    ),
    shown("emitter.spread", Rain, "", ["spread = 2.0", "spread = 8.0", "spread = 20.0"]),
    shown("emitter.rate", Rain, "", ["rate = 6.0", "", "rate = 200.0"]),
    shown("emitter.frames", Rain, "", ["frames = [1, 2]", "frames = [1, 6]", ""]),
    shown("emitter.seed", Rain, "rate = 8.0", ["", "seed = 1", "seed = 2"]),
    shown(
        "emitter.radius",
        Rain,
        "rate = 8.0",
        ["radius = 0.3", "radius = 0.6", "radius = [{ frame = 0, value = 0.1 }, { frame = 11, value = 1.6 }]"],
    ),
    shown(
        "emitter.percent",
        Rain,
        "",
        ["percent = 0.3", "", "percent = [{ frame = 0, value = 0.0 }, { frame = 11, value = 1.0 }]"],
    ),
    shown("emitter.clump_rate", Rain, "", ["clump_rate = 0.0", "clump_rate = 0.4", "clump_rate = 1.0"]),
];

/// Keys without a picture of their own, and why.
pub const WITHOUT: &[(&str, &str)] = &[
    ("layer.name", "a name"),
    ("layer.material", "shows in motion only"),
    ("layer.simulate", "shows in motion only"),
    ("layer.hairs", "which hairs it has"),
    ("layer.root_frames", "shows where the skin is bent much"),
    ("layer.clump", "a table of its own"),
    ("layer.curl", "a table of its own"),
    ("layer.wave", "a table of its own"),
    ("layer.noise", "a table of its own"),
    ("layer.wind", "a table of its own"),
    ("layer.collision", "a table of its own"),
    ("feature.channel", "which numbers of the map are read"),
    ("feature.wrap", "what is read outside the map"),
    ("width.map", "as of every feature"),
    ("width.channel", "which numbers of the map are read"),
    ("width.wrap", "what is read outside the map"),
    ("color.wrap", "what is read outside the map"),
    ("value.channel", "which numbers of the map are read"),
    ("value.wrap", "what is read outside the map"),
    ("clump.simulate", "shows in motion only"),
    ("curl.simulate", "shows in motion only"),
    ("wave.simulate", "shows in motion only"),
    ("noise.simulate", "shows in motion only"),
    ("wind.frequency", "shows in motion only"),
    ("wind.with_simulated", "shows in motion only"),
    ("collision.clearance", "less than a hair's width, and grows from the root over 100 times itself"),
    ("collision.held", "shows in the counts of a run only"),
    ("emitter.name", "a name"),
    ("emitter.file", "particles of another program"),
    ("comb.parting", "goes with `side`"),
    ("comb.value", "finished hairs have the length of their layer"),
    ("comb.primitive", "shown in the styles of the gallery"),
    ("comb.divider", "hides fields from hair on its other side"),
    ("comb.element", "shown in the styles of the gallery"),
    ("comb.panels", "shown in the styles of the gallery"),
    ("comb.reverse", "turns a flow round"),
    ("comb.shear", "shown in the styles of the gallery"),
    ("comb.scalp", "what a cut goes by"),
    ("comb.hairs", "which hairs it acts on"),
    ("comb.hair", "which hair it moves"),
    ("comb.file", "as a cut"),
    ("comb.key", "as a cut"),
    ("comb.level", "shown in the styles of the gallery"),
    ("clump.clusters", "shown in the styles of the gallery"),
];
