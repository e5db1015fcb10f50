//! Touches to train on: the catalog's tools and drawn ones, felt by nominal and by drawn sensors.

use std::f64::consts::PI;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::random_tool::random_tool;
use touch2touch_core::catalog;
use touch2touch_core::sample::Sample;
use touch2touch_core::sim::{BubbleConfig, Condition, SimConfig, random_grasp, random_grasp_within};

/// Share of drawn tools in [`Mix::Train`].
const DRAWN_TOOLS: f64 = 0.4;
/// Share of touches by nominal sensors in [`Mix::Train`].
const NOMINAL: f64 = 0.4;
/// Share of grasps at any angle in [`Mix::Train`] and [`Mix::Depths`], and how far off the middle they are at most, meters.
const ANY_ANGLE: f64 = 0.25;
const ANY_PLACE_M: f64 = 0.015;

/// Mix that touches are drawn from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[derive(serde::Serialize, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Mix {
    /// The seen tools and drawn ones, most of them felt by drawn sensors; never an unseen tool. The bubble's shape and how deep
    /// it is pressed are the nominal ones: no GelSlim image tells them, and a generator would learn them by heart.
    #[default]
    Train,
    /// The tools of [`Mix::Train`], felt by drawn sensors alone, with bubbles of any size pressed 2 to 15 mm deep: for
    /// contact masks only.
    Depths,
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
    /// True where the sensors are the nominal ones.
    pub nominal: bool,
}

/// Touch `index` of an endless list that `seed` draws; the same on every machine.
pub fn training_touch(seed: u64, index: u64, mix: Mix, condition: Condition) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(index));
    let catalog = catalog::tools();
    let train = matches!(mix, Mix::Train | Mix::Depths);
    let tool = if train && rng.random_bool(DRAWN_TOOLS) {
        None
    } else {
        let tools: Vec<usize> = (0..catalog.len()).filter(|&i| catalog[i].seen == (mix != Mix::Unseen)).collect();
        Some(tools[rng.random_range(0..tools.len())])
    };
    let nominal = !train || rng.random_bool(if mix == Mix::Depths { 0.0 } else { NOMINAL });
    let spec = tool.map_or_else(|| random_tool(rng.random()), |i| catalog[i].clone());
    let mut config = if nominal { SimConfig::default() } else { SimConfig::randomised(rng.random()) };
    match mix {
        Mix::Depths => config.bubble = of_any_depth(config.bubble, &mut rng),
        Mix::Train => config.bubble = of_nominal_shape(config.bubble),
        Mix::Seen | Mix::Unseen => {}
    }
    let any_angle = train && rng.random_bool(ANY_ANGLE);
    let (grasp, noise) = (rng.random(), rng.random());
    let grasp = if any_angle { random_grasp_within(grasp, PI, ANY_PLACE_M) } else { random_grasp(grasp) };
    let sample = condition.simulate(&condition.tool(&spec, index), grasp, noise, &config);
    Drawn { sample, tool, nominal }
}

/// A bubble's noise and errors on the nominal bubble's shape.
fn of_nominal_shape(bubble: BubbleConfig) -> BubbleConfig {
    let nominal = BubbleConfig::default();
    BubbleConfig {
        press_m: nominal.press_m,
        dome_rise_m: nominal.dome_rise_m,
        dome_fullness: nominal.dome_fullness,
        rim_semi_axes_m: nominal.rim_semi_axes_m,
        rim_centers_m: nominal.rim_centers_m,
        rim_tilt: nominal.rim_tilt,
        pressure_per_m: nominal.pressure_per_m,
        stiffening: nominal.stiffening,
        reference_m: nominal.reference_m,
        ..bubble
    }
}

/// The bubble in another size, pressed on as lightly or as hard as any gripper does; slower distortions weigh more where the
/// imprint is shallow.
pub fn of_any_depth(bubble: BubbleConfig, rng: &mut ChaCha8Rng) -> BubbleConfig {
    let press_m = 0.003 * 6.0_f64.powf(rng.random_range(0.0..1.0));
    let size = rng.random_range(0.55..1.0);
    BubbleConfig {
        press_m,
        dome_rise_m: bubble.dome_rise_m * rng.random_range(0.5..1.1),
        rim_semi_axes_m: bubble.rim_semi_axes_m.map(|a| a * size),
        rim_centers_m: bubble.rim_centers_m.map(|[y, z]| [y, z * rng.random_range(0.0..1.0)]),
        rim_tilt: bubble.rim_tilt * rng.random_range(-0.5..1.2),
        pressure_per_m: bubble.pressure_per_m * rng.random_range(0.4..1.4),
        stiffening: rng.random_range(0.5..6.0),
        noise_m: bubble.noise_m * rng.random_range(0.2..1.0),
        texture_m: bubble.texture_m * rng.random_range(0.0..1.0),
        speckle_density: bubble.speckle_density * rng.random_range(0.0..1.0),
        dropped_share: if rng.random_bool(0.5) { bubble.dropped_share } else { rng.random_range(0.0..0.006) },
        ..bubble
    }
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
