//! A choice of one of several, in a list that opens.

use eframe::egui::{ComboBox, Ui};

/// Shows the list under a name for screen readers and a tooltip; what was chosen of `all`, each said with a tooltip of its own.
pub fn choose<'s, T: PartialEq>(
    ui: &mut Ui,
    list: ComboBox<'_>,
    (name, tip): (&str, &str),
    now: Option<&T>,
    all: impl IntoIterator<Item = T>,
    said: impl Fn(&T) -> (&'s str, &'s str),
) -> Option<T> {
    let mut chosen = None;
    let response = list.show_ui(ui, |ui| {
        ui.style_mut().override_font_id = None;
        for one in all {
            let (text, tip) = said(&one);
            let row = ui.selectable_label(now == Some(&one), text);
            let row = if tip.is_empty() { row } else { row.on_hover_text(tip) };
            if row.clicked() {
                chosen = Some(one);
            }
        }
    });
    response.response.accessible_name(name).on_hover_text(tip);
    chosen
}
