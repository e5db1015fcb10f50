//! [`Key`] and [`Shortcut`]: what is pressed for an action.

/// A key, by what is printed on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
    F5,
    F11,
    F12,
    Escape,
    Enter,
    Backspace,
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
    /// What is printed on it.
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
}

/// A key with its modifiers. Ctrl stands for Cmd on a Mac.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Shortcut {
    /// Whether Ctrl (Cmd) is down.
    pub ctrl: bool,
    /// Whether Shift is down.
    pub shift: bool,
    /// Whether Alt is down.
    pub alt: bool,
    /// The key.
    pub key: Key,
}

impl std::fmt::Display for Shortcut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
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
pub(super) const fn ctrl_alt(key: Key) -> Shortcut {
    Shortcut { alt: true, ..ctrl(key) }
}
