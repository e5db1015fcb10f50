//! [`Sensors`]: imprints as other sensors would have measured the same touch.

use super::MaskTouch;
use crate::random::Random;

/// Ranges in which imprints are varied. What makes a pixel contact is the shape around it, not its depth: another
/// gripper presses another bubble less, and another camera has another level, grain and place.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors {
    /// Half of the measured imprints are drawn shallower, by factors from here to 1.
    pub shallowest: f64,
    /// Down to this depth at most, meters: of what is shallower, the grain leaves no shape.
    pub least_m: f64,
    /// Largest change of the depth of the others, as a share.
    pub gain: f64,
    /// Standard deviation of the level, meters.
    pub level_m: f64,
    /// Largest standard deviation of slow distortions, meters; half of the imprints have some.
    pub distortion_m: f64,
    /// Largest standard deviation of the grain, meters; half of the imprints get more than they have.
    pub grain_m: f64,
    /// Share that is smoothed over 3 × 3 pixels.
    pub smoothed: f64,
    /// Largest shift along each axis, pixels. What comes in from outside does not count.
    pub shift_px: usize,
    /// True where imprints are mirrored along either axis.
    pub mirrored: bool,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            shallowest: 0.3,
            least_m: 4e-3,
            gain: 0.1,
            level_m: 4e-4,
            distortion_m: 4e-4,
            grain_m: 2e-4,
            smoothed: 0.25,
            shift_px: 12,
            mirrored: true,
        }
    }
}

/// Columns and rows of the grid that slow distortions are drawn on.
const SLOW: [usize; 2] = [5, 4];

impl Sensors {
    /// A touch as another sensor would have felt it.
    pub(super) fn vary(&self, touch: &MaskTouch, size: [usize; 2], random: &mut Random) -> MaskTouch {
        // Everything is drawn in any case, so that one setting does not change what another one draws.
        let (shallow, by) = (random.happens(0.5) && !touch.predicted, random.uniform());
        let gain = if shallow {
            let shallowest = (self.least_m / depth(&touch.imprint_m)).clamp(self.shallowest, 1.0);
            shallowest.powf(by)
        } else {
            1.0 + (2.0 * by - 1.0) * self.gain
        };
        let level = random.normal() * self.level_m;
        let distorts = [random.happens(0.5), random.happens(0.5)];
        let [distortion, grain] = [random.uniform() * self.distortion_m, random.uniform() * self.grain_m];
        let smooths = random.happens(self.smoothed);
        let mut moves = || random.below(2 * self.shift_px + 1) as isize - self.shift_px as isize;
        let (right, down) = (moves(), moves());
        let mirrors = [random.happens(0.5), random.happens(0.5)].map(|mirrors| mirrors && self.mirrored);
        let slow = random.normals(SLOW[0] * SLOW[1]);

        let place = Place { size, by: [right, down], mirrors };
        // What lies outside the picture is as its border, and is not known to be contact or not.
        let from: Vec<(usize, bool)> = place.origins().collect();
        let outside = touch.counted.is_some() || from.iter().any(|(_, inside)| !inside);
        let counts =
            |&(index, inside): &(usize, bool)| inside && touch.counted.as_ref().is_none_or(|counted| counted[index]);
        let mut imprint_m: Vec<f32> = from.iter().map(|&(index, _)| touch.imprint_m[index]).collect();
        if smooths {
            imprint_m = boxed(&imprint_m, size);
        }
        for (i, meters) in imprint_m.iter_mut().enumerate() {
            let mut more = level;
            if distorts[0] {
                more += distortion * f64::from(interpolated(&slow, size, i));
            }
            if distorts[1] {
                more += grain * random.normal();
            }
            *meters = (f64::from(*meters) * gain + more) as f32;
        }
        MaskTouch {
            imprint_m,
            contact: from.iter().map(|&(index, _)| touch.contact[index]).collect(),
            counted: outside.then(|| from.iter().map(counts).collect()),
            predicted: touch.predicted,
        }
    }
}

/// Depth of an imprint: a hundredth of what was measured is deeper. Meters, above 0.
fn depth(imprint_m: &[f32]) -> f64 {
    let mut measured: Vec<f32> = imprint_m.iter().copied().filter(|v| v.is_finite()).collect();
    let rank = measured.len() * 99 / 100;
    let deep = if measured.is_empty() { 0.0 } else { *measured.select_nth_unstable_by(rank, f32::total_cmp).1 };
    f64::from(deep).max(1e-6)
}

/// Shift and mirroring of a picture.
struct Place {
    size: [usize; 2],
    /// Right and down, pixels.
    by: [isize; 2],
    /// Along rows, along columns.
    mirrors: [bool; 2],
}

impl Place {
    /// For each pixel the one that it comes from, and whether that lies within the picture.
    fn origins(&self) -> impl Iterator<Item = (usize, bool)> {
        let [width, height] = self.size;
        let origin = |axis: usize, coordinate: usize| {
            let size = self.size[axis] as isize;
            let coordinate = coordinate as isize - self.by[axis];
            let held = coordinate.clamp(0, size - 1);
            let mirrored = if self.mirrors[axis] { size - 1 - held } else { held };
            (mirrored as usize, held == coordinate)
        };
        (0..width * height).map(move |i| {
            let ((x, in_x), (y, in_y)) = (origin(0, i % width), origin(1, i / width));
            (y * width + x, in_x && in_y)
        })
    }
}

/// A small grid drawn over the whole picture, without edges between its cells.
fn interpolated(grid: &[f32], [width, height]: [usize; 2], i: usize) -> f32 {
    let along = |coordinate: usize, size: usize, cells: usize| {
        let place = coordinate as f32 * (cells - 1) as f32 / (size - 1).max(1) as f32;
        let low = (place as usize).min(cells - 2);
        let part = place - low as f32;
        (low, part * part * (3.0 - 2.0 * part))
    };
    let ((x, right), (y, down)) = (along(i % width, width, SLOW[0]), along(i / width, height, SLOW[1]));
    let row = |y: usize| grid[y * SLOW[0] + x] * (1.0 - right) + grid[y * SLOW[0] + x + 1] * right;
    row(y) * (1.0 - down) + row(y + 1) * down
}

/// Means over 3 × 3 pixels, of those that were measured; what was not measured stays so.
fn boxed(picture: &[f32], [width, height]: [usize; 2]) -> Vec<f32> {
    let mean = |i: usize| {
        if !picture[i].is_finite() {
            return picture[i];
        }
        let (x, y) = (i % width, i / width);
        let (mut sum, mut count) = (0.0, 0.0);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for &v in &picture[row * width + x.saturating_sub(1)..row * width + (x + 2).min(width)] {
                if v.is_finite() {
                    (sum, count) = (sum + v, count + 1.0);
                }
            }
        }
        sum / count
    };
    (0..picture.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::random;

    const SIZE: [usize; 2] = [9, 6];

    /// No variation at all.
    fn unvaried() -> Sensors {
        Sensors {
            shallowest: 1.0,
            least_m: 0.0,
            gain: 0.0,
            level_m: 0.0,
            distortion_m: 0.0,
            grain_m: 0.0,
            smoothed: 0.0,
            shift_px: 0,
            mirrored: false,
        }
    }

    fn touch() -> MaskTouch {
        let contact: Vec<bool> = (0..54).map(|i| i == 21 || i == 22).collect();
        let mut imprint_m: Vec<f32> = contact.iter().map(|&c| if c { 0.01 } else { 0.0 }).collect();
        imprint_m[3] = f32::NAN;
        MaskTouch { imprint_m, contact, counted: None, predicted: false }
    }

    fn same(a: &MaskTouch, b: &MaskTouch) -> bool {
        let bits = |touch: &MaskTouch| touch.imprint_m.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        (bits(a), &a.contact, &a.counted) == (bits(b), &b.contact, &b.counted)
    }

    #[test]
    fn without_variation_a_touch_stays_as_it_is() {
        assert!(same(&unvaried().vary(&touch(), SIZE, &mut random(1)), &touch()));
    }

    #[test]
    fn the_mask_moves_with_the_imprint_and_what_comes_from_outside_does_not_count() {
        let moving = Sensors { shift_px: 2, mirrored: true, ..unvaried() };
        let mut moved = 0;
        for seed in 0..30 {
            let varied = moving.vary(&touch(), SIZE, &mut random(seed));
            assert!(same(&varied, &moving.vary(&touch(), SIZE, &mut random(seed))));
            for (meters, contact) in varied.imprint_m.iter().zip(&varied.contact) {
                assert_eq!(*meters == 0.01, *contact);
            }
            if let Some(counted) = &varied.counted {
                // Whole rows and columns at the borders, and nothing else.
                let out = counted.iter().filter(|&&counts| !counts).count();
                assert!(out > 0 && out < 30 && !counted.iter().all(|v| !v), "{out}");
                moved += 1;
            }
        }
        assert!(moved > 20);
        let ignored = MaskTouch { counted: Some((0..54).map(|i| i != 30).collect()), ..touch() };
        let flips = Sensors { mirrored: true, ..unvaried() };
        let varied = flips.vary(&ignored, SIZE, &mut random(5));
        assert_eq!(varied.counted.unwrap().iter().filter(|&&counts| !counts).count(), 1);
    }

    #[test]
    fn depth_varies_for_what_was_measured_and_little_for_predictions() {
        let depths = |depth_m: f32, predicted: bool| -> Vec<f32> {
            let touch = MaskTouch { predicted, imprint_m: vec![depth_m; 54], ..touch() };
            let deep = Sensors { level_m: 0.0, distortion_m: 0.0, grain_m: 0.0, ..Sensors::default() };
            (0..60).map(|seed| deep.vary(&touch, SIZE, &mut random(seed)).imprint_m[0]).collect()
        };
        let least = |depths: &[f32]| depths.iter().copied().fold(f32::INFINITY, f32::min);
        let (measured, predicted) = (depths(0.015, false), depths(0.01, true));
        assert!(least(&measured) < 0.006 && least(&measured) >= 0.0045, "{}", least(&measured));
        // What is shallow already is not drawn shallower than what a shape is left of.
        let shallow = [depths(0.006, false), depths(0.002, false)].map(|depths| least(&depths));
        assert!(shallow[0] < 0.0045 && shallow[0] >= 0.004 && shallow[1] >= 0.0018, "{shallow:?}");
        assert!(least(&predicted) >= 0.009);
        let varied = Sensors::default().vary(&touch(), SIZE, &mut random(3));
        assert_eq!(
            varied.imprint_m.iter().filter(|v| !v.is_finite()).count(),
            usize::from(varied.imprint_m.iter().any(|v| v.is_nan()))
        );
    }
}
