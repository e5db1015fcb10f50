//! [`Gate`]: where a hand may change a mask.

use serde::{Deserialize, Serialize};

use crate::grid::{DepthMap, Mask};

/// Gate: the pixels where a hand may change a mask. Painting over the edge of a tool then stays on the tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Gate {
    /// Only where the imprint is between these depths, meters.
    pub depth_m: Option<[f32; 2]>,
    /// Only within this distance of the CAD model at the true pose, meters.
    pub cad_m: Option<f32>,
    /// Everywhere but there.
    pub inverted: bool,
}

impl Gate {
    /// True where it keeps nothing out.
    pub fn is_open(&self) -> bool {
        self.depth_m.is_none() && self.cad_m.is_none()
    }

    /// The pixels that may change. `near` are those within [`Self::cad_m`] of the model. A pixel without depth is
    /// between no depths.
    pub fn allowed(&self, imprint: &DepthMap, near: Option<&Mask>) -> Mask {
        Mask::from_fn(imprint.width(), imprint.height(), |x, y| {
            let depth = imprint[(x, y)];
            let deep = self.depth_m.is_none_or(|[lo, hi]| (lo..=hi).contains(&depth));
            let close = near.is_none_or(|near| near.get(x, y) == Some(&true));
            (deep && close) != (self.inverted && !self.is_open())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_conditions_hold_and_are_turned_round_together() {
        let imprint = DepthMap::from_fn(4, 1, |x, _| [0.001, 0.004, f32::NAN, 0.004][x]);
        let near = Mask::from_fn(4, 1, |x, _| x < 3);
        let gate = Gate { depth_m: Some([0.002, 0.005]), cad_m: Some(0.001), inverted: false };
        assert_eq!(gate.allowed(&imprint, Some(&near)).as_slice(), [false, true, false, false]);
        let gate = Gate { inverted: true, ..gate };
        assert_eq!(gate.allowed(&imprint, Some(&near)).as_slice(), [true, false, true, true]);
        let open = Gate { inverted: true, ..Gate::default() };
        assert!(open.is_open() && open.allowed(&imprint, None).as_slice().iter().all(|v| *v));
    }
}
