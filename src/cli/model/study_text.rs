//! The text of `bench model study`.

use super::super::table::{table, wrap};
use bench_study::{Answer, Counted, Deviation, Effect, Interaction, Probability, Varied};

pub(super) fn text(answer: &Answer) -> String {
    let shard = answer.shard.as_ref();
    let shard = shard.map_or(String::new(), |shard| format!(" of shard {shard}"));
    let tolerances: Vec<Vec<String>> = answer.varied.iter().map(tolerance).collect();
    let damped = answer.damped_cnmp_pairs.as_ref().map(counted);
    format!(
        "{}: {} draws{shard}, seed {}\n\n{}\nwithout damping\n{}{}{}",
        answer.model,
        answer.draws,
        answer.seed,
        table(&["setting", "nominal", "tolerance"], &tolerances),
        counted(&answer.cnmp_pairs),
        damped.map_or(String::new(), |text| format!("\nwith damping\n{text}")),
        not_analysed(answer),
    )
}

/// A key without the common `plant.`.
fn short(key: &str) -> &str {
    key.strip_prefix("plant.").unwrap_or(key)
}

fn tolerance(one: &Varied) -> Vec<String> {
    let deviation = match one.deviation {
        Deviation::Uniform { low, high } => {
            format!("{:+} to {:+}, uniform", rounded(low), rounded(high))
        }
        Deviation::Normal { sigma } => format!("sigma {}, normal", rounded(sigma)),
    };
    vec![
        short(&one.key).into(),
        rounded(one.nominal).to_string(),
        deviation,
    ]
}

/// Rounds to six digits.
fn rounded(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

const SHARE_LEGEND: &str = "share of the variance of \"has pairs\" that a setting explains alone; probability of pairs in the lower, middle and upper third of the setting";

fn counted(counted: &Counted) -> String {
    let probabilities = counted.probabilities.iter().chain([&counted.any]);
    let probabilities: Vec<Vec<String>> = probabilities.map(probability).collect();
    let settings: Vec<Vec<String>> = counted.settings.iter().map(effect).collect();
    let header = ["CNMP pairs", "draws", "probability %", "95 % by Wilson"];
    let effects_header = [
        "setting", "share %", "noise %", "sign", "lower %", "middle %", "upper %",
    ];
    format!(
        "{}\n{}{}{}",
        table(&header, &probabilities),
        wrap(SHARE_LEGEND, 0),
        table(&effects_header, &settings),
        interactions(counted),
    )
}

fn probability(p: &Probability) -> Vec<String> {
    vec![
        p.pairs.map_or("any".into(), |pairs| pairs.to_string()),
        p.draws.to_string(),
        percent(p.probability),
        format!("{} to {}", percent(p.low), percent(p.high)),
    ]
}

const SIDES_LEGEND: &str = "probability of pairs with both settings on the same side of their medians, and on opposite sides";

fn interactions(counted: &Counted) -> String {
    let sums = format!(
        "first-order effects explain {} % of the variance, second-order interactions {} %; the rest is of higher order",
        maybe_percent(counted.share_alone),
        maybe_percent(counted.share_of_interactions)
    );
    if counted.interactions.is_empty() {
        return wrap(&sums, 0);
    }
    let rows: Vec<Vec<String>> = counted.interactions.iter().map(interaction).collect();
    let header = ["settings", "share %", "noise %", "same %", "opposite %"];
    format!(
        "{}\n{}{}",
        wrap(&sums, 0),
        wrap(SIDES_LEGEND, 0),
        table(&header, &rows)
    )
}

fn effect(effect: &Effect) -> Vec<String> {
    let mut row = vec![
        short(&effect.key).to_string(),
        maybe_percent(effect.share),
        maybe_percent(effect.share_noise),
        effect.direction.to_string(),
    ];
    row.extend(effect.probability_by_third.map(maybe_percent));
    row
}

fn interaction(interaction: &Interaction) -> Vec<String> {
    vec![
        pair_of_keys(&interaction.keys),
        percent(interaction.share),
        percent(interaction.share_noise),
        maybe_percent(interaction.probability_same_side),
        maybe_percent(interaction.probability_opposite_sides),
    ]
}

/// Two keys, the second without the table that it shares with the first.
fn pair_of_keys([first, second]: &[String; 2]) -> String {
    let (first, second) = (short(first), short(second));
    let table = first.rsplit_once('.').map_or("", |(table, _)| table);
    let second = match second.strip_prefix(table) {
        Some(rest) if !table.is_empty() => rest.trim_start_matches('.'),
        _ => second,
    };
    format!("{first} x {second}")
}

fn percent(ratio: f64) -> String {
    format!("{:.2}", 100.0 * ratio)
}

fn maybe_percent(ratio: Option<f64>) -> String {
    ratio.map_or("-".into(), percent)
}

fn not_analysed(answer: &Answer) -> String {
    let missing = &answer.not_analysed;
    if missing.draws == 0 {
        return String::new();
    }
    let examples = missing.examples.iter();
    let examples = examples.map(|failure| format!("  draw {}: {}\n", failure.draw, failure.why));
    format!(
        "\n{} draws could not be analysed; no probability includes them:\n{}",
        missing.draws,
        examples.collect::<String>()
    )
}
