//! Impulse shapers: a command as a sum of delayed copies, so that a vibration cancels itself.
//!
//! With a mode of natural frequency w and damping ratio zeta, the damped frequency wd = w sqrt(1 - zeta^2), its period
//! Td = 2 pi/wd, and K = exp(-zeta pi/sqrt(1 - zeta^2)), the part of an amplitude that is left after half a period:
//!
//! | shaper | amplitudes | times |
//! |---|---|---|
//! | ZV | 1, K, over 1 + K | 0, Td/2 |
//! | ZVD | 1, 2 K, K^2, over (1 + K)^2 | 0, Td/2, Td |
//! | EI | 1 + v, 2 (1 - v) K, (1 + v) K^2, over their sum | 0, Td/2, Td |
//!
//! ZV has no residual vibration at w. ZVD has none, and the slope of the residual vibration over frequency is zero too. EI
//! permits a ratio V of the vibration of the unshaped command at w, and has none at a frequency on either side: of the three it
//! tolerates the largest error of w. Its v is V (1 + K)^2/(4 - V (1 - K)^2), which is V without damping.
//!
//! After the last impulse the vibration is |sum over i of A_i exp((zeta w + j wd) t_i)| times that of the unshaped command.
//!
//! Sources: N. C. Singer, W. P. Seering, *Preshaping Command Inputs to Reduce System Vibration*, J. Dyn. Sys., Meas., Control 112
//! (1990); W. Singhose, W. Seering, N. Singer, *Residual Vibration Reduction Using Vector Diagrams to Generate Shaped Inputs*,
//! J. Mech. Des. 116 (1994).

use std::f64::consts::PI;

use super::taps::Taps;

/// A lightly damped mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vibration {
    /// Natural frequency in rad/s, above 0.
    pub omega_rad_s: f64,
    /// Damping ratio, from 0 to below 1.
    pub damping_ratio: f64,
}

/// The kind of an impulse shaper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImpulseShaper {
    /// Zero vibration.
    Zv,
    /// Zero vibration and derivative.
    Zvd,
    /// Extra insensitive, with this permitted ratio of residual vibration.
    Ei(f64),
}

/// An impulse of a shaper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// Time in seconds.
    pub time_s: f64,
    /// Amplitude; the sum over a shaper is 1.
    pub amplitude: f64,
}

impl Vibration {
    /// Half a damped period in seconds.
    fn half_period_s(&self) -> f64 {
        PI / (self.omega_rad_s * self.damped_ratio())
    }

    /// wd/w = sqrt(1 - zeta^2).
    fn damped_ratio(&self) -> f64 {
        (1.0 - self.damping_ratio * self.damping_ratio).sqrt()
    }

    /// K: the part of an amplitude that is left after half a damped period.
    fn left_after_half(&self) -> f64 {
        libm::exp(-self.damping_ratio * PI / self.damped_ratio())
    }
}

impl ImpulseShaper {
    /// The impulses for one mode.
    pub fn impulses(self, mode: &Vibration) -> Vec<Impulse> {
        let left = mode.left_after_half();
        let amplitudes = match self {
            ImpulseShaper::Zv => vec![1.0, left],
            ImpulseShaper::Zvd => vec![1.0, 2.0 * left, left * left],
            ImpulseShaper::Ei(permitted) => {
                let v = permitted * (1.0 + left) * (1.0 + left)
                    / (4.0 - permitted * (1.0 - left) * (1.0 - left));
                vec![1.0 + v, 2.0 * (1.0 - v) * left, (1.0 + v) * left * left]
            }
        };
        let sum: f64 = amplitudes.iter().sum();
        let half_s = mode.half_period_s();
        let numbered = amplitudes.iter().enumerate();
        numbered
            .map(|(index, amplitude)| Impulse {
                time_s: index as f64 * half_s,
                amplitude: amplitude / sum,
            })
            .collect()
    }

    /// The filter for several modes: one shaper after the other. Impulses between two ticks are split between them.
    pub fn taps(self, modes: &[Vibration], period_s: f64) -> Taps {
        modes.iter().fold(Taps::identity(), |taps, mode| {
            let impulses = self.impulses(mode).into_iter();
            let split = impulses.flat_map(|impulse| {
                Taps::interpolated(impulse.time_s / period_s, impulse.amplitude)
            });
            taps.in_series_with(&Taps::new(split))
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;

    /// Vibration after the impulses over that of the unshaped command, by its definition.
    fn residual(impulses: &[Impulse], omega_rad_s: f64, zeta: f64) -> f64 {
        let rate = Complex::new(zeta, (1.0 - zeta * zeta).sqrt()) * omega_rad_s;
        let terms = impulses
            .iter()
            .map(|impulse| (rate * impulse.time_s).exp() * impulse.amplitude);
        terms.sum::<Complex<f64>>().norm()
    }

    const SHAPERS: [ImpulseShaper; 3] = [
        ImpulseShaper::Zv,
        ImpulseShaper::Zvd,
        ImpulseShaper::Ei(0.05),
    ];

    fn mode(damping_ratio: f64) -> Vibration {
        Vibration {
            omega_rad_s: 180.0,
            damping_ratio,
        }
    }

    #[test]
    fn residual_vibration_at_the_mode_is_that_of_the_shaper() {
        for zeta in [0.0, 0.009, 0.2] {
            for (shaper, permitted) in SHAPERS.into_iter().zip([0.0, 0.0, 0.05]) {
                let impulses = shaper.impulses(&mode(zeta));
                let sum: f64 = impulses.iter().map(|impulse| impulse.amplitude).sum();
                assert!((sum - 1.0).abs() < 1e-15, "{shaper:?}");
                // A few roundings of numbers near 1.
                let residual = residual(&impulses, 180.0, zeta);
                assert!(
                    (residual - permitted).abs() < 1e-14,
                    "{shaper:?} {zeta}: {residual}"
                );
            }
        }
    }

    /// Without damping, at w (1 + e): ZV |sin(pi e/2)|, ZVD its square, EI |V - (1 + V) sin^2(pi e/2)| from its three terms.
    #[test]
    fn residual_vibration_beside_an_undamped_mode_has_its_closed_form() {
        for error in [-0.2, -0.05, 0.01, 0.1] {
            let sine = (PI * error / 2.0).sin().abs();
            let expected = [sine, sine * sine, (0.05 - 1.05 * sine * sine).abs()];
            for (shaper, expected) in SHAPERS.into_iter().zip(expected) {
                let impulses = shaper.impulses(&mode(0.0));
                let residual = residual(&impulses, 180.0 * (1.0 + error), 0.0);
                assert!(
                    (residual - expected).abs() < 1e-14,
                    "{shaper:?} {error}: {residual} {expected}"
                );
            }
        }
    }

    #[test]
    fn zero_vibration_impulses_are_those_of_singer_and_seering() {
        // zeta = 0.1: K = exp(-0.1 pi/sqrt(0.99)) = 0.729248, 1/(1 + K) = 0.578286; Td/2 = pi/(180 sqrt(0.99)) = 17.54122 ms.
        let impulses = ImpulseShaper::Zv.impulses(&mode(0.1));
        assert!((impulses[0].amplitude - 0.578286).abs() < 5e-7);
        assert!((impulses[1].time_s - 17.54122e-3).abs() < 5e-9);
    }

    #[test]
    fn shapers_of_several_modes_follow_each_other() {
        let modes = [
            mode(0.0),
            Vibration {
                omega_rad_s: 500.0,
                damping_ratio: 0.0,
            },
        ];
        // Half periods of 17.45 ms and 6.28 ms: whole ticks of 2 us would be 8727 and 3142, here with interpolation.
        let taps = ImpulseShaper::Zv.taps(&modes, 2e-6);
        assert!((taps.sum() - 1.0).abs() < 1e-15);
        for mode in modes {
            let delayed = taps.as_slice().iter().map(|tap| {
                let phase = mode.omega_rad_s * tap.delay_ticks as f64 * 2e-6;
                Complex::from_polar(tap.weight, phase)
            });
            let residual = delayed.sum::<Complex<f64>>().norm();
            // Interpolation: (w T)^2/8 = 1.3e-7 at 500 rad/s.
            assert!(residual < 2e-7, "{residual}");
        }
    }
}
