//! Whether an excitation may run: what it would do by the model, against every interlock.

use super::{Amplitude, Excitation, Extremes};
use crate::config::{Config, ExcitationKind};
use crate::model::plant::DiscretePlant;

/// A periodic analysis takes lines below a hundredth of the largest for ones that were not excited; half of that is kept clear.
pub const LARGEST_SPAN: f64 = 50.0;

/// An excitation that the interlocks would trip, or that would not show what it is for.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExcitationError {
    /// Beyond the motor or the amplifier.
    #[error(
        "the excitation's largest current of {current_a:.3} A is beyond {limit_a:.3} A, {what}; lower {setting}"
    )]
    Current {
        /// The largest current.
        current_a: f64,
        /// The limit.
        limit_a: f64,
        /// Whose limit it is.
        what: &'static str,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Faster than the amplifier can follow.
    #[error(
        "the excitation changes by up to {slew_a_per_s:.0} A/s, the amplifier follows {limit_a_per_s:.0} A/s; lower {setting} or the highest frequency"
    )]
    Slew {
        /// Its largest change.
        slew_a_per_s: f64,
        /// The amplifier's limit.
        limit_a_per_s: f64,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Too hot.
    #[error(
        "the excitation would heat the motor to a thermal current of {thermal_a:.3} A, {limit_a:.3} A are allowed; lower {setting} or shorten it"
    )]
    Heat {
        /// Largest thermal current.
        thermal_a: f64,
        /// Continuous rating.
        limit_a: f64,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Too far.
    #[error(
        "by the model the stage would travel {travel_um:.0} um{}, the soft limit is {limit_um:.0} um; lower {setting}{}",
        .frequency_hz.map_or(String::new(), |f| format!(" at {f:.1} Hz")),
        .frequency_hz.map_or("", |_| " there, or take --shape model")
    )]
    Travel {
        /// Largest travel by the model.
        travel_um: f64,
        /// The one frequency excited when it happens, if it is one.
        frequency_hz: Option<f64>,
        /// The soft limit.
        limit_um: f64,
        /// The setting to lower.
        setting: &'static str,
    },
    /// Some lines are too small beside others.
    #[error(
        "chirp.amplitude goes from {least_a:.3e} to {most_a:.3e} A within the band; of a multisine, lines below 1/{LARGEST_SPAN} of the largest cannot be told from unexcited ones: raise the least or lower the largest"
    )]
    Span {
        /// The least amplitude within the band.
        least_a: f64,
        /// The largest.
        most_a: f64,
    },
}

/// Refuses an excitation that would trip an interlock by the model of the plant; returns what it would do.
pub fn check(
    excitation: &(impl Excitation + ?Sized),
    config: &Config,
    plant: &DiscretePlant,
) -> Result<Extremes, ExcitationError> {
    span(config)?;
    let extremes = Extremes::of(excitation, config, plant);
    let frequency_hz = excitation.frequency_at_hz(extremes.travel_tick);
    within(&extremes, config, frequency_hz, setting(config))?;
    Ok(extremes)
}

/// Refuses what would trip an interlock; `frequency_hz` is the one excited where the travel is largest, `setting` the one to
/// lower.
pub fn within(
    extremes: &Extremes,
    config: &Config,
    frequency_hz: Option<f64>,
    setting: &'static str,
) -> Result<(), ExcitationError> {
    current(config, extremes, setting)?;
    let limit_a_per_s = config.amplifier.slew_limit_a_per_s;
    if extremes.slew_a_per_s > limit_a_per_s {
        return Err(ExcitationError::Slew {
            slew_a_per_s: extremes.slew_a_per_s,
            limit_a_per_s,
            setting,
        });
    }
    let limit_a = config.motor.continuous_current_a();
    if extremes.thermal_a > limit_a {
        return Err(ExcitationError::Heat {
            thermal_a: extremes.thermal_a,
            limit_a,
            setting,
        });
    }
    if extremes.travel_m > config.interlock.soft_limit_m {
        let (travel_um, limit_um) = (extremes.travel_m * 1e6, config.interlock.soft_limit_m * 1e6);
        return Err(ExcitationError::Travel {
            travel_um,
            frequency_hz,
            limit_um,
            setting,
        });
    }
    Ok(())
}

fn current(
    config: &Config,
    extremes: &Extremes,
    setting: &'static str,
) -> Result<(), ExcitationError> {
    let limits = [
        (config.motor.peak_current_a(), "the motor's peak current"),
        (config.amplifier.current_limit_a, "the amplifier's limit"),
    ];
    let current_a = extremes.current_a;
    match limits.into_iter().find(|(limit_a, _)| current_a > *limit_a) {
        Some((limit_a, what)) => Err(ExcitationError::Current {
            current_a,
            limit_a,
            what,
            setting,
        }),
        None => Ok(()),
    }
}

fn span(config: &Config) -> Result<(), ExcitationError> {
    let (low_hz, high_hz) = config.chirp.band_hz();
    let (least_a, most_a) = Amplitude::new(&config.chirp.amplitude).range_a(low_hz, high_hz);
    let wide =
        config.excitation.kind == ExcitationKind::Multisine && most_a > LARGEST_SPAN * least_a;
    if wide {
        Err(ExcitationError::Span { least_a, most_a })
    } else {
        Ok(())
    }
}

/// The setting of the current.
fn setting(config: &Config) -> &'static str {
    match config.excitation.kind {
        ExcitationKind::Prbs => "prbs.amplitude_a",
        _ => "chirp.amplitude",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{AmplitudePoint, Source, load};
    use crate::excitation::of;

    fn checked(change: &dyn Fn(&mut Config)) -> Result<Extremes, ExcitationError> {
        let mut config = load(&Source::default()).unwrap();
        change(&mut config);
        let structure = crate::model::plant::build(&config.plant).unwrap();
        let modes = crate::model::plant::ModalModel::of(&structure)
            .unwrap()
            .modes;
        let (bandwidth_hz, force_constant) = (
            config.amplifier.bandwidth_hz,
            config.motor.force_constant_n_per_a,
        );
        let plant = DiscretePlant::new(
            &modes,
            bandwidth_hz,
            force_constant,
            config.servo.period_s(),
        );
        check(&of(&config), &config, &plant)
    }

    fn flat(config: &mut Config, current_a: f64) {
        config.chirp.amplitude = vec![AmplitudePoint {
            frequency_hz: 1.0,
            current_a,
        }];
    }

    #[test]
    fn what_the_interlocks_would_trip_is_refused_with_the_figures() {
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
    fn every_kind_is_refused_where_it_would_trip_and_told_what_to_lower() {
        let with = |kind: ExcitationKind, current_a: f64| {
            move |config: &mut Config| {
                (config.excitation.kind, config.prbs.amplitude_a) = (kind, current_a);
                (config.chirp.start_hz, config.chirp.quiet_after_s) = (20.0, 0.5);
                (
                    config.multisine.periods,
                    config.prbs.periods,
                    config.stepped_sine.count,
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
            // By the motor's peak current, or by the travel.
            for current_a in [12.0, 3.0] {
                let error = checked(&with(kind, current_a)).unwrap_err().to_string();
                assert!(error.contains(setting), "{kind:?}: {error}");
            }
        }
        // From +a to -a within a tick of 0.2 ms: 22,000 A/s at 2.2 A, of 20,000.
        let slow = |config: &mut Config| {
            with(ExcitationKind::Prbs, 2.2)(config);
            config.interlock.soft_limit_m = 1.0;
        };
        assert!(matches!(checked(&slow), Err(ExcitationError::Slew { .. })));
    }

    #[test]
    fn a_multisine_whose_lines_differ_too_much_is_refused() {
        let steep = |config: &mut Config| {
            config.excitation.kind = ExcitationKind::Multisine;
            let point = |frequency_hz, current_a| AmplitudePoint {
                frequency_hz,
                current_a,
            };
            config.chirp.amplitude = vec![point(1.0, 0.001), point(100.0, 0.06)];
        };
        assert!(matches!(checked(&steep), Err(ExcitationError::Span { .. })));
    }
}
