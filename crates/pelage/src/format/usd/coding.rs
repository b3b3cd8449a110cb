//! The two packings of crate files: LZ4 in chunks (`pxr/base/tf/fastCompression.cpp`) and integers as differences
//! (`pxr/usd/sdf/integerCoding.cpp`).

use crate::format::bytes::{Broken, Bytes};
use std::collections::BTreeMap;

/// Longest input of one LZ4 block.
const MAX_BLOCK: usize = 0x7E00_0000;
/// LZ4 cannot make anything smaller than this fraction, so a file that claims more is broken.
const MAX_RATIO: u64 = 255;
/// Most integers in one packed array. Above it a small broken file could ask for gigabytes, below it a real one
/// (counts of 100 million curves, say) could be refused.
const MAX_INTEGERS: u64 = 1 << 28;

/// Packs bytes as one LZ4 block.
pub(super) fn compress(bytes: &[u8]) -> Vec<u8> {
    assert!(bytes.len() <= MAX_BLOCK, "tables of more than 2 GB");
    let mut out = vec![0];
    out.extend(lz4_flex::block::compress(bytes));
    out
}

/// Unpacks bytes that become at most `max` long.
pub(super) fn decompress(packed: &[u8], max: u64) -> Result<Vec<u8>, Broken> {
    if max > MAX_RATIO * packed.len() as u64 + 64 {
        return Err(format!("{} packed bytes are said to hold {max} bytes, which LZ4 cannot do", packed.len()));
    }
    let mut input = Bytes::new(packed);
    let chunks = input.u8()?;
    // The memory is touched only as far as real data reaches, whatever `max` says.
    let mut out = vec![0u8; max as usize];
    let mut filled = 0;
    let mut unpack = |block: &[u8]| -> Result<(), Broken> {
        let n = lz4_flex::block::decompress_into(block, &mut out[filled..])
            .map_err(|e| format!("the LZ4 data is broken: {e}"))?;
        filled += n;
        Ok(())
    };
    if chunks == 0 {
        unpack(input.rest())?;
    } else {
        for _ in 0..chunks {
            let n = input.i32()?;
            unpack(input.take(u64::try_from(n).map_err(|_| "an LZ4 chunk has a negative size".to_string())?)?)?;
        }
    }
    out.truncate(filled);
    Ok(out)
}

/// Packs 32-bit integers: differences; the most common one costs 2 bits, others 1, 2 or 4 bytes more.
pub(super) fn encode_ints(values: &[i32]) -> Vec<u8> {
    let mut previous = 0i32;
    let differences: Vec<i32> = values.iter().map(|&v| v.wrapping_sub(std::mem::replace(&mut previous, v))).collect();
    let mut frequency = BTreeMap::new();
    for &d in &differences {
        *frequency.entry(d).or_insert(0usize) += 1;
    }
    let common = frequency.iter().max_by_key(|&(d, n)| (*n, *d)).map_or(0, |(d, _)| *d);
    let mut codes = vec![0u8; values.len().div_ceil(4)];
    let mut rest = Vec::new();
    for (i, &d) in differences.iter().enumerate() {
        let code = if d == common {
            0
        } else if let Ok(small) = i8::try_from(d) {
            rest.extend(small.to_le_bytes());
            1
        } else if let Ok(small) = i16::try_from(d) {
            rest.extend(small.to_le_bytes());
            2
        } else {
            rest.extend(d.to_le_bytes());
            3
        };
        codes[i / 4] |= code << (i % 4 * 2);
    }
    compress(&[&common.to_le_bytes()[..], &codes, &rest].concat())
}

/// Unpacks `n` integers of 32 bits, or of 64 if `wide`. 32-bit ones come out sign-extended.
pub(super) fn decode_ints(packed: &[u8], n: u64, wide: bool) -> Result<Vec<i64>, Broken> {
    if n > MAX_INTEGERS {
        return Err(format!("{n} packed integers are more than any real file has"));
    }
    let (width, sizes) = if wide { (8, [0u64, 2, 4, 8]) } else { (4, [0u64, 1, 2, 4]) };
    let longest = width + n.div_ceil(4) + n * width;
    let bytes = decompress(packed, longest.min(MAX_RATIO * packed.len() as u64))?;
    let mut input = Bytes::new(&bytes);
    let signed = |bytes: &[u8]| {
        let mut v = if bytes.last().is_some_and(|b| b & 0x80 != 0) { [0xff; 8] } else { [0; 8] };
        v[..bytes.len()].copy_from_slice(bytes);
        i64::from_le_bytes(v)
    };
    let common = signed(input.take(width)?);
    let codes = input.take(n.div_ceil(4))?;
    let mut out = Vec::with_capacity(n as usize);
    let mut value = 0i64;
    for i in 0..n as usize {
        let code = codes[i / 4] >> (i % 4 * 2) & 3;
        let difference = if code == 0 { common } else { signed(input.take(sizes[code as usize])?) };
        value = value.wrapping_add(difference);
        if !wide {
            value = i64::from(value as i32);
        }
        out.push(value);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_come_back() {
        let mut values = vec![0, 1, 2, 3, 3, 3, -1, 300, -40_000, i32::MAX, i32::MIN, 7];
        for n in 0..40 {
            values.push(n * n * 1001 - 5);
            let packed = encode_ints(&values);
            let back = decode_ints(&packed, values.len() as u64, false).unwrap();
            assert!(back.iter().map(|&v| v as i32).eq(values.iter().copied()));
        }
        assert_eq!(decode_ints(&encode_ints(&[]), 0, false), Ok(vec![]));
    }

    #[test]
    fn broken_packings_are_refused() {
        let packed = encode_ints(&(0..500).map(|i| i * i).collect::<Vec<_>>());
        assert!(decode_ints(&packed, u64::MAX / 8, false).is_err());
        assert!(decode_ints(&packed, 50_000, false).is_err());
        assert!(decode_ints(&packed[..packed.len() / 2], 500, false).is_err());
        assert!(decompress(&[], 10).is_err() && decompress(&[3, 255, 255, 255, 255], 10).is_err());
        for i in 0..packed.len() {
            let mut bad = packed.clone();
            bad[i] ^= 0x55;
            if let Ok(v) = decode_ints(&bad, 500, false) {
                assert_eq!(v.len(), 500);
            }
        }
    }

    #[test]
    fn wide_integers_decode() {
        // common difference 5; codes 0, 2 (i32: -70000), 3 (i64), 0
        let mut raw = 5i64.to_le_bytes().to_vec();
        raw.push(0b00_11_10_00);
        raw.extend((-70_000i32).to_le_bytes());
        raw.extend((1i64 << 40).to_le_bytes());
        let expected = vec![5, 5 - 70_000, 5 - 70_000 + (1 << 40), 10 - 70_000 + (1i64 << 40)];
        assert_eq!(decode_ints(&compress(&raw), 4, true), Ok(expected));
    }

    #[test]
    fn several_chunks_unpack() {
        let (a, b) = (vec![7u8; 1000], vec![9u8; 300]);
        let mut packed = vec![2];
        for part in [&a, &b] {
            let block = lz4_flex::block::compress(part);
            packed.extend((block.len() as i32).to_le_bytes());
            packed.extend(block);
        }
        assert_eq!(decompress(&packed, 1300), Ok([a, b].concat()));
    }
}
