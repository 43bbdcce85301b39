//! Modes and zeros of a fit.

use super::interval_of;
use crate::number::{interval, percent};
use crate::table::Table;
use bench_base::units::hz;
use bench_identify::modal::{FittedMode, SIGMAS_95};
use bench_identify::verdict::UncertainZero;

/// The column that a narrow table can leave out.
pub const OTHER_SIGN: &str = "Probability of the other sign";

/// The modes with their 95 % confidence intervals. A sign is `?` if the interval of the residue contains 0.
pub fn mode_table(modes: &[FittedMode], residue_unit: &str) -> Table {
    let residue = format!("Residue ({residue_unit})");
    let columns = [
        "Frequency (Hz)",
        "Damping ratio",
        &residue,
        "Sign",
        OTHER_SIGN,
    ];
    Table::new(columns).with_rows(modes.iter().map(mode_row))
}

fn mode_row(mode: &FittedMode) -> Vec<String> {
    let sign = mode.certain_sign().to_string().replace('-', "\u{2212}");
    vec![
        interval_of(mode.frequency_hz()),
        interval_of(mode.damping_ratio),
        interval_of(mode.residue_per_kg),
        sign,
        percent(mode.sign_error_probability()),
    ]
}

/// The zeros; of a conjugate pair the one above the real axis.
pub fn zero_table(zeros: &[UncertainZero]) -> Table {
    let columns = [
        "|s| (Hz)",
        "Real part (rad/s)",
        "Imaginary part (rad/s)",
        "Kind",
        "Right of the axis",
    ];
    Table::new(columns).with_rows(zeros.iter().map(zero_row))
}

fn zero_row(zero: &UncertainZero) -> Vec<String> {
    let half_width = SIGMAS_95 * zero.covariance[1][1].sqrt();
    let imaginary_part = if zero.s.im == 0.0 {
        "0".into()
    } else {
        interval(zero.s.im, half_width)
    };
    vec![
        format!("{:.3}", hz(zero.s.norm())),
        interval_of(zero.real_part()),
        imaginary_part,
        zero.kind.name().into(),
        percent(zero.rhp_probability),
    ]
}
