//! The places that show the points of a recorded run to people and to other systems.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use understudy_testing::points::{MODE, POINTS, Row};

use super::run;
use crate::gateway::{Gateway, modbus};
use crate::shared::page::Page;
use crate::understudy_in;

/// A cycle of the run in which every input has the value that the operator has written.
const CYCLE: i64 = 20;

/// Every place has the type of the declaration, the name of the author, and the value of its type.
pub(super) fn at_every_place(folder: &Path, program: &str) {
    on_the_terminal(folder, program);
    on_the_page(folder, program);
    by_modbus(folder, program);
    in_the_report(folder, program);
    refused(folder, program);
    // A program with times has no circuit, so no controller is sought for it: which points are in the way is said by their declarations.
    let allocated = understudy_in(folder, &["allocate", "cell.toml"]);
    for word in ["U0438", "`t` : TIME", "`lt` : TIME", "`day` : DATE"] {
        assert!(allocated.errors.contains(word), "{program}: {}", allocated.shown());
    }
}

fn on_the_terminal(folder: &Path, program: &str) {
    let once = run(folder, &["top", "runs/latest", "--once"]);
    assert!(once.contains("the alarm one.qmot.mode (low) is active"), "{program}: {once}");
    let top: Value =
        serde_json::from_str(&run(folder, &["top", "runs/latest", "--json"])).expect("JSON");
    let state = &top["result"]["programs"][0];
    let metrics = run(folder, &["gateway", "metrics", "runs/latest", "--once"]);
    for row in &POINTS {
        for name in [row.name.to_owned(), format!("q{}", row.name)] {
            assert_eq!(state["values"][&name], row.told(), "{program} {name}");
        }
        let alarm = alarm_of(&top["result"]["process_alarms"], row);
        assert_eq!(alarm["active"], state_of(row) == "unacknowledged", "{program}: {alarm}");
        assert_eq!(alarm["state"], state_of(row), "{program}: {alarm}");
        let exposed = format!("alarm=\"one.q{}\",priority=\"low\",state=\"", row.name);
        let is_so = format!("{exposed}{}\"}} 1", state_of(row));
        let states = metrics.lines().filter(|line| line.contains(&exposed) && line.ends_with(" 1"));
        let states: Vec<&str> = states.collect();
        assert!(states.len() == 1 && states[0].ends_with(&is_so), "{program}: {states:?}");
    }
}

/// State of the alarm on an output: `when` is its value, and a value is not above itself; before the writes, 0 was above a value below 0.
fn state_of(row: &Row) -> &'static str {
    match row.of {
        "BOOL" | "Mode" => "unacknowledged",
        _ if row.number < 0 => "returned",
        _ => "normal",
    }
}

fn alarm_of<'a>(alarms: &'a Value, row: &Row) -> &'a Value {
    let mut alarms = alarms.as_array().expect("a list").iter();
    let alarm = alarms.find(|alarm| alarm["signal"] == format!("q{}", row.name));
    alarm.unwrap_or_else(|| panic!("no alarm on q{}", row.name))
}

fn on_the_page(folder: &Path, program: &str) {
    let page = Page::of_run(&folder.join("runs/latest"));
    let facts = page.get("/api/run").json();
    let state = page.get(&format!("/api/state?cycle={CYCLE}")).json();
    let uses = page.get("/api/cross-reference/0").json();
    let texts = page.get(&format!("/api/ladder/0?cycle={CYCLE}")).json();
    let names: serde_json::Map<String, Value> =
        MODE.iter().map(|(name, value)| (value.to_string(), json!(name))).collect();
    for (side, before) in [("input", ""), ("output", "q")] {
        let points = &facts["programs"][0][format!("{side}s")];
        let identifiers: Vec<String> =
            (0..POINTS.len()).map(|place| format!("0.{side}.{place}")).collect();
        let signals = identifiers.join(",");
        let values = page.get(&format!("/api/values?cycle={CYCLE}&signals={signals}")).json();
        let trends = format!("/api/trends?from={CYCLE}&to={}&signals={signals}", CYCLE + 5);
        let trends = page.get(&trends).json();
        for (place, row) in POINTS.iter().enumerate() {
            let (name, fact) = (format!("{before}{}", row.name), &points[place]);
            let told = row.told();
            assert_eq!((&fact["name"], &fact["type"]), (&json!(name), &json!(row.of)), "{program}");
            let of_values = if row.of == "Mode" { json!(names) } else { Value::Null };
            assert_eq!(fact["values"], of_values, "{program} {name}");
            for values in [&state["programs"][0][format!("{side}_values")], &values["values"]] {
                assert_eq!(values[place], told, "{program} {name}");
            }
            let trend = &trends["signals"][place];
            assert_eq!(trend["name"], format!("one.{name}"), "{program}");
            assert_eq!(trend["runs"], json!([[CYCLE, row.number]]), "{program} {name}");
            if side == "output" && !row.is_bool() && row.of != "Mode" {
                assert_eq!(trend["limits"], json!([row.number as f64]), "{program} {name}");
            }
            // The line in which its variable is read or written has its name and its value.
            let of_variable = name.split(['[', '.']).next().expect("a name");
            let mut used = uses["signals"].as_array().expect("a list").iter();
            let used = used.find(|signal| signal["name"] == of_variable).expect("its variable");
            let lines = if side == "input" { &used["read"] } else { &used["written"] };
            let lines: BTreeSet<u64> =
                lines.as_array().expect("lines").iter().filter_map(Value::as_u64).collect();
            let is_there = texts["lines"].as_array().expect("lines").iter().any(|line| {
                let here =
                    line["file_line"].as_u64().is_some_and(|line| lines.contains(&(line - 1)));
                let value = line["values"].as_array().expect("values");
                here && value.iter().any(|shown| shown["name"] == name && shown["value"] == told)
            });
            assert!(is_there, "{program} {name}: {lines:?} {texts:.3000}");
        }
    }
    for row in POINTS.iter().filter(|row| !row.is_bool()) {
        let operator = &facts["programs"][0]["inputs"];
        let mut operator = operator.as_array().expect("a list").iter();
        let operator = &operator.find(|input| input["name"] == row.name).expect("it")["operator"];
        let limits = [&operator["low"], &operator["high"]];
        assert!(limits.contains(&&row.told()), "{program}: {operator}");
    }
    for row in &POINTS {
        let why = page.get(&format!("/api/why/0/q{}?cycle={CYCLE}", row.name)).json();
        assert_eq!((&why["value"], &why["type"]), (&row.told(), &json!(row.of)), "{program}");
        assert_eq!(alarm_of(&state["process_alarms"], row)["name"], format!("one.q{}", row.name));
        let events = page.get(&format!("/api/events?find={}", row.name)).json().to_string();
        let written = format!("writes {} to input {}: ", row.shown, row.name);
        let of_level = format!("writes {} to input {}: ", row.file, row.name);
        assert!(events.contains(&written) || events.contains(&of_level), "{program}: {events}");
    }
}

/// Registers and bits hold the numbers: least significant word last, as [`understudy_gateway`] orders them.
fn by_modbus(folder: &Path, program: &str) {
    let map = understudy_in(folder, &["gateway", "registers", "runs/latest", "--json"]).json();
    let map = map["result"]["registers"].as_array().expect("a list");
    let gateway = Gateway::start(folder, "modbus");
    let mut stream = gateway.connect();
    while modbus(&mut stream, &[4, 0, 0, 0, 1]) == [0x84, 6] {
        std::thread::yield_now();
    }
    for row in &POINTS {
        for name in [format!("one.{}", row.name), format!("one.q{}", row.name)] {
            let place = map.iter().find(|place| place["name"] == name).expect("a place");
            let address = place["address"].as_u64().expect("a number") as u16;
            let width = place["width"].as_u64().expect("a number") as u16;
            let ([high, low], [more, less]) = (address.to_be_bytes(), width.to_be_bytes());
            let function = match place["area"].as_str() {
                Some("coil") => 1,
                Some("discrete-input") => 2,
                _ => 3,
            };
            let answer = modbus(&mut stream, &[function, high, low, more, less]);
            let number = row.number.to_be_bytes();
            let expected = match function {
                3 => &number[8 - 2 * usize::from(width)..],
                _ => &number[7..],
            };
            assert_eq!(answer[2..], *expected, "{program} {name}: {place}");
        }
    }
    gateway.stop();
}

/// The figure of the report has each value as every view has it, and the ends of what was changed by a write.
fn in_the_report(folder: &Path, program: &str) {
    let report = fs::read_to_string(folder.join("runs/latest/report.html")).expect("a report");
    for row in &POINTS {
        let shown = match row.safe.replace('"', "") {
            _ if row.is_bool() => format!("q{}", row.name),
            safe if safe == row.shown => format!("q{} {safe}", row.name),
            safe if row.number < 0 => format!("q{} {} … {safe}", row.name, row.shown),
            safe => format!("q{} {safe} … {}", row.name, row.shown),
        };
        let is_there = report.lines().any(|line| line == shown);
        assert!(is_there, "{program}: no {shown:?}");
        let alarm = format!("<td>one.q{}</td><td>low</td>", row.name);
        assert_eq!(report.contains(&alarm), state_of(row) != "normal", "{program} {}", row.name);
    }
}

/// Forces and writes are of the declared type: another value is refused with it, before the run is asked.
fn refused(folder: &Path, program: &str) {
    if program != "text.st" {
        // The declarations are the same, and no body is asked.
        return;
    }
    let order = |what: &str, text: String| {
        let order = ["operate", "runs/latest", "--name", "one-io", what, &text];
        understudy_in(folder, &order).errors
    };
    for row in &POINTS {
        for (text, is_right) in [(row.file.replace('"', ""), true), (row.wrong.to_owned(), false)] {
            // 1 is a BOOL too, and 3.0 is no name.
            let output = order("force", format!("q{}={text}", row.name));
            let written = order("write", format!("{}={text}", row.name));
            if is_right {
                // The run is over: only its process could take it.
                assert!(output.contains("U0557") && written.contains("U0557"), "{output}{written}");
            } else {
                assert!(output.contains("U0556") && output.contains(row.of), "{output}");
                assert!(written.contains("U0641") && written.contains(row.name), "{written}");
            }
        }
    }
}
