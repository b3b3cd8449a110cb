//! Mode `paper`: a span by the paper's nine steps (Selle, Lentine, Fedkiw 2008, section 4), for fidelity and comparison.
//!
//! The steps themselves are in [`crate::springs::paper`]; here they get held ends, body collisions (step 5) and time. The
//! step is the paper's 6e-4 s unless a number of steps is asked for; there is no subdivision, so fast motion may blow up
//! as it does in print: such strands are held and reported. There is gravity and the body, no air and no internal damping.

use crate::Vec3;
use crate::body::Instant;
use crate::contact;
use crate::group::Group;
use crate::integrate::{Around, Done};
use crate::lanes::{LANES, Pack, Width};
use crate::springs::paper::{self, Drive, Scratch, Settings, State};

/// The paper's typical step, seconds.
pub const STEP: f64 = 6e-4;

/// A strand longer than its rest by this much of it has blown up, and is held. Half of it happens in fast motion and comes
/// back; ten times does not.
const BLOWN_UP: f64 = 1.0;

/// What does not change over a span.
pub struct Span<'a> {
    /// Seconds.
    pub seconds: f64,
    /// Number of steps.
    pub steps: u32,
    /// Registers to use.
    pub width: Width,
    /// Largest strain.
    pub strain_limit: f64,
    /// Friction with the body.
    pub friction: f64,
    /// The body at a fraction of the span, if there is one.
    pub body: &'a (dyn Fn(f64) -> Option<Instant<'a, 'a>> + Sync),
}

/// Moves some lanes of a group of springs through a span.
pub fn advance<A: Around>(g: &mut Group, around: &A, span: &Span<'_>, lanes: [bool; LANES], done: &mut Done) {
    let Some(springs) = g.springs.take() else { return };
    let mut state = State {
        x: g.motion.iter().map(|m| m.x).collect(),
        v: g.motion.iter().map(|m| m.v).collect(),
        altitude: springs.altitude.clone(),
    };
    let step = span.seconds / f64::from(span.steps);
    let settings = Settings { step, strain_limit: span.strain_limit, damping: 0.0, backward_euler: false };
    let mut scratch = Scratch::default();
    for k in 0..span.steps {
        let fraction = f64::from(k + 1) / f64::from(span.steps);
        around.hold(g, lanes, fraction);
        let target: Vec<[Pack; 3]> = g.motion.iter().map(|m| m.x).collect();
        let drive = Drive { gravity: around.gravity(fraction), target: &target };
        let body = (span.body)(fraction);
        let group = &*g;
        let mut collide = |x: &mut [[Pack; 3]], v: &mut [[Pack; 3]]| {
            body.as_ref().is_some_and(|b| collide(group, b, lanes, span.friction, x, v))
        };
        paper::step(span.width, &springs.model, &mut state, &mut scratch, &settings, &drive, &mut collide);
    }
    for (m, (x, v)) in g.motion.iter_mut().zip(state.x.iter().zip(&state.v)) {
        for l in (0..LANES).filter(|&l| lanes[l]) {
            for c in 0..3 {
                m.x[c].0[l] = x[c].0[l];
                m.v[c].0[l] = v[c].0[l];
            }
        }
    }
    g.springs = Some(crate::group::Springs { altitude: state.altitude, ..springs });
    for l in (0..LANES).filter(|&l| lanes[l]) {
        let n = g.count[l];
        let good = |m: &crate::stage::Motion| m.x.iter().chain(&m.v).all(|p| p.0[l].is_finite());
        done.failed[l] = !g.motion[..n].iter().all(good);
        done.node_steps += n as u64 * u64::from(span.steps);
        done.node_solves += 2 * n as u64 * u64::from(span.steps);
        if !done.failed[l] {
            done.speed[l] = (0..n).map(|i| g.v(i, l).norm()).fold(0.0, f64::max);
            let edge = |w: &[u32]| (g.x(w[1] as usize, l) - g.x(w[0] as usize, l)).norm();
            let long: f64 = g.at[l].windows(2).map(edge).sum();
            let all: f64 = g.at[l].iter().map(|&i| g.node[i as usize].share.0[l]).sum();
            done.strain[l] = (long / all - 1.0).abs();
            // Blown up, if still in numbers.
            done.failed[l] = done.strain[l] > BLOWN_UP;
            if done.failed[l] {
                // It is put back to where it was: what is left has no such strain.
                done.strain[l] = 0.0;
            }
        }
    }
}

/// Step 5 (after Bridson et al. 2003): points inside come to the surface, inward velocity relative to it ends, and friction
/// takes from sliding what the normal impulse allows.
fn collide(
    g: &Group,
    body: &Instant<'_, '_>,
    lanes: [bool; LANES],
    friction: f64,
    x: &mut [[Pack; 3]],
    v: &mut [[Pack; 3]],
) -> bool {
    let mut any = false;
    for l in (0..LANES).filter(|&l| lanes[l]) {
        for &i in &g.at[l] {
            let i = i as usize;
            let keep = g.keep.most[i].0[l];
            let p = Vec3::new(x[i][0].0[l], x[i][1].0[l], x[i][2].0[l]);
            if !contact::is_free(g, i, l) || body.distance_bound(p) >= keep {
                continue;
            }
            let hit = body.sample(p);
            if hit.distance < keep {
                any = true;
                let out = p + hit.normal * (keep - hit.distance);
                let relative = Vec3::new(v[i][0].0[l], v[i][1].0[l], v[i][2].0[l]) - hit.velocity;
                let inward = (-hit.normal.dot(&relative)).max(0.0);
                let slide = relative + hit.normal * -hit.normal.dot(&relative);
                let kept = (1.0 - friction * inward / slide.norm().max(1e-12)).max(0.0);
                let away = hit.normal * hit.normal.dot(&relative).max(0.0);
                let new = hit.velocity + away + slide * kept;
                for c in 0..3 {
                    x[i][c].0[l] = out[c];
                    v[i][c].0[l] = new[c];
                }
            }
        }
    }
    any
}
