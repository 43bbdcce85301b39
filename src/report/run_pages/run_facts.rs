//! Sections of a page about the run itself: its scheduling and its configuration.

use super::page::named;
use crate::recording::Recording;
use crate::report::html::{escaped, facts, section};

/// Entries of the recording's metadata that the page shows.
const METADATA: [&str; 11] = [
    "program",
    "host",
    "kernel",
    "pace",
    "policy",
    "memory_locked",
    "idle_states_off",
    "cpu",
    "refused",
    "amplifier",
    "probe",
];

/// An entry of the recording's metadata; empty if it is missing.
pub(super) fn metadata<'a>(recording: &'a Recording, name: &str) -> &'a str {
    recording.metadata().get(name).map_or("", String::as_str)
}

/// The name of the file.
pub(super) fn file_name(recording: &Recording) -> String {
    let file = recording.path().file_name().unwrap_or_default();
    file.to_string_lossy().into_owned()
}

/// How the loop was scheduled, and what it recorded. `more` are further counts.
pub(super) fn scheduling(recording: &Recording, more: &[(String, String)]) -> String {
    let entries = METADATA.map(|name| (label(name), metadata(recording, name).to_string()));
    let mut pairs = entries.to_vec();
    pairs.retain(|(_, text)| !text.is_empty());
    pairs.extend(counts(recording));
    pairs.extend_from_slice(more);
    pairs.extend(lateness(recording));
    section("The loop", &facts(&pairs))
}

fn counts(recording: &Recording) -> [(String, String); 3] {
    let counts = [
        ("Ticks", recording.tick_count()),
        ("Overruns", recording.overruns()),
        ("Lost records", recording.lost_records()),
    ];
    counts.map(|(name, count)| (name.to_string(), count.to_string()))
}

/// The largest wake-up latency and computation time; none at virtual pace, which has no clock.
fn lateness(recording: &Recording) -> Vec<(String, String)> {
    if metadata(recording, "pace") == "virtual" {
        return Vec::new();
    }
    let timings = recording.timings().iter();
    let latencies = timings.clone().map(|timing| timing.lateness_max_ns);
    let computations = timings.map(|timing| timing.compute_max_ns);
    named([
        ("Largest wake-up latency", Some(largest_us(latencies))),
        ("Longest computation", Some(largest_us(computations))),
    ])
}

/// The largest of some times in microseconds.
fn largest_us(times_ns: impl Iterator<Item = u64>) -> String {
    format!("{:.1} µs", times_ns.max().unwrap_or(0) as f64 / 1e3)
}

/// The configuration, which is folded.
pub(super) fn configuration(recording: &Recording, title: &str) -> String {
    let Some(toml) = recording.config_toml() else {
        return String::new();
    };
    let (title, toml) = (escaped(title), escaped(toml));
    let details = format!(
        "<details><summary>{title}</summary>\n<pre><code>{toml}</code></pre>\n</details>\n"
    );
    section("Configuration", &details)
}

/// `memory_locked` as `Memory locked`.
fn label(name: &str) -> String {
    let (first, rest) = name.split_at(1);
    first.to_uppercase() + &rest.replace('_', " ")
}
