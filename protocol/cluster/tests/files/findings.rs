//! Everything that is wrong with a cluster file is found in one run, in the order of its places.

use crate::common::{findings, load, split};
use proptest::prelude::*;
use understudy_cluster::press_cell;
use understudy_text::Report;

const ROBOT: &str = "program robot\ninput there\ninput lost\noutput go\nrung there lost ( go )\n";
const PRESS: &str = "program press\ninput ram_up\noutput down\nrung ram_up ( down )\n";
const BROKEN: &str = "program broken\ninput a\noutput b\nrung aa ( b )\n";
const BELT: &str =
    "program belt\ninput go\noutput there\noutput lots\nrung go ( there ) ( lots )\n";

const FILES: [(&str, &str); 4] = [
    ("robot.ladder", ROBOT),
    ("press.ladder", PRESS),
    ("broken.ladder", BROKEN),
    ("belt.ladder", BELT),
];

/// One controller to hang a section on.
const HEAD: &str =
    "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\n";

/// The findings of a whole file.
pub(crate) fn check(cluster: &str) -> String {
    let loaded = load(cluster, &FILES);
    let errors = loaded.reports.iter().any(Report::has_errors);
    assert_eq!(loaded.cluster.is_none(), errors, "a cluster, or errors");
    findings(&loaded.reports)
}

#[test]
fn a_text_that_is_no_toml() {
    insta::assert_snapshot!(check("[cluster]\nname = cell\nperiod = \"10ms\n[[controller]\n"));
}

#[test]
fn an_empty_file() {
    insta::assert_snapshot!(check(""));
}

#[test]
fn keys_and_values_of_every_kind() {
    insta::assert_snapshot!(check(
        r#"
[clutser]
[cluster]
nam = "cell"
period = "10"
mode = "papper"
copies = 5
history = "8"
flag_after = 0
shadow_cycles = 1.5
listen_cycles = true
link = "udp "

[[controller]]
name = "1robot"
ladder = 3
address = "localhost:7450"

[[controller]]
name = "press line"
lader = "press.ladder"

[[remote_io]]
controller = ["robot"]
fail_safe = { go = 1 }
hold_cycles = -1

[plant]
controller = "robot"
"#
    ));
}

#[test]
fn periods_out_of_bounds() {
    insta::assert_snapshot!(check(&HEAD.replace("[[c", "period = \"20us\"\n[[c")));
}

#[test]
fn names_and_addresses_that_are_taken_or_unknown() {
    insta::assert_snapshot!(check(
        r#"
[cluster]
name = "cell"
[[controller]]
name = "robot"
ladder = "robot.ladder"
address = "127.0.0.1:7001"
[[controller]]
name = "robot"
ladder = "press.ladder"
[[controller]]
name = "robot-io"
ladder = "nowhere.ladder"
[[understudy]]
name = "understudy"
address = "127.0.0.1:7001"
[[remote_io]]
controller = "robbot"
[[remote_io]]
name = "a"
controller = "robot"
fail_safe = { goo = true, zebra = false }
[[remote_io]]
name = "b"
controller = "robot"
[[plant]]
controller = "robot"
ladder = "belt.ladder"
fed_by = "robot-plannt"
[[plant]]
name = "b"
controller = "robot"
model = "robot"
"#
    ));
}

#[test]
fn errors_of_a_ladder_stand_beside_those_of_the_cluster_file() {
    let cluster = HEAD.replace("robot.ladder", "broken.ladder") + "adress = \"x\"\n";
    insta::assert_snapshot!(check(&cluster));
}

#[test]
fn plants_that_do_not_fit_their_controllers() {
    let cluster = HEAD.to_owned()
        + r#"
[[controller]]
name = "press"
ladder = "press.ladder"
[[plant]]
name = "belt"
controller = "robot"
ladder = "belt.ladder"
signals = { lotts = "lost" }
parameters = { speed = 3 }
[[plant]]
name = "ram"
controller = "press"
model = "press"
fed_by = "ram"
signals = { part_present = "ram_up", move_down = "down", move_up = "upp" }
parameters = { ram_cycle = 3, feed_cycles = -1 }
"#;
    insta::assert_snapshot!(check(&cluster));
}

#[test]
fn a_diagnosis_speaks_of_channels_that_the_program_has() {
    let ladder = "program belt\ninput go\noutput there\noutput lots\nrung go ( there ) ( lots )\n";
    let diagnosis = ladder
        .replace("output there", "output there.diagnosed")
        .replace("( there )", "( there.diagnosed )")
        .replace("input go", "input goes")
        .replace("rung go", "rung goes");
    let cluster = HEAD.to_owned()
        + r#"
[[remote_io]]
controller = "robot"
diagnosis = "diagnosis.ladder"
"#;
    let files = [("robot.ladder", ROBOT), ("diagnosis.ladder", &diagnosis)];
    let loaded = load(&cluster, &files);
    assert!(loaded.cluster.is_none());
    insta::assert_snapshot!(findings(&loaded.reports));
    // With the channel's status among the inputs, and a signal that the program has, it fits.
    let program = ROBOT.replace("input lost", "input lost\ninput there.failed");
    let fitting = diagnosis.replace("goes", "go");
    let files = [("robot.ladder", program.as_str()), ("diagnosis.ladder", &fitting)];
    let cluster = load(&cluster, &files).cluster.expect("it fits");
    assert!(cluster.canonical_text().contains("diagnosis"));
}

#[test]
fn plants_that_follow_what_is_not_there() {
    let cluster = HEAD.to_owned()
        + r#"
[[controller]]
name = "press"
ladder = "press.ladder"
[[plant]]
name = "belt"
controller = "robot"
ladder = "belt.ladder"
follows = { go = "belt.there", there = "ram.ram_up", gone = "ram.ram_up" }
[[plant]]
name = "ram"
controller = "press"
model = "press"
signals = { part_present = "ram_up", move_down = "down", move_up = "down" }
follows = { move_up = "belt.lots", move_down = "belt.there", ram = "blet.there", part_present = "there" }
"#;
    insta::assert_snapshot!(check(&cluster));
}

#[test]
fn a_plant_is_one_thing() {
    let both = "[[plant]]\ncontroller = \"robot\"\nmodel = \"robot\"\nladder = \"belt.ladder\"\n";
    let unknown = "[[plant]]\ncontroller = \"robot\"\nmodel = \"robots\"\nparameters = { x = 1 }\n";
    insta::assert_snapshot!(check(&(HEAD.to_owned() + both)));
    insta::assert_snapshot!(check(&(HEAD.to_owned() + unknown)));
}

#[test]
fn what_is_legal_and_probably_not_meant() {
    let cluster = "understudy = []\n".to_owned()
        + HEAD
        + r#"
[[controller]]
name = "press"
ladder = "press.ladder"
[[plant]]
name = "belt"
controller = "robot"
ladder = "belt.ladder"
signals = { lots = "lost" }
fed_by = "ram"
[[plant]]
name = "ram"
controller = "press"
ladder = "ram.ladder"
fed_by = "belt"
"#;
    let ram = "program ram\ninput part_arrives\noutput finished\nrung part_arrives ( finished )\n";
    let files: Vec<_> = FILES.into_iter().chain([("ram.ladder", ram)]).collect();
    let loaded = load(&cluster, &files);
    assert!(loaded.cluster.is_some());
    insta::assert_snapshot!(findings(&loaded.reports));
}

#[test]
fn inputs_that_nothing_drives() {
    let operator = |inputs: &[&str]| {
        let inputs = inputs.iter();
        let inputs: String =
            inputs.map(|name| format!("{name} = {{ operator = \"level\" }}\n")).collect();
        format!("{HEAD}[[remote_io]]\ncontroller = \"robot\"\n[remote_io.inputs]\n{inputs}")
    };
    let check_it = |text: &str, expected: &[&str]| {
        let found = check(text);
        assert_eq!(found.contains("U0256"), !expected.is_empty(), "{found}");
        assert!(expected.iter().all(|part| found.contains(part)), "{found}");
    };
    check_it(
        HEAD,
        &["inputs `there`, `lost` of `robot`", "station = \"robot-io\", input = \"there\""],
    );
    check_it(&operator(&["there"]), &["the input `lost` of `robot`"]);
    check_it(&operator(&["there", "lost"]), &[]);
    // Its own warning says what a plant leaves out, and what an error left out is not known.
    let belt = "[[plant]]\ncontroller = \"robot\"\nladder = \"belt.ladder\"\n";
    check_it(&format!("{HEAD}{belt}"), &[]);
    check_it(&format!("{HEAD}[[remote_io]]\ncontroller = \"gone\"\n"), &[]);
}

#[test]
fn more_than_there_may_be() {
    let mut cluster = "[cluster]\nname = \"cell\"\nhistory = 32\n".to_owned();
    for index in 0..65 {
        let ladder = if index == 3 { "wide" } else { "press" };
        cluster += &format!("[[controller]]\nname = \"c{index}\"\nladder = \"{ladder}.ladder\"\n");
    }
    let mut wide = "program wide\noutput go\n".to_owned();
    let mut rung = "rung".to_owned();
    for index in 0..10_000 {
        wide += &format!("input i{index}\n");
        rung += &format!(" i{index}");
    }
    wide += &(rung + " ( go )\n");
    let loaded = load(&cluster, &[("press.ladder", PRESS), ("wide.ladder", &wide)]);
    assert!(loaded.cluster.is_none());
    insta::assert_snapshot!(findings(&loaded.reports));
    // In a controller and in a plant.
    let mut states = "program states\ninput there\noutput go\n".to_owned();
    for index in 0..=65_536 {
        states += &format!("output m{index}\n");
    }
    states += "rung there";
    for index in 0..=65_536 {
        states += &format!(" ( S m{index} )");
    }
    states += "\nrung m0 ( go )\n";
    let cluster =
        HEAD.to_owned() + "[[plant]]\ncontroller = \"robot\"\nladder = \"robot.ladder\"\n";
    let loaded = load(&cluster, &[("robot.ladder", &states)]);
    assert!(loaded.cluster.is_none());
    insta::assert_snapshot!(findings(&loaded.reports[..1]));
    let huge = "#".repeat(understudy_cluster::MAXIMUM_TEXT_BYTES + 1);
    insta::assert_snapshot!(check(&huge));
}

/// A plant and a fail-safe table that fit nowhere: what is found is bounded, and its last word says how much more there is.
#[test]
fn findings_are_bounded() {
    let mut fail_safe = String::new();
    let mut plant = "program belt\ninput go\n".to_owned();
    let mut rung = "rung go".to_owned();
    for index in 0..150 {
        fail_safe += &format!("o{index} = true, ");
        plant += &format!("output o{index}\n");
        rung += &format!(" ( o{index} )");
    }
    let belt = plant + &rung + "\n";
    let cluster = format!(
        "{HEAD}[[remote_io]]\ncontroller = \"robot\"\nfail_safe = {{ {fail_safe} }}\n\
         [[plant]]\ncontroller = \"robot\"\nladder = \"belt.ladder\"\n"
    );
    let loaded = load(&cluster, &[("robot.ladder", ROBOT), ("belt.ladder", &belt)]);
    let found = findings(&loaded.reports[..1]);
    assert_eq!(loaded.reports[0].diagnostics.len(), 202);
    assert!(found.contains("`robot` has none of 50 more outputs"), "{found}");
    assert!(found.contains("50 more signals of the plant `robot-plant` do not fit"), "{found}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever happens to a good file on its way: an answer, and never a cluster beside an error.
    #[test]
    fn no_text_brings_the_reader_down(
        start in 0.0..1.0_f64,
        length in 0..40_usize,
        insert in prop::sample::select(vec!["", "\"", "[", "]]", "=", "\n", "é", "0", "true", "{ }", "name"]),
    ) {
        let (cluster, ladders) = split(press_cell());
        let mut characters: Vec<char> = cluster.chars().collect();
        let start = (start * characters.len() as f64) as usize;
        let end = characters.len().min(start + length);
        characters.splice(start..end, insert.chars());
        let text: String = characters.into_iter().collect();
        let loaded = load(&text, &ladders);
        let errors = loaded.reports.iter().any(Report::has_errors);
        prop_assert_eq!(loaded.cluster.is_none(), errors);
        for report in &loaded.reports {
            for diagnostic in &report.diagnostics {
                prop_assert!(diagnostic.span.end <= report.text.len());
            }
        }
    }
}

#[test]
fn devices_and_their_places() {
    insta::assert_snapshot!(check(&format!(
        r#"{HEAD}
[[controller]]
name = "press"
ladder = "press.ladder"
[[remote_io]]
controller = "robot"
[remote_io.field]
unit = 300
timeout = "0s"
inputs = {{ ther = "discrete:0", lost = "relay:1" }}
outputs = {{ go = "discrete:7" }}
[[remote_io]]
controller = "press"
[remote_io.field]
modbus = "127.0.0.1:502"
outputs = {{ down = "holding:1.15" }}
[[plant]]
controller = "press"
model = "press"
"#
    )));
}

/// A program with numbers behind a device.
const LEVEL: &str = "PROGRAM p
VAR_INPUT level : REAL; count : INT; run : BOOL; since : TIME; mask : WORD; END_VAR
VAR_OUTPUT flow : REAL; step : UINT; open : BOOL; END_VAR
flow := level; step := 1; open := run;
END_PROGRAM
";

fn field(text: &str) -> String {
    let cluster = format!(
        "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"level.st\"\n\
         [[remote_io]]\ncontroller = \"tank\"\n[remote_io.field]\n{text}"
    );
    findings(&load(&cluster, &[("level.st", LEVEL)]).reports)
}

#[test]
fn numbers_and_their_registers() {
    // The inputs and outputs of a program fault need no place.
    let whole = field(
        r#"modbus = "rtu:/dev/ttyUSB0"
parity = "none"
stop_bits = 2
inputs = { level = "input:0 real cdab", count = { at = "input:2", as = "uint", scale = 0.5 }, run = "holding:10.0", mask = "input:3 uint" }
[remote_io.field.outputs]
flow = { at = "holding:4", as = "int", scale = 0.01, offset = -20.0, order = "badc" }
step = "holding:5 udint"
open = "coil:0"
"#,
    );
    insta::assert_snapshot!(whole);
    // Each signal at a place that does not suit it.
    insta::assert_snapshot!(field(
        r#"modbus = "127.0.0.1:502"
inputs = { level = "input:0", count = "input:2 uint", run = "input:3 int", since = "input:4 dint", mask = { at = "input:8", as = "uint", offset = 1 } }
outputs = { flow = "coil:1", step = "holding:5 real", open = "holding:6.3" }
"#
    ));
    insta::assert_snapshot!(field(
        r#"modbus = "127.0.0.1:502"
baud = 9600
inputs = { level = "input:65535 real", count = { at = "input:2.0", as = "it", scale = 0, ofset = 1 } }
outputs = { flow = "holding:5 real", step = "holding:6 uint", open = "holding:5.0" }
"#
    ));
    insta::assert_snapshot!(field("modbus = \"rtu:ttyUSB0\"\nbaud = 300\n"));
    insta::assert_snapshot!(field("modbus = \"rtu:/dev/ttyUSB0\"\nbaud = 14400\nunit = 0\n"));
}

/// Each would be called, and nothing answers there.
#[test]
fn addresses_at_which_nothing_can_be_reached() {
    let member = |address: &str| check(&format!("{HEAD}address = \"{address}\"\n"));
    for (address, why) in [
        ("0.0.0.0:7450", "every interface"),
        ("[::]:7450", "every interface"),
        ("[::ffff:0.0.0.0]:7450", "every interface"),
        ("224.0.0.1:7450", "many devices"),
        ("[ff02::1]:7450", "many devices"),
        ("255.255.255.255:7450", "many devices"),
        ("192.168.1.11:0", "port 0"),
    ] {
        let found = member(address);
        assert!(found.contains("U0210") && found.contains(why), "{address}: {found}");
        let device = format!(
            "{HEAD}[[remote_io]]\ncontroller = \"robot\"\n[remote_io.field]\nmodbus = \"{address}\"\n\
             inputs = {{ there = \"discrete:0\", lost = \"discrete:1\" }}\noutputs = {{ go = \"coil:0\" }}\n"
        );
        let found = check(&device);
        assert!(found.contains("U0210"), "{address}: {found}");
    }
    let right = member("192.168.1.11:7450");
    assert!(!right.contains("U0210"), "{right}");
}

/// A cluster of a controller and an understudy with these addresses.
fn at_addresses(cluster: &str, first: &str, second: &str) -> String {
    check(&format!(
        "[cluster]\nname = \"line\"\n{cluster}\n\
         [[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\naddress = \"{first}\"\n\
         [[understudy]]\nname = \"understudy\"\naddress = \"{second}\"\n"
    ))
}

/// Frames over Zenoh need a port of their own, 8192 above that of the address.
#[test]
fn addresses_that_the_link_cannot_use() {
    for (port, is_right) in
        [(1, true), (7450, true), (57_343, true), (57_344, false), (65_535, false)]
    {
        for host in ["192.168.1.11", "[fd00::11]"] {
            let check =
                |cluster| at_addresses(cluster, &format!("{host}:{port}"), "192.168.1.12:9");
            let found = check("link = \"zenoh\"");
            assert_eq!(!found.contains("U0580"), is_right, "{host}:{port}: {found}");
            let found = check("link = \"udp\"");
            assert!(!found.contains("U0580"), "{host}:{port}: {found}");
        }
    }
    for (first, second, is_right) in [
        ("10.0.0.1:7450", "10.0.0.1:15642", false),
        ("10.0.0.1:15642", "10.0.0.1:7450", false),
        ("[fd00::1]:7450", "[fd00::1]:15642", false),
        ("10.0.0.1:7450", "10.0.0.1:15643", true),
        ("10.0.0.1:7450", "10.0.0.2:15642", true),
    ] {
        for (link, is_right) in [("zenoh", is_right), ("udp", true)] {
            let found = at_addresses(&format!("link = \"{link}\""), first, second);
            assert_eq!(!found.contains("U0210"), is_right, "{link} {first} {second}: {found}");
        }
    }
    for (first, is_right) in [("10.0.0.1:7450", true), ("[fd00::1]:7450", false)] {
        let found = at_addresses("multicast = \"239.255.68.0:7400\"", first, "10.0.0.2:7450");
        assert_eq!(!found.contains("U0210"), is_right, "{first}: {found}");
    }
}

/// Each member of a cluster with two networks has an address on each, and each host is on one of them.
#[test]
fn addresses_of_two_networks() {
    let check = |cluster: &str, robot: &str, understudy: &str| {
        check(&format!(
            "[cluster]\nname = \"line\"\n{cluster}\n\
             [[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\n{robot}\n\
             [[understudy]]\nname = \"understudy\"\n{understudy}\n"
        ))
    };
    let at = |first: &str, second: &str| {
        format!("address = \"{first}:7450\"\nsecond_address = \"{second}:7450\"")
    };
    let (robot, understudy) = (at("10.0.1.11", "10.0.2.11"), at("10.0.1.12", "10.0.2.12"));
    let two = "networks = 2";
    assert!(!check(two, &robot, &understudy).contains("error"));
    assert!(!check(two, "", "").contains("error"), "the laboratory chooses addresses");
    let found = check("", &robot, "");
    assert!(found.contains("U0240") && found.contains("networks = 2"), "{found}");
    for one in ["address = \"10.0.1.11:7450\"", "second_address = \"10.0.2.11:7450\""] {
        let found = check(two, one, &understudy);
        assert!(found.contains("U0240"), "{found}");
    }
    for second in ["10.0.1.11", "10.0.1.12"] {
        let found = check(two, &at("10.0.1.11", second), &understudy);
        assert!(
            found.contains("on the first and on the second network") || found.contains("U0210"),
            "{found}"
        );
    }
    assert!(check(two, &at("10.0.2.12", "10.0.2.11"), &understudy).contains("U0210"));
    let found = check("networks = 3", &robot, &understudy);
    assert!(found.contains("U0205") && !found.contains("U0240"), "{found}");
    let found = check(two, &at("127.0.0.1", "127.0.0.2"), &understudy);
    assert!(!found.contains("U0240"), "the loopback interface is for tests: {found}");
}
