//! Places on the curve of a loop L(jw): crossings of |L| = 1 and of the negative real axis, the peak and the bandwidth of the
//! sensitivity S = 1/(1 + L). Each is found on a grid and refined on the function itself.
//!
//! Accuracy of the peak: let the distance of two neighbouring frequencies be at most q times their distance from every pole and zero of
//! S. Then |d^2 ln S/dw^2| <= N q^2/h^2 for N poles and zeros, and between two points |S| exceeds the larger of both by at most
//! N q^2/8. The grid of `margins.rs` has q = 1/40 at the poles of the open and of the closed loop: 0.008 % for each. A local maximum is
//! then refined by a golden section.

use nalgebra::Complex;

/// Frequencies of a loop in rad/s.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Landmarks {
    /// All frequencies at which |L| passes through 1, rising.
    pub crossings_rad_s: Vec<f64>,
    /// The lowest one at which |L| falls through 1.
    pub crossover_rad_s: Option<f64>,
    /// Frequencies at which L crosses the negative real axis, rising, and the ends at which it lies on it.
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

/// At an end with a larger |L| there is a pole of the open loop, and L has no value.
const POLE: f64 = 1e9;

/// The landmarks of `response`, from a rising grid that is fine enough to show every crossing. `ends_rad_s` are frequencies below and
/// above the grid at which L is real, of a sampled loop 0 and half the rate: the first or the last point of the curve.
pub(super) fn landmarks(
    response: &dyn Fn(f64) -> Complex<f64>,
    grid_rad_s: &[f64],
    ends_rad_s: &[f64],
) -> Landmarks {
    let inner = Tabulated::of(response, grid_rad_s.to_vec());
    let ends: Vec<f64> = ends_rad_s
        .iter()
        .copied()
        .filter(|w| response(*w).norm() < POLE)
        .collect();
    let phase_crossings_rad_s = inner.phase_crossings(&ends);
    let whole = inner.with_ends(&ends);
    let crossings = whole.crossings();
    Landmarks {
        crossover_rad_s: crossings.iter().find(|c| c.falls).map(|c| c.rad_s),
        crossings_rad_s: crossings.iter().map(|c| c.rad_s).collect(),
        phase_crossings_rad_s,
        sensitivity_peak: whole.sensitivity_peak(),
        sensitivity_bandwidth_rad_s: whole.sensitivity_bandwidth_rad_s(),
    }
}

/// The largest value of a magnitude over the grid, refined at each local maximum. Values that are not a number are left out; the
/// peak is 0 if all are.
pub(super) fn peak(magnitude: &dyn Fn(f64) -> f64, grid_rad_s: &[f64]) -> Peak {
    let on_grid: Vec<f64> = grid_rad_s.iter().map(|&w| magnitude(w)).collect();
    refined_peak(magnitude, grid_rad_s, &on_grid)
}

/// The smallest value of a function over the grid with its frequency, refined at each local minimum. A value that is not a number
/// counts as minus infinity.
pub(super) fn lowest(value: &dyn Fn(f64) -> f64, grid_rad_s: &[f64]) -> Peak {
    let negated = |w: f64| match value(w) {
        value if value.is_nan() => f64::INFINITY,
        value => -value,
    };
    let on_grid: Vec<f64> = grid_rad_s.iter().map(|&w| negated(w)).collect();
    let pairs = grid_rad_s.iter().zip(&on_grid);
    let largest = pairs.fold(LOWEST, higher);
    let refined = local_maxima(&on_grid)
        .map(|i| maximum(&negated, grid_rad_s[i - 1], grid_rad_s[i + 1]))
        .fold(largest, larger);
    Peak {
        value: -refined.value,
        ..refined
    }
}

const LOWEST: Peak = Peak {
    rad_s: f64::NAN,
    value: f64::NEG_INFINITY,
};

/// The largest of the values on the grid and of the local maxima between its points. Local maxima on the grid below 0.9 of the largest
/// are not refined: the grid leaves out less than 1 %.
fn refined_peak(magnitude: &dyn Fn(f64) -> f64, grid_rad_s: &[f64], on_grid: &[f64]) -> Peak {
    let highest = grid_rad_s.iter().zip(on_grid).fold(NO_PEAK, higher);
    local_maxima(on_grid)
        .filter(|i| on_grid[*i] > 0.9 * highest.value)
        .map(|i| maximum(magnitude, grid_rad_s[i - 1], grid_rad_s[i + 1]))
        .fold(highest, larger)
}

fn larger(highest: Peak, peak: Peak) -> Peak {
    if peak.value > highest.value {
        peak
    } else {
        highest
    }
}

const NO_PEAK: Peak = Peak {
    rad_s: f64::NAN,
    value: 0.0,
};

fn higher(highest: Peak, (&rad_s, &value): (&f64, &f64)) -> Peak {
    if value > highest.value {
        Peak { rad_s, value }
    } else {
        highest
    }
}

/// 180 deg + arg L, within +-180 deg.
pub(super) fn phase_margin_deg(l: Complex<f64>) -> f64 {
    // The argument of -L is that of L turned by 180 deg.
    libm::atan2(-l.im, -l.re).to_degrees()
}

/// A frequency at which a function changes its sign.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SignChange {
    rad_s: f64,
    /// From positive to negative.
    falls: bool,
}

/// L and its values on the grid.
struct Tabulated<'a> {
    response: &'a dyn Fn(f64) -> Complex<f64>,
    grid_rad_s: Vec<f64>,
    values: Vec<Complex<f64>>,
}

impl<'a> Tabulated<'a> {
    fn of(response: &'a dyn Fn(f64) -> Complex<f64>, grid_rad_s: Vec<f64>) -> Tabulated<'a> {
        let values = grid_rad_s.iter().map(|&w| response(w)).collect();
        Tabulated {
            response,
            grid_rad_s,
            values,
        }
    }

    /// The same curve from its first to its last end.
    fn with_ends(mut self, ends_rad_s: &[f64]) -> Tabulated<'a> {
        for &end in ends_rad_s {
            let place = self.grid_rad_s.partition_point(|w| *w < end);
            self.grid_rad_s.insert(place, end);
            self.values.insert(place, (self.response)(end));
        }
        self
    }

    /// All crossings of |L| = 1.
    fn crossings(&self) -> Vec<SignChange> {
        self.sign_changes(&|l| libm::log(l.norm()))
    }

    /// The crossings of the negative real axis, and the ends on it.
    fn phase_crossings(&self, ends_rad_s: &[f64]) -> Vec<f64> {
        let changes = self.sign_changes(&|l| l.im).into_iter();
        let mut places: Vec<f64> = changes.map(|change| change.rad_s).collect();
        places.extend_from_slice(ends_rad_s);
        places.retain(|w| (self.response)(*w).re < 0.0);
        places.sort_by(f64::total_cmp);
        places
    }

    /// The largest |S|.
    fn sensitivity_peak(&self) -> Peak {
        let sensitivity = |w: f64| ((self.response)(w) + 1.0).inv().norm();
        let on_grid = self.values.iter().map(|l| (l + 1.0).inv().norm());
        refined_peak(
            &sensitivity,
            &self.grid_rad_s,
            &on_grid.collect::<Vec<f64>>(),
        )
    }

    /// The lowest frequency at which |S| rises through 1/sqrt(2).
    fn sensitivity_bandwidth_rad_s(&self) -> Option<f64> {
        const HALF_LN_2: f64 = 0.5 * std::f64::consts::LN_2;
        let changes = self.sign_changes(&|l| libm::log((l + 1.0).inv().norm()) + HALF_LN_2);
        let rising = changes.into_iter().find(|change| !change.falls)?;
        Some(rising.rad_s)
    }

    /// The frequencies at which a function of L changes its sign, rising: between two points of the grid, and twice around a point at
    /// which it nearly touches zero.
    fn sign_changes(&self, of: &dyn Fn(Complex<f64>) -> f64) -> Vec<SignChange> {
        let on_grid: Vec<f64> = self.values.iter().map(|l| of(*l)).collect();
        let function = |w: f64| of((self.response)(w));
        let grid = &self.grid_rad_s;
        let mut changes: Vec<SignChange> = sign_changes(&on_grid)
            .map(|i| change(&function, on_grid[i] > 0.0, grid[i], grid[i + 1]))
            .collect();
        for i in near_touches(&on_grid) {
            let sign = on_grid[i].signum();
            let deepest = maximum(&|w| -sign * function(w), grid[i - 1], grid[i + 1]);
            if deepest.value > 0.0 {
                changes.push(change(&function, sign > 0.0, grid[i - 1], deepest.rad_s));
                changes.push(change(&function, sign < 0.0, deepest.rad_s, grid[i + 1]));
            }
        }
        changes.sort_by(|a, b| a.rad_s.total_cmp(&b.rad_s));
        changes
    }
}

/// The change of sign of `f` between `low`, where it is positive or not, and `high`.
fn change(f: &dyn Fn(f64) -> f64, falls: bool, low: f64, high: f64) -> SignChange {
    SignChange {
        rad_s: bisect(f, low, high),
        falls,
    }
}

/// Indices at which a function may touch zero between its neighbours: nearest to zero there, without a change of sign, and nearer
/// than the difference to a neighbour. The vertex of a parabola through three such points lies at most an eighth of that difference
/// nearer.
fn near_touches(values: &[f64]) -> impl Iterator<Item = usize> + '_ {
    (1..values.len().saturating_sub(1)).filter(|&i| {
        let [before, here, after] = [values[i - 1], values[i], values[i + 1]];
        let [distance_before, distance_after] = [before, after].map(|v| (v - here) * here.signum());
        let same_sign = (before > 0.0) == (here > 0.0) && (here > 0.0) == (after > 0.0);
        same_sign
            && distance_before >= 0.0
            && distance_after >= 0.0
            && here.abs() <= distance_before.max(distance_after)
    })
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
