//! Multisine, binary sequence and stepped sine each give the response of the rig and its modes.
use bench::config::Config;
use bench::experiment::{Analysis, replay};
use bench::identify::modal::FittedMode;
use bench::identify::verdict::Cnmp;
use bench::recording::Recording;
use nalgebra::Complex;
use serde_json::json;

use crate::rig::{KINDS, SILENT, analysed, of_kind, recorded};
use crate::truth;

/// The response of the rig by another program, at the frequencies of the analysis.
fn true_response(config: &Config, analysis: &Analysis) -> Option<Vec<Complex<f64>>> {
    let config = serde_json::to_value(config).expect("JSON");
    let question =
        json!({"what": "frf", "config": config, "frequency_hz": analysis.frf.frequency_hz});
    let answers = truth::ask(&[question])?;
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let points = answers[0].as_array().expect("a list").iter();
    Some(
        points
            .map(|h| Complex::new(number(&h[0]), number(&h[1])))
            .collect(),
    )
}

#[test]
fn without_noise_the_response_is_the_rigs_but_for_what_the_stage_still_remembers() {
    for kind in KINDS {
        let config = of_kind(kind, &SILENT);
        let analysis = analysed(&config);
        let Some(truth) = true_response(&config, &analysis) else {
            return;
        };
        assert!(
            analysis.frf.len() > 100,
            "{}: {}",
            kind.0,
            analysis.frf.len()
        );
        for (k, truth) in truth.iter().enumerate() {
            let (frequency_hz, measured) = (analysis.frf.frequency_hz[k], analysis.frf.response[k]);
            // Mode R forgets with 0.62 s: of what the fade leaves in motion, some hundredth, exp(-8) is there after 5 s, and
            // less on average over the periods; lines at a zero of the response see it the most.
            let relative = (measured - truth).norm() / truth.norm();
            assert!(
                relative < 1e-3,
                "{}: {relative} at {frequency_hz} Hz",
                kind.0
            );
        }
    }
}

#[test]
fn with_noise_the_stated_sigmas_hold() {
    for kind in KINDS {
        let mut shares = [0.0, 0.0];
        for seed in [1, 2, 3] {
            let config = of_kind(kind, &[&format!("sim.seed={seed}")]);
            let analysis = analysed(&config);
            let Some(truth) = true_response(&config, &analysis) else {
                return;
            };
            let within = |sigmas: f64| {
                let good = |(k, truth): (usize, &Complex<f64>)| {
                    let off = analysis.frf.response[k].norm() - truth.norm();
                    off.abs() <= sigmas * analysis.frf.magnitude_sigma[k]
                };
                truth.iter().enumerate().filter(|line| good(*line)).count() as f64
                    / truth.len() as f64
                    / 3.0
            };
            shares[0] += within(1.0);
            shares[1] += within(2.0);
        }
        // Sigma is the scatter of 7 periods (5 blocks of a sine), 12 (8) degrees of freedom of Student's t: 66.3 (65.3) % within
        // one, 93.1 (92.0) % within two. 400 lines have a binomial sigma of 2.4 % and 1.3 %; three are allowed.
        assert!(
            (0.58..0.74).contains(&shares[0]),
            "{}: {} within one sigma",
            kind.0,
            shares[0]
        );
        assert!(
            (0.88..0.97).contains(&shares[1]),
            "{}: {} within two sigma",
            kind.0,
            shares[1]
        );
    }
}

#[test]
fn modes_r_u_and_v_have_the_signs_of_the_model_and_the_zeros_are_never_excluded() {
    // `bench model modes`: 183.936, 516.657 and 538.999 rad/s.
    let truth_hz = [29.274, 82.228, 85.784];
    for kind in KINDS {
        let analysis = analysed(&of_kind(kind, &[]));
        let modes = analysis.fit.as_ref().expect("modes").modes();
        // The binary sequence shows the fourth of the model as well, at 22.869 Hz with 6e-6 of R's residue.
        for (truth_hz, sign) in truth_hz.into_iter().zip([1.0, -1.0, 1.0]) {
            let near =
                |mode: &&FittedMode| (mode.frequency_hz().value / truth_hz - 1.0).abs() < 5e-4;
            let found: Vec<_> = modes.iter().filter(near).collect();
            let [mode] = found[..] else {
                panic!("{}: {found:?} for {truth_hz} Hz of {modes:?}", kind.0)
            };
            assert!(
                mode.residue_per_kg.value * sign > 0.0,
                "{}: {mode:?}",
                kind.0
            );
            assert!(mode.sign_error_probability() < 1e-6);
        }
        // The current of a multisine is put where the response is small; that of the others may not do for a verdict.
        let (cnmp, why) = (analysis.verdict.cnmp, &analysis.verdict.why);
        assert!(
            cnmp != Cnmp::Excluded && (cnmp == Cnmp::Detected || kind.0 != "multisine"),
            "{}: {why}",
            kind.0
        );
    }
}

#[test]
fn a_recording_replays_bit_for_bit_whatever_excited_it() {
    let short = [
        "chirp.duration_s=6.0",
        "chirp.repetitions=2",
        "stepped_sine.count=5",
        "prbs.periods=5",
    ];
    for kind in KINDS.into_iter().chain([("chirp", [].as_slice())]) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = recorded(&of_kind(kind, &short), folder.path());
        let replayed =
            replay(&Recording::open(&path).expect("a recording")).expect("it can be replayed");
        assert_eq!(
            (replayed.different, replayed.first),
            (0, None),
            "{}",
            kind.0
        );
        assert!(replayed.ticks > 10_000, "{}: {}", kind.0, replayed.ticks);
    }
}
