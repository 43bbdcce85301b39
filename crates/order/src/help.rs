//! Help of options whose default is a setting of the profile.

use std::sync::OnceLock;

use toml::Table;

use bench_base::quantity::Dimension;
use bench_config::profiles;
use bench_settings::files::find;

/// Where the terms of the help texts are explained.
pub const GLOSSARY: &str =
    "docs/glossary.md explains the terms: CNMP zeros, residues, operating point.";

/// `TEXT [default: KEY of the profile; 0.1 Hz in "stage"]`, with the value of the default profile.
pub fn with_setting(text: &str, key: &str) -> String {
    let value = default_value(key).unwrap_or_default();
    let profile = profiles::DEFAULT;
    format!("{text} [default: {key} of the profile; {value} in `{profile}`]")
}

/// The value of a setting in the default profile, with its unit.
pub fn default_value(key: &str) -> Option<String> {
    let mut value = profile().get(key.split('.').next()?)?;
    for part in key.split('.').skip(1) {
        value = value.get(part)?;
    }
    let number = value.as_float().or(value.as_integer().map(|n| n as f64));
    let text = number.map(|number| with_unit(key, number));
    text.or_else(|| value.as_str().map(str::to_string))
}

/// A value of a setting with its unit; lengths below a millimetre are in micrometres.
fn with_unit(key: &str, si: f64) -> String {
    if key.ends_with("_m") && si != 0.0 && si.abs() < 1e-3 {
        return format!("{} um", (si * 1e9).round() / 1e3);
    }
    Dimension::of_key(key).display(si)
}

fn profile() -> &'static Table {
    static PROFILE: OnceLock<Table> = OnceLock::new();
    PROFILE.get_or_init(|| {
        let embedded = find(profiles::PROFILES, profiles::DEFAULT);
        let table = embedded.and_then(|profile| profile.text.parse().ok());
        table.unwrap_or_default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shows_the_value_of_the_default_profile_with_its_unit() {
        let help = with_setting("First frequency", "chirp.start_hz");
        assert_eq!(
            help,
            "First frequency [default: chirp.start_hz of the profile; 0.1 Hz in `stage`]"
        );
        assert_eq!(default_value("control.controller").as_deref(), Some("fast"));
        assert_eq!(default_value("no.such"), None);
    }
}
