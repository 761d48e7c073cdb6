//! Programs with numbers as function blocks and charts, with the values of their scans.

use std::sync::Arc;

use understudy_cluster::{Cluster, Overrides, read_with};
use understudy_view::{Bounds, Model};
use understudy_wire::ProgramId;

use crate::support::{records, scenario};

const CLUSTER: &str = "\
[cluster]
name = \"press\"
period = \"10ms\"

[[controller]]
name = \"blocks\"
ladder = \"blocks.st\"

[[controller]]
name = \"chart\"
ladder = \"chart.st\"

[[plant]]
controller = \"blocks\"
ladder = \"belt.st\"

[[plant]]
controller = \"chart\"
ladder = \"gate.st\"
";

const BLOCKS: &str = "\
PROGRAM blocks
  VAR_INPUT speed : INT; run : BOOL; END_VAR
  VAR_OUTPUT y : INT; late : BOOL; n : INT; rest : REAL; END_VAR
  VAR t : TON; wide : INT; END_VAR
  y := speed * 3 + 1000 - n;
  IF run THEN
    n := n + 1;
  END_IF;
  t(IN := speed > 40, PT := T#50ms);
  late := t.Q AND run;
  wide := speed + 500 + (speed MOD 7 + 3);
  rest := LIMIT(0.0, INT_TO_REAL(speed) * 0.5, 20.0);
END_PROGRAM
";

const LEAVES: &str = "\
PROGRAM blocks
  VAR_INPUT speed : INT; run : BOOL; END_VAR
  VAR_OUTPUT y : INT; late : BOOL; n : INT; rest : REAL; END_VAR
  IF NOT run THEN
    RETURN;
  END_IF;
  y := speed * 3;
END_PROGRAM
";

/// Counts up to 79, and runs in every other group of ten scans.
const BELT: &str = "\
PROGRAM belt
  VAR_INPUT y : INT; late : BOOL; n : INT; rest : REAL; END_VAR
  VAR_OUTPUT speed : INT; run : BOOL; END_VAR
  speed := (speed + 1) MOD 80;
  run := speed MOD 20 < 10;
END_PROGRAM
";

const CHART: &str = "\
PROGRAM chart
  VAR_INPUT go : BOOL; END_VAR
  VAR_OUTPUT open : BOOL; level : REAL; END_VAR
  INITIAL_STEP Shut: END_STEP
  STEP Wide: open(N); Raise(P1); END_STEP
  TRANSITION FROM Shut TO Wide := go; END_TRANSITION
  TRANSITION FROM Wide TO Shut := NOT go; END_TRANSITION
  ACTION Raise: level := level + 1.5; END_ACTION
END_PROGRAM
";

const GATE: &str = "\
PROGRAM gate
  VAR_INPUT open : BOOL; level : REAL; END_VAR
  VAR_OUTPUT go : BOOL; END_VAR
  VAR n : INT; END_VAR
  n := (n + 1) MOD 40;
  go := n > 20;
END_PROGRAM
";

/// A ladder: `speed > 40` and the contact `run` lead to the coil `late`, and the contact of NOT `run` to the coil `idle`.
const RUNGS: &str = r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous><pou name="rungs" pouType="program">
<interface><inputVars><variable name="speed"><type><INT/></type></variable><variable name="run"><type><BOOL/></type></variable></inputVars>
<outputVars><variable name="y"><type><INT/></type></variable><variable name="late"><type><BOOL/></type></variable>
<variable name="n"><type><INT/></type></variable><variable name="rest"><type><REAL/></type></variable>
<variable name="idle"><type><BOOL/></type></variable></outputVars></interface><body><LD>
<leftPowerRail localId="1"><position x="0" y="0"/><connectionPointOut formalParameter=""/></leftPowerRail>
<inVariable localId="2"><position x="20" y="20"/><connectionPointOut/><expression>speed</expression></inVariable>
<inVariable localId="3"><position x="20" y="40"/><connectionPointOut/><expression>40</expression></inVariable>
<block localId="4" typeName="GT"><position x="60" y="0"/><inputVariables>
<variable formalParameter="IN1"><connectionPointIn><connection refLocalId="2"/></connectionPointIn></variable>
<variable formalParameter="IN2"><connectionPointIn><connection refLocalId="3"/></connectionPointIn></variable></inputVariables><inOutVariables/>
<outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>
<contact localId="5" negated="false"><position x="140" y="20"/><connectionPointIn><connection refLocalId="4" formalParameter="OUT"/></connectionPointIn>
<connectionPointOut/><variable>run</variable></contact>
<coil localId="6" negated="false"><position x="200" y="20"/><connectionPointIn><connection refLocalId="5"/></connectionPointIn>
<connectionPointOut/><variable>late</variable></coil>
<contact localId="7" negated="true"><position x="140" y="100"/><connectionPointIn><connection refLocalId="1"/></connectionPointIn>
<connectionPointOut/><variable>run</variable></contact>
<coil localId="8" negated="false"><position x="200" y="100"/><connectionPointIn><connection refLocalId="7"/></connectionPointIn>
<connectionPointOut/><variable>idle</variable></coil>
</LD></body></pou></pous></types><instances><configurations/></instances></project>"#;

fn cluster(text: &str) -> Cluster {
    let loaded = read_with("cluster.toml", text, Overrides::default(), &mut |name| match name {
        "blocks.st" => Ok(BLOCKS.to_owned()),
        "leaves.st" => Ok(LEAVES.to_owned()),
        "belt.st" => Ok(BELT.to_owned()),
        "chart.st" => Ok(CHART.to_owned()),
        "gate.st" => Ok(GATE.to_owned()),
        "rungs.xml" => Ok(RUNGS.to_owned()),
        _ => Err("no such file".to_owned()),
    });
    let reports = loaded.reports.iter().flat_map(|it| &it.diagnostics);
    let found: Vec<String> = reports.map(|found| found.message.clone()).collect();
    loaded.cluster.unwrap_or_else(|| panic!("{found:?}"))
}

fn model(text: &str) -> Model {
    let cluster = cluster(text);
    let mut model = Model::new(Arc::new(cluster.clone()), Bounds::default());
    let quiet = "title = \"quiet\"\ncycles = 200\n";
    for record in records(&cluster, &scenario(&cluster, quiet), 1) {
        model.note(&record);
    }
    model
}

/// The values above the outputs of a block, from top to bottom, found in the picture behind its type.
fn values_behind<'s>(svg: &'s str, of: &str) -> Vec<&'s str> {
    let (_, behind) = svg.split_once(&format!(">{of}</text>")).expect(of);
    let own = behind.split("<rect").next().unwrap_or_default();
    let texts = own.lines().filter(|line| {
        ["title", "one", "zero"].iter().any(|class| line.contains(&format!("class=\"{class}\"")))
    });
    let text = |line: &'s str| line.split_once('>').and_then(|(_, text)| text.split_once('<'));
    texts.filter_map(text).map(|(text, _)| text).collect()
}

/// In many cycles: what stands at the connections is what the scan computed, and what it left out is pale.
#[test]
fn connections_show_what_the_scan_computed() {
    let model = model(CLUSTER);
    let (mut ran, mut waited) = (0, 0);
    for cycle in 20..150 {
        let (svg, error) = model.drawing_at(ProgramId(0), cycle).expect("it has numbers");
        assert!(error.is_none(), "{error:?}");
        let values = &model.snapshot_at(cycle).expect("known").programs[0].values;
        let number = |name: &str| values[name].as_i64().expect("a number");
        let bit = |name: &str| values[name].as_bool().expect("a bit");
        let (speed, run, y) = (number("speed"), bit("run"), number("y"));
        assert_eq!(values_behind(&svg, "MUL"), [(speed * 3).to_string()], "cycle {cycle}");
        let n = number("n") - i64::from(run);
        assert_eq!(y, speed * 3 + 1000 - n);
        assert_eq!(values_behind(&svg, "SUB"), [y.to_string()]);
        let greater = if speed > 40 { "TRUE" } else { "FALSE" };
        assert_eq!(values_behind(&svg, "GT"), [greater]);
        let late = if bit("late") { "TRUE" } else { "FALSE" };
        assert_eq!(values_behind(&svg, "AND"), [late]);
        assert_eq!(values_behind(&svg, "TON").len(), 2);
        let idle = svg.contains("class=\"idle\"");
        assert_eq!(idle, !run, "cycle {cycle}: {svg}");
        *(if run { &mut ran } else { &mut waited }) += 1;
    }
    assert!(ran > 10 && waited > 10, "{ran} {waited}");
}

#[test]
fn the_active_step_is_marked() {
    let model = model(CLUSTER);
    let mut seen = [0, 0];
    let mut fired = 0;
    for cycle in 20..150 {
        let (svg, _) = model.drawing_at(ProgramId(1), cycle).expect("it has numbers");
        let bit = |cycle: i64, name: &str| {
            let values = &model.snapshot_at(cycle).expect("known").programs[1].values;
            values[name].as_bool().expect("a bit")
        };
        let (open, was_open, go) = (bit(cycle, "open"), bit(cycle - 1, "open"), bit(cycle, "go"));
        // The condition behind the step that was active before the scan, and no other one.
        let word = |bit: bool| if bit { "TRUE" } else { "FALSE" };
        let (told, other) = match was_open {
            true => {
                (format!("transition Wide to Shut: NOT go is {}", word(!go)), "transition Shut")
            }
            false => (format!("transition Shut to Wide: go is {}", word(go)), "transition Wide"),
        };
        assert!(svg.contains(&format!("{told}, go = {}", word(go))), "cycle {cycle}: {svg}");
        assert!(!svg.contains(other), "cycle {cycle}: {svg}");
        let active = if open { "Wide" } else { "Shut" };
        assert!(svg.contains(&format!("step {active}: active for ")), "cycle {cycle}: {svg}");
        assert_eq!(svg.contains("class=\"live\""), open != was_open, "cycle {cycle}: {svg}");
        fired += usize::from(open != was_open);
        let (_, behind) = svg.split_once("class=\"active\"").expect("an active step");
        let name = behind.split("</text>").next().unwrap_or_default();
        let step = if open { "Wide" } else { "Shut" };
        assert!(name.ends_with(step), "cycle {cycle}: {name}");
        seen[usize::from(open)] += 1;
    }
    assert!(seen.iter().all(|count| *count > 10) && fired > 2, "{seen:?} {fired}");
}

/// What no network holds is text with the values of the scan; a statement that was left out has no mark.
#[test]
fn what_is_not_drawn_is_text_with_values() {
    let model = model(&CLUSTER.replace("\"blocks.st\"", "\"leaves.st\""));
    let mut seen = [0, 0];
    for cycle in 20..150 {
        let (svg, error) = model.drawing_at(ProgramId(0), cycle).expect("it has numbers");
        assert!(error.is_none(), "{error:?}");
        let values = &model.snapshot_at(cycle).expect("known").programs[0].values;
        let (run, speed) = (values["run"].as_bool().expect("a bit"), &values["speed"]);
        assert!(svg.contains("as text, since it has"), "{svg}");
        let line = svg.lines().find(|line| line.contains("y := speed * 3;"));
        let line = line.unwrap_or_else(|| panic!("{svg}"));
        assert!(line.contains(&format!("speed = {speed}")), "cycle {cycle}: {line}");
        assert_eq!(line.contains('▸'), run, "cycle {cycle}: {line}");
        assert!(!svg.contains("VAR_INPUT"), "{svg}");
        seen[usize::from(run)] += 1;
    }
    assert!(seen.iter().all(|count| *count > 10), "{seen:?}");
}

/// The text of a document is what its elements mean, with the values of a scan and the lines of the file.
#[test]
fn a_drawn_program_is_a_text_with_the_lines_of_its_file() {
    let text = CLUSTER.replace("\"blocks.st\"", "\"rungs.xml\"").replace("\"blocks\"", "\"rungs\"");
    let model = model(&text);
    let place = RUNGS.lines().position(|line| line.contains("<coil localId=\"8\""));
    let file_line = u32::try_from(place.expect("a coil") + 1).expect("a short text");
    let uses = model.uses(ProgramId(0)).expect("it has statements");
    let idle = uses.iter().find(|uses| uses.name == "idle").expect("an output");
    assert_eq!((&idle.written, idle.read.len()), (&vec![file_line], 0));
    for cycle in [60, 75, 90] {
        let (lines, error) = model.text_at(ProgramId(0), cycle).expect("it has statements");
        assert!(error.is_none(), "{error:?}");
        let own = lines.iter().find(|line| line.text.trim() == "idle := NOT run;");
        let own = own.unwrap_or_else(|| panic!("{lines:?}"));
        assert_eq!((own.file_line, own.executed), (Some(file_line), true));
        let values = &model.snapshot_at(cycle).expect("known").programs[0].values;
        for shown in &own.values {
            assert_eq!(shown.value, values[shown.name.as_str()], "{}", shown.name);
        }
        assert_eq!(own.values.len(), 2, "{own:?}");
        let head = lines.iter().find(|line| line.text == "PROGRAM rungs").expect("a unit");
        assert_eq!((head.file_line, head.executed), (None, false));
        let why = model.why("rungs.idle", Some(cycle)).expect("known");
        let because = why.because.expect("a reason");
        assert_eq!(because.line, Some(file_line));
        assert_eq!(because.statement.as_deref(), Some("idle := NOT run;"));
        assert_eq!(because.text, "assigned");
    }
}

/// In many cycles: the power of a ladder goes where the scan computed it.
#[test]
fn contacts_and_wires_show_the_power() {
    let text = CLUSTER.replace("\"blocks.st\"", "\"rungs.xml\"").replace("\"blocks\"", "\"rungs\"");
    let model = model(&text);
    let mut seen = [0; 4];
    for cycle in 20..150 {
        let (svg, error) = model.drawing_at(ProgramId(0), cycle).expect("it has numbers");
        assert!(error.is_none(), "{error:?}");
        let values = &model.snapshot_at(cycle).expect("known").programs[0].values;
        let bit = |name: &str| values[name].as_bool().expect("a bit");
        let greater = values["speed"].as_i64().expect("a number") > 40;
        let paths = svg.lines().filter_map(|line| {
            let (_, behind) = line.split_once("<path class=\"")?;
            behind.split_once('"').map(|(class, _)| class)
        });
        let classes: Vec<&str> = paths.collect();
        let wire = |live: bool| if live { "live" } else { "wire" };
        let bar = |closed: bool| if closed { "live" } else { "bar" };
        let (run, late) = (bit("run"), bit("late"));
        assert_eq!(late, greater && run);
        // Two numbers, the power of the block and that of the coil; what is within the contacts; the coil.
        let first = ["data", "data", wire(greater), wire(late)];
        let contact = [wire(greater), wire(greater), wire(late), bar(run), bar(run)];
        // The coil; the rail; a contact that is closed while its variable is FALSE, with its stroke.
        let second = [wire(!run), "bar", "live", wire(!run)];
        let stroke = [bar(!run), bar(!run), bar(!run)];
        let all = [&first[..], &contact, &["bar"], &second, &stroke, &["bar"]].concat();
        assert_eq!(classes, all, "cycle {cycle}: {svg}");
        seen[usize::from(greater) + 2 * usize::from(run)] += 1;
    }
    assert!(seen.iter().all(|count| *count > 5), "{seen:?}");
}
