//! A small picture of every parameter of the look: what it is at a low value, as it usually is, and high.

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
    /// Short and dense.
    Fur,
    /// Long, with many points.
    Long,
    /// Short, on frames, under rain.
    Rain,
}

const fn shown(key: &'static str, hair: Hair, with: &'static str, settings: [&'static str; 3]) -> Shown {
    Shown { key, hair, with, settings }
}

use Hair::{Fur, Long, Rain};

const CLUMP: &str = "density = 2.5\npercent = 0.9";
const DENSE: &str = "density = 2.5";
const WAVE: &str = "x.amplitude = [0.1, 0.2, 0.2, 0.2]\nx.frequency = [3.0, 3.0, 3.0, 3.0]\nsize = 2.0";

/// Every parameter of the look.
pub const PARAMETERS: &[Shown] = &[
    shown("clump.density", Fur, "percent = 0.9", ["density = 0.5", "density = 2.5", "density = 10.0"]),
    shown("clump.size", Fur, CLUMP, ["size = 0.15", "size = 0.3", ""]),
    shown("clump.percent", Fur, DENSE, ["percent = 0.2", "percent = 0.7", "percent = 1.0"]),
    shown("clump.rate", Fur, CLUMP, ["rate = 0.0", "rate = 0.4", "rate = 1.0"]),
    shown("clump.area", Fur, CLUMP, ["", "area = { map = \"../maps/half.png\" }", "area = { map = \"../maps/ramp.png\" }"]),
    shown("clump.regions", Fur, "percent = 0.9", [
        "regions = { map = \"../maps/flat.png\" }",
        "regions = { map = \"../maps/cells.png\" }",
        "regions = { map = \"../maps/small_cells.png\" }",
    ]),
    shown("clump.roots", Fur, "percent = 1.0\nsize = 0.7", [
        "roots = [[0.0, 0.0, 0.0]]",
        "roots = [[-1.0, 0.0, 0.3], [1.0, 0.0, 0.3]]",
        "roots = [[-1.4, 0.0, 0.0], [-0.7, 0.0, 0.6], [0.0, 0.0, 0.0], [0.7, 0.0, 0.6], [1.4, 0.0, 0.0]]",
    ]),
    shown("clump.curves", Fur, "percent = 1.0\nsize = 0.8", [
        "curves = [[[0.0, 0.0, 0.5], [0.0, 2.0, 0.5]]]",
        "curves = [[[0.0, 0.0, 0.5], [0.0, 1.0, 0.5], [1.0, 1.5, 0.5]]]",
        "curves = [[[-0.9, 0.0, 0.5], [-0.9, 1.0, 0.5], [0.0, 1.6, 0.5]], [[0.9, 0.0, 0.5], [0.9, 1.0, 0.5], [0.0, 1.6, 0.5]]]",
    ]),
    shown("clump.of", Fur, CLUMP, [
        "",
        "\n[[layer.clump]]\ndensity = 0.6\npercent = 0.6\nof = \"clumps\"",
        "\n[[layer.clump]]\ndensity = 0.6\npercent = 0.6\nof = \"hairs\"",
    ]),
    shown("clump.falloff", Fur, CLUMP, ["falloff = 0.0", "falloff = 0.5", "falloff = 1.0"]),
    shown("clump.splay", Fur, CLUMP, ["splay = 0.0", "splay = 0.5", "splay = 1.0"]),
    shown("clump.weave", Fur, "density = 1.0\npercent = 0.7", ["weave = 0.0", "weave = 0.5", "weave = 1.5"]),
    shown("clump.taper", Fur, CLUMP, ["taper = -0.7", "taper = 0.0", "taper = 0.7"]),
    shown("clump.dilation", Fur, "density = 1.0\npercent = 1.0", [
        "dilation = { mean = [1.0, 0.7, 0.4, 0.1] }",
        "dilation = { mean = [0.4, 0.4, 0.7, 1.2] }",
        "dilation = { mean = [0.8, 0.6, 0.5, 0.4], deviation = [0.0, 0.3, 0.5, 0.8] }",
    ]),
    shown("clump.keep_length", Fur, "density = 0.6\npercent = 1.0", ["keep_length = false", "keep_length = false", "keep_length = true"]),
    shown("clump.areas", Rain, DENSE, ["areas = []", "areas = [\"drizzle\"]", "areas = [\"drizzle\", \"spout\"]"]),
    shown("clump.wet", Fur, CLUMP, ["", "wet = { width = 1.5 }", "wet = { width = 0.4, opacity = 0.6 }"]),
    shown("curl.kind", Long, "radius = 0.25\npitch = 1.2", ["kind = \"uniplanar\"", "kind = \"dished\"", "kind = \"helix\""]),
    shown("curl.radius", Long, "kind = \"helix\"\npitch = 1.2", ["radius = 0.08", "radius = 0.2", "radius = 0.4"]),
    shown("curl.pitch", Long, "kind = \"helix\"\nradius = 0.2", ["pitch = 0.6", "pitch = 1.2", "pitch = 3.0"]),
    shown("curl.phase", Long, "kind = \"helix\"\nradius = 0.2\npitch = 1.5", [
        "phase = 0.0",
        "phase = { value = 0.0, vary = [{ size = 1.5, deviation = 0.3 }] }",
        "",
    ]),
    shown("curl.angle", Long, "kind = \"uniplanar\"\nradius = 0.25\npitch = 1.2\nphase = 0.0", ["angle = 0.0", "angle = 0.125", "angle = 0.25"]),
    shown("curl.tighten", Long, "kind = \"helix\"\nradius = 0.2\npitch = 1.5", ["tighten = 0.0", "tighten = 1.0", "tighten = 3.0"]),
    shown("curl.depth", Long, "kind = \"dished\"\nradius = 0.25\npitch = 1.2\nphase = 0.0\nangle = 0.25", ["depth = 0.0", "depth = 0.5", "depth = 1.5"]),
    shown("curl.start", Long, "kind = \"helix\"\nradius = 0.25\npitch = 1.2", ["start = 0.0", "start = 0.5", "start = 3.0"]),
    shown("curl.profile", Long, "kind = \"helix\"\nradius = 0.25\npitch = 1.2", ["profile = [1.0, 0.0]", "", "profile = [0.0, 0.3, 2.0]"]),
    shown("curl.keep_length", Long, "kind = \"helix\"\nradius = 0.3\npitch = 1.0", ["keep_length = true", "keep_length = true", "keep_length = false"]),
    shown("curl.per_clump", Long, "kind = \"helix\"\nradius = 0.2\npitch = 1.5", [
        "per_clump = false\n[[layer.clump]]\ndensity = 1.5",
        "per_clump = false\n[[layer.clump]]\ndensity = 1.5",
        "per_clump = true\n[[layer.clump]]\ndensity = 1.5",
    ]),
    shown("curl.x", Long, "kind = \"custom\"\ny = { a = 0.0 }", [
        "x = { a = 0.2, p0 = 0.8 }",
        "x = { c = 0.4, beta = 0.4, p0 = 0.8 }",
        "x = { a = 0.05, d = 0.1, gamma = 1.0, t0 = 4.0, p0 = 0.8, r = 0.05 }",
    ]),
    shown("curl.y", Long, "kind = \"custom\"\nx = { a = 0.2, p0 = 0.8 }", [
        "y = { a = 0.0 }",
        "y = { a = 0.2, p0 = 0.8, phase = 0.25 }",
        "y = { a = 0.2, p0 = 1.6, bias = 0.2 }",
    ]),
    shown("wave.shape", Long, WAVE, ["", "shape = \"sine\"", "shape = \"noise\""]),
    shown("wave.x", Long, "size = 2.0", [
        "x = { amplitude = [0.05, 0.1, 0.15, 0.2], frequency = [2.0, 2.0, 2.0, 2.0] }",
        "x = { amplitude = [0.1, 0.2, 0.3, 0.3], frequency = [2.0, 2.0, 3.0, 4.0] }",
        "x = { amplitude = [0.2, 0.2, 0.2, 0.2], frequency = [3.0, 3.0, 3.0, 3.0], phase_deviation = 1.0, phase_scale = 6.0 }",
    ]),
    shown("wave.y", Long, WAVE, ["", "y.amplitude = [0.1, 0.2, 0.2, 0.2]\ny.frequency = [3.0, 3.0, 3.0, 3.0]\ny.phase = 0.25", "y.amplitude = [0.2, 0.4, 0.4, 0.4]\ny.frequency = [1.0, 1.0, 1.0, 1.0]"]),
    shown("wave.strength", Long, WAVE, ["strength = 0.3", "strength = 1.0", "strength = 2.0"]),
    shown("wave.map", Long, "x = { amplitude_deviation = [0.3, 0.5, 0.6, 0.6], amplitude_scale = [9.0, 9.0, 9.0, 9.0], frequency = [3.0, 3.0, 3.0, 3.0] }", [
        "",
        "map = { map = \"../maps/ramp.png\" }",
        "map = { map = \"../maps/cells.png\" }",
    ]),
    shown("wave.size", Long, "x = { amplitude = [0.1, 0.2, 0.2, 0.2], frequency = [3.0, 3.0, 3.0, 3.0], phase_deviation = 1.0, phase_scale = 6.0 }", ["size = 0.0", "size = 3.0", "size = 0.3"]),
    shown("wave.stray", Long, "x = { amplitude_deviation = [1.0, 1.5, 2.0, 2.0], amplitude_scale = [9.0, 9.0, 9.0, 9.0], frequency = [1.0, 1.0, 1.0, 1.0] }", ["stray = 0.0", "stray = 0.05", "stray = 0.3"]),
    shown("wave.keep_length", Long, WAVE, ["keep_length = true", "keep_length = true", "keep_length = false"]),
    shown("noise.amplitude", Long, "size = 0.8", ["amplitude = 0.02", "amplitude = 0.06", "amplitude = 0.15"]),
    shown("noise.size", Long, "amplitude = 0.08", ["size = 0.3", "size = 1.0", "size = 3.0"]),
    shown("noise.across", Long, "amplitude = 0.15\nsize = 1.5", ["across = 0.0", "across = 0.4", "across = 2.0"]),
    shown("noise.profile", Long, "amplitude = 0.1\nsize = 0.8", ["profile = [1.0, 0.0]", "", "profile = [0.0, 0.0, 2.0]"]),
    shown("noise.keep_length", Long, "amplitude = 0.15\nsize = 0.5", ["keep_length = true", "keep_length = true", "keep_length = false"]),
    shown("wind.amplitude", Long, "direction = [1.0, 0.0, 0.0]\nsize = 3.0", ["amplitude = 0.0", "amplitude = 1.5", "amplitude = 4.0"]),
    shown("wind.direction", Long, "amplitude = 2.0\nsize = 3.0", ["direction = [-1.0, 0.0, 0.0]", "direction = [1.0, 0.0, 0.0]", "direction = [0.0, 1.0, 0.0]"]),
    shown("wind.size", Long, "amplitude = 2.0\ndirection = [1.0, 0.0, 0.0]\ngust = 1.0", ["size = 0.3", "size = 2.0", "size = 20.0"]),
    shown("wind.frequency", Long, "amplitude = 2.0\ndirection = [1.0, 0.0, 0.0]\nsize = 3.0\ngust = 1.0", ["frequency = 0.0", "frequency = 0.5", "frequency = 2.0"]),
    shown("wind.gust", Long, "amplitude = 2.0\ndirection = [1.0, 0.0, 0.0]\nsize = 1.5", ["gust = 0.0", "gust = 0.5", "gust = 1.0"]),
    shown("collision.enabled", Long, "", ["enabled = false", "enabled = true", "enabled = true"]),
    shown("collision.clearance", Long, "", ["clearance = 0.01", "clearance = 0.05", "clearance = 3.0"]),
    shown("emitter.rate", Rain, DENSE, ["rate = 6.0", "rate = 24.0", "rate = 96.0"]),
    shown("emitter.spread", Rain, DENSE, ["spread = 3.0", "spread = 12.0", "spread = 40.0"]),
    shown("emitter.radius", Rain, DENSE, ["radius = 0.2", "radius = 0.5", "radius = 1.0"]),
    shown("emitter.percent", Rain, DENSE, ["percent = 0.3", "percent = [{ frame = 0, value = 0.0 }, { frame = 8, value = 1.0 }]", "percent = 1.0"]),
    shown("emitter.clump_rate", Rain, DENSE, ["clump_rate = 0.0", "clump_rate = 0.4", "clump_rate = 1.0"]),
];

/// Keys without a picture of their own, and why.
pub const WITHOUT: &[(&str, &str)] = &[
    ("clump.simulate", "shows in motion only"),
    ("curl.simulate", "shows in motion only"),
    ("wave.simulate", "shows in motion only"),
    ("noise.simulate", "shows in motion only"),
    ("wind.with_simulated", "shows in motion only"),
    ("collision.held", "shows in counts only"),
    ("emitter.name", "a name"),
    ("emitter.file", "where particles come from"),
    ("emitter.position", "where particles come from"),
    ("emitter.direction", "where particles come from"),
    ("emitter.frames", "when"),
    ("emitter.seed", "another of the same kind"),
];
