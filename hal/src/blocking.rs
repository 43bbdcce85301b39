//! Changes of the state of an amplifier that wait for their end: for callers outside the loop.

use std::task::Poll;
use std::time::Duration;

use crate::{CurrentAmplifier, DeviceError};

/// Time between two calls of a `poll` method.
const PAUSE: Duration = Duration::from_millis(1);

/// Largest number of pauses, which is one minute: above the time limit of every driver.
const PAUSES_MAX: u32 = 60_000;

const NO_END: DeviceError = DeviceError {
    what: "the driver of the amplifier did not end a change of state within 60 s",
    remedy: "report this fault of the driver",
    code: 0,
};

/// Enables the amplifier and waits until it follows commands. `sleep` waits for a time, for example `std::thread::sleep`.
///
/// # Errors
///
/// Returns the error of [`CurrentAmplifier::begin_enable`] or [`CurrentAmplifier::poll_enable`]. The amplifier is then disabled.
pub fn enable<A: CurrentAmplifier + ?Sized>(
    amplifier: &mut A,
    sleep: impl Fn(Duration),
) -> Result<(), DeviceError> {
    let enabled = amplifier
        .begin_enable()
        .and_then(|()| wait(|| amplifier.poll_enable(), sleep));
    enabled.inspect_err(|_| amplifier.disable())
}

/// Resets a fault of the amplifier and waits for the result. `sleep` waits for a time, for example `std::thread::sleep`.
///
/// # Errors
///
/// Returns the error of [`CurrentAmplifier::begin_reset`] or [`CurrentAmplifier::poll_reset`].
pub fn reset_fault<A: CurrentAmplifier + ?Sized>(
    amplifier: &mut A,
    sleep: impl Fn(Duration),
) -> Result<(), DeviceError> {
    amplifier.begin_reset()?;
    wait(|| amplifier.poll_reset(), sleep)
}

fn wait(
    mut poll: impl FnMut() -> Poll<Result<(), DeviceError>>,
    sleep: impl Fn(Duration),
) -> Result<(), DeviceError> {
    for _ in 0..PAUSES_MAX {
        if let Poll::Ready(result) = poll() {
            return result;
        }
        sleep(PAUSE);
    }
    Err(NO_END)
}
