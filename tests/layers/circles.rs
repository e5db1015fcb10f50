//! No circle among the modules of a layer.
//!
//! A module is a file with the folder of its name. In each layer, and again in each folder, the modules that lie side
//! by side must not need each other in a circle: one could be neither read nor changed without the others. One needs
//! another where any of its files (tests left out) names an item of it, however deep and by whatever path: `crate::`,
//! `super::`, a name that the parent imported or re-exports, one of several in braces, or a name in an imported module.
//!
//! A parent and what lies in its own folder are one feature: the parent puts its children together and re-exports them,
//! and the children use its types. What they take from the parent itself is no arrow here; what they take through it from
//! another child is.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::code;
use crate::support::rust_files;

/// The crates below the application; in names, a crate is the root of its modules.
const CRATES: &[&str] = &["core", "pipeline"];

/// The crates and layers without a circle. A layer that has become free of them is added here and stays so.
const LAYERS: &[&str] = &["core", "pipeline", "gpu", "spatial", "headless", "app", "ui"];

/// A path in the crate, such as `["domain", "align", "icp"]`.
type Name = Vec<String>;

/// The code of each module.
type Sources = BTreeMap<Name, String>;

/// For each module, which modules beside it its files name, each with one of the names.
type Arrows = BTreeMap<String, BTreeMap<String, String>>;

fn parts(path: &str) -> Name {
    path.split("::").map(|part| part.trim().to_owned()).filter(|part| !part.is_empty()).collect()
}

/// The files of a layer without those that are only compiled for tests.
fn sources(layer: &str) -> Sources {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    let src = if CRATES.contains(&layer) {
        let src = root.join("crates").join(layer).join("src");
        rust_files(&src, &mut files);
        src
    } else {
        let src = root.join("src");
        files.push(src.join(format!("{layer}.rs")));
        rust_files(&src.join(layer), &mut files);
        src
    };
    let mut all = Sources::new();
    let mut for_tests = BTreeSet::new();
    for file in files {
        let module = file.strip_prefix(&src).unwrap().with_extension("");
        let mut module: Name = module.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        if CRATES.contains(&layer) {
            module.retain(|part| part != "lib");
            module.insert(0, layer.to_owned());
        }
        let text = std::fs::read_to_string(&file).unwrap();
        for after in text.split("#[cfg(test)]").skip(1) {
            let line = after.trim_start().lines().next().unwrap_or_default();
            if let Some(name) = line.strip_suffix(';').and_then(|line| line.split("mod ").nth(1)) {
                for_tests.insert([module.clone(), vec![name.to_owned()]].concat());
            }
        }
        all.insert(module, code(&text));
    }
    all.retain(|module, _| !for_tests.contains(module));
    all
}

/// The paths of a `use`, braces spelt out, each with the name that it gets: `a::{self, b as c}` is `a` as `a`, `a::b`
/// as `c`.
fn leaves(path: &str, tree: &str, out: &mut Vec<(Name, String)>) {
    let Some((before, inside)) = tree.split_once('{') else {
        let (path, alias) = match tree.split_once(" as ") {
            Some((end, alias)) => (format!("{path}{end}"), Some(alias.trim().to_owned())),
            None => (format!("{path}{tree}"), None),
        };
        let mut path = parts(&path);
        if path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        if let Some(last) = path.last().cloned() {
            out.push((path, alias.unwrap_or(last)));
        }
        return;
    };
    let path = format!("{path}{}", before.trim());
    let inside = inside.rsplit_once('}').map_or(inside, |(inside, _)| inside);
    let (mut depth, mut begin) = (0, 0);
    for (at, c) in inside.char_indices().chain([(inside.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                leaves(&path, inside[begin..at].trim(), out);
                begin = at + 1;
            }
            _ => {}
        }
    }
}

/// A path as it is written in `module`, from the root of the crate; `None` for what lies in another crate.
fn absolute(module: &[String], path: &[String], sources: &Sources) -> Option<Name> {
    let up = path.iter().take_while(|part| *part == "super").count();
    match path.first()?.as_str() {
        "crate" => {
            let root = usize::from(module.first().is_some_and(|first| CRATES.contains(&first.as_str())));
            Some([&module[..root], &path[1..]].concat())
        }
        "self" => Some([module, &path[1..]].concat()),
        "super" => Some([&module[..module.len().saturating_sub(up)], &path[up..]].concat()),
        _ => {
            let child = [module, &path[..1]].concat();
            sources.contains_key(&child).then(|| [module, path].concat())
        }
    }
}

/// What the files name and import: by module the paths, and for each imported name what it stands for.
fn names(sources: &Sources) -> (BTreeMap<Name, BTreeSet<Name>>, BTreeMap<Name, Name>) {
    let mut named: BTreeMap<Name, BTreeSet<Name>> = BTreeMap::new();
    let mut imported = BTreeMap::new();
    for (module, text) in sources {
        let own = named.entry(module.clone()).or_default();
        let mut rest = String::new();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let words = line.trim_start();
            let visible = words.strip_prefix("pub").map_or(words, |words| {
                words.strip_prefix('(').and_then(|words| words.split_once(')')).map_or(words, |(_, words)| words)
            });
            let Some(begin) = visible.trim_start().strip_prefix("use ") else {
                rest += line;
                rest.push('\n');
                continue;
            };
            let mut tree = begin.to_owned();
            while !tree.trim_end().ends_with(';') {
                tree += " ";
                tree += lines.next().unwrap_or(";").trim();
            }
            let mut paths = Vec::new();
            leaves("", tree.trim_end().trim_end_matches(';'), &mut paths);
            for (path, name) in paths {
                if let Some(path) = absolute(module, &path, sources) {
                    assert_ne!(name, "*", "{}: a glob hides what is named", module.join("::"));
                    imported.insert([module.clone(), vec![name]].concat(), path.clone());
                    own.insert(path);
                }
            }
        }
        let inside = |c: char| c.is_alphanumeric() || c == '_';
        // What is named through an imported module: `results::pose` after `use super::results;`.
        let through: Vec<String> = imported
            .range([module.clone(), vec![String::new()]].concat()..)
            .take_while(|(name, _)| name.starts_with(module))
            .filter(|(name, path)| name.len() == module.len() + 1 && sources.contains_key(*path))
            .filter_map(|(name, _)| Some(format!("{}::", name.last()?)))
            .collect();
        for start in through.iter().map(String::as_str).chain(["crate::", "super::", "self::"]) {
            for (at, _) in rest.match_indices(start) {
                if rest[..at].ends_with(|c| inside(c) || c == ':') {
                    continue;
                }
                let end = rest[at..].find(|c| !inside(c) && c != ':').map_or(rest.len(), |end| at + end);
                let path = parts(&rest[at..end]);
                own.extend(match imported.get(&[&module[..], &path[..1]].concat()) {
                    Some(target) => Some([target, &path[1..]].concat()),
                    None => absolute(module, &path, sources),
                });
            }
        }
    }
    (named, imported)
}

/// The item itself, where a path leads over imported names.
fn resolved(mut path: Name, sources: &Sources, imported: &BTreeMap<Name, Name>) -> Name {
    // As many imports as could follow each other; a name that is imported under its own name ends it.
    for _ in 0..8 {
        let next = (1..=path.len()).rev().find_map(|end| {
            let target = imported.get(&path[..end]).filter(|_| !sources.contains_key(&path[..end]))?;
            Some([target, &path[end..]].concat())
        });
        match next {
            Some(next) if next != path => path = next,
            _ => break,
        }
    }
    path
}

/// Who needs whom, by the module that they lie in.
fn arrows(sources: &Sources) -> BTreeMap<Name, Arrows> {
    let (named, imported) = names(sources);
    let mut all: BTreeMap<Name, Arrows> = BTreeMap::new();
    for (module, paths) in named {
        for path in paths {
            let path = resolved(path, sources, &imported);
            let common = module.iter().zip(&path).take_while(|(a, b)| a == b).count();
            let beside = path.get(..=common).filter(|beside| sources.contains_key(*beside));
            if let (Some(own), Some(beside), true) = (module.get(common), beside, common > 0) {
                let why = format!("{} names {}", module.join("::"), path.join("::"));
                let from = all.entry(module[..common].to_vec()).or_default();
                from.entry(own.clone()).or_default().entry(beside[common].clone()).or_insert(why);
            }
        }
    }
    all
}

/// A circle among modules that lie side by side, if there is one, with a reason for each step.
fn circle(arrows: &Arrows) -> Option<Vec<&str>> {
    fn visit<'a>(
        at: &'a str,
        arrows: &'a Arrows,
        path: &mut Vec<(&'a str, &'a str)>,
        done: &mut BTreeSet<&'a str>,
    ) -> Option<Vec<&'a str>> {
        if let Some(from) = path.iter().position(|(module, _)| *module == at) {
            return Some(path[from..].iter().map(|(_, why)| *why).collect());
        }
        if done.contains(at) {
            return None;
        }
        for (next, why) in arrows.get(at).into_iter().flatten() {
            path.push((at, why));
            let found = visit(next, arrows, path, done);
            path.pop();
            if found.is_some() {
                return found;
            }
        }
        done.insert(at);
        None
    }
    let mut done = BTreeSet::new();
    arrows.keys().find_map(|module| visit(module, arrows, &mut Vec::new(), &mut done))
}

#[test]
fn the_modules_of_a_layer_form_no_circle() {
    let mut found = Vec::new();
    for layer in LAYERS {
        let arrows = arrows(&sources(layer));
        // The window's modules lie in rooms: its largest folder counts.
        let most = arrows.values().map(BTreeMap::len).max();
        let few = if *layer == "spatial" { 1 } else { 5 };
        assert!(most > Some(few), "{layer}: the scan sees too little: {arrows:?}");
        for (folder, arrows) in &arrows {
            if let Some(circle) = circle(arrows) {
                found.push(format!("a circle in {}:\n    {}", folder.join("::"), circle.join("\n    ")));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The modules of `app` from which everything else there is made: they know nothing of what acts on them.
const MODEL: &[&str] = &["action", "jobs", "keys", "pane", "scores", "source", "state"];

#[test]
fn the_model_of_the_studio_knows_nothing_of_what_acts_on_it() {
    let all = arrows(&sources("app"));
    let arrows = &all[&vec!["app".to_owned()]];
    assert!(arrows["apply"].len() > 10, "the scan sees too little: {arrows:?}");
    for (module, named) in arrows {
        if MODEL.contains(&module.as_str()) {
            for (above, why) in named {
                assert!(MODEL.contains(&above.as_str()), "{why}");
            }
        }
        // Rooms know neither the list of all commands nor the runtime.
        if !["act", "apply", "runtime"].contains(&module.as_str()) {
            for above in ["apply", "runtime", "act", "command"] {
                assert!(!named.contains_key(above), "{}", named[above]);
            }
        }
    }
}

/// The circles of a crate that consists of these modules: the folder, and how many steps go round.
fn circles_of(modules: &[(&str, &str)]) -> Vec<(String, usize)> {
    let sources = modules.iter().map(|(module, text)| (parts(module), (*text).to_owned())).collect();
    let arrows = arrows(&sources);
    arrows.iter().filter_map(|(folder, arrows)| Some((folder.join("::"), circle(arrows)?.len()))).collect()
}

#[test]
fn a_circle_is_found_by_whatever_path_it_goes() {
    let none: Vec<(String, usize)> = Vec::new();
    let chain = [("l", ""), ("l::a", "use super::b::B;"), ("l::b", "use crate::l::c;"), ("l::c", "use std::fmt;")];
    assert_eq!(circles_of(&chain), none);
    for back in [
        "use super::a::A;",
        "use crate::l::{\n    a::{self, A},\n    d,\n};",
        "pub(super) use super::a;",
        "fn f() -> super::a::A {\n    crate::l::d::D\n}",
    ] {
        let round = [chain[0], chain[1], chain[2], ("l::c", back), ("l::d", "")];
        assert_eq!(circles_of(&round), [("l".to_owned(), 3)], "{back}");
    }
    // Through a name that the parent imported, and out of a folder.
    let through =
        [("l", "pub use a::A as B;"), ("l::a", "use super::b;"), ("l::b", ""), ("l::b::c", "use crate::l::B;")];
    assert_eq!(circles_of(&through), [("l".to_owned(), 2)]);
    // Through a function of a module that was imported, which the parent re-exports.
    let facade = [
        ("l", ""),
        ("l::m", "pub use a::f;\npub use b::g;"),
        ("l::m::a", "use super::super::m;\nfn f() {\n    m::g();\n}"),
        ("l::m::b", "use super::super::m;\nfn g() {\n    m::f();\n}"),
    ];
    assert_eq!(circles_of(&facade), [("l::m".to_owned(), 2)]);
    // Among the modules of one folder.
    let deep = [("l", ""), ("l::a", ""), ("l::a::b", "use super::c::C;"), ("l::a::c", "use super::b::B;")];
    assert_eq!(circles_of(&deep), [("l::a".to_owned(), 2)]);
}

#[test]
fn a_parent_and_its_children_are_one_feature() {
    let family = [
        ("l", "mod a;\nmod b;\npub use a::A;\npub struct L;"),
        ("l::a", "mod c;\npub use c::C;\nfn f(_: super::L) {\n    c::g();\n}\npub struct A;"),
        ("l::a::c", "use super::A;\nuse crate::l::L;"),
        ("l::b", "use super::{A, L};"),
    ];
    assert_eq!(circles_of(&family), []);
}
