//! Zeros and poles as a cascade of first and second order sections.
//!
//! Each pair of complex poles is a section with the nearest zeros, so that the peak of the poles and the notch of the zeros meet in
//! one section and not in the signal between two (Oppenheim and Schafer, *Discrete-Time Signal Processing*, section 6.9.3). Real
//! poles are sections of first order: near z = 1 a product of two of them would lose digits. A section of two real poles exists
//! only where a pair of complex zeros needs it. The gain is divided evenly.

use nalgebra::Complex;

use super::domain::Domain;
use super::roots::{Factors, Roots};
use crate::Section;
use bench_base::numeric::assign;

/// Zeros and poles of a section.
#[derive(Clone, Debug, Default)]
struct Group {
    zeros: Roots,
    poles: Roots,
}

/// The sections, with the gain in the unit of the factors times `unit`. Coefficients by rising powers of s or z.
pub(super) fn sections(factors: &Factors, unit: f64, domain: Domain) -> Vec<Section> {
    let groups = groups(factors);
    if groups.is_empty() {
        return vec![section(&Group::default(), factors.gain * unit)];
    }
    let norms: Vec<f64> = groups.iter().map(|group| group.scale(domain)).collect();
    let rest = norms
        .iter()
        .fold(factors.gain * unit, |gain, norm| gain / norm);
    let share = libm::pow(rest.abs(), 1.0 / groups.len() as f64);
    // The last section takes what rounding left of the others.
    let last = groups.len() - 1;
    let others: f64 = norms[..last].iter().map(|norm| share * norm).product();
    let gains = norms.iter().enumerate().map(|(index, norm)| {
        if index == last {
            factors.gain * unit / others
        } else {
            share * norm
        }
    });
    groups
        .iter()
        .zip(gains)
        .map(|(group, gain)| section(group, gain))
        .collect()
}

impl Group {
    /// The gain with which the magnitude is near 1 between the roots: prod |p|/prod |z| without roots at 0 in the s plane, 1 in
    /// the z plane.
    fn scale(&self, domain: Domain) -> f64 {
        match domain {
            Domain::Continuous => magnitude(&self.poles) / magnitude(&self.zeros),
            Domain::Discrete { .. } => 1.0,
        }
    }
}

fn magnitude(roots: &Roots) -> f64 {
    let norms = roots.all().map(|root| root.norm());
    norms.filter(|norm| *norm > 0.0).product()
}

fn section(group: &Group, gain: f64) -> Section {
    Section {
        numerator: polynomial(&group.zeros).map(|c| c * gain),
        denominator: polynomial(&group.poles),
        prewarp_rad_s: None,
    }
}

/// prod(v - root) of at most two roots, by rising powers.
fn polynomial(roots: &Roots) -> [f64; 3] {
    match (roots.pairs.as_slice(), roots.real.as_slice()) {
        ([pair, ..], _) => [pair.norm_sqr(), -2.0 * pair.re, 1.0],
        ([], [a, b, ..]) => [a * b, -(a + b), 1.0],
        ([], [a]) => [-a, 1.0, 0.0],
        ([], []) => [1.0, 0.0, 0.0],
    }
}

fn groups(factors: &Factors) -> Vec<Group> {
    let (zeros, poles) = (&factors.zeros, &factors.poles);
    let (mut pairs, unpaired) = groups_of_pairs(&zeros.pairs, &poles.pairs);
    let mut real_poles = poles.real.clone();
    let wide: Vec<Group> = unpaired
        .into_iter()
        .map(|zero| group_of_real_poles(zero, &mut real_poles))
        .collect();
    let (mut single, left) = groups_of_real(&zeros.real, &real_poles);
    fill(&mut pairs, left);
    single.extend(wide);
    single.extend(pairs);
    single
}

/// A group of each pair of poles with the nearest pair of zeros, and the pairs of zeros that are left.
fn groups_of_pairs(
    zeros: &[Complex<f64>],
    poles: &[Complex<f64>],
) -> (Vec<Group>, Vec<Complex<f64>>) {
    let partners = assign(poles.len(), zeros.len(), |i, j| {
        distance(poles[i], zeros[j])
    });
    let groups = poles.iter().zip(&partners).map(|(pole, partner)| Group {
        zeros: Roots {
            real: Vec::new(),
            pairs: partner.map(|j| zeros[j]).into_iter().collect(),
        },
        poles: Roots {
            real: Vec::new(),
            pairs: vec![*pole],
        },
    });
    let groups = groups.collect();
    let is_left = |(j, _): &(usize, &Complex<f64>)| !partners.contains(&Some(*j));
    let left = zeros.iter().enumerate().filter(is_left);
    (groups, left.map(|(_, zero)| *zero).collect())
}

/// The difference of two roots relative to their size.
fn distance(a: Complex<f64>, b: Complex<f64>) -> f64 {
    if a == b {
        0.0
    } else {
        (a - b).norm() / (a.norm() + b.norm())
    }
}

/// A pair of zeros with the two nearest real poles, which are taken from the list. A proper transfer function has them.
fn group_of_real_poles(zero: Complex<f64>, real_poles: &mut Vec<f64>) -> Group {
    let mut poles = Roots::default();
    for _ in 0..2 {
        let distances = real_poles
            .iter()
            .map(|pole| distance(Complex::new(*pole, 0.0), zero));
        let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((index, _)) = nearest {
            poles.real.push(real_poles.swap_remove(index));
        }
    }
    Group {
        zeros: Roots {
            real: Vec::new(),
            pairs: vec![zero],
        },
        poles,
    }
}

/// A group of each real pole with the nearest real zero, and the real zeros that are left.
fn groups_of_real(zeros: &[f64], poles: &[f64]) -> (Vec<Group>, Vec<f64>) {
    let real = |x: f64| Complex::new(x, 0.0);
    let partners = assign(poles.len(), zeros.len(), |i, j| {
        distance(real(poles[i]), real(zeros[j]))
    });
    let groups = poles.iter().zip(&partners).map(|(pole, partner)| Group {
        zeros: Roots {
            real: partner.map(|j| zeros[j]).into_iter().collect(),
            pairs: Vec::new(),
        },
        poles: Roots {
            real: vec![*pole],
            pairs: Vec::new(),
        },
    });
    let groups = groups.collect();
    let is_left = |(j, _): &(usize, &f64)| !partners.contains(&Some(*j));
    let left = zeros.iter().enumerate().filter(is_left);
    (groups, left.map(|(_, zero)| *zero).collect())
}

/// Gives the real zeros that are left to pairs of poles without zeros, at most two to each.
fn fill(groups: &mut [Group], zeros: Vec<f64>) {
    let mut zeros = zeros.into_iter();
    let free = groups
        .iter_mut()
        .filter(|group| group.zeros.pairs.is_empty());
    for group in free {
        group.zeros.real.extend(zeros.by_ref().take(2));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factors(zeros: Roots, poles: Roots) -> Factors {
        Factors {
            zeros,
            poles,
            gain: -6.0,
        }
    }

    fn roots(real: &[f64], pairs: &[(f64, f64)]) -> Roots {
        Roots {
            real: real.to_vec(),
            pairs: pairs
                .iter()
                .map(|(re, im)| Complex::new(*re, *im))
                .collect(),
        }
    }

    fn assert_same_response(factors: &Factors, sections: &[Section], domain: Domain) {
        for w in [0.3, 3.0, 700.0, 2000.0] {
            let v = domain.point(w);
            let product: Complex<f64> =
                sections.iter().map(|section| section.response(v)).product();
            let ratio = product / factors.response(v);
            assert!((ratio - 1.0).norm() < 1e-13, "{w}: {ratio}");
        }
    }

    #[test]
    fn every_section_is_proper_and_their_product_is_the_transfer_function() {
        let cases = [
            (roots(&[], &[]), roots(&[], &[])),
            (roots(&[], &[]), roots(&[0.0], &[])),
            (roots(&[-1.0, -2.0], &[]), roots(&[], &[(-3.0, 4.0)])),
            (roots(&[], &[(-1.0, 9.0)]), roots(&[-5.0, -6.0, -7.0], &[])),
            (
                roots(&[-1.0], &[(-1.0, 9.0), (-0.1, 520.0)]),
                roots(&[0.0, -5.0, -6.0], &[(-55.0, 552.0)]),
            ),
            (
                roots(&[-1.0, -2.0, -3.0], &[(-1.0, 9.0)]),
                roots(&[-5.0], &[(-1.0, 8.0), (-2.0, 3.0)]),
            ),
        ];
        for (zeros, poles) in cases {
            let count = poles.count();
            let factors = factors(zeros, poles);
            let sections = sections(&factors, 1.0, Domain::Continuous);
            let orders = sections.iter().map(|section| section.poles().len());
            assert_eq!(orders.sum::<usize>(), count);
            for section in &sections {
                assert!(section.checked().is_ok(), "{section:?}");
            }
            assert_same_response(&factors, &sections, Domain::Continuous);
        }
    }

    #[test]
    fn a_notch_is_paired_with_the_nearest_poles() {
        let zeros = roots(&[], &[(-70.0, 160.0), (-5.2, 520.0)]);
        let poles = roots(&[], &[(-55.0, 552.0), (-490.0, 500.0)]);
        let sections = sections(&factors(zeros, poles), 1.0, Domain::Continuous);
        let notch = &sections[0];
        let ratio = notch.numerator[0] / notch.numerator[2];
        assert!((ratio - (5.2 * 5.2 + 520.0 * 520.0)).abs() < 1e-6);
        assert!((notch.denominator[1] - 110.0).abs() < 1e-9);
    }

    #[test]
    fn gain_is_divided_evenly_and_keeps_its_sign() {
        let poles = roots(&[0.5, 0.25, 0.125], &[]);
        let domain = Domain::Discrete { rate_hz: 1000.0 };
        let factors = factors(roots(&[], &[]), poles);
        let sections = sections(&factors, 1.0, domain);
        let share = libm::cbrt(6.0);
        for section in &sections {
            assert!((section.numerator[0].abs() - share).abs() < 1e-12);
        }
        assert_same_response(&factors, &sections, domain);
    }
}
