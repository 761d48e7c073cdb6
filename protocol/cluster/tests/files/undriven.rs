//! An input that nothing drives keeps the initial value of its variable, wherever the inputs come from.

use understudy_cluster::typed_value;
use understudy_typed::Elementary;
use understudy_wire::{Image, ProgramId};

use crate::common::{findings, load};

const TANK: &str = "PROGRAM tank
VAR_INPUT a : INT (10..100); b : INT (-9..-5) := -7; c : BOOL := TRUE; d : INT; e : REAL := 1.5; END_VAR
VAR_OUTPUT y : INT; END_VAR
y := a + b + d;
END_PROGRAM";

/// Its plant drives two of the inputs.
const VESSEL: &str = "PROGRAM vessel
VAR_INPUT y : INT; END_VAR
VAR_OUTPUT a : INT (10..100); d : INT; END_VAR
a := 20;
END_PROGRAM";

const INITIAL: [(&str, &str); 5] =
    [("a", "10"), ("b", "-7"), ("c", "TRUE"), ("d", "0"), ("e", "1.5")];

/// What the field of the program shows, the inputs that its remote I/O begins with, and the warnings.
fn read(rest: &str) -> (Option<Image>, Vec<(String, String)>, String) {
    let cluster = format!(
        "[cluster]\nname = \"cell\"\n[[controller]]\nname = \"tank\"\nladder = \"tank.st\"\n{rest}"
    );
    let loaded = load(&cluster, &[("tank.st", TANK), ("vessel.st", VESSEL)]);
    let found = findings(&loaded.reports);
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{found}"));
    let settings = cluster.remote_io_settings(ProgramId(0)).expect("a remote I/O");
    let plant = cluster.plant_settings(ProgramId(0)).map(|plant| plant.plant.field().sensors);
    let device = cluster.remote_ios()[0].field.as_ref().map(|device| device.inputs.rest.clone());
    let shown = plant.or(device);
    let image = shown.as_ref().unwrap_or(&settings.layout.undriven);
    let inputs = cluster.controllers()[0].interface.inputs.iter();
    let values = inputs.map(|point| (point.name.clone(), point.of.text(point.get(image.words()))));
    let values = values.filter(|(name, _)| name.len() == 1).collect();
    (shown, values, found)
}

fn expected(changed: &[(&str, &str)]) -> Vec<(String, String)> {
    let values = INITIAL.iter().map(|(name, initial)| {
        let other = changed.iter().find(|(changed, _)| changed == name);
        ((*name).to_owned(), other.map_or(*initial, |(_, value)| value).to_owned())
    });
    values.collect()
}

#[test]
fn inputs_keep_their_initial_values() {
    let (shown, values, found) = read("");
    assert_eq!((shown, values), (None, expected(&[])));
    let message = "they keep their initial values `a` 10, `b` -7, `c` TRUE, `e` 1.5, and 0";
    assert!(found.contains("U0256") && found.contains(message), "{found}");

    let plant = "[[plant]]\ncontroller = \"tank\"\nladder = \"vessel.st\"\n";
    let (_, values, found) = read(plant);
    // The plant shows what it computes.
    assert_eq!(values, expected(&[("a", "20")]));
    let message = "drives the input `b` of `tank`: it keeps its initial value -7";
    assert!(found.contains(message), "{found}");

    let device = "[[remote_io]]\ncontroller = \"tank\"\n[remote_io.field]\nmodbus = \"127.0.0.1:502\"\ninputs = { a = \"holding:1 int\", c = \"discrete:0\" }\noutputs = { y = \"holding:9 int\" }\n";
    let (_, values, found) = read(device);
    // What has a place comes from the device alone.
    assert_eq!(values, expected(&[("a", "0"), ("c", "FALSE")]));
    let message =
        "the input `e` of `tank` has no place in the device: it keeps its initial value 1.5";
    assert!(found.contains(message) && !found.contains("`a` of"), "{found}");
}

/// A number that a REAL cannot hold is none, for defaults, limits, writes and forces alike: an input is finite.
#[test]
fn no_value_is_infinite() {
    for (text, of, is_one) in [
        ("1e38", Elementary::Real, true),
        ("-3.5e38", Elementary::Real, false),
        ("1e300", Elementary::Real, false),
        ("1e300", Elementary::Lreal, true),
        ("1e400", Elementary::Lreal, false),
        ("inf", Elementary::Real, false),
        ("NaN", Elementary::Lreal, false),
    ] {
        assert_eq!(typed_value(text, &of.into()).is_ok(), is_one, "{text} {of}");
    }
}
