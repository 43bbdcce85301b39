//! Whether what should be on the stage is on it: by where it rests, by what a person reads, and by its modes.
//!
//! What the X probe can see (see [`crate::config::Sr4dofSettings::holding_force_n`]): the stage rests at the same X whatever hangs in Y, so a rest
//! elsewhere tells of a cable that pulls askew, and never that the weight is there. The displacement in Y is seen by a person
//! with a gauge, or by the modes of the chirp: u and v appear and fall with the operating point, and move with the masses.

use serde::{Deserialize, Serialize};

use super::grid::{of_plant, settings};
use super::{AnswerError, CampaignError, Load, Point, Rest};
use crate::config::{Config, PlantSettings, Sr4dofSettings};
use crate::model::plant::{self, ModalModel, Mode, Sign};

/// Standard deviations beyond which a difference is no noise: once in two million.
const SIGMAS: f64 = 5.0;
/// A mode with so much of the largest residue has to be seen,
const CLEAR: f64 = 1e-2;
/// and one with less than this is none.
const FAINT: f64 = 1e-3;
/// So much asymmetry may be there that nobody knows of: the thesis found 2 % (section 5.2.2).
const UNSURE: f64 = 0.03;
/// Beyond such a distance, a ratio, a mode is another one: no load of the grid moves one by more than half of it, and R, u and
/// the first mode that the model leaves out are factors of 2.6 and more apart.
const FAR: f64 = 0.2;

/// What a check finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// As expected, and without the load it would not be so.
    Holds,
    /// Otherwise than expected.
    Fails,
    /// As expected, but so it would be without the load.
    CannotTell,
}

/// One length against what is expected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LengthCheck {
    /// What it finds.
    pub finding: Finding,
    /// What was seen, in metres.
    pub seen_m: f64,
    /// What was expected.
    pub expected_m: f64,
    /// How far from it.
    pub tolerance_m: f64,
}

/// One mode of the loaded stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeCheck {
    /// Where the model has it, with the load.
    pub expected_hz: f64,
    /// Where the model has it, with nothing on the stage.
    pub unloaded_hz: f64,
    /// The nearest mode that the chirp shows; none where there is none near.
    pub seen_hz: Option<f64>,
    /// The sign of its residue; none where an asymmetry that nobody knows of may turn it, or it is faint.
    pub expected_sign: Option<char>,
    /// The sign of the mode that was seen.
    pub seen_sign: Option<char>,
    /// What it finds.
    pub finding: Finding,
}

/// All checks of a load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PutOn {
    /// What a person was asked to put on.
    pub load: Load,
    /// Where the stage rests, from where it rested with nothing on.
    pub rest: LengthCheck,
    /// The quiet run of that.
    pub rest_recording: String,
    /// The displacement in Y that a person read.
    pub read: Option<LengthCheck>,
    /// The modes.
    pub modes: Vec<ModeCheck>,
    /// A person said that it is right although a check failed.
    pub confirmed_by_hand: bool,
}

impl LengthCheck {
    fn of(seen_m: f64, expected_m: f64, tolerance_m: f64) -> LengthCheck {
        // A NaN is no pass.
        let finding = match (
            (seen_m - expected_m).abs() <= tolerance_m,
            expected_m.abs() <= tolerance_m,
        ) {
            (false, _) => Finding::Fails,
            (true, true) => Finding::CannotTell,
            (true, false) => Finding::Holds,
        };
        LengthCheck {
            finding,
            seen_m,
            expected_m,
            tolerance_m,
        }
    }

    /// The place of rest in X: expected is none, within 5 sigma of both means, the drift of the mounting, and what a cable
    /// askew by the angle allowed pulls, F sin(angle)/(k4 + k5).
    pub fn rest(
        config: &Config,
        load: &Load,
        rest: &Rest,
        unloaded: &Rest,
    ) -> Result<LengthCheck, CampaignError> {
        let (with, stage) = (&config.campaign, settings(config)?);
        let askew_n = load.force_n(with).abs() * libm::sin(with.askew_rad);
        let askew_m = askew_n / (2.0 * stage.spring_stiffness_n_per_m);
        let noise_m = SIGMAS * libm::hypot(rest.sigma_m, unloaded.sigma_m);
        Ok(LengthCheck::of(
            rest.mean_m - unloaded.mean_m,
            0.0,
            with.rest_tolerance_m + noise_m + askew_m,
        ))
    }

    /// The displacement in Y as read, within `tolerance` (a ratio of the beam length).
    pub fn read(
        config: &Config,
        read_m: f64,
        tolerance: f64,
    ) -> Result<LengthCheck, CampaignError> {
        let stage = settings(config)?;
        Ok(LengthCheck::of(
            read_m,
            stage.operating_point_m,
            tolerance * stage.beam_length_m,
        ))
    }
}

/// The modes that the stage shows under a load by the model, against those of a point's chirp.
///
/// A mode holds within `campaign.frequency_tolerance_ratio` and with the sign of its residue, where that is sure. It tells of the
/// load where it is seen and the unloaded stage's mode of that number is not (its residue is faint), or is more than twice the
/// tolerance away. Frequencies alone do not tell a mass on stage 2 from one on stage 3, which mirrors the stage: signs do.
pub fn modes(config: &Config, load: &Load, point: &Point) -> Result<Vec<ModeCheck>, AnswerError> {
    let loaded = load.carried(config)?;
    let beside = |by| modal(&PlantSettings::Sr4dof(more_asymmetric(&loaded, by)?));
    let expected = Expected {
        loaded: modal(&loaded)?,
        unloaded: modal(&Load::default().carried(config)?)?,
        beside: [beside(-UNSURE)?, beside(UNSURE)?],
        tolerance: config.campaign.frequency_tolerance_ratio,
    };
    let shown = (0..expected.loaded.len()).filter(|k| share(&expected.loaded, *k) > FAINT);
    Ok(shown.map(|k| expected.check(k, point)).collect())
}

fn modal(plant: &PlantSettings) -> Result<Vec<Mode>, AnswerError> {
    Ok(ModalModel::of(&plant::build(plant)?)?.modes)
}

fn more_asymmetric(plant: &PlantSettings, by: f64) -> Result<Sr4dofSettings, CampaignError> {
    let stage = of_plant(plant)?;
    Ok(Sr4dofSettings {
        mass_asymmetry: stage.mass_asymmetry + by,
        ..stage.clone()
    })
}

/// The modes by the model, slowest first.
struct Expected {
    loaded: Vec<Mode>,
    unloaded: Vec<Mode>,
    /// With a little less and a little more asymmetry than the load makes.
    beside: [Vec<Mode>; 2],
    tolerance: f64,
}

impl Expected {
    fn check(&self, k: usize, point: &Point) -> ModeCheck {
        let (expected_hz, unloaded_hz) = (hz(&self.loaded[k]), hz(&self.unloaded[k]));
        let away = |hz: f64| (hz / expected_hz - 1.0).abs();
        let seen = point.modes_hz.iter().copied().zip(point.signs.chars());
        let seen = seen
            .min_by(|a, b| away(a.0).total_cmp(&away(b.0)))
            .filter(|seen| away(seen.0) < FAR);
        let expected_sign = self.sign(k);
        let tells = share(&self.unloaded, k) < FAINT || away(unloaded_hz) > 2.0 * self.tolerance;
        let finding = match seen {
            None if share(&self.loaded, k) > CLEAR => Finding::Fails,
            None => Finding::CannotTell,
            Some((hz, _)) if away(hz) > self.tolerance => Finding::Fails,
            Some((_, sign)) if expected_sign.is_some_and(|expected| expected != sign) => {
                Finding::Fails
            }
            Some(_) if tells => Finding::Holds,
            Some(_) => Finding::CannotTell,
        };
        let (seen_hz, seen_sign) = seen.unzip();
        ModeCheck {
            expected_hz,
            unloaded_hz,
            seen_hz,
            expected_sign,
            seen_sign,
            finding,
        }
    }

    /// The sign of a clear residue that is the same on both sides of the load's asymmetry.
    fn sign(&self, k: usize) -> Option<char> {
        let sign = |modes: &[Mode]| Sign::of(modes[k].residue_per_kg()).symbol();
        let sure = self
            .beside
            .iter()
            .all(|beside| sign(beside) == sign(&self.loaded));
        (sure && share(&self.loaded, k) > CLEAR).then(|| sign(&self.loaded))
    }
}

/// A residue's share of the largest one.
fn share(modes: &[Mode], k: usize) -> f64 {
    let size = |mode: &Mode| mode.residue_per_kg().abs();
    size(&modes[k]) / modes.iter().map(size).fold(0.0, f64::max)
}

fn hz(mode: &Mode) -> f64 {
    mode.omega_rad_s / std::f64::consts::TAU
}

impl PutOn {
    /// What all checks find: a failure is one of any, and one that holds is enough (each of them stands beside it).
    pub fn finding(&self) -> Finding {
        let lengths = [Some(&self.rest), self.read.as_ref()]
            .into_iter()
            .flatten()
            .map(|check| check.finding);
        together(lengths.chain([self.modes_find()]))
    }

    /// What the modes find.
    pub fn modes_find(&self) -> Finding {
        together(self.modes.iter().map(|mode| mode.finding))
    }

    /// What failed, a sentence each.
    pub fn failures(&self) -> Vec<String> {
        let length = |what: &str, check: &LengthCheck, remedy: &str| {
            let [seen, expected, tolerance] =
                [check.seen_m, check.expected_m, check.tolerance_m].map(|m| m * 1e6);
            let fails = check.finding == Finding::Fails;
            fails.then(|| {
                format!(
                    "{what} {seen:+.1} um, expected {expected:+.1} +- {tolerance:.1} um: {remedy}"
                )
            })
        };
        let askew = "the cable pulls in X, or something touches the stage";
        let rest = length("without current the stage rests in X at", &self.rest, askew);
        let read = self.read.as_ref().and_then(|read| {
            length(
                "the displacement in Y is",
                read,
                "look at the weight and the pulley",
            )
        });
        rest.into_iter()
            .chain(read)
            .chain(self.modes.iter().filter_map(ModeCheck::failure))
            .collect()
    }
}

impl ModeCheck {
    fn failure(&self) -> Option<String> {
        let (expected, bare) = (self.expected_hz, self.unloaded_hz);
        let sign =
            |sign: Option<char>| sign.map_or(String::new(), |sign| format!(", residue {sign}"));
        let seen = match self.seen_hz {
            Some(hz) => format!("is at {hz:.2} Hz{}", sign(self.seen_sign)),
            None => "is not seen".to_string(),
        };
        let signed = sign(self.expected_sign);
        let what = format!(
            "the mode expected at {expected:.2} Hz{signed} ({bare:.2} Hz with nothing on) {seen}"
        );
        (self.finding == Finding::Fails).then_some(what)
    }
}

fn together(findings: impl Iterator<Item = Finding>) -> Finding {
    findings.fold(Finding::CannotTell, |all, one| match (all, one) {
        (Finding::Fails, _) | (_, Finding::Fails) => Finding::Fails,
        (Finding::Holds, _) | (_, Finding::Holds) => Finding::Holds,
        _ => Finding::CannotTell,
    })
}
