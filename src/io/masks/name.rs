//! File names for pair names: reversible, and different for different pairs on every file system.

use sha2::Digest as _;

/// Longest escaped name; file systems end at 255 bytes and suffixes are added.
const LONGEST: usize = 180;

/// Lower-case letters, digits, `-` and `_` stay; every other byte becomes `%xx`. Capital letters are escaped too,
/// because some file systems do not tell them from small ones. Very long names end in `%%` and a hash.
pub(super) fn escape(name: &str) -> String {
    let mut out = String::with_capacity(name.len());
    for byte in name.bytes() {
        match byte {
            b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' => out.push(char::from(byte)),
            _ => out.push_str(&format!("%{byte:02x}")),
        }
    }
    if out.len() > LONGEST {
        let hash: String = sha2::Sha256::digest(name.as_bytes()).iter().map(|b| format!("{b:02x}")).collect();
        out.truncate(LONGEST - hash.len() - 2);
        out.push_str("%%");
        out.push_str(&hash);
    }
    out
}

/// The name behind [`escape`]; `None` for shortened names and for what it never returns.
pub(super) fn unescape(name: &str) -> Option<String> {
    let mut out = Vec::with_capacity(name.len());
    let mut bytes = name.bytes();
    while let Some(byte) = bytes.next() {
        if byte == b'%' {
            let digits = [bytes.next()?, bytes.next()?];
            out.push(u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?);
        } else {
            out.push(byte);
        }
    }
    String::from_utf8(out).ok().filter(|original| escape(original) == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn names_that_look_alike_stay_apart() {
        let names = ["a/b", "a_b", "a%2fb", "A/b", "a.b", "a b", "", "..", "ä", "a\u{308}"];
        let mut escaped: Vec<String> = names.iter().map(|n| escape(n).to_lowercase()).collect();
        escaped.sort();
        escaped.dedup();
        assert_eq!(escaped.len(), names.len());
        let long = |c: &str| escape(&format!("{}{c}", "x/".repeat(300)));
        assert!(long("a").len() <= LONGEST && long("a") != long("b"));
        assert_eq!(unescape(&long("a")), None);
    }

    proptest! {
        #[test]
        fn round_trip(name in "\\PC{0,40}") {
            let escaped = escape(&name);
            prop_assert!(escaped.len() > 150 || unescape(&escaped).as_deref() == Some(name.as_str()));
            prop_assert!(escaped.bytes().all(|b| b.is_ascii() && b != b'/' && b != b'.'));
        }
    }
}
