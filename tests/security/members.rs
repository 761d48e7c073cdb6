//! A member that runs with keys: an operator's calls, a machine's examination.

use std::fs;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

use understudy_bus::free_addresses;

use super::{
    DEADLINE, Running, addressed_cell, answer, codes, empty_folder, some_at_a_time, text,
    understudy,
};

fn doctor<'a>(document: &'a serde_json::Value, check: &str, health: &str) -> Vec<&'a str> {
    let findings = document["result"]["findings"].as_array().expect("a list");
    findings
        .iter()
        .filter(|finding| finding["check"] == check && finding["health"] == health)
        .filter_map(|finding| finding["found"].as_str())
        .collect()
}

#[test]
fn an_operator_is_answered_until_revoked_and_nobody_else_is() {
    let _one = some_at_a_time();
    let folder = empty_folder("operator");
    let cluster = addressed_cell(&folder);
    let keys = folder.join("keys");
    let (cluster, keys) = (text(&cluster), text(&keys));
    let (status, made, _) = answer(&["keys", "init", cluster, "--folder", keys]);
    assert_eq!(status, 0, "{made:#}");
    let second = ["keys", "issue", cluster, "--operator", "guest", "--folder", keys];
    assert_eq!(answer(&second).0, 0);
    let of = |name: &str| format!("{keys}/members/{name}");
    let common = ["--link", "udp", "--no-real-time"];
    let robot_io = of("robot-io");
    let start = ["remote-io", cluster, "--name", "robot-io", "--keys", &robot_io];
    let journal = folder.join("robot-io.jsonl");
    let to_file = ["--journal", text(&journal)];
    let mut running = Running::start(&[&start[..], &common, &to_file].concat());
    let operate = |keys: &str, what: &[&str]| {
        let call = ["operate", cluster, "--name", "robot-io", "--keys", keys];
        answer(&[&call[..], what].concat())
    };
    let operator = of("engineer");
    let started = Instant::now();
    let status = loop {
        let (status, document, _) = operate(&operator, &["status"]);
        if status == 0 {
            break document;
        }
        assert!(started.elapsed() < DEADLINE, "{document:#}");
    };
    assert_eq!(status["result"]["event"], "ready", "{status:#}");
    let (code, configuration, _) = operate(&operator, &["configuration"]);
    assert_eq!(code, 0, "{configuration:#}");
    let canonical = configuration["result"]["text"].as_str().expect("a text");
    assert!(canonical.contains("cluster press-cell"), "{canonical}");
    assert_eq!(operate(&operator, &["release"]).0, 0);

    let lines = understudy(&["operate", cluster, "--name", "robot-io", "--keys", &operator])
        .args(["journal", "--lines", "3"])
        .stderr(Stdio::inherit())
        .output()
        .expect("the binary is built");
    assert!(lines.status.success());
    assert_eq!(String::from_utf8_lossy(&lines.stdout).lines().count(), 3);

    // An order with an unknown name, and one without the right to it, have records in the member's journal. The person is the one of the keys.
    let guest = of("guest");
    for (keys, person, what, code, status) in [
        (&operator, "engineer", &["force", "nothing=1"][..], "U0556", 2),
        (&operator, "engineer", &["write", "nothing=1"], "U0640", 2),
        (&guest, "guest", &["force", "grip=true"], "U0510", 1),
    ] {
        let refused = operate(keys, what);
        assert_eq!((refused.0, codes(&refused.1)), (status, vec![code]), "{what:?}");
        let is_it = |line: &str| {
            let record: serde_json::Value = serde_json::from_str(line).unwrap_or_default();
            let event = &record["event"];
            let why = event["why"].as_str().unwrap_or_default();
            event["event"] == "order-refused"
                && (&event["to"], &event["order"]) == (&"robot-io".into(), &what[0].into())
                && (&event["signal"], &event["owner"]) == (&what[1].into(), &person.into())
                && why.starts_with(code)
        };
        let started = Instant::now();
        while !fs::read_to_string(&journal).unwrap_or_default().lines().any(is_it) {
            assert!(started.elapsed() < DEADLINE, "{what:?} has no record");
            std::thread::yield_now();
        }
    }

    // Keys of a member are no operator's, and keys of another cluster of the same name are nobody's.
    let refused = operate(&of("robot"), &["stop"]);
    assert_eq!((refused.0, codes(&refused.1)), (2, vec!["U0910"]));
    let theirs = folder.join("theirs");
    assert_eq!(answer(&["keys", "init", cluster, "--folder", text(&theirs)]).0, 0);
    let stranger = theirs.join("members/engineer");
    let refused = operate(text(&stranger), &["stop"]);
    assert_eq!((refused.0, codes(&refused.1)), (1, vec!["U0509"]));

    // A member that runs learns who is revoked; the revoked one does not.
    let kept = folder.join("kept");
    copy(Path::new(&guest), &kept);
    assert_eq!(operate(text(&kept), &["status"]).0, 0);
    assert_eq!(answer(&["keys", "revoke", "guest", "--folder", keys]).0, 0);
    let started = Instant::now();
    loop {
        let (code, document, _) = operate(text(&kept), &["status"]);
        if code == 1 && codes(&document) == ["U0510"] {
            break;
        }
        assert!(started.elapsed() < DEADLINE, "still answered: {document:#}");
    }
    let started = Instant::now();
    // Where the answer is lost, the member ends all the same.
    while running.0.try_wait().expect("it is ours").is_none() {
        operate(&operator, &["stop"]);
        assert!(started.elapsed() < DEADLINE, "the operator is answered no more");
    }
}

/// It runs, because its own list is an old one; the others have the new one.
#[test]
fn a_member_whose_keys_were_revoked_is_named_and_not_heard() {
    let _one = some_at_a_time();
    let folder = empty_folder("revoked_member");
    let cluster = addressed_cell(&folder);
    let keys = folder.join("keys");
    let (cluster, keys) = (text(&cluster), text(&keys));
    assert_eq!(answer(&["keys", "init", cluster, "--folder", keys]).0, 0);
    let stolen = folder.join("stolen");
    copy(Path::new(&format!("{keys}/members/press")), &stolen);
    let common = ["--link", "udp", "--no-real-time"];
    let press = ["node", cluster, "--name", "press", "--keys", text(&stolen)];
    let _stolen = Running::start(&[&press[..], &common].concat());
    let own = format!("{keys}/members/robot");
    let robot = ["node", cluster, "--name", "robot", "--keys", &own];
    let mut robot = understudy(&[&robot[..], &common].concat())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the binary is built");
    let output = BufReader::new(robot.stdout.take().expect("it is piped"));
    let _robot = Running(robot);
    let mut revoked = false;
    let started = Instant::now();
    for line in output.lines().map_while(Result::ok) {
        assert!(started.elapsed() < DEADLINE, "not yet named: {line}");
        if !revoked {
            // It is heard first, and then no more.
            assert_eq!(answer(&["keys", "revoke", "press", "--folder", keys]).0, 0);
            revoked = true;
        }
        if line.contains(r#""refused_as":"revoked""#) {
            assert!(line.contains(r#""sender":{"station":1}"#), "{line}");
            return;
        }
    }
    panic!("the robot has ended");
}

/// What systemd is told, of a member that runs and of one that stands still.
#[test]
fn signs_of_life_come_from_a_cycle_that_runs() {
    let _one = some_at_a_time();
    let folder = empty_folder("watchdog");
    let cluster = addressed_cell(&folder);
    let path = std::env::temp_dir().join(format!("understudy-{}.notify", std::process::id()));
    let socket = UnixDatagram::bind(&path).expect("nobody else has it");
    socket.set_read_timeout(Some(DEADLINE)).expect("it is not zero");
    let member = ["node", text(&cluster), "--name", "robot", "--link", "udp"];
    let member = understudy(&[&member[..], &["--security", "off", "--no-real-time"]].concat())
        .env("NOTIFY_SOCKET", &path)
        .env("WATCHDOG_USEC", "400000")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .spawn();
    let member = Running(member.expect("the binary is built"));
    let mut bytes = [0; 256];
    let mut next = || {
        let length = socket.recv(&mut bytes).expect("a sign in time");
        String::from_utf8_lossy(&bytes[..length]).into_owned()
    };
    assert!(next().starts_with("READY=1"));
    for _ in 0..3 {
        assert_eq!(next(), "WATCHDOG=1");
    }
    drop(member);
    fs::remove_file(&path).expect("it is ours");
}

fn copy(from: &Path, to: &Path) {
    use std::os::unix::fs::DirBuilderExt;
    std::fs::DirBuilder::new().mode(0o700).create(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("it is ours") {
        let path = entry.expect("it is ours").path();
        let name = path.file_name().expect("a file");
        std::fs::copy(&path, to.join(name)).expect("it is ours");
    }
}

#[test]
fn doctor_names_what_is_wrong_with_its_remedy() {
    let _one = some_at_a_time();
    let folder = empty_folder("doctor");
    let cluster = addressed_cell(&folder);
    let keys = folder.join("keys");
    let (cluster, keys) = (text(&cluster), text(&keys));
    let (_, without, _) = answer(&["doctor", "--period", "20ms"]);
    assert!(!doctor(&without, "clock", "good").is_empty());
    assert!(doctor(&without, "configuration", "good").is_empty());
    let (status, machine, _) = answer(&["doctor", cluster]);
    assert_eq!(status, 0, "{machine:#}");
    for check in ["clock", "scheduler", "memory", "configuration"] {
        let findings = machine["result"]["findings"].as_array().expect("a list");
        assert!(findings.iter().any(|finding| finding["check"] == check), "{machine:#}");
    }
    // Without a terminal the commands are shown, and none is run.
    let (status, fixed, _) = answer(&["doctor", cluster, "--fix"]);
    assert_eq!(status, 0, "{fixed:#}");
    let findings = fixed["result"]["findings"].as_array().expect("a list");
    let with_command = findings.iter().filter(|finding| finding["repair"].is_object());
    let repairs = fixed["result"]["fixed"]["repairs"].as_array().expect("a list");
    assert_eq!(repairs.len(), with_command.count(), "{fixed:#}");
    assert!(repairs.iter().all(|done| done["outcome"]["outcome"] == "shown"), "{fixed:#}");
    let (status, refused, _) = answer(&["doctor", cluster, "--yes"]);
    assert_eq!((status, codes(&refused)), (2, vec!["U0600"]), "--yes is of --fix");

    let of = |name: &str| format!("{keys}/members/{name}");
    let robot = ["doctor", cluster, "--name", "robot", "--link", "udp", "--listen", "20"];
    let (status, without, _) = answer(&robot);
    assert_eq!(status, 1);
    assert_eq!(doctor(&without, "keys", "bad").len(), 1, "{without:#}");

    assert_eq!(answer(&["keys", "init", cluster, "--folder", keys, "--days", "9"]).0, 0);
    let own = of("robot");
    let with_keys = [&robot[..], &["--keys", &own]].concat();
    let (status, alone, _) = answer(&with_keys);
    assert_eq!(status, 0, "{alone:#}");
    assert_eq!(doctor(&alone, "keys", "warning").len(), 1, "they hold for nine days: {alone:#}");
    assert_eq!(doctor(&alone, "ports", "good").len(), 2, "{alone:#}");
    assert_eq!(doctor(&alone, "peer", "warning").len(), 4, "nobody runs: {alone:#}");

    // One that speaks in every cycle, also when nobody else is there.
    let press = of("press");
    let start = ["node", cluster, "--name", "press", "--link", "udp", "--keys", &press];
    let _running = Running::start(&[&start[..], &["--no-real-time"]].concat());
    let started = Instant::now();
    loop {
        let (_, document, _) = answer(&with_keys);
        let heard = doctor(&document, "peer", "good");
        if heard.iter().any(|found| found.starts_with("press ")) {
            break;
        }
        assert!(started.elapsed() < DEADLINE, "{document:#}");
    }
    let here = ["doctor", cluster, "--name", "press", "--link", "udp", "--keys", &press];
    let (_, document, _) = answer(&here);
    assert_eq!(doctor(&document, "ports", "warning").len(), 2, "it runs here: {document:#}");
}

/// A direct link on which nothing arrives is named as such, where the other remote I/O is heard over the network.
#[test]
fn doctor_names_a_direct_link_over_which_nothing_is_heard() {
    let _one = some_at_a_time();
    let folder = empty_folder("doctor-link");
    let cluster = addressed_cell(&folder);
    let [twin, link, twin_link, elsewhere] =
        free_addresses(4).expect("four free ports").try_into().expect("as many as were asked for");
    let of = |twin_link: SocketAddr| {
        format!(
            "name = \"robot-io\"\nlink_address = \"{link}\"\ntwin = {{ name = \"robot-io-2\", wiring = \"exclusive\", \
             address = \"{twin}\", direct_link = true, link_address = \"{twin_link}\" }}"
        )
    };
    let text_of = fs::read_to_string(&cluster).expect("it was written");
    let with = |twin_link| text_of.replacen("name = \"robot-io\"", &of(twin_link), 1);
    fs::write(&cluster, with(twin_link)).expect("it is ours");
    let wrong = folder.join("wrong.toml");
    fs::write(&wrong, with(elsewhere)).expect("it is ours");

    let keys = folder.join("keys");
    assert_eq!(answer(&["keys", "init", text(&cluster), "--folder", text(&keys)]).0, 0);
    let own = |name: &str| keys.join("members").join(name);
    let (first, second) = (own("robot-io"), own("robot-io-2"));
    let common = ["--link", "udp", "--keys"];
    let doctor_says = |wanted: &str, check: &str, health: &str| {
        let started = Instant::now();
        loop {
            let start = ["doctor", text(&cluster), "--name", "robot-io-2", "--listen", "20"];
            let (_, document, _) = answer(&[&start[..], &common, &[text(&second)]].concat());
            let found = doctor(&document, check, health);
            if found.iter().any(|found| found.contains(wanted)) {
                return;
            }
            assert!(started.elapsed() < DEADLINE, "{document:#}");
        }
    };
    let started_with = |cluster: &Path| {
        let start = ["remote-io", text(cluster), "--name", "robot-io", "--no-real-time"];
        Running::start(&[&start[..], &common, &[text(&first)]].concat())
    };
    let running = started_with(&wrong);
    let words = "is heard over network 1 and not over the direct link";
    doctor_says(words, "networks", "bad");
    drop(running);
    let _running = started_with(&cluster);
    doctor_says(") is heard", "peer", "good");
}
