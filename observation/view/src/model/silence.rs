//! A dead network: stations that are silent together are one cause, not one for each station.
//!
//! ```text
//!   robot-io receives no station, press-io does ──► robot-io: its network has failed
//!   no remote I/O receives a station            ──► network: it has failed, or all stations have
//! ```
//!
//! Invariant: a station whose process is known to be killed, ended or suspended is a cause of its own.

use std::ops::RangeInclusive;

use understudy_wire::{Member, ProgramId, StationId};

use super::Model;
use crate::alarm::{Subject, UNPROTECTED, listed};
use crate::protection::LackingStation;
use crate::station::StationState;

/// Reason of a station that a remote I/O does not receive.
pub(super) const NOT_RECEIVED: &str = "not-received";

/// Name of the alarm of the network that all remote I/Os share.
const NETWORK: &str = "network";

/// Where no station is received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Silence {
    /// At this remote I/O; another one receives some, or it is not known.
    Here,
    /// At all remote I/Os that report.
    Everywhere,
}

impl Model {
    /// Whether the remote I/O of a program received no station in these cycles; nothing where it received one, or where that is not known.
    pub(super) fn silence(
        &self,
        program: ProgramId,
        cycles: &RangeInclusive<i64>,
    ) -> Option<Silence> {
        if !self.heard_in(program, cycles.clone())?.is_empty() {
            return None;
        }
        let others = self.program_ids().filter(|other| *other != program);
        let others = others.filter_map(|other| self.heard_in(other, cycles.clone()));
        let is_everywhere = others.map(|heard| heard.is_empty()).reduce(|all, one| all && one);
        Some(if is_everywhere == Some(true) { Silence::Everywhere } else { Silence::Here })
    }

    /// The causes of a loss of protection, each with its text: the stations, or the network of several that are silent together.
    pub(super) fn causes(
        &self,
        program: ProgramId,
        lacking: &[LackingStation],
        cycles: &RangeInclusive<i64>,
    ) -> Vec<(Subject, String)> {
        let silent = match self.silence(program, cycles) {
            Some(silence) => self.silent_stations(*cycles.end()).map(|names| (silence, names)),
            None => None,
        };
        let is_silent = |one: &LackingStation| {
            let names = silent.as_ref().map(|(_, names)| names);
            one.reason == NOT_RECEIVED && names.is_some_and(|names| names.contains(&&*one.station))
        };
        let own = lacking.iter().filter(|one| !is_silent(one));
        let own = own.map(|one| ((one.station.clone(), UNPROTECTED), one.text.clone()));
        let mut causes: Vec<_> = own.collect();
        if let Some((silence, names)) = &silent
            && lacking.iter().any(is_silent)
        {
            let remote_io = self.driver_name(program, *cycles.end());
            let stations = listed(names);
            let (name, text) = match silence {
                Silence::Here => (
                    remote_io,
                    format!("{remote_io} receives none of {stations}: its network has failed"),
                ),
                Silence::Everywhere => (
                    NETWORK,
                    format!(
                        "no remote I/O receives any of {stations}: the network or these stations have failed"
                    ),
                ),
            };
            causes.push(((name.to_owned(), UNPROTECTED), text));
        }
        if causes.is_empty() {
            let remote_io = self.driver_name(program, *cycles.end()).to_owned();
            let text = format!("{remote_io} does not name a station that lacks");
            causes.push(((remote_io, UNPROTECTED), text));
        }
        causes
    }

    /// The stations whose process is not known to be down; nothing where one or none is left, since that is its own cause.
    fn silent_stations(&self, cycle: i64) -> Option<Vec<&str>> {
        let standing = self.changes.at(cycle);
        let is_down = |station: StationId| {
            let state = self.station_state_in(&standing, station, Some(cycle));
            matches!(state, StationState::Killed | StationState::Ended | StationState::Suspended)
        };
        let silent = self.station_ids().filter(|station| !is_down(*station));
        let names = silent.map(|station| self.members().name(Member::Station(station)));
        let names: Vec<&str> = names.collect();
        (names.len() > 1).then_some(names)
    }
}
