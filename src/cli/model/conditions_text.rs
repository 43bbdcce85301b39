//! What `bench model conditions` says to a person.

use super::super::table::table;
use super::conditions::{Assumptions, ConditionJson, Here, PropositionJson, Report, SideJson};

pub(super) fn text(report: &Report) -> String {
    let [u, v] = report.modes;
    let verb = if report.meeting == "crossing" {
        "cross"
    } else {
        "veer"
    };
    let bands = match report.cnmp_bands.as_slice() {
        [] => "none".into(),
        bands => bands
            .iter()
            .map(|[from, to]| format!("{from:.9} to {to:.9}"))
            .collect::<Vec<_>>()
            .join(", "),
    };
    let here = report.here.as_ref().map_or_else(
        || {
            format!(
                "at {} the modes cross: there is nothing to explain there, give another --at\n",
                report.value
            )
        },
        here_text,
    );
    let sides: String = report.sides.iter().map(side_text).collect();
    let tally = &report.p4_1;
    format!(
        "{}: modes {u} and {v} over {}\nthey {verb} at {:.9}: {:.4} Hz, {:.3e} Hz apart\nCNMP zeros of these modes: {bands}\n\n{here}{}\nP4-1 at {} values: CNMP zeros foretold at {}; contradicted by the zeros of Eq. (4-1) at {}, by those of the plant at {}\n{sides}\n{}",
        report.profile,
        report.vary,
        report.value,
        report.frequency_hz,
        report.gap_hz,
        assumptions_text(&report.assumptions),
        tally.values,
        tally.appear,
        tally.wrong_by_equation,
        tally.wrong_by_plant,
        rows_text(report),
    )
}

fn here_text(here: &Here) -> String {
    let proposition = &here.proposition;
    let zeros = if proposition.plant {
        "CNMP zeros"
    } else {
        "no CNMP zeros"
    };
    let remedies: String = here
        .remedies
        .iter()
        .map(|remedy| format!("  {remedy}\n"))
        .collect();
    format!(
        "at {:.9}: {zeros} (P4-1: {})\n{remedies}",
        here.value, proposition.foretold
    )
}

fn assumptions_text(a: &Assumptions) -> String {
    let number = |ratio: Option<f64>| ratio.map_or("-".into(), |ratio| format!("{ratio:.4}"));
    format!(
        "  A4-2 damping ratio {:.4}, {} of half the gap\n  A4-4 mode R is mode {}, at {} of the frequency of the nearer; all others give {} of what it gives\n  A4-5 between the two modes the others depart from a double integrator by {}\n",
        a.damping_ratio,
        number(a.damping_over_half_gap),
        a.mode_r.map_or("-".into(), |mode| mode.to_string()),
        number(a.nearness_ratio),
        number(a.others_ratio),
        number(a.integrator_ratio),
    )
}

fn side_text(side: &SideJson) -> String {
    let place = match side.stretch {
        None => "C4-1 fails at the veering point".into(),
        Some([from, to]) => format!("C4-1 holds from {from:.6} to {to:.6}"),
    };
    let propositions: String = side.propositions.iter().map(proposition_text).collect();
    format!("{} the veering point: {place}\n{propositions}", side.side)
}

fn proposition_text(p: &PropositionJson) -> String {
    let premises: Vec<String> = p.premises.iter().map(premise_text).collect();
    let there = |quartet: bool| if quartet { "appear" } else { "absent" };
    let differs = if p.agrees_with_equation && p.agrees_with_plant {
        ""
    } else {
        " DIFFERS"
    };
    format!(
        "  {:5} {}: foretold {}; Eq. (4-1) {}, plant {}{differs}\n",
        p.name,
        premises.join(", "),
        p.foretold,
        there(p.equation),
        there(p.plant)
    )
}

fn premise_text(c: &ConditionJson) -> String {
    format!(
        "{} {} ({:+.3})",
        c.name,
        if c.holds { "holds" } else { "fails" },
        c.margin
    )
}

/// A screen of rows; the JSON has all.
fn rows_text(report: &Report) -> String {
    let header = [
        &report.vary,
        "u Hz",
        "v Hz",
        "aR 1/kg",
        "au 1/kg",
        "av 1/kg",
        "C4-1",
        "b21",
        "b2",
        "b22",
        "C4-2",
        "Eq. (4-1)",
        "plant",
    ];
    let step = report.rows.len().div_ceil(25).max(1);
    let rows = report.rows.iter().step_by(step).map(|row| {
        let small = |x: f64| format!("{x:+.4e}");
        let limit =
            |which: usize| row.c4_2.limits[which].map_or("-".into(), |x| format!("{x:.4e}"));
        vec![
            format!("{:.6}", row.value),
            format!("{:.4}", row.u_hz),
            format!("{:.4}", row.v_hz),
            small(row.residue_r_per_kg),
            small(row.residue_u_per_kg),
            small(row.residue_v_per_kg),
            format!("{:+.3}", row.c4_1.margin),
            limit(0),
            format!("{:.4e}", row.c4_2.figure),
            limit(1),
            format!("{:+.3}", row.c4_2.margin),
            row.equation.into(),
            row.plant.into(),
        ]
    });
    let header: Vec<&str> = header.iter().map(|name| name as &str).collect();
    format!(
        "margins of C4-1 and C4-2, b-hat in the direction of av, and the zeros\n{}",
        table(&header, &rows.collect::<Vec<_>>())
    )
}
