//! Arguments of commands, as clients give them.

use super::error::ApiError;
use crate::shared::Daemon;
use crate::worker::{check_args, check_links};

/// Refuses arguments that name something outside the folder of the recordings, directly or through a link.
pub async fn check_arguments(daemon: &Daemon, args: &[String]) -> Result<(), ApiError> {
    check_args(args)?;
    let (args, catalogue) = (args.to_vec(), daemon.catalogue());
    let checked = daemon.files.run(move || check_links(&args, &catalogue));
    Ok(checked.await??)
}
