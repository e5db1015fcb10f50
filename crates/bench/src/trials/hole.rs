//! [`Hole`]: the hole that a tool's own outline would be let down into, with a clearance to each side.
//!
//! It is cut from plates of a millimeter: each is open where a part of the upright tool has to pass it on its way to the
//! bottom, and the room to either side, so that a bar gets a slot, a fork two, and a cone a well that narrows. The
//! floor lies the room below the tool, too.

use anyhow::Context as _;
use glam::DVec2;
use touch2touch_core::frames::PlanarPose;

use super::Outline;
use super::intervals::Intervals;

/// Way of the tool's lowest point below the mouth, meters.
pub(super) const DEPTH_M: f64 = 0.01;
/// Thickness of a plate, meters.
const PLATE_M: f64 = 1e-3;

/// A hole of a tool's outline.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hole {
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

/// The part of a segment that lies deeper than `from_m`; `None` if it has none.
fn below([a, b]: Segment, from_m: f64) -> Option<Segment> {
    let (upper, lower) = if a.y <= b.y { (a, b) } else { (b, a) };
    if lower.y < from_m {
        return None;
    }
    let at = |depth: f64| upper + (lower - upper) * ((depth - upper.y) / (lower.y - upper.y));
    Some([if upper.y < from_m { at(from_m) } else { upper }, lower])
}

fn span([a, b]: Segment) -> [f64; 2] {
    [a.x.min(b.x), a.x.max(b.x)]
}

/// Extent along y of what lies deeper than `from_m`.
fn shadow(body: &[Segment], from_m: f64) -> Intervals {
    Intervals::union(body.iter().filter_map(|s| below(*s, from_m).map(span)).collect())
}

impl Hole {
    /// The hole of an outline, with this room to each side of the upright tool, meters.
    ///
    /// # Errors
    /// If the tool is shorter than the hole is deep.
    pub(super) fn new(outline: &Outline, room_m: f64) -> anyhow::Result<Self> {
        let [lo, hi] = outline.bounds();
        anyhow::ensure!(hi.y - lo.y >= DEPTH_M, "the tool is too short for its hole");
        let upright: Vec<Segment> =
            outline.segments().iter().map(|s| s.map(|p| DVec2::new(p.x, p.y - hi.y + DEPTH_M))).collect();
        let [left, right] = shadow(&upright, 0.0).ends().context("nothing of the tool would go into the hole")?;
        let middle_m = 0.5 * (left + right);
        let plates = (0..(DEPTH_M / PLATE_M).ceil() as usize).map(|number| {
            let top_m = number as f64 * PLATE_M;
            let passes = shadow(&upright, (top_m - room_m).max(0.0));
            Plate { top_m, cut: passes.moved(-middle_m).grown(room_m) }
        });
        Ok(Self { plates: plates.collect(), middle_m, tip_m: hi.y })
    }

    /// Pose of the upright tool over the middle of the mouth, its lowest point at the bottom, `world_from_object`.
    pub(super) fn goal(&self) -> PlanarPose {
        PlanarPose { theta_rad: 0.0, y_m: -self.middle_m, z_m: DEPTH_M - self.tip_m }
    }

    /// Shifts along y within `limit_m` of zero at which the tool is free of the plates, and was on its whole way down.
    pub(super) fn shifts(&self, body: &[Segment], limit_m: f64, slack: Slack) -> Intervals {
        let mut free = Intervals::one(-limit_m, limit_m);
        for plate in &self.plates {
            let deep = shadow(body, plate.top_m + slack.down_m);
            let cut = plate.cut.grown(slack.across_m);
            for part in deep.parts() {
                free = free.both(&cut.shifts_of(*part));
            }
            if free.is_empty() {
                return free;
            }
        }
        free
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(y: f64, z: f64) -> DVec2 {
        DVec2::new(y, z) * 1e-3
    }

    #[test]
    fn a_fork_gets_two_slots_and_a_cone_a_well_that_narrows() {
        // Two prongs of 2 mm, 6 mm apart, under a bridge.
        let fork =
            [(-5.0, 0.0), (5.0, 0.0), (5.0, 20.0), (3.0, 20.0), (3.0, 4.0), (-3.0, 4.0), (-3.0, 17.5), (-5.0, 17.5)];
        let fork = Outline::polygon(&fork.map(|(y, z)| corner(y, z))).unwrap();
        let hole = Hole::new(&fork, 1e-3).unwrap();
        assert_eq!(hole.plates.len(), 10);
        let of = |number: usize| {
            hole.plates[number].cut.parts().iter().map(|c| c.map(|v| (v * 1e3).round())).collect::<Vec<_>>()
        };
        assert_eq!(of(0), [[-6.0, -2.0], [2.0, 6.0]]);
        // The shorter prong ends 2.5 mm above the other, and the floor lies the room below it.
        assert_eq!((of(8).len(), of(9)), (2, vec![[2.0, 6.0]]));
        assert_eq!((hole.goal().y_m, hole.goal().z_m), (0.0, -0.01));
        let cone = Outline::polygon(&[corner(-5.0, 0.0), corner(5.0, 0.0), corner(0.0, 10.0)]).unwrap();
        let well = Hole::new(&cone, 0.0).unwrap();
        let widths: Vec<f64> = well.plates.iter().map(|p| (p.cut.parts()[0][1] - p.cut.parts()[0][0]) * 1e3).collect();
        assert!(widths.iter().enumerate().all(|(k, w)| (w - (10.0 - k as f64)).abs() < 1e-6), "{widths:?}");
        let short = Outline::polygon(&[corner(-4.0, 0.0), corner(4.0, 0.0), corner(0.0, 8.0)]).unwrap();
        assert!(Hole::new(&short, 0.0).unwrap_err().to_string().contains("too short"));
    }

    #[test]
    fn the_part_of_a_segment_below_a_depth() {
        let segment = [corner(0.0, 10.0), corner(4.0, 2.0)];
        assert_eq!(below(segment, 11e-3), None);
        let part = below(segment, 4e-3).unwrap();
        assert!((part[0] - corner(3.0, 4.0)).length() < 1e-15 && (part[1] - corner(0.0, 10.0)).length() < 1e-15);
        assert_eq!(span(part).map(|v| (v * 1e6).round()), [0.0, 3000.0]);
        let level = [corner(0.0, 3.0), corner(4.0, 3.0)];
        assert_eq!(below(level, 3e-3), Some(level));
    }
}
