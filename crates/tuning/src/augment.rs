//! [`Augment`]: variations of a pair, as real touches vary.

use crate::image;
use crate::random::Random;

/// Ranges in which pairs are varied.
#[derive(Clone, Debug, PartialEq)]
pub struct Augment {
    /// Largest shift of the picture, pixels; simulated pairs are not shifted.
    pub shift: f64,
    /// Shift of the imprint when the picture moves by one pixel: rows, columns. The picture sees a part of the imprint,
    /// magnified.
    pub imprint_per_picture: [f64; 2],
    /// Standard deviation of the mixing of colors.
    pub colors: f64,
    /// Standard deviation of the logarithm of the gain.
    pub gain: f64,
    /// Largest width of the blur, pixels; half of the pictures are blurred.
    pub blur: f64,
    /// Standard deviation of the noise, in standard deviations of the input.
    pub noise: f64,
    /// Share of the unclipped pictures that is clipped like a clipped picture of the set, where there is one.
    pub clipped: f64,
}

impl Default for Augment {
    fn default() -> Self {
        Self {
            shift: 6.0,
            imprint_per_picture: [0.229, 0.243],
            colors: 0.1,
            gain: 0.2,
            blur: 0.8,
            noise: 0.05,
            clipped: 0.5,
        }
    }
}

impl Augment {
    /// A variation of a picture (in its own scale) and of its imprint. `deviation` is the spread of the input, `mean` the
    /// mean imprint of the pad: what lies in the sensor and does not move with the touch.
    pub(crate) fn vary(
        &self,
        picture: &[f32],
        imprint: &[f32],
        set: &Set<'_>,
        random: &mut Random,
    ) -> (Vec<f32>, Vec<f32>) {
        let side = imprint.len().isqrt();
        let mut planes: Vec<Vec<f32>> = picture.chunks_exact(side * side).map(<[f32]>::to_vec).collect();
        let mut imprint = imprint.to_vec();
        // Everything is drawn in any case, so that one setting does not change what another one draws.
        let shift = [random.signed() * self.shift, random.signed() * self.shift];
        let mixing: Vec<f64> = (0..9).map(|_| random.normal() * self.colors).collect();
        let gain = (random.normal() * self.gain).exp() as f32;
        let (blurs, sigma) = (random.happens(0.5), random.uniform() * self.blur);
        let (clips, like) = (random.happens(self.clipped), random.below(set.clippings.len().max(1)));

        if shift != [0.0; 2] {
            planes.iter_mut().for_each(|plane| *plane = image::shifted(plane, side, shift));
            let by = [shift[0] * self.imprint_per_picture[0], shift[1] * self.imprint_per_picture[1]];
            let own: Vec<f32> = imprint.iter().zip(set.mean).map(|(value, mean)| value - mean).collect();
            let moved = image::shifted(&own, side, by);
            imprint = moved.iter().zip(set.mean).map(|(own, mean)| own + mean).collect();
        }
        if self.colors > 0.0 {
            mix(&mut planes, &mixing);
        }
        planes.iter_mut().flatten().for_each(|value| *value *= gain);
        // A narrower blur leaves the picture as it is.
        if blurs && sigma > 0.2 {
            planes.iter_mut().for_each(|plane| *plane = image::blurred(plane, side, sigma));
        }
        if self.noise > 0.0 {
            for (plane, deviation) in planes.iter_mut().zip(set.deviation) {
                plane.iter_mut().for_each(|value| *value += (random.normal() * self.noise) as f32 * deviation);
            }
        }
        if let Some(clipping) = set.clippings.get(like).filter(|_| clips && !Clipping::of(picture).any()) {
            clipping.apply(&mut planes, set.deviation);
        }
        (planes.concat(), imprint)
    }
}

/// Figures of all pairs that varying one of them needs.
pub(crate) struct Set<'a> {
    /// Mean imprint of the pair's pad.
    pub(crate) mean: &'a [f32],
    /// Spread of the input by color.
    pub(crate) deviation: [f32; 3],
    /// Clippings of the clipped pictures of the set.
    pub(crate) clippings: &'a [Clipping],
}

fn mix(planes: &mut [Vec<f32>], mixing: &[f64]) {
    let [red, green, blue] = planes else { return };
    for ((red, green), blue) in red.iter_mut().zip(green).zip(blue) {
        let before = [*red, *green, *blue];
        for (row, to) in [red, green, blue].into_iter().enumerate() {
            *to += before.iter().zip(&mixing[3 * row..]).map(|(value, weight)| value * *weight as f32).sum::<f32>();
        }
    }
}

/// Clipping: the side of each color that was cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Clipping([Option<Side>; 3]);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Dark,
    Bright,
}

impl Clipping {
    /// Clipping of a picture: a color without any negative value, or without any positive one, lost that side.
    pub(crate) fn of(picture: &[f32]) -> Self {
        let side = |plane: &[f32]| {
            let low = plane.iter().copied().fold(f32::INFINITY, f32::min);
            let high = plane.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            match (low >= 0.0, high <= 0.0) {
                (true, false) => Some(Side::Dark),
                (false, true) => Some(Side::Bright),
                _ => None,
            }
        };
        let mut planes = picture.chunks_exact(picture.len() / 3).map(side);
        Self(std::array::from_fn(|_| planes.next().flatten()))
    }

    /// True where any color is clipped.
    pub(crate) fn any(self) -> bool {
        self.0.iter().any(Option::is_some)
    }

    /// Clips, and stretches what is left to the usual spread, as is done to clipped pictures when they are read.
    fn apply(self, planes: &mut [Vec<f32>], deviation: [f32; 3]) {
        for ((plane, side), usual) in planes.iter_mut().zip(self.0).zip(deviation) {
            match side {
                None => continue,
                Some(Side::Dark) => plane.iter_mut().for_each(|value| *value = value.max(0.0)),
                Some(Side::Bright) => plane.iter_mut().for_each(|value| *value = value.min(0.0)),
            }
            let count = plane.len() as f32;
            let mean = plane.iter().sum::<f32>() / count;
            let spread = (plane.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / count).sqrt();
            if spread > usual * 1e-3 {
                plane.iter_mut().for_each(|value| *value *= usual / spread);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{random, unvaried};

    const SIDE: usize = 16;

    fn pair() -> (Vec<f32>, Vec<f32>) {
        let mut random = random(9);
        (random.normals(3 * SIDE * SIDE), random.normals(SIDE * SIDE))
    }

    #[test]
    fn without_variation_a_pair_stays_as_it_is() {
        let (picture, imprint) = pair();
        let set = Set { mean: &[0.0; SIDE * SIDE], deviation: [1.0; 3], clippings: &[] };
        assert_eq!(unvaried().vary(&picture, &imprint, &set, &mut random(1)), (picture, imprint));
    }

    #[test]
    fn the_same_numbers_vary_alike_and_all_stays_finite() {
        let (picture, imprint) = pair();
        let clippings = [Clipping([Some(Side::Dark); 3])];
        let set = Set { mean: &imprint.clone(), deviation: [1.0; 3], clippings: &clippings };
        for seed in 0..20 {
            let vary = || Augment::default().vary(&picture, &imprint, &set, &mut random(seed));
            let (a, b) = (vary(), vary());
            assert_eq!(a, b);
            assert!(a.0.iter().chain(&a.1).all(|value| value.is_finite()));
            // What equals the pad's mean does not move with the touch.
            assert_eq!(a.1, imprint);
        }
    }

    #[test]
    fn the_imprint_moves_with_the_picture() {
        let dot = |index: usize| (0..SIDE * SIDE).map(|i| f32::from(u8::from(i == index))).collect::<Vec<_>>();
        let augment = Augment { imprint_per_picture: [1.0, 1.0], shift: 3.0, ..unvaried() };
        let set = Set { mean: &[0.0; SIDE * SIDE], deviation: [1.0; 3], clippings: &[] };
        let picture = dot(8 * SIDE + 8).repeat(3);
        let (moved, imprint) = augment.vary(&picture, &dot(8 * SIDE + 8), &set, &mut random(2));
        assert_ne!(moved, picture);
        assert_eq!(moved[..SIDE * SIDE], imprint);
    }

    #[test]
    fn clipping_is_recognized_and_imitated() {
        let (mut picture, _) = pair();
        assert!(!Clipping::of(&picture).any());
        picture[..SIDE * SIDE].iter_mut().for_each(|value| *value = value.max(0.0));
        picture[2 * SIDE * SIDE..].iter_mut().for_each(|value| *value = value.min(0.0));
        let clipping = Clipping::of(&picture);
        assert_eq!(clipping, Clipping([Some(Side::Dark), None, Some(Side::Bright)]));
        let mut planes: Vec<Vec<f32>> = pair().0.chunks_exact(SIDE * SIDE).map(<[f32]>::to_vec).collect();
        clipping.apply(&mut planes, [2.0; 3]);
        assert_eq!(Clipping::of(&planes.concat()), clipping);
        let count = (SIDE * SIDE) as f32;
        let mean = planes[0].iter().sum::<f32>() / count;
        let spread = (planes[0].iter().map(|v| (v - mean).powi(2)).sum::<f32>() / count).sqrt();
        assert!((spread - 2.0).abs() < 1e-3);
    }
}
