//! The quantities that decide a verdict.

use super::stage::{Case, Stage, index, pair};
use crate::modal::Parameter;
use crate::verdict::{decisive_quantities, zeros};

#[test]
fn certain_verdict_has_no_decisive_quantities() {
    let stage = Stage::with_pair(0.3);
    let case = Case::of(&stage).with_zero_at_sigmas(&stage, pair(0.3), 3.1);
    assert!(decisive_quantities(&case.input()).unwrap().is_empty());
}

#[test]
fn zero_of_uncertain_side_is_decisive_by_its_real_part() {
    let (stage, zero) = (Stage::with_pair(0.3), pair(0.3));
    let case = Case::of(&stage).with_zero_at_sigmas(&stage, zero, 3.08);
    let quantities = decisive_quantities(&case.input()).unwrap();
    let [quantity] = quantities.as_slice() else {
        panic!("{quantities:?}");
    };
    assert!((quantity.value - 0.3).abs() < 1e-9, "{quantity:?}");
    assert_eq!(quantity.quantile, 3.09);
    let by_remainder = quantity.gradient[index(&case.fit, Parameter::Remainder)];
    let closed_form = stage.zero_by_remainder(zero).re;
    // Two zeros 2.6 rad/s apart are computed to 1e-13 of 105 rad/s: 1e-11 of their distance.
    assert!(
        (by_remainder / closed_form - 1.0).abs() < 1e-8,
        "{by_remainder} {closed_form}"
    );
}

#[test]
fn real_zero_is_not_decisive() {
    let stage = Stage::with_real_zero(49.0);
    let zero = nalgebra::Complex::new(49.0, 0.0);
    let case = Case::of(&stage).with_zero_at_sigmas(&stage, zero, 0.5);
    assert!(decisive_quantities(&case.input()).unwrap().is_empty());
}

#[test]
fn zero_outside_the_band_is_not_decisive() {
    let (stage, zero) = (Stage::with_pair(0.3), pair(0.3));
    let count_up_to = |up_to_rad_s: f64| {
        let case = Case::of(&stage).with_zero_at_sigmas(&stage, zero, 1.0);
        let case = Case {
            up_to_rad_s,
            ..case
        };
        decisive_quantities(&case.input()).unwrap().len()
    };
    assert_eq!(count_up_to(zero.norm() * (1.0 - 1e-6)), 0);
    assert_eq!(count_up_to(zero.norm() * (1.0 + 1e-6)), 1);
}

#[test]
fn residue_that_changes_the_number_of_pairs_is_decisive_by_itself() {
    let stage = Stage::with_pair(3.0);
    let residue = stage.residue(1);
    let parameter = Parameter::Residue(1);
    let case = Case::of(&stage).with_sigma(parameter, residue.abs() / 3.0);
    let quantities = decisive_quantities(&case.input()).unwrap();
    let quantity = quantities.last().expect("a residue");
    // Rounding.
    assert!((quantity.value / residue - 1.0).abs() < 1e-12);
    let at = index(&case.fit, parameter);
    for (i, derivative) in quantity.gradient.iter().enumerate() {
        assert_eq!(*derivative, if i == at { 1.0 } else { 0.0 });
    }
}

#[test]
fn residue_that_moves_only_zeros_on_the_left_is_not_decisive() {
    // The zeros of one mode satisfy y^2 = 100^2 + r/R: at 105 rad/s, outside of the band, and with the sign changed at 94.7 rad/s,
    // within it. Both pairs have the real part -c/2.
    let stage = Stage::with_one_mode(105.0);
    let residue = stage.residue(0);
    let case = Case {
        up_to_rad_s: 102.0,
        ..Case::of(&stage).with_sigma(Parameter::Residue(0), residue / 1.5)
    };
    let mut changed = case.fit.clone();
    changed.parameters.modes[0].residue_per_kg = -residue;
    for (fit, is_covered) in [(&case.fit, false), (&changed, true)] {
        let found = zeros(fit).expect("zeros");
        assert_eq!(found.len(), 1);
        assert!(found[0].s.re < 0.0 && case.input().covers(found[0].s.norm()) == is_covered);
    }
    assert!(decisive_quantities(&case.input()).unwrap().is_empty());
}
