//! Controllers given as transfer functions and matrices: the sections have the response of the original, a discrete controller runs
//! as it is given, and files of other programs are read without loss.

mod convert;
mod files;
mod refused;
mod runs;

use bench_test_support::program;
