//! Conditions of a pair: what can be wrong with it, after the paper's Table I, for test sets and for training data.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::{Grasp, SimConfig, simulate, simulate_apart};
use crate::catalog::{ToolSpec, on_a_shaft};
use crate::grid::RgbGrid;
use crate::noise::{Noise, Stream};
use crate::rig::lab;
use crate::sample::Sample;

/// Largest distance along y and z between the grasps of a misaligned pair, meters.
pub(crate) const MISALIGNMENT_M: f64 = 0.008;
/// Places of the turned condition, as a multiple of those of the lab's grid.
const TURNED: f64 = 3.0;
/// Standard deviation of the noise on the condition, 0..255 scale, RGB: half that of the lab's difference images.
const NOISE_STD: [f32; 3] = [0.5 * 0.0687 * 255.0, 0.5 * 0.0428 * 255.0, 0.5 * 0.0576 * 255.0];

/// Condition of the pairs of a data set: what is wrong with them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[derive(Serialize, Deserialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Condition {
    /// Nothing: both sensors measured the same grasp of the pattern.
    #[default]
    Plain,
    /// The GelSlims closed on the bare shaft of the tool: they see nothing of its pattern.
    Ambiguous,
    /// Every other pair ambiguous, the rest plain.
    Mixed,
    /// The bubbles grasped up to [`MISALIGNMENT_M`] away along y and z from where the GelSlims did.
    Misaligned,
    /// White noise on the GelSlim image.
    Noise,
    /// Grasps over the full turn and [`TURNED`] times as far off: of a tool that the hand met in any orientation.
    Turned,
}

impl Condition {
    /// The name in commands and files.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// Meaning of the condition, in one line.
    pub fn description(self) -> &'static str {
        match self {
            Self::Plain => "both sensors measured the same grasp of the pattern",
            Self::Ambiguous => "the GelSlims closed on the bare shaft of the tool and see nothing of its pattern",
            Self::Mixed => "every other pair is ambiguous (bare shaft), the rest plain",
            Self::Misaligned => "the bubbles grasped up to 8 mm away along y and z from where the GelSlims did",
            Self::Turned => "the grasps cover the full turn and 15 mm to each side instead of 22.5 degrees and 5 mm",
            Self::Noise => "white noise on the GelSlim image, half as strong as the lab's images vary",
        }
    }

    /// The tool that pair number `index` of `tool` is made with: on a bare shaft where the condition says so.
    pub fn tool(self, tool: &ToolSpec, index: u64) -> ToolSpec {
        let ambiguous = self == Self::Ambiguous || (self == Self::Mixed && index % 2 == 1);
        if ambiguous { on_a_shaft(tool.clone()) } else { tool.clone() }
    }

    /// Both sensors' touch of `tool`, which [`Condition::tool`] gave, at `grasp`; `seed` as for [`simulate`], and for
    /// the offset and the noise of the condition.
    pub fn simulate(self, tool: &ToolSpec, grasp: Grasp, seed: u64, config: &SimConfig) -> Sample {
        match self {
            Self::Plain | Self::Ambiguous | Self::Mixed => simulate(tool, grasp, seed, config),
            Self::Misaligned => {
                let mut noise = Noise::new(seed, Stream::Condition, 0);
                let mut off = || noise.uniform(-MISALIGNMENT_M, MISALIGNMENT_M);
                let elsewhere = Grasp { x_m: grasp.x_m + off(), y_m: grasp.y_m + off(), ..grasp };
                simulate_apart(tool, grasp, elsewhere, seed, config)
            }
            Self::Turned => {
                let theta_rad = grasp.theta_rad * (PI / super::grasp::THETA_RANGE_RAD);
                let grasp = Grasp { theta_rad, x_m: TURNED * grasp.x_m, y_m: TURNED * grasp.y_m };
                simulate(tool, grasp, seed, config)
            }
            Self::Noise => {
                let mut sample = simulate(tool, grasp, seed, config);
                for finger in lab::PADS {
                    let mut noise = Noise::new(seed, Stream::Condition, finger.index());
                    let gelslim = sample.pads.get_mut(finger).and_then(|t| t.color_mut());
                    if let Some((difference, images)) = gelslim.map(|g| (&mut g.difference, &mut g.images)) {
                        let drawn = RgbGrid::from_fn(difference.width(), difference.height(), |_, _| {
                            NOISE_STD.map(|std| std * noise.normal())
                        });
                        difference.add(&drawn);
                        if let Some(images) = images {
                            images.raw.add(&drawn);
                        }
                    }
                }
                sample
            }
        }
    }
}

/// Grasps per tool of the paper's test set.
pub const TEST_GRASPS: u64 = 46;
/// Seeds of the test sets: apart from the demo's, and from those that a training shard draws (64 random bits).
const TEST_SEED: u64 = 0x7e57_0000_0000;

/// Grasp and seed of pair number `index` of tool number `tool` of the test set, the same in every condition: uniform in
/// the range of the lab's grid, as random as those trained on but never one of them.
pub fn test_grasp(tool: usize, index: u64) -> (Grasp, u64) {
    let seed = TEST_SEED + tool as u64 * 1000 + index;
    (super::random_grasp(seed), seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::{pattern_of, tools};
    use strum::IntoEnumIterator as _;

    fn imprint(sample: &Sample) -> &crate::grid::DepthMap {
        &sample.pad(lab::RIGHT).unwrap().depth().unwrap().imprint
    }

    fn gelslim(sample: &Sample) -> &RgbGrid {
        &sample.pad(lab::RIGHT).unwrap().color().unwrap().difference
    }

    #[test]
    fn each_condition_spoils_what_it_says_and_nothing_else() {
        let (tool, config) = (&tools()[4], SimConfig::default());
        let (grasp, seed) = test_grasp(4, 1);
        let plain = Condition::Plain.simulate(tool, grasp, seed, &config);
        for condition in Condition::iter().skip(1) {
            let spoilt = condition.tool(tool, 1);
            let sample = condition.simulate(&spoilt, grasp, seed, &config);
            let same = (gelslim(&sample) == gelslim(&plain), imprint(&sample) == imprint(&plain));
            let expected = match condition {
                Condition::Misaligned => (true, false),
                Condition::Noise => (false, true),
                _ => (false, false),
            };
            assert_eq!(same, expected, "{condition:?}");
            assert_eq!(pattern_of(&spoilt.name), tool.name);
        }
        assert_eq!(Condition::Mixed.tool(tool, 2), *tool, "every other pair is plain");
        // The truth of a misaligned pair is that of the bubbles: it is their imprint that is aligned.
        let apart = Condition::Misaligned.simulate(tool, grasp, seed, &config);
        let (a, b) = (apart.grasp_from_object.unwrap(), plain.grasp_from_object.unwrap());
        assert!(a.theta_rad == b.theta_rad && (a.y_m - b.y_m).hypot(a.z_m - b.z_m) > 1e-4);
    }

    #[test]
    fn a_gelslim_on_the_shaft_sees_hardly_anything_of_the_pattern() {
        let config = SimConfig::default();
        let difference = |a: &RgbGrid, b: &RgbGrid| -> f64 {
            let pixels = a.as_slice().iter().flatten().zip(b.as_slice().iter().flatten());
            pixels.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / (3 * a.len()) as f64
        };
        // The same noise in both, so that only the patterns differ.
        let between = |form: fn(ToolSpec) -> ToolSpec| {
            let of = |tool: usize| simulate(&form(tools()[tool].clone()), Grasp::default(), 1, &config);
            let (a, b) = (of(0), of(3));
            assert_ne!(imprint(&a), imprint(&b), "the bubbles see the patterns");
            difference(gelslim(&a), gelslim(&b))
        };
        let (plain, shaft) = (between(|tool| tool), between(on_a_shaft));
        assert!(shaft < 0.2 * plain, "{shaft} levels on the shaft, {plain} on the patterns");
    }

    #[test]
    fn test_grasps_are_no_one_elses() {
        let mut seeds: Vec<u64> = (0..12).flat_map(|t| (0..TEST_GRASPS).map(move |i| test_grasp(t, i).1)).collect();
        seeds.sort_unstable();
        seeds.dedup();
        assert_eq!(seeds.len() as u64, 12 * TEST_GRASPS);
        assert!(seeds[0] > 0x00de_3000 + 1_000_000);
    }
}
