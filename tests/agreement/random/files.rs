//! Files: a pair for other programs.

use strum::IntoEnumIterator as _;
use touch2touch::app::command::{ExportCommand, WorkbenchCommand};
use touch2touch::app::export::Output;
use touch2touch::app::results;

use super::*;

#[test]
pub(in crate::agreement) fn a_random_recipe_exports_the_same_files_by_button_and_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(10);
    let mut counts = Vec::new();
    // Pictures have no points in space.
    for mut both in Both::places(home.path()).take(2) {
        both.show(&[Pane::Predicted, Pane::Scene]);
        let mut count = 0;
        for at in 0..2 {
            let recipe = draws.posed();
            both.predict(&recipe, 13 * at);
            for source in ImprintSource::iter() {
                // A command is about the side under the pointer.
                both.studio.send(WorkbenchCommand::SetSide(source).into());
                let what = format!("{} {source:?}, {recipe:?}", both.studio.state.pair_name());
                let folder = both.home.parent().unwrap().join(format!("exported-{at}-{}", source.key()));
                let there = results::pose(&both.studio.state, source).ready().is_some();
                both.studio.send(ExportCommand::Write(Output::Pair(source), folder.clone()).into());
                let said = both.said(Pane::Scene);
                assert_eq!(there, said.is_ok(), "{what}: {said:?}");
                let Ok(said) = said else { continue };
                for file in said["files"].as_array().unwrap() {
                    let file = Path::new(file.as_str().unwrap());
                    let [a, b] =
                        [folder.join(file.file_name().unwrap()), file.to_owned()].map(|f| std::fs::read(f).unwrap());
                    assert!(a == b, "{what}: {}: {} and {} bytes", file.display(), a.len(), b.len());
                    count += a.len();
                }
            }
        }
        counts.push(count);
    }
    compared(&counts, 100_000);
}

#[test]
pub(in crate::agreement) fn the_unit_of_a_cad_model_is_written_the_same_by_button_and_verb() {
    let home = tempfile::tempdir().unwrap();
    let [own, twin] = ["one", "other"].map(|name| lab_folder(&home.path().join(name)));
    let mut both = Both::open(Place::Path(own.clone()), home.path());
    let (tool, unit) = ("pattern_36", "m");
    let named = LibraryCommand::ReadToolAs { tool: tool.into(), unit: unit.parse().unwrap(), replacing: None };
    both.studio.send(named.into());
    both.run(&["doctor", twin.to_str().unwrap(), "--set", &format!("unit:{tool}={unit}")].map(str::to_owned)).unwrap();
    let [shown, said] = [own, twin].map(|folder| std::fs::read_to_string(folder.join("tools_stls/unit.txt")).unwrap());
    assert_eq!((shown.trim(), &shown), (unit, &said));
}
