//! The margins of a loop, by the model and measured, each with the frequency at which it is reached.

use super::{Figure, Quantity, crossing_count};
use bench_base::units::UM_PER_M;
use bench_control::measured::{LoopPeaks, MeasuredMargins};
use bench_control::{LoopMargins, Margins};
use bench_experiment::outputs::LoopOutputs;

const MS_PER_S: f64 = 1e3;

/// The margins of a stable loop by its model.
pub fn margins(margins: &Margins) -> Vec<Figure> {
    margin_figures(&margins.loop_margins, margins.crossings.len())
}

/// The margins of a stable loop with a measured plant, within the measured band.
pub fn measured_margins(margins: &MeasuredMargins) -> Vec<Figure> {
    let figures = margin_figures(&margins.loop_margins, margins.crossings.len()).into_iter();
    figures
        .map(|figure| figure.or("none in the band"))
        .collect()
}

fn margin_figures<Q: Copy + Into<Quantity>>(m: &LoopMargins<Q>, crossings: usize) -> Vec<Figure> {
    let phase_margin = Figure::new("Phase margin", m.phase_margin_deg, "deg", 2)
        .at(m.phase_margin_rad_s)
        .remark(&crossing_count(crossings));
    let delay_margin = Figure::new("Delay margin", m.delay_margin_s, "s", 3)
        .times(MS_PER_S, "ms")
        .at(m.delay_margin_rad_s);
    [
        vec![
            Figure::new("Crossover", m.crossover_rad_s, "rad/s", 2).in_hertz(),
            phase_margin,
        ],
        gain_margins(m),
        vec![delay_margin],
        sensitivity_figures(m),
    ]
    .concat()
}

/// The gain margin. Without a lower one it is the upper one.
fn gain_margins<Q: Copy + Into<Quantity>>(m: &LoopMargins<Q>) -> Vec<Figure> {
    let decibels =
        |name, margin_db: Option<Q>, rad_s| Figure::new(name, margin_db, "dB", 2).at(rad_s);
    let smallest = decibels("Gain margin", m.gain_margin_db, m.gain_margin_rad_s);
    if m.lower_gain_margin_db.is_none() {
        return vec![smallest];
    }
    let (upper_db, lower_db) = (m.upper_gain_margin_db, m.lower_gain_margin_db);
    vec![
        smallest,
        decibels("Upper gain margin", upper_db, m.upper_gain_margin_rad_s),
        decibels("Lower gain margin", lower_db, m.lower_gain_margin_rad_s),
    ]
}

fn sensitivity_figures<Q: Copy + Into<Quantity>>(m: &LoopMargins<Q>) -> Vec<Figure> {
    let bandwidth_rad_s = m.sensitivity_bandwidth_rad_s;
    vec![
        Figure::new("Modulus margin", m.modulus_margin, "", 4),
        Figure::new("Peak of S", m.sensitivity_peak_db, "dB", 2).at(Some(m.sensitivity_peak_rad_s)),
        Figure::new("Sensitivity bandwidth", bandwidth_rad_s, "rad/s", 2).in_hertz(),
    ]
}

/// The margins of a loop that a swept reference has measured.
pub fn swept_loop(outputs: &LoopOutputs) -> Vec<Figure> {
    let at_crossover = outputs
        .phase_margin_deg
        .map(|deg| Quantity::new(deg, outputs.phase_margin_sigma_deg));
    let at_crossover = at_crossover.unwrap_or(None::<f64>.into());
    let modulus = Quantity::new(outputs.modulus_margin, Some(outputs.modulus_margin_sigma));
    let by_the_model = format!(" (by the model {:.4})", outputs.predicted_modulus_margin);
    let mut figures = vec![
        Figure::new("Crossover", outputs.crossover_rad_s, "rad/s", 2).in_hertz(),
        Figure::new("Phase margin there", at_crossover, "deg", 2),
    ];
    let (smallest_deg, smallest_rad_s) = (
        outputs.smallest_phase_margin_deg,
        outputs.smallest_phase_margin_rad_s,
    );
    if smallest_rad_s != outputs.crossover_rad_s {
        figures.push(
            Figure::new("Smallest phase margin", smallest_deg, "deg", 2)
                .at(smallest_rad_s)
                .remark(&crossing_count(outputs.crossings)),
        );
    }
    figures.push(Figure::new("Modulus margin", modulus, "", 4).remark(&by_the_model));
    let in_band = figures
        .into_iter()
        .map(|figure| figure.or("none in the band"));
    in_band.collect()
}

/// The largest magnitudes of a loop with a measured plant.
pub fn loop_peaks(peaks: &LoopPeaks) -> Vec<Figure> {
    let (control, disturbance) = (peaks.control_peak_a_per_m, peaks.disturbance_peak_m_per_a);
    vec![
        Figure::new("Peak of T", peaks.complementary_peak, "", 4),
        Figure::new("Peak of C S", control, "A/m", 4).times(1.0 / UM_PER_M, "A/µm"),
        Figure::new("Peak of P S", disturbance, "m/A", 4).times(UM_PER_M, "µm/A"),
    ]
}
