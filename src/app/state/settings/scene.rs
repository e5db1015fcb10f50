//! The look of the 3D views.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use strum::EnumIter;

use touch2touch_core::units::clamp_or;
use touch2touch_pipeline::compare::deviation::DISTANCES_M;

/// Something that 3D views draw and a person can switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum SceneLayer {
    /// The points outside the contact.
    Membrane,
    /// The whole membrane as a surface.
    Surface,
    /// The contact points.
    Contact,
    /// The contact points of the other side.
    OtherContact,
    /// The model where the tool is: registered, held or put there by hand.
    Cad,
    /// The model where it was registered, while a hand holds it elsewhere.
    Registered,
    /// The model at the registered pose of the other side.
    OtherCad,
    /// The model at the true pose.
    TrueCad,
    /// The model at the pinned steps.
    Pins,
    /// Floor grid, axes, scale bar.
    Guides,
}

/// The size at which a layer draws its parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LayerSize {
    /// Diameter of points or width of lines, pixels.
    Px(f32),
    /// Diameter of points, millimeters.
    Mm(f32),
}

impl LayerSize {
    /// Sizes that can be drawn, in either unit.
    pub(crate) const RANGE: std::ops::RangeInclusive<f32> = 0.1..=20.0;

    /// The number.
    pub fn value(self) -> f32 {
        match self {
            Self::Px(v) | Self::Mm(v) => v,
        }
    }

    /// A size of the same unit with another number.
    #[must_use]
    pub fn with(self, value: f32) -> Self {
        match self {
            Self::Px(_) => Self::Px(value),
            Self::Mm(_) => Self::Mm(value),
        }
    }
}

/// The look of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LayerLook {
    /// True where it is drawn.
    pub shown: bool,
    /// sRGB; `None` = the theme's.
    pub color: Option<[u8; 3]>,
    /// 0..1.
    pub opacity: f32,
    /// Of its points or lines.
    pub size: LayerSize,
}

impl Default for LayerLook {
    fn default() -> Self {
        Self { shown: true, color: None, opacity: 1.0, size: LayerSize::Px(2.0) }
    }
}

impl SceneLayer {
    /// The look before anybody changed it.
    pub fn preset(self) -> LayerLook {
        let look = LayerLook::default();
        match self {
            Self::Membrane => LayerLook { shown: false, size: LayerSize::Px(1.5), ..look },
            Self::Surface => LayerLook { opacity: 0.4, ..look },
            Self::Contact | Self::OtherContact => LayerLook { size: LayerSize::Mm(0.35), ..look },
            Self::TrueCad => LayerLook { size: LayerSize::Px(1.2), ..look },
            _ => look,
        }
    }

    /// True where it has points or lines that have a size.
    pub(crate) fn has_size(self) -> bool {
        !matches!(self, Self::Surface | Self::Cad | Self::Guides)
    }

    /// True where its size can be in millimeters.
    pub(crate) fn has_points(self) -> bool {
        matches!(self, Self::Membrane | Self::Contact | Self::OtherContact)
    }
}

/// The look of all 3D views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SceneLook {
    /// The changes, layer by layer.
    pub layers: BTreeMap<SceneLayer, LayerLook>,
    /// True where what lies behind its neighbors is darkened (eye-dome lighting).
    pub eye_dome: bool,
    /// True where the edges of the model are drawn.
    pub edges: bool,
    /// Parallel projection.
    pub orthographic: bool,
    /// True where only what the GelSlims see is drawn.
    pub only_window: bool,
    /// The scale of distances reaches as far to both sides, meters.
    pub distance_m: f32,
}

impl Default for SceneLook {
    fn default() -> Self {
        Self {
            layers: BTreeMap::new(),
            eye_dome: true,
            edges: true,
            orthographic: false,
            only_window: false,
            distance_m: 0.001,
        }
    }
}

impl SceneLook {
    /// The look of a layer.
    pub fn layer(&self, layer: SceneLayer) -> LayerLook {
        self.layers.get(&layer).copied().unwrap_or_else(|| layer.preset())
    }

    /// Has a layer drawn otherwise.
    pub fn set(&mut self, layer: SceneLayer, look: LayerLook) {
        if look == layer.preset() {
            self.layers.remove(&layer);
        } else {
            self.layers.insert(layer, look);
        }
    }

    /// Numbers brought into range.
    #[must_use]
    pub fn validated(mut self) -> Self {
        for (layer, look) in &mut self.layers {
            let preset = layer.preset();
            look.opacity = clamp_or(look.opacity, 0.05, 1.0, preset.opacity);
            let (lo, hi) = (*LayerSize::RANGE.start(), *LayerSize::RANGE.end());
            look.size = look.size.with(clamp_or(look.size.value(), lo, hi, preset.size.value()));
        }
        let default = Self::default().distance_m;
        self.distance_m = clamp_or(self.distance_m, *DISTANCES_M.start() as f32, *DISTANCES_M.end() as f32, default);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_a_number_comes_back_into_range_and_presets_are_not_stored() {
        let broken = LayerLook { opacity: f32::NAN, size: LayerSize::Mm(-3.0), ..LayerLook::default() };
        let mut look = SceneLook { distance_m: f32::INFINITY, ..SceneLook::default() };
        look.set(SceneLayer::Contact, broken);
        let mut look = look.validated();
        assert_eq!(look.layer(SceneLayer::Contact).opacity, 1.0);
        assert_eq!(look.layer(SceneLayer::Contact).size, LayerSize::Mm(0.1));
        assert_eq!(look.distance_m, 0.001);
        let text = serde_json::to_string(&look).unwrap();
        assert_eq!(serde_json::from_str::<SceneLook>(&text).unwrap(), look);
        look.set(SceneLayer::Contact, SceneLayer::Contact.preset());
        assert!(look.layers.is_empty());
    }
}
