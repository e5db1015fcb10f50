//! [`Difference`]: one method less another on the same grasps.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};

use super::columns::{COLUMNS, Of};
use super::{Column, Estimate, GraspScore, Group, Scores, by_tool, estimate, groups_of};

/// The figures of one method less those of another, over the grasps that both have.
///
/// The hardness of a grasp is the same for both, so these intervals are narrower than those of the two rows. One without 0
/// in it tells the methods apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The method that is taken away.
    pub from: String,
    /// The method that it is taken from.
    pub to: String,
    /// One per column group with grasps in common.
    pub groups: Vec<GroupDifference>,
}

/// The differences in one column group.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupDifference {
    /// The column group.
    pub group: Group,
    /// Tools averaged over.
    pub tools: usize,
    /// Grasps that both methods have.
    pub grasps: usize,
    /// By the column's name in files. Columns of a whole group, such as the Fréchet distance, have none.
    #[serde(flatten, serialize_with = "by_column")]
    pub figures: BTreeMap<&'static str, Estimate>,
}

impl GroupDifference {
    /// The difference in a column.
    pub fn get(&self, column: &Column) -> Option<Estimate> {
        self.figures.get(column.key).copied()
    }
}

fn by_column<S: Serializer>(figures: &BTreeMap<&'static str, Estimate>, to: S) -> Result<S::Ok, S::Error> {
    let known = COLUMNS.iter().filter_map(|column| Some((column.key, figures.get(column.key)?)));
    to.collect_map(known)
}

/// `to` less `from` on the grasps that both have, by name: figures of each tool, then the mean over the tools; the grasps
/// are drawn again within each tool, the same for both methods. `None` without a grasp in common.
pub fn difference(from: &Scores, to: &Scores, resamples: usize) -> Option<Difference> {
    let before: BTreeMap<&str, &GraspScore> = from.grasps.iter().map(|grasp| (grasp.pair.as_str(), grasp)).collect();
    let both: Vec<(&GraspScore, &GraspScore)> =
        to.grasps.iter().filter_map(|after| Some((*before.get(after.pair.as_str())?, after))).collect();
    let of_group = |group: Group| {
        let both: Vec<_> = both.iter().copied().filter(|(_, after)| after.group == group).collect();
        let tools = by_tool(&both, |(_, after)| after);
        let less = |of: fn(&[&GraspScore]) -> Option<f64>| {
            let figure = |pairs: &[(&GraspScore, &GraspScore)]| {
                let (before, after): (Vec<_>, Vec<_>) = pairs.iter().copied().unzip();
                Some(of(&after)? - of(&before)?)
            };
            estimate(&tools, figure, resamples)
        };
        let figure = |column: &Column| match column.of {
            Of::Tool(of) => less(of),
            Of::Group(_) | Of::Published => None,
        };
        let figures = COLUMNS.iter().filter_map(|column| Some((column.key, figure(column)?))).collect();
        GroupDifference { group, tools: tools.len(), grasps: both.len(), figures }
    };
    let groups: Vec<_> = groups_of(both.iter().map(|(_, after)| *after)).into_iter().map(of_group).collect();
    (!groups.is_empty()).then(|| Difference { from: from.method.clone(), to: to.method.clone(), groups })
}

#[cfg(test)]
mod tests {
    use super::super::tests::grasp;
    use super::*;

    #[test]
    fn a_difference_is_of_the_same_grasps_and_surer_than_its_rows() {
        // Grasps of very different hardness; the second method is 0.5 to 0.7 degrees worse in each.
        let scores = |method: &str, more: f64, grasps: std::ops::Range<u32>| Scores {
            method: method.to_owned(),
            upper_bound: false,
            grasps: grasps
                .map(|n| {
                    let angle = f64::from(n % 7) * 2.0 + more * (1.0 + 0.2 * f64::from(n % 3));
                    let mut one = grasp(if n % 2 == 0 { "a" } else { "b" }, Group::SeenTools, 0.00225, angle);
                    one.pair = format!("grasp {n}");
                    one
                })
                .collect(),
            measured_features: Vec::new(),
        };
        let (a, b) = (scores("a", 0.0, 0..40), scores("b", 0.5, 0..44));
        let found = difference(&a, &b, 400).unwrap();
        let group = &found.groups[0];
        assert_eq!((found.from.as_str(), found.to.as_str(), group.tools, group.grasps), ("a", "b", 2, 40));
        let angle = group.figures["angle_deg"];
        let [low, high] = angle.interval.unwrap();
        assert!(0.5 < low && low <= angle.value && angle.value <= high && high < 0.7, "{angle:?}");
        let row = super::super::row(&b, &[Group::SeenTools], 400).groups[0].named("angle_deg").unwrap();
        let [from, to] = row.interval.unwrap();
        assert!(high - low < 0.1 * (to - from), "paired {low} {high}, of the row {from} {to}");
        // Images are the same.
        assert_eq!(group.figures["psnr_db"].value, 0.0);
        let back = difference(&b, &a, 400).unwrap().groups[0].figures["angle_deg"];
        assert!((back.value + angle.value).abs() < 1e-12);
        assert!(!group.figures.contains_key("frechet"));
        assert_eq!(difference(&a, &scores("c", 0.0, 50..60), 10), None, "no grasp in common");
        let json = serde_json::to_value(&found).unwrap();
        assert_eq!(json["groups"][0]["angle_deg"]["value"], angle.value);
    }
}
