//! The certificate of a chirp, from its recording and its analysis.

use serde::Serialize;

use crate::analysis::{AnalysedRun, Analysis, Ending};
use crate::certificate::{
    Certificate, CertifiedDevices, CertifiedLoad, CertifiedLoop, CertifiedMode, CertifiedResponse,
    CertifiedVerdict, Digests, FORMAT, sha256,
};
use crate::plan::{CALIBRATION, KIND, PlanError, RunKind};
use bench_config::Config;
use bench_control::ControllerText;
use bench_identify::Frf;
use bench_recording::Recording;

/// The file of a frequency response.
#[derive(Clone, Copy, Debug)]
pub struct ResponseFile<'a> {
    /// File name without a folder.
    pub name: &'a str,
    /// Its text.
    pub csv: &'a str,
}

/// The certificate of a completed chirp; `None` for another run, for one that did not come to its end, for one whose analysis uses other
/// recordings as well, and for a response without modes.
///
/// # Errors
/// When the settings cannot be written as TOML.
pub fn certify(
    run: &AnalysedRun<'_>,
    response: ResponseFile<'_>,
) -> Result<Option<Certificate>, PlanError> {
    let AnalysedRun {
        recording,
        analysis,
        config,
        is_one_recording,
    } = *run;
    let (Ok(fit), Some(signs)) = (&analysis.fit, &analysis.signs) else {
        return Ok(None);
    };
    if !(is_one_recording && is_completed_chirp(recording)) {
        return Ok(None);
    }
    let modes: Vec<CertifiedMode> = fit.modes().iter().map(CertifiedMode::from).collect();
    Ok(Some(Certificate {
        format: FORMAT,
        program: metadata(recording, "program"),
        made: metadata(recording, "started"),
        valid_days: config.control.certificate_valid_days,
        recording: file_name(recording),
        devices: CertifiedDevices {
            amplifier: metadata(recording, "amplifier"),
            probe: metadata(recording, "probe"),
            probe_scale: config.probe.device.scale_text(),
        },
        servo: certified_loop(analysis, config),
        load: CertifiedLoad::of(config),
        digests: Digests::of(config, attached_calibration(recording).as_deref())?,
        frf: certified_response(&analysis.frf, response),
        modes: modes.into_iter().filter(CertifiedMode::is_finite).collect(),
        signs: signs.clone(),
        verdict: CertifiedVerdict {
            cnmp: analysis.verdict.cnmp.name().into(),
            why: analysis.verdict.why.clone(),
        },
    }))
}

fn is_completed_chirp(recording: &Recording) -> bool {
    let kind = recording.metadata().get(KIND);
    let is_chirp = kind.is_some_and(|kind| kind == RunKind::Chirp.name());
    is_chirp && Ending::of(recording) == Ending::Completed
}

fn metadata(recording: &Recording, key: &str) -> String {
    recording.metadata().get(key).cloned().unwrap_or_default()
}

fn file_name(recording: &Recording) -> String {
    let name = recording.path().file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn attached_calibration(recording: &Recording) -> Option<String> {
    let attachment = recording.attachment(CALIBRATION)?;
    Some(String::from_utf8_lossy(&attachment.data).into_owned())
}

fn certified_loop(analysis: &Analysis, config: &Config) -> CertifiedLoop {
    let excess = analysis.excess_delay;
    let finite = excess.filter(|delay| delay.value.is_finite() && delay.sigma.is_finite());
    CertifiedLoop {
        rate_hz: config.servo.rate_hz,
        computing_delay_periods: config.servo.computing_delay_periods,
        delay_s: analysis.delay_s,
        delay_beyond_model_s: finite.map(|delay| delay.value),
        delay_beyond_model_sigma_s: finite.map(|delay| delay.sigma),
    }
}

fn certified_response(frf: &Frf, file: ResponseFile<'_>) -> CertifiedResponse {
    let (from_hz, to_hz) = frf.band_hz();
    CertifiedResponse {
        file: file.name.into(),
        sha256: sha256(file.csv),
        frequencies: frf.len(),
        from_hz,
        to_hz,
    }
}

impl CertifiedLoad {
    /// The configured load of a stage.
    pub(super) fn of(config: &Config) -> CertifiedLoad {
        CertifiedLoad {
            operating_point_m: config.plant.operating_point_m(),
            mass_asymmetry: config.plant.mass_asymmetry(),
        }
    }
}

impl Digests {
    /// The digests of a configuration and of the text of a calibration.
    pub(super) fn of(config: &Config, calibration: Option<&str>) -> Result<Digests, PlanError> {
        let controller = ControllerText::find(&config.control.controller);
        Ok(Digests {
            motor: table_digest(&config.motor)?,
            amplifier: table_digest(&config.amplifier)?,
            probe: table_digest(&config.probe)?,
            plant: table_digest(&config.plant)?,
            calibration: calibration.map(sha256),
            controller: controller.ok().map(|found| sha256(&found.text)),
        })
    }
}

fn table_digest(table: &impl Serialize) -> Result<String, PlanError> {
    let text = toml::to_string(table).map_err(|error| PlanError::Text(error.to_string()))?;
    Ok(sha256(&text))
}
