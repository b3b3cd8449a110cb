//! The positions of one frame, as the cache keeps them: an MCAP file with one message of raw single-precision numbers
//! a layer. It has no checksums of its own; who keeps it hashes the whole.

use super::record::{self, MAGIC, Record};
use super::write::options;
use crate::format::bytes::Bytes;
use mcap::records::MessageHeader;
use mcap::{McapError, McapResult};
use std::io::{self, Seek, Write};

/// How messages are encoded: numbers x, y, z, x, ... as little-endian single precision.
const ENCODING: &str = "pelage-f32le-xyz";

/// Writes the positions of all layers of frame `frame` to `out`; `name` is the topic.
pub fn write_frame_payload(out: impl Write + Seek, name: &str, frame: i32, layers: &[&[[f32; 3]]]) -> io::Result<()> {
    let options = options().calculate_chunk_crcs(false).calculate_data_section_crc(false);
    let mut writer = options.calculate_summary_section_crc(false).create(out).map_err(io_error)?;
    let facts = [("frame", frame.to_string()), ("layers", layers.len().to_string())];
    let facts = facts.into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
    let mut fill = || -> McapResult<()> {
        let channel_id = writer.add_channel(0, name, ENCODING, &facts)?;
        for (i, layer) in layers.iter().enumerate() {
            let header = MessageHeader { channel_id, sequence: i as u32, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, bytemuck::cast_slice(layer))?;
        }
        writer.finish().map(drop)
    };
    let done = fill().map_err(io_error);
    // Not left to its `Drop`, which would complete a file that failed.
    let flushed = writer.into_inner().flush();
    done.and(flushed)
}

/// How a state is encoded: bytes that mean something to who wrote them.
const STATE: &str = "pelage-state";

/// The state of a step after a frame as an MCAP file with one message.
pub fn write_state_payload(name: &str, frame: i64, state: &[u8]) -> Vec<u8> {
    let options = options().calculate_chunk_crcs(false).calculate_data_section_crc(false);
    let fill = || -> McapResult<Vec<u8>> {
        let out = io::Cursor::new(Vec::with_capacity(state.len() + 4096));
        let mut writer = options.calculate_summary_section_crc(false).create(out)?;
        let facts = [("frame".to_owned(), frame.to_string())].into_iter().collect();
        let channel_id = writer.add_channel(0, name, STATE, &facts)?;
        let header = MessageHeader { channel_id, sequence: 0, log_time: 0, publish_time: 0 };
        writer.write_to_known_channel(&header, state)?;
        writer.finish()?;
        Ok(writer.into_inner().into_inner())
    };
    fill().expect("writing to memory does not fail")
}

/// Reads what [`write_state_payload`] wrote.
pub fn read_state_payload(bytes: &[u8]) -> Result<Vec<u8>, String> {
    fn message(bytes: &[u8]) -> Result<Option<Vec<u8>>, String> {
        let mut input = Bytes::new(bytes);
        while let Some((code, body)) = record::next(&mut input)? {
            match record::parse(code, body)? {
                Record::Chunk(chunk) if chunk.compression.is_empty() => {
                    if let Some(found) = message(&chunk.records()?)? {
                        return Ok(Some(found));
                    }
                }
                Record::Channel(c) if c.encoding != STATE => return Err("holds something else than a state".into()),
                Record::Message(m) => return Ok(Some(m.data.to_vec())),
                _ => {}
            }
        }
        Ok(None)
    }
    let inner = bytes.strip_prefix(MAGIC).and_then(|b| b.strip_suffix(MAGIC));
    message(inner.ok_or("is not an MCAP file, or not a whole one")?)?.ok_or("has no state".to_owned())
}

/// Reads what [`write_frame_payload`] wrote: the positions of every layer. The error says what is wrong.
pub fn read_frame_payload(bytes: &[u8]) -> Result<Vec<Vec<[f32; 3]>>, String> {
    let inner = bytes.strip_prefix(MAGIC).and_then(|b| b.strip_suffix(MAGIC));
    let mut payload = Payload { layers: vec![], announced: None };
    payload.records(inner.ok_or("is not an MCAP file, or not a whole one")?)?;
    match payload.announced {
        Some(n) if n == payload.layers.len() => Ok(payload.layers),
        Some(n) => Err(format!("{n} layers are announced, {} are there", payload.layers.len())),
        None => Err("has no positions".into()),
    }
}

struct Payload {
    layers: Vec<Vec<[f32; 3]>>,
    announced: Option<usize>,
}

impl Payload {
    fn records(&mut self, bytes: &[u8]) -> Result<(), String> {
        let mut input = Bytes::new(bytes);
        while let Some((code, body)) = record::next(&mut input)? {
            match record::parse(code, body)? {
                Record::Chunk(chunk) if chunk.compression.is_empty() => self.records(&chunk.records()?)?,
                Record::Channel(c) if c.encoding == ENCODING => {
                    self.announced = c.metadata.get("layers").and_then(|n| n.parse().ok());
                }
                Record::Message(m) if m.data.len().is_multiple_of(12) => {
                    if m.sequence as usize != self.layers.len() {
                        return Err(format!("layer {} comes at place {}", m.sequence, self.layers.len()));
                    }
                    let mut layer = vec![[0f32; 3]; m.data.len() / 12];
                    bytemuck::cast_slice_mut(&mut layer).copy_from_slice(m.data);
                    self.layers.push(layer);
                }
                Record::Message(_) | Record::Chunk(_) => return Err("holds something else than positions".into()),
                Record::DataEnd { .. } => return Ok(()),
                _ => {}
            }
        }
        Ok(())
    }
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(e) => e,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn write(layers: &[&[[f32; 3]]]) -> Vec<u8> {
        let mut out = Cursor::new(vec![]);
        write_frame_payload(&mut out, "hair", 1001, layers).unwrap();
        out.into_inner()
    }

    #[test]
    fn positions_come_back_bit_by_bit() {
        let a: Vec<[f32; 3]> = (0..500).map(|i| [i as f32 * 0.1, -0.0, f32::MIN_POSITIVE]).collect();
        let b: Vec<[f32; 3]> = (0..100_000).map(|i| [i as f32, 0.5, 1.0]).collect();
        for layers in [&[&a[..], &[], &b[..], &a[..1]][..], &[&[]], &[]] {
            let bytes = write(layers);
            assert_eq!(bytes, write(layers));
            let back = read_frame_payload(&bytes).unwrap();
            assert!(back.iter().map(Vec::as_slice).eq(layers.iter().copied()));
        }
    }

    #[test]
    fn states_come_back_byte_by_byte() {
        for n in [0, 1, 5000, 3_000_000] {
            let state: Vec<u8> = (0..n).map(|i: u32| (i * 7) as u8).collect();
            let bytes = write_state_payload("state", -12, &state);
            assert_eq!(read_state_payload(&bytes).unwrap(), state);
            assert!(read_state_payload(&bytes[..bytes.len() - 1]).is_err());
        }
        assert!(read_state_payload(&write(&[])).is_err());
    }

    #[test]
    fn a_part_of_it_is_refused() {
        let points = [[1.0, 2.0, 3.0]; 9];
        let bytes = write(&[&points, &points[..2]]);
        for n in 0..bytes.len() {
            assert!(read_frame_payload(&bytes[..n]).is_err(), "{n} bytes");
        }
        for i in 0..bytes.len() {
            let mut bad = bytes.clone();
            bad[i] ^= 0xff;
            let _ = read_frame_payload(&bad);
        }
    }

    #[test]
    fn a_full_disk_is_an_error() {
        struct Full(Cursor<Vec<u8>>);
        impl Write for Full {
            fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
                if self.0.position() > 300 { Err(io::ErrorKind::StorageFull.into()) } else { self.0.write(buf) }
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        impl Seek for Full {
            fn seek(&mut self, pos: io::SeekFrom) -> io::Result<u64> {
                self.0.seek(pos)
            }
        }
        let points = [[1.0, 2.0, 3.0]; 100];
        let mut out = Full(Cursor::new(vec![]));
        assert!(write_frame_payload(&mut out, "hair", 1, &[&points, &points]).is_err());
        assert!(!out.0.into_inner().ends_with(MAGIC));
    }
}
