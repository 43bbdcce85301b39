//! Which controller: an option of `bench control` and `bench margins`.

/// Which controller.
#[derive(Clone, Debug, Default, clap::Args)]
#[group(multiple = false)]
pub(super) struct ControllerChoice {
    /// The fast controller of the thesis, Eq. (6-7)
    #[arg(long)]
    fast: bool,
    /// The slow controller of the thesis, Eq. (6-6)
    #[arg(long)]
    slow: bool,
    /// A TOML file with sections
    #[arg(long, value_name = "FILE")]
    controller: Option<String>,
}

impl ControllerChoice {
    /// The setting that the choice stands for.
    pub fn sets(&self) -> Vec<String> {
        let name = match (self.fast, self.slow, &self.controller) {
            (true, _, _) => Some("fast"),
            (_, true, _) => Some("slow"),
            (_, _, Some(file)) => Some(file.as_str()),
            _ => None,
        };
        name.map(|name| format!("control.controller={}", toml::Value::from(name)))
            .into_iter()
            .collect()
    }
}
