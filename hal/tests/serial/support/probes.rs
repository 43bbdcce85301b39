//! The protocols that the driver is tested with, and motions of the stage.

use std::sync::Arc;

use bench_hal::serial::{Polling, Protocol, ascii, capancdt, optoncdt};

pub const RANGE_M: f64 = 200e-6;

pub fn capancdt() -> Arc<dyn Protocol> {
    capancdt_with(Polling::default())
}

pub fn capancdt_with(polling: Polling) -> Arc<dyn Protocol> {
    Arc::new(capancdt::Settings {
        polling,
        ..capancdt::Settings::new(RANGE_M)
    })
}

pub fn optoncdt() -> Arc<dyn Protocol> {
    Arc::new(optoncdt::Settings::new(RANGE_M))
}

/// Keyence LK-G with a range from 0 to [`RANGE_M`].
fn keyence_settings() -> ascii::Settings {
    ascii::Settings {
        lower_m: 0.0,
        upper_m: RANGE_M,
        ..ascii::Settings::keyence_lk_g(RANGE_M)
    }
}

pub fn keyence() -> Arc<dyn Protocol> {
    Arc::new(keyence_settings())
}

pub fn keyence_polled() -> Arc<dyn Protocol> {
    Arc::new(ascii::Settings {
        request: Some("M1\\r".into()),
        line: "M1,{value:8.4}".into(),
        ..keyence_settings()
    })
}

/// A polled text protocol whose steps are much shorter than a millisecond of [`ramp`].
pub fn fine_keyence_with(polling: Polling) -> Arc<dyn Protocol> {
    Arc::new(ascii::Settings {
        request: Some("M1\\r".into()),
        line: "M1,{value:10.5}".into(),
        unit_m: 1e-6,
        polling,
        ..keyence_settings()
    })
}

pub fn all() -> [Arc<dyn Protocol>; 4] {
    [capancdt(), optoncdt(), keyence(), keyence_polled()]
}

/// Whether a protocol is that of capaNCDT, the only one with checksum and counter.
pub fn is_capancdt(protocol: &Arc<dyn Protocol>) -> bool {
    format!("{protocol:?}") == format!("{:?}", capancdt())
}

/// A constant position of 60 um.
pub fn still(_now_ns: u64) -> f64 {
    60e-6
}

/// Moves through the range in 100 s, so the position gives the time of the measurement.
pub fn ramp(now_ns: u64) -> f64 {
    now_ns as f64 * 1e-9 / 100.0 * RANGE_M
}

/// Agreement within half of the coarsest step: a digit is 0.1 um; 200 um * 102 / 65520 / 100 (optoNCDT) is 3.1 nm.
pub fn is_near(position_m: f64, expected_m: f64) -> bool {
    (position_m - expected_m).abs() <= 0.0501e-6
}
