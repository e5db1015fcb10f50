//! The docked panes: their memories, title bars, and how they behave in their tree.

use std::collections::BTreeMap;

use eframe::egui::{self, Color32, RichText, Stroke, Ui, WidgetInfo, WidgetText, vec2};
use egui_tiles::{Behavior, SimplificationOptions, TabState, Tile, TileId, Tiles, UiResponse};

use crate::app::action::{Action, with_keys};
use crate::app::keys::ImprintSource;
use crate::app::pane::{Kind, Pane, Workspace, panes};
use crate::app::results;
use crate::app::state::{Absent, Lookup, State};
use crate::ui::parts::cx::{Cx, side_color};
use crate::ui::parts::made_with;
use crate::ui::parts::theme::{Palette, SMALL, medium, pane_frame};
use crate::ui::parts::widget::focused;
use crate::ui::parts::widget::help;

macro_rules! views {
    ($( $file:ident { $( $pane:ident $row:tt )* } )*) => {
        /// Memories of the files that draw panes, kept from one frame to the next.
        #[derive(Default)]
        pub(crate) struct Memories {
            $( pub $file: crate::ui::panes::$file::Memory, )*
        }

        /// Draws a pane.
        fn draw(cx: &mut Cx<'_>, ui: &mut Ui, memories: &mut Memories, pane: Pane) {
            match pane {
                $( $( Pane::$pane )|* => crate::ui::panes::$file::show(cx, ui, &mut memories.$file, pane), )*
            }
        }
    };
}
panes!(views);

/// The panes of the window.
#[derive(Default)]
pub(crate) struct Panes {
    /// Memories of the files that draw them.
    pub memories: Memories,
    /// The pane that fills the window.
    pub maximized: Option<Pane>,
    /// The pane under the pointer.
    pub hovered: Option<Pane>,
    /// The panes drawn in this frame, so far, in order.
    pub drawn: Vec<Pane>,
    /// Rectangle of each pane when it was drawn last, points.
    pub places: BTreeMap<Pane, egui::Rect>,
    /// True where the pair shown last has no depth camera.
    flat: bool,
}

impl Panes {
    /// The panes that have nothing to show on this data, in workspaces where others want their room: without a depth
    /// camera there is no 3D.
    pub(crate) fn idle(&mut self, state: &State) -> &'static [Pane] {
        match results::cloud(state, ImprintSource::Measured) {
            Lookup::Absent(Absent::NoCamera) => self.flat = true,
            Lookup::Ready(_) => self.flat = false,
            // While the next pair is read nothing jumps.
            _ => {}
        }
        let room = matches!(state.settings.workspace, Workspace::Inspect | Workspace::Label);
        if self.flat && room { &[Pane::Scene] } else { &[] }
    }

    /// Moves the keyboard focus from the pane that has it, or has the control with it, this many panes on.
    pub(crate) fn step(&self, ctx: &egui::Context, by: isize) {
        let at = focused(ctx).and_then(|r| self.drawn.iter().position(|p| self.places[p].contains(r.rect.center())));
        let from = at.map_or(isize::from(by < 0) - 1, |at| at as isize);
        if let Some(next) = (from + by).checked_rem_euclid(self.drawn.len() as isize) {
            ctx.memory_mut(|memory| memory.request_focus(stop(self.drawn[next as usize])));
        }
    }
}

/// The widget that stands for a whole pane among those that Tab goes through.
fn stop(pane: Pane) -> egui::Id {
    egui::Id::unique(("pane", pane))
}

/// Draws a ring around the widget that has the keyboard focus: one for rows, icons, pictures and panes alike.
pub(crate) fn ring(ctx: &egui::Context, p: &Palette) {
    if let Some(focused) = focused(ctx).filter(|focused| focused.interact_rect.is_positive()) {
        let stroke = Stroke::new(2.0, p.accent);
        let place = focused.interact_rect.expand(1.0);
        ctx.layer_painter(focused.layer_id).rect_stroke(place, 3.0, stroke, egui::StrokeKind::Inside);
    }
}

/// Draws a pane.
fn show(cx: &mut Cx<'_>, ui: &mut Ui, panes: &mut Panes, pane: Pane) {
    panes.drawn.push(pane);
    panes.places.insert(pane, ui.max_rect());
    let whole = ui.interact(ui.max_rect(), stop(pane), egui::Sense::focusable_noninteractive());
    whole.widget_info(|| WidgetInfo::labeled(egui::Role::Pane, true, format!("Pane {}", pane.title())));
    if ui.rect_contains_pointer(ui.max_rect()) {
        panes.hovered = Some(pane);
    }
    // How a prediction was made stands below whatever shows it.
    // The measured imprint leaves as much free: both color bars lie at one height.
    let predicted = made_with::is_predicted(cx, pane);
    let (place, below) = made_with::split(cx, ui.max_rect(), predicted || pane == Pane::Measured);
    ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| {
        ui.set_clip_rect(place.intersect(ui.clip_rect()));
        let memories = &mut panes.memories;
        match pane.kind() {
            Kind::Form => {
                pane_frame(cx.p).show(ui, |ui| {
                    ui.set_min_size(ui.available_size());
                    draw(cx, ui, memories, pane);
                });
            }
            _ => draw(cx, ui, memories, pane),
        }
    });
    if let Some(below) = below.filter(|_| predicted) {
        made_with::show(cx, ui, pane.title(), place, below);
    }
}

/// The mouse controls of a pane; none where it has none of its own.
fn controls(cx: &Cx<'_>, pane: Pane) -> &'static [(&'static str, &'static str)] {
    match pane.kind() {
        Kind::Form => &[],
        Kind::Imprint(_) if cx.state.selection.panes.contains(&Pane::Masks) => help::PAINT,
        Kind::Color | Kind::Imprint(_) => help::IMAGE,
        Kind::Compare => help::COMPARE,
        Kind::Scene => help::SCENE,
        Kind::Steps => help::STEPS,
    }
}

/// The menu in a pane's title: the pane itself, its mouse controls, what can be taken away.
fn menu(cx: &mut Cx<'_>, ui: &mut Ui, maximized: &mut Option<Pane>, pane: Pane) {
    ui.set_min_width(190.0);
    let whole = *maximized == Some(pane);
    let text = if whole { "Back to all panes" } else { "Fill the window" };
    let fill = egui::Button::new(text).shortcut_text(Action::MaximizePane.key_text());
    let fill = ui.add(fill).accessible_name(format!("{text}: {}", pane.title()));
    let tip = "Makes this pane fill the window or shows all again; so does a double-click on its tab";
    if fill.on_hover_text(tip).clicked() {
        *maximized = if whole { None } else { Some(pane) };
        ui.close();
    }
    if pane == Pane::Browser && cx.menu_row(ui, Action::AboutData, false).clicked() {
        ui.close();
    }
    let controls = controls(cx, pane);
    if !controls.is_empty() {
        ui.menu_button("Mouse and keys", |ui| help::list(ui, pane.title(), controls));
    }
    ui.separator();
    super::export::menu(cx, ui, pane);
}

/// The button in a pane's title that opens its menu.
fn menu_button(cx: &mut Cx<'_>, ui: &mut Ui, maximized: &mut Option<Pane>, pane: Pane) {
    let text = RichText::new("…").size(SMALL);
    let button = egui::Button::new(text).frame(false).min_size(vec2(16.0, 16.0));
    let (response, _) =
        egui::containers::menu::MenuButton::from_button(button).ui(ui, |ui| menu(cx, ui, maximized, pane));
    response
        .accessible_name(format!("Menu of {}", pane.title()))
        .on_hover_text("Maximize, mouse and keys, save or copy this pane");
}

/// Behavior of the panes in their tree.
pub(crate) struct Docking<'a, 'b> {
    /// Context that the panes get.
    pub cx: &'b mut Cx<'a>,
    /// The panes.
    pub panes: &'b mut Panes,
    /// True where a person moved something.
    pub edited: bool,
}

impl Behavior<Pane> for Docking<'_, '_> {
    fn pane_ui(&mut self, ui: &mut Ui, _tile: TileId, pane: &mut Pane) -> UiResponse {
        let rect = ui.max_rect();
        ui.painter().rect_filled(rect, 0.0, self.cx.p.panel);
        show(self.cx, ui, self.panes, *pane);
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> WidgetText {
        let color = pane.side().map_or(self.cx.p.text, |side| side_color(self.cx.p, side));
        RichText::new(pane.tab()).family(medium()).size(12.0).color(color).into()
    }

    fn on_tab_button(&mut self, tiles: &mut Tiles<Pane>, tile: TileId, response: egui::Response) -> egui::Response {
        match tiles.get(tile) {
            Some(Tile::Pane(pane)) => {
                if response.double_clicked() {
                    self.panes.maximized = Some(*pane);
                }
                let (cx, maximized) = (&mut *self.cx, &mut self.panes.maximized);
                response.context_menu(|ui| menu(cx, ui, maximized, *pane));
                response.on_hover_text(format!("{}. Drag to move, double-click to maximize", pane.tip()))
            }
            _ => response,
        }
    }

    fn top_bar_right_ui(
        &mut self,
        tiles: &Tiles<Pane>,
        ui: &mut Ui,
        _tile: TileId,
        tabs: &egui_tiles::Tabs,
        _scroll: &mut f32,
    ) {
        let Some(Tile::Pane(pane)) = tabs.active.and_then(|id| tiles.get(id)) else { return };
        ui.add_space(4.0);
        menu_button(self.cx, ui, &mut self.panes.maximized, *pane);
    }

    fn tab_bar_height(&self, _style: &egui::Style) -> f32 {
        26.0
    }

    fn tab_title_spacing(&self, _visuals: &egui::Visuals) -> f32 {
        7.0
    }

    fn gap_width(&self, _style: &egui::Style) -> f32 {
        2.0
    }

    fn min_size(&self) -> f32 {
        96.0
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }

    fn tab_bar_color(&self, _visuals: &egui::Visuals) -> Color32 {
        self.cx.p.frame
    }

    fn tab_bg_color(&self, _v: &egui::Visuals, tiles: &Tiles<Pane>, id: TileId, state: &TabState) -> Color32 {
        let alone = tiles.parent_of(id).and_then(|p| tiles.get_container(p)).is_some_and(|c| c.num_children() == 1);
        if state.active && !alone { self.cx.p.panel } else { Color32::TRANSPARENT }
    }

    fn tab_outline_stroke(&self, _v: &egui::Visuals, _t: &Tiles<Pane>, _id: TileId, _s: &TabState) -> Stroke {
        Stroke::NONE
    }

    fn tab_bar_hline_stroke(&self, _v: &egui::Visuals) -> Stroke {
        Stroke::new(1.0, self.cx.p.line)
    }

    fn resize_stroke(&self, _style: &egui::Style, state: egui_tiles::ResizeState) -> Stroke {
        match state {
            egui_tiles::ResizeState::Idle => Stroke::new(2.0, self.cx.p.line),
            _ => Stroke::new(3.0, self.cx.p.accent),
        }
    }

    fn on_edit(&mut self, _action: egui_tiles::EditAction) {
        self.edited = true;
    }
}

/// One pane over the whole window, with the way back.
pub(crate) fn show_maximized(cx: &mut Cx<'_>, ui: &mut Ui, panes: &mut Panes, pane: Pane) {
    let full = ui.available_rect_before_wrap();
    ui.painter().rect_filled(full, 0.0, cx.p.frame);
    let bar = egui::Rect::from_min_size(full.min, vec2(full.width(), 26.0));
    ui.scope_builder(egui::UiBuilder::new().max_rect(bar.shrink2(vec2(8.0, 0.0))), |ui| {
        ui.horizontal_centered(|ui| {
            ui.label(crate::ui::parts::theme::title(pane.title()));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let back = ui.button(RichText::new("Back to all panes").size(SMALL));
                if back.on_hover_text(with_keys("[[maximize_pane]] or [[cancel_jobs]]")).clicked() {
                    panes.maximized = None;
                }
                menu_button(cx, ui, &mut panes.maximized, pane);
            });
        });
    });
    let rest = egui::Rect::from_min_max(bar.left_bottom(), full.max);
    ui.scope_builder(egui::UiBuilder::new().max_rect(rest), |ui| {
        ui.set_clip_rect(rest);
        ui.painter().rect_filled(rest, 0.0, cx.p.panel);
        show(cx, ui, panes, pane);
    });
    ui.advance_cursor_after_rect(full);
}
