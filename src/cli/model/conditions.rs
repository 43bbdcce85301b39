//! `bench model conditions`: Conditions C4-1 to C4-4y and the propositions of section 4.2.3, for two close modes as one
//! setting varies.

use serde::Serialize;

use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::conditions_text::text;
use super::sweep::Sweep;
use super::veering::{self, hz};
use crate::config::Purpose;
use crate::model::plant::Structure;
use crate::model::veering::conditions::{Condition, c4_1, c4_2, deciding_residue, pattern};
use crate::model::veering::propositions::{Interval, Prediction, Proposition, Side, p4_1};
use crate::model::veering::{
    CloseModes, Loci, Meeting, ModesAt, Sample, Trajectory, ZeroConfiguration, as_configured,
};

/// What varies, which modes, and where to look closely.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// The setting that varies: any number
    #[arg(long, value_name = "KEY", default_value = "plant.operating_point_m", requires_all = ["from", "to"])]
    vary: String,
    /// First value; 3.8mm for a length, 8% for a ratio or of the beam length
    #[arg(
        long,
        value_name = "A",
        default_value = "0",
        allow_hyphen_values = true
    )]
    from: String,
    /// Last value; the veering point has to be between
    #[arg(
        long,
        value_name = "B",
        default_value = "15%",
        allow_hyphen_values = true
    )]
    to: String,
    /// Values of the grid; between them it is refined where zeros change
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    count: u32,
    /// The two modes, slowest first at the first value [default: the pair that comes closest]
    #[arg(long, value_name = "I,J", value_delimiter = ',')]
    modes: Vec<usize>,
    /// The value to explain [default: the setting's own, where it is in the range; else the veering point]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    at: Option<String>,
}

/// All that the command says.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub profile: String,
    pub vary: String,
    /// From 1, slowest first at the first value.
    pub modes: [usize; 2],
    /// What the two do where they are closest.
    pub meeting: &'static str,
    pub value: f64,
    pub frequency_hz: f64,
    pub gap_hz: f64,
    /// Values with CNMP zeros of the plant that belong to the two modes, from and to.
    pub cnmp_bands: Vec<[f64; 2]>,
    pub assumptions: Assumptions,
    pub here: Option<Here>,
    pub sides: Vec<SideJson>,
    pub p4_1: Tally,
    /// One a value of the grid; those where the modes cross are left out.
    pub rows: Vec<Row>,
}

/// How far the assumptions hold, at the value that is explained.
#[derive(Debug, Serialize)]
pub(super) struct Assumptions {
    /// A4-2: the larger damping ratio of the two modes, and what it is beside half their distance in frequency.
    pub damping_ratio: f64,
    pub damping_over_half_gap: Option<f64>,
    /// A4-4: mode R from 1, what the others give beside it, and its frequency beside those of the two.
    pub mode_r: Option<usize>,
    pub others_ratio: Option<f64>,
    pub nearness_ratio: Option<f64>,
    /// A4-5: the largest departure from a double integrator between the two modes.
    pub integrator_ratio: Option<f64>,
}

/// P4-1 at one value, with what to change.
#[derive(Debug, Serialize)]
pub(super) struct Here {
    pub value: f64,
    pub row: Row,
    pub proposition: PropositionJson,
    pub remedies: Vec<String>,
}

/// P4-1 over the grid.
#[derive(Debug, Default, Serialize)]
pub(super) struct Tally {
    pub values: usize,
    pub appear: usize,
    pub wrong_by_equation: usize,
    pub wrong_by_plant: usize,
}

/// The stretch on one side of the veering point, and what the propositions say of it.
#[derive(Debug, Serialize)]
pub(super) struct SideJson {
    pub side: &'static str,
    pub stretch: Option<[f64; 2]>,
    pub propositions: Vec<PropositionJson>,
}

#[derive(Debug, Serialize)]
pub(super) struct PropositionJson {
    pub name: &'static str,
    pub premises: Vec<ConditionJson>,
    pub foretold: &'static str,
    /// Whether Eq. (4-1), and whether the plant, has CMP-CNMP zeros there.
    pub equation: bool,
    pub plant: bool,
    pub agrees_with_equation: bool,
    pub agrees_with_plant: bool,
}

#[derive(Clone, Debug, Serialize)]
pub(super) struct ConditionJson {
    pub name: &'static str,
    pub holds: bool,
    pub figure: f64,
    /// `null` for no limit.
    pub limits: [Option<f64>; 2],
    pub margin: f64,
}

/// Eq. (4-1) at one value.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pub value: f64,
    pub u_hz: f64,
    pub v_hz: f64,
    pub residue_r_per_kg: f64,
    pub residue_u_per_kg: f64,
    pub residue_v_per_kg: f64,
    pub c4_1: ConditionJson,
    pub c4_2: ConditionJson,
    /// How the zeros of Eq. (4-1), and those of the plant, lie.
    pub equation: &'static str,
    pub plant: &'static str,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    let sweep = Sweep {
        bench: &args.bench,
        vary: &args.vary,
        from: &args.from,
        to: &args.to,
        count: args.count,
    };
    let values = sweep.values()?;
    let mut loci = Loci::follow(&values, |value| sweep.at(value))?;
    let pair = meeting_pair(&args.modes, &loci)?;
    let course = Trajectory::along(&mut loci, pair, as_configured)?;
    veers(course.meeting, course.stations[course.closest].value, pair)?;
    let value = explained(args, &sweep, &course)?;
    let closest = loci.at(course.stations[course.closest].value)?.clone();
    let at = loci.at(value)?.clone();
    let report = report(args, &values, &course, pair, [&closest, &at])?;
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&text(&report))
    }
}

/// The two modes as asked, or the first that meet inside the range.
pub(super) fn meeting_pair<F: FnMut(f64) -> Result<Structure, CliError>>(
    asked: &[usize],
    loci: &Loci<F>,
) -> Result<[usize; 2], CliError> {
    let count = loci.path()[0].omega_rad_s.len();
    if asked.is_empty() && count > 1 {
        return loci.meeting_pairs().first().copied().ok_or_else(|| {
            CliError::Usage(
                "no two modes veer or cross inside the range; move --from or --to, or vary another setting".into(),
            )
        });
    }
    veering::pair(asked, count, loci.closest_pair())
}

/// Refuses a range without a veering point.
pub(super) fn veers(meeting: Meeting, value: f64, [i, j]: [usize; 2]) -> Result<(), CliError> {
    if meeting != Meeting::AtTheEnd {
        return Ok(());
    }
    Err(CliError::Usage(format!(
        "modes {} and {} neither veer nor cross in the range: they are closest at its end, {value}; move --from or --to beyond it, or name two others with --modes",
        i + 1,
        j + 1
    )))
}

/// The value to explain: as asked, or the setting's own if it is in the range, or the veering point.
fn explained(args: &Args, sweep: &Sweep, course: &Trajectory) -> Result<f64, CliError> {
    let ends = [0, course.stations.len() - 1].map(|index| course.stations[index].value);
    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
    let inside = |value: &f64| (low..=high).contains(value);
    match &args.at {
        Some(text) => {
            let value = sweep.value(text)?;
            let outside = || {
                CliError::Usage(format!(
                    "--at {value} is outside of the range {low} to {high}"
                ))
            };
            Some(value).filter(inside).ok_or_else(outside)
        }
        None => Ok(own(args)?
            .filter(inside)
            .unwrap_or(course.stations[course.closest].value)),
    }
}

/// The setting's value in the configuration.
fn own(args: &Args) -> Result<Option<f64>, CliError> {
    let config = serde_json::to_value(args.bench.load(Purpose::Model, &[])?).unwrap_or_default();
    Ok(config
        .pointer(&format!("/{}", args.vary.replace('.', "/")))
        .and_then(serde_json::Value::as_f64))
}

fn report(
    args: &Args,
    values: &[f64],
    course: &Trajectory,
    pair: [usize; 2],
    [closest, at]: [&ModesAt; 2],
) -> Result<Report, CliError> {
    let here = crate::model::veering::station(at, pair, as_configured(at))?;
    let on_grid = course
        .stations
        .iter()
        .filter(|station| values.contains(&station.value));
    Ok(Report {
        profile: args.bench.profile().into(),
        vary: args.vary.clone(),
        modes: pair.map(|mode| mode + 1),
        meeting: course.meeting.name(),
        value: closest.value,
        frequency_hz: hz(0.5 * (closest.omega_rad_s[pair[0]] + closest.omega_rad_s[pair[1]])),
        gap_hz: hz(closest.gap_rad_s(pair)),
        cnmp_bands: course.bands(),
        assumptions: assumptions(at, pair, &here),
        here: explain(&here),
        sides: [Side::Before, Side::After]
            .into_iter()
            .map(|side| side_json(&Interval::of(course, side)))
            .collect(),
        p4_1: tally(on_grid.clone()),
        rows: on_grid.filter_map(row).collect(),
    })
}

fn frequencies_hz(modes: &CloseModes) -> [f64; 2] {
    [hz(modes.u.omega_rad_s), hz(modes.v.omega_rad_s)]
}

fn assumptions(at: &ModesAt, pair: [usize; 2], here: &Sample) -> Assumptions {
    let damping_ratio = pair
        .map(|mode| at.damping_ratio(mode))
        .into_iter()
        .fold(0.0, f64::max);
    let half_gap = at.gap_rad_s(pair) / (at.omega_rad_s[pair[0]] + at.omega_rad_s[pair[1]]);
    let remainder = here.modes.map(|modes| modes.remainder);
    Assumptions {
        damping_ratio,
        damping_over_half_gap: Some(damping_ratio / half_gap).filter(|ratio| ratio.is_finite()),
        mode_r: remainder
            .and_then(|remainder| remainder.mode)
            .map(|mode| mode + 1),
        others_ratio: remainder.map(|remainder| remainder.others_ratio),
        nearness_ratio: remainder.map(|remainder| remainder.nearness_ratio),
        integrator_ratio: remainder.map(|remainder| remainder.integrator_ratio),
    }
}

fn tally<'a>(stations: impl Iterator<Item = &'a Sample>) -> Tally {
    stations
        .filter_map(p4_1)
        .fold(Tally::default(), |sum, next| Tally {
            values: sum.values + 1,
            appear: sum.appear + usize::from(next.foretold == Prediction::Appear),
            wrong_by_equation: sum.wrong_by_equation
                + usize::from(next.foretold.is_contradicted_by(next.equation)),
            wrong_by_plant: sum.wrong_by_plant
                + usize::from(next.foretold.is_contradicted_by(next.plant)),
        })
}

fn side_json(stretch: &Interval) -> SideJson {
    let propositions = stretch
        .propositions()
        .into_iter()
        .map(proposition_json)
        .collect();
    SideJson {
        side: stretch.side.name(),
        stretch: stretch.range(),
        propositions,
    }
}

fn proposition_json(p: Proposition) -> PropositionJson {
    PropositionJson {
        name: p.name,
        foretold: p.foretold.name(),
        equation: p.equation,
        plant: p.plant,
        agrees_with_equation: !p.foretold.is_contradicted_by(p.equation),
        agrees_with_plant: !p.foretold.is_contradicted_by(p.plant),
        premises: p.premises.into_iter().map(condition_json).collect(),
    }
}

fn condition_json(c: Condition) -> ConditionJson {
    let finite = |limit: f64| Some(limit).filter(|limit| limit.is_finite());
    ConditionJson {
        name: c.name,
        holds: c.holds,
        figure: c.figure,
        limits: c.limits.map(finite),
        margin: c.margin,
    }
}

fn row(station: &Sample) -> Option<Row> {
    let modes = station.modes?;
    let [u_hz, v_hz] = frequencies_hz(&modes);
    let [residue_r_per_kg, residue_u_per_kg, residue_v_per_kg] = modes.residues_per_kg();
    Some(Row {
        value: station.value,
        u_hz,
        v_hz,
        residue_r_per_kg,
        residue_u_per_kg,
        residue_v_per_kg,
        c4_1: condition_json(c4_1(&modes)),
        c4_2: condition_json(c4_2(&modes)),
        equation: station.equation.map_or("crossing", lie),
        plant: lie(station.plant),
    })
}

fn lie(lie: ZeroConfiguration) -> &'static str {
    match lie {
        ZeroConfiguration::Between => "dual MMP",
        ZeroConfiguration::Quartet => "CMP-CNMP",
        ZeroConfiguration::Elsewhere => "other",
    }
}

fn explain(station: &Sample) -> Option<Here> {
    let (modes, proposition) = (station.modes?, p4_1(station)?);
    let remedies = vec![on_signs(&modes), on_gap(&modes)];
    Some(Here {
        value: station.value,
        row: row(station)?,
        proposition: proposition_json(proposition),
        remedies,
    })
}

/// What C4-1 asks for.
fn on_signs(modes: &CloseModes) -> String {
    let (condition, residues) = (c4_1(modes), modes.residues_per_kg());
    let which = deciding_residue(residues);
    let (name, value) = (["R", "u", "v"][which], residues[which]);
    let sign = |r: &f64| match r.total_cmp(&0.0) {
        _ if *r == 0.0 => '0',
        std::cmp::Ordering::Less => '-',
        _ => '+',
    };
    let signs: String = residues.iter().map(sign).collect();
    let size = condition.margin.abs() * 100.0;
    let wanted = if pattern(residues) > 0.0 {
        "+-+"
    } else {
        "-+-"
    };
    match condition.holds {
        true => format!(
            "C4-1 holds by {size:.1} %: signs {signs}; to break it turn the smallest, a{name} = {value:+.4e} 1/kg, by moving actuator or sensor (`bench model placement`) or by the asymmetry"
        ),
        false => format!(
            "C4-1 fails by {size:.1} % of the largest residue: signs {signs}; keep them so: {wanted} is reached when a{name} = {value:+.4e} 1/kg turns"
        ),
    }
}

/// What C4-2 asks for, as factors on wv^2 - wu^2 with residues as they are.
fn on_gap(modes: &CloseModes) -> String {
    let (condition, figure, [low, high]) = (
        c4_2(modes),
        modes.signed_b2_per_kg(),
        modes.critical_b2_per_kg(),
    );
    match condition {
        _ if !modes.are_opposed() => {
            "C4-2 fails: the residues of modes u and v do not have opposite signs, so that no gap between them gives CMP-CNMP zeros".into()
        }
        Condition { holds: true, .. } => format!(
            "C4-2 holds by {:.1} % of |b22|: to break it move the modes apart, wv^2 - wu^2 times {:.3} or more, or together, times {:.3} or less",
            condition.margin * 100.0,
            high / figure,
            low / figure
        ),
        _ if figure <= 0.0 => "C4-2 fails: the sum of all residues has the sign of au, at any gap".into(),
        _ => format!(
            "C4-2 fails by {:.1} % of |b22|: the modes are too far {}; it would hold with wv^2 - wu^2 times {:.3} to {:.3}",
            -condition.margin * 100.0,
            if figure >= high { "apart" } else { "together" },
            low / figure,
            high / figure
        ),
    }
}
