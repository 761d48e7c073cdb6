//! The configuration hash: the same for files that mean the same, another for any that does not.

use std::collections::HashMap;
use std::time::Duration;

use crate::common::{load, load_with, split};
use proptest::prelude::*;
use understudy_cluster::{Cluster, Link, Overrides, Security, press_cell};
use understudy_cycle::{Mode, Turns};
use understudy_wire::ConfigurationHash;

/// Loads the press cell with pieces of its files replaced; each piece has to be there.
fn cell(edits: &[(&str, &str, &str)]) -> Cluster {
    let (cluster, ladders) = split(press_cell());
    let mut files: Vec<(&str, String)> = ladders
        .iter()
        .map(|(name, text)| (*name, (*text).to_owned()))
        .chain([("cluster.toml", cluster.to_owned())])
        .collect();
    for (file, from, to) in edits {
        let mut texts = files.iter_mut().rev();
        let (_, text) = texts.find(|(name, _)| name == file).expect("it is there");
        assert!(text.contains(from), "{from} in {file}");
        *text = text.replacen(from, to, 1);
    }
    let (_, cluster) = files.pop().expect("it was put there");
    let ladders: Vec<(&str, &str)> =
        files.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let loaded = load(&cluster, &ladders);
    let findings = crate::common::findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{findings}"))
}

fn hash(edits: &[(&str, &str, &str)]) -> ConfigurationHash {
    cell(edits).agreement().configuration
}

const FILE: &str = "cluster.toml";

#[test]
fn what_does_not_matter_is_not_in_the_hash() {
    let same: [&[(&str, &str, &str)]; 7] = [
        &[(FILE, "[cluster]", "# a comment\n[cluster]\n\n\n")],
        &[(FILE, "period = \"10ms\"", "period = \"10000us\"\ncopies = 2\nhistory = 8")],
        &[(
            FILE,
            "ladder = \"robot.ladder\"",
            "ladder = \"robot.ladder\"\naddress = \"10.0.0.1:7000\"",
        )],
        &[(FILE, "period", "link = \"zenoh\"\nperiod")],
        &[(FILE, "[[understudy]]\nname = \"understudy\"", "")],
        &[("robot.ladder", "program robot", "-- a comment\nprogram rover -- another")],
        &[("robot.ladder", "%IX0.0", "%IX7.0"), ("robot.ladder", "drive to the right", "go east")],
    ];
    for edits in same {
        assert_eq!(hash(edits), hash(&[]), "{edits:?}");
    }
}

/// The schedule is in the hash, so members that disagree refuse each other; a file that does not name the token keeps its hash.
#[test]
fn members_with_another_schedule_have_another_hash() {
    let schedule =
        |word: &str| hash(&[(FILE, "period", &format!("schedule = \"{word}\"\nperiod"))]);
    assert_eq!(schedule("token"), hash(&[]));
    assert_ne!(schedule("parallel"), hash(&[]));
    let overrides = Overrides { turns: Some(Turns::Parallel), ..Overrides::default() };
    let (cluster, ladders) = split(press_cell());
    let loaded = load_with(cluster, &ladders, overrides).cluster.expect("it has no errors");
    assert_eq!(loaded.agreement().configuration, schedule("parallel"));
}

#[test]
fn whatever_matters_is_in_the_hash() {
    let twin = |wiring: &str| {
        format!("controller = \"press\"\ntwin = {{ name = \"two\", wiring = \"{wiring}\" }}\n")
    };
    let different: [&[(&str, &str, &str)]; 28] = [
        &[(FILE, "\"press-cell\"", "\"press-cell-2\"")],
        &[(FILE, "10ms", "11ms")],
        &[(FILE, "period", "mode = \"paper\"\nperiod")],
        &[(FILE, "period", "copies = 1\nperiod")],
        &[(FILE, "period", "history = 9\nperiod")],
        &[(FILE, "period", "flag_after = 4\nperiod")],
        &[(FILE, "period", "shadow_cycles = 4\nperiod")],
        &[(FILE, "period", "listen_cycles = 5\nperiod")],
        &[(FILE, "name = \"understudy\"", "name = \"spare\"")],
        &[(FILE, "[[understudy]]", "[[understudy]]\nname = \"second\"\n[[understudy]]")],
        &[(FILE, "robot-io", "robot-remote")],
        &[(FILE, "grip = true", "grip = false")],
        &[(FILE, "grip = true", "move_up = true")],
        &[(FILE, "controller = \"press\"\n", "controller = \"press\"\nhold_cycles = 4\n")],
        &[(FILE, "controller = \"press\"\n", "controller = \"press\"\ntrial_cycles = 0\n")],
        &[(FILE, "controller = \"press\"\n", "controller = \"press\"\nrelease = \"operator\"\n")],
        &[(FILE, "controller = \"press\"\n", &twin("exclusive"))],
        &[(FILE, "controller = \"press\"\n", &twin("parallel"))],
        &[(
            FILE,
            "controller = \"press\"\n",
            &twin("exclusive\", take_over_after = 2, address = \"10.0.0.9:7450"),
        )],
        &[(
            FILE,
            "controller = \"press\"\n",
            &twin("parallel\", discrepancy_cycles = 9, address = \"10.0.0.9:7450"),
        )],
        &[(FILE, "fed_by = \"arm\"", "")],
        &[(FILE, "fed_by", "watchdog_cycles = 4\nfed_by")],
        &[(FILE, "fed_by", "follows = { move_up = \"arm.arm_up\" }\nfed_by")],
        &[(FILE, "fed_by", "follows = { move_up = \"arm.arm_down\" }\nfed_by")],
        &[(FILE, "fed_by", "parameters = { ram_cycles = 9 }\nfed_by")],
        &[("robot.ladder", "moving_right arm_up /stop", "moving_right /stop")],
        &[("robot.ladder", "moving_right   at %MX0.0 = 0", "moving_right   at %MX0.0 = 1")],
        &[("press.ladder", "raising /stop", "raising /stop /pressing")],
    ];
    let mut seen = HashMap::from([(hash(&[]), 0)]);
    for (index, edits) in different.into_iter().enumerate() {
        if let Some(earlier) = seen.insert(hash(edits), index + 1) {
            panic!("{edits:?} has the hash of number {earlier}");
        }
    }
}

#[test]
fn a_program_has_the_same_hash_whoever_runs_it() {
    let twice = cell(&[
        (FILE, "press.ladder", "robot.ladder"),
        (
            FILE,
            "[[plant]]\nname = \"ram\"\ncontroller = \"press\"\nmodel = \"press\"\nfed_by = \"arm\"\n",
            "",
        ),
    ]);
    let hashes: Vec<_> = twice.controllers().iter().map(|one| one.hash).collect();
    assert_eq!(hashes[0], hashes[1]);
    assert_eq!(twice.parity().expect("all Boolean").circuit().inputs()[6], "press.part_present");
    let once = cell(&[]);
    assert_eq!(once.controllers()[0].hash, hashes[0]);
    assert_ne!(once.controllers()[1].hash, hashes[0]);
}

#[test]
fn the_command_line_replaces_what_the_file_says() {
    let (cluster, ladders) = split(press_cell());
    let replaced = |overrides| load_with(cluster, &ladders, overrides);
    let period = Some(Duration::from_millis(20));
    let loaded = replaced(Overrides {
        period,
        link: Some(Link::Zenoh),
        security: Some(Security::Off),
        mode: None,
        turns: None,
    });
    let loaded = loaded.cluster.expect("it is in bounds");
    assert_eq!(loaded.link(), Link::Zenoh);
    assert_eq!(loaded.security(), Security::Off);
    let written = hash(&[(FILE, "10ms", "20ms")]);
    assert_eq!(loaded.agreement().configuration, written);
    let (mode, turns) = (Some(Mode::Paper), Some(Turns::Parallel));
    let loaded = replaced(Overrides { mode, turns, ..Overrides::default() });
    assert!(loaded.cluster.is_none());
    assert!(crate::common::findings(&loaded.reports).contains("U0228"));
    for period in [Duration::ZERO, Duration::from_micros(199), Duration::from_secs(9999)] {
        let loaded = replaced(Overrides { period: Some(period), ..Overrides::default() });
        assert!(loaded.cluster.is_none());
        assert!(crate::common::findings(&loaded.reports).contains("U0213"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

    /// Two files have equal hashes exactly when all their timings are equal, wherever their members listen.
    #[test]
    fn hashes_are_equal_exactly_when_timings_are(
        left in (1..4_u32, 1..4_u32, 1..3_u32, 1..=u16::MAX),
        right in (1..4_u32, 1..4_u32, 1..3_u32, 1..=u16::MAX),
    ) {
        let load = |(copies, history, hold, port): (u32, u32, u32, u16)| {
            let timings = format!("copies = {copies}\nhistory = {history}\n# port {port}\nperiod");
            let place = format!("controller = \"press\"\nhold_cycles = {hold}\naddress = \"127.0.0.1:{port}\"\n");
            hash(&[(FILE, "period", &timings), (FILE, "controller = \"press\"\n", &place)])
        };
        let equal = (left.0, left.1, left.2) == (right.0, right.1, right.2);
        prop_assert_eq!(load(left) == load(right), equal);
    }
}
