//! Band-limited interpolation between regular samples: a sinc under a Kaiser window.

use std::sync::LazyLock;

/// Samples on either side of a time that contribute to an interpolation.
const HALF_WIDTH: i64 = 24;
/// Parameter beta of the Kaiser window: side lobes of -127 dB (beta = 0.1102 (A - 8.7); A. V. Oppenheim, R. W. Schafer, Discrete-Time
/// Signal Processing). An error of the interpolation is one of the residues, which are known to 1e-5.
const KAISER_BETA: f64 = 13.0;
/// Entries of the kernel's table between two samples.
const TABLE_STEPS: usize = 2048;

/// Samples that contribute to an interpolation.
pub(super) const TAPS: usize = 2 * HALF_WIDTH as usize;
/// Products that the processor adds up side by side.
const LANES: usize = 4;

/// The kernel for positions at multiples of 1/[`TABLE_STEPS`] between two samples.
static KERNEL: LazyLock<Kernel> = LazyLock::new(Kernel::new);

/// A row of weights for each fraction of a position, from 0 to 1.
struct Kernel {
    rows: Vec<[f64; TAPS]>,
    /// Sum of each row.
    sums: Vec<f64>,
}

impl Kernel {
    fn new() -> Kernel {
        let half: Vec<f64> = (0..=HALF_WIDTH as usize * TABLE_STEPS)
            .map(kernel)
            .collect();
        let row = |entry: usize| {
            // The offsets of the samples from the one below the position are 1 - HALF_WIDTH to HALF_WIDTH.
            std::array::from_fn(|tap| {
                let offset = (tap as i64 + 1 - HALF_WIDTH) * TABLE_STEPS as i64;
                half[offset.abs_diff(entry as i64) as usize]
            })
        };
        let rows: Vec<[f64; TAPS]> = (0..=TABLE_STEPS).map(row).collect();
        Kernel {
            sums: rows.iter().map(|row| row.iter().sum()).collect(),
            rows,
        }
    }
}

/// A position between the samples of a regular sequence. The interpolation there is flat to 1e-6 up to 0.8 of half the sequence's
/// rate. Between the rows of the kernel's table it is linear.
pub(super) struct Place {
    /// Index of the first of [`TAPS`] samples.
    pub(super) first: i64,
    row: usize,
    share: f64,
}

impl Place {
    pub(super) fn at(position: f64) -> Place {
        let floor = position.floor();
        let entry = (position - floor) * TABLE_STEPS as f64;
        let row = (entry as usize).min(TABLE_STEPS - 1);
        Place {
            first: (floor as i64).saturating_add(1 - HALF_WIDTH),
            row,
            share: entry - row as f64,
        }
    }

    /// The indices of the samples among `count` of them; beyond the ends that of the outermost one.
    pub(super) fn indices_within(&self, count: usize) -> [usize; TAPS] {
        let last = count as i64 - 1;
        std::array::from_fn(|tap| self.first.saturating_add(tap as i64).clamp(0, last) as usize)
    }

    fn between(&self, below: f64, above: f64) -> f64 {
        below + (above - below) * self.share
    }

    /// The interpolation of the samples from `first` on.
    pub(super) fn interpolate(&self, samples: &[f64; TAPS]) -> f64 {
        let Kernel { rows, sums } = &*KERNEL;
        let [below, above] = [self.row, self.row + 1].map(|row| product(&rows[row], samples));
        self.between(below, above) / self.between(sums[self.row], sums[self.row + 1])
    }

    /// The weights of the samples, whose sum is 1.
    pub(super) fn weights(&self) -> [f64; TAPS] {
        let Kernel { rows, sums } = &*KERNEL;
        let (below, above) = (&rows[self.row], &rows[self.row + 1]);
        let sum = self.between(sums[self.row], sums[self.row + 1]);
        std::array::from_fn(|tap| self.between(below[tap], above[tap]) / sum)
    }
}

/// The sum of the products of weights and samples, in an order that is the same on every processor.
fn product(weights: &[f64; TAPS], samples: &[f64; TAPS]) -> f64 {
    let mut sums = [0.0; LANES];
    for tap in 0..TAPS {
        sums[tap % LANES] += weights[tap] * samples[tap];
    }
    sums.iter().sum()
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
