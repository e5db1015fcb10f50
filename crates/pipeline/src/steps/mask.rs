//! Contact masks: where they come from ([`MaskChoice`]), and how they are made.
//!
//! One rule, in the studio and in every verb: a mask drawn by hand wins where there is one, else the choice makes one,
//! and what was taken is said with the mask.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoStaticStr};

use crate::error::TaskError;
use crate::labels::{DrawnMask, ImprintOf, MaskPlace, PairLabels};
use touch2touch_core::bits::Bits;
use touch2touch_core::contact::{self, ContactMask, LAB_CAD_DISTANCE_M, MaskBasis};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{CadPose, Provenance};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad, Rig};
use touch2touch_core::sample::{PadTouch, Sample};
use touch2touch_core::units::text_mm;

const WHAT: &str = "Contact mask";

/// Source of a mask when nobody drew one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum MaskSource {
    /// The mask model, and where there is none, the threshold.
    #[default]
    Auto,
    /// The mask model.
    Unet,
    /// Imprint above a depth.
    Threshold,
    /// The deepest share of the pixels.
    TopPercent,
    /// Near the CAD model at the true pose: the lab's labels.
    Cad,
    /// The simulator's truth.
    Truth,
}

impl MaskSource {
    /// The name in files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "Auto",
            Self::Unet => "UNet",
            Self::Threshold => "Threshold",
            Self::TopPercent => "Top percent",
            Self::Cad => "CAD distance",
            Self::Truth => "Simulator truth",
        }
    }

    /// Description in a line.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Auto => "What the mask model predicts from the imprint; without a mask model, the threshold",
            Self::Unet => "What the mask model predicts from the imprint",
            Self::Threshold => "Pixels pushed in further than a depth",
            Self::TopPercent => "The deepest share of the pixels",
            Self::Cad => "Pixels whose membrane point lies near the CAD model at the true pose (the lab's labels)",
            Self::Truth => "What the simulator knows",
        }
    }
}

/// The source of the masks that nobody drew, with the number of each source that has one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MaskChoice {
    /// The source.
    pub source: MaskSource,
    /// Depth of the threshold source, meters.
    pub threshold_m: f32,
    /// Probability from which a pixel is contact for the mask model, 0..1; `None` takes the bundle's own.
    pub probability: Option<f32>,
    /// Share of the deepest pixels of the top-percent source, percent.
    pub top_percent: f32,
    /// Distance to the CAD surface of the CAD source, meters.
    pub cad_distance_m: f32,
}

impl Default for MaskChoice {
    fn default() -> Self {
        Self {
            source: MaskSource::default(),
            // The middle of the thresholds that the lab used for its tools (0.0048 to 0.0053 m).
            threshold_m: 0.005,
            probability: None,
            top_percent: 15.0,
            cad_distance_m: LAB_CAD_DISTANCE_M as f32,
        }
    }
}

impl MaskChoice {
    /// The choice that a recipe's identity does not name. Part of the format: it stays when the default changes.
    pub(crate) const UNNAMED: Self = Self {
        source: MaskSource::Auto,
        threshold_m: 0.005,
        probability: None,
        top_percent: 15.0,
        cad_distance_m: 0.001,
    };

    /// Choice with the numbers of its own source only; those of other sources are as they go without saying.
    #[must_use]
    pub(crate) fn of_its_source(&self) -> Self {
        let Self { source, threshold_m, probability, top_percent, cad_distance_m } = *self;
        // + 0.0 turns -0 into 0, which means the same.
        let threshold_m = threshold_m + 0.0;
        let from = Self { source, ..Self::UNNAMED };
        match source {
            MaskSource::Auto => Self { threshold_m, probability, ..from },
            MaskSource::Unet => Self { probability, ..from },
            MaskSource::Threshold => Self { threshold_m, ..from },
            MaskSource::TopPercent => Self { top_percent, ..from },
            MaskSource::Cad => Self { cad_distance_m, ..from },
            MaskSource::Truth => from,
        }
    }

    /// The recipe, `model` being the mask model's identity; `None` if it takes a model and there is none.
    pub fn recipe(&self, model: Option<&Arc<str>>) -> Option<MaskRecipe> {
        let threshold = MaskRecipe::Threshold(self.threshold_m.into());
        let unet = |model: &Arc<str>| MaskRecipe::Unet(model.clone(), self.probability.map(Bits::from));
        Some(match self.source {
            MaskSource::Auto => model.map_or(threshold, unet),
            MaskSource::Unet => unet(model?),
            MaskSource::Threshold => threshold,
            MaskSource::TopPercent => MaskRecipe::TopPercent(self.top_percent.into()),
            MaskSource::Cad => MaskRecipe::Cad(self.cad_distance_m.into()),
            MaskSource::Truth => MaskRecipe::Truth,
        })
    }
}

/// An automatic mask's recipe.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MaskRecipe {
    /// Imprint above a depth in meters.
    Threshold(Bits),
    /// The deepest share of the pixels, in percent.
    TopPercent(Bits),
    /// Within a distance (meters) of the CAD model at the true pose.
    Cad(Bits),
    /// A mask model, by its bundle's identity, with the least probability of contact where it is not the bundle's own.
    Unet(Arc<str>, Option<Bits>),
    /// The simulator's truth.
    Truth,
}

impl MaskRecipe {
    /// The recipe on touches of this rig: a gel gives way by a tenth of what a membrane does, so that the lengths that go
    /// without saying are its own.
    #[must_use]
    pub(super) fn on(self, rig: &Rig) -> Self {
        let unsaid = MaskChoice::UNNAMED;
        match self {
            Self::Threshold(m) if rig.is_gel() && m.get() == unsaid.threshold_m => {
                Self::Threshold(contact::GEL_CONTACT_M.into())
            }
            Self::Cad(m) if rig.is_gel() && m.get() == unsaid.cad_distance_m => {
                Self::Cad(contact::GEL_CONTACT_M.into())
            }
            same => same,
        }
    }

    /// Provenance of the pixels of its masks; `model` is the mask model's name, and `basis` what a mask is made of in
    /// the end.
    pub fn provenance(&self, model: &str, basis: MaskBasis) -> Provenance {
        match (basis, self) {
            (MaskBasis::Flat, _) => Provenance::Flat,
            (MaskBasis::Depth(min_m), _) => Provenance::Depth { min_m, instead_of: self.label(model) },
            (_, Self::Threshold(min_m)) => Provenance::Threshold { min_m: min_m.get() },
            (_, Self::TopPercent(percent)) => Provenance::TopPercent { percent: percent.get() },
            (_, Self::Cad(within_m)) => Provenance::Cad { within_m: within_m.get(), at: CadPose::Truth },
            (_, Self::Unet(id, least)) => {
                Provenance::Model { name: model.into(), id: id.to_string(), probability: least.map(Bits::get) }
            }
            (_, Self::Truth) => Provenance::Truth,
        }
    }

    /// In words, with its number; `model` is the mask model's name.
    pub fn label(&self, model: &str) -> String {
        self.provenance(model, MaskBasis::Source).text()
    }

    /// The source that it is of.
    pub fn source(&self) -> MaskSource {
        match self {
            Self::Threshold(_) => MaskSource::Threshold,
            Self::TopPercent(_) => MaskSource::TopPercent,
            Self::Cad(_) => MaskSource::Cad,
            Self::Unet(..) => MaskSource::Unet,
            Self::Truth => MaskSource::Truth,
        }
    }
}

/// Inputs that masks of a pair can be made from, besides its imprints.
#[derive(Clone, Copy, Debug)]
pub struct MaskInputs<'a> {
    /// The pair.
    pub sample: &'a Sample,
    /// Tool of the pair, for [`MaskRecipe::Cad`].
    pub tool: Option<&'a ToolModel>,
    /// Labels that people gave the pair; `None` leaves them out.
    pub labels: Option<&'a PairLabels>,
    /// The imprint that masks are made for; `None` where nobody can have drawn on it.
    pub of: Option<&'a ImprintOf>,
}

impl<'a> MaskInputs<'a> {
    /// The measured imprint of a pair.
    pub fn measured(sample: &'a Sample, tool: Option<&'a ToolModel>, labels: Option<&'a PairLabels>) -> Self {
        Self { sample, tool, labels, of: Some(&ImprintOf::Measured) }
    }

    /// The mask that is in force on this imprint of a pad because a person drew it.
    pub(crate) fn drawn(&self, pad: PadId, imprint: &DepthMap) -> Option<&'a DrawnMask> {
        self.labels?.drawn(&MaskPlace { pad, of: self.of?.clone() }, imprint)
    }
}

/// The mask of one pad's imprint: the one drawn by hand, else by the recipe; `unet` runs the mask model.
///
/// # Errors
/// If something the recipe needs is not there, the sizes differ, or the model fails.
pub fn contact_mask(
    recipe: &MaskRecipe,
    imprint: &DepthMap,
    pad: PadId,
    inputs: MaskInputs<'_>,
    unet: impl FnOnce(&DepthMap) -> Result<ContactMask, TaskError>,
) -> Result<ContactMask, TaskError> {
    if let Some(hand) = inputs.drawn(pad, imprint) {
        return Ok(ContactMask { mask: hand.mask.clone(), basis: MaskBasis::Hand, unsure: None });
    }
    let touch = inputs.sample.pad(pad);
    let mask = match recipe {
        MaskRecipe::Threshold(min_m) => contact::threshold(imprint, min_m.get()),
        MaskRecipe::TopPercent(percent) => contact::top_percent(imprint, f64::from(percent.get()), f32::NEG_INFINITY),
        MaskRecipe::Cad(limit_m) => {
            let camera = touch
                .and_then(PadTouch::camera)
                .ok_or_else(|| TaskError::new(WHAT, "this source has no depth camera"))?;
            let tool = inputs.tool.ok_or_else(|| TaskError::new(WHAT, "the tool's CAD model is not there"))?;
            let truth = inputs.sample.grasp_from_object;
            let truth = truth.ok_or_else(|| TaskError::new(WHAT, "the true pose is not known"))?;
            let within_m = f64::from(limit_m.get());
            let mask = contact::cad_signed_distance(imprint, camera, &tool.distance, truth.inverse(), within_m)
                .map_err(|err| TaskError::from_error(WHAT, &err))?;
            check_contact(imprint, &mask, &inputs.sample.rig)?;
            mask
        }
        MaskRecipe::Truth => {
            let truth = touch
                .and_then(|t| t.depth()?.truth.as_ref())
                .ok_or_else(|| TaskError::new(WHAT, "only simulated data knows the true contact"))?;
            truth.contact.clone()
        }
        MaskRecipe::Unet(..) => return unet(imprint),
    };
    // A flat imprint has no contact.
    Ok(contact::settled(imprint, mask, contact::flat_m(&inputs.sample.rig)))
}

/// Refuses a mask of the CAD model at the true pose where nothing was touched: it would give the pose that it was made from.
fn check_contact(imprint: &DepthMap, mask: &Mask, rig: &Rig) -> Result<(), TaskError> {
    let least_m = contact::flat_m(rig);
    let above = contact::stands_out(imprint, mask).filter(|above| *above < least_m);
    // A flat imprint has no contact, whatever the mask.
    let Some(above) = above.filter(|_| contact::rise(imprint) >= least_m) else { return Ok(()) };
    let why = format!(
        "where the CAD model lies at the true pose the imprint is {} above what lies around it: nothing was felt there, and the \
         mask would only repeat the pose",
        text_mm(f64::from(above))
    );
    Err(TaskError::new(WHAT, why).with_hint("Check pose, CAD model and imprint, for instance with the doctor."))
}

/// Bases of a pair's masks in words, from the keys of each pad in turn; see [`Contact::made_of`].
pub fn made_of(mut keys: Vec<&'static str>, source: &'static str) -> String {
    keys.dedup();
    if keys.is_empty() { source.to_owned() } else { keys.join(", ") }
}

/// The imprints of a pair with their contact masks.
#[derive(Clone, Debug)]
pub struct Contact {
    /// Meters, raw orientation.
    pub imprints: PerPad<DepthMap>,
    /// One for each imprint.
    pub masks: PerPad<ContactMask>,
    /// Recipe of the masks that nobody drew.
    pub recipe: MaskRecipe,
    /// The name of the mask model, where there is one.
    pub model: Option<String>,
}

impl Contact {
    /// Source of the masks that nobody drew.
    pub fn source(&self) -> MaskSource {
        self.recipe.source()
    }

    /// Bases of the masks in words: the key of the source; `hand` where one was drawn, `depth` where the model found
    /// nothing, `flat` where there is no contact; of the pads in turn where they differ.
    pub fn made_of(&self) -> String {
        let source = self.source().key();
        made_of(self.masks.iter().flatten().map(|m| m.basis.key(source)).collect(), source)
    }

    /// In words, by pad, why masks are not of the source that was asked.
    pub fn notes(&self, rig: &Rig) -> Vec<String> {
        let note =
            |(pad, found): (PadId, &ContactMask)| Some(format!("{} finger: {}", rig.pad_key(pad), found.basis.note()?));
        self.masks.entries().filter_map(note).collect()
    }
}

/// Error where a mask model is asked for and there is none.
pub(crate) fn no_mask_model() -> TaskError {
    TaskError::new("Contact mask", "no mask model was found").with_hint("Name one with an option, or another source.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::diffusion::GenerateConfig;
    use touch2touch_core::postprocess::ShiftMode;
    use touch2touch_core::rig::lab;

    #[test]
    fn auto_is_the_model_or_else_the_threshold_and_a_drawn_mask_wins_over_all() {
        let (choice, id) = (MaskChoice::default(), Arc::from("id"));
        assert_eq!(choice.recipe(Some(&id)), Some(MaskRecipe::Unet(id.clone(), None)));
        let own = MaskChoice { probability: Some(0.3), ..choice };
        assert_eq!(own.recipe(Some(&id)), Some(MaskRecipe::Unet(id.clone(), Some(0.3.into()))));
        assert_eq!(own.recipe(None), choice.recipe(None));
        assert_eq!(choice.recipe(None), Some(MaskRecipe::Threshold(0.005.into())));
        assert_eq!(MaskChoice { source: MaskSource::Unet, ..choice }.recipe(None), None);
        let imprint = DepthMap::from_fn(175, 140, |x, _| if x < 60 { 0.008 } else { 0.0 });
        let sample = Sample::default();
        let drawn = Mask::from_fn(175, 140, |x, _| x > 170);
        let hand = DrawnMask::new(drawn.clone(), Provenance::Nothing);
        let mut labels = PairLabels::default();
        labels.draw(&MaskPlace::measured(lab::LEFT), Some(hand));
        let inputs = MaskInputs::measured(&sample, None, Some(&labels));
        let threshold = MaskRecipe::Threshold(0.005.into());
        let never = |_: &DepthMap| panic!("no model is asked");
        let right = contact_mask(&threshold, &imprint, lab::RIGHT, inputs, never).unwrap();
        let left = contact_mask(&threshold, &imprint, lab::LEFT, inputs, never).unwrap();
        assert_eq!((right.basis, left.basis), (MaskBasis::Source, MaskBasis::Hand));
        assert_eq!(*left.mask, drawn);
        // One of another size is of another image.
        let small = DepthMap::from_fn(60, 60, |x, _| if x < 30 { 0.008 } else { 0.0 });
        assert_eq!(contact_mask(&threshold, &small, lab::LEFT, inputs, never).unwrap().basis, MaskBasis::Source);
        // A mask is of one picture of the touch: not of a prediction, and not of one with another seed.
        let of =
            |seed| ImprintOf::predicted("id", &GenerateConfig { seed, ..GenerateConfig::default() }, ShiftMode::Raw);
        let on = |of: &ImprintOf, labels: &PairLabels| {
            let inputs = MaskInputs { sample: &sample, tool: None, labels: Some(labels), of: Some(of) };
            contact_mask(&threshold, &imprint, lab::LEFT, inputs, never).unwrap().basis
        };
        assert_eq!(on(&of(1), &labels), MaskBasis::Source);
        let hand = labels.measured(lab::LEFT).cloned();
        labels.draw(&MaskPlace { pad: lab::LEFT, of: of(1) }, hand);
        assert_eq!((on(&of(1), &labels), on(&of(2), &labels)), (MaskBasis::Hand, MaskBasis::Source));
        let masks = [Some(right), Some(left)].into();
        let contact = Contact { imprints: PerPad::default(), masks, recipe: threshold, model: None };
        assert_eq!(contact.made_of(), "threshold, hand");
        assert!(contact.notes(&Rig::lab()).is_empty());
        for source in <MaskSource as strum::IntoEnumIterator>::iter() {
            assert_eq!(source.key().parse(), Ok(source));
            assert_eq!(serde_json::to_value(source).unwrap(), source.key());
        }
    }
}
