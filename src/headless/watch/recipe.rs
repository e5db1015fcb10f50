//! Choices that a result depends on besides the touch.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use serde_json::{Value, json};

use super::WatchArgs;
use touch2touch_core::grid::Mask;
use touch2touch_pipeline::infer::engine::resolve;
use touch2touch_pipeline::labels::PairLabels;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage};

/// Everything the result depends on besides the touch.
pub(super) fn told(
    args: &WatchArgs,
    recipe: &Recipe,
    tool: Option<&str>,
    labels: &PairLabels,
) -> anyhow::Result<Value> {
    let generating = recipe.generating()?;
    let (bundle, config) = (generating.bundle, generating.config);
    let model = recipe.mask_model.as_ref().map(|model| &model.id);
    let drawn: Vec<(String, String)> = labels
        .masks
        .iter()
        .filter(|_| recipe.hand)
        .map(|(place, hand)| (format!("{place:?}"), digest(&hand.mask)))
        .collect();
    let mask = json!({"choice": recipe.mask, "model": model.map(|id| &**id), "drawn": drawn});
    Ok(json!({
        "id": recipe.id(Stage::Pose),
        "bundle": bundle.name, "bundle_hash": *bundle.id, "runtime": resolve(recipe.engine)?,
        "sampler": config.sampler, "steps": config.steps, "seed": config.seed, "eta": config.eta,
        "spacing": config.spacing, "guidance": config.guidance, "shift": recipe.shift, "mask": mask,
        "registration": recipe.registration, "tool": tool,
        "camera": args.camera, "version": env!("CARGO_PKG_VERSION"),
    }))
}

/// Tells one drawn mask from another.
fn digest(mask: &Mask) -> String {
    let mut hasher = DefaultHasher::new();
    (mask.size(), mask.as_slice()).hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}
