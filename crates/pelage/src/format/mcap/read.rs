//! Reads hair of a shot out of an MCAP file, frame by frame.

use super::record::{self, HEAD, MAGIC, Record, op};
use super::{SHOT, facts_from_map, log_time, proto};
use crate::format::bytes::{Broken, Bytes};
use crate::format::check::{Bounds, is_width, read_error};
use crate::format::{FormatError, HairLayer, ShotFacts};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Footer record and mark at the end of every file.
const TAIL: u64 = HEAD + 20 + 8;

/// Where a message is: its chunk and its place among the records of the chunk.
#[derive(Clone, Copy, Debug)]
struct Place {
    log_time: u64,
    chunk: u64,
    offset: u64,
}

/// An open file with hair of a shot. Checksums are compared with whatever is read.
#[derive(Debug)]
pub struct HairMcap {
    path: PathBuf,
    file: File,
    len: u64,
    facts: ShotFacts,
    layers: Vec<LayerPlaces>,
}

#[derive(Debug, Default)]
struct LayerPlaces {
    name: String,
    topology: Vec<Place>,
    frames: Vec<Place>,
    /// Widths and opacities of frames that have their own.
    looks: Vec<Place>,
}

/// One layer at one frame. V points.
#[derive(Clone, Debug, PartialEq)]
pub struct McapFrame {
    /// Frame number.
    pub frame: i32,
    /// Seconds since the first frame.
    pub time: f64,
    /// Scene-space point that positions are relative to.
    pub origin: [f64; 3],
    /// Positions, scene units relative to `origin`, V.
    pub position: Vec<[f32; 3]>,
    /// Velocities, scene units a second, V.
    pub velocity: Vec<[f32; 3]>,
    /// Diameters at this frame, scene units, V; empty: those of the layer.
    pub width: Vec<f32>,
    /// Opacities at this frame, C; empty: those of the layer.
    pub opacity: Vec<f32>,
    /// Transmittance, V values of all lights together and then of each light of the facts; empty without lights.
    pub transmittance: Vec<Vec<f32>>,
}

/// Opens a file that [`McapHair`](super::McapHair) wrote: reads its index and its facts.
pub fn read_hair_mcap(path: &Path) -> Result<HairMcap, FormatError> {
    let mut file = File::open(path).map_err(|e| read_error(path, &e))?;
    let len = file.metadata().map_err(|e| read_error(path, &e))?.len();
    let bad = |what: Broken| FormatError::new(path, what);
    let index = Index::read(&mut file, len).map_err(bad)?;
    let (facts, layer_count) = index.facts(&mut file, len).map_err(bad)?;
    let layers = index.layers(&mut file, len, layer_count).map_err(bad)?;
    for layer in &layers {
        let times = layer.frames.iter().map(|p| p.log_time);
        if layer.topology.len() != 1 || !times.eq(facts.frames.iter().map(|&f| log_time(&facts, f))) {
            let found = layer.frames.len();
            let what = format!("has {found} frames of {}, or at other times than stated", facts.frames.len());
            return Err(bad(what).at(format!("layer {:?}", layer.name)));
        }
        let of_a_frame = |p: &Place| layer.frames.binary_search_by_key(&p.log_time, |f| f.log_time).is_ok();
        let one_each = layer.looks.windows(2).all(|w| w[0].log_time < w[1].log_time);
        if !one_each || !layer.looks.iter().all(of_a_frame) {
            return Err(bad("has widths or opacities at other times than its frames".into())
                .at(format!("layer {:?}", layer.name)));
        }
    }
    Ok(HairMcap { path: path.to_path_buf(), file, len, facts, layers })
}

impl HairMcap {
    /// Facts of the shot; its frames are those in the file.
    pub fn facts(&self) -> &ShotFacts {
        &self.facts
    }

    /// Names of the layers.
    pub fn layer_names(&self) -> impl Iterator<Item = &str> {
        self.layers.iter().map(|l| l.name.as_str())
    }

    /// What does not change over the shot, of layer `layer` (panics if there is no such layer).
    pub fn layer(&mut self, layer: usize) -> Result<HairLayer, FormatError> {
        let place = self.layers[layer].topology[0];
        self.message(layer, place, "topology", |_, message| {
            let read = proto::decode_layer(message)?;
            let (curves, points) = (read.offsets.len(), read.offsets.total());
            let sized = [read.id.len(), read.root_uv.len(), read.opacity.len()];
            let skin = [read.skin_face.len(), read.skin_bary.len()];
            let colored = [curves, points].contains(&read.color.len());
            let wrong = sized.iter().any(|&n| n != curves) || !colored || read.width.len() != points;
            if wrong || (skin != [curves; 2] && skin != [0; 2]) {
                return Err("its columns differ in length".into());
            }
            Ok(read)
        })
    }

    /// Layer `layer` at the frame with place `index` among the frames of the facts (panics if there are no such).
    pub fn frame(&mut self, index: usize, layer: usize) -> Result<McapFrame, FormatError> {
        let number = self.facts.frames[index];
        let place = self.layers[layer].frames[index];
        let looks = &self.layers[layer].looks;
        let look = looks.binary_search_by_key(&place.log_time, |p| p.log_time).ok().map(|i| looks[i]);
        let mut frame = self.message(layer, place, &format!("frame {number}"), |sequence, message| {
            let read = proto::decode_frame(message)?;
            let sized = read.position.len() == read.velocity.len();
            match read.origin.try_into() {
                Ok(origin) if read.frame == number && sequence == number as u32 && sized => Ok(McapFrame {
                    frame: number,
                    time: read.time,
                    origin,
                    position: read.position,
                    velocity: read.velocity,
                    width: vec![],
                    opacity: vec![],
                    transmittance: vec![],
                }),
                _ => Err("its number, origin or sizes are wrong".into()),
            }
        })?;
        if let Some(place) = look {
            let points = frame.position.len();
            let columns = self.facts.shadow_columns().len();
            let look = self.message(layer, place, &format!("look of frame {number}"), |sequence, message| {
                let look = proto::decode_look(message)?;
                let sized = look.width.is_empty() || look.width.len() == points;
                let lit = look.transmittance.len() == columns * points;
                if look.frame != number || sequence != number as u32 || !sized || !lit {
                    return Err("its number or sizes are wrong".into());
                }
                Ok(look)
            })?;
            frame.transmittance = match columns {
                0 => vec![],
                _ if points == 0 => vec![vec![]; columns],
                _ => look.transmittance.chunks(points).map(<[f32]>::to_vec).collect(),
            };
            (frame.width, frame.opacity) = (look.width, look.opacity);
        }
        Ok(frame)
    }

    /// Decodes a message with `decode`, which is given its sequence number and its bytes.
    fn message<T>(
        &mut self,
        layer: usize,
        place: Place,
        what: &str,
        decode: impl FnOnce(u32, &[u8]) -> Result<T, Broken>,
    ) -> Result<T, FormatError> {
        message_at(&mut self.file, self.len, place, decode)
            .map_err(|e| FormatError::new(&self.path, e).at(format!("layer {:?}, {what}", self.layers[layer].name)))
    }
}

fn message_at<T>(
    file: &mut File,
    len: u64,
    place: Place,
    decode: impl FnOnce(u32, &[u8]) -> Result<T, Broken>,
) -> Result<T, Broken> {
    let (code, body) = record_at(file, len, place.chunk)?;
    let Record::Chunk(chunk) = record::parse(code, &body)? else { return Err("the index leads to no chunk".into()) };
    let records = chunk.records()?;
    let mut input = Bytes::new(&records);
    input.take(place.offset)?;
    let Some((code, body)) = record::next(&mut input)? else { return Err("the index leads to no message".into()) };
    match record::parse(code, body)? {
        Record::Message(m) if m.log_time == place.log_time => decode(m.sequence, m.data),
        _ => Err("the index leads to another message".into()),
    }
}

fn read_at(file: &mut File, len: u64, at: u64, n: u64) -> Result<Vec<u8>, Broken> {
    if at.checked_add(n).is_none_or(|end| end > len) {
        return Err(format!("the index leads to byte {at}, the file has {len}"));
    }
    let mut out = vec![0; n as usize];
    let read = file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut out));
    read.map(|_| out).map_err(|e| format!("could not be read: {e}"))
}

fn record_at(file: &mut File, len: u64, at: u64) -> Result<(u8, Vec<u8>), Broken> {
    let head = read_at(file, len, at, HEAD)?;
    let mut input = Bytes::new(&head);
    let (code, size) = (input.u8()?, input.u64()?);
    Ok((code, read_at(file, len, at + HEAD, size)?))
}

/// What the end of a file says about the rest of it.
#[derive(Default)]
struct Index {
    channels: BTreeMap<u16, record::Channel>,
    /// Chunks: first byte, and where the index of each channel is.
    chunks: Vec<(u64, Vec<(u16, u64)>)>,
    shot: Option<u64>,
}

impl Index {
    fn read(file: &mut File, len: u64) -> Result<Index, Broken> {
        let whole = len >= TAIL + 8 && read_at(file, len, 0, 8)? == MAGIC && read_at(file, len, len - 8, 8)? == MAGIC;
        if !whole {
            return Err("is not a whole MCAP file: the mark at its start or end is missing".into());
        }
        let (code, body) = record_at(file, len, len - TAIL)?;
        let footer = record::parse(code, &body)?;
        let Record::Footer { summary_start, summary_crc } = footer else { return Err("has no footer".into()) };
        if code != op::FOOTER || body.len() != 20 || summary_start < 8 || summary_start > len - TAIL {
            return Err("has no summary".into());
        }
        let summary = read_at(file, len, summary_start, len - 12 - summary_start)?;
        if crc32fast::hash(&summary) != summary_crc {
            return Err("the checksum of its summary is wrong: the file is damaged".into());
        }
        let mut index = Index::default();
        let mut input = Bytes::new(&summary[..(len - TAIL - summary_start) as usize]);
        while let Some((code, body)) = record::next(&mut input)? {
            match record::parse(code, body)? {
                Record::Channel(c) => drop(index.channels.insert(c.id, c)),
                Record::ChunkIndex { start, message_indexes } => index.chunks.push((start, message_indexes)),
                Record::MetadataIndex { offset, name } if name == SHOT => index.shot = Some(offset),
                _ => {}
            }
        }
        Ok(index)
    }

    fn facts(&self, file: &mut File, len: u64) -> Result<(ShotFacts, usize), Broken> {
        let Some(offset) = self.shot else {
            return Err(format!("is an MCAP file, but not hair of a shot: it has no metadata {SHOT:?}"));
        };
        let (code, body) = record_at(file, len, offset)?;
        match record::parse(code, &body)? {
            Record::Metadata { name, map } if name == SHOT => facts_from_map(&map),
            _ => Err(format!("the index leads to something else than the metadata {SHOT:?}")),
        }
    }

    /// Places of all messages, by layer.
    fn layers(&self, file: &mut File, len: u64, count: usize) -> Result<Vec<LayerPlaces>, Broken> {
        let mut places: BTreeMap<u16, Vec<Place>> = BTreeMap::new();
        for (chunk, indexes) in &self.chunks {
            for (_, at) in indexes {
                let (code, body) = record_at(file, len, *at)?;
                let Record::MessageIndex { channel, entries } = record::parse(code, &body)? else {
                    return Err("the index leads to something else than an index of messages".into());
                };
                let found = entries.into_iter().map(|(log_time, offset)| Place { log_time, chunk: *chunk, offset });
                places.entry(channel).or_default().extend(found);
            }
        }
        if count > self.channels.len() {
            return Err(format!("{count} layers are stated, there are {} channels", self.channels.len()));
        }
        let mut layers: Vec<LayerPlaces> = (0..count).map(|_| LayerPlaces::default()).collect();
        for channel in self.channels.values() {
            let fact = |key: &str| channel.metadata.get(key).map_or("", |s| s.as_str());
            let found = places.remove(&channel.id).unwrap_or_default();
            let Some(layer) = fact("index").parse().ok().and_then(|i: usize| layers.get_mut(i)) else { continue };
            layer.name = fact("layer").to_owned();
            match fact("part") {
                "topology" => layer.topology = found,
                "frames" => layer.frames = found,
                "look" => layer.looks = found,
                _ => {}
            }
        }
        Ok(layers)
    }
}

/// Opens an exported file again and compares facts and layers with what was exported.
pub fn verify_layers(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Result<(), FormatError> {
    let mut file = read_hair_mcap(path)?;
    let mut expected = facts.clone();
    expected.extra.sort();
    if *file.facts() != expected {
        return Err(not_exported(path, "its facts differ from what was exported"));
    }
    if !file.layer_names().eq(layers.iter().map(|l| l.name.as_str())) {
        return Err(not_exported(path, "its layers differ from what was exported"));
    }
    for (i, layer) in layers.iter().enumerate() {
        if file.layer(i)? != *layer {
            let at = format!("layer {:?}", layer.name);
            return Err(not_exported(path, "a column differs from what was exported").at(at));
        }
    }
    Ok(())
}

/// Opens an exported file again and checks every frame: as many points as its layer has (`sizes`: curves and points, one
/// entry a layer), the origin, all values finite, widths not negative. Apart from [`verify_layers`], so that layers need not lie beside frames in memory.
pub fn verify_frames(path: &Path, facts: &ShotFacts, sizes: &[[usize; 2]]) -> Result<(), FormatError> {
    let mut file = read_hair_mcap(path)?;
    for (i, [curves, points]) in sizes.iter().enumerate() {
        for index in 0..facts.frames.len() {
            let frame = file.frame(index, i)?;
            let look = [(frame.width.len(), *points), (frame.opacity.len(), *curves)];
            let sized = frame.position.len() == *points
                && frame.origin == facts.origin
                && look.iter().all(|(n, wanted)| *n == 0 || n == wanted)
                && frame.transmittance.len() == facts.shadow_columns().len();
            let finite = Bounds::of(&frame.position).is_some() && Bounds::of(&frame.velocity).is_some();
            let sound = frame.width.iter().all(|w| is_width(*w))
                && frame.opacity.iter().all(|x| x.is_finite())
                && frame.transmittance.iter().flatten().all(|t| (0.0..=1.0).contains(t));
            if !sized || !finite || !sound {
                let what = if sized {
                    "a value is not finite or out of range"
                } else {
                    "the number of points or curves, or the origin, is wrong"
                };
                return Err(not_exported(path, what).at(format!("layer {i}, frame {}", frame.frame)));
            }
        }
    }
    Ok(())
}

fn not_exported(path: &Path, what: &str) -> FormatError {
    FormatError::new(path, what).hint("the file is not what was exported: export it again")
}

#[cfg(test)]
mod tests {
    use super::super::{McapHair, inspect};
    use super::*;
    use crate::format::HairFrame;
    use crate::format::check::samples;

    fn write_frame(out: &mut McapHair, layers: &[HairLayer], frame: i32) -> Result<(), FormatError> {
        let data: Vec<_> = layers.iter().map(|l| samples::frame(l, frame)).collect();
        let data: Vec<_> =
            data.iter().map(|(p, v)| HairFrame { position: p, velocity: v, ..HairFrame::default() }).collect();
        out.write_frame(frame, &data)
    }

    fn write(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Vec<u8> {
        let mut out = McapHair::create(path, facts, layers).unwrap();
        for &frame in &facts.frames {
            write_frame(&mut out, layers, frame).unwrap();
        }
        out.finish().unwrap();
        std::fs::read(path).unwrap()
    }

    fn sizes(layers: &[HairLayer]) -> Vec<[usize; 2]> {
        layers.iter().map(|l| [l.offsets.len(), l.offsets.total()]).collect()
    }

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::shot();
        let path = dir.path().join("a.mcap");
        let bytes = write(&path, &facts, &layers);
        verify_layers(&path, &facts, &layers).unwrap();
        verify_frames(&path, &facts, &sizes(&layers)).unwrap();
        let other: Vec<_> = sizes(&layers).iter().map(|[c, n]| [*c, n + 1]).collect();
        assert!(verify_frames(&path, &facts, &other).is_err());
        let mut file = read_hair_mcap(&path).unwrap();
        assert_eq!(file.facts(), &facts);
        for (i, layer) in layers.iter().enumerate() {
            assert_eq!(file.layer(i).unwrap(), *layer);
            for (k, &number) in facts.frames.iter().enumerate() {
                let (position, velocity) = samples::frame(layer, number);
                let time = f64::from(number - 1001) / 24.0;
                let expected = McapFrame {
                    frame: number,
                    time,
                    origin: facts.origin,
                    position,
                    velocity,
                    width: vec![],
                    opacity: vec![],
                    transmittance: vec![],
                };
                assert_eq!(file.frame(k, i).unwrap(), expected);
            }
        }
        let summary = inspect(&path).unwrap();
        assert_eq!((summary.library.as_str(), summary.messages, summary.channels.len()), ("pelage", 8, 4));
        assert_eq!(summary.time, Some([0, 83_333_333]));
        assert_eq!(summary.channels[&2].topic, "/hair/over coat/frames");
        assert_eq!((summary.channels[&2].schema.as_str(), summary.channels[&2].messages), ("pelage.HairFrame", 3));
        assert_eq!(summary.metadata[0].1["extra.version"], "0.1.0");
        // The same shot gives the same bytes.
        assert_eq!(bytes, write(&dir.path().join("b.mcap"), &facts, &layers));
    }

    #[test]
    fn colours_of_points_are_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::coloured();
        let path = dir.path().join("a.mcap");
        write(&path, &facts, &layers);
        verify_layers(&path, &facts, &layers).unwrap();
        assert_eq!(read_hair_mcap(&path).unwrap().layer(0).unwrap().color, layers[0].color);
        assert!(verify_layers(&path, &facts, &samples::shot().1).is_err());
    }

    #[test]
    fn widths_and_opacities_of_frames_are_messages() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::shot();
        let path = dir.path().join("a.mcap");
        let mut out = McapHair::create(&path, &facts, &layers).unwrap();
        // The second layer brings its own from frame 1002 on, at the last one widths only.
        let own = |frame: i32| match samples::look(&layers[1], frame) {
            _ if frame == 1001 => (vec![], vec![]),
            (width, _) if frame == 1003 => (width, vec![]),
            both => both,
        };
        for &frame in &facts.frames {
            let data: Vec<_> = layers.iter().map(|l| samples::frame(l, frame)).collect();
            let (width, opacity) = own(frame);
            let mut data: Vec<_> =
                data.iter().map(|(p, v)| HairFrame { position: p, velocity: v, ..HairFrame::default() }).collect();
            data[1] = HairFrame { width: &width, opacity: &opacity, ..data[1] };
            out.write_frame(frame, &data).unwrap();
        }
        out.finish().unwrap();
        verify_layers(&path, &facts, &layers).unwrap();
        verify_frames(&path, &facts, &sizes(&layers)).unwrap();
        let other: Vec<_> = sizes(&layers).iter().map(|[c, n]| [c + 1, *n]).collect();
        assert!(verify_frames(&path, &facts, &other).is_err());
        let mut file = read_hair_mcap(&path).unwrap();
        for (k, &number) in facts.frames.iter().enumerate() {
            let (still, moving) = (file.frame(k, 0).unwrap(), file.frame(k, 1).unwrap());
            assert!(still.width.is_empty() && still.opacity.is_empty());
            assert_eq!((moving.width, moving.opacity), own(number));
        }
        let summary = inspect(&path).unwrap();
        let look = &summary.channels[&5];
        assert_eq!(
            (look.topic.as_str(), look.schema.as_str(), look.messages),
            ("/hair/2nd/look", "pelage.HairLook", 2)
        );
    }

    #[test]
    fn transmittance_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::lit();
        let path = dir.path().join("a.mcap");
        let mut out = McapHair::create(&path, &facts, &layers).unwrap();
        samples::write_lit(|frame, data| out.write_frame(frame, data).unwrap());
        out.finish().unwrap();
        verify_layers(&path, &facts, &layers).unwrap();
        verify_frames(&path, &facts, &sizes(&layers)).unwrap();
        let mut file = read_hair_mcap(&path).unwrap();
        assert_eq!(file.facts().lights, ["key", "rim-2"]);
        for (l, layer) in layers.iter().enumerate() {
            for (k, &frame) in facts.frames.iter().enumerate() {
                assert_eq!(file.frame(k, l).unwrap().transmittance, samples::light(layer, frame));
            }
        }
    }

    #[test]
    fn large_frames_get_chunks_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, _) = samples::shot();
        let n = 50_000;
        let layer = HairLayer {
            name: "big".into(),
            offsets: pelage_geom::Offsets::uniform(n / 10, 10),
            id: (0..n as u64 / 10).collect(),
            root_uv: vec![[0.5; 2]; n / 10],
            rest: (0..n).map(|i| [i as f32, 0.0, 1.0]).collect(),
            width: vec![0.1; n],
            color: vec![[0.5; 3]; n / 10],
            opacity: vec![1.0; n / 10],
            ..HairLayer::default()
        };
        let layers = [layer.clone(), HairLayer { name: "small".into(), ..layer }];
        let path = dir.path().join("a.mcap");
        write(&path, &facts, &layers);
        verify_layers(&path, &facts, &layers).unwrap();
        verify_frames(&path, &facts, &sizes(&layers)).unwrap();
        let other: Vec<_> = sizes(&layers).iter().map(|[c, n]| [*c, n + 1]).collect();
        assert!(verify_frames(&path, &facts, &other).is_err());
        assert!(inspect(&path).unwrap().chunks > 5);
    }

    #[test]
    fn an_unfinished_file_does_not_open() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::shot();
        let path = dir.path().join("a.mcap");
        let mut out = McapHair::create(&path, &facts, &layers).unwrap();
        write_frame(&mut out, &layers, 1001).unwrap();
        assert!(write_frame(&mut out, &layers, 1003).is_err());
        assert!(out.finish().unwrap_err().to_string().contains("1 of 3 frames"));
        assert!(read_hair_mcap(&path).is_err() && inspect(&path).is_err());
        assert!(!std::fs::read(&path).unwrap().ends_with(MAGIC));
    }

    #[test]
    fn verify_finds_what_differs() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::shot();
        let path = dir.path().join("a.mcap");
        write(&path, &facts, &layers);
        let mut other = layers.clone();
        other[1].id[0] += 1;
        assert!(verify_layers(&path, &facts, &other).is_err());
        let other = ShotFacts { fps: 25.0, ..facts.clone() };
        assert!(verify_layers(&path, &other, &layers).is_err());
        assert!(verify_layers(&path, &facts, &layers[..1]).is_err());
    }

    /// What is read of a damaged file without an error is what was written.
    #[test]
    fn broken_files_are_errors_or_equal() {
        let dir = tempfile::tempdir().unwrap();
        let (facts, layers) = samples::shot();
        let path = dir.path().join("a.mcap");
        let bytes = write(&path, &facts, &layers);
        let broken = dir.path().join("broken.mcap");
        for n in (0..bytes.len()).step_by(5) {
            std::fs::write(&broken, &bytes[..n]).unwrap();
            assert!(read_hair_mcap(&broken).is_err() && inspect(&broken).is_err(), "{n} bytes");
        }
        let content = |path: &Path| -> Result<_, FormatError> {
            let mut file = read_hair_mcap(path)?;
            let mut out = vec![];
            let facts = file.facts().clone();
            for i in 0..file.layers.len() {
                let frames: Result<Vec<_>, _> = (0..file.facts().frames.len()).map(|k| file.frame(k, i)).collect();
                out.push((file.layer(i)?, frames?));
            }
            Ok((facts, out))
        };
        let good = content(&path).unwrap();
        let mut equal = 0;
        for i in (0..bytes.len()).step_by(3) {
            let mut bad = bytes.clone();
            bad[i] ^= [0x01, 0x80, 0xff, 0x10][i / 3 % 4];
            std::fs::write(&broken, &bad).unwrap();
            let _ = inspect(&broken);
            if let Ok(read) = content(&broken) {
                assert!(read == good, "byte {i} changed what was read");
                equal += 1;
            }
        }
        assert!(equal < bytes.len() / 12, "{equal} of {} changes went unseen", bytes.len());
    }
}
