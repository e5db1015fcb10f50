//! The prediction of another program that lies beside a pair as a picture.

use super::super::jobs::{Job, Lane};
use super::super::keys::PictureKey;
use super::super::results::{Computes, gone};
use super::super::services::SharedServices;
use super::super::state::State;
use touch2touch_pipeline::compare::{Beside, beside};
use touch2touch_pipeline::error::TaskError;

impl Computes for PictureKey {
    fn job(&self, state: &State, _: &SharedServices) -> Option<Job<Beside>> {
        let pair = self.0.pair;
        let source = state.library.open.as_ref()?.source.clone();
        let sample = state.results.samples.get(&pair)?.clone();
        Some(Job::new(Lane::Files, "Stored picture", move |_| {
            let dataset = source.as_dataset().ok_or_else(gone)?;
            beside(dataset, pair.pair, &sample)?.ok_or_else(|| {
                let why = "no picture of another program's prediction lies beside this pair";
                TaskError::new("Stored picture", why)
                    .with_hint("It is read from NAME_vqvae.png beside NAME_bubble.png.")
            })
        }))
    }

    /// The pane says it in place of the picture.
    fn failed(&self, _: &mut State, _: &TaskError) -> bool {
        false
    }
}
