//! Measurement files of LabVIEW (LVM), which are text (National Instruments, *Specification for the LabVIEW Measurement File (.lvm)*).
//!
//! ```text
//! LabVIEW Measurement                 keys of the file: Separator, Decimal_Separator, X_Columns, ...
//! ***End_of_Header***
//! Channels  2                         keys of a measurement, with a value for each channel
//! Samples   1000    1000
//! ***End_of_Header***
//! X_Value   Force   Acceleration      names of the columns, and then the samples
//!           0.1     2.5
//! ```
//!
//! A file that was appended to has several measurements, each with its keys.

mod header;
mod samples;

use crate::budget::Budget;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;
use crate::number::{Numbers, Precision};
use crate::value::{NumericArray, Value, Variables};

use header::{FileHeader, Header};
use samples::Samples;

/// The first cell of a file.
const MARK: &[u8] = b"LabVIEW Measurement";

/// Whether a file begins with the mark of the format.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    text.starts_with(MARK)
}

/// The channels of the only measurement, with `time`; of several measurements those of each, as fields of `1`, `2`, ...
pub(crate) fn variables(bytes: &[u8], budget: &mut Budget) -> Result<Variables, ArraysError> {
    let mut file = Bytes::new(bytes, ByteOrder::Little);
    let of_file = FileHeader::read(&mut file)?;
    let mut measurements = Vec::new();
    while let Some(header) = Header::read(&mut file, &of_file)? {
        let samples = Samples::read(&mut file, &of_file, &header, budget)?;
        measurements.push(channels(&header, samples, budget)?);
    }
    if measurements.len() == 1 {
        return Ok(measurements.remove(0));
    }
    let numbered = measurements.into_iter().zip(1..);
    let fields = numbered.map(|(fields, number)| (format!("{number}"), Value::Fields(fields)));
    Ok(fields.collect())
}

/// The channels, and their abscissas: `time` if all have the same, or else `NAME.time` for each.
fn channels(
    header: &Header,
    samples: Samples,
    budget: &mut Budget,
) -> Result<Variables, ArraysError> {
    let is_common = samples.have_common_abscissas(header);
    let mut abscissas = Vec::new();
    let with_abscissas = if is_common { 1 } else { samples.channels.len() };
    for (k, channel) in samples.channels.iter().take(with_abscissas).enumerate() {
        budget.take(channel.numbers.len(), 8)?;
        abscissas.push(samples.abscissas_of(header, k).collect::<Vec<f64>>());
    }
    let mut abscissas = abscissas.into_iter();
    let (abscissa_name, abscissa_unit) = header.abscissa();
    let mut variables = Variables::new();
    for (k, channel) in samples.channels.into_iter().enumerate() {
        if let Some(of_channel) = abscissas.next() {
            let name = if is_common {
                abscissa_name.clone()
            } else {
                format!("{}.{abscissa_name}", channel.name)
            };
            variables.push((name, array(of_channel, abscissa_unit.clone())));
        }
        variables.push((channel.name, array(channel.numbers, header.unit(k))));
    }
    Ok(variables)
}

fn array(numbers: Vec<f64>, unit: Option<String>) -> Value {
    Value::Numbers(NumericArray {
        shape: vec![numbers.len()],
        numbers: Numbers::Real(numbers, Precision::Double),
        unit,
    })
}

#[cfg(test)]
mod tests;
