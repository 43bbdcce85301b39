//! The names under which programs save the parts of a controller.

/// Numerator of a ratio of polynomials.
pub(super) const NUMERATOR: &[&str] = &["num", "numerator"];
/// Denominator of a ratio of polynomials.
pub(super) const DENOMINATOR: &[&str] = &["den", "denominator"];
/// Zeros.
pub(super) const ZEROS: &[&str] = &["z", "zeros"];
/// Poles.
pub(super) const POLES: &[&str] = &["p", "poles"];
/// Gain of zeros and poles.
pub(super) const GAIN: &[&str] = &["k", "gain"];
/// Matrices.
pub(super) const A: &[&str] = &["A", "a"];
/// Input matrix.
pub(super) const B: &[&str] = &["B", "b"];
/// Output matrix.
pub(super) const C: &[&str] = &["C", "c"];
/// Feedthrough.
pub(super) const D: &[&str] = &["D", "d"];
/// Sampling period in seconds.
pub(super) const PERIOD: &[&str] = &["Ts", "dt"];

/// Whether the variable is a list of zeros or poles.
pub(super) fn is_root_list(name: &str) -> bool {
    ZEROS.contains(&name) || POLES.contains(&name)
}
