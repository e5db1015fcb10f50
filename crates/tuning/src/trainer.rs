//! [`Trainer`]: descends any [`Objective`], whatever network it is about.
//!
//! A batch comes in parts of fixed size. Each has a graph of its own, several run side by side, and what they return is
//! added in their order: the result does not depend on how many cores there are.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};
use crate::optim::{AdamW, Rate, follow, norm, ramp};
use crate::params::{Leaves, Params};
use crate::tape::{Tensor, backward};

/// Parts of a batch. Fixed: their number decides the order of additions, and so the last bits.
const PARTS: usize = 4;

/// Objective: the loss that is to be made small.
pub(crate) trait Objective: Sync {
    /// A part of a batch, ready to be run.
    type Part: Send;

    /// Rate at which an array learns; `None` for one that stays as it is.
    fn rate(&self, name: &str) -> Option<Rate>;

    /// A part of the batch of a step, counted from 0: that of these places. Depends on nothing but its arguments.
    fn part(&self, step: usize, places: Range<usize>) -> Self::Part;

    /// The part's share of the loss: the sum over the parts is the loss of the batch.
    fn loss(&self, leaves: &Leaves<'_>, part: Self::Part) -> Tensor;
}

/// A run that is made step by step and can be kept in between: [`crate::Tuner`], [`crate::MaskTuner`].
pub trait Descent {
    /// One step.
    ///
    /// # Errors
    /// [`Error::Done`] after the last step of the plan; [`Error::Diverged`] where the loss is not a number, with
    /// everything as it was before.
    fn step(&mut self) -> Result<StepReport>;

    /// Steps done.
    fn steps_done(&self) -> usize;

    /// Steps of the plan.
    fn steps(&self) -> usize;

    /// The whole state of the run. Write it to another file and rename that.
    fn to_bytes(&self) -> Vec<u8>;
}

/// [`Descent`] of a type with a `trainer` and the `origin` of its state.
macro_rules! descend {
    ($of:ty) => {
        impl $crate::Descent for $of {
            fn step(&mut self) -> $crate::Result<$crate::trainer::StepReport> {
                self.trainer.step()
            }

            fn steps_done(&self) -> usize {
                self.trainer.step
            }

            fn steps(&self) -> usize {
                self.trainer.steps
            }

            fn to_bytes(&self) -> Vec<u8> {
                self.trainer.to_bytes(self.origin)
            }
        }
    };
}
pub(crate) use descend;

/// Report of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Steps done, this one included.
    pub step: usize,
    /// The loss before the step.
    pub loss: f32,
}

/// Weights on their way down.
#[derive(Debug)]
pub(crate) struct Trainer<O> {
    pub(crate) objective: O,
    batch: usize,
    /// Steps of the whole plan; the rates follow it.
    pub(crate) steps: usize,
    rates: Vec<Option<Rate>>,
    /// The weights before the first step.
    pub(crate) start: Params,
    pub(crate) params: Params,
    /// The running mean of the weights: what the descent is for.
    pub(crate) average: Params,
    pub(crate) optimizer: AdamW,
    pub(crate) step: usize,
    pub(crate) workers: Workers,
}

type Gradient = Vec<Option<Vec<f32>>>;

impl<O: Objective> Trainer<O> {
    /// Before the first step. Without a number of threads, as many as there are cores; the result does not depend on it.
    pub(crate) fn new(objective: O, start: Params, batch: usize, steps: usize, threads: Option<usize>) -> Self {
        let rates: Vec<Option<Rate>> = start.entries().iter().map(|entry| objective.rate(&entry.name)).collect();
        let optimizer = AdamW::new(&start, &rates);
        let threads = threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get));
        // More threads than parts of a batch would have nothing to do.
        let workers = Workers::new(threads.clamp(1, PARTS));
        let (params, average) = (start.clone(), start.clone());
        Self { objective, batch, steps, rates, start, params, average, optimizer, step: 0, workers }
    }

    /// One step down.
    ///
    /// # Errors
    /// [`Error::Done`] after the last one, and [`Error::Diverged`] where the loss is not a number. The weights are then
    /// those of the step before.
    pub(crate) fn step(&mut self) -> Result<StepReport> {
        if self.step >= self.steps {
            return Err(Error::Done(self.steps));
        }
        let (loss, gradient) = self.slope();
        if !(loss.is_finite() && norm(&gradient).is_finite()) {
            return Err(Error::Diverged { step: self.step + 1 });
        }
        let factor = ramp(self.step, self.steps);
        self.optimizer.step(&mut self.params, &self.start, &gradient, &self.rates, factor);
        follow(&mut self.average, &self.params, self.step);
        self.step += 1;
        Ok(StepReport { step: self.step, loss })
    }

    /// Loss of the next step's batch, and its gradient.
    pub(crate) fn slope(&self) -> (f32, Gradient) {
        let (batch, parts) = (self.batch, PARTS.min(self.batch));
        let run = |part: usize| {
            let places = part * batch / parts..(part + 1) * batch / parts;
            let leaves = self.params.leaves(|name| self.objective.rate(name).is_some());
            let loss = self.objective.loss(&leaves, self.objective.part(self.step, places));
            (loss.values()[0], leaves.gradient(backward(&loss)))
        };
        let mut results = self.workers.run(parts, run).into_iter();
        let Some((mut loss, mut sum)) = results.next() else { return (0.0, vec![None; self.params.entries().len()]) };
        for (value, gradient) in results {
            loss += value;
            for (sum, part) in sum.iter_mut().zip(gradient) {
                add(sum, part);
            }
        }
        (loss, sum)
    }
}

fn add(sum: &mut Option<Vec<f32>>, part: Option<Vec<f32>>) {
    match (sum, part) {
        (Some(sum), Some(part)) => sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part),
        (sum @ None, part) => *sum = part,
        (Some(_), None) => {}
    }
}

/// Pools of one thread each, so that a matrix product within a part stays on its thread.
#[derive(Debug)]
pub(crate) struct Workers {
    pools: Vec<rayon::ThreadPool>,
}

impl Workers {
    fn new(threads: usize) -> Self {
        let pool = |_| {
            let builder = rayon::ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "tuning".to_owned());
            builder.build().expect("the system gives another thread")
        };
        Self { pools: (0..threads).map(pool).collect() }
    }

    /// Runs the numbers below `count`, as many at a time as there are workers; results come in the order of the numbers.
    pub(crate) fn run<T: Send>(&self, count: usize, act: impl Fn(usize) -> T + Sync) -> Vec<T> {
        let next = AtomicUsize::new(0);
        let take = || {
            let mut done = Vec::new();
            loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= count {
                    return done;
                }
                done.push((number, act(number)));
            }
        };
        let mut all: Vec<(usize, T)> = std::thread::scope(|scope| {
            let running: Vec<_> = self.pools.iter().map(|pool| scope.spawn(|| pool.install(take))).collect();
            running
                .into_iter()
                .flat_map(|worker| worker.join().unwrap_or_else(|why| std::panic::resume_unwind(why)))
                .collect()
        });
        all.sort_by_key(|(number, _)| *number);
        all.into_iter().map(|(_, result)| result).collect()
    }
}

#[cfg(test)]
mod tests;
