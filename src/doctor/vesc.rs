//! A VESC: all that it says of itself without being asked.

use bench_hal::can::vesc::VescSettings;

use super::can_nodes::Heard;
use super::finding::Finding;

const SUBJECT: &str = "VESC";
/// More current than this without a command is told, in units of 0.1 A.
const STRAY: u16 = 2;

/// What was heard of the configured one.
pub fn findings(heard: &Heard, settings: &VescSettings) -> Vec<Finding> {
    let node = settings.node;
    let Some(&(count, tenths)) = heard.vescs.get(&node) else {
        return vec![Finding::failure(
            SUBJECT,
            format!("VESC {node} sent no STATUS within {} s", heard.seconds),
            "check its power and cable, its number, and that CAN status 1 is on in VESC Tool",
        )];
    };
    vec![
        rate(
            node,
            count,
            heard.seconds,
            settings.status_timeout.as_secs_f64(),
        ),
        current(node, tenths),
    ]
}

fn rate(node: u8, count: u64, seconds: f64, lost_s: f64) -> Finding {
    let rate_hz = count as f64 / seconds;
    let what = format!(
        "VESC {node} sends STATUS {rate_hz:.0} times a second; it counts as lost after {lost_s} s without"
    );
    if rate_hz * lost_s >= 2.0 {
        return Finding::ok(SUBJECT, what);
    }
    Finding::warning(
        SUBJECT,
        what,
        "raise the rate of CAN status 1 in VESC Tool, or amplifier.device.status_lost_s",
    )
}

fn current(node: u8, tenths: i16) -> Finding {
    let what = format!("VESC {node} gives {:.1} A", f64::from(tenths) * 0.1);
    if tenths.unsigned_abs() <= STRAY {
        return Finding::ok(SUBJECT, what);
    }
    Finding::warning(
        SUBJECT,
        format!("{what}, and this program commanded none"),
        "find out who drives it before you start",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Ok, Warning};
    use std::time::Duration;

    fn verdicts(vesc: u8, count: u64, tenths: i16) -> Vec<Severity> {
        let settings = VescSettings {
            node: 23,
            current_limit_a: 1.0,
            status_timeout: Duration::from_millis(100),
        };
        let heard = Heard {
            seconds: 0.5,
            vescs: [(vesc, (count, tenths))].into(),
            ..Heard::default()
        };
        findings(&heard, &settings)
            .iter()
            .map(|finding| finding.verdict)
            .collect()
    }

    #[test]
    fn a_vesc_must_be_heard_often_enough_and_give_no_current() {
        assert_eq!(verdicts(23, 25, -2), [Ok, Ok]);
        assert_eq!(verdicts(24, 25, 0), [Failure], "another one");
        assert_eq!(
            verdicts(23, 5, 0),
            [Warning, Ok],
            "10 a second, lost after one missing"
        );
        assert_eq!(verdicts(23, 25, -30), [Ok, Warning]);
    }
}
