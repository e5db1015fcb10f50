//! The generator as a whole, on the tiny bundle of `tests/data/bundles`: batches, previews, what is kept on
//! the disk, and inputs that make no sense (row E22 of the list of numerical failures, from image to picture).

use std::ops::ControlFlow;
use std::path::Path;

use rayon::prelude::*;
use strum::IntoEnumIterator as _;
use touch2touch::app::services::Services;
use touch2touch_core::diffusion::{GenerateConfig, Progress, Sampler, Spacing};
use touch2touch_core::grid::{Grid, RgbGrid};
use touch2touch_core::postprocess::RawPrediction;
use touch2touch_pipeline::infer::bundle::Bundle;
use touch2touch_pipeline::infer::engine::EngineChoice;
use touch2touch_pipeline::infer::generator::{GenerateError, Generator, Item, Observer};
use touch2touch_pipeline::job::JobCx;
use touch2touch_pipeline::steps::bundles::{self, BundleInfo};
use touch2touch_pipeline::steps::models::{GenerateInput, Generating, Models};

use crate::models::running::{config, go_on, largest_difference};
use crate::support::tiny;

fn open(dir: &Path) -> Generator {
    Generator::open(&Bundle::open(dir).unwrap(), EngineChoice::Rten).unwrap()
}

fn image(phase: f32) -> RgbGrid {
    Grid::from_fn(43, 32, |x, y| {
        let bar = if (x + y / 2) % 20 < 5 { 40.0 } else { 0.0 };
        [bar, -bar * 0.5, (x as f32 * 0.3 + phase).sin() * 10.0]
    })
}

/// How often each graph ran: condition encoder, denoiser, decoder.
fn runs(generator: &mut Generator) -> [u64; 3] {
    generator.graphs().map(|graph| graph.runs())
}

#[test]
fn each_image_is_encoded_once_however_many_seeds_it_has() {
    let mut generator = open(&tiny("generator"));
    let (a, b) = (image(0.0), image(1.0));
    let items: Vec<Item> = [1, 2, 3].iter().flat_map(|&seed| [0, 1].map(|image| Item { image, seed })).collect();
    let made = generator.run(&[&a, &b], &items, &config(), &mut go_on).unwrap();
    assert_eq!(runs(&mut generator), [2, 36, 6], "two images; six steps and one decoding for each item");
    for (item, found) in items.iter().zip(&made) {
        let alone = GenerateConfig { seed: item.seed, ..config() };
        let expected = generator.generate([&a, &b][item.image], &alone, &mut go_on).unwrap();
        assert_eq!(*found, expected, "to the last bit, whatever it is made with");
    }
    // A seed more needs no more encoding, and an image without items none at all.
    assert_eq!(runs(&mut generator)[0], 2);
    generator.run(&[&image(2.0), &a], &[Item { image: 1, seed: 9 }], &config(), &mut go_on).unwrap();
    assert_eq!(runs(&mut generator)[0], 2);
    let missing = generator.run(&[&a], &[Item { image: 1, seed: 0 }], &config(), &mut go_on);
    assert!(matches!(missing, Err(GenerateError::NoImage { image: 1, images: 1 })));
}

/// Looks at one item after every other step; breaks where told.
struct Looker {
    item: usize,
    seen: Vec<(u32, RawPrediction)>,
    stop_at: u32,
}

impl Observer for Looker {
    fn progress(&mut self, p: Progress) -> ControlFlow<()> {
        if p.step == self.stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn wants_preview(&mut self, after: Progress, item: usize) -> bool {
        assert!(after.step < after.of, "the last step has a result, not a preview");
        item == self.item && after.step == 1
    }

    fn preview(&mut self, after: Progress, item: usize, raw: RawPrediction) {
        assert_eq!(item, self.item);
        self.seen.push((after.step, raw));
    }
}

#[test]
fn previews_show_what_is_coming_and_change_nothing() {
    let mut generator = open(&tiny("generator"));
    let items = [0, 1].map(|image| Item { image, seed: 7 });
    for sampler in Sampler::iter() {
        let config = GenerateConfig { sampler, ..config() };
        let (a, b) = (image(0.0), image(1.0));
        let plain = generator.run(&[&a, &b], &items, &config, &mut go_on).unwrap();
        let before = runs(&mut generator)[2];
        let mut looker = Looker { item: 1, seen: Vec::new(), stop_at: u32::MAX };
        let watched = generator.run(&[&a, &b], &items, &config, &mut looker).unwrap();
        assert_eq!(plain, watched, "{sampler:?}: looking changes nothing");
        let (step, raw) = &looker.seen[0];
        assert_eq!((looker.seen.len(), *step, raw.channels.len()), (1, 1, 3));
        assert_eq!(runs(&mut generator)[2], before + 3, "one preview and both results");
        assert!(raw.channels.iter().flat_map(|c| c.as_slice()).all(|v| v.is_finite()));
        // The estimate of the first of one step is the result of one step.
        let one = GenerateConfig { steps: 1, ..config };
        let result = generator.run(&[&b], &items[..1], &one, &mut go_on).unwrap();
        assert!(largest_difference(raw, &result[0]) < 1e-4, "{sampler:?}");
        let mut stopped = Looker { item: 0, seen: Vec::new(), stop_at: 3 };
        let cancelled = generator.run(&[&a, &b], &items, &config, &mut stopped);
        assert!(matches!(cancelled, Err(GenerateError::Cancelled)));
    }
}

/// Row E22: alpha bar of 0 and 1, few and many steps, every eta; and images that no camera takes.
#[test]
fn e22_every_input_gives_finite_pictures_or_a_clear_error() {
    let mut generator = open(&tiny("generator"));
    let huge = |v: f32| Grid::filled(43, 32, [v, -v, v]);
    let images = [huge(0.0), huge(255.0), huge(-255.0), huge(1e-30), huge(1e30), huge(f32::MAX), image(0.0)];
    for image in &images {
        for sampler in Sampler::iter() {
            for (steps, eta) in [(1, 0.0), (1, 1.0), (2, 0.3), (7, 1.0), (40, 0.0)] {
                for spacing in [Spacing::Lab, Spacing::Trailing] {
                    let config = GenerateConfig { steps, eta, sampler, spacing, ..Default::default() };
                    match generator.generate(image, &config, &mut go_on) {
                        Ok(raw) => assert!(raw.channels.iter().flat_map(|c| c.as_slice()).all(|v| v.is_finite())),
                        Err(GenerateError::Model(err)) => {
                            assert!(err.to_string().contains("not numbers"), "{err}");
                            assert!(image[(0, 0)][0].abs() >= 1e30, "an ordinary image must give a picture");
                        }
                        Err(err) => panic!("{err}"),
                    }
                }
            }
        }
    }
    // All the steps of the training, once: the longest run there is.
    let all = GenerateConfig { steps: 1000, eta: 1.0, ..Default::default() };
    let raw = generator.generate(&image(0.0), &all, &mut go_on).unwrap();
    assert!(raw.channels.iter().flat_map(|c| c.as_slice()).all(|v| v.is_finite()));
    for (bad, at) in [(f32::NAN, (0, 0)), (f32::INFINITY, (42, 31)), (f32::NEG_INFINITY, (7, 7))] {
        let mut holes = image(0.0);
        holes[at][1] = bad;
        let text = generator.generate(&holes, &config(), &mut go_on).unwrap_err().to_string();
        assert!(text.contains("43 x 32") && text.contains("1 values that are not numbers"), "{text}");
    }
    for size in [[1, 1], [1, 500], [3000, 2]] {
        let odd = Grid::from_fn(size[0], size[1], |x, y| [x as f32 % 9.0, y as f32 % 5.0, 1.0]);
        assert!(generator.generate(&odd, &config(), &mut go_on).is_ok(), "{size:?}");
    }
}

fn bundle() -> BundleInfo {
    bundles::find(&[tiny("generator")])
        .bundles
        .into_iter()
        .find(|b| b.name == "Tiny generator of the tests")
        .expect("the fixture is a generator")
}

#[test]
fn a_prediction_is_found_again_after_a_restart_and_never_for_another_image() {
    let folder = tempfile::tempdir().unwrap();
    let start = || Services::with_config_folder(Some(folder.path().to_owned()));
    let cx = JobCx::unwatched();
    let (a, b) = (image(0.0), image(1.0));
    let services = start();
    let info = bundle();
    let choices = config();
    let generating = Generating { bundle: &info, engine: EngineChoice::Rten, config: &choices };
    let item = |seed, difference| GenerateInput { difference, seed, size: [0, 0] };
    assert!(services.models.kept(std::slice::from_ref(&info), EngineChoice::Rten, &a).is_empty());
    let both = [item(1, &a), item(1, &b)];
    let made = services.models.predict(generating, &both, &cx).unwrap();
    assert!(made.iter().all(|m| !m.kept));

    let again = start();
    let found = again.models.predict(generating, &both, &cx).unwrap();
    assert!(found.iter().all(|m| m.kept), "read, not made");
    for (made, found) in made.iter().zip(&found) {
        assert_eq!(made.raw, found.raw);
        assert_eq!(made.chains.keys().collect::<Vec<_>>(), found.chains.keys().collect::<Vec<_>>());
    }
    let listed = again.models.kept(std::slice::from_ref(&info), EngineChoice::Rten, &a);
    let [kept] = &listed[..] else { panic!("{listed:?}") };
    assert_eq!((&kept.prediction.bundle, kept.engine), (&info.id, EngineChoice::Rten));
    assert_eq!(kept.config, GenerateConfig { seed: 1, ..config() });
    // The same pair and finger with another image (another data set of the same names) is another touch.
    assert!(again.models.kept(std::slice::from_ref(&info), EngineChoice::Rten, &image(2.0)).is_empty());
    let another = image(2.0);
    let other = again.models.predict(generating, &[item(1, &another)], &cx).unwrap();
    assert!(!other[0].kept && other[0].raw != made[0].raw);
    // Half known, half new: only the new one is made. Another engine's results are not taken for this one's.
    let half = again.models.predict(generating, &[item(2, &a), item(1, &b)], &cx).unwrap();
    assert!(!half[0].kept && half[1].kept);
    assert_eq!(again.models.kept(std::slice::from_ref(&info), EngineChoice::Rten, &a).len(), 2);
    assert!(again.models.kept(&[], EngineChoice::Rten, &a).is_empty(), "its bundle is gone");

    // Damaged files are not there; a budget of nothing keeps nothing.
    for entry in std::fs::read_dir(folder.path().join("predictions")).unwrap() {
        std::fs::write(entry.unwrap().path(), "not a prediction").unwrap();
    }
    let services = start();
    let mut settings = services.load_settings().0;
    settings.cache_mib = 0;
    services.save_settings(&settings).unwrap();
    let made_again = services.models.predict(generating, &both, &cx).unwrap();
    assert!(made_again.iter().all(|m| !m.kept) && made_again[0].raw == made[0].raw);
    assert!(services.models.kept(std::slice::from_ref(&info), EngineChoice::Rten, &a).is_empty());
}

/// A thread of a pool takes on other work while it waits for the engine; that work wants the same model.
#[test]
fn many_threads_of_a_pool_predict_and_mask_with_one_model() {
    let (done, told) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        let models = Models::new(None);
        let bundle = |name| BundleInfo::of(&Bundle::open(&tiny(name)).unwrap());
        let (generator, mask) = (bundle("generator"), bundle("mask"));
        let difference = image(0.0);
        let predicted = |seed| {
            let wanted = [GenerateInput { difference: &difference, seed, size: [0, 0] }];
            let generating = Generating { bundle: &generator, engine: EngineChoice::Rten, config: &config() };
            models.predict(generating, &wanted, &JobCx::unwatched()).unwrap().remove(0).raw
        };
        let alone: Vec<RawPrediction> = (0..32).map(predicted).collect();
        let together: Vec<RawPrediction> = (0..32).into_par_iter().map(predicted).collect();
        assert_eq!(alone, together);
        let imprint = Grid::from_fn(175, 140, |x, y| if (60..90).contains(&x) && y > 40 { 0.01 } else { 0.0 });
        let masked = |_| models.mask(&mask, EngineChoice::Rten, &imprint).unwrap();
        assert!((0..32).into_par_iter().map(masked).collect::<Vec<_>>().windows(2).all(|pair| pair[0] == pair[1]));
        done.send(()).unwrap();
    });
    told.recv_timeout(std::time::Duration::from_secs(60)).expect("no thread waits for another for ever");
}
