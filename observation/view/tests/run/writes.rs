//! Writes of operators and signals between programs, in words.

use std::sync::Arc;

use understudy_journal::{Happening, Record};
use understudy_remote_io::Event as RemoteIoEvent;
use understudy_view::{Bounds, Filter, Listing, Model};
use understudy_wire::{Member, Moment, PointValue, ProgramId, Role, Write, WriteId, WriteRefusal};

use crate::support::{records, scenario, shuttles};

const LEFT: Member = Member::RemoteIo(ProgramId(0));

/// Both stations that have the state of the right program are killed, so that its signals become too old.
const STEPS: &str = "title = \"writes\"\ncycles = 120\n\
    [[step]]\nat = 20\naction = \"write\"\nstation = \"left-io\"\ninput = \"start\"\nvalue = true\n\
    [[step]]\nat = 25\naction = \"write\"\nstation = \"left-io\"\ninput = \"speed\"\nvalue = 180.0\n\
    [[step]]\nat = 60\naction = \"crash\"\nstation = \"right\"\n\
    [[step]]\nat = 70\naction = \"crash\"\nstation = \"understudy\"\n";

fn refused() -> Record {
    let write = Write {
        id: WriteId { session: 9, number: 1 },
        input: 64,
        value: PointValue::new(32, u64::from(250.0f32.to_bits())),
        role: Role::Operator,
        owner: "anna".to_owned(),
        reason: "faster".to_owned(),
        points: None,
    };
    Record {
        at_ns: u64::MAX,
        name: "left-io".to_owned(),
        member: Some(LEFT),
        event: Happening::RemoteIo(RemoteIoEvent::WriteRefused {
            moment: Moment::default(),
            write,
            refusal: WriteRefusal::Limits,
        }),
    }
}

#[test]
fn events_of_writes_and_signals_have_names_and_units() {
    let cluster = shuttles();
    let inputs = &cluster.controllers()[0].interface.inputs;
    assert_eq!(inputs.find("speed").map(|speed| speed.bit), Some(64));
    let mut records = records(&cluster, &scenario(&cluster, STEPS), 1);
    records.push(refused());
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let mut listing = Listing::new(&cluster, Filter::default()).expect("no names");
    let mut lines = Vec::new();
    for record in &records {
        model.note(record);
        lines.extend(listing.take(record));
    }
    let texts = |event: &str| -> Vec<String> {
        let events = model.events().filter(|found| found.event == event);
        let texts: Vec<String> = events.map(|event| event.text.clone()).collect();
        let lines = lines.iter().filter(|line| line.event == event);
        let listed: Vec<String> = lines.map(|line| line.text.clone()).collect();
        assert_eq!(texts, listed);
        texts
    };
    assert_eq!(
        texts("written"),
        [
            "scenario writes 1 to input start: step at cycle 20",
            "scenario writes 180.0 mm/s to input speed: step at cycle 25"
        ]
    );
    let effects = texts("write-in-effect");
    assert_eq!(effects.len(), 2, "{effects:?}");
    assert!(effects[0].starts_with("start = 1 of scenario is in effect since cycle "));
    assert!(effects[1].starts_with("speed = 180.0 mm/s of scenario is in effect since cycle "));
    assert_eq!(
        texts("write-refused"),
        [
            "refuses the value 250.0 mm/s of anna for input speed: the value is outside the limits of the setpoint"
        ]
    );
    let faults = texts("fault");
    assert!(faults.contains(&"speed = 180.0 mm/s is written to left-io".to_owned()), "{faults:?}");
    let validity = texts("signal-validity");
    for text in [
        "the signal right.inside is valid at input right_inside",
        "the signal right.inside is too old at input right_inside: the default value is sampled",
    ] {
        assert!(validity.iter().any(|found| found == text), "{validity:?}");
    }
    let snapshot = model.snapshot();
    let left = &snapshot.programs[0];
    assert!(!left.validity.is_empty() && left.validity.values().all(|valid| !valid));
    let right = &snapshot.programs[1];
    assert!(!right.validity.is_empty() && right.validity.values().all(|valid| *valid));
}

#[test]
fn a_cycle_of_the_cluster_is_found_in_the_run() {
    let cluster = shuttles();
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    for record in records(&cluster, &scenario(&cluster, STEPS), 1) {
        model.note(&record);
    }
    let steps = model.history(ProgramId(0)).expect("a program").steps();
    let step = &steps[steps.len() / 2];
    assert_eq!(model.cycle_of(LEFT, step.moment.cycle.0), Some(step.cycle));
    let newest = steps.back().expect("a cycle");
    let next = newest.moment.cycle.0 + 3;
    assert_eq!(model.cycle_of(LEFT, next), Some(newest.cycle + 3));
    let plant = Member::Plant(ProgramId(0));
    assert_eq!(model.cycle_of(plant, next), None);
}
