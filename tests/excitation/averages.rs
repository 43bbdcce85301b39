//! N repetitions of a chirp, or N times the periods, are worth sqrt(N).
use bench::experiment::Analysis;

use crate::rig::{SILENT, analysed, config, of_kind};

const SEEDS: u64 = 12;

/// RMS over frequencies and seeds of (error over the exact |H|), and of the stated sigma.
fn errors(sets: &[&str], kind: (&str, &[&str])) -> (f64, f64) {
    let exact: Analysis = analysed(&of_kind(kind, &[sets, SILENT.as_slice()].concat()));
    let (mut error, mut stated, mut count) = (0.0, 0.0, 0.0);
    for seed in 1..=SEEDS {
        let seed = format!("sim.seed={seed}");
        // White noise of the probe alone, and so much of it that it is all there is to see: that of the floor comes in lines that
        // are longer than a chirp's passage, and where a response is steep the estimator takes some of it for noise.
        let analysis = analysed(&of_kind(
            kind,
            &[
                sets,
                &[seed.as_str(), "sim.floor=[]", "sim.probe_noise_rms_m=1e-6"],
            ]
            .concat(),
        ));
        assert_eq!(analysis.frf.frequency_hz, exact.frf.frequency_hz);
        for k in 0..exact.frf.len() {
            let size = exact.frf.response[k].norm();
            error += ((analysis.frf.response[k].norm() - size) / size).powi(2);
            stated += (analysis.frf.magnitude_sigma[k] / size).powi(2);
            count += 1.0;
        }
    }
    ((error / count).sqrt(), (stated / count).sqrt())
}

#[test]
fn four_repetitions_of_a_chirp_halve_both_the_error_and_the_sigma_that_is_stated() {
    let sets = [
        "chirp.start_hz=40.0",
        "chirp.stop_hz=75.0",
        "chirp.duration_s=10.0",
        "chirp.fade_in_s=0.5",
    ];
    let times = |n: &str| errors(&[&sets, [n].as_slice()].concat(), ("chirp", &[]));
    let (once, four) = (times("chirp.repetitions=1"), times("chirp.repetitions=4"));
    // Some 700 frequencies with 8 to 9 bins each, so 80 independent ones, from 12 seeds: an RMS is known to 1/sqrt(2 x 960) = 2.3 %,
    // the ratio of two to 3.2 %; three of these.
    let (error, stated) = (once.0 / four.0, once.1 / four.1);
    assert!(
        (1.8..2.2).contains(&error),
        "the error falls by {error}: {once:?} {four:?}"
    );
    assert!(
        (1.8..2.2).contains(&stated),
        "the stated sigma falls by {stated}: {once:?} {four:?}"
    );
}

#[test]
fn four_times_the_periods_of_a_multisine_halve_both() {
    let sets = [
        "chirp.start_hz=40.0",
        "chirp.stop_hz=75.0",
        "multisine.period_s=4.0",
        "multisine.settle_periods=2",
    ];
    let times = |n: &str| errors(&[&sets, [n].as_slice()].concat(), ("multisine", &[]));
    // One period more shows the drift of the last: 8 and 32 are averaged.
    let (few, many) = (times("multisine.periods=9"), times("multisine.periods=33"));
    // 141 lines from 12 seeds: 1.7 % and 2.4 %. The RMS of a sigma from 8 periods is as known.
    let (error, stated) = (few.0 / many.0, few.1 / many.1);
    assert!(
        (1.85..2.15).contains(&error),
        "the error falls by {error}: {few:?} {many:?}"
    );
    assert!(
        (1.85..2.15).contains(&stated),
        "the stated sigma falls by {stated}: {few:?} {many:?}"
    );
}

#[test]
fn one_repetition_is_the_chirp_as_it_was() {
    let sets = ["chirp.duration_s=20.0", "chirp.start_hz=2.0"];
    let (plain, once) = (
        config(&sets),
        config(&[&sets, ["chirp.repetitions=1"].as_slice()].concat()),
    );
    assert_eq!(plain, once);
    assert_eq!(analysed(&plain).frf, analysed(&once).frf);
}
