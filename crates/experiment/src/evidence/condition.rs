//! The conditions under which a certificate holds for the rig of today, as a table for the user.

use serde::Serialize;

use crate::certificate::CertificateError;

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// Time since the chirp.
    Age,
    /// Rate and computing delay of the loop.
    Loop,
    /// The table `[motor]` of the configuration.
    MotorSettings,
    /// The table `[amplifier]`.
    AmplifierSettings,
    /// The table `[probe]`.
    ProbeSettings,
    /// Identity of the amplifier.
    Amplifier,
    /// Identity of the probe.
    Probe,
    /// The calibration in use.
    Calibration,
    /// Static Y displacement of the load.
    OperatingPoint,
    /// m2/m3 - 1.
    MassAsymmetry,
    /// Signs of the residues.
    Signs,
    /// The measured band.
    Band,
    /// The modulus margin by the measured response.
    ModulusMargin,
    /// The model of the plant.
    Plant,
    /// The controller.
    Controller,
}

impl Subject {
    /// The name in a text.
    pub fn name(self) -> &'static str {
        match self {
            Subject::Age => "age",
            Subject::Loop => "loop",
            Subject::MotorSettings => "[motor]",
            Subject::AmplifierSettings => "[amplifier]",
            Subject::ProbeSettings => "[probe]",
            Subject::Amplifier => "amplifier",
            Subject::Probe => "probe",
            Subject::Calibration => "calibration",
            Subject::OperatingPoint => "operating point",
            Subject::MassAsymmetry => "mass asymmetry",
            Subject::Signs => "signs",
            Subject::Band => "band",
            Subject::ModulusMargin => "modulus margin",
            Subject::Plant => "model",
            Subject::Controller => "controller",
        }
    }
}

/// Whether a condition is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Agreement {
    /// It is met.
    Agrees,
    /// It is not met: the loop does not close on devices.
    Differs,
    /// It need not be met, or is not known yet: identities of devices that are not open.
    NotCompared,
}

impl Agreement {
    /// The name in a text.
    pub fn name(self) -> &'static str {
        match self {
            Agreement::Agrees => "agrees",
            Agreement::Differs => "DIFFERS",
            Agreement::NotCompared => "not compared",
        }
    }
}

/// A condition with both of its values. The names in JSON must not change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Condition {
    /// What is compared.
    pub subject: Subject,
    /// Its value in the certificate.
    pub certificate: String,
    /// Its value today, or its limit.
    pub today: String,
    /// Whether it is met.
    pub agreement: Agreement,
}

/// A condition, and its defect if it is not met.
#[derive(Clone, Debug)]
pub(super) struct Checked {
    pub condition: Condition,
    pub defect: Option<CertificateError>,
}

impl Checked {
    /// A condition that is met if there is no defect.
    pub fn new(
        subject: Subject,
        certificate: impl ToString,
        today: impl ToString,
        defect: Option<CertificateError>,
    ) -> Checked {
        let agreement = match &defect {
            Some(_) => Agreement::Differs,
            None => Agreement::Agrees,
        };
        Checked {
            condition: Condition {
                subject,
                certificate: certificate.to_string(),
                today: today.to_string(),
                agreement,
            },
            defect,
        }
    }

    /// A condition that need not be met, or is not known yet.
    pub fn not_compared(
        subject: Subject,
        certificate: impl ToString,
        today: impl ToString,
    ) -> Checked {
        let mut checked = Checked::new(subject, certificate, today, None);
        checked.condition.agreement = Agreement::NotCompared;
        checked
    }
}
