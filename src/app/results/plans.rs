//! Results about the whole data set: plans of exports, imports, trainings and evaluations, and the doctor's lines.

use std::sync::Arc;

use super::super::jobs::{Job, Worker};
use super::super::keys::{AboutKey, ImportPlanKey, ImprintSource, MaskPlanKey, PlanKey, Revision, TrainPlanKey};
use super::super::pane::Demand;
use super::super::recipe;
use super::super::results::{Computes, Demands};
use super::super::services::Services;
use super::super::state::State;
use super::super::state::learn::Network;
use super::super::state::tasks::TaskKind;
use touch2touch_pipeline::doctor::{Fact, facts};
use touch2touch_pipeline::export::import::{Import, ImportSetup, plan_import};
use touch2touch_pipeline::export::{DrawnMasks, ExportSetup, Plan, plan as plan_export};
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::learn::train::{TrainPlan, plan};
use touch2touch_pipeline::scores::evaluate::Setup;
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::Recipe;

fn plan_key<T>(state: &State, choice: T) -> Option<PlanKey<T>> {
    let dataset = state.library.open.as_ref()?.seq;
    Some(PlanKey { dataset, choice, revision: Revision(state.document.last_revision) })
}

impl Computes for MaskPlanKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Plan>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (changed, choice) = (state.document.finished_labels(), self.choice);
        Some(Job::new(Worker::Files, "Plan of an export", move |_| {
            let masks = DrawnMasks { labels: &Labels::of(&source.dataset), changed: &changed };
            plan_export(&source.dataset, &masks, &ExportSetup { pairs: None, choice })
        }))
    }
}

/// The plan of the export that the form describes, while the form is open.
pub fn mask_plan_key(state: &State) -> Option<MaskPlanKey> {
    state.export.asking_masks.then(|| plan_key(state, state.export.masks))?
}

pub(crate) fn want_mask_plan(wants: &mut Demands<'_>) {
    if let Some(key) = mask_plan_key(wants.state).filter(|_| wants.state.document.stroke.is_none()) {
        wants.ask(key);
    }
}

impl Computes for ImportPlanKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Import>> {
        let source = state.library.open.as_ref()?.source.clone();
        let setup = import_setup(state)?;
        Some(Job::new(Worker::Files, "Plan of an import", move |cx| plan_import(&source.dataset, &setup, cx)))
    }
}

/// The plan of the import that the form describes, while the form is open.
pub fn import_plan_key(state: &State) -> Option<ImportPlanKey> {
    plan_key(state, state.export.importing.clone()?)
}

pub(crate) fn want_import_plan(wants: &mut Demands<'_>) {
    // Over what is on the disk: a stroke must have come there first.
    let at_rest = wants.state.document.stroke.is_none() && wants.state.document.unsaved.is_empty();
    if let Some(key) = import_plan_key(wants.state).filter(|_| at_rest) {
        wants.ask(key);
    }
}

/// The setup of the import that the form describes, while it is open.
pub(crate) fn import_setup(state: &State) -> Option<ImportSetup> {
    let form = state.export.importing.as_ref()?;
    let (from, over_drawn, person) = (form.from.clone(), form.over_drawn, state.settings.known_labeler());
    Some(ImportSetup { from, format: None, over_drawn, person })
}

impl Computes for TrainPlanKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<TrainPlan>> {
        let source = state.library.open.as_ref()?.source.clone();
        let (changed, choice) = (state.document.labels.clone(), self.choice);
        Some(Job::new(Worker::Files, "Plan of a training", move |_| {
            plan(&source.dataset, &DrawnMasks { labels: &Labels::of(&source.dataset), changed: &changed }, choice)
        }))
    }
}

/// The plan of the training that the pane describes.
pub(crate) fn train_plan_key(state: &State) -> Option<TrainPlanKey> {
    plan_key(state, state.learn.form.choice)
}

pub(crate) fn want_train_plan(wants: &mut Demands<'_>) {
    let state = wants.state;
    if !state.needs(Demand::Training)
        || state.learn.shown != Network::Masks
        || state.document.stroke.is_some()
        || state.tasks.of_kind(TaskKind::Learn).is_some()
    {
        return;
    }
    if let Some(key) = train_plan_key(state) {
        wants.ask(key);
    }
}

impl Computes for AboutKey {
    fn job(&self, state: &State, _: &Arc<Services>) -> Option<Job<Vec<Fact>>> {
        let source = state.library.open.as_ref()?.source.clone();
        let changed = state.document.labels.clone();
        Some(Job::new(Worker::Compute, "About this data", move |_| {
            Ok(facts(&source.dataset, &DrawnMasks { labels: &Labels::of(&source.dataset), changed: &changed }))
        }))
    }
}

/// The key of the lines about the open data set.
pub(crate) fn doctor_key(state: &State) -> Option<AboutKey> {
    let open = state.library.open.as_ref()?;
    let (pairs, revision) = (open.index().pairs.len(), Revision(state.document.last_revision));
    Some(AboutKey { dataset: open.seq, pairs, revision, units_named: state.library.units_named })
}

/// Asks for them while the panel is looked at.
pub(crate) fn want_doctor(wants: &mut Demands<'_>) {
    if wants.state.doctor.shown
        && wants.state.document.stroke.is_none()
        && let Some(key) = doctor_key(wants.state)
    {
        wants.ask(key);
    }
}

/// The generators for the sensors of the data, and whether each gets a row.
pub fn evaluated(state: &State) -> impl Iterator<Item = (&BundleInfo, bool)> {
    let rig = state.rig();
    state
        .library
        .bundles
        .iter()
        .filter(move |b| b.kind == BundleKind::Generator && b.fits(&rig))
        .map(|b| (b, !state.table.left_out.contains(&b.id)))
}

/// The setup of an evaluation started now; `None` without data or with nothing to score.
pub(crate) fn evaluation_setup(state: &State) -> Option<Setup> {
    state.library.open.as_ref()?;
    let bundles: Vec<_> = evaluated(state).filter(|(_, chosen)| *chosen).map(|(b, _)| b.origin.clone()).collect();
    (!bundles.is_empty() || state.rig().is_gel()).then(|| Setup {
        bundles,
        classifier: recipe::bundle(state, BundleKind::Classifier).ok().map(|b| b.origin.clone()),
        recipe: Recipe { generator: None, ..recipe::in_force(state, ImprintSource::Measured) },
        ..Setup::default()
    })
}
