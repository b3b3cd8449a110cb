//! What a layer's hair is, and how it is combed.

use super::Hair::{Curtain, Field, Fur, Long};
use super::{Shown, shown};

const ALONG: &str = "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]";

/// A cluster that twists in the middle, split in five.
const CLUSTER: &str = "\n[[cluster]]\nname = \"tuft\"\nroot = [0.0, 0.0, 0.0]\nradius = 1.2\npoints = [[0.0, 0.8, 0.0], [0.2, 1.9, 0.0]]\nwidth = [1.2, 0.6, 0.4]\n\n[[cluster_edit]]\nkind = \"split\"\nof = \"tuft\"\ncount = 5\n\n[[cluster_edit]]\nkind = \"scale\"\nof = \"tuft/*\"\nwidth = [1.0, 0.5, 0.2]\n\n[[cluster_edit]]\nkind = \"twist\"\nof = \"tuft\"\nturns = 0.75";

/// Parameters of a layer, its features and its combing.
pub(super) const FEATURES: &[Shown] = &[
    // A layer and its features.
    shown(
        "layer.density",
        Fur,
        "",
        ["density = { value = 10.0 }", "density = { value = 55.0 }", "density = { value = 200.0 }"],
    ),
    shown(
        "layer.on_off",
        Fur,
        "",
        ["", "on_off = { map = \"maps/half.png\" }", "on_off = { map = \"maps/spot.png\" }"],
    ),
    shown(
        "layer.length",
        Fur,
        "",
        ["length = { value = 0.6 }", "length = { value = 1.5 }", "length = { value = 2.4 }"],
    ),
    shown(
        "layer.width",
        Fur,
        "",
        ["width = { value = 80.0 }", "width = { value = 250.0 }", "width = { value = 700.0 }"],
    ),
    shown(
        "layer.opacity",
        Fur,
        "",
        ["opacity = { value = 0.15 }", "opacity = { value = 0.5 }", "opacity = { value = 1.0 }"],
    ),
    shown(
        "layer.color",
        Fur,
        "",
        ["color = { value = [0.02, 0.014, 0.01] }", "", "color = { value = [0.75, 0.55, 0.30] }"],
    ),
    shown(
        "layer.guides",
        Fur,
        "\n[[comb]]\nkind = \"direction-map\"\nweight = 0.8\nmap = { map = \"maps/swirl.png\" }",
        ["guides = \"blend\"", "guides = \"nearest\"", "guides = \"copy\""],
    ),
    shown("layer.cluster", Field, CLUSTER, ["", "[layer.cluster]\npercent = 0.6", "[layer.cluster]"]),
    shown(
        "layer.in_clusters",
        Field,
        CLUSTER,
        ["in_clusters = false", "in_clusters = true", "in_clusters = true\nlength = { value = 0.8 }"],
    ),
    shown("layer.guard", Fur, "", ["", "guard = { percent = 0.05 }", "guard = { percent = 0.3 }"]),
    shown(
        "layer.points",
        Long,
        "\n[layer.curl]\nkind = \"helix\"\nradius = 0.13\npitch = 0.5",
        ["points = 12", "points = 40", "points = 160"],
    ),
    shown(
        "layer.order",
        Curtain,
        "\n[layer.curl]\nkind = \"uniplanar\"\nradius = 0.15\npitch = 1.0\nangle = 0.25\n[[layer.clump]]\ndensity = 3.0\npercent = 1.0\nrate = 0.4",
        [
            "order = [\"curl\", \"clump\", \"wave\", \"noise\", \"wind\"]",
            "",
            "order = [\"wind\", \"noise\", \"wave\", \"clump\", \"curl\"]",
        ],
    ),
    shown(
        "feature.value",
        Fur,
        "",
        ["length = { value = 0.6 }", "length = { value = 1.5 }", "length = { value = 2.4 }"],
    ),
    shown(
        "feature.map",
        Fur,
        "",
        [
            "length = { value = 1.8 }",
            "length = { value = 1.8, map = \"maps/ramp.png\" }",
            "length = { value = 1.8, map = \"maps/cells.png\" }",
        ],
    ),
    shown(
        "feature.noise",
        Fur,
        "",
        ["length = { value = 1.5 }", "length = { value = 1.5, noise = 0.3 }", "length = { value = 1.5, noise = 1.0 }"],
    ),
    shown("width.value", Fur, "", ["value = 80.0", "value = 250.0", "value = 700.0"]),
    shown("width.tip", Fur, "value = 450.0", ["tip = 0.0", "", "tip = 1.2"]),
    shown(
        "width.profile",
        Fur,
        "value = 450.0",
        ["profile = [1.0, 0.1]", "profile = [0.4, 1.2, 1.0, 0.1]", "profile = [0.3, 0.3, 0.3, 2.0]"],
    ),
    shown("width.noise", Fur, "value = 500.0", ["", "noise = 0.4", "noise = 1.0"]),
    shown(
        "color.value",
        Fur,
        "",
        ["value = [0.02, 0.014, 0.01]", "value = [0.15, 0.08, 0.04]", "value = [0.75, 0.55, 0.30]"],
    ),
    shown("color.map", Fur, "value = [1.0, 1.0, 1.0]", ["", "map = \"maps/color.png\"", "map = \"maps/cells.png\""]),
    shown("color.noise", Fur, "value = [0.50, 0.30, 0.14]", ["noise = 0.0", "noise = 0.3", "noise = 1.0"]),
    shown(
        "color.ramp",
        Fur,
        "value = [0.30, 0.14, 0.06]",
        [
            "",
            "ramp = [[0.15, 0.12, 0.1], [1.6, 1.8, 2.2]]",
            "ramp = [[2.2, 3.0, 4.0], [2.2, 3.0, 4.0], [0.1, 0.1, 0.1]]",
        ],
    ),
    shown("guard.percent", Fur, "", ["percent = 0.0", "percent = 0.08", "percent = 0.4"]),
    shown("guard.length", Fur, "percent = 0.08", ["length = 1.0", "", "length = 2.2"]),
    shown("guard.width", Fur, "percent = 0.08", ["width = 0.6", "", "width = 4.0"]),
    // Combing.
    shown(
        "comb.kind",
        Field,
        "weight = 0.6",
        [
            "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]",
            "kind = \"lay-down\"\namount = 0.9",
            "kind = \"direction-map\"\nmap = { map = \"maps/swirl.png\" }",
        ],
    ),
    shown("comb.weight", Field, ALONG, ["weight = 0.1", "weight = 0.4", "weight = 0.8"]),
    shown(
        "comb.region",
        Field,
        ALONG,
        ["", "region = { map = \"maps/half.png\" }", "region = { map = \"maps/ramp.png\" }"],
    ),
    shown(
        "comb.points",
        Field,
        "kind = \"direction-curve\"\nweight = 0.6",
        [
            "points = [[10.0, 0.0, 0.0], [-10.0, 0.0, 0.0]]",
            "points = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]",
            "points = [[-2.2, 0.5, 1.0], [-1.0, 0.5, -1.0], [0.0, 0.5, 1.0], [1.0, 0.5, -1.0], [2.2, 0.5, 1.0]]",
        ],
    ),
    shown(
        "comb.radius",
        Field,
        "kind = \"direction-curve\"\nweight = 0.7\npoints = [[-0.1, 0.0, 1.4], [0.1, 0.0, 1.4]]",
        ["radius = 0.6", "radius = 1.6", ""],
    ),
    shown(
        "comb.falloff",
        Field,
        "kind = \"direction-curve\"\nweight = 0.7\npoints = [[-0.1, 0.0, 1.4], [0.1, 0.0, 1.4]]\nradius = 1.6",
        ["falloff = 0.0", "falloff = 0.5", "falloff = 1.0"],
    ),
    shown("comb.bend", Field, ALONG, ["bend = 0.1", "bend = 0.4", "bend = 0.8"]),
    shown(
        "comb.curvature",
        Field,
        "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]\nbend = 0.6",
        ["curvature = 0.0", "curvature = 0.5", "curvature = 1.0"],
    ),
    shown(
        "comb.side",
        Field,
        "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]\nbend = 0.5\nparting = \"middle\"",
        [
            "side = \"left\"",
            "side = \"right\"",
            "side = \"right\"\n[[comb]]\nkind = \"direction-curve\"\npoints = [[10.0, 0.0, 0.0], [-10.0, 0.0, 0.0]]\nbend = 0.5\nparting = \"middle\"\nside = \"left\"",
        ],
    ),
    shown(
        "comb.at",
        Field,
        "kind = \"chain\"\nradius = 1.2\nturn = [{ joint = 0, turn = [0.0, 0.0, -70.0] }]",
        ["at = [-1.2, 0.0, 0.0]", "at = [0.0, 0.0, 0.5]", "at = [1.2, 0.0, 0.0]"],
    ),
    shown(
        "comb.turn",
        Field,
        "kind = \"chain\"\nat = [0.0, 0.0, 0.0]\nradius = 1.5\nfalloff = 0.5",
        [
            "turn = [{ joint = 0, turn = [0.0, 0.0, -50.0] }]",
            "turn = [{ joint = 2, turn = [0.0, 0.0, -90.0] }]",
            "turn = [{ joint = 0, turn = [0.0, 0.0, 60.0] }, { joint = 2, turn = [0.0, 0.0, -120.0] }]",
        ],
    ),
    shown(
        "comb.reach",
        Field,
        "kind = \"chain\"\nat = [0.0, 0.0, 0.0]\nradius = 1.5",
        ["reach = [-1.2, 0.6, 0.0]", "reach = [0.0, 0.6, 0.0]", "reach = [1.2, 0.9, 0.0]"],
    ),
    shown(
        "comb.control_points",
        Field,
        "kind = \"chain\"\nat = [0.0, 0.0, 0.0]\nturn = [{ joint = 0, turn = [0, 0, -40] }, { joint = 1, turn = [0, 0, 80] }, { joint = 2, turn = [0, 0, -80] }, { joint = 3, turn = [0, 0, 80] }]\n[[comb]]\nkind = \"smooth\"",
        ["weight = 0.0", "control_points = 5", "control_points = 4"],
    ),
    shown(
        "comb.plane",
        Field,
        "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, -4.0], [10.0, 0.0, 4.0]]\nbend = 0.7\n[[comb]]\nkind = \"mirror\"",
        [
            "plane = { point = [0.0, 0.0, 0.0], normal = [1.0, 0.0, 0.0] }",
            "plane = { point = [0.0, 0.0, 0.0], normal = [-1.0, 0.0, 0.0] }",
            "plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }",
        ],
    ),
    shown(
        "comb.map",
        Field,
        "kind = \"direction-map\"\nweight = 0.8",
        [
            "map = { map = \"maps/lean.png\" }",
            "map = { map = \"maps/outward.png\" }",
            "map = { map = \"maps/swirl.png\" }",
        ],
    ),
    shown(
        "comb.space",
        Field,
        "kind = \"direction-map\"\nweight = 0.8\nmap = { map = \"maps/lean.png\" }",
        ["", "space = \"root\"", "space = \"world\""],
    ),
    shown(
        "comb.angle",
        Field,
        "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]\nbend = 0.2\n[[comb]]\nkind = \"bend\"\ncurvature = 1.0",
        ["angle = 20.0", "angle = 60.0", "angle = 150.0"],
    ),
    shown(
        "comb.amount",
        Field,
        "kind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 0.0]]\nbend = 0.2\n[[comb]]\nkind = \"lay-down\"",
        ["amount = 0.0", "amount = 0.4", "amount = 0.8"],
    ),
];
