//! Hair of a shot as an MCAP file.

use super::{CHUNK, SHOT, facts_to_map, log_time, proto};
use crate::format::check::{ShotCheck, write_error};
use crate::format::{FormatError, HairFrame, HairLayer, ShotFacts};
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, McapResult, WriteOptions, Writer};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Longest protobuf message that every reader takes.
const MAX_MESSAGE: usize = i32::MAX as usize;

/// A shot being written, see the module. The file is whole only after [`McapHair::finish`]; one that is dropped before
/// has no end and cannot be opened.
pub struct McapHair {
    path: PathBuf,
    facts: ShotFacts,
    check: ShotCheck,
    /// `None` once finished or given up.
    out: Option<Writer<BufWriter<File>>>,
    /// Channel of the frames of each layer.
    channels: Vec<u16>,
    /// Names of the layers, and the channels of their looks once a frame has brought one.
    looks: Vec<(String, Option<u16>)>,
    buffer: Vec<u8>,
}

impl McapHair {
    /// Starts `path` and writes the facts and the topology of all layers.
    pub fn create(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Result<Self, FormatError> {
        let check = ShotCheck::new(path, facts, layers)?;
        let file = File::create(path).map_err(|e| write_error(path, &e))?;
        let out = BufWriter::with_capacity(1 << 20, file);
        let out = options().create(out).map_err(|e| mcap_error(path, e))?;
        let (path, facts) = (path.to_path_buf(), facts.clone());
        let looks = layers.iter().map(|l| (l.name.clone(), None)).collect();
        let mut hair = McapHair { path, facts, check, out: Some(out), channels: vec![], looks, buffer: vec![] };
        hair.write_start(layers)?;
        Ok(hair)
    }

    fn write_start(&mut self, layers: &[HairLayer]) -> Result<(), FormatError> {
        // Metadata goes before the channels: after them it would end the chunk that they start.
        let metadata = Metadata { name: SHOT.to_owned(), metadata: facts_to_map(&self.facts, layers.len()) };
        self.write(|out| out.write_metadata(&metadata))?;
        let descriptor = proto::descriptor();
        let mut topologies = vec![];
        for (i, layer) in layers.iter().enumerate() {
            for (schema, part) in [(proto::TOPOLOGY, "topology"), (proto::FRAME, "frames")] {
                let channel = self.add_channel(&layer.name, i, part, schema, &descriptor)?;
                if part == "frames" { self.channels.push(channel) } else { topologies.push(channel) }
            }
        }
        let first = self.facts.frames.first().copied().unwrap_or(0);
        for (layer, channel) in layers.iter().zip(topologies) {
            let message = proto::encode_layer(layer);
            self.write_message(channel, first, &message)?;
        }
        Ok(())
    }

    fn add_channel(
        &mut self,
        layer: &str,
        index: usize,
        part: &str,
        schema: &str,
        descriptor: &[u8],
    ) -> Result<u16, FormatError> {
        let topic = format!("/hair/{layer}/{part}");
        let facts = [("layer", layer.to_owned()), ("index", index.to_string()), ("part", part.to_owned())];
        let facts = facts.into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
        self.write(|out| {
            let schema = out.add_schema(schema, "protobuf", descriptor)?;
            out.add_channel(schema, &topic, "protobuf", &facts)
        })
    }

    /// Writes the next frame, with one entry for each layer.
    pub fn write_frame(&mut self, frame: i32, layers: &[HairFrame]) -> Result<(), FormatError> {
        self.check.frame(frame, layers)?;
        let mut buffer = std::mem::take(&mut self.buffer);
        let first = self.facts.frames.first().copied().unwrap_or(frame);
        let time = (f64::from(frame) - f64::from(first)) / self.facts.fps;
        for (i, data) in layers.iter().enumerate() {
            proto::encode_frame(&mut buffer, frame, time, &self.facts.origin, data);
            self.write_message(self.channels[i], frame, &buffer)?;
            if !(data.width.is_empty() && data.opacity.is_empty() && data.transmittance.is_empty()) {
                let channel = self.look_channel(i)?;
                proto::encode_look(&mut buffer, frame, data);
                self.write_message(channel, frame, &buffer)?;
            }
        }
        self.buffer = buffer;
        Ok(())
    }

    /// The channel of a layer's looks, added when the first one comes.
    fn look_channel(&mut self, i: usize) -> Result<u16, FormatError> {
        if let Some(channel) = self.looks[i].1 {
            return Ok(channel);
        }
        let name = self.looks[i].0.clone();
        let channel = self.add_channel(&name, i, "look", proto::LOOK, &proto::look_descriptor())?;
        self.looks[i].1 = Some(channel);
        Ok(channel)
    }

    fn write_message(&mut self, channel_id: u16, frame: i32, data: &[u8]) -> Result<(), FormatError> {
        if data.len() > MAX_MESSAGE {
            let what = format!("a layer has {} bytes a frame, readers take at most {MAX_MESSAGE}", data.len());
            return Err(FormatError::new(&self.path, what).hint("split the layer, or export to USD"));
        }
        let time = log_time(&self.facts, frame);
        let header = MessageHeader { channel_id, sequence: frame as u32, log_time: time, publish_time: time };
        self.write(|out| out.write_to_known_channel(&header, data))
    }

    fn write<T>(&mut self, act: impl FnOnce(&mut Writer<BufWriter<File>>) -> McapResult<T>) -> Result<T, FormatError> {
        match &mut self.out {
            Some(out) => act(out).map_err(|e| mcap_error(&self.path, e)),
            None => Err(FormatError::new(&self.path, "is already finished")),
        }
    }

    /// Completes the file. An error if a frame of the shot is missing.
    pub fn finish(mut self) -> Result<(), FormatError> {
        self.check.finish()?;
        self.write(|out| out.finish())?;
        match self.out.take().map(|out| out.into_inner().into_inner()) {
            Some(Err(e)) => Err(write_error(&self.path, e.error())),
            _ => Ok(()),
        }
    }
}

impl Drop for McapHair {
    /// Lets go of the file without the end that the crate's own `Drop` would write.
    fn drop(&mut self) {
        drop(self.out.take().map(Writer::into_inner));
    }
}

/// Everything that could differ between machines or versions of the crate is pinned.
pub(super) fn options() -> WriteOptions {
    WriteOptions::new()
        .library("pelage")
        .profile("")
        .compression(None)
        .compression_threads(0)
        .chunk_size(Some(CHUNK))
        .use_chunks(true)
        .calculate_chunk_crcs(true)
        .calculate_data_section_crc(true)
        .calculate_summary_section_crc(true)
}

fn mcap_error(path: &Path, error: McapError) -> FormatError {
    match error {
        McapError::Io(e) => write_error(path, &e),
        other => FormatError::new(path, format!("could not be written: {other}")),
    }
}
