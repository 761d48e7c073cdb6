//! Events of stations, remote I/Os and plants.

use std::cmp::Ordering;

use understudy_journal::Members;
use understudy_node::Event as StationEvent;
use understudy_plant::Event as PlantEvent;
use understudy_remote_io::{
    AskReason, Event as RemoteIoEvent, ForceEnd, Lacking, LackingReason, OldInputs, PartnerLack,
    ValueFault,
};
use understudy_wire::{
    Configurations, Member, Moment, Part, ProgramSet, SignalPlace, StationId, StationSet, Word,
};

use super::signals::{Names, image_text};
use super::{Words, list, program_name, programs, source_text, stations};
use crate::protection::{asked_because, old_inputs_text};

descriptions! { station: StationEvent, members: Members;
    Published { words, .. } => "published" Info format!("publishes {}", words_text(words, members));
    Holds { program, lineage, .. } => "holds" Info
        format!("holds the state of {} at lineage {lineage}", program_name(*program, members));
    BecameCycleMaster { .. } => "became-cycle-master" Notice "is the cycle master";
    Flagged { station, .. } => "flagged" Warning flagged_text(*station, members);
    Cleared { station, .. } => "cleared" Notice cleared_text(*station, members);
    Joins { wants, .. } => "joins" Notice joins_text(*wants, members);
    Adopted { program, from: None, .. } => "adopted" Notice
        format!("starts {} where its remote I/O starts it", program_name(*program, members));
    Adopted { program, from: Some(from), lineage, .. } => "adopted" Notice {
        let (whose, from) = (program_name(*program, members), name(*from, members));
        format!("has received the state of {whose} from {from}, at lineage {lineage}")
    };
    Synchronised { program, .. } => "synchronised" Notice
        format!("is synchronised with {} and publishes for it", program_name(*program, members));
    DigestDiffers { program, station, .. } => "digest-differs" Warning {
        let (whose, other) = (program_name(*program, members), name(*station, members));
        format!("has a different state of {whose} than {other} after the same inputs")
    };
    Excluded { program, .. } => "excluded" Alarm
        format!("does not publish for {}: its state was found faulty", program_name(*program, members));
    Readmitted { program, .. } => "readmitted" Notice
        format!("is readmitted and requests the state of {}", program_name(*program, members));
    SamplesMissing { program, .. } => "samples-missing" Warning
        format!("receives no samples of {}", members.name(Member::RemoteIo(*program)));
    SamplesReturned { program, .. } => "samples-returned" Notice
        format!("receives samples of {} again", members.name(Member::RemoteIo(*program)));
    Refused { member, theirs, ours } => "refused" Alarm refused_text(*member, theirs, ours, members);
    RefusalEnded { member } => "refusal-ended" Notice refusal_ended_text(*member, members);
    Configured(configurations) => "configured" Notice configured_text(*configurations);
    NotPrepared { program, missing, .. } => "not-prepared" Alarm {
        let whose = program_name(*program, members);
        format!("does not compute {whose} any more: its program has changed to {missing}, which is not loaded here")
    };
    Outvoted { theirs, stations, others } => "outvoted" Alarm outvoted_text(theirs, *stations, *others);
    Stalled { late, .. } => "stalled" Notice format!("host stall: woken {late:.1?} late");
}

descriptions! { remote_io: RemoteIoEvent, members: Names<'_>;
    Sampled { inputs, .. } => "sampled" Info format!("samples {}", members.inputs(inputs));
    Applied { outputs, driven, source, word_of, missing, .. } => "applied" Info {
        let from = source_text(*source, *word_of, *missing, members);
        match driven {
            None => format!("drives {}, {from}", members.outputs(outputs)),
            Some(driven) => format!(
                "drives {}; {from} and without forces: {}", members.outputs(driven), members.outputs(outputs)
            ),
        }
    };
    StartedCold { awaits_release: false, lost: None, .. } => "started-cold" Notice
        "starts its program from the initial state";
    StartedCold { awaits_release: true, lost: None, .. } => "started-cold" Notice
        "starts its program from the initial state; the operator has to release its outputs";
    StartedCold { awaits_release, lost: Some(lost), .. } => "started-cold" Alarm {
        let release = if *awaits_release { "; the operator has to release its outputs" } else { "" };
        format!(
            "STATE LOST: starts its program from the initial state, since no station has the state of its newest applied output (cycle {} of the cluster){release}",
            lost.cycle.0
        )
    };
    StartedWarm { from, retained, lost: Some(0), inputs: None, awaits_release, .. } => "started-warm" Notice
        started_warm_text(members, *from, *retained, (Some(0), None), *awaits_release);
    StartedWarm { from, retained, lost, inputs, awaits_release, .. } => "started-warm" Alarm
        started_warm_text(members, *from, *retained, (*lost, *inputs), *awaits_release);
    AdoptedLineage { lineage, from, .. } => "adopted-lineage" Notice
        format!("continues from the state of {}, at lineage {lineage}", name(*from, members));
    Disputed { stations: who, .. } => "disputed" Alarm format!(
        "{} hold different states of the same cycle: the operator has to decide by releasing its outputs",
        stations(*who, members)
    );
    ConfigurationDisputed { stations, others, .. } => "configuration-disputed" Alarm format!(
        "its program does not start: {others} members of the cluster have another configuration, and only {stations} stations have its own; \
         correct the configuration, or order a cold start"
    );
    StateLost { applied, newest, holder, asks, reason, inputs, .. } => "state-lost" Alarm {
        let newest = newest.zip(*holder).map(|(newest, holder)| (newest, name(holder, members)));
        state_lost_text(*applied, newest, *asks, (*reason, *inputs))
    };
    StateRecovered { from, .. } => "state-recovered" Notice
        match from {
            Some(from) => format!("{} has returned with the state of its program", name(*from, members)),
            None => "the state of its program is there again: no choice is needed".to_owned(),
        };
    ChoiceRefused { refusal, .. } => "choice-refused" Warning format!("refuses the operator's choice: {refusal}");
    Protected { .. } => "protected" Notice
        "its program is protected: the failure of one station would be masked";
    Unprotected { lacking, .. } => "unprotected" Alarm {
        let reasons: Vec<String> = lacking.iter().map(|one| lacking_text(one, members)).collect();
        format!("its program is not protected: {}", reasons.join(", "))
    };
    Voided { samples, lineage, .. } => "voided" Warning format!(
        "{samples} samples that no station received are void; it continues from lineage {lineage}"
    );
    Released { .. } => "released" Notice
        "the operator has released its outputs and the stations that it excluded";
    RecalledExclusion { stations: who, .. } => "recalled-exclusion" Alarm format!(
        "{} remains excluded, as other stations recall, until the operator releases it",
        stations(*who, members)
    );
    Diagnosed { failed, .. } => "diagnosed" Warning format!("diagnoses these channels as failed: {failed}");
    Flagged { station, .. } => "flagged" Warning flagged_text(*station, members);
    Cleared { station, .. } => "cleared" Notice cleared_text(*station, members);
    Syndrome { syndrome, accused, .. } => "syndrome" Warning
        format!("the syndrome is {syndrome}, not 0: one of {} is wrong", stations(*accused, members));
    ValueFault { accused, located, answer, .. } => "value-fault" Alarm
        value_fault_text(*accused, *located, *answer, members);
    DigestDiffers { program, accused, .. } => "digest-differs" Warning {
        let (who, whose) = (stations(*accused, members), program_name(*program, members));
        format!("{who} have different states of {whose} after the same inputs")
    };
    Refused { member, theirs, ours } => "refused" Alarm refused_text(*member, theirs, ours, members);
    RefusalEnded { member } => "refusal-ended" Notice refusal_ended_text(*member, members);
    Configured(configurations) => "configured" Notice configured_text(*configurations);
    ProgramChanged { to, .. } => "program-changed" Notice format!("its program is {to} from this cycle on");
    Points { version } => "points" Info format!("begins with the inputs and outputs of the program {version}");
    PointsChanged { to, .. } => "points-changed" Notice format!("its inputs and outputs are those of the program {to} from this cycle on");
    PointsUnknown { version, .. } => "points-unknown" Alarm format!(
        "it does not have the inputs and outputs of the program {version} that runs: it samples nothing and drives the fail-safe values; give `prepare` again (U0650)"
    );
    ChangeTakenBack { to, .. } => "change-taken-back" Alarm format!(
        "a program fault takes the online change back: its program is {to} again; end the change with `cancel`, or correct the new program and switch again"
    );
    Outvoted { theirs, stations, others } => "outvoted" Alarm outvoted_text(theirs, *stations, *others);
    Stalled { late, .. } => "stalled" Notice format!("host stall: woken {late:.1?} late");
    PartChanged { part: Part::Follower, .. } => "part-changed" Notice
        "follows the other remote I/O of its program: it takes no samples";
    PartChanged { part: Part::TakingOver, .. } => "part-changed" Notice
        "takes over from the other remote I/O of its program: it connects to the field";
    PartChanged { part: Part::Author, .. } => "part-changed" Notice
        "is the author of its program: it samples the inputs and drives the outputs";
    PartnerLost { lack, .. } => "partner-lost" Alarm format!(
        "{}: its own failure would not be masked", partner_lack_text(*lack)
    );
    PartnerReceived { .. } => "partner-received" Notice
        "the other remote I/O of its program can take over again";
    InputsDiffer { input, .. } => "inputs-differ" Alarm format!(
        "the modules of both remote I/Os differ at {}: the value on which they agreed last is sampled",
        members.place(SignalPlace::Input(*input))
    );
    InputExcluded { input, at, .. } => "input-excluded" Alarm format!(
        "the module of {} at {} is excluded until the operator releases it",
        members.place(SignalPlace::Input(*input)), members.name(*at)
    );
    InputsAgree { input, .. } => "inputs-agree" Notice format!(
        "the modules of both remote I/Os agree at {}, or the operator has released them",
        members.place(SignalPlace::Input(*input))
    );
    SecondAuthor { .. } => "second-author" Alarm
        "received the other remote I/O of its program as a second author, and has stopped to drive the outputs";
    Forced { force, .. } => "forced" Alarm members.force(force);
    ForceRefused { force, refusal, .. } => "force-refused" Warning {
        let (signal, value) = (members.place(force.signal), members.value(force.signal, force.value));
        format!("refuses to force {signal} to {value} for {}: {refusal}", force.owner)
    };
    UnforceRefused { signal, refusal, .. } => "unforce-refused" Warning
        format!("refuses to end a force of {}: {refusal}", members.place(*signal));
    Written { write, .. } => "written" Notice {
        let place = SignalPlace::Input(write.input);
        let (input, value) = (members.place(place), members.value(place, write.value));
        format!("{} writes {value} to {input}: {}", write.owner, write.reason)
    };
    WriteInEffect { id, since, .. } => "write-in-effect" Info
        format!("{} is in effect since cycle {} of the cluster", members.write(*id), since.cycle.0);
    WriteRefused { write, refusal, .. } => "write-refused" Warning {
        let place = SignalPlace::Input(write.input);
        let (input, value) = (members.place(place), members.value(place, write.value));
        format!("refuses the value {value} of {} for {input}: {refusal}", write.owner)
    };
    WriteVoid { id, refusal, .. } => "write-void" Warning
        format!("{} is not in effect: {refusal}", members.write(*id));
    SignalValidity { input, valid: true, .. } => "signal-validity" Notice format!(
        "the signal {} is valid at {}", members.source(*input), members.place(SignalPlace::Input(*input))
    );
    SignalValidity { input, valid: false, .. } => "signal-validity" Warning format!(
        "the signal {} is too old at {}: the default value is sampled",
        members.source(*input), members.place(SignalPlace::Input(*input))
    );
    Unforced { signal, by, .. } => "unforced" Notice
        format!("{} is no longer forced: {}", members.place(*signal), force_end_text(*by));
}

descriptions! { plant: PlantEvent, members: Names<'_>;
    Stepped { field, .. } => "stepped" Info
        format!("sensors {}, {} parts finished", members.inputs(&field.sensors), field.finished);
    Refused { member, theirs, ours } => "refused" Alarm refused_text(*member, theirs, ours, members);
    RefusalEnded { member } => "refusal-ended" Notice refusal_ended_text(*member, members);
}

fn name(station: StationId, members: &Members) -> &str {
    members.name(Member::Station(station))
}

fn words_text(words: &[Word], members: &Members) -> String {
    let words = words.iter().map(|word| {
        let mut programs_of_it = word.mask.iter();
        // The word of one program is its outputs; a sum of several has no types.
        let sum = match (programs_of_it.next(), programs_of_it.next()) {
            (Some(only), None) => image_text(&word.sum, members.outputs(only)),
            _ => word.sum.to_string(),
        };
        format!("{} {sum}", programs(word.mask, members))
    });
    list(&words.collect::<Vec<_>>())
}

fn joins_text(wants: ProgramSet, members: &Members) -> String {
    if wants.is_empty() {
        return "listens".to_owned();
    }
    let whose = programs(wants, members);
    format!("listens and requests the state of {whose}")
}

/// How a program starts after a power failure, and what it lost.
fn started_warm_text(
    names: &Names<'_>,
    from: StationId,
    retained: Moment,
    (lost, inputs): (Option<u64>, Option<OldInputs>),
    awaits_release: bool,
) -> String {
    let from = name(from, names);
    let kept = match names.cycles.of_known(retained) {
        Some(cycle) => format!("cycle {cycle}"),
        // It is from before the run.
        None => format!("cycle {} of the cluster", retained.cycle.0),
    };
    let lost = match lost {
        Some(0) => "no cycle with applied outputs is lost, as far as it has noted them".to_owned(),
        Some(1) => "the retentive values of 1 cycle with applied outputs are lost".to_owned(),
        Some(lost) => {
            format!("the retentive values of {lost} cycles with applied outputs are lost")
        }
        None => "it is not known how many cycles with applied outputs are lost".to_owned(),
    };
    let release = if awaits_release { "; the operator has to release its outputs" } else { "" };
    let inputs = inputs.map_or_else(String::new, |inputs| format!("; {}", old_inputs_text(inputs)));
    format!(
        "starts its program warm, with the retentive values of {kept} that {from} has kept; {lost}{inputs}{release}"
    )
}

/// `newest` is the newest available state, with the station that has it.
fn state_lost_text(
    applied: Option<Moment>,
    newest: Option<(Moment, &str)>,
    asks: bool,
    (reason, inputs): (AskReason, Option<OldInputs>),
) -> String {
    let behind = applied.map_or_else(
        || "it is not known whether newer outputs were applied".to_owned(),
        |applied| {
            // Cycles of two starts are no age.
            let start = match newest.map(|(newest, _)| applied.epoch.cmp(&newest.epoch)) {
                Some(Ordering::Less) => " of an earlier start of the cluster",
                Some(Ordering::Greater) => " of a later start of the cluster",
                Some(Ordering::Equal) | None => "",
            };
            format!("outputs of cycle {}{start} were applied", applied.cycle.0)
        },
    );
    let next = match (asks, newest) {
        (true, Some(_)) => {
            "the operator chooses this state (accept-state) or a cold start (cold-start)"
        }
        (true, None) => {
            "a station returns with it, or the operator orders a cold start (cold-start)"
        }
        (false, _) => "the program starts cold, as configured",
    };
    let available = match newest {
        Some((newest, holder)) => format!(
            "the newest available state, of {holder}, is from cycle {} of the cluster, and",
            newest.cycle.0
        ),
        None => "no station has one that can be used, and".to_owned(),
    };
    let lost = match asked_because(reason) {
        None => "the state of its program is lost:".to_owned(),
        Some(reason) => format!("its program does not start by itself: {reason};"),
    };
    let inputs = inputs.map_or_else(String::new, |inputs| {
        format!("; after accept-state {}", old_inputs_text(inputs))
    });
    format!("{lost} {available} {behind}; {next}{inputs}")
}

fn value_fault_text(
    accused: StationSet,
    located: bool,
    reaction: ValueFault,
    members: &Members,
) -> String {
    let who = stations(accused, members);
    if located {
        return format!("{who} is wrong by majority and excluded until the operator releases it");
    }
    // The reaction as the cluster file names it.
    let reaction = match reaction {
        ValueFault::Hold => "hold",
        ValueFault::Alarm => "alarm",
        ValueFault::FailSafe => "fail-safe",
    };
    format!("{who} disagree and no majority exists; configured reaction: {reaction}")
}

fn flagged_text(station: StationId, members: &Members) -> String {
    let name = name(station, members);
    format!("{name} was not received for too long and is flagged: its slot is closed")
}

fn cleared_text(station: StationId, members: &Members) -> String {
    let name = name(station, members);
    format!("{name} is received again, and its slot is open")
}

/// The alarm of a member that has another configuration than the cluster file.
pub(crate) fn odd_configuration_text<H: std::fmt::Display>(
    name: &str,
    theirs: &H,
    right: &H,
) -> String {
    format!(
        "{name} runs configuration {theirs}, and the cluster file is {right}: start it with this cluster file"
    )
}

fn refusal_ended_text(member: Member, members: &Members) -> String {
    format!("{} is no longer received with another configuration", members.name(member))
}

fn configured_text(Configurations { own, prepared }: Configurations) -> String {
    match prepared {
        Some(prepared) => {
            format!("runs configuration {own}, and has loaded {prepared} for an online change")
        }
        None => format!("runs configuration {own}, and has loaded no other one"),
    }
}

fn force_end_text(by: ForceEnd) -> &'static str {
    match by {
        ForceEnd::Time => "its time has elapsed",
        ForceEnd::Operator => "removed by the operator",
        ForceEnd::OnlineChange => "an online change has replaced the inputs and outputs",
        ForceEnd::Handover => "the other remote I/O of its program takes over",
    }
}

fn partner_lack_text(lack: PartnerLack) -> &'static str {
    match lack {
        PartnerLack::Silent => "does not receive the other remote I/O of its program in time",
        PartnerLack::Modules => {
            "the modules of the other remote I/O of its program do not follow its own"
        }
        PartnerLack::Stations => {
            "the other remote I/O of its program receives no station that has the program"
        }
    }
}

fn outvoted_text<H: std::fmt::Display>(theirs: &H, stations: u32, others: u32) -> String {
    format!(
        "ends: {others} stations have configuration {theirs}, and {stations} have its own; start it with the right cluster file"
    )
}

fn refused_text<H: std::fmt::Display>(
    member: Member,
    theirs: &H,
    ours: &H,
    members: &Members,
) -> String {
    let name = members.name(member);
    format!("{name} runs configuration {theirs} instead of {ours}; its frames are dropped")
}

/// Why a station cannot prove the outputs of a program.
fn lacking_text(lacking: &Lacking, members: &Members) -> String {
    let name = name(lacking.station, members);
    match lacking.reason {
        LackingReason::NotReceived => {
            format!("{name} is not received: it or its link has failed")
        }
        LackingReason::Joining => format!("{name} is joining"),
        LackingReason::Behind { stepped } => {
            format!("the state of {name} is too old (cycle {})", stepped.cycle.0)
        }
        LackingReason::Excluded => format!("{name} is excluded"),
        LackingReason::Failed => {
            format!("{name} has failed, and mode `paper` masks one failure only")
        }
    }
}
