//! Commands that are refused before any motion.

use std::f64::consts::TAU;

use crate::command::program::Bench;

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

/// A controller that hardly reacts: alone it asks for less than 1 uA, so that only the feedforward moves the stage.
const WEAK: &str = "title = \"weak\"\n\n[[section]]\nkind = \"gain\"\ngain_a_per_um = 1e-9\n";
const FEEDFORWARD: &str = "--feedforward --set control.feedforward.bandwidth_hz=60.0";

/// The refusal of a reference with feedforward, which is accepted without it.
fn refused_with_feedforward_only(bench: &Bench, reference: &str) -> String {
    let control = format!("control --controller weak.toml {reference} --out runs");
    let without = bench.run(&format!("{control} --plan"));
    assert_eq!(without.code, 0, "{reference}: {}", without.err);
    let answer = bench.run(&format!("{control} {FEEDFORWARD}"));
    assert_eq!(answer.code, 2, "{reference}: {}", answer.out);
    assert!(!bench.path("runs").exists(), "{reference}: a run began");
    answer.err
}

#[test]
fn feedforward_alone_beyond_current_or_travel_is_refused_before_motion() {
    let bench = Bench::new();
    bench.write("weak.toml", WEAK);
    for (reference, limit) in [
        // 2.12 kg x (314 rad/s)^2 x 800 um less 72 N/mm x 800 um are 110 N or 9.9 A by the rigid body alone.
        (
            "--reference sine --frequency 50Hz --amplitude 800um",
            "the motor's peak current of 9.98",
        ),
        // F overshoots a step by some 9 %: 937 um, beyond the soft limit of 900 um.
        (
            "--reference step --amplitude 860um --duration 0.5",
            "the soft limit of 900 um",
        ),
    ] {
        let message = refused_with_feedforward_only(&bench, reference);
        assert!(message.contains(limit), "{reference}: {message}");
        assert!(
            message.contains("control.feedforward.bandwidth_hz"),
            "{reference}: {message}"
        );
    }
}

#[test]
fn file_beyond_the_limits_is_refused_before_motion() {
    let bench = Bench::new();
    bench.write("weak.toml", WEAK);
    // Within the soft limit of 900 um, but 50 Hz: the current of the sine in the test above, times 850/800.
    let points: Vec<String> = (0..400)
        .map(|k| {
            let time_s = f64::from(k) * 1e-3;
            format!("{time_s},{}", 850e-6 * (TAU * 50.0 * time_s).sin())
        })
        .collect();
    bench.write(
        "fast.csv",
        format!("time_s,reference_m\n{}\n", points.join("\n")),
    );
    let message = refused_with_feedforward_only(&bench, "--reference fast.csv");
    assert!(message.contains("peak current"), "{message}");
    bench.write("far.csv", "time_s,reference_m\n0,0\n1,950e-6\n");
    for options in ["", FEEDFORWARD] {
        let control = format!("control --controller weak.toml --reference far.csv {options}");
        let answer = bench.run(&format!("{control} --out runs"));
        assert_eq!(answer.code, 2, "{options}: {}", answer.out);
        assert!(answer.err.contains("soft_limit"), "{}", answer.err);
        assert!(!bench.path("runs").exists(), "{options}: a run began");
    }
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
        // Stable by the model, but not with modes that are 20 % lower or higher.
        (
            "--fast --shaper minimum-time --set control.shaper.frequency_tolerance_ratio=0.2",
            "narrower range of plants",
        ),
        (
            "--config three-mass --shaper minimum-time --set control.shaper.operating_points_m=[0.0]",
            "this model has none; leave it out",
        ),
        (
            "--shaper minimum-time --set control.shaper.block_s=0.0002 --set control.shaper.longest_s=0.2",
            "1000 blocks of control.shaper.block_s, above the limit of 400",
        ),
    ] {
        let message = refused(arguments);
        assert!(message.contains(remedy), "{arguments}: {message}");
    }
}

#[test]
fn shaper_without_a_vibration_to_shape_is_refused() {
    let bench = Bench::new();
    bench.write("weak.toml", WEAK);
    let answer = bench.run("control --controller weak.toml --shaper zv --out runs");
    assert_eq!(answer.code, 2, "{}", answer.out);
    assert!(
        answer
            .err
            .contains("no vibration to shape; leave the shaper out"),
        "{}",
        answer.err
    );
    assert!(!bench.path("runs").exists(), "a run began");
}
