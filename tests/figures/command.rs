//! `bench figures` as a person meets it, and every command that the page prints.

use std::process::Command;

use crate::all::{all, folder};
use crate::program::Bench;

#[test]
fn two_figures_are_two_files_and_a_page() {
    let bench = Bench::new();
    let answer = bench.json("figures --only 4-2,table-2-2 --output pictures");
    let numbers: Vec<&str> = answer["figures"]
        .as_array()
        .expect("a list")
        .iter()
        .map(|f| f["number"].as_str().expect("a number"))
        .collect();
    assert_eq!(numbers, ["table-2-2", "4-2"]);
    assert_eq!(answer["page"], "pictures/index.html");
    let mut names: Vec<String> = std::fs::read_dir(bench.path("pictures"))
        .expect("a folder")
        .map(|e| {
            e.expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    names.sort();
    assert_eq!(names, ["fig-4-2.svg", "index.html"]);
    assert!(bench.read("pictures/index.html").contains("Table 2-2"));
}

#[test]
fn an_unknown_number_is_refused_before_anything_is_written() {
    let bench = Bench::new();
    bench
        .run("figures --only 9-1")
        .is_refused(&["`9-1`", "2-5", "6-13", "table-3-4"]);
    assert!(bench.files().is_empty());
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let bench = Bench::new();
    bench.write("figures", "a file");
    let answer = bench.run("figures --only 4-2");
    assert_eq!(answer.code, 1, "{answer:?}");
    assert!(
        answer.err.contains("figures") && answer.err.contains("--output"),
        "{}",
        answer.err
    );
}

#[test]
fn every_command_on_the_page_runs_in_the_folder_of_the_page() {
    let bench = Bench::new();
    let place = bench.path(".");
    let mut commands: Vec<&str> = Vec::new();
    for made in all() {
        let Ok((content, _)) = &made.outcome else {
            continue;
        };
        for (name, _) in &content.files {
            std::fs::copy(folder().join(name), place.join(name)).expect("a file beside the page");
        }
        commands.extend(content.commands.iter().map(String::as_str));
    }
    commands.sort_unstable();
    commands.dedup();
    assert!(commands.len() > 60, "{}", commands.len());
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_bench"))
        .parent()
        .expect("a folder")
        .display()
        .to_string();
    let path = format!("{program}:{}", std::env::var("PATH").unwrap_or_default());
    for command in commands {
        let output = Command::new("bash")
            .args(["-c", command])
            .current_dir(&place)
            .env("PATH", &path)
            .output()
            .expect("bash");
        assert!(
            output.status.success(),
            "{command}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
