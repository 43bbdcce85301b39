//! The load of the bus: frame lengths with the worst-case bit stuffing, and the traffic of a set-point exchange.
//!
//! A base frame of n bytes has 34 + 8n bits that may be stuffed (start, identifier, RTR, IDE, r0, length, data, CRC)
//! and 13 that may not (CRC delimiter, ACK, ACK delimiter, end of frame, interframe space). In the worst case stuffing adds one
//! bit after five bits, then one after every four, because a stuff bit may begin the next run (Davis, Burns, Bril, Lukkien 2007, eq. 2):
//!
//! ```text
//! base       47 + 8n + floor((33 + 8n) / 4)        0 bytes: 55 bits, 4 bytes: 95 bits, 8 bytes: 135 bits
//! extended   67 + 8n + floor((53 + 8n) / 4)
//! ```
//!
//! At 1 Mbit/s a bit takes 1 us, so SYNC takes 55 us and a PDO of four bytes 95 us: an exchange of SYNC, set-point and
//! status takes 245 us and fits 4.1 kHz, a set-point alone 10.5 kHz.

use thiserror::Error;

/// Bits of a base frame of `bytes` bytes with worst-case stuffing and the interframe space.
pub const fn base_frame_bits(bytes: u32) -> u32 {
    47 + 8 * bytes + (33 + 8 * bytes) / 4
}

/// Bits of an extended frame of `bytes` bytes with worst-case stuffing and the interframe space.
pub const fn extended_frame_bits(bytes: u32) -> u32 {
    67 + 8 * bytes + (53 + 8 * bytes) / 4
}

/// Bits of SYNC.
const SYNC_BITS: u32 = base_frame_bits(0);
/// Bits of a set-point (controlword, target) or a status (statusword, actual).
const PDO_BITS: u32 = base_frame_bits(4);
/// Bits of a heartbeat.
const HEARTBEAT_BITS: u32 = base_frame_bits(1);

/// How set-points are exchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exchange {
    /// A set-point in each tick, which takes effect when the drive receives it. Status frames are independent of the ticks.
    Asynchronous {
        /// Largest number of status frames per second.
        status_hz: f64,
    },
    /// A set-point and a SYNC in each tick. The set-point takes effect at the SYNC; the drive answers every n-th SYNC.
    Synchronous {
        /// Number of SYNCs per status frame, 1 to 240.
        status_every: u8,
    },
}

/// The traffic of a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traffic {
    /// Bit rate, in bit/s.
    pub bit_rate: u32,
    /// Set-points per second.
    pub rate_hz: f64,
    /// The exchange of the set-points.
    pub exchange: Exchange,
    /// Heartbeats per second of both sides together.
    pub heartbeat_hz: f64,
    /// Largest permitted load as a fraction of the bit rate. The rest is reserved for SDO, emergencies and repeated frames.
    pub load_limit: f64,
}

/// A configuration that the bus cannot carry.
#[derive(Clone, Debug, Error, PartialEq)]
#[error(
    "{what} at {rate_hz:.0} Hz needs {frames_us:.0} us of the {period_us:.0} us of a tick and loads the bus of {bit_rate} bit/s to \
     {load_percent:.1} %, above the limit of {limit_percent:.0} %, which allows {highest_hz:.0} Hz; {remedy}"
)]
pub struct BudgetError {
    /// Description of the exchange.
    pub what: &'static str,
    /// Configured set-points per second.
    pub rate_hz: f64,
    /// Time of the frames of one tick, in microseconds.
    pub frames_us: f64,
    /// Time of a tick, in microseconds.
    pub period_us: f64,
    /// Bit rate, in bit/s.
    pub bit_rate: u32,
    /// Resulting load.
    pub load_percent: f64,
    /// Permitted load.
    pub limit_percent: f64,
    /// The highest rate within the limit.
    pub highest_hz: f64,
    /// What to change.
    pub remedy: &'static str,
}

impl Traffic {
    /// Mean number of bits per tick.
    fn bits_per_tick(&self) -> f64 {
        match self.exchange {
            Exchange::Asynchronous { .. } => f64::from(PDO_BITS),
            Exchange::Synchronous { status_every } => {
                f64::from(SYNC_BITS + PDO_BITS)
                    + f64::from(PDO_BITS) / f64::from(status_every.max(1))
            }
        }
    }

    /// Bits per second that do not depend on the rate.
    fn fixed_bits_per_s(&self) -> f64 {
        let status_hz = match self.exchange {
            Exchange::Asynchronous { status_hz } => status_hz,
            Exchange::Synchronous { .. } => 0.0,
        };
        status_hz * f64::from(PDO_BITS) + self.heartbeat_hz * f64::from(HEARTBEAT_BITS)
    }

    /// The worst-case load as a fraction of the bit rate.
    pub fn load(&self) -> f64 {
        (self.rate_hz * self.bits_per_tick() + self.fixed_bits_per_s()) / f64::from(self.bit_rate)
    }

    /// The highest rate within the limit, in hertz; 0 if the other traffic alone exceeds the limit.
    pub fn highest_rate_hz(&self) -> f64 {
        let left = self.load_limit * f64::from(self.bit_rate) - self.fixed_bits_per_s();
        (left / self.bits_per_tick()).max(0.0)
    }

    /// The load, or an error with all figures if it exceeds the limit or is not a number.
    pub fn check(&self) -> Result<f64, BudgetError> {
        let load = self.load();
        if load <= self.load_limit {
            Ok(load)
        } else {
            Err(self.refusal(load))
        }
    }

    fn refusal(&self, load: f64) -> BudgetError {
        let (what, remedy) = match self.exchange {
            Exchange::Asynchronous { .. } => (
                "an asynchronous set-point",
                "lower the rate or the status rate, or raise the bit rate",
            ),
            Exchange::Synchronous { .. } => (
                "an exchange with SYNC",
                "use asynchronous set-points, request the status less often, or lower the rate",
            ),
        };
        BudgetError {
            what,
            rate_hz: self.rate_hz,
            frames_us: 1e6 * self.bits_per_tick() / f64::from(self.bit_rate),
            period_us: 1e6 / self.rate_hz,
            bit_rate: self.bit_rate,
            load_percent: 100.0 * load,
            limit_percent: 100.0 * self.load_limit,
            highest_hz: self.highest_rate_hz(),
            remedy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worst stuffing by counting: start with five equal bits; each stuff bit is the first of the next five.
    fn stuffed(bits: u32) -> u32 {
        let (mut run, mut inserted) = (0, 0);
        for _ in 0..bits {
            run += 1;
            if run == 5 {
                inserted += 1;
                run = 1;
            }
        }
        // A stuff bit after the very last bit of the stuffed part is sent as well.
        bits + inserted
    }

    #[test]
    fn formulas_match_the_counted_bits() {
        for bytes in 0..=8 {
            assert_eq!(base_frame_bits(bytes), stuffed(34 + 8 * bytes) + 13);
            assert_eq!(extended_frame_bits(bytes), stuffed(54 + 8 * bytes) + 13);
        }
        assert_eq!(
            (base_frame_bits(0), base_frame_bits(4), base_frame_bits(8)),
            (55, 95, 135)
        );
        assert_eq!(extended_frame_bits(8), 160);
    }

    fn traffic(rate_hz: f64, exchange: Exchange) -> Traffic {
        Traffic {
            bit_rate: 1_000_000,
            rate_hz,
            exchange,
            heartbeat_hz: 0.0,
            load_limit: 1.0,
        }
    }

    #[test]
    fn a_full_exchange_fits_4_1_khz_and_a_set_point_alone_10_khz() {
        // 1 / (55 + 95 + 95) us = 4081.6 Hz; 1 / 95 us = 10526 Hz.
        let full = traffic(4000.0, Exchange::Synchronous { status_every: 1 });
        assert!((full.highest_rate_hz() - 1e6 / 245.0).abs() < 1e-6);
        assert!((full.load() - 0.98).abs() < 1e-12);
        let alone = traffic(10_000.0, Exchange::Asynchronous { status_hz: 0.0 });
        assert!((alone.highest_rate_hz() - 1e6 / 95.0).abs() < 1e-6);
        assert!((alone.load() - 0.95).abs() < 1e-12);
    }

    #[test]
    fn rejects_excessive_load_with_the_figures() {
        let refused = traffic(5000.0, Exchange::Synchronous { status_every: 1 })
            .check()
            .unwrap_err();
        assert_eq!(
            refused.to_string(),
            "an exchange with SYNC at 5000 Hz needs 245 us of the 200 us of a tick and loads the bus of 1000000 bit/s to \
             122.5 %, above the limit of 100 %, which allows 4082 Hz; use asynchronous set-points, request the status less often, or \
             lower the rate"
        );
        assert!(
            traffic(5000.0, Exchange::Asynchronous { status_hz: 1000.0 })
                .check()
                .is_ok()
        );
        assert!(
            traffic(f64::NAN, Exchange::Asynchronous { status_hz: 0.0 })
                .check()
                .is_err()
        );
    }

    #[test]
    fn load_includes_status_and_heartbeats() {
        // 1000 * (55 + 95 + 95 / 5) + 20 * 65 bits; 65 = 47 + 8 + floor(41 / 4).
        let mut five = traffic(1000.0, Exchange::Synchronous { status_every: 5 });
        five.heartbeat_hz = 20.0;
        assert!((five.load() - (169_000.0 + 1300.0) / 1e6).abs() < 1e-12);
        // (5000 + 1000) * 95 bits on 500 kbit/s: 114 %.
        let mut slow = traffic(5000.0, Exchange::Asynchronous { status_hz: 1000.0 });
        slow.bit_rate = 500_000;
        assert!((slow.load() - 1.14).abs() < 1e-12);
        assert!(slow.check().is_err());
    }
}
