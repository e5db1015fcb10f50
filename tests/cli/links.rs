//! Every link and anchor of the pages leads somewhere, and every file of docs is reached from its index.

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

#[test]
fn every_file_of_docs_is_reached_from_its_index() {
    let texts: BTreeMap<String, String> = pages::all().into_iter().collect();
    let index = Path::new("docs").join("README.md");
    let links_of = |file: &Path| {
        let page = file.to_string_lossy().into_owned();
        texts.get(&page).map(|text| links(&page, text)).unwrap_or_default()
    };
    let listed: BTreeSet<PathBuf> = links_of(&index).into_iter().map(|link| link.file).collect();
    for page in texts.keys().map(PathBuf::from).filter(|page| *page != index) {
        assert!(listed.contains(&page), "{} has no line for {}", index.display(), page.display());
    }
    let mut reached = listed;
    let mut unread: Vec<PathBuf> = reached.iter().cloned().collect();
    while let Some(file) = unread.pop() {
        for link in links_of(&file) {
            if reached.insert(link.file.clone()) {
                unread.push(link.file);
            }
        }
    }
    reached.insert(index);
    let files = std::fs::read_dir(repository().join("docs")).unwrap();
    let files = files.map(|entry| Path::new("docs").join(entry.unwrap().file_name()));
    let lost: Vec<String> =
        files.filter(|file| !reached.contains(file)).map(|file| file.display().to_string()).collect();
    assert!(lost.is_empty(), "no page leads to {}", lost.join(", "));
}
