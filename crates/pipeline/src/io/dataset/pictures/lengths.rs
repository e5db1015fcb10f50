//! Pictures of 16 bits whose values are lengths: read as such where the values tell the unit, refused else.

use std::path::Path;

use super::super::problem;
use super::{ASSUMED_IMPRINT_RANGE_M, NotedTile};
use crate::io::error::FileError;
use crate::io::images::wrong_kind;
use touch2touch_core::grid::Grid;

/// Values of a picture that was stretched differ by at least half of what 16 bits hold.
const STRETCHED: u16 = 1 << 15;
/// Share of the largest value below which a part of an imprint lies: where nothing is pushed in.
const FLAT: f64 = 0.1;
/// How this program writes predictions: micrometers from -20 mm.
const OWN_ZERO: u16 = 20_000;

/// A unit of lengths.
struct Unit {
    /// One of it, meters.
    step_m: f64,
    /// Length of the value 0, meters.
    zero_m: f64,
    name: &'static str,
}

/// The levels (0..255, as in a stretched picture) of a picture of 16 bits, and what to say of it.
///
/// # Errors
/// [`FileError`] where the values are lengths of which the unit is not known.
pub(super) fn levels(path: &Path, picture: &Grid<u16>) -> Result<NotedTile, FileError> {
    let [lo, hi] = ends(picture.as_slice().iter().copied());
    if hi - lo >= STRETCHED || hi == lo {
        return Ok((picture.map(|&v| f32::from(v) / 257.0), None));
    }
    let Some(unit) = unit(picture) else {
        let [nearest, _] = ends(picture.as_slice().iter().copied().filter(|&v| v > 0));
        let found = format!(
            "16-bit gray with values from {nearest} to {hi}, the whole depth of a camera or of a unit that is not known"
        );
        let expected = "how far the membrane is pushed in: 0 to 255, 16 bits over their whole range, or millimeters, tenths of \
                        a millimeter or micrometers with 0 where nothing is pushed in";
        return Err(wrong_kind(path, found, expected));
    };
    let [from, to] = ASSUMED_IMPRINT_RANGE_M;
    let meters = |v: u16| unit.zero_m + unit.step_m * f64::from(v);
    let level = |v: &u16| (255.0 * (meters(*v) - from) / (to - from)) as f32;
    let what = format!("a 16-bit picture of lengths: read as {}, up to {:.1} mm", unit.name, 1e3 * meters(hi));
    let note =
        problem(path, what, "check the largest depth; a picture stretched over all 16 bits is read like one of 8");
    Ok((picture.map(level), Some(note)))
}

/// The unit in which the values are an imprint of some millimeters that is flat somewhere.
fn unit(picture: &Grid<u16>) -> Option<Unit> {
    let mut values: Vec<u16> = picture.as_slice().iter().copied().filter(|&v| v > 0).collect();
    values.sort_unstable();
    let (low, middle, high) = (*values.get(values.len() / 20)?, values[values.len() / 2], *values.last()?);
    if (OWN_ZERO - 2_000..=OWN_ZERO + 10_000).contains(&middle) && high < OWN_ZERO + 30_000 {
        return Some(Unit { step_m: 1e-6, zero_m: -0.02, name: "micrometers from -20 mm" });
    }
    let flat = f64::from(low) <= (FLAT * f64::from(high)).max(1.0);
    let (step_m, name) = match high {
        2..=40 => (1e-3, "millimeters"),
        41..=400 => (1e-4, "tenths of a millimeter"),
        3_000..=40_000 => (1e-6, "micrometers"),
        _ => return None,
    };
    flat.then_some(Unit { step_m, zero_m: 0.0, name })
}

/// Least and largest value.
fn ends(values: impl Iterator<Item = u16>) -> [u16; 2] {
    let [lo, hi] = values.fold([u16::MAX, 0], |[lo, hi], v| [lo.min(v), hi.max(v)]);
    [lo.min(hi), hi]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Meters that a picture of these values stands for.
    fn read(picture: &Grid<u16>) -> Result<(Grid<f64>, bool), String> {
        let (levels, note) = levels(Path::new("a_bubble.png"), picture).map_err(|err| err.to_string())?;
        let [from, to] = ASSUMED_IMPRINT_RANGE_M;
        Ok((levels.map(|v| from + (to - from) * f64::from(*v) / 255.0), note.is_some()))
    }

    #[test]
    fn lengths_are_read_as_such_and_the_whole_depth_is_refused() {
        // A dent of 16 mm in a flat membrane.
        let imprint = |x: usize, y: usize| {
            let d = (x as f64 - 40.0).hypot(y as f64 - 30.0);
            (0.016 * (1.0 - d / 25.0)).max(0.0)
        };
        let stored = |f: &dyn Fn(f64) -> f64| Grid::from_fn(80, 60, |x, y| f(imprint(x, y)).round() as u16);
        for (per_m, zero) in [(1e3, 0.0), (1e4, 0.0), (1e6, 0.0), (1e6, 20_000.0)] {
            let (meters, said) = read(&stored(&|m| m * per_m + zero)).unwrap();
            assert!(said);
            for (x, y) in [(40, 30), (50, 30), (0, 0)] {
                assert!(
                    (meters[(x, y)] - imprint(x, y)).abs() < 0.51 / per_m + 1e-6,
                    "{per_m} {zero}: {}",
                    meters[(x, y)]
                );
            }
        }
        // Stretched, as with 8 bits.
        let (meters, said) = read(&stored(&|m| 65_535.0 * m / 0.016)).unwrap();
        assert!(!said && (meters[(40, 30)] - 0.018).abs() < 1e-6 && (meters[(0, 0)] + 0.0063).abs() < 1e-6);
        // A camera's depths, in millimeters and in tenths of them, with holes.
        for per_m in [1e3, 1e4] {
            for hole in [false, true] {
                let mut depths = stored(&|m| (0.1 - m) * per_m);
                if hole {
                    depths[(3, 3)] = 0;
                }
                let why = read(&depths).unwrap_err();
                assert!(why.contains("a_bubble.png") && why.contains("whole depth of a camera"), "{why}");
            }
        }
    }
}
