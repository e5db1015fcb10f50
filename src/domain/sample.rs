//! One loaded grasp: what both sensors felt, the rig it was felt with, and the truth where it is known.

use std::sync::Arc;

use glam::DAffine3;

use super::dataset::Problem;
use super::frames::PlanarPose;
use super::grid::{DepthMap, Mask, RgbGrid};
use super::sensor::{Finger, Intrinsics};
use super::upright::Turn;

/// One grasp, both fingers where the source has them.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// Indexed by [`Finger::index`]; `None` where the source has no such finger.
    pub fingers: [Option<FingerTouch>; 2],
    /// The true in-hand pose, where known. Its inverse carries the lab's angle sign.
    pub grasp_from_object: Option<PlanarPose>,
    /// Whether lengths are measured, or assumed because the source lost its scale.
    pub scale: Scale,
    /// How the source's images lay before they were laid upright; upright for whatever comes from a sensor.
    pub laid: Turn,
    /// What is odd about its files and numbers: whoever answers from this sample says so.
    pub notes: Vec<Problem>,
}

/// Where the metres of a sample come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// The source stores metres.
    #[default]
    Measured,
    /// The source was scaled to 0..255 image by image; the range is an assumption and must be labelled so.
    Assumed,
}

impl Scale {
    /// The name in files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Assumed => "assumed",
        }
    }
}

/// What one finger felt, with each sensor.
#[derive(Clone, Debug, Default)]
pub struct FingerTouch {
    /// The GelSlim's touch.
    pub gelslim: Option<GelSlimTouch>,
    /// The Soft Bubble's touch.
    pub bubble: Option<BubbleTouch>,
    /// The bubble camera of the same rig, where the bubble itself was not recorded: what a prediction is lifted with.
    pub rig: Option<Arc<BubbleCamera>>,
}

impl FingerTouch {
    /// The camera that saw the imprint, or would have seen it.
    pub fn camera(&self) -> Option<&BubbleCamera> {
        self.bubble.as_ref().and_then(|b| b.camera.as_ref()).or(self.rig.as_deref())
    }
}

/// A GelSlim touch: 427 x 320 px from the lab's files, any size from an image folder.
#[derive(Clone, Debug)]
pub struct GelSlimTouch {
    /// Touched and untouched image on the 0..255 scale; `None` where the source only has the difference.
    pub images: Option<GelSlimImages>,
    /// Touched minus untouched, signed, 0..255 scale. What the models see.
    pub difference: RgbGrid,
}

/// The two camera images behind a difference.
#[derive(Clone, Debug)]
pub struct GelSlimImages {
    /// The image during the touch.
    pub raw: RgbGrid,
    /// The image without contact.
    pub reference: RgbGrid,
}

impl GelSlimTouch {
    /// From the touched and the untouched image, which must have the same size.
    pub fn from_images(raw: RgbGrid, reference: RgbGrid) -> Option<Self> {
        if raw.size() != reference.size() {
            return None;
        }
        let difference = RgbGrid::from_fn(raw.width(), raw.height(), |x, y| {
            let (a, b) = (raw[(x, y)], reference[(x, y)]);
            [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
        });
        Some(Self { images: Some(GelSlimImages { raw, reference }), difference })
    }
}

/// A Soft Bubble touch in the *raw* orientation of the lab's files (not rotated by 180 degrees).
#[derive(Clone, Debug)]
pub struct BubbleTouch {
    /// Reference depth minus current depth, metres, positive = pushed in. 175 x 140 px from the lab's files.
    pub imprint: DepthMap,
    /// What is needed to lift the imprint to points in the grasp frame; `None` for image folders.
    pub camera: Option<BubbleCamera>,
    /// The simulator's truth; `None` for measured data.
    pub truth: Option<BubbleTruth>,
}

/// A bubble's depth camera: untouched depth, intrinsics and its place in the rig.
#[derive(Clone, Debug, PartialEq)]
pub struct BubbleCamera {
    /// Depth without contact, metres, same size as the imprint.
    pub depth_reference: DepthMap,
    /// Intrinsics of the full image.
    pub intrinsics: Intrinsics,
    /// Camera frame to grasp frame.
    pub grasp_from_camera: DAffine3,
}

/// What only a simulator knows.
#[derive(Clone, Debug)]
pub struct BubbleTruth {
    /// The imprint before camera noise, metres.
    pub imprint: DepthMap,
    /// Pixels whose membrane point lies on the tool.
    pub contact: Mask,
}

impl Sample {
    /// The finger's touch, if the source has it.
    pub fn finger(&self, finger: Finger) -> Option<&FingerTouch> {
        self.fingers[finger.index()].as_ref()
    }

    /// Bytes held by the images, for the cache's budget.
    pub fn bytes(&self) -> usize {
        let rgb = |g: &RgbGrid| g.len() * 12;
        let depth = |g: &DepthMap| g.len() * 4;
        self.fingers
            .iter()
            .flatten()
            .map(|touch| {
                let gel = touch.gelslim.as_ref().map_or(0, |g| {
                    rgb(&g.difference) + g.images.as_ref().map_or(0, |i| rgb(&i.raw) + rgb(&i.reference))
                });
                let bubble = touch.bubble.as_ref().map_or(0, |b| {
                    depth(&b.imprint)
                        + b.camera.as_ref().map_or(0, |c| depth(&c.depth_reference))
                        + b.truth.as_ref().map_or(0, |t| depth(&t.imprint) + t.contact.len())
                });
                gel + bubble
            })
            .sum()
    }
}
