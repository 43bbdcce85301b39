//! A measured frequency response with what files state beside it.

use bench_identify::Frf;

/// A measured frequency response, and what files state beside it.
#[derive(Clone, Copy, Debug)]
pub struct Response<'a> {
    /// The response from current (A) to displacement (m).
    pub frf: &'a Frf,
    /// Period of the loop in seconds.
    pub period_s: f64,
    /// Name of the recording.
    pub source: &'a str,
}
