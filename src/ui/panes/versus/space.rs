//! The comparison in 3D: both clouds, or one colored by how far it lies from the other.

use std::sync::Arc;

use eframe::egui::{Align2, Color32, FontId, Ui, pos2, vec2};
use glam::DVec3;

use super::{Letter, color};
use crate::app::keys::{CloudDifferenceKey, DatasetSeq, EstimateKey};
use crate::app::results;
use crate::app::settings::{SceneLayer, Versus, VersusMode};
use crate::gpu::mesh::{Look, MeshItem, MeshStyle, Shading};
use crate::gpu::points::{CloudItem, CloudStyle, PointColors, PointSize};
use crate::gpu::scene::SceneData;
use crate::spatial::{self, items};
use crate::ui::panes::scene::{SceneMesh, distances, guides, model_edges, outline, parts, rgb, update_mesh};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::scene_view::{Grip, SceneView};
use crate::ui::parts::theme::{self, SMALL};
use crate::ui::parts::widget::empty;
use touch2touch_core::colormap::Range;
use touch2touch_core::rig::PerPad;
use touch2touch_core::units;
use touch2touch_pipeline::compare::deviation::DISTANCE_MAP;

/// Diameter of a point, meters.
const POINT_M: f32 = 0.000_5;

/// The view, and what the renderer holds for it.
#[derive(Default)]
pub(super) struct Space {
    view: SceneView,
    clouds: [Option<Held>; 2],
    apart: Option<(CloudDifferenceKey, u64, PerPad<Colored>)>,
    mesh: Option<SceneMesh>,
    fitted: Option<(DatasetSeq, u64)>,
    revision: u64,
}

/// The points of one of the two, made once.
struct Held {
    key: EstimateKey,
    revision: u64,
    fingers: PerPad<[Arc<[DVec3]>; 2]>,
}

/// All points of a finger with a value each.
struct Colored {
    points: Arc<[DVec3]>,
    values: Arc<[f32]>,
}

/// The view of what is compared; with `flipped` B stands alone.
pub(super) fn show(cx: &mut Cx<'_>, ui: &mut Ui, space: &mut Space, versus: &Versus, flipped: bool) {
    let device = match cx.device {
        Ok(device) => device,
        Err(why) => {
            empty::show(ui, "No 3D views on this graphics device", why, None);
            return;
        }
    };
    update(cx, space, versus);
    if space.clouds.iter().all(Option::is_none) {
        return missing(cx, ui, versus);
    }
    let open = cx.state.library.open.as_ref().map(|open| (open.seq, cx.shared.views.fits));
    if space.fitted != open {
        space.fitted = open;
        space.view.placed = false;
    }
    space.view.camera.orthographic = cx.state.settings.scene.orthographic;
    let mut scene = scene(cx, space, versus, flipped);
    let output = space.view.interact(ui, "3D view, A and B", Grip::Nothing);
    if output.fit || !space.view.placed {
        space.view.camera.frame(&spatial::focus(&scene), spatial::FILLED);
        space.view.placed = true;
    }
    scene.moving = output.moved;
    if output.moved {
        ui.ctx().request_repaint_after(std::time::Duration::from_millis(120));
    }
    space.view.draw(ui, device, &output, &scene);
    legend(cx, ui, versus, flipped, output.response.rect);
}

/// Why there is nothing to draw.
fn missing(cx: &mut Cx<'_>, ui: &mut Ui, versus: &Versus) {
    let state = cx.state;
    if let Some(absent) = results::pose_absent(state) {
        return super::absent_text(cx, ui, absent);
    }
    for subject in [&versus.a, &versus.b] {
        let lookup = results::subject(state, subject, state.selection.finger);
        if lookup.shown().is_none() {
            return super::instead(cx, ui, lookup);
        }
    }
    empty::show(ui, "Loading…", "", None);
}

/// Makes what the renderer needs, where it changed.
fn update(cx: &Cx<'_>, space: &mut Space, versus: &Versus) {
    for (held, letter) in space.clouds.iter_mut().zip([Letter::A, Letter::B]) {
        let points = results::subject_points(cx.state, letter.of(versus));
        let same_pair = |key: &EstimateKey| key.place().map(|(pair, _)| pair) == cx.state.pair_key();
        match points {
            Some((key, _)) if held.as_ref().is_some_and(|held| held.key == key) => {}
            Some((key, clouds)) => {
                space.revision += 1;
                *held = Some(Held { key, revision: space.revision, fingers: parts(clouds) });
            }
            // The one before stays until the next is there, unless it is of another pair.
            None if held.as_ref().is_some_and(|held| same_pair(&held.key)) => {}
            None => *held = None,
        }
    }
    let apart = results::subjects_apart(cx.state, &versus.a, &versus.b).filter(|_| versus.mode == VersusMode::Apart);
    match (apart, &space.apart) {
        (None, _) => space.apart = None,
        (Some((key, _)), Some((held, ..))) if *held == key => {}
        (Some((key, difference)), _) => {
            if let Some(clouds) = cx.state.results.estimates.get(&key.a).map(|estimate| estimate.surface()) {
                space.revision += 1;
                let colored = |pad, values: &Vec<f32>| {
                    let points = clouds.finger(pad)?.points.as_slice().into();
                    Some(Colored { points, values: values.as_slice().into() })
                };
                let mut fingers = PerPad::default();
                for (pad, values) in difference.points.entries() {
                    fingers[pad] = colored(pad, values);
                }
                space.apart = Some((key, space.revision, fingers));
            }
        }
    }
    update_mesh(cx, &mut space.mesh, &mut space.revision);
}

/// Everything that is drawn.
fn scene(cx: &Cx<'_>, space: &Space, versus: &Versus, flipped: bool) -> SceneData {
    let look = &cx.state.settings.scene;
    let mut scene = SceneData { background: rgb(cx.p.canvas), eye_dome: look.eye_dome, ..SceneData::default() };
    let style =
        |color: Color32| CloudStyle { color: rgb(color), size: PointSize::Meters(POINT_M), ..CloudStyle::default() };
    let apart = space.apart.as_ref().filter(|_| versus.mode == VersusMode::Apart && !flipped);
    if let Some((_, revision, fingers)) = apart {
        let range = Range { lo: -look.distance_m, hi: look.distance_m };
        for (finger, colored) in fingers.entries() {
            scene.clouds.push(CloudItem {
                name: format!("apart {}", cx.state.finger_name(finger)),
                revision: *revision,
                points: colored.points.clone(),
                colors: PointColors::Scalar(colored.values.clone()),
                style: CloudStyle { map: DISTANCE_MAP, range, ..style(cx.p.strong) },
            });
        }
    } else {
        for (held, letter) in space.clouds.iter().zip([Letter::A, Letter::B]) {
            let Some(held) = held.as_ref().filter(|_| !flipped || letter == Letter::B) else { continue };
            let own = color(cx.p, versus, letter);
            for (finger, [membrane, contact]) in held.fingers.entries() {
                let finger = cx.state.finger_name(finger);
                let faint = theme::mix(cx.p.canvas, own, 0.35);
                for (name, points, color) in [("membrane ", membrane, faint), (items::CONTACT, contact, own)] {
                    scene.clouds.push(CloudItem {
                        name: format!("{name}{finger} {letter:?}"),
                        revision: held.revision,
                        points: points.clone(),
                        colors: PointColors::One,
                        style: style(color),
                    });
                }
            }
        }
    }
    models(cx, space, versus, flipped, &mut scene);
    if look.layer(SceneLayer::Guides).shown {
        guides(cx, &mut scene);
    }
    scene
}

/// The model at the pose of each: shaded where A has it, as an outline where B has it.
fn models(cx: &Cx<'_>, space: &Space, versus: &Versus, flipped: bool, scene: &mut SceneData) {
    let Some(held) = &space.mesh else { return };
    let cad = cx.state.settings.scene.layer(SceneLayer::Cad);
    for letter in [Letter::A, Letter::B] {
        let Some(pose) = results::subject_pose(cx.state, letter.of(versus)) else { continue };
        if (flipped && letter == Letter::A) || !cad.shown {
            continue;
        }
        let world_from_mesh = pose.grasp_from_object.to_affine();
        let solid = letter == Letter::A || flipped;
        let plain =
            outline(world_from_mesh, color(cx.p, versus, letter), cx.state.settings.scene.layer(SceneLayer::OtherCad));
        let style = if solid {
            MeshStyle {
                look: Look::XRay,
                opacity: 0.5,
                color: rgb(cx.p.cad),
                edges: Some(model_edges(cx, cx.p.cad)),
                ..plain
            }
        } else {
            plain
        };
        scene.meshes.push(MeshItem {
            name: format!("CAD {letter:?}"),
            revision: held.revision,
            mesh: held.mesh.clone(),
            shading: Shading::Smooth,
            values: Arc::default(),
            style,
        });
    }
}

/// Legend of the two subjects, and the bar of the distances.
fn legend(cx: &mut Cx<'_>, ui: &mut Ui, versus: &Versus, flipped: bool, rect: eframe::egui::Rect) {
    let apart = versus.mode == VersusMode::Apart && !flipped;
    let font = FontId::proportional(SMALL);
    let mut corner = rect.min + vec2(8.0, 8.0);
    let painter = ui.painter_at(rect);
    let mut line = |text: String, color: Color32| {
        painter.text(pos2(corner.x, corner.y), Align2::LEFT_TOP, text, font.clone(), color);
        corner.y += 14.0;
    };
    if apart {
        line("A, colored by its distance to B".into(), cx.p.text);
        if let Some((_, difference)) = results::subjects_apart(cx.state, &versus.a, &versus.b) {
            let rms = units::text_mm(difference.contact_rms_m);
            line(format!("contact points: {rms} RMS"), cx.p.text);
        }
    } else {
        for letter in [Letter::A, Letter::B].into_iter().filter(|letter| !flipped || *letter == Letter::B) {
            line(format!("{letter:?}  {}", letter.of(versus).label()), color(cx.p, versus, letter));
        }
    }
    if apart {
        distances(cx, ui, "compared", "", rect);
    }
}
