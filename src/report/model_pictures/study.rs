//! A tolerance study: the probability of each number of CNMP pairs, and the share of each setting in its variance.

use crate::model::study::{Answer, Counted, Probability};
use crate::report::ReportError;
use crate::report::chart::colours::{BLUE, Colour, INK, ORANGE};
use crate::report::chart::{Chart, Pen, Row, Scale, sheet_svg};

const HISTOGRAM_HEIGHT: f64 = 300.0;
const PERCENT: f64 = 100.0;
/// Half the width of a bar.
const HALF_BAR: f64 = 0.4;
const BAR_STRENGTH: f64 = 0.6;
/// Settings and interactions that are drawn, the strongest first.
const SETTINGS: usize = 12;
const INTERACTIONS: usize = 6;
/// Height of a bar with its name in pixels, and mean width of a character.
const BAR_HEIGHT: f64 = 38.0;
const CHARACTER: f64 = 6.7;

/// Histograms of the number of CNMP pairs, without and with damping if that was counted, with 95 % confidence intervals; below them the
/// Sobol indices: the share of the variance of "has pairs" that each setting explains alone, and pairs of settings beyond that. As an
/// SVG document.
///
/// # Errors
/// When drawing fails.
pub fn study_svg(answer: &Answer, title: &str, subtitle: &str) -> Result<String, ReportError> {
    let mut counted = vec![("Without damping", &answer.cnmp_pairs)];
    counted.extend(
        answer
            .damped_cnmp_pairs
            .iter()
            .map(|pairs| ("With damping", pairs)),
    );
    let histograms = counted
        .iter()
        .map(|(heading, counted)| histogram(heading, counted));
    let mut rows = vec![Row::new(HISTOGRAM_HEIGHT, histograms.collect())];
    let shares: Vec<(usize, Chart)> = counted
        .iter()
        .filter_map(|(heading, counted)| shares(heading, counted))
        .collect();
    let bars = shares.iter().map(|(bars, _)| *bars).max().unwrap_or(0);
    let charts = shares.into_iter().map(|(_, chart)| chart).collect();
    rows.push(Row::new(BAR_HEIGHT * bars as f64, charts));
    sheet_svg(title, subtitle, &rows)
}

fn histogram(heading: &str, counted: &Counted) -> Chart {
    let last = counted.probabilities.len() as f64;
    let x = Scale::linear("Number of pairs of CNMP zeros").within(-0.6, last - 0.4);
    let y = Scale::linear("Probability (%)").within(0.0, 1.05 * PERCENT);
    let chart = Chart::new(heading, x, y);
    let mut name = "share of the draws";
    let mut interval = "95 % confidence interval";
    let bars = (0..).zip(&counted.probabilities);
    bars.fold(chart, |chart, (pairs, probability)| {
        let middle = f64::from(pairs);
        let outline = bar(
            (middle - HALF_BAR, 0.0),
            (middle + HALF_BAR, percent(probability)),
        );
        let ends = [probability.low, probability.high].map(|p| (middle, PERCENT * p));
        let text = format!("{:.2} %", percent(probability));
        let chart = chart
            .area(std::mem::take(&mut name), BLUE, BAR_STRENGTH, outline)
            .line(
                std::mem::take(&mut interval),
                Pen::solid(INK),
                ends.to_vec(),
            );
        chart.text((middle, PERCENT * probability.high), (0.0, -12.0), &text)
    })
}

fn percent(probability: &Probability) -> f64 {
    PERCENT * probability.probability
}

/// The corners of a bar.
fn bar((left, bottom): (f64, f64), (right, top): (f64, f64)) -> Vec<(f64, f64)> {
    vec![(left, bottom), (right, bottom), (right, top), (left, top)]
}

/// The number of bars, and the chart of the shares; `None` with too few draws.
fn shares(heading: &str, counted: &Counted) -> Option<(usize, Chart)> {
    let settings = counted.settings.iter().take(SETTINGS);
    let mut bars: Vec<(String, f64, Colour)> = settings
        .filter_map(|effect| Some((effect.key.clone(), effect.share?, BLUE)))
        .collect();
    if bars.is_empty() {
        return None;
    }
    let interactions = counted.interactions.iter().take(INTERACTIONS);
    bars.extend(interactions.map(|i| (i.keys.join(" × "), i.share, ORANGE)));
    let largest = bars.iter().map(|(_, share, _)| *share).fold(0.01, f64::max);
    let count = bars.len();
    let x = Scale::linear("Share of the variance (%)").within(0.0, 1.1 * PERCENT * largest);
    let y = Scale::blank("").within(-(count as f64), 0.0);
    let heading = format!("{heading}: Sobol indices of \"has CNMP zeros\"");
    let mut names = [(BLUE, "setting alone"), (ORANGE, "two settings together")];
    let chart = (0..).zip(bars).fold(
        Chart::new(&heading, x, y),
        |chart, (row, (key, share, colour))| {
            let top = -f64::from(row);
            let outline = bar((0.0, top - 0.95), (PERCENT * share.max(0.0), top - 0.5));
            let name = names.iter_mut().find(|(of, _)| *of == colour);
            let name = name.map_or("", |(_, name)| std::mem::take(name));
            let text = format!("{key}  {:.1} %", PERCENT * share);
            let half_width = 0.5 * CHARACTER * text.chars().count() as f64;
            chart.area(name, colour, BAR_STRENGTH, outline).text(
                (0.0, top - 0.27),
                (half_width + 4.0, 0.0),
                &text,
            )
        },
    );
    Some((count, chart))
}
