//! The station of a slot, as a process of this machine.

use std::io;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use understudy_bus::zenoh_runtime;

use crate::run::Duty;

/// Time in which the station ends by itself after its input has closed.
const END_PATIENCE: Duration = Duration::from_secs(3);

/// Between two looks whether it has ended.
const LOOK: Duration = Duration::from_millis(20);

/// A station that runs; it ends when this is dropped, and with the process of the spare.
pub(crate) struct Post(Child);

impl Post {
    /// Starts `understudy node` for the slot of a group.
    pub(crate) fn start(program: &Path, duty: &Duty, real_time: bool) -> io::Result<Self> {
        let mut command = Command::new(program);
        command.arg("node").arg(&duty.cluster_file).args(["--name", &duty.slot_name]);
        command.arg("--keys").arg(&duty.slot_keys).arg("--ends-with-parent");
        if !real_time {
            command.arg("--no-real-time");
        }
        if let Some(journal) = &duty.journal {
            command.arg("--journal").arg(journal);
        }
        if let Some(retain) = &duty.retain {
            command.arg("--retain").arg(retain);
        }
        // The station sets up the threads of its own link.
        command.env_remove(zenoh_runtime(1).0);
        // Its input is closed when the spare ends, however that ends.
        command.stdin(Stdio::piped()).stdout(Stdio::null());
        command.spawn().map(Self)
    }

    /// How it has ended, where it has.
    pub(crate) fn ended(&mut self) -> Option<ExitStatus> {
        self.0.try_wait().ok().flatten()
    }
}

impl Drop for Post {
    fn drop(&mut self) {
        drop(self.0.stdin.take());
        let begun = Instant::now();
        while matches!(self.0.try_wait(), Ok(None)) {
            if begun.elapsed() > END_PATIENCE {
                // It is ended whether or not it answers; a process that is gone is no error.
                let _ = self.0.kill();
                let _ = self.0.wait();
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}
