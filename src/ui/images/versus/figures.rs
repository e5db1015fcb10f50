//! The figures of a comparison: each against the measurement, and one against the other.

use eframe::egui::{Align, Grid, Layout, RichText, Ui};

use super::{Letter, color};
use crate::app::settings::Versus;
use crate::domain::units;
use crate::ui::cx::Cx;
use crate::ui::theme::SMALL;
use crate::work::compare::Comparison;
use crate::work::pose::PoseResult;
use crate::work::subject::Subject;

/// The columns with what they mean.
const COLUMNS: [(&str, &str); 7] = [
    ("", ""),
    ("dB", "PSNR against the measurement (last row: A against B), as in the metrics"),
    ("SSIM", "Structural similarity against the measurement (last row: of A and B)"),
    ("mm", "Mean absolute difference in millimeters"),
    ("seen", "The same where the GelSlim saw, mm"),
    ("invented", "The same where the model made it up, mm"),
    (
        "angle °",
        "The registered angle in degrees, in brackets its error where the truth is known (last row: A minus B)",
    ),
];

pub(super) fn show(cx: &Cx<'_>, ui: &mut Ui, versus: &Versus) {
    let state = cx.state;
    let finger = state.selection.finger;
    let small = |text: String| RichText::new(text).size(SMALL);
    let spacing = if ui.available_width() < 330.0 { 5.0 } else { 12.0 };
    Grid::new("compared figures").num_columns(COLUMNS.len()).spacing([spacing, 1.0]).min_row_height(13.0).show(
        ui,
        |ui| {
            for (name, tip) in COLUMNS {
                right(ui, small(name.into()).color(cx.p.weak), tip);
            }
            ui.end_row();
            for letter in [Letter::A, Letter::B] {
                let subject = letter.of(versus);
                ui.label(small(format!("{letter:?}")).color(color(cx.p, versus, letter)).strong());
                let against = (*subject != Subject::Measured)
                    .then(|| state.subjects_compared(subject, &Subject::Measured, finger).ready())
                    .flatten();
                cells(ui, against);
                right(ui, small(state.subject_pose(subject).map_or("–".into(), angle)), COLUMNS[6].1);
                ui.end_row();
            }
            ui.label(small("A - B".into()).strong());
            let apart = (versus.a != versus.b).then(|| state.subjects_compared(&versus.a, &versus.b, finger).ready());
            cells(ui, apart.flatten());
            let poses = [&versus.a, &versus.b].map(|subject| state.subject_pose(subject));
            let turned = match poses {
                [Some(a), Some(b)] => format!("{:+.1}", units::wrap_angle(a.angle_rad - b.angle_rad).to_degrees()),
                _ => "–".into(),
            };
            right(ui, small(turned), COLUMNS[6].1);
            ui.end_row();
        },
    );
}

fn angle(pose: &PoseResult) -> String {
    let angle = pose.angle_rad.to_degrees();
    match pose.error_rad {
        Some(error) => format!("{angle:.1} ({:.1})", error.to_degrees()),
        None => format!("{angle:.1}"),
    }
}

fn cells(ui: &mut Ui, found: Option<&Comparison>) {
    let split = found.and_then(|found| found.split);
    let number = |v: Option<f64>, digits: usize| {
        v.filter(|v| v.is_finite()).map_or("–".to_owned(), |v| units::fixed(v, digits))
    };
    let mm = |v: Option<f64>| number(v.map(units::mm), 2);
    let texts = [
        number(found.and_then(|found| found.psnr_db), 1),
        number(found.and_then(|found| found.ssim), 3),
        mm(found.map(|found| found.mae_m)),
        mm(split.and_then(|split| split.seen.mae)),
        mm(split.and_then(|split| split.invented.mae)),
    ];
    for (text, (_, tip)) in texts.into_iter().zip(&COLUMNS[1..]) {
        right(ui, RichText::new(text).size(SMALL), tip);
    }
}

fn right(ui: &mut Ui, text: RichText, tip: &str) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        let label = ui.label(text);
        if !tip.is_empty() {
            label.on_hover_text(tip);
        }
    });
}
