//! A move to a height in the shortest time that speed, acceleration and jerk allow.
//!
//! ```text
//!  jerk  +j  0  -j   0   -j  0  +j        seven parts, from rest to rest, symmetric about the middle of the move
//!
//!  v j >= a^2:  tj = a/j,        ta = tj + v/a          acceleration a is reached
//!  otherwise:   tj = sqrt(v/j),  ta = 2 tj              it is not
//!  tv = d/v - ta                                        at constant speed; if negative, the speed is not reached:
//!    d >= 2 a^3/j^2:  tj = a/j,           ta = tj/2 + sqrt(tj^2/4 + d/a),  tv = 0
//!    otherwise:       tj = cbrt(d/(2 j)), ta = 2 tj,                       tv = 0
//! ```
//!
//! tj is the time of a part with jerk, ta that of the acceleration, d the distance. The move lasts 2 ta + tv. Source: L. Biagiotti,
//! C. Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 3.4.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError, check_amplitude, um};
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// From 0 to a height with bounded speed, acceleration and jerk, then constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SCurveReference {
    /// Height in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Largest speed in metres per second.
    #[schemars(range(min = 1e-12, max = 100.0))]
    pub speed_m_per_s: f64,
    /// Largest acceleration in metres per second squared.
    #[schemars(range(min = 1e-12, max = 10000.0))]
    pub acceleration_m_per_s2: f64,
    /// Largest jerk in metres per second cubed.
    #[schemars(range(min = 1e-12, max = 10000000.0))]
    pub jerk_m_per_s3: f64,
    /// Start in seconds after the loop closed.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub at_s: f64,
}

impl ReferenceDesign for SCurveReference {
    fn describe(&self) -> String {
        let move_s = Profile::of(self).duration_s();
        format!(
            "s-curve to {} in {move_s:.4} s from {} s",
            um(self.amplitude_m),
            self.at_s
        )
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(SCurve {
            amplitude_m: self.amplitude_m,
            profile: Profile::of(self),
            at_tick: context.ticks(self.at_s),
            period_s: context.period_s,
        }))
    }

    fn check(&self, soft_limit_m: f64, _rate_hz: f64) -> Vec<Finding> {
        check_amplitude(self.amplitude_m, soft_limit_m)
    }

    fn last_change_s(&self) -> f64 {
        self.at_s + Profile::of(self).duration_s()
    }
}

/// The times of a move in the positive direction.
#[derive(Clone, Copy, Debug)]
struct Profile {
    distance_m: f64,
    jerk_m_per_s3: f64,
    /// Time of a part with jerk.
    jerk_s: f64,
    /// Time of the acceleration, which is that of the deceleration.
    acceleration_s: f64,
    /// Time at constant speed.
    cruise_s: f64,
}

impl Profile {
    fn of(settings: &SCurveReference) -> Profile {
        let distance_m = settings.amplitude_m.abs();
        let (jerk_s, acceleration_s) = to_speed_s(settings);
        let cruise_s = distance_m / settings.speed_m_per_s - acceleration_s;
        let (jerk_s, acceleration_s) = if cruise_s >= 0.0 {
            (jerk_s, acceleration_s)
        } else {
            to_half_way_s(distance_m, settings)
        };
        Profile {
            distance_m,
            jerk_m_per_s3: settings.jerk_m_per_s3,
            jerk_s,
            acceleration_s,
            cruise_s: cruise_s.max(0.0),
        }
    }

    fn duration_s(&self) -> f64 {
        2.0 * self.acceleration_s + self.cruise_s
    }

    /// Distance at a time since the start.
    fn at_m(&self, time_s: f64) -> f64 {
        let left_s = self.duration_s() - time_s;
        if left_s <= 0.0 {
            self.distance_m
        } else if time_s < left_s {
            self.first_half_m(time_s)
        } else {
            self.distance_m - self.first_half_m(left_s)
        }
    }

    /// Distance at a time in the first half of the move.
    fn first_half_m(&self, time_s: f64) -> f64 {
        let (jerk, jerk_s, ends_s) = (self.jerk_m_per_s3, self.jerk_s, self.acceleration_s);
        let speed_m_per_s = jerk * jerk_s * (ends_s - jerk_s);
        let left_s = ends_s - time_s;
        if time_s < jerk_s {
            jerk * time_s * time_s * time_s / 6.0
        } else if left_s > jerk_s {
            jerk * jerk_s * (3.0 * time_s * (time_s - jerk_s) + jerk_s * jerk_s) / 6.0
        } else if left_s > 0.0 {
            speed_m_per_s * (0.5 * ends_s - left_s) + jerk * left_s * left_s * left_s / 6.0
        } else {
            speed_m_per_s * (0.5 * ends_s - left_s)
        }
    }
}

/// Times of jerk and of acceleration up to the largest speed.
fn to_speed_s(settings: &SCurveReference) -> (f64, f64) {
    let (speed, jerk) = (settings.speed_m_per_s, settings.jerk_m_per_s3);
    let acceleration = settings.acceleration_m_per_s2;
    if speed * jerk >= acceleration * acceleration {
        let jerk_s = acceleration / jerk;
        (jerk_s, jerk_s + speed / acceleration)
    } else {
        let jerk_s = libm::sqrt(speed / jerk);
        (jerk_s, 2.0 * jerk_s)
    }
}

/// Times of jerk and of acceleration up to the middle of a move that does not reach the largest speed.
fn to_half_way_s(distance_m: f64, settings: &SCurveReference) -> (f64, f64) {
    let (acceleration, jerk) = (settings.acceleration_m_per_s2, settings.jerk_m_per_s3);
    let jerk_s = acceleration / jerk;
    if distance_m >= 2.0 * acceleration * jerk_s * jerk_s {
        let half_s = 0.5 * jerk_s;
        (
            jerk_s,
            half_s + libm::sqrt(half_s * half_s + distance_m / acceleration),
        )
    } else {
        let jerk_s = libm::cbrt(0.5 * distance_m / jerk);
        (jerk_s, 2.0 * jerk_s)
    }
}

struct SCurve {
    amplitude_m: f64,
    profile: Profile,
    at_tick: u64,
    period_s: f64,
}

impl Reference for SCurve {
    fn at_m(&self, tick: u64) -> f64 {
        let ticks = tick.saturating_sub(self.at_tick);
        let distance_m = self.profile.at_m(ticks as f64 * self.period_s);
        distance_m.copysign(self.amplitude_m)
    }
}
