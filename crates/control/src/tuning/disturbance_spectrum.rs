//! A measured spectrum of the disturbance of the position.

/// One-sided density of the position without control in m^2 s/rad, constant over neighbouring bands.
#[derive(Clone, Debug, PartialEq)]
pub struct DisturbanceSpectrum {
    /// Lower end of the first band in rad/s, and the upper end of each.
    edges_rad_s: Vec<f64>,
    /// Density of each band.
    density_m2_s_per_rad: Vec<f64>,
}

impl DisturbanceSpectrum {
    /// Neighbouring bands from `start_rad_s` on, each with its width in rad/s and its density.
    pub fn new(start_rad_s: f64, bands: &[(f64, f64)]) -> DisturbanceSpectrum {
        let mut edges_rad_s = vec![start_rad_s];
        for (width_rad_s, _) in bands {
            let last = edges_rad_s.last().copied().unwrap_or(start_rad_s);
            edges_rad_s.push(last + width_rad_s);
        }
        DisturbanceSpectrum {
            edges_rad_s,
            density_m2_s_per_rad: bands.iter().map(|(_, density)| *density).collect(),
        }
    }

    /// The variance in m^2 between two frequencies in rad/s. The density below the first band is that of the first band, since nothing
    /// is known there; above the last band it is 0.
    pub fn variance_m2(&self, from_rad_s: f64, to_rad_s: f64) -> f64 {
        let first = self.density_m2_s_per_rad.first().copied().unwrap_or(0.0);
        let start = self.edges_rad_s[0];
        let below = (to_rad_s.min(start) - from_rad_s.min(start)) * first;
        let bands = self.edges_rad_s.windows(2).zip(&self.density_m2_s_per_rad);
        let within = bands.map(|(edges, density)| {
            let (low, high) = (edges[0].max(from_rad_s), edges[1].min(to_rad_s));
            (high - low).max(0.0) * density
        });
        below + within.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variance_is_the_integral_of_the_bands() {
        let spectrum = DisturbanceSpectrum::new(2.0, &[(1.0, 5.0), (3.0, 1.0)]);
        // 2 rad/s below the first band, 1 in it, half of the second one.
        assert!((spectrum.variance_m2(0.0, 4.5) - (10.0 + 5.0 + 1.5)).abs() < 1e-12);
        assert!((spectrum.variance_m2(2.5, 3.0) - 2.5).abs() < 1e-12);
        assert_eq!(spectrum.variance_m2(6.0, 9.0), 0.0);
    }
}
