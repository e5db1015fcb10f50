//! The error-against-time front: which engines are neither slower nor worse than another.

use serde::Serialize;

use super::rows::EngineRow;

/// An engine as a point of the front.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FrontPoint {
    pub(super) name: String,
    pub(super) peer: bool,
    /// Time, milliseconds: the mean processor time of a pose where it is known of all engines,
    /// else the median of the clock. On a busy machine the clock charges long runs for other programs' work.
    pub(super) ms: f64,
    pub(super) mean_deg: f64,
    pub(super) median_deg: f64,
    /// True where no other engine is at least as fast and as accurate in the mean, and better in one of the two.
    pub(super) on_front: bool,
}

/// The engines that have times and errors, fastest first.
pub(super) fn front(rows: &[EngineRow]) -> Vec<FrontPoint> {
    let by_processor = uses_processor_time(rows);
    let points = rows.iter().filter_map(|row| {
        let f = &row.summary.all;
        Some(FrontPoint {
            name: row.name.clone(),
            peer: row.peer,
            ms: if by_processor { row.cpu_mean_ms? } else { f.median_ms? },
            mean_deg: f.angles.mean_deg?,
            median_deg: f.angles.median_deg?,
            on_front: false,
        })
    });
    pareto(points.collect())
}

/// True where the system told the processor time of every engine.
fn uses_processor_time(rows: &[EngineRow]) -> bool {
    rows.iter().all(|row| row.cpu_mean_ms.is_some_and(|ms| ms > 0.0))
}

pub(super) fn pareto(mut points: Vec<FrontPoint>) -> Vec<FrontPoint> {
    points.sort_by(|a, b| a.ms.total_cmp(&b.ms).then(a.mean_deg.total_cmp(&b.mean_deg)));
    let mut best = f64::INFINITY;
    for point in &mut points {
        point.on_front = point.mean_deg < best;
        best = best.min(point.mean_deg);
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(name: &str, ms: f64, mean_deg: f64) -> FrontPoint {
        FrontPoint { name: name.into(), peer: false, ms, mean_deg, median_deg: 0.5 * mean_deg, on_front: false }
    }

    #[test]
    fn only_engines_that_nothing_beats_are_on_the_front() {
        let points = pareto(vec![
            point("slow", 100.0, 0.4),
            point("bad", 50.0, 5.0),
            point("fast", 0.1, 0.7),
            point("same", 0.1, 0.9),
        ]);
        let on: Vec<&str> = points.iter().filter(|p| p.on_front).map(|p| p.name.as_str()).collect();
        assert_eq!(on, ["fast", "slow"]);
        assert!(!points[1].on_front && points[1].name == "same");
    }
}
