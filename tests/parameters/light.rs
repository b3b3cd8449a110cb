//! Settings of lights, shadows and pictures, three of each, over hair that shows them.

use super::Hair::{Ball, Curtain, Field, Fur};
use super::{Hair, Shown, picture_file};

/// A setting of the shot file in three pictures.
pub struct Lit {
    /// Table and key: `light.wrap`.
    pub key: &'static str,
    /// Hair that shows it.
    pub hair: Hair,
    /// What else the groom's layer and the shot say.
    pub with: [&'static str; 2],
    /// Three settings of it.
    pub settings: [&'static str; 3],
}

const KEY: &str = "[[light]]\nname = \"key\"\nkind = \"directional\"\ndirection = [0.6, -0.7, -0.6]\n";
const POINT: &str = "[[light]]\nname = \"lamp\"\nkind = \"point\"\n";
const SPOT: &str =
    "[[light]]\nname = \"spot\"\nkind = \"spot\"\nposition = [-2.0, 5.0, 3.0]\ndirection = [0.4, -1.0, -0.6]\n";
const BEHIND: &str =
    "[[light]]\nname = \"back\"\nkind = \"directional\"\ndirection = [0.0, -0.25, 1.0]\nintensity = 2.0\n";
const LEVEL: &str =
    "[[light]]\nname = \"back\"\nkind = \"directional\"\ndirection = [0.4, -0.02, 1.0]\nintensity = 2.0\n";
const FRONT: &str = "[[light]]\nname = \"front\"\nkind = \"directional\"\ndirection = [0.4, -0.15, -1.0]\n";
const CLUMPS: &str = "[[layer.clump]]\ndensity = 2.0\npercent = 0.95\nrate = 0.1\n";
const WHITE: &str = "color = { value = [0.9, 0.88, 0.84] }";
const FROM_ABOVE: &str = "[[light]]\nname = \"top\"\nkind = \"directional\"\ndirection = [0.5, -1.0, 0.2]\n";

const fn lit(key: &'static str, hair: Hair, with: [&'static str; 2], settings: [&'static str; 3]) -> Lit {
    Lit { key, hair, with, settings }
}

/// All of them.
pub const LIT: &[Lit] = &[
    lit(
        "light.kind",
        Field,
        ["", ""],
        [
            "[[light]]\nname = \"a\"\nkind = \"directional\"\ndirection = [0.4, -1.0, -0.6]",
            "[[light]]\nname = \"a\"\nkind = \"point\"\nposition = [-1.5, 3.0, 1.5]",
            "[[light]]\nname = \"a\"\nkind = \"spot\"\nposition = [-2.0, 5.0, 3.0]\ndirection = [0.4, -1.0, -0.6]\ncone = 15.0",
        ],
    ),
    lit(
        "light.direction",
        Field,
        ["", "[[light]]\nname = \"key\"\nkind = \"directional\"\n"],
        ["direction = [1.0, -0.3, 0.0]", "direction = [0.4, -1.0, -0.6]", "direction = [0.0, -0.4, 1.0]"],
    ),
    lit(
        "light.position",
        Field,
        ["", POINT],
        ["position = [-2.0, 2.0, 0.5]", "position = [0.0, 3.0, 1.0]", "position = [0.0, 2.0, -3.0]"],
    ),
    lit("light.cone", Field, ["", SPOT], ["cone = 8.0", "cone = 15.0", "cone = 30.0"]),
    lit(
        "light.softness",
        Field,
        ["", SPOT],
        ["cone = 15.0\nsoftness = 0.0", "cone = 15.0", "cone = 15.0\nsoftness = 1.0"],
    ),
    lit("light.intensity", Fur, ["", KEY], ["intensity = 0.4", "intensity = 1.0", "intensity = 2.5"]),
    lit(
        "light.color",
        Fur,
        ["", KEY],
        ["color = [1.3, 0.9, 0.6]", "color = [1.0, 1.0, 1.0]", "color = [0.6, 0.9, 1.4]"],
    ),
    lit("light.wrap", Field, ["", LEVEL], ["wrap = 0.0", "wrap = 40.0", "wrap = 90.0"]),
    lit(
        "shadow.quality",
        Field,
        [CLUMPS, FROM_ABOVE],
        ["[shadow]\nquality = \"draft\"", "[shadow]\nquality = \"default\"", "[shadow]\nquality = \"reference\""],
    ),
    lit(
        "shadow.shorten",
        Fur,
        [WHITE, FROM_ABOVE],
        ["[shadow]\nshorten = 0.0", "[shadow]\nshorten = 0.5", "[shadow]\nshorten = 0.95"],
    ),
    lit(
        "preview.exposure",
        Fur,
        ["", ""],
        ["[preview]\nexposure = -1.0", "[preview]\nexposure = 0.0", "[preview]\nexposure = 1.0"],
    ),
    lit(
        "preview.tone",
        Curtain,
        ["", ""],
        [
            "[preview]\nexposure = 1.5\ntone = \"shoulder\"",
            "[preview]",
            "[preview]\nexposure = 1.5\ntone = \"straight\"",
        ],
    ),
    lit(
        "preview.depth_cue",
        Field,
        ["", ""],
        ["[preview]\ndepth_cue = 0.0", "[preview]\ndepth_cue = 0.5", "[preview]\ndepth_cue = 0.9"],
    ),
    lit(
        "shade.fur",
        Fur,
        ["", KEY],
        ["[preview.shade]\nfur = 0.0", "[preview.shade]\nfur = 0.8", "[preview.shade]\nfur = 1.0"],
    ),
    lit(
        "shade.specular",
        Curtain,
        ["", KEY],
        ["[preview.shade]\nspecular = 0.0", "[preview.shade]\nspecular = 1.0", "[preview.shade]\nspecular = 3.0"],
    ),
    lit(
        "shade.through",
        Ball,
        ["", BEHIND],
        ["[preview.shade]\nthrough = 0.0", "[preview.shade]\nthrough = 0.6", "[preview.shade]\nthrough = 2.0"],
    ),
    lit(
        "shade.guard",
        Curtain,
        ["[layer.guard]\npercent = 0.15\nlength = 1.1\nwidth = 3.0", FRONT],
        ["[preview.shade]\nguard = 0.0", "[preview.shade]\nguard = 1.5", "[preview.shade]\nguard = 15.0"],
    ),
    lit(
        "shade.wetness",
        Fur,
        [CLUMPS, KEY],
        ["[preview.shade]\nwetness = 0.0", "[preview.shade]\nwetness = 0.5", "[preview.shade]\nwetness = 1.0"],
    ),
];

impl Lit {
    /// Its name in the folder of pictures.
    pub fn file(&self) -> String {
        picture_file(self.key)
    }

    /// Files of the shot that shows one of its settings, by path.
    pub fn files(&self, setting: &str) -> Vec<(String, Vec<u8>)> {
        let shown = Shown { key: "feature", hair: self.hair, with: self.with[0], settings: [""; 3] };
        let mut files = shown.files("");
        let shot = &mut files[0].1;
        let own = format!("{}{setting}\n", self.with[1]);
        let (before, preview) = match own.split_once("[preview]\n") {
            Some((before, preview)) => (before.to_owned(), preview.to_owned()),
            None => (own, String::new()),
        };
        shot.extend(format!("{preview}\n{before}").bytes());
        files
    }
}
