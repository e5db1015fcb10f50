//! The pane that holds any two imprints of a touch against each other.

use eframe::egui::{self, Align2, Color32, ComboBox, Rect, RichText, Ui, UiBuilder, pos2, vec2};
use strum::IntoEnumIterator as _;

use super::images::{ON_IMAGE, bar, canvas, finger_text, hover, paint_depth, placeholder, scale_note, window};
use crate::app::keys::ComparisonKey;
use crate::app::pane::Pane;
use crate::app::results;
use crate::app::settings::{CompareChoice, CompareMode, prefer};
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, SMALL};
use crate::ui::parts::widget::choice::choose;
use crate::ui::parts::widget::colorbar;
use crate::ui::parts::widget::image_canvas::{CanvasOutput, Primary, shows_squares};
use crate::ui::parts::widget::line::Line;
use crate::ui::parts::widget::texture::{Histogram, depth_image};
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::rig::{PadId, SensorKind};
use touch2touch_core::units;
use touch2touch_pipeline::compare::Comparison;
use touch2touch_pipeline::compare::subject::{RecipeChange, Subject};
use touch2touch_pipeline::steps::bundles::BundleInfo;
use touch2touch_pipeline::steps::pose::PoseResult;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// One of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Letter {
    A,
    B,
}

impl Letter {
    fn of(self, chosen: &CompareChoice) -> &Subject {
        match self {
            Self::A => &chosen.a,
            Self::B => &chosen.b,
        }
    }
}

/// The color of one of the two: that of its side where it has one, and never that of the other.
fn color(p: &Palette, chosen: &CompareChoice, letter: Letter) -> Color32 {
    let (own, other) = match letter {
        Letter::A => (&chosen.a, &chosen.b),
        Letter::B => (&chosen.b, &chosen.a),
    };
    match (own, letter) {
        (Subject::Measured, _) if *other != Subject::Measured || letter == Letter::A => p.truth,
        (_, Letter::A) => p.prediction,
        _ if *other == Subject::Measured => p.prediction,
        _ => p.second,
    }
}

/// True while the key is held that shows B in the place of A.
fn flickers(ui: &Ui) -> bool {
    let held = ui.input(|i| i.key_down(egui::Key::F) && i.modifiers.is_none());
    held && !ui.ctx().egui_wants_keyboard_input()
}

pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    let chosen = cx.state.settings.compared();
    egui::Frame::new().inner_margin(egui::Margin::symmetric(6, 3)).show(ui, |ui| {
        header(cx, ui, &chosen);
        // The error's figures stand in the metrics, and in its corner.
        if !chosen.is_error() {
            figures(cx, ui, &chosen);
        }
    });
    let flipped = flickers(ui);
    let full = ui.available_rect_before_wrap();
    ui.advance_cursor_after_rect(full);
    let area = full.with_max_y((full.bottom() - colorbar::HEIGHT).max(full.top() + 16.0));
    let shown = cx.state.fingers();
    let fingers: Vec<PadId> = cx.state.rig().pads().filter(|f| shown.contains(f)).collect();
    let height = area.height() / fingers.len().max(1) as f32;
    let mut histogram = None;
    for (i, finger) in fingers.iter().enumerate() {
        let rect = Rect::from_min_size(area.min + vec2(0.0, height * i as f32), vec2(area.width(), height - 1.0));
        let parts = match chosen.mode {
            CompareMode::Side => {
                let half = vec2((rect.width() * 0.5 - 0.5).max(8.0), rect.height());
                let right = Rect::from_min_size(pos2(rect.right() - half.x, rect.top()), half);
                vec![(Letter::A, Rect::from_min_size(rect.min, half)), (Letter::B, right)]
            }
            CompareMode::Difference => vec![(Letter::A, rect)],
        };
        for (letter, rect) in parts {
            let mut child = ui.new_child(UiBuilder::new().max_rect(rect).id_salt(("compared", *finger, letter)));
            child.set_clip_rect(rect.intersect(ui.clip_rect()));
            let drawn = match chosen.mode {
                CompareMode::Difference => difference(cx, &mut child, &chosen, *finger),
                CompareMode::Side => {
                    let letter = if flipped { Letter::B } else { letter };
                    picture(cx, &mut child, &chosen, letter, *finger)
                }
            };
            histogram = drawn.or(histogram);
        }
    }
    let rect = Rect::from_min_max(pos2(full.left(), area.bottom()), full.max);
    ui.painter().rect_filled(rect, 0.0, cx.p.panel);
    let mut child = ui.new_child(UiBuilder::new().max_rect(rect.shrink2(vec2(6.0, 0.0))).id_salt("compared bar"));
    match chosen.mode {
        CompareMode::Difference => bar::error_bar(cx, &mut child, histogram.as_ref()),
        CompareMode::Side => bar::color_bar(cx, &mut child, histogram.as_ref()),
    }
}

/// Choice of what is compared, and how.
fn header(cx: &mut Cx<'_>, ui: &mut Ui, chosen: &CompareChoice) {
    ui.spacing_mut().item_spacing = vec2(3.0, 3.0);
    ui.spacing_mut().button_padding = vec2(4.0, 1.0);
    ui.style_mut().override_font_id = Some(egui::FontId::proportional(SMALL));
    let width = ui.available_width();
    ui.horizontal_wrapped(|ui| {
        for letter in [Letter::A, Letter::B] {
            if let Some(subject) = list(cx, ui, chosen, letter, (width - MODE - 34.0) / 2.0) {
                cx.push(match letter {
                    Letter::A => prefer(move |s| s.compare_mut().a = subject.clone()),
                    Letter::B => prefer(move |s| s.compare_mut().b = subject.clone()),
                });
            }
        }
        modes(cx, ui, chosen);
    });
}

/// Width of the choice of the way, points.
const MODE: f32 = 64.0;

/// Choice of the way, with the keys that stand for the rest.
fn modes(cx: &mut Cx<'_>, ui: &mut Ui, chosen: &CompareChoice) {
    let combo = egui::ComboBox::from_id_salt("compared by").width(MODE).selected_text(chosen.mode.name());
    let tip = format!("{} (hold F: B in the place of A)", chosen.mode.tooltip());
    let said = |mode: &CompareMode| (mode.name(), mode.tooltip());
    if let Some(mode) = choose(ui, combo, ("Comparison", &tip), Some(&chosen.mode), CompareMode::iter(), said) {
        cx.push(prefer(move |s| s.compare_mut().mode = mode));
    }
}

/// The picture of one of the two.
fn picture(cx: &mut Cx<'_>, ui: &mut Ui, chosen: &CompareChoice, letter: Letter, finger: PadId) -> Option<Histogram> {
    let subject = letter.of(chosen);
    let lookup = results::subject(cx.state, subject, finger);
    let Some(depth) = lookup.shown() else {
        placeholder(cx, ui, (Pane::Compare, finger), lookup, [4, 3]);
        return None;
    };
    let label = format!("Compare {letter:?} {}", cx.state.finger_name(finger));
    let output = canvas(cx, ui, SensorKind::Depth, &label, depth.size(), Primary::Pan);
    let recipe = results::subject_key(cx.state, subject, finger).ok()?;
    let slot = ("compared", letter, finger);
    let histogram = paint_depth(cx, ui, &output, (slot, &recipe), depth, Color32::WHITE);
    over(cx, &output, chosen, finger);
    let strong = color(cx.p, chosen, letter);
    output.caption(Align2::LEFT_TOP, &format!("{letter:?}  {}", subject.label()), strong);
    output.caption(Align2::LEFT_BOTTOM, &finger_text(cx.state, finger), ON_IMAGE);
    output.caption(Align2::RIGHT_BOTTOM, scale_note(cx.state), crate::ui::parts::theme::DARK.caution);
    histogram
}

/// A minus B.
fn difference(cx: &mut Cx<'_>, ui: &mut Ui, chosen: &CompareChoice, finger: PadId) -> Option<Histogram> {
    for subject in [&chosen.a, &chosen.b] {
        let lookup = results::subject(cx.state, subject, finger);
        if lookup.shown().is_none() {
            placeholder(cx, ui, (Pane::Compare, finger), lookup, [4, 3]);
            return None;
        }
    }
    let lookup = results::subjects_compared(cx.state, &chosen.a, &chosen.b, finger);
    let Some(compared) = lookup.shown() else {
        placeholder(cx, ui, (Pane::Compare, finger), lookup, [4, 3]);
        return None;
    };
    let label = format!("A minus B {}", cx.state.finger_name(finger));
    let output = canvas(cx, ui, SensorKind::Depth, &label, compared.error.size(), Primary::Pan);
    let squares = shows_squares(&output.map, ui.pixels_per_point());
    let keys = [&chosen.a, &chosen.b].map(|subject| results::subject_key(cx.state, subject, finger));
    let [Ok(a), Ok(b)] = keys else { return None };
    let range = Range::symmetric(cx.shared.views.error_mm * 1e-3);
    let key = (ComparisonKey { a, b }, range.hi.to_bits());
    let picture = cx.shared.textures.get(ui.ctx(), ("compared difference", finger), key, squares, || {
        (depth_image(&compared.error, ColorMap::Diverging, range), Histogram::of(compared.error.as_slice()))
    });
    output.paint(picture.texture.id(), Color32::WHITE);
    let histogram = picture.histogram.clone();
    over(cx, &output, chosen, finger);
    output.caption(Align2::LEFT_TOP, &format!("{} minus {}", chosen.a.label(), chosen.b.label()), ON_IMAGE);
    output.caption(Align2::LEFT_BOTTOM, &finger_text(cx.state, finger), ON_IMAGE);
    output.caption(Align2::RIGHT_BOTTOM, scale_note(cx.state), crate::ui::parts::theme::DARK.caution);
    histogram
}

/// Overlay of every picture: GelSlim's window, cross-hair, the values under the pointer.
fn over(cx: &mut Cx<'_>, output: &CanvasOutput, chosen: &CompareChoice, finger: PadId) {
    window(cx, output, finger);
    if let Some(px) = output.hovered {
        readout(cx, output, chosen, finger, px);
        hover(cx, finger, px);
    }
    if let Some(point) = cx.state.selection.hover.filter(|h| h.finger == finger) {
        output.crosshair(point.at_px, Color32::WHITE);
    }
}

/// The values of both under the pointer.
fn readout(cx: &mut Cx<'_>, output: &CanvasOutput, chosen: &CompareChoice, finger: PadId, px: [f32; 2]) {
    let Some((x, y)) = output.map.pixel(px) else { return };
    let value = |subject: &Subject| {
        let depth = results::subject(cx.state, subject, finger).shown()?;
        depth.get(x, y).copied().filter(|v| v.is_finite()).map(f64::from)
    };
    let (a, b) = (value(&chosen.a), value(&chosen.b));
    let text = |v: Option<f64>| v.map_or("–".to_owned(), units::text_mm);
    let difference = a.zip(b).map(|(a, b)| a - b);
    let note = scale_note(cx.state);
    let note = if note.is_empty() { String::new() } else { format!("   ({note})") };
    cx.shared.readout = Some(format!(
        "Compare {} ({x}, {y})   A {}   B {}   A minus B {}{note}",
        cx.state.finger_name(finger),
        text(a),
        text(b),
        text(difference)
    ));
}

/// Seeds of the mean.
const SEEDS: usize = 8;

/// The list of one of the two, `width` points wide; what was chosen.
fn list(cx: &Cx<'_>, ui: &mut Ui, compared: &CompareChoice, letter: Letter, width: f32) -> Option<Subject> {
    let subject = letter.of(compared);
    let label = subject.label();
    let text = RichText::new(format!("{letter:?}  {label}")).color(color(cx.p, compared, letter));
    let combo = ComboBox::from_id_salt(("compared", letter)).width(width.max(48.0)).selected_text(text).truncate();
    let (rows, tip) = (rows(cx), format!("{label}. Click to choose another; each workspace remembers its own"));
    let now = rows.iter().find(|(value, ..)| value == subject);
    let name = format!("{letter:?}: {label}");
    let chosen = choose(ui, combo, (&name, &tip), now.as_ref(), &rows, |row| (row.1.as_str(), row.2));
    chosen.map(|(value, ..)| value.clone())
}

/// Choices for a side: the measurement, the prediction on screen, that of each other model.
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

/// Four lines of three columns.
fn figures(cx: &Cx<'_>, ui: &mut Ui, compared: &CompareChoice) {
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
