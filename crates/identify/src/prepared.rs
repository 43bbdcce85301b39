//! What is known of external signals before all of their modes are fitted: their defects, their response, and a few modes of it.

use std::borrow::Cow;

use crate::external_signals::ExternalSignals;
use crate::in_time::{TimeFit, TimeSearch};
use crate::modal::{self, FitError, MeasurementChain, ModalFit};
use crate::multisine_lines::useful_band::useful_limit_hz;
use crate::observation::{Observation, Source, describes};
use crate::part::{PART_MODES, Part, part};
use crate::periodic::Repetition;
use crate::periodic_part::{PeriodicPart, fit_of_periods};
use crate::plausibility::cut_within_excitation;
use crate::record_check::{
    Checked, Correction, Defect, Ends, LostReadings, Reading, Resolution, StrayLine, limit_of_input,
};
use crate::sweep_harmonics::SweepHarmonic;
use crate::{Frf, IdentifyError, Signals};
use bench_plant::{OutputKind, SignalPath};

/// Number of responses with whose modes the search in time begins.
const MAX_RESPONSES: usize = 4;

/// Number of modes that the search in time adds by one response.
const MORE_MODES: usize = 4;

/// Readings are left, but no modes describe them.
const NO_MODES_OF_READINGS: &str = "no sum of modes describes the other readings";

/// Readings are left, but they have no simulation.
const HOLD_MAY_HELP: &str = "a verdict from the other readings needs a position from rest to rest, without --reference and --period, and --hold zoh if each sample of the input is held until the next one";

/// What the user states of external signals.
pub(super) struct Stated {
    pub(super) band_hz: Option<(f64, f64)>,
    /// How a periodic record repeats.
    pub(super) repetition: Option<Repetition>,
    /// The kind of the output.
    pub(super) output_kind: Option<OutputKind>,
}

/// External signals with their response and a few modes of it.
pub(super) struct Prepared<'a> {
    /// The signals as they are recorded.
    pub(super) record: ExternalSignals<'a>,
    /// The signals without their stray lines.
    signals: Cow<'a, Signals>,
    pub(super) stray_lines: Vec<StrayLine>,
    pub(super) resolution: Resolution,
    pub(super) defects: Vec<Defect>,
    /// The readings that are left, if the defects are lost ones.
    lost: Option<LostReadings>,
    /// Standard deviation of the times of the readings in seconds, if they are irregular and not stated.
    pub(super) jitter_s: Option<f64>,
    /// Harmonics of a sweep in an output without defects.
    pub(super) harmonics: Vec<SweepHarmonic>,
    /// What is missing of a record that is cut within its excitation.
    pub(super) cut: Option<String>,
    pub(super) frf: Frf,
    pub(super) periodic: Option<PeriodicPart>,
    pub(super) band_hz: (f64, f64),
    pub(super) source: Source,
    /// The kind of the output, if the user states it.
    pub(super) stated: Option<OutputKind>,
    /// The chain of an output of the stated kind, or of a position.
    pub(super) assumed: MeasurementChain,
    part: Part,
}

impl<'a> Prepared<'a> {
    /// The response between two frequencies, or in the band that is excited. With a repetition, periods are averaged; without one, the
    /// record must begin and end at rest.
    pub(super) fn of(
        record: ExternalSignals<'a>,
        source: Source,
        stated: Stated,
    ) -> Result<Prepared<'a>, IdentifyError> {
        let repetition = stated.repetition;
        record.check()?;
        // The lines of a periodic record are estimated one by one.
        let (signals, stray_lines) = match repetition {
            Some(_) => (Cow::Borrowed(record.signals), Vec::new()),
            None => record.without_stray_lines(),
        };
        let cleaned = ExternalSignals {
            signals: &signals,
            ..record
        };
        let requested_hz = stated
            .band_hz
            .unwrap_or_else(|| default_band_hz(cleaned, repetition));
        let (frf, periodic) = response(cleaned, requested_hz, repetition)?;
        // Beyond the outermost excited lines nothing is known.
        let band_hz = if stated.band_hz.is_none() && periodic.is_some() {
            frf.band_hz()
        } else {
            requested_hz
        };
        let assumed = source.chain(stated.output_kind.unwrap_or_default(), &frf.data);
        let Checked {
            defects,
            lost,
            jitter_s,
        } = record.checked(&cleaned);
        let resolution = record.resolution();
        // Steps and defects have harmonics of their own.
        let harmonics = if defects.is_empty() && resolution.output.is_none() {
            cleaned.harmonics()
        } else {
            Vec::new()
        };
        Ok(Prepared {
            resolution,
            harmonics,
            jitter_s,
            defects,
            lost,
            cut: cut_within_excitation(cleaned),
            part: Part::of(&frf.data, &assumed),
            record,
            signals,
            stray_lines,
            frf,
            periodic,
            band_hz,
            source,
            stated: stated.output_kind,
            assumed,
        })
    }

    /// The record without its stray lines.
    pub(super) fn cleaned(&self) -> ExternalSignals<'_> {
        ExternalSignals {
            signals: &self.signals,
            ..self.record
        }
    }

    /// Whether the record has no defect, and all of its excitation.
    pub(super) fn is_sound(&self) -> bool {
        self.defects.is_empty() && self.cut.is_none()
    }

    /// The step of a sound output that can be simulated, if its noise does not make the rounding errors a noise.
    pub(super) fn rounded_step(&self) -> Option<f64> {
        let can_be_simulated = self.is_undisturbed() && self.simulated_path().is_some();
        self.step().filter(|_| can_be_simulated)
    }

    /// Whether the output has no defect and no stray line.
    fn is_undisturbed(&self) -> bool {
        self.defects.is_empty() && self.stray_lines.is_empty()
    }

    /// The modes of the greatest likelihood of the readings of an output that is rounded, or of which readings are lost, if they describe
    /// its readings; with what is left out.
    ///
    /// Of a rounded output all readings are tried first: modes may describe those that seem to be repeated.
    pub(super) fn fit_in_time(&self) -> Option<(TimeFit, Vec<Correction>)> {
        let path = self.simulated_path()?;
        let tries_all = self.step().is_some() && (self.is_undisturbed() || self.lost.is_some());
        if tries_all {
            let output = self.record.signals.output.iter().copied();
            let readings: Vec<Reading> = output.map(Reading::Value).collect();
            if let Some(found) = self.fit_of_readings(&readings, path) {
                return Some((found, Vec::new()));
            }
        }
        let lost = self.lost.as_ref()?;
        let found = self.fit_of_readings(&lost.readings, path)?;
        Some((found, lost.corrections.clone()))
    }

    /// Why the readings that are left of an output have no verdict.
    pub(super) fn why_readings_fail(&self) -> Option<&'static str> {
        self.lost.as_ref()?;
        Some(match self.simulated_path() {
            Some(_) => NO_MODES_OF_READINGS,
            None => HOLD_MAY_HELP,
        })
    }

    /// The search begins with a few modes of the response, which steps and lost readings distort, and goes on with those of the response of
    /// the expected output.
    fn fit_of_readings(&self, readings: &[Reading], path: &SignalPath) -> Option<TimeFit> {
        let input = &self.record.signals.input;
        let mut search = TimeSearch::new(input, readings, self.step(), path);
        let mut orders = modal::rising_orders(&self.part.data, &self.assumed, PART_MODES).ok()?;
        for _ in 0..MAX_RESPONSES {
            search.try_modes(orders);
            if let Some(found) = search.result(self.band_hz) {
                return Some(found);
            }
            let (output, modes) = search.unrounded()?;
            let data = part(&self.response_of(output).ok()?.data);
            let max_modes = modes.modes.len() + MORE_MODES;
            orders = if search.adds_modes() {
                modal::grown_orders(&data, &self.assumed, modes, max_modes).ok()?
            } else {
                modal::rising_orders(&data, &self.assumed, PART_MODES).ok()?
            };
        }
        None
    }

    /// The step of the output, if its noise does not make the rounding errors a noise.
    fn step(&self) -> Option<f64> {
        let is_dithered = self.resolution.is_dithered;
        self.resolution.output.filter(|_| !is_dithered)
    }

    /// The path from input to output of a position that follows from a held input alone, from rest to rest.
    fn simulated_path(&self) -> Option<&SignalPath> {
        let is_open = self.record.reference.is_none() && self.record.ends == Ends::Rest;
        match &self.assumed {
            MeasurementChain::Bench(path) if is_open && path.output == OutputKind::Position => {
                Some(path)
            }
            _ => None,
        }
    }

    /// The response of the record with another output.
    pub(super) fn response_of(&self, output: Vec<f64>) -> Result<Frf, IdentifyError> {
        let signals = &Signals {
            output,
            ..self.record.signals.clone()
        };
        let record = ExternalSignals {
            signals,
            ..self.record
        };
        record.response(self.band_hz)
    }

    /// Whether the output has large harmonics of the input, or the input is clipped: no linear model describes that, nor do two clocks.
    pub(super) fn is_nonlinear(&self) -> bool {
        self.harmonics.iter().any(SweepHarmonic::is_large) || self.input_limit().is_some()
    }

    /// The limit of the recorded input, if that is clipped. (Without its stray lines it would not stay at a limit.)
    pub(super) fn input_limit(&self) -> Option<f64> {
        limit_of_input(&self.record.signals.input)
    }

    /// Whether a few modes describe a part of the response.
    pub(super) fn few_modes_describe(&self) -> bool {
        self.part.few().as_ref().is_ok_and(describes)
    }

    /// Whether a few modes with complex residues describe a part of the response.
    pub(super) fn complex_residues_describe(&self) -> bool {
        self.is_sound() && self.part.complex().is_some()
    }

    /// As many modes as are significant. Many modes would be fitted to a defect or to a missing end, of which the few are kept.
    pub(super) fn all_modes(&self) -> Result<ModalFit, FitError> {
        if let Some(part) = &self.periodic {
            return fit_of_periods(&self.frf.data, part.linearity.as_ref(), &self.assumed);
        }
        let is_cut = self.cut.is_some() && !self.few_modes_describe();
        if is_cut || !self.defects.is_empty() {
            return self.part.few().clone();
        }
        if !self.few_modes_describe() {
            // Nor do many, if they do not describe a part.
            let of_part = modal::fit(&self.part.data, &self.assumed);
            if !of_part.as_ref().is_ok_and(describes) {
                return of_part;
            }
        }
        modal::fit(&self.frf.data, &self.assumed)
    }

    /// The response with the few modes.
    pub(super) fn with_few_modes(&self) -> Observation<'_> {
        Observation {
            source: self.source,
            frf: &self.frf,
            fit: self.part.few(),
            chain: &self.assumed,
            stated: self.stated,
            clear_kind: None,
            part: &self.part,
            output_step: self.resolution.output,
            remedies: self.record.remedies(),
        }
    }
}

/// The band that is excited. Of a periodic record the excited lines are found one by one, so that all frequencies are used; of a held
/// sequence such as a PRBS those up to half of its power.
fn default_band_hz(record: ExternalSignals<'_>, repetition: Option<Repetition>) -> (f64, f64) {
    let all = (0.0, record.signals.rate_hz / 2.0);
    match repetition {
        Some(repetition) => {
            let limit_hz = useful_limit_hz(record.signals, repetition);
            (all.0, limit_hz.unwrap_or(all.1))
        }
        None => record.excited_band_hz().unwrap_or(all),
    }
}

fn response(
    record: ExternalSignals<'_>,
    band_hz: (f64, f64),
    repetition: Option<Repetition>,
) -> Result<(Frf, Option<PeriodicPart>), IdentifyError> {
    match repetition {
        Some(repetition) => {
            let (frf, part) = PeriodicPart::of(record.signals, band_hz, repetition)?;
            Ok((frf, Some(part)))
        }
        None => Ok((record.response(band_hz)?, None)),
    }
}
