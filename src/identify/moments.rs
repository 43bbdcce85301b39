//! Mean and standard deviation in one pass and little memory.

/// Mean and standard deviation in one pass (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
pub struct RunningStats {
    /// Values so far.
    pub count: f64,
    /// Their mean.
    pub mean: f64,
    squares: f64,
}

impl RunningStats {
    /// Takes a value in.
    pub fn push(&mut self, x: f64) {
        self.count += 1.0;
        let from_old = x - self.mean;
        self.mean += from_old / self.count;
        self.squares += from_old * (x - self.mean);
    }

    /// Standard deviation, of two values at least.
    pub fn sigma(&self) -> Option<f64> {
        (self.count > 1.0).then(|| (self.squares / (self.count - 1.0)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_sigma_in_one_pass_are_those_of_two_passes() {
        let values: Vec<f64> = (0..10_000)
            .map(|k| 5e-5 + 1e-8 * f64::sin(f64::from(k) * 1.7))
            .collect();
        let mut moments = RunningStats::default();
        values.iter().for_each(|x| moments.push(*x));
        let mean = values.iter().sum::<f64>() / 1e4;
        let sigma = (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 9999.0).sqrt();
        // 10,000 roundings of 1e-20 in the mean of 5e-5.
        assert!(
            (moments.mean - mean).abs() < 1e-16
                && (moments.sigma().unwrap() / sigma - 1.0).abs() < 1e-9
        );
        assert_eq!(RunningStats::default().sigma(), None);
    }
}
