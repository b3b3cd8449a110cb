//! Eight strands packed lane by lane, with their model and state.

use crate::band::HELD;
use crate::contact::Keep;
use crate::lanes::{LANES, Pack};
use crate::rod::Elastic;
use crate::settings::{End, Material, Settings};
use crate::springs::kernel::{self, NodeAltitude};
use crate::springs::layout::Layout;
use crate::springs::plain;
use crate::stage::{Motion, Node};
use crate::{Rigid, Vec3};
use pelage_geom::NONE;

/// A strand before it is packed: points from root to tip, at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Strand {
    /// Its index in the layer.
    pub index: usize,
    /// At least two different points, metres.
    pub point: Vec<Vec3>,
    /// What it is made of.
    pub material: Material,
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
    /// Whether twist can act on any of the strands.
    pub twist: bool,
    /// Depth of subdivision that each strand starts a step with.
    pub level: [u8; LANES],
    /// Spans for which each strand has been at rest.
    pub quiet: [u32; LANES],
    /// Node of each of a strand's points.
    pub at: [Vec<u32>; LANES],
    /// What each lane's strand is made of.
    pub material: [Material; LANES],
    /// Springs instead of rods.
    pub springs: Option<Springs>,
    /// How close to the body its points come; empty before the first span.
    pub keep: Keep,
    /// What the root and the tip hold, per lane.
    pub clamp: [[Clamp; 2]; LANES],
}

/// The springs of a group.
#[derive(Clone, Debug)]
pub struct Springs {
    /// Constants.
    pub model: kernel::Group,
    /// Altitudes in use: state.
    pub altitude: Vec<NodeAltitude>,
}

/// A group's changing state.
#[derive(Clone, Debug, Default)]
pub struct Snapshot {
    /// Where nodes are.
    pub motion: Vec<Motion>,
    /// Altitudes of springs.
    altitude: Vec<NodeAltitude>,
}

/// What a held end carries, relative to its point at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clamp {
    /// Held nodes and where they are.
    pub node: Vec<(u32, [f64; 3])>,
    /// Edge whose frame is held, and its first material direction.
    pub frame: Option<(u32, [f64; 3])>,
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
    /// Of a material.
    pub fn new(m: &Material) -> Self {
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
        let mut g = Group::inert(n, strands);
        for (lane, s) in strands.iter().enumerate() {
            g.put(lane, s, before, settings);
        }
        g
    }

    /// Packs up to eight strands of springs.
    pub fn pack_springs(strands: &[Strand], layouts: &[Layout], models: &[plain::Model]) -> Self {
        let n = layouts.iter().map(|l| l.position.len()).max().unwrap_or(2);
        let mut g = Group::inert(n, strands);
        for (lane, (s, layout)) in strands.iter().zip(layouts).enumerate() {
            g.put_springs(lane, s, layout, &models[lane]);
        }
        let all: Vec<&plain::Model> = models.iter().collect();
        let choices: Vec<Vec<plain::Choice>> = models.iter().map(plain::Model::choices).collect();
        let pairs: Vec<_> = models.iter().zip(&choices).map(|(m, c)| (m, &c[..])).collect();
        let mut altitude = kernel::pack_altitudes(&pairs);
        altitude.resize(n, NodeAltitude::default());
        g.springs = Some(Springs { model: kernel::pack(&all), altitude });
        g
    }

    /// A group of `n` nodes in which nothing moves.
    fn inert(n: usize, strands: &[Strand]) -> Self {
        let mut g = Group {
            strand: [None; LANES],
            count: [0; LANES],
            node: vec![Node::default(); n],
            elastic: vec![Elastic::default(); n],
            motion: vec![Motion::default(); n],
            twist: true,
            level: [0; LANES],
            quiet: [0; LANES],
            at: Default::default(),
            material: std::array::from_fn(|l| {
                strands.get(l).or(strands.first()).map_or_else(Material::default, |s| s.material)
            }),
            springs: None,
            keep: Keep::default(),
            clamp: Default::default(),
        };
        for lane in 0..LANES {
            g.pad(lane, strands.get(lane).map_or(Vec3::zeros(), |s| s.point[s.point.len() - 1]));
        }
        g
    }

    fn put_springs(&mut self, lane: usize, s: &Strand, layout: &Layout, model: &plain::Model) {
        let (n, k) = (layout.position.len(), s.point.len());
        (self.strand[lane], self.count[lane]) = (Some(s.index), n);
        self.at[lane] = vec![0; k];
        let half = |a: usize, b: usize| 0.5 * (s.point[b] - s.point[a]).norm();
        for i in 0..n {
            let (node, motion) = (&mut self.node[i], &mut self.motion[i]);
            node.mass.0[lane] = model.mass[i];
            node.held.0[lane] = if layout.held[i] { HELD } else { 0.0 };
            if layout.point[i] != NONE {
                let p = layout.point[i] as usize;
                self.at[lane][p] = i as u32;
                let share = if p > 0 { half(p - 1, p) } else { 0.0 } + if p + 1 < k { half(p, p + 1) } else { 0.0 };
                node.share.0[lane] = share;
            }
            if i + 1 < n {
                let spring = &model.spring[i + 1][0];
                node.length.0[lane] = (layout.position[i + 1] - layout.position[i]).norm();
                // Not a stiffness: it marks edges whose strain counts.
                self.elastic[i].stretch.0[lane] = f64::from(u8::from(spring.stiffness > 0.0));
            }
            for c in 0..3 {
                motion.x[c].0[lane] = layout.position[i][c];
            }
            if layout.held[i] {
                let tip = 2 * i > n;
                let from = s.point[if tip { k - 1 } else { 0 }];
                self.clamp[lane][usize::from(tip)].node.push((i as u32, (layout.position[i] - from).into()));
            }
        }
    }

    /// Inert nodes in a whole lane, one metre apart.
    fn pad(&mut self, lane: usize, from: Vec3) {
        for i in 0..self.node.len() {
            let node = &mut self.node[i];
            node.mass.0[lane] = 1.0;
            node.held.0[lane] = HELD;
            node.held_turn.0[lane] = HELD;
            // So long that movement over it is nothing.
            node.length.0[lane] = 1e30;
            self.motion[i].x[0].0[lane] = from.x + i as f64;
            self.motion[i].x[1].0[lane] = from.y;
            self.motion[i].x[2].0[lane] = from.z;
            self.motion[i].m[1].0[lane] = 1.0;
        }
    }

    fn put(&mut self, lane: usize, s: &Strand, before: usize, settings: &Settings) {
        let section = Section::new(&s.material);
        let k = s.point.len();
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
        self.at[lane] = own.clone().map(|i| i as u32).collect();
        for (tip, end) in [settings.root, settings.tip].into_iter().enumerate() {
            let (point, ghost, edge) = if tip == 0 { (before, 0, 0) } else { (before + k - 1, n - 1, n.max(2) - 2) };
            let (from, beyond) = (self.x(point, lane), self.x(ghost, lane));
            let clamp = &mut self.clamp[lane][tip];
            if end != End::Free {
                clamp.node.push((point as u32, [0.0; 3]));
            }
            if end == End::Clamped {
                clamp.node.push((ghost as u32, (beyond - from).into()));
                clamp.frame = Some((edge as u32, std::array::from_fn(|c| self.motion[edge].m[c].0[lane])));
            }
        }
    }

    /// A node's position.
    pub fn x(&self, i: usize, lane: usize) -> Vec3 {
        lane3(&self.motion[i].x, lane)
    }

    /// A node's velocity.
    pub fn v(&self, i: usize, lane: usize) -> Vec3 {
        lane3(&self.motion[i].v, lane)
    }

    /// A node's last acceleration, 0 if it is not known.
    pub fn a(&self, i: usize, lane: usize) -> Vec3 {
        lane3(&self.motion[i].a, lane)
    }

    /// Moves a whole strand rigidly, its velocities and frames along.
    pub fn carry(&mut self, lane: usize, from: &Rigid, to: &Rigid) {
        let turn = to.quaternion() * from.quaternion().inverse();
        for i in 0..self.count[lane] {
            let x = to.apply(from.invert(self.x(i, lane)));
            let m = &mut self.motion[i];
            for field in [&mut m.v, &mut m.a, &mut m.m, &mut m.grip] {
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

    /// The last acceleration of a strand that was moved by hand says nothing.
    pub fn forget_acceleration(&mut self, lane: usize) {
        for m in &mut self.motion[..self.count[lane]] {
            for p in &mut m.a {
                p.0[lane] = 0.0;
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

    /// A copy of the state.
    pub fn snapshot(&self) -> Snapshot {
        let mut saved = Snapshot::default();
        self.save(&mut saved);
        saved
    }

    /// A copy of the state into existing memory.
    pub fn save(&self, to: &mut Snapshot) {
        to.motion.clone_from(&self.motion);
        if let Some(springs) = &self.springs {
            to.altitude.clone_from(&springs.altitude);
        }
    }

    /// Copies a lane's state from a snapshot of this group.
    pub fn revert(&mut self, lane: usize, saved: &Snapshot) {
        if let Some(springs) = &mut self.springs {
            for (to, from) in springs.altitude.iter_mut().zip(&saved.altitude) {
                for c in 0..3 {
                    to.face[c].0[lane] = from.face[c].0[lane];
                }
                to.inverse_height.0[lane] = from.inverse_height.0[lane];
                to.offset.0[lane] = from.offset.0[lane];
            }
        }
        for (to, from) in self.motion.iter_mut().zip(&saved.motion) {
            for c in 0..3 {
                to.x[c].0[lane] = from.x[c].0[lane];
                to.v[c].0[lane] = from.v[c].0[lane];
                to.a[c].0[lane] = from.a[c].0[lane];
                to.m[c].0[lane] = from.m[c].0[lane];
                to.grip[c].0[lane] = from.grip[c].0[lane];
            }
        }
    }
}

/// A lane of three packs.
pub fn lane3(p: &[Pack; 3], lane: usize) -> Vec3 {
    Vec3::new(p[0].0[lane], p[1].0[lane], p[2].0[lane])
}

/// A mask of lanes as numbers: 1 or 0.
pub fn mask(lanes: [bool; LANES]) -> Pack {
    Pack(lanes.map(|b| f64::from(u8::from(b))))
}
