//! [`Findings`]: equal problems of many files as one entry with a count and examples.

use std::collections::HashMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::dataset::Problem;

/// Files named for one finding.
const EXAMPLES: usize = 5;

/// One kind of problem, found `count` times. `file`, `what` and `hint` are those of the first, as in a [`Problem`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// The file or folder.
    pub file: PathBuf,
    /// Fault of the file, in words.
    pub what: String,
    /// Remedy, in words.
    pub hint: String,
    /// Number of times it was found.
    pub count: usize,
    /// The first files it was found in, `file` among them; each once.
    pub examples: Vec<PathBuf>,
}

/// Problems by kind, in the order in which the kinds were met. Its size does not grow with the number of files.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    list: Vec<Finding>,
    /// Position of each kind in `list`.
    kinds: HashMap<String, usize>,
}

impl Findings {
    /// Adds a problem; true where it is the first of its kind.
    pub fn add(&mut self, problem: Problem) -> bool {
        let index = *self.kinds.entry(kind(&problem)).or_insert(self.list.len());
        let Some(finding) = self.list.get_mut(index) else {
            let Problem { file, what, hint } = problem;
            self.list.push(Finding { examples: vec![file.clone()], file, what, hint, count: 1 });
            return true;
        };
        finding.count += 1;
        if finding.examples.len() < EXAMPLES && !finding.examples.contains(&problem.file) {
            finding.examples.push(problem.file);
        }
        false
    }

    /// The kinds found so far.
    pub fn list(&self) -> &[Finding] {
        &self.list
    }

    /// The kinds found.
    pub fn into_list(self) -> Vec<Finding> {
        self.list
    }
}

impl Extend<Problem> for Findings {
    fn extend<T: IntoIterator<Item = Problem>>(&mut self, problems: T) {
        for problem in problems {
            self.add(problem);
        }
    }
}

/// Text that two problems have in common that differ only in file, finger or numbers.
fn kind(problem: &Problem) -> String {
    let part = |name: Option<&std::ffi::OsStr>| name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut text = format!("{} {}", problem.what, problem.hint);
    // The longest first: each is part of the one before.
    let names =
        [problem.file.to_string_lossy().into_owned(), part(problem.file.file_name()), part(problem.file.file_stem())];
    for name in names.iter().filter(|name| name.len() > 1) {
        text = text.replace(name.as_str(), "FILE");
    }
    let mut kind = String::with_capacity(text.len());
    for word in text.split_whitespace() {
        let bare = word.trim_matches(|c: char| !c.is_alphanumeric());
        match bare {
            "right" | "left" => kind.push_str("FINGER"),
            "NaN" | "inf" => kind.push('#'),
            // Another file of the same finding, such as the pair's other half.
            _ if word.contains(['/', '\\']) => kind.push_str("FILE"),
            _ => push_without_numbers(&mut kind, word),
        }
        // "[1, NaN]" and "[NaN, 1]" are the same but for the numbers; so are lists of other lengths.
        if kind.ends_with("# #") {
            kind.truncate(kind.len() - 2);
        }
        kind.push(' ');
    }
    kind
}

/// `word` with each number, its sign and exponent as one `#`; brackets and commas around numbers are left out.
fn push_without_numbers(kind: &mut String, word: &str) {
    let number_only = word.trim_matches(['[', ']', '(', ')', ',', ';', ':']);
    if number_only.parse::<f64>().is_ok() {
        kind.push('#');
        return;
    }
    let mut in_number = false;
    for c in word.chars() {
        let part = c.is_ascii_digit() || (in_number && matches!(c, '.' | 'e' | '-'));
        if part && !in_number {
            kind.push('#');
        } else if !part {
            kind.push(c);
        }
        in_number = part;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn problem(file: &str, what: &str) -> Problem {
        Problem { file: file.into(), what: what.into(), hint: "look".into() }
    }

    fn grouped(problems: &[(&str, &str)]) -> Vec<Finding> {
        let mut findings = Findings::default();
        findings.extend(problems.iter().map(|(file, what)| problem(file, what)));
        findings.into_list()
    }

    #[test]
    fn files_fingers_and_numbers_do_not_make_a_kind() {
        for [a, b] in [
            ["the right imprint reaches from -0.0001 to 0.5000", "the left imprint reaches from 0.1 to 12.25"],
            ["damaged file: too short (/d/a_1.pt)", "damaged file: too short (/d/b_22.pt)"],
            [
                "theta, x, y [0.1, 0.2, 0.3] differ from [1.0, NaN, -3e-7] in /e/a_1.pt",
                "theta, x, y [inf, 4, 5] differ from [-1.0, 0, 3] in /e/b_22.pt",
            ],
            [
                "key \"K\", right finger: Intrinsics { fx: 1.5, fy: NaN }",
                "key \"K\", left finger: Intrinsics { fx: -2, fy: 3e9 }",
            ],
            ["its other half is missing: no a_1 in gelslims", "its other half is missing: no b_22 in gelslims"],
            ["0.31 % of pixels (3 NaN, 0 infinite)", "22.00 % of pixels (1200 NaN, 7 infinite)"],
        ] {
            let findings = grouped(&[("/d/a_1.pt", a), ("/d/b_22.pt", b)]);
            assert_eq!(findings.len(), 1, "{findings:#?}");
            assert_eq!((findings[0].count, findings[0].examples.len(), findings[0].what.as_str()), (2, 2, a));
        }
    }
}
