//! `bench model locus`: how the zeros migrate as one setting varies.

use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::super::table::table;
use super::sweep::Sweep;
use crate::model::plant::ModalModel;
use crate::model::zeros::{self, KindChange, Locus, LocusPlane, ModalSum};

/// What varies, and where.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// The setting that varies: plant.operating_point_m, plant.mass_asymmetry, any number
    #[arg(long, value_name = "KEY")]
    vary: String,
    /// First value; 3.8mm for a length, 8% for a ratio or of the beam length
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    from: String,
    /// Last value
    #[arg(long, value_name = "B", allow_hyphen_values = true)]
    to: String,
    /// Values of the grid; points where zeros meet are found between them
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    count: u32,
    /// Follow the zeros of the plant with its damping
    #[arg(long)]
    damped: bool,
    #[command(flatten)]
    table: TableOptions,
}

#[derive(Debug, Serialize)]
struct Report {
    profile: String,
    vary: String,
    damped: bool,
    values: Vec<f64>,
    tracks: Vec<TrackJson>,
    changes: Vec<ChangeJson>,
    csv: Option<String>,
}

/// `null` where a zero is at infinity.
#[derive(Debug, Serialize)]
struct TrackJson {
    re_rad_s: Vec<Option<f64>>,
    im_rad_s: Vec<Option<f64>>,
}

impl TrackJson {
    /// Whether the zero stays where it is.
    fn stands(&self) -> bool {
        [&self.re_rad_s, &self.im_rad_s]
            .into_iter()
            .all(|part| part.windows(2).all(|pair| pair[0] == pair[1]))
    }
}

#[derive(Debug, Serialize)]
struct ChangeJson {
    value: f64,
    at: &'static str,
    re_rad_s: Option<f64>,
    im_rad_s: Option<f64>,
    before: String,
    after: String,
    closed_form: Option<ClosedForm>,
}

/// What the thesis's equations say at the value of a change.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum ClosedForm {
    /// Three undamped modes R, u, v.
    ThreeModes {
        /// The residue of mode R, in 1/kg.
        residue_r: f64,
        /// Eq. (4-5) with mode R as a double integrator: the nearer of the two critical residues.
        eq_4_5: f64,
        /// The same with the squares of all frequencies shifted by -wR^2.
        eq_4_5_shifted: f64,
        /// The sum of all residues.
        b2: f64,
        /// Eq. (4-6), shifted: the nearer of the two critical sums.
        eq_4_6_shifted: f64,
    },
    /// Two damped modes: the break points of Eq. (3-14) in rad/s.
    TwoModes { eq_3_14_rad_s: [Option<f64>; 2] },
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    args.table.check()?;
    let values = sweep(args).values()?;
    let plane = if args.damped {
        LocusPlane::Damped
    } else {
        LocusPlane::Undamped
    };
    let locus = Locus::follow(plane, &values, |value| zeros(args, value))?;
    args.table.write(|| {
        Column::of_rows(
            names(args, &locus),
            (0..values.len()).map(|k| row(&locus, k)),
        )
    })?;
    let report = report(args, &locus)?;
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&(text(&report) + &args.table.told("tracks")))
    }
}

fn sweep(args: &Args) -> Sweep<'_> {
    Sweep {
        bench: &args.bench,
        vary: &args.vary,
        from: &args.from,
        to: &args.to,
        count: args.count,
    }
}

fn zeros(args: &Args, value: f64) -> Result<Vec<zeros::Zero>, CliError> {
    let structure = sweep(args).at(value)?;
    Ok(if args.damped {
        zeros::damped_zeros(&structure)?
    } else {
        zeros::undamped_zeros(&structure)?
    })
}

fn report(args: &Args, locus: &Locus) -> Result<Report, CliError> {
    let part = |track: &[Option<nalgebra::Complex<f64>>], of: fn(nalgebra::Complex<f64>) -> f64| {
        track.iter().map(|s| s.map(of)).collect()
    };
    Ok(Report {
        profile: args.bench.profile().into(),
        vary: args.vary.clone(),
        damped: args.damped,
        values: locus.values.clone(),
        tracks: locus
            .tracks
            .iter()
            .map(|track| TrackJson {
                re_rad_s: part(track, |s| s.re),
                im_rad_s: part(track, |s| s.im),
            })
            .collect(),
        changes: locus
            .changes
            .iter()
            .map(|change| change_json(args, change))
            .collect::<Result<_, _>>()?,
        csv: args.table.csv(),
    })
}

fn change_json(args: &Args, change: &KindChange) -> Result<ChangeJson, CliError> {
    let finite = |x: f64| Some(x).filter(|x| x.is_finite());
    Ok(ChangeJson {
        value: change.value,
        at: change.crossing.name(),
        re_rad_s: finite(change.s.re),
        im_rad_s: finite(change.s.im),
        before: change.before.clone(),
        after: change.after.clone(),
        closed_form: closed_form(args, change.value)?,
    })
}

fn closed_form(args: &Args, value: f64) -> Result<Option<ClosedForm>, CliError> {
    let sum = ModalSum::visible(&ModalModel::of(&sweep(args).at(value)?)?)?;
    Ok(match (sum.terms(), args.damped) {
        ([r, u, v], false) => {
            let nearest = |to: f64, of: [f64; 2]| {
                if (of[0] - to).abs() < (of[1] - to).abs() {
                    of[0]
                } else {
                    of[1]
                }
            };
            let b2 = r.residue_per_kg + u.residue_per_kg + v.residue_per_kg;
            let free = zeros::critical_residues(0.0, u, v);
            let shifted = zeros::critical_residues(r.omega_rad_s, u, v);
            let sums = zeros::critical_sums(r.omega_rad_s, u, v);
            free.zip(shifted)
                .zip(sums)
                .map(|((free, shifted), sums)| ClosedForm::ThreeModes {
                    residue_r: r.residue_per_kg,
                    eq_4_5: nearest(r.residue_per_kg, free),
                    eq_4_5_shifted: nearest(r.residue_per_kg, shifted),
                    b2,
                    eq_4_6_shifted: nearest(b2, sums),
                })
        }
        ([u, v], true) => zeros::two_mode_break_points(u, v).map(|points| ClosedForm::TwoModes {
            eq_3_14_rad_s: points.map(|s| Some(s).filter(|s| s.is_finite())),
        }),
        _ => None,
    })
}

fn names(args: &Args, locus: &Locus) -> Vec<String> {
    let zero = |n: usize| ["re", "im"].map(|part| format!("zero_{n}_{part}_rad_s"));
    [args.vary.clone()]
        .into_iter()
        .chain((1..=locus.tracks.len()).flat_map(zero))
        .collect()
}

/// A zero at infinity is infinite in its real part.
fn row(locus: &Locus, index: usize) -> Vec<f64> {
    let infinite = nalgebra::Complex::new(f64::INFINITY, 0.0);
    let places = locus
        .tracks
        .iter()
        .map(|track| track[index].unwrap_or(infinite));
    [locus.values[index]]
        .into_iter()
        .chain(places.flat_map(|s| [s.re, s.im]))
        .collect()
}

fn text(report: &Report) -> String {
    let header: Vec<String> = [report.vary.clone()]
        .into_iter()
        .chain((1..=report.tracks.len()).map(|number| format!("zero {number} rad/s")))
        .collect();
    let place = |track: &TrackJson, k: usize| match (track.re_rad_s[k], track.im_rad_s[k]) {
        (Some(re), Some(im)) => format!("{re:.3}{im:+.3}j"),
        _ => "infinity".into(),
    };
    let row = |k: usize| {
        let places = report.tracks.iter().map(|track| place(track, k));
        [format!("{:.6}", report.values[k])]
            .into_iter()
            .chain(places)
            .collect::<Vec<_>>()
    };
    // A screen of rows; the file and the JSON have all.
    let step = report.values.len().div_ceil(25);
    let rows: Vec<Vec<String>> = (0..report.values.len()).step_by(step).map(row).collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let which = if report.damped {
        "with damping"
    } else {
        "without damping, one of each pair s, -s"
    };
    let changes: String = match report.changes.as_slice() {
        [] if report.tracks.iter().all(TrackJson::stands) => {
            format!("the zeros do not depend on {}\n", report.vary)
        }
        [] => "the kinds of the zeros do not change\n".into(),
        changes => changes
            .iter()
            .map(|change| change_text(&report.vary, change))
            .collect(),
    };
    format!(
        "{}: zeros {which}\n\n{}\n{changes}",
        report.profile,
        table(&header, &rows)
    )
}

fn change_text(key: &str, change: &ChangeJson) -> String {
    let place = match (change.re_rad_s, change.im_rad_s) {
        (Some(re), Some(im)) => format!(" at {re:.4}{im:+.4}j rad/s"),
        _ => String::new(),
    };
    let closed = match &change.closed_form {
        Some(ClosedForm::ThreeModes {
            residue_r,
            eq_4_5,
            eq_4_5_shifted,
            b2,
            eq_4_6_shifted,
        }) => format!(
            "    residue of mode R {residue_r:.6} 1/kg; critical by Eq. (4-5) {eq_4_5:.6} (mode R at 0 rad/s), {eq_4_5_shifted:.6} (at its frequency)\n    sum of residues {b2:.6} 1/kg; critical by Eq. (4-6) {eq_4_6_shifted:.6}\n"
        ),
        Some(ClosedForm::TwoModes { eq_3_14_rad_s }) => {
            let points = eq_3_14_rad_s.map(|s| s.map_or("infinity".into(), |s| format!("{s:.4}")));
            format!(
                "    break points by Eq. (3-14) {} and {} rad/s\n",
                points[0], points[1]
            )
        }
        None => String::new(),
    };
    format!(
        "{key} = {:.9}: {} to {}, {}{place}\n{closed}",
        change.value, change.before, change.after, change.at
    )
}
