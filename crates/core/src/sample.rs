//! One loaded grasp: what the sensors of each pad felt, the rig it was felt with, and the truth where it is known.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::dataset::Problem;
use super::frames::PlanarPose;
use super::grid::{DepthMap, Mask, RgbGrid};
use super::rig::{Crop, PadId, PerPad, Rig, SensorId};
use super::sensor::Intrinsics;
use super::turn::Turn;
use super::upright::TurnReading;

/// One grasp, as far as the source has it.
#[derive(Clone, Debug)]
pub struct Sample {
    /// The sensors that felt it.
    pub rig: Arc<Rig>,
    /// Touch on each pad; none where the source has no such pad.
    pub pads: PerPad<PadTouch>,
    /// The true in-hand pose, where known. Its inverse carries the lab's angle sign.
    pub grasp_from_object: Option<PlanarPose>,
    /// True where the poses that its data set gives all lie in the lab's grid: then its own probably does.
    pub in_lab_grid: bool,
    /// Scale: whether lengths are measured, or assumed because the source lost its scale.
    pub scale: Scale,
    /// Turn of the source's images before they were laid upright; upright for whatever comes from a sensor.
    pub laid: Turn,
    /// Reading of that turn, with how sure it is, where the colors of a picture told; `None` for whatever comes from a
    /// sensor.
    pub reading: Option<TurnReading>,
    /// The pad whose sensors took pictures, which lie at the first pad because they do not say it: named beside them, or read
    /// from the dots of the gel.
    pub taken_by: Option<PadId>,
    /// Oddities of its files and numbers: whoever answers from this sample says so.
    pub notes: Vec<Problem>,
}

impl Default for Sample {
    /// Nothing felt, with the lab's rig.
    fn default() -> Self {
        Self {
            rig: Rig::lab(),
            pads: PerPad::default(),
            grasp_from_object: None,
            in_lab_grid: false,
            scale: Scale::default(),
            laid: Turn::default(),
            reading: None,
            taken_by: None,
            notes: Vec::new(),
        }
    }
}

/// Scale: where the meters of a sample come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Scale {
    /// The source stores meters.
    #[default]
    Measured,
    /// The source was scaled to 0..255 image by image; the range is an assumption and must be labeled so.
    Assumed,
}

impl Scale {
    /// The name in files.
    pub fn key(self) -> &'static str {
        self.into()
    }
}

/// Touch of one finger, with each of its sensors.
#[derive(Clone, Debug, Default)]
pub struct PadTouch {
    /// In the order of the rig's sensors.
    readings: Vec<(SensorId, Reading)>,
    /// The depth camera of the same rig, where its own picture was not recorded: what a prediction is lifted with.
    pub lent: Option<Arc<DepthCamera>>,
}

/// Reading of one sensor.
#[derive(Clone, Debug)]
pub enum Reading {
    /// A color sensor's touch.
    Color(ColorTouch),
    /// A depth sensor's touch.
    Depth(DepthTouch),
}

impl From<ColorTouch> for Reading {
    fn from(touch: ColorTouch) -> Self {
        Self::Color(touch)
    }
}

impl From<DepthTouch> for Reading {
    fn from(touch: DepthTouch) -> Self {
        Self::Depth(touch)
    }
}

impl Reading {
    /// Columns and rows of its picture.
    pub fn size(&self) -> [usize; 2] {
        match self {
            Self::Color(touch) => touch.difference.size(),
            Self::Depth(touch) => touch.imprint.size(),
        }
    }

    fn bytes(&self) -> usize {
        let rgb = |g: &RgbGrid| g.len() * 12;
        let depth = |g: &DepthMap| g.len() * 4;
        match self {
            Self::Color(g) => rgb(&g.difference) + g.images.as_ref().map_or(0, |i| rgb(&i.raw) + rgb(&i.reference)),
            Self::Depth(b) => {
                depth(&b.imprint)
                    + b.camera.as_ref().map_or(0, |c| depth(&c.depth_reference))
                    + b.truth.as_ref().map_or(0, |t| depth(&t.imprint) + t.contact.len())
            }
        }
    }
}

impl PadTouch {
    /// With one more reading, in place of an earlier one of the same sensor; as it is without one.
    #[must_use]
    pub fn with(mut self, sensor: SensorId, reading: Option<impl Into<Reading>>) -> Self {
        if let Some(reading) = reading {
            self.set(sensor, reading);
        }
        self
    }

    /// Adds a reading, in place of an earlier one of the same sensor.
    pub fn set(&mut self, sensor: SensorId, reading: impl Into<Reading>) {
        self.readings.retain(|(of, _)| *of != sensor);
        let index = self.readings.partition_point(|(of, _)| *of < sensor);
        self.readings.insert(index, (sensor, reading.into()));
    }

    /// Reading of this sensor.
    pub fn reading(&self, sensor: SensorId) -> Option<&Reading> {
        self.readings.iter().find(|(of, _)| *of == sensor).map(|(_, reading)| reading)
    }

    /// All readings with their sensors.
    pub fn readings(&self) -> &[(SensorId, Reading)] {
        &self.readings
    }

    /// Reading of the first color sensor that has one.
    pub fn color(&self) -> Option<&ColorTouch> {
        let mut readings = self.readings.iter();
        readings.find_map(|(_, reading)| if let Reading::Color(touch) = reading { Some(touch) } else { None })
    }

    /// As [`PadTouch::color`], to be changed.
    pub fn color_mut(&mut self) -> Option<&mut ColorTouch> {
        let mut readings = self.readings.iter_mut();
        readings.find_map(|(_, reading)| if let Reading::Color(touch) = reading { Some(touch) } else { None })
    }

    /// Reading of the first depth sensor that has one.
    pub fn depth(&self) -> Option<&DepthTouch> {
        let mut readings = self.readings.iter();
        readings.find_map(|(_, reading)| if let Reading::Depth(touch) = reading { Some(touch) } else { None })
    }

    /// As [`PadTouch::depth`], to be changed.
    pub fn depth_mut(&mut self) -> Option<&mut DepthTouch> {
        let mut readings = self.readings.iter_mut();
        readings.find_map(|(_, reading)| if let Reading::Depth(touch) = reading { Some(touch) } else { None })
    }

    /// A sensor's reading as a model takes it: the color difference, or the imprint in each of three channels. Pixels of an
    /// imprint that are no measurement count as not pushed in.
    pub fn picture(&self, sensor: SensorId) -> Option<Cow<'_, RgbGrid>> {
        Some(match self.reading(sensor)? {
            Reading::Color(touch) => Cow::Borrowed(&touch.difference),
            Reading::Depth(touch) => Cow::Owned(touch.imprint.map(|&d| [if d.is_finite() { d } else { 0.0 }; 3])),
        })
    }

    /// The camera that saw the imprint, or would have seen it.
    pub fn camera(&self) -> Option<&DepthCamera> {
        self.depth().and_then(|b| b.camera.as_ref()).or(self.lent.as_deref())
    }
}

/// A color sensor's touch: 427 x 320 px from the lab's GelSlim, any size from an image folder.
#[derive(Clone, Debug)]
pub struct ColorTouch {
    /// Touched and untouched image on the 0..255 scale; `None` where the source only has the difference.
    pub images: Option<ColorImages>,
    /// Touched minus untouched, signed, 0..255 scale. What the models see.
    pub difference: RgbGrid,
}

/// The two camera images behind a difference.
#[derive(Clone, Debug)]
pub struct ColorImages {
    /// The image during the touch.
    pub raw: RgbGrid,
    /// The image without contact.
    pub reference: RgbGrid,
}

impl ColorTouch {
    /// From the touched and the untouched image, which must have the same size.
    pub fn from_images(raw: RgbGrid, reference: RgbGrid) -> Option<Self> {
        if raw.size() != reference.size() {
            return None;
        }
        let difference = RgbGrid::from_fn(raw.width(), raw.height(), |x, y| {
            let (a, b) = (raw[(x, y)], reference[(x, y)]);
            [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
        });
        Some(Self { images: Some(ColorImages { raw, reference }), difference })
    }
}

/// A depth sensor's touch, in the sensor's own *raw* orientation (the lab's Soft Bubble: not rotated by 180 degrees).
#[derive(Clone, Debug)]
pub struct DepthTouch {
    /// Reference depth minus current depth, meters, positive = pushed in. 175 x 140 px from the lab's files.
    pub imprint: DepthMap,
    /// Camera that lifts the imprint to points in the grasp frame; `None` for image folders.
    pub camera: Option<DepthCamera>,
    /// The simulator's truth; `None` for measured data.
    pub truth: Option<DepthTruth>,
}

/// A depth camera: untouched depth, intrinsics and its place in the gripper.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCamera {
    /// Depth without contact, meters, same size as the imprint.
    pub depth_reference: DepthMap,
    /// Intrinsics of the full image.
    pub intrinsics: Intrinsics,
    /// Part of the full image that is stored.
    pub crop: Crop,
    /// Camera frame to grasp frame.
    pub grasp_from_camera: DAffine3,
}

impl DepthCamera {
    /// Lifts pixel `(u, v)` of the imprint at depth `z` (meters) to a point in the camera frame, meters.
    pub fn lift(&self, u: f64, v: f64, z: f64) -> DVec3 {
        self.crop.lift(&self.intrinsics, u, v, z)
    }

    /// Projects a point in the camera frame to a pixel of the imprint; `None` behind the camera.
    pub fn project(&self, p_in_camera: DVec3) -> Option<(f64, f64)> {
        self.crop.project(&self.intrinsics, p_in_camera)
    }
}

/// Truth that only a simulator knows.
#[derive(Clone, Debug)]
pub struct DepthTruth {
    /// The imprint before camera noise, meters.
    pub imprint: DepthMap,
    /// Pixels whose membrane point lies on the tool.
    pub contact: Mask,
}

impl Sample {
    /// Touch on a pad, if the source has it.
    pub fn pad(&self, pad: PadId) -> Option<&PadTouch> {
        self.pads.get(pad)
    }

    /// Bytes held by the images, for the cache's budget.
    pub fn bytes(&self) -> usize {
        self.pads.iter().flatten().flat_map(PadTouch::readings).map(|(_, reading)| reading.bytes()).sum()
    }
}
