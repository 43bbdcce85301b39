//! The parallelogram flexure: two equal beams side by side.

use crate::config::{Sr4dofSettings, XySettings};

/// The beams of a mechanism, all alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Beam {
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
    /// Bending stiffness of a parallelogram of two beams, transverse: 24 E I/(L^3 (1 - nu^2)), I = H T^3/12.
    pub fn parallelogram_n_per_m(&self) -> f64 {
        let cube = |x: f64| x * x * x;
        let second_moment_m4 = self.height_m * cube(self.thickness_m) / 12.0;
        let plate_modulus_pa =
            self.youngs_modulus_pa / (1.0 - self.poisson_ratio * self.poisson_ratio);
        24.0 * plate_modulus_pa * second_moment_m4 / cube(self.length_m)
    }

    /// c of a_S - a_P = -c s (t_S - t_P)^2, Eq. (2-1): 0.6/L.
    pub fn shortening_per_m(&self) -> f64 {
        0.6 / self.length_m
    }
}

impl From<&Sr4dofSettings> for Beam {
    fn from(s: &Sr4dofSettings) -> Beam {
        Beam {
            length_m: s.beam_length_m,
            height_m: s.beam_height_m,
            thickness_m: s.beam_thickness_m,
            youngs_modulus_pa: s.youngs_modulus_pa,
            poisson_ratio: s.poisson_ratio,
        }
    }
}

impl From<&XySettings> for Beam {
    fn from(s: &XySettings) -> Beam {
        Beam {
            length_m: s.beam_length_m,
            height_m: s.beam_height_m,
            thickness_m: s.beam_thickness_m,
            youngs_modulus_pa: s.youngs_modulus_pa,
            poisson_ratio: s.poisson_ratio,
        }
    }
}
