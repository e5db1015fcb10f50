//! Figures of a whole data set: statistics of its predictions and the order of its masks.

use touch2touch::app::{recipe, results};
use touch2touch_core::postprocess::ShiftMode;
use touch2touch_pipeline::io::names::Outputs;
use touch2touch_pipeline::steps::recipe::Stage;

use super::*;

/// The only file below a folder.
fn only_file(folder: &Path) -> Value {
    let files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let [file] = &files[..] else { panic!("{files:?}") };
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

#[test]
pub(in crate::agreement) fn statistics_of_a_random_recipe_are_the_same_by_button_and_verb_and_shift_the_same() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(7);
    let (mut counts, mut shifted) = (Vec::new(), Vec::new());
    // The demo has 96 pairs, which take minutes.
    for mut both in Both::places(home.path()).skip(1) {
        both.show(&[Pane::Predicted, Pane::Compare, Pane::Metrics]);
        let recipe = draws.posed();
        put(&mut both.studio, &recipe);
        let words = recipe::in_force(&both.studio.state, ImprintSource::Predicted).words(Stage::Prediction).list();
        both.studio.send(PredictCommand::Refit.into());
        assert!(matches!(both.studio.state.settings.shift, ShiftMode::Refit(_)), "{:?}", both.studio.state.log.entries);
        let shown = only_file(&both.home.parent().unwrap().join("studio/statistics"));
        let begin = ["stats", &both.path, "--out", &both.at("statistics.json")].map(str::to_owned);
        let said = both.run(&begin.into_iter().chain(words).collect::<Vec<_>>()).unwrap();
        let file: Value = serde_json::from_slice(&std::fs::read(both.at("statistics.json")).unwrap()).unwrap();
        // Apart from the time of day.
        let shown = without(shown, &["made"]);
        counts.push(same(&shown, &without(file, &["made"]), &format!("{recipe:?}")));
        same(&shown, &without(said, &["made", "file", "failed", "gain", "offset_m"]), "what the verb says");
        // Predictions by it are the same, too.
        both.predict(&Recipe { shift: both.studio.state.settings.shift, ..recipe.clone() }, 1);
        let said = both.said(Pane::Generate).unwrap();
        let stem =
            Outputs::new(Path::new(&both.at("predictions"))).unwrap().stem(both.studio.state.pair_name()).unwrap();
        let mut count = 0;
        for finger in both.studio.state.rig().pads() {
            let Some(found) = results::comparison(&both.studio.state, finger).ready() else { continue };
            let name = both.studio.state.finger_name(finger);
            let row = said["pairs"].as_array().unwrap().iter().find(|row| row["finger"] == *name).unwrap();
            count += same(&written(&found.psnr_db), &row["psnr_db"], &format!("{name}, {recipe:?}"));
            count += same(&written(&found.ssim), &row["ssim"], &format!("{name}, {recipe:?}"));
            let imprint = results::imprint(&both.studio.state, ImprintSource::Predicted, finger).ready().unwrap();
            let file = PathBuf::from(format!("{}_{name}.npy", stem.display()));
            count += same_pixels(imprint, &file, &format!("{name}, {recipe:?}"));
        }
        shifted.push(count);
    }
    compared(&counts, 14);
    compared(&shifted, 24_500);
}
