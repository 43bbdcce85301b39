//! Options of the excitation, for every command that excites the stage.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use toml::{Table, Value};

use super::bench_options::given;
use super::help::with_setting;
use bench_base::quantity::{Current, Frequency};
use bench_config::{Config, OptionSetting};
use bench_experiment::{
    AmplitudePlanError, ExperimentError, ResponseSource, default_amplitude, shape_amplitude,
};

/// Frequency band and amplitude.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct ExcitationOptions {
    /// First frequency
    #[arg(long, value_name = "FREQUENCY", allow_hyphen_values = true,
        help = with_setting("First frequency", "chirp.start_hz"))]
    pub start: Option<Frequency>,
    /// Last frequency
    #[arg(long, value_name = "FREQUENCY", allow_hyphen_values = true,
        help = with_setting("Last frequency", "chirp.stop_hz"))]
    pub stop: Option<Frequency>,
    /// Constant amplitude: 0.1A or 100mA [default: chirp.amplitude of the profile, which depends on
    /// the frequency; for a binary sequence prbs.amplitude_a]
    #[arg(long, value_name = "CURRENT", allow_hyphen_values = true)]
    pub amplitude: Option<Current>,
    /// Amplitude as a function of frequency for equal displacement at all frequencies, from the model or a measured FRF
    /// [default for a stepped sine without --amplitude: model]
    #[arg(long, value_name = "model|FRF.csv", conflicts_with = "amplitude")]
    #[serde(serialize_with = "text")]
    #[schemars(with = "Option<String>")]
    pub shape: Option<ResponseSource>,
}

impl ExcitationOptions {
    /// The file of the response for the amplitude.
    pub(crate) fn file(&self) -> Option<String> {
        match &self.shape {
            Some(ResponseSource::Frf(path)) => Some(path.to_string_lossy().into_owned()),
            Some(ResponseSource::Model) | None => None,
        }
    }

    /// The settings that the options change.
    pub fn settings(&self) -> Vec<OptionSetting> {
        let start = given("chirp.start_hz", "--start", self.start.as_ref());
        let stop = given("chirp.stop_hz", "--stop", self.stop.as_ref());
        let mut settings: Vec<OptionSetting> = start.into_iter().chain(stop).collect();
        if let Some(amplitude) = &self.amplitude {
            settings.extend(flat(amplitude));
        }
        settings
    }

    /// The configuration with the requested amplitude over frequency.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn shaped(&self, config: Config) -> Result<Config, ExperimentError> {
        let shaped = match (&self.shape, &self.amplitude) {
            (Some(source), _) => shape_amplitude(config, source),
            (None, Some(_)) => Ok(config),
            (None, None) => default_amplitude(config),
        };
        let source = self.shape.as_ref().unwrap_or(&ResponseSource::Model);
        shaped.map_err(|error| refused(source, error))
    }
}

/// Errors of the model are returned unchanged; every other error names the option `--shape`.
fn refused(source: &ResponseSource, error: AmplitudePlanError) -> ExperimentError {
    match error {
        AmplitudePlanError::Model(error) => error,
        other => ExperimentError::Refused(format!("--shape {source}: {other}")),
    }
}

/// One point is the same amplitude at all frequencies.
fn flat(amplitude: &Current) -> [OptionSetting; 2] {
    let option = format!("--amplitude {amplitude}");
    let point = Table::from_iter([
        ("frequency_hz".to_string(), Value::Float(1.0)),
        ("current_a".to_string(), Value::Float(amplitude.si())),
    ]);
    [
        OptionSetting::new("chirp.amplitude", vec![point], option.clone()),
        OptionSetting::new("prbs.amplitude_a", amplitude.si(), option),
    ]
}

/// As it was typed.
fn text<S: Serializer>(source: &Option<ResponseSource>, serializer: S) -> Result<S::Ok, S::Error> {
    let text = source.as_ref().map(ToString::to_string);
    text.serialize(serializer)
}
