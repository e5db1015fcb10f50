//! The contents of what is taken away: figures and pairs.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use strum::IntoEnumIterator as _;

use super::super::keys::{CloudKey, ImprintSource, MaskKey, MaskVersion, PredictionKey, Registration};
use super::super::pane::Pane;
use super::super::state::State;
use super::super::state::export::{FigureRows, StillAsked};
use super::super::state::workbench::Layer;
use super::super::{recipe, results};
use super::column::in_figure;
use super::command::recipe_shown;
use touch2touch_core::contact::MaskBasis;
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::rig::Rig;
use touch2touch_pipeline::compare::depict::Compared;
use touch2touch_pipeline::compare::subject::{MadeFrom, RecipeChange, Subject};
use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::export::pair_files::{PairFile, PairParts, write};
use touch2touch_pipeline::images::figure::{FigurePane, FigureSetup, FigureTheme, note};
use touch2touch_pipeline::images::still::StillSetup;
use touch2touch_pipeline::labels::PairLabels;
use touch2touch_pipeline::steps::bundles::BundleInfo;
use touch2touch_pipeline::steps::cloud::Clouds;
use touch2touch_pipeline::steps::mask::made_of;
use touch2touch_pipeline::steps::pose::PoseResult;
use touch2touch_pipeline::steps::recipe::Recipe;
use touch2touch_pipeline::steps::tool::NamedTool;

/// The export of the selected pair for other programs, gathered for a job.
#[derive(Clone, Debug)]
pub struct PairExport {
    name: String,
    source: ImprintSource,
    prediction: Option<String>,
    rig: Arc<Rig>,
    clouds: Arc<Clouds>,
    mask: String,
    registration: Registration,
    pose: Option<Arc<PoseResult>>,
    truth: Option<PlanarPose>,
    tool: Option<Arc<NamedTool>>,
}

impl PairExport {
    /// Writes the files that there can be: without a pose only the cloud.
    ///
    /// # Errors
    /// As [`write()`].
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, TaskError> {
        let files: Vec<PairFile> =
            PairFile::iter().filter(|file| *file == PairFile::Cloud || self.pose.is_some()).collect();
        let parts = PairParts {
            name: &self.name,
            source: self.source,
            prediction: self.prediction.as_deref(),
            rig: &self.rig,
            clouds: &self.clouds,
            mask: &self.mask,
            registration: self.registration,
            pose: self.pose.as_deref(),
            truth: self.truth,
            tool: self.tool.as_ref().map(|tool| (tool.name.as_str(), &tool.model)),
        };
        write(&parts, &files, folder)
    }
}

/// A pair of a figure with the predictions that it needs.
pub(crate) type Recipes = Vec<(PairId, Vec<(PredictionKey, BundleInfo)>)>;

/// The setup of the figure that the form describes, before anything is drawn.
pub(crate) fn figure_setup(state: &State) -> FigureSetup {
    let form = &state.export.form;
    let library = &state.library;
    let pairs = match form.rows {
        FigureRows::First(n) => library.order.iter().copied().take(n).collect(),
        FigureRows::Ticked => library.ticked_pairs(),
        FigureRows::Selected => state.selection.pair.into_iter().collect(),
    };
    let fingers = if form.both_fingers { state.rig().pad_list() } else { vec![state.selection.finger] };
    let look = state.settings.figure_look(form.panes.clone(), form.error_m, form.theme, f64::from(form.scale));
    with_note(state, FigureSetup { pairs, fingers, shift: state.settings.shift, look, note: String::new() })
}

/// One pane of the selected pair, with the fingers that it shows.
pub(crate) fn picture_setup(state: &State, pane: Pane, scale: Option<u8>, error_m: f32) -> Option<FigureSetup> {
    let shown = state.fingers();
    let fingers = state.rig().pads().filter(|finger| shown.contains(finger)).collect();
    let scale = f64::from(scale.unwrap_or(1));
    let look = state.settings.figure_look(vec![in_figure(state, pane)?], error_m, FigureTheme::Light, scale);
    let pairs = vec![state.selection.pair?];
    Some(with_note(state, FigureSetup { pairs, fingers, shift: state.settings.shift, look, note: String::new() }))
}

fn with_note(state: &State, setup: FigureSetup) -> FigureSetup {
    let recipes = figure_recipes(state, &setup);
    let mut said: Vec<String> = Vec::new();
    for (recipe, bundle) in recipes.iter().flat_map(|(_, list)| list) {
        let text = note(&bundle.name, &recipe.config, setup.shift);
        if !said.contains(&text) {
            said.push(text);
        }
    }
    // Pairs whose shown predictions were made in different ways are said so, not listed.
    let note = match said.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        several => format!("{} and {} other ways", several[0], several.len() - 1),
    };
    let compared = setup.look.panes.contains(&FigurePane::Compare).then(|| compared(state));
    let note = compared.and_then(Result::ok).map_or_else(|| note.clone(), |compared| compared.note(&note));
    FigureSetup { note, ..setup }
}

/// The two imprints that the Compare pane holds against each other, ready to be made anew.
///
/// # Errors
/// Why one of them cannot be made.
pub(crate) fn compared(state: &State) -> Result<Compared, &'static str> {
    let versus = state.settings.compared();
    let recipe = recipe_shown(state, ImprintSource::Predicted);
    let from = |subject: &Subject| match subject {
        // The one that the other panes show, made by whatever settings.
        Subject::Predicted(change) if *change == RecipeChange::default() => Ok(MadeFrom::Prediction(recipe.clone())),
        _ => subject.made_from(|named| recipe::of_generator(state, named)).map_err(|absent| absent.text()),
    };
    Ok(Compared { from: [from(&versus.a)?, from(&versus.b)?], subjects: [versus.a, versus.b], recipe })
}

/// A picture of the selected pair in 3D, by the recipe of what is shown, in the colors of distances where these are on.
pub(crate) fn still_setup(state: &State, asked: StillAsked) -> Option<StillSetup> {
    let reach = state.settings.scene.distance_m;
    Some(StillSetup {
        pair: state.selection.pair?,
        pane: asked.pane,
        recipe: recipe_shown(state, *asked.pane.sides().last()?),
        labels: state.document.pair(state.pair_name()).cloned().unwrap_or_default(),
        ground: asked.ground,
        angles: asked.angles,
        width_px: asked.width_px,
        turntable: asked.turntable,
        distance_m: (state.workbench.layer == Layer::Distance).then_some(reach.into()),
    })
}

/// Recipe and labels of the pairs that a figure shows in 3D; `None` where it has no such column.
pub(crate) fn space_recipe(state: &State, setup: &FigureSetup) -> Option<(Recipe, Vec<(PairId, PairLabels)>)> {
    let predicted = setup.look.panes.iter().filter(|pane| pane.space().is_some()).any(|pane| pane.is_predicted());
    setup.look.panes.iter().find(|pane| pane.space().is_some())?;
    let side = if predicted { ImprintSource::Predicted } else { ImprintSource::Measured };
    let labels = setup.pairs.iter().filter_map(|pair| {
        let name = &state.library.entry(*pair)?.name;
        Some((*pair, state.document.pair(name).cloned().unwrap_or_default()))
    });
    Some((recipe_shown(state, side), labels.collect()))
}

/// The predictions that a figure shows: the one shown for a touch, else what the settings would make of it.
pub(crate) fn figure_recipes(state: &State, setup: &FigureSetup) -> Recipes {
    let predicted = setup.look.panes.iter().any(|pane| pane.is_predicted());
    let Some(open) = state.library.open.as_ref().filter(|_| predicted) else { return Vec::new() };
    let of = |pair: &PairId| {
        let touches = setup.fingers.iter().map(|finger| open.key(*pair).finger(*finger));
        let recipes = touches.filter_map(|touch| {
            let recipe = results::shown(state, touch).cloned().or_else(|| recipe::prediction(state, touch))?;
            let bundle = state.library.bundle(&recipe.bundle)?.clone();
            Some((recipe, bundle))
        });
        (*pair, recipes.collect())
    };
    setup.pairs.iter().map(of).collect()
}

/// The sources of the contact masks of a cloud, as the verbs say them.
fn masks_made_of(state: &State, cloud: &CloudKey) -> String {
    let source = state.settings.mask.choice.source.key();
    let keys = cloud.parts.iter().flatten().filter_map(|(imprint, version)| match version.as_ref()? {
        MaskVersion::Hand(_) => Some(MaskBasis::Hand.key(source)),
        MaskVersion::Auto(recipe) => {
            let key = MaskKey { imprint: imprint.clone(), recipe: recipe.clone() };
            Some(state.results.masks.get(&key)?.basis.key(recipe.source().key()))
        }
    });
    made_of(keys.collect(), source)
}

/// The export of the selected pair; `None` while its cloud is not there.
pub fn pair_export(state: &State, source: ImprintSource) -> Option<PairExport> {
    let cloud = results::cloud_key(state, source).ok()??;
    let pose = results::pose_key(state, source).ok().flatten().and_then(|key| state.results.poses.get(&key)).cloned();
    let recipe =
        state.rig().pads().find_map(|pad| results::chosen(state, pad)).filter(|_| source == ImprintSource::Predicted);
    let prediction =
        recipe.map(|made| note(state.library.model_name(&made.bundle), &made.config, state.settings.shift));
    Some(PairExport {
        name: state.pair_name().to_owned(),
        source,
        prediction,
        rig: state.rig(),
        clouds: state.results.clouds.get(&cloud)?.clone(),
        mask: masks_made_of(state, &cloud),
        registration: state.settings.registration,
        pose,
        truth: results::sample(state).ready()?.grasp_from_object,
        tool: results::tool_key(state).ok().and_then(|key| state.results.tools.get(&key)).cloned(),
    })
}

/// True where a figure of the open pairs can be drawn.
pub(crate) fn can_draw(state: &State) -> bool {
    let open = state.library.open.as_ref();
    open.is_some_and(|open| open.source.as_dataset().is_some()) && state.entry().is_some()
}
