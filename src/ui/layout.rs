//! The arrangement of the panes per workspace: defaults, and the check of what was stored.
//!
//! A closed pane stays in its tree, hidden, so that every tree always holds every pane of its workspace exactly once.
//! A stored tree of which that is not true (another version of the program, a damaged file) is replaced by the default.

use std::collections::BTreeMap;

use eframe::egui::Id;
use egui_tiles::{Container, Linear, LinearDir, Tile, TileId, Tiles, Tree};

use crate::app::command::Pane;
use crate::app::settings::Workspace;

/// Part of the stored text: a layout of another version is not even tried.
const FORMAT: &str = "touch2touch-layout-2";

/// The panes of a workspace.
pub(super) fn panes_of(workspace: Workspace) -> &'static [Pane] {
    use Pane::*;
    match workspace {
        Workspace::Inspect => &[
            Browser,
            GelDifference,
            GelRaw,
            GelReference,
            Measured,
            Predicted,
            Error,
            Ledger,
            Seeds,
            ScenePredicted,
            SceneMeasured,
            Generate,
            Settings,
            Metrics,
            Log,
        ],
        Workspace::Align => &[
            Browser,
            ScenePredicted,
            SceneMeasured,
            TimeMachine,
            BasinMap,
            Measured,
            Predicted,
            Layers,
            Poses,
            Metrics,
            Generate,
            Log,
        ],
        Workspace::Label => {
            &[Browser, Masks, Measured, Predicted, SceneMeasured, ScenePredicted, GelDifference, Metrics, Log]
        }
        Workspace::Evaluate => {
            &[Browser, Results, Table, Measured, Predicted, Error, Ledger, SceneMeasured, Metrics, Generate, Log]
        }
    }
}

struct Builder(Tiles<Pane>);

impl Builder {
    fn tabs(&mut self, panes: &[Pane]) -> TileId {
        let tiles: Vec<TileId> = panes.iter().map(|p| self.0.insert_pane(*p)).collect();
        self.0.insert_tab_tile(tiles)
    }

    fn line(&mut self, dir: LinearDir, children: &[(TileId, f32)]) -> TileId {
        let mut linear = Linear::new(dir, children.iter().map(|(id, _)| *id).collect());
        for (id, share) in children {
            linear.shares.set_share(*id, *share);
        }
        self.0.insert_new(Tile::Container(Container::Linear(linear)))
    }

    fn row(&mut self, children: &[(TileId, f32)]) -> TileId {
        self.line(LinearDir::Horizontal, children)
    }

    fn column(&mut self, children: &[(TileId, f32)]) -> TileId {
        self.line(LinearDir::Vertical, children)
    }
}

/// The arrangement that a workspace starts with.
pub(super) fn default_tree(workspace: Workspace) -> Tree<Pane> {
    use Pane::*;
    let mut b = Builder(Tiles::default());
    let root = match workspace {
        Workspace::Inspect => {
            let browser = b.tabs(&[Browser]);
            let gel = b.tabs(&[GelDifference, GelRaw, GelReference]);
            let (measured, predicted) = (b.tabs(&[Measured]), b.tabs(&[Predicted]));
            let error = b.tabs(&[Error, Ledger, Seeds]);
            let (scene_p, scene_m) = (b.tabs(&[ScenePredicted]), b.tabs(&[SceneMeasured]));
            let generate = b.tabs(&[Generate, Settings]);
            let metrics = b.tabs(&[Metrics, Log]);
            let top = b.row(&[(gel, 1.0), (measured, 1.0), (predicted, 1.0)]);
            let bottom = b.row(&[(error, 1.0), (scene_p, 1.0), (scene_m, 1.0)]);
            let center = b.column(&[(top, 0.86), (bottom, 1.14)]);
            let right = b.column(&[(generate, 1.0), (metrics, 1.0)]);
            b.row(&[(browser, 0.165), (center, 0.625), (right, 0.21)])
        }
        Workspace::Align => {
            let browser = b.tabs(&[Browser]);
            let (scene_m, scene_p) = (b.tabs(&[SceneMeasured, Measured]), b.tabs(&[ScenePredicted, Predicted]));
            let steps = b.tabs(&[TimeMachine]);
            let basin = b.tabs(&[BasinMap, Layers, Poses]);
            let metrics = b.tabs(&[Metrics, Generate, Log]);
            let scenes = b.row(&[(scene_m, 1.0), (scene_p, 1.0)]);
            let center = b.column(&[(scenes, 1.15), (steps, 0.85)]);
            let right = b.column(&[(basin, 1.2), (metrics, 0.8)]);
            b.row(&[(browser, 0.13), (center, 0.64), (right, 0.23)])
        }
        Workspace::Label => {
            let browser = b.tabs(&[Browser]);
            let images = b.tabs(&[Measured, Predicted]);
            let scene = b.tabs(&[SceneMeasured, ScenePredicted]);
            let gel = b.tabs(&[GelDifference]);
            let masks = b.tabs(&[Masks]);
            let metrics = b.tabs(&[Metrics, Log]);
            let below = b.row(&[(gel, 1.0), (scene, 1.4)]);
            let center = b.column(&[(images, 1.25), (below, 0.75)]);
            let right = b.column(&[(masks, 1.25), (metrics, 0.75)]);
            b.row(&[(browser, 0.165), (center, 0.625), (right, 0.21)])
        }
        Workspace::Evaluate => {
            let left = b.tabs(&[Browser]);
            let table = b.tabs(&[Results, Table]);
            let (measured, predicted, error) = (b.tabs(&[Measured]), b.tabs(&[Predicted]), b.tabs(&[Error, Ledger]));
            let right = b.tabs(&[Metrics, Generate, SceneMeasured, Log]);
            let images = b.row(&[(measured, 1.0), (predicted, 1.0), (error, 1.0)]);
            let center = b.column(&[(table, 1.2), (images, 0.9)]);
            b.row(&[(left, 0.165), (center, 0.625), (right, 0.21)])
        }
    };
    Tree::new(tree_id(workspace), root, b.0)
}

fn tree_id(workspace: Workspace) -> Id {
    Id::unique(("workspace", workspace.name()))
}

/// Whether the tree holds every pane of the workspace exactly once, below its root, and nothing else.
pub(super) fn is_valid(tree: &Tree<Pane>, workspace: Workspace) -> bool {
    let mut counts: BTreeMap<Pane, u32> = BTreeMap::new();
    let Some(root) = tree.root() else { return false };
    // A stored tree may be damaged in any way, even be no tree: nothing is visited twice.
    let mut seen = std::collections::BTreeSet::new();
    let mut open = vec![root];
    while let Some(id) = open.pop() {
        if !seen.insert(id.0) {
            return false;
        }
        match tree.tiles.get(id) {
            Some(Tile::Pane(pane)) => *counts.entry(*pane).or_default() += 1,
            Some(Tile::Container(container)) => open.extend(container.children().copied()),
            None => return false,
        }
    }
    seen.len() == tree.tiles.len()
        && counts.len() == panes_of(workspace).len()
        && panes_of(workspace).iter().all(|p| counts.get(p) == Some(&1))
}

/// The tree as text for the settings.
pub(super) fn to_text(tree: &Tree<Pane>) -> Option<String> {
    serde_json::to_string(&(FORMAT, tree)).ok()
}

/// The stored arrangement, if it can be used for the workspace.
pub(super) fn from_text(text: &str, workspace: Workspace) -> Option<Tree<Pane>> {
    let (format, tree): (String, Tree<Pane>) = serde_json::from_str(text).ok()?;
    (format == FORMAT && tree.id() == tree_id(workspace) && is_valid(&tree, workspace)).then_some(tree)
}

/// The stored arrangement, or the default one where there is none or it cannot be used.
pub(super) fn restore(stored: Option<&String>, workspace: Workspace) -> Tree<Pane> {
    match stored {
        None => default_tree(workspace),
        Some(text) => from_text(text, workspace).unwrap_or_else(|| {
            log::warn!("The stored layout of {} cannot be used: it starts with the default one", workspace.name());
            default_tree(workspace)
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use strum::IntoEnumIterator as _;

    #[test]
    fn defaults_are_valid_and_survive_storage() {
        for workspace in Workspace::iter() {
            let tree = default_tree(workspace);
            assert!(is_valid(&tree, workspace), "{workspace:?}");
            let text = to_text(&tree).unwrap();
            assert!(from_text(&text, workspace).is_some(), "{workspace:?}");
        }
    }

    #[test]
    fn a_missing_a_double_and_a_foreign_pane_are_refused() {
        let workspace = Workspace::Inspect;
        let tree = default_tree(workspace);
        let log = tree.tiles.find_pane(&Pane::Log).unwrap();
        let mut missing = tree.clone();
        missing.remove_recursively(log);
        assert!(!is_valid(&missing, workspace));
        for extra in [Pane::Browser, Pane::Table] {
            let mut more = tree.clone();
            let id = more.tiles.insert_pane(extra);
            let root = more.root().unwrap();
            more.move_tile_to_container(id, root, 0, true);
            assert!(!is_valid(&more, workspace), "{extra:?}");
        }
        let text = to_text(&tree).unwrap();
        assert!(from_text(&text, Workspace::Label).is_none());
        assert!(from_text(&text[..text.len() / 2], workspace).is_none());
        assert!(from_text("", workspace).is_none());
        assert!(is_valid(&restore(Some(&"{}".to_owned()), workspace), workspace));
    }
}
