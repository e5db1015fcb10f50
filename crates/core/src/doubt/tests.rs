//! Sets of simulated pairs, sound ones and such that were stored wrongly. `touch2touch-bench doctor` measures all kinds.

use strum::IntoEnumIterator as _;

use super::*;
use crate::catalog::tools;
use crate::grid::DepthMap;
use crate::read_as::{Depths, Images, Lay};
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
        let felt: Vec<Felt<'_>> = self.pairs.iter().map(|(tool, sample)| Felt { tool: Some(tool), sample }).collect();
        judge(&felt, &self.tools, None).iter().map(|doubt| doubt.cause.key()).collect()
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
        for pairs in [1, 4] {
            assert!(set(condition, pairs, &config).judged().is_empty(), "{condition:?}, {pairs} pairs");
        }
    }
    assert!(judge(&[], &BTreeMap::new(), None).is_empty());
    let nothing = Sample::default();
    assert!(judge(&[Felt { tool: None, sample: &nothing }], &BTreeMap::new(), None).is_empty());
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
fn a_wrong_cad_model_is_named() {
    let sound = set(Condition::Plain, 4, &SimConfig::default());
    let mut exchanged = Set { pairs: sound.pairs.clone(), tools: sound.tools.clone() };
    let meshes: Vec<TriMesh> = sound.tools.values().cloned().collect();
    exchanged.tools.values_mut().zip(meshes.iter().cycle().skip(1)).for_each(|(mesh, other)| *mesh = other.clone());
    assert_eq!(exchanged.judged(), ["other-tool"]);
    let mut mirrored = Set { pairs: sound.pairs, tools: sound.tools };
    mirrored.tools.values_mut().flat_map(|mesh| &mut mesh.vertices).for_each(|vertex| vertex.y = -vertex.y);
    assert_eq!(mirrored.judged(), ["tool-axes"]);
}

#[test]
fn predictions_tell_the_fingers_of_the_images() {
    // In place of a generator: the imprints of the fingers whose images they are.
    let sound = set(Condition::Plain, 3, &SimConfig::default());
    let felt: Vec<Felt<'_>> = sound.pairs.iter().map(|(_, sample)| Felt { tool: None, sample }).collect();
    let predictor = |swapped: bool| {
        move |samples: &[&Sample]| {
            let imprint =
                |sample: &Sample, pad| -> Option<DepthMap> { Some(sample.pad(pad)?.depth()?.imprint.clone()) };
            let of = |sample: &&Sample| -> Placed {
                let pads = sample.rig.pad_list();
                let from = |index: usize| if swapped { pads[pads.len() - 1 - index] } else { pads[index] };
                (0..pads.len()).map(|index| Some(pads.iter().map(|_| imprint(sample, from(index))).collect())).collect()
            };
            Some(samples.iter().map(of).collect())
        }
    };
    assert!(judge(&felt, &BTreeMap::new(), Some(&mut predictor(false))).is_empty());
    let swapped = judge(&felt, &BTreeMap::new(), Some(&mut predictor(true)));
    assert_eq!(swapped.iter().map(Doubt::read_as).collect::<Vec<_>>(), [Some(ReadAs::ImageSwapFingers)]);
    assert!(swapped[0].what.contains("3 of 3 pairs"), "{}", swapped[0].what);
}

#[test]
#[ignore = "tmp"]
fn tmp_scan() {
    for (number, condition) in (0u64..).zip(Condition::iter()) {
        let config = if number % 2 == 0 { SimConfig::default() } else { SimConfig::randomised(number) };
        for pairs in [1, 4, 8] {
            let set = set(condition, pairs, &config);
            let felt: Vec<Felt<'_>> =
                set.pairs.iter().map(|(tool, sample)| Felt { tool: Some(tool), sample }).collect();
            println!("{condition:?} {pairs}: {:?}", judge(&felt, &set.tools, None));
        }
    }
}
