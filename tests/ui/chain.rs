//! The depth chain: the refit.

use touch2touch::app::command::PredictCommand;
use touch2touch::app::keys::ShiftMode;
use touch2touch::app::recipe;
use touch2touch::app::settings::prefer;
use touch2touch_pipeline::steps::bundles::BundleKind;

use super::rig::Rig;

const SIZE: [f32; 2] = [1280.0, 800.0];

#[test]
fn a_refit_is_computed_used_kept_and_refused_by_another_model() {
    let Some(mut rig) = Rig::new(SIZE, 2) else { return };
    rig.send(PredictCommand::Generate);
    rig.send(PredictCommand::Refit);
    let state = rig.state();
    let ShiftMode::Refit(refit) = state.settings.shift else { panic!("{:?}", state.settings.shift) };
    assert!(state.log.entries.iter().any(|e| e.text.contains("Shift statistics of 8 touches")), "{:?}", state.log);
    let kept = std::fs::read_dir(rig.config.join("statistics")).unwrap().count();
    assert_eq!(kept, 1);
    // The mean of what is predicted is that of what is measured, over the data set.
    let used = &recipe::bundle(state, BundleKind::Generator).unwrap().id;
    assert!(refit.stats().gt_std > 0.0 && refit.check(used).is_ok() && refit.check("other").is_err());
    // It is a choice like the others from now on, and survives a restart.
    rig.send(prefer(|s| s.shift = ShiftMode::Raw));
    rig.restart(SIZE);
    assert_eq!(rig.state().settings.refit, Some(refit));
}
