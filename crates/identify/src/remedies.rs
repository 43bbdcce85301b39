//! What to do about data that are no response of a mechanical system, in the terms of where they come from.

/// The ends of the messages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remedies {
    /// What excites the output.
    pub excitation: &'static str,
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
    excitation: "input",
    swapped: "exchange --input and --output, which are swapped",
    incoherent: "the columns are not input and output of one system, or most of the band was not excited; select columns that belong together, or the band that was excited (--band), or give the column of the reference if the record was taken in closed loop (--reference)",
    growing: "exchange --input and --output if they are swapped, or extend --band if a mode lies right above it",
    early: "exchange --input and --output if they are swapped, or check that they were sampled at the same times",
};

/// Of two signals of a closed loop and its reference.
pub(super) const OF_LOOP: Remedies = Remedies {
    excitation: "reference",
    swapped: "exchange --input and --output if they are swapped, or check the column of --reference, which must be independent of the noise",
    incoherent: "the columns are not those of one loop, or most of the band was not excited; select columns that belong together, or the band that was excited (--band)",
    growing: "check the columns of --input, --output and --reference, or extend --band if a mode lies right above it",
    early: "check the columns of --input, --output and --reference (the input is the whole signal that acts on the plant), and that they were sampled at the same times",
};

/// Of a response that another program computed.
pub(super) const OF_RESPONSE: Remedies = Remedies {
    excitation: "input",
    swapped: "the file is the response from output to input; give its inverse",
    incoherent: "most of the response is noise; measure with a larger amplitude or for longer, or select the band that was excited (--band)",
    growing: "give the inverse if the file is the response from output to input, or a response that reaches farther up if a mode lies right above it (--band may exclude it)",
    early: "give the inverse if the file is the response from output to input, or a response from whose phases no delay was removed",
};
