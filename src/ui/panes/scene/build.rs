//! Content of a 3D pane, as data for the renderer.

use std::sync::Arc;

use eframe::egui::Color32;
use glam::{DAffine3, DVec3};

use super::{Memory, layers, rgb, steps};
use crate::app::keys::{DatasetSeq, EstimateKey, ImprintKey, ImprintSource};
use crate::app::results;
use crate::app::settings::SceneLayer;
use crate::app::state::Lookup;
use crate::app::workbench::Layer;
use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use crate::gpu::scene::SceneData;
use crate::spatial::items;
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{self, CONTACT};
use touch2touch_core::cloud::membrane;
use touch2touch_core::mesh::TriMesh;
use touch2touch_core::rig::PerPad;
use touch2touch_pipeline::steps::cloud::FingerCloud;

/// Points as the renderer takes them, made once per cloud.
pub(super) struct SceneCloud {
    /// The cloud.
    pub key: EstimateKey,
    /// Counts up with every new cloud.
    pub revision: u64,
    /// The contact points of each finger.
    pub fingers: PerPad<Arc<[DVec3]>>,
}

/// The membranes of a cloud as surfaces, made only while they are shown, and not again for another mask.
pub(super) struct SceneSurface {
    key: PerPad<ImprintKey>,
    revision: u64,
    fingers: PerPad<Arc<TriMesh>>,
}

/// A CAD model as the renderer takes it.
pub(super) struct SceneMesh {
    /// The data set and the tool.
    pub key: (DatasetSeq, String),
    /// Counts up with every new model.
    pub revision: u64,
    /// The model.
    pub mesh: Arc<TriMesh>,
}

/// Brings what a view draws up to date: points for the renderer are made again only for another cloud.
pub(super) fn update(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource) {
    let state = cx.state;
    let contact = |cloud: &FingerCloud| cloud.contact_points().collect();
    for side in std::iter::once(source).chain(state.workbench.both_clouds.then(|| source.other())) {
        let (Lookup::Ready(clouds), Ok(Some(key))) = (results::cloud(state, side), results::cloud_key(state, side))
        else {
            continue;
        };
        update_surface(cx, memory, side, &key);
        let held = &mut memory.clouds[side as usize];
        if held.as_ref().is_none_or(|held| held.key != key) {
            memory.revision += 1;
            let fingers = clouds.fingers.as_ref().map(|cloud| cloud.map(contact));
            *held = Some(SceneCloud { key, revision: memory.revision, fingers });
        }
    }
    update_mesh(cx, &mut memory.mesh, &mut memory.revision);
    layers::update(cx, memory, source);
    steps::update(cx, memory, source);
}

/// The membranes as surfaces, made again only for other imprints.
fn update_surface(cx: &Cx<'_>, memory: &mut Memory, source: ImprintSource, key: &EstimateKey) {
    let held = &mut memory.surfaces[source as usize];
    if !cx.state.settings.scene.shows(SceneLayer::Membrane) {
        *held = None;
        return;
    }
    let key = key.parts.as_ref().map(|part| part.map(|(imprint, _)| imprint.clone()));
    if held.as_ref().is_some_and(|held| held.key == key) {
        return;
    }
    let mut fingers = PerPad::default();
    for (pad, imprint) in key.entries() {
        let camera = results::sample(cx.state).ready().and_then(|sample| sample.pad(pad)?.camera());
        let imprint = results::imprint_of(cx.state, imprint).ready();
        let made = imprint.zip(camera).and_then(|(imprint, camera)| membrane(imprint, camera).ok());
        fingers[pad] = made.map(Arc::new);
    }
    memory.revision += 1;
    *held = Some(SceneSurface { key, revision: memory.revision, fingers });
}

/// Makes the CAD model for the renderer, where it is another one.
fn update_mesh(cx: &Cx<'_>, held: &mut Option<SceneMesh>, revision: &mut u64) {
    let Some(tool) = results::tool(cx.state).shown() else { return };
    let Some(open) = &cx.state.library.open else { return };
    if held.as_ref().is_some_and(|m| m.key.0 == open.seq && m.key.1 == tool.name) {
        return;
    }
    *revision += 1;
    let key = (open.seq, tool.name.clone());
    *held = Some(SceneMesh { key, revision: *revision, mesh: Arc::new(tool.model.mesh.clone()) });
}

/// The color of a layer. No two layers share one.
pub(super) fn color(cx: &Cx<'_>, source: ImprintSource, layer: SceneLayer) -> Color32 {
    let p = cx.p;
    match layer {
        // The membrane recedes, the contact stands out.
        SceneLayer::Membrane => theme::mix(p.canvas, side_color(p, source), 0.7),
        SceneLayer::Contact => CONTACT,
        SceneLayer::OtherContact => side_color(p, source.other()),
        SceneLayer::Cad if cx.state.workbench.hand(source).is_some() => p.accent,
        SceneLayer::Cad if results::by_hand(cx.state, source).is_some() => p.good,
        // Lit from all sides it is darker than its color: before a light ground it begins paler.
        SceneLayer::Cad if *p == theme::LIGHT => theme::mix(p.cad, Color32::WHITE, 0.5),
        SceneLayer::Cad | SceneLayer::Registered => p.cad,
        SceneLayer::Answers => p.caution,
        SceneLayer::OtherCad => theme::mix(p.strong, side_color(p, source.other()), 0.7),
        SceneLayer::TrueCad => p.strong,
        SceneLayer::Guides => p.weak,
    }
}

/// Everything one side shows.
pub(super) fn scene_of(cx: &Cx<'_>, memory: &Memory, source: ImprintSource) -> SceneData {
    let mut scene = SceneData { background: rgb(cx.p.canvas), eye_dome: true, ..SceneData::default() };
    let shows = |layer| cx.state.settings.scene.shows(layer);
    for (side, layer) in [(source, SceneLayer::Contact), (source.other(), SceneLayer::OtherContact)] {
        let both = cx.state.workbench.both_clouds;
        // What is of another pair is no comparison.
        let belongs = |cloud: &&SceneCloud| {
            side == source || both && results::cloud_key(cx.state, side) == Ok(Some(cloud.key.clone()))
        };
        let held = memory.clouds[side as usize].as_ref().filter(|_| shows(layer));
        let Some(cloud) = held.filter(belongs) else { continue };
        for (finger, points) in cloud.fingers.entries() {
            const DIAMETER: PointSize = PointSize::Meters(0.000_35);
            let (name, color) = (cx.state.finger_name(finger), rgb(color(cx, source, layer)));
            let mut item = items::contact(&name, (cloud.revision, points.clone()), color, DIAMETER);
            if side == source {
                layers::paint(memory, source, finger, &mut item);
            } else {
                // The view is fitted to its own side.
                item.name.insert_str(0, "other ");
            }
            scene.clouds.push(item);
        }
    }
    if let Some(held) = &memory.surfaces[source as usize] {
        const OPACITY: f32 = 0.4;
        let color = rgb(color(cx, source, SceneLayer::Membrane));
        for (finger, mesh) in held.fingers.entries() {
            let finger = cx.state.finger_name(finger);
            scene.meshes.push(items::membrane(&finger, (held.revision, mesh.clone()), color, OPACITY));
        }
    }
    // The pixel under the pointer and the one that was clicked are points of their own: they must not drown among the others.
    let at = |finger, [x, y]: [usize; 2]| {
        let cloud = results::cloud(cx.state, source).ready()?.finger(finger)?;
        cloud.points.get(cloud.at_pixel(x, y)?).copied()
    };
    let pointed = cx.state.selection.hover.and_then(|h| at(h.finger, h.at_px.map(|v| v.round().max(0.0) as usize)));
    scene.clouds.extend(pointed.map(|point| one_point("pointer", point, cx.p.strong, 9.0)));
    let picked = cx.state.workbench.picked.filter(|picked| picked.source == source);
    let picked = picked.and_then(|picked| at(picked.finger, picked.pixel.map(usize::from)));
    scene.clouds.extend(picked.map(|point| one_point("picked", point, cx.p.accent, 11.0)));
    meshes(cx, memory, source, &mut scene);
    scene.meshes.extend(hovered_tool(cx, source));
    steps::add(cx, memory, source, &mut scene);
    if shows(SceneLayer::Guides) {
        let (ground, ink) = (rgb(cx.p.canvas), rgb(cx.p.weak));
        scene.floor = Some(items::floor(ground, ink));
        scene.lines.extend(items::guides(ground, ink, u64::from(*cx.p == theme::DARK)));
    }
    scene
}

/// A cloud of a single point, as large on the screen at any distance.
fn one_point(name: &str, point: DVec3, color: Color32, px: f32) -> CloudItem {
    let bits = point.to_array().map(f64::to_bits);
    CloudItem {
        name: name.into(),
        revision: bits[0] ^ bits[1].rotate_left(21) ^ bits[2].rotate_left(42),
        points: [point].into(),
        colors: PointColors::One,
        style: CloudStyle { color: rgb(color), size: PointSize::Px(px), ..CloudStyle::default() },
    }
}

/// The models that a side can show now, each with its pose: the shaded one is [`SceneLayer::Cad`], the others are
/// outlines to compare it with.
pub(super) fn models(cx: &Cx<'_>, source: ImprintSource) -> Vec<(SceneLayer, DAffine3)> {
    let state = cx.state;
    let mut models = Vec::new();
    // The step that is looked at, else what was registered.
    let registered = steps::pose(cx, source).or_else(|| Some(results::pose(state, source).shown()?.grasp_from_object));
    let held = state.workbench.hand(source).map(|hand| hand.pose);
    match (held.or_else(|| results::by_hand(state, source)), registered) {
        (Some(pose), registered) => {
            models.push((SceneLayer::Cad, pose.to_affine()));
            models.extend(registered.map(|pose| (SceneLayer::Registered, pose.to_affine())));
        }
        (None, Some(pose)) => {
            models.push((SceneLayer::Cad, pose.to_affine()));
        }
        (None, None) => {}
    }
    // What the tool's symmetry makes of the answer looks like it.
    let answers = results::pose(state, source).shown().map_or(&[][..], |pose| &pose.report.answers);
    let others = answers.iter().filter(|answer| !answer.alike);
    models.extend(others.map(|answer| (SceneLayer::Answers, answer.grasp_from_object.to_affine())));
    let other = results::pose(state, source.other()).ready().filter(|_| state.workbench.both_clouds);
    models.extend(other.map(|pose| (SceneLayer::OtherCad, pose.grasp_from_object.to_affine())));
    let truth = results::sample(state).ready().and_then(|sample| sample.grasp_from_object);
    models.extend(truth.map(|pose| (SceneLayer::TrueCad, pose.to_affine())));
    models
}

/// The outline of the tool under the pointer among those that were tried.
fn hovered_tool(cx: &Cx<'_>, source: ImprintSource) -> Option<MeshItem> {
    let (_, row) = cx.shared.hovered_tool.filter(|(side, _)| *side == source)?;
    let candidate = results::ranking(cx.state, source)?.ready()?.get(row)?;
    let world_from_mesh = candidate.report.grasp_from_object.to_affine();
    Some(MeshItem {
        name: format!("CAD tried {}", candidate.tool),
        revision: Arc::as_ptr(&candidate.mesh).addr() as u64,
        mesh: candidate.mesh.clone(),
        shading: Shading::Smooth,
        values: Arc::default(),
        style: items::outline(world_from_mesh, rgb(cx.p.accent), 1.0, 2.0),
    })
}

/// The model, shaded where the tool is and as outlines where else it could be.
fn meshes(cx: &Cx<'_>, memory: &Memory, source: ImprintSource, scene: &mut SceneData) {
    let state = cx.state;
    let tool_now = results::tool(state).ready().map(|t| t.name.as_str());
    let Some(mesh) = memory.mesh.as_ref().filter(|m| Some(m.key.1.as_str()) == tool_now) else { return };
    for (number, (layer, world_from_mesh)) in models(cx, source).into_iter().enumerate() {
        if !state.settings.scene.shows(layer) {
            continue;
        }
        let color = color(cx, source, layer);
        let mut item = MeshItem {
            name: format!("CAD {layer:?} {number}"),
            revision: mesh.revision,
            mesh: mesh.mesh.clone(),
            shading: Shading::Smooth,
            values: Arc::default(),
            style: match layer {
                SceneLayer::TrueCad => items::truth(world_from_mesh, rgb(color), 1.0, 1.2),
                _ => items::outline(world_from_mesh, rgb(color), 1.0, 2.0),
            },
        };
        if layer == SceneLayer::Cad {
            // Where the points' own colors are looked at, the model lets them through.
            let through = memory.layer_colors[source as usize].is_some()
                && matches!(state.workbench.layer, Layer::Residuals | Layer::Reasons);
            item.style = MeshStyle {
                look: if through { Look::XRay } else { Look::Solid },
                opacity: if through { 0.6 } else { 1.0 },
                edges: Some(items::model_edges(rgb(color), rgb(cx.p.canvas))),
                ..item.style
            };
            layers::paint_model(memory, source, world_from_mesh, &mut item);
        }
        scene.meshes.push(item);
    }
}
