//! [`Bindings`]: the keys in force, a person's own before the defaults.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use strum::IntoEnumIterator as _;

use super::{Action, Shortcut};

/// The keys that a person chose, by action. All others have their defaults, as far as nobody chose those for another.
///
/// No shortcut has two actions: [`Bindings::bind`] takes it from the one that had it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bindings {
    own: BTreeMap<Action, Vec<Shortcut>>,
}

impl Bindings {
    /// The shortcuts of an action, the main one first.
    pub fn all(&self, action: Action) -> Vec<Shortcut> {
        if let Some(own) = self.own.get(&action) {
            return own.clone();
        }
        let taken = |shortcut: &Shortcut| self.own.values().any(|own| own.contains(shortcut));
        action.defaults().iter().copied().filter(|shortcut| !taken(shortcut)).collect()
    }

    /// The main shortcut of an action.
    pub fn main(&self, action: Action) -> Option<Shortcut> {
        self.all(action).first().copied()
    }

    /// The main shortcut as menus show it; empty if there is none.
    pub fn text(&self, action: Action) -> String {
        self.main(action).map_or(String::new(), |shortcut| shortcut.to_string())
    }

    /// A text with the main shortcut behind it: `Stop this job (Esc)`.
    pub fn behind(&self, text: &str, action: Action) -> String {
        match self.main(action) {
            Some(shortcut) => format!("{text} ({shortcut})"),
            None => text.to_owned(),
        }
    }

    /// Tooltip of an action with the shortcut behind it.
    pub fn help(&self, action: Action) -> String {
        self.behind(action.tooltip(), action)
    }

    /// A text in which `[[generate]]` stands for the main shortcut of that action, or for its name where it has none.
    pub fn fill(&self, text: &str) -> String {
        let mut parts = text.split("[[");
        let mut filled = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let (name, rest) = part.split_once("]]").unwrap_or((part, ""));
            filled += &name.parse().map_or_else(
                |_| name.to_owned(),
                |action: Action| self.main(action).map_or_else(|| action.name().to_owned(), |key| key.to_string()),
            );
            filled += rest;
        }
        filled
    }

    /// Whose shortcut it is.
    pub fn holder(&self, shortcut: Shortcut) -> Option<Action> {
        Action::iter().find(|action| self.all(*action).contains(&shortcut))
    }

    /// True where a person chose the keys of an action, or took one from it.
    pub(crate) fn is_changed(&self, action: Action) -> bool {
        self.all(action) != action.defaults()
    }

    /// Gives an action another shortcut in the place of its `place`th (one more behind the last), or none there. Whoever
    /// had the shortcut loses it. A shortcut that something else uses changes nothing.
    pub fn bind(&mut self, action: Action, place: usize, shortcut: Option<Shortcut>) {
        let shortcut = shortcut.map(Shortcut::plainly);
        if shortcut.is_some_and(|shortcut| shortcut.used_by().is_some()) {
            return;
        }
        let mut keys: Vec<Option<Shortcut>> = self.all(action).into_iter().map(Some).collect();
        keys.resize(keys.len().max(place.min(keys.len()) + 1), None);
        let place = place.min(keys.len() - 1);
        keys[place] = None;
        keys.retain(|key| key.is_none() || *key != shortcut);
        let place = keys.iter().position(Option::is_none).unwrap_or(keys.len());
        if let Some(key) = keys.get_mut(place) {
            *key = shortcut;
        }
        for own in self.own.values_mut() {
            own.retain(|held| Some(*held) != shortcut);
        }
        self.own.insert(action, keys.into_iter().flatten().collect());
        self.tidy();
    }

    /// Gives the defaults back, of one action or of all. A default that a person gave to another action stays there.
    pub fn reset(&mut self, action: Option<Action>) {
        match action {
            Some(action) => drop(self.own.remove(&action)),
            None => self.own.clear(),
        }
        self.tidy();
    }

    /// A binding that says the same as the defaults is not kept.
    fn tidy(&mut self) {
        let as_before: Vec<Action> = self.own.keys().copied().filter(|action| !self.is_changed(*action)).collect();
        for action in as_before {
            self.own.remove(&action);
        }
    }

    /// The bindings that a file says, and what of it is not used, in words.
    pub fn read(value: &Value) -> (Self, Vec<String>) {
        let (mut bindings, mut refused) = (Self::default(), Vec::new());
        let Value::Object(entries) = value else {
            let none = value.is_null();
            return (bindings, if none { refused } else { vec!["the keys are not a list by action".to_owned()] });
        };
        for (name, keys) in entries {
            match Self::entry(name, keys, &bindings) {
                Ok((action, keys)) => drop(bindings.own.insert(action, keys)),
                Err(why) => refused.push(format!("{name}: {why}")),
            }
        }
        bindings.tidy();
        (bindings, refused)
    }

    fn entry(name: &str, keys: &Value, before: &Self) -> Result<(Action, Vec<Shortcut>), String> {
        let action: Action = name.parse().map_err(|_| "there is no such action".to_owned())?;
        let keys = keys.as_array().ok_or("its keys are not a list")?;
        let mut own: Vec<Shortcut> = Vec::new();
        for key in keys {
            let shortcut: Shortcut = key.as_str().ok_or("a key is not a text")?.parse()?;
            if let Some(user) = shortcut.used_by() {
                return Err(format!("{shortcut} belongs to {user}"));
            }
            if let Some((other, _)) = before.own.iter().find(|(_, held)| held.contains(&shortcut)) {
                return Err(format!("{shortcut} is already the key of {}", other.name()));
            }
            if !own.contains(&shortcut) {
                own.push(shortcut);
            }
        }
        Ok((action, own))
    }
}

impl Serialize for Bindings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let text = |keys: &Vec<Shortcut>| keys.iter().map(ToString::to_string).collect::<Vec<_>>();
        serializer.collect_map(self.own.iter().map(|(action, keys)| (<&str>::from(action), text(keys))))
    }
}

/// Whatever cannot be used is left out: no key may cost the other preferences.
impl<'de> Deserialize<'de> for Bindings {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self::read(&Value::deserialize(deserializer)?).0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(text: &str) -> Shortcut {
        text.parse().unwrap()
    }

    fn texts(bindings: &Bindings, action: Action) -> Vec<String> {
        bindings.all(action).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn a_key_is_replaced_added_taken_away_and_given_back() {
        let mut keys = Bindings::default();
        assert_eq!(keys.help(Action::Redo), "Does it again (Ctrl+Shift+Z)");
        assert_eq!(keys.fill("[[redo]], [[open_demo]] or [[fit]]."), "Ctrl+Shift+Z, Open the demo or 0.");
        assert_eq!(keys.fill("Nothing to fill"), "Nothing to fill");
        assert_eq!((keys.text(Action::CameraTop).as_str(), keys.text(Action::OpenDemo).as_str()), ("Ctrl+4", ""));
        keys.bind(Action::Redo, 1, Some(key("Ctrl+J")));
        assert_eq!(texts(&keys, Action::Redo), ["Ctrl+Shift+Z", "Ctrl+J"]);
        assert_eq!((keys.holder(key("Ctrl+Y")), keys.holder(key("Ctrl+J"))), (None, Some(Action::Redo)));
        keys.bind(Action::Redo, 0, None);
        keys.bind(Action::Redo, 1, Some(key("F9")));
        keys.bind(Action::OpenDemo, 7, Some(key("F8")));
        assert_eq!(texts(&keys, Action::Redo), ["Ctrl+J", "F9"]);
        assert_eq!(texts(&keys, Action::OpenDemo), ["F8"]);
        // The key that it has already, in another place: not twice.
        keys.bind(Action::Redo, 0, Some(key("F9")));
        assert_eq!(texts(&keys, Action::Redo), ["F9"]);
        keys.bind(Action::Redo, 0, Some(key("Alt+F4")));
        assert_eq!(texts(&keys, Action::Redo), ["F9"]);
        keys.reset(Some(Action::Redo));
        assert_eq!(texts(&keys, Action::Redo), ["Ctrl+Shift+Z", "Ctrl+Y"]);
        assert!(keys.is_changed(Action::OpenDemo) && !keys.is_changed(Action::Redo));
        keys.reset(None);
        assert_eq!(keys, Bindings::default());
    }

    #[test]
    fn a_key_that_is_taken_over_has_one_action() {
        let mut keys = Bindings::default();
        keys.bind(Action::OpenDemo, 0, Some(key("Ctrl+G")));
        assert_eq!((keys.holder(key("Ctrl+G")), keys.main(Action::Generate)), (Some(Action::OpenDemo), None));
        // Its default back: it stays with whom a person gave it to, until that one has its own back.
        keys.reset(Some(Action::Generate));
        assert_eq!(keys.main(Action::Generate), None);
        keys.bind(Action::Save, 0, Some(key("Ctrl+G")));
        assert_eq!((texts(&keys, Action::OpenDemo).len(), keys.text(Action::Save)), (0, "Ctrl+G".to_owned()));
        keys.reset(Some(Action::Save));
        assert_eq!(keys.text(Action::Generate), "Ctrl+G");
        for action in Action::iter() {
            for shortcut in keys.all(action) {
                assert_eq!(keys.holder(shortcut), Some(action));
            }
        }
    }

    #[test]
    fn what_a_file_says_wrongly_falls_back_and_is_said() {
        let mut keys = Bindings::default();
        keys.bind(Action::Save, 0, Some(key("Ctrl+Shift+S")));
        keys.bind(Action::OpenDemo, 0, Some(key("Ctrl+G")));
        let written = serde_json::to_value(&keys).unwrap();
        assert_eq!(written["save"], serde_json::json!(["Ctrl+Shift+S"]));
        assert_eq!(
            (Bindings::read(&written), serde_json::from_value(written).unwrap()),
            ((keys.clone(), vec![]), keys)
        );
        let damaged = serde_json::json!({
            "fly": ["F9"], "save": ["Hyper+S"], "reload": 7, "generate": [3], "undo": ["Alt+F4"],
            "figure": ["F7"], "flag": ["F7", "F8"], "skip": [],
        });
        let (keys, refused) = Bindings::read(&damaged);
        assert_eq!(refused.len(), 6, "{refused:?}");
        assert!(refused.iter().any(|why| why == "flag: F7 is already the key of Figure…"), "{refused:?}");
        assert_eq!((keys.text(Action::Save), keys.text(Action::Figure)), ("Ctrl+S".to_owned(), "F7".to_owned()));
        assert_eq!((keys.text(Action::Flag), keys.text(Action::Skip)), ("!".to_owned(), String::new()));
        for value in [serde_json::json!(3), serde_json::json!(["save"])] {
            assert_eq!(Bindings::read(&value).1.len(), 1);
        }
        assert_eq!(Bindings::read(&Value::Null), (Bindings::default(), vec![]));
    }
}
