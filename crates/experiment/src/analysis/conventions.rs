//! Conventions in which a response of another program may differ: unit of the phase, sign of the phase, sign of the response.
//!
//! ```text
//! radians read as degrees   |H| has a resonance, but no phase reaches 60 degrees: across a resonance it falls by half a turn
//! conjugated                sum of Im(H_k+1 conj H_k) > 0: H turns clockwise on every resonance, whatever the sign of its residue,
//!                           and by every delay
//! sign                      H at the lowest frequencies is opposite to the expected response
//! ```
//!
//! Each of them would otherwise look like a delay: in this order, as each needs that the ones before are right.

use nalgebra::Complex;

use super::measured_frf::FrfError;
use super::response_points::variance;
use bench_identify::Frf;

/// A response with no larger phase in degrees, and a resonance, has radians.
const LARGEST_RADIANS_DEG: f64 = 60.0;
/// Phases that are all smaller are noise, or those of a real response.
const LEAST_RADIANS_DEG: f64 = 1.5;
/// A resonance is larger than the response at the first frequency by this factor.
const RESONANCE: f64 = 3.0;
/// A turn of more standard deviations is not noise.
const CERTAIN_SIGMAS: f64 = 4.0;
/// The lowest frequencies are these many, or those up to a multiple of the first one.
const LOWEST_POINTS: usize = 5;
const LOWEST_RATIO: f64 = 1.5;
/// Mean cosine of the phases from the expected ones below which the sign is the other one: more than 120 degrees.
const OPPOSITE: f64 = -0.5;
/// Over a larger range of |H| the response is not static.
const STATIC: std::ops::RangeInclusive<f64> = 0.7..=1.5;

/// Refuses a response in another convention than the bench has. `expected` is the response at a frequency in hertz; only the sign of its
/// real part relative to the measured one at the lowest frequencies matters.
pub(crate) fn check_conventions(
    frf: &Frf,
    expected: impl Fn(f64) -> Complex<f64>,
) -> Result<(), FrfError> {
    check_unit_of_phase(frf)?;
    check_turn(frf)?;
    check_sign(frf, lowest(frf), expected)
}

/// As [`check_conventions`], without a model: a stage moves in the direction of its force. If the response does not begin with a static
/// one, its sign is not known.
pub(crate) fn check_static_conventions(frf: &Frf, static_sign: f64) -> Result<(), FrfError> {
    check_unit_of_phase(frf)?;
    check_turn(frf)?;
    let size = |k: usize| frf.response[k].norm();
    let is_static = |k: &usize| STATIC.contains(&(size(*k) / size(0)));
    let flat = (0..lowest(frf)).take_while(is_static).count();
    // Above a free body |H| falls to less than half over this range.
    if flat < near_first(frf).max(2).min(frf.len()) {
        return Ok(());
    }
    check_sign(frf, flat, |_| Complex::from(static_sign))
}

/// Number of the frequencies up to a multiple of the first one.
fn near_first(frf: &Frf) -> usize {
    let limit_hz = LOWEST_RATIO * frf.band_hz().0;
    frf.frequency_hz.partition_point(|hz| *hz <= limit_hz)
}

/// Number of the lowest frequencies.
fn lowest(frf: &Frf) -> usize {
    near_first(frf).max(LOWEST_POINTS).min(frf.len())
}

fn check_unit_of_phase(frf: &Frf) -> Result<(), FrfError> {
    let phases = (0..frf.len()).map(|k| frf.phase_rad(k).to_degrees().abs());
    let largest_deg = phases.fold(0.0, f64::max);
    let could_be = (LEAST_RADIANS_DEG..LARGEST_RADIANS_DEG).contains(&largest_deg);
    match resonance_hz(frf).filter(|_| could_be) {
        None => Ok(()),
        Some(resonance_hz) => Err(FrfError::Radians {
            largest_deg,
            resonance_hz,
        }),
    }
}

/// The frequency of the largest response within the band, if it is a resonance.
fn resonance_hz(frf: &Frf) -> Option<f64> {
    let size = |k: usize| frf.response[k].norm();
    let last = frf.len().checked_sub(1)?;
    let largest = (0..frf.len()).max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
    let is_within = largest > 0 && largest < last;
    let is_large = size(largest) > RESONANCE * size(0) && size(largest) > RESONANCE * size(last);
    (is_within && is_large).then(|| frf.frequency_hz[largest])
}

fn check_turn(frf: &Frf) -> Result<(), FrfError> {
    let (mut turn, mut power) = (0.0, 0.0);
    for pair in frf.response.windows(2) {
        turn += (pair[1] * pair[0].conj()).im;
    }
    for k in 0..frf.len() {
        // A point is in two of the products, each with half of its error across the other factor.
        power += 2.0 * frf.response[k].norm_sqr() * variance(frf, k);
    }
    if turn > CERTAIN_SIGMAS * power.sqrt() {
        Err(FrfError::Conjugated)
    } else {
        Ok(())
    }
}

/// Compares the sign at the first `count` frequencies.
fn check_sign(
    frf: &Frf,
    count: usize,
    expected: impl Fn(f64) -> Complex<f64>,
) -> Result<(), FrfError> {
    let cosine = |k: usize| {
        (frf.response[k] / expected(frf.frequency_hz[k]))
            .arg()
            .cos()
    };
    let mean = (0..count).map(cosine).sum::<f64>() / count as f64;
    let noise = (0..count).map(|k| variance(frf, k)).sum::<f64>();
    let power = (0..count).map(|k| frf.response[k].norm_sqr()).sum::<f64>();
    let is_certain = power > CERTAIN_SIGMAS * CERTAIN_SIGMAS * noise;
    if is_certain && mean < OPPOSITE {
        return Err(FrfError::Sign {
            frequency_hz: frf.band_hz().0,
            phase_deg: frf.phase_rad(0).to_degrees(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use bench_base::units::rad_s;
    use bench_config::{Config, Source, load};
    use bench_control::ClosedLoop;
    use bench_identify::scatter::SigmaSource;
    use bench_identify::{FrfPoint, PHASE_SIGMA_LIMIT_RAD};
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::analysis::{MeasuredFrf, check_frf};
    use crate::plan::closed_loop;

    /// Stages of both signs and several operating points, at several rates.
    const BENCHES: [&[&str]; 6] = [
        &[],
        &["loop.rate_hz=2000", "loop.computing_delay_periods=2"],
        &[
            "loop.rate_hz=1000",
            "chirp.stop_hz=400",
            "control.controller=slow",
        ],
        &["plant.mass_asymmetry=-0.1"],
        &["plant.operating_point_m=0.0019"],
        &["probe.latency_s=0.001", "interlock.probe_stale_s=0.003"],
    ];

    fn bench(sets: &[&str]) -> (Config, ClosedLoop) {
        let config = load(&Source {
            sets: sets.iter().map(|set| set.to_string()).collect(),
            ..Source::default()
        });
        let config = config.expect("valid settings");
        let model = closed_loop(&config).expect("a loop");
        (config, model)
    }

    fn normal(random: &mut Pcg64Mcg) -> Complex<f64> {
        let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
        let (radius, angle) = ((-uniform().ln()).sqrt(), std::f64::consts::TAU * uniform());
        Complex::from_polar(radius, angle)
    }

    /// The plant of a model, changed by a convention, with noise of one part in 1000 of the static response.
    fn measured(
        model: &ClosedLoop,
        grid_hz: &[f64],
        seed: u64,
        change: &dyn Fn(f64, Complex<f64>) -> Complex<f64>,
    ) -> MeasuredFrf {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let sigma = 1e-3 * model.sampled_plant(rad_s(grid_hz[0])).norm();
        let mut frf = Frf::default();
        for &frequency_hz in grid_hz {
            let noise = normal(&mut random) * sigma;
            frf.push(FrfPoint {
                frequency_hz,
                response: change(
                    frequency_hz,
                    model.sampled_plant(rad_s(frequency_hz)) + noise,
                ),
                coherence: 1.0,
                variance: sigma * sigma,
                resolution_hz: 0.25,
            });
        }
        assert!(
            frf.phase_sigma_rad
                .iter()
                .all(|s| *s <= PHASE_SIGMA_LIMIT_RAD)
        );
        MeasuredFrf {
            frf,
            recorded: None,
            sigma: SigmaSource::Given,
            cautions: Vec::new(),
        }
    }

    /// The lines of an analyser, and the points of a stepped sine.
    fn grids(config: &Config) -> [Vec<f64>; 2] {
        let last_hz = 0.4 * config.servo.rate_hz.min(1000.0);
        let lines = (1..).map(|k| 0.25 * f64::from(k));
        let stepped = (0..).map(|k| 0.5 * 1.01_f64.powi(k));
        [
            lines.take_while(|f| *f <= last_hz).collect(),
            stepped.take_while(|f| *f <= last_hz).collect(),
        ]
    }

    /// The outcome for a convention, over all benches, grids and some seeds.
    fn each(
        change: &dyn Fn(f64, Complex<f64>) -> Complex<f64>,
        is_right: impl Fn(&Result<(), FrfError>) -> bool,
        is_right_without_model: impl Fn(&Result<(), FrfError>) -> bool,
    ) {
        for sets in BENCHES {
            let (config, model) = bench(sets);
            for (seed, grid) in grids(&config).iter().enumerate() {
                let measured = measured(&model, grid, seed as u64, change);
                let found = check_frf(&measured, &model, &config);
                assert!(is_right(&found), "{sets:?}, grid {seed}: {found:?}");
                let found = check_static_conventions(&measured.frf, 1.0);
                assert!(
                    is_right_without_model(&found),
                    "{sets:?}, grid {seed}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn accepts_a_response_in_the_conventions_of_the_bench() {
        each(&|_, h| h, Result::is_ok, Result::is_ok);
    }

    #[test]
    fn names_a_response_of_the_other_sign() {
        let sign = |found: &Result<(), FrfError>| matches!(found, Err(FrfError::Sign { .. }));
        each(&|_, h| -h, sign, sign);
    }

    #[test]
    fn names_a_conjugated_response() {
        let conjugated = |found: &Result<(), FrfError>| matches!(found, Err(FrfError::Conjugated));
        each(&|_, h| h.conj(), conjugated, conjugated);
        each(&|_, h| -h.conj(), conjugated, conjugated);
    }

    #[test]
    fn names_radians_that_were_read_as_degrees() {
        let radians = |found: &Result<(), FrfError>| matches!(found, Err(FrfError::Radians { .. }));
        let read = |_, h: Complex<f64>| Complex::from_polar(h.norm(), h.arg().to_radians());
        each(&read, radians, radians);
    }

    #[test]
    fn true_excess_delay_is_a_delay() {
        for excess_s in [0.002, 0.005] {
            let later =
                move |f: f64, h: Complex<f64>| h * Complex::from_polar(1.0, -rad_s(f) * excess_s);
            let delay = |found: &Result<(), FrfError>| match found {
                Err(FrfError::OtherDelay { excess_ms, .. }) => {
                    (excess_ms / (1e3 * excess_s) - 1.0).abs() < 0.05
                }
                _ => false,
            };
            each(&later, delay, Result::is_ok);
        }
    }
}
