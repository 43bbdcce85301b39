//! Records with a closed form: modes with a held input, of which the output is sampled at any times.

use nalgebra::Complex;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::ClockSkew;
use crate::external_signals::ExternalSignals;
use crate::verdict::Cnmp;
use crate::{Estimate, ExternalAnalysis, Identification, Signals};

const RATE_HZ: f64 = 500.0;
/// Rest of 0.5 s, a logarithmic sweep from 2 to 90 Hz in 10 s, and rest until the plant has settled.
const SAMPLES: usize = 7000;
/// Frequency in hertz, damping ratio and residue.
type Mode = (f64, f64, f64);
/// Modes with zeros left of the axis.
const MODES: [Mode; 2] = [(12.0, 0.02, 1.0), (38.0, 0.01, 0.6)];
/// Standard deviation of the noise of the output.
const NOISE: f64 = 1e-6;

fn input() -> Vec<f64> {
    let rate = 45.0_f64.ln() / 10.0;
    let sweep = |k: usize| {
        let time_s = k as f64 / RATE_HZ - 0.5;
        let inside = (0.0..10.0).contains(&time_s);
        let fade = (time_s.min(10.0 - time_s) / 0.3).clamp(0.0, 1.0);
        let phase = std::f64::consts::TAU * 2.0 / rate * ((rate * time_s).exp() - 1.0);
        if inside { fade * phase.sin() } else { 0.0 }
    };
    (0..SAMPLES).map(sweep).collect()
}

/// The output at rising times in seconds. With the pole p and a held force u, q(t) = exp(p (t - t_n)) q_n + (exp(p (t - t_n)) - 1)/p u_n,
/// and the position of a mode is r Im q/Im p.
fn output(input: &[f64], times_s: &[f64], modes: &[Mode], seed: u64) -> Vec<f64> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut outputs: Vec<f64> = times_s
        .iter()
        .map(|_| NOISE * normal(&mut random))
        .collect();
    for &(frequency_hz, damping_ratio, residue) in modes {
        let omega = std::f64::consts::TAU * frequency_hz;
        let pole = Complex::new(-damping_ratio, (1.0 - damping_ratio.powi(2)).sqrt()) * omega;
        let after = |state: Complex<f64>, force: f64, time_s: f64| {
            let factor = (pole * time_s).exp();
            factor * state + (factor - 1.0) / pole * force
        };
        let (mut state, mut sample) = (Complex::new(0.0, 0.0), 0);
        for (output, time_s) in outputs.iter_mut().zip(times_s) {
            while sample + 1 < input.len() && (sample + 1) as f64 / RATE_HZ <= *time_s {
                state = after(state, input[sample], 1.0 / RATE_HZ);
                sample += 1;
            }
            let since_s = time_s - sample as f64 / RATE_HZ;
            *output += residue * after(state, input[sample], since_s).im / pole.im;
        }
    }
    outputs
}

fn normal(random: &mut Pcg64Mcg) -> f64 {
    let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
    (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
}

/// The analysis of a record whose output was sampled at these times.
fn analysis(time_s: impl Fn(f64) -> f64, seed: u64) -> ExternalAnalysis {
    analysis_of(&MODES, time_s, seed)
}

/// The same of a plant with these modes.
fn analysis_of(modes: &[Mode], time_s: impl Fn(f64) -> f64, seed: u64) -> ExternalAnalysis {
    let input = input();
    let times_s: Vec<f64> = (0..SAMPLES).map(|k| time_s(k as f64 / RATE_HZ)).collect();
    let output = output(&input, &times_s, modes, seed);
    let identification = Identification::new(RATE_HZ).held_s(1.0 / RATE_HZ);
    identification.run(&input, &output).expect("a response")
}

#[test]
fn finds_the_difference_of_the_clocks_and_the_modes() {
    for (seed, ratio) in [(1, 1e-3), (2, -3e-4), (3, 5e-5)] {
        let found = analysis(|time_s| time_s * (1.0 + ratio), seed);
        let skew = found.clock_skew.expect("two clocks");
        // Noise of 1 um beside a motion of some 100 um over 10 s at 90 Hz: an angle of 5600 rad per ratio, known to about 0.01 rad.
        assert!(skew.ratio.sigma < 3e-6, "{skew:?}");
        let error = (skew.ratio.value - ratio).abs();
        assert!(error < 5.0 * skew.ratio.sigma, "{ratio}: {skew:?}");
        assert!(
            found.verdict.why.contains("two clocks"),
            "{}",
            found.verdict.why
        );
        assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
        let modes = found.fit.expect("modes").modes();
        assert_eq!(modes.len(), MODES.len(), "{ratio}");
        for (mode, (frequency_hz, _, residue)) in modes.iter().zip(MODES) {
            let frequency = mode.frequency_hz();
            assert!((frequency.value - frequency_hz).abs() < 5.0 * frequency.sigma);
            assert!(frequency.sigma < 1e-3, "{frequency:?}");
            let found = mode.residue_per_kg;
            assert!(
                (found.value - residue).abs() < 5.0 * found.sigma,
                "{found:?}"
            );
            assert!(found.sigma < 2e-3 * residue, "{found:?}");
        }
    }
}

/// The lowest frequencies, of which a scan has few steps, show one mode alone: any ratio describes it.
#[test]
fn finds_a_large_difference_with_close_modes_above_a_single_one() {
    let modes = [(18.0, 0.018, 4.7), (61.8, 0.0068, 3.2), (62.9, 0.0035, 1.2)];
    for (seed, ratio) in [(6, -9.73e-4), (7, 1.5e-4)] {
        let found = analysis_of(&modes, |time_s| time_s * (1.0 + ratio), seed);
        let skew = found.clock_skew.expect("two clocks");
        let error = (skew.ratio.value - ratio).abs();
        assert!(error < 5.0 * skew.ratio.sigma, "{ratio}: {skew:?}");
        assert!(skew.ratio.sigma < 3e-6, "{skew:?}");
        assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
        assert_eq!(found.fit.expect("modes").modes().len(), modes.len());
    }
}

#[test]
fn one_clock_has_no_difference() {
    let found = analysis(|time_s| time_s, 4);
    assert_eq!(found.clock_skew, None);
    assert_eq!(found.verdict.cnmp, Cnmp::Excluded, "{}", found.verdict.why);
}

/// A record with one clock gives the modes. Other records of the same plant are corrected for a difference of 1e-4, which they have or
/// not.
#[test]
fn modes_confirm_a_true_difference_only() {
    let known = analysis(|time_s| time_s, 4);
    let fit = known.fit.expect("modes");
    let skew = ClockSkew {
        ratio: Estimate {
            value: 1e-4,
            sigma: 1e-6,
        },
        duration_s: SAMPLES as f64 / RATE_HZ,
    };
    let is_confirmed = |true_ratio: f64| {
        let times = (0..SAMPLES).map(|k| k as f64 / RATE_HZ * (1.0 + true_ratio));
        let times_s: Vec<f64> = times.collect();
        let input = input();
        let signals = Signals {
            rate_hz: RATE_HZ,
            output: output(&input, &times_s, &MODES, 8),
            input,
        };
        let corrected = skew.corrected(&signals);
        let record = ExternalSignals::new(&corrected, None, None);
        let frf = record.response((2.0, 90.0)).expect("a response");
        skew.is_confirmed(&fit, record, &frf.data, &known.chain)
    };
    assert!(is_confirmed(1e-4));
    assert!(!is_confirmed(0.0));
}

#[test]
fn lost_samples_are_no_difference_of_clocks() {
    // Two samples of the output are missing in the middle of the sweep: the later ones come 4 ms early.
    let found = analysis(
        |time_s| if time_s < 6.0 { time_s } else { time_s + 4e-3 },
        5,
    );
    assert_eq!(found.clock_skew, None, "{}", found.verdict.why);
}

/// The output of a fast clock ends before the input: there is nothing to be resampled after its last reading.
#[test]
fn a_corrected_record_ends_with_the_last_reading() {
    // Of 60 000 samples that are 1e-3 too early, the last one was read 60 samples before that of the input.
    let mut input = input();
    input.resize(60_000, 0.0);
    let skew = ClockSkew {
        ratio: Estimate {
            value: -1e-3,
            sigma: 1e-6,
        },
        duration_s: input.len() as f64 / RATE_HZ,
    };
    let times = (0..input.len()).map(|k| k as f64 / RATE_HZ * (1.0 - 1e-3));
    let times_s: Vec<f64> = times.collect();
    let signals = Signals {
        rate_hz: RATE_HZ,
        output: output(&input, &times_s, &MODES, 9),
        input,
    };
    let corrected = skew.corrected(&signals);
    let record = ExternalSignals::new(&corrected, None, None);
    assert_eq!(record.checked(&record).defects, []);
    assert_eq!(corrected.output.len(), 59_940);
    assert_eq!(corrected.input[..], signals.input[..59_940]);
}
