//! A k-d tree that answers with the two nearest points: the nearest, and the one whose lead decides how long it stays
//! the nearest. (The general tree of the `kiddo` crate takes some twenty times as long for two as for one.)

/// Points in a leaf: few enough that a leaf is one look, many enough that the tree stays small.
const LEAF: usize = 8;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// Coordinate that is split, or `K` in a leaf.
    axis: u32,
    /// Right child of an inner node (the left one follows it).
    right: u32,
    start: u32,
    end: u32,
    /// Largest coordinate on the left and smallest on the right: nothing lies between.
    low: f64,
    high: f64,
}

/// Up to `u32::MAX` points with finite coordinates. Equal coordinates, equal points and no points at all are fine.
#[derive(Clone, Debug)]
pub(super) struct Tree<const K: usize> {
    nodes: Vec<Node>,
    points: Vec<[f64; K]>,
    items: Vec<u32>,
}

/// The two nearest points, squared distances; infinite where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Two {
    pub(super) items: [u32; 2],
    pub(super) squared: [f64; 2],
}

impl Two {
    fn take(&mut self, item: u32, squared: f64) {
        if squared < self.squared[0] {
            self.items = [item, self.items[0]];
            self.squared = [squared, self.squared[0]];
        } else if squared < self.squared[1] {
            (self.items[1], self.squared[1]) = (item, squared);
        }
    }
}

impl<const K: usize> Tree<K> {
    pub(super) fn new(points: &[[f64; K]]) -> Self {
        let mut items: Vec<u32> = (0..points.len() as u32).collect();
        let mut nodes = Vec::with_capacity(points.len() / LEAF * 4 + 1);
        if !items.is_empty() {
            build(&mut nodes, points, &mut items, 0);
        }
        Self { nodes, points: items.iter().map(|&i| points[i as usize]).collect(), items }
    }

    /// The two points nearest to `p`, which must be finite; the first found where equally near.
    pub(super) fn two_nearest(&self, p: &[f64; K]) -> Two {
        let mut best = Two { items: [0; 2], squared: [f64::INFINITY; 2] };
        if !self.nodes.is_empty() {
            self.descend(0, p, 0.0, &mut [0.0; K], &mut best);
        }
        best
    }

    /// `offset`: how far `p` is outside the node's region along each axis; `gap`: the sum of their squares.
    fn descend(&self, at: usize, p: &[f64; K], gap: f64, offset: &mut [f64; K], best: &mut Two) {
        let node = &self.nodes[at];
        let axis = node.axis as usize;
        if axis >= K {
            for i in node.start as usize..node.end as usize {
                let q = &self.points[i];
                let squared: f64 = (0..K).map(|k| (q[k] - p[k]) * (q[k] - p[k])).sum();
                best.take(self.items[i], squared);
            }
            return;
        }
        let (left, right) = (at + 1, node.right as usize);
        // Outside the gap between the children the nearer one is clear; within it, either is fine to begin with.
        let (near, far, way) = if p[axis] - node.low < node.high - p[axis] {
            (left, right, node.high - p[axis])
        } else {
            (right, left, p[axis] - node.low)
        };
        self.descend(near, p, gap, offset, best);
        let before = offset[axis];
        let way = way.max(before);
        let farther = gap - before * before + way * way;
        if farther < best.squared[1] {
            offset[axis] = way;
            self.descend(far, p, farther, offset, best);
            offset[axis] = before;
        }
    }
}

fn build<const K: usize>(nodes: &mut Vec<Node>, points: &[[f64; K]], items: &mut [u32], start: usize) {
    let at = nodes.len();
    let end = (start + items.len()) as u32;
    nodes.push(Node { axis: K as u32, right: 0, start: start as u32, end, low: 0.0, high: 0.0 });
    if items.len() <= LEAF {
        return;
    }
    let extent = |axis: usize| {
        let values = items.iter().map(|&i| points[i as usize][axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        high - low
    };
    let axis = (0..K).max_by(|&a, &b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
    let key = |item: &u32| points[*item as usize][axis];
    let middle = items.len() / 2;
    // By position in the list, not by value: equal coordinates split evenly too.
    items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    let (left, right) = items.split_at_mut(middle);
    let low = left.iter().map(key).fold(f64::NEG_INFINITY, f64::max);
    let high = right.iter().map(key).fold(f64::INFINITY, f64::min);
    build(nodes, points, left, start);
    let child = nodes.len() as u32;
    build(nodes, points, right, start + middle);
    let node = &mut nodes[at];
    (node.axis, node.right, node.low, node.high) = (axis as u32, child, low, high);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute(points: &[[f64; 3]], p: &[f64; 3]) -> Two {
        let mut best = Two { items: [0; 2], squared: [f64::INFINITY; 2] };
        for (i, q) in points.iter().enumerate() {
            best.take(i as u32, (0..3).map(|k| (q[k] - p[k]).powi(2)).sum());
        }
        best
    }

    proptest! {
        /// Coordinates from a coarse lattice, so that many are equal.
        #[test]
        fn finds_what_looking_at_all_finds(
            cells in proptest::collection::vec(proptest::array::uniform3(0i32..6), 0..120),
            queries in proptest::collection::vec(proptest::array::uniform3(-3.0..9.0f64), 20),
        ) {
            let points: Vec<[f64; 3]> = cells.iter().map(|c| c.map(f64::from)).collect();
            let tree = Tree::new(&points);
            for p in &queries {
                let (found, all) = (tree.two_nearest(p), brute(&points, p));
                prop_assert_eq!(found.squared, all.squared);
                if all.squared[0] < f64::INFINITY {
                    let q = points[found.items[0] as usize];
                    prop_assert_eq!((0..3).map(|k| (q[k] - p[k]).powi(2)).sum::<f64>(), all.squared[0]);
                }
            }
        }
    }
}
