//! The tools of pictures: which pair is of which tool, where its CAD model lies, and the camera that is assumed for it.
//!
//! A file [`TOOLS_CSV`] in the folder says which tool a pair is of, in the columns `pair` and `tool`; a column `finger` may say
//! of which finger. Without it, pictures may lie in folders that are named like their tools. CAD models lie in `tools_stls`
//! as the lab's do; for the lab's own tools the catalog has them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use serde::Deserialize;
use touch2touch_core::dataset::{PairEntry, Problem};
use touch2touch_core::rig::{PadId, Rig, lab};
use touch2touch_core::sample::DepthCamera;
use touch2touch_core::sim;

use super::super::{depths, lab as lab_folders, problem};
use crate::io::files;

/// The file that names the tools.
pub(super) const TOOLS_CSV: &str = "tools.csv";

/// A row of [`TOOLS_CSV`].
#[derive(Deserialize)]
struct Row {
    pair: String,
    tool: String,
    finger: Option<String>,
}

/// Folders in `folder` in the order of their names, with the tools that they are named like.
pub(super) fn folders(folder: &Path) -> BTreeMap<String, PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let named = entries.filter(|path| path.is_dir()).filter_map(|path| {
        let name = path.file_name()?.to_str()?;
        (!name.starts_with('.')).then(|| (lab_folders::tool_name(name).to_owned(), path.clone()))
    });
    named.collect()
}

/// Gives the pairs the tools that [`TOOLS_CSV`] names; their fingers, where it says them, in the order of the pairs.
pub(super) fn name(
    folder: &Path,
    pairs: &mut [PairEntry],
    rig: &Rig,
    problems: &mut Vec<Problem>,
) -> Vec<Option<PadId>> {
    let mut fingers = vec![None; pairs.len()];
    let file = folder.join(TOOLS_CSV);
    if !file.exists() {
        return fingers;
    }
    let place: BTreeMap<String, usize> = pairs.iter().zip(0..).map(|(pair, at)| (pair.name.clone(), at)).collect();
    let hint = "its first line names the columns pair, tool and, if known, finger; each other line is a pair";
    let text = match files::read_to_string(&file, files::SMALL) {
        Ok(text) => text,
        Err(err) => {
            problems.push(problem(&file, format!("the tools cannot be read: {err}"), hint));
            return fingers;
        }
    };
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.trim_start_matches('\u{feff}').as_bytes());
    for row in reader.deserialize::<Row>() {
        let row = match row {
            Ok(row) => row,
            Err(err) => {
                problems.push(problem(&file, format!("the tools cannot be read: {err}"), hint));
                continue;
            }
        };
        let Some(&at) = place.get(&row.pair) else {
            let what = format!("there is no pair {:?}", row.pair);
            problems.push(problem(&file, what, "name pairs like their pictures, without _gelslim.png"));
            continue;
        };
        pairs[at].tool = Some(lab_folders::tool_name(&row.tool).to_owned()).filter(|tool| !tool.is_empty());
        let Some(finger) = row.finger.filter(|finger| !finger.is_empty()) else { continue };
        fingers[at] = rig.pads().find(|&pad| rig.pads[pad.index()].key.eq_ignore_ascii_case(&finger));
        if fingers[at].is_none() {
            let keys: Vec<&str> = rig.pads.iter().map(|pad| &*pad.key).collect();
            let what = format!("pair {}: there is no finger {finger:?}", row.pair);
            problems.push(problem(&file, what, format!("the fingers are {}", keys.join(", "))));
        }
    }
    fingers
}

/// The camera that is assumed for a finger: over a gel a straight look at it, for the lab's rig the simulator's nominal one.
pub(super) fn camera(rig: &Rig, finger: PadId) -> Option<DepthCamera> {
    static CAMERAS: LazyLock<[DepthCamera; 2]> = LazyLock::new(|| lab::PADS.map(sim::nominal_camera));
    if rig.is_gel() {
        return depths::assumed_camera(rig, finger);
    }
    (*rig == *Rig::lab()).then(|| CAMERAS.get(finger.index()).cloned()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::dataset::Dataset;
    use touch2touch_core::dataset::PairId;

    fn pictures(folder: &Path, name: &str) {
        std::fs::create_dir_all(folder).unwrap();
        let gray = image::RgbImage::from_fn(32, 32, |x, y| image::Rgb([120, (x * 7 % 250) as u8, (y * 5 % 250) as u8]));
        gray.save(folder.join(format!("{name}_gelslim.png"))).unwrap();
        gray.save(folder.join(format!("{name}_bubble.png"))).unwrap();
    }

    fn tools_of(dataset: &Dataset) -> Vec<(&str, Option<&str>)> {
        dataset.index.pairs.iter().map(|pair| (pair.name.as_str(), pair.tool.as_deref())).collect()
    }

    #[test]
    fn a_table_names_tools_and_fingers_and_says_what_it_does_not_understand() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["00", "01", "02"] {
            pictures(dir.path(), name);
        }
        let rows =
            "\u{feff}pair, tool ,finger\n00,pattern_37,Left\n01,my_tool,\n07,pattern_37,right\n02,pattern_32,thumb\n";
        std::fs::write(dir.path().join(TOOLS_CSV), rows).unwrap();
        let dataset = Dataset::open(dir.path()).unwrap();
        let named = [("00", Some("pattern_37")), ("01", Some("my_tool")), ("02", Some("pattern_32"))];
        assert_eq!(tools_of(&dataset), named);
        let said: Vec<&str> = dataset.problems.iter().map(|problem| problem.what.as_str()).collect();
        assert_eq!(said.len(), 3, "{said:?}");
        assert!(said.iter().any(|what| what.contains("no pair \"07\"")), "{said:?}");
        assert!(said.iter().any(|what| what.contains("no finger \"thumb\"")), "{said:?}");
        assert!(said.iter().any(|what| what.contains("CAD model of my_tool is missing")), "{said:?}");
        // The lab's tools are known; another one needs its file.
        assert!(dataset.tool_mesh("pattern_37").unwrap().is_some() && dataset.tool_mesh("my_tool").unwrap().is_none());
        std::fs::create_dir(dir.path().join("tools_stls")).unwrap();
        let mesh = dataset.tool_mesh("pattern_31_rod").unwrap().unwrap();
        crate::io::stl::write(&dir.path().join("tools_stls/my_tool.stl"), &mesh).unwrap();
        let dataset = Dataset::open(dir.path()).unwrap();
        assert!(dataset.tool_mesh("my_tool").unwrap().is_some());
        let left = dataset.load(PairId(0)).unwrap();
        let camera = left.pads[lab::RIGHT].as_ref().unwrap().camera().unwrap();
        assert_eq!((left.taken_by, camera), (Some(lab::LEFT), &sim::nominal_camera(lab::LEFT)));
    }

    #[test]
    fn folders_name_the_tools_of_the_pictures_in_them() {
        let dir = tempfile::tempdir().unwrap();
        pictures(&dir.path().join("pattern_31_rod"), "data_0");
        pictures(&dir.path().join("pattern_37"), "data_0");
        let dataset = Dataset::open(dir.path()).unwrap();
        let named = [("pattern_31_rod/data_0", Some("pattern_31_rod")), ("pattern_37/data_0", Some("pattern_37"))];
        assert_eq!(tools_of(&dataset), named);
        assert!(dataset.load(PairId(1)).unwrap().pads[lab::RIGHT].as_ref().unwrap().camera().is_some());
        // Without names there is no tool, no camera and no pose.
        pictures(dir.path(), "lone");
        let dataset = Dataset::open(dir.path()).unwrap();
        assert_eq!(tools_of(&dataset), [("lone", None)]);
        assert!(dataset.load(PairId(0)).unwrap().pads[lab::RIGHT].as_ref().unwrap().camera().is_none());
    }

    #[test]
    fn a_broken_table_costs_the_names_alone() {
        let dir = tempfile::tempdir().unwrap();
        pictures(dir.path(), "00");
        for (text, what) in
            [("pair\n00\n", "missing field `tool`"), ("pair,tool\n00,a,b,c\n", "fields"), ("\0\0", "missing")]
        {
            std::fs::write(dir.path().join(TOOLS_CSV), text).unwrap();
            let dataset = Dataset::open(dir.path()).unwrap();
            assert_eq!(tools_of(&dataset), [("00", None)]);
            let said =
                dataset.problems.iter().any(|p| p.what.contains("tools cannot be read") && p.what.contains(what));
            assert!(said || text.starts_with('\0'), "{text:?}: {:?}", dataset.problems);
        }
    }
}
