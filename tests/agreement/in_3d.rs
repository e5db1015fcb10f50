//! Drawings in 3D: the same pixels by the studio, from the journal, and by the verb.

use glam::{DVec3, Mat4, Vec4};
use touch2touch::app::labels::StrokeIn3d;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch_core::label::{Layers, Sight};
use touch2touch_pipeline::io::masks::MaskStore;

use super::*;

const MEASURED: ImprintSource = ImprintSource::Measured;

/// From the right finger's side (+x) along the closing axis, the wrist up, 200 mm across; parallel lines of sight.
fn from_the_right(layers: Layers) -> Sight {
    let clip = Mat4::from_cols(Vec4::Z * 5.0, Vec4::NEG_X * 10.0, Vec4::NEG_Y * 10.0, Vec4::new(0.0, 0.0, 0.5, 1.0));
    Sight { clip_from_grasp: clip, size_px: [600, 600], layers }
}

#[test]
fn a_drawing_in_3d_is_the_same_by_hand_from_the_journal_and_by_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let path = folder.to_str().unwrap();
    let name = name_of(&json(&["pose", path], home.path()), 0);
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    let mask = MaskSettings { choice, radius_px: 5.0, ..MaskSettings::default() };
    let stroke = |studio: &mut Studio, finger, layers, way: &[[f32; 2]], erase| {
        let (sight, size_at) = (from_the_right(layers), DVec3::ZERO);
        let begin = StrokeIn3d { finger, source: MEASURED, sight, at_px: way[0], size_at, erase };
        studio.send(LabelsCommand::BeginIn3d(Box::new(begin)).into());
        for at in way {
            studio.send(LabelsCommand::StrokeTo(*at).into());
        }
        studio.send(LabelsCommand::EndStroke.into());
    };
    let stored = |finger| {
        let labels = Labels::of(&Dataset::open(&folder).unwrap()).load(&name).unwrap();
        labels.measured(finger).map(|hand| hand.mask.clone())
    };
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    studio.send(prefer(move |s| s.mask = mask.clone()).into());
    // The left finger lies behind the right one: only a drawing through all layers reaches it.
    stroke(&mut studio, lab::LEFT, Layers::Front, &[[290.0, 300.0], [310.0, 320.0]], false);
    assert!(results::drawn_mask(&studio.state, MEASURED, lab::LEFT).is_none(), "hidden");
    stroke(&mut studio, lab::LEFT, Layers::All, &[[290.0, 300.0], [310.0, 320.0]], false);
    assert!(results::drawn_mask(&studio.state, MEASURED, lab::LEFT).is_some());
    studio.send(LabelsCommand::Undo.into());
    assert!(results::drawn_mask(&studio.state, MEASURED, lab::LEFT).is_none(), "one gesture, one undo");
    stroke(&mut studio, lab::RIGHT, Layers::Front, &[[250.0, 240.0], [270.0, 250.0]], false);
    studio.send(prefer(|s| s.mask.tool = MaskTool::Lasso).into());
    stroke(&mut studio, lab::RIGHT, Layers::Front, &[[290.0, 290.0], [320.0, 290.0], [310.0, 330.0]], true);
    let names: Vec<_> = studio.state.history.done().iter().map(|gesture| gesture.name.to_string()).collect();
    assert_eq!(names, ["brush stroke in 3D", "lasso in 3D"]);
    let drawn = results::drawn_mask(&studio.state, MEASURED, lab::RIGHT).unwrap().mask.clone();
    drop(studio);
    assert_eq!(stored(lab::RIGHT), Some(drawn.clone()), "on the disk");
    // What the journal says of each of them is what the verb takes.
    let store = MaskStore::for_dataset(&Dataset::open(&folder).unwrap()).unwrap();
    let journal = String::from_utf8(store.journal(&name).unwrap()).unwrap();
    let lines = journal.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let drawings: Vec<String> = lines
        .filter(|line| line["name"].as_str().is_some_and(|n| n.ends_with("in 3D")) && line["how"].is_object())
        .map(|line| line["how"].to_string())
        .filter(|how| how.contains(r#""layers":"front""#))
        .collect();
    assert_eq!(drawings.len(), 2, "{journal}");
    let begun = ["label", path, "--pair", &name, "--finger", "right", "--mask", "threshold"];
    json(&[&begun[..], &["--remove-mask"]].concat(), home.path());
    assert_eq!(stored(lab::RIGHT), None);
    json(&[&begun[..], &["--draw", &drawings[0], "--draw", &drawings[1]]].concat(), home.path());
    assert_eq!(stored(lab::RIGHT), Some(drawn), "by the verb");
}
