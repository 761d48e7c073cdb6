//! Online changes: each scan is explained by the program that took it.

use std::fs;
use std::sync::Arc;

use serde_json::Value;
use understudy_cluster::{ChangeTexts, Cluster, read};
use understudy_journal::{
    Command, Happening, Journal, Members, Process, Record, RunEvent, keep_cluster,
};
use understudy_remote_io::Event;
use understudy_simulator::{
    Action, ChangeStep, Fault, Network, Parts, Record as Simulated, Simulation, parts,
};
use understudy_testing::Folder;
use understudy_view::{Bounds, Filter, Listing, Model, Reason, Run, Trouble};
use understudy_wire::{ChangeRequest, Member, Moment, ProgramId, StationId, Time};

const CLUSTER: &str = r#"
[cluster]
name = "changed"
security = "off"

[[controller]]
name = "counter"
ladder = "FILE"

[[remote_io]]
controller = "counter"
trial_cycles = 10
"#;

const BEFORE: &str = "PROGRAM counter
  VAR_INPUT go : BOOL; END_VAR
  VAR_OUTPUT shown : DINT; on : BOOL; END_VAR
  VAR count : INT; begun : BOOL; unused : REAL := 2.5; END_VAR
  count := count + 1;
  IF count = 3 THEN begun := TRUE; END_IF;
  on := begun;
  shown := count;
END_PROGRAM";

/// Its statements have other lines, and its state other slots.
const AFTER: &str = "PROGRAM counter
  VAR_INPUT go : BOOL; END_VAR
  VAR_OUTPUT shown : DINT; on : BOOL; END_VAR
  VAR table : ARRAY[1..40] OF LREAL; count : DINT; begun : BOOL; added : INT := 5; END_VAR
  // In steps of ten.
  table[3] := table[3] + 1.0;
  count := count + 10;
  on := begun AND added = 5;
  shown := count;
END_PROGRAM";

const RUNGS: [&str; 2] = [
    "program counter\ninput go\noutput on = 0\nmemory begun = 0\nrung\n  /go ( S begun )\nrung\n  begun ( on )\n",
    "program counter\ninput go\noutput on = 0\nmemory begun = 0\nmemory other\nrung\n  go ( other )\nrung\n  other ( R begun )\nrung\n  begun /other ( on )\n",
];

const MEMBERS: [Member; 3] =
    [Member::Station(StationId(0)), Member::Station(StationId(1)), Member::RemoteIo(ProgramId(0))];
const COUNTER: ProgramId = ProgramId(0);
/// Stations report their states twice in these.
const CYCLES: u64 = 250;

fn text(file: &str) -> String {
    CLUSTER.replace("FILE", file)
}

fn cluster(file: &str, program: &str) -> Cluster {
    let loaded = read("cluster.toml", &text(file), &mut |_| Ok(program.to_owned()));
    loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
}

/// Prepares in cycle 10, switches in `switch`, and back in `back`.
fn faults(switch: u64, back: Option<u64>) -> Vec<Fault> {
    let at = |at_cycle, member, step| Fault {
        at_cycle,
        phase: 0.3,
        member,
        action: Action::Change { step },
    };
    let remote_io = Member::RemoteIo(COUNTER);
    let prepared = MEMBERS.map(|member| at(10, member, ChangeStep::Prepare));
    let switched = [at(switch, remote_io, ChangeStep::Switch)];
    let back = back.map(|cycle| at(cycle, remote_io, ChangeStep::SwitchBack));
    prepared.into_iter().chain(switched).chain(back).collect()
}

/// The records of a run of a cluster that another program is loaded in.
fn records(file: &str, [before, after]: [&str; 2], faults: &[Fault]) -> (Cluster, Vec<Record>) {
    let [old, new] = [before, after].map(|program| cluster(file, program));
    let texts = ChangeTexts::between(&old, &new).expect("an online change");
    let records = records_of(&old, texts, faults, CYCLES);
    (old, records)
}

/// The records of a run of a cluster that a change is loaded in.
pub(super) fn records_of(
    old: &Cluster,
    texts: ChangeTexts,
    faults: &[Fault],
    cycles: u64,
) -> Vec<Record> {
    let change = texts.load(old).expect("of this cluster");
    let parts = Parts { change: Some(Arc::new(change)), ..parts(old) };
    let mut simulation = Simulation::new(parts, Network::default(), 7);
    faults.iter().for_each(|fault| simulation.schedule(*fault));
    let members = Members::of(old);
    let loaded = RunEvent::ChangeLoaded { texts: Box::new(texts) };
    let mut records = vec![Record::of_run(0, loaded)];
    let mut begun = false;
    simulation
        .run(cycles, 300, &mut |now: Time, cycle, member, record: Simulated<'_>| {
            let happening = match record {
                Simulated::Station(event) => Happening::Station(event.clone()),
                Simulated::RemoteIo(event) => Happening::RemoteIo(event.clone()),
                Simulated::Fault(Fault { member, action, at_cycle, .. })
                    if Process::after(*action).is_some() =>
                {
                    let (action, asked) = (*action, *at_cycle);
                    let done = RunEvent::Fault { action, member: *member, asked };
                    return records.push(Record::of_run(now.0, done));
                }
                _ => return,
            };
            let origin = match (&happening, cycle) {
                (Happening::RemoteIo(Event::Applied { moment, .. }), Some(cycle)) if !begun => {
                    Some(RunEvent::Origin { moment: *moment, cycle })
                }
                _ => None,
            };
            begun |= origin.is_some();
            records.push(Record::of_member(now.0, member, &members, happening));
            records.extend(origin.map(|origin| Record::of_run(now.0, origin)));
        })
        .expect("everybody comes");
    assert_eq!(simulation.violations(), []);
    records
}

pub(super) fn model(cluster: &Cluster, records: &[Record]) -> Model {
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    records.iter().for_each(|record| model.note(record));
    model
}

/// The cycles of the change marks.
fn marks(model: &Model, records: &[Record]) -> Vec<i64> {
    let changed = records.iter().filter_map(|record| match &record.event {
        Happening::RemoteIo(Event::ProgramChanged { moment, .. }) => Some(*moment),
        _ => None,
    });
    let cycle = |moment: Moment| {
        model.cycle_of(Member::RemoteIo(COUNTER), moment.cycle.0).expect("it is remembered")
    };
    changed.map(cycle).collect()
}

/// Each reason with its signal, its cycle, its line and its words.
fn reasons(reason: &Reason) -> Vec<(String, i64, Option<u32>, String)> {
    let own = (reason.signal.clone(), reason.cycle, reason.line, reason.text.clone());
    std::iter::once(own).chain(reason.because.iter().flat_map(reasons)).collect()
}

#[test]
fn every_scan_is_explained_by_the_program_that_took_it() {
    let (cluster, records) = records("counter.st", [BEFORE, AFTER], &faults(60, Some(100)));
    let model = model(&cluster, &records);
    let marks = marks(&model, &records);
    let [switch, back] = marks[..] else { panic!("{marks:?}") };
    for cycle in 20..148 {
        let is_new = (switch..back).contains(&cycle);
        let why = model.why("shown", Some(cycle)).expect("it is explained");
        let reason = why.because.expect("a statement");
        assert_eq!((&reason.value, reason.cycle), (&why.value, cycle));
        assert_eq!(reason.line, Some(if is_new { 9 } else { 8 }), "{cycle}");
        let because = &reason.because[0];
        assert_eq!(because.signal, "count");
        let count = if is_new { "count := count + 10;" } else { "count := count + 1;" };
        assert_eq!(because.statement.as_deref(), Some(count), "{cycle}");
        let (lines, error) = model.text_at(COUNTER, cycle).expect("a text");
        assert_eq!((lines.len(), error.is_none()), (if is_new { 10 } else { 9 }, true), "{cycle}");
        let trace = model.trace(COUNTER, cycle).expect("its scan");
        assert_eq!(trace.fault, None);
        // `begun` is set in the third scan, and only the change knows of it afterwards.
        let why = model.why("on", Some(cycle)).expect("it is explained");
        let reason = why.because.expect("a statement");
        let begun = reasons(&reason).into_iter().find(|(signal, ..)| signal == "begun");
        let (.., text) = begun.expect("it is read");
        let since = if cycle >= back { back } else { switch };
        match cycle >= switch {
            true => assert_eq!(text, format!("unchanged since the online change of cycle {since}")),
            false => assert!(text.starts_with("assigned in cycle"), "{text}"),
        }
    }
    // A variable that only one of them has.
    assert!(model.why("added", Some(switch)).is_ok());
    assert!(model.why("added", Some(switch - 1)).is_err());
    assert!(model.why("added", None).is_err());
    assert!(model.why("unused", None).is_ok());
}

#[test]
fn variables_are_those_of_the_program_that_runs() {
    let (cluster, records) = records("counter.st", [BEFORE, AFTER], &faults(60, None));
    let model = model(&cluster, &records);
    let [switch] = marks(&model, &records)[..] else { panic!("one change") };
    let signals = model.state_signals(COUNTER);
    let wanted = ["table[3]", "begun", "count"];
    let own = wanted.map(|name| signals.iter().find(|it| it.name == name).expect("it is there"));
    let own = own.map(Clone::clone);
    let values = |cycle| model.state_values(COUNTER, cycle, &own).expect("known");
    assert_eq!(values(switch)[..2], [Value::from(1.0), true.into()]);
    let shown = model.why("shown", Some(switch + 20)).expect("known").value;
    assert_eq!(values(switch + 20), [Value::from(21.0), true.into(), shown]);
    // The old program has no table, and its count is of another type.
    assert_eq!(values(switch - 1), [Value::Null, true.into(), Value::Null]);
    // The proofs of a change begin with the newest state of its own old program, and of no other one.
    let hashes =
        [BEFORE, AFTER].map(|text| self::cluster("counter.st", text).controllers()[0].hash);
    let [old, new] = hashes.map(|hash| model.newest_state(COUNTER, hash));
    assert!(old.is_err() && new.is_ok());
}

#[test]
fn rungs_are_those_of_the_program_that_took_the_scan() {
    let (cluster, records) = records("counter.ladder", RUNGS, &faults(60, None));
    let model = model(&cluster, &records);
    let [switch] = marks(&model, &records)[..] else { panic!("one change") };
    for cycle in 20..148 {
        let is_new = cycle >= switch;
        let why = model.why("on", Some(cycle)).expect("it is explained");
        let reason = why.because.expect("a rung");
        assert_eq!(reason.rung, Some(if is_new { 3 } else { 2 }), "{cycle}");
        let evaluation = model.evaluation(COUNTER, cycle).expect("its scan");
        assert_eq!(evaluation.rungs.len(), if is_new { 3 } else { 2 });
    }
    assert!(model.why("other", None).is_ok() && model.why("other", Some(switch - 1)).is_err());
}

/// The fault is one of the new program, in one of its lines; the change is taken back, and what runs then is the old one again.
#[test]
fn a_program_fault_is_one_of_the_program_that_it_stopped() {
    let faulty = AFTER
        .replace("added : INT := 5;", "added : INT := 5; scans : INT; divided : INT;")
        .replace("  shown :=", "  scans := scans + 1;\n  divided := 1 / (5 - scans);\n  shown :=");
    let (cluster, records) = records("counter.st", [BEFORE, &faulty], &faults(60, None));
    let model = model(&cluster, &records);
    let [switch, back] = marks(&model, &records)[..] else { panic!("it is taken back") };
    assert_eq!(back, switch + 5);
    let failed = back - 1;
    let why = model.why("shown", Some(failed)).expect("it is explained");
    let reason = why.because.expect("the fault");
    assert_eq!(reason.statement.as_deref(), Some("divided := 1 / (5 - scans);"));
    let alarm = model.alarms().find(|alarm| alarm.alarm == "program-fault").expect("an alarm");
    assert!(alarm.text.contains("line 10"), "{}", alarm.text);
    let mut listing = Listing::new(&cluster, Filter::default()).expect("a filter");
    let lines: Vec<_> = records.iter().flat_map(|record| listing.take(record)).collect();
    let fault = lines.iter().find(|line| line.event == "program-fault").expect("it is listed");
    assert_eq!(fault.text, alarm.text);
    let why = model.why("shown", Some(back)).expect("it is explained");
    assert_eq!(why.because.expect("a statement").line, Some(8));
}

/// A program that was stopped before the change stays stopped, and its fault is none in the lines of the new one.
#[test]
fn a_fault_of_the_program_before_is_none_of_the_new_one() {
    let faulty = BEFORE.replace("+ 1;", "+ 1 + 0 * (1 / (40 - count));");
    let (cluster, records) = records("counter.st", [&faulty, AFTER], &faults(80, None));
    let model = model(&cluster, &records);
    let [switch] = marks(&model, &records)[..] else { panic!("one change") };
    let before = model.snapshot_at(switch - 1).expect("known");
    let fault = &before.programs[0].fault;
    assert!(fault.as_ref().is_some_and(|text| text.contains("line 5")), "{fault:?}");
    let after = model.snapshot_at(switch + 1).expect("known");
    let fault = &after.programs[0].fault;
    assert!(fault.as_ref().is_none_or(|text| !text.contains("line")), "{fault:?}");
    // What stopped it is told in the words of the old program.
    let why = model.why("shown", Some(switch + 1)).expect("it is explained");
    let reason = why.because.expect("the fault");
    assert_eq!(reason.line, Some(5));
}

/// All processes begin anew within a change: each says where it is in it, also to a view that has not read how the change began.
#[test]
fn a_change_is_shown_after_all_members_were_restarted_within_it() {
    let restarted = [40, 60, 80].into_iter().zip(MEMBERS).flat_map(|(cycle, member)| {
        [(cycle, Action::Crash), (cycle + 5, Action::Restart)].map(|(at_cycle, action)| Fault {
            at_cycle,
            phase: 0.3,
            member,
            action,
        })
    });
    let accepted = Fault {
        at_cycle: 120,
        phase: 0.3,
        member: MEMBERS[0],
        action: Action::Change { step: ChangeStep::Accept },
    };
    let faults: Vec<Fault> =
        faults(30, None).into_iter().chain(restarted).chain([accepted]).collect();
    let (cluster, mut records) = records("counter.st", [BEFORE, AFTER], &faults);
    let check = |records: &[Record]| {
        let model = model(&cluster, records);
        for (cycle, expected) in [
            (110, "prepared: counter, understudy, counter-io"),
            (130, "prepared: understudy, counter-io; accepted: counter"),
        ] {
            let change = model.snapshot_at(cycle).expect("known").change;
            let change = change.unwrap_or_else(|| panic!("{cycle}: it goes on"));
            assert!(change.text().ends_with(expected), "{cycle}: {}", change.text());
            assert_eq!(change.before, cluster.agreement().configuration.to_string());
        }
    };
    check(&records);
    records.retain(|record| !matches!(record.event, Happening::Run(RunEvent::ChangeLoaded { .. })));
    check(&records);
}

/// A viewer that has lost records goes on from a state that a station reports, of the program that was accepted meanwhile.
#[test]
fn a_state_that_is_told_after_the_acceptance_is_one_of_the_new_program() {
    let steps = [(60, ChangeStep::Accept), (70, ChangeStep::Forget)];
    let ended = steps.into_iter().flat_map(|(cycle, step)| {
        let action = Action::Change { step };
        MEMBERS.map(|member| Fault { at_cycle: cycle, phase: 0.3, member, action })
    });
    let faults: Vec<Fault> = faults(30, None).into_iter().chain(ended).collect();
    // The second one has a state of the same size.
    for after in [AFTER, &BEFORE.replace("count + 1;", "count + 10;")] {
        let (cluster, records) = records("counter.st", [BEFORE, after], &faults);
        let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
        for record in &records {
            model.note(record);
            if model.cycle() == Some(80) {
                model.trouble(&Trouble::Gone { count: None });
            }
        }
        let newest = model.cycle().expect("it has cycles");
        let why = model.why("shown", Some(newest)).expect("it is explained");
        let count = &why.because.expect("a statement").because[0];
        assert_eq!(count.statement.as_deref(), Some("count := count + 10;"));
        assert!(model.alarms().all(|alarm| alarm.alarm != "wrong"));
    }
}

/// A view that reads only the end of a long journal knows the program that runs.
#[test]
fn the_program_that_runs_is_known_from_the_middle_of_a_journal() {
    let (cluster, records) = records("counter.st", [BEFORE, AFTER], &faults(60, None));
    let folder = Folder::new("run-changed");
    let source = folder.join("source");
    fs::create_dir_all(&source).expect("a folder");
    fs::write(source.join("counter.st"), BEFORE).expect("written");
    let file = source.join("cluster.toml");
    fs::write(&file, text("counter.st")).expect("written");
    let path = folder.join("run");
    fs::create_dir_all(&path).expect("a folder");
    keep_cluster(&path, &file, &cluster).expect("kept");
    let mut writer = Journal::create(&path.join("journal.jsonl"), 500_000).expect("created");
    records.iter().for_each(|record| writer.write(record));
    assert_eq!(writer.finish().lost, 0);
    let run = Run::open(&path).expect("a run");
    let mut source = run.follow_from(i64::MAX).expect("the journal has it");
    let mut model = run.model(Bounds::default());
    while source.poll(&mut |record| model.note(&record.expect("a record"))) > 0 {}
    assert!(model.read_from().is_some());
    let newest = model.cycle().expect("it has cycles");
    let (lines, _) = model.text_at(COUNTER, newest).expect("a text");
    assert_eq!(lines.len(), 10);
    assert!(model.state_signals(COUNTER).iter().any(|signal| signal.name == "added"));
}

/// Each view shows which members have taken which step, while the change is in progress.
#[test]
fn a_change_in_progress_is_shown_with_the_place_of_each_member() {
    let at = |cycle, member, step| Fault {
        at_cycle: cycle,
        phase: 0.3,
        member,
        action: Action::Change { step },
    };
    let [counter, understudy, remote_io] = MEMBERS;
    let faults = [
        at(10, counter, ChangeStep::Prepare),
        at(20, understudy, ChangeStep::Prepare),
        at(20, remote_io, ChangeStep::Prepare),
        at(30, remote_io, ChangeStep::Switch),
        at(60, remote_io, ChangeStep::Accept),
        at(70, counter, ChangeStep::Accept),
        at(70, understudy, ChangeStep::Accept),
        at(90, counter, ChangeStep::Forget),
        at(100, understudy, ChangeStep::Forget),
        at(100, remote_io, ChangeStep::Forget),
    ];
    let (cluster, mut records) = records("counter.st", [BEFORE, AFTER], &faults);
    // The engineer's step stands before what it does.
    let given = RunEvent::Commanded {
        member: remote_io,
        command: Command::Change { request: ChangeRequest::Prepare { file: "change.json".into() } },
        owner: "anna".to_owned(),
        reason: "an online change".to_owned(),
        refused: None,
    };
    let first = records.iter().position(|record| {
        matches!(record.event, Happening::Station(understudy_node::Event::Configured(_)))
    });
    let first = first.expect("it is prepared");
    let given = Record::of_run(records[first].at_ns, given);
    records.insert(first, given);
    let model = model(&cluster, &records);
    let text = |cycle: i64| {
        let change = model.snapshot_at(cycle).expect("known").change;
        change.map(|change| change.text())
    };
    assert_eq!(text(5), None);
    let begins = |cycle: i64, expected: &str| {
        let text = text(cycle).expect("it goes on");
        assert!(text.starts_with("prepare by anna in cycle 1"), "{text}");
        assert!(text.ends_with(expected), "{cycle}: {text}");
    };
    let (old, new) = ("counter runs the old program; ", "counter runs the new program; ");
    begins(15, &format!("{old}not loaded: understudy, counter-io; prepared: counter"));
    begins(25, &format!("{old}prepared: counter, understudy, counter-io"));
    begins(50, &format!("{new}prepared: counter, understudy, counter-io"));
    begins(65, &format!("{new}prepared: counter, understudy; accepted: counter-io"));
    begins(95, &format!("{new}accepted: understudy, counter-io; ended: counter"));
    assert_eq!(text(110), None);
}
