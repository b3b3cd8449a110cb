//! Elements of ideal flow that a hairstyle is made of, and the velocities they induce.

use pelage_geom::Vec3;

/// 1 / (4 pi).
pub(super) const PER_SPHERE: f64 = 1.0 / (4.0 * std::f64::consts::PI);

/// One element of ideal flow (Hadap, Magnenat-Thalmann, "Hair shape as streamlines of fluid flow", §2.1 to 2.3), in
/// scene units: positions and `core` are lengths, velocities are speeds on any scale (streamlines follow their
/// direction only).
///
/// Within `core` of its singularity a velocity falls linearly to zero, outside it is exact. A core of 0 is allowed; on
/// the singularity itself the velocity is then zero.
#[derive(Clone, Debug, PartialEq)]
pub enum Element {
    /// The same velocity everywhere (equation 2).
    Stream {
        /// Velocity.
        velocity: Vec3,
    },
    /// Flow out of a point, or into it (a sink), its speed |strength| / (4 pi r^2) (equation 3).
    Source {
        /// The point.
        at: Vec3,
        /// Volume a time: square length times speed; negative for a sink.
        strength: f64,
        /// Radius of the core.
        core: f64,
    },
    /// Flow around an infinite line, counter-clockwise seen from where `axis` points to, its speed |strength| / (2 pi
    /// r).
    Vortex {
        /// A point of the line.
        at: Vec3,
        /// Direction of the line, not zero; any length.
        axis: Vec3,
        /// Circulation: length times speed.
        strength: f64,
        /// Radius of the core.
        core: f64,
    },
    /// Flow around a polyline by the law of Biot and Savart (equation 4 for each segment). The field of an open
    /// filament has no sources, but is irrotational only for a closed one (last point equal to the first).
    Filament {
        /// Points in the direction that the flow goes around counter-clockwise seen from ahead.
        points: Vec<Vec3>,
        /// Circulation: length times speed.
        strength: f64,
        /// Radius of the core.
        core: f64,
    },
}

impl Element {
    /// Velocity at a point.
    pub fn velocity(&self, at: Vec3) -> Vec3 {
        match self {
            Element::Stream { velocity } => *velocity,
            Element::Source { at: source, strength, core } => {
                let r = at - source;
                let d = r.norm().max(*core);
                if d > 0.0 { r * (strength * PER_SPHERE / (d * d * d)) } else { Vec3::zeros() }
            }
            Element::Vortex { at: point, axis, strength, core } => {
                let Some(axis) = axis.try_normalize(0.0) else { return Vec3::zeros() };
                let around = axis.cross(&(at - point));
                let square = around.norm_squared().max(core * core);
                if square > 0.0 { around * (2.0 * strength * PER_SPHERE / square) } else { Vec3::zeros() }
            }
            Element::Filament { points, strength, core } => {
                let sum = points.windows(2).fold(Vec3::zeros(), |v, w| v + segment(at, w[0], w[1], *core));
                sum * (strength * PER_SPHERE)
            }
        }
    }

    /// A lower bound, zero or more, of the distance from a point to where the velocity is not smooth: the core.
    pub(super) fn smooth_within(&self, at: Vec3) -> f64 {
        let (distance, core) = match self {
            Element::Stream { .. } => return f64::INFINITY,
            Element::Source { at: source, core, .. } => ((at - source).norm(), core),
            Element::Vortex { at: point, axis, core, .. } => {
                (axis.try_normalize(0.0).map_or(f64::INFINITY, |a| a.cross(&(at - point)).norm()), core)
            }
            Element::Filament { points, core, .. } => (pelage_geom::curve::closest_on_polyline(points, at).3, core),
        };
        (distance - core).max(0.0)
    }
}

/// Velocity by a straight segment, times 4 pi over its circulation.
pub(crate) fn segment(at: Vec3, p1: Vec3, p2: Vec3, core: f64) -> Vec3 {
    let (r1, r2, r0) = (at - p1, at - p2, p2 - p1);
    let (d1, d2) = (r1.norm(), r2.norm());
    let cross = r1.cross(&r2);
    let square = cross.norm_squared().max(core * core * r0.norm_squared());
    if d1 == 0.0 || d2 == 0.0 || square == 0.0 {
        return Vec3::zeros();
    }
    // r0 . (r1 / d1 - r2 / d2), free of cancellation far from the segment: (d1 + d2) (1 - cos) with the angle between.
    let angle = if r1.dot(&r2) > 0.0 {
        cross.norm_squared() / (d1 * d2 * (d1 * d2 + r1.dot(&r2)))
    } else {
        1.0 - r1.dot(&r2) / (d1 * d2)
    };
    cross * ((d1 + d2) * angle / square)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::test_laws::{curl, divergence};
    use std::f64::consts::PI;

    fn v(x: f64, y: f64, z: f64) -> Vec3 {
        Vec3::new(x, y, z)
    }

    #[test]
    fn a_source_spreads_evenly_and_a_vortex_goes_round() {
        let source = Element::Source { at: v(1.0, 2.0, 3.0), strength: 5.0, core: 0.1 };
        let out = source.velocity(v(1.0, 4.0, 3.0));
        assert!((out - v(0.0, 5.0 / (4.0 * PI * 4.0), 0.0)).norm() < 1e-15);
        assert!((source.velocity(v(1.0, 2.05, 3.0)).y - 0.5 * 5.0 / (4.0 * PI * 0.01)).abs() < 1e-12);
        assert_eq!(source.velocity(v(1.0, 2.0, 3.0)), Vec3::zeros());
        let vortex = Element::Vortex { at: v(0.0, 0.0, 7.0), axis: v(0.0, 0.0, 3.0), strength: 2.0, core: 0.5 };
        for (r, speed) in [(2.0, 2.0 / (2.0 * PI * 2.0)), (0.25, 0.25 * 2.0 / (2.0 * PI * 0.25))] {
            assert!((vortex.velocity(v(r, 0.0, -4.0)) - v(0.0, speed, 0.0)).norm() < 1e-15, "{r}");
        }
    }

    #[test]
    fn a_straight_filament_has_its_closed_form_however_it_is_cut() {
        let whole = Element::Filament { points: vec![v(0.0, 0.0, -1.0), v(0.0, 0.0, 3.0)], strength: 2.5, core: 0.0 };
        let cut: Vec<Vec3> = [-1.0, -0.9, 0.3, 2.0, 3.0].map(|z| v(0.0, 0.0, z)).to_vec();
        let cut = Element::Filament { points: cut, strength: 2.5, core: 0.0 };
        for (r, z) in [(0.3, 0.0), (2.0, -4.0), (0.01, 2.9), (50.0, 1.0), (1.0, 90.0)] {
            let cosine = |end: f64| (z - end) / ((z - end) * (z - end) + r * r).sqrt();
            let speed = 2.5 / (4.0 * PI * r) * (cosine(-1.0) - cosine(3.0));
            let at = v(0.0, -r, z);
            assert!((whole.velocity(at) - v(speed, 0.0, 0.0)).norm() < 1e-10 * speed, "{r} {z}");
            assert!((cut.velocity(at) - v(speed, 0.0, 0.0)).norm() < 1e-10 * speed, "{r} {z}");
        }
        // Long: the infinite line.
        let long = Element::Filament { points: vec![v(0.0, 0.0, -1e6), v(0.0, 0.0, 1e6)], strength: 2.5, core: 0.0 };
        let line = Element::Vortex { at: Vec3::zeros(), axis: v(0.0, 0.0, 1.0), strength: 2.5, core: 0.0 };
        let at = v(0.7, 0.4, 0.2);
        assert!((long.velocity(at) - line.velocity(at)).norm() < 1e-10);
    }

    #[test]
    fn nothing_wells_up_or_turns_away_from_the_elements() {
        let ring: Vec<Vec3> =
            (0..=5).map(|k| 0.4 * PI * f64::from(k % 5)).map(|a| v(libm::cos(a), libm::sin(a), 0.3)).collect();
        let all = [
            Element::Stream { velocity: v(0.0, -1.0, 0.2) },
            Element::Source { at: v(0.1, 0.0, 0.0), strength: -3.0, core: 0.01 },
            Element::Vortex { at: v(2.0, 0.0, 0.0), axis: v(0.3, 1.0, 0.0), strength: 1.0, core: 0.02 },
            Element::Filament { points: ring, strength: 4.0, core: 0.01 },
        ];
        for e in &all {
            for at in [v(0.5, 0.4, -0.6), v(-2.0, 1.0, 0.5), v(0.3, -3.0, 1.0)] {
                let f = |p| e.velocity(p);
                assert!(divergence(&f, at).abs() < 1e-7, "{e:?}");
                assert!(curl(&f, at).norm() < 1e-7, "{e:?}");
            }
        }
        // An open filament turns like the flow from a source at its end to a sink at its beginning.
        let (a, b) = (v(0.0, 0.0, 0.0), v(1.0, 0.5, 0.0));
        let open = Element::Filament { points: vec![a, b], strength: 4.0, core: 0.0 };
        let ends = [(b, 4.0), (a, -4.0)].map(|(at, strength)| Element::Source { at, strength, core: 0.0 });
        let at = v(0.3, 1.0, -0.7);
        assert!(divergence(&|p| open.velocity(p), at).abs() < 1e-7);
        let back = ends[0].velocity(at) + ends[1].velocity(at);
        assert!((curl(&|p| open.velocity(p), at) - back).norm() < 1e-7 && back.norm() > 0.1);
    }
}
