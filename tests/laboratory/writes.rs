//! Writes of operators while stations and the remote I/O are killed: each has one effect, or an answer that it had none.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use nix::sys::signal::Signal;
use understudy_journal::{Command, Commander, Done, OperatorAction, Refusal};
use understudy_wire::{Member, ProgramId, Role, StationId, Write, WriteId};

use super::deaths::{Records, is};
use super::shared::{DEADLINE, empty_folder, some_at_a_time};
use super::{no_orphan, running_with, signal};

const CLUSTER: &str = r#"
[cluster]
name = "writes"
period = "50ms"

[[controller]]
name = "counter"
ladder = "counter.st"

[[remote_io]]
controller = "counter"

[remote_io.inputs]
press0 = { operator = "pulse", duration = "50ms" }
press1 = { operator = "pulse", duration = "50ms" }
press2 = { operator = "pulse", duration = "50ms" }
speed = { operator = "setpoint", low = 0.0, high = 10.0 }
"#;

const COUNTER: &str = "
PROGRAM counter
  VAR_INPUT press0 : BOOL; press1 : BOOL; press2 : BOOL; speed : REAL; END_VAR
  VAR_OUTPUT count0 : REAL; count1 : REAL; count2 : REAL; END_VAR
  VAR edge0 : R_TRIG; edge1 : R_TRIG; edge2 : R_TRIG; END_VAR
  edge0(CLK := press0);
  edge1(CLK := press1);
  edge2(CLK := press2);
  IF edge0.Q THEN count0 := count0 + 1.0; END_IF;
  IF edge1.Q THEN count1 := count1 + 1.0; END_IF;
  IF edge2.Q THEN count2 := count2 + 1.0; END_IF;
END_PROGRAM";

const WRITERS: u16 = 3;
const REMOTE_IO: Member = Member::RemoteIo(ProgramId(0));
const MEMBERS: [(Member, &str); 3] = [
    (Member::Station(StationId(0)), "counter"),
    (REMOTE_IO, "counter-io"),
    (Member::Station(StationId(1)), "understudy"),
];

fn act(commander: &Commander, member: Member, command: Command) -> Result<Done, Refusal> {
    commander.act_and_wait(&OperatorAction::Command {
        member,
        command,
        owner: "anna".to_owned(),
        reason: "a test".to_owned(),
    })
}

/// Presses a button until `over`, each time under one identifier until there is an answer. Answers with the presses that are
/// in effect.
fn press(run: &Path, writer: u16, over: &AtomicBool) -> u32 {
    let commander = Commander::of_run(run.to_path_buf());
    let (mut number, mut effects) = (1, 0);
    while !over.load(Ordering::SeqCst) {
        let write = Write {
            id: WriteId { session: 100 + u64::from(writer), number },
            input: writer,
            value: true.into(),
            role: Role::Operator,
            owner: "anna".to_owned(),
            reason: "a test".to_owned(),
            points: None,
        };
        let deadline = Instant::now() + DEADLINE;
        loop {
            let done = act(&commander, REMOTE_IO, Command::Write(write.clone()));
            match done {
                Ok(done) => {
                    assert!(done.cycle.is_some(), "{done:?}");
                    effects += 1;
                    number += 1;
                    break;
                }
                Err(refusal) => {
                    let text = refusal.to_string();
                    // The program does not run, or the write before it is not over: it had no effect. The others are not
                    // known, and asked for again.
                    let again = ["U0645", "U0646", "U0648", "U0551", "U0557", "U0558"];
                    assert!(again.iter().any(|code| text.starts_with(code)), "{text}");
                    assert!(Instant::now() < deadline, "{writer} has no answer: {text}");
                }
            }
        }
    }
    effects
}

#[test]
fn each_press_counts_once_while_every_member_is_killed() {
    let _one = some_at_a_time();
    let out = empty_folder("writes");
    let cluster = out.join("cluster.toml");
    fs::write(&cluster, CLUSTER).expect("written");
    fs::write(out.join("counter.st"), COUNTER).expect("written");
    let arguments = ["lab", cluster.to_str().expect("text"), "--out"];
    let runs = out.join("runs");
    let more = ["--cycles", "100000", "--allow-commands"];
    let (mut child, _errors) = running_with(&arguments, &runs, &more, "synchronised: ");
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let over = AtomicBool::new(false);
    let effects: Vec<u32> = std::thread::scope(|scope| {
        let run = &run;
        let over = &over;
        let writers: Vec<_> =
            (0..WRITERS).map(|writer| scope.spawn(move || press(run, writer, over))).collect();
        let commander = Commander::of_run(run.clone());
        let mut records = Records::of(run);
        for (member, name) in MEMBERS.into_iter().chain(MEMBERS) {
            act(&commander, member, Command::Kill).expect("it is killed");
            act(&commander, member, Command::Restart).expect("it is started");
            records.wait_for("its end", |record| {
                is(record, "laboratory", "fault") && record["event"]["action"] == "crash"
            });
            records.wait_for("its start", |record| is(record, name, "ready"));
            let back = |record: &serde_json::Value| match member {
                REMOTE_IO => is(record, name, "applied") && record["event"]["source"] == "direct",
                _ => {
                    is(record, name, "published")
                        && record["event"]["words"] != serde_json::json!([])
                }
            };
            // Twice: a station that has received one sample only cannot vouch for a remote I/O that restarts right then.
            for _ in 0..2 {
                records.wait_for("its return", back);
            }
            // Presses count while all are there.
            for _ in 0..2 {
                records.wait_for("a press", |record| is(record, "counter-io", "write-in-effect"));
            }
        }
        over.store(true, Ordering::SeqCst);
        let ends = writers.into_iter().map(|writer| writer.join());
        ends.map(|effects| effects.expect("no panic")).collect()
    });
    signal(child.id(), Signal::SIGINT);
    child.wait().expect("it ends");
    no_orphan(&runs);
    let journal = fs::read_to_string(run.join("journal.jsonl")).expect("a journal");
    let applied = journal.lines().rev().find_map(|line| {
        let record: serde_json::Value = serde_json::from_str(line).ok()?;
        let is_true = is(&record, "counter-io", "applied") && record["event"]["missing"].is_null();
        let words = record["event"]["outputs"]["words"].as_array()?;
        let words: Vec<u64> = words.iter().filter_map(serde_json::Value::as_u64).collect();
        is_true.then_some(words)
    });
    let words = applied.expect("outputs");
    let counted: Vec<u32> = (0..usize::from(WRITERS))
        .map(|writer| {
            let stored = (words[writer / 2] >> (32 * (writer % 2))) as u32;
            f32::from_bits(stored) as u32
        })
        .collect();
    assert_eq!(counted, effects, "the program, and the answers");
    // An answer that is lost with its remote I/O takes its writer 10 s; two presses were waited for after each return.
    let waited = 2 * 2 * MEMBERS.len() as u32;
    assert!(effects.iter().sum::<u32>() >= waited, "{effects:?}");
    assert!(effects.iter().all(|effects| *effects > 0), "{effects:?}");
    let summary = fs::read_to_string(run.join("summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["violation_count"], 0, "{summary:#}");
}
