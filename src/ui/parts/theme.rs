//! Colors, type and spacing: the data is the brightest thing on the screen.
//!
//! Everything around the data is a neutral gray. One accent marks what is selected or running; red, amber and green
//! only speak of state. Truth and prediction have the same two colors in every pane, plot and table (blue and orange:
//! they stay apart for color-blind eyes); the CAD model is a calm third.

use std::sync::Arc;

use eframe::egui::{
    self, Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, RichText, Shadow, Stroke,
    TextStyle, Theme, vec2,
};

use touch2touch_core::verdict::Grade;

/// The grid that every distance is a multiple of, points.
pub(crate) const UNIT: f32 = 4.0;
/// Small type: captions, ticks, units.
pub const SMALL: f32 = 11.0;
/// Body type.
pub(crate) const BODY: f32 = 13.0;
/// Headings.
pub(crate) const HEADING: f32 = 16.0;

/// The colors of the mask and of contact points, everywhere: apart from every color of the maps.
pub(crate) const CONTACT: Color32 = Color32::from_rgb(0xff, 0x5f, 0xc4);
/// The color of proposals.
pub(crate) const PROPOSED: Color32 = Color32::from_rgb(0x4a, 0xd9, 0xff);
/// The color of ignored pixels.
pub const IGNORED: Color32 = Color32::from_rgb(0xff, 0xc8, 0x3d);
/// The colors of one theme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Palette {
    /// Behind images and 3D views.
    pub canvas: Color32,
    /// Behind bars and tabs.
    pub frame: Color32,
    /// Behind controls.
    pub panel: Color32,
    /// Lines between panes.
    pub line: Color32,
    /// Controls at rest, under the pointer, pressed.
    pub control: [Color32; 3],
    /// Text that is read.
    pub text: Color32,
    /// Titles and values.
    pub strong: Color32,
    /// Captions and units.
    pub weak: Color32,
    /// Color of what is selected or running.
    pub accent: Color32,
    /// Text on the accent.
    pub on_accent: Color32,
    /// A surface that is selected.
    pub selected: Color32,
    /// The measured side, everywhere.
    pub truth: Color32,
    /// The predicted side, everywhere.
    pub prediction: Color32,
    /// The CAD model.
    pub cad: Color32,
    /// The other one of two predictions that are compared.
    pub second: Color32,
    /// Done.
    pub good: Color32,
    /// Needs care.
    pub caution: Color32,
    /// Wrong.
    pub wrong: Color32,
}

/// Light on dark.
pub(crate) const DARK: Palette = Palette {
    canvas: Color32::from_gray(14),
    frame: Color32::from_gray(22),
    panel: Color32::from_gray(29),
    line: Color32::from_gray(46),
    control: [Color32::from_gray(46), Color32::from_gray(58), Color32::from_gray(70)],
    text: Color32::from_gray(204),
    strong: Color32::from_gray(240),
    weak: Color32::from_gray(148),
    accent: Color32::from_rgb(0x8b, 0x8c, 0xf6),
    on_accent: Color32::from_gray(12),
    selected: Color32::from_rgb(0x36, 0x36, 0x58),
    truth: Color32::from_rgb(0x56, 0xb4, 0xe9),
    prediction: Color32::from_rgb(0xf5, 0x93, 0x3d),
    cad: Color32::from_rgb(0xa9, 0xb1, 0xad),
    second: Color32::from_rgb(0xb8, 0xe0, 0x4a),
    good: Color32::from_rgb(0x4c, 0xb9, 0x7a),
    caution: Color32::from_rgb(0xe6, 0xc2, 0x40),
    wrong: Color32::from_rgb(0xf0, 0x5f, 0x5f),
};

/// Dark on light, with the same steps of contrast.
pub(crate) const LIGHT: Palette = Palette {
    canvas: Color32::from_gray(228),
    frame: Color32::from_gray(236),
    panel: Color32::from_gray(247),
    line: Color32::from_gray(208),
    control: [Color32::from_gray(214), Color32::from_gray(203), Color32::from_gray(190)],
    text: Color32::from_gray(48),
    strong: Color32::from_gray(12),
    weak: Color32::from_gray(100),
    accent: Color32::from_rgb(0x4f, 0x4c, 0xd0),
    on_accent: Color32::WHITE,
    selected: Color32::from_rgb(0xd6, 0xd6, 0xf6),
    truth: Color32::from_rgb(0x00, 0x6f, 0xb0),
    prediction: Color32::from_rgb(0xc2, 0x54, 0x00),
    cad: Color32::from_rgb(0x6d, 0x76, 0x71),
    second: Color32::from_rgb(0x5b, 0x7a, 0x00),
    good: Color32::from_rgb(0x1c, 0x84, 0x47),
    caution: Color32::from_rgb(0x96, 0x6f, 0x00),
    wrong: Color32::from_rgb(0xc6, 0x28, 0x28),
};

impl Palette {
    /// The palette of the theme that `ui` is drawn in.
    pub fn of(ui: &egui::Ui) -> &'static Self {
        if ui.visuals().dark_mode { &DARK } else { &LIGHT }
    }

    /// Ground of a row in a list.
    pub(crate) fn row(&self, selected: bool, hovered: bool) -> Color32 {
        match (selected, hovered) {
            (true, _) => self.selected,
            (false, true) => self.control[0],
            (false, false) => Color32::TRANSPARENT,
        }
    }
}

/// The family of half-bold type, for titles.
pub(crate) fn medium() -> FontFamily {
    FontFamily::Name("medium".into())
}

/// A title: half-bold, body size.
pub fn title(text: impl Into<String>) -> RichText {
    RichText::new(text).family(medium()).size(BODY)
}

/// A heading of a section within a pane: small, half-bold, weak, in capitals.
pub fn section(text: &str, palette: &Palette) -> RichText {
    RichText::new(text.to_uppercase()).family(medium()).size(SMALL).color(palette.weak)
}

/// A caption: small and weak.
pub(crate) fn caption(text: impl Into<String>, palette: &Palette) -> RichText {
    RichText::new(text).size(SMALL).color(palette.weak)
}

/// A value: strong. Roboto's figures are tabular, so nothing jumps.
pub fn value(text: impl Into<String>, palette: &Palette) -> RichText {
    RichText::new(text).color(palette.strong)
}

/// Gives `ctx` the type and both themes. Call once.
pub fn install(ctx: &egui::Context) {
    ctx.set_fonts(fonts());
    for (theme, palette) in [(Theme::Dark, &DARK), (Theme::Light, &LIGHT)] {
        ctx.style_mut_of(theme, |style| restyle(style, palette, theme == Theme::Dark));
    }
}

fn fonts() -> FontDefinitions {
    let mut fonts = FontDefinitions::default();
    let bold = include_bytes!("../../../assets/fonts/Roboto-Medium.ttf");
    fonts.font_data.insert("regular".into(), Arc::new(FontData::from_static(touch2touch_pipeline::io::fonts::REGULAR)));
    fonts.font_data.insert("medium".into(), Arc::new(FontData::from_static(bold)));
    // The fonts that come with the toolkit stay as fallbacks: they have the symbols.
    let fallback = fonts.families.get(&FontFamily::Proportional).cloned().unwrap_or_default();
    fonts.families.entry(FontFamily::Proportional).or_default().insert(0, "regular".into());
    let medium_family = std::iter::once("medium".to_owned()).chain(fallback).collect();
    fonts.families.insert(medium(), medium_family);
    fonts
}

fn restyle(style: &mut egui::Style, p: &Palette, dark: bool) {
    let body = FontId::proportional(BODY);
    style.text_styles = [
        (TextStyle::Small, FontId::proportional(SMALL)),
        (TextStyle::Body, body.clone()),
        (TextStyle::Button, body),
        (TextStyle::Monospace, FontId::monospace(BODY - 1.0)),
        (TextStyle::Heading, FontId::new(HEADING, medium())),
    ]
    .into();
    let s = &mut style.spacing;
    s.item_spacing = vec2(2.0 * UNIT, UNIT);
    s.button_padding = vec2(2.0 * UNIT, UNIT - 1.0);
    s.window_margin = Margin::same(12);
    s.menu_margin = Margin::same(8);
    s.interact_size = vec2(8.0 * UNIT, 6.0 * UNIT);
    s.indent = 4.0 * UNIT;
    s.slider_width = 25.0 * UNIT;
    s.slider_rail_height = UNIT;
    s.combo_width = 20.0 * UNIT;
    s.tooltip_width = 320.0;
    s.scroll.bar_width = 2.0 * UNIT;

    let v = &mut style.visuals;
    v.dark_mode = dark;
    v.panel_fill = p.panel;
    v.window_fill = p.panel;
    v.extreme_bg_color = p.canvas;
    v.text_edit_bg_color = Some(p.canvas);
    v.code_bg_color = p.frame;
    v.faint_bg_color = p.frame;
    v.warn_fg_color = p.caution;
    v.error_fg_color = p.wrong;
    v.hyperlink_color = p.accent;
    v.weak_text_color = Some(p.weak);
    v.selection.bg_fill = p.selected;
    v.selection.stroke = Stroke::new(1.0, p.strong);
    v.window_stroke = Stroke::new(1.0, p.line);
    v.window_corner_radius = CornerRadius::same(8);
    v.menu_corner_radius = CornerRadius::same(6);
    let shade = Color32::from_black_alpha(if dark { 120 } else { 50 });
    v.popup_shadow = Shadow { offset: [0, 4], blur: 12, spread: 0, color: shade };
    v.window_shadow = Shadow { offset: [0, 8], blur: 24, spread: 0, color: shade };
    v.slider_trailing_fill = true;
    v.striped = false;
    v.indent_has_left_vline = false;
    v.disabled_alpha = 0.45;
    let widgets = &mut v.widgets;
    for (widget, fill, text) in [
        (&mut widgets.noninteractive, p.panel, p.text),
        (&mut widgets.inactive, p.control[0], p.text),
        (&mut widgets.hovered, p.control[1], p.strong),
        (&mut widgets.active, p.control[2], p.strong),
        (&mut widgets.open, p.control[1], p.strong),
    ] {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.bg_stroke = Stroke::NONE;
        widget.fg_stroke = Stroke::new(1.0, text);
        widget.corner_radius = CornerRadius::same(4);
        widget.expansion = 0.0;
    }
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, p.line);
    widgets.hovered.bg_stroke = Stroke::new(1.0, p.weak.gamma_multiply(0.6));
    widgets.active.bg_stroke = Stroke::new(1.0, p.accent);
}

/// The frame around the controls of a pane.
pub(crate) fn pane_frame(palette: &Palette) -> egui::Frame {
    egui::Frame::new().fill(palette.panel).inner_margin(Margin::same(8))
}

/// The color of a grade.
pub(crate) fn grade_color(p: &Palette, grade: Grade) -> Color32 {
    match grade {
        Grade::Good => p.good,
        Grade::Check => p.caution,
        Grade::Wrong => p.wrong,
    }
}

/// `a` with a share `t` of `b`.
pub fn mix(a: Color32, b: Color32, t: f32) -> Color32 {
    a.lerp_to_gamma(b, t)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: Color32) -> f32 {
        let rgba = egui::Rgba::from(c);
        0.2126 * rgba.r() + 0.7152 * rgba.g() + 0.0722 * rgba.b()
    }

    fn contrast(a: Color32, b: Color32) -> f32 {
        let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
        if a > b { a / b } else { b / a }
    }

    #[test]
    fn text_is_readable_in_both_themes() {
        for p in [DARK, LIGHT] {
            for back in [p.canvas, p.frame, p.panel] {
                assert!(contrast(p.text, back) >= 7.0, "text on {back:?}");
                for (name, fore) in [("weak", p.weak), ("accent", p.accent), ("good", p.good), ("wrong", p.wrong)] {
                    let got = contrast(fore, back);
                    assert!(got >= if name == "weak" { 4.5 } else { 3.0 }, "{name} on {back:?}: {got}");
                }
                for fore in [p.truth, p.prediction, p.caution] {
                    assert!(contrast(fore, back) >= 3.0, "{fore:?} on {back:?}");
                }
            }
            assert!(contrast(p.on_accent, p.accent) >= 4.5);
        }
    }
}
