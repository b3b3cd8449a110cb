//! All pairs of hairs that meet, and a report on a groom.
//!
//! Golodetz 2007, §5.2 compares every link with every other. Here hairs are cut into stretches about as long as their
//! neighbours are apart (runs of short links, parts of long ones), which are bounded twice: by boxes, in one tree for all
//! hairs, and by a wider capsule around the segment between their ends, which fits what lies askew of the axes. What is
//! found is the same.

use super::Chains;
use super::segment::{approach, point_distance};
use pelage_geom::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Length of a stretch over the mean distance of neighbouring hairs. Speed alone depends on it: with 1 a dense groom
/// takes 1.7 times as long.
const STRETCH: f64 = 4.0;

/// Links a stretch holds at most: all of them are compared where two stretches are near. Speed alone depends on it.
const RUN: usize = 4;

/// Stretches there may be for each link at most. Memory and speed depend on it.
const PARTS: f64 = 4.0;

/// Stretches a leaf of the tree holds at most. Speed alone depends on it.
const LEAF: usize = 8;

/// Two hairs and where they are nearest to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The hairs, the lower first.
    pub hair: [u32; 2],
    /// Distance between their surfaces, scene units; below 0 they meet, and it is how deep.
    ///
    /// Where chains bound splines it is the least that the distance of the thick curves can be; the most is this plus
    /// twice what either link is wider than its curve.
    pub gap: f64,
    /// The links, each counted from its hair's root.
    pub link: [u32; 2],
    /// Places on their axes, from 0 to 1.
    pub at: [f64; 2],
}

/// What [`check`] found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Check {
    /// Hairs there are.
    pub hairs: usize,
    /// Pairs within the margin.
    pub near: usize,
    /// Pairs that meet.
    pub meeting: usize,
    /// Hairs that meet some other.
    pub hairs_meeting: usize,
    /// Greatest depth of a pair, scene units; 0 if none meet.
    pub deepest: f64,
    /// The pairs of least gap, the worst first; of equals the lower hairs first.
    pub worst: Vec<Pair>,
}

/// Counts pairs of hairs that meet or come within `margin` (0 or more, scene units), and lists the `worst` of them.
pub fn check(chains: &Chains, margin: f64, worst: usize) -> Result<Check, String> {
    if !(margin >= 0.0 && margin.is_finite()) {
        return Err(format!("a margin is 0 or more, not {margin}"));
    }
    let mut pairs = near_pairs(chains, margin);
    let mut meets = vec![false; chains.len()];
    for p in pairs.iter().filter(|p| p.gap < 0.0) {
        p.hair.iter().for_each(|&s| meets[s as usize] = true);
    }
    let mut report = Check {
        hairs: chains.len(),
        near: pairs.len(),
        meeting: pairs.iter().filter(|p| p.gap < 0.0).count(),
        hairs_meeting: meets.iter().filter(|m| **m).count(),
        ..Check::default()
    };
    let order = |a: &Pair, b: &Pair| a.gap.total_cmp(&b.gap).then(a.hair.cmp(&b.hair));
    if worst > 0 && worst < pairs.len() {
        pairs.select_nth_unstable_by(worst - 1, order);
    }
    report.deepest = pairs.iter().map(|p| -p.gap).fold(0.0, f64::max);
    pairs.truncate(worst);
    pairs.sort_unstable_by(order);
    report.worst = pairs;
    Ok(report)
}

/// All pairs of hairs whose surfaces come within `margin` (scene units; below 0: that meet deeper than that), each once
/// with its least gap, in the order of their hairs. Links of one hair are not compared with each other.
pub fn near_pairs(chains: &Chains, margin: f64) -> Vec<Pair> {
    let tree = Tree::new(chains);
    let leaves: Vec<&Node> = tree.node.iter().filter(|n| n.second == 0).collect();
    let mut pairs = leaves.par_iter().map(|leaf| tree.pairs_of(leaf, margin)).collect::<Vec<_>>().concat();
    // A pair of links may be found twice, but is then the same to the last digit: equals may stand in any order.
    pairs.par_sort_unstable_by(|p, q| {
        p.hair.cmp(&q.hair).then(p.gap.total_cmp(&q.gap)).then_with(|| p.link.cmp(&q.link))
    });
    pairs.dedup_by_key(|p| p.hair);
    pairs
}

/// Nearest place of two hairs of `chains`; `None` if one of them has no links.
pub fn nearest(chains: &Chains, hair: [u32; 2]) -> Option<Pair> {
    let mut best: Option<Pair> = None;
    let both = hair.map(|s| stretches(chains, s, f64::MAX, RUN));
    for (a, b) in both[0].iter().flat_map(|a| both[1].iter().map(move |b| (a, b))) {
        let limit = best.map_or(f64::MAX, |p| p.gap);
        compare(chains, a, b, limit, &mut |p| best = nearer(best, p));
    }
    best
}

fn nearer(best: Option<Pair>, p: Pair) -> Option<Pair> {
    if best.is_none_or(|b| p.gap < b.gap) { Some(p) } else { best }
}

/// Links of a hair from `first` on, or a part of one: within `radius` of the segment `axis`, and within a box.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    hair: u32,
    first: u32,
    links: u32,
    axis: [Vec3; 2],
    radius: f64,
    low: Vec3,
    high: Vec3,
}

/// A hair in stretches of about the given length, of no more than `most` links.
fn stretches(chains: &Chains, hair: u32, length: f64, most: usize) -> Vec<Stretch> {
    let s = hair as usize;
    let size = |k: usize| {
        let axis = chains.link(s, k).axis;
        (axis[1] - axis[0]).norm()
    };
    let mut out = Vec::new();
    let mut first = 0;
    while first < chains.links(s) {
        let (mut end, mut sum) = (first + 1, size(first));
        if sum > length {
            let axis = chains.link(s, first).axis;
            let parts = libm::ceil(sum / length) as usize;
            let at = |k: usize| axis[0].lerp(&axis[1], k as f64 / parts as f64);
            out.extend((0..parts).map(|k| Stretch::new(chains, hair, first..end, [at(k), at(k + 1)])));
        } else {
            while end < chains.links(s) && end - first < most && sum + size(end) <= length {
                sum += size(end);
                end += 1;
            }
            let axis = [chains.link(s, first).axis[0], chains.link(s, end - 1).axis[1]];
            out.push(Stretch::new(chains, hair, first..end, axis));
        }
        first = end;
    }
    out
}

/// Mean length of a stretch for [`stretches`].
fn stretch_length(chains: &Chains) -> f64 {
    let (mut low, mut high) = (Vec3::repeat(f64::MAX), Vec3::repeat(f64::MIN));
    let (mut total, mut links, mut thick) = (0.0, 0.0, 0.0);
    for s in 0..chains.len() {
        for link in (0..chains.links(s)).map(|k| chains.link(s, k)) {
            (low, high) = (low.inf(&link.axis[0]), high.sup(&link.axis[0]));
            total += (link.axis[1] - link.axis[0]).norm();
            thick += link.radius;
            links += 1.0;
        }
    }
    // A hair has the cross-section that the total length leaves of the volume.
    let apart = ((high - low).product() / total).sqrt();
    let length = (STRETCH * apart).max(total / (PARTS * links)).max(thick / links);
    if length.is_finite() { length } else { f64::MAX }
}

impl Stretch {
    fn new(chains: &Chains, hair: u32, links: Range<usize>, axis: [Vec3; 2]) -> Stretch {
        let s = hair as usize;
        let mut radius = chains.link(s, links.start).radius;
        let mut low = axis[0].inf(&axis[1]).map(|x| x - radius);
        let mut high = axis[0].sup(&axis[1]).map(|x| x + radius);
        if links.len() > 1 {
            for link in links.clone().map(|k| chains.link(s, k)) {
                for p in link.axis {
                    // A convex function is largest at an end of a link's axis.
                    radius = radius.max(point_distance(p, axis) + link.radius);
                    low = low.inf(&p.map(|x| x - link.radius));
                    high = high.sup(&p.map(|x| x + link.radius));
                }
            }
        }
        // What rounding may take off distances between points of this size, many times over.
        let slack = 1e-13 * low.amax().max(high.amax());
        Stretch {
            hair,
            first: links.start as u32,
            links: links.len() as u32,
            axis,
            radius: radius + slack,
            low: low.map(|x| x - slack),
            high: high.map(|x| x + slack),
        }
    }
}

/// Hands over all pairs of links of two stretches whose gap is at most `limit`.
fn compare(chains: &Chains, a: &Stretch, b: &Stretch, limit: f64, take: &mut impl FnMut(Pair)) {
    if approach(a.axis, b.axis).distance - a.radius - b.radius > limit {
        return;
    }
    for i in a.first..a.first + a.links {
        let one = chains.link(a.hair as usize, i as usize);
        for j in b.first..b.first + b.links {
            let other = chains.link(b.hair as usize, j as usize);
            let closest = approach(one.axis, other.axis);
            let gap = closest.distance - (one.radius + other.radius);
            if gap <= limit {
                take(Pair { hair: [a.hair, b.hair], gap, link: [i, j], at: closest.at });
            }
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Stretches it holds, in the tree's order.
    begin: u32,
    end: u32,
    /// The second child (the first is the next node); 0 for a leaf.
    second: u32,
}

/// Boxes around the stretches of all hairs.
struct Tree<'a> {
    chains: &'a Chains,
    /// Those of a node side by side.
    stretch: Vec<Stretch>,
    node: Vec<Node>,
}

impl<'a> Tree<'a> {
    fn new(chains: &'a Chains) -> Self {
        let length = stretch_length(chains);
        let cut = |s: u32| stretches(chains, s, length, RUN);
        let mut stretch = (0..chains.len() as u32).into_par_iter().map(cut).collect::<Vec<_>>().concat();
        let mut node = Vec::new();
        if !stretch.is_empty() {
            grow(&mut stretch, 0, &mut node);
        }
        Tree { chains, stretch, node }
    }

    /// Pairs of links of a leaf's stretches with later stretches.
    fn pairs_of(&self, leaf: &Node, margin: f64) -> Vec<Pair> {
        let mut found: Vec<Pair> = Vec::new();
        let widen = |x: &Vec3, by: f64| x.map(|x| x + by);
        let meet = |a: &(Vec3, Vec3), b: &(Vec3, Vec3)| (0..3).all(|i| a.0[i] <= b.1[i] && b.0[i] <= a.1[i]);
        let around = (widen(&leaf.low, -margin), widen(&leaf.high, margin));
        let mut stack = vec![0u32];
        while let Some(n) = stack.pop() {
            let node = &self.node[n as usize];
            if node.end <= leaf.begin + 1 || !meet(&around, &(node.low, node.high)) {
                continue;
            }
            if node.second > 0 {
                stack.push(node.second);
                stack.push(n + 1);
                continue;
            }
            for i in leaf.begin..leaf.end {
                let a = &self.stretch[i as usize];
                let around = (widen(&a.low, -margin), widen(&a.high, margin));
                for b in &self.stretch[node.begin.max(i + 1).min(node.end) as usize..node.end as usize] {
                    if a.hair != b.hair && meet(&around, &(b.low, b.high)) {
                        let (a, b) = if a.hair < b.hair { (a, b) } else { (b, a) };
                        compare(self.chains, a, b, margin, &mut |p| found.push(p));
                    }
                }
            }
        }
        found
    }
}

/// Nodes over stretches, the first of which has number `begin`, put in order as the tree is cut: at the middle one
/// along the longest side.
fn grow(stretch: &mut [Stretch], begin: u32, node: &mut Vec<Node>) {
    let (mut low, mut high) = (stretch[0].low, stretch[0].high);
    for s in stretch.iter() {
        (low, high) = (low.inf(&s.low), high.sup(&s.high));
    }
    let at = node.len();
    node.push(Node { low, high, begin, end: begin + stretch.len() as u32, second: 0 });
    if stretch.len() > LEAF {
        let axis = (high - low).imax();
        let half = stretch.len() / 2;
        let centre = |s: &Stretch| s.low[axis] + s.high[axis];
        stretch.select_nth_unstable_by(half, |a, b| centre(a).total_cmp(&centre(b)));
        let (one, other) = stretch.split_at_mut(half);
        grow(one, begin, node);
        node[at].second = node.len() as u32;
        grow(other, begin + half as u32, node);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::BSpline;
    use pelage_geom::{Offsets, rng};

    /// Curly hairs of 0 to `most` points, their roots in a square of the given side, links of about half `step`.
    fn groom(hairs: u64, most: u64, side: f64, step: f64) -> (Vec<[f32; 3]>, Offsets, Vec<f32>) {
        let count = |s: u64| if s.is_multiple_of(17) { s as usize / 17 % 3 } else { (most - s % 5) as usize };
        let offsets = Offsets::from_counts((0..hairs).map(count));
        let (mut position, mut radius) = (Vec::new(), Vec::new());
        for s in 0..hairs {
            let mut p =
                Vec3::from_fn(|i, _| side * rng::uniform(7, s, 0, i as u64)).component_mul(&Vec3::new(1.0, 1.0, 0.0));
            for k in 0..count(s) as u64 {
                position.push(p.cast::<f32>().into());
                radius.push((0.02 + 0.03 * rng::uniform(7, s, 1, k)) as f32);
                p += Vec3::from_fn(|i, _| step * (rng::uniform(7, s, 2 + k, i as u64) - 0.375));
            }
        }
        (position, offsets, radius)
    }

    fn brute(chains: &Chains, margin: f64) -> Vec<Pair> {
        let mut all = Vec::new();
        for s in 0..chains.len() {
            for t in s + 1..chains.len() {
                let mut best: Option<Pair> = None;
                for i in 0..chains.links(s) {
                    for j in 0..chains.links(t) {
                        let (a, b) = (chains.link(s, i), chains.link(t, j));
                        let closest = approach(a.axis, b.axis);
                        let gap = closest.distance - (a.radius + b.radius);
                        let (hair, link) = ([s as u32, t as u32], [i as u32, j as u32]);
                        best = nearer(best, Pair { hair, gap, link, at: closest.at });
                    }
                }
                all.extend(best.filter(|p| p.gap <= margin));
            }
        }
        all
    }

    #[test]
    fn pairs_are_those_of_all_links_with_all() {
        // Runs of short links, parts of long ones; far from the origin and large: what rounding takes must not lose a pair.
        for (long, scale) in [(false, 1.0), (false, 1e6), (true, 1.0), (true, 1e6)] {
            let (position, offsets, radius) = if long { groom(400, 6, 3.0, 6.0) } else { groom(240, 14, 6.0, 0.4) };
            // Long ones are packed densely, in a flat layer.
            let flat = if long { 0.2 } else { 1.0 };
            let far = |p: &[f32; 3]| [p[0], p[1], flat * p[2]].map(|x| (x + 3.0) * scale);
            let position: Vec<[f32; 3]> = position.iter().map(far).collect();
            let radius: Vec<f32> = radius.iter().map(|r| r * scale).collect();
            let chains = Chains::of_polylines(&position, &offsets, &radius).expect("chains");
            let (links, cut) =
                ((0..chains.len()).map(|s| chains.links(s)).sum::<usize>(), Tree::new(&chains).stretch.len());
            assert!(if long { 10 * cut > 13 * links } else { cut < links }, "{cut} of {links}");
            let all = brute(&chains, f64::from(scale));
            for margin in [0.0, -0.03, 0.1, 0.8].map(|m| m * f64::from(scale)) {
                let want: Vec<Pair> = all.iter().filter(|p| p.gap <= margin).copied().collect();
                assert!(want.len() > 30 && want.len() < 60_000, "{}", want.len());
                assert_eq!(near_pairs(&chains, margin), want, "{margin}");
                for p in want.iter().step_by(31) {
                    assert_eq!(nearest(&chains, p.hair), Some(*p));
                }
            }
            // A margin that is exactly a gap holds it.
            assert!(near_pairs(&chains, all[5].gap).contains(&all[5]));
        }
        assert!(nearest(&Chains::of_polylines(&[], &Offsets::uniform(2, 0), &[]).expect("chains"), [0, 1]).is_none());
    }

    #[test]
    fn pairs_do_not_depend_on_threads() {
        let (position, offsets, radius) = groom(400, 10, 5.0, 0.4);
        let chains = Chains::of_polylines(&position, &offsets, &radius).expect("chains");
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| near_pairs(&chains, 0.05))
        };
        let (one, three) = (with(1), with(3));
        assert!(!one.is_empty() && one == three);
    }

    #[test]
    fn a_check_counts_and_lists_the_worst() {
        let (position, offsets, radius) = groom(200, 12, 5.0, 0.4);
        let chains = Chains::of_polylines(&position, &offsets, &radius).expect("chains");
        let mut all = brute(&chains, 0.05);
        let report = check(&chains, 0.05, 10).expect("a report");
        let meeting: Vec<&Pair> = all.iter().filter(|p| p.gap < 0.0).collect();
        let mut hairs: Vec<u32> = meeting.iter().flat_map(|p| p.hair).collect();
        hairs.sort_unstable();
        hairs.dedup();
        assert_eq!((report.hairs, report.near), (200, all.len()));
        assert_eq!((report.meeting, report.hairs_meeting), (meeting.len(), hairs.len()));
        all.sort_by(|a, b| a.gap.total_cmp(&b.gap));
        assert!(report.worst == all[..10] && report.deepest == -all[0].gap && report.deepest > 0.0);
        let whole = check(&chains, 0.05, usize::MAX).expect("a report");
        assert!(whole.worst == all && whole.deepest == report.deepest);
        assert_eq!(check(&chains, 0.05, 0).expect("a report").deepest, report.deepest);
        assert!(check(&chains, f64::NAN, 1).is_err() && check(&chains, -1.0, 1).is_err());
        let none = Chains::of_polylines(&[], &Offsets::default(), &[]).expect("chains");
        assert_eq!(check(&none, 0.1, 5), Ok(Check::default()));
        // Crossing hairs in the one place where they do, as deep as both are thick.
        let cross = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, -1.0, 0.0], [0.5, 3.0, 0.0]];
        let chains = Chains::of_polylines(&cross, &Offsets::uniform(2, 2), &[0.25; 4]).expect("chains");
        let p = check(&chains, 0.0, 1).expect("a report").worst[0];
        assert_eq!((p.hair, p.gap, p.link, p.at), ([0, 1], -0.5, [0, 0], [0.75, 0.25]));
    }

    #[test]
    fn gaps_of_bounded_splines_are_within_what_is_stated() {
        let curve: Vec<BSpline> = (0..40)
            .map(|s| BSpline {
                control: (0..8)
                    .map(|k| Vec3::from_fn(|i, _| rng::uniform(9, s, k, i as u64)) * 1.5 + Vec3::z() * (0.3 * k as f64))
                    .collect(),
            })
            .collect();
        let dense: Vec<Vec<Vec3>> = curve.iter().map(|c| c.points(161)).collect();
        let radius: Vec<f64> = (0..40).map(|s| 0.02 + 0.002 * f64::from(s)).collect();
        let tolerance = 0.02;
        let chains = Chains::of_splines(&curve, &radius, tolerance).expect("chains");
        let mut seen = 0;
        for s in 0..40 {
            for t in s + 1..40 {
                let segments = |h: usize| dense[h].windows(2).map(|w| [w[0], w[1]]);
                let true_gap = segments(s)
                    .flat_map(|a| segments(t).map(move |b| approach(a, b).distance))
                    .fold(f64::MAX, f64::min)
                    - radius[s]
                    - radius[t];
                let p = nearest(&chains, [s as u32, t as u32]).expect("a pair");
                // Chords of the dense polyline are off by less than 1e-3.
                assert!(p.gap < true_gap + 2e-3 && true_gap < p.gap + 4.0 * tolerance + 2e-3, "{} {true_gap}", p.gap);
                seen += usize::from(true_gap < 0.0);
            }
        }
        assert!(seen > 20, "{seen}");
    }
}
