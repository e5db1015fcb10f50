//! Edits of labels: the same masks and the same journal by hand and by verb.

use touch2touch_pipeline::io::masks::MaskStore;

use super::*;

#[test]
pub(super) fn a_drawing_and_a_clean_up_are_the_same_by_hand_and_by_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let path = folder.to_str().unwrap();
    let name = name_of(&json(&["pose", path], home.path()), 0);
    let mut studio = Studio::open(Place::Path(folder.clone()), home.path());
    let mask = MaskSettings { tool: MaskTool::Polygon, wand_m: 0.0004, clean_mm: 1.5, ..MaskSettings::default() };
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    let mask = MaskSettings { choice, ..mask };
    studio.send(prefer(move |s| s.mask = mask.clone()).into());
    let finger = lab::RIGHT;
    let begin = |at_px, erase| LabelsCommand::BeginStroke { finger, source: ImprintSource::Measured, at_px, erase };
    studio.send(begin([20.0, 20.0], false).into());
    for corner in [[60.5, 25.0], [50.0, 70.0]] {
        studio.send(LabelsCommand::Corner(corner).into());
    }
    studio.send(LabelsCommand::Close.into());
    studio.send(prefer(|s| s.mask.tool = MaskTool::Wand).into());
    studio.send(begin([87.0, 70.0], true).into());
    studio.send(LabelsCommand::StrokeTo([99.0, 70.0]).into());
    studio.send(LabelsCommand::EndStroke.into());
    studio.send(LabelsCommand::CleanUp(studio.state.settings.mask.clean_up(CleanKind::Smooth)).into());
    let drawn = results::drawn_mask(&studio.state, ImprintSource::Measured, finger).unwrap().mask.clone();
    drop(studio);
    let stored =
        || Labels::of(&Dataset::open(&folder).unwrap()).load(&name).unwrap().measured(finger).unwrap().mask.clone();
    assert_eq!(stored(), drawn, "on the disk");
    let begun = ["label", path, "--pair", &name, "--finger", "right", "--mask", "threshold"];
    json(&[&begun[..], &["--remove-mask"]].concat(), home.path());
    let polygon = r#"{"tool": "polygon", "paint": "contact", "points": [[20, 20], [60.5, 25], [50, 70]]}"#;
    let wand = r#"{"tool": "wand", "tolerance_m": 0.0004, "paint": "free", "points": [[87, 70], [99, 70]]}"#;
    let draw = ["--draw", polygon, "--draw", wand, "--clean", "smooth=1.5"];
    json(&[&begun[..], &draw[..]].concat(), home.path());
    assert_eq!(stored(), drawn, "by the verb");
    assert!(drawn.as_slice().contains(&true));
    // The journal says the same of both: what was done one after the other, each with its numbers.
    let store = MaskStore::for_dataset(&Dataset::open(&folder).unwrap()).unwrap();
    let journal = String::from_utf8(store.journal(&name).unwrap()).unwrap();
    let lines = journal.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let deeds: Vec<(Value, Value)> = lines.map(|line| (line["name"].clone(), line["how"].clone())).collect();
    let [by_hand, by_verb] = [&deeds[..3], &deeds[4..]];
    assert_eq!((by_hand, &deeds[3].0), (by_verb, &"correction removed".into()));
    assert_eq!(by_hand[0].0, "polygon");
    // Where nobody drew, there is nothing to take away, and nothing has begun.
    let other = name_of(&json(&["pose", path], home.path()), 1);
    let labeled = json(&["label", path, "--pair", &other, "--remove-mask"], home.path());
    assert_eq!(labeled["pairs"][0]["review"], "todo");
}
