//! The built-in demo: the simulator behind the face of a dataset. A sample is rendered when it is asked for, so nothing
//! large ships; the same name is the same sample on every machine.

use crate::domain::dataset::{PairEntry, PairId, Split};
use crate::domain::mesh::TriMesh;
use crate::domain::sample::Sample;
use crate::domain::sim::{self, SimConfig};

/// Grasps of each tool.
const GRASPS_PER_TOOL: u64 = 24;

/// The demo's pairs; unseen tools are of [`Split::Test`].
pub(super) fn pairs() -> Vec<PairEntry> {
    sim::tools()
        .iter()
        .flat_map(|tool| {
            (0..GRASPS_PER_TOOL).map(|number| PairEntry {
                name: format!("{}/data_{number}", tool.name),
                tool: Some(tool.name.clone()),
                split: if tool.seen { Split::Train } else { Split::Test },
                number,
            })
        })
        .collect()
}

/// Renders a pair; `None` beyond the last.
pub(super) fn load(id: PairId) -> Option<Sample> {
    let id = u64::from(id.0);
    let tool = sim::tools().get(usize::try_from(id / GRASPS_PER_TOOL).ok()?)?;
    // Grasps and noise of the demo are drawn from seeds of their own.
    let seed = 0x00de_3000 + id;
    Some(sim::simulate(tool, sim::random_grasp(seed), seed, &SimConfig::default()))
}

/// The CAD model of a tool.
pub(super) fn mesh(tool: &str) -> Option<TriMesh> {
    sim::tools().iter().find(|t| t.name == tool).map(sim::ToolSpec::mesh)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::sensor::Finger;

    #[test]
    fn every_pair_has_its_tool_and_the_last_one_renders() {
        let pairs = pairs();
        assert_eq!(pairs.len() as u64, GRASPS_PER_TOOL * sim::tools().len() as u64);
        assert!(pairs.iter().all(|p| mesh(p.tool.as_deref().unwrap()).is_some()));
        let last = PairId(u32::try_from(pairs.len()).unwrap() - 1);
        let sample = load(last).unwrap();
        assert!(sample.finger(Finger::Left).unwrap().bubble.as_ref().unwrap().truth.is_some());
        assert!(load(PairId(last.0 + 1)).is_none());
    }
}
