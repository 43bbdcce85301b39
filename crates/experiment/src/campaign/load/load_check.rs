//! Checks the load of the stage by its rest position, by a displacement that the operator measured, and by its modes.
//!
//! Limits of the X probe (see [`bench_config::Sr4dofSettings::holding_force_n`]): the rest position in X does not depend on the
//! load in Y. A change of it therefore reveals a misaligned cable, not a missing weight. The operator measures the displacement
//! in Y with a gauge, or it follows from the modes of the chirp: u and v depend on the operating point and on the masses.

use serde::{Deserialize, Serialize};

use super::planned_load::{Load, StageModel};
use super::rest_position::RestPosition;
use crate::campaign::error::CampaignError;
use bench_base::decimal::Decimal;
use bench_config::{PlantSettings, Sr4dofSettings};
use bench_plant::{ModalModel, Mode, Sign};

/// A difference of more standard deviations is not noise; noise alone exceeds it once in two million cases.
const SIGMAS: f64 = 5.0;
/// A mode with this ratio of the largest residue must be visible in the response.
const VISIBLE_RATIO: f64 = 1e-2;
/// A mode with less than this ratio of the largest residue is not expected in the response.
const NEGLIGIBLE_RATIO: f64 = 1e-3;
/// Largest unknown asymmetry of a stage; the thesis found 2 % (section 5.2.2).
const UNKNOWN_ASYMMETRY: f64 = 0.03;
/// A mode farther away than this ratio is another mode. No load of the grid shifts a mode by more than half of it, and R, u and
/// the first unmodelled mode are factors of at least 2.6 apart.
const OTHER_MODE_RATIO: f64 = 0.2;

/// Result of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Finding {
    /// As expected, and different from the unloaded stage.
    Holds,
    /// Different from what is expected.
    Fails,
    /// As expected, but the unloaded stage would give the same.
    CannotTell,
}

/// A measured length and its expected value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LengthCheck {
    /// Result of the check.
    pub finding: Finding,
    /// The measured value in metres.
    pub seen_m: f64,
    /// The expected value.
    pub expected_m: f64,
    /// Allowed difference.
    pub tolerance_m: f64,
}

/// A mode of the loaded stage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeCheck {
    /// Frequency by the model with the load.
    pub expected_hz: f64,
    /// Frequency by the model without a load.
    pub unloaded_hz: f64,
    /// Frequency of the nearest measured mode, if one is near.
    pub seen_hz: Option<f64>,
    /// Expected sign of its residue; `None` if an unknown asymmetry may change it, or if the residue is small.
    pub expected_sign: Option<char>,
    /// Sign of the residue of the measured mode.
    pub seen_sign: Option<char>,
    /// Result of the check.
    pub finding: Finding,
}

/// All checks of a load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadCheck {
    /// The load that was requested.
    pub load: Load,
    /// The rest position, relative to that of the unloaded stage.
    pub rest: LengthCheck,
    /// The recording of the zero-current run in which it was measured.
    pub rest_recording: String,
    /// The displacement in Y that the operator measured.
    pub read: Option<LengthCheck>,
    /// The modes.
    pub modes: Vec<ModeCheck>,
    /// The operator confirmed the load although a check failed.
    pub confirmed_by_hand: bool,
}

impl LengthCheck {
    fn new(seen_m: f64, expected_m: f64, tolerance_m: f64) -> LengthCheck {
        // NaN fails.
        let is_within = (seen_m - expected_m).abs() <= tolerance_m;
        let is_zero_expected = expected_m.abs() <= tolerance_m;
        let finding = match (is_within, is_zero_expected) {
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

    fn failure(&self, what: &str, remedy: &str) -> Option<String> {
        if self.finding != Finding::Fails {
            return None;
        }
        let [seen, expected, tolerance] =
            [self.seen_m, self.expected_m, self.tolerance_m].map(|m| Decimal(m * 1e6));
        Some(format!(
            "{what} {seen:+.1} um, expected {expected:+.1} ± {tolerance:.1} um: {remedy}"
        ))
    }
}

impl StageModel<'_> {
    /// Checks the rest position in X. No change is expected, within 5 sigma of both means, the drift of the mounting, and the
    /// displacement F sin(angle)/(k4 + k5) by a cable that is misaligned by the allowed angle.
    pub fn check_rest(
        &self,
        load: &Load,
        rest: &RestPosition,
        unloaded: &RestPosition,
    ) -> LengthCheck {
        let sideways_n = self.force_n(load).abs() * libm::sin(self.settings.cable_misalignment_rad);
        let sideways_m = sideways_n / (2.0 * self.stage.spring_stiffness_n_per_m);
        let noise_m = SIGMAS * libm::hypot(rest.sigma_m, unloaded.sigma_m);
        let tolerance_m = self.settings.rest_tolerance_m + noise_m + sideways_m;
        LengthCheck::new(rest.mean_m - unloaded.mean_m, 0.0, tolerance_m)
    }

    /// Checks the measured displacement in Y, within `tolerance` (a ratio of the beam length).
    pub fn check_displacement(&self, read_m: f64, tolerance: f64) -> LengthCheck {
        let tolerance_m = tolerance * self.stage.beam_length_m;
        LengthCheck::new(read_m, self.stage.operating_point_m, tolerance_m)
    }

    /// Checks the modes of the chirp at a point, frequency in hertz and sign of the residue, against the modes of the model
    /// under the load.
    ///
    /// A mode holds within `campaign.frequency_tolerance_ratio` and with the sign of its residue, if that is certain. It proves
    /// the load if the mode of that number is not visible without the load, or is more than twice the tolerance away.
    /// Frequencies alone cannot distinguish a mass on stage 2 from one on stage 3, which mirrors the stage: the signs do.
    pub fn check_modes(
        &self,
        load: &Load,
        measured: &[(f64, char)],
    ) -> Result<Vec<ModeCheck>, CampaignError> {
        let loaded = self.loaded(load);
        let expected = ExpectedModes {
            more_asymmetric: [
                modes(&more_asymmetric(&loaded, -UNKNOWN_ASYMMETRY))?,
                modes(&more_asymmetric(&loaded, UNKNOWN_ASYMMETRY))?,
            ],
            loaded: modes(&loaded)?,
            unloaded: modes(&self.loaded(&Load::default()))?,
            tolerance: self.settings.frequency_tolerance_ratio,
        };
        let numbers = 0..expected.loaded.len();
        let visible = numbers.filter(|k| residue_ratio(&expected.loaded, *k) > NEGLIGIBLE_RATIO);
        Ok(visible.map(|k| expected.check(k, measured)).collect())
    }
}

fn modes(stage: &Sr4dofSettings) -> Result<Vec<Mode>, CampaignError> {
    let plant = bench_plant::build(&PlantSettings::Sr4dof(stage.clone()))?;
    Ok(ModalModel::of(&plant)?.modes)
}

fn more_asymmetric(stage: &Sr4dofSettings, by: f64) -> Sr4dofSettings {
    Sr4dofSettings {
        mass_asymmetry: stage.mass_asymmetry + by,
        ..stage.clone()
    }
}

/// The modes by the model, lowest frequency first.
struct ExpectedModes {
    loaded: Vec<Mode>,
    unloaded: Vec<Mode>,
    /// The modes with less and with more asymmetry than the load gives.
    more_asymmetric: [Vec<Mode>; 2],
    tolerance: f64,
}

impl ExpectedModes {
    fn check(&self, k: usize, measured: &[(f64, char)]) -> ModeCheck {
        let (expected_hz, unloaded_hz) = (hz(&self.loaded[k]), hz(&self.unloaded[k]));
        let seen = nearest(expected_hz, measured);
        let expected_sign = self.sign(k);
        let (seen_hz, seen_sign) = seen.unzip();
        ModeCheck {
            expected_hz,
            unloaded_hz,
            seen_hz,
            expected_sign,
            seen_sign,
            finding: self.finding(k, seen, expected_sign),
        }
    }

    fn finding(&self, k: usize, seen: Option<(f64, char)>, expected_sign: Option<char>) -> Finding {
        let Some((hz, sign)) = seen else {
            let must_be_visible = residue_ratio(&self.loaded, k) > VISIBLE_RATIO;
            return if must_be_visible {
                Finding::Fails
            } else {
                Finding::CannotTell
            };
        };
        let is_frequency_off = distance(hz, self.expected_hz(k)) > self.tolerance;
        let is_sign_wrong = expected_sign.is_some_and(|expected| expected != sign);
        if is_frequency_off || is_sign_wrong {
            Finding::Fails
        } else if self.distinguishes_the_load(k) {
            Finding::Holds
        } else {
            Finding::CannotTell
        }
    }

    fn expected_hz(&self, k: usize) -> f64 {
        hz(&self.loaded[k])
    }

    fn distinguishes_the_load(&self, k: usize) -> bool {
        residue_ratio(&self.unloaded, k) < NEGLIGIBLE_RATIO
            || distance(hz(&self.unloaded[k]), self.expected_hz(k)) > 2.0 * self.tolerance
    }

    /// The sign of a visible residue that is the same on both sides of the asymmetry of the load.
    fn sign(&self, k: usize) -> Option<char> {
        let sign = |modes: &[Mode]| Sign::of(modes[k].residue_per_kg()).symbol();
        let expected = sign(&self.loaded);
        let is_certain = self
            .more_asymmetric
            .iter()
            .all(|modes| sign(modes) == expected);
        let is_visible = residue_ratio(&self.loaded, k) > VISIBLE_RATIO;
        (is_certain && is_visible).then_some(expected)
    }
}

/// Frequency and sign of the measured mode nearest to a frequency, if it is not another mode.
fn nearest(expected_hz: f64, measured: &[(f64, char)]) -> Option<(f64, char)> {
    let modes = measured.iter().copied();
    let away = |mode: &(f64, char)| distance(mode.0, expected_hz);
    let nearest = modes.min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.filter(|mode| away(mode) < OTHER_MODE_RATIO)
}

/// Distance of a frequency from the expected one, as a ratio.
fn distance(hz: f64, expected_hz: f64) -> f64 {
    (hz / expected_hz - 1.0).abs()
}

/// A residue as a ratio of the largest one.
fn residue_ratio(modes: &[Mode], k: usize) -> f64 {
    let sizes = modes.iter().map(|mode| mode.residue_per_kg().abs());
    modes[k].residue_per_kg().abs() / sizes.fold(0.0, f64::max)
}

fn hz(mode: &Mode) -> f64 {
    mode.omega_rad_s / std::f64::consts::TAU
}

impl LoadCheck {
    /// The result of all checks: it fails if any fails, and holds if any of the others holds.
    pub fn finding(&self) -> Finding {
        let lengths = [Some(&self.rest), self.read.as_ref()];
        let findings = lengths.into_iter().flatten().map(|check| check.finding);
        combined(findings.chain([self.modes_finding()]))
    }

    /// The result of the modes.
    pub fn modes_finding(&self) -> Finding {
        combined(self.modes.iter().map(|mode| mode.finding))
    }

    /// One sentence for each check that failed.
    pub fn failures(&self) -> Vec<String> {
        let rest = self.rest.failure(
            "without current the stage rests in X at",
            "the cable pulls in X, or something touches the stage",
        );
        let displacement = self.read.as_ref().and_then(|read| {
            read.failure(
                "the displacement in Y is",
                "check the weight and the pulley",
            )
        });
        let modes = self.modes.iter().filter_map(ModeCheck::failure);
        rest.into_iter().chain(displacement).chain(modes).collect()
    }
}

impl ModeCheck {
    fn failure(&self) -> Option<String> {
        if self.finding != Finding::Fails {
            return None;
        }
        let seen = match self.seen_hz {
            Some(hz) => format!("is at {hz:.2} Hz{}", residue_text(self.seen_sign)),
            None => "is missing".to_string(),
        };
        Some(format!(
            "the mode expected at {:.2} Hz{} ({:.2} Hz without the load) {seen}",
            self.expected_hz,
            residue_text(self.expected_sign),
            self.unloaded_hz
        ))
    }
}

fn residue_text(sign: Option<char>) -> String {
    sign.map_or(String::new(), |sign| format!(", residue {sign}"))
}

fn combined(findings: impl Iterator<Item = Finding>) -> Finding {
    findings.fold(Finding::CannotTell, |all, one| match (all, one) {
        (Finding::Fails, _) | (_, Finding::Fails) => Finding::Fails,
        (Finding::Holds, _) | (_, Finding::Holds) => Finding::Holds,
        _ => Finding::CannotTell,
    })
}
