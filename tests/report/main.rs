//! What the report room promises. The pictures that these tests draw are left in `target/tmp`, to look at.

mod bode;
mod map;
mod nyquist;
mod phase;
mod pictures;
mod run;
#[allow(
    dead_code,
    reason = "made for the tests of identify, which use all of it"
)]
#[path = "../identify/stage.rs"]
mod stage;
mod svg;
#[allow(
    dead_code,
    reason = "made for the tests of the thesis, which use all of it"
)]
#[path = "../thesis/truth.rs"]
mod truth;
