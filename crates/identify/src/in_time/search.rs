//! The search for the number of modes of an output that is rounded, or of which readings are lost.

use core::f64::consts::TAU;

use super::order::Order;
use super::refine::{Likeliest, TimeRecord, drift_at};
use super::simulated::Simulation;
use super::{ReadingsFit, TimeFit};
use crate::modal::{ModalFit, ModalParameters, ModelOrder, OneMoreMode};
use crate::record_check::Reading;
use bench_plant::SignalPath;

/// Readings that do not change after the last change and this time tell nothing more.
const REST_S: f64 = 0.2;
/// Modes are looked for from this ratio of the first frequency on, or from the beginning of the band.
const BELOW_FIRST: f64 = 0.1;

/// The search for the modes of readings.
pub(crate) struct TimeSearch<'a> {
    /// The record up to its rest.
    record: TimeRecord<'a>,
    /// The simulation of the record with its rest.
    whole: Simulation<'a>,
    /// The order of least cost.
    best: Option<Order>,
    /// The order of more modes that was compared with it.
    next: Option<Order>,
    /// The best of each number of modes, rising.
    tried: Vec<ModelOrder>,
}

impl<'a> TimeSearch<'a> {
    /// The search in readings of the output to a held input, one for each of its samples, with their step if that exceeds their noise.
    pub(crate) fn new(
        input: &'a [f64],
        readings: &'a [Reading],
        step: Option<f64>,
        path: &'a SignalPath,
    ) -> Self {
        let whole = Simulation { path, input };
        let end = end_of_changes(readings, REST_S / path.period_s);
        let until_rest = Simulation {
            input: &input[..end],
            ..whole
        };
        TimeSearch {
            record: TimeRecord::new(until_rest, &readings[..end], step),
            whole,
            best: None,
            next: None,
            tried: Vec::new(),
        }
    }

    /// Tries the modes of the orders of a response of the record, rising, up to the first that has a larger cost than one of fewer modes.
    pub(crate) fn try_modes(&mut self, orders: Vec<ModalParameters>) {
        let least = match &self.best {
            Some(best) if self.adds_modes() => best.number_of_modes(),
            _ => 1,
        };
        let starts = starts(orders).into_iter();
        for start in starts.filter(|start| start.modes.len() >= least) {
            let Some(order) = Order::of(&self.record, start) else {
                continue;
            };
            self.tell(&order);
            match &self.best {
                Some(best) if order.cost >= best.cost => {
                    let is_larger = order.number_of_modes() > best.number_of_modes();
                    if is_larger && self.record.is_near(best.found.sigma) {
                        self.next = Some(order);
                        return;
                    }
                }
                _ => {
                    self.best = Some(order);
                    self.next = None;
                }
            }
        }
    }

    /// Whether the modes of the next response are added to those before. Those of a rounded output that are far from its readings may be too
    /// many.
    pub(crate) fn adds_modes(&self) -> bool {
        let is_near = |best: &Order| self.record.is_near(best.found.sigma);
        self.best.as_ref().is_some_and(is_near)
    }

    /// Keeps an order for the stability chart, in place of those with as many modes or more.
    fn tell(&mut self, order: &Order) {
        let count = order.number_of_modes();
        self.tried
            .retain(|tried| tried.parameters.modes.len() < count);
        self.tried.push(ModelOrder {
            parameters: order.found.parameters.clone(),
            chi2_per_freedom: order.found.chi2(),
            evidence: f64::INFINITY,
        });
    }

    /// The modes so far, and the expected output before rounding, whose response shows more of the modes than that of the readings does.
    /// `None` if all tried models are far from the readings.
    pub(crate) fn unrounded(&self) -> Option<(Vec<f64>, &ModalParameters)> {
        let best = self.best.as_ref()?;
        let is_near = self.record.may_come_near(best.found.sigma);
        is_near.then(|| (self.whole_output(&best.found), &best.found.parameters))
    }

    /// The expected output of a model before rounding, with the rest that the search leaves out.
    fn whole_output(&self, found: &Likeliest) -> Vec<f64> {
        let mut output = found.unrounded();
        let count = output.len();
        let model = self.whole.output(&found.parameters);
        let rest = model.iter().enumerate().skip(count);
        output.extend(rest.map(|(k, y)| y + drift_at(found.drift, k, count)));
        output
    }

    /// The modes, if they describe the readings, and the order of one more mode has a larger cost.
    pub(crate) fn result(&self, band_hz: (f64, f64)) -> Option<TimeFit> {
        let best = self.best.as_ref()?;
        if !self.record.is_described_by(&best.found) {
            return None;
        }
        let (Order { cost, found }, larger) = best.pruned(&self.record);
        let next = larger.as_ref().or(self.next.as_ref())?;
        let first_rad_s = found.parameters.modes.first()?.omega_rad_s;
        // Lost readings may hide a mode below the first one as well.
        let from_rad_s = if self.record.is_whole() {
            first_rad_s
        } else {
            first_rad_s.min((TAU * band_hz.0).max(BELOW_FIRST * first_rad_s))
        };
        let seen_rad_s = self
            .record
            .seen_up_to_rad_s(&found, (from_rad_s, TAU * band_hz.1));
        let seen_up_to_hz = seen_rad_s? / TAU;
        Some(TimeFit {
            output: self.whole_output(&found),
            noise: ReadingsFit {
                step: self.record.step,
                sigma: found.sigma,
                seen_up_to_hz,
            },
            fit: ModalFit {
                one_more_mode: Some(one_more_mode(&found, &next.found, next.cost - cost)),
                chi2_per_freedom: found.chi2(),
                freedom: self.record.count().saturating_sub(found.covariance.nrows()),
                parameters: found.parameters,
                covariance: found.covariance,
                orders: self.tried.clone(),
                band_hz,
                left_out_hz: Vec::new(),
            },
        })
    }
}

/// The number of samples up to some samples after the last change.
fn end_of_changes(readings: &[Reading], more: f64) -> usize {
    let is_change = |k: &usize| readings[k - 1] != readings[*k];
    let last = (1..readings.len()).rev().find(is_change).unwrap_or(0);
    readings.len().min(last + 1 + more as usize)
}

/// The parameters with which the orders begin, one for each number of modes. Rounding shows a free body where there is none.
fn starts(orders: Vec<ModalParameters>) -> Vec<ModalParameters> {
    let mut starts: Vec<ModalParameters> = Vec::new();
    for mut start in orders {
        start.modes.retain(|mode| mode.omega_rad_s > 0.0);
        let is_more = |last: &ModalParameters| start.modes.len() > last.modes.len();
        if !start.modes.is_empty() && starts.last().is_none_or(is_more) {
            starts.push(start);
        }
    }
    starts
}

/// The mode of the next order that is farthest from all modes of the best one, with its probability by the difference of the costs.
fn one_more_mode(best: &Likeliest, next: &Likeliest, difference: f64) -> OneMoreMode {
    let distance = |w: f64| {
        let modes = best.parameters.modes.iter();
        let ratios = modes.map(|mode| (w / mode.omega_rad_s).ln().abs());
        ratios.fold(f64::INFINITY, f64::min)
    };
    let frequencies = next.parameters.modes.iter().map(|mode| mode.omega_rad_s);
    let farthest = frequencies.max_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    let decrease = 2.0 * (next.log_probability - best.log_probability);
    OneMoreMode {
        parameters: next.parameters.clone(),
        near_rad_s: farthest.unwrap_or_default(),
        probability: 1.0 / (1.0 + (0.5 * difference).exp()),
        significant_decrease: difference + decrease,
    }
}
