//! A real browser drives every view of a real laboratory, where `UNDERSTUDY_BROWSER` names a Chromium and Node is installed.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use understudy_testing::skip;

use crate::{Page, answer, empty_folder, one_at_a_time, understudy};

/// The exit status of the script where no browser starts.
const NOT_STARTED: i32 = 77;

fn is_there(program: &str) -> bool {
    let output = Command::new(program).arg("--version").output();
    output.is_ok_and(|output| output.status.success())
}

/// The browser, where this machine has one.
pub(crate) fn browser() -> Option<String> {
    let browser = std::env::var("UNDERSTUDY_BROWSER").unwrap_or_default();
    if browser.is_empty() || !is_there("node") || !is_there(&browser) {
        skip("UNDERSTUDY_BROWSER names no Chromium, or Node is not installed");
        return None;
    }
    Some(browser)
}

/// Starts a page that commands a laboratory of `cluster`, and drives it by a script in this folder.
fn drive(name: &str, cluster: &str, script: &str, more: impl Fn(&Page) -> Vec<String>) {
    let Some(browser) = browser() else {
        return;
    };
    let _turn = one_at_a_time();
    let folder = empty_folder(name);
    let mut command = understudy(&["watch", cluster]);
    command
        .args(["--address", "127.0.0.1:0", "--allow-commands"])
        .args(["--link", "udp", "--period", "50ms"])
        .arg("--out")
        .arg(folder.join("runs"));
    let page = Page::start(command);
    page.wait_for("a cluster synchronised", |state| {
        let members = state["members"].as_array();
        let mut stations = members
            .into_iter()
            .flatten()
            .filter(|member| ["controller", "understudy"].contains(&&*text(&member["kind"])));
        stations.all(|station| station["state"] == "publishing")
    });
    drive_page(&browser, &page, &folder, script, more(&page));
}

/// Drives a page by a script in this folder.
pub(crate) fn drive_page(
    browser: &str,
    page: &Page,
    folder: &Path,
    script: &str,
    more: Vec<String>,
) {
    let output = Command::new("node")
        .arg(format!("tests/page/{script}"))
        .arg(format!("http://{}/", page.address))
        .arg(folder.join("pictures"))
        .args(more)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("node runs");
    let said = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(NOT_STARTED) {
        skip(format_args!("{browser} does not start here: {errors:.200}"));
        return;
    }
    assert!(output.status.success(), "{said:.4000}{errors:.4000}");
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

#[test]
fn a_browser_sees_a_kill_and_asks_why() {
    let cluster = "examples/press-cell/cluster.toml";
    drive("browser", cluster, "browser.mjs", |page| vec![page.id().to_string()]);
}

#[test]
fn a_browser_sees_no_red_before_outputs_are_fail_safe() {
    drive("calm", "examples/press-cell/cluster.toml", "calm.mjs", |_| Vec::new());
}

#[test]
fn a_browser_sees_the_alarms_at_every_place_of_the_page() {
    drive("banner", "examples/press-cell/cluster.toml", "banner.mjs", |_| Vec::new());
}

#[test]
fn a_browser_starts_a_shuttle_and_sees_since_when() {
    let cluster = "examples/two-shuttles/cluster.toml";
    drive("operate", cluster, "operate.mjs", |_| Vec::new());
}

#[test]
fn a_browser_shows_text_and_function_blocks_with_values() {
    let cluster = "examples/heated-tank/cluster.toml";
    drive("numbers", cluster, "numbers.mjs", |_| Vec::new());
}

/// A counter by `step`, with a cluster of it.
fn counter(folder: &Path, name: &str, step: u32, variable: &str) -> String {
    let folder = folder.join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    let program = format!(
        "PROGRAM counter\n  VAR_INPUT go : BOOL; END_VAR\n  VAR_OUTPUT shown : DINT; END_VAR\n  VAR count : DINT; {variable} END_VAR\n  count := count + {step};\n  shown := count;\nEND_PROGRAM\n"
    );
    let cluster = "[cluster]\nname = \"changed\"\nperiod = \"50ms\"\nsecurity = \"off\"\n\n[[controller]]\nname = \"counter\"\nladder = \"counter.st\"\n\n[[remote_io]]\ncontroller = \"counter\"\n";
    let file = folder.join("cluster.toml");
    std::fs::write(folder.join("counter.st"), program).expect("written");
    std::fs::write(&file, cluster).expect("written");
    file.to_str().expect("text").to_owned()
}

#[test]
fn a_browser_shows_an_online_change_and_the_program_that_runs() {
    let files = empty_folder("changed-files");
    let before = counter(&files, "before", 1, "");
    let after = counter(&files, "after", 10, "added : INT := 5;");
    let run = files.with_file_name("changed").join("runs/latest");
    let run = run.to_str().expect("text").to_owned();
    let binary = env!("CARGO_BIN_EXE_understudy").to_owned();
    drive("changed", &before, "changed.mjs", |_| vec![binary.clone(), run.clone(), after.clone()]);
}

/// The press cell with 90 more rungs in the robot, which are a chain of memory bits, a timer of the arm's laps and a counter of them.
fn large_cell(folder: &Path) -> String {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/press-cell");
    for name in ["cluster.toml", "press.ladder"] {
        fs::copy(example.join(name), folder.join(name)).expect("an example");
    }
    let robot = fs::read_to_string(example.join("robot.ladder")).expect("an example");
    let (head, rungs) = robot.split_at(robot.find("rung ").expect("rungs"));
    let mut text = head.to_owned();
    for number in 1..=90 {
        text += &format!("memory extra_{number}\n");
    }
    text += &format!("\n{rungs}\n");
    text += "rung \"a lap\"\n    arm_left {CTU laps 1000 R=stop}\n";
    text += "rung \"its time\"\n    /arm_left {TON lap.time 60s}\n";
    for number in 1..=90 {
        let before = match number {
            1 => "arm_left".to_owned(),
            number => format!("extra_{}", number - 1),
        };
        text += &format!("rung \"extra {number}\"\n    {before} ( extra_{number} )\n");
    }
    fs::write(folder.join("robot.ladder"), text).expect("written");
    folder.join("cluster.toml").display().to_string()
}

#[test]
fn a_browser_reads_events_rungs_values_and_links() {
    let cluster = large_cell(&empty_folder("reader-cell"));
    drive("reader", &cluster, "reader.mjs", |_| Vec::new());
}

/// A line of 24 robots and presses with two understudies.
fn line_of_24(folder: &Path) -> String {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/press-cell");
    let mut text = "[cluster]\nname = \"line\"\nperiod = \"10ms\"\n".to_owned();
    for name in ["robot", "press"] {
        let ladder = format!("{name}.ladder");
        fs::copy(example.join(&ladder), folder.join(&ladder)).expect("an example");
        text += &format!("[[understudy]]\nname = \"understudy-{name}\"\n");
    }
    for place in 0..24 {
        let kind = ["robot", "press"][place % 2];
        text += &format!(
            "[[controller]]\nname = \"{kind}-{place}\"\nladder = \"{kind}.ladder\"\n\
             [[remote_io]]\nname = \"io-{place}\"\ncontroller = \"{kind}-{place}\"\n"
        );
    }
    let cluster = folder.join("cluster.toml");
    fs::write(&cluster, text).expect("written");
    cluster.display().to_string()
}

#[test]
fn a_browser_sees_what_is_not_normal_of_many_programs() {
    let Some(browser) = browser() else {
        return;
    };
    let folder = empty_folder("overview");
    let scenario = folder.join("scenario.toml");
    let crash = |at: u32, station: &str| {
        format!("[[step]]\nat = {at}\naction = \"crash\"\nstation = \"{station}\"\n")
    };
    let steps = crash(60, "robot-4") + &crash(120, "understudy-press") + &crash(180, "press-9");
    fs::write(&scenario, format!("title = \"crashes\"\ncycles = 240\n{steps}")).expect("written");
    let (scenario, out) = (scenario.display().to_string(), folder.join("runs"));
    let cluster = line_of_24(&folder);
    let simulate = ["simulate", &cluster, "--seed", "7", "--scenario", &scenario];
    let (_, _, said) = answer(&[&simulate[..], &["--out", &out.display().to_string()]].concat());
    assert!(out.join("latest").exists(), "{said}");
    let page = Page::of_run(&fs::canonicalize(out.join("latest")).expect("a run"));
    drive_page(&browser, &page, &folder, "overview.mjs", Vec::new());
}
