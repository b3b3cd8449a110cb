//! What is in an MCAP file, any file.

use super::record::{self, HEAD, MAGIC, Record};
use crate::format::FormatError;
use crate::format::bytes::{Broken, Bytes};
use crate::format::check::read_error;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// One channel of an MCAP file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct McapChannel {
    /// Topic.
    pub topic: String,
    /// How messages are encoded ("protobuf", "json", ...).
    pub encoding: String,
    /// Name of the schema, empty without one.
    pub schema: String,
    /// How the schema is encoded.
    pub schema_encoding: String,
    /// Number of messages.
    pub messages: u64,
    /// Bytes of all messages.
    pub bytes: u64,
}

/// What is in an MCAP file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct McapSummary {
    /// Profile of the file.
    pub profile: String,
    /// Program that wrote it.
    pub library: String,
    /// Channels by number.
    pub channels: BTreeMap<u16, McapChannel>,
    /// Number of messages.
    pub messages: u64,
    /// Earliest and latest log time in nanoseconds, if there are messages.
    pub time: Option<[u64; 2]>,
    /// Metadata records: name and contents.
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
    /// Attachments: name, media type, bytes.
    pub attachments: Vec<(String, String, u64)>,
    /// Number of chunks.
    pub chunks: u64,
}

/// Reads a whole MCAP file once, one record at a time, compares every checksum and says what is in it. A file that is
/// damaged or does not end as it should is an error.
pub fn inspect(path: &Path) -> Result<McapSummary, FormatError> {
    let file = File::open(path).map_err(|e| read_error(path, &e))?;
    let len = file.metadata().map_err(|e| read_error(path, &e))?.len();
    let mut scan = Scan {
        input: BufReader::with_capacity(1 << 16, file),
        left: len,
        hash: crc32fast::Hasher::new(),
        summary: McapSummary::default(),
        schemas: BTreeMap::new(),
        body: vec![],
    };
    scan.run().map_err(|what| FormatError::new(path, what).at(format!("byte {}", len - scan.left)))?;
    Ok(scan.summary)
}

struct Scan {
    input: BufReader<File>,
    /// Bytes of the file not yet read.
    left: u64,
    /// Checksum of the part that the record at its end covers.
    hash: crc32fast::Hasher,
    summary: McapSummary,
    schemas: BTreeMap<u16, (String, String)>,
    body: Vec<u8>,
}

impl Scan {
    fn run(&mut self) -> Result<(), Broken> {
        self.magic()?;
        let mut in_data = true;
        loop {
            let mut head = [0; HEAD as usize];
            self.read(&mut head)?;
            let mut b = Bytes::new(&head);
            let (code, len) = (b.u8()?, b.u64()?);
            if len > self.left {
                return Err("the file ends in the middle of a record: it was not written to the end".into());
            }
            let mut body = std::mem::take(&mut self.body);
            body.resize(len as usize, 0);
            self.read(&mut body)?;
            let parsed = record::parse(code, &body)?;
            match &parsed {
                Record::DataEnd { crc } => {
                    self.compare("data section", *crc)?;
                    self.hash = crc32fast::Hasher::new();
                    in_data = false;
                }
                Record::Footer { summary_crc, .. } => {
                    self.hash.update(&head);
                    self.hash.update(&body[..body.len().min(16)]);
                    self.compare("summary", *summary_crc)?;
                    return self.magic();
                }
                _ => {
                    self.hash.update(&head);
                    self.hash.update(&body);
                    if in_data {
                        self.take(parsed)?;
                    }
                }
            }
            self.body = body;
        }
    }

    fn compare(&self, what: &str, saved: u32) -> Result<(), Broken> {
        let found = self.hash.clone().finalize();
        if saved == 0 || saved == found { Ok(()) } else { Err(format!("the checksum of the {what} is wrong")) }
    }

    fn magic(&mut self) -> Result<(), Broken> {
        let mut magic = [0; 8];
        self.read(&mut magic)?;
        self.hash.update(&magic);
        if &magic == MAGIC { Ok(()) } else { Err("is not an MCAP file (the mark is missing)".into()) }
    }

    fn read(&mut self, out: &mut [u8]) -> Result<(), Broken> {
        if out.len() as u64 > self.left {
            return Err("the file ends too early: it was not written to the end".into());
        }
        self.left -= out.len() as u64;
        self.input.read_exact(out).map_err(|e| format!("could not be read: {e}"))
    }

    fn take(&mut self, record: Record) -> Result<(), Broken> {
        let summary = &mut self.summary;
        match record {
            Record::Header { profile, library } => (summary.profile, summary.library) = (profile, library),
            Record::Schema { id, name, encoding } => drop(self.schemas.insert(id, (name, encoding))),
            Record::Channel(c) => {
                let (schema, schema_encoding) = self.schemas.get(&c.schema).cloned().unwrap_or_default();
                let channel = summary.channels.entry(c.id).or_default();
                *channel = McapChannel { topic: c.topic, encoding: c.encoding, schema, schema_encoding, ..*channel };
            }
            Record::Message(m) => {
                // A channel may be described only in the summary, or nowhere: its messages are counted all the same.
                let channel = summary.channels.entry(m.channel).or_default();
                channel.messages += 1;
                channel.bytes += m.data.len() as u64;
                summary.messages += 1;
                let [a, b] = summary.time.unwrap_or([m.log_time; 2]);
                summary.time = Some([a.min(m.log_time), b.max(m.log_time)]);
            }
            Record::Chunk(chunk) => {
                summary.chunks += 1;
                let records = chunk.records()?;
                let mut input = Bytes::new(&records);
                while let Some((code, body)) = record::next(&mut input)? {
                    match record::parse(code, body)? {
                        Record::Chunk(_) => return Err("a chunk holds a chunk".into()),
                        inner => self.take(inner)?,
                    }
                }
            }
            Record::Metadata { name, map } => summary.metadata.push((name, map)),
            Record::Attachment { name, media_type, size } => summary.attachments.push((name, media_type, size)),
            _ => {}
        }
        Ok(())
    }
}
