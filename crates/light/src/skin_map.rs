//! Shadows that skin casts: a map of the skin's depth as a light sees it, looked up with a soft border.
//!
//! Percentage-closer filtering (Reeves, Salesin, Cook 1987) along the plane of the surface that takes the shadow, with
//! a width that grows with the distance to what casts it (Fernando 2005). All weights are continuous in the place that
//! is looked up, so no texel shows.

use crate::preview::SkinView;
use crate::slab::{Affine, Box3};
use crate::{V3, View};
use pelage_geom::Vec3;

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
}

impl SkinMap {
    /// Looks at a skin along the last of the unit `axis`; `None` without a finite vertex.
    pub fn new(skin: &SkinView, axis: [Vec3; 3], view: &View) -> Option<SkinMap> {
        let mut cells = Box3::around(axis, TEXELS, skin.position.iter().map(|&p| Vec3::from(p)))?;
        cells.per_unit = [cells.per_unit[0].min(cells.per_unit[1]); 3];
        let depth = nearest(skin, &cells);
        let half = TEXELS / 2;
        let at = |i: usize, j: usize| depth[j * TEXELS + i];
        let pick = |k: usize| {
            let (i, j) = (k % half * 2, k / half * 2);
            at(i, j).min(at(i + 1, j)).min(at(i, j + 1).min(at(i + 1, j + 1)))
        };
        let coarse = (0..half * half).map(pick).collect();
        Some(SkinMap { affine: cells.seen_by(view), texel: (1.0 / cells.per_unit[2]) as f32, depth, coarse })
    }

    /// Part of the light that no skin is in the way of, in [0, 1]. `normal` is the unit normal of the skin if the point is
    /// on it, else zero.
    pub fn light(&self, p: V3, normal: V3) -> f32 {
        if normal == V3::zeros() {
            let [x, y, z] = self.affine.apply(p);
            let inside = x > 0.0 && y > 0.0 && x < TEXELS as f32 && y < TEXELS as f32 && z.is_finite();
            let plane = Plane { at: [x, y], z, slope: [0.0; 2], bias: LOOSE_BIAS };
            return if inside { 1.0 - plane.blocked(&self.depth, TEXELS, LOOSE_BORDER).0 } else { 1.0 };
        }
        let [x, y, z] = self.affine.apply(p + normal * (LIFT * self.texel));
        let n = self.affine.turn(normal) * self.texel;
        if !(x > 0.0 && y > 0.0 && x < TEXELS as f32 && y < TEXELS as f32 && z.is_finite()) {
            return 1.0;
        }
        // The light travels along +z, so skin that it meets has a normal of negative z.
        let facing = -n.z;
        if facing <= 0.0 {
            return 0.0;
        }
        let slope = [n.x, n.y].map(|v| (v / facing).clamp(-STEEP, STEEP));
        let steep = slope[0].abs() + slope[1].abs();
        // A coarse texel holds the nearest of four, up to half a texel aside along each axis.
        let wide = Plane { at: [0.5 * x, 0.5 * y], z, slope: slope.map(|s| 2.0 * s), bias: BIAS + 0.5 * steep };
        let (part, gap) = wide.blocked(&self.coarse, TEXELS / 2, 0.5 * BORDER[1]);
        if part <= 0.0 {
            return (facing / GRAZING).min(1.0);
        }
        let border = (SPREAD * gap).clamp(BORDER[0], BORDER[1]);
        let plane = Plane { at: [x, y], z, slope, bias: BIAS };
        (1.0 - plane.blocked(&self.depth, TEXELS, border).0) * (facing / GRAZING).min(1.0)
    }
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
        let mut first = [0i32; 2];
        let mut taps = [0usize; 2];
        let mut all = 1.0;
        for c in 0..2 {
            let centre = self.at[c] - 0.5;
            first[c] = (centre - border).ceil() as i32;
            taps[c] = ((centre + border).floor() as i32 - first[c] + 1).clamp(0, TAPS as i32) as usize;
            let mut sum = 0.0;
            for (k, w) in weight[c][..taps[c]].iter_mut().enumerate() {
                *w = (1.0 - ((first[c] + k as i32) as f32 - centre).abs() / border).max(0.0);
                sum += *w;
            }
            all *= sum;
        }
        let (mut part, mut gap) = (0.0, 0.0);
        for (j, wy) in weight[1][..taps[1]].iter().enumerate() {
            let y = first[1] + j as i32;
            if !(0..size as i32).contains(&y) {
                continue;
            }
            let row = &depth[y as usize * size..][..size];
            let z = self.z + self.slope[1] * (y as f32 + 0.5 - self.at[1]) - self.bias;
            for (i, wx) in weight[0][..taps[0]].iter().enumerate() {
                let x = first[0] + i as i32;
                let Some(&d) = row.get(x as usize) else { continue };
                let over = z + self.slope[0] * (x as f32 + 0.5 - self.at[0]) - d;
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
