//! Phases that continue beyond ±180 degrees.

const TURN_DEG: f64 = 360.0;
/// Offsets are determined within this ratio of the lowest common frequency.
const COMPARED_RATIO: f64 = 10.0;

/// Largest difference of two neighbouring phases in degrees at which the direction of the turn is certain.
const MAX_CHANGE_DEG: f64 = 120.0;

/// Whether an unwrapped phase would be a guess: two neighbouring valid phases differ by more than 120 degrees, so that a turn to
/// the other side is as likely, or less than half of the phases between the first and the last valid one are valid.
///
/// Few frequencies around a lightly damped mode, or much noise, have this effect. Whole turns are irrelevant.
pub fn is_ambiguous(phase_deg: &[f64], valid: &[bool]) -> bool {
    let phases = phase_deg.iter().zip(valid).enumerate();
    let known: Vec<(usize, f64)> = phases
        .filter(|(_, (_, valid))| **valid)
        .map(|(k, (phase, _))| (k, *phase))
        .collect();
    let ([(first, _), ..], [.., (last, _)]) = (&known[..], &known[..]) else {
        return !phase_deg.is_empty();
    };
    let changes = known.windows(2).map(|pair| (pair[0].1, pair[1].1));
    let is_large = |(before, after)| f64::abs(closest(after, before) - before) > MAX_CHANGE_DEG;
    2 * known.len() < last - first + 1 || changes.into_iter().any(is_large)
}

/// Unwrapped phases in degrees: each the value closest to the valid one before it, plus whole turns.
///
/// A phase that is not valid (too noisy) is placed near its neighbours, but those after it do not follow it: noise in
/// a deep anti-resonance adds no turns. The first valid phase stays in (-180, 180]: a plant with a positive DC gain
/// starts near 0.
pub fn unwrapped_deg(wrapped_deg: &[f64], valid: &[bool]) -> Vec<f64> {
    let first = valid.iter().position(|valid| *valid).unwrap_or(0);
    let mut last = wrapped_deg.get(first).copied().unwrap_or(0.0);
    let mut unwrapped = Vec::with_capacity(wrapped_deg.len());
    for (phase, valid) in wrapped_deg.iter().zip(valid) {
        let phase = closest(*phase, last);
        if *valid {
            last = phase;
        }
        unwrapped.push(phase);
    }
    unwrapped
}

/// The phase plus the whole turns that bring it closest to another.
pub fn closest(phase_deg: f64, to_deg: f64) -> f64 {
    phase_deg + TURN_DEG * ((to_deg - phase_deg) / TURN_DEG).round()
}

/// Whole turns in degrees that bring a curve closest to another at most of their lowest common decade.
///
/// Both are (frequency, phase) with rising frequencies. 0 if they have no frequency in common. Only the lowest decade
/// decides, since two different responses, such as S and T, may differ by turns above it.
pub fn offset_deg(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> f64 {
    let differences = differences_deg(curve, reference);
    let lowest = differences.first().map_or(0.0, |first| first.0);
    let compared = differences
        .iter()
        .take_while(|(frequency, _)| *frequency <= COMPARED_RATIO * lowest);
    let mut turns: Vec<f64> = compared
        .map(|(_, difference)| (difference / TURN_DEG).round())
        .collect();
    turns.sort_by(f64::total_cmp);
    let median = turns.get(turns.len() / 2);
    median.map_or(0.0, |turns| turns * TURN_DEG)
}

/// The common frequencies, and the reference minus the curve there.
fn differences_deg(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let points = curve.iter();
    points
        .filter_map(|(frequency, phase)| Some((*frequency, at(reference, *frequency)? - phase)))
        .collect()
}

/// A curve at a frequency within its range: the last point at or below it.
fn at(curve: &[(f64, f64)], frequency: f64) -> Option<f64> {
    let after = curve.partition_point(|point| point.0 <= frequency);
    let within = curve.last().is_some_and(|last| frequency <= last.0);
    let point = curve.get(after.checked_sub(1)?);
    point.filter(|_| within).map(|point| point.1)
}
