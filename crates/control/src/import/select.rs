//! The controller among the variables of a file.

use super::super::transfer::{Domain, GainUnit};
use super::form::Form;
use super::value::{Value, Variables};
use super::{period, properties};

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

/// What a user saves to have a controller in a file.
pub(super) const WHAT_TO_SAVE: &str =
    "save the arrays num, den and Ts, or z, p, k and Ts, or A, B, C, D and Ts";
const FROM_MATLAB_OBJECT: &str = "save its arrays, in MATLAB: [num, den, Ts] = tfdata(C, 'v'); save('c.mat', 'num', 'den', 'Ts', '-v7')";

/// Variables at the top level of a file or in a structure.
struct Group<'a> {
    name: String,
    fields: &'a Variables,
}

/// A controller as a file has it: its parts, its time domain, its other properties.
pub(super) struct Selected<'a> {
    pub form: Form,
    pub fields: &'a Variables,
    pub domain: Domain,
    pub properties: properties::Properties,
}

/// The controller of a file.
///
/// # Errors
/// What is wrong, and the remedy.
pub(super) fn select<'a>(
    variables: &'a Variables,
    options: &ImportOptions,
) -> Result<Selected<'a>, String> {
    let groups = groups(variables);
    let wanted = |group: &&Group<'_>| {
        let name = options.variable.as_ref();
        name.is_none_or(|name| *name == group.name)
    };
    let found: Vec<(&Group<'a>, Form)> = groups
        .iter()
        .filter(wanted)
        .flat_map(|group| Form::all_of(group.fields).map(move |form| (group, form)))
        .collect();
    match found.as_slice() {
        [] => Err(nothing_found(variables, options)),
        [(group, form)] => selected(group, *form, variables, options),
        several => Err(ambiguous(several)),
    }
}

fn selected<'a>(
    group: &Group<'a>,
    form: Form,
    variables: &'a Variables,
    options: &ImportOptions,
) -> Result<Selected<'a>, String> {
    let fields = group.fields;
    // A structure may leave properties of its system to the top level.
    let shared: &[(String, Value)] = if group.name.is_empty() {
        &[]
    } else {
        variables
    };
    let properties = properties::of(fields, shared, form, options.gain_unit)?;
    let domain = period::domain(fields, shared, properties.time_unit_s, options.domain)?;
    Ok(Selected {
        form,
        fields,
        domain,
        properties,
    })
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
                let name = if prefix.is_empty() {
                    name.clone()
                } else {
                    format!("{prefix}.{name}")
                };
                groups.push(Group { name, fields });
            }
        }
        next += 1;
    }
    groups
}

fn nothing_found(variables: &Variables, options: &ImportOptions) -> String {
    let descriptions: Vec<String> = variables
        .iter()
        .map(|(name, value)| described(name, value))
        .collect();
    let contents = if descriptions.is_empty() {
        "it contains no variable".into()
    } else {
        format!("it contains {}", descriptions.join(", "))
    };
    let is_object = |(_, value): &(String, Value)| matches!(value, Value::Other(what) if what.contains("object"));
    let remedy = if variables.iter().any(is_object) {
        FROM_MATLAB_OBJECT
    } else {
        WHAT_TO_SAVE
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
        Value::Text(_) => format!("{name} (text)"),
        other => format!("{name} ({})", other.summary()),
    }
}

fn ambiguous(found: &[(&Group<'_>, Form)]) -> String {
    let names: Vec<String> = found
        .iter()
        .map(|(group, form)| match group.name.as_str() {
            "" => format!("{} at the top level", form.name()),
            name => format!("{} in {name}", form.name()),
        })
        .collect();
    format!(
        "it contains several controllers ({}); name the structure of one with --variable, or save only one form",
        names.join(", ")
    )
}
