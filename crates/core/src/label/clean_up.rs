//! [`CleanUp`]: what can be done to a whole mask, as a value with its size in millimeters.

use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::{EnumIter, EnumString, IntoEnumIterator as _, IntoStaticStr};

use super::morphology::{fill_holes, grow, largest_island, shrink};
use crate::grid::Mask;

/// A kind of clean-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[derive(Serialize, Deserialize, EnumIter, EnumString, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CleanKind {
    /// Sets what is enclosed.
    FillHoles,
    /// Keeps the largest island.
    LargestIsland,
    /// Each pixel as most of those within this radius.
    Smooth,
    /// Adds what is within this distance.
    Grow,
    /// Removes what is within this distance of the outside.
    Shrink,
}

impl CleanKind {
    /// The name in files and on the command line.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::FillHoles => "Fill holes",
            Self::LargestIsland => "Largest island",
            Self::Smooth => "Smooth",
            Self::Grow => "Grow",
            Self::Shrink => "Shrink",
        }
    }

    /// True where the kind has a size.
    pub fn is_sized(self) -> bool {
        !matches!(self, Self::FillHoles | Self::LargestIsland)
    }
}

/// A clean-up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CleanUp {
    /// Kind of clean-up.
    pub kind: CleanKind,
    /// Radius or distance, millimeters; without meaning where the kind has none.
    pub size_mm: f64,
}

impl From<CleanKind> for CleanUp {
    /// With a size of one millimeter.
    fn from(kind: CleanKind) -> Self {
        Self { kind, size_mm: 1.0 }
    }
}

impl FromStr for CleanUp {
    type Err = String;

    /// `fill_holes`, or with a size in millimeters `grow=1.5`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, size) = text.split_once('=').map_or((text, None), |(kind, size)| (kind, Some(size)));
        let kinds = || CleanKind::iter().map(CleanKind::key).collect::<Vec<_>>().join(", ");
        let kind: CleanKind =
            kind.parse().map_err(|_| format!("unknown clean-up \"{kind}\"; choose from {}", kinds()))?;
        let size_mm = match (kind.is_sized(), size) {
            (false, None) => 0.0,
            (false, Some(_)) => return Err(format!("{} has no size", kind.key())),
            (true, None) => return Err(format!("{} takes a size in millimeters, such as {0}=1.5", kind.key())),
            (true, Some(size)) => match size.parse() {
                Ok(mm) if (0.0..=1e3).contains(&mm) => mm,
                _ => return Err(format!("\"{size}\" is not a size in millimeters (0 to 1000)")),
            },
        };
        Ok(Self { kind, size_mm })
    }
}

impl CleanUp {
    /// The mask cleaned. A size that is no number, or smaller than a pixel, changes nothing.
    #[must_use]
    pub fn apply(self, mask: &Mask, px_per_mm: f64) -> Mask {
        let px = (self.size_mm * px_per_mm).max(0.0);
        match self.kind {
            CleanKind::FillHoles => fill_holes(mask),
            CleanKind::LargestIsland => largest_island(mask),
            CleanKind::Smooth => smooth(mask, px),
            CleanKind::Grow => grow(mask, px),
            CleanKind::Shrink => shrink(mask, px),
        }
    }
}

/// Each pixel as most of those within `radius_px`, those outside the image not counted; it stays as it is at a tie.
fn smooth(mask: &Mask, radius_px: f64) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    // Beyond the diagonal everything is reached.
    let radius = radius_px.max(0.0).min((width + height) as f64);
    let reach = radius.floor() as usize;
    // Running sums along rows: a disc is then one subtraction per row.
    let sums: Vec<u32> = (0..height)
        .flat_map(|y| {
            let row = mask.row(y).iter().scan(0u32, |sum, &on| {
                *sum += u32::from(on);
                Some(*sum)
            });
            std::iter::once(0).chain(row).collect::<Vec<_>>()
        })
        .collect();
    let half: Vec<usize> =
        (0..=reach).map(|dy| (radius * radius - (dy * dy) as f64).max(0.0).sqrt() as usize).collect();
    Mask::from_fn(width, height, |x, y| {
        let (mut on, mut all) = (0, 0);
        for ny in y.saturating_sub(reach)..=(y + reach).min(height - 1) {
            let half = half[ny.abs_diff(y)];
            let (left, right) = (x.saturating_sub(half), (x + half).min(width - 1));
            let row = ny * (width + 1);
            on += sums[row + right + 1] - sums[row + left];
            all += (right + 1 - left) as u32;
        }
        match (2 * on).cmp(&all) {
            std::cmp::Ordering::Equal => mask[(x, y)],
            order => order == std::cmp::Ordering::Greater,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::count;

    fn clean(kind: CleanKind, size_mm: f64, mask: &Mask) -> Mask {
        CleanUp { kind, size_mm }.apply(mask, 2.0)
    }

    /// A disc of 10 px, a speck, a whisker on the disc, a hole in it, and an island at the edge.
    fn scene() -> Mask {
        Mask::from_fn(60, 40, |x, y| {
            let (dx, dy) = (x as f64 - 25.0, y as f64 - 20.0);
            let disc = dx * dx + dy * dy <= 100.0 && (x, y) != (25, 20);
            let whisker = (35..45).contains(&x) && y == 20;
            disc || whisker || (x, y) == (50, 5) || x >= 57 && y > 30
        })
    }

    #[test]
    fn each_does_what_it_says() {
        let scene = scene();
        assert!(clean(CleanKind::FillHoles, f64::NAN, &scene)[(25, 20)]);
        let largest = clean(CleanKind::LargestIsland, 0.0, &scene);
        assert!(!largest[(50, 5)] && !largest[(58, 35)] && largest[(40, 20)]);
        let smooth = clean(CleanKind::Smooth, 1.0, &scene);
        assert!(smooth[(25, 20)] && !smooth[(42, 20)] && !smooth[(50, 5)]);
        assert!(count(&clean(CleanKind::Grow, 1.0, &scene)) > count(&scene));
        assert!(count(&clean(CleanKind::Shrink, 1.0, &scene)) < count(&scene));
    }
}
