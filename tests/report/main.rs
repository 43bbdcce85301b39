//! What the report room promises. The pictures that these tests draw are left in `target/tmp`, to look at.

mod bode;
mod phase;
mod pictures;
#[allow(dead_code)]
#[path = "../identify/stage.rs"]
mod stage;
mod svg;
