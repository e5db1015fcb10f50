//! No circle among the modules of a layer.
//!
//! A module is a file with the folder of its name. In each folder, the modules that lie side by side must not name each
//! other in a circle: one could be neither read nor changed without the others. A parent and what lies in its folder are
//! one feature, so that naming the parent, and what it re-exports, is no arrow.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::layer;

/// The folders without a circle.
const LAYERS: &[&str] =
    &["crates/core/src", "crates/pipeline/src", "src/gpu", "src/spatial", "src/headless", "src/app", "src/ui"];

/// For each module of a folder, the modules beside it that its files name, each with one of the names.
type Arrows = BTreeMap<String, BTreeMap<String, String>>;

/// The paths of a piece of code that begin at the root of its crate; braces spelt out one level deep, as they are written here.
fn paths(code: &str) -> BTreeSet<Vec<String>> {
    let parts = |path: &str| path.split("::").map(|part| part.trim().to_owned()).collect::<Vec<_>>();
    let mut found = BTreeSet::new();
    for (at, root) in code.match_indices("crate::") {
        let rest = &code[at + root.len()..];
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').unwrap_or(rest.len());
        let path = rest[..end].trim_end_matches(':');
        match rest[end..].strip_prefix('{').and_then(|inside| inside.split_once('}')) {
            Some((inside, _)) => {
                found.extend(inside.split([',', '{']).map(|name| parts(&format!("{path}::{}", name.trim()))));
            }
            None => drop(found.insert(parts(path))),
        }
    }
    found
}

/// Who names whom, by the folder that they lie in. `sources` has the code of each module, with each name spelt out.
fn arrows(sources: &BTreeMap<Vec<String>, String>) -> BTreeMap<Vec<String>, Arrows> {
    let mut all: BTreeMap<Vec<String>, Arrows> = BTreeMap::new();
    for (module, code) in sources {
        for path in paths(code) {
            let common = module.iter().zip(&path).take_while(|(a, b)| a == b).count();
            let beside = path.get(..=common).filter(|beside| sources.contains_key(*beside));
            if let (Some(own), Some(beside)) = (module.get(common), beside) {
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
    let leads_to = |from: &str, to: &str| {
        let (mut reached, mut open) = (BTreeSet::new(), vec![from.to_owned()]);
        while let Some(at) = open.pop() {
            for next in arrows.get(&at).into_iter().flat_map(BTreeMap::keys) {
                if reached.insert(next.clone()) {
                    open.push(next.clone());
                }
            }
        }
        reached.contains(to)
    };
    let steps = arrows.iter().flat_map(|(from, named)| named.iter().map(move |(to, why)| (from, to, why)));
    let round: Vec<&str> = steps.filter(|(from, to, _)| leads_to(to, from)).map(|(_, _, why)| why.as_str()).collect();
    (!round.is_empty()).then_some(round)
}

fn sources(folder: &str) -> BTreeMap<Vec<String>, String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join(if folder.starts_with("crates") { folder } else { "src" });
    let module = |file: &Path| {
        let module = file.strip_prefix(&src).unwrap().with_extension("");
        module.iter().map(|part| part.to_string_lossy().into_owned()).filter(|part| part != "lib").collect()
    };
    layer(folder).into_iter().map(|(file, code)| (module(&file), code)).collect()
}

#[test]
fn the_modules_of_a_layer_form_no_circle() {
    let mut found = Vec::new();
    for layer in LAYERS {
        let arrows = arrows(&sources(layer));
        assert!(arrows.values().map(BTreeMap::len).max() > Some(1), "{layer}: the scan sees too little: {arrows:?}");
        for (folder, arrows) in &arrows {
            if let Some(round) = circle(arrows) {
                found.push(format!("a circle in {}:\n    {}", folder.join("::"), round.join("\n    ")));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The modules of `app` from which everything else there is made: they know nothing of what acts on them.
const MODEL: &[&str] = &["action", "jobs", "keys", "pane", "scores", "source", "state"];

#[test]
fn the_model_of_the_studio_knows_nothing_of_what_acts_on_it() {
    let all = arrows(&sources("src/app"));
    let arrows = &all[&vec!["app".to_owned()]];
    assert!(arrows["apply"].len() > 10, "the scan sees too little: {arrows:?}");
    for (module, named) in arrows {
        for (above, why) in named.iter().filter(|_| MODEL.contains(&module.as_str())) {
            assert!(MODEL.contains(&above.as_str()), "{why}");
        }
        // Rooms know neither the list of all commands nor the runtime.
        if !["act", "apply", "runtime"].contains(&module.as_str()) {
            for above in ["apply", "runtime", "act", "command"] {
                assert!(!named.contains_key(above), "{}", named[above]);
            }
        }
    }
}

#[test]
fn a_circle_is_found_among_the_modules_of_one_folder_alone() {
    let circle_of = |modules: &[(&str, &str)]| {
        let name = |module: &str| module.split("::").map(str::to_owned).collect();
        let sources = modules.iter().map(|(module, code)| (name(module), (*code).to_owned())).collect();
        arrows(&sources).iter().find_map(|(folder, arrows)| Some((folder.join("::"), circle(arrows)?.len())))
    };
    let chain = [("l", ""), ("l::a", "use crate::l::b::B;"), ("l::b", "use crate::l::c;"), ("l::c", "use std::fmt;")];
    assert_eq!(circle_of(&chain), None);
    for back in ["use crate::l::a::A;", "use crate::l::{\n    d,\n    a,\n};", "fn f() -> crate::l::a::A {}"] {
        let round = [chain[0], chain[1], chain[2], ("l::c", back), ("l::d", "")];
        assert_eq!(circle_of(&round), Some(("l".to_owned(), 3)), "{back}");
    }
    let deep = [("l::a", ""), ("l::a::b", "use crate::l::a::c::C;"), ("l::a::c", "use crate::l::a::b::B;")];
    assert_eq!(circle_of(&deep), Some(("l::a".to_owned(), 2)));
    let family =
        [("l", ""), ("l::a", "use crate::l::L;"), ("l::a::c", "use crate::l::a::A;"), ("l::b", "use crate::l::A;")];
    assert_eq!(circle_of(&family), None);
}
