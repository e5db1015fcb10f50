//! The figures of a comparison: each against the measurement, and one against the other.

use eframe::egui::{Align2, Color32, FontId, Rect, Sense, Ui, pos2, vec2};

use super::{Letter, color};
use crate::app::results;
use crate::app::settings::Versus;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::SMALL;
use touch2touch_core::units;
use touch2touch_pipeline::compare::Comparison;
use touch2touch_pipeline::compare::subject::Subject;
use touch2touch_pipeline::steps::pose::PoseResult;

/// A column of the figures.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Figure {
    Psnr,
    Ssim,
    Angle,
}

impl Figure {
    const ALL: [Self; 3] = [Self::Psnr, Self::Ssim, Self::Angle];

    fn name(self) -> &'static str {
        match self {
            Self::Psnr => "PSNR dB",
            Self::Ssim => "SSIM",
            Self::Angle => "angle °",
        }
    }

    fn tip(self) -> &'static str {
        match self {
            Self::Psnr => "PSNR against the measurement (last row: A against B), as in the metrics",
            Self::Ssim => "Structural similarity with the measurement (last row: of A and B)",
            Self::Angle => {
                "Registered angle, with its error in brackets where the truth is known (last row: A minus B)"
            }
        }
    }

    fn text(self, comparison: Option<&Comparison>, angle: &str) -> String {
        let number = |v: Option<f64>, digits: usize| {
            v.filter(|v| v.is_finite()).map_or("–".to_owned(), |v| units::fixed(v, digits))
        };
        match self {
            Self::Psnr => number(comparison.and_then(|comparison| comparison.psnr_db), 1),
            Self::Ssim => number(comparison.and_then(|comparison| comparison.ssim), 3),
            Self::Angle => angle.to_owned(),
        }
    }
}

/// Height of a row, points.
const ROW: f32 = 14.0;
/// Width of the column of names, points.
const NAMES: f32 = 34.0;

pub(super) fn show(cx: &Cx<'_>, ui: &mut Ui, versus: &Versus) {
    let state = cx.state;
    let finger = state.selection.finger;
    let columns = Figure::ALL;
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), 4.0 * ROW), Sense::hover());
    let width = ((area.width() - NAMES) / columns.len() as f32).min(92.0);
    let painter = ui.painter_at(area);
    let font = FontId::proportional(SMALL);
    let row = |line: usize, name: &str, color: Color32, texts: Vec<String>, text_color: Color32| {
        let y = area.top() + (line as f32 + 0.5) * ROW;
        painter.text(pos2(area.left(), y), Align2::LEFT_CENTER, name, font.clone(), color);
        for (i, text) in texts.iter().enumerate() {
            let x = area.left() + NAMES + width * (i as f32 + 1.0);
            painter.text(pos2(x, y), Align2::RIGHT_CENTER, text, font.clone(), text_color);
        }
    };
    row(0, "", cx.p.weak, columns.iter().map(|column| column.name().to_owned()).collect(), cx.p.weak);
    let poses = [&versus.a, &versus.b].map(|subject| results::subject_pose(state, subject));
    for (line, letter) in [(1, Letter::A), (2, Letter::B)] {
        let subject = letter.of(versus);
        let against = (*subject != Subject::Measured)
            .then(|| results::subjects_compared(state, subject, &Subject::Measured, finger).ready())
            .flatten();
        let angle = poses[line - 1].map_or("–".into(), angle);
        let texts = columns.iter().map(|column| column.text(against, &angle)).collect();
        row(line, &format!("{letter:?}"), color(cx.p, versus, letter), texts, cx.p.text);
    }
    let apart = (versus.a != versus.b)
        .then(|| results::subjects_compared(state, &versus.a, &versus.b, finger).ready())
        .flatten();
    let turned = match poses {
        [Some(a), Some(b)] => format!("{:+.1}", units::wrap_angle(a.angle_rad - b.angle_rad).to_degrees()),
        _ => "–".into(),
    };
    row(3, "A minus B", cx.p.strong, columns.iter().map(|column| column.text(apart, &turned)).collect(), cx.p.strong);
    for (i, column) in columns.iter().enumerate() {
        let left = area.left() + NAMES + width * i as f32;
        let place = Rect::from_min_size(pos2(left, area.top()), vec2(width, area.height()));
        ui.interact(place, ui.scope_id().with(("figure", i)), Sense::hover()).on_hover_text(column.tip());
    }
}

fn angle(pose: &PoseResult) -> String {
    let angle = pose.angle_rad.to_degrees();
    match pose.error_rad {
        Some(error) => format!("{angle:.1} ({:.1})", error.to_degrees()),
        None => format!("{angle:.1}"),
    }
}
