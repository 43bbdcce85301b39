//! Files that a client names.

use super::error::ApiError;
use crate::order_files::{Outside, check_paths};
use crate::shared::Daemon;

/// Refuses files outside the folder of the recordings, directly or through a link. A name that is not a path, such as that of a profile,
/// passes.
pub async fn check_files(daemon: &Daemon, files: Vec<String>) -> Result<(), ApiError> {
    check_paths(&files)?;
    let catalogue = daemon.catalogue();
    let first_link = daemon
        .files
        .run(move || files.into_iter().find(|file| catalogue.leaves(file)));
    match first_link.await? {
        Some(file) => Err(Outside(file).into()),
        None => Ok(()),
    }
}
