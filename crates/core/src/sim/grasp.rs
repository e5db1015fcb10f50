//! Random grasps of the tool, in the range of the lab's.

use crate::frames::PlanarPose;
use crate::noise::{Noise, Stream};

/// Half the range of the grasp angle, radians.
pub(crate) const THETA_RANGE_RAD: f64 = 22.5 * std::f64::consts::PI / 180.0;
/// Half the side of the square of grasp positions, meters.
pub(crate) const POSITION_RANGE_M: f64 = 0.005;

/// A grasp in the lab's terms, see [`PlanarPose::object_from_grasp_of_lab`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Grasp {
    /// Angle of the grasp, radians.
    pub theta_rad: f64,
    /// First offset of the grasp, meters.
    pub x_m: f64,
    /// Second offset of the grasp, meters.
    pub y_m: f64,
}

impl Grasp {
    /// The pose that the lab calls the truth.
    pub fn object_from_grasp(self) -> PlanarPose {
        PlanarPose::object_from_grasp_of_lab(self.theta_rad, self.x_m, self.y_m)
    }
}

/// A grasp drawn uniformly from the lab's range.
pub fn random_grasp(seed: u64) -> Grasp {
    random_grasp_within(seed, THETA_RANGE_RAD, POSITION_RANGE_M)
}

/// A grasp drawn uniformly: up to `theta_rad` turned either way, up to `position_m` off along x and y.
pub fn random_grasp_within(seed: u64, theta_rad: f64, position_m: f64) -> Grasp {
    let mut noise = Noise::new(seed, Stream::Grasp, 0);
    Grasp {
        theta_rad: noise.uniform(-theta_rad, theta_rad),
        x_m: noise.uniform(-position_m, position_m),
        y_m: noise.uniform(-position_m, position_m),
    }
}
