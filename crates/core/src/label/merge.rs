//! Merging what two people made of one mask: [`merge`].

use super::marks::Marks;
use super::provenance::Provenance;
use crate::grid::Mask;

/// A mask with its marks.
type Marked<'a> = (&'a Mask, &'a Marks);

/// Merge of what two people made of `base`, each without the other: where `ours` changed a pixel (its value, or who
/// looked at it) it is ours, everywhere else it is theirs. `None` if the sizes differ.
pub fn merge(base: Marked<'_>, ours: Marked<'_>, theirs: Marked<'_>) -> Option<(Mask, Marks)> {
    let size = base.0.size();
    if [ours, theirs].iter().any(|(mask, marks)| mask.size() != size || marks.size() != size) || base.1.size() != size {
        return None;
    }
    let (mut mask, mut marks) = (theirs.0.clone(), theirs.1.clone());
    type Pixel<'a> = (Option<bool>, bool, Option<&'a Provenance>);
    fn pixel<'a>((mask, marks): Marked<'a>, x: usize, y: usize) -> Pixel<'a> {
        (mask.get(x, y).copied(), marks.is_ignored(x, y), marks.at(x, y))
    }
    for y in 0..size[1] {
        for x in 0..size[0] {
            let mine = pixel(ours, x, y);
            if mine == pixel(base, x, y) || mine == pixel(theirs, x, y) {
                continue;
            }
            let (Some(value), ignored, Some(provenance)) = mine else { continue };
            mask[(x, y)] = value;
            marks.put((x, y), ignored, provenance);
        }
    }
    Some((mask, marks))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::{Paint, Rect};

    #[test]
    fn what_each_of_two_people_painted_is_kept() {
        let rect = Rect { x: 0, y: 0, width: 6, height: 1 };
        let columns = |range: std::ops::Range<usize>| Mask::from_fn(6, 1, |x, _| range.contains(&x));
        let base = (columns(0..0), Marks::all([6, 1], Provenance::Truth));
        let painted = |range, paint, who: &str| {
            let (mut mask, mut marks) = base.clone();
            marks.paint(&mut mask, (&columns(range), rect), paint, None, Provenance::hand(who));
            (mask, marks)
        };
        fn refs(of: &(Mask, Marks)) -> Marked<'_> {
            (&of.0, &of.1)
        }
        let (ours, theirs) = (painted(0..3, Paint::Contact, "anna"), painted(2..5, Paint::Ignore, "ben"));
        let (mask, marks) = merge(refs(&base), refs(&ours), refs(&theirs)).unwrap();
        assert!(mask == columns(0..3), "where both painted, ours");
        assert_eq!(marks.ignored(), Some(&columns(3..5)));
        let who = |x| marks.at(x, 0).map(Provenance::text).unwrap_or_default();
        assert_eq!([0, 2, 3, 5].map(who), ["By hand, anna", "By hand, anna", "By hand, ben", "Simulator truth"]);
        // One that did nothing takes nothing back.
        assert_eq!(merge(refs(&base), refs(&base), refs(&theirs)), Some(theirs.clone()));
        assert_eq!(merge(refs(&base), refs(&ours), refs(&base)), Some(ours.clone()));
        let small = (Mask::filled(2, 2, true), Marks::all([2, 2], Provenance::Truth));
        assert_eq!(merge(refs(&base), refs(&ours), refs(&small)), None);
    }
}
