//! Frequencies near which a sampled loop changes quickly: its poles and zeros, folded below half the rate.
//!
//! A root s = -sigma + j w of a continuous system appears in the sampled one at z = exp(s T). On the unit circle its influence has the
//! centre Im(ln z)/T, which is the alias of w below pi/T, and the width sigma. Both are given as a pair (centre, width/centre): below
//! half the rate these are frequency and damping ratio.

use nalgebra::Complex;

/// Damping ratio above which a pair needs no points of its own: the logarithmic grid resolves it.
const WIDE: f64 = 0.5;
/// Two pairs are one if their centres differ by less than this part of their width, and their widths by less than the same part.
const SAME: f64 = 0.1;

/// Frequency in rad/s and damping ratio of a mode, or those of its alias if it is above half the rate.
pub(super) fn alias((w, zeta): (f64, f64), period_s: f64) -> (f64, f64) {
    let damped_rad_s = w * (1.0 - zeta * zeta).max(0.0).sqrt();
    if damped_rad_s <= std::f64::consts::PI / period_s {
        return (w, zeta);
    }
    let turn = std::f64::consts::TAU / period_s;
    let folded_rad_s = libm::remainder(damped_rad_s, turn).abs();
    pair(folded_rad_s, zeta * w)
}

/// The pair of a root in the z plane. `None` for a root at 0 or 1, which has no frequency.
pub(super) fn of_root(z: Complex<f64>, period_s: f64) -> Option<(f64, f64)> {
    // A root at 1 is computed with an error of 1e-8 if it is double.
    const AT_ONE: f64 = 1e-7;
    let s = z.ln() / period_s;
    let has_frequency = s.norm().is_finite() && (z - 1.0).norm() > AT_ONE;
    has_frequency.then(|| pair(s.im.abs(), s.re.abs()))
}

/// The pair of a root s of a section that Tustin's rule discretises: z = (1 + s T/2)/(1 - s T/2).
pub(super) fn by_tustin((w, zeta): (f64, f64), period_s: f64) -> Option<(f64, f64)> {
    let root = Complex::new(-zeta * w, w * (1.0 - zeta * zeta).max(0.0).sqrt());
    let half = root * (0.5 * period_s);
    of_root((half + 1.0) / (-half + 1.0), period_s)
}

/// Pairs without those that need no points of their own, and without repetitions.
pub(super) fn distinct(pairs: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for pair in pairs.filter(|(w, zeta)| *w > 0.0 && w.is_finite() && *zeta < WIDE) {
        if !kept.iter().any(|other| is_same(*other, pair)) {
            kept.push(pair);
        }
    }
    kept
}

/// The distance of a root from zero frequency in rad/s.
pub(super) fn magnitude_rad_s((w, zeta): (f64, f64)) -> f64 {
    w * libm::hypot(1.0, zeta)
}

/// A pair of centre and width, both in rad/s. A centre of 0 is represented by a small one, so that the width is kept.
fn pair(centre_rad_s: f64, width_rad_s: f64) -> (f64, f64) {
    let centre_rad_s = centre_rad_s.max(1e-9 * width_rad_s).max(f64::MIN_POSITIVE);
    (centre_rad_s, width_rad_s / centre_rad_s)
}

fn is_same((w0, zeta0): (f64, f64), (w1, zeta1): (f64, f64)) -> bool {
    let (width0, width1) = (zeta0 * w0, zeta1 * w1);
    let tolerance = SAME * width0.min(width1);
    (w1 - w0).abs() <= tolerance && (width1 - width0).abs() <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mode_above_half_the_rate_appears_at_its_alias_with_its_width() {
        let period_s = 1e-3;
        let mode = (std::f64::consts::TAU * 620.0, 1e-3);
        let (w, zeta) = alias(mode, period_s);
        // 1000 Hz - 620 Hz, and the same decay.
        assert!((w - std::f64::consts::TAU * 380.0).abs() < 1e-2, "{w}");
        assert!((w * zeta - mode.0 * mode.1).abs() < 1e-9);
        let root = Complex::from_polar(
            libm::exp(-mode.0 * mode.1 * period_s),
            mode.0 * period_s * (1.0 - 1e-6_f64).sqrt(),
        );
        let (by_root, zeta_by_root) = of_root(root, period_s).unwrap();
        assert!((by_root - w).abs() < 1e-9 * w && (zeta_by_root - zeta).abs() < 1e-9);
        // Below half the rate nothing changes.
        assert_eq!(alias((1000.0, 0.01), period_s), (1000.0, 0.01));
    }

    #[test]
    fn root_by_tustin_is_at_the_warped_frequency() {
        // z = exp(j w T) with w = (2/T) atan(w0 T/2) for an undamped root.
        let (w, _) = by_tustin((3000.0, 1e-9), 2e-4).unwrap();
        assert!((w - 1e4 * libm::atan(0.3)).abs() < 1e-6, "{w}");
        assert_eq!(of_root(Complex::new(1.0, 0.0), 1e-3), None);
        assert_eq!(of_root(Complex::new(0.0, 0.0), 1e-3), None);
    }
}
