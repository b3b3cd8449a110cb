//! MCAP: a container of time-stamped messages (mcap.dev/spec), used for hair of a shot and for frames in the cache.
//!
//! * [`McapHair`] writes a shot: on topic `/hair/LAYER/topology` one message, on `/hair/LAYER/frames` one a frame. They
//!   are protobuf messages (`pelage.HairTopology`, `pelage.HairFrame`) whose description is in the file, so any MCAP
//!   reader decodes them. A frame that has widths or opacities other than its layer's brings them on topic
//!   `/hair/LAYER/look` (`pelage.HairLook`); files without such frames have no such topic. `log_time` is the time of the
//!   frame in nanoseconds since the first frame, `sequence` the frame number. The facts of the shot are in the metadata record `pelage.shot`.
//! * [`read_hair_mcap`] reads such a file frame by frame, [`verify_layers`] and [`verify_frames`] compare it with what should be in it.
//! * [`write_frame_payload`] and [`read_frame_payload`] hold the positions of one frame and nothing else.
//! * [`write_state_payload`] and [`read_state_payload`] hold the state of a simulation.
//! * [`inspect`] says what is in any MCAP file.
//!
//! Points are not compressed: general compressors take a few percent off single-precision positions and cost four
//! times the time (zstd: 0.89 of the size at a quarter of the speed).

mod inspect;
mod payload;
mod proto;
mod read;
mod record;
mod write;

pub use inspect::{McapChannel, McapSummary, inspect};
pub use payload::{read_frame_payload, read_state_payload, write_frame_payload, write_state_payload};
pub use read::{HairMcap, McapFrame, read_hair_mcap, verify_frames, verify_layers};
pub use write::McapHair;

use super::ShotFacts;
use std::collections::BTreeMap;

const _: () = assert!(cfg!(target_endian = "little"), "arrays are written as they lie in memory");

/// Name of the metadata record with the facts of the shot.
const SHOT: &str = "pelage.shot";
/// Entry of that record with a checksum of the others.
const CHECKSUM: &str = "crc32";
/// Chunks end after the message that makes them longer than this, so that a large frame is a chunk of its own.
const CHUNK: u64 = 1 << 20;

/// Entry of the facts with the names of the lights, where there are some.
const LIGHTS: &str = "lights";

/// Time of frame number `frame` in nanoseconds since the first one.
fn log_time(facts: &ShotFacts, frame: i32) -> u64 {
    let first = facts.frames.first().copied().unwrap_or(frame);
    (1e9 * (f64::from(frame) - f64::from(first)) / facts.fps).round() as u64
}

/// The facts as the map of a metadata record. Facts of the user's are kept under "extra.NAME".
fn facts_to_map(facts: &ShotFacts, layers: usize) -> BTreeMap<String, String> {
    let list = |v: &[String]| v.join(" ");
    let own = [
        ("name", facts.name.clone()),
        ("meters_per_unit", facts.meters_per_unit.to_string()),
        ("up", facts.up.to_string()),
        ("fps", facts.fps.to_string()),
        ("frames", list(&facts.frames.iter().map(i32::to_string).collect::<Vec<_>>())),
        ("origin", list(&facts.origin.map(|x| x.to_string()))),
        ("layers", layers.to_string()),
        ("positions", "scene units, relative to origin, root first".to_string()),
        ("widths", "diameters, scene units".to_string()),
        ("velocities", "scene units per second".to_string()),
    ];
    let extra = facts.extra.iter().map(|(k, v)| (format!("extra.{k}"), v.clone()));
    let lights = (!facts.lights.is_empty()).then(|| (LIGHTS, list(&facts.lights)));
    let own = own.into_iter().chain(lights);
    let mut map: BTreeMap<String, String> = own.map(|(k, v)| (k.to_owned(), v)).chain(extra).collect();
    map.insert(CHECKSUM.to_owned(), checksum(&map));
    map
}

/// CRC-32 of all entries but itself: MCAP has no checksum for a metadata record.
fn checksum(map: &BTreeMap<String, String>) -> String {
    let mut hash = crc32fast::Hasher::new();
    for (key, value) in map.iter().filter(|(k, _)| *k != CHECKSUM) {
        for text in [key, value] {
            hash.update(&(text.len() as u64).to_le_bytes());
            hash.update(text.as_bytes());
        }
    }
    format!("{:08x}", hash.finalize())
}

/// The facts and the number of layers of a metadata record, or what is wrong with it. Extra facts come sorted by name.
fn facts_from_map(map: &BTreeMap<String, String>) -> Result<(ShotFacts, usize), String> {
    let text = |key: &str| map.get(key).ok_or_else(|| format!("the record {SHOT} has no {key}"));
    if *text(CHECKSUM)? != checksum(map) {
        return Err(format!("the checksum of the record {SHOT} is wrong: the file is damaged"));
    }
    fn parse<T: std::str::FromStr>(key: &str, text: &str) -> Result<T, String> {
        text.parse().map_err(|_| format!("the record {SHOT} has {key} = {text:?}"))
    }
    let positive = |key: &str| match parse::<f64>(key, text(key)?)? {
        v if v.is_finite() && v > 0.0 => Ok(v),
        v => Err(format!("the record {SHOT} has {key} = {v}")),
    };
    let frames: Vec<i32> = text("frames")?.split(' ').map(|f| parse("frames", f)).collect::<Result<_, _>>()?;
    if frames.windows(2).any(|w| w[0] >= w[1]) {
        return Err(format!("the frames in the record {SHOT} do not ascend"));
    }
    let origin: Vec<f64> = text("origin")?.split(' ').map(|x| parse("origin", x)).collect::<Result<_, _>>()?;
    let extra = map.iter().filter_map(|(k, v)| Some((k.strip_prefix("extra.")?.to_owned(), v.clone())));
    let facts = ShotFacts {
        name: text("name")?.clone(),
        meters_per_unit: positive("meters_per_unit")?,
        up: parse("up", text("up")?)?,
        fps: positive("fps")?,
        frames,
        origin: origin.try_into().map_err(|_| format!("the origin in the record {SHOT} is not three numbers"))?,
        lights: map.get(LIGHTS).map_or(vec![], |l| l.split(' ').map(str::to_owned).collect()),
        extra: extra.collect(),
    };
    Ok((facts, parse("layers", text("layers")?)?))
}
