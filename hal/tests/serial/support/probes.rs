//! The probes that the driver is tested with, and the stages they look at.

use bench_hal::serial::{Protocol, ascii, capancdt, optoncdt};

pub const RANGE_M: f64 = 200e-6;

pub fn capancdt() -> Protocol {
    Protocol::Capancdt(capancdt::Settings::new(RANGE_M))
}

pub fn optoncdt() -> Protocol {
    Protocol::Optoncdt(optoncdt::Settings::new(RANGE_M))
}

pub fn keyence() -> Protocol {
    Protocol::Ascii(ascii::Settings {
        lower_m: 0.0,
        upper_m: RANGE_M,
        ..ascii::Settings::keyence_lk_g(RANGE_M)
    })
}

pub fn keyence_polled() -> Protocol {
    let settings = ascii::Settings::keyence_lk_g(RANGE_M);
    let (request, line) = (Some("M1\\r".into()), "M1,{value:8.4}".into());
    Protocol::Ascii(ascii::Settings {
        request,
        line,
        lower_m: 0.0,
        upper_m: RANGE_M,
        ..settings
    })
}

pub fn all() -> [Protocol; 4] {
    [capancdt(), optoncdt(), keyence(), keyence_polled()]
}

/// Held still at 60 um.
pub fn still(_now_ns: u64) -> f64 {
    60e-6
}

/// Crosses the range in a hundred seconds: the position tells when it was measured.
pub fn ramp(now_ns: u64) -> f64 {
    now_ns as f64 * 1e-9 / 100.0 * RANGE_M
}

/// Within half of the coarsest step: a digit of 0.1 um, or 200 um * 102 / 65520 / 100 of the optoNCDT, is 3.1 nm.
pub fn is_near(position_m: f64, expected_m: f64) -> bool {
    (position_m - expected_m).abs() <= 0.0501e-6
}
