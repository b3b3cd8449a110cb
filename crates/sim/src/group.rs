//! Eight strands packed lane by lane, with their model and state.

use crate::band::HELD;
use crate::contact::Keep;
use crate::lanes::{LANES, Pack};
use crate::rod::Elastic;
use crate::simulation::{End, Settings};
use crate::stage::{Motion, Node};
use crate::{Rigid, Vec3};

/// A strand before it is packed: points from root to tip, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Strand {
    /// Its index in the layer.
    pub index: usize,
    /// At least two different points, metres.
    pub point: Vec<Vec3>,
}

/// Eight strands. Lanes that have no strand, and nodes beyond a strand's tip, are held and weightless.
#[derive(Clone, Debug)]
pub struct Group {
    /// Index of each lane's strand in the layer.
    pub strand: [Option<usize>; LANES],
    /// Nodes of each lane's strand, held ends included.
    pub count: [usize; LANES],
    /// Inertia and lengths.
    pub node: Vec<Node>,
    /// Elasticity.
    pub elastic: Vec<Elastic>,
    /// Where nodes are.
    pub motion: Vec<Motion>,
    /// Depth of subdivision that each strand starts a step with.
    pub level: [u8; LANES],
    /// Spans for which each strand has been at rest.
    pub quiet: [u32; LANES],
    /// Nodes before a strand's first point: 1 if its root is clamped.
    pub before: usize,
    /// How close to the body its points come; empty before the first span.
    pub keep: Keep,
    /// First point, root direction's neighbour and frame at rest, per lane: what a clamp carries.
    pub clamp: [[Clamp; 2]; LANES],
}

/// A held end at rest: the point, the ghost node beyond it, and the frame of the edge between.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clamp {
    /// The end point.
    pub point: [f64; 3],
    /// The ghost node relative to the end point.
    pub ghost: [f64; 3],
    /// First material direction of the edge between them.
    pub frame: [f64; 3],
}

/// A unit vector at right angles to the unit vector `t`, always the same.
pub fn perpendicular(t: Vec3) -> Vec3 {
    let a = t.abs();
    let axis = if a.x <= a.y && a.x <= a.z {
        Vec3::x()
    } else if a.y <= a.z {
        Vec3::y()
    } else {
        Vec3::z()
    };
    (axis - t * t.dot(&axis)).normalize()
}

/// Parallel transport of `m` from direction `a` to `b`.
fn transport(m: Vec3, a: Vec3, b: Vec3) -> Vec3 {
    let folded = 1.0 + a.dot(&b);
    let moved = if folded > 1e-6 { m - (a + b) * (m.dot(&b) / folded) } else { m };
    (moved - b * b.dot(&moved)).try_normalize(1e-12).unwrap_or_else(|| perpendicular(b))
}

/// Section stiffnesses of a round hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// EA, newtons.
    pub stretch: f64,
    /// EI, newton square metres.
    pub bend: f64,
    /// GJ, newton square metres.
    pub twist: f64,
    /// Mass per length, kilograms per metre.
    pub mass: f64,
    /// Rotational inertia about the axis per length, kilogram metres.
    pub spin: f64,
}

impl Section {
    /// Of a layer's material.
    pub fn new(settings: &Settings) -> Self {
        let m = &settings.material;
        let area = std::f64::consts::FRAC_PI_4 * m.diameter * m.diameter;
        let second = area * m.diameter * m.diameter / 16.0;
        Section {
            stretch: m.young * area * m.stretch_factor,
            bend: m.young * second * m.bend_factor,
            twist: m.young * second / (1.0 + m.poisson) * m.twist_factor,
            mass: m.density * area,
            spin: m.density * 2.0 * second,
        }
    }
}

impl Group {
    /// Packs up to eight strands.
    pub fn pack(strands: &[Strand], settings: &Settings) -> Self {
        let before = usize::from(settings.root == End::Clamped);
        let after = usize::from(settings.tip == End::Clamped);
        let n = strands.iter().map(|s| s.point.len()).max().unwrap_or(2) + before + after;
        let mut g = Group {
            strand: [None; LANES],
            count: [0; LANES],
            node: vec![Node::default(); n],
            elastic: vec![Elastic::default(); n],
            motion: vec![Motion::default(); n],
            level: [0; LANES],
            quiet: [0; LANES],
            before,
            keep: Keep::default(),
            clamp: [[Clamp::default(); 2]; LANES],
        };
        for lane in 0..LANES {
            g.pad(lane, strands.get(lane).map_or(Vec3::zeros(), |s| s.point[s.point.len() - 1]));
        }
        for (lane, s) in strands.iter().enumerate() {
            g.put(lane, s, settings);
        }
        g
    }

    /// Inert nodes in a whole lane, one metre apart.
    fn pad(&mut self, lane: usize, from: Vec3) {
        for i in 0..self.node.len() {
            let node = &mut self.node[i];
            node.mass.0[lane] = 1.0;
            node.held.0[lane] = HELD;
            node.held_turn.0[lane] = HELD;
            node.length.0[lane] = 1.0;
            self.motion[i].x[0].0[lane] = from.x + i as f64;
            self.motion[i].x[1].0[lane] = from.y;
            self.motion[i].x[2].0[lane] = from.z;
            self.motion[i].m[1].0[lane] = 1.0;
        }
    }

    fn put(&mut self, lane: usize, s: &Strand, settings: &Settings) {
        let section = Section::new(settings);
        let (before, k) = (self.before, s.point.len());
        let ends = [s.point[0] - (s.point[1] - s.point[0]), s.point[k - 1] + (s.point[k - 1] - s.point[k - 2])];
        let mut point = s.point.clone();
        if before == 1 {
            point.insert(0, ends[0]);
        }
        if settings.tip == End::Clamped {
            point.push(ends[1]);
        }
        let n = point.len();
        (self.strand[lane], self.count[lane]) = (Some(s.index), n);
        let own = before..before + k;
        let mut frame = perpendicular((point[1] - point[0]).normalize());
        let mut direction = (point[1] - point[0]).normalize();
        for i in 0..n {
            let (node, elastic, motion) = (&mut self.node[i], &mut self.elastic[i], &mut self.motion[i]);
            // Halves of the strand's own edges, not of ghosts.
            let half = |a: usize, b: usize| {
                if own.contains(&a) && own.contains(&b) { 0.5 * (point[b] - point[a]).norm() } else { 0.0 }
            };
            let share = if i > 0 { half(i - 1, i) } else { 0.0 } + if i + 1 < n { half(i, i + 1) } else { 0.0 };
            let ghost = !own.contains(&i);
            let is_root = i == before && settings.root != End::Free;
            let is_tip = i == before + k - 1 && settings.tip != End::Free;
            node.share.0[lane] = share;
            node.mass.0[lane] = if ghost { 1.0 } else { section.mass * share };
            node.held.0[lane] = if ghost || is_root || is_tip { HELD } else { 0.0 };
            for c in 0..3 {
                motion.x[c].0[lane] = point[i][c];
            }
            if i + 1 < n {
                let e = point[i + 1] - point[i];
                let length = e.norm();
                let inner = own.contains(&i) && own.contains(&(i + 1));
                node.length.0[lane] = length;
                node.held_turn.0[lane] = if inner { 0.0 } else { HELD };
                elastic.stretch.0[lane] = if inner { section.stretch / length } else { 0.0 };
                elastic.spin.0[lane] = section.spin * length;
                frame = transport(frame, direction, e / length);
                direction = e / length;
                for c in 0..3 {
                    motion.m[c].0[lane] = frame[c];
                }
            }
            if i > 0 && i + 1 < n {
                // Half the length of both edges; a ghost's half does not count, which doubles the hinge of a clamp.
                let reach = half(i - 1, i) + half(i, i + 1);
                elastic.bend.0[lane] = section.bend / reach;
                elastic.twist.0[lane] = section.twist / reach;
            }
        }
        let end = |at: usize, ghost: Vec3, edge: usize| Clamp {
            point: s.point[at].into(),
            ghost: (ghost - s.point[at]).into(),
            frame: std::array::from_fn(|c| self.motion[edge].m[c].0[lane]),
        };
        self.clamp[lane] = [end(0, ends[0], 0), end(k - 1, ends[1], n.saturating_sub(2))];
    }

    /// Positions of a lane's own points.
    pub fn points(&self, lane: usize) -> impl Iterator<Item = Vec3> + '_ {
        let after = self.count[lane] - self.before - self.own(lane);
        let last = self.count[lane] - after;
        (self.before..last).map(move |i| self.x(i, lane))
    }

    /// Number of a lane's own points.
    pub fn own(&self, lane: usize) -> usize {
        let ghosts = (0..self.count[lane]).filter(|&i| self.node[i].share.0[lane] == 0.0).count();
        self.count[lane] - ghosts
    }

    /// A node's position.
    pub fn x(&self, i: usize, lane: usize) -> Vec3 {
        Vec3::new(self.motion[i].x[0].0[lane], self.motion[i].x[1].0[lane], self.motion[i].x[2].0[lane])
    }

    /// A node's velocity.
    pub fn v(&self, i: usize, lane: usize) -> Vec3 {
        Vec3::new(self.motion[i].v[0].0[lane], self.motion[i].v[1].0[lane], self.motion[i].v[2].0[lane])
    }

    /// Moves a whole strand rigidly, its velocities and frames along.
    pub fn carry(&mut self, lane: usize, from: &Rigid, to: &Rigid) {
        let turn = to.quaternion() * from.quaternion().inverse();
        for i in 0..self.count[lane] {
            let x = to.apply(from.invert(self.x(i, lane)));
            let m = &mut self.motion[i];
            for field in [&mut m.v, &mut m.a, &mut m.m] {
                let new = turn * Vec3::new(field[0].0[lane], field[1].0[lane], field[2].0[lane]);
                for c in 0..3 {
                    field[c].0[lane] = new[c];
                }
            }
            for c in 0..3 {
                m.x[c].0[lane] = x[c];
            }
        }
    }

    /// Stops a strand.
    pub fn stop(&mut self, lane: usize) {
        for m in &mut self.motion[..self.count[lane]] {
            for p in m.v.iter_mut().chain(&mut m.a) {
                p.0[lane] = 0.0;
            }
        }
    }

    /// Copies a lane's state from another snapshot of the same group.
    pub fn revert(&mut self, lane: usize, saved: &[Motion]) {
        for (to, from) in self.motion.iter_mut().zip(saved) {
            for c in 0..3 {
                to.x[c].0[lane] = from.x[c].0[lane];
                to.v[c].0[lane] = from.v[c].0[lane];
                to.a[c].0[lane] = from.a[c].0[lane];
                to.m[c].0[lane] = from.m[c].0[lane];
            }
        }
    }
}

/// A mask of lanes as numbers: 1 or 0.
pub fn mask(lanes: [bool; LANES]) -> Pack {
    Pack(lanes.map(|b| f64::from(u8::from(b))))
}
