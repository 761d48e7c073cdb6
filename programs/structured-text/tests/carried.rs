//! What a changed program takes over of the retentive values before it.

mod running;

use running::{Running, program};
use understudy_typed::{CarriedState, Fate, Program, Told};

/// A program with some types, declarations and a body.
fn of(types: &str, declarations: &str, body: &str) -> Program {
    program(&format!("{types} PROGRAM main {declarations} {body} END_PROGRAM"))
}

/// The stored value of a part in a state.
fn stored(program: &Program, name: &str, state: &[u64]) -> u64 {
    let part = program.part(name).unwrap_or_else(|| panic!("{name}"));
    part.stored(state).unwrap_or_else(|| panic!("{name} has parts")).1
}

/// What is taken over from the state of `old` after some scans.
fn after(old: &Program, scans: u32, new: &Program) -> CarriedState {
    let mut running = Running::new(old.clone());
    for _ in 0..scans {
        running.scan(&[]);
    }
    new.carried(old, running.state(), Told::ALL, &[])
}

/// The fates, as `fate path`, of all but those that are kept.
fn fates(carried: &CarriedState) -> Vec<String> {
    let paths = carried.paths.iter();
    paths.map(|path| format!("{} {}", path.fate.name(), path.path)).collect()
}

fn check(old: &str, new: &str, wanted: &[&str]) {
    let (old, new) = (of("", old, ""), of("", new, ""));
    assert_eq!(fates(&after(&old, 1, &new)), wanted);
}

#[test]
fn values_keep_their_paths_where_declarations_move() {
    let old = of(
        "",
        "VAR RETAIN a, b : INT; END_VAR VAR n : INT; END_VAR",
        "a := a + 1; b := b + 10; n := n + 1;",
    );
    let new = of(
        "",
        "VAR n : INT := 7; x : LREAL; END_VAR VAR RETAIN fresh : INT := 5; b : DINT; A : INT; END_VAR",
        "b := b + 1; a := a + 1;",
    );
    let carried = after(&old, 3, &new);
    assert_eq!(fates(&carried), ["new fresh", "converted b", "kept A"]);
    let value = |name| stored(&new, name, &carried.state);
    assert_eq!(["a", "b", "n", "fresh"].map(value), [3, 30, 7, 5]);
    // The new program goes on from there.
    let mut running = Running::new(new.clone());
    running.go_on_from(&carried.state);
    running.scan(&[]);
    assert_eq!(["a", "b"].map(|name| stored(&new, name, running.state())), [4, 31]);
}

#[test]
fn a_type_takes_the_values_of_a_narrower_one() {
    let all = [
        ("SINT", "-5", "INT", "-5"),
        ("USINT", "200", "INT", "200"),
        ("UDINT", "4000000000", "LINT", "4000000000"),
        ("DINT", "-70000", "LREAL", "-70000.0"),
        ("INT", "-300", "REAL", "-300.0"),
        ("REAL", "0.1", "LREAL", "REAL_TO_LREAL(REAL#0.1)"),
        ("BYTE", "16#F0", "DWORD", "16#F0"),
        ("STRING[3]", "'abc'", "STRING[20]", "'abc'"),
    ];
    for (before, value, now, wanted) in all {
        let declared = |of: &str| format!("VAR RETAIN x : {of}; END_VAR VAR ok : BOOL; END_VAR");
        let old = of("", &declared(before), &format!("x := {value};"));
        let new = of("", &declared(now), &format!("ok := x = {wanted};"));
        let carried = after(&old, 1, &new);
        assert_eq!(fates(&carried), ["converted x"], "{before} {now}");
        let mut running = Running::new(new.clone());
        running.go_on_from(&carried.state);
        running.scan(&[]);
        assert_eq!(stored(&new, "ok", running.state()), 1, "{before} {now}");
    }
}

#[test]
fn a_type_without_all_values_of_the_old_one_takes_none() {
    for (before, now) in [
        ("(u, v, w)", "(u, v)"),
        ("(u, v, w)", "(w, x)"),
        ("DINT", "INT"),
        ("INT", "UINT"),
        ("UINT", "INT"),
        ("DINT", "REAL"),
        ("LREAL", "REAL"),
        ("INT", "BOOL"),
        ("BOOL", "BYTE"),
        ("WORD", "UINT"),
        ("TIME", "LINT"),
        ("STRING[20]", "STRING[3]"),
        ("TON", "TP"),
        ("INT", "ARRAY [0..0] OF INT"),
        ("ARRAY [0..1] OF INT", "ARRAY [0..1, 0..0] OF INT"),
        ("ARRAY [0..1] OF INT", "ARRAY [5..6] OF INT"),
        ("ARRAY [0..1] OF DINT", "ARRAY [0..1] OF INT"),
    ] {
        let declared = |of: &str| format!("VAR RETAIN x : {of}; END_VAR");
        let (old, new) = (of("", &declared(before), ""), of("", &declared(now), ""));
        let carried = after(&old, 1, &new);
        let fates: Vec<Fate> = carried.paths.iter().map(|path| path.fate).collect();
        // A narrower type takes a value that it has, and needs a yes.
        assert!(matches!(fates[..], [Fate::Dropped | Fate::Narrowed]), "{before} {now}: {fates:?}");
        if fates == [Fate::Narrowed] {
            continue;
        }
        assert_eq!(carried.state[4..], new.initial_state()[4..], "{before} {now}");
    }
}

#[test]
fn what_is_renamed_or_not_retentive_any_more_is_dropped() {
    let cases: [(&str, &str, &[&str]); 4] = [
        (
            "VAR RETAIN hours : INT; END_VAR",
            "VAR RETAIN run_hours : INT; END_VAR",
            &["new run_hours", "dropped hours"],
        ),
        ("VAR RETAIN a : INT; END_VAR", "VAR a : INT; END_VAR", &["dropped a"]),
        ("VAR a : INT; END_VAR", "VAR RETAIN a : INT; END_VAR", &["new a"]),
        ("VAR a : INT; END_VAR", "VAR b : INT; END_VAR", &[]),
    ];
    for (old, new, wanted) in cases {
        check(old, new, wanted);
    }
}

#[test]
fn elements_keep_their_indices() {
    let body = "FOR i := 2 TO 5 DO table[i] := i * 11; END_FOR;";
    let old = of("", "VAR RETAIN table : ARRAY [2..5] OF INT; END_VAR VAR i : INT; END_VAR", body);
    let new = of("", "VAR RETAIN table : ARRAY [0..3] OF DINT := [4(-1)]; END_VAR", "");
    let carried = after(&old, 1, &new);
    let outside = "table outside of [2..3]";
    assert_eq!(
        fates(&carried),
        [
            "converted table[2..3]".to_owned(),
            format!("dropped {outside}"),
            format!("new {outside}")
        ]
    );
    let minus = u64::from(u32::MAX);
    let values = ["table[0]", "table[1]", "table[2]", "table[3]"];
    assert_eq!(values.map(|name| stored(&new, name, &carried.state)), [minus, minus, 22, 33]);
}

#[test]
fn rows_of_a_table_keep_their_indices() {
    let body = "FOR i := 0 TO 2 DO FOR k := 0 TO 1 DO t[i, k] := i * 10 + k; END_FOR; END_FOR;";
    let old =
        of("", "VAR RETAIN t : ARRAY [0..2, 0..1] OF SINT; END_VAR VAR i, k : SINT; END_VAR", body);
    let new = of("", "VAR RETAIN t : ARRAY [1..3, 0..4] OF SINT; END_VAR", "");
    let carried = after(&old, 1, &new);
    assert_eq!(carried.paths[0].path, "t[1..2,0..1]");
    let values = ["t[1,0]", "t[1,1]", "t[2,0]", "t[2,1]", "t[1,2]", "t[3,0]"];
    assert_eq!(values.map(|name| stored(&new, name, &carried.state)), [10, 11, 20, 21, 0, 0]);
}

/// Instances in instances, arrays of blocks, structures in arrays: by member, wherever it is now.
#[test]
fn members_are_found_at_any_depth() {
    let types = |members: &str, body: &str| {
        format!(
            "TYPE pair : STRUCT {members} END_STRUCT; END_TYPE
             FUNCTION_BLOCK inner VAR p : pair; END_VAR VAR count : INT; END_VAR count := count + 1; {body} END_FUNCTION_BLOCK
             FUNCTION_BLOCK outer VAR_IN_OUT link : INT; END_VAR VAR rows : ARRAY [1..2] OF inner; END_VAR
               rows[1](); rows[2](); rows[2](); link := link + 1; END_FUNCTION_BLOCK"
        )
    };
    let declared = "VAR RETAIN o : outer; n : INT; END_VAR";
    let old = of(&types("a : INT; b : INT;", "p.b := 5;"), declared, "o(link := n);");
    let new = of(
        &types("z : LREAL; b : DINT;", ""),
        &format!("VAR pad : LREAL; END_VAR {declared}"),
        "o(link := n);",
    );
    let carried = after(&old, 4, &new);
    let mut wanted = Vec::new();
    for row in ["o.rows[1]", "o.rows[2]"] {
        for part in ["new {}.p.z", "converted {}.p.b", "dropped {}.p.a", "kept {}.count"] {
            wanted.push(part.replace("{}", row));
        }
    }
    wanted.push("kept n".to_owned());
    assert_eq!(fates(&carried), wanted);
    let values = ["o.rows[1].count", "o.rows[2].count", "o.rows[1].p.b", "n"];
    assert_eq!(values.map(|name| stored(&new, name, &carried.state)), [4, 8, 5, 4]);
    // A reference is bound anew: it does not point to where the variable was.
    let mut running = Running::new(new.clone());
    running.go_on_from(&carried.state);
    running.scan(&[]);
    assert_eq!(values.map(|name| stored(&new, name, running.state())), [5, 10, 5, 5]);
}

#[test]
fn the_values_of_an_enumeration_keep_their_names() {
    let types = |values: &str| format!("TYPE mode : ({values}); END_TYPE");
    let declared = "VAR RETAIN m, k : mode := idle; END_VAR";
    let old = of(&types("idle, run, stop"), declared, "m := run; k := stop;");
    let new = of(&types("idle, fill, run"), declared, "");
    let carried = after(&old, 1, &new);
    assert_eq!(fates(&carried), ["narrowed m", "dropped k"]);
    // `run` is 2 now, and the 1 of the old program would be `fill`.
    assert_eq!(["m", "k"].map(|name| stored(&new, name, &carried.state)), [2, 0]);
}

#[test]
fn a_value_outside_of_a_declared_subrange_is_dropped() {
    let declared = |range: &str| format!("VAR_OUTPUT RETAIN level : INT{range}; END_VAR");
    let old = of("", &declared(""), "level := level + 30;");
    let new = of("", &declared(" (0..50)"), "");
    assert_eq!(fates(&after(&old, 1, &new)), ["kept level"]);
    let carried = after(&old, 2, &new);
    assert_eq!(
        (fates(&carried), stored(&new, "level", &carried.state)),
        (vec!["dropped level".to_owned()], 0)
    );
}

/// The time since the cold start does not go back, or a moment that is kept would be one of the future.
#[test]
fn the_time_goes_on_with_another_period() {
    let text = |period: &str| {
        format!(
            "PROGRAM main VAR RETAIN t : TIME; END_VAR VAR_OUTPUT n : INT; END_VAR t := TIME(); END_PROGRAM
             CONFIGURATION c RESOURCE r ON plc TASK k(INTERVAL := {period}, PRIORITY := 0); PROGRAM p WITH k : main; END_RESOURCE END_CONFIGURATION"
        )
    };
    let old = program(&text("T#10ms"));
    for (period, wanted) in [("T#10ms", 7), ("T#20ms", 4), ("T#3ms", 24), ("T#1s", 1)] {
        let new = program(&text(period));
        let carried = after(&old, 7, &new);
        assert_eq!(carried.state[3], wanted, "{period}");
        let now = wanted as i64 * new.period;
        assert!(stored(&new, "t", &carried.state) as i64 <= now, "{period}");
    }
}

/// The same program takes over what a warm start keeps.
#[test]
fn a_program_that_did_not_change_keeps_everything() {
    let text = "FUNCTION_BLOCK b VAR n : INT; s : STRING[9]; END_VAR n := n + 1; s := 'x'; END_FUNCTION_BLOCK
        PROGRAM main VAR RETAIN t : TON; a : ARRAY [1..3] OF b; f : ARRAY [0..99] OF BOOL; END_VAR VAR q : INT; END_VAR
        t(IN := TRUE, PT := T#1h); a[2](); f[3] := TRUE; q := q + 1; END_PROGRAM";
    let program = program(text);
    let mut running = Running::new(program.clone());
    (0..5).for_each(|_| drop(running.scan(&[])));
    let carried = program.carried(&program, running.state(), Told::ALL, &[]);
    assert_eq!(carried.state, program.restarted(running.state()));
    assert_eq!(fates(&carried), ["kept t", "kept a", "kept f"]);
}

/// A variable of a method or of a function too.
#[test]
fn static_variables_of_routines_are_taken_over() {
    let text = |more: &str| {
        format!(
            "FUNCTION count : INT VAR_STAT RETAIN {more} n : INT; END_VAR n := n + 1; count := n; END_FUNCTION
             PROGRAM main VAR_OUTPUT x : INT; END_VAR x := count(); END_PROGRAM"
        )
    };
    let (old, new) = (program(&text("")), program(&text("z : LREAL;")));
    let carried = after(&old, 5, &new);
    assert_eq!(fates(&carried), ["new count.z", "kept count.n"]);
    let mut running = Running::new(new.clone());
    running.go_on_from(&carried.state);
    assert_eq!(running.scan(&[]), [6]);
}

/// By pairs of paths: whole structures, members of them, and members that leave a structure which is gone. What a pair takes is not dropped.
#[test]
fn paths_of_pairs_are_taken_over() {
    let types = |of: &str| {
        format!(
            "TYPE drive : STRUCT {of} temperature : INT; END_STRUCT; END_TYPE TYPE gone : STRUCT kept, lost : INT; END_STRUCT; END_TYPE"
        )
    };
    let old = of(
        &types("speed : INT;"),
        "VAR RETAIN left : drive; old_one : gone; n : INT; f : INT; END_VAR",
        "left.speed := 1; left.temperature := 2; old_one.kept := 3; n := 4; f := 5;",
    );
    let new = of(
        &types("velocity : INT;"),
        "VAR RETAIN right : drive; saved : INT; m : DINT; END_VAR VAR g : INT; END_VAR",
        "",
    );
    let pairs = [
        ("left", "right"),
        ("left.speed", "right.velocity"),
        ("old_one.kept", "saved"),
        ("n", "m"),
        ("f", "g"),
        ("unknown", "saved"),
    ];
    let pairs = pairs.map(|(old, new)| (old.to_owned(), new.to_owned()));
    let mut running = Running::new(old.clone());
    running.scan(&[]);
    let carried = new.carried(&old, running.state(), Told::ALL, &pairs);
    let value = |name| stored(&new, name, &carried.state);
    assert_eq!(["right.velocity", "right.temperature", "saved", "m"].map(value), [1, 2, 3, 4]);
    let mut found = fates(&carried);
    found.sort();
    assert_eq!(
        found,
        [
            "converted m",
            "dropped f",
            "dropped old_one.lost",
            "kept right.temperature",
            "kept right.velocity",
            "kept saved",
        ]
    );
}
