//! What jobs answer, as empty as it can be.

use std::path::PathBuf;

use touch2touch_pipeline::learn::adapt::{Adapted, Scored};
use touch2touch_pipeline::learn::train::Trained;

pub(super) fn adapted() -> Adapted {
    Adapted {
        pairs: 1,
        touches: 1,
        left_out: Vec::new(),
        doubtful: Vec::new(),
        before: Scored::default(),
        closed_form: None,
        after: None,
        steps: 0,
        curves: Vec::new(),
        seconds: 0.0,
        fit_seconds: 0.0,
        peak_mib: None,
        pads: Vec::new(),
        warnings: Vec::new(),
        notes: Vec::new(),
        objections: Vec::new(),
        in_place_of: None,
        bundle: None,
        unwritten: None,
        held_back: Vec::new(),
    }
}

pub(super) fn trained() -> Trained {
    Trained {
        from: "unet".into(),
        tools: Default::default(),
        masks: 1,
        pairs: 1,
        persons: Vec::new(),
        left_out: Default::default(),
        unusable: Vec::new(),
        before: None,
        after: None,
        poses: None,
        held_out: Vec::new(),
        steps: 1,
        curves: Vec::new(),
        seconds: 0.0,
        peak_mib: None,
        warnings: Vec::new(),
        name: "unet, trained".into(),
        bundle: PathBuf::from("no/such/folder"),
    }
}
