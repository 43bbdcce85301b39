//! `bench model`: what the mechanics are, by the model.

mod bounds;
mod conditions;
mod conditions_text;
mod critical_damping;
mod locus;
mod map;
mod placement;
mod placement_text;
mod sequence;
mod step;
mod study;
mod sweep;
mod veering;

use clap::Subcommand;
use serde::Serialize;

use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use super::table::table;
use crate::config::{Config, Purpose};
use crate::model::plant::{self, ModalModel};
use crate::model::zeros::{self, Zero};

/// What to compute.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Clone, Debug, Subcommand)]
enum What {
    /// Modes, residues, signs and zeros at one operating point
    Modes(BenchOptions),
    /// The sequence of dominant modes, and the kinds of zeros that Tables 3-1 to 3-4 read from it
    Sequence(BenchOptions),
    /// Migration of the zeros as one setting varies, with the points where they meet
    Locus(locus::Args),
    /// How many pairs of CNMP zeros there are over operating point and mass asymmetry, for SR4DoF
    Map(map::Args),
    /// How likely CNMP zeros are within manufacturing tolerances, and which settings decide it
    Study(study::Args),
    /// Two close modes as one setting varies: whether their loci cross or veer, where, and how their shapes swap
    Veering(veering::Args),
    /// Which of Conditions C4-1 to C4-4y hold for two close modes, by how much, and what the propositions make of it
    Conditions(conditions::Args),
    /// Actuator and probe among the shapes of two close modes, and where to put them so that no CNMP zeros appear
    Placement(placement::Args),
    /// What the zeros in the right half plane allow in bandwidth and sensitivity peak (Eqs. 1-2, 1-3)
    Bounds(bounds::Args),
    /// The response to a step: undershoot, zero crossings, reversals, and what the zeros foretell
    Step(step::Args),
    /// The damping that keeps all zeros of two close modes out of the right half plane (Eq. 3-16)
    CriticalDamping(critical_damping::Args),
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    match &args.what {
        What::Study(args) => return study::run(args),
        What::Modes(options) => run_modes(options)?,
        What::Sequence(options) => sequence::run(options)?,
        What::Locus(args) => locus::run(args)?,
        What::Map(args) => map::run(args)?,
        What::Veering(args) => veering::run(args)?,
        What::Conditions(args) => conditions::run(args)?,
        What::Placement(args) => placement::run(args)?,
        What::Bounds(args) => bounds::run(args)?,
        What::Step(args) => step::run(args)?,
        What::CriticalDamping(args) => critical_damping::run(args)?,
    }
    Ok(Outcome::Done)
}

fn run_modes(options: &BenchOptions) -> Result<(), CliError> {
    let config = options.load(Purpose::Model, &[])?;
    let modes = Modes::of(&config, options.profile())?;
    if options.json {
        print_json(&modes)
    } else {
        print_text(&modes.text())
    }
}

#[derive(Debug, Serialize)]
struct Modes {
    profile: String,
    model: &'static str,
    operating_point_m: Option<f64>,
    mass_asymmetry: Option<f64>,
    coordinates: Vec<String>,
    modes: Vec<ModeJson>,
    zeros: Vec<ZeroJson>,
    damped_zeros: Vec<ZeroJson>,
    cnmp_pairs: usize,
    damped_cnmp_pairs: usize,
    sign_sequence: String,
    dominant_sequence: String,
    phase_drop_deg: f64,
    /// What the zeros in the right half plane, without damping, leave to a controller.
    bounds: Vec<bounds::BoundJson>,
}

#[derive(Debug, Serialize)]
struct ModeJson {
    omega_rad_s: f64,
    frequency_hz: f64,
    damping_ratio: f64,
    residue: f64,
    sign: char,
    shape: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct ZeroJson {
    re_rad_s: f64,
    im_rad_s: f64,
    kind: &'static str,
}

impl Modes {
    fn of(config: &Config, profile: &str) -> Result<Modes, CliError> {
        let structure = plant::build(&config.plant)?;
        let modal = ModalModel::of(&structure)?;
        let (undamped, damped) = (
            zeros::undamped_zeros(&structure)?,
            zeros::damped_zeros(&structure)?,
        );
        let plant = &config.plant;
        Ok(Modes {
            profile: profile.into(),
            model: plant.model(),
            operating_point_m: plant.operating_point_m(),
            mass_asymmetry: plant.mass_asymmetry(),
            coordinates: plant.coordinates().into_iter().map(String::from).collect(),
            modes: modes(&modal),
            zeros: zeros(&undamped),
            damped_zeros: zeros(&damped),
            cnmp_pairs: zeros::cnmp_pairs(&undamped),
            damped_cnmp_pairs: zeros::cnmp_pairs(&damped),
            sign_sequence: zeros::sign_sequence(&modal),
            dominant_sequence: zeros::dominant_sequence(&modal)?,
            phase_drop_deg: zeros::phase_drop_deg(&undamped),
            bounds: bounds::usual(&undamped),
        })
    }

    fn title(&self) -> String {
        let point = self
            .operating_point_m
            .map(|m| format!("at Y1o = {:.4} mm", m * 1e3));
        let asymmetry = self
            .mass_asymmetry
            .map(|ratio| format!("mass asymmetry {:+.2} %", ratio * 100.0));
        let where_to: Vec<String> = point.into_iter().chain(asymmetry).collect();
        format!("{} {}", self.profile, where_to.join(", "))
            .trim_end()
            .to_string()
    }

    fn text(&self) -> String {
        let mode = |(i, m): (usize, &ModeJson)| {
            vec![
                (i + 1).to_string(),
                format!("{:.3}", m.omega_rad_s),
                format!("{:.4}", m.frequency_hz),
                format!("{:.5}", m.damping_ratio),
                format!("{:+.6}", m.residue),
                m.sign.to_string(),
                m.shape
                    .iter()
                    .map(|x| format!("{x:+.4}"))
                    .collect::<Vec<_>>()
                    .join(" "),
            ]
        };
        let zero = |z: &ZeroJson| {
            vec![
                format!("{:+.4}", z.re_rad_s),
                format!("{:+.4}", z.im_rad_s),
                z.kind.into(),
            ]
        };
        let shape = format!("shape [{}]", self.coordinates.join(" "));
        let header = [
            "mode",
            "rad/s",
            "Hz",
            "damping",
            "residue 1/kg",
            "sign",
            &shape,
        ];
        let modes = table(
            &header,
            &self.modes.iter().enumerate().map(mode).collect::<Vec<_>>(),
        );
        let zero_table = |zeros: &[ZeroJson]| {
            table(
                &["re rad/s", "im rad/s", "kind"],
                &zeros.iter().map(zero).collect::<Vec<_>>(),
            )
        };
        format!(
            "{}\n\n{modes}\nzeros without damping\n{}\nzeros with damping\n{}\nsigns {}   dominant modes {}   CNMP pairs {} ({} with damping)   phase drop {} deg\n{}",
            self.title(),
            zero_table(&self.zeros),
            zero_table(&self.damped_zeros),
            self.sign_sequence,
            self.dominant_sequence,
            self.cnmp_pairs,
            self.damped_cnmp_pairs,
            self.phase_drop_deg,
            bounds::usual_text(&self.bounds),
        )
    }
}

fn modes(modal: &ModalModel) -> Vec<ModeJson> {
    let of = |(mode, sign): (&plant::Mode, plant::Sign)| ModeJson {
        omega_rad_s: mode.omega_rad_s,
        frequency_hz: mode.omega_rad_s / (2.0 * std::f64::consts::PI),
        damping_ratio: mode.damping_ratio,
        residue: mode.residue_per_kg(),
        sign: sign.symbol(),
        shape: mode.shape.iter().copied().collect(),
    };
    modal.modes.iter().zip(modal.signs()).map(of).collect()
}

fn zeros(zeros: &[Zero]) -> Vec<ZeroJson> {
    zeros
        .iter()
        .map(|zero| ZeroJson {
            re_rad_s: zero.s.re,
            im_rad_s: zero.s.im,
            kind: zero.kind.name(),
        })
        .collect()
}
