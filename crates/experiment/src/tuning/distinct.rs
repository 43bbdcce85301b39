//! Each response of a design is of another operating point, and all are of one loop rate.

use super::error::TuneSourceError;
use super::source::FrfSource;
use bench_identify::modal::FittedMode;

/// Two numbers differ if their distance is more than this multiple of its standard deviation.
const DIFFERENT_SIGMAS: f64 = 5.0;
/// Modes whose frequencies differ by less than this ratio are those of one operating point: reproducible measurements differ by as much.
const SAME_FREQUENCY: f64 = 1e-4;

/// Refuses recordings of different loop rates, and two files of one operating point: the same content, or recordings with the same
/// settings of the stage.
///
/// # Errors
/// [`TuneSourceError::Rates`], [`TuneSourceError::SamePoint`].
pub fn check_distinct(sources: &[FrfSource]) -> Result<(), TuneSourceError> {
    for (k, second) in sources.iter().enumerate() {
        for first in &sources[..k] {
            check_rates(first, second)?;
            let why = if first.sha256 == second.sha256 {
                "their content is the same".to_string()
            } else if let Some(name) = same_point(first, second) {
                format!("both recordings are of {name}")
            } else {
                continue;
            };
            return Err(same(first, second, why));
        }
    }
    Ok(())
}

fn check_rates(first: &FrfSource, second: &FrfSource) -> Result<(), TuneSourceError> {
    match (first.recorded_rate_hz(), second.recorded_rate_hz()) {
        (Some(first_hz), Some(second_hz)) if first_hz != second_hz => Err(TuneSourceError::Rates {
            first: first.file.clone(),
            first_hz,
            second: second.file.clone(),
            second_hz,
        }),
        _ => Ok(()),
    }
}

fn same(first: &FrfSource, second: &FrfSource, why: String) -> TuneSourceError {
    TuneSourceError::SamePoint {
        first: first.file.clone(),
        second: second.file.clone(),
        why,
    }
}

/// The operating point of two recordings, if it is the same.
fn same_point(first: &FrfSource, second: &FrfSource) -> Option<String> {
    let (a, b) = (first.recorded_point()?, second.recorded_point()?);
    (a == b).then(|| second.point_name()).flatten()
}

/// Refuses two responses whose modes do not differ; each is a file with the modes that the design uses with their signs.
///
/// # Errors
/// [`TuneSourceError::SamePoint`].
pub(super) fn check_modes(frfs: &[(&FrfSource, Vec<FittedMode>)]) -> Result<(), TuneSourceError> {
    for (k, (second, modes)) in frfs.iter().enumerate() {
        let mut before = frfs[..k].iter();
        if let Some((first, _)) = before.find(|(_, other)| are_same(other, modes)) {
            let why = "their modes do not differ by more than their confidence intervals";
            return Err(same(first, second, why.into()));
        }
    }
    Ok(())
}

fn are_same(a: &[FittedMode], b: &[FittedMode]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
}

fn is_same(a: &FittedMode, b: &FittedMode) -> bool {
    let (f, g) = (a.omega_rad_s, b.omega_rad_s);
    let (r, q) = (a.residue_per_kg, b.residue_per_kg);
    let frequency = DIFFERENT_SIGMAS * f.sigma.hypot(g.sigma) + SAME_FREQUENCY * f.value;
    let residue = DIFFERENT_SIGMAS * r.sigma.hypot(q.sigma);
    (f.value - g.value).abs() < frequency && (r.value - q.value).abs() < residue
}
