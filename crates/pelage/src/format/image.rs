//! Maps: PNG, TIFF and OpenEXR in, PNG out. The content decides what a file is, not its name.

use super::FormatError;
use super::ply::write_whole;
use image::{ImageDecoder, ImageEncoder, ImageFormat, ImageReader, Limits};
use pelage_geom::Map;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::path::Path;
use tiff::ColorType as TiffColor;
use tiff::decoder::{Decoder as TiffDecoder, DecodingResult};

/// Which values of an image make the map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// The one channel of a grey image; of a coloured one its luminance, or its first channel if all are equal.
    #[default]
    Auto,
    /// Red, or grey.
    R,
    /// Green, or grey.
    G,
    /// Blue, or grey.
    B,
    /// Alpha.
    A,
    /// Rec. 709 luminance (of linear values), or grey.
    Luminance,
    /// Three channels, grey three times.
    Rgb,
}

/// A map and what was noticed while it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadMap {
    /// Linear values, bottom row first, 1 channel (3 for [`Channel::Rgb`]).
    pub map: Map,
    /// Oddities that were worked around, in words.
    pub warnings: Vec<String>,
}

/// Larger images are refused: beyond this, maps come as UDIM tiles.
const MAX_SIDE: usize = 16384;
/// Largest decoded image (32-bit values of all its channels).
const MAX_BYTES: u64 = 2 << 30;
/// Weights of linear red, green and blue in luminance (ITU-R BT.709).
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Reads a map. Integers are scaled to [0, 1] and, if `color`, decoded from sRGB to linear (alpha never is); floats,
/// and the 32-bit integers of OpenEXR, are taken as they are.
pub fn read_map(path: &Path, channel: Channel, color: bool) -> Result<ReadMap, FormatError> {
    let (kind, file) = open(path)?;
    let mut warnings = Vec::new();
    let (raster, channel) = match kind {
        Kind::Png => (png_raster(path, file, color)?, channel),
        Kind::Tiff => (tiff_raster(path, file, color)?, channel),
        Kind::Exr => (
            exr_raster(path, file, channel, &mut warnings)?,
            if channel == Channel::A { Channel::Auto } else { channel },
        ),
    };
    let map = select(path, raster, channel, &mut warnings)?;
    Ok(ReadMap { map, warnings })
}

/// Width and height of an image without decoding it.
pub fn read_size(path: &Path) -> Result<(usize, usize), FormatError> {
    let (kind, file) = open(path)?;
    match kind {
        Kind::Png => {
            let (w, h) =
                ImageReader::with_format(file, ImageFormat::Png).into_dimensions().map_err(|e| broken(path, e))?;
            Ok((w as usize, h as usize))
        }
        Kind::Tiff => {
            let (w, h) = TiffDecoder::new(file).and_then(|mut d| d.dimensions()).map_err(|e| broken(path, e))?;
            Ok((w as usize, h as usize))
        }
        Kind::Exr => exr_size(path, file),
    }
}

/// Writes 8-bit RGB, `w * h` texels, top row first.
pub fn write_png(path: &Path, w: usize, h: usize, rgb8: &[u8]) -> Result<(), FormatError> {
    encode_png(path, w, h, rgb8, 3, image::ExtendedColorType::Rgb8)
}

/// An 8-bit PNG of 1 (grey) or 3 (RGB) channels, top row first, in memory.
pub fn png_bytes(w: usize, h: usize, channels: usize, bytes: &[u8]) -> Vec<u8> {
    let kind = if channels == 1 { image::ExtendedColorType::L8 } else { image::ExtendedColorType::Rgb8 };
    let mut out = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut out);
    encoder.write_image(bytes, w as u32, h as u32, kind).expect("sizes fit and memory does not fail");
    out
}

/// Writes 16-bit grey, `w * h` texels, top row first.
pub fn write_png_gray16(path: &Path, w: usize, h: usize, gray: &[u16]) -> Result<(), FormatError> {
    encode_png(path, w, h, bytemuck::cast_slice(gray), 2, image::ExtendedColorType::L16)
}

fn encode_png(
    path: &Path,
    w: usize,
    h: usize,
    bytes: &[u8],
    texel: usize,
    kind: image::ExtendedColorType,
) -> Result<(), FormatError> {
    let sides = (u32::try_from(w), u32::try_from(h));
    let ((Ok(width), Ok(height)), true) = (sides, w > 0 && h > 0 && bytes.len() == w * h * texel) else {
        let what = format!("{} bytes do not make an image of {w} x {h} texels", bytes.len());
        return Err(FormatError::new(path, what));
    };
    write_whole(path, |out| {
        let encoder = image::codecs::png::PngEncoder::new(out);
        encoder.write_image(bytes, width, height, kind).map_err(std::io::Error::other)
    })
}

enum Kind {
    Png,
    Tiff,
    Exr,
}

/// Opens a file and tells its kind by its first bytes.
fn open(path: &Path) -> Result<(Kind, BufReader<File>), FormatError> {
    let fail = |e: std::io::Error| match e.kind() {
        std::io::ErrorKind::NotFound => FormatError::new(path, "no such file"),
        _ => FormatError::new(path, format!("cannot be read: {e}")),
    };
    let mut file = File::open(path).map_err(fail)?;
    let mut head = Vec::new();
    file.by_ref().take(16).read_to_end(&mut head).map_err(fail)?;
    file.rewind().map_err(fail)?;
    let kind = match head.as_slice() {
        [0x89, b'P', b'N', b'G', ..] => Kind::Png,
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Kind::Tiff,
        [0x76, 0x2f, 0x31, 0x01, ..] => Kind::Exr,
        other => {
            let what = match image::guess_format(other) {
                _ if other.is_empty() => "the file is empty".to_owned(),
                Ok(f) => format!("the content is {}, not PNG, TIFF or OpenEXR", f.extensions_str()[0].to_uppercase()),
                Err(_) => "the content is neither PNG nor TIFF nor OpenEXR".to_owned(),
            };
            return Err(FormatError::new(path, what).hint("save the map as PNG, TIFF or OpenEXR"));
        }
    };
    Ok((kind, BufReader::with_capacity(1 << 16, file)))
}

fn broken(path: &Path, e: impl std::fmt::Display) -> FormatError {
    let text = e.to_string();
    let text =
        text.trim_start_matches("Format error decoding Png: ").split(" while decoding").next().unwrap_or_default();
    let text = text.trim_end_matches('.');
    FormatError::new(path, format!("the image cannot be decoded: {text}")).hint("save it again")
}

/// Refuses what is too large to decode.
fn check_size(path: &Path, w: usize, h: usize, channels: usize) -> Result<(), FormatError> {
    if w == 0 || h == 0 {
        return Err(FormatError::new(path, format!("the image is empty ({w} x {h} texels)")));
    }
    if w > MAX_SIDE || h > MAX_SIDE {
        let what = format!("the image has {w} x {h} texels, at most {MAX_SIDE} x {MAX_SIDE} are read");
        return Err(FormatError::new(path, what).hint("scale it down or split it into UDIM tiles"));
    }
    let bytes = 4 * (w * h * channels) as u64;
    if bytes > MAX_BYTES {
        let what = format!(
            "the image ({w} x {h} texels, {channels} channels) needs {bytes} bytes, at most {MAX_BYTES} are taken"
        );
        return Err(
            FormatError::new(path, what).hint("scale it down, save it as greyscale or split it into UDIM tiles")
        );
    }
    Ok(())
}

/// A decoded image: top row first, texels of 1 (grey), 2 (grey, alpha), 3 or 4 values.
struct Raster {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<f32>,
}

impl Raster {
    fn has_alpha(&self) -> bool {
        self.channels.is_multiple_of(2)
    }
}

fn png_raster<R: BufRead + Seek>(path: &Path, file: R, color: bool) -> Result<Raster, FormatError> {
    let mut reader = ImageReader::with_format(file, ImageFormat::Png);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(2 * MAX_BYTES);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| broken(path, e))?;
    let (w, h) = decoder.dimensions();
    let (width, height) = (w as usize, h as usize);
    let channels = usize::from(decoder.color_type().channel_count());
    check_size(path, width, height, channels)?;
    let wide = decoder.color_type().bytes_per_pixel() as usize == 2 * channels;
    let mut bytes = vec![0u8; decoder.total_bytes() as usize];
    decoder.read_image(&mut bytes).map_err(|e| broken(path, e))?;
    let data = match wide {
        true => {
            let words = bytes.chunks_exact(2).map(|b| usize::from(u16::from_ne_bytes([b[0], b[1]])));
            scaled(words, 65535, channels, color)
        }
        false => scaled(bytes.iter().map(|b| usize::from(*b)), 255, channels, color),
    };
    Ok(Raster { width, height, channels, data })
}

/// Integers of range [0, `max`] as linear values in [0, 1].
fn scaled(values: impl Iterator<Item = usize>, max: usize, channels: usize, color: bool) -> Vec<f32> {
    let plain: Vec<f32> = (0..=max).map(|v| v as f32 / max as f32).collect();
    let decoded: Vec<f32> = match color {
        true => (0..=max).map(|v| srgb_to_linear(v as f64 / max as f64) as f32).collect(),
        false => plain.clone(),
    };
    let alpha = if channels.is_multiple_of(2) { channels - 1 } else { channels };
    let mut c = 0;
    values
        .map(|v| {
            let table = if c == alpha { &plain } else { &decoded };
            c = if c + 1 == channels { 0 } else { c + 1 };
            table[v]
        })
        .collect()
}

/// Decoding curve of sRGB (IEC 61966-2-1), [0, 1] to [0, 1].
fn srgb_to_linear(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

fn tiff_raster<R: Read + Seek>(path: &Path, file: R, color: bool) -> Result<Raster, FormatError> {
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = 2 * MAX_BYTES as usize;
    limits.intermediate_buffer_size = MAX_BYTES as usize;
    let mut decoder = TiffDecoder::new(file).map_err(|e| broken(path, e))?.with_limits(limits);
    let (w, h) = decoder.dimensions().map_err(|e| broken(path, e))?;
    let (width, height) = (w as usize, h as usize);
    let kind = decoder.colortype().map_err(|e| broken(path, e))?;
    let channels = match kind {
        TiffColor::Gray(_) => 1,
        TiffColor::GrayA(_) | TiffColor::Multiband { num_samples: 2, .. } => 2,
        TiffColor::RGB(_) => 3,
        TiffColor::RGBA(_) => 4,
        _ => {
            let what = format!("TIFF of kind {kind:?} is not read");
            return Err(FormatError::new(path, what).hint("save it as greyscale or RGB, 8 or 16 bits or 32-bit float"));
        }
    };
    check_size(path, width, height, channels)?;
    let result = if kind.bit_depth() < 8 { None } else { Some(decoder.read_image().map_err(|e| broken(path, e))?) };
    let data = match result {
        Some(DecodingResult::U8(v)) => scaled(v.into_iter().map(usize::from), 255, channels, color),
        Some(DecodingResult::U16(v)) => scaled(v.into_iter().map(usize::from), 65535, channels, color),
        Some(DecodingResult::F16(v)) => v.into_iter().map(f32::from).collect(),
        Some(DecodingResult::F32(v)) => v,
        Some(DecodingResult::F64(v)) => v.into_iter().map(|x| x as f32).collect(),
        _ => {
            let what = format!("TIFF with samples of this type ({} bits) is not read", kind.bit_depth());
            return Err(FormatError::new(path, what).hint("save it with unsigned 8 or 16 bits or 32-bit float"));
        }
    };
    if data.len() != width * height * channels {
        let what = "TIFF with separate colour planes is not read";
        return Err(FormatError::new(path, what).hint("save it with interleaved (\"contiguous\") channels"));
    }
    Ok(Raster { width, height, channels, data })
}

fn exr_size(path: &Path, file: BufReader<File>) -> Result<(usize, usize), FormatError> {
    let meta = exr::meta::MetaData::read_from_buffered(file, false).map_err(|e| broken(path, e))?;
    let size = meta.headers.first().map(|h| h.shared_attributes.display_window.size);
    size.map(|s| (s.x(), s.y())).ok_or_else(|| FormatError::new(path, "the file holds no image"))
}

/// The channels of an OpenEXR that `channel` asks for, over the display window (0 where the file has no data).
fn exr_raster(
    path: &Path,
    mut file: BufReader<File>,
    channel: Channel,
    warnings: &mut Vec<String>,
) -> Result<Raster, FormatError> {
    use exr::prelude::{FlatSamples, ReadChannels, ReadLayers, read};
    let meta = exr::meta::MetaData::read_from_buffered(&mut file, false).map_err(|e| broken(path, e))?;
    for header in &meta.headers {
        let window = header.shared_attributes.display_window.size;
        check_size(path, window.x(), window.y(), 1)?;
        check_size(path, header.layer_size.x(), header.layer_size.y(), header.channels.list.len())?;
    }
    file.rewind().map_err(|e| broken(path, e))?;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(|e| broken(path, e))?;
    let layer = &image.layer_data;
    let list = &layer.channel_data.list;
    let names: Vec<String> = list.iter().map(|c| c.name.to_string()).collect();
    let picked = exr_channels(&names, channel).map_err(|what| {
        FormatError::new(path, what)
            .hint("choose a channel in the groom file, or save the map with one channel or R, G, B")
    })?;
    if let Some(k) = picked.iter().find(|k| list[**k].sampling != exr::math::Vec2(1, 1)) {
        return Err(FormatError::new(path, format!("channel '{}' is subsampled, which is not read", names[*k])));
    }
    let window = image.attributes.display_window;
    let corner = layer.attributes.layer_position - window.position;
    if layer.size != window.size || corner != exr::math::Vec2(0, 0) {
        let what =
            "the data window differs from the display window; the map is the display window, 0 where there is no data";
        warnings.push(what.to_owned());
    }
    let (width, height, channels) = (window.size.x(), window.size.y(), picked.len());
    check_size(path, width, height, channels)?;
    let mut data = vec![0.0f32; width * height * channels];
    let inside = |at: usize, offset: i32, size: usize| {
        let t = at as i64 + i64::from(offset);
        (0..size as i64).contains(&t).then_some(t as usize)
    };
    for (c, k) in picked.iter().enumerate() {
        let samples = &list[*k].sample_data;
        if matches!(samples, FlatSamples::U32(_)) {
            warnings
                .push(format!("channel '{}' holds integers; they were taken as they are, not scaled to 1", names[*k]));
        }
        for y in 0..layer.size.y() {
            let Some(row) = inside(y, corner.y(), height) else { continue };
            for x in 0..layer.size.x() {
                let Some(column) = inside(x, corner.x(), width) else { continue };
                let from = y * layer.size.x() + x;
                data[(row * width + column) * channels + c] = match samples {
                    FlatSamples::F16(v) => v[from].to_f32(),
                    FlatSamples::F32(v) => v[from],
                    FlatSamples::U32(v) => v[from] as f32,
                };
            }
        }
    }
    Ok(Raster { width, height, channels, data })
}

/// Indices of the channels to read: one (grey) or three (red, green, blue). Names may have a layer in front
/// ("hair.R").
fn exr_channels(names: &[String], channel: Channel) -> Result<Vec<usize>, String> {
    let find = |wanted: &str| {
        let last = |n: &String| n.rsplit('.').next().unwrap_or_default().eq_ignore_ascii_case(wanted);
        names.iter().position(|n| n == wanted).or_else(|| {
            let mut found = (0..names.len()).filter(|k| last(&names[*k]));
            found.next().filter(|_| found.next().is_none())
        })
    };
    let single = match channel {
        Channel::R => find("R"),
        Channel::G => find("G"),
        Channel::B => find("B"),
        Channel::A => find("A"),
        Channel::Auto | Channel::Luminance | Channel::Rgb => None,
    };
    if let Some(k) = single {
        return Ok(vec![k]);
    }
    if channel == Channel::A {
        return Err(format!("no channel A (its channels: {})", names.join(", ")));
    }
    if let (Some(r), Some(g), Some(b)) = (find("R"), find("G"), find("B")) {
        return Ok(vec![r, g, b]);
    }
    let alpha = find("A").filter(|_| names.len() > 1);
    let mut rest = (0..names.len()).filter(|k| Some(*k) != alpha);
    let only = rest.next().filter(|_| rest.next().is_none());
    match find("Y").or(only) {
        Some(k) => Ok(vec![k]),
        None => Err(format!("cannot tell which channel is meant (its channels: {})", names.join(", "))),
    }
}

/// Takes the wanted channel, turns the image bottom row first and checks its values.
fn select(path: &Path, raster: Raster, channel: Channel, warnings: &mut Vec<String>) -> Result<Map, FormatError> {
    let alpha = raster.has_alpha().then_some(raster.channels - 1);
    let Raster { width, height, channels: n, data } = raster;
    let coloured = n >= 3;
    let one = |k: usize| move |t: &[f32], out: &mut Vec<f32>| out.push(t[k]);
    let luminance = |t: &[f32], out: &mut Vec<f32>| {
        out.push(LUMINANCE[0] * t[0] + LUMINANCE[1] * t[1] + LUMINANCE[2] * t[2]);
    };
    let turn = |channels: usize, texel: &dyn Fn(&[f32], &mut Vec<f32>)| {
        let mut out = Vec::with_capacity(width * height * channels);
        for row in data.chunks_exact(width * n).rev() {
            row.chunks_exact(n).for_each(|t| texel(t, &mut out));
        }
        Map { width, height, channels, data: out }
    };
    let map = match channel {
        Channel::A => match alpha {
            Some(k) => turn(1, &one(k)),
            None => return Err(FormatError::new(path, "no alpha channel").hint("choose another channel")),
        },
        Channel::Rgb if coloured => turn(3, &|t, out| out.extend_from_slice(&t[..3])),
        Channel::Rgb => turn(3, &|t, out| out.extend_from_slice(&[t[0]; 3])),
        Channel::G if coloured => turn(1, &one(1)),
        Channel::B if coloured => turn(1, &one(2)),
        Channel::Luminance if coloured => turn(1, &luminance),
        Channel::Auto if coloured && data.chunks_exact(n).any(|t| t[0] != t[1] || t[0] != t[2]) => {
            warnings.push("a coloured image where a greyscale map is wanted; its luminance was taken".to_owned());
            turn(1, &luminance)
        }
        _ => turn(1, &one(0)),
    };
    if let Some(k) = map.data.iter().position(|v| !v.is_finite()) {
        let (x, y) = (k / map.channels % width, height - 1 - k / map.channels / width);
        let what = format!("a value is {}, not a finite number", map.data[k]);
        return Err(FormatError::new(path, what).at(format!("texel {x}, {y} from the top left")));
    }
    Ok(map)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use std::path::PathBuf;
    use tempfile::TempDir;

    /// A file of the given content under a name that says nothing.
    fn file(bytes: &[u8]) -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.data");
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    fn map(bytes: &[u8], channel: Channel, color: bool) -> Result<ReadMap, FormatError> {
        read_map(&file(bytes).1, channel, color)
    }

    fn values(bytes: &[u8], channel: Channel) -> Vec<f32> {
        let (_folder, path) = file(bytes);
        read_map(&path, channel, false).unwrap().map.data
    }

    fn png(w: u32, h: u32, bytes: &[u8], kind: image::ExtendedColorType) -> Vec<u8> {
        let mut out = Vec::new();
        image::codecs::png::PngEncoder::new(&mut out).write_image(bytes, w, h, kind).unwrap();
        out
    }

    fn tiff<C: tiff::encoder::colortype::ColorType>(w: u32, h: u32, data: &[C::Inner]) -> Vec<u8>
    where
        [C::Inner]: tiff::encoder::TiffValue,
    {
        let mut out = Cursor::new(Vec::new());
        tiff::encoder::TiffEncoder::new(&mut out).unwrap().write_image::<C>(w, h, data).unwrap();
        out.into_inner()
    }

    fn exr(w: usize, h: usize, channels: &[(&str, exr::prelude::FlatSamples)]) -> Vec<u8> {
        use exr::prelude::*;
        let list = channels.iter().map(|(name, v)| AnyChannel::new(*name, v.clone())).collect::<SmallVec<_>>();
        let layer = Layer::new((w, h), LayerAttributes::default(), Encoding::FAST_LOSSLESS, AnyChannels::sort(list));
        let mut out = Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut out).unwrap();
        out.into_inner()
    }

    const RGBA: [u8; 8] = [255, 0, 0, 51, 10, 20, 30, 255];

    #[test]
    fn png_of_every_kind() {
        use image::ExtendedColorType as T;
        // Two rows: the lower one comes first.
        assert_eq!(values(&png(1, 2, &[0, 255], T::L8), Channel::Auto), [1.0, 0.0]);
        assert_eq!(values(&png(1, 1, &[51, 102], T::La8), Channel::Auto), [0.2]);
        assert_eq!(values(&png(1, 1, &[51, 102], T::La8), Channel::A), [0.4]);
        let grey16: Vec<u8> = [0u16, 13107, 65535].iter().flat_map(|v| v.to_ne_bytes()).collect();
        assert_eq!(values(&png(3, 1, &grey16, T::L16), Channel::R), [0.0, 0.2, 1.0]);
        let rgba = png(2, 1, &RGBA, T::Rgba8);
        assert_eq!(values(&rgba, Channel::R), [1.0, 10.0 / 255.0]);
        assert_eq!(values(&rgba, Channel::G), [0.0, 20.0 / 255.0]);
        assert_eq!(values(&rgba, Channel::B), [0.0, 30.0 / 255.0]);
        assert_eq!(values(&rgba, Channel::A), [0.2, 1.0]);
        assert_eq!(values(&rgba, Channel::Rgb).len(), 6);
        assert_eq!(values(&rgba, Channel::Luminance)[0], 0.2126);
        assert_eq!(values(&png(1, 1, &[51], T::L8), Channel::Rgb), [0.2; 3]);
        let (_folder, path) = file(&rgba);
        assert_eq!(read_size(&path).unwrap(), (2, 1));
        let e = map(&png(1, 1, &[51], T::L8), Channel::A, false);
        assert!(e.is_err());
    }

    #[test]
    fn automatic_choice_of_the_channel() {
        use image::ExtendedColorType as T;
        let read = |bytes: &[u8]| {
            let (_folder, path) = file(&png(1, 1, bytes, T::Rgb8));
            read_map(&path, Channel::Auto, false).unwrap()
        };
        assert_eq!((read(&[255; 3]).map.data, read(&[255; 3]).warnings.len()), (vec![1.0], 0));
        let coloured = read(&[255, 0, 0]);
        assert_eq!((coloured.map.data, coloured.warnings.len()), (vec![0.2126], 1));
    }

    #[test]
    fn colour_is_decoded_and_alpha_is_not() {
        let (_folder, path) = file(&png(2, 1, &RGBA, image::ExtendedColorType::Rgba8));
        let rgb = read_map(&path, Channel::Rgb, true).unwrap().map.data;
        assert_eq!(rgb[..3], [1.0, 0.0, 0.0]);
        assert!((rgb[3] - 0.003_035_27).abs() < 1e-7, "below the knee: 10 / 255 / 12.92");
        assert!((rgb[5] - 0.012_983_03).abs() < 1e-7, "above it");
        assert_eq!(read_map(&path, Channel::A, true).unwrap().map.data, [0.2, 1.0]);
        let grey: Vec<u8> = 32768u16.to_ne_bytes().to_vec();
        let (_folder, path) = file(&png(1, 1, &grey, image::ExtendedColorType::L16));
        assert!((read_map(&path, Channel::Auto, true).unwrap().map.data[0] - 0.214_048).abs() < 1e-5);
    }

    #[test]
    fn tiff_integers_and_floats() {
        use tiff::encoder::colortype::{Gray8, Gray16, Gray32, Gray32Float, RGB8, RGB16, RGB32Float, RGBA8};
        assert_eq!(values(&tiff::<Gray8>(1, 2, &[0, 51]), Channel::Auto), [0.2, 0.0]);
        assert_eq!(values(&tiff::<Gray16>(2, 1, &[13107, 65535]), Channel::Auto), [0.2, 1.0]);
        assert_eq!(values(&tiff::<Gray32Float>(2, 1, &[-3.5, 1e6]), Channel::Auto), [-3.5, 1e6]);
        assert_eq!(values(&tiff::<RGB8>(1, 1, &[255, 51, 0]), Channel::G), [0.2]);
        assert_eq!(values(&tiff::<RGB16>(1, 1, &[0, 0, 65535]), Channel::Rgb), [0.0, 0.0, 1.0]);
        assert_eq!(values(&tiff::<RGB32Float>(1, 1, &[2.0, 3.0, 4.0]), Channel::B), [4.0]);
        assert_eq!(values(&tiff::<RGBA8>(1, 1, &[0, 0, 0, 51]), Channel::A), [0.2]);
        let (_folder, path) = file(&tiff::<Gray8>(3, 2, &[0; 6]));
        assert_eq!(read_size(&path).unwrap(), (3, 2));
        let (_folder, path) = file(&tiff::<Gray32>(1, 1, &[7]));
        assert!(read_map(&path, Channel::Auto, false).unwrap_err().what.contains("32 bits"));
    }

    #[test]
    fn exr_channels_by_name() {
        use exr::prelude::{FlatSamples, f16};
        let half = |v: &[f32]| FlatSamples::F16(v.iter().map(|x| f16::from_f32(*x)).collect());
        let float = |v: &[f32]| FlatSamples::F32(v.to_vec());
        assert_eq!(values(&exr(1, 2, &[("Y", half(&[0.5, 2.0]))]), Channel::Auto), [2.0, 0.5]);
        assert_eq!(values(&exr(2, 1, &[("length", FlatSamples::U32(vec![7, 70000]))]), Channel::Auto), [7.0, 70000.0]);
        let rgba = [("A", half(&[0.25])), ("B", float(&[3.0])), ("G", float(&[2.0])), ("R", float(&[1.0]))];
        assert_eq!(values(&exr(1, 1, &rgba), Channel::Rgb), [1.0, 2.0, 3.0]);
        assert_eq!(values(&exr(1, 1, &rgba), Channel::A), [0.25]);
        assert_eq!(values(&exr(1, 1, &rgba), Channel::G), [2.0]);
        let (_folder, path) = file(&exr(1, 1, &rgba));
        let auto = read_map(&path, Channel::Auto, false).unwrap();
        assert_eq!((auto.map.data, auto.warnings.len()), (vec![0.2126 + 0.7152 * 2.0 + 0.0722 * 3.0], 1));
        let layered = [("hair.B", float(&[3.0])), ("hair.G", float(&[2.0])), ("hair.R", float(&[1.0]))];
        assert_eq!(values(&exr(1, 1, &layered), Channel::Rgb), [1.0, 2.0, 3.0]);
        let (_folder, path) = file(&exr(1, 1, &[("t0", float(&[1.0])), ("t1", float(&[1.0]))]));
        assert!(read_map(&path, Channel::Auto, false).unwrap_err().what.contains("its channels: t0, t1"));
        assert_eq!(read_size(&path).unwrap(), (1, 1));
    }

    #[test]
    fn exr_data_window_is_laid_into_the_display_window() {
        use exr::prelude::*;
        let list: SmallVec<_> =
            [AnyChannel::new("Y", FlatSamples::F32(vec![1.0, 2.0, 3.0, 4.0]))].into_iter().collect();
        let attributes = LayerAttributes { layer_position: Vec2(1, -1), ..LayerAttributes::default() };
        let layer = Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list));
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::new((0, 0), (2, 2));
        let mut out = Cursor::new(Vec::new());
        image.write().to_buffered(&mut out).unwrap();
        let (_folder, path) = file(&out.into_inner());
        let read = read_map(&path, Channel::Auto, false).unwrap();
        assert_eq!(read.map.data, [0.0, 0.0, 0.0, 3.0]);
        assert_eq!(read.warnings.len(), 1);
    }

    #[test]
    fn texels_that_are_no_numbers_are_named() {
        use exr::prelude::FlatSamples;
        let (_folder, path) = file(&exr(2, 2, &[("Y", FlatSamples::F32(vec![0.0, 0.0, f32::NAN, 0.0]))]));
        let e = read_map(&path, Channel::Auto, false).unwrap_err().to_string();
        assert!(e.contains("(texel 0, 1 from the top left): a value is NaN"), "{e}");
        let bytes = tiff::<tiff::encoder::colortype::Gray32Float>(2, 1, &[0.0, f32::INFINITY]);
        let (_folder, path) = file(&bytes);
        assert!(read_map(&path, Channel::Auto, false).unwrap_err().to_string().contains("(texel 1, 0"));
    }

    #[test]
    fn broken_foreign_and_huge_files_are_errors() {
        let error = |bytes: &[u8]| {
            let (_folder, path) = file(bytes);
            assert!(read_size(&path).is_err() || read_map(&path, Channel::Auto, false).is_err());
            read_map(&path, Channel::Auto, false).unwrap_err().what
        };
        let noise: Vec<u8> = (0..40 * 40u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let sources = [
            png(40, 40, &noise, image::ExtendedColorType::L8),
            tiff::<tiff::encoder::colortype::Gray8>(40, 40, &noise),
            exr(40, 40, &[("Y", exr::prelude::FlatSamples::F32(noise.iter().map(|b| f32::from(*b)).collect()))]),
        ];
        for whole in &sources {
            for cut in [4, 20, 60, whole.len() / 2, whole.len() - 100] {
                assert!(!error(&whole[..cut]).is_empty());
            }
        }
        let mut flipped = sources[0].clone();
        flipped[900] ^= 1;
        assert!(error(&flipped).contains("cannot be decoded"));
        assert!(error(&[0xff, 0xd8, 0xff, 0xe0, 0, 0, 0, 0]).contains("the content is JPG"));
        assert!(error(b"").contains("empty"));
        assert!(error(b"hello").contains("neither PNG nor TIFF nor OpenEXR"));
        // A PNG header that claims 20000 x 2 texels, with a right checksum.
        let wide = png(20000, 2, &[0; 40000], image::ExtendedColorType::L8);
        assert!(error(&wide).contains("at most 16384 x 16384"));
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.png");
        write_png(&path, 1, 2, &[255, 0, 0, 0, 51, 0]).unwrap();
        assert_eq!(read_map(&path, Channel::Rgb, false).unwrap().map.data, [0.0, 0.2, 0.0, 1.0, 0.0, 0.0]);
        write_png_gray16(&path, 2, 1, &[13107, 1]).unwrap();
        assert_eq!(read_map(&path, Channel::Auto, false).unwrap().map.data, [0.2, 1.0 / 65535.0]);
        assert!(write_png(&path, 2, 2, &[0; 3]).is_err());
        assert!(
            write_png(&folder.path().join("no/such/folder.png"), 1, 1, &[0; 3])
                .unwrap_err()
                .what
                .contains("cannot be written")
        );
    }
}
