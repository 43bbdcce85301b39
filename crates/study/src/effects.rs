//! The settings that decide whether there are CNMP pairs: shares of the variance of this binary outcome.
//!
//! With Y = 1 for a draw with pairs and 0 for one without, Var Y = p (1 - p). The share of a setting X (Sobol's first-order
//! index) and that of the interaction of two settings beyond their own (second-order) are
//!
//! ```text
//!  S_i = Var E[Y|X_i]/Var Y      S_ij = Var E[Y|X_i, X_j]/Var Y - S_i - S_j
//! ```
//!
//! As all settings are independent, the shares of all orders add up to 1. They are estimated from the draws of the study
//! (Plischke, Borgonovo and Smith, Eur. J. Oper. Res. 226, 536, 2013): X is cut into C classes of equal probability,
//! and with n_c draws and k_c of them with pairs in class c, of N and K in all,
//!
//! ```text
//!  between = sum of k_c^2/n_c - K^2/N     total = K (N - K)/N     noise = (total - between)/(N - C)
//!  S = (between - (C - 1) noise)/total
//! ```
//!
//! The term in `noise` removes the difference of C means of few draws by chance (Kelley's epsilon squared, Proc. Natl. Acad. Sci.
//! 21, 554, 1935): without an effect S is 0 on average, with a standard deviation of sqrt(2 (C - 1))/N. Within a
//! class the effect is averaged, so that S is a lower bound. A linear effect loses 1/C^2 of its share. A step within
//! a class loses up to 1/C of the variance; so does a border between draws with and without pairs that crosses C of
//! the C x C classes of an interaction.

/// Classes of one setting: a multiple of two and of three.
const CLASSES: usize = 18;
/// Number of classes of each setting of an interaction: even, and as large as this number of draws per class allows.
const PAIR_CLASSES: std::ops::RangeInclusive<usize> = 4..=32;
const DRAWS_IN_PAIR_CLASS: f64 = 50.0;
/// With fewer draws than this in a class there is no estimate.
const MIN_IN_CLASS: u64 = 10;

/// Draws of a class, and those of them with pairs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    pub all: u64,
    pub yes: u64,
}

impl Cell {
    fn add(&mut self, yes: bool) {
        self.all += 1;
        self.yes += u64::from(yes);
    }

    pub fn sum<'a>(cells: impl IntoIterator<Item = &'a Cell>) -> Cell {
        cells.into_iter().fold(Cell::default(), |sum, cell| Cell {
            all: sum.all + cell.all,
            yes: sum.yes + cell.yes,
        })
    }

    pub fn probability(&self) -> f64 {
        if self.all == 0 {
            f64::NAN
        } else {
            self.yes as f64 / self.all as f64
        }
    }

    /// Standard deviation of the probability in this class.
    pub fn sigma(&self) -> f64 {
        let p = self.probability();
        (p * (1.0 - p) / self.all as f64).sqrt()
    }
}

/// A share of the variance, and its standard deviation if there were no effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Share {
    pub value: f64,
    pub noise: f64,
}

/// The draws by classes of each setting and of each interaction.
#[derive(Clone, Debug)]
pub(super) struct Effects {
    settings: usize,
    pair_classes: usize,
    single: Vec<[Cell; CLASSES]>,
    interactions: Vec<Vec<Cell>>,
}

impl Effects {
    /// An empty table for this number of settings and of draws.
    pub fn new(settings: usize, draws: u64) -> Effects {
        let classes = 2 * ((draws as f64 / DRAWS_IN_PAIR_CLASS).sqrt() / 2.0) as usize;
        let pair_classes = classes.clamp(*PAIR_CLASSES.start(), *PAIR_CLASSES.end());
        Effects {
            settings,
            single: vec![[Cell::default(); CLASSES]; settings],
            pair_classes,
            interactions: setting_pairs(settings)
                .map(|_| vec![Cell::default(); pair_classes * pair_classes])
                .collect(),
        }
    }

    /// Adds a draw, by the ranks of its settings.
    pub fn add(&mut self, ranks: &[f64], yes: bool) {
        for (cells, &rank) in self.single.iter_mut().zip(ranks) {
            cells[class(rank, CLASSES)].add(yes);
        }
        let classes: Vec<usize> = ranks
            .iter()
            .map(|&rank| class(rank, self.pair_classes))
            .collect();
        for (cells, (i, j)) in self
            .interactions
            .iter_mut()
            .zip(setting_pairs(self.settings))
        {
            cells[classes[i] * self.pair_classes + classes[j]].add(yes);
        }
    }

    /// The share that a setting explains alone; `None` with too few draws, or where all draws are equal.
    pub fn single(&self, index: usize) -> Option<Share> {
        let cells = &self.single[index];
        let spread = Spread::of(cells)?;
        let freedom = (CLASSES - 1) as f64;
        Some(spread.share(spread.between, freedom))
    }

    /// The draws in the lower, the middle and the upper third of a setting.
    pub fn thirds(&self, index: usize) -> [Cell; 3] {
        let third = CLASSES / 3;
        [0, 1, 2].map(|part| Cell::sum(&self.single[index][part * third..(part + 1) * third]))
    }

    /// The share that each interaction explains beyond its two settings alone.
    pub fn interactions(&self) -> impl Iterator<Item = ([usize; 2], Option<Share>)> + '_ {
        setting_pairs(self.settings)
            .zip(&self.interactions)
            .map(|((i, j), cells)| ([i, j], interaction(cells, self.pair_classes)))
    }

    /// The draws in which both settings of an interaction lie in the same half, and in which they lie in different ones.
    pub fn halves(&self, [i, j]: [usize; 2]) -> [Cell; 2] {
        let place = setting_pairs(self.settings).position(|pair| pair == (i, j));
        let cells = place.map_or(&[][..], |place| &self.interactions[place]);
        let (classes, half) = (self.pair_classes, self.pair_classes / 2);
        let same = |place: usize| (place / classes < half) == (place % classes < half);
        [true, false].map(|wanted| {
            Cell::sum(
                cells
                    .iter()
                    .enumerate()
                    .filter(|(place, _)| same(*place) == wanted)
                    .map(|(_, cell)| cell),
            )
        })
    }
}

fn class(rank: f64, classes: usize) -> usize {
    ((rank * classes as f64) as usize).min(classes - 1)
}

fn setting_pairs(settings: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..settings).flat_map(move |i| (i + 1..settings).map(move |j| (i, j)))
}

fn interaction(cells: &[Cell], n: usize) -> Option<Share> {
    let spread = Spread::of(cells)?;
    let rows: Vec<Cell> = cells.chunks(n).map(Cell::sum).collect();
    let columns: Vec<Cell> = (0..n)
        .map(|j| Cell::sum(cells.iter().skip(j).step_by(n)))
        .collect();
    let beyond = spread.between - Spread::of(&rows)?.between - Spread::of(&columns)?.between;
    Some(spread.share(beyond, ((n - 1) * (n - 1)) as f64))
}

/// Analysis of variance of a binary outcome: sums of squares over classes.
struct Spread {
    draws: f64,
    total: f64,
    between: f64,
    noise: f64,
}

impl Spread {
    fn of(cells: &[Cell]) -> Option<Spread> {
        let sum = Cell::sum(cells);
        if sum.all < MIN_IN_CLASS * cells.len() as u64 || sum.yes == 0 || sum.yes == sum.all {
            return None;
        }
        let (draws, yes) = (sum.all as f64, sum.yes as f64);
        let occupied = cells.iter().filter(|cell| cell.all > 0);
        let squares: f64 = occupied
            .clone()
            .map(|cell| cell.yes as f64 * cell.probability())
            .sum();
        let (total, between) = (yes * (draws - yes) / draws, squares - yes * yes / draws);
        Some(Spread {
            draws,
            total,
            between,
            noise: (total - between) / (draws - occupied.count() as f64),
        })
    }

    fn share(&self, squares: f64, freedom: f64) -> Share {
        Share {
            value: (squares - freedom * self.noise) / self.total,
            noise: (2.0 * freedom).sqrt() / self.draws,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    const N: usize = 40_000;

    fn effects(seed: u64, settings: usize, yes: impl Fn(&[f64]) -> bool) -> Effects {
        let mut bits = Pcg64::seed_from_u64(seed);
        let mut effects = Effects::new(settings, N as u64);
        for _ in 0..N {
            let ranks: Vec<f64> = (0..settings)
                .map(|_| (bits.next_u64() >> 11) as f64 / (1u64 << 53) as f64)
                .collect();
            effects.add(&ranks, yes(&ranks));
        }
        effects
    }

    /// Shares of three settings and of the interactions 01, 02, 12, over some seeds, each within `tolerance`.
    fn are(yes: impl Fn(&[f64]) -> bool, singles: [f64; 3], beyond: [f64; 3], tolerance: f64) {
        for seed in 1..=5 {
            let effects = effects(seed, 3, &yes);
            let found = (0..3)
                .map(|i| effects.single(i))
                .chain(effects.interactions().map(|(_, share)| share));
            for (share, expected) in found.zip(singles.into_iter().chain(beyond)) {
                let share = share.unwrap();
                let allowed = tolerance + 5.0 * share.noise;
                assert!(
                    (share.value - expected).abs() < allowed,
                    "{share:?} for {expected}, seed {seed}"
                );
            }
        }
    }

    #[test]
    fn shares_match_closed_forms() {
        // The sigma of a share S of N draws is some 2 sqrt(S)/sqrt(N) (S is a squared correlation): 0.01 and below. With 40,000
        // draws there are 28 classes: a border through the interaction's cells takes 1/28 of the variance.
        //
        // x > 1/2 decides alone.
        are(|x| x[0] > 0.5, [1.0, 0.0, 0.0], [0.0; 3], 0.005);
        // Pairs if both settings have the same sign: each setting alone explains nothing, both together everything.
        are(
            |x| (x[0] > 0.5) == (x[1] > 0.5),
            [0.0; 3],
            [1.0, 0.0, 0.0],
            0.005,
        );
        // x + y > 1: E[Y|x] = x has the variance 1/12, of a total of 1/4; the rest is the interaction.
        are(
            |x| x[0] + x[1] > 1.0,
            [1.0 / 3.0, 1.0 / 3.0, 0.0],
            [1.0 / 3.0, 0.0, 0.0],
            0.04,
        );
        // x > 5/6 and y > 1/2: 5/6 is a class border with 18 classes, but not with 28.
        let (a, b) = (1.0 / 6.0, 0.5);
        let singles = share_of_and(a, b);
        are(
            |x| x[0] > 1.0 - a && x[1] > b,
            singles,
            [1.0 - singles[0] - singles[1], 0.0, 0.0],
            0.04,
        );
    }

    /// Shares of x > 1 - a and y > 1 - b where both are needed: p = a b.
    fn share_of_and(a: f64, b: f64) -> [f64; 3] {
        let p = a * b;
        [
            (a * b * b - p * p) / (p - p * p),
            (b * a * a - p * p) / (p - p * p),
            0.0,
        ]
    }

    #[test]
    fn shares_without_an_effect_are_zero_within_their_noise() {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for seed in 1..=20 {
            // The outcome depends on the last number only, which is not among the evaluated ones.
            let effects = effects(seed, 5, |x| x[4] > 0.7);
            let found = (0..4).map(|i| effects.single(i)).chain(
                effects
                    .interactions()
                    .filter(|(c, _)| c[1] < 4)
                    .map(|(_, s)| s),
            );
            for share in found.map(Option::unwrap) {
                let unit = share.value / share.noise;
                (sum, squares, count) = (sum + unit, squares + unit * unit, count + 1.0);
            }
        }
        // 200 numbers of mean 0 and variance 1: 5/sqrt(200), and 5 sqrt(2 + excess)/sqrt(200) with an excess below 1.
        assert!((sum / count).abs() < 0.36, "{}", sum / count);
        assert!((squares / count - 1.0).abs() < 0.62, "{}", squares / count);
    }

    #[test]
    fn thirds_and_halves_show_the_direction() {
        let effects = effects(1, 2, |x| x[0] < 1.0 / 3.0 && x[1] < 0.5);
        let [low, middle, high] = effects.thirds(0).map(|cell| cell.probability());
        assert!((low - 0.5).abs() < 0.03 && middle == 0.0 && high == 0.0);
        let [same, opposite] = effects.halves([0, 1]).map(|cell| cell.probability());
        // The draws with pairs have x in the lower third and y in the lower half: 1/6 of all draws, and 1/3 of those
        // in which both settings lie in the same half.
        assert!(
            (same - 1.0 / 3.0).abs() < 0.03 && opposite == 0.0,
            "{same} {opposite}"
        );
    }

    #[test]
    fn too_few_or_equal_draws_give_no_estimate() {
        let mut few = Effects::new(2, 159);
        (0..159).for_each(|k| few.add(&[0.5, 0.5], k % 2 == 0));
        assert_eq!(few.single(0), None);
        assert!(few.interactions().all(|(_, share)| share.is_none()));
        assert_eq!(effects(1, 1, |_| true).single(0), None);
    }
}
