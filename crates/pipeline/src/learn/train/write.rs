//! The new bundle: the start's manifest with the trained graph, and from what it was trained.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde_json::{Value, json};

use super::gather::{Drawn, Gathered};
use super::{MaskScore, MasksFrom, TrainSetup, WHAT};
use crate::error::TaskError;
use crate::infer::bundle::Role;
use crate::io::dataset::Dataset;
use crate::io::digest::sha256;
use crate::learn::new_bundle;
use crate::steps::bundles::{BundleInfo, TRAINED};

/// That a folder may become the new bundle: nothing is ever written over.
pub(super) fn check_folder(out: &Path, from: &BundleInfo) -> Result<(), TaskError> {
    new_bundle::check_folder(WHAT, out, from, |_| false)
}

/// Provenance of the new bundle: the training that made it. No clock and no place: the same training is the same
/// bundle.
pub(super) struct Provenance<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) gathered: &'a Gathered,
    pub(super) steps: u32,
    pub(super) before: Option<MaskScore>,
    pub(super) after: Option<MaskScore>,
}

/// Writes the bundle; its name. The digest in it tells trainings of the same masks apart, which are chosen by name.
pub(super) fn bundle(setup: &TrainSetup, graph: Vec<u8>, said: &Provenance<'_>) -> Result<String, TaskError> {
    // Another training may have taken the folder meanwhile.
    check_folder(&setup.out, &setup.start)?;
    let root = setup.start.name.split(", trained on ").next().unwrap_or_default();
    let masks = said.gathered.learned.len();
    let digest = &sha256(&graph)[..6];
    let cad = if setup.choice.from == MasksFrom::Cad { "CAD " } else { "" };
    let name = format!("{root}, trained on {masks} {cad}masks of {} ({digest})", said.dataset.title);
    let pairs = |drawn: &[Drawn]| drawn.iter().map(|one| one.pair.clone()).collect::<BTreeSet<String>>();
    let trained = json!({
        "from": setup.start.name,
        "from_sha256": *setup.start.id,
        "data": said.dataset.title,
        "masks": masks,
        "masks_from": setup.choice.from.key(),
        "pairs": pairs(&said.gathered.learned),
        "held_out": pairs(&said.gathered.held),
        "persons": said.gathered.persons,
        "steps": said.steps,
        "seed": setup.choice.seed,
        "before": said.before,
        "after": said.after,
    });
    new_bundle::write(WHAT, &setup.out, &setup.start, &BTreeMap::from([(Role::MaskUnet, graph)]), |_, manifest| {
        manifest["name"] = json!(name);
        let before = manifest["provenance"].take();
        let mut provenance = serde_json::Map::new();
        provenance.insert(TRAINED.into(), trained);
        if let Some(licence) = before.get("licence") {
            provenance.insert("licence".into(), licence.clone());
        }
        provenance.insert("start".into(), before);
        manifest["provenance"] = Value::Object(provenance);
        Ok(())
    })?;
    Ok(name)
}
