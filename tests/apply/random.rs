//! Any order of commands: nothing panics, what is on the disk is what is on the screen, and undoing everything brings
//! the document back.

mod commands;

use std::collections::BTreeMap;

use proptest::prelude::*;
use touch2touch::app::apply::apply;
use touch2touch::app::command::{
    Answer, Command, DoctorCommand, EvaluateCommand, LabelsCommand, LearnCommand, LibraryCommand, Pane, PredictCommand,
    SettingsCommand,
};
use touch2touch::app::labels::{Document, MaskPlace, Review};
use touch2touch::app::services::Services;
use touch2touch::app::state::State;
use touch2touch::app::tasks::TaskKind;
use touch2touch_core::grid::Mask;

use self::commands::{change, command};
use super::bench::{Bench, SIMULATED};
use super::panes;

/// What a document says, without revisions: equal if it looks the same.
type Said = Vec<(String, BTreeMap<MaskPlace, Mask>, Review, String)>;

fn said(doc: &Document) -> Said {
    doc.labels
        .iter()
        .filter(|(_, labels)| !labels.is_empty())
        .map(|(name, labels)| {
            let masks = labels.masks.iter().map(|(place, hand)| (place.clone(), (*hand.mask).clone()));
            (name.clone(), masks.collect(), labels.review, labels.note.clone())
        })
        .collect()
}

/// True where a command leaves the history as it is: that of another data set, and of labels read again, is read from files.
fn stays(command: &Command) -> bool {
    match command {
        Command::Library(LibraryCommand::Open(_) | LibraryCommand::Reload) => false,
        Command::Answer(Answer::TaskResult(_, end)) => !matches!(end.kind, TaskKind::Import | TaskKind::ReadOtherwise),
        _ => true,
    }
}

/// True where a command starts a long job, or has the data read otherwise.
fn takes_long(command: &Command) -> bool {
    match command {
        Command::Evaluate(command) => !matches!(command, EvaluateCommand::Choose(..) | EvaluateCommand::Published(_)),
        Command::Doctor(command) => !matches!(command, DoctorCommand::Show(_)),
        Command::Learn(command) => matches!(command, LearnCommand::Start(_)),
        Command::Predict(command) => matches!(command, PredictCommand::Refit),
        _ => false,
    }
}

fn session(command: impl Strategy<Value = Command>, most: usize) -> impl Strategy<Value = Vec<(Command, u8)>> {
    proptest::collection::vec((command, 0u8..4), 1..most)
}

/// Carries a session out, and ends its last stroke. What is on the disk then is what is on the screen.
fn carry_out(bench: &mut Bench, commands: Vec<(Command, u8)>) -> Result<(), TestCaseError> {
    bench.run(panes(&[
        Pane::Browser,
        Pane::Measured,
        Pane::Predicted,
        Pane::Compare,
        Pane::Masks,
        Pane::Metrics,
        Pane::Scene,
    ]));
    for (command, then) in commands.into_iter().filter(|(command, _)| !takes_long(command)) {
        bench.send(command);
        if then == 0 {
            bench.settle();
        }
    }
    bench.run(LabelsCommand::EndStroke);
    for (name, masks, review, note) in said(&bench.state.document) {
        let stored = bench.stored(&name);
        prop_assert_eq!(stored.review, review);
        prop_assert_eq!(stored.note, note);
        prop_assert_eq!(stored.masks.len(), masks.len());
        for (place, shown) in masks {
            prop_assert_eq!(&*stored.masks[&place].mask, &shown);
        }
    }
    Ok(())
}

/// So many cases where `PROPTEST_CASES` says nothing, and as many times more as it says more than the usual 256.
fn cases(few: u32) -> ProptestConfig {
    let usual = ProptestConfig::default();
    ProptestConfig { cases: (usual.cases * few).div_ceil(256), ..usual }
}

proptest! {
    // Each case runs its jobs for real.
    #![proptest_config(cases(6))]

    #[test]
    fn undoing_everything_brings_the_document_back(
        commands in session(command().prop_filter("the history stays", stays), 60)
    ) {
        let mut bench = Bench::open();
        carry_out(&mut bench, commands)?;
        let end = said(&bench.state.document);
        // As if all predictions that were ever drawn on were on screen.
        let gestures = bench.state.history.done().iter();
        let places: Vec<MaskPlace> = gestures.flat_map(|g| g.edits.iter().filter_map(|e| e.place().cloned())).collect();
        let touch2touch::app::state::State { history, document, .. } = &mut bench.state;
        let names: Vec<String> = document.labels.keys().cloned().collect();
        let mut undone = Vec::new();
        for name in &names {
            while history.undo(document, name, &places).is_some() {
                undone.push(name);
            }
        }
        prop_assert_eq!(said(document), Said::new());
        for name in undone.into_iter().rev() {
            prop_assert!(history.redo(document, name, &places).is_some());
        }
        prop_assert_eq!(said(document), end);
    }
}

proptest! {
    #[test]
    fn every_choice_of_every_pane_survives_a_restart(changes in proptest::collection::vec(change(), 1..20)) {
        let folder = tempfile::tempdir().unwrap();
        let services = Services::with_config_folder(Some(folder.path().to_owned()));
        let mut state = State::default();
        for change in changes {
            apply(&mut state, SettingsCommand::Change(change).into());
        }
        services.save_settings(&state.settings).unwrap();
        let (settings, problem) = services.load_settings();
        prop_assert_eq!(problem, None);
        prop_assert_eq!(settings, state.settings);
    }
}

proptest! {
    // A simulated grasp registers for real: these take seconds.
    #![proptest_config(cases(4))]

    #[test]
    fn no_order_of_commands_panics(commands in session(command(), 40)) {
        let mut bench = Bench::open();
        bench.send(LibraryCommand::Select(SIMULATED));
        carry_out(&mut bench, commands)?;
    }
}
