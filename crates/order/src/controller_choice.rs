//! Which controller: an option of `bench control` and `bench margins`.

use schemars::JsonSchema;
use serde::Serialize;

use super::help::with_setting;
use bench_config::OptionSetting;
use bench_control::CONTROLLERS;
use bench_settings::files::names;

/// Which controller.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
#[group(multiple = false)]
pub struct ControllerChoice {
    /// The fast controller of the thesis, Eq. (6-7)
    #[arg(long)]
    pub fast: bool,
    /// The slow controller of the thesis, Eq. (6-6)
    #[arg(long)]
    pub slow: bool,
    /// A controller by name, or a TOML file
    #[arg(long, value_name = "NAME|FILE", help = controller_help())]
    pub controller: Option<String>,
}

impl ControllerChoice {
    /// The setting that the choice changes.
    pub fn settings(&self) -> Vec<OptionSetting> {
        let (name, option) = match (self.fast, self.slow, &self.controller) {
            (true, _, _) => ("fast", "--fast".to_string()),
            (_, true, _) => ("slow", "--slow".to_string()),
            (_, _, Some(file)) => (file.as_str(), format!("--controller {file}")),
            _ => return Vec::new(),
        };
        vec![OptionSetting::new("control.controller", name, option)]
    }
}

fn controller_help() -> String {
    let names = names(CONTROLLERS);
    let text = format!(
        "A controller by name ({names}), or a TOML file with a `title` and [[section]] tables, one for each factor of C(s) (gain, integrator, zero_pole, pole, pole_pair, biquad, coefficients: docs/own-stage.md lists their keys), or one of the tables [tf], [zpk], [ss] and [law]"
    );
    with_setting(&text, "control.controller")
}
