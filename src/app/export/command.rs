//! The command that does in a shell what a pane shows: [`equivalent`].

use super::super::keys::{ImprintSource, ShiftMode};
use super::super::pane::{Kind, Pane};
use super::super::state::State;
use super::super::state::learn::{AdaptPairs, Network};
use super::super::state::library::Place;
use super::super::{learn, recipe, results};
use touch2touch_core::dataset::PairId;
use touch2touch_core::frames::PlanarPose;
use touch2touch_core::pose::Registration;
use touch2touch_pipeline::compare::subject::{RecipeChange, Subject};
use touch2touch_pipeline::learn::train::MasksFrom;
use touch2touch_pipeline::steps::bundles::BundleKind;
use touch2touch_pipeline::steps::recipe::{Recipe, Stage, Words, quoted};

fn command(verb: &str) -> Words {
    Words::default().word("touch2touch").word(verb)
}

/// A start as `--start` reads it: degrees and twice millimeters.
fn start_text(start: PlanarPose) -> String {
    let degrees = read_as(start.theta_rad, start.theta_rad.to_degrees(), f64::to_radians);
    let [y_mm, z_mm] = [start.y_m, start.z_m].map(|length_m| read_as(length_m, length_m * 1e3, |mm| mm * 1e-3));
    format!("{degrees},{y_mm},{z_mm}")
}

/// A number at or beside `near` that is read as exactly this value, a short one first; `near` where there is none.
fn read_as(value: f64, near: f64, read: impl Fn(f64) -> f64) -> f64 {
    let short = (near * 1e9).round() / 1e9;
    [short, near, near.next_up(), near.next_down()].into_iter().find(|n| read(*n) == value).unwrap_or(near)
}

/// The words of the command that does what a pane shows, with the settings in force; `None` for panes that only choose.
pub fn equivalent_words(state: &State, pane: Pane) -> Option<Vec<String>> {
    let open = state.library.open.as_ref()?;
    let path = match &open.place {
        Place::Demo => "demo".to_owned(),
        // Never taken for an option.
        Place::Path(path) if path.to_string_lossy().starts_with('-') => format!("./{}", path.display()),
        Place::Path(path) => path.display().to_string(),
    };
    let verb = |verb: &str| command(verb).word(&path);
    let of_pair = |name: &str| Some(verb(name).option("--pair", state.entry()?.name.clone()));
    let side = pane.side().unwrap_or(state.inspect.source);
    let drawn = || recipe_shown(state, ImprintSource::Predicted).words(Stage::Imprint);
    let posed = |words: Words, side: ImprintSource| {
        words.option("--imprint", side.key()).then(recipe_shown(state, side).until(Stage::Pose).words(Stage::Pose))
    };
    let words = match (pane, pane.kind()) {
        (Pane::Browser | Pane::Log, _) => verb("doctor"),
        (_, Kind::Scene) => posed(of_pair("export")?.option("--out", "exported"), state.workbench.side),
        (Pane::Steps, _) => {
            let start = state.inspect.start.map(|start| start_text(start.get()));
            posed(of_pair("pose")?, side).option_if("--start", start).word("--trace").word("--json")
        }
        (Pane::Metrics, _) => {
            let recipe = recipe_shown(state, ImprintSource::Predicted);
            of_pair("pose")?.option("--imprint", "both").then(recipe.words(Stage::Pose))
        }
        (Pane::Generate | Pane::Predicted, _) => {
            of_pair("generate")?.option("--finger", "both").option("--out", "predictions").then(drawn())
        }
        (Pane::Compare, _) => {
            let chosen = state.settings.compared();
            of_pair("compare")?
                .option("--a", placed(state, &chosen.a))
                .option("--b", placed(state, &chosen.b))
                .then(recipe_shown(state, ImprintSource::Predicted).words(Stage::Pose))
        }
        (Pane::Masks, _) => of_pair("label")?,
        (Pane::Results, _) => {
            let mut words = verb("evaluate");
            for (bundle, _) in results::evaluated(state).filter(|(_, chosen)| *chosen) {
                words = words.option("--bundle", bundle.origin.path().display());
            }
            // Each bundle draws with its own choices.
            let recipe = Recipe { generator: None, ..recipe::in_force(state, ImprintSource::Predicted) };
            words.word_if(state.table.published, "--paper").then(recipe.words(Stage::Pose))
        }
        (Pane::Adapt, _) if state.learn.shown == Network::Generator => {
            let (setup, form) = (learn::adapt_setup(state)?, state.learn.form);
            let words = verb("adapt").option("--out", "fitted");
            let words = words.option_if("--tune", form.tune.then_some(form.tuning_steps));
            let words = match form.pairs {
                AdaptPairs::All => words,
                AdaptPairs::Done | AdaptPairs::Listed => words.option("--pairs", names(state, setup.pairs)?),
            };
            // The fit is of what the exact inverse gives, and of no hand.
            words.then(Recipe { shift: ShiftMode::default(), ..setup.recipe.clone() }.words(Stage::Pose))
        }
        (Pane::Adapt, _) => train_words(state, command("masks").word("train").word(&path)),
        _ => return None,
    };
    Some(words.list())
}

fn train_words(state: &State, words: Words) -> Words {
    let (form, by) = (state.learn.form, state.settings.registration);
    let words = words
        .option_if("--steps", form.by_steps.then_some(form.steps))
        .option_if("--minutes", (!form.by_steps).then_some(form.minutes))
        .option("--held-out", form.choice.held_out_percent)
        .option("--seed", form.choice.seed)
        .word_if(form.choice.test_in_train, "--test-in-train")
        .option_if("--from", (form.choice.from != MasksFrom::default()).then(|| form.choice.from.key()))
        .option_if("--engine", (by != Registration::default()).then_some(by));
    let words = words.runtime(state.settings.runtime);
    match (&state.settings.mask.bundle, recipe::bundle(state, BundleKind::Mask)) {
        (Some(_), Ok(bundle)) => words.option("--start", bundle.origin.path().display()),
        _ => words,
    }
}

/// [`equivalent_words`] as one line for a shell.
pub fn equivalent(state: &State, pane: Pane) -> Option<String> {
    let words: Vec<String> = equivalent_words(state, pane)?.iter().map(|word| quoted(word)).collect();
    Some(words.join(" "))
}

/// A subject with the folder of its bundle in place of the bundle's name.
fn placed(state: &State, subject: &Subject) -> Subject {
    let placed = |change: &RecipeChange| {
        let bundle = change.bundle.as_ref().map(|name| {
            let found = state.library.bundles.iter().find(|bundle| bundle.name == *name);
            found.map_or_else(|| name.clone(), |bundle| bundle.origin.path().display().to_string())
        });
        RecipeChange { bundle, ..change.clone() }
    };
    match subject {
        Subject::Predicted(change) => Subject::Predicted(placed(change)),
        Subject::Mean(change, seeds) => Subject::Mean(placed(change), *seeds),
        other => other.clone(),
    }
}

/// The recipe of what is shown of an imprint: by the prediction on screen, or the one that would be made.
pub(super) fn recipe_shown(state: &State, imprint: ImprintSource) -> Recipe {
    let finger = state.selection.finger;
    let shown = results::chosen(state, finger).cloned().or_else(|| recipe::prediction(state, state.touch_key(finger)?));
    let shown = shown.and_then(|key| Some((state.library.bundle(&key.bundle)?.clone(), key)));
    let recipe = recipe::in_force(state, imprint);
    match shown {
        Some((bundle, key)) => Recipe { generator: Some((bundle.into(), key.config)), engine: key.runtime, ..recipe },
        None => Recipe { generator: None, ..recipe },
    }
}

/// The names of these pairs, as one word; `None` where there are none.
fn names(state: &State, pairs: impl IntoIterator<Item = PairId>) -> Option<String> {
    let all = &state.library.open.as_ref()?.source.dataset.index.pairs;
    let names: Vec<&str> = pairs.into_iter().filter_map(|id| Some(all.get(id.0 as usize)?.name.as_str())).collect();
    (!names.is_empty()).then(|| names.join(","))
}
