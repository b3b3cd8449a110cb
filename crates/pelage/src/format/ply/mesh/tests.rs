use super::*;
use crate::format::ply::samples::{Element, QUAD_FACES, QUAD_VERTICES, element, encode, quads};

fn parse(bytes: &[u8]) -> Result<ReadMesh, FormatError> {
    parse_mesh(Path::new("m.ply"), bytes)
}

fn error(bytes: &[u8]) -> String {
    parse(bytes).unwrap_err().to_string()
}

fn positions(bytes: &[u8], n: usize) -> Result<Vec<[f64; 3]>, FormatError> {
    parse_positions(Path::new("m.ply"), bytes, n, Some(2))
}

/// The two quads with other declarations of the vertex and the face list.
fn quads_as(encoding: &str, scalar: &str, list: &str) -> Vec<u8> {
    let vertex = ["x", "y", "z"].map(|n| format!("{scalar} {n}"));
    let vertex: Vec<&str> = vertex.iter().map(String::as_str).collect();
    encode(encoding, &[element("vertex", &vertex, QUAD_VERTICES), element("face", &[list], QUAD_FACES)])
}

#[test]
fn every_encoding_and_type_gives_the_same_surface() {
    let want = parse(&quads("binary_little_endian")).unwrap();
    assert_eq!(want.mesh.triangle, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]);
    assert_eq!(want.mesh.face, [0, 0, 1, 1]);
    assert_eq!((want.faces, want.vertex_normals_present, want.warnings.len()), (2, false, 0));
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for scalar in ["char", "uchar", "int16", "ushort", "int", "uint32", "float32", "float", "double", "float64"] {
            assert_eq!(parse(&quads_as(encoding, scalar, "list uchar int vertex_indices")).unwrap(), want, "{scalar}");
        }
        for length in ["char", "uint8", "short", "ushort", "int32", "uint"] {
            for index in ["int8", "uchar", "short", "uint16", "int", "uint"] {
                let list = format!("list {length} {index} vertex_index");
                assert_eq!(parse(&quads_as(encoding, "float", &list)).unwrap(), want, "{list}");
            }
        }
    }
}

#[test]
fn order_of_elements_and_what_nobody_asked_for_do_not_matter() {
    let want = parse(&quads("ascii")).unwrap();
    let vertices: Vec<Vec<f64>> =
        QUAD_VERTICES.iter().map(|v| vec![2.0, 7.0, 8.0, v[2], v[0], 9.0, 0.0, 0.0, 1.0, v[1]]).collect();
    let rows: Vec<&[f64]> = vertices.iter().map(Vec::as_slice).collect();
    let vertex = element(
        "vertex",
        &["list uchar short junk", "float z", "float x", "uchar red", "float nx", "float ny", "float nz", "double y"],
        &rows,
    );
    let face = element(
        "face",
        &["uchar flag", "list uchar int vertex_indices", "double w"],
        &[&[1.0, 4.0, 0.0, 1.0, 2.0, 3.0, 0.5], &[0.0, 4.0, 1.0, 4.0, 5.0, 2.0, 0.5]],
    );
    let edge = element("edge", &["int vertex1", "int vertex2"], &[&[0.0, 1.0]]);
    let bag = element("bag", &["list int double v", "char c"], &[&[2.0, 5.0, 6.0, 7.0], &[0.0, 1.0]]);
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for order in [[&vertex, &face, &edge, &bag], [&bag, &face, &edge, &vertex], [&edge, &bag, &vertex, &face]] {
            let elements: Vec<Element> = order.into_iter().cloned().collect();
            let found = parse(&encode(encoding, &elements)).unwrap();
            assert_eq!(found.mesh, want.mesh);
            assert!(found.vertex_normals_present);
            assert_eq!(positions(&encode(encoding, &elements), 6).unwrap(), want.mesh.position);
        }
    }
}

#[test]
fn texture_coordinates_by_vertex_or_by_corner() {
    for names in [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]] {
        let rows: Vec<Vec<f64>> =
            QUAD_VERTICES.iter().map(|v| vec![v[0], v[1], v[2], v[0] * 0.5, 1.0 - v[1]]).collect();
        let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        let props = [format!("float {}", names[0]), format!("double {}", names[1])];
        let vertex = element("vertex", &["float x", "float y", "float z", &props[0], &props[1]], &rows);
        let face = element("face", &["list uchar int vertex_indices"], QUAD_FACES);
        let m = parse(&encode("binary_big_endian", &[vertex.clone(), face])).unwrap().mesh;
        assert_eq!(m.corner_uv[2], [[0.5, 1.0], [1.0, 1.0], [1.0, 0.0]]);
        // The first face has its own, the second takes the vertices'.
        let own = element(
            "face",
            &["list uchar int vertex_indices", "list uchar float texcoord"],
            &[&[4.0, 0.0, 1.0, 2.0, 3.0, 8.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8], &[4.0, 1.0, 4.0, 5.0, 2.0, 0.0]],
        );
        let m = parse(&encode("ascii", &[vertex, own.clone()])).unwrap();
        assert_eq!(m.mesh.corner_uv[1], [[0.1, 0.2], [0.5, 0.6], [0.7, 0.8]]);
        assert_eq!(m.mesh.corner_uv[2], [[0.5, 1.0], [1.0, 1.0], [1.0, 0.0]]);
        assert!(m.warnings.is_empty());
        let bare = element("vertex", &["float x", "float y", "float z"], QUAD_VERTICES);
        let m = parse(&encode("ascii", &[bare, own])).unwrap();
        assert_eq!(m.mesh.corner_uv[2], [[0.0; 2]; 3]);
        assert!(m.warnings[0].contains("1 faces have no texture coordinates"), "{:?}", m.warnings);
    }
}

#[test]
fn broken_texture_coordinates_are_errors() {
    let vertex = element("vertex", &["float x", "float y", "float z"], QUAD_VERTICES);
    let face = |uv: &[f64]| {
        let row: Vec<f64> = [&[3.0, 0.0, 1.0, 2.0, uv.len() as f64][..], uv].concat();
        let face = element("face", &["list uchar int vertex_indices", "list uchar float texcoord"], &[&row]);
        error(&encode("binary_little_endian", &[vertex.clone(), face]))
    };
    assert!(face(&[0.0; 3]).contains("(face 0): texcoord has 3 values, expected 6"));
    assert!(face(&[0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0]).contains("(face 0): texcoord holds a value that is not finite"));
    let uv = element(
        "vertex",
        &["float x", "float y", "float z", "float s", "float t"],
        &[&[0.0; 5], &[0.0, 0.0, 0.0, 0.0, f64::INFINITY]],
    );
    let e =
        error(&encode("binary_little_endian", &[uv, element("face", &["list uchar int vertex_indices"], QUAD_FACES)]));
    assert!(e.contains("(vertex 1): t is inf"), "{e}");
}

#[test]
fn polygons_of_any_size() {
    let vertex = element("vertex", &["float x", "float y", "float z"], QUAD_VERTICES);
    let faces: &[&[f64]] = &[&[2.0, 0.0, 1.0], &[5.0, 0.0, 1.0, 4.0, 5.0, 3.0], &[0.0], &[3.0, 0.0, 1.0, 2.0]];
    let file = |rows| encode("ascii", &[vertex.clone(), element("face", &["list uchar int vertex_indices"], rows)]);
    let m = parse(&file(faces)).unwrap();
    assert_eq!(m.mesh.face, [1, 1, 1, 3]);
    assert_eq!(m.faces, 4);
    assert_eq!(m.warnings, ["2 faces with fewer than 3 corners were skipped (the first is face 0)"]);
    assert!(error(&file(&faces[..1])).contains("no faces: each of 1 polygons has fewer than 3 corners"));
    assert!(
        error(&file(&[&[3.0, 0.0, 1.0, 6.0]])).contains("(face 0): corner 2 is vertex 6, but there are 6 vertices")
    );
    assert!(error(&file(&[&[3.0, 0.0, -1.0, 2.0]])).contains("(face 0): corner 1 is vertex -1"));
}

#[test]
fn values_that_are_no_numbers_are_named() {
    for bad in [f64::NAN, f64::NEG_INFINITY] {
        let vertex = element("vertex", &["float x", "double y", "float z"], &[&[0.0; 3], &[0.0, bad, 0.0]]);
        let face = element("face", &["list uchar int vertex_indices"], &[&[3.0, 0.0, 1.0, 0.0]]);
        for encoding in ["binary_little_endian", "binary_big_endian"] {
            let e = error(&encode(encoding, &[vertex.clone(), face.clone()]));
            assert!(e.contains("(vertex 1): y is "), "{e}");
        }
    }
    let text = |v: &str| {
        let head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float nx\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
        format!("{head}0 0 0 0\nnan {v} 0 0\n3 0 1 0\n")
    };
    assert!(parse(text("1").as_bytes()).is_ok(), "a nan in a column that nobody reads does no harm");
    for v in ["nan", "-nan(ind)", "inf", "-Infinity", "1.#QNAN"] {
        let e = error(text(v).as_bytes());
        assert!(e.contains("line 12, vertex 1, property x): ") && e.contains("is not a finite number"), "{e}");
    }
    assert!(error(text("1e400").as_bytes()).contains("vertex 1"));
    assert!(error(text("ten").as_bytes()).contains("property x): 'ten' is not a number"));
}

#[test]
fn a_cut_file_says_how_far_it_goes() {
    let count = |bytes: &[u8]| {
        for n in 0..bytes.len() {
            assert!(parse(&bytes[..n]).is_err() || bytes[n..].trim_ascii().is_empty(), "{n} bytes of {}", bytes.len());
        }
    };
    let le = quads("binary_little_endian");
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        count(&quads(encoding));
    }
    let payload = le.len() - 2 * 17 - 6 * 12;
    assert!(error(&le[..payload + 30]).contains("the file ends after 2 of 6 elements 'vertex'"));
    assert!(error(&le[..le.len() - 1]).contains("the file ends after 1 of 2 elements 'face'"));
    let ascii = quads("ascii");
    let short = ascii.trim_ascii_end().len() - 2;
    assert!(error(&ascii[..short]).contains("the file ends after 1 of 2 elements 'face'"));
}

#[test]
fn lying_headers_fail_fast_and_small() {
    let lie = |encoding: &str, from: &str, to: &str| {
        let bytes = quads(encoding);
        let at = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        error(&[&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat())
    };
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let e = lie(encoding, "element face 2", "element face 4000000000");
        assert!(e.contains("the file ends after 2 of 4000000000 elements 'face'"), "{e}");
        lie(encoding, "element vertex 6", "element vertex 4000000000");
        lie(encoding, "element vertex 6", "element vertex 18446744073709551615");
        lie(encoding, "element vertex 6", "element vertex 99999999999999999999999");
    }
    let vertex = element("vertex", &["float x", "float y", "float z"], QUAD_VERTICES);
    for length in ["uint", "int"] {
        let list = format!("list {length} int vertex_indices");
        let face = element("face", &[&list], &[&[3.0, 0.0, 1.0, 2.0]]);
        let mut bytes = encode("binary_little_endian", &[vertex.clone(), face]);
        let at = bytes.len() - 16;
        bytes[at..at + 4].copy_from_slice(&[0xff; 4]);
        let e = error(&bytes);
        assert!(e.contains(if length == "uint" { "ends after 0 of 1 elements 'face'" } else { "(face 0)" }), "{e}");
    }
    let huge = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n0 0 0\n4000000000 1 2\n";
    assert!(error(huge.as_bytes()).contains("ends after 0 of 1 elements 'face'"));
}

#[test]
fn trailing_bytes_are_a_warning() {
    for encoding in ["ascii", "binary_little_endian"] {
        let m = parse(&[&quads(encoding)[..], b"extra"].concat()).unwrap();
        assert_eq!(m.warnings, ["5 bytes after the last element were ignored"]);
        assert!(parse(&[&quads(encoding)[..], b"\n"].concat()).unwrap().warnings.is_empty());
    }
}

#[test]
fn what_is_no_mesh_says_what_it_is() {
    let vertex = element("vertex", &["float x", "float y", "float z"], QUAD_VERTICES);
    let strips = element("tristrips", &["list int int vertex_indices"], &[&[3.0, 0.0, 1.0, 2.0]]);
    let e = |elements: &[Element]| error(&encode("ascii", elements));
    assert!(e(std::slice::from_ref(&vertex)).contains("no faces: 6 vertices"));
    assert!(e(&[vertex.clone(), element("face", &["list uchar int vertex_indices"], &[])]).contains("no faces"));
    assert!(e(&[vertex.clone(), strips]).contains("triangle strips"));
    assert!(e(&[element("point", &["float x"], &[])]).contains("no element 'vertex'"));
    let face = element("face", &["list uchar int vertex_indices"], QUAD_FACES);
    assert!(
        e(&[element("vertex", &["float x", "float z"], &[]), face.clone()])
            .contains("(element vertex): no property 'y'")
    );
    assert!(
        e(&[element("vertex", &["list uchar float x", "float y", "float z"], &[]), face]).contains("'x' is a list")
    );
    assert!(
        e(&[vertex.clone(), element("face", &["list uchar float vertex_indices"], QUAD_FACES)])
            .contains("list of real numbers")
    );
    assert!(e(&[vertex.clone(), element("face", &["int vertex_indices"], &[&[1.0]])]).contains("expected a list"));
    assert!(e(&[vertex, element("face", &["uchar flags"], &[&[1.0]])]).contains("no list 'vertex_indices'"));
    assert!(read_mesh(Path::new("/no/such/file.ply")).unwrap_err().what.contains("no such file"));
}

#[test]
fn frames_of_a_sequence() {
    let quads = quads("binary_little_endian");
    assert_eq!(positions(&quads, 6).unwrap(), parse(&quads).unwrap().mesh.position);
    let e = positions(&quads, 7).unwrap_err().to_string();
    assert!(e.contains("has 6 vertices, the rest pose has 7"), "{e}");
    let e = parse_positions(Path::new("m.ply"), &quads, 6, Some(3)).unwrap_err().to_string();
    assert!(e.contains("has 2 faces, the rest pose has 3"), "{e}");
    let only = encode("ascii", &[element("vertex", &["double x", "double y", "double z"], QUAD_VERTICES)]);
    assert_eq!(positions(&only, 6).unwrap().len(), 6);
}

#[test]
fn no_flipped_byte_breaks_the_reader() {
    for encoding in ["ascii", "binary_little_endian"] {
        let good = quads(encoding);
        for k in 0..4000u64 {
            let mut bytes = good.clone();
            for j in 0..1 + k % 3 {
                let r = pelage_geom::rng::squares64(j, pelage_geom::rng::key(7, k, 0));
                let at = (r >> 8) as usize % bytes.len();
                bytes[at] = r as u8;
            }
            if let Ok(m) = parse(&bytes) {
                let n = m.mesh.position.len() as u32;
                assert!(m.mesh.triangle.iter().flatten().all(|v| *v < n));
                assert!(m.mesh.position.iter().flatten().all(|x| x.is_finite()));
            }
        }
    }
}
