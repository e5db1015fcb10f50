//! Spread between the kept predictions of a grasp with different seeds. They come and go without the grasp's other
//! figures changing, so this is looked up whenever these are.

use std::collections::BTreeMap;

use super::Setup;
use super::kept::Entry;
use super::methods::Models;
use crate::infer::kept_key::input_digest;
use crate::io::dataset::Dataset;
use crate::steps::bundles::BundleInfo;
use crate::steps::imprint::imprint_of;
use crate::steps::models;
use touch2touch_core::dataset::PairId;
use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::ensemble::Spread;
use touch2touch_core::grid::DepthMap;
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::{Sample, Scale};

/// The sheet of spreads, by the predictions that they are of.
const SHEET: &str = "seed_spreads";

/// Digests of the color pictures of a grasp.
pub(super) fn inputs(sample: &Sample) -> Vec<String> {
    let color = |touch: &touch2touch_core::sample::PadTouch| Some(input_digest(&touch.color()?.difference));
    sample.pads.iter().flatten().filter_map(color).collect()
}

/// Puts the spreads into the figures of the grasps of which several predictions are kept.
pub(super) fn put(
    entries: &mut [(PairId, Entry)],
    dataset: &Dataset,
    setup: &Setup,
    models: &Models,
    all: &models::Models,
) {
    let bundles = models.generators();
    let kept = all.kept_inputs();
    for (id, entry) in entries {
        // A single one of a picture has no spread.
        let several = entry.inputs.iter().any(|input| kept.of(input).nth(1).is_some());
        if !several || entry.score.scale != Scale::Measured {
            continue;
        }
        let names: Vec<&str> = entry.inputs.iter().flat_map(|input| kept.of(input)).collect();
        let key = crate::io::digest::sha256(format!("{names:?} {:?} {bundles:?}", setup.recipe.shift).as_bytes());
        let found = all.sheets().get(SHEET, [key.as_str()]).pop().flatten();
        let found = found.unwrap_or_else(|| {
            let spread = dataset.load(*id).ok().and_then(|sample| spread_of(&sample, &bundles, setup, all));
            let text = spread.map_or_else(|| "none".to_owned(), |m| format!("{m:e}"));
            all.sheets().put(SHEET, [(key, text.clone())]);
            text
        });
        entry.score.seed_spread_m = found.parse().ok();
    }
}

/// The spread of the finger with the most, meters.
fn spread_of(sample: &Sample, bundles: &[BundleInfo], setup: &Setup, all: &models::Models) -> Option<f64> {
    let of = |pad: PadId| {
        let difference = &sample.pad(pad)?.color()?.difference;
        let mut alike: BTreeMap<String, BTreeMap<u64, DepthMap>> = BTreeMap::new();
        for kept in all.kept(bundles, setup.recipe.engine, difference) {
            let Ok(imprint) = imprint_of(&kept.prediction, setup.recipe.shift, sample, pad) else { continue };
            // All but the seed must be the same.
            let recipe = format!("{} {:?}", kept.prediction.bundle, GenerateConfig { seed: 0, ..kept.config });
            alike.entry(recipe).or_default().insert(kept.config.seed, imprint);
        }
        let most = alike.into_values().max_by_key(BTreeMap::len).filter(|seeds| seeds.len() > 1)?;
        Spread::of(&most.values().collect::<Vec<_>>()).map(|spread| spread.mean_std()).filter(|m| m.is_finite())
    };
    sample.rig.pads().filter_map(of).reduce(f64::max)
}
