//! From two signals to modes and verdict: force and displacement or similar quantities, without a model of the stage.

use core::f64::consts::TAU;

use crate::ClockSkew;
use crate::changed_modes::ChangedModes;
use crate::external_analysis::{ExternalAnalysis, Judged};
use crate::external_signals::ExternalSignals;
use crate::external_verdict::{cautions, judged, listed, scope};
use crate::first_fit::FirstFit;
use crate::in_time::TimeFit;
use crate::modal::{InputPath, ModalFit};
use crate::observation::{Observation, Source};
use crate::other_kind::clear_kind;
use crate::part::Part;
use crate::periodic::Repetition;
use crate::plausibility::{
    OtherModel, clipped, complex_model, due_to, hint, implausible, irregular, irregular_readings,
    known_cause, lag_model, nonlinear, undescribed_steps,
};
use crate::prepared::{Prepared, Stated};
use crate::record_check::Correction;
use crate::sweep_harmonics::SweepHarmonic;
use crate::verdict::Cnmp;
use crate::{IdentifyError, Signals};
use bench_plant::{InputKind, OutputKind, PlantError};

/// Least angle in radians by which the delay between two clocks turns the response at the end of the band. Clocks of two instruments differ
/// by some 20 ppm, which is 0.25 rad at 100 Hz after 20 s. A filter may seem to be a difference of 1 or 2 ppm.
const LEAST_TURN_RAD: f64 = 0.15;

/// Why signals cannot be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IdentificationError {
    /// The signals allow no estimate.
    #[error(transparent)]
    Signals(#[from] IdentifyError),
    /// The zeros of the fit cannot be computed.
    #[error(transparent)]
    Zeros(#[from] PlantError),
    /// Periods are averaged, and a reference is given.
    #[error(
        "averages over periods need no reference, because noise that a controller feeds back averages out of input and output; leave out the reference, or the period"
    )]
    ReferenceOfPeriods,
}

/// How two signals are identified, or those of a closed loop with its reference.
///
/// Units: with input in newtons and output in metres, residues are in 1/kg. With another unit of the input or the output, residues and
/// responses are in that unit over this one; frequencies, damping ratios, signs, zeros and verdict are the same. Of a velocity or an
/// acceleration, modes, residues, zeros and verdict are those of the position: the residue of a velocity in m/s is in 1/kg as well, and
/// the zeros at s = 0 that the derivatives add are left out.
///
/// ```
/// use bench_identify::Identification;
/// use nalgebra::Complex;
///
/// // A mode of 30 Hz with damping ratio 0.02 and residue 0.5/kg, sampled at 2 kHz. With its pole p and a held force u, the state is
/// // q[k + 1] = exp(p T) q[k] + (exp(p T) - 1)/p u[k], and the position 0.5 Im q/Im p.
/// let (w, zeta, period_s) = (std::f64::consts::TAU * 30.0, 0.02_f64, 5e-4);
/// let pole = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * w;
/// let step = (pole * period_s).exp();
/// let mut random = 1_u64;
/// let mut uniform = || {
///     random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
///     (random >> 40) as f64 / (1 << 24) as f64 - 0.5
/// };
///
/// // Random steps between rest at the beginning and at the end, and noise of 3 nm rms (uniform over 10 nm).
/// let mut q = Complex::new(0.0, 0.0);
/// let (mut input, mut output, mut force) = (Vec::new(), Vec::new(), 0.0);
/// for k in 0..30_000 {
///     force = match k {
///         2_000..24_000 if k % 10 == 0 => uniform().signum(),
///         2_000..24_000 => force,
///         _ => 0.0,
///     };
///     input.push(force);
///     output.push(0.5 * q.im / pole.im + 1e-8 * uniform());
///     q = step * q + (step - 1.0) / pole * force;
/// }
///
/// let found = Identification::new(2_000.0).held_s(5e-4).band_hz(5.0, 100.0).run(&input, &output)?;
/// let modes = found.fit.expect("modes").modes();
/// assert_eq!(modes.len(), 1);
/// assert!((modes[0].frequency_hz().value - 30.0).abs() < 0.01);
/// assert_eq!(modes[0].sign(), '+');
/// # Ok::<(), bench_identify::IdentificationError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Identification {
    rate_hz: f64,
    band_hz: Option<(f64, f64)>,
    repetition: Option<Repetition>,
    input_path: InputPath,
    has_stated_lag: bool,
    input_kind: Option<InputKind>,
    output_kind: Option<OutputKind>,
}

impl Identification {
    /// Signals with a constant number of samples per second. Without further settings the band is the one that the input excites, the
    /// record begins and ends at rest or is excited by noise all the time, the input is the force itself, and the output is a position.
    pub fn new(rate_hz: f64) -> Identification {
        Identification {
            rate_hz,
            band_hz: None,
            repetition: None,
            input_path: InputPath::default(),
            has_stated_lag: false,
            input_kind: None,
            output_kind: None,
        }
    }

    /// Analyses only this band. The verdict covers modes and zeros in it.
    #[must_use]
    pub fn band_hz(mut self, low_hz: f64, high_hz: f64) -> Identification {
        self.band_hz = Some((low_hz, high_hz));
        self
    }

    /// The signals are periodic, and periods are averaged: the record need not begin and end at rest.
    #[must_use]
    pub fn periods(mut self, repetition: Repetition) -> Identification {
        self.repetition = Some(repetition);
        self
    }

    /// Each sample of the input is held for this time before the next, as by an output of a computer; usually a period.
    #[must_use]
    pub fn held_s(mut self, hold_s: f64) -> Identification {
        self.input_path.hold_s = hold_s;
        self
    }

    /// A first-order lag lies between the input and the force, for example a current loop; 0: none does. Unless stated, a lag is fitted
    /// if modes do not describe the response without one.
    #[must_use]
    pub fn lag_s(mut self, lag_s: f64) -> Identification {
        self.input_path.lag_s = lag_s;
        self.has_stated_lag = true;
        self
    }

    /// What the input is. Of a voltage, a lag that is not stated is fitted together with complex residues, if real ones do not describe the
    /// response; the modes and their damping are those with the voltage source. Otherwise the kind is only kept in the result.
    #[must_use]
    pub fn input_kind(mut self, kind: InputKind) -> Identification {
        self.input_kind = Some(kind);
        self
    }

    /// What the output measures. Unless stated it is taken as a position, and the verdict is undecided if it looks like an acceleration.
    ///
    /// The acceleration by a held input without a lag steps at the samples: both readings are tried, that before the step of a sample
    /// and that after it, and the one that describes the data better is used.
    #[must_use]
    pub fn output_kind(mut self, kind: OutputKind) -> Identification {
        self.output_kind = Some(kind);
        self
    }

    /// Identifies an output as the response to an input, both with the sample of the same time at the same index.
    ///
    /// # Errors
    /// When the signals allow no estimate, or the zeros cannot be computed.
    pub fn run(
        &self,
        input: &[f64],
        output: &[f64],
    ) -> Result<ExternalAnalysis, IdentificationError> {
        self.analysis(None, input, output)
    }

    /// Identifies an output as the response to an input of a closed loop, with the reference of the loop.
    ///
    /// ```text
    /// y = G u + v       v: noise of the output, which the controller feeds back to u
    /// G = S_yr/S_ur     response of the output to the reference r over that of the input
    /// ```
    ///
    /// The response from input to output alone is biased from G towards -1/C, with C the controller in u = C (r - y), by the power of the
    /// noise over that of noise and signal. Sign convention: a lag of the output is a negative phase; the controller need not be known.
    ///
    /// The reference is a set-point, or an excitation that is added in the loop, in any unit; it is independent of the noise. (The
    /// control error is not.) The input is the whole signal that acts on the plant, with what is added to it. Before and after the
    /// excitation the reference rests; a set-point may end elsewhere than it began. Without a stated band it is the one that the
    /// reference excites. See [`joint::plant`](crate::joint::plant()) for the estimate and its source.
    ///
    /// # Errors
    /// When the signals allow no estimate, or the zeros cannot be computed; with [`Self::periods`], whose averages need no reference.
    pub fn run_with_reference(
        &self,
        reference: &[f64],
        input: &[f64],
        output: &[f64],
    ) -> Result<ExternalAnalysis, IdentificationError> {
        if self.repetition.is_some() {
            return Err(IdentificationError::ReferenceOfPeriods);
        }
        self.analysis(Some(reference), input, output)
    }

    fn analysis(
        &self,
        reference: Option<&[f64]>,
        input: &[f64],
        output: &[f64],
    ) -> Result<ExternalAnalysis, IdentificationError> {
        let signals = Signals {
            rate_hz: self.rate_hz,
            input: input.to_vec(),
            output: output.to_vec(),
        };
        let record = ExternalSignals::new(&signals, reference, self.repetition);
        let prepared = self.prepared(record)?;
        let Some(corrected) = record.corrected(&prepared.defects) else {
            return self.of_prepared(&prepared);
        };
        let record = ExternalSignals {
            signals: &corrected.signals,
            ..record
        };
        let analysis = self.of_prepared(&self.prepared(record)?)?;
        Ok(analysis.after(corrected.corrections))
    }

    /// The analysis with the model that describes the record best.
    fn of_prepared(
        &self,
        prepared: &Prepared<'_>,
    ) -> Result<ExternalAnalysis, IdentificationError> {
        if let Some((found, corrections)) = prepared.fit_in_time() {
            return self.with_fit_in_time(prepared, found, corrections);
        }
        if let Some(step) = prepared.rounded_step() {
            let analysis = self.analysed(prepared, None)?;
            return Ok(analysis.undecided_by(undescribed_steps(step)));
        }
        // Many modes would be fitted to the turn of two clocks in vain.
        let compares_first =
            !prepared.few_modes_describe() && !prepared.complex_residues_describe();
        if compares_first && prepared.is_nonlinear() {
            return self.analysed(prepared, None);
        }
        if compares_first && let Some(analysis) = self.with_one_clock(prepared)? {
            return Ok(analysis);
        }
        let analysis = self.analysed(prepared, None)?;
        let analysis = self.with_other_model(prepared, analysis, lag_model)?;
        let analysis = self.with_other_model(prepared, analysis, complex_model)?;
        // Complex residues are tried first: a small difference of the clocks easily takes their place.
        let is_open = analysis.verdict.cnmp == Cnmp::Undecided
            && !analysis.is_explained
            && analysis.fitted_lag.is_none();
        if is_open
            && !compares_first
            && let Some(corrected) = self.with_one_clock(prepared)?
            // The ratio of the clocks is one more.
            && corrected.number_of_parameters() + 1 < analysis.number_of_parameters()
        {
            return Ok(corrected);
        }
        Ok(analysis)
    }

    fn prepared<'a>(&self, record: ExternalSignals<'a>) -> Result<Prepared<'a>, IdentifyError> {
        let stated = Stated {
            band_hz: self.band_hz,
            repetition: self.repetition,
            output_kind: self.output_kind,
        };
        Prepared::of(record, self.source(), stated)
    }

    /// The analysis of a record with its output at the times of the input, if these differ, and if modes describe the response then, but
    /// not that of the record as another kind of output.
    fn with_one_clock(
        &self,
        recorded: &Prepared<'_>,
    ) -> Result<Option<ExternalAnalysis>, IdentificationError> {
        // A resampled output has no steps by which its errors could be known.
        let has_steps = recorded.resolution.output.is_some();
        let can_be_found = self.repetition.is_none() && !has_steps && recorded.is_sound();
        if !can_be_found || self.is_other_kind(recorded) {
            return Ok(None);
        }
        let record = recorded.record;
        let Some(skew) = ClockSkew::find(record, recorded.band_hz, &recorded.assumed) else {
            return Ok(None);
        };
        // A small turn describes a part of anything.
        if skew.growth_s().abs() * TAU * recorded.band_hz.1 < LEAST_TURN_RAD {
            return Ok(None);
        }
        let corrected = skew.corrected(record.signals);
        let Ok(prepared) = self.prepared(record.with_signals(&corrected)) else {
            return Ok(None);
        };
        let analysis = self.analysed(&prepared, Some(skew))?;
        let is_confirmed = analysis.fit.as_ref().is_ok_and(|fit| {
            let (record, data) = (prepared.cleaned(), &prepared.frf.data);
            fit.is_sum_of_few_modes() && skew.is_confirmed(fit, record, data, &analysis.chain)
        });
        // The turn that two clocks cause may also describe a part of complex residues, and leave an implausible response.
        let is_likely = is_confirmed && analysis.is_plausible;
        Ok(is_likely.then_some(analysis))
    }

    /// Whether the output is clearly of a kind that the user does not state. With it the response needs no other explanation.
    fn is_other_kind(&self, prepared: &Prepared<'_>) -> bool {
        self.output_kind.is_none() && clear_kind(&prepared.with_few_modes()).is_some()
    }

    /// The analysis with a lag that is not stated, or with complex residues, as `model` finds them, if modes with real ones do not describe
    /// the response, and nothing else explains that.
    fn with_other_model(
        &self,
        prepared: &Prepared<'_>,
        analysis: ExternalAnalysis,
        model: fn(&Observation<'_>) -> Option<OtherModel>,
    ) -> Result<ExternalAnalysis, IdentificationError> {
        let has_other_model = analysis.fitted_lag.is_some() || !analysis.has_real_residues();
        if analysis.is_explained || has_other_model {
            return Ok(analysis);
        }
        let record = prepared.record;
        let ExternalAnalysis { frf, chain, .. } = &analysis;
        let observation = Observation {
            source: analysis.source,
            frf,
            fit: &analysis.fit,
            chain,
            stated: self.output_kind,
            clear_kind: None,
            part: &Part::of(&frf.data, chain),
            output_step: analysis.resolution.output,
            remedies: record.remedies(),
        };
        let Some(OtherModel { fit, chain, lag }) = model(&observation) else {
            return Ok(analysis);
        };
        let fit = Ok(fit);
        let scope = scope(record, analysis.judged_up_to_rad_s);
        let verdict = judged(None, frf, &fit, &chain, scope, |verdict| {
            let input_limit = prepared.input_limit();
            hint(verdict, record, &fit, &analysis.resolution, input_limit)
        })?;
        let path = self.input_path;
        let verdict = verdict.with(lag.map(|lag| lag.description()));
        Ok(ExternalAnalysis {
            verdict: verdict.with(listed(&analysis.cautions)),
            fit,
            chain,
            input_path: lag.map_or(path, |lag| lag.in_path(path)),
            fitted_lag: lag,
            ..analysis
        })
    }

    /// The analysis of an output with the modes of the greatest likelihood of its readings, some of which may be lost.
    fn with_fit_in_time(
        &self,
        prepared: &Prepared<'_>,
        found: TimeFit,
        corrections: Vec<Correction>,
    ) -> Result<ExternalAnalysis, IdentificationError> {
        let TimeFit { fit, output, noise } = found;
        let gap = noise.gap(&fit);
        let (low_hz, high_hz) = prepared.band_hz;
        let seen_hz = if gap.is_none() {
            noise.seen_up_to_hz
        } else {
            high_hz
        };
        let band_hz = (low_hz, seen_hz);
        let chain = &prepared.assumed;
        let fit = Ok(ModalFit { band_hz, ..fit });
        let why = implausible(&Observation {
            fit: &fit,
            ..prepared.with_few_modes()
        })
        .or(gap);
        let expected = prepared.response_of(output)?;
        let is_plausible = why.is_none();
        let scope = scope(prepared.record, TAU * band_hz.1);
        let verdict = judged(why, &expected, &fit, chain, scope, |_| None)?;
        let verdict = verdict
            .with(Correction::description(&corrections))
            .with(Some(noise.description()));
        let frf = if corrections.is_empty() {
            prepared.frf.clone()
        } else {
            expected
        };
        let found = Judged {
            frf,
            fit,
            chain: chain.clone(),
            band_hz,
            verdict,
            is_plausible,
        };
        Ok(ExternalAnalysis {
            corrections,
            readings_fit: Some(noise),
            ..ExternalAnalysis::of(prepared, found)
        })
    }

    /// The modes of a record, and the verdict. `clock_skew` is that for which the output was corrected.
    fn analysed(
        &self,
        prepared: &Prepared<'_>,
        clock_skew: Option<ClockSkew>,
    ) -> Result<ExternalAnalysis, IdentificationError> {
        let (cleaned, frf) = (prepared.cleaned(), &prepared.frf);
        let with_few = prepared.with_few_modes();
        let FirstFit {
            fit,
            chain,
            lag,
            clear_kind,
            source,
        } = FirstFit::of(&with_few, prepared.is_sound(), || prepared.all_modes());
        let fit = match &clock_skew {
            Some(skew) => fit.map(|fit| skew.widened(fit, cleaned, &frf.data, &chain)),
            None => fit,
        };
        let observation = Observation {
            source,
            fit: &fit,
            chain: &chain,
            clear_kind,
            ..with_few
        };
        let lost = prepared.why_readings_fail().into_iter();
        let defects = prepared.defects.iter().map(ToString::to_string);
        let known: Vec<String> = defects.chain(lost.map(str::to_owned)).collect();
        let known = listed(&known)
            .or_else(|| clipped(&observation, prepared.input_limit()))
            .or_else(|| irregular(&observation, prepared.jitter_s))
            .or_else(|| known_cause(&observation))
            .or_else(|| nonlinear(&observation, &prepared.harmonics));
        // What is missing of a record that is cut is easily taken for another model.
        let is_explained = known.is_some() || prepared.cut.is_some();
        let why = known.or_else(|| implausible(&observation));
        let is_plausible = why.is_none();
        let scope = scope(cleaned, TAU * prepared.band_hz.1);
        let verdict = judged(why, frf, &fit, &chain, scope, |verdict| {
            let input_limit = prepared.input_limit();
            hint(verdict, cleaned, &fit, &prepared.resolution, input_limit)
        })?;
        let verdict = match &prepared.cut {
            Some(cut) if prepared.defects.is_empty() => due_to(verdict, cut),
            _ => verdict,
        };
        let fit_of_stage = fit.as_ref().ok().filter(|_| is_plausible);
        let changed = fit_of_stage.and_then(ChangedModes::of);
        let changed = changed.map(|changed| changed.description());
        let verdict = match &changed {
            Some(changed) => due_to(verdict, changed),
            None => verdict,
        };
        let mut cautions = cautions(prepared, clock_skew.as_ref(), lag.as_ref());
        let harmonics = prepared.harmonics.iter().map(SweepHarmonic::description);
        let jitter = prepared.jitter_s.map(irregular_readings);
        let found = harmonics.chain(jitter).chain(changed);
        cautions.extend(found.filter(|text| !verdict.why.contains(text)));
        let input_path = self.input_path;
        let found = Judged {
            frf: frf.clone(),
            fit,
            chain,
            band_hz: prepared.band_hz,
            verdict: verdict.with(listed(&cautions)),
            is_plausible,
        };
        Ok(ExternalAnalysis {
            input_path: lag.map_or(input_path, |lag| lag.in_path(input_path)),
            fitted_lag: lag,
            source,
            clock_skew,
            is_explained,
            cautions,
            ..ExternalAnalysis::of(prepared, found)
        })
    }

    /// Where the signals come from.
    fn source(&self) -> Source {
        Source {
            rate_hz: self.rate_hz,
            input_path: self.input_path,
            input_kind: self.input_kind,
            fits_lag: !self.has_stated_lag,
        }
    }
}
