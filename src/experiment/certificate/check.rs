//! Whether a certificate belongs to the rig of today: age, rate, settings, devices, calibration, load, signs.

use std::time::{Duration, SystemTime};

use super::error::CertificateError;
use super::file::{Certificate, CertifiedLoad, Digests, sha256};
use super::signs::SignCheck;
use crate::config::Config;
use crate::experiment::plan_error::PlanError;
use crate::model::plant::{self, ModalModel};

/// Relative difference of two equal numbers after a conversion of units.
const ROUNDING: f64 = 1e-9;
/// A clock may be behind that of the computer of the chirp by as much, in seconds.
const CLOCK_TOLERANCE_S: f64 = 60.0;
const SECONDS_PER_DAY: f64 = 86_400.0;

/// The devices that are connected, and the calibration in use.
#[derive(Clone, Debug)]
pub(super) struct Connected<'a> {
    /// Identity of the amplifier.
    pub amplifier: &'a str,
    /// Identity of the probe.
    pub probe: &'a str,
    /// The calibration as TOML, if one is in use.
    pub calibration: Option<String>,
}

/// The defects of a certificate for the configured rig. Devices and calibration are compared if they are known.
///
/// # Errors
/// When the settings cannot be written as TOML, or the model of the plant cannot be analysed.
pub(super) fn defects(
    certificate: &Certificate,
    config: &Config,
    connected: Option<&Connected<'_>>,
    now: SystemTime,
) -> Result<Vec<CertificateError>, PlanError> {
    let found = [
        age(certificate, now),
        rate(certificate, config),
        settings(certificate, config)?,
        connected.and_then(|connected| devices(certificate, connected)),
        connected.and_then(|connected| calibration(certificate, connected)),
        load(certificate, config),
        signs(certificate, config)?,
    ];
    Ok(found.into_iter().flatten().collect())
}

fn age(certificate: &Certificate, now: SystemTime) -> Option<CertificateError> {
    let made = &certificate.made;
    let Ok(time) = humantime::parse_rfc3339(made) else {
        return Some(CertificateError::Damaged {
            file: certificate.recording.clone(),
            why: format!("its date {made:?} is not a date (RFC 3339)"),
        });
    };
    let ahead = time.duration_since(now).unwrap_or(Duration::ZERO);
    if ahead.as_secs_f64() > CLOCK_TOLERANCE_S {
        return Some(CertificateError::Future { made: made.clone() });
    }
    let age = now.duration_since(time).unwrap_or(Duration::ZERO);
    let (age_days, valid_days) = (age.as_secs_f64() / SECONDS_PER_DAY, certificate.valid_days);
    // Written this way, a number of days that is not a number is stale.
    let is_valid = age_days <= valid_days;
    (!is_valid).then_some(CertificateError::Stale {
        age_days,
        valid_days,
    })
}

fn rate(certificate: &Certificate, config: &Config) -> Option<CertificateError> {
    let (certified, servo) = (&certificate.servo, &config.servo);
    let is_equal = is_near(certified.rate_hz, servo.rate_hz)
        && certified.computing_delay_periods == servo.computing_delay_periods;
    (!is_equal).then_some(CertificateError::OtherRate {
        certified_hz: certified.rate_hz,
        certified_periods: certified.computing_delay_periods,
        rate_hz: servo.rate_hz,
        periods: servo.computing_delay_periods,
    })
}

/// The first table of the devices that differs. The model of the plant may be corrected after the chirp.
fn settings(
    certificate: &Certificate,
    config: &Config,
) -> Result<Option<CertificateError>, PlanError> {
    let (certified, today) = (&certificate.digests, Digests::of(config, None)?);
    let tables = [
        ("motor", &certified.motor, &today.motor),
        ("amplifier", &certified.amplifier, &today.amplifier),
        ("probe", &certified.probe, &today.probe),
    ];
    let mut tables = tables.into_iter();
    let other = tables.find(|(_, certified, today)| certified != today);
    Ok(other.map(|(table, ..)| CertificateError::OtherSettings { table }))
}

fn devices(certificate: &Certificate, connected: &Connected<'_>) -> Option<CertificateError> {
    let certified = &certificate.devices;
    let pairs = [
        ("amplifier", &certified.amplifier, connected.amplifier),
        ("probe", &certified.probe, connected.probe),
    ];
    let mut pairs = pairs.into_iter();
    let other = pairs.find(|(_, certified, connected)| certified != connected);
    other.map(
        |(kind, certified, connected)| CertificateError::OtherDevice {
            kind,
            certified: certified.clone(),
            connected: connected.into(),
        },
    )
}

fn calibration(certificate: &Certificate, connected: &Connected<'_>) -> Option<CertificateError> {
    let today = connected.calibration.as_deref().map(sha256);
    (certificate.digests.calibration != today).then_some(CertificateError::OtherCalibration)
}

fn load(certificate: &Certificate, config: &Config) -> Option<CertificateError> {
    let (certified, today) = (&certificate.load, CertifiedLoad::of(config));
    let pairs = [
        (
            "plant.operating_point_m",
            certified.operating_point_m,
            today.operating_point_m,
        ),
        (
            "plant.mass_asymmetry",
            certified.mass_asymmetry,
            today.mass_asymmetry,
        ),
    ];
    let mut pairs = pairs.into_iter();
    let other = pairs.find(|(_, certified, today)| !is_same(*certified, *today));
    other.map(|(quantity, certified, today)| CertificateError::OtherLoad {
        quantity,
        certified: text(certified),
        configured: text(today),
    })
}

fn signs(
    certificate: &Certificate,
    config: &Config,
) -> Result<Option<CertificateError>, PlanError> {
    let model = ModalModel::of(&plant::build(&config.plant)?)?;
    let modes: Vec<_> = certificate.modes.iter().map(Into::into).collect();
    let band_hz = (certificate.frf.from_hz, certificate.frf.to_hz);
    let check = SignCheck::of(&modes, &model, band_hz);
    let differ = check.differ();
    Ok(differ.then_some(CertificateError::Signs {
        measured: check.measured,
        model: check.model,
    }))
}

fn is_same(certified: Option<f64>, today: Option<f64>) -> bool {
    match (certified, today) {
        (Some(certified), Some(today)) => is_near(certified, today),
        (None, None) => true,
        _ => false,
    }
}

fn is_near(a: f64, b: f64) -> bool {
    (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
}

fn text(value: Option<f64>) -> String {
    value.map_or("not a setting of the model".into(), |value| {
        value.to_string()
    })
}
