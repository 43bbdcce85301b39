//! The controller among the variables of a file.

use nalgebra::Complex;

use super::super::transfer::{
    Domain, GainUnit, SsSettings, TfSettings, TransferSettings, TransferTable, ZpkSettings,
};
use super::names;
use super::value::{NumericArray, Value, Variables};

/// What a file does not say, or says several times.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportOptions {
    /// Unit of the gain.
    pub gain_unit: GainUnit,
    /// Continuous, or discrete with a servo rate, for a file without a sampling period.
    pub domain: Option<Domain>,
    /// Name of the structure of the controller; `.` between the names of nested ones.
    pub variable: Option<String>,
}

const WHAT_TO_SAVE: &str =
    "save the arrays num, den and Ts, or z, p, k and Ts, or A, B, C, D and Ts";
const FROM_MATLAB_OBJECT: &str = "save its arrays, in MATLAB: [num, den, Ts] = tfdata(C, 'v'); save('c.mat', 'num', 'den', 'Ts', '-v7')";

/// Variables at the top level of a file or in a structure.
struct Group<'a> {
    name: String,
    fields: &'a Variables,
}

/// The controller of a file.
///
/// # Errors
/// What is wrong, and the remedy.
pub(super) fn select(
    variables: &Variables,
    options: &ImportOptions,
) -> Result<TransferSettings, String> {
    let groups = groups(variables);
    let wanted = |group: &&Group<'_>| {
        let name = options.variable.as_ref();
        name.is_none_or(|name| *name == group.name)
    };
    let forms = |group: &'_ Group<'_>| forms(group.fields);
    let found: Vec<(&Group<'_>, TransferTable)> = groups
        .iter()
        .filter(wanted)
        .flat_map(|group| forms(group).map(move |form| (group, form)))
        .collect();
    match found.as_slice() {
        [] => Err(nothing_found(variables, options)),
        [(group, form)] => {
            let domain = domain(group, variables, options.domain)?;
            settings(group, *form, options.gain_unit, domain)
        }
        several => Err(ambiguous(several)),
    }
}

/// The top level, and all structures below it.
fn groups(variables: &Variables) -> Vec<Group<'_>> {
    let mut groups = vec![Group {
        name: String::new(),
        fields: variables,
    }];
    let mut next = 0;
    while next < groups.len() {
        let (prefix, fields) = (groups[next].name.clone(), groups[next].fields);
        for (name, value) in fields {
            if let Value::Fields(fields) = value {
                let name = match prefix.is_empty() {
                    true => name.clone(),
                    false => format!("{prefix}.{name}"),
                };
                groups.push(Group { name, fields });
            }
        }
        next += 1;
    }
    groups
}

fn get<'a>(fields: &'a Variables, names: &[&str]) -> Option<(&'a str, &'a Value)> {
    let found = fields
        .iter()
        .find(|(name, _)| names.contains(&name.as_str()));
    found.map(|(name, value)| (name.as_str(), value))
}

/// The forms whose parts are all present.
fn forms(fields: &Variables) -> impl Iterator<Item = TransferTable> + use<> {
    let has = |parts: &[&[&str]]| {
        let mut parts = parts.iter();
        parts.all(|names| matches!(get(fields, names), Some((_, Value::Numbers(_)))))
    };
    let tf = has(&[names::NUMERATOR, names::DENOMINATOR]);
    let zpk = has(&[names::ZEROS, names::POLES, names::GAIN]);
    let ss = has(&[names::A, names::B, names::C]);
    let forms = [
        (tf, TransferTable::Tf),
        (zpk, TransferTable::Zpk),
        (ss, TransferTable::Ss),
    ];
    forms
        .into_iter()
        .filter_map(|(present, form)| present.then_some(form))
}

fn nothing_found(variables: &Variables, options: &ImportOptions) -> String {
    let descriptions: Vec<String> = variables
        .iter()
        .map(|(name, value)| described(name, value))
        .collect();
    let contents = match descriptions.is_empty() {
        true => "it contains no variable".into(),
        false => format!("it contains {}", descriptions.join(", ")),
    };
    let is_object = |(_, value): &(String, Value)| matches!(value, Value::Other(what) if what.contains("object"));
    let remedy = match variables.iter().any(is_object) {
        true => FROM_MATLAB_OBJECT,
        false => WHAT_TO_SAVE,
    };
    match &options.variable {
        Some(name) => format!(
            "no controller in a structure with the name {name} (--variable): {contents}; {remedy}"
        ),
        None => format!("no controller: {contents}; {remedy}"),
    }
}

fn described(name: &str, value: &Value) -> String {
    match value {
        Value::Numbers(array) => format!("{name} ({})", array.size()),
        Value::Fields(fields) => {
            let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
            format!("{name} (a structure of {})", names.join(", "))
        }
        Value::Other(what) => format!("{name} ({what})"),
    }
}

fn ambiguous(found: &[(&Group<'_>, TransferTable)]) -> String {
    let names: Vec<String> = found
        .iter()
        .map(|(group, form)| match group.name.as_str() {
            "" => format!("{} at the top level", form.key()),
            name => format!("{} in {name}", form.key()),
        })
        .collect();
    format!(
        "it contains several controllers ({}); name the structure of one with --variable, or save only one form",
        names.join(", ")
    )
}

/// The time domain: of the file, or of the options if the file has no sampling period.
fn domain(
    group: &Group<'_>,
    variables: &Variables,
    option: Option<Domain>,
) -> Result<Domain, String> {
    let period = get(group.fields, names::PERIOD).or_else(|| get(variables, names::PERIOD));
    let in_file = match period {
        Some((name, value)) => domain_of_period(name, value)?,
        None => None,
    };
    match (in_file, option) {
        (Some(in_file), None) => Ok(in_file),
        (None, Some(option)) => Ok(option),
        (Some(in_file), Some(option)) if same(in_file, option) => Ok(in_file),
        (Some(in_file), Some(_)) => Err(format!(
            "it is {} by its sampling period; leave out --rate and --continuous",
            description(in_file)
        )),
        (None, None) => Err("it has no sampling period Ts; add --continuous, or --rate HZ if the controller is discrete".into()),
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

/// A rate that differs from an integer by less than this ratio was an integer before 1/Ts was rounded.
const RATE_ROUNDING: f64 = 1e-9;

/// The domain of a sampling period in seconds: 0 is continuous. `None` if the period is not known (-1 in MATLAB, None or True in
/// python-control).
fn domain_of_period(name: &str, value: &Value) -> Result<Option<Domain>, String> {
    let period_s = match value {
        Value::Numbers(array) => match array.entries.as_slice() {
            [one] if one.im == 0.0 => one.re,
            _ => {
                return Err(format!(
                    "`{name}` is not one number; save the sampling period in seconds, 0 for a continuous controller"
                ));
            }
        },
        _ => return Ok(None),
    };
    if period_s == 0.0 {
        return Ok(Some(Domain::Continuous));
    }
    if period_s < 0.0 {
        return Ok(None);
    }
    let exact_hz = 1.0 / period_s;
    let rounded_hz = libm::round(exact_hz);
    let is_integer = (exact_hz / rounded_hz - 1.0).abs() < RATE_ROUNDING;
    let rate_hz = if is_integer { rounded_hz } else { exact_hz };
    Ok(Some(Domain::Discrete { rate_hz }))
}

fn settings(
    group: &Group<'_>,
    form: TransferTable,
    gain_unit: GainUnit,
    domain: Domain,
) -> Result<TransferSettings, String> {
    let fields = group.fields;
    let rate_hz = match domain {
        Domain::Continuous => None,
        Domain::Discrete { rate_hz } => Some(rate_hz),
    };
    Ok(match form {
        TransferTable::Tf => TransferSettings::Tf(TfSettings {
            gain_unit,
            rate_hz,
            numerator: real_vector(fields, names::NUMERATOR)?,
            denominator: real_vector(fields, names::DENOMINATOR)?,
        }),
        TransferTable::Zpk => TransferSettings::Zpk(ZpkSettings {
            gain_unit,
            rate_hz,
            zeros: pairs(fields, names::ZEROS)?,
            poles: pairs(fields, names::POLES)?,
            gain: scalar(fields, names::GAIN)?,
        }),
        TransferTable::Ss => TransferSettings::Ss(SsSettings {
            gain_unit,
            rate_hz,
            a: real_rows(fields, names::A)?,
            b: real_vector(fields, names::B)?,
            c: real_vector(fields, names::C)?,
            d: match get(fields, names::D) {
                Some(_) => scalar(fields, names::D)?,
                None => 0.0,
            },
        }),
    })
}

fn array<'a>(fields: &'a Variables, names: &[&str]) -> Result<(&'a str, &'a NumericArray), String> {
    match get(fields, names) {
        Some((name, Value::Numbers(array))) => Ok((name, array)),
        Some((name, Value::Other(what))) => Err(format!(
            "`{name}` is {what}; save it as an array of numbers"
        )),
        _ => Err(format!(
            "`{}` is missing; {WHAT_TO_SAVE}",
            names.first().unwrap_or(&"")
        )),
    }
}

fn vector<'a>(
    fields: &'a Variables,
    names: &[&str],
) -> Result<(&'a str, &'a [Complex<f64>]), String> {
    let (name, array) = array(fields, names)?;
    let vector = array.vector().ok_or_else(|| {
        let size = array.size();
        format!("`{name}` has the size {size}; save a controller with one input and one output")
    })?;
    Ok((name, vector))
}

fn real(name: &str, number: &Complex<f64>) -> Result<f64, String> {
    match number.im == 0.0 {
        true => Ok(number.re),
        false => Err(format!(
            "`{name}` contains the complex number {}{:+}j; save a controller with real coefficients",
            number.re, number.im
        )),
    }
}

fn real_vector(fields: &Variables, names: &[&str]) -> Result<Vec<f64>, String> {
    let (name, vector) = vector(fields, names)?;
    vector.iter().map(|number| real(name, number)).collect()
}

fn real_rows(fields: &Variables, names: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    let (name, array) = array(fields, names)?;
    let rows = array.rows().ok_or_else(|| {
        format!(
            "`{name}` has the size {}; save a square matrix",
            array.size()
        )
    })?;
    let row = |row: &Vec<Complex<f64>>| row.iter().map(|number| real(name, number)).collect();
    rows.iter().map(row).collect()
}

fn scalar(fields: &Variables, names: &[&str]) -> Result<f64, String> {
    let (name, array) = array(fields, names)?;
    match array.entries.as_slice() {
        [one] => real(name, one),
        _ => Err(format!(
            "`{name}` has the size {}; save a controller with one input and one output",
            array.size()
        )),
    }
}

fn pairs(fields: &Variables, names: &[&str]) -> Result<Vec<[f64; 2]>, String> {
    let (_, vector) = vector(fields, names)?;
    Ok(vector.iter().map(|root| [root.re, root.im]).collect())
}
