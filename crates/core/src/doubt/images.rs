//! Touched against untouched images of some pairs: what no camera takes, and what another reading sets right.

use std::borrow::Cow;

use strum::IntoEnumIterator as _;

use super::{Cause, Doubt, PairInput, median};
use crate::evaluation::mean;
use crate::grid::RgbGrid;
use crate::read_as::{Colors, Images, Lay, ReadAs, Stored};
use crate::resample::bilinear_rgb;
use crate::rig::{PadId, PerPad, Rig, lab};
use crate::sample::{ColorImages, ColorTouch};
use crate::turn::Turn;
use crate::units::counted;
use crate::upright;

/// Share of the images that must show the same.
const MOST: f64 = 0.8;
/// An image whose brightest value is no larger is on the scale 0..1.
const UNIT: f64 = 1.5;
/// One whose brightest value is larger is on the scale 0..255.
const BYTES: f64 = 8.0;
/// Largest sound median of a channel, levels of 255: where nothing touches the gel the difference is about 0, and sound
/// images have a median of up to 5.
const OFF: f64 = 12.0;
/// A reading that brings that median down to this share of it explains it.
const EXPLAINED: f64 = 0.4;
/// Differences beyond this, levels, are steps that no gel makes over more than a few pixels.
const STEP: f32 = 128.0;
/// Share of such pixels from which wrapping is tried.
const STEPS: f64 = 0.002;
/// By wrapping back the image becomes smoother by this much.
const SMOOTHER: f64 = 0.85;
/// Untouched images of one finger change less from pair to pair than touched ones: by this factor the other way round, and
/// by so many levels.
const VARIES: f64 = 0.5;
const VARIES_LEVELS: f64 = 1.0;
/// Sure readings of the light that it takes, and the share of them that must agree.
const LIGHTS: usize = 3;
const LIGHTS_AGREE: f64 = 0.75;
/// By how much more consistent the light must be in other colors. Lights at 120 degrees from each other whose channels change
/// places look like ones that are turned by a quarter, and by 30 degrees more.
const CLEARER: f64 = 0.05;
/// Side of the square that the light is read from, pixels.
const SIDE: usize = 128;

/// Doubt about the color images of some pairs.
pub(super) fn judge(pairs: &[PairInput<'_>]) -> Option<Doubt> {
    let touches = pairs.iter().flat_map(|pair| pair.sample.pads.entries());
    let (pads, images): (Vec<PadId>, Vec<&ColorImages>) =
        touches.filter_map(|(pad, touch)| Some((pad, touch.color()?.images.as_ref()?))).unzip();
    if images.is_empty() {
        return None;
    }
    let faces: Vec<Face> = images.iter().map(|images| Face::of(images)).collect();
    let colored = pairs.iter().any(|pair| is_gelslim(&pair.sample.rig));
    plain(&faces, colored)
        .or_else(|| of_one_finger(&pairs.first()?.sample.rig, &pads, &faces))
        .or_else(|| stored(&images, &faces))
        .or_else(|| swapped(pairs))
        .or_else(|| by_light(pairs, &faces))
}

/// Figures of one touch that tell at a glance.
struct Face {
    /// True where touched and untouched image are equal, pixel by pixel.
    same: bool,
    touch: Plain,
    reference: Plain,
}

/// One image.
struct Plain {
    /// Largest value.
    most: f64,
    /// Smallest value.
    least: f64,
    /// Median of each channel.
    median: [f64; 3],
    /// Median of each channel, modulo 256 nearest to 0.
    wrapped: [f64; 3],
    /// True where the three channels are equal.
    gray: bool,
}

impl Plain {
    fn of(image: &RgbGrid) -> Self {
        let values = || image.as_slice().iter().flatten().map(|v| f64::from(*v));
        let some = || image.as_slice().iter().step_by(7);
        let channel = |c: usize| median(some().map(|p| f64::from(p[c]))).unwrap_or(0.0);
        let wrapped = |c: usize| median(some().map(|p| wrap(f64::from(p[c])))).unwrap_or(0.0);
        let unequal = image.as_slice().iter().filter(|p| (p[0] - p[1]).abs().max((p[1] - p[2]).abs()) > 1e-3).count();
        Self {
            most: values().fold(f64::NEG_INFINITY, f64::max),
            least: values().fold(f64::INFINITY, f64::min),
            median: [0, 1, 2].map(channel),
            wrapped: [0, 1, 2].map(wrapped),
            gray: unequal * 100 <= image.len(),
        }
    }

    fn single(&self) -> bool {
        self.most - self.least < 1e-3
    }
}

impl Face {
    fn of(images: &ColorImages) -> Self {
        let same = images.raw.as_slice() == images.reference.as_slice();
        Self { same, touch: Plain::of(&images.raw), reference: Plain::of(&images.reference) }
    }
}

fn most<'a>(faces: impl IntoIterator<Item = &'a Face>, shows: impl Fn(&Face) -> bool) -> Option<String> {
    let shown: Vec<bool> = faces.into_iter().map(shows).collect();
    let count = shown.iter().filter(|shown| **shown).count();
    let enough = count > 0 && count as f64 >= MOST * shown.len() as f64;
    enough.then(|| format!("{count} of {}", counted(shown.len(), "image")))
}

/// True where the color sensor is a GelSlim, of which is known that its light is colored, and where it comes from.
fn is_gelslim(rig: &Rig) -> bool {
    rig.color().is_some_and(|sensor| sensor.key == lab::GELSLIM.key)
}

/// Doubt about what shows at a glance. `colored`: the sensor's light has colors.
fn plain(faces: &[Face], colored: bool) -> Option<Doubt> {
    let broken = |cause, what: String, hint: &str| Some(Doubt::new(cause, what, hint));
    if let Some(of) = most(faces, |face| face.same && !face.touch.single()) {
        let what = format!("touched and untouched image are the same, pixel by pixel: {of}");
        return broken(Cause::SameImages, what, "store the image that was taken before the touch as the untouched one");
    }
    let unit = |plain: &Plain| plain.most <= UNIT && !plain.single();
    let bytes = |plain: &Plain| plain.most > BYTES;
    for (which, touch, reference) in
        [(Images::Both, true, true), (Images::Touch, true, false), (Images::Reference, false, true)]
    {
        let is = |unit_scale: bool, plain: &Plain| if unit_scale { unit(plain) } else { bytes(plain) };
        if let Some(of) = most(faces, |face| is(touch, &face.touch) && is(reference, &face.reference)) {
            return Some(Doubt::stored(ReadAs::Image255(which), &format!("they reach no more than 1: {of}")));
        }
    }
    if !colored {
        return None;
    }
    if let Some(of) = most(faces, |face| face.touch.gray && face.reference.gray && !face.touch.single()) {
        let what = format!("the three channels are equal: {of} are gray");
        return broken(Cause::Gray, what, "store the camera's colors: without them no model can read the gel's slopes");
    }
    None
}

/// A finger whose touched images show no touch, where those of the other one do.
fn of_one_finger(rig: &Rig, pads: &[PadId], faces: &[Face]) -> Option<Doubt> {
    rig.pads().find_map(|pad| {
        let own = pads.iter().zip(faces).filter(|(of, _)| **of == pad).map(|(_, face)| face);
        let of = most(own, |face| face.same || face.touch.single())?;
        let what = format!("the touched images of the {} finger show no touch: {of}", rig.pad_name(pad));
        Some(Doubt::new(Cause::SameImages, what, "check that finger's camera and what stores its images"))
    })
}

/// Differences and wrapped values stored as images, channels in another order, an untouched image that is none.
fn stored(images: &[&ColorImages], faces: &[Face]) -> Option<Doubt> {
    let size = |values: [f64; 3]| values.iter().map(|v| v.abs()).sum::<f64>() / 3.0;
    let minus = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|c| a[c] - b[c]);
    let reversed = |[a, b, c]: [f64; 3]| [c, b, a];
    let typical = |of: &dyn Fn(&Face) -> f64| median(faces.iter().map(of)).unwrap_or(0.0);
    let off = typical(&|face| size(minus(face.touch.median, face.reference.median)));
    let wrapped = typical(&|face| size(face.touch.wrapped));
    let gray = typical(&|face| size(face.touch.median.map(|v| v - 128.0)));
    let signed = typical(&|face| size(face.touch.median));
    let without = most(faces, |face| face.reference.single());
    if off > OFF || without.is_some() {
        let negative = most(faces, |face| face.touch.least < -1.0).is_some();
        let bgr = typical(&|face| size(minus(reversed(face.touch.median), face.reference.median)));
        let unwrapped = typical(&|face| size(minus(face.touch.median, face.reference.median).map(wrap)));
        // Which of the two is in the other order shows in the light: a GelSlim's is blue.
        let red = |plain: &dyn Fn(&Face) -> [f64; 3]| typical(&|face| plain(face)[0] - plain(face)[2]);
        let which = if red(&|face| face.touch.median) > red(&|face| face.reference.median) {
            Images::Touch
        } else {
            Images::Reference
        };
        let mut tried = vec![(ReadAs::ImageIsDifference(Stored::Gray), gray)];
        if negative {
            tried.push((ReadAs::ImageIsDifference(Stored::Signed), signed));
        } else {
            tried.push((ReadAs::ImageIsDifference(Stored::Wrapped), wrapped));
        }
        if without.is_none() {
            tried.extend([(ReadAs::ImageBgr(which), bgr), (ReadAs::ImageUnwrap, unwrapped)]);
        }
        let best = tried.into_iter().min_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some((read_as, left)) = best.filter(|(_, left)| *left < OFF && *left <= EXPLAINED * off.max(OFF)) {
            let figures = format!(
                "where nothing touches the gel the difference is {off:.0} levels of 255, read otherwise {left:.0} (median of {})",
                counted(faces.len(), "image")
            );
            return Some(Doubt::stored(read_as, &figures));
        }
    }
    if let Some(of) = without {
        let what = format!("the untouched image is a single color: {of}");
        return Some(Doubt::new(Cause::NoReference, what, "store the image that was taken before the touch"));
    }
    wrapped_around(images, faces)
}

/// The value modulo 256 that is nearest to 0.
fn wrap(v: f64) -> f64 {
    (v + 128.0).rem_euclid(256.0) - 128.0
}

/// Images that went on at 0 behind 255, or at -128 behind 127.
fn wrapped_around(images: &[&ColorImages], faces: &[Face]) -> Option<Doubt> {
    let negative = most(faces, |face| face.touch.least < -1.0 && face.reference.least < -1.0);
    let (mut steps, mut rough, mut smooth, mut count) = (0usize, 0.0, 0.0, 0usize);
    for images in images {
        for y in (0..images.raw.height()).step_by(5) {
            let difference: Vec<f32> = images
                .raw
                .row(y)
                .iter()
                .zip(images.reference.row(y))
                .flat_map(|(a, b)| (0..3).map(move |c| a[c] - b[c]))
                .collect();
            count += difference.len();
            steps += difference.iter().filter(|d| d.abs() > STEP).count();
            for pair in difference.windows(4) {
                rough += f64::from((pair[3] - pair[0]).abs());
                smooth += (wrap(f64::from(pair[3])) - wrap(f64::from(pair[0]))).abs();
            }
        }
    }
    let share = steps as f64 / count.max(1) as f64;
    let wrapped = negative.is_some() || (share > STEPS && smooth < SMOOTHER * rough);
    wrapped.then(|| {
        let figures = format!(
            "{:.1} % of the differences are larger than 128 levels, and without the steps of 256 the images are {:.0} % smoother",
            100.0 * share,
            100.0 * (1.0 - smooth / rough.max(1e-9))
        );
        Doubt::stored(ReadAs::ImageUnwrap, &figures)
    })
}

/// An untouched image that changes from pair to pair, beside a touched one that does not.
fn swapped(pairs: &[PairInput<'_>]) -> Option<Doubt> {
    let mut by_pad: PerPad<Vec<[Vec<f64>; 2]>> = PerPad::default();
    for pair in pairs {
        for (pad, touch) in pair.sample.pads.entries() {
            let Some(images) = touch.color().and_then(|color| color.images.as_ref()) else { continue };
            by_pad[pad].get_or_insert_default().push([&images.raw, &images.reference].map(blocks));
        }
    }
    let (mut changes, mut fingers) = ([Vec::new(), Vec::new()], 0);
    for of_pad in by_pad.iter().flatten() {
        for pair in of_pad.windows(2).filter(|pair| pair[0][0].len() == pair[1][0].len()) {
            for (which, changes) in changes.iter_mut().enumerate() {
                let change = pair[0][which].iter().zip(&pair[1][which]).map(|(a, b)| (a - b).abs());
                changes.push(change.sum::<f64>() / pair[0][which].len().max(1) as f64);
            }
        }
        fingers += 1;
    }
    let [touched, untouched] = [median(changes[0].iter().copied())?, median(changes[1].iter().copied())?];
    (fingers > 0 && untouched > VARIES_LEVELS && touched < VARIES * untouched).then(|| {
        let figures = format!(
            "from pair to pair the untouched image changes by {untouched:.1} levels, the touched one by {touched:.1} (median of {})",
            counted(changes[0].len(), "comparison")
        );
        Doubt::stored(ReadAs::ImageSwapReference, &figures)
    })
}

/// Means of an image over blocks, channel by channel: without noise and markers.
fn blocks(image: &RgbGrid) -> Vec<f64> {
    bilinear_rgb(&area(image), 32, 24).as_slice().iter().flatten().map(|v| f64::from(*v)).collect()
}

/// Halved three times: bilinear alone would leave pixels out.
fn area(image: &RgbGrid) -> RgbGrid {
    (0..3).fold(image.clone(), |image, _| {
        let [width, height] = image.size();
        if width < 64 || height < 48 { image } else { bilinear_rgb(&image, width / 2, height / 2) }
    })
}

/// Images that lie otherwise than the light says, or are in other colors.
fn by_light(pairs: &[PairInput<'_>], faces: &[Face]) -> Option<Doubt> {
    // Only a GelSlim's light is known.
    let gelslims: Vec<&PairInput<'_>> = pairs.iter().filter(|pair| is_gelslim(&pair.sample.rig)).collect();
    let touches = gelslims.iter().flat_map(|pair| pair.sample.pads.entries());
    let touches: Vec<(PadId, &ColorTouch)> = touches.filter_map(|(pad, touch)| Some((pad, touch.color()?))).collect();
    let light = Light::of(touches.iter().map(|(pad, color)| (*pad, Cow::Borrowed(&color.difference))));
    if light.is_upright() {
        return None;
    }
    let red = median(faces.iter().map(|face| face.reference.median[0] - face.reference.median[2]))?;
    let laid = |light: &Light| match light.agreed()? {
        // Red and blue stand on either side, so that exchanging them mirrors the light; but a GelSlim's is blue.
        Turn { quarters: 2, mirrored: true } if red > 0.0 => Some(ReadAs::ImageBgr(Images::Both)),
        Turn { quarters: 2, mirrored: true } => Some(ReadAs::ImageLay(Lay::MirrorRows)),
        Turn { quarters: 0, mirrored: true } => Some(ReadAs::ImageLay(Lay::MirrorColumns)),
        // So does a negative turn it, and a GelSlim's light is no longer blue.
        Turn { quarters: 2, mirrored: false } if red > 0.0 => Some(ReadAs::ImageNegative),
        Turn { quarters: 2, mirrored: false } => Some(ReadAs::ImageLay(Lay::Turn)),
        _ => None,
    };
    let decoded = Colors::iter().map(|colors| (colors, Light::decoded(&touches, colors)));
    let decoded = decoded.filter(|(_, read)| read.is_upright() && read.consistency > light.consistency + CLEARER);
    if let Some((colors, read)) = decoded.max_by(|(_, a), (_, b)| a.consistency.total_cmp(&b.consistency)) {
        let figures = format!("read otherwise, by the light {}, as they are {}", read.upright(), light.upright());
        return Some(Doubt::stored(ReadAs::ImageColors(colors), &figures));
    }
    if let Some(read_as) = laid(&light) {
        return Some(Doubt::stored(read_as, &format!("by the light {}", light.upright())));
    }
    let rig = &gelslims.first()?.sample.rig;
    rig.pads().find_map(|pad| {
        let own = light.of_finger(pad);
        let read_as = laid(&own)?;
        let what =
            format!("of the {} finger alone {}: by the light {}", rig.pad_name(pad), read_as.mistake(), own.upright());
        Some(Doubt::new(Cause::Finger(Some(read_as)), what, "correct what writes that finger's files"))
    })
}

/// Turns in which some images lie, read from their light.
struct Light {
    /// Turns that are sure.
    turns: Vec<(PadId, Turn)>,
    /// Mean share of the gel's slopes without curl, where there is a touch to read.
    consistency: f64,
}

impl Light {
    fn of<'a>(differences: impl Iterator<Item = (PadId, Cow<'a, RgbGrid>)>) -> Self {
        let read = |(pad, image): (PadId, Cow<'_, RgbGrid>)| {
            Some((pad, upright::best(&bilinear_rgb(&area(&image), SIDE, SIDE))?))
        };
        let readings: Vec<_> = differences.filter_map(read).collect();
        let consistency = mean(readings.iter().map(|(_, reading)| reading.consistency)).unwrap_or(0.0);
        let turns = readings.into_iter().filter(|(_, reading)| reading.is_sure());
        Self { turns: turns.map(|(pad, reading)| (pad, reading.turn)).collect(), consistency }
    }

    /// The light of images in other colors than it is thought.
    fn decoded(touches: &[(PadId, &ColorTouch)], colors: Colors) -> Self {
        Self::of(touches.iter().filter_map(|(pad, color)| {
            let ColorImages { raw, reference } = color.images.as_ref()?;
            // A linear change of colors commutes with the mean over pixels; a hue does not, but changes little from pixel to pixel.
            let [raw, reference] = [raw, reference].map(|image| area(image).map(|pixel| colors.decoded(*pixel)));
            Some((*pad, Cow::Owned(ColorTouch::from_images(raw, reference)?.difference)))
        }))
    }

    fn of_finger(&self, pad: PadId) -> Self {
        Self { turns: self.turns.iter().filter(|(of, _)| *of == pad).copied().collect(), ..*self }
    }

    fn lie(&self, turn: Turn) -> usize {
        self.turns.iter().filter(|(_, of)| *of == turn).count()
    }

    /// The turn in which most images lie.
    fn agreed(&self) -> Option<Turn> {
        let best = Turn::all().max_by_key(|turn| self.lie(*turn))?;
        let agree = self.lie(best);
        (agree >= LIGHTS && agree as f64 >= LIGHTS_AGREE * self.turns.len() as f64).then_some(best)
    }

    fn is_upright(&self) -> bool {
        self.agreed() == Some(Turn::default())
    }

    fn upright(&self) -> String {
        format!("{} of {} lie upright", self.lie(Turn::default()), counted(self.turns.len(), "image"))
    }
}
