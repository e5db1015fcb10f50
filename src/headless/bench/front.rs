//! The error-against-time front: which engines are neither slower nor worse than another, and its picture.

use serde::Serialize;

use super::canvas::{Anchor, Canvas, Colour, text_width};
use super::registration::EngineRow;

/// An engine as a point of the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FrontPoint {
    pub(super) name: String,
    pub(super) peer: bool,
    /// What the picture shows: the mean processor time of a pose where it is known of all engines, else the median of
    /// the clock. On a busy machine the clock charges long runs for other programs' work.
    pub(super) ms: f64,
    pub(super) mean_deg: f64,
    pub(super) median_deg: f64,
    /// Whether no other engine is at least as fast and as accurate in the mean, and better in one of the two.
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

/// Whether the system told the processor time of every engine.
pub(super) fn uses_processor_time(rows: &[EngineRow]) -> bool {
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

const INK: Colour = [30, 34, 40];
const FAINT: Colour = [222, 226, 230];
const MUTED: Colour = [105, 112, 122];
const OURS: Colour = [28, 100, 200];
const PEER: Colour = [205, 95, 20];
const FRONT: Colour = [60, 150, 90];
const WIDTH: u32 = 1000;
const HEIGHT: u32 = 620;
const LEFT: f32 = 80.0;
const RIGHT: f32 = 970.0;
const TOP: f32 = 70.0;
const BOTTOM: f32 = 540.0;
/// Height of a capital letter.
const LETTER: f32 = 9.5;

/// Maps an engine's numbers to the picture.
struct Axes {
    low: f64,
    high: f64,
    most: f64,
}

impl Axes {
    fn new(points: &[FrontPoint]) -> Self {
        let fold = |f: fn(f64, f64) -> f64, start: f64| points.iter().map(|p| p.ms.max(1e-6)).fold(start, f);
        let (low, high) = (fold(f64::min, f64::INFINITY).log10().floor(), fold(f64::max, 1e-6).log10().ceil());
        let most = points.iter().map(|p| p.mean_deg.max(p.median_deg)).fold(0.0, f64::max);
        let low = if low.is_finite() { low } else { -2.0 };
        // Room on the right for the names of the slowest.
        Self { low, high: high.max(low + 1.0) + 0.5, most: (most * 1.15).max(0.5) }
    }

    fn x(&self, ms: f64) -> f32 {
        let share = (ms.max(1e-6).log10() - self.low) / (self.high - self.low);
        LEFT + (RIGHT - LEFT) * share as f32
    }

    fn y(&self, deg: f64) -> f32 {
        BOTTOM - (BOTTOM - TOP) * (deg / self.most) as f32
    }
}

/// What stands around the picture.
pub(super) struct Axis<'a> {
    pub(super) title: &'a str,
    /// Of the axis of time.
    pub(super) time: &'a str,
    /// Behind the numbers of the axis of the error.
    pub(super) unit: &'a str,
    /// The colours in words.
    pub(super) legend: &'a [(Colour, &'a str)],
}

/// The legend of [`draw`] where other projects' libraries are among the points.
pub(super) const PEERS: [(Colour, &str); 2] = [(OURS, "this program"), (PEER, "peers (Python)")];

/// The picture: mean error (disc) and median error (ring) over the time on a logarithmic axis.
pub(super) fn draw(axis: &Axis<'_>, points: &[FrontPoint], default: &str) -> Canvas {
    let mut c = Canvas::new(WIDTH, HEIGHT);
    let axes = Axes::new(points);
    grid(&mut c, axis, &axes);

    // The front is a staircase: what is reached when one may spend this much time.
    let steps: Vec<[f32; 2]> =
        points.iter().filter(|p| p.on_front).map(|p| [axes.x(p.ms), axes.y(p.mean_deg)]).collect();
    for pair in steps.windows(2) {
        c.line(pair[0], [pair[1][0], pair[0][1]], 2.0, FRONT);
        c.line([pair[1][0], pair[0][1]], pair[1], 2.0, FRONT);
    }
    if let (Some(first), Some(last)) = (steps.first(), steps.last()) {
        c.line([first[0], TOP], *first, 2.0, FRONT);
        c.line(*last, [RIGHT, last[1]], 2.0, FRONT);
    }

    let mut taken: Vec<[f32; 4]> = Vec::new();
    for p in points {
        let (x, mean, median) = (axes.x(p.ms), axes.y(p.mean_deg), axes.y(p.median_deg));
        taken.push([x - 7.0, mean - 7.0, x + 7.0, mean + 7.0]);
        taken.push([x - 5.0, median - 5.0, x + 5.0, median + 5.0]);
    }
    // The staircase is in the way of labels, too.
    for pair in steps.windows(2) {
        taken.push([pair[0][0], pair[0][1] - 2.0, pair[1][0], pair[0][1] + 2.0]);
        taken.push([pair[1][0] - 2.0, pair[0][1].min(pair[1][1]), pair[1][0] + 2.0, pair[0][1].max(pair[1][1])]);
    }
    if let (Some(first), Some(last)) = (steps.first(), steps.last()) {
        taken.push([first[0] - 2.0, TOP, first[0] + 2.0, first[1]]);
        taken.push([last[0], last[1] - 2.0, RIGHT, last[1] + 2.0]);
    }
    for p in points {
        let colour = if p.peer { PEER } else { OURS };
        let (x, mean, median) = (axes.x(p.ms), axes.y(p.mean_deg), axes.y(p.median_deg));
        c.line([x, mean], [x, median], 1.0, colour);
        c.disc([x, median], 4.5, colour);
        c.disc([x, median], 3.0, [255; 3]);
        if p.name == default {
            c.disc([x, mean], 10.0, colour);
            c.disc([x, mean], 8.0, [255; 3]);
        }
        c.disc([x, mean], 6.0, colour);
    }
    for p in points {
        let colour = if p.peer { PEER } else { OURS };
        let (x, mean) = (axes.x(p.ms), axes.y(p.mean_deg));
        let label = if p.name == default { format!("{} (default)", p.name) } else { p.name.clone() };
        let at = place(&label, [x, mean], &mut taken);
        // A label that had to give way is joined to its point.
        let (right, middle) = (at[0] > x, at[1] - 0.5 * LETTER);
        if (middle - mean).abs() > 10.0 {
            let end = if right { at[0] - 2.0 } else { at[0] + text_width(&label, LETTER) };
            c.line([x, mean], [end, middle], 0.7, MUTED);
        }
        // White behind the letters, where lines of other engines pass.
        let width = text_width(&label, LETTER);
        c.line([at[0], middle], [at[0] + width - 3.0, middle], LETTER + 5.0, [255; 3]);
        c.text(at, LETTER, Anchor::Start, colour, label);
    }
    c
}

/// Where a label fits beside its point without covering what is there already; `taken` gains its box.
fn place(label: &str, point: [f32; 2], taken: &mut Vec<[f32; 4]>) -> [f32; 2] {
    let width = text_width(label, LETTER);
    let candidates = (0..14).flat_map(|i| {
        let shift = [0.0, -16.0, 16.0, -32.0, 32.0, -48.0, 48.0, -64.0, 64.0, -80.0, 80.0, -96.0, 96.0, -112.0][i];
        let y = point[1] + 0.5 * LETTER + shift;
        [[point[0] + 13.0, y], [point[0] - 13.0 - width, y]]
    });
    let frame = |at: [f32; 2]| [at[0] - 2.0, at[1] - LETTER - 3.0, at[0] + width + 2.0, at[1] + 4.0];
    let fits = |at: &[f32; 2]| {
        let [left, top, right, bottom] = frame(*at);
        left > LEFT
            && right < WIDTH as f32 - 4.0
            && top > TOP - 20.0
            && bottom < BOTTOM
            && taken.iter().all(|t| right < t[0] || left > t[2] || bottom < t[1] || top > t[3])
    };
    let at = candidates.clone().find(fits).unwrap_or([point[0] + 13.0, point[1] + 0.5 * LETTER]);
    taken.push(frame(at));
    at
}

fn grid(c: &mut Canvas, axis: &Axis<'_>, axes: &Axes) {
    c.text([LEFT, 30.0], 11.0, Anchor::Start, INK, axis.title);
    let mut x = LEFT;
    for &(colour, text) in axis.legend {
        c.disc([x + 5.0, 50.0], 5.0, colour);
        c.text([x + 16.0, 54.0], LETTER, Anchor::Start, MUTED, text);
        x += 40.0 + text_width(text, LETTER);
    }
    c.text([x, 54.0], LETTER, Anchor::Start, MUTED, "disc: mean, ring: median, line: front of the means");
    let mut decade = axes.low;
    while decade <= axes.high {
        let ms = 10f64.powf(decade);
        for step in 1..10 {
            let x = axes.x(ms * f64::from(step));
            if x <= RIGHT {
                c.line([x, TOP], [x, BOTTOM], if step == 1 { 1.0 } else { 0.4 }, FAINT);
            }
        }
        c.text([axes.x(ms), BOTTOM + 20.0], LETTER, Anchor::Middle, INK, format!("{ms}"));
        decade += 1.0;
    }
    let step =
        [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().find(|s| axes.most / s < 9.0).unwrap_or(100.0);
    let mut deg = 0.0;
    while deg <= axes.most {
        let y = axes.y(deg);
        c.line([LEFT, y], [RIGHT, y], 1.0, FAINT);
        c.text([LEFT - 8.0, y + 0.5 * LETTER], LETTER, Anchor::End, INK, format!("{deg:.1}{}", axis.unit));
        deg += step;
    }
    c.line([LEFT, TOP], [LEFT, BOTTOM], 1.5, INK);
    c.line([LEFT, BOTTOM], [RIGHT, BOTTOM], 1.5, INK);
    let middle = 0.5 * (LEFT + RIGHT);
    c.text([middle, BOTTOM + 50.0], 10.5, Anchor::Middle, INK, axis.time);
    c.text([12.0, TOP - 8.0], LETTER, Anchor::Start, INK, "error");
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

    #[test]
    fn labels_do_not_cover_each_other() {
        let mut taken = Vec::new();
        let spots: Vec<[f32; 2]> = (0..5).map(|_| place("engine", [400.0, 300.0], &mut taken)).collect();
        for (i, a) in spots.iter().enumerate() {
            assert!(spots[..i].iter().all(|b| a != b), "{spots:?}");
        }
        let axis = Axis { title: "t", time: "ms", unit: " mm", legend: &PEERS };
        let svg = draw(&axis, &pareto(vec![point("one", 0.1, 0.7), point("two", 200.0, 5.0)]), "one").svg();
        assert!(svg.contains("one (default)") && svg.contains(">two<") && svg.contains("1.0 mm"));
        // No engine at all is a picture, too.
        assert!(draw(&axis, &[], "one").svg().contains("</svg>"));
    }
}
