//! Any two imprints against each other: figures, pictures, and that nothing is made out of sight.

use eframe::egui::{Event, Key, Pos2, Rect};
use egui_kittest::kittest::Queryable as _;
use touch2touch::app::command::{Pane, PredictCommand};
use touch2touch::app::keys::{ImprintKey, ImprintSource, ShiftMode};
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch::app::settings::{CompareChoice, CompareMode, Workspace};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::compare::subject::Subject;

use super::rig::Rig;

/// The pixels of a part of the screen.
pub(super) fn pixels(rig: &mut Rig, rect: Rect) -> Vec<[u8; 4]> {
    let image = rig.harness.render().unwrap();
    let inside = |x: u32, y: u32| rect.contains(Pos2::new(x as f32, y as f32));
    image.enumerate_pixels().filter(|(x, y, _)| inside(*x, *y)).map(|(_, _, p)| p.0).collect()
}

fn subject(text: &str) -> Subject {
    text.parse().unwrap()
}

fn set(rig: &mut Rig, a: &str, b: &str, mode: CompareMode) {
    let compared = CompareChoice { a: subject(a), b: subject(b), mode };
    rig.send(prefer(move |s| *s.compare_mut() = compared.clone()));
    rig.settle();
}

#[test]
fn any_two_imprints_are_compared_where_somebody_looks() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    rig.send(PredictCommand::Generate);
    // Behind a pane that fills the window nothing is made of what is wished there.
    rig.fill("Predicted imprint");
    set(&mut rig, "prediction:seed=7", "measured", CompareMode::Side);
    let made = |rig: &Rig| rig.state().results.made.values().map(Vec::len).sum::<usize>();
    assert!(!rig.state().selection.panes.contains(&Pane::Compare));
    assert_eq!(made(&rig), 2, "one for each finger");
    let chosen = results::chosen(rig.state(), lab::RIGHT).cloned();

    rig.click("Back to all panes");
    let (a, b) = (subject("prediction:seed=7"), Subject::Measured);
    assert_eq!(made(&rig), 4, "the wished ones, of both fingers: they make one pose");
    assert_eq!(results::chosen(rig.state(), lab::RIGHT).cloned(), chosen, "what the other panes show stays");
    let found = results::subjects_compared(rig.state(), &a, &b, lab::RIGHT).ready().expect("the figures");
    let key = results::subject_key(rig.state(), &a, lab::RIGHT).unwrap();
    let ImprintKey::Predicted(recipe, ShiftMode::ExactInverse) = &key else { panic!("{key:?}") };
    assert_eq!(recipe.config.seed, 7);
    let measured = results::imprint(rig.state(), ImprintSource::Measured, lab::RIGHT).ready().unwrap();
    let predicted = results::subject(rig.state(), &a, lab::RIGHT).ready().unwrap();
    assert_eq!(found.error[(60, 70)], predicted[(60, 70)] - measured[(60, 70)]);
    assert!(results::subject_pose(rig.state(), &a).is_some() && results::subject_pose(rig.state(), &b).is_some());

    // The prediction on screen against the measurement is what the metrics say.
    set(&mut rig, "prediction", "measured", CompareMode::Difference);
    let state_now = rig.state();
    let compared = results::subjects_compared(state_now, &Subject::shown(), &b, lab::RIGHT).ready().unwrap();
    let error = results::comparison(state_now, lab::RIGHT).ready().unwrap();
    assert_eq!((compared.psnr_db, compared.ssim, compared.mae_m), (error.psnr_db, error.ssim, error.mae_m));
    let at = (60, 70);
    let before = compared.error[at];

    // The other way round, the sign changes and nothing else.
    set(&mut rig, "measured", "prediction", CompareMode::Difference);
    let after = results::subjects_compared(rig.state(), &b, &Subject::shown(), lab::RIGHT).ready().unwrap().error[at];
    assert_eq!(after, -before);
    assert_eq!(rig.state().settings.compared().b, Subject::shown());
}

#[test]
fn a_key_flickers_and_both_values_are_read() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    rig.send(PredictCommand::Generate);
    set(&mut rig, "prediction", "measured", CompareMode::Side);
    // Large pictures: half a pixel beside is little of them.
    rig.fill("Compare");
    let place = rig.harness.get_by_label("Compare A right").rect();
    let middle = Rect::from_center_size(place.center(), place.size() * 0.5);
    let other = rig.harness.get_by_label("Compare B right").rect();
    let (a, b) = (pixels(&mut rig, middle), pixels(&mut rig, middle.translate(other.center() - place.center())));
    rig.harness.key_down(Key::F);
    rig.harness.step();
    rig.harness.run();
    let held = pixels(&mut rig, middle);
    rig.harness.key_up(Key::F);
    rig.harness.step();
    rig.harness.run();
    // Not the same pixels of the screen: half a pixel beside.
    let apart = |x: &[[u8; 4]], y: &[[u8; 4]]| {
        let of = |(x, y): (&[u8; 4], &[u8; 4])| x.iter().zip(y).map(|(x, y)| f64::from(x.abs_diff(*y))).sum::<f64>();
        x.iter().zip(y).map(of).sum::<f64>() / x.len() as f64
    };
    let same = |x: &[[u8; 4]], y: &[[u8; 4]]| x.iter().zip(y).filter(|(x, y)| x == y).count() as f64 / x.len() as f64;
    assert!(same(&a, &b) < 0.9, "the two differ: {}", same(&a, &b));
    assert!(apart(&held, &b) < 0.3 * apart(&held, &a), "B while F is held: {} {}", apart(&held, &b), apart(&held, &a));
    assert!(same(&pixels(&mut rig, middle), &a) > 0.98, "and A again afterwards");

    // The status bar has both values.
    rig.harness.event(Event::PointerMoved(place.center()));
    rig.harness.run();
    let read = rig.harness.get_all_by_label_contains("A minus B ").count();
    assert!(read > 0, "both values and their difference");
}

#[test]
fn the_choice_is_kept_per_workspace_and_what_is_not_there_says_so() {
    let Some(mut rig) = Rig::new([1280.0, 800.0], 1) else { return };
    rig.send(PredictCommand::Generate);
    set(&mut rig, "mean:seeds=2", "measured", CompareMode::Side);
    rig.send(prefer(|s| s.workspace = Workspace::Align));
    assert_eq!(rig.state().settings.compared(), CompareChoice::default());
    rig.send(prefer(|s| s.workspace = Workspace::Inspect));
    rig.restart([1280.0, 800.0]);
    assert_eq!(rig.state().settings.compared().a, subject("mean:seeds=2"), "kept in the preferences");
    set(&mut rig, "stored", "prediction:bundle=gone", CompareMode::Side);
    assert!(rig.harness.query_all_by_label_contains("is gone; choose another").next().is_some());
}
