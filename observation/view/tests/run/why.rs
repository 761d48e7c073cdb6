//! Chains of reasons.

use understudy_cluster::{Overrides, read_with};
use understudy_scenarios::Scenario;
use understudy_view::Reason;
use understudy_wire::ProgramId;

use crate::support::{KILL_EACH, cell, model, scenario};

#[test]
fn a_reconstructed_output_names_parity_word_mask_and_lineage() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let why = model.why("press.move_down", Some(140)).expect("it is known");
    insta::assert_snapshot!(why.to_text(understudy_view::Zone::UTC));
    let reconstructed = why.reconstructed.expect("the press is killed");
    assert!(reconstructed.proved);
    assert_eq!(reconstructed.word_of, "understudy");
    assert_eq!(reconstructed.not_received, ["press"]);
}

/// In every cycle, for every output: the chain begins with what was driven, and every contact in it reads what the samples, the
/// memory or the rungs above say.
#[test]
fn every_output_of_every_cycle_is_explained() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    for cycle in 0..299 {
        for output in ["grip", "extend", "move_up", "%QX0.1"] {
            let Ok(why) = model.why(output, Some(cycle)) else {
                continue;
            };
            let reason = why.because.expect("nothing is fail-safe");
            assert_eq!(reason.value, why.value);
            assert_eq!(why.scanned, None);
            assert!(count(&reason) <= 400);
            let text = serde_json::to_string(&reason).expect("JSON");
            assert!(!text.contains("not known"), "{output} in {cycle}: {text}");
        }
    }
}

fn count(reason: &Reason) -> usize {
    1 + reason.because.iter().map(count).sum::<usize>()
}

#[test]
fn what_is_not_there_is_said() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let check = |signal: &str, cycle: Option<i64>, code: &str, expected: &str| {
        let error = model.why(signal, cycle).expect_err("it has no answer");
        assert_eq!(error.code(), code);
        assert_eq!(error.words(), expected);
        assert_eq!(error.to_string(), format!("{code}: {expected}"));
    };
    check(
        "move_don",
        None,
        "U0573",
        "no program has an output or a variable `move_don`; did you mean `move_down`?",
    );
    check(
        "%QX0.0",
        None,
        "U0574",
        "robot and press have an output `%QX0.0`; name the program too, for example `robot.%QX0.0`",
    );
    assert!(model.why("press.%QX0.0", None).is_ok());
    let error = model.why("press.move_down", Some(5000)).expect_err("it has no answer");
    assert_eq!(error.code(), "U0575");
}

/// Its output and its memory change in the 60th scan, and never again.
const ONCE: &str = "\
PROGRAM once
  VAR_INPUT run : BOOL; END_VAR
  VAR_OUTPUT starts : INT; never : INT := 7; END_VAR
  VAR n : DINT; END_VAR
  n := n + 1;
  IF n = 60 THEN starts := starts + 1; END_IF;
  IF n < 0 THEN never := 8; END_IF;
END_PROGRAM
";

const LATCH: &str = "\
program latch
input go
output lamp
memory never = 0
memory lit = 0
rung
    go (S lit)
rung
    never (S never)
rung
    lit ( lamp )
";

const GO: &str = "\
PROGRAM go
  VAR_INPUT lamp : BOOL; END_VAR
  VAR_OUTPUT go : BOOL; END_VAR
  VAR n : DINT; END_VAR
  n := n + 1;
  go := n = 60;
END_PROGRAM
";

/// A value that is kept for longer than any bound of a search was assigned where it was assigned: only what was never written is initial.
#[test]
fn a_value_that_was_assigned_long_ago_is_not_its_initial_value() {
    let file = "[cluster]\nname = \"long\"\n\
        [[controller]]\nname = \"once\"\nladder = \"once.st\"\n\
        [[controller]]\nname = \"latch\"\nladder = \"latch.ladder\"\n\
        [[plant]]\ncontroller = \"latch\"\nladder = \"go.st\"\n";
    let loaded = read_with("cluster.toml", file, Overrides::default(), &mut |name| match name {
        "once.st" => Ok(ONCE.to_owned()),
        "latch.ladder" => Ok(LATCH.to_owned()),
        "go.st" => Ok(GO.to_owned()),
        _ => Err("no such file".to_owned()),
    });
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    // Of the last of them the first cycles are not remembered any more.
    for (cycles, is_remembered) in [(1000, true), (5000, true), (9000, false)] {
        let text = format!("title = \"long\"\ncycles = {cycles}\n");
        let model = model(&cluster, &scenario(&cluster, &text), 1);
        let because = |signal: &str| {
            let why = model.why(signal, Some(cycles - 10)).expect("it is known");
            why.because.expect("nothing is fail-safe")
        };
        let assigned = because("once.starts").text;
        let set = because("latch.lamp").because.remove(0).text;
        let never = because("once.never").text;
        if is_remembered {
            assert!(assigned.starts_with("assigned in cycle "), "{cycles}: {assigned}");
            assert!(set.starts_with("is set in cycle "), "{cycles}: {set}");
            assert_eq!(never, "its initial value");
        } else {
            let before = "unchanged since before the oldest cycle that is remembered";
            assert_eq!([assigned, set, never], [before; 3], "{cycles}");
        }
    }
}

const CLUSTER: &str = "\
[cluster]
name = \"blocks\"
period = \"10ms\"
[[controller]]
name = \"own\"
ladder = \"own.ladder\"
[[controller]]
name = \"other\"
ladder = \"other.ladder\"
[[remote_io]]
controller = \"own\"
[[plant]]
controller = \"own\"
ladder = \"plant.ladder\"
";

/// All reasons of `y` in a cycle, each as `signal = value: text`, where the inputs of `rungs` are set in some cycles.
fn reasons(rungs: &str, sets: &[(i64, &str, bool)], cycle: i64) -> Vec<String> {
    reasons_of("own.y", rungs, sets, cycle).expect("it is known")
}

/// The same of another signal; the error where it has no value.
fn reasons_of(
    signal: &str,
    rungs: &str,
    sets: &[(i64, &str, bool)],
    cycle: i64,
) -> Result<Vec<String>, String> {
    let own = format!("program own\ninput a\ninput b\noutput y\n{rungs}\n");
    let loaded = read_with("cluster.toml", CLUSTER, Overrides::default(), &mut |name| match name {
        "own.ladder" => Ok(own.clone()),
        "other.ladder" => Ok("program other\ninput u\noutput v\nrung u ( v )\n".to_owned()),
        "plant.ladder" => {
            Ok("program plant\ninput y\noutput a\noutput b\nmemory k\nrung k ( k )\n".to_owned())
        }
        _ => Err("no such file".to_owned()),
    });
    let cluster = loaded.cluster.unwrap_or_else(|| panic!("{:?}", loaded.reports));
    let mut text = String::from("title = \"blocks\"\ncycles = 60\n");
    for (at, input, value) in sets {
        text += &format!(
            "[[step]]\nat = {at}\naction = \"set\"\nstation = \"own-io\"\ninput = \"{input}\"\nvalue = {value}\n"
        );
    }
    let model = model(&cluster, &scenario(&cluster, &text), 1);
    let why = model.why(signal, Some(cycle)).map_err(|error| error.to_string())?;
    let mut found = Vec::new();
    let mut open = vec![why.because.expect("nothing is fail-safe")];
    while let Some(reason) = open.pop() {
        found.push(format!("{} = {}: {}", reason.signal, reason.value, reason.text));
        open.extend(reason.because);
    }
    Ok(found)
}

/// A block is explained by the input that decided, also where it is on without power, and by what it was where it is read before its call.
#[test]
fn a_block_is_explained_by_the_input_that_decided() {
    let pulse = [(10, "a", true), (20, "a", false), (30, "b", true), (40, "b", false)];
    for (rungs, cycle, wanted, is_there) in [
        ("rung a {RS s R1=b} ( y )", 33, "b = true", true),
        ("rung a {SR s R=b} ( y )", 33, "b = true", true),
        ("rung a {TOF t 50ms} ( y )", 27, "TOF: ", true),
        ("rung a {TOF t 50ms} ( y )", 22, "TOF: ", true),
        ("rung a {TON t 50ms} ( y )", 10, "since cycle 10, 0ms of 50ms", true),
        ("rung a {TON t 50ms} ( y )", 12, "since cycle 10, 20ms of 50ms", true),
        ("rung a {TON t 50ms} ( y )", 16, "since cycle 10, its 50ms are over", true),
        ("rung a {CTU c 2 R=b}\nrung c.CV < 1 ( y )", 33, "b = true", true),
        ("rung a {CTU c 1 R=b}\nrung c.Q ( y )", 15, "a = true", true),
        ("rung a {CTD c 2 LD=b}\nrung c.CV = 2 ( y )", 33, "b = true", true),
        ("rung a {CTUD c 2 CD=b}\nrung c.CV < 1 ( y )", 33, "b = true", true),
        ("rung a /t.Q {TON t 50ms} ( y )", 17, "explained above", false),
        ("rung /e.Q a {R_TRIG e} ( y )", 12, "has just changed", true),
    ] {
        let found = reasons(rungs, &pulse, cycle);
        let is_found = found.iter().any(|reason| reason.contains(wanted));
        assert_eq!(is_found, is_there, "{rungs} at {cycle}: {found:#?}");
    }
}

/// Rungs explain all that the program has: inputs, and pins and values of blocks too.
#[test]
fn each_variable_of_a_ladder_is_explained() {
    let cluster = crate::support::example("assembly-cell");
    let model = model(&cluster, &Scenario { cycles: 300, ..Scenario::default() }, 1);
    let why = |signal: &str| model.why(signal, Some(200)).expect("known");
    let input = why("cell.body_placed");
    assert_eq!(input.of.map(|of| of.to_string()).as_deref(), Some("BOOL"));
    let reason = input.because.expect("a reason");
    assert!(reason.text.starts_with("input, since cycle "), "{}", reason.text);
    let ladder = cluster.controllers()[0].ladder().expect("a ladder");
    let signals: Vec<_> = ladder.blocks();
    assert!(!signals.is_empty());
    for block in signals {
        for pin in block.kind.outputs().iter().copied().chain(block.kind.value_output()) {
            let name = format!("{}.{pin}", block.name);
            let found = why(&format!("cell.{name}"));
            let state = model.state_signals(ProgramId(0));
            let own: Vec<_> = state.into_iter().filter(|signal| signal.name == name).collect();
            let value = model.state_values(ProgramId(0), 200, &own).expect("known");
            assert_eq!([own[0].shown(value[0].clone())], [found.value], "{name}");
            let block_reason = &found.because.expect("a reason").because[0];
            assert!(block_reason.text.starts_with(block.kind.word()), "{}", block_reason.text);
        }
    }
    // What one program computes is meant, where others read a signal of its name.
    assert!(model.why("full", Some(200)).is_ok());
}

/// An input of a block is explained by what feeds it, and not by what the block does; a block has no value of its own.
#[test]
fn an_input_of_a_block_is_explained_by_what_feeds_it() {
    let pulse = [(10, "a", true), (20, "a", false), (30, "b", true), (40, "b", false)];
    let of = |signal: &str, rungs: &str, cycle| reasons_of(signal, rungs, &pulse, cycle);
    for (signal, rungs, cycle, wanted) in [
        ("own.s.S", "rung a {RS s R1=b} ( y )", 33, ["a = false"]),
        ("own.s.R1", "rung a {RS s R1=b} ( y )", 33, ["b = true"]),
        ("own.t.IN", "rung a {TON t 50ms} ( y )", 12, ["a = true"]),
        ("own.c.R", "rung a {CTU c 2 R=b}\nrung c.Q ( y )", 15, ["b = false"]),
    ] {
        let found = of(signal, rungs, cycle).expect("it is known");
        let behind: Vec<&str> =
            found[1..].iter().filter_map(|reason| Some(reason.split_once(": ")?.0)).collect();
        assert_eq!(behind, wanted, "{signal} at {cycle}: {found:#?}");
    }
    let error = of("own.t", "rung a {TON t 50ms} ( y )", 12).expect_err("no value");
    assert!(error.starts_with("U0573: `own.t` has no value of its own"), "{error}");
    assert!(error.contains("`t.Q`") && error.contains("`t.ET`"), "{error}");
}
