//! [`Observer`]: what follows a generation from outside, and the pictures on the way.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use super::decode;
use crate::infer::bundle::GeneratorSpec;
use crate::infer::engine::Graph;
use touch2touch_core::diffusion::{Progress, Tensor, Watch};
use touch2touch_core::postprocess::RawPrediction;

/// Follows a generation. Every closure from [`Progress`] to [`ControlFlow`] is one that wants no previews.
pub trait Observer {
    /// Called before each step and once at the end; `Break` cancels within one step.
    fn progress(&mut self, progress: Progress) -> ControlFlow<()>;

    /// True where a picture of `item`, as the model sees it after these steps, would be looked at now. Nothing is
    /// computed for an answer of `false`.
    fn wants_preview(&mut self, after: Progress, item: usize) -> bool {
        let _ = (after, item);
        false
    }

    /// The picture of `item` as the model sees it after these steps.
    fn preview(&mut self, after: Progress, item: usize, raw: RawPrediction) {
        let _ = (after, item, raw);
    }
}

impl<F: FnMut(Progress) -> ControlFlow<()>> Observer for F {
    fn progress(&mut self, progress: Progress) -> ControlFlow<()> {
        self(progress)
    }
}

/// Previews after the first may take this share of the time so far: they must not delay the result noticeably.
const SHARE: f64 = 0.1;

/// Decodes what the observer wants to see.
pub(super) struct Watching<'a> {
    observer: &'a mut dyn Observer,
    decoder: &'a mut Graph,
    spec: &'a GeneratorSpec,
    items: usize,
    started: Instant,
    /// Time spent on previews, and on the last one.
    spent: Duration,
    last: Duration,
    wanted: Vec<usize>,
}

impl<'a> Watching<'a> {
    pub(super) fn new(
        observer: &'a mut dyn Observer,
        decoder: &'a mut Graph,
        spec: &'a GeneratorSpec,
        items: usize,
    ) -> Self {
        let (started, spent, last) = (Instant::now(), Duration::ZERO, Duration::ZERO);
        Self { observer, decoder, spec, items, started, spent, last, wanted: Vec::new() }
    }
}

impl Watch for Watching<'_> {
    fn progress(&mut self, progress: Progress) -> ControlFlow<()> {
        self.observer.progress(progress)
    }

    fn wants_estimate(&mut self, after: Progress) -> bool {
        // What is left of the run, judged by the pace so far, counts as well: a long run can afford more pictures.
        let steps = self.started.elapsed().saturating_sub(self.spent).as_secs_f64();
        let whole = steps * f64::from(after.of) / f64::from(after.step.max(1));
        if !self.spent.is_zero() && (self.spent + self.last).as_secs_f64() > SHARE * whole {
            return false;
        }
        let observer = &mut self.observer;
        self.wanted = (0..self.items).filter(|item| observer.wants_preview(after, *item)).collect();
        !self.wanted.is_empty()
    }

    fn estimate(&mut self, after: Progress, clean: &Tensor) {
        let begin = Instant::now();
        let latents: Vec<Tensor> = self.wanted.iter().filter_map(|item| clean.item(*item)).collect();
        let decoded = Tensor::stack(&latents).map(|latents| decode(self.decoder, self.spec, latents, &mut 1));
        match decoded {
            Some(Ok(pictures)) => {
                for (item, raw) in self.wanted.drain(..).zip(pictures) {
                    self.observer.preview(after, item, raw);
                }
            }
            // The result itself goes through the same graph and says what is wrong.
            Some(Err(err)) => log::debug!("no preview after step {}: {err}", after.step),
            None => {}
        }
        self.last = begin.elapsed();
        self.spent += self.last;
    }
}
