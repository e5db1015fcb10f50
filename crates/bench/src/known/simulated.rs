//! Fresh cases from the built-in simulator: as many as wanted, each from its own seed.
//!
//! Recipe. Tool: for nominal and hard cases the lab's eleven tools that are no rod, in turn; for degenerate ones a
//! rod and a peg. Pose: uniform in the prior (±22.5°, ±5 mm). Sensors: the simulator's nominal ones with the true
//! camera off by a deviation of 0.25° and 0.2 mm per axis; hard cases press two thirds as deep and have 1.5 times the
//! noise. One pixel in a hundred is dropped: it reads 0 on the right finger and NaN on the left. Masks: see [`Corruption`];
//! three of four degenerate cases have nothing at all in the mask of one finger.

use glam::DVec2;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::corrupt::{Corruption, corrupt};
use super::{Case, Stratum};
use crate::training_mix::of_any_depth;
use touch2touch_core::catalog::{self, Bar, ToolSpec};
use touch2touch_core::rig::{PadId, lab};
use touch2touch_core::sample::Sample;
use touch2touch_core::sim::{self, Condition};

/// Deviation of the camera's true angle and place from the nominal ones, per axis.
const CALIBRATION_RAD: f64 = 0.25 * std::f64::consts::PI / 180.0;
const CALIBRATION_M: f64 = 0.2e-3;
/// Share of pixels without depth.
const DROPPED: f64 = 0.01;

/// The tools of the plain [`Suite`]; the position is [`Case::tool`]. The last two are straight.
fn plain_tools() -> Vec<ToolSpec> {
    let is_rod = |t: &&ToolSpec| t.name.ends_with("_rod");
    let rod = catalog::tools().iter().find(is_rod).cloned();
    let mut tools: Vec<ToolSpec> = catalog::tools().iter().filter(|t| !is_rod(t)).cloned().collect();
    let peg = rod.clone().map(|rod| ToolSpec {
        name: "peg".into(),
        bars: vec![Bar::straight(DVec2::ZERO, DVec2::new(0.0, 0.05), 0.003)],
        ..rod
    });
    tools.extend(rod.into_iter().chain(peg));
    tools
}

/// The kind of case `position` of `count`: 70 % nominal, then 20 % hard, then 10 % degenerate.
pub fn stratum(position: usize, count: usize) -> Stratum {
    match (10 * position).checked_div(count).unwrap_or(0) {
        0..7 => Stratum::Nominal,
        7..9 => Stratum::Hard,
        _ => Stratum::Degenerate,
    }
}

/// Number of forms that the tools have under a condition.
fn forms(condition: Condition) -> usize {
    if condition == Condition::Mixed { 2 } else { 1 }
}

/// Suite of fresh cases.
#[derive(Clone, Debug)]
pub struct Suite {
    count: usize,
    seed: u64,
    condition: Condition,
    any_depth: bool,
    /// Plain forms of the tools, then those of every other case where the condition has another.
    tools: Vec<ToolSpec>,
}

impl Suite {
    /// Plain cases, by whose number the kinds are shared out.
    pub fn new(count: usize, seed: u64) -> Self {
        Self { count, seed, condition: Condition::Plain, any_depth: false, tools: plain_tools() }
    }

    /// The same grasps with a fault of the pairs.
    #[must_use]
    pub fn with_condition(self, condition: Condition) -> Self {
        let tools = (0..forms(condition) as u64)
            .flat_map(|form| plain_tools().into_iter().map(move |tool| condition.tool(&tool, form)));
        Self { condition, tools: tools.collect(), ..self }
    }

    /// The same grasps by bubbles of any size, pressed on as lightly or as hard as any gripper does.
    #[must_use]
    pub fn with_any_depth(self) -> Self {
        Self { any_depth: true, ..self }
    }

    /// The tools; the position is [`Case::tool`].
    pub fn tools(&self) -> &[ToolSpec] {
        &self.tools
    }

    /// Number of cases.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Case number `position`. About 60 ms of one core in release.
    pub fn case(&self, position: usize) -> Case {
        self.felt(position).1
    }

    /// The case with the touch that it is of.
    pub fn felt(&self, position: usize) -> (Sample, Case) {
        let Self { count, seed, condition, any_depth, ref tools } = *self;
        let plain = tools.len() / forms(condition);
        // One seed per case, so that a case does not depend on how its neighbors came about.
        let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(position as u64));
        let stratum = stratum(position, count);
        let straight = plain - 2;
        let tool = match stratum {
            Stratum::Degenerate => straight + position % 2,
            Stratum::Nominal | Stratum::Hard => position % straight,
        };
        let mut config = sim::SimConfig::default();
        config.bubble.calibration_rad = CALIBRATION_RAD;
        config.bubble.calibration_m = CALIBRATION_M;
        config.bubble.dropped_share = 0.0;
        if stratum == Stratum::Hard {
            config.bubble.press_m *= 2.0 / 3.0;
            config.bubble.noise_m *= 1.5;
        }
        if any_depth {
            config.bubble = of_any_depth(config.bubble, &mut rng);
        }
        let tool = (tool + position % 2 * plain) % tools.len();
        let sample = condition.simulate(&tools[tool], sim::random_grasp(rng.random()), rng.random(), &config);
        let case = spoilt(&sample, tool, stratum, &mut rng);
        (sample, case)
    }
}

/// Case of a simulated touch: masks as a learned model has them, and pixels without depth.
pub fn spoilt(sample: &Sample, tool: usize, stratum: Stratum, rng: &mut ChaCha8Rng) -> Case {
    let corruption = if stratum == Stratum::Hard { Corruption::hard() } else { Corruption::nominal() };
    let mask_seed: u64 = rng.random();
    // Of the degenerate cases, three of four have one blank finger, either one equally often.
    let blank = (stratum == Stratum::Degenerate && rng.random_bool(0.75)).then(|| rng.random_range(0..2));
    let touch = |finger: PadId| {
        let touch = sample.pad(finger).and_then(|t| t.depth());
        touch.expect("the simulator presses both fingers")
    };
    let camera = |finger| touch(finger).camera.clone().expect("the simulator's bubbles have cameras");
    let clean = lab::PADS.map(|f| touch(f).truth.as_ref().expect("the simulator knows the contact").contact.clone());
    let mut masks = lab::PADS.map(|f| corrupt(&clean[f.index()], &corruption, f, mask_seed));
    if let Some(finger) = blank {
        let finger: usize = finger;
        masks[finger].as_mut_slice().fill(false);
    }
    let mut imprints = lab::PADS.map(|f| touch(f).imprint.clone());
    for (f, imprint) in imprints.iter_mut().enumerate() {
        let reference = camera(lab::PADS[f]).depth_reference;
        for (value, reference) in imprint.as_mut_slice().iter_mut().zip(reference.as_slice()) {
            if rng.random_bool(DROPPED) {
                *value = if f == 0 { *reference } else { f32::NAN };
            }
        }
    }
    Case {
        imprints,
        predicted: false,
        cameras: lab::PADS.map(camera),
        masks,
        masks_clean: clean,
        grasp_from_object: sample.grasp_from_object.expect("the simulator knows the pose"),
        tool,
        stratum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strata_have_their_shares_and_straight_tools_are_degenerate() {
        let count = |s| (0..200).filter(|&i| stratum(i, 200) == s).count();
        assert_eq!((count(Stratum::Nominal), count(Stratum::Hard), count(Stratum::Degenerate)), (140, 40, 20));
        assert_eq!(stratum(0, 0), Stratum::Nominal);
        let tools = plain_tools();
        assert_eq!(tools.len(), 13);
        assert!(tools[11].name.ends_with("_rod") && tools[12].name == "peg");
    }

    #[test]
    fn a_case_repeats_and_has_what_the_recipe_says() {
        let case = Suite::new(10, 5).case(3);
        assert_eq!(case.masks, Suite::new(10, 5).case(3).masks);
        assert_ne!(case.masks, Suite::new(10, 6).case(3).masks);
        assert_ne!(case.masks, case.masks_clean);
        let dropped = |f: usize| {
            let pixels = case.imprints[f].as_slice().iter().zip(case.cameras[f].depth_reference.as_slice());
            (pixels.clone().filter(|(i, r)| i == r).count(), pixels.filter(|(i, _)| i.is_nan()).count())
        };
        assert!((150..350).contains(&dropped(0).0) && dropped(0).1 == 0, "{:?}", dropped(0));
        assert!((150..350).contains(&dropped(1).1) && dropped(1).0 == 0, "{:?}", dropped(1));
        let dir = tempfile::tempdir().unwrap();
        super::super::write(&dir.path().join("case_003.npz"), &case).unwrap();
        let back = super::super::read(&dir.path().join("case_003.npz")).unwrap();
        assert_eq!((back.tool, back.stratum), (3, Stratum::Nominal));
        assert_eq!(back.masks, case.masks);
    }
}
