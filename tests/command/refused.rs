//! Commands that are refused before any motion.

use crate::program::Bench;

/// Runs a command that is refused, and returns its message.
fn refused(arguments: &str) -> String {
    let bench = Bench::new();
    let answer = bench.run(&format!("control {arguments} --out runs"));
    assert_ne!(answer.code, 0, "{arguments}");
    assert!(!bench.path("runs").exists(), "{arguments}: a run began");
    answer.err
}

#[test]
fn feedforward_beyond_the_motor_is_refused_before_motion() {
    let sine = "--fast --reference sine --frequency 50Hz --amplitude 500um";
    let message = refused(&format!(
        "{sine} --feedforward --set control.feedforward.bandwidth_hz=60.0"
    ));
    assert!(
        message.contains("control.feedforward.bandwidth_hz"),
        "{message}"
    );
    assert!(message.contains("current"), "{message}");
}

#[test]
fn combinations_without_meaning_are_refused_with_a_remedy() {
    for (arguments, remedy) in [
        (
            "--shaper minimum-time --reference sine",
            "choose zv, zvd or ei",
        ),
        (
            "--shaper minimum-time --feedforward",
            "leave out control.feedforward",
        ),
        (
            "--shaper minimum-time --prefilter 10Hz",
            "leave out control.prefilter",
        ),
        ("--shaper zv --max-overshoot 5%", "--shaper minimum-time"),
        ("--max-overshoot 5%", "--shaper minimum-time"),
        (
            "--shaper minimum-time --set control.shaper.operating_points_m=[0.1]",
            "beyond the length of the beams",
        ),
        (
            "--feedforward --reference chirp",
            "choose another reference",
        ),
        (
            "--feedforward --set control.feedforward.bandwidth_hz=2000.0",
            "lower it",
        ),
        (
            "--feedforward --set control.feedforward.bandwidth_hz=0.1",
            "raise the frequencies",
        ),
        ("--prefilter 3kHz", "lower it"),
        (
            "--shaper minimum-time --amplitude 5um",
            "choose a larger step",
        ),
        (
            "--shaper minimum-time --set control.shaper.longest_s=0.003",
            "longest_s",
        ),
        ("--fast --asymmetry -10% --shaper zv", "unstable"),
    ] {
        let message = refused(arguments);
        assert!(message.contains(remedy), "{arguments}: {message}");
    }
}
