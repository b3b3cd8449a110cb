//! How hair is simulated: `[simulate]` of the shot file, and what a layer's hair is made of.

use super::ShotFile;
use super::document::{ConfigError, Document, Fixed, exactly};
use super::keyed::{Amount, Key, Keyed, Vector};
use super::look_value::{LookValue, painted, varied};
use schemars::JsonSchema;
use serde::de::Deserializer;
use serde::{Deserialize, Serialize};

/// Segments of a simulated hair of a groom: twice the 12 points that long control hair is combed with. Half as many bend
/// in visible corners, twice as many cost twice the time.
pub const SEGMENTS: usize = 25;
/// Frames between checkpoints: a second of film, so that an edit late in a shot does not simulate all of it again.
const CHECKPOINT: u32 = 24;

/// How hair is simulated.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Simulate {
    /// What is simulated. A layer may say otherwise. Default: "every-hair".
    pub target: Target,
    /// Model of a strand. Default: "rod".
    pub model: StrandModel,
    /// Segments of a simulated hair, equal in length; hairs simulated one by one are exported with one point more.
    /// Default: 25; for hair from a curves file its points as they are.
    pub segments: Option<usize>,
    /// Steps in a frame. Default: chosen from the motion of the skin.
    pub substeps: Option<u32>,
    /// Change of a segment's direction at which iterations end, radians. Default: 0.00001.
    pub tolerance: Option<f64>,
    /// A budget by which `segments`, `substeps` and `tolerance` are chosen instead: `{ error = 0.5 }`, the median distance of
    /// hairs from a much finer simulation, millimetres, or `{ seconds = 2 }` of simulation a frame. Chosen once, by
    /// simulating a few hairs, and written beside the shot file. Default: none.
    pub quality: Option<Quality>,
    /// Start in equilibrium under gravity, so that the hair stands as it was combed; false: its shape is the natural,
    /// unloaded one. Default: true; false for hair from a curves file.
    pub sag_free: Option<bool>,
    /// Largest strain that is left in a segment: 0.01 is one percent. Default: 0.01.
    pub strain_limit: f64,
    /// Coulomb friction between hair and body. Default: 0.3.
    pub friction: f64,
    /// Distance that hair keeps from the body, millimetres. Default: 0.5.
    pub offset: f64,
    /// A root that moves farther than this in a frame takes its hair along without dynamics, metres. Default: 1.
    pub teleport: f64,
    /// Let strands at rest sleep. Default: true.
    pub sleep: bool,
    /// Frames between checkpoints, from which simulation goes on. Default: 24.
    pub checkpoint: u32,
    /// Gravity, m/s2: a number (downward), three numbers, or key frames
    /// `[{ frame, value }]`. Default: 9.81.
    pub gravity: Keyed<Amount>,
    /// The wind. Default: none.
    pub wind: Option<WindSettings>,
    /// What hair can't enter.
    pub body: BodySettings,
    /// What hair from a curves file is made of. Layers of a groom say it themselves.
    pub material: Option<Material>,
}

impl Default for Simulate {
    fn default() -> Self {
        Simulate {
            target: Target::EveryHair,
            model: StrandModel::Rod,
            segments: None,
            substeps: None,
            tolerance: None,
            quality: None,
            sag_free: None,
            strain_limit: 0.01,
            friction: 0.3,
            offset: 0.5,
            teleport: 1.0,
            sleep: true,
            checkpoint: CHECKPOINT,
            gravity: Keyed::constant(Amount::Number(9.81)),
            wind: None,
            body: BodySettings::default(),
            material: None,
        }
    }
}

/// A budget of the simulation.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Quality {
    /// Median distance of hairs from a much finer simulation, millimetres.
    Error(f64),
    /// Seconds of simulation a frame, on all threads.
    Seconds(f64),
}

impl std::fmt::Display for Quality {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Quality::Error(mm) => write!(f, "{{ error = {mm} }}"),
            Quality::Seconds(s) => write!(f, "{{ seconds = {s} }}"),
        }
    }
}

/// What is simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// Every hair by itself.
    #[default]
    EveryHair,
    /// The control hairs; all others are blended from them.
    ControlHairs,
    /// Nothing: control hairs ride the skin.
    Off,
}

impl Target {
    /// Name as written in the file.
    pub fn name(self) -> &'static str {
        match self {
            Target::EveryHair => "every-hair",
            Target::ControlHairs => "control-hairs",
            Target::Off => "off",
        }
    }
}

/// Model of a strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StrandModel {
    /// Discrete elastic rod.
    #[default]
    Rod,
    /// Springs with altitude springs, calibrated to the material, robust integration.
    Springs,
    /// Springs integrated as printed in the paper of Selle, Lentine and Fedkiw (2008).
    Paper,
}

/// The wind. Velocities and strengths may have key frames, sizes and times are of the shot.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindSettings {
    /// Mean velocity along the scene's axes, m/s: three numbers, or key frames `[{ frame, value }]`.
    pub velocity: Keyed<Vector>,
    /// Largest change of the mean wind in a gust, as a fraction of it: a number, or key frames. Default: 0.
    #[serde(default = "nothing")]
    pub gust: Keyed<f64>,
    /// Time from one gust to the next, seconds. Default: 2.
    pub gust_period: Option<f64>,
    /// Turbulence: root mean square of its speed, m/s: a number, or key frames. Default: 0.
    #[serde(default = "nothing")]
    pub turbulence: Keyed<f64>,
    /// Size of the largest eddies, metres. Default: 0.2.
    pub turbulence_size: Option<f64>,
    /// Time in which the largest eddies change, seconds. Default: 1.
    pub turbulence_period: Option<f64>,
    /// Thickness of the layer of air at the body in which wind toward it fades, metres. Default: 0.02.
    pub boundary: Option<f64>,
    /// Names the wind's random numbers. Default: 0.
    #[serde(default)]
    pub seed: u32,
}

fn nothing() -> Keyed<f64> {
    Keyed::constant(0.0)
}

impl WindSettings {
    /// The wind around a frame number, in a shot of so many frames per second.
    pub fn at(&self, frame: f64, fps: f64) -> pelage_sim::Wind {
        let d = pelage_sim::Wind::default();
        let velocity = self.velocity.vectors();
        let keys: Vec<(f64, [f64; 3])> = velocity.0.iter().map(|k| (k.frame / fps, k.value)).collect();
        pelage_sim::Wind {
            velocity: velocity.at(frame),
            drift: (keys.len() > 1).then(|| pelage_sim::wind::drift(&keys, frame / fps)),
            gust: self.gust.at(frame),
            gust_period: self.gust_period.unwrap_or(d.gust_period),
            turbulence: self.turbulence.at(frame),
            turbulence_size: self.turbulence_size.unwrap_or(d.turbulence_size),
            turbulence_period: self.turbulence_period.unwrap_or(d.turbulence_period),
            boundary: self.boundary.unwrap_or(d.boundary),
            seed: u64::from(self.seed),
        }
    }
}

fn two_points<'de, D: Deserializer<'de>>(d: D) -> Result<Option<[[f64; 3]; 2]>, D::Error> {
    exactly(d).map(|points: [Fixed<f64, 3>; 2]| Some(points.map(|p| p.0)))
}

/// What hair can't enter.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BodySettings {
    /// The skin. Default: true.
    pub skin: bool,
    /// Distance between the samples of distance fields, millimetres. Default: 4.
    pub voxel: f64,
    /// Distance outside a surface up to which its field is exact, millimetres. Default: 20.
    pub outside: f64,
    /// Distance inside a surface up to which its field is exact, millimetres. Default: 10.
    pub inside: f64,
    /// What stands for the skin and for meshes that do not say otherwise. Default: "field", which a skin that deforms must be.
    pub kind: BodyKind,
    /// Axis of the skin's cylinder or sphere in its rest pose: from where to where, scene units; a sphere stands around
    /// its middle. Default: through the middle of its bounds, along up.
    #[serde(default, deserialize_with = "two_points")]
    pub axis: Option<[[f64; 3]; 2]>,
    /// Other meshes.
    pub mesh: Vec<BodyMesh>,
}

impl Default for BodySettings {
    fn default() -> Self {
        let f = pelage_sim::body::FieldSettings::default();
        let [voxel, outside, inside] = [f.voxel, f.outside, f.inside].map(|x| x * 1e3);
        BodySettings { skin: true, voxel, outside, inside, kind: BodyKind::Field, axis: None, mesh: Vec::new() }
    }
}

/// A mesh that hair can't enter.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BodyMesh {
    /// PLY, scene units.
    pub file: std::path::PathBuf,
    /// What stands for it. Default: as `simulate.body.kind` says.
    pub kind: Option<BodyKind>,
    /// Axis of its cylinder or sphere: from where to where, scene units. Default: through the middle of its bounds,
    /// along up.
    #[serde(default, deserialize_with = "two_points")]
    pub axis: Option<[[f64; 3]; 2]>,
    /// CSV of its rigid motion, as for `skin.motion`. Default: it stays.
    pub motion: Option<std::path::PathBuf>,
    /// The frame at which that motion's time is 0. Default: the shot's first frame.
    pub motion_start: Option<f64>,
    /// Point in scene units that the motion's rotation leaves in place. Default: the origin.
    #[serde(default, deserialize_with = "exactly")]
    pub pivot: [f64; 3],
}

/// What stands for a mesh. Whatever it is, points that end a frame inside the mesh itself come out of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BodyKind {
    /// A distance field of it.
    #[default]
    Field,
    /// A table of its radius over azimuth and height around an axis: what a ray to the axis does not see is filled.
    Cylinder,
    /// A table of its radius over two angles around a centre: what a ray to the centre does not see is filled.
    Sphere,
    /// The ellipsoid around its vertices, for the skin one of the same inertia, which cuts through it: cheap, for what
    /// is about as round.
    Ellipsoid,
}

impl BodyKind {
    /// As written in the shot file.
    pub fn name(self) -> &'static str {
        match self {
            BodyKind::Field => "field",
            BodyKind::Cylinder => "cylinder",
            BodyKind::Sphere => "sphere",
            BodyKind::Ellipsoid => "ellipsoid",
        }
    }

    /// True if it stands on an axis.
    pub fn is_table(self) -> bool {
        matches!(self, BodyKind::Cylinder | BodyKind::Sphere)
    }
}

/// What simulated hair is made of.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// Diameter of the simulated hair, micrometres; the render width is another matter. Default: 70.
    #[schemars(schema_with = "painted")]
    pub diameter: LookValue,
    /// Young's modulus, gigapascals. Default: 3.9.
    #[schemars(schema_with = "painted")]
    pub young_gpa: LookValue,
    /// Poisson's ratio. Default: 0.3.
    pub poisson: f64,
    /// Density, kg/m3. Default: 1300.
    #[schemars(schema_with = "painted")]
    pub density: LookValue,
    /// Internal damping: relaxation time of bending and twisting, seconds. Default: 0.002.
    pub damping: f64,
    /// Factor on bending stiffness. Default: 1.
    #[schemars(schema_with = "painted")]
    pub bend_factor: LookValue,
    /// Factor on twisting stiffness. Default: 1.
    #[schemars(schema_with = "painted")]
    pub twist_factor: LookValue,
    /// Factor on stretching stiffness. Default: 1.
    #[schemars(schema_with = "painted")]
    pub stretch_factor: LookValue,
    /// Factor on the drag of the air. Default: 1.
    #[schemars(schema_with = "painted")]
    pub drag_factor: LookValue,
}

impl Default for Material {
    fn default() -> Self {
        let (m, value) = (pelage_sim::Material::default(), LookValue::constant);
        Material {
            diameter: value(70.0),
            young_gpa: value(3.9),
            poisson: m.poisson,
            density: value(m.density),
            damping: m.damping,
            bend_factor: value(m.bend_factor),
            twist_factor: value(m.twist_factor),
            stretch_factor: value(m.stretch_factor),
            drag_factor: value(m.drag_factor),
        }
    }
}

impl Material {
    /// Values that may vary from hair to hair, by key.
    pub fn varied(&self) -> [(&'static str, &LookValue); 7] {
        [
            ("diameter", &self.diameter),
            ("young_gpa", &self.young_gpa),
            ("density", &self.density),
            ("bend_factor", &self.bend_factor),
            ("twist_factor", &self.twist_factor),
            ("stretch_factor", &self.stretch_factor),
            ("drag_factor", &self.drag_factor),
        ]
    }

    /// Values that are the same for all hairs, by key.
    pub fn even(&self) -> [(&'static str, f64); 2] {
        [("poisson", self.poisson), ("damping", self.damping)]
    }

    /// In SI units, each value that varies times a factor: `factor` has them by key.
    pub fn si(&self, factor: impl Fn(&str) -> f64) -> pelage_sim::Material {
        let of = |key: &str, v: &LookValue| v.at(0.0) * factor(key);
        pelage_sim::Material {
            diameter: of("diameter", &self.diameter) * 1e-6,
            young: of("young_gpa", &self.young_gpa) * 1e9,
            poisson: self.poisson,
            density: of("density", &self.density),
            damping: self.damping,
            bend_factor: of("bend_factor", &self.bend_factor),
            twist_factor: of("twist_factor", &self.twist_factor),
            stretch_factor: of("stretch_factor", &self.stretch_factor),
            drag_factor: of("drag_factor", &self.drag_factor),
        }
    }
}

/// Smallest and largest value of a material's key, and what is usual.
fn material_range(key: &str) -> (f64, f64, &'static str) {
    match key {
        "diameter" => (0.1, 1e5, "human hair has 50 to 100 micrometres"),
        "young_gpa" => (1e-9, 1e4, "hair has 2 to 6 gigapascals"),
        "poisson" => (-0.99, 0.5, "hair has 0.3"),
        "density" => (1e-3, 1e6, "hair has 1300 kg/m3"),
        "damping" => (0.0, 10.0, "0.002 is usual"),
        "drag_factor" => (0.0, 1e9, "1 is the drag of a thread of that diameter"),
        _ => (1e-9, 1e9, "1 is the material as it is"),
    }
}

/// Checks the material at a key of a file.
pub fn check_material<T>(doc: &Document<T>, key: &str, m: &Material) -> Result<(), ConfigError> {
    let even = m.even().map(|(name, x)| (name, vec![x]));
    let each = m.varied().map(|(name, v)| (name, v.0.value.0.iter().map(|k| k.value).collect()));
    for (name, x) in even.into_iter().chain(each) {
        x.into_iter().try_for_each(|x| check_material_value(doc, &format!("{key}.{name}"), x))?;
    }
    for (name, v) in m.varied() {
        let key = format!("{key}.{name}");
        doc.still(&key, v)?;
        doc.check_value(&key, &varied("", v, [f64::MIN, f64::MAX]))?;
    }
    Ok(())
}

/// Checks a value of the material at a key of a file, that of one hair or of all.
pub fn check_material_value<T>(doc: &Document<T>, key: &str, x: f64) -> Result<(), ConfigError> {
    let (low, high, help) = material_range(key.rsplit('.').next().unwrap_or(key));
    range(doc, key, x, low, high, help)
}

fn range<T>(doc: &Document<T>, key: &str, x: f64, low: f64, high: f64, help: &str) -> Result<(), ConfigError> {
    if (low..=high).contains(&x) {
        return Ok(());
    }
    Err(doc.error(key, format!("{x} is out of range: values go from {low} to {high}"), help))
}

impl Document<ShotFile> {
    /// Checks `[simulate]`.
    pub(super) fn check_simulate(&self) -> Result<(), ConfigError> {
        let s = &self.value.simulate;
        let number = |key: &str, x: f64, low: f64, high: f64, help: &str| {
            range(self, &format!("simulate.{key}"), x, low, high, help)
        };
        let segments = s.segments.unwrap_or(SEGMENTS);
        number("segments", segments as f64, 1.0, 4095.0, "25 is usual, 50 is fine")?;
        number("substeps", f64::from(s.substeps.unwrap_or(1)), 1.0, 1e6, "leave it out and it is chosen")?;
        number("tolerance", s.tolerance.unwrap_or(1e-5), 1e-12, 0.1, "0.00001 is usual")?;
        self.check_quality()?;
        number("strain_limit", s.strain_limit, 1e-6, 1e3, "0.01 is one percent")?;
        number("friction", s.friction, 0.0, 100.0, "0.3 is usual")?;
        number("offset", s.offset, 0.0, 1e3, "it is in millimetres; 0.5 is usual")?;
        number("teleport", s.teleport, 1e-9, 1e9, "it is in metres; 1 is usual")?;
        number("checkpoint", f64::from(s.checkpoint), 1.0, 1e6, "24 is usual")?;
        if let Some(material) = &s.material {
            check_material(self, "simulate.material", material)?;
            if let Some((name, _)) = material.varied().iter().find(|(_, v)| v.varies()) {
                let help = "give a number; layers of a groom may have maps";
                return Err(self.error(&format!("simulate.material.{name}"), "can't vary from hair to hair", help));
            }
        }
        let up = self.value.shot.up;
        self.keys("simulate.gravity", &s.gravity.downward(up), 1e6, "9.81 is the earth's, in m/s2")?;
        self.check_body()?;
        let Some(wind) = &s.wind else { return Ok(()) };
        let three = |k: &Keyed<f64>| Keyed(k.0.iter().map(|k| Key { frame: k.frame, value: [k.value; 3] }).collect());
        self.keys("simulate.wind.velocity", &wind.velocity.vectors(), 1e4, "it is in m/s")?;
        self.keys("simulate.wind.gust", &three(&wind.gust), 100.0, "0.3 changes the wind by up to 30 %")?;
        self.keys("simulate.wind.turbulence", &three(&wind.turbulence), 1e4, "it is in m/s")?;
        let d = pelage_sim::Wind::default();
        number("wind.gust_period", wind.gust_period.unwrap_or(d.gust_period), 1e-6, 1e6, "it is in seconds")?;
        number("wind.turbulence_size", wind.turbulence_size.unwrap_or(d.turbulence_size), 1e-6, 1e6, "in metres")?;
        let period = wind.turbulence_period.unwrap_or(d.turbulence_period);
        number("wind.turbulence_period", period, 1e-6, 1e6, "it is in seconds")?;
        number("wind.boundary", wind.boundary.unwrap_or(d.boundary), 0.0, 1e3, "it is in metres")
    }

    fn check_quality(&self) -> Result<(), ConfigError> {
        let s = &self.value.simulate;
        let Some(quality) = &s.quality else { return Ok(()) };
        let set = [
            ("segments", s.segments.is_some()),
            ("substeps", s.substeps.is_some()),
            ("tolerance", s.tolerance.is_some()),
        ];
        if let Some((key, _)) = set.iter().find(|(_, set)| *set) {
            let what = "can't go together with simulate.quality, which chooses it";
            return Err(self.error(&format!("simulate.{key}"), what, "keep one of the two"));
        }
        if self.value.groom.curves.is_some() {
            let what = "is for hair of a groom; this shot takes its hair from a curves file";
            return Err(self.error("simulate.quality", what, "give segments and substeps"));
        }
        let (name, x) = match quality {
            Quality::Error(x) => ("error", *x),
            Quality::Seconds(x) => ("seconds", *x),
        };
        range(
            self,
            &format!("simulate.quality.{name}"),
            x,
            1e-6,
            1e6,
            "error is in millimetres, seconds are of a frame",
        )
    }

    fn check_body(&self) -> Result<(), ConfigError> {
        let b = &self.value.simulate.body;
        for (name, x, low) in [("voxel", b.voxel, 1e-3), ("outside", b.outside, 0.0), ("inside", b.inside, 0.0)] {
            range(self, &format!("simulate.body.{name}"), x, low, 1e6, "it is in millimetres")?;
        }
        for (i, m) in b.mesh.iter().enumerate() {
            let key = format!("simulate.body.mesh[{i}]");
            self.check_motion(&key, m.motion_start, m.pivot)?;
            self.check_axis(&key, m.axis)?;
        }
        self.check_axis("simulate.body", b.axis)?;
        let deforms = self.value.skin.as_ref().is_some_and(|s| s.frames.is_some());
        if b.skin && deforms && b.kind != BodyKind::Field {
            let what = format!("is \"{}\", but the skin deforms, and only fields do", b.kind.name());
            return Err(self.error(
                "simulate.body.kind",
                what,
                "leave it out, and give the meshes a kind of their own",
            ));
        }
        Ok(())
    }

    fn check_axis(&self, key: &str, axis: Option<[[f64; 3]; 2]>) -> Result<(), ConfigError> {
        let Some([from, to]) = axis else { return Ok(()) };
        let finite = from.iter().chain(&to).all(|x| x.abs() <= 1e18);
        if !finite || from == to {
            let help = "two points: from where to where, scene units";
            return Err(self.error(&format!("{key}.axis"), "has no direction", help));
        }
        Ok(())
    }

    fn keys(&self, key: &str, keyed: &Keyed<[f64; 3]>, max: f64, help: &str) -> Result<(), ConfigError> {
        for (i, k) in keyed.0.iter().enumerate() {
            let at = if keyed.0.len() > 1 { format!("{key}[{i}]") } else { key.to_owned() };
            if !k.value.iter().all(|x| x.abs() <= max) {
                return Err(self.error(&at, format!("is out of range: values go from -{max} to {max}"), help));
            }
            if !k.frame.is_finite() || (i > 0 && keyed.0[i - 1].frame >= k.frame) {
                return Err(self.error(&at, "does not come after the key before it", "key frames ascend"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_those_of_the_simulation() {
        let (m, s) = (Material::default().si(|_| 1.0), Simulate::default());
        let d = pelage_sim::Settings::default();
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        assert!(close(m.diameter, d.material.diameter) && close(m.young, d.material.young));
        assert_eq!(
            (s.strain_limit, s.friction, s.teleport, s.sleep),
            (d.strain_limit, d.friction, d.teleport, d.sleep)
        );
        assert!(close(s.offset * 1e-3, d.offset) && d.sag_free);
    }
}
