//! The 3D views: distances, what is drawn, cameras.

use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::WorkbenchCommand;
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::results;
use touch2touch::app::settings::SceneLayer;
use touch2touch::app::workbench::Layer;
use touch2touch_core::rig::lab;

use super::compare::pixels;
use super::rig::Rig;

const MEASURED: ImprintSource = ImprintSource::Measured;

/// Colors of the measured view, as a set.
fn colors(rig: &mut Rig) -> std::collections::BTreeSet<[u8; 4]> {
    let rect = rig.harness.get_by_label("3D view, measured").rect();
    pixels(rig, rect).into_iter().collect()
}

#[test]
fn distances_are_those_of_the_contact_points_and_colors_show_them() {
    let Some(mut rig) = Rig::aligned() else { return };
    assert!(results::deviation(rig.state(), MEASURED).ready().is_none(), "nothing is computed that no view shows");
    let before = colors(&mut rig);
    rig.send(WorkbenchCommand::SetLayer(Layer::Distance));
    rig.settle();
    let found = results::deviation(rig.state(), MEASURED).ready().expect("the view shows it");
    let clouds = results::cloud(rig.state(), MEASURED).ready().unwrap();
    let tool = &results::tool(rig.state()).ready().unwrap().model;
    let pose = results::pose(rig.state(), MEASURED).ready().unwrap().grasp_from_object;
    assert_eq!(found.grasp_from_object, pose);
    let cloud = clouds.finger(lab::RIGHT).unwrap();
    let contact: Vec<_> = (0..cloud.points.len()).filter(|i| cloud.contact[*i]).collect();
    let distances = found.points[lab::RIGHT].as_ref().unwrap();
    assert_eq!(distances.len(), contact.len());
    for (at, d) in contact.iter().zip(distances).step_by(97) {
        let in_object = pose.to_affine().inverse().transform_point3(cloud.points[*at]);
        assert!((tool.distance.signed(in_object) - f64::from(*d)).abs() < 1e-7);
    }
    let painted = found.surface.values.iter().filter(|v| v.is_finite()).count();
    assert!(painted > 1000 && painted < found.surface.values.len(), "{painted}");
    let with = colors(&mut rig);
    // Whites, blues and reds of the map that no picture has without it.
    assert!(with.difference(&before).count() > 200);
}

#[test]
fn the_list_of_what_is_drawn_switches_it_and_it_stays_so() {
    let Some(mut rig) = Rig::aligned() else { return };
    let legend = rig.harness.get_by_label("Legend").rect().center();
    rig.click_at(legend);
    let before = colors(&mut rig);
    let at = rig.harness.get_by_label("Show membrane, measured").rect().center();
    rig.click_at(at);
    assert!(!rig.state().settings.scene.shows(SceneLayer::Membrane));
    assert!(colors(&mut rig).len() < before.len());
    rig.click_at(at);
    assert!(rig.state().settings.scene.hidden.is_empty());
}
