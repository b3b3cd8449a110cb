//! Bringing hairs to lines of their own: the look of clusters.

use super::Param;
use rayon::prelude::*;

/// Moves `hairs` of P points a share `percent` of the way to their lines, G times P points in the order of `hairs` (each
/// hair once, in any order). Where a line does not begin in the hair's root, the way there counts a share `rooted` (\[P\]) at
/// each point. Roots, other hairs, and those of percent 0 keep their bytes.
pub fn gather(
    points: usize,
    hairs: &[u32],
    percent: Param,
    rooted: &[f32],
    line: &[[f32; 3]],
    position: &mut [[f32; 3]],
) {
    let mut of = vec![u32::MAX; position.len() / points];
    hairs.iter().enumerate().for_each(|(g, h)| of[*h as usize] = g as u32);
    position.par_chunks_mut(points).zip(&of).enumerate().for_each(|(h, (hair, g))| {
        let p = percent.of(h).clamp(0.0, 1.0);
        if *g == u32::MAX || p == 0.0 {
            return;
        }
        let line = &line[*g as usize * points..][..points];
        let off: [f32; 3] = std::array::from_fn(|i| hair[0][i] - line[0][i]);
        for ((x, to), share) in hair.iter_mut().zip(line).zip(rooted).skip(1) {
            *x = std::array::from_fn(|i| x[i] * (1.0 - p) + (to[i] + off[i] * share) * p);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hairs_go_to_their_own_lines_and_others_stay() {
        let at = |k: usize| [k as f32, 0.5, -1.0];
        let before: Vec<[f32; 3]> = (0..9).map(at).collect();
        let line: Vec<[f32; 3]> = (0..6).map(|k| [0.0, k as f32, 3.0]).collect();
        let factor = [1.0, 0.0, 0.5];
        let mut now = before.clone();
        gather(3, &[2, 0], Param { value: 1.0, factor: &factor, shift: &[] }, &[1.0, 0.5, 0.0], &line, &mut now);
        // Its line begins 2.5 beside its root, half of which is left at the next point.
        assert_eq!(now[..3], [before[0], [0.0, 2.75, 1.0], [0.0, 5.0, 3.0]]);
        assert_eq!(now[3..6], before[3..6]);
        assert_eq!(now[8], [4.0, 1.25, 1.0]);
        let mut still = before.clone();
        gather(3, &[1], Param { value: 1.0, factor: &factor, shift: &[] }, &[1.0; 3], &line[..3], &mut still);
        assert_eq!(still, before);
    }
}
