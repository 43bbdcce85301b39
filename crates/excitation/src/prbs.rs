//! A pseudo-random binary sequence: the output of a shift register of n cells that runs through all its 2^n - 1 states.
//!
//! ```text
//!  s(k + n) = s(k) + sum of s(k + j) over the other taps (modulo 2)      u = +a for 1, -a for 0, held for d ticks
//!  sum over k of u(k) u(k + m) = a^2 (L, m = 0; -1 elsewhere)            L = 2^n - 1
//! ```
//!
//! Therefore its spectrum is flat, except for the effect of the hold of d ticks, which has its first zero at rate/d.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ExcitationDesign, Length, SharedSettings};
use super::periodic::Periodic;
use super::waveform::Excitation;
use bench_base::finding::Finding;

/// A maximum-length sequence of plus and minus one amplitude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrbsSettings {
    /// Cells n of the shift register; a period has 2^n - 1 steps.
    #[schemars(range(min = 7, max = 20))]
    pub order: u32,
    /// Ticks per step.
    #[schemars(range(min = 1, max = 1000))]
    pub clock_divider: u32,
    /// Current in amperes, to both sides.
    #[schemars(range(min = 1e-9, max = 1000.0))]
    pub amplitude_a: f64,
    /// Measured periods; the last one measures the drift of the one before it.
    #[schemars(range(min = 5, max = 100000))]
    pub periods: u32,
    /// Periods before the measured ones, in which the signal fades in and the stage settles.
    #[schemars(range(min = 1, max = 1000))]
    pub settle_periods: u32,
}

impl PrbsSettings {
    /// Length of a period in seconds.
    fn period_s(&self, rate_hz: f64) -> f64 {
        let steps = (1u64 << self.order.min(20)) - 1;
        steps as f64 * f64::from(self.clock_divider) / rate_hz
    }
}

impl ExcitationDesign for PrbsSettings {
    fn describe(&self, shared: &SharedSettings<'_>) -> String {
        format!(
            "binary sequence of order {}, steps of {} ticks, {} periods, {} analysed",
            self.order,
            self.clock_divider,
            self.periods,
            shared.band()
        )
    }

    fn length(&self, shared: &SharedSettings<'_>) -> Length {
        let periods = self.periods.saturating_add(self.settle_periods);
        Length {
            ticks: Periodic::length(shared, self.period_s(shared.rate_hz), periods),
            key: "prbs.order",
            value: f64::from(self.order),
        }
    }

    fn build(&self, shared: &SharedSettings<'_>) -> Box<dyn Excitation> {
        Box::new(prbs(self, shared))
    }

    fn check(&self, shared: &SharedSettings<'_>) -> Vec<Finding> {
        let limit_hz = shared.rate_hz / f64::from(self.clock_divider) / 2.0;
        let (_, highest_hz) = shared.chirp.band_hz();
        if highest_hz <= limit_hz {
            return Vec::new();
        }
        let what = format!(
            "is {}: the sequence excites up to {limit_hz} Hz, but the band extends to {highest_hz} Hz; lower it, or chirp.stop_hz",
            self.clock_divider
        );
        vec![Finding::new("prbs.clock_divider", what)]
    }

    fn amplitude_key(&self) -> &'static str {
        "prbs.amplitude_a"
    }

    fn has_amplitude_curve(&self) -> bool {
        false
    }

    fn one_amplitude_a(&mut self) -> Option<&mut f64> {
        Some(&mut self.amplitude_a)
    }

    fn is_broadband(&self) -> bool {
        true
    }
}

/// Exponents of a primitive polynomial x^n + ... + 1 of the orders 7 to 20, without the 1 (P. Alfke, Xilinx XAPP 052, 1996).
const TAPS: [&[u32]; 14] = [
    &[7, 6],
    &[8, 6, 5, 4],
    &[9, 5],
    &[10, 7],
    &[11, 9],
    &[12, 6, 4, 1],
    &[13, 4, 3, 1],
    &[14, 5, 3, 1],
    &[15, 14],
    &[16, 15, 13, 4],
    &[17, 14],
    &[18, 11],
    &[19, 6, 2, 1],
    &[20, 17],
];

/// Builds the periodic excitation from the settings: each bit is held for `clock_divider` ticks.
fn prbs(settings: &PrbsSettings, shared: &SharedSettings<'_>) -> Periodic {
    let ticks_a_step = settings.clock_divider.max(1) as usize;
    let mut table = Vec::new();
    for bit in sequence(settings) {
        let current_a = if bit {
            settings.amplitude_a
        } else {
            -settings.amplitude_a
        };
        table.extend(std::iter::repeat_n(current_a, ticks_a_step));
    }
    Periodic::new(shared, table, settings.settle_periods, settings.periods)
}

/// One period of the register's output, all ones at first.
fn sequence(settings: &PrbsSettings) -> Vec<bool> {
    let order = settings.order.clamp(7, 20);
    let taps = TAPS[(order - 7) as usize];
    let length = (1u32 << order) - 1;
    let (mut register, mut output) = (length, Vec::new());
    for _ in 0..length {
        output.push(register >> (order - 1) & 1 == 1);
        let feedback = taps
            .iter()
            .fold(0, |sum, tap| sum ^ (register >> (tap - 1) & 1));
        register = (register << 1 | feedback) & length;
    }
    output
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_profile::{Profile, profile};

    fn settings(order: u32, clock_divider: u32) -> Profile {
        let mut config = profile();
        (
            config.excitations.prbs.order,
            config.excitations.prbs.clock_divider,
            config.excitations.prbs.amplitude_a,
        ) = (order, clock_divider, 0.5);
        config
    }

    fn built(config: &Profile) -> Periodic {
        prbs(&config.excitations.prbs, &config.chosen_excitation().shared)
    }

    /// |U_k|^2 of a period.
    fn powers(table: &[f64]) -> Vec<f64> {
        let fft = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(table.len());
        let (mut input, mut output) = (table.to_vec(), fft.make_output_vec());
        fft.process(&mut input, &mut output).unwrap();
        output.iter().map(|line| line.norm_sqr()).collect()
    }

    #[test]
    fn autocorrelation_has_two_values() {
        for order in 7..=11 {
            let bits: Vec<i64> = built(&settings(order, 1))
                .table()
                .iter()
                .map(|u| if *u > 0.0 { 1 } else { -1 })
                .collect();
            let length = (1usize << order) - 1;
            assert_eq!(bits.len(), length);
            for shift in 0..length {
                let sum: i64 = (0..length)
                    .map(|k| bits[k] * bits[(k + shift) % length])
                    .sum();
                assert_eq!(
                    sum,
                    if shift == 0 { length as i64 } else { -1 },
                    "order {order}, shift {shift}"
                );
            }
        }
    }

    #[test]
    fn spectrum_is_flat_at_every_order() {
        for order in 7..=20 {
            let table = built(&settings(order, 1)).table().to_vec();
            // The transform of the autocorrelation is L + 1 at every line except line 0. There it is 1, because the
            // sequence has one + step more than - steps.
            let (length, powers) = (table.len() as f64, powers(&table));
            assert!(
                (powers[0] / 0.25 - 1.0).abs() < 1e-6,
                "order {order}: {}",
                powers[0]
            );
            for (k, power) in powers.iter().enumerate().skip(1) {
                assert!(
                    (power / (0.25 * (length + 1.0)) - 1.0).abs() < 1e-9,
                    "order {order}, line {k}: {power}"
                );
            }
        }
    }

    #[test]
    fn step_of_several_ticks_gives_the_spectrum_of_a_hold() {
        let (order, divider) = (9, 3);
        let table = built(&settings(order, divider)).table().to_vec();
        let length = f64::from((1u32 << order) - 1);
        assert_eq!(table.len() as f64, 3.0 * length);
        for (k, power) in powers(&table).into_iter().enumerate().skip(1) {
            // |sum of exp(-i w n) for n = 0, 1, 2| = sin(3 w/2)/sin(w/2).
            let half = std::f64::consts::PI * k as f64 / table.len() as f64;
            let hold = ((3.0 * half).sin() / half.sin()).powi(2);
            let expected =
                0.25 * if (k as f64) % length == 0.0 {
                    1.0
                } else {
                    length + 1.0
                } * hold;
            assert!(
                (power - expected).abs() < 1e-9 * length,
                "line {k}: {power} for {expected}"
            );
        }
    }
}
