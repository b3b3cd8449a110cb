//! Input that is nothing, or wrong, and work that is stopped. What hair must bear is in `stress`.

mod common;

use common::{GRAVITY, Rig, placed};
use pelage_geom::Offsets;
use pelage_sim::{Body, Hairs, Material, Root, Settings, SimError, Simulation, Span};

const FRAME: f64 = 1.0 / 24.0;

/// Hairs of several lengths, straight down.
fn tuft() -> Vec<Vec<[f64; 3]>> {
    let hair = |k: u32| (0..12 + k).map(|i| [0.01 * f64::from(k), -0.008 * f64::from(i), 0.0]).collect();
    (0..5).map(hair).collect()
}

#[test]
fn bad_input_is_told_by_hair_and_point() {
    let mut hairs = tuft();
    hairs[2][3][1] = f64::NAN;
    let (offsets, position) = (Offsets::from_counts(hairs.iter().map(Vec::len)), hairs.concat());
    let input = Hairs { offsets: &offsets, position: &position, id: &[1, 2, 3, 4, 5], material: &[] };
    let error = Simulation::new(&input, &Settings::default(), GRAVITY).unwrap_err();
    assert!(error.to_string().contains("hair 2, point 3"), "{error}");
    for density in [0.0, -0.0] {
        let material = Material { density, ..Material::default() };
        assert!(Settings { material, ..Settings::default() }.check().is_err());
    }
}

#[test]
fn nothing_to_do_and_stopping() {
    let offsets = Offsets::from_counts(std::iter::empty());
    let none = Hairs { offsets: &offsets, position: &[], id: &[], material: &[] };
    let (mut sim, started) = Simulation::new(&none, &Settings::default(), GRAVITY).unwrap();
    assert_eq!(started.particles, 0);
    let span = |roots: &'static [Root]| Span {
        seconds: FRAME,
        time: 0.0,
        motion: &common::still,
        roots: [roots, roots],
        tips: None,
        body: &EMPTY,
        gravity: [GRAVITY; 2],
        wind: None,
        still: &[],
    };
    assert!(sim.advance(&span(&[]), &|_| true).is_ok());
    // Stopped, and put back where it was.
    let hairs = tuft();
    let mut shot = Rig::under(&hairs, &Settings::default(), GRAVITY).unwrap();
    shot.gravity = [3.0, -9.81, 0.0];
    shot.wait(FRAME).unwrap();
    let saved = shot.sim.save();
    let mut other = shot.clone();
    let roots: &'static [Root] = Box::leak(shot.roots.clone().into_boxed_slice());
    assert_eq!(shot.sim.advance(&span(roots), &|_| false), Err(SimError::Stopped));
    shot.sim.restore(&saved).unwrap();
    shot.wait(FRAME).unwrap();
    other.wait(FRAME).unwrap();
    assert_eq!(shot.sim.save(), other.sim.save());
    let _ = placed([0.0; 3]);
}

static EMPTY: Body<'static> = Body { parts: Vec::new(), seconds: FRAME };
