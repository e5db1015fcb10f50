//! [`Drawing`]: what a hand does on a mask, as a value. The studio previews it, a journal can store it, a verb can
//! repeat it; here it becomes pixels.

use std::str::FromStr;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::paint::Paint;
use super::sight::{Sight, VisiblePixels};
use super::{Rect, paint, region};
use crate::grid::{DepthMap, Mask};

/// A tool with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "tool", rename_all = "snake_case")]
pub enum DrawTool {
    /// Follows the pointer's way.
    Brush {
        /// Half its width, pixels of what is drawn on.
        radius_px: f32,
    },
    /// The area that the pointer's way encloses, closed by a straight line.
    Lasso,
    /// The area that straight lines between clicks enclose.
    Polygon,
    /// Between the first and the last point.
    Rectangle,
    /// The connected pixels around the first point whose imprint is about as deep; dragging to the right takes more,
    /// to the left less.
    Wand {
        /// By how much the depth may differ, meters.
        tolerance_m: f32,
    },
}

impl DrawTool {
    /// Corners of the area that points of the tool enclose, as it shows on the way; none of a tool that encloses nothing.
    pub fn outline(self, points: &[DVec2]) -> Vec<DVec2> {
        match (self, points) {
            (Self::Lasso | Self::Polygon, points) => points.to_vec(),
            (Self::Rectangle, [a, .., b]) => vec![*a, DVec2::new(b.x, a.y), *b, DVec2::new(a.x, b.y)],
            _ => Vec::new(),
        }
    }
}

/// Pixels of dragging that double or halve the tolerance of the wand.
const DOUBLES_PX: f32 = 24.0;

/// One stroke or shape that a hand draws on a mask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawing {
    /// Tool that it is drawn with.
    #[serde(flatten)]
    pub tool: DrawTool,
    /// The pointer's way or the corners, pixels of the image, or of the picture of [`Self::sight`]: `(0, 0)` is the center of
    /// the first one.
    pub points: Vec<[f32; 2]>,
    /// Value that the pixels it touches get.
    #[serde(default)]
    pub paint: Paint,
    /// The picture of points in space that it was drawn on; `None` on the image itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sight: Option<Box<Sight>>,
}

/// Imprint that a drawing falls on, with what else decides what it does.
#[derive(Clone, Copy, Debug)]
pub struct Ground<'a> {
    /// The imprint, meters; as large as the mask.
    pub imprint: &'a DepthMap,
    /// Mask that [`Paint::LetThrough`] takes the values from.
    pub proposed: Option<&'a Mask>,
    /// Places of the pixels in the picture of a drawing that has a [`Drawing::sight`]; without them such a drawing
    /// touches nothing.
    pub seen: Option<&'a VisiblePixels>,
}

impl<'a> Ground<'a> {
    /// An imprint alone.
    pub fn new(imprint: &'a DepthMap) -> Self {
        Self { imprint, proposed: None, seen: None }
    }
}

impl FromStr for Drawing {
    type Err = String;

    /// The JSON object of a drawing that can touch something.
    fn from_str(text: &str) -> Result<Self, String> {
        let drawing: Self = serde_json::from_str(text).map_err(|err| err.to_string())?;
        drawing.check().map(|()| drawing)
    }
}

impl Drawing {
    /// The name in the history of a mask.
    pub fn name(&self) -> &'static str {
        match (self.tool, self.paint) {
            (DrawTool::Brush { .. }, Paint::Free) => "eraser stroke",
            (DrawTool::Brush { .. }, _) => "brush stroke",
            (DrawTool::Lasso, _) => "lasso",
            (DrawTool::Polygon, _) => "polygon",
            (DrawTool::Rectangle, _) => "rectangle",
            (DrawTool::Wand { .. }, _) => "wand",
        }
    }

    /// A drawing that begins at a point.
    pub fn begin(tool: DrawTool, at_px: [f32; 2], paint: Paint) -> Self {
        // A corner that follows the pointer until it is set.
        let points = if tool == DrawTool::Polygon { vec![at_px; 2] } else { vec![at_px] };
        Self { tool, points, paint, sight: None }
    }

    /// Checks that it can touch anything.
    ///
    /// # Errors
    /// In words: too few points, or numbers that are none or of no size.
    pub fn check(&self) -> Result<(), String> {
        let (name, needed) = match self.tool {
            DrawTool::Brush { radius_px } if !(radius_px > 0.0 && radius_px.is_finite()) => {
                return Err(format!("a brush of radius {radius_px} px paints nothing: radius_px is more than 0"));
            }
            DrawTool::Wand { tolerance_m } if !(tolerance_m >= 0.0 && tolerance_m.is_finite()) => {
                return Err(format!("a wand of tolerance {tolerance_m} m takes nothing: tolerance_m is 0 or more"));
            }
            DrawTool::Brush { .. } => ("brush", 1),
            DrawTool::Wand { .. } => ("wand", 1),
            DrawTool::Rectangle => ("rectangle", 2),
            DrawTool::Lasso => ("lasso", 3),
            DrawTool::Polygon => ("polygon", 3),
        };
        let points = self.points.len();
        if points < needed {
            let s = if needed == 1 { "" } else { "s" };
            return Err(format!("a {name} needs at least {needed} point{s} and has {points}"));
        }
        if self.points.iter().flatten().any(|v| !v.is_finite()) {
            return Err(format!("a point of the {name} is no finite number"));
        }
        Ok(())
    }

    /// True where it is made of clicks, and not of one drag.
    pub fn is_by_clicks(&self) -> bool {
        self.tool == DrawTool::Polygon
    }

    /// The pointer moved. Points that are no numbers change nothing.
    pub fn move_to(&mut self, at_px: [f32; 2]) {
        if !at_px.iter().all(|v| v.is_finite()) {
            return;
        }
        match self.tool {
            DrawTool::Brush { .. } | DrawTool::Lasso => self.points.push(at_px),
            DrawTool::Polygon => self.points.last_mut().into_iter().for_each(|last| *last = at_px),
            DrawTool::Rectangle | DrawTool::Wand { .. } => {
                self.points.truncate(1);
                self.points.push(at_px);
            }
        }
    }

    /// A click sets the corner that followed the pointer, and the next one follows.
    pub fn corner(&mut self, at_px: [f32; 2]) {
        if self.is_by_clicks() && at_px.iter().all(|v| v.is_finite()) {
            self.move_to(at_px);
            self.points.push(at_px);
        }
    }

    /// Takes the last corner back; false where it was the first one, with which it began.
    pub fn take_corner_back(&mut self) -> bool {
        let (corners, by_clicks) = (self.points.len().saturating_sub(1), self.is_by_clicks());
        let more = by_clicks && corners > 1;
        if more {
            self.points.remove(corners - 1);
        }
        more
    }

    /// Closes what is made of clicks: the corner that follows the pointer is none. False, and nothing changed, where fewer
    /// than three corners were set.
    pub fn close(&mut self) -> bool {
        let closes = self.is_by_clicks() && self.points.len() > 3;
        if closes {
            self.points.pop();
        }
        closes
    }

    /// The wand's tolerance as it was dragged, meters.
    pub fn tolerance_m(&self) -> Option<f32> {
        let DrawTool::Wand { tolerance_m } = self.tool else { return None };
        let [first, last] = [self.points.first()?, self.points.last()?];
        Some(tolerance_m * ((last[0] - first[0]) / DOUBLES_PX).clamp(-6.0, 6.0).exp2())
    }

    /// Marks the pixels that it touches in `touched`; returns the rectangle that holds those not marked before, `None`
    /// where there are none. Of a brush only what comes after the first `from` points: 0 draws all of it.
    pub fn touch(&self, touched: &mut Mask, ground: Ground<'_>, from: usize) -> Option<Rect> {
        let finite = |p: &&[f32; 2]| p.iter().all(|v| v.is_finite());
        let points: Vec<DVec2> =
            self.points.iter().filter(finite).map(|p| DVec2::new(p[0].into(), p[1].into())).collect();
        let ways = || {
            let ways = points.windows(2).skip(from.saturating_sub(1)).map(|w| [w[0], w[1]]);
            points.first().filter(|_| from == 0).map(|&p| [p, p]).into_iter().chain(ways)
        };
        let mut changed: Option<Rect> = None;
        let mut mark = |touched: &mut Mask, x: usize, y: usize| {
            if touched.get(x, y) == Some(&false) {
                touched[(x, y)] = true;
                let pixel = Rect { x, y, width: 1, height: 1 };
                changed = Some(changed.map_or(pixel, |r| r.union(pixel)));
            }
        };
        let (first, last) = (*points.first()?, *points.last()?);
        let region = match (self.tool, self.sight.is_some()) {
            (DrawTool::Brush { radius_px }, false) => {
                let union = |a: Option<Rect>, b: Option<Rect>| a.zip(b).map(|(a, b)| a.union(b)).or(a).or(b);
                let stamp = |way| paint(touched, way, radius_px.into(), true);
                return ways().map(stamp).fold(None, union);
            }
            (DrawTool::Rectangle, false) => region::rectangle(touched.size(), first, last),
            (tool @ (DrawTool::Lasso | DrawTool::Polygon), false) => {
                region::enclosed(touched.size(), &tool.outline(&points))
            }
            (DrawTool::Wand { .. }, in_space) => {
                let seed = if in_space { DVec2::from(ground.seen?.nearest(first)?.map(f64::from)) } else { first };
                region::about_as_deep(ground.imprint, seed, self.tolerance_m()?.into())
            }
            (tool, true) => {
                let seen = ground.seen?;
                let reached: Vec<[u16; 2]> = match tool {
                    DrawTool::Brush { radius_px } => {
                        ways().flat_map(|way| seen.along(way, radius_px.into()).collect::<Vec<_>>()).collect()
                    }
                    DrawTool::Rectangle => seen.within(&points, true),
                    _ => seen.within(&tool.outline(&points), false),
                };
                reached.into_iter().for_each(|[x, y]| mark(touched, x.into(), y.into()));
                return changed;
            }
        };
        for y in 0..touched.height() {
            for x in 0..touched.width() {
                if region.get(x, y) == Some(&true) {
                    mark(touched, x, y);
                }
            }
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::super::marks::Marks;
    use super::super::provenance::Provenance;
    use super::super::sight::Layers;
    use super::*;
    use crate::fixture::{count, from_above, sheet};

    fn imprint() -> DepthMap {
        // Two plateaus joined by a ramp, and a far one of the first's depth.
        DepthMap::from_fn(40, 20, |x, _| match x {
            0..10 => 0.005,
            10..20 => 0.005 + 0.0001 * (x as f32 - 9.0),
            20..30 => 0.012,
            _ => 0.005,
        })
    }

    fn drawn(tool: DrawTool, points: &[[f32; 2]], add: bool, mask: &mut Mask) -> Option<Rect> {
        let (imprint, before) = (imprint(), mask.clone());
        let paint = if add { Paint::Contact } else { Paint::Free };
        let mut marks = Marks::all(mask.size(), Provenance::Nothing);
        let mut touched = Mask::filled(mask.width(), mask.height(), false);
        let drawing = Drawing { tool, points: points.to_vec(), paint, sight: None };
        let rect = drawing.touch(&mut touched, Ground::new(&imprint), 0)?;
        marks.paint(mask, (&touched, rect), paint, None, Provenance::hand(""));
        let hand = marks.manual_checked();
        let kept = |i: usize| hand.as_slice()[i] || mask.as_slice()[i] == before.as_slice()[i];
        assert!((0..mask.len()).all(kept), "what was not painted stays");
        Some(rect)
    }

    #[test]
    fn a_brush_drawn_piece_by_piece_is_the_brush_drawn_at_once() {
        let imprint = imprint();
        let ground = Ground::new(&imprint);
        let mut drawing = Drawing::begin(DrawTool::Brush { radius_px: 2.5 }, [3.0, 3.0], Paint::Contact);
        let mut pieces = Mask::filled(40, 20, false);
        drawing.touch(&mut pieces, ground, 0);
        for to in [[9.0, 12.0], [f32::NAN, 0.0], [30.0, 2.0], [38.0, 19.0]] {
            let before = drawing.points.len();
            drawing.move_to(to);
            drawing.touch(&mut pieces, ground, before);
        }
        let mut once = Mask::filled(40, 20, false);
        drawing.touch(&mut once, ground, 0);
        assert!(once == pieces);
        assert!(count(&once) > 100);
    }

    #[test]
    fn regions_add_and_remove() {
        let mut mask = Mask::filled(40, 20, false);
        let rect = drawn(DrawTool::Rectangle, &[[12.2, 15.0], [4.9, 5.0]], true, &mut mask).unwrap();
        assert_eq!(rect, Rect { x: 5, y: 5, width: 8, height: 11 });
        assert_eq!(count(&mask), 8 * 11);
        let triangle = [[5.0, 5.0], [12.0, 5.0], [5.0, 15.0]];
        drawn(DrawTool::Lasso, &triangle, false, &mut mask);
        assert!(!mask[(6, 6)] && mask[(12, 15)]);
        let before = count(&mask);
        drawn(DrawTool::Polygon, &triangle, true, &mut mask);
        assert!(count(&mask) > before);
        assert_eq!(drawn(DrawTool::Lasso, &[[1.0, 1.0]], true, &mut mask), None, "nothing is enclosed");
        assert_eq!(drawn(DrawTool::Rectangle, &[[f32::NAN, 1.0]], true, &mut mask), None);
        let all = drawn(DrawTool::Rectangle, &[[-9e9, -9e9], [9e9, 9e9]], false, &mut mask);
        assert_eq!((all.map(|r| r.width), count(&mask)), (Some(40), 0));
    }

    #[test]
    fn a_drawing_that_can_touch_nothing_says_why() {
        let brush = |radius_px| DrawTool::Brush { radius_px };
        for (tool, points, said) in [
            (brush(-1.0), vec![[1.0, 1.0]], "radius -1 px"),
            (brush(f32::NAN), vec![[1.0, 1.0]], "radius NaN"),
            (brush(2.0), vec![], "at least 1 point and has 0"),
            (DrawTool::Polygon, vec![], "at least 3 points and has 0"),
            (DrawTool::Lasso, vec![[1.0, 1.0]; 2], "at least 3 points"),
            (DrawTool::Rectangle, vec![[1.0, 1.0]], "at least 2 points"),
            (DrawTool::Rectangle, vec![[1.0, f32::INFINITY]; 2], "no finite number"),
            (DrawTool::Wand { tolerance_m: -1e-3 }, vec![[1.0, 1.0]], "tolerance -0.001 m"),
        ] {
            let why = Drawing { tool, points, paint: Paint::Contact, sight: None }.check().unwrap_err();
            assert!(why.contains(said), "{why}");
        }
        let one = Drawing::begin(DrawTool::Wand { tolerance_m: 0.0 }, [1.0, 1.0], Paint::Contact);
        assert_eq!(one.check(), Ok(()));
    }

    #[test]
    fn the_wand_stays_where_it_is_connected_and_widens_by_dragging() {
        let wand = DrawTool::Wand { tolerance_m: 0.0003 };
        let mut mask = Mask::filled(40, 20, false);
        drawn(wand, &[[4.0, 4.0]], true, &mut mask);
        assert_eq!(count(&mask), (10 + 3) * 20, "the plateau and .3 mm of the ramp, not what is as deep elsewhere");
        let mut wider = Mask::filled(40, 20, false);
        drawn(wand, &[[4.0, 4.0], [4.0 + DOUBLES_PX, 9.0]], true, &mut wider);
        assert_eq!(count(&wider), (10 + 6) * 20, "twice the tolerance");
        assert_eq!(drawn(wand, &[[-5.0, 4.0]], true, &mut mask), None, "outside");
    }

    #[test]
    fn corners_follow_the_pointer_until_they_are_set_and_drawings_are_stored() {
        let mut drawing = Drawing::begin(DrawTool::Polygon, [2.0, 2.0], Paint::Ignore);
        drawing.move_to([9.0, 2.0]);
        drawing.corner([10.0, 2.0]);
        drawing.move_to([10.0, 8.0]);
        drawing.corner([f32::NAN, 0.0]);
        assert_eq!(drawing.points, [[2.0, 2.0], [10.0, 2.0], [10.0, 8.0]]);
        let text = serde_json::to_string(&drawing).unwrap();
        assert_eq!(serde_json::from_str::<Drawing>(&text).unwrap(), drawing, "{text}");
        assert!(!text.contains("sight"), "as it was stored before there was one: {text}");
        let tool = DrawTool::Brush { radius_px: 3.3 };
        let in_space = Drawing { tool, sight: Some(Box::new(from_above(4000.0, Layers::All))), ..drawing };
        let text = serde_json::to_string(&in_space).unwrap();
        assert_eq!(serde_json::from_str::<Drawing>(&text).unwrap(), in_space, "{text}");
    }

    #[test]
    fn every_tool_draws_through_a_picture_of_points() {
        let sight = from_above(4000.0, Layers::Front);
        let (points, pixels) = sheet(0.0);
        let seen = VisiblePixels::new(&sight, (&points, &pixels), &[]);
        // A step in the middle: columns from the eleventh on are deeper.
        let imprint = DepthMap::from_fn(21, 21, |x, _| if x < 11 { 0.001 } else { 0.005 });
        // Points are 2 px apart around (199.5, 149.5); rows go down on the mask and up in the picture.
        let (left, right) = ([192.5, 144.5], [206.5, 154.5]);
        let square = vec![left, [right[0], left[1]], right, [left[0], right[1]]];
        for (tool, way, expected) in [
            (DrawTool::Brush { radius_px: 4.1 }, vec![[199.5, 149.5]], 13),
            (DrawTool::Brush { radius_px: 0.1 }, vec![[189.5, 149.5], [209.5, 149.5]], 11),
            (DrawTool::Rectangle, vec![left, right], 7 * 5),
            (DrawTool::Lasso, square.clone(), 7 * 5),
            (DrawTool::Polygon, square, 7 * 5),
            (DrawTool::Wand { tolerance_m: 0.001 }, vec![[190.0, 149.0]], 11 * 21),
        ] {
            let drawing = Drawing { tool, points: way, paint: Paint::Contact, sight: Some(Box::new(sight.clone())) };
            let draw = |seen| {
                let mut touched = Mask::filled(21, 21, false);
                let ground = Ground { seen, ..Ground::new(&imprint) };
                let rect = drawing.touch(&mut touched, ground, 0);
                assert_eq!(rect.is_some(), touched.as_slice().contains(&true), "{tool:?}");
                touched
            };
            let all = draw(Some(&seen));
            assert_eq!(count(&all), expected, "{tool:?}");
            assert_eq!(count(&draw(None)), 0, "{tool:?}: where the pixels lie is not known");
        }
    }
}
