//! What `bench campaign` says, for a person and as JSON.

use std::path::Path;

use serde::Serialize;

use super::table::table;
use crate::experiment::campaign::{Answer, Offset, PutOn, Recommendation, Told, Tolerances};
use crate::identify::verdict::Cnmp;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    profile: String,
    plot: String,
    points: Vec<PointJson>,
    totals: Totals,
    agreement: Agreement,
    /// `null` where no verdict tells.
    offset: Option<OffsetJson>,
    tolerances: Tolerances,
    /// `null` where every asymmetry has CNMP zeros somewhere in the range of operating points.
    recommendation: Option<Recommendation>,
}

#[derive(Debug, Serialize)]
struct PointJson {
    operating_point: f64,
    mass_asymmetry: f64,
    cnmp: Cnmp,
    why: String,
    model_cnmp_pairs: u8,
    model_damped_cnmp_pairs: u8,
    modes_hz: Vec<f64>,
    signs: String,
    zeros_rad_s: Vec<[f64; 2]>,
    loop_digest: String,
    /// What a person put on, and how that was checked; not on the simulated stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    put_on: Option<PutOn>,
}

#[derive(Debug, Serialize)]
struct Totals {
    points: usize,
    detected: usize,
    excluded: usize,
    undecided: usize,
}

/// How many of the verdicts the model with damping contradicts.
#[derive(Debug, Serialize)]
struct Agreement {
    decided: usize,
    contradicted_as_configured: usize,
    contradicted_with_offset: Option<usize>,
    /// By the stage that was simulated, `sim.asymmetry_offset` and all: none should be.
    contradicted_as_simulated: usize,
}

#[derive(Debug, Serialize)]
struct OffsetJson {
    best: f64,
    low: f64,
    high: f64,
    searched: [f64; 2],
}

impl Report {
    pub fn of(answer: &Answer<'_>, plot: &Path, profile: &str) -> Report {
        let [detected, excluded, undecided] =
            [Cnmp::Detected, Cnmp::Excluded, Cnmp::Undecided].map(|cnmp| answer.count(cnmp));
        Report {
            profile: profile.into(),
            plot: plot.display().to_string(),
            points: answer.points.iter().map(point).collect(),
            totals: Totals {
                points: answer.points.len(),
                detected,
                excluded,
                undecided,
            },
            agreement: Agreement {
                decided: detected + excluded,
                contradicted_as_configured: answer.contradicted,
                contradicted_with_offset: answer.offset.as_ref().map(|offset| offset.contradicted),
                contradicted_as_simulated: answer.points.iter().filter(|told| told.wrong).count(),
            },
            offset: answer.offset.as_ref().map(offset),
            tolerances: answer.tolerances,
            recommendation: answer.recommendation,
        }
    }

    /// For people.
    pub fn text(&self) -> String {
        let header = [
            "Y1o/L %",
            "asymmetry %",
            "CNMP zeros",
            "by the model",
            "with damping",
            "signs",
        ];
        let rows: Vec<Vec<String>> = self.points.iter().map(row).collect();
        let Totals {
            points,
            detected,
            excluded,
            undecided,
        } = self.totals;
        format!(
            "{}: {points} points\n\n{}\n{}{detected} detected, {excluded} excluded, {undecided} undecided\n{}{}{}picture     {}\n",
            self.profile,
            table(&header, &rows),
            self.undecided_text(),
            self.agreement_text(),
            self.offset_text(),
            self.recommendation_text(),
            self.plot,
        )
    }

    fn undecided_text(&self) -> String {
        let line = |point: &PointJson| {
            let (at, asymmetry) = (100.0 * point.operating_point, 100.0 * point.mass_asymmetry);
            format!(
                "undecided at {at:.3} % of L, {asymmetry:+.3} %: {}\n",
                point.why
            )
        };
        self.points
            .iter()
            .filter(|point| point.cnmp == Cnmp::Undecided)
            .map(line)
            .collect()
    }

    fn agreement_text(&self) -> String {
        let Agreement {
            decided,
            contradicted_as_configured,
            contradicted_as_simulated,
            ..
        } = self.agreement;
        format!(
            "model       contradicts {contradicted_as_configured} of {decided} verdicts as configured, \
             {contradicted_as_simulated} as simulated (zeros with damping)\n"
        )
    }

    fn offset_text(&self) -> String {
        let Some(OffsetJson {
            best,
            low,
            high,
            searched,
        }) = self.offset
        else {
            return "offset      no verdict tells\n".into();
        };
        let contradicted = self.agreement.contradicted_with_offset.unwrap_or_default();
        let open = if low <= searched[0] || high >= searched[1] {
            "; open at an end of the search: measure closer to the border"
        } else {
            ""
        };
        format!(
            "offset      {:+.2} % of initial asymmetry fits best, 95 % within {:+.2} to {:+.2} %{open}; it contradicts \
             {contradicted} verdicts\n",
            100.0 * best,
            100.0 * low,
            100.0 * high
        )
    }

    fn recommendation_text(&self) -> String {
        let Some(best) = self.recommendation else {
            return "recommended nothing: with every asymmetry of the range, and some initial one of the interval, an operating point has \
                    CNMP zeros\n"
                .into();
        };
        let asymmetry = format!("recommended asymmetry {:+.2} %", 100.0 * best.asymmetry);
        let end = if best.at_the_end {
            "; it is at the end of the range, farther out may be better"
        } else {
            ""
        };
        let (Some(distance), Some([point, border])) = (best.distance_tolerances, best.nearest)
        else {
            return format!("{asymmetry}: no CNMP zeros in reach\n");
        };
        let tolerances = self.tolerances;
        format!(
            "{asymmetry}: {distance:.1} tolerances from the nearest CNMP zeros, at {:.2} % of L and {:+.2} %{end}\n\
             {:11} tolerances: {:.3} % of asymmetry, {:.3} % of L; over all operating points of the range and the interval \
             of the offset\n",
            100.0 * point,
            100.0 * border,
            "",
            100.0 * tolerances.asymmetry,
            100.0 * tolerances.operating_point
        )
    }
}

fn point(told: &Told<'_>) -> PointJson {
    let point = told.point.clone();
    PointJson {
        operating_point: told.operating_point,
        mass_asymmetry: told.asymmetry,
        cnmp: point.cnmp,
        why: point.why,
        model_cnmp_pairs: told.model_pairs,
        model_damped_cnmp_pairs: told.model_pairs_damped,
        modes_hz: point.modes_hz,
        signs: point.signs,
        zeros_rad_s: point.zeros_rad_s,
        loop_digest: point.loop_digest,
        put_on: point.put_on,
    }
}

fn offset(offset: &Offset) -> OffsetJson {
    let [low, high] = offset.interval;
    OffsetJson {
        best: offset.best,
        low,
        high,
        searched: offset.searched,
    }
}

fn row(point: &PointJson) -> Vec<String> {
    vec![
        format!("{:.3}", 100.0 * point.operating_point),
        format!("{:+.3}", 100.0 * point.mass_asymmetry),
        point.cnmp.name().into(),
        point.model_cnmp_pairs.to_string(),
        point.model_damped_cnmp_pairs.to_string(),
        point.signs.clone(),
    ]
}
