//! The margins of a loop as text, each with the frequency at which it is reached.

use super::number::{angular_frequency, plain};
use bench_base::units::hz;
use bench_control::Margins;

/// Names and values of the margins of a stable loop; `None` where there is no such crossing.
pub fn margin_rows(margins: &Margins) -> Vec<(&'static str, Option<String>)> {
    let decibels = |db: Option<f64>, rad_s: Option<f64>| {
        let (db, rad_s) = db.zip(rad_s)?;
        Some(format!("{} dB {}", plain(db, 2), place(rad_s)))
    };
    let bandwidth = margins.sensitivity_bandwidth_rad_s;
    let mut rows = vec![
        ("crossover", margins.crossover_rad_s.map(angular_frequency)),
        ("phase margin", phase_margin(margins)),
        (
            "gain margin",
            decibels(margins.gain_margin_db, margins.gain_margin_rad_s),
        ),
    ];
    // Without a lower one the gain margin is the upper one.
    if margins.lower_gain_margin_db.is_some() {
        let (upper_db, upper_rad_s) = (
            margins.upper_gain_margin_db,
            margins.upper_gain_margin_rad_s,
        );
        let (lower_db, lower_rad_s) = (
            margins.lower_gain_margin_db,
            margins.lower_gain_margin_rad_s,
        );
        rows.push(("upper gain margin", decibels(upper_db, upper_rad_s)));
        rows.push(("lower gain margin", decibels(lower_db, lower_rad_s)));
    }
    rows.extend([
        ("delay margin", delay_margin(margins)),
        ("modulus margin", Some(modulus_margin(margins))),
        ("sensitivity bandwidth", bandwidth.map(angular_frequency)),
    ]);
    rows
}

/// The smallest phase margin, its crossing, and how many there are.
fn phase_margin(margins: &Margins) -> Option<String> {
    let (deg, rad_s) = margins.phase_margin_deg.zip(margins.phase_margin_rad_s)?;
    let count = crossing_count(margins.crossings.len());
    Some(format!("{} deg {}{count}", plain(deg, 2), place(rad_s)))
}

/// How many crossings of |L| = 1 there are, if more than one.
pub fn crossing_count(count: usize) -> String {
    match count {
        0 | 1 => String::new(),
        count => format!("; {count} crossings"),
    }
}

fn delay_margin(margins: &Margins) -> Option<String> {
    let (delay_s, rad_s) = margins.delay_margin_s.zip(margins.delay_margin_rad_s)?;
    Some(format!("{:.3} ms {}", 1e3 * delay_s, place(rad_s)))
}

fn modulus_margin(margins: &Margins) -> String {
    format!(
        "{:.4} {} (peak of S {} dB)",
        margins.modulus_margin,
        place(margins.sensitivity_peak_rad_s),
        plain(margins.sensitivity_peak_db, 2)
    )
}

/// `at 70.64 Hz`.
pub fn place(rad_s: f64) -> String {
    format!("at {:.2} Hz", hz(rad_s))
}
