//! Sets of simulated pairs, sound ones and such that were stored wrongly. `touch2touch-bench doctor` measures all kinds.

use strum::IntoEnumIterator as _;

use super::*;
use crate::catalog::tools;
use crate::grid::{DepthMap, RgbGrid};
use crate::read_as::{Colors, Depths, Images, Lay};
use crate::sample::ColorTouch;
use crate::sim::{Condition, SimConfig, random_grasp};

struct Set {
    pairs: Vec<(String, Sample)>,
    tools: BTreeMap<String, TriMesh>,
}

fn set(condition: Condition, pairs: u64, config: &SimConfig) -> Set {
    let mut set = Set { pairs: Vec::new(), tools: BTreeMap::new() };
    for index in 0..pairs {
        let spec = condition.tool(&tools()[(index as usize * 5 + 1) % tools().len()], index);
        let sample = condition.simulate(&spec, random_grasp(0x00d0_0b70 + index), index, config);
        set.tools.insert(spec.name.clone(), spec.mesh());
        set.pairs.push((spec.name, sample));
    }
    set
}

impl Set {
    fn judged(&self) -> Vec<String> {
        let pairs: Vec<PairInput<'_>> =
            self.pairs.iter().map(|(tool, sample)| PairInput { tool: Some(tool), sample, beside: None }).collect();
        judge(&pairs, &self.tools, None).iter().map(|doubt| doubt.cause.key()).collect()
    }

    fn stored(&self, mistake: ReadAs) -> Self {
        let pairs = self.pairs.iter().map(|(tool, sample)| (tool.clone(), ReadAs::all(&[mistake], sample)));
        Self { pairs: pairs.collect(), tools: self.tools.clone() }
    }
}

#[test]
fn sound_sets_of_every_condition_and_of_other_sensors_raise_no_doubt() {
    for (number, condition) in (0u64..).zip(Condition::iter()) {
        let config = if number % 2 == 0 { SimConfig::default() } else { SimConfig::randomised(number) };
        // Of bare shafts one finger alone is seldom right.
        for pairs in [1, if condition == Condition::Ambiguous { 8 } else { 4 }] {
            let doubts = set(condition, pairs, &config).judged();
            assert!(doubts.is_empty(), "{condition:?}, {pairs} pairs: {doubts:?}");
        }
    }
    assert!(judge(&[], &BTreeMap::new(), None).is_empty());
    let nothing = Sample::default();
    assert!(judge(&[PairInput { tool: None, sample: &nothing, beside: None }], &BTreeMap::new(), None).is_empty());
}

#[test]
fn what_was_stored_wrongly_is_named() {
    let sound = set(Condition::Plain, 4, &SimConfig::default());
    for (mistake, named) in [
        (ReadAs::SwapFingers(Depths::Imprints), "swap-fingers"),
        (ReadAs::Lay(Depths::Imprints, Lay::MirrorColumns), "mirror-columns"),
        (ReadAs::Lay(Depths::Imprints, Lay::Turn), "turn"),
        (ReadAs::NegateTheta, "negate-theta"),
        (ReadAs::Scale(Depths::Imprints, 2.0), "scale-depth=0.5"),
        (ReadAs::ScaleCamera(1.25), "scale-camera=0.8"),
        (ReadAs::ImageBgr(Images::Reference), "image-bgr=reference"),
        (ReadAs::ImageNegative, "image-negative"),
        (ReadAs::ImageSwapReference, "image-swap-reference"),
        (ReadAs::ImageLay(Lay::MirrorColumns), "image-mirror-columns"),
    ] {
        let wrong = sound.stored(mistake).judged();
        assert_eq!(wrong.len(), 1, "{mistake}: {wrong:?}");
        assert_eq!(wrong[0].trim_start_matches("whole-"), named, "{mistake}");
        // Read as is said, nothing is left to say.
        assert!(sound.stored(mistake).stored(wrong[0].parse().unwrap()).judged().is_empty(), "{mistake}");
    }
}

#[test]
fn images_in_other_colors_and_those_of_one_finger_that_lie_otherwise_are_named() {
    let sound = set(Condition::Plain, 4, &SimConfig::default());
    let change = |of: &dyn Fn(usize, &RgbGrid) -> RgbGrid| {
        let mut set = Set { pairs: sound.pairs.clone(), tools: sound.tools.clone() };
        for (_, sample) in &mut set.pairs {
            for (finger, touch) in sample.pads.iter_mut().enumerate() {
                let Some(color) = touch.as_mut().and_then(PadTouch::color_mut) else { continue };
                let Some(images) = &color.images else { continue };
                let [raw, reference] = [&images.raw, &images.reference].map(|image| of(finger, image));
                *color = ColorTouch::from_images(raw, reference).unwrap();
            }
        }
        set
    };
    for colors in Colors::iter() {
        let wrong = change(&|_, image| image.map(|pixel| colors.encoded(*pixel)));
        let cure = ReadAs::ImageColors(colors);
        assert_eq!(wrong.judged(), [cure.to_string()]);
        assert!(wrong.stored(cure).judged().is_empty(), "{cure}");
    }
    let one = change(&|finger, image| if finger == 1 { Lay::Turn.turn().apply(image) } else { image.clone() });
    assert_eq!(one.judged(), ["finger-image-turn"]);
}

#[test]
fn a_cure_is_worth_what_it_does_to_the_poses() {
    let sound = set(Condition::Plain, 4, &SimConfig::default());
    let worth = |set: &Set| {
        let pairs = set.pairs.iter().map(|(tool, sample)| PairInput { tool: Some(tool), sample, beside: None });
        super::worth(&pairs.collect::<Vec<_>>(), &set.tools)
    };
    let (as_is, twice) = (worth(&sound), worth(&sound.stored(ReadAs::Scale(Depths::Imprints, 2.0))));
    assert_eq!((as_is.tried, as_is.good, as_is.wrong), (4, 4, 0));
    assert!(!as_is.is_worse_than(&as_is) && twice.is_worse_than(&as_is), "{as_is:?}, {twice:?}");
}

#[test]
fn a_wrong_cad_model_is_named() {
    let sound = set(Condition::Plain, 4, &SimConfig::default());
    let mut exchanged = Set { pairs: sound.pairs.clone(), tools: sound.tools.clone() };
    let meshes: Vec<TriMesh> = sound.tools.values().cloned().collect();
    exchanged.tools.values_mut().zip(meshes.iter().cycle().skip(1)).for_each(|(mesh, other)| *mesh = other.clone());
    assert_eq!(exchanged.judged(), ["other-tool"]);
    let mut mirrored = Set { pairs: sound.pairs, tools: sound.tools };
    mirrored.tools.values_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| vertex.y = -vertex.y);
    assert_eq!(mirrored.judged(), ["cad-axes=-x-yz"]);
}

#[test]
fn predictions_tell_the_fingers_of_the_images() {
    // In place of a generator: the imprints of the fingers whose images they are.
    let sound = set(Condition::Plain, 3, &SimConfig::default());
    let pairs: Vec<PairInput<'_>> =
        sound.pairs.iter().map(|(_, sample)| PairInput { tool: None, sample, beside: None }).collect();
    let predictor = |is_swapped: fn(usize) -> bool| {
        move |samples: &[&Sample]| {
            let imprint =
                |sample: &Sample, pad| -> Option<DepthMap> { Some(sample.pad(pad)?.depth()?.imprint.clone()) };
            let of = |(at, sample): (usize, &&Sample)| -> Placed {
                let pads = sample.rig.pad_list();
                let from = |index: usize| if is_swapped(at) { pads[pads.len() - 1 - index] } else { pads[index] };
                (0..pads.len()).map(|index| Some(pads.iter().map(|_| imprint(sample, from(index))).collect())).collect()
            };
            Some(samples.iter().enumerate().map(of).collect())
        }
    };
    assert!(judge(&pairs, &BTreeMap::new(), Some(&mut predictor(|_| false))).is_empty());
    let swapped = judge(&pairs, &BTreeMap::new(), Some(&mut predictor(|_| true)));
    assert_eq!(swapped.iter().map(Doubt::read_as).collect::<Vec<_>>(), [Some(ReadAs::ImageSwapFingers)]);
    assert!(swapped[0].what.contains("3 of 3 pairs"), "{}", swapped[0].what);
    let some = judge(&pairs, &BTreeMap::new(), Some(&mut predictor(|at| at > 0)));
    assert_eq!((some.len(), &some[0].cause, &some[0].pairs[..]), (1, &Cause::SwappedInSome, &[1, 2][..]));
}

#[test]
fn true_poses_that_contradict_the_imprints_are_named_with_their_mistake() {
    let sound = set(Condition::Plain, 4, &SimConfig::default());
    let truths: Vec<PlanarPose> = sound.pairs.iter().map(|(_, sample)| sample.grasp_from_object.unwrap()).collect();
    let labs = |change: &dyn Fn(PlanarPose) -> PlanarPose| -> Vec<PlanarPose> {
        truths.iter().map(|truth| change(truth.inverse()).inverse()).collect()
    };
    let turned = |degrees: f64| labs(&|lab| PlanarPose { theta_rad: lab.theta_rad + degrees.to_radians(), ..lab });
    let times = |factor: f64| labs(&|lab| PlanarPose { theta_rad: factor * lab.theta_rad, ..lab });
    let moved = PlanarPose { theta_rad: 0.1, y_m: 0.012, z_m: -0.007 };
    let before: Vec<PlanarPose> = (0..truths.len()).map(|at| truths[(at + 3) % 4]).collect();
    for (stored, named) in [
        (truths.clone(), None),
        (truths.iter().map(|truth| truth.inverse()).collect(), Some("poses-inverse")),
        (turned(5.0), Some("poses-angle")),
        (turned(-15.0), Some("poses-angle")),
        (times(2.0), Some("poses-factor")),
        (times(0.0), Some("poses-constant")),
        (before, Some("poses-neighbor")),
        (truths.iter().map(|truth| moved.compose(*truth)).collect(), Some("poses-grasp-frame")),
        (
            truths.iter().map(|truth| truth.compose(PlanarPose { theta_rad: 0.0, ..moved })).collect(),
            Some("poses-object-frame"),
        ),
    ] {
        let with: Vec<Sample> = sound
            .pairs
            .iter()
            .zip(&stored)
            .map(|((_, sample), pose)| Sample { grasp_from_object: Some(*pose), ..sample.clone() })
            .collect();
        let stored = &stored;
        let beside: Vec<_> = (0..with.len())
            .map(|at| move |on: isize| Some(stored[(at as isize + on).rem_euclid(4) as usize]))
            .collect();
        let pairs: Vec<PairInput<'_>> = (0..with.len())
            .map(|at| PairInput { tool: Some(&sound.pairs[at].0), sample: &with[at], beside: Some(&beside[at]) })
            .collect();
        let doubts = judge(&pairs, &sound.tools, None);
        let keys: Vec<String> = doubts.iter().map(|doubt| doubt.cause.key()).collect();
        assert_eq!(keys, named.map(str::to_owned).into_iter().collect::<Vec<_>>(), "{named:?}: {doubts:?}");
        if named == Some("poses-angle") {
            assert!(doubts[0].what.contains("° too large, or all CAD models are turned"), "{}", doubts[0].what);
        }
    }
}

/// A set with its first finger changed.
fn with_first_finger(set: &Set, change: impl Fn(&mut PadTouch)) -> Set {
    let pairs = set.pairs.iter().map(|(tool, sample)| {
        let mut sample = sample.clone();
        change(sample.pads.iter_mut().flatten().next().unwrap());
        (tool.clone(), sample)
    });
    Set { pairs: pairs.collect(), tools: set.tools.clone() }
}

#[test]
fn one_finger_that_is_wrong_is_named() {
    let sound = set(Condition::Plain, 6, &SimConfig::default());
    let imprint = |change: &dyn Fn(&DepthMap) -> DepthMap| {
        with_first_finger(&sound, |touch| {
            let depth = touch.depth_mut().unwrap();
            depth.imprint = change(&depth.imprint);
        })
    };
    let mapped =
        |of: &dyn Fn(f32) -> f32| imprint(&|map| DepthMap::from_fn(map.width(), map.height(), |x, y| of(map[(x, y)])));
    for (wrong, named) in [
        (imprint(&|map| Lay::MirrorColumns.turn().apply(map)), "finger-mirror-columns"),
        (imprint(&|map| Lay::Turn.turn().apply(map)), "finger-turn"),
        (mapped(&|v| -v), "finger-scale-depth=-1"),
        (mapped(&|_| 0.0), "nothing-felt"),
    ] {
        assert_eq!(wrong.judged(), [named]);
    }
    let untouched = with_first_finger(&sound, |touch| {
        let color = touch.color_mut().unwrap();
        let images = color.images.as_mut().unwrap();
        images.raw = images.reference.clone();
    });
    assert_eq!(untouched.judged(), ["same-images"]);
}

#[test]
fn pairs_under_another_tools_name_are_named() {
    let mut set = Set { pairs: Vec::new(), tools: BTreeMap::new() };
    for index in 0..6 {
        let spec = &tools()[[2, 6][index as usize % 2]];
        let sample = Condition::Plain.simulate(spec, random_grasp(0x00d0_0b90 + index), index, &SimConfig::default());
        set.tools.insert(spec.name.clone(), spec.mesh());
        set.pairs.push((spec.name.clone(), sample));
    }
    assert!(set.judged().is_empty());
    let names = [set.pairs[1].0.clone(), set.pairs[2].0.clone()];
    (set.pairs[2].0, set.pairs[1].0) = (names[0].clone(), names[1].clone());
    let pairs: Vec<PairInput<'_>> =
        set.pairs.iter().map(|(tool, sample)| PairInput { tool: Some(tool), sample, beside: None }).collect();
    let doubts = judge(&pairs, &set.tools, None);
    assert_eq!(doubts.iter().map(|doubt| doubt.cause.key()).collect::<Vec<_>>(), ["other-tool-of-some"]);
    assert_eq!(doubts[0].pairs, [1, 2], "{doubts:?}");
}
