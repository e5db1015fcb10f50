//! Touches to train on: the catalog's tools and drawn ones, felt by nominal and by drawn sensors.

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::{Condition, SimConfig, random_grasp};
use crate::domain::catalog::{self, ToolSpec};
use crate::domain::sample::Sample;

/// Share of drawn tools in [`Mix::Train`].
const DRAWN_TOOLS: f64 = 0.4;
/// Share of touches by nominal sensors in [`Mix::Train`].
const NOMINAL: f64 = 0.4;

/// What touches are drawn from.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    strum::EnumIter,
    strum::EnumString,
    strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Mix {
    /// The seen tools and drawn ones, most of them stretched and felt by drawn sensors; never an unseen tool.
    #[default]
    Train,
    /// The seen tools, felt by nominal sensors: for validation.
    Seen,
    /// The unseen tools, felt by nominal sensors: for validation.
    Unseen,
}

/// A touch to train on.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Both fingers, both sensors, with the truth.
    pub sample: Sample,
    /// The tool's place in the catalog; `None` for a drawn one.
    pub tool: Option<usize>,
    /// Whether the sensors are the nominal ones and the tool as the catalog has it.
    pub nominal: bool,
}

/// Touch `index` of an endless list that `seed` draws; the same on every machine.
pub fn training_touch(seed: u64, index: u64, mix: Mix, condition: Condition) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(index));
    let catalog = catalog::tools();
    let train = mix == Mix::Train;
    let tool = if train && rng.random_bool(DRAWN_TOOLS) {
        None
    } else {
        let tools: Vec<usize> = (0..catalog.len()).filter(|&i| catalog[i].seen == (mix != Mix::Unseen)).collect();
        Some(tools[rng.random_range(0..tools.len())])
    };
    let nominal = !train || rng.random_bool(NOMINAL);
    let spec = tool.map_or_else(|| catalog::random_tool(rng.random()), |i| catalog[i].clone());
    let spec = if nominal { spec } else { stretched(spec, &mut rng) };
    let config = if nominal { SimConfig::default() } else { SimConfig::randomised(rng.random()) };
    let (grasp, noise) = (random_grasp(rng.random()), rng.random());
    let sample = condition.simulate(&condition.tool(&spec, index), grasp, noise, &config);
    Drawn { sample, tool, nominal }
}

/// The tool with longer bars to the sides and towards the wrist and shorter ones at the tip, as the real tools have.
fn stretched(mut tool: ToolSpec, rng: &mut ChaCha8Rng) -> ToolSpec {
    let side = rng.random_range(1.0..1.6);
    let wrist = rng.random_range(0.95..1.3);
    let tip = rng.random_range(0.15..0.7);
    for p in tool.bars.iter_mut().flat_map(|bar| &mut bar.core) {
        p.x *= side;
        p.y *= if p.y > 0.0 { tip } else { wrist };
    }
    tool
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touch_depends_on_its_place_alone_and_unseen_tools_stay_unseen() {
        let catalog = catalog::tools();
        let drawn: Vec<Drawn> = (0..12).map(|i| training_touch(3, i, Mix::Train, Condition::Plain)).collect();
        assert!(drawn.iter().filter_map(|d| d.tool).all(|tool| catalog[tool].seen));
        assert!(drawn.iter().any(|d| d.tool.is_none()) && drawn.iter().any(|d| d.nominal != drawn[0].nominal));
        let again = training_touch(3, 7, Mix::Train, Condition::Plain);
        assert_eq!(again.sample.grasp_from_object, drawn[7].sample.grasp_from_object);
        assert!(
            drawn[7].sample.grasp_from_object
                != training_touch(4, 7, Mix::Train, Condition::Plain).sample.grasp_from_object
        );
        let unseen = training_touch(3, 0, Mix::Unseen, Condition::Plain);
        assert!(unseen.nominal && !catalog[unseen.tool.unwrap()].seen);
    }
}
