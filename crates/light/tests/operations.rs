//! How much work the hot loops do on small fixed inputs: a gate for speed that needs no clock.
//!
//! Times change with the machine, counts of operations do not. What makes one operation dearer is not seen here but in the
//! benchmarks.

mod common;

use common::{Groom, curly, fur, long};
use pelage_geom::Vec3;
use pelage_light::shadow::{ShadowSettings, Source, transmittance};
use pelage_light::{Camera, HairView, Scene, Settings, render, studio_lights};

/// A count may be this part away from what it was. More work wants a reason; less is written down here too.
const TOLERANCE: f64 = 0.02;

/// Holds counts against what they were, all of them before it fails.
fn check(counts: &[(&str, [usize; 2], [usize; 2])]) {
    let near = |f: usize, e: usize| (f as f64 / e as f64 - 1.0).abs() < TOLERANCE;
    let off: Vec<_> = counts.iter().filter(|(_, f, e)| !(near(f[0], e[0]) && near(f[1], e[1]))).collect();
    assert!(off.is_empty(), "counts changed (name, now, before): {off:?}");
}

#[test]
fn shadow_maps_look_at_as_many_segments_and_deposits() {
    let source = Source::Directional { direction: Vec3::new(-0.4, -1.0, -0.3) };
    let count = |groom: Groom| {
        let (_, counts) = transmittance(source, &[groom.view()], &[], &ShadowSettings::default()).expect("a light");
        [counts.pairs, counts.deposits]
    };
    // Segments over all tiles, and deposits.
    check(&[
        ("long", count(long(2_000, 26)), [69_836, 1_190_510]),
        ("fur", count(fur(5_000, 9)), [56_488, 1_545_989]),
        ("curly", count(curly(500, 101)), [62_346, 624_354]),
    ]);
}

#[test]
fn pictures_draw_as_many_pieces_and_pixels() {
    let camera = Camera::frame(([-0.2, -0.3, -0.2], [0.2; 3]), [-0.4, -0.2, -1.0], [0.0, 1.0, 0.0], 4.0 / 3.0);
    let lights = studio_lights(&camera);
    let count = |groom: Groom| {
        let layers = [HairView::plain(&groom.offsets, &groom.position, [0.0; 3], &groom.width)];
        let scene = Scene { skin: None, layers: &layers, lights: &lights, background: [0.0; 3] };
        let (_, counts) = render(&scene, &camera, 400, 300, &Settings::default());
        [counts.pieces, counts.pixels]
    };
    // Pieces of hairs, and pixels under them.
    check(&[("long", count(long(2_000, 26)), [49_598, 898_573]), ("fur", count(fur(5_000, 9)), [34_591, 423_844])]);
}
