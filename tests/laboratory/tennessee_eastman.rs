//! The Tennessee Eastman process behind a Modbus server: the valves move bit for bit as in a run without failures, whichever controller is
//! killed and whenever. The process takes a step when all controllers have answered, so its trajectory is a function of the answers alone.

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::thread::JoinHandle;

use nix::sys::signal::Signal;
use understudy_testing::random::Dice;

use super::{PERIOD, answer, count, empty_folder, no_orphan, signal, some_at_a_time, understudy};

const CONTROLLERS: [&str; 4] = ["feed", "reactor", "separator", "stripper"];

/// From the kill of one controller to that of the next.
const BETWEEN: usize = 80;

/// Cycles of a run.
const CYCLES: usize = 30 + BETWEEN * CONTROLLERS.len();

/// The equipment, and the lines that it prints: commands and measurements of each step.
struct Equipment {
    child: Child,
    address: String,
    lines: Option<JoinHandle<Vec<String>>>,
}

impl Equipment {
    fn start() -> Self {
        let process = "examples/tennessee-eastman/process.st";
        let mut child = understudy(&["device", process, "--program", "equipment"])
            .args(["--listen", "127.0.0.1:0"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary is built");
        let mut errors = BufReader::new(child.stderr.take().expect("piped"));
        let output = BufReader::new(child.stdout.take().expect("piped"));
        let lines = std::thread::spawn(|| output.lines().map_while(Result::ok).collect());
        let mut line = String::new();
        errors.read_line(&mut line).expect("text");
        let address = line.trim_end().strip_prefix("listening on ");
        Self { address: address.expect("an address").to_owned(), child, lines: Some(lines) }
    }

    /// Ends it; the lines of its run.
    fn end(mut self) -> Vec<String> {
        signal(self.child.id(), Signal::SIGTERM);
        let lines = self.lines.take().expect("it runs");
        lines.join().expect("text")
    }
}

impl Drop for Equipment {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The cluster of the example, with the equipment's own address.
fn cluster(out: &Path, address: &str) -> PathBuf {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tennessee-eastman");
    let text = fs::read_to_string(example.join("modbus.toml")).expect("text");
    assert_eq!(text.matches("\"127.0.0.1:5022\"").count(), 4);
    let text = text.replace("127.0.0.1:5022\"", &format!("{address}\""));
    fs::write(out.join("cluster.toml"), text).expect("written");
    for name in CONTROLLERS {
        let program = format!("{name}.st");
        fs::copy(example.join(&program), out.join(&program)).expect("copied");
    }
    out.join("cluster.toml")
}

/// Each controller is killed at a random time of a random cycle, and started again.
fn kills(seed: u64) -> String {
    let mut dice = Dice::new(seed);
    let mut text = String::new();
    for (number, station) in CONTROLLERS.iter().enumerate() {
        let begins = 10 + BETWEEN * number + dice.below(30);
        let ends = begins + 5 + dice.below(15);
        for (at, action) in [(begins, "crash"), (ends, "restart")] {
            let phase = dice.below(1000);
            write!(
                text,
                "\n[[step]]\nat = {at}\nphase = 0.{phase:03}\naction = \"{action}\"\nstation = \"{station}\"\n"
            )
            .expect("a text");
        }
    }
    text
}

/// The steps of the equipment in a run.
fn run(name: &str, steps: &str) -> Vec<String> {
    let out = empty_folder(name);
    let equipment = Equipment::start();
    let cluster = cluster(&out, &equipment.address);
    let scenario = out.join("scenario.toml");
    let text = format!("title = \"{name}\"\ncycles = {CYCLES}\n{steps}");
    fs::write(&scenario, text).expect("written");
    let [cluster, scenario, runs] =
        [cluster, scenario, out.join("runs")].map(|path| path.to_str().expect("text").to_owned());
    let arguments = ["lab", &cluster, "--scenario", &scenario, "--link", "udp"];
    let (_, document, errors) =
        answer(&[&arguments[..], &["--period", PERIOD, "--out", &runs]].concat());
    no_orphan(&out);
    let summary = &document["result"]["summary"];
    assert_eq!(summary["violation_count"], 0, "{document:#}\n{errors}");
    assert_eq!(summary["cycles_run"], summary["cycles_asked"], "{errors}");
    for number in 0..CONTROLLERS.len() {
        let reconstructed = count(summary, number, "reconstructed");
        assert!(steps.is_empty() || reconstructed >= 3, "{summary:#}");
    }
    equipment.end()
}

#[test]
fn the_valves_of_equipment_on_modbus_move_alike_with_and_without_failures() {
    let _one = some_at_a_time();
    let (expected, found) = std::thread::scope(|scope| {
        let undisturbed = scope.spawn(|| run("tennessee_eastman", ""));
        let found = run("tennessee_eastman_killed", &kills(20_261_125));
        (undisturbed.join().expect("it ran"), found)
    });
    // The process waits for the slowest controller, so the steps of a run are as many as the machine has time for; each one depends on all
    // before it, and each controller was killed between them.
    let steps = expected.len().min(found.len());
    assert!(steps > 2 * CONTROLLERS.len(), "{} and {}", expected.len(), found.len());
    let valve = |line: &String| line.split_whitespace().nth(1).map(str::to_owned);
    assert_ne!(valve(&expected[1]), valve(&expected[steps - 1]), "it moves");
    for (step, (expected, found)) in expected.iter().zip(&found).enumerate() {
        assert_eq!(found, expected, "in step {step}");
    }
    eprintln!("{steps} steps in {CYCLES} cycles");
}
