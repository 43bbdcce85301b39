//! The reason of an undecided verdict names a remedy, and the remedy gives the verdict.
use bench_test_support::program::Bench;

struct Case {
    /// Options of a chirp whose verdict is undecided.
    options: &'static str,
    /// The reason and its remedy.
    why: [&'static str; 2],
    /// Options that follow the remedy.
    remedied: &'static str,
    verdict: &'static str,
}

const CHIRP: &str = "chirp --set loop.rate_hz=1000 --start 5";

const CASES: [Case; 6] = [
    Case {
        options: "--stop 60 --amplitude 100mA --duration 7 --operating-point 8% --asymmetry 10%",
        why: ["the excitation ends at 60 Hz", "extend it to more than"],
        remedied: "--stop 200 --amplitude 100mA --duration 7 --operating-point 8% --asymmetry 10%",
        verdict: "detected",
    },
    Case {
        options: "--stop 200 --amplitude 100mA --duration 7 --operating-point 1% --asymmetry -1%",
        why: [
            "of the 3 modes that the model has",
            "increase the amplitude there, or the duration",
        ],
        remedied: "--stop 200 --amplitude 100mA --duration 60 --operating-point 1% --asymmetry -1%",
        verdict: "excluded",
    },
    Case {
        options: "--stop 200 --amplitude 1mA --duration 7 --operating-point 8% --asymmetry -3% --seed 1",
        why: [
            "may lie on either side of the imaginary axis",
            "increase the amplitude there, or the duration",
        ],
        remedied: "--stop 200 --amplitude 100mA --duration 7 --operating-point 8% --asymmetry -3% --seed 1",
        verdict: "excluded",
    },
    Case {
        options: "--stop 200 --amplitude 3mA --duration 7 --operating-point 8% --asymmetry 1.5% --seed 2",
        why: [
            "the sign of the residue at 85.",
            "increase the amplitude there, or the duration",
        ],
        remedied: "--stop 200 --amplitude 100mA --duration 7 --operating-point 8% --asymmetry 1.5% --seed 2",
        verdict: "detected",
    },
    Case {
        options: "--stop 200 --amplitude 100mA --duration 7 --operating-point 0%",
        why: [
            "fewer than two modes are found",
            "measure at another operating point",
        ],
        remedied: "--stop 200 --amplitude 100mA --duration 7 --operating-point 8%",
        verdict: "detected",
    },
    Case {
        options: "--stop 200 --amplitude 1mA --duration 7 --operating-point 8% --asymmetry 10% --set sim.probe_noise_rms_m=2e-6",
        why: [
            "no mode exceeds the noise between 5.000 and 200.000 Hz",
            "increase the amplitude",
        ],
        remedied: "--stop 200 --amplitude 100mA --duration 60 --operating-point 8% --asymmetry 10% --set sim.probe_noise_rms_m=2e-6",
        verdict: "detected",
    },
];

#[test]
fn remedy_of_an_undecided_chirp_gives_the_verdict() {
    let bench = Bench::new();
    for case in CASES {
        let answer = bench.json(&format!("{CHIRP} {}", case.options));
        assert_eq!(answer["cnmp"], "undecided", "{}: {answer}", case.options);
        let why = answer["why"].as_str().expect("a reason");
        for part in case.why {
            assert!(
                why.contains(part),
                "{}: `{part}` is not in {why}",
                case.options
            );
        }
        let answer = bench.json(&format!("{CHIRP} {}", case.remedied));
        assert_eq!(
            answer["cnmp"], case.verdict,
            "{}: {}",
            case.remedied, answer["why"]
        );
    }
}
