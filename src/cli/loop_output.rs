//! Responses and margins of a closed loop, as text.

use bench_base::decimal::Decimal;
use bench_experiment::outputs::LoopOutputs;
use bench_report::number::angular_frequency;
use bench_report::{crossing_count, place};

/// The files of the responses, and the measured margins beside those of the model.
pub(super) fn text(outputs: &LoopOutputs) -> String {
    format!(
        "  loop       {}\n  S          {}\n  T          {}\n  measured   {}\n",
        outputs.loop_csv,
        outputs.sensitivity_csv,
        outputs.complementary_csv,
        margins_text(outputs)
    )
}

fn margins_text(outputs: &LoopOutputs) -> String {
    let crossover = outputs.crossover_rad_s.map(angular_frequency);
    let crossover = crossover.unwrap_or("none in the band".into());
    let phase_margin = match (outputs.phase_margin_deg, outputs.phase_margin_sigma_deg) {
        (Some(deg), Some(sigma_deg)) => {
            format!("{:.2} ± {:.2} deg", Decimal(deg), 2.0 * sigma_deg)
        }
        _ => "none".into(),
    };
    format!(
        "crossover {crossover}, phase margin there {phase_margin},\n             {}modulus margin {:.4} ± {:.4} (by the model {:.4})",
        smallest_text(outputs),
        outputs.modulus_margin,
        2.0 * outputs.modulus_margin_sigma,
        outputs.predicted_modulus_margin
    )
}

/// The smallest phase margin, if it belongs to another crossing than the crossover.
fn smallest_text(outputs: &LoopOutputs) -> String {
    let smallest = outputs
        .smallest_phase_margin_deg
        .zip(outputs.smallest_phase_margin_rad_s);
    match smallest.filter(|(_, rad_s)| Some(*rad_s) != outputs.crossover_rad_s) {
        Some((deg, rad_s)) => format!(
            "smallest phase margin {:.2} deg {}{},\n             ",
            Decimal(deg),
            place(rad_s),
            crossing_count(outputs.crossings)
        ),
        None => String::new(),
    }
}
