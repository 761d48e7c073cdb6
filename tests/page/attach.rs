//! A page that looks at a cluster which runs already: a laboratory of another process, and members with addresses and keys of their own.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::commands::give;
use crate::shared::DEADLINE;
use crate::shared::deployed::{Deployed, text};
use crate::{Page, answer, empty_folder, member, one_at_a_time, understudy};

const CELL: &str = "examples/press-cell/cluster.toml";
const COMMON: [&str; 4] = ["--link", "udp", "--period", "50ms"];

fn page(cluster: &str, runs: &Path, more: &[&str]) -> Page {
    let mut command = understudy(&["watch", cluster, "--address", "127.0.0.1:0"]);
    command.args(more).arg("--out").arg(runs);
    Page::start(command)
}

fn synchronised(page: &Page) {
    page.wait_for("a cluster synchronised", |state| {
        let publishing = |name| member(state, name)["state"] == "publishing";
        ["robot", "press", "understudy"].into_iter().all(publishing)
    });
}

fn journal(runs: &Path) -> Vec<Value> {
    let text = fs::read_to_string(runs.join("latest/journal.jsonl")).expect("a journal");
    let events = text.lines().map(|line| {
        let record: Value = serde_json::from_str(line).expect("a record");
        record["event"].clone()
    });
    events.collect()
}

/// An alarm that nobody has seen.
fn unseen(state: &Value) -> Option<u64> {
    let alarms = state["alarms"].as_array()?;
    let unseen = alarms.iter().find(|alarm| alarm["acknowledged"].is_null())?;
    unseen["id"].as_u64()
}

fn acknowledge(page: &Page, alarm: u64) {
    let body = json!({ "owner": "anna", "alarms": [alarm] }).to_string();
    assert_eq!(page.post("/api/alarms/acknowledge", &body).status, 200);
    page.wait_for("a seen alarm", |state| {
        let alarms = state["alarms"].as_array().expect("alarms");
        let mut alarms = alarms.iter();
        alarms.any(|found| found["id"] == alarm && found["acknowledged"] == "anna")
    });
}

#[test]
fn a_laboratory_of_another_process_is_looked_at_and_commanded() {
    let _turn = one_at_a_time();
    let runs = empty_folder("attach-laboratory");
    let nothing = ["watch", CELL, "--attach", "--address", "127.0.0.1:0", "--out", text(&runs)];
    let (status, document, _) = answer(&nothing);
    assert_eq!(status, 2, "{document:#}");
    assert_eq!(document["failures"][0]["code"], "U0614");

    let first = page(CELL, &runs, &COMMON);
    synchronised(&first);
    let second = page(CELL, &runs, &[&COMMON[..], &["--allow-commands"]].concat());
    assert!(second.said.contains("already running"), "{}", second.said);
    synchronised(&second);
    assert_eq!(give(&first, "robot", &json!({ "command": "kill" })).0, 403);
    let force =
        json!({ "command": "force", "signal": { "output": 0 }, "value": true, "seconds": 3600 });
    assert_eq!(give(&second, "press-io", &force), (200, String::new()));
    let forced = first.wait_for("an alarm", |state| unseen(state).is_some());
    let kill = |name| give(&second, name, &json!({ "command": "kill" }));
    assert_eq!(kill("robot"), (200, String::new()));
    assert_eq!(kill("robot"), (409, "U0551".to_owned()));
    assert_eq!(kill("understudy"), (200, String::new()));
    first.wait_for("another alarm", |state| {
        state["alarms"].as_array().is_some_and(|alarms| alarms.len() > 1)
    });
    // Page, journal and `top` tell the same times of day, in UTC.
    let state = first.wait_for("cycles", |_| true);
    let at = |value: &Value| value.as_str().expect("a time of day").to_owned();
    for alarm in state["alarms"].as_array().expect("alarms") {
        assert!(at(&alarm["at"]).ends_with('Z'), "{state:#}");
    }
    assert!(at(&state["at"]).ends_with('Z'), "{state:#}");
    let events = first.get("/api/events?levels=alarm").json();
    assert!(at(&events["events"][0]["at"]).ends_with('Z'), "{events:#}");
    let (_, top, _) = answer(&["top", text(&runs.join("latest")), "--once"]);
    let of_page = |name: &str| {
        let alarms = state["alarms"].as_array().expect("alarms").iter();
        let mut alarms = alarms.filter(|alarm| alarm["who"] == name);
        alarms.next().map(|alarm| (alarm["cycle"].clone(), alarm["at"].clone()))
    };
    let alarms = top["result"]["alarms"].as_array().expect("alarms");
    let compared = alarms.iter().filter(|alarm| {
        let found = of_page(alarm["name"].as_str().expect("a name"));
        let own = (alarm["cycle"].clone(), alarm["raised_at"].clone());
        found.inspect(|found| assert_eq!(*found, own, "{alarm:#} {state:#}")).is_some()
    });
    assert!(compared.count() > 0, "{top:#} {state:#}");
    // Seen at the one page, it is seen at the other.
    let alarm = unseen(&forced).expect("an alarm");
    acknowledge(&second, alarm);
    first.wait_for("the same at the first page", |state| {
        let alarms = state["alarms"].as_array().expect("alarms");
        let mut alarms = alarms.iter();
        alarms.any(|found| found["id"] == alarm && found["acknowledged"] == "anna")
    });
    assert_eq!(second.end(), 0);
    assert_eq!(first.end(), 0);
    let events = journal(&runs);
    let count = |word| events.iter().filter(|event| event["event"] == word).count();
    assert_eq!(count("commanded"), 4);
    assert_eq!(count("acknowledged"), 1);

    // A run that is over can be looked at, and its alarms too, and that is written down behind its end.
    let over = Page::of_run(&runs.join("latest"));
    let state = over.wait_for("all of it", |state| unseen(state).is_some());
    acknowledge(&over, unseen(&state).expect("an alarm"));
    assert_eq!(over.end(), 0);
    let run = runs.join("latest");
    let list = ["journal", text(&run), "--event", "acknowledged"];
    let (_, document, _) = answer(&list);
    let lines = document["result"]["lines"].as_array().expect("lines");
    assert_eq!(lines.len(), 2, "{document:#}");
    assert!(lines[0]["text"].as_str().is_some_and(|text| text.contains("anna has acknowledged")));
}

#[test]
fn members_elsewhere_are_looked_at_with_an_operators_keys() {
    let _turn = one_at_a_time();
    let folder = empty_folder("attach-elsewhere");
    let runs = folder.join("runs");
    let running = Deployed::start(&folder);
    let cluster = text(&running.cluster);
    let operator = running.keys.join("members/engineer");

    let top = |keys: &Path, cluster: &str| {
        let runs = text(&runs);
        answer(&["top", cluster, "--once", "--keys", text(keys), "--out", runs])
    };
    // They are up when one of them takes a call; before that the command says who does not.
    let started = std::time::Instant::now();
    loop {
        let (status, document, _) = top(&operator, cluster);
        if status == 0 {
            break;
        }
        let code = document["failures"][0]["code"].as_str().expect("a code");
        assert!(["U0561", "U0562"].contains(&code), "{document:#}");
        assert!(started.elapsed() < DEADLINE, "{document:#}");
    }

    let elsewhere = page(cluster, &runs, &["--keys", text(&operator), "--allow-commands"]);
    synchronised(&elsewhere);
    // The program is followed from a state that a station has told.
    elsewhere.wait_for("power flow", |_| {
        let picture = elsewhere.get("/api/ladder/0");
        picture.status == 200 && picture.body.contains("as evaluated")
    });
    let facts = elsewhere.get("/api/run").json();
    assert!(facts["commands"]["why"].is_null(), "{facts:#}");
    assert!(facts["commands"]["impossible"]["kill"].is_string());
    let kill = give(&elsewhere, "robot", &json!({ "command": "kill" }));
    assert_eq!(kill, (409, "U0559".to_owned()));
    let force =
        json!({ "command": "force", "signal": { "output": 0 }, "value": true, "seconds": 3600 });
    assert_eq!(give(&elsewhere, "robot-io", &force), (200, String::new()));
    elsewhere.wait_for("a forced output", |state| {
        state["programs"][0]["forced"][0]["owner"] == "engineer"
    });
    let unforce = json!({ "command": "unforce", "signal": { "output": 0 } });
    assert_eq!(give(&elsewhere, "robot-io", &unforce), (200, String::new()));
    elsewhere.wait_for("a free output", |state| state["programs"][0]["forced"] == json!([]));
    assert_eq!(elsewhere.end(), 0);
    let events = journal(&runs);
    let commanded = events.iter().filter(|event| event["event"] == "commanded");
    assert_eq!(commanded.count(), 3);
    assert_eq!(events.last().map(|event| &event["event"]), Some(&json!("finished")));

    // Keys of another authority, and the file of another cluster.
    let strange = folder.join("strange");
    let (status, made, _) = answer(&["keys", "init", cluster, "--folder", text(&strange)]);
    assert_eq!(status, 0, "{made:#}");
    let (status, document, _) = top(&strange.join("members/engineer"), cluster);
    assert_eq!(status, 1, "{document:#}");
    assert_eq!(document["failures"][0]["code"], "U0562", "{document:#}");
    let other = running.cluster.with_file_name("other.toml");
    let file = fs::read_to_string(&running.cluster).expect("it is ours");
    fs::write(&other, file.replace("\"50ms\"", "\"60ms\"")).expect("written");
    let (status, document, _) = top(&operator, text(&other));
    assert_eq!(status, 1, "{document:#}");
    assert_eq!(document["failures"][0]["code"], "U0563", "{document:#}");
}
