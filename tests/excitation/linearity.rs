//! Noise and geometric nonlinearity are distinguished by the omitted lines of a multisine and by several amplitudes.
use bench_experiment::Analysis;
use bench_identify::linearity::Cause;
use bench_identify::modal::FittedMode;
use serde_json::Value;

use crate::excitation::program::{Bench, number};
use crate::excitation::rig::{analysed, of_kind};

/// Odd lines from 5 to 200 Hz, with a line spacing of 1/8 Hz, one of four omitted; 8 periods are compared.
const OMITTED_LINES: [&str; 5] = [
    "multisine.lines=odd_random",
    "multisine.period_s=8.0",
    "multisine.periods=9",
    "chirp.start_hz=5.0",
    "chirp.stop_hz=200.0",
];
/// An amplitude curve like that of `--shape model`: low at the resonance, so that the displacements of all lines are of the same order.
const SHAPED: &str = "chirp.amplitude=[{ frequency_hz = 10.0, current_a = 0.6 }, { frequency_hz = 29.3, current_a = 0.06 }, { frequency_hz = 50.0, current_a = 1.2 }, { frequency_hz = 200.0, current_a = 2.4 }]";
/// At 8 % of the beam length, where the constraints have the largest slope of the range.
const OPERATING: &str = "plant.operating_point_m=0.0038";

fn analysis_with(more: &[&str]) -> Analysis {
    analysed(&of_kind(
        ("multisine", &OMITTED_LINES),
        &[&[SHAPED, OPERATING], more].concat(),
    ))
}

#[test]
fn linear_stage_has_no_distortion_and_incoherence_is_noise() {
    for (seed, noise, cause) in [
        ("1", "40e-9", Cause::None),
        ("2", "40e-9", Cause::None),
        ("3", "5e-6", Cause::Noise),
    ] {
        let (seed, noise) = (
            format!("sim.seed={seed}"),
            format!("sim.probe_noise_rms_m={noise}"),
        );
        let linearity = analysis_with(&[&seed, &noise])
            .linearity
            .expect("lines were omitted");
        let whole = &linearity.whole;
        assert_eq!(whole.cause, cause, "{}", linearity.why);
        assert!(
            !whole.is_odd_detected() && !whole.is_even_detected(),
            "{seed}: {whole:?}"
        );
        assert_eq!(whole.missing_by_distortion, 0.0);
        for ratio in [whole.odd_distortion_ratio, whole.even_distortion_ratio] {
            let ratio = ratio.expect("omitted lines");
            // The true ratio is 0. The standard deviation of its estimate is the noise of the mean of 8 periods divided by the root of
            // the number of lines. At least ten lines, at the 8 Hz of the floor and at mode R, have most of the noise: 1/8 x 1/3 of
            // the noise ratio. The bound is three times that.
            assert!(
                ratio.abs() < whole.noise_ratio / 8.0,
                "{seed}: {ratio} {}",
                whole.noise_ratio
            );
        }
    }
}

#[test]
fn quadratic_geometry_causes_even_and_odd_distortion() {
    let analysis = analysis_with(&["sim.geometry=quadratic"]);
    let linearity = analysis.linearity.as_ref().expect("lines were omitted");
    let whole = &linearity.whole;
    assert!(
        whole.is_even_detected() && whole.is_odd_detected(),
        "{whole:?}"
    );
    // x_i - x_j contains the square of y_i - y_j, so that even distortion is the larger one.
    assert!(
        whole.missing_by_even > whole.missing_by_odd && whole.missing_by_odd > 0.0,
        "{whole:?}"
    );
    assert_eq!(whole.cause, Cause::Nonlinearity, "{}", linearity.why);
    // The stage does not reach its stops at 1 mm: geometry is the only nonlinearity.
    assert!(
        linearity
            .bands
            .iter()
            .any(|band| band.cause == Cause::Nonlinearity && band.low_hz > 20.0)
    );
}

#[test]
fn odd_distortion_adds_no_significant_modes() {
    // `bench model modes`: R, u, v at 29.274, 82.228 and 85.784 Hz, residues 0.47, -0.032 and 0.021 1/kg.
    let model_hz = [29.274, 82.228, 85.784];
    for geometry in ["sim.geometry=quadratic", "sim.geometry=linear"] {
        let modes = analysis_with(&[geometry]).fit.expect("modes").modes();
        let is = |hz: f64, model_hz: f64| (hz / model_hz - 1.0).abs() < 1e-3;
        let hz = |mode: &FittedMode| mode.frequency_hz().value;
        for model_hz in model_hz {
            assert_eq!(
                modes.iter().filter(|mode| is(hz(mode), model_hz)).count(),
                1,
                "{geometry}: {model_hz} Hz: {modes:?}"
            );
        }
        let below = modes.iter().filter(|mode| hz(mode) < 120.0);
        let others: Vec<_> = below
            .filter(|mode| !model_hz.iter().any(|model_hz| is(hz(mode), *model_hz)))
            .collect();
        // If four neighbouring lines underestimate the distortion by chance, one spurious mode may be found; its residue is at most 1 % of v's.
        assert!(others.len() <= 1, "{geometry}: {others:?}");
        assert!(
            others
                .iter()
                .all(|mode| mode.residue_per_kg.value.abs() < 2e-4),
            "{geometry}: {others:?}"
        );
    }
}

#[test]
fn full_multisine_and_chirp_give_no_linearity_result() {
    assert!(analysis_with(&["multisine.lines=full"]).linearity.is_none());
    assert!(
        analysis_with(&[
            "excitation.kind=chirp",
            "chirp.duration_s=20.0",
            "chirp.fade_in_s=1.0"
        ])
        .linearity
        .is_none()
    );
    let odd = analysis_with(&["multisine.lines=odd"])
        .linearity
        .expect("even lines were omitted");
    assert!(odd.whole.odd_by_noise_alone.is_none() && odd.whole.even_by_noise_alone.is_some());
}

const HERE: &str = "--set loop.rate_hz=1000 --start 5 --stop 200 --set multisine.period_s=8 --set multisine.periods=9 --operating-point 8%";

/// The result of `bench linearity` in an empty folder, and the folder.
fn modes_over_amplitude(options: &str) -> (Value, Bench) {
    let bench = Bench::new();
    (bench.json(&format!("linearity {HERE} {options}")), bench)
}

#[test]
fn modes_of_a_linear_stage_do_not_shift_with_amplitude() {
    let (answer, bench) = modes_over_amplitude("--shape model --scales 1,0.5,2");
    assert_eq!(answer["scales"], serde_json::json!([0.5, 1.0, 2.0]));
    assert_eq!(answer["shifted"], false, "{}", answer["why"]);
    let modes = answer["modes"].as_array().expect("modes");
    assert!(modes.len() >= 3, "{modes:?}");
    for run in 0..3 {
        let result = &answer["runs"][run];
        assert_ne!(
            result["linearity"]["cause"], "nonlinearity",
            "{}",
            result["linearity"]
        );
        assert!(
            number(&result["linearity"]["even_by_noise_alone"]) > 1e-3,
            "{}",
            result["linearity"]
        );
        assert_eq!(
            result["linearity"]["bands"]
                .as_array()
                .expect("bands")
                .len(),
            6,
            "octaves from 5.125 Hz on"
        );
        for file in ["recording", "report", "frf_csv"]
            .map(|file| &result[file])
            .into_iter()
            .chain([&result["plots"]["linearity"]])
        {
            assert!(
                bench.path(file.as_str().expect("a path")).exists(),
                "{file}"
            );
        }
        let travel = |run: usize| number(&answer["runs"][run]["expected"]["travel_m"]);
        assert!((travel(run) / travel(0) / [1.0, 2.0, 4.0][run] - 1.0).abs() < 1e-9);
    }
    // `bench identify` gives the same linearity result from the recording.
    let recording = answer["runs"][2]["recording"].as_str().expect("a path");
    let again = bench.json(&format!("identify {recording}"));
    assert_eq!(again["linearity"], answer["runs"][2]["linearity"]);
    assert!(
        std::fs::read_to_string(bench.path(again["report"].as_str().expect("a path")))
            .expect("a page")
            .contains("lost to")
    );
}

#[test]
fn geometric_distortion_and_mode_shifts_grow_with_the_square_of_the_amplitude() {
    let (answer, _) =
        modes_over_amplitude("--shape model --scales 0.5,1,2 --set sim.geometry=quadratic");
    let even = |run: usize| number(&answer["runs"][run]["linearity"]["even_distortion_ratio"]);
    // Second order: the distortion grows with the square of the amplitude, so that its power relative to that of the output does, too:
    // by 4 per step. The power comes from more than 1000 lines, with an error of some per cent each; at the largest amplitude higher
    // even orders add to it.
    for run in [1, 2] {
        let growth = even(run) / even(run - 1);
        assert!(
            (3.2..5.0).contains(&growth),
            "{growth}: {} {} {}",
            even(0),
            even(1),
            even(2)
        );
    }
    assert_eq!(
        answer["runs"][2]["linearity"]["cause"], "nonlinearity",
        "{}",
        answer["runs"][2]["linearity"]["why"]
    );
    // A frequency shifts with the square of the amplitude, like the third-order product at the frequency itself. At the scales 0.5, 1, 2
    // the shifts are 1/4, 1, 4 times that of scale 1: the ratio of the differences is (4 - 1)/(1 - 1/4) = 4, with errors of some 15 %.
    assert_eq!(answer["shifted"], true);
    let shifting = |mode: &&Value| mode["frequency_shifts"] == true;
    let modes: Vec<&Value> = answer["modes"]
        .as_array()
        .expect("modes")
        .iter()
        .filter(shifting)
        .collect();
    assert_eq!(modes.len(), 2, "u and v: {modes:?}");
    for mode in modes {
        let hz = |run: usize| number(&mode["by_run"][run]["frequency_hz"]);
        let growth = (hz(2) - hz(1)) / (hz(1) - hz(0));
        assert!(
            (81.0..87.0).contains(&hz(0)) && (3.0..5.5).contains(&growth),
            "{growth}: {mode}"
        );
    }
}

#[test]
fn trip_ends_session_without_linearity_verdict() {
    let bench = Bench::new();
    // The model predicts a travel of 477 um; the soft limit is 500 um, and peaks of the noise exceed 80 um. At 0.2 of the amplitude the
    // readings stay below 200 um.
    let trips = "--shape model --set shape.travel_m=0.0006 --set interlock.soft_limit_m=0.0005 \
                 --set sim.probe_noise_rms_m=2e-5 --set interlock.model_error_off=noise --scales 0.1,0.2,1,1.01 --json";
    let answer = bench.run(&format!("linearity {HERE} {trips}"));
    assert_eq!(answer.code, 1, "{}", answer.err);
    let report = answer.json();
    assert_eq!(
        report["scales"],
        serde_json::json!([0.1, 0.2, 1.0]),
        "nothing runs after a trip"
    );
    assert_eq!(
        report["runs"][2]["outcome"], "tripped",
        "{}",
        report["runs"][2]
    );
    assert!(report["runs"][2]["frf_csv"].is_null() && report["runs"][1]["frf_csv"].is_string());
    assert!(report["shifted"].is_null(), "{}", report["why"]);
    let overview = report["overview"]["plot"]
        .as_str()
        .expect("two runs were analysed");
    assert!(bench.read(overview).contains(": 2 amplitudes"));
    assert!(
        report["why"]
            .as_str()
            .expect("a text")
            .contains("not every amplitude was run"),
        "{}",
        report["why"]
    );
}

#[test]
fn rejects_invalid_scales_and_amplitudes_beyond_an_interlock_before_any_motion() {
    for (options, words) in [
        (
            "--amplitude 0.5 --scales 0.5,1,4",
            ["at 4 of the planned amplitude", "soft limit of 900 um"].as_slice(),
        ),
        (
            "--amplitude 12 --scales 1,2",
            &[
                "at 1 of the planned amplitude",
                "peak current",
                "nothing was moved",
            ],
        ),
        ("--scales 1", &["--scales", "two to 10 different"]),
        ("--scales 1,1", &["--scales", "0.5,1,2"]),
        ("--scales 0,1", &["--scales", "from 0.000001 to 1000000"]),
        ("--scales -1,1", &["--scales", "from 0.000001 to 1000000"]),
        ("--scales 1,NaN", &["--scales", "not a number"]),
        ("--scales one", &["--scales", "not a number"]),
    ] {
        let bench = Bench::new();
        bench
            .run(&format!("linearity {HERE} {options} --json"))
            .is_refused(words);
        assert_eq!(bench.files(), [""; 0], "{options}");
    }
}
