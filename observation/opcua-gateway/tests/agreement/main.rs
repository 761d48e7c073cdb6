//! Every viewer shows the same: on random journals the page, `top`, Prometheus, Modbus and OPC UA agree in every fact that they share, and
//! with a naive fold of the records.

#![allow(clippy::disallowed_methods, reason = "the age of a record is not compared")]

mod dice;
mod facts;
mod naive;

use std::sync::Arc;
use std::time::Instant;

use opcua::types::Variant;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use serde_json::{Value, json};
use understudy_cluster::{Cluster, Overrides, Priority, read_with_files};
use understudy_gateway::{BOUNDS, Feed, Metrics, Observation, RegisterMap};
use understudy_opcua_gateway::variables;
use understudy_view::{AlarmState, Bounds, Model, ProcessAlarm, Snapshot, StationState};
use understudy_watch::page_state;

use dice::{Entry, journal};
use facts::Facts;
use naive::Naive;

/// Journals, and the cycles of each.
const JOURNALS: u64 = 60;
const CYCLES: usize = 70;

/// Alarms on an input and on an output.
const ALARMS: &str = r#"
[[alarm]]
signal = "robot.part_present"
name = "no-part"
when = false
on_delay = "20ms"
priority = "medium"
text = "There is no part"

[[alarm]]
signal = "robot.grip"
when = true
off_delay = "30ms"
text = "The gripper is closed"
"#;

fn cell() -> Arc<Cluster> {
    let files = understudy_cluster::press_cell();
    let text = format!("{}{ALARMS}", files[0].text);
    let loaded = read_with_files(&text, files, Overrides::default());
    Arc::new(loaded.cluster.expect("it is right"))
}

fn model(cluster: &Arc<Cluster>, bounds: Bounds, entries: &[Entry]) -> Model {
    let mut model = Model::new(Arc::clone(cluster), bounds);
    entries.iter().for_each(|entry| model.note(&entry.record));
    model
}

#[test]
fn all_viewers_show_the_same() {
    let cluster = cell();
    let mut states = std::collections::BTreeSet::new();
    for seed in 0..JOURNALS {
        let entries = journal(&cluster, seed, CYCLES);
        let mut chance = Pcg64Mcg::seed_from_u64(seed);
        for _ in 0..4 {
            let end = chance.random_range(1..=entries.len());
            let told = &entries[..end];
            states.extend(check(&cluster, told, &mut chance, seed));
        }
    }
    // The dice reach every state of a station; this cell has no slot of a spare.
    let all = StationState::ALL.into_iter().filter(|state| *state != StationState::Standby);
    let all: Vec<&str> = all.map(StationState::word).collect();
    assert_eq!(states.len(), all.len(), "{states:?} of {all:?}");
}

/// What viewers show of some cycles, and of the present; the states of stations that were met.
fn check(
    cluster: &Arc<Cluster>,
    told: &[Entry],
    chance: &mut Pcg64Mcg,
    seed: u64,
) -> Vec<&'static str> {
    let model_of_page = model(cluster, Bounds::default(), told);
    let naive = Naive::new(told);
    assert_eq!(model_of_page.newest(), naive.newest, "seed {seed}");
    let Some(newest) = naive.newest else {
        return Vec::new();
    };
    let mut states = Vec::new();
    for draw in 0..6 {
        let oldest = naive.oldest.min(newest);
        let cycle = match draw {
            0 => newest,
            _ => chance.random_range(oldest..=newest),
        };
        let context = format!("seed {seed}, {} records, cycle {cycle} of {newest}", told.len());
        let snapshot = model_of_page.snapshot_at(cycle).expect("it is remembered");
        let (stations, programs) = (snapshot.stations.len(), snapshot.programs.len());
        let expected = naive.facts(cycle, stations as u8, programs as u8);
        assert_eq!(Facts::of(&snapshot), expected, "{context}");
        check_page(&page_state(&model_of_page, cycle), &snapshot, &context);
        states.extend(snapshot.stations.iter().map(|station| station.state.word()));
    }
    let top = model_of_page.snapshot();
    let context = format!("seed {seed}, {} records, the present", told.len());
    assert_eq!(model_of_page.snapshot_at(newest).as_ref(), Some(&top), "{context}");
    let model_of_gateways = model(cluster, BOUNDS, told);
    let snapshot = model_of_gateways.snapshot();
    assert_eq!(Facts::of(&snapshot), Facts::of(&top), "{context}");
    assert_eq!(snapshot.margin, top.margin, "{context}");
    assert_eq!(snapshot.alarms, top.alarms, "{context}");
    assert_eq!(snapshot.process_alarms, top.process_alarms, "{context}");
    let metrics = Metrics::new(cluster);
    metrics.show(&model_of_gateways, &snapshot);
    check_metrics(&metrics.exposition(), &top, &context);
    check_modbus(cluster, &top, &snapshot, &context);
    let observation = Observation::new(&model_of_gateways, snapshot, Instant::now());
    check_opcua(cluster, &top, &observation, &context);
    states
}

fn check_page(page: &Value, snapshot: &Snapshot, context: &str) {
    assert_eq!(page["cycle"], json!(snapshot.cycle), "{context}");
    assert_eq!(page["cycle_master"], json!(snapshot.cycle_master), "{context}");
    assert_eq!(page["timing"]["stalls"], json!(snapshot.host_stalls), "{context}");
    assert_eq!(page["open_alarms"], json!(snapshot.alarms.len()), "{context}");
    assert_eq!(page["process_alarms"], json!(snapshot.process_alarms), "{context}");
    let survives = &page["redundancy"]["survives"];
    assert_eq!(*survives, json!(snapshot.margin.survives), "{context}");
    let members = page["members"].as_array().expect("members");
    let stations = snapshot.stations.iter();
    let states = stations.map(|station| (&station.name, station.state.word()));
    let remote_ios = snapshot.remote_ios.iter();
    let states = states.chain(remote_ios.map(|own| (&own.name, own.state.word())));
    let plants = snapshot.plants.iter();
    let states = states.chain(plants.map(|plant| (&plant.name, plant.state.word())));
    for (member, (name, state)) in members.iter().zip(states) {
        assert_eq!(member["name"], json!(name), "{context}");
        assert_eq!(member["state"], json!(state), "{context}");
    }
    let programs = page["programs"].as_array().expect("programs");
    for (shown, program) in programs.iter().zip(&snapshot.programs) {
        let source = program.source.unwrap_or("unknown");
        assert_eq!(shown["source"], json!(source), "{context}");
        assert_eq!(shown["word_of"], json!(program.word_of), "{context}");
        assert_eq!(shown["missing"], json!(program.missing), "{context}");
        assert_eq!(shown["inputs"], json!(program.inputs), "{context}");
        assert_eq!(shown["outputs"], json!(program.outputs), "{context}");
        let counts = json!({
            "direct": program.direct,
            "reconstructed": program.reconstructed,
            "held": program.held,
            "fail_safe": program.fail_safe,
        });
        assert_eq!(shown["counts"], counts, "{context}");
        assert_eq!(shown["awaits_release"], json!(program.awaits_release), "{context}");
        let forced = shown["forced"].as_array().map(Vec::len);
        assert_eq!(forced, Some(program.forced.len()), "{context}");
        let protected = program.protection.as_ref().map(|of| of.protected);
        assert_eq!(shown["protection"]["protected"], json!(protected), "{context}");
        assert_eq!(shown["lost"].is_null(), program.lost.is_none(), "{context}");
    }
}

fn is_medium(alarm: &ProcessAlarm, state: AlarmState) -> bool {
    alarm.priority == Priority::Medium && alarm.state == state
}

/// The value of a metric with these labels.
fn metric(exposition: &str, name: &str, labels: &[(&str, &str)]) -> Option<u64> {
    let line = exposition.lines().find(|line| {
        let has = |(label, value): &(&str, &str)| line.contains(&format!("{label}=\"{value}\""));
        line.starts_with(&format!("{name}{{")) && labels.iter().all(has)
    })?;
    line.rsplit_once(' ')?.1.parse().ok()
}

fn check_metrics(exposition: &str, top: &Snapshot, context: &str) {
    let check = |name: &str, labels: &[(&str, &str)], expected: Option<u64>| {
        let found = metric(exposition, &format!("understudy_{name}"), labels);
        assert_eq!(found, expected, "{name} {labels:?}, {context}");
    };
    let cycle = top.cycle.and_then(|cycle| u64::try_from(cycle).ok());
    if cycle.is_some() {
        check("cycle", &[], cycle);
    }
    check("survivable_failures", &[], Some(top.margin.survives.into()));
    check("open_alarms", &[], Some(top.alarms.len() as u64));
    for state in AlarmState::ALL {
        for alarm in &top.process_alarms {
            let labels = [("alarm", alarm.name.as_str()), ("state", state.word())];
            let expected = u64::from(alarm.state == state);
            check("alarm_state", &labels, Some(expected));
        }
        let labels = [("priority", Priority::Medium.word()), ("state", state.word())];
        let alarms = top.process_alarms.iter();
        let count = alarms.filter(|alarm| is_medium(alarm, state)).count();
        check("alarms", &labels, Some(count as u64));
    }
    let stalls = exposition.lines().filter(|line| line.starts_with("understudy_host_stalls_total"));
    let stalls = stalls.filter_map(|line| line.rsplit_once(' ')?.1.parse::<u64>().ok());
    assert_eq!(stalls.sum::<u64>(), top.host_stalls, "{context}");
    for station in &top.stations {
        for state in StationState::ALL {
            let labels = [("station", station.name.as_str()), ("state", state.word())];
            check("station_state", &labels, Some(u64::from(state == station.state)));
        }
    }
    for program in &top.programs {
        let own = ("program", program.program.as_str());
        for (source, count) in [
            ("direct", program.direct),
            ("reconstructed", program.reconstructed),
            ("held", program.held),
            ("fail-safe", program.fail_safe),
        ] {
            check("deadlines_total", &[own, ("source", source)], Some(count));
        }
        let protected = program.protection.as_ref().map(|of| u64::from(of.protected));
        check("protected", &[own], protected);
        check("state_lost", &[own], Some(u64::from(program.lost.is_some())));
        check("awaits_release", &[own], Some(u64::from(program.awaits_release)));
        check("forced_signals", &[own], Some(program.forced.len() as u64));
        check("plant_finished", &[own], program.finished);
        check("plant_faults", &[own], program.plant_faults);
    }
}

fn bits(image: Option<&str>, width: usize) -> Vec<bool> {
    image.map_or_else(|| vec![false; width], |image| image.bytes().map(|bit| bit == b'1').collect())
}

fn check_modbus(cluster: &Cluster, top: &Snapshot, snapshot: &Snapshot, context: &str) {
    let map = RegisterMap::new(cluster).expect("it fits");
    let image = map.image(snapshot, Feed::Live);
    let register = |name: &str| {
        let mut places = map.places().iter();
        let place = places.find(|place| place.name == name).expect(name);
        let first = usize::from(place.address);
        let registers = &image.registers[first..first + usize::from(place.width)];
        let value = registers.iter().fold(0, |value, next| value << 16 | u64::from(*next));
        (value, place.meaning.clone())
    };
    let check = |name: &str, expected: u64| {
        assert_eq!(register(name).0, expected, "{name}, {context}");
    };
    // What the map says that a number means.
    let means = |name: &str, expected: &str| {
        let (value, meaning) = register(name);
        let mut meanings = meaning.split(", ");
        let own = meanings.find_map(|one| one.strip_prefix(&format!("{value} ")));
        assert_eq!(own, Some(expected), "{name}, {context}");
    };
    let cycle = top.cycle.unwrap_or_default().max(0);
    check("run.cycle", cycle as u64);
    means("run.state", top.run.word());
    check("margin.survives", top.margin.survives.into());
    check("alarms.open", top.alarms.len() as u64);
    for station in &top.stations {
        means(&format!("{}.state", station.name), station.state.word());
    }
    let (mut inputs, mut coils) = (Vec::new(), Vec::new());
    for (program, controller) in top.programs.iter().zip(cluster.controllers()) {
        let name = |register: &str| format!("{}.{register}", program.program);
        means(&name("source"), program.source.unwrap_or("not known"));
        check(&name("awaits_release"), program.awaits_release.into());
        check(&name("forced"), program.forced.len() as u64);
        let protection = match (&program.lost, &program.protection) {
            (Some(_), _) => 3,
            (None, None) => 0,
            (None, Some(protection)) => 2 - u64::from(protection.protected),
        };
        check(&name("protection"), protection);
        check(&name("direct"), program.direct);
        check(&name("reconstructed"), program.reconstructed);
        check(&name("held"), program.held);
        check(&name("fail_safe"), program.fail_safe);
        check(&name("finished"), program.finished.unwrap_or_default());
        check(&name("plant_faults"), program.plant_faults.unwrap_or_default());
        let interface = &controller.interface;
        inputs.extend(bits(program.inputs.as_deref(), interface.inputs.width()));
        coils.extend(bits(program.outputs.as_deref(), interface.outputs.width()));
    }
    assert_eq!((image.inputs, image.coils), (inputs, coils), "{context}");
}

fn check_opcua(cluster: &Cluster, top: &Snapshot, observation: &Observation, context: &str) {
    let variables = variables(cluster);
    let value = |path: &str| {
        let found = variables.iter().find(|variable| variable.path() == path);
        found.expect(path).value(observation)
    };
    let check = |path: &str, expected: Option<Variant>| {
        assert_eq!(value(path), expected, "{path}, {context}");
    };
    let text = |text: &str| Some(Variant::from(opcua::types::UAString::from(text)));
    check("Run/Cycle", top.cycle.map(Variant::from));
    check("Run/State", text(top.run.word()));
    check("Margin/Survives", Some(u64::from(top.margin.survives).into()));
    check("Alarms/Open", Some((top.alarms.len() as u64).into()));
    for alarm in &top.process_alarms {
        let path = |name: &str| format!("Alarms/Signals/{}/{name}", alarm.name);
        check(&path("Active"), alarm.active.map(Variant::from));
        check(&path("State"), text(alarm.state.word()));
    }
    for station in &top.stations {
        let path = |name: &str| format!("Stations/{}/{name}", station.name);
        check(&path("State"), text(station.state.word()));
        check(&path("Flagged"), Some(station.flagged.into()));
    }
    for (program, controller) in top.programs.iter().zip(cluster.controllers()) {
        let path = |name: &str| format!("Programs/{}/{name}", program.program);
        check(&path("Source"), program.source.and_then(text));
        check(&path("Since"), program.since.map(Variant::from));
        check(&path("WordOf"), text(program.word_of.as_deref().unwrap_or_default()));
        check(&path("Missing"), text(program.missing.unwrap_or_default()));
        check(&path("Fault"), text(program.fault.as_deref().unwrap_or_default()));
        check(&path("AwaitsRelease"), Some(program.awaits_release.into()));
        let protected = program.protection.as_ref().map(|of| of.protected.into());
        check(&path("Protected"), protected);
        check(&path("StateLost"), Some(program.lost.is_some().into()));
        check(&path("Direct"), Some(program.direct.into()));
        check(&path("Reconstructed"), Some(program.reconstructed.into()));
        check(&path("Held"), Some(program.held.into()));
        check(&path("FailSafe"), Some(program.fail_safe.into()));
        check(&path("Finished"), program.finished.map(Variant::from));
        let outputs = controller.interface.outputs.iter().enumerate();
        for (place, output) in outputs {
            let image = program.outputs.as_deref();
            let bit = image.map(|image| image.as_bytes()[place] == b'1');
            check(&path(&format!("Outputs/{}", output.name)), bit.map(Variant::from));
        }
    }
}
