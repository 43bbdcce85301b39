//! The page of a designed controller: goal, figures of every plant, what limits the design, plots.

use super::figures::{binding_table, frf_table, plant_table};
use super::html::{document_with_plots, escaped, facts, note, picture, section};
use bench_base::units::UM_PER_M;
use bench_experiment::tuning::DesignCertificate;

const FIGURES_NOTE: &str = "Margin: modulus margin, the smallest distance of L from -1 with everything that the plant lacks at its \
    most unfavourable phase. Slope: largest frequency w_s in rad/s with |S(jw)| ≤ 0.707 w/w_s for all w ≤ w_s. Bandwidth: in rad/s, up \
    to it |S| ≤ 0.707. |S| at 10: at 10 rad/s. |KS|: its largest value. RMS: error and current under the disturbance and the noise. Gain \
    margin, phase: without what the plant lacks.";
const BINDING_NOTE: &str =
    "Requirements that are fulfilled with almost no slack, the tightest first.";
const FRF_NOTE: &str = "Lower margin: smallest |1 + L| − 2.448 σ |C| over the measured frequencies, with σ the standard deviation of \
    one component of the response; the true response lies within this disc with 95 %. Modulus margin: ± 95 % confidence interval.";
const LOOP_CAPTION: &str = "|L|, |S| and |KS| with every plant. Dashed: the limits.";
const NYQUIST_CAPTION: &str =
    "L with every plant. The disc around -1, whose radius is the modulus margin, is not entered.";
/// Rows of the table of binding requirements.
const BINDING_ROWS: usize = 20;

/// A design with its plots.
#[derive(Clone, Copy, Debug)]
pub struct DesignPage<'a> {
    /// The design.
    pub certificate: &'a DesignCertificate,
    /// |L|, |S| and |KS| as SVG.
    pub loop_svg: &'a str,
    /// Nyquist plot as SVG.
    pub nyquist_svg: &'a str,
}

impl DesignPage<'_> {
    /// The page as an HTML document.
    pub fn html(&self) -> String {
        let title = self.certificate.title();
        let remarks = self.certificate.extras.remarks.iter();
        let body = [
            format!("<h1>{}</h1>\n", escaped(&title)),
            remarks.map(|text| note(text)).collect(),
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
                &format!(
                    "<pre>{}</pre>\n",
                    escaped(&self.certificate.controller_file())
                ),
            ),
        ];
        document_with_plots(&title, &body.concat())
    }

    fn goal(&self) -> String {
        let certificate = self.certificate;
        let bound = certificate.extras.bound.as_ref();
        let bound = bound.map(|bound| note(&bound.sentence(certificate.attained)));
        facts(&settings(certificate)) + &bound.unwrap_or_default()
    }

    fn figures(&self) -> String {
        let table = plant_table(&self.certificate.plants);
        section("Plants", &(note(FIGURES_NOTE) + &table.html()))
    }

    fn limits(&self) -> String {
        let table = binding_table(&self.certificate.binding).first(BINDING_ROWS);
        let body = note(BINDING_NOTE) + &table.html();
        section("What limits the design", &body)
    }

    fn measured(&self) -> String {
        let frfs = &self.certificate.extras.frfs;
        if frfs.is_empty() {
            return String::new();
        }
        let files: Vec<(String, String)> = frfs
            .iter()
            .map(|frf| {
                (
                    frf.plant.clone(),
                    format!("{}, SHA-256 {}", frf.file, frf.sha256),
                )
            })
            .collect();
        let body = note(FRF_NOTE) + &frf_table(frfs).html() + &facts(&files);
        section("Measured responses", &body)
    }
}

/// Goal, limits and settings of the search.
fn settings(certificate: &DesignCertificate) -> Vec<(String, String)> {
    let requirements = &certificate.requirements;
    let mut facts = vec![
        ("Goal".into(), certificate.goal_text()),
        (
            "Modulus margin".into(),
            format!(
                "at least {}, attained {:.4}",
                requirements.modulus_margin, certificate.modulus_margin
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
    facts.extend(requirements.margin_disc.map(|disc| {
        let (centre, radius) = (disc.centre, disc.radius);
        let text = format!(
            "L outside of the disc of radius {radius:.3} around {:.3}",
            -centre
        );
        ("Gain and phase margin".into(), text)
    }));
    let current = requirements.max_current_rms_a;
    facts.extend(current.map(|limit| ("Rms current".into(), format!("at most {limit} A"))));
    let disturbance = certificate.extras.disturbance.clone();
    facts.extend(disturbance.map(|file| ("Disturbance of".into(), file)));
    facts.extend([
        ("Order".into(), certificate.order.to_string()),
        ("Loop rate".into(), format!("{} Hz", certificate.rate_hz)),
        ("Configuration".into(), certificate.profile.clone()),
        ("Seed of the search".into(), certificate.seed.to_string()),
        ("Program".into(), format!("bench {}", certificate.version)),
    ]);
    facts
}
