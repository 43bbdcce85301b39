use std::sync::atomic::AtomicBool;

use super::*;
use crate::plan::Plan;
use crate::run::{Runner, Setup};
use bench_config::{Purpose, Source, load};
use bench_identify::verdict::{DecisiveQuantity, UncertainZero, zeros};

/// A stage beside the border of the region with CNMP zeros, with a noise of 8 um.
fn config(seed: u64) -> Config {
    let sets = [
        "loop.rate_hz=1000".into(),
        "chirp.stop_hz=450".into(),
        "plant.mass_asymmetry=0.01".into(),
        "sim.probe_noise_rms_m=8e-6".into(),
        format!("sim.seed={seed}"),
    ];
    load(&Source {
        config: None,
        sets: sets.to_vec(),
        options: Vec::new(),
        purpose: Purpose::Chirp,
    })
    .expect("valid settings")
}

fn run_of(runner: &Runner, planned: &PlannedShot) -> Run {
    let run = runner.run(&Plan::chirp(planned.config.clone()), "shot");
    let mut run = run.expect("a run");
    run.totals().expect("a good disk");
    run
}

/// The real part of a zero as a quantity, also where its sign is certain already.
fn real_part(
    experiment: &SequentialExperiment<'_>,
    near_rad_s: f64,
) -> (UncertainZero, DecisiveQuantity) {
    let fit = experiment.analysis.fit.as_ref().expect("modes");
    let zeros = zeros(fit).expect("zeros");
    let complex = zeros.into_iter().filter(|zero| zero.s.im > 0.0);
    let off = |zero: &UncertainZero| (zero.s.im - near_rad_s).abs();
    let zero = complex
        .min_by(|a, b| off(a).total_cmp(&off(b)))
        .expect("a zero");
    let quantity = DecisiveQuantity::side_of(fit, &zero, Certainty::REPEATED_LOOKS);
    (zero, quantity)
}

#[test]
fn another_shot_reduces_the_uncertainty_of_a_zero_as_predicted() {
    let mut ratios = Vec::new();
    for seed in 1..=6 {
        let base = config(seed);
        let folder = tempfile::tempdir().expect("a folder");
        let runner = Runner::new(Setup::simulated(folder.path().into()));
        let stop = AtomicBool::new(false);
        let limits = SequenceLimits {
            max_motion_s: 100.0,
            stop: &stop,
        };
        let first = PlannedShot::first(&base, limits.max_motion_s).expect("a plan");
        let mut run = run_of(&runner, &first);
        let experiment = SequentialExperiment::after(&base, limits, &first, &mut run);
        let (mut experiment, _) = experiment.expect("a response");
        let (zero, quantity) = real_part(&experiment, 530.0);
        let fit = experiment.analysis.fit.as_ref().expect("modes");
        let points = amplitude_of_fit(&base, &first.shot, &experiment.chain, fit);
        let amplitude = AmplitudeCurve::of_current(&points);
        let information =
            InformationByFrequency::of(&experiment.first, &experiment.chain, fit, &amplitude);
        let information = information.expect("a covariance");
        // 74 to 102 Hz: the close modes and the zeros between them.
        let band = (13, 14);
        let shot = information.shot(band, 2.0);
        let after = information
            .covariance_after(band, 2.0)
            .expect("a covariance");
        let predicted = information.sigma(&after, &quantity.gradient);
        assert!(predicted < 0.8 * zero.real_part().sigma, "the shot counts");
        let planned = experiment.planned(shot).expect("a plan");
        let mut run = run_of(&runner, &planned);
        experiment.add(&planned, &mut run).expect("a response");
        let (reached, _) = real_part(&experiment, zero.s.im);
        ratios.push(reached.real_part().sigma / predicted);
    }
    ratios.sort_by(f64::total_cmp);
    // The noise is known to about 10 %, and the fades take 5 % of the energy of a shot.
    let median = 0.5 * (ratios[2] + ratios[3]);
    assert!((0.85..1.2).contains(&median), "{ratios:?}");
}
