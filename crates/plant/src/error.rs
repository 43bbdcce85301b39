/// The reason why a model cannot be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlantError {
    /// The mass matrix is not positive definite.
    #[error(
        "the mass matrix is not positive definite: at least one coordinate has no mass; give every moving stage a mass above zero"
    )]
    SingularMass,
    /// An eigenvalue iteration did not converge.
    #[error(
        "the eigenvalues of {what} did not converge; scale the model's masses and stiffnesses to similar magnitudes"
    )]
    NoConvergence {
        /// The eigenvalue problem.
        what: &'static str,
    },
    /// A rigid-body or buckling mode that the settings do not declare.
    #[error(
        "the eigenvalue of mode {number}, {eigenvalue_rad2_s2:.3e} rad^2/s^2, is negative or, compared with that of \
         the fastest mode, zero within rounding errors: no spring supports the stage in that direction, \
         or a mass is too small or a spring too stiff for double precision; \
         add a spring, raise the mass, or lower the stiffness"
    )]
    Unsupported {
        /// Number of the mode, from 1.
        number: usize,
        /// Its eigenvalue.
        eigenvalue_rad2_s2: f64,
    },
    /// The actuator's force does not reach the probe.
    #[error(
        "the residues of all modes are zero: \
         the actuator does not excite the probe; connect the two by springs, or move one of them"
    )]
    NoResponse,
    /// Mass-proportional damping holds a free body to ground.
    #[error(
        "mass-proportional damping of {mass_per_s} 1/s would connect a free body to ground; \
         use damping of kind \"uniform\", or \"rayleigh\" with mass_per_s = 0"
    )]
    DampedFreeBody {
        /// The coefficient of the mass matrix.
        mass_per_s: f64,
    },
    /// A model whose equations exist in linear form only.
    #[error("the model `{model}` has a linear geometry only; set sim.geometry = \"linear\"")]
    NotQuadratic {
        /// The model.
        model: &'static str,
    },
    /// A free body has no static compliance.
    #[error(
        "{0} is not defined for a free body (a body without a spring to ground); connect each body to ground by a spring"
    )]
    FreeBody(
        /// The quantity.
        &'static str,
    ),
}
