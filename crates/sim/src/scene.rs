//! A span of time as the integrator sees it: where ends are held, what touches, and the air.

use crate::contact;
use crate::drag;
use crate::group::Group;
use crate::integrate::{Around, Interval, StageTime};
use crate::lanes::{LANES, Pack};
use crate::settings::{End, Settings};
use crate::simulation::{Root, SHORTEST, Span};
use crate::stage::{self, Air, Contact};
use crate::wind::Surface;
use crate::{Motion, Part, Rigid, Shape, SimError, Vec3, Wind};

/// Points between samples of the wind along a hair. One is exact and costs most of the step; the wind is smooth over many.
const WIND_STRIDE: usize = 4;

/// Shortest span, seconds. Positions are rounded by 1e-17 m and more: over less than this, that is a speed of its own.
const SHORTEST_SPAN: f64 = 1e-9;

/// A span as the integrator sees it.
pub(crate) struct Scene<'a> {
    /// What is prescribed.
    pub(crate) span: &'a Span<'a>,
    /// The layer's.
    pub(crate) settings: &'a Settings,
    /// Where every root was at the end of the last span, in the world.
    pub(crate) last: &'a [Rigid],
    /// What moves around hair in this span.
    pub(crate) calm: Calm,
}

/// What moves around hair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Calm {
    /// Nothing: neither skin, nor body, gravity, or wind.
    All,
    /// Skin or body, but not around the hairs that the span calls still.
    Still,
    /// Something, around all hair.
    None,
}

impl Calm {
    /// What moves in a span.
    pub(crate) fn of(span: &Span<'_>) -> Calm {
        let rests = |m: Motion<'_>| m(0.0) == m(0.5) && m(0.0) == m(1.0);
        let part = |p: &Part<'_>| rests(p.motion) && !matches!(p.shape, Shape::Deforming(_));
        let [a, b] = span.gravity;
        match span.wind.is_none() && a == b {
            false => Calm::None,
            true if !span.still.is_empty() => Calm::Still,
            true if rests(span.motion) && span.body.parts.iter().all(part) => Calm::All,
            true => Calm::None,
        }
    }
}

/// Refuses numbers that are none.
pub(crate) fn finite(name: &'static str, values: &[f64]) -> Result<(), SimError> {
    let bad = values.iter().find(|x| !x.is_finite());
    bad.map_or(Ok(()), |&value| Err(SimError::Setting { name, value, expected: "must be a finite number" }))
}

/// Refuses a span whose length, gravity, wind or motions are not numbers. Roots that are none hold their own hair only, see
/// [`Scene::root`].
pub(crate) fn check(span: &Span<'_>) -> Result<(), SimError> {
    if !(span.seconds.is_finite() && span.seconds >= SHORTEST_SPAN) {
        let expected = "a span must last 1e-9 s or longer";
        return Err(SimError::Setting { name: "seconds", value: span.seconds, expected });
    }
    finite("time", &[span.time])?;
    finite("gravity", &span.gravity.concat())?;
    let placed = |name, motion: Motion<'_>| {
        [0.0, 0.5, 1.0].map(motion).iter().try_for_each(|r| finite(name, &[&r.rotation[..], &r.translation].concat()))
    };
    placed("motion", span.motion)?;
    span.body.parts.iter().try_for_each(|p| placed("body.motion", p.motion))?;
    for w in span.wind.into_iter().flatten() {
        finite("wind.velocity", &w.velocity)?;
        finite("wind.drift", &w.drift.unwrap_or_default())?;
        finite("wind.gust", &[w.gust])?;
        finite("wind.turbulence", &[w.turbulence])?;
        finite("wind.boundary", &[w.boundary])?;
        // Gusts and eddies that never change have endless periods and sizes.
        let finite_or_endless = |x: f64| if x == f64::INFINITY { 0.0 } else { x };
        finite("wind.gust_period", &[finite_or_endless(w.gust_period)])?;
        finite("wind.turbulence_size", &[finite_or_endless(w.turbulence_size)])?;
        finite("wind.turbulence_period", &[finite_or_endless(w.turbulence_period)])?;
    }
    Ok(())
}

/// Whether a root says where it is: finite, with a rotation that is one.
fn is_finite(r: &Root) -> bool {
    let norm: f64 = r.rotation.iter().map(|x| x * x).sum();
    r.position.iter().all(|x| x.is_finite()) && norm.is_normal()
}

impl Scene<'_> {
    /// Whether nothing around a hair moves.
    pub(crate) fn is_calm(&self, s: usize) -> bool {
        self.calm == Calm::All || (self.calm == Calm::Still && self.span.still[s])
    }

    /// A root or tip in the world at a fraction of the span, where the skin's coordinates are at `world`.
    fn placement(&self, world: &Rigid, ends: [&[Root]; 2], s: usize, fraction: f64) -> Rigid {
        let [a, b] = [&ends[0][s], &ends[1][s]];
        let f = fraction;
        let local = Rigid {
            rotation: Rigid::turn_between(a.rotation, b.rotation, f),
            translation: std::array::from_fn(|i| (1.0 - f) * a.position[i] + f * b.position[i]),
        };
        let turn = world.quaternion() * local.quaternion();
        let [x, y, z, w] = [turn.i, turn.j, turn.k, turn.w];
        Rigid { rotation: [x, y, z, w], translation: world.apply(Vec3::from(local.translation)).into() }
    }

    /// A root in the world; where it was last if it is not a number.
    pub(crate) fn root(&self, world: &Rigid, s: usize, fraction: f64) -> Rigid {
        let [a, b] = self.span.roots.map(|r| is_finite(&r[s]));
        if a && b { self.placement(world, self.span.roots, s, fraction) } else { self.last[s] }
    }

    /// Every root at the end of the span; `None` where it is not a number.
    pub(crate) fn all_roots(&self) -> Vec<Option<Rigid>> {
        let world = (self.span.motion)(1.0);
        let one = |s: usize| {
            let good = is_finite(&self.span.roots[1][s]);
            good.then(|| self.placement(&world, [self.span.roots[1]; 2], s, 1.0))
        };
        (0..self.last.len()).map(one).collect()
    }
}

/// Places an end and its ghost.
fn hold_end(g: &mut Group, lane: usize, tip: bool, end: End, at: &Rigid) {
    if end == End::Free {
        return;
    }
    let Group { clamp, motion, .. } = g;
    let clamp = &clamp[lane][usize::from(tip)];
    let set = |to: &mut [Pack; 3], v: Vec3| {
        for c in 0..3 {
            to[c].0[lane] = v[c];
        }
    };
    for (node, from) in &clamp.node {
        set(&mut motion[*node as usize].x, at.apply(Vec3::from(*from)));
    }
    if let Some((edge, frame)) = clamp.frame {
        set(&mut motion[edge as usize].m, at.quaternion() * Vec3::from(frame));
    }
}

impl Around for Scene<'_> {
    fn hold(&self, g: &mut Group, lanes: [bool; LANES], fraction: f64) {
        let world = (self.span.motion)(fraction);
        for l in 0..LANES {
            let (true, Some(s)) = (lanes[l], g.strand[l]) else { continue };
            hold_end(g, l, false, self.settings.root, &self.root(&world, s, fraction));
            if let Some(tips) = self.span.tips {
                hold_end(g, l, true, self.settings.tip, &self.placement(&world, tips, s, fraction));
            }
        }
    }

    fn gravity(&self, fraction: f64) -> [f64; 3] {
        let [a, b] = self.span.gravity;
        std::array::from_fn(|c| (1.0 - fraction) * a[c] + fraction * b[c])
    }

    fn solid(&self) -> bool {
        !self.span.body.parts.is_empty()
    }

    fn touch(
        &self,
        g: &Group,
        start: &[stage::Motion],
        lanes: [bool; LANES],
        time: StageTime,
        contact: &mut [Contact],
    ) -> [bool; LANES] {
        contact::find(g, start, &self.span.body.at(time.fraction), lanes, time.h, time.elapsed, contact)
    }

    fn air(&self, g: &Group, lanes: [bool; LANES], at: Interval, air: &mut [Air]) -> bool {
        if g.material.iter().all(|m| m.drag_factor == 0.0) {
            return false;
        }
        let (fraction, ahead) = (at.start + 0.5 * at.length, 0.5 * at.length * at.span);
        let time = self.span.time + fraction * self.span.seconds;
        let still = drag::Air::default();
        let wind = self.span.wind.map(|[a, b]| Wind::lerp(a, b, fraction));
        let body = self.solid().then(|| self.span.body.at(fraction));
        let mut point: Vec<Vec3> = Vec::new();
        let mut blowing = vec![Vec3::zeros(); g.node.len()];
        for l in (0..LANES).filter(|&l| lanes[l] && g.strand[l].is_some()) {
            let (at, material) = (&g.at[l], &g.material[l]);
            let factor = material.drag_factor;
            let n = at.len();
            point.clear();
            point.extend(at.iter().map(|&i| g.x(i as usize, l) + g.v(i as usize, l) * ahead));
            if let Some(wind) = &wind {
                wind.free_along(&point, WIND_STRIDE, time, &mut blowing[..n]);
                if let Some(body) = body.as_ref().filter(|_| wind.boundary > 0.0) {
                    for (k, p) in point.iter().enumerate() {
                        if body.distance_bound(*p) < wind.boundary {
                            let hit = body.sample(*p);
                            let surface =
                                Surface { distance: hit.distance, normal: hit.normal, velocity: hit.velocity };
                            blowing[k] = crate::wind::beside(blowing[k], &surface, wind.boundary);
                        }
                    }
                }
            }
            let length: f64 = at.iter().map(|&i| g.node[i as usize].share.0[l]).sum();
            for (k, &i) in at.iter().enumerate() {
                let i = i as usize;
                let share = g.node[i].share.0[l];
                let e = point[(k + 1).min(n - 1)] - point[k.saturating_sub(1)];
                let t = e.try_normalize(SHORTEST).unwrap_or(Vec3::zeros());
                let u = g.v(i, l) + g.a(i, l) * ahead - blowing[k];
                let along = t.dot(&u);
                let across = (u - t * along).norm();
                let d = drag::drag(&still, material.diameter, length, across, along.abs());
                for c in 0..3 {
                    air[i].velocity[c].0[l] = blowing[k][c];
                    air[i].tangent[c].0[l] = t[c];
                }
                air[i].across.0[l] = d.across * share * factor;
                air[i].along.0[l] = d.along * share * factor;
            }
        }
        true
    }
}
