//! From the numbers of a table to a response.

use std::f64::consts::PI;

use bench_identify::scatter::{MIN_POINTS, Scatter, SigmaSource};
use bench_identify::{Frf, FrfPoint};
use num_complex::Complex;

use super::ImportedFrf;
use super::columns::{Columns, Pair, PhaseUnit, Scale};
use super::error::FrfTableError;
use super::numbers::{Numbers, Row};
use super::unit::UnitRule;

/// Phases with a larger one are degrees: in radians it would be ten turns.
const DEGREES: f64 = 60.0;
/// Phases of which none is larger than half a turn, but some than this, are radians: in degrees the response would have no resonance.
const RADIANS: f64 = 1.5;
/// Rounding of pi by other programs, in their fourth digit.
const ROUNDING: f64 = 1.001;
/// A magnitude of less decibels (re 1 m/A), and no larger one, is in decibels; real and imaginary parts of such a size are of no stage.
const DECIBELS: f64 = -20.0;
/// Magnitudes of any unit with a larger range are linear: decibels that are all positive would need one of less than 0.1 dB beside one
/// of more than 100 dB, or the like.
const LINEAR_RANGE: f64 = 1e3;
/// Largest real or imaginary part in m/A by which two columns without names are such parts.
const LARGEST_PART: f64 = 0.1;

/// The response; `given` is the unit of the phases, whatever the file states.
pub(super) fn response(
    numbers: &Numbers,
    columns: Columns,
    given: Option<PhaseUnit>,
    rule: UnitRule,
) -> Result<ImportedFrf, FrfTableError> {
    let mut assumptions = Vec::new();
    if numbers.without_zero {
        assumptions.push("the line at 0 Hz is left out".into());
    }
    let hz_per_unit = columns.hz_per_unit.unwrap_or_else(|| {
        let column = &columns.frequency;
        assumptions.push(format!("column `{column}` states no unit: its frequencies are taken as Hz (name it omega or rad/s for rad/s)"));
        1.0
    });
    let pair = determined(numbers, &columns.pair, rule, &mut assumptions)?;
    let values = values(numbers, &pair, given, &mut assumptions)?;
    let frequency_hz: Vec<f64> = numbers
        .rows
        .iter()
        .map(|row| hz_per_unit * row.frequency)
        .collect();
    let (frf, sigma) = with_sigma(numbers, &frequency_hz, &values)?;
    Ok(ImportedFrf {
        frf,
        sigma,
        assumptions,
        unit: columns.unit,
        has_coherence: columns.coherence.is_some(),
    })
}

/// What two columns without names are, by their numbers.
fn determined(
    numbers: &Numbers,
    pair: &Pair,
    rule: UnitRule,
    assumptions: &mut Vec<String>,
) -> Result<Pair, FrfTableError> {
    let Pair::Unknown([first, second]) = pair else {
        return Ok(pair.clone());
    };
    let Some(kind) = PairKind::of(numbers, rule) else {
        return Err(FrfTableError::Unnamed {
            path: numbers.path.clone(),
        });
    };
    assumptions.push(format!(
        "the columns have no names: by {} they are frequency, {}",
        kind.evidence(numbers),
        kind.description(rule)
    ));
    let polar = |scale| Pair::Polar {
        magnitude: first.clone(),
        scale,
        phase: second.clone(),
        phase_unit: (kind == PairKind::FrdFile).then_some(PhaseUnit::Deg),
    };
    Ok(match kind {
        PairKind::Linear => polar(Scale::Linear),
        PairKind::Decibels | PairKind::FrdFile => polar(Scale::Decibels),
        PairKind::Parts => Pair::Cartesian {
            real: first.clone(),
            imaginary: second.clone(),
        },
    })
}

/// What two columns may be.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PairKind {
    Linear,
    Decibels,
    Parts,
    /// Decibels and degrees, by the definition of this kind of file.
    FrdFile,
}

impl PairKind {
    fn of(numbers: &Numbers, rule: UnitRule) -> Option<PairKind> {
        let all = |is: fn(&[f64; 2]) -> bool| numbers.rows.iter().all(|row| is(&row.pair));
        if rule != UnitRule::MetresPerAmpere && is_frd(numbers) {
            Some(PairKind::FrdFile)
        } else if all(|[first, _]| *first > 0.0) {
            let is_linear = rule == UnitRule::MetresPerAmpere || has_linear_range(numbers);
            is_linear.then_some(PairKind::Linear)
        } else if all(|[first, _]| *first < DECIBELS) {
            Some(PairKind::Decibels)
        } else {
            all(|pair| pair.iter().all(|part| part.abs() < LARGEST_PART)).then_some(PairKind::Parts)
        }
    }

    fn description(self, rule: UnitRule) -> &'static str {
        match (self, rule) {
            (PairKind::Linear, UnitRule::MetresPerAmpere) => "magnitude (m/A) and phase",
            (PairKind::Linear, _) => "magnitude and phase",
            (PairKind::Decibels, UnitRule::MetresPerAmpere) => "magnitude (dB re 1 m/A) and phase",
            (PairKind::Decibels, _) => "magnitude (dB) and phase",
            (PairKind::Parts, UnitRule::MetresPerAmpere) => "real and imaginary part (m/A)",
            (PairKind::Parts, _) => "real and imaginary part",
            (PairKind::FrdFile, _) => "magnitude (dB) and phase (degrees)",
        }
    }

    fn evidence(self, numbers: &Numbers) -> String {
        match self {
            PairKind::FrdFile => format!("the name {}", numbers.path.display()),
            PairKind::Linear | PairKind::Decibels | PairKind::Parts => "their numbers".into(),
        }
    }
}

fn is_frd(numbers: &Numbers) -> bool {
    let extension = numbers.path.extension();
    extension.is_some_and(|extension| extension.eq_ignore_ascii_case("frd"))
}

/// Whether positive magnitudes cannot be decibels of a response in any unit.
fn has_linear_range(numbers: &Numbers) -> bool {
    let magnitudes = || numbers.rows.iter().map(|row| row.pair[0]);
    let least = magnitudes().fold(f64::INFINITY, f64::min);
    magnitudes().fold(0.0, f64::max) > LINEAR_RANGE * least
}

/// The complex response of each line.
fn values(
    numbers: &Numbers,
    pair: &Pair,
    given: Option<PhaseUnit>,
    assumptions: &mut Vec<String>,
) -> Result<Vec<Complex<f64>>, FrfTableError> {
    let rows = numbers.rows.iter().map(|row| row.pair);
    let Pair::Polar {
        scale,
        phase,
        phase_unit,
        ..
    } = pair
    else {
        return Ok(rows.map(|[re, im]| Complex::new(re, im)).collect());
    };
    let rad_per_unit = match given.or(*phase_unit) {
        Some(unit) => rad_per_unit(unit),
        None => rad_per_unit(phase_unit_by_size(numbers, phase, assumptions)?),
    };
    let magnitude = |value: f64| match scale {
        Scale::Linear => value,
        Scale::Decibels => libm::pow(10.0, value / 20.0),
    };
    let polar = rows.map(|[m, p]| Complex::from_polar(magnitude(m), rad_per_unit * p));
    Ok(polar.collect())
}

fn rad_per_unit(unit: PhaseUnit) -> f64 {
    match unit {
        PhaseUnit::Deg => PI / 180.0,
        PhaseUnit::Rad => 1.0,
    }
}

fn phase_unit_by_size(
    numbers: &Numbers,
    column: &str,
    assumptions: &mut Vec<String>,
) -> Result<PhaseUnit, FrfTableError> {
    let sizes = numbers.rows.iter().map(|row| row.pair[1].abs());
    let largest = sizes.fold(0.0, f64::max);
    let (unit, name) = if largest > DEGREES {
        (PhaseUnit::Deg, "degrees")
    } else if (RADIANS..=ROUNDING * PI).contains(&largest) {
        (PhaseUnit::Rad, "radians")
    } else {
        return Err(FrfTableError::PhaseUnit {
            path: numbers.path.clone(),
            column: column.into(),
            largest,
        });
    };
    assumptions.push(format!(
        "column `{column}` states no unit: the largest phase is {largest:.4}, so they are taken as {name} (--frf-phase deg or rad decides)"
    ));
    Ok(unit)
}

/// The points with the standard deviations of the file, or those of the scatter where it has none.
fn with_sigma(
    numbers: &Numbers,
    frequency_hz: &[f64],
    values: &[Complex<f64>],
) -> Result<(Frf, SigmaSource), FrfTableError> {
    let is_given = numbers.rows.iter().all(|row| row.magnitude_sigma.is_some());
    let scatter = if is_given {
        None
    } else {
        let scatter = Scatter::of(frequency_hz, values);
        Some(scatter.ok_or_else(|| FrfTableError::NoScatter {
            path: numbers.path.clone(),
            points: values.len(),
            least: MIN_POINTS,
        })?)
    };
    let mut frf = Frf::default();
    for (k, row) in numbers.rows.iter().enumerate() {
        let given = row.magnitude_sigma.map(|sigma| 2.0 * sigma * sigma);
        let (estimated, correlated) = scatter.as_ref().map_or((0.0, 1), |scatter| {
            (scatter.variance[k], scatter.correlated_points[k])
        });
        let variance = given.unwrap_or(estimated);
        let spacing = correlated as f64 * spacing_hz(frequency_hz, k);
        frf.push(FrfPoint {
            frequency_hz: frequency_hz[k],
            response: values[k],
            coherence: coherence(row, variance, values[k]),
            variance,
            resolution_hz: row.resolution.unwrap_or(spacing),
        });
    }
    let source = if is_given {
        SigmaSource::Given
    } else {
        SigmaSource::Estimated
    };
    Ok((frf, source))
}

/// The coherence of the file, or that of one average with this error: 1/(1 + E|error|^2/|H|^2).
fn coherence(row: &Row, variance: f64, value: Complex<f64>) -> f64 {
    let power = value.norm_sqr();
    row.coherence.unwrap_or(power / (power + variance))
}

/// The noise bandwidth of a point whose file has none: the distance to the nearer neighbour, so that a missing point is a gap.
fn spacing_hz(frequency_hz: &[f64], k: usize) -> f64 {
    let below = k
        .checked_sub(1)
        .map(|before| frequency_hz[k] - frequency_hz[before]);
    let above = frequency_hz.get(k + 1).map(|after| after - frequency_hz[k]);
    let nearer = below.into_iter().chain(above).fold(f64::INFINITY, f64::min);
    if nearer.is_finite() { nearer } else { 0.0 }
}
