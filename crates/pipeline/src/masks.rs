//! Contact masks: proposals, edits as values, and the order of pairs that is worth a person's time.

pub mod label_edit;
pub mod label_pair;
pub mod propose;
