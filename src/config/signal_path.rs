//! The signal path between command and reading, from the settings of loop, motor, amplifier and probe.

use super::Config;
use crate::model::plant::SignalPath;

impl From<&Config> for SignalPath {
    fn from(config: &Config) -> SignalPath {
        let period_s = config.servo.period_s();
        let computing_s = f64::from(config.servo.computing_delay_periods) * period_s;
        let least_s = computing_s + config.amplifier.latency_s + config.probe.age_at_arrival_s();
        let probe_period_s = config.probe.rate_hz.map(|rate_hz| 1.0 / rate_hz);
        SignalPath {
            period_s,
            amplifier_bandwidth_hz: config.amplifier.bandwidth_hz,
            force_constant_n_per_a: config.motor.force_constant_n_per_a,
            delays_s: SignalPath::delays_of_probe_s(least_s, probe_period_s),
        }
    }
}
