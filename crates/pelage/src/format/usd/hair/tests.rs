use super::*;
use crate::format::check::samples;

/// Writes the sample shot; returns its bytes.
fn write(path: &Path, facts: &ShotFacts, layers: &[HairLayer]) -> Vec<u8> {
    let mut out = UsdHair::create(path, facts, layers).unwrap();
    for &frame in &facts.frames {
        let data: Vec<_> = layers.iter().map(|l| samples::frame(l, frame)).collect();
        let data: Vec<_> =
            data.iter().map(|(p, v)| HairFrame { position: p, velocity: v, ..HairFrame::default() }).collect();
        out.write_frame(frame, &data).unwrap();
    }
    out.finish().unwrap();
    std::fs::read(path).unwrap()
}

fn check_curves(curves: &[UsdCurves], facts: &ShotFacts, layers: &[HairLayer], frame: i32) {
    assert_eq!(curves.len(), layers.len());
    for (read, layer) in curves.iter().zip(layers) {
        verify_layer(read, facts, layer, [false; 2]).unwrap();
        let (position, velocity) = samples::frame(layer, frame);
        assert_eq!((&read.points, &read.velocity), (&position, &velocity));
        assert_eq!(read.notes, Vec::<String>::new());
    }
}

#[test]
fn what_is_written_is_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, layers) = samples::shot();
    let path = dir.path().join("a.usdc");
    let bytes = write(&path, &facts, &layers);
    verify(&path, &facts, &layers).unwrap();
    for &frame in &facts.frames {
        check_curves(&read_curves(&path, Some(f64::from(frame))).unwrap(), &facts, &layers, frame);
    }
    check_curves(&read_curves(&path, None).unwrap(), &facts, &layers, facts.frames[0]);
    let curves = read_curves(&path, Some(5000.0)).unwrap();
    check_curves(&curves, &facts, &layers, facts.frames[2]);
    assert_eq!(curves[0].path, "/Hair/over_coat");
    assert_eq!(curves[1].path, "/Hair/_2nd");
    // Between two frames, points are halfway.
    let between = read_curves(&path, Some(1001.5)).unwrap();
    let (a, b) = (samples::frame(&layers[0], 1001).0, samples::frame(&layers[0], 1002).0);
    for (k, p) in between[0].points.iter().enumerate() {
        assert!((0..3).all(|i| (p[i] - 0.5 * (a[k][i] + b[k][i])).abs() < 1e-6));
    }
    // The same shot gives the same bytes.
    assert_eq!(bytes, write(&dir.path().join("b.usdc"), &facts, &layers));
}

#[test]
fn colours_of_points_are_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, layers) = samples::coloured();
    let path = dir.path().join("a.usdc");
    write(&path, &facts, &layers);
    verify(&path, &facts, &layers).unwrap();
    let curves = read_curves(&path, None).unwrap();
    assert_eq!((&curves[0].color, &curves[1].color), (&layers[0].color, &layers[1].color));
    let mut file = CrateFile::open(&path).unwrap();
    let hair = file.prims_below(file.root()).unwrap()[0];
    let per: Vec<String> = file
        .prims_below(hair)
        .unwrap()
        .into_iter()
        .map(|p| {
            let a = file.attribute(p, "primvars:displayColor").unwrap();
            file.text(file.field(a, "interpolation").unwrap()).unwrap()
        })
        .collect();
    assert_eq!(per, ["vertex", "uniform"]);
    let (_, uniform) = samples::shot();
    assert!(verify(&path, &facts, &uniform).unwrap_err().to_string().contains("displayColor"));
}

#[test]
fn widths_and_opacities_of_frames_are_samples() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, layers) = samples::shot();
    let (path, still) = (dir.path().join("a.usdc"), dir.path().join("still.usdc"));
    let mut out = UsdHair::create(&path, &facts, &layers).unwrap();
    // The first layer brings its own from frame 1002 on; the second one never.
    for &frame in &facts.frames {
        let data: Vec<_> = layers.iter().map(|l| samples::frame(l, frame)).collect();
        let (width, opacity) = samples::look(&layers[0], frame);
        let mut data: Vec<_> =
            data.iter().map(|(p, v)| HairFrame { position: p, velocity: v, ..HairFrame::default() }).collect();
        if frame > 1001 {
            data[0] = HairFrame { width: &width, opacity: &opacity, ..data[0] };
        }
        out.write_frame(frame, &data).unwrap();
    }
    out.finish().unwrap();
    verify(&path, &facts, &layers).unwrap();
    let of = |l: &HairLayer| (l.width.clone(), l.opacity.clone());
    let read = |frame| {
        let curves = read_curves(&path, frame).unwrap();
        curves.into_iter().map(|c| (c.width, c.opacity)).collect::<Vec<_>>()
    };
    assert_eq!(read(None), [of(&layers[0]), of(&layers[1])]);
    assert_eq!(read(Some(1001.0)), [of(&layers[0]), of(&layers[1])]);
    assert_eq!(read(Some(1003.0)), [samples::look(&layers[0], 1003), of(&layers[1])]);
    // The extent grew with the widths; without columns of frames there are no samples.
    let reach = |path: &Path, frame| {
        let mut file = CrateFile::open(path).unwrap();
        let hair = file.prims_below(file.root()).unwrap()[0];
        let prim = file.prims_below(hair).unwrap()[0];
        verify_extent(&mut file, prim, frame, &read_curves(path, Some(f64::from(frame))).unwrap()[0]).unwrap();
        ["widths", "primvars:displayOpacity"].map(|name| {
            let a = file.attribute(prim, name).unwrap();
            file.field(a, "timeSamples").is_some()
        })
    };
    assert_eq!(reach(&path, 1003), [true, true]);
    write(&still, &facts, &layers);
    assert_eq!(reach(&still, 1003), [false, false]);
    // What the layer says is compared although frames say otherwise.
    let mut other = layers.clone();
    other[0].width[2] *= 2.0;
    assert!(verify(&path, &facts, &other).unwrap_err().to_string().contains("widths"));
}

#[test]
fn transmittance_has_a_column_for_every_light_and_one_for_all() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, layers) = samples::lit();
    let path = dir.path().join("a.usdc");
    let mut out = UsdHair::create(&path, &facts, &layers).unwrap();
    samples::write_lit(|frame, data| out.write_frame(frame, data).unwrap());
    out.finish().unwrap();
    verify(&path, &facts, &layers).unwrap();
    let dark = ShotFacts { lights: vec!["key".into(), "other".into()], ..facts.clone() };
    assert!(verify(&path, &dark, &layers).unwrap_err().to_string().contains("transmittance:other"));
    let mut file = CrateFile::open(&path).unwrap();
    let hair = file.prims_below(file.root()).unwrap()[0];
    let prim = file.prims_below(hair).unwrap()[1];
    for (name, column) in [("transmittance", 0), ("groom_ao", 0), ("transmittance:key", 1), ("transmittance:rim_2", 2)]
    {
        let node = file.attribute(prim, &format!("primvars:{name}")).unwrap();
        let samples = file.field(node, "timeSamples").unwrap();
        let (times, values) = file.samples(samples).unwrap();
        assert_eq!(times, [1001.0, 1002.0, 1003.0]);
        for (value, frame) in values.into_iter().zip(&facts.frames) {
            assert_eq!(file.floats(value, 1).unwrap(), samples::light(&layers[1], *frame)[column]);
        }
    }
}

#[test]
fn names_become_valid_and_different() {
    let names = ["a b", "a_b", "é", "", "9", "a:b"];
    assert_eq!(identifiers(names.into_iter()), ["a_b", "a_b_2", "_", "__2", "_9", "a_b_3"]);
}

#[test]
fn an_empty_layer_and_no_layers_are_files_too() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, mut layers) = samples::shot();
    layers[0] = HairLayer { name: "bald".into(), ..HairLayer::default() };
    let path = dir.path().join("a.usdc");
    write(&path, &facts, &layers);
    verify(&path, &facts, &layers).unwrap();
    write(&path, &facts, &[]);
    verify(&path, &facts, &[]).unwrap();
    assert!(read_curves(&path, None).unwrap_err().to_string().contains("no BasisCurves"));
}

#[test]
fn verify_finds_what_differs() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, layers) = samples::shot();
    let path = dir.path().join("a.usdc");
    write(&path, &facts, &layers);
    let mut other = layers.clone();
    other[1].id[0] += 1;
    assert!(verify(&path, &facts, &other).unwrap_err().to_string().contains("hairId"));
    let mut other = layers.clone();
    other[0].width.iter_mut().for_each(|w| *w *= 2.0);
    assert!(verify(&path, &facts, &other).unwrap_err().to_string().contains("widths"));
    let other = ShotFacts { meters_per_unit: 1.0, ..facts.clone() };
    assert!(verify(&path, &other, &layers).unwrap_err().to_string().contains("metersPerUnit"));
    let other = ShotFacts { frames: vec![1001, 1002], ..facts.clone() };
    assert!(verify(&path, &other, &layers).is_err());
    assert!(verify(&path, &facts, &layers[..1]).is_err());
}

#[test]
fn an_unfinished_file_does_not_open() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, layers) = samples::shot();
    let path = dir.path().join("a.usdc");
    let mut out = UsdHair::create(&path, &facts, &layers).unwrap();
    let data: Vec<_> = layers.iter().map(|l| samples::frame(l, 1001)).collect();
    let data: Vec<_> =
        data.iter().map(|(p, v)| HairFrame { position: p, velocity: v, ..HairFrame::default() }).collect();
    assert!(out.write_frame(1002, &data).unwrap_err().to_string().contains("out of order"));
    out.write_frame(1001, &data).unwrap();
    let error = out.finish().unwrap_err().to_string();
    assert!(error.contains("1 of 3 frames") && error.contains("frame 1002"), "{error}");
    assert!(read_curves(&path, None).is_err());
}

/// Neither a changed byte nor a lost end may panic, hang or pass for a whole file with other tables.
#[test]
fn broken_files_are_errors() {
    let dir = tempfile::tempdir().unwrap();
    let (facts, mut layers) = samples::shot();
    layers.truncate(1);
    let path = dir.path().join("a.usdc");
    let bytes = write(&path, &facts, &layers);
    let broken = dir.path().join("broken.usdc");
    for n in (0..bytes.len()).step_by(7).chain(bytes.len() - 40..bytes.len()) {
        std::fs::write(&broken, &bytes[..n]).unwrap();
        assert!(read_curves(&broken, Some(1002.0)).is_err(), "the first {n} bytes were read as a file");
    }
    let mut read = 0;
    for i in (0..bytes.len()).step_by(2) {
        let mut bad = bytes.clone();
        bad[i] ^= [0x01, 0x80, 0xff, 0x10][i / 2 % 4];
        std::fs::write(&broken, &bad).unwrap();
        if let Ok(curves) = read_curves(&broken, Some(1002.0)) {
            read += 1;
            for c in &curves {
                assert_eq!(c.points.len(), c.offsets.total());
                assert!(c.id.is_empty() || c.id.len() == c.offsets.len());
            }
        }
        if i % 10 == 0 {
            let _ = verify(&broken, &facts, &layers);
        }
    }
    assert!(read > 0);
}

#[test]
fn other_files_are_refused_with_advice() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.usd");
    for (content, word) in
        [(&b"#usda 1.0\n"[..], ".usda"), (b"PK\x03\x04", ".usdz"), (b"ply\n", "PXR-USDC"), (b"", "PXR-USDC")]
    {
        std::fs::write(&path, content).unwrap();
        let error = read_curves(&path, None).unwrap_err();
        assert!(error.what.contains(word) && !error.hint.is_empty(), "{error}");
    }
    let mut newer = [0u8; 200];
    newer[..10].copy_from_slice(b"PXR-USDC\0\x63");
    std::fs::write(&path, newer).unwrap();
    assert!(read_curves(&path, None).unwrap_err().what.contains("0.99"));
    assert!(read_curves(&dir.path().join("none.usdc"), None).is_err());
}
