//! Controllers, margins and designs, with the model and with measured plants.

mod controllers;
mod lab;
mod measured;
mod tune;
