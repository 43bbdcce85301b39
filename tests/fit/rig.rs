//! A chirp on the simulated stage, and what its analysis says, against the model's own zeros with damping.
use bench::config::{Config, Source, load};
use bench::plant;
use bench::recording::Recording;
use bench::rt::thread::Pace;
use bench::session::{self, Analysis, AnalysisError, Plan, analyse};
use bench::sim::SimulatedRig;
use bench::zeros::{cnmp_pairs, damped_zeros};

/// The default stage, identified at 1 kHz as in section 5.2.2.
pub fn config(sets: &[String]) -> Config {
    let sets = std::iter::once("loop.rate_hz=1000".to_string()).chain(sets.iter().cloned()).collect();
    load(&Source { sets, ..Source::default() }).expect("the profile is valid")
}

/// The analysis of a run with `config`, believing `believed`.
pub fn analysed(config: &Config, believed: &Config) -> Analysis {
    analysed_run(&Plan::chirp(config.clone()), believed).expect("an analysis")
}

/// The analysis of a run by `plan`, believing `believed`.
pub fn analysed_run(plan: &Plan, believed: &Config) -> Result<Analysis, AnalysisError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = &plan.config;
    let rig = Box::new(SimulatedRig::new(config).expect("a rig"));
    let run = session::run(plan, rig, Pace::Virtual, folder.path(), &mut |_, _| {}).expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    analyse(&Recording::open(&path).expect("a recording"), believed)
}

/// CNMP pairs of the model with damping.
pub fn truth(config: &Config) -> usize {
    cnmp_pairs(&damped_zeros(&plant::build(&config.plant).expect("a model")).expect("zeros"))
}
