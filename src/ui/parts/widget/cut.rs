//! Texts that are too long for their place.

/// A text that is no wider than there is room, with what had to go left out of its middle: names differ at their ends.
pub(crate) fn cut_in_the_middle(text: &str, room: f32, width: impl Fn(&str) -> f32) -> String {
    if width(text) <= room {
        return text.to_owned();
    }
    let letters: Vec<char> = text.chars().collect();
    let shortened = |kept: usize| {
        let head: String = letters[..kept.div_ceil(2)].iter().collect();
        let tail: String = letters[letters.len() - kept / 2..].iter().collect();
        format!("{head}…{tail}")
    };
    let fitting = (1..letters.len()).rev().map(shortened).find(|short| width(short) <= room);
    fitting.unwrap_or_else(|| "…".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_keep_their_ends() {
        let width = |text: &str| text.chars().count() as f32;
        assert_eq!(cut_in_the_middle("data_12", 7.0, width), "data_12");
        assert_eq!(cut_in_the_middle("stl_in_millimetres_data_0", 11.0, width), "stl_i…ata_0");
        assert_eq!(cut_in_the_middle("ärger", 4.0, width), "är…r");
        assert_eq!(cut_in_the_middle("anything", 0.5, width), "…");
    }
}
