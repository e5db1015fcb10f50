//! [`PredictedId`]: which predicted imprint, in words that stay.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use touch2touch_core::diffusion::GenerateConfig;
use touch2touch_core::postprocess::ShiftMode;

/// The words' version.
const VERSION: &str = "v1";

/// Values of the choices that are not named. Part of the format: a choice that is new gets a line with what was done
/// without it, and no line ever changes.
const UNNAMED: &str = r#"{
    "steps": 50, "eta": 0.0, "seed": 42, "sampler": "ddim", "spacing": "trailing", "shift": "exact_inverse"
}"#;

/// All that decides a predicted imprint of a touch, apart from the engine: the identity of the generator's bundle, the choices
/// of one generation, and the shift. Masks drawn on a prediction are filed under it, so it outlives versions of the program:
/// choices are named, and those at their defaults left out, so that a new one changes no text.
///
/// A text that is not understood is kept as it is.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PredictedId(Arc<str>);

impl PredictedId {
    /// The prediction of a generator (its bundle's identity) with these choices.
    pub fn new(bundle: &str, config: &GenerateConfig, shift: ShiftMode) -> Self {
        // + 0.0 turns -0 into 0, which means the same.
        let config = GenerateConfig { eta: config.eta + 0.0, ..*config };
        let mut named = object(serde_json::to_value(config));
        named.insert("shift".into(), serde_json::to_value(shift).unwrap_or_default());
        let unnamed = unnamed();
        named.retain(|choice, value| unnamed.get(choice) != Some(value));
        Self(format!("{bundle} {VERSION} {}", Value::Object(named)).into())
    }

    /// A prediction of which nobody wrote down which one it is.
    pub fn unknown() -> Self {
        Self(Arc::default())
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Bundle, choices and shift; `None` of what no version up to this one wrote.
    pub fn parts(&self) -> Option<(&str, GenerateConfig, ShiftMode)> {
        let (bundle, choices) = self.0.split_once(' ')?;
        let named: Map<String, Value> = serde_json::from_str(choices.strip_prefix(VERSION)?).ok()?;
        // A sampler that there is no longer: old preferences read it as another one, which would be another prediction.
        if named.get("sampler").is_some_and(|sampler| sampler == "dpm_solver2m") {
            return None;
        }
        let mut all = unnamed();
        for (choice, value) in named {
            *all.get_mut(&choice)? = value;
        }
        let shift = serde_json::from_value(all.remove("shift")?).ok()?;
        Some((bundle, serde_json::from_value(Value::Object(all)).ok()?, shift))
    }
}

impl From<String> for PredictedId {
    fn from(text: String) -> Self {
        Self(text.into())
    }
}

impl std::fmt::Display for PredictedId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

fn unnamed() -> Map<String, Value> {
    object(serde_json::from_str(UNNAMED))
}

fn object(value: Result<Value, serde_json::Error>) -> Map<String, Value> {
    match value {
        Ok(Value::Object(map)) => map,
        other => unreachable!("choices are an object of names: {other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_left_out_and_each_choice_has_one() {
        let defaults: GenerateConfig = serde_json::from_value(Value::Object(unnamed())).unwrap();
        let plain = PredictedId::new("b0", &defaults, ShiftMode::ExactInverse);
        assert_eq!(plain.as_str(), "b0 v1 {}");
        let mut choices = object(serde_json::to_value(GenerateConfig::default()));
        choices.insert("shift".into(), Value::Null);
        assert!(choices.keys().eq(unnamed().keys()), "a new choice has its line: {choices:?}");
        let other = GenerateConfig { steps: 2, eta: 0.1, ..defaults };
        let id = PredictedId::new("b0", &other, ShiftMode::Raw);
        assert_eq!(id.as_str(), r#"b0 v1 {"eta":0.1,"shift":"raw","steps":2}"#);
    }

    #[test]
    fn what_is_not_understood_is_kept() {
        for odd in ["a prediction", "", "b0 v1 {\"later\":1}", "b0 v9 {}", "b0 [1,2]", "b0 v1 []"] {
            let kept = PredictedId::from(odd.to_owned());
            assert_eq!((kept.as_str(), kept.parts()), (odd, None));
        }
    }
}
