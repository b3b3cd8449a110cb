//! Regions of a map as clumps (streamlines paper §4.5): hairs near each other whose roots have the same value in the map
//! belong together. The paper drops the edges of a triangulation in texture coordinates across which the value changes;
//! here two hairs are neighbours if their roots are within a distance of each other on the rest skin, which a chart seam
//! does not cut.

use super::member::{Members, Sites};
use pelage_geom::NONE;

/// Clumps of the hairs of equal `value` that are joined by steps of at most `near` (scene units) from root to root. The
/// centre is the hair nearest to the mean of the roots. `open` says which hairs take part (empty: all).
pub fn regions(sites: &Sites, value: &[f32], near: f32, open: &[bool]) -> Members {
    let n = sites.position.len();
    let mut parent: Vec<u32> = (0..n as u32).collect();
    let mut order: Vec<u32> = (0..n as u32).filter(|&h| open.get(h as usize).copied().unwrap_or(true)).collect();
    // Hairs in slices of x as thick as a step: only slices beside each other can be joined.
    // Steps of almost nothing have more slices than there are numbers: the last ones are one.
    let slice = |h: u32| (sites.position[h as usize][0] / near).floor() as i64;
    order.sort_by(|&a, &b| {
        let key = |h: u32| (slice(h), sites.position[h as usize][1]);
        key(a).partial_cmp(&key(b)).expect("roots are finite").then(a.cmp(&b))
    });
    let mut first = 0;
    for (k, &a) in order.iter().enumerate() {
        while slice(order[first]).saturating_add(1) < slice(a) {
            first += 1;
        }
        // Hairs of the slice before and of its own, within a step in y.
        let y = sites.position[a as usize][1];
        let own = order[..k].partition_point(|&h| slice(h) < slice(a));
        for range in [first..own, own..k] {
            let part = &order[range];
            let low = part.partition_point(|&h| sites.position[h as usize][1] < y - near);
            for &b in part[low..].iter().take_while(|&&h| sites.position[h as usize][1] <= y + near) {
                let (a, b) = (a as usize, b as usize);
                if value[a] == value[b] && sites.apart(a, b) <= near * near {
                    let (ra, rb) = (find(&mut parent, a as u32), find(&mut parent, b as u32));
                    parent[ra.max(rb) as usize] = ra.min(rb);
                }
            }
        }
    }
    let mut out = Members { centre: Vec::new(), clump: vec![NONE; n], reach: vec![0.0; n] };
    let mut number = vec![NONE; n];
    let mut mean: Vec<([f64; 3], f64)> = Vec::new();
    order.sort_unstable();
    for &h in &order {
        let r = find(&mut parent, h) as usize;
        if number[r] == NONE {
            number[r] = mean.len() as u32;
            mean.push(([0.0; 3], 0.0));
        }
        out.clump[h as usize] = number[r];
        let (sum, count) = &mut mean[number[r] as usize];
        (0..3).for_each(|x| sum[x] += f64::from(sites.position[h as usize][x]));
        *count += 1.0;
    }
    mean.iter_mut().for_each(|(sum, count)| *sum = sum.map(|s| s / *count));
    let mut best = vec![(f64::INFINITY, NONE); mean.len()];
    for &h in &order {
        let c = out.clump[h as usize] as usize;
        let d2: f64 = (0..3).map(|x| (f64::from(sites.position[h as usize][x]) - mean[c].0[x]).powi(2)).sum();
        if d2 < best[c].0 {
            best[c] = (d2, h);
        }
    }
    out.centre = best.iter().map(|b| b.1).collect();
    let mut most = vec![0.0f32; mean.len()];
    for pass in 0..2 {
        for &h in &order {
            let c = out.clump[h as usize] as usize;
            let d = sites.square(h as usize, out.centre[c] as usize).sqrt();
            if pass == 0 {
                most[c] = most[c].max(d);
            } else if most[c] > 0.0 {
                out.reach[h as usize] = d / most[c];
            }
        }
    }
    out
}

/// The lowest hair of the set that a hair is in; shortens the way.
fn find(parent: &mut [u32], mut h: u32) -> u32 {
    while parent[h as usize] != h {
        parent[h as usize] = parent[parent[h as usize] as usize];
        h = parent[h as usize];
    }
    h
}
