//! Setups of an evaluation of the open data set.

use super::super::keys::ImprintSource;
use super::super::recipe;
use super::super::state::State;
use touch2touch_pipeline::scores::evaluate::Setup;
use touch2touch_pipeline::steps::bundles::{BundleInfo, BundleKind};
use touch2touch_pipeline::steps::recipe::Recipe;

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
    (!bundles.is_empty()).then(|| Setup {
        bundles,
        classifier: recipe::bundle(state, BundleKind::Classifier).ok().map(|b| b.origin.clone()),
        recipe: Recipe { generator: None, ..recipe::in_force(state, ImprintSource::Measured) },
        ..Setup::default()
    })
}
