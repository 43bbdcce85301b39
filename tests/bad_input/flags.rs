//! Flags out of range, and numbers that are not finite.

use crate::bad_input::program::Bench;

#[test]
fn rejects_invalid_flags_with_value_and_limit() {
    let cases: &[(&str, &[&str])] = &[
        (
            "margins --set loop.rate_hz=0",
            &["`loop.rate_hz` is 0", "1 to 100000"],
        ),
        (
            "model modes --set plant.motion_stage_mass_kg=-1",
            &["is -1", "0.000001 to 1000"],
        ),
        (
            "chirp --start 5 --stop 5",
            &["--stop 5 is 5 Hz", "starts at 5 Hz"],
        ),
        (
            "chirp --start -1",
            &["--start -1 is -1 Hz", "0.0001 to 50000 Hz"],
        ),
        ("chirp --stop 3000", &["--stop 3000 is 3000 Hz", "2500 Hz"]),
        (
            "chirp --amplitude 100",
            &["100.0", "9.982 A", "the motor's peak current"],
        ),
        (
            "chirp --amplitude 9.98 --set amplifier.current_limit_a=5",
            &["9.98", "5.000 A", "the amplifier's limit"],
        ),
        ("chirp --amplitude 8", &["A/s", "20000 A/s"]),
        ("chirp --amplitude 3.5", &["thermal current", "2.338 A"]),
        ("chirp --amplitude 0.3", &["travel", "900 um"]),
        (
            "chirp --amplitude 0",
            &["--amplitude 0 is 0 A", "to 1000 A"],
        ),
        (
            "chirp --amplitude -1",
            &["--amplitude -1 is -1 A", "to 1000 A"],
        ),
        ("chirp --amplitude garbage", &["garbage", "--amplitude"]),
        (
            "chirp --sweep sideways",
            &["sideways", "linear, logarithmic"],
        ),
        (
            "chirp --duration 0",
            &["--duration 0 is 0 s", "0.001 to 100000 s"],
        ),
        ("chirp --duration -5", &["--duration -5 is -5 s"]),
        ("control --duration -5", &["--duration -5 is -5 s"]),
        ("control --amplitude garbage", &["`garbage`", "50um"]),
        ("control --reference step --amplitude 5%", &["`5%`", "50um"]),
        (
            "control --reference step --amplitude 10m",
            &["is 10", "-1 to 1"],
        ),
        (
            "control --reference sine --frequency 2500",
            &["2500 Hz", "half the servo rate"],
        ),
        (
            "control --reference ramp --speed -1e-4",
            &["--speed -1e-4 is -0.0001 m/s"],
        ),
        (
            "control --reference hold --amplitude 5um",
            &[
                "--amplitude",
                "step, ramp, sine, square, triangle, s-curve, random or chirp",
            ],
        ),
        (
            "control --reference step --frequency 5",
            &["--frequency", "sine, square, triangle or random"],
        ),
        (
            "control --reference ramp --jerk 5",
            &["--jerk", "--reference s-curve"],
        ),
        (
            "control --reference s-curve --acceleration 5mm/s",
            &["`5mm/s` is a speed", "50mm/s^2"],
        ),
        (
            "control --reference square --amplitude 1mm",
            &["--amplitude 1mm", "the soft limit of 0.0009 m"],
        ),
        (
            "control --reference random --frequency 0.01",
            &["--frequency 0.01 is 0.01 Hz", "the period of 10 s"],
        ),
        (
            "control --reference sine --reference-seed 2",
            &["--reference-seed", "--reference random"],
        ),
        (
            "control --reference chirp --no-report",
            &["--no-report", "step, hold"],
        ),
        ("control --speed 1e-5", &["--speed", "ramp"]),
        (
            "control --reference nosuch.csv",
            &["nosuch.csv", "No such file"],
        ),
        ("control --fast --slow", &["--fast", "--slow"]),
        (
            "model modes --operating-point banana",
            &["`banana`", "3.8mm"],
        ),
        (
            "model modes --operating-point 1e9",
            &["--operating-point 1e9 is 1000000000 m", "-0.5 to 0.5 m"],
        ),
        (
            "model modes --operating-point 400%",
            &["0.19 m", "0.0475 m"],
        ),
        ("model modes --asymmetry -100%", &["is -1", "-0.9 to 9"]),
        ("model modes --asymmetry 3mm", &["`3mm`", "10% or 0.1"]),
        (
            "chirp --seed 18446744073709551615",
            &["18446744073709551615", "--seed"],
        ),
        ("chirp --seed -1", &["-1"]),
        (
            "calibrate --config lab --seed 3 --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9",
            &["--seed 3 is for the simulated stage", "--simulate"],
        ),
        (
            "linearity --scales 1e300,1",
            &["--scales [1.0, 1e300]", "0.000001 to 1000000"],
        ),
        ("linearity --scales 1e-300,1", &["--scales", "0.000001"]),
        (
            "linearity --scales 1e6,1",
            &["at 1000000 of", "the motor's peak current"],
        ),
        (
            "model modes --operating-point 1e308",
            &["is 1e308 m", "-0.5 to 0.5 m"],
        ),
        // A command without random numbers has no seed.
        ("model modes --seed 1", &["unexpected argument", "--seed"]),
        ("margins --seed 1", &["unexpected argument", "--seed"]),
        (
            "model locus --vary plant.mass_asymmetry --from 1 --to 1",
            &["both 1", "two different values"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from 1% --to 2% --count 1",
            &["--count", "2..=100000"],
        ),
        (
            "model locus --vary plant.mass_asymetry --from 0 --to 0.1",
            &["mass_asymetry"],
        ),
        (
            "model locus --vary plant.damping --from 0 --to 0.1",
            &["plant.damping"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from -95% --to 0",
            &["is -0.95", "-0.9 to 9"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from banana --to 0",
            &["`banana`"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from 0 --to 1 --asymmetry 5%",
            &["--vary", "leave out --asymmetry"],
        ),
        ("model locus --from 0 --to 1", &["--vary"]),
        ("model veering --vary plant.mass_asymmetry", &["--from"]),
        (
            "model veering --operating-point 5%",
            &["`plant.operating_point_m`", "leave out --operating-point"],
        ),
        ("model veering --from 1% --to 1%", &["two different values"]),
        ("model veering --modes 3,3", &["--modes [3, 3]", "1 to 4"]),
        ("model veering --modes 3,5", &["--modes [3, 5]", "1 to 4"]),
        (
            "model veering --modes 3",
            &["--modes [3]", "two different modes"],
        ),
        (
            "model veering --config four-mass",
            &["no beams", "give a length"],
        ),
        (
            "model conditions --from 1% --to 1%",
            &["two different values"],
        ),
        (
            "model conditions --from 1% --to 2% --modes 3,4",
            &["neither veer nor cross", "0.00095", "--from or --to"],
        ),
        (
            "model conditions --from 1% --to 1.1%",
            &["no two modes veer or cross", "--from or --to"],
        ),
        (
            "model conditions --modes 3,9",
            &["--modes [3, 9]", "1 to 4"],
        ),
        (
            "model conditions --at 20%",
            &["--at 0.0095", "outside of the range"],
        ),
        ("model conditions --at banana", &["`banana`"]),
        (
            "model placement --from 1% --to 1%",
            &["two different values"],
        ),
        (
            "model placement --from 1% --to 2% --modes 3,4",
            &["neither veer nor cross"],
        ),
        (
            "model placement --sensor x9",
            &["--sensor x9", "no such place", "x1 x2", "did you mean x"],
        ),
        (
            "model placement --actuator x1=0,y2=0",
            &["--actuator", "all weights are 0", "other than 0"],
        ),
        (
            "model placement --sensor x1=banana",
            &["x1=banana", "the weight is not a number"],
        ),
        (
            "model placement --sensor x1=inf",
            &["x1=inf", "the weight is not a number"],
        ),
        (
            "model bounds --alpha 1",
            &["--alpha is 1", "between 0 and 1"],
        ),
        ("model bounds --alpha nan", &["`nan`", "--alpha"]),
        ("model bounds --peak 1", &["--peak is 1", "above 1"]),
        (
            "model bounds --bandwidth 0",
            &["--bandwidth is 0", "above 0"],
        ),
        ("model step --duration 0", &["--duration is 0", "above 0"]),
        ("model step --count 1", &["--count", "2..=1000000"]),
        (
            "model critical-damping --ratio 1.2",
            &["--ratio 1.2", "(omega_v/omega_u)^2"],
        ),
        (
            "model critical-damping --omega-u 2",
            &["--omega-u 2", "omega_u < omega_v"],
        ),
        ("margins --config nosuch", &["nosuch", "stage, chapter2"]),
        ("margins --controller nosuch", &["nosuch", "fast, slow"]),
        (
            "chirp --pace leisurely",
            &["leisurely", "virtual, realtime"],
        ),
        ("", &["Usage"]),
        ("frobnicate", &["frobnicate"]),
        ("model", &["Usage"]),
        ("identify", &["RECORDING"]),
    ];
    for (arguments, words) in cases {
        let bench = Bench::new();
        bench.run(arguments).is_refused(words);
        assert_eq!(bench.files(), [""; 0], "bench {arguments}");
    }
}

#[test]
fn rejects_nan_and_infinity_in_every_numeric_flag() {
    let chirp =
        ["--start", "--stop", "--duration", "--amplitude"].map(|flag| format!("chirp {flag}"));
    let control = [
        "--duration",
        "--amplitude",
        "--reference sine --frequency",
        "--reference ramp --speed",
        "--reference random --frequency",
        "--reference s-curve --acceleration",
        "--reference s-curve --jerk",
    ];
    let model = ["--operating-point", "--asymmetry"].map(|flag| format!("model modes {flag}"));
    for flag in chirp
        .into_iter()
        .chain(control.map(|flag| format!("control {flag}")))
        .chain(model)
    {
        for value in ["nan", "NaN", "inf", "-inf", "1e999"] {
            let bench = Bench::new();
            let answer = bench.run(&format!("{flag} {value}"));
            let names_value = answer.err.contains(value);
            assert!(
                answer.code == 2 && names_value && bench.files().is_empty(),
                "{flag} {value}: {answer:?}"
            );
        }
    }
}
