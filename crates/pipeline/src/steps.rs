//! The steps from a pair to its pose: [`recipe`] says what decides a result, [`mod@estimate`] runs the steps in order.
//!
//! 1. [`predict`]: a color picture to a [`prediction`], by a model of [`bundles`] that [`models`] keeps loaded.
//! 2. [`imprint`]: a prediction, or a measurement, to meters.
//! 3. [`mask`]: an imprint to its contact.
//! 4. [`cloud`]: imprint and mask to contact points.
//! 5. [`pose`]: the points, registered to the CAD model of a [`tool`], to the pose in the hand.

pub mod bundles;
pub mod cloud;
pub mod estimate;
pub mod imprint;
pub mod layers;
pub mod mask;
pub mod models;
pub mod on_pad;
pub mod pose;
pub mod predict;
pub mod prediction;
pub mod recipe;
pub mod tool;
