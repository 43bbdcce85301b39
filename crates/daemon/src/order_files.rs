//! The files that an order names.

use std::path::Path;

/// A path outside the folder of the daemon.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is a path outside the folder of the daemon; name a profile, or a file in that folder"
)]
pub struct Outside(pub String);

/// Refuses paths outside the folder of the daemon, without the file system.
///
/// # Errors
/// With the first path that is refused.
pub fn check_paths(files: &[String]) -> Result<(), Outside> {
    match files.iter().find(|file| leaves_folder(file)) {
        Some(file) => Err(Outside(file.clone())),
        None => Ok(()),
    }
}

fn leaves_folder(path: &str) -> bool {
    let mut parts = Path::new(path).components();
    path.starts_with(['/', '~']) || parts.any(|part| part.as_os_str() == "..")
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_order::Order;
    use serde_json::{Map, Value, json};

    fn checked(order: Value) -> Result<(), Outside> {
        let order = Order::from_json(order).expect("an order");
        check_paths(&order.files())
    }

    #[test]
    fn refuses_paths_outside_the_folder() {
        for options in [
            json!({ "config": "/etc/passwd" }),
            json!({ "set": ["calibration.file=\"/etc/passwd\""] }),
            json!({ "set": ["calibration.file= /etc/passwd"] }),
            json!({ "set": ["calibration.file=\"/etc/passwd\" # =x"] }),
            json!({ "set": ["calibration.file=\"\\u002fetc/passwd\""] }),
            json!({ "set": ["interlock.heat_file= ../x"] }),
            json!({ "set": ["loop.rate_hz=5000", "a={b=[\"x\", \"../c\"], d=1}"] }),
            json!({ "controller": "../secret.toml" }),
            json!({ "reference": "a/../../b.csv" }),
            json!({ "controller": "~/x.toml" }),
            json!({ "certificate": "/etc/passwd" }),
        ] {
            let mut order = options.clone();
            order["command"] = "control".into();
            assert!(checked(order).is_err(), "{options}");
        }
    }

    #[test]
    fn accepts_profiles_and_files_of_the_folder() {
        for options in [
            json!({ "config": "stage", "set": ["loop.rate_hz=5000"] }),
            json!({ "controller": "own.toml" }),
            json!({ "set": ["chirp.stop_hz=200", "sim.noise=[1e-9, 2e-9]"] }),
            json!({ "reference": "step", "speed": "0.1mm/s", "operating_point": "-3.8mm" }),
        ] {
            let mut order = options.clone();
            order["command"] = "control".into();
            assert_eq!(checked(order), Ok(()), "{options}");
        }
    }

    /// Texts of options that name no file, such as a column of a table.
    const NO_FILE: [&str; 8] = [
        "command", "input", "output", "time", "period", "band", "override", "name",
    ];

    /// A new option that names a file must be among the files of its order.
    #[test]
    fn refuses_an_outside_path_in_every_option() {
        let schema = schemars::schema_for!(Order).to_value();
        let mut checked_options = 0;
        for variant in schema["oneOf"].as_array().expect("commands") {
            let command = variant["title"].as_str().expect("a command");
            let options = variant["properties"].as_object().expect("options");
            for name in options
                .keys()
                .filter(|name| !NO_FILE.contains(&name.as_str()))
            {
                for value in [json!("/etc/passwd"), json!(["/etc/passwd"])] {
                    let mut order = Map::new();
                    order.insert("command".into(), command.into());
                    if command == "identify" && name != "frf" {
                        order.insert("recording".into(), "a.mcap".into());
                    }
                    order.insert(name.clone(), value.clone());
                    // Other values are refused for their type, or because they are no quantity.
                    if let Ok(order) = Order::from_json(Value::Object(order)) {
                        checked_options += 1;
                        assert!(check_paths(&order.files()).is_err(), "{command} {name}");
                    }
                }
            }
        }
        assert!(checked_options >= 14, "{checked_options}");
    }
}
