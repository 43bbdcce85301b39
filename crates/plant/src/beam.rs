//! The parallelogram flexure: two equal beams side by side.

/// The beams of a mechanism, all equal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// L.
    pub length_m: f64,
    /// H, out of plane.
    pub height_m: f64,
    /// T, in plane.
    pub thickness_m: f64,
    /// E.
    pub youngs_modulus_pa: f64,
    /// nu.
    pub poisson_ratio: f64,
}

impl Beam {
    /// Transverse stiffness of a parallelogram of two beams: 24 E I/(L^3 (1 - nu^2)), I = H T^3/12.
    pub fn parallelogram_n_per_m(&self) -> f64 {
        let second_moment_m4 = self.height_m * cube(self.thickness_m) / 12.0;
        let nu = self.poisson_ratio;
        let plate_modulus_pa = self.youngs_modulus_pa / (1.0 - nu * nu);
        24.0 * plate_modulus_pa * second_moment_m4 / cube(self.length_m)
    }

    /// c = 0.6/L of Eq. (2-1), a_S - a_P = -c s (t_S - t_P)^2.
    pub fn shortening_per_m(&self) -> f64 {
        0.6 / self.length_m
    }
}

fn cube(x: f64) -> f64 {
    x * x * x
}
