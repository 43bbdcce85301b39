//! `bench config`: the effective settings.

use clap::Subcommand;

use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use crate::config::Purpose;

/// What to do with the configuration.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Clone, Debug, Subcommand)]
enum What {
    /// Print the effective settings as TOML (or JSON)
    Show(BenchOptions),
    /// Say whether the settings are valid
    Check(BenchOptions),
    /// Print the JSON schema of a configuration
    Schema,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    match &args.what {
        What::Show(options) => {
            let config = options.load(Purpose::Model, &[])?;
            if options.json {
                print_json(&config)?
            } else {
                print_text(&to_toml(&config)?)?
            }
        }
        What::Check(options) => {
            let config = options.load(Purpose::All, &[])?;
            if options.json {
                print_json(&serde_json::json!({ "valid": true, "title": config.title }))?
            } else {
                print_text(&format!("valid: {}\n", config.title))?
            }
        }
        What::Schema => print_json(&crate::config::schema())?,
    }
    Ok(Outcome::Done)
}

/// The whole effective configuration, as it travels with a recording.
pub(super) fn to_toml(config: &crate::config::Config) -> Result<String, CliError> {
    toml::to_string(config)
        .map_err(|e| CliError::Failed(format!("cannot write the configuration as TOML: {e}")))
}
