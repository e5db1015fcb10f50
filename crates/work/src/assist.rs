//! Help for those who draw masks: proposals, edits as values, and the order that is worth their time.

pub mod label_edit;
pub mod label_pair;
pub mod propose;
pub mod queue;
