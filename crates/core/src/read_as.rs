//! [`ReadAs`]: data read otherwise than they are stored, because they were stored wrongly.
//!
//! Each undoes one mistake that files cannot show by themselves: fingers swapped, pictures mirrored, a sign, a factor,
//! the channels of an image, the untouched image in place of the touched one. They are applied to a loaded [`Sample`], in
//! order, so that everything that comes after sees what was felt.

use std::fmt;
use std::str::FromStr;

use super::grid::RgbGrid;
use super::mesh::Axes;
use super::sample::{ColorImages, ColorTouch, DepthTouch, PadTouch, Sample};
use super::turn::Turn;

/// Largest factor, and one over the smallest.
const MOST: f64 = 1e4;

/// Way in which a picture is laid down anew; each is its own inverse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Lay {
    /// Left becomes right.
    MirrorColumns,
    /// Up becomes down.
    MirrorRows,
    /// By 180 degrees.
    Turn,
}

impl Lay {
    /// Turn that lays it so.
    pub fn turn(self) -> Turn {
        match self {
            Self::MirrorColumns => Turn { quarters: 0, mirrored: true },
            Self::MirrorRows => Turn { quarters: 2, mirrored: true },
            Self::Turn => Turn { quarters: 2, mirrored: false },
        }
    }

    fn text(self) -> &'static str {
        match self {
            Self::MirrorColumns => "mirrored left to right",
            Self::MirrorRows => "mirrored top to bottom",
            Self::Turn => "turned by 180°",
        }
    }
}

/// Pictures of a depth sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depths {
    /// The imprints.
    Imprints,
    /// The imprints and the depths without contact.
    Whole,
}

/// Images of a color sensor: one of the two, or both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Images {
    /// The touched one.
    Touch,
    /// The untouched one.
    Reference,
    /// Both.
    Both,
}

/// Form of a difference that is stored in place of the touched image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Stored {
    /// As it is, with its sign.
    Signed,
    /// With gray added.
    Gray,
    /// In 8 bits without a sign: what is negative went on at 255.
    Wrapped,
}

/// Three numbers that stand for a pixel in place of red, green and blue, each on the scale 0..255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, strum::EnumIter, strum::EnumString, strum::IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub enum Colors {
    /// Green, blue, red.
    Gbr,
    /// Blue, red, green.
    Brg,
    /// Luma and both color differences of ITU-R BT.601 over the full range, as JPEG and Pillow have them.
    #[strum(serialize = "ycbcr")]
    YCbCr,
    /// The same in OpenCV's order.
    #[strum(serialize = "ycrcb")]
    YCrCb,
    /// Hue in steps of two degrees, as OpenCV has it, saturation and value.
    Hsv,
    /// Hue over 0..255, as Pillow has it, saturation and value.
    HsvFull,
}

impl Colors {
    /// Red, green and blue.
    pub fn decoded(self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Gbr => [c, a, b],
            Self::Brg => [b, c, a],
            Self::YCbCr => from_luma(a, b, c),
            Self::YCrCb => from_luma(a, c, b),
            Self::Hsv => from_hue(a / 30.0, b / 255.0, c),
            Self::HsvFull => from_hue(a * 6.0 / 256.0, b / 255.0, c),
        }
    }

    /// The bytes that a file in these colors holds.
    pub fn encoded(self, [r, g, b]: [f32; 3]) -> [f32; 3] {
        let value = r.max(g).max(b);
        let range = value - r.min(g).min(b);
        let sixth = match range {
            0.0 => 0.0,
            _ if value == r => ((g - b) / range).rem_euclid(6.0),
            _ if value == g => (b - r) / range + 2.0,
            _ => (r - g) / range + 4.0,
        };
        let saturation = if value > 0.0 { 255.0 * range / value } else { 0.0 };
        let luma = 0.299 * r + 0.587 * g + 0.114 * b;
        let [blue, red] = [128.0 + (b - luma) / 1.772, 128.0 + (r - luma) / 1.402];
        let stored = match self {
            Self::Gbr => [g, b, r],
            Self::Brg => [b, r, g],
            Self::YCbCr => [luma, blue, red],
            Self::YCrCb => [luma, red, blue],
            Self::Hsv => [(30.0 * sixth).round() % 180.0, saturation, value],
            Self::HsvFull => [(256.0 / 6.0 * sixth).round() % 256.0, saturation, value],
        };
        stored.map(|v| v.round().clamp(0.0, 255.0))
    }

    fn text(self) -> &'static str {
        match self {
            Self::Gbr => "in the order green, blue, red",
            Self::Brg => "in the order blue, red, green",
            Self::YCbCr => "in YCbCr",
            Self::YCrCb => "in YCrCb",
            Self::Hsv => "in HSV (OpenCV's)",
            Self::HsvFull => "in HSV (Pillow's)",
        }
    }
}

fn from_luma(y: f32, cb: f32, cr: f32) -> [f32; 3] {
    let (blue, red) = (cb - 128.0, cr - 128.0);
    [y + 1.402 * red, y - 0.344_136 * blue - 0.714_136 * red, y + 1.772 * blue]
}

/// From the sixth of the circle of colors, the saturation 0..1 and the value.
fn from_hue(sixth: f32, saturation: f32, value: f32) -> [f32; 3] {
    [5.0, 3.0, 1.0].map(|channel: f32| {
        let k = (channel + sixth).rem_euclid(6.0);
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    })
}

/// One way to read data otherwise than they are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReadAs {
    /// The fingers' depth pictures in each other's place.
    SwapFingers(Depths),
    /// The depth pictures laid down otherwise.
    Lay(Depths, Lay),
    /// The depths times a factor.
    Scale(Depths, f64),
    /// The depth cameras' focal lengths and centers times a factor.
    ScaleCamera(f64),
    /// The CAD models with other axes.
    CadAxes(Axes),
    /// The true angle with the other sign.
    NegateTheta,
    /// The fingers' color images in each other's place.
    ImageSwapFingers,
    /// The color images laid down otherwise.
    ImageLay(Lay),
    /// Red and blue in each other's place.
    ImageBgr(Images),
    /// The images times 255.
    Image255(Images),
    /// Both images in these colors.
    ImageColors(Colors),
    /// 255 minus the images.
    ImageNegative,
    /// The touched and the untouched image in each other's place.
    ImageSwapReference,
    /// The touched image as the difference.
    ImageIsDifference(Stored),
    /// The difference of 8-bit images that wrapped around: brought back to -128..127.
    ImageUnwrap,
}

impl fmt::Display for ReadAs {
    /// The key.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = |depths: Depths| if depths == Depths::Whole { "whole-" } else { "" };
        match *self {
            Self::SwapFingers(depths) => write!(f, "{}swap-fingers", whole(depths)),
            Self::Lay(depths, lay) => write!(f, "{}{}", whole(depths), <&str>::from(lay)),
            Self::Scale(depths, factor) => write!(f, "{}scale-depth={factor}", whole(depths)),
            Self::ScaleCamera(factor) => write!(f, "scale-camera={factor}"),
            Self::CadAxes(axes) => write!(f, "cad-axes={axes}"),
            Self::NegateTheta => f.write_str("negate-theta"),
            Self::ImageSwapFingers => f.write_str("image-swap-fingers"),
            Self::ImageLay(lay) => write!(f, "image-{}", <&str>::from(lay)),
            Self::ImageBgr(images) => write!(f, "image-bgr={}", <&str>::from(images)),
            Self::Image255(images) => write!(f, "image-255={}", <&str>::from(images)),
            Self::ImageColors(colors) => write!(f, "image-colors={}", <&str>::from(colors)),
            Self::ImageNegative => f.write_str("image-negative"),
            Self::ImageSwapReference => f.write_str("image-swap-reference"),
            Self::ImageIsDifference(stored) => write!(f, "image-is-difference={}", <&str>::from(stored)),
            Self::ImageUnwrap => f.write_str("image-unwrap"),
        }
    }
}

/// The keys, for people.
pub(crate) const KEYS: &str = "swap-fingers, mirror-columns, mirror-rows, turn, scale-depth=FACTOR (each also as whole-..., which \
                        includes the depth without contact), scale-camera=FACTOR, cad-axes= (which axes of the files are x, y and z, as in x-zy), negate-theta, image-swap-fingers, \
                        image-mirror-columns, image-mirror-rows, image-turn, image-negative, image-swap-reference, image-unwrap, \
                        image-bgr=, image-255= (touch, reference or both), image-is-difference= (signed, gray or wrapped), image-colors= (gbr, brg, ycbcr, \
                        ycrcb, hsv or hsv-full)";

impl FromStr for ReadAs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = || format!("unknown way to read data {:?}; choose from {KEYS}", clip(text));
        let (key, value) = text.split_once('=').map_or((text, None), |(key, value)| (key, Some(value)));
        let (bare, depths) = key.strip_prefix("whole-").map_or((key, Depths::Imprints), |bare| (bare, Depths::Whole));
        let factor = || {
            let factor = value.and_then(|value| value.parse::<f64>().ok());
            let factor = factor.filter(|f| (1.0 / MOST..=MOST).contains(f) || (*f == -1.0 && bare == "scale-depth"));
            factor.ok_or_else(|| format!("{:?} takes a factor from {} to {MOST}", clip(text), 1.0 / MOST))
        };
        let images = || value.map_or(Ok(Images::Both), |value| value.parse().map_err(|_| unknown()));
        Ok(match (bare, value) {
            ("swap-fingers", None) => Self::SwapFingers(depths),
            ("scale-depth", _) => Self::Scale(depths, factor()?),
            ("scale-camera", _) if bare == key => Self::ScaleCamera(factor()?),
            ("cad-axes", Some(axes)) if bare == key => Self::CadAxes(axes.parse().map_err(|()| unknown())?),
            ("negate-theta", None) if bare == key => Self::NegateTheta,
            ("image-swap-fingers", None) if bare == key => Self::ImageSwapFingers,
            ("image-negative", None) if bare == key => Self::ImageNegative,
            ("image-swap-reference", None) if bare == key => Self::ImageSwapReference,
            ("image-unwrap", None) if bare == key => Self::ImageUnwrap,
            ("image-bgr", _) if bare == key => Self::ImageBgr(images()?),
            ("image-255", _) if bare == key => Self::Image255(images()?),
            ("image-colors", Some(colors)) if bare == key => Self::ImageColors(colors.parse().map_err(|_| unknown())?),
            ("image-is-difference", Some(stored)) if bare == key => {
                Self::ImageIsDifference(stored.parse().map_err(|_| unknown())?)
            }
            (lay, None) => match lay.strip_prefix("image-").filter(|_| bare == key) {
                Some(lay) => Self::ImageLay(lay.parse().map_err(|_| unknown())?),
                None => Self::Lay(depths, lay.parse().map_err(|_| unknown())?),
            },
            _ => return Err(unknown()),
        })
    }
}

/// Several keys, with commas or spaces between them.
///
/// # Errors
/// The first that is none.
pub fn parse_list(text: &str) -> Result<Vec<ReadAs>, String> {
    let keys = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|key| !key.is_empty());
    keys.map(str::parse).collect()
}

/// Readings after `more` is added to those known: what is its own opposite ends instead.
pub fn also(known: &[ReadAs], more: ReadAs) -> Vec<ReadAs> {
    let own_opposite = !matches!(
        more,
        ReadAs::Scale(..)
            | ReadAs::ScaleCamera(_)
            | ReadAs::CadAxes(_)
            | ReadAs::Image255(_)
            | ReadAs::ImageColors(_)
            | ReadAs::ImageIsDifference(_)
            | ReadAs::ImageUnwrap
    );
    let mut all = known.to_vec();
    match known.iter().rposition(|one| own_opposite && *one == more) {
        Some(index) => drop(all.remove(index)),
        None => all.push(more),
    }
    all
}

/// Several keys as [`parse_list`] reads them.
pub fn list(read_as: &[ReadAs]) -> String {
    read_as.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

fn clip(text: &str) -> String {
    text.chars().take(60).collect()
}

impl ReadAs {
    /// Fault of data that must be read so, in words.
    pub fn mistake(self) -> String {
        let imprints = |depths: Depths| match depths {
            Depths::Imprints => "the imprints",
            Depths::Whole => "the imprints with their depths without contact",
        };
        let images = |images: Images| match images {
            Images::Touch => "the touched images alone",
            Images::Reference => "the untouched images alone",
            Images::Both => "the color images",
        };
        match self {
            Self::SwapFingers(depths) => format!("{} of the fingers are swapped", imprints(depths)),
            Self::Lay(depths, lay) => format!("{} are {}", imprints(depths), lay.text()),
            Self::Scale(depths, factor) if factor < 0.0 => format!("{} have the other sign", imprints(depths)),
            Self::Scale(depths, factor) => format!("{} are {} times too large", imprints(depths), 1.0 / factor),
            Self::ScaleCamera(factor) => format!("the camera matrices are {} times too large", 1.0 / factor),
            Self::CadAxes(axes) => format!("the CAD models have other axes ({axes} instead of xyz)"),
            Self::NegateTheta => "theta has the other sign".into(),
            Self::ImageSwapFingers => "the color images of the fingers are swapped".into(),
            Self::ImageLay(lay) => format!("the color images are {}", lay.text()),
            Self::ImageBgr(which) => format!("{} are in the order blue, green, red", images(which)),
            Self::Image255(which) => format!("{} are on the scale 0..1", images(which)),
            Self::ImageColors(colors) => format!("the color images are {}", colors.text()),
            Self::ImageNegative => "the color images are negatives".into(),
            Self::ImageSwapReference => "touched and untouched images are swapped".into(),
            Self::ImageIsDifference(stored) => {
                let how = match stored {
                    Stored::Signed => "with their sign",
                    Stored::Gray => "with gray added",
                    Stored::Wrapped => "in 8 bits without a sign",
                };
                format!("differences are stored as touched images, {how}")
            }
            Self::ImageUnwrap => "images were stored in too few bits and wrapped around".into(),
        }
    }

    /// Reads a sample so. What it does not have stays absent; CAD models are none of it.
    pub fn apply(self, sample: &mut Sample) {
        match self {
            Self::SwapFingers(depths) => swap_depths(sample, depths),
            Self::Lay(depths, lay) => each_depth(sample, |touch| {
                touch.imprint = lay.turn().apply(&touch.imprint);
                if let (Depths::Whole, Some(camera)) = (depths, &mut touch.camera) {
                    camera.depth_reference = lay.turn().apply(&camera.depth_reference);
                }
            }),
            Self::Scale(depths, factor) => each_depth(sample, |touch| {
                let scaled = |d: &f32| (f64::from(*d) * factor) as f32;
                touch.imprint = touch.imprint.map(scaled);
                if let (Depths::Whole, Some(camera)) = (depths, &mut touch.camera) {
                    camera.depth_reference = camera.depth_reference.map(scaled);
                }
            }),
            Self::ScaleCamera(factor) => each_depth(sample, |touch| {
                if let Some(k) = touch.camera.as_mut().map(|camera| &mut camera.intrinsics) {
                    for number in [&mut k.fx, &mut k.fy, &mut k.cx, &mut k.cy] {
                        *number *= factor;
                    }
                }
            }),
            Self::CadAxes(_) => {}
            Self::NegateTheta => {
                // The lab stores the angle and place of the inverse: its place stays.
                sample.grasp_from_object = sample.grasp_from_object.map(|pose| {
                    let mut stored = pose.inverse();
                    stored.theta_rad = -stored.theta_rad;
                    stored.inverse()
                });
            }
            Self::ImageSwapFingers => {
                let colors: Vec<_> = sample.pads.iter().map(|touch| touch.as_ref()?.color().cloned()).collect();
                if let [Some(_), Some(_)] = &colors[..] {
                    for (touch, color) in sample.pads.iter_mut().zip(colors.into_iter().rev()) {
                        if let (Some(touch), Some(color)) = (touch.as_mut().and_then(PadTouch::color_mut), color) {
                            *touch = color;
                        }
                    }
                }
            }
            Self::ImageLay(lay) => each_color(sample, |touch| {
                touch.difference = lay.turn().apply(&touch.difference);
                if let Some(images) = &mut touch.images {
                    images.raw = lay.turn().apply(&images.raw);
                    images.reference = lay.turn().apply(&images.reference);
                }
            }),
            Self::ImageBgr(which) => of_images(sample, which, |pixel| pixel.swap(0, 2)),
            Self::Image255(which) => of_images(sample, which, |pixel| pixel.iter_mut().for_each(|v| *v *= 255.0)),
            // A difference by itself does not say what it is the difference of.
            Self::ImageColors(colors) => each_color(sample, |touch| {
                let Some(images) = &touch.images else { return };
                let [raw, reference] =
                    [&images.raw, &images.reference].map(|image| image.map(|pixel| colors.decoded(*pixel)));
                if let Some(read) = ColorTouch::from_images(raw, reference) {
                    *touch = read;
                }
            }),
            Self::ImageNegative => each_color(sample, |touch| {
                let negative = |pixel: &mut [f32; 3]| pixel.iter_mut().for_each(|v| *v = 255.0 - *v);
                if let Some(ColorImages { raw, reference }) = &mut touch.images {
                    raw.as_mut_slice().iter_mut().chain(reference.as_mut_slice()).for_each(negative);
                }
                touch.difference = touch.difference.map(|p| p.map(|v| -v));
            }),
            Self::ImageSwapReference => each_color(sample, |touch| {
                if let Some(ColorImages { raw, reference }) = &mut touch.images {
                    std::mem::swap(raw, reference);
                }
                touch.difference = touch.difference.map(|p| p.map(|v| -v));
            }),
            Self::ImageIsDifference(stored) => each_color(sample, |touch| {
                let Some(images) = touch.images.take() else { return };
                touch.difference = images.raw.map(|pixel| {
                    pixel.map(|v| match stored {
                        Stored::Signed => v,
                        Stored::Gray => v - 128.0,
                        Stored::Wrapped => wrapped(v),
                    })
                });
            }),
            Self::ImageUnwrap => each_color(sample, |touch| {
                touch.difference = touch.difference.map(|pixel| pixel.map(wrapped));
                // The touched image that gives this difference.
                if let Some(ColorImages { raw, reference }) = &mut touch.images {
                    *reference = reference.map(|pixel| pixel.map(|v| v.rem_euclid(256.0)));
                    raw.clone_from(reference);
                    raw.add(&touch.difference);
                }
            }),
        }
    }

    /// A sample read in all these ways, one after the other.
    #[must_use]
    pub fn all(read_as: &[Self], sample: &Sample) -> Sample {
        let mut sample = sample.clone();
        read_as.iter().for_each(|one| one.apply(&mut sample));
        sample
    }
}

/// The value modulo 256 that is nearest to 0.
fn wrapped(v: f32) -> f32 {
    (v + 128.0).rem_euclid(256.0) - 128.0
}

fn each_depth(sample: &mut Sample, change: impl Fn(&mut DepthTouch)) {
    for touch in sample.pads.iter_mut().flatten().filter_map(PadTouch::depth_mut) {
        change(touch);
        // It was known of what is stored.
        touch.truth = None;
    }
}

fn each_color(sample: &mut Sample, change: impl Fn(&mut ColorTouch)) {
    sample.pads.iter_mut().flatten().filter_map(PadTouch::color_mut).for_each(change);
}

/// Changes the pixels of one or both images, or those of the difference where there is nothing else.
fn of_images(sample: &mut Sample, which: Images, change: impl Fn(&mut [f32; 3])) {
    each_color(sample, |touch| {
        let all = |image: &mut RgbGrid| image.as_mut_slice().iter_mut().for_each(&change);
        let Some(ColorImages { raw, reference }) = &mut touch.images else {
            if which == Images::Both {
                all(&mut touch.difference);
            }
            return;
        };
        if which != Images::Reference {
            all(raw);
        }
        if which != Images::Touch {
            all(reference);
        }
        touch.difference = reference.map(|p| p.map(|v| -v));
        touch.difference.add(raw);
    });
}

/// Exchanges the depth pictures of the two fingers; cameras stay where they are.
fn swap_depths(sample: &mut Sample, depths: Depths) {
    let felt: Vec<Option<DepthTouch>> =
        sample.pads.iter().map(|touch| touch.as_ref().and_then(PadTouch::depth).cloned()).collect();
    let [Some(right), Some(left)] = &felt[..] else { return };
    for (touch, other) in sample.pads.iter_mut().flatten().filter_map(PadTouch::depth_mut).zip([left, right]) {
        touch.imprint = other.imprint.clone();
        touch.truth = None;
        if let (Depths::Whole, Some(camera), Some(others)) = (depths, &mut touch.camera, &other.camera) {
            camera.depth_reference = others.depth_reference.clone();
        }
    }
}

#[cfg(test)]
mod tests {
    use strum::IntoEnumIterator as _;

    use super::*;
    use crate::catalog::tools;
    use crate::rig::lab;
    use crate::sim::{Grasp, SimConfig, simulate};

    fn all() -> Vec<ReadAs> {
        let mut all = vec![ReadAs::NegateTheta, ReadAs::ScaleCamera(1.25), ReadAs::ImageUnwrap];
        for depths in [Depths::Imprints, Depths::Whole] {
            all.extend([ReadAs::SwapFingers(depths), ReadAs::Scale(depths, 0.5)]);
            all.extend(Lay::iter().map(|lay| ReadAs::Lay(depths, lay)));
        }
        all.extend([ReadAs::ImageSwapFingers, ReadAs::ImageSwapReference]);
        all.extend(Lay::iter().map(ReadAs::ImageLay));
        all.extend([Images::Touch, Images::Reference, Images::Both].map(ReadAs::ImageBgr));
        all.extend([Images::Touch, Images::Reference, Images::Both].map(ReadAs::Image255));
        all.extend([Stored::Signed, Stored::Gray, Stored::Wrapped].map(ReadAs::ImageIsDifference));
        all.extend(Colors::iter().map(ReadAs::ImageColors));
        all
    }

    #[test]
    fn colors_come_back_from_what_a_file_in_others_holds() {
        // By OpenCV 4.10 and Pillow 11.
        assert_eq!(Colors::Hsv.encoded([30.0, 90.0, 200.0]), [109.0, 217.0, 200.0]);
        assert_eq!(Colors::YCrCb.encoded([30.0, 90.0, 200.0]), [85.0, 89.0, 193.0]);
        for pixel in
            [[30.0, 90.0, 200.0], [200.0, 30.0, 90.0], [90.0, 200.0, 30.0], [128.0; 3], [0.0; 3], [255.0, 0.0, 0.0]]
        {
            for colors in Colors::iter() {
                let back = colors.decoded(colors.encoded(pixel));
                let off = pixel.iter().zip(back).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
                assert!(off < 5.0, "{colors:?}: {pixel:?} became {back:?}");
            }
        }
    }

    #[test]
    fn what_is_written_is_read_and_nothing_else_is() {
        for read_as in all() {
            assert!(
                KEYS.contains(read_as.to_string().trim_start_matches("whole-").split('=').next().unwrap()),
                "{read_as}"
            );
            assert!(!read_as.mistake().is_empty());
        }
        all()
            .into_iter()
            .chain(Axes::others().map(ReadAs::CadAxes))
            .for_each(|each| assert_eq!(each.to_string().parse(), Ok(each)));
        assert_eq!(parse_list(&list(&all())), Ok(all()));
        assert_eq!(parse_list(" \n"), Ok(Vec::new()));
        for wrong in [
            "swap",
            "whole-negate-theta",
            "scale-depth",
            "scale-depth=0",
            "scale-depth=NaN",
            "scale-camera=1e9",
            "turn=1",
            "cad-axes=xyy",
            "image-",
        ] {
            assert!(wrong.parse::<ReadAs>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_its_own_opposite_ends_what_was_said_before() {
        let swap = ReadAs::SwapFingers(Depths::Imprints);
        assert_eq!(also(&[swap, ReadAs::NegateTheta], swap), [ReadAs::NegateTheta]);
        let half = ReadAs::Scale(Depths::Imprints, 0.5);
        assert_eq!(also(&[half], half), [half, half]);
    }

    /// Numbers of a sample that can be compared.
    fn felt(sample: &Sample) -> Vec<f32> {
        let mut all = vec![sample.grasp_from_object.unwrap().theta_rad as f32];
        for touch in sample.pads.iter().flatten() {
            all.extend(touch.color().unwrap().difference.as_slice().iter().flatten());
            let depth = touch.depth().unwrap();
            let camera = depth.camera.as_ref().unwrap();
            all.extend(depth.imprint.as_slice().iter().chain(camera.depth_reference.as_slice()));
            all.push(camera.intrinsics.fx as f32);
        }
        all
    }

    #[test]
    fn each_changes_something_and_mistakes_are_undone() {
        let grasp = Grasp { theta_rad: 0.2, x_m: 0.002, y_m: -0.001 };
        let sample = simulate(&tools()[1], grasp, 1, &SimConfig::default());
        for read_as in all().into_iter().filter(|read_as| *read_as != ReadAs::ImageUnwrap) {
            let once = ReadAs::all(&[read_as], &sample);
            assert_ne!(felt(&once), felt(&sample), "{read_as}");
            if also(&[read_as], read_as).is_empty() {
                assert_eq!(felt(&ReadAs::all(&[read_as], &once)), felt(&sample), "{read_as}");
            }
        }
        let twice = ReadAs::all(&[ReadAs::ScaleCamera(0.8), ReadAs::ScaleCamera(1.25)], &sample);
        assert_eq!(felt(&twice), felt(&sample));
        // Images in 8 bits with a sign: the difference comes back.
        let mut wrong = sample.clone();
        each_color(&mut wrong, |touch| {
            let images = touch.images.clone().unwrap();
            let [raw, reference] = [images.raw, images.reference].map(|image| image.map(|pixel| pixel.map(wrapped)));
            *touch = ColorTouch::from_images(raw, reference).unwrap();
        });
        assert_ne!(felt(&wrong), felt(&sample));
        assert_eq!(felt(&ReadAs::all(&[ReadAs::ImageUnwrap], &wrong)), felt(&sample));
        // The place of the grasp stays where the sign of its angle changes.
        let stored = ReadAs::all(&[ReadAs::NegateTheta], &sample).grasp_from_object.unwrap().inverse();
        let before = sample.grasp_from_object.unwrap().inverse();
        assert!((stored.y_m - before.y_m).abs() < 1e-12 && (stored.theta_rad + before.theta_rad).abs() < 1e-12);
        // What is not there stays so.
        let nothing = Sample::default();
        all().iter().for_each(|read_as| assert!(ReadAs::all(&[*read_as], &nothing).pads.is_empty()));
        assert!(sample.pad(lab::LEFT).unwrap().depth().unwrap().truth.is_some());
    }
}
