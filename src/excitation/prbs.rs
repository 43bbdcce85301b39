//! A pseudo-random binary sequence: what a shift register of n cells gives that runs through all its 2^n - 1 states.
//!
//! ```text
//!  s(k + n) = s(k) + sum of s(k + j) over the other taps (modulo 2)      u = +a for 1, -a for 0, held for d ticks
//!  sum over k of u(k) u(k + m) = a^2 (L, m = 0; -1 elsewhere)            L = 2^n - 1
//! ```
//!
//! So its spectrum is flat but for the hold of d ticks, with its first zero at rate/d.

use super::periodic::Periodic;
use crate::config::{Config, PrbsSettings};

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

/// The sequence of a configuration.
pub fn prbs(config: &Config) -> Periodic {
    let settings = &config.prbs;
    let held = |bit: bool| {
        let current_a = if bit { settings.amplitude_a } else { -settings.amplitude_a };
        std::iter::repeat_n(current_a, settings.clock_divider.max(1) as usize)
    };
    let table = sequence(settings).into_iter().flat_map(held).collect();
    Periodic::new(config, table, settings.settle_periods, settings.periods)
}

/// One period of the register's output, all ones at first.
fn sequence(settings: &PrbsSettings) -> Vec<bool> {
    let order = settings.order.clamp(7, 20);
    let taps = TAPS[(order - 7) as usize];
    let length = (1u32 << order) - 1;
    let mut register = length;
    let mut step = || {
        let output = register >> (order - 1) & 1 == 1;
        let fed = taps.iter().fold(0, |sum, tap| sum ^ (register >> (tap - 1) & 1));
        register = (register << 1 | fed) & length;
        output
    };
    (0..length).map(|_| step()).collect()
}
