//! When the labels on screen were last written.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use eframe::egui::Color32;

use super::theme::Palette;
use crate::app::labels::Document;

/// State of the saving, for the status bar.
#[derive(Debug, Default)]
pub(crate) struct Saved {
    /// The pairs that were not saved yet, at the last look.
    pending: std::collections::BTreeSet<String>,
    /// When the last of them was.
    at: Option<Duration>,
}

impl Saved {
    /// Looks which pairs are unsaved now.
    pub(crate) fn observe(&mut self, unsaved: &std::collections::BTreeSet<String>) {
        if self.pending == *unsaved {
            return;
        }
        if self.pending.iter().any(|name| !unsaved.contains(name)) {
            self.at = SystemTime::now().duration_since(UNIX_EPOCH).ok();
        }
        self.pending.clone_from(unsaved);
    }
}

/// The time of day, universal time.
fn clock(since_epoch: Duration) -> String {
    let s = since_epoch.as_secs() % 86_400;
    format!("{:02}:{:02}:{:02} UTC", s / 3600, s / 60 % 60, s % 60)
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
    match saved.at {
        Some(at) => (format!("saved {}", clock(at)), p.good),
        None => (String::new(), p.weak),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_moment_of_saving_is_kept() {
        assert_eq!(clock(Duration::from_secs(86_400 * 3 + 12 * 3600 + 3 * 60 + 11)), "12:03:11 UTC");
        let mut saved = Saved::default();
        saved.observe(&["a".to_owned()].into());
        assert_eq!(saved.at, None);
        saved.observe(&[].into());
        assert!(saved.at.is_some());
    }
}
