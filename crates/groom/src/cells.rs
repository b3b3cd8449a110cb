//! Points in cubic cells, for what is near a point.

use pelage_geom::Vec3;
use std::collections::BTreeMap;

/// Points, numbered as they come.
pub(crate) struct Cells {
    size: f64,
    count: usize,
    cell: BTreeMap<[i64; 3], Vec<(usize, Vec3)>>,
}

impl Cells {
    /// `size` is the largest radius that will be asked for.
    pub fn new(size: f64) -> Self {
        Cells { size: size.max(f64::MIN_POSITIVE), count: 0, cell: BTreeMap::new() }
    }

    fn key(&self, p: Vec3) -> [i64; 3] {
        [p.x, p.y, p.z].map(|x| (x / self.size).floor() as i64)
    }

    /// Adds a point; its number is how many came before it.
    pub fn insert(&mut self, p: Vec3) {
        self.cell.entry(self.key(p)).or_default().push((self.count, p));
        self.count += 1;
    }

    /// All points within the radius, and some beyond, each with its number. Their order follows from the points alone.
    pub fn near(&self, p: Vec3) -> impl Iterator<Item = (usize, Vec3)> + '_ {
        let [x, y, z] = self.key(p);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
        around
            .map(move |[i, j, k]| [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)])
            .filter_map(|c| self.cell.get(&c))
            .flatten()
            .copied()
    }

    /// True if a point is within a radius of `p`.
    pub fn any_within(&self, p: Vec3, radius: f64) -> bool {
        self.near(p).any(|(_, q)| (q - p).norm() <= radius)
    }
}
