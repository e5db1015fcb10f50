//! `pose --influence`: which pixels an angle hangs on, as a file and as a list of places.

use std::path::{Path, PathBuf};

use serde::Serialize;

use touch2touch_core::align::Contacts;
use touch2touch_core::pose::{RegistrationChoice, ToolModel};
use touch2touch_work::error::TaskError;
use touch2touch_work::feel::{Felt, Touch};
use touch2touch_work::influence::{Place, influence};
use touch2touch_work::io::names;
use touch2touch_work::io::npz;
use touch2touch_work::io::pt::Tensor;
use touch2touch_work::pose::PoseResult;

/// Influence of a case's pixels on its angle.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Influences {
    /// Holds, by finger, degrees to the square millimeter for every pixel; NaN where none was asked.
    pub(super) file: PathBuf,
    /// Places that the angle hangs on most, the first the most.
    pub(super) places: Vec<NamedPlace>,
}

/// A place with the name of its finger.
#[derive(Debug, Clone, Serialize)]
pub(super) struct NamedPlace {
    finger: String,
    #[serde(flatten)]
    place: Place,
}

impl NamedPlace {
    /// The place in a line.
    pub(super) fn text(&self) -> String {
        let Place { at_mm: [x, y], in_mask, pixels, angle_deg, .. } = &self.place;
        let way = if *in_mask { "without" } else { "with" };
        format!("{:<5} at {x:6.2}, {y:6.2} mm: {angle_deg:+.3}° {way} its {pixels} pixels", self.finger)
    }
}

/// Finds and writes the influence as `STEM_IMPRINT_ENGINE_influence.npz`, one array a finger; why there is none where this
/// pose has none. That it cannot be written is an error.
pub(super) fn write(
    stem: &Path,
    felt: &Felt,
    touch: Touch<'_>,
    tool: &ToolModel,
    registration: RegistrationChoice,
    found: &PoseResult,
) -> anyhow::Result<Result<Influences, TaskError>> {
    let sample = touch.sample;
    let clouds = felt.contact().clouds(sample)?;
    let of = |contacts: Contacts<'_>| influence(&clouds, contacts, sample, tool, registration, &found.report);
    let found = match felt.with_contacts(touch, of)? {
        Ok(found) => found,
        Err(why) => return Ok(Err(why)),
    };
    let imprint = felt.recipe().imprint;
    let registration = registration.to_string().replace([':', '='], "_");
    let file = names::with_ending(stem, &format!("_{}_{registration}_influence.npz", imprint.key()));
    let name = |pad| sample.rig.pad_key(pad).to_string();
    let arrays: Vec<(String, Tensor)> = found
        .pixels
        .entries()
        .map(|(pad, values)| {
            let shown = values.as_slice().iter().map(|value| found.deg_per_mm2(*value) as f32).collect();
            (name(pad), Tensor::f32(&[values.height(), values.width()], shown))
        })
        .collect();
    npz::write(&file, &arrays.iter().map(|(name, values)| (name.as_str(), values.clone())).collect::<Vec<_>>())?;
    let places = found.places.into_iter().map(|place| NamedPlace { finger: name(place.finger), place }).collect();
    Ok(Ok(Influences { file, places }))
}
