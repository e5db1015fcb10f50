//! One word for a thing: what docs/glossary.md has replaced is said nowhere.

use strum::IntoEnumIterator as _;
use touch2touch::app::action::Action;
use touch2touch::app::pane::Pane;

use super::pages::{self, prose};
use crate::support::run;

/// A word that is not said any more, and the one that is.
const REPLACED: &[(&str, &str)] = &[("dataset", "data set"), ("datasets", "data sets")];
/// The same for the studio, whose texts are of nothing else.
const ON_SCREEN: &[(&str, &str)] = &[("sample", "pair"), ("samples", "pairs"), ("settings", "preferences")];

fn check(place: &str, text: &str, replaced: &[(&str, &str)]) {
    let words = text.split(|c: char| !(c.is_alphanumeric() || "_-/.<>=".contains(c)));
    for word in words.map(|word| word.trim_end_matches('.').to_lowercase()) {
        if let Some((old, new)) = replaced.iter().find(|(old, _)| *old == word) {
            panic!("{place} says {old:?}; the word is {new:?} (docs/glossary.md)");
        }
    }
}

#[test]
fn replaced_words_are_said_nowhere() {
    for (page, text) in pages::all() {
        let text = prose(&text);
        assert!(text.split_whitespace().count() > 100, "{page}");
        check(&page, &text, REPLACED);
    }
    for action in Action::iter() {
        let text = format!("{}. {}", action.name(), action.tooltip());
        check(&format!("{action:?}"), &text, &[REPLACED, ON_SCREEN].concat());
    }
    for pane in Pane::iter() {
        check(&format!("{pane:?}"), &format!("{}. {}", pane.title(), pane.tip()), &[REPLACED, ON_SCREEN].concat());
    }
    let home = tempfile::tempdir().unwrap();
    let overview = String::from_utf8(run(&["--help"], home.path()).stdout).unwrap();
    check("--help", &overview, REPLACED);
    let verbs = overview.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let mut found = 0;
    for verb in verbs.take_while(|line| line.starts_with("  ")).filter(|line| !line.starts_with("   ")) {
        let verb = verb.split_whitespace().next().unwrap();
        let help = String::from_utf8(run(&[verb, "--help"], home.path()).stdout).unwrap();
        // The names of verbs below a verb were published.
        let told = help.lines().map(|line| match line.strip_prefix("  ") {
            Some(listed) if listed.starts_with(|c: char| c.is_ascii_lowercase()) => {
                listed.split_once(' ').map_or("", |(_, tip)| tip)
            }
            _ => line,
        });
        check(verb, &told.collect::<Vec<_>>().join("\n"), REPLACED);
        found += 1;
    }
    assert!(found > 15, "{found} verbs\n{overview}");
}
