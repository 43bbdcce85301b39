//! Conversion of a band in hertz to bins of an FFT.

use core::ops::RangeInclusive;

use super::BandError;

/// The bins k = 1 ..= (samples - 1)/2 of an FFT over `samples` whose frequency k rate/samples lies within the band,
/// limits included. Bin 0 (offset of the probe) and the bin at the Nyquist frequency (no phase) are excluded.
pub(super) fn bins(
    band_hz: (f64, f64),
    rate_hz: f64,
    samples: usize,
) -> Result<RangeInclusive<usize>, BandError> {
    let (low_hz, high_hz) = band_hz;
    check(band_hz, rate_hz)?;
    let bin_hz = rate_hz / samples as f64;
    // A limit that equals a bin except for rounding includes that bin.
    let low = (low_hz / bin_hz - 1e-6).ceil().max(1.0) as usize;
    let high = (high_hz / bin_hz + 1e-6)
        .floor()
        .min(last_bin(samples) as f64) as usize;
    if low <= high {
        Ok(low..=high)
    } else {
        Err(BandError::NoBin {
            low_hz,
            high_hz,
            bin_hz,
        })
    }
}

/// The highest bin below the Nyquist frequency.
pub(super) fn last_bin(samples: usize) -> usize {
    samples.saturating_sub(1) / 2
}

fn check((low_hz, high_hz): (f64, f64), rate_hz: f64) -> Result<(), BandError> {
    if !(low_hz >= 0.0 && low_hz < high_hz && high_hz.is_finite()) {
        return Err(BandError::Limits { low_hz, high_hz });
    }
    let nyquist_hz = rate_hz / 2.0;
    if high_hz > nyquist_hz {
        return Err(BandError::BeyondNyquist {
            high_hz,
            nyquist_hz,
        });
    }
    Ok(())
}
