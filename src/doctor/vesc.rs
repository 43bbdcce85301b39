//! A VESC, by its STATUS frames.

use bench_hal::can::vesc::VescSettings;

use super::can_nodes::BusTraffic;
use super::finding::{Finding, Subject};

/// A current above this, without a command, is reported, in units of 0.1 A.
const STRAY_CURRENT: u16 = 2;

/// Evaluates the STATUS frames of the configured VESC.
pub fn findings(traffic: &BusTraffic, settings: &VescSettings) -> Vec<Finding> {
    let node = settings.node;
    let Some(&(count, tenths)) = traffic.vescs.get(&node) else {
        return vec![Subject::Vesc.failure(
            format!("VESC {node} sent no STATUS within {} s", traffic.seconds),
            "check its supply and cable, its number, and that CAN status 1 is enabled in VESC Tool",
        )];
    };
    let rate_hz = count as f64 / traffic.seconds;
    let timeout_s = settings.status_timeout.as_secs_f64();
    vec![rate(node, rate_hz, timeout_s), current(node, tenths)]
}

fn rate(node: u8, rate_hz: f64, timeout_s: f64) -> Finding {
    let what = format!(
        "VESC {node} sends {rate_hz:.0} STATUS frames per second; the timeout is {timeout_s} s"
    );
    if rate_hz * timeout_s >= 2.0 {
        return Subject::Vesc.ok(what);
    }
    let remedy = "raise the rate of CAN status 1 in VESC Tool, or amplifier.device.status_lost_s";
    Subject::Vesc.warning(what, remedy)
}

fn current(node: u8, tenths: i16) -> Finding {
    let what = format!("VESC {node} gives {:.1} A", f64::from(tenths) * 0.1);
    if tenths.unsigned_abs() <= STRAY_CURRENT {
        return Subject::Vesc.ok(what);
    }
    let what = format!("{what}, without a command of this program");
    Subject::Vesc.warning(
        what,
        "disconnect the other source of commands before the run",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Ok, Warning};
    use std::time::Duration;

    fn severities(vesc: u8, count: u64, tenths: i16) -> Vec<Severity> {
        let settings = VescSettings {
            node: 23,
            current_limit_a: 1.0,
            status_timeout: Duration::from_millis(100),
            command_timeout: Duration::from_millis(20),
        };
        let traffic = BusTraffic {
            seconds: 0.5,
            vescs: [(vesc, (count, tenths))].into(),
            ..BusTraffic::default()
        };
        let findings = findings(&traffic, &settings);
        findings.iter().map(|finding| finding.severity).collect()
    }

    #[test]
    fn a_vesc_must_send_often_enough_and_give_no_current() {
        assert_eq!(severities(23, 25, -2), [Ok, Ok]);
        assert_eq!(severities(24, 25, 0), [Failure], "another VESC");
        assert_eq!(
            severities(23, 5, 0),
            [Warning, Ok],
            "10 per second: one missing frame is a timeout"
        );
        assert_eq!(severities(23, 25, -30), [Ok, Warning]);
    }
}
