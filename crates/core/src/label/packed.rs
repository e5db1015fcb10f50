//! [`PackedMask`]: a corrected mask in few bytes, as files, journals and the history of changes hold it.

use serde::{Deserialize, Serialize};

use super::marks::Marks;
use super::provenance::Provenance;
use super::rle::{decode_runs, encode_runs};
use crate::grid::{Grid, Mask};

/// A corrected mask in few bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PackedMask {
    /// Columns.
    width: usize,
    /// Rows.
    height: usize,
    /// The contact; see [`encode_runs`].
    runs: Vec<u32>,
    /// The ignored pixels, as `runs`; empty if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    ignored: Vec<u32>,
    /// The provenances.
    layers: Vec<Provenance>,
    /// Whose pixels follow each other: layer and number, row by row.
    layer_runs: Vec<(u8, u32)>,
}

/// A packed mask that is none: runs or provenances do not fill it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the packed mask does not cover its pixels")]
pub struct PackError;

impl PackedMask {
    /// Packs a mask with its marks, which are as large.
    pub fn pack(mask: &Mask, marks: &Marks) -> Self {
        let mut layer_runs: Vec<(u8, u32)> = Vec::new();
        for &layer in marks.layer_of().as_slice() {
            match layer_runs.last_mut() {
                Some((last, length)) if *last == layer => *length += 1,
                _ => layer_runs.push((layer, 1)),
            }
        }
        Self {
            width: mask.width(),
            height: mask.height(),
            runs: encode_runs(mask),
            ignored: marks.ignored().map(encode_runs).unwrap_or_default(),
            layers: marks.layers().into_iter().map(|(layer, _)| layer.clone()).collect(),
            layer_runs,
        }
    }

    /// The mask and its marks.
    ///
    /// # Errors
    /// [`PackError`] if it is damaged.
    pub fn unpack(&self) -> Result<(Mask, Marks), PackError> {
        let [width, height] = [self.width, self.height];
        let mask = decode_runs(width, height, &self.runs).ok_or(PackError)?;
        let covered: u64 = self.layer_runs.iter().map(|(_, n)| u64::from(*n)).sum();
        if covered != mask.len() as u64 {
            return Err(PackError);
        }
        let of = self.layer_runs.iter().flat_map(|&(layer, n)| std::iter::repeat_n(layer, n as usize)).collect();
        let of = Grid::from_vec(width, height, of).map_err(|_| PackError)?;
        let ignored = match &self.ignored[..] {
            [] => None,
            runs => Some(decode_runs(width, height, runs).ok_or(PackError)?),
        };
        let marks = Marks::from_parts(self.layers.clone(), of, ignored).ok_or(PackError)?;
        Ok((mask, marks))
    }

    /// About how many bytes it takes.
    pub fn bytes(&self) -> usize {
        std::mem::size_of::<Self>()
            + 4 * (self.runs.len() + self.ignored.len())
            + 8 * self.layer_runs.len()
            + self.layers.len() * std::mem::size_of::<Provenance>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::label::{Paint, Rect};
    use proptest::prelude::*;

    #[test]
    fn damaged_masks_do_not_open() {
        for wrong in [
            r#"{"width": 2, "height": 1, "runs": [2], "layers": [{"kind": "grown"}], "layer_runs": [[0, 3]]}"#,
            r#"{"width": 2, "height": 1, "runs": [2], "layers": [{"kind": "grown"}], "layer_runs": [[1, 2]]}"#,
            r#"{"width": 2, "height": 1, "runs": [2], "ignored": [1], "layers": [{"kind": "grown"}], "layer_runs": [[0, 2]]}"#,
            r#"{"width": 2, "height": 1, "runs": [3], "layers": [{"kind": "grown"}], "layer_runs": [[0, 2]]}"#,
        ] {
            assert!(serde_json::from_str::<PackedMask>(wrong).unwrap().unpack().is_err(), "{wrong}");
        }
    }

    proptest! {
        #[test]
        fn round_trip(values in proptest::collection::vec(0..8u8, 30)) {
            let mut mask = Mask::filled(6, 5, false);
            let mut marks = Marks::all([6, 5], Provenance::TopPercent { percent: 15.0 });
            for (i, value) in values.iter().enumerate() {
                let rect = Rect { x: i % 6, y: i / 6, width: 1, height: 1 };
                let touched = Mask::from_fn(6, 5, |x, y| [x, y] == [rect.x, rect.y]);
                let paint = [Paint::Contact, Paint::Free, Paint::Ignore, Paint::LetThrough][usize::from(value % 4)];
                marks.paint(&mut mask, (&touched, rect), paint, None, Provenance::hand(format!("{}", value / 4)));
            }
            let text = serde_json::to_string(&PackedMask::pack(&mask, &marks)).unwrap();
            let back: PackedMask = serde_json::from_str(&text).unwrap();
            prop_assert_eq!(back.unpack().unwrap(), (mask, marks));
        }
    }
}
