//! Why a loop is not closed with a certificate.

use std::fmt;

/// A certificate that is missing, or with which a loop is not closed on devices. Each text is `what is wrong; remedy`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CertificateError {
    /// None is given, and the loop would close on devices.
    #[error(
        "on devices a loop closes only with the certificate of a chirp (control.certificate); run `bench chirp` with this configuration and name its file with --certificate"
    )]
    Missing,
    /// The file, or that of its frequency response, cannot be read.
    #[error(
        "certificate {file}: cannot read {what}: {why}; check the path, and keep the certificate beside the files of its chirp"
    )]
    Unreadable {
        /// The certificate.
        file: String,
        /// What cannot be read.
        what: String,
        /// The reason.
        why: String,
    },
    /// The text is not a certificate.
    #[error("certificate {file}: {why}; {REPEAT}")]
    Damaged {
        /// The certificate.
        file: String,
        /// What is wrong.
        why: String,
    },
    /// The frequency response is not the one of the certificate.
    #[error(
        "certificate {file}: the frequency response {frf} was changed after the chirp (its SHA-256 differs); restore the file, or {REPEAT}"
    )]
    ChangedResponse {
        /// The certificate.
        file: String,
        /// The frequency response.
        frf: String,
    },
    /// It is too old.
    #[error(
        "the certificate is stale: its chirp was made {age_days:.1} days ago, and it is valid for {valid_days} days (control.certificate_valid_days); {REPEAT}"
    )]
    Stale {
        /// Time since the chirp in days.
        age_days: f64,
        /// How long it is valid.
        valid_days: f64,
    },
    /// Its date is later than the clock of this computer.
    #[error(
        "the certificate is dated {made}, which is in the future; set the clock of this computer, or {REPEAT}"
    )]
    Future {
        /// Its date.
        made: String,
    },
    /// It belongs to another rate of the loop.
    #[error(
        "the certificate was made at {certified_hz} Hz with a computing delay of {certified_periods} periods, but the loop runs at {rate_hz} Hz with {periods}; set loop.rate_hz and loop.computing_delay_periods as in the certificate, or {REPEAT}"
    )]
    OtherRate {
        /// Rate of the certificate in hertz.
        certified_hz: f64,
        /// Its computing delay in periods.
        certified_periods: u32,
        /// Rate of the loop in hertz.
        rate_hz: f64,
        /// Computing delay of the loop in periods.
        periods: u32,
    },
    /// A table of the settings of the devices differs.
    #[error(
        "the settings in [{table}] differ from those of the certificate; restore them, or {REPEAT}"
    )]
    OtherSettings {
        /// Name of the table.
        table: &'static str,
    },
    /// Another device is connected.
    #[error(
        "the certificate was made with the {kind} {certified:?}, but {connected:?} is connected; connect that device, or {REPEAT}"
    )]
    OtherDevice {
        /// `amplifier` or `probe`.
        kind: &'static str,
        /// Its identity in the certificate.
        certified: String,
        /// The identity of the connected device.
        connected: String,
    },
    /// Another calibration is in use.
    #[error(
        "the calibration in use is not the one of the certificate; set calibration.file as in the chirp, or {REPEAT}"
    )]
    OtherCalibration,
    /// The stage is loaded differently.
    #[error(
        "the certificate was made at {quantity} = {certified}, but it is {configured} now; load the stage as in the chirp and set {quantity} to {certified}, or {REPEAT} with this load"
    )]
    OtherLoad {
        /// The setting.
        quantity: &'static str,
        /// Its value in the certificate.
        certified: String,
        /// Its configured value.
        configured: String,
    },
    /// The signs of the residues differ from those of the model.
    #[error(
        "the measured residues have the signs {measured}, but those of the model are {model}, so the margins of the model do not apply; correct the model (plant.mass_asymmetry, plant.operating_point_m) and choose a controller for these signs"
    )]
    Signs {
        /// The measured signs.
        measured: String,
        /// The signs of the model.
        model: String,
    },
    /// The measured band does not contain the crossings of the loop.
    #[error(
        "the certificate has no response between {from_hz:.3} Hz and {to_hz:.3} Hz, and the loop needs one from {needed_from_hz:.3} Hz to {needed_to_hz:.3} Hz, around its crossings; repeat `bench chirp` with --start below {needed_from_hz:.3} Hz and --stop above {needed_to_hz:.3} Hz"
    )]
    Band {
        /// Lower end of the missing part in hertz.
        from_hz: f64,
        /// Its upper end.
        to_hz: f64,
        /// Lower end of the needed band in hertz.
        needed_from_hz: f64,
        /// Its upper end.
        needed_to_hz: f64,
    },
    /// The lower 95 % bound of the measured modulus margin is below the limit.
    #[error(
        "the modulus margin by the measured response is at least {margin:.3} with 95 % confidence (at {at_hz:.2} Hz), below the limit of {least} (control.min_modulus_margin); choose another controller (--controller FILE), or repeat `bench chirp` with a larger amplitude if the measurement is noisy"
    )]
    LowMargin {
        /// The lower bound.
        margin: f64,
        /// Its frequency in hertz.
        at_hz: f64,
        /// The limit.
        least: f64,
    },
    /// The measured curve passes -1 so closely that noise may hide an instability.
    #[error(
        "the measured response of the loop passes -1 at {sigmas:.1} standard deviations, so that its stability is not decided; repeat `bench chirp` with a larger amplitude, or choose another controller (--controller FILE)"
    )]
    Undecided {
        /// The distance in standard deviations.
        sigmas: f64,
    },
    /// The loop is unstable by the measured response.
    #[error(
        "by the measured response the loop encircles -1 in another way than by the model, so it is unstable; correct the model, or choose another controller (--controller FILE)"
    )]
    Unstable,
}

/// Everything for which a loop is not closed with a certificate; at least one defect.
#[derive(Clone, Debug, PartialEq)]
pub struct CertificateDefects(Vec<CertificateError>);

impl std::error::Error for CertificateDefects {}

impl CertificateDefects {
    /// These defects; `None` if there are none.
    pub(crate) fn of(defects: Vec<CertificateError>) -> Option<CertificateDefects> {
        (!defects.is_empty()).then_some(CertificateDefects(defects))
    }

    /// The defects.
    pub fn as_slice(&self) -> &[CertificateError] {
        &self.0
    }
}

/// One defect with its remedy, or the numbered list of all.
impl fmt::Display for CertificateDefects {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const OVERRIDE: &str = "or add --override \"REASON\"; nothing was moved";
        if let [defect] = self.as_slice() {
            return write!(f, "refused: {defect}, {OVERRIDE}");
        }
        let count = self.0.len();
        write!(
            f,
            "refused: the certificate has {count} defects; correct each of them, {OVERRIDE}"
        )?;
        let mut numbered = (1..).zip(&self.0);
        numbered.try_for_each(|(number, defect)| write!(f, "\n  {number}. {defect}"))
    }
}

const REPEAT: &str = "repeat `bench chirp`";
