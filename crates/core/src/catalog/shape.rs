//! The shape of a tool: bars and plates of one thickness, symmetric about a middle plane across the closing axis.
//!
//! Across a bar the height follows a [`Section`]: the lab's tools are half-round bars with a thin bead along the crown.
//! Everything else (mesh, signed distance, what the fingers feel) follows from these. Coordinates are those of the object
//! frame, with x measured from the tool's middle plane, which the CAD model has at [`ToolSpec::middle_x_m`].

use glam::{DVec2, DVec3};

use super::bend::{Bend, TOUCH_M};

/// Cross-section of a tool's parts, from the wall to the middle of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Section {
    /// A half-round crown as wide as the bar, with a bead along its crest: a rod sunk in to its middle.
    Crown {
        /// Radius of the bead, meters; 0 for none.
        bead_m: f64,
    },
    /// A flat top with a bevelled rim.
    Bevel {
        /// Width of the bevel, meters.
        width_m: f64,
        /// Drop of the surface from the inner edge of the bevel to the wall, meters.
        depth_m: f64,
    },
}

impl Section {
    /// Height of a part `half_width_m` wide over the middle plane, at `inset_m` from its wall; the part is `top_m` high.
    pub(super) fn height(self, top_m: f64, half_width_m: f64, inset_m: f64) -> f64 {
        match self {
            Self::Crown { bead_m } => {
                let d = half_width_m - inset_m;
                let round = |radius: f64| (radius * radius - d * d).max(0.0).sqrt();
                let crest = top_m - bead_m;
                let body = crest - half_width_m + round(half_width_m);
                if d < bead_m { body.max(crest + round(bead_m)) } else { body }
            }
            Self::Bevel { width_m, depth_m } => top_m - depth_m * (1.0 - inset_m / width_m).max(0.0),
        }
    }

    /// Distance of the point `h` over the middle plane, `inset_m` inside of the wall, to the section, meters, negative inside.
    fn distance(self, top_m: f64, half_width_m: f64, inset_m: f64, h: f64) -> f64 {
        match self {
            Self::Crown { bead_m } => {
                let d = half_width_m - inset_m;
                let axis = top_m - bead_m - half_width_m;
                let body = d.hypot((h - axis).max(0.0)) - half_width_m;
                body.min(self.bead_distance(top_m, d, h))
            }
            Self::Bevel { width_m, depth_m } => {
                let p = DVec2::new(-inset_m, h);
                let crest = DVec2::new(-width_m, top_m);
                let edge = DVec2::new(0.0, top_m - depth_m);
                let distance = to_segment(p, DVec2::new(-1.0, top_m), crest)
                    .min(to_segment(p, crest, edge))
                    .min(to_segment(p, edge, DVec2::ZERO));
                let inside = inset_m >= 0.0 && h <= self.height(top_m, half_width_m, inset_m);
                if inside { -distance } else { distance }
            }
        }
    }

    /// Distance of a point `d` beside the crest's line to the bead, meters.
    fn bead_distance(self, top_m: f64, d: f64, h: f64) -> f64 {
        match self {
            Self::Crown { bead_m } if bead_m > 0.0 => d.hypot(h - (top_m - bead_m)) - bead_m,
            _ => f64::INFINITY,
        }
    }
}

/// Distance of `p` to the segment from `a` to `b`.
fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (ab, ap) = (b - a, p - a);
    let t = (ap.dot(ab) / ab.length_squared().max(1e-18)).clamp(0.0, 1.0);
    (ap - ab * t).length()
}

/// A bar along a path, with flat ends and mitred bends.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    /// Center line, (y, z) in meters: at least two points.
    pub path: Vec<DVec2>,
    /// Distance from the center line to the walls, meters.
    pub half_width_m: f64,
    /// Radius that the outer edge of each bend is rounded with, meters; 0 leaves it sharp.
    pub rounding_m: f64,
}

/// A straight stretch of a bar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch {
    pub(super) from: DVec2,
    pub(super) to: DVec2,
    /// Direction from one to the other.
    pub(super) along: DVec2,
    /// Normals, out of the stretch, of the planes where it meets its neighbors; `None` at a flat end.
    pub(super) mitres: [Option<DVec2>; 2],
}

impl Stretch {
    /// Signed distance of `p` from the center line.
    pub(super) fn across(&self, p: DVec2) -> f64 {
        self.along.perp_dot(p - self.from)
    }

    /// Distance by which `p` lies beyond the nearer neighbor's plane, meters; negative on this stretch's side.
    fn beyond_mitre(&self, p: DVec2) -> f64 {
        let [before, after] = self.mitres;
        let beyond = |normal: Option<DVec2>, at: DVec2| normal.map_or(f64::NEG_INFINITY, |n| n.dot(p - at));
        beyond(before, self.from).max(beyond(after, self.to))
    }

    /// Distance by which `p` lies beyond the nearer flat end, meters; negative before it.
    fn beyond_end(&self, p: DVec2) -> f64 {
        let end = |mitre: Option<DVec2>, beyond: f64| if mitre.is_some() { f64::NEG_INFINITY } else { beyond };
        end(self.mitres[0], -self.along.dot(p - self.from)).max(end(self.mitres[1], self.along.dot(p - self.to)))
    }
}

impl Bar {
    /// A straight bar.
    pub fn straight(from: DVec2, to: DVec2, half_width_m: f64) -> Self {
        Self { path: vec![from, to], half_width_m, rounding_m: 0.0 }
    }

    fn stretches(&self) -> impl Iterator<Item = Stretch> + '_ {
        let direction = |i: usize| (self.path[i + 1] - self.path[i]).normalize_or(DVec2::X);
        let last = self.path.len() - 2;
        (0..=last).map(move |i| Stretch {
            from: self.path[i],
            to: self.path[i + 1],
            along: direction(i),
            mitres: [
                (i > 0).then(|| -(direction(i - 1) + direction(i)).normalize_or(direction(i))),
                (i < last).then(|| (direction(i) + direction(i + 1)).normalize_or(direction(i))),
            ],
        })
    }

    /// The rounded bends; those of a flat bar are sharp.
    fn bends(&self, section: Section) -> impl Iterator<Item = Bend> + '_ {
        let round = self.rounding_m > 0.0 && matches!(section, Section::Crown { .. });
        let rounded = if round { self.path.as_slice() } else { &[] };
        rounded.windows(3).map(|p| Bend::new([p[0], p[1], p[2]], self.half_width_m, self.rounding_m))
    }
}

/// A bar with all that its distances need.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub(super) stretches: Vec<Stretch>,
    pub(super) bends: Vec<Bend>,
    pub(super) half_width_m: f64,
}

impl Part {
    /// Signed distance of `p` from the center line of the stretch it lies beside.
    pub(super) fn beside(&self, p: DVec2) -> f64 {
        let own = self.stretches.iter().filter(|s| s.beyond_mitre(p) <= TOUCH_M).map(|s| s.across(p));
        own.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(f64::INFINITY)
    }

    /// Distances from the center lines of the stretches that `p` lies on.
    fn across(&self, p: DVec2) -> impl Iterator<Item = f64> + '_ {
        let on = move |s: &&Stretch| s.beyond_mitre(p) <= TOUCH_M && s.beyond_end(p) <= TOUCH_M;
        let across = self.stretches.iter().filter(on).map(move |s| s.across(p).abs());
        across.filter(|d| *d <= self.half_width_m + TOUCH_M)
    }

    fn height(&self, p: DVec2, section: Section, top_m: f64) -> Option<f64> {
        let rounds = self.bends.iter().find(|bend| bend.rounds(p));
        let height = |d: f64| {
            let straight = || section.height(top_m, self.half_width_m, self.half_width_m - d);
            let Some(bend) = rounds else { return Some(straight()) };
            let Section::Crown { bead_m } = section else { return None };
            let body = bend.height(p, top_m - bead_m - self.half_width_m);
            body.into_iter().chain((d < bead_m).then(straight)).reduce(f64::max)
        };
        self.across(p).filter_map(height).reduce(f64::max)
    }

    /// Distance to the nearest stretch, by that across each, which the bend around `p` may round.
    fn nearest(&self, p: DVec2, across: impl Fn(&Stretch, Option<&Bend>) -> f64) -> f64 {
        let bend = self.bends.iter().find(|bend| bend.rounds(p));
        let beside = self.stretches.iter().filter(|stretch| stretch.beyond_mitre(p) <= TOUCH_M);
        beside.map(|stretch| both(across(stretch, bend), stretch.beyond_end(p))).fold(f64::INFINITY, f64::min)
    }

    fn outline_distance(&self, p: DVec2) -> f64 {
        self.nearest(p, |stretch, bend| match bend {
            Some(bend) => bend.outline_distance(p),
            None => stretch.across(p).abs() - self.half_width_m,
        })
    }

    fn distance(&self, p: DVec2, h: f64, section: Section, top_m: f64) -> f64 {
        self.nearest(p, |stretch, bend| {
            let d = stretch.across(p).abs();
            match (bend, section) {
                (Some(bend), Section::Crown { bead_m }) => {
                    let body = bend.distance(p, h, top_m - bead_m - self.half_width_m);
                    body.min(section.bead_distance(top_m, d, h))
                }
                _ => section.distance(top_m, self.half_width_m, self.half_width_m - d, h),
            }
        })
    }
}

/// Distance to the edge where two faces meet squarely, from the distances to both; negative inside.
fn both(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 { a.hypot(b) } else { a.max(b) }
}

/// Distance of `p` to the outline of a convex polygon, counter-clockwise, meters, negative inside.
fn to_polygon(corners: &[DVec2], p: DVec2) -> f64 {
    let (mut nearest, mut inside) = (f64::INFINITY, true);
    for (i, a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        nearest = nearest.min(to_segment(p, *a, b));
        inside &= (b - *a).perp_dot(p - *a) >= 0.0;
    }
    if inside { -nearest } else { nearest }
}

/// A tool that both sensors touch: the solid union of its parts.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSpec {
    /// The lab's name of the tool, or `random_...`.
    pub name: String,
    /// True where the lab trains on it; unseen tools are for testing.
    pub seen: bool,
    /// The bars.
    pub bars: Vec<Bar>,
    /// The plates: convex outlines, counter-clockwise, (y, z) in meters.
    pub plates: Vec<Vec<DVec2>>,
    /// Section of all parts.
    pub section: Section,
    /// Half the extent along the closing axis x, meters.
    pub half_thickness_m: f64,
    /// Place of the middle plane along x in the object frame of the CAD model, meters.
    pub middle_x_m: f64,
}

impl ToolSpec {
    /// The solid, ready to be asked for distances many times.
    pub fn solid(&self) -> Solid {
        let part = |bar: &Bar| Part {
            stretches: bar.stretches().collect(),
            bends: bar.bends(self.section).collect(),
            half_width_m: bar.half_width_m,
        };
        Solid {
            parts: self.bars.iter().map(part).collect(),
            plates: self.plates.clone(),
            section: self.section,
            half_thickness_m: self.half_thickness_m,
        }
    }

    /// All points of paths and outlines.
    pub(crate) fn points_mut(&mut self) -> impl Iterator<Item = &mut DVec2> {
        self.bars.iter_mut().flat_map(|bar| &mut bar.path).chain(self.plates.iter_mut().flatten())
    }

    /// Smallest and largest (y, z) of the outline, meters, or a little more.
    pub(super) fn outline_bounds(&self) -> [DVec2; 2] {
        let bars = self.bars.iter().flat_map(|bar| bar.path.iter().map(|p| (*p, 1.5 * bar.half_width_m)));
        let plates = self.plates.iter().flatten().map(|p| (*p, 0.0));
        bars.chain(plates)
            .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[lo, hi], (p, w)| [lo.min(p - w), hi.max(p + w)])
    }
}

/// The solid of a tool: heights and distances. Points are in the object frame, with x from the middle plane.
#[derive(Clone, Debug)]
pub struct Solid {
    pub(super) parts: Vec<Part>,
    pub(super) plates: Vec<Vec<DVec2>>,
    section: Section,
    half_thickness_m: f64,
}

impl Solid {
    /// Distance of `(y, z)` to the outline, meters, negative inside.
    pub fn outline_distance(&self, p: DVec2) -> f64 {
        let bars = self.parts.iter().map(|bar| bar.outline_distance(p));
        bars.chain(self.plates.iter().map(|plate| to_polygon(plate, p))).fold(f64::INFINITY, f64::min)
    }

    /// Distance of the surface from the middle plane at `(y, z)`, meters; `None` beside the tool.
    pub fn height(&self, p: DVec2) -> Option<f64> {
        let bars = self.parts.iter().filter_map(|bar| bar.height(p, self.section, self.half_thickness_m));
        let plates = self.plates.iter().filter_map(|plate| {
            let inset = -to_polygon(plate, p);
            (inset >= -TOUCH_M).then(|| self.plate_section().height(self.half_thickness_m, 0.0, inset))
        });
        bars.chain(plates).reduce(f64::max)
    }

    /// Distance of `(y, z)` from the wall of the part that reaches farthest around it, meters; 0 beside the tool.
    pub(super) fn inset(&self, p: DVec2) -> f64 {
        let bars = self.parts.iter().flat_map(|bar| bar.across(p).map(|d| bar.half_width_m - d));
        bars.chain(self.plates.iter().map(|plate| -to_polygon(plate, p))).fold(0.0, f64::max)
    }

    /// Signed distance of a point to the surface, meters, negative inside.
    ///
    /// Exact outside except near re-entrant corners, where it is never more than the true distance.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        let (yz, h, top) = (DVec2::new(p.y, p.z), p.x.abs(), self.half_thickness_m);
        let bars = self.parts.iter().map(|bar| bar.distance(yz, h, self.section, top));
        let plates = self.plates.iter().map(|plate| self.plate_section().distance(top, 0.0, -to_polygon(plate, yz), h));
        bars.chain(plates).fold(f64::INFINITY, f64::min)
    }

    /// Section of the plates: a plate beside crowned bars has a rim that is all but sharp.
    fn plate_section(&self) -> Section {
        match self.section {
            Section::Crown { .. } => Section::Bevel { width_m: 5e-4, depth_m: 5e-4 },
            bevel @ Section::Bevel { .. } => bevel,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_and_signed_distance_agree() {
        for tool in [&super::super::tools()[4], &super::super::tools()[6], &super::super::tools()[10]] {
            let (tool, name) = (tool.solid(), &tool.name);
            for i in 0..400 {
                let p = DVec2::new(f64::from(i % 20) - 9.7, f64::from(i / 20) - 6.1) * 1.01e-3;
                match tool.height(p) {
                    Some(h) => {
                        let at = |h: f64| tool.signed_distance(DVec3::new(h, p.x, p.y));
                        assert!(at(h).abs() < 1e-8, "{name}: {p} {}", at(h));
                        assert!(at(-h - 1e-4) > 0.0 && at(h - 1e-4) < 0.0, "{name}: {p}");
                        assert!(tool.outline_distance(p) <= 1e-9);
                    }
                    None => assert!(tool.signed_distance(DVec3::new(0.0, p.x, p.y)) > 0.0, "{name}: {p}"),
                }
            }
        }
    }
}
