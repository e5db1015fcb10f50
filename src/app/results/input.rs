//! The input of the generator: what can be predicted of the selected pair.

use super::super::state::{Absent, State};
use super::super::{recipe, results};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Sample;
use touch2touch_pipeline::steps::bundles::BundleKind;

/// `Ok` where something can be generated for the selected pair.
///
/// # Errors
/// Why not.
pub fn can_generate(state: &State) -> Result<(), Absent> {
    state.pair_key().ok_or(if state.library.open.is_none() { Absent::NothingOpen } else { Absent::NothingSelected })?;
    recipe::bundle(state, BundleKind::Generator)?;
    // While the sample loads, the job loads it itself.
    let Some(sample) = results::sample(state).ready() else {
        return Ok(());
    };
    if sample.rig.pads().any(|finger| has_input(state, sample, finger)) { Ok(()) } else { Err(Absent::NoInput) }
}

/// True where a finger has a reading of the sensor that the generator starts from.
fn has_input(state: &State, sample: &Sample, finger: PadId) -> bool {
    let ends = recipe::bundle(state, BundleKind::Generator).ok().and_then(|bundle| bundle.ends(&sample.rig)?.ok());
    ends.is_some_and(|ends| sample.pad(finger).is_some_and(|touch| touch.reading(ends.input).is_some()))
}

/// True where something can be generated for a finger of the selected pair, which is loaded.
pub(crate) fn can_start(state: &State, finger: PadId) -> bool {
    results::sample(state).ready().is_some_and(|sample| has_input(state, sample, finger))
}
