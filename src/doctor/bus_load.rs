//! The load of the CAN bus by the configuration, with worst-case bit stuffing.

use bench_hal::can::budget::{Exchange, extended_frame_bits};
use bench_hal::can::drive::DriveSettings;
use serde::Serialize;

use super::finding::{Finding, Subject};

/// STATUS frames per second of a VESC, as VESC Tool sets it.
const VESC_STATUS_HZ: f64 = 50.0;
/// Limit of the bus load with a VESC.
const VESC_LOAD_LIMIT: f64 = 0.8;

/// The bus load by the configuration.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BusLoad {
    /// Worst-case load, as a ratio of the bit rate.
    pub load: f64,
    /// The largest load that is accepted.
    pub load_limit: f64,
    /// The servo rate at the limit, in hertz.
    pub highest_rate_hz: f64,
}

/// The load of a CANopen drive. The configuration refuses a load above the limit.
pub fn of_drive(settings: &DriveSettings) -> (BusLoad, Finding) {
    let traffic = settings.traffic();
    let load = BusLoad {
        load: traffic.load(),
        load_limit: settings.load_limit,
        highest_rate_hz: traffic.highest_rate_hz(),
    };
    let exchange = match settings.exchange {
        Exchange::Asynchronous { status_hz } => {
            format!("asynchronous set-points, {status_hz} status frames per second")
        }
        Exchange::Synchronous { status_every } => {
            format!("set-points with SYNC, one status frame per {status_every} SYNCs")
        }
    };
    let exchange = format!("{exchange}, {} Hz", settings.rate_hz);
    let finding = judge(&load, &exchange, settings.bit_rate);
    (load, finding)
}

/// The load of a VESC: a set-point of four bytes per tick, and STATUS frames of eight bytes.
pub fn of_vesc(rate_hz: f64, bit_rate: u32) -> (BusLoad, Finding) {
    let set_point_bits = f64::from(extended_frame_bits(4));
    let status_bits_per_s = VESC_STATUS_HZ * f64::from(extended_frame_bits(8));
    let bits_per_s = f64::from(bit_rate);
    let available = VESC_LOAD_LIMIT * bits_per_s - status_bits_per_s;
    let load = BusLoad {
        load: (rate_hz * set_point_bits + status_bits_per_s) / bits_per_s,
        load_limit: VESC_LOAD_LIMIT,
        highest_rate_hz: (available / set_point_bits).max(0.0),
    };
    let finding = judge(&load, &format!("set-points at {rate_hz} Hz"), bit_rate);
    (load, finding)
}

fn judge(load: &BusLoad, exchange: &str, bit_rate: u32) -> Finding {
    let what = format!(
        "{exchange}: at most {:.1} % of {bit_rate} bit/s; the limit of {:.0} % allows {:.0} Hz",
        100.0 * load.load,
        100.0 * load.load_limit,
        load.highest_rate_hz
    );
    let remedy = "lower loop.rate_hz or raise the bit rate of the bus";
    if load.load > 1.0 {
        Subject::BusLoad.failure(what, remedy)
    } else if load.load > load.load_limit {
        Subject::BusLoad.warning(what, remedy)
    } else {
        Subject::BusLoad.ok(what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    #[test]
    fn a_drive_at_1_khz_with_sync_and_100_heartbeats_a_second_loads_1_mbit_to_20_percent() {
        // SYNC 55, set-point 95, status 95/2 bits per tick; 2 * 50 heartbeats of 65 bits: 197500 + 6500 bits/s.
        let exchange = Exchange::Synchronous { status_every: 2 };
        let (load, finding) = of_drive(&DriveSettings {
            exchange,
            ..DriveSettings::default()
        });
        assert!((load.load - 0.204).abs() < 1e-9, "{load:?}");
        assert_eq!(finding.severity, Severity::Ok);
        assert!(
            finding.what.contains("20.4 % of 1000000 bit/s"),
            "{}",
            finding.what
        );
    }

    #[test]
    fn a_vesc_beyond_the_capacity_of_the_bus_is_a_failure() {
        // 67 + 32 + floor(85 / 4) = 120 bits per set-point, 160 bits per STATUS: 5 kHz on 500 kbit/s are 121.6 %.
        let (load, finding) = of_vesc(5000.0, 500_000);
        assert!((load.load - 1.216).abs() < 1e-9, "{load:?}");
        assert_eq!(finding.severity, Severity::Failure);
        assert_eq!(of_vesc(3500.0, 500_000).1.severity, Severity::Warning);
        assert_eq!(of_vesc(1000.0, 500_000).1.severity, Severity::Ok);
    }
}
