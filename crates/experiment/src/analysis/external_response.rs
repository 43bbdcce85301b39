//! A response that another program has computed, of any stage and in any unit.

use std::path::Path;

use super::conventions::check_static_conventions;
use super::measured_frf::FrfError;
use bench_external::frf::{self as external_frf, OutputStated, PhaseUnit, ResponseUnit};
use bench_identify::Frf;
use bench_identify::scatter::SigmaSource;

/// A response whose conventions were checked.
#[derive(Clone, Debug)]
pub struct ExternalResponse {
    /// The response.
    pub frf: Frf,
    /// Its unit, if the file states it.
    pub unit: Option<ResponseUnit>,
    /// Where its standard deviations come from.
    pub sigma: SigmaSource,
    /// Whether the file has a coherence.
    pub has_coherence: bool,
    /// What the file does not state and was assumed.
    pub assumptions: Vec<String>,
    /// The sign of the static response is negative.
    pub negative: Option<NegativeResponse>,
}

/// A response that is negative at its lowest frequencies, where the stage moves in the direction of the force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NegativeResponse {
    /// Lowest frequency in hertz.
    pub frequency_hz: f64,
    /// Phase there in degrees.
    pub phase_deg: f64,
}

impl NegativeResponse {
    /// What it means, for a reader.
    pub fn description(&self) -> String {
        format!(
            "the response is negative at its lowest frequency of {:.4} Hz (phase {:.1} deg): sensor or drive inverted? All residues then have the other sign; zeros and verdict depend on the relative signs only",
            self.frequency_hz, self.phase_deg
        )
    }
}

impl ExternalResponse {
    /// Reads the table of a response; `phase` is the unit of its phases, whatever the file states. That of a velocity or an acceleration
    /// is refused unless the kind of the output is stated.
    ///
    /// # Errors
    /// When the file is no table of a response, or its phases are conjugated or in another unit.
    pub fn read(
        path: &Path,
        phase: Option<PhaseUnit>,
        output: OutputStated,
    ) -> Result<ExternalResponse, FrfError> {
        let imported = external_frf::read_any_unit(path, phase, output)?;
        Ok(ExternalResponse {
            negative: negative(&imported.frf)?,
            frf: imported.frf,
            unit: imported.unit,
            sigma: imported.sigma,
            has_coherence: imported.has_coherence,
            assumptions: imported.assumptions,
        })
    }

    /// The unit of the response; `output/input` if it is not known.
    pub fn unit(&self) -> ResponseUnit {
        self.unit.clone().unwrap_or_else(|| ResponseUnit {
            output: "output".into(),
            input: "input".into(),
        })
    }
}

/// The conventions of a response. The sign of a static response is a finding: a sensor may count in either direction.
fn negative(frf: &Frf) -> Result<Option<NegativeResponse>, FrfError> {
    match check_static_conventions(frf, 1.0) {
        Ok(()) => Ok(None),
        Err(FrfError::Sign {
            frequency_hz,
            phase_deg,
        }) => Ok(Some(NegativeResponse {
            frequency_hz,
            phase_deg,
        })),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_base::units::rad_s;
    use bench_identify::FrfPoint;
    use nalgebra::Complex;

    /// Modes of 30 and 80 Hz, changed by a convention.
    fn frf(change: fn(Complex<f64>) -> Complex<f64>) -> Frf {
        let mode = |hz: f64, at_hz: f64, residue: f64| {
            let (s, w) = (Complex::new(0.0, rad_s(hz)), rad_s(at_hz));
            (s * s + s * (0.02 * w) + w * w).inv() * residue
        };
        let mut frf = Frf::default();
        for k in 1..=800 {
            let frequency_hz = 0.25 * f64::from(k);
            let response = mode(frequency_hz, 30.0, 1.0) + mode(frequency_hz, 80.0, 0.8);
            frf.push(FrfPoint {
                frequency_hz,
                response: change(response),
                coherence: 1.0,
                variance: 1e-8 * change(response).norm_sqr(),
                resolution_hz: 0.25,
            });
        }
        frf
    }

    #[test]
    fn negative_static_response_is_a_finding() {
        assert_eq!(negative(&frf(|h| h)).expect("positive"), None);
        let found = negative(&frf(|h| -h)).expect("read").expect("negative");
        assert_eq!(found.frequency_hz, 0.25);
        assert!((found.phase_deg.abs() - 180.0).abs() < 1.0, "{found:?}");
        assert!(found.description().contains("0.2500 Hz"));
    }

    #[test]
    fn conjugated_response_of_either_sign_is_refused() {
        let changes: [fn(Complex<f64>) -> Complex<f64>; 2] = [|h| h.conj(), |h| -h.conj()];
        for change in changes {
            let found = negative(&frf(change));
            assert!(matches!(found, Err(FrfError::Conjugated)), "{found:?}");
        }
    }

    #[test]
    fn radians_that_were_read_as_degrees_are_refused() {
        let found = negative(&frf(|h| {
            Complex::from_polar(h.norm(), h.arg().to_radians())
        }));
        assert!(matches!(found, Err(FrfError::Radians { .. })), "{found:?}");
    }
}
