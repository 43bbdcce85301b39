//! Excitation, frequency responses, fits and verdicts beside closed forms and other programs; parsers with random input.

mod excitation;
mod fit;
mod identify;
mod random_inputs;
mod sequential;
