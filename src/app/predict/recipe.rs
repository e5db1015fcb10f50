//! What would be generated now.

use super::super::keys::{ImprintSource, PredictionKey, TouchKey};
use super::super::state::{Absent, State};
use touch2touch_core::rig::PadId;
use touch2touch_core::sample::Sample;
use touch2touch_work::bundles::{BundleInfo, BundleKind};
use touch2touch_work::recipe::{Model, Recipe};

impl State {
    /// The recipe that the settings give a touch; `None` without a generator.
    pub fn recipe(&self, touch: TouchKey) -> Option<PredictionKey> {
        PredictionKey::of(touch, &self.in_force(ImprintSource::Predicted))
    }

    /// The recipe that the settings give, of an imprint.
    pub fn in_force(&self, imprint: ImprintSource) -> Recipe {
        let generator = self.bundle(BundleKind::Generator).ok();
        Recipe {
            imprint,
            generator: generator.map(|bundle| (bundle.clone().into(), self.settings.generate.config(bundle))),
            shift: self.settings.shift,
            mask: self.settings.mask.choice,
            mask_model: self.bundle(BundleKind::Mask).ok().cloned().map(Model::from),
            hand: true,
            registration: self.settings.registration,
            engine: self.settings.runtime,
        }
    }

    /// The fingers whose prediction is looked at: those on screen, and both where a visible pane makes one cloud or
    /// pose of them (unless the settings say otherwise).
    pub(crate) fn fingers_to_generate(&self) -> Vec<PadId> {
        let (_, cloud) = self.shows_cloud(ImprintSource::Predicted);
        if cloud && self.settings.generate.both_fingers {
            return self.rig().pad_list();
        }
        let mut fingers = self.fingers();
        if !self.settings.generate.both_fingers {
            fingers.truncate(1);
        }
        fingers
    }

    /// The bundle that the settings name, or the first of its kind.
    ///
    /// # Errors
    /// [`Absent::NoGenerator`], [`Absent::NoMaskModel`].
    pub fn bundle(&self, kind: BundleKind) -> Result<&BundleInfo, Absent> {
        let (name, absent) = match kind {
            BundleKind::Generator => (self.settings.generate.bundle.as_deref(), Absent::NoGenerator),
            BundleKind::Mask => (self.settings.mask.bundle.as_deref(), Absent::NoMaskModel),
            BundleKind::Classifier => (None, Absent::NoClassifier),
        };
        let rig = self.rig();
        let lacking = self.library.lacking.as_ref().is_some_and(|(_, lacking)| Some(&**lacking) == name);
        let absent = if lacking && kind == BundleKind::Generator { Absent::NoSuchGenerator } else { absent };
        let others = self.library.bundles.iter().any(|bundle| bundle.kind == kind && !bundle.fits(&rig));
        let absent = if others && !lacking { Absent::OtherSensors } else { absent };
        self.library.bundle_named(kind, name, &rig).ok_or(absent)
    }

    /// Whether something can be generated for the selected pair.
    ///
    /// # Errors
    /// Why not.
    pub fn can_generate(&self) -> Result<(), Absent> {
        self.pair_key().ok_or(if self.library.open.is_none() {
            Absent::NothingOpen
        } else {
            Absent::NothingSelected
        })?;
        self.bundle(BundleKind::Generator)?;
        // While the sample loads, the job loads it itself.
        let Some(sample) = self.sample().ready() else {
            return Ok(());
        };
        if sample.rig.pads().any(|finger| self.has_input(sample, finger)) { Ok(()) } else { Err(Absent::NoInput) }
    }

    /// Whether a finger has a reading of the sensor that the generator starts from.
    fn has_input(&self, sample: &Sample, finger: PadId) -> bool {
        let ends = self.bundle(BundleKind::Generator).ok().and_then(|bundle| bundle.ends(&sample.rig)?.ok());
        ends.is_some_and(|ends| sample.pad(finger).is_some_and(|touch| touch.reading(ends.input).is_some()))
    }

    /// Whether something can be generated for a finger of the selected pair, which is loaded.
    pub(crate) fn can_start(&self, finger: PadId) -> bool {
        self.sample().ready().is_some_and(|sample| self.has_input(sample, finger))
    }
}
