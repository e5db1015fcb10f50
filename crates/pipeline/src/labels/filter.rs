//! [`Filter`]: which pairs of a data set are meant, in the words of the list's filter box.

use crate::labels::Review;
use touch2touch_core::dataset::PairEntry;
use touch2touch_core::evaluation::Condition;

/// Words that a pair must all answer to: parts of its name, tool or note, `tool:…`, `is:…` (its review state), `note:…` and
/// `has:note`; and conditions on its scores, such as `angle>5`. Case does not count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    words: Vec<String>,
    /// The conditions on scores, which are not known here.
    pub conditions: Vec<Condition>,
}

impl Filter {
    /// Reads what a person wrote; any text is one.
    pub fn parse(text: &str) -> Self {
        let mut words: Vec<String> = text.split_whitespace().map(str::to_lowercase).collect();
        let conditions = words.iter().filter_map(|word| Condition::parse(word)).collect();
        words.retain(|word| Condition::parse(word).is_none());
        Self { words, conditions }
    }

    /// True where a pair with this review state and note answers to all words; the conditions are for the caller.
    pub fn passes(&self, pair: &PairEntry, review: Review, note: &str) -> bool {
        let [name, tool, note] = [&pair.name, pair.tool.as_deref().unwrap_or(""), note].map(str::to_lowercase);
        self.words.iter().all(|word| {
            if let Some(part) = word.strip_prefix("tool:") {
                tool.contains(part)
            } else if let Some(state) = word.strip_prefix("is:") {
                review.name().replace(' ', "-").starts_with(state)
            } else if let Some(part) = word.strip_prefix("note:") {
                note.contains(part)
            } else if word == "has:note" {
                !note.is_empty()
            } else {
                [&name, &tool, &note].into_iter().any(|text| text.contains(word.as_str()))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use touch2touch_core::dataset::Split;

    #[test]
    fn words_ask_for_name_tool_state_and_note() {
        let (name, tool) = ("rod/Data_7".into(), Some("Rod_12".into()));
        let pair = PairEntry { name, tool, split: Split::Train, number: 7 };
        let passes = |text: &str| Filter::parse(text).passes(&pair, Review::InProgress, "Blurred edge");
        for yes in ["", "data_7", "ROD data", "tool:rod", "is:in-progress", "is:in", "note:edge", "has:note", "blurred"]
        {
            assert!(passes(yes), "{yes}");
        }
        for no in ["data_8", "tool:data", "is:done", "note:rod", "rod nothing"] {
            assert!(!passes(no), "{no}");
        }
        assert!(!Filter::parse("has:note").passes(&pair, Review::Todo, ""));
        let scored = Filter::parse("angle>5 rod");
        assert_eq!(scored.conditions.len(), 1);
        assert!(scored.passes(&pair, Review::Todo, ""), "scores are not its business");
    }
}
