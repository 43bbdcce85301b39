//! A number of modes with its likeliest parameters and its cost.

use super::refine::{Likeliest, TimeRecord};
use crate::modal::{ModalParameters, sigmas_of_residues};

/// Three parameters of a mode, and a factor of 3 because the square of a certainty is only about the gain of -2 ln P.
const MAY_BE_NONE: f64 = 9.0;

/// A number of modes with its likeliest parameters.
#[derive(Clone)]
pub(super) struct Order {
    /// -2 ln P + parameters ln N.
    pub(super) cost: f64,
    pub(super) found: Likeliest,
}

impl Order {
    /// The likeliest parameters near `start`; `None` if the readings do not determine them.
    pub(super) fn of(record: &TimeRecord<'_>, start: ModalParameters) -> Option<Order> {
        let found = record.likeliest(start)?;
        let parameters = found.covariance.nrows() as f64;
        let samples = record.count() as f64;
        Some(Order {
            cost: parameters * samples.ln() - 2.0 * found.log_probability,
            found,
        })
    }

    /// The parameters without the mode of the least certain residue, if the cost may be less then: by about the parameters of a mode times
    /// ln N, less the square of the residue over its standard deviation.
    fn with_one_less(&self, record: &TimeRecord<'_>) -> Option<ModalParameters> {
        let Likeliest {
            parameters,
            covariance,
            ..
        } = &self.found;
        let certainties = sigmas_of_residues(parameters, covariance);
        let modes = certainties.iter().enumerate();
        let (mode, certainty) = modes.min_by(|a, b| a.1.total_cmp(b.1))?;
        let largest = MAY_BE_NONE * (record.count() as f64).ln();
        let may_be_none = certainties.len() > 1 && certainty * certainty < largest;
        may_be_none.then(|| parameters.without_mode(mode))
    }

    /// The order without its least certain modes, as long as the cost decreases: a fit to the response may begin with modes that rounding
    /// shows. With the order of one more mode, if there were any.
    pub(super) fn pruned(&self, record: &TimeRecord<'_>) -> (Order, Option<Order>) {
        let (mut least, mut larger) = (self.clone(), None);
        while let Some(fewer) = least.with_one_less(record) {
            match Order::of(record, fewer) {
                Some(order) if order.cost < least.cost => {
                    larger = Some(std::mem::replace(&mut least, order));
                }
                _ => break,
            }
        }
        (least, larger)
    }

    pub(super) fn number_of_modes(&self) -> usize {
        self.found.parameters.modes.len()
    }
}
