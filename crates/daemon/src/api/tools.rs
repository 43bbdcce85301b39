//! Findings and figures that move nothing: doctor, model, configuration.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::{Body, FromJson};
use super::error::ApiError;
use super::extract::ClientAddress;
use super::file_check::check_files;
use crate::computations::Purpose;
use crate::shared::{Daemon, DaemonConfig};
use crate::worker;
use bench_config::{Config, Source, load, profiles};
use bench_experiment::ErrorKind;
use bench_order::BenchOptions;
use bench_rig::devices;

/// Findings of `bench doctor`.
pub async fn doctor(
    State(daemon): State<Arc<Daemon>>,
    ClientAddress(client): ClientAddress,
) -> Result<Json<serde_json::Value>, ApiError> {
    computed(&daemon, Purpose::View(client), &["doctor"]).await
}

/// Modes, residues and zeros of the model, as `bench model modes`.
pub async fn model(
    State(daemon): State<Arc<Daemon>>,
    ClientAddress(client): ClientAddress,
) -> Result<Json<serde_json::Value>, ApiError> {
    computed(&daemon, Purpose::View(client), &["model", "modes"]).await
}

async fn computed(
    daemon: &Daemon,
    purpose: Purpose,
    command: &[&str],
) -> Result<Json<serde_json::Value>, ApiError> {
    let computed = worker::view(daemon, purpose, command).await?;
    match computed.get("error") {
        Some(_) => Err(ApiError::of_command(&computed)),
        None => Ok(Json(computed)),
    }
}

/// The configuration of the daemon.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ConfigView {
    /// Profile or file.
    source: Option<String>,
    /// Settings over it, as KEY=VALUE.
    sets: Vec<String>,
    /// All settings as TOML.
    toml: String,
}

/// The configuration in use.
pub async fn in_use(State(daemon): State<Arc<Daemon>>) -> Result<Json<ConfigView>, ApiError> {
    let configuration = daemon.configuration();
    config_view(configuration).map(Json)
}

fn config_view(configuration: &DaemonConfig) -> Result<ConfigView, ApiError> {
    Ok(ConfigView {
        toml: text(&configuration.config)?,
        source: configuration.source.config.clone(),
        sets: configuration.source.sets.clone(),
    })
}

fn text(config: &Config) -> Result<String, ApiError> {
    toml::to_string(config).map_err(|error| {
        let message = format!("the configuration has no text: {error}; report this");
        ApiError::refused(ErrorKind::Failed, message)
    })
}

/// The JSON schema of the settings.
pub async fn schema() -> Json<serde_json::Value> {
    Json(bench_config::schema())
}

/// Another configuration.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NewConfig {
    /// A profile by name; the one in use if absent.
    #[serde(default)]
    profile: Option<String>,
    /// Settings over it, as KEY=VALUE.
    #[serde(default)]
    sets: Vec<String>,
}

impl FromJson for NewConfig {}

/// Checks a configuration. Nothing is changed.
pub async fn check(
    State(daemon): State<Arc<Daemon>>,
    Body(new): Body<NewConfig>,
) -> Result<Json<ConfigView>, ApiError> {
    let bench = BenchOptions {
        config: new.profile.clone(),
        sets: new.sets.clone(),
        ..BenchOptions::default()
    };
    check_files(&daemon, bench.files()).await?;
    let source = source(&daemon, new);
    let view = daemon.files.run(move || config_view(&loaded(source)?));
    view.await?.map(Json)
}

/// The name of a profile, or the path of a file in the folder of the recordings, as for a command.
fn in_folder(daemon: &Daemon, name: String) -> String {
    if profiles::is_known(&name) {
        name
    } else {
        daemon.recordings.join(name).display().to_string()
    }
}

/// The configuration of the daemon with other settings, or another one.
fn source(daemon: &Daemon, new: NewConfig) -> Source {
    let own = daemon.configuration().source.clone();
    Source {
        config: new
            .profile
            .map(|name| in_folder(daemon, name))
            .or(own.config),
        sets: new.sets,
        ..own
    }
}

fn loaded(source: Source) -> Result<DaemonConfig, ApiError> {
    let refused = |message: String| ApiError::refused(ErrorKind::Configuration, message);
    let config = load(&source).map_err(|error| refused(error.to_string()))?;
    devices::check(&config).map_err(|error| refused(error.to_string()))?;
    Ok(DaemonConfig { source, config })
}
