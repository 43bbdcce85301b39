//! The signs of the residues that are certain.
//!
//! Of modes closer than their widths only the sum of the residues is determined: neighbours whose signs are all uncertain are one
//! group, with the sum of their residues and the variance of that sum.

use super::input::VerdictInput;
use crate::Estimate;
use crate::modal::{ModalFit, Parameter};

/// The residues of the verdict's modes, lowest frequency first, whose signs are certain; groups as one.
pub(super) fn signs_of(input: &VerdictInput<'_>) -> Vec<f64> {
    let fit = input.fit;
    let modes = fit.modes();
    let covered = |k: &usize| input.covers(modes[*k].omega_rad_s.value);
    let mut groups: Vec<(bool, Vec<usize>)> = Vec::new();
    for k in (0..modes.len()).filter(covered) {
        let certain = input.has_certain_sign(&modes[k]);
        match groups.last_mut() {
            Some((false, group)) if !certain => group.push(k),
            _ => groups.push((certain, vec![k])),
        }
    }
    let sums = groups.iter().map(|(_, group)| sum_of(fit, group));
    sums.filter(|sum| {
        input
            .certainty
            .allows(magnitude(sum).below_zero_probability())
    })
    .map(|sum| sum.value)
    .collect()
}

fn magnitude(residue: &Estimate) -> Estimate {
    Estimate {
        value: residue.value.abs(),
        ..*residue
    }
}

/// The sum of the residues of some modes.
fn sum_of(fit: &ModalFit, modes: &[usize]) -> Estimate {
    let free = fit.parameters.free();
    let index = |k: &usize| {
        free.iter()
            .position(|parameter| *parameter == Parameter::Residue(*k))
    };
    let indices: Vec<usize> = modes.iter().filter_map(index).collect();
    let entries = indices
        .iter()
        .flat_map(|i| indices.iter().map(|j| fit.covariance[(*i, *j)]));
    let residues = modes
        .iter()
        .map(|k| fit.parameters.modes[*k].residue_per_kg);
    Estimate {
        value: residues.sum(),
        sigma: entries.sum::<f64>().max(0.0).sqrt(),
    }
}
