//! Modes and zeros of a fit.

use super::interval_of;
use crate::number::{NEGLIGIBLE_PROBABILITY, interval, percent, significant};
use crate::table::{Table, Width};
use bench_base::units::{hz, hz_text};
use bench_identify::modal::{FittedMode, SIGMAS_95};
use bench_identify::verdict::UncertainZero;

/// What the signs and columns of complex residues mean.
pub const COMPLEX_RESIDUES_NOTE: &str = "c: a complex residue, which has no sign; its parts are those of the numerator at the natural frequency (the damping is not proportional, or there is a filter or an additional lag between input and output)";

/// Whether residues of the table are complex, so that [`COMPLEX_RESIDUES_NOTE`] belongs to it.
pub fn has_complex_residues(modes: &[FittedMode]) -> bool {
    let mut modes = modes.iter();
    modes.any(|mode| mode.residue_imaginary_per_kg.is_some())
}

/// The modes with their 95 % confidence intervals. A sign is `?` if the interval of the residue contains 0, and `c` of a complex residue,
/// whose imaginary part has a column of its own.
/// The probability of the other sign is for pages.
pub fn mode_table(modes: &[FittedMode], residue_unit: &str, width: Width) -> Table {
    if has_complex_residues(modes) {
        return complex_mode_table(modes, residue_unit);
    }
    let residue = format!("Residue ({residue_unit})");
    let columns = ["Frequency (Hz)", "Damping ratio", &residue, "Sign"];
    let columns = columns
        .into_iter()
        .chain(width.page_only("Probability of the other sign"));
    Table::new(columns).with_rows(modes.iter().map(|mode| mode_row(mode, width)))
}

/// In place of a table, if all modes lie outside the band of their fit.
pub const NO_MODES_IN_BAND: &str = "No mode lies in the analysed band.";

/// What modes outside the band of a fit are.
pub fn outside_band_note((low_hz, high_hz): (f64, f64)) -> String {
    format!(
        "Modes outside the analysed band, {} to {} Hz: they represent all that lies beyond it, and are not determined as modes of the stage.",
        significant(low_hz, 4),
        significant(high_hz, 4)
    )
}

fn mode_row(mode: &FittedMode, width: Width) -> Vec<String> {
    let sign = mode.certain_sign().to_string().replace('-', "\u{2212}");
    let [frequency, damping] = frequency_and_damping(mode);
    let mut cells = vec![frequency, damping, interval_of(mode.residue_per_kg), sign];
    cells.extend(width.page_only(percent(mode.sign_error_probability())));
    cells
}

/// Frequency in hertz and damping ratio; a free body has neither.
fn frequency_and_damping(mode: &FittedMode) -> [String; 2] {
    if mode.omega_rad_s.value == 0.0 {
        return ["0 (free body)".into(), String::new()];
    }
    [
        interval_of(mode.frequency_hz()),
        interval_of(mode.damping_ratio),
    ]
}

/// The table of modes with complex residues: real and imaginary part of r + j q w.
fn complex_mode_table(modes: &[FittedMode], residue_unit: &str) -> Table {
    let real = format!("Residue ({residue_unit})");
    let columns = [
        "Frequency (Hz)",
        "Damping ratio",
        &real,
        "Imaginary part",
        "Sign",
    ];
    Table::new(columns).with_rows(modes.iter().map(complex_mode_row))
}

fn complex_mode_row(mode: &FittedMode) -> Vec<String> {
    let imaginary = mode.residue_imaginary_per_kg;
    let [frequency, damping] = frequency_and_damping(mode);
    vec![
        frequency,
        damping,
        interval_of(mode.residue_per_kg),
        imaginary.map_or_else(String::new, interval_of),
        mode.certain_sign().to_string(),
    ]
}

/// The zeros; of a conjugate pair the one above the real axis. Those come first that may lie right of the imaginary axis: they decide
/// the verdict.
pub fn zero_table(zeros: &[UncertainZero]) -> Table {
    let columns = [
        "|s| (Hz)",
        "Real part (rad/s)",
        "Imaginary part (rad/s)",
        "Kind",
        "Right of the axis",
    ];
    let (right, left): (Vec<&UncertainZero>, Vec<&UncertainZero>) = zeros
        .iter()
        .partition(|zero| zero.rhp_probability >= NEGLIGIBLE_PROBABILITY);
    Table::new(columns).with_rows(right.into_iter().chain(left).map(zero_row))
}

fn zero_row(zero: &UncertainZero) -> Vec<String> {
    let half_width = SIGMAS_95 * zero.covariance[1][1].sqrt();
    let imaginary_part = if zero.s.im == 0.0 {
        "0".into()
    } else {
        interval(zero.s.im, half_width)
    };
    vec![
        hz_text(hz(zero.s.norm()), 3),
        interval_of(zero.real_part()),
        imaginary_part,
        zero.kind.name().into(),
        percent(zero.rhp_probability),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_identify::Estimate;

    #[test]
    fn terminal_has_all_columns_but_the_probability_of_the_other_sign() {
        let estimate = |value: f64| Estimate { value, sigma: 0.01 };
        let mode = FittedMode {
            omega_rad_s: estimate(184.0),
            damping_ratio: estimate(0.05),
            residue_per_kg: estimate(-0.5),
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        };
        let [page, terminal] =
            [Width::Page, Width::Terminal].map(|w| mode_table(&[mode], "1/kg", w));
        assert_eq!(page.columns[4], "Probability of the other sign");
        // The residue is 50 sigma below 0.
        assert_eq!(page.rows[0][3..], ["\u{2212}", "below 0.01 %"]);
        assert_eq!(page.columns[..4], terminal.columns);
        assert_eq!(page.rows[0][..4], terminal.rows[0]);
    }

    #[test]
    fn a_free_body_has_no_frequency_and_no_damping() {
        let exact = |value: f64| Estimate { value, sigma: 0.0 };
        let body = FittedMode {
            omega_rad_s: exact(0.0),
            damping_ratio: exact(0.0),
            residue_per_kg: Estimate {
                value: 0.5,
                sigma: 0.01,
            },
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        };
        let table = mode_table(&[body], "1/kg", Width::Terminal);
        assert_eq!(table.rows[0], ["0 (free body)", "", "0.500 ± 0.020", "+"]);
    }

    #[test]
    fn note_of_modes_outside_states_the_band() {
        let note = outside_band_note((5.0, 100.0));
        assert!(note.contains("band, 5.000 to 100.0 Hz:"), "{note}");
    }

    #[test]
    fn zeros_that_may_lie_right_of_the_axis_come_first() {
        let zero = |im: f64, rhp_probability: f64| UncertainZero {
            s: nalgebra::Complex::new(1.0, im),
            kind: bench_plant::zeros::ZeroKind::Mmp,
            covariance: [[1e-6, 0.0], [0.0, 1e-6]],
            rhp_probability,
            difference: nalgebra::Complex::new(0.0, 0.0),
        };
        let zeros = [
            zero(10.0, 9e-5),
            zero(20.0, 0.5),
            zero(30.0, 0.0),
            zero(40.0, 1.0),
        ];
        let rows = zero_table(&zeros).rows;
        let order: Vec<&str> = rows.iter().map(|row| row[2].as_str()).collect();
        assert_eq!(
            order.join(" "),
            "20.0000 ± 0.0020 40.0000 ± 0.0020 10.0000 ± 0.0020 30.0000 ± 0.0020"
        );
    }

    #[test]
    fn complex_residue_has_two_parts_and_no_sign() {
        let estimate = |value: f64| Estimate { value, sigma: 0.01 };
        let mode = FittedMode {
            omega_rad_s: estimate(184.0),
            damping_ratio: estimate(0.05),
            residue_per_kg: estimate(-0.5),
            residue_imaginary_per_kg: Some(estimate(0.25)),
            turned_by_one_more: 0.0,
        };
        assert!(has_complex_residues(&[mode]));
        for width in [Width::Page, Width::Terminal] {
            let table = mode_table(&[mode], "1/kg", width);
            assert_eq!(
                table.columns[2..],
                ["Residue (1/kg)", "Imaginary part", "Sign"]
            );
            assert_eq!(
                table.rows[0][3..],
                [interval_of(estimate(0.25)), "c".into()]
            );
        }
    }
}
