//! `bench model locus`: migration of the zeros as one setting varies.

use nalgebra::Complex;
use serde::Serialize;

use super::super::columns::{Column, TableOptions};
use super::super::error::CliError;
use super::super::figure_options::PictureOptions;
use super::super::output::print_result;
use super::super::table::{table, wrap};
use super::evenly_spread_rows;
use super::sweep::SweepArgs;
use bench_base::decimal::Decimal;
use bench_config::{Config, Purpose};
use bench_plant::ModalModel;
use bench_plant::zeros::{
    KindChange, Locus, LocusPlane, ModalSum, Zero, damped_zeros, undamped_zeros,
};
use bench_report::{Picture, ReportError, locus_svg, plant_conditions};
use bench_thesis::ClosedForm;

/// The setting that varies, and the zeros to follow.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    sweep: SweepArgs,
    /// Follow the zeros of the plant with its damping
    #[arg(long)]
    damped: bool,
    #[command(flatten)]
    table: TableOptions,
    #[command(flatten)]
    picture: PictureOptions,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    profile: &'a str,
    vary: &'a str,
    damped: bool,
    values: Vec<f64>,
    tracks: Vec<Track>,
    changes: Vec<Change>,
    csv: Option<String>,
}

/// `null` where a zero is at infinity.
#[derive(Debug, Serialize)]
struct Track {
    re_rad_s: Vec<Option<f64>>,
    im_rad_s: Vec<Option<f64>>,
}

impl Track {
    fn of(track: &[Option<Complex<f64>>]) -> Track {
        Track {
            re_rad_s: track.iter().map(|s| s.map(|s| s.re)).collect(),
            im_rad_s: track.iter().map(|s| s.map(|s| s.im)).collect(),
        }
    }

    fn is_constant(&self) -> bool {
        let is_constant = |part: &[Option<f64>]| part.windows(2).all(|pair| pair[0] == pair[1]);
        is_constant(&self.re_rad_s) && is_constant(&self.im_rad_s)
    }
}

#[derive(Debug, Serialize)]
struct Change {
    #[serde(flatten)]
    change: KindChange,
    closed_form: Option<ClosedForm>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    args.table.check()?;
    let values = args.sweep.values()?;
    let plane = if args.damped {
        LocusPlane::Damped
    } else {
        LocusPlane::Undamped
    };
    let locus = Locus::follow(plane, &values, |value| zeros(args, value))?;
    args.table.write(|| {
        let rows = (0..values.len()).map(|k| row(&locus, k));
        Column::of_rows(names(args, &locus), rows)
    })?;
    let config = args.sweep.bench.load(Purpose::Model, &[])?;
    args.picture.write(|| drawn(args, &config, &locus))?;
    let report = report(args, locus)?;
    print_result(args.sweep.bench.json, &report, |report| {
        text(report) + &args.table.files_text("tracks") + &args.picture.files_text()
    })
}

fn drawn(args: &Args, config: &Config, locus: &Locus) -> Result<Picture, ReportError> {
    let vary = &args.sweep.vary;
    let which = if args.damped {
        "zeros with damping"
    } else {
        "zeros without damping, one of each pair s, -s"
    };
    let title = format!("{}: {which}", config.title);
    let conditions = plant_conditions(&config.plant, &[vary]);
    Ok(Picture {
        svg: locus_svg(locus, vary, &title, &conditions)?,
        caption: format!(
            "The zeros in the complex plane as {vary} varies, and their parts over it. Arrows point to the last value."
        ),
        title,
    })
}

fn zeros(args: &Args, value: f64) -> Result<Vec<Zero>, CliError> {
    let structure = args.sweep.structure(value)?;
    Ok(if args.damped {
        damped_zeros(&structure)?
    } else {
        undamped_zeros(&structure)?
    })
}

fn report(args: &Args, locus: Locus) -> Result<Report<'_>, CliError> {
    let changes = locus.changes.into_iter();
    Ok(Report {
        profile: args.sweep.bench.profile(),
        vary: &args.sweep.vary,
        damped: args.damped,
        values: locus.values,
        tracks: locus.tracks.iter().map(|track| Track::of(track)).collect(),
        changes: changes
            .map(|change| with_closed_form(args, change))
            .collect::<Result<_, _>>()?,
        csv: args.table.csv(),
    })
}

fn with_closed_form(args: &Args, change: KindChange) -> Result<Change, CliError> {
    let modal = ModalModel::of(&args.sweep.structure(change.value)?)?;
    let closed_form = ClosedForm::of(&ModalSum::visible(&modal)?, args.damped);
    Ok(Change {
        change,
        closed_form,
    })
}

fn names(args: &Args, locus: &Locus) -> Vec<String> {
    let mut names = vec![args.sweep.vary.clone()];
    for n in 1..=locus.tracks.len() {
        names.extend(["re", "im"].map(|part| format!("zero_{n}_{part}_rad_s")));
    }
    names
}

/// A zero at infinity is infinite in its real part.
fn row(locus: &Locus, index: usize) -> Vec<f64> {
    let infinite = Complex::new(f64::INFINITY, 0.0);
    let mut row = vec![locus.values[index]];
    for track in &locus.tracks {
        let s = track[index].unwrap_or(infinite);
        row.extend([s.re, s.im]);
    }
    row
}

fn text(report: &Report) -> String {
    let which = if report.damped {
        "with damping"
    } else {
        "without damping, one of each pair s, -s"
    };
    let title = format!("{}: zeros {which}, over {}", report.profile, report.vary);
    let (tracks, changes) = (tracks_table(report), changes_text(report));
    format!("{}\n{tracks}\n{changes}", wrap(&title, 0))
}

fn changes_text(report: &Report) -> String {
    if !report.changes.is_empty() {
        return report.changes.iter().map(change_text).collect();
    }
    if report.tracks.iter().all(Track::is_constant) {
        format!("the zeros do not depend on {}\n", report.vary)
    } else {
        "the kinds of the zeros do not change\n".into()
    }
}

fn tracks_table(report: &Report) -> String {
    let mut header = vec!["value".to_string()];
    header.extend((1..=report.tracks.len()).map(|number| format!("zero {number} rad/s")));
    let places: Vec<usize> = (0..report.values.len()).collect();
    let rows: Vec<Vec<String>> = evenly_spread_rows(&places)
        .map(|&k| {
            let mut row = vec![format!("{:.6}", Decimal(report.values[k]))];
            row.extend(report.tracks.iter().map(|track| place_text(track, k)));
            row
        })
        .collect();
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    table(&header, &rows)
}

fn place_text(track: &Track, k: usize) -> String {
    match (track.re_rad_s[k], track.im_rad_s[k]) {
        (Some(re), Some(im)) => format!("{:.3}{:+.3}j", Decimal(re), Decimal(im)),
        _ => "infinity".into(),
    }
}

fn change_text(change: &Change) -> String {
    let KindChange {
        value,
        crossing,
        s,
        before,
        after,
    } = &change.change;
    let place = if s.re.is_finite() && s.im.is_finite() {
        format!(" at {:.4}{:+.4}j rad/s", Decimal(s.re), Decimal(s.im))
    } else {
        String::new()
    };
    let sentence = format!(
        "at {value:.9}: {before} to {after}, {}{place}",
        crossing.name()
    );
    let closed_form = change.closed_form.as_ref();
    wrap(&sentence, 0) + &closed_form.map_or(String::new(), closed_form_text)
}

fn closed_form_text(closed_form: &ClosedForm) -> String {
    match closed_form {
        ClosedForm::ThreeModes {
            residue_r,
            eq_4_5,
            eq_4_5_shifted,
            b2,
            eq_4_6_shifted,
        } => {
            let [residue_r, eq_4_5, eq_4_5_shifted, b2, eq_4_6_shifted] =
                [residue_r, eq_4_5, eq_4_5_shifted, b2, eq_4_6_shifted].map(|x| Decimal(*x));
            let residue = format!(
                "residue of mode R {residue_r:.6} 1/kg; critical by Eq. (4-5) {eq_4_5:.6} (mode R at 0 rad/s), {eq_4_5_shifted:.6} (at its frequency)"
            );
            let sum =
                format!("sum of residues {b2:.6} 1/kg; critical by Eq. (4-6) {eq_4_6_shifted:.6}");
            wrap(&residue, 4) + &wrap(&sum, 4)
        }
        ClosedForm::TwoModes { eq_3_14_rad_s } => break_points_text(eq_3_14_rad_s),
    }
}

fn break_points_text(points_rad_s: &[f64; 2]) -> String {
    let [first, second] = points_rad_s.map(|s| {
        if s.is_finite() {
            format!("{:.4}", Decimal(s))
        } else {
            "infinity".into()
        }
    });
    let sentence = format!("break points by Eq. (3-14) {first} and {second} rad/s");
    wrap(&sentence, 4)
}
