//! Where a spare is awake, as a file beside what its station keeps: after a power failure its folder may have the newest state of a group, of which
//! no other member can know.

use std::fs::{self, File};
use std::io;
use std::path::PathBuf;

use crate::run::Duty;

/// `CLUSTER.SLOT.awake`; nothing where the station keeps nothing.
fn file(duty: &Duty) -> Option<PathBuf> {
    let folder = duty.retain.as_ref()?;
    Some(folder.join(format!("{}.{}.awake", duty.cluster.name(), duty.slot_name)))
}

/// The spare wakes in a group.
///
/// # Errors
/// The file is not written.
pub(crate) fn begins(duty: &Duty) -> io::Result<()> {
    let (Some(folder), Some(file)) = (&duty.retain, file(duty)) else {
        return Ok(());
    };
    fs::create_dir_all(folder)?;
    File::create(file)?.sync_all()?;
    File::open(folder)?.sync_all()
}

/// The group is complete without the spare: all that its station has kept is older than what others hold.
pub(crate) fn ends(duty: &Duty) {
    // One that stays wakes the spare once more than needed.
    let _ = file(duty).map(fs::remove_file);
}

/// The group in which the spare was awake when it ended.
pub(crate) fn of(duties: &[Duty]) -> Option<usize> {
    duties.iter().position(|duty| file(duty).is_some_and(|file| file.exists()))
}
