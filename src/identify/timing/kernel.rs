//! Band-limited interpolation between regular samples: a sinc under a Kaiser window.

use std::sync::LazyLock;

/// Samples on either side of a time that contribute to an interpolation.
const HALF_WIDTH: i64 = 16;
/// Parameter beta of the Kaiser window: side lobes of -80 dB.
const KAISER_BETA: f64 = 8.0;
/// Entries of the kernel's table between two samples.
const TABLE_STEPS: usize = 2048;

/// The kernel at multiples of 1/[`TABLE_STEPS`] from 0 to [`HALF_WIDTH`], and one beyond.
static KERNEL: LazyLock<Vec<f64>> = LazyLock::new(|| {
    (0..=HALF_WIDTH as usize * TABLE_STEPS + 1)
        .map(kernel)
        .collect()
});

/// The indices of a regular sequence around `position`, each with its weight; the weights sum to 1. The interpolation is flat
/// to 1e-4 up to 0.8 of half the sequence's rate.
pub(super) fn weights_at(position: f64) -> impl Iterator<Item = (i64, f64)> {
    let floor = position.floor();
    let (fraction, before) = (position - floor, floor as i64);
    let weights = (1 - HALF_WIDTH..=HALF_WIDTH)
        .map(move |offset| (offset, interpolated((fraction - offset as f64).abs())));
    let sum: f64 = weights.clone().map(|(_, weight)| weight).sum();
    weights.map(move |(offset, weight)| (before + offset, weight / sum))
}

/// The kernel at a distance, between the entries of its table.
fn interpolated(distance: f64) -> f64 {
    let entry = distance * TABLE_STEPS as f64;
    let below = entry as usize;
    let (a, b) = (KERNEL[below], KERNEL[below + 1]);
    a + (b - a) * (entry - below as f64)
}

/// sinc(x) times the Kaiser window at an entry of the table.
fn kernel(entry: usize) -> f64 {
    let x = entry as f64 / TABLE_STEPS as f64;
    let inside = 1.0 - (x / HALF_WIDTH as f64) * (x / HALF_WIDTH as f64);
    if inside < 0.0 {
        return 0.0;
    }
    sinc(x) * bessel_i0(KAISER_BETA * inside.sqrt()) / bessel_i0(KAISER_BETA)
}

/// sin(pi x)/(pi x).
fn sinc(x: f64) -> f64 {
    let angle = std::f64::consts::PI * x;
    if angle == 0.0 {
        1.0
    } else {
        libm::sin(angle) / angle
    }
}

/// The modified Bessel function of order 0 by its series, sum of ((x/2)^k/k!)^2.
fn bessel_i0(x: f64) -> f64 {
    let (mut sum, mut term) = (1.0, 1.0);
    for k in 1..60 {
        term *= x / (2.0 * f64::from(k));
        sum += term * term;
    }
    sum
}
