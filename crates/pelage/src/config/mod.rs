//! Shot and groom files: plain structs, read with their places in the text so that every complaint shows its line.

mod comb;
mod document;
mod groom;
mod guides;
mod keyed;
mod light;
mod look;
mod look_check;
mod look_value;
mod preview;
mod shot;
mod simulate;
mod skip;

pub use comb::{Comb, CombKind, Side, Space};
pub use document::{ConfigError, Document};
pub use groom::{
    Channel, ColorFeature, Control, Feature, GroomFile, Guard, Layer, MOST_POINTS, MapRef, Parting, Placement,
};
pub use groom::{WidthFeature, WrapMode};
pub use guides::{Ball, Element, ElementKind, Falloff, Orientation, Panels, Plane, Primitive, Region, Shear};
pub use keyed::{Amount, Key, Keyed, Vector};
pub use light::{Light, LightKind, Shadow, ShadowQuality};
pub use look::{
    Clump, ClumpOf, Collision, Curl, CurlKind, CurlWave, Dilation, Emitter, Noise, Operator, Wave, WaveAxis, WaveShape,
    WindLook,
};
pub use look_value::{LookValue, Varied, VariedValue, VaryScale};
pub use preview::{CameraSettings, Preview, PreviewTone, Shade};
pub use shot::{CacheSettings, Export, ExportFormat, GroomRef, Look, LookOverride, Shot, ShotFile, Skin, UpAxis};
pub use simulate::{BodyKind, BodyMesh, BodySettings};
pub use simulate::{Material, Quality, SEGMENTS, Simulate, StrandModel, Target, WindSettings, check_material};
pub use skip::Skip;

/// JSON Schema (draft 2020-12) of a shot file or a groom file, for editors.
pub fn schema<T: schemars::JsonSchema>() -> String {
    let mut text = serde_json::to_string_pretty(&schemars::schema_for!(T)).expect("a schema is plain JSON");
    text.push('\n');
    text
}
