//! Whether a certificate belongs to the rig of today: age, rate, settings, devices, calibration, load, signs.

use std::time::{Duration, SystemTime};

use super::condition::{Checked, Subject};
use crate::certificate::{
    Certificate, CertificateError, CertifiedLoad, Digests, SignAgreement, SignCheck, sha256,
};
use crate::plan::PlanError;
use bench_base::decimal::Decimal;
use bench_config::Config;
use bench_control::ControllerText;
use bench_plant::ModalModel;

/// Relative difference of two equal numbers after a conversion of units.
const ROUNDING: f64 = 1e-9;
/// A clock may be behind that of the computer of the chirp by as much, in seconds.
const CLOCK_TOLERANCE_S: f64 = 60.0;
const SECONDS_PER_DAY: f64 = 86_400.0;
/// Shown characters of a date: up to the minutes.
const SHOWN_DATE: usize = 16;
/// Shown digits of a digest.
const SHOWN_DIGITS: usize = 12;

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

/// What a certificate is compared with.
pub(super) struct Today<'a> {
    pub config: &'a Config,
    pub controller: &'a ControllerText,
    /// Devices and calibration, if they are known.
    pub connected: Option<&'a Connected<'a>>,
    pub now: SystemTime,
}

/// All conditions on the rig of today.
///
/// # Errors
/// When the settings cannot be written as TOML, or the model of the plant cannot be analysed.
pub(super) fn conditions(
    certificate: &Certificate,
    today: &Today<'_>,
) -> Result<Vec<Checked>, PlanError> {
    let config = today.config;
    let digests = Digests::of(config, None)?;
    let mut checked = vec![age(certificate, today.now), rate(certificate, config)];
    checked.extend(settings(&certificate.digests, &digests));
    checked.extend(devices(certificate, today.connected));
    checked.push(calibration(certificate, today.connected));
    checked.extend(load(certificate, config));
    checked.push(signs(certificate, config)?);
    checked.push(Checked::not_compared(
        Subject::Plant,
        shown(&certificate.digests.plant),
        shown(&digests.plant),
    ));
    checked.push(controller(&certificate.digests, today.controller));
    Ok(checked)
}

fn age(certificate: &Certificate, now: SystemTime) -> Checked {
    let made = &certificate.made;
    let date: String = made.chars().take(SHOWN_DATE).collect();
    let Ok(time) = humantime::parse_rfc3339(made) else {
        let damaged = CertificateError::Damaged {
            file: certificate.recording.clone(),
            why: format!("its date {made:?} is not a date (RFC 3339)"),
        };
        return Checked::new(Subject::Age, date, "unknown", Some(damaged));
    };
    let ahead = time.duration_since(now).unwrap_or(Duration::ZERO);
    if ahead.as_secs_f64() > CLOCK_TOLERANCE_S {
        let future = CertificateError::Future { made: made.clone() };
        return Checked::new(Subject::Age, date, "in the future", Some(future));
    }
    let age = now.duration_since(time).unwrap_or(Duration::ZERO);
    let (age_days, valid_days) = (age.as_secs_f64() / SECONDS_PER_DAY, certificate.valid_days);
    // Written this way, a number of days that is not a number is stale.
    let is_valid = age_days <= valid_days;
    let stale = (!is_valid).then_some(CertificateError::Stale {
        age_days,
        valid_days,
    });
    let age = format!("{:.1} of {valid_days} days", Decimal(age_days));
    Checked::new(Subject::Age, date, age, stale)
}

fn rate(certificate: &Certificate, config: &Config) -> Checked {
    let (certified, servo) = (&certificate.servo, &config.servo);
    let (certified_periods, periods) = (
        certified.computing_delay_periods,
        servo.computing_delay_periods,
    );
    let is_equal = is_near(certified.rate_hz, servo.rate_hz) && certified_periods == periods;
    let other = (!is_equal).then_some(CertificateError::OtherRate {
        certified_hz: certified.rate_hz,
        certified_periods,
        rate_hz: servo.rate_hz,
        periods,
    });
    let text = |rate_hz: f64, periods: u32| format!("{rate_hz} Hz, delay {periods}");
    Checked::new(
        Subject::Loop,
        text(certified.rate_hz, certified_periods),
        text(servo.rate_hz, periods),
        other,
    )
}

/// The tables of the devices. The model of the plant may be corrected after the chirp.
fn settings(certified: &Digests, today: &Digests) -> [Checked; 3] {
    let tables = [
        (
            Subject::MotorSettings,
            "motor",
            &certified.motor,
            &today.motor,
        ),
        (
            Subject::AmplifierSettings,
            "amplifier",
            &certified.amplifier,
            &today.amplifier,
        ),
        (
            Subject::ProbeSettings,
            "probe",
            &certified.probe,
            &today.probe,
        ),
    ];
    tables.map(|(subject, table, certified, today)| {
        let other = (certified != today).then_some(CertificateError::OtherSettings { table });
        Checked::new(subject, shown(certified), shown(today), other)
    })
}

fn devices(certificate: &Certificate, connected: Option<&Connected<'_>>) -> [Checked; 2] {
    let certified = &certificate.devices;
    let pairs = [
        (
            Subject::Amplifier,
            &certified.amplifier,
            connected.map(|connected| connected.amplifier),
        ),
        (
            Subject::Probe,
            &certified.probe,
            connected.map(|connected| connected.probe),
        ),
    ];
    pairs.map(|(subject, certified, connected)| {
        let Some(connected) = connected else {
            return Checked::not_compared(subject, certified, "not open");
        };
        let other = (certified != connected).then(|| CertificateError::OtherDevice {
            kind: subject.name(),
            certified: certified.clone(),
            connected: connected.into(),
        });
        Checked::new(subject, certified, connected, other)
    })
}

fn calibration(certificate: &Certificate, connected: Option<&Connected<'_>>) -> Checked {
    let certified = certificate.digests.calibration.as_deref();
    let text = |digest: Option<&str>| digest.map_or("none".into(), shown);
    let Some(connected) = connected else {
        return Checked::not_compared(Subject::Calibration, text(certified), "not open");
    };
    let today = connected.calibration.as_deref().map(sha256);
    let is_other = certified != today.as_deref();
    let other = is_other.then_some(CertificateError::OtherCalibration);
    Checked::new(
        Subject::Calibration,
        text(certified),
        text(today.as_deref()),
        other,
    )
}

fn load(certificate: &Certificate, config: &Config) -> [Checked; 2] {
    let (certified, today) = (&certificate.load, CertifiedLoad::of(config));
    let pairs = [
        (
            Subject::OperatingPoint,
            "plant.operating_point_m",
            certified.operating_point_m,
            today.operating_point_m,
        ),
        (
            Subject::MassAsymmetry,
            "plant.mass_asymmetry",
            certified.mass_asymmetry,
            today.mass_asymmetry,
        ),
    ];
    pairs.map(|(subject, quantity, certified, today)| {
        let is_same = is_same(certified, today);
        let (certified, configured) = (text(certified), text(today));
        let other = (!is_same).then(|| CertificateError::OtherLoad {
            quantity,
            certified: certified.clone(),
            configured: configured.clone(),
        });
        Checked::new(subject, certified, configured, other)
    })
}

fn signs(certificate: &Certificate, config: &Config) -> Result<Checked, PlanError> {
    let model = ModalModel::of(&bench_plant::build(&config.plant)?)?;
    let modes: Vec<_> = certificate.modes.iter().map(Into::into).collect();
    let band_hz = (certificate.frf.from_hz, certificate.frf.to_hz);
    let check = SignCheck::of(&modes, &model, band_hz);
    let (measured, model) = (check.measured, check.model);
    Ok(match check.agreement {
        SignAgreement::Incomplete => Checked::not_compared(Subject::Signs, measured, model),
        SignAgreement::Agree => Checked::new(Subject::Signs, measured, model, None),
        SignAgreement::Differ => {
            let other = CertificateError::Signs {
                measured: measured.clone(),
                model: model.clone(),
            };
            Checked::new(Subject::Signs, measured, model, Some(other))
        }
    })
}

/// Another controller may close the loop: its margins are computed from the response of the certificate.
fn controller(certified: &Digests, today: &ControllerText) -> Checked {
    let certified = certified.controller.as_deref();
    Checked::not_compared(
        Subject::Controller,
        certified.map_or("not recorded".into(), shown),
        shown(&sha256(&today.text)),
    )
}

/// The first digits of a digest.
fn shown(digest: &str) -> String {
    digest.chars().take(SHOWN_DIGITS).collect()
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
