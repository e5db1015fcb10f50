//! Pictures on the graphics card, made again only when what they show changed.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use eframe::egui::{Color32, ColorImage, Context, TextureHandle, TextureId, TextureOptions};

use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::grid::{DepthMap, Mask};
use touch2touch_core::label::{Rect, difference};
use touch2touch_core::picture::{self, Rgb8};

/// Bars in a histogram.
pub(crate) const BINS: usize = 64;

/// Number of values in each of [`BINS`] equal parts of a span.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Counts, from the lower end to the upper.
    pub counts: [u32; BINS],
    /// The span, in the unit of the data.
    pub span: Range,
}

impl Histogram {
    /// The span without the outermost half percent on each side, in the unit of the data: single flying pixels say nothing.
    pub(crate) fn bulk(&self) -> Range {
        let total: u32 = self.counts.iter().sum();
        let (cut, width) = (total / 200, (self.span.hi - self.span.lo) / BINS as f32);
        let bins_cut = |counts: &mut dyn Iterator<Item = &u32>| {
            let mut seen = 0;
            counts
                .take_while(|n| {
                    seen += **n;
                    seen <= cut
                })
                .count() as f32
        };
        let (lo, hi) = (bins_cut(&mut self.counts.iter()), bins_cut(&mut self.counts.iter().rev()));
        Range { lo: self.span.lo + lo * width, hi: self.span.hi - hi * width }
    }

    /// Of all finite values; `None` without one.
    pub fn of(values: &[f32]) -> Option<Self> {
        let span = Range::of(values)?;
        let mut counts = [0; BINS];
        for v in values.iter().filter(|v| v.is_finite()) {
            let bin = (span.unit(*v) * BINS as f32) as usize;
            counts[bin.min(BINS - 1)] += 1;
        }
        Some(Self { counts, span })
    }
}

/// A picture on the graphics card with what belongs to it.
pub struct Picture {
    /// The texture.
    pub texture: TextureHandle,
    /// Of the values, where the picture is of values.
    pub histogram: Option<Histogram>,
    key: u64,
    used: u64,
}

/// All pictures, one per slot.
#[derive(Default)]
pub struct Textures {
    slots: BTreeMap<u64, Picture>,
    frame: u64,
    masks: BTreeMap<u64, MaskPicture>,
    /// Uploads since the start: tests hold on to it that an idle frame uploads nothing.
    pub uploads: u64,
    /// Pixels of masks uploaded since the start.
    pub uploaded_px: usize,
}

/// A mask on the graphics card.
struct MaskPicture {
    texture: TextureHandle,
    /// Mask that is on the card.
    mask: Arc<Mask>,
    key: u64,
    used: u64,
}

impl Textures {
    /// Starts a frame: pictures that were not shown for a while are dropped.
    pub(crate) fn begin_frame(&mut self) {
        self.frame += 1;
        let frame = self.frame;
        self.slots.retain(|_, picture| picture.used + 120 > frame);
        self.masks.retain(|_, picture| picture.used + 120 > frame);
    }

    /// The picture in `slot`; made with `make` if `key` (the recipe of what it shows) or `nearest` changed.
    pub fn get(
        &mut self,
        ctx: &Context,
        slot: impl Hash,
        key: impl Hash,
        nearest: bool,
        make: impl FnOnce() -> (ColorImage, Option<Histogram>),
    ) -> &Picture {
        let (slot, key) = (hash(slot), hash((key, nearest)));
        let options = if nearest { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
        let picture = match self.slots.remove(&slot) {
            Some(picture) if picture.key == key => picture,
            old => {
                self.uploads += 1;
                let (image, histogram) = make();
                let texture = match old {
                    Some(Picture { mut texture, .. }) => {
                        texture.set(image, options);
                        texture
                    }
                    None => ctx.load_texture("picture", image, options),
                };
                Picture { texture, histogram, key, used: self.frame }
            }
        };
        self.slots.entry(slot).or_insert(Picture { used: self.frame, ..picture })
    }

    /// A mask as a white layer in `slot`: where one of the same size was there before, only the rectangle in which they
    /// differ is uploaded. A stroke costs what it touches.
    pub fn mask(&mut self, ctx: &Context, slot: impl Hash, key: impl Hash, mask: &Arc<Mask>) -> TextureId {
        let (slot, key) = (hash(slot), hash(key));
        let frame = self.frame;
        let options = TextureOptions::NEAREST;
        let held = self.masks.entry(slot).or_insert_with(|| {
            self.uploads += 1;
            self.uploaded_px += mask.len();
            let texture = ctx.load_texture("mask", mask_image(mask), options);
            MaskPicture { texture, mask: mask.clone(), key, used: frame }
        });
        held.used = frame;
        if held.key != key {
            held.key = key;
            if held.mask.size() != mask.size() {
                self.uploads += 1;
                self.uploaded_px += mask.len();
                held.texture.set(mask_image(mask), options);
            } else if let Some(Rect { x, y, width, height }) = difference(&held.mask, mask) {
                self.uploads += 1;
                self.uploaded_px += width * height;
                let part = Mask::from_fn(width, height, |dx, dy| mask[(x + dx, y + dy)]);
                held.texture.set_partial([x, y], mask_image(&part), options);
            }
            held.mask = mask.clone();
        }
        held.texture.id()
    }

    /// The picture in `slot` as it is: the one before, while the next is being made.
    pub fn last(&mut self, slot: impl Hash) -> Option<&Picture> {
        let frame = self.frame;
        let picture = self.slots.get_mut(&hash(slot))?;
        picture.used = frame;
        Some(picture)
    }
}

/// Things derived from what is shown, made again only when that changed.
#[derive(Debug)]
pub(crate) struct Memo<V> {
    slots: BTreeMap<u64, (u64, V)>,
}

impl<V> Default for Memo<V> {
    fn default() -> Self {
        Self { slots: BTreeMap::new() }
    }
}

impl<V> Memo<V> {
    /// The thing in `slot`; made with `make` if `key` changed.
    pub(crate) fn get(&mut self, slot: impl Hash, key: impl Hash, make: impl FnOnce() -> V) -> &V {
        let (slot, key) = (hash(slot), hash(key));
        if self.slots.get(&slot).is_none_or(|(held, _)| *held != key) {
            self.slots.insert(slot, (key, make()));
        }
        &self.slots[&slot].1
    }
}

fn hash(value: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}

/// A depth map through a color map.
pub(crate) fn depth_image(depth: &DepthMap, map: ColorMap, range: Range) -> ColorImage {
    picture_image(&picture::colored(depth, map, range))
}

/// A picture as the graphics card takes it.
pub(crate) fn picture_image(picture: &Rgb8) -> ColorImage {
    ColorImage::new(picture.size(), picture.as_slice().iter().map(|[r, g, b]| Color32::from_rgb(*r, *g, *b)).collect())
}

/// A mask as a transparent layer.
pub(crate) fn mask_image(mask: &Mask) -> ColorImage {
    let pixel = |on: &bool| if *on { Color32::WHITE } else { Color32::TRANSPARENT };
    ColorImage::new(mask.size(), mask.as_slice().iter().map(pixel).collect())
}

/// The sides of pixels between mask and background, as segments in pixel coordinates with (0, 0) at the *corner* of
/// the top-left pixel. Runs along a row or column are one segment.
///
/// It is made anew at every move of a stroke: what is like the row above costs no more than comparing the two.
pub fn outline(mask: &Mask) -> Vec<[[f32; 2]; 2]> {
    let [w, h] = mask.size();
    let none = vec![false; w];
    let row = |y: usize| if y < h { mask.row(y) } else { none.as_slice() };
    let mut segments = Vec::new();
    // Where the sides along each column began that are still going on.
    let mut begun: Vec<Option<usize>> = vec![None; w + 1];
    let mut above = none.as_slice();
    for y in 0..=h {
        let here = row(y);
        let differs = |x: &usize| above[*x] != here[*x];
        if let Some(first) = (0..w).find(differs) {
            let last = (first..w).rfind(differs).unwrap_or(first);
            // Sides along the row, each as long as what differs.
            let mut start = None;
            for x in first..=last + 1 {
                match (x <= last && differs(&x), start) {
                    (true, None) => start = Some(x),
                    (false, Some(from)) => {
                        segments.push([[from as f32, y as f32], [x as f32, y as f32]]);
                        start = None;
                    }
                    _ => {}
                }
            }
            // Sides along columns begin and end only there.
            let on = |x: usize| here.get(x).is_some_and(|on| *on);
            for (x, begun) in begun.iter_mut().enumerate().take(last + 2).skip(first) {
                let edge = (x > 0 && on(x - 1)) != on(x);
                match (edge, *begun) {
                    (true, None) => *begun = Some(y),
                    (false, Some(from)) => {
                        segments.push([[x as f32, from as f32], [x as f32, y as f32]]);
                        *begun = None;
                    }
                    _ => {}
                }
            }
        }
        above = here;
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flying_pixels_do_not_widen_the_bulk() {
        let mut values: Vec<f32> = (0..1000u16).map(|i| 0.004 + f32::from(i) * 1e-6).collect();
        values.extend([0.1; 3]);
        let histogram = Histogram::of(&values).unwrap();
        let (bulk, bin) = (histogram.bulk(), 0.096 / BINS as f32);
        assert!(bulk.lo == 0.004 && bulk.hi <= 0.005 + bin + 1e-6, "{bulk:?}");
        let even: Vec<f32> = (0..10_000u16).map(f32::from).collect();
        let bulk = Histogram::of(&even).unwrap().bulk();
        assert!(bulk.lo <= 200.0 && bulk.hi >= 9_800.0, "{bulk:?}");
        let one = Histogram::of(&[0.5]).unwrap().bulk();
        assert!(one.lo.is_finite() && one.hi.is_finite());
    }

    #[test]
    fn a_picture_is_uploaded_only_when_it_changed() {
        let ctx = Context::default();
        let mut textures = Textures::default();
        let make = || (ColorImage::filled([2, 2], Color32::RED), None);
        for _ in 0..3 {
            textures.begin_frame();
            textures.get(&ctx, "a", 1, true, make);
        }
        assert_eq!(textures.uploads, 1);
        textures.get(&ctx, "a", 2, true, make);
        textures.get(&ctx, "b", 2, true, make);
        assert_eq!(textures.uploads, 3);
    }

    #[test]
    fn of_a_changed_mask_only_what_differs_is_uploaded() {
        let (ctx, mut textures) = (Context::default(), Textures::default());
        let before = Arc::new(Mask::filled(40, 30, false));
        textures.mask(&ctx, "a", 1, &before);
        assert_eq!(textures.uploaded_px, 40 * 30);
        let mut after = (*before).clone();
        (after[(7, 9)], after[(9, 12)]) = (true, true);
        let after = Arc::new(after);
        textures.mask(&ctx, "a", 2, &after);
        textures.mask(&ctx, "a", 2, &after);
        textures.mask(&ctx, "a", 3, &after);
        assert_eq!((textures.uploads, textures.uploaded_px), (2, 40 * 30 + 3 * 4));
        textures.mask(&ctx, "a", 4, &Arc::new(Mask::filled(9, 9, true)));
        assert_eq!((textures.uploads, textures.uploaded_px), (3, 40 * 30 + 3 * 4 + 81));
    }

    #[test]
    fn the_outline_of_one_pixel_has_four_sides() {
        let mut mask = Mask::filled(3, 3, false);
        mask[(1, 1)] = true;
        let sides = outline(&mask);
        assert_eq!(sides.len(), 4);
        assert!(sides.contains(&[[1.0, 1.0], [2.0, 1.0]]) && sides.contains(&[[2.0, 1.0], [2.0, 2.0]]));
        assert_eq!(outline(&Mask::filled(4, 2, true)).len(), 4);
        assert!(outline(&Mask::filled(0, 0, true)).is_empty());
    }

    #[test]
    fn an_outline_has_a_side_wherever_neighbors_differ() {
        // A ring that touches the edge, and every kind of corner.
        let ragged = Mask::from_fn(37, 23, |x, y| (x * 7 + y * 11) % 5 < 2 || (x > 20 && y > 3 && x + y != 31));
        let mut sides: Vec<[[i32; 2]; 2]> = Vec::new();
        for [[ax, ay], [bx, by]] in outline(&ragged) {
            let (dx, dy) = (((bx - ax) as i32).signum(), ((by - ay) as i32).signum());
            assert!(dx + dy == 1 && dx * dy == 0, "along a row or a column");
            let length = (bx - ax + by - ay) as i32;
            sides.extend((0..length).map(|i| {
                let from = [ax as i32 + i * dx, ay as i32 + i * dy];
                [from, [from[0] + dx, from[1] + dy]]
            }));
        }
        sides.sort_unstable();
        let on = |x: i32, y: i32| x >= 0 && y >= 0 && ragged.get(x as usize, y as usize).is_some_and(|on| *on);
        let mut expected: Vec<[[i32; 2]; 2]> = Vec::new();
        for (y, x) in (0..=23).flat_map(|y| (0..=37).map(move |x| (y, x))) {
            expected.extend((on(x, y - 1) != on(x, y)).then_some([[x, y], [x + 1, y]]));
            expected.extend((on(x - 1, y) != on(x, y)).then_some([[x, y], [x, y + 1]]));
        }
        expected.sort_unstable();
        assert_eq!(sides, expected);
    }

    #[test]
    fn histograms_count_finite_values_only() {
        let h = Histogram::of(&[0.0, f32::NAN, 1.0, 1.0, f32::INFINITY]).unwrap();
        assert_eq!((h.counts[0], h.counts[BINS - 1]), (1, 2));
        assert_eq!(Histogram::of(&[f32::NAN]), None);
    }
}
