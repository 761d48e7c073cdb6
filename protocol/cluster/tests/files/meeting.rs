//! Where two programs, a device, a plant or a person meet, a number has one type and a range that its receiver knows.

use understudy_executable::{Executable, Interface, Scratch};
use understudy_wire::{Image, ProgramId};

use crate::common::{findings, load};

/// A declaration, its base type, and its least and greatest value.
type Declaration = (&'static str, &'static str, i64, i64);

const DECLARATIONS: [Declaration; 9] = [
    ("INT", "INT", -32_768, 32_767),
    ("INT (-2..3)", "INT", -2, 3),
    ("INT (0..7)", "INT", 0, 7),
    ("INT (-8..7)", "INT", -8, 7),
    ("SINT", "SINT", -128, 127),
    ("UINT", "UINT", 0, 65_535),
    ("UINT (0..7)", "UINT", 0, 7),
    ("DINT", "DINT", -2_147_483_648, 2_147_483_647),
    ("REAL", "REAL", 0, 0),
];

fn fits((_, sent, least, most): Declaration, (_, received, low, high): Declaration) -> bool {
    sent == received && low <= least && most <= high
}

fn program(name: &str, input: &str, output: &str, body: &str) -> String {
    let inputs = if input.is_empty() { "" } else { "VAR_INPUT got : " };
    let end = if input.is_empty() { "" } else { "; END_VAR" };
    format!(
        "PROGRAM {name}\n{inputs}{input}{end}\nVAR_OUTPUT sent : {output}; END_VAR\n{body}\nEND_PROGRAM\n"
    )
}

const CONTROLLERS: &str = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n[[controller]]\nname = \"two\"\nladder = \"two.st\"\n";

const PLANTS: &str = "[[plant]]\ncontroller = \"one\"\nname = \"first\"\nladder = \"first.st\"\nsignals = { got = \"sent\", sent = \"got\" }\n[[plant]]\ncontroller = \"two\"\nname = \"second\"\nladder = \"second.st\"\n";

/// The cluster file and the types of `one`'s input and output, `first`'s input and output, `two`'s input, and `second`'s input.
fn places(sender: &str, receiver: &str) -> Vec<(&'static str, String, [String; 6], &'static str)> {
    let same = |of: &str| of.to_owned();
    let signal = format!(
        "{CONTROLLERS}[[remote_io]]\ncontroller = \"two\"\n[remote_io.inputs]\ngot = {{ from = \"one.sent\", default = {}, stale_after = 5 }}\n",
        if receiver == "REAL" { "0.0" } else { "0" }
    );
    let plants = format!("{CONTROLLERS}{PLANTS}");
    let follows =
        format!("{plants}signals = {{ sent = \"got\" }}\nfollows = {{ got = \"first.got\" }}\n");
    let direct = format!("{plants}signals = {{ got = \"sent\", sent = \"got\" }}\n");
    let [s, r] = [same(sender), same(receiver)];
    let six = |of: [&String; 6]| of.map(String::clone);
    vec![
        ("actuator", direct.clone(), six([&r, &s, &r, &r, &r, &r]), "U0227"),
        ("sensor", direct, six([&r, &s, &s, &s, &r, &r]), "U0227"),
        ("signal", signal, six([&r, &s, &r, &r, &r, &r]), "U0225"),
        ("follows", follows, six([&s, &s, &s, &s, &r, &r]), "U0227"),
    ]
}

#[test]
fn a_number_has_one_meaning_wherever_two_members_meet() {
    for sender in DECLARATIONS {
        for receiver in DECLARATIONS {
            for (place, cluster, types, code) in places(sender.0, receiver.0) {
                let [one_in, one_out, first_in, first_out, two_in, second_in] = types;
                let one = program("one", &one_in, &one_out, "sent := sent;");
                let first = program("first", &first_in, &first_out, "sent := sent;");
                let two = program("two", &two_in, &two_in, "sent := got;");
                let second = program("second", &second_in, &two_in, "sent := sent;");
                let files = [
                    ("one.st", one.as_str()),
                    ("first.st", first.as_str()),
                    ("two.st", two.as_str()),
                    ("second.st", second.as_str()),
                ];
                let found = findings(&load(&cluster, &files).reports);
                let errors: Vec<&str> =
                    found.lines().filter(|line| line.contains(" error ")).collect();
                let case = format!("{place}: {} to {}\n{found}", sender.0, receiver.0);
                if fits(sender, receiver) {
                    assert!(errors.is_empty(), "{case}");
                } else {
                    assert!(!errors.is_empty(), "{case}");
                    let coded = errors.iter().all(|error| error.contains(code));
                    assert!(coded, "{case}");
                }
            }
        }
    }
}

/// The ends of the sender's range, through a plant that gives back what it gets.
#[test]
fn a_negative_number_arrives_as_it_was_sent() {
    for sender in DECLARATIONS {
        for receiver in DECLARATIONS.into_iter().filter(|receiver| fits(sender, *receiver)) {
            for value in [sender.2, sender.3] {
                if sender.1 == "REAL" {
                    continue;
                }
                let body = format!("sent := {value};");
                let one = program("one", receiver.0, sender.0, &body);
                let plant = program("first", receiver.0, receiver.0, "sent := got;");
                let cluster = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n[[plant]]\ncontroller = \"one\"\nladder = \"first.st\"\nsignals = { got = \"sent\", sent = \"got\" }\n";
                let files = [("one.st", one.as_str()), ("first.st", plant.as_str())];
                let loaded = load(cluster, &files);
                let cluster = loaded.cluster.unwrap_or_else(|| {
                    panic!("{} {}: {}", sender.0, receiver.0, findings(&loaded.reports))
                });
                let code = &cluster.controllers()[0].code;
                let (executable, interface): (Executable, Interface) =
                    (code.executable(), code.interface());
                let mut plant = cluster.plant_settings(ProgramId(0)).expect("a plant").plant;
                let mut state = executable.initial().to_vec();
                let inputs = Image::zero(executable.input_count());
                let mut outputs = Image::zero(executable.output_count());
                let mut scratch = Scratch::default();
                executable.step(&mut scratch, &mut state, inputs.words(), outputs.words_mut());
                let field = plant.step(&outputs, 0);
                let point = interface.inputs.find("got").expect("an input");
                let arrived = point.of.signed(point.get(field.sensors.words()));
                assert_eq!(arrived, i128::from(value), "{} to {}", sender.0, receiver.0);
            }
        }
    }
}

const PRESS: &str = "PROGRAM press
VAR_INPUT speed : INT (-5..100); END_VAR
VAR_OUTPUT parts : INT (0..50); END_VAR
parts := speed;
END_PROGRAM
";

#[test]
fn values_of_a_cluster_file_are_within_the_declared_range() {
    for (input, fail_safe, expected) in [
        ("low = -5, high = 100, initial = 60", 50, 0),
        ("low = -6, high = 100", 0, 1),
        ("low = 0, high = 101", 0, 1),
        ("low = 0, high = 100", 51, 1),
        ("low = 0, high = 100", -1, 1),
    ] {
        let cluster = format!(
            "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"press\"\nladder = \"press.st\"\n[[remote_io]]\ncontroller = \"press\"\nfail_safe = {{ parts = {fail_safe} }}\n[remote_io.inputs]\nspeed = {{ operator = \"setpoint\", {input} }}\n"
        );
        let found = findings(&load(&cluster, &[("press.st", PRESS)]).reports);
        assert_eq!(
            found.matches(" error U0204 ").count(),
            expected,
            "{input} {fail_safe}\n{found}"
        );
    }
}

#[test]
fn what_is_counted_is_a_bool() {
    let plant = "PROGRAM plant\nVAR_INPUT sent : INT; END_VAR\nVAR_OUTPUT plant_fault : INT; got : INT; END_VAR\ngot := sent; plant_fault := sent;\nEND_PROGRAM\n";
    let one = program("one", "INT", "INT", "sent := got;");
    let cluster = "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"one\"\nladder = \"one.st\"\n[[plant]]\ncontroller = \"one\"\nladder = \"plant.st\"\n";
    let found = findings(&load(cluster, &[("one.st", &one), ("plant.st", plant)]).reports);
    assert_eq!(found.matches(" error U0227 ").count(), 1, "{found}");
}
