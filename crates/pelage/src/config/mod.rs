//! Shot and groom files: plain structs, read with their places in the text so that every complaint shows its line.

mod cluster;
mod comb;
mod control;
mod document;
mod groom;
mod guides;
mod joined;
mod keyed;
mod keys;
mod light;
mod look;
mod look_check;
mod look_value;
mod preview;
mod shot;
mod simulate;
mod skip;

pub use cluster::{Cluster, ClusterEdit, ClusterEditKind, ClusterLook, MOST_CLUSTERS, Scalp};
pub use comb::{Comb, CombKind, JointTurn, KeyLength, Side, Space};
pub use control::{Control, ControlHair, ControlLine, Placement};
pub use document::{ConfigError, Document};
pub use groom::{Channel, ColorFeature, Feature, GroomFile, Guard, GuideChoice, Layer, MOST_POINTS, MapRef, Parting};
pub use groom::{WidthFeature, WrapMode};
pub use guides::{Ball, Element, ElementKind, Falloff, Orientation, Panels, Plane, Primitive, Region, Shear};
pub use keyed::{Amount, Key, Keyed, Vector};
pub use keys::KeyFrames;
pub use light::{Light, LightKind, Shadow, ShadowQuality};
pub use look::{
    Clump, ClumpOf, Collision, Curl, CurlKind, CurlWave, Dilation, Emitter, Noise, Operator, Wave, WaveAxis, WaveShape,
    WindLook,
};
pub use look_value::{LookValue, Varied, VariedValue, VaryScale};
pub use preview::{CameraSettings, Preview, PreviewTone, Shade};
pub use shot::{CacheSettings, Export, ExportFormat, GroomRef, Look, LookOverride, Shot, ShotFile, Skin, UpAxis};
pub use simulate::{BodyKind, BodyMesh, BodySettings};
pub use simulate::{
    Material, Quality, SEGMENTS, Simulate, StrandModel, Target, WindSettings, check_material, check_material_value,
};
pub use skip::Skip;

/// JSON Schema (draft 2020-12) of a shot file or a groom file, for editors.
pub fn schema<T: schemars::JsonSchema>() -> String {
    pretty(&schemars::schema_for!(T))
}

fn pretty(schema: &impl serde::Serialize) -> String {
    serde_json::to_string_pretty(schema).expect("a schema is plain JSON") + "\n"
}

/// JSON Schema of groom files as they are written: any may `include` others, any table may be `like` styles, and what is
/// required may then come from there.
pub fn groom_schema() -> String {
    let mut root = serde_json::to_value(schemars::schema_for!(GroomFile)).expect("a schema is plain JSON");
    let names = serde_json::json!({
        "description": "Names of styles that this table has the keys of, except for those that it has itself.",
        "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }]
    });
    let join = |table: &mut serde_json::Value| {
        let Some(table) = table.as_object_mut() else { return };
        table.remove("required");
        if let Some(properties) = table.get_mut("properties").and_then(|p| p.as_object_mut()) {
            properties.insert("like".to_owned(), names.clone());
        }
    };
    join(&mut root);
    if let Some(defs) = root["$defs"].as_object_mut() {
        defs.values_mut().for_each(join);
    }
    if let Some(properties) = root["properties"].as_object_mut() {
        properties.remove("like");
        properties.insert(
            "include".to_owned(),
            serde_json::json!({
                "description": "Groom files that this one is put on top of, each relative to the file that names it.",
                "anyOf": names["anyOf"]
            }),
        );
        properties.insert(
            "style".to_owned(),
            serde_json::json!({
                "description": "Named tables that others may be `like`.",
                "type": "object", "additionalProperties": { "type": "object" }
            }),
        );
    }
    pretty(&root)
}
