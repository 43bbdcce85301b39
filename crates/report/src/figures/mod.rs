//! The figures of a result: each has one name, one unit and one text, for the terminal, the pages and JSON.

mod comparison;
mod control;
mod margins;
mod modal;
mod stage;
mod tuning;

pub(crate) use comparison::IF_EQUAL;
pub use comparison::{difference_table, figure_table, frequencies};
pub use control::{control_table, predicted_sine, step, step_table, tracking_figures, whole_run};
pub use margins::{loop_peaks, margins, measured_margins, swept_loop};
pub use modal::{
    COMPLEX_RESIDUES_NOTE, NO_MODES_IN_BAND, has_complex_residues, mode_table, outside_band_note,
    zero_table,
};
pub use stage::{stage_check_table, static_step_table};
pub use tuning::{binding_table, frf_table, plant_table};

use serde::Serialize;
use serde::ser::{SerializeStruct, Serializer};

use crate::number::{interval, plain};
use crate::table::Table;
use bench_base::units::hz;
use bench_identify::Estimate;

/// A figure of a result.
///
/// ```
/// use bench_report::figures::Figure;
/// let margin = Figure::new("Phase margin", 31.5, "deg", 2).at(Some(289.0));
/// assert_eq!(margin.text(), "31.50 deg at 46.00 Hz");
/// assert_eq!(Figure::new("Gain margin", None::<f64>, "dB", 2).text(), "none");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What it is.
    pub name: String,
    /// Its value in `unit`; `None` if the result has none.
    pub value: Option<f64>,
    /// Standard deviation in `unit`; `None` if it is not known.
    pub sigma: Option<f64>,
    /// The unit as shown; empty for a ratio.
    pub unit: &'static str,
    /// Digits after the point of a value without standard deviation.
    decimals: usize,
    /// What follows the value: a frequency, a count.
    remark: String,
    /// The text without a value.
    absent: &'static str,
}

/// A number that may be missing, and may have a known error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    value: Option<f64>,
    sigma: Option<f64>,
}

impl Quantity {
    /// A number, with its standard deviation if that is known.
    pub fn new(value: f64, sigma: Option<f64>) -> Quantity {
        let value = Some(value);
        Quantity { value, sigma }
    }
}

impl From<f64> for Quantity {
    fn from(value: f64) -> Quantity {
        Quantity::new(value, None)
    }
}

impl From<Estimate> for Quantity {
    fn from(estimate: Estimate) -> Quantity {
        Quantity::new(estimate.value, Some(estimate.sigma))
    }
}

impl<Q: Into<Quantity>> From<Option<Q>> for Quantity {
    fn from(quantity: Option<Q>) -> Quantity {
        let none = Quantity {
            value: None,
            sigma: None,
        };
        quantity.map_or(none, Q::into)
    }
}

impl Figure {
    /// A figure in `unit`. A value of unknown error is shown with `decimals` digits after the point, one with a standard deviation
    /// with its 95 % confidence interval and the digits that it allows.
    pub fn new(
        name: &str,
        quantity: impl Into<Quantity>,
        unit: &'static str,
        decimals: usize,
    ) -> Figure {
        let Quantity { value, sigma } = quantity.into();
        Figure {
            name: name.into(),
            value,
            sigma,
            unit,
            decimals,
            remark: String::new(),
            absent: "none",
        }
    }

    /// The figure in another unit: both numbers times `factor`.
    pub fn times(self, factor: f64, unit: &'static str) -> Figure {
        Figure {
            value: self.value.map(|value| value * factor),
            sigma: self.sigma.map(|sigma| sigma * factor.abs()),
            unit,
            ..self
        }
    }

    /// The figure with the frequency in rad/s at which it is reached.
    pub fn at(self, omega_rad_s: Option<f64>) -> Figure {
        let place = omega_rad_s.map_or(String::new(), |omega| format!(" {}", place(omega)));
        self.remark(&place)
    }

    /// The figure, an angular frequency in rad/s, with the same in hertz after it.
    pub fn in_hertz(self) -> Figure {
        let hertz = self
            .value
            .map(|omega_rad_s| format!(" ({:.3} Hz)", hz(omega_rad_s)));
        self.remark(&hertz.unwrap_or_default())
    }

    /// The figure with a remark after its value, as it stands.
    pub fn remark(mut self, text: &str) -> Figure {
        self.remark += text;
        self
    }

    /// The figure with another text in place of a missing value.
    pub fn or(self, absent: &'static str) -> Figure {
        Figure { absent, ..self }
    }

    /// Value, 95 % confidence interval, unit and remark, with typographic minus sign and prefixes.
    pub fn text(&self) -> String {
        let Some(value) = self.value else {
            return self.absent.into();
        };
        let number = match self.sigma {
            Some(sigma) => {
                let estimate = Estimate { value, sigma };
                interval(value, estimate.half_width_95())
            }
            None => plain(value, self.decimals),
        };
        let gap = if self.unit.is_empty() { "" } else { " " };
        format!("{number}{gap}{}{}", self.unit, self.remark)
    }
}

impl Figure {
    /// Name and text, for a list of facts.
    pub fn pair(&self) -> (String, String) {
        (self.name.clone(), self.text())
    }

    /// Name and unit, for the head of a column: `Overshoot (%)`.
    pub fn head(&self) -> String {
        format!("{} ({})", self.name, self.unit)
    }

    /// The number without its unit, for a column with this head.
    pub fn number(&self) -> String {
        let number = |value| format!("{value:.*}", self.decimals);
        self.value.map_or(self.absent.into(), number)
    }
}

/// Name, value, standard deviation, unit and text. The names in JSON must not change.
impl Serialize for Figure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut json = serializer.serialize_struct("Figure", 5)?;
        json.serialize_field("name", &self.name)?;
        json.serialize_field("value", &self.value)?;
        json.serialize_field("sigma", &self.sigma)?;
        json.serialize_field("unit", self.unit)?;
        json.serialize_field("text", &self.text())?;
        json.end()
    }
}

/// Measured figures beside those of the model, paired by their names, in the order of the first and then of the second list.
pub fn beside(measured: &[Figure], model: &[Figure]) -> Table {
    let only_in_model = model
        .iter()
        .filter(|figure| text_of(measured, &figure.name).is_none());
    let names = measured
        .iter()
        .chain(only_in_model)
        .map(|figure| &figure.name);
    let rows = names.map(|name| {
        let cell = |figures: &[Figure]| text_of(figures, name).unwrap_or_default();
        vec![name.clone(), cell(measured), cell(model)]
    });
    Table::new(["", "Measured", "By the model"]).with_rows(rows)
}

fn text_of(figures: &[Figure], name: &str) -> Option<String> {
    let found = figures.iter().find(|figure| figure.name == name);
    found.map(Figure::text)
}

/// An estimate with its 95 % confidence interval: `29.274373 ± 0.000062`.
pub fn interval_of(estimate: Estimate) -> String {
    interval(estimate.value, estimate.half_width_95())
}

/// `at 70.64 Hz`.
pub fn place(omega_rad_s: f64) -> String {
    format!("at {:.2} Hz", hz(omega_rad_s))
}

/// How many crossings of |L| = 1 there are, if more than one.
pub fn crossing_count(count: usize) -> String {
    match count {
        0 | 1 => String::new(),
        count => format!("; {count} crossings"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shows_two_digits_of_the_error_in_the_unit_of_the_figure() {
        let delay_s = Estimate {
            value: 0.000_312_34,
            sigma: 0.000_001_5,
        };
        let figure = Figure::new("Delay margin", delay_s, "s", 4).times(1e3, "ms");
        assert_eq!(figure.text(), "0.3123 ± 0.0029 ms");
        let negative = Figure::new("Gain", delay_s.scaled(-1.0), "s", 4).times(1e3, "ms");
        assert_eq!(negative.text(), "\u{2212}0.3123 ± 0.0029 ms");
    }

    #[test]
    fn a_missing_figure_has_its_own_text() {
        let none = Figure::new("Gain margin", None::<f64>, "dB", 2)
            .at(Some(1.0))
            .or("none in the band");
        assert_eq!(none.text(), "none in the band");
    }

    #[test]
    fn json_has_name_value_sigma_unit_and_text() {
        let figure = Figure::new("Modulus margin", 0.5, "", 4);
        assert_eq!(
            serde_json::to_value(&figure).unwrap(),
            serde_json::json!({"name": "Modulus margin", "value": 0.5, "sigma": null, "unit": "", "text": "0.5000"})
        );
    }

    #[test]
    fn pairs_measured_figures_with_those_of_the_model_by_name() {
        let figure = |name: &str, value: f64| Figure::new(name, value, "", 0);
        let table = beside(
            &[figure("a", 1.0), figure("b", 2.0)],
            &[figure("c", 3.0), figure("b", 4.0)],
        );
        assert_eq!(
            table.rows,
            [["a", "1", ""], ["b", "2", "4"], ["c", "", "3"]]
        );
    }
}
