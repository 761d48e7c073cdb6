//! Twins of remote I/Os: those that cannot work are refused by `understudy check`, each with a code, in words of the cluster file.

use std::collections::BTreeMap;
use std::fs;

use serde_json::Value;

use crate::{Answer, empty_folder, understudy, understudy_in};

const PUMP: &str = "program pump\ninput full\noutput run\nrung \"run\"\n  /full ( run )\n";

const TANK: &str = "PROGRAM tank\nVAR_INPUT\n  level : REAL;\nEND_VAR\nVAR_OUTPUT\n  valve : REAL;\nEND_VAR\n\
    valve := level * 0.5;\nEND_PROGRAM\n";

/// A cell of two programs. The first remote I/O has a twin.
fn cell(program: &str, more: &str, twin: &str, field: &str) -> String {
    format!(
        "[cluster]\nname = \"cell\"\nperiod = \"10ms\"\n{more}\
         [[controller]]\nname = \"left\"\nladder = \"{program}\"\n\
         [[controller]]\nname = \"right\"\nladder = \"pump.ladder\"\n\
         [[understudy]]\nname = \"understudy\"\n\
         [[remote_io]]\nname = \"left-io\"\ncontroller = \"left\"\naddress = \"10.0.1.21:7450\"\n{field}\
         [remote_io.twin]\n{twin}\n\
         [[remote_io]]\nname = \"right-io\"\ncontroller = \"right\"\n"
    )
}

#[test]
fn twins_that_cannot_work_are_refused_in_words_of_the_cluster_file() {
    let folder = empty_folder("twins");
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).expect("written");
    write("pump.ladder", PUMP);
    write("tank.st", TANK);
    let found = |cell: &str| {
        write("cluster.toml", cell);
        let answer = understudy_in(&folder, &["check", "cluster.toml", "--json"]);
        let document = answer.json();
        let diagnostics = document["diagnostics"].as_array().expect("a list").clone();
        let of = |key: &str| {
            let texts = diagnostics.iter().filter_map(|it| Some(it[key].as_str()?.to_owned()));
            texts.collect::<Vec<_>>()
        };
        (answer.status, of("code"), of("message").join("\n"), of("help").join("\n"))
    };
    let check = |cell: String, code: &str, words: &[&str]| {
        let (status, codes, messages, helps) = found(&cell);
        assert_eq!(status, 2, "{cell}\n{messages}");
        assert!(codes.iter().any(|it| it == code), "{cell}\n{codes:?}\n{messages}");
        let all = format!("{messages}\n{helps}");
        assert!(words.iter().all(|word| all.contains(word)), "{words:?}:\n{all}");
    };
    let modbus = "[remote_io.field]\nmodbus = \"10.0.1.60:502\"\n\
        inputs = { full = \"discrete:0\" }\noutputs = { run = \"coil:0\" }\n";
    let exclusive = |more: &str| format!("name = \"left-io-2\"\nwiring = \"exclusive\"\n{more}");
    let parallel = |more: &str| format!("name = \"left-io-2\"\nwiring = \"parallel\"\n{more}");
    let pump = |more: &str, twin: &str, field: &str| cell("pump.ladder", more, twin, field);

    let (status, _, messages, _) = found(&pump("", &exclusive(""), modbus));
    assert_eq!(status, 0, "{messages}");

    let address = "address = \"10.0.1.21:7450\"";
    let twice = "two members have the address 10.0.1.21:7450";
    check(pump("", &exclusive(address), ""), "U0210", &[twice]);
    let (_, codes, messages, helps) =
        found(&pump("", &exclusive("address = \"10.0.1.21:7460\""), modbus));
    assert!(codes.iter().any(|it| it == "U0262"), "{codes:?}");
    assert!(messages.contains("both at 10.0.1.21") && helps.contains("another machine"));
    let one_host = "address = \"10.0.1.22:7450\"\nsecond_address = \"10.0.1.22:7451\"";
    let on_both =
        ["10.0.1.22 is on the first and on the second network", "an interface of its own"];
    check(pump("networks = 2\n", &exclusive(one_host), ""), "U0240", &on_both);

    // Which one is the author is decided by what they receive: neither is configured as it.
    check(pump("", &exclusive("author = true"), ""), "U0202", &["author"]);

    // A direct link joins the two, and is no part of a network.
    let linked = |networks: &str, first: &str, twin: &str| {
        let cell = pump(networks, &exclusive(twin), modbus);
        cell.replacen("controller = \"left\"", &format!("controller = \"left\"\n{first}"), 1)
    };
    let at = "address = \"10.0.1.22:7450\"\n";
    let first = "link_address = \"10.0.9.21:7450\"";
    let twin = format!("{at}link_address = \"10.0.9.22:7450\"\ndirect_link = true");
    let (status, _, messages, _) = found(&linked("", first, &twin));
    assert_eq!(status, 0, "{messages}");
    let (status, _, messages, _) = found(&pump("", &exclusive("direct_link = true"), ""));
    assert_eq!(status, 2, "one of the two has an address: {messages}");
    let undeclared = format!("{at}link_address = \"10.0.9.22:7450\"");
    let words = ["without `direct_link = true`", "to both remote I/Os"];
    check(linked("", first, &undeclared), "U0263", &words);
    let one_side = ["10.0.1.21:7450 has a direct link and no `link_address`"];
    check(linked("", "", &twin), "U0263", &one_side);
    let other_side = ["10.0.1.22:7450 has a direct link and no `link_address`"];
    check(linked("", first, &format!("{at}direct_link = true")), "U0263", &other_side);
    let alone = "name = \"right-io\"\nlink_address = \"10.0.9.23:7450\"";
    let without_twin = linked("", first, &twin).replace("name = \"right-io\"", alone);
    check(without_twin, "U0263", &["`link_address` of a remote I/O without a twin"]);
    let on_network = linked("", "link_address = \"10.0.1.21:7460\"", &twin);
    let words = ["10.0.1.21 is on network 1 and on the direct link", "an interface of its own"];
    check(on_network, "U0263", &words);
    let of_another = linked("", "link_address = \"10.0.1.22:7460\"", &twin);
    check(of_another, "U0263", &["10.0.1.22 is on network 1 and on the direct link"]);
    let same = linked("", "link_address = \"10.0.1.22:7450\"", &twin);
    check(same, "U0210", &["10.0.1.22:7450"]);
    let on_second = format!("{twin}\nsecond_address = \"10.0.9.22:7452\"");
    let words = ["10.0.9.22 is on network 2 and on the direct link"];
    check(linked("networks = 2\n", first, &on_second), "U0263", &words);
    check(linked("", "direct_link = true", &twin), "U0202", &["direct_link"]);

    let one_host = linked("", "link_address = \"10.0.9.22:7452\"", &twin);
    let (status, codes, messages, _) = found(&one_host);
    assert!(status == 0 && codes.iter().any(|it| it == "U0262"), "{messages}");
    assert!(messages.contains("both at 10.0.9.22"), "{messages}");

    // A twin has the program of its remote I/O, and serves no other one.
    check(pump("", &exclusive("controller = \"right\""), ""), "U0202", &["controller"]);
    let of_the_other = "name = \"right-io\"\nwiring = \"exclusive\"";
    check(pump("", of_the_other, ""), "U0208", &["right-io"]);

    let late = "owner_timeout = \"25ms\"\ntake_over_after = 2";
    let words = ["takes over after 2 cycles of 10ms", "for 25ms", "take_over_after = 3"];
    check(pump("", &exclusive(late), modbus), "U0229", &words);

    let one_device = parallel("modbus = \"10.0.1.60:502\"");
    check(pump("", &one_device, modbus), "U0259", &["one device", "exclusive"]);
    check(pump("", &parallel(""), modbus), "U0259", &["without modules of its own", "modbus"]);
    check(pump("", &parallel("owner_timeout = \"25ms\""), ""), "U0259", &["owner_timeout"]);
    let number = cell("tank.st", "", &parallel(""), "");
    check(number, "U0260", &["`valve` is REAL", "drive outputs of bits only", "exclusive"]);
}

/// While the twin drives, the plant moves on, and its steps are in the journal, the figure and the account as before.
#[test]
fn a_plant_is_recorded_whichever_of_two_remote_ios_drives_it() {
    let out = empty_folder("plant_of_twins");
    let cell = "examples/twin-remote-io/";
    let [cluster, scenario] = ["cluster.toml", "author-fails.toml"].map(|it| cell.to_owned() + it);
    let to = out.to_str().expect("text");
    let simulated =
        understudy(&["simulate", &cluster, "--scenario", &scenario, "--seed", "1", "--out", to]);
    assert_eq!(simulated.status, 0, "{}", simulated.errors);
    let journal = fs::read_to_string(out.join("latest/journal.jsonl")).expect("a journal");
    let records = journal.lines().map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let steps = records.filter(|record| record["event"]["event"] == "stepped");
    let steps: Vec<String> = steps.map(|record| record["name"].to_string()).collect();
    // Of 1,000 cycles one or two have no driver.
    for plant in ["\"arm\"", "\"ram\""] {
        let count = steps.iter().filter(|member| *member == plant).count();
        assert!(count >= 990, "{plant}: {count}");
    }
}

fn simulated(name: &str, cell: &str, scenario: &str) -> (Answer, Vec<Value>) {
    let out = empty_folder(name);
    let file = out.join("scenario.toml");
    fs::write(&file, scenario).expect("written");
    let [scenario, to] = [&file, &out].map(|path| path.to_str().expect("text"));
    let answer =
        understudy(&["simulate", cell, "--scenario", scenario, "--seed", "1", "--out", to]);
    let journal = fs::read_to_string(out.join("latest/journal.jsonl")).expect("a journal");
    let records = journal.lines().map(|line| serde_json::from_str(line).expect("JSON"));
    (answer, records.collect())
}

const VALVE: &str = "examples/shared-valve/cluster.toml";

fn crashes(steps: &[(u32, &str)]) -> String {
    let steps = steps.iter().map(|(at, station)| {
        format!("[[step]]\nat = {at}\naction = \"crash\"\nstation = \"{station}\"\n")
    });
    format!("title = \"Crashes\"\ncycles = 400\n{}", steps.collect::<String>())
}

/// A valve with two current modules gets half of its current until the other module drives all of it, and the journal has what it gets.
#[test]
fn the_steps_of_a_plant_have_the_outputs_that_its_actuators_get() {
    let (answer, records) = simulated("sum_of_twins", VALVE, &crashes(&[(100, "tank-io")]));
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let inlet = |record: &Value| {
        let word = record["event"]["outputs"]["words"][0].as_u64().expect("a word");
        f32::from_bits(word as u32)
    };
    let of = |event: &str| {
        let own = records.iter().filter(|record| record["event"]["event"] == event);
        own.map(|it| (it["event"]["moment"]["cycle"].as_u64().expect("a cycle"), inlet(it)))
            .collect::<BTreeMap<u64, f32>>()
    };
    let (decided, got) = (of("applied"), of("stepped"));
    let mut shares = [0; 2];
    // Cycles of the cluster: in the first ones the modules begin.
    for (cycle, got) in got.into_iter().filter(|(cycle, _)| *cycle > 50) {
        let Some(decided) = decided.get(&cycle).filter(|decided| **decided > 0.0) else { continue };
        // The follower drives its part of the number before.
        let share = got / decided;
        assert!((0.4..1.1).contains(&share), "{cycle}: {got} of {decided}");
        shares[usize::from(share > 0.6)] += 1;
    }
    assert!((2..=14).contains(&shares[0]) && shares[1] > 200, "{shares:?}");
}

/// The follower asks the operator, since the controller that failed could have a newer state: no remote I/O drives from then on.
#[test]
fn a_run_that_no_remote_io_goes_on_with_says_why() {
    let both = crashes(&[(100, "level"), (108, "tank-io")]);
    let (answer, _) = simulated("no_author", VALVE, &both);
    let reason = "FAILED: only 108 of 400 cycles were completed; then no remote I/O passed a deadline: tank-io is killed, \
                  tank-io-2 asks the operator which state its program continues from\n";
    let told = [reason, "tank     NOT FUNCTIONAL"];
    assert_eq!(answer.status, 1, "{}", answer.shown());
    assert!(told.iter().all(|text| answer.output.contains(text)), "{}", answer.shown());
}

/// The links of a twin fail alone, in both directions.
#[test]
fn a_cut_names_a_twin() {
    let cut = "title = \"Cut\"\ncycles = 100\n[[step]]\nat = 50\naction = \"cut\"\nstation = \"press\"\n\
               to = [\"press-io-2\"]\nboth_ways = true\n";
    let (answer, records) = simulated("cut_of_twin", "examples/twin-remote-io/cluster.toml", cut);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let flagged = records.iter().filter(|record| record["event"]["event"] == "flagged");
    let by: Vec<&str> = flagged.filter_map(|record| record["name"].as_str()).collect();
    assert_eq!(by, ["press-io-2"]);
}
