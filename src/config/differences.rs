//! The settings in which two configurations differ.

use serde::Serialize;
use toml::Value;

use super::{Config, ConfigError, Source, load};

/// A setting with different values in two configurations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SettingDifference {
    /// The key, for example `plant.mass_asymmetry`.
    pub key: String,
    /// Its value as TOML; `None` if it is not set.
    pub value: Option<String>,
    /// Its value in the other configuration.
    pub other: Option<String>,
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

/// The settings of `config` that differ from those of `other`, by key.
pub fn differences(config: &Config, other: &Config) -> Vec<SettingDifference> {
    let (settings, others) = (flat(config), flat(other));
    let value_in = |list: &[(String, String)], key: &str| {
        let found = list.iter().find(|(name, _)| name == key);
        found.map(|(_, value)| value.clone())
    };
    let only_in_other = others
        .iter()
        .filter(|(key, _)| value_in(&settings, key).is_none());
    let mut keys: Vec<&String> = settings.iter().map(|(key, _)| key).collect();
    keys.extend(only_in_other.map(|(key, _)| key));
    keys.sort();
    let compared = keys.into_iter().map(|key| SettingDifference {
        key: key.clone(),
        value: value_in(&settings, key),
        other: value_in(&others, key),
    });
    compared
        .filter(|setting| setting.value != setting.other)
        .collect()
}

/// All keys with their values as TOML. A configuration can always be written as TOML; one that cannot has no keys.
fn flat(config: &Config) -> Vec<(String, String)> {
    let mut pairs = Vec::new();
    if let Ok(value) = Value::try_from(config) {
        collect("", &value, &mut pairs);
    }
    pairs
}

fn collect(key: &str, value: &Value, pairs: &mut Vec<(String, String)>) {
    let Value::Table(table) = value else {
        pairs.push((key.into(), value.to_string()));
        return;
    };
    for (name, value) in table {
        let key = match key {
            "" => name.clone(),
            key => format!("{key}.{name}"),
        };
        collect(&key, value, pairs);
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
