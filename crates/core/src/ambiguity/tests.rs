use rayon::prelude::*;

use super::*;
use crate::catalog;
use crate::grid::Grid;
use crate::rig::lab;
use crate::sim::{self, SimConfig};

/// Ambiguity of both fingers' images of some grasps, half of them with randomised sensors.
fn survey(seeds: std::ops::Range<u64>, on_a_shaft: bool) -> Vec<(String, Ambiguity)> {
    seeds
        .into_par_iter()
        .flat_map_iter(|seed| {
            let tools = catalog::tools();
            let tool = tools[seed as usize % tools.len()].clone();
            let name = tool.name.clone();
            let tool = if on_a_shaft { catalog::on_a_shaft(tool) } else { tool };
            let config = if seed % 2 == 0 { SimConfig::default() } else { SimConfig::randomised(seed) };
            let sample = sim::simulate(&tool, sim::random_grasp(seed), seed, &config);
            let touches = lab::PADS.map(|finger| {
                let touch = sample.pad(finger).and_then(|t| t.color()).unwrap();
                (name.clone(), ambiguity(&touch.difference).unwrap())
            });
            touches.into_iter()
        })
        .collect()
}

fn share(list: &[(String, Ambiguity)]) -> f64 {
    list.iter().filter(|(_, a)| a.kind == TouchKind::BareShaft).count() as f64 / list.len() as f64
}

#[test]
fn bare_shafts_are_found_and_patterns_are_not_taken_for_them() {
    // Other grasps than those that the limit was chosen on. A plain rod is a bare shaft wherever its end is not seen.
    let shafts = survey(5000..5012, true);
    let mut plain = survey(6000..6012, false);
    plain.retain(|(name, _)| !name.contains("rod"));
    // The lens bends the shaft, so not every one is found.
    assert!(share(&shafts) >= 0.7, "{shafts:#?}");
    assert!(share(&plain) <= 0.1, "{plain:#?}");
    assert!(shafts.iter().chain(&plain).all(|(_, a)| a.kind != TouchKind::Nothing));
    // The shaft points along the picture's x, give or take the grasp's 22.5 degrees and the sensor's tilt.
    for (_, a) in shafts.iter().filter(|(_, a)| a.kind == TouchKind::BareShaft) {
        let off = a.direction_rad.to_degrees();
        assert!(off.min(180.0 - off) < 35.0, "{a:?}");
    }
}

#[test]
fn pictures_made_by_hand_are_judged_as_a_person_would() {
    let judged = |f: &dyn Fn(f32, f32) -> f32| {
        ambiguity(&Grid::from_fn(427, 320, |x, y| [f(x as f32, y as f32), 0.0, 0.0])).unwrap()
    };
    let ridge = |y: f32| if (y - 160.0).abs() < 30.0 { 30.0 } else { 0.0 };
    assert_eq!(judged(&|_, y| ridge(y)).kind, TouchKind::BareShaft);
    assert!(judged(&|_, y| ridge(y)).direction_rad.abs() < 0.06);
    // Slanted, and two in parallel.
    let slanted = judged(&|x, y| ridge(y - 0.4 * (x - 213.0)) + ridge(y - 0.4 * (x - 213.0) - 110.0));
    assert_eq!(slanted.kind, TouchKind::BareShaft);
    assert!((slanted.direction_rad - 0.4f64.atan()).abs() < 0.06, "{slanted:?}");
    // An end, a crossing, a ball.
    assert_eq!(judged(&|x, y| if x < 200.0 { ridge(y) } else { 0.0 }).kind, TouchKind::Distinct);
    assert_eq!(
        judged(&|x, y| ridge(y).max(if (x - 213.0).abs() < 30.0 { 30.0 } else { 0.0 })).kind,
        TouchKind::Distinct
    );
    assert_eq!(judged(&|x, y| if (x - 213.0).hypot(y - 160.0) < 60.0 { 30.0 } else { 0.0 }).kind, TouchKind::Distinct);
    assert_eq!(judged(&|x, y| 0.3 * (x * 12.9 + y * 78.2).sin()).kind, TouchKind::Nothing);
    assert!(judged(&|_, _| 7.0).warning().is_some(), "an even change of light is no touch");
}

#[test]
fn images_that_are_none_have_no_answer_and_holes_do_no_harm() {
    assert_eq!(ambiguity(&Grid::filled(0, 0, [0.0; 3])), None);
    assert_eq!(ambiguity(&Grid::filled(1, 9, [0.0; 3])), None);
    assert_eq!(ambiguity(&Grid::filled(32, 24, [f32::NAN; 3])), None);
    let mut holed = Grid::from_fn(128, 128, |_, y| if (50..70).contains(&y) { [30.0; 3] } else { [0.0; 3] });
    holed[(4, 4)] = [f32::NAN, f32::INFINITY, 0.0];
    let touch = ambiguity(&holed).unwrap();
    assert_eq!(touch.kind, TouchKind::BareShaft);
    assert!(touch.change.is_finite() && touch.signal.is_finite());
    assert!(ambiguity(&Grid::filled(2, 2, [1e30; 3])).is_some());
}
