//! Model points, and the nearest of them to a contact point.

use std::sync::Arc;

use glam::DVec3;

use super::tree::{Tree, Two};

#[derive(Debug)]
enum Index {
    /// Over y and z alone.
    Plane(Tree<2>),
    Space(Tree<3>),
}

/// Points, meters, object frame, under a k-d tree.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    points: Arc<[DVec3]>,
    index: Arc<Index>,
}

impl Samples {
    /// Compares in all three coordinates. Points that are not finite are left out.
    pub(super) fn in_space(points: &[DVec3]) -> Self {
        Self::new(points, |points| Index::Space(Tree::new(&points.iter().map(DVec3::to_array).collect::<Vec<_>>())))
    }

    /// Compares in y and z only. Points that are not finite are left out.
    pub(super) fn in_plane(points: &[DVec3]) -> Self {
        Self::new(points, |points| Index::Plane(Tree::new(&points.iter().map(|p| [p.y, p.z]).collect::<Vec<_>>())))
    }

    fn new(points: &[DVec3], index: impl Fn(&[DVec3]) -> Index) -> Self {
        // A NaN would make every comparison, and so the tree, meaningless.
        let points: Arc<[DVec3]> = points.iter().copied().filter(|p| p.is_finite()).collect();
        Self { index: Arc::new(index(&points)), points }
    }

    /// A point, meters, object frame.
    pub(super) fn point(&self, item: u32) -> DVec3 {
        self.points[item as usize]
    }

    /// The nearest point and how much farther the second nearest is, meters. `p` must be finite; the list not empty.
    pub(super) fn nearest(&self, p: DVec3) -> (u32, f64) {
        let Two { items, squared } = match &*self.index {
            Index::Plane(tree) => tree.two_nearest(&[p.y, p.z]),
            Index::Space(tree) => tree.two_nearest(&p.to_array()),
        };
        (items[0], squared[1].sqrt() - squared[0].sqrt())
    }
}

/// Nearest model points of a moving set of contacts. A contact is looked up again only once it has moved far enough
/// for another model point to come nearer: half of the second nearest's lead at the last look-up. The answers are
/// those of a full search.
#[derive(Debug)]
pub(super) struct Matcher {
    nearest: Vec<u32>,
    at: Vec<DVec3>,
    slack: Vec<f64>,
    /// Questions to the tree.
    pub(super) lookups: usize,
}

impl Matcher {
    pub(super) fn new(count: usize) -> Self {
        Self { nearest: vec![u32::MAX; count], at: vec![DVec3::ZERO; count], slack: vec![-1.0; count], lookups: 0 }
    }

    /// The model point nearest to contact `i`, now at `p` in the object frame, and whether it is another than before.
    #[inline]
    pub(super) fn find(&mut self, samples: &Samples, i: usize, p: DVec3) -> (u32, bool) {
        let before = self.nearest[i];
        let slack = self.slack[i];
        if slack > 0.0 && p.distance_squared(self.at[i]) < slack * slack {
            return (before, false);
        }
        let (item, lead) = samples.nearest(p);
        self.lookups += 1;
        self.nearest[i] = item;
        self.at[i] = p;
        // A little less than half, so that rounding never decides.
        self.slack[i] = 0.4999 * lead;
        (item, item != before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::align::testing::{cross, cuboid};
    use proptest::prelude::*;

    proptest! {
        /// A walk of small and large steps: the shortcut must give what a search of all points gives.
        #[test]
        fn the_matcher_equals_a_full_search(seed in 0u64..50, flat in proptest::bool::ANY) {
            let points = cross().sample_surface(300, seed);
            let samples = if flat { Samples::in_plane(&points) } else { Samples::in_space(&points) };
            let mut matcher = Matcher::new(40);
            let start = cross().sample_surface(40, seed + 1000);
            for step in 0..30 {
                let shift = DVec3::new(0.1, 0.7, -0.4) * 1e-5 * 1.4f64.powi(step);
                for (i, p) in start.iter().enumerate() {
                    let p = *p + shift;
                    let (item, _) = matcher.find(&samples, i, p);
                    let cut = |d: DVec3| if flat { d.with_x(0.0) } else { d }.length();
                    let best = points.iter().map(|m| cut(*m - p)).fold(f64::INFINITY, f64::min);
                    prop_assert!((cut(samples.point(item) - p) - best).abs() < 1e-12);
                }
            }
            prop_assert!(matcher.lookups < 40 * 30, "the shortcut was never taken");
        }
    }

    /// Trees of other kinds panic when too many points share a coordinate, or answer for points that are not there.
    #[test]
    fn axis_aligned_coincident_and_broken_points_are_taken() {
        let bar = cuboid(DVec3::ZERO, DVec3::new(0.003, 0.003, 0.03)).sample_surface(5000, 1);
        for samples in [Samples::in_space(&bar), Samples::in_plane(&bar)] {
            let (item, _) = samples.nearest(DVec3::new(0.003, 0.0, 0.0));
            assert!(samples.point(item).with_x(0.0).length() < 0.002);
        }
        let same = Samples::in_space(&[DVec3::splat(0.01); 5000]);
        assert_eq!(same.nearest(DVec3::ZERO).1, 0.0);
        assert!(Samples::in_space(&[]).points.is_empty() && Samples::in_plane(&[DVec3::NAN; 9]).points.is_empty());
        let one = Samples::in_plane(&[DVec3::Y]);
        assert_eq!(one.nearest(DVec3::ZERO), (0, f64::INFINITY));
    }
}
