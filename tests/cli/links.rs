//! Every link and anchor of the pages leads somewhere.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use super::pages::{self, repository};

/// A link of a page to something in the repository.
struct Link {
    /// The link as the page has it.
    said: String,
    /// The file or folder, from the root.
    file: PathBuf,
    /// The heading, as it follows `#`.
    anchor: Option<String>,
}

/// The links of a page that stay in the repository; code has none.
fn links(page: &str, text: &str) -> Vec<Link> {
    let folder = Path::new(page).parent().unwrap();
    let prose = pages::prose(text);
    let said = prose.split("](").skip(1).map(|after| after.split(')').next().unwrap());
    let here = said.filter(|said| !said.contains("://") && !said.starts_with("mailto:"));
    here.map(|said| {
        let (path, anchor) = said.split_once('#').map_or((said, None), |(path, anchor)| (path, Some(anchor)));
        let file = if path.is_empty() { PathBuf::from(page) } else { plain(&folder.join(path)) };
        Link { said: said.to_owned(), file, anchor: anchor.map(str::to_owned) }
    })
    .collect()
}

/// The same path without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(out.pop(), "{} leads out of the repository", path.display()),
            Component::CurDir => {}
            other => out.push(other),
        }
    }
    out
}

/// The anchors of a page's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let (mut seen, mut out) = (BTreeMap::<String, usize>::new(), BTreeSet::new());
    for line in pages::fenced(text).1.lines() {
        let title = line.trim_start_matches('#');
        if title.len() == line.len() || !title.starts_with(' ') {
            continue;
        }
        let kept = title.trim().to_lowercase();
        let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        let slug: String = kept.map(|c| if c == ' ' { '-' } else { c }).collect();
        let before = seen.entry(slug.clone()).or_default();
        out.insert(if *before == 0 { slug } else { format!("{slug}-{before}") });
        *before += 1;
    }
    out
}

#[test]
fn every_link_of_the_pages_leads_somewhere() {
    let texts: BTreeMap<String, String> = pages::all().into_iter().collect();
    let (mut wrong, mut followed) = (Vec::new(), 0);
    for (page, text) in &texts {
        for Link { said, file, anchor } in links(page, text) {
            followed += 1;
            let headings = || texts.get(&*file.to_string_lossy()).map(|text| anchors(text)).unwrap_or_default();
            if !repository().join(&file).exists() {
                wrong.push(format!("{page}: ({said}): there is no {}", file.display()));
            } else if anchor.is_some_and(|anchor| !headings().contains(&anchor)) {
                wrong.push(format!("{page}: ({said}): {} has no such heading", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "links that lead nowhere:\n{}", wrong.join("\n"));
    assert!(followed >= 80, "{followed} links: were the pages read?");
}
