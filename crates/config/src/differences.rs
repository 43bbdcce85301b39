//! The settings in which two configurations differ.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use toml::Value;

use super::{Config, ConfigError, Source, load};

/// A setting whose value is not that of a reference configuration: of a profile, or of a reference run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SettingDifference {
    /// The key, for example `plant.mass_asymmetry`.
    pub key: String,
    /// Its value as TOML; `None` if it is not set.
    pub value: Option<String>,
    /// Its value in the reference configuration; `None` if it is not set there.
    pub reference: Option<String>,
}

/// The settings of `config` that differ from those of a profile or of a file, by key.
///
/// # Errors
/// When the profile cannot be read.
pub fn changed_settings(
    profile: &str,
    config: &Config,
) -> Result<Vec<SettingDifference>, ConfigError> {
    let source = Source {
        config: Some(profile.into()),
        ..Source::default()
    };
    Ok(differences(config, &load(&source)?))
}

/// The settings of `config` that differ from those of `reference`, by key.
pub fn differences(config: &Config, reference: &Config) -> Vec<SettingDifference> {
    let (values, references) = (flat(config), flat(reference));
    let keys: BTreeSet<&String> = values.keys().chain(references.keys()).collect();
    let settings = keys.into_iter().map(|key| SettingDifference {
        key: key.clone(),
        value: values.get(key).cloned(),
        reference: references.get(key).cloned(),
    });
    settings
        .filter(|setting| setting.value != setting.reference)
        .collect()
}

/// All keys with their values as TOML. A configuration can always be written as TOML; one that cannot has no keys.
fn flat(config: &Config) -> BTreeMap<String, String> {
    let mut values = BTreeMap::new();
    if let Ok(value) = Value::try_from(config) {
        collect("", &value, &mut values);
    }
    values
}

fn collect(key: &str, value: &Value, values: &mut BTreeMap<String, String>) {
    let Value::Table(table) = value else {
        values.insert(key.into(), value.to_string());
        return;
    };
    for (name, value) in table {
        let key = match key {
            "" => name.clone(),
            key => format!("{key}.{name}"),
        };
        collect(&key, value, values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_exactly_the_settings_that_differ_from_the_profile() {
        let source = Source {
            sets: vec!["plant.mass_asymmetry=0.05".into(), "sim.seed=7".into()],
            ..Source::default()
        };
        let config = load(&source).expect("valid settings");
        let changed = changed_settings("stage", &config).expect("a profile");
        let keys: Vec<&str> = changed.iter().map(|one| one.key.as_str()).collect();
        assert_eq!(keys, ["plant.mass_asymmetry", "sim.seed"]);
        assert_eq!(changed[1].value.as_deref(), Some("7"));
        assert_eq!(
            changed_settings("stage", &load(&Source::default()).expect("valid")),
            Ok(Vec::new())
        );
        assert!(changed_settings("no-such-profile", &config).is_err());
    }
}
