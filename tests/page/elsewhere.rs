//! What a page says of members on other machines: attached while they run for long, while some of them are gone, and while some run another program.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use nix::sys::signal::Signal;
use serde_json::Value;

use crate::shared::DEADLINE;
use crate::shared::deployed::{Deployed, MEMBERS, text};
use crate::{Page, empty_folder, member, one_at_a_time, understudy};

/// Cycles of 50 ms in 2 s.
const TWO_SECONDS: i64 = 40;

/// A page of its own, with a run of its own.
fn attached(running: &Deployed, runs: &Path) -> Page {
    let operator = running.keys.join("members/engineer");
    let mut command = understudy(&["watch", text(&running.cluster), "--address", "127.0.0.1:0"]);
    command.args(["--keys", text(&operator), "--out", text(runs)]);
    Page::start(command)
}

/// Waits until a member takes calls, so that a page can be attached.
fn first_page(running: &Deployed, runs: &Path) -> Page {
    let operator = running.keys.join("members/engineer");
    let started = Instant::now();
    loop {
        let name = "robot-io";
        let call = ["operate", text(&running.cluster), "--name", name, "--keys", text(&operator)];
        let asked = understudy(&call).arg("status").output().expect("the binary is built");
        if asked.status.success() {
            return attached(running, runs);
        }
        assert!(started.elapsed() < DEADLINE, "{}", String::from_utf8_lossy(&asked.stderr));
    }
}

/// Both programs are protected, and served by all stations.
fn is_healthy(state: &Value) -> bool {
    let programs = state["programs"].as_array().expect("programs");
    programs
        .iter()
        .all(|program| program["source"] == "direct" && program["protection"]["protected"] == true)
        && state["redundancy"]["survives"] == 1
}

/// What the alarm of a remote I/O says that drives nothing.
const NOT_DRIVEN: &str = "no remote I/O drives the outputs";

/// What the alarm of a member says that runs another cluster file.
const ODD: &str = "start it with this cluster file";

/// Lasting alarms with these words: the names, with the cycle in which each was raised.
fn alarms(state: &Value, words: &str) -> BTreeMap<String, i64> {
    let alarms = state["alarms"].as_array().expect("alarms").iter();
    let is_such = |alarm: &&Value| {
        alarm["lasts"] == true && alarm["what"].as_str().is_some_and(|what| what.contains(words))
    };
    let named = alarms.filter(is_such).map(|alarm| {
        let name = alarm["who"].as_str().expect("a name").to_owned();
        (name, alarm["cycle"].as_i64().expect("a cycle"))
    });
    named.collect()
}

fn cycle(state: &Value) -> i64 {
    state["cycle"].as_i64().expect("a cycle")
}

fn is_detached(state: &Value, name: &str) -> bool {
    let note = member(state, name)["note"].as_str();
    note.is_some_and(|note| note.contains("journal not received"))
}

#[test]
fn protection_is_known_at_once_and_a_remote_io_that_is_gone_is_an_alarm() {
    let _turn = one_at_a_time();
    let folder = empty_folder("elsewhere-gone");
    let mut running = Deployed::start(&folder);
    let first = first_page(&running, &folder.join("first"));
    first.wait_for("a healthy cluster", is_healthy);
    // Nothing changes any more, and a page that comes now knows what was so before.
    let second = attached(&running, &folder.join("second"));
    let healthy = second.wait_for("the same at a second page", is_healthy);
    assert!(alarms(&healthy, NOT_DRIVEN).is_empty(), "{healthy:#}");

    // One is killed, and one is suspended.
    for (name, signal) in [("robot-io", Signal::SIGKILL), ("press-io", Signal::SIGSTOP)] {
        let last = first.wait_for("cycles", |_| true);
        running.signal(name, signal);
        let is_raised = |state: &Value| alarms(state, NOT_DRIVEN).contains_key(name);
        for page in [&first, &second] {
            let state = page.wait_for("an alarm", is_raised);
            let raised = alarms(&state, NOT_DRIVEN)[name];
            let after = raised - cycle(&last);
            assert!((0..=TWO_SECONDS).contains(&after), "{name}: after {after} cycles, {state:#}");
            // Its last word is not the present.
            page.wait_for("protection that is not known", |state| {
                let programs = state["programs"].as_array().expect("programs").iter();
                let own =
                    programs.zip(["robot-io", "press-io"]).find(|(_, remote)| *remote == name);
                let (program, _) = own.expect("a program");
                let words = program["protection_words"].as_str().expect("words");
                let is_unknown = program["protection"].is_null();
                assert_eq!(is_unknown, words.starts_with("not known: "), "{program:#}");
                is_unknown && state["redundancy"]["survives"] == 0
            });
        }
    }
    // A page that comes now finds no remote I/O: it shows what the stations say, the alarms, and of whom it knows nothing.
    let late = attached(&running, &folder.join("late"));
    let state = late.wait_for("the alarms", |state| alarms(state, NOT_DRIVEN).len() == 2);
    let begun = cycle(&state);
    let state = late.wait_for("cycles that go on", |state| cycle(state) > begun + 5);
    for name in ["robot", "press", "understudy"] {
        // They take their turns, and no remote I/O is there to receive them.
        assert_eq!(member(&state, name)["state"], "not-received", "{state:#}");
        assert!(!is_detached(&state, name), "{state:#}");
    }
    for (place, name) in ["robot-io", "press-io"].into_iter().enumerate() {
        assert_eq!(member(&state, name)["state"], "not-reporting", "{state:#}");
        assert!(is_detached(&state, name), "{state:#}");
        assert_eq!(state["programs"][place]["source"], "unknown", "{state:#}");
        assert!(state["programs"][place]["protection"].is_null(), "{state:#}");
    }
    assert_eq!(state["redundancy"]["survives"], 0, "{state:#}");
    running.signal("press-io", Signal::SIGCONT);
    for page in [&first, &second, &late] {
        page.wait_for("one of them back", |state| {
            let alarms = alarms(state, NOT_DRIVEN);
            alarms.len() == 1 && alarms.contains_key("robot-io")
        });
    }
    running.start_with("robot-io", &running.cluster.clone());
    for page in [&first, &second, &late] {
        page.wait_for("all of them back", |state| alarms(state, NOT_DRIVEN).is_empty());
    }

    // Nothing is received of any member: the page says so, and how old the last reports are.
    for (name, _) in MEMBERS {
        running.signal(name, Signal::SIGSTOP);
    }
    for page in [&first, &late] {
        let is_over = |state: &Value| MEMBERS.iter().all(|(name, _)| is_detached(state, name));
        let state = page.wait_for("a page that receives no member", is_over);
        assert!(state["age_ms"].as_u64() >= Some(1_500), "{state:#}");
        assert_eq!(state["redundancy"]["survives"], 0, "{state:#}");
    }
    for (name, _) in MEMBERS {
        running.signal(name, Signal::SIGCONT);
    }
    first.wait_for("all of them received", |state| {
        MEMBERS.iter().all(|(name, _)| !is_detached(state, name))
    });
}

/// The same cluster with other outputs of the robot, with the same points.
fn with_another_program(running: &Deployed, folder: &Path) -> PathBuf {
    let ladder = fs::read_to_string(folder.join("robot.ladder")).expect("it is ours");
    let other = folder.join("other");
    fs::create_dir_all(&other).expect("a folder");
    fs::copy(folder.join("press.ladder"), other.join("press.ladder")).expect("copied");
    let changed = ladder.replacen("moving_right arm_up /stop", "moving_right arm_up", 1);
    assert_ne!(changed, ladder);
    fs::write(other.join("robot.ladder"), changed).expect("written");
    let cluster = other.join("cluster.toml");
    fs::copy(&running.cluster, &cluster).expect("copied");
    cluster
}

/// The epochs of the deadlines in a journal.
fn epochs(journal: &Path) -> BTreeSet<u64> {
    let text = fs::read_to_string(journal).unwrap_or_default();
    let records = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let applied = records.filter(|record| record["event"]["event"] == "applied");
    applied.filter_map(|record| record["event"]["moment"]["epoch"].as_u64()).collect()
}

/// All members end, and start at once with another program: its values are not those of the cluster file of the page.
#[test]
fn a_change_of_the_program_under_a_page_shows_nothing_of_the_new_one() {
    let _turn = one_at_a_time();
    let folder = empty_folder("elsewhere-changed");
    let mut running = Deployed::start(&folder);
    let runs = folder.join("runs");
    let page = first_page(&running, &runs);
    page.wait_for("a healthy cluster", is_healthy);
    let other = with_another_program(&running, &folder);
    for (name, _) in MEMBERS {
        running.process(name).kill().expect("it runs");
        running.process(name).wait().expect("it ends");
    }
    for (name, _) in MEMBERS {
        running.start_with(name, &other);
    }
    page.wait_for("members with another configuration", |state| {
        ["robot", "press", "understudy", "robot-io", "press-io"]
            .into_iter()
            .all(|name| is_detached(state, name))
    });
    // An order for the program of the file is taken for no other one.
    let operator = running.keys.join("members/engineer");
    let call = |cluster: &Path, what: &[&str]| {
        let member = ["operate", text(cluster), "--name", "robot-io", "--keys", text(&operator)];
        let output = understudy(&[&member[..], what].concat()).output().expect("it is built");
        String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned()
    };
    let force = ["force", "grip=true", "--seconds", "60", "--reason", "a test"];
    let said = call(&running.cluster, &force);
    assert!(said.contains("U0563"), "{said}");
    let said = call(&other, &force);
    assert!(!said.contains("U0563") && !said.contains("error"), "{said}");
    let said = call(&running.cluster, &["status"]);
    assert!(said.contains("U0563") && !said.contains("grip"), "{said}");
    // The new cluster drives its outputs by now.
    let started = Instant::now();
    let new = loop {
        let new = epochs(&running.journal("robot-io"));
        if !new.is_empty() {
            break new;
        }
        assert!(started.elapsed() < DEADLINE, "it does not start");
    };
    assert_eq!(page.end(), 0);
    let journal = runs.join("latest/journal.jsonl");
    let shown = epochs(&journal);
    assert!(!shown.is_empty() && shown.is_disjoint(&new), "{shown:?}, and {new:?} is the other");
    let text = fs::read_to_string(journal).expect("a journal");
    let said = text.lines().filter(|line| line.contains("it runs configuration"));
    assert!(said.count() >= 7, "{text}");
}

/// A roll-out machine by machine, or a wrong download.
#[test]
fn a_controller_and_a_remote_io_with_another_program_drive_nothing_and_are_alarms() {
    let _turn = one_at_a_time();
    let folder = empty_folder("elsewhere-wrong-program");
    let mut running = Deployed::start(&folder);
    let first = first_page(&running, &folder.join("first"));
    first.wait_for("a healthy cluster", is_healthy);
    let other = with_another_program(&running, &folder);
    for name in ["robot", "robot-io"] {
        running.process(name).kill().expect("it runs");
        running.process(name).wait().expect("it ends");
    }
    for name in ["robot", "robot-io"] {
        running.start_with(name, &other);
    }
    let is_raised = |state: &Value| alarms(state, ODD).contains_key("robot");
    first.wait_for("an alarm of the controller", is_raised);
    let second = attached(&running, &folder.join("second"));
    // The controller may have ended by now; then nothing drives its outputs.
    second.wait_for("an alarm at a page that came later", |state| {
        is_raised(state) || alarms(state, NOT_DRIVEN).contains_key("robot-io")
    });
    let status = running.process("robot").wait().expect("it ends");
    let said = fs::read_to_string(running.errors("robot")).expect("it is ours");
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(said.contains("error[U0598]"), "{said}");
    let journal = fs::read_to_string(running.journal("robot-io")).expect("a journal");
    let driven = journal.lines().filter(|line| {
        line.contains("\"source\":\"direct\"") || line.contains("\"source\":\"reconstructed\"")
    });
    assert_eq!(driven.collect::<Vec<_>>(), [""; 0], "a wrong program drives");
}

/// What the alarm of a remote I/O says whose program was started from its initial state.
const STATE_LOST: &str = "STATE LOST: starts its program from the initial state";

#[test]
fn stations_that_stop_together_are_shown_as_such_and_a_lost_state_is_an_alarm() {
    let _turn = one_at_a_time();
    let folder = empty_folder("elsewhere-stations");
    let mut running = Deployed::start(&folder);
    let first = first_page(&running, &folder.join("first"));
    first.wait_for("a healthy cluster", is_healthy);
    let stations = ["robot", "press", "understudy"];
    for name in stations {
        running.signal(name, Signal::SIGSTOP);
    }
    let state = first.wait_for("stations that are not received", |state| {
        let mut states = stations.into_iter().map(|name| member(state, name));
        states.all(|member| member["state"] == "not-received")
            && alarms(state, "not protected, because").keys().eq(["network"])
    });
    assert!(alarms(&state, "is broken").is_empty(), "{state:#}");
    assert!(alarms(&state, NOT_DRIVEN).is_empty(), "{state:#}");
    for name in stations {
        running.signal(name, Signal::SIGCONT);
    }
    first.wait_for("a healthy cluster again", is_healthy);
    assert!(!is_lost(&first.wait_for("cycles", |_| true)), "they kept their states");
    // The two that hold the state of the robot's program.
    for name in ["robot", "understudy"] {
        running.process(name).kill().expect("it runs");
        running.process(name).wait().expect("it ends");
    }
    for name in ["robot", "understudy"] {
        running.start_with(name, &running.cluster.clone());
    }
    first.wait_for("an alarm", is_lost);
    first.wait_for("a healthy cluster with a new state", is_healthy);
    let late = attached(&running, &folder.join("late"));
    late.wait_for("the same at a page that came later", is_lost);
}

/// Whether an alarm says that the robot's state is lost, acknowledged or not.
fn is_lost(state: &Value) -> bool {
    let mut alarms = state["alarms"].as_array().expect("alarms").iter();
    alarms.any(|alarm| {
        alarm["who"] == "robot-io"
            && alarm["what"].as_str().is_some_and(|what| what.contains(STATE_LOST))
    })
}

/// What the alarm of a remote I/O says whose plant is suspended or has ended.
const NO_FIELD: &str = "its plant has sent nothing";

#[test]
fn a_suspended_plant_is_an_alarm_until_it_goes_on() {
    let _turn = one_at_a_time();
    let folder = empty_folder("elsewhere-plant");
    let mut running = Deployed::start(&folder);
    let first = first_page(&running, &folder.join("first"));
    let healthy = first.wait_for("a healthy cluster", is_healthy);
    assert!(alarms(&healthy, NO_FIELD).is_empty(), "{healthy:#}");
    let last = first.wait_for("cycles", |_| true);
    running.signal("arm", Signal::SIGSTOP);
    let is_raised = |state: &Value| alarms(state, NO_FIELD).contains_key("robot-io");
    let state = first.wait_for("an alarm", is_raised);
    let after = alarms(&state, NO_FIELD)["robot-io"] - cycle(&last);
    assert!((0..=TWO_SECONDS).contains(&after), "after {after} cycles, {state:#}");
    assert_eq!(alarms(&state, NO_FIELD).len(), 1, "{state:#}");
    let late = attached(&running, &folder.join("late"));
    late.wait_for("the same at a page that came later", is_raised);
    running.signal("arm", Signal::SIGCONT);
    for page in [&first, &late] {
        page.wait_for("its end", |state| alarms(state, NO_FIELD).is_empty());
    }
}
