//! [`Shortcut`]: what is pressed for an action.

use std::fmt;

/// A key with its modifiers. Ctrl stands for Cmd on a Mac.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Shortcut {
    /// True where Ctrl (Cmd) is down.
    pub ctrl: bool,
    /// True where Shift is down.
    pub shift: bool,
    /// True where Alt is down.
    pub alt: bool,
    /// The letter or word that is printed on the key.
    pub key: &'static str,
}

impl Shortcut {
    /// True where its key is typed with Shift on most keyboards, so that Shift says nothing about the shortcut.
    pub(crate) fn is_shifted(self) -> bool {
        matches!(self.key, "?" | "!")
    }

    /// True where its key writes nothing, so that it means its action while text is being typed.
    pub(crate) fn is_function(self) -> bool {
        self.key.len() > 1 && self.key.starts_with('F')
    }

    /// True where a text box has its own use for its key together with Ctrl: undo, copy, whole words.
    pub(crate) fn is_for_text(self) -> bool {
        let moves = matches!(self.key, "Left" | "Right" | "Up" | "Down" | "Home" | "End");
        moves || matches!(self.key, "A" | "C" | "V" | "X" | "Y" | "Z" | "Backspace" | "Enter")
    }
}

impl fmt::Display for Shortcut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (down, name) in [(self.ctrl, "Ctrl+"), (self.alt, "Alt+"), (self.shift, "Shift+")] {
            if down {
                f.write_str(name)?;
            }
        }
        f.write_str(self.key)
    }
}

pub(super) const fn plain(key: &'static str) -> Shortcut {
    Shortcut { ctrl: false, shift: false, alt: false, key }
}
pub(super) const fn shift(key: &'static str) -> Shortcut {
    Shortcut { shift: true, ..plain(key) }
}
pub(super) const fn alt(key: &'static str) -> Shortcut {
    Shortcut { alt: true, ..plain(key) }
}
pub(super) const fn ctrl(key: &'static str) -> Shortcut {
    Shortcut { ctrl: true, ..plain(key) }
}
pub(super) const fn ctrl_shift(key: &'static str) -> Shortcut {
    Shortcut { ctrl: true, ..shift(key) }
}
