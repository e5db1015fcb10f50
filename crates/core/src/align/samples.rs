//! Model points, and the nearest of them to a contact point.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::tree::{Tree, Two};
use crate::tool::ToolModel;

/// Model that the lab's loop compares with: points of the surface, meters, object frame, as seen along the closing axis.
#[derive(Debug)]
pub struct LabModel {
    points: Vec<DVec2>,
    tree: Tree<2>,
}

impl LabModel {
    /// The tool's, made at the first request and kept with it.
    pub fn of(tool: &ToolModel) -> Arc<Self> {
        tool.derived(|tool| Self::new(&tool.surface().iter().map(|(p, _)| *p).collect::<Vec<_>>()))
    }

    /// From points of the surface, meters, object frame. Those that are not finite are left out.
    pub fn new(points: &[DVec3]) -> Self {
        // A NaN would make every comparison, and so the tree, meaningless.
        let finite = points.iter().filter(|p| p.is_finite());
        let points: Vec<DVec2> = finite.map(|p| DVec2::new(p.y, p.z)).collect();
        Self { tree: Tree::new(&points.iter().map(DVec2::to_array).collect::<Vec<_>>()), points }
    }

    pub(super) fn len(&self) -> usize {
        self.points.len()
    }

    /// A point, (y, z), meters, object frame.
    pub(super) fn point(&self, item: u32) -> DVec2 {
        self.points[item as usize]
    }

    /// The nearest point and how much farther the second nearest is, meters. `p` must be finite; the list not empty.
    pub(super) fn nearest(&self, p: DVec2) -> (u32, f64) {
        let Two { items, squared } = self.tree.two_nearest(&p.to_array());
        (items[0], squared[1].sqrt() - squared[0].sqrt())
    }
}

/// Nearest model points of a moving set of contacts. A contact is looked up again only once it has moved far enough
/// for another model point to come nearer: half of the second nearest's lead at the last look-up. The answers are
/// those of a full search.
#[derive(Debug)]
pub(super) struct Matcher {
    nearest: Vec<u32>,
    at: Vec<DVec2>,
    slack: Vec<f64>,
    /// Questions to the tree.
    pub(super) lookups: usize,
}

impl Matcher {
    pub(super) fn new(count: usize) -> Self {
        Self { nearest: vec![u32::MAX; count], at: vec![DVec2::ZERO; count], slack: vec![-1.0; count], lookups: 0 }
    }

    /// The model point nearest to contact `i`, now at `p` in the object frame, and whether it is another than before.
    #[inline]
    pub(super) fn find(&mut self, model: &LabModel, i: usize, p: DVec2) -> (u32, bool) {
        let before = self.nearest[i];
        let slack = self.slack[i];
        if slack > 0.0 && p.distance_squared(self.at[i]) < slack * slack {
            return (before, false);
        }
        let (item, lead) = model.nearest(p);
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
        fn the_matcher_equals_a_full_search(seed in 0u64..50) {
            let yz = |count, seed| cross().sample_surface(count, seed).iter().map(|p| DVec2::new(p.y, p.z)).collect::<Vec<_>>();
            let model = LabModel::new(&cross().sample_surface(300, seed));
            let mut matcher = Matcher::new(40);
            let (points, start) = (yz(300, seed), yz(40, seed + 1000));
            for step in 0..30 {
                let shift = DVec2::new(0.7, -0.4) * 1e-5 * 1.4f64.powi(step);
                for (i, p) in start.iter().enumerate() {
                    let p = *p + shift;
                    let (item, _) = matcher.find(&model, i, p);
                    let best = points.iter().map(|m| (*m - p).length()).fold(f64::INFINITY, f64::min);
                    prop_assert!(((model.point(item) - p).length() - best).abs() < 1e-12);
                }
            }
            prop_assert!(matcher.lookups < 40 * 30, "the shortcut was never taken");
        }
    }

    /// Trees of other kinds panic when too many points share a coordinate, or answer for points that are not there.
    #[test]
    fn axis_aligned_coincident_and_broken_points_are_taken() {
        let bar = cuboid(DVec3::ZERO, DVec3::new(0.003, 0.003, 0.03)).sample_surface(5000, 1);
        let bar = LabModel::new(&bar);
        assert!(bar.point(bar.nearest(DVec2::ZERO).0).length() < 0.002);
        let same = LabModel::new(&[DVec3::splat(0.01); 5000]);
        assert_eq!(same.nearest(DVec2::ZERO).1, 0.0);
        assert!(LabModel::new(&[]).points.is_empty() && LabModel::new(&[DVec3::NAN; 9]).points.is_empty());
        let one = LabModel::new(&[DVec3::Y]);
        assert_eq!(one.nearest(DVec2::ZERO), (0, f64::INFINITY));
    }
}
