//! `bench tune --frf` and `--campaign`: measured responses in place of the model.

use std::path::PathBuf;

use super::error::CliError;
use super::measured_margins::sigma_text;
use super::output::warn;
use super::table::{result_table, wrap};
use bench_base::progress::Progress;
use bench_base::units::UM_PER_M;
use bench_config::Config;
use bench_control::measured::Stability;
use bench_control::tuning::{Goal, MeasuredPlant};
use bench_experiment::campaign::recorded_points;
use bench_experiment::tuning::{FrfEvidence, FrfSource, IdentifiedFrf};
use bench_external::frf::PhaseUnit;
use bench_identify::verdict::Cnmp;
use bench_order::BenchOptions;
use bench_report::figures::frf_table;

/// Where the plants come from.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct SourceOptions {
    /// Design from a measured response instead of the model: the FRF of `bench chirp` (..._frf.csv) or its recording (MCAP), or
    /// a table of another program with frequency, magnitude and phase, or real and imaginary part, in m/A; repeatable, one for
    /// each operating point. Of the configuration only rate, delays, amplifier, probe and interlocks are used
    #[arg(long, value_name = "FILE|RECORDING", conflicts_with_all = ["campaign", "operating_points"])]
    frf: Vec<PathBuf>,
    /// With --frf: unit of the phases of the tables [default: that in the name of the column, otherwise by the numbers]
    #[arg(long, value_name = "UNIT", requires = "frf", value_enum)]
    frf_phase: Option<PhaseUnit>,
    /// Design from the recordings of all points of a campaign (`bench campaign --keep-recordings`); with --asymmetry only from
    /// those of this mass asymmetry
    #[arg(long, value_name = "DIR", conflicts_with = "operating_points")]
    campaign: Option<PathBuf>,
}

impl SourceOptions {
    /// Whether the plants are measured.
    pub fn is_measured(&self) -> bool {
        !self.frf.is_empty() || self.campaign.is_some()
    }

    /// The measured responses with their modes; none if the model is used.
    pub fn identified(
        &self,
        bench: &BenchOptions,
        goal: Goal,
        config: &Config,
        progress: &Progress,
    ) -> Result<Vec<IdentifiedFrf>, CliError> {
        if !self.is_measured() {
            return Ok(Vec::new());
        }
        self.refuse_model_options(bench, goal)?;
        let files = self.files(bench)?;
        progress.begin("measured responses", 0);
        let sources = files
            .iter()
            .map(|file| FrfSource::read(file, self.frf_phase));
        let sources: Vec<FrfSource> = sources.collect::<Result<_, _>>()?;
        for source in &sources {
            warn(&source.measured.cautions);
        }
        Ok(IdentifiedFrf::all(sources, config)?)
    }

    fn files(&self, bench: &BenchOptions) -> Result<Vec<PathBuf>, CliError> {
        let Some(folder) = &self.campaign else {
            return Ok(self.frf.clone());
        };
        let asymmetry = bench.asymmetry.as_ref().map(|asymmetry| asymmetry.si());
        let points = recorded_points(folder, asymmetry)?;
        Ok(points.into_iter().map(|point| point.recording).collect())
    }

    /// Refuses options that need the model.
    fn refuse_model_options(&self, bench: &BenchOptions, goal: Goal) -> Result<(), CliError> {
        let usage = |text: &str| Err(CliError::Usage(text.into()));
        if bench.operating_point.is_some() {
            return usage(
                "--operating-point is a setting of the model, but the plants are measured; give the FRFs of the operating points with --frf",
            );
        }
        if self.campaign.is_none() && bench.asymmetry.is_some() {
            return usage(
                "--asymmetry is a setting of the model, but the plants are measured; leave it out",
            );
        }
        match goal {
            Goal::Rms => usage(
                "--goal rms needs the response of the stage to the floor, which an FRF from current to displacement does not contain; use --goal disturbance or bandwidth, or the model",
            ),
            Goal::Disturbance | Goal::Bandwidth => Ok(()),
        }
    }
}

/// The plants of a design.
pub(super) fn plants(frfs: &[IdentifiedFrf]) -> Vec<MeasuredPlant> {
    frfs.iter().map(|frf| frf.plant.clone()).collect()
}

/// What is not certain in the responses, and what the design makes of it.
pub(super) fn remarks(frfs: &[IdentifiedFrf]) -> Vec<String> {
    frfs.iter().flat_map(remarks_of).collect()
}

fn remarks_of(frf: &IdentifiedFrf) -> Vec<String> {
    let name = &frf.plant.name;
    let uncertain = frf.uncertain_signs_hz().into_iter();
    let sigma = sigma_text(frf.source.measured.sigma);
    let sigma = sigma.map(|text| format!("{name}: {text}"));
    let mut remarks: Vec<String> = sigma.into_iter().collect();
    let uncertain = uncertain
        .map(|hz| format!("{name}: the sign of the mode at {hz:.2} Hz is uncertain, so it counts with any phase: the design must hold for both signs; a larger amplitude there or a longer chirp makes it certain"));
    remarks.extend(uncertain);
    if frf.verdict.cnmp == Cnmp::Undecided {
        let why = &frf.verdict.why;
        remarks.push(format!("{name}: it is undecided whether there are CNMP zeros ({why}), so the design must hold for every response in the 95 % region of the measured one"));
    }
    remarks
}

/// Why a design is not proven by the measured responses.
pub(super) fn failures(frfs: &[FrfEvidence], least: f64) -> Vec<String> {
    let failed = frfs.iter().filter(|frf| !frf.fulfils(least));
    failed.map(|frf| failure(frf, least)).collect()
}

fn failure(frf: &FrfEvidence, least: f64) -> String {
    let file = &frf.file;
    match frf.stability {
        Stability::Stable => format!(
            "the modulus margin with the measured response of {file} is with 95 % only above {:.4} (at {:.2} Hz), below the limit of {least} (--modulus-margin); measure with a larger amplitude or for longer, or choose another --seed",
            frf.modulus_margin_lower, frf.modulus_margin_lower_at_hz
        ),
        Stability::Unstable => format!(
            "the loop with the measured response of {file} is unstable by Nyquist's criterion, although it is stable with the fitted modes: fit and measurement differ where L is near -1; do not use this controller; measure with a larger amplitude or for longer, or raise --modulus-margin"
        ),
        Stability::Undecided => format!(
            "the stability of the loop with the measured response of {file} is undecided, because the curve passes -1 within its noise; measure with a larger amplitude or for longer"
        ),
    }
}

/// The measured responses as text.
pub(super) fn text(frfs: &[FrfEvidence], remarks: &[String]) -> String {
    if frfs.is_empty() {
        return String::new();
    }
    let legend = "Lower margin: smallest |1 + L| - 2.448 sigma |C| over the measured frequencies; at each of them the true distance is larger with 95 %. Modulus margin: of the measured response, ± 95 % confidence interval";
    let files = frfs.iter().map(|frf| {
        let line = format!("{}: {}, SHA-256 {}", frf.plant, frf.file, &frf.sha256);
        wrap(&line, 2)
    });
    let remarks = remarks.iter().map(|remark| wrap(remark, 0));
    [
        result_table(&frf_table(frfs)),
        wrap(legend, 0),
        files.collect(),
        wrap(&outside_text(frfs), 0),
        remarks.collect(),
    ]
    .concat()
}

/// What lies outside of the bands, the least favourable of all.
fn outside_text(frfs: &[FrfEvidence]) -> String {
    let largest = |of: fn(&FrfEvidence) -> f64| frfs.iter().map(of).fold(0.0, f64::max);
    let below = largest(|frf| frf.outside_band.below.max_sensitivity);
    let above = largest(|frf| frf.outside_band.above.max_loop_gain);
    let tolerated = frfs.iter().map(|frf| frf.tolerated_above_m_per_a);
    let tolerated_um = UM_PER_M * tolerated.fold(f64::INFINITY, f64::min);
    format!(
        "not measured: below the bands |S| is at most {below:.4}, above them |L| is at most {above:.2e}, by the fitted modes; a mode above them that is not known leaves the loop stable while its response is below {tolerated_um:.3} um/A"
    )
}
