//! Simulator of both sensors of the lab's rig and their ground truth.
//!
//! [`simulate`] presses a tool ([`tools()`](super::catalog::tools())) between two Soft Bubbles and two GelSlims at a
//! [`Grasp`] and returns what the lab's files hold, plus the truth. The same arguments give the same numbers on
//! every machine and for every number of threads.
//!
//! The model, and what it leaves out: the bubble's membrane is a sheet under pressure that stiffens as it stretches (see
//! `membrane`), so it spans between beads and falls off beside them; its camera looks obliquely, hides what lies behind a
//! bar and adds noise. The gel is a sheet on an elastic foundation under three LEDs, seen through a lens that bends lines.
//! There is no friction between membrane and tool and no light bouncing in the gel.
//!
//! One pair (both fingers, both sensors) costs about 0.15 s of one core in release, most of it for the rays of the camera.

mod condition;
mod config;
mod depth_camera;
mod faults;
mod gelslim;
mod grasp;
mod lens;
mod membrane;
mod rig;
mod sheet;

use glam::{DAffine3, DQuat, DVec2, DVec3};

pub use condition::{Condition, TEST_GRASPS, test_grasp};
pub(crate) use config::GelSlimConfig;
pub use config::{BubbleConfig, Sensors, SimConfig};
pub use faults::Fault;
pub(crate) use gelslim::marker_places;
pub use grasp::{Grasp, random_grasp, random_grasp_within};
pub use lens::Lens;
pub use membrane::{Dome, Membrane};
pub(crate) use rig::INTRINSICS;
pub use rig::{RANGE_M, gelslim_yz, grasp_from_camera, outward};

use super::catalog::ToolSpec;
use super::grid::{DepthMap, Grid};
use super::noise::{Noise, Stream};
use super::rig::{PadId, lab};
use super::sample::{DepthCamera, DepthTouch, DepthTruth, PadTouch, Sample};

/// Grid spacing of the membrane, meters.
const MEMBRANE_STEP_M: f64 = 0.001;

/// Both sensors' touch of `tool` held at `grasp`, for both fingers, with the truth.
///
/// `seed` draws the noise of this one touch; the sensors' fixed traits are in `config`.
pub fn simulate(tool: &ToolSpec, grasp: Grasp, seed: u64, config: &SimConfig) -> Sample {
    simulate_apart(tool, grasp, grasp, seed, config)
}

/// As [`simulate`], with the GelSlims at `gelslims` and the bubbles, whose pose is the truth, at `bubbles`.
pub(crate) fn simulate_apart(
    tool: &ToolSpec,
    gelslims: Grasp,
    bubbles: Grasp,
    seed: u64,
    config: &SimConfig,
) -> Sample {
    let (gelslims, bubbles) = (gelslims.object_from_grasp(), bubbles.object_from_grasp());
    let touch = |finger| {
        if config.first_bubble_alone && finger != lab::PADS[0] {
            return None;
        }
        let gelslim = || gelslim::touch(&config.gelslim, tool, gelslims, finger, seed);
        let felt = PadTouch::default().with(lab::GELSLIM_ID, (!config.first_bubble_alone).then(gelslim));
        let membrane = Membrane::press(&config.bubble, tool, bubbles, finger);
        Some(felt.with(lab::BUBBLE_ID, Some(bubble_touch(&config.bubble, tool, &membrane, finger, seed))))
    };
    let [one, other] = lab::PADS;
    let pads = <[_; 2]>::from(rayon::join(|| touch(one), || touch(other)));
    Sample { pads: pads.into(), grasp_from_object: Some(bubbles.inverse()), ..Sample::default() }
}

/// Depth that a tool is pressed into a gel in [`gelslim_depth`], meters.
pub const GEL_PRESS_M: f64 = 0.001;

/// Depth that a tool held at `grasp` comes into a finger's gel, meters, pixel by pixel of the GelSlim's own depth
/// ([`lab::GELSLIM_DEPTH`]): from its shape alone, as the lab made the depths of its data set. It is pressed in by
/// [`GEL_PRESS_M`].
pub fn gelslim_depth(tool: &ToolSpec, grasp: Grasp, finger: PadId) -> DepthMap {
    let (solid, object_from_grasp, sensor) = (tool.solid(), grasp.object_from_grasp(), &lab::GELSLIM_DEPTH);
    let (gel_m, middle) =
        (tool.half_thickness_m - GEL_PRESS_M, DVec2::from_array(sensor.size().map(|n| 0.5 * n as f64)));
    Grid::from_fn(sensor.width, sensor.height, |x, y| {
        let flat = (DVec2::new(x as f64, y as f64) - middle) / sensor.px_per_m;
        let height = solid.height(object_from_grasp.transform_yz(gelslim_yz(finger, flat)));
        height.map_or(0.0, |height| (height - gel_m).max(0.0) as f32)
    })
}

/// The nominal depth camera of a finger as it looks at one of the lab's tools, with the depth of the free membrane.
pub fn nominal_camera(finger: PadId) -> DepthCamera {
    let half_thickness_m = super::catalog::tools()[0].half_thickness_m;
    let config = BubbleConfig::default();
    let grasp_from_camera = grasp_from_camera(finger, half_thickness_m);
    let rays = depth_camera::Rays::new(finger, grasp_from_camera);
    let dome = Dome::new(&config, half_thickness_m, finger);
    let depth_reference = depth_camera::dome_depth(&rays, &dome).map(|z| z - config.reference_m as f32);
    DepthCamera { depth_reference, intrinsics: INTRINSICS, crop: lab::BUBBLE.crop, grasp_from_camera }
}

fn bubble_touch(config: &BubbleConfig, tool: &ToolSpec, membrane: &Membrane, finger: PadId, seed: u64) -> DepthTouch {
    // The camera rides with the finger: pressed deeper it is nearer.
    let nearer = outward(finger) * (config.press_m - config::NOMINAL_PRESS_M);
    let nominal = DAffine3::from_translation(DVec3::X * nearer) * grasp_from_camera(finger, tool.half_thickness_m);
    let truly = nominal * calibration_error(config, finger, seed);
    let rays = depth_camera::Rays::new(finger, truly);
    let depth_reference = depth_camera::dome_depth(&rays, membrane.dome()).map(|z| z - config.reference_m as f32);
    let (depth, contact) = depth_camera::membrane_depth(&rays, membrane);
    let imprint = depth_camera::measure(&depth_reference, &depth, config, finger, seed);
    let mut truth = depth_reference.clone();
    for (imprint, depth) in truth.as_mut_slice().iter_mut().zip(depth.as_slice()) {
        *imprint -= depth;
    }
    DepthTouch {
        imprint,
        camera: Some(DepthCamera {
            depth_reference,
            intrinsics: INTRINSICS,
            crop: lab::BUBBLE.crop,
            grasp_from_camera: nominal,
        }),
        truth: Some(DepthTruth { imprint: truth, contact }),
    }
}

/// Pose of the real camera, seen from where the sample says it is; the identity by default.
fn calibration_error(config: &BubbleConfig, finger: PadId, seed: u64) -> DAffine3 {
    if config.calibration_m == 0.0 && config.calibration_rad == 0.0 {
        return DAffine3::IDENTITY;
    }
    let mut noise = Noise::new(seed, Stream::Rig, finger.index());
    let mut vector = || DVec3::from_array(std::array::from_fn(|_| f64::from(noise.normal())));
    let turn = DQuat::from_scaled_axis(vector() * config.calibration_rad);
    DAffine3::from_rotation_translation(turn, vector() * config.calibration_m)
}
