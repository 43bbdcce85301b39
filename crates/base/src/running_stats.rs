//! Mean and standard deviation in one pass.

/// Mean and standard deviation in one pass (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
pub struct RunningStats {
    /// Number of values.
    pub count: f64,
    /// Their mean.
    pub mean: f64,
    squares: f64,
}

impl RunningStats {
    /// Adds a value.
    pub fn push(&mut self, x: f64) {
        self.count += 1.0;
        let deviation = x - self.mean;
        self.mean += deviation / self.count;
        self.squares += deviation * (x - self.mean);
    }

    /// Standard deviation; `None` with fewer than two values.
    pub fn sigma(&self) -> Option<f64> {
        (self.count > 1.0).then(|| (self.squares / (self.count - 1.0)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pass_gives_mean_and_sigma_of_two_passes() {
        let values: Vec<f64> = (0..10_000)
            .map(|k| 5e-5 + 1e-8 * f64::sin(f64::from(k) * 1.7))
            .collect();
        let mut stats = RunningStats::default();
        values.iter().for_each(|x| stats.push(*x));
        let mean = values.iter().sum::<f64>() / 1e4;
        let sigma = (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 9999.0).sqrt();
        // 10,000 roundings of 1e-20 in the mean of 5e-5.
        assert!((stats.mean - mean).abs() < 1e-16);
        assert!((stats.sigma().unwrap() / sigma - 1.0).abs() < 1e-9);
        assert_eq!(RunningStats::default().sigma(), None);
    }
}
