//! Pictures of pairs and results for papers: [`figure`]s of panels, [`still`] pictures of the 3D view.

pub mod canvas;
pub mod figure;
pub mod fonts;
pub mod space;
pub mod still;
