//! [`Marks`]: what stands behind the pixels of a corrected mask.

use super::Rect;
use super::paint::Paint;
use super::provenance::Provenance;
use crate::grid::{Grid, Mask};

/// Marks of the pixels of a corrected mask: where the value of each comes from, and which are *ignored*, so that they
/// count neither as contact nor as free of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Marks {
    /// Each provenance once; the first is what the correction began from.
    layers: Vec<Provenance>,
    /// The layer of each pixel, as large as the mask.
    of: Grid<u8>,
    /// `None`: no pixel is ignored.
    ignored: Option<Mask>,
}

/// Layers that the index of a pixel can tell apart.
const MOST_LAYERS: usize = 256;

impl Marks {
    /// Marks of a mask whose pixels are all of one provenance; none is ignored.
    pub fn all([width, height]: [usize; 2], provenance: Provenance) -> Self {
        Self { layers: vec![provenance], of: Grid::filled(width, height, 0), ignored: None }
    }

    /// Puts marks together; `None` if the sizes differ or a pixel names a layer that is not there.
    pub(super) fn from_parts(layers: Vec<Provenance>, of: Grid<u8>, ignored: Option<Mask>) -> Option<Self> {
        let known = layers.len() <= MOST_LAYERS && of.as_slice().iter().all(|&i| usize::from(i) < layers.len());
        let fits = ignored.as_ref().is_none_or(|ignored| ignored.size() == of.size());
        (known && fits).then_some(Self { layers, of, ignored })
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.of.size()
    }

    /// Provenance that the correction began from.
    pub fn base(&self) -> &Provenance {
        &self.layers[0]
    }

    /// Provenance of a pixel's value; `None` outside.
    pub fn at(&self, x: usize, y: usize) -> Option<&Provenance> {
        self.layers.get(usize::from(*self.of.get(x, y)?))
    }

    /// The layers with the number of pixels that each one decided, in the order in which they came; the first may have
    /// none left.
    pub fn layers(&self) -> Vec<(&Provenance, usize)> {
        let mut counts = vec![0; self.layers.len()];
        self.of.as_slice().iter().for_each(|&i| counts[usize::from(i)] += 1);
        self.layers.iter().zip(counts).collect()
    }

    /// The layer of each pixel, an index into [`Marks::layers`].
    pub(crate) fn layer_of(&self) -> &Grid<u8> {
        &self.of
    }

    /// The pixels that are ignored; `None` if there are none.
    pub fn ignored(&self) -> Option<&Mask> {
        self.ignored.as_ref()
    }

    /// True where a pixel is ignored.
    pub fn is_ignored(&self, x: usize, y: usize) -> bool {
        self.ignored.as_ref().is_some_and(|ignored| ignored.get(x, y) == Some(&true))
    }

    /// The pixels that a person looked at and painted, whatever their value.
    pub fn manual_checked(&self) -> Mask {
        let by_hand: Vec<bool> = self.layers.iter().map(Provenance::is_hand).collect();
        self.of.map(|&i| by_hand[usize::from(i)])
    }

    /// True where a person painted any of it.
    pub fn has_hand_work(&self) -> bool {
        self.layers().iter().any(|(layer, px)| *px > 0 && layer.is_hand())
    }

    /// The index of a provenance; a new layer where there is none.
    fn layer(&mut self, provenance: Provenance) -> u8 {
        if let Some(index) = self.layers.iter().position(|layer| *layer == provenance) {
            return index as u8;
        }
        if self.layers.len() == MOST_LAYERS {
            self.drop_unused();
        }
        if self.layers.len() == MOST_LAYERS {
            // More than anybody can tell apart: what is left of the details is that there were some.
            return (MOST_LAYERS - 1) as u8;
        }
        self.layers.push(provenance);
        (self.layers.len() - 1) as u8
    }

    fn drop_unused(&mut self) {
        let used: Vec<bool> = self.layers().iter().enumerate().map(|(i, (_, px))| i == 0 || *px > 0).collect();
        let before = |i: usize| used[..i].iter().filter(|used| **used).count() as u8;
        let new: Vec<u8> = (0..used.len()).map(before).collect();
        self.of.as_mut_slice().iter_mut().for_each(|i| *i = new[usize::from(*i)]);
        let mut used = used.into_iter();
        self.layers.retain(|_| used.next() == Some(true));
    }

    fn set_ignored(&mut self, (x, y): (usize, usize), ignored: bool) {
        let [width, height] = self.size();
        if ignored {
            self.ignored.get_or_insert_with(|| Mask::filled(width, height, false))[(x, y)] = true;
        } else if let Some(mask) = &mut self.ignored {
            mask[(x, y)] = false;
        }
    }

    /// Sets what stands behind one pixel, which must be inside.
    pub(super) fn put(&mut self, pixel: (usize, usize), ignored: bool, provenance: &Provenance) {
        let known = self.layers.iter().position(|layer| layer == provenance);
        let layer = known.map_or_else(|| self.layer(provenance.clone()), |index| index as u8);
        self.set_ignored(pixel, ignored);
        self.of[pixel] = layer;
        if !ignored {
            self.tidy();
        }
    }

    /// Paints the pixels of `rect` that `touched` names. All are from then on of `by`, also those whose value was right:
    /// who paints over a pixel has looked at it.
    ///
    /// `proposed` is what [`Paint::LetThrough`] lets through, with its provenance: a pixel that a person lets through was
    /// looked at as well, and is that person's.
    pub fn paint(
        &mut self,
        mask: &mut Mask,
        (touched, rect): (&Mask, Rect),
        paint: Paint,
        proposed: Option<&Mask>,
        by: Provenance,
    ) {
        let layer = self.layer(by);
        for y in rect.y..rect.y + rect.height {
            for x in rect.x..rect.x + rect.width {
                if touched.get(x, y) != Some(&true) || mask.get(x, y).is_none() {
                    continue;
                }
                let pixel = (x, y);
                mask[pixel] = match paint {
                    Paint::Contact => true,
                    Paint::Free | Paint::Ignore => false,
                    Paint::LetThrough => match proposed.and_then(|proposed| proposed.get(x, y)) {
                        Some(value) => *value,
                        None => continue,
                    },
                };
                self.set_ignored(pixel, paint == Paint::Ignore);
                self.of[pixel] = layer;
            }
        }
        self.tidy();
    }

    /// Takes the pixels of `new` over into `mask`, of provenance `by` where they differ. Ignored pixels stay so, and where
    /// `keep_manual` is set, what a person painted stays as well. Whether anything changed.
    pub fn replace(&mut self, mask: &mut Mask, new: &Mask, by: Provenance, keep_manual: bool) -> bool {
        if new.size() != mask.size() || mask.size() != self.size() {
            return false;
        }
        let by_hand: Vec<bool> = self.layers.iter().map(Provenance::is_hand).collect();
        let layer = self.layer(by);
        let ignored = self.ignored.as_ref().map(Mask::as_slice);
        let mut changed = false;
        for (i, (value, of)) in mask.as_mut_slice().iter_mut().zip(self.of.as_mut_slice()).enumerate() {
            let stays = ignored.is_some_and(|ignored| ignored[i])
                || keep_manual && by_hand.get(usize::from(*of)) == Some(&true);
            if *value != new.as_slice()[i] && !stays {
                *value = !*value;
                *of = layer;
                changed = true;
            }
        }
        self.tidy();
        changed
    }

    /// Takes another mask over with what it ignores (`None`: nothing), of provenance `by` where they differ; where `keep_manual`
    /// is set, what a person painted stays. How many pixels changed, and how many stay although they differ.
    pub fn take_over(
        &mut self,
        mask: &mut Mask,
        new: &Mask,
        ignored: Option<&Mask>,
        by: Provenance,
        keep_manual: bool,
    ) -> [usize; 2] {
        let sizes = [new.size(), self.size(), ignored.map_or(new.size(), Mask::size)];
        if sizes.iter().any(|size| *size != mask.size()) {
            return [0; 2];
        }
        let by_hand = self.manual_checked();
        let layer = self.layer(by);
        let [width, height] = self.size();
        let mut counts = [0; 2];
        for pixel in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let ignore = ignored.is_some_and(|ignored| ignored[pixel]);
            // What is ignored is neither contact nor free of it.
            let contact = new[pixel] && !ignore;
            if mask[pixel] == contact && self.is_ignored(pixel.0, pixel.1) == ignore {
                continue;
            }
            let stays = keep_manual && by_hand[pixel];
            counts[usize::from(stays)] += 1;
            if !stays {
                mask[pixel] = contact;
                self.set_ignored(pixel, ignore);
                self.of[pixel] = layer;
            }
        }
        self.tidy();
        counts
    }

    /// A mask of ignored pixels without any is none.
    fn tidy(&mut self) {
        if self.ignored.as_ref().is_some_and(|ignored| !ignored.as_slice().contains(&true)) {
            self.ignored = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect() -> Rect {
        Rect { x: 0, y: 0, width: 4, height: 2 }
    }

    fn columns(range: std::ops::Range<usize>) -> Mask {
        Mask::from_fn(4, 2, |x, _| range.contains(&x))
    }

    #[test]
    fn each_pixel_says_where_it_comes_from() {
        let mut mask = columns(0..2);
        let mut marks = Marks::all(mask.size(), Provenance::Threshold { min_m: 0.005 });
        let anna = || Provenance::hand("anna");
        marks.paint(&mut mask, (&columns(1..3), rect()), Paint::Contact, None, anna());
        assert!(mask == columns(0..3));
        assert_eq!(marks.manual_checked(), columns(1..3), "a pixel that was right already was looked at too");
        assert_eq!(marks.layers(), [(&Provenance::Threshold { min_m: 0.005 }, 4), (&anna(), 4)]);
        marks.paint(&mut mask, (&columns(0..1), rect()), Paint::Ignore, None, anna());
        assert!(mask == columns(1..3) && marks.ignored() == Some(&columns(0..1)));
        assert!(marks.has_hand_work() && marks.is_ignored(0, 0) && !marks.is_ignored(9, 9));
        // A proposal takes neither what is ignored nor, unless it may, what a person painted.
        let all = columns(0..4);
        assert!(marks.replace(&mut mask, &all, Provenance::Truth, true));
        assert!(mask == columns(1..4));
        assert_eq!(marks.at(3, 1), Some(&Provenance::Truth));
        assert!(!marks.replace(&mut mask, &columns(3..4), Provenance::Grown, true), "all that differs is by hand");
        assert!(marks.replace(&mut mask, &columns(3..4), Provenance::Grown, false));
        assert!(mask == columns(3..4) && marks.at(1, 0) == Some(&Provenance::Grown));
        // Painted over, it is ignored no more.
        marks.paint(&mut mask, (&columns(0..1), rect()), Paint::Free, None, anna());
        assert_eq!(marks.ignored(), None);
        // By brush, where a person wants it.
        marks.paint(&mut mask, (&columns(2..4), rect()), Paint::LetThrough, Some(&columns(2..3)), anna());
        assert!(mask == columns(2..3));
        assert!(!marks.replace(&mut mask, &Mask::filled(9, 9, true), anna(), false), "of another size");
    }

    #[test]
    fn a_mask_is_taken_over_with_what_it_ignores_and_hand_work_stays_unless_asked() {
        let mut mask = columns(0..2);
        let mut marks = Marks::all(mask.size(), Provenance::Truth);
        marks.paint(&mut mask, (&columns(0..1), rect()), Paint::Contact, None, Provenance::hand("anna"));
        let imported = || Provenance::Imported { file: "a.png".into() };
        let (before, new, ignored) = ((mask.clone(), marks.clone()), columns(2..4), columns(3..4));
        // The first column is by hand and stays, the others differ.
        assert_eq!(marks.take_over(&mut mask, &new, Some(&ignored), imported(), true), [6, 2]);
        assert!(mask == Mask::from_fn(4, 2, |x, _| x == 0 || x == 2) && marks.ignored() == Some(&ignored));
        assert_eq!((marks.at(2, 0), marks.at(0, 0)), (Some(&imported()), Some(&Provenance::hand("anna"))));
        assert_eq!(
            marks.take_over(&mut mask, &new, Some(&ignored), imported(), true),
            [0, 2],
            "nothing is left to take"
        );
        (mask, marks) = before.clone();
        assert_eq!(marks.take_over(&mut mask, &new, Some(&ignored), imported(), false), [8, 0]);
        assert!(mask == columns(2..3));
        // What is ignored no more, and a mask of another size.
        assert_eq!(marks.take_over(&mut mask, &new, None, imported(), false), [2, 0]);
        assert!(mask == new && marks.ignored().is_none());
        (mask, marks) = before.clone();
        assert_eq!(marks.take_over(&mut mask, &Mask::filled(9, 9, true), None, imported(), false), [0; 2]);
        assert_eq!((mask, marks), before);
    }

    #[test]
    fn no_number_of_layers_is_too_many() {
        let mut mask = columns(0..0);
        let mut marks = Marks::all(mask.size(), Provenance::Nothing);
        for i in 0..600u16 {
            let by = Provenance::TopPercent { percent: f32::from(i) };
            marks.paint(&mut mask, (&columns(0..1), rect()), Paint::Contact, None, by);
        }
        assert!(marks.layers().len() <= MOST_LAYERS);
        assert_eq!(marks.at(0, 0), Some(&Provenance::TopPercent { percent: 599.0 }));
        assert_eq!((marks.base(), marks.at(2, 0)), (&Provenance::Nothing, Some(&Provenance::Nothing)));
    }
}
