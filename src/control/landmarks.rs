//! Places on the curve of a loop L(jw): crossings of |L| = 1 and of the negative real axis, the peak and the bandwidth of the
//! sensitivity S = 1/(1 + L). Each is found on a grid and refined on the function itself.

use nalgebra::Complex;

/// Frequencies of a loop in rad/s.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Landmarks {
    /// All frequencies at which |L| passes through 1, rising.
    pub crossings_rad_s: Vec<f64>,
    /// The lowest one at which |L| falls through 1.
    pub crossover_rad_s: Option<f64>,
    /// Frequencies at which L crosses the negative real axis.
    pub phase_crossings_rad_s: Vec<f64>,
    /// The largest |S|.
    pub sensitivity_peak: Peak,
    /// The lowest frequency at which |S| rises through 1/sqrt(2).
    pub sensitivity_bandwidth_rad_s: Option<f64>,
}

/// The largest value of a magnitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Peak {
    /// Its frequency.
    pub rad_s: f64,
    /// The magnitude there.
    pub value: f64,
}

/// The landmarks of `response`, from a rising grid that is fine enough to show every crossing.
pub(super) fn landmarks(response: &dyn Fn(f64) -> Complex<f64>, grid_rad_s: &[f64]) -> Landmarks {
    let values = grid_rad_s.iter().map(|&w| response(w)).collect();
    let tabulated = Tabulated {
        response,
        grid_rad_s,
        values,
    };
    let (crossings_rad_s, crossover_rad_s) = tabulated.crossings();
    let sensitivity = |w: f64| (response(w) + 1.0).inv().norm();
    Landmarks {
        crossings_rad_s,
        crossover_rad_s,
        phase_crossings_rad_s: tabulated.phase_crossings(),
        sensitivity_peak: peak(&sensitivity, grid_rad_s),
        sensitivity_bandwidth_rad_s: tabulated.sensitivity_bandwidth_rad_s(),
    }
}

/// The largest value of a magnitude over the grid, refined at each local maximum. Values that are not a number are left out; the
/// peak is 0 if all are.
pub(super) fn peak(magnitude: &dyn Fn(f64) -> f64, grid_rad_s: &[f64]) -> Peak {
    let on_grid: Vec<f64> = grid_rad_s.iter().map(|&w| magnitude(w)).collect();
    let highest = grid_rad_s.iter().zip(&on_grid).fold(NO_PEAK, higher);
    let refined = local_maxima(&on_grid)
        .filter(|i| on_grid[*i] > 0.9 * highest.value)
        .map(|i| maximum(magnitude, grid_rad_s[i - 1], grid_rad_s[i + 1]));
    refined.fold(highest, |highest, peak| match peak.value > highest.value {
        true => peak,
        false => highest,
    })
}

const NO_PEAK: Peak = Peak {
    rad_s: f64::NAN,
    value: 0.0,
};

fn higher(highest: Peak, (&rad_s, &value): (&f64, &f64)) -> Peak {
    match value > highest.value {
        true => Peak { rad_s, value },
        false => highest,
    }
}

/// 180 deg + arg L, within +-180 deg.
pub(super) fn phase_margin_deg(l: Complex<f64>) -> f64 {
    // The argument of -L is that of L turned by 180 deg.
    libm::atan2(-l.im, -l.re).to_degrees()
}

/// L and its values on the grid.
struct Tabulated<'a> {
    response: &'a dyn Fn(f64) -> Complex<f64>,
    grid_rad_s: &'a [f64],
    values: Vec<Complex<f64>>,
}

impl Tabulated<'_> {
    /// All crossings of |L| = 1, and the lowest frequency at which |L| falls through 1.
    fn crossings(&self) -> (Vec<f64>, Option<f64>) {
        let gains: Vec<f64> = self.values.iter().map(|l| l.norm().ln()).collect();
        let places: Vec<usize> = sign_changes(&gains).collect();
        let refined = |i: &usize| self.bisect(*i, &|l| libm::log(l.norm()));
        let crossings: Vec<f64> = places.iter().map(refined).collect();
        let falling = places.iter().position(|&i| gains[i] > 0.0);
        let crossover = falling.map(|i| crossings[i]);
        (crossings, crossover)
    }

    /// The crossings of the negative real axis.
    fn phase_crossings(&self) -> Vec<f64> {
        let imaginary: Vec<f64> = self.values.iter().map(|l| l.im).collect();
        let negative = |i: &usize| self.values[*i].re < 0.0 || self.values[*i + 1].re < 0.0;
        let places = sign_changes(&imaginary).filter(negative);
        places
            .map(|i| self.bisect(i, &|l| l.im))
            .filter(|w| (self.response)(*w).re < 0.0)
            .collect()
    }

    /// The lowest frequency at which |S| rises through 1/sqrt(2).
    fn sensitivity_bandwidth_rad_s(&self) -> Option<f64> {
        const HALF_LN_2: f64 = 0.5 * std::f64::consts::LN_2;
        let on_grid = self.values.iter();
        let excess: Vec<f64> = on_grid
            .map(|l| -(l + 1.0).norm().ln() + HALF_LN_2)
            .collect();
        let rising = sign_changes(&excess).find(|&i| excess[i] < 0.0)?;
        let refined = |l: Complex<f64>| libm::log((l + 1.0).inv().norm()) + HALF_LN_2;
        Some(self.bisect(rising, &refined))
    }

    /// The frequency at which a function of L changes its sign between the points `i` and `i + 1` of the grid.
    fn bisect(&self, i: usize, of: &dyn Fn(Complex<f64>) -> f64) -> f64 {
        let (low, high) = (self.grid_rad_s[i], self.grid_rad_s[i + 1]);
        bisect(&|w| of((self.response)(w)), low, high)
    }
}

/// Indices of the values that are not below their neighbours.
fn local_maxima(values: &[f64]) -> impl Iterator<Item = usize> + '_ {
    (1..values.len().saturating_sub(1))
        .filter(|&i| values[i] >= values[i - 1] && values[i] >= values[i + 1])
}

fn sign_changes(values: &[f64]) -> impl Iterator<Item = usize> + '_ {
    values
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| (pair[0] > 0.0) != (pair[1] > 0.0))
        .map(|(i, _)| i)
}

/// The argument at which `f` changes its sign between `low` and `high`, to the last bits.
fn bisect(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let start = f(low) > 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == start {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The largest value of `f` between `low` and `high`, by golden section.
fn maximum(f: &dyn Fn(f64) -> f64, mut low: f64, mut high: f64) -> Peak {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    for _ in 0..50 {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if f(a) > f(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let rad_s = 0.5 * (low + high);
    Peak {
        rad_s,
        value: f(rad_s),
    }
}
