//! A campaign on a stage that an operator loads, point by point.
//!
//! ```text
//!  unloaded stage --> rest position --.
//!                                     v
//!  next point --ask for the load--> rest position, displacement --fails--> ask again, or `right`
//!       ^                             | holds, or cannot tell
//!       |                             v
//!       |                           chirp --> modes --fails--> ask again, or `right`
//!       '----------- keep <-----------'
//! ```

use super::error::CampaignError;
use super::grid::{Grid, GridPoint};
use super::load::{Finding, Load, LoadCheck, RestPosition, StageModel};
use super::point::PointResult;
use bench_base::decimal::Decimal;
use bench_config::{Config, Sr4dofSettings};

/// A question to the operator.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// The instruction, or the error.
    pub text: String,
    /// Whether a displacement in Y may be entered.
    pub may_read: bool,
    /// Whether `right` may be answered: a check failed.
    pub may_confirm: bool,
    /// Whether the point may be skipped.
    pub may_skip: bool,
}

/// An answer of the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply {
    /// The load is set; with the displacement in Y in metres, if it was measured.
    Done(Option<f64>),
    /// The load is right although a check failed.
    Right,
    /// Leave this point out for now.
    Skip,
    /// End the campaign here.
    Stop,
}

/// The operator who loads the stage.
pub trait Operator {
    /// Asks a question and waits for the answer.
    fn ask(&mut self, question: &Question) -> Reply;
    /// Shows a message that needs no answer.
    fn report(&mut self, text: &str);
}

/// The rig whose stage the operator loads.
pub trait LoadedRig {
    /// Measures the rest position in a run with zero current; `None` if the run was stopped.
    fn rest_position(&mut self) -> Result<Option<RestPosition>, CampaignError>;
    /// Makes a chirp at a point; `None` if the run was stopped.
    fn measure(&mut self, point: GridPoint) -> Result<Option<PointResult>, CampaignError>;
    /// Stores the result of a point.
    fn store(&mut self, point: GridPoint, result: &PointResult) -> Result<(), CampaignError>;
}

/// A campaign on a stage that an operator loads.
pub struct GuidedCampaign<'a, O: ?Sized, R> {
    /// Settings of the whole grid.
    pub config: &'a Config,
    /// The grid.
    pub grid: &'a Grid,
    /// Allowed error of a measured displacement, a ratio of the beam length.
    pub tolerance: f64,
    /// The operator.
    pub operator: &'a mut O,
    /// The rig.
    pub rig: R,
}

/// How a point ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PointEnd {
    Kept,
    Skipped,
    Stopped,
}

/// The load of the stage, and the rest position of the unloaded stage.
struct StageState {
    load: Load,
    unloaded: RestPosition,
}

/// A point whose load is being set and checked.
struct PointInProgress<'a> {
    point: GridPoint,
    model: StageModel<'a>,
    load: Load,
    question: Question,
    /// The displacement in Y that the operator measured.
    read_m: Option<f64>,
    /// The chirp whose modes failed.
    failed: Option<PointResult>,
}

/// The next step after an answer.
enum NextStep {
    End(PointEnd),
    /// The operator confirmed the failed chirp.
    KeepFailed(Box<PointResult>),
    Check {
        confirmed: bool,
    },
}

impl<O: Operator + ?Sized, R: LoadedRig> GuidedCampaign<'_, O, R> {
    /// Visits `points` in this order (see [`super::visit_order()`]). If the operator stops, the results so far are kept.
    pub fn run(&mut self, points: &[GridPoint]) -> Result<(), CampaignError> {
        if points.is_empty() {
            return Ok(());
        }
        let Some(unloaded) = self.unloaded_position()? else {
            return Ok(());
        };
        let mut state = StageState {
            load: Load::default(),
            unloaded,
        };
        for (index, point) in points.iter().enumerate() {
            let number = format!("point {} of {}", index + 1, points.len());
            if self.visit(*point, &number, &mut state)? == PointEnd::Stopped {
                break;
            }
        }
        Ok(())
    }

    fn unloaded_position(&mut self) -> Result<Option<RestPosition>, CampaignError> {
        let question = Question {
            text: "begin with the unloaded stage:\n  remove every weight from the cable and every added mass from stages 2 and 3\n  then keep clear: \
                the stage is measured at rest, without current"
                .into(),
            may_read: false,
            may_confirm: false,
            may_skip: false,
        };
        match self.operator.ask(&question) {
            Reply::Stop => Ok(None),
            _ => self.rig.rest_position(),
        }
    }

    fn visit(
        &mut self,
        point: GridPoint,
        number: &str,
        state: &mut StageState,
    ) -> Result<PointEnd, CampaignError> {
        let config = self.grid.config_at(self.config, point)?;
        let model = StageModel::of(&config)?;
        let load = model.required_load();
        let mut visit = PointInProgress {
            point,
            model,
            load,
            question: self.load_question(
                point,
                number,
                model.stage,
                &load.instructions(&state.load),
            ),
            read_m: None,
            failed: None,
        };
        loop {
            match self.ask(&mut visit) {
                NextStep::End(end) => return Ok(end),
                NextStep::KeepFailed(result) => return self.store(point, confirmed(*result)),
                NextStep::Check { confirmed } => {
                    state.load = load;
                    if let Some(end) = self.measure(&mut visit, &state.unloaded, confirmed)? {
                        return Ok(end);
                    }
                }
            }
        }
    }

    fn ask(&mut self, visit: &mut PointInProgress<'_>) -> NextStep {
        let failed = visit.failed.take();
        match (self.operator.ask(&visit.question), failed) {
            (Reply::Stop, _) => NextStep::End(PointEnd::Stopped),
            (Reply::Skip, _) => NextStep::End(PointEnd::Skipped),
            (Reply::Right, Some(result)) => NextStep::KeepFailed(Box::new(result)),
            (Reply::Right, None) => NextStep::Check {
                confirmed: visit.question.may_confirm,
            },
            (Reply::Done(read_m), _) => {
                visit.read_m = read_m;
                NextStep::Check { confirmed: false }
            }
        }
    }

    /// Measures and checks a loaded point; `None` if a check failed and the operator must be asked again.
    fn measure(
        &mut self,
        visit: &mut PointInProgress<'_>,
        unloaded: &RestPosition,
        confirmed: bool,
    ) -> Result<Option<PointEnd>, CampaignError> {
        let Some(rest) = self.rig.rest_position()? else {
            return Ok(Some(PointEnd::Stopped));
        };
        let mut check = self.check_lengths(visit, rest, unloaded);
        check.confirmed_by_hand = confirmed;
        if check.finding() == Finding::Fails && !confirmed {
            visit.question = failed_question(&check, None);
            return Ok(None);
        }
        match self.rig.measure(visit.point)? {
            Some(result) => self.check_chirp(visit, check, result),
            None => Ok(Some(PointEnd::Stopped)),
        }
    }

    /// Checks the modes of a chirp. A confirmation before the chirp does not include them.
    fn check_chirp(
        &mut self,
        visit: &mut PointInProgress<'_>,
        mut check: LoadCheck,
        mut result: PointResult,
    ) -> Result<Option<PointEnd>, CampaignError> {
        check.modes = visit.model.check_modes(&visit.load, &result.modes())?;
        visit.question = failed_question(&check, Some(&result));
        let modes = check.modes_finding();
        result.load_check = Some(check);
        if modes == Finding::Fails {
            visit.failed = Some(result);
            return Ok(None);
        }
        self.store(visit.point, result).map(Some)
    }

    fn load_question(
        &self,
        point: GridPoint,
        number: &str,
        stage: &Sr4dofSettings,
        instructions: &[String],
    ) -> Question {
        let operating_point = Decimal(100.0 * self.grid.operating_points[point.row]);
        let displacement_mm = Decimal(1e3 * stage.operating_point_m);
        let asymmetry = Decimal(100.0 * self.grid.asymmetries[point.column]);
        let instructions = instructions.join("\n  ");
        Question {
            text: format!(
                "{number}: Y1o = {displacement_mm:.3} mm ({operating_point:.2} % of L), m2/m3 - 1 = {asymmetry:+.2} %\n  \
                 {instructions}\n  then keep clear until the next question: the stage is measured at rest, and one or more chirps move it"
            ),
            may_read: true,
            may_confirm: false,
            may_skip: true,
        }
    }

    fn check_lengths(
        &self,
        visit: &PointInProgress<'_>,
        rest: RestPosition,
        unloaded: &RestPosition,
    ) -> LoadCheck {
        let read = |read_m| visit.model.check_displacement(read_m, self.tolerance);
        LoadCheck {
            load: visit.load,
            rest: visit.model.check_rest(&visit.load, &rest, unloaded),
            rest_recording: rest.recording,
            read: visit.read_m.map(read),
            modes: Vec::new(),
            confirmed_by_hand: false,
        }
    }

    fn store(&mut self, point: GridPoint, result: PointResult) -> Result<PointEnd, CampaignError> {
        self.rig.store(point, &result)?;
        let (cnmp, load) = (result.cnmp.name(), load_text(&result));
        self.operator
            .report(&format!("stored: CNMP zeros {cnmp}; {load}"));
        Ok(PointEnd::Kept)
    }
}

/// How the load of a stored point is known.
fn load_text(result: &PointResult) -> &'static str {
    let check = result.load_check.as_ref();
    match check.map(|check| (check.finding(), check.confirmed_by_hand)) {
        Some((_, true)) => "load confirmed by hand",
        Some((Finding::Holds, _)) => "load verified",
        _ => "all checks agree with the load, but none of them can distinguish it from no load",
    }
}

fn confirmed(mut result: PointResult) -> PointResult {
    if let Some(check) = &mut result.load_check {
        check.confirmed_by_hand = true;
    }
    result
}

/// The failed checks and their remedy. For a chirp without modes, for example after a trip, the reason is stated first.
fn failed_question(check: &LoadCheck, result: Option<&PointResult>) -> Question {
    let without_modes = result.filter(|result| result.modes_hz.is_empty());
    let reason = without_modes.map(|result| format!("the chirp shows no modes: {}", result.why));
    let failures: Vec<String> = reason.into_iter().chain(check.failures()).collect();
    Question {
        text: format!(
            "a check of the load failed:\n  {}\nthis point needs:\n  {}\n\
             if the load differs: correct it and press Enter, the point is measured again\n\
             if the load is correct: type `right`\n\
             if this happens at every point: type `stop` and correct [plant] or campaign.frequency_tolerance_ratio",
            failures.join("\n  "),
            check.load.totals().join("\n  ")
        ),
        may_read: true,
        may_confirm: true,
        may_skip: true,
    }
}
