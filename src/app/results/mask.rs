//! Contact masks: the automatic ones, and which is in force.

use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::keys::{MaskRecipe, Revision};
use super::super::labels::state::{DrawnMask, MaskPlace};
use super::super::pane::Pane;
use super::super::tasks::state::Level;
use super::Request;
use super::imprint::ImprintKey;
use super::tool::ToolKey;
use super::{Absent, Computes, Demands, ImprintSource, Job, Lane, Lookup, SharedServices, State};
use touch2touch_core::bits::Bits;
use touch2touch_core::contact::{ContactMask, MaskBasis};
use touch2touch_core::grid::Mask;
use touch2touch_core::label::Provenance;
use touch2touch_core::rig::PadId;
use touch2touch_work::bundles::BundleKind;
use touch2touch_work::mask::{self, MaskInputs};

/// An automatic mask of one imprint.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaskKey {
    /// The imprint.
    pub imprint: ImprintKey,
    /// The recipe.
    pub recipe: MaskRecipe,
}

/// The mask in force, as part of a recipe.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskVersion {
    /// Automatic.
    Auto(MaskRecipe),
    /// Corrected by hand.
    Hand(Revision),
}

impl MaskVersion {
    /// The pixels, for an imprint; `None` if they are not there.
    pub(crate) fn find(&self, state: &State, imprint: &ImprintKey) -> Option<Arc<Mask>> {
        match self {
            Self::Auto(recipe) => {
                let key = MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
                state.results.masks.get(&key).map(|found| found.mask.clone())
            }
            Self::Hand(revision) => {
                let hand = state.drawn_mask_on(imprint)?;
                (hand.revision == *revision).then(|| hand.mask.clone())
            }
        }
    }
}

/// An automatic mask.
#[derive(Clone, Debug)]
pub struct AutomaticMask {
    /// The pixels in contact.
    pub mask: Arc<Mask>,
    /// What it is made of in the end.
    pub basis: MaskBasis,
    /// As [`ContactMask::unsure`].
    pub unsure: Option<f64>,
}

impl From<ContactMask> for AutomaticMask {
    fn from(found: ContactMask) -> Self {
        Self { mask: Arc::new(found.mask), basis: found.basis, unsure: found.unsure }
    }
}

impl Computes for MaskKey {
    type Value = AutomaticMask;

    fn job(&self, state: &State, services: &SharedServices) -> Option<Job<AutomaticMask>> {
        let imprint = self.imprint.find(state)?;
        let touch = self.imprint.touch();
        let sample = state.results.samples.get(&touch.pair)?.clone();
        if let MaskRecipe::Unet(id, least) = &self.recipe {
            let (services, runtime, least) = (services.clone(), state.settings.runtime, least.map(Bits::get));
            let bundle = state.library.bundle(id)?.clone();
            return Some(Job::new(Lane::Models, "Contact mask by the mask model", move |_| {
                Ok(services.mask_by_model(&bundle, runtime, imprint.get()?, least)?.into())
            }));
        }
        let recipe = self.recipe.clone();
        let tool = state.library.entry(touch.pair.pair).and_then(|entry| entry.tool.as_deref());
        let tool = tool.map(|tool| ToolKey { dataset: touch.pair.dataset, name: tool.into() });
        let tool = tool.and_then(|key| state.results.tools.get(&key).cloned());
        Some(Job::new(Lane::Compute, "Contact mask", move |_| {
            let tool = tool.as_deref().map(|tool| &tool.model);
            let inputs = MaskInputs { sample: &sample, tool, labels: None, of: None };
            Ok(mask::without_model(&recipe, imprint.get()?, touch.finger, inputs)?.into())
        }))
    }

    fn bytes(found: &AutomaticMask) -> usize {
        found.mask.len()
    }

    /// The log says once what a mask is made of where that is not what its recipe names.
    fn arrived(&self, state: &mut State, found: &Arc<AutomaticMask>) {
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
    /// What decides whether it has to be drawn again.
    pub version: MaskVersion,
    /// Where it comes from, for the screen.
    pub label: String,
}

impl State {
    /// The recipe of the automatic masks that the settings ask for, of whatever pair.
    ///
    /// # Errors
    /// Why the source that the settings ask for cannot give one.
    pub(crate) fn automatic_recipe(&self) -> Result<MaskRecipe, Absent> {
        let model = self.bundle(BundleKind::Mask).map(|bundle| &bundle.id);
        self.settings.mask.choice.recipe(model.ok()).ok_or(Absent::NoMaskModel)
    }

    /// The recipe of a finger's automatic mask.
    ///
    /// # Errors
    /// Why the source that the settings ask for cannot give one for this finger.
    pub(crate) fn mask_recipe(&self, finger: PadId) -> Result<MaskRecipe, Absent> {
        let recipe = self.automatic_recipe()?;
        match recipe {
            MaskRecipe::Cad(_) => {
                self.tool_name()?;
                let sample = self.sample().ready();
                if sample.is_some_and(|s| s.grasp_from_object.is_none()) {
                    return Err(Absent::NoTruth);
                }
                if self.touch(finger).ready().is_some_and(|t| t.camera().is_none()) {
                    return Err(Absent::NoCamera);
                }
            }
            MaskRecipe::Truth => {
                if self.touch(finger).ready().is_some_and(|t| t.depth().is_none_or(|b| b.truth.is_none())) {
                    return Err(Absent::NotSimulated);
                }
            }
            MaskRecipe::Threshold(_) | MaskRecipe::TopPercent(_) | MaskRecipe::Unet(..) => {}
        }
        Ok(recipe)
    }

    /// The recipe of the automatic mask of one finger's imprint.
    fn mask_key(&self, source: ImprintSource, finger: PadId) -> Result<MaskKey, Absent> {
        Ok(MaskKey { imprint: self.imprint_key(source, finger)?, recipe: self.mask_recipe(finger)? })
    }

    /// The automatic mask of one finger's imprint.
    pub(crate) fn automatic_mask(&self, source: ImprintSource, finger: PadId) -> Lookup<'_, Arc<Mask>> {
        if self.imprint(source, finger).ready().is_none() {
            return self.imprint(source, finger).without();
        }
        self.look_or(self.mask_key(source, finger).map(Some), || None).map(|found| &found.mask)
    }

    /// Where a mask that is drawn on one finger's imprint belongs; `None` while there is no such imprint.
    pub(crate) fn mask_place(&self, source: ImprintSource, finger: PadId) -> Option<MaskPlace> {
        Some(MaskPlace { pad: finger, of: self.imprint_key(source, finger).ok()?.of()? })
    }

    /// What can be drawn on of what is on screen.
    pub fn mask_places(&self) -> Vec<MaskPlace> {
        let places = |finger| ImprintSource::iter().filter_map(move |source| self.mask_place(source, finger));
        self.fingers().into_iter().flat_map(places).collect()
    }

    /// The mask that is in force on an imprint because a person drew it.
    pub(crate) fn drawn_mask_on(&self, imprint: &ImprintKey) -> Option<&DrawnMask> {
        let touch = imprint.touch();
        let name = &self.library.entry(touch.pair.pair)?.name;
        let place = MaskPlace { pad: touch.finger, of: imprint.of()? };
        self.document.pair(name)?.drawn(&place, imprint.find(self)?.get().ok()?)
    }

    /// The corrected mask of one finger's imprint, if it is there and as large.
    pub fn drawn_mask(&self, source: ImprintSource, finger: PadId) -> Option<&DrawnMask> {
        self.drawn_mask_on(&self.imprint_key(source, finger).ok()?)
    }

    /// The mask in force on one finger's imprint: the corrected one, else the automatic one.
    ///
    /// # Errors
    /// What is there instead.
    pub fn mask_in_force(
        &self,
        source: ImprintSource,
        finger: PadId,
    ) -> Result<MaskInForce<'_>, Lookup<'_, Arc<Mask>>> {
        if let Some(hand) = self.drawn_mask(source, finger) {
            let base = hand.base();
            let label = if base.is_empty() { "By hand".into() } else { format!("By hand, from {base}") };
            return Ok(MaskInForce { mask: &hand.mask, version: MaskVersion::Hand(hand.revision), label });
        }
        let lookup = self.automatic_mask(source, finger);
        match (lookup, self.mask_recipe(finger)) {
            (Lookup::Ready(mask), Ok(recipe)) => {
                let label = self.automatic_provenance(source, finger, &recipe).text();
                Ok(MaskInForce { mask, version: MaskVersion::Auto(recipe), label })
            }
            (Lookup::Ready(_), Err(absent)) => Err(Lookup::Absent(absent)),
            (other, _) => Err(other),
        }
    }

    /// The mask of what lies near the CAD model, which the gate of the mask tools may need.
    fn gate_key(&self, source: ImprintSource, finger: PadId) -> Option<MaskKey> {
        let recipe = MaskRecipe::Cad(self.settings.mask.gate.cad_m?.into());
        Some(MaskKey { imprint: self.imprint_key(source, finger).ok()?, recipe })
    }

    /// Whether what the gate needs to know of the CAD model is there.
    pub(crate) fn gate_is_known(&self, source: ImprintSource, finger: PadId) -> bool {
        self.gate_key(source, finger).is_none_or(|key| self.results.masks.get(&key).is_some())
    }

    /// The pixels that a hand may change; `None` = all.
    ///
    /// # Errors
    /// Why that is not known.
    pub fn allowed(&self, source: ImprintSource, finger: PadId) -> Result<Option<Mask>, &'static str> {
        let gate = self.settings.mask.gate;
        if gate.is_open() {
            return Ok(None);
        }
        let near = match self.gate_key(source, finger) {
            Some(key) => {
                let unknown = "what lies near the CAD model is not known: it takes a tool and its true pose";
                Some(self.results.masks.get(&key).ok_or(unknown)?)
            }
            None => None,
        };
        let imprint = self.imprint(source, finger).ready().ok_or("the imprint is not there")?;
        Ok(Some(gate.allowed(imprint, near.map(|near| &*near.mask))))
    }

    /// Where the pixels of an automatic mask come from.
    pub(crate) fn automatic_provenance(&self, source: ImprintSource, finger: PadId, recipe: &MaskRecipe) -> Provenance {
        let key = self.imprint_key(source, finger).map(|imprint| MaskKey { imprint, recipe: recipe.clone() });
        let found = key.ok().and_then(|key| self.results.masks.get(&key));
        recipe.provenance(self.model_of(recipe), found.map_or(MaskBasis::Source, |found| found.basis))
    }

    /// The name of the mask model that a recipe takes; empty where it takes none.
    pub(crate) fn model_of(&self, recipe: &MaskRecipe) -> &str {
        match recipe {
            MaskRecipe::Unet(id, _) => self.library.bundle(id).map_or("", |bundle| &bundle.name),
            _ => "",
        }
    }
}

impl Demands<'_> {
    pub(crate) fn mask(&mut self, source: ImprintSource, finger: PadId) {
        let state = self.state;
        if let Some(key) = state.gate_key(source, finger).filter(|_| state.selection.panes.contains(&Pane::Masks)) {
            let can = state.sample().ready().is_some_and(|sample| sample.grasp_from_object.is_some());
            if can && state.imprint(source, finger).ready().is_some() && state.tool_name().is_ok() {
                if state.tool().ready().is_none() {
                    self.tool();
                } else {
                    self.ask(key);
                }
            }
        }
        // Stored corrections first: they may make the automatic mask unnecessary.
        if !state.document.stored.contains_key(state.pair_name())
            || state.drawn_mask(source, finger).is_some()
            || state.imprint(source, finger).ready().is_none()
        {
            return;
        }
        let Ok(key) = state.mask_key(source, finger) else { return };
        if matches!(key.recipe, MaskRecipe::Cad(_)) && state.tool().ready().is_none() {
            return self.tool();
        }
        self.ask(key);
    }
}
