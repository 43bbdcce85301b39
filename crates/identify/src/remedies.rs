//! What to do about data that are no response of a mechanical system, in the terms of where they come from.

/// The ends of the messages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remedies {
    /// Modes describe the inverse of the response.
    pub swapped: &'static str,
    /// Most of the response is noise.
    pub incoherent: &'static str,
    /// The response grows with frequency.
    pub growing: &'static str,
    /// The output is before the input.
    pub early: &'static str,
}

/// Of two signals that the user selected.
pub(super) const OF_SIGNALS: Remedies = Remedies {
    swapped: "exchange --input and --output, which are swapped",
    incoherent: "the columns are not input and output of one system, or most of the band was not excited; select columns that belong together, or the band that was excited (--band)",
    growing: "exchange --input and --output if they are swapped, or extend --band if a mode lies right above it",
    early: "exchange --input and --output if they are swapped, or check that they were sampled at the same times",
};

/// Of a response that another program computed.
pub(super) const OF_RESPONSE: Remedies = Remedies {
    swapped: "the file is the response from output to input; give its inverse",
    incoherent: "most of the response is noise; measure with a larger amplitude or for longer, or select the band that was excited (--band)",
    growing: "give the inverse if the file is the response from output to input, or a response that reaches farther up if a mode lies right above it (--band may exclude it)",
    early: "give the inverse if the file is the response from output to input, or a response from whose phases no delay was removed",
};
