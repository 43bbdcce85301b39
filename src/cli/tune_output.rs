//! Text of a design.

use std::path::Path;

use super::table::{result_table, wrap};
use super::tune_measured;
use bench_experiment::tuning::{DesignCertificate, OppositeAsymmetry};
use bench_report::figures::{binding_table, plant_table};

/// The design as text.
pub(super) fn text(certificate: &DesignCertificate, explain: bool, folder: &Path) -> String {
    let title = certificate.title();
    let legend = "Margin: modulus margin; Slope, Bandwidth: slope bandwidth and sensitivity bandwidth in rad/s; |S| at 10: at 10 rad/s; |KS|: largest value; RMS: error and current under the disturbance and noise of the configuration; Gain margin, Phase: gain margin and phase margin";
    let folder = folder.display();
    let files = format!(
        "files: {folder}/controller.toml, certificate.json, report.html, loop.svg, nyquist.svg\nuse it: bench control --controller {folder}/controller.toml\n"
    );
    let binding = if explain {
        result_table(&binding_table(&certificate.binding))
    } else {
        String::new()
    };
    let extras = &certificate.extras;
    let bound = extras.bound.as_ref();
    let bound = bound.map_or(String::new(), |bound| {
        wrap(&bound.sentence(certificate.attained), 0)
    });
    let measured = tune_measured::text(&extras.frfs, &extras.remarks);
    let opposite = extras.opposite.as_ref();
    let opposite = opposite.map_or(String::new(), opposite_text);
    let parts = [
        wrap(&title, 0),
        result_table(&plant_table(&certificate.plants)),
        wrap(legend, 0),
        measured,
        bound,
        binding,
        opposite,
        files,
    ];
    parts.concat()
}

fn opposite_text(opposite: &OppositeAsymmetry) -> String {
    let percent = 100.0 * opposite.mass_asymmetry;
    let states = opposite.plants.iter().map(|figures| {
        let state = if figures.stable {
            format!("modulus margin {:.3}", figures.modulus_margin)
        } else {
            "unstable".to_string()
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
