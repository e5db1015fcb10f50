//! The look of the 3D views.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use touch2touch_core::units::clamp_or;
use touch2touch_pipeline::compare::deviation::DISTANCES_M;

/// Something that 3D views draw and a person can switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum SceneLayer {
    /// The whole membrane as a surface.
    Membrane,
    /// The contact points.
    Contact,
    /// The contact points of the other side.
    OtherContact,
    /// The model where the tool is: registered, held or put there by hand.
    Cad,
    /// The model where it was registered, while a hand holds it elsewhere.
    Registered,
    /// The model at the poses that fit about as well.
    Answers,
    /// The model at the registered pose of the other side.
    OtherCad,
    /// The model at the true pose.
    TrueCad,
    /// Floor grid, axes, scale bar.
    Guides,
}

with_defaults! {
    /// The look of all 3D views.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct SceneLook {
        /// The layers that are not drawn.
        pub hidden: BTreeSet<SceneLayer> = BTreeSet::new(),
        /// Parallel projection.
        pub orthographic: bool = false,
        /// The scale of distances reaches as far to both sides, meters.
        pub distance_m: f32 = 0.001,
    }
}

impl SceneLook {
    /// True where a layer is drawn.
    pub fn shows(&self, layer: SceneLayer) -> bool {
        !self.hidden.contains(&layer)
    }

    /// Draws a layer, or draws it no longer.
    pub fn toggle(&mut self, layer: SceneLayer) {
        if !self.hidden.remove(&layer) {
            self.hidden.insert(layer);
        }
    }

    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        let default = Self::default().distance_m;
        self.distance_m = clamp_or(self.distance_m, *DISTANCES_M.start() as f32, *DISTANCES_M.end() as f32, default);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reach_that_is_no_number_comes_back_into_range_and_older_looks_open() {
        let broken = SceneLook { distance_m: f32::INFINITY, ..SceneLook::default() };
        assert_eq!(broken.validated().distance_m, 0.001);
        let older =
            r#"{"layers": {"pins": {"shown": false, "size": {"px": 2.0}}}, "eye_dome": false, "orthographic": true}"#;
        let look: SceneLook = serde_json::from_str(older).unwrap();
        assert!(look.orthographic && look.shows(SceneLayer::Membrane));
    }
}
