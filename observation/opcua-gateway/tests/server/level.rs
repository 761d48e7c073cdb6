//! `Server/ServiceLevel` and `Run/State` of a run that is written part by part.

use super::*;

/// The journal of a run is written part by part: the robot's station crashes in cycle 20, the understudy in cycle 40. Between two parts the
/// gateway receives no record for more than 2 s.
#[test]
fn the_service_level_and_the_state_of_the_run_are_true() {
    let Some(python) = python() else { return };
    let understudy = "[[step]]\nat = 40\naction = \"crash\"\nstation = \"understudy\"\n";
    let folder = finished_run_with("asyncua-level", 60, understudy);
    let journal = folder.join("run/journal.jsonl");
    let results = folder.join("run/summary.json");
    fs::remove_file(&results).expect("it was there");
    let records = fs::read_to_string(&journal).expect("a journal");
    let crashes: Vec<usize> = records
        .match_indices("\"event\":\"fault\"")
        .map(|(at, _)| records[..at].rfind('\n').expect("a line before") + 1)
        .collect();
    let [first, second] = crashes[..] else {
        panic!("{crashes:?}");
    };
    let last = records.trim_end().rfind('\n').expect("several lines") + 1;
    fs::write(&journal, "").expect("written");
    let server = Server::start(&folder, &[]);
    let url = format!("opc.tcp://{}/", server.address);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reader.py");
    let mut child = Command::new("timeout")
        .args(["300", &python])
        .arg(script)
        .args(["level", &url])
        .stdout(Stdio::piped())
        .spawn()
        .expect("a Python");
    let mut said = BufReader::new(child.stdout.take().expect("piped")).lines();
    let mut until = |wanted: &[&str], forbidden: &[&str]| {
        let mut wanted = wanted.to_vec();
        while !wanted.is_empty() {
            let line = said.next().and_then(Result::ok);
            let line = line.unwrap_or_else(|| panic!("{wanted:?} did not come"));
            assert!(!forbidden.contains(&line.as_str()), "{line}");
            wanted.retain(|one| *one != line);
        }
    };
    let healthy = ["level 255", "level 200"];
    let silent = ["level 1", "state not-current UncertainNoCommunicationLastUsableValue"];
    let running = "state running Good";
    until(&silent[..1], &healthy);
    let mut file = fs::OpenOptions::new().append(true).open(&journal);
    let mut write = |part: &str| {
        let file = file.as_mut().expect("the journal");
        file.write_all(part.as_bytes()).expect("written");
    };
    write(&records[..first]);
    until(&["level 255", running], &[]);
    until(&silent, &[]);
    write(&records[first..second]);
    until(&["level 200", running], &[]);
    until(&silent, &healthy[..1]);
    write(&records[second..last]);
    until(&["level 100", running], &[]);
    until(&silent, &healthy);
    write(&records[last..]);
    fs::write(&results, "{}").expect("written");
    until(&["level 10"], &healthy);
    assert!(child.wait().expect("it ends").success());
    server.stop();
}
