//! Tiny shots that show one parameter each: a patch of skin or a ball with hair, always seen by the same camera.

use crate::ascii_ply;
use crate::parameters::{Hair, Shown, picture_file};
use pelage::format::image::png_bytes;
use pelage_geom::{Mesh, Vec3, shapes};

/// Width and height of a picture, pixels.
pub const SIZE: [u32; 2] = [186, 144];

/// Side of the maps, texels.
const MAP: usize = 96;

/// Frames of a shot whose look changes in time; the last one is drawn.
const FRAMES: u32 = 12;

/// Camera of a kind of hair.
struct Seen {
    /// Direction from the subject to the camera.
    from: [f64; 3],
    /// Middle of the picture.
    centre: [f64; 3],
    /// Width of the picture there, scene units.
    width: f64,
}

impl Shown {
    /// Table of its key: `layer.width` of `layer.width.tip`.
    pub fn table(&self) -> &'static str {
        self.key.rsplit_once('.').expect("a key in a table").0
    }

    /// Its name in the folder of pictures.
    pub fn file(&self) -> String {
        picture_file(self.key)
    }

    /// Files of the shot that shows one of its settings, by path.
    pub fn files(&self, setting: &str) -> Vec<(String, Vec<u8>)> {
        let mut files = vec![
            ("pipeline.toml".to_owned(), self.shot().into_bytes()),
            ("groom.toml".to_owned(), self.groom(setting).into_bytes()),
            ("skin.ply".to_owned(), ascii_ply(&self.skin()).into_bytes()),
        ];
        files.extend(maps());
        files
    }

    /// The shot file.
    fn shot(&self) -> String {
        let (from, [w, h]) = (self.seen().from, SIZE);
        let moves = self.hair == Hair::Rain || self.key.starts_with("wind");
        let frames = if moves { FRAMES } else { 1 };
        format!(
            "[shot]\nname = \"shown\"\nframes = [1, {frames}]\nfps = 24\nmeters_per_unit = 0.01\n\n\
             [skin]\nrest = \"skin.ply\"\n\n[groom]\nfile = \"groom.toml\"\n\n[simulate]\ntarget = \"off\"\n\n\
             [export]\nformats = []\n\n[preview]\nframe = {frames}\nsize = [{w}, {h}]\nfrom = {from:?}\nzoom = {FRAME}\n"
        )
    }

    /// The groom file with one of the settings.
    pub fn groom(&self, setting: &str) -> String {
        let first = self.key.split('.').next().expect("a key");
        // What opens other tables comes last.
        let mut own = [self.with, setting];
        if first != "comb" {
            own.sort_by_key(|text| text.contains("\n["));
        }
        let own = own.join("\n").trim().to_owned();
        let given = |key: &str| {
            own.lines()
                .take_while(|l| !l.starts_with('['))
                .any(|l| l.split(['=', '.']).next().is_some_and(|k| k.trim() == key))
        };
        // What the table says besides, unless the parameter's own lines say it.
        let beside = |lines: &[&str]| -> String {
            let free = |l: &&&str| !given(l.split('=').next().expect("a key").trim());
            lines.iter().filter(free).map(|l| format!("{l}\n")).collect()
        };
        let points = if matches!(self.hair, Hair::Long | Hair::Curtain) { 8 } else { 5 };
        let push_up = self.hair != Hair::Ball;
        let mut out = format!(
            "[control]\nplacement = {{ per_cm2 = 3.0 }}\npoints = {points}\npush_up = {push_up}\n\n{}{}\n",
            if self.key == "comb.side" { PARTING } else { "" },
            if first == "comb" { format!("[[comb]]\n{own}\n") } else { self.combed().to_owned() },
        );
        if first == "emitter" {
            let rest = beside(&[
                "name = \"drizzle\"",
                "position = [0.0, 6.0, 0.0]",
                "direction = [0.0, -1.0, 0.0]",
                "spread = 11.0",
                "rate = 16.0",
                "radius = 0.5",
                "clump_rate = 0.5",
            ]);
            out += &format!("\n[[emitter]]\n{rest}{own}\n");
        } else if self.hair == Hair::Rain {
            out += RAIN;
        }
        let layer = match self.hair {
            Hair::Long => [
                "density = { value = 6.5 }",
                "length = { value = 3.1 }",
                "width = { value = 620.0, tip = 0.5 }",
                "points = 121",
            ],
            Hair::Curtain => {
                ["density = { value = 50.0 }", "length = { value = 3.1 }", "width = { value = 300.0 }", "points = 81"]
            }
            Hair::Ball => {
                ["density = { value = 9.0 }", "length = { value = 1.3 }", "width = { value = 500.0 }", "points = 40"]
            }
            Hair::Rain => [
                "density = { value = 60.0 }",
                "length = { value = 1.0, noise = 0.12 }",
                "width = { value = 320.0 }",
                "points = 16",
            ],
            _ => [
                "density = { value = 45.0 }",
                "length = { value = 1.7, noise = 0.12 }",
                "width = { value = 320.0 }",
                "points = 28",
            ],
        };
        let color = if points == 8 { LIGHT } else { COLOR };
        let all = [layer[0], layer[1], layer[2], layer[3], color];
        let lines = match first {
            "layer" | "feature" => beside(&all),
            table => all.iter().filter(|l| !l.starts_with(table)).map(|l| format!("{l}\n")).collect(),
        };
        out += &format!("\n[[layer]]\nname = \"shown\"\n{lines}");
        out += &match first {
            "layer" | "feature" => format!("{own}\n"),
            "clump" | "value" | "vary" => format!("\n[[layer.clump]]\n{own}\n"),
            "wave" | "noise" => format!("\n[[layer.{first}]]\n{own}\n"),
            "curl" | "wind" | "collision" | "width" | "color" | "guard" => format!("\n[layer.{first}]\n{own}\n"),
            "dilation" | "wet" => {
                // A scale needs regions to differ over.
                let regions = "regions = { map = \"maps/cells.png\" }";
                let made = if self.key == "dilation.scale" { regions } else { "density = 1.0" };
                format!("\n[[layer.clump]]\n{made}\npercent = 0.95\n\n[layer.clump.{first}]\n{own}\n")
            }
            "custom" => format!("\n[layer.curl]\n{CUSTOM}\n\n[layer.curl.x]\n{own}\n"),
            "axis" => format!("\n[[layer.wave]]\n{own}\n"),
            "emitter" => "\n[[layer.clump]]\ndensity = 3.0\nareas = [\"drizzle\"]\n".to_owned(),
            _ => String::new(),
        };
        out
    }

    fn combed(&self) -> &'static str {
        match self.hair {
            Hair::Fur => {
                "[[comb]]\nkind = \"direction-curve\"\npoints = [[-10.0, 0.0, 0.0], [10.0, 0.0, 2.0]]\nbend = 0.35\ncurvature = 0.5\n"
            }
            Hair::Field | Hair::Rain => "",
            Hair::Long | Hair::Curtain => {
                "[[comb]]\nkind = \"direction-curve\"\npoints = [[0.0, 10.0, 0.0], [0.0, -10.0, 0.0]]\nbend = 0.85\n"
            }
            Hair::Ball => {
                "[[comb]]\nkind = \"direction-curve\"\npoints = [[0.0, 10.0, 0.0], [0.0, -10.0, 0.0]]\nbend = 0.8\n"
            }
        }
    }

    fn seen(&self) -> Seen {
        match self.hair {
            Hair::Rain => Seen { from: [0.0, 1.6, 1.0], centre: [0.0, 0.4, 0.0], width: 5.6 },
            Hair::Fur | Hair::Field => Seen { from: [0.0, 0.62, 1.0], centre: [0.15, 0.6, 0.0], width: 5.8 },
            Hair::Long | Hair::Curtain => Seen { from: [0.0, 0.06, 1.0], centre: [0.0, -1.65, 0.0], width: 4.7 },
            Hair::Ball => Seen { from: [0.2, 0.7, 1.0], centre: [0.0, -0.1, 0.0], width: 5.2 },
        }
    }

    /// The skin, and four triangles too small to be seen, outside the picture, that hold the camera where it is.
    fn skin(&self) -> Mesh {
        let mut mesh = match self.hair {
            Hair::Fur | Hair::Field | Hair::Rain => {
                bent(16, |x, z| Vec3::new(4.4 * x, -0.5 * x * x - 0.4 * z * z, 3.0 * z))
            }
            // Upside down: a strip of a tube, turned to the camera, whose hair hangs.
            Hair::Long | Hair::Curtain => bent(16, |x, z| {
                let (sin, cos) = (0.8 - 1.2 * z).sin_cos();
                Vec3::new(3.6 * x, -0.4 * cos, 0.4 * sin)
            }),
            Hair::Ball => shapes::cube_sphere(10, 1.4),
        };
        let Seen { from, centre, width } = self.seen();
        let toward = Vec3::from(from).normalize();
        let right = Vec3::new(0.0, 1.0, 0.0).cross(&toward).normalize();
        let up = toward.cross(&right);
        let half = [0.5 * FRAME * width, 0.5 * FRAME * width * f64::from(SIZE[1]) / f64::from(SIZE[0])];
        for (k, (x, y)) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].into_iter().enumerate() {
            let at = Vec3::from(centre) + right * (x * half[0]) + up * (y * half[1]);
            let first = mesh.position.len() as u32;
            mesh.position.extend([at, at + right * 1e-3, at + up * 1e-3].map(<[f64; 3]>::from));
            mesh.triangle.push([first, first + 1, first + 2]);
            let u = 2.0 + k as f32;
            mesh.corner_uv.push([[u, 0.0], [u + 0.001, 0.0], [u, 0.001]]);
            mesh.face.push(mesh.face.last().map_or(0, |f| f + 1));
        }
        mesh
    }
}

/// The camera frames this many times what the picture shows: what holds it, and long hair, may be outside.
const FRAME: f64 = 2.5;

/// The colour of hair in all pictures of a groom that do not say another.
const COLOR: &str = "color = { value = [0.30, 0.14, 0.06], noise = 0.25 }";

/// The colour of single strands, which stand before the grey of the background.
const LIGHT: &str = "color = { value = [0.85, 0.60, 0.33], noise = 0.1 }";

/// A curl by formula whose wave is seen from the front.
const CUSTOM: &str = "kind = \"custom\"\nphase = 0.0\nangle = 0.25\ny = { a = 0.0 }";

/// A parting for combs that act on one side of it.
const PARTING: &str = "[[parting]]\nname = \"middle\"\npoints = [[0.0, 0.0, -1.4], [0.0, 0.0, 1.4]]\n\n";

/// A shower, and a spout that travels along a curve.
const RAIN: &str = "
[[emitter]]
name = \"drizzle\"
position = [0.0, 6.0, 0.0]
direction = [0.0, -1.0, 0.0]
spread = 11.0
rate = 16.0
radius = 0.5
clump_rate = 0.5

[[emitter]]
name = \"spout\"
position = [{ frame = 1, value = [-2.0, 4.0, 0.9] }, { frame = 12, value = [2.0, 4.0, 0.9] }]
direction = [0.0, -1.0, 0.0]
rate = 48.0
radius = 0.4
clump_rate = 0.5
";

/// A square of skin, x and z in [-1/2, 1/2], somewhere else.
fn bent(n: usize, to: impl Fn(f64, f64) -> Vec3) -> Mesh {
    let mut mesh = shapes::plane(n, n, 1.0);
    mesh.position.iter_mut().for_each(|p| *p = to(p[0], p[2]).into());
    mesh
}

/// Maps that settings name; u to the right, v up.
fn maps() -> Vec<(String, Vec<u8>)> {
    let grey = |name: &str, f: &dyn Fn(f64, f64) -> f64| {
        let at = |k: usize| ((k % MAP) as f64 + 0.5, MAP as f64 - (k / MAP) as f64 - 0.5);
        let texel = |k| {
            let (x, y) = at(k);
            (255.0 * f(x / MAP as f64, y / MAP as f64)).round() as u8
        };
        let data: Vec<u8> = (0..MAP * MAP).map(texel).collect();
        (format!("maps/{name}.png"), png_bytes(MAP, MAP, 1, &data))
    };
    let rgb = |name: &str, f: &dyn Fn(f64, f64) -> [f64; 3]| {
        let texel = |k: usize| {
            f(((k % MAP) as f64 + 0.5) / MAP as f64, 1.0 - ((k / MAP) as f64 + 0.5) / MAP as f64)
                .map(|x| (255.0 * x).round() as u8)
        };
        let data: Vec<u8> = (0..MAP * MAP).flat_map(texel).collect();
        (format!("maps/{name}.png"), png_bytes(MAP, MAP, 3, &data))
    };
    // Cells of a lattice, each with a grey of its own.
    let cells = |n: f64| {
        move |x: f64, y: f64| {
            let row = (y * n * 0.7).floor();
            let column = (x * n + 0.5 * (row % 2.0)).floor();
            0.05 + 0.9 * (((column * 7.0 + row * 5.0) % 11.0) / 10.0)
        }
    };
    vec![
        grey("flat", &|_, _| 0.5),
        grey("ramp", &|x, _| x),
        grey("half", &|x, _| f64::from(x < 0.5)),
        grey("spot", &|x, y| f64::from((x - 0.5).hypot(y - 0.5) < 0.3)),
        grey("cells", &cells(6.0)),
        grey("small_cells", &cells(10.0)),
        rgb("color", &|x, _| if x < 0.5 { [0.9, 0.35, 0.2] } else { [0.3, 0.5, 0.95] }),
        // Directions in the root frame, 0..1 for -1..1: around the middle, and away from it.
        rgb("swirl", &|x, y| {
            let (u, v) = (x - 0.5, y - 0.5);
            let r = u.hypot(v).max(1e-6);
            [0.55, 0.5 - 0.5 * v / r, 0.5 + 0.5 * u / r]
        }),
        rgb("outward", &|x, y| {
            let (u, v) = (x - 0.5, y - 0.5);
            let r = u.hypot(v).max(1e-6);
            [0.7, 0.5 + 0.5 * u / r, 0.5 + 0.5 * v / r]
        }),
        // Along u in the root frame, up in the scene.
        rgb("lean", &|_, _| [0.6, 1.0, 0.5]),
    ]
}
