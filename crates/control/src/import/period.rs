//! The time domain of a controller in a file.

use super::super::transfer::Domain;
use super::form::get;
use super::names;
use super::value::Value;

/// A rate that differs from an integer by less than this ratio was an integer before 1/Ts was rounded.
const RATE_ROUNDING: f64 = 1e-9;
/// Limits of `rate_hz` in a controller file.
const RATE_LIMITS_HZ: std::ops::RangeInclusive<f64> = 1.0..=100_000.0;

/// What a file says about its sampling period.
enum Period {
    /// Continuous, or discrete with a rate.
    Known(Domain),
    /// Discrete with a period that is not known: -1 in MATLAB, `dt = True` in python-control. With the name and the value.
    Discrete(String),
    /// Nothing: also `dt = None` in python-control.
    Absent,
}

/// The time domain: of the file, or of the option if the file has no sampling period. Periods are in units of `time_unit_s`.
///
/// # Errors
/// What is wrong, and the remedy.
pub(super) fn domain(
    fields: &[(String, Value)],
    shared: &[(String, Value)],
    time_unit_s: f64,
    option: Option<Domain>,
) -> Result<Domain, String> {
    match (period(fields, shared, time_unit_s)?, option) {
        (Period::Known(in_file), None) => Ok(in_file),
        (Period::Known(in_file), Some(option)) if same(in_file, option) => Ok(in_file),
        (Period::Known(in_file), Some(_)) => Err(format!(
            "it is {} by its sampling period; leave out --rate and --continuous",
            description(in_file)
        )),
        (Period::Discrete(_), Some(option @ Domain::Discrete { .. })) => Ok(option),
        (Period::Discrete(what), _) => Err(format!(
            "it is discrete, but {what} does not state the sampling period; add --rate HZ (--continuous does not apply)"
        )),
        (Period::Absent, Some(option)) => Ok(option),
        (Period::Absent, None) => Err("it has no sampling period Ts; add --continuous, or --rate HZ if the controller is discrete".into()),
    }
}

fn same(a: Domain, b: Domain) -> bool {
    match (a, b) {
        (Domain::Discrete { rate_hz: a }, Domain::Discrete { rate_hz: b }) => {
            (a / b - 1.0).abs() < RATE_ROUNDING
        }
        (a, b) => a == b,
    }
}

fn description(domain: Domain) -> String {
    match domain {
        Domain::Continuous => "continuous".into(),
        Domain::Discrete { rate_hz } => format!("discrete at {rate_hz} Hz"),
    }
}

fn period(
    fields: &[(String, Value)],
    shared: &[(String, Value)],
    time_unit_s: f64,
) -> Result<Period, String> {
    let find = |names| get(fields, names).or_else(|| get(shared, names));
    match (find(names::PERIOD), find(names::RATE)) {
        (Some((period, _)), Some((rate, _))) => {
            Err(format!("it has `{period}` and `{rate}`; save one of them"))
        }
        (Some((name, value)), None) => of_period(name, value, time_unit_s),
        (None, Some((name, value))) => of_rate(name, value),
        (None, None) => Ok(Period::Absent),
    }
}

/// A period in units of `unit_s`: 0 is continuous.
fn of_period(name: &str, value: &Value, unit_s: f64) -> Result<Period, String> {
    let unknown = || Period::Discrete(format!("`{name}` = {}", value.summary()));
    let period = match value {
        Value::Flag(true) => return Ok(unknown()),
        Value::Numbers(array) if array.entries.is_empty() => return Ok(Period::Absent),
        Value::Empty | Value::Other(_) => return Ok(Period::Absent),
        _ => one_number(name, value)?,
    };
    if period == 0.0 {
        return Ok(Period::Known(Domain::Continuous));
    }
    if period == -1.0 {
        return Ok(unknown());
    }
    let exact_hz = 1.0 / (period * unit_s);
    let rounded_hz = libm::round(exact_hz);
    let is_integer = (exact_hz / rounded_hz - 1.0).abs() < RATE_ROUNDING;
    let rate_hz = if is_integer { rounded_hz } else { exact_hz };
    discrete(name, value, rate_hz)
}

fn of_rate(name: &str, value: &Value) -> Result<Period, String> {
    discrete(name, value, one_number(name, value)?)
}

fn discrete(name: &str, value: &Value, rate_hz: f64) -> Result<Period, String> {
    if RATE_LIMITS_HZ.contains(&rate_hz) {
        Ok(Period::Known(Domain::Discrete { rate_hz }))
    } else {
        Err(format!(
            "`{name}` = {} is a rate of {rate_hz} Hz; the limits of `rate_hz` are {} and {} Hz; save the sampling period in seconds (0: continuous), as it is used in the loop",
            value.summary(),
            RATE_LIMITS_HZ.start(),
            RATE_LIMITS_HZ.end()
        ))
    }
}

fn one_number(name: &str, value: &Value) -> Result<f64, String> {
    let entries = match value {
        Value::Numbers(array) => array.entries.as_slice(),
        _ => &[],
    };
    match entries {
        [one] if one.im == 0.0 => Ok(one.re),
        _ => Err(format!(
            "`{name}` is {}, not one number; save the sampling period in seconds, 0 for a continuous controller",
            value.summary()
        )),
    }
}
