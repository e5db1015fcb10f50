//! Labels that are stored of pairs, for programs and for people.

use serde::Serialize;

use touch2touch_core::grid::Mask;
use touch2touch_core::manual::AcceptedPose;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::labels::{ImprintOf, PairLabels};

/// Labels that are stored of a pair.
#[derive(Debug, Serialize)]
pub(super) struct Stored {
    name: String,
    review: &'static str,
    /// The fingers with a corrected mask on the measured imprint, and how many pixels it has.
    masks: Vec<(String, usize)>,
    /// Fingers with a corrected mask on a prediction, its number of pixels, and what the prediction is.
    predicted: Vec<(String, usize, String)>,
    /// Accepted poses, each with what it is of.
    accepted: Vec<Accepted>,
    /// Note that a person wrote about it; empty for none.
    note: String,
}

impl Stored {
    pub(super) fn new(name: &str, labels: &PairLabels, dataset: &Dataset) -> Self {
        let count = |mask: &Mask| mask.as_slice().iter().filter(|&&m| m).count();
        let (mut masks, mut predicted) = (Vec::new(), Vec::new());
        for (place, hand) in &labels.masks {
            let (finger, pixels) = (dataset.rig.pad_key(place.pad).to_string(), count(&hand.mask));
            match &place.of {
                ImprintOf::Measured => masks.push((finger, pixels)),
                ImprintOf::Predicted(what) => predicted.push((finger, pixels, what.to_string())),
            }
        }
        Self {
            name: name.to_owned(),
            review: labels.review.stored(),
            masks,
            predicted,
            accepted: labels.accepted.iter().map(|(of, pose)| Accepted { of: of.clone(), pose: *pose }).collect(),
            note: labels.note.clone(),
        }
    }

    pub(super) fn text(&self) -> String {
        let mut masks: Vec<String> = self.masks.iter().map(|(pad, px)| format!("{pad} {px} px")).collect();
        masks.extend(self.predicted.iter().map(|(pad, px, _)| format!("{pad} {px} px on a prediction")));
        let masks = if masks.is_empty() { "no hand-drawn mask".to_owned() } else { masks.join(", ") };
        let mut text = format!("{}: {}; {masks}", self.name, self.review);
        for Accepted { of, pose } in &self.accepted {
            let place = pose.pose.inverse();
            let by = if pose.by_hand { ", by hand" } else { "" };
            text += &format!("; pose {:.1}° accepted of {}{by}", place.theta_rad.to_degrees(), of.text());
        }
        if !self.note.is_empty() {
            text += &format!("; note: {}", self.note);
        }
        text
    }
}

/// An accepted pose.
#[derive(Debug, Serialize)]
struct Accepted {
    /// The imprint that it is of.
    of: ImprintOf,
    #[serde(flatten)]
    pose: AcceptedPose,
}
