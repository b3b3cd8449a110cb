//! Broken maps.

use super::{Corpus, noise};
use pelage_tests::grey_png;

const MAP: &str = "maps/half.png";

/// Puts another header into a PNG; the checksum fits if `mended`.
fn with_header(width: u32, height: u32, depth: u8, color: u8) -> Vec<u8> {
    let mut file = grey_png(64, 64, |x, y| (x ^ y) as u8);
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([depth, color, 0, 0, 0]);
    let crc = crc(&header);
    file[12..29].copy_from_slice(&header);
    file[29..33].copy_from_slice(&crc.to_be_bytes());
    file
}

fn crc(data: &[u8]) -> u32 {
    !data.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 })
    })
}

#[test]
fn images_that_are_broken() {
    let mut corpus = Corpus::new();
    let good = grey_png(64, 64, |x, y| (x ^ y) as u8);
    let mut try_one = |case: &str, broken: &[u8], words: &str| {
        corpus.refuse(case, MAP, broken, &format!("half.png|{words}|help:"));
    };
    try_one("empty", b"", "empty");
    try_one("garbage", &noise(3000), "neither PNG nor TIFF nor OpenEXR");
    try_one("signature only", &good[..8], "decoded");
    for share in [0.01, 0.3, 0.9] {
        try_one("cut short", &good[..(share * good.len() as f64) as usize], "decoded");
    }
    let mut flipped = good.clone();
    flipped[good.len() / 2] ^= 0x10;
    try_one("one bit of the texels", &flipped, "decoded");
    let mut flipped = good.clone();
    flipped[29] ^= 1;
    try_one("checksum of the header", &flipped, "decoded");
    let mut swapped = good.clone();
    swapped.drain(33..good.len() - 12);
    try_one("no texels", &swapped, "decoded");
    for (w, h) in [(0, 64), (64, 0), (60_000, 60_000), (u32::MAX, u32::MAX), (16_385, 1), (64, 640)] {
        try_one(&format!("{w} x {h} in the header"), &with_header(w, h, 8, 0), "image");
    }
    for (depth, color) in [(3, 0), (8, 5), (255, 255), (16, 6)] {
        try_one(&format!("depth {depth} colour {color}"), &with_header(64, 64, depth, color), "image");
    }
    try_one("JPEG by another name", b"\xff\xd8\xff\xe0\x00\x10JFIF\x00\x01\x01\x00\x00\x01", "JPG");
    try_one("GIF by another name", b"GIF89a\x01\x00\x01\x00\x00\xff\x00,", "GIF");
    let tiff = b"II*\x00\x08\x00\x00\x00";
    try_one("TIFF without a directory", tiff, "image");
    try_one("TIFF with its directory far away", b"II*\x00\xff\xff\xff\x7f", "image");
    try_one("TIFF of garbage", &[tiff.as_slice(), &noise(800)].concat(), "image");
    let exr = b"\x76\x2f\x31\x01\x02\x00\x00\x00";
    try_one("OpenEXR without a header", exr, "image");
    try_one("OpenEXR of garbage", &[exr.as_slice(), &noise(800)].concat(), "image");
    corpus.finish();
}

#[test]
fn every_place_that_takes_a_map_refuses_a_broken_one() {
    let mut corpus = Corpus::new();
    corpus.refuse("length", "maps/length.png", b"no image", "length.png|help:");
    corpus.shot.write("maps/broken.png", b"no image");
    let groom = "grooms/ball.toml";
    for (from, to) in [
        ("color = { value", "color = { map = \"../maps/broken.png\", value"),
        ("width = { value", "width = { map = \"../maps/broken.png\", value"),
        ("[[layer]]", "[[layer]]\nopacity = { value = 1.0, map = \"../maps/broken.png\" }"),
        ("[[layer]]", "[[layer]]\non_off = { map = \"../maps/broken.png\" }"),
        ("bend = 0.6", "region = { map = \"../maps/broken.png\" }"),
        ("points = 6", "length = { value = 2.0, map = \"../maps/broken.png\" }"),
        ("[[layer]]", "[[comb]]\nkind = \"direction-map\"\nmap = { map = \"../maps/broken.png\" }\n[[layer]]"),
        ("[[layer]]", "[[comb]]\nkind = \"bend\"\nangle = 10\nmap = { map = \"../maps/broken.png\" }\n[[layer]]"),
    ] {
        corpus.refuse_edit(groom, from, to, "broken.png|help:");
    }
    corpus.refuse_edit(groom, "half.png", "gone.png", "ball.toml|layer[0].density.map|gone.png|help:");
    corpus.refuse_edit(groom, "half.png", "half.<UDIM>.png", "ball.toml|layer[0].density.map|<UDIM>|help:");
    corpus.refuse_edit(groom, "../maps/half.png", "../maps", "ball.toml|layer[0].density.map|not a file");
    corpus.shot.write("maps/tile.1001.png", grey_png(8, 8, |_, _| 255));
    corpus.shot.write("maps/tile.1002.png", b"no image");
    corpus.refuse_edit(groom, "half.png", "tile.<UDIM>.png", "tile.1002.png|help:");
    let grey = "half.png\" }";
    corpus.refuse_edit(groom, grey, "half.png\", channel = \"a\" }", "half.png|alpha");
    corpus.finish();
}
