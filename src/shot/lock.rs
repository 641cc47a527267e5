//! One process at a time works in a shot.

use std::fs::{self, File, TryLockError};
use std::path::Path;

use super::record::STATE_FOLDER;
use crate::error::{Error, Result};

/// Held while a process writes to the shot; let go when dropped or when the process dies.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

pub(super) fn lock(shot: &Path) -> Result<Lock> {
    let folder = shot.join(STATE_FOLDER);
    fs::create_dir_all(&folder).map_err(Error::io(&folder, "create the folder"))?;
    let path = folder.join("lock");
    let file = File::create(&path).map_err(Error::io(&path, "open"))?;
    match file.try_lock() {
        Ok(()) => Ok(Lock { _file: file }),
        Err(TryLockError::WouldBlock) => Err(Error::ShotBusy { shot: shot.to_owned() }),
        Err(TryLockError::Error(source)) => Err(Error::Io { path, action: "lock", source }),
    }
}
