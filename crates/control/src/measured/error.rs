//! Why a measured response gives no margins.

/// A measured response that gives no margins. Frequencies are in hertz, as in the settings of the excitation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeasuredLoopError {
    /// Too few points.
    #[error(
        "the FRF has {0} frequencies, too few for margins; give the FRF of a sweep or a multisine"
    )]
    TooFew(usize),
    /// A point that is not finite, or not above the one before.
    #[error(
        "the FRF at {0} Hz is not a finite number with a frequency above the one before; write the file again with `bench identify`"
    )]
    Point(f64),
    /// A gap that may hide a resonance.
    #[error(
        "the FRF has no point between {from_hz:.4} and {to_hz:.4} Hz, a gap in which a resonance {width_hz:.2e} Hz wide would not be seen; repeat `bench chirp` with a sweep or a multisine over the whole band"
    )]
    Gap {
        /// Last frequency before the gap.
        from_hz: f64,
        /// First frequency after it.
        to_hz: f64,
        /// Width of a resonance there with the smallest damping ratio of the model.
        width_hz: f64,
    },
    /// |L| passes through 1 below the band, by the model.
    #[error(
        "the FRF begins at {first_hz:.4} Hz, but |L| passes through 1 below: it is {loop_gain:.3} there, and {least:.3} to {most:.3} below by the model; repeat `bench chirp` with a lower chirp.start_hz"
    )]
    CrossingBelow {
        /// First frequency.
        first_hz: f64,
        /// Measured |L| there.
        loop_gain: f64,
        /// Smallest |L| below it by the model.
        least: f64,
        /// Largest |L| below it by the model.
        most: f64,
    },
    /// |L| may reach 1 above the band, by the model.
    #[error(
        "the FRF ends at {last_hz:.4} Hz, but |L| may reach {most:.3} above it by the model, so that a crossover may be missing; repeat `bench chirp` with a higher chirp.stop_hz"
    )]
    CrossingAbove {
        /// Last frequency.
        last_hz: f64,
        /// Largest |L| above the band or at its end.
        most: f64,
    },
    /// The largest |S| lies at an end of the band, or may lie outside.
    #[error(
        "the peak of |S| may lie outside of the FRF, which extends from {first_hz:.4} to {last_hz:.4} Hz: |S| is at most {inside:.3} there, at {peak_hz:.4} Hz, and up to {outside:.3} outside by the model; repeat `bench chirp` with a wider band (chirp.start_hz, chirp.stop_hz)"
    )]
    PeakOutside {
        /// First frequency.
        first_hz: f64,
        /// Last frequency.
        last_hz: f64,
        /// Largest |S| inside.
        inside: f64,
        /// Its frequency.
        peak_hz: f64,
        /// Bound of |S| outside.
        outside: f64,
    },
}
