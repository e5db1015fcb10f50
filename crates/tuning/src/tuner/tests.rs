use super::*;
use crate::Descent as _;
use crate::augment::Augment;
use crate::fixture::{self, run};
use crate::image;

/// A run lives on a thread of its own.
const _: () = {
    const fn moves_between_threads<T: Send + Sync>() {}
    moves_between_threads::<Tuner>();
};

fn tuner(config: Config) -> Tuner {
    Tuner::new(&fixture::start(), fixture::pairs(6), config, None).unwrap()
}

#[test]
fn two_runs_are_alike_to_the_last_bit_on_any_number_of_threads() {
    let config = |threads| Config {
        threads: Some(threads),
        batch: 6,
        simulated: 0.3,
        anchor: 0.1,
        augment: Augment::default(),
        ..fixture::config()
    };
    let (first, losses) = run(tuner(config(1)));
    for threads in [1, 2, 3] {
        let (again, others) = run(tuner(config(threads)));
        assert_eq!(losses, others);
        assert!(first.to_bytes() == again.to_bytes(), "{threads} threads");
        assert!(first.tuned() == again.tuned());
    }
    let (other, _) = run(tuner(Config { seed: 1, ..config(2) }));
    assert!(first.tuned() != other.tuned());
}

#[test]
fn a_run_that_was_stopped_goes_on_as_if_it_had_not_been() {
    let config = || Config { augment: Augment::default(), second: 0.5, simulated: 0.25, ..fixture::config() };
    let (whole, _) = run(tuner(config()));
    for stop in [0, 1, 5, 8] {
        let mut first = tuner(config());
        for _ in 0..stop {
            first.step().unwrap();
        }
        let bytes = first.to_bytes();
        drop(first);
        let resumed = Tuner::new(&fixture::start(), fixture::pairs(6), config(), Some(&bytes)).unwrap();
        assert_eq!(resumed.steps_done(), stop);
        let (resumed, _) = run(resumed);
        assert!(resumed.to_bytes() == whole.to_bytes(), "stopped after {stop}");
        assert!(resumed.tuned() == whole.tuned());
    }
}

#[test]
fn a_state_only_fits_where_it_came_from() {
    let bytes = tuner(fixture::config()).to_bytes();
    let refused = |start: &Start, pairs, config| Tuner::new(start, pairs, config, Some(&bytes)).map(|_| ());
    let (start, pairs, config) = (fixture::start(), fixture::pairs(6), fixture::config());
    // The number of threads may change.
    assert_eq!(refused(&start, pairs.clone(), Config { threads: Some(1), ..config.clone() }), Ok(()));
    let other = Start { mean: [0.0; 3], ..start.clone() };
    assert!(matches!(refused(&other, pairs.clone(), config.clone()), Err(Error::State(_))));
    assert!(matches!(refused(&start, fixture::pairs(5), config.clone()), Err(Error::State(_))));
    assert!(matches!(refused(&start, pairs, Config { steps: 9, ..config }), Err(Error::State(_))));
}

#[test]
fn what_cannot_be_learned_from_is_refused_with_its_index() {
    let refused = |change: &dyn Fn(&mut Pair)| {
        let mut pairs = fixture::pairs(6);
        change(&mut pairs[3]);
        match Tuner::new(&fixture::start(), pairs, fixture::config(), None) {
            Err(Error::Pair { index: 3, why }) => why,
            other => panic!("{:?}", other.map(|_| ())),
        }
    };
    assert!(refused(&|pair| pair.picture[17] = f32::NAN).contains("1 values that are not numbers"));
    assert!(refused(&|pair| pair.imprint[5] = f32::INFINITY).contains("imprint"));
    assert!(refused(&|pair| pair.imprint[5] = 1e9).contains("scale"));
    assert!(refused(&|pair| pair.picture.truncate(3071)).contains("3071 values instead of 3072"));
    assert!(refused(&|pair| pair.frame = Some(2)).contains("pad 2"));

    let new = |pairs| Tuner::new(&fixture::start(), pairs, fixture::config(), None).map(|_| ());
    assert_eq!(new(Vec::new()), Err(Error::NoPairs));
}

#[test]
fn odd_settings_and_starts_are_refused() {
    let no_steps = Config { steps: 0, ..fixture::config() };
    assert!(matches!(
        Tuner::new(&fixture::start(), fixture::pairs(2), no_steps, None),
        Err(Error::Start { what: "steps", .. })
    ));
    let start = |change: &dyn Fn(&mut Start)| {
        let mut start = fixture::start();
        change(&mut start);
        Tuner::new(&start, fixture::pairs(2), fixture::config(), None).map(|_| ())
    };
    assert!(matches!(start(&|s| s.std[1] = 0.0), Err(Error::Start { .. })));
    assert!(matches!(start(&|s| s.unit_m = [1.0, 1.0]), Err(Error::Start { .. })));
    assert!(matches!(start(&|s| s.placement.field[1].truncate(3)), Err(Error::Start { .. })));
    assert!(matches!(start(&|s| s.placement.shift.clear()), Err(Error::Start { .. })));
    assert!(matches!(start(&|s| s.encoder.truncate(1000)), Err(Error::Onnx { .. })));
}

#[test]
fn one_pair_and_equal_pairs_work() {
    let one = fixture::pairs(6).swap_remove(0);
    for pairs in [vec![one.clone()], vec![one.clone(); 3]] {
        let tuner = Tuner::new(&fixture::start(), pairs, fixture::config(), None).unwrap();
        let (tuner, losses) = run(tuner);
        assert!(losses.iter().all(|loss| loss.is_finite()));
        assert!(tuner.predict(&[(&one.picture, Some(0))]).unwrap()[0].iter().all(|v| v.is_finite()));
    }
    // A picture and an imprint without anything on them.
    let blank = Pair { picture: vec![0.0; one.picture.len()], imprint: vec![0.0; one.imprint.len()], ..one };
    let tuner = Tuner::new(&fixture::start(), vec![blank; 2], fixture::config(), None).unwrap();
    assert!(run(tuner).1.iter().all(|loss| loss.is_finite()));
}

#[test]
fn only_what_learns_changes() {
    let start = fixture::start();
    let fixed = Config { shift_rate: 0.0, field_rate: 0.0, line_rate: 0.0, ..fixture::config() };
    assert_eq!(run(tuner(fixed)).0.tuned().placement, start.placement);

    // Simulated pairs alone say nothing about the pads.
    let simulated: Vec<Pair> = fixture::pairs(4).into_iter().map(|pair| Pair { frame: None, ..pair }).collect();
    let tuner = Tuner::new(&start, simulated, Config { decay: 0.0, ..fixture::config() }, None).unwrap();
    let tuned = run(tuner).0.tuned();
    assert_eq!(tuned.placement, start.placement);
    assert!(tuned.decoder != start.decoder);
}

#[test]
fn a_cancelled_run_leaves_a_generator_that_predicts_as_it_did() {
    let mut tuner = tuner(fixture::config());
    let (start, untouched) = (fixture::start(), tuner.tuned());
    assert!(untouched.encoder == start.encoder && untouched.denoiser == start.denoiser);
    assert!(untouched.decoder == start.decoder && untouched.placement == start.placement);
    for _ in 0..3 {
        tuner.step().unwrap();
    }
    let tuned = tuner.tuned();
    let Tuned { encoder, denoiser, decoder, placement } = tuned;
    let start = Start { encoder, denoiser, decoder, placement, ..fixture::start() };
    let again = Tuner::new(&start, fixture::pairs(6), fixture::config(), None).unwrap();
    let pairs = fixture::pairs(6);
    let queries: Vec<Query<'_>> = pairs.iter().map(|pair| (pair.picture.as_slice(), pair.frame)).collect();
    let (before, after) = (tuner.predict(&queries).unwrap(), again.predict(&queries).unwrap());
    assert!(before == after);
    assert_eq!(before.len(), 6);
    // What comes before the placement is the same for all pads.
    let identity = Start { placement: fixture::identity(2, 32), ..start };
    let plain = Tuner::new(&identity, fixture::pairs(6), fixture::config(), None).unwrap();
    let picture = queries[0].0;
    assert_eq!(plain.predict(&[(picture, None)]).unwrap(), plain.predict(&[(picture, Some(1))]).unwrap());
    assert!(matches!(plain.predict(&[(&picture[1..], None)]), Err(Error::Pair { index: 0, .. })));
    assert!(matches!(plain.predict(&[(picture, None), (picture, Some(2))]), Err(Error::Pair { index: 1, .. })));
}

/// The tiny generator's own drawings, moved and with a field on top: what tuning must find is known.
fn placed_pairs(start: &Start, placement: &Placement, count: usize) -> Vec<Pair> {
    let pairs = fixture::pairs(count);
    let tuner = Tuner::new(start, pairs.clone(), fixture::config(), None).unwrap();
    let place = |(i, pair): (usize, Pair)| {
        let pad = i % 2;
        let drawn = tuner.predict(&[(&pair.picture, None)]).unwrap().remove(0);
        let moved = image::shifted(&drawn, 32, placement.shift[pad].map(f64::from));
        let imprint = moved.iter().zip(&placement.field[pad]).map(|(v, f)| v + f).collect();
        Pair { imprint, frame: Some(pad), ..pair }
    };
    pairs.into_iter().enumerate().map(place).collect()
}

/// A file with other values for its weights.
fn changed(bytes: &[u8], change: impl Fn(&str, Vec<f32>) -> Vec<f32>) -> Vec<u8> {
    let file = Onnx::parse(bytes.to_vec()).unwrap();
    file.with(|name| change(name, file.values(file.weights().iter().find(|weight| weight.name() == name).unwrap())))
}

/// The tiny generator with a denoiser that trusts the encoder's estimate, so that what is drawn hardly depends on noise,
/// and a decoder that draws smoothly, as imprints are.
fn smooth() -> Start {
    let start = fixture::start();
    let silent = |name: &str, values: Vec<f32>| if name.starts_with("out.") { vec![0.0; values.len()] } else { values };
    let evened = |name: &str, values: Vec<f32>| match name {
        "decoder.12.weight" | "decoder.14.weight" | "decoder.16.weight" => {
            values.chunks_exact(9).flat_map(|kernel| [kernel.iter().sum::<f32>() / 9.0; 9]).collect()
        }
        _ => values,
    };
    Start { denoiser: changed(&start.denoiser, silent), decoder: changed(&start.decoder, evened), ..start }
}

#[test]
fn a_known_shift_and_field_are_recovered() {
    let start = smooth();
    let bump = |center: [f32; 2], height: f32| -> Vec<f32> {
        let bell = |i: usize| {
            let (y, x) = ((i / 32) as f32 - center[0], (i % 32) as f32 - center[1]);
            height * (-(y * y + x * x) / 40.0).exp()
        };
        (0..32 * 32).map(bell).collect()
    };
    let shift = vec![[1.5, -1.25], [-0.75, 1.0]];
    let truth = Placement { line: [1.0, 0.0], shift, field: vec![bump([10.0, 12.0], 0.1), bump([20.0, 18.0], -0.1)] };
    let pairs = placed_pairs(&start, &truth, 12);
    let config = Config {
        steps: 250,
        network_rate: 0.0,
        line_rate: 0.0,
        shift_rate: 0.05,
        field_rate: 4e-3,
        second: 0.0,
        ..fixture::config()
    };
    let (tuner, losses) = run(Tuner::new(&start, pairs.clone(), config, None).unwrap());
    let mean = |losses: &[f32]| losses.iter().sum::<f32>() / losses.len() as f32;
    assert!(mean(&losses[240..]) < 0.4 * mean(&losses[..10]), "{losses:?}");
    let placement = tuner.tuned().placement;
    for (shift, truth) in placement.shift.iter().flatten().zip(truth.shift.iter().flatten()) {
        assert!((shift - truth).abs() < 0.2, "{:?}", tuner.tuned().placement.shift);
    }
    let error = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>().sqrt();
    for (field, truth) in placement.field.iter().zip(&truth.field) {
        assert!(error(field, truth) < 0.5 * error(&vec![0.0; 32 * 32], truth));
    }
}

#[test]
fn the_loss_falls_when_everything_learns() {
    let config = Config { steps: 60, network_rate: 2e-3, batch: 6, ..fixture::config() };
    let (_, losses) = run(tuner(config));
    let mean = |losses: &[f32]| losses.iter().sum::<f32>() / losses.len() as f32;
    assert!(mean(&losses[50..]) < 0.7 * mean(&losses[..10]), "{losses:?}");
}

#[test]
fn the_shipped_bundle_makes_a_step() {
    let file = |name: &str| {
        std::fs::read(format!("{}/../../assets/models/generator_ldm/{name}.onnx", env!("CARGO_MANIFEST_DIR"))).unwrap()
    };
    let start = Start {
        encoder: file("condition_encoder"),
        denoiser: file("denoiser"),
        decoder: file("decoder"),
        placement: fixture::identity(2, 128),
        ..fixture::start()
    };
    let mut random = fixture::random(4);
    let pair = Pair {
        picture: random.normals(3 * 128 * 128).iter().map(|v| 0.05 * v).collect(),
        imprint: image::blurred(&random.normals(128 * 128), 128, 4.0),
        frame: Some(1),
    };
    let mut tuner = Tuner::new(&start, vec![pair], Config { batch: 1, ..Config::default() }, None).unwrap();
    let report = tuner.step().unwrap();
    assert!(report.loss > 0.0);
    let tuned = tuner.tuned();
    assert!(tuned.decoder != start.decoder && tuned.decoder.len() == start.decoder.len());
}
