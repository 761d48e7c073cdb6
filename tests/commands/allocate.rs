//! Resources, the catalogue and the allocation, from outside.

use std::fs;

use insta::assert_snapshot;
use serde_json::Value;

use crate::{empty_folder, understudy};

const PRESS_CELL: &str = "examples/press-cell/cluster.toml";
const PAINTING: &str = "examples/painting-system/painting-system.ladder";

fn models(item: &Value, verdict: &str) -> Vec<String> {
    let candidates = item["candidates"].as_array().expect("candidates");
    candidates
        .iter()
        .filter(|candidate| candidate["verdict"] == verdict)
        .map(|candidate| candidate["model"].as_str().expect("a model").to_owned())
        .collect()
}

#[test]
fn allocate_explains_itself() {
    assert_snapshot!(understudy(&["allocate", "--help"]).shown());
}

#[test]
fn resources_are_counted_for_every_program_and_for_the_understudy() {
    assert_snapshot!(understudy(&["resources", PRESS_CELL]).shown());
    let listed = understudy(&["resources", PAINTING, "--instructions"]);
    assert_snapshot!(listed.shown());
}

#[test]
fn the_press_cell_gets_a_box_for_every_member() {
    let answer = understudy(&["allocate", PRESS_CELL]);
    assert_snapshot!(answer.shown());
    let document = understudy(&["allocate", PRESS_CELL, "--json"]).json();
    let boxes = document["result"]["boxes"].as_array().expect("boxes");
    assert_eq!(boxes.len(), 5, "two controllers, the understudy, two remote I/Os");
    let items = document["result"]["items"].as_array().expect("items");
    for item in items {
        assert_eq!(item["left_over"], Value::Null, "{}", item["name"]);
        let all = item["candidates"].as_array().map(Vec::len);
        assert_eq!(all, Some(87), "every controller has its answer");
    }
    // LOGO! has no known port, and the S7-200 has no Ethernet.
    assert!(models(&items[0], "does-not-fit").contains(&"CPU 224".to_owned()));
    assert!(!models(&items[0], "fits").contains(&"CPU 224".to_owned()));
}

#[test]
fn a_single_program_has_its_terminals_on_its_own_controller() {
    let document = understudy(&["allocate", PAINTING, "--json"]).json();
    let items = document["result"]["items"].as_array().expect("items");
    assert_eq!(items.len(), 1, "no understudy and no remote I/O");
    let fitting = models(&items[0], "fits");
    assert!(fitting.contains(&"CPU 1214C".to_owned()), "{fitting:?}");
    // Six outputs are needed, and it has four.
    assert!(models(&items[0], "does-not-fit").contains(&"CPU 1211C".to_owned()));
}

#[test]
fn the_report_is_a_page_and_a_table() {
    let folder = empty_folder("allocation_report");
    let out = folder.to_str().expect("text");
    let answer = understudy(&["allocate", PRESS_CELL, "--reserve", "20%", "--report", out]);
    assert_eq!(answer.status, 0, "{}", answer.shown());
    let page = fs::read_to_string(folder.join("allocation.html")).expect("a page");
    assert!(page.contains("Controllers for press-cell"));
    assert!(page.contains("20 % of every capacity stay free"));
    let table = fs::read_to_string(folder.join("allocation.csv")).expect("a table");
    assert!(table.lines().count() > 87 * 5);
}

#[test]
fn a_property_that_does_not_hold_keeps_a_program_from_its_controller() {
    let folder = empty_folder("allocation_properties");
    let file = folder.join("painting.properties");
    fs::write(&file, "never cw_motor and ccw_motor\n").expect("written");
    let asked = format!("painting={}", file.display());
    let answer = understudy(&["allocate", PAINTING, "--properties", &asked]);
    assert_eq!(answer.status, 1);
    assert!(answer.output.contains("no box for painting: not recommended"), "{}", answer.output);
    let insisted = understudy(&["allocate", PAINTING, "--properties", &asked, "--unverified"]);
    assert_eq!(insisted.status, 0, "{}", insisted.shown());
    assert!(insisted.output.contains("does not hold"), "{}", insisted.output);
}

#[test]
fn what_is_asked_wrongly_is_said_whole() {
    let arguments = ["allocate", PAINTING, "--require", "inputs>3", "--require", "colour=red"];
    let answer = understudy(&arguments);
    assert_eq!(answer.status, 2);
    assert_snapshot!(answer.shown());
    let arguments = ["allocate", PAINTING, "--stock", "CPU 1214=1", "--stock", "Nothing=2"];
    assert_snapshot!(understudy(&arguments).shown());
}

#[test]
fn a_catalogue_of_ones_own_is_made_filled_and_exported() {
    let folder = empty_folder("catalogue");
    let file = |name: &str| folder.join(name).display().to_string();
    let (database, prices, exported) = (file("ours.csv"), file("prices.csv"), file("out.csv"));
    let figures = [
        "--vendor",
        "Works",
        "--model",
        "A1",
        "--family",
        "A",
        "--source",
        "data sheet",
        "digital_inputs=16",
        "comm_ports=1x Ethernet",
    ];
    let added =
        understudy(&[&["catalogue", "add", "--catalogue", &database], &figures[..]].concat());
    assert_eq!(added.status, 0, "{}", added.shown());
    assert!(added.output.contains("1 added, 0 updated"), "{}", added.output);
    let again =
        understudy(&[&["catalogue", "add", "--catalogue", &database], &figures[..]].concat());
    assert_eq!(again.status, 2);
    assert!(again.errors.contains("U1125"), "{}", again.errors);

    let text = "vendor,model,family,kind,price,currency,source_url\nWorks,A1,A,plc,249.50,EUR,quotation 17\n";
    fs::write(&prices, text).expect("written");
    let imported =
        understudy(&["catalogue", "import", &prices, "--catalogue", &database, "--update"]);
    assert!(imported.output.contains("0 added, 1 updated"), "{}", imported.shown());
    let shown = understudy(&["catalogue", "show", "A1", "--catalogue", &database]);
    assert_snapshot!(shown.shown());

    let written =
        understudy(&["catalogue", "export", "--catalogue", &database, "--output", &exported]);
    assert_eq!(written.status, 0, "{}", written.shown());
    let copy = file("copy.csv");
    let copied = understudy(&["catalogue", "import", &exported, "--catalogue", &copy, "--empty"]);
    assert!(copied.output.contains("88 added"), "{}", copied.shown());
    let listed =
        |name: &str| understudy(&["catalogue", "list", "--catalogue", name, "--json"]).json();
    assert_eq!(listed(&database)["result"], listed(&copy)["result"]);
}

#[test]
fn bad_catalogues_are_refused_and_nothing_is_written() {
    let folder = empty_folder("catalogue_bad");
    let file = |name: &str| folder.join(name).display().to_string();
    let (bad, database) = (file("bad.csv"), file("ours.csv"));
    let text = "vendor,model,family,kind,digital_inputs,source_url\nWorks,A,W,plc,many,x\nWorks,A,W,plc,8,\n";
    fs::write(&bad, text).expect("written");
    let answer = understudy(&["catalogue", "import", &bad, "--catalogue", &database]);
    assert_eq!(answer.status, 2);
    for code in ["U1107", "U1108", "U1109"] {
        assert!(answer.errors.contains(code), "{}", answer.errors);
    }
    assert!(!folder.join("ours.csv").exists());
    let nowhere = file("absent/ours.csv");
    let answer = understudy(&["catalogue", "export", "--output", &nowhere]);
    assert!(answer.errors.contains("U0602"), "{}", answer.errors);
    let printed = understudy(&["catalogue", "export", "--output", "/dev/stdout"]);
    assert_eq!(printed.status, 0, "{}", printed.shown());
    let answer = understudy(&["allocate", PAINTING, "--catalogue", &bad]);
    assert_eq!(answer.status, 2);
    assert!(answer.errors.contains("U1107"), "{}", answer.errors);
    fs::write(&database, b"SQLite format 3\0\xff\xfe").expect("written");
    let answer = understudy(&["catalogue", "list", "--catalogue", &database]);
    assert!(answer.errors.contains("U1121"), "{}", answer.errors);
    let answer = understudy(&["catalogue", "show", "CPU 1214"]);
    assert!(answer.errors.contains("CPU 1214C"), "{}", answer.errors);
}

/// Figure 15 of the paper on the deployment of controllers: at least 256 K of RAM.
#[test]
fn a_list_is_searched_by_any_figure() {
    let models = |arguments: &[&str]| -> Vec<String> {
        let answer = understudy(&[&["catalogue", "list", "--json"], arguments].concat());
        assert_eq!(answer.status, 0, "{}", answer.shown());
        let document = answer.json();
        let found = document["result"]["controllers"].as_array().expect("controllers").iter();
        found.map(|found| found["model"].as_str().expect("a model").to_owned()).collect()
    };
    let large = models(&["--vendor", "Z-World", "--require", "data_memory>=256KiB"]);
    assert_eq!(large, ["BL2600 Wolf", "BL2610 Wolf"]);
    assert_eq!(models(&["--vendor", "z-world"]).len(), 9);
    assert_eq!(models(&["--require", "vendor=Z-World", "--require", "outputs>=16"]).len(), 4);
    // An unknown figure decides nothing, and is named.
    let answer = understudy(&["catalogue", "list", "--require", "clock_khz>=1000"]);
    assert!(answer.output.contains("0 of the built-in catalogue"), "{}", answer.shown());
    assert!(answer.output.contains("its clock_khz is unknown"), "{}", answer.shown());
    for wrong in ["colour=red", "remote-io:inputs>=4", "scan_time<=1ms", "clock_khz>=fast"] {
        let answer = understudy(&["catalogue", "list", "--require", wrong]);
        assert_eq!(answer.status, 2, "{wrong}: {}", answer.shown());
        assert!(answer.errors.contains("U1130"), "{wrong}: {}", answer.errors);
    }
}

#[test]
fn a_controller_is_removed_from_a_file_and_no_other_is() {
    let folder = empty_folder("catalogue_remove");
    let file = folder.join("ours.csv").to_str().expect("text").to_owned();
    let add = |vendor: &str, model: &str| {
        let named = ["--vendor", vendor, "--model", model, "--family", "A", "--source", "page 1"];
        let figures = ["digital_inputs=4", "mtbf_hours=200000", "support=until 2035"];
        let to = ["catalogue", "add", "--catalogue", &file];
        let answer = understudy(&[&to[..], &named, &figures].concat());
        assert_eq!(answer.status, 0, "{}", answer.shown());
    };
    for (vendor, model) in [("Works", "A1"), ("Works", "A2"), ("Other", "A1")] {
        add(vendor, model);
    }
    let remove = |name: &str| understudy(&["catalogue", "remove", name, "--catalogue", &file]);
    let before = std::fs::read(&file).expect("a file");
    for (name, code) in [("A9", "U1131"), ("A1", "U1132")] {
        let answer = remove(name);
        assert_eq!(answer.status, 2, "{}", answer.shown());
        assert!(answer.errors.contains(code), "{}", answer.shown());
    }
    assert_eq!(std::fs::read(&file).expect("a file"), before);
    assert_eq!(remove("Works A1").status, 0);
    let left =
        understudy(&["catalogue", "list", "--require", "mtbf_hours>=1", "--catalogue", &file]);
    assert!(
        left.output.contains("Works A2") && left.output.contains("Other A1"),
        "{}",
        left.shown()
    );
    assert!(!left.output.contains("Works A1"), "{}", left.shown());
}

const PLANT: &str = "examples/shared-spare/plant.toml";

/// The example, with one rack less: the spare and the stations of a line cannot be kept apart.
#[test]
fn a_plant_is_placed_by_failure_domain_or_the_domains_are_named() {
    assert_snapshot!(understudy(&["allocate", PLANT]).shown());
    let folder = empty_folder("allocate-plant");
    let source = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/shared-spare");
    for line in ["line-1", "line-2"] {
        fs::create_dir_all(folder.join(line)).expect("a folder");
        for file in ["cluster.toml", "robot.ladder", "press.ladder"] {
            fs::copy(source.join(line).join(file), folder.join(line).join(file)).expect("whole");
        }
    }
    let text = fs::read_to_string(source.join("plant.toml")).expect("the example is whole");
    let plant = folder.join("plant.toml");
    fs::write(&plant, text.replace("\"rack-4\"", "\"rack-1\"")).expect("it is ours");
    let plant = plant.to_str().expect("text");
    let answer = understudy(&["allocate", plant, "--json"]);
    let document = answer.json();
    assert_eq!(document["status"], 1, "{document:#}");
    let failures = document["failures"].as_array().expect("a list");
    let said = |group: &str, failure: &Value| {
        let message = failure["message"].as_str().unwrap_or_default();
        failure["code"] == "U1146"
            && message.starts_with(&format!("group `{group}`: "))
            && message.ends_with(
                "share rack `rack-1`: the group has 4 roles with its spares, and there are 3 such domains",
            )
    };
    for group in ["line-1", "line-2"] {
        assert!(failures.iter().any(|failure| said(group, failure)), "{failures:#?}");
    }
    // Without machines there is nothing to place on, and options of the catalogue are not ignored.
    let bare = text.split("[[machine]]").next().expect("a beginning");
    fs::write(plant, bare).expect("it is ours");
    let document = understudy(&["allocate", plant, "--json"]).json();
    assert_eq!(document["failures"][0]["code"], "U1147", "{document:#}");
    let document = understudy(&["allocate", PLANT, "--stock", "CPU 224=2", "--json"]).json();
    assert_eq!(document["failures"][0]["code"], "U0600", "{document:#}");
}

/// A remote I/O and its twin are never in one domain, nor one of them with a station that computes their program; where the plant has too few domains, it is
/// said which share one.
#[test]
fn twins_are_placed_in_domains_of_their_own() {
    let folder = empty_folder("allocate-twins");
    let source = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/twin-remote-io");
    for file in ["robot.ladder", "press.ladder"] {
        fs::copy(source.join(file), folder.join(file)).expect("whole");
    }
    let cluster = fs::read_to_string(source.join("parallel.toml")).expect("whole");
    let slot = "[[understudy]]\nname = \"spare\"\nspare = true\n\n[[remote_io]]";
    fs::write(folder.join("cluster.toml"), cluster.replacen("[[remote_io]]", slot, 1))
        .expect("it is ours");
    let plant_of = |machines: &[(&str, &str)]| {
        let mut text = "[[group]]\nname = \"cell\"\ncluster = \"cluster.toml\"\n\
            [[spare]]\nname = \"spare-1\"\ngroups = { cell = \"spare\" }\n"
            .to_owned();
        for (number, (rack, more)) in machines.iter().enumerate() {
            text += &format!("[[machine]]\nname = \"m{number}\"\nrack = \"{rack}\"\n{more}\n");
        }
        let plant = folder.join("plant.toml");
        fs::write(&plant, text).expect("it is ours");
        plant.to_str().expect("text").to_owned()
    };
    let (room, none) = ("remote_ios = 2", "");
    // Remote I/Os in racks of their own; next to a station of the other program; and where two racks are too few for the stations.
    let apart =
        [("r1", none), ("r2", none), ("r3", none), ("r4", none), ("r5", room), ("r6", room)];
    let shared = [("r1", room), ("r2", room), ("r3", room), ("r4", none)];
    let few = ["r1", "r2"].map(|rack| (rack, "remote_ios = 2\nstations = 4"));
    let placed = |document: &Value, role: &str| -> String {
        let roles = document["result"]["placed"].as_array().expect("a list");
        let found = roles.iter().find(|it| it["role"] == role).expect(role);
        found["rack"].as_str().expect("a rack").to_owned()
    };
    for machines in [&apart[..], &shared, &few] {
        let document = understudy(&["allocate", &plant_of(machines), "--json"]).json();
        let is_possible = machines.len() > few.len();
        assert_eq!(document["status"], i32::from(!is_possible), "{document:#}");
        for name in ["robot", "press"] {
            let first = placed(&document, &format!("cell/{name}-io"));
            let twin = placed(&document, &format!("cell/{name}-io-2"));
            assert_ne!(first, twin, "{document:#}");
            for station in [name, "understudy"].map(|it| format!("cell/{it}")) {
                let station = placed(&document, &station);
                assert!(!is_possible || station != first && station != twin, "{document:#}");
            }
        }
    }
    // All in one rack: each pair is named once.
    let document = understudy(&["allocate", &plant_of(&[("r1", room), ("r1", room)]), "--json"]);
    let document = document.json();
    let failures = document["failures"].as_array().expect("a list");
    let of_pair = failures.iter().filter(|it| {
        let message = it["message"].as_str().unwrap_or_default();
        message.starts_with("the remote I/Os of `cell/robot`: cell/robot-io and cell/robot-io-2")
            && message.ends_with("2 members must be apart, and there are 1 such domains")
    });
    assert_eq!(of_pair.count(), 1, "{failures:#?}");
    // Without room for remote I/Os they are not placed, and that is said.
    let shown = understudy(&["allocate", &plant_of(&apart[..4])]).shown();
    assert!(shown.contains("are not placed: no [[machine]] has `remote_ios`"), "{shown}");
}
