//! The figures of a comparison: each against the measurement, and one against the other.

use eframe::egui::{Color32, Ui};

use super::{Letter, color};
use crate::app::results;
use crate::app::settings::CompareChoice;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::SMALL;
use crate::ui::parts::widget::line::Line;
use touch2touch_core::units;
use touch2touch_pipeline::compare::Comparison;
use touch2touch_pipeline::compare::subject::Subject;
use touch2touch_pipeline::steps::pose::PoseResult;

/// Four lines of three columns.
pub(super) fn show(cx: &Cx<'_>, ui: &mut Ui, compared: &CompareChoice) {
    const NUMBER: f32 = 78.0;
    let (state, finger) = (cx.state, cx.state.selection.finger);
    let line = Line { height: 14.0, size: SMALL, column: NUMBER, swatch: None };
    let mut row = |name: &str, color: Color32, texts: [String; 3], text_color: Color32, tip: &str| {
        line.show(ui, (name, color), &texts.map(|text| (text, text_color))).on_hover_text(tip);
    };
    let heads = ["PSNR dB", "SSIM", "angle °"].map(str::to_owned);
    row("", cx.p.weak, heads, cx.p.weak, "As in the metrics; behind the angle its error, where the truth is known");
    let poses = [&compared.a, &compared.b].map(|subject| results::subject_pose(state, subject));
    for (letter, pose) in [Letter::A, Letter::B].into_iter().zip(poses) {
        let subject = letter.of(compared);
        let against = (*subject != Subject::Measured)
            .then(|| results::subjects_compared(state, subject, &Subject::Measured, finger).ready())
            .flatten();
        let texts = texts(against, pose.map_or("–".into(), angle));
        row(&format!("{letter:?}"), color(cx.p, compared, letter), texts, cx.p.text, "Against the measurement");
    }
    let between = (compared.a != compared.b)
        .then(|| results::subjects_compared(state, &compared.a, &compared.b, finger).ready())
        .flatten();
    let turned = match poses {
        [Some(a), Some(b)] => format!("{:+.1}", units::wrap_angle(a.angle_rad - b.angle_rad).to_degrees()),
        _ => "–".into(),
    };
    row("A and B", cx.p.strong, texts(between, turned), cx.p.strong, "A against B, and the difference of the angles");
}

fn texts(comparison: Option<&Comparison>, angle: String) -> [String; 3] {
    let number = |v: Option<f64>, digits: usize| {
        v.filter(|v| v.is_finite()).map_or("–".to_owned(), |v| units::fixed(v, digits))
    };
    [number(comparison.and_then(|c| c.psnr_db), 1), number(comparison.and_then(|c| c.ssim), 3), angle]
}

fn angle(pose: &PoseResult) -> String {
    let angle = pose.angle_rad.to_degrees();
    match pose.error_rad {
        Some(error) => format!("{angle:.1} ({:.1})", error.to_degrees()),
        None => format!("{angle:.1}"),
    }
}
