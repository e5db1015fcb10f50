//! Contact masks: the automatic ones, and which is in force.

use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::jobs::{Job, Lane};
use super::super::keys::{ImprintKey, ImprintSource, MaskKey, MaskRecipe, MaskVersion, ToolKey};
use super::super::results::{Computes, Demands, gone};
use super::super::services::Services;
use super::super::state::results::Request;
use super::super::state::tasks::Level;
use super::super::state::{Absent, Lookup, State};
use super::super::{recipe, results};
use touch2touch_core::contact::{ContactMask, MaskBasis};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::labels::{DrawnMask, MaskPlace};
use touch2touch_pipeline::steps::mask::{MaskInputs, contact_mask};

/// A mask of an imprint; `None` if it is not there.
pub(crate) fn mask_of(state: &State, version: &MaskVersion, imprint: &ImprintKey) -> Option<ContactMask> {
    match version {
        MaskVersion::Auto(recipe) => {
            let key = MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
            Some((**state.results.masks.get(&key)?).clone())
        }
        MaskVersion::Hand(revision) => {
            let hand = drawn_mask_on(state, imprint).filter(|hand| hand.revision == *revision)?;
            Some(ContactMask { mask: hand.mask.clone(), basis: MaskBasis::Hand, unsure: None })
        }
    }
}

impl Computes for MaskKey {
    fn job(&self, state: &State, services: &Arc<Services>) -> Option<Job<ContactMask>> {
        let imprint = results::imprint_of(state, &self.imprint).ready()?.clone();
        let touch = self.imprint.touch();
        let sample = state.results.samples.get(&touch.pair)?.clone();
        let tool = state.library.entry(touch.pair.pair).and_then(|entry| entry.tool.as_deref());
        let tool = tool.map(|tool| ToolKey { dataset: touch.pair.dataset, name: tool.into() });
        let tool = tool.and_then(|key| state.results.tools.get(&key).cloned());
        let (lane, what, model) = match &self.recipe {
            MaskRecipe::Unet(id, _) => {
                (Lane::Models, "Contact mask by the mask model", Some(state.library.bundle(id)?.clone()))
            }
            _ => (Lane::Compute, "Contact mask", None),
        };
        let (services, engine, recipe) = (services.clone(), state.settings.runtime, self.recipe.clone());
        Some(Job::new(lane, what, move |_| {
            let tool = tool.as_deref().map(|tool| &tool.model);
            let inputs = MaskInputs { sample: &sample, tool, labels: None, of: None };
            let by_model = |imprint: &DepthMap| {
                let bundle = model.as_ref().ok_or_else(gone)?;
                services.models.mask(bundle, engine, imprint, recipe.probability())
            };
            contact_mask(&recipe, &imprint, touch.finger, inputs, by_model)
        }))
    }

    /// The log says once what a mask is made of where that is not what its recipe names.
    fn arrived(&self, state: &mut State, found: &Arc<ContactMask>) {
        let Some(why) = found.basis.note() else { return };
        let touch = self.imprint.touch();
        let first = state.results.noted.insert(Request::Mask(self.clone()));
        if let Some(entry) = state.library.entry(touch.pair.pair).filter(|_| first && state.is_selected(touch.pair)) {
            let text = format!("{}, {} finger: {why}", entry.name, state.finger_name(touch.finger));
            state.log.push(Level::Warning, text, None, None);
        }
    }
}

/// The mask in force.
#[derive(Clone, Debug)]
pub struct MaskInForce<'a> {
    /// The pixels, as large as the imprint.
    pub mask: &'a Arc<Mask>,
    /// The version that decides whether it has to be drawn again.
    pub version: MaskVersion,
    /// The provenance, for the screen.
    pub label: String,
}

/// The recipe of a finger's automatic mask.
///
/// # Errors
/// Why the source that the settings ask for cannot give one for this finger.
pub(crate) fn mask_recipe(state: &State, finger: PadId) -> Result<MaskRecipe, Absent> {
    let recipe = recipe::automatic_mask(state)?;
    match recipe {
        MaskRecipe::Cad(_) => {
            results::tool_name(state)?;
            let sample = results::sample(state).ready();
            if sample.is_some_and(|s| s.grasp_from_object.is_none()) {
                return Err(Absent::NoTruth);
            }
            if results::touch(state, finger).ready().is_some_and(|t| t.camera().is_none()) {
                return Err(Absent::NoCamera);
            }
        }
        MaskRecipe::Truth => {
            if results::touch(state, finger).ready().is_some_and(|t| t.depth().is_none_or(|b| b.truth.is_none())) {
                return Err(Absent::NotSimulated);
            }
        }
        MaskRecipe::Threshold(_) | MaskRecipe::TopPercent(_) | MaskRecipe::Unet(..) => {}
    }
    Ok(recipe)
}

/// The recipe of the automatic mask of one finger's imprint.
fn mask_key(state: &State, source: ImprintSource, finger: PadId) -> Result<MaskKey, Absent> {
    Ok(MaskKey { imprint: results::imprint_key(state, source, finger)?, recipe: mask_recipe(state, finger)? })
}

/// The automatic mask of one finger's imprint.
pub(crate) fn automatic_mask(state: &State, source: ImprintSource, finger: PadId) -> Lookup<'_, Arc<Mask>> {
    if results::imprint(state, source, finger).ready().is_none() {
        return results::imprint(state, source, finger).without();
    }
    state.look_or(mask_key(state, source, finger).map(Some), || None).map(|found| &found.mask)
}

/// The place of a mask that is drawn on one finger's imprint; `None` while there is no such imprint.
pub(crate) fn mask_place(state: &State, source: ImprintSource, finger: PadId) -> Option<MaskPlace> {
    Some(MaskPlace { pad: finger, of: results::imprint_key(state, source, finger).ok()?.of()? })
}

/// The places of masks that can be drawn on, of all that is on screen.
pub fn mask_places(state: &State) -> Vec<MaskPlace> {
    let places = |finger| ImprintSource::iter().filter_map(move |source| mask_place(state, source, finger));
    state.fingers().into_iter().flat_map(places).collect()
}

/// The mask that is in force on an imprint because a person drew it.
pub(crate) fn drawn_mask_on<'a>(state: &'a State, imprint: &ImprintKey) -> Option<&'a DrawnMask> {
    let touch = imprint.touch();
    let name = &state.library.entry(touch.pair.pair)?.name;
    let place = MaskPlace { pad: touch.finger, of: imprint.of()? };
    state.document.pair(name)?.drawn(&place, results::imprint_of(state, imprint).ready()?)
}

/// The corrected mask of one finger's imprint, if it is there and as large.
pub fn drawn_mask(state: &State, source: ImprintSource, finger: PadId) -> Option<&DrawnMask> {
    drawn_mask_on(state, &results::imprint_key(state, source, finger).ok()?)
}

/// The mask in force on one finger's imprint: the corrected one, else the automatic one.
///
/// # Errors
/// The look-up that stands in its place.
pub fn mask_in_force(
    state: &State,
    source: ImprintSource,
    finger: PadId,
) -> Result<MaskInForce<'_>, Lookup<'_, Arc<Mask>>> {
    if let Some(hand) = drawn_mask(state, source, finger) {
        let base = hand.base();
        let label = if base.is_empty() { "drawn by you".into() } else { format!("edited by you, from {base}") };
        return Ok(MaskInForce { mask: &hand.mask, version: MaskVersion::Hand(hand.revision), label });
    }
    let lookup = automatic_mask(state, source, finger);
    match (lookup, mask_recipe(state, finger)) {
        (Lookup::Ready(mask), Ok(recipe)) => {
            let label = automatic_provenance(state, source, finger, &recipe).text();
            Ok(MaskInForce { mask, version: MaskVersion::Auto(recipe), label })
        }
        (Lookup::Ready(_), Err(absent)) => Err(Lookup::Absent(absent)),
        (other, _) => Err(other),
    }
}

/// The provenance of the pixels of an automatic mask.
pub(crate) fn automatic_provenance(
    state: &State,
    source: ImprintSource,
    finger: PadId,
    recipe: &MaskRecipe,
) -> Provenance {
    let key = results::imprint_key(state, source, finger).map(|imprint| MaskKey { imprint, recipe: recipe.clone() });
    let found = key.ok().and_then(|key| state.results.masks.get(&key));
    recipe.provenance(state.library.mask_model(recipe), found.map_or(MaskBasis::Source, |found| found.basis))
}

pub(crate) fn want_mask(wants: &mut Demands<'_>, source: ImprintSource, finger: PadId) {
    let state = wants.state;
    // Stored corrections first: they may make the automatic mask unnecessary.
    if !state.document.stored.contains_key(state.pair_name())
        || drawn_mask(state, source, finger).is_some()
        || results::imprint(state, source, finger).ready().is_none()
    {
        return;
    }
    let Ok(key) = mask_key(state, source, finger) else { return };
    if matches!(key.recipe, MaskRecipe::Cad(_)) && results::tool(state).ready().is_none() {
        return results::want_tool(wants);
    }
    wants.ask(key);
}
