//! The CNMP map: number of pairs of CNMP zeros of SR4DoF over operating point and mass asymmetry.
//!
//! With x1 = 0 at the probe and x4 = 0 in the virtual motions (q of Eq. 2-5 is the row of x4), the pencil of `kinds.rs` has
//! the unknowns y1, y2, y3 and, with b = a^2, masses in m3, springs in k, kappa = k4/k, the form A + u B:
//!
//! ```text
//!  A = [ 2 + 2 b kappa   -1  -1 - 4 b kappa ]   B = [ m1 + 2 b (m3 + m4)            0           -2 b m3 - 4 b m4        ]
//!      [-1 - 2 b kappa    2       4 b kappa ]       [ b m2 - 2 b (m3 + m4)   m2 (1 - b)          2 b m3 + 4 b m4        ]
//!      [-1 - 2 b kappa    0   2 + 4 b kappa ]       [-b m3 - 2 b m4                 0   m3 (1 + b) + 4 b m4        ]
//! ```
//!
//! Its determinant is a cubic in u = s^2. No root of it is computed: the sign of the discriminant decides whether two of the
//! three are complex, which is one CNMP pair. Where rounding could change that sign, the pencil itself decides.

use std::ops::{Add, Mul, Sub};
use std::thread::ScopedJoinHandle;

use super::{cnmp_pairs, undamped_zeros};
use crate::{PlantError, PlantSettings, Sr4dofSettings, undamped};

/// The sign of the discriminant is decisive above this ratio to the sum of the sizes of its terms ([`Bounded`]).
///
/// Rounding: an entry of A or B is exact to 8 roundings of its size, a coefficient, a sum of up to 12 products of
/// three, to 3 x 8 + 2 + 11, the discriminant, of degree 4, to 4 x 37 + 8 = 156: 2e-14. The pencil treats a pair as
/// real up to a ratio of imaginary part to size of 1e-7, and its own rounding separates two equal values by that
/// much: the square of their distance, 4e-14 of the terms, must be decided there too. 1e-9 is well above both; pairs
/// closer than some 3e-5 of their size are decided by the pencil.
const DECISIVE_RATIO: f64 = 1e-9;

/// CNMP pairs of the zeros without damping, one row for each operating point (ratios Y1o/L), in it one for each mass
/// asymmetry D = m2/m3 - 1, on up to `threads` threads (at least one).
///
/// Equals [`cnmp_pairs`] of [`undamped_zeros`] at each point (Fig 2-2, Eq. 2-5), and fails as these do. `settings` give all
/// but the two.
pub fn cnmp_map(
    settings: &Sr4dofSettings,
    operating_points: &[f64],
    asymmetries: &[f64],
    threads: usize,
) -> Result<Vec<Vec<u8>>, PlantError> {
    let rows = operating_points.len().div_ceil(threads.max(1)).max(1);
    let parts = std::thread::scope(|scope| {
        let spawn = |points| scope.spawn(move || map_rows(settings, points, asymmetries));
        let running: Vec<_> = operating_points.chunks(rows).map(spawn).collect();
        running.into_iter().map(join).collect::<Result<Vec<_>, _>>()
    })?;
    Ok(parts.into_iter().flatten().collect())
}

fn map_rows(
    settings: &Sr4dofSettings,
    points: &[f64],
    asymmetries: &[f64],
) -> Result<Vec<Vec<u8>>, PlantError> {
    let row = |point: &f64| {
        asymmetries
            .iter()
            .map(|d| count(settings, *point, *d))
            .collect()
    };
    points.iter().map(row).collect()
}

/// The result of a thread; its panic continues in this one.
fn join<T>(thread: ScopedJoinHandle<'_, T>) -> T {
    thread
        .join()
        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn count(settings: &Sr4dofSettings, point: f64, asymmetry: f64) -> Result<u8, PlantError> {
    match by_discriminant(settings, point, asymmetry) {
        Some(complex) => Ok(u8::from(complex)),
        None => by_pencil(settings, point, asymmetry),
    }
}

fn by_pencil(settings: &Sr4dofSettings, point: f64, asymmetry: f64) -> Result<u8, PlantError> {
    let plant = PlantSettings::Sr4dof(Sr4dofSettings {
        operating_point_m: point * settings.beam_length_m,
        mass_asymmetry: asymmetry,
        ..settings.clone()
    });
    let zeros = undamped_zeros(&undamped(&plant))?;
    // Three values of u hold one complex pair at most.
    Ok(u8::from(cnmp_pairs(&zeros) > 0))
}

/// Whether two of the three u are complex; `None` where rounding could change the answer.
fn by_discriminant(settings: &Sr4dofSettings, point: f64, asymmetry: f64) -> Option<bool> {
    let pencil = Scaled::new(settings, point, asymmetry).pencil();
    let discriminant = discriminant(pencil.determinant());
    let is_decisive = discriminant.value.abs() > DECISIVE_RATIO * discriminant.size;
    is_decisive.then_some(discriminant.value < 0.0)
}

/// A number with the sum of the sizes of its terms, each term with all of its sums taken without cancellation.
#[derive(Clone, Copy)]
struct Bounded {
    value: f64,
    size: f64,
}

impl Bounded {
    fn of(value: f64) -> Bounded {
        Bounded {
            value,
            size: value.abs(),
        }
    }
}

impl Add for Bounded {
    type Output = Bounded;
    fn add(self, other: Bounded) -> Bounded {
        Bounded {
            value: self.value + other.value,
            size: self.size + other.size,
        }
    }
}

impl Sub for Bounded {
    type Output = Bounded;
    fn sub(self, other: Bounded) -> Bounded {
        Bounded {
            value: self.value - other.value,
            size: self.size + other.size,
        }
    }
}

impl Mul for Bounded {
    type Output = Bounded;
    fn mul(self, other: Bounded) -> Bounded {
        Bounded {
            value: self.value * other.value,
            size: self.size * other.size,
        }
    }
}

/// Coefficients of 1 and u.
type Linear = [Bounded; 2];

/// p q - r s, by powers of u.
fn minor([p, q]: [Linear; 2], [r, s]: [Linear; 2]) -> [Bounded; 3] {
    let middle = (p[0] * q[1] + p[1] * q[0]) - (r[0] * s[1] + r[1] * s[0]);
    [p[0] * q[0] - r[0] * s[0], middle, p[1] * q[1] - r[1] * s[1]]
}

/// The parameters of the pencil: masses in m3, springs in k.
struct Scaled {
    m1: f64,
    m2: f64,
    m4: f64,
    /// b = a^2.
    b: f64,
    /// b kappa.
    bk: f64,
}

impl Scaled {
    fn new(settings: &Sr4dofSettings, point: f64, asymmetry: f64) -> Scaled {
        let b = (0.6 * point) * (0.6 * point);
        let m3 = settings.secondary_stage_mass_kg;
        Scaled {
            m1: settings.motion_stage_mass_kg / m3,
            m2: 1.0 + asymmetry,
            m4: settings.intermediate_stage_mass_kg / m3,
            b,
            bk: b * settings.spring_stiffness_n_per_m / settings.beam().parallelogram_n_per_m(),
        }
    }

    fn pencil(&self) -> Pencil {
        let Scaled { m1, m2, m4, b, bk } = *self;
        let number = Bounded::of;
        let near = number(b * (1.0 + m4));
        let far = number(b * (2.0 + 4.0 * m4));
        Pencil {
            r11: [number(2.0 + 2.0 * bk), number(m1) + near + near],
            r13: [number(-1.0 - 4.0 * bk), number(0.0) - far],
            r21: [number(-1.0 - 2.0 * bk), number(b * m2) - near - near],
            r22: [number(2.0), number(m2) - number(b * m2)],
            r23: [number(4.0 * bk), far],
            r31: [number(-1.0 - 2.0 * bk), number(-b * (1.0 + 2.0 * m4))],
            r33: [number(2.0 + 4.0 * bk), number(1.0 + b * (1.0 + 4.0 * m4))],
        }
    }
}

/// A + u B; the two other entries of the second column are constants: -1 in the first row, 0 in the third.
struct Pencil {
    r11: Linear,
    r13: Linear,
    r21: Linear,
    r22: Linear,
    r23: Linear,
    r31: Linear,
    r33: Linear,
}

impl Pencil {
    /// det(A + u B) by powers of u, expanded along the second column.
    fn determinant(&self) -> [Bounded; 4] {
        let first = minor([self.r21, self.r33], [self.r23, self.r31]);
        let second = minor([self.r11, self.r33], [self.r13, self.r31]);
        let [constant, linear] = self.r22;
        [
            first[0] + constant * second[0],
            first[1] + constant * second[1] + linear * second[0],
            first[2] + constant * second[2] + linear * second[1],
            linear * second[2],
        ]
    }
}

/// Discriminant of d + c u + b u^2 + a u^3: below zero for one real and two complex roots.
fn discriminant([d, c, b, a]: [Bounded; 4]) -> Bounded {
    let times = |factor: f64, x: Bounded| Bounded::of(factor) * x;
    let (bb, cc, ad) = (b * b, c * c, a * d);
    times(18.0, ad * b * c) + bb * cc
        - times(4.0, bb * b * d)
        - times(4.0, a * cc * c)
        - times(27.0, ad * ad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlantSettings;
    use crate::test_profile::plant_of_profile;
    use bench_base::numeric::linspace;
    use rand_core::Rng;

    fn chapter2(sets: &[&str]) -> Sr4dofSettings {
        let PlantSettings::Sr4dof(settings) = plant_of_profile("chapter2", sets) else {
            panic!("not SR4DoF")
        };
        settings
    }

    fn grid(from: f64, to: f64, count: usize) -> Vec<f64> {
        linspace(from, to, count).collect()
    }

    /// Uniform in [0, 1), by the generator that the simulation takes.
    fn draws(seed: u64) -> impl FnMut() -> f64 {
        let mut random = rand_pcg::Pcg64::new(u128::from(seed), 1);
        move || (random.next_u64() >> 11) as f64 / 2f64.powi(53)
    }

    #[test]
    fn discriminant_agrees_with_the_pencil_on_random_stages() {
        let mut draw = draws(4);
        let mut settings = chapter2(&[]);
        let (mut complex, mut undecided) = (0, 0);
        for _ in 0..20_000 {
            let mut between = |low: f64, high: f64| low * (high / low).powf(draw());
            settings.motion_stage_mass_kg = between(0.01, 2.0);
            settings.secondary_stage_mass_kg = between(0.002, 0.2);
            settings.intermediate_stage_mass_kg = between(0.01, 2.0);
            settings.spring_stiffness_n_per_m = between(10.0, 1e5);
            let (point, asymmetry) = (0.3 * draw() - 0.15, draw() - 0.5);
            let pencil = by_pencil(&settings, point, asymmetry).unwrap();
            assert_eq!(
                count(&settings, point, asymmetry).unwrap(),
                pencil,
                "{settings:?} {point} {asymmetry}"
            );
            complex += u32::from(pencil);
            undecided += u32::from(by_discriminant(&settings, point, asymmetry).is_none());
        }
        assert!(
            (200..=19_800).contains(&complex),
            "both counts must be among the draws: {complex} of 20,000"
        );
        assert!(
            undecided <= 2_000,
            "the pencil is the exception: {undecided} of 20,000"
        );
    }

    #[test]
    fn map_agrees_with_the_pencil_everywhere() {
        let settings = chapter2(&["plant.secondary_stage_mass_kg=0.018"]);
        let (points, asymmetries) = (grid(-0.15, 0.15, 200), grid(-0.05, 0.15, 200));
        let map = cnmp_map(&settings, &points, &asymmetries, 2).unwrap();
        for (row, &point) in map.iter().zip(&points) {
            for (&cell, &asymmetry) in row.iter().zip(&asymmetries) {
                assert_eq!(
                    cell,
                    by_pencil(&settings, point, asymmetry).unwrap(),
                    "at {point}, {asymmetry}"
                );
            }
        }
        assert_eq!(
            map,
            cnmp_map(&settings, &points, &asymmetries, 1).unwrap(),
            "for any number of threads"
        );
    }

    #[test]
    fn pencil_decides_where_two_zeros_meet() {
        // At D = 1 %, m3 = 18 g they leave the imaginary axis at 3.399 % of L: there no count may depend on the last bit.
        let settings = chapter2(&["plant.secondary_stage_mass_kg=0.018"]);
        for point in grid(0.03398, 0.03400, 201) {
            assert_eq!(
                count(&settings, point, 0.01),
                by_pencil(&settings, point, 0.01),
                "at {point}"
            );
        }
    }

    #[test]
    fn empty_grid_gives_an_empty_map() {
        assert_eq!(cnmp_map(&chapter2(&[]), &[], &[0.1], 2), Ok(vec![]));
        assert_eq!(cnmp_map(&chapter2(&[]), &[0.1], &[], 0), Ok(vec![vec![]]));
    }
}
