//! The run as JSON under keys of Zenoh, at a limited rate. The keys are listed in `docs/reference/zenoh-keys.md`.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::str::FromStr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};
use tokio::runtime::Runtime;
use tokio::sync::Semaphore;
use understudy_bus::Announcer;
use understudy_executable::Interface;
use understudy_typed::Points;
use understudy_view::value_of;
use understudy_view::{ProgramSnapshot, Snapshot};

use crate::error::GatewayError;
use crate::followed::Followed;
use crate::questions;
use crate::writing::{MAXIMUM_WRITES, WriteGate};
use crate::{asked_to_end, runtime};

/// Maximum rate at which each document is published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rate(Duration);

impl FromStr for Rate {
    type Err = String;

    /// `5/s`: 1 to 50 times a second.
    fn from_str(text: &str) -> Result<Self, String> {
        let times = text.strip_suffix("/s").and_then(|times| times.parse().ok());
        match times {
            Some(times @ 1..=50) => Ok(Self(Duration::from_secs(1) / times)),
            _ => Err("expected a rate from `1/s` to `50/s`".to_owned()),
        }
    }
}

/// Publishes the changes of `run` under `understudy/mirror/CLUSTER/...` until SIGINT or SIGTERM, to the clients of `address`; `ready` gets the
/// address when it listens. A late client queries the newest documents. With a `gate`, questions under the key `write` are writes to operator
/// inputs, with the role of an operator.
///
/// # Errors
/// Zenoh does not start there.
pub fn mirror(
    run: &Followed,
    gate: Option<WriteGate>,
    address: SocketAddr,
    rate: Rate,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), GatewayError> {
    let runtime = runtime()?;
    let root = format!("understudy/mirror/{}", run.cluster().name());
    let mut announcer = Announcer::open(address, &root)?;
    if let Some(gate) = gate {
        take_writes(&mut announcer, gate, &runtime)?;
    }
    let end = {
        let _entered = runtime.enter();
        asked_to_end()
    };
    ready(address);
    let mut published: BTreeMap<String, String> = BTreeMap::new();
    runtime.block_on(async {
        tokio::pin!(end);
        loop {
            if let Ok(present) = run.observation() {
                let state = present.state(present.feed(Instant::now()));
                let known = documents(&present.snapshot, state).into_iter();
                // Alarms of the past are not known while it is read.
                let reads_past = present.past_percent.is_some();
                for (key, document) in known.filter(|(key, _)| !reads_past || key != "alarms") {
                    let text = document.to_string();
                    if published.get(&key) != Some(&text) {
                        announcer.say(&key, &text);
                        published.insert(key, text);
                    }
                }
                for event in run.take_events() {
                    announcer.say_once("events", &json!(event).to_string());
                }
            } else if !published.is_empty() {
                // The published documents are stale.
                announcer.forget();
                published.clear();
            }
            tokio::select! {
                () = tokio::time::sleep(rate.0) => {}
                () = &mut end => return,
            }
        }
    });
    Ok(())
}

/// Writes each in a task of its own; as many as fit at once.
fn take_writes(
    announcer: &mut Announcer,
    gate: WriteGate,
    runtime: &Runtime,
) -> Result<(), GatewayError> {
    let gate = Arc::new(gate);
    let handle = runtime.handle().clone();
    let places = Arc::new(Semaphore::new(MAXIMUM_WRITES));
    announcer.take_questions("write", move |question| {
        let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
            return question.answer(&questions::busy().to_string());
        };
        let gate = Arc::clone(&gate);
        handle.spawn(async move {
            let _place = place;
            questions::write(&gate, question).await;
        });
    })?;
    Ok(())
}

/// Each document with the end of its key.
fn documents(snapshot: &Snapshot, state: &str) -> Vec<(String, Value)> {
    let mut documents = vec![
        (
            "run".to_owned(),
            json!({
                "cluster": snapshot.cluster,
                "run": state,
                "cycle": snapshot.cycle,
                "at": snapshot.at,
                "period_us": snapshot.period_us,
                "mode": snapshot.mode,
                "timing": snapshot.timing,
            }),
        ),
        ("stations".to_owned(), json!(snapshot.stations)),
        ("margin".to_owned(), json!(snapshot.margin)),
        ("alarms".to_owned(), json!(snapshot.alarms)),
    ];
    let controllers = snapshot.points.cluster().controllers();
    for (controller, program) in controllers.iter().zip(&snapshot.programs) {
        let document = values(program, &controller.interface);
        documents.push((format!("programs/{}", controller.name), document));
    }
    documents
}

fn values(program: &ProgramSnapshot, interface: &Interface) -> Value {
    json!({
        "source": program.source,
        "inputs": named(&interface.inputs, program.inputs.as_deref()),
        "outputs": named(&interface.outputs, program.outputs.as_deref()),
        "word_of": program.word_of,
        "missing": program.missing,
        "fault": program.fault,
        "awaits_release": program.awaits_release,
        "forced": program.forced,
        "protection": program.protection,
        "silent_cycles": program.silent_cycles,
        "lost": program.lost,
        "deadlines": {
            "direct": program.direct,
            "reconstructed": program.reconstructed,
            "held": program.held,
            "fail_safe": program.fail_safe,
        },
    })
}

/// Signals by name; nothing where no image is known.
fn named(points: &Points, bits: Option<&str>) -> Option<Map<String, Value>> {
    let bits = bits?;
    let signals = points.iter();
    let signals = signals.filter_map(|point| Some((point.name.clone(), value_of(point, bits)?)));
    Some(signals.collect())
}

#[cfg(test)]
mod tests {
    use understudy_cluster::ChangeTexts;
    use understudy_journal::{Happening, Members, Record, RunEvent};
    use understudy_remote_io::Event as RemoteIoEvent;
    use understudy_scenarios::{read, simulate};
    use understudy_testing::points::{self, POINTS};
    use understudy_typed::Elementary;
    use understudy_view::{Bounds, Model};
    use understudy_wire::{Cycle, Epoch, Image, Member, Moment, ProgramId, Source, StationSet};

    use crate::feed::Feed;
    use crate::register_map::{Area, RegisterMap};

    use super::*;

    #[test]
    fn a_rate_is_between_one_and_fifty_a_second() {
        assert_eq!("5/s".parse(), Ok(Rate(Duration::from_millis(200))));
        assert_eq!("50/s".parse(), Ok(Rate(Duration::from_millis(20))));
        for wrong in ["0/s", "51/s", "5", "/s", "-1/s", "5/min", "99999999999/s"] {
            assert!(wrong.parse::<Rate>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn signals_stand_by_their_names() {
        let mut points = Points::default();
        points.push("a", Elementary::Bool, 0);
        points.push("b", Elementary::Sint, 0);
        let found = named(&points, Some("1000000011111111")).map(Value::Object);
        assert_eq!(found, Some(json!({ "a": true, "b": -1 })));
        assert_eq!(named(&points, None), None);
    }

    const FILE: &str = "[cluster]\nname = \"points\"\nsecurity = \"off\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n[[remote_io]]\ncontroller = \"one\"\n";
    const BEFORE: &str = "PROGRAM one VAR_INPUT go : BOOL; step : INT; END_VAR VAR_OUTPUT shown : INT; done : BOOL; END_VAR shown := step; done := go; END_PROGRAM";
    const AFTER: &str = "PROGRAM one VAR_INPUT more : INT; step : INT; END_VAR VAR_OUTPUT alarm : BOOL; shown : INT; END_VAR shown := step + more; END_PROGRAM";

    /// Other inputs and outputs count from the second deadline on: documents have those, and the registers of points that are gone, or have become others, have no
    /// value.
    #[test]
    fn an_online_change_of_points_is_followed() {
        let clusters = [BEFORE, AFTER].map(|program| {
            let read = understudy_cluster::read("c.toml", FILE, &mut |_| Ok(program.to_owned()));
            read.cluster.expect("a cluster")
        });
        let texts = ChangeTexts::between(&clusters[0], &clusters[1]).expect("a change");
        let hashes = [0, 1].map(|side: usize| clusters[side].controllers()[0].hash);
        let members = Members::of(&clusters[0]);
        let moment = |cycle| Moment { epoch: Epoch(1), cycle: Cycle(cycle) };
        let of_remote_io = |event| {
            let event = Happening::RemoteIo(event);
            Record::of_member(0, Member::RemoteIo(ProgramId(0)), &members, event)
        };
        let applied = |cycle, version: usize, values: &[(&str, u64)]| {
            let interface = &clusters[version].controllers()[0].interface;
            let image = |points: &Points| {
                let mut image = Image::zero(points.width());
                for (name, value) in values {
                    points.find(name).into_iter().for_each(|it| it.set(image.words_mut(), *value));
                }
                image
            };
            of_remote_io(RemoteIoEvent::Applied {
                moment: moment(cycle),
                sampled: Some(image(&interface.inputs)),
                outputs: image(&interface.outputs),
                driven: None,
                source: Source::Direct,
                word_of: None,
                missing: None,
                points: Some(hashes[version]),
                heard: StationSet::EMPTY,
            })
        };
        let mut model = Model::new(Arc::new(clusters[0].clone()), Bounds::default());
        model.note(&Record::of_run(0, RunEvent::ChangeLoaded { texts: Box::new(texts) }));
        model.note(&applied(1, 0, &[("go", 1), ("step", 3), ("shown", 3), ("done", 1)]));
        model.note(&Record::of_run(0, RunEvent::Origin { moment: moment(1), cycle: 1 }));
        let map = RegisterMap::new(&clusters[0]).expect("it fits");
        let program = |model: &Model| {
            let documents = documents(&model.snapshot(), "running");
            let (_, program) =
                documents.into_iter().find(|(key, _)| key == "programs/one").expect("one");
            program
        };
        let image = |model: &Model| map.image(&model.snapshot(), Feed::Live);
        let declared = |side: &Value| {
            let side = side.as_object().expect("values").clone().into_iter();
            Value::Object(side.filter(|(name, _)| !name.starts_with("program.")).collect())
        };
        let shown = program(&model);
        assert_eq!(declared(&shown["inputs"]), json!({ "go": true, "step": 3 }));
        assert_eq!(declared(&shown["outputs"]), json!({ "shown": 3, "done": true }));
        assert_eq!(image(&model).unknown, []);
        let [from, to] = hashes;
        model.note(&of_remote_io(RemoteIoEvent::PointsChanged { moment: moment(2), from, to }));
        model.note(&applied(2, 1, &[("more", 4), ("step", 5), ("shown", 9), ("alarm", 1)]));
        let shown = program(&model);
        assert_eq!(declared(&shown["inputs"]), json!({ "more": 4, "step": 5 }));
        assert_eq!(declared(&shown["outputs"]), json!({ "alarm": true, "shown": 9 }));
        let image = image(&model);
        let places = map.places().iter();
        let at = |name: &str| places.clone().find(|place| place.name == name).expect("a place");
        for (name, value) in [("one.step", 5), ("one.shown", 9)] {
            let first = usize::from(at(name).address);
            assert!(image.is_known(Area::Register, &(first..first + 1)), "{name}");
            assert_eq!(image.registers[first], value, "{name}");
        }
        for (name, area) in [("one.go", Area::DiscreteInput), ("one.done", Area::Coil)] {
            let first = usize::from(at(name).address);
            assert!(!image.is_known(area, &(first..first + 1)), "{name}");
        }
    }

    /// Operators write each point of the table.
    #[test]
    fn a_value_is_what_the_author_of_its_point_declared() {
        let cluster = points::cluster();
        let scenario = read("writes.toml", &points::writes(30), Some(&Members::of(&cluster)));
        let scenario = scenario.scenario.expect("right");
        let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
        simulate(&cluster, &scenario, 1, &mut |record| model.note(record)).expect("in step");
        let documents = documents(&model.snapshot(), "finished");
        let (_, program) =
            documents.iter().find(|(key, _)| key == "programs/one").expect("its document");
        for row in &POINTS {
            let expected = match row.of {
                "BOOL" => json!(row.number != 0),
                _ if row.is_text() => json!(row.shown),
                _ => json!(row.number),
            };
            for (side, name) in
                [("inputs", row.name.to_owned()), ("outputs", format!("q{}", row.name))]
            {
                assert_eq!(program[side][&name], expected, "{name}");
            }
        }
    }
}
