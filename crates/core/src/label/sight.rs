//! [`Sight`]: a picture of points in space, through which a mask is drawn on; [`VisiblePixels`]: where the pixels of the mask lie in
//! that picture, and which of them a drawing reaches.

use std::collections::HashMap;

use glam::{DMat4, DVec2, DVec3, DVec4, Mat4};
use serde::{Deserialize, Serialize};
use strum::EnumIter;

use super::region;
use crate::moments::median;

/// Layers of points that lie behind each other: which of them a drawing reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, EnumIter)]
#[serde(rename_all = "snake_case")]
pub enum Layers {
    /// Points that nothing hides.
    #[default]
    Front,
    /// All of them.
    All,
}

impl Layers {
    /// Points that are reached, in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front-most points",
            Self::All => "all points, also hidden ones",
        }
    }

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Front => Self::All,
            Self::All => Self::Front,
        }
    }
}

/// Largest distance of a point behind the nearest one, meters, at which it still belongs to the same layer.
const LAYER_M: f64 = 0.0025;
/// Width of the cells in which the nearest point is looked for, in distances between neighboring points: in each cell of a
/// layer there is one.
const CELL: f64 = 2.0;

/// View that a picture of points in space was taken from: what a drawing on it is a drawing on.
///
/// In single precision, so that it is the same after it was written and read as text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sight {
    /// From the grasp frame (meters) to clip coordinates; depth reversed (1 near, 0 far).
    pub clip_from_grasp: Mat4,
    /// Columns and rows of the picture.
    pub size_px: [u32; 2],
    /// Layers that are reached.
    #[serde(default)]
    pub layers: Layers,
}

/// A matrix in double precision, so that it is taken apart once for many points.
struct Projection {
    clip: DMat4,
    half_size: DVec2,
}

impl Projection {
    fn of(sight: &Sight) -> Self {
        let half_size = DVec2::from(sight.size_px.map(|s| 0.5 * f64::from(s.max(1))));
        Self { clip: sight.clip_from_grasp.as_dmat4(), half_size }
    }

    /// Place in the picture, and depth along the line of sight, meters from somewhere.
    fn place(&self, p: DVec3) -> Option<(DVec2, f64)> {
        let clip = self.clip * p.extend(1.0);
        // Reversed depth: in front of the near plane means z <= w.
        let inside = clip.w > 0.0 && clip.z <= clip.w && clip.z >= 0.0;
        let place_px = (DVec2::new(1.0 + clip.x / clip.w, 1.0 - clip.y / clip.w)) * self.half_size - 0.5;
        let depth = self.depth(clip);
        (inside && place_px.is_finite() && depth.is_finite()).then_some((place_px, depth))
    }

    /// In perspective `w` grows with the depth, in a parallel projection `z` falls with it.
    fn depth(&self, clip: DVec4) -> f64 {
        let (z, w) = (self.clip.row(2).truncate().length(), self.clip.row(3).truncate().length());
        if w > 0.0 { clip.w / w } else { -clip.z / z }
    }

    fn px_per_m(&self, p: DVec3) -> Option<f64> {
        let w = (self.clip * p.extend(1.0)).w;
        let scale = self.clip.row(1).truncate().length() * self.half_size.y / w;
        (scale.is_finite() && scale > 0.0).then_some(scale)
    }
}

impl Sight {
    /// Place of a point (meters, grasp frame) in the picture, pixels, `(0, 0)` being the center of the first pixel;
    /// `None` behind the eye and for a point that is not finite.
    pub fn project(&self, p_in_grasp: DVec3) -> Option<DVec2> {
        Some(Projection::of(self).place(p_in_grasp)?.0)
    }

    /// The picture's pixels per meter at the depth of a point (grasp frame); `None` behind the eye.
    pub fn px_per_m(&self, p_in_grasp: DVec3) -> Option<f64> {
        Projection::of(self).px_per_m(p_in_grasp)
    }
}

/// Pixels of one finger's mask that a drawing on a picture reaches, with their places in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VisiblePixels {
    /// Column and row in the mask, and place in the picture.
    points: Vec<([u16; 2], DVec2)>,
    /// Half the distance between neighbors, picture pixels: a thin brush still meets them.
    reach_px: f64,
}

impl VisiblePixels {
    /// The pixels of a mask by the points that were lifted from it (`own`: meters, grasp frame, row by row, and the pixel of
    /// each), as far as they are reached; `others` are points of other fingers, which can hide them.
    pub fn new(sight: &Sight, (own, pixels): (&[DVec3], &[[u16; 2]]), others: &[&[DVec3]]) -> Self {
        let projection = Projection::of(sight);
        let place = |p: &DVec3| projection.place(*p);
        let placed: Vec<([u16; 2], DVec2, f64)> = own
            .iter()
            .zip(pixels)
            .filter_map(|(p, pixel)| place(p).map(|(place_px, depth)| (*pixel, place_px, depth)))
            .collect();
        let spacing_px = median(own.iter().filter_map(|p| projection.px_per_m(*p)))
            .zip(spacing(own, pixels))
            .map_or(1.0, |(scale, spacing_m)| scale * spacing_m);
        let cell_px = (CELL * spacing_px).max(1.0);
        let cell = |place_px: DVec2| ((place_px.x / cell_px).floor() as i64, (place_px.y / cell_px).floor() as i64);
        let mut nearest: HashMap<(i64, i64), f64> = HashMap::new();
        if sight.layers == Layers::Front {
            let hiding = others.iter().flat_map(|points| points.iter()).filter_map(place);
            for (place_px, depth) in placed.iter().map(|(_, place_px, depth)| (*place_px, *depth)).chain(hiding) {
                let least = nearest.entry(cell(place_px)).or_insert(depth);
                *least = least.min(depth);
            }
        }
        let is_reached =
            |place_px: DVec2, depth: f64| nearest.get(&cell(place_px)).is_none_or(|least| depth <= least + LAYER_M);
        let points = placed
            .into_iter()
            .filter(|(_, place_px, depth)| is_reached(*place_px, *depth))
            .map(|(pixel, place_px, _)| (pixel, place_px));
        Self { points: points.collect(), reach_px: 0.5 * spacing_px }
    }

    /// The pixel whose point is nearest to a place in the picture.
    pub(super) fn nearest(&self, at_px: DVec2) -> Option<[u16; 2]> {
        let distance = |place_px: &DVec2| (*place_px - at_px).length_squared();
        let nearest = self.points.iter().min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))?;
        Some(nearest.0)
    }

    /// The pixels whose points lie within `radius_px` of the segment from `a` to `b` of the picture.
    pub(super) fn along(&self, [a, b]: [DVec2; 2], radius_px: f64) -> impl Iterator<Item = [u16; 2]> {
        let (along, radius) = (b - a, radius_px.max(self.reach_px));
        let length2 = along.length_squared();
        let hit = move |p: DVec2| {
            let t = if length2 > 0.0 { ((p - a).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
            (p - (a + along * t)).length_squared() <= radius * radius
        };
        self.points.iter().filter(move |(_, place_px)| hit(*place_px)).map(|(pixel, _)| *pixel)
    }

    /// The pixels whose points a closed line of the picture encloses, or with `box_only` the rectangle between its first and
    /// its last corner.
    pub(super) fn within(&self, corners: &[DVec2], box_only: bool) -> Vec<[u16; 2]> {
        let ends = [corners.first(), corners.last()].map(|corner| corner.copied().unwrap_or(DVec2::NAN));
        let bounds = |points: &[DVec2]| {
            points.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)))
        };
        let (lo, hi) = bounds(if box_only { &ends } else { corners });
        let in_box = |p: DVec2| p.cmpge(lo).all() && p.cmple(hi).all();
        let points = self
            .points
            .iter()
            .filter(|(_, place_px)| in_box(*place_px) && (box_only || region::encloses(corners, *place_px)));
        points.map(|(pixel, _)| *pixel).collect()
    }
}

/// The distance between points of neighboring pixels of a row, meters, median.
fn spacing(points: &[DVec3], pixels: &[[u16; 2]]) -> Option<f64> {
    let neighbors = points
        .windows(2)
        .zip(pixels.windows(2))
        .filter(|(_, pixels)| pixels[0][1] == pixels[1][1] && pixels[1][0] - pixels[0][0] == 1);
    median(neighbors.map(|(p, _)| p[0].distance(p[1])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{from_above, sheet};

    const CENTER: DVec2 = DVec2::new(199.5, 149.5);

    fn stamp(seen: &VisiblePixels, place_px: DVec2, radius_px: f64) -> usize {
        seen.along([place_px, place_px], radius_px).count()
    }

    #[test]
    fn points_appear_where_they_are_and_as_large_as_they_are() {
        let sight = from_above(4000.0, Layers::Front);
        assert!((sight.project(DVec3::ZERO).unwrap() - CENTER).length() < 1e-4);
        // x to the right, y up on the screen.
        let place_px = sight.project(DVec3::new(0.005, 0.005, 0.0)).unwrap();
        assert!((place_px - CENTER - DVec2::new(20.0, -20.0)).length() < 1e-3, "{place_px}");
        assert!((sight.px_per_m(DVec3::ZERO).unwrap() - 4000.0).abs() < 1e-3);
        assert!((sight.px_per_m(DVec3::Z * 0.1).unwrap() - 8000.0).abs() < 1e-2, "twice as large at half the way");
        for p in [DVec3::NAN, DVec3::Z * 0.3, DVec3::Z * 0.195] {
            assert_eq!(sight.project(p), None, "{p}: behind the eye, too near, or nowhere");
        }
        assert_eq!(sight.px_per_m(DVec3::Z * 0.3), None);
    }

    #[test]
    fn of_two_sheets_the_front_one_is_reached_or_both() {
        let (near, far) = (sheet(0.005), sheet(-0.005));
        let reached = |own: &(Vec<DVec3>, Vec<[u16; 2]>), other: &[DVec3], layers| {
            let seen = VisiblePixels::new(&from_above(4000.0, layers), (&own.0, &own.1), &[other]);
            stamp(&seen, CENTER, 9.0)
        };
        let all = reached(&far, &near.0, Layers::All);
        // A disc of 9 px at 4000 px/m, points 2 px apart (a bit less there: it is farther away).
        assert!((60..80).contains(&all), "{all}");
        assert_eq!(reached(&far, &near.0, Layers::Front), 0, "hidden");
        assert_eq!(reached(&far, &[], Layers::Front), all);
        assert_eq!(reached(&near, &far.0, Layers::Front), reached(&near, &[], Layers::All));
        // Zoomed in, what is behind does not shine through between the points.
        let seen = VisiblePixels::new(&from_above(60_000.0, Layers::Front), (&far.0, &far.1), &[&near.0]);
        assert_eq!(stamp(&seen, CENTER, 100.0), 0);
        // A fold of one sheet hides its own back.
        let both = ([near.0.clone(), far.0].concat(), [near.1.clone(), far.1].concat());
        assert_eq!(reached(&both, &[], Layers::Front), reached(&near, &[], Layers::Front));
    }

    #[test]
    fn nothing_and_nonsense_reach_nothing() {
        let sight = from_above(4000.0, Layers::Front);
        assert_eq!(stamp(&VisiblePixels::new(&sight, (&[], &[]), &[]), CENTER, 1e9), 0);
        assert_eq!(VisiblePixels::default().nearest(CENTER), None);
        let (mut points, pixels) = sheet(0.0);
        points[220] = DVec3::NAN;
        points[221] = DVec3::Z * 0.5;
        let seen = VisiblePixels::new(&sight, (&points, &pixels), &[]);
        assert_eq!(stamp(&seen, CENTER, 1e9), 21 * 21 - 2);
        assert_eq!(stamp(&seen, DVec2::NAN, 9.0), 0);
        assert_eq!(stamp(&seen, CENTER, f64::NAN), stamp(&seen, CENTER, 0.0), "no radius is a thin one");
        let broken = Sight { clip_from_grasp: Mat4::NAN, ..sight.clone() };
        assert_eq!(stamp(&VisiblePixels::new(&broken, (&points, &pixels), &[&points]), CENTER, 1e9), 0);
        let empty = Sight { size_px: [0, 0], clip_from_grasp: Mat4::ZERO, ..sight };
        assert_eq!(stamp(&VisiblePixels::new(&empty, (&points, &pixels), &[]), CENTER, 1e9), 0);
    }
}
