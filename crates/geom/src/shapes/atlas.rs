//! From half a body to a mesh as a file has it: mirrored, cut into charts, laid flat, packed, split at seams.

use super::unwrap::unwrap;
use crate::{Mesh, NONE, Vec3};
use rayon::prelude::*;

/// One region of the half body that becomes a chart.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// True: both halves in one chart across x = 0. False: two charts, mirror images of each other.
    pub joined: bool,
    /// Direction in space that should point along +v.
    pub up: [f64; 3],
    /// Texture size against the other charts.
    pub scale: f64,
}

/// A chart: mesh vertices and triangles of its own, flat coordinates in scaled scene units from 0.
struct Chart {
    position: Vec<Vec3>,
    triangle: Vec<[u32; 3]>,
    uv: Vec<[f64; 2]>,
    extent: [f64; 2],
}

/// Space between charts and to the border of the texture square: 10 texels of a 512 map. With less, charts bleed into each
/// other on small maps; with more, texels are wasted.
const GAP: f64 = 0.02;

/// Mirrors the half `position`, `triangle` (x >= 0, the border at x = 0) and lays it out. `part_of` names the part of a
/// triangle by its centre; strays and teeth of the borders are cleaned up.
pub fn assemble(position: &[Vec3], triangle: &[[u32; 3]], parts: &[Part], part_of: &dyn Fn(Vec3) -> usize) -> Mesh {
    // Single precision, so that a file with 32-bit floats holds exactly these points.
    let position: Vec<Vec3> = position.iter().map(|p| p.map(|x| f64::from(x as f32))).collect();
    let label = labels(&position, triangle, parts.len(), part_of);
    let mut charts: Vec<Chart> = (0..parts.len())
        .into_par_iter()
        .map(|k| {
            let mine: Vec<[u32; 3]> = (0..triangle.len()).filter(|&t| label[t] == k).map(|t| triangle[t]).collect();
            chart(&position, &mine, &parts[k])
        })
        .collect();
    let twins: Vec<Chart> = charts.iter().zip(parts).filter(|(_, p)| !p.joined).map(|(c, _)| c.mirror()).collect();
    charts.extend(twins);
    pack(&charts)
}

/// Part of each triangle: by its centre, then smoothed, then every part reduced to its largest piece.
fn labels(position: &[Vec3], triangle: &[[u32; 3]], parts: usize, part_of: &dyn Fn(Vec3) -> usize) -> Vec<usize> {
    let centre = |t: &[u32; 3]| t.iter().fold(Vec3::zeros(), |s, &v| s + position[v as usize]) / 3.0;
    let mut label: Vec<usize> = triangle.iter().map(|t| part_of(centre(t))).collect();
    let near = neighbours(triangle);
    let vote = |label: &[usize], t: usize, but: usize| {
        let mut count = vec![0; parts];
        near[t].iter().filter(|&&n| n != NONE).for_each(|&n| count[label[n as usize]] += 1);
        (0..parts).filter(|&k| k != but && count[k] > 0).max_by_key(|&k| (count[k], parts - k)).map(|k| (k, count[k]))
    };
    for _ in 0..4 {
        for t in 0..triangle.len() {
            if let Some((k, 2..)) = vote(&label, t, label[t]) {
                label[t] = k;
            }
        }
    }
    // Pieces that are not the largest of their part go to their neighbours, from the outside in.
    let mut stray = strays(&label, &near, parts);
    while stray.iter().any(|&s| s) {
        let mut moved = false;
        for t in 0..triangle.len() {
            if let (true, Some((k, _))) = (stray[t], vote(&label, t, label[t])) {
                (label[t], stray[t], moved) = (k, false, true);
            }
        }
        if !moved {
            break;
        }
    }
    label
}

/// Triangles across each edge, [`NONE`] on the border.
pub fn neighbours(triangle: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let side = |t: usize, i: usize| [triangle[t][i], triangle[t][(i + 1) % 3]];
    let mut edge: Vec<([u32; 2], u32)> =
        (0..triangle.len()).flat_map(|t| (0..3).map(move |i| (side(t, i), t as u32))).collect();
    edge.sort_unstable();
    (0..triangle.len())
        .map(|t| {
            std::array::from_fn(|i| {
                let [a, b] = side(t, i);
                edge.binary_search_by_key(&[b, a], |e| e.0).map_or(NONE, |k| edge[k].1)
            })
        })
        .collect()
}

/// True for triangles outside the largest connected piece of their part.
fn strays(label: &[usize], near: &[[u32; 3]], parts: usize) -> Vec<bool> {
    let (mut piece, mut count, mut of) = (vec![usize::MAX; label.len()], Vec::new(), Vec::new());
    for start in 0..label.len() {
        if piece[start] != usize::MAX {
            continue;
        }
        let (id, mut stack) = (count.len(), vec![start]);
        piece[start] = id;
        count.push(0);
        of.push(label[start]);
        while let Some(t) = stack.pop() {
            count[id] += 1;
            for &n in near[t].iter().filter(|&&n| n != NONE) {
                if piece[n as usize] == usize::MAX && label[n as usize] == label[t] {
                    piece[n as usize] = id;
                    stack.push(n as usize);
                }
            }
        }
    }
    let largest: Vec<usize> = (0..parts)
        .map(|k| (0..count.len()).filter(|&i| of[i] == k).max_by_key(|&i| count[i]).unwrap_or(usize::MAX))
        .collect();
    (0..label.len()).map(|t| piece[t] != largest[label[t]]).collect()
}

/// Lays out one part: renumbered, mirrored across x = 0 if joined, unwrapped, turned upright, moved to the corner.
fn chart(position: &[Vec3], triangle: &[[u32; 3]], part: &Part) -> Chart {
    let (mut number, mut points, mut faces) = (vec![NONE; position.len()], Vec::new(), Vec::new());
    for t in triangle {
        faces.push(t.map(|v| {
            if number[v as usize] == NONE {
                number[v as usize] = points.len() as u32;
                points.push(position[v as usize]);
            }
            number[v as usize]
        }));
    }
    if part.joined {
        let half = points.clone();
        let twin: Vec<u32> = half
            .iter()
            .enumerate()
            .map(|(v, p)| {
                if p.x == 0.0 {
                    return v as u32;
                }
                points.push(Vec3::new(-p.x, p.y, p.z));
                points.len() as u32 - 1
            })
            .collect();
        let other: Vec<[u32; 3]> = faces.iter().map(|t| [t[0], t[2], t[1]].map(|v| twin[v as usize])).collect();
        faces.extend(other);
    }
    let mut uv = unwrap(&points, &faces);
    turn_upright(&points, &mut uv, Vec3::from(part.up));
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for p in &mut uv {
        *p = p.map(|x| x * part.scale);
        for c in 0..2 {
            low[c] = low[c].min(p[c]);
            high[c] = high[c].max(p[c]);
        }
    }
    uv.iter_mut().for_each(|p| (0..2).for_each(|c| p[c] -= low[c]));
    Chart { position: points, triangle: faces, uv, extent: [high[0] - low[0], high[1] - low[1]] }
}

/// Turns the chart so that texture coordinates covary with height along `up` in v only.
fn turn_upright(position: &[Vec3], uv: &mut [[f64; 2]], up: Vec3) {
    let n = uv.len() as f64;
    let mean = uv.iter().fold([0.0; 2], |s, p| [s[0] + p[0] / n, s[1] + p[1] / n]);
    let height = position.iter().map(|p| p.dot(&up)).sum::<f64>() / n;
    let mut d = [0.0; 2];
    for (p, q) in position.iter().zip(uv.iter()) {
        let h = p.dot(&up) - height;
        (0..2).for_each(|c| d[c] += h * (q[c] - mean[c]));
    }
    let norm = libm::hypot(d[0], d[1]).max(1e-12);
    let (s, c) = (d[0] / norm, d[1] / norm);
    uv.iter_mut().for_each(|p| *p = [c * p[0] - s * p[1], s * p[0] + c * p[1]]);
}

impl Chart {
    fn mirror(&self) -> Chart {
        Chart {
            position: self.position.iter().map(|p| Vec3::new(-p.x, p.y, p.z)).collect(),
            triangle: self.triangle.iter().map(|t| [t[0], t[2], t[1]]).collect(),
            uv: self.uv.iter().map(|p| [self.extent[0] - p[0], p[1]]).collect(),
            extent: self.extent,
        }
    }
}

/// Corners of the charts on shelves of the unit square at `scale`, or nothing if they do not fit. Charts come tallest
/// first; a chart goes on the first shelf with room.
fn shelves(charts: &[Chart], order: &[usize], scale: f64) -> Option<Vec<[f64; 2]>> {
    let mut corner = vec![[0.0; 2]; charts.len()];
    // Bottom, height, next free u.
    let mut shelf: Vec<[f64; 3]> = Vec::new();
    let mut top = GAP;
    for &k in order {
        let [w, h] = charts[k].extent.map(|x| x * scale);
        let found = shelf.iter().position(|s| s[2] + w + GAP <= 1.0 && h <= s[1] + 1e-12);
        let at = found.unwrap_or(shelf.len());
        if found.is_none() {
            if top + h + GAP > 1.0 || w + 2.0 * GAP > 1.0 {
                return None;
            }
            shelf.push([top, h, GAP]);
            top += h + GAP;
        }
        corner[k] = [shelf[at][2], shelf[at][0]];
        shelf[at][2] += w + GAP;
    }
    Some(corner)
}

/// Packs the charts at the largest common scale that fits and writes the mesh.
fn pack(charts: &[Chart]) -> Mesh {
    let mut order: Vec<usize> = (0..charts.len()).collect();
    order.sort_by(|&a, &b| charts[b].extent[1].total_cmp(&charts[a].extent[1]).then(a.cmp(&b)));
    let (mut fits, mut fails) = (0.0, 1.0 / charts.iter().map(|c| c.extent[0].max(c.extent[1])).fold(0.0, f64::max));
    for _ in 0..40 {
        let middle = 0.5 * (fits + fails);
        if shelves(charts, &order, middle).is_some() { fits = middle } else { fails = middle }
    }
    let corner = shelves(charts, &order, fits).unwrap_or_default();
    let mut mesh = Mesh::default();
    for (chart, corner) in charts.iter().zip(corner) {
        let first = mesh.position.len() as u32;
        mesh.position.extend(chart.position.iter().map(|p| [p.x, p.y, p.z]));
        for t in &chart.triangle {
            mesh.face.push(mesh.triangle.len() as u32);
            mesh.triangle.push(t.map(|v| first + v));
            mesh.corner_uv.push(t.map(|v| {
                let uv = chart.uv[v as usize];
                [(corner[0] + uv[0] * fits) as f32, (corner[1] + uv[1] * fits) as f32]
            }));
        }
    }
    mesh
}
