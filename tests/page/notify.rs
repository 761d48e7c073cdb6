//! The command of `[notify]`: what it is told of a live laboratory, and what a command that fails or hangs does to the others: nothing.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::sys::signal::kill;
use nix::unistd::Pid;
use serde_json::{Value, json};

use crate::shared::DEADLINE;
use crate::{Page, answer, empty_folder, one_at_a_time, understudy};

/// The press cell with more in its cluster file.
fn cell(folder: &Path, more: &str) -> PathBuf {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/press-cell");
    for name in ["robot.ladder", "press.ladder"] {
        fs::copy(example.join(name), folder.join(name)).expect("an example");
    }
    let text = fs::read_to_string(example.join("cluster.toml")).expect("an example");
    let cluster = folder.join("cluster.toml");
    fs::write(&cluster, format!("{text}\n{more}")).expect("written");
    cluster
}

fn text(path: &Path) -> &str {
    path.to_str().expect("text")
}

/// What the command was told of an alarm, in order.
fn told(file: &Path, name: &str) -> Vec<Value> {
    let text = fs::read_to_string(file).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let lines = whole.lines().map(|line| serde_json::from_str(line).expect("JSON"));
    lines.filter(|told: &Value| told["alarm"]["name"] == name).collect()
}

fn wait_for(what: &str, holds: impl Fn() -> bool) {
    let started = Instant::now();
    while !holds() {
        assert!(started.elapsed() < DEADLINE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_command_is_told_of_an_alarm_that_comes_is_acknowledged_and_goes() {
    let _turn = one_at_a_time();
    let folder = empty_folder("notify");
    let file = folder.join("told.jsonl");
    let notify = format!("[notify]\ncommand = [\"sh\", \"-c\", \"cat >> '{}'\"]\n", text(&file));
    let running = "[[alarm]]\nsignal = \"press.stop\"\nname = \"running\"\nwhen = false\ntext = \"It runs\"\n";
    let (cluster, runs) = (cell(&folder, &(notify + running)), folder.join("runs"));
    let mut command = understudy(&["watch", text(&cluster), "--address", "127.0.0.1:0"]);
    command.args(["--allow-commands", "--link", "udp", "--period", "50ms", "--out", text(&runs)]);
    let page = Page::start(command);
    page.wait_for("a protected cluster", |state| {
        let programs = state["programs"].as_array().expect("programs");
        programs.iter().all(|program| program["protection"]["protected"] == true)
    });
    let run = fs::canonicalize(runs.join("latest")).expect("a run");
    let is_shelved = |state: &Value| {
        let mut alarms = state["process_alarms"].as_array().expect("alarms").iter();
        alarms.any(|alarm| alarm["name"] == "running" && alarm["state"] == "shelved")
    };
    let shelving =
        json!({ "name": "running", "owner": "anna", "reason": "a test", "seconds": 600 });
    assert_eq!(page.post("/api/alarms/shelve", &shelving.to_string()).status, 200);
    page.wait_for("the shelving", is_shelved);
    let mut gateway = understudy(&["gateway", "notify", text(&run)]);
    let gateway = gateway.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("built");
    let events = || -> Vec<Value> {
        told(&file, "understudy").iter().map(|told| told["event"].clone()).collect()
    };
    let give = |command: &str| {
        let body = json!({ "member": "understudy", "command": { "command": command }, "owner": "anna", "reason": "a test" });
        assert_eq!(page.post("/api/command", &body.to_string()).status, 200, "{command}");
    };

    give("kill");
    wait_for("the alarm", || events() == ["raised"]);
    let first = told(&file, "understudy").remove(0);
    assert_eq!(first["cluster"], "press-cell");
    assert_eq!(first["undelivered"], 0);
    assert_eq!(first["alarm"]["alarm"], "unprotected");
    let words = first["alarm"]["text"].as_str().expect("a text");
    assert!(words.contains("not protected, because understudy is"), "{words}");

    let number = first["alarm"]["number"].as_u64().expect("a number");
    let seen = json!({ "alarms": [number], "owner": "anna" }).to_string();
    page.wait_for("the alarm on the page", |state| {
        let mut alarms = state["alarms"].as_array().expect("alarms").iter();
        alarms.any(|alarm| alarm["id"] == number)
    });
    assert_eq!(page.post("/api/alarms/acknowledge", &seen).status, 200);
    wait_for("the acknowledgement", || events() == ["raised", "acknowledged"]);
    assert_eq!(told(&file, "understudy")[1]["alarm"]["acknowledged_by"], "anna");

    give("restart");
    wait_for("the return to normal", || events() == ["raised", "acknowledged", "returned"]);
    assert!(told(&file, "understudy")[2]["alarm"]["over"].is_i64());

    // An alarm that was shelved before the gateway began is told when its shelving ends.
    assert_eq!(told(&file, "running"), Vec::<Value>::new());
    let unshelving = json!({ "name": "running", "owner": "anna", "reason": "a test" });
    assert_eq!(page.post("/api/alarms/unshelve", &unshelving.to_string()).status, 200);
    wait_for("the alarm that was shelved", || !told(&file, "running").is_empty());
    assert_eq!(told(&file, "running")[0]["event"], "raised");

    page.ask_to_end();
    page.end();
    let ended = gateway.wait_with_output().expect("it ends with the run");
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{said}");
    let counts = String::from_utf8_lossy(&ended.stdout);
    assert!(counts.contains(" delivered, 0 not delivered"), "{counts}{said}");
}

/// The answer of the gateway for a finished run of a station that has crashed: its exit status, its counts, and what it said.
fn notified(folder: &Path, more: &str) -> (i32, Value, String) {
    let cluster = cell(folder, more);
    let scenario = folder.join("scenario.toml");
    let crash = "[[step]]\nat = 50\naction = \"crash\"\nstation = \"robot\"\n";
    fs::write(&scenario, format!("title = \"a crash\"\ncycles = 100\n{crash}")).expect("written");
    let runs = folder.join("runs");
    let simulate = ["simulate", text(&cluster), "--seed", "7", "--scenario", text(&scenario)];
    let (_, _, said) = answer(&[&simulate[..], &["--out", text(&runs)]].concat());
    let run = runs.join("latest");
    assert!(run.exists(), "{said}");
    let mut gateway = understudy(&["gateway", "notify", text(&run)]);
    let words = gateway.output().expect("it is built");
    let (status, counts, _) = answer(&["gateway", "notify", text(&run)]);
    (status, counts, String::from_utf8_lossy(&words.stderr).into_owned())
}

/// A command in a shell.
fn shell(script: &str, timeout: &str) -> String {
    format!("[notify]\ncommand = [\"sh\", \"-c\", {script:?}]\ntimeout = \"{timeout}\"\n")
}

#[test]
fn a_command_that_fails_is_reported_with_its_reason() {
    let check = |name: &str, more: &str, code: &str, words: &str| {
        let (status, counts, said) = notified(&empty_folder(name), more);
        assert_eq!(status, 0, "{said}");
        assert_eq!(counts["result"]["delivered"], 0, "{counts}");
        assert!(counts["result"]["undelivered"].as_u64() > Some(0), "{counts}");
        assert!(said.contains(&format!("{code}: alarm `robot`: ")), "{said}");
        assert!(said.contains(words), "{said}");
    };
    let missing = "[notify]\ncommand = [\"no-such-program\"]\n";
    check("notify-missing", missing, "U0584", "cannot start the command `no-such-program`");
    let fails = shell("echo no route to host >&2; exit 3", "10s");
    check("notify-fails", &fails, "U0586", "exit status: 3: no route to host");

    let (status, counts, said) = notified(&empty_folder("notify-absent"), "");
    assert_ne!(status, 0);
    assert_eq!(counts["failures"][0]["code"], "U0599", "{counts}");
    assert!(said.contains("has no [notify]"), "{said}");
}

#[test]
fn a_command_that_hangs_is_killed_with_its_children() {
    let folder = empty_folder("notify-hangs");
    let pids = folder.join("pids");
    let script = format!("echo $$ >> '{0}'; sleep 1000 & echo $! >> '{0}'; wait", text(&pids));
    let (status, counts, said) = notified(&folder, &shell(&script, "300ms"));
    assert_eq!(status, 0, "{said}");
    assert_eq!(counts["result"]["delivered"], 0, "{counts}");
    assert!(said.contains("the command `sh` was killed after 300ms"), "{said}");
    assert!(said.contains("U0585"), "{said}");
    let pids = fs::read_to_string(&pids).expect("it has begun");
    assert!(pids.lines().count() >= 4, "{pids}");
    for pid in pids.lines().map(|pid| pid.parse().expect("a number")) {
        // An orphan is gone as soon as its new parent has waited for it.
        wait_for("the end of a process", || kill(Pid::from_raw(pid), None) == Err(Errno::ESRCH));
    }
}

#[test]
fn the_next_notification_counts_those_that_were_not_delivered() {
    let folder = empty_folder("notify-next");
    let (file, flag) = (folder.join("told.jsonl"), folder.join("flag"));
    let script = format!(
        "test -e '{0}' || {{ touch '{0}'; exit 1; }}; cat >> '{1}'",
        text(&flag),
        text(&file)
    );
    let alarm = "[[alarm]]\nsignal = \"press.stop\"\nname = \"running\"\nwhen = false\ntext = \"It runs\"\n";
    let (_, _, said) = notified(&folder, &format!("{}{alarm}", shell(&script, "10s")));
    assert!(said.contains("U0586"), "{said}");
    let text = fs::read_to_string(&file).expect("the second was delivered");
    let second: Value = serde_json::from_str(text.lines().next().expect("a line")).expect("JSON");
    assert_eq!(second["undelivered"], 1);
}

#[test]
fn the_number_of_waiting_notifications_is_bounded() {
    let mut more = "[notify]\ncommand = [\"true\"]\n".to_owned();
    for number in 0..520 {
        let _ = writeln!(
            more,
            "[[alarm]]\nsignal = \"press.stop\"\nname = \"a{number}\"\nwhen = false\ntext = \"It runs\""
        );
    }
    let (status, counts, said) = notified(&empty_folder("notify-many"), &more);
    assert_eq!(status, 0, "{said}");
    assert_eq!(counts["result"], json!({ "delivered": 500, "undelivered": 21 }));
    assert!(said.contains("U0587: alarm `a"), "{said}");
}
