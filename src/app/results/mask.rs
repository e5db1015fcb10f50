//! Contact masks: the automatic ones, and which is in force.

use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::keys::{EstimateKey, ImprintKey, ImprintSource, MaskRecipe, MaskVersion};
use super::super::results::Demands;
use super::super::state::{Absent, Lookup, State};
use super::super::{recipe, results};
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::grid::Mask;
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::PadId;
use touch2touch_pipeline::labels::{DrawnMask, MaskPlace};

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

/// The automatic mask of one finger's imprint.
pub(crate) fn automatic_mask(state: &State, source: ImprintSource, finger: PadId) -> Lookup<'_, Arc<Mask>> {
    if results::imprint(state, source, finger).ready().is_none() {
        return results::imprint(state, source, finger).without();
    }
    let key = results::imprint_key(state, source, finger).and_then(|imprint| automatic(state, &imprint, finger));
    let found = state.look_or(key.map(Some), || None);
    found.and_then(Absent::NoContact, |made| Some(&made.contact().masks[finger].as_ref()?.mask))
}

/// The key of the automatic mask of an imprint.
fn automatic(state: &State, imprint: &ImprintKey, finger: PadId) -> Result<EstimateKey, Absent> {
    Ok(EstimateKey::mask(imprint, MaskVersion::Auto(mask_recipe(state, finger)?)))
}

/// The mask of an imprint: the drawn one, else the automatic one; `None` where none can be made.
pub(crate) fn mask_version(state: &State, imprint: &ImprintKey, finger: PadId) -> Option<MaskVersion> {
    if let Some(hand) = drawn_mask_on(state, imprint) {
        return Some(MaskVersion::Hand(hand.revision));
    }
    let key = automatic(state, imprint, finger).ok()?;
    let (_, mask) = key.parts[finger].clone()?;
    mask.filter(|_| state.failure(key).is_none())
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
    let key = results::imprint_key(state, source, finger).ok();
    let key = key.map(|imprint| EstimateKey::mask(&imprint, MaskVersion::Auto(recipe.clone())));
    let made = key.and_then(|key| state.results.estimates.get(&key));
    let found = made.and_then(|made| made.contact().masks[finger].as_ref());
    recipe.provenance(state.library.mask_model(recipe), found.map_or(MaskBasis::Source, |found| found.basis))
}

/// True where automatic masks take the CAD model, which is still being read.
pub(crate) fn awaits_tool(state: &State) -> bool {
    let cad = matches!(recipe::automatic_mask(state), Ok(MaskRecipe::Cad(_)));
    cad && matches!(results::tool(state), Lookup::Waiting)
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
    let key = results::imprint_key(state, source, finger).and_then(|imprint| automatic(state, &imprint, finger));
    match key {
        Ok(_) if awaits_tool(state) => results::want_tool(wants),
        Ok(key) => wants.ask(key),
        Err(_) => {}
    }
}
