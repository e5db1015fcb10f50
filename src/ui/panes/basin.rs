//! The basin map: where starts lead. A click loads that run into the time machine.

use eframe::egui::{
    self, Align2, Color32, ComboBox, FontId, Mesh, Painter, Pos2, Rect, Response, RichText, Role, Sense, Shape, Stroke,
    Ui, UiBuilder, WidgetInfo, pos2, vec2,
};
use strum::IntoEnumIterator as _;

use super::images;
use super::timemachine::pose_text;
use crate::app::action::Action;
use crate::app::command::{Command, Pane};
use crate::app::inspect::{BasinColor, InspectCommand};
use crate::app::keys::PoseBits;
use crate::app::results;
use crate::app::state::Lookup;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, SMALL, caption, mix, pane_frame};
use crate::ui::parts::widget::colorbar::gradient;
use crate::ui::parts::widget::empty;
use touch2touch_core::align::basin::{Arrival, Axis, Basin, Cell, Plane};
use touch2touch_core::colormap::ColorMap;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::units;

/// Room for the numbers at the left and below, points.
const MARGIN: egui::Vec2 = vec2(30.0, 28.0);
/// Height of the color bar with its numbers, points.
const BAR: f32 = 30.0;
/// Height of the lines of figures, points.
const FIGURES: f32 = 58.0;
/// The error of the last color, degrees.
const MOST_DEG: f64 = 20.0;
/// Every how many columns and rows an arrow is drawn.
const ARROWS: usize = 3;
/// Colors of the ends, cheapest first; apart for color-blind eyes, and none of them a side's.
const ENDS: [Color32; 4] = [
    Color32::from_rgb(0x00, 0x9e, 0x73),
    Color32::from_rgb(0xcc, 0x79, 0xa7),
    Color32::from_rgb(0xf0, 0xe4, 0x42),
    Color32::from_rgb(0x9a, 0x6b, 0x3f),
];

/// Nothing is kept between frames.
pub(crate) type Memory = ();

/// The pane.
pub(crate) fn show(cx: &mut Cx<'_>, ui: &mut Ui, (): &mut Memory, _: Pane) {
    pane_frame(cx.p).show(ui, |ui| {
        let full = ui.available_rect_before_wrap();
        ui.set_min_size(full.size());
        ui.spacing_mut().item_spacing = vec2(4.0, 3.0);
        controls(cx, ui);
        let rest = ui.available_rect_before_wrap();
        let lookup = results::basin(cx.state);
        match (lookup, lookup.shown()) {
            (Lookup::Failed(err), _) => {
                let (what, why) = match err.is_cancelled() {
                    true => ("Given up", String::new()),
                    false => ("No map", err.why.clone()),
                };
                let action = (Action::RunPose.name(), Action::RunPose.tooltip());
                if empty::show(ui, what, &why, Some(action)) {
                    cx.act(Action::RunPose);
                }
            }
            (Lookup::Absent(absent), _) => images::absent_text(cx, ui, absent),
            (_, None) => {
                let action = (Action::CancelJobs.name(), Action::CancelJobs.tooltip());
                if empty::show(ui, "Trying 651 starts…", "", Some(action)) {
                    cx.push(Command::Inspect(InspectCommand::StopBasin));
                }
            }
            (lookup, Some(basin)) => {
                body(cx, ui, rest, basin);
                if matches!(lookup, Lookup::Stale(_)) {
                    ui.painter().rect_filled(rest, 0.0, cx.p.panel.gamma_multiply(0.5));
                }
            }
        }
    });
}

/// Choice of the coordinates that are varied and of the colors.
fn controls(cx: &mut Cx<'_>, ui: &mut Ui) {
    let inspect = cx.state.inspect.clone();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let planes = [(Plane::AngleY, "angle × y"), (Plane::AngleZ, "angle × z"), (Plane::YZ, "y × z")];
        let now = planes.iter().find(|(plane, _)| *plane == inspect.plane).map_or("", |(_, name)| name);
        let combo = ComboBox::from_id_salt("plane").width(84.0).selected_text(RichText::new(now).size(12.0));
        let response = combo.show_ui(ui, |ui| {
            for (plane, name) in planes {
                if ui.selectable_label(inspect.plane == plane, name).clicked() {
                    cx.push(Command::Inspect(InspectCommand::Plane(plane)));
                }
            }
        });
        let tip = "What of the start is varied; the third coordinate stays 0, the middle of what the gripper can hold";
        response.response.accessible_name("Varied coordinates").on_hover_text(tip);
        ui.label(caption("colored by", cx.p));
        let name = RichText::new(inspect.color.name().to_lowercase()).size(12.0);
        let combo = ComboBox::from_id_salt("basin color").width(84.0).selected_text(name);
        let response = combo.show_ui(ui, |ui| {
            for color in BasinColor::iter() {
                let possible = color != BasinColor::Error || results::truth(cx.state).is_some();
                let name = color.name().to_lowercase();
                let option = ui.add_enabled(possible, egui::Button::selectable(inspect.color == color, name));
                let tip = match color {
                    BasinColor::Cost => "Root of the cost per point where the run ended",
                    BasinColor::Error => "Angle between where the run ended and the truth",
                    BasinColor::Winner => "Which place the run ended at: ends within 1° and 1 mm are one place",
                };
                let option =
                    option.on_hover_text(tip).on_disabled_hover_text("The true pose of this pair is not known");
                if option.clicked() {
                    cx.push(Command::Inspect(InspectCommand::Color(color)));
                }
            }
        });
        response.response.accessible_name("Colors of the map").on_hover_text("What the colors of the map mean");
    });
}

/// The grid on the screen.
struct Map<'a> {
    basin: &'a Basin,
    rect: Rect,
    axes: [Axis; 2],
}

impl Map<'_> {
    /// Width and height of a cell.
    fn cell_size(&self) -> egui::Vec2 {
        let [columns, rows] = self.basin.config.size;
        vec2(self.rect.width() / columns as f32, self.rect.height() / rows as f32)
    }

    /// Place of values of the two axes (radians, meters): the first and last start are centers of cells.
    fn place(&self, values: [f64; 2]) -> Pos2 {
        let inner = self.rect.shrink2(self.cell_size() * 0.5);
        let share: [f32; 2] = std::array::from_fn(|i| {
            ((values[i] / self.basin.config.reach(self.axes[i]) + 1.0) * 0.5).clamp(-3.0, 4.0) as f32
        });
        pos2(inner.left() + share[0] * inner.width(), inner.bottom() - share[1] * inner.height())
    }

    fn place_of(&self, pose: PlanarPose) -> Pos2 {
        self.place(self.axes.map(|axis| axis.of(pose)))
    }

    /// The values at a place.
    fn values(&self, place: Pos2) -> [f64; 2] {
        let inner = self.rect.shrink2(self.cell_size() * 0.5);
        let share = [(place.x - inner.left()) / inner.width(), (inner.bottom() - place.y) / inner.height()];
        std::array::from_fn(|i| (2.0 * f64::from(share[i]) - 1.0) * self.basin.config.reach(self.axes[i]))
    }
}

fn body(cx: &mut Cx<'_>, ui: &mut Ui, rest: Rect, basin: &Basin) {
    let bottom = rest.bottom() - FIGURES - BAR;
    let area = Rect::from_min_max(rest.min, pos2(rest.right(), bottom));
    // Cells need not be square, but a tall pane does not stretch them into stripes.
    let size = vec2(area.width() - MARGIN.x - 2.0, (area.height() - MARGIN.y).min(1.25 * (area.width() - MARGIN.x)));
    if size.x < 60.0 || size.y < 40.0 {
        ui.label(caption("Make this pane larger to see the map.", cx.p));
        return;
    }
    let map = Map {
        basin,
        rect: Rect::from_min_size(pos2(area.left() + MARGIN.x, area.top() + 2.0), size),
        axes: basin.config.plane.axes(),
    };
    let response = ui.interact(map.rect, ui.scope_id().with("map"), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Map of starts"));
    let painter = ui.painter_at(map.rect.expand2(vec2(0.0, 1.0)));
    let scale = Scale::of(cx, basin);
    cells(cx.p, &painter, &map, &scale);
    axes(cx.p, ui.painter(), &map);
    let hovered = response.hover_pos().and_then(|pos| basin.nearest_cell(map.values(pos)));
    marks(cx, &painter, &map, hovered);
    let bar = Rect::from_min_size(pos2(map.rect.left(), map.rect.bottom() + MARGIN.y), vec2(size.x, BAR));
    scale.show(cx.p, ui.painter(), bar);
    let below = Rect::from_min_max(pos2(rest.left(), bar.bottom()), rest.max);
    ui.scope_builder(UiBuilder::new().max_rect(below), |ui| {
        ui.set_clip_rect(below.intersect(ui.clip_rect()));
        ui.spacing_mut().item_spacing.y = 1.0;
        figures(cx, ui, basin, hovered);
    });
    click(cx, &response, hovered);
}

fn click(cx: &mut Cx<'_>, response: &Response, hovered: Option<&Cell>) {
    if response.clicked()
        && let Some(cell) = hovered
    {
        cx.push(Command::Inspect(InspectCommand::Start(Some(cell.requested))));
    }
}

/// From an arrival to a color.
struct Scale {
    color: BasinColor,
    /// Of the values, millimeters or degrees.
    range: [f64; 2],
    truth: Option<PlanarPose>,
    ends: usize,
}

impl Scale {
    fn of(cx: &Cx<'_>, basin: &Basin) -> Self {
        let truth = results::truth(cx.state);
        let color = match cx.state.inspect.color {
            BasinColor::Error if truth.is_none() => BasinColor::Cost,
            color => color,
        };
        let mut scale = Self { color, range: [0.0, MOST_DEG], truth, ends: basin.basins.len() };
        if color == BasinColor::Cost {
            let values = basin.cells.iter().filter_map(|c| scale.value(c.arrival.as_ref()?));
            let [lo, hi] = values.fold([f64::INFINITY, 0.0], |[lo, hi]: [f64; 2], v| [lo.min(v), hi.max(v)]);
            // Ends that differ by less than a twentieth are the same place: rounding must not look like a landscape.
            scale.range = if lo < hi { [lo, hi.max(1.05 * lo)] } else { [0.0, hi.max(1e-6)] };
        }
        scale
    }

    /// Millimeters or degrees.
    fn value(&self, arrival: &Arrival) -> Option<f64> {
        match self.color {
            BasinColor::Cost => Some(units::mm(arrival.cost_m2.max(0.0).sqrt())).filter(|v| v.is_finite()),
            BasinColor::Error => Some(units::angle_error(arrival.end.theta_rad, self.truth?.theta_rad).to_degrees()),
            BasinColor::Winner => None,
        }
    }

    fn color(&self, p: &Palette, arrival: &Arrival) -> Color32 {
        if self.color == BasinColor::Winner {
            return end_color(p, arrival.basin);
        }
        let [lo, hi] = self.range;
        let share = self.value(arrival).map_or(f32::NAN, |v| ((v - lo) / (hi - lo)) as f32);
        let [r, g, b] = ColorMap::Viridis.rgb8(share);
        Color32::from_rgb(r, g, b)
    }

    /// The bar with its numbers and unit.
    fn show(&self, p: &Palette, painter: &Painter, rect: Rect) {
        let font = FontId::proportional(10.0);
        let bar = Rect::from_min_size(rect.min + vec2(0.0, 2.0), vec2(rect.width(), 8.0));
        let y = bar.bottom() + 2.0;
        if self.color == BasinColor::Winner {
            let shown = self.ends.min(ENDS.len() + 1);
            let width = bar.width() / shown.max(1) as f32;
            for i in 0..shown {
                let swatch = Rect::from_min_size(pos2(bar.left() + width * i as f32, bar.top()), vec2(width, 8.0));
                painter.rect_filled(swatch.shrink2(vec2(1.0, 0.0)), 1.0, end_color(p, i));
                let name = match i {
                    0 => "cheapest".to_owned(),
                    i if i < ENDS.len() => format!("{}.", i + 1),
                    _ => "others".into(),
                };
                painter.text(pos2(swatch.center().x, y), Align2::CENTER_TOP, name, font.clone(), p.weak);
            }
            return;
        }
        gradient(painter, bar, 32, |t| {
            let [r, g, b] = ColorMap::Viridis.rgb8(t);
            Color32::from_rgb(r, g, b)
        });
        let (decimals, what, more) = match self.color {
            BasinColor::Error => (0, "angle error at the end, °", "+"),
            _ => (2, "√cost at the end, mm", ""),
        };
        let [lo, hi] = self.range;
        painter.text(pos2(bar.left(), y), Align2::LEFT_TOP, format!("{lo:.decimals$}"), font.clone(), p.weak);
        painter.text(pos2(bar.right(), y), Align2::RIGHT_TOP, format!("{hi:.decimals$}{more}"), font.clone(), p.weak);
        painter.text(pos2(bar.center().x, y), Align2::CENTER_TOP, what, font, p.weak);
    }
}

fn end_color(p: &Palette, basin: usize) -> Color32 {
    ENDS.get(basin).copied().unwrap_or_else(|| mix(p.canvas, p.weak, 0.5))
}

fn cells(p: &Palette, painter: &Painter, map: &Map<'_>, scale: &Scale) {
    let [columns, rows] = map.basin.config.size;
    let size = map.cell_size();
    painter.rect_filled(map.rect, 0.0, p.canvas);
    let mut mesh = Mesh::default();
    for row in 0..rows {
        for column in 0..columns {
            let Some(cell) = map.basin.cell(column, row) else { continue };
            let min = pos2(map.rect.left() + size.x * column as f32, map.rect.bottom() - size.y * (row + 1) as f32);
            let rect = Rect::from_min_size(min, size);
            match &cell.arrival {
                Some(arrival) => mesh.add_colored_rect(rect, scale.color(p, arrival)),
                None => {
                    let stroke = Stroke::new(1.0, p.weak.gamma_multiply(0.5));
                    painter.line_segment([rect.left_bottom(), rect.right_top()], stroke);
                }
            }
        }
    }
    painter.add(Shape::mesh(mesh));
}

fn axes(p: &Palette, painter: &Painter, map: &Map<'_>) {
    let font = FontId::proportional(10.0);
    let shown = |axis: Axis, value: f64| match axis {
        Axis::Angle => value.to_degrees(),
        _ => units::mm(value),
    };
    let tick = |v: f64| units::fixed(v, usize::from((v - v.round()).abs() > 0.01));
    let name = |axis: Axis| match axis {
        Axis::Angle => "angle of the start, °",
        Axis::Y => "y of the start, mm",
        Axis::Z => "z of the start, mm",
    };
    let [across, up] = map.axes;
    for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
        let (x, y) = (share * map.basin.config.reach(across), share * map.basin.config.reach(up));
        let below = pos2(map.place([x, 0.0]).x, map.rect.bottom() + 2.0);
        painter.text(below, Align2::CENTER_TOP, tick(shown(across, x)), font.clone(), p.weak);
        let left = pos2(map.rect.left() - 4.0, map.place([0.0, y]).y);
        painter.text(left, Align2::RIGHT_CENTER, tick(shown(up, y)), font.clone(), p.weak);
    }
    let below = pos2(map.rect.center().x, map.rect.bottom() + 14.0);
    painter.text(below, Align2::CENTER_TOP, name(across), font.clone(), p.weak);
    let galley = painter.layout_no_wrap(name(up).to_owned(), font, p.weak);
    let corner = pos2(map.rect.left() - MARGIN.x - 1.0, map.rect.center().y + galley.size().x * 0.5);
    let turned = egui::epaint::TextShape::new(corner, galley, p.weak).with_angle(-std::f32::consts::FRAC_PI_2);
    painter.add(turned);
}

/// Arrows, the prior, ends, the registration's own starts, the truth, the step shown, the cell under the pointer.
fn marks(cx: &Cx<'_>, painter: &Painter, map: &Map<'_>, hovered: Option<&Cell>) {
    let dark = Color32::from_black_alpha(150);
    let [columns, rows] = map.basin.config.size;
    for row in (ARROWS / 2..rows).step_by(ARROWS) {
        for column in (ARROWS / 2..columns).step_by(ARROWS) {
            if let Some(Cell { requested, arrival: Some(a), .. }) = map.basin.cell(column, row) {
                let (from, to) = (map.place_of(*requested), map.place_of(a.end));
                painter.arrow(from, to - from, Stroke::new(0.7, Color32::from_white_alpha(90)));
            }
        }
    }
    let prior = map.basin.config.prior;
    let reach = map.axes.map(|axis| if axis == Axis::Angle { prior.theta_rad } else { prior.shift_m });
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let corners = corners.map(|[a, b]: [f64; 2]| map.place([a * reach[0], b * reach[1]]));
    painter.add(Shape::dashed_line(&corners, Stroke::new(1.0, Color32::from_white_alpha(190)), 4.0, 3.0));
    for end in map.basin.basins.iter().take(ENDS.len()).rev() {
        let share = end.starts as f32 / map.basin.cells.len().max(1) as f32;
        painter.circle(map.place_of(end.end), 2.5 + 3.0 * share, Color32::WHITE, Stroke::new(1.5, dark));
    }
    if let Some(pose) = results::pose(cx.state, cx.state.inspect.source).shown() {
        for run in &pose.report.runs {
            let (from, to) = (map.place_of(run.start), map.place_of(run.end));
            painter.line_segment([from, to], Stroke::new(2.5, dark));
            painter.line_segment([from, to], Stroke::new(1.2, cx.p.accent));
            painter.rect(
                Rect::from_center_size(from, vec2(7.0, 7.0)),
                0.0,
                cx.p.accent,
                Stroke::new(1.5, dark),
                egui::StrokeKind::Outside,
            );
        }
    }
    if let Some(truth) = results::truth(cx.state) {
        cross(painter, map.place_of(truth), 6.0, cx.p.truth);
    }
    if let Some(shown) = results::inspected_in(cx.state, cx.state.inspect.source) {
        let place = map.place_of(shown.step.grasp_from_object);
        painter.circle_stroke(place, 6.0, Stroke::new(3.5, dark));
        painter.circle_stroke(place, 6.0, Stroke::new(2.0, cx.p.accent));
    }
    if let Some(cell) = hovered {
        outline(painter, map, cell, Color32::WHITE);
        if let Some(a) = &cell.arrival {
            let (from, to) = (map.place_of(a.applied), map.place_of(a.end));
            painter.arrow(from, to - from, Stroke::new(3.5, dark));
            painter.arrow(from, to - from, Stroke::new(1.5, Color32::WHITE));
        }
    }
    if let Some(start) = cx.state.inspect.start.map(PoseBits::get) {
        let cell = map.basin.cells.iter().find(|c| c.requested == start);
        if let Some(cell) = cell {
            outline(painter, map, cell, cx.p.accent);
        }
    }
}

fn outline(painter: &Painter, map: &Map<'_>, cell: &Cell, color: Color32) {
    let rect = Rect::from_center_size(map.place_of(cell.requested), map.cell_size());
    painter.rect_stroke(rect, 0.0, Stroke::new(1.5, color), egui::StrokeKind::Outside);
}

fn cross(painter: &Painter, center: Pos2, size: f32, color: Color32) {
    for (width, color) in [(4.0, Color32::from_black_alpha(150)), (2.0, color)] {
        for d in [vec2(size, size), vec2(size, -size)] {
            painter.line_segment([center - d, center + d], Stroke::new(width, color));
        }
    }
}

/// Figures of the start under the pointer, else of the map as a whole.
fn figures(cx: &Cx<'_>, ui: &mut Ui, basin: &Basin, hovered: Option<&Cell>) {
    let line = |ui: &mut Ui, text: String, color: Color32| {
        ui.add(egui::Label::new(RichText::new(text).size(SMALL).color(color)).truncate());
    };
    let p = cx.p;
    if let Some(cell) = hovered {
        line(ui, format!("asked {}", pose_text(cell.requested)), p.strong);
        match &cell.arrival {
            Some(a) => {
                line(ui, format!("began {}", pose_text(a.applied)), p.text);
                line(ui, format!("ended {}", pose_text(a.end)), p.text);
                let error = results::truth(cx.state).map_or(String::new(), |t| {
                    format!(", error {}", units::text_deg(units::angle_error(a.end.theta_rad, t.theta_rad)))
                });
                let cost = units::mm(a.cost_m2.max(0.0).sqrt());
                line(ui, format!("√cost {cost:.2} mm{error}; {} steps, {}", a.iterations, a.stop), p.weak);
            }
            None => line(ui, cell.failure.clone().unwrap_or_default(), p.wrong),
        }
        return;
    }
    let share = basin.winning_share() * 100.0;
    line(ui, format!("{share:.0} % of {} starts end at the cheapest place", basin.cells.len()), p.strong);
    let places = basin.basins.len();
    line(
        ui,
        format!("{places} place{} in all · click a cell to watch its run", if places == 1 { "" } else { "s" }),
        p.text,
    );
    if basin.points < basin.offered {
        line(ui, format!("each by {} points, evenly chosen", basin.points), p.weak);
    }
    legend(cx, ui);
}

/// Legend of the marks.
fn legend(cx: &Cx<'_>, ui: &mut Ui) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 14.0), Sense::hover());
    let painter = ui.painter_at(rect);
    let mut x = rect.left() + 5.0;
    let y = rect.center().y;
    let mut entry = |text: &str, mark: &dyn Fn(Pos2)| {
        mark(pos2(x, y));
        let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(10.0), cx.p.weak);
        let width = galley.size().x;
        painter.galley(pos2(x + 8.0, y - galley.size().y * 0.5), galley, cx.p.weak);
        x += width + 20.0;
    };
    entry("own starts", &|center| {
        painter.rect_filled(Rect::from_center_size(center, vec2(7.0, 7.0)), 0.0, cx.p.accent);
    });
    entry("ends", &|center| {
        painter.circle_filled(center, 3.5, cx.p.strong);
    });
    if results::truth(cx.state).is_some() {
        entry("truth", &|center| cross(&painter, center, 3.5, cx.p.truth));
    }
    entry("prior", &|center| {
        let ends = [center - vec2(5.0, 0.0), center + vec2(5.0, 0.0)];
        painter.add(Shape::dashed_line(&ends, Stroke::new(1.0, cx.p.strong), 3.0, 2.0));
    });
}
