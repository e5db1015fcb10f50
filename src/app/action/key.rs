//! [`Key`] and [`Shortcut`]: what is pressed for an action.

use std::fmt;
use std::str::FromStr;

use strum::{EnumIter, IntoEnumIterator as _};

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
    Num9,
    ArrowLeft,
    ArrowRight,
    ArrowUp,
    ArrowDown,
    F1,
    F2,
    F3,
    F4,
    F5,
    F6,
    F7,
    F8,
    F9,
    F10,
    F11,
    F12,
    Escape,
    Enter,
    Backspace,
    Insert,
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
    Semicolon,
    Quote,
    Slash,
    Backslash,
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
            Self::Semicolon => ";".into(),
            Self::Quote => "'".into(),
            Self::Slash => "/".into(),
            Self::Backslash => "\\".into(),
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

impl FromStr for Shortcut {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut parts: Vec<&str> = text.split('+').collect();
        let last = parts.pop().unwrap_or_default();
        let key = Key::iter().find(|key| key.text() == last).ok_or_else(|| format!("there is no key {last:?}"))?;
        let mut shortcut = plain(key);
        for part in parts {
            match part {
                "Ctrl" => shortcut.ctrl = true,
                "Alt" => shortcut.alt = true,
                "Shift" => shortcut.shift = true,
                _ => return Err(format!("there is no modifier {part:?}")),
            }
        }
        Ok(shortcut.plainly())
    }
}

impl Shortcut {
    /// The shortcut without Shift where the key itself is typed with it.
    #[must_use]
    pub(crate) fn plainly(self) -> Self {
        match self.key {
            Key::Slash if self.shift => Self { shift: false, key: Key::Questionmark, ..self },
            Key::Num1 if self.shift => Self { shift: false, key: Key::Exclamationmark, ..self },
            key => Self { shift: self.shift && !key.is_shifted(), ..self },
        }
    }

    /// Who else uses it, so that it cannot be an action's: the desktop around the window, text boxes, or a pane itself.
    pub(crate) fn used_by(self) -> Option<&'static str> {
        use Key as K;
        let arrow = (K::ArrowLeft..=K::ArrowDown).contains(&self.key);
        Some(match self {
            Self { ctrl: true, alt: true, key, .. }
                if arrow || key.is_function() || matches!(key, K::Delete | K::Backspace | K::L | K::T) =>
            {
                "the desktop"
            }
            // GNOME, KDE and Windows: menus, closing, moving and sizing windows, going from one to the other.
            Self { ctrl: false, alt: true, key, .. }
                if (K::F1..=K::F10).contains(&key) || matches!(key, K::Space | K::Escape | K::Backtick) =>
            {
                "the desktop"
            }
            Self { ctrl: true, alt: false, key: K::Escape, .. } => "the desktop",
            Self { ctrl: true, alt: false, shift: false, key: K::X | K::V } => "cutting and pasting",
            Self { ctrl: true, alt: false, key: K::Minus | K::Equals | K::Num0, .. } => "the zoom of the window",
            Self { ctrl: false, alt: false, shift: false, key: K::F } => {
                "the Compare pane, which shows B while it is held"
            }
            _ => return None,
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shortcut_is_read_as_it_is_written() {
        for key in Key::iter() {
            for bits in 0..8 {
                let s = Shortcut { ctrl: bits & 1 > 0, shift: bits & 2 > 0, alt: bits & 4 > 0, key }.plainly();
                assert_eq!(s.to_string().parse(), Ok(s));
            }
        }
        assert_eq!("Shift+/".parse(), Ok(plain(Key::Questionmark)));
        for bad in ["", "Ctrl+", "Ctrl", "Super+A", "a", "Ctrl + A", "Ctrl+AB"] {
            assert!(bad.parse::<Shortcut>().is_err(), "{bad:?}");
        }
    }

    #[test]
    fn what_window_managers_use_is_known() {
        for text in [
            "Alt+F4",
            "Alt+F2",
            "Alt+Space",
            "Alt+Esc",
            "Alt+Shift+Esc",
            "Ctrl+Alt+Left",
            "Ctrl+Alt+Right",
            "Ctrl+Alt+Up",
            "Ctrl+Alt+Down",
            "Ctrl+Alt+Shift+Left",
            "Ctrl+Alt+F1",
            "Ctrl+Alt+F12",
            "Ctrl+Alt+Delete",
            "Ctrl+Alt+T",
            "Ctrl+V",
        ] {
            assert!(text.parse::<Shortcut>().unwrap().used_by().is_some(), "{text}");
        }
        for text in ["Alt+Left", "Ctrl+F4", "F4", "Ctrl+Shift+V", "Esc", "Shift+F", "Ctrl+F"] {
            assert_eq!(text.parse::<Shortcut>().unwrap().used_by(), None, "{text}");
        }
        // Tab, Print and the key with the desktop's sign cannot be chosen at all.
        for name in ["Tab", "Print", "Super"] {
            assert!(Key::iter().all(|key| key.text() != name && format!("{key:?}") != name));
        }
    }
}
