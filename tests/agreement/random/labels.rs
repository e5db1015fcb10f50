//! Labels of pairs: drawn, cleaned up, taken over, accepted, reviewed; and masks that are proposed.

use strum::IntoEnumIterator as _;
use touch2touch::app::command::LabelsCommand;
use touch2touch::app::labels::Review;
use touch2touch::app::settings::{MaskTool, ProposalSource, prefer};
use touch2touch::app::{recipe, results};
use touch2touch_core::label::{CleanKind, CleanUp};
use touch2touch_core::rig::lab;
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::labels::Labels;
use touch2touch_pipeline::steps::mask::MaskSource;
use touch2touch_pipeline::steps::recipe::Stage;

use super::*;

/// A lab folder that the studio labels, and the same that the verbs do.
fn twins(home: &Path) -> (Both, PathBuf) {
    let [by_studio, by_verb] = ["one", "other"].map(|name| home.join(name));
    let folder = lab_folder(&by_studio);
    let twin = lab_folder(&by_verb);
    let mut both = Both::open(Place::Path(folder), home);
    both.path = twin.to_str().unwrap().to_owned();
    (both, twin)
}

/// Holds the labels of both folders against each other. How many pixels, poses, and words there were.
fn same_labels(both: &Both, twin: &Path, what: &str) -> usize {
    let Place::Path(folder) = &both.studio.state.library.open.as_ref().unwrap().place else { panic!("a folder") };
    let [own, other] = [folder.as_path(), twin].map(|folder| Dataset::open(folder).unwrap());
    let mut count = 0;
    for entry in &own.index.pairs {
        let [shown, said] = [&own, &other].map(|set| Labels::of(set).load(&entry.name).unwrap());
        let what = format!("{}: {what}", entry.name);
        assert!(
            shown.masks.keys().eq(said.masks.keys()),
            "{what}: {:?} and {:?}",
            shown.masks.keys(),
            said.masks.keys()
        );
        for (place, mask) in &shown.masks {
            let other = &said.masks[place];
            let differ = mask.mask.as_slice().iter().zip(other.mask.as_slice()).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "{what}: pixels of {place:?}");
            let layers = [mask, other].map(|mask| mask.marks.layers());
            assert!(mask.is_same(other), "{what}: who drew {place:?}: {layers:?}");
            count += mask.mask.len();
        }
        assert_eq!(shown.accepted, said.accepted, "{what}");
        assert_eq!((shown.review, &shown.note), (said.review, &said.note), "{what}");
        count += 3 * shown.accepted.len() + usize::from(!shown.note.is_empty());
    }
    count
}

#[test]
pub(in crate::agreement) fn random_edits_of_masks_by_hand_are_those_of_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let (mut both, twin) = twins(home.path());
    let mut draws = Draws::new(13);
    both.show(&[Pane::Measured, Pane::Predicted, Pane::Masks, Pane::Scene]);
    both.studio.send(prefer(|s| (s.mask.tool, s.mask.radius_px) = (MaskTool::Brush, 3.0)).into());
    let mut counts = Vec::new();
    for pair in 0..2 {
        let recipe = draws.posed();
        both.predict(&recipe, pair);
        let words = recipe::in_force(&both.studio.state, ImprintSource::Predicted).words(Stage::Pose).list();
        let label = |both: &Both, more: &[&str]| {
            let all = words.iter().cloned().chain(more.iter().map(ToString::to_string));
            both.of_pair(&["label"], all).unwrap_or_else(|err| panic!("{more:?} {words:?}: {err}"))
        };
        let source = draws.of(&ImprintSource::iter().collect::<Vec<_>>());
        let finger = draws.of(&[lab::RIGHT, lab::LEFT]);
        let what = format!("{source:?} {finger:?}, {recipe:?}");
        let name = both.studio.state.finger_name(finger).to_string();
        both.studio.send(ViewCommand::SelectFinger(finger).into());
        both.studio.send(ViewCommand::SelectImprint(source).into());

        both.studio.send(LabelsCommand::AdoptAutomatic.into());
        label(&both, &["--finger", &name, "--imprint", source.key(), "--adopt"]);
        counts.push(same_labels(&both, &twin, &format!("adopted, {what}")));

        let [from, to] = [0, 1].map(|_| [draws.one(20.0..120.0f32).round(), draws.one(20.0..120.0f32).round()]);
        let erase = draws.of(&[true, false]);
        let kind = draws.of(&CleanKind::iter().collect::<Vec<_>>());
        let clean = CleanUp { kind, size_mm: if kind.is_sized() { 1.5 } else { 0.0 } };
        both.studio.send(LabelsCommand::BeginStroke { finger, source, at_px: from, erase }.into());
        both.studio.send(LabelsCommand::StrokeTo(to).into());
        both.studio.send(LabelsCommand::EndStroke.into());
        both.studio.send(LabelsCommand::CleanUp(clean).into());
        let paint = if erase { "free" } else { "contact" };
        let drawing =
            serde_json::json!({"tool": "brush", "radius_px": 3, "paint": paint, "points": [from, to]}).to_string();
        let cleaned = if kind.is_sized() { format!("{}=1.5", kind.key()) } else { kind.key().to_owned() };
        label(&both, &["--finger", &name, "--imprint", source.key(), "--draw", &drawing, "--clean", &cleaned]);
        counts.push(same_labels(&both, &twin, &format!("{drawing}, {cleaned}, {what}")));

        let review = draws.of(&[Review::Done, Review::Flagged, Review::Skip]);
        let pair_name = both.studio.state.pair_name().to_owned();
        both.studio.send(LabelsCommand::SetNote(pair_name, "the edge".into()).into());
        for source in ImprintSource::iter() {
            both.studio.send(LabelsCommand::AcceptPose(source, true).into());
            if results::pose(&both.studio.state, source).ready().is_some() {
                label(&both, &["--accept", source.key()]);
            }
        }
        both.studio.send(LabelsCommand::SetReview(review).into());
        label(&both, &["--note", "the edge", "--review", review.stored()]);
        counts.push(same_labels(&both, &twin, &format!("{review:?}, {what}")));
    }
    compared(&counts, 20_000);
    // The progress is said of both.
    let said = both.run(&["label", &both.path].map(str::to_owned)).unwrap();
    assert_eq!(written(&both.studio.state.document.progress.all), said["counts"]);
}

#[test]
pub(in crate::agreement) fn masks_proposed_by_a_random_recipe_are_those_of_the_verb() {
    let home = tempfile::tempdir().unwrap();
    let mut draws = Draws::new(14);
    let mut counts = Vec::new();
    for at in 0..2 {
        let (mut both, twin) = twins(&home.path().join(format!("{at}")));
        both.show(&[Pane::Measured, Pane::Predicted, Pane::Masks]);
        let sources = [ProposalSource::Automatic, ProposalSource::CadTruth, ProposalSource::CadRegistered];
        let (proposal, mut recipe) = (draws.of(&sources), draws.posed());
        if recipe.mask.source == MaskSource::Truth {
            recipe.mask.source = MaskSource::TopPercent;
        }
        both.studio.send(prefer(move |s| s.mask.proposal = proposal).into());
        both.predict(&recipe, 0);
        let imprint = draws.of(&ImprintSource::iter().collect::<Vec<_>>());
        both.studio.send(ViewCommand::SelectImprint(imprint).into());
        both.studio.send(ViewCommand::Propose(true).into());
        both.studio.send(LabelsCommand::AcceptProposal.into());
        let what = format!("{proposal:?} {imprint:?}, {recipe:?}: {:?}", both.studio.state.log.entries.back());
        let finger = both.studio.state.finger_name(both.studio.state.selection.finger).to_string();
        let pair = both.studio.state.pair_name();
        let begin = ["label", &both.path, "--pair", pair, "--finger", &finger, "--propose", proposal.key()];
        let words = recipe::in_force(&both.studio.state, imprint).until(Stage::Pose).words(Stage::Pose).list();
        let imprint = ["--imprint", imprint.key()];
        let all = begin.iter().chain(&imprint).map(|word| (*word).to_owned()).chain(words).collect::<Vec<_>>();
        both.run(&all).unwrap_or_else(|err| panic!("{what}: {err}"));
        counts.push(same_labels(&both, &twin, &what));
    }
    compared(&counts, 20_000);
}
