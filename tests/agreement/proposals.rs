//! Proposals: nothing changes before they are accepted, hand work stays, and the verb makes the same masks.

use touch2touch::app::command::ViewCommand;
use touch2touch::app::labels::DrawnMask;
use touch2touch::app::results;
use touch2touch::app::settings::prefer;
use touch2touch_core::label::{Paint, Provenance};
use touch2touch_pipeline::masks::propose::ProposalSource;

use super::*;

const MEASURED: ImprintSource = ImprintSource::Measured;

/// Strokes of contact and of what is free, by hand.
fn strokes(studio: &mut Studio) {
    for (from, to, erase) in [([80.0, 60.0], [95.0, 80.0], false), ([5.0, 5.0], [40.0, 5.0], true)] {
        studio.send(LabelsCommand::BeginStroke { finger: lab::RIGHT, source: MEASURED, at_px: from, erase }.into());
        studio.send(LabelsCommand::StrokeTo(to).into());
        studio.send(LabelsCommand::EndStroke.into());
    }
}

/// With the pane of the masks on screen: proposals are made while it is looked at.
fn open(folder: &Path, home: &Path) -> Studio {
    let mut studio = Studio::open(Place::Path(folder.to_owned()), home);
    let panes = [Pane::Measured, Pane::Masks, Pane::Scene].into_iter().collect();
    studio.send(ViewCommand::ShowPanes(panes).into());
    studio
}

/// Why no proposal is shown.
fn why(studio: &Studio) -> String {
    let state = &studio.state;
    let finger = state.selection.finger;
    format!(
        "proposing {}, finger {finger:?}, imprint {:?}, {:?}; {:?}; failed: {:?}; log: {:?}",
        results::proposes(state),
        results::worked_on(state, finger),
        results::proposal_key(state, MEASURED, finger),
        matches!(results::proposal(state, MEASURED, finger), Lookup::Waiting),
        state.tasks.failed,
        state.log.entries,
    )
}

fn hand(studio: &Studio) -> Option<DrawnMask> {
    results::drawn_mask(&studio.state, MEASURED, lab::RIGHT).cloned()
}

#[test]
fn what_is_proposed_is_the_same_on_the_screen_and_by_verb() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let path = folder.to_str().unwrap();
    let listed = json(&["pose", path], home.path());
    let name = name_of(&listed, 1);
    let stored = || {
        let labels = Labels::of(&Dataset::open(&folder).unwrap()).load(&name).unwrap();
        labels.measured(lab::RIGHT).cloned()
    };
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    // The others are among the random recipes.
    for source in [ProposalSource::CadRegistered, ProposalSource::Grow] {
        let mut studio = open(&folder, home.path());
        let at =
            studio.state.library.open.as_ref().unwrap().source.dataset.index.pairs.iter().position(|p| p.name == name);
        studio.send(LibraryCommand::Select(PairId(at.unwrap() as u32)).into());
        let mask = MaskSettings { proposal: source, choice, radius_px: 3.0, ..MaskSettings::default() };
        studio.send(prefer(move |s| s.mask = mask.clone()).into());
        if source == ProposalSource::Grow {
            strokes(&mut studio);
        }
        let before = hand(&studio);
        studio.send(ViewCommand::Propose(true).into());
        let proposal = results::shown_proposal(&studio.state, MEASURED, lab::RIGHT).cloned();
        let proposal = proposal.unwrap_or_else(|| panic!("{source:?}: {}", why(&studio)));
        assert!(proposal.mask.as_slice().contains(&true), "{source:?}");
        assert_eq!(hand(&studio), before, "{source:?}: looking changes nothing");
        // Nor does going elsewhere and back.
        studio.send(LibraryCommand::Step(-1).into());
        studio.send(LibraryCommand::Step(1).into());
        assert_eq!(hand(&studio), before, "{source:?}: navigation accepts nothing");
        studio.send(LabelsCommand::AcceptProposal.into());
        let made = hand(&studio).unwrap();
        assert!(!results::proposes(&studio.state));
        assert!(made.marks.layers().iter().any(|(by, px)| **by == proposal.provenance && *px > 0), "{source:?}");
        drop(studio);
        assert!(stored().is_some_and(|stored| stored.is_same(&made)), "{source:?} on the disk");
        json(&["label", path, "--pair", &name, "--remove-mask", "--finger", "right"], home.path());
        assert_eq!(stored(), None);
        let mut verb = vec!["label", path, "--pair", &name, "--finger", "right", "--mask", "threshold"];
        if source == ProposalSource::Grow {
            let drawn = verb.clone();
            let contact = r#"{"tool": "brush", "radius_px": 3, "points": [[80, 60], [95, 80]]}"#;
            let free = r#"{"tool": "brush", "radius_px": 3, "paint": "free", "points": [[5, 5], [40, 5]]}"#;
            json(&[&drawn[..], &["--draw", contact, "--draw", free]].concat(), home.path());
        }
        verb.extend(["--propose", source.key()]);
        json(&verb, home.path());
        assert!(stored().is_some_and(|stored| stored.is_same(&made)), "{source:?} by the verb");
        json(&["label", path, "--pair", &name, "--remove-mask"], home.path());
    }
}

#[test]
fn hand_work_stays_until_it_is_asked_for_and_what_is_let_through_is_hand_work() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let mut studio = open(&folder, home.path());
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    let proposal = ProposalSource::CadTruth;
    let mask = MaskSettings { proposal, choice, radius_px: 3.0, ..MaskSettings::default() };
    studio.send(prefer(move |s| s.mask = mask.clone()).into());
    strokes(&mut studio);
    let painted = hand(&studio).unwrap();
    let checked = painted.marks.manual_checked();
    let accept = |studio: &mut Studio| {
        studio.send(ViewCommand::Propose(true).into());
        let proposed = results::shown_proposal(&studio.state, MEASURED, lab::RIGHT).cloned();
        let proposed = proposed.unwrap_or_else(|| panic!("{}", why(studio))).mask.clone();
        studio.send(LabelsCommand::AcceptProposal.into());
        proposed
    };
    let proposed = accept(&mut studio);
    let kept = hand(&studio).unwrap();
    for (i, by_hand) in checked.as_slice().iter().enumerate() {
        let from = if *by_hand { &painted.mask } else { &proposed };
        assert_eq!(kept.mask.as_slice()[i], from.as_slice()[i], "pixel {i}");
    }
    studio.send(prefer(move |s| s.mask.over_drawn = true).into());
    accept(&mut studio);
    assert!(*hand(&studio).unwrap().mask == proposed);
    for _ in 0..2 {
        studio.send(LabelsCommand::Undo.into());
    }
    assert!(hand(&studio).unwrap().is_same(&painted), "undo gives pixels and their provenance back");
    // By brush: only there, and as the person's own.
    studio.send(prefer(move |s| s.mask.paint = Paint::LetThrough).into());
    let begin = LabelsCommand::BeginStroke { finger: lab::RIGHT, source: MEASURED, at_px: [60.0, 70.0], erase: false };
    let said = studio.state.log.entries.len();
    studio.send(begin.clone().into());
    assert!(
        studio.state.document.stroke.is_none() && studio.state.log.entries.len() > said,
        "nothing is shown to let through"
    );
    studio.send(ViewCommand::Propose(true).into());
    studio.send(begin.into());
    studio.send(LabelsCommand::StrokeTo([110.0, 70.0]).into());
    studio.send(LabelsCommand::EndStroke.into());
    let through = hand(&studio).unwrap();
    let mine = |hand: &DrawnMask, i: usize| {
        matches!(hand.marks.at(i % 175, i / 175), Some(Provenance::Hand { .. })) && !checked.as_slice()[i]
    };
    let mut touched = 0;
    for i in 0..through.mask.len() {
        let from = if mine(&through, i) { &proposed } else { &painted.mask };
        touched += usize::from(mine(&through, i));
        assert!(checked.as_slice()[i] || through.mask.as_slice()[i] == from.as_slice()[i], "pixel {i}");
    }
    assert!(touched > 200, "{touched}");
}

#[test]
fn two_windows_on_one_folder_lose_nothing_of_each_other() {
    let home = tempfile::tempdir().unwrap();
    let folder = lab_folder(home.path());
    let mut windows = [open(&folder, home.path()), open(&folder, home.path())];
    let choice = MaskChoice { source: MaskSource::Threshold, ..MaskChoice::default() };
    let name = windows[0].state.pair_name().to_owned();
    for (window, person) in windows.iter_mut().zip(["anna", "ben"]) {
        let mask = MaskSettings { choice, radius_px: 3.0, tool: MaskTool::Rectangle, ..MaskSettings::default() };
        window.send(prefer(move |s| s.mask = mask.clone()).into());
        window.send(prefer(move |s| s.person = person.into()).into());
        assert_eq!(window.state.pair_name(), name);
    }
    let rectangle = |window: &mut Studio, from: [f32; 2], to: [f32; 2]| {
        window.send(
            LabelsCommand::BeginStroke { finger: lab::RIGHT, source: MEASURED, at_px: from, erase: false }.into(),
        );
        window.send(LabelsCommand::StrokeTo(to).into());
        window.send(LabelsCommand::EndStroke.into());
    };
    let [anna, ben] = &mut windows;
    rectangle(anna, [2.0, 2.0], [20.0, 20.0]);
    rectangle(ben, [150.0, 100.0], [170.0, 130.0]);
    let who = |hand: &DrawnMask, x, y| match hand.marks.at(x, y) {
        Some(Provenance::Hand { person }) => person.clone(),
        _ => String::new(),
    };
    let both = |hand: &DrawnMask| {
        assert!(hand.mask[(10, 10)] && hand.mask[(160, 110)]);
        assert_eq!([who(hand, 10, 10), who(hand, 160, 110)], ["anna", "ben"]);
    };
    let stored =
        || Labels::of(&Dataset::open(&folder).unwrap()).load(&name).unwrap().measured(lab::RIGHT).cloned().unwrap();
    both(&stored());
    both(&hand(ben).unwrap());
    assert!(ben.state.log.entries.iter().any(|entry| entry.text.contains("somebody else")));
    // Who saved first learns of it with the next change.
    rectangle(anna, [2.0, 120.0], [9.0, 130.0]);
    for hand in [stored(), hand(anna).unwrap()] {
        both(&hand);
        assert!(hand.mask[(5, 125)]);
    }
    // What was taken in is not taken back.
    anna.send(LabelsCommand::Undo.into());
    both(&stored());
}
