//! What synthesis says where a specification asks too much.

use insta::assert_snapshot;
use understudy_supervisor::operations::supcon;
use understudy_supervisor::{
    Bounds, Model, TooLarge, model_findings, modular_findings, read_model, synthesis_findings,
    synthesise, synthesise_modularly,
};

use crate::families::line;

fn model(specification: &str) -> Model {
    let text = format!(
        r#"
[events]
start  = {{ controllable = true }}
finish = {{ controllable = false }}
fail   = {{ controllable = false }}
repair = {{ controllable = true }}

[[plant]]
name = "machine"
marked = ["idle"]
transitions = ["idle start working", "working finish idle", "working fail down", "down repair idle"]

[[specification]]
name = "wanted"
{specification}
"#
    );
    let read = read_model(&text, |_| Err("nothing to load".to_owned()));
    read.model.unwrap_or_else(|| panic!("{:?}", read.diagnostics))
}

fn said(model: &Model) -> String {
    let result =
        synthesise(&model.plants(), &model.specifications(), Bounds::default()).expect("it fits");
    let findings = model_findings(model).into_iter().chain(synthesis_findings(model, &result));
    let lines: Vec<String> =
        findings.map(|finding| format!("{} {}", finding.code, finding.message)).collect();
    lines.join("\n")
}

#[test]
fn each_trouble_comes_with_the_events_that_show_it() {
    // Nothing is wrong.
    assert_snapshot!(said(&model(r#"marked = ["a"]
transitions = ["a start b", "b finish a", "b fail c", "c repair a"]"#)), @"");
    // A failure is forbidden: never start.
    assert_snapshot!(said(&model(r#"marked = ["a"]
events = ["fail"]
transitions = ["a start b", "b finish a"]"#)), @r#"
U0840 after "start" the plant may do fail, which is uncontrollable, and specification wanted forbids it; the supervisor keeps away from there
"#);
    // The marked state of the specification is out of reach.
    assert_snapshot!(said(&model(r#"marked = ["b"]
initial = "a"
events = ["repair"]
transitions = ["a finish a", "b repair b"]"#)), @r#"
U0841 there is no supervisor: from the beginning no state can be reached in which all are marked (machine in idle, wanted in a)
"#);
    // An event that no plant has.
    let mut other = model(
        r#"marked = ["a"]
transitions = ["a start b", "b finish a"]"#,
    );
    other.plants[0] = read_model(
        r#"
[events]
strat = { controllable = true, label = 5 }
[[plant]]
name = "machine"
marked = ["idle"]
transitions = ["idle strat idle"]
"#,
        |_| Err(String::new()),
    )
    .model
    .expect("right")
    .plants[0]
        .clone();
    assert_snapshot!(said(&other), @r#"
U0843 specification wanted names event finish, and no plant has it
U0843 specification wanted names event start, and no plant has it
U0841 there is no supervisor: by uncontrollable events alone, from the beginning the plant may do finish, which is uncontrollable, and specification wanted forbids it
"#);
}

#[test]
fn an_uncontrollable_beginning_leaves_no_supervisor() {
    let text = r#"
[events]
burst = { controllable = false }
alarm = { controllable = false }
[[plant]]
name = "pipe"
marked = ["whole"]
transitions = ["whole alarm warned", "warned burst broken"]
[[specification]]
name = "no_burst"
marked = "all"
events = ["burst"]
"#;
    let model = read_model(text, |_| Err(String::new())).model.expect("right");
    assert_snapshot!(said(&model), @r#"
U0841 there is no supervisor: by uncontrollable events alone, after "alarm" the plant may do burst, which is uncontrollable, and specification no_burst forbids it
"#);
}

#[test]
fn a_specification_that_is_not_lifted_is_named() {
    let model = model(
        r#"marked = ["a"]
transitions = ["a start b", "b finish a"]"#,
    );
    let result =
        supcon(&model.plants[0], &model.specifications[0], Bounds::default()).expect("it fits");
    let said: Vec<String> =
        synthesis_findings(&model, &result).into_iter().map(|finding| finding.message).collect();
    assert_snapshot!(said.join("\n"), @r#"
the specification does not know fail repair, so the meet forbids it for ever; lift the specification (sync with ALLEVENTS) if that is not meant
after "start" the plant may do fail, which is uncontrollable, and specification wanted forbids it; the supervisor keeps away from there
"#);
}

#[test]
fn local_supervisors_that_conflict_are_told_where() {
    let text = r#"
[events]
a = { controllable = true }
b = { controllable = true }
[[plant]]
name = "left"
marked = "all"
transitions = ["0 a 0"]
[[plant]]
name = "right"
marked = "all"
transitions = ["0 b 0"]
[[specification]]
name = "a_first"
marked = ["done"]
transitions = ["none a one", "one b done"]
[[specification]]
name = "b_first"
marked = ["done"]
transitions = ["none b one", "one a done"]
"#;
    let model = read_model(text, |_| Err(String::new())).model.expect("right");
    let result = synthesise_modularly(&model.plants(), &model.specifications(), Bounds::default())
        .expect("it fits");
    let said: Vec<String> =
        modular_findings(&model, &result).into_iter().map(|finding| finding.message).collect();
    assert_snapshot!(said.join("\n"), @r#"
the local supervisors conflict: from the beginning they cannot all come to marked states any more
"#);
}

#[test]
fn past_its_bound_the_explicit_engine_stops_and_names_the_other_one() {
    let (plants, buffers) = line(6, 4);
    let plants: Vec<_> = plants.iter().collect();
    let buffers: Vec<_> = buffers.iter().collect();
    let error = synthesise(&plants, &buffers, Bounds { memory_bytes: 1_000_000 })
        .expect_err("it does not fit");
    assert!(matches!(error, TooLarge::Memory { states, .. } if states < 40_000));
    assert_eq!(error.code(), "U0830");
    assert!(error.to_string().contains("--engine symbolic"), "{error}");
}
