//! Verdicts: unknown delay, undefined numbers, missing modes, and zeros on the imaginary axis.
use bench_identify::FrfDatum;
use bench_identify::modal::{MeasurementChain, ModalFit, fit};
use bench_identify::verdict::{Certainty, Cnmp, Verdict, VerdictInput, verdict};
use bench_plant::ModalModel;
use nalgebra::Complex;

use crate::fit::identified::{analysed, config, measurable, model, truth};
use crate::fit::synthetic::{frf_data, stage, term};

#[test]
fn unknown_delay_is_measured_and_does_not_change_the_verdict() {
    for extra_s in [2e-4, 5e-4, 4e-3] {
        let sets = [
            "plant.operating_point_m=0.0032",
            "plant.mass_asymmetry=-0.05",
            "interlock.probe_stale_s=0.02",
        ];
        let sets = sets.map(String::from).to_vec();
        let assumed = config(&sets);
        let mut actual = assumed.clone();
        actual.probe.latency_s += extra_s;
        assert_eq!(truth(&actual), 0);
        let analysis = analysed(&actual, &assumed);
        assert_eq!(
            analysis.verdict.cnmp,
            Cnmp::Excluded,
            "{:?}",
            analysis.verdict
        );
        // At 1 kHz, aliases are a part of the response, whose phase an unknown delay of 0.5 ms changes by 180 degrees.
        let fit = analysis.fit.expect("modes");
        let stage_modes = measurable(&model(&actual), &[]).len();
        let all_modes = stage_modes + actual.sim.unmodelled.len();
        assert_eq!(fit.modes().len(), all_modes, "{:?}", fit.modes());
        // The seed is fixed. A sigma of 0.1 us is a ten-thousandth of a period.
        let delay = fit.delay_s();
        assert!(
            (delay.value - extra_s).abs() < 4.0 * delay.sigma && delay.sigma < 1e-7,
            "{extra_s}: {delay:?}"
        );
    }
}

fn verdict_on(
    modes: &[bench_plant::zeros::ModalTerm],
    sigma_m_per_n: f64,
    expected: usize,
) -> Verdict {
    let frf_data = frf_data(modes, 0.0, sigma_m_per_n, 12);
    verdict_from(
        &fit(&frf_data, &MeasurementChain::Direct).expect("modes"),
        &frf_data,
        expected,
    )
}

fn verdict_from(fit: &ModalFit, frf_data: &[FrfDatum], expected: usize) -> Verdict {
    let up_to_rad_s = std::f64::consts::TAU * 110.0;
    verdict(&VerdictInput {
        fit,
        chain: &MeasurementChain::Direct,
        frf_data,
        up_to_rad_s,
        expected_modes: Some(expected),
        certainty: Certainty::ONE_LOOK,
        duration_s: None,
    })
    .expect("zeros")
}

#[test]
fn verdict_from_non_finite_numbers_is_undecided() {
    let frf_data = frf_data(&stage(), 0.0, 1e-9, 12);
    let good = fit(&frf_data, &MeasurementChain::Direct).expect("modes");
    assert_eq!(verdict_from(&good, &frf_data, 3).cnmp, Cnmp::Detected);
    let mut unknown = good.clone();
    unknown.covariance.fill(f64::NAN);
    let mut misfit = good.clone();
    misfit.chi2_per_freedom = f64::NAN;
    for fit in [unknown, misfit] {
        assert_eq!(verdict_from(&fit, &frf_data, 3).cnmp, Cnmp::Undecided);
    }
    // A response of zero has neither a phase nor a logarithm of its magnitude.
    let mut with_zero = frf_data.clone();
    let valley = with_zero
        .iter()
        .position(|datum| datum.frequency_hz > 84.0)
        .expect("in the band");
    with_zero[valley].response = Complex::new(0.0, 0.0);
    assert_eq!(verdict_from(&good, &with_zero, 3).cnmp, Cnmp::Undecided);
    // The same for a stage without CNMP zeros: an undefined phase must not lead to `excluded`.
    let minimum_phase = [term(29.0, 0.009, 0.47), term(82.0, 0.004, 0.03)];
    let mut frf_data = crate::fit::synthetic::frf_data(&minimum_phase, 0.0, 1e-9, 12);
    let fit = fit(&frf_data, &MeasurementChain::Direct).expect("modes");
    assert_eq!(verdict_from(&fit, &frf_data, 2).cnmp, Cnmp::Excluded);
    frf_data[valley].response = Complex::new(0.0, 0.0);
    assert_eq!(verdict_from(&fit, &frf_data, 2).cnmp, Cnmp::Undecided);
}

#[test]
fn reason_of_an_undecided_verdict_names_what_is_missing() {
    assert_eq!(verdict_on(&stage(), 1e-9, 3).cnmp, Cnmp::Detected);
    let missing = verdict_on(&stage(), 1e-9, 4);
    assert!(
        missing.cnmp == Cnmp::Undecided && missing.why.contains("3 of the 4 modes"),
        "{}",
        missing.why
    );
    let single = verdict_on(&[term(29.0, 0.009, 0.47)], 1e-9, 1);
    assert!(
        single.cnmp == Cnmp::Undecided && single.why.contains("needs two modes"),
        "{}",
        single.why
    );
}

#[test]
fn verdict_is_undecided_for_zeros_on_the_imaginary_axis() {
    // Bisection for the asymmetry of the default stage at 8 % of L at which a damped zero is on the imaginary axis.
    let structure = |d: f64| {
        let sets = [
            "plant.operating_point_m=0.0038".to_string(),
            format!("plant.mass_asymmetry={d:.17}"),
        ];
        bench_plant::build(&config(&sets).plant).expect("a model")
    };
    let pairs = |d: f64| {
        bench_plant::zeros::cnmp_pairs(
            &bench_plant::zeros::damped_zeros(&structure(d)).expect("zeros"),
        )
    };
    let (mut low, mut high) = (-0.02, 0.02);
    assert!(pairs(low) == 0 && pairs(high) == 1);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if pairs(middle) == 0 {
            low = middle
        } else {
            high = middle
        }
    }
    let modal = ModalModel::of(&structure(low)).expect("modes");
    let terms: Vec<_> = modal
        .modes
        .iter()
        .filter(|mode| mode.residue_per_kg().abs() > 1e-4)
        .map(|mode| {
            term(
                mode.omega_rad_s / std::f64::consts::TAU,
                mode.damping_ratio,
                mode.residue_per_kg(),
            )
        })
        .collect();
    assert_eq!(terms.len(), 3);
    let verdict = verdict_on(&terms, 1e-9, 3);
    assert_eq!(verdict.cnmp, Cnmp::Undecided, "{verdict:?}");
}
