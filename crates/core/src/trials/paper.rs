//! Published trials, on a real robot.

use serde::Serialize;

use super::count::Share;

/// A count that the paper published.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Published {
    /// The task and the thing that was held.
    pub what: &'static str,
    /// Trials that succeeded; the interval is ours.
    pub share: Share,
}

/// The paper's trials with its diffusion model, on an arm with real GelSlims. Hole, clearance and compliance of that robot are
/// not known here, nor which of the three unseen patterns is which.
pub fn published() -> [Published; 5] {
    [
        ("insertion, first unseen tool", 18),
        ("insertion, second unseen tool", 10),
        ("insertion, third unseen tool", 15),
        ("insertion, pencil", 21),
        ("cup stacking", 22),
    ]
    .map(|(what, hits)| Published { what, share: Share::new(hits, 30) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_add_up_to_the_papers_86_of_150() {
        let (hits, of) = published().iter().fold((0, 0), |(hits, of), p| (hits + p.share.hits, of + p.share.of));
        assert_eq!((hits, of), (86, 150));
    }
}
