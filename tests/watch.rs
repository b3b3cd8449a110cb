//! The artist's loop: drafts and crops of the still, and `pelage preview --watch`.

use pelage::format::image::{Channel, read_map};
use pelage::progress::Progress;
use pelage::project::Project;
use pelage::stage::{Options, Runner};
use pelage_tests::{ShotFolder, grey_png, simulated_shot, small_shot};
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const COMMAND: &str = env!("CARGO_BIN_EXE_pelage-under-test");
const GROOM: &str = "grooms/ball.toml";
const STILL: &str = "out/ball/preview.png";

/// Rows of pixels of a picture, the first on top.
fn pixels(shot: &ShotFolder, name: &str) -> Vec<Vec<f32>> {
    let map = read_map(&shot.path().join(name), Channel::Rgb, false).expect("a picture").map;
    map.data.chunks(map.data.len() / map.height).rev().map(<[f32]>::to_vec).collect()
}

/// What `pelage preview` draws of the same inputs in a folder of their own.
fn still_of(shot: &ShotFolder) -> Vec<u8> {
    let fresh = shot.fresh();
    fresh.succeed(&["preview", "--quiet"]);
    fresh.read(STILL)
}

#[test]
fn a_crop_has_the_pixels_of_the_still() {
    let shot = small_shot(COMMAND, 3);
    let said = shot.succeed(&["preview", "--quiet", "--crop", "0.3,0.25,0.8,0.75"]);
    assert_eq!(said, "out/ball/preview-crop.png: 80 x 60 pixels from (48, 30) of 160 x 120\n");
    assert_eq!(shot.outputs().into_keys().collect::<Vec<_>>(), ["ball/preview-crop.png"]);
    shot.succeed(&["preview", "--quiet"]);
    let (whole, part) = (pixels(&shot, STILL), pixels(&shot, "out/ball/preview-crop.png"));
    assert_eq!(part.len(), 60);
    let channels = whole[0].len() / 160;
    for (row, all) in part.iter().zip(&whole[30..]) {
        assert_eq!(*row, all[48 * channels..128 * channels]);
    }
    assert!(part.concat().iter().any(|x| *x != part[0][0]), "there is something to see");
    // A crop of a draft has the draft's.
    shot.succeed(&["preview", "--quiet", "--hairs", "20", "--crop", "0.5,0.5,1,1"]);
    shot.succeed(&["preview", "--quiet", "--hairs", "20"]);
    let (whole, part) = (pixels(&shot, "out/ball/preview-draft.png"), pixels(&shot, "out/ball/preview-crop.png"));
    for (row, all) in part.iter().zip(&whole[60..]) {
        assert_eq!(*row, all[80 * channels..]);
    }
}

#[test]
fn a_draft_leaves_the_shot_alone() {
    let shot = small_shot(COMMAND, 3);
    shot.report(&[]);
    let before = shot.outputs();
    let said = shot.succeed(&["preview", "--quiet", "--hairs", "20"]);
    assert_eq!(said, "out/ball/preview-draft.png: 160 x 120 pixels, 20 % of the hairs\n");
    let mut after = shot.outputs();
    let draft = after.remove("ball/preview-draft.png").expect("a draft");
    assert!(after == before && draft != before["ball/preview.png"]);
    assert_eq!(shot.plan(&[]), Default::default());
    assert!(shot.succeed(&["run"]).starts_with("nothing to do"));
    // A change of the groom is told as what it is after a draft of it, too.
    shot.edit(GROOM, "noise = 0.2", "noise = 0.1");
    shot.succeed(&["preview", "--quiet", "--hairs", "20"]);
    assert_eq!(shot.plan(&[]).1, [format!("{GROOM}: layer[0].length.noise 0.2 -> 0.1")].into());
}

#[test]
fn a_draft_of_simulated_hair_has_hairs_of_the_shot() {
    let shot = simulated_shot(COMMAND, 3);
    shot.report(&[]);
    let project = Project::open(&shot.path().join("pipeline.toml")).expect("a shot");
    let thinned = project.thinned(40.0);
    let options = |draft| Options { draft, ..Options::default() };
    let mut progress = Progress::new(true);
    let mut hairs = |project: &Project, draft: bool| {
        let mut run = Runner::new(project, options(draft), &mut progress).expect("a run");
        let roots = pelage::stage::instance::roots(&mut run, 0).expect("roots");
        let at = pelage::stage::interpolate::positions(&mut run, pelage::stage::What::Frame(0, 3)).expect("a frame");
        let points = at.len() / roots.id.len();
        let hair = |(id, hair): (&u64, &[[f32; 3]])| (*id, hair.to_vec());
        roots.id.iter().zip(at.chunks(points)).map(hair).collect::<std::collections::BTreeMap<_, _>>()
    };
    let (all, few) = (hairs(&project, false), hairs(&thinned, true));
    assert!(few.len() * 2 < all.len() && few.len() * 4 > all.len(), "{} of {}", few.len(), all.len());
    for (id, hair) in &few {
        let off = hair.iter().zip(&all[id]).flat_map(|(a, b)| (0..3).map(|x| (a[x] - b[x]).abs())).fold(0.0, f32::max);
        assert!(off < 1e-4, "hair {id} is off by {off}");
    }
}

#[test]
fn stopped_work_can_be_taken_up_again() {
    let shot = simulated_shot(COMMAND, 3);
    let project = Project::open(&shot.path().join("pipeline.toml")).expect("a shot");
    let stop = Arc::new(AtomicBool::new(true));
    let mut progress = Progress::stoppable(true, stop.clone());
    let result = Runner::new(&project, Options::default(), &mut progress).expect("a run").run();
    assert!(matches!(result, Err(pelage::Error::Stopped)), "{result:?}");
    assert!(shot.outputs().is_empty());
    stop.store(false, Ordering::Relaxed);
    Runner::new(&project, Options::default(), &mut progress).expect("a run").run().expect("a report");
    assert!(shot.outputs().contains_key("ball/preview.png"));
    // In the middle of a simulation: all before it is in the cache, so nothing else looks at the flag.
    shot.edit("pipeline.toml", "checkpoint = 2", "checkpoint = 2\ngravity = 9.7");
    let project = Project::open(&shot.path().join("pipeline.toml")).expect("a shot");
    stop.store(true, Ordering::Relaxed);
    let mut run = Runner::new(&project, Options::default(), &mut progress).expect("a run");
    let result = pelage::stage::simulate::positions(&mut run, 0, 3);
    assert!(matches!(result, Err(pelage::Error::Stopped)), "{result:?}");
}

/// `pelage preview --watch` at work; ended with this value.
struct Watching {
    child: Child,
    said: Arc<Mutex<Vec<String>>>,
}

impl Watching {
    fn start(shot: &ShotFolder, arguments: &[&str]) -> Self {
        let arguments = [&["preview", "--watch"], arguments].concat();
        let mut child =
            shot.command(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("a child");
        let said = Arc::new(Mutex::new(Vec::new()));
        let pipes: [Box<dyn Read + Send>; 2] =
            [Box::new(child.stdout.take().expect("a pipe")), Box::new(child.stderr.take().expect("a pipe"))];
        for pipe in pipes {
            let said = said.clone();
            std::thread::spawn(move || {
                BufReader::new(pipe).lines().map_while(Result::ok).for_each(|l| said.lock().expect("a list").push(l));
            });
        }
        Watching { child, said }
    }

    /// Number of lines that begin with `start`.
    fn count(&self, start: &str) -> usize {
        self.said.lock().expect("a list").iter().filter(|l| l.starts_with(start)).count()
    }

    /// Waits until `n` lines begin with `start`.
    fn wait(&mut self, n: usize, start: &str) {
        let begun = Instant::now();
        while self.count(start) < n {
            let ended = self.child.try_wait().expect("a child");
            let said = || self.said.lock().expect("a list").join("\n");
            assert!(ended.is_none(), "the watch ended:\n{}", said());
            assert!(begun.elapsed() < Duration::from_secs(120), "no {n} lines with `{start}` in\n{}", said());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[test]
fn the_picture_follows_every_edit() {
    let shot = small_shot(COMMAND, 3);
    let mut watch = Watching::start(&shot, &["--hairs", "20"]);
    watch.wait(1, "full in ");
    watch.wait(1, "watching 6 files");
    assert_eq!((watch.count("draft in "), watch.count("full in ")), (1, 1));
    assert_eq!(shot.outputs().into_keys().collect::<Vec<_>>(), ["ball/preview.png"]);
    assert!(shot.read(STILL) == still_of(&shot));

    shot.write("maps/length.png", grey_png(32, 32, |x, _| 60 + 3 * x as u8));
    watch.wait(2, "full in ");
    watch.wait(1, "maps/length.png changed");
    assert!(watch.count("draft in ") == 2 && shot.read(STILL) == still_of(&shot));

    // Nothing of it is in the picture.
    let seen = shot.read(STILL);
    shot.edit(GROOM, "[control]", "# combed again\n[control]");
    watch.wait(1, "nothing in the picture changes");
    watch.wait(1, "grooms/ball.toml changed");
    assert!(shot.read(STILL) == seen && watch.count("draft in ") == 2);

    // A map that is half saved, then saved.
    let good = grey_png(32, 32, |x, y| 90 + 2 * (x + y) as u8);
    shot.write("maps/length.png", &good[..good.len() / 2]);
    watch.wait(1, "error: ");
    shot.write("maps/length.png", &good);
    watch.wait(3, "full in ");
    assert!(shot.read(STILL) == still_of(&shot));

    // A groom that does not parse, then one that names a map that comes later.
    shot.edit(GROOM, "[control]", "[control");
    watch.wait(2, "error: ");
    shot.edit(GROOM, "[control", "[control]");
    shot.edit(GROOM, "density = { value = 1.0 }", "density = { value = 1.0, map = \"../maps/new/over.png\" }");
    watch.wait(3, "error: ");
    shot.write("maps/new/over.png", grey_png(8, 8, |x, _| if x < 4 { 255 } else { 0 }));
    watch.wait(4, "full in ");
    watch.wait(1, "maps/new/over.png is new");
    assert!(shot.read(STILL) == still_of(&shot));
    shot.write("maps/new/over.png", grey_png(8, 8, |x, _| if x < 4 { 0 } else { 255 }));
    watch.wait(5, "full in ");
    assert!(shot.read(STILL) == still_of(&shot));
    drop(watch);

    // The full picture, not the draft, is the shot's still.
    let (run, _) = shot.plan(&[]);
    assert!(!run.contains("preview/still"), "{run:?}");
}

#[test]
fn an_edit_ends_the_work_before_it() {
    let shot = simulated_shot(COMMAND, 12);
    let mut watch = Watching::start(&shot, &["--crop", "0,0,0.5,1"]);
    watch.wait(1, "draft in ");
    shot.edit(GROOM, "bend = 0.6", "bend = 0.2");
    let whole = shot.fresh();
    whole.succeed(&["preview", "--quiet", "--crop", "0,0,0.5,1"]);
    watch.wait(1, "grooms/ball.toml changed");
    watch.wait(2, "draft in ");
    let name = "out/ball/preview-crop.png";
    let begun = Instant::now();
    while shot.read(name) != whole.read(name) {
        assert!(begun.elapsed() < Duration::from_secs(120), "the picture is not that of the groom");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(!shot.path().join(STILL).exists());
}
