//! `bench completions` and `bench man`: completions of shells, and manual pages.

use std::path::{Path, PathBuf};

use clap::Command;
use clap_complete::Shell;

use super::error::CliError;
use super::exit::Exit;
use super::output::print_text;

/// Which shell.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct CompletionArgs {
    /// The shell
    shell: Shell,
}

/// Where the manual pages go.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct ManArgs {
    /// Folder for the manual pages, one for each command [default: print the page of `bench` on standard output]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Prints the completions of `program` for a shell.
pub(super) fn run_completions(
    args: &CompletionArgs,
    mut program: Command,
) -> Result<Exit, CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "bench", &mut script);
    print_text(&String::from_utf8_lossy(&script))?;
    Ok(Exit::Done)
}

/// Writes the manual pages of `program`.
pub(super) fn run_man(args: &ManArgs, program: Command) -> Result<Exit, CliError> {
    match &args.out {
        Some(folder) => write_pages(&program, folder)?,
        None => print_text(&page(program)?)?,
    }
    Ok(Exit::Done)
}

fn write_pages(command: &Command, folder: &Path) -> Result<(), CliError> {
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(command.clone(), folder));
    written.map_err(|e| {
        let folder = folder.display();
        CliError::Failed(format!(
            "cannot write the manual pages to {folder}: {e}; choose another folder with --out"
        ))
    })
}

fn page(command: Command) -> Result<String, CliError> {
    let mut page = Vec::new();
    let rendered = clap_mangen::Man::new(command).render(&mut page);
    rendered.map_err(|e| {
        CliError::Failed(format!(
            "cannot write the manual page: {e}; report this with the command"
        ))
    })?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}
