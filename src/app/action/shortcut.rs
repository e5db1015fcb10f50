//! [`Key`] and [`Shortcut`]: what is pressed for an action.

use std::fmt;

use strum::EnumIter;

/// A key, by what is printed on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, EnumIter)]
#[expect(missing_docs, reason = "the names are the keys")]
pub enum Key {
    A,
    B,
    C,
    D,
    E,
    F,
    G,
    H,
    I,
    J,
    K,
    L,
    M,
    N,
    O,
    P,
    Q,
    R,
    S,
    T,
    U,
    V,
    W,
    X,
    Y,
    Z,
    Num0,
    Num1,
    Num2,
    Num3,
    Num4,
    Num5,
    Num6,
    Num7,
    Num8,
    ArrowLeft,
    ArrowRight,
    ArrowUp,
    ArrowDown,
    F1,
    F5,
    F11,
    F12,
    Escape,
    Enter,
    Backspace,
    Delete,
    Space,
    Home,
    End,
    PageUp,
    PageDown,
    OpenBracket,
    CloseBracket,
    Minus,
    Equals,
    Backtick,
    Comma,
    Period,
    Questionmark,
    Exclamationmark,
}

impl Key {
    /// The letter or word that is printed on it.
    pub fn text(self) -> String {
        let name = format!("{self:?}");
        match self {
            Self::Escape => "Esc".into(),
            Self::ArrowLeft => "Left".into(),
            Self::ArrowRight => "Right".into(),
            Self::ArrowUp => "Up".into(),
            Self::ArrowDown => "Down".into(),
            Self::PageUp => "PgUp".into(),
            Self::PageDown => "PgDn".into(),
            Self::OpenBracket => "[".into(),
            Self::CloseBracket => "]".into(),
            Self::Minus => "-".into(),
            Self::Equals => "=".into(),
            Self::Backtick => "`".into(),
            Self::Comma => ",".into(),
            Self::Period => ".".into(),
            Self::Questionmark => "?".into(),
            Self::Exclamationmark => "!".into(),
            _ => name.strip_prefix("Num").map_or(name.clone(), ToOwned::to_owned),
        }
    }

    /// True where it is typed with Shift on most keyboards, so that Shift says nothing about the shortcut.
    pub(crate) fn is_shifted(self) -> bool {
        matches!(self, Self::Questionmark | Self::Exclamationmark)
    }

    /// True where it writes nothing, so that it means its action while text is being typed.
    pub(crate) fn is_function(self) -> bool {
        (Self::F1..=Self::F12).contains(&self)
    }

    /// True where a text box has its own use for it together with Ctrl: undo, copy, whole words.
    pub(crate) fn is_for_text(self) -> bool {
        use Key as K;
        let moves = (K::ArrowLeft..=K::ArrowDown).contains(&self);
        let edits = matches!(self, K::A | K::C | K::V | K::X | K::Y | K::Z | K::Backspace | K::Delete | K::Enter);
        moves || edits || matches!(self, K::Home | K::End)
    }
}

/// A key with its modifiers. Ctrl stands for Cmd on a Mac.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Shortcut {
    /// True where Ctrl (Cmd) is down.
    pub ctrl: bool,
    /// True where Shift is down.
    pub shift: bool,
    /// True where Alt is down.
    pub alt: bool,
    /// The key.
    pub key: Key,
}

impl fmt::Display for Shortcut {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (down, name) in [(self.ctrl, "Ctrl+"), (self.alt, "Alt+"), (self.shift, "Shift+")] {
            if down {
                f.write_str(name)?;
            }
        }
        f.write_str(&self.key.text())
    }
}

pub(super) const fn plain(key: Key) -> Shortcut {
    Shortcut { ctrl: false, shift: false, alt: false, key }
}
pub(super) const fn shift(key: Key) -> Shortcut {
    Shortcut { shift: true, ..plain(key) }
}
pub(super) const fn alt(key: Key) -> Shortcut {
    Shortcut { alt: true, ..plain(key) }
}
pub(super) const fn alt_shift(key: Key) -> Shortcut {
    Shortcut { alt: true, ..shift(key) }
}
pub(super) const fn ctrl(key: Key) -> Shortcut {
    Shortcut { ctrl: true, ..plain(key) }
}
pub(super) const fn ctrl_shift(key: Key) -> Shortcut {
    Shortcut { ctrl: true, ..shift(key) }
}
