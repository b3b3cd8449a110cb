//! Shadows that skin casts: a map of the skin's depth as a light sees it, looked up with a soft border.
//!
//! Percentage-closer filtering (Reeves, Salesin, Cook 1987) along the plane of the surface that takes the shadow, with
//! a width that grows with the distance to what casts it (Fernando 2005). All weights are continuous in the place that
//! is looked up, so no texel shows.

use crate::preview::SkinView;
use crate::slab::{Affine, Box3};
use crate::{V3, View};
use pelage_geom::Vec3;
use rayon::prelude::*;

/// Texels along the longer side of the map. Half of it loses nostrils and eyelids, twice as many cost four times the
/// memory and time and show no difference in a picture of 1280 pixels.
const TEXELS: usize = 1024;

/// Texels by which skin must be nearer to the light to shadow a point of the skin, and over which that shadow sets in.
/// Under 1, facets of smooth skin shadow themselves; over 3, lips and eyelids cast nothing.
const BIAS: f32 = 1.2;

/// The same for a point off the skin, whose slope towards the light is not known: roots of hair on grazing skin.
const LOOSE_BIAS: f32 = 5.0;

/// Texels that a point of the skin is lifted along its normal.
const LIFT: f32 = 1.5;

/// Steepest slope of a surface towards the light that is followed: steeper ones get next to no light.
const STEEP: f32 = 8.0;

/// Cosine between normal and light under which light fades out: hides where facets turn away one by one.
const GRAZING: f32 = 0.12;

/// Width of a shadow's border by distance: the light's half width as seen from the scene, radians. The sun's would be
/// 0.005; this is a studio lamp's.
const SPREAD: f32 = 0.06;

/// Narrowest and widest half border, texels. At 1, texels show as stairs; the time grows with the square of the second.
const BORDER: [f32; 2] = [2.5, 12.0];

/// Half border for a point off the skin, texels.
const LOOSE_BORDER: f32 = 2.0;

/// Side of the squares of texels whose nearest and farthest depth are known: more than [`LOOSE_BORDER`].
const BLOCK: usize = 8;

/// Most texels that a border touches along an axis.
const TAPS: usize = 26;

/// Depth of the skin nearest to a light.
pub(crate) struct SkinMap {
    /// Camera space to texels; depth in texels too.
    affine: Affine,
    /// Scene units.
    texel: f32,
    /// Square of [`TEXELS`], infinite where no skin is.
    depth: Vec<f32>,
    /// Nearest of 2 x 2 texels: half as many along each axis.
    coarse: Vec<f32>,
    /// Nearest and farthest depth of each square of [`BLOCK`] texels and its neighbours: answers at once for most points
    /// off the skin.
    range: Vec<[f32; 2]>,
}

impl SkinMap {
    /// Looks at a skin along the last of the unit `axis`; `None` without a finite vertex.
    pub fn new(skin: &SkinView, axis: [Vec3; 3], view: &View) -> Option<SkinMap> {
        let mut cells = Box3::around(axis, TEXELS, skin.position.par_iter().map(|&p| Vec3::from(p)))?;
        cells.per_unit = [cells.per_unit[0].min(cells.per_unit[1]); 3];
        let depth = nearest(skin, &cells);
        let half = TEXELS / 2;
        let at = |i: usize, j: usize| depth[j * TEXELS + i];
        let pick = |k: usize| {
            let (i, j) = (k % half * 2, k / half * 2);
            at(i, j).min(at(i + 1, j)).min(at(i, j + 1).min(at(i + 1, j + 1)))
        };
        let coarse = (0..half * half).map(pick).collect();
        let range = ranges(&depth);
        Some(SkinMap { affine: cells.seen_by(view), texel: (1.0 / cells.per_unit[2]) as f32, depth, coarse, range })
    }

    /// The light at a point off the skin, in texels.
    fn loose(&self, [x, y, z]: [f32; 3]) -> f32 {
        let size = TEXELS as f32;
        if !(x > 0.0 && y > 0.0 && x < size && y < size && z.is_finite()) {
            return 1.0;
        }
        let [near, far] = self.range[y as usize / BLOCK * (TEXELS / BLOCK) + x as usize / BLOCK];
        if z - LOOSE_BIAS <= near {
            1.0
        } else if z - 2.0 * LOOSE_BIAS >= far {
            0.0
        } else {
            let plane = Plane { at: [x, y], z, slope: [0.0; 2], bias: LOOSE_BIAS };
            1.0 - plane.blocked(&self.depth, TEXELS, LOOSE_BORDER).0
        }
    }

    /// Part of the light that no skin is in the way of, in [0, 1]. `normal` is the unit normal of the skin if the point is
    /// on it, else zero.
    pub fn light(&self, p: V3, normal: V3) -> f32 {
        if normal == V3::zeros() {
            return self.loose(self.affine.apply(p));
        }
        let [x, y, z] = self.affine.apply(p + normal * (LIFT * self.texel));
        let n = self.affine.turn(normal) * self.texel;
        // The light travels along +z, so skin that it meets has a normal of negative z.
        let facing = -n.z;
        if facing <= 0.0 {
            return 0.0;
        }
        let open = (facing / GRAZING).min(1.0);
        if !(x > 0.0 && y > 0.0 && x < TEXELS as f32 && y < TEXELS as f32 && z.is_finite()) {
            return open;
        }
        let slope = [n.x, n.y].map(|v| (v / facing).clamp(-STEEP, STEEP));
        let steep = slope[0].abs() + slope[1].abs();
        // A coarse texel holds the nearest of four, up to half a texel aside along each axis.
        let wide = Plane { at: [0.5 * x, 0.5 * y], z, slope: slope.map(|s| 2.0 * s), bias: BIAS + 0.5 * steep };
        let (part, gap) = wide.blocked(&self.coarse, TEXELS / 2, 0.5 * BORDER[1]);
        if part <= 0.0 {
            return open;
        }
        let border = (SPREAD * gap).clamp(BORDER[0], BORDER[1]);
        let plane = Plane { at: [x, y], z, slope, bias: BIAS };
        (1.0 - plane.blocked(&self.depth, TEXELS, border).0) * open
    }
}

/// For each square of [`BLOCK`] texels, the nearest and farthest depth in it and the squares around it.
fn ranges(depth: &[f32]) -> Vec<[f32; 2]> {
    const N: usize = TEXELS / BLOCK;
    let join = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let empty = [f32::INFINITY, f32::NEG_INFINITY];
    let mut own = vec![empty; N * N];
    for (j, row) in depth.chunks_exact(TEXELS).enumerate() {
        for (i, part) in row.chunks_exact(BLOCK).enumerate() {
            let block = &mut own[j / BLOCK * N + i];
            *block = part.iter().fold(*block, |r, &d| join(r, [d, d]));
        }
    }
    let around = |k: usize| {
        let (i, j) = (k % N, k / N);
        let rows = j.saturating_sub(1)..(j + 2).min(N);
        let columns = i.saturating_sub(1)..(i + 2).min(N);
        rows.flat_map(|y| own[y * N..][columns.clone()].iter()).fold(empty, |r, &b| join(r, b))
    };
    (0..N * N).map(around).collect()
}

/// The plane of a surface over a map: place in texels of that map, depth in those of the fine one.
struct Plane {
    at: [f32; 2],
    z: f32,
    /// Change of depth by place.
    slope: [f32; 2],
    bias: f32,
}

impl Plane {
    /// Part of a tent of half width `border` that lies behind the map's surface, in [0, 1], and how far behind on average.
    /// Beyond the map nothing is in the way.
    fn blocked(&self, depth: &[f32], size: usize, border: f32) -> (f32, f32) {
        let mut weight = [[0.0f32; TAPS]; 2];
        let mut first = [0usize; 2];
        let mut taps = [0usize; 2];
        let mut all = 1.0;
        for c in 0..2 {
            let centre = self.at[c] - 0.5;
            // Texels from `low` on, of which the first may have no weight; only those on the map are kept.
            let low = (centre - border + TAPS as f32) as i32 - TAPS as i32;
            let mut sum = 0.0;
            for x in low..low + TAPS as i32 {
                let w = 1.0 - (x as f32 - centre).abs() / border;
                if w <= 0.0 {
                    if x as f32 > centre {
                        break;
                    }
                    continue;
                }
                sum += w;
                if (0..size as i32).contains(&x) {
                    first[c] = if taps[c] == 0 { x as usize } else { first[c] };
                    weight[c][taps[c]] = w;
                    taps[c] += 1;
                }
            }
            all *= sum;
        }
        let (mut part, mut gap) = (0.0, 0.0);
        for (j, wy) in weight[1][..taps[1]].iter().enumerate() {
            let y = first[1] + j;
            let row = &depth[y * size + first[0]..][..taps[0]];
            let z = self.z + self.slope[1] * (y as f32 + 0.5 - self.at[1]) - self.bias;
            let z = z + self.slope[0] * (first[0] as f32 + 0.5 - self.at[0]);
            for (i, (wx, d)) in weight[0].iter().zip(row).enumerate() {
                let over = z + self.slope[0] * i as f32 - d;
                if over > 0.0 {
                    let w = wx * wy * (over / self.bias).min(1.0);
                    part += w;
                    gap += w * over;
                }
            }
        }
        if part > 0.0 { ((part / all).min(1.0), gap / part) } else { (0.0, 0.0) }
    }
}

/// Depth of the skin nearest to the light at texel centres, in texels; infinite where there is none.
fn nearest(skin: &SkinView, texels: &Box3) -> Vec<f32> {
    let mut depth = vec![f32::INFINITY; TEXELS * TEXELS];
    for t in skin.triangle {
        let Some(corner) = skin.corners(t) else { continue };
        let c = corner.map(|p| texels.place(p));
        let cross =
            |a: [f64; 3], b: [f64; 3], p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let area = cross(c[0], c[1], [c[2][0], c[2][1]]);
        if area == 0.0 || !area.is_finite() {
            continue;
        }
        let span = |i: usize| {
            let lo = (c[0][i].min(c[1][i]).min(c[2][i]) - 0.5).ceil().max(0.0);
            let hi = (c[0][i].max(c[1][i]).max(c[2][i]) - 0.5).floor().min(TEXELS as f64 - 1.0);
            lo as usize..(hi + 1.0).max(lo) as usize
        };
        for j in span(1) {
            for i in span(0) {
                let p = [i as f64 + 0.5, j as f64 + 0.5];
                let w = [cross(c[1], c[2], p) / area, cross(c[2], c[0], p) / area, cross(c[0], c[1], p) / area];
                if w.iter().all(|&w| w >= -1e-9) {
                    let d = &mut depth[j * TEXELS + i];
                    *d = d.min((w[0] * c[0][2] + w[1] * c[1][2] + w[2] * c[2][2]) as f32);
                }
            }
        }
    }
    depth
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Camera;

    const CAMERA: Camera = Camera {
        eye: [0.0, 0.0, 100.0],
        target: [0.0; 3],
        up: [0.0, 1.0, 0.0],
        fov_y_deg: 30.0,
        near: 0.1,
        parallel_height: None,
    };

    /// A ball of radius 4 that hangs 20 above a square floor of half width 15; light from straight above.
    fn ball_over_floor() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let mut position = vec![[-15.0, 0.0, -15.0], [15.0, 0.0, -15.0], [15.0, 0.0, 15.0], [-15.0, 0.0, 15.0]];
        let mut triangle = vec![[0, 1, 2], [0, 2, 3]];
        let n = 60u32;
        for j in 0..=n {
            let polar = std::f64::consts::PI * f64::from(j) / f64::from(n);
            for i in 0..n {
                let a = std::f64::consts::TAU * f64::from(i) / f64::from(n);
                let r = 4.0 * libm::sin(polar);
                position.push([r * libm::cos(a), 20.0 + 4.0 * libm::cos(polar), r * libm::sin(a)]);
                if j < n {
                    let at = |i: u32, j: u32| 4 + j * n + i % n;
                    triangle.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
                    triangle.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        (position, triangle)
    }

    #[test]
    fn a_shadow_has_the_size_of_its_caster_and_a_smooth_round_border() {
        let (position, triangle) = ball_over_floor();
        let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.5; 3] };
        let view = CAMERA.view(100, 100);
        let map = SkinMap::new(&skin, [Vec3::x(), Vec3::z(), -Vec3::y()], &view).expect("a skin");
        let up: V3 = view.turn(Vec3::y()).cast();
        let at = |r: f64, angle: f64| {
            let p = Vec3::new(r * libm::cos(angle), 0.0, r * libm::sin(angle));
            map.light(view.to_camera(p).cast(), up)
        };
        for k in 0..37 {
            let angle = f64::from(k) * 0.17;
            let inside = at(0.5, angle).max(at(3.0, angle));
            assert!(inside < 1e-5 && (at(5.0, angle), at(14.0, angle)) == (1.0, 1.0), "{inside}");
            // Half of the light at the ball's radius, within a texel (0.03) and what 60 corners leave out.
            let edge = (0..200).map(|i| 3.4 + 0.006 * f64::from(i)).find(|&r| at(r, angle) >= 0.5).expect("a border");
            assert!((edge - 4.0).abs() < 0.04, "{edge} at {angle}");
            let steps = (0..400).map(|i| at(3.2 + 0.004 * f64::from(i), angle)).collect::<Vec<_>>();
            assert!(steps.windows(2).all(|w| w[1] - w[0] < 0.03 && w[1] > w[0] - 0.02), "{steps:?}");
        }
    }

    #[test]
    fn a_smooth_ball_does_not_shadow_itself() {
        let (position, triangle) = ball_over_floor();
        let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.5; 3] };
        let view = CAMERA.view(100, 100);
        for light in [Vec3::y(), Vec3::new(0.6, 0.64, -0.48)] {
            let x = Vec3::new(light.y, -light.x, 0.0).normalize();
            let map = SkinMap::new(&skin, [x, light.cross(&x), -light], &view).expect("a skin");
            // Middles of the flat triangles, with the normals of the round ball.
            for t in &triangle[2..] {
                let corner = t.map(|v| Vec3::from(position[v as usize]));
                let p = (corner[0] + corner[1] + corner[2]) / 3.0;
                let n = (p - Vec3::new(0.0, 20.0, 0.0)).normalize();
                let facing = n.dot(&light);
                let lit = map.light(view.to_camera(p).cast(), view.turn(n).cast());
                let wanted = (facing as f32 / GRAZING).clamp(0.0, 1.0);
                assert!((lit - wanted).abs() < 0.02, "{lit} instead of {wanted} where the light comes in at {facing}");
            }
        }
    }

    #[test]
    fn the_short_cut_off_the_skin_gives_what_the_texels_give() {
        let (position, triangle) = ball_over_floor();
        let skin = SkinView { position: &position, triangle: &triangle, normal: &[], color: [0.5; 3] };
        let view = CAMERA.view(100, 100);
        let map = SkinMap::new(&skin, [Vec3::x(), Vec3::z(), -Vec3::y()], &view).expect("a skin");
        let mut seen = [0; 3];
        for k in 0..20_000 {
            let u = |c: u64| pelage_geom::rng::uniform(7, k, c, 0);
            let p = view.to_camera(Vec3::new(30.0 * u(0) - 15.0, 26.0 * u(1) - 1.0, 30.0 * u(2) - 15.0)).cast();
            let [x, y, z] = map.affine.apply(p);
            let plane = Plane { at: [x, y], z, slope: [0.0; 2], bias: LOOSE_BIAS };
            let slow = 1.0 - plane.blocked(&map.depth, TEXELS, LOOSE_BORDER).0;
            let fast = map.light(p, V3::zeros());
            assert!((fast - slow).abs() < 1e-5, "{fast} {slow}");
            seen[if fast <= 0.0 {
                0
            } else if fast >= 1.0 {
                1
            } else {
                2
            }] += 1;
        }
        assert!(seen[0] > 500 && seen[1] > 5000 && seen[2] > 20, "{seen:?}");
    }
}
