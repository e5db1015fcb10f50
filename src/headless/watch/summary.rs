//! Times of a run of `watch`.

use serde::Serialize;
use serde_json::{Value, json};

/// Times of the stages of one touch, milliseconds.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub(super) struct Latency {
    /// From the file's last change to its being found whole.
    pub found: f64,
    /// Reading it.
    pub load: f64,
    /// The generator, both fingers, up to meters.
    pub generate: f64,
    /// The contact masks.
    pub mask: f64,
    /// The pose.
    pub pose: f64,
    /// Writing the result, the JSON included.
    pub write: f64,
    /// From the file's last change to the result on the disk.
    pub total: f64,
}

impl Latency {
    /// Without the wait before it was found.
    fn work(&self) -> f64 {
        self.load + self.generate + self.mask + self.pose + self.write
    }
}

/// Counts and times of a run.
#[derive(Debug, Default)]
pub(super) struct Summary {
    fresh: Vec<Latency>,
    backlog: Vec<Latency>,
    skipped: usize,
    failed: usize,
}

impl Summary {
    pub(super) fn add(&mut self, latency: &Latency, fresh: bool) {
        if fresh { &mut self.fresh } else { &mut self.backlog }.push(*latency);
    }

    pub(super) fn skip(&mut self) {
        self.skipped += 1;
    }

    pub(super) fn fail(&mut self) {
        self.failed += 1;
    }

    pub(super) fn failed(&self) -> usize {
        self.failed
    }

    /// Median, 95th percentile and largest of a time.
    fn figures(times: impl Iterator<Item = f64>) -> Option<[f64; 3]> {
        let mut times: Vec<f64> = times.collect();
        times.sort_by(f64::total_cmp);
        let last = times.len().checked_sub(1)?;
        // Nearest rank: a time that was measured, not one in between.
        let rank = |share: f64| times[((share * times.len() as f64).ceil() as usize).clamp(1, times.len()) - 1];
        Some([rank(0.5), rank(0.95), times[last]])
    }

    fn stages(list: &[Latency]) -> Value {
        let of = |get: fn(&Latency) -> f64| {
            Self::figures(list.iter().map(get))
                .map(|[median, p95, max]| json!({"median": median, "p95": p95, "max": max}))
        };
        json!({
            "touches": list.len(), "found": of(|l| l.found), "load": of(|l| l.load), "generate": of(|l| l.generate),
            "mask": of(|l| l.mask), "pose": of(|l| l.pose), "write": of(|l| l.write), "work": of(Latency::work),
            "total": of(|l| l.total),
        })
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "event": "summary", "done": self.fresh.len() + self.backlog.len(), "skipped": self.skipped,
            "failed": self.failed,
            // Touches that lay there before have no latency that means something.
            "latency_ms": Self::stages(&self.fresh), "existing_ms": Self::stages(&self.backlog),
        })
    }

    pub(super) fn text(&self) -> String {
        let mut text =
            format!("{} done, {} skipped, {} failed", self.fresh.len() + self.backlog.len(), self.skipped, self.failed);
        if let Some([median, p95, max]) = Self::figures(self.fresh.iter().map(|l| l.total)) {
            text += &format!(
                "\nlatency, file closed to result written, {} touches: median {median:.0} ms, p95 {p95:.0} ms, worst {max:.0} ms",
                self.fresh.len()
            );
        }
        if let Some([median, p95, _]) = Self::figures(self.backlog.iter().map(Latency::work)) {
            text += &format!(
                "\nwork on {} touches that lay there: median {median:.0} ms, p95 {p95:.0} ms each",
                self.backlog.len()
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_times_that_were_measured() {
        assert_eq!(Summary::figures(std::iter::empty()), None);
        assert_eq!(Summary::figures([7.0].into_iter()), Some([7.0; 3]));
        assert_eq!(Summary::figures((1..=100).rev().map(f64::from)), Some([50.0, 95.0, 100.0]));
        assert_eq!(Summary::figures((1..=20).map(f64::from)), Some([10.0, 19.0, 20.0]));
    }
}
