//! Second remote I/Os: what is wrong with them in a cluster file.

use understudy_cluster::Cluster;
use understudy_remote_io::Wiring;
use understudy_typed::Elementary;
use understudy_wire::ProgramId;

use crate::common::{findings, load};
use crate::findings::check;

/// What a twin needs of its device and of its plant, in addresses and names.
#[test]
fn twins() {
    let check = |twin: &str, field: &str, plant: &str| {
        check(&format!(
            "[cluster]\nname = \"cell\"\nperiod = \"10ms\"\n\
             [[controller]]\nname = \"robot\"\nladder = \"robot.ladder\"\naddress = \"10.0.1.11:7450\"\n\
             [[remote_io]]\nname = \"robot-io\"\ncontroller = \"robot\"\ntwin = {{ {twin} }}\n{field}{plant}"
        ))
    };
    let field = |device: &str| format!("[remote_io.field]\nmodbus = \"{device}\"\n");
    let (tcp, serial) = (field("10.0.1.60:502"), field("rtu:/dev/ttyUSB0"));
    let named = |more: &str| format!("name = \"robot-io-2\", wiring = \"exclusive\"{more}");
    assert!(!check(&named(""), &tcp, "").contains("error"));
    let late = ", owner_timeout = \"25ms\", take_over_after";
    assert!(!check(&named(&format!("{late} = 3")), &tcp, "").contains("error"));
    let found = check(&named(&format!("{late} = 2")), &tcp, "");
    assert!(found.contains("U0229") && found.contains("take_over_after = 3"), "{found}");
    assert!(check(&named(""), &serial, "").contains("U0229"));
    assert!(check("wiring = \"exclusive\"", &tcp, "").contains("U0203"), "it has no name");
    assert!(check("name = \"robot-io-2\"", &tcp, "").contains("U0203"), "it has no wiring");
    let unknown = "name = \"robot-io-2\", wiring = \"both\"";
    assert!(check(unknown, &tcp, "").contains("U0207"));
    let taken = "name = \"robot-io\", wiring = \"exclusive\"";
    assert!(check(taken, &tcp, "").contains("U0208"));
    let address = named(", address = \"10.0.1.11:7450\"");
    assert!(check(&address, &tcp, "").contains("U0210"));
    // One machine is no second one.
    let placed = |first: &str, twin: &str| {
        let table = format!("address = \"{first}:7450\"\n{tcp}");
        check(&named(&format!(", address = \"{twin}:7460\"")), &table, "")
    };
    let found = placed("10.0.1.21", "10.0.1.21");
    assert!(found.contains("U0262") && found.contains("both at 10.0.1.21"), "{found}");
    for (first, twin) in [("10.0.1.21", "10.0.1.22"), ("127.0.0.1", "127.0.0.1")] {
        let found = placed(first, twin);
        assert!(!found.contains("U0262") && !found.contains("error"), "{found}");
    }
    for key in ["author = true", "direct = \"10.0.1.61:7450\""] {
        let found = check(&named(&format!(", {key}")), &tcp, "");
        assert!(
            found.contains("U0202"),
            "neither is configured as author, and no link is direct: {found}"
        );
    }
    // A simulated plant must wait until the twin has taken over.
    let plant = |watchdog: u32| {
        format!(
            "[[plant]]\nname = \"arm\"\ncontroller = \"robot\"\nladder = \"belt.ladder\"\nsignals = {{ lots = \"lost\" }}\nwatchdog_cycles = {watchdog}\n"
        )
    };
    for (after, least) in [(1, 4), (3, 6)] {
        let twin = named(&format!(", take_over_after = {after}"));
        let found = check(&twin, "", &plant(least - 1));
        let wanted = format!("watchdog_cycles = {least}");
        assert!(found.contains("U0258") && found.contains(&wanted), "{found}");
        assert!(found.contains("before `robot-io-2` has taken over"), "{found}");
        assert!(!check(&twin, "", &plant(least)).contains("U0258"), "{after}");
    }
}

const CELL: &str =
    "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"tank.st\"\n";

/// A program with numbers.
fn tank(output: &str) -> String {
    format!(
        "PROGRAM tank\nVAR_INPUT\n level : REAL;\n count : INT;\n full : BOOL;\nEND_VAR\nVAR_OUTPUT\n pump : {output};\nEND_VAR\n\
         IF full OR level > 1.0 OR count > 1 THEN\n pump := pump;\nEND_IF;\nEND_PROGRAM\n"
    )
}

/// The cluster of a tank with a twin whose modules are its own, and what is found.
fn parallel(more: &str, after: &str, output: &str) -> (Option<Cluster>, String) {
    let twin = format!("twin = {{ name = \"tank-io-2\", wiring = \"parallel\"{more} }}");
    let text =
        format!("{CELL}[[remote_io]]\nname = \"tank-io\"\ncontroller = \"tank\"\n{twin}\n{after}");
    let loaded = load(&text, &[("tank.st", &tank(output))]);
    let found = findings(&loaded.reports);
    (loaded.cluster, found)
}

const FIELD: &str = "[remote_io.field]\nmodbus = \"10.0.1.60:502\"\n\
     inputs = { level = \"input:0 real\", count = \"input:2 int\", full = \"discrete:0\" }\noutputs = { pump = \"coil:0\" }\n";

/// What modules of their own need: two devices, outputs of bits, and keys of this wiring.
#[test]
fn twins_with_modules_of_their_own() {
    let right = |more: &str, after: &str| {
        let (cluster, found) = parallel(more, after, "BOOL");
        assert!(!found.contains("error"), "{found}");
        cluster.expect("a cluster")
    };
    let wrong = |more: &str, after: &str, output: &str, expected: &str| {
        let (_, found) = parallel(more, after, output);
        assert!(found.contains(expected), "{more} {output}: {found}");
    };
    let cluster = right(", tolerance = { level = 0.5, count = 2 }, discrepancy_cycles = 7", "");
    let settings = cluster.twin_settings(ProgramId(0)).expect("it has a twin");
    let tolerances: Vec<f64> = settings.paired_inputs.iter().map(|it| it.tolerance).collect();
    assert_eq!(tolerances, [0.5, 2.0, 0.0, 0.0], "level, count, full, program.reset");
    let pair = settings.pair.expect("it is one of two");
    assert_eq!(pair.wiring, Wiring::Parallel { discrepancy_cycles: 7 });
    // The device of the twin has the places of the first one.
    let cluster = right(", modbus = \"10.0.1.61:502\"", FIELD);
    let remote_io = &cluster.remote_ios()[0];
    let (first, twin) = (remote_io.field.as_ref(), remote_io.twin.as_ref());
    let (first, own) = (first.expect("a device"), twin.and_then(|it| it.field.as_ref()));
    let own = own.expect("a device");
    assert_eq!(own.connection.to_string(), "10.0.1.61:502");
    assert_eq!((&own.inputs, &own.outputs), (&first.inputs, &first.outputs));
    let serial = FIELD.replace("10.0.1.60:502", "rtu:/dev/ttyUSB0");
    right(", modbus = \"rtu:/dev/ttyUSB1\"", &serial);

    wrong("", FIELD, "BOOL", "U0259");
    wrong(", modbus = \"10.0.1.61:502\"", "", "BOOL", "U0259");
    wrong(", modbus = \"10.0.1.60:502\"", FIELD, "BOOL", "have one device");
    wrong(", modbus = \"rtu:/dev/ttyUSB1\"", FIELD, "BOOL", "U0259");
    wrong(", modbus = \"rtu:/dev/ttyUSB0\"", &serial, "BOOL", "have one device");
    wrong(", owner_timeout = \"1ms\"", "", "BOOL", "U0259");
    wrong(", tolerance = { full = 1 }", "", "BOOL", "U0204");
    wrong(", tolerance = { level = -1 }", "", "BOOL", "U0204");
    wrong(", tolerance = { levle = 1 }", "", "BOOL", "U0209");
    wrong(", discrepancy_cycles = 1", "", "BOOL", "U0205");
    for number in ["REAL", "INT", "TIME"] {
        wrong("", "", number, "U0260");
    }
    let half = ", share = { pump = \"half\" }";
    wrong(half, "", "BOOL", "U0204");
    wrong(half, "", "WORD", "U0204");
    wrong(half, "", "TIME", "U0204");
    wrong(", share = { pump = \"same\" }", "", "REAL", "U0207");
    wrong(", share = { pum = \"half\" }", "", "REAL", "U0209");
    // The right name is missing because of the wrong one.
    let (_, found) = parallel(", share = { pum = \"half\" }", "", "REAL");
    assert!(!found.contains("U0260"), "{found}");
    let (cluster, found) = parallel("", "", "WORD");
    assert!(cluster.is_some(), "{found}");
    wrong("", "fail_safe = { pump = true }\n", "BOOL", "U0261");
    let keys = "name = \"tank-io-2\", wiring = \"exclusive\", discrepancy_cycles = 9";
    let text = format!("{CELL}[[remote_io]]\ncontroller = \"tank\"\ntwin = {{ {keys} }}\n");
    let found = findings(&load(&text, &[("tank.st", &tank("BOOL"))]).reports);
    assert!(found.contains("U0259"), "{found}");
}

/// Numbers that the modules of both drive together, by the device and without one: how long a module may drive what it was told depends on its device.
#[test]
fn numbers_that_two_modules_share() {
    let half = ", share = { pump = \"half\" }";
    let (cluster, found) = parallel(half, "", "INT");
    assert!(!found.contains("error"), "{found}");
    let cluster = cluster.expect("a cluster");
    for settings in [cluster.remote_io_settings(ProgramId(0)), cluster.twin_settings(ProgramId(0))]
    {
        let shared = settings.expect("a remote I/O").shared_outputs;
        assert_eq!((shared.places.len(), shared.delay), (1, 0));
        assert_eq!((shared.places[0].bit, shared.places[0].of), (0, Elementary::Int));
    }
    // The modules of a simulated plant keep what they were told for as long as its watchdog says: 4 cycles are needed.
    let twin = format!("twin = {{ name = \"tank-io-2\", wiring = \"parallel\"{half} }}");
    let text = format!(
        "{CELL}[[remote_io]]\ncontroller = \"tank\"\n{twin}\n\
         [[plant]]\nname = \"basin\"\ncontroller = \"tank\"\nladder = \"basin.st\"\nwatchdog_cycles = 20\n"
    );
    let basin = "PROGRAM basin\nVAR_INPUT\n pump : INT;\nEND_VAR\nVAR_OUTPUT\n level : REAL;\n count : INT;\n full : BOOL;\nEND_VAR\n\
         full := pump > 5;\nEND_PROGRAM\n";
    let loaded = load(&text, &[("tank.st", &tank("INT")), ("basin.st", basin)]);
    let slow = loaded.cluster.unwrap_or_else(|| panic!("{}", findings(&loaded.reports)));
    let settings = slow.remote_io_settings(ProgramId(0)).expect("a remote I/O");
    assert_eq!(settings.shared_outputs.delay, 16);
    let other = parallel(", share = { pump = \"half\" }, discrepancy_cycles = 7", "", "INT").0;
    let hash = |cluster: &Cluster| cluster.agreement().configuration;
    assert_ne!(hash(&cluster), hash(&other.expect("a cluster")));
    let field = |more: &str| {
        let field = FIELD.replace("\"coil:0\"", more);
        let twin = format!("{half}, modbus = \"10.0.1.61:502\"");
        parallel(&twin, &format!("{field}timeout = \"25ms\"\n"), "INT")
    };
    let (cluster, found) = field("\"holding:0 int\"");
    assert!(!found.contains("error"), "{found}");
    let settings = cluster.expect("a cluster").remote_io_settings(ProgramId(0));
    // Two periods until it is written, and an exchange of 25 ms at 10 ms.
    assert_eq!(settings.expect("a remote I/O").shared_outputs.delay, 2 + 3);
    let offset = "{ at = \"holding:0\", as = \"int\", offset = 4.0 }";
    let (_, found) = field(offset);
    assert!(found.contains("U0260") && found.contains("has an `offset`"), "{found}");
    // Two halves that are rounded up are more than the whole.
    let scaled = "{ at = \"holding:0\", as = \"int\", scale = 0.01 }";
    let (_, found) = field(scaled);
    assert!(found.contains("U0260") && found.contains("is rounded"), "{found}");
    for (of, told) in
        [("(Off, Auto, Man)", "U0204"), ("USINT (3..9) := 3", "U0260"), ("USINT (0..9)", "")]
    {
        let (_, found) = parallel(half, "", of);
        let errors: Vec<&str> = found.lines().filter(|line| line.contains("error")).collect();
        let as_told = if told.is_empty() { errors.is_empty() } else { found.contains(told) };
        assert!(as_told, "{of}: {found}");
    }
    let keys = "name = \"tank-io-2\", wiring = \"exclusive\", share = { pump = \"half\" }";
    let text = format!("{CELL}[[remote_io]]\ncontroller = \"tank\"\ntwin = {{ {keys} }}\n");
    let found = findings(&load(&text, &[("tank.st", &tank("INT"))]).reports);
    assert!(found.contains("U0259"), "{found}");
}

/// What the help says can be written as it is: names of elements and members are in quotes.
#[test]
fn the_help_of_shares_is_text_of_a_cluster_file() {
    let check = |share: &str, wanted: &str, code: &str| {
        let more = if share.is_empty() { String::new() } else { format!(", {share}") };
        let (cluster, found) = parallel(&more, "", "ARRAY[0..1] OF REAL");
        assert_eq!(cluster.is_some(), wanted.is_empty(), "{found}");
        assert!(found.contains(wanted), "{found}");
        let codes = ["U0209", "U0260"].map(|code| found.matches(code).count() > 0);
        assert_eq!(codes, [code == "U0209", code == "U0260"], "{found}");
    };
    let [first, second] = ["\"pump[0]\" = \"half\"", "\"pump[1]\" = \"half\""];
    check("", &format!("add `share = {{ {first} }}`"), "U0260");
    check(&format!("share = {{ {first} }}"), &format!("add `{second}` to `share`"), "U0260");
    check(&format!("share = {{ {first}, {second} }}"), "", "");
    // The whole has no share.
    check("share = { pump = \"half\" }", &format!("`{first}, {second}`"), "U0209");
}
