//! The commands printed on the page.

use std::process::Command;

use bench_test_support::program::{Bench, NO_DAEMON};

use crate::figures::all::{all, folder};

#[test]
fn every_command_of_the_page_runs_in_its_folder() {
    let bench = Bench::new();
    let place = bench.path(".");
    let mut commands: Vec<&str> = Vec::new();
    for made in all() {
        let Some(content) = made.content() else {
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
            .envs([NO_DAEMON])
            .output()
            .expect("bash");
        // Some loops of the thesis are unstable, for which `bench margins` exits with 1.
        let unstable = String::from_utf8_lossy(&output.stdout).contains("UNSTABLE");
        assert_eq!(
            output.status.code(),
            Some(i32::from(unstable)),
            "{command}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
}
