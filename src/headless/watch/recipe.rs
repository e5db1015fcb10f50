//! What a result depends on besides the touch.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use serde_json::{Value, json};

use super::super::predict::Predictor;
use super::WatchArgs;
use touch2touch_core::grid::Mask;
use touch2touch_core::pose::RegistrationChoice;
use touch2touch_work::infer::engine::resolve;
use touch2touch_work::labels::PairLabels;

/// Everything the result depends on besides the touch.
pub(super) fn recipe(
    args: &WatchArgs,
    predictor: &mut Predictor,
    registration: RegistrationChoice,
    tool: Option<&str>,
    labels: &PairLabels,
) -> anyhow::Result<Value> {
    let choice = args.mask.choice();
    let model = predictor.mask_model(&choice)?.map(|model| model.id);
    let drawn: Vec<(String, String)> = args
        .mask
        .drawn(labels)
        .into_iter()
        .flat_map(|l| l.masks.iter())
        .map(|(place, hand)| (format!("{place:?}"), digest(&hand.mask)))
        .collect();
    let mask = json!({"choice": choice, "model": model.as_deref(), "drawn": drawn});
    let config = predictor.config()?;
    let shift = predictor.shift();
    let engine = resolve(predictor.engine())?;
    let bundle = predictor.bundle()?;
    Ok(json!({
        "bundle": bundle.name, "bundle_hash": *bundle.id, "runtime": engine,
        "sampler": config.sampler, "steps": config.steps, "seed": config.seed, "eta": config.eta,
        "spacing": config.spacing, "guidance": config.guidance, "shift": shift, "mask": mask, "registration": registration, "tool": tool,
        "camera": args.camera, "version": env!("CARGO_PKG_VERSION"),
    }))
}

/// Tells one drawn mask from another.
fn digest(mask: &Mask) -> String {
    let mut hasher = DefaultHasher::new();
    (mask.size(), mask.as_slice()).hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}
