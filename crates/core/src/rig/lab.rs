//! The lab's rig: a GelSlim and a Soft Bubble on the right and on the left finger.
//!
//! Source of the numbers: the Touch2Touch paper (px/mm), the lab's `point_cloud_utils.py` lines 5-10 (crop), the lab's
//! CTTP repository, `utils/dataset_management.py` lines 11-50 (size of the windows); their places were measured.

use std::borrow::Cow;

use super::{CameraTolerance, Crop, Pad, PadId, Rig, Sensor, SensorId, SensorKind, Window};

/// The right finger: index 0 in the lab's files.
pub const RIGHT: PadId = PadId::new(0);
/// The left finger: index 1 in the lab's files.
pub const LEFT: PadId = PadId::new(1);
/// Both fingers in the order of the lab's files.
pub const PADS: [PadId; 2] = [RIGHT, LEFT];
/// The GelSlim's place in the rig.
pub const GELSLIM_ID: SensorId = SensorId(0);
/// The Soft Bubble's place in the rig.
pub const BUBBLE_ID: SensorId = SensorId(1);

/// The GelSlim: a color camera behind a gel.
pub static GELSLIM: Sensor = Sensor {
    key: Cow::Borrowed("gelslim"),
    name: Cow::Borrowed("GelSlim"),
    kind: SensorKind::Color,
    width: 427,
    height: 320,
    px_per_m: 23_720.0,
    crop: Crop { full: [427, 320], offset: [0, 0] },
    rotation_deg: 0,
};

/// Directions of the GelSlim's red, green and blue LED in its picture, radians from +x (right) towards +y (down): green
/// lights the wrist side, red and blue some 120 degrees away.
pub(crate) const GELSLIM_LED_ANGLE_RAD: [f64; 3] = [-0.94, 2.91, 0.87];
/// Brightness change of the GelSlim's picture per unit of slope, per channel, 0..255 scale.
pub(crate) const GELSLIM_LED_GAIN: [f64; 3] = [64.0, 36.0, 42.0];

/// The Soft Bubble: a depth camera behind an air-filled membrane.
pub static BUBBLE: Sensor = Sensor {
    key: Cow::Borrowed("bubble"),
    name: Cow::Borrowed("Soft Bubble"),
    kind: SensorKind::Depth,
    width: 175,
    height: 140,
    px_per_m: 2360.0,
    crop: Crop { full: [224, 171], offset: [25, 20] },
    rotation_deg: 180,
};

/// The depth of a GelSlim's own gel, pixel by pixel as in its picture: what the lab's depth data set holds.
pub static GELSLIM_DEPTH: Sensor = Sensor {
    key: Cow::Borrowed("gelslimdepth"),
    name: Cow::Borrowed("GelSlim depth"),
    kind: SensorKind::Depth,
    width: GELSLIM.width,
    height: GELSLIM.height,
    px_per_m: GELSLIM.px_per_m,
    crop: GELSLIM.crop,
    rotation_deg: 0,
};

/// Centers of what the GelSlims see, in raw bubble pixels: right, left. Measured on published pairs by registering the bead in
/// the GelSlim's picture and the crests of the imprint to the same tool, good to half a pixel.
///
/// Right is the finger whose pictures have +y downwards. CTTP's rectangles, at (73.3, 67.0) and (62.6, 70.3), have the names
/// the other way round.
const WINDOW_CENTERS_PX: [[f64; 2]; 2] = [[64.5, 71.6], [74.8, 73.4]];

/// The whole rig; the windows are as large as the GelSlim's view (18.0 x 13.5 mm) at the bubble's scale.
pub(super) fn rig() -> Rig {
    let size_px = GELSLIM.size().map(|side| side as f64 / GELSLIM.px_per_m * BUBBLE.px_per_m);
    let window = |pad, center_px| Window { pad, of: GELSLIM_ID, within: BUBBLE_ID, center_px, size_px };
    Rig {
        name: Cow::Borrowed("GelSlim and Soft Bubble"),
        sensors: vec![GELSLIM.clone(), BUBBLE.clone()],
        pads: pads(),
        windows: vec![window(RIGHT, WINDOW_CENTERS_PX[0]), window(LEFT, WINDOW_CENTERS_PX[1])],
        camera_tolerance: CameraTolerance::default(),
    }
}

/// The rig of the lab's depth data set: a GelSlim with its own depth on either finger.
pub fn depth_rig() -> Rig {
    let [width, height] = GELSLIM.size().map(|side| side as f64);
    let (center_px, size_px) = ([0.5 * (width - 1.0), 0.5 * (height - 1.0)], [width, height]);
    let window = |pad| Window { pad, of: GELSLIM_ID, within: SensorId(1), center_px, size_px };
    Rig {
        name: Cow::Borrowed("GelSlim with its depth"),
        sensors: vec![GELSLIM.clone(), GELSLIM_DEPTH.clone()],
        pads: pads(),
        windows: PADS.map(window).to_vec(),
        camera_tolerance: CameraTolerance::default(),
    }
}

fn pads() -> Vec<Pad> {
    let pad = |key, name| Pad { key: Cow::Borrowed(key), name: Cow::Borrowed(name) };
    vec![pad("right", "Right"), pad("left", "Left")]
}
