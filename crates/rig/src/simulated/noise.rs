//! Random numbers that are identical on every machine: PCG for the bits, and the Box-Muller transform with a portable libm
//! for the normal distribution.

use rand_core::Rng;
use rand_pcg::Pcg64;

/// A stream of independent Gaussian numbers of unit variance.
#[derive(Clone, Debug)]
pub(super) struct Gaussian {
    bits: Pcg64,
    spare: Option<f64>,
}

impl Gaussian {
    /// The stream `number` of `seed`; different streams are independent.
    pub(super) fn new(seed: u64, number: u64) -> Self {
        // SplitMix64's finaliser: seeds that differ in one bit give states that differ in half of them.
        let mixed = [seed, !seed].map(|x| {
            let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            u128::from(x ^ (x >> 31))
        });
        let bits = Pcg64::new(mixed[0] << 64 | mixed[1], u128::from(number));
        Gaussian { bits, spare: None }
    }

    /// The next number.
    pub(super) fn next(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        let radius = libm::sqrt(-2.0 * libm::log(self.uniform()));
        let (sine, cosine) = libm::sincos(2.0 * std::f64::consts::PI * self.uniform());
        self.spare = Some(radius * sine);
        radius * cosine
    }

    /// Uniform in (0, 1], in steps of 2^-53.
    fn uniform(&mut self) -> f64 {
        ((self.bits.next_u64() >> 11) + 1) as f64 * (1.0 / (1u64 << 53) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_gaussian() {
        const N: usize = 1_000_000;
        let mut stream = Gaussian::new(7, 0);
        let numbers: Vec<f64> = (0..N).map(|_| stream.next()).collect();
        let moment = |p: i32| numbers.iter().map(|x| x.powi(p)).sum::<f64>() / N as f64;
        // Expected moments 0, 1, 0, 3 with standard deviations sqrt((1, 2, 15, 96)/N) over N numbers; the tolerance
        // is 5 sigma.
        for (p, expected, variance) in
            [(1, 0.0, 1.0), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)]
        {
            let bound = 5.0 * f64::sqrt(variance / N as f64);
            assert!(
                (moment(p) - expected).abs() < bound,
                "moment {p}: {}",
                moment(p)
            );
        }
        // Beyond two sigma lie 4.550 %; binomial sigma 0.021 %.
        let tail = numbers.iter().filter(|x| x.abs() > 2.0).count() as f64 / N as f64;
        assert!((tail - 0.0455).abs() < 0.001, "{tail}");
    }

    #[test]
    fn seeds_and_streams_are_independent() {
        const N: usize = 100_000;
        let of = |seed, stream| {
            let mut g = Gaussian::new(seed, stream);
            (0..N).map(|_| g.next()).collect::<Vec<_>>()
        };
        let base = of(1, 0);
        for other in [of(2, 0), of(1, 1), of(0, 0)] {
            let correlation = base.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / N as f64;
            assert!(
                correlation.abs() < 5.0 / f64::sqrt(N as f64),
                "{correlation}"
            );
        }
        assert_eq!(base, of(1, 0));
    }
}
