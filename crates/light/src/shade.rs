//! How much light a hair and the skin send to the eye.

use crate::{Camera, V3};
use pelage_geom::Vec3;

/// A light. Its strength is what arrives: it does not fall off with distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Light {
    /// The way the light travels, towards the scene, in scene space; any length but zero. Of a light at a position: the
    /// middle of its cone, if it has one.
    pub direction: [f64; 3],
    /// Linear colour times strength: 1 on a surface at right angles to the light shows its own colour.
    pub color: [f32; 3],
    /// Where it stands, scene space; `None`: far away.
    pub position: Option<[f64; 3]>,
    /// Half angles of the full beam and of its border, radians; `None`: to all sides.
    pub cone: Option<[f64; 2]>,
    /// Angle beyond a right angle, radians, up to which it lights hair that takes the shading of the skin: the production
    /// pipeline's falloff angle of a light (§4.4), by which a light from behind reaches round the body.
    pub wrap: f64,
}

/// Key from above left, fill from the right, rim from behind: three lights that move with the camera.
pub fn studio_lights(camera: &Camera) -> Vec<Light> {
    let axis = camera.view(1, 1).axis;
    let light = |x: f64, y: f64, z: f64, color| Light {
        direction: (axis[0] * x + axis[1] * y + axis[2] * z).into(),
        color,
        ..Light::default()
    };
    vec![
        light(0.55, 0.75, 0.75, [1.30, 1.22, 1.12]),
        light(-0.8, 0.1, 0.75, [0.30, 0.32, 0.37]),
        light(-0.55, 0.75, -0.8, [0.80, 0.85, 0.94]),
    ]
}

/// Shading of a hair: Kajiya and Kay's model (opacity shadow maps paper §5) with two highlights instead of one, and
/// Goldman's factor for light from the front and from behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HairShade {
    /// Factor of the diffuse part, which has the hair's colour.
    pub diffuse: f32,
    /// Factor of the first highlight, which has the light's colour.
    pub specular: f32,
    /// Its exponent: 20 is dull, 150 is polished.
    pub exponent: u32,
    /// Degrees by which it moves towards the root: the slope of the scales, about 7 on human hair.
    pub shift_deg: f32,
    /// Factor of the second highlight, which has the hair's colour.
    pub glint: f32,
    /// Its exponent: lower than the first.
    pub glint_exponent: u32,
    /// Degrees by which it moves towards the tip.
    pub glint_shift_deg: f32,
    /// Light that comes through from behind, relative to light sent back to the front (Goldman 1997, "Fake fur
    /// rendering", the ratio of its transmission and reflection factors).
    pub through: f32,
    /// How much a hair that stands up takes the shading of the skin at its root, in [0, 1]: the production pipeline's
    /// mixed normal (§4.4), which gives short fur the form of the body. Only with root normals.
    pub skin_normal: f32,
}

impl Default for HairShade {
    fn default() -> Self {
        HairShade {
            diffuse: 0.66,
            specular: 0.13,
            exponent: 60,
            shift_deg: 7.0,
            glint: 0.6,
            glint_exponent: 16,
            glint_shift_deg: 9.0,
            through: 0.6,
            skin_normal: 0.8,
        }
    }
}

/// A light as the shading wants it: camera space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightDir {
    /// Unit, against the way the light travels.
    pub to_light: V3,
    /// Linear colour times strength.
    pub color: V3,
    /// Where it stands, unless it is far away.
    pub position: Option<V3>,
    /// Cosines of the full beam and of its border.
    pub cone: Option<[f32; 2]>,
    /// Sine of the angle beyond a right angle up to which it lights hair.
    pub wrap: f32,
}

impl LightDir {
    /// Unit vector from a point to the light, and the part of the beam that is sent that way.
    pub fn toward(&self, p: V3) -> (V3, f32) {
        let Some(position) = self.position else { return (self.to_light, 1.0) };
        let way = position - p;
        let r = way.norm();
        let t = if r > 0.0 { way / r } else { self.to_light };
        let Some([full, border]) = self.cone else { return (t, 1.0) };
        let cos = t.dot(&self.to_light);
        let x =
            if full > border { ((cos - border) / (full - border)).clamp(0.0, 1.0) } else { f32::from(cos >= border) };
        (t, x * x * (3.0 - 2.0 * x))
    }
}

/// A point of a hair as the shading wants it: camera space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HairPoint {
    pub position: V3,
    /// Unit, from root to tip.
    pub tangent: V3,
    /// Linear.
    pub color: V3,
    /// Unit normal of the skin at the root.
    pub normal: Option<V3>,
    /// Factor of the first highlight.
    pub shine: f32,
    /// How far out on its clump it is, and which way: from 0 in the middle to 1 in length.
    pub side: V3,
}

/// Constants of [`HairShade`], worked out once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HairModel {
    shade: HairShade,
    first: Lobe,
    second: Lobe,
}

/// One highlight.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    cos: f32,
    sin: f32,
    exponent: u32,
}

impl Lobe {
    fn new(shift_deg: f32, exponent: u32) -> Lobe {
        let a = f64::from(shift_deg).to_radians();
        Lobe { cos: libm::cos(a) as f32, sin: libm::sin(a) as f32, exponent }
    }

    /// The highlight for -cos(a + b) and sin(a + b), a and b the angles of light and eye with the hair.
    fn value(&self, cos: f32, sin: f32) -> f32 {
        power((cos * self.cos + sin * self.sin).clamp(0.0, 1.0), self.exponent)
    }
}

/// x^n by squaring: always the same products, unlike a library's power.
fn power(x: f32, n: u32) -> f32 {
    let (mut square, mut left, mut out) = (x, n, 1.0);
    while left > 0 {
        if left & 1 == 1 {
            out *= square;
        }
        square *= square;
        left >>= 1;
    }
    out
}

impl HairModel {
    pub fn new(shade: HairShade) -> HairModel {
        HairModel {
            shade,
            first: Lobe::new(shade.shift_deg, shade.exponent),
            second: Lobe::new(-shade.glint_shift_deg, shade.glint_exponent),
        }
    }

    /// Light sent to the eye by one light of strength 1, before shadows: `tangent` unit from root to tip, `eye` and
    /// `light` unit and away from the hair, `normal` that of the skin at the root. With T, L, V for those:
    /// diffuse sin(T, L), highlight max(0, sin(T, L) sin(T, V) - (T.L)(T.V))^p, whose base is -cos of the sum of both
    /// angles, so that a shift of the highlight is a shift of that sum.
    /// The first highlight is `shine` times as strong; the shading of the skin falls off to 0 at a right angle and `wrap` (a
    /// sine) beyond.
    pub fn reflect(&self, at: &HairPoint, eye: V3, light: V3, wrap: f32) -> V3 {
        let (s, HairPoint { tangent, normal, color, shine, .. }) = (&self.shade, *at);
        let (tl, tv) = (tangent.dot(&light), tangent.dot(&eye));
        let (sl, sv) = ((1.0 - tl * tl).max(0.0).sqrt(), (1.0 - tv * tv).max(0.0).sqrt());
        // Light and eye on the same side of the hair (1) or on opposite sides (-1), seen along the hair.
        let side = if sl * sv > 1e-4 { ((light.dot(&eye) - tl * tv) / (sl * sv)).clamp(-1.0, 1.0) } else { 0.0 };
        let front = 0.5 + 0.5 * side;
        let lit = front + (1.0 - front) * s.through;
        let mut diffuse = sl * lit;
        if let Some(n) = normal {
            let m = s.skin_normal * tangent.dot(&n).abs().min(1.0);
            let facing = ((n.dot(&light) + wrap) / (1.0 + wrap)).max(0.0);
            diffuse += (facing - diffuse) * m;
        }
        let (cos, sin) = (sl * sv - tl * tv, sl * tv + tl * sv);
        let first = shine * s.specular * front * self.first.value(cos, sin);
        let second = s.glint * lit * self.second.value(cos, sin);
        color * (s.diffuse * diffuse + second) + V3::repeat(first)
    }
}

/// exp(-x) for x >= 0 by a rational function without a platform's exp: within 0.6 % of 1, falling all the way.
pub(crate) fn fade(x: f32) -> f32 {
    1.0 / (1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * (1.0 / 24.0 + x * (1.0 / 120.0))))))
}

/// Unit vector towards a light; straight up for a light without direction.
pub(crate) fn to_light(light: &Light) -> Vec3 {
    let d = Vec3::from(light.direction);
    let big = d.amax();
    if big > 0.0 && big.is_finite() { -(d / big).normalize() } else { Vec3::y() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(exponent: u32) -> HairModel {
        HairModel::new(HairShade {
            diffuse: 0.0,
            specular: 1.0,
            exponent,
            shift_deg: 0.0,
            glint: 0.0,
            glint_exponent: 1,
            glint_shift_deg: 0.0,
            through: 1.0,
            skin_normal: 0.0,
        })
    }

    /// A point of a hair without a colour of its own.
    fn black(tangent: V3) -> HairPoint {
        let zero = V3::zeros();
        HairPoint { position: zero, tangent, color: zero, normal: None, shine: 1.0, side: zero }
    }

    #[test]
    fn light_wraps_as_far_as_its_angle() {
        let model = HairModel::new(HairShade { skin_normal: 1.0, specular: 0.0, glint: 0.0, ..HairShade::default() });
        // A hair that stands up has the shading of the skin alone.
        let at = HairPoint { normal: Some(V3::z()), color: V3::repeat(1.0), ..black(V3::z()) };
        let lit = |degrees: f64, wrap: f64| {
            let a = degrees.to_radians();
            let light = V3::new(libm::sin(a) as f32, 0.0, libm::cos(a) as f32);
            model.reflect(&at, V3::x(), light, libm::sin(wrap.to_radians()) as f32).x
        };
        assert!(lit(89.0, 0.0) > 0.0 && lit(91.0, 0.0) == 0.0);
        assert!(lit(119.0, 30.0) > 0.0 && lit(121.0, 30.0) == 0.0);
        assert_eq!(lit(0.0, 0.0), lit(0.0, 30.0));
    }

    #[test]
    fn the_highlight_peaks_on_the_mirror_cone() {
        let model = plain(60);
        let tangent = V3::x();
        let light = V3::new(0.6, 0.8, 0.0);
        let (mut best, mut at) = (0.0, 0.0f64);
        for k in 0..=1800 {
            let a = f64::from(k) * 0.1_f64.to_radians();
            let eye = V3::new(libm::cos(a) as f32, libm::sin(a) as f32, 0.0);
            let v = model.reflect(&black(tangent), eye, light, 0.0).x;
            if v > best {
                (best, at) = (v, a);
            }
        }
        assert!((libm::cos(at) + 0.6).abs() < 2e-3, "peak at {}", at.to_degrees());
        assert!((best - 1.0).abs() < 2e-3, "{best}");
    }

    #[test]
    fn a_shift_moves_the_peak_towards_the_root() {
        // Hair bending from tangent angle 50 (towards the eye at its root) to 130 degrees; light and eye along +x.
        let peak = |shift: f32| {
            let mut model = plain(80);
            model.first = Lobe::new(shift, 80);
            let value = |a: f64| {
                let t = V3::new(libm::cos(a.to_radians()) as f32, libm::sin(a.to_radians()) as f32, 0.0);
                model.reflect(&black(t), V3::x(), V3::x(), 0.0).x
            };
            (500..=1300).map(|k| f64::from(k) * 0.1).fold(50.0, |b, a| if value(a) > value(b) { a } else { b })
        };
        assert!((peak(0.0) - 90.0).abs() < 0.2);
        assert!((peak(8.0) - 86.0).abs() < 0.2);
        assert!((peak(-8.0) - 94.0).abs() < 0.2);
    }

    #[test]
    fn shading_is_finite_and_not_negative_for_any_directions() {
        let model = HairModel::new(HairShade::default());
        let dirs = [V3::x(), -V3::x(), V3::y(), V3::z(), -V3::z(), V3::new(0.6, 0.0, 0.8)];
        for t in dirs {
            for e in dirs {
                for l in dirs {
                    for n in [None, Some(V3::z()), Some(-V3::z())] {
                        let at = HairPoint { normal: n, color: V3::new(0.3, 0.2, 0.1), ..black(t) };
                        let c = model.reflect(&at, e, l, 0.5);
                        assert!(c.iter().all(|v| v.is_finite() && *v >= 0.0), "{t} {e} {l}: {c}");
                    }
                }
            }
        }
    }

    #[test]
    fn fade_is_close_to_the_exponential() {
        for k in 0..2000 {
            let x = k as f32 * 0.01;
            assert!((fade(x) - libm::expf(-x)).abs() < 0.006, "{x}");
            assert!(fade(x + 0.01) < fade(x));
        }
        assert_eq!(fade(f32::INFINITY), 0.0);
    }
}
