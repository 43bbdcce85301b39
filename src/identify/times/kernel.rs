//! Band-limited interpolation between regular values: a sinc under a Kaiser window.

use std::sync::LazyLock;

/// Values on either side of a time that an interpolation weighs.
pub(super) const HALF_WIDTH: i64 = 16;
/// Kaiser's beta: side lobes of 80 dB.
const BETA: f64 = 8.0;
/// Steps of the table of weights between two values.
const TABLE: usize = 2048;

/// The window's values, computed once.
static WEIGHTS: LazyLock<Vec<f64>> = LazyLock::new(weights);

/// The places of a regular sequence around `place`, each with its weight; the weights sum to 1. Flat to 1e-4 up to 0.8 of
/// half the sequence's rate.
pub(super) fn weights_at(place: f64) -> impl Iterator<Item = (i64, f64)> {
    let before = place.floor();
    let (share, before) = (place - before, before as i64);
    let weight = move |offset: i64| at((share - offset as f64).abs());
    let sum: f64 = (1 - HALF_WIDTH..=HALF_WIDTH).map(weight).sum();
    (1 - HALF_WIDTH..=HALF_WIDTH).map(move |offset| (before + offset, weight(offset) / sum))
}

fn at(distance: f64) -> f64 {
    let place = distance * TABLE as f64;
    let below = place as usize;
    let (a, b) = (WEIGHTS[below], WEIGHTS[below + 1]);
    a + (b - a) * (place - below as f64)
}

/// sinc(x) times the Kaiser window, at multiples of 1/TABLE from 0 to HALF_WIDTH and one beyond.
fn weights() -> Vec<f64> {
    let one = |i: usize| {
        let x = i as f64 / TABLE as f64;
        let inside = 1.0 - (x / HALF_WIDTH as f64) * (x / HALF_WIDTH as f64);
        if inside < 0.0 {
            0.0
        } else {
            sinc(x) * bessel_i0(BETA * inside.sqrt()) / bessel_i0(BETA)
        }
    };
    (0..=HALF_WIDTH as usize * TABLE + 1).map(one).collect()
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
