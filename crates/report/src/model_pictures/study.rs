//! A tolerance study: the probability of each number of CNMP pairs, and the share of each setting in its variance.

use crate::ReportError;
use crate::chart::colours::{BLUE, Colour, INK, ORANGE};
use crate::chart::{Chart, Pen, Row, Scale, sheet_svg};
use bench_study::{Answer, Counted, Probability};

const HISTOGRAM_HEIGHT: f64 = 300.0;
const PERCENT: f64 = 100.0;
/// Half the width of a bar.
const HALF_BAR: f64 = 0.4;
const BAR_STRENGTH: f64 = 0.6;
/// Settings and interactions that are drawn, the strongest first.
const SETTINGS: usize = 12;
const INTERACTIONS: usize = 6;
/// Height of a bar with its name in pixels.
const BAR_HEIGHT: f64 = 38.0;

/// Histograms of the number of CNMP pairs, without and with damping if that was counted, with 95 % confidence intervals; below them the
/// Sobol indices: the share of the variance of "has pairs" that each setting explains alone, and pairs of settings beyond that. As an
/// SVG document.
///
/// # Errors
/// When there is nothing to draw.
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
    let shares = counted
        .iter()
        .map(|(heading, counted)| (*heading, shares(counted)));
    let shares: Vec<(&str, Vec<Share>)> = shares.filter(|(_, bars)| !bars.is_empty()).collect();
    let bars = shares.iter().map(|(_, bars)| bars.len()).max().unwrap_or(0);
    let charts = shares
        .iter()
        .map(|(heading, bars)| share_chart(heading, bars));
    rows.push(Row::new(BAR_HEIGHT * bars as f64, charts.collect()));
    sheet_svg(title, subtitle, &rows)
}

fn histogram(heading: &str, counted: &Counted) -> Chart {
    let last = counted.probabilities.len() as f64;
    let x = Scale::count("Number of pairs of CNMP zeros").within(-0.6, last - 0.4);
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

/// What explains a share of the variance.
#[derive(Clone, Copy, PartialEq)]
enum Effect {
    Setting,
    Interaction,
}

impl Effect {
    fn colour(self) -> Colour {
        match self {
            Effect::Setting => BLUE,
            Effect::Interaction => ORANGE,
        }
    }

    fn legend_name(self) -> &'static str {
        match self {
            Effect::Setting => "setting alone",
            Effect::Interaction => "two settings together",
        }
    }
}

/// A bar of the chart of shares.
struct Share {
    name: String,
    percent: f64,
    effect: Effect,
}

/// Settings and interactions with their shares of the variance; empty with too few draws.
fn shares(counted: &Counted) -> Vec<Share> {
    let settings = counted.settings.iter().take(SETTINGS);
    let mut shares: Vec<Share> = settings
        .filter_map(|effect| Some(Share::new(&effect.key, effect.share?, Effect::Setting)))
        .collect();
    if !shares.is_empty() {
        let interactions = counted.interactions.iter().take(INTERACTIONS);
        shares.extend(
            interactions.map(|i| Share::new(&i.keys.join(" × "), i.share, Effect::Interaction)),
        );
    }
    shares
}

impl Share {
    fn new(name: &str, ratio: f64, effect: Effect) -> Share {
        Share {
            name: name.into(),
            percent: PERCENT * ratio,
            effect,
        }
    }
}

fn share_chart(heading: &str, shares: &[Share]) -> Chart {
    let largest = shares.iter().map(|share| share.percent).fold(1.0, f64::max);
    let x = Scale::linear("Share of the variance (%)").within(0.0, 1.1 * largest);
    let y = Scale::blank("").within(-(shares.len() as f64), 0.0);
    let heading = format!("{heading}: Sobol indices of \"has CNMP zeros\"");
    let mut chart = Chart::new(&heading, x, y);
    let mut before = None;
    for (row, share) in (0..).zip(shares) {
        // Only the first bar of a kind has an entry in the legend.
        let name = if before == Some(share.effect) {
            ""
        } else {
            share.effect.legend_name()
        };
        chart = with_share(chart, -f64::from(row), share, name);
        before = Some(share.effect);
    }
    chart
}

/// A bar below `top` with its name above it.
fn with_share(chart: Chart, top: f64, share: &Share, name: &str) -> Chart {
    let percent = share.percent;
    let outline = bar((0.0, top - 0.95), (percent.max(0.0), top - 0.5));
    let text = format!("{}: {percent:.1} %", share.name);
    chart
        .area(name, share.effect.colour(), BAR_STRENGTH, outline)
        .text_from((0.0, top - 0.27), (4.0, 0.0), &text)
}
