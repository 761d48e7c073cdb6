//! Events of the processes of members, and of the laboratory that runs them.

use understudy_bus::HostEvent;
use understudy_journal::{Action, Members, RunEvent};
use understudy_wire::{Member, StateChoice};

use super::Words;
use crate::event::Level;

pub(super) fn host(event: &HostEvent, names: &Members) -> Words {
    use Level::{Alarm, Info, Notice, Warning};
    match event {
        HostEvent::Ready {
            process, address, ..
        } => (
            "ready",
            Info,
            format!("listens as process {process} at {address}"),
        ),
        HostEvent::RefusedBytes { datagrams, reason } => (
            "refused-bytes",
            Warning,
            format!("{datagrams} datagrams were not frames: {reason}"),
        ),
        HostEvent::RefusedFrames {
            datagrams, reason, ..
        } => (
            "refused-frames",
            Warning,
            format!("{datagrams} frames were rejected: {reason}"),
        ),
        HostEvent::ChannelOpened { address, .. } => (
            "channel-opened",
            Info,
            format!("listens for operators at {address}"),
        ),
        HostEvent::ChannelFailed { reason } => (
            "channel-failed",
            Warning,
            format!("cannot listen for operators: {reason}"),
        ),
        HostEvent::DuplicateFound { member } => (
            "duplicate-found",
            Alarm,
            format!(
                "receives frames of two processes that run with the keys of {}",
                names.name(*member)
            ),
        ),
        HostEvent::DuplicateGone { member } => (
            "duplicate-gone",
            Notice,
            format!(
                "receives frames of one process only that runs with the keys of {}",
                names.name(*member)
            ),
        ),
        HostEvent::NewLife { life } => (
            "new-life",
            Warning,
            format!("is not received by the others and continues in a new life, {life}"),
        ),
        HostEvent::NoNewLife { reason } => (
            "no-new-life",
            Warning,
            format!("is not received by the others and cannot start a new life: {reason}"),
        ),
        HostEvent::RefusedConnections {
            connections,
            address,
        } => (
            "refused-connections",
            Warning,
            format!(
                "{connections} connections to the operators' port were refused because of the limit, the last from {address}"
            ),
        ),
        HostEvent::UnsendableFrames { frames, reason } => (
            "unsendable-frames",
            Warning,
            format!("{frames} frames could not be sent: {reason}"),
        ),
        HostEvent::LinkReopened { silence_ms } => (
            "link-reopened",
            Warning,
            format!("received no member for {silence_ms} ms and reopened its link"),
        ),
        HostEvent::LinkFailed { silence_ms, reason } => (
            "link-failed",
            Alarm,
            format!("received no member for {silence_ms} ms and cannot reopen its link: {reason}"),
        ),
        HostEvent::FieldLost { reason } => (
            "field-lost",
            Alarm,
            format!("its equipment cannot be read or written: {reason}"),
        ),
        HostEvent::FieldRegained => (
            "field-regained",
            Notice,
            "its equipment is read and written again".to_owned(),
        ),
        HostEvent::FieldContested => (
            "field-contested",
            Alarm,
            "another master writes the outputs of its equipment".to_owned(),
        ),
        HostEvent::FieldUncontested => (
            "field-uncontested",
            Notice,
            "its equipment holds the outputs that it wrote".to_owned(),
        ),
        HostEvent::JournalLost { records } => (
            "journal-lost",
            Warning,
            format!("{records} records are lost"),
        ),
        HostEvent::UnknownCommand { line } => (
            "unknown-command",
            Warning,
            format!("received an unknown command: {line}"),
        ),
        HostEvent::Stopped(_) => ("stopped", Info, "ended as requested".to_owned()),
    }
}

pub(super) fn run(event: &RunEvent, members: &Members) -> Words {
    use Level::{Alarm, Info, Notice, Warning};
    match event {
        RunEvent::Journal { version } => (
            "journal",
            Info,
            format!("the journal has version {version}"),
        ),
        RunEvent::Started { member } => (
            "started",
            Notice,
            format!("{} is started", members.name(*member)),
        ),
        RunEvent::Fault { action, member, .. } => {
            ("fault", Notice, fault_text(*action, *member, members))
        }
        RunEvent::Commanded {
            member,
            command,
            owner,
            reason,
            refused,
        } => {
            let what = serde_json::to_value(command).unwrap_or_default();
            let what = what["command"].as_str().unwrap_or("command").to_owned();
            let refused = refused
                .as_ref()
                .map_or(String::new(), |why| format!("; refused: {why}"));
            let text = format!(
                "{owner} commands {what} of {}: {reason}{refused}",
                members.name(*member)
            );
            ("commanded", Notice, text)
        }
        RunEvent::Acknowledged(seen) => (
            "acknowledged",
            Notice,
            format!(
                "{} has acknowledged the alarm {} of {} of cycle {}",
                seen.owner, seen.alarm, seen.name, seen.cycle
            ),
        ),
        RunEvent::Attached { member } => (
            "attached",
            Notice,
            format!("the journal of {} is received", members.name(*member)),
        ),
        RunEvent::Detached { member, reason } => (
            "detached",
            Warning,
            format!(
                "the journal of {} is not received: {reason}",
                members.name(*member)
            ),
        ),
        RunEvent::Ended { member, how, said } => {
            let last = said
                .last()
                .map_or(String::new(), |line| format!("; {line:.200}"));
            let text = format!("{} ended unexpectedly: {how}{last}", members.name(*member));
            ("ended", Alarm, text)
        }
        RunEvent::Origin { .. } => (
            "origin",
            Info,
            "all stations are synchronised: cycles are counted from here".to_owned(),
        ),
        RunEvent::ScenarioOver { verdict } => (
            "scenario-over",
            Notice,
            format!("the scenario is over and the cluster stays up; {verdict}"),
        ),
        RunEvent::Interrupted => (
            "interrupted",
            Notice,
            "the run was ended early on request".to_owned(),
        ),
        RunEvent::Finished => ("finished", Info, "the run is over".to_owned()),
    }
}

/// An action on a member.
pub(crate) fn fault_text(action: Action, member: Member, members: &Members) -> String {
    let name = members.name(member);
    match action {
        Action::Crash => format!("{name} is killed"),
        Action::Restart => format!("{name} is started again"),
        Action::Stop => format!("{name} is suspended"),
        Action::Continue => format!("{name} is resumed"),
        Action::Cut { to } => format!("{name} is cut off from {}", members.name(to)),
        Action::Heal { to } => format!("{name} is connected to {} again", members.name(to)),
        Action::Delay { to, by } => format!("{} receives {name} {by:?} later", members.name(to)),
        Action::Release => format!("{name} is released"),
        Action::Choose {
            choice: StateChoice::Cold,
        } => format!("the operator starts the program of {name} cold"),
        Action::Choose { .. } => {
            format!("the operator continues the program of {name} from the newest available state")
        }
        other => format!("{} of {name}", other.word()),
    }
}
