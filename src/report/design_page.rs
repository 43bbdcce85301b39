//! The page of a designed controller: goal, figures of every plant, what limits the design, plots.

use super::html::{document_with_plots, escaped, facts, note, picture, row, section, table};
use super::number::interval;
use crate::control::tuning::{Binding, PlantFigures};
use crate::experiment::tuning::{FrfEvidence, ModeRole};
use crate::util::units::UM_PER_M;

const FIGURES_NOTE: &str = "Modulus margin: smallest distance of L from -1, with everything that the plant lacks at its most \
    unfavourable phase. Slope: largest frequency w_s with |S(jw)| ≤ 0.707 w/w_s for all w ≤ w_s. Bandwidth: up to it |S| ≤ 0.707.";
const BINDING_NOTE: &str =
    "Requirements that are fulfilled with almost no slack, the tightest first.";
const FRF_NOTE: &str = "Lower margin: smallest |1 + L| − 2.448 σ |C| over the measured frequencies, with σ the standard deviation of \
    one component of the response; the true response lies within this disc with 95 %. Modulus margin: ± 95 % confidence interval.";
const LOOP_CAPTION: &str = "|L|, |S| and |KS| with every plant. Dashed: the limits.";
const NYQUIST_CAPTION: &str =
    "L with every plant. The disc around -1, whose radius is the modulus margin, is not entered.";
/// Rows of the table of binding requirements.
const BINDING_ROWS: usize = 20;

/// What the page shows.
#[derive(Clone, Copy, Debug)]
pub struct DesignPage<'a> {
    /// Controller, goal and margin in a line.
    pub title: &'a str,
    /// Names and values of goal, limits and settings of the search.
    pub facts: &'a [(String, String)],
    /// Distance to the convex bound, if it was computed.
    pub bound: Option<&'a str>,
    /// The figures of each plant.
    pub plants: &'a [PlantFigures],
    /// Requirements that limit the design.
    pub binding: &'a [Binding],
    /// The measured responses, of a design from them.
    pub frfs: &'a [FrfEvidence],
    /// Remarks, for example about uncertain signs.
    pub remarks: &'a [String],
    /// |L|, |S| and |KS| as SVG.
    pub loop_svg: &'a str,
    /// Nyquist plot as SVG.
    pub nyquist_svg: &'a str,
    /// The controller file.
    pub controller: &'a str,
}

impl DesignPage<'_> {
    /// The page as an HTML document.
    pub fn html(&self) -> String {
        let body = [
            format!("<h1>{}</h1>\n", escaped(self.title)),
            self.remarks.iter().map(|text| note(text)).collect(),
            section("Goal and limits", &self.goal()),
            self.measured(),
            self.figures(),
            self.limits(),
            section(
                "Loop",
                &picture(self.loop_svg, "Loop, sensitivity and control", LOOP_CAPTION),
            ),
            section(
                "Nyquist plot",
                &picture(self.nyquist_svg, "Nyquist plot", NYQUIST_CAPTION),
            ),
            section(
                "Controller",
                &format!("<pre>{}</pre>\n", escaped(self.controller)),
            ),
        ];
        document_with_plots(self.title, &body.concat())
    }

    fn goal(&self) -> String {
        let bound = self.bound.map_or(String::new(), note);
        facts(self.facts) + &bound
    }

    fn figures(&self) -> String {
        let header = [
            "Plant",
            "Modulus margin",
            "Slope (rad/s)",
            "Bandwidth (rad/s)",
            "|S| at 10 rad/s",
            "|KS| (A/µm)",
            "Error rms (µm)",
        ];
        let rows: String = self.plants.iter().map(figures_row).collect();
        section("Plants", &(note(FIGURES_NOTE) + &table(&header, &rows)))
    }

    fn limits(&self) -> String {
        let header = ["Requirement", "Plant", "Frequency (rad/s)", "Slack (%)"];
        let rows: String = self
            .binding
            .iter()
            .take(BINDING_ROWS)
            .map(binding_row)
            .collect();
        let body = note(BINDING_NOTE) + &table(&header, &rows);
        section("What limits the design", &body)
    }

    fn measured(&self) -> String {
        if self.frfs.is_empty() {
            return String::new();
        }
        let header = [
            "Plant",
            "Lower margin",
            "at (Hz)",
            "Modulus margin",
            "Band (Hz)",
            "CNMP zeros",
            "Modes used with sign (Hz)",
            "Tolerated above the band (µm/A)",
        ];
        let rows: String = self.frfs.iter().map(frf_row).collect();
        let files: Vec<(String, String)> = self
            .frfs
            .iter()
            .map(|frf| {
                (
                    frf.plant.clone(),
                    format!("{}, SHA-256 {}", frf.file, frf.sha256),
                )
            })
            .collect();
        let body = note(FRF_NOTE) + &table(&header, &rows) + &facts(&files);
        section("Measured responses", &body)
    }
}

fn figures_row(figures: &PlantFigures) -> String {
    row(&[
        figures.plant.clone(),
        format!("{:.4}", figures.modulus_margin),
        format!("{:.1}", figures.slope_bandwidth_rad_s),
        format!("{:.1}", figures.sensitivity_bandwidth_rad_s),
        format!("{:.4}", figures.sensitivity_at_10_rad_s),
        format!("{:.4}", figures.control_sensitivity_a_per_um),
        known(figures.error_rms_m * UM_PER_M),
    ])
}

/// A number with four digits, or a dash if it is not known.
fn known(value: f64) -> String {
    match value.is_finite() {
        true => format!("{value:.4}"),
        false => "–".into(),
    }
}

fn binding_row(binding: &Binding) -> String {
    let frequency = binding.frequency_rad_s;
    row(&[
        binding.requirement.to_string(),
        binding.plant.clone(),
        frequency.map_or("all".into(), |w| format!("{w:.1}")),
        format!("{:.2}", 100.0 * binding.slack),
    ])
}

fn frf_row(frf: &FrfEvidence) -> String {
    let [first_hz, last_hz] = frf.band_hz;
    let margin = frf.modulus_margin;
    row(&[
        frf.plant.clone(),
        format!("{:.4}", frf.modulus_margin_lower),
        format!("{:.2}", frf.modulus_margin_lower_at_hz),
        margin.map_or("–".into(), |margin| {
            interval(margin.value, margin.half_width_95())
        }),
        format!("{first_hz:.2} to {last_hz:.1}"),
        frf.cnmp.name().to_string(),
        signed_modes(frf),
        format!("{:.1}", frf.tolerated_above_m_per_a * UM_PER_M),
    ])
}

/// Frequency and sign of each mode that is used with its sign.
fn signed_modes(frf: &FrfEvidence) -> String {
    let signed = frf
        .modes
        .iter()
        .filter(|used| used.role == ModeRole::Signed);
    let texts: Vec<String> = signed
        .map(|used| format!("{:.2} {}", used.mode.frequency_hz().value, used.mode.sign()))
        .collect();
    texts.join(", ")
}
