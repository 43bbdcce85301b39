//! `bench model placement`: the quadrants of section 4.2.4, and places for actuator and probe.

use std::path::{Path as FilePath, PathBuf};

use serde::Serialize;

use super::super::columns::cannot_write;
use super::super::error::CliError;
use super::super::output::print_result;
use super::placement_text::text;
use super::sweep::CloseModesArgs;
use bench_plant::{Port, PortWeights, ports};
use bench_report::{QuadrantPanel, quadrants_svg};
use bench_thesis::veering::placement::{Chosen, Path, PlacementReport, Placements};
use bench_thesis::veering::{Loci, QuadrantDiagram, meeting_pair, require_meeting};

/// The setting that varies, and the placements to try.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("from", |arg| arg.default_value("0.5%")))]
#[command(mut_arg("count", |arg| arg.default_value("41").value_parser(clap::value_parser!(u32).range(2..=1_000))))]
pub(super) struct Args {
    #[command(flatten)]
    modes: CloseModesArgs,
    /// Place of the actuator: a stage or node, or weights as in u=0.117,b=0.56 [default: as configured]
    #[arg(long, value_name = "PLACE")]
    actuator: Option<String>,
    /// Place of the probe, in the same notation as --actuator
    #[arg(long, value_name = "PLACE")]
    sensor: Option<String>,
    /// Draw the quadrants before, at and after the veering point to this file
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    profile: &'a str,
    vary: &'a str,
    #[serde(flatten)]
    placements: PlacementReport,
    svg: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    let sweep = &args.modes.sweep;
    let report = Report {
        profile: sweep.bench.profile(),
        vary: &sweep.vary,
        placements: placements(args)?,
        svg: args.svg.as_ref().map(|path| path.display().to_string()),
    };
    print_result(sweep.bench.json, &report, |report| {
        let svg = report.svg.as_ref();
        let file = svg.map_or(String::new(), |path| format!("picture in {path}\n"));
        text(report.profile, report.vary, &report.placements) + &file
    })
}

/// Tries the placements along the sweep, and draws the quadrants if requested.
fn placements(args: &Args) -> Result<PlacementReport, CliError> {
    let sweep = &args.modes.sweep;
    let values = sweep.values()?;
    let chosen = chosen(args, &places(args, values[0])?)?;
    let mut loci = Loci::follow(&values, |value| sweep.structure(value))?;
    let pair = meeting_pair(&args.modes.modes, &loci)?;
    let (meeting, closest) = loci.meeting(pair)?;
    require_meeting(meeting, closest.value, pair)?;
    let grid = values.iter().map(|value| loci.near(*value)).collect();
    let path = Path::new(grid, &closest, pair);
    let ports = path.modes.iter().map(|at| places(args, at.value));
    let ports = ports.collect::<Result<Vec<_>, _>>()?;
    let placements = Placements::new(&path, &ports, &chosen);
    if let Some(file) = &args.svg {
        let diagrams = path.diagrams(placements.own());
        draw(file, args, &diagrams, &placements.names)?;
    }
    Ok(PlacementReport::of(&placements, meeting)?)
}

/// The places of the plant at a value; a plant given by its modes has none.
fn places(args: &Args, value: f64) -> Result<Vec<Port>, CliError> {
    let places = ports(&args.modes.sweep.config(value)?.plant);
    if !places.is_empty() {
        Ok(places)
    } else {
        Err(CliError::Usage(
        "a plant given by its modes has no places for an actuator or a probe; describe it as masses and springs (plant.model = \"lumped\")".into(),
    ))
    }
}

fn chosen(args: &Args, places: &[Port]) -> Result<[Chosen; 2], CliError> {
    let parse = |option: &str, text: &Option<String>| {
        let Some(text) = text else { return Ok(None) };
        let weights = PortWeights::parse(text, places)
            .map_err(|why| CliError::Usage(format!("{option} {why}")))?;
        Ok::<Chosen, CliError>(Some((text.clone(), weights)))
    };
    Ok([
        parse("--actuator", &args.actuator)?,
        parse("--sensor", &args.sensor)?,
    ])
}

fn draw(
    file: &FilePath,
    args: &Args,
    diagrams: &[QuadrantDiagram; 3],
    [actuator, sensor]: &[String; 2],
) -> Result<(), CliError> {
    let sweep = &args.modes.sweep;
    let profile = sweep.bench.profile();
    let title = format!("{profile}: actuator at {actuator}, probe at {sensor}");
    let subtitle = format!(
        "Quadrants of the two close shapes over {} (section 4.2.4)",
        sweep.vary
    );
    let svg = quadrants_svg(&panels(diagrams), &title, &subtitle);
    let svg = svg.map_err(|e| CliError::Failed(e.to_string()))?;
    std::fs::write(file, svg).map_err(|e| cannot_write(file, &e))
}

fn panels(diagrams: &[QuadrantDiagram; 3]) -> Vec<QuadrantPanel> {
    let places = ["before", "at the veering point", "after"];
    let panels = places.into_iter().zip(diagrams);
    let panels = panels.map(|(place, diagram)| QuadrantPanel {
        title: format!("{place}: {:.6}", diagram.value),
        picture: diagram.clone(),
    });
    panels.collect()
}
