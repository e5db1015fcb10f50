//! `touch2touch label`: masks drawn or proposed, review states and accepted poses, as the studio stores them.

mod args;
mod report;

use serde_json::json;
use strum::IntoEnumIterator as _;

use super::{VerbResult, find_pair};
use touch2touch_pipeline::io::dataset::Dataset;
use touch2touch_pipeline::labels::progress::Progress;
use touch2touch_pipeline::labels::{Labels, Review, take_in};
use touch2touch_pipeline::masks::label_pair::{Begin, LabelSetup, label_pair};
use touch2touch_pipeline::pairs::pads_named;

pub(super) use args::LabelArgs;
use report::Stored;

pub(super) fn run(args: &LabelArgs) -> VerbResult {
    if args.pose.is_some() && args.accept.is_none() && args.propose.is_none() {
        anyhow::bail!(
            "--pose alone changes nothing: name the imprint that it is accepted of (--accept), or --propose cad_hand"
        );
    }
    let dataset = args.dataset.open()?;
    let labels = Labels::of(&dataset);
    let output = args.dataset.output("", 0);
    let folder = labels.folder()?.to_owned();
    let (mut pairs, mut complete) = (Vec::new(), true);
    if let Some(kept) = &args.take_in {
        let found = take_in(&dataset, &labels, kept)?;
        found.text().into_iter().for_each(|text| output.note(&text));
        found.failed.iter().for_each(|err| output.note(&err.to_string()));
        complete = found.failed.is_empty();
    }
    if let Some(name) = &args.pair {
        let id = find_pair(&dataset, name)?;
        let entry = &dataset.index.pairs[id.0 as usize];
        labels.journal_problem(&entry.name).into_iter().for_each(|err| output.note(&format!("note: {err}")));
        let stored = label_pair(&dataset, &labels, id, &setup(args, &dataset)?, &args.recipe.model.models())?;
        pairs.push(Stored::new(&entry.name, &stored, &dataset));
    } else {
        for entry in &dataset.index.pairs {
            match labels.load(&entry.name) {
                Ok(stored) if stored.is_empty() => {}
                Ok(stored) => pairs.push(Stored::new(&entry.name, &stored, &dataset)),
                Err(err) => {
                    output.note(&format!("{}: {err}", entry.name));
                    complete = false;
                }
            }
        }
    }
    let counts = Progress::of(&dataset.index.pairs, &labels.reviews().states).all;
    output.finish(&json!({"folder": folder, "pairs": pairs, "counts": counts}), || {
        let lines: Vec<String> = pairs.iter().map(Stored::text).collect();
        let counted = |review: Review| format!("{} {}", counts.of(review), review.name());
        let states: Vec<String> = Review::iter().map(counted).collect();
        let (labeled, folder) = (lines.len(), folder.display());
        format!("{}\n{labeled} labeled pairs in {folder}; of all pairs {}", lines.join("\n"), states.join(", "))
    })?;
    Ok(complete)
}

/// The arguments as a value. The models of a recipe are looked for where it decides something.
fn setup(args: &LabelArgs, dataset: &Dataset) -> anyhow::Result<LabelSetup> {
    let begin = match (args.remove_mask, args.adopt, args.propose) {
        (true, ..) => Begin::Removed,
        (_, true, _) => Begin::Adopted,
        (_, _, Some(source)) => Begin::Proposed { source, over_drawn: args.over_drawn },
        _ => Begin::AsTheyAre,
    };
    let setup = LabelSetup {
        imprint: args.imprint,
        pads: pads_named(&dataset.rig, &args.finger).map_err(anyhow::Error::msg)?,
        begin,
        draw: args.draw.clone(),
        clean: args.clean.clone(),
        withdraw: args.withdraw,
        accept: args.accept,
        pose: args.pose,
        review: args.review,
        note: args.note.clone(),
        person: args.person.clone(),
        ..LabelSetup::default()
    };
    if !setup.asks_recipe() {
        return Ok(setup);
    }
    let recipe = args.recipe.of(setup.farthest(), &dataset.rig)?;
    Ok(LabelSetup { recipe, ..setup })
}
