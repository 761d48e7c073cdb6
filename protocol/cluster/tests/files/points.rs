//! Online changes in which points differ: which points stay, and why some programs cannot have others while they run.

use understudy_cluster::{
    ChangeTexts, ChangedPoint, Cluster, FixedPoints, NeedsStop, PointFate, Unfit,
    change_with_points, changed_fallbacks, changed_points,
};
use understudy_cycle::{Moved, PointPlace};
use understudy_typed::Elementary;
use understudy_wire::ProgramId;

use crate::common::{findings, load};

const LEFT: &str = "PROGRAM left
VAR_INPUT go : BOOL; level : INT; END_VAR
VAR_OUTPUT shown : INT; done : BOOL; END_VAR
shown := level;
done := go;
END_PROGRAM";

const RIGHT: &str = "PROGRAM right
VAR_INPUT go : BOOL; END_VAR
VAR_OUTPUT on : BOOL; END_VAR
on := go;
END_PROGRAM";

fn cluster(left: &str, keys: &str, rest: &str) -> Cluster {
    let text = format!(
        "[cluster]\nname = \"cell\"\nperiod = \"20ms\"\nMODE\n[[controller]]\nname = \"left\"\nladder = \"left.st\"\n[[controller]]\n\
         name = \"right\"\nladder = \"right.st\"\n[[remote_io]]\ncontroller = \"left\"\n{keys}\n{rest}"
    );
    let mode = if rest.contains("# paper") { "mode = \"paper\"" } else { "" };
    let files = [("left.st", left), ("right.st", RIGHT), ("plant.st", PLANT)];
    let loaded = load(&text.replace("MODE", mode), &files);
    let found = findings(&loaded.reports);
    loaded.cluster.unwrap_or_else(|| panic!("{found}\n{text}"))
}

const PLANT: &str = "PROGRAM plant
VAR_INPUT done : BOOL; END_VAR
VAR_OUTPUT go : BOOL; END_VAR
go := NOT done;
END_PROGRAM";

/// The points of the other program in another order, with an output more.
fn other() -> String {
    LEFT.replace("go : BOOL; level : INT;", "level : INT; go : BOOL;")
        .replace("done : BOOL;", "done : BOOL; more : BOOL;")
}

/// A member loads the change from its texts, whichever of the two files it has, and each file becomes the other one by them.
fn check_texts(before: &Cluster, after: &Cluster) {
    let expected = change_with_points(before, after).expect("an online change");
    let texts = ChangeTexts::between(before, after).expect("an online change");
    let json = serde_json::to_string(&texts).expect("JSON");
    let texts: ChangeTexts = serde_json::from_str(&json).expect("what was written");
    for (own, other) in [(before, after), (after, before)] {
        let change = texts.load(own).expect("it is of this cluster");
        assert_eq!(change, expected);
        assert_eq!(change.fallbacks, expected.fallbacks);
        for (found, expected) in change.programs.iter().zip(&expected.programs) {
            assert_eq!(found.points, expected.points);
            let known = [before, after].map(|it| it.points_hash(found.program));
            assert_eq!(found.known_by.map(Some), known);
            let hashes = [found, expected].map(|it| (it.before.hash, it.after.hash));
            assert_eq!(hashes[0], hashes[1]);
        }
        let to = other.agreement().configuration;
        let changed = own.changed(&texts, to).expect("it is of this cluster");
        assert_eq!(changed.canonical_text(), other.canonical_text());
        assert_eq!(changed.agreement().configuration, to);
        for program in [0, 1].map(ProgramId) {
            assert_eq!(changed.layout(program), other.layout(program));
            let [found, wanted] = [&changed, other].map(|it| &it.remote_ios()[program.index()]);
            assert_eq!((&found.field, &found.fallback), (&wanted.field, &wanted.fallback));
        }
    }
}

/// Sources of inputs, fail-safe values and the places in a device, all of which change with the points.
#[test]
fn a_member_reads_the_new_points_from_the_texts() {
    let device = |inputs: &str, outputs: &str| {
        format!(
            "field = {{ modbus = \"127.0.0.1:1502\", inputs = {{ {inputs} }}, outputs = {{ {outputs} }} }}"
        )
    };
    let old = "fail_safe = { shown = 7 }\ninputs = { level = { operator = \"setpoint\", low = 0, high = 9, title = \"Level\" } }\n";
    let new = "fail_safe = { shown = 8, more = true }\nhold_cycles = 9\nramp = { shown = 5 }\n\
        inputs = { level = { operator = \"setpoint\", low = 1, high = 9, initial = 3 } }\n";
    let with = |left: &str, keys: &str, inputs: &str, outputs: &str| {
        cluster(left, &format!("{keys}{}", device(inputs, outputs)), "")
    };
    let before = with(LEFT, old, "go = \"discrete:1\"", "done = \"coil:2\"");
    let outputs = "done = \"coil:2\", more = \"coil:3\", shown = \"holding:9 int\"";
    let after = with(&other(), new, "go = \"discrete:4\"", outputs);
    check_texts(&before, &after);
    // Inputs in another order than that of the alphabet, which counts in the configuration.
    let ordered = "inputs = { level = { operator = \"setpoint\", low = 1, high = 9 }, go = { operator = \"level\" } }\n";
    check_texts(&before, &with(&other(), ordered, "", outputs));
    // The same points at other places of the device.
    let moved = LEFT.replace("done := go;", "done := NOT go;");
    let moved = with(&moved, old, "go = \"discrete:8\"", "done = \"coil:2\"");
    let change = change_with_points(&before, &moved).expect("an online change");
    assert!(change.of(ProgramId(0)).expect("it changes").points.is_some());
    check_texts(&before, &moved);
    // A device that is new needs a stop.
    let reasons = change_with_points(&cluster(LEFT, old, ""), &moved).expect_err("a stop");
    let why = FixedPoints::Device;
    assert_eq!(reasons, [NeedsStop::Unfit(Unfit::Fixed { program: "left".to_owned(), why })]);
}

#[test]
fn points_stay_by_name_and_type() {
    let check =
        |after: &str, inputs: &[(u16, u16, Elementary)], outputs: &[(u16, u16, Elementary)]| {
            let after = LEFT
                .replace("go : BOOL; level : INT;", after)
                .replace("shown := level;", "")
                .replace("done := go;", "");
            let (before, after) = (cluster(LEFT, "", ""), cluster(&after, "", ""));
            let change = change_with_points(&before, &after).expect("an online change");
            let points = change.of(ProgramId(0)).expect("it changes").points.as_ref();
            let points = points.expect("its points change");
            let moved = |all: &[(u16, u16, Elementary)]| -> Vec<Moved> {
                let place = |bit, of| PointPlace { bit, of };
                let moved = all.iter().map(|&(before, after, of)| Moved {
                    before: place(before, of),
                    after: place(after, of),
                });
                moved.collect()
            };
            // Behind them are the points of its program fault.
            assert_eq!(points.inputs[..points.inputs.len() - 1], moved(inputs));
            assert_eq!(points.outputs[..points.outputs.len() - 1], moved(outputs));
            check_texts(&before, &after);
        };
    let outputs = [(0, 0, Elementary::Int), (16, 16, Elementary::Bool)];
    let [go, level] = [(0, 16, Elementary::Bool), (16, 0, Elementary::Int)];
    check("level : INT; go : BOOL;", &[go, level], &outputs);
    check("level : UINT; go : BOOL;", &[go], &outputs);
    check("go2 : BOOL; level : INT;", &[(16, 16, Elementary::Int)], &outputs);
    // A subrange is of the same type: the program reads a value beyond it as its end.
    check("level : INT (0..9); go : BOOL;", &[go, level], &outputs);
}

/// The plan names each point that changes as people know it: by its name, its type, its place in the device and what it comes from.
#[test]
fn points_that_change_are_listed_for_people() {
    let keys = |fail_safe: &str, level: &str, inputs: &str, outputs: &str| {
        format!(
            "fail_safe = {{ {fail_safe} }}\ninputs = {{ level = {{ operator = \"setpoint\", low = 0, high = {level} }} }}\n\
             field = {{ modbus = \"127.0.0.1:1502\", inputs = {{ {inputs} }}, outputs = {{ {outputs} }} }}"
        )
    };
    let old = keys("shown = 7, done = true", "9", "go = \"discrete:1\"", "done = \"coil:2\"");
    let new = keys("shown = 8, more = true", "5", "go = \"discrete:4\"", "more = \"coil:2\"");
    let text = LEFT
        .replace("go : BOOL; level : INT;", "level : INT; go : BOOL; extra : REAL;")
        .replace("shown : INT; done : BOOL;", "shown : DINT; more : BOOL;")
        .replace("done := go;", "more := go;");
    let (before, after) = (cluster(LEFT, &old, ""), cluster(&text, &new, ""));
    let point =
        |name: &str, is_output, fate| ChangedPoint { name: name.to_owned(), is_output, fate };
    let two = |one: &str, other: &str| [one.to_owned(), other.to_owned()];
    let some = |value: &str| Some(value.to_owned());
    let expected = [
        point("go", false, PointFate::Moved(two("discrete:1", "discrete:4"))),
        point("level", false, PointFate::Sourced),
        point("extra", false, PointFate::New("REAL".to_owned(), None)),
        point("shown", true, PointFate::Retyped(two("INT", "DINT"))),
        point("done", true, PointFate::Removed("BOOL".to_owned(), some("`TRUE`"))),
        point("more", true, PointFate::New("BOOL".to_owned(), some("`TRUE`"))),
    ];
    assert_eq!(changed_points(&before, &after, ProgramId(0)), expected);
    assert_eq!(changed_points(&before, &before, ProgramId(0)), []);
    // Where a point is in an image is no news, and settings of points that stay are listed with the others.
    let moved = cluster(&other(), "hold_cycles = 9\nfail_safe = { done = true }", "");
    let plain = cluster(LEFT, "", "");
    let more = point("more", true, PointFate::New("BOOL".to_owned(), some("`FALSE`")));
    assert_eq!(changed_points(&plain, &moved, ProgramId(0)), [more]);
    let texts = ChangeTexts::between(&plain, &moved).expect("an online change");
    let settings = changed_fallbacks(&plain, &moved, &texts);
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    assert_eq!(
        settings,
        [
            "`hold_cycles` of remote I/O `left-io` changes from `3` to `9`",
            "`fail_safe.done` of remote I/O `left-io` changes from `FALSE` to `TRUE`",
        ]
    );
}

/// Two points that change their names have the same bits, and other meanings.
#[test]
fn points_that_exchange_their_names_change() {
    let text = LEFT.replace("level : INT;", "level : INT; other : INT;");
    let swapped = LEFT.replace("level : INT;", "other : INT; level : INT;");
    let change = change_with_points(&cluster(&text, "", ""), &cluster(&swapped, "", ""));
    let change = change.expect("an online change");
    assert!(change.of(ProgramId(0)).expect("it changes").points.is_some());
}

/// The same points with another program: nothing becomes of them.
#[test]
fn points_of_another_body_stay() {
    let body = LEFT.replace("done := go;", "done := NOT go;");
    let change = change_with_points(&cluster(LEFT, "", ""), &cluster(&body, "", ""));
    let change = change.expect("an online change");
    assert!(change.of(ProgramId(0)).expect("it changes").points.is_none());
    assert_eq!(change.fallbacks, []);
    check_texts(&cluster(LEFT, "", ""), &cluster(&body, "", ""));
}

/// A value of an enumeration more, or another case of its letters, leaves the points, with and without a device, and keeps their values.
#[test]
fn points_with_more_names_of_values_stay() {
    let text =
        |values: &str| format!("TYPE Mode : ({values}); END_TYPE {LEFT}").replace("INT;", "Mode;");
    let device = "field = { modbus = \"127.0.0.1:1502\", inputs = { level = \"holding:1 int\" }, outputs = { shown = \"holding:2 int\" } }";
    for keys in ["", device] {
        for (values, stays) in [("Off, Auto, Man", true), ("off, auto", true), ("Auto, Off", false)]
        {
            let (before, after) =
                (cluster(&text("Off, Auto"), keys, ""), cluster(&text(values), keys, ""));
            let change = change_with_points(&before, &after).expect("an online change");
            let changed = change.of(ProgramId(0)).expect("it changes");
            assert_eq!(changed.points.is_none(), stays, "{values}");
            assert_ne!(changed.known_by[0], changed.known_by[1], "{values}");
            if keys.is_empty() {
                check_texts(&before, &after);
            }
        }
    }
}

/// Who names a point says by which file: another name, place, type or name of a value is another file, and nothing else is.
#[test]
fn points_are_known_by_names_places_and_types() {
    let known = |text: &str| cluster(text, "", "").points_hash(ProgramId(0)).expect("a program");
    let modes = format!("TYPE Mode : (Off, Auto); END_TYPE {LEFT}")
        .replace("level : INT;", "level : Mode;");
    let modes = modes.replace("shown : INT;", "shown : Mode;");
    let base = [known(LEFT), known(&modes)];
    assert_eq!(known(&LEFT.replace("done := go;", "done := NOT go;")), base[0]);
    for (text, base) in [
        (LEFT.replace("level", "other"), base[0]),
        (LEFT.replace("go : BOOL; level : INT;", "level : INT; go : BOOL;"), base[0]),
        (LEFT.replace("INT", "UINT"), base[0]),
        (LEFT.replace("level : INT;", "level : INT (0..9);"), base[0]),
        (LEFT.replace("done : BOOL;", "done : BOOL; more : BOOL;"), base[0]),
        (modes.replace("Off, Auto", "Auto, Off"), base[1]),
        (modes.replace("Off, Auto", "Off, Auto, Man"), base[1]),
    ] {
        assert_ne!(known(&text), base, "{text}");
    }
}

#[test]
fn some_points_need_a_stop() {
    let plant = "[[plant]]\ncontroller = \"left\"\nladder = \"plant.st\"\n";
    let reads = "[[remote_io]]\ncontroller = \"right\"\n[remote_io.inputs]\ngo = { from = \"left.done\", default = false }\n";
    for (keys, rest, expected) in [
        ("twin = { name = \"left-io-2\", wiring = \"exclusive\" }", "", FixedPoints::Twin),
        ("", plant, FixedPoints::Plant),
        ("", reads, FixedPoints::ReadByAnother),
        ("", "# paper", FixedPoints::PaperMode),
    ] {
        let [before, after] = [LEFT, &other()].map(|left| cluster(left, keys, rest));
        let reasons = change_with_points(&before, &after).expect_err("it needs a stop");
        let found: Vec<FixedPoints> = reasons
            .iter()
            .filter_map(|reason| match reason {
                NeedsStop::Unfit(Unfit::Fixed { program, why }) if program == "left" => Some(*why),
                _ => None,
            })
            .collect();
        assert_eq!(found, [expected], "{reasons:?}");
        assert_eq!(reasons.len(), 1, "{reasons:?}");
        assert!(reasons.iter().all(|reason| reason.code() == "U0630"));
    }
}
