//! Networks fitted to the data at hand: the generator and the mask model.

pub mod adapt;
pub mod mask_worth;
pub mod new_bundle;
pub mod train;
pub mod tuning;
pub mod usable;
