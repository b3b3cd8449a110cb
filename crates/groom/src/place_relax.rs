//! Roots that push each other apart on the skin ("Course notes 2003, A production pipeline for hair", §5, names placement
//! by particle repulsion; G. Turk 1991, "Generating textures on arbitrary surfaces using reaction-diffusion", evens points
//! out over a mesh in that way).
//!
//! Every chart is by itself: its border stands still and pushes, so that nothing beyond matters. With s, the mean spacing
//! of the chart's roots (the square root of its area over their number), two of them at a distance r s push each other
//! apart along the line between them with (1 - r / 2)^2 / r up to r = 2 and not at all beyond. A root moves by a part of
//! the sum of what it feels, in its tangent plane, and from there to the nearest point of the skin.

use crate::cells::Cells;
use crate::control::Skin;
use crate::parting::on_edge;
use pelage_geom::{Bvh, SurfacePoint, Vec3};
use rayon::prelude::*;

/// Range of the push, in mean spacings. At 1.2 small gaps close slowly (three times the rounds for the same evenness); at
/// 4 the many beyond outweigh the nearest, pairs form (least over mean distance to the nearest falls from 0.92 to 0.73),
/// and each round costs with the square.
const RANGE: f64 = 2.0;

/// Part of the sum of pushes, in mean spacings, that a root moves by in a round. At 0.7 roots swing about their
/// places for ever (that ratio stays near 0.8); at 0.05 they take four times the rounds.
const GAIN: f64 = 0.2;

/// Longest way of a round, in mean spacings. Longer ones even out no faster, and let a crowded root jump over a
/// row that stands still; at 0.03 three times the rounds are needed.
const LIMIT: f64 = 0.15;

/// Roots do not come nearer than this, in mean spacings, to what stands still: see [`crate::place::BORDER_GAP`].
const GAP: f64 = crate::place::BORDER_GAP;

/// Distance between the points that stand for a border, in mean spacings. Wider, roots slip out between them.
const BORDER_STEP: f64 = 0.5;

/// Rest areas of the charts, square scene units.
pub(crate) fn chart_areas(skin: &Skin) -> Vec<f64> {
    let mut area = vec![0.0; skin.topology.charts];
    for (c, a) in skin.topology.chart.iter().zip(&skin.topology.area) {
        area[*c as usize] += a;
    }
    area
}

/// Moves roots apart for a number of rounds. `still` are further points that push and stay, besides the charts' borders.
pub(crate) fn relax(skin: &Skin, bvh: &Bvh, still: &[SurfacePoint], rounds: usize, roots: &mut [SurfacePoint]) {
    if rounds == 0 || roots.is_empty() {
        return;
    }
    let topology = skin.topology;
    let chart = |p: &SurfacePoint| topology.chart[p.triangle as usize] as usize;
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); topology.charts];
    roots.iter().enumerate().for_each(|(i, p)| members[chart(p)].push(i));
    let spacing: Vec<f64> =
        chart_areas(skin).iter().zip(&members).map(|(a, m)| (a / m.len().max(1) as f64).sqrt()).collect();
    let mut fixed: Vec<Vec<SurfacePoint>> = vec![Vec::new(); topology.charts];
    still.iter().for_each(|p| fixed[chart(p)].push(*p));
    for t in 0..topology.corner.len() as u32 {
        let c = topology.chart[t as usize] as usize;
        if members[c].is_empty() {
            continue;
        }
        let corner = skin.mesh.corners(t);
        for i in (0..3).filter(|&i| topology.is_border(t, i)) {
            let length = (corner[(i + 1) % 3] - corner[i]).norm();
            let parts = (length / (BORDER_STEP * spacing[c])).ceil().max(1.0) as usize;
            fixed[c].extend((0..parts).map(|k| on_edge(t, i, k as f64 / parts as f64)));
        }
    }
    for c in 0..topology.charts {
        if members[c].is_empty() || !spacing[c].is_normal() {
            continue;
        }
        let mut own: Vec<SurfacePoint> = members[c].iter().map(|&i| roots[i]).collect();
        let still = Bodies::still(skin, &fixed[c], spacing[c]);
        for _ in 0..rounds {
            own = round(skin, bvh, &still, &own, spacing[c]);
        }
        members[c].iter().zip(own).for_each(|(&i, p)| roots[i] = p);
    }
}

/// Push of a point at `b` on one at `a`, in mean spacings; that of `a` on `b` is the opposite, to the bit.
fn push(a: Vec3, b: Vec3, spacing: f64) -> Vec3 {
    let apart = (a - b) / spacing;
    let r = apart.norm();
    if r > 0.0 && r < RANGE { apart * ((1.0 - r / RANGE) * (1.0 - r / RANGE) / (r * r)) } else { Vec3::zeros() }
}

/// What pushes.
struct Bodies {
    at: Vec<Vec3>,
    normal: Vec<Vec3>,
    /// How strongly each pushes.
    strength: Vec<f64>,
    cells: Cells,
}

impl Bodies {
    /// Points that push like one each.
    fn new(skin: &Skin, points: &[SurfacePoint], spacing: f64) -> Self {
        let (at, normal): (Vec<Vec3>, Vec<Vec3>) =
            points.par_iter().map(|p| skin.frame(p)).map(|f| (f.origin, f.n)).unzip();
        let mut cells = Cells::new(RANGE * spacing);
        at.iter().for_each(|&p| cells.insert(p));
        Bodies { strength: vec![1.0; at.len()], at, normal, cells }
    }

    /// Points that stand still. Where they stand close, as along a border, those on a length of one spacing push like
    /// one: each counts its neighbours with a weight that falls from 1 to 0 over a spacing, and pushes with 1 over that.
    fn still(skin: &Skin, points: &[SurfacePoint], spacing: f64) -> Self {
        let mut out = Bodies::new(skin, points, spacing);
        let close = |i: usize| -> f64 {
            let seen = out.seen(out.at[i], out.normal[i]);
            seen.map(|(_, q)| (1.0 - (q - out.at[i]).norm() / spacing).max(0.0)).sum()
        };
        out.strength = (0..points.len()).into_par_iter().map(|i| 1.0 / close(i).max(1.0)).collect();
        out
    }

    /// Those near a point of the skin and not on another sheet of it: whose normal is less than 90 degrees away.
    fn seen(&self, at: Vec3, normal: Vec3) -> impl Iterator<Item = (usize, Vec3)> + '_ {
        self.cells.near(at).filter(move |(k, _)| self.normal[*k].dot(&normal) > 0.0)
    }

    /// Sum of their pushes on a point of the skin (one of them at the very point does not count).
    fn push_on(&self, at: Vec3, normal: Vec3, spacing: f64) -> Vec3 {
        self.seen(at, normal).map(|(k, q)| push(at, q, spacing) * self.strength[k]).sum()
    }

    /// Distance of the nearest that is seen, within the range.
    fn nearest(&self, at: Vec3, normal: Vec3) -> f64 {
        self.seen(at, normal).map(|(_, q)| (q - at).norm()).fold(f64::INFINITY, f64::min)
    }
}

/// Where one chart's roots are a round later: all move at once.
fn round(skin: &Skin, bvh: &Bvh, still: &Bodies, roots: &[SurfacePoint], spacing: f64) -> Vec<SurfacePoint> {
    let moving = Bodies::new(skin, roots, spacing);
    let chart = |p: &SurfacePoint| skin.topology.chart[p.triangle as usize];
    let moved = |i: usize| {
        let (at, n) = (moving.at[i], moving.normal[i]);
        let push = moving.push_on(at, n, spacing) + still.push_on(at, n, spacing);
        let way = (push - n * n.dot(&push)) * GAIN;
        let way = way * (spacing * (LIMIT / way.norm().max(LIMIT)));
        let hit = bvh.closest(at + way, f64::INFINITY)?;
        if chart(&hit.point) != chart(&roots[i]) {
            return None;
        }
        let there = skin.frame(&hit.point);
        let near = still.nearest(there.origin, there.n);
        let stays_clear = near >= GAP * spacing || near >= still.nearest(at, n);
        (there.n.dot(&n) > 0.0 && stays_clear).then_some(hit.point)
    };
    (0..roots.len()).into_par_iter().map(|i| moved(i).unwrap_or(roots[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_skin::TestSkin;
    use pelage_geom::rng::uniform;

    /// Roots spread at random over the area of a round skin.
    fn random(s: &TestSkin, n: u64) -> Vec<SurfacePoint> {
        let at = |i: u64| {
            let (a, z) = (std::f64::consts::TAU * uniform(7, i, 1, 0), 2.0 * uniform(7, i, 1, 1) - 1.0);
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * libm::cos(a), z, r * libm::sin(a)) * 10.0
        };
        (0..n).map(|i| s.bvh.closest(at(i), f64::INFINITY).unwrap().point).collect()
    }

    /// Least and mean distance to the nearest neighbour, over the spacing.
    fn nearest(s: &TestSkin, roots: &[SurfacePoint]) -> [f64; 2] {
        let at: Vec<Vec3> = roots.iter().map(|p| s.mesh.point(p)).collect();
        let others = |i: usize| (0..at.len()).filter(move |&k| k != i);
        let one = |i: usize| others(i).map(|k| (at[i] - at[k]).norm()).fold(f64::MAX, f64::min);
        let all: Vec<f64> = (0..at.len()).map(one).collect();
        let spacing = (s.topology.area.iter().sum::<f64>() / at.len() as f64).sqrt();
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        [all.iter().copied().fold(f64::MAX, f64::min) / spacing, mean / spacing]
    }

    #[test]
    fn random_roots_get_even() {
        let s = TestSkin::new(48, 24, 0.5);
        for n in [60, 400] {
            let before = random(&s, n);
            let mut after = before.clone();
            relax(&s.skin(), &s.bvh, &[], 0, &mut after);
            assert_eq!(before, after);
            relax(&s.skin(), &s.bvh, &[], 30, &mut after);
            let [first, last] = [&before, &after].map(|r| nearest(&s, r)).map(|[least, mean]| least / mean);
            assert!(first < 0.4 && last > 0.8, "{first} {last}");
            for (p, q) in before.iter().zip(&after) {
                let chart = |p: &SurfacePoint| s.topology.chart[p.triangle as usize];
                assert_eq!(chart(p), chart(q));
            }
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same() {
        let s = TestSkin::new(24, 12, 0.5);
        let run = |threads| {
            let mut roots = random(&s, 150);
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| relax(&s.skin(), &s.bvh, &[], 5, &mut roots));
            roots
        };
        assert_eq!(run(1), run(4));
    }

    #[test]
    fn pushes_are_equal_and_opposite() {
        let s = TestSkin::new(24, 12, 0.5);
        let spacing = 2.5;
        let all = Bodies::new(&s.skin(), &random(&s, 200), spacing);
        let on = |i: usize| all.push_on(all.at[i], all.normal[i], spacing);
        let (sum, size) = (0..200).map(on).fold((Vec3::zeros(), 0.0), |(a, b), p| (a + p, b + p.norm()));
        assert!(sum.norm() < 1e-12 * size && size > 10.0, "{sum} {size}");
        for k in 1..200 {
            assert_eq!(push(all.at[k], all.at[0], spacing), -push(all.at[0], all.at[k], spacing));
        }
        // The stated law, at the spacing, and its end.
        assert!((push(Vec3::x() * 3.0, Vec3::zeros(), 3.0) - Vec3::x() * 0.25).norm() < 1e-15);
        assert_eq!(push(Vec3::x() * 6.0, Vec3::zeros(), 3.0), Vec3::zeros());
    }

    /// A border of eight times the points pushes as one of fewer does.
    #[test]
    fn close_still_points_push_like_fewer() {
        let s = TestSkin::new(24, 12, 0.0);
        let row = |n: usize| {
            let at = |k: usize| {
                let a = std::f64::consts::TAU * k as f64 / n as f64;
                s.bvh.closest(Vec3::new(libm::cos(a), 0.0, libm::sin(a)) * 10.0, f64::INFINITY).unwrap().point
            };
            Bodies::still(&s.skin(), &(0..n).map(at).collect::<Vec<_>>(), 2.0)
        };
        let at = Vec3::new(6.0, 1.6, 8.0).normalize() * 10.0;
        let [few, many] = [row(63), row(504)].map(|b| b.push_on(at, at.normalize(), 2.0).norm());
        assert!(few > 0.05 && (few / many - 1.0).abs() < 0.03, "{few} {many}");
    }

    #[test]
    fn roots_keep_clear_of_borders_and_of_what_stands_still() {
        let s = TestSkin::new(48, 24, 0.5);
        let still = random(&s, 20);
        let before: Vec<SurfacePoint> = random(&s, 300)[20..].to_vec();
        let mut after = before.clone();
        relax(&s.skin(), &s.bvh, &still, 30, &mut after);
        assert_ne!(before, after);
        let border = s.topology.border_edges().into_iter().map(|e| s.topology.chart_vertex[e[0] as usize].vertex);
        let mut at: Vec<Vec3> = border.map(|v| Vec3::from(s.mesh.position[v as usize])).collect();
        at.extend(still.iter().map(|p| s.mesh.point(p)));
        let gap = |p: &SurfacePoint| at.iter().map(|q| (q - s.mesh.point(p)).norm()).fold(f64::MAX, f64::min);
        // Half of the area has half of the roots, but for chance.
        let least = 0.95 * GAP * (s.topology.area.iter().sum::<f64>() / 280.0).sqrt();
        assert!(before.iter().filter(|p| gap(p) < least).count() > 10);
        assert!(after.iter().all(|p| gap(p) >= least));
        // Nor does a crowd press them there, whose push on each is stronger than that of the border.
        let middle = Vec3::new(-8.0, 0.5, 2.5).normalize() * 10.0;
        let crowded = |p: &SurfacePoint| (s.mesh.point(p) - middle).norm() < 1.9 && gap(p) > 1.0;
        let mut crowd: Vec<SurfacePoint> = random(&s, 20_000).into_iter().filter(crowded).take(100).collect();
        assert!(crowd.len() == 100 && crowd.iter().all(|p| s.topology.chart[p.triangle as usize] == 1));
        let least = 0.95 * GAP * (s.topology.area.iter().sum::<f64>() / 200.0).sqrt();
        relax(&s.skin(), &s.bvh, &still, 10, &mut crowd);
        assert!(crowd.iter().all(|p| gap(p) >= least));
    }

    /// The two sides of a flat body do not feel each other, however near they are.
    #[test]
    fn another_sheet_of_the_skin_does_not_push() {
        let mut s = TestSkin::new(48, 24, 0.0);
        let up = random(&s, 200).into_iter().partition(|p| s.mesh.point(p).y > 3.0);
        let (top, rest): (Vec<SurfacePoint>, Vec<SurfacePoint>) = up;
        let below: Vec<SurfacePoint> = rest.into_iter().filter(|p| s.mesh.point(p).y < -3.0).collect();
        s.mesh.position.iter_mut().for_each(|p| p[1] *= 0.01);
        s.rest = s.posed(|p| p);
        let alone = Bodies::new(&s.skin(), &top, 2.0);
        let both = Bodies::new(&s.skin(), &[top.clone(), below].concat(), 2.0);
        assert!(both.at.len() > top.len() + 40);
        for i in 0..top.len() {
            let on = |b: &Bodies| b.push_on(b.at[i], b.normal[i], 2.0);
            assert_eq!(on(&alone), on(&both));
        }
    }
}
