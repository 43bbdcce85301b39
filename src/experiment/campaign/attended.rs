//! A campaign on a stage that a person loads, point by point.
//!
//! ```text
//!  nothing on --ask--> rest --.
//!                             v
//!  next point --ask: put on--> rest, read --fails--> ask again, or `right`
//!       ^                         | holds, or cannot tell
//!       |                         v
//!       |                       chirp --> modes --fails--> ask again, or `right`
//!       '------- kept <-----------'
//! ```

use super::check::{LengthCheck, PutOn, modes};
use super::{AnswerError, CampaignError, Finding, Grid, Load, Place, Point, Rest};
use crate::config::Config;

/// What is asked of a person.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// What to do, or what is wrong.
    pub text: String,
    /// Whether a displacement in Y may be answered.
    pub may_read: bool,
    /// Whether `right` may be answered: something failed.
    pub may_confirm: bool,
    /// Whether the point may be skipped.
    pub may_skip: bool,
}

/// What a person answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply {
    /// It is done; with the displacement in Y in metres, where it was read.
    Done(Option<f64>),
    /// It is right although a check failed.
    Right,
    /// Leave this point out for now.
    Skip,
    /// End here.
    Stop,
}

/// Who loads the stage.
pub trait Person {
    /// Asks, and waits for the answer.
    fn ask(&mut self, question: &Question) -> Reply;
    /// Says something that needs no answer.
    fn tell(&mut self, text: &str);
}

/// What measures it.
pub trait Stage {
    /// What may go wrong.
    type Error: From<CampaignError> + From<AnswerError>;
    /// A quiet run; none where a person stopped it.
    fn rest(&mut self) -> Result<Option<Rest>, Self::Error>;
    /// A chirp at a point; none where a person stopped it.
    fn measure(&mut self, place: Place) -> Result<Option<Point>, Self::Error>;
    /// Keeps the result of a point.
    fn keep(&mut self, place: Place, point: &Point) -> Result<(), Self::Error>;
}

/// A grid on a stage that a person loads.
pub struct Attended<'a, P, S> {
    /// Settings of the whole grid.
    pub config: &'a Config,
    /// Where to measure.
    pub grid: &'a Grid,
    /// How far a displacement that is read may be off, a ratio of the beam length.
    pub tolerance: f64,
    /// Who loads the stage.
    pub person: P,
    /// What measures it.
    pub stage: S,
}

/// How a point ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Next {
    Kept,
    Skipped,
    Stopped,
}

/// What is known of the stage between two points.
struct Known {
    on: Load,
    unloaded: Rest,
}

impl<P: Person, S: Stage> Attended<'_, P, S> {
    /// Goes through `places` in their order (see [`super::order()`]). Ends early where the person stops it; what is kept stays.
    pub fn go(&mut self, places: &[Place]) -> Result<(), S::Error> {
        if places.is_empty() {
            return Ok(());
        }
        let Some(unloaded) = self.unloaded()? else {
            return Ok(());
        };
        let mut known = Known {
            on: Load::default(),
            unloaded,
        };
        for (index, place) in places.iter().enumerate() {
            let number = format!("point {} of {}", index + 1, places.len());
            match self.point(*place, &number, &mut known)? {
                Next::Kept | Next::Skipped => {}
                Next::Stopped => break,
            }
        }
        Ok(())
    }

    /// Where the stage rests with nothing on it.
    fn unloaded(&mut self) -> Result<Option<Rest>, S::Error> {
        let text = "first, with nothing on: take every weight off the cable and every added mass off stages 2 and 3"
            .to_string();
        let question = Question {
            text,
            may_read: false,
            may_confirm: false,
            may_skip: false,
        };
        match self.person.ask(&question) {
            Reply::Stop => Ok(None),
            _ => self.stage.rest(),
        }
    }

    fn point(&mut self, place: Place, number: &str, known: &mut Known) -> Result<Next, S::Error> {
        let config = self.grid.config(self.config, place)?;
        let load = Load::of(&config)?;
        let mut question = self.put_on(place, number, &load.orders(&known.on));
        let (mut failed, mut read_m): (Option<Point>, Option<f64>) = (None, None);
        loop {
            let confirmed;
            (read_m, confirmed) = match (self.person.ask(&question), failed.take()) {
                (Reply::Stop, _) => return Ok(Next::Stopped),
                (Reply::Skip, _) => return Ok(Next::Skipped),
                (Reply::Right, Some(point)) => return self.keep(place, confirmed_by_hand(point)),
                (Reply::Right, None) => (read_m, question.may_confirm),
                (Reply::Done(read_m), _) => (read_m, false),
            };
            known.on = load;
            let Some(rest) = self.stage.rest()? else {
                return Ok(Next::Stopped);
            };
            let mut put_on = self.lengths(&config, load, rest, known, read_m)?;
            put_on.confirmed_by_hand = confirmed;
            if put_on.finding() == Finding::Fails && !confirmed {
                question = again(&put_on, None);
                continue;
            }
            let Some(mut point) = self.stage.measure(place)? else {
                return Ok(Next::Stopped);
            };
            put_on.modes = modes(&config, &load, &point)?;
            (question, point.put_on) = (again(&put_on, Some(&point)), Some(put_on.clone()));
            // What was confirmed before the chirp says nothing of the modes.
            if put_on.modes_find() != Finding::Fails {
                return self.keep(place, point);
            }
            failed = Some(point);
        }
    }

    fn put_on(&self, place: Place, number: &str, orders: &[String]) -> Question {
        let (y, d) = (
            self.grid.operating_points[place.row],
            self.grid.asymmetries[place.column],
        );
        let head = format!(
            "{number}: Y1o = {:.2} % of L, m2/m3 - 1 = {:+.2} %",
            100.0 * y,
            100.0 * d
        );
        let text = format!("{head}\n  {}", orders.join("\n  "));
        Question {
            text,
            may_read: true,
            may_confirm: false,
            may_skip: true,
        }
    }

    fn lengths(
        &self,
        config: &Config,
        load: Load,
        rest: Rest,
        known: &Known,
        read_m: Option<f64>,
    ) -> Result<PutOn, S::Error> {
        let read = read_m
            .map(|read_m| LengthCheck::read(config, read_m, self.tolerance))
            .transpose()?;
        Ok(PutOn {
            load,
            rest: LengthCheck::rest(config, &load, &rest, &known.unloaded)?,
            rest_recording: rest.recording,
            read,
            modes: Vec::new(),
            confirmed_by_hand: false,
        })
    }

    fn keep(&mut self, place: Place, point: Point) -> Result<Next, S::Error> {
        self.stage.keep(place, &point)?;
        let said = match point
            .put_on
            .as_ref()
            .map(|put_on| (put_on.finding(), put_on.confirmed_by_hand))
        {
            Some((_, true)) => "confirmed by hand",
            Some((Finding::Holds, _)) => "what can be checked of the load holds",
            _ => "nothing speaks against the load, but no check could tell it from none",
        };
        self.person
            .tell(&format!("kept: CNMP zeros {}; {said}", point.cnmp.name()));
        Ok(Next::Kept)
    }
}

fn confirmed_by_hand(mut point: Point) -> Point {
    point
        .put_on
        .iter_mut()
        .for_each(|put_on| put_on.confirmed_by_hand = true);
    point
}

/// What is wrong, and what can be done. A chirp without modes, as of a run that tripped, says why before anything else.
fn again(put_on: &PutOn, point: Option<&Point>) -> Question {
    let silent = point.filter(|point| point.modes_hz.is_empty());
    let silent = silent.map(|point| format!("the chirp shows no modes: {}", point.why));
    let failures: Vec<String> = silent.into_iter().chain(put_on.failures()).collect();
    let text = format!(
        "this is not what was to be put on:\n  {}\nput it right; a model that is off everywhere is mended in [plant] and \
         campaign.frequency_tolerance_ratio",
        failures.join("\n  ")
    );
    Question {
        text,
        may_read: true,
        may_confirm: true,
        may_skip: true,
    }
}
