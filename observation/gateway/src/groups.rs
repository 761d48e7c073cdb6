//! Signals of other groups: read from the documents of their gateways, and written to the inputs of a run that name them.
//!
//! ```text
//!   group A: journal ─► mirror ──(routers)──► Forwarder ─► WriteGate ─► remote I/O of group B
//! ```
//!
//! Invariant: a value is passed on only while the cycles of its run advance, and while its remote I/O drives outputs that it has proved.
//! It is written when it changes, and again before it ends at the receiver. A value that waited is not written.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::{Map, Value};
use understudy_bus::{Documents, TlsKeys};
use understudy_cluster::{Cluster, GroupSignal};
use understudy_journal::{RequestedValue, WriteRequest};
use understudy_remote_io::OperatorInputKind;
use understudy_typed::Elementary;
use understudy_wire::{Member, ProgramId, Role};

use crate::error::GatewayError;
use crate::runtime;
use crate::writing::WriteGate;

/// Time between two questions for the same document.
const ASK: Duration = Duration::from_millis(200);

/// Time between two attempts to connect.
const RECONNECT: Duration = Duration::from_secs(1);

/// Time between two writes of a number that changes.
const NUMBERS: Duration = Duration::from_secs(1);

/// Time within which the cycles of a run advance.
const STANDS_STILL: Duration = Duration::from_secs(2);

/// Age at which a value that was read is no longer written.
const TOO_OLD: Duration = Duration::from_secs(1);

/// An input that takes a signal of another group.
#[derive(Debug, Clone)]
struct Taken {
    member: Member,
    input: String,
    of: Elementary,
    from: GroupSignal,
    /// Time after which the value is written again.
    again_after: Duration,
}

/// What the document of a run says of it.
#[derive(Debug, Deserialize)]
struct RunDocument {
    run: String,
    cycle: Option<i64>,
}

/// What the document of a program says of it.
#[derive(Debug, Deserialize)]
struct ProgramDocument {
    source: Option<String>,
    outputs: Option<Map<String, Value>>,
    fault: Option<String>,
    awaits_release: bool,
    forced: Vec<String>,
}

impl ProgramDocument {
    /// The value of an output that the remote I/O has proved.
    fn proved(&self, output: &str) -> Option<&Value> {
        let is_proved = matches!(self.source.as_deref(), Some("direct" | "reconstructed"));
        let is_free = self.forced.is_empty() && self.fault.is_none() && !self.awaits_release;
        let value = self.outputs.as_ref()?.get(output)?;
        (is_proved && is_free && !value.is_null()).then_some(value)
    }
}

/// Writes the signals of other groups to the inputs of a run until `ends`; `say` gets what changes.
///
/// # Errors
/// The run has no such input (U0597), or the system refuses a thread.
pub fn forward_signals(
    gate: &WriteGate,
    address: SocketAddr,
    keys: Option<&TlsKeys>,
    ends: &dyn Fn() -> bool,
    say: &mut dyn FnMut(&str),
) -> Result<(), GatewayError> {
    let taken = signals_of(gate.cluster());
    if taken.is_empty() {
        return Err(GatewayError::NoGroupSignals { cluster: gate.cluster().name().to_owned() });
    }
    let runtime = runtime()?;
    let mut forwarder =
        Forwarder { states: vec![State::default(); taken.len()], taken, cycles: BTreeMap::new() };
    while !ends() {
        match Documents::open(address, keys) {
            Ok(documents) => {
                say(&format!("connected to {address}"));
                let mut lost = 0;
                // A router stays; a gateway that ended is called again.
                while !ends() && lost < 10 {
                    let started = Instant::now();
                    let answered = forwarder.turn(&documents, say, &mut |member, request| {
                        let write = gate.check(member, request).map_err(|it| it.to_string())?;
                        let done = runtime.block_on(gate.send(member, write, None));
                        done.map_err(|refusal| refusal.to_string())
                    });
                    lost = if answered { 0 } else { lost + 1 };
                    std::thread::sleep(ASK.saturating_sub(started.elapsed()));
                }
            }
            Err(error) => {
                say(&format!("not connected: {error}"));
                std::thread::sleep(RECONNECT);
            }
        }
    }
    Ok(())
}

/// The inputs of a cluster that take signals of other groups.
fn signals_of(cluster: &Cluster) -> Vec<Taken> {
    let period = cluster.agreement().schedule.period();
    let programs = (0..).map(ProgramId).zip(cluster.remote_ios());
    let inputs = programs.flat_map(|(program, remote_io)| {
        remote_io.inputs.iter().filter_map(move |source| {
            let declaration = source.operator()?;
            let OperatorInputKind::Group { stale_after, .. } = declaration.input.kind else {
                return None;
            };
            Some(Taken {
                member: Member::RemoteIo(program),
                input: source.name.clone(),
                of: declaration.input.place.of,
                from: declaration.group.clone()?,
                again_after: period.saturating_mul(stale_after) / 3,
            })
        })
    });
    inputs.collect()
}

/// What was written to an input last.
#[derive(Debug, Clone, Default)]
struct State {
    written: Option<(Value, Instant)>,
    said: String,
}

struct Forwarder {
    taken: Vec<Taken>,
    states: Vec<State>,
    /// The newest cycle of each group, and since when it is known to advance.
    cycles: BTreeMap<String, (i64, Option<Instant>)>,
}

type Send<'a> = &'a mut dyn FnMut(Member, &WriteRequest<'_>) -> Result<u64, String>;

/// Where documents are asked for.
trait Ask {
    fn document(&self, key: &str) -> Option<String>;
}

impl Ask for Documents {
    fn document(&self, key: &str) -> Option<String> {
        self.ask(key)
    }
}

impl Forwarder {
    /// Asks for all documents once and writes what is due; whether any document was answered.
    fn turn(&mut self, documents: &dyn Ask, say: &mut dyn FnMut(&str), send: Send<'_>) -> bool {
        let mut answered = false;
        let mut advances: BTreeMap<String, bool> = BTreeMap::new();
        let mut programs: BTreeMap<(String, String), (Option<ProgramDocument>, Instant)> =
            BTreeMap::new();
        for place in 0..self.taken.len() {
            let taken = self.taken[place].clone();
            let GroupSignal { group, controller, output } = &taken.from;
            let root = format!("understudy/mirror/{group}");
            if !advances.contains_key(group) {
                let run = documents.document(&format!("{root}/run"));
                answered |= run.is_some();
                let run = run.and_then(|text| serde_json::from_str(&text).ok());
                let advanced = run.is_some_and(|run| self.advances(group, &run));
                advances.insert(group.clone(), advanced);
            }
            let key = (group.clone(), controller.clone());
            let (document, read) = programs.entry(key).or_insert_with(|| {
                let read = Instant::now();
                let text = documents.document(&format!("{root}/programs/{controller}"));
                (text.and_then(|text| serde_json::from_str(&text).ok()), read)
            });
            let value = document.as_ref().and_then(|document| document.proved(output));
            let value = value.filter(|_| advances.get(group) == Some(&true));
            let state = &mut self.states[place];
            let result = match value {
                None => "no proved value".to_owned(),
                Some(value) => {
                    let changes_after = match taken.of {
                        Elementary::Bool => Duration::ZERO,
                        _ => NUMBERS.min(taken.again_after),
                    };
                    let is_due = state.written.as_ref().is_none_or(|(written, at)| {
                        let after = match written == value {
                            true => taken.again_after,
                            false => changes_after,
                        };
                        at.elapsed() >= after
                    });
                    if !is_due || read.elapsed() >= TOO_OLD {
                        continue;
                    }
                    match write(&taken, value, send) {
                        Ok(_) => {
                            state.written = Some((value.clone(), Instant::now()));
                            "passed on".to_owned()
                        }
                        Err(refusal) => refusal,
                    }
                }
            };
            if state.said != result {
                say(&format!("{group}/{controller}.{output}: {result}"));
                state.said = result;
            }
        }
        answered
    }

    /// Whether a run goes on: its cycle became a later one not long ago.
    fn advances(&mut self, group: &str, run: &RunDocument) -> bool {
        let Some(cycle) = run.cycle.filter(|_| run.run == "running") else {
            return false;
        };
        let known = self.cycles.entry(group.to_owned()).or_insert((cycle, None));
        if cycle > known.0 {
            *known = (cycle, Some(Instant::now()));
        } else if cycle < known.0 {
            // Another run begins.
            *known = (cycle, None);
        }
        known.1.is_some_and(|at| at.elapsed() < STANDS_STILL)
    }
}

fn write(taken: &Taken, value: &Value, send: Send<'_>) -> Result<u64, String> {
    let text = value.to_string();
    let stored = match (taken.of.is_time(), value.as_i64()) {
        (true, Some(nanoseconds)) => Some(nanoseconds as u64),
        _ => None,
    };
    let GroupSignal { group, controller, output } = &taken.from;
    let owner: String = format!("group {group}").chars().take(40).collect();
    let reason: String = format!("signal {controller}.{output}").chars().take(80).collect();
    send(
        taken.member,
        &WriteRequest {
            input: &taken.input,
            value: stored.map_or(RequestedValue::Text(&text), RequestedValue::Stored),
            role: Role::Operator,
            owner: &owner,
            reason: &reason,
        },
    )
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Documents by key.
    struct Known(BTreeMap<String, Value>);

    impl Ask for Known {
        fn document(&self, key: &str) -> Option<String> {
            self.0.get(key).map(Value::to_string)
        }
    }

    fn program(source: &str, done: bool) -> Value {
        json!({
            "source": source, "outputs": { "done": done, "level": 2.5 }, "fault": null,
            "awaits_release": false, "forced": [],
        })
    }

    struct Bench {
        known: Known,
        forwarder: Forwarder,
        written: Vec<(String, String)>,
    }

    impl Bench {
        fn new() -> Self {
            let taken = ["done", "level"].map(|output| Taken {
                member: Member::RemoteIo(ProgramId(0)),
                input: format!("their_{output}"),
                of: Elementary::Bool,
                from: GroupSignal {
                    group: "line-1".to_owned(),
                    controller: "press".to_owned(),
                    output: output.to_owned(),
                },
                again_after: Duration::from_secs(3600),
            });
            Self {
                known: Known(BTreeMap::new()),
                forwarder: Forwarder {
                    states: vec![State::default(); taken.len()],
                    taken: taken.to_vec(),
                    cycles: BTreeMap::new(),
                },
                written: Vec::new(),
            }
        }

        /// One turn with a run at `cycle`; answers with what was written.
        fn turn(&mut self, cycle: i64, program: Value) -> Vec<String> {
            let root = "understudy/mirror/line-1";
            let run = json!({ "run": "running", "cycle": cycle });
            self.known.0.insert(format!("{root}/run"), run);
            self.known.0.insert(format!("{root}/programs/press"), program);
            let written = &mut self.written;
            written.clear();
            self.forwarder.turn(&self.known, &mut |_| {}, &mut |_, request| {
                let RequestedValue::Text(text) = request.value else {
                    panic!("a text");
                };
                written.push((request.input.to_owned(), text.to_owned()));
                Ok(7)
            });
            let written = self.written.iter();
            written.map(|(input, value)| format!("{input}={value}")).collect()
        }
    }

    #[test]
    fn a_value_is_passed_on_when_it_changes() {
        let mut bench = Bench::new();
        // One look does not show that the run goes on.
        assert!(bench.turn(10, program("direct", true)).is_empty());
        let both = ["their_done=true", "their_level=2.5"];
        assert_eq!(bench.turn(20, program("direct", true)), both);
        assert!(bench.turn(30, program("direct", true)).is_empty());
        assert_eq!(bench.turn(40, program("reconstructed", false)), ["their_done=false"]);
    }

    #[test]
    fn what_is_not_proved_or_stands_still_is_not_passed_on() {
        let mut bench = Bench::new();
        let _ = bench.turn(10, program("direct", true));
        for (source, cycle) in [("held", 20), ("fail-safe", 30), ("direct", 5)] {
            assert!(bench.turn(cycle, program(source, true)).is_empty(), "{source} {cycle}");
        }
        for (key, value) in [
            ("fault", json!("division by zero")),
            ("awaits_release", json!(true)),
            ("forced", json!(["done = 1"])),
            ("outputs", Value::Null),
        ] {
            let mut changed = program("direct", true);
            changed[key] = value;
            let cycle = bench.forwarder.cycles["line-1"].0 + 10;
            assert!(bench.turn(cycle, changed).is_empty(), "{key}");
        }
        assert_eq!(bench.turn(1_000, program("direct", true)).len(), 2);
    }
}
