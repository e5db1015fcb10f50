//! Files: a pair for other programs, pictures, cases.

use strum::IntoEnumIterator as _;
use touch2touch::app::command::{ExportCommand, WorkbenchCommand};
use touch2touch::app::export::Output;
use touch2touch::app::{recipe, results};
use touch2touch_work::case::{self, Case};
use touch2touch_work::io::case_file;
use touch2touch_work::mask::MaskSource;
use touch2touch_work::recipe::Stage;

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
pub(in crate::agreement) fn a_random_recipe_draws_the_same_pictures_by_button_and_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(11);
    let mut counts = Vec::new();
    let panes = [Pane::GelSlim, Pane::Measured, Pane::Predicted, Pane::Compare];
    for mut both in Both::places(home.path()) {
        both.show(&panes);
        let mut count = 0;
        let recipe = draws.recipe();
        both.predict(&recipe, 57);
        both.studio.send(ViewCommand::ShowBothFingers(draws.of(&[true, false])).into());
        for pane in panes {
            let what = format!("{} {pane:?}, {recipe:?}", both.studio.state.pair_name());
            let file = both.home.parent().unwrap().join(format!("{pane:?}.png"));
            let picture = Output::Picture { pane, scale: Some(2), error_m: 0.004 };
            both.studio.send(ExportCommand::Write(picture, file.clone()).into());
            let said = both.said(pane);
            // Such as a raw picture, of which only the difference is there.
            assert_eq!(file.is_file(), said.is_ok(), "{what}: {said:?}");
            let Ok(said) = said else { continue };
            let [a, b] = [&file, Path::new(said["file"].as_str().unwrap())].map(|f| std::fs::read(f).unwrap());
            assert!(a == b, "{what}: {} and {} bytes", a.len(), b.len());
            count += a.len();
        }
        counts.push(count);
    }
    compared(&counts, 20_000);
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

/// A case without what decides no result: how the studio showed it, and numbers of masks of another source.
fn decisive(case: &Case) -> Value {
    let mut value = written(case);
    value.as_object_mut().unwrap().remove("view");
    let (numbers, takes_model): (&[&str], bool) = match case.recipe.mask.source {
        MaskSource::Auto => (&["threshold_m", "probability"], true),
        MaskSource::Unet => (&["probability"], true),
        MaskSource::Threshold => (&["threshold_m"], false),
        MaskSource::TopPercent => (&["top_percent"], false),
        MaskSource::Cad => (&["cad_distance_m"], false),
        MaskSource::Truth => (&[], false),
    };
    let recipe = value["recipe"].as_object_mut().unwrap();
    recipe["mask"].as_object_mut().unwrap().retain(|key, _| key == "source" || numbers.contains(&key.as_str()));
    recipe.retain(|key, _| key != "mask_model" || takes_model);
    value
}

#[test]
pub(in crate::agreement) fn a_case_of_a_random_recipe_is_the_same_by_button_and_verb_and_the_verb_finds_it_so() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(12);
    let mut counts = Vec::new();
    for mut both in Both::places(home.path()) {
        both.show(&[Pane::Predicted, Pane::Scene]);
        let recipe = draws.posed();
        both.predict(&recipe, 44);
        let what = format!("{}, {recipe:?}", both.studio.state.pair_name());
        let by_studio = both.home.parent().unwrap().join("studio.t2tcase");
        both.studio.send(ExportCommand::Write(Output::Case, by_studio.clone()).into());
        let by_verb = both.at("verb.t2tcase");
        let words = recipe::in_force(&both.studio.state, ImprintSource::Predicted).words(Stage::Pose).list();
        let out = ["--out".to_owned(), by_verb.clone()];
        let said = both.of_pair(&["case", "make"], out.into_iter().chain(words));
        assert_eq!(by_studio.is_file(), said.is_ok(), "{what}: {said:?}");
        assert!(said.is_ok(), "{what}: {said:?}");
        // Everything apart from how the studio showed it.
        let opened = [by_studio.as_path(), Path::new(&by_verb)].map(|file| {
            let case = case::open(file, &home.path().join("cases")).unwrap().case;
            (decisive(&case), case_file::read(file).unwrap())
        });
        let [(a, in_a), (b, in_b)] = &opened;
        let mut count = same(a, b, &what);
        assert!(in_a.files == in_b.files && in_a.beside == in_b.beside, "{what}: files");
        count += in_a.beside.len();
        let found = both.run(&["case", "check", by_studio.to_str().unwrap()].map(str::to_owned)).unwrap();
        assert_eq!((&found["same"], &found["differences"]), (&true.into(), &serde_json::json!([])), "{what}");
        count += found["compared"].as_u64().unwrap() as usize;
        counts.push(count);
    }
    compared(&counts, 10);
}
