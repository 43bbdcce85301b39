//! The text of `bench model conditions`.

use super::super::table::{table, wrap};
use super::{evenly_spread_rows, meeting_text};
use bench_base::decimal::Decimal;
use bench_thesis::veering::conditions::Condition;
use bench_thesis::veering::propositions::Proposition;
use bench_thesis::veering::report::{
    Assumptions, ConditionRow, ConditionsReport, Explanation, PredictionTally, SideReport,
};

pub(super) fn text(profile: &str, vary: &str, conditions: &ConditionsReport) -> String {
    let here = match &conditions.here {
        Some(here) => explanation_text(here),
        None => wrap(
            "the modes cross at this value, where the conditions do not apply; give another --at",
            0,
        ),
    };
    let sides: String = conditions.sides.iter().map(side_text).collect();
    format!(
        "{}\n{here}{}\n{}\n{sides}\n{}",
        head_text(profile, vary, conditions),
        assumptions_text(&conditions.assumptions),
        wrap(&tally_text(&conditions.p4_1), 0),
        rows_text(&conditions.rows),
    )
}

fn head_text(profile: &str, vary: &str, conditions: &ConditionsReport) -> String {
    let [u, v] = conditions.point.modes;
    let title = format!("{profile}: modes {u} and {v} over {vary}");
    let meeting = meeting_text(&conditions.point);
    let bands = bands_text(&conditions.cnmp_bands);
    wrap(&title, 0) + &wrap(&meeting, 0) + &wrap(&bands, 0)
}

fn bands_text(bands: &[[f64; 2]]) -> String {
    let ranges = bands.iter();
    let ranges: Vec<String> = ranges
        .map(|[from, to]| format!("{from:.9} to {to:.9}"))
        .collect();
    let ranges = if ranges.is_empty() {
        "none".into()
    } else {
        ranges.join(", ")
    };
    format!("CNMP zeros of these modes: {ranges}")
}

fn explanation_text(here: &Explanation) -> String {
    let proposition = &here.proposition;
    let zeros = if proposition.plant {
        "CNMP zeros"
    } else {
        "no CNMP zeros"
    };
    let remedies: String = here.remedies.iter().map(|remedy| wrap(remedy, 2)).collect();
    let prediction = proposition.predicted.name();
    format!(
        "at {:.9}: {zeros} (P4-1: {prediction})\n{remedies}",
        here.value
    )
}

fn assumptions_text(assumptions: &Assumptions) -> String {
    let mode_r = assumptions.mode_r.map(|mode| mode.to_string());
    let mode_r = mode_r.unwrap_or("-".into());
    let damping = format!(
        "A4-2: damping ratio {:.4}, {} of half the gap",
        assumptions.damping_ratio,
        or_dash(assumptions.damping_over_half_gap)
    );
    let nearness = format!(
        "A4-4: mode R is mode {mode_r}; frequency ratio to the nearer mode {}; all other modes are {} of it",
        or_dash(assumptions.nearness_ratio),
        or_dash(assumptions.others_ratio)
    );
    let integrator = format!(
        "A4-5: deviation from a double integrator between the two modes {}",
        or_dash(assumptions.integrator_ratio)
    );
    wrap(&damping, 2) + &wrap(&nearness, 2) + &wrap(&integrator, 2)
}

fn or_dash(ratio: Option<f64>) -> String {
    ratio.map_or("-".into(), |ratio| format!("{ratio:.4}"))
}

fn tally_text(tally: &PredictionTally) -> String {
    format!(
        "P4-1 at {} values: CNMP zeros predicted at {}; wrong by the zeros of Eq. (4-1) at {}, by those of the plant at {}",
        tally.values, tally.appear, tally.wrong_by_equation, tally.wrong_by_plant
    )
}

fn side_text(side: &SideReport) -> String {
    let interval = match side.interval {
        None => "C4-1 fails there".into(),
        Some([from, to]) => format!("C4-1 holds from {from:.6} to {to:.6}"),
    };
    let propositions: String = side.propositions.iter().map(proposition_text).collect();
    let name = side.side.name();
    format!("{name} the veering point: {interval}\n{propositions}")
}

fn proposition_text(proposition: &Proposition) -> String {
    let premises: Vec<String> = proposition.premises.iter().map(premise_text).collect();
    let found = |quartet: bool| if quartet { "appear" } else { "absent" };
    let agrees = proposition.agrees_with_equation && proposition.agrees_with_plant;
    let sentence = format!(
        "{}: {}; predicted: {}; Eq. (4-1): {}, plant: {}{}",
        proposition.name,
        premises.join(", "),
        proposition.predicted.name(),
        found(proposition.equation),
        found(proposition.plant),
        if agrees { "" } else { " (DISAGREES)" }
    );
    wrap(&sentence, 2)
}

fn premise_text(condition: &Condition) -> String {
    let holds = if condition.holds { "holds" } else { "fails" };
    let margin = Decimal(condition.margin);
    format!("{} {holds} ({margin:+.3})", condition.name)
}

fn rows_text(rows: &[ConditionRow]) -> String {
    let margins: Vec<Vec<String>> = evenly_spread_rows(rows).map(margin_row).collect();
    let residues: Vec<Vec<String>> = evenly_spread_rows(rows).map(residue_row).collect();
    format!(
        "margins of C4-1 and C4-2, and the zeros\n{}\nresidues in 1/kg, and b2 between its limits (in the direction of av)\n{}",
        table(
            &[
                "value",
                "u Hz",
                "v Hz",
                "C4-1",
                "C4-2",
                "Eq. (4-1)",
                "plant"
            ],
            &margins
        ),
        table(&["value", "aR", "au", "av", "b21", "b2", "b22"], &residues),
    )
}

fn margin_row(row: &ConditionRow) -> Vec<String> {
    vec![
        format!("{:.6}", Decimal(row.value)),
        format!("{:.4}", row.u_hz),
        format!("{:.4}", row.v_hz),
        format!("{:+.3}", Decimal(row.c4_1.margin)),
        format!("{:+.3}", Decimal(row.c4_2.margin)),
        row.equation.name().into(),
        row.plant.name().into(),
    ]
}

fn residue_row(row: &ConditionRow) -> Vec<String> {
    let [b21, b22] = row.c4_2.limits.map(Decimal);
    vec![
        format!("{:.6}", Decimal(row.value)),
        format!("{:+.3e}", Decimal(row.residue_r_per_kg)),
        format!("{:+.3e}", Decimal(row.residue_u_per_kg)),
        format!("{:+.3e}", Decimal(row.residue_v_per_kg)),
        format!("{b21:.3e}"),
        format!("{:.3e}", Decimal(row.c4_2.figure)),
        format!("{b22:.3e}"),
    ]
}
