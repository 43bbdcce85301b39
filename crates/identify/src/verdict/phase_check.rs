//! The data of the phase criterion: the smoothed response where it is significant, from below the first mode to above the last mode
//! and the last pair of zeros.

use nalgebra::Complex;

use super::input::VerdictInput;
use super::phase_drop::{PhaseCurve, PhaseDrop, Roots, phase_drop};
use super::zeros::UncertainZero;
use crate::FrfDatum;
use crate::modal::{FittedMode, merged};
use bench_plant::PlantError;
use bench_plant::zeros::ModalSum;

/// A response is significant above this multiple of the power of its noise: its phase has a standard deviation of 9 degrees.
const SIGNIFICANT_POWER: f64 = 20.0;
/// The phase is followed from this ratio of the first mode ...
const BELOW_FIRST: f64 = 0.5;
/// ... to this ratio of the last mode or pair of zeros.
const ABOVE_LAST: f64 = 1.1;
/// Beyond the data the fit is used over this factor in frequency ...
const BEYOND_FACTOR: f64 = 1000.0;
/// ... with steps of this ratio.
const BEYOND_RATIO: f64 = 0.002;

/// The phase drop over the modes of the verdict; `None` with fewer than two modes, or with too few significant data. `zeros` are all
/// zeros of the fit.
///
/// # Errors
/// When the fit is no sum of modes.
pub(super) fn phase_drop_over(
    input: &VerdictInput<'_>,
    modes: &[FittedMode],
    zeros: &[UncertainZero],
) -> Result<Option<PhaseDrop>, PlantError> {
    let [first, .., _] = modes else {
        return Ok(None);
    };
    let from_rad_s = BELOW_FIRST * first.omega_rad_s.value;
    let to_rad_s = (ABOVE_LAST * last_rad_s(input, modes, zeros)).min(input.up_to_rad_s);
    let curve = curve(input)?;
    let omega = &curve.omega_rad_s;
    let from = omega.partition_point(|omega| *omega < from_rad_s);
    let to = omega.partition_point(|omega| *omega <= to_rad_s);
    if from + 1 >= to {
        return Ok(None);
    }
    Ok(Some(phase_drop(&curve, &roots(input, zeros), from, to - 1)))
}

/// The highest mode with a certain residue or pair of zeros of the verdict.
fn last_rad_s(input: &VerdictInput<'_>, modes: &[FittedMode], zeros: &[UncertainZero]) -> f64 {
    let certain = modes.iter().filter(|mode| input.has_certain_residue(mode));
    let modes = certain.map(|mode| mode.omega_rad_s.value);
    let pairs = zeros.iter().filter(|zero| zero.s.im > 0.0);
    let pairs = pairs
        .map(|zero| zero.s.norm())
        .filter(|omega| input.covers(*omega));
    modes.chain(pairs).fold(0.0, f64::max)
}

/// The smoothed data beside the fit, both of the mechanics alone. Data that are not significant have the value of the fit.
///
/// Aliases of modes with real residues are those of the stage. Complex ones may take the place of a digital filter, which has no
/// response between the samples: a zero of theirs of which the samples show nothing is none of the stage.
fn curve(input: &VerdictInput<'_>) -> Result<PhaseCurve, PlantError> {
    let parameters = &input.fit.parameters;
    let used = input.fit.used_data(input.frf_data);
    let data = significant_range(merged(&used, parameters));
    let sum = parameters.sum()?;
    let omega_rad_s: Vec<f64> = data.iter().map(FrfDatum::omega_rad_s).collect();
    let fitted: Vec<Complex<f64>> = omega_rad_s
        .iter()
        .map(|omega| sum.response(Complex::new(0.0, *omega)))
        .collect();
    let delay_s = parameters.delay_s;
    let mut measured = if parameters.has_real_residues() {
        let frequency_hz: Vec<f64> = data.iter().map(|datum| datum.frequency_hz).collect();
        let through_chain = input.fit.response(input.chain, &frequency_hz);
        let chain = input.chain;
        chain.mechanics(&data, delay_s, &fitted, &through_chain)
    } else {
        input.chain.without_chain(&data, delay_s)
    };
    for ((measured, fitted), datum) in measured.iter_mut().zip(&fitted).zip(&data) {
        if !is_significant(datum) {
            *measured = *fitted;
        }
    }
    let ends = [omega_rad_s.first(), omega_rad_s.last()];
    let [first, last] = ends.map(|omega| omega.copied().unwrap_or(1.0));
    Ok(PhaseCurve {
        below: fitted_magnitude(&sum, first / BEYOND_FACTOR, first),
        above: fitted_magnitude(&sum, last, last * BEYOND_FACTOR),
        measured,
        fitted,
        omega_rad_s,
    })
}

/// Frequencies between two others, rising in equal ratios, with ln|G| of a fit.
fn fitted_magnitude(sum: &ModalSum, low_rad_s: f64, high_rad_s: f64) -> Vec<(f64, f64)> {
    let steps = (high_rad_s / low_rad_s).ln() / BEYOND_RATIO;
    let omega = (1..steps as usize).map(|k| low_rad_s * (k as f64 * BEYOND_RATIO).exp());
    let height = |omega| sum.response(Complex::new(0.0, omega)).norm().ln();
    omega.map(|omega| (omega, height(omega))).collect()
}

/// The data from the first to the last significant one.
fn significant_range(data: Vec<FrfDatum>) -> Vec<FrfDatum> {
    let first = data.iter().position(is_significant).unwrap_or(data.len());
    let end = data
        .iter()
        .rposition(is_significant)
        .map_or(first, |last| last + 1);
    data[first..end].to_vec()
}

fn is_significant(datum: &FrfDatum) -> bool {
    datum.response.norm_sqr() > SIGNIFICANT_POWER * datum.variance
}

fn roots(input: &VerdictInput<'_>, zeros: &[UncertainZero]) -> Roots {
    Roots {
        poles: input.fit.poles().iter().map(|pole| pole.s).collect(),
        zeros: zeros.iter().map(|zero| zero.s).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_plant::zeros::ModalTerm;

    /// A datum whose response has the power of its noise times a ratio.
    fn datum(frequency_hz: f64, power_ratio: f64) -> FrfDatum {
        FrfDatum {
            frequency_hz,
            spread_hz: 0.0,
            response: Complex::new(0.0, 2.0),
            variance: 4.0 / power_ratio,
        }
    }

    #[test]
    fn datum_is_significant_above_twenty_times_the_power_of_its_noise() {
        // |2 j|^2 = 20 x 0.2, without rounding.
        assert_eq!(SIGNIFICANT_POWER * 0.2, 4.0);
        for (power_ratio, expected) in [(19.9, false), (20.0, false), (20.1, true)] {
            assert_eq!(is_significant(&datum(1.0, power_ratio)), expected);
        }
        let none = FrfDatum {
            response: Complex::new(0.0, 0.0),
            variance: 0.0,
            ..datum(1.0, 1.0)
        };
        assert!(!is_significant(&none));
    }

    #[test]
    fn data_are_those_from_the_first_to_the_last_significant_one() {
        for (power_ratios, expected) in [
            (vec![1.0, 30.0, 1.0, 30.0, 1.0], vec![1.0, 2.0, 3.0]),
            (vec![1.0, 1.0, 30.0], vec![2.0]),
            (vec![30.0, 1.0], vec![0.0]),
            (vec![1.0, 1.0], vec![]),
            (vec![], vec![]),
        ] {
            let data = power_ratios.iter().zip(0..);
            let data = data.map(|(ratio, hz)| datum(f64::from(hz), *ratio));
            let range = significant_range(data.collect());
            let found: Vec<f64> = range.iter().map(|datum| datum.frequency_hz).collect();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn magnitude_beyond_the_data_is_that_of_the_fit_in_equal_ratios() {
        // G = 1/(s^2 + 2 x 0.1 x 10 s + 100) at ln w = ln 5 + 0.002 k, below ln w = ln 5 + 0.0211.
        let mode = ModalTerm {
            omega_rad_s: 10.0,
            damping_ratio: 0.1,
            residue_per_kg: 1.0,
        };
        let sum = ModalSum::new(vec![mode], 0.0).expect("a sum of modes");
        let points = fitted_magnitude(&sum, 5.0, 5.0 * 0.0211_f64.exp());
        assert_eq!(points.len(), 9);
        for ((omega, height), k) in points.into_iter().zip(1..) {
            let expected = 5.0 * (0.002 * f64::from(k)).exp();
            assert!((omega / expected - 1.0).abs() < 1e-14, "{k}: {omega}");
            let closed_form = -(100.0 - omega * omega).hypot(2.0 * omega).ln();
            assert!((height - closed_form).abs() < 1e-13, "{k}: {height}");
        }
    }
}
