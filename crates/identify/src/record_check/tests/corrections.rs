//! Spikes and steps are corrected to the noise, and nothing else is changed.

use super::{RATE_HZ, rounded, signals};
use crate::Signals;
use crate::record_check::{Corrected, Correction, Ends, check};

/// The noise of the record is 1e-3. The value that a prediction gives for a sample deviates by the errors of both; of four samples those
/// in the middle, and the sum over the errors that determine a step, have up to three times that: 5 standard deviations.
const LARGEST_DEVIATION: f64 = 5.0 * 3.0 * 1.4e-3;

fn spoiled(change: impl Fn(usize, f64) -> f64) -> Signals {
    let mut signals = signals();
    let output = signals.output.iter().enumerate();
    signals.output = output.map(|(k, y)| change(k, *y)).collect();
    signals
}

/// The largest deviation of the corrected output from the sound one.
fn largest_deviation(corrected: &Corrected) -> f64 {
    let sound = signals();
    let pairs = corrected.signals.output.iter().zip(&sound.output);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn number_of_changed_samples(corrected: &Corrected, recorded: &Signals) -> usize {
    let pairs = corrected.signals.output.iter().zip(&recorded.output);
    pairs.filter(|(a, b)| a != b).count()
}

#[test]
fn spikes_of_one_to_four_samples_are_replaced_and_no_other_sample() {
    let shape = [2.0, -0.8, 1.3, 0.6];
    for length in 1..=shape.len() {
        let spike = |k: usize| k.checked_sub(12_000).and_then(|i| shape[..length].get(i));
        let recorded = spoiled(|k, y| y + spike(k).copied().unwrap_or(0.0));
        let corrected = Corrected::of(&recorded).expect("a correction");
        let [
            Correction::Spike {
                time_s,
                height,
                samples,
            },
        ] = corrected.corrections[..]
        else {
            panic!("{:?}", corrected.corrections)
        };
        assert_eq!((time_s, samples), (12.0, length));
        assert!((height - 2.0).abs() < LARGEST_DEVIATION, "{height}");
        assert_eq!(number_of_changed_samples(&corrected, &recorded), length);
        let deviation = largest_deviation(&corrected);
        assert!(deviation < LARGEST_DEVIATION, "{length}: {deviation}");
    }
}

#[test]
fn step_is_subtracted_from_the_samples_after_it() {
    for height in [-0.5, 20.0] {
        let recorded = spoiled(|k, y| if k >= 15_000 { y + height } else { y });
        let corrected = Corrected::of(&recorded).expect("a correction");
        let [
            Correction::Step {
                time_s,
                height: found,
            },
        ] = corrected.corrections[..]
        else {
            panic!("{:?}", corrected.corrections)
        };
        assert_eq!(time_s, 15.0);
        assert!((found - height).abs() < LARGEST_DEVIATION, "{found}");
        assert_eq!(number_of_changed_samples(&corrected, &recorded), 10_000);
        assert!(largest_deviation(&corrected) < LARGEST_DEVIATION);
    }
}

/// The largest one spoils the prediction by which the others are found.
#[test]
fn spikes_and_steps_of_very_different_heights_are_corrected() {
    let recorded = spoiled(|k, y| {
        let spike = match k {
            3_000 => 0.3,
            9_000..9_003 => -60.0,
            21_000 => 1.5,
            _ => 0.0,
        };
        let after_step = if k >= 17_000 { 4.0 } else { 0.0 };
        y + spike + after_step
    });
    let corrected = Corrected::of(&recorded).expect("a correction");
    let expected = [(3.0, 0.3), (9.0, -60.0), (17.0, 4.0), (21.0, 1.5)];
    assert_eq!(corrected.corrections.len(), expected.len());
    for (correction, expected) in corrected.corrections.iter().zip(expected) {
        let (Correction::Spike { time_s, height, .. } | Correction::Step { time_s, height }) =
            *correction
        else {
            panic!("{correction:?}");
        };
        assert_eq!(time_s, expected.0);
        assert!(
            (height - expected.1).abs() < LARGEST_DEVIATION,
            "{correction:?}"
        );
    }
    assert!(largest_deviation(&corrected) < LARGEST_DEVIATION);
    let text = Correction::description(&corrected.corrections).expect("a text");
    assert!(text.contains("3 samples were replaced") && text.ends_with("1 more are corrected"));
}

/// After a knock against the table the output moves on as after any other force: neither a spike nor a step describes that.
#[test]
fn response_to_a_force_that_is_not_in_the_input_is_not_corrected() {
    let response = |k: usize| {
        let t = (k as f64 - 12_000.0) / RATE_HZ;
        if t > 0.0 {
            (-3.77 * t).exp() * (188.5 * t).sin()
        } else {
            0.0
        }
    };
    // The smallest knocks are noise; of some, one error alone is an outlier.
    let mut outliers = 0;
    for height in (0..40).map(|k| 0.02 * 1.12_f64.powi(k)) {
        let recorded = spoiled(|k, y| y + height * response(k));
        outliers += usize::from(!check(&recorded, &recorded, Ends::Rest).defects.is_empty());
        assert!(Corrected::of(&recorded).is_none(), "{height}");
    }
    assert!((20..40).contains(&outliers), "{outliers}");
}

#[test]
fn glitch_that_is_longer_than_a_spike_is_not_taken_for_one() {
    let recorded = spoiled(|k, y| {
        if (12_000..12_006).contains(&k) {
            y + 2.0
        } else {
            y
        }
    });
    assert!(Corrected::of(&recorded).is_none());
}

#[test]
fn record_with_many_spikes_is_not_corrected() {
    let with_spikes = |distance: usize| {
        let is_spike = |k: usize| k % distance == 500 && k > 2_000;
        spoiled(move |k, y| if is_spike(k) { y + 1.0 } else { y })
    };
    let few = Corrected::of(&with_spikes(1_500)).expect("a correction");
    // 3500, 5000 ... 24500.
    assert_eq!(few.corrections.len(), 15);
    assert!(Corrected::of(&with_spikes(1_000)).is_none());
}

#[test]
fn sound_records_are_not_changed() {
    assert!(Corrected::of(&signals()).is_none());
    assert!(Corrected::of(&rounded(signals())).is_none());
}
