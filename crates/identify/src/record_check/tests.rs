//! Defects of records with known ones, and none of sound records.

mod corrections;
mod jitter;

use super::ends::start;
use super::*;

const RATE_HZ: f64 = 1000.0;

/// 20 s of a mode of 30 Hz driven by a sweep, with 1 s of rest before and 4 s after, and noise of 1e-3.
fn signals() -> Signals {
    let mut noise = noise(7);
    let force = |n: usize| {
        let t = n as f64 / RATE_HZ - 1.0;
        let fade = (t / 1.0).min(20.0 - t).clamp(0.0, 1.0);
        fade * (std::f64::consts::TAU * (3.0 * t + 1.5 * t * t)).sin()
    };
    let input: Vec<f64> = (0..25_000).map(force).collect();
    let output = motion(&input).into_iter().map(|y| y + 1e-3 * noise());
    Signals {
        rate_hz: RATE_HZ,
        output: output.collect(),
        input,
    }
}

/// The motion of the mode from rest.
fn motion(input: &[f64]) -> Vec<f64> {
    let (w, zeta, step) = (std::f64::consts::TAU * 30.0, 0.02, 1.0 / RATE_HZ);
    let (mut x, mut v) = (0.0, 0.0);
    let positions = input.iter().map(|u| {
        let position = x;
        // Semi-implicit Euler: any stable recursion of second order serves.
        v += step * (w * w * (u - x) - 2.0 * zeta * w * v);
        x += step * v;
        position
    });
    positions.collect()
}

/// Numbers with a standard deviation of 1: sums of twelve uniform ones.
fn noise(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

fn found_in(signals: &Signals, ends: Ends) -> Vec<Defect> {
    check(signals, signals, ends).defects
}

fn spoiled(change: impl Fn(usize, f64) -> f64) -> Vec<Defect> {
    let mut signals = signals();
    let output = signals.output.iter().enumerate();
    signals.output = output.map(|(k, y)| change(k, *y)).collect();
    found_in(&signals, Ends::Rest)
}

/// Readings that are early or late by so many samples (standard deviation), with noise of 1e-5.
fn read_at_irregular_times(motion: &[f64], samples: f64) -> Vec<f64> {
    let (mut noise, mut jitter) = (noise(3), noise(11));
    let reading = |k: usize| {
        let change = motion[k] - motion[k.saturating_sub(1)];
        motion[k] + samples * jitter() * change + 1e-5 * noise()
    };
    (0..motion.len()).map(reading).collect()
}

#[test]
fn sound_record_has_no_defect() {
    assert_eq!(found_in(&signals(), Ends::Rest), []);
}

/// A burst of 0.3 s on the mode, with readings that are early or late by 0.05 samples (RMS): their errors are far above the noise for less
/// than half of the block in which neighbours are compared.
#[test]
fn errors_of_irregular_readings_are_no_spikes() {
    let mut input = vec![0.0; 25_000];
    for (k, force) in input[9_000..9_300].iter_mut().enumerate() {
        *force = (std::f64::consts::TAU * 30.0 * k as f64 / RATE_HZ).sin();
    }
    let motion = motion(&input);
    let mut signals = Signals {
        rate_hz: RATE_HZ,
        output: read_at_irregular_times(&motion, 0.05),
        input,
    };
    assert_eq!(found_in(&signals, Ends::Rest), []);
    // A spike of the size of the motion is found all the same.
    let largest = motion.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
    for at in [3_000, 9_200] {
        let before = signals.output[at];
        signals.output[at] += 2.0 * largest;
        let found = found_in(&signals, Ends::Rest);
        assert!(
            matches!(found[..], [Defect::Spike { .. }]),
            "{at}: {found:?}"
        );
        signals.output[at] = before;
    }
}

/// After a blow on a mode that decays within 30 samples, so that fewer samples move than are compared, whatever is left over at the end of
/// the record.
#[test]
fn spike_is_found_in_a_short_motion() {
    for samples in [25_088, 25_343] {
        let mut input = vec![0.0; samples];
        for (k, force) in input[9_000..9_008].iter_mut().enumerate() {
            *force = (std::f64::consts::PI * k as f64 / 8.0).sin();
        }
        let (w, zeta) = (std::f64::consts::TAU * 120.0, 0.05);
        let pole = nalgebra::Complex::new(-zeta, f64::sqrt(1.0 - zeta * zeta)) * w;
        let step = (pole / RATE_HZ).exp();
        let mut q = nalgebra::Complex::new(0.0, 0.0);
        let motion: Vec<f64> = input
            .iter()
            .map(|force| {
                let position = q.im;
                q = step * q + (step - 1.0) / pole * *force;
                position
            })
            .collect();
        let largest = motion.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
        let mut noise = noise(5);
        let output = motion.iter().map(|y| y + 1e-3 * largest * noise());
        let mut signals = Signals {
            rate_hz: RATE_HZ,
            output: output.collect(),
            input,
        };
        signals.output[9_028] += 0.5 * largest;
        let found = found_in(&signals, Ends::Rest);
        assert!(matches!(found[..], [Defect::Spike { .. }]), "{found:?}");
    }
}

#[test]
fn spike_is_found_with_its_time_and_height() {
    for length in [1, 3] {
        let inside = |k: usize| (12_000..12_000 + length).contains(&k);
        let found = spoiled(|k, y| if inside(k) { y + 2.0 } else { y });
        let [Defect::Spike { time_s, height }] = found[..] else {
            panic!("{found:?}")
        };
        assert!(time_s == 12.0 && (height - 2.0).abs() < 0.1, "{found:?}");
    }
}

#[test]
fn spike_is_found_in_a_record_that_rests_for_longer_than_it_is_excited() {
    let mut signals = signals();
    let at_rest = 0..25_000;
    signals.input.extend(at_rest.clone().map(|_| 0.0));
    // The noise of the rest before the excitation.
    let noise: Vec<f64> = signals.output[..900].to_vec();
    signals.output.extend(at_rest.map(|k| noise[k * 7 % 900]));
    assert_eq!(found_in(&signals, Ends::Rest), []);
    signals.output[12_000] += 3.0;
    let found = found_in(&signals, Ends::Rest);
    assert!(matches!(found[..], [Defect::Spike { .. }]), "{found:?}");
}

#[test]
fn step_is_found_with_its_time_and_height() {
    let found = spoiled(|k, y| if k >= 15_000 { y - 0.5 } else { y });
    let [Defect::Step { time_s, height }] = found[..] else {
        panic!("{found:?}")
    };
    assert!(time_s == 15.0 && (height + 0.5).abs() < 0.05, "{found:?}");
}

/// Against a stop, or by a blow, the speed changes from one sample to the next, and the output does not jump.
#[test]
fn change_of_the_speed_is_no_jump() {
    let found = spoiled(|k, y| y + 0.3 * 100_usize.saturating_sub(k.abs_diff(15_100)) as f64);
    let [Defect::Abrupt { time_s }] = found[..] else {
        panic!("{found:?}")
    };
    assert!((time_s - 15.0).abs() < 0.01, "{found:?}");
}

/// Six modes after a pulse of 1.4 ms: the prediction from eight samples has errors far above the noise of 8e-11, and none of them is a jump
/// of the output. Of a held force u, q[k + 1] = exp(p T) q[k] + (exp(p T) - 1)/p u[k], and the position is the sum of r Im q/Im p.
#[test]
fn errors_of_the_prediction_after_a_hammer_are_no_jump() {
    let rate_hz = 2000.0;
    let modes = [
        (112.570411, 0.00450988984, 2.3135469),
        (495.162182, 0.00726966196, 1.01317232),
        (517.967417, 0.012499395, 2.02018935),
        (639.473184, 0.00440629179, -0.633572654),
        (717.976105, 0.0169280812, -0.395453635),
        (843.579936, 0.00806480873, -0.668162837),
    ];
    let width_s = 1.0 / (2.5 * 284.87);
    let force = |k: usize| {
        let phase = (k as f64 / rate_hz - 1.0) / width_s;
        let inside = (0.0..1.0).contains(&phase);
        if inside {
            (std::f64::consts::PI * phase).sin().powi(2)
        } else {
            0.0
        }
    };
    let input: Vec<f64> = (0..90_000).map(force).collect();
    let mut motion = vec![0.0; input.len()];
    for (omega, zeta, residue) in modes {
        let pole = nalgebra::Complex::new(-zeta, f64::sqrt(1.0 - zeta * zeta)) * omega;
        let step = (pole / rate_hz).exp();
        let mut q = nalgebra::Complex::new(0.0, 0.0);
        for (output, force) in motion.iter_mut().zip(&input) {
            *output += residue * q.im / pole.im;
            q = step * q + (step - 1.0) / pole * *force;
        }
    }
    for seed in 0..8 {
        let mut noise = noise(seed);
        let output = motion.iter().map(|y| y + 8e-11 * noise());
        let signals = Signals {
            rate_hz,
            input: input.clone(),
            output: output.collect(),
        };
        assert_eq!(found_in(&signals, Ends::Rest), [], "{seed}");
    }
}

#[test]
fn sinusoid_of_the_whole_record_is_found_and_subtracted() {
    let sound = signals();
    assert_eq!(stray_lines(&sound), []);
    let (hz, height, phase) = (50.0123, 0.2, 0.7);
    let mut disturbed = sound.clone();
    for (n, y) in disturbed.output.iter_mut().enumerate() {
        *y += height * (std::f64::consts::TAU * hz * n as f64 / RATE_HZ + phase).cos();
    }
    let found = stray_lines(&disturbed);
    let [line] = found[..] else {
        panic!("{found:?}")
    };
    assert!((line.frequency_hz - hz).abs() < 1e-4, "{line:?}");
    assert!(
        (line.amplitude.norm() / height - 1.0).abs() < 1e-2,
        "{line:?}"
    );
    let cleaned = without(&disturbed, &found);
    let left = cleaned.output.iter().zip(&sound.output);
    let left = left.map(|(a, b)| (a - b).powi(2)).sum::<f64>() / sound.len() as f64;
    // 2 % of the line's 0.14.
    assert!(left.sqrt() < 2.8e-3, "{}", left.sqrt());
}

/// The mode at 30 Hz has a width of 1.2 Hz; in the whole record a line beside it is no peak.
#[test]
fn sinusoid_beside_a_mode_is_found_where_the_input_rests() {
    let mut signals = signals();
    let hz = 29.3;
    for (n, y) in signals.output.iter_mut().enumerate() {
        *y += 0.1 * (std::f64::consts::TAU * hz * n as f64 / RATE_HZ).cos();
    }
    let found = stray_lines(&signals);
    let [line] = found[..] else {
        panic!("{found:?}")
    };
    assert!((line.frequency_hz - hz).abs() < 1e-3, "{line:?}");
    assert!((line.amplitude.norm() - 0.1).abs() < 5e-3, "{line:?}");
    // Without the rest it is not found.
    assert_eq!(stray_lines(&signals.slice(0..20_500)), []);
}

#[test]
fn line_of_the_input_is_no_stray_line() {
    let line = |n: usize| 0.2 * (std::f64::consts::TAU * 50.0 * n as f64 / RATE_HZ).cos();
    let mut signals = signals();
    for (n, y) in signals.output.iter_mut().enumerate() {
        *y += line(n);
    }
    assert_eq!(stray_lines(&signals).len(), 1, "in the output alone");
    for (n, u) in signals.input.iter_mut().enumerate() {
        *u += line(n);
    }
    assert_eq!(stray_lines(&signals), []);
}

#[test]
fn input_that_began_before_the_record_is_active_at_its_start() {
    let whole = signals();
    assert!(input_ratio_at_start(&whole) < 0.01);
    assert!(input_ratio_at_end(&whole) < 0.01);
    let ended = input_ratio_at_end(&whole.slice(0..10_000));
    assert!((0.5..2.0).contains(&ended), "{ended}");
    let begun = input_ratio_at_start(&whole.slice(10_000..25_000));
    assert!((0.5..2.0).contains(&begun), "{begun}");
}

/// A blow of 20 samples, in a record of 20,000, with noise of 0.1 % of it.
fn blow(at: usize) -> Signals {
    let mut noise = noise(3);
    let force = |n: usize| match n.checked_sub(at) {
        Some(after) if after < 20 => (std::f64::consts::PI * after as f64 / 20.0).sin(),
        _ => 0.0,
    };
    Signals {
        rate_hz: RATE_HZ,
        input: (0..20_000).map(|n| force(n) + 1e-3 * noise()).collect(),
        output: vec![0.0; 20_000],
    }
}

#[test]
fn blow_soon_after_the_first_sample_begins_at_rest() {
    // The RMS value of the blow over the record is sqrt(10/20,000) = 0.022, that of the noise 0.001.
    for at in [20, 50, 90] {
        let ratio = input_ratio_at_start(&blow(at));
        assert!((0.02..0.09).contains(&ratio), "{at}: {ratio}");
    }
    // Without 16 samples before it, the beginning of the blow is not known.
    for at in [0, 5] {
        let ratio = input_ratio_at_start(&blow(at));
        assert!(ratio > 5.0, "{at}: {ratio}");
    }
}

#[test]
fn noise_that_goes_on_is_active_wherever_the_record_begins() {
    let mut noise = noise(5);
    // A first-order low-pass of 1/100 of the rate.
    let mut smooth = 0.0;
    let input: Vec<f64> = (0..40_000)
        .map(|_| {
            smooth += (noise() - smooth) * std::f64::consts::TAU / 100.0;
            smooth
        })
        .collect();
    for from in (0..30_000).step_by(50) {
        let record = &input[from..from + 10_000];
        assert_eq!(start(record), &record[..50], "from {from}");
    }
}

#[test]
fn repeated_samples_are_found_with_their_number() {
    let sound = signals();
    let inside = |k: usize| (9_000..9_100).contains(&k);
    let found = spoiled(|k, y| if inside(k) { sound.output[9_000] } else { y });
    assert_eq!(
        found,
        [Defect::Repeated {
            time_s: 9.0,
            samples: 100
        }]
    );
}

/// The output rounded to steps of 1/40 of its largest amplitude, more than its noise.
#[test]
fn command_in_the_place_of_the_output_is_named() {
    let mut signals = signals();
    std::mem::swap(&mut signals.input, &mut signals.output);
    let found = found_in(&signals, Ends::Rest);
    let [Defect::Constant { time_s, samples }] = found[..] else {
        panic!("{found:?}");
    };
    // The command ends after 1 + 20 s of 25 s.
    assert!((time_s - 21.0).abs() < 0.01, "{time_s}");
    assert!((3990..=4000).contains(&samples), "{samples}");
    let text = found[0].to_string();
    assert!(text.contains("exchange --input and --output"), "{text}");
}

fn rounded(signals: Signals) -> Signals {
    rounded_to(40.0, signals)
}

fn rounded_to(steps: f64, mut signals: Signals) -> Signals {
    let largest = signals.output.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
    let step = largest / steps;
    for y in &mut signals.output {
        *y = step * (*y / step).round();
    }
    signals
}

#[test]
fn rounded_output_at_rest_and_at_its_peaks_has_no_defect() {
    let signals = rounded(signals());
    assert_eq!(found_in(&signals, Ends::Rest), []);
    assert_eq!(found_in(&signals, Ends::Periods), []);
}

#[test]
fn stuck_probe_with_a_coarse_step_is_found() {
    let mut signals = rounded(signals());
    // The sweep passes 30 Hz at 10 s. From one zero crossing to the next, 17 samples later, 17 samples are the same.
    let is_crossing = |k: &usize| signals.output[*k - 1] < 0.0 && signals.output[*k] >= 0.0;
    let start = (10_000..10_040).find(is_crossing).expect("a crossing");
    let value = signals.output[start];
    signals.output[start..start + 17].fill(value);
    let found = found_in(&signals, Ends::Periods);
    let [Defect::Repeated { time_s, samples }] = found[..] else {
        panic!("{found:?}")
    };
    assert!((time_s * RATE_HZ - start as f64).abs() < 2.0, "{found:?}");
    assert!((17..20).contains(&samples), "{found:?}");
}

#[test]
fn probe_with_a_coarse_step_that_fails_for_good_is_found() {
    let mut signals = rounded(signals());
    let value = signals.output[10_000];
    signals.output[10_000..].fill(value);
    let found = found_in(&signals, Ends::Periods);
    let [Defect::Repeated { time_s, .. }] = found[..] else {
        panic!("{found:?}")
    };
    assert!((time_s - 10.0).abs() < 0.005, "{found:?}");
}

/// Each value of the output until the next one `period` samples later; the phase slips by a sample at some of the given samples.
fn slow_probe(signals: &Signals, period: f64, slips: &[usize]) -> Signals {
    let (mut next, mut value) = (0.3 * period, signals.output[0]);
    let mut held = signals.clone();
    for (k, y) in held.output.iter_mut().enumerate() {
        if k as f64 >= next {
            (next, value) = (next + period, *y);
        }
        if slips.contains(&k) {
            next += 1.0;
        }
        *y = value;
    }
    held
}

#[test]
fn probe_slower_than_the_log_is_found_with_its_rate() {
    let slips = [3_001, 8_000, 12_345, 15_002, 20_000];
    for period in [1.28, 4.0, 4.096, 12.5] {
        for signals in [signals(), rounded_to(500.0, signals())] {
            let found = found_in(&slow_probe(&signals, period, &slips), Ends::Rest);
            let [Defect::Held { samples, probe_hz }] = found[..] else {
                panic!("{period}: {found:?}")
            };
            // A window of 32 values determines the period to 1 sample in 32 values; the mean of some windows is better.
            assert!((samples / period - 1.0).abs() < 0.01, "{found:?}");
            assert!((probe_hz * period / RATE_HZ - 1.0).abs() < 0.01);
        }
    }
}

/// In slow motion neighbouring values of the probe are equal: half of all windows have one such pair or more.
#[test]
fn coarse_values_of_a_slow_probe_are_found_by_their_phase() {
    for samples in [2, 3, 7] {
        let mut signals = rounded_to(20.0, signals());
        let values = signals.output.clone();
        signals.output = (0..values.len())
            .map(|k| values[k / samples * samples])
            .collect();
        let found = found_in(&signals, Ends::Rest);
        assert!(
            matches!(found[..], [Defect::Held { samples: held, .. }] if held == samples as f64),
            "{samples}: {found:?}"
        );
    }
}

#[test]
fn ramp_of_an_encoder_is_no_slow_probe() {
    let mut signals = signals();
    // 1 step in 4 samples, up and down.
    let ramp = |k: usize| (k % 8_000).min(8_000 - k % 8_000) / 4;
    signals.output = (0..25_000).map(|k| ramp(k) as f64).collect();
    let found = found_in(&signals, Ends::Periods);
    assert!(
        !found.iter().any(|d| matches!(d, Defect::Held { .. })),
        "{found:?}"
    );
}

#[test]
fn text_of_a_slow_probe_states_samples_and_rate() {
    let text = |samples: f64| {
        let probe_hz = 500.0 / samples;
        Defect::Held { samples, probe_hz }.to_string()
    };
    assert!(text(4.0).starts_with(
        "the output changes only at every 4th sample: the probe has 125.0 values per second"
    ));
    assert!(text(22.0).starts_with("the output changes only at every 22nd sample"));
    assert!(text(12.0).starts_with("the output changes only at every 12th sample"));
    assert!(text(4.096).starts_with("the output changes only after 4.10 samples on average"));
}

#[test]
fn spike_below_one_step_is_no_defect_and_one_of_many_steps_is() {
    let sound = rounded(signals());
    let levels = Resolution::of(&sound).output.expect("a resolution");
    let with_spike = |steps: f64| {
        let mut signals = sound.clone();
        signals.output[23_000] += steps * levels;
        found_in(&signals, Ends::Rest)
    };
    assert_eq!(with_spike(1.0), []);
    let found = with_spike(40.0);
    assert!(
        matches!(found[..], [Defect::Spike { time_s: 23.0, .. }]),
        "{found:?}"
    );
}

#[test]
fn clipped_output_is_found_with_its_limit() {
    let found = spoiled(|_, y| y.clamp(-3.0, 3.0));
    assert!(
        matches!(found[..], [Defect::Clipped { value, .. }] if value == 3.0),
        "{found:?}"
    );
}

/// Four samples in each oscillation: at most two of them, one after the other, are at the limit.
#[test]
fn clipped_output_is_found_with_few_samples_in_each_oscillation() {
    let mut signals = signals();
    let oscillation = |k: usize, limit: f64| {
        let t = k as f64 / RATE_HZ;
        let decaying = (-((t - 12.0) / 3.0).powi(2)).exp();
        let y = decaying * (std::f64::consts::TAU * 0.2503 * k as f64).sin();
        y.clamp(-limit, limit)
    };
    for (limit, is_clipped) in [(0.5, true), (2.0, false)] {
        signals.output = (0..25_000).map(|k| oscillation(k, limit)).collect();
        let found = found_in(&signals, Ends::Rest);
        let value = |defect: &Defect| match defect {
            Defect::Clipped { value, .. } => Some(*value),
            _ => None,
        };
        let values: Vec<f64> = found.iter().filter_map(value).collect();
        assert_eq!(
            values,
            if is_clipped { vec![limit] } else { vec![] },
            "{found:?}"
        );
    }
}

/// The peaks of a steady oscillation may have two equal samples each.
#[test]
fn repeating_peaks_of_a_steady_oscillation_are_no_clipping() {
    let mut signals = signals();
    let period = [0.2, 0.6, 0.9, 1.0, 1.0, 0.9, 0.6, 0.2];
    let sample = |k: usize| period[k % 8] * if k % 16 < 8 { 1.0 } else { -1.0 };
    signals.output = (0..25_000).map(sample).collect();
    assert!(limits(&signals.output).is_empty());
}

#[test]
fn record_that_begins_or_ends_in_motion_is_found() {
    let whole = signals();
    let cases = [(10_000..25_000, true), (0..10_000, false)];
    for (range, at_start) in cases {
        let found = found_in(&whole.slice(range), Ends::Rest);
        let expected = |defect: &Defect| match defect {
            Defect::MovingAtStart { .. } => at_start,
            Defect::MovingAtEnd { .. } => !at_start,
            _ => false,
        };
        assert!(found.len() == 1 && found.iter().all(expected), "{found:?}");
    }
}

#[test]
fn impulse_of_the_input_is_no_defect() {
    let mut signals = signals();
    signals.input.fill(0.0);
    signals.input[1000] = 1.0;
    let response = |k: usize| {
        let t = (k as f64 - 1000.0) / RATE_HZ;
        if t > 0.0 {
            (-4.0 * t).exp() * (188.0 * t).sin()
        } else {
            0.0
        }
    };
    signals.output = (0..25_000).map(response).collect();
    assert_eq!(found_in(&signals, Ends::Rest), []);
}

/// A sine of 30 Hz at 1 kHz with steps of a fortieth of its amplitude stays at its largest value for 3 or 4 samples a period.
#[test]
fn flat_peaks_of_a_coarse_quantisation_are_no_clipping() {
    let mut signals = signals();
    let sine = |k: usize| (std::f64::consts::TAU * 30.003 * k as f64 / RATE_HZ).sin();
    signals.output = (0..25_000)
        .map(|k| (40.0 * sine(k)).round() / 40.0)
        .collect();
    let found = found_in(&signals, Ends::Periods);
    assert!(
        !found.iter().any(|d| matches!(d, Defect::Clipped { .. })),
        "{found:?}"
    );
}
