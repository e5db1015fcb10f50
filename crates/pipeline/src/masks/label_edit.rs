//! [`LabelEdit`]: what a person does to the labels of a pair, as a value. The verb `label` writes what it changes to the disk,
//! the studio puts it into its history; the journal says the same of both.

use crate::error::TaskError;
use crate::labels::{Change, DrawnMask, ImprintOf, MaskPlace, Operation, PairLabels, Review, note};
use crate::masks::propose::{Proposal, accepted};
use touch2touch_core::label::{CleanUp, Drawing};
use touch2touch_core::manual::AcceptedPose;
use touch2touch_core::rig::Rig;

/// A mask as a hand takes it up: the one in force on an imprint.
#[derive(Clone, Debug, PartialEq)]
pub struct TakenUp {
    /// The imprint.
    pub place: MaskPlace,
    /// The mask: the drawn one, else the automatic one with where its pixels come from.
    pub mask: DrawnMask,
}

/// One thing that a person does to the labels of a pair.
#[derive(Clone, Debug)]
pub enum LabelEdit<'a> {
    /// Draws on a mask, which made `mask` of it.
    Draw {
        /// Mask that it was drawn on.
        on: TakenUp,
        /// Mask that came of it; see [`DrawnMask::draw`].
        mask: DrawnMask,
        /// Drawing.
        drawing: &'a Drawing,
    },
    /// Cleans a mask up.
    CleanUp {
        /// The mask.
        on: TakenUp,
        /// The clean-up.
        clean_up: CleanUp,
        /// The sensors: sizes are millimeters of theirs.
        rig: &'a Rig,
    },
    /// Makes an automatic mask the corrected one.
    Adopt(TakenUp),
    /// Makes a proposal the mask.
    AcceptProposal {
        /// The imprint that it is for.
        place: MaskPlace,
        /// The proposal.
        proposal: &'a Proposal,
        /// Replaces what was painted by hand as well.
        over_drawn: bool,
    },
    /// Removes the corrected mask: the automatic source is in force again.
    Remove(MaskPlace),
    /// Sets the review state.
    Review(Review),
    /// Marks the pair done and accepts automatic masks where nobody drew: they were looked at and are right.
    Done {
        /// The automatic masks that were looked at.
        automatic: Vec<TakenUp>,
        /// Who says so; empty where nobody knows.
        by: String,
    },
    /// Writes the note; see [`note`].
    Note(&'a str),
    /// Accepts a pose of an imprint.
    AcceptPose(ImprintOf, AcceptedPose),
    /// Withdraws the pose of an imprint that [`PairLabels::accepted`] finds.
    WithdrawPose(ImprintOf),
}

/// Outcome of an edit.
#[derive(Clone, Debug, PartialEq)]
pub struct Edited {
    /// Name and numbers of the edit, for the journal and for who takes it back.
    pub deed: Operation,
    /// Difference that it made.
    pub change: Change,
}

/// Does something to labels; a pair whose mask changes counts as begun. `None` where nothing changes.
///
/// # Errors
/// If it cannot be done.
pub fn edit(labels: &PairLabels, edit: LabelEdit<'_>) -> Result<Option<Edited>, TaskError> {
    let named = |name: &'static str| Operation::named(name);
    let mut now = labels.clone();
    let deed = match edit {
        LabelEdit::Draw { on, mask, drawing } => {
            if !mask.is_same(&on.mask) {
                now.draw(&on.place, Some(mask));
            }
            let in_3d = if drawing.sight.is_some() { " in 3D" } else { "" };
            let how = serde_json::to_value(drawing).ok();
            Operation { how, ..Operation::named(format!("{}{in_3d}", drawing.name())) }
        }
        LabelEdit::CleanUp { mut on, clean_up, rig } => {
            if on.mask.clean(clean_up, rig) {
                now.draw(&on.place, Some(on.mask));
            }
            Operation { how: serde_json::to_value(clean_up).ok(), ..named(clean_up.kind.name()) }
        }
        LabelEdit::Adopt(TakenUp { place, mask }) => {
            now.draw(&place, Some(mask));
            named("automatic mask taken over")
        }
        LabelEdit::AcceptProposal { place, proposal, over_drawn } => {
            let drawn = now.drawn_of_size(&place, proposal.mask.size());
            let mask = accepted(drawn, proposal, over_drawn);
            if !drawn.is_some_and(|drawn| drawn.is_same(&mask)) {
                now.draw(&place, Some(mask));
            }
            Operation { how: serde_json::to_value(&proposal.provenance).ok(), ..named("proposal accepted") }
        }
        LabelEdit::Remove(place) => {
            if now.masks.contains_key(&place) {
                now.draw(&place, None);
            }
            named("correction removed")
        }
        LabelEdit::Review(review) => {
            now.review = review;
            named("review state")
        }
        LabelEdit::Done { automatic, by } => {
            let name = if automatic.is_empty() { "review state" } else { "done, automatic masks accepted" };
            for TakenUp { place, mask } in automatic {
                if !now.masks.contains_key(&place) {
                    now.put(&place, Some(mask.accepted(&by)));
                }
            }
            now.review = Review::Done;
            named(name)
        }
        LabelEdit::Note(text) => {
            now.note = note(text);
            named("note")
        }
        LabelEdit::AcceptPose(of, pose) => {
            now.accept(&of, Some(pose));
            named(if pose.by_hand { "pose set by hand" } else { "pose accepted" })
        }
        LabelEdit::WithdrawPose(of) => {
            now.accept(&of, None);
            named("pose withdrawn")
        }
    };
    let change = Change::between(labels, &now);
    Ok((!change.is_empty()).then_some(Edited { deed, change }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::grid::Mask;
    use touch2touch_core::label::{CleanKind, Provenance};
    use touch2touch_core::rig::lab;

    fn drawn(contact: bool) -> DrawnMask {
        DrawnMask::new(Mask::filled(8, 4, contact), Provenance::Nothing)
    }

    #[test]
    fn an_edit_says_what_it_changes_and_nothing_where_nothing_changes() {
        let (rig, place) = (Rig::lab(), MaskPlace::measured(lab::LEFT));
        let mut labels = PairLabels::default();
        assert_eq!(edit(&labels, LabelEdit::Remove(place.clone())), Ok(None), "there is none, so that nothing begins");
        let holed = DrawnMask::new(Mask::from_fn(8, 4, |x, y| (x, y) != (3, 2)), Provenance::Nothing);
        let full = TakenUp { place: place.clone(), mask: holed.clone() };
        let adopted = edit(&labels, LabelEdit::Adopt(full.clone())).unwrap().unwrap();
        assert_eq!(
            (&*adopted.deed.name, adopted.change.review),
            ("automatic mask taken over", Some([Review::Todo, Review::InProgress]))
        );
        adopted.change.apply_to(&mut labels);
        assert_eq!(labels.measured(lab::LEFT), Some(&holed));
        let fill = CleanUp { kind: CleanKind::FillHoles, size_mm: 0.0 };
        let cleaned = edit(&labels, LabelEdit::CleanUp { on: full, clean_up: fill, rig: &rig }).unwrap().unwrap();
        assert!(cleaned.deed.how.is_some() && cleaned.change.review.is_none());
        cleaned.change.apply_to(&mut labels);
        let on = TakenUp { place: place.clone(), mask: labels.measured(lab::LEFT).unwrap().clone() };
        assert_eq!(edit(&labels, LabelEdit::CleanUp { on, clean_up: fill, rig: &rig }), Ok(None));
        let of = ImprintOf::unknown();
        assert_eq!(edit(&labels, LabelEdit::Review(Review::InProgress)), Ok(None));
        // Done accepts what nobody drew, and nothing else.
        let right = MaskPlace::measured(lab::RIGHT);
        let automatic = vec![
            TakenUp { place: place.clone(), mask: drawn(true) },
            TakenUp { place: right.clone(), mask: drawn(true) },
        ];
        let done = edit(&labels, LabelEdit::Done { automatic, by: "Anna".into() }).unwrap().unwrap();
        let mut finished = labels.clone();
        done.change.apply_to(&mut finished);
        assert_eq!((finished.review, finished.masks[&place].clone()), (Review::Done, labels.masks[&place].clone()));
        assert_eq!(finished.masks[&right].base(), "Accepted by Anna: ");
        done.change.inverse().apply_to(&mut finished);
        assert_eq!(finished, labels);
        assert_eq!(edit(&labels, LabelEdit::Note(" \n")), Ok(None));
        assert_eq!(edit(&labels, LabelEdit::WithdrawPose(of)), Ok(None));
        cleaned.change.inverse().apply_to(&mut labels);
        adopted.change.inverse().apply_to(&mut labels);
        assert_eq!(labels, PairLabels::default());
    }
}
