//! References for the closed loop, in metres relative to where the stage rests when the loop closes.

use super::{Chirp, Excitation};
use crate::config::{AmplitudePoint, ChirpSettings, ReferenceSettings, TravelPoint};

/// A reference over time, from the tick at which the loop closes.
pub trait Reference: Send {
    /// Metres at a tick counted from 0. *In the tick.*
    fn at_m(&self, tick: u64) -> f64;
}

/// A reference file that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReferenceError {
    /// The file cannot be read.
    #[error("cannot read the reference {path}: {why}")]
    Unreadable {
        /// The file.
        path: String,
        /// The system's words.
        why: String,
    },
    /// A line is not two numbers, or time does not rise.
    #[error(
        "{path} line {line}: {why}; a reference has the header `time_s,reference_m` and rising times"
    )]
    Line {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        why: String,
    },
}

/// The text of the file that the settings name, if they name one: it travels with a recording.
pub fn reference_text(settings: &ReferenceSettings) -> Result<Option<String>, ReferenceError> {
    let ReferenceSettings::File { path } = settings else {
        return Ok(None);
    };
    let text = std::fs::read_to_string(path);
    text.map(Some).map_err(|e| ReferenceError::Unreadable {
        path: path.into(),
        why: e.to_string(),
    })
}

/// The reference of the settings at a period of the loop, with the sweep that one of its kinds follows and the text of its
/// file if it has one. A new kind is one struct and one arm.
pub fn reference(
    settings: &ReferenceSettings,
    chirp: &ChirpSettings,
    text: Option<&str>,
    period_s: f64,
) -> Result<Box<dyn Reference>, ReferenceError> {
    let tick = |seconds: f64| libm::round(seconds / period_s) as u64;
    Ok(match settings {
        ReferenceSettings::Hold => Box::new(Step {
            amplitude_m: 0.0,
            at_tick: 0,
        }),
        ReferenceSettings::Step { amplitude_m, at_s } => Box::new(Step {
            amplitude_m: *amplitude_m,
            at_tick: tick(*at_s),
        }),
        ReferenceSettings::Ramp {
            amplitude_m,
            speed_m_per_s,
            at_s,
        } => {
            let slope_m = speed_m_per_s.abs().copysign(*amplitude_m) * period_s;
            Box::new(Ramp {
                amplitude_m: *amplitude_m,
                slope_m,
                at_tick: tick(*at_s),
            })
        }
        ReferenceSettings::Sine {
            amplitude_m,
            frequency_hz,
        } => Box::new(Sine {
            amplitude_m: *amplitude_m,
            cycles_per_tick: frequency_hz * period_s,
        }),
        ReferenceSettings::Chirp { amplitude, .. } => {
            Box::new(Swept(Chirp::new(&in_metres(chirp, amplitude), period_s)))
        }
        ReferenceSettings::File { path } => {
            Box::new(Table::parse(path, text.unwrap_or_default(), period_s)?)
        }
    })
}

struct Step {
    amplitude_m: f64,
    at_tick: u64,
}

impl Reference for Step {
    fn at_m(&self, tick: u64) -> f64 {
        if tick >= self.at_tick {
            self.amplitude_m
        } else {
            0.0
        }
    }
}

struct Ramp {
    amplitude_m: f64,
    slope_m: f64,
    at_tick: u64,
}

impl Reference for Ramp {
    fn at_m(&self, tick: u64) -> f64 {
        let way_m = tick.saturating_sub(self.at_tick) as f64 * self.slope_m;
        if way_m.abs() < self.amplitude_m.abs() {
            way_m
        } else {
            self.amplitude_m * f64::from(u8::from(tick >= self.at_tick))
        }
    }
}

struct Sine {
    amplitude_m: f64,
    cycles_per_tick: f64,
}

impl Reference for Sine {
    fn at_m(&self, tick: u64) -> f64 {
        let cycles = tick as f64 * self.cycles_per_tick;
        self.amplitude_m * libm::sin(2.0 * std::f64::consts::PI * (cycles - libm::floor(cycles)))
    }
}

/// A sweep whose amplitudes are metres where those of the motor are amperes.
struct Swept(Chirp);

impl Reference for Swept {
    fn at_m(&self, tick: u64) -> f64 {
        self.0.current_a(tick)
    }
}

/// The sweep with other amplitudes, in metres.
pub fn in_metres(chirp: &ChirpSettings, amplitude: &[TravelPoint]) -> ChirpSettings {
    let point = |p: &TravelPoint| AmplitudePoint {
        frequency_hz: p.frequency_hz,
        current_a: p.amplitude_m,
    };
    ChirpSettings {
        amplitude: amplitude.iter().map(point).collect(),
        ..chirp.clone()
    }
}

/// Points of a file, joined by straight lines; the first value before them, the last one after.
struct Table {
    points: Vec<(f64, f64)>,
    period_s: f64,
}

impl Table {
    fn parse(path: &str, text: &str, period_s: f64) -> Result<Table, ReferenceError> {
        let wrong = |line: usize, why: String| ReferenceError::Line {
            path: path.into(),
            line,
            why,
        };
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (index, line) in text
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty())
        {
            if index == 0 && line.trim() == "time_s,reference_m" {
                continue;
            }
            let point = point(line)
                .ok_or_else(|| wrong(index + 1, format!("`{line}` is not two finite numbers")))?;
            if points.last().is_some_and(|before| before.0 >= point.0) {
                return Err(wrong(
                    index + 1,
                    format!("the time {} s does not rise", point.0),
                ));
            }
            points.push(point);
        }
        if points.is_empty() {
            Err(wrong(1, "there is no point".into()))
        } else {
            Ok(Table { points, period_s })
        }
    }
}

fn point(line: &str) -> Option<(f64, f64)> {
    let (time, value) = line.split_once(',')?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    Some((number(time)?, number(value)?))
}

impl Reference for Table {
    fn at_m(&self, tick: u64) -> f64 {
        let time_s = tick as f64 * self.period_s;
        let after = self.points.partition_point(|(t, _)| *t <= time_s);
        match (
            after.checked_sub(1).and_then(|i| self.points.get(i)),
            self.points.get(after),
        ) {
            (Some(&(t0, r0)), Some(&(t1, r1))) => r0 + (r1 - r0) * (time_s - t0) / (t1 - t0),
            (Some(&(_, r)), None) | (None, Some(&(_, r))) => r,
            (None, None) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(settings: &ReferenceSettings) -> Result<Box<dyn Reference>, ReferenceError> {
        let chirp = crate::config::load(&Default::default()).unwrap().chirp;
        reference(settings, &chirp, reference_text(settings)?.as_deref(), 1e-3)
    }

    fn at(settings: ReferenceSettings, tick: u64) -> f64 {
        made(&settings).unwrap().at_m(tick)
    }

    #[test]
    fn references_are_what_their_names_say() {
        let step = ReferenceSettings::Step {
            amplitude_m: -5e-5,
            at_s: 0.2,
        };
        assert_eq!((at(step.clone(), 199), at(step, 200)), (0.0, -5e-5));
        for amplitude_m in [4e-6, -4e-6] {
            let ramp = ReferenceSettings::Ramp {
                amplitude_m,
                speed_m_per_s: 1e-4,
                at_s: 0.1,
            };
            let side = amplitude_m.signum();
            for (tick, expected) in [
                (0, 0.0),
                (100, 0.0),
                (120, 2e-6 * side),
                (140, 4e-6 * side),
                (1000, 4e-6 * side),
            ] {
                assert!((at(ramp.clone(), tick) - expected).abs() < 1e-18, "{tick}");
            }
        }
        let sine = ReferenceSettings::Sine {
            amplitude_m: 1e-6,
            frequency_hz: 10.0,
        };
        assert!((at(sine, 25) - 1e-6).abs() < 1e-18);
        assert_eq!(at(ReferenceSettings::Hold, 7), 0.0);
    }

    #[test]
    fn a_file_is_read_with_straight_lines_between_its_points() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(
            file.path(),
            "time_s,reference_m\n0,0\n0.01,1e-6\n0.02,1e-6\n",
        )
        .unwrap();
        let settings = ReferenceSettings::File {
            path: file.path().display().to_string(),
        };
        for (tick, expected) in [(0, 0.0), (5, 5e-7), (10, 1e-6), (500, 1e-6)] {
            assert!(
                (at(settings.clone(), tick) - expected).abs() < 1e-18,
                "{tick}"
            );
        }
    }

    #[test]
    fn a_file_that_cannot_be_followed_is_refused_with_its_line() {
        for (text, line) in [
            ("", 1),
            ("time_s,reference_m\n0,0\nx,1\n", 3),
            ("0,0\n0,1\n", 2),
            ("0,NaN\n", 1),
            ("0;1\n", 1),
        ] {
            let file = tempfile::NamedTempFile::new().unwrap();
            std::fs::write(file.path(), text).unwrap();
            let settings = ReferenceSettings::File {
                path: file.path().display().to_string(),
            };
            let error = made(&settings).err().unwrap();
            assert!(
                matches!(error, ReferenceError::Line { line: l, .. } if l == line),
                "{text:?}: {error}"
            );
        }
        let missing = ReferenceSettings::File {
            path: "/nonexistent".into(),
        };
        assert!(matches!(
            made(&missing),
            Err(ReferenceError::Unreadable { .. })
        ));
    }
}
