//! A chirp on the simulated stage, and what its analysis says, against the model's own zeros with damping.
use bench::config::{Config, Source, load};
use bench::experiment::{Analysis, Plan};
use bench::model::plant;
use bench::model::zeros::{cnmp_pairs, damped_zeros};

use crate::simulated;

/// The default stage, identified at 1 kHz as in section 5.2.2.
pub fn config(sets: &[String]) -> Config {
    let sets = std::iter::once("loop.rate_hz=1000".to_string())
        .chain(sets.iter().cloned())
        .collect();
    load(&Source {
        sets,
        ..Source::default()
    })
    .expect("the profile is valid")
}

/// The analysis of a run with `config`, believing `believed`.
pub fn analysed(config: &Config, believed: &Config) -> Analysis {
    simulated::analysed(&Plan::chirp(config.clone()), believed).expect("an analysis")
}

/// CNMP pairs of the model with damping.
pub fn truth(config: &Config) -> usize {
    cnmp_pairs(&damped_zeros(&plant::build(&config.plant).expect("a model")).expect("zeros"))
}
