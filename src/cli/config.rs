//! `bench config`: the effective settings.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::output::{print_json, print_result, print_text, warn};
use super::table::labelled;
use bench_config::{Config, Purpose, profiles};
use bench_experiment::check_named_files;
use bench_order::{BenchOptions, SeedOption};
use bench_settings::files::{find, own};

/// What to do with the configuration.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    what: ConfigCommand,
}

#[derive(Clone, Debug, Subcommand)]
enum ConfigCommand {
    /// Print the effective settings as TOML (or JSON)
    Show(ConfigArgs),
    /// Check whether the settings are valid
    Check(ConfigArgs),
    /// Print the JSON schema of a configuration
    Schema,
    /// List the profiles that --config accepts by name: built-in profiles and your own
    Profiles {
        /// Print one JSON object on standard output and nothing else
        #[arg(long)]
        json: bool,
    },
    /// Write a configuration file with comments for your own stage
    Init(InitArgs),
}

/// The options of a run that are settings.
#[derive(Clone, Debug, clap::Args)]
struct ConfigArgs {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    seed: SeedOption,
}

impl ConfigArgs {
    fn load(&self, purpose: Purpose) -> Result<Config, CliError> {
        Ok(self.bench.load(purpose, self.seed.setting().as_slice())?)
    }
}

/// What kind of file, and where.
#[derive(Clone, Debug, clap::Args)]
struct InitArgs {
    /// The model of the mechanics
    #[arg(long, value_name = "MODEL", default_value = "lumped")]
    plant: Template,
    /// The file, which must not exist
    #[arg(long, value_name = "FILE", default_value = "my-stage.toml")]
    out: PathBuf,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Template {
    /// Masses and springs along one line
    Lumped,
    /// A sum of modes
    Modal,
}

impl Template {
    fn text(self) -> &'static str {
        match self {
            Template::Lumped => include_str!("../../bench-config/templates/lumped.toml"),
            Template::Modal => include_str!("../../bench-config/templates/modal.toml"),
        }
    }
}

/// A profile that `--config` finds by its name.
#[derive(Debug, Serialize)]
struct Profile {
    name: String,
    /// The file of an own profile; `null` of one that is built in.
    file: Option<String>,
    /// Whether a profile of the same name comes before it.
    hidden: bool,
}

impl Profile {
    fn line(&self) -> String {
        let place = self.file.as_deref().unwrap_or("built in");
        let hidden = if self.hidden {
            " (hidden: give its path)"
        } else {
            ""
        };
        labelled(&self.name, &format!("{place}{hidden}"))
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    match &args.what {
        ConfigCommand::Show(args) => show(args)?,
        ConfigCommand::Check(args) => check(args)?,
        ConfigCommand::Schema => print_json(&bench_config::schema())?,
        ConfigCommand::Profiles { json } => list_profiles(*json)?,
        ConfigCommand::Init(args) => init(args)?,
    }
    Ok(Exit::Done)
}

fn show(args: &ConfigArgs) -> Result<(), CliError> {
    let config = args.load(Purpose::Model)?;
    if args.bench.json {
        print_json(&config)
    } else {
        print_text(&to_toml(&config)?)
    }
}

fn check(args: &ConfigArgs) -> Result<(), CliError> {
    let config = args.load(Purpose::All)?;
    warn(&check_named_files(&config)?);
    let title = &config.title;
    let result = serde_json::json!({ "valid": true, "title": title });
    print_result(args.bench.json, &result, |_| format!("valid: {title}\n"))
}

fn list_profiles(json: bool) -> Result<(), CliError> {
    let profiles = all_profiles();
    let result = serde_json::json!({ "profiles": profiles });
    print_result(json, &result, |_| {
        profiles.iter().map(Profile::line).collect()
    })
}

/// Built-in profiles come first, then those of the folders in their order.
fn all_profiles() -> Vec<Profile> {
    let built_in = profiles::PROFILES.iter().map(|profile| Profile {
        name: profile.name.into(),
        file: None,
        hidden: false,
    });
    let own = profiles::own_profiles().into_iter().map(|(name, file)| {
        let is_built_in = find(profiles::PROFILES, &name).is_some();
        let hidden = is_built_in || own(&name, "").as_ref() != Some(&file);
        Profile {
            name,
            file: Some(file.display().to_string()),
            hidden,
        }
    });
    built_in.chain(own).collect()
}

fn init(args: &InitArgs) -> Result<(), CliError> {
    let file = args.out.display().to_string();
    let created = File::create_new(&args.out);
    let written = created.and_then(|mut file| file.write_all(args.plant.text().as_bytes()));
    written.map_err(|e| {
        CliError::Failed(format!(
            "cannot write {file}: {e}; choose another file with --out"
        ))
    })?;
    let result = serde_json::json!({ "file": file });
    print_result(args.json, &result, |_| {
        format!("{file} written; `bench config check --config {file}` checks it\n")
    })
}

/// The whole effective configuration, as in a recording.
fn to_toml(config: &Config) -> Result<String, CliError> {
    toml::to_string(config).map_err(|e| {
        CliError::Failed(format!(
            "cannot write the configuration as TOML: {e}; report this with the configuration"
        ))
    })
}
