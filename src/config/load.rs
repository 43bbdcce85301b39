//! From layers of TOML to a checked [`Config`].

use std::path::Path;

use serde_json::Value as Json;
use toml::{Table, Value};

use super::check;
use super::cross_checks::cross_checks;
use super::error::ConfigError;
use super::layer::{Layer, lay, same_kind};
use super::overrides::{
    OptionSetting, convert_quantities, in_terms_of_option, options_table, sets,
};
use super::place::line_of;
use super::profiles::{self, EmbeddedFile};
use super::purpose::Purpose;
use super::{Config, renamed, schema};
use crate::util::finding::Finding;

/// A profile or file, and single settings over it.
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
    /// `KEY=VALUE`, the later one wins.
    pub sets: Vec<String>,
    /// Settings that command-line options stand for, over all of `sets`.
    pub options: Vec<OptionSetting>,
    /// Its use.
    pub purpose: Purpose,
}

/// Loads, merges and checks a configuration.
pub fn load(source: &Source) -> Result<Config, ConfigError> {
    checked(&layers(source)?, &source.options, source.purpose)
}

/// Tables that recordings of earlier versions lack, which ran a chirp: they are those of the default profile.
const LATER: [&str; 6] = [
    "excitation",
    "multisine",
    "stepped_sine",
    "prbs",
    "shape",
    "campaign",
];

/// The configuration that travels with a recording: whole, over nothing but the tables that are newer than it may be.
pub fn whole(name: &str, text: &str) -> Result<Config, ConfigError> {
    let mut layers = Vec::new();
    if let Some(base) = profiles::find(profiles::PROFILES, profiles::DEFAULT) {
        let mut base = Layer::parse(format!("profile {}", base.name), base.text.to_string())?;
        base.table.retain(|key, _| LATER.contains(&key));
        layers.push(base);
    }
    let mut recorded = Layer::parse(name.to_string(), text.to_string())?;
    renamed::translate(&mut recorded.table);
    layers.push(recorded);
    checked(&layers, &[], Purpose::Model)
}

fn checked(
    layers: &[Layer],
    options: &[OptionSetting],
    purpose: Purpose,
) -> Result<Config, ConfigError> {
    let schema = schema();
    let mut merged = Table::new();
    for layer in layers {
        lay(&mut merged, &layer.table, same_kind);
    }
    lay(&mut merged, &options_table(options), same_kind);
    let sets = layers.last().filter(|layer| layer.name == Layer::SETS);
    let findings = sets.map(|sets| convert_quantities(&schema, &sets.table, &mut merged));
    let merged = Value::Table(merged);
    let refuse = |findings| refuse(layers, options, findings, &schema, &merged);
    refuse(findings.unwrap_or_default())?;
    refuse(check::check(&schema, &merged))?;
    let typed: Result<Config, toml::de::Error> = merged.clone().try_into();
    let config = typed.map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    refuse(cross_checks(&config, purpose))?;
    Ok(config)
}

/// Checks a configuration that was changed after it was loaded.
pub(crate) fn validate(config: &Config) -> Result<(), ConfigError> {
    let value = Value::try_from(config).map_err(|e| ConfigError::Refused(vec![e.to_string()]))?;
    let mut findings = check::check(&schema(), &value);
    findings.extend(cross_checks(config, Purpose::Model));
    let lines: Vec<String> = findings
        .iter()
        .map(|f| format!("  `{}` {}", f.path, f.what))
        .collect();
    if lines.is_empty() {
        Ok(())
    } else {
        Err(ConfigError::Refused(lines))
    }
}

fn refuse(
    layers: &[Layer],
    options: &[OptionSetting],
    findings: Vec<Finding>,
    schema: &Json,
    merged: &Value,
) -> Result<(), ConfigError> {
    let line = |finding: &Finding| {
        in_terms_of_option(options, finding, schema, merged).unwrap_or_else(|| {
            let place = place(layers, finding.at());
            format!("  {place}: `{}` {}", finding.path, finding.what)
        })
    };
    let mut lines: Vec<String> = findings.iter().map(line).collect();
    // One option may stand for several settings.
    lines.dedup();
    match lines.is_empty() {
        true => Ok(()),
        false => Err(ConfigError::Refused(lines)),
    }
}

/// The last layer that sets `path`, with the line; or the last layer that sets something around it.
fn place(layers: &[Layer], path: &str) -> String {
    let mut path = path;
    loop {
        for layer in layers.iter().rev() {
            if let Some(line) = line_of(&layer.text, path) {
                return if layer.name == Layer::SETS {
                    layer.name.clone()
                } else {
                    format!("{} line {line}", layer.name)
                };
            }
        }
        match path.rsplit_once('.') {
            Some((outer, _)) => path = outer,
            None => {
                return layers
                    .last()
                    .map_or("the configuration".into(), |layer| layer.name.clone());
            }
        }
    }
}

fn layers(source: &Source) -> Result<Vec<Layer>, ConfigError> {
    let embedded = |name: &str| profiles::find(profiles::PROFILES, name);
    let mut layers = Vec::new();
    if let Some(base) = embedded(profiles::DEFAULT) {
        layers.push(Layer::parse(
            format!("profile {}", base.name),
            base.text.to_string(),
        )?);
    }
    match source.config.as_deref() {
        None | Some(profiles::DEFAULT) => {}
        Some(name) => match embedded(name) {
            Some(profile) => layers.push(Layer::parse(
                format!("profile {name}"),
                profile.text.to_string(),
            )?),
            None => layers.push(Layer::parse(
                name.to_string(),
                read(name, profiles::PROFILES, "profile")?,
            )?),
        },
    }
    if !source.sets.is_empty() {
        layers.push(sets(&source.sets)?);
    }
    Ok(layers)
}

fn read(name: &str, known: &[EmbeddedFile], what: &'static str) -> Result<String, ConfigError> {
    let folder = if what == "controller" {
        "controllers"
    } else {
        ""
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
    std::fs::read_to_string(path).map_err(|e| ConfigError::Unreadable {
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

/// TOML of a type of its own, checked against the type's schema.
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
