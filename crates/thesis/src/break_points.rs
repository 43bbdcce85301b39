//! Values at which zeros meet, in closed form: Eqs. (3-14), (3-16), (4-5), (4-6).

use serde::Serialize;

use bench_plant::zeros::{ModalSum, ModalTerm};

/// The two real s at which the zeros of two damped modes meet as the ratio of their residues varies, Eq. (3-14):
///
/// ```text
///   (zu wu - zv wv) s^2 + (wu^2 - wv^2) s + wu wv (zv wu - zu wv) = 0
/// ```
///
/// In rad/s, the smaller magnitude first; the second is infinite where zu wu = zv wv. `None` where they are complex
/// (large and very different damping) or the frequencies are equal.
pub fn two_mode_break_points(u: &ModalTerm, v: &ModalTerm) -> Option<[f64; 2]> {
    let (wu, zu) = (u.omega_rad_s, u.damping_ratio);
    let (wv, zv) = (v.omega_rad_s, v.damping_ratio);
    let (a, b) = (zu * wu - zv * wv, (wu - wv) * (wu + wv));
    let c = wu * wv * (zv * wu - zu * wv);
    let discriminant = b * b - 4.0 * a * c;
    if b == 0.0 || discriminant < 0.0 {
        return None;
    }
    // The root of the larger magnitude without cancellation, the other one by the product c/a.
    let half = -0.5 * (b + discriminant.sqrt().copysign(b));
    Some([c / half, if a == 0.0 { f64::INFINITY } else { half / a }])
}

/// The two residues of mode R between which it has CMP-CNMP zeros with the undamped modes u and v, the smaller magnitude
/// first; `None` unless the residues of u and v differ in sign.
///
/// Eq. (4-5), where mode R is a double integrator. Elsewhere the squares of all frequencies are shifted by -wR^2: with
/// y = s^2 + wR^2 the mode R becomes r/y, and the zeros in y meet exactly where those in s^2 do.
pub fn critical_residues(omega_r_rad_s: f64, u: &ModalTerm, v: &ModalTerm) -> Option<[f64; 2]> {
    let (xu, xv) = shifted(omega_r_rad_s, u, v)?;
    let (au, av) = (u.residue_per_kg, v.residue_per_kg);
    let middle = av * xu - au * xv;
    let swing = 2.0 * (xu * xv).sqrt() * (-au * av).sqrt();
    let far = middle + swing.copysign(middle);
    // The product of both is ((av xu + au xv)/(xv - xu))^2: no cancellation in the nearer one.
    let product = av * xu + au * xv;
    Some([product * product / far / (xv - xu), far / (xv - xu)])
}

/// The two sums of all three residues at which zeros meet, Eq. (4-6), the smaller magnitude first; shifted as in
/// [`critical_residues`].
pub fn critical_sums(omega_r_rad_s: f64, u: &ModalTerm, v: &ModalTerm) -> Option<[f64; 2]> {
    let (xu, xv) = shifted(omega_r_rad_s, u, v)?;
    let (ru, rv) = (
        (xu * u.residue_per_kg.abs()).sqrt(),
        (xv * v.residue_per_kg.abs()).sqrt(),
    );
    let sum = |root: f64| (root * root / (xv - xu)).copysign(v.residue_per_kg);
    Some([sum(rv - ru), sum(rv + ru)])
}

/// wu^2 - wR^2 and wv^2 - wR^2, for wR < wu < wv and residues of u and v of different sign.
fn shifted(omega_r_rad_s: f64, u: &ModalTerm, v: &ModalTerm) -> Option<(f64, f64)> {
    let square = |w: f64| (w - omega_r_rad_s) * (w + omega_r_rad_s);
    let (xu, xv) = (square(u.omega_rad_s), square(v.omega_rad_s));
    (u.residue_per_kg * v.residue_per_kg < 0.0 && 0.0 < xu && xu < xv).then_some((xu, xv))
}

/// Eq. (3-16): the damping ratio, the same in modes u and v, at which the locus of the zeros of Eq. (3-15) passes through
/// the imaginary axis at w^2 = (kappa wv^2 - wu^2)/(kappa - 1); eta = wu/wv, kappa = |au/av|.
///
/// There both real parts of the condition vanish together. The locus still reaches into the right half plane at this
/// damping: see [`touching_damping`]. `None` unless eta < 1 and kappa > 1/eta^2.
pub fn critical_damping(eta: f64, kappa: f64) -> Option<f64> {
    let q = (kappa - 1.0) / (kappa / eta - eta);
    applies(eta, kappa).then(|| 0.5 * (q + 1.0 / q - eta - 1.0 / eta).max(0.0).sqrt())
}

/// The damping ratio at which the locus of the zeros of Eq. (3-15) touches the imaginary axis: above it there are no zeros
/// in the right half plane for any magnitude of the residues.
///
/// A zero s = jw, X = w^2, makes s^2 (au A + av B)/(A B) real, where A and B are the denominators of v and u:
///
/// ```text
///   (kappa wu - wv) X^2 - (kappa wv - wu) wu wv (2 - 4 zeta^2) X + wu wv (kappa wv^3 - wu^3) = 0
/// ```
///
/// and has one double root X at zeta^2 = 1/2 - sqrt((kappa wu - wv)(kappa wv^3 - wu^3)/(wu wv))/(2 (kappa wv - wu)).
/// Arguments and `None` as in [`critical_damping`].
pub fn touching_damping(eta: f64, kappa: f64) -> Option<f64> {
    let root = ((kappa * eta - 1.0) * (kappa - eta * eta * eta) / eta).sqrt();
    applies(eta, kappa).then(|| (0.5 - root / (2.0 * (kappa - eta))).max(0.0).sqrt())
}

fn applies(eta: f64, kappa: f64) -> bool {
    0.0 < eta && eta < 1.0 && kappa * eta * eta > 1.0 && kappa.is_finite()
}

/// The two dampings of Eq. (3-15) for modes of two frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CriticalDamping {
    /// Frequency of mode u in rad/s.
    pub omega_u_rad_s: f64,
    /// Frequency of mode v in rad/s, above that of u.
    pub omega_v_rad_s: f64,
    /// kappa = |au/av|, above (wv/wu)^2.
    pub ratio: f64,
    /// The damping ratio of Eq. (3-16), [`critical_damping`].
    pub eq_3_16: f64,
    /// The damping ratio above which no zero is in the right half plane, [`touching_damping`].
    pub touching: f64,
}

impl CriticalDamping {
    /// `None` unless 0 < wu < wv and kappa > (wv/wu)^2.
    pub fn new(omega_u_rad_s: f64, omega_v_rad_s: f64, ratio: f64) -> Option<CriticalDamping> {
        let eta = omega_u_rad_s / omega_v_rad_s;
        Some(CriticalDamping {
            omega_u_rad_s,
            omega_v_rad_s,
            ratio,
            eq_3_16: critical_damping(eta, ratio)?,
            touching: touching_damping(eta, ratio)?,
        })
    }
}

/// Closed forms of the thesis, evaluated for the modes at one value of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ClosedForm {
    /// Three undamped modes R, u, v.
    ThreeModes {
        /// The residue of mode R, in 1/kg.
        residue_r: f64,
        /// Eq. (4-5) with mode R as a double integrator: the nearer of the two critical residues.
        eq_4_5: f64,
        /// The same with the squares of all frequencies shifted by -wR^2.
        eq_4_5_shifted: f64,
        /// The sum of all residues.
        b2: f64,
        /// Eq. (4-6), shifted: the nearer of the two critical sums.
        eq_4_6_shifted: f64,
    },
    /// Two damped modes.
    TwoModes {
        /// The break points of Eq. (3-14) in rad/s.
        eq_3_14_rad_s: [f64; 2],
    },
}

impl ClosedForm {
    /// The closed form that applies to the observable modes, with or without damping; `None` where there is none.
    pub fn of(sum: &ModalSum, damped: bool) -> Option<ClosedForm> {
        match (sum.terms(), damped) {
            ([r, u, v], false) => ClosedForm::of_three(r, u, v),
            ([u, v], true) => {
                let eq_3_14_rad_s = two_mode_break_points(u, v)?;
                Some(ClosedForm::TwoModes { eq_3_14_rad_s })
            }
            _ => None,
        }
    }

    fn of_three(r: &ModalTerm, u: &ModalTerm, v: &ModalTerm) -> Option<ClosedForm> {
        let residue_r = r.residue_per_kg;
        let b2 = residue_r + u.residue_per_kg + v.residue_per_kg;
        Some(ClosedForm::ThreeModes {
            residue_r,
            eq_4_5: nearer(residue_r, critical_residues(0.0, u, v)?),
            eq_4_5_shifted: nearer(residue_r, critical_residues(r.omega_rad_s, u, v)?),
            b2,
            eq_4_6_shifted: nearer(b2, critical_sums(r.omega_rad_s, u, v)?),
        })
    }
}

fn nearer(to: f64, [a, b]: [f64; 2]) -> f64 {
    if (a - to).abs() < (b - to).abs() {
        a
    } else {
        b
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_plant::zeros::{ModalSum, ZeroCounts};
    use proptest::prelude::*;

    /// The largest real part of a complex zero of Eq. (3-15) over all sizes of the residues (golden section about the
    /// largest of a logarithmic grid).
    fn furthest_right(zeta: f64, eta: f64, kappa: f64) -> f64 {
        let right = |log: f64| {
            let av = log.exp();
            let mode = |omega_rad_s, residue_per_kg| ModalTerm {
                omega_rad_s,
                damping_ratio: zeta,
                residue_per_kg,
            };
            let terms = vec![
                ModalTerm::undamped(0.0, 1.0),
                mode(eta, -kappa * av),
                mode(1.0, av),
            ];
            let zeros = ModalSum::new(terms, 0.0).unwrap().damped_zeros().unwrap();
            zeros
                .iter()
                .filter(|z| z.s.im > 1e-3)
                .map(|z| z.s.re)
                .fold(f64::NEG_INFINITY, f64::max)
        };
        let grid = (0..=2000).map(|i| -8.0 + 16.0 * f64::from(i) / 2000.0);
        let best = grid.max_by(|a, b| right(*a).total_cmp(&right(*b))).unwrap();
        let (mut low, mut high) = (best - 0.01, best + 0.01);
        for _ in 0..60 {
            let (a, b) = (high - 0.618 * (high - low), low + 0.618 * (high - low));
            if right(a) > right(b) {
                high = b
            } else {
                low = a
            }
        }
        right(0.5 * (low + high))
    }

    #[test]
    fn eq_3_16_gives_0_2240_where_the_locus_passes_the_axis() {
        let (eta, kappa) = (0.9 / 1.1, 2.0);
        let printed = critical_damping(eta, kappa).unwrap();
        assert!((printed - 0.2240).abs() < 5e-5, "{printed}");
        // The locus passes through the axis there and returns: it reaches 5e-4 of its frequency beyond the axis.
        let beyond = furthest_right(printed, eta, kappa);
        assert!((3e-4..7e-4).contains(&beyond), "{beyond}");
    }

    #[test]
    fn locus_touches_the_axis_at_the_touching_damping() {
        for (eta, kappa) in [(0.9 / 1.1, 2.0), (0.9 / 1.1, 5.0), (0.5, 6.0), (0.95, 1.2)] {
            let zeta = touching_damping(eta, kappa).unwrap();
            // Rounding of a pencil whose zero sits at 1: some 1e-15; a thousandth of damping more or less is decisive.
            assert!(
                furthest_right(zeta, eta, kappa).abs() < 1e-10,
                "{eta} {kappa}: {zeta}"
            );
            assert!(furthest_right(zeta * 1.001, eta, kappa) < -1e-6);
            assert!(furthest_right(zeta * 0.999, eta, kappa) > 1e-6);
            assert!(critical_damping(eta, kappa).unwrap() <= zeta);
        }
    }

    #[test]
    fn critical_dampings_need_their_condition() {
        for (eta, kappa) in [
            (1.0, 2.0),
            (0.5, 3.9),
            (1.2, 2.0),
            (0.0, 2.0),
            (0.9, f64::NAN),
        ] {
            assert_eq!(
                (critical_damping(eta, kappa), touching_damping(eta, kappa)),
                (None, None)
            );
        }
    }

    #[test]
    fn break_points_of_section_3_2_4_are_1_21_and_21() {
        // aR = 1, au = -a0, av = a0: by Eq. (4-6) zeros meet where aR is a0 (wv -+ wu)/(wv +- wu), that is a0 = 1/21 and 21.
        let modes = |a0: f64| {
            (
                ModalTerm::undamped(10.0, -a0),
                ModalTerm::undamped(11.0, a0),
            )
        };
        for (a0, which) in [(1.0 / 21.0, 1), (21.0, 0)] {
            let (u, v) = modes(a0);
            assert!((critical_residues(0.0, &u, &v).unwrap()[which] - 1.0).abs() < 1e-14);
            assert!((critical_sums(0.0, &u, &v).unwrap()[which] - 1.0).abs() < 1e-14);
        }
    }

    proptest! {
        #[test]
        fn zeros_are_complex_only_between_the_critical_residues(
            wr in 0.0..5.0f64, above in 0.1..20.0f64, apart in 0.01..10.0f64, au in 0.01..10.0f64, av in 0.01..10.0f64, sign in 0..2usize,
        ) {
            let sign = [1.0, -1.0][sign];
            let (u, v) = (ModalTerm::undamped(wr + above, -sign * au), ModalTerm::undamped(wr + above + apart, sign * av));
            let [near, far] = critical_residues(wr, &u, &v).unwrap();
            let quartets = |ar: f64| {
                let sum = ModalSum::new(vec![ModalTerm::undamped(wr, ar), u, v], 0.0).unwrap();
                ZeroCounts::of(&sum.undamped_zeros().unwrap()).quartets
            };
            // The discriminant is quadratic in aR: 1e-6 beside its root it is far above the rounding of two equal roots.
            prop_assume!((far - near).abs() > 1e-4 * far.abs() && near.abs() > 1e-4 * far.abs());
            for (residue, inside) in [(near * (1.0 - 1e-6), 0), (near * (1.0 + 1e-6), 1), (far * (1.0 - 1e-6), 1), (far * (1.0 + 1e-6), 0)] {
                prop_assert_eq!(quartets(residue), inside, "at {} of {} to {}", residue, near, far);
            }
            let [least, most] = critical_sums(wr, &u, &v).unwrap();
            let others = u.residue_per_kg + v.residue_per_kg;
            let scale = far.abs() + others.abs();
            prop_assert!((least - near - others).abs() < 1e-12 * scale && (most - far - others).abs() < 1e-12 * scale);
        }

        #[test]
        fn zeros_of_two_damped_modes_meet_at_eq_3_14(
            wu in 0.5..5.0f64, apart in 0.1..5.0f64, zu in 0.0..0.3f64, zv in 0.0..0.3f64, which in 0..2usize,
        ) {
            let mode = |omega_rad_s, damping_ratio, residue_per_kg| ModalTerm { omega_rad_s, damping_ratio, residue_per_kg };
            let (u, v) = (mode(wu, zu, 1.0), mode(wu + apart, zv, 1.0));
            let Some(points) = two_mode_break_points(&u, &v) else { return Ok(()) };
            let s = points[which];
            prop_assume!(s.is_finite() && s.abs() > 1e-3 && s.abs() < 1e3);
            // The ratio of residues that puts a zero at s: G(s) = 0.
            let denominator = |t: &ModalTerm| s * s + 2.0 * t.damping_ratio * t.omega_rad_s * s + t.omega_rad_s * t.omega_rad_s;
            let ratio = -denominator(&u) / denominator(&v);
            prop_assume!((ratio + 1.0).abs() > 1e-6 && ratio.abs() > 1e-6);
            let sum = ModalSum::new(vec![mode(wu, zu, ratio), v], 0.0).unwrap();
            // A double zero: computed to the root of the rounding.
            let zeros = ModalSum::new(vec![mode(wu, zu, ratio), v], 0.0).unwrap().damped_zeros().unwrap();
            prop_assert_eq!(sum.terms().len(), 2);
            for zero in zeros {
                prop_assert!((zero.s - s).norm() < 1e-4 * s.abs().max(1.0), "{:?} for {}", zero, s);
            }
        }
    }
}
