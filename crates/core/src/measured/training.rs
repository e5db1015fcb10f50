//! Touches to train on.

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::config::BubbleConfig;
use super::{Sensors, random_tool, simulate, tools};
use crate::sim::{Drawn, Mix, of_any_depth, random_grasp};

/// Share of drawn tools in [`Mix::Train`], and of touches by the measured sensors.
const DRAWN_TOOLS: f64 = 0.4;
const NOMINAL: f64 = 0.4;

/// Touch `index` of an endless list that `seed` draws; the same on every machine. Mixes are as those of
/// [`sim::training_touch`](crate::sim::training_touch), with the lab's tools and sensors for the nominal ones.
pub fn training_touch(seed: u64, index: u64, mix: Mix) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(1_000_003).wrapping_add(index));
    let train = matches!(mix, Mix::Train | Mix::Depths);
    let tool = if train && rng.random_bool(DRAWN_TOOLS) {
        None
    } else {
        let of_mix: Vec<usize> = (0..tools().len()).filter(|&i| tools()[i].seen == (mix != Mix::Unseen)).collect();
        Some(of_mix[rng.random_range(0..of_mix.len())])
    };
    let nominal = !train || rng.random_bool(if mix == Mix::Depths { 0.0 } else { NOMINAL });
    let tool_held = tool.map_or_else(|| random_tool(rng.random()), |i| tools()[i].clone());
    let mut sensors = if nominal { Sensors::default() } else { Sensors::randomised(rng.random()) };
    if mix == Mix::Depths {
        sensors.bubble = any_bubble(sensors.bubble, &mut rng);
    } else if nominal && train {
        // The grip varies from touch to touch.
        sensors.bubble.press_m += rng.random_range(-0.0022..0.0022);
    }
    let (grasp, noise) = (random_grasp(rng.random()), rng.random());
    Drawn { sample: simulate(&tool_held, grasp, noise, &sensors), tool, nominal }
}

/// A bubble of another size, tension and pressure, pressed on as lightly or as hard as any gripper does.
fn any_bubble(bubble: BubbleConfig, rng: &mut ChaCha8Rng) -> BubbleConfig {
    let size = rng.random_range(0.55..1.0);
    BubbleConfig {
        press_m: 0.003 * 6.0_f64.powf(rng.random_range(0.0..1.0)),
        dome_rise_m: bubble.dome_rise_m * rng.random_range(0.4..1.1),
        rim_semi_axes_m: bubble.rim_semi_axes_m.map(|a| a * size),
        rim_centers_m: bubble.rim_centers_m.map(|[y, z]| [y, z * rng.random_range(0.0..1.0)]),
        rim_tilt: bubble.rim_tilt * rng.random_range(-0.5..1.2),
        pressure_per_m: bubble.pressure_per_m * rng.random_range(0.4..1.4),
        stiffening: rng.random_range(0.5..6.0),
        noise: of_any_depth(bubble.noise, rng),
        ..bubble
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touch_depends_on_its_place_alone_and_unseen_tools_stay_unseen() {
        let drawn: Vec<Drawn> = (0..6).map(|i| training_touch(3, i, Mix::Train)).collect();
        assert!(drawn.iter().filter_map(|d| d.tool).all(|tool| tools()[tool].seen));
        assert!(drawn.iter().any(|d| d.nominal != drawn[0].nominal));
        let again = training_touch(3, 4, Mix::Train);
        assert_eq!(again.sample.grasp_from_object, drawn[4].sample.grasp_from_object);
        assert_ne!(training_touch(4, 4, Mix::Train).sample.grasp_from_object, again.sample.grasp_from_object);
        let unseen = training_touch(3, 0, Mix::Unseen);
        assert!(unseen.nominal && !tools()[unseen.tool.unwrap()].seen);
        let imprint = |d: &Drawn| {
            let bubble = d.sample.pad(crate::rig::lab::LEFT).and_then(|pad| pad.depth()).unwrap();
            bubble.imprint.as_slice().iter().all(|v| v.is_finite() && v.abs() < 0.1)
        };
        assert!(drawn.iter().all(imprint));
        assert!(imprint(&training_touch(3, 1, Mix::Depths)));
    }
}
