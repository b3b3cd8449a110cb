//! The protobuf messages of hair, written by hand: two messages of packed numbers need no code generator.

use crate::format::bytes::{Broken, Bytes};
use crate::format::{HairFrame, HairLayer};
use bytemuck::Pod;
use pelage_geom::Offsets;

/// Types of fields in a description (`google.protobuf.FieldDescriptorProto.Type`).
#[derive(Clone, Copy, PartialEq)]
#[repr(u8)]
enum Kind {
    Double = 1,
    Float = 2,
    Int32 = 5,
    Fixed64 = 6,
    String = 9,
    UInt32 = 13,
    SFixed32 = 15,
}

/// A field: name, type, repeated. Its number is its place in the list, from 1.
type Field = (&'static str, Kind, bool);

pub(super) const TOPOLOGY: &str = "pelage.HairTopology";
pub(super) const FRAME: &str = "pelage.HairFrame";
pub(super) const LOOK: &str = "pelage.HairLook";

/// C curves with V points: counts (C), id (C), root_uv (2 C), skin_face and skin_bary (C and 2 C, or none), rest (3 V),
/// width (V), color (3 C: one a curve, or 3 V: one a point), opacity (C).
const TOPOLOGY_FIELDS: [Field; 10] = [
    ("name", Kind::String, false),
    ("counts", Kind::UInt32, true),
    ("id", Kind::Fixed64, true),
    ("root_uv", Kind::Float, true),
    ("skin_face", Kind::SFixed32, true),
    ("skin_bary", Kind::Float, true),
    ("rest", Kind::Float, true),
    ("width", Kind::Float, true),
    ("color", Kind::Float, true),
    ("opacity", Kind::Float, true),
];

/// frame, time (seconds since the first frame), origin (3), position and velocity (3 V each).
const FRAME_FIELDS: [Field; 5] = [
    ("frame", Kind::Int32, false),
    ("time", Kind::Double, false),
    ("origin", Kind::Double, true),
    ("position", Kind::Float, true),
    ("velocity", Kind::Float, true),
];

/// What a frame has beside or instead of the layer's columns: frame, width (V, or none), opacity (C, or none),
/// transmittance (V of all lights together and V of each light, or none).
const LOOK_FIELDS: [Field; 4] = [
    ("frame", Kind::Int32, false),
    ("width", Kind::Float, true),
    ("opacity", Kind::Float, true),
    ("transmittance", Kind::Float, true),
];

/// Builds a protobuf message in a buffer.
#[derive(Default)]
struct Writer(Vec<u8>);

impl Writer {
    fn varint(&mut self, mut v: u64) {
        while v >= 0x80 {
            self.0.push(v as u8 | 0x80);
            v >>= 7;
        }
        self.0.push(v as u8);
    }

    fn number(&mut self, field: u64, v: u64) {
        self.varint(field << 3);
        self.varint(v);
    }

    fn bytes(&mut self, field: u64, bytes: &[u8]) {
        self.varint(field << 3 | 2);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
    }

    /// Numbers as they lie in memory; nothing if there are none.
    fn packed<T: Pod>(&mut self, field: u64, values: &[T]) {
        if !values.is_empty() {
            self.bytes(field, bytemuck::cast_slice(values));
        }
    }
}

/// The description of topology and frame: a serialised `google.protobuf.FileDescriptorSet`.
pub(super) fn descriptor() -> Vec<u8> {
    describe("pelage/hair.proto", &[("HairTopology", &TOPOLOGY_FIELDS), ("HairFrame", &FRAME_FIELDS)])
}

/// The description of a look, apart so that files without looks are what they were before there were any.
pub(super) fn look_descriptor() -> Vec<u8> {
    describe("pelage/look.proto", &[("HairLook", &LOOK_FIELDS)])
}

fn describe(file_name: &str, messages: &[(&str, &[Field])]) -> Vec<u8> {
    let message = |name: &str, fields: &[Field]| {
        let mut out = Writer::default();
        out.bytes(1, name.as_bytes());
        for (i, (name, kind, repeated)) in fields.iter().enumerate() {
            let mut field = Writer::default();
            field.bytes(1, name.as_bytes());
            field.number(3, i as u64 + 1);
            field.number(4, if *repeated { 3 } else { 1 });
            field.number(5, *kind as u64);
            out.bytes(2, &field.0);
        }
        out.0
    };
    let mut file = Writer::default();
    file.bytes(1, file_name.as_bytes());
    file.bytes(2, b"pelage");
    messages.iter().for_each(|(name, fields)| file.bytes(4, &message(name, fields)));
    file.bytes(12, b"proto3");
    let mut set = Writer::default();
    set.bytes(1, &file.0);
    set.0
}

/// A layer as a `HairTopology` message.
pub(super) fn encode_layer(layer: &HairLayer) -> Vec<u8> {
    let mut counts = Writer::default();
    layer.offsets.counts().for_each(|n| counts.varint(n as u64));
    let mut out = Writer::default();
    out.bytes(1, layer.name.as_bytes());
    out.packed(2, &counts.0);
    out.packed(3, &layer.id);
    out.packed(4, &layer.root_uv);
    out.packed(5, &layer.skin_face);
    out.packed(6, &layer.skin_bary);
    out.packed(7, &layer.rest);
    out.packed(8, &layer.width);
    out.packed(9, &layer.color);
    out.packed(10, &layer.opacity);
    out.0
}

/// A frame as a `HairFrame` message, in `out`, whose memory is used again.
pub(super) fn encode_frame(out: &mut Vec<u8>, frame: i32, time: f64, origin: &[f64; 3], data: &HairFrame) {
    out.clear();
    let mut writer = Writer(std::mem::take(out));
    writer.number(1, i64::from(frame) as u64);
    writer.varint(2 << 3 | 1);
    writer.0.extend(time.to_le_bytes());
    writer.packed(3, origin);
    writer.packed(4, data.position);
    writer.packed(5, data.velocity);
    *out = writer.0;
}

/// Widths, opacities and transmittance of a frame as a `HairLook` message, in `out`, whose memory is used again.
pub(super) fn encode_look(out: &mut Vec<u8>, frame: i32, data: &HairFrame) {
    out.clear();
    let mut writer = Writer(std::mem::take(out));
    writer.number(1, i64::from(frame) as u64);
    writer.packed(2, data.width);
    writer.packed(3, data.opacity);
    let values: usize = data.transmittance.iter().map(Vec::len).sum();
    if values > 0 {
        writer.varint(4 << 3 | 2);
        writer.varint(4 * values as u64);
        data.transmittance.iter().for_each(|c| writer.0.extend_from_slice(bytemuck::cast_slice(c)));
    }
    *out = writer.0;
}

fn varint(input: &mut Bytes) -> Result<u64, Broken> {
    let mut value = 0u64;
    for shift in (0..70).step_by(7) {
        let byte = input.u8()?;
        value |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
        if byte & 0x80 == 0 {
            return Ok(value);
        }
    }
    Err("a number has no end".into())
}

/// A field of a message as it is stored.
enum Value<'a> {
    Number(u64),
    Bytes(&'a [u8]),
}

/// Calls `take` with the number and the value of every field.
fn fields<'a>(message: &'a [u8], mut take: impl FnMut(u64, Value<'a>) -> Result<(), Broken>) -> Result<(), Broken> {
    let mut input = Bytes::new(message);
    while !input.rest().is_empty() {
        let tag = varint(&mut input)?;
        let value = match tag & 7 {
            0 => Value::Number(varint(&mut input)?),
            1 => Value::Number(input.u64()?),
            2 => {
                let len = varint(&mut input)?;
                Value::Bytes(input.take(len)?)
            }
            5 => Value::Number(u64::from(input.u32()?)),
            other => return Err(format!("a field has the unknown wire type {other}")),
        };
        take(tag >> 3, value)?;
    }
    Ok(())
}

/// Appends packed numbers to a column.
fn unpack<T: Pod>(column: &mut Vec<T>, bytes: &[u8]) -> Result<(), Broken> {
    let size = size_of::<T>();
    if !bytes.len().is_multiple_of(size) {
        return Err(format!("a column has {} bytes, not a multiple of {size}", bytes.len()));
    }
    let old = column.len();
    column.resize(old + bytes.len() / size, T::zeroed());
    bytemuck::cast_slice_mut(&mut column[old..]).copy_from_slice(bytes);
    Ok(())
}

/// Decodes a `HairTopology` message.
pub(super) fn decode_layer(message: &[u8]) -> Result<HairLayer, Broken> {
    let mut layer = HairLayer::default();
    let mut counts = vec![];
    fields(message, |field, value| {
        let Value::Bytes(bytes) = value else { return Ok(()) };
        match field {
            1 => layer.name = str::from_utf8(bytes).map_err(|_| "the name of a layer is not UTF-8")?.to_owned(),
            2 => {
                let mut input = Bytes::new(bytes);
                while !input.rest().is_empty() {
                    counts.push(varint(&mut input)?);
                }
            }
            3 => unpack(&mut layer.id, bytes)?,
            4 => unpack(&mut layer.root_uv, bytes)?,
            5 => unpack(&mut layer.skin_face, bytes)?,
            6 => unpack(&mut layer.skin_bary, bytes)?,
            7 => unpack(&mut layer.rest, bytes)?,
            8 => unpack(&mut layer.width, bytes)?,
            9 => unpack(&mut layer.color, bytes)?,
            10 => unpack(&mut layer.opacity, bytes)?,
            _ => {}
        }
        Ok(())
    })?;
    let total = counts.iter().fold(0u64, |sum, &n| sum.saturating_add(n));
    if total != layer.rest.len() as u64 || total > u64::from(u32::MAX) {
        return Err(format!("the counts add up to {total} points, {} are there", layer.rest.len()));
    }
    layer.offsets = Offsets::from_counts(counts.into_iter().map(|n| n as usize));
    Ok(layer)
}

/// A decoded `HairFrame` message.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Frame {
    pub(super) frame: i32,
    pub(super) time: f64,
    pub(super) origin: Vec<f64>,
    pub(super) position: Vec<[f32; 3]>,
    pub(super) velocity: Vec<[f32; 3]>,
}

/// Decodes a `HairFrame` message.
pub(super) fn decode_frame(message: &[u8]) -> Result<Frame, Broken> {
    let mut out = Frame::default();
    fields(message, |field, value| {
        match (field, value) {
            (1, Value::Number(n)) => out.frame = n as i32,
            (2, Value::Number(n)) => out.time = f64::from_bits(n),
            (3, Value::Bytes(b)) => unpack(&mut out.origin, b)?,
            (4, Value::Bytes(b)) => unpack(&mut out.position, b)?,
            (5, Value::Bytes(b)) => unpack(&mut out.velocity, b)?,
            _ => {}
        }
        Ok(())
    })?;
    Ok(out)
}

/// A decoded `HairLook` message.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Look {
    pub(super) frame: i32,
    pub(super) width: Vec<f32>,
    pub(super) opacity: Vec<f32>,
    pub(super) transmittance: Vec<f32>,
}

/// Decodes a `HairLook` message.
pub(super) fn decode_look(message: &[u8]) -> Result<Look, Broken> {
    let mut out = Look::default();
    fields(message, |field, value| {
        match (field, value) {
            (1, Value::Number(n)) => out.frame = n as i32,
            (2, Value::Bytes(b)) => unpack(&mut out.width, b)?,
            (3, Value::Bytes(b)) => unpack(&mut out.opacity, b)?,
            (4, Value::Bytes(b)) => unpack(&mut out.transmittance, b)?,
            _ => {}
        }
        Ok(())
    })?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_back() {
        let (_, layers) = crate::format::check::samples::shot();
        for layer in &layers {
            assert_eq!(&decode_layer(&encode_layer(layer)).unwrap(), layer);
        }
        let (position, velocity) = (vec![[1.0, 2.0, 3.0], [-4.0, 5.5, 6.0]], vec![[0.0; 3]; 2]);
        let mut bytes = vec![1, 2, 3];
        let light = [vec![0.25, 0.5], vec![0.75, 1.0]];
        let (width, opacity) = (vec![0.5, 0.25], vec![0.75]);
        let data = HairFrame {
            position: &position,
            velocity: &velocity,
            width: &width,
            opacity: &opacity,
            transmittance: &light,
        };
        encode_look(&mut bytes, -7, &data);
        let transmittance = light.concat();
        let look = Look { frame: -7, width: width.clone(), opacity: opacity.clone(), transmittance };
        assert_eq!(decode_look(&bytes).unwrap(), look);
        encode_frame(&mut bytes, -5, 0.125, &[1.0, 0.0, 2.0], &data);
        let back = decode_frame(&bytes).unwrap();
        assert_eq!(back, Frame { frame: -5, time: 0.125, origin: vec![1.0, 0.0, 2.0], position, velocity });
    }

    #[test]
    fn broken_messages_are_errors_or_read() {
        let (_, layers) = crate::format::check::samples::shot();
        let good = encode_layer(&layers[0]);
        for i in 0..good.len() {
            let mut bad = good.clone();
            bad[i] ^= 0xa5;
            let _ = decode_layer(&bad);
            let _ = decode_layer(&good[..i]);
            let _ = decode_frame(&bad);
            let _ = decode_look(&bad);
        }
        assert!(decode_layer(&[0xff; 20]).is_err());
        // A list that claims more bytes than there are.
        assert!(decode_frame(&[4 << 3 | 2, 0xff, 0xff, 0xff, 0xff, 0x0f, 1, 2]).is_err());
    }
}
