use super::*;
use crate::ops::{Weights, blend, line, linear, mul};
use crate::random::{Purpose, Random};
use crate::state::{Origin, OriginBuilder};

/// A network that is none: a vector that should equal another one, seen through random numbers. Nothing here knows of
/// the generator.
struct Vector;

const TRUTH: [f32; 3] = [1.0, -2.0, 0.5];

impl Objective for Vector {
    type Part = Vec<f32>;

    fn rate(&self, name: &str) -> Option<Rate> {
        (name == "vector").then_some(Rate { rate: 0.05, decay: 0.0, anchor: 0.0 })
    }

    fn part(&self, step: usize, places: Range<usize>) -> Vec<f32> {
        Random::new(1, Purpose::Batch, step, places.start).normals(3)
    }

    fn loss(&self, leaves: &Leaves<'_>, part: Vec<f32>) -> Tensor {
        let difference = blend(&leaves.get("vector"), 1.0, &Tensor::new(&[3], TRUTH.to_vec()), -1.0);
        let seen = mul(&difference, &Tensor::new(&[3], part));
        sum(&line(&mul(&seen, &seen), 0.25, 0.0))
    }
}

fn sum(x: &Tensor) -> Tensor {
    let count = x.values().len();
    let (ones, zero) = (Tensor::new(&[count, 1], vec![1.0; count]), Tensor::new(&[1], vec![0.0]));
    linear(&x.clone().reshaped(&[1, count]), &ones, &zero, Weights::InOut)
}

fn trainer(threads: usize, steps: usize) -> Trainer<Vector> {
    let mut start = Params::default();
    start.push("vector", vec![3], vec![0.0; 3]);
    start.push("fixed", vec![2], vec![7.0; 2]);
    Trainer::new(Vector, start, 4, steps, Some(threads))
}

fn origin(name: &str) -> Origin {
    OriginBuilder::default().bytes(name.as_bytes()).finish()
}

#[test]
fn any_objective_is_descended() {
    let mut trainer = trainer(2, 300);
    let mut losses: Vec<f32> = (0..300).map(|_| trainer.step().unwrap().loss).collect();
    assert!(losses.split_off(290).iter().sum::<f32>() < 1e-2 * losses[..10].iter().sum::<f32>());
    let average = &trainer.average.get("vector").unwrap().values;
    assert!(average.iter().zip(TRUTH).all(|(f, t)| (f - t).abs() < 0.02), "{average:?}");
    assert_eq!(trainer.average.get("fixed").unwrap().values.as_slice(), [7.0; 2]);
    assert_eq!(trainer.step(), Err(Error::Done(300)));
}

#[test]
fn a_state_goes_on_and_a_strange_one_is_refused() {
    let mut whole = trainer(1, 20);
    for _ in 0..20 {
        whole.step().unwrap();
    }
    let mut first = trainer(3, 20);
    for _ in 0..7 {
        first.step().unwrap();
    }
    let bytes = first.to_bytes(origin("a"));
    let mut second = trainer(2, 20);
    second.restore(origin("a"), &bytes).unwrap();
    assert_eq!(second.step, 7);
    for _ in 7..20 {
        second.step().unwrap();
    }
    assert!(second.to_bytes(origin("a")) == whole.to_bytes(origin("a")));

    let refused = |bytes: &[u8], name| {
        let mut fresh = trainer(1, 20);
        let why = fresh.restore(origin(name), bytes).unwrap_err().to_string();
        assert!(fresh.to_bytes(origin("a")) == trainer(1, 20).to_bytes(origin("a")));
        why
    };
    assert!(refused(&bytes, "b").contains("another bundle"));
    assert!(refused(b"something else entirely", "a").contains("not a state"));
    for cut in 0..bytes.len() {
        refused(&bytes[..cut], "a");
        let mut changed = bytes.clone();
        changed[cut] ^= 0x10;
        refused(&changed, "a");
    }
}

/// An objective whose loss becomes NaN at a step.
struct Broken;

impl Objective for Broken {
    type Part = f32;

    fn rate(&self, _: &str) -> Option<Rate> {
        Some(Rate { rate: 0.1, decay: 0.0, anchor: 0.0 })
    }

    fn part(&self, step: usize, places: Range<usize>) -> f32 {
        if (step, places.start) == (2, 1) { f32::NAN } else { 1.0 }
    }

    fn loss(&self, leaves: &Leaves<'_>, part: f32) -> Tensor {
        let x = leaves.get("x");
        line(&mul(&x, &x), part, 0.0)
    }
}

#[test]
fn a_loss_that_is_no_number_leaves_the_weights_alone() {
    let mut start = Params::default();
    start.push("x", vec![1], vec![1.0]);
    let mut trainer = Trainer::new(Broken, start, 2, 9, Some(2));
    for _ in 0..2 {
        trainer.step().unwrap();
    }
    let before = trainer.to_bytes(origin("x"));
    assert_eq!(trainer.step(), Err(Error::Diverged { step: 3 }));
    assert!(trainer.to_bytes(origin("x")) == before);
}
