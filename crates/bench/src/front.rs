//! The error-against-time front: which engines are neither slower nor worse than another, and its picture.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use serde::Serialize;

use super::rows::EngineRow;
use touch2touch_pipeline::images::canvas::{Drawing, Drawn, Paper};

/// An engine as a point of the picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct FrontPoint {
    pub(super) name: String,
    pub(super) peer: bool,
    /// Time that the picture shows, milliseconds: the mean processor time of a pose where it is known of all engines,
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

pub(super) const INK: RGBColor = RGBColor(30, 34, 40);
pub(super) const FAINT: RGBColor = RGBColor(222, 226, 230);
const MUTED: RGBColor = RGBColor(105, 112, 122);
pub(super) const OURS: RGBColor = RGBColor(28, 100, 200);
pub(super) const PEER: RGBColor = RGBColor(205, 95, 20);
pub(super) const FRONT: RGBColor = RGBColor(60, 150, 90);
/// Height of the letters.
const LETTERS: f64 = 16.0;

/// Texts around the picture.
pub(super) struct Axis<'a> {
    pub(super) title: &'a str,
    /// Title of the axis of time.
    pub(super) time: &'a str,
    /// Unit behind the numbers of the axis of the error.
    pub(super) unit: &'a str,
    /// The colors in words.
    pub(super) legend: &'a [(RGBColor, &'a str)],
}

/// The legend where other projects' libraries are among the points.
pub(super) const PEERS: [(RGBColor, &str); 2] = [(OURS, "this program"), (PEER, "peers (Python)")];

/// The picture: mean error (disc) and median error (ring) over the time on a logarithmic axis.
pub(super) struct Picture<'a> {
    pub(super) axis: Axis<'a>,
    pub(super) points: &'a [FrontPoint],
    /// Name of the point that is marked.
    pub(super) default: &'a str,
}

impl Picture<'_> {
    /// Ends of the axis of time, in decades, and of the axis of the error.
    fn ends(&self) -> ([f64; 2], f64) {
        let fold = |f: fn(f64, f64) -> f64, start: f64| self.points.iter().map(|p| p.ms.max(1e-6)).fold(start, f);
        let (low, high) = (fold(f64::min, f64::INFINITY).log10().floor(), fold(f64::max, 1e-6).log10().ceil());
        let most = self.points.iter().map(|p| p.mean_deg.max(p.median_deg)).fold(0.0, f64::max);
        let low = if low.is_finite() { low } else { -2.0 };
        // Room on the right for the names of the slowest.
        ([low, high.max(low + 1.0) + 0.5], (most * 1.15).max(0.5))
    }

    /// The title and what the colors and marks mean, above the plot.
    fn heading<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
        paper.text([80.0, 16.0], &paper.letters(19.0, INK), self.axis.title)?;
        let style = paper.letters(LETTERS, MUTED).pos(Pos::new(HPos::Left, VPos::Center));
        let mut x = paper.px(80.0);
        let marks = self.axis.legend.iter().map(|(color, text)| (Some(color), *text));
        for (color, text) in marks.chain([(None, "disc: mean, ring: median, line: front of the means")]) {
            if let Some(color) = color {
                paper.area.draw(&Circle::new((x + paper.px(5.0), paper.px(50.0)), paper.wide(5.0), color.filled()))?;
                x += paper.px(16.0);
            }
            paper.area.draw_text(text, &style, (x, paper.px(50.0)))?;
            x += paper.area.estimate_text_size(text, &style)?.0 as i32 + paper.px(24.0);
        }
        Ok(())
    }
}

impl Drawing for Picture<'_> {
    fn size(&self) -> [u32; 2] {
        [1000, 620]
    }

    fn draw<B: DrawingBackend>(&self, paper: &Paper<'_, B>) -> Drawn<B> {
        self.heading(paper)?;
        let ([low, high], most) = self.ends();
        // A little before the first decade, so that rounding does not take its number away.
        let [left, right] = [low - 1e-6, high].map(|decade| 10f64.powf(decade));
        let mut chart = ChartBuilder::on(paper.area)
            .margin_top(paper.px(70.0))
            .margin_left(paper.px(10.0))
            .margin_right(paper.px(30.0))
            .margin_bottom(paper.px(10.0))
            .x_label_area_size(paper.px(60.0))
            .y_label_area_size(paper.px(70.0))
            .build_cartesian_2d((left..right).log_scale(), 0.0..most)?;
        chart
            .configure_mesh()
            .bold_line_style(paper.stroke(FAINT, 1.0))
            .light_line_style(paper.stroke(FAINT, 0.4))
            .x_max_light_lines(10)
            .y_max_light_lines(1)
            .y_labels(8)
            .axis_style(paper.stroke(INK, 1.5))
            .label_style(paper.letters(LETTERS, INK))
            .axis_desc_style(paper.letters(18.0, INK))
            .x_desc(self.axis.time)
            .y_desc("error")
            .x_label_formatter(&|ms| format!("{ms}"))
            .y_label_formatter(&|error| format!("{error:.1}{}", self.axis.unit))
            .draw()?;

        // The front is a staircase: what is reached when one may spend this much time.
        let mut stairs: Vec<(f64, f64)> = Vec::new();
        for p in self.points.iter().filter(|p| p.on_front) {
            stairs.extend([(p.ms, stairs.last().map_or(most, |last| last.1)), (p.ms, p.mean_deg)]);
        }
        stairs.extend(stairs.last().map(|last| (right, last.1)));
        chart.draw_series(LineSeries::new(stairs.iter().copied(), paper.stroke(FRONT, 2.0)))?;

        let colored = || self.points.iter().map(|p| (p, if p.peer { PEER } else { OURS }));
        for (p, color) in colored() {
            let (mean, median) = ((p.ms, p.mean_deg), (p.ms, p.median_deg));
            chart.draw_series([PathElement::new([mean, median], paper.stroke(color, 1.0))])?;
            let mut discs = vec![(median, 4.5, color), (median, 3.0, WHITE), (mean, 6.0, color)];
            if p.name == self.default {
                discs.splice(2..2, [(mean, 10.0, color), (mean, 8.0, WHITE)]);
            }
            let disc =
                |(center, radius, color): (_, _, RGBColor)| Circle::new(center, paper.wide(radius), color.filled());
            chart.draw_series(discs.into_iter().map(disc))?;
        }

        // What labels must not cover: the marks and the staircase.
        let (x, y) = chart.plotting_area().get_pixel_range();
        let mut labels =
            Labels { plot: [x.start, y.start, x.end, y.end], unit: paper.px(1.0).max(1), taken: Vec::new() };
        for p in self.points {
            for (error, radius) in [(p.mean_deg, 7), (p.median_deg, 5)] {
                let (x, y) = chart.backend_coord(&(p.ms, error));
                labels.take((x, y), (x, y), radius);
            }
        }
        for pair in stairs.windows(2) {
            labels.take(chart.backend_coord(&pair[0]), chart.backend_coord(&pair[1]), 2);
        }
        for (p, color) in colored() {
            let point = chart.backend_coord(&(p.ms, p.mean_deg));
            let label = if p.name == self.default { format!("{} (default)", p.name) } else { p.name.clone() };
            let style = paper.letters(LETTERS, color);
            let (w, h) = paper.area.estimate_text_size(&label, &style)?;
            let [left, top, right, bottom] = labels.place([w as i32, h as i32], point);
            // A label that had to give way is joined to its point.
            let middle = (top + bottom) / 2;
            if (middle - point.1).abs() > paper.px(10.0) {
                let end = if left > point.0 { left } else { right };
                paper.area.draw(&PathElement::new([point, (end, middle)], paper.stroke(MUTED, 0.7)))?;
            }
            // White behind the letters, where lines of other engines pass.
            paper.area.draw(&Rectangle::new([(left, top), (right, bottom)], WHITE.filled()))?;
            paper.area.draw_text(&label, &style, (left, top))?;
        }
        Ok(())
    }
}

/// Finds places for labels beside their points; lengths in pixels, boxes as left, top, right, bottom.
struct Labels {
    plot: [i32; 4],
    /// Pixels to a unit.
    unit: i32,
    taken: Vec<[i32; 4]>,
}

impl Labels {
    /// Keeps the box of two corners clear, `margin` units around it.
    fn take(&mut self, a: (i32, i32), b: (i32, i32), margin: i32) {
        let m = margin * self.unit;
        self.taken.push([a.0.min(b.0) - m, a.1.min(b.1) - m, a.0.max(b.0) + m, a.1.max(b.1) + m]);
    }

    /// Place of a label beside its point that covers nothing that is there already.
    fn place(&mut self, [w, h]: [i32; 2], point: (i32, i32)) -> [i32; 4] {
        let (gap, step) = (13 * self.unit, 16 * self.unit);
        let mut places = (0..14).flat_map(|i: i32| {
            let top = point.1 - h / 2 + step * ((i + 1) / 2) * if i % 2 == 1 { -1 } else { 1 };
            [point.0 + gap, point.0 - gap - w].map(|left| [left, top, left + w, top + h])
        });
        let first = [point.0 + gap, point.1 - h / 2, point.0 + gap + w, point.1 - h / 2 + h];
        let [left, top, right, bottom] = self.plot;
        let rectangle = places
            .find(|b| {
                let inside = b[0] > left && b[2] < right && b[1] > top && b[3] < bottom;
                inside && self.taken.iter().all(|t| b[2] < t[0] || b[0] > t[2] || b[3] < t[1] || b[1] > t[3])
            })
            .unwrap_or(first);
        self.taken.push(rectangle);
        rectangle
    }
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
        let mut labels = Labels { plot: [0, 0, 1000, 600], unit: 1, taken: Vec::new() };
        let spots: Vec<[i32; 4]> = (0..5).map(|_| labels.place([50, 12], (400, 300))).collect();
        for (i, a) in spots.iter().enumerate() {
            let apart = |b: &[i32; 4]| a[2] < b[0] || a[0] > b[2] || a[3] < b[1] || a[1] > b[3];
            assert!(spots[..i].iter().all(apart), "{spots:?}");
        }
        let text = |points: &[FrontPoint]| {
            let axis = Axis { title: "t", time: "ms", unit: " mm", legend: &PEERS };
            touch2touch_pipeline::images::canvas::svg(&Picture { axis, points, default: "one" }).unwrap()
        };
        let svg = text(&pareto(vec![point("one", 0.1, 0.7), point("two", 200.0, 5.0)]));
        assert_eq!(labels.place([50, 12], (100, 100))[1], 94, "beside its point, where nothing is in the way");
        assert!(svg.contains("one (default)") && svg.contains("\ntwo\n") && svg.contains("1.0 mm"), "{svg}");
        // No engine at all is a picture, too.
        assert!(text(&[]).contains("</svg>"));
    }
}
