//! Every path of the page of a finished run, asked well and badly.

use std::process::Stdio;

use crate::{Page, empty_folder, member, simulated_run, simulated_run_of, understudy};

#[test]
fn a_finished_run_answers_every_question() {
    let run = simulated_run(&empty_folder("paths"));
    let page = Page::of_run(&run);

    let facts = page.get("/api/run").json();
    assert_eq!(facts["stations"].as_array().map(Vec::len), Some(3));
    assert!(facts["commands"]["why"].is_string(), "it only looks");

    // While the robot's station is down, its outputs are reconstructed, and the understudy must not fail too.
    let down = page.get("/api/state?cycle=100").json();
    assert_eq!(member(&down, "robot")["state"], "killed");
    assert_eq!(down["programs"][0]["source"], "reconstructed");
    assert_eq!(down["programs"][0]["word_of"], "understudy");
    assert_eq!(down["redundancy"]["level"], "some", "{}", down["redundancy"]);
    let before = page.get("/api/state?cycle=20").json();
    assert_eq!(member(&before, "robot")["state"], "publishing");
    assert_eq!(before["programs"][0]["source"], "direct");
    assert_eq!(before["redundancy"]["level"], "all", "{}", before["redundancy"]);
    let after = page.get("/api/state?cycle=280").json();
    assert_eq!(member(&after, "robot")["state"], "publishing");

    let picture = page.get("/api/ladder/0?cycle=100").json();
    let svg = picture["svg"].as_str().expect("a picture");
    assert!(svg.starts_with("<svg") && svg.contains("class=\"live\""));
    assert!(picture["words"].as_str().expect("words").contains("cycle 100"));
    let addresses = page.get("/api/ladder/0?names=addresses&find=%25QX").json();
    assert!(addresses["svg"].as_str().expect("a picture").contains("%QX"));
    let nothing = page.get("/api/ladder/0?find=nothing-has-this-name").json();
    assert!(nothing["words"].as_str().expect("words").contains("0 of"));

    let cross = page.get("/api/cross-reference/1").json();
    assert!(cross["signals"].as_array().is_some_and(|lines| !lines.is_empty()));

    let why = page.get("/api/why/0/0?cycle=100").json();
    assert_eq!(why["source"], "reconstructed");
    assert_eq!(why["reconstructed"]["proved"], true);

    let trends = page.get("/api/trends?signals=0.output.0,1.input.1&from=0&to=290").json();
    assert_eq!(trends["signals"].as_array().map(Vec::len), Some(2));
    let sources = trends["sources"][0]["runs"].as_array().expect("runs");
    assert!(sources.iter().any(|run| run[2] == "reconstructed"));
    assert!(trends["faults"].as_array().is_some_and(|faults| faults.len() >= 2));

    // Of many cycles there are columns: what is between the least and the greatest value is there, and what is not known is nothing.
    let days = page.get("/api/trends?signals=0.output.0,0.state.holding&from=0&to=59999").json();
    assert_eq!(days["column"], 100);
    assert!(trends["column"].is_null());
    let exact = trends["signals"][0]["runs"].as_array().expect("runs");
    let columns = days["signals"][0]["columns"].as_array().expect("columns");
    assert_eq!(columns.len(), 600);
    assert!(exact.iter().any(|run| run[1] == 1), "it is on at times");
    let is_on = |column: &serde_json::Value| column[1] == 1.0;
    assert!(columns[..3].iter().any(is_on) && columns[3..].iter().all(serde_json::Value::is_null));
    assert_eq!(days["signals"][1]["columns"], serde_json::json!([]), "memory is not recomputed");

    // Memory, as the scan of the cycle left it; in a trend the same.
    let signals = page.get("/api/signals").json();
    let memory = signals
        .as_array()
        .and_then(|signals| signals.iter().find(|signal| signal["name"] == "holding"))
        .expect("a memory bit of the robot");
    assert_eq!(
        (&memory["id"], &memory["kind"], &memory["type"]),
        (&"0.state.holding".into(), &"variable".into(), &"BOOL".into())
    );
    let trend = page.get("/api/trends?signals=0.state.holding,0.input.0&from=40&to=290").json();
    let runs = trend["signals"][0]["runs"].as_array().expect("runs");
    assert!(runs.len() > 2, "it takes and leaves parts: {runs:?}");
    for run in runs {
        let at = |cycle: i64| {
            let values =
                page.get(&format!("/api/values?signals=1.output.0,0.state.holding&cycle={cycle}"));
            u64::from(values.json()["values"][1] == true)
        };
        let (cycle, value) = (run[0].as_i64().expect("a cycle"), &run[1]);
        assert_eq!(*value, at(cycle), "cycle {cycle}");
        assert!(cycle == 40 || *value != at(cycle - 1), "cycle {cycle}");
    }

    let alarms = page.get("/api/events?levels=alarm,warning").json();
    let found = alarms["events"].as_array().expect("events");
    let is_severe = |event: &serde_json::Value| {
        ["alarm", "warning"].contains(&event["level"].as_str().unwrap_or_default())
    };
    assert!(!found.is_empty() && found.iter().all(is_severe));
    let press = page.get("/api/events?members=press&fold=false").json();
    let found = press["events"].as_array().expect("events");
    assert!(!found.is_empty() && found.iter().all(|event| event["who"] == "press"));
    assert_eq!(
        (press["rows"].as_u64(), press["members"]["press"].as_u64()),
        (Some(found.len() as u64), Some(found.len() as u64))
    );

    let events = page.get("/api/events?find=killed").json();
    assert!(events["events"].as_array().is_some_and(|events| !events.is_empty()));

    for path in ["/", "/page.js", "/page.css", "/vendor/uPlot.iife.min.js", "/icon.svg"] {
        let asset = page.get(path);
        assert_eq!(asset.status, 200, "{path}");
        assert!(asset.head.contains("content-security-policy"), "{path}");
    }
    assert_eq!(page.end(), 0);
}

/// A cycle that is read from the journal again is shown as one of all that there are.
#[test]
fn a_cycle_of_the_past_names_the_newest_one() {
    let run = simulated_run_of(&empty_folder("past"), "title = \"long\"\ncycles = 9000\n");
    let page = Page::of_run(&run);
    for cycle in [10, 8990] {
        let state = page.get(&format!("/api/state?cycle={cycle}")).json();
        assert_eq!((&state["cycle"], &state["newest"]), (&cycle.into(), &8999.into()));
        assert_eq!(state["finished"], true);
    }
}

#[test]
fn a_lost_state_is_told_for_each_cycle() {
    let scenario = include_str!("../../examples/press-cell/lost-state.toml");
    let run = simulated_run_of(&empty_folder("lost"), scenario);
    let page = Page::of_run(&run);
    let robot = |cycle: i64| {
        let state = page.get(&format!("/api/state?cycle={cycle}")).json();
        (
            state["programs"][0].clone(),
            state["redundancy"].clone(),
            member(&state, "robot-io").clone(),
        )
    };
    let (before, ..) = robot(50);
    assert_eq!(before["protection"]["protected"], true, "{before:#}");
    assert!(before["lost"].is_null());
    let (behind, ..) = robot(200);
    assert_eq!(behind["protection"]["protected"], false, "{behind:#}");
    assert_eq!(behind["protection"]["since"], 100);
    let lacking = &behind["protection"]["lacking"][0];
    assert_eq!(lacking["station"], "understudy");
    assert_eq!(lacking["reason"], "behind");
    assert_eq!(lacking["link"], "robot-io → understudy");
    let (lost, redundancy, remote_io) = robot(380);
    assert_eq!(lost["lost"]["holder"], "understudy", "{lost:#}");
    assert_eq!(lost["lost"]["age_cycles"], 200, "{lost:#}");
    assert_eq!(lost["lost"]["asks"], true);
    assert_eq!(remote_io["state"], "state-lost");
    assert_ne!(redundancy["level"], "all", "{redundancy:#}");
    let (chosen, ..) = robot(450);
    assert!(chosen["lost"].is_null(), "{chosen:#}");
    assert_eq!(page.end(), 0);
    // The same from the other end: what systems are told.
    let metrics = understudy(&["gateway", "metrics", "--once"]).arg(&run).output();
    let text = String::from_utf8(metrics.expect("the binary is built").stdout).expect("text");
    let of_robot = |name: &str| {
        let of_robot = |line: &&str| {
            line.starts_with(&format!("{name}{{")) && line.contains("program=\"robot\"")
        };
        text.lines().find(of_robot).and_then(|line| line.rsplit(' ').next())
    };
    assert_eq!(of_robot("understudy_protected"), Some("0"), "{text}");
    assert_eq!(of_robot("understudy_unprotected_since_cycle"), Some("100"));
    assert_eq!(of_robot("understudy_lacking"), Some("1"));
    assert_eq!(of_robot("understudy_state_lost"), Some("0"), "it was chosen");
    assert_eq!(of_robot("understudy_state_losses_total"), Some("1"));
    assert_eq!(of_robot("understudy_protection_losses_total"), Some("1"));
}

#[test]
fn bad_questions_get_clear_answers_and_stop_nothing() {
    let run = simulated_run(&empty_folder("bad"));
    let page = Page::of_run(&run);
    let long = "a".repeat(3000);
    let get = [
        ("/nothing", 404, "U0681"),
        ("/../../etc/passwd", 404, "U0681"),
        ("/vendor/", 404, "U0681"),
        ("/api/nothing", 404, "U0681"),
        ("/api/state?cycle=9999999", 404, "U0683"),
        ("/api/state?cycle=-5", 404, "U0683"),
        ("/api/state?cycle=1e9", 400, "U0682"),
        ("/api/state?cycle=", 400, "U0682"),
        ("/api/state?cycle=99999999999999999999", 400, "U0682"),
        ("/api/ladder/9", 404, "U0681"),
        ("/api/ladder/x", 400, "U0682"),
        ("/api/ladder/256", 400, "U0682"),
        ("/api/ladder/0?names=nothing", 400, "U0682"),
        ("/api/cross-reference/77", 404, "U0681"),
        ("/api/why/0/99", 404, "U0681"),
        ("/api/why/0/-1", 400, "U0682"),
        ("/api/why/0", 404, "U0681"),
        ("/api/trends", 400, "U0682"),
        ("/api/trends?from=10&to=0", 400, "U0682"),
        ("/api/trends?from=0&to=9000000000000000000", 400, "U0682"),
        ("/api/trends?from=-9223372036854775808&to=9223372036854775807", 400, "U0682"),
        ("/api/trends?signals=0.nothing.0&from=0&to=9", 404, "U0681"),
        ("/api/trends?signals=0.output.99&from=0&to=9", 404, "U0681"),
        ("/api/events?limit=-1", 400, "U0682"),
        ("/api/events?levels=terrible", 400, "U0682"),
        ("/api/events?fold=perhaps", 400, "U0682"),
        ("/api/ladder/0?page=-1", 400, "U0682"),
        ("/api/values?signals=0.state.nothing", 404, "U0681"),
        ("/api/values?signals=9.input.0", 404, "U0681"),
        ("/api/values?signals=0.input.0&cycle=9999999", 404, "U0683"),
        ("/api/trends?signals=0.state.&from=0&to=9", 404, "U0681"),
        ("/api/compare", 400, "U0682"),
        ("/api/compare?with=..%2F..", 404, "U0681"),
        ("/api/compare?with=latest", 404, "U0681"),
        ("/api/command", 405, "U0682"),
        ("/%ff", 404, "U0681"),
        ("/..%2f..%2fetc%2fpasswd", 404, "U0681"),
        ("/api/state?cycle=%ff", 400, "U0682"),
        ("/api/ladder/%ff", 400, "U0682"),
        ("/api/cross-reference/%f0", 400, "U0682"),
        ("/api/why/99999999999999999999/0", 400, "U0682"),
        ("/api/events?until=99999999999999999999", 400, "U0682"),
        ("/api/trends?signals=%00&from=0&to=5", 404, "U0681"),
        ("/api/compare?with=%ff", 404, "U0681"),
        ("/api/compare?with=%2Fetc%2Fpasswd", 404, "U0681"),
    ];
    for (path, status, code) in get {
        let answer = page.get(path);
        assert_eq!(
            (answer.status, answer.code().as_str()),
            (status, code),
            "{path}: {}",
            answer.body
        );
    }
    // The signals that the run has keep their values next to one that it does not have.
    let mixed = page.get("/api/values?signals=0.state.nothing,0.input.0&cycle=100").json();
    let alone = page.get("/api/values?signals=0.input.0&cycle=100").json();
    assert_eq!(mixed["values"], serde_json::json!([null, alone["values"][0]]));
    assert!(alone["values"][0].is_boolean());
    assert_eq!(mixed["unknown"], serde_json::json!(["0.state.nothing"]));
    for method in ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"] {
        let answer = page.request(&format!(
            "{method} /api/state HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n",
            page.address
        ));
        assert_eq!((answer.status, answer.code().as_str()), (403, "U0685"));
    }
    let many = "0.input.0,".repeat(201);
    assert_eq!(page.get(&format!("/api/values?signals={many}")).code(), "U0682");
    let behind = page.get("/api/ladder/0?page=77").json();
    assert_eq!(behind["rungs"]["page"], 0, "{behind:.300}");
    let unread = page.get(&format!("/api/events?find={long}"));
    assert_eq!(unread.status, 200);
    let kill =
        r#"{"member":"robot","command":{"command":"kill"},"owner":"anna","reason":"a test"}"#;
    let post = [
        ("/api/command", kill, 403, "U0684"),
        ("/api/command", "", 400, "U0682"),
        ("/api/command", "{", 400, "U0682"),
        ("/api/command", "[]", 400, "U0682"),
        ("/api/command", r#"{"member":"robot"}"#, 400, "U0682"),
        ("/api/alarms/acknowledge", r#"{"owner":"anna","alarms":[77]}"#, 404, "U0681"),
        ("/api/alarms/acknowledge", r#"{"owner":"\n","alarms":[77]}"#, 400, "U0682"),
        ("/api/login", r#"{"token":"x"}"#, 400, "U0682"),
        ("/api/logout", "{}", 400, "U0682"),
        ("/api/state", "{}", 405, "U0682"),
        ("/api/command", long.as_str(), 400, "U0682"),
    ];
    for (path, body, status, code) in post {
        let answer = page.post(path, body);
        assert_eq!(
            (answer.status, answer.code().as_str()),
            (status, code),
            "{path} {body:.80}: {}",
            answer.body
        );
    }
    let much = format!("\"{}\"", "a".repeat(10_000));
    assert_eq!(page.post("/api/command", &much).code(), "U0682");
    assert_eq!(page.get("/api/state").status, 200, "it still answers");
}

#[test]
fn other_pages_cannot_ask() {
    let run = simulated_run(&empty_folder("foreign"));
    let page = Page::of_run(&run);
    let of_host = |host: &str| {
        let text = format!("GET /api/state HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        page.request(&text).status
    };
    assert_eq!(of_host(&page.address), 200);
    assert_eq!(of_host("localhost:1"), 200);
    assert_eq!(of_host("evil.example"), 403, "a name that now means this machine");
    let body = r#"{"owner":"anna","alarms":[77]}"#;
    let post = |lines: &str| page.post_with("/api/alarms/acknowledge", lines, body).code();
    assert_eq!(post("Origin: https://evil.example\r\n"), "U0685");
    assert_eq!(post("Origin: null\r\n"), "U0685");
    assert_eq!(post(""), "U0685");
    assert_eq!(post("X-Understudy: 1\r\n"), "U0681", "a program that means this");
    let form = page.request(&format!(
        "POST /api/command HTTP/1.1\r\nHost: {0}\r\nOrigin: http://{0}\r\nContent-Type: text/plain\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{{}}",
        page.address
    ));
    assert_eq!(form.code(), "U0682");
}

#[test]
fn a_page_for_other_machines_asks_who_may_log_in() {
    let run = simulated_run(&empty_folder("machines"));
    let output = understudy(&["watch", "--address", "0.0.0.0:0"])
        .arg(&run)
        .stdin(Stdio::null())
        .output()
        .expect("the binary is built");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("U0674"), "{said}");
    let nothing =
        understudy(&["watch", "nothing-lies-here"]).output().expect("the binary is built");
    assert_eq!(nothing.status.code(), Some(2));
}
