//! The power of noise with two parts: one of a known shape, and one that passes through the plant.
//!
//! ```text
//! E p_k = a x_k + b y_k,  a, b >= 0          x: the shape of the noise of the probe, y: |H|^2
//! ```
//!
//! What excites a stage beside its input, such as the vibration of the floor, is amplified by its modes. Near a mode its power has the
//! shape of |H|^2, with a peak that a mean over neighbouring frequencies would lower.
//!
//! The standard deviation of a power is proportional to its expectation, so that the weights of the least squares are those of the
//! solution before (McCullagh, Nelder, Generalized Linear Models, 1989, section 8.3: gamma distribution, identity link).

/// Iterations of the weights.
const ITERATIONS: usize = 4;
/// Parts whose shapes differ by less than this (1 - correlation^2) cannot be separated.
const SAME_SHAPE: f64 = 1e-3;

/// A power with the two shapes at one frequency.
#[derive(Clone, Copy, Debug)]
pub struct PowerDatum {
    /// p, the measured power.
    pub power: f64,
    /// x.
    pub of_probe: f64,
    /// y.
    pub of_plant: f64,
}

/// The coefficients a and b of the two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseParts {
    /// a.
    pub of_probe: f64,
    /// b.
    pub of_plant: f64,
}

impl NoiseParts {
    /// The parts of some powers. With shapes that cannot be separated, all is noise of the probe.
    pub fn of(data: &[PowerDatum]) -> NoiseParts {
        let probe_alone = ratio_of_sums(data, |datum| datum.power, |datum| datum.of_probe);
        let mut parts = NoiseParts {
            of_probe: probe_alone,
            of_plant: 0.0,
        };
        for _ in 0..ITERATIONS {
            parts = parts.reweighted(data);
        }
        parts
    }

    /// a x + b y.
    pub fn power(&self, of_probe: f64, of_plant: f64) -> f64 {
        self.of_probe * of_probe + self.of_plant * of_plant
    }

    /// The least squares with the weights of these parts.
    fn reweighted(self, data: &[PowerDatum]) -> NoiseParts {
        let sums = Sums::of(data, self);
        let both = sums.both().filter(NoiseParts::is_valid);
        let alone = [sums.probe_alone(), sums.plant_alone()];
        let alone = alone.into_iter().filter(NoiseParts::is_valid);
        let best = alone.min_by(|a, b| sums.misfit(a).total_cmp(&sums.misfit(b)));
        both.or(best).unwrap_or(self)
    }

    fn is_valid(&self) -> bool {
        let largest = self.of_probe.max(self.of_plant);
        self.of_probe >= 0.0 && self.of_plant >= 0.0 && largest > 0.0 && largest.is_finite()
    }
}

/// Weighted sums of squares and products.
struct Sums {
    xx: f64,
    xy: f64,
    yy: f64,
    xp: f64,
    yp: f64,
}

impl Sums {
    fn of(data: &[PowerDatum], parts: NoiseParts) -> Sums {
        let mut sums = Sums {
            xx: 0.0,
            xy: 0.0,
            yy: 0.0,
            xp: 0.0,
            yp: 0.0,
        };
        for datum in data {
            let (x, y) = (datum.of_probe, datum.of_plant);
            let expected = parts.power(x, y);
            if expected > 0.0 {
                let [x, y, p] = [x, y, datum.power].map(|value| value / expected);
                sums.xx += x * x;
                sums.xy += x * y;
                sums.yy += y * y;
                sums.xp += x * p;
                sums.yp += y * p;
            }
        }
        sums
    }

    fn both(&self) -> Option<NoiseParts> {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        let are_separate = determinant > SAME_SHAPE * self.xx * self.yy;
        are_separate.then(|| NoiseParts {
            of_probe: (self.yy * self.xp - self.xy * self.yp) / determinant,
            of_plant: (self.xx * self.yp - self.xy * self.xp) / determinant,
        })
    }

    fn probe_alone(&self) -> NoiseParts {
        NoiseParts {
            of_probe: self.xp / self.xx,
            of_plant: 0.0,
        }
    }

    fn plant_alone(&self) -> NoiseParts {
        NoiseParts {
            of_probe: 0.0,
            of_plant: self.yp / self.yy,
        }
    }

    /// The sum of squares less that of the powers, which is the same for all parts.
    fn misfit(&self, parts: &NoiseParts) -> f64 {
        let (a, b) = (parts.of_probe, parts.of_plant);
        a * a * self.xx + 2.0 * a * b * self.xy + b * b * self.yy
            - 2.0 * (a * self.xp + b * self.yp)
    }
}

fn ratio_of_sums(
    data: &[PowerDatum],
    above: impl Fn(&PowerDatum) -> f64,
    below: impl Fn(&PowerDatum) -> f64,
) -> f64 {
    data.iter().map(above).sum::<f64>() / data.iter().map(below).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;

    /// Uniform above 0 and up to 1.
    fn unit(random: &mut Pcg64) -> f64 {
        ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// A resonance of half-width 3 data over 41 data, with exponentially distributed powers.
    fn data(a: f64, b: f64, random: &mut Pcg64) -> Vec<PowerDatum> {
        let datum = |k: i32| {
            let of_plant = 1.0 / (1.0 + (f64::from(k) / 3.0).powi(2));
            let expected = a + b * of_plant;
            PowerDatum {
                power: -expected * unit(random).ln(),
                of_probe: 1.0,
                of_plant,
            }
        };
        (-20..=20).map(datum).collect()
    }

    #[test]
    fn mean_of_many_estimates_is_the_truth() {
        for (a, b) in [(1.0, 5.0), (1.0, 0.5), (0.2, 3.0)] {
            let mut random = Pcg64::seed_from_u64(7);
            let all: Vec<NoiseParts> = (0..2000)
                .map(|_| NoiseParts::of(&data(a, b, &mut random)))
                .collect();
            let mean = |value: fn(&NoiseParts) -> f64| all.iter().map(value).sum::<f64>() / 2000.0;
            let (found_a, peak) = (
                mean(|parts| parts.of_probe),
                mean(|parts| parts.power(1.0, 1.0)),
            );
            // Deviations of a single estimate are 25 % of a and 45 % of the peak: 0.6 and 1 % of the means; the limits at zero add
            // to the bias of small parts.
            assert!((found_a / a - 1.0).abs() < 0.08, "{a} {b}: {found_a}");
            assert!((peak / (a + b) - 1.0).abs() < 0.08, "{a} {b}: {peak}");
        }
    }

    #[test]
    fn equal_shapes_are_noise_of_the_probe() {
        let datum = PowerDatum {
            power: 3.0,
            of_probe: 2.0,
            of_plant: 4.0,
        };
        let parts = NoiseParts::of(&[datum; 9]);
        assert!((parts.power(2.0, 4.0) - 3.0).abs() < 1e-12, "{parts:?}");
        let nothing = PowerDatum {
            power: 0.0,
            ..datum
        };
        assert_eq!(NoiseParts::of(&[nothing; 9]).power(2.0, 4.0), 0.0);
    }
}
