//! Records of MCAP files, parsed with every length checked (mcap.dev/spec). The `mcap` crate is asked only to unpack
//! zstd chunks: its readers take a damaged chunk for a good one unless told otherwise.

use crate::format::bytes::{Broken, Bytes};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// First and last bytes of every file.
pub(super) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
/// Operation codes with which records start.
pub(super) mod op {
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const DATA_END: u8 = 0x0F;
}
/// Code and length before every record.
pub(super) const HEAD: u64 = 9;
/// A zstd chunk may say to become this large whatever its size. Below it, chunks of highly regular small data would be
/// refused; far above it a small broken file could ask for gigabytes.
const SMALL_CHUNK: u64 = 64 << 20;
/// Beyond [`SMALL_CHUNK`], how much larger than its packed size a zstd chunk may be.
const MAX_RATIO: u64 = 100;

/// A record of a file; what is not needed is [`Record::Other`].
pub(super) enum Record<'a> {
    Header { profile: String, library: String },
    Footer { summary_start: u64, summary_crc: u32 },
    Schema { id: u16, name: String, encoding: String },
    Channel(Channel),
    Message(Message<'a>),
    Chunk(Chunk<'a>),
    MessageIndex { channel: u16, entries: Vec<(u64, u64)> },
    ChunkIndex { start: u64, message_indexes: Vec<(u16, u64)> },
    Attachment { name: String, media_type: String, size: u64 },
    Metadata { name: String, map: BTreeMap<String, String> },
    MetadataIndex { offset: u64, name: String },
    DataEnd { crc: u32 },
    Other,
}

pub(super) struct Channel {
    pub(super) id: u16,
    pub(super) schema: u16,
    pub(super) topic: String,
    pub(super) encoding: String,
    pub(super) metadata: BTreeMap<String, String>,
}

pub(super) struct Message<'a> {
    pub(super) channel: u16,
    pub(super) sequence: u32,
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
}

pub(super) struct Chunk<'a> {
    /// The whole body of the record, as the crate's reader needs it.
    body: &'a [u8],
    size: u64,
    crc: u32,
    pub(super) compression: String,
    data: &'a [u8],
}

/// The next record: code and body. `None` at the end.
pub(super) fn next<'a>(input: &mut Bytes<'a>) -> Result<Option<(u8, &'a [u8])>, Broken> {
    if input.rest().is_empty() {
        return Ok(None);
    }
    let code = input.u8()?;
    let len = input.u64()?;
    Ok(Some((code, input.take(len)?)))
}

fn text(input: &mut Bytes) -> Result<String, Broken> {
    let len = input.u32()?;
    let bytes = input.take(u64::from(len))?;
    str::from_utf8(bytes).map(str::to_owned).map_err(|_| "a text is not UTF-8".to_string())
}

fn text_map(input: &mut Bytes) -> Result<BTreeMap<String, String>, Broken> {
    let len = input.u32()?;
    let mut entries = Bytes::new(input.take(u64::from(len))?);
    let mut map = BTreeMap::new();
    while !entries.rest().is_empty() {
        map.insert(text(&mut entries)?, text(&mut entries)?);
    }
    Ok(map)
}

/// Parses the body of a record.
pub(super) fn parse(code: u8, body: &[u8]) -> Result<Record<'_>, Broken> {
    let mut input = Bytes::new(body);
    let b = &mut input;
    Ok(match code {
        0x01 => Record::Header { profile: text(b)?, library: text(b)? },
        op::FOOTER => {
            let summary_start = b.u64()?;
            b.u64()?;
            Record::Footer { summary_start, summary_crc: b.u32()? }
        }
        0x03 => {
            let (id, name, encoding) = (b.u16()?, text(b)?, text(b)?);
            let len = b.u32()?;
            b.take(u64::from(len))?;
            Record::Schema { id, name, encoding }
        }
        0x04 => Record::Channel(Channel {
            id: b.u16()?,
            schema: b.u16()?,
            topic: text(b)?,
            encoding: text(b)?,
            metadata: text_map(b)?,
        }),
        0x05 => {
            let (channel, sequence, log_time) = (b.u16()?, b.u32()?, b.u64()?);
            b.u64()?;
            Record::Message(Message { channel, sequence, log_time, data: b.rest() })
        }
        op::CHUNK => {
            b.take(16)?;
            let (size, crc, compression, len) = (b.u64()?, b.u32()?, text(b)?, b.u64()?);
            Record::Chunk(Chunk { body, size, crc, compression, data: b.take(len)? })
        }
        0x07 => {
            let channel = b.u16()?;
            let len = b.u32()?;
            let mut entries = Bytes::new(b.take(u64::from(len))?);
            let mut list = vec![];
            while !entries.rest().is_empty() {
                list.push((entries.u64()?, entries.u64()?));
            }
            Record::MessageIndex { channel, entries: list }
        }
        0x08 => {
            b.take(16)?;
            let start = b.u64()?;
            b.u64()?;
            let map = b.u32()?;
            let mut entries = Bytes::new(b.take(u64::from(map))?);
            let mut message_indexes = vec![];
            while !entries.rest().is_empty() {
                message_indexes.push((entries.u16()?, entries.u64()?));
            }
            Record::ChunkIndex { start, message_indexes }
        }
        0x09 => {
            b.take(16)?;
            let (name, media_type, size) = (text(b)?, text(b)?, b.u64()?);
            b.take(size)?;
            let hashed = body.len() - b.rest().len();
            let crc = b.u32()?;
            if crc != 0 && crc != crc32fast::hash(&body[..hashed]) {
                return Err(format!("the checksum of the attachment {name:?} is wrong"));
            }
            Record::Attachment { name, media_type, size }
        }
        0x0C => Record::Metadata { name: text(b)?, map: text_map(b)? },
        0x0D => {
            let offset = b.u64()?;
            b.u64()?;
            Record::MetadataIndex { offset, name: text(b)? }
        }
        op::DATA_END => Record::DataEnd { crc: b.u32()? },
        _ => Record::Other,
    })
}

impl<'a> Chunk<'a> {
    /// The records inside, unpacked and with their checksum compared.
    pub(super) fn records(&self) -> Result<Cow<'a, [u8]>, Broken> {
        match self.compression.as_str() {
            "" => {
                if self.size != self.data.len() as u64 {
                    return Err(format!("a chunk has {} bytes, {} are announced", self.data.len(), self.size));
                }
                if self.crc != 0 && self.crc != crc32fast::hash(self.data) {
                    return Err("the checksum of a chunk is wrong: the data is damaged".into());
                }
                Ok(Cow::Borrowed(self.data))
            }
            "zstd" => self.unpack().map(Cow::Owned),
            other => Err(format!("a chunk is compressed with {other:?}, only zstd and none are read")),
        }
    }

    fn unpack(&self) -> Result<Vec<u8>, Broken> {
        let limit = SMALL_CHUNK.max(self.data.len() as u64 * MAX_RATIO);
        if self.size > limit {
            return Err(format!("a chunk of {} bytes is said to hold {}", self.data.len(), self.size));
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(limit as usize);
        let mut reader = LinearReader::new_with_options(options);
        let mut head = vec![op::CHUNK];
        head.extend((self.body.len() as u64).to_le_bytes());
        let mut input: &[u8] = &[head.as_slice(), self.body].concat();
        let mut out = Vec::new();
        while let Some(event) = reader.next_event() {
            match event.map_err(|e| format!("a chunk is damaged: {e}"))? {
                LinearReadEvent::ReadRequest(n) => {
                    let n = n.min(input.len());
                    let (now, later) = input.split_at(n);
                    reader.insert(n).copy_from_slice(now);
                    reader.notify_read(n);
                    input = later;
                }
                LinearReadEvent::Record { opcode, data } => {
                    out.push(opcode);
                    out.extend((data.len() as u64).to_le_bytes());
                    out.extend_from_slice(data);
                }
            }
        }
        if out.len() as u64 != self.size {
            return Err(format!("a chunk has {} bytes, {} are announced", out.len(), self.size));
        }
        Ok(out)
    }
}
