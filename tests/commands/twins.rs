//! Twins of remote I/Os: those that cannot work are refused by `understudy check`, each with a code, in words of the cluster file.

use std::fs;

use serde_json::Value;

use crate::{empty_folder, understudy, understudy_in};

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
    check(pump("", &exclusive("direct = \"10.0.2.22:7450\""), ""), "U0202", &["direct"]);

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
