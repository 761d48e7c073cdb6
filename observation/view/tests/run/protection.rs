//! Protection as the remote I/O reports it, and what is left of a state that is lost.

use std::sync::Arc;

use understudy_cluster::Cluster;
use understudy_journal::{Happening, Record, RunEvent};
use understudy_node::Event as StationEvent;
use understudy_remote_io::{AskReason, Event as RemoteIoEvent};
use understudy_view::{
    Alarm, Bounds, LostState, Model, Protection, RemoteIoState, Snapshot, StationState,
};
use understudy_wire::{Cycle, Member, Moment, ProgramId, StationId};

use crate::complete::without_remote_io;
use crate::support::{cell, example, model, records, scenario};

const LOST_STATE: &str = include_str!("../../../../examples/press-cell/lost-state.toml");

/// What was known of the robot's program whenever this changed, with the open alarms of its remote I/O.
fn changes(cluster: Cluster, records: &[Record]) -> Vec<String> {
    let mut model = Model::new(Arc::new(cluster), Bounds::default());
    let mut told: Vec<String> = Vec::new();
    for record in records {
        model.note(record);
        if !model.has_origin() {
            continue;
        }
        let robot = &model.snapshot().programs[0];
        let protection = robot.protection.as_ref().map(Protection::text);
        let lost = robot.lost.as_ref().map(LostState::text);
        let alarms = model.alarms().filter(|alarm| {
            let of_protection = ["unprotected", "state-lost"].contains(&alarm.alarm);
            of_protection && alarm.over.is_none() && alarm.programs == ["robot"]
        });
        let alarms: Vec<String> =
            alarms.map(|alarm| format!("{} of {}", alarm.alarm, alarm.name)).collect();
        let text = format!("{protection:?} {lost:?} {alarms:?}");
        if told.last().is_none_or(|last| !last.ends_with(&text)) {
            told.push(format!("{}: {text}", model.cycle().expect("a cycle")));
        }
    }
    told
}

/// The understudy is cut off from the robot, its remote I/O and the press; then the robot is killed; then the operator chooses.
#[test]
fn a_loss_of_protection_and_of_a_state_are_alarms_with_their_causes() {
    let cell = cell();
    let records = records(&cell, &scenario(&cell, LOST_STATE), 1);
    insta::assert_snapshot!("protection", changes(cell, &records).join("\n"));
}

/// A program goes back to an older state, because a person has chosen it: that is no fault.
#[test]
fn a_state_that_a_person_has_chosen_is_not_wrong() {
    let cell = cell();
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    let records = records(&cell, &scenario(&cell, LOST_STATE), 1);
    records.iter().for_each(|record| model.note(record));
    let wrong: Vec<_> = model.events().filter(|event| event.event == "wrong").collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    assert!(lost(&model).is_none(), "the program continues");
}

/// The empty slot of a spare is no cause and no alarm; while the spare is awake, the program is protected, and not when the understudy fails too.
#[test]
fn a_spare_that_is_awake_protects_and_one_that_is_away_is_no_alarm() {
    let cell = example("shared-spare/line-1");
    let second = include_str!("../../../../examples/shared-spare/line-1/second-failure.toml");
    let records = records(&cell, &scenario(&cell, second), 1);
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    let of_the_spare: Vec<&Alarm> = model.alarms().filter(|it| it.name == "spare").collect();
    assert!(of_the_spare.is_empty(), "{of_the_spare:?}");
    let spare = &model.snapshot().stations[3];
    assert_eq!((spare.state, spare.flagged), (StationState::Standby, false));
    insta::assert_snapshot!("spare", changes(cell, &records).join("\n"));
}

fn lost(model: &Model) -> Option<LostState> {
    model.snapshot().programs[0].lost.clone()
}

fn protection(model: &Model) -> Option<Protection> {
    model.snapshot().programs[0].protection.clone()
}

/// A remote I/O that is killed reports nothing: neither the lamp nor the question stays as it was.
#[test]
fn of_a_dead_remote_io_nothing_is_known() {
    let cell = cell();
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    for record in records(&cell, &scenario(&cell, LOST_STATE), 1) {
        model.note(&record);
        if lost(&model).is_some() {
            break;
        }
    }
    assert!(protection(&model).is_some_and(|of| !of.protected));
    let ended = |member| RunEvent::Ended {
        member,
        how: "signal: 9 (SIGKILL)".to_owned(),
        said: Vec::new(),
    };
    let note = |model: &mut Model, member| {
        let record = Record::of_run(0, ended(member));
        model.note(&record);
    };
    note(&mut model, Member::Station(StationId(2)));
    assert!(lost(&model).is_some(), "another member");
    note(&mut model, Member::RemoteIo(ProgramId(0)));
    assert_eq!(lost(&model), None);
    assert_eq!(protection(&model), None);
}

/// Faults, and the alarms of the given kinds with the cycles in which each was raised and was over. An attached viewer is not told what was done.
fn alarms(faults: &str, cycles: u64, kinds: &[&str], attached: bool) -> Vec<String> {
    let cell = cell();
    let text = format!("title = \"alarms\"\ncycles = {cycles}\n{faults}");
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    let of_fault = |record: &Record| matches!(record.event, Happening::Run(RunEvent::Fault { .. }));
    for record in records(&cell, &scenario(&cell, &text), 1) {
        if !attached || !of_fault(&record) {
            model.note(&record);
        }
    }
    let alarms = model.alarms().filter(|alarm| kinds.contains(&alarm.alarm));
    alarms
        .map(|alarm| {
            let over = alarm.over.map_or("lasts".to_owned(), |over| format!("over in {over}"));
            format!("{} {} in {}, {over}: {}", alarm.name, alarm.alarm, alarm.cycle, alarm.text)
        })
        .collect()
}

fn fault(at: u64, station: &str, action: &str) -> String {
    format!("[[step]]\nat = {at}\nstation = \"{station}\"\naction = \"{action}\"\n")
}

/// The plant of a remote I/O that is dead or suspended is not driven: an alarm within two seconds, from the stations that live, until it is back.
#[test]
fn a_remote_io_that_sends_no_samples_is_an_alarm() {
    for (ends, begins) in [("crash", "restart"), ("stop", "continue")] {
        let faults = fault(100, "robot-io", ends) + &fault(400, "robot-io", begins);
        let found = alarms(&faults, 600, &["not-driven"], true);
        let [alarm] = &found[..] else {
            panic!("{ends}: {found:?}");
        };
        let cycle = |before: &str| -> u64 {
            let (_, rest) = alarm.split_once(before).expect("a cycle");
            let digits: String = rest.chars().take_while(char::is_ascii_digit).collect();
            digits.parse().expect("a number")
        };
        assert!(alarm.starts_with("robot-io not-driven in "), "{alarm}");
        assert!((101..=300).contains(&cycle("driven in ")), "{alarm}");
        assert!((395..=440).contains(&cycle("over in ")), "{alarm}");
    }
    let station = fault(100, "robot", "crash") + &fault(400, "robot", "restart");
    assert_eq!(alarms(&station, 600, &["not-driven"], true), [""; 0]);
}

/// A member with another configuration is one alarm, however many refuse it, while it is received.
#[test]
fn a_member_with_another_configuration_is_an_alarm_while_it_lasts() {
    let faults = fault(100, "robot", "crash")
        + &fault(110, "robot", "restart-misconfigured")
        + &fault(300, "robot", "crash")
        + &fault(310, "robot", "restart");
    let found = alarms(&faults, 600, &["refused"], false);
    let of_robot: Vec<&String> =
        found.iter().filter(|alarm| alarm.starts_with("robot refused")).collect();
    assert!(matches!(&of_robot[..], [one] if one.contains("over in 3")), "{found:?}");
    assert!(found.iter().all(|alarm| alarm.contains("over in ")), "{found:?}");
    let wrong = fault(100, "robot", "crash")
        + &fault(100, "robot-io", "crash")
        + &fault(110, "robot", "restart-wrong-program")
        + &fault(110, "robot-io", "restart-wrong-program");
    let kinds = ["refused", "configuration-disputed"];
    let found = alarms(&wrong, 600, &kinds, false);
    for expected in ["robot refused", "robot-io refused", "robot-io configuration-disputed"] {
        let is_it = |alarm: &&String| alarm.starts_with(expected) && alarm.contains(", lasts");
        assert!(found.iter().any(|alarm| is_it(&alarm)), "{expected}: {found:#?}");
    }
}

/// What a remote I/O said last is no news: protection is not known, and an explanation says how old it is.
#[test]
fn a_remote_io_that_does_not_report_is_not_taken_at_its_last_word() {
    let cell = cell();
    let text = "title = \"quiet\"\ncycles = 600\n";
    let records = records(&cell, &scenario(&cell, text), 1);
    let (model, shown) = without_remote_io(&records, 100, i64::MAX);
    let mut is_known = 0;
    for (_, snapshot) in &shown {
        let robot = &snapshot.programs[0];
        let reports = snapshot.remote_ios[0].state != RemoteIoState::NotReporting;
        if !reports {
            assert_eq!(robot.protection, None);
            assert_eq!(snapshot.margin.survives, 0);
            assert!(
                snapshot.protection_text(robot).starts_with("not known: robot-io has reported")
            );
        }
        is_known += usize::from(robot.protection.is_some());
    }
    assert!(is_known > 100, "it was known before");
    let snapshot = model.snapshot();
    let age = snapshot.programs[0].silent_cycles.expect("it is silent");
    assert!((480..520).contains(&age), "{age}");
    assert_eq!(snapshot.programs[1].silent_cycles, None);
    assert!(snapshot.programs[1].protection.as_ref().is_some_and(|of| of.protected));
    let of = |signal, cycle| model.why(signal, cycle).expect("it is known");
    let why = of("robot.grip", None);
    assert_eq!(why.age_cycles, Some(age));
    assert!(
        why.to_text(understudy_view::Zone::UTC)
            .contains("NOT THE PRESENT: robot-io has reported nothing for")
    );
    assert_eq!(of("robot.grip", Some(50)).age_cycles, None, "it was asked for");
    assert_eq!(of("press.move_down", None).age_cycles, None);
}

/// The cause of lost outputs is what was done last to a station that would prove them; that a station was started is no cause.
#[test]
fn the_cause_of_lost_outputs_is_the_newest_true_one() {
    let cell = cell();
    let step = |at: u32, action: &str, station: &str| {
        format!("[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n")
    };
    let text = [
        "title = \"causes\"\ncycles = 260\n".to_owned(),
        step(20, "crash", "robot"),
        step(40, "restart", "robot"),
        step(100, "stop", "robot"),
        step(140, "crash", "understudy"),
    ];
    let model = model(&cell, &scenario(&cell, &text.concat()), 1);
    let alarm = model.alarms().find(|alarm| alarm.alarm == "fail-safe").expect("an alarm");
    assert_eq!(alarm.name, "robot-io");
    assert_eq!(
        alarm.text,
        "robot: fail-safe outputs, because robot and understudy are not received: understudy is killed in cycle 140"
    );
    // Suspended by somebody else: nobody knows of it here.
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    for record in records(&cell, &scenario(&cell, &text.concat()), 1) {
        let is_late = model.cycle().is_some_and(|cycle| cycle > 90);
        if is_late && matches!(record.event, Happening::Run(RunEvent::Fault { .. })) {
            continue;
        }
        model.note(&record);
    }
    let alarm = model.alarms().find(|alarm| alarm.alarm == "fail-safe").expect("an alarm");
    assert_eq!(
        alarm.text,
        "robot: fail-safe outputs, because robot and understudy are not received"
    );
}

/// What is shown of the robot's protection and of the stations after each cycle from `from` on, by a viewer that is told of no action.
fn shown(faults: &str, cycles: u64, from: i64) -> Vec<Snapshot> {
    let cell = cell();
    let text = format!("title = \"shown\"\ncycles = {cycles}\n{faults}");
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    let mut shown = Vec::new();
    let mut newest = None;
    for record in records(&cell, &scenario(&cell, &text), 1) {
        if matches!(record.event, Happening::Run(RunEvent::Fault { .. })) {
            continue;
        }
        model.note(&record);
        if model.newest() != newest && model.newest() >= Some(from) && model.has_origin() {
            newest = model.newest();
            shown.push(model.snapshot());
        }
    }
    shown
}

/// A deadline without a cycle receives no station, so no station is shown as publishing, and no link is the cause where no member receives it.
#[test]
fn stations_that_stop_together_are_not_received_and_no_link_is_broken() {
    for subset in 1..8_u8 {
        let names = ["robot", "press", "understudy"];
        let away = names.into_iter().enumerate().filter(|(place, _)| subset >> place & 1 == 1);
        let away: Vec<&str> = away.map(|(_, name)| name).collect();
        let faults = away.iter().map(|name| fault(100, name, "stop")).collect::<String>();
        let shown = shown(&faults, 250, 110);
        assert!(shown.len() > 50, "{away:?}: {} cycles", shown.len());
        for snapshot in shown {
            let context = format!("{away:?} in {:?}", snapshot.cycle);
            for station in &snapshot.stations {
                let is_away = away.contains(&station.name.as_str());
                let publishes = station.state == StationState::Publishing;
                assert_eq!(publishes, !is_away, "{context}: {station:?}");
            }
            for program in &snapshot.programs {
                let protection = program.protection.as_ref().expect("it was reported");
                assert_eq!(
                    protection.lacking.iter().find(|one| one.link.is_some()),
                    None,
                    "{context}"
                );
                let lacking: Vec<&str> =
                    protection.lacking.iter().map(|one| one.station.as_str()).collect();
                let expected = [program.program.as_str(), "understudy"];
                let expected: Vec<&str> =
                    expected.into_iter().filter(|name| away.contains(name)).collect();
                assert_eq!(lacking, expected, "{context}");
            }
            let false_link = |alarm: &&Alarm| alarm.text.contains("is broken");
            assert_eq!(snapshot.alarms.iter().find(false_link), None, "{context}");
        }
    }
}

/// Of two stations that failed the first comes back: it is no cause any more.
#[test]
fn a_station_that_publishes_again_is_no_cause_of_lost_protection() {
    for first in ["robot", "understudy"] {
        let faults = fault(100, "robot", "crash")
            + &fault(100, "understudy", "crash")
            + &fault(200, first, "restart");
        let mut returned = 0;
        for snapshot in shown(&faults, 400, 110) {
            let robot = &snapshot.programs[0];
            let protection = robot.protection.as_ref().expect("it was reported");
            let lacking: Vec<&str> =
                protection.lacking.iter().map(|one| one.station.as_str()).collect();
            let publishes = |name: &str| {
                let mut stations = snapshot.stations.iter();
                stations.any(|of| of.name == name && of.publishes_for.contains(&robot.program))
            };
            for name in ["robot", "understudy"] {
                let context = format!("{first} in {:?}: {}", snapshot.cycle, protection.text());
                assert_eq!(lacking.contains(&name), !publishes(name), "{context}");
            }
            returned += usize::from(publishes(first));
        }
        assert!(returned > 50, "{first} was back in {returned} cycles");
    }
}

/// All stations fail together and come back without a state: a counter of a running plant is 0, and that is an alarm. A first start raises no alarm.
#[test]
fn a_state_that_all_stations_have_lost_is_an_alarm() {
    let kinds = ["started-cold", "state-lost"];
    let faults: Vec<String> = ["robot", "press", "understudy"]
        .into_iter()
        .map(|name| fault(100, name, "crash") + &fault(120, name, "restart"))
        .collect();
    for attached in [false, true] {
        assert_eq!(alarms("", 300, &kinds, attached), [""; 0]);
        let found = alarms(&faults.concat(), 300, &kinds, attached);
        let [robot, press] = &found[..] else { panic!("{found:#?}") };
        for (alarm, name) in [(robot, "robot-io"), (press, "press-io")] {
            assert!(alarm.starts_with(&format!("{name} started-cold in 1")), "{alarm}");
            assert!(
                alarm.contains("STATE LOST: starts its program from the initial state"),
                "{alarm}"
            );
        }
        // A power failure of the whole plant is a first start.
        let all: Vec<String> = ["robot", "press", "understudy", "robot-io", "press-io"]
            .into_iter()
            .map(|name| fault(100, name, "crash") + &fault(120, name, "restart"))
            .collect();
        assert_eq!(alarms(&all.concat(), 300, &kinds, attached), [""; 0]);
    }
    // A person has chosen it.
    let cell = cell();
    let model = model(&cell, &scenario(&cell, LOST_STATE), 1);
    assert_eq!(model.alarms().filter(|alarm| alarm.alarm == "started-cold").count(), 0);
}

/// Without its state a program is not sampled, and its remote I/O passes every deadline: it holds its outputs, and says so itself.
#[test]
fn a_remote_io_that_samples_nothing_is_not_one_that_drives_nothing() {
    let cell = cell();
    let (lost, _) =
        LOST_STATE.split_once("action = \"accept-state\"").expect("the operator chooses");
    let (lost, _) = lost.rsplit_once("[[step]]").expect("a step");
    let text = lost.replacen("cycles = 600", "cycles = 800", 1);
    let records = records(&cell, &scenario(&cell, &text), 1);
    let is_missing = |record: &Record| {
        matches!(record.event, Happening::Station(StationEvent::SamplesMissing { .. }))
    };
    assert!(records.iter().any(is_missing), "no station lacks samples");
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    let found = model.alarms().filter(|alarm| alarm.alarm == "not-driven");
    assert_eq!(found.map(|alarm| &alarm.text).collect::<Vec<_>>(), [""; 0]);
    assert!(model.alarms().any(|alarm| alarm.alarm == "state-lost" && alarm.over.is_none()));
}

/// A program whose understudy was never there since its remote I/O started is not protected, and that is said.
#[test]
fn a_program_that_was_never_protected_is_an_alarm() {
    for restarts in [true, false] {
        let cell = cell();
        let mut faults = fault(50, "understudy", "crash");
        if restarts {
            faults += &(fault(80, "robot-io", "crash") + &fault(100, "robot-io", "restart"));
        }
        let text = format!("title = \"alone\"\ncycles = 800\n{faults}");
        let model = model(&cell, &scenario(&cell, &text), 1);
        let of_robot = protection(&model).expect("it is reported");
        assert!(!of_robot.protected);
        let lacking: Vec<&str> = of_robot.lacking.iter().map(|one| one.text.as_str()).collect();
        assert_eq!(lacking, ["understudy is killed"]);
        let mut alarms = model.alarms().filter(|alarm| alarm.alarm == "unprotected");
        assert!(alarms.any(|alarm| {
            let of_robot = alarm.programs.iter().any(|program| program == "robot");
            of_robot && alarm.name == "understudy" && alarm.over.is_none()
        }));
    }
}

/// A remote I/O and the understudy that fail together leave the controller with the newest state, which no other member can confirm.
#[test]
fn a_state_that_is_as_new_as_all_that_is_known_is_not_called_0_cycles_old() {
    let cluster = cell();
    let short = scenario(&cluster, "title = \"short\"\ncycles = 60\n");
    let records = records(&cluster, &short, 1);
    let applied = records.iter().rev().find_map(|record| match &record.event {
        Happening::RemoteIo(RemoteIoEvent::Applied { moment, .. }) if record.name == "robot-io" => {
            Some((record, *moment))
        }
        _ => None,
    });
    let (last, moment) = applied.expect("a deadline");
    let ago = |cycles| Moment { cycle: Cycle(moment.cycle.0 - cycles), ..moment };
    for (newest, age) in [(ago(0), None), (ago(7), Some(7))] {
        let mut model = model(&cluster, &short, 1);
        let holder = Some(StationId(0));
        let (applied, newest) = (Some(moment), Some(newest));
        let (asks, reason, inputs) = (true, AskReason::Doubt, None);
        let event =
            RemoteIoEvent::StateLost { moment, applied, newest, holder, asks, reason, inputs };
        model.note(&Record { event: Happening::RemoteIo(event), ..last.clone() });
        let alarm = model.alarms().find(|alarm| alarm.alarm == "state-lost").expect("an alarm");
        let doubts =
            alarm.text.ends_with("whether outputs of a newer one were applied is not known");
        assert_eq!(doubts, age.is_none(), "{}", alarm.text);
        let old = age.map(|age| format!(", {age} cycles old, in robot"));
        assert!(alarm.text.contains(old.as_deref().unwrap_or(" of the cluster, in robot")));
    }
}
