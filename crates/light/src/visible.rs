//! What a camera can't see: balls around hairs that are out of the picture, or behind the skin.
//!
//! Both answers err on the side of seeing. A ball is out of the picture if it is wholly beyond one of its borders, and hidden if
//! the skin is nearer than all of the ball on all of the pixels that it may cover and on those around them (a pyramid of largest
//! depths, Greene, Kass and Miller 1993). Gaps of the skin narrower than a pixel are not seen through.

use crate::camera::{Camera, View};
use pelage_geom::Vec3;

/// What is seen of a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// It may be seen.
    Seen,
    /// It is out of the picture.
    Outside,
    /// It is behind the skin.
    Hidden,
}

/// Depths of a skin as a camera sees it.
#[derive(Clone, Debug)]
pub struct Depths {
    view: View,
    /// Columns and rows of the picture.
    size: [usize; 2],
    /// From the picture's pixels on, each level half as fine: depth of the skin at the pixels' centres, infinite without one;
    /// then the largest of up to four of the level before.
    level: Vec<(usize, Vec<f32>)>,
}

impl Depths {
    /// Draws the depths of a skin (vertices in scene units) for a picture of `size` = columns and rows. Triangles that come
    /// nearer than the camera's near plane hide nothing.
    pub fn new(camera: &Camera, size: [usize; 2], position: &[[f64; 3]], triangle: &[[u32; 3]]) -> Depths {
        let size = size.map(|s| s.max(1));
        let view = camera.view(size[0], size[1]);
        let mut depth = vec![f32::INFINITY; size[0] * size[1]];
        let corner: Vec<Option<[f64; 3]>> = position.iter().map(|p| view.project(Vec3::from(*p))).collect();
        for t in triangle {
            if let [Some(a), Some(b), Some(c)] = t.map(|v| corner[v as usize]) {
                draw(&mut depth, size, view.parallel, [a, b, c]);
            }
        }
        let mut level = vec![(size[0], depth)];
        while level.last().is_some_and(|(_, d)| d.len() > 1) {
            let (columns, fine) = level.last().expect("the picture");
            level.push(halved(*columns, fine));
        }
        Depths { view, size, level }
    }

    /// What is seen of a ball; scene units.
    pub fn sight(&self, centre: Vec3, radius: f64) -> Sight {
        let c = self.view.to_camera(centre);
        if !(c.iter().all(|x| x.is_finite()) && radius.is_finite()) {
            return Sight::Seen;
        }
        if c.z + radius < self.view.near {
            return Sight::Outside;
        }
        let near = c.z - radius;
        if near < self.view.near {
            // It reaches round the eye: only the borders' planes can tell.
            return if self.beyond(c, radius) { Sight::Outside } else { Sight::Seen };
        }
        let mut range = [[0usize; 2]; 2];
        for i in 0..2 {
            let ends = [c[i] - radius, c[i] + radius];
            let at = |x: f64, z: f64| self.view.centre[i] + x * self.view.scale(z);
            let far = c.z + radius;
            let low = at(ends[0], near).min(at(ends[0], far)).floor() - 1.0;
            let high = at(ends[1], near).max(at(ends[1], far)).ceil() + 1.0;
            let most = self.size[i] as f64;
            if high <= 0.0 || low >= most {
                return Sight::Outside;
            }
            range[i] = [low.max(0.0) as usize, high.min(most) as usize];
        }
        if self.beyond(c, radius) {
            return Sight::Outside;
        }
        if self.farthest(range) < near { Sight::Hidden } else { Sight::Seen }
    }

    /// True if a ball in camera space is wholly beyond a border of the picture.
    fn beyond(&self, c: Vec3, radius: f64) -> bool {
        (0..2).any(|i| {
            let half = self.view.centre[i] / self.view.focal;
            let distance = match self.view.parallel {
                true => c[i].abs() - half,
                // The border's plane goes through the eye.
                false => (c[i].abs() - half * c.z) / libm::sqrt(1.0 + half * half),
            };
            distance > radius
        })
    }

    /// Largest depth in a range of columns and a range of rows, ends not included; a little more than asked for counts too.
    fn farthest(&self, [columns, rows]: [[usize; 2]; 2]) -> f64 {
        let longest = (columns[1] - columns[0]).max(rows[1] - rows[0]);
        // Three or four cells a side.
        let l = (longest.next_power_of_two().trailing_zeros() as usize).saturating_sub(2).min(self.level.len() - 1);
        let (width, depth) = &self.level[l];
        let mut most = 0.0f32;
        for y in rows[0] >> l..=(rows[1] - 1) >> l {
            for x in columns[0] >> l..=(columns[1] - 1) >> l {
                most = most.max(depth[y * width + x]);
            }
        }
        f64::from(most)
    }

    /// Pixels that something of a `width` is wide where a ball is nearest to the eye; scene units.
    pub fn pixels(&self, centre: Vec3, radius: f64, width: f64) -> f64 {
        let depth = (self.view.to_camera(centre).z - radius).max(self.view.near);
        width * self.view.scale(depth)
    }
}

/// The next level: the largest of squares of four.
fn halved(columns: usize, fine: &[f32]) -> (usize, Vec<f32>) {
    let rows = fine.len() / columns;
    let (w, h) = (columns.div_ceil(2), rows.div_ceil(2));
    let at = |x: usize, y: usize| fine[y.min(rows - 1) * columns + x.min(columns - 1)];
    let most = |k: usize| {
        let (x, y) = (2 * (k % w), 2 * (k / w));
        at(x, y).max(at(x + 1, y)).max(at(x, y + 1)).max(at(x + 1, y + 1))
    };
    (w, (0..w * h).map(most).collect())
}

/// Draws a triangle of pixel coordinates and depths into a picture of nearest depths.
fn draw(depth: &mut [f32], size: [usize; 2], parallel: bool, p: [[f64; 3]; 3]) {
    let edge = |a: [f64; 3], b: [f64; 3], x: f64, y: f64| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
    let area = edge(p[0], p[1], p[2][0], p[2][1]);
    if area == 0.0 || !area.is_finite() {
        return;
    }
    // Depth is linear in a parallel picture, one over it in perspective.
    let value = p.map(|c| if parallel { c[2] } else { 1.0 / c[2] });
    let span = |i: usize| {
        let (low, high) = p.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(c[i]), h.max(c[i])));
        (low - 0.5).ceil().max(0.0) as usize..((high - 0.5).floor() + 1.0).clamp(0.0, size[i] as f64) as usize
    };
    for y in span(1) {
        for x in span(0) {
            let (px, py) = (x as f64 + 0.5, y as f64 + 0.5);
            let w: [f64; 3] = std::array::from_fn(|k| edge(p[(k + 1) % 3], p[(k + 2) % 3], px, py) / area);
            if w.iter().all(|w| *w >= 0.0) {
                let v: f64 = w.iter().zip(value).map(|(w, v)| w * v).sum();
                let z = if parallel { v } else { 1.0 / v };
                let at = &mut depth[y * size[0] + x];
                *at = at.min(z as f32);
            }
        }
    }
}
