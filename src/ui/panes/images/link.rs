//! [`Link`]: where the pixels of one sensor lie in the picture of the other.

use touch2touch_core::rig::{PadId, Rig};

/// Window of a depth picture that the color sensor sees (the dashed rectangle), and whether it sees it turned by 180
/// degrees.
#[derive(Clone, Copy)]
pub(crate) struct Link {
    /// Center and size, depth pixels.
    pub(crate) window: [f64; 4],
    turned: bool,
}

impl Link {
    /// Window of a finger by the rig; `None` where it has none.
    pub(crate) fn of(rig: &Rig, finger: PadId) -> Option<Self> {
        Some(Self { window: rig.color_window(finger)?.rectangle(), turned: rig.turned() })
    }

    /// Position in the color picture of `size` pixels of a depth pixel.
    pub(crate) fn color_from_depth(self, px: [f32; 2], size: [usize; 2]) -> [f32; 2] {
        let [cx, cy, w, h] = self.window.map(|v| v as f32);
        let share = [(px[0] - cx) / w + 0.5, (px[1] - cy) / h + 0.5].map(|s| if self.turned { 1.0 - s } else { s });
        [share[0] * size[0] as f32 - 0.5, share[1] * size[1] as f32 - 0.5]
    }

    /// The opposite of [`Link::color_from_depth`].
    pub(crate) fn depth_from_color(self, px: [f32; 2], size: [usize; 2]) -> [f32; 2] {
        let [cx, cy, w, h] = self.window.map(|v| v as f32);
        let share = [(px[0] + 0.5) / size[0].max(1) as f32, (px[1] + 0.5) / size[1].max(1) as f32];
        let share = share.map(|s| if self.turned { 1.0 - s } else { s });
        [(share[0] - 0.5) * w + cx, (share[1] - 0.5) * h + cy]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cross_hair_finds_its_way_between_the_sensors() {
        let rig = Rig::lab();
        for finger in rig.pads() {
            let link = Link::of(&rig, finger).unwrap();
            let [cx, cy, w, h] = link.window.map(|v| v as f32);
            let middle = link.color_from_depth([cx, cy], [427, 320]);
            assert!((middle[0] - 213.0).abs() < 1e-3 && (middle[1] - 159.5).abs() < 1e-3);
            // The GelSlim is rotated: its first pixel is the last corner of the rectangle.
            let corner = link.color_from_depth([cx + w * 0.5, cy + h * 0.5], [427, 320]);
            assert!(corner[0].abs() < 0.51 && corner[1].abs() < 0.51, "{corner:?}");
            let back = link.depth_from_color(link.color_from_depth([50.0, 60.0], [427, 320]), [427, 320]);
            assert!((back[0] - 50.0).abs() < 1e-3 && (back[1] - 60.0).abs() < 1e-3);
        }
    }
}
