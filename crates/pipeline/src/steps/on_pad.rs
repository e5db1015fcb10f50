//! [`OnPad`]: what results of a single pad are made from.

use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Sample;

/// One pad of a grasp.
#[derive(Clone, Copy, Debug)]
pub struct OnPad<'a> {
    /// The grasp.
    pub sample: &'a Sample,
    /// The pad.
    pub pad: PadId,
}
