//! State of the saving of the labels on screen.

use eframe::egui::Color32;

use super::theme::Palette;
use crate::app::labels::Document;

/// State of the saving, for the status bar.
#[derive(Debug, Default)]
pub(crate) struct Saved {
    /// The pairs that were not saved yet, at the last look.
    pending: std::collections::BTreeSet<String>,
    /// True once one of them was.
    once: bool,
}

impl Saved {
    /// Looks which pairs are unsaved now.
    pub(crate) fn observe(&mut self, unsaved: &std::collections::BTreeSet<String>) {
        if self.pending == *unsaved {
            return;
        }
        self.once |= self.pending.iter().any(|name| !unsaved.contains(name));
        self.pending.clone_from(unsaved);
    }
}

/// The state of a pair in words, with its color.
pub(crate) fn text(saved: &Saved, doc: &Document, pair: &str, p: &Palette) -> (String, Color32) {
    if doc.failed.contains_key(pair) {
        return ("not saved".into(), p.wrong);
    }
    if doc.unsaved.contains(pair) {
        return ("saving…".into(), p.caution);
    }
    if doc.elsewhere.contains(pair) {
        return ("saved elsewhere".into(), p.caution);
    }
    if saved.once { ("saved".into(), p.good) } else { (String::new(), p.weak) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_saved_is_known_when_it_is() {
        let mut saved = Saved::default();
        saved.observe(&["a".to_owned()].into());
        assert!(!saved.once);
        saved.observe(&[].into());
        assert!(saved.once);
    }
}
