//! The certificate of a designed controller: what was required, and what was attained at which plant.

use serde::Serialize;

use super::evidence::FrfEvidence;
use bench_config::Config;
use bench_control::tuning::{
    Binding, ConvexBound, Design, DesignTask, Goal, PlantFigures, Requirements,
};
use bench_control::{ControllerFile, SectionSettings};

/// A design as the JSON object of `bench tune`. The names must not change.
#[derive(Clone, Debug, Serialize)]
pub struct DesignCertificate {
    /// Version of the program.
    pub version: &'static str,
    /// Name of the configuration.
    pub profile: String,
    /// Loop rate in hertz.
    pub rate_hz: f64,
    /// Number of poles of the controller.
    pub order: usize,
    /// Seed of the search.
    pub seed: u64,
    /// Goal and limits.
    pub requirements: Requirements,
    /// ws or wb in rad/s, or the standard deviation in metres, which all plants attain.
    pub attained: f64,
    /// Smallest modulus margin of all plants.
    pub modulus_margin: f64,
    /// The figures of each plant.
    pub plants: Vec<PlantFigures>,
    /// Requirements that limit the design, the tightest first.
    pub binding: Vec<Binding>,
    /// The controller.
    pub section: Vec<SectionSettings>,
    /// What is computed beside the design.
    #[serde(flatten)]
    pub extras: DesignExtras,
}

/// What is computed beside the design.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DesignExtras {
    /// The largest value of the goal that a linear controller of any order attains.
    pub bound: Option<ConvexBound>,
    /// With `--explain`: the controller with the opposite mass asymmetry.
    pub opposite: Option<OppositeAsymmetry>,
    /// The measured responses, with the margins of the controller around them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frfs: Vec<FrfEvidence>,
    /// The recording whose error is the disturbance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disturbance: Option<String>,
    /// What is not certain in the measured responses.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
}

/// The figures of a controller with the opposite mass asymmetry.
#[derive(Clone, Debug, Serialize)]
pub struct OppositeAsymmetry {
    /// m2/m3 - 1.
    pub mass_asymmetry: f64,
    /// The figures at each operating point.
    pub plants: Vec<PlantFigures>,
}

impl DesignCertificate {
    /// The certificate of a design for the configuration called `profile`.
    pub fn new(
        profile: &str,
        config: &Config,
        task: &DesignTask,
        design: &Design,
        extras: DesignExtras,
    ) -> DesignCertificate {
        let margins = design.figures.iter().map(|figures| figures.modulus_margin);
        DesignCertificate {
            version: env!("CARGO_PKG_VERSION"),
            profile: profile.into(),
            rate_hz: config.servo.rate_hz,
            order: design.cascade.order(),
            seed: task.seed,
            requirements: task.requirements.clone(),
            attained: design.attained,
            modulus_margin: margins.fold(f64::INFINITY, f64::min),
            plants: design.figures.clone(),
            binding: design.binding.clone(),
            section: design.cascade.sections(),
            extras,
        }
    }

    /// The controller file, with its figures in a comment.
    pub fn controller_file(&self) -> String {
        let file = ControllerFile {
            title: format!(
                "{} at {} Hz, order {}",
                self.stage_text(),
                self.rate_hz,
                self.order
            ),
            section: self.section.clone(),
        };
        let goal = self.goal_text();
        let margin = self.modulus_margin;
        let plants = self.plants.len();
        let toml = toml::to_string(&file).unwrap_or_default();
        format!(
            "# Designed by `bench tune`: {goal},\n# modulus margin {margin:.3} at all of {plants} plants.\n{toml}"
        )
    }

    /// What the controller is for.
    fn stage_text(&self) -> String {
        match self.extras.frfs.len() {
            0 => self.profile.clone(),
            1 => "1 measured plant".into(),
            count => format!("{count} measured plants"),
        }
    }

    /// Controller, goal and margin in a line.
    pub fn title(&self) -> String {
        format!(
            "controller of order {} for {} at {} Hz: {}, modulus margin {:.4}",
            self.order,
            self.stage_text(),
            self.rate_hz,
            self.goal_text(),
            self.modulus_margin
        )
    }

    /// The attained value of the goal.
    pub fn goal_text(&self) -> String {
        match self.requirements.goal {
            Goal::Disturbance => format!("slope bandwidth {:.1} rad/s", self.attained),
            Goal::Bandwidth => format!("sensitivity bandwidth {:.1} rad/s", self.attained),
            Goal::Rms => format!("rms of the error {:.4} um", self.attained * 1e6),
        }
    }
}
