//! Properties of an excitation that follow from its settings alone (length, limits).

use super::sweep::ChirpSettings;
use super::{Excitation, Pattern};
use bench_base::finding::Finding;

/// The settings that every kind of excitation shares: band, rest times, fades and amplitude over frequency in
/// `[chirp]`, and the servo rate.
#[derive(Clone, Copy, Debug)]
pub struct SharedSettings<'a> {
    /// `[chirp]`.
    pub chirp: &'a ChirpSettings,
    /// Servo rate in hertz.
    pub rate_hz: f64,
}

impl SharedSettings<'_> {
    /// Length of a tick in seconds.
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// The tick nearest to a time in seconds.
    pub fn ticks(&self, seconds: f64) -> u64 {
        libm::round(seconds * self.rate_hz) as u64
    }

    /// Zero current before and after, in seconds.
    pub fn quiet_s(&self) -> f64 {
        self.chirp.quiet_before_s + self.chirp.quiet_after_s
    }

    /// The band as text.
    pub fn band(&self) -> String {
        format!("{} to {} Hz", self.chirp.start_hz, self.chirp.stop_hz)
    }
}

/// Length of an excitation including the zero current before and after, and the setting that determines it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Length {
    /// Length in ticks.
    pub ticks: f64,
    /// Key of the setting.
    pub key: &'static str,
    /// Value of the setting.
    pub value: f64,
}

/// The settings of one kind of excitation. This trait provides all properties in which the kinds differ.
pub trait ExcitationDesign {
    /// Kind, band and length as text.
    fn describe(&self, shared: &SharedSettings<'_>) -> String;

    /// Its length, computed without building it.
    fn length(&self, shared: &SharedSettings<'_>) -> Length;

    /// The excitation.
    fn build(&self, shared: &SharedSettings<'_>) -> Box<dyn Excitation>;

    /// How it repeats.
    fn pattern(&self, shared: &SharedSettings<'_>) -> Pattern {
        self.build(shared).pattern()
    }

    /// Relations between settings that no single range expresses.
    fn check(&self, _shared: &SharedSettings<'_>) -> Vec<Finding> {
        Vec::new()
    }

    /// Key of the setting of its current, for messages.
    fn amplitude_key(&self) -> &'static str {
        "chirp.amplitude"
    }

    /// Whether its amplitude follows `chirp.amplitude` over frequency.
    fn has_amplitude_curve(&self) -> bool {
        true
    }

    /// The amplitude in amperes of an excitation that has the same one at all frequencies, to be planned with the model.
    fn one_amplitude_a(&mut self) -> Option<&mut f64> {
        None
    }

    /// Whether its amplitude is planned with the model unless the user gives one.
    fn is_shaped_by_default(&self) -> bool {
        false
    }

    /// Whether it excites all frequencies at once, so that their displacements add up.
    fn is_broadband(&self) -> bool {
        false
    }

    /// The largest ratio between the largest and the smallest amplitude in the band, if it is limited.
    fn max_span(&self) -> Option<f64> {
        None
    }
}

/// The kind that a configuration chooses, with the settings that it shares with the others.
#[derive(Clone, Copy)]
pub struct ChosenExcitation<'a> {
    /// Settings of the kind.
    pub design: &'a dyn ExcitationDesign,
    /// Settings of all kinds.
    pub shared: SharedSettings<'a>,
}

impl ChosenExcitation<'_> {
    /// The excitation.
    pub fn build(&self) -> Box<dyn Excitation> {
        self.design.build(&self.shared)
    }

    /// How it repeats.
    pub fn pattern(&self) -> Pattern {
        self.design.pattern(&self.shared)
    }

    /// Kind, band and length as text.
    pub fn describe(&self) -> String {
        self.design.describe(&self.shared)
    }
}
