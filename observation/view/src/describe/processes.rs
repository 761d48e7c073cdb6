//! Events of the processes of members, and of the laboratory that runs them.

use std::time::{Duration, UNIX_EPOCH};

use understudy_bus::{HostEvent, Quantiles, RefusedOrder};
use understudy_journal::{Action, Command, Members, RunEvent, time_text};
use understudy_wire::{Member, SignalPlace, StateChoice, Via};

use super::Words;
use super::signals::assignment;
use crate::alarm::listed;

descriptions! { host: HostEvent, members: Members;
    Ready { process, address, .. } => "ready" Info format!("listens as process {process} at {address}");
    RefusedBytes { datagrams, reason } => "refused-bytes" Warning
        format!("{datagrams} datagrams were not frames: {reason}");
    RefusedFrames { datagrams, reason, .. } => "refused-frames" Warning
        format!("{datagrams} frames were rejected: {reason}");
    ChannelOpened { address, .. } => "channel-opened" Info format!("listens for operators at {address}");
    ChannelFailed { reason } => "channel-failed" Warning format!("cannot listen for operators: {reason}");
    DuplicateFound { member } => "duplicate-found" Alarm
        format!("receives frames of two processes that run with the keys of {}", members.name(*member));
    DuplicateGone { member } => "duplicate-gone" Notice
        format!("receives frames of one process only that runs with the keys of {}", members.name(*member));
    NewLife { life } => "new-life" Warning
        format!("continues in a new life, {life}: the others do not receive it, or the numbers of its frames end");
    NoNewLife { reason } => "no-new-life" Warning
        format!("cannot start a new life, and the others do not receive it, or the numbers of its frames end: {reason}");
    RefusedWrites { writes } => "refused-writes" Warning
        format!("{writes} writes were refused at once: more came in a second than it takes");
    RefusedConnections { connections, address } => "refused-connections" Warning format!(
        "{connections} connections to the operators' port were refused because of the limit, the last from {address}"
    );
    RefusedCertificates { connections, reason } => "refused-certificates" Warning
        format!("{connections} certificates of callers were refused, the last because of: {reason}");
    OrderRefused(order) => "order-refused" Warning refused_text(order);
    SpareReceived { spare, serves } => "spare-received" Info match serves {
        Some(group) => format!("{spare} reports: it is awake in {group}"),
        None => format!("{spare} reports: it is asleep and watches this group"),
    };
    SpareLost { spare } => "spare-lost" Warning
        format!("{spare} has not reported for 15 s: it may not wake in this group");
    UnsendableFrames { frames, reason } => "unsendable-frames" Warning
        format!("{frames} frames could not be sent: {reason}");
    NetworkReception { network, lost, impaired } => "network-reception" Warning
        reception_text(*network, lost, impaired, members);
    LinkReopened { network, silence_ms: 0, .. } => "link-reopened" Notice
        format!("opened its link{}", over(*network));
    LinkReopened { network, silence_ms, peer } => "link-reopened" Warning format!(
        "received {} for {silence_ms} ms and reopened its link{}", nothing_of(*peer, members), over(*network)
    );
    LinkFailed { network, silence_ms: 0, reason, .. } => "link-failed" Alarm
        format!("cannot open its link{}: {reason}", over(*network));
    LinkFailed { network, silence_ms, peer, reason } => "link-failed" Alarm format!(
        "received {} for {silence_ms} ms and cannot reopen its link{}: {reason}",
        nothing_of(*peer, members), over(*network)
    );
    ChangeOrdered { step, refused: None } => "change-ordered" Notice format!("was asked {step}");
    ChangeOrdered { step, refused: Some(refused) } => "change-ordered" Warning
        format!("was asked {step}, and refused: {refused}");
    RetainFailed { reason } => "retain-failed" Alarm format!(
        "what it keeps for the time after a power failure is not written to its disk: {reason}"
    );
    RetainRegained => "retain-regained" Notice
        "what it keeps for the time after a power failure is written to its disk again";
    RetainedRefused { file, reason } => "retained-refused" Alarm
        format!("does not use, or not to its end, what it has kept in {file}: {reason}");
    RetainedCarried { program, kept, converted, new } => "retained-carried" Notice format!(
        "takes over the retentive values of the program before {program}: {kept} kept, {converted} converted, {new} new"
    );
    RetainedDropped { program, paths, more } => "retained-dropped" Alarm
        format!("{program} does not take over the retentive values of {}", and_more(paths, *more));
    FieldLost { reason } => "field-lost" Alarm format!("its equipment cannot be read or written: {reason}");
    FieldRegained => "field-regained" Notice "its equipment is read and written again";
    FieldContested => "field-contested" Alarm "another master writes the outputs of its equipment";
    FieldUncontested => "field-uncontested" Notice "its equipment holds the outputs that it wrote";
    WallClock { unix_ns } => "wall-clock" Info format!("its wall clock shows {}", date_of(*unix_ns));
    WallClockStepped { unix_ns, step_ns } => "wall-clock-stepped" Warning
        format!("its wall clock was set by {} s to {}", seconds_of(*step_ns), date_of(*unix_ns));
    Timed { sample_to_output, wakeups } => "timed" Info format!(
        "from a sample to its outputs {}; woken late by {}", times(*sample_to_output), times(*wakeups)
    );
    JournalLost { records } => "journal-lost" Warning format!("{records} records are lost");
    UnknownCommand { line } => "unknown-command" Warning format!("received an unknown command: {line}");
    Stopped(_) => "stopped" Info "ended as requested";
}

/// What half and 99.9 % of them were at most, and the longest.
fn times(quantiles: Quantiles) -> String {
    let [half, most, longest] = [quantiles.p50_ns, quantiles.p999_ns, quantiles.maximum_ns]
        .map(|ns| format!("{:.3}", ns as f64 / 1e6));
    format!(
        "{half} ms at the median, {most} ms in 99.9 %, {longest} ms at most of {}",
        quantiles.count
    )
}

/// An order that was refused, with the person and the names in it.
/// Paths, and how many more there are.
fn and_more(paths: &[String], more: usize) -> String {
    let listed = paths.join(", ");
    if more == 0 { listed } else { format!("{listed} and {more} more") }
}

fn refused_text(order: &RefusedOrder) -> String {
    let RefusedOrder { to, order, signal, owner, reason, why, more } = order;
    let signal = if signal.is_empty() { String::new() } else { format!(" of {signal}") };
    let reason = if reason.is_empty() { String::new() } else { format!(" ({reason})") };
    let more = match more {
        0 => String::new(),
        more => format!("; {more} more were refused before it"),
    };
    format!("{owner} orders {order}{signal} at {to}{reason}; refused: {why}{more}")
}

/// What a member receives over one of several paths.
fn reception_text(network: Via, lost: &[Member], impaired: &[Member], members: &Members) -> String {
    let names = |of: &[Member]| {
        let names: Vec<&str> = of.iter().map(|member| members.name(*member)).collect();
        listed(&names)
    };
    let over = format!("over {network}");
    match (lost.is_empty(), impaired.is_empty()) {
        (true, true) => format!("receives all members {over} again"),
        (false, true) => format!("receives nothing {over} from {}", names(lost)),
        (true, false) => format!("receives less {over} from {}", names(impaired)),
        (false, false) => {
            format!(
                "receives nothing {over} from {}, and less from {}",
                names(lost),
                names(impaired)
            )
        }
    }
}

/// Over which of several paths a link is.
fn over(network: Option<Via>) -> String {
    network.map_or_else(String::new, |network| format!(" over {network}"))
}

/// What a link did not receive: no member, or one that it is connected to.
fn nothing_of(peer: Option<Member>, members: &Members) -> String {
    match peer {
        None => "no member".to_owned(),
        Some(peer) => format!("nothing from {}, to which it was connected,", members.name(peer)),
    }
}

fn date_of(unix_ns: u64) -> String {
    time_text(UNIX_EPOCH + Duration::from_nanos(unix_ns))
}

fn seconds_of(step_ns: i64) -> String {
    let magnitude = Duration::from_nanos(step_ns.unsigned_abs()).as_secs_f64();
    format!("{}{magnitude:.3}", if step_ns < 0 { '-' } else { '+' })
}

descriptions! { run: RunEvent, members: Members;
    Journal { version, .. } => "journal" Info format!("the journal has version {version}");
    Checkpoint { cycle, .. } => "checkpoint" Info format!("cycle {cycle} of the run");
    Continues(from) => "continues" Info format!("the journal goes on after cycle {}", from.cycle);
    InEffect { record, .. } => "in-effect" Info format!("of {}, from before", record.name);
    Started { member } => "started" Notice format!("{} is started", members.name(*member));
    Fault { action, member, .. } => "fault" Notice fault_text(*action, *member, members);
    Commanded { member, command, owner, reason, refused } => "commanded" Notice {
        let what = command_text(command, *member, members);
        let refused = refused.as_ref().map_or_else(String::new, |why| format!("; refused: {why}"));
        format!("{owner} commands {what} of {}: {reason}{refused}", members.name(*member))
    };
    ChangeLoaded { texts } => "change-loaded" Notice format!(
        "an online change from configuration {} to {} is given to the members", texts.before, texts.after
    );
    CommandRefused(order) => "command-refused" Warning refused_text(order);
    Acknowledged(seen) => "acknowledged" Notice format!(
        "{} has acknowledged the alarm {} of {} of cycle {}",
        seen.owner, seen.alarm, seen.name, seen.cycle
    );
    Shelved(shelving) => "shelved" Notice format!(
        "{} shelves the alarm {} for {}: {}",
        shelving.owner, shelving.name, duration(shelving.seconds), shelving.reason
    );
    Unshelved(unshelving) => "unshelved" Notice format!(
        "{} ends the shelving of the alarm {}: {}",
        unshelving.owner, unshelving.name, unshelving.reason
    );
    Attached { member } => "attached" Notice format!("the journal of {} is received", members.name(*member));
    Detached { member, reason } => "detached" Warning
        format!("the journal of {} is not received: {reason}", members.name(*member));
    Ended { member, how, said } => "ended" Alarm {
        let last = said.last().map_or_else(String::new, |line| format!("; {line:.200}"));
        format!("{} ended unexpectedly: {how}{last}", members.name(*member))
    };
    Origin { .. } => "origin" Info "all stations are synchronised: cycles are counted from here";
    ScenarioOver { verdict } => "scenario-over" Notice
        format!("the scenario is over and the cluster stays up; {verdict}");
    Interrupted => "interrupted" Notice "the run was ended early on request";
    Finished => "finished" Info "the run is over";
}

/// The word of a command, and the value that it writes or forces.
fn command_text(command: &Command, member: Member, members: &Members) -> String {
    let word = serde_json::to_value(command).unwrap_or_default();
    let word = word["command"].as_str().unwrap_or("command").to_owned();
    let (place, value) = match command {
        Command::Write(write) => (SignalPlace::Input(write.input), write.value),
        Command::Force(force) => (force.signal, force.value),
        _ => return word,
    };
    format!("{word} {}", assignment(Some(member), place, value, members))
}

fn duration(seconds: u64) -> String {
    understudy_text::duration::text(Duration::from_secs(seconds))
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
        Action::Unplug { network } => format!("{name} is unplugged from {network}"),
        Action::Plug { network } => format!("{name} is plugged into {network} again"),
        Action::Delay { to, by } => format!("{} receives {name} {by:?} later", members.name(to)),
        Action::Release => format!("{name} is released"),
        Action::Write { input, value } => {
            let place = SignalPlace::Input(input);
            let assignment = assignment(Some(member), place, value, members);
            format!("{assignment} is written to {name}")
        }
        Action::Set { input, value } => {
            let place = SignalPlace::Input(input);
            let assignment = assignment(Some(member), place, value, members);
            format!("{assignment} is set at {name}")
        }
        Action::Unset { input } => {
            format!("{} of {name} is the field's again", input_of(member, input, members))
        }
        Action::StickInput { input, value } => {
            let value = u8::from(value);
            format!("the module of {name} shows {value} for {}", input_of(member, input, members))
        }
        Action::FreeInput { input } => {
            let input = input_of(member, input, members);
            format!("the module of {name} shows the true value of {input} again")
        }
        Action::Choose { choice: StateChoice::Cold } => {
            format!("the operator orders a cold start of the program of {name}")
        }
        Action::Choose { .. } => {
            format!(
                "the operator orders the program of {name} to continue from the newest available state"
            )
        }
        other => format!("{} of {name}", other.word()),
    }
}

/// The name of an input of the program of a remote I/O, by its first bit.
fn input_of(member: Member, input: u16, members: &Members) -> &str {
    let program = member.sampled_program();
    let signal = program.and_then(|it| members.signal(it, SignalPlace::Input(input)));
    signal.map_or("an input", |signal| &signal.name)
}
