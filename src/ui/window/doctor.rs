//! The panel *About this data*: what the open data set is, what the models are worth on it, and a button for each cure.
//! It blocks nothing and takes no keyboard: it is there until Esc, its close button, or a cure that shows a pane.

use eframe::egui::{self, Color32, Label, RichText, ScrollArea, Ui, vec2};

use crate::app::command::DoctorCommand;
use crate::app::doctor;
use crate::app::learn::Network;
use crate::app::results;
use crate::app::settings::prefer;
use crate::app::state::Lookup;
use crate::app::tasks::TaskKind;
use crate::ui::parts::cx::Cx;
use crate::ui::parts::theme::{Palette, SMALL, caption};
use touch2touch_core::findings::Finding;
use touch2touch_core::units::counted;
use touch2touch_pipeline::doctor::{Cure, Examined, Fact, Grade, SAMPLE};

/// Width of the panel, points.
const WIDE: f32 = 520.0;
/// Share of the window that the list takes at first.
const LIST: f32 = 0.165;
/// Width of the names of the facts, points.
const NAMES: f32 = 84.0;
/// Faults that are listed; the verb lists all.
const LISTED: usize = 40;

/// The panel, where it is open.
pub(crate) fn panel(cx: &mut Cx<'_>, ctx: &egui::Context) {
    let Some(title) = cx.state.library.open.as_ref().map(|open| open.source.dataset.title.clone()) else { return };
    if !cx.state.doctor.shown {
        return;
    }
    if doctor::wants_worth(cx.state) && facts(cx).ready().is_some() {
        cx.push(DoctorCommand::Try);
    }
    let mut open = true;
    let window = egui::Window::new("About this data").id(egui::Id::unique("about this data")).open(&mut open);
    let room = ctx.content_rect();
    // Beside the list, over the pictures.
    let window = window.collapsible(false).resizable(false).default_pos([LIST * room.width() + 20.0, 64.0]);
    window.show(ctx, |ui| {
        ui.set_width(WIDE.min(room.width() - 48.0));
        ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
        let tall = room.height() - 150.0;
        // Else it would stay as low as it was before the lines were there.
        let area = ScrollArea::vertical().max_height(tall).min_scrolled_height(tall).auto_shrink([false, true]);
        area.show(ui, |ui| {
            place(cx, ui, &title);
            glance(cx, ui);
            tried(cx, ui);
            examined(cx, ui);
            ui.add_space(4.0);
            let mut always = cx.state.settings.about_own_data;
            let tick = ui.checkbox(&mut always, caption("open this with every new folder", cx.p));
            let tip = "Also in the menu Open: About this data";
            if tick.on_hover_text(tip).changed() {
                cx.push(prefer(move |s| s.about_own_data = always));
            }
        });
    });
    if !open {
        cx.push(DoctorCommand::Show(false));
    }
}

/// The lines that cost next to nothing.
fn facts<'a>(cx: &Cx<'a>) -> Lookup<'a, Vec<Fact>> {
    match results::doctor_key(cx.state) {
        // What was said before a mask was painted is as good for a moment.
        Some(key) => {
            let of_it = cx.state.results.abouts.iter().filter(|(before, _)| before.dataset == key.dataset);
            cx.state.look_or(Ok(Some(key)), || of_it.max_by_key(|(before, _)| **before).map(|(_, facts)| facts)).value()
        }
        None => Lookup::Waiting,
    }
}

fn place(cx: &Cx<'_>, ui: &mut Ui, title: &str) {
    ui.horizontal(|ui| {
        ui.label(RichText::new(title).strong().color(cx.p.strong));
        let root = cx.state.library.open.as_ref().and_then(|open| open.source.dataset.root.as_deref());
        if let Some(root) = root {
            ui.add(Label::new(caption(root.display().to_string(), cx.p)).truncate());
        }
    });
}

/// The color of a grade.
fn color(p: &Palette, grade: Grade) -> Color32 {
    match grade {
        Grade::Plain => p.text,
        Grade::Caution => p.caution,
        Grade::Wrong => p.wrong,
    }
}

fn glance(cx: &mut Cx<'_>, ui: &mut Ui) {
    match facts(cx) {
        Lookup::Ready(facts) | Lookup::Stale(facts) => facts.iter().for_each(|fact| line(cx, ui, fact)),
        Lookup::Failed(err) => {
            ui.add(Label::new(RichText::new(err.to_string()).color(cx.p.wrong)).wrap());
        }
        Lookup::Waiting | Lookup::Absent(_) => {
            ui.label(caption("Reading a few pairs…", cx.p));
        }
    }
}

/// A fact, with its cures below.
fn line(cx: &mut Cx<'_>, ui: &mut Ui, fact: &Fact) {
    named(cx, ui, fact.topic.name(), |cx, ui| {
        ui.add(Label::new(RichText::new(&fact.text).color(color(cx.p, fact.grade))).wrap());
        // Colors that fit already need no cure.
        let needed = |cure: &&Cure| !matches!(cure, Cure::FitRange { .. }) || doctor::can(cx.state, cure);
        let cures: Vec<&Cure> = fact.cures.iter().filter(needed).collect();
        if !cures.is_empty() {
            ui.horizontal_wrapped(|ui| cures.into_iter().for_each(|one| cure(cx, ui, one)));
        }
    });
}

/// A row: its name at the left, and whatever belongs to it.
fn named(cx: &mut Cx<'_>, ui: &mut Ui, name: &str, add: impl FnOnce(&mut Cx<'_>, &mut Ui)) {
    ui.horizontal_top(|ui| {
        let size = vec2(NAMES, ui.spacing().interact_size.y);
        let layout = egui::Layout::left_to_right(egui::Align::TOP);
        ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_width(NAMES);
            ui.label(caption(name, cx.p));
        });
        ui.vertical(|ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            add(cx, ui);
        });
    });
}

fn cure(cx: &mut Cx<'_>, ui: &mut Ui, cure: &Cure) {
    let running = match cure {
        Cure::Examine { .. } => cx.state.tasks.of_kind(TaskKind::Examine),
        Cure::Fit { .. } if cx.state.learn.started == Network::Generator => cx.state.tasks.of_kind(TaskKind::Learn),
        Cure::TrainFromCad { .. } if cx.state.learn.started == Network::Masks => {
            cx.state.tasks.of_kind(TaskKind::Learn)
        }
        _ => None,
    };
    if let Some((_, task)) = running {
        return cx.under_way(ui, task, &task.progress.text);
    }
    let button = ui.add_enabled(doctor::can(cx.state, cure), egui::Button::new(cure.name()).small());
    let verb = cure.verb().map_or(String::new(), |verb| format!("\n{verb}"));
    let tip = format!("{}{verb}", cure.tip());
    if button.on_hover_text(&tip).on_disabled_hover_text(tip).clicked() {
        cx.push(DoctorCommand::Cure(cure.clone()));
    }
}

/// The worth of the models, or how far trying them is.
fn tried(cx: &mut Cx<'_>, ui: &mut Ui) {
    let state = cx.state;
    if let Some((_, task)) = state.tasks.of_kind(TaskKind::TryModels) {
        return named(cx, ui, "Models", |cx, ui| {
            cx.under_way(ui, task, &task.progress.text);
        });
    }
    match state.doctor.worth.clone() {
        Some(worth) => {
            worth.facts().iter().for_each(|fact| line(cx, ui, fact));
            if let Some(name) = doctor::fitted_in_use(cx.state) {
                let text = format!("in use: {name}; these numbers are of the model it was fitted from");
                named(cx, ui, "", |cx, ui| {
                    ui.add(Label::new(caption(text, cx.p)).wrap());
                });
            }
        }
        None if doctor::can_try(state) => named(cx, ui, "Models", |cx, ui| {
            let tip = format!("Predicts {SAMPLE} pairs spread over the data set and tries a fit; writes nothing");
            if ui.small_button("Try the models").on_hover_text(tip).clicked() {
                cx.push(DoctorCommand::Try);
            }
        }),
        None => {}
    }
}

/// Faults of all pairs, once they were examined.
fn examined(cx: &mut Cx<'_>, ui: &mut Ui) {
    let Some(examined) = cx.state.doctor.examined.clone() else { return };
    let Examined { report, read_as } = &*examined;
    ui.separator();
    let found: usize = report.problems.iter().map(|finding| finding.count).sum();
    let text = format!("{} of {}", counted(found, "problem"), counted(report.examined, "pair"));
    ui.label(RichText::new(text).color(if found == 0 { cx.p.good } else { cx.p.caution }));
    if let Some(list) = read_as {
        cure(cx, ui, &Cure::ReadAs { list: list.clone() });
    }
    report.problems.iter().take(LISTED).for_each(|finding| one(cx, ui, finding));
    if report.problems.len() > LISTED {
        ui.label(caption(format!("and {} more; `touch2touch doctor` lists all", report.problems.len() - LISTED), cx.p));
    }
}

fn one(cx: &Cx<'_>, ui: &mut Ui, finding: &Finding) {
    let file = finding.file.file_name().unwrap_or(finding.file.as_os_str()).to_string_lossy();
    let times = if finding.count > 1 { format!(" ({} times)", finding.count) } else { String::new() };
    let text = RichText::new(format!("{file}{times}: {}", finding.what)).size(SMALL);
    ui.add(Label::new(text).wrap()).on_hover_text(finding.file.display().to_string());
    ui.add(Label::new(caption(finding.hint.as_str(), cx.p)).wrap());
}
