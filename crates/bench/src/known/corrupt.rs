//! Contact masks as a learned model gets them wrong: a wavering outline, blobs, halos, missing ends.

use touch2touch_core::grid::{Grid, Mask};
use touch2touch_core::noise::{Noise, Stream};
use touch2touch_core::rig::PadId;

/// Strength of the spoiling of a mask. Lengths in pixels; ranges are drawn from uniformly.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Corruption {
    /// Deviation of the outline from its true place, from spot to spot (bumps about 7 pixels wide).
    pub(super) outline_px: f64,
    /// Deviation of the whole outline: a mask that is too fat or too thin all over.
    pub(super) offset_px: f64,
    /// Blobs that are no contact: expected number and range of their semi-axes.
    pub(super) blobs: f64,
    /// See [`Corruption::blobs`].
    pub(super) blob_px: [f64; 2],
    /// Stretches of the outline that are too fat: expected number and range of the additional width.
    pub(super) halos: f64,
    /// See [`Corruption::halos`].
    pub(super) halo_px: [f64; 2],
    /// Ends that are missing: expected number and range of the missing length.
    pub(super) ends: f64,
    /// See [`Corruption::ends`].
    pub(super) end_px: [f64; 2],
    /// Share of all pixels that are flipped one by one.
    pub(super) flipped_share: f64,
    /// Probability that everything on one side of a random line through the contact is missing.
    pub(super) cut: f64,
}

impl Corruption {
    /// An ordinary learned mask: an overlap (IoU) of about 0.8 with the truth.
    pub(super) fn nominal() -> Self {
        Self {
            outline_px: 0.5,
            offset_px: 0.35,
            blobs: 0.6,
            blob_px: [2.0, 5.0],
            halos: 1.0,
            halo_px: [1.0, 2.5],
            ends: 1.0,
            end_px: [5.0, 12.0],
            flipped_share: 0.000_5,
            cut: 0.0,
        }
    }

    /// A bad one: an overlap of about 0.5.
    pub(super) fn hard() -> Self {
        Self {
            outline_px: 0.9,
            offset_px: 0.6,
            blobs: 2.0,
            blob_px: [3.0, 8.0],
            halos: 2.0,
            halo_px: [1.5, 4.0],
            ends: 1.5,
            end_px: [10.0, 20.0],
            flipped_share: 0.002,
            cut: 0.5,
        }
    }
}

/// A spoilt copy of the contact mask of `finger`. The same arguments give the same mask on every machine.
pub(super) fn corrupt(clean: &Mask, corruption: &Corruption, finger: PadId, seed: u64) -> Mask {
    let [width, height] = clean.size();
    let mut noise = Noise::new(seed, Stream::Mask, finger.index());
    let contact: Vec<[f64; 2]> = pixels(clean);
    let distance = outline_distance(clean);
    let wave = noise.smooth(width, height, 7.0);
    let offset = corruption.offset_px * f64::from(noise.normal());
    let mut growth = Grid::from_fn(width, height, |x, y| offset + corruption.outline_px * f64::from(wave[(x, y)]));
    if !contact.is_empty() {
        for _ in 0..count(&mut noise, corruption.halos) {
            let [cx, cy] = contact[noise.below(contact.len())];
            let (more, reach) = (range(&mut noise, corruption.halo_px), noise.uniform(8.0, 20.0));
            paint(&mut growth, [cx, cy], reach, |v| v + more);
        }
    }
    let mut mask = Mask::from_fn(width, height, |x, y| distance[(x, y)] < growth[(x, y)]);
    if !contact.is_empty() {
        for _ in 0..count(&mut noise, corruption.ends) {
            // The end in a random direction: the contact pixel that lies farthest that way.
            let (s, c) = noise.uniform(0.0, std::f64::consts::TAU).sin_cos();
            let along = |p: &[f64; 2]| c * p[0] + s * p[1];
            if let Some(&end) = contact.iter().max_by(|a, b| along(a).total_cmp(&along(b))) {
                let reach = range(&mut noise, corruption.end_px);
                paint(&mut mask, end, reach, |_| false);
            }
        }
        if noise.unit() < corruption.cut {
            let [cx, cy] = contact[noise.below(contact.len())];
            let (s, c) = noise.uniform(0.0, std::f64::consts::TAU).sin_cos();
            for y in 0..height {
                for x in 0..width {
                    mask[(x, y)] &= c * (x as f64 - cx) + s * (y as f64 - cy) < 0.0;
                }
            }
        }
    }
    for _ in 0..count(&mut noise, corruption.blobs) {
        let center = [noise.uniform(0.0, width as f64), noise.uniform(0.0, height as f64)];
        let semi = [range(&mut noise, corruption.blob_px), range(&mut noise, corruption.blob_px)];
        for y in 0..height {
            for x in 0..width {
                let (dx, dy) = ((x as f64 - center[0]) / semi[0], (y as f64 - center[1]) / semi[1]);
                mask[(x, y)] |= dx * dx + dy * dy <= 1.0;
            }
        }
    }
    for pixel in mask.as_mut_slice() {
        *pixel ^= noise.unit() < corruption.flipped_share;
    }
    mask
}

fn pixels(mask: &Mask) -> Vec<[f64; 2]> {
    let [width, height] = mask.size();
    (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .filter(|&p| mask[p])
        .map(|(x, y)| [x as f64, y as f64])
        .collect()
}

fn range(noise: &mut Noise, [low, high]: [f64; 2]) -> f64 {
    noise.uniform(low, high)
}

/// A whole number with this mean: its whole part, and one more with the probability of the rest.
fn count(noise: &mut Noise, mean: f64) -> usize {
    (mean + noise.unit()).floor().max(0.0) as usize
}

/// Changes all values within `reach` pixels of `center`.
fn paint<T: Copy>(grid: &mut Grid<T>, center: [f64; 2], reach: f64, change: impl Fn(T) -> T) {
    let [width, height] = grid.size();
    for y in 0..height {
        for x in 0..width {
            if (x as f64 - center[0]).hypot(y as f64 - center[1]) <= reach {
                grid[(x, y)] = change(grid[(x, y)]);
            }
        }
    }
}

/// Distance of every pixel to the mask's outline, pixels, negative inside (steps of 1 and √2 along the grid).
fn outline_distance(mask: &Mask) -> Grid<f64> {
    let half = |inside: bool| {
        let mut d = mask.map(|&m| if m == inside { f64::INFINITY } else { 0.0 });
        let [width, height] = d.size();
        let steps =
            [(-1i64, 0i64, 1.0), (0, -1, 1.0), (-1, -1, std::f64::consts::SQRT_2), (1, -1, std::f64::consts::SQRT_2)];
        for backwards in [false, true] {
            for i in 0..width * height {
                let i = if backwards { width * height - 1 - i } else { i };
                let (x, y) = ((i % width) as i64, (i / width) as i64);
                for (dx, dy, step) in steps {
                    let (dx, dy) = if backwards { (-dx, -dy) } else { (dx, dy) };
                    let (nx, ny) = (x + dx, y + dy);
                    if let Some(near) = (nx >= 0 && ny >= 0).then(|| d.get(nx as usize, ny as usize)).flatten() {
                        let through = near + step;
                        let here = &mut d[(x as usize, y as usize)];
                        *here = here.min(through);
                    }
                }
            }
        }
        d
    };
    let (into, out_of) = (half(true), half(false));
    let [width, height] = mask.size();
    // The outline runs between the pixels.
    Grid::from_fn(width, height, |x, y| if mask[(x, y)] { 0.5 - into[(x, y)] } else { out_of[(x, y)] - 0.5 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::rig::lab;

    fn bar() -> Mask {
        Mask::from_fn(175, 140, |x, y| (30..140).contains(&x) && (60..72).contains(&y))
    }

    fn overlap(a: &Mask, b: &Mask) -> f64 {
        let both = a.as_slice().iter().zip(b.as_slice());
        let (and, or) =
            both.fold((0, 0), |(and, or), (a, b)| (and + usize::from(*a && *b), or + usize::from(*a || *b)));
        and as f64 / or as f64
    }

    #[test]
    fn masks_are_spoilt_as_much_as_said_and_repeat() {
        for (corruption, range) in [(Corruption::nominal(), 0.7..0.9), (Corruption::hard(), 0.3..0.65)] {
            let overlaps: Vec<f64> =
                (0..40).map(|seed| overlap(&corrupt(&bar(), &corruption, lab::LEFT, seed), &bar())).collect();
            let mean = overlaps.iter().sum::<f64>() / 40.0;
            assert!(range.contains(&mean), "{mean}");
            assert_eq!(corrupt(&bar(), &corruption, lab::LEFT, 3), corrupt(&bar(), &corruption, lab::LEFT, 3));
            assert_ne!(corrupt(&bar(), &corruption, lab::LEFT, 3), corrupt(&bar(), &corruption, lab::RIGHT, 3));
        }
    }

    #[test]
    fn the_distance_counts_pixels_from_the_outline() {
        let d = outline_distance(&bar());
        assert_eq!((d[(80, 60)], d[(80, 59)], d[(80, 62)], d[(80, 50)]), (-0.5, 0.5, -2.5, 9.5));
        let nothing = Mask::filled(9, 7, false);
        let mask =
            corrupt(&nothing, &Corruption { blobs: 0.0, flipped_share: 0.0, ..Corruption::hard() }, lab::LEFT, 1);
        assert_eq!(mask, nothing, "no contact, no outline");
        let all = Mask::filled(9, 7, true);
        assert_eq!(
            corrupt(
                &all,
                &Corruption { blobs: 0.0, ends: 0.0, cut: 0.0, flipped_share: 0.0, ..Corruption::hard() },
                lab::LEFT,
                1
            ),
            all
        );
    }
}
