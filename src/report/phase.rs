//! Phases that run on past +-180 degrees.

/// Degrees of one turn.
const TURN: f64 = 360.0;

/// Unwrapped phases in degrees: each the value closest to the trusted one before it, give or take whole turns.
///
/// A phase that is not trusted is drawn near its neighbours but leads nobody on: noise in a deep anti-resonance does
/// not add turns to everything after it. The first trusted phase stays in (-180, 180]: a plant with a positive DC gain
/// starts near 0.
pub fn unwrapped_deg(wrapped_deg: &[f64], trusted: &[bool]) -> Vec<f64> {
    let first = trusted.iter().position(|trusted| *trusted).unwrap_or(0);
    let mut last = wrapped_deg.get(first).copied().unwrap_or(0.0);
    let follow = |(phase, trusted): (&f64, &bool)| {
        let unwrapped = closest(*phase, last);
        if *trusted {
            last = unwrapped;
        }
        unwrapped
    };
    wrapped_deg.iter().zip(trusted).map(follow).collect()
}

/// The phase, give or take whole turns, that is closest to another.
pub fn closest(phase_deg: f64, to_deg: f64) -> f64 {
    phase_deg + TURN * ((to_deg - phase_deg) / TURN).round()
}

/// Whole turns in degrees that bring one curve closest to another at most of the frequencies at which both are known.
///
/// Both are (frequency, phase) with rising frequencies. 0 if they have no frequency in common.
pub fn offset_deg(curve: &[(f64, f64)], reference: &[(f64, f64)]) -> f64 {
    let mut turns: Vec<f64> = curve
        .iter()
        .filter_map(|(frequency, phase)| {
            Some(((at(reference, *frequency)? - phase) / TURN).round())
        })
        .collect();
    turns.sort_by(f64::total_cmp);
    turns
        .get(turns.len() / 2)
        .map_or(0.0, |median| median * TURN)
}

/// A curve at a frequency: the last point that is not above it, if any is and it is not past the end.
fn at(curve: &[(f64, f64)], frequency: f64) -> Option<f64> {
    let after = curve.partition_point(|point| point.0 <= frequency);
    let within = curve.last().is_some_and(|last| frequency <= last.0);
    curve
        .get(after.checked_sub(1)?)
        .filter(|_| within)
        .map(|point| point.1)
}
