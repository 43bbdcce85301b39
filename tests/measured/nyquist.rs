//! The count of unstable poles by the curve, against the eigenvalues of the closed loop.

use bench_control::measured::Stability;
use bench_experiment::{MeasuredFrf, closed_loop, measured_margins};
use bench_identify::scatter::SigmaSource;

use crate::measured::program::Draw;
use crate::measured::sampled::{config, frf};

#[test]
fn count_equals_the_number_of_unstable_eigenvalues() {
    let mut draw = Draw(2718);
    let (mut stable, mut unstable) = (0, 0);
    for _ in 0..40 {
        let controller = draw.one_of(&["fast", "fast", "slow"]);
        let (asymmetry, point) = (draw.between(-0.12, 0.12), draw.between(0.0, 0.09));
        let delay = draw.one_of(&[0, 1, 2, 4]);
        let sets = [
            format!("control.controller={controller}"),
            format!("plant.mass_asymmetry={asymmetry}"),
            format!("plant.operating_point_m={}", 0.0475 * point),
            format!("loop.computing_delay_periods={delay}"),
        ];
        let config = config(&sets.each_ref().map(String::as_str));
        let model = closed_loop(&config).expect("a loop");
        let measured = MeasuredFrf {
            frf: frf(&model, (0.1, 500.0)),
            recorded: None,
            sigma: SigmaSource::Given,
            cautions: Vec::new(),
        };
        let found = measured_margins(&measured, &model, &config).expect("margins");
        let poles = model.poles();
        let expected = poles.iter().filter(|s| s.re > 0.0).count() as i64;
        assert_eq!(found.count.unstable_poles, expected, "{sets:?}");
        assert_eq!(found.count.stability == Stability::Stable, expected == 0);
        assert_eq!(found.margins.is_some(), expected == 0);
        match expected {
            0 => stable += 1,
            _ => unstable += 1,
        }
    }
    assert!(
        stable >= 8 && unstable >= 5,
        "{stable} stable, {unstable} unstable"
    );
}

#[test]
fn margins_of_the_sampled_model_are_those_of_the_model() {
    for controller in ["fast", "slow"] {
        let config = config(&[&format!("control.controller={controller}")]);
        let model = closed_loop(&config).expect("a loop");
        let measured = MeasuredFrf {
            frf: frf(&model, (0.1, 500.0)),
            recorded: None,
            sigma: SigmaSource::Given,
            cautions: Vec::new(),
        };
        let found = measured_margins(&measured, &model, &config).expect("margins");
        let (found, expected) = (found.margins.expect("stable"), model.margins());
        // 400 points in a decade and more at resonances: a cubic errs by about (1/174)^4/384.
        let near = |found: f64, expected: f64| {
            assert!(
                (found / expected - 1.0).abs() < 1e-5,
                "{controller}: {found} for {expected}"
            );
        };
        near(found.modulus_margin.value, expected.modulus_margin);
        near(
            found.crossover_rad_s.expect("one").value,
            expected.crossover_rad_s.expect("one"),
        );
        near(
            found.phase_margin_deg.expect("one").value,
            expected.phase_margin_deg.expect("one"),
        );
        near(
            found.gain_margin_db.expect("one").value,
            expected.gain_margin_db.expect("one"),
        );
        near(
            found.sensitivity_bandwidth_rad_s.expect("one").value,
            expected.sensitivity_bandwidth_rad_s.expect("one"),
        );
        assert_eq!(found.crossings.len(), expected.crossings.len());
    }
}
