//! What the configuration puts on the CAN bus, by the budget: frames with the worst bit stuffing.

use bench_hal::can::budget::{Exchange, extended_frame_bits};
use bench_hal::can::drive::DriveSettings;
use serde::Serialize;

use super::finding::Finding;

const SUBJECT: &str = "bus load";
/// STATUS frames of a VESC in a second, as VESC Tool has it.
const VESC_STATUS_HZ: f64 = 50.0;

/// What the configuration puts on the bus.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BusLoad {
    /// Part of the bus's bits, at worst.
    pub load: f64,
    /// The largest load that is accepted.
    pub load_limit: f64,
    /// The servo rate that the limit would allow, in hertz.
    pub highest_rate_hz: f64,
}

/// Of a CANopen drive; a load above its limit was refused with the configuration.
pub fn of_drive(settings: &DriveSettings) -> (BusLoad, Finding) {
    let traffic = settings.traffic();
    let load = BusLoad {
        load: traffic.load(),
        load_limit: settings.load_limit,
        highest_rate_hz: traffic.highest_rate_hz(),
    };
    let exchange = match settings.exchange {
        Exchange::Asynchronous { status_hz } => {
            format!("asynchronous set-points, {status_hz} status frames a second")
        }
        Exchange::Synchronous { status_every } => {
            format!("set-points with SYNC, a status frame after every {status_every} SYNCs")
        }
    };
    let finding = judge(
        &load,
        &format!("{exchange}, {} Hz", settings.rate_hz),
        settings.bit_rate,
    );
    (load, finding)
}

/// Of a VESC: a set-point of four bytes each tick, and its STATUS of eight.
pub fn of_vesc(rate_hz: f64, bit_rate: u32) -> (BusLoad, Finding) {
    let (set_point, status) = (
        f64::from(extended_frame_bits(4)),
        VESC_STATUS_HZ * f64::from(extended_frame_bits(8)),
    );
    let (bits, load_limit) = (f64::from(bit_rate), 0.8);
    let load = (rate_hz * set_point + status) / bits;
    let load = BusLoad {
        load,
        load_limit,
        highest_rate_hz: ((load_limit * bits - status) / set_point).max(0.0),
    };
    let finding = judge(&load, &format!("set-points at {rate_hz} Hz"), bit_rate);
    (load, finding)
}

fn judge(load: &BusLoad, exchange: &str, bit_rate: u32) -> Finding {
    let what = format!(
        "{exchange}: {:.1} % of {bit_rate} bit/s at worst; {:.0} % is the limit, which allows {:.0} Hz",
        100.0 * load.load,
        100.0 * load.load_limit,
        load.highest_rate_hz
    );
    match load.load {
        load if load > 1.0 => Finding::failure(
            SUBJECT,
            what,
            "lower loop.rate_hz or raise the bit rate of the bus",
        ),
        l if l > load.load_limit => Finding::warning(
            SUBJECT,
            what,
            "lower loop.rate_hz or raise the bit rate of the bus",
        ),
        _ => Finding::ok(SUBJECT, what),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    #[test]
    fn a_drive_at_1_khz_with_sync_and_100_heartbeats_a_second_loads_1_mbit_to_20_percent() {
        // SYNC 55, set-point 95, status 95/2 bits a tick; 2 * 50 heartbeats of 65 bits: 197500 + 6500 bits/s.
        let exchange = Exchange::Synchronous { status_every: 2 };
        let (load, finding) = of_drive(&DriveSettings {
            exchange,
            ..DriveSettings::default()
        });
        assert!((load.load - 0.204).abs() < 1e-9, "{load:?}");
        assert_eq!(finding.verdict, Severity::Ok);
        assert!(
            finding.what.contains("20.4 % of 1000000 bit/s"),
            "{}",
            finding.what
        );
    }

    #[test]
    fn a_vesc_that_the_bus_cannot_carry_is_found() {
        // 67 + 32 + floor(85 / 4) = 120 bits a set-point, 160 a STATUS: 5 kHz on 500 kbit/s are 121.6 %.
        let (load, finding) = of_vesc(5000.0, 500_000);
        assert!((load.load - 1.216).abs() < 1e-9, "{load:?}");
        assert_eq!(finding.verdict, Severity::Failure);
        assert_eq!(of_vesc(3500.0, 500_000).1.verdict, Severity::Warning);
        assert_eq!(of_vesc(1000.0, 500_000).1.verdict, Severity::Ok);
    }
}
