//! How to break the conditions for CNMP zeros that hold, and what would fulfil those that fail.

use super::CloseModes;
use super::conditions::{c4_1, c4_2, deciding_residue, pattern};
use super::quadrants::residue_signs;
use bench_base::decimal::Decimal;

/// A sentence on C4-1 and one on C4-2.
pub(super) fn remedies(modes: &CloseModes) -> Vec<String> {
    vec![on_signs(modes), on_gap(modes)]
}

fn on_signs(modes: &CloseModes) -> String {
    let (condition, residues) = (c4_1(modes), modes.residues_per_kg());
    let which = deciding_residue(residues);
    let residue = format!(
        "a{} = {:+.4e} 1/kg",
        ["R", "u", "v"][which],
        Decimal(residues[which])
    );
    let signs: String = residue_signs(residues).iter().collect();
    let percent = condition.margin.abs() * 100.0;
    let pattern = if pattern(residues) > 0.0 {
        "+-+"
    } else {
        "-+-"
    };
    if condition.holds {
        format!(
            "C4-1 holds by {percent:.1} %: signs {signs}. To break it, change the sign of the smallest residue, {residue}, \
         by moving actuator or sensor (`bench model placement`) or by the mass asymmetry"
        )
    } else {
        format!(
            "C4-1 fails by {percent:.1} % of the largest residue: signs {signs}. \
         They become {pattern} if {residue} changes its sign; keep its sign to avoid CNMP zeros"
        )
    }
}

/// The changes of the gap, as factors on wv^2 - wu^2 with unchanged residues.
fn on_gap(modes: &CloseModes) -> String {
    let condition = c4_2(modes);
    let (figure, [low, high]) = (condition.figure, condition.limits);
    let (near, far) = (low / figure, high / figure);
    let percent = condition.margin.abs() * 100.0;
    if !modes.are_opposed() {
        NOT_OPPOSED.into()
    } else if condition.holds {
        format!(
            "C4-2 holds by {percent:.1} % of |b22|. To break it, move the modes apart, \
             wv^2 - wu^2 times {far:.3} or more, or together, times {near:.3} or less"
        )
    } else if figure <= 0.0 {
        NOT_AT_ANY_GAP.into()
    } else {
        let way = if figure >= high { "apart" } else { "together" };
        format!(
            "C4-2 fails by {percent:.1} % of |b22|: the modes are too far {way}. \
             It would hold with wv^2 - wu^2 times {near:.3} to {far:.3}"
        )
    }
}

const NOT_OPPOSED: &str = "C4-2 fails: the residues of modes u and v do not have opposite signs, \
    so that no gap between them gives CMP-CNMP zeros";
const NOT_AT_ANY_GAP: &str = "C4-2 fails: the sum of all residues has the sign of au, at any gap";
