//! What a 3D pane shows, as data for the renderer.

use std::sync::Arc;

use eframe::egui::Color32;
use glam::{DAffine3, DVec3};

use super::{Memory, layers, rgb, steps};
use crate::app::keys::{CloudKey, DatasetSeq, ImprintSource};
use crate::domain::mesh::TriMesh;
use crate::domain::rig::PerPad;
use crate::gpu::guides;
use crate::gpu::lines::{LinesItem, LinesStyle, Segment};
use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use crate::gpu::scene::SceneData;
use crate::ui::cx::{Cx, side_color};
use crate::ui::images::CONTACT;
use crate::ui::theme::{self, Palette};
use crate::work::cloud::{Clouds, FingerCloud};

/// Points as the renderer takes them, made once per cloud.
pub(super) struct SceneCloud {
    /// The cloud.
    pub key: CloudKey,
    /// Counts up with every new cloud.
    pub revision: u64,
    /// Per finger: the membrane and the contact.
    pub fingers: PerPad<[Arc<[DVec3]>; 2]>,
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

/// Points for the renderer, made again only for another cloud.
pub(super) fn update_cloud(memory: &mut Memory, source: ImprintSource, key: CloudKey, clouds: &Clouds) {
    let held = &mut memory.clouds[source as usize];
    if held.as_ref().is_some_and(|h| h.key == key) {
        return;
    }
    let part = |f: &FingerCloud, contact: bool| {
        let indices: Vec<usize> = (0..f.points.len()).filter(|i| f.contact.get(*i) == Some(&contact)).collect();
        // The membrane only has to be seen, and seen through: every other pixel of every other row.
        let kept = |i: &usize| contact || f.pixels.get(*i).is_some_and(|p| p[0] % 2 == 0 && p[1] % 2 == 0);
        indices.into_iter().filter(kept).filter_map(|i| f.points.get(i).copied()).collect::<Arc<[DVec3]>>()
    };
    let convert = |f: &FingerCloud| [part(f, false), part(f, true)];
    memory.revision += 1;
    let fingers = clouds.fingers.as_ref().map(|cloud| cloud.map(convert));
    *held = Some(SceneCloud { key, revision: memory.revision, fingers });
}

pub(super) fn update_mesh(cx: &Cx<'_>, memory: &mut Memory) {
    let Some(tool) = cx.state.tool().shown() else { return };
    let Some(open) = &cx.state.library.open else { return };
    if memory.mesh.as_ref().is_some_and(|m| m.key.0 == open.seq && m.key.1 == tool.name) {
        return;
    }
    memory.revision += 1;
    let key = (open.seq, tool.name.clone());
    memory.mesh = Some(SceneMesh { key, revision: memory.revision, mesh: Arc::new(tool.model.mesh.clone()) });
}

/// Everything one side shows at time `seconds`.
pub(super) fn scene_of(cx: &Cx<'_>, memory: &Memory, source: ImprintSource, seconds: f64) -> SceneData {
    let mut scene = SceneData { background: rgb(cx.p.canvas), ..SceneData::default() };
    clouds(cx, memory, source, &mut scene);
    pointed(cx, source, &mut scene);
    picked(cx, source, &mut scene);
    meshes(cx, memory, source, seconds, &mut scene);
    scene.lines.extend(layers::ellipse(cx, source));
    steps::add(cx, memory, source, &mut scene);
    guides(cx, &mut scene);
    scene
}

/// Membrane and contact points of both fingers.
fn clouds(cx: &Cx<'_>, memory: &Memory, source: ImprintSource, scene: &mut SceneData) {
    if let Some(cloud) = &memory.clouds[source as usize] {
        for (finger, parts) in cloud.fingers.entries() {
            // The membrane recedes, the contact stands out.
            let rest = theme::mix(cx.p.canvas, side_color(cx.p, source), 0.6);
            let looks = [(PointSize::Px(1.2), rest, "membrane"), (PointSize::Meters(0.000_3), CONTACT, "contact")];
            for (part, (size, color, name)) in parts.iter().zip(looks) {
                let mut item = CloudItem {
                    name: format!("{name} {}", cx.state.finger_name(finger)),
                    revision: cloud.revision,
                    points: part.clone(),
                    colors: PointColors::One,
                    style: CloudStyle { color: rgb(color), size, ..CloudStyle::default() },
                };
                if name == "contact" {
                    layers::paint(memory, source, finger, &mut item);
                }
                scene.clouds.push(item);
            }
        }
    }
    if cx.state.workbench.both_clouds {
        other_cloud(cx, memory, super::other_side(source), scene);
    }
}

/// The contact points of the other side, in its color, where both are shown in one view.
fn other_cloud(cx: &Cx<'_>, memory: &Memory, other: ImprintSource, scene: &mut SceneData) {
    let Some(cloud) = &memory.clouds[other as usize] else { return };
    // What is of another pair is no comparison.
    if cx.state.cloud_key(other) != Ok(Some(cloud.key.clone())) {
        return;
    }
    for (finger, [_, contact]) in cloud.fingers.entries() {
        scene.clouds.push(CloudItem {
            name: format!("other contact {}", cx.state.finger_name(finger)),
            revision: cloud.revision,
            points: contact.clone(),
            colors: PointColors::One,
            style: CloudStyle {
                color: rgb(side_color(cx.p, other)),
                size: PointSize::Meters(0.000_3),
                ..CloudStyle::default()
            },
        });
    }
}

/// The point that was clicked.
fn picked(cx: &Cx<'_>, source: ImprintSource, scene: &mut SceneData) {
    let point = cx.state.workbench.picked.filter(|picked| picked.source == source).and_then(|picked| {
        let cloud = cx.state.cloud(source).ready()?.finger(picked.finger)?;
        cloud.points.get(cloud.at_pixel(picked.pixel[0].into(), picked.pixel[1].into())?).copied()
    });
    if let Some(point) = point {
        scene.clouds.push(one_point("picked", point, cx.p.accent, 11.0));
    }
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

/// The pixel under the pointer, as a point of its own: it must not drown among the others.
fn pointed(cx: &Cx<'_>, source: ImprintSource, scene: &mut SceneData) {
    let state = cx.state;
    let pointed = state.selection.hover.and_then(|h| {
        let cloud = state.cloud(source).ready()?.finger(h.finger)?;
        let (x, y) = (h.at_px[0].round().max(0.0) as usize, h.at_px[1].round().max(0.0) as usize);
        cloud.points.get(cloud.at_pixel(x, y)?).copied()
    });
    if let Some(point) = pointed {
        scene.clouds.push(one_point("pointer", point, cx.p.strong, 9.0));
    }
}

/// The CAD model at the registered and at the true pose.
fn meshes(cx: &Cx<'_>, memory: &Memory, source: ImprintSource, seconds: f64, scene: &mut SceneData) {
    let state = cx.state;
    let tool_now = state.tool().ready().map(|t| t.name.as_str());
    if let Some(mesh) = memory.mesh.as_ref().filter(|m| Some(m.key.1.as_str()) == tool_now) {
        let item = |name: &str, style: MeshStyle| MeshItem {
            name: name.into(),
            revision: mesh.revision,
            mesh: mesh.mesh.clone(),
            shading: Shading::Smooth,
            style,
        };
        // The step that is looked at, else what was registered.
        let registered = steps::pose(cx, source).or_else(|| Some(state.pose(source).shown()?.grasp_from_object));
        let mut show = |name: &str, world_from_mesh: DAffine3, color: Color32, look: Look| {
            let opacity = if look == Look::Solid { 0.9 } else { 0.6 };
            scene.meshes.push(item(name, MeshStyle { world_from_mesh, color: rgb(color), opacity, look }));
        };
        // Where a hand holds the tool, or put it, the registered pose is its shadow.
        let hand = state.workbench.hand(source).map(|hand| (hand.pose, cx.p.accent));
        let set = hand.or_else(|| state.by_hand(source).map(|pose| (pose, cx.p.good)));
        match (set, registered) {
            (Some((pose, color)), registered) => {
                show("CAD by hand", pose.to_affine(), color, Look::Solid);
                if let Some(registered) = registered {
                    show("CAD", registered.to_affine(), cx.p.cad, Look::XRay);
                }
            }
            (None, Some(registered)) => {
                let pose = layers::swayed(cx, source, registered, seconds);
                // Colored points are what is looked at: the model lets them through.
                let colored = memory.layer_colors[source as usize].is_some();
                show("CAD", pose.to_affine(), cx.p.cad, if colored { Look::XRay } else { Look::Solid });
            }
            (None, None) => {}
        }
        let other = super::other_side(source);
        if let Some(pose) = state.pose(other).ready().filter(|_| state.workbench.both_clouds) {
            show("CAD of the other side", pose.grasp_from_object.to_affine(), side_color(cx.p, other), Look::XRay);
        }
        if let Some(truth) = state.sample().ready().and_then(|s| s.grasp_from_object) {
            scene.meshes.push(item(
                "CAD at the true pose",
                MeshStyle {
                    world_from_mesh: truth.to_affine(),
                    color: rgb(cx.p.truth),
                    opacity: 0.6,
                    look: Look::XRay,
                },
            ));
        }
    }
}

/// Floor grid and axes.
fn guides(cx: &Cx<'_>, scene: &mut SceneData) {
    scene.lines.push(LinesItem {
        name: "grid".into(),
        revision: u64::from(*cx.p == theme::DARK),
        segments: grid(cx.p).into(),
        style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 1.0, opacity: 1.0, overlay: false },
    });
    scene.lines.push(LinesItem {
        name: "axes".into(),
        revision: 1,
        segments: guides::axes(axes_origin(), AXIS).into(),
        style: LinesStyle { world_from_lines: DAffine3::IDENTITY, width_px: 2.0, opacity: 1.0, overlay: true },
    });
}

/// Length of the drawn axes, meters.
pub(super) const AXIS: f64 = 0.01;

/// A corner of the floor grid: in the middle the axes would hide the contact.
pub(super) fn axes_origin() -> DVec3 {
    DVec3::new(-0.05, -0.05, FLOOR)
}

/// Height of the floor grid, meters along +z (down).
const FLOOR: f64 = 0.045;

fn grid(p: &Palette) -> Vec<Segment> {
    let c = theme::mix(p.canvas, p.weak, 0.45);
    guides::grid(DVec3::new(0.0, 0.0, FLOOR), [DVec3::X, DVec3::Y], 0.01, 5, [c.r(), c.g(), c.b()])
}
