//! The roots of a real polynomial, and a transfer function as zeros, poles and gain.

use nalgebra::Complex;

/// Roots of a real polynomial: real ones, and one of each conjugate pair, with a positive imaginary part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Roots {
    /// Real roots.
    pub real: Vec<f64>,
    /// Of each pair the root above the real axis.
    pub pairs: Vec<Complex<f64>>,
}

/// Zeros, poles and gain: H(v) = k prod(v - z)/prod(v - p), where v is s (in rad/s) or z.
#[derive(Clone, Debug, PartialEq)]
pub struct Factors {
    /// The zeros.
    pub zeros: Roots,
    /// The poles.
    pub poles: Roots,
    /// k.
    pub gain: f64,
}

/// Relative difference of a root from the conjugate of its partner that is due to rounding: some units in the last place.
const CONJUGATE_TOLERANCE: f64 = 16.0 * f64::EPSILON;

impl Roots {
    /// The roots of a list that is closed under conjugation, apart from rounding.
    ///
    /// # Errors
    /// A complex root without its conjugate.
    pub fn from_list(list: &[Complex<f64>]) -> Result<Roots, Complex<f64>> {
        let real = list.iter().filter(|root| root.im == 0.0);
        let real = real.map(|root| root.re).collect();
        let upper = list.iter().copied().filter(|root| root.im > 0.0);
        let mut lower: Vec<Complex<f64>> =
            list.iter().copied().filter(|root| root.im < 0.0).collect();
        let mut pairs = Vec::new();
        for root in upper {
            let partner = take_conjugate(root, &mut lower).ok_or(root)?;
            pairs.push((root + partner.conj()) * 0.5);
        }
        match lower.first() {
            Some(alone) => Err(*alone),
            None => Ok(Roots { real, pairs }),
        }
    }

    /// Adds the roots of a factor.
    pub(super) fn append(&mut self, other: Roots) {
        self.real.extend(other.real);
        self.pairs.extend(other.pairs);
    }

    /// Number of roots.
    pub fn count(&self) -> usize {
        self.real.len() + 2 * self.pairs.len()
    }

    /// All roots, both of each pair.
    pub fn all(&self) -> impl Iterator<Item = Complex<f64>> + '_ {
        let real = self.real.iter().map(|root| Complex::new(*root, 0.0));
        let pairs = self.pairs.iter().flat_map(|root| [*root, root.conj()]);
        real.chain(pairs)
    }

    /// prod(v - root).
    pub fn product(&self, v: Complex<f64>) -> Complex<f64> {
        self.all().map(|root| v - root).product()
    }

    /// Replaces the `count` roots nearest to `target` by it. A pair is two roots.
    pub(super) fn snap(&mut self, target: f64, count: usize) {
        let mut left = count;
        while left > 0 {
            let (real, pair) = (self.nearest_real(target), self.nearest_pair(target));
            match (real, pair) {
                (real, Some((index, distance)))
                    if left > 1 && real.is_none_or(|(_, other)| distance < other) =>
                {
                    self.pairs.swap_remove(index);
                    left -= 2;
                }
                (Some((index, _)), _) => {
                    self.real.swap_remove(index);
                    left -= 1;
                }
                _ => break,
            }
        }
        self.real.extend(std::iter::repeat_n(target, count - left));
    }

    fn nearest_real(&self, target: f64) -> Option<(usize, f64)> {
        let distances = self.real.iter().map(|root| (root - target).abs());
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn nearest_pair(&self, target: f64) -> Option<(usize, f64)> {
        let distances = self.pairs.iter().map(|root| (root - target).norm());
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Distances of all roots from `target`, rising.
    pub(super) fn distances(&self, target: f64) -> Vec<f64> {
        let mut distances: Vec<f64> = self.all().map(|root| (root - target).norm()).collect();
        distances.sort_by(f64::total_cmp);
        distances
    }
}

/// Removes the root nearest to the conjugate of `root`, if it differs by rounding only.
fn take_conjugate(root: Complex<f64>, others: &mut Vec<Complex<f64>>) -> Option<Complex<f64>> {
    let distance = |other: &Complex<f64>| (other.conj() - root).norm();
    let distances = others.iter().map(distance).enumerate();
    let (nearest, difference) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (difference <= CONJUGATE_TOLERANCE * root.norm()).then(|| others.swap_remove(nearest))
}

impl Factors {
    /// H(v).
    pub fn response(&self, v: Complex<f64>) -> Complex<f64> {
        // Zeros and poles in turn: the product neither overflows nor vanishes on its way.
        let mut zeros = self.zeros.all().map(|zero| v - zero);
        let ratio = self
            .poles
            .all()
            .fold(Complex::new(self.gain, 0.0), |product, pole| {
                product * zeros.next().unwrap_or(Complex::new(1.0, 0.0)) / (v - pole)
            });
        zeros.fold(ratio, |product, factor| product * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn list_with_conjugates_in_any_order_gives_pairs() {
        let (a, b) = (Complex::new(-1.0, 2.0), Complex::new(-1.0, 5.0));
        let list = [a.conj(), b, Complex::new(-3.0, 0.0), a, b.conj()];
        let roots = Roots::from_list(&list).expect("closed");
        assert_eq!(roots.real, [-3.0]);
        assert_eq!(roots.pairs, [b, a]);
        assert_eq!(roots.count(), 5);
    }

    #[test]
    fn rejects_a_complex_root_without_its_conjugate() {
        let alone = Complex::new(-1.0, -2.0);
        assert_eq!(Roots::from_list(&[alone]), Err(alone));
        let near = Complex::new(-1.0, 2.000_001);
        assert_eq!(Roots::from_list(&[alone, near]), Err(near));
    }

    #[test]
    fn roots_nearest_to_an_integrator_become_it() {
        let roots = Roots {
            real: vec![0.5, 0.99],
            pairs: vec![Complex::new(1.0, 1e-8)],
        };
        let (mut single, mut double) = (roots.clone(), roots);
        double.snap(1.0, 2);
        assert_eq!(double.real, [0.5, 0.99, 1.0, 1.0]);
        assert!(double.pairs.is_empty());
        single.snap(1.0, 1);
        assert_eq!((single.real.len(), single.pairs.len()), (2, 1));
        assert!(single.real.contains(&1.0) && single.real.contains(&0.5));
    }

    #[test]
    fn response_is_the_quotient_of_the_products() {
        // 3 (v + 1)/((v + 2)(v^2 + 1)) at v = 2: 9/20.
        let factors = Factors {
            zeros: Roots {
                real: vec![-1.0],
                pairs: Vec::new(),
            },
            poles: Roots {
                real: vec![-2.0],
                pairs: vec![Complex::new(0.0, 1.0)],
            },
            gain: 3.0,
        };
        let value = factors.response(Complex::new(2.0, 0.0));
        assert!((value - 0.45).norm() < 1e-15, "{value}");
    }
}
