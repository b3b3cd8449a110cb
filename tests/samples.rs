//! The samples: the committed one is what the code makes, their skins are what they should be, and the laws of the coat
//! hold on the bust.

use pelage::cli::Sample;
use pelage::format::image::{Channel, read_map};
use pelage::format::ply;
use pelage::progress::Progress;
use pelage::project::Project;
use pelage::stage::{Options, Runner, Skin, What, comb, groom, instance};
use pelage::{curves, sample};
use pelage_geom::{Bvh, Mesh, NONE, SurfacePoint, Topology, Vec3};
use pelage_groom::control::{self, ControlHairs};
use pelage_groom::interpolate::{Blend, interpolate, pose_controls};
use pelage_groom::triangulate::{Triangulation, mirrored_charts, triangulate};
use pelage_tests::ShotFolder;
use std::path::Path;

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");

#[test]
fn the_committed_sample_is_what_the_code_makes() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let differs = |(name, bytes): &(String, Vec<u8>)| match std::fs::read(top.join(name)) {
        Ok(found) if found == *bytes => None,
        Ok(found) => Some(format!("{name}: {} bytes that differ from the {} made now", found.len(), bytes.len())),
        Err(e) => Some(format!("{name}: {e}")),
    };
    let wrong: Vec<String> = sample::files(Sample::Bust).iter().filter_map(differs).collect();
    assert!(
        wrong.is_empty(),
        "the sample at the top of the repository is out of date:\n  {}\n\
         `pelage init DIR` makes it anew in an empty folder; copy its pipeline.toml, grooms/ and maps/ over these.",
        wrong.join("\n  ")
    );
}

fn skin_of(files: &[(String, Vec<u8>)], name: &str) -> Mesh {
    let (path, bytes) = files.iter().find(|f| f.0 == name).unwrap_or_else(|| panic!("no {name}"));
    ply::parse_mesh(Path::new(path), bytes).unwrap_or_else(|e| panic!("{e}")).mesh
}

#[test]
fn sample_skins_are_closed_and_cut_into_charts() {
    for (kind, name) in
        [(Sample::Bust, "grooms/bust.ply"), (Sample::BustNod, "grooms/bust.ply"), (Sample::Animal, "grooms/animal.ply")]
    {
        let mesh = skin_of(&sample::files(kind), name);
        let topology = Topology::new(&mesh);
        assert!(mesh.triangle.len() >= 10_000, "{name}: {} triangles", mesh.triangle.len());
        assert!(topology.charts >= 4, "{name}: {} charts", topology.charts);
        let c = topology.counts;
        assert_eq!((c.open_edges, c.non_manifold_edges, c.zero_area), (0, 0, 0), "{name}");
        assert!(mesh.corner_uv.iter().flatten().flatten().all(|x| (0.0..=1.0).contains(x)), "{name}: in the square");
    }
}

/// Edges at which two charts meet, from both sides: (triangle, edge).
fn seams(mesh: &Mesh, topology: &Topology) -> Vec<[(u32, usize); 2]> {
    let mut out = Vec::new();
    for t in 0..mesh.triangle.len() as u32 {
        for edge in 0..3 {
            if let Some((other, back)) = topology.across(t, edge)
                && t < other
                && topology.is_border(t, edge)
            {
                out.push([(t, edge), (other, back)]);
            }
        }
    }
    out
}

#[test]
fn seams_run_through_hair() {
    let shot = ShotFolder::new(COMMAND);
    let files = sample::files(Sample::Bust);
    let mesh = skin_of(&files, "grooms/bust.ply");
    let topology = Topology::new(&mesh);
    let density = &files.iter().find(|f| f.0 == "maps/scalp_density.png").expect("a map").1;
    shot.write("density.png", density);
    let map = read_map(&shot.path().join("density.png"), Channel::Auto, false).expect("a map").map;
    let at = |t: u32| {
        let middle = SurfacePoint { triangle: t, bary: [1.0 / 3.0; 2] };
        map.sample(mesh.uv(&middle), Default::default())[0]
    };
    let seams = seams(&mesh, &topology);
    let hairy = seams.iter().filter(|s| s.iter().all(|(t, _)| at(*t) > 0.5)).count();
    assert!(hairy >= 20, "{hairy} of {} seam edges have hair on both sides", seams.len());
}

/// The bust over two frames, the second well into the motion; nothing is simulated, clumped or pushed out of the skin, so
/// that lengths are exact.
fn short_bust() -> ShotFolder {
    let shot = ShotFolder::new(COMMAND);
    sample::files(Sample::Bust).iter().for_each(|(name, bytes)| shot.write(name, bytes));
    shot.edit("pipeline.toml", "frames = [1001, 1048]", "frames = [1012, 1013]");
    shot.edit("pipeline.toml", "pivot =", "motion_start = 1001\npivot =");
    shot.edit(
        "pipeline.toml",
        "target = \"every-hair\"",
        "target = \"off\"\n\n[look]\nclump = false\ncollision = false",
    );
    shot.edit("pipeline.toml", "frame = 1012", "frame = 1012\nsize = [320, 240]");
    shot.succeed(&["run", "--quiet"]);
    shot
}

fn point(p: [f32; 3], origin: [f64; 3]) -> Vec3 {
    Vec3::from(std::array::from_fn::<f64, 3, _>(|x| f64::from(p[x]) + origin[x]))
}

#[test]
fn the_laws_of_the_coat_hold_on_the_bust() {
    let shot = short_bust();
    let project = Project::open(&shot.path().join("pipeline.toml")).unwrap_or_else(|e| panic!("{e}"));
    let mut progress = Progress::new(true);
    let mut run = Runner::new(&project, Options::default(), &mut progress).unwrap_or_else(|e| panic!("{e}"));
    let skin = groom::skin(&mut run).unwrap_or_else(|e| panic!("{e}"));
    let control = comb::combed(&mut run).unwrap_or_else(|e| panic!("{e}"));
    no_control_hair_enters(&skin, &control, 0.1);
    let sites = groom::placed(&mut run).unwrap_or_else(|e| panic!("{e}"));
    let triangulation = triangulate(&sites, &mirrored_charts(&skin.mesh, &skin.topology));
    seams_agree(&skin, &control, &triangulation);
    for i in 0..project.groom.value.layer.len() {
        let (hair, weight) = instance::weights(&mut run, i).unwrap_or_else(|e| panic!("{e}"));
        assert!(hair.iter().flatten().all(|h| (*h as usize) < control.len()));
        for w in &weight {
            let sum: f64 = w.iter().map(|x| f64::from(*x)).sum();
            assert!(w.iter().all(|x| *x >= 0.0) && (sum - 1.0).abs() <= 1e-6, "weights {w:?}");
        }
        let length = instance::column(&mut run, What::Length(i), i).unwrap_or_else(|e| panic!("{e}"));
        let ids = instance::roots(&mut run, i).unwrap_or_else(|e| panic!("{e}")).id.clone();
        assert!(ids.len() > 5000, "{} hairs", ids.len());
        for (frame, at) in &project.frames {
            let pose = skin.pose(at).unwrap_or_else(|e| panic!("{e}"));
            let bvh = Bvh::build(&pose.position, &skin.mesh.triangle, &skin.topology);
            let file = shot.path().join("out/sample/hair.usdc");
            let layer = &curves::read(&file, Some(f64::from(*frame))).unwrap_or_else(|e| panic!("{e}")).layers[i];
            assert_eq!(layer.strands.id, ids);
            exported_hairs_are_exact(layer, &length, &bvh, size(&skin.mesh));
        }
    }
}

#[test]
fn no_control_hair_enters_the_fox() {
    let shot = ShotFolder::new(COMMAND);
    sample::files(Sample::Animal).iter().for_each(|(name, bytes)| shot.write(name, bytes));
    let project = Project::open(&shot.path().join("pipeline.toml")).unwrap_or_else(|e| panic!("{e}"));
    let mut progress = Progress::new(true);
    let mut run = Runner::new(&project, Options::default(), &mut progress).unwrap_or_else(|e| panic!("{e}"));
    let skin = groom::skin(&mut run).unwrap_or_else(|e| panic!("{e}"));
    let control = comb::combed(&mut run).unwrap_or_else(|e| panic!("{e}"));
    no_control_hair_enters(&skin, &control, 0.1);
}

fn size(mesh: &Mesh) -> f64 {
    let (low, high) = mesh.bounds();
    (Vec3::from(high) - Vec3::from(low)).norm()
}

/// Samples every control hair in steps of a millimetre, the root excluded.
fn no_control_hair_enters(skin: &Skin, control: &ControlHairs, millimetre: f64) {
    let on = control::Skin { mesh: &skin.mesh, topology: &skin.topology, rest: &skin.rest };
    let mut deepest = (f64::INFINITY, 0);
    for h in 0..control.len() {
        let points: Vec<Vec3> = control.placed(h, &on.frame(&control.root[h])).collect();
        for w in points.windows(2) {
            let steps = ((w[1] - w[0]).norm() / millimetre).ceil() as usize;
            for k in 1..=steps {
                let at = w[0] + (w[1] - w[0]) * (k as f64 / steps as f64);
                let distance = skin.bvh().closest(at, f64::INFINITY).expect("a skin").signed_distance;
                if distance < deepest.0 {
                    deepest = (distance, h);
                }
            }
        }
    }
    assert!(control.len() > 300);
    assert!(deepest.0 > 0.0, "control hair {} comes to {} from the skin", deepest.1, deepest.0);
}

/// Hairs at the same place on a seam, seen from either chart, have the same directions.
fn seams_agree(skin: &Skin, control: &ControlHairs, triangulation: &Triangulation) {
    let (mut hair, mut weight) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for seam in seams(&skin.mesh, &skin.topology) {
        for t in [0.13f32, 0.5, 0.83] {
            for (side, (triangle, edge)) in seam.into_iter().enumerate() {
                let uv = skin.mesh.corner_uv[triangle as usize];
                let (a, b) = (uv[edge], uv[(edge + 1) % 3]);
                // The two triangles run along their edge in opposite directions.
                let t = if side == 0 { t } else { 1.0 - t };
                let at = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
                let chart = skin.topology.chart[triangle as usize];
                let found = triangulation.locate(chart, at).expect("every chart has control hairs");
                hair[side].push(found.hair);
                weight[side].push(found.weight);
            }
        }
    }
    let n = hair[0].len();
    assert!(n > 100 && control.parting.iter().any(|p| *p != NONE));
    let pose = pose_controls(control, &skin.mesh, &skin.topology, &skin.rest, control.points);
    let (root, length) = (vec![[0.0f32; 3]; n], vec![1.0f32; n]);
    let [left, right] = [0, 1].map(|side| {
        let blend = Blend { root: &root, hair: &hair[side], weight: &weight[side], length: &length };
        let mut out = vec![[0.0f32; 3]; n * control.points];
        interpolate(&blend, &pose, &mut out);
        out
    });
    for (i, (l, r)) in left.chunks(control.points).zip(right.chunks(control.points)).enumerate() {
        for s in 1..control.points {
            let [a, b] = [l, r].map(|p| (point(p[s], [0.0; 3]) - point(p[s - 1], [0.0; 3])).normalize());
            let angle = a.cross(&b).norm().atan2(a.dot(&b));
            assert!(angle <= 1e-5, "seam point {i}, segment {s}: {angle} rad apart");
        }
    }
}

fn exported_hairs_are_exact(layer: &curves::CurveSet, length: &[f32], bvh: &Bvh, size: f64) {
    let s = &layer.strands;
    assert!(s.position.iter().flatten().all(|x| x.is_finite()) && layer.width.iter().all(|w| *w > 0.0));
    let (mut longest_error, mut farthest) = (0.0f64, 0.0f64);
    assert_eq!(length.len(), s.len());
    for (i, wanted) in length.iter().enumerate() {
        let points: Vec<Vec3> = s.points(i).iter().map(|p| point(*p, s.origin)).collect();
        let found: f64 = points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        let wanted = f64::from(*wanted);
        longest_error = longest_error.max((found - wanted).abs() / wanted);
        let near = bvh.closest(points[0], f64::INFINITY).expect("a skin");
        farthest = farthest.max((near.position - points[0]).norm());
    }
    assert!(longest_error <= 1e-4, "lengths are off by {longest_error}");
    assert!(farthest <= 1e-5 * size, "a root is {farthest} from the skin");
}
