//! From effects to jobs.

use std::path::PathBuf;
use std::sync::Arc;

use super::super::answers::Answer;
use super::super::effect::{Effect, LabelsToSave, NotSaved};
use super::super::jobs::{Body, Lane};
use super::super::labels::state::Merged;
use super::super::results::Preview;
use super::super::results::prediction::generate;
use super::super::results::preview::{Onlooker, PreviewSink};
use super::super::services::DataSource;
use super::super::tasks::state::Ticket;
use super::super::view::state::UiRequest;
use super::lanes::{Event, Job};
use super::{JobId, Runtime, lock};
use touch2touch_core::dataset::PairId;
use touch2touch_core::rig::PerPad;
use touch2touch_core::sample::Sample;
use touch2touch_work::adapt;
use touch2touch_work::bundles;
use touch2touch_work::error::TaskError;
use touch2touch_work::evaluate;
use touch2touch_work::figure::figure;
use touch2touch_work::import::import_masks;
use touch2touch_work::infer::bundle::Ends;
use touch2touch_work::io::folders;
use touch2touch_work::job::{Cancel, JobCx};
use touch2touch_work::models::Wanted;
use touch2touch_work::pairs;
use touch2touch_work::statistics::{PAIRS, StatisticsSetup, statistics};

/// A place as the system knows it, whatever folder the program was started in: what a note says must be found again.
fn absolute(place: PathBuf) -> PathBuf {
    std::path::absolute(&place).unwrap_or(place)
}

impl Runtime {
    pub(super) fn perform(&mut self, effect: Effect, ui: &mut Vec<UiRequest>) {
        match effect {
            Effect::Ui(request) => ui.push(request),
            Effect::Open { ticket, seq, place } => {
                let services = self.services.clone();
                let what = format!("Open {place}");
                let body =
                    Box::new(move |_: &JobCx| Ok(Answer::Opened(ticket, seq, place.clone(), services.open(&place)?)));
                self.task(Lane::Files, ticket, what, body);
            }
            Effect::Follow(of) => self.follow(of),
            Effect::FindBundles(folders) => {
                let services = self.services.clone();
                // On the lane of the models: hashing them must not hold up the files.
                self.unwatched(
                    Lane::Models,
                    JobId::Bundles,
                    "Look for model bundles",
                    Box::new(move |_| {
                        let (bundles, problems) = services.find_bundles(&folders);
                        Ok(Answer::Bundles(bundles, problems))
                    }),
                );
            }
            Effect::Generate { ticket, recipes, bundle, source, sample } => {
                let services = self.services.clone();
                let what = format!("Generate with {}", bundle.name);
                let (wish, latest, wake) = (self.preview_wish.clone(), self.previews.clone(), self.wake.clone());
                let body: Body<Answer> = Box::new(move |cx| {
                    let show: PreviewSink = Arc::new(move |preview: Preview| {
                        lock(&latest).insert(preview.recipe.touch, (ticket, Arc::new(preview)));
                        wake();
                    });
                    let onlooker = Some(Onlooker { wish, sink: show });
                    let made = generate(&*services, recipes, &bundle, &*source, sample, cx, onlooker)?;
                    Ok(Answer::Generated(ticket, made))
                });
                self.task(Lane::Models, ticket, what, body);
            }
            Effect::Refit { ticket, recipe, bundle, source } => {
                let services = self.services.clone();
                let body: Body<Answer> = Box::new(move |cx| {
                    let pairs = pairs::spread(source.index().pairs.len(), Some(PAIRS));
                    let rig = source.rig();
                    let fail = |err| TaskError::from_error("Shift statistics", &err);
                    let ends = bundle.ends(&rig).transpose().map_err(fail)?;
                    let no_generator = || TaskError::new("Shift statistics", "the bundle is not a generator");
                    let setup = StatisticsSetup {
                        pairs: pairs.map(|at| PairId(at as u32)).collect(),
                        fingers: rig.pad_list(),
                        input: ends.ok_or_else(no_generator)?.input,
                        config: recipe.config(),
                        dataset: source.title().to_owned(),
                        bundle,
                    };
                    let predict = |wanted: Wanted<'_>, cx: &JobCx| {
                        let made = services.predict(&setup.bundle, recipe.runtime, &setup.config, &[wanted], cx)?;
                        made.into_iter().next().ok_or_else(|| TaskError::new("Shift statistics", "no answer"))
                    };
                    let load = |pair| source.load(pair).map(Arc::new);
                    let (found, _) = statistics(&setup, load, predict, cx)?;
                    let saved = services.save_statistics(&found)?;
                    Ok(Answer::Refitted(ticket, Box::new(found), saved.map(|file| file.display().to_string())))
                });
                self.task(Lane::Models, ticket, "Shift statistics".into(), body);
            }
            Effect::Cancel(ticket) => {
                if let Some(cancel) = self.cancels.get(&ticket) {
                    cancel.cancel();
                }
                // One that waits ends at once, not when its turn comes.
                if let Some(job) = self.lanes.withdraw(&JobId::Task(ticket)) {
                    let answer = (job.failed)(TaskError::cancelled(job.what));
                    drop(self.sender.send(Event { id: job.id, answer }));
                    (self.wake)();
                }
            }
            Effect::SaveLabels(source, save) => self.save_labels(source, *save),
            Effect::KeepLabels { source, unsaved, folder, revisions } => {
                self.kept += 1;
                self.unwatched(
                    Lane::Files,
                    JobId::KeepLabels(self.kept),
                    "Keep the labels elsewhere",
                    Box::new(move |_| {
                        let folder = source.keep_labels(&unsaved, folder.as_deref())?;
                        Ok(Answer::LabelsKept(revisions, folder))
                    }),
                );
            }
            Effect::SaveSettings(settings) => {
                let services = self.services.clone();
                self.unwatched(
                    Lane::Files,
                    JobId::SaveSettings,
                    "Save the preferences",
                    Box::new(move |_| {
                        services.save_settings(&settings)?;
                        Ok(Answer::SettingsSaved)
                    }),
                );
            }
            Effect::SetUnit { ticket, seq, source, tool, unit, replacing } => {
                let what = format!("Read {tool} in {}", unit.name());
                let body = Box::new(move |_: &JobCx| {
                    Ok(Answer::UnitSet(ticket, seq, source.set_tool_unit(&tool, unit, replacing.as_deref())?))
                });
                self.task(Lane::Files, ticket, what, body);
            }
            Effect::Evaluate { ticket, source, setup } => {
                let services = self.services.clone();
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Evaluate")?;
                    let evaluation = Arc::new(services.evaluate(dataset, &setup, cx)?);
                    Ok(Answer::Evaluated(ticket, evaluation))
                });
                self.task(Lane::Batch, ticket, "Evaluate".into(), body);
            }
            Effect::Sweep { ticket, source, setup } => {
                let services = self.services.clone();
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Dial")?;
                    Ok(Answer::Swept(ticket, Arc::new(services.sweep(dataset, &setup, cx)?)))
                });
                self.task(Lane::Batch, ticket, "Dial".into(), body);
            }
            Effect::ProposeAll { ticket, source, setup } => {
                let services = self.services.clone();
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Propose masks")?;
                    Ok(Answer::ProposedAll(ticket, Box::new(services.propose_all(dataset, &setup, cx)?)))
                });
                self.task(Lane::Batch, ticket, "Propose masks".into(), body);
            }
            Effect::Adapt { ticket, source, setup } => {
                let services = self.services.clone();
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Fit the model")?;
                    let (adapted, bundle) = services.adapt(dataset, &setup, cx)?;
                    Ok(Answer::Adapted(ticket, Arc::new(adapted), bundle.map(Box::new)))
                });
                self.task(Lane::Batch, ticket, "Fit the model".into(), body);
            }
            Effect::KeepFit { ticket, adapted } => {
                let body = Box::new(move |_: &JobCx| {
                    let kept = adapt::keep(&adapted)?;
                    let folder = kept.bundle.as_deref();
                    let bundle = folder.map(|folder| bundles::open("Open the fitted bundle", folder)).transpose()?;
                    Ok(Answer::Adapted(ticket, Arc::new(kept), bundle.map(Box::new)))
                });
                self.task(Lane::Batch, ticket, "Keep the fit".into(), body);
            }
            Effect::Train { ticket, source, labels, setup } => {
                let services = self.services.clone();
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Train the mask model")?;
                    let (trained, bundle) = services.train(dataset, &labels, &setup, cx)?;
                    Ok(Answer::Trained(ticket, Arc::new(trained), Box::new(bundle)))
                });
                self.task(Lane::Batch, ticket, "Train the mask model".into(), body);
            }
            Effect::ExportTable { ticket, evaluation, published, folder } => {
                let body = Box::new(move |_: &JobCx| {
                    let folder = evaluate::export(&evaluation, published, &absolute(folder))?;
                    let line = format!("Wrote evaluation.csv, .md, .tex and .json to {}", folder.display());
                    Ok(Answer::Saved(ticket, line, folder))
                });
                self.task(Lane::Files, ticket, "Export the table".into(), body);
            }
            Effect::Figure { ticket, source, setup, recipes, file } => {
                let (services, file) = (self.services.clone(), absolute(file));
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Figure")?;
                    let predict = |pair: PairId, sample: &Arc<Sample>, cx: &JobCx| {
                        let mut made = PerPad::default();
                        for (key, bundle) in recipes.iter().filter(|(of, _)| *of == pair).flat_map(|(_, list)| list) {
                            let finger = key.touch.finger;
                            let ends = bundle.ends(&sample.rig).and_then(Result::ok);
                            let input = |end: Ends| sample.pad(finger)?.picture(end.input).map(drop);
                            if ends.and_then(input).is_none() {
                                continue;
                            }
                            let one = vec![key.clone()];
                            let found = generate(&*services, one, bundle, &*source, Some(sample.clone()), cx, None)?;
                            made[finger] = found.into_iter().next().map(|(_, made)| Arc::unwrap_or_clone(made));
                        }
                        Ok(made)
                    };
                    let written = figure(dataset, &setup, predict, cx)?.write(&file)?;
                    let [width, height] = written.size_px;
                    let text = format!("Saved {} ({width} x {height} pixels)", file.display());
                    Ok(Answer::Saved(ticket, text, file))
                });
                self.task(Lane::Models, ticket, "Figure".into(), body);
            }
            Effect::ExportPair { ticket, pair, folder } => {
                let body = Box::new(move |_: &JobCx| {
                    let files = pair.write(&absolute(folder))?;
                    let names = files.iter().filter_map(|file| file.file_name()).map(|name| name.to_string_lossy());
                    let text = format!("Saved {}", names.collect::<Vec<_>>().join(", "));
                    let first = files.into_iter().next().unwrap_or_default();
                    Ok(Answer::Saved(ticket, text, first))
                });
                self.task(Lane::Compute, ticket, "Export the pair".into(), body);
            }
            Effect::SaveCase { ticket, source, setup, file } => {
                let (services, file) = (self.services.clone(), absolute(file));
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Case")?;
                    services.make_case(dataset, &setup, &file, cx)?;
                    Ok(Answer::Saved(ticket, format!("Saved {}", file.display()), file))
                });
                self.task(Lane::Models, ticket, "Save the case".into(), body);
            }
            Effect::Reveal(place) => {
                self.unwatched(
                    Lane::Files,
                    JobId::Reveal,
                    "Show the folder",
                    Box::new(move |_| {
                        folders::reveal(&place).map_err(|err| {
                            TaskError::new("Show the folder", format!("{err} ({})", place.display()))
                                .with_hint("Copy the path instead.")
                        })?;
                        Ok(Answer::Revealed)
                    }),
                );
            }
            Effect::ImportMasks { ticket, source, mut setup } => {
                let body = Box::new(move |cx: &JobCx| {
                    let dataset = source.on_disk("Import masks")?;
                    setup.from = absolute(setup.from);
                    Ok(Answer::Imported(ticket, Box::new(import_masks(dataset, &setup, cx)?)))
                });
                self.task(Lane::Files, ticket, "Import masks".into(), body);
            }
            Effect::ExportMasks { ticket, source, labels, choice, folder } => {
                let body = Box::new(move |cx: &JobCx| {
                    let folder = absolute(folder);
                    let line = source.export_masks(&labels, choice, &folder, cx)?;
                    Ok(Answer::Saved(ticket, line, folder))
                });
                self.task(Lane::Compute, ticket, "Export masks".into(), body);
            }
        }
    }

    fn save_labels(&self, source: Arc<dyn DataSource>, save: LabelsToSave) {
        let not = NotSaved { source: source.clone(), save: save.clone(), err: TaskError::new("", "") };
        let body: Body<Answer> = Box::new(move |_| {
            let now = match &save.repeat {
                None => source.save_labels(&save.name, &save.labels, &save.deed)?,
                Some(person) => {
                    source.save_repeat(person, &save.name, &save.labels, &save.deed)?;
                    None
                }
            };
            let LabelsToSave { name, revision, labels: given, .. } = save;
            let merged = now.map(|now| Box::new(Merged { given, now }));
            Ok(Answer::LabelsSaved(name, revision, merged))
        });
        let id = JobId::SaveLabels(not.save.seq, not.save.name.clone());
        let failed = Box::new(move |err| Answer::LabelsFailed(Box::new(NotSaved { err, ..not })));
        let what = "Save the labels".to_owned();
        self.lanes.submit(Lane::Files, Job { id, what, cx: JobCx::unwatched(), body, failed });
    }

    /// Queues a job that a person started.
    fn task(&mut self, lane: Lane, ticket: Ticket, what: String, body: Body<Answer>) {
        let cancel = Cancel::default();
        self.cancels.insert(ticket, cancel.clone());
        let (latest, wake) = (self.progress.clone(), self.wake.clone());
        let sink = Arc::new(move |progress| {
            // Only the first since the last round wakes: the rest is picked up with it.
            if lock(&latest).insert(ticket, progress).is_none() {
                wake();
            }
        });
        self.lanes.submit(
            lane,
            Job {
                id: JobId::Task(ticket),
                what,
                cx: JobCx::new(cancel, sink),
                body,
                failed: Box::new(move |err| Answer::TaskFailed(ticket, err)),
            },
        );
    }

    /// Queues a job that shows no progress.
    fn unwatched(&self, lane: Lane, id: JobId, what: &str, body: Body<Answer>) {
        let failed = Box::new(Answer::JobFailed);
        self.lanes.submit(lane, Job { id, what: what.to_owned(), cx: JobCx::unwatched(), body, failed });
    }
}
