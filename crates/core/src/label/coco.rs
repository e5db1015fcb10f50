//! Run-length coding of masks as COCO has it: lengths of alternating runs, column by column, starting with `false`; as
//! numbers, or as the text that pycocotools makes of them.
//!
//! In the text each number is the difference from the one two before it (the first three are themselves), cut into groups
//! of five bits, the lowest first. A character is 48 plus a group, plus 32 where more groups follow; the highest bit of the
//! last group is the sign.

use super::rle::{RleError, decode_runs, encode_runs};
use crate::grid::{Grid, Mask};

/// The runs of a mask in COCO's order.
pub fn coco_runs(mask: &Mask) -> Vec<u32> {
    encode_runs(&transposed(mask))
}

/// The mask of runs in COCO's order.
///
/// # Errors
/// [`RleError`] if they are not as long as the mask, or the size is none.
pub fn mask_of_coco_runs(width: usize, height: usize, runs: &[u32]) -> Result<Mask, RleError> {
    decode_runs(height, width, runs).map(|mask| transposed(&mask))
}

fn transposed(mask: &Mask) -> Mask {
    Grid::from_fn(mask.height(), mask.width(), |x, y| mask[(y, x)])
}

/// Runs as COCO's text.
pub fn coco_text(runs: &[u32]) -> String {
    let mut text = String::new();
    for (i, &run) in runs.iter().enumerate() {
        let mut rest = i64::from(run) - if i > 2 { i64::from(runs[i - 2]) } else { 0 };
        loop {
            let group = (rest & 31) as u8;
            rest >>= 5;
            let negative = group & 16 != 0;
            let last = rest == if negative { -1 } else { 0 };
            text.push(char::from(48 + group + if last { 0 } else { 32 }));
            if last {
                break;
            }
        }
    }
    text
}

/// The runs of COCO's text; `None` if it is none.
pub fn coco_runs_of(text: &str) -> Option<Vec<u32>> {
    let mut runs: Vec<u32> = Vec::new();
    let (mut value, mut shift) = (0i64, 0);
    for byte in text.bytes() {
        let group = byte.checked_sub(48).filter(|group| *group < 64)?;
        // A run of more than 32 bits is longer than any mask.
        if shift > 35 {
            return None;
        }
        value |= i64::from(group & 31) << shift;
        shift += 5;
        if group & 32 != 0 {
            continue;
        }
        if group & 16 != 0 {
            value -= 1 << shift;
        }
        if runs.len() > 2 {
            value += i64::from(runs[runs.len() - 2]);
        }
        runs.push(u32::try_from(value).ok()?);
        (value, shift) = (0, 0);
    }
    (shift == 0).then_some(runs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn runs_go_down_the_columns_and_become_the_text_of_the_reference() {
        // Columns of three: 0 1 1, 0 0 1.
        let mask = Mask::from_vec(2, 3, vec![false, false, true, false, true, true]).unwrap();
        assert_eq!(coco_runs(&mask), [1, 2, 2, 1]);
        // What pycocotools 2.0.11 makes of this mask, of an empty one, of a full one, and of one with long runs.
        assert_eq!(coco_text(&[1, 2, 2, 1]), "122O");
        assert_eq!(coco_text(&coco_runs(&Mask::filled(175, 140, false))), "dmg0");
        assert_eq!(coco_text(&coco_runs(&Mask::filled(175, 140, true))), "0dmg0");
        let block = Mask::from_fn(175, 140, |x, y| (40..120).contains(&x) && (20..90).contains(&y));
        let text = coco_text(&coco_runs(&block));
        assert!(text.starts_with("d_5V2V20000") && text.ends_with("0000P`7"), "{text}");
    }

    #[test]
    fn what_is_no_text_of_runs_is_refused() {
        for bad in ["/", "p", "P", "\u{e9}", "O", "oooooooooo0", "1O12OO"] {
            assert_eq!(coco_runs_of(bad), None, "{bad}");
        }
        assert_eq!(coco_runs_of(""), Some(Vec::new()));
        assert!(mask_of_coco_runs(2, 3, &[1, 2, 2]).is_err() && mask_of_coco_runs(usize::MAX, 2, &[]).is_err());
    }

    proptest! {
        #[test]
        fn round_trip(bits in proptest::collection::vec(any::<bool>(), 0..400), width in 1usize..20) {
            let height = bits.len() / width;
            let mask = Mask::from_vec(width, height, bits[..width * height].to_vec()).unwrap();
            let runs = coco_runs(&mask);
            prop_assert_eq!(&coco_runs_of(&coco_text(&runs)).unwrap(), &runs);
            prop_assert_eq!(mask_of_coco_runs(width, height, &runs).unwrap(), mask);
        }

        #[test]
        fn any_runs_come_back(runs in proptest::collection::vec(any::<u32>(), 0..40)) {
            prop_assert_eq!(coco_runs_of(&coco_text(&runs)).unwrap(), runs);
        }
    }
}
