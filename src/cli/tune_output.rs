//! Certificate and text of a design.

use std::path::Path;

use serde::Serialize;

use super::table::{table, wrap};
use super::tune_measured;
use crate::config::Config;
use crate::control::tuning::{
    Binding, ConvexBound, Design, DesignTask, Goal, PlantFigures, Requirements,
};
use crate::control::{ControllerFile, SectionSettings};
use crate::experiment::tuning::FrfEvidence;
use crate::report::DesignPage;
use crate::util::units::UM_PER_M;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
pub(super) struct Certificate {
    /// Version of the program.
    version: &'static str,
    profile: String,
    rate_hz: f64,
    order: usize,
    seed: u64,
    requirements: Requirements,
    /// ws or wb in rad/s, or the standard deviation in metres, which all plants attain.
    attained: f64,
    /// Smallest modulus margin of all plants.
    modulus_margin: f64,
    plants: Vec<PlantFigures>,
    /// Requirements that limit the design, the tightest first.
    binding: Vec<Binding>,
    section: Vec<SectionSettings>,
    #[serde(flatten)]
    extras: Extras,
}

/// What is computed beside the design.
#[derive(Debug, Serialize)]
pub(super) struct Extras {
    /// The largest value of the goal that a linear controller of any order attains.
    pub bound: Option<ConvexBound>,
    /// With `--explain`: the controller with the opposite mass asymmetry.
    pub opposite: Option<OppositeAsymmetry>,
    /// The measured responses, with the margins of the controller around them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frfs: Vec<FrfEvidence>,
    /// What is not certain in the measured responses.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
}

/// The figures of a controller with the opposite mass asymmetry.
#[derive(Debug, Serialize)]
pub(super) struct OppositeAsymmetry {
    /// m2/m3 - 1.
    pub mass_asymmetry: f64,
    /// The figures at each operating point.
    pub plants: Vec<PlantFigures>,
}

impl Certificate {
    pub(super) fn new(
        profile: &str,
        config: &Config,
        task: &DesignTask,
        design: &Design,
        extras: Extras,
    ) -> Certificate {
        let margins = design.figures.iter().map(|figures| figures.modulus_margin);
        Certificate {
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
    pub(super) fn controller_file(&self) -> String {
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

    /// The measured responses.
    pub(super) fn frfs(&self) -> &[FrfEvidence] {
        &self.extras.frfs
    }

    /// The page of the design.
    pub(super) fn page(&self, loop_svg: &str, nyquist_svg: &str) -> String {
        let bound = self.extras.bound.as_ref();
        let bound = bound.map(|bound| bound_sentence(bound, self.attained));
        let page = DesignPage {
            title: &self.title(),
            facts: &self.facts(),
            bound: bound.as_deref(),
            plants: &self.plants,
            binding: &self.binding,
            frfs: &self.extras.frfs,
            remarks: &self.extras.remarks,
            loop_svg,
            nyquist_svg,
            controller: &self.controller_file(),
        };
        page.html()
    }

    /// Goal, limits and settings of the search.
    fn facts(&self) -> Vec<(String, String)> {
        let requirements = &self.requirements;
        let mut facts = vec![
            ("Goal".into(), self.goal_text()),
            (
                "Modulus margin".into(),
                format!(
                    "at least {}, attained {:.4}",
                    requirements.modulus_margin, self.modulus_margin
                ),
            ),
        ];
        facts.extend(requirements.max_sensitivity.iter().map(|limit| {
            let (magnitude, omega_rad_s) = (limit.magnitude, limit.omega_rad_s);
            (
                "|S|".into(),
                format!("at most {magnitude} at {omega_rad_s} rad/s"),
            )
        }));
        let control = requirements.max_control_sensitivity_a_per_m;
        facts.extend(control.map(|limit| {
            let limit = limit / UM_PER_M;
            ("|KS|".into(), format!("at most {limit} A/µm"))
        }));
        facts.extend([
            ("Order".into(), self.order.to_string()),
            ("Loop rate".into(), format!("{} Hz", self.rate_hz)),
            ("Configuration".into(), self.profile.clone()),
            ("Seed of the search".into(), self.seed.to_string()),
            ("Program".into(), format!("bench {}", self.version)),
        ]);
        facts
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
    pub(super) fn title(&self) -> String {
        format!(
            "controller of order {} for {} at {} Hz: {}, modulus margin {:.4}",
            self.order,
            self.stage_text(),
            self.rate_hz,
            self.goal_text(),
            self.modulus_margin
        )
    }

    fn goal_text(&self) -> String {
        match self.requirements.goal {
            Goal::Disturbance => format!("slope bandwidth {:.1} rad/s", self.attained),
            Goal::Bandwidth => format!("sensitivity bandwidth {:.1} rad/s", self.attained),
            Goal::Rms => format!("rms of the error {:.4} um", self.attained * 1e6),
        }
    }
}

/// The design as text.
pub(super) fn text(certificate: &Certificate, explain: bool, folder: &Path) -> String {
    let title = certificate.title();
    let header = [
        "plant",
        "margin",
        "slope",
        "bandwidth",
        "|S| at 10",
        "|KS| A/um",
        "rms um",
        "rms A",
        "gain margin",
        "phase deg",
    ];
    let rows: Vec<Vec<String>> = certificate.plants.iter().map(plant_row).collect();
    let legend = "margin: modulus margin; slope, bandwidth: slope bandwidth and sensitivity bandwidth in rad/s; |S| at 10: at 10 rad/s; |KS|: largest value; rms: error and current under the disturbance and noise of the configuration; gain margin, phase: gain margin and phase margin";
    let folder = folder.display();
    let files = format!(
        "files: {folder}/controller.toml, certificate.json, report.html, loop.svg, nyquist.svg\nuse it: bench control --controller {folder}/controller.toml\n"
    );
    let binding = match explain {
        true => binding_text(&certificate.binding),
        false => String::new(),
    };
    let extras = &certificate.extras;
    let bound = extras.bound.as_ref();
    let bound = bound.map_or(String::new(), |bound| {
        bound_text(bound, certificate.attained)
    });
    let measured = tune_measured::text(&extras.frfs, &extras.remarks);
    let opposite = extras.opposite.as_ref();
    let opposite = opposite.map_or(String::new(), opposite_text);
    let parts = [
        wrap(&title, 0),
        table(&header, &rows),
        wrap(legend, 0),
        measured,
        bound,
        binding,
        opposite,
        files,
    ];
    parts.concat()
}

fn bound_text(bound: &ConvexBound, attained: f64) -> String {
    wrap(&bound_sentence(bound, attained), 0)
}

fn bound_sentence(bound: &ConvexBound, attained: f64) -> String {
    let (limit, half) = (bound.limit_rad_s, bound.with_half_rad_s);
    let (plant, functions) = (&bound.plant, bound.functions);
    let percent = 100.0 * attained / limit;
    // The value rises with the number of functions, so only one that hardly changes is a bound.
    let state = match limit / half < CONVERGED {
        true => "no linear controller of any order attains more".to_string(),
        false => format!("not converged ({half:.0} rad/s with half of them), the bound is larger"),
    };
    format!(
        "convex bound: {limit:.0} rad/s at {plant} with {functions} functions, {state}; this design attains {percent:.0} % of it"
    )
}

/// Ratio of the values with all and with half of the functions below which the bound does not depend on their number.
const CONVERGED: f64 = 1.05;

fn opposite_text(opposite: &OppositeAsymmetry) -> String {
    let percent = 100.0 * opposite.mass_asymmetry;
    let states = opposite.plants.iter().map(|figures| {
        let state = match figures.stable {
            true => format!("modulus margin {:.3}", figures.modulus_margin),
            false => "unstable".to_string(),
        };
        format!("{} {state}", figures.plant)
    });
    let states: Vec<String> = states.collect();
    let text = format!(
        "with the opposite asymmetry, {percent:+} %: {}",
        states.join("; ")
    );
    wrap(&text, 0)
}

fn plant_row(figures: &PlantFigures) -> Vec<String> {
    vec![
        figures.plant.clone(),
        format!("{:.4}", figures.modulus_margin),
        format!("{:.1}", figures.slope_bandwidth_rad_s),
        format!("{:.1}", figures.sensitivity_bandwidth_rad_s),
        format!("{:.4}", figures.sensitivity_at_10_rad_s),
        format!("{:.4}", figures.control_sensitivity_a_per_um),
        known(figures.error_rms_m * UM_PER_M),
        known(figures.current_rms_a),
        optional(figures.gain_margin, 2),
        optional(figures.phase_margin_deg, 1),
    ]
}

/// A standard deviation, which is not a number if the disturbance is not known.
fn known(value: f64) -> String {
    match value.is_finite() {
        true => format!("{value:.4}"),
        false => "-".into(),
    }
}

fn optional(value: Option<f64>, digits: usize) -> String {
    value.map_or("none".into(), |value| format!("{value:.digits$}"))
}

fn binding_text(binding: &[Binding]) -> String {
    let header = [
        "requirement that limits the design",
        "plant",
        "rad/s",
        "slack %",
    ];
    let rows: Vec<Vec<String>> = binding.iter().map(binding_row).collect();
    table(&header, &rows)
}

fn binding_row(binding: &Binding) -> Vec<String> {
    let frequency = binding
        .frequency_rad_s
        .map_or("all".into(), |w| format!("{w:.1}"));
    vec![
        binding.requirement.to_string(),
        binding.plant.clone(),
        frequency,
        format!("{:.2}", 100.0 * binding.slack),
    ]
}
