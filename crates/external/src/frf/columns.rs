//! What the columns of a table are, by their names.

use schemars::JsonSchema;
use serde::Serialize;

use super::error::FrfTableError;
use super::table::FrfTable;
use super::unit::{ResponseUnit, UnitRule};

/// Unit of phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum PhaseUnit {
    /// Degrees.
    Deg,
    /// Radians.
    Rad,
}

/// What a column contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Frequency,
    Magnitude,
    Phase,
    Real,
    Imaginary,
    Coherence,
    MagnitudeSigma,
    Resolution,
}

/// Scale of a magnitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scale {
    /// In its unit.
    Linear,
    /// 20 log10 of it.
    Decibels,
}

/// Names of two columns that are the response.
#[derive(Clone, Debug)]
pub(super) enum Pair {
    Polar {
        magnitude: String,
        scale: Scale,
        phase: String,
        phase_unit: Option<PhaseUnit>,
    },
    Cartesian {
        real: String,
        imaginary: String,
    },
    /// Not named.
    Unknown([String; 2]),
}

/// The columns of a response.
#[derive(Clone, Debug)]
pub(super) struct Columns {
    pub frequency: String,
    /// Hertz per unit of the column; `None` if it is not stated.
    pub hz_per_unit: Option<f64>,
    pub pair: Pair,
    pub coherence: Option<String>,
    pub magnitude_sigma: Option<String>,
    pub resolution: Option<String>,
    /// The unit that the columns of the response state.
    pub unit: Option<ResponseUnit>,
}

/// The words of a name and its unit, in lower case.
struct Words(Vec<String>);

impl Words {
    fn of(name: &str, unit: &str) -> Words {
        let text = format!("{name} {unit}")
            .to_lowercase()
            .replace('°', " deg ")
            .replace('%', " percent ");
        let words = text.split(|c: char| !c.is_alphanumeric());
        let words = words.filter(|word| !word.is_empty());
        Words(words.map(String::from).collect())
    }

    fn has(&self, any: &[&str]) -> bool {
        self.0.iter().any(|word| any.contains(&word.as_str()))
    }

    fn is_only(&self, any: &[&str]) -> bool {
        !self.0.is_empty() && self.0.iter().all(|word| any.contains(&word.as_str()))
    }

    fn role(&self) -> Option<Role> {
        let is_phase = self.has(&["phase", "phi", "φ", "angle", "arg"]);
        if self.has(&["sigma", "std", "stddev", "uncertainty", "σ"]) {
            return (!is_phase && !self.has(&["deg", "rad"])).then_some(Role::MagnitudeSigma);
        }
        // Words of one letter, and those that stand in other names as well, decide only where no other does.
        const ROLES: [(Role, &[&str]); 12] = [
            (Role::Coherence, &["coherence", "coh", "gamma2", "γ2"]),
            (Role::Resolution, &["resolution"]),
            (Role::Phase, &["phase", "phi", "φ", "arg"]),
            (Role::Real, &["real"]),
            (Role::Imaginary, &["imag", "imaginary"]),
            (
                Role::Magnitude,
                &[
                    "magnitude",
                    "mag",
                    "amplitude",
                    "ampl",
                    "amp",
                    "gain",
                    "abs",
                    "compliance",
                    "db",
                ],
            ),
            (
                Role::Frequency,
                &["frequency", "frequencies", "freq", "omega", "ω"],
            ),
            (Role::Phase, &["angle"]),
            (Role::Frequency, &["f", "w"]),
            (Role::Real, &["re"]),
            (Role::Imaginary, &["im"]),
            (Role::Magnitude, &["g", "h"]),
        ];
        let named = ROLES.iter().find(|(_, words)| self.has(words));
        if let Some((role, _)) = named {
            Some(*role)
        } else if self.is_only(&["deg"]) {
            Some(Role::Phase)
        } else {
            self.is_only(&["hz", "khz"]).then_some(Role::Frequency)
        }
    }

    fn hz_per_unit(&self) -> Option<f64> {
        if self.has(&["khz"]) {
            Some(1e3)
        } else if self.has(&["hz"]) {
            Some(1.0)
        } else {
            self.has(&["rad", "rads", "omega", "w", "ω"])
                .then_some(0.5 / std::f64::consts::PI)
        }
    }

    fn phase_unit(&self) -> Option<PhaseUnit> {
        if self.has(&["deg", "degree", "degrees"]) {
            Some(PhaseUnit::Deg)
        } else {
            self.has(&["rad", "radian", "radians"])
                .then_some(PhaseUnit::Rad)
        }
    }

    fn scale(&self) -> Scale {
        if self.has(&["db"]) {
            Scale::Decibels
        } else {
            Scale::Linear
        }
    }

    /// Whether the name or the unit is that of a velocity or an acceleration.
    fn is_derivative(&self) -> bool {
        const NAMES: [&str; 9] = [
            "velocity",
            "acceleration",
            "accelerance",
            "inertance",
            "mobility",
            "s2",
            "ms2",
            "s²",
            "ms²",
        ];
        let is_per_second = self.0.len() > 1 && self.0[1..].iter().any(|word| word == "s");
        self.has(&NAMES) || is_per_second
    }

    /// Whether words without a slash are those of another unit than metres per ampere.
    fn has_other_unit(&self) -> bool {
        const OTHERS: [&str; 30] = [
            "um", "µm", "μm", "micron", "microns", "mm", "nm", "inch", "mil", "mils", "n", "mn",
            "newton", "newtons", "v", "mv", "volt", "volts", "ma", "s", "ms", "s2", "ms2", "rad",
            "rads", "mrad", "urad", "ohm", "counts", "percent",
        ];
        self.0.len() > 1
            && self.0[1..]
                .iter()
                .any(|word| OTHERS.contains(&word.as_str()))
            || self.0.join(" ").ends_with("a per m")
    }
}

impl Columns {
    /// The columns of a table by their names; three columns without names are a frequency and two of the response.
    pub fn of(table: &FrfTable<'_>, rule: UnitRule) -> Result<Columns, FrfTableError> {
        if let ([frequency, first, second], false) = (table.names(), table.has_names()) {
            return Ok(Columns {
                frequency: frequency.clone(),
                hz_per_unit: None,
                pair: Pair::Unknown([first.clone(), second.clone()]),
                coherence: None,
                magnitude_sigma: None,
                resolution: None,
                unit: None,
            });
        }
        Named::of(table, rule)?.columns()
    }
}

/// A column with its words and its role.
struct NamedColumn<'a> {
    name: &'a String,
    /// By the line of units; empty without one.
    unit: &'a str,
    words: Words,
    role: Option<Role>,
}

struct Named<'a> {
    table: &'a FrfTable<'a>,
    rule: UnitRule,
    columns: Vec<NamedColumn<'a>>,
}

impl<'a> Named<'a> {
    fn of(table: &'a FrfTable<'_>, rule: UnitRule) -> Result<Named<'a>, FrfTableError> {
        let columns = table.names().iter().enumerate().map(|(index, name)| {
            let unit = table.unit(index);
            let words = Words::of(name, unit);
            let role = words.role();
            NamedColumn {
                name,
                unit,
                words,
                role,
            }
        });
        let columns: Vec<NamedColumn<'_>> = columns.collect();
        let known = columns.iter().enumerate();
        for (index, column) in known.filter(|(_, column)| column.role.is_some()) {
            let same = |other: &&NamedColumn<'_>| other.role == column.role;
            if let Some(first) = columns[..index].iter().find(same) {
                return Err(FrfTableError::Twice {
                    path: table.path().to_owned(),
                    first: first.name.clone(),
                    second: column.name.clone(),
                });
            }
        }
        Ok(Named {
            table,
            rule,
            columns,
        })
    }

    fn get(&self, role: Role) -> Option<&NamedColumn<'a>> {
        self.columns.iter().find(|column| column.role == Some(role))
    }

    fn name(&self, role: Role) -> Option<String> {
        self.get(role).map(|column| column.name.clone())
    }

    fn require(&self, role: Role, what: &'static str) -> Result<&NamedColumn<'a>, FrfTableError> {
        self.get(role).ok_or_else(|| FrfTableError::Missing {
            path: self.table.path().to_owned(),
            what,
            available: self.table.names().to_vec(),
        })
    }

    fn columns(&self) -> Result<Columns, FrfTableError> {
        let frequency = self.require(Role::Frequency, "frequency")?;
        let pair = self.pair()?;
        let unit = self.unit()?;
        if let Some(sigma) = self.get(Role::MagnitudeSigma) {
            self.check_sigma_unit(sigma, unit.as_ref())?;
        }
        Ok(Columns {
            frequency: frequency.name.clone(),
            hz_per_unit: frequency.words.hz_per_unit(),
            pair,
            unit,
            coherence: self.name(Role::Coherence),
            magnitude_sigma: self.name(Role::MagnitudeSigma),
            resolution: self.name(Role::Resolution),
        })
    }

    fn pair(&self) -> Result<Pair, FrfTableError> {
        if let (Some(real), Some(imaginary)) = (self.get(Role::Real), self.get(Role::Imaginary)) {
            for column in [real, imaginary] {
                self.check_unit(column)?;
            }
            return Ok(Pair::Cartesian {
                real: real.name.clone(),
                imaginary: imaginary.name.clone(),
            });
        }
        let magnitude = self.require(Role::Magnitude, "magnitude")?;
        self.check_unit(magnitude)?;
        let phase = self.require(Role::Phase, "phase")?;
        Ok(Pair::Polar {
            magnitude: magnitude.name.clone(),
            scale: magnitude.words.scale(),
            phase: phase.name.clone(),
            phase_unit: phase.words.phase_unit(),
        })
    }

    /// The unit that the columns of the response state. Real and imaginary part have the same one.
    fn unit(&self) -> Result<Option<ResponseUnit>, FrfTableError> {
        let parts = [self.get(Role::Real), self.get(Role::Imaginary)];
        let [Some(real), Some(imaginary)] = parts else {
            return Ok(self.get(Role::Magnitude).and_then(NamedColumn::stated_unit));
        };
        let units = [real, imaginary].map(NamedColumn::stated_unit);
        match units {
            [Some(of_real), Some(of_imaginary)] if of_real != of_imaginary => {
                Err(FrfTableError::TwoUnits {
                    path: self.table.path().to_owned(),
                    column: imaginary.name.clone(),
                    units: Box::new([of_real, of_imaginary]),
                })
            }
            [first, second] => Ok(first.or(second)),
        }
    }

    /// A standard deviation in dB or per cent is that of a ratio.
    fn check_sigma_unit(
        &self,
        column: &NamedColumn<'_>,
        unit: Option<&ResponseUnit>,
    ) -> Result<(), FrfTableError> {
        let is_ratio = column.words.scale() == Scale::Decibels || column.words.has(&["percent"]);
        let stated = column.stated_unit();
        match self.rule {
            UnitRule::MetresPerAmpere if is_ratio => Err(self.other_unit(column)),
            UnitRule::MetresPerAmpere => self.check_unit(column),
            _ if is_ratio || (stated.is_some() && stated.as_ref() != unit) => {
                Err(FrfTableError::SigmaUnit {
                    path: self.table.path().to_owned(),
                    column: column.name.clone(),
                })
            }
            UnitRule::Any | UnitRule::AnyOutput => Ok(()),
        }
    }

    fn other_unit(&self, column: &NamedColumn<'_>) -> FrfTableError {
        FrfTableError::Unit {
            path: self.table.path().to_owned(),
            column: column.name.clone(),
        }
    }

    fn check_unit(&self, column: &NamedColumn<'_>) -> Result<(), FrfTableError> {
        match self.rule {
            UnitRule::MetresPerAmpere if column.has_other_unit() => Err(self.other_unit(column)),
            UnitRule::Any if column.words.is_derivative() => Err(FrfTableError::Derivative {
                path: self.table.path().to_owned(),
                column: column.name.clone(),
            }),
            _ => Ok(()),
        }
    }
}

impl NamedColumn<'_> {
    fn stated_unit(&self) -> Option<ResponseUnit> {
        ResponseUnit::stated(self.name, self.unit)
    }

    /// Whether the unit is another one than metres per ampere.
    fn has_other_unit(&self) -> bool {
        let is_stated_as_other = self
            .stated_unit()
            .is_some_and(|unit| !unit.is_metres_per_ampere());
        is_stated_as_other || self.words.has_other_unit()
    }
}
