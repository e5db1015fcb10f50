//! [`Hole`]: the hole that a tool's own outline would be let down into, with a clearance to each side.
//!
//! It is cut from plates of a millimeter: each is open where a part of the upright tool has to pass it on its way to the
//! bottom, and the clearance to either side, so that a bar gets a slot, a fork two, and a cone a well that narrows. The
//! floor lies the clearance below the tool, too.

use glam::DVec2;
use serde::Serialize;

use super::intervals::Intervals;
use super::{Outline, TrialError, length};

/// Thickness of a plate, meters.
const PLATE_M: f64 = 1e-3;

/// Sizes of a hole.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HoleShape {
    /// Way of the tool's lowest point below the mouth, meters.
    pub depth_m: f64,
    /// Room to each side of the upright tool, meters.
    pub clearance_m: f64,
    /// Height of the mouth's bevel of 45°, meters.
    pub chamfer_m: f64,
}

/// A hole of a tool's outline.
#[derive(Clone, Debug, PartialEq)]
pub struct Hole {
    shape: HoleShape,
    plates: Vec<Plate>,
    /// Middle of the part of the upright tool that goes in, along y, and its lowest point, meters, object frame.
    middle_m: f64,
    tip_m: f64,
}

/// A plate: the depth of its top and its openings along y, meters, world frame.
#[derive(Clone, Debug, PartialEq)]
struct Plate {
    top_m: f64,
    cut: Intervals,
}

/// A segment of the tool, ends as (y, depth below the mouth), meters, world frame.
pub(super) type Segment = [DVec2; 2];

/// Distances by which a tool may be moved before it is looked at again: nothing that would fit after such a motion may be
/// refused.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slack {
    pub(super) across_m: f64,
    pub(super) down_m: f64,
}

/// The part of a segment between two depths; `None` if it has none.
fn clipped([a, b]: Segment, from_m: f64, to_m: f64) -> Option<Segment> {
    let (upper, lower) = if a.y <= b.y { (a, b) } else { (b, a) };
    if lower.y < from_m || upper.y > to_m {
        return None;
    }
    let at = |depth: f64| upper + (lower - upper) * ((depth - upper.y) / (lower.y - upper.y));
    Some([if upper.y < from_m { at(from_m) } else { upper }, if lower.y > to_m { at(to_m) } else { lower }])
}

fn span([a, b]: Segment) -> [f64; 2] {
    [a.x.min(b.x), a.x.max(b.x)]
}

/// Extent along y of what lies deeper than `from_m`.
fn shadow(body: &[Segment], from_m: f64) -> Intervals {
    Intervals::union(body.iter().filter_map(|s| clipped(*s, from_m, f64::INFINITY).map(span)).collect())
}

impl Hole {
    /// The hole of an outline.
    ///
    /// # Errors
    /// [`TrialError`] for lengths that are none, and a depth of zero or beyond the tool.
    pub fn new(outline: &Outline, shape: HoleShape) -> Result<Self, TrialError> {
        let depth_m = length("the depth of the hole", shape.depth_m)?;
        length("the clearance", shape.clearance_m)?;
        length("the chamfer", shape.chamfer_m)?;
        if depth_m == 0.0 {
            return Err(TrialError::Number { what: "the depth of the hole", value: depth_m });
        }
        let [lo, hi] = outline.bounds();
        if depth_m > hi.y - lo.y {
            return Err(TrialError::TooDeep { length_m: hi.y - lo.y, depth_m });
        }
        let upright: Vec<Segment> =
            outline.segments().iter().map(|s| s.map(|p| DVec2::new(p.x, p.y - hi.y + depth_m))).collect();
        let ends = shadow(&upright, 0.0).ends();
        let [left, right] = ends.ok_or(TrialError::Outline { why: "nothing of it would go into the hole" })?;
        let middle_m = 0.5 * (left + right);
        let plates = (0..(depth_m / PLATE_M).ceil() as usize).map(|number| {
            let top_m = number as f64 * PLATE_M;
            let passes = shadow(&upright, (top_m - shape.clearance_m).max(0.0));
            Plate { top_m, cut: passes.moved(-middle_m).grown(shape.clearance_m) }
        });
        Ok(Self { shape, plates: plates.collect(), middle_m, tip_m: hi.y })
    }

    /// Sizes of the hole.
    pub fn shape(&self) -> HoleShape {
        self.shape
    }

    /// Place of the upright tool over the middle of the mouth, its lowest point at the bottom: y and z of
    /// `world_from_object`, meters.
    pub fn goal(&self) -> DVec2 {
        DVec2::new(-self.middle_m, self.shape.depth_m - self.tip_m)
    }

    /// Lowest point of the upright tool in its own frame as (y, z), meters; y is the middle of what goes in.
    pub fn tip(&self) -> DVec2 {
        DVec2::new(self.middle_m, self.tip_m)
    }

    /// The plates from the mouth down: depth of the top, and the openings along y, meters, world frame.
    pub fn plates(&self) -> impl Iterator<Item = (f64, &[[f64; 2]])> {
        self.plates.iter().map(|plate| (plate.top_m, plate.cut.parts()))
    }

    /// Shifts along y within `limit_m` of zero at which the tool is free of the plates, and was on its whole way down.
    pub(super) fn shifts(&self, body: &[Segment], limit_m: f64, slack: Slack) -> Intervals {
        let mut free = Intervals::one(-limit_m, limit_m);
        for plate in &self.plates {
            let deep = shadow(body, plate.top_m.max(self.shape.chamfer_m) + slack.down_m);
            let cut = plate.cut.grown(slack.across_m);
            for part in deep.parts() {
                free = free.both(&cut.shifts_of(*part));
            }
            if free.is_empty() {
                return free;
            }
        }
        let bevel = |segment: &Segment| clipped(*segment, slack.down_m, self.shape.chamfer_m);
        for part in body.iter().filter_map(bevel).filter(|_| self.shape.chamfer_m > 0.0) {
            free = free.both(&self.shifts_at_the_mouth(part, slack));
        }
        free
    }

    /// Shifts of a segment that lies within the bevel, whose walls fall away towards the mouth.
    fn shifts_at_the_mouth(&self, segment: Segment, slack: Slack) -> Intervals {
        let cuts = self.plates.first().map(|plate| plate.cut.parts()).unwrap_or_default();
        let shifts = cuts.iter().flat_map(|[low, high]| {
            let room = |p: DVec2| {
                let back = self.shape.chamfer_m - p.y + slack.down_m + slack.across_m;
                Intervals::one(low - back - p.x, high + back - p.x)
            };
            room(segment[0]).both(&room(segment[1])).parts().to_vec()
        });
        Intervals::union(shifts.collect())
    }

    /// The place of the largest overlap with a plate, as (y, depth), and its size, meters; `None` where there is none.
    ///
    /// Within the bevel the place is that at its foot.
    pub(super) fn overlap(&self, body: &[Segment]) -> Option<(DVec2, f64)> {
        let mut worst: Option<(DVec2, f64)> = None;
        for plate in &self.plates {
            let top = plate.top_m.max(self.shape.chamfer_m);
            for part in body.iter().filter_map(|s| clipped(*s, top, f64::INFINITY)) {
                let Some((y, amount)) = plate.cut.leaves(span(part)) else { continue };
                if worst.is_none_or(|(_, most)| amount > most) {
                    let end = if part[0].x == y { part[0] } else { part[1] };
                    worst = Some((end, amount));
                }
            }
        }
        worst
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(y: f64, z: f64) -> DVec2 {
        DVec2::new(y, z) * 1e-3
    }

    fn shape(depth: f64, clearance: f64) -> HoleShape {
        HoleShape { depth_m: depth * 1e-3, clearance_m: clearance * 1e-3, chamfer_m: 0.0 }
    }

    #[test]
    fn a_fork_gets_two_slots_and_a_cone_a_well_that_narrows() {
        // Two prongs of 2 mm, 6 mm apart, under a bridge.
        let fork =
            [(-5.0, 0.0), (5.0, 0.0), (5.0, 20.0), (3.0, 20.0), (3.0, 4.0), (-3.0, 4.0), (-3.0, 17.5), (-5.0, 17.5)];
        let fork = Outline::polygon(&fork.map(|(y, z)| corner(y, z))).unwrap();
        let hole = Hole::new(&fork, shape(10.0, 1.0)).unwrap();
        assert_eq!(hole.plates.len(), 10);
        let of = |number: usize| {
            hole.plates[number].cut.parts().iter().map(|c| c.map(|v| (v * 1e3).round())).collect::<Vec<_>>()
        };
        assert_eq!(of(0), [[-6.0, -2.0], [2.0, 6.0]]);
        // The shorter prong ends 2.5 mm above the other, and the floor lies the clearance below it.
        assert_eq!((of(8).len(), of(9)), (2, vec![[2.0, 6.0]]));
        assert_eq!(hole.goal(), corner(0.0, -10.0));
        let cone = Outline::polygon(&[corner(-4.0, 0.0), corner(4.0, 0.0), corner(0.0, 8.0)]).unwrap();
        let well = Hole::new(&cone, shape(8.0, 0.0)).unwrap();
        let widths: Vec<f64> = well.plates().map(|(_, cut)| (cut[0][1] - cut[0][0]) * 1e3).collect();
        assert!(widths.iter().enumerate().all(|(k, w)| (w - (8.0 - k as f64)).abs() < 1e-6), "{widths:?}");
    }

    #[test]
    fn what_is_no_hole_is_refused_in_words() {
        let bar =
            Outline::polygon(&[(-2.0, 0.0), (2.0, 0.0), (2.0, 30.0), (-2.0, 30.0)].map(|(y, z)| corner(y, z))).unwrap();
        let why = |shape: HoleShape| Hole::new(&bar, shape).unwrap_err().to_string();
        assert!(why(shape(31.0, 1.0)).contains("30.00 mm long and cannot go 31.00 mm deep"));
        for bad in [shape(0.0, 1.0), shape(f64::NAN, 1.0), shape(10.0, -1.0), shape(10.0, f64::INFINITY)] {
            assert!(why(bad).contains("no length"), "{bad:?}");
        }
    }

    #[test]
    fn the_part_of_a_segment_between_two_depths() {
        let segment = [corner(0.0, 10.0), corner(4.0, 2.0)];
        assert_eq!(clipped(segment, 0.0, 1e-3), None);
        let part = clipped(segment, 4e-3, 8e-3).unwrap();
        assert!((part[0] - corner(3.0, 4.0)).length() < 1e-15 && (part[1] - corner(1.0, 8.0)).length() < 1e-15);
        assert_eq!(span(part).map(|v| (v * 1e6).round()), [1000.0, 3000.0]);
        let level = [corner(0.0, 3.0), corner(4.0, 3.0)];
        assert_eq!(clipped(level, 3e-3, 1.0), Some(level));
    }
}
