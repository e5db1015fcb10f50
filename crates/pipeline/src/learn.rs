//! Networks fitted to the data at hand: the generator, the mask model, and the data that they learn from.

pub mod adapt;
pub mod mask_worth;
pub mod new_bundle;
pub mod train;
pub mod training_data;
pub mod tuning;
mod usable;
