//! Sections of a page about the run itself: its scheduling and its configuration.

use super::page::{self, named};
use crate::html::{document_with_plots, escaped, facts, note, section};
use crate::table::Table;
use crate::{joined, plant_conditions};
use bench_config::{Config, SettingDifference, changed_settings};
use bench_experiment::{Description, Ending, TripSummary};
use bench_recording::{Recording, event_text};

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

/// Most events that a page lists.
const MOST_EVENTS: usize = 200;
/// Most characters of a value in the table of changed settings.
const LONGEST_VALUE: usize = 36;

/// An entry of the recording's metadata; empty if it is missing.
pub(super) fn metadata<'a>(recording: &'a Recording, name: &str) -> &'a str {
    recording.metadata().get(name).map_or("", String::as_str)
}

/// Operating point and mass asymmetry of the plant, devices or simulation, and the time of the start.
pub(super) fn conditions(recording: &Recording, config: &Config) -> String {
    joined(&[
        &plant_conditions(&config.plant, &[]),
        &devices(recording),
        metadata(recording, "started"),
    ])
}

/// The devices that moved and measured the stage.
fn devices(recording: &Recording) -> String {
    const SIMULATED: &str = "simulated";
    let (amplifier, probe) = (
        metadata(recording, "amplifier"),
        metadata(recording, "probe"),
    );
    match (amplifier, probe) {
        ("", "") => String::new(),
        (SIMULATED, SIMULATED) => "simulated stage".into(),
        _ => format!("amplifier {amplifier}, probe {probe}"),
    }
}

/// The page of a recording, with the name of the run as its title; `title` if it has none.
pub(super) fn document(recording: &Recording, title: &str, body: &str) -> String {
    let name = Description::of(recording).name;
    document_with_plots(name.as_deref().unwrap_or(title), body)
}

/// The heading of the page of a recording.
pub(super) fn heading(recording: &Recording, title: &str, subtitle: &str) -> String {
    let name = Description::of(recording).name;
    page::heading(name.as_deref(), title, subtitle, &record(recording))
}

/// The name of the file, as the page states it.
pub(super) fn record(recording: &Recording) -> String {
    let file = recording.path().file_name().unwrap_or_default();
    format!("Recording {}", file.to_string_lossy())
}

/// The command, its description, and the settings that differ from the profile.
pub(super) fn command_and_settings(recording: &Recording, config: &Config) -> String {
    let description = Description::of(recording);
    let invocation = description.invocation.as_ref();
    let profile = invocation.map(|made| made.profile.clone());
    let text = |name: &str| Some(metadata(recording, name).to_string());
    let text = |name: &str| text(name).filter(|text| !text.is_empty());
    let pairs = named([
        ("Kind of run", text("run")),
        ("Command", invocation.map(|made| made.command_line.clone())),
        ("Name", description.name.clone()),
        ("Note", description.note.clone()),
        ("Operator", description.operator.clone()),
        ("Started", text("started")),
        ("Override", text("override")),
        ("Profile", profile.clone()),
    ]);
    let settings = profile.map(|profile| changed(&profile, config));
    section(
        "Command and settings",
        &(facts(&pairs) + &settings.unwrap_or_default()),
    )
}

/// A table of the settings that differ from the profile.
fn changed(profile: &str, config: &Config) -> String {
    let Ok(changed) = changed_settings(profile, config) else {
        return note(&format!(
            "The profile {profile} cannot be read here, so that the settings that differ from it are not known."
        ));
    };
    if changed.is_empty() {
        return note("All settings are those of the profile.");
    }
    let columns = ["Setting", "Value", "In the profile"];
    let table = Table::new(columns).with_rows(changed.iter().map(setting_row));
    note("Settings that differ from the profile:") + &table.html()
}

/// A setting, its value, and that of the reference.
pub(super) fn setting_row(setting: &SettingDifference) -> Vec<String> {
    vec![
        setting.key.clone(),
        setting_cell(setting.value.as_deref()),
        setting_cell(setting.reference.as_deref()),
    ]
}

/// The value of a setting as the cell of a table.
fn setting_cell(value: Option<&str>) -> String {
    value.map_or("not set".into(), shortened)
}

/// The beginning of a long value, for example of a table of measured points. The configuration has all of it.
fn shortened(value: &str) -> String {
    match value.char_indices().nth(LONGEST_VALUE) {
        Some((end, _)) => format!("{} …", &value[..end]),
        None => value.into(),
    }
}

/// Why the run ended, unless it was completed.
pub(super) fn ending(recording: &Recording) -> String {
    let ending = Ending::of(recording);
    let text = match TripSummary::of(ending) {
        Some(trip) => {
            let time_s = trip.tick as f64 * recording.period_s().unwrap_or_default();
            let (why, remedy) = (escaped(&trip.text), escaped(trip.remedy));
            format!("<strong>tripped</strong><br>After {time_s:.4} s: {why}<br>Remedy: {remedy}")
        }
        None if ending == Ending::Completed => return String::new(),
        None => format!(
            "<strong>{}</strong><br>The run did not come to its end.",
            escaped(&ending.name().replace('_', " "))
        ),
    };
    format!("<p class=\"verdict detected\">{text}</p>\n")
}

/// The events of the run in their order.
pub(super) fn events(recording: &Recording) -> String {
    let events = recording.events();
    if events.is_empty() {
        return String::new();
    }
    let period_s = recording.period_s().unwrap_or_default();
    let shown = events.iter().take(MOST_EVENTS);
    let rows = shown.map(|event| {
        let time_s = event.tick as f64 * period_s;
        vec![
            format!("{time_s:.4}"),
            event.tick.to_string(),
            event_text(event),
        ]
    });
    let table = Table::new(["Time (s)", "Tick", "Event"]).with_rows(rows);
    let left = events.len().saturating_sub(MOST_EVENTS);
    let left = match left {
        0 => String::new(),
        left => note(&format!("{left} further events are in the recording.")),
    };
    section("Events", &(table.html() + &left))
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
