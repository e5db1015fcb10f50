//! The built-in data sets: the simulator behind the face of a data set. A sample is rendered when it is asked for, so
//! nothing large ships; the same name is the same sample on every machine.

use touch2touch_core::catalog::{self, ToolSpec};
use touch2touch_core::dataset::{PairEntry, PairId, Split};
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::sample::Sample;
use touch2touch_core::sim::{self, Condition, SimConfig};

/// Grasps of each tool in the demo.
const DEMO_GRASPS: u64 = 24;
/// The name of the plain test set; `test-set-CONDITION` names the others.
const TEST_SET: &str = "test-set";

/// A data set that needs no files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuiltIn {
    /// 24 grasps of each tool.
    Demo,
    /// As the paper's: 46 grasps of each of nine seen and three unseen tools, none of them trained on.
    TestSet(Condition),
}

impl BuiltIn {
    /// The data set of a name: `demo`, `test-set`, `test-set-ambiguous`, `-mixed`, `-misaligned` or `-noise`.
    pub fn named(name: &str) -> Option<Self> {
        match name.strip_prefix(TEST_SET) {
            Some("") => Some(Self::TestSet(Condition::Plain)),
            Some(rest) => rest.strip_prefix('-')?.parse().ok().map(Self::TestSet),
            None => (name == "demo").then_some(Self::Demo),
        }
    }

    /// The name that opens it.
    pub fn name(self) -> String {
        match self {
            Self::Demo => "demo".into(),
            Self::TestSet(Condition::Plain) => TEST_SET.into(),
            Self::TestSet(condition) => format!("{TEST_SET}-{}", condition.key()),
        }
    }

    /// Title for people.
    pub fn title(self) -> String {
        match self {
            Self::Demo => "Demo".into(),
            Self::TestSet(Condition::Plain) => "Test set".into(),
            Self::TestSet(condition) => format!("Test set ({})", condition.key()),
        }
    }

    fn grasps(self) -> u64 {
        match self {
            Self::Demo => DEMO_GRASPS,
            Self::TestSet(_) => sim::TEST_GRASPS,
        }
    }

    /// The tool of grasp `number` of tool `at` of the simulator's list.
    fn tool(self, at: usize, number: u64) -> Option<ToolSpec> {
        let tool = catalog::tools().get(at)?;
        Some(match self {
            Self::Demo => tool.clone(),
            Self::TestSet(condition) => condition.tool(tool, number),
        })
    }

    /// The pairs; in the demo unseen tools are of [`Split::Test`], in a test set all are.
    pub(super) fn pairs(self) -> Vec<PairEntry> {
        let one = |at: usize, number: u64| {
            let tool = self.tool(at, number)?;
            let split = if self == Self::Demo && tool.seen { Split::Train } else { Split::Test };
            Some(PairEntry { name: format!("{}/data_{number}", tool.name), tool: Some(tool.name), split, number })
        };
        (0..catalog::tools().len()).flat_map(|at| (0..self.grasps()).filter_map(move |n| one(at, n))).collect()
    }

    /// Renders a pair, or the first finger's bubble alone; `None` beyond the last.
    pub(super) fn load(self, id: PairId, first_bubble_alone: bool) -> Option<Sample> {
        let config = &SimConfig { first_bubble_alone, ..SimConfig::default() };
        let id = u64::from(id.0);
        let (at, number) = (usize::try_from(id / self.grasps()).ok()?, id % self.grasps());
        let tool = self.tool(at, number)?;
        Some(match self {
            Self::Demo => {
                // Grasps and noise of the demo are drawn from seeds of their own.
                let seed = 0x00de_3000 + id;
                sim::simulate(&tool, sim::random_grasp(seed), seed, config)
            }
            Self::TestSet(condition) => {
                let (grasp, seed) = sim::test_grasp(at, number);
                condition.simulate(&tool, grasp, seed, config)
            }
        })
    }
}

/// The CAD model of a tool of the catalog.
pub(super) fn mesh(tool: &str) -> Option<TriMesh> {
    let pattern = catalog::tools().iter().find(|t| t.name == catalog::pattern_of(tool))?;
    let spec = if pattern.name == tool { pattern.clone() } else { catalog::on_a_shaft(pattern.clone()) };
    Some(spec.mesh())
}

#[cfg(test)]
mod tests {
    use strum::IntoEnumIterator as _;

    use super::*;
    use touch2touch_core::rig::lab;

    #[test]
    fn every_pair_has_its_tool_and_the_last_one_renders() {
        let sets = std::iter::once(BuiltIn::Demo).chain(Condition::iter().map(BuiltIn::TestSet));
        for set in sets {
            assert_eq!(BuiltIn::named(&set.name()), Some(set));
            let pairs = set.pairs();
            assert_eq!(pairs.len() as u64, set.grasps() * catalog::tools().len() as u64);
            let mut tools: Vec<&str> = pairs.iter().filter_map(|p| p.tool.as_deref()).collect();
            tools.dedup();
            assert!(tools.len() >= 12);
            for tool in tools.iter().rev().take(2) {
                assert!(mesh(tool).is_some(), "{tool}");
            }
            let last = PairId(u32::try_from(pairs.len()).unwrap() - 1);
            let sample = set.load(last, false).unwrap();
            let [right, left] = lab::PADS.map(|pad| sample.pad(pad).unwrap().depth().unwrap());
            let alone = set.load(last, true).unwrap();
            assert_eq!(alone.pad(lab::PADS[0]).unwrap().depth().unwrap().imprint, right.imprint);
            assert!(left.truth.is_some() && alone.pad(lab::LEFT).is_none());
            assert!(set.load(PairId(last.0 + 1), false).is_none());
        }
        for no in ["", "test-set-", "test-set-odd", "test-sets", "Demo"] {
            assert_eq!(BuiltIn::named(no), None, "{no:?}");
        }
    }
}
