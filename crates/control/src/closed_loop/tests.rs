//! A loop of one mode against closed forms, and the two descriptions of a sampled loop, in time and in frequency, against each other.

use nalgebra::DVector;

use super::*;
use crate::StateSpaceLaw;
use bench_plant::{OutputKind, SignalPath};

const PERIOD_S: f64 = 1e-3;
const FORCE_CONSTANT_N_PER_A: f64 = 10.0;
/// Frequency in rad/s, damping ratio and residue in 1/kg of the mode.
const MODE: (f64, f64, f64) = (100.0, 0.3, 0.5);

fn mode((omega_rad_s, damping_ratio, residue_per_kg): (f64, f64, f64)) -> Mode {
    Mode {
        omega_rad_s,
        damping_ratio,
        shape: DVector::zeros(1),
        force_gain: residue_per_kg,
        sensor_gain: 1.0,
        floor_gain: 0.0,
    }
}

fn closed_with(modes: Vec<Mode>, design: Box<dyn ControlDesign>) -> ClosedLoop {
    let path = SignalPath {
        period_s: PERIOD_S,
        amplifier_bandwidth_hz: 300.0,
        force_constant_n_per_a: FORCE_CONSTANT_N_PER_A,
        delays_s: vec![1.3e-3],
        output: OutputKind::Position,
    };
    let plant = LoopPlant::of(&path, &modes);
    ClosedLoop::new(plant, modes, FORCE_CONSTANT_N_PER_A, design).expect("linear")
}

/// A gain in amperes per metre as a section, whose unit is amperes per micrometre.
fn gain_section(gain_a_per_m: f64) -> Vec<Section> {
    vec![Section {
        numerator: [gain_a_per_m * 1e-6, 0.0, 0.0],
        denominator: [1.0, 0.0, 0.0],
        prewarp_rad_s: None,
    }]
}

fn closed(gain_a_per_m: f64) -> ClosedLoop {
    closed_with(vec![mode(MODE)], Box::new(gain_section(gain_a_per_m)))
}

/// The gain as a discrete law, without continuous sections: u = g (r - y), and a state that has no effect.
fn discrete(gain_a_per_m: f64) -> ClosedLoop {
    let law = StateSpaceLaw {
        rate_hz: 1.0 / PERIOD_S,
        a: vec![vec![0.0]],
        b_reference: vec![0.0],
        b_position: vec![0.0],
        c: vec![0.0],
        d_reference: gain_a_per_m,
        d_position: -gain_a_per_m,
    };
    closed_with(vec![mode(MODE)], Box::new(law))
}

/// The gain with which the force constant and the residue give `ratio` times the stiffness: K kf r = ratio w^2.
fn gain_for(ratio: f64) -> f64 {
    let (w, _, residue) = MODE;
    ratio * w * w / (FORCE_CONSTANT_N_PER_A * residue)
}

#[test]
fn continuous_loop_is_gain_times_force_constant_times_mode() {
    // L(j w) = 0.8 w0^2/(w0^2 - w^2 + 2 j zeta w0 w).
    let closed = closed(gain_for(0.8));
    let (w0, zeta, _) = MODE;
    for w in [0.0, 30.0, 100.0, 700.0] {
        let expected = Complex::new(w0 * w0 - w * w, 2.0 * zeta * w0 * w).inv() * 0.8 * w0 * w0;
        let found = closed.continuous_loop(w).expect("sections");
        assert!((found - expected).norm() < 1e-13, "{w}: {found}");
    }
}

#[test]
fn continuous_poles_are_those_of_the_stiffened_mode() {
    // s^2 + 2 zeta w0 s + (1 + 0.8) w0^2 = 0.
    let poles = closed(gain_for(0.8)).continuous_poles();
    let (w0, zeta, _) = MODE;
    let expected = Complex::new(-zeta * w0, w0 * (1.8 - zeta * zeta).sqrt());
    assert_eq!(poles.len(), 2);
    for pole in poles {
        let upper = Complex::new(pole.re, pole.im.abs());
        assert!((upper - expected).norm() < 1e-9, "{pole}");
    }
}

#[test]
fn continuous_loop_is_unstable_from_the_negative_gain_that_takes_the_stiffness() {
    for (ratio, stable) in [(-0.99, true), (-1.01, false), (50.0, true)] {
        let margins = closed(gain_for(ratio))
            .continuous_margins()
            .expect("sections");
        assert_eq!(
            (margins.stable, margins.continuous),
            (stable, true),
            "{ratio}"
        );
    }
}

#[test]
fn crossover_of_the_continuous_loop_has_its_closed_form() {
    // |L| = 1 with a^2 = 9 and x = (w/w0)^2: (1 - x)^2 + 4 zeta^2 x = 9.
    let margins = closed(gain_for(3.0))
        .continuous_margins()
        .expect("sections");
    let (w0, zeta, _) = MODE;
    let half = 1.0 - 2.0 * zeta * zeta;
    let expected = w0 * (half + (half * half + 8.0).sqrt()).sqrt();
    let found = margins.crossover_rad_s.expect("a crossover");
    assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
    assert_eq!(margins.crossings.len(), 1);
}

#[test]
fn law_without_sections_has_no_continuous_loop() {
    let closed = discrete(gain_for(0.5));
    assert_eq!(closed.continuous_loop(10.0), None);
    assert!(closed.continuous_poles().is_empty());
    assert!(matches!(
        closed.continuous_margins(),
        Err(ControllerError::NotSections)
    ));
}

#[test]
fn sampled_loop_is_plant_times_law() {
    let gain = gain_for(0.8);
    for closed in [closed(gain), discrete(gain)] {
        for w in [1.0, 100.0, 2000.0] {
            let plant = closed.plant().response(w);
            assert_eq!(closed.sampled_plant(w), plant);
            let law = closed.law_response(w);
            assert!((law / gain - 1.0).norm() < 1e-12, "{w}: {law}");
            let expected = plant * gain;
            let found = closed.sampled_loop(w);
            assert!((found - expected).norm() < 1e-12 * expected.norm(), "{w}");
        }
        // At rest the mode is a spring: K kf r/w0^2.
        assert!((closed.sampled_loop(0.0) - 0.8).norm() < 1e-9);
    }
}

#[test]
fn complementary_sensitivity_is_the_transform_of_the_simulated_impulse_response() {
    // The poles decay with about 20 rad/s or more: exp(-20 x 2) after 2000 ticks.
    let closed = closed(gain_for(0.5));
    let impulse = |tick| if tick == 0 { 1e-6 } else { 0.0 };
    let readings = closed.simulate(2000, impulse);
    for w in [1.0, 50.0, 120.0, 900.0, 3000.0] {
        let turn = Complex::from_polar(1.0, -w * PERIOD_S);
        let sum = readings.iter().rev();
        let sum = sum.fold(Complex::new(0.0, 0.0), |sum, y| sum * turn + *y) * 1e6;
        let found = closed.complementary_sensitivity(w);
        assert!((found - sum).norm() < 1e-12, "{w}: {found} {sum}");
    }
}

#[test]
fn simulated_current_is_that_of_the_law_and_of_the_feedforward() {
    let gain = gain_for(0.5);
    let closed = closed(gain);
    let reference_m = |tick: usize| 1e-6 * tick as f64;
    let signals: Vec<(f64, f64)> = closed.signals(50, reference_m).collect();
    let readings = closed.simulate(50, reference_m);
    assert_eq!((signals.len(), readings.len()), (50, 50));
    for (tick, (current_a, position_m)) in signals.iter().enumerate() {
        assert_eq!(*position_m, readings[tick]);
        let expected = gain * (reference_m(tick) - position_m);
        assert!((current_a - expected).abs() < 1e-12 * gain, "{tick}");
    }
    // Without a reference the feedforward is the only current of the first tick.
    let feedforward = |_| LoopCommand {
        reference_m: 0.0,
        feedforward_a: 0.25,
    };
    let first = closed.commanded_signals(1, feedforward).next();
    assert_eq!(first, Some((0.25, 0.0)));
}

#[test]
fn poles_of_the_sampled_loop_solve_its_equation() {
    // 1 + P(z) C(z) = 0 at z = exp(s T).
    let gain = gain_for(0.8);
    let closed = discrete(gain);
    let poles = closed.poles();
    let pairs = poles.iter().filter(|s| s.im > 0.0 && s.im < 1000.0);
    let solved = pairs.map(|s| closed.plant().response_at((s * PERIOD_S).exp()) * gain + 1.0);
    let errors: Vec<f64> = solved.map(|error| error.norm()).collect();
    assert_eq!(errors.len(), 1, "{poles:?}");
    assert!(errors[0] < 1e-9, "{errors:?}");
}

#[test]
fn gain_margin_is_the_gain_at_which_the_sampled_loop_becomes_unstable() {
    let ratio = 0.8;
    let closed = closed(gain_for(ratio));
    let margins = closed.margins();
    assert!(margins.stable && !margins.continuous && closed.is_stable());
    let margin_db = margins.upper_gain_margin_db.expect("a gain margin");
    let factor = 10_f64.powf(margin_db / 20.0);
    for (part, stable) in [(0.9999, true), (1.0001, false)] {
        let changed = self::closed(gain_for(part * factor * ratio));
        assert_eq!(changed.is_stable(), stable, "{part}");
        assert_eq!(changed.margins().stable, stable, "{part}");
    }
    // The stiffness is taken by the gain -1.
    assert!(self::closed(gain_for(-0.999)).is_stable());
    assert!(!self::closed(gain_for(-1.001)).is_stable());
}

#[test]
fn modulus_margin_of_the_sampled_loop_is_the_least_distance_from_minus_one() {
    let closed = closed(gain_for(2.0));
    let margins = closed.margins();
    // From 0 to half the rate in steps of 0.05 rad/s: |1 + L| has a curvature below 1/(10 rad/s)^2.
    let distances = (0..62_000).map(|k| (closed.sampled_loop(0.05 * f64::from(k)) + 1.0).norm());
    let least = distances.fold(f64::INFINITY, f64::min);
    let found = margins.modulus_margin;
    assert!(
        found <= least + 1e-12 && found > least - 1e-4,
        "{found} {least}"
    );
    for crossing in &margins.crossings {
        let size = closed.sampled_loop(crossing.rad_s).norm();
        assert!((size - 1.0).abs() < 1e-9, "{crossing:?}");
    }
    assert!(!margins.crossings.is_empty());
}

#[test]
fn step_mode_is_the_oscillation_of_the_simulated_step() {
    // y[k] - y[inf] = A rho^k cos(theta k + phi) when the other poles have decayed. With e[k] = (y[k] - y[inf])/rho^k:
    // A^2 sin^2 theta = e[k]^2 + e[k+1]^2 - 2 e[k] e[k+1] cos theta.
    let ratio = 0.5;
    let closed = closed_with(
        vec![mode((100.0, 0.05, 0.5))],
        Box::new(gain_section(gain_for(ratio))),
    );
    let modes = closed.step_modes(1e-3);
    let strongest = modes.first().expect("an oscillation");
    let (w, zeta) = (strongest.omega_rad_s, strongest.damping_ratio);
    let decay = (-zeta * w * PERIOD_S).exp();
    let theta = w * (1.0 - zeta * zeta).sqrt() * PERIOD_S;
    let readings = closed.simulate(200, |_| 1.0);
    let rest = ratio / (1.0 + ratio);
    for k in [40, 77, 150] {
        let [a, b] = [k, k + 1].map(|k| (readings[k] - rest) / decay.powi(k as i32));
        let squared = (a * a + b * b - 2.0 * a * b * theta.cos()) / theta.sin().powi(2);
        // The next pole, near exp(-2 pi 300 T) = 0.15, is below 1e-20 after 40 ticks.
        let relative = strongest.step_ratio / squared.sqrt() - 1.0;
        assert!(relative.abs() < 1e-7, "{k}: {strongest:?}, {relative}");
    }
    let size = strongest.step_ratio;
    assert_eq!(closed.step_modes(0.999 * size).len(), 1);
    assert!(closed.step_modes(1.001 * size).is_empty());
}

#[test]
fn well_damped_poles_are_no_step_modes() {
    // Of the sampled loop with a small gain the pole is that of the mode.
    for (damping_ratio, count) in [(0.48, 1), (0.52, 0)] {
        let modes = vec![mode((100.0, damping_ratio, 0.5))];
        let closed = closed_with(modes, Box::new(gain_section(gain_for(1e-3))));
        let found = closed.step_modes(0.0);
        let near = found.iter().filter(|mode| mode.omega_rad_s < 200.0);
        assert_eq!(near.count(), count, "{found:?}");
    }
}

#[test]
fn search_for_crossings_begins_a_thousandth_below_the_slowest_mode() {
    let design = || Box::new(gain_section(1.0));
    let free = (0.0, 0.0, 0.5);
    for (modes, lowest_rad_s) in [
        (vec![mode((20.0, 0.1, 0.5)), mode(MODE)], 0.02),
        (vec![mode(free), mode(MODE)], 0.1),
        (vec![mode(free)], 1e-3),
        // Half the rate is lower.
        (vec![mode((9e3, 0.1, 0.5))], std::f64::consts::PI),
    ] {
        let closed = closed_with(modes, design());
        let found = closed.lowest_rad_s();
        assert!((found / lowest_rad_s - 1.0).abs() < 1e-14, "{found}");
        let nyquist = closed.nyquist_rad_s();
        assert!((nyquist / (1000.0 * std::f64::consts::PI) - 1.0).abs() < 1e-14);
    }
}

#[test]
fn free_body_is_two_integrators_of_the_open_loop() {
    let free = (0.0, 0.0, 0.5);
    for (modes, integrators) in [
        (vec![mode(MODE)], 0),
        (vec![mode(free), mode(MODE)], 2),
        (vec![mode(free), mode(free)], 4),
    ] {
        let closed = closed_with(modes, Box::new(gain_section(1.0)));
        let poles = closed.open_loop_poles().expect("poles");
        assert_eq!((poles.integrators, poles.unstable), (integrators, 0));
    }
}

#[test]
fn frequencies_rise_within_their_limits_and_follow_a_resonance() {
    let sharp = (100.0, 1e-4, 0.5);
    let closed = closed_with(vec![mode(sharp)], Box::new(gain_section(gain_for(1e-6))));
    let frequencies = closed.frequencies(10.0, 1000.0);
    let (first, last) = (frequencies[0], frequencies[frequencies.len() - 1]);
    assert!(first == 10.0 && (last / 1000.0 - 1.0).abs() < 1e-12);
    assert!(frequencies.windows(2).all(|pair| pair[0] < pair[1]));
    // Half of the circle of the resonance lies within its width of 0.01 rad/s on either side.
    let near = frequencies.iter().filter(|w| (*w - 100.0).abs() < 0.01);
    let count = near.count();
    assert!((20..1000).contains(&count), "{count}");
}

#[test]
fn pairs_of_a_section_are_frequency_and_damping_ratio_of_its_roots() {
    // s^2 + 2 x 0.1 x 30 s + 900 over 4 s^2 + 2 x 0.5 x 40 x 4 s + 4 x 1600; a first order and a constant have none.
    let section = Section {
        numerator: [900.0, 6.0, 1.0],
        denominator: [6400.0, 160.0, 4.0],
        prewarp_rad_s: None,
    };
    let pairs = section_pairs(&[section]);
    assert_eq!(pairs.len(), 2);
    for ((w, zeta), (w_expected, zeta_expected)) in
        pairs.into_iter().zip([(30.0, 0.1), (40.0, 0.5)])
    {
        assert!((w - w_expected).abs() < 1e-12 && (zeta - zeta_expected).abs() < 1e-14);
    }
    for none in [
        [3.0, 1.0, 0.0],
        [3.0, 0.0, 0.0],
        [0.0, 1.0, 1.0],
        [-1.0, 0.0, 1.0],
    ] {
        assert_eq!(pair(&none), None);
    }
}

#[test]
fn crossings_within_a_sharp_resonance_are_found() {
    // |L| = 1e-5 w0^2/|w0^2 - w^2| is 1 at w^2 = w0^2 (1 -+ 1e-5): 0.001 rad/s apart, where points 400 in a decade are 0.6 rad/s apart.
    let modes = || vec![mode((100.0, 1e-8, 0.5))];
    let closed = closed_with(modes(), Box::new(gain_section(gain_for(1e-5))));
    let continuous = closed.continuous_margins().expect("sections");
    let expected = [0.99999, 1.00001].map(|squared: f64| 100.0 * squared.sqrt());
    assert_eq!(continuous.crossings.len(), 2);
    for (crossing, expected) in continuous.crossings.iter().zip(expected) {
        // The damping has the effect (2 zeta/1e-5)^2/2, 2e-6 of the distance from the resonance.
        let error = (crossing.rad_s - expected).abs();
        assert!(error < 1e-7, "{crossing:?} {expected}");
    }
    // Hold, amplifier and sampling change |L| by less than 2 %.
    let sampled = closed.margins().crossings;
    assert_eq!(sampled.len(), 2);
    for (crossing, expected) in sampled.iter().zip(expected) {
        let error = (crossing.rad_s - expected).abs();
        assert!(error < 0.02 * 0.0005, "{crossing:?} {expected}");
    }
}

#[test]
fn asymptote_begins_where_a_loop_with_an_integrator_has_a_gain_of_a_hundred() {
    // L = 0.5 rad/s/w at low frequencies: 50 at 0.01 and 500 at 0.001 rad/s.
    let static_gain = FORCE_CONSTANT_N_PER_A * MODE.2 / (MODE.0 * MODE.0);
    let integrator = vec![Section {
        numerator: [0.5 / static_gain * 1e-6, 0.0, 0.0],
        denominator: [0.0, 1.0, 0.0],
        prewarp_rad_s: None,
    }];
    let closed = closed_with(vec![mode(MODE)], Box::new(integrator));
    assert!((closed.sampled_loop(1e-3).norm() / 500.0 - 1.0).abs() < 1e-4);
    let found = closed.asymptote_rad_s(10.0).expect("a frequency");
    assert!((found / 1e-3 - 1.0).abs() < 1e-12, "{found}");
    // Without an integrator the curve does not turn below the given frequency.
    assert_eq!(self::closed(1.0).asymptote_rad_s(10.0), Some(10.0));
}
