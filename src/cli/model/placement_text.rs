//! The text of `bench model placement`.

use super::super::table::{table, wrap};
use bench_base::decimal::Decimal;
use bench_thesis::veering::QuadrantSummary;
use bench_thesis::veering::placement::{MIN_REMAINDER_RATIO, Placement, PlacementReport, Trial};

/// Placements that are listed; the JSON has all.
const LISTED: usize = 16;
const NUMERALS: [&str; 4] = ["I", "II", "III", "IV"];

pub(super) fn text(profile: &str, vary: &str, report: &PlacementReport) -> String {
    let [u, v] = report.modes;
    let (verb, value) = (report.meeting.verb(), report.value);
    let head = format!("{profile}: modes {u} and {v} over {vary}; they {verb} at {value:.9}");
    format!(
        "{}{}\n{}\n{}\n{}",
        wrap(&head, 0),
        present_text(report),
        diagrams_text(&report.pictures),
        advice_text(report),
        trials_text(report),
    )
}

fn present_text(report: &PlacementReport) -> String {
    match &report.here {
        None => "no response at some value\n".into(),
        Some(here) => format!(
            "actuator {}, probe {}\n{}",
            here.actuator,
            here.sensor,
            wrap(&judgement(&here.trial), 0)
        ),
    }
}

fn judgement(trial: &Trial) -> String {
    let diagram = if trial.picture_alternates {
        "signs alternate somewhere"
    } else {
        "signs alternate nowhere"
    };
    format!(
        "diagram: {diagram}; model: CNMP zeros of these modes at {} of {} values, of any modes at {}{}",
        trial.with_cnmp,
        trial.values,
        trial.with_any_cnmp,
        remark(trial)
    )
}

/// Why diagram and model may differ.
fn remark(trial: &Trial) -> &'static str {
    if trial.differs {
        "; the two differ: the plane of the shapes or aR changes over the range, or other modes contribute"
    } else if trial.picture_alternates && trial.with_cnmp == 0 {
        "; the gap is outside of the band of C4-2 (`bench model conditions`)"
    } else {
        ""
    }
}

fn diagrams_text(diagrams: &[QuadrantSummary]) -> String {
    let rows: Vec<Vec<String>> = ["before", "at", "after"]
        .into_iter()
        .zip(diagrams)
        .map(|(when, diagram)| diagram_row(when, diagram))
        .collect();
    let header = [
        "",
        "value",
        "turn deg",
        "actuator u v",
        "in",
        "probe u v",
        "in",
        "avoid",
        "signs",
    ];
    table(&header, &rows)
}

fn diagram_row(when: &str, diagram: &QuadrantSummary) -> Vec<String> {
    let pair = |[a, b]: [f64; 2]| format!("{:+.3} {:+.3}", Decimal(a), Decimal(b));
    let turn_deg = Decimal(diagram.turn_deg);
    vec![
        when.to_string(),
        format!("{:.6}", Decimal(diagram.value)),
        format!("{turn_deg:+.2}"),
        pair(diagram.actuator),
        numeral(diagram.actuator_quadrant, "line"),
        pair(diagram.sensor),
        numeral(diagram.sensor_quadrant, "line"),
        numeral(diagram.avoid_quadrant, "-"),
        diagram.signs.clone().unwrap_or("cross".into()),
    ]
}

fn numeral(quadrant: Option<usize>, none: &str) -> String {
    quadrant
        .map_or(none, |quadrant| NUMERALS[quadrant - 1])
        .to_string()
}

fn advice_text(report: &PlacementReport) -> String {
    let head = format!(
        "recommended, of places where aR is at least {:.0} % of its present value",
        MIN_REMAINDER_RATIO * 100.0
    );
    let advice = [
        ("of all", &report.recommended),
        ("with this actuator", &report.best_sensor),
        ("with this probe", &report.best_actuator),
    ];
    let lines = advice.map(|(which, best)| best_text(which, best.as_ref()));
    wrap(&head, 0) + &lines.concat()
}

fn best_text(which: &str, best: Option<&Placement>) -> String {
    let Some(best) = best else {
        return format!("  {which}: none\n");
    };
    let values = best.trial.values;
    let verdict = match best.trial.with_any_cnmp {
        0 => format!("no CNMP zeros at {values} values"),
        some => format!("CNMP zeros remain at {some} of {values} values"),
    };
    let sentence = format!(
        "{which}: actuator {}, probe {}: {verdict}, C4-1 {:+.3}",
        best.actuator,
        best.sensor,
        Decimal(best.trial.c4_1_margin)
    );
    wrap(&sentence, 2)
}

fn trials_text(report: &PlacementReport) -> String {
    let related = report
        .trials
        .iter()
        .filter(|one| is_related(one, report.here.as_ref()));
    let rows: Vec<Vec<String>> = related.take(LISTED).map(trial_row).collect();
    let differing = report.trials.iter().filter(|one| one.trial.differs).count();
    let summary = format!(
        "{} of {} placements listed, those with this actuator or this probe, best first; {} more have no response, {} no zeros that can be computed; diagram and model differ for {differing}",
        rows.len(),
        report.trials.len(),
        report.without_response,
        report.not_computed,
    );
    table(&TRIAL_HEADER, &rows) + &wrap(&summary, 0)
}

/// Whether a placement has the present actuator or the present probe.
fn is_related(placement: &Placement, here: Option<&Placement>) -> bool {
    here.is_none_or(|here| placement.actuator == here.actuator || placement.sensor == here.sensor)
}

const TRIAL_HEADER: [&str; 8] = [
    "actuator",
    "probe",
    "any CNMP",
    "of these",
    "C4-1 max",
    "diagram",
    "",
    "|aR| 1/kg",
];

fn trial_row(placement: &Placement) -> Vec<String> {
    let trial = &placement.trial;
    let diagram = if trial.picture_alternates {
        "alternates"
    } else {
        "does not"
    };
    let differs = if trial.differs { "differs" } else { "" };
    vec![
        placement.actuator.clone(),
        placement.sensor.clone(),
        trial.with_any_cnmp.to_string(),
        trial.with_cnmp.to_string(),
        format!("{:+.3}", Decimal(trial.c4_1_margin)),
        diagram.into(),
        differs.into(),
        format!("{:.3e}", Decimal(trial.remainder_per_kg)),
    ]
}
