//! Identification in closed loop, with a loop that is independent of the library: y = P u + v, u = C (r - y).

use bench::identify::joint::{LoopSignals, estimate};
use bench::identify::{EstimatorSettings, Signals, local};
use nalgebra::Complex;

use crate::stage::Dice;

const RATE_HZ: f64 = 1000.0;
const BAND_HZ: (f64, f64) = (2.0, 300.0);
/// A resonance at 20 Hz with 2 % of damping, of static gain 1 after one tick: y[k] = a1 y[k-1] + a2 y[k-2] + b u[k-1].
const POLE: (f64, f64) = (20.0, 0.02);
/// u = KP e + KI T sum e
const KP: f64 = 0.05;
const KI: f64 = 3.0;

fn coefficients() -> (f64, f64, f64) {
    let (w, zeta) = (std::f64::consts::TAU * POLE.0 / RATE_HZ, POLE.1);
    let a1 = 2.0 * (-zeta * w).exp() * (w * (1.0 - zeta * zeta).sqrt()).cos();
    let a2 = -(-2.0 * zeta * w).exp();
    (a1, a2, 1.0 - a1 - a2)
}

/// P at a frequency: b z^-1/(1 - a1 z^-1 - a2 z^-2).
fn plant(frequency_hz: f64) -> Complex<f64> {
    let (a1, a2, b) = coefficients();
    let back = Complex::from_polar(1.0, -std::f64::consts::TAU * frequency_hz / RATE_HZ);
    back * b / (Complex::new(1.0, 0.0) - back * a1 - back * back * a2)
}

/// L = P C, C = KP + KI T/(1 - z^-1).
fn loop_gain(frequency_hz: f64) -> Complex<f64> {
    let back = Complex::from_polar(1.0, -std::f64::consts::TAU * frequency_hz / RATE_HZ);
    plant(frequency_hz) * (Complex::new(KI / RATE_HZ, 0.0) / (Complex::new(1.0, 0.0) - back) + KP)
}

/// A run of 20 s whose reference is a chirp from 1 to 400 Hz, with white noise on the position.
fn run(noise: f64, seed: u64) -> LoopSignals {
    let (a1, a2, b) = coefficients();
    let mut dice = Dice::new(seed);
    let (mut y, mut u, mut sum): ([f64; 2], f64, f64) = ([0.0; 2], 0.0, 0.0);
    let (mut reference_m, mut input_a, mut output_m) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..20_000 {
        let r = swept(k as f64 / RATE_HZ);
        let now = a1 * y[0] + a2 * y[1] + b * u;
        y = [now, y[0]];
        let seen = now + noise * dice.normal();
        sum += r - seen;
        u = KP * (r - seen) + KI / RATE_HZ * sum;
        reference_m.push(r);
        input_a.push(u);
        output_m.push(seen);
    }
    LoopSignals {
        signals: Signals {
            rate_hz: RATE_HZ,
            input_a,
            output_m,
        },
        reference_m,
    }
}

fn swept(t: f64) -> f64 {
    let (from_hz, to_hz, length_s, begin_s) = (1.0_f64, 400.0, 16.0, 0.5);
    let time = t - begin_s;
    if !(0.0..length_s).contains(&time) {
        return 0.0;
    }
    let growth = (to_hz / from_hz).ln() / length_s;
    let fade = |x: f64| {
        if x < 1.0 {
            0.5 - 0.5 * (std::f64::consts::PI * x).cos()
        } else {
            1.0
        }
    };
    let phase = std::f64::consts::TAU * from_hz / growth * (growth * time).exp_m1();
    fade(time / 0.5) * fade((length_s - time) / 0.2) * phase.sin()
}

#[test]
fn noiseless_plant_loop_and_sensitivities_equal_the_model() {
    let joint = estimate(&run(0.0, 1), BAND_HZ, &EstimatorSettings::default()).unwrap();
    let one = Complex::new(1.0, 0.0);
    for (name, frf, truth) in [
        ("P", &joint.plant, &plant as &dyn Fn(f64) -> Complex<f64>),
        ("L", &joint.loop_gain, &loop_gain),
        ("S", &joint.sensitivity, &|f| one / (one + loop_gain(f))),
        ("T", &joint.complementary, &|f| {
            loop_gain(f) / (one + loop_gain(f))
        }),
    ] {
        assert!(frf.len() > 1000, "{name}");
        for (k, f) in frf.frequency_hz.iter().enumerate() {
            // A mean over the 16 bins of 0.05 Hz to either side would take two thirds off a mode of 0.4 Hz of half-width. What is
            // left is what still rings at the end, exp(-0.02 * 2 pi 20 * 3.5) = 1.5e-4: twice that.
            let off = (frf.response[k] / truth(*f) - one).norm();
            assert!(off < 3e-4, "{name} at {f} Hz: off by {off}");
        }
    }
}

/// Right below the resonance, where |L| is near 1, with noise of the size of the reference in a bin, H1 from command to position
/// is biased from P towards -1/C; the estimate with the reference as instrument is not.
#[test]
fn noise_fed_back_by_the_controller_does_not_bias_the_plant() {
    let (frequency_hz, seeds) = (19.5, 60);
    let (mut joint_mean, mut direct_mean) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
    let mut squares = 0.0;
    for seed in 0..seeds {
        let signals = run(0.6, seed);
        let joint = estimate(&signals, BAND_HZ, &EstimatorSettings::default()).unwrap();
        let direct =
            local::estimate(&signals.signals, BAND_HZ, &EstimatorSettings::default()).unwrap();
        let at = joint
            .plant
            .frequency_hz
            .partition_point(|f| *f < frequency_hz);
        let ratio = joint.plant.response[at] / plant(joint.plant.frequency_hz[at]);
        joint_mean += ratio / seeds as f64;
        squares += (ratio - 1.0).norm_sqr() / seeds as f64;
        direct_mean += direct.response[at] / plant(direct.frequency_hz[at]) / seeds as f64;
    }
    // Standard error of the mean of 60 values; the bound is three times that.
    let room = 3.0 * (squares / seeds as f64).sqrt();
    assert!(
        (joint_mean - 1.0).norm() < room && room < 0.15,
        "{joint_mean} within {room}"
    );
    assert!(
        (direct_mean - 1.0).norm() > 2.0 * room,
        "H1 has no bias here: {direct_mean}"
    );
}

#[test]
fn confidence_intervals_contain_the_truth_in_93_to_97_percent() {
    let (mut inside, mut all) = (0, 0);
    for seed in 100..300 {
        let joint = estimate(&run(1e-3, seed), BAND_HZ, &EstimatorSettings::default()).unwrap();
        let frf = &joint.plant;
        for k in (0..frf.len())
            .step_by(7)
            .filter(|k| (frf.frequency_hz[*k] / POLE.0 - 1.0).abs() > 0.1)
        {
            let off = (frf.response[k].norm() - plant(frf.frequency_hz[k]).norm()).abs();
            inside += usize::from(off < 1.96 * frf.magnitude_sigma[k]);
            all += 1;
        }
    }
    let share = inside as f64 / all as f64;
    assert!((0.93..0.97).contains(&share), "{share} of {all}");
}

#[test]
fn rejects_constant_reference() {
    let mut signals = run(1e-3, 3);
    signals.reference_m.fill(0.0);
    let error = estimate(&signals, BAND_HZ, &EstimatorSettings::default()).unwrap_err();
    assert!(
        error.to_string().contains("no energy between 2 and 300 Hz"),
        "{error}"
    );
    signals.reference_m.pop();
    assert!(estimate(&signals, BAND_HZ, &EstimatorSettings::default()).is_err());
}
