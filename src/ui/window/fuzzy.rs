//! Fuzzy search for the command palette.

/// Score of `query` in `text`: higher is better, `None` if its letters do not all occur in order. Case is ignored.
///
/// Letters at the start of a word and letters in a row count more; of equal fits the shorter text wins.
pub(crate) fn score(query: &str, text: &str) -> Option<i32> {
    let mut wanted = query.chars().filter(|c| !c.is_whitespace()).flat_map(char::to_lowercase).peekable();
    let mut total = 0;
    let mut previous_matched = false;
    let mut previous = ' ';
    for c in text.chars() {
        let Some(want) = wanted.peek() else { break };
        let fits = c.to_lowercase().eq(std::iter::once(*want));
        if fits {
            wanted.next();
            let starts_word = !previous.is_alphanumeric();
            total += 4 + if starts_word { 8 } else { 0 } + if previous_matched { 6 } else { 0 };
        }
        previous_matched = fits;
        previous = c;
    }
    if wanted.peek().is_some() {
        return None;
    }
    // The whole query in one piece beats scattered letters.
    let whole = !query.is_empty() && text.to_lowercase().contains(&query.trim().to_lowercase());
    Some(total + if whole { 20 } else { 0 } - i32::try_from(text.len() / 8).unwrap_or(i32::MAX / 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_in_order_are_found_and_better_fits_score_higher() {
        assert!(score("gnr", "Generate").is_some());
        assert_eq!(score("xyz", "Generate"), None);
        assert_eq!(score("eg", "ge"), None);
        assert!(score("gen", "Generate") > score("gen", "Change the range of depth and more"));
        assert!(score("fill", "Fill holes") > score("fill", "Flip the list line"));
        assert_eq!(score("", "anything at all").map(|s| s <= 0), Some(true));
    }
}
