//! Outcome of a value for each pair, and in sum.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize, Serializer};

use super::Setting;
use crate::labels::ImprintSource;
use touch2touch_core::dataset::PairId;
use touch2touch_core::metrics::AngleSummary;
use touch2touch_core::units::angle_error;

/// A pair with one value. In files lengths and angles are also in the units of the screen.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "WrittenOutcome")]
pub struct Outcome {
    /// The pair; no file says it.
    #[serde(skip, default = "nowhere")]
    pub pair: PairId,
    /// Name of the pair.
    pub name: String,
    /// True where the true pose is known.
    pub truth: bool,
    /// The angle that the lab reports, radians.
    pub angle_rad: Option<f64>,
    /// Size of its error, radians, where the truth is known.
    pub error_rad: Option<f64>,
    /// Size of the change of the angle against what is in force, radians.
    pub change_rad: Option<f64>,
    /// Root mean square of the residuals, meters.
    pub rms_m: Option<f64>,
    /// Contact points.
    pub points: usize,
    /// True where a mask was drawn by hand.
    pub hand: bool,
    /// Why there is no pose.
    pub failure: Option<String>,
}

/// The place of a pair that is known by its name alone.
fn nowhere() -> PairId {
    PairId(u32::MAX)
}

/// [`Outcome`] in a file.
#[derive(Serialize)]
struct WrittenOutcome {
    name: String,
    truth: bool,
    angle_rad: Option<f64>,
    angle_deg: Option<f64>,
    error_rad: Option<f64>,
    error_deg: Option<f64>,
    change_rad: Option<f64>,
    change_deg: Option<f64>,
    rms_m: Option<f64>,
    rms_mm: Option<f64>,
    points: usize,
    hand: bool,
    failure: Option<String>,
}

impl From<Outcome> for WrittenOutcome {
    fn from(of: Outcome) -> Self {
        let Outcome { name, truth, angle_rad, error_rad, change_rad, rms_m, points, hand, failure, .. } = of;
        let degrees = |radians: Option<f64>| radians.map(f64::to_degrees);
        let [angle_deg, error_deg, change_deg] = [angle_rad, error_rad, change_rad].map(degrees);
        let rms_mm = rms_m.map(|m| m * 1e3);
        Self {
            name,
            truth,
            angle_rad,
            angle_deg,
            error_rad,
            error_deg,
            change_rad,
            change_deg,
            rms_m,
            rms_mm,
            points,
            hand,
            failure,
        }
    }
}

fn degrees<S: Serializer>(radians: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
    radians.map(f64::to_degrees).serialize(to)
}

fn millimeters<S: Serializer>(meters: &Option<f64>, to: S) -> Result<S::Ok, S::Error> {
    meters.map(|m| m * 1e3).serialize(to)
}

impl Outcome {
    pub(super) fn failed(pair: PairId, name: String, why: String) -> Self {
        Self {
            pair,
            name,
            truth: false,
            angle_rad: None,
            error_rad: None,
            change_rad: None,
            rms_m: None,
            points: 0,
            hand: false,
            failure: Some(why),
        }
    }

    pub(super) fn set_change(&mut self, base: Option<f64>) {
        self.change_rad = self.angle_rad.zip(base).map(|(angle, base)| angle_error(angle, base));
    }
}

/// Why pairs have no pose, and how many.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// The reason of the first of them; numbers in it are of that one.
    pub why: String,
    /// Number of pairs.
    pub count: usize,
}

/// The pairs with one value in sum.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Of the pairs whose truth is known; `None` if it is of none.
    pub angle: Option<AngleSummary>,
    /// Median change of the angle against what is in force, radians.
    #[serde(rename = "median_change_deg", serialize_with = "degrees")]
    pub median_change_rad: Option<f64>,
    /// Median of the residuals' root mean square, meters.
    #[serde(rename = "median_rms_mm", serialize_with = "millimeters")]
    pub median_rms_m: Option<f64>,
    /// Median number of contact points.
    pub median_points: Option<f64>,
    /// Pairs without a pose.
    pub failed: usize,
    /// Why, the most frequent first.
    pub failures: Vec<Failure>,
}

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

impl Summary {
    fn of(cases: &[Outcome]) -> Self {
        let known: Vec<f64> = cases.iter().filter(|c| c.truth).map(|c| c.error_rad.unwrap_or(f64::NAN)).collect();
        let mut failures: BTreeMap<String, Failure> = BTreeMap::new();
        for why in cases.iter().filter_map(|c| c.failure.as_ref()) {
            // "3 points are too few" and "4 points are too few" are one reason.
            let kind: String = why.chars().filter(|c| !c.is_ascii_digit()).collect();
            failures.entry(kind).or_insert_with(|| Failure { why: why.clone(), count: 0 }).count += 1;
        }
        let mut failures: Vec<Failure> = failures.into_values().collect();
        failures.sort_by_key(|failure| std::cmp::Reverse(failure.count));
        Self {
            angle: (!known.is_empty()).then(|| AngleSummary::from_errors(&known)),
            median_change_rad: median(cases.iter().filter_map(|c| c.change_rad)),
            median_rms_m: median(cases.iter().filter_map(|c| c.rms_m)),
            median_points: median(cases.iter().map(|c| c.points as f64)),
            failed: cases.iter().filter(|c| c.failure.is_some()).count(),
            failures,
        }
    }

    /// Figures of which more is better, in order: success within 5 degrees, within 10, and a small median.
    fn worth(&self) -> Option<[f64; 3]> {
        let angle = self.angle?;
        Some([angle.success_5, angle.success_10, -angle.median_deg?])
    }
}

/// One value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Value of the dial; `None`: as everything is in force.
    pub value: Option<Setting>,
    /// True where that is where the dial stands.
    pub in_force: bool,
    /// In sum.
    pub summary: Summary,
    /// Pair by pair.
    pub cases: Vec<Outcome>,
}

/// All values over the imprints of one source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    /// The source.
    pub source: ImprintSource,
    /// As everything is in force, without the dial.
    pub base: Point,
    /// With each value, in their order.
    pub points: Vec<Point>,
    /// Index of the best of them: most pairs within 5 degrees, then within 10, then the least median error. `None`
    /// where the truth is not known, or no value gives a pose.
    pub best: Option<usize>,
}

impl Series {
    /// From the outcomes of each pair: as in force, then with each value.
    pub(super) fn new(source: ImprintSource, rows: Vec<Vec<Outcome>>, values: &[Setting], at: Option<Setting>) -> Self {
        let mut columns: Vec<Vec<Outcome>> = vec![Vec::new(); values.len() + 1];
        for row in rows {
            columns.iter_mut().zip(row).for_each(|(column, outcome)| column.push(outcome));
        }
        Self::of_columns(source, columns, values, at)
    }

    /// From the outcomes of all pairs: as in force, then with each value.
    pub(super) fn of_columns(
        source: ImprintSource,
        columns: Vec<Vec<Outcome>>,
        values: &[Setting],
        at: Option<Setting>,
    ) -> Self {
        let values = std::iter::once(None).chain(values.iter().copied().map(Some));
        let point = |(value, cases): (Option<Setting>, Vec<Outcome>)| {
            let in_force = value.is_none() || value == at;
            Point { value, in_force, summary: Summary::of(&cases), cases }
        };
        let mut points: Vec<Point> = values.zip(columns).map(point).collect();
        let base = points.remove(0);
        let mut best: Option<(usize, [f64; 3])> = None;
        for (i, worth) in points.iter().enumerate().filter_map(|(i, point)| Some((i, point.summary.worth()?))) {
            if best.is_none_or(|(_, most)| worth.partial_cmp(&most) == Some(std::cmp::Ordering::Greater)) {
                best = Some((i, worth));
            }
        }
        Self { source, base, points, best: best.map(|(i, _)| i) }
    }

    /// Adds other pairs with the same values.
    ///
    /// # Errors
    /// If the values are others.
    pub(super) fn append(&mut self, more: Self) -> Result<(), String> {
        let value = |point: &Point| point.value;
        if !self.points.iter().map(value).eq(more.points.iter().map(value)) {
            return Err("the parts are of different values".into());
        }
        let values: Vec<Setting> = self.points.iter().filter_map(value).collect();
        let at = self.points.iter().find(|point| point.in_force).and_then(value);
        let columns = |of: &mut Self| {
            let points = std::iter::once(&mut of.base).chain(&mut of.points);
            points.map(|point| std::mem::take(&mut point.cases)).collect::<Vec<_>>()
        };
        let mut more = more;
        let mut all = columns(self);
        all.iter_mut().zip(columns(&mut more)).for_each(|(all, more)| all.extend(more));
        *self = Self::of_columns(self.source, all, &values, at);
        Ok(())
    }

    /// True where the truth of some pair is known.
    pub fn has_truth(&self) -> bool {
        self.base.summary.angle.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::Dial;

    fn outcome(truth: bool, error_deg: Option<f64>, points: usize) -> Outcome {
        let radians = error_deg.map(f64::to_radians);
        Outcome {
            truth,
            angle_rad: radians,
            error_rad: radians.filter(|_| truth),
            rms_m: radians.map(|_| 2e-4),
            points,
            failure: error_deg.is_none().then(|| format!("{points} usable contact points are too few")),
            ..Outcome::failed(PairId(points as u32), format!("p{points}"), String::new())
        }
    }

    fn series(rows: Vec<Vec<Outcome>>) -> Series {
        let values = Dial::Threshold.spread(2.0, 4.0, 3).unwrap();
        let rows = rows.into_iter().map(|mut row| {
            let base = row[0].angle_rad;
            row.iter_mut().for_each(|one| one.set_change(base));
            row
        });
        Series::new(ImprintSource::Measured, rows.collect(), &values, Some(values[1]))
    }

    #[test]
    fn few_pairs_that_survive_do_not_make_a_value_the_best() {
        let row = |errors: [Option<f64>; 4]| errors.map(|deg| outcome(true, deg, 7)).to_vec();
        let found = series(vec![
            row([Some(1.0), Some(2.0), Some(1.0), Some(0.1)]),
            row([Some(1.0), Some(3.0), Some(4.0), None]),
            row([Some(1.0), Some(9.0), Some(4.0), None]),
        ]);
        assert_eq!((found.best, found.has_truth()), (Some(1), true));
        assert_eq!(found.points.iter().map(|p| p.in_force).collect::<Vec<_>>(), [false, true, false]);
        let last = &found.points[2].summary;
        assert_eq!(
            (last.failed, last.angle.unwrap().failed, last.angle.unwrap().median_deg),
            (2, 2, Some(0.1_f64.to_radians().to_degrees()))
        );
        assert!((last.angle.unwrap().success_5 - 100.0 / 3.0).abs() < 1e-9);
        let json = serde_json::to_value(&found).unwrap();
        assert_eq!((&json["points"][1]["value"], &json["base"]["value"]), (&3.0.into(), &serde_json::Value::Null));
        assert!((json["points"][0]["cases"][2]["change_deg"].as_f64().unwrap() - 8.0).abs() < 1e-9);
    }

    #[test]
    fn without_a_truth_there_is_no_best_but_residual_and_change() {
        let row = |errors: [Option<f64>; 4]| errors.map(|deg| outcome(false, deg, 7)).to_vec();
        let found = series(vec![row([Some(1.0), Some(2.0), Some(1.0), None]), row([None, Some(3.0), Some(4.0), None])]);
        assert!(found.best.is_none() && !found.has_truth());
        let first = &found.points[0].summary;
        assert!(
            (first.median_change_rad.unwrap().to_degrees() - 1.0).abs() < 1e-9,
            "where nothing is in force there is no change"
        );
        assert_eq!((first.median_rms_m, first.angle), (Some(2e-4), None));
        assert_eq!(
            found.points[2].summary.failures,
            [Failure { why: "7 usable contact points are too few".into(), count: 2 }]
        );
        // No pair at all is said as such, not as a number.
        let none = series(Vec::new());
        assert_eq!((none.points.len(), none.points[0].summary.median_points, none.best), (3, None, None));
    }
}
