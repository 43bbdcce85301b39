//! What `bench model placement` says to a person.

use super::super::table::table;
use super::placement::{LEAST_REMAINDER, PictureJson, Report, TrialJson};

/// Placements that are listed; the JSON has all.
const LISTED: usize = 16;
const NUMERALS: [&str; 4] = ["I", "II", "III", "IV"];

pub(super) fn text(report: &Report) -> String {
    let [u, v] = report.modes;
    let verb = if report.meeting == "crossing" {
        "cross"
    } else {
        "veer"
    };
    let names = report.here.as_ref().map_or(String::new(), |here| {
        format!("actuator {}, probe {}\n", here.actuator, here.sensor)
    });
    let here = report.here.as_ref().map_or_else(
        || "no response at some value\n".into(),
        |here| judged(here) + "\n",
    );
    let advice = [
        ("of all", &report.recommended),
        ("with this actuator", &report.best_sensor),
        ("with this probe", &report.best_actuator),
    ];
    let advice: String = advice
        .into_iter()
        .map(|(which, trial)| advice_text(which, trial.as_ref()))
        .collect();
    let file = report
        .svg
        .as_ref()
        .map_or(String::new(), |path| format!("picture in {path}\n"));
    format!(
        "{}: modes {u} and {v} over {}; they {verb} at {:.9}\n{names}\n{}\n{here}\nrecommended, of places where aR is {:.0} % of what it is now or more\n{advice}\n{}{file}",
        report.profile,
        report.vary,
        report.value,
        pictures_text(&report.pictures),
        LEAST_REMAINDER * 100.0,
        trials_text(report),
    )
}

fn pictures_text(pictures: &[PictureJson]) -> String {
    let numeral = |quadrant: Option<usize>| {
        quadrant
            .map_or("line", |quadrant| NUMERALS[quadrant - 1])
            .to_string()
    };
    let pair = |[a, b]: [f64; 2]| format!("{a:+.4} {b:+.4}");
    let row = |(when, p): (&str, &PictureJson)| {
        vec![
            when.to_string(),
            format!("{:.6}", p.value),
            format!("{:+.2}", (p.turn_deg * 100.0).round() / 100.0 + 0.0),
            pair(p.actuator),
            numeral(p.actuator_quadrant),
            pair(p.sensor),
            numeral(p.sensor_quadrant),
            p.avoid_quadrant
                .map_or("-".into(), |quadrant| numeral(Some(quadrant))),
            p.signs.clone().unwrap_or("crossing".into()),
        ]
    };
    let header = [
        "",
        "value",
        "turn deg",
        "actuator u v",
        "in",
        "probe u v",
        "in",
        "probe not in",
        "signs R u v",
    ];
    table(
        &header,
        &["before", "at", "after"]
            .into_iter()
            .zip(pictures)
            .map(row)
            .collect::<Vec<_>>(),
    )
}

fn judged(trial: &TrialJson) -> String {
    let picture = if trial.picture_alternates {
        "signs alternate somewhere"
    } else {
        "signs alternate nowhere"
    };
    let differs = match (trial.differs, trial.picture_alternates) {
        (true, _) => {
            "; the two differ: the plane of the shapes or aR changes over the range, or other modes take part"
        }
        (_, true) if trial.with_cnmp == 0 => {
            "; signs are not enough, the gap is not in the band of C4-2 (`bench model conditions`)"
        }
        _ => "",
    };
    format!(
        "picture: {picture}; model: CNMP zeros of these modes at {} of {} values, of any modes at {}{differs}",
        trial.with_cnmp, trial.values, trial.with_any_cnmp
    )
}

fn advice_text(which: &str, trial: Option<&TrialJson>) -> String {
    trial.map_or_else(
        || format!("  {which}: none\n"),
        |trial| {
            let verdict = match trial.with_any_cnmp {
                0 => format!("no CNMP zeros at {} values", trial.values),
                some => format!(
                    "CNMP zeros at {some} of {} values all the same",
                    trial.values
                ),
            };
            format!(
                "  {which}: actuator {}, probe {}: {verdict}, C4-1 {:+.3}\n",
                trial.actuator, trial.sensor, trial.c4_1_margin
            )
        },
    )
}

fn trials_text(report: &Report) -> String {
    let row = |trial: &TrialJson| {
        vec![
            trial.actuator.clone(),
            trial.sensor.clone(),
            trial.with_any_cnmp.to_string(),
            trial.with_cnmp.to_string(),
            format!("{:+.3}", trial.c4_1_margin),
            if trial.picture_alternates {
                "alternates"
            } else {
                "does not"
            }
            .into(),
            if trial.differs { "differs" } else { "" }.into(),
            format!("{:.4e}", trial.remainder_per_kg),
        ]
    };
    let names = report
        .here
        .as_ref()
        .map(|here| (here.actuator.as_str(), here.sensor.as_str()));
    let kin = |trial: &&TrialJson| {
        names.is_none_or(|(actuator, sensor)| trial.actuator == actuator || trial.sensor == sensor)
    };
    let rows: Vec<Vec<String>> = report
        .trials
        .iter()
        .filter(kin)
        .take(LISTED)
        .map(row)
        .collect();
    let header = [
        "actuator",
        "probe",
        "any CNMP",
        "of these",
        "C4-1 at most",
        "picture",
        "",
        "|aR| 1/kg",
    ];
    let differ = report.trials.iter().filter(|trial| trial.differs).count();
    format!(
        "{}{} of {} placements listed, those with this actuator or this probe, best first; {} more have no response, {} no zeros that can be computed; picture and model differ for {differ}\n",
        table(&header, &rows),
        rows.len(),
        report.trials.len(),
        report.silent,
        report.not_computed,
    )
}
