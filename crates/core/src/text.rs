//! Text from files on its way to a terminal: what would move the cursor, change colors or turn the order of letters there
//! is written as an escape.

use std::borrow::Cow;

/// True where a character says something to the terminal instead of being shown: control characters, and those that
/// turn the order of the letters after them.
pub(crate) fn is_unprintable(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text with what is unprintable as `\u001b`, which also is its escape in JSON; line breaks and tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    let bad = |c: char| is_unprintable(c) && !matches!(c, '\n' | '\t');
    if !text.contains(bad) {
        return Cow::Borrowed(text);
    }
    let shown = |c: char| if bad(c) { format!("\\u{:04x}", u32::from(c)) } else { c.into() };
    Cow::Owned(text.chars().map(shown).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_would_obey_is_shown_instead() {
        let evil = "a\u{1b}[31mred\u{7}\r\u{9b}2J\u{202e}gnp.\u{7f}";
        let shown = printable(evil);
        assert_eq!(shown, r"a\u001b[31mred\u0007\u000d\u009b2J\u202egnp.\u007f");
        assert!(!shown.contains(is_unprintable));
        // Inside a JSON text the escapes stand for the same characters.
        let json = printable(&serde_json::to_string(evil).unwrap()).into_owned();
        assert!(!json.contains(is_unprintable));
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), evil);
        for fine in ["", "zwei\tSpalten\nund 25 °", "Fréchet – 0.3 mm", "图像"] {
            assert!(matches!(printable(fine), Cow::Borrowed(text) if text == fine));
        }
    }
}
