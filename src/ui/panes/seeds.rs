//! Several seeds of one touch: a grid of them as they arrive, their mean, where they disagree, and the fan of the poses.

use eframe::egui::{
    self, Align2, Color32, FontId, Painter, Pos2, Rect, Role, ScrollArea, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::images::{absent_text, failed, map_of, range_of};
use crate::app::action::Action;
use crate::app::command::{Command, Pane, PredictCommand};
use crate::app::keys::{EnsembleKey, ImprintSource, PredictionKey};
use crate::app::results;
use crate::app::seeds::{COUNT, SeedsCommand};
use crate::app::state::Lookup;
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::theme::{SMALL, caption, section};
use crate::ui::parts::thumbnail;
use crate::ui::parts::widget::colorbar::gradient;
use touch2touch_core::colormap::{ColorMap, Range};
use touch2touch_core::ensemble::{AngleFan, Dial};
use touch2touch_core::grid::DepthMap;
use touch2touch_core::units;
use touch2touch_work::ensemble::Ensemble;
use touch2touch_work::pose::PoseResult;

/// Between pictures, points.
const GAP: f32 = 4.0;
/// Height of the bar below a map, with its numbers, points.
const BAR: f32 = 24.0;
/// Height of the dial, points.
const DIAL: f32 = 132.0;

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    let state = cx.state;
    let finger = state.selection.finger;
    let recipes = match results::seed_recipes(state, finger) {
        Ok(recipes) => recipes,
        Err(absent) => return absent_text(cx, ui, absent),
    };
    crate::ui::parts::theme::pane_frame(cx.p).show(ui, |ui| {
        ui.set_min_size(ui.available_size());
        ui.spacing_mut().item_spacing.y = GAP;
        let poses = results::seed_poses(state);
        controls(cx, ui, &recipes);
        ScrollArea::vertical().id_salt("seeds").show(ui, |ui| {
            grid(cx, ui, &recipes, &poses);
            match results::ensemble(state, finger) {
                Lookup::Failed(err) => failed(cx, ui, err),
                lookup => {
                    if let Some(ensemble) = lookup.shown() {
                        maps(cx, ui, &recipes, ensemble);
                    }
                }
            }
            fan(cx, ui, &poses);
        });
    });
}

fn controls(cx: &mut Cx<'_>, ui: &mut Ui, recipes: &[PredictionKey]) {
    let (count, every, running) = (cx.state.seeds.count, cx.state.seeds.every, results::seeds_running(cx.state));
    let there = recipes.iter().filter(|r| cx.state.results.predictions.contains(r)).count();
    ui.horizontal_wrapped(|ui| {
        let mut count = count;
        let drag = ui.add(egui::DragValue::new(&mut count).speed(0.1).range(COUNT).suffix(" seeds"));
        let drag = drag.accessible_name("Number of seeds");
        if drag
            .on_hover_text("How many predictions, with the seeds from the one under Generate on (default 8)")
            .changed()
        {
            cx.push(Command::Seeds(SeedsCommand::Count(count)));
        }
        let text = if running { "Stop" } else { "Run" };
        let run = ui.add(egui::Button::selectable(running, text)).accessible_name("Run the seeds");
        if run.on_hover_text(Action::RunSeeds.tooltip()).clicked() {
            cx.push(Command::Seeds(SeedsCommand::Run(!running)));
        }
        let mut every = every;
        let switch = ui.checkbox(&mut every, "every pair").accessible_name("Seeds for every pair");
        if switch.on_hover_text("Makes them for every pair that is shown, or only where Run is pressed").changed() {
            cx.push(Command::Seeds(SeedsCommand::EveryPair(every)));
        }
        let text = match running && there < recipes.len() {
            true => {
                format!("{there} of {}, seed {}…", recipes.len(), recipes[0].config.seed.wrapping_add(there as u64))
            }
            false => format!("{there} of {}", recipes.len()),
        };
        ui.label(caption(text, cx.p));
    });
}

/// The predictions, in the order of their seeds; a click shows one in the other panes.
fn grid(cx: &mut Cx<'_>, ui: &mut Ui, recipes: &[PredictionKey], poses: &[Option<&PoseResult>]) {
    let state = cx.state;
    let width = ui.available_width();
    let columns = if width < 420.0 { 4 } else { 8 }.min(recipes.len().max(1));
    let size = cell(width, columns);
    let (map, range) = (map_of(state), range_of(state));
    let rows = recipes.len().div_ceil(columns);
    let (area, _) = ui.allocate_exact_size(vec2(width, rows as f32 * (size.y + GAP)), Sense::hover());
    for (i, recipe) in recipes.iter().enumerate() {
        let offset = vec2((i % columns) as f32, (i / columns) as f32) * (size + vec2(GAP, GAP));
        let rect = Rect::from_min_size(area.min + offset, size);
        let response = ui.interact(rect, ui.scope_id().with(("seed", i)), Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, format!("Seed {}", recipe.config.seed)));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, cx.p.canvas);
        let angle = poses.get(i).copied().flatten().map(|pose| units::text_deg(pose.angle_rad));
        match results::seed_imprint(state, recipe) {
            Some(imprint) => {
                let shown = (recipe, state.settings.shift);
                thumbnail::depth(cx, &painter, rect, ("seed", i), shown, (imprint, map, range));
                shade(&painter, rect, Align2::LEFT_TOP, &recipe.config.seed.to_string());
                shade(&painter, rect, Align2::RIGHT_BOTTOM, angle.as_deref().unwrap_or(""));
                if results::chosen(state, recipe.touch.finger) == Some(recipe) {
                    painter.rect_stroke(rect, 2.0, Stroke::new(2.0, cx.p.accent), egui::StrokeKind::Inside);
                }
                if response
                    .on_hover_text(format!("Seed {}: click to show it in the other panes", recipe.config.seed))
                    .clicked()
                {
                    cx.push(PredictCommand::Choose(recipe.clone()));
                }
            }
            None => {
                let text = if results::seeds_running(state) { "…" } else { "–" };
                painter.text(rect.center(), Align2::CENTER_CENTER, text, FontId::proportional(SMALL), cx.p.weak);
            }
        }
    }
}

/// The size of a picture, of `columns` beside each other.
fn cell(width: f32, columns: usize) -> egui::Vec2 {
    let w = ((width - GAP * (columns as f32 - 1.0)) / columns as f32).max(16.0);
    vec2(w, w * 140.0 / 175.0)
}

/// Small text over a picture.
fn shade(painter: &Painter, rect: Rect, corner: Align2, text: &str) {
    if text.is_empty() {
        return;
    }
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(10.0), Color32::from_gray(235));
    let place = corner.align_size_within_rect(galley.size() + vec2(4.0, 0.0), rect.shrink(2.0));
    painter.rect_filled(place, 2.0, Color32::from_black_alpha(150));
    painter.galley(place.min + vec2(2.0, 0.0), galley, Color32::WHITE);
}

/// Mean, spread of the seeds, spread of the decoder's channels.
fn maps(cx: &mut Cx<'_>, ui: &mut Ui, recipes: &[PredictionKey], ensemble: &Ensemble) {
    let width = ui.available_width();
    let size = cell(width, 3);
    let (area, _) = ui.allocate_exact_size(vec2(width, 16.0 + size.y + BAR), Sense::hover());
    let of = |map: &DepthMap| {
        let most = Range::of(map.as_slice()).map_or(0.0, |r| r.hi).max(1e-5);
        Range { lo: 0.0, hi: most }
    };
    let Some(touch) = recipes.first().map(|recipe| recipe.touch) else { return };
    let key = EnsembleKey { touch, recipes: recipes.to_vec(), shift: cx.state.settings.shift };
    let spread = (ensemble.spread.count > 1).then_some(&ensemble.spread.std);
    let all = [
        ("Mean", Some(&ensemble.spread.mean), map_of(cx.state), Some(range_of(cx.state)), "No seed yet"),
        ("Seed spread", spread, ColorMap::Viridis, None, "needs 2 seeds"),
        ("Channel spread", ensemble.channels.as_ref(), ColorMap::Viridis, None, "one channel only"),
    ];
    for (i, (name, map, colors, range, without)) in all.into_iter().enumerate() {
        let left = area.left() + i as f32 * (size.x + GAP);
        let name_at = Rect::from_min_size(pos2(left, area.top()), vec2(size.x, 16.0));
        ui.painter_at(name_at).text(
            name_at.left_center(),
            Align2::LEFT_CENTER,
            name,
            FontId::proportional(10.0),
            cx.p.weak,
        );
        let rect = Rect::from_min_size(pos2(left, area.top() + 16.0), size);
        let response = ui.interact(rect, ui.scope_id().with(("map", i)), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, name));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, cx.p.canvas);
        let Some(map) = map else {
            painter.text(rect.center(), Align2::CENTER_CENTER, without, FontId::proportional(10.0), cx.p.weak);
            continue;
        };
        let range = range.unwrap_or_else(|| of(map));
        thumbnail::depth(cx, &painter, rect, ("ensemble", i), (&key, ensemble.spread.count), (map, colors, range));
        bar(cx, ui.painter(), pos2(left, rect.bottom() + 3.0), size.x, colors, range);
        thumbnail::readout(cx, &response, name, map);
    }
    let spread = &ensemble.spread;
    if spread.count > 1 {
        let text = format!(
            "Spread of {} seeds: mean {}, most {}",
            spread.count,
            units::text_mm(spread.mean_std()),
            units::text_mm(spread.max_std())
        );
        ui.label(caption(text, cx.p));
    }
}

/// Bar of the colors, with the millimeters that they mean.
fn bar(cx: &Cx<'_>, painter: &Painter, corner: Pos2, width: f32, colors: ColorMap, range: Range) {
    let rect = Rect::from_min_size(corner, vec2(width, 6.0));
    gradient(painter, rect, 24, |t| {
        let [r, g, b] = colors.rgb8(t);
        Color32::from_rgb(r, g, b)
    });
    let font = FontId::proportional(10.0);
    let number = |v: f32| units::fixed(units::mm(f64::from(v)), if range.hi < 0.01 { 2 } else { 1 });
    let y = rect.bottom() + 1.0;
    painter.text(pos2(rect.left(), y), Align2::LEFT_TOP, number(range.lo), font.clone(), cx.p.weak);
    painter.text(pos2(rect.right(), y), Align2::RIGHT_TOP, format!("{} mm", number(range.hi)), font, cx.p.weak);
}

/// The angles of the poses, drawn around their mean, and their figures.
fn fan(cx: &mut Cx<'_>, ui: &mut Ui, poses: &[Option<&PoseResult>]) {
    let state = cx.state;
    ui.label(section("Poses of the seeds", cx.p));
    if let Some(absent) = results::seed_pose_absent(state) {
        ui.label(caption(absent.text(), cx.p));
        return;
    }
    let angles: Vec<f64> = poses.iter().flatten().map(|pose| pose.angle_rad).collect();
    let Some(fan) = AngleFan::of(&angles) else {
        ui.label(caption("No pose yet: they come with the seeds.", cx.p));
        return;
    };
    let truth = poses.iter().flatten().find_map(|pose| pose.truth_rad);
    let measured = results::pose(state, ImprintSource::Measured).ready().map(|pose| pose.angle_rad);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), DIAL), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Fan of poses"));
    let others: Vec<f64> = truth.into_iter().chain(measured).collect();
    let Some(scale) = Dial::of(&fan, &others) else {
        ui.label(caption("The angles point in all directions: they have no mean.", cx.p));
        return;
    };
    let mean = scale.mean_rad;
    dial(cx, &ui.painter_at(rect), rect, &fan, scale, truth, measured);
    let deg = |v: f64| units::text_deg(v);
    let mut text = format!(
        "Mean {}, spread {}, farthest {} and +{}, of {}",
        deg(mean),
        deg(fan.std_rad),
        deg(fan.extremes_rad[0]),
        deg(fan.extremes_rad[1]),
        fan.angles_rad.len()
    );
    if let Some(error) = truth.and_then(|t| fan.error_rad(t)) {
        text += &format!("\nThe mean is {} off the truth", deg(error));
    }
    ui.label(caption(text, cx.p));
}

fn dial(
    cx: &Cx<'_>,
    painter: &Painter,
    rect: Rect,
    fan: &AngleFan,
    scale: Dial,
    truth: Option<f64>,
    measured: Option<f64>,
) {
    let (mean, reach) = (scale.mean_rad, scale.reach_rad);
    let pivot = pos2(rect.center().x, rect.bottom() - 6.0);
    let length = (rect.height() - 30.0).min(rect.width() * 0.5 - 20.0).max(10.0);
    let toward = |off: f64, share: f32| -> Pos2 {
        let lean = scale.lean(off);
        pivot + vec2(lean.sin() as f32, -lean.cos() as f32) * length * share
    };
    // The spread as a sector.
    let steps = 24;
    let arc = |share: f32, half: f64| -> Vec<Pos2> {
        (0..=steps).map(|i| toward(half * (2.0 * f64::from(i) / f64::from(steps) - 1.0), share)).collect()
    };
    if fan.std_rad > 0.0 && fan.std_rad.is_finite() {
        let mut sector = arc(0.96, fan.std_rad.min(reach));
        sector.push(pivot);
        let color = side_color(cx.p, ImprintSource::Predicted).gamma_multiply(0.16);
        painter.add(egui::Shape::convex_polygon(sector, color, Stroke::NONE));
    }
    painter.add(egui::Shape::line(arc(1.0, reach), Stroke::new(1.0, cx.p.line)));
    let font = FontId::proportional(10.0);
    for off in [-reach, -0.5 * reach, 0.0, 0.5 * reach, reach] {
        painter.line_segment([toward(off, 0.97), toward(off, 1.03)], Stroke::new(1.0, cx.p.weak));
        painter.text(toward(off, 1.12), Align2::CENTER_CENTER, units::text_deg(mean + off), font.clone(), cx.p.weak);
    }
    let line = |angle: f64, width: f32, color: Color32| {
        painter.line_segment([pivot, toward(scale.off(angle), 0.96)], Stroke::new(width, color));
    };
    let seeds = side_color(cx.p, ImprintSource::Predicted);
    for angle in &fan.angles_rad {
        line(*angle, 1.0, seeds.gamma_multiply(0.7));
    }
    line(mean, 2.5, seeds);
    let mut legend = vec![("seeds, mean", seeds)];
    if let Some(angle) = measured {
        line(angle, 1.5, side_color(cx.p, ImprintSource::Measured));
        legend.push(("measured", side_color(cx.p, ImprintSource::Measured)));
    }
    if let Some(angle) = truth {
        line(angle, 1.5, cx.p.good);
        legend.push(("truth", cx.p.good));
    }
    for (i, (name, color)) in legend.into_iter().enumerate() {
        let y = rect.bottom() - 8.0 - 12.0 * i as f32;
        painter.text(pos2(rect.left() + 2.0, y), Align2::LEFT_CENTER, name, font.clone(), color);
    }
}
