//! A tree of boxes in texture space: which hold a point, and which thing is nearest.

/// Boxes a leaf holds at most. Speed alone depends on it.
const LEAF: usize = 4;

type Point = [f32; 2];

#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    low: Point,
    high: Point,
    /// Leaf: first entry of `item`. Else: the second child (the first is the next node).
    next: u32,
    /// Entries of a leaf; 0 for an inner node.
    count: u32,
}

/// Tree over boxes numbered from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BoxTree {
    node: Vec<Node>,
    item: Vec<u32>,
}

impl BoxTree {
    /// Builds over (low, high) corners.
    pub fn new(boxes: &[(Point, Point)]) -> Self {
        let mut tree = BoxTree { node: Vec::new(), item: (0..boxes.len() as u32).collect() };
        if !boxes.is_empty() {
            tree.grow(boxes, 0, boxes.len());
        }
        tree
    }

    fn grow(&mut self, boxes: &[(Point, Point)], begin: usize, end: usize) {
        let items = &mut self.item[begin..end];
        let (mut low, mut high) = boxes[items[0] as usize];
        for b in items.iter().map(|&i| boxes[i as usize]) {
            low = std::array::from_fn(|k| low[k].min(b.0[k]));
            high = std::array::from_fn(|k| high[k].max(b.1[k]));
        }
        let at = self.node.len();
        self.node.push(Node { low, high, next: begin as u32, count: (end - begin) as u32 });
        if end - begin > LEAF {
            let axis = usize::from(high[1] - low[1] > high[0] - low[0]);
            let centre = |i: u32| f64::from(boxes[i as usize].0[axis]) + f64::from(boxes[i as usize].1[axis]);
            items.sort_unstable_by(|&a, &b| centre(a).total_cmp(&centre(b)).then(a.cmp(&b)));
            let middle = (begin + end) / 2;
            self.grow(boxes, begin, middle);
            let second = self.node.len() as u32;
            self.grow(boxes, middle, end);
            (self.node[at].next, self.node[at].count) = (second, 0);
        }
    }

    /// Lowest-numbered item whose box holds `p` and that satisfies `hit`.
    pub fn first_at(&self, p: Point, mut hit: impl FnMut(u32) -> bool) -> Option<u32> {
        let mut best: Option<u32> = None;
        let mut stack = Stack::new(!self.node.is_empty());
        while let Some(n) = stack.pop() {
            let node = &self.node[n as usize];
            if p[0] < node.low[0] || p[0] > node.high[0] || p[1] < node.low[1] || p[1] > node.high[1] {
                continue;
            }
            if node.count == 0 {
                stack.push(node.next);
                stack.push(n + 1);
                continue;
            }
            for &i in &self.item[node.next as usize..(node.next + node.count) as usize] {
                if best.is_none_or(|b| i < b) && hit(i) {
                    best = Some(i);
                }
            }
        }
        best
    }

    /// Item of least `distance2` (squared, never less than that of its box) from `p`; the lowest of equals.
    pub fn nearest(&self, p: Point, mut distance2: impl FnMut(u32) -> f64) -> Option<u32> {
        let mut best: Option<(f64, u32)> = None;
        let gap = |n: u32| {
            let node = &self.node[n as usize];
            let d: [f64; 2] = std::array::from_fn(|k| {
                let x = f64::from(p[k]);
                (f64::from(node.low[k]) - x).max(x - f64::from(node.high[k])).max(0.0)
            });
            // Rounding must not push a box beyond what it holds.
            (d[0] * d[0] + d[1] * d[1]) * (1.0 - 1e-12)
        };
        let mut stack = Stack::new(!self.node.is_empty());
        while let Some(n) = stack.pop() {
            if best.is_some_and(|b| gap(n) > b.0) {
                continue;
            }
            let node = &self.node[n as usize];
            if node.count == 0 {
                let (near, far) = if gap(n + 1) <= gap(node.next) { (n + 1, node.next) } else { (node.next, n + 1) };
                stack.push(far);
                stack.push(near);
                continue;
            }
            for &i in &self.item[node.next as usize..(node.next + node.count) as usize] {
                let d = distance2(i);
                if best.is_none_or(|b| (d, i) < b) {
                    best = Some((d, i));
                }
            }
        }
        best.map(|b| b.1)
    }
}

/// Nodes still to visit. The tree halves its items, so 2^32 of them are 32 levels deep.
struct Stack {
    node: [u32; 64],
    len: usize,
}

impl Stack {
    fn new(root: bool) -> Self {
        Stack { node: [0; 64], len: usize::from(root) }
    }

    fn push(&mut self, n: u32) {
        self.node[self.len] = n;
        self.len += 1;
    }

    fn pop(&mut self) -> Option<u32> {
        self.len = self.len.checked_sub(1)?;
        Some(self.node[self.len])
    }
}
