//! The plan of an excitation as text.

use crate::excitation::AmplitudePoint;
use crate::experiment::ExcitationPlan;

/// Extremes with their limits, and the amplitude over frequency.
pub(super) fn text(plan: &ExcitationPlan) -> String {
    let (expected, limits) = (&plan.expected, &plan.limits);
    let amplitude: String = plan.amplitude.iter().map(amplitude_line).collect();
    format!(
        "{}; no motion\n  duration     {:.1} s\n  travel       {:.1} um of {:.0} um\n  current      {:.3} A of {:.2} A, {:.3} A RMS\n  thermal      {:.3} A of {:.2} A\n  slew         {:.0} A/s of {:.0} A/s\n{amplitude}",
        plan.excitation,
        expected.duration_s,
        expected.travel_m * 1e6,
        limits.travel_m * 1e6,
        expected.current_a,
        limits.current_a,
        expected.rms_current_a,
        expected.thermal_current_a,
        limits.thermal_current_a,
        expected.slew_a_per_s,
        limits.slew_a_per_s,
    )
}

fn amplitude_line(point: &AmplitudePoint) -> String {
    format!(
        "  amplitude    {:10.4} Hz {:9.5} A\n",
        point.frequency_hz, point.current_a
    )
}
