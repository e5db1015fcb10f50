//! The GelSlim pictures of both fingers in a file of tensors.

use std::path::Path;

use super::{most_invalid, problem};
use crate::io::error::FileError;
use touch2touch_core::dataset::Problem;
use touch2touch_core::grid::{Grid, RgbGrid};
use touch2touch_core::rig::{Rig, lab};
use touch2touch_core::sample::ColorTouch;

const PIXELS: usize = lab::GELSLIM.width * lab::GELSLIM.height;

/// The touches of the right and the left finger, whose three planes stand at these `places`; what is not finite in one of the
/// two pictures counts as no difference.
pub(super) fn touches(
    file: &Path,
    keys: [&str; 2],
    [mut raw, mut reference]: [Vec<f32>; 2],
    places: [usize; 2],
    notes: &mut Vec<Problem>,
) -> Result<[ColorTouch; 2], FileError> {
    let mut bad = 0;
    for (finger, place) in lab::PADS.into_iter().zip(places) {
        let span = 3 * PIXELS * place..3 * PIXELS * (place + 1);
        let mut here = 0;
        for (a, b) in raw[span.clone()].iter_mut().zip(&mut reference[span]) {
            if !(a.is_finite() && b.is_finite()) {
                here += 1;
                (*a, *b) = (0.0, 0.0);
            }
        }
        most_invalid(file, here, 3 * PIXELS, || format!("values of the {} GelSlim image", Rig::lab().pad_key(finger)))?;
        bad += here;
    }
    if bad > 0 {
        let percent = 100.0 * bad as f64 / raw.len() as f64;
        let what = format!("keys \"{}\", \"{}\": {bad} values ({percent:.2} %) are NaN or infinite", keys[0], keys[1]);
        notes.push(problem(file, what, "these values count as no difference"));
    }
    let picture = |values: &[f32], place: usize| -> RgbGrid {
        Grid::from_fn(lab::GELSLIM.width, lab::GELSLIM.height, |x, y| {
            std::array::from_fn(|c| values[(3 * place + c) * PIXELS + y * lab::GELSLIM.width + x])
        })
    };
    let touch = |place| ColorTouch::from_images(picture(&raw, place), picture(&reference, place));
    Ok(places.map(|place| touch(place).expect("both pictures are of one size")))
}
