//! The `.hair` format of C. Yuksel (cyHairFile): a 128-byte header and flat little-endian arrays. It states neither
//! units nor an up axis; his own models are z-up.

use super::FormatError;
use super::ply::{Curves, read_bytes};
use pelage_geom::Offsets;
use std::path::Path;

const HEADER: usize = 128;
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCY: u32 = 8;
const COLORS: u32 = 16;

/// Reads a `.hair` file. Thickness is taken as a diameter; a default thickness other than 1 (which writers leave in
/// when they mean nothing) stands for all points. Transparency and colours are passed over. The header's text becomes
/// the one comment.
pub fn read_hair(path: &Path) -> Result<Curves, FormatError> {
    parse_hair(path, &read_bytes(path)?)
}

/// The numbers of a header, and where the arrays lie.
struct Header {
    hairs: usize,
    points: usize,
    arrays: u32,
    segments: usize,
    thickness: f32,
    /// Ends of segments, points, thickness and of everything; the segments start after the header.
    ends: [usize; 4],
}

fn parse_header(path: &Path, bytes: &[u8]) -> Result<Header, FormatError> {
    let wrong = |what: String| Err(FormatError::new(path, what));
    if bytes.len() < HEADER || !bytes.starts_with(b"HAIR") {
        return wrong("not a .hair file: it does not start with 'HAIR' and a header of 128 bytes".to_owned());
    }
    let word = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let (hairs, points, arrays) = (word(4) as usize, word(8) as usize, word(12));
    if hairs == 0 {
        return wrong("holds no hairs".to_owned());
    }
    if arrays & POINTS == 0 {
        return wrong("holds no points (bit 1 of its arrays is not set)".to_owned());
    }
    let has = |bit: u32, bytes: u64| if arrays & bit != 0 { bytes } else { 0 };
    let (h, p) = (hairs as u64, points as u64);
    let start = HEADER as u64 + has(SEGMENTS, 2 * h);
    let thickness = start + 12 * p + has(THICKNESS, 4 * p);
    let all = thickness + has(TRANSPARENCY, 4 * p) + has(COLORS, 12 * p);
    if all > bytes.len() as u64 {
        let what = format!("{hairs} hairs with {points} points need {all} bytes, but the file has {}", bytes.len());
        let hint = "the file was cut short or its header is wrong; export or copy it again";
        return Err(FormatError::new(path, what).hint(hint));
    }
    let ends = [start, start + 12 * p, thickness, all].map(|e| e as usize);
    Ok(Header { hairs, points, arrays, segments: word(16) as usize, thickness: f32::from_bits(word(20)), ends })
}

/// Segments of each hair; their points must sum to what the header says.
fn segments(path: &Path, bytes: &[u8], header: &Header) -> Result<Vec<usize>, FormatError> {
    let Header { hairs, points, segments, .. } = *header;
    let wrong = |what: String| Err(FormatError::new(path, what));
    if header.arrays & SEGMENTS == 0 {
        return match hairs as u64 * (segments as u64 + 1) == points as u64 {
            true => Ok(vec![segments; hairs]),
            false => wrong(format!("{hairs} hairs of {} points do not give {points} points", segments as u64 + 1)),
        };
    }
    let pairs = bytes[HEADER..header.ends[0]].chunks_exact(2);
    let list: Vec<usize> = pairs.map(|b| usize::from(u16::from_le_bytes([b[0], b[1]]))).collect();
    match list.iter().map(|s| s + 1).sum::<usize>() {
        total if total == points => Ok(list),
        total => wrong(format!("its hairs have {total} points in all, its header says {points}")),
    }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn parse_hair(path: &Path, bytes: &[u8]) -> Result<Curves, FormatError> {
    let header = parse_header(path, bytes)?;
    let segments = segments(path, bytes, &header)?;
    let position = floats(&bytes[header.ends[0]..header.ends[1]]);
    let thickness: Option<Vec<f32>> = match header.arrays & THICKNESS {
        0 if header.thickness.is_finite() && header.thickness > 0.0 && header.thickness != 1.0 => {
            Some(vec![header.thickness; header.points])
        }
        0 => None,
        _ => Some(floats(&bytes[header.ends[1]..header.ends[2]])),
    };
    let mut out = Curves { width: thickness.as_ref().map(|_| Vec::new()), ..Curves::default() };
    let info = String::from_utf8_lossy(&bytes[40..HEADER]).trim_end_matches('\0').trim().to_owned();
    out.comments.extend((!info.is_empty()).then_some(info));
    let rest = bytes.len() - header.ends[3];
    out.warnings.extend((rest > 0).then(|| format!("{rest} bytes after the last array were ignored")));
    let (mut first, mut counts) = (0, Vec::with_capacity(header.hairs));
    for (h, s) in segments.iter().enumerate() {
        let range = first..first + s + 1;
        first = range.end;
        for p in range.clone() {
            let at = [position[3 * p], position[3 * p + 1], position[3 * p + 2]];
            let width = thickness.as_ref().map(|t| t[p]);
            if !at.iter().chain(&width).all(|x| x.is_finite()) {
                let what = "position or thickness is not a finite number";
                return Err(FormatError::new(path, what).at(format!("hair {h}, point {}", p - range.start)));
            }
            if *s > 0 {
                out.strands.position.push(at);
                out.width.iter_mut().for_each(|w| w.extend(width));
            }
        }
        counts.extend((*s > 0).then_some(s + 1));
    }
    if counts.is_empty() {
        return Err(FormatError::new(path, "no hair has a segment"));
    }
    if counts.len() < header.hairs {
        out.warnings.push(format!("{} hairs without a segment were skipped", header.hairs - counts.len()));
    }
    out.strands.offsets = Offsets::from_counts(counts);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pelage_geom::Strands;

    /// A `.hair` file of curves with the origin added, diameters as thickness if given.
    fn encode(strands: &Strands, width: Option<&[f32]>, info: &str) -> Result<Vec<u8>, String> {
        let points = strands.position.len();
        if strands.offsets.total() != points || width.is_some_and(|w| w.len() != points) {
            return Err(format!("{points} positions do not fit the offsets or the widths"));
        }
        let uniform = strands.offsets.uniform_count();
        let mut arrays = POINTS;
        arrays |= if uniform.is_none() { SEGMENTS } else { 0 };
        arrays |= if width.is_some() { THICKNESS } else { 0 };
        let mut out = Vec::with_capacity(HEADER + 16 * points);
        out.extend_from_slice(b"HAIR");
        let segments = uniform.map_or(0, |n| n.saturating_sub(1) as u32);
        for v in [strands.len() as u32, points as u32, arrays, segments] {
            out.extend_from_slice(&v.to_le_bytes());
        }
        for v in [1.0f32, 0.0, 1.0, 1.0, 1.0] {
            out.extend_from_slice(&v.to_le_bytes());
        }
        let text = info.as_bytes();
        out.extend_from_slice(&text[..text.len().min(HEADER - out.len())]);
        out.resize(HEADER, 0);
        for (s, n) in strands.offsets.counts().enumerate() {
            let Some(segments) = n.checked_sub(1).filter(|s| *s > 0).and_then(|s| u16::try_from(s).ok()) else {
                return Err(format!("hair {s} has {n} points; the format holds 2 to 65536"));
            };
            if uniform.is_none() {
                out.extend_from_slice(&segments.to_le_bytes());
            }
        }
        for p in &strands.position {
            for (x, o) in p.iter().zip(strands.origin) {
                out.extend_from_slice(&((f64::from(*x) + o) as f32).to_le_bytes());
            }
        }
        for w in width.unwrap_or_default() {
            out.extend_from_slice(&w.to_le_bytes());
        }
        Ok(out)
    }

    fn strands(counts: &[usize]) -> Strands {
        let n: usize = counts.iter().sum();
        Strands {
            offsets: Offsets::from_counts(counts.iter().copied()),
            position: (0..n).map(|i| [i as f32, 0.5, -1.0]).collect(),
            ..Strands::default()
        }
    }

    fn parse(bytes: &[u8]) -> Result<Curves, FormatError> {
        parse_hair(Path::new("t.hair"), bytes)
    }

    fn error(bytes: &[u8]) -> String {
        parse(bytes).unwrap_err().to_string()
    }

    #[test]
    fn what_is_written_is_read() {
        for counts in [&[4, 4, 4][..], &[2, 5, 3]] {
            let s = strands(counts);
            let back = parse(&encode(&s, None, "units: cm").unwrap()).unwrap();
            assert_eq!(back, Curves { strands: s.clone(), comments: vec!["units: cm".into()], ..Curves::default() });
            let w: Vec<f32> = (0..s.position.len()).map(|i| 0.01 * i as f32).collect();
            assert_eq!(parse(&encode(&s, Some(&w), "").unwrap()).unwrap().width, Some(w));
        }
        let mut far = strands(&[2]);
        far.origin = [100.0, 0.0, 0.0];
        assert_eq!(parse(&encode(&far, None, "").unwrap()).unwrap().strands.position[0], [100.0, 0.5, -1.0]);
    }

    #[test]
    fn colours_and_defaults_are_placed_right() {
        let mut bytes = encode(&strands(&[2, 2]), None, "").unwrap();
        bytes[12] |= (TRANSPARENCY | COLORS) as u8;
        bytes[20..24].copy_from_slice(&0.25f32.to_le_bytes());
        bytes.extend([0; 4 * 4 + 4 * 12]);
        let c = parse(&bytes).unwrap();
        assert_eq!((c.width, c.warnings.len()), (Some(vec![0.25; 4]), 0));
    }

    #[test]
    fn hairs_without_a_segment_are_skipped_and_counted() {
        let mut bytes = encode(&strands(&[2, 3, 2]), None, "").unwrap();
        bytes[HEADER..HEADER + 6].copy_from_slice(&[2, 0, 0, 0, 2, 0]);
        let c = parse(&bytes).unwrap();
        assert_eq!(c.strands.offsets, Offsets::from_counts([3, 3]));
        assert_eq!(c.strands.position[3][0], 4.0);
        assert!(c.warnings[0].contains("1 hairs"), "{:?}", c.warnings);
    }

    #[test]
    fn broken_files_are_named() {
        let good = encode(&strands(&[2, 3]), None, "").unwrap();
        let with = |at: usize, v: [u8; 4]| {
            let mut b = good.clone();
            b[at..at + 4].copy_from_slice(&v);
            b
        };
        assert!(error(&good[..good.len() - 1]).contains("need 192 bytes, but the file has 191"));
        assert!(error(&good[..60]).contains("header of 128"));
        assert!(error(b"ply\n").contains("not a .hair"));
        assert!(error(&with(4, [255; 4])).contains("need"));
        assert!(error(&with(8, [255; 4])).contains("need"));
        assert!(error(&with(4, [0; 4])).contains("no hairs"));
        assert!(error(&with(12, [1, 0, 0, 0])).contains("no points"));
        assert!(error(&with(12, [2, 0, 0, 0])).contains("do not give 5"));
        assert!(error(&with(HEADER, [1, 0, 9, 0])).contains("12 points in all"));
        let e = error(&with(HEADER + 4 + 12 * 3 + 4, f32::NAN.to_le_bytes()));
        assert!(e.contains("hair 1, point 1"), "{e}");
        assert_eq!(parse(&[good, vec![1, 2]].concat()).unwrap().warnings.len(), 1);
    }

    #[test]
    fn what_the_format_cannot_hold_is_refused() {
        assert!(encode(&strands(&[1, 3]), None, "").unwrap_err().contains("hair 0"));
        assert!(encode(&strands(&[2]), Some(&[1.0]), "").is_err());
    }
}
