//! Two modes of close frequencies (Chapter 4): loci that approach each other as a setting varies, and part or cross.

mod loci;

pub use loci::{Loci, Meeting, ModesAt};
