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
use understudy_cluster::Cluster;
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
                let known = documents(run.cluster(), &present.snapshot, state).into_iter();
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
fn documents(cluster: &Cluster, snapshot: &Snapshot, state: &str) -> Vec<(String, Value)> {
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
    for (controller, program) in cluster.controllers().iter().zip(&snapshot.programs) {
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
    use understudy_journal::Members;
    use understudy_scenarios::{read, simulate};
    use understudy_testing::points::{self, POINTS};
    use understudy_typed::Elementary;
    use understudy_view::{Bounds, Model};

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

    /// Operators write each point of the table.
    #[test]
    fn a_value_is_what_the_author_of_its_point_declared() {
        let cluster = points::cluster();
        let scenario = read("writes.toml", &points::writes(30), Some(&Members::of(&cluster)));
        let scenario = scenario.scenario.expect("right");
        let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
        simulate(&cluster, &scenario, 1, &mut |record| model.note(record)).expect("in step");
        let documents = documents(&cluster, &model.snapshot(), "finished");
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
