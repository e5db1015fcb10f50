//! The lens of a GelSlim: its picture is shrunk towards the edges, and bars in it are bent.

use glam::DVec2;

use crate::rig::lab;

/// Lens of one GelSlim: from pixels to the plane of the gel. Distortion is radial, about a center near the picture's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Center of the distortion, pixels (column, row).
    pub center_px: [f64; 2],
    /// Scale at the center, pixels per meter.
    pub px_per_m: f64,
    /// Coefficients of the second and fourth power of the distance, half the picture's width being 1.
    pub radial: [f64; 2],
    /// Turn of the picture against the bubble's, clockwise, radians.
    pub turn_rad: f64,
}

/// Half the picture's width, pixels.
const HALF_PX: f64 = 213.0;

impl Lens {
    /// The lenses of the lab's two GelSlims, right and left: measured on the dots of published pictures, the turns on the same
    /// bars in both sensors' pictures.
    pub(super) const LAB: [Self; 2] = [
        Self { center_px: [218.6, 165.5], px_per_m: 19_440.0, radial: [-0.347, 0.150], turn_rad: 0.021 },
        Self { center_px: [214.9, 157.9], px_per_m: 18_870.0, radial: [-0.381, 0.177], turn_rad: 0.034 },
    ];

    /// Place on the gel, meters from the center of the distortion, along the picture's axes (right, down).
    fn about_center(&self, px: DVec2) -> DVec2 {
        let q = (px - DVec2::from_array(self.center_px)) / HALF_PX;
        let square = q.length_squared();
        let [second, fourth] = self.radial;
        q * (1.0 + square * (second + square * fourth)) * (HALF_PX / self.px_per_m)
    }

    /// Middle of the picture, pixels.
    fn middle_px() -> DVec2 {
        DVec2::new((lab::GELSLIM.width - 1) as f64, (lab::GELSLIM.height - 1) as f64) * 0.5
    }

    /// Place on the gel that a pixel (column, row) looks at, meters from the picture's middle, along the picture's axes as
    /// they would lie in the bubble's picture.
    pub fn flat(&self, px: DVec2) -> DVec2 {
        self.view()(px)
    }

    /// [`Lens::flat`] for many pixels.
    pub(super) fn view(&self) -> impl Fn(DVec2) -> DVec2 + '_ {
        let (turn, middle) = (DVec2::from_angle(self.turn_rad), self.about_center(Self::middle_px()));
        move |px| turn.rotate(self.about_center(px) - middle)
    }

    /// Pixel that looks at a place on the gel: the inverse of [`Lens::flat`].
    pub fn pixel(&self, flat: DVec2) -> DVec2 {
        let (view, mut px) = (self.view(), Self::middle_px() + flat * self.px_per_m);
        // The distortion is mild: each step leaves a small share of the error.
        for _ in 0..30 {
            let step = (flat - view(px)) * self.px_per_m;
            px += step;
            if step.length_squared() < 1e-10 {
                break;
            }
        }
        px
    }

    /// Scale around a place on the gel, pixels per meter.
    pub(super) fn scale(&self, px: DVec2) -> f64 {
        (self.flat(px + DVec2::X) - self.flat(px - DVec2::X)).length().recip() * 2.0
    }

    /// Half the extent of what the picture shows, meters along its axes.
    pub(super) fn half_extent(&self) -> DVec2 {
        let size = DVec2::new((lab::GELSLIM.width - 1) as f64, (lab::GELSLIM.height - 1) as f64);
        let corners = [DVec2::ZERO, size, DVec2::new(size.x, 0.0), DVec2::new(0.0, size.y)];
        let edges = [
            0.5 * size.with_x(0.0),
            0.5 * size.with_y(0.0),
            size - 0.5 * size.with_x(0.0),
            size - 0.5 * size.with_y(0.0),
        ];
        corners.iter().chain(&edges).fold(DVec2::ZERO, |most, px| most.max(self.flat(*px).abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_comes_back_and_the_view_is_the_published_one() {
        for lens in Lens::LAB {
            for i in 0..100 {
                let px = DVec2::new(f64::from(i % 10) * 47.3, f64::from(i / 10) * 35.4);
                assert!((lens.pixel(lens.flat(px)) - px).length() < 1e-4, "{px}");
            }
            assert!(lens.flat(Lens::middle_px()).length() < 1e-12);
            let view = lens.half_extent() * 2e3;
            // Its widest rows and columns; the published 18.0 x 13.5 mm are the middle ones.
            assert!((view.x - 18.0).abs() < 2.0 && (view.y - 14.2).abs() < 1.2, "{view}");
            let (middle, edge) = (lens.scale(Lens::middle_px()), lens.scale(DVec2::new(420.0, 160.0)));
            assert!(edge > 1.25 * middle, "{middle} {edge}");
        }
    }
}
