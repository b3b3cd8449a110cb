//! PLY files for tests, written by hand so that they do not depend on what they test.

/// Name, properties as in the header without the first word, and rows (a list is its length, then its values).
#[derive(Clone)]
pub(super) struct Element {
    name: String,
    properties: Vec<String>,
    rows: Vec<Vec<f64>>,
}

/// Two squares side by side; vertex coordinates fit every type.
pub(super) const QUAD_VERTICES: &[&[f64]] =
    &[&[0.0, 0.0, 0.0], &[1.0, 0.0, 0.0], &[1.0, 1.0, 0.0], &[0.0, 1.0, 0.0], &[2.0, 0.0, 0.0], &[2.0, 1.0, 0.0]];
/// Their faces.
pub(super) const QUAD_FACES: &[&[f64]] = &[&[4.0, 0.0, 1.0, 2.0, 3.0], &[4.0, 1.0, 4.0, 5.0, 2.0]];

pub(super) fn element(name: &str, properties: &[&str], rows: &[&[f64]]) -> Element {
    Element {
        name: name.to_owned(),
        properties: properties.iter().map(|p| (*p).to_owned()).collect(),
        rows: rows.iter().map(|r| r.to_vec()).collect(),
    }
}

pub(super) fn quads(encoding: &str) -> Vec<u8> {
    let vertex = element("vertex", &["float x", "float y", "float z"], QUAD_VERTICES);
    encode(encoding, &[vertex, element("face", &["list uchar int vertex_indices"], QUAD_FACES)])
}

pub(super) fn encode(encoding: &str, elements: &[Element]) -> Vec<u8> {
    let mut text = format!("ply\nformat {encoding} 1.0\ncomment by hand\n");
    for e in elements {
        text += &format!("element {} {}\n", e.name, e.rows.len());
        e.properties.iter().for_each(|p| text += &format!("property {p}\n"));
    }
    let mut out = (text + "end_header\n").into_bytes();
    for e in elements {
        for row in &e.rows {
            if encoding == "ascii" {
                let words: Vec<String> = row.iter().map(f64::to_string).collect();
                out.extend((words.join(" ") + "\n").into_bytes());
                continue;
            }
            let mut values = row.iter();
            for p in &e.properties {
                let words: Vec<&str> = p.split_whitespace().collect();
                let mut put = |kind: &str| {
                    let v = *values.next().unwrap();
                    out.extend(bytes(kind, v, encoding == "binary_big_endian"));
                    v as usize
                };
                if words[0] == "list" {
                    for _ in 0..put(words[1]) {
                        put(words[2]);
                    }
                } else {
                    put(words[0]);
                }
            }
        }
    }
    out
}

fn bytes(kind: &str, v: f64, big: bool) -> Vec<u8> {
    let mut b = match kind {
        "char" | "int8" => (v as i8).to_le_bytes().to_vec(),
        "uchar" | "uint8" => vec![v as u8],
        "short" | "int16" => (v as i16).to_le_bytes().to_vec(),
        "ushort" | "uint16" => (v as u16).to_le_bytes().to_vec(),
        "int" | "int32" => (v as i32).to_le_bytes().to_vec(),
        "uint" | "uint32" => (v as u32).to_le_bytes().to_vec(),
        "float" | "float32" => (v as f32).to_le_bytes().to_vec(),
        _ => v.to_le_bytes().to_vec(),
    };
    if big {
        b.reverse();
    }
    b
}
