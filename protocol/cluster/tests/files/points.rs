//! Online changes in which points differ: which points stay, and why some programs cannot have others while they run.

use understudy_cluster::{
    ChangeTexts, ChangedPoint, Cluster, FixedPoints, NeedsStop, PointFate, Unfit, Way,
    change_with_points, changed_fallbacks, changed_points, later_settings,
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
    cluster_of(left, RIGHT, keys, rest)
}

fn cluster_of(left: &str, right: &str, keys: &str, rest: &str) -> Cluster {
    cluster_with(left, right, "", keys, rest)
}

/// `controller` are keys of the controller `left`, and `keys` those of its remote I/O.
fn cluster_with(left: &str, right: &str, controller: &str, keys: &str, rest: &str) -> Cluster {
    let text = format!(
        "[cluster]\nname = \"cell\"\nperiod = \"20ms\"\nMODE\n[[controller]]\nname = \"left\"\nladder = \"left.st\"\n{controller}\n[[controller]]\n\
         name = \"right\"\nladder = \"right.st\"\n[[remote_io]]\ncontroller = \"left\"\n{keys}\n{rest}"
    );
    let mode = if rest.contains("# paper") { "mode = \"paper\"" } else { "" };
    let files = [("left.st", left), ("right.st", right), ("plant.st", PLANT)];
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
        point(
            "level",
            false,
            PointFate::Sourced(two(
                "setpoint from 0 to 9, initial 0",
                "setpoint from 0 to 5, initial 0",
            )),
        ),
        point("level", false, PointFate::Unkept(two("a value from 0 to 5", "0"))),
        point("extra", false, PointFate::New("REAL".to_owned(), None)),
        point("shown", true, PointFate::Retyped(two("INT", "DINT"), some("`8`"))),
        point("done", true, PointFate::Removed("BOOL".to_owned(), some("`TRUE`"))),
        point("more", true, PointFate::New("BOOL".to_owned(), some("`TRUE`"))),
    ];
    assert_eq!(changed_points(&before, &after, ProgramId(0), Way::There), expected);
    assert_eq!(changed_points(&before, &before, ProgramId(0), Way::There), []);
    // Where a point is in an image is no news, and settings of points that stay are listed with the others.
    let moved = cluster(&other(), "hold_cycles = 9\nfail_safe = { done = true }", "");
    let plain = cluster(LEFT, "", "");
    let more = point("more", true, PointFate::New("BOOL".to_owned(), some("`FALSE`")));
    assert_eq!(changed_points(&plain, &moved, ProgramId(0), Way::There), [more]);
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

/// What a change that needs a stop says of it.
fn refused(before: &Cluster, after: &Cluster) -> Vec<String> {
    let reasons = ChangeTexts::between(before, after).expect_err("it needs a stop");
    assert!(reasons.iter().all(|reason| reason.code() == "U0630"), "{reasons:?}");
    reasons.iter().map(ToString::to_string).collect()
}

/// A remote I/O learns when it starts which other programs it reads, and has keys for those alone: a first or a last signal of a program needs a stop, and one
/// more of a program that it reads does not.
#[test]
fn a_program_that_reads_other_programs_needs_a_stop() {
    let right = |body: &str, inputs: &str| {
        let program = RIGHT
            .replace("go : BOOL;", "go : BOOL; more : BOOL; level : INT;")
            .replace("on := go;", body);
        let keys = format!("[[remote_io]]\ncontroller = \"right\"\n{inputs}");
        cluster_of(LEFT, &program, "", &keys)
    };
    let go = "inputs.go = { from = \"left.done\", default = false }\n";
    let level = "inputs.level = { from = \"left.shown\", default = 3 }\n";
    let none = right("on := go;", "");
    let one = right("on := more;", go);
    let two = right("on := go AND more;", &format!("{go}{level}"));
    let why = "the inputs or outputs of `right` cannot change while it runs: it reads other programs than before, and a remote I/O learns which ones when it starts";
    for (before, after) in [(&none, &one), (&one, &none), (&none, &two)] {
        assert_eq!(refused(before, after), [why]);
    }
    check_texts(&one, &two);
    check_texts(&two, &one);
    // Signals of other groups are passed on by a gateway, under the names that its own file has.
    let group = |input: &str, from: &str, cycles: u32| {
        format!(
            "inputs.{input} = {{ from = \"{from}\", default = false, stale_after = {cycles} }}\n"
        )
    };
    let first = right("on := go;", &group("go", "hall/press.done", 50));
    for inputs in [
        String::new(),
        group("go", "hall/press.ready", 50),
        group("go", "hall/press.done", 60),
        group("more", "hall/press.done", 50),
    ] {
        let after = right("on := go AND more;", &inputs);
        let reasons = refused(&first, &after);
        assert!(reasons[0].contains("other signals of other groups"), "{reasons:?}");
        assert_eq!(reasons.len(), 1, "{reasons:?}");
    }
    let stays = format!(
        "{}inputs.level = {{ operator = \"setpoint\", low = 0, high = 9 }}",
        group("go", "hall/press.done", 50)
    );
    check_texts(&first, &right("on := go AND more;", &stays));
}

/// A point that has another name, by a declared pair or in another case of letters, is the same one: its value goes on, and so does what is held of it.
#[test]
fn points_with_other_names_stay_by_the_declared_pairs() {
    let renamed = |pairs: &str, level: &str, done: &str| {
        let program = LEFT
            .replace("level : INT;", &format!("{level} : INT;"))
            .replace("done : BOOL;", &format!("{done} : BOOL;"))
            .replace("shown := level;", &format!("shown := {level};"))
            .replace("done := go;", &format!("{done} := go;"));
        let keys = format!(
            "fail_safe = {{ {done} = true }}\ninputs.{level} = {{ operator = \"setpoint\", low = 0, high = 9 }}"
        );
        let controller = format!("renamed = {{ {pairs} }}");
        (program, keys, controller)
    };
    let of = |(program, keys, controller): (String, String, String)| {
        cluster_with(&program, RIGHT, &controller, &keys, "")
    };
    let before = of(renamed("", "level", "done"));
    for (pairs, level, done) in [
        ("level = \"wanted\", done = \"ready\"", "wanted", "ready"),
        ("LEVEL = \"Wanted\", Done = \"READY\"", "wanted", "ready"),
        ("", "Level", "DONE"),
    ] {
        let after = of(renamed(pairs, level, done));
        let change = change_with_points(&before, &after).expect("an online change");
        let points = change.of(ProgramId(0)).expect("it changes").points.as_ref();
        let points = points.expect("they have other names");
        // Each input and each output, and those of its program fault.
        assert_eq!((points.inputs.len(), points.outputs.len()), (3, 3), "{pairs}");
        let told = changed_points(&before, &after, ProgramId(0), Way::There);
        let told: Vec<String> = told.iter().map(|it| format!("{} {it}", it.fate.word())).collect();
        let expected = [
            format!("renamed input {level}  from level"),
            format!("renamed output {done}  from done"),
        ];
        assert_eq!(told, expected, "{pairs}");
        check_texts(&before, &after);
    }
    // Without a pair they are other ones.
    let after = of(renamed("", "wanted", "ready"));
    let points = change_with_points(&before, &after).expect("an online change");
    let points = points.of(ProgramId(0)).expect("it changes").points.clone().expect("others");
    assert_eq!((points.inputs.len(), points.outputs.len()), (2, 2));
}

/// Limits, places and scales that change without the program: nothing tells from which cycle on they would count.
#[test]
fn other_places_of_the_same_program_need_a_stop() {
    let with = |keys: &str, field: &str| {
        let device = format!("field = {{ modbus = \"127.0.0.1:1502\", outputs = {{ {field} }} }}");
        cluster(LEFT, &format!("{keys}\n{device}"), "")
    };
    let limits =
        |high: u32| format!("inputs.level = {{ operator = \"setpoint\", low = 0, high = {high} }}");
    let scaled =
        |scale: &str| format!("shown = {{ at = \"holding:1\", as = \"int\", scale = {scale} }}");
    let before = with(&limits(9), &scaled("1.0"));
    for (after, told) in [
        (
            with(&limits(5), &scaled("1.0")),
            "sourced input level  from: setpoint from 0 to 9, initial 0; now: setpoint from 0 to 5, initial 0; narrowed input level  a value from 0 to 5 is kept of what was written, and anything else becomes 0",
        ),
        (
            with(&limits(9), &scaled("0.1")),
            "moved output shown  holding:1 int to holding:1 int, scale 0.1, offset 0",
        ),
        (with(&limits(9), ""), "moved output shown  holding:1 int to none"),
    ] {
        let reasons = refused(&before, &after);
        let why = "inputs or outputs of `left` change, and its program does not: only a changed program brings others while it runs";
        assert_eq!(reasons, [format!("{why} ({told})")]);
    }
    let none = cluster(LEFT, &limits(9), "");
    let reasons = refused(&before, &none);
    assert!(reasons[1].ends_with("only one of the files has a device for it"), "{reasons:?}");
    // With another program, a device at another address would have its places driven in the old one.
    let other = other();
    let moved = |address: &str, unit: u32| {
        let field = format!(
            "field = {{ modbus = \"{address}\", unit = {unit}, outputs = {{ {} }} }}",
            scaled("0.1")
        );
        cluster(&other, &format!("{}\n{field}", limits(9)), "")
    };
    check_texts(&before, &moved("127.0.0.1:1502", 1));
    for after in [moved("127.0.0.1:1503", 1), moved("127.0.0.1:1502", 2)] {
        let reasons = refused(&before, &after);
        assert!(reasons[0].contains("its device has another address or unit"), "{reasons:?}");
    }
}

/// Each key of the file that no online change touches is told, or is one of a link, which needs a stop.
#[test]
fn what_counts_with_the_next_start_is_told() {
    let with = |head: &str, keys: &str, rest: &str| {
        let text = format!(
            "[cluster]\nname = \"cell\"\nperiod = \"20ms\"\n{head}\n[[controller]]\nname = \"left\"\nladder = \"left.st\"\n\
             [[remote_io]]\ncontroller = \"left\"\n{keys}\n{rest}"
        );
        let files = [("left.st", LEFT), ("plant.st", PLANT)];
        let loaded = load(&text, &files);
        let found = findings(&loaded.reports);
        loaded.cluster.unwrap_or_else(|| panic!("{found}\n{text}"))
    };
    let input = |more: &str| {
        format!("inputs.level = {{ operator = \"setpoint\", low = 0, high = 9{more} }}")
    };
    let field = |more: &str| {
        format!(
            "field = {{ modbus = \"127.0.0.1:1502\", inputs = {{ go = \"discrete:0\" }}{more} }}"
        )
    };
    let alarm = |limit: u32| {
        format!("[[alarm]]\nsignal = \"left.level\"\nabove = {limit}\ntext = \"high\"\n")
    };
    let plain = with("", &input(""), "");
    for (before, after, told) in [
        (
            &plain,
            with("", &input(", title = \"Level\""), ""),
            "`inputs.level.title` of remote I/O `left-io` changes from `none` to `Level`",
        ),
        (
            &plain,
            with("", &input(", confirm = true"), ""),
            "`inputs.level.confirm` of remote I/O `left-io` changes from `false` to `true`",
        ),
        (
            &plain,
            with("retain_every = \"2s\"", &input(""), ""),
            "`retain_every` of the cluster changes from `1s` to `2s`",
        ),
        (
            &plain,
            with("spin = true", &input(""), ""),
            "`spin` of the cluster changes from `false` to `true`",
        ),
        (&plain, with("", &input(""), &alarm(5)), "only the new file has alarm `left.level`"),
        (
            &with("", &input(""), &alarm(5)),
            with("", &input(""), &alarm(6)),
            "the condition of alarm `left.level` changes from `above 5, over at 5` to `above 6, over at 6`",
        ),
        (
            &plain,
            with("", &format!("address = \"127.0.0.1:7700\"\n{}", input("")), ""),
            "`address` of remote I/O `left-io` changes from `none` to `127.0.0.1:7700`",
        ),
        (
            &with("", &field(""), ""),
            with("", &field(", unit = 7"), ""),
            "`unit` of remote I/O `left-io` changes from `1` to `7`",
        ),
        (
            &with("", &field(""), ""),
            with("", &field(", timeout = \"50ms\""), ""),
            "`timeout` of remote I/O `left-io` changes from `100ms` to `50ms`",
        ),
    ] {
        let found: Vec<String> =
            later_settings(before, &after).iter().map(ToString::to_string).collect();
        assert_eq!(found, [told]);
        let texts = ChangeTexts::between(before, &after).expect("nothing needs a stop");
        assert!(texts.touched().is_empty(), "{told}");
        assert_eq!(later_settings(before, before), []);
    }
    for (head, told) in [
        ("link = \"zenoh\"", "`link` of the cluster changes from `udp` to `zenoh`"),
        ("security = \"off\"", "`security` of the cluster changes from `keys` to `off`"),
        (
            "multicast = \"239.192.0.0:7600\"",
            "`multicast` of the cluster changes from `none` to `239.192.0.0:7600`",
        ),
    ] {
        assert_eq!(refused(&plain, &with(head, &input(""), "")), [told]);
    }
}

/// Limits that have every value of the old ones lose nothing. Narrower ones, another kind and another type do, and so does the way back from wider ones.
#[test]
fn what_an_operator_has_written_is_kept_or_listed() {
    let with = |input: &str, of: &str, body: &str| {
        let text =
            LEFT.replace("level : INT;", &format!("level : {of};")).replace("done := go;", body);
        cluster(&text, &format!("inputs = {{ level = {{ {input} }} }}"), "")
    };
    let wide = "operator = \"setpoint\", low = 0, high = 9, initial = 3";
    let unkept = |before: &Cluster, after: &Cluster, way| {
        let all = changed_points(before, after, ProgramId(0), way);
        let unkept = all.into_iter().filter_map(|point| match point.fate {
            PointFate::Unkept([kept, now]) => Some(format!("{} {kept}: {now}", point.name)),
            _ => None,
        });
        unkept.collect::<Vec<_>>()
    };
    let before = with(wide, "INT", "done := go;");
    let other = |input: &str, of: &str| with(input, of, "done := NOT go;");
    for (input, of, there, back) in [
        (wide, "INT", vec![], vec![]),
        (
            "operator = \"setpoint\", low = -1, high = 20, initial = 4",
            "INT",
            vec![],
            vec!["level a value from 0 to 9: 3"],
        ),
        (
            "operator = \"setpoint\", low = 2, high = 9, initial = 4",
            "INT",
            vec!["level a value from 2 to 9: 4"],
            vec![],
        ),
        (wide, "DINT", vec!["level nothing: 3"], vec!["level nothing: 3"]),
    ] {
        let after = other(input, of);
        assert_eq!(unkept(&before, &after, Way::There), there, "{input}");
        assert_eq!(unkept(&after, &before, Way::Back), back, "{input}");
    }
}
