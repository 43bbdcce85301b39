//! What no single setting of an excitation can say.

use super::{BLOCKS_PER_SINE, Config, ExcitationKind, MultisineSettings, PrbsSettings};
use crate::util::finding::Finding;

/// All that is wrong between the settings of the excitation in use, its length apart.
pub(super) fn excitation(config: &Config) -> Vec<Finding> {
    match config.excitation.kind {
        ExcitationKind::Chirp | ExcitationKind::SteppedSine => Vec::new(),
        ExcitationKind::Multisine => multisine(config, &config.multisine).into_iter().collect(),
        ExcitationKind::Prbs => prbs(config, &config.prbs).into_iter().collect(),
    }
}

/// The excitation in ticks, and the setting that makes it long.
pub(super) fn ticks(config: &Config) -> (f64, &'static str, f64) {
    let (chirp, rate_hz) = (&config.chirp, config.servo.rate_hz);
    let quiet_s = chirp.quiet_before_s + chirp.quiet_after_s;
    let periodic = |period_s: f64, periods: u32, settle: u32| {
        (quiet_s + period_s * f64::from(periods.saturating_add(settle)) + chirp.fade_out_s)
            * rate_hz
    };
    match config.excitation.kind {
        ExcitationKind::Chirp => {
            let ticks = (quiet_s + chirp.duration_s) * f64::from(chirp.repetitions) * rate_hz;
            (ticks, "chirp.duration_s", chirp.duration_s)
        }
        ExcitationKind::Multisine => {
            let m = &config.multisine;
            (
                periodic(m.period_s, m.periods, m.settle_periods),
                "multisine.period_s",
                m.period_s,
            )
        }
        ExcitationKind::Prbs => {
            let p = &config.prbs;
            (
                periodic(period_s(config), p.periods, p.settle_periods),
                "prbs.order",
                f64::from(p.order),
            )
        }
        ExcitationKind::SteppedSine => {
            let s = &config.stepped_sine;
            let one_s = |f: f64| s.settle_s + s.measure_s.max(BLOCKS_PER_SINE / f);
            let sines_s: f64 = s
                .frequencies_hz(chirp.start_hz, chirp.stop_hz)
                .into_iter()
                .map(one_s)
                .sum();
            (
                (quiet_s + sines_s + s.settle_s) * rate_hz,
                "stepped_sine.count",
                f64::from(s.count),
            )
        }
    }
}

/// Length of a period of the sequence in seconds.
fn period_s(config: &Config) -> f64 {
    let steps = (1u64 << config.prbs.order.min(20)) - 1;
    steps as f64 * f64::from(config.prbs.clock_divider) / config.servo.rate_hz
}

fn multisine(config: &Config, settings: &MultisineSettings) -> Option<Finding> {
    let line_hz = 1.0 / settings.period_s;
    let (low_hz, high_hz) = config.chirp.band_hz();
    let what = format!(
        "is {} s: lines are {line_hz} Hz apart, and the band from {low_hz} to {high_hz} Hz holds too few; it needs ten of them",
        settings.period_s
    );
    (high_hz - low_hz < 10.0 * line_hz).then(|| finding("multisine.period_s", what))
}

fn prbs(config: &Config, settings: &PrbsSettings) -> Option<Finding> {
    let limit_hz = config.servo.rate_hz / f64::from(settings.clock_divider) / 2.0;
    let (_, highest_hz) = config.chirp.band_hz();
    let what = format!(
        "is {}: the sequence excites up to {limit_hz} Hz, the band goes to {highest_hz} Hz; lower it, or chirp.stop_hz",
        settings.clock_divider
    );
    (highest_hz > limit_hz).then(|| finding("prbs.clock_divider", what))
}

fn finding(path: &str, what: String) -> Finding {
    Finding {
        path: path.into(),
        what,
        missing: false,
    }
}
