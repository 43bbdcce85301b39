//! Controllers as TOML: a list of sections in amperes per micrometre, a transfer function, or a control law of another kind.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Section;
use super::error::ControllerError;
use super::law::ControlDesign;
use super::laws::LawSettings;
use super::section_settings::{SectionSettings, checked_sections};
use super::transfer::{
    Cascade, Domain, SsFile, TfFile, TransferError, TransferSettings, TransferTable, ZpkFile,
};
use bench_settings::EmbeddedFile;

/// All embedded controllers. To add one, add its file and its name here.
pub const CONTROLLERS: &[EmbeddedFile] = bench_settings::embedded_files!("controllers/": "fast", "slow", "lab", "xy", "three-mass", "four-mass", "stage-disturbance", "lab-disturbance");

/// A controller file with a cascade of sections.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench controller")]
pub struct ControllerFile {
    /// Title of the controller.
    pub title: String,
    /// The cascade, first to last. At least one section contains the gain in amperes per micrometre.
    #[schemars(length(min = 1, max = 32))]
    pub section: Vec<SectionSettings>,
}

/// A controller file with a control law of another kind.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LawFile {
    /// Title of the controller.
    #[serde(rename = "title")]
    _title: String,
    /// The law.
    law: LawSettings,
}

/// The form of a controller file.
#[derive(Clone, Copy)]
enum Form {
    /// `[[section]]`
    Sections,
    /// `[law]`
    Law,
    /// A transfer function.
    Transfer(TransferTable),
}

/// A controller as text, as it is stored in a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerText {
    /// `fast`, `slow` or the path of a file.
    pub name: String,
    /// TOML.
    pub text: String,
}

impl ControllerText {
    /// Finds `fast`, `slow` or a file.
    pub fn find(name: &str) -> Result<Self, ControllerError> {
        Ok(ControllerText {
            name: name.into(),
            text: bench_settings::text_of(name, CONTROLLERS, "controller")?,
        })
    }

    /// The control law, checked for a servo rate.
    pub fn design(&self, rate_hz: f64) -> Result<Box<dyn ControlDesign>, ControllerError> {
        match self.form() {
            Form::Sections => Ok(Box::new(self.listed_sections(rate_hz)?)),
            Form::Law => self.law(rate_hz),
            Form::Transfer(table) => {
                let design = self.cascade(table)?.design(rate_hz);
                design.map_err(|why| self.transfer_error(table, why))
            }
        }
    }

    /// The continuous sections of a controller that is a cascade of them, checked for a servo rate.
    pub fn sections(&self, rate_hz: f64) -> Result<Vec<Section>, ControllerError> {
        match self.form() {
            Form::Sections => self.listed_sections(rate_hz),
            Form::Law => Err(ControllerError::NotSections),
            Form::Transfer(table) => match self.cascade(table)? {
                cascade if cascade.domain == Domain::Continuous => Ok(cascade.sections),
                _ => Err(ControllerError::NotSections),
            },
        }
    }

    fn form(&self) -> Form {
        let table: toml::Table = self.text.parse().unwrap_or_default();
        let has = |key: &str| table.contains_key(key);
        let mut tables = TransferTable::ALL.into_iter();
        match tables.find(|table| has(table.key())) {
            _ if has("law") => Form::Law,
            Some(table) => Form::Transfer(table),
            None => Form::Sections,
        }
    }

    fn law(&self, rate_hz: f64) -> Result<Box<dyn ControlDesign>, ControllerError> {
        let file: LawFile = bench_settings::typed(&self.name, &self.text)?;
        let checked = file.law.check(rate_hz);
        checked.map_err(|why| ControllerError::Law {
            name: self.name.clone(),
            why,
        })?;
        Ok(Box::new(file.law))
    }

    fn listed_sections(&self, rate_hz: f64) -> Result<Vec<Section>, ControllerError> {
        let file: ControllerFile = bench_settings::typed(&self.name, &self.text)?;
        checked_sections(&file.section, rate_hz).map_err(|why| ControllerError::Sections {
            name: self.name.clone(),
            why,
        })
    }

    fn cascade(&self, table: TransferTable) -> Result<Cascade, ControllerError> {
        let (name, text) = (&self.name, &self.text);
        let settings = match table {
            TransferTable::Tf => {
                TransferSettings::Tf(bench_settings::typed::<TfFile>(name, text)?.tf)
            }
            TransferTable::Zpk => {
                TransferSettings::Zpk(bench_settings::typed::<ZpkFile>(name, text)?.zpk)
            }
            TransferTable::Ss => {
                TransferSettings::Ss(bench_settings::typed::<SsFile>(name, text)?.ss)
            }
        };
        Cascade::of(&settings).map_err(|why| self.transfer_error(table, why))
    }

    fn transfer_error(&self, table: TransferTable, why: TransferError) -> ControllerError {
        ControllerError::Transfer {
            name: self.name.clone(),
            table: table.key(),
            why,
        }
    }
}
