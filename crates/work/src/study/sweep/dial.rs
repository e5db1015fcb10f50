//! The dials, and the settings that they stand for.

use serde::{Deserialize, Serialize, Serializer};
use strum::{EnumIter, EnumString, IntoEnumIterator as _, IntoStaticStr};

use crate::mask::{MaskChoice, MaskRecipe, MaskSource};
use crate::recipe::Recipe;
use crate::subject::Mapping;
use touch2touch_core::pose::{RegistrationChoice, Rejection};
use touch2touch_core::postprocess::ShiftMode;

/// Most values of one sweep: more small plots than that are no help.
pub const MOST_VALUES: usize = 40;
/// Largest size of a threshold, meters; as the settings have it.
const THRESHOLD_M: f32 = 0.1;

/// Dial that can be turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, EnumIter, EnumString, IntoStaticStr, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Dial {
    /// Imprint depth from which a pixel is contact.
    #[default]
    Threshold,
    /// Probability from which the mask model's pixel is contact.
    Probability,
    /// Share of the contacts that the registration leaves out.
    Trim,
    /// Distance beyond which the registration leaves a contact out.
    Gate,
    /// Mapping of decoder outputs to meters.
    Shift,
}

impl Dial {
    /// The name on the command line and in files.
    pub fn key(self) -> &'static str {
        self.into()
    }

    /// The name on screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Threshold => "Mask threshold",
            Self::Probability => "Mask probability",
            Self::Trim => "Trim",
            Self::Gate => "Gate",
            Self::Shift => "Shift",
        }
    }

    /// Description in a line.
    pub fn tooltip(self) -> &'static str {
        match self {
            Self::Threshold => "Imprint depth from which a pixel is contact, millimeters",
            Self::Probability => "Probability from which a pixel is contact for the mask model, 0 to 1",
            Self::Trim => "Share of the contacts, the farthest, that the registration leaves out, 0 to 0.9",
            Self::Gate => "Distance beyond which the registration leaves contacts out, or lets them go, millimeters",
            Self::Shift => "How predictions become meters",
        }
    }

    /// The unit of its values as they are read and written; empty for a share or a name.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Threshold | Self::Gate => "mm",
            Self::Probability | Self::Trim | Self::Shift => "",
        }
    }

    /// Usual values for somebody who never turned it: first, last and their number.
    pub fn usual(self) -> (f64, f64, usize) {
        match self {
            Self::Threshold => (3.0, 12.0, 10),
            Self::Probability => (0.1, 0.9, 9),
            Self::Trim => (0.0, 0.5, 6),
            Self::Gate => (0.5, 4.0, 8),
            Self::Shift => (0.0, 0.0, 0),
        }
    }

    /// The numbers that make sense, in the dial's unit.
    pub fn limits(self) -> std::ops::RangeInclusive<f64> {
        match self {
            Self::Threshold => -100.0..=100.0,
            Self::Probability => 0.0..=1.0,
            Self::Trim => 0.0..=0.9,
            Self::Gate => 0.01..=50.0,
            Self::Shift => 0.0..=0.0,
        }
    }

    /// By how much it is turned at once, in its unit.
    pub fn step(self) -> f64 {
        match self {
            Self::Threshold | Self::Gate => 0.05,
            Self::Probability | Self::Trim | Self::Shift => 0.01,
        }
    }

    /// A value from its number, in the dial's unit.
    ///
    /// # Errors
    /// If it makes no sense.
    pub fn setting(self, number: f64) -> Result<Setting, String> {
        match self {
            // In the precision of the setting, so that 5 mm are those of the mask pane.
            Self::Threshold => {
                let depth_m = number as f32 / 1e3;
                let fits = depth_m.is_finite() && depth_m.abs() <= THRESHOLD_M;
                let why = || format!("a threshold must be between -{0} and {0} mm", THRESHOLD_M * 1e3);
                if fits { Ok(Setting::Threshold(depth_m)) } else { Err(why()) }
            }
            Self::Probability if (0.0..=1.0).contains(&number) => Ok(Setting::Probability(number as f32)),
            Self::Probability => Err("a probability must be between 0 and 1".into()),
            Self::Trim => Rejection::trim(number).map(Setting::Rejection),
            Self::Gate => Rejection::gate(number / 1e3).map(Setting::Rejection),
            Self::Shift => Err("a shift has a name, not a number".into()),
        }
    }

    /// A value from text.
    ///
    /// # Errors
    /// If it is none.
    pub fn parse(self, text: &str) -> Result<Setting, String> {
        let text = text.trim();
        if self == Self::Shift {
            let found = Mapping::iter().find(|mapping| mapping.key() == text);
            let keys = || Mapping::iter().map(Mapping::key).collect::<Vec<_>>().join(", ");
            let why = || format!("\"{text}\" is no shift; there are {}", keys());
            return found.map(|mapping| Setting::Shift(mapping.mode())).ok_or_else(why);
        }
        let number = text.parse().map_err(|_| format!("\"{text}\" is not a number"))?;
        self.setting(number).map_err(|why| format!("{text}: {why}"))
    }

    /// Evenly spaced values, both ends among them, in the dial's unit; all shifts for that dial.
    ///
    /// # Errors
    /// If one of them makes no sense.
    pub fn spread(self, first: f64, last: f64, count: usize) -> Result<Vec<Setting>, String> {
        if self == Self::Shift {
            return Ok(Mapping::iter().map(|mapping| Setting::Shift(mapping.mode())).collect());
        }
        let count = count.clamp(1, MOST_VALUES);
        let step = (last - first) / (count.max(2) - 1) as f64;
        // Whole millionths, so that 0.3 is not 0.30000000000000004.
        let at = |i: usize| ((first + i as f64 * step) * 1e6).round() / 1e6;
        (0..count).map(|i| self.setting(at(i))).collect()
    }

    /// Setting that the dial stands at; `own` is the mask model's own probability.
    pub(super) fn of(self, in_force: &Recipe, made_by: &MaskRecipe, own: Option<f32>) -> Option<Setting> {
        match (self, made_by) {
            (Self::Threshold, MaskRecipe::Threshold(depth_m)) => Some(Setting::Threshold(depth_m.get())),
            (Self::Probability, MaskRecipe::Unet(_, least)) => {
                Some(Setting::Probability(least.map(|least| least.get()).or(own)?))
            }
            (Self::Threshold | Self::Probability, _) => None,
            (Self::Trim, _) => in_force.registration.trim().and_then(|share| self.setting(share).ok()),
            (Self::Gate, _) => in_force.registration.gate_m().and_then(|m| self.setting(m * 1e3).ok()),
            (Self::Shift, _) => Some(Setting::Shift(in_force.shift)),
        }
    }
}

/// A dial at a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// Meters.
    Threshold(f32),
    /// 0..1.
    Probability(f32),
    /// A gate or a trim.
    Rejection(Rejection),
    /// The way to meters.
    Shift(ShiftMode),
}

impl Setting {
    /// The dial that it is of.
    pub fn dial(self) -> Dial {
        match self {
            Self::Threshold(_) => Dial::Threshold,
            Self::Probability(_) => Dial::Probability,
            Self::Rejection(Rejection::Trim(_)) => Dial::Trim,
            Self::Rejection(_) => Dial::Gate,
            Self::Shift(_) => Dial::Shift,
        }
    }

    /// The recipe with it.
    ///
    /// # Errors
    /// If the registration cannot do it.
    pub fn put(self, recipe: &Recipe) -> Result<Recipe, String> {
        let mut recipe = recipe.clone();
        match self {
            Self::Threshold(threshold_m) => {
                recipe.mask = MaskChoice { source: MaskSource::Threshold, threshold_m, ..recipe.mask };
            }
            Self::Probability(least) => {
                // Auto is the mask model, where there is one.
                let auto = recipe.mask.source == MaskSource::Auto;
                let source = if auto { MaskSource::Auto } else { MaskSource::Unet };
                recipe.mask = MaskChoice { source, probability: Some(least), ..recipe.mask };
            }
            Self::Rejection(rejection) => {
                recipe.registration = RegistrationChoice::new(recipe.registration.by, rejection)?;
            }
            Self::Shift(shift) => recipe.shift = shift,
        }
        Ok(recipe)
    }

    /// Number of the setting in the dial's unit; `None` for a shift.
    pub fn number(self) -> Option<f64> {
        match self {
            // The shortest decimal of the setting's own precision: 5, not 4.999999888.
            Self::Threshold(m) => format!("{}", m * 1e3).parse().ok(),
            Self::Probability(p) => format!("{p}").parse().ok(),
            Self::Rejection(rejection @ Rejection::Gate(_)) => rejection.number().map(|m| (m * 1e9).round() / 1e6),
            Self::Rejection(rejection) => rejection.number(),
            Self::Shift(_) => None,
        }
    }

    /// The value as the command line takes it.
    pub fn key(self) -> String {
        match (self, self.number()) {
            (Self::Shift(shift), _) => {
                let known = Mapping::iter().find(|mapping| mapping.mode() == shift);
                known.map_or_else(|| shift.label().to_lowercase(), |mapping| mapping.key().to_owned())
            }
            (_, Some(number)) => format!("{number}"),
            (_, None) => String::new(),
        }
    }

    /// The value for people, with its unit.
    pub fn label(self) -> String {
        match self {
            Self::Shift(shift) => shift.label().to_owned(),
            other if other.dial().unit().is_empty() => other.key(),
            other => format!("{} {}", other.key(), other.dial().unit()),
        }
    }
}

impl Serialize for Setting {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        match self.number() {
            Some(number) => to.serialize_f64(number),
            None => to.serialize_str(&self.key()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::pose::Registration;

    #[test]
    fn what_is_written_is_read_and_what_makes_no_sense_is_refused() {
        for dial in Dial::iter() {
            assert_eq!(dial.key().parse(), Ok(dial));
            let (first, last, count) = dial.usual();
            let values = dial.spread(first, last, count).unwrap();
            assert!(values.len() >= 4, "{dial:?}");
            for value in values {
                assert_eq!((value.dial(), dial.parse(&value.key())), (dial, Ok(value)));
                assert!(value.label().ends_with(dial.unit()), "{}", value.label());
            }
        }
        for (dial, text, word) in [
            (Dial::Threshold, "deep", "not a number"),
            (Dial::Threshold, "NaN", "between -100 and 100 mm"),
            (Dial::Threshold, "1e9", "between -100 and 100 mm"),
            (Dial::Probability, "1.5", "between 0 and 1"),
            (Dial::Probability, "nan", "between 0 and 1"),
            (Dial::Trim, "0.95", "between 0 and 0.9"),
            (Dial::Gate, "0", "between 0.01 and 50 mm"),
            (Dial::Gate, "", "not a number"),
            (Dial::Shift, "3", "there are exact, unfitted, paper, raw"),
        ] {
            let why = dial.parse(text).unwrap_err();
            assert!(why.contains(word), "{dial:?} {text}: {why}");
        }
        assert!(
            Dial::Gate
                .parse("2")
                .unwrap()
                .put(&Recipe { registration: Registration::LabIcp.into(), ..Recipe::default() })
                .is_err()
        );
    }

    #[test]
    fn where_a_dial_stands_is_a_value_that_changes_nothing() {
        let in_force = Recipe { registration: Registration::DistanceField.into(), ..Recipe::default() };
        let (threshold, unet) = (MaskRecipe::Threshold(0.005.into()), MaskRecipe::Unet("id".into(), None));
        assert_eq!(Dial::Threshold.of(&in_force, &threshold, None), Dial::Threshold.parse("5").ok());
        assert_eq!(Dial::Threshold.of(&in_force, &unet, None), None);
        assert_eq!(Dial::Probability.of(&in_force, &unet, Some(0.5)), Dial::Probability.parse("0.5").ok());
        assert_eq!(Dial::Gate.of(&in_force, &unet, None), Dial::Gate.parse("1").ok());
        assert_eq!(Dial::Trim.of(&in_force, &unet, None), None);
        let mask = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
        let by_threshold = Recipe { mask, ..in_force.clone() };
        assert_eq!(Dial::Threshold.parse("5").unwrap().put(&by_threshold), Ok(by_threshold));
        assert_ne!(Dial::Threshold.parse("5").unwrap().put(&in_force), Ok(in_force));
    }
}
