//! Online changes of points: each cycle is shown by the names, types and places that counted in it.

use std::collections::BTreeMap;
use std::fs;
use std::sync::Arc;

use serde_json::{Value, json};
use understudy_cluster::{ChangeTexts, Cluster, read};
use understudy_journal::{Happening, Journal, Record, RunEvent, keep_cluster};
use understudy_remote_io::Event;
use understudy_simulator::{Action, ChangeStep, Fault};
use understudy_testing::Folder;
use understudy_view::{AlarmState, Bounds, Filter, JournalLine, Listing, Model, Run};
use understudy_wire::{Image, Lineage, Member, PointValue, ProgramId, StationId};

use crate::changed::{model, records_of};

const CLUSTER: &str = r#"
[cluster]
name = "points"
security = "off"

[[controller]]
name = "counter"
ladder = "counter.st"

[[remote_io]]
controller = "counter"
trial_cycles = 10
inputs = { KEYS }

[[alarm]]
name = "many"
signal = "counter.shown"
above = 100
text = "many"
"#;

/// An alarm on a point that the new program does not have.
const ON_DONE: &str = "
[[alarm]]
name = \"done\"
signal = \"counter.done\"
when = true
text = \"done\"
";

const FEW: &str = "PROGRAM counter
  VAR_INPUT go : BOOL; step : INT; END_VAR
  VAR_OUTPUT shown : DINT; done : BOOL; END_VAR
  VAR count : INT; END_VAR
  count := count + step;
  shown := count;
  done := count > 40;
END_PROGRAM";

/// All points have other places; `more` and `alarm` are new, `done` goes.
const MORE: &str = "PROGRAM counter
  VAR_INPUT more : INT; step : INT; go : BOOL; END_VAR
  VAR_OUTPUT alarm : LREAL; shown : DINT; END_VAR
  VAR count : DINT; END_VAR
  count := count + step + more;
  shown := count;
  alarm := DINT_TO_LREAL(count) / 2.0;
END_PROGRAM";

const SETPOINT: &str = "{ operator = \"setpoint\", low = 0, high = 9, initial = INITIAL }";

const COUNTER: ProgramId = ProgramId(0);
const REMOTE_IO: Member = Member::RemoteIo(COUNTER);
const MEMBERS: [Member; 3] =
    [Member::Station(StationId(0)), Member::Station(StationId(1)), REMOTE_IO];
const CYCLES: u64 = 160;

/// The clusters before and after.
fn clusters() -> [Cluster; 2] {
    let setpoint = |initial: &str| SETPOINT.replace("INITIAL", initial);
    let few = format!("step = {}, go = {{ operator = \"level\" }}", setpoint("1"));
    let more = format!("more = {}, {few}", setpoint("5"));
    let of = |program: &str, keys: &str, rest: &str| {
        let text = CLUSTER.replace("KEYS", keys) + rest;
        let loaded = read("cluster.toml", &text, &mut |_| Ok(program.to_owned()));
        loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports))
    };
    [of(FEW, &few, ON_DONE), of(MORE, &more, "")]
}

fn at(at_cycle: u64, member: Member, action: Action) -> Fault {
    Fault { at_cycle, phase: 0.3, member, action }
}

fn step(cycle: u64, step: ChangeStep) -> Fault {
    at(cycle, REMOTE_IO, Action::Change { step })
}

fn prepared() -> Vec<Fault> {
    let prepare = Action::Change { step: ChangeStep::Prepare };
    MEMBERS.map(|member| at(10, member, prepare)).to_vec()
}

/// The switch in cycle 60, and back in 110.
fn there_and_back() -> Vec<Fault> {
    [step(60, ChangeStep::Switch), step(110, ChangeStep::SwitchBack)].into()
}

fn write(cycle: u64, input: u16, value: u64) -> Fault {
    at(cycle, REMOTE_IO, Action::Write { input, value: PointValue::new(16, value) })
}

fn run(faults: Vec<Fault>) -> (Cluster, Vec<Record>) {
    let [old, new] = clusters();
    let texts = ChangeTexts::between(&old, &new).expect("an online change");
    let faults: Vec<Fault> = prepared().into_iter().chain(faults).collect();
    let records = records_of(&old, texts, &faults, CYCLES);
    (old, records)
}

fn bits(image: &Image, first: usize, count: usize) -> u64 {
    (0..count).map(|bit| u64::from(image.get(first + bit)) << bit).sum()
}

/// The values of each cycle by name, from the records alone, with the places written down here: those of the old program and those of the new one.
fn naive(model: &Model, records: &[Record]) -> BTreeMap<i64, (bool, BTreeMap<String, Value>)> {
    let new = clusters()[1].controllers()[0].hash;
    let mut is_new = false;
    let mut values = BTreeMap::new();
    for record in records {
        match &record.event {
            Happening::RemoteIo(Event::PointsChanged { to, .. }) => is_new = *to == new,
            Happening::Run(RunEvent::Fault { action: Action::Restart, .. }) => is_new = false,
            Happening::RemoteIo(Event::Applied {
                moment, sampled: Some(inputs), outputs, ..
            }) => {
                let Some(cycle) = model.cycle_of(REMOTE_IO, moment.cycle.0) else {
                    continue;
                };
                let number = |value: u64| json!(value as u32 as i32);
                let own = if is_new {
                    vec![
                        ("more", number(bits(inputs, 0, 16))),
                        ("step", number(bits(inputs, 16, 16))),
                        ("go", json!(inputs.get(32))),
                        ("alarm", json!(f64::from_bits(bits(outputs, 0, 64)))),
                        ("shown", number(bits(outputs, 64, 32))),
                    ]
                } else {
                    vec![
                        ("go", json!(inputs.get(0))),
                        ("step", number(bits(inputs, 16, 16))),
                        ("shown", number(bits(outputs, 0, 32))),
                        ("done", json!(outputs.get(32))),
                    ]
                };
                let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
                values.insert(cycle, (is_new, own.collect()));
            }
            _ => {}
        }
    }
    values
}

fn of_program(values: &BTreeMap<String, Value>) -> BTreeMap<String, Value> {
    let declared = values.iter().filter(|(name, _)| !name.starts_with("program."));
    declared.map(|(name, value)| (name.clone(), value.clone())).collect()
}

fn lines(cluster: &Cluster, records: &[Record]) -> Vec<JournalLine> {
    let filter = Filter { ordinary: true, ..Filter::default() };
    let mut listing = Listing::new(cluster, filter).expect("a filter");
    records.iter().flat_map(|record| listing.take(record)).collect()
}

#[test]
fn each_cycle_is_shown_by_the_points_that_counted_in_it() {
    let mut faults = there_and_back();
    // `step`, before and after the switch and after the way back; `more`.
    faults.extend([write(30, 16, 2), write(70, 16, 3), write(80, 0, 7), write(130, 16, 4)]);
    let (cluster, records) = run(faults);
    let model = model(&cluster, &records);
    let expected = naive(&model, &records);
    let versions = clusters().map(|cluster| cluster.controllers()[0].clone());
    let [shown, done] =
        ["shown", "done"].map(|name| versions[0].interface.outputs.find(name).expect("a point"));
    let more = versions[1].interface.inputs.find("more").expect("a point");
    let (inputs, outputs) = (model.series().inputs(COUNTER), model.series().outputs(COUNTER));
    let (inputs, outputs) = (inputs.expect("a program"), outputs.expect("a program"));
    let mut are_new = Vec::new();
    for (cycle, (is_new, values)) in expected.range(20..CYCLES as i64 - 2) {
        are_new.push(*is_new);
        let snapshot = model.snapshot_at(*cycle).expect("it is remembered");
        let program = &snapshot.programs[0];
        assert_eq!(of_program(&program.values), *values, "{cycle}");
        let controller = snapshot.points.controller(COUNTER).expect("its points are known");
        assert_eq!(controller.hash, versions[usize::from(*is_new)].hash, "{cycle}");
        let remote_io = snapshot.points.remote_io(COUNTER).expect("its points are known");
        assert_eq!(remote_io.operator_inputs().count(), if *is_new { 3 } else { 2 });
        let why = model.why("shown", Some(*cycle)).expect("it is explained");
        assert_eq!((&why.value, why.scanned), (&values["shown"], None), "{cycle}");
        assert_eq!(why.inputs.get("step"), values.get("step"), "{cycle}");
        assert_eq!(why.inputs.contains_key("more"), *is_new);
        assert_eq!(model.why("alarm", Some(*cycle)).is_ok(), *is_new, "{cycle}");
        assert_eq!(model.why("done", Some(*cycle)).is_ok(), !is_new, "{cycle}");
        let stored = |value: &Value| value.as_i64().map(|value| value as u32 as u64);
        assert_eq!(outputs.stored_at(shown, *cycle), stored(&values["shown"]), "{cycle}");
        assert_eq!(inputs.stored_at(more, *cycle), values.get("more").and_then(stored));
        let is_done = values.get("done").and_then(Value::as_bool).map(u64::from);
        assert_eq!(outputs.stored_at(done, *cycle), is_done, "{cycle}");
        // Alarms go on by name, and end with their points.
        let alarm = |name: &str| {
            let alarm = snapshot.process_alarms.iter().find(|alarm| alarm.name == name);
            alarm.expect("it is declared").active
        };
        let shown = values["shown"].as_i64().expect("a number");
        assert_eq!(alarm("many"), Some(shown > 100), "{cycle}");
        assert_eq!(alarm("done"), Some(is_done == Some(1)), "{cycle}");
    }
    let switches = are_new.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert_eq!((switches, are_new[0]), (2, false));
    // Each name once, from the switch on; the trend of the point that stays has no gap.
    let spans: Vec<_> = outputs.spans(shown, 20, 150).collect();
    assert!(spans.windows(2).all(|pair| pair[0].to == pair[1].from));
    let texts = model.alarms().filter(|alarm| alarm.name == "done" && alarm.over.is_some());
    assert!(texts.count() >= 1, "its alarm ends with its point");
}

#[test]
fn every_line_of_the_journal_has_the_names_of_its_time() {
    let set = |cycle, input, value| {
        at(cycle, REMOTE_IO, Action::Set { input, value: PointValue::new(16, value) })
    };
    let mut faults = there_and_back();
    faults.extend([write(30, 16, 2), set(50, 16, 6), write(80, 0, 7), set(100, 0, 8)]);
    let (cluster, records) = run(faults);
    let model = model(&cluster, &records);
    let lines = lines(&cluster, &records);
    let mut is_new = false;
    let mut sampled = [0, 0];
    for line in &lines {
        is_new ^= line.event == "points-changed";
        let places = match line.event {
            "sampled" => ["go = ", "step = "],
            "applied" => ["shown = ", "shown = "],
            _ => continue,
        };
        sampled[usize::from(is_new)] += 1;
        assert!(places.iter().all(|name| line.text.contains(name)), "{}", line.text);
        let own = if line.event == "sampled" { "more = " } else { "alarm = " };
        assert_eq!(line.text.contains(own), is_new, "{}", line.text);
    }
    assert!(sampled.iter().all(|count| *count > 40), "{sampled:?}");
    let of = |event: &str| -> Vec<&str> {
        let lines = lines.iter().filter(|line| line.event == event);
        lines.map(|line| line.text.as_str()).collect()
    };
    let forced = of("forced");
    assert!(forced[0].contains("step") && forced[1].contains("more"), "{forced:?}");
    // A force ends with the points, in the names of before.
    let unforced = of("unforced");
    assert!(unforced[0].contains("step") && unforced[1].contains("more"), "{unforced:?}");
    let because = "an online change has replaced the inputs and outputs";
    assert!(unforced.iter().all(|text| text.ends_with(because)), "{unforced:?}");
    let written = of("written");
    assert!(
        written[0].contains("2 to input step") && written[1].contains("7 to input more"),
        "{written:?}"
    );
    let in_effect = of("write-in-effect");
    assert!(in_effect[0].contains("step = 2") && in_effect[1].contains("more = 7"));
    // The same in the events of the model, and in the forces of each cycle.
    let event = |name: &str| -> Vec<&str> {
        let events = model.events().filter(|event| event.event == name);
        events.map(|event| event.text.as_str()).collect()
    };
    for name in ["forced", "unforced", "written", "write-in-effect"] {
        assert_eq!(event(name), of(name), "{name}");
    }
    for cycle in 20..CYCLES as i64 - 2 {
        let snapshot = model.snapshot_at(cycle).expect("it is remembered");
        let program = &snapshot.programs[0];
        for (name, forced) in [("step", 6), ("more", 8)] {
            let text = format!("{name} = {forced}");
            let is_forced = program.forced.iter().any(|it| it.starts_with(&text));
            // It is sampled from the next cycle on.
            assert!(is_forced || program.values.get(name) != Some(&forced.into()), "{cycle}");
            assert!(!is_forced || program.values.contains_key(name), "{cycle}");
        }
        assert!(program.forced.len() <= 1, "{:?}", program.forced);
    }
}

/// A viewer whose journal does not contain the new program: nothing of its points is shown by a name, which is said once, until the old one is there again.
#[test]
fn points_that_are_not_known_have_no_names() {
    let (cluster, mut records) = run(there_and_back());
    records.retain(|record| !matches!(record.event, Happening::Run(RunEvent::ChangeLoaded { .. })));
    let known = model(&cluster, &records);
    let mut are_unknown = Vec::new();
    for (cycle, (is_new, values)) in naive(&known, &records).range(20..CYCLES as i64 - 2) {
        let snapshot = known.snapshot_at(*cycle).expect("it is remembered");
        let program = &snapshot.programs[0];
        assert_eq!(program.unknown_points.is_some(), *is_new, "{cycle}");
        assert_eq!(program.inputs.is_none(), *is_new, "{cycle}");
        let shown = if *is_new { BTreeMap::new() } else { values.clone() };
        assert_eq!(of_program(&program.values), shown, "{cycle}");
        assert_eq!(program.source, Some("direct"), "{cycle}");
        assert!(!is_new || known.why("shown", Some(*cycle)).is_err(), "{cycle}");
        let alarm = snapshot.process_alarms.iter().find(|alarm| alarm.name == "many");
        assert_eq!(alarm.and_then(|alarm| alarm.active).is_none(), *is_new, "{cycle}");
        are_unknown.push(*is_new);
    }
    assert!(are_unknown.contains(&true) && are_unknown.last() == Some(&false));
    let said: Vec<_> = known.alarms().filter(|it| it.alarm == "points-not-known").collect();
    assert_eq!(said.len(), 1);
    assert!(said[0].text.starts_with("U0588: "), "{}", said[0].text);
    assert!(said[0].over.is_some() && said[0].state() != AlarmState::Unacknowledged);
    assert!(known.alarms().all(|alarm| alarm.alarm != "wrong"));
    let mut is_new = false;
    for line in lines(&cluster, &records) {
        is_new ^= line.event == "points-changed";
        let has_names = ["shown = ", "done = "].iter().any(|name| line.text.contains(name));
        assert!(!is_new || !has_names, "{}", line.text);
    }
}

/// A remote I/O that has not loaded the points of the program that runs samples nothing: an alarm until it continues.
#[test]
fn a_remote_io_without_the_points_of_its_program_is_an_alarm() {
    let (cluster, records) = run(Vec::new());
    let mut model = model(&cluster, &records);
    let members = model.members().clone();
    let moment = records.iter().rev().find_map(|record| match &record.event {
        Happening::RemoteIo(Event::Applied { moment, .. }) => Some(*moment),
        _ => None,
    });
    let moment = moment.expect("a deadline");
    let version = clusters()[1].controllers()[0].hash;
    let adopted = Event::AdoptedLineage { moment, lineage: Lineage(1), from: StationId(0) };
    let lasts = |model: &Model| -> Vec<bool> {
        let alarms = model.alarms().filter(|alarm| alarm.alarm == "points-unknown");
        alarms.map(|alarm| alarm.over.is_none()).collect()
    };
    for (event, expected) in [(Event::PointsUnknown { moment, version }, true), (adopted, false)] {
        let event = Happening::RemoteIo(event);
        model.note(&Record::of_member(0, REMOTE_IO, &members, event));
        assert_eq!(lasts(&model), [expected]);
    }
}

/// Whoever begins to read after the switch, or in the middle of a change with the new cluster file, shows the points that count.
#[test]
fn a_viewer_that_attaches_shows_the_points_that_count() {
    let (_, records) = run(there_and_back());
    let clusters = clusters();
    let is_applied = |record: &Record| {
        matches!(&record.event, Happening::RemoteIo(Event::Applied { points: Some(_), .. }))
    };
    let all = model(&clusters[0], &records);
    let expected = naive(&all, &records);
    let loaded = &records[0];
    for (first, cluster) in clusters.iter().enumerate() {
        for after in [25, 80, 130] {
            let begins = records.iter().position(|record| match &record.event {
                Happening::RemoteIo(Event::Applied { moment, .. }) => {
                    all.cycle_of(REMOTE_IO, moment.cycle.0) == Some(after)
                }
                _ => false,
            });
            let begins = begins.expect("a deadline");
            assert!(is_applied(&records[begins]));
            for has_texts in [false, true] {
                let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
                if has_texts {
                    model.note(loaded);
                }
                model.note(&Record::of_run(0, RunEvent::Attached { member: REMOTE_IO }));
                let mut checked = [0, 0];
                for record in &records[begins..] {
                    model.note(record);
                    let Happening::RemoteIo(Event::Applied { moment, .. }) = &record.event else {
                        continue;
                    };
                    let cycle = all.cycle_of(REMOTE_IO, moment.cycle.0).expect("it is counted");
                    let Some((is_new, values)) = expected.get(&cycle) else {
                        continue;
                    };
                    let snapshot = model.snapshot();
                    if snapshot.cycle != model.cycle() {
                        continue;
                    }
                    let program = &snapshot.programs[0];
                    let is_known = has_texts || first == usize::from(*is_new);
                    let shown = if is_known { values.clone() } else { BTreeMap::new() };
                    assert_eq!(of_program(&program.values), shown, "{first} {after} {cycle}");
                    checked[usize::from(is_known)] += 1;
                }
                assert!(checked[0] + checked[1] > 10, "{checked:?}");
                assert!(!has_texts || checked[0] == 0, "{checked:?}");
                assert!(model.alarms().all(|alarm| alarm.alarm != "wrong"));
            }
        }
    }
}

/// The journal of a long run is read from near its end, and from a cycle on.
#[test]
fn the_points_that_count_are_known_from_the_middle_of_a_journal() {
    let (cluster, records) = run([step(60, ChangeStep::Switch)].into());
    let folder = Folder::new("run-points");
    let source = folder.join("source");
    fs::create_dir_all(&source).expect("a folder");
    fs::write(source.join("counter.st"), FEW).expect("written");
    let file = source.join("cluster.toml");
    let setpoint = SETPOINT.replace("INITIAL", "1");
    let keys = format!("step = {setpoint}, go = {{ operator = \"level\" }}");
    fs::write(&file, CLUSTER.replace("KEYS", &keys) + ON_DONE).expect("written");
    let path = folder.join("run");
    fs::create_dir_all(&path).expect("a folder");
    keep_cluster(&path, &file, &cluster).expect("kept");
    let mut writer = Journal::create(&path.join("journal.jsonl"), 400_000).expect("created");
    records.iter().for_each(|record| writer.write(record));
    assert_eq!(writer.finish().lost, 0);
    let run = Run::open(&path).expect("a run");
    let expected = naive(&model(&cluster, &records), &records);
    let mut source = run.follow_from(i64::MAX).expect("the journal has it");
    let mut newest = run.model(Bounds::default());
    while source.poll(&mut |record| newest.note(&record.expect("a record"))) > 0 {}
    assert!(newest.read_from().is_some());
    let new = clusters()[1].controllers()[0].hash;
    assert_eq!(run.points().controller(COUNTER).expect("they are known").hash, new);
    let cycle = newest.newest().expect("it has cycles");
    let snapshot = newest.snapshot_at(cycle).expect("it is remembered");
    assert_eq!(of_program(&snapshot.programs[0].values), expected[&cycle].1);
    for cycle in [30, 90, 140] {
        let why = run.why("shown", Some(cycle)).expect("it is explained");
        assert_eq!(why.value, expected[&cycle].1["shown"], "{cycle}");
        let filter =
            Filter { from: Some(cycle), to: Some(cycle), ordinary: true, ..Filter::default() };
        let (mut listing, mut source) = run.listing(filter).expect("a filter");
        let mut lines = Vec::new();
        while source.poll(&mut |record| lines.extend(listing.take(&record.expect("a record")))) > 0
        {
        }
        let sampled = lines.iter().find(|line| line.event == "sampled").expect("its sample");
        assert_eq!(sampled.text.contains("more = "), cycle > 60, "{}", sampled.text);
    }
}

/// A remote I/O that starts again begins with the points of its cluster file, and takes over those of the history.
#[test]
fn a_remote_io_that_starts_again_is_shown_by_its_own_points() {
    for crash in [40, 59, 60, 61, 80] {
        let mut faults = vec![step(60, ChangeStep::Switch), step(70, ChangeStep::Switch)];
        faults.push(at(crash, REMOTE_IO, Action::Crash));
        faults.push(at(crash + 4, REMOTE_IO, Action::Restart));
        let (cluster, records) = run(faults);
        let model = model(&cluster, &records);
        for (cycle, (_, values)) in naive(&model, &records).range(20..CYCLES as i64 - 2) {
            let snapshot = model.snapshot_at(*cycle).expect("it is remembered");
            let program = &snapshot.programs[0];
            assert_eq!(of_program(&program.values), *values, "{crash}: {cycle}");
        }
        // It has loaded the change, and says which points it begins with before it is in a cycle.
        let told: Vec<i64> = model
            .events()
            .filter(|event| event.event == "points-changed")
            .map(|event| event.cycle)
            .collect();
        assert!(told.iter().all(|cycle| *cycle >= crash.min(60) as i64), "{crash}: {told:?}");
        assert!(model.alarms().all(|alarm| alarm.alarm != "wrong"));
    }
}
