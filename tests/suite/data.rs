//! Where real footage and rigs are looked for.

use std::path::PathBuf;

/// The folder `MUYBRIDGE_DATA` names, else `../shared/data` beside the project; `None` with a
/// message when it is not there.
pub(crate) fn data_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("MUYBRIDGE_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if folder.is_dir() {
        Some(folder)
    } else {
        eprintln!("skipped: no data in {} (set MUYBRIDGE_DATA)", folder.display());
        None
    }
}
