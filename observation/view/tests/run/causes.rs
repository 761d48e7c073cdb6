//! One cause is one alarm: grouping loses no cause, and names every program that a cause concerns.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rand::SeedableRng;
use rand_pcg::{Pcg64, Pcg64Mcg};
use understudy_cluster::Cluster;
use understudy_cycle::Mode;
use understudy_journal::{Happening, Members, Record, RunEvent};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Alarm, AlarmState, Bounds, Model};
use understudy_wire::{Member, ProgramId, StationId};

use crate::complete::delivered;
use crate::past::random_scenario;
use crate::support::{cell, example, model, records, scenario};

const GROUPED: [&str; 2] = ["unprotected", "value-fault"];

/// The alarms as they were before causes were grouped: one for each remote I/O, from its own reports alone.
#[derive(Debug, Default)]
struct Ungrouped {
    /// Programs that are not protected, and programs with a value fault, with the stations that were reported at its beginning.
    lasting: BTreeMap<(&'static str, ProgramId), BTreeSet<StationId>>,
    /// Stations whose process has ended.
    ended: BTreeSet<StationId>,
}

impl Ungrouped {
    fn note(&mut self, record: &Record) {
        match (&record.event, record.member) {
            (Happening::RemoteIo(event), Some(Member::RemoteIo(program))) => match event {
                RemoteIoEvent::Unprotected { lacking, .. } => {
                    let lacking = lacking.iter().map(|one| one.station).collect();
                    self.lasting.entry(("unprotected", program)).or_insert(lacking);
                }
                RemoteIoEvent::Protected { .. } => {
                    self.lasting.remove(&("unprotected", program));
                }
                RemoteIoEvent::ValueFault { accused, .. }
                | RemoteIoEvent::RecalledExclusion { stations: accused, .. } => {
                    let known = self.lasting.entry(("value-fault", program)).or_default();
                    known.extend(accused.iter());
                }
                RemoteIoEvent::Released { .. } => {
                    self.lasting.remove(&("value-fault", program));
                }
                _ => {}
            },
            (Happening::Run(RunEvent::Ended { member: Member::Station(station), .. }), _) => {
                self.ended.insert(*station);
            }
            (Happening::Run(RunEvent::Started { member: Member::Station(station) }), _) => {
                self.ended.remove(station);
            }
            _ => {}
        }
    }
}

/// After every record: each program and station that had an alarm has one, no two alarms have one cause, and no program is named without a cause.
fn nothing_is_lost(cluster: &Cluster, records: &[Record], context: &str) {
    let members = Members::of(cluster);
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let mut ungrouped = Ungrouped::default();
    for record in records {
        model.note(record);
        let before = (ungrouped.lasting.len(), ungrouped.ended.len());
        ungrouped.note(record);
        let is_new = before != (ungrouped.lasting.len(), ungrouped.ended.len());
        let lasting: Vec<&Alarm> = model
            .alarms()
            .filter(|alarm| alarm.over.is_none() && GROUPED.contains(&alarm.alarm))
            .collect();
        let context = format!("{:?} {:?} of {context}", record.name, record.event);
        let subjects: BTreeSet<(&str, &str)> =
            lasting.iter().map(|alarm| (alarm.name.as_str(), alarm.alarm)).collect();
        assert_eq!(subjects.len(), lasting.len(), "two alarms of one cause: {context}");
        let name = |program: ProgramId| members.name(Member::Station(program.controller()));
        let named: BTreeSet<(&str, &str)> = lasting
            .iter()
            .flat_map(|alarm| alarm.programs.iter().map(|name| (alarm.alarm, name.as_str())))
            .collect();
        let expected: BTreeSet<(&str, &str)> =
            ungrouped.lasting.keys().map(|(kind, program)| (*kind, name(*program))).collect();
        assert_eq!(named, expected, "{context}");
        for station in &ungrouped.ended {
            let name = members.name(Member::Station(*station));
            assert!(subjects.contains(&(name, "unprotected")), "{name} ended: {context}");
        }
        // Of a new one every station that was reported has its alarm.
        if let (true, Some(Member::RemoteIo(program))) = (is_new, record.member)
            && let Some(stations) = ungrouped.lasting.get(&("unprotected", program))
            && matches!(record.event, Happening::RemoteIo(RemoteIoEvent::Unprotected { .. }))
        {
            for station in stations {
                let cause = members.name(Member::Station(*station));
                // Several that are silent together are one cause, whose text lists them.
                let silent = |alarm: &&&Alarm| {
                    [&*record.name, "network"].contains(&&*alarm.name) && alarm.text.contains(cause)
                };
                let alarm = lasting.iter().find(|alarm| alarm.name == cause);
                let alarm = alarm.or_else(|| lasting.iter().find(silent));
                let programs = alarm.map_or(&[][..], |alarm| &alarm.programs);
                assert!(programs.iter().any(|known| known == name(program)), "{cause}: {context}");
            }
        }
        for alarm in lasting {
            assert!(!alarm.text.is_empty(), "{alarm:?} {context}");
            assert!(alarm.is_open(), "{alarm:?} {context}");
        }
    }
}

#[test]
fn no_cause_is_lost_by_grouping() {
    for seed in 0..6u64 {
        let text = random_scenario(&mut Pcg64::new(seed.into(), 3));
        for mode in [Mode::Full, Mode::Paper] {
            let cluster = understudy_testing::press_cell(mode);
            let records = records(&cluster, &scenario(&cluster, &text), 1);
            let context = format!("{mode:?}, seed {seed}:\n{text}");
            nothing_is_lost(&cluster, &records, &context);
            let mut chance = Pcg64Mcg::seed_from_u64(seed);
            nothing_is_lost(&cluster, &delivered(&records, &mut chance), &context);
        }
    }
}

fn fault(at: u32, station: &str, action: &str) -> String {
    let (action, to) = action.split_once(' ').unwrap_or((action, ""));
    let to = if to.is_empty() { String::new() } else { format!("to = \"{to}\"\n") };
    format!("[[step]]\nat = {at}\naction = \"{action}\"\nstation = \"{station}\"\n{to}")
}

fn run(cluster: &Cluster, cycles: u32, faults: &[(u32, &str, &str)]) -> Model {
    let faults = faults.iter().map(|(at, station, action)| fault(*at, station, action));
    let text = format!("title = \"causes\"\ncycles = {cycles}\n{}", faults.collect::<String>());
    model(cluster, &scenario(cluster, &text), 1)
}

fn open(model: &Model) -> Vec<String> {
    let open = model.alarms().filter(|alarm| alarm.is_open());
    let text = |alarm: &Alarm| {
        let lasts = if alarm.over.is_none() { "" } else { " (over)" };
        format!("{} {}: {}{lasts}", alarm.name, alarm.alarm, alarm.text)
    };
    open.map(text).collect()
}

/// A cluster, its faults by cycle, and every alarm that is open at the end.
type Case<'a> = (&'a Cluster, &'a [(u32, &'a str, &'a str)], &'a [&'a str]);

#[test]
fn each_cause_is_one_alarm_with_its_effect_first() {
    let cell = cell();
    let steps = example("two-shuttles");
    let table: [Case<'_>; 6] = [
        (&cell, &[], &[]),
        (
            &cell,
            &[(50, "understudy", "crash")],
            &["understudy unprotected: robot, press: not protected, because understudy is killed"],
        ),
        (
            &cell,
            &[(50, "robot", "crash")],
            &["robot unprotected: robot: not protected, because robot is killed"],
        ),
        (
            &cell,
            &[(50, "understudy", "crash"), (100, "understudy", "restart")],
            &[
                "understudy unprotected: robot, press: not protected, because understudy is killed (over)",
            ],
        ),
        // Two causes for one program, of which the first returns.
        (
            &cell,
            &[
                (50, "robot", "crash"),
                (100, "understudy", "cut robot-io"),
                (110, "robot", "restart"),
            ],
            &[
                "robot unprotected: robot: not protected, because robot is killed (over)",
                "robot-io fail-safe: robot: fail-safe outputs, because robot and understudy are not received: \
                 understudy is cut off from robot-io in cycle 100 (over)",
                "understudy unprotected: robot: not protected, because the link understudy → robot-io is broken",
            ],
        ),
        (
            &steps,
            &[(100, "understudy", "crash")],
            &["understudy unprotected: left, right: not protected, because understudy is killed"],
        ),
    ];
    for (cluster, faults, expected) in table {
        let model = run(cluster, 400, faults);
        assert_eq!(open(&model), expected, "{faults:?}");
    }
}

/// An alarm that was acknowledged asks again where its cause concerns a further program, and not where it concerns one less.
#[test]
fn a_longer_list_asks_for_an_acknowledgement_again() {
    let cell = cell();
    let text = "title = \"grows\"\ncycles = 500\n\
                [[step]]\nat = 50\naction = \"cut\"\nstation = \"understudy\"\nto = \"robot-io\"\n\
                [[step]]\nat = 200\naction = \"crash\"\nstation = \"understudy\"\n";
    let mut model = Model::new(Arc::new(cell.clone()), Bounds::default());
    let mut states = Vec::new();
    for record in records(&cell, &scenario(&cell, text), 1) {
        model.note(&record);
        let lasting = model.alarms().find(|alarm| alarm.over.is_none()).cloned();
        let Some(alarm) = lasting else { continue };
        let state = (alarm.programs.clone(), alarm.state());
        if alarm.state() == AlarmState::Unacknowledged && model.cycle() == Some(100) {
            let seen = alarm.acknowledgement("anna".to_owned(), 0);
            model.note(&Record::of_run(record.at_ns, RunEvent::Acknowledged(seen)));
        }
        if states.last() != Some(&state) {
            states.push(state);
        }
    }
    let (one, two) = (vec!["robot".to_owned()], vec!["robot".to_owned(), "press".to_owned()]);
    let expected = [
        (one.clone(), AlarmState::Unacknowledged),
        (one, AlarmState::Acknowledged),
        (two, AlarmState::Unacknowledged),
    ];
    assert_eq!(states, expected);
    // In a cycle of the past the list is that of then.
    let then = model.alarms_at(150).find(|alarm| alarm.over.is_none()).expect("an alarm");
    assert_eq!(then.programs, ["robot"]);
    assert_eq!(then.text, "robot: not protected, because the link understudy → robot-io is broken");
}

/// A station, a remote I/O, and the frames that do not reach it from a cycle on.
fn cuts(at: u32, stations: &[&'static str], remote_ios: &[&str], action: &str) -> String {
    let mut faults = String::new();
    for station in stations {
        for remote_io in remote_ios {
            faults += &fault(at, station, &format!("{action} {remote_io}"));
        }
    }
    faults
}

/// The lasting alarms of lost protection at the end of faults.
fn lasting(faults: &str, cycles: u32) -> Vec<String> {
    let cell = cell();
    let text = format!("title = \"silence\"\ncycles = {cycles}\n{faults}");
    let model = model(&cell, &scenario(&cell, &text), 1);
    let lasting =
        model.alarms().filter(|alarm| alarm.alarm == "unprotected" && alarm.over.is_none());
    lasting.map(|alarm| format!("{}: {}", alarm.name, alarm.text)).collect()
}

#[test]
fn a_dead_network_is_one_alarm_with_its_stations() {
    let all = ["robot", "press", "understudy"];
    let here = [
        "robot-io: robot: not protected, because robot-io receives none of robot, press, understudy: its network has failed",
    ];
    let everywhere = [
        "network: robot, press: not protected, because no remote I/O receives any of robot, press, understudy: the network or these stations have failed",
    ];
    let dead_here = cuts(100, &all, &["robot-io"], "cut");
    let dead = cuts(100, &all, &["robot-io", "press-io"], "cut");
    // From its first report on, and for as long as it lasts.
    for cycles in [110, 130, 400] {
        assert_eq!(lasting(&dead_here, cycles), here, "{cycles}");
        assert_eq!(lasting(&dead, cycles), everywhere, "{cycles}");
    }
    // It was never an alarm of each station, and nothing of it remains.
    for (faults, healed, alarms) in [
        (&dead_here, cuts(300, &all, &["robot-io"], "heal"), 1),
        (&dead, cuts(300, &all, &["robot-io", "press-io"], "heal"), 1),
    ] {
        let cell = cell();
        let text = format!("title = \"silence\"\ncycles = 600\n{faults}{healed}");
        let model = model(&cell, &scenario(&cell, &text), 1);
        let of_protection = model.alarms().filter(|alarm| alarm.alarm == "unprotected");
        let raised: Vec<&Alarm> = of_protection.filter(|alarm| alarm.cycle < 300).collect();
        assert_eq!(raised.len(), alarms, "{raised:#?}");
        assert_eq!(lasting(&format!("{faults}{healed}"), 600), [""; 0]);
    }
}

#[test]
fn what_is_known_of_a_station_is_a_cause_of_its_own() {
    let all = ["robot", "press", "understudy"];
    // A station that is killed first is its own cause; the others that are silent then are the network.
    let faults = fault(60, "robot", "crash") + &cuts(200, &all, &["robot-io"], "cut");
    assert_eq!(
        lasting(&faults, 400),
        [
            "robot: robot: not protected, because robot is killed",
            "robot-io: robot: not protected, because robot-io receives none of press, understudy: its network has failed",
        ]
    );
    // All are killed: no network has failed.
    let killed: String = all.map(|name| fault(100, name, "crash")).concat();
    let names: Vec<String> = lasting(&killed, 400);
    assert_eq!(names.len(), 3, "{names:#?}");
    assert!(names.iter().all(|text| text.ends_with(" is killed")), "{names:#?}");
    // One link that remains: the others are broken links.
    let links = cuts(100, &["robot", "understudy"], &["robot-io"], "cut");
    assert_eq!(
        lasting(&links, 400),
        [
            "robot: robot: not protected, because the link robot → robot-io is broken",
            "understudy: robot: not protected, because the link understudy → robot-io is broken",
        ]
    );
    // The network returns for a part of the stations.
    let part =
        cuts(100, &all, &["robot-io"], "cut") + &cuts(250, &["press"], &["robot-io"], "heal");
    assert_eq!(lasting(&part, 500), lasting(&links, 500));
}
