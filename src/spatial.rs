//! The parts of a pair in 3D, as items for the renderer: membrane, contact points, CAD model, true pose, floor. The panes and the
//! stills put their scenes together from the same ones, and look from the same place.
//!
//! It knows the job and the renderer, no window and no state. Without the feature `gui` there is no renderer, and a still
//! says so.

#[cfg(feature = "gui")]
pub mod items;
#[cfg(feature = "gui")]
pub mod still;

#[cfg(feature = "gui")]
pub use focus::{FILLED, focus};

#[cfg(feature = "gui")]
mod focus;

use touch2touch_pipeline::error::TaskError;
use touch2touch_pipeline::still::space::{InSpace, SpacePicture, SpaceView};

/// Draws a pair from a view, turned by an angle in degrees, on the best graphics device that there is; a software one will do.
///
/// # Errors
/// If there is no device, or the program was built without a renderer.
#[cfg_attr(not(feature = "gui"), expect(unused_variables))]
pub fn still(
    pair: &InSpace,
    view: &SpaceView,
) -> Result<impl FnMut(f64) -> Result<SpacePicture, TaskError> + Send + use<>, TaskError> {
    #[cfg(feature = "gui")]
    {
        let mut still = still::Still::new(pair, view)?;
        Ok(move |turned_deg| still.turned(turned_deg))
    }
    #[cfg(not(feature = "gui"))]
    Err::<fn(f64) -> Result<SpacePicture, TaskError>, _>(
        TaskError::new("3D picture", "this program was built without the 3D renderer")
            .with_hint("Build it with the feature gui."),
    )
}
