//! The order by evidence: modes are added one at a time, each where what is left is furthest above the noise, for as long as
//! the fall of chi^2 is beyond what noise could bring about.

use nalgebra::Complex;

use super::merged::merged;
use super::refine::{Entry, Parameters, Seen, covariance, refine};
use super::view::MeasurementChain;
use crate::identify::FrfDatum;
use crate::model::zeros::ModalTerm;

/// Modes at most.
const MOST: usize = 24;
/// Damping ratios that a new mode is tried with.
const DAMPINGS: [f64; 4] = [0.002, 0.006, 0.02, 0.06];
/// Places that a new mode is tried at: the worst of each of so many parts of the band.
const PLACES: usize = 48;
/// Of these, the worst so many.
const WORST: usize = 6;
/// Candidates that are fitted, the best first, before the search ends.
const TRIALS: usize = 3;
/// A body on no spring.
const FREE: ModalTerm = ModalTerm {
    omega_rad_s: 0.0,
    damping_ratio: 0.0,
    residue_per_kg: 0.0,
};
/// Delays that are tried with the first mode: so many a period of the highest frequency, over half a period of the mode.
const DELAYS_A_PERIOD: f64 = 6.0;
/// At most so many.
const MOST_DELAYS: f64 = 2000.0;
/// Where one mode for all below the frf_data begins: its frequency as a ratio of the lowest, and its damping ratio.
const BELOW: (f64, f64) = (0.3, 0.4);
/// A mode is seen whose residue is so many of its errors.
const SEEN: f64 = 5.0;

/// One look at the frf_data.
struct Look {
    /// The error as a ratio of H that is added to the noise.
    rough: f64,
    /// One block of how many is looked at. A mode of 0.2 % damping is eight frf_data of a twentieth of a percent wide.
    every: usize,
    /// A step that lowers chi^2 by less than this ratio of it is the last.
    coarse: f64,
}

/// From the first to the last.
const LOOKS: [Look; 3] = [
    Look {
        rough: 0.03,
        every: 4,
        coarse: 1e-2,
    },
    Look {
        rough: 0.003,
        every: 1,
        coarse: 1e-3,
    },
    Look {
        rough: 0.0,
        every: 1,
        coarse: 1e-7,
    },
];

/// The sum of one order.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelOrder {
    /// The modes and the rest.
    pub parameters: Parameters,
    /// chi^2 over its degrees of freedom, with the errors that this order was sought with.
    pub chi2_per_freedom: f64,
    /// By how much chi^2 fell with the last mode, over what could still be noise.
    pub evidence: f64,
}

/// How far chi^2 must fall for three more parameters, chosen as the best of `frf_data` places, to be more than noise: the
/// Bayesian criterion's 3 ln 2N, and again 2 ln N for the choice.
fn threshold(frf_data: usize) -> f64 {
    let n = frf_data as f64;
    3.0 * (2.0 * n).ln() + 2.0 * n.ln()
}

/// All orders that were found worth it, from one mode on.
///
/// An error of a ratio of H is added to the noise, first a large one, then less, then none: so the modes come in the order
/// of what they change, not of how well they were measured, and a rough model of all of them stands before the finest
/// differences count.
pub(super) fn orders(view: &MeasurementChain<'_>, frf_data: &[FrfDatum]) -> Vec<ModelOrder> {
    let (mut orders, mut now): (Vec<ModelOrder>, _) = (Vec::new(), Parameters::default());
    for look in LOOKS {
        let rough = roughened(frf_data, &look, &now);
        let mut seen;
        (now, seen) = refine(now, view, &rough, look.coarse);
        while now.modes.len() < MOST {
            let Some((next, there, evidence)) = one_more(&now, &seen, view, &rough, look.coarse)
            else {
                break;
            };
            let freedom = (2 * rough.len())
                .saturating_sub(next.entries().len())
                .max(1) as f64;
            let chi2_per_freedom = there.chi2 / freedom;
            orders.push(ModelOrder {
                parameters: next.clone(),
                chi2_per_freedom,
                evidence,
            });
            (now, seen) = (next, there);
        }
    }
    orders
}

/// The sum without the modes that it can do without: those below five of their errors, the least of them first, as long as
/// the others take their place without a rise of chi^2 that says otherwise.
pub(super) fn without_the_needless(
    sum: Parameters,
    view: &MeasurementChain<'_>,
    frf_data: &[FrfDatum],
) -> Parameters {
    let needed = threshold(frf_data.len());
    let (now, seen) = refine(sum, view, frf_data, 0.0);
    let (mut now, mut seen) = with_one_below(now, seen, view, frf_data);
    while now.modes.len() > 1 {
        let Some(place) = weakest(&now, &seen, frf_data) else {
            break;
        };
        let mut fewer = now.clone();
        fewer.modes.remove(place);
        let (next, there) = refine(fewer, view, frf_data, 0.0);
        let misfit = (seen.chi2 / (2 * frf_data.len()) as f64).max(1.0);
        if there.chi2 - seen.chi2 > needed * misfit {
            break;
        }
        (now, seen) = (next, there);
    }
    now
}

/// The sum with one mode in the place of all that lie below the frf_data, if it does as well: friction takes a free body for
/// several, none of which can be told from the others.
fn with_one_below(
    sum: Parameters,
    seen: Seen,
    view: &MeasurementChain<'_>,
    frf_data: &[FrfDatum],
) -> (Parameters, Seen) {
    let low_rad_s = 2.0 * std::f64::consts::PI * frf_data[0].frequency_hz;
    let (below, above): (Vec<ModalTerm>, Vec<ModalTerm>) = sum
        .modes
        .iter()
        .partition(|mode| mode.omega_rad_s < low_rad_s);
    if below.len() < 2 {
        return (sum, seen);
    }
    let residue_per_kg = below.iter().map(|mode| mode.residue_per_kg).sum();
    let one = ModalTerm {
        omega_rad_s: BELOW.0 * low_rad_s,
        damping_ratio: BELOW.1,
        residue_per_kg,
    };
    let start = Parameters {
        modes: [one].into_iter().chain(above).collect(),
        ..sum.clone()
    };
    let (next, there) = refine(start, view, frf_data, 0.0);
    let misfit = (seen.chi2 / (2 * frf_data.len()) as f64).max(1.0);
    let worse =
        (there.chi2 - seen.chi2) / ((below.len() - 1) as f64 * threshold(frf_data.len()) * misfit);
    if worse <= 1.0 {
        (next, there)
    } else {
        (sum, seen)
    }
}

/// The mode whose residue is the smallest part of its error, if it is below five; where the modes cannot even be told
/// apart, the smallest residue of all.
fn weakest(now: &Parameters, seen: &Seen, frf_data: &[FrfDatum]) -> Option<usize> {
    let size = |k: &usize| now.modes[*k].residue_per_kg.abs();
    let Some(covariance) = covariance(now, seen, frf_data) else {
        return (0..now.modes.len()).min_by(|a, b| size(a).total_cmp(&size(b)));
    };
    let entries = now.entries();
    let in_errors = |k: &usize| {
        let place = entries
            .iter()
            .position(|entry| *entry == Entry::Residue(*k));
        place.map_or(f64::INFINITY, |i| size(k) / covariance[(i, i)].sqrt())
    };
    let weakest = (0..now.modes.len()).min_by(|a, b| in_errors(a).total_cmp(&in_errors(b)))?;
    (in_errors(&weakest) < SEEN).then_some(weakest)
}

/// The frf_data of a look: merged where what is known already leaves the response smooth, once modes are known.
fn roughened(frf_data: &[FrfDatum], look: &Look, known: &Parameters) -> Vec<FrfDatum> {
    let more = look.rough * look.rough;
    let rough = |b: &FrfDatum| FrfDatum {
        variance: b.variance + more * b.response.norm_sqr(),
        ..*b
    };
    let fewer = if known.modes.is_empty() {
        frf_data.to_vec()
    } else {
        merged(frf_data, known)
    };
    fewer.iter().step_by(look.every).map(rough).collect()
}

/// The best sum with one mode more, if its evidence is beyond 1.
fn one_more(
    now: &Parameters,
    seen: &Seen,
    view: &MeasurementChain<'_>,
    frf_data: &[FrfDatum],
    coarse: f64,
) -> Option<(Parameters, Seen, f64)> {
    let needed = threshold(frf_data.len());
    let evidence = |there: &Seen| {
        let misfit = (there.chi2 / (2 * frf_data.len()) as f64).max(1.0);
        (seen.chi2 - there.chi2) / (needed * misfit)
    };
    let candidates = candidates(seen, view, frf_data, now);
    if now.modes.is_empty() {
        // All that follows stands on the first: the best of all, a free body among them.
        let all = candidates.into_iter().take(TRIALS).chain([FREE]);
        let starts = all.flat_map(|term| starts(term, seen, view, frf_data));
        let (next, there) = starts
            .map(|start| refine(start, view, frf_data, coarse))
            .min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2))?;
        let evidence = evidence(&there);
        return (evidence > 1.0).then_some((next, there, evidence));
    }
    candidates.into_iter().take(TRIALS).find_map(|term| {
        let mut start = now.clone();
        start.modes.push(term);
        let (next, there) = refine(start, view, frf_data, coarse);
        let evidence = evidence(&there);
        (evidence > 1.0).then_some((next, there, evidence))
    })
}

/// Where to begin with a first mode: at the delays with which it lowers chi^2 most, and the residue that does.
fn starts(
    term: ModalTerm,
    seen: &Seen,
    view: &MeasurementChain<'_>,
    frf_data: &[FrfDatum],
) -> Vec<Parameters> {
    let part = view.mode(
        (term.omega_rad_s, term.damping_ratio),
        &view.nodes(0.0, frf_data),
    );
    let step_s = frf_data
        .last()
        .map_or(0.0, |last| 1.0 / (DELAYS_A_PERIOD * last.frequency_hz));
    let half_period_s = std::f64::consts::PI
        / term
            .omega_rad_s
            .max(2.0 * std::f64::consts::PI * frf_data[0].frequency_hz);
    let reach = (half_period_s / step_s).min(MOST_DELAYS).ceil() as i32;
    let mut tried: Vec<(f64, Parameters)> = (-reach / 2..=reach)
        .map(|k| {
            let delay_s = f64::from(k) * step_s;
            let (gain, residue_per_kg) = projected(seen, frf_data, &part, delay_s);
            let modes = vec![ModalTerm {
                residue_per_kg,
                ..term
            }];
            (
                gain,
                Parameters {
                    modes,
                    delay_s,
                    ..Parameters::default()
                },
            )
        })
        .collect();
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    tried
        .into_iter()
        .take(TRIALS)
        .map(|(_, start)| start)
        .collect()
}

/// Modes that would lower chi^2, the best first, one for each place; a free body among them.
fn candidates(
    seen: &Seen,
    view: &MeasurementChain<'_>,
    frf_data: &[FrfDatum],
    now: &Parameters,
) -> Vec<ModalTerm> {
    let (mut found, nodes): (Vec<(f64, ModalTerm)>, _) =
        (Vec::new(), view.nodes(now.delay_s, frf_data));
    for place in worst(seen, frf_data, now.modes.is_empty()) {
        let omega_rad_s = 2.0 * std::f64::consts::PI * frf_data[place].frequency_hz;
        let tried = DAMPINGS.map(|damping_ratio| {
            let part = view.mode((omega_rad_s, damping_ratio), &nodes);
            let (gain, residue_per_kg) = projected(seen, frf_data, &part, 0.0);
            (
                gain,
                ModalTerm {
                    omega_rad_s,
                    damping_ratio,
                    residue_per_kg,
                },
            )
        });
        found.extend(tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)));
    }
    if now.modes.iter().all(|mode| mode.omega_rad_s > 0.0) {
        let part = view.mode((0.0, 0.0), &nodes);
        let (gain, residue_per_kg) = projected(seen, frf_data, &part, 0.0);
        found.push((
            gain,
            ModalTerm {
                residue_per_kg,
                ..FREE
            },
        ));
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, term)| term).collect()
}

/// The block furthest above the noise in each part of the band (the one of the greatest velocity, as long as there is no
/// model at all), the worst of them.
fn worst(seen: &Seen, frf_data: &[FrfDatum], first: bool) -> Vec<usize> {
    let excess = |b: &usize| match first {
        true => (frf_data[*b].response * frf_data[*b].frequency_hz).norm_sqr(),
        false => seen.left[*b].norm_sqr() / frf_data[*b].variance,
    };
    let size = frf_data.len().div_ceil(PLACES);
    let parts = (0..frf_data.len())
        .step_by(size)
        .map(|low| low..(low + size).min(frf_data.len()));
    let mut places: Vec<usize> = parts
        .filter_map(|part| part.max_by(|a, b| excess(a).total_cmp(&excess(b))))
        .collect();
    places.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
    places.truncate(WORST);
    places
}

/// By how much a part of the best real size, `delay_s` later, lowers chi^2, and that size.
fn projected(
    seen: &Seen,
    frf_data: &[FrfDatum],
    part: &[Complex<f64>],
    delay_s: f64,
) -> (f64, f64) {
    let (mut along, mut square) = (0.0, 0.0);
    for ((part, left), block) in part.iter().zip(&seen.left).zip(frf_data) {
        let late = part
            * Complex::from_polar(
                1.0,
                -2.0 * std::f64::consts::PI * block.frequency_hz * delay_s,
            );
        along += 2.0 / block.variance * (late.conj() * left).re;
        square += 2.0 / block.variance * late.norm_sqr();
    }
    (along * along / square, along / square)
}
