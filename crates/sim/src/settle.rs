//! The start: natural shapes, equilibrium under gravity, and whether that equilibrium can stand.
//!
//! A groom is a pose under gravity. [`crate::rod::stand`] finds the natural shape that hangs into exactly that pose. An
//! equilibrium need not be stable, though: soft long hair that sticks out stands like a pencil on its tip. So the true
//! tangent is taken (by differences of the exact gradient, several nodes at a time that do not see each other), factored,
//! and the signs of its pivots tell (Sylvester's law of inertia). A strand that can't stand is stiffened until it can.

use crate::Vec3;
use crate::band::{self, Column, Panel, RING, Window};
use crate::group::{Group, Section, Strand};
use crate::lanes::{self, Kernel, LANES, Lanes, Pack, Width};
use crate::rod::{self, Damping, Scratch};
use crate::settings::{End, Material, Model, Settings};
use crate::springs::calibrate::{self, Calibration};
use crate::springs::layout::{self, Layout};
use crate::springs::plain::Model as Springs;
use crate::springs::sag;
use crate::stage::Stage;

/// Stiffness doubles at most this often: 64 times.
const DOUBLINGS: u32 = 6;

/// Halvings of the last doubling (in the logarithm) that find the factor that is needed: to a tenth, 2^(1/8). Each costs
/// as much as a doubling; with fewer, hair is up to a half stiffer than it must be.
const HALVINGS: u32 = 3;

/// Step of the differences, in lengths of an edge and radians. Rounding shows below 1e-7, curvature above 1e-4.
const DIFFERENCE: f64 = 1e-5;

/// Nodes that see each other are at most two apart.
const COLOURS: usize = 5;

/// What was found of a group.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// Largest angle between neighbouring segments, radians.
    pub hinge: f64,
    /// Largest w L^3 / B.
    pub gamma: f64,
    /// Strands (by index in the layer) that were stiffened, and the factor; 0 if the largest was not enough.
    pub stiffened: Vec<(usize, f64)>,
}

/// Packs a group, finds its natural shape, and lets it stand.
pub fn prepare(strands: &[Strand], settings: &Settings, gravity: [f64; 3]) -> (Group, Figures) {
    let g = Vec3::from(gravity).norm();
    let mut figures = Figures::default();
    for s in strands {
        let section = Section::new(&s.material);
        let length: f64 = s.point.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        figures.gamma = figures.gamma.max(section.mass * g * length.powi(3) / section.bend);
        for w in s.point.windows(3) {
            figures.hinge = figures.hinge.max(angle(w[1] - w[0], w[2] - w[1]));
        }
    }
    let sag_free = is_sag_free(settings);
    if settings.model != Model::Rod {
        return (prepare_springs(strands, settings, gravity, sag_free, &mut figures), figures);
    }
    let mut group = Group::pack(strands, settings);
    group.twist = strands.iter().any(|s| twists(s, settings));
    let width = settings.width();
    let (weight, free) = weights(&group, gravity);
    let settle = |group: &mut Group| {
        lanes::run(width, Settle { group, weight: &weight, free: &free, sag_free });
    };
    settle(&mut group);
    if sag_free && g > 0.0 {
        let (factor, wrong) = stiffen(&mut group, width, settle);
        for l in 0..LANES {
            if let Some(s) = group.strand[l].filter(|_| factor[l] > 1.0) {
                figures.stiffened.push((s, if wrong[l] { 0.0 } else { factor[l] }));
            }
        }
    }
    (group, figures)
}

/// Stiffens strands until they can stand; factors, and which still can't. `settle` finds natural shapes.
fn stiffen(group: &mut Group, width: Width, settle: impl Fn(&mut Group)) -> ([f64; LANES], [bool; LANES]) {
    let mut factor = [1.0; LANES];
    let mut wrong = unstable(group, width);
    for l in (0..LANES).filter(|&l| group.strand[l].is_none()) {
        wrong[l] = false;
    }
    let mut set = |lanes: &[bool; LANES], by: [f64; LANES]| {
        for l in (0..LANES).filter(|&l| lanes[l]) {
            factor[l] *= by[l];
            for e in &mut group.elastic {
                e.bend.0[l] *= by[l];
                e.twist.0[l] *= by[l];
            }
        }
        settle(group);
        (factor, unstable(group, width))
    };
    let was_wrong = wrong;
    for _ in 0..DOUBLINGS {
        if !wrong.contains(&true) {
            break;
        }
        let found = set(&wrong, [2.0; LANES]).1;
        wrong = std::array::from_fn(|l| wrong[l] && found[l]);
    }
    // Back by halves of what was too much, and on again where that was too far.
    let search: [bool; LANES] = std::array::from_fn(|l| was_wrong[l] && !wrong[l]);
    let mut down = search;
    let mut step = 0.5;
    for k in 0..HALVINGS {
        if !search.contains(&true) {
            break;
        }
        let by = down.map(|down| libm::exp2(if down { -step } else { step }));
        let found = set(&search, by).1;
        down = found.map(|wrong| !wrong);
        step *= 0.5;
        if k + 1 == HALVINGS {
            // The last that is known to stand.
            let low: [bool; LANES] = std::array::from_fn(|l| search[l] && !down[l]);
            if low.contains(&true) {
                set(&low, [libm::exp2(2.0 * step); LANES]);
            }
        }
    }
    (factor, wrong)
}

/// Particles of a strand of springs; `None` where a segment is far shorter than the others.
pub fn layout(points: &[Vec3], material: &Material, settings: &Settings) -> Option<Layout> {
    let ends = [settings.root, settings.tip];
    match settings.model {
        Model::Paper => layout::only_straight(points, ends),
        _ => layout::zigzag(points, ends, calibration(material).height),
    }
}

fn calibration(material: &Material) -> Calibration {
    let section = calibrate::Section::round(material);
    calibrate::calibrate(section.twisting / section.bending)
}

/// Springs in equilibrium under gravity, as far as their loads allow.
fn prepare_springs(
    strands: &[Strand],
    settings: &Settings,
    gravity: [f64; 3],
    sag_free: bool,
    figures: &mut Figures,
) -> Group {
    let layout = |s: &Strand| layout(&s.point, &s.material, settings).expect("checked before");
    let layouts: Vec<Layout> = strands.iter().map(layout).collect();
    let model = |(s, l): (&Strand, &Layout)| {
        Springs::new(l, &calibrate::Section::round(&s.material), &calibration(&s.material))
    };
    let mut models: Vec<Springs> = strands.iter().zip(&layouts).map(model).collect();
    if sag_free {
        for ((s, model), layout) in strands.iter().zip(&mut models).zip(&layouts) {
            let sagged = sag::without_sag(model, &layout.position, Vec3::from(gravity));
            if let Some(sagged) = sagged.filter(|s| s.factor > 1.0) {
                figures.stiffened.push((s.index, sagged.factor));
            }
        }
    }
    Group::pack_springs(strands, &layouts, &models)
}

/// Whether natural shapes are found that hang into the groomed pose. Only a strand that is clamped at one end and free at
/// the other is determinate.
fn is_sag_free(settings: &Settings) -> bool {
    settings.sag_free && settings.root == End::Clamped && settings.tip == End::Free
}

/// Whether twist can act on a strand: not on a round hair that is straight by nature and that nothing turns at its tip.
pub fn twists(s: &Strand, settings: &Settings) -> bool {
    let bent = |w: &[Vec3]| angle(w[1] - w[0], w[2] - w[1]) > STRAIGHT;
    is_sag_free(settings) || settings.tip == End::Clamped || s.point.windows(3).any(bent)
}

/// Hinges with less than this angle are straight, radians. Rounding makes 1e-16; what is left out shows at 1e-6.
const STRAIGHT: f64 = 1e-9;

/// Angle between two vectors, radians.
fn angle(a: Vec3, b: Vec3) -> f64 {
    libm::atan2(a.cross(&b).norm(), a.dot(&b))
}

/// Weight of every free node, newtons, and 1 where a node is free.
fn weights(group: &Group, gravity: [f64; 3]) -> (Vec<[Pack; 3]>, Vec<Pack>) {
    let n = group.node.len();
    let (mut weight, mut free) = (vec![[Pack::default(); 3]; n], vec![Pack::default(); n]);
    for (i, node) in group.node.iter().enumerate() {
        for l in 0..LANES {
            if group.strand[l].is_some() && node.held.0[l] == 0.0 {
                free[i].0[l] = 1.0;
                for c in 0..3 {
                    weight[i][c].0[l] = node.mass.0[l] * gravity[c];
                }
            }
        }
    }
    (weight, free)
}

struct Settle<'a> {
    group: &'a mut Group,
    weight: &'a [[Pack; 3]],
    free: &'a [Pack],
    sag_free: bool,
}

impl Kernel for Settle<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let g = self.group;
        rod::relax::<L>(&mut g.node, &mut g.elastic, &g.motion);
        if self.sag_free {
            rod::stand::<L>(&mut g.node, &mut g.elastic, &g.motion, self.weight, self.free, &mut Vec::new());
        }
    }
}

/// The lanes whose equilibrium is not stable.
fn unstable(group: &Group, width: Width) -> [bool; LANES] {
    let n = group.node.len();
    let mut tangent: Vec<Column<4, 11>> = vec![[[Pack::default(); 4]; 11]; n];
    let mut scratch = Scratch::<4, 11>::default();
    scratch.reserve(n);
    // Near the origin, or differences drown in rounding.
    let mut near = group.clone();
    for l in 0..LANES {
        let from = near.x(0, l);
        for m in &mut near.motion {
            for c in 0..3 {
                m.x[c].0[l] -= from[c];
            }
        }
    }
    let group = &near;
    let mut moved = group.clone();
    let still: Vec<[Pack; 3]> = vec![[Pack::default(); 3]; n];
    for colour in 0..COLOURS.min(n) {
        for c in 0..4 {
            for sign in [1.0, -1.0] {
                moved.motion.copy_from_slice(&group.motion);
                let step = Step { group, moved: &mut moved, scratch: &mut scratch, colour, c, sign };
                lanes::run(width, step);
                lanes::run(width, Gradient { group: &moved, still: &still, scratch: &mut scratch });
                for j in (colour..n).step_by(COLOURS) {
                    for l in 0..LANES {
                        let by = 0.5 * sign / (DIFFERENCE * unit(group, j, l, c));
                        // The lower triangle: rows from this unknown on.
                        for (r, entry) in tangent[j].iter_mut().enumerate() {
                            if r >= c && j + r / 4 < n {
                                entry[c].0[l] -= scratch.rhs[j + r / 4][r % 4].0[l] * by;
                            }
                        }
                    }
                }
            }
        }
    }
    let mut scratch = Scratch::<4, 11>::default();
    scratch.reserve(n);
    lanes::run(width, Pivots { group, tangent: &tangent, scratch: &mut scratch });
    std::array::from_fn(|l| (0..n).any(|j| (0..4).any(|c| scratch.factor[j][c][c].0[l] < 0.0)))
}

/// Size of an unknown: the edge's length, or 1 radian.
fn unit(group: &Group, j: usize, l: usize, c: usize) -> f64 {
    // A tip has no edge ahead.
    let edge = if j > 0 && group.elastic[j].stretch.0[l] == 0.0 { j - 1 } else { j };
    if c == 3 { 1.0 } else { group.node[edge].length.0[l].min(1.0) }
}

/// Moves every node of a colour along one unknown.
struct Step<'a> {
    group: &'a Group,
    moved: &'a mut Group,
    scratch: &'a mut Scratch<4, 11>,
    colour: usize,
    c: usize,
    sign: f64,
}

impl Kernel for Step<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Step { group, moved, scratch, colour, c, sign } = self;
        let n = group.node.len();
        scratch.rhs.fill([Pack::default(); 4]);
        for j in (colour..n).step_by(COLOURS) {
            for l in 0..LANES {
                scratch.rhs[j][c].0[l] = sign * DIFFERENCE * unit(group, j, l, c);
            }
        }
        let mut turned = vec![Pack::default(); n];
        let Group { node, motion, .. } = moved;
        rod::apply::<L, 4, 11>(node, None, motion, &mut turned, &Pack::splat(1.0), scratch);
    }
}

/// The gradient of the elastic energy.
struct Gradient<'a> {
    group: &'a Group,
    still: &'a [[Pack; 3]],
    scratch: &'a mut Scratch<4, 11>,
}

impl Kernel for Gradient<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let g = self.group;
        // A step so long that inertia vanishes.
        let mut stage = Stage::free(1e30, self.still, self.still);
        let turned = vec![Pack::default(); g.node.len()];
        let damping = Damping(0.0);
        rod::sweep::<L, 4, 11, false>(&g.node, &g.elastic, &g.motion, &turned, damping, &mut stage, self.scratch);
    }
}

/// Factors the tangent; the inverse pivots are left in the factor.
struct Pivots<'a> {
    group: &'a Group,
    tangent: &'a [Column<4, 11>],
    scratch: &'a mut Scratch<4, 11>,
}

impl Kernel for Pivots<'_> {
    type Out = ();
    #[inline(always)]
    fn run<L: Lanes>(self) {
        let n = self.tangent.len();
        let mut window: Window<L, 4, 11> = [Panel::zero(); RING];
        self.scratch.rhs.fill([Pack::default(); 4]);
        for j in 0..n + RING {
            if j < n {
                let node = &self.group.node[j];
                for r in 0..11 {
                    for c in 0..4 {
                        window[j % RING].0[r][c] = L::load(&self.tangent[j][r][c]);
                    }
                }
                for c in 0..4 {
                    let held = L::load(if c == 3 { &node.held_turn } else { &node.held });
                    let one = if c == 3 && j + 1 == n { L::splat(1.0) } else { L::splat(0.0) };
                    window[j % RING].0[c][c] = window[j % RING].0[c][c] + held + one;
                }
            }
            // Updates reach two nodes ahead, so those must be there before.
            if j >= 2 && j - 2 < n {
                let k = j - 2;
                band::eliminate::<L, 4, 11>(k, &mut window, &mut self.scratch.factor[k], &mut self.scratch.rhs);
            }
        }
    }
}
