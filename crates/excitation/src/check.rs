//! Whether an excitation may run: its extremes by the model, against every interlock.

use super::amplitude::AmplitudeCurve;
use super::design::ChosenExcitation;
use super::extremes::Extremes;
use super::limits::Limits;
use super::waveform::Excitation;
use bench_base::numeric::is_within;

/// An excitation that the interlocks would trip, or whose record could not be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExcitationError {
    /// The model gives no number.
    #[error(
        "the {what} of the excitation by the model is not a number, so no limit can be checked; check the model with `bench model modes`, or lower {setting}"
    )]
    NotANumber {
        /// The figure.
        what: &'static str,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Beyond the motor or the amplifier.
    #[error(
        "the largest current by the model is {current_a:.3} A, above {what} of {limit_a:.3} A; lower {setting}"
    )]
    Current {
        /// The largest current.
        current_a: f64,
        /// The limit.
        limit_a: f64,
        /// The part with this limit.
        what: &'static str,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Faster than the amplifier can follow.
    #[error(
        "the slew rate of the excitation is {slew_a_per_s:.0} A/s, above the limit of the amplifier of {limit_a_per_s:.0} A/s; lower {setting} or the highest frequency"
    )]
    Slew {
        /// Its largest change.
        slew_a_per_s: f64,
        /// The amplifier's limit.
        limit_a_per_s: f64,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Beyond the thermal rating of the motor.
    #[error(
        "the thermal current of the motor would be {thermal_a:.3} A, above the limit of {limit_a:.3} A; lower {setting}, or shorten the run"
    )]
    Heat {
        /// Largest thermal current.
        thermal_a: f64,
        /// Continuous rating.
        limit_a: f64,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Beyond the soft limit.
    #[error(
        "in the model the stage travels {travel_um:.0} um{}, above the soft limit of {limit_um:.0} um; lower {setting}{}",
        .frequency_hz.map_or(String::new(), |f| format!(" at {f:.1} Hz")),
        .frequency_hz.map_or("", |_| " there, or use --shape model")
    )]
    Travel {
        /// Largest travel by the model.
        travel_um: f64,
        /// The frequency that is excited at this time, if there is only one.
        frequency_hz: Option<f64>,
        /// The soft limit.
        limit_um: f64,
        /// The setting to lower.
        setting: &'static str,
    },
    /// The kind `own` without its table.
    #[error(
        "excitation.kind is \"own\", which needs the table [own_excitation]; add it with `kind = NAME`, or choose another kind"
    )]
    NoOwnTable,
    /// Some lines are too small compared with others.
    #[error(
        "chirp.amplitude goes from {least_a:.3e} to {most_a:.3e} A within the band; lines below 1/{max_span} of the largest cannot be distinguished from lines that are not excited; raise the smallest amplitude, or lower the largest"
    )]
    Span {
        /// The smallest amplitude within the band.
        least_a: f64,
        /// The largest amplitude within the band.
        most_a: f64,
        /// The largest allowed ratio of the two.
        max_span: f64,
    },
}

/// Relative error of an amplitude that was interpolated on logarithmic axes: some rounding errors of the logarithm of 1 uA, 3e-15 each.
const ROUNDING: f64 = 1e-12;

impl ChosenExcitation<'_> {
    /// Refuses an excitation that would trip an interlock; returns its extremes. `position_m` is the model of the plant: it
    /// takes the command of each tick and returns the position after it.
    pub fn check(
        &self,
        limits: &Limits,
        position_m: impl FnMut(f64) -> f64,
    ) -> Result<Extremes, ExcitationError> {
        self.check_span()?;
        let excitation = self.build();
        let extremes = Extremes::of(&excitation, limits, position_m);
        let frequency_hz = excitation.frequency_at_hz(extremes.travel_tick);
        limits.check(&extremes, frequency_hz, self.design.amplitude_key())?;
        Ok(extremes)
    }

    fn check_span(&self) -> Result<(), ExcitationError> {
        let chirp = self.shared.chirp;
        let (low_hz, high_hz) = chirp.band_hz();
        let (least_a, most_a) = AmplitudeCurve::of_current(&chirp.amplitude).range(low_hz, high_hz);
        match self.design.max_span() {
            Some(max_span) if most_a > max_span * least_a * (1.0 + ROUNDING) => {
                Err(ExcitationError::Span {
                    least_a,
                    most_a,
                    max_span,
                })
            }
            _ => Ok(()),
        }
    }
}

impl Limits {
    /// Refuses what would trip an interlock. `frequency_hz` is the frequency that is excited where the travel is largest,
    /// `setting` the setting to lower.
    pub fn check(
        &self,
        extremes: &Extremes,
        frequency_hz: Option<f64>,
        setting: &'static str,
    ) -> Result<(), ExcitationError> {
        check_numbers(extremes, setting)?;
        self.check_current(extremes.current_a, setting)?;
        self.check_slew(extremes.slew_a_per_s, setting)?;
        self.check_heat(extremes.thermal_current_a, setting)?;
        self.check_travel(extremes.travel_m, frequency_hz, setting)
    }

    fn check_travel(
        &self,
        travel_m: f64,
        frequency_hz: Option<f64>,
        setting: &'static str,
    ) -> Result<(), ExcitationError> {
        if is_within(travel_m, self.travel_m) {
            Ok(())
        } else {
            Err(ExcitationError::Travel {
                travel_um: travel_m * 1e6,
                frequency_hz,
                limit_um: self.travel_m * 1e6,
                setting,
            })
        }
    }

    fn check_slew(&self, slew_a_per_s: f64, setting: &'static str) -> Result<(), ExcitationError> {
        let limit_a_per_s = self.slew_a_per_s;
        if is_within(slew_a_per_s, limit_a_per_s) {
            Ok(())
        } else {
            Err(ExcitationError::Slew {
                slew_a_per_s,
                limit_a_per_s,
                setting,
            })
        }
    }

    fn check_heat(&self, thermal_a: f64, setting: &'static str) -> Result<(), ExcitationError> {
        let limit_a = self.continuous_current_a;
        if is_within(thermal_a, limit_a) {
            Ok(())
        } else {
            Err(ExcitationError::Heat {
                thermal_a,
                limit_a,
                setting,
            })
        }
    }

    fn check_current(&self, current_a: f64, setting: &'static str) -> Result<(), ExcitationError> {
        let limits = [
            (self.peak_current_a, "the motor's peak current"),
            (self.amplifier_current_a, "the amplifier's limit"),
        ];
        let mut limits = limits.into_iter();
        match limits.find(|(limit_a, _)| !is_within(current_a, *limit_a)) {
            Some((limit_a, what)) => Err(ExcitationError::Current {
                current_a,
                limit_a,
                what,
                setting,
            }),
            None => Ok(()),
        }
    }
}

/// Refuses extremes that are not numbers.
fn check_numbers(extremes: &Extremes, setting: &'static str) -> Result<(), ExcitationError> {
    let figures = [
        ("current", extremes.current_a),
        ("slew rate", extremes.slew_a_per_s),
        ("thermal current", extremes.thermal_current_a),
        ("travel", extremes.travel_m),
    ];
    match figures.into_iter().find(|(_, value)| value.is_nan()) {
        Some((what, _)) => Err(ExcitationError::NotANumber { what, setting }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_profile::{Profile, profile};
    use crate::{AmplitudePoint, ExcitationKind};
    use bench_plant::DiscretePlant;

    fn checked(change: &dyn Fn(&mut Profile)) -> Result<Extremes, ExcitationError> {
        let mut config = profile();
        change(&mut config);
        let structure = bench_plant::build(&config.plant).unwrap();
        let modes = bench_plant::ModalModel::of(&structure).unwrap().modes;
        let (bandwidth_hz, force_constant) =
            (config.amplifier_bandwidth_hz, config.force_constant_n_per_a);
        let plant =
            DiscretePlant::new(&modes, bandwidth_hz, force_constant, config.limits.period_s);
        let mut motion = plant.at_rest();
        let position_m = |command_a| {
            plant.step(&mut motion, command_a, |_| 0.0);
            plant.position_m(&motion)
        };
        config.chosen_excitation().check(&config.limits, position_m)
    }

    fn flat(config: &mut Profile, current_a: f64) {
        config.chirp.amplitude = vec![AmplitudePoint {
            frequency_hz: 1.0,
            current_a,
        }];
    }

    #[test]
    fn rejects_a_position_or_current_that_is_not_a_number() {
        let config = profile();
        let limits = config.limits;
        for (signals, figure) in [
            ([(0.0, 0.0), (0.0, f64::NAN), (0.0, 1e-6)], "travel"),
            ([(0.0, 0.0), (f64::NAN, 0.0), (0.1, 1e-6)], "current"),
            // The square is beyond the largest number, and the thermal model subtracts infinity from infinity.
            ([(1e300, 0.0), (1e300, 0.0), (0.0, 0.0)], "thermal current"),
        ] {
            let extremes = Extremes::over(signals.into_iter(), &limits);
            let checked = limits.check(&extremes, None, "the amplitude");
            assert!(
                matches!(checked, Err(ExcitationError::NotANumber { what, .. }) if what == figure),
                "{figure}: {checked:?}"
            );
        }
    }

    #[test]
    fn rejects_excitation_beyond_the_interlocks_with_the_figures() {
        let travel_m = checked(&|_| {}).unwrap().travel_m;
        assert!(
            (300e-6..900e-6).contains(&travel_m),
            "the default moves and stays inside: {travel_m}"
        );
        assert!(matches!(
            checked(&|c| flat(c, 9.99)),
            Err(ExcitationError::Current { .. })
        ));
        assert!(matches!(
            checked(&|c| flat(c, 8.0)),
            Err(ExcitationError::Slew { .. })
        ));
        assert!(matches!(
            checked(&|c| flat(c, 3.5)),
            Err(ExcitationError::Heat { .. })
        ));
        let Err(ExcitationError::Travel {
            travel_um,
            frequency_hz,
            ..
        }) = checked(&|c| flat(c, 0.3))
        else {
            panic!()
        };
        // Mode R at 183.9 rad/s = 29.3 Hz rings up as the sweep passes it.
        assert!(
            (27.0..33.0).contains(&frequency_hz.unwrap()) && travel_um > 900.0,
            "{travel_um} {frequency_hz:?}"
        );
    }

    #[test]
    fn rejection_of_every_kind_names_the_setting_to_lower() {
        let with = |kind: ExcitationKind, current_a: f64| {
            move |config: &mut Profile| {
                (config.kind, config.excitations.prbs.amplitude_a) = (kind, current_a);
                (config.chirp.start_hz, config.chirp.quiet_after_s) = (20.0, 0.5);
                (
                    config.excitations.multisine.periods,
                    config.excitations.prbs.periods,
                    config.excitations.stepped_sine.count,
                ) = (5, 5, 30);
                flat(config, current_a);
            }
        };
        for (kind, setting) in [
            (ExcitationKind::Multisine, "chirp.amplitude"),
            (ExcitationKind::SteppedSine, "chirp.amplitude"),
            (ExcitationKind::Prbs, "prbs.amplitude_a"),
        ] {
            assert!(checked(&with(kind, 0.01)).is_ok(), "{kind:?}");
            // The limit is the motor's peak current, or the travel.
            for current_a in [12.0, 3.0] {
                let error = checked(&with(kind, current_a)).unwrap_err().to_string();
                assert!(error.contains(setting), "{kind:?}: {error}");
            }
        }
        // A step from +a to -a within a tick of 0.2 ms has 22,000 A/s at 2.2 A; the limit is 20,000.
        let slow = |config: &mut Profile| {
            with(ExcitationKind::Prbs, 2.2)(config);
            config.limits.travel_m = 1.0;
        };
        assert!(matches!(checked(&slow), Err(ExcitationError::Slew { .. })));
    }

    #[test]
    fn rejects_multisine_whose_lines_differ_too_much() {
        let steep = |config: &mut Profile| {
            config.kind = ExcitationKind::Multisine;
            let point = |frequency_hz, current_a| AmplitudePoint {
                frequency_hz,
                current_a,
            };
            config.chirp.amplitude = vec![point(1.0, 0.001), point(100.0, 0.06)];
        };
        assert!(matches!(checked(&steep), Err(ExcitationError::Span { .. })));
    }
}
