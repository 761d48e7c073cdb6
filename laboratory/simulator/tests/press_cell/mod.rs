//! The press cell of section V as parts of a simulation.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::time::Duration;

use understudy_cycle::Mode;
use understudy_remote_io::PairSettings;
use understudy_simulator::Parts;

pub(crate) const PERIOD: Duration = Duration::from_millis(10);
pub(crate) const HOLD_CYCLES: u32 = 3;

/// A robot and its press.
pub(crate) fn parts(mode: Mode, understudies: usize) -> Parts {
    line(2, mode, understudies)
}

/// Gives each program a second remote I/O, which takes over after this number of cycles.
pub(crate) fn pair(parts: &mut Parts, take_over_after: u32) {
    for remote_io in &mut parts.remote_ios {
        remote_io.pair = Some(PairSettings { is_twin: false, take_over_after });
    }
}

/// A robot, the press that it feeds, a robot, and so on: `programs` in all.
pub(crate) fn line(programs: usize, mode: Mode, understudies: usize) -> Parts {
    understudy_simulator::parts(&understudy_testing::line(programs, understudies, mode))
}
