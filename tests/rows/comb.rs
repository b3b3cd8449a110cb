//! Rows of combing.

use super::{GROOM, expect, finished, hairs, with_files};

#[test]
fn what_hair_follows_and_where_it_is_cut_combs_again() {
    let shot = finished();
    let field = "[[comb]]\nkind = \"field\"\n[[comb.primitive]]\norientation = \"radial\"\nposition = [0.0, 4.0, 0.0]\n\
                 strength = 2.0\n\n[[layer]]";
    shot.edit(GROOM, "[[layer]]", field);
    shot.report(&[]);
    let combed = with_files(&["groom/comb", "interpolate/under/*", "interpolate/over/*"]);
    let before = hairs(&shot);
    shot.edit(GROOM, "strength = 2.0", "strength = -2.0");
    expect(&shot, &combed, &["grooms/ball.toml: comb[1].primitive[0].strength 2 -> -2"]);
    assert!(hairs(&shot) != before, "hair turns round");
    // Lines keep the clearance, whether hair is pushed up or not.
    shot.edit(GROOM, "points = 6\n", "points = 6\npush_up = false\nclearance = 0.5\n");
    shot.report(&[]);
    shot.edit(GROOM, "clearance = 0.5", "clearance = 40.0");
    expect(&shot, &combed, &["grooms/ball.toml: control.clearance 0.5 -> 40"]);
    shot.edit(
        GROOM,
        "[[layer]]",
        "[[comb]]\nkind = \"flow\"\npanels = { most = 100, through = { value = 1.0 } }\n\n[[layer]]",
    );
    shot.report(&[]);
    shot.edit(GROOM, "through = { value = 1.0", "through = { value = 0.5");
    expect(&shot, &combed, &["grooms/ball.toml: comb[2].panels.through 1 -> 0.5"]);
    // Ball and hair: what is above the plane ends there.
    let cut =
        "[[comb]]\nkind = \"cut\"\nshear = { at = { point = [0.0, 5.5, 0.0], normal = [0.0, 1.0, 0.0] } }\n\n[[layer]]";
    shot.edit(GROOM, "[[layer]]", cut);
    shot.report(&[]);
    let whole = hairs(&shot);
    shot.edit(GROOM, "[0.0, 5.5, 0.0]", "[0.0, 5.2, 0.0]");
    expect(&shot, &combed, &["grooms/ball.toml: comb[3].shear.at.point [0.0,5.5,0.0] -> [0.0,5.2,0.0]"]);
    assert!(hairs(&shot) != whole, "hair is shorter");
}
