//! What a user should know about an imported controller.

use super::super::transfer::{Cascade, Domain};
use super::form::{Form, get};
use super::names;
use super::select::Selected;
use crate::unstable::MAX_INTEGRATORS;

/// A stable pole nearer than this to z = 1 is a time constant of more than a million periods.
const BESIDE_INTEGRATOR: f64 = 1e-6;

/// Fields that changed the numbers, and poles on the boundary of stability or beside it.
pub(super) fn of(selected: &Selected<'_>, cascade: &Cascade) -> Vec<String> {
    let remarks = [
        time_unit(selected),
        delay(selected),
        descriptor(selected),
        sections(selected),
        double_integrator(cascade),
        slow_pole(cascade),
    ];
    remarks.into_iter().flatten().collect()
}

fn time_unit(selected: &Selected<'_>) -> Option<String> {
    let unit_s = selected.properties.time_unit_s;
    (unit_s != 1.0).then(|| format!("converted from a unit of time of {unit_s} s to seconds"))
}

fn delay(selected: &Selected<'_>) -> Option<String> {
    let delays = &selected.properties.delays;
    let names: Vec<&str> = delays.iter().map(|delay| delay.name.as_str()).collect();
    let samples: f64 = delays.iter().map(|delay| delay.value).sum();
    (!names.is_empty()).then(|| {
        format!(
            "the delay of {samples} samples ({}) is contained as poles at z = 0",
            names.join(", ")
        )
    })
}

fn descriptor(selected: &Selected<'_>) -> Option<String> {
    let e = get(selected.fields, names::E).filter(|(_, value)| !value.is_empty());
    let is_used = selected.form == Form::Matrices && e.is_some();
    is_used.then(|| "E x' = A x + B e is solved for x'".into())
}

fn sections(selected: &Selected<'_>) -> Option<String> {
    let is_list = selected.form == Form::Sections;
    is_list.then(|| "the zeros and poles are those of the rows of sos".into())
}

fn double_integrator(cascade: &Cascade) -> Option<String> {
    let place = cascade.domain.integrator();
    let poles = cascade.factors.poles.real.iter();
    let count = poles.filter(|pole| **pole == place).count();
    (count == MAX_INTEGRATORS).then(|| {
        "two integrators: a stable loop follows a ramp without error; `bench margins` decides whether it is stable".into()
    })
}

fn slow_pole(cascade: &Cascade) -> Option<String> {
    let is_discrete = matches!(cascade.domain, Domain::Discrete { .. });
    let mut poles = cascade.factors.poles.real.iter();
    let pole = poles.find(|pole| **pole < 1.0 && **pole > 1.0 - BESIDE_INTEGRATOR);
    pole.filter(|_| is_discrete).map(|pole| {
        format!(
            "the pole at z = 1 - {:.1e} is not an integrator; if one was designed, rounding of the saved numbers moved it: save zeros, poles and gain (zpk)",
            1.0 - pole
        )
    })
}
