//! From layers of TOML to a checked [`Config`].

use std::path::Path;

use serde_json::Value as Json;
use toml::{Table, Value};

use super::check;
use super::cross_checks::cross_checks;
use super::error::{ConfigError, MAX_ERRORS};
use super::layer::{Layer, overlay, same_kind};
use super::overrides::{
    OptionSetting, convert_quantities, in_terms_of_option, overlay_options, sets,
};
use super::profiles::{self, EmbeddedFile};
use super::purpose::Purpose;
use super::{Config, renamed, schema};
use bench_base::finding::Finding;
use bench_base::input_file::{self, MAX_SETTINGS_BYTES};

/// A profile or file, and single settings that override it.
///
/// ```
/// use bench::config::{Source, load};
///
/// let sets = vec!["loop.rate_hz=1000".to_string()];
/// let config = load(&Source { sets, ..Source::default() })?;
/// assert_eq!(config.servo.period_s(), 1e-3);
/// # Ok::<(), bench::config::ConfigError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// A profile's name or the path of a TOML file; the default profile if absent.
    pub config: Option<String>,
    /// `KEY=VALUE`; a later entry overrides an earlier one.
    pub sets: Vec<String>,
    /// Settings made by command-line options, over all of `sets`.
    pub options: Vec<OptionSetting>,
    /// Purpose of the configuration.
    pub purpose: Purpose,
}

/// Loads, merges and checks a configuration.
pub fn load(source: &Source) -> Result<Config, ConfigError> {
    checked(&layers(source)?, &source.options, source.purpose)
}

/// Tables that recordings of earlier versions lack. Those versions ran a chirp, so the tables of the default profile apply.
const LATER_TABLES: [&str; 6] = [
    "excitation",
    "multisine",
    "stepped_sine",
    "prbs",
    "shape",
    "campaign",
];

/// The configuration in a recording. It is complete, except for tables that its version may not have had. Measured damping
/// ratios are not checked: earlier versions accepted all of them.
pub fn whole(name: &str, text: &str) -> Result<Config, ConfigError> {
    let mut layers = Vec::new();
    if let Some(base) = profiles::find(profiles::PROFILES, profiles::DEFAULT) {
        let mut base = Layer::embedded(base)?;
        base.table.retain(|key, _| LATER_TABLES.contains(&key));
        layers.push(base);
    }
    let mut recorded = Layer::parse(name.to_string(), text.to_string())?;
    renamed::translate(&mut recorded.table);
    layers.push(recorded);
    checked(&layers, &[], Purpose::Recorded)
}

fn checked(
    layers: &[Layer],
    options: &[OptionSetting],
    purpose: Purpose,
) -> Result<Config, ConfigError> {
    let schema = schema();
    let (merged, findings) = merge(&schema, layers, options);
    let refuse = |findings| refuse(layers, options, findings, &schema, &merged);
    refuse(findings)?;
    refuse(check::check(&schema, &merged))?;
    let typed: Result<Config, toml::de::Error> = merged.clone().try_into();
    let config = typed.map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    refuse(cross_checks(&config, purpose))?;
    Ok(config)
}

/// All layers and options as one tree, and the errors in the quantities of `--set`.
fn merge(schema: &Json, layers: &[Layer], options: &[OptionSetting]) -> (Value, Vec<Finding>) {
    let mut merged = Table::new();
    for layer in layers {
        overlay(&mut merged, &layer.table, same_kind);
    }
    let sets = sets_of(layers);
    let mut findings = overlay_options(&mut merged, sets, options);
    let unconverted = sets.map(|sets| convert_quantities(schema, sets, &mut merged));
    findings.extend(unconverted.unwrap_or_default());
    (Value::Table(merged), findings)
}

/// The settings of `--set`.
fn sets_of(layers: &[Layer]) -> Option<&Table> {
    let sets = layers.last().filter(|layer| layer.name == Layer::SETS)?;
    Some(&sets.table)
}

/// Checks a configuration that was changed after it was loaded.
pub(crate) fn validate(config: &Config) -> Result<(), ConfigError> {
    let value = Value::try_from(config).map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    let mut findings = check::check(&schema(), &value);
    findings.extend(cross_checks(config, Purpose::Model));
    let lines = findings
        .iter()
        .map(|f| format!("  `{}` {}", f.path, f.what));
    refuse_lines(lines.collect())
}

fn refuse_lines(lines: Vec<String>) -> Result<(), ConfigError> {
    match lines.is_empty() {
        true => Ok(()),
        false => Err(ConfigError::Refused(lines)),
    }
}

fn refuse(
    layers: &[Layer],
    options: &[OptionSetting],
    findings: Vec<Finding>,
    schema: &Json,
    merged: &Value,
) -> Result<(), ConfigError> {
    let sets = sets_of(layers);
    let line = |finding: &Finding| {
        in_terms_of_option(options, sets, finding, schema, merged).unwrap_or_else(|| {
            let place = place(layers, finding.at());
            format!("  {place}: `{}` {}", finding.path, finding.what)
        })
    };
    let mut lines: Vec<String> = findings.iter().take(MAX_ERRORS).map(line).collect();
    // One option may set several settings.
    lines.dedup();
    refuse_lines(lines)
}

/// The last layer that sets `path`, with the line; or the last layer that sets a table around it.
fn place(layers: &[Layer], path: &str) -> String {
    let mut path = path;
    loop {
        if let Some(place) = layers.iter().rev().find_map(|layer| layer.place(path)) {
            return place;
        }
        match path.rsplit_once('.') {
            Some((outer, _)) => path = outer,
            None => break,
        }
    }
    let last = layers.last();
    last.map_or("the configuration".into(), |layer| layer.name.clone())
}

fn layers(source: &Source) -> Result<Vec<Layer>, ConfigError> {
    let embedded = |name: &str| profiles::find(profiles::PROFILES, name);
    let base = embedded(profiles::DEFAULT).into_iter();
    let mut layers: Vec<Layer> = base.map(Layer::embedded).collect::<Result<_, _>>()?;
    let name = source.config.as_deref();
    if let Some(name) = name.filter(|name| *name != profiles::DEFAULT) {
        layers.push(match embedded(name) {
            Some(profile) => Layer::embedded(profile)?,
            None => Layer::parse(name.into(), read(name, profiles::PROFILES, "profile")?)?,
        });
    }
    if !source.sets.is_empty() {
        layers.push(sets(&source.sets)?);
    }
    Ok(layers)
}

fn read(name: &str, known: &[EmbeddedFile], what: &'static str) -> Result<String, ConfigError> {
    let folder = match what {
        "controller" => "controllers",
        _ => "",
    };
    let own = profiles::own(name, folder);
    let path = own.as_deref().unwrap_or(Path::new(name));
    if !path.exists() {
        return Err(ConfigError::NotFound {
            what,
            name: name.into(),
            known: profiles::names(known),
        });
    }
    input_file::read_text(path, MAX_SETTINGS_BYTES).map_err(|e| ConfigError::Unreadable {
        path: path.into(),
        why: e.to_string(),
    })
}

/// The text of an embedded file by its name, or of any file by its path.
pub(crate) fn text_of(
    name: &str,
    known: &[EmbeddedFile],
    what: &'static str,
) -> Result<String, ConfigError> {
    match profiles::find(known, name) {
        Some(embedded) => Ok(embedded.text.to_string()),
        None => read(name, known, what),
    }
}

/// The text of a file by its path.
pub(crate) fn text_of_file(name: &str, what: &'static str) -> Result<String, ConfigError> {
    read(name, &[], what)
}

/// Parses TOML of any type and checks it against the schema of the type.
pub(crate) fn typed<T>(name: &str, text: &str) -> Result<T, ConfigError>
where
    T: serde::de::DeserializeOwned + schemars::JsonSchema,
{
    let layer = Layer::parse(name.to_string(), text.to_string())?;
    let schema = schemars::schema_for!(T).to_value();
    let value = Value::Table(layer.table.clone());
    let findings = check::check(&schema, &value);
    refuse(std::slice::from_ref(&layer), &[], findings, &schema, &value)?;
    let typed: Result<T, toml::de::Error> = value.try_into();
    typed.map_err(|e: toml::de::Error| ConfigError::Refused(vec![format!("  {name}: {e}")]))
}
