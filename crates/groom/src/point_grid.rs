//! Points of a surface in a hashed grid: is anything closer than this?

use pelage_geom::NONE;

/// One point.
#[derive(Clone, Copy)]
struct Node {
    position: [f32; 3],
    /// Next point in the same slot.
    next: u32,
    /// Unit normal of the surface there.
    normal: [f32; 3],
}

/// Points with normals in cubes of side `cell`, hashed. Points whose normals are more than 90 degrees apart do not see
/// each other: they lie on different sides of something thin.
pub(crate) struct PointGrid {
    cell: f32,
    mask: u32,
    head: Vec<u32>,
    node: Vec<Node>,
}

impl PointGrid {
    pub fn new() -> Self {
        PointGrid { cell: 1.0, mask: 0, head: vec![NONE], node: Vec::new() }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.node.len()
    }

    /// Sets the side of the cubes and makes room for `count` points.
    pub fn resize(&mut self, cell: f32, count: usize) {
        self.cell = cell;
        let slots = (2 * count).next_power_of_two();
        self.mask = (slots - 1) as u32;
        self.head.clear();
        self.head.resize(slots, NONE);
        for i in 0..self.node.len() {
            self.link(i as u32);
        }
    }

    pub fn push(&mut self, position: [f32; 3], normal: [f32; 3]) {
        self.node.push(Node { position, next: NONE, normal });
        self.link(self.node.len() as u32 - 1);
    }

    fn link(&mut self, i: u32) {
        let [x, y, z] = self.cube(self.node[i as usize].position);
        let slot = (row(y, z).wrapping_add(x as u32) & self.mask) as usize;
        self.node[i as usize].next = self.head[slot];
        self.head[slot] = i;
    }

    fn cube(&self, p: [f32; 3]) -> [i32; 3] {
        p.map(|x| (x / self.cell).floor() as i32)
    }

    /// Squared distance to the nearest point of the same side, among points number `since` and later; at most the
    /// squared side of a cube. Gives up with any value <= `enough` as soon as one is found that near.
    pub fn nearest(&self, p: [f32; 3], normal: [f32; 3], enough: f32, since: u32) -> f32 {
        let [x, y, z] = self.cube(p);
        let mut best = self.cell * self.cell;
        // Rows of three neighbouring slots, the middle one first.
        for (dy, dz) in [(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-1, 1)] {
            let r = row(y + dy, z + dz);
            for dx in [0, 1, -1] {
                let mut i = self.head[(r.wrapping_add((x + dx) as u32) & self.mask) as usize];
                // Lists run from the newest point to the oldest.
                while i != NONE && i >= since {
                    let n = &self.node[i as usize];
                    let d: [f32; 3] = std::array::from_fn(|k| n.position[k] - p[k]);
                    let d2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                    if d2 < best {
                        let same = n.normal[0] * normal[0] + n.normal[1] * normal[1] + n.normal[2] * normal[2];
                        if same > 0.0 {
                            best = d2;
                            if best <= enough {
                                return best;
                            }
                        }
                    }
                    i = n.next;
                }
            }
        }
        best
    }
}

/// Slot of cube (0, y, z); the cubes of a row follow each other.
fn row(y: i32, z: i32) -> u32 {
    (y as u32).wrapping_mul(0x9e37_79b1).wrapping_add((z as u32).wrapping_mul(0x85eb_ca77))
}
