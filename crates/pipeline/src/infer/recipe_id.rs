//! [`RecipeId`]: the name of a result by all that decides it.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::engine::EngineChoice;
use crate::io::digest::sha256;
use touch2touch_core::diffusion::{GenerateConfig, Sampler, Spacing};

/// Version of the digest.
const VERSION: &str = "r1";
/// The choices of a generation that an id does not name. Part of the format: they stay when defaults change.
const UNNAMED: GenerateConfig =
    GenerateConfig { steps: 50, eta: 0.0, seed: 42, sampler: Sampler::Ddim, spacing: Spacing::Trailing };

/// A digest of all that decides a result: equal ids are equal results of the same touch. Choices are named in it and those
/// at their defaults left out, so that a new choice changes no id.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RecipeId(String);

impl fmt::Display for RecipeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Choices that decide a result, by name, without those at their default.
#[derive(Debug, Default)]
pub(crate) struct Named(Map<String, Value>);

impl Named {
    /// Choices that decide a prediction.
    pub(crate) fn prediction(bundle: &str, config: &GenerateConfig, engine: EngineChoice) -> Self {
        let mut named = Self::default();
        named.add("imprint", &"predicted", &"measured");
        named.add("bundle", &bundle, &Value::Null);
        // + 0.0 turns -0 into 0, which means the same.
        let config = GenerateConfig { eta: config.eta + 0.0, ..*config };
        let (Value::Object(choices), Value::Object(defaults)) = (json(&config), json(&UNNAMED)) else {
            unreachable!("choices are named")
        };
        for (key, value) in choices {
            named.add(&key, &value, defaults.get(&key).unwrap_or(&Value::Null));
        }
        named.add("engine", &engine, &EngineChoice::default());
        named
    }

    /// Names a choice where it is not at its default.
    pub(crate) fn add(&mut self, key: &str, value: &impl Serialize, default: &impl Serialize) {
        let value = json(value);
        if value != json(default) {
            self.0.insert(key.into(), value);
        }
    }

    /// The id.
    pub(crate) fn id(self) -> RecipeId {
        let digest = sha256(Value::Object(self.0).to_string().as_bytes());
        RecipeId(format!("{VERSION}-{digest:.16}"))
    }
}

fn json(value: &impl Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}
