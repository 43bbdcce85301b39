//! The fields of a controller beside its parts: each is used, has no effect, or is refused by its name.

use super::super::transfer::GainUnit;
use super::form::Form;
use super::names::{self, Property};
use super::value::{Value, Variables};

/// Properties that change the response.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Properties {
    /// Length of the unit of time in seconds.
    pub time_unit_s: f64,
    /// Variable of the polynomials, if the file states it.
    pub variable: Option<Variable>,
    /// Delays other than 0.
    pub delays: Vec<Delay>,
}

/// A delay, in samples or in units of time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Delay {
    /// Name of the field.
    pub name: String,
    /// Its value.
    pub value: f64,
}

/// The variable in which a transfer function is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variable {
    /// `s` or `p`, the derivative.
    Derivative,
    /// `z` or `q`, the shift forward.
    Shift,
    /// `z^-1` or `q^-1`, the delay: polynomials by rising powers of it.
    Delay,
}

const REMEDY: &str = "save only the parts of the controller and Ts";

/// The properties in the fields of a controller; `shared` are those of the top level of the file, which count if the structure of the
/// controller does not have them.
///
/// # Errors
/// A field that is not known and not empty, or one that cannot be used.
pub(super) fn of(
    fields: &Variables,
    shared: &[(String, Value)],
    form: Form,
    gain_unit: GainUnit,
) -> Result<Properties, String> {
    let mut properties = Properties {
        time_unit_s: 1.0,
        variable: None,
        delays: Vec::new(),
    };
    for (name, value) in fields {
        if !form.uses(fields, name) && !is_period(name) {
            properties.take(name, value, gain_unit)?;
        }
    }
    for (name, value) in shared {
        let is_present = fields.iter().any(|(field, _)| field == name);
        if Property::of(name) != Property::Unknown && !is_present {
            properties.take(name, value, gain_unit)?;
        }
    }
    Ok(properties)
}

fn is_period(name: &str) -> bool {
    names::PERIOD.contains(&name) || names::RATE.contains(&name)
}

impl Properties {
    fn take(&mut self, name: &str, value: &Value, gain_unit: GainUnit) -> Result<(), String> {
        let property = Property::of(name);
        if property == Property::Remark || value.is_empty() {
            return Ok(());
        }
        match property {
            Property::Remark => {}
            Property::Delay => self.delays.extend(delay(name, value)?),
            Property::ZeroOnly if value.is_zero() => {}
            Property::TimeUnit => self.time_unit_s = time_unit_s(name, value)?,
            Property::Variable => self.variable = Some(variable(name, value)?),
            Property::InputUnit => check_unit(name, value, input_units(gain_unit))?,
            Property::OutputUnit => check_unit(name, value, &["a", "ampere", "amperes"])?,
            Property::ZeroOnly | Property::Unknown => {
                return Err(format!(
                    "it has the field `{name}` ({}), which this program does not use; {REMEDY}, or make `{name}` empty if it has no effect on the response",
                    value.summary()
                ));
            }
        }
        Ok(())
    }
}

fn delay(name: &str, value: &Value) -> Result<Option<Delay>, String> {
    if value.is_zero() {
        return Ok(None);
    }
    match value {
        Value::Numbers(array) => match array.entries.as_slice() {
            [one] if one.im == 0.0 => Ok(Some(Delay {
                name: name.into(),
                value: one.re,
            })),
            _ => Err(not_usable(name, value, "one delay")),
        },
        _ => Err(not_usable(name, value, "one delay")),
    }
}

fn not_usable(name: &str, value: &Value, expected: &str) -> String {
    format!(
        "`{name}` is {}, but {expected} is expected; correct it, or {REMEDY}",
        value.summary()
    )
}

fn lower(value: &Value) -> Option<String> {
    match value {
        Value::Text(text) => Some(text.trim().to_lowercase()),
        _ => None,
    }
}

fn time_unit_s(name: &str, value: &Value) -> Result<f64, String> {
    let unit = lower(value);
    Ok(match unit.as_deref() {
        Some("nanoseconds" | "nanosecond" | "ns") => 1e-9,
        Some("microseconds" | "microsecond" | "us") => 1e-6,
        Some("milliseconds" | "millisecond" | "ms") => 1e-3,
        Some("seconds" | "second" | "s") => 1.0,
        Some("minutes" | "minute" | "min") => 60.0,
        Some("hours" | "hour" | "h") => 3600.0,
        Some("days" | "day") => 86_400.0,
        _ => {
            let expected =
                "one of nanoseconds, microseconds, milliseconds, seconds, minutes, hours, days";
            return Err(not_usable(name, value, expected));
        }
    })
}

fn variable(name: &str, value: &Value) -> Result<Variable, String> {
    let text = lower(value).map(|text| text.replace(['{', '}', '(', ')', ' '], ""));
    match text.as_deref() {
        Some("s" | "p") => Ok(Variable::Derivative),
        Some("z" | "q") => Ok(Variable::Shift),
        Some("z^-1" | "q^-1") => Ok(Variable::Delay),
        _ => Err(not_usable(name, value, "one of s, p, z, q, z^-1, q^-1")),
    }
}

fn input_units(gain_unit: GainUnit) -> &'static [&'static str] {
    match gain_unit {
        GainUnit::AmperesPerMicrometre => &[
            "um",
            "µm",
            "μm",
            "micrometre",
            "micrometer",
            "micrometres",
            "micrometers",
        ],
        GainUnit::AmperesPerMetre => &["m", "metre", "meter", "metres", "meters"],
    }
}

fn check_unit(name: &str, value: &Value, units: &[&str]) -> Result<(), String> {
    match lower(value) {
        Some(unit) if units.contains(&unit.as_str()) => Ok(()),
        // A cell of several texts, or an object of the class string.
        _ => Err(format!(
            "`{name}` is {}, which is not {}, as --gain-unit states; scale the controller, correct --gain-unit, or {REMEDY}",
            value.summary(),
            units.first().unwrap_or(&"")
        )),
    }
}
