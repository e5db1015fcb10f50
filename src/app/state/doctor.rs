//! The panel about the open data set: whether it is open, and what was computed because somebody asked.

use std::sync::Arc;

use touch2touch_pipeline::doctor::{Examined, Worth};

/// The panel about the open data set.
#[derive(Clone, Debug, Default)]
pub struct DoctorState {
    /// True where it is open.
    pub shown: bool,
    /// True once the models were tried, or begun to be: they are not tried again unasked.
    pub tried: bool,
    /// The worth of the models on a sample.
    pub worth: Option<Arc<Worth>>,
    /// The faults of all pairs, once they were examined.
    pub examined: Option<Arc<Examined>>,
}
