//! The arrangement of the panes per workspace: defaults, and the check of what was stored.
//!
//! A closed pane stays in its tree, hidden, so that every tree always holds every pane of its workspace exactly once.
//! A stored tree of which that is not true (another version of the program, a damaged file) is replaced by the default.

use std::collections::BTreeMap;

use eframe::egui::Id;
use egui_tiles::{Container, Linear, LinearDir, Tile, TileId, Tiles, Tree};

use crate::app::pane::{Dock, Pane, Workspace};

/// Part of the stored text: a layout of another version is not even tried.
const FORMAT: &str = "touch2touch-layout-3";

/// Shares of the window that the docks of a workspace take; of rows with fewer docks the first shares count.
struct Shares {
    /// Left column, middle, right column.
    columns: [f32; 3],
    /// Upper and lower row of the middle.
    middle: [f32; 2],
    /// The docks of the upper row.
    top: [f32; 3],
    /// The docks of the lower row.
    bottom: [f32; 3],
    /// The docks of the right column.
    right: [f32; 2],
}

fn shares(workspace: Workspace) -> Shares {
    let alike = [1.0; 3];
    let shares =
        Shares { columns: [0.165, 0.625, 0.21], middle: [1.2, 0.9], top: alike, bottom: alike, right: [1.0, 1.0] };
    match workspace {
        Workspace::Inspect => Shares { middle: [0.8, 1.2], bottom: [0.8, 1.2, 1.0], right: [0.8, 1.2], ..shares },
        Workspace::Align => Shares {
            columns: [0.15, 0.63, 0.22],
            middle: [1.2, 0.8],
            top: [1.45, 1.0, 1.0],
            right: [1.2, 0.8],
            ..shares
        },
        Workspace::Label => Shares { middle: [1.2, 0.8], bottom: [1.0, 1.4, 1.0], right: [1.4, 0.6], ..shares },
        Workspace::Evaluate | Workspace::Adapt => shares,
    }
}

/// Parts side by side or one below the other; one part alone is itself.
fn line(tiles: &mut Tiles<Pane>, dir: LinearDir, parts: impl IntoIterator<Item = TileId>, shares: &[f32]) -> TileId {
    let parts: Vec<TileId> = parts.into_iter().collect();
    if let [only] = parts[..] {
        return only;
    }
    let mut linear = Linear::new(dir, parts.clone());
    for (part, share) in parts.into_iter().zip(shares) {
        linear.shares.set_share(part, *share);
    }
    tiles.insert_new(Tile::Container(Container::Linear(linear)))
}

/// The arrangement that a workspace starts with: what the table of panes says, divided by its shares.
pub(crate) fn default_tree(workspace: Workspace) -> Tree<Pane> {
    use LinearDir::{Horizontal, Vertical};
    let mut tiles = Tiles::default();
    let mut docks: BTreeMap<Dock, Vec<TileId>> = BTreeMap::new();
    for pane in Pane::of(workspace) {
        if let Some(dock) = pane.dock(workspace) {
            let id = tiles.insert_pane(pane);
            tiles.set_visible(id, !pane.is_closed_at_first(workspace));
            docks.entry(dock).or_default().push(id);
        }
    }
    let docks: Vec<(Dock, TileId)> =
        docks.into_iter().map(|(dock, panes)| (dock, tiles.insert_tab_tile(panes))).collect();
    let of = |part: fn(Dock) -> bool| docks.iter().filter(move |(dock, _)| part(*dock)).map(|(_, id)| *id);
    let shares = shares(workspace);
    let left = line(&mut tiles, Vertical, of(|dock| dock == Dock::Left), &[]);
    let top = line(&mut tiles, Horizontal, of(|dock| matches!(dock, Dock::Top(_))), &shares.top);
    let bottom = line(&mut tiles, Horizontal, of(|dock| matches!(dock, Dock::Bottom(_))), &shares.bottom);
    let right = line(&mut tiles, Vertical, of(|dock| matches!(dock, Dock::Right(_))), &shares.right);
    let middle = line(&mut tiles, Vertical, [top, bottom], &shares.middle);
    let root = line(&mut tiles, Horizontal, [left, middle, right], &shares.columns);
    Tree::new(tree_id(workspace), root, tiles)
}

fn tree_id(workspace: Workspace) -> Id {
    Id::unique(("workspace", workspace.name()))
}

/// True where the tree holds every pane of the workspace exactly once, below its root, and nothing else.
pub(crate) fn is_valid(tree: &Tree<Pane>, workspace: Workspace) -> bool {
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
    let panes = Pane::of(workspace);
    seen.len() == tree.tiles.len()
        && counts.len() == panes.len()
        && panes.iter().all(|pane| counts.get(pane) == Some(&1))
}

/// Hides panes that have nothing to show on the open data, so that the others have their room; those that it hid.
pub(crate) fn collapse(tree: &mut Tree<Pane>, panes: &[Pane]) -> Vec<TileId> {
    let there = panes.iter().filter_map(|pane| tree.tiles.find_pane(pane));
    let hidden: Vec<TileId> = there.filter(|id| tree.is_visible(*id)).collect();
    for id in &hidden {
        tree.set_visible(*id, false);
    }
    hidden
}

/// Takes [`collapse`] back: what is stored is what a person arranged.
pub(crate) fn restore_collapsed(tree: &mut Tree<Pane>, hidden: Vec<TileId>) {
    for id in hidden {
        tree.set_visible(id, true);
    }
}

/// The tree as text for the settings.
pub(crate) fn to_text(tree: &Tree<Pane>) -> Option<String> {
    serde_json::to_string(&(FORMAT, tree)).ok()
}

/// The stored arrangement, if it can be used for the workspace.
pub(crate) fn from_text(text: &str, workspace: Workspace) -> Option<Tree<Pane>> {
    let (format, tree): (String, Tree<Pane>) = serde_json::from_str(text).ok()?;
    (format == FORMAT && tree.id() == tree_id(workspace) && is_valid(&tree, workspace)).then_some(tree)
}

/// The stored arrangement, or the default one where there is none or it cannot be used.
pub(crate) fn restore(stored: Option<&String>, workspace: Workspace) -> Tree<Pane> {
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
        for extra in [Pane::Browser, Pane::Results] {
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
