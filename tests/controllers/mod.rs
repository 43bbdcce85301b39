//! Controllers given as transfer functions and matrices: the sections have the response of the original, a discrete controller runs
//! as it is given, and files of other programs are read without loss.

mod convert;
mod fields;
mod files;
mod gates;
mod integrators;
mod refused;
mod response;
mod runs;

use bench_test_support::program;
