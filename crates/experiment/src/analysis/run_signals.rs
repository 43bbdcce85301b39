//! The signals of a run at regular times.

use super::aligned_readings::AlignedReadings;
use super::missing_ticks::MissingTicks;
use bench_identify::joint::LoopSignals;
use bench_identify::modal::ModalFit;
use bench_plant::SignalPath;

/// The signals of a run at regular times.
pub(crate) struct RunSignals {
    /// Reference, command and position.
    pub(super) loop_signals: LoopSignals,
    missing: MissingTicks,
    /// The readings, if they are not at the regular times.
    aligned: Option<AlignedReadings>,
}

impl RunSignals {
    /// Signals in which missing ticks are interpolated. Positions are shifted to regular times, if `aligned` is given.
    pub(super) fn new(
        loop_signals: LoopSignals,
        missing: MissingTicks,
        aligned: Option<AlignedReadings>,
    ) -> RunSignals {
        let mut run = RunSignals {
            loop_signals,
            missing,
            aligned,
        };
        run.align();
        run
    }

    /// The missing ticks.
    pub(super) fn missing(&self) -> &MissingTicks {
        &self.missing
    }

    /// Number of missing ticks, whose values were replaced.
    pub(crate) fn filled_ticks(&self) -> u64 {
        self.missing.count()
    }

    /// Replaces the positions of missing ticks by those of fitted modes.
    pub(super) fn predict_missing(&mut self, fit: &ModalFit, path: &SignalPath) {
        let signals = &mut self.loop_signals.signals;
        self.missing.predict_by(fit, path, signals);
        if let Some(aligned) = &mut self.aligned {
            aligned.replace_missing(&signals.output);
        }
        self.align();
    }

    fn align(&mut self) {
        let output_m = &mut self.loop_signals.signals.output;
        let aligned = self.aligned.as_ref();
        if let Some(aligned_m) = aligned.and_then(|aligned| aligned.positions_m(output_m.len())) {
            *output_m = aligned_m;
        }
    }
}
