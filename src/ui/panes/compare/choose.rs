//! The list that says what stands on one side of a comparison.

use eframe::egui::{ComboBox, RichText, Ui};

use super::{Letter, color};
use crate::app::settings::CompareChoice;
use crate::ui::parts::cx::Cx;
use touch2touch_core::rig::SensorKind;
use touch2touch_pipeline::compare::subject::{RecipeChange, Subject};
use touch2touch_pipeline::steps::bundles::BundleInfo;

/// Seeds of the mean.
const SEEDS: usize = 8;

/// The list of one of the two, `width` points wide; what was chosen.
pub(super) fn list(cx: &Cx<'_>, ui: &mut Ui, compared: &CompareChoice, letter: Letter, width: f32) -> Option<Subject> {
    let subject = letter.of(compared);
    let label = subject.label();
    let text = RichText::new(format!("{letter:?}  {label}")).color(color(cx.p, compared, letter));
    let combo = ComboBox::from_id_salt(("compared", letter)).width(width.max(48.0)).selected_text(text).truncate();
    let mut chosen = None;
    let response = combo.show_ui(ui, |ui| {
        ui.style_mut().override_font_id = None;
        for (value, text, tip) in rows(cx) {
            if ui.selectable_label(*subject == value, text).on_hover_text(tip).clicked() {
                chosen = Some(value);
            }
        }
    });
    let tip = format!("{label}. Click to choose another; each workspace remembers its own");
    response.response.accessible_name(format!("{letter:?}: {label}")).on_hover_text(tip);
    chosen
}

/// What can stand on a side: the measurement, the prediction on screen, that of each other model.
fn rows(cx: &Cx<'_>) -> Vec<(Subject, String, &'static str)> {
    let rig = cx.state.rig();
    let depth = |b: &&BundleInfo| b.generator.as_ref().is_some_and(|g| g.sensors.output.kind == SensorKind::Depth);
    let bundles = cx.state.library.bundles.iter().filter(|b| b.fits(&rig)).filter(depth);
    let mut rows = vec![
        (Subject::Measured, "Measured".to_owned(), "What the Soft Bubble measured"),
        (Subject::shown(), "Prediction on screen".to_owned(), "The prediction that the other panes show"),
    ];
    rows.extend(bundles.map(|bundle| {
        let change = RecipeChange { bundle: Some(bundle.name.clone()), ..RecipeChange::default() };
        (Subject::Predicted(change), bundle.name.clone(), "The prediction of this model; all else follows Generate")
    }));
    let mean = Subject::Mean(RecipeChange::default(), SEEDS);
    rows.push((mean, format!("Mean of {SEEDS} seeds"), "Mean of predictions with different seeds"));
    let tip = "Prediction of another program: NAME_vqvae.png beside the pair";
    rows.push((Subject::Stored, "Stored picture".to_owned(), tip));
    rows
}
