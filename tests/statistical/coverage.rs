//! Coverage of the 95 % intervals of whole runs: frequency, damping ratio and residue of each mode, real and imaginary part of each
//! complex zero, over rates, excitations, noise and length.
//!
//! By default a few cells with few seeds. `BENCH_COVERAGE_SEEDS=200 cargo test --features statistical --test statistical coverage --
//! --nocapture` measures all cells and prints the table.

use bench_config::{Config, Purpose, Source, load};
use bench_experiment::{Analysis, Plan};
use bench_identify::Estimate;
use bench_identify::verdict::zeros;
use bench_plant::zeros::damped_zeros;
use bench_test_support::identified::{measurable, model, stands_for};
use bench_test_support::seeds::over_seeds;
use bench_test_support::sequences::decided;
use bench_test_support::simulated::analysed;
use nalgebra::Complex;

/// How the stage is excited.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Run {
    /// `bench chirp` with the excitation of the settings.
    Open,
    /// A swept reference.
    Closed,
    /// `bench chirp --until-decided`.
    Sequential,
}

struct Cell {
    name: &'static str,
    run: Run,
    rate_hz: u32,
    /// Factor of the noise of the probe and of the floor.
    noise: f64,
    sets: &'static [&'static str],
    /// Whether it is measured without `BENCH_COVERAGE_SEEDS`.
    is_default: bool,
}

const CHIRP_20_S: [&str; 4] = [
    "chirp.start_hz=2",
    "chirp.stop_hz=200",
    "chirp.duration_s=20",
    "chirp.fade_in_s=1",
];

const fn open(name: &'static str, sets: &'static [&'static str]) -> Cell {
    Cell {
        name,
        run: Run::Open,
        rate_hz: 1000,
        noise: 1.0,
        sets,
        is_default: false,
    }
}

const MULTISINE: &[&str] = &[
    "chirp.start_hz=2",
    "chirp.stop_hz=200",
    "excitation.kind=multisine",
    "multisine.period_s=10",
    "multisine.periods=5",
];

const CELLS: [Cell; 15] = [
    Cell {
        is_default: true,
        ..open("chirp, 20 s, 1 kHz", &CHIRP_20_S)
    },
    Cell {
        rate_hz: 2000,
        ..open("chirp, 20 s, 2 kHz", &CHIRP_20_S)
    },
    Cell {
        rate_hz: 5000,
        ..open("chirp, 20 s, 5 kHz", &CHIRP_20_S)
    },
    Cell {
        noise: 3.0,
        ..open("chirp, 20 s, noise x3", &CHIRP_20_S)
    },
    Cell {
        noise: 10.0,
        is_default: true,
        ..open("chirp, 20 s, noise x10", &CHIRP_20_S)
    },
    open(
        "chirp, 7 s",
        &[
            "chirp.start_hz=5",
            "chirp.stop_hz=200",
            "chirp.duration_s=7",
            "chirp.fade_in_s=0.5",
        ],
    ),
    open(
        "chirp, 120 s",
        &["chirp.stop_hz=200", "chirp.duration_s=120"],
    ),
    open(
        "two chirps of 10 s",
        &[
            "chirp.start_hz=5",
            "chirp.stop_hz=200",
            "chirp.duration_s=10",
            "chirp.fade_in_s=0.5",
            "chirp.repetitions=2",
        ],
    ),
    Cell {
        is_default: true,
        ..open("multisine, 5 periods of 10 s", MULTISINE)
    },
    Cell {
        rate_hz: 5000,
        ..open("multisine, 5 kHz", MULTISINE)
    },
    Cell {
        noise: 10.0,
        ..open("multisine, noise x10", MULTISINE)
    },
    open(
        "PRBS, 6 periods of 16 s",
        &[
            "chirp.start_hz=2",
            "chirp.stop_hz=200",
            "excitation.kind=prbs",
            "prbs.order=13",
            "prbs.periods=6",
        ],
    ),
    Cell {
        run: Run::Closed,
        rate_hz: 5000,
        ..open(
            "swept reference, 40 s",
            &[
                "control.controller=fast",
                "control.reference={kind=\"chirp\",travel_m=20e-6}",
                "control.duration_s=40",
            ],
        )
    },
    Cell {
        run: Run::Sequential,
        ..open("until decided, 1 kHz", &["chirp.stop_hz=450"])
    },
    Cell {
        run: Run::Sequential,
        noise: 3.0,
        ..open("until decided, noise x3", &["chirp.stop_hz=450"])
    },
];

/// Intervals that contain the truth, and all intervals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Count {
    within: u32,
    all: u32,
}

impl Count {
    fn add(&mut self, estimate: Estimate, truth: f64) {
        self.within += u32::from((estimate.value - truth).abs() < 1.96 * estimate.sigma);
        self.all += 1;
    }

    fn percent(self) -> f64 {
        100.0 * f64::from(self.within) / f64::from(self.all.max(1))
    }
}

/// Coverage that is reached, in percent: with 200 seeds 91.8 to 99.0, except residues with PRBS, 89.3, which include a mode at the limit
/// of detection. Near a mode the noise is known from few data.
const LEAST_PERCENT: f64 = 92.0;

/// Frequency, damping ratio, residue, Re z, Im z.
type Counts = [Count; 5];

impl Cell {
    fn config(&self, seed: u64) -> Config {
        let floor = |hz: f64, damping: f64, rms: f64| {
            let rms = rms * self.noise;
            format!(
                "{{frequency_hz={hz:?},damping_ratio={damping},acceleration_rms_m_per_s2={rms}}}"
            )
        };
        let floors = [floor(8.0, 0.1, 0.00081), floor(70.0, 0.02, 0.00179)].join(",");
        let mut sets = vec![
            format!("loop.rate_hz={}.0", self.rate_hz),
            format!("sim.seed={seed}"),
            format!("sim.probe_noise_rms_m={}", 40e-9 * self.noise),
            format!("sim.floor=[{floors}]"),
            // Modes above the band would be a bias of the fit, which has a constant in their place.
            "sim.unmodelled=[]".into(),
        ];
        sets.extend(self.sets.iter().map(|set| set.to_string()));
        load(&Source {
            sets,
            purpose: match self.run {
                Run::Closed => Purpose::Control,
                Run::Open | Run::Sequential => Purpose::Chirp,
            },
            ..Source::default()
        })
        .expect("valid settings")
    }

    fn analysis(&self, config: &Config) -> Analysis {
        match self.run {
            Run::Open => analysed(&Plan::chirp(config.clone()), config).expect("an analysis"),
            Run::Closed => {
                let plan = Plan::control(config.clone()).expect("a plan");
                analysed(&plan, &plan.config.clone()).expect("an analysis")
            }
            Run::Sequential => decided(config).analysis,
        }
    }

    /// The intervals of one seed.
    fn counts(&self, seed: u64) -> Counts {
        let config = self.config(seed);
        let analysis = self.analysis(&config);
        let mut counts = Counts::default();
        let Ok(fit) = analysis.fit else {
            return counts;
        };
        let modes = fit.modes();
        for [omega_rad_s, damping_ratio, residue_per_kg] in measurable(&model(&config), &modes) {
            let Some(mode) = stands_for(&modes, omega_rad_s) else {
                continue;
            };
            counts[0].add(mode.omega_rad_s, omega_rad_s);
            counts[1].add(mode.damping_ratio, damping_ratio);
            counts[2].add(mode.residue_per_kg, residue_per_kg);
        }
        let found = zeros(&fit).expect("zeros");
        for truth in complex_zeros(&config) {
            let off = |s: Complex<f64>| (s - truth).norm() / truth.norm();
            let near = found.iter().min_by(|a, b| off(a.s).total_cmp(&off(b.s)));
            let Some(zero) = near.filter(|zero| off(zero.s) < 0.05) else {
                continue;
            };
            let sigma = |k: usize| zero.covariance[k][k].sqrt();
            counts[3].add(
                Estimate {
                    value: zero.s.re,
                    sigma: sigma(0),
                },
                truth.re,
            );
            counts[4].add(
                Estimate {
                    value: zero.s.im,
                    sigma: sigma(1),
                },
                truth.im,
            );
        }
        counts
    }
}

/// The complex zeros of the model above the real axis.
fn complex_zeros(config: &Config) -> Vec<Complex<f64>> {
    let zeros = damped_zeros(&bench_plant::build(&config.plant).expect("a model")).expect("zeros");
    let zeros = zeros.iter().map(|zero| zero.s);
    zeros.filter(|s| s.im > 0.0).collect()
}

/// The counts of a cell over some seeds.
fn counts(cell: &Cell, seeds: u64) -> Counts {
    let mut sum = Counts::default();
    for counts in over_seeds(1..seeds + 1, |seed| cell.counts(seed)) {
        for (sum, one) in sum.iter_mut().zip(counts) {
            sum.within += one.within;
            sum.all += one.all;
        }
    }
    sum
}

#[test]
fn intervals_of_modes_and_zeros_of_runs_contain_the_truth() {
    let seeds = std::env::var("BENCH_COVERAGE_SEEDS");
    let seeds: Option<u64> = seeds.ok().map(|seeds| seeds.parse().expect("a number"));
    let only = std::env::var("BENCH_COVERAGE_CELL").unwrap_or_default();
    let cells = CELLS.iter().filter(|cell| match seeds {
        Some(_) => cell.name.contains(&only),
        None => cell.is_default,
    });
    let mut outside = Vec::new();
    for cell in cells {
        let counts = counts(cell, seeds.unwrap_or(20));
        let percents = counts.map(Count::percent);
        println!("{:30} {percents:5.1?} of {}", cell.name, counts[0].all);
        for count in counts {
            // Four standard deviations of a binomial count.
            let sigma = 100.0 * (0.95 * 0.05 / f64::from(count.all.max(1))).sqrt();
            let (low, high) = (LEAST_PERCENT - 4.0 * sigma, (97.0 + 4.0 * sigma).min(100.0));
            if !(low..=high).contains(&count.percent()) || count.all == 0 {
                outside.push(format!("{}: {counts:?}", cell.name));
            }
        }
    }
    assert!(outside.is_empty(), "{outside:#?}");
}
