//! [`Rig`]: which sensors sit on which pads of the gripper, and where one sensor's view lies in the other's.
//!
//! Sensors are data: loader, simulator, generator, metrics and panes read sizes, scales and windows from the rig of the
//! data set. The lab's GelSlim and Soft Bubble are one value of it, [`Rig::lab`].

mod declared;
pub mod lab;
mod per_pad;

use std::borrow::Cow;
use std::sync::{Arc, LazyLock};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::sensor::Intrinsics;
pub use per_pad::{PadId, PerPad};

/// Names and keys: fixed for the lab's rig, owned for one that was read from a file.
pub type Text = Cow<'static, str>;

/// The sensors of a gripper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    /// The name for people.
    pub name: Text,
    /// Sensors that each pad carries, indexed by [`SensorId`]. The first one's pictures count as upright.
    pub sensors: Vec<Sensor>,
    /// The pads (fingers), indexed by [`PadId`].
    pub pads: Vec<Pad>,
    /// Windows: where one sensor's view lies in another's.
    #[serde(default)]
    pub windows: Vec<Window>,
    /// Tolerance of the depth cameras' poses.
    #[serde(default)]
    pub camera_tolerance: CameraTolerance,
}

/// Standard deviations of a camera's true pose in the gripper from the one that the data give.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraTolerance {
    /// Of the angle about the closing axis, degrees.
    pub angle_deg: f64,
    /// Of the place along each axis, millimeters.
    pub place_mm: f64,
}

impl Default for CameraTolerance {
    /// A good mount's.
    fn default() -> Self {
        Self { angle_deg: 0.25, place_mm: 0.2 }
    }
}

/// The position of a sensor in [`Rig::sensors`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SensorId(pub u8);

/// Kind of sensor, by what its picture holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum SensorKind {
    /// A camera behind a gel: red, green and blue.
    Color,
    /// A depth camera behind a membrane: meters.
    Depth,
}

/// One kind of sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// The name in manifests and file names, such as `gelslim`.
    pub key: Text,
    /// The name for people.
    pub name: Text,
    /// Kind of picture.
    pub kind: SensorKind,
    /// Columns of the stored picture.
    pub width: usize,
    /// Rows of the stored picture.
    pub height: usize,
    /// Scale on the touched surface, pixels per meter.
    pub px_per_m: f64,
    /// Part of the camera's picture that is stored; without it all of it is.
    #[serde(default)]
    pub crop: Crop,
    /// Turn that lays the stored picture as the first sensor's lies: 0 or 180 degrees.
    #[serde(default)]
    pub rotation_deg: u32,
}

/// Crop: place of the stored picture in the camera's full one, which the intrinsics belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Crop {
    /// Columns and rows of the full picture; zero where only the stored one is known.
    pub full: [usize; 2],
    /// Column and row of the full picture at which the stored one starts.
    pub offset: [usize; 2],
}

/// One pad (finger) of the gripper.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pad {
    /// The name in files, such as `right`.
    pub key: Text,
    /// The name on screen.
    pub name: Text,
}

/// The area of a pad that one sensor sees, as an upright rectangle in the stored pixels of another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// The pad.
    pub pad: PadId,
    /// The sensor that sees the area.
    pub of: SensorId,
    /// The sensor in whose pixels it is given.
    pub within: SensorId,
    /// Center of the window, pixels from the center of the first one.
    pub center_px: [f64; 2],
    /// Width and height of the window, pixels.
    pub size_px: [f64; 2],
}

impl Crop {
    /// Lifts stored pixel `(u, v)` at depth `z` (meters) to a point in the camera frame, meters.
    ///
    /// Source: the lab's `ICP_dataset_cal.py` lines 426-433: the crop offset is added before the pinhole model.
    pub fn lift(&self, intrinsics: &Intrinsics, u: f64, v: f64, z: f64) -> DVec3 {
        intrinsics.lift(u + self.offset[0] as f64, v + self.offset[1] as f64, z)
    }

    /// Projects a point in the camera frame to stored pixel coordinates `(u, v)`; `None` behind the camera.
    pub fn project(&self, intrinsics: &Intrinsics, p_in_camera: DVec3) -> Option<(f64, f64)> {
        let (u, v) = intrinsics.project(p_in_camera)?;
        Some((u - self.offset[0] as f64, v - self.offset[1] as f64))
    }
}

impl Sensor {
    /// Columns and rows of the stored picture.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }
}

/// The center of a pixel as shares of the picture's width and height.
pub fn share(pixel: [f64; 2], size: [usize; 2]) -> [f64; 2] {
    std::array::from_fn(|i| (pixel[i] + 0.5) / size[i].max(1) as f64)
}

impl Window {
    /// `[center x, center y, width, height]`.
    pub fn rectangle(&self) -> [f64; 4] {
        let ([x, y], [width, height]) = (self.center_px, self.size_px);
        [x, y, width, height]
    }
}

impl Rig {
    /// The lab's gripper: a GelSlim and a Soft Bubble for each of two fingers.
    pub fn lab() -> Arc<Self> {
        static LAB: LazyLock<Arc<Rig>> = LazyLock::new(|| Arc::new(lab::rig()));
        LAB.clone()
    }

    /// The pads in order.
    pub fn pads(&self) -> impl ExactSizeIterator<Item = PadId> + DoubleEndedIterator + Clone + use<> {
        (0..self.pads.len()).map(PadId::new)
    }

    /// The pads in order, as a list.
    pub fn pad_list(&self) -> Vec<PadId> {
        self.pads().collect()
    }

    /// The pad's name in files, such as `right`; its number where the rig has no such pad.
    pub fn pad_key(&self, pad: PadId) -> Text {
        self.pads.get(pad.index()).map_or_else(|| Cow::Owned(pad.index().to_string()), |pad| pad.key.clone())
    }

    /// The pad's name on screen.
    pub fn pad_name(&self, pad: PadId) -> &str {
        self.pads.get(pad.index()).map_or("?", |pad| &pad.name)
    }

    /// The pad of a name in files.
    pub fn pad_of_key(&self, key: &str) -> Option<PadId> {
        self.pads().find(|pad| self.pads[pad.index()].key == key)
    }

    /// The sensor at a position.
    pub fn sensor(&self, id: SensorId) -> Option<&Sensor> {
        self.sensors.get(usize::from(id.0))
    }

    /// The position of the sensor with this key.
    pub fn sensor_of_key(&self, key: &str) -> Option<SensorId> {
        self.sensors.iter().position(|sensor| sensor.key == key).map(|index| SensorId(index as u8))
    }

    /// The first sensor of a kind.
    pub fn first(&self, kind: SensorKind) -> Option<SensorId> {
        self.sensors.iter().position(|sensor| sensor.kind == kind).map(|index| SensorId(index as u8))
    }

    /// The first color sensor.
    pub fn color(&self) -> Option<&Sensor> {
        self.sensor(self.first(SensorKind::Color)?)
    }

    /// The first depth sensor.
    pub fn depth(&self) -> Option<&Sensor> {
        self.sensor(self.first(SensorKind::Depth)?)
    }

    /// True where the depth sensor sees a gel, whose depth follows the tool pixel by pixel, and no membrane, which spans
    /// between the parts that lift it: told by the key of the lab's own ([`lab::GELSLIM_DEPTH`]).
    pub fn is_gel(&self) -> bool {
        self.depth().is_some_and(|sensor| sensor.key == lab::GELSLIM_DEPTH.key)
    }

    /// Pixels to the millimeter of depth images; NaN where there is no such sensor, so that a size in millimeters says nothing.
    pub fn depth_px_per_mm(&self) -> f64 {
        self.depth().map_or(f64::NAN, |sensor| sensor.px_per_m * 1e-3)
    }

    /// Window of `of` in the picture of `within`, if the rig says.
    pub fn window(&self, pad: PadId, of: SensorId, within: SensorId) -> Option<&Window> {
        self.windows.iter().find(|w| (w.pad, w.of, w.within) == (pad, of, within))
    }

    /// Window of the first color sensor in the picture of the first depth sensor.
    pub fn color_window(&self, pad: PadId) -> Option<&Window> {
        self.window(pad, self.first(SensorKind::Color)?, self.first(SensorKind::Depth)?)
    }

    /// The center of [`Rig::color_window`], as shares of the depth picture's width and height.
    pub fn window_share(&self, pad: PadId) -> Option<[f64; 2]> {
        Some(share(self.color_window(pad)?.center_px, self.depth()?.size()))
    }

    /// The mean of [`Rig::window_share`] over the pads that have one: for a touch that does not say of which it is.
    pub fn mean_window_share(&self) -> Option<[f64; 2]> {
        let all: Vec<[f64; 2]> = self.pads().filter_map(|pad| self.window_share(pad)).collect();
        (!all.is_empty()).then(|| [0, 1].map(|i| all.iter().map(|share| share[i]).sum::<f64>() / all.len() as f64))
    }

    /// True where the pictures of the first color and the first depth sensor lie turned by 180 degrees to each other.
    pub fn turned(&self) -> bool {
        let turn = |sensor: Option<&Sensor>| sensor.map(|sensor| sensor.rotation_deg);
        turn(self.color()).zip(turn(self.depth())).is_some_and(|(color, depth)| color != depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_survives_depth_to_cloud_to_pixel() {
        let k = Intrinsics { fx: 212.0, fy: 211.0, cx: 112.3, cy: 86.1 };
        let crop = lab::BUBBLE.crop;
        for v in 0..lab::BUBBLE.height {
            for u in 0..lab::BUBBLE.width {
                let z = 0.07 + 1e-4 * ((u * 7 + v * 13) % 200) as f64;
                let (u2, v2) = crop.project(&k, crop.lift(&k, u as f64, v as f64, z)).unwrap();
                assert!((u2 - u as f64).abs() < 1e-9 && (v2 - v as f64).abs() < 1e-9);
            }
        }
        assert_eq!(crop.project(&k, DVec3::new(0.0, 0.0, 0.0)), None);
        assert_eq!(crop.project(&k, DVec3::new(0.0, 0.0, f64::NAN)), None);
    }
}
