//! Readings at irregular times.

use super::*;

fn jitter_s(output: Vec<f64>) -> Option<f64> {
    let signals = Signals {
        output,
        ..signals()
    };
    check(&signals, &signals, Ends::Rest).jitter_s
}

#[test]
fn irregular_times_are_found_with_their_standard_deviation() {
    let motion = motion(&signals().input);
    for samples in [0.01, 0.05, 0.2] {
        let found = jitter_s(read_at_irregular_times(&motion, samples));
        let found = RATE_HZ * found.unwrap_or_else(|| panic!("{samples}: no jitter"));
        // The median of eight classes, whose v^2 is known within a third: the sweep passes the resonance.
        assert!((0.85..1.2).contains(&(found / samples)), "{found}");
    }
}

#[test]
fn sound_record_has_no_irregular_times() {
    let motion = motion(&signals().input);
    for sigma in [1e-6, 1e-3, 0.1] {
        let mut noise = noise(5);
        let output = motion.iter().map(|y| y + sigma * noise());
        assert_eq!(jitter_s(output.collect()), None, "{sigma}");
    }
}

/// Its error grows with the motion as well, but from sample to sample it hardly changes.
#[test]
fn nonlinear_sensor_has_no_irregular_times() {
    let mut noise = noise(5);
    let motion = motion(&signals().input);
    let output = motion.iter().map(|y| y + 1e-3 * y * y * y + 1e-5 * noise());
    assert_eq!(jitter_s(output.collect()), None);
}

/// As of a probe whose gain fluctuates: in proportion to the output, not to its speed, and independent.
#[test]
fn noise_in_proportion_to_the_output_is_not_of_irregular_times() {
    let (mut noise, mut factor) = (noise(5), noise(9));
    let motion = motion(&signals().input);
    let output = motion
        .iter()
        .map(|y| y * (1.0 + 1e-3 * factor()) + 1e-5 * noise());
    assert_eq!(jitter_s(output.collect()), None);
}
