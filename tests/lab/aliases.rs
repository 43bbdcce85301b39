//! Closed form of the sampled signal chain: the sum over its aliases.
//!
//! With s_k = j (w + 2 pi k/T), G(w) = sum over k of P(s_k) (1 - exp(-s_k T))/(s_k T) exp(-s_k d), where P is motor, amplifier and
//! modes and d the delay; a free-running probe multiplies each term by (1 - exp(-s_k Tp))/(s_k Tp).
use bench_config::{Config, Source, load};
use bench_plant::{ModalModel, Mode, build};
use nalgebra::Complex;

pub fn lab(sets: &[&str]) -> Config {
    let sets = sets.iter().map(|set| set.to_string()).collect();
    load(&Source {
        config: Some("lab".into()),
        sets,
        ..Source::default()
    })
    .expect("the profile is valid")
}

pub fn modes(config: &Config) -> Vec<Mode> {
    ModalModel::of(&build(&config.plant).expect("a model"))
        .expect("modes")
        .modes
}

fn hold(s: Complex<f64>, span_s: f64) -> Complex<f64> {
    (Complex::new(1.0, 0.0) - (-s * span_s).exp()) / (s * span_s)
}

/// The response in metres per ampere; `with_mean_age` omits the roll-off by the rate of the probe.
pub fn response(
    config: &Config,
    modes: &[Mode],
    omega_rad_s: f64,
    with_mean_age: bool,
) -> Complex<f64> {
    let period_s = config.servo.period_s();
    let probe_s = config.probe.rate_hz.map_or(0.0, |rate_hz| 1.0 / rate_hz);
    let delay_s = config.amplifier.latency_s + config.probe.latency_s + config.probe.transport_s;
    let lag_rad_s = std::f64::consts::TAU * config.amplifier.bandwidth_hz;
    let alias = |k: i32| {
        let s = Complex::new(
            0.0,
            omega_rad_s + f64::from(k) * std::f64::consts::TAU / period_s,
        );
        let modal = |m: &Mode| {
            let (w, zeta) = (m.omega_rad_s, m.damping_ratio);
            (s * s + s * 2.0 * zeta * w + w * w).inv() * m.force_gain * m.sensor_gain
        };
        let plant: Complex<f64> = modes.iter().map(modal).sum();
        let probe = if with_mean_age {
            (-s * probe_s / 2.0).exp()
        } else {
            hold(s, probe_s)
        };
        plant * config.motor.force_constant_n_per_a * lag_rad_s / (s + lag_rad_s)
            * hold(s, period_s)
            * (-s * delay_s).exp()
            * probe
    };
    (-100..=100).map(alias).sum()
}
