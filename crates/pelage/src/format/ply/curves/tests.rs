use super::*;
use crate::format::ply::samples::{Element, element, encode};

fn parse(bytes: &[u8]) -> Result<Curves, FormatError> {
    parse_curves(Path::new("c.ply"), bytes)
}

fn error(elements: &[Element]) -> String {
    parse(&encode("ascii", elements)).unwrap_err().to_string()
}

fn facts(origin: [f64; 3]) -> ShotFacts {
    let extra = vec![("version".to_owned(), "1\n2".to_owned())];
    ShotFacts {
        name: "s".into(),
        meters_per_unit: 0.01,
        up: 'Y',
        fps: 24.0,
        frames: vec![1001],
        origin,
        lights: vec![],
        extra,
    }
}

fn layer(name: &str, counts: &[usize], first_id: u64) -> HairLayer {
    let (c, v) = (counts.len(), counts.iter().sum());
    HairLayer {
        name: name.into(),
        offsets: Offsets::from_counts(counts.iter().copied()),
        id: (0..c as u64).map(|k| (first_id + k) << 33 | 5).collect(),
        root_uv: (0..c).map(|k| [0.1 * k as f32, 1.0]).collect(),
        width: (0..v).map(|k| 0.01 * k as f32).collect(),
        ..HairLayer::default()
    }
}

#[test]
fn what_is_written_is_read() {
    let layers =
        [layer("coat", &[3, 2], 1), HairLayer { color: vec![[0.5; 3]], root_uv: vec![], ..layer("beard", &[4], 9) }];
    let position: Vec<[f32; 3]> = (0..9).map(|k| [k as f32 * 0.3, 1.0 / 3.0, -7.0]).collect();
    let velocity = [[1.0, 2.0, 3.0]; 9];
    let frame = [
        HairFrame { position: &position[..5], velocity: &velocity[..5], ..HairFrame::default() },
        HairFrame { position: &position[5..], velocity: &velocity[5..], ..HairFrame::default() },
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hair.ply");
    for origin in [[0.0; 3], [1e6, -2e5, 0.25]] {
        write_hair(&path, &facts(origin), &layers, &frame).unwrap();
        verify_hair(&path, &facts(origin), &layers, &frame).unwrap();
        let c = read_curves(&path).unwrap();
        assert_eq!(c.strands.origin, origin);
        assert_eq!(c.strands.offsets, Offsets::from_counts([3, 2, 4]));
        assert_eq!(c.strands.id, [layers[0].id.clone(), layers[1].id.clone()].concat());
        assert_eq!(c.strands.root_uv, [[0.0, 1.0], [0.1, 1.0], [0.0, 0.0]]);
        assert_eq!(c.width.unwrap(), [layers[0].width.clone(), layers[1].width.clone()].concat());
        assert!(c.comments.contains(&"layer 1 beard".to_owned()) && c.comments.contains(&"version 1 2".to_owned()));
        let worst = c.strands.position.iter().flatten().zip(position.iter().flatten()).map(|(a, b)| (a - b).abs());
        assert!(worst.fold(0.0, f32::max) <= if origin[0] == 0.0 { 0.0 } else { 1e-9 });
    }
    // The file is an ordinary PLY: any reader sees velocities, colours, layers.
    let tables = read_tables(&path).unwrap();
    let hair = tables.get("hair").unwrap();
    assert_eq!(hair.u32("layer").unwrap(), [0, 0, 1]);
    assert_eq!(hair.f32("r").unwrap(), [1.0, 1.0, 0.5]);
    assert_eq!(tables.get("vertex").unwrap().f32("vz").unwrap(), [3.0; 9]);
    let short = [frame[0], HairFrame { position: &position[..1], ..frame[1] }];
    let e = write_hair(&path, &facts([0.0; 3]), &layers, &short).unwrap_err().to_string();
    assert!(e.contains("layer 'beard': 1 values of position, expected 4"), "{e}");
}

#[test]
fn colours_of_points_and_columns_of_frames_are_written() {
    let per_point: Vec<[f32; 3]> = (0..5).map(|k| [0.1 * k as f32, 0.5, 0.25]).collect();
    let layers = [
        HairLayer { color: per_point.clone(), ..layer("coat", &[3, 2], 1) },
        HairLayer { color: vec![[0.0, 0.5, 1.0]], opacity: vec![0.75], ..layer("beard", &[4], 9) },
        layer("down", &[2], 20),
    ];
    let points = [[0.5; 3]; 11];
    let of = |n: std::ops::Range<usize>| HairFrame {
        position: &points[n.clone()],
        velocity: &points[n],
        ..HairFrame::default()
    };
    let mut frame = [of(0..5), of(5..9), of(9..11)];
    frame[1].width = &[4.0, 3.0, 2.0, 1.0];
    frame[0].opacity = &[0.25, 0.5];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hair.ply");
    let facts = facts([0.0; 3]);
    write_hair(&path, &facts, &layers, &frame).unwrap();
    verify_hair(&path, &facts, &layers, &frame).unwrap();
    let tables = read_tables(&path).unwrap();
    let (vertex, hair) = (tables.get("vertex").unwrap(), tables.get("hair").unwrap());
    assert_eq!(vertex.f32("r").unwrap(), [0.0, 0.1, 0.2, 0.3, 0.4, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0].map(|x: f32| x));
    assert_eq!(vertex.f32("b").unwrap(), [[0.25; 5].as_slice(), &[1.0; 6]].concat());
    assert_eq!(vertex.f32("width").unwrap(), [&layers[0].width, frame[1].width, &layers[2].width].concat());
    assert_eq!(hair.f32("opacity").unwrap(), [0.25, 0.5, 0.75, 1.0]);
    assert!(hair.column("r").is_none());
    assert_eq!(read_curves(&path).unwrap().width.unwrap(), vertex.f32("width").unwrap());
    let lit = ShotFacts { lights: vec!["key".into(), "rim-2".into()], ..facts.clone() };
    assert!(write_hair(&path, &lit, &layers, &frame).unwrap_err().to_string().contains("expected 3"));
    let light: Vec<Vec<Vec<f32>>> =
        [5, 4, 2].iter().map(|n| (0..3).map(|c| vec![0.25 * (c + 1) as f32; *n]).collect()).collect();
    let shadowed: Vec<HairFrame> =
        frame.iter().zip(&light).map(|(f, transmittance)| HairFrame { transmittance, ..*f }).collect();
    write_hair(&path, &lit, &layers, &shadowed).unwrap();
    verify_hair(&path, &lit, &layers, &shadowed).unwrap();
    let tables = read_tables(&path).unwrap();
    for (name, value) in [("transmittance", 0.25), ("transmittance_key", 0.5), ("transmittance_rim_2", 0.75)] {
        assert_eq!(tables.get("vertex").unwrap().f32(name).unwrap(), [value; 11]);
    }
    write_hair(&path, &facts, &layers, &frame).unwrap();
    // What differs is named.
    let e = verify_hair(&path, &facts, &layers, &[of(0..5), frame[1], frame[2]]).unwrap_err().to_string();
    assert!(e.contains("(element hair): opacity differs"), "{e}");
    let e = verify_hair(&path, &facts, &layers, &[frame[0], of(5..9), frame[2]]).unwrap_err().to_string();
    assert!(e.contains("(element vertex): width differs"), "{e}");
    frame[1].width = &[1.0];
    let e = write_hair(&path, &facts, &layers, &frame).unwrap_err().to_string();
    assert!(e.contains("layer 'beard': 1 values of width of the frame, expected 4"), "{e}");
}

fn five() -> Element {
    let rows: Vec<Vec<f64>> = (0..5).map(|k| vec![f64::from(k), 0.0, 0.0, 0.5]).collect();
    let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
    element("vertex", &["float x", "float y", "float z", "float radius"], &rows)
}

#[test]
fn polylines_as_lists() {
    for name in ["hair", "strand", "curve", "polyline", "edge"] {
        let lists = element(
            name,
            &["list uchar uint vertex_indices", "float u", "float v"],
            &[&[3.0, 2.0, 1.0, 0.0, 0.25, 0.5], &[1.0, 0.0, 0.0, 0.0], &[2.0, 3.0, 4.0, 0.5, 0.5]],
        );
        let c = parse(&encode("binary_big_endian", &[lists, five()])).unwrap();
        assert_eq!(c.strands.offsets, Offsets::from_counts([3, 2]));
        assert_eq!(c.strands.points(0)[0], [2.0, 0.0, 0.0]);
        assert_eq!(c.strands.root_uv, [[0.25, 0.5], [0.5, 0.5]]);
        assert_eq!(c.width.unwrap(), [1.0; 5]);
        assert_eq!(c.warnings, ["1 curves with fewer than 2 points were skipped"]);
    }
}

#[test]
fn edges_become_chains_from_their_first_vertex() {
    let edges = |pairs: &[[f64; 2]]| {
        let rows: Vec<&[f64]> = pairs.iter().map(<[f64; 2]>::as_slice).collect();
        element("edge", &["int vertex1", "int vertex2"], &rows)
    };
    let c = parse(&encode("ascii", &[five(), edges(&[[1.0, 0.0], [4.0, 3.0], [2.0, 1.0]])])).unwrap();
    assert_eq!(c.strands.offsets, Offsets::from_counts([3, 2]));
    assert_eq!(c.strands.points(0), [[2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3]]);
    assert_eq!(c.strands.points(1)[0], [4.0, 0.0, 0.0]);
    // Drawn towards the middle, and away from it.
    for pairs in [[[0.0, 1.0], [2.0, 1.0]], [[1.0, 0.0], [1.0, 2.0]]] {
        let c = parse(&encode("ascii", &[five(), edges(&pairs)])).unwrap();
        assert_eq!((c.strands.len(), c.strands.points(0)[0]), (1, [0.0; 3]));
    }
    assert!(error(&[five(), edges(&[[0.0, 1.0], [1.0, 2.0], [1.0, 3.0]])]).contains("(edge 2): vertex 1 joins more"));
    assert!(error(&[five(), edges(&[[0.0, 1.0], [1.0, 2.0], [2.0, 0.0]])]).contains("closed loop"));
    assert!(error(&[five(), edges(&[[0.0, 5.0]])]).contains("(edge 0): vertex 5, but there are 5 vertices"));
    assert!(error(&[five(), edges(&[[0.0, -1.0]])]).contains("(edge 0)"));
    assert!(error(&[five(), edges(&[[0.0, 0.0]])]).contains("one to itself"));
}

#[test]
fn wrong_ranges_and_ids_are_named() {
    let hair = |rows: &[&[f64]]| element("hair", &["uint first", "uint count", "uint id_lo", "uint id_hi"], rows);
    let ok = parse(&encode("ascii", &[five(), hair(&[&[3.0, 2.0, 7.0, 1.0], &[0.0, 3.0, 8.0, 0.0]])])).unwrap();
    assert_eq!(ok.strands.id, [(1 << 32) + 7, 8]);
    assert_eq!(ok.strands.points(0)[0], [3.0, 0.0, 0.0]);
    assert!(error(&[five(), hair(&[&[3.0, 3.0, 0.0, 0.0]])]).contains("(hair 0): points 3 to 5 of 5 vertices"));
    assert!(error(&[five(), hair(&[&[0.0, 4e9, 0.0, 0.0]])]).contains("(hair 0)"));
    assert!(
        error(&[five(), hair(&[&[0.0, 4.0, 0.0, 0.0], &[0.0, 4.0, 1.0, 0.0]])])
            .contains("(hair 1): curves share points")
    );
    assert!(error(&[five(), hair(&[&[0.0, 2.0, 3.0, 0.0], &[2.0, 2.0, 3.0, 0.0]])]).contains("id 3"));
    assert!(error(&[five(), hair(&[&[0.0, 2.0, 0.0, 4e9]])]).contains("does not fit 63 bits"));
    assert!(error(&[five(), hair(&[&[0.0, 1.0, 0.0, 0.0]])]).contains("no curve of two or more points"));
    assert!(error(&[five()]).contains("holds no curves (its elements: vertex)"));
    let list = element("hair", &["list uchar int vertex_indices"], &[&[2.0, 0.0, 5.0]]);
    assert!(error(&[five(), list]).contains("(hair 0): vertex 5, but there are 5"));
}

#[test]
fn far_curves_keep_their_shape() {
    let vertex = element("vertex", &["double x", "double y", "double z"], &[&[1e7, 0.0, 0.0], &[1e7 + 0.01, 0.0, 0.0]]);
    let list = element("curve", &["list uchar int vertex_indices"], &[&[2.0, 0.0, 1.0]]);
    let s = parse(&encode("binary_little_endian", &[vertex, list])).unwrap().strands;
    assert_eq!(s.origin, [1e7, 0.0, 0.0]);
    assert!((s.position[1][0] - s.position[0][0] - 0.01).abs() < 1e-7);
}
