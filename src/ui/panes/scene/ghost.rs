//! The contact points that the last change of a mask dropped and added.

use std::sync::Arc;

use glam::DVec3;

use super::Memory;
use crate::app::keys::{CloudKey, ImprintSource};
use crate::app::settings::SceneLayer;
use crate::app::{labels, results};
use crate::ui::parts::cx::Cx;

/// Points as the renderer takes them, made once for a change.
pub(super) struct SceneGhost {
    /// The clouds before and after it.
    key: [CloudKey; 2],
    /// Counts up with every new one.
    pub(super) revision: u64,
    /// Points that were dropped and points that were added.
    pub(super) points: [(SceneLayer, Arc<[DVec3]>); 2],
}

/// Finds them where a change is shown and both clouds are there. Between clouds of other imprints nothing is compared.
pub(super) fn update(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource) {
    let held = &mut memory.ghosts[source as usize];
    let before = labels::ghost(cx.state, source).and_then(|ghost| ghost.clouds);
    let (Some((old, before)), Ok(Some(new)), Some(now)) =
        (before, results::cloud_key(cx.state, source), results::cloud(cx.state, source).ready())
    else {
        *held = None;
        return;
    };
    let same_imprints = old.parts.entries().map(|(pad, part)| (pad, &part.0));
    if !same_imprints.eq(new.parts.entries().map(|(pad, part)| (pad, &part.0))) {
        *held = None;
        return;
    }
    if held.as_ref().is_some_and(|held| held.key[0] == *old && held.key[1] == new) {
        return;
    }
    let points = |was: bool| -> Arc<[DVec3]> {
        let fingers = before.fingers.entries().filter_map(|(pad, before)| Some((before, now.finger(pad)?)));
        let all = fingers.flat_map(|(before, now)| now.points.iter().zip(before.contact.iter().zip(&now.contact)));
        all.filter(|(_, (before, now))| **before == was && **now != was).map(|(point, _)| *point).collect()
    };
    memory.revision += 1;
    let points = [(SceneLayer::Dropped, points(true)), (SceneLayer::Added, points(false))];
    *held = Some(SceneGhost { key: [old.clone(), new], revision: memory.revision, points });
}

/// Entries of the list for them.
pub(super) fn legend_entries(memory: &Memory, source: ImprintSource) -> Vec<(SceneLayer, String)> {
    let points = memory.ghosts[source as usize].iter().flat_map(|ghost| &ghost.points);
    let name = |layer: SceneLayer| if layer == SceneLayer::Dropped { "dropped" } else { "added" };
    let some = points.filter(|(_, points)| !points.is_empty());
    some.map(|(layer, points)| (*layer, format!("{}: {}", name(*layer), points.len()))).collect()
}
