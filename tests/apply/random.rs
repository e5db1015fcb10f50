//! Any order of commands: nothing panics, and undoing everything brings the document back.

use proptest::prelude::*;
use touch2touch::app::command::{Command, Pane};
use touch2touch::app::document::{Document, Review};
use touch2touch::app::keys::ImprintSource;
use touch2touch::app::settings::MaskTool;
use touch2touch::domain::dataset::PairId;
use touch2touch::domain::grid::Mask;
use touch2touch::domain::rig::{PadId, lab};

use super::double::Bench;
use super::panes;

/// What a document says, without revisions: equal if it looks the same.
type Said = Vec<(String, [Option<Mask>; 2], Review)>;

fn said(doc: &Document) -> Said {
    doc.labels
        .iter()
        .filter(|(_, labels)| !labels.is_empty())
        .map(|(name, labels)| {
            let mask = |pad| labels.masks.get(pad).map(|hand| (*hand.mask).clone());
            (name.clone(), lab::PADS.map(mask), labels.review)
        })
        .collect()
}

fn position() -> impl Strategy<Value = [f32; 2]> {
    prop_oneof![
        8 => [-3.0f32..27.0, -3.0f32..19.0],
        1 => Just([f32::NAN, 1.0]),
        1 => Just([1e30, -1e30]),
    ]
}

fn finger() -> impl Strategy<Value = PadId> {
    prop_oneof![Just(lab::RIGHT), Just(lab::LEFT)]
}

fn command() -> impl Strategy<Value = Command> {
    let source = prop_oneof![Just(ImprintSource::Measured), Just(ImprintSource::Predicted)];
    prop_oneof![
        6 => (finger(), source, position(), any::<bool>())
            .prop_map(|(finger, source, at_px, erase)| Command::BeginStroke { finger, source, at_px, erase }),
        6 => position().prop_map(Command::StrokeTo),
        6 => Just(Command::EndStroke),
        1 => Just(Command::CancelStroke),
        2 => Just(Command::FillHoles),
        2 => Just(Command::LargestIsland),
        2 => Just(Command::AdoptAutomatic),
        1 => Just(Command::ResetMask),
        3 => Just(Command::Undo),
        3 => Just(Command::Redo),
        2 => (0u32..5).prop_map(|id| Command::Select(PairId(id))),
        1 => Just(Command::Select(PairId(u32::MAX))),
        2 => finger().prop_map(Command::SelectFinger),
        1 => any::<bool>().prop_map(Command::ShowBothFingers),
        1 => Just(Command::Generate),
        1 => Just(Command::GenerateNewSeed),
        1 => Just(Command::CancelAll),
        1 => Just(Command::SetMaskTool(MaskTool::Brush)),
        1 => Just(Command::SetMaskTool(MaskTool::Eraser)),
        1 => Just(Command::SetReview(Review::Flagged)),
        1 => Just(Command::DoneAndNext),
        1 => Just(Command::Save),
        1 => any::<i64>().prop_map(Command::Step),
        1 => (0usize..20, 0usize..40).prop_map(|(a, b)| Command::ShowRows(a..b)),
    ]
}

proptest! {
    // Each case runs its jobs for real; 48 of them take about a second.
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn no_order_of_commands_panics_and_undo_brings_everything_back(
        commands in proptest::collection::vec((command(), 0u8..4), 1..60)
    ) {
        let mut bench = Bench::open();
        bench.send(panes(&[
            Pane::Browser, Pane::Measured, Pane::Predicted, Pane::Error, Pane::Masks, Pane::Metrics,
            Pane::SceneMeasured, Pane::ScenePredicted,
        ]));
        bench.settle();
        for (command, then) in commands {
            bench.send(command);
            if then == 0 {
                bench.settle();
            }
        }
        bench.send(Command::EndStroke);
        bench.settle();
        let end = said(&bench.state.document);
        // What is on the disk is what is on the screen.
        for (name, masks, review) in &end {
            let stored = bench.services.source.labels.lock().unwrap().get(name).cloned().unwrap_or_default();
            prop_assert_eq!(stored.review, *review);
            for (stored, shown) in stored.masks.iter().zip(masks) {
                prop_assert_eq!(stored.as_ref().map(|hand| &*hand.mask), shown.as_ref());
            }
        }
        bench.send(Command::ShowBothFingers(true));
        let mut steps = [0u32; 12];
        for pair in 0..12 {
            bench.send(Command::Select(PairId(pair)));
            let name = bench.state.pair_name().to_owned();
            while bench.state.history.next_undo(&name, &lab::PADS).is_some() {
                bench.send(Command::Undo);
                steps[pair as usize] += 1;
            }
        }
        prop_assert_eq!(said(&bench.state.document), Said::new());
        for (pair, count) in (0..).zip(steps) {
            bench.send(Command::Select(PairId(pair)));
            for _ in 0..count {
                bench.send(Command::Redo);
            }
        }
        prop_assert_eq!(said(&bench.state.document), end);
    }
}
