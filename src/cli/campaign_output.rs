//! The result of `bench campaign` as text and as JSON.

use std::path::Path;

use serde::Serialize;

use super::run_options::description_text;
use super::table::{labelled, table, wrap};
use bench_base::decimal::Decimal;
use bench_experiment::Description;
use bench_experiment::campaign::{ComparedPoint, Evaluation, Offset, Recommendation, Tolerances};
use bench_identify::verdict::Cnmp;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    /// Name, note and operator.
    #[serde(flatten)]
    description: Description,
    profile: &'a str,
    plot: String,
    points: &'a [ComparedPoint<'a>],
    totals: Totals,
    agreement: Agreement,
    /// `null` if no verdict is decided.
    offset: Option<OffsetReport>,
    tolerances: Tolerances,
    /// `null` if every asymmetry has CNMP zeros somewhere in the range of operating points.
    recommendation: Option<Recommendation>,
}

#[derive(Debug, Serialize)]
struct Totals {
    points: usize,
    detected: usize,
    excluded: usize,
    undecided: usize,
    /// Length of all chirps in seconds; absent for single chirps.
    #[serde(skip_serializing_if = "Option::is_none")]
    motion_s: Option<f64>,
}

/// The number of verdicts that disagree with the model with damping.
#[derive(Debug, Serialize)]
struct Agreement {
    decided: usize,
    contradicted_as_configured: usize,
    contradicted_with_offset: Option<usize>,
    /// Disagreement with the simulated stage, including `sim.asymmetry_offset`; 0 is expected.
    contradicted_as_simulated: usize,
}

#[derive(Debug, Serialize)]
struct OffsetReport {
    best: f64,
    low: f64,
    high: f64,
    searched: [f64; 2],
}

impl OffsetReport {
    fn of(offset: &Offset) -> OffsetReport {
        let [low, high] = offset.interval;
        OffsetReport {
            best: offset.best,
            low,
            high,
            searched: offset.searched,
        }
    }

    fn is_open(&self) -> bool {
        self.low <= self.searched[0] || self.high >= self.searched[1]
    }
}

impl Totals {
    fn of(evaluation: &Evaluation<'_>) -> Totals {
        Totals {
            points: evaluation.points.len(),
            detected: evaluation.count(Cnmp::Detected),
            excluded: evaluation.count(Cnmp::Excluded),
            undecided: evaluation.count(Cnmp::Undecided),
            motion_s: evaluation
                .points
                .iter()
                .map(|point| point.result.motion_s)
                .sum(),
        }
    }
}

impl Agreement {
    fn of(evaluation: &Evaluation<'_>, totals: &Totals) -> Agreement {
        let offset = evaluation.offset.as_ref();
        let wrong = evaluation.points.iter().filter(|point| point.is_wrong);
        Agreement {
            decided: totals.detected + totals.excluded,
            contradicted_as_configured: evaluation.contradicted,
            contradicted_with_offset: offset.map(|offset| offset.contradicted),
            contradicted_as_simulated: wrong.count(),
        }
    }
}

impl<'a> Report<'a> {
    pub fn of(
        evaluation: &'a Evaluation<'a>,
        plot: &Path,
        profile: &'a str,
        description: Description,
    ) -> Report<'a> {
        let totals = Totals::of(evaluation);
        Report {
            description,
            profile,
            plot: plot.display().to_string(),
            points: &evaluation.points,
            agreement: Agreement::of(evaluation, &totals),
            totals,
            offset: evaluation.offset.as_ref().map(OffsetReport::of),
            tolerances: evaluation.tolerances,
            recommendation: evaluation.recommendation,
        }
    }

    /// The result as text.
    pub fn text(&self) -> String {
        let totals = &self.totals;
        format!(
            "{}: {} points\n{}\n{}\n{}{} detected, {} excluded, {} undecided\n{}{}{}{}{}",
            self.profile,
            totals.points,
            description_text(&self.description),
            self.points_table(),
            self.undecided_text(),
            totals.detected,
            totals.excluded,
            totals.undecided,
            self.motion_text(),
            labelled("model", &self.agreement_text()),
            labelled("offset", &self.offset_text()),
            labelled("recommend", &self.recommendation_text()),
            labelled("picture", &self.plot),
        )
    }

    fn points_table(&self) -> String {
        let header = [
            "Y1o/L %",
            "asymmetry %",
            "CNMP zeros",
            "model pairs",
            "damped",
            "signs",
        ];
        let rows: Vec<Vec<String>> = self.points.iter().map(row).collect();
        table(&header, &rows)
    }

    fn undecided_text(&self) -> String {
        let undecided = self
            .points
            .iter()
            .filter(|point| point.result.cnmp == Cnmp::Undecided);
        let lines = undecided.map(|point| {
            let at = Decimal(100.0 * point.operating_point);
            let asymmetry = Decimal(100.0 * point.asymmetry);
            let why = &point.result.why;
            wrap(
                &format!("undecided at {at:.3} % of L, {asymmetry:+.3} %: {why}"),
                0,
            )
        });
        lines.collect()
    }

    fn motion_text(&self) -> String {
        let motion_s = self.totals.motion_s;
        motion_s.map_or(String::new(), |s| {
            labelled("motion", &format!("{:.1} min of chirps in all", s / 60.0))
        })
    }

    fn agreement_text(&self) -> String {
        let agreement = &self.agreement;
        format!(
            "disagrees with {} of {} verdicts as configured, with {} as simulated (zeros with damping)",
            agreement.contradicted_as_configured,
            agreement.decided,
            agreement.contradicted_as_simulated
        )
    }

    fn offset_text(&self) -> String {
        let Some(offset) = &self.offset else {
            return "no verdict is decided".into();
        };
        let open = if offset.is_open() {
            "; the interval is open at an end of the search: measure closer to the border"
        } else {
            ""
        };
        format!(
            "{:+.2} % of initial asymmetry fits best, 95 % interval {:+.2} to {:+.2} %{open}; {} verdicts disagree with it",
            Decimal(100.0 * offset.best),
            Decimal(100.0 * offset.low),
            Decimal(100.0 * offset.high),
            self.agreement.contradicted_with_offset.unwrap_or_default()
        )
    }

    fn recommendation_text(&self) -> String {
        let Some(best) = self.recommendation else {
            return NO_RECOMMENDATION.into();
        };
        let asymmetry = format!("asymmetry {:+.2} %", Decimal(100.0 * best.asymmetry));
        match (best.distance_tolerances, best.nearest) {
            (Some(distance), Some(nearest)) => {
                let distance = self.distance_text(distance, nearest, best.at_the_end);
                format!("{asymmetry}: {distance}")
            }
            _ => format!("{asymmetry}: no CNMP zeros in the searched range"),
        }
    }

    fn distance_text(&self, tolerances: f64, [point, border]: [f64; 2], at_end: bool) -> String {
        let end = if at_end {
            "; it is at the end of the range, a larger one may be better"
        } else {
            ""
        };
        format!(
            "{tolerances:.1} tolerances from the nearest CNMP zeros, at {:.2} % of L and {:+.2} %{end}; \
             tolerances: {:.3} % of asymmetry, {:.3} % of L; for all operating points of the range and the interval of \
             the offset",
            Decimal(100.0 * point),
            Decimal(100.0 * border),
            100.0 * self.tolerances.asymmetry,
            100.0 * self.tolerances.operating_point
        )
    }
}

const NO_RECOMMENDATION: &str = "none: for each asymmetry of the range, and some initial asymmetry of the interval, an operating \
    point has CNMP zeros";

fn row(point: &ComparedPoint<'_>) -> Vec<String> {
    vec![
        format!("{:.3}", Decimal(100.0 * point.operating_point)),
        format!("{:+.3}", Decimal(100.0 * point.asymmetry)),
        point.result.cnmp.name().into(),
        point.model_pairs.to_string(),
        point.model_pairs_damped.to_string(),
        point.result.signs.clone(),
    ]
}
