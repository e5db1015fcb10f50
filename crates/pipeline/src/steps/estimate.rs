//! [`estimate`]: the way from a touch to its pose. No other place strings its steps together.

use std::sync::Arc;

use glam::DVec3;
use strum::IntoEnumIterator as _;

use crate::error::TaskError;
use crate::infer::mask::contact_of;
use crate::io::dataset::Dataset;
use crate::job::JobCx;
use crate::labels::{ImprintSource, PairLabels};
use crate::steps::cloud::{Clouds, clouds, contact_points, images};
use crate::steps::imprint::{imprints_of, measured};
use crate::steps::mask::{Contact, MaskInputs, contact_mask, no_mask_model};
use crate::steps::models::Models;
use crate::steps::pose::{PoseResult, pose};
use crate::steps::prediction::Prediction;
use crate::steps::recipe::{Recipe, Stage};
use touch2touch_core::align::{Ask, Contacts, PadImage, Register};
use touch2touch_core::contact::GEL_CONTACT_M;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::grid::{DepthMap, Grid};
use touch2touch_core::pose::ToolModel;
use touch2touch_core::rig::{PadId, PerPad};
use touch2touch_core::sample::{Sample, Scale};
use touch2touch_core::verdict::Verdict;
use touch2touch_core::which_tool::{Candidate, which_tool};

/// A pair with what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Touch<'a> {
    /// The data set.
    pub dataset: &'a Dataset,
    /// Place of the pair in the data set.
    pub pair: PairId,
    /// The pair itself.
    pub sample: &'a Sample,
    /// The tool; `Err` says why there is none.
    pub tool: Result<&'a ToolModel, &'a TaskError>,
    /// Labels that people gave the pair.
    pub labels: &'a PairLabels,
}

/// The mask model's probability of contact at each pixel of its own grid, and from which on it calls that contact.
pub(crate) type Probability = Arc<(Grid<f32>, f32)>;

/// Results of a touch by a recipe, as far as they were asked for. They are cheap to copy.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    recipe: Recipe,
    reached: Option<Stage>,
    /// Predictions of the generator; empty where the imprints are measured.
    pub predictions: Arc<PerPad<Prediction>>,
    /// Meters, raw orientation.
    pub imprints: Arc<PerPad<DepthMap>>,
    probabilities: PerPad<Probability>,
    /// Pads whose masks cannot be made.
    unmasked: Vec<PadId>,
    contact: Option<Arc<Contact>>,
    /// All of the surface is lifted, not the contact points alone.
    whole: bool,
    /// A pose has no verdict.
    unjudged: bool,
    surface: Option<Arc<Clouds>>,
    points: Option<Arc<Result<Vec<DVec3>, TaskError>>>,
    pose: Option<Arc<Result<PoseResult, TaskError>>>,
}

/// The results of a touch up to a stage.
///
/// # Errors
/// If prediction, imprint or mask cannot be made. That there are no points or no pose is a result, with the reason.
pub fn estimate(
    touch: Touch<'_>,
    recipe: &Recipe,
    stage: Stage,
    models: &Models,
    cx: &JobCx,
) -> Result<Estimate, TaskError> {
    Estimate::new(recipe).reach(touch, stage, models, cx)
}

/// The part of a tool that is pressed into the gels of a touch, which is all that they feel of it; `None` on other sensors,
/// and where the tool does not reach them.
fn pressed_in(sample: &Sample, tool: &ToolModel) -> Option<ToolModel> {
    if !sample.rig.is_gel() {
        return None;
    }
    let camera = sample.pads.entries().find_map(|(_, touch)| touch.camera())?;
    let gel_m = camera.grasp_from_camera.translation.x.abs() - f64::from(*camera.depth_reference.get(0, 0)?);
    ToolModel::new(tool.mesh.beyond(gel_m + f64::from(GEL_CONTACT_M))).ok()
}

impl Estimate {
    /// Nothing yet, by a recipe.
    pub fn new(recipe: &Recipe) -> Self {
        Self { recipe: recipe.clone(), ..Self::default() }
    }

    /// Imprints of a recipe that were made before.
    pub fn with_imprints(recipe: &Recipe, imprints: PerPad<DepthMap>) -> Self {
        Self { imprints: Arc::new(imprints), reached: Some(Stage::Imprint), ..Self::new(recipe) }
    }

    /// Imprints that no recipe makes, such as the mean of several. Nobody can have drawn on them.
    pub fn of_imprints(recipe: &Recipe, imprints: PerPad<DepthMap>) -> Self {
        Self::with_imprints(&Recipe { hand: false, ..recipe.clone() }, imprints)
    }

    /// Predictions of a recipe that were made before.
    pub fn of_predictions(recipe: &Recipe, predictions: PerPad<Prediction>) -> Self {
        Self { predictions: Arc::new(predictions), reached: Some(Stage::Prediction), ..Self::new(recipe) }
    }

    /// Itself without masks of some pads: none can be made.
    #[must_use]
    pub fn without_masks(self, unmasked: Vec<PadId>) -> Self {
        Self { unmasked, ..self }
    }

    /// Takes over what another estimate knows of the imprint of a pad, which is the same: its prediction, and what the mask
    /// model said of it.
    pub fn take_over(&mut self, pad: PadId, other: &Self) {
        if let Some(made) = &other.predictions[pad] {
            Arc::make_mut(&mut self.predictions)[pad] = Some(made.clone());
        }
        if self.recipe.mask_model == other.recipe.mask_model && self.recipe.engine == other.recipe.engine {
            self.probabilities[pad].clone_from(&other.probabilities[pad]);
        }
    }

    /// True where it is known what the mask model says of the imprint of a pad.
    pub fn has_probability(&self, pad: PadId) -> bool {
        self.probabilities[pad].is_some()
    }

    /// Itself with all surface points from [`Stage::Cloud`] on, the contact points marked.
    #[must_use]
    pub fn with_surface(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Itself with poses that have no verdict, where only the pose counts.
    #[must_use]
    pub(crate) fn without_verdict(self) -> Self {
        Self { unjudged: true, ..self }
    }

    /// The pose that one from other imprints is compared with: the true one, or that of the measured imprints of pictures,
    /// which know no true pose.
    ///
    /// # Errors
    /// If the mask of the measured imprints cannot be made.
    pub(crate) fn compared_with(
        touch: Touch<'_>,
        recipe: &Recipe,
        models: &Models,
        cx: &JobCx,
    ) -> Result<Option<PlanarPose>, TaskError> {
        if touch.sample.scale == Scale::Measured {
            return Ok(touch.sample.grasp_from_object);
        }
        let imprints = touch.sample.pads.clone().map(|touch| Some(touch?.depth()?.imprint.clone()));
        let recipe = Recipe { imprint: ImprintSource::Measured, generator: None, ..recipe.clone() };
        let estimate = Self::with_imprints(&recipe, imprints);
        let estimate = estimate.without_verdict().reach(touch, Stage::Pose, models, cx)?;
        Ok(estimate.pose().ok().map(|found| found.grasp_from_object))
    }

    /// The part of it that another recipe makes just so.
    #[must_use]
    pub fn again(&self, recipe: &Recipe) -> Self {
        let mut estimate = Self::new(recipe);
        for stage in Stage::iter() {
            if self.reached < Some(stage) || self.recipe.until(stage) != recipe.until(stage) {
                break;
            }
            estimate.reached = Some(stage);
            match stage {
                Stage::Prediction => estimate.predictions = self.predictions.clone(),
                Stage::Imprint => {
                    estimate.imprints = self.imprints.clone();
                    if self.recipe.mask_model == recipe.mask_model && self.recipe.engine == recipe.engine {
                        estimate.probabilities = self.probabilities.clone();
                    }
                }
                Stage::Mask => estimate.contact = self.contact.clone(),
                Stage::Cloud => (estimate.points, estimate.surface) = (self.points.clone(), self.surface.clone()),
                Stage::Pose => estimate.pose = self.pose.clone(),
            }
        }
        estimate
    }

    /// Results of the touch up to a later stage.
    ///
    /// # Errors
    /// As [`estimate`]; with [`Self::with_surface`] also if the points cannot be lifted.
    pub fn reach(mut self, touch: Touch<'_>, stage: Stage, models: &Models, cx: &JobCx) -> Result<Self, TaskError> {
        let sample = touch.sample;
        for next in Stage::iter().filter(|next| *next <= stage) {
            if self.reached >= Some(next) {
                continue;
            }
            match next {
                Stage::Prediction if self.recipe.imprint == ImprintSource::Predicted => {
                    self.predictions = Arc::new(self.recipe.generating()?.pair(models, sample, cx)?);
                }
                Stage::Prediction => {}
                Stage::Imprint => {
                    self.imprints = Arc::new(match self.recipe.imprint {
                        ImprintSource::Measured => measured(sample),
                        ImprintSource::Predicted => imprints_of(&self.predictions, self.recipe.shift, sample)?,
                    });
                }
                Stage::Mask => {
                    let (recipe, of) = (self.recipe.mask_recipe(&sample.rig)?, self.recipe.imprint_of());
                    let labels = self.recipe.hand.then_some(touch.labels);
                    let inputs = MaskInputs { sample, tool: touch.tool.ok(), labels, of: Some(&of) };
                    let (imprints, unmasked) = ((*self.imprints).clone(), self.unmasked.clone());
                    let mut masks = PerPad::default();
                    for (pad, imprint) in imprints.entries().filter(|(pad, _)| !unmasked.contains(pad)) {
                        let unet = |imprint: &DepthMap| {
                            let (found, least) = self.probability(pad, models)?;
                            Ok(contact_of(&found.0, imprint, least))
                        };
                        let found = contact_mask(&recipe, imprint, pad, inputs, unet).map_err(|err| TaskError {
                            why: format!("{} finger: {}", sample.rig.pad_key(pad), err.why),
                            ..err
                        });
                        masks[pad] = Some(found?);
                    }
                    let model = self.recipe.mask_model.as_ref().map(|model| model.name.clone());
                    self.contact = Some(Arc::new(Contact { imprints, masks, recipe, model }));
                }
                Stage::Cloud => {
                    let Contact { imprints, masks, .. } = self.contact();
                    let (imprints, masks) = (imprints.as_ref(), masks.as_ref().map(|found| Some(&*found?.mask)));
                    let surface = if self.whole { Some(clouds(sample, &imprints, &masks)?) } else { None };
                    // Without any point the reason is asked for.
                    let points = surface.as_ref().map(Clouds::contact_points).filter(|points| !points.is_empty());
                    let points = points.map_or_else(|| contact_points(sample, &imprints, &masks), Ok);
                    (self.points, self.surface) = (Some(Arc::new(points)), surface.map(Arc::new));
                }
                Stage::Pose => {
                    let by = self.recipe.registration.method();
                    let ask = Ask { evidence: !self.unjudged, ..Ask::default() };
                    let tool = touch.tool.map_err(Clone::clone);
                    self.pose = Some(Arc::new(tool.and_then(|tool| self.pose_by(sample, tool, &*by, ask))));
                }
            }
            self.reached = Some(next);
        }
        Ok(self)
    }

    /// The pose by a registration that no recipe names.
    ///
    /// # Errors
    /// Why there is none.
    ///
    /// # Panics
    /// Before [`Stage::Cloud`].
    pub fn pose_by(
        &self,
        sample: &Sample,
        tool: &ToolModel,
        registration: &dyn Register,
        ask: Ask<'_>,
    ) -> Result<PoseResult, TaskError> {
        let part = pressed_in(sample, tool);
        let of = part.as_ref().unwrap_or(tool);
        let contacts = Contacts { points: self.points().map_err(Clone::clone)?, images: &self.images(sample) };
        let ask = Ask { in_lab_grid: sample.in_lab_grid, ..ask };
        let mut found = pose(contacts, of, registration, ask, sample.grasp_from_object)?;
        if part.is_some() {
            // A gel has no membrane that could be missing.
            found.report.joint = None;
            found.verdict = Verdict::of(&found.report);
        }
        Ok(PoseResult { middle_x_m: tool.middle_x_m, ..found })
    }

    /// Candidates for the tool of the touch, the likeliest first.
    ///
    /// # Errors
    /// If there are no contact points.
    ///
    /// # Panics
    /// Before [`Stage::Cloud`].
    pub fn which_tool<'t>(
        &self,
        sample: &Sample,
        tools: impl IntoIterator<Item = (&'t str, &'t ToolModel)>,
        registration: &dyn Register,
    ) -> Result<Vec<Candidate>, TaskError> {
        let contacts = Contacts { points: self.points().map_err(Clone::clone)?, images: &self.images(sample) };
        Ok(which_tool(contacts, tools, registration))
    }

    /// The membranes that the contact points are from, for registrations that look at them.
    fn images<'a>(&'a self, sample: &'a Sample) -> Vec<PadImage<'a>> {
        let contact = self.contact();
        let masked =
            sample.rig.pads().map(|pad| contact.imprints[pad].as_ref().filter(|_| contact.masks[pad].is_some()));
        images(sample, &masked.collect(), self.recipe.imprint)
    }

    /// Contact probability by the mask model at the imprint of a pad, asked once, and the probability from which on
    /// that is contact by the recipe.
    ///
    /// # Errors
    /// If there is no mask model or no such imprint, or the model cannot be loaded or run.
    pub(crate) fn probability(&mut self, pad: PadId, models: &Models) -> Result<(Probability, f32), TaskError> {
        let found = match &self.probabilities[pad] {
            Some(known) => known.clone(),
            None => {
                let imprint = self.imprints[pad].as_ref();
                let imprint = imprint.ok_or_else(|| TaskError::new("Contact mask", "there is no imprint"))?;
                let model = self.recipe.mask_model.as_ref().ok_or_else(no_mask_model)?;
                let found = Arc::new(models.probability(model, self.recipe.engine, imprint)?);
                self.probabilities[pad].insert(found).clone()
            }
        };
        let least = self.recipe.mask.probability.unwrap_or(found.1);
        Ok((found, least))
    }

    /// Bytes held of imprints, masks and points.
    pub fn bytes(&self) -> usize {
        let pixels: usize = self.imprints.iter().flatten().map(Grid::len).sum();
        let points = self.points.as_deref().and_then(|points| points.as_ref().ok()).map_or(0, Vec::len);
        self.surface.as_ref().map_or(0, |surface| surface.bytes()) + pixels * 9 + points * size_of::<DVec3>()
    }

    /// True where it came to a stage.
    pub fn has(&self, stage: Stage) -> bool {
        self.reached >= Some(stage)
    }

    /// The recipe that it is by.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The contact masks with their imprints.
    ///
    /// # Panics
    /// Before [`Stage::Mask`].
    pub fn contact(&self) -> &Contact {
        self.contact.as_ref().expect("the masks were asked for")
    }

    /// All surface points, with the contact points marked.
    ///
    /// # Panics
    /// Before [`Stage::Cloud`], and not [`Self::with_surface`].
    pub fn surface(&self) -> &Clouds {
        self.surface.as_ref().expect("the surface was asked for")
    }

    /// The contact points of all pads, grasp frame, meters.
    ///
    /// # Errors
    /// Why there are none.
    ///
    /// # Panics
    /// Before [`Stage::Cloud`].
    pub fn points(&self) -> Result<&Vec<DVec3>, &TaskError> {
        (**self.points.as_ref().expect("the points were asked for")).as_ref()
    }

    /// The pose.
    ///
    /// # Errors
    /// Why there is none.
    ///
    /// # Panics
    /// Before [`Stage::Pose`].
    pub fn pose(&self) -> Result<&PoseResult, &TaskError> {
        (**self.pose.as_ref().expect("the pose was asked for")).as_ref()
    }
}
