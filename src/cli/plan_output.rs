//! The plan of a run as text.

use super::control_output::command_text;
use super::table::labelled;
use bench_excitation::{AmplitudePoint, Extremes};
use bench_experiment::{ControlForecast, ExcitationPlan, MotorSummary, PlanLimits};

/// Extremes with their limits, and the amplitude over frequency.
pub(super) fn text(plan: &ExcitationPlan) -> String {
    let amplitude: String = plan.amplitude.iter().map(amplitude_line).collect();
    let slew = format!(
        "  slew         {:.0} A/s of {:.0} A/s\n",
        plan.expected.slew_a_per_s, plan.limits.slew_a_per_s
    );
    let motor = plan.motor.as_ref().map_or(String::new(), motor_text);
    let extremes = extremes_text(&plan.expected, &plan.limits);
    let excitation = &plan.excitation;
    let probe = probe_text(plan.probe.as_deref());
    format!("{excitation}; no motion\n{extremes}{slew}{probe}{motor}{amplitude}")
}

/// The plan of a closed loop. Without extremes the loop of the model is unstable.
pub(super) fn control_text(plan: &ControlForecast) -> String {
    let command = plan.command.as_ref().map_or(String::new(), command_text);
    let extremes = match &plan.expected {
        Some(expected) => extremes_text(expected, &plan.limits),
        None => labelled(
            "expected",
            "no prediction: the loop of the model is unstable",
        ),
    };
    let motor = plan.motor.as_ref().map_or(String::new(), motor_text);
    let (reference, probe) = (&plan.reference, probe_text(plan.probe.as_deref()));
    format!("{reference}{command}; no motion\n{extremes}{motor}{probe}")
}

/// The scale of the probe.
fn probe_text(scale: Option<&str>) -> String {
    scale.map_or(String::new(), |scale| labelled("probe", scale))
}

fn extremes_text(expected: &Extremes, limits: &PlanLimits) -> String {
    format!(
        "  duration     {:.1} s\n  travel       {:.1} um of {:.0} um\n  current      {:.3} A of {:.2} A, {:.3} A RMS\n  thermal      {:.3} A of {:.2} A\n",
        expected.duration_s,
        expected.travel_m * 1e6,
        limits.travel_m * 1e6,
        expected.current_a,
        limits.current_a,
        expected.rms_current_a,
        expected.thermal_current_a,
        limits.thermal_current_a,
    )
}

/// The heat of earlier runs, the thermal current that it leads to, and from when on the run is allowed.
fn motor_text(motor: &MotorSummary) -> String {
    let start = match (&motor.start_after, motor.wait_s) {
        (_, Some(0.0)) => "the run may start now".to_string(),
        (Some(start_after), Some(wait_s)) => {
            format!("the run may start after {start_after}, in {wait_s:.0} s")
        }
        (None, Some(wait_s)) => {
            format!("the run is refused unless it waits {wait_s:.0} s (--wait-for-motor)")
        }
        (_, None) => "the run is refused also with a cold motor".to_string(),
    };
    let text = format!(
        "{}; the run would reach {:.3} A of {:.2} A; {start}",
        motor.known_from, motor.thermal_peak_a, motor.thermal_limit_a
    );
    labelled("motor", &text)
}

fn amplitude_line(point: &AmplitudePoint) -> String {
    format!(
        "  amplitude    {:10.4} Hz {:9.5} A\n",
        point.frequency_hz, point.current_a
    )
}
