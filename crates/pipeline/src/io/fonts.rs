//! The typeface of the window; and fonts of this computer for East Asian letters,
//! which it lacks.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use ab_glyph::{Font as _, FontRef};

use crate::io::{files, folders};

/// Roboto Regular, a TrueType file (see `assets/fonts/README.md`).
pub static REGULAR: &[u8] = include_bytes!("../../../../assets/fonts/Roboto-Regular.ttf");

/// Advice where no font of this computer has a letter.
pub const ADVICE: &str =
    "Install a font that has them (on Debian or Ubuntu: fonts-noto-cjk) and start the program again.";

/// Starts of the names of files with East Asian letters, small and without separators: those first that have the letters of all
/// languages.
const KNOWN: &str = "notosanscjk sourcehansans notosansmonocjk notoserifcjk sourcehanserif wqymicrohei wqyzenhei \
    droidsansfallback arialunicode notosanssc notosanstc notosansjp notosanskr pingfang hiragino \
    applesdgothic msyh yugoth msgothic malgun simsun ipaexg ipag takao vlgothic vlpgothic nanumgothic \
    nanumbarun undotum baekmuk uming ukai unifont";
/// Words in the names of files that are not of a text's usual weight.
const WEIGHTS: &[&str] = &["bold", "light", "thin", "black", "medium", "heavy"];
/// Most bytes of a font.
const MOST: u64 = 256 << 20;
/// Most files that are looked at for one.
const MOST_FILES: usize = 50_000;

/// A font of this computer.
pub struct SystemFont {
    /// The name of its file.
    pub name: &'static str,
    /// Content of the file; of a collection the first font counts.
    pub bytes: &'static [u8],
}

/// True for letters of Chinese, Japanese and Korean, and signs among them.
pub fn is_east_asian(letter: char) -> bool {
    matches!(u32::from(letter),
        0x1100..=0x11FF | 0x2E80..=0x9FFF | 0xA960..=0xA97F | 0xAC00..=0xD7FF | 0xF900..=0xFAFF | 0xFE30..=0xFE4F
        | 0xFF00..=0xFFEF | 0x20000..=0x3FFFF)
}

/// The font of this computer that has all `letters`; its file is read at the first call that needs it, and kept.
pub fn covering(letters: &[char]) -> Option<&'static SystemFont> {
    static INSTALLED: OnceLock<Vec<Candidate>> = OnceLock::new();
    let installed = INSTALLED.get_or_init(|| {
        let mut files = Vec::new();
        folders::fonts().iter().for_each(|folder| find(folder, 0, &mut files));
        ranked(files).into_iter().map(|file| Candidate { file, font: OnceLock::new() }).collect()
    });
    first_with(installed, letters)
}

fn first_with(candidates: &[Candidate], letters: &[char]) -> Option<&'static SystemFont> {
    let has_all = |font: &SystemFont| {
        let read = FontRef::try_from_slice(font.bytes);
        read.is_ok_and(|read| letters.iter().all(|letter| read.glyph_id(*letter).0 != 0))
    };
    candidates.iter().filter_map(Candidate::font).find(|font| has_all(font))
}

/// A file that may be read.
struct Candidate {
    file: PathBuf,
    /// The font, once it was asked for; it stays for the rest of the run, as the window wants it.
    font: OnceLock<Option<&'static SystemFont>>,
}

impl Candidate {
    fn font(&self) -> Option<&'static SystemFont> {
        *self.font.get_or_init(|| {
            let bytes = files::read(&self.file, MOST).ok()?;
            FontRef::try_from_slice(&bytes).ok()?;
            let name = String::leak(self.file.file_name()?.to_string_lossy().into_owned());
            Some(Box::leak(Box::new(SystemFont { name, bytes: Vec::leak(bytes) })))
        })
    }
}

/// The fonts below a folder.
fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        if found.len() >= MOST_FILES {
            return;
        }
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        if matches!(ending.as_str(), "ttf" | "ttc" | "otf" | "otc") {
            found.push(path);
        } else if depth < 6 && path.is_dir() {
            find(&path, depth + 1, found);
        }
    }
}

/// Files that are known to have East Asian letters, the best first.
fn ranked(files: Vec<PathBuf>) -> Vec<PathBuf> {
    let rank = |file: &PathBuf| {
        let name = file.file_stem()?.to_string_lossy().to_lowercase().replace(['-', '_', ' '], "");
        let known = KNOWN.split(' ').position(|start| name.starts_with(start))?;
        Some((known, WEIGHTS.iter().any(|weight| name.contains(weight)), name))
    };
    let mut ranked: Vec<_> = files.into_iter().filter_map(|file| Some((rank(&file)?, file))).collect();
    ranked.sort();
    ranked.into_iter().map(|(_, file)| file).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_with_the_most_languages_in_its_usual_weight_comes_first() {
        let names = [
            "unifont.otf",
            "DejaVuSans.ttf",
            "NotoSansCJK-Bold.ttc",
            "wqy-microhei.ttc",
            "NotoSansCJK-Regular.ttc",
            "NanumGothic.ttf",
            "NotoSans-Regular.ttf",
        ];
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir_all(dir.path().join("a/b")).unwrap();
        for name in names.iter().chain(&["NotoSansCJK-Regular.txt"]) {
            std::fs::write(dir.path().join("a/b").join(name), "").unwrap();
        }
        let mut found = Vec::new();
        find(dir.path(), 0, &mut found);
        let ranked: Vec<_> =
            ranked(found).iter().map(|f| f.file_name().unwrap().to_string_lossy().into_owned()).collect();
        assert_eq!(
            ranked,
            ["NotoSansCJK-Regular.ttc", "NotoSansCJK-Bold.ttc", "wqy-microhei.ttc", "NanumGothic.ttf", "unifont.otf"]
        );
    }

    #[test]
    fn a_font_counts_for_the_letters_that_it_has_and_a_damaged_one_for_none() {
        let dir = tempfile::tempdir().unwrap();
        let candidate = |name: &str, bytes: &[u8]| {
            std::fs::write(dir.path().join(name), bytes).unwrap();
            Candidate { file: dir.path().join(name), font: OnceLock::new() }
        };
        let candidates = [candidate("damaged.ttc", &REGULAR[..2000]), candidate("latin.ttf", REGULAR)];
        assert_eq!(first_with(&candidates, &['a', 'é']).map(|font| font.name), Some("latin.ttf"));
        assert!(first_with(&candidates, &['a', '漢']).is_none());
        // Once: it is kept.
        std::fs::remove_file(dir.path().join("latin.ttf")).unwrap();
        assert!(first_with(&candidates, &['b']).is_some());
    }

    #[test]
    fn letters_of_three_languages_are_east_asian_and_those_of_others_are_not() {
        assert_eq!("a漢é仮カ한°ｱ、Ж".chars().filter(|letter| is_east_asian(*letter)).count(), 6);
    }
}
