//! Documents as typed programs: what each construct does, and that both readers agree where both take a document.

use std::time::Duration;

use understudy_interchange::USUAL_PERIOD;
use understudy_interchange::plcopen::{read, read_typed};
use understudy_logic::Running;
use understudy_structured_text::{Options, lower};
use understudy_testing::random::Dice;
use understudy_text::{Diagnostic, Severity};
use understudy_typed::{Elementary, Machine, Program, Scratch};

use crate::support::{PERIOD, data};

/// The program of a document, or its errors.
pub(crate) fn typed(text: &str, period: Duration) -> Result<Program, Vec<Diagnostic>> {
    let (file, mut found) = read_typed(text);
    let options =
        Options { text, period: i64::try_from(period.as_nanos()).ok(), ..Options::default() };
    let lowered = lower(&file, &options);
    found.extend(lowered.diagnostics);
    found.retain(|found| found.severity == Severity::Error);
    match lowered.program {
        Some(program) if found.is_empty() => Ok(program),
        _ => Err(found),
    }
}

pub(crate) struct Scans {
    program: Program,
    machine: Machine,
    state: Vec<u64>,
    scratch: Scratch,
}

impl Scans {
    pub(crate) fn new(program: Program) -> Self {
        program.validate().expect("a sound program");
        let machine = Machine::new(&program);
        Self { state: machine.initial().to_vec(), scratch: Scratch::default(), machine, program }
    }

    pub(crate) fn scan(&mut self, values: &[u64]) -> Vec<u64> {
        let mut inputs = vec![0; self.machine.input_count().div_ceil(64)];
        let mut outputs = vec![0; self.machine.output_count().div_ceil(64)];
        let points = self.program.inputs.iter().filter(|point| point.slot != 0);
        for (point, value) in points.zip(values) {
            point.set(&mut inputs, *value);
        }
        self.machine.step(&mut self.scratch, &mut self.state, &inputs, &mut outputs);
        let points = self.program.outputs.iter().filter(|point| point.slot != 0);
        points.map(|point| point.get(&outputs)).collect()
    }
}

/// A document with one program.
fn document(variables: &str, body: &str) -> String {
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous>
<pou name="main" pouType="program"><interface><localVars>{variables}</localVars></interface><body>{body}</body></pou>
</pous></types><instances><configurations/></instances></project>"#
    )
}

fn variable(name: &str, address: &str, of: &str) -> String {
    format!(r#"<variable name="{name}" address="{address}"><type><{of}/></type></variable>"#)
}

fn from(id: u32) -> String {
    format!(r#"<connectionPointIn><connection refLocalId="{id}"/></connectionPointIn>"#)
}

fn given(id: u32, expression: &str) -> String {
    format!(
        r#"<inVariable localId="{id}"><connectionPointOut/><expression>{expression}</expression></inVariable>"#
    )
}

fn taken(id: u32, source: u32, expression: &str) -> String {
    let source = from(source);
    format!(
        r#"<outVariable localId="{id}">{source}<expression>{expression}</expression></outVariable>"#
    )
}

fn function(id: u32, of: &str, sources: &[u32]) -> String {
    let inputs = sources.iter().enumerate().map(|(at, source)| {
        let source = from(*source);
        format!(r#"<variable formalParameter="IN{}">{source}</variable>"#, at + 1)
    });
    let inputs: String = inputs.collect();
    format!(
        r#"<block localId="{id}" typeName="{of}"><inputVariables>{inputs}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#
    )
}

fn run(text: &str, inputs: &[&[u64]]) -> Vec<Vec<u64>> {
    let program = typed(text, PERIOD).unwrap_or_else(|found| panic!("{found:#?}"));
    let mut scans = Scans::new(program);
    inputs.iter().map(|values| scans.scan(values)).collect()
}

#[test]
fn a_sum_that_feeds_itself_is_what_it_was_in_the_last_scan() {
    let variables = variable("a", "%IW0", "INT") + &variable("y", "%QW0", "INT");
    let body = given(1, "a") + &function(2, "ADD", &[1, 2]) + &taken(3, 2, "y");
    let text = document(&variables, &format!("<FBD>{body}</FBD>"));
    let shown = run(&text, &[&[1], &[2], &[3]]);
    assert_eq!(shown, [vec![1], vec![3], vec![6]]);
}

#[test]
fn boxes_compute_in_the_type_of_their_inputs() {
    let variables = |of: &str| variable("a", "%IW0", of) + &variable("y", "%QW0", of);
    let body = given(1, "a") + &given(2, "100") + &given(3, "4095");
    let body = body + &function(4, "MUL", &[1, 2]) + &function(5, "DIV", &[4, 3]);
    let body = body + &taken(6, 5, "y");
    for (of, expected) in [("INT", 3), ("DINT", 100)] {
        let text = document(&variables(of), &format!("<FBD>{body}</FBD>"));
        assert_eq!(run(&text, &[&[4095]]), [vec![expected]], "{of}");
    }
}

#[test]
fn a_jump_back_repeats_and_a_jump_on_skips() {
    let variables = variable("n", "%IW0", "INT") + &variable("y", "%QW0", "INT");
    let order = |text: String, order: u32| {
        text.replacen(" localId", &format!(" executionOrderId=\"{order}\" localId"), 1)
    };
    let label = r#"<label localId="1" executionOrderId="1" label="again"/>"#;
    let jump = r#"<jump localId="9" executionOrderId="5" label="again">"#;
    let body = [
        label.to_owned(),
        given(2, "y"),
        given(3, "1"),
        order(function(4, "ADD", &[2, 3]), 2),
        order(taken(5, 4, "y"), 3),
        given(6, "y"),
        given(7, "n"),
        order(function(8, "LT", &[6, 7]), 4),
        format!("{jump}{}</jump>", from(8)),
    ];
    let text = document(&variables, &format!("<FBD>{}</FBD>", body.concat()));
    assert_eq!(run(&text, &[&[5], &[5], &[9]]), [vec![5], vec![6], vec![9]]);
}

#[test]
fn a_chart_goes_from_step_to_step() {
    let variables = variable("go", "%IX0.0", "BOOL")
        + &variable("n", "%QW0", "INT")
        + &variable("y", "%QX0.0", "BOOL");
    let body = format!(
        r#"<step localId="1" name="Idle" initialStep="true">{}<connectionPointOut formalParameter="sfc"/></step>
<transition localId="2">{}<connectionPointOut/><condition><inline name="c"><ST><xhtml:p xmlns:xhtml="http://www.w3.org/1999/xhtml">go AND n &lt; 3</xhtml:p></ST></inline></condition></transition>
<step localId="3" name="Run">{}<connectionPointOut formalParameter="sfc"/><connectionPointOutAction formalParameter="a"/></step>
<actionBlock localId="4">{}<action qualifier="N"><reference name="y"/></action><action qualifier="P1"><inline><ST>n := n + 1;</ST></inline></action></actionBlock>
<transition localId="5">{}<connectionPointOut/><condition><inline name="d"><ST>NOT go</ST></inline></condition></transition>
<jumpStep localId="6" targetName="Idle">{}</jumpStep>"#,
        "",
        from(1),
        from(2),
        from(3),
        from(3),
        from(5)
    );
    let text = document(&variables, &format!("<SFC>{body}</SFC>"));
    let shown = run(&text, &[&[0], &[1], &[1], &[0], &[1], &[0]]);
    let expected: [&[u64]; 6] = [&[0, 0], &[1, 1], &[1, 1], &[1, 0], &[2, 1], &[2, 0]];
    assert_eq!(shown, expected.map(<[u64]>::to_vec));
}

/// The macro step, entered by transition 2, and transition 5 behind it; `inner` is its chart.
fn with_macro_step(inner: &str) -> String {
    let condition =
        |text: &str| format!(r#"<condition><inline name="c"><ST>{text}</ST></inline></condition>"#);
    let transition = |id: u32, source: u32, text: &str| {
        let (source, condition) = (from(source), condition(text));
        format!(
            r#"<transition localId="{id}">{source}<connectionPointOut/>{condition}</transition>"#
        )
    };
    let counted = |id: u32, step: u32| {
        let step = from(step);
        format!(
            r#"<actionBlock localId="{id}">{step}<action qualifier="P1"><inline><ST>n := n + 1;</ST></inline></action></actionBlock>"#
        )
    };
    let step = |id: u32, name: &str, inputs: &str| {
        format!(
            r#"<step localId="{id}" name="{name}">{inputs}<connectionPointOut formalParameter="sfc"/></step>"#
        )
    };
    let inner = match inner {
        "flat" => [
            step(1, "First", ""),
            counted(2, 1),
            transition(3, 1, "go"),
            step(4, "Last", &from(3)),
            counted(5, 4),
        ]
        .concat(),
        _ => {
            let body = step(1, "First", "")
                + &counted(2, 1)
                + &transition(3, 1, "go")
                + &step(4, "Last", &from(3))
                + &counted(5, 4);
            format!(
                r#"<macroStep localId="9" name="Inner"><body><SFC>{body}</SFC></body></macroStep>"#
            )
        }
    };
    let idle = r#"<step localId="1" name="Idle" initialStep="true"><connectionPointOut formalParameter="sfc"/></step>"#;
    let (entered, jump) = (from(2), from(5));
    [
        idle.to_owned(),
        transition(2, 1, "go"),
        format!(r#"<macroStep localId="3" name="Whole">{entered}<connectionPointOut/><body><SFC>{inner}</SFC></body></macroStep>"#),
        transition(5, 3, "NOT go"),
        format!(r#"<jumpStep localId="6" targetName="Idle">{jump}</jumpStep>"#),
    ]
    .concat()
}

#[test]
fn a_macro_step_ends_with_the_last_step_of_its_chart() {
    let variables = variable("go", "%IX0.0", "BOOL") + &variable("n", "%QW0", "INT");
    for inner in ["flat", "nested"] {
        let text = document(&variables, &format!("<SFC>{}</SFC>", with_macro_step(inner)));
        // Idle; First; not left while `go` is off, and not the macro step either; Last; Idle; First.
        let shown = run(&text, &[&[0], &[1], &[0], &[0], &[1], &[0], &[1]]);
        let counts: Vec<u64> = shown.iter().map(|outputs| outputs[0]).collect();
        assert_eq!(counts, [0, 1, 1, 1, 2, 2, 3], "{inner}");
    }
}

#[test]
fn what_is_not_understood_is_refused_by_its_name() {
    let variables = variable("a", "%IX0.0", "BOOL");
    for (body, word) in [
        (r#"<ST>a := a;</ST><Extra/>"#, "Extra"),
        (r#"<FBD><comment localId="1" magic="yes"/></FBD>"#, "magic"),
        (r#"<SFC><macroStep localId="1" name="m"/></SFC>"#, "the macro step `m` has no body"),
        (
            r#"<SFC><macroStep localId="1" name="m"><body><ST>a := a;</ST></body></macroStep></SFC>"#,
            "is not a sequential function chart",
        ),
        (
            r#"<SFC><macroStep localId="1" name="m"><body><SFC><step localId="1" name="p"/><step localId="2" name="q"/></SFC></body></macroStep></SFC>"#,
            "has 2 last steps",
        ),
    ] {
        let found = typed(&document(&variables, body), PERIOD).expect_err("a refusal");
        assert!(found.iter().any(|found| found.message.contains(word)), "{word}: {found:#?}");
    }
}

#[test]
fn dancing_lights_as_a_typed_program_do_what_another_compiler_s_code_does() {
    let (Some(file), Some(vectors)) =
        (data("ladder/dancinglights/plc.xml"), data("ladder/vectors/dancinglights.json"))
    else {
        return;
    };
    let text = std::fs::read_to_string(file).expect("a file that exists");
    let vectors = std::fs::read_to_string(vectors).expect("a file that exists");
    let vectors: serde_json::Value = serde_json::from_str(&vectors).expect("vectors");
    let mut scans = Scans::new(typed(&text, PERIOD).expect("a sound program"));
    let lines = vectors["scans"].as_array().expect("scans");
    for (number, line) in lines.iter().enumerate() {
        let line = line.as_str().and_then(|line| line.split_once(' '));
        let (inputs, outputs) = line.expect("two words");
        let inputs: Vec<u64> = inputs.bytes().map(|bit| u64::from(bit == b'1')).collect();
        let shown = scans.scan(&inputs);
        let shown: String = shown.iter().map(u64::to_string).collect();
        assert_eq!(shown, outputs, "scan {number}");
    }
    assert!(lines.len() >= 600);
}

/// Files of this project and of other people.
fn documents() -> Vec<std::path::PathBuf> {
    let examples = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let mut folders = vec![examples];
    folders.extend(["ladder", "programs"].iter().filter_map(|folder| data(folder)));
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "xml") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn both_readers_agree_scan_by_scan() {
    let mut compared = 0;
    for path in documents() {
        let text = std::fs::read_to_string(&path).expect("a text");
        let reading = read(&text, None);
        let period = reading.period.unwrap_or(USUAL_PERIOD);
        let Some(program) = reading.program else {
            continue;
        };
        let Ok(circuit) = program.lower(period) else {
            continue;
        };
        let other = match typed(&text, period) {
            Ok(other) => other,
            Err(found) => {
                // The Boolean reader looks only at units that the program uses.
                let is_elsewhere = found.iter().all(|found| found.code == "U1041");
                assert!(is_elsewhere, "{}: {found:#?}", path.display());
                continue;
            }
        };
        let named = |points: &understudy_typed::Points| -> Option<Vec<String>> {
            let mut points = points.iter().filter(|point| point.slot != 0);
            let is_bit = points.clone().all(|point| point.of == Elementary::Bool);
            is_bit.then(|| points.by_ref().map(|point| point.name.to_uppercase()).collect())
        };
        let same = |names: Option<Vec<String>>, bits: usize| {
            names.is_some_and(|names| names.len() == bits)
        };
        let (inputs, outputs) = (circuit.inputs().len(), circuit.outputs().len());
        if !same(named(&other.inputs), inputs) || !same(named(&other.outputs), outputs) {
            continue;
        }
        compared += 1;
        let mut scans = Scans::new(other);
        let mut running = Running::new(&circuit);
        let mut dice = Dice::new(7);
        let mut given = vec![false; inputs];
        for scan in 0..2_000 {
            for input in &mut given {
                *input ^= dice.rarely(3);
            }
            let expected = running.step(&given);
            let values: Vec<u64> = given.iter().map(|bit| u64::from(*bit)).collect();
            let shown: Vec<bool> = scans.scan(&values).iter().map(|bit| *bit != 0).collect();
            assert_eq!(shown, expected, "{} scan {scan}", path.display());
        }
    }
    assert!(compared >= 1, "{compared} documents compared");
}

#[test]
fn all_programs_of_the_tasks_run() {
    let unit = |name: &str, variables: &str, body: &str| {
        format!(
            r#"<pou name="{name}" pouType="program"><interface><localVars>{variables}</localVars></interface><body><ST><p>{body}</p></ST></body></pou>"#
        )
    };
    let bool = |name, address| variable(name, address, "BOOL");
    let first = unit("first", &(bool("a", "%IX0.0") + &bool("y", "%QX0.0")), "y := a;");
    let second = unit("second", &(bool("b", "%IX0.1") + &bool("z", "%QX0.1")), "z := NOT b;");
    let text = format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous>{first}{second}</pous></types>
<instances><configurations><configuration name="c"><resource name="r"><task name="t" priority="0" interval="T#20ms">
<pouInstance name="i" typeName="first"/><pouInstance name="j" typeName="second"/></task></resource></configuration></configurations></instances></project>"#
    );
    let read = understudy_interchange::read_source("two.xml", &text, Default::default());
    let Some(understudy_interchange::Source::Program(program)) = read.source else {
        panic!("{:#?}", read.diagnostics);
    };
    assert_eq!(program.tasks.len(), 2);
    let mut scans = Scans::new((*program).clone());
    assert_eq!(scans.scan(&[1, 0]), [1, 1]);
    assert_eq!(scans.scan(&[0, 1]), [0, 0]);
    let wanted = understudy_interchange::Wanted { program: Some("second"), period: None };
    let read = understudy_interchange::read_source("two.xml", &text, wanted);
    assert!(matches!(
        read.source,
        Some(understudy_interchange::Source::Program(typed)) if typed.name == "second"
    ));
    // The circuit of a file is that of all that runs; a conversion says what it leaves out.
    let read = understudy_interchange::read_ladder("two.xml", &text, None);
    let outputs = read.program.map(|ladder| ladder.outputs.len());
    assert_eq!(outputs, Some(2), "{:#?}", read.diagnostics);
    let read = understudy_interchange::read(
        understudy_interchange::Format::PlcOpen,
        "two.xml",
        &text,
        None,
    );
    assert_eq!(read.program.expect("a ladder").name.as_str(), "first");
    let left_out: Vec<&str> = read.diagnostics.iter().map(|it| it.message.as_str()).collect();
    assert_eq!(left_out, ["a task runs `second` too, and only `first` is read"]);
}

/// Bodies of which each has an error.
const WRONG: [&str; 6] = [
    "<ST><p>z := unknown;</p></ST>",
    "<ST><p>z := ;</p></ST>",
    "<IL><p>LD unknown ST z</p></IL>",
    r#"<FBD><outVariable localId="1"><connectionPointIn><connection refLocalId="7"/></connectionPointIn><expression>z</expression></outVariable></FBD>"#,
    r#"<FBD><inVariable localId="1"><connectionPointOut/><expression>unknown</expression></inVariable><outVariable localId="2"><connectionPointIn><connection refLocalId="1"/></connectionPointIn><expression>z</expression></outVariable></FBD>"#,
    r#"<LD><leftPowerRail localId="1"><connectionPointOut/></leftPowerRail><coil localId="2"><connectionPointIn><connection refLocalId="1"/></connectionPointIn><connectionPointOut/><variable>unknown</variable></coil></LD>"#,
];

#[test]
fn an_error_of_any_program_of_the_tasks_is_one_of_the_file() {
    let unit = |name: &str, bit: u32, body: &str| {
        let variables = variable("b", &format!("%IX0.{bit}"), "BOOL")
            + &variable("z", &format!("%QX0.{bit}"), "BOOL");
        format!(
            r#"<pou name="{name}" pouType="program"><interface><localVars>{variables}</localVars></interface><body>{body}</body></pou>"#
        )
    };
    let right = "<LD><leftPowerRail localId=\"1\"><connectionPointOut/></leftPowerRail><contact localId=\"2\"><connectionPointIn><connection refLocalId=\"1\"/></connectionPointIn><connectionPointOut/><variable>b</variable></contact><coil localId=\"3\"><connectionPointIn><connection refLocalId=\"2\"/></connectionPointIn><connectionPointOut/><variable>z</variable></coil></LD>";
    let task = |name: &str, run: &str| {
        format!(r#"<task name="{name}" priority="0" interval="T#20ms">{run}</task>"#)
    };
    let run = |of: &str| format!(r#"<pouInstance name="run_{of}" typeName="{of}"/>"#);
    let tasks = [
        task("t", &(run("first") + &run("second"))),
        task("t", &run("first")) + &task("u", &run("second")),
        task("t", &run("first")) + &run("second"),
    ];
    let file = |bodies: [&str; 2], tasks: &str| {
        let units = unit("first", 0, bodies[0]) + &unit("second", 1, bodies[1]);
        format!(
            r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous>{units}</pous></types><instances><configurations><configuration name="c"><resource name="r">{tasks}</resource></configuration></configurations></instances></project>"#
        )
    };
    let is_error = |found: &&Diagnostic| found.severity == Severity::Error;
    for tasks in &tasks {
        let text = file([right, right], tasks);
        assert!(!read(&text, None).diagnostics.iter().any(|found| is_error(&found)), "{tasks}");
        for wrong in WRONG {
            for bodies in [[right, wrong], [wrong, right]] {
                let text = file(bodies, tasks);
                let place = text.find(wrong).expect("the body");
                let within = place.saturating_sub(400)..place + wrong.len();
                let whole =
                    understudy_interchange::read_source("two.xml", &text, Default::default());
                assert!(whole.source.is_none(), "{tasks} {bodies:?}");
                let first = whole.diagnostics.iter().find(is_error).expect("an error");
                assert!(within.contains(&first.span.start), "{first:?}");
                // Also where a ladder is asked for, which is one program.
                let one = read(&text, None);
                assert!(one.program.is_none(), "{tasks} {bodies:?}");
                // Whoever chooses the other program reads that one.
                let chosen = if bodies[0] == wrong { "second" } else { "first" };
                assert!(read(&text, Some(chosen)).program.is_some(), "{tasks} {bodies:?}");
            }
        }
        let missing =
            file([right, right], tasks).replace(r#"typeName="second""#, r#"typeName="third""#);
        assert!(read(&missing, None).program.is_none(), "{missing}");
    }
}

#[test]
fn python_whose_answer_nothing_reads_has_no_effect() {
    let declared = r#"<variable name="poll"><type><derived name="python_poll"/></type></variable>"#;
    let variables = variable("n", "%QW0", "INT") + declared;
    let body = |more: &str| {
        format!("<ST><p>poll(TRIG := TRUE, CODE := 'f()'); n := n + 1; {more}</p></ST>")
    };
    let text = document(&variables, &body(""));
    assert_eq!(run(&text, &[&[], &[]]), [[1], [2]]);
    let answered = document(&variables, &body("IF poll.ACK THEN n := 0; END_IF;"));
    let found = typed(&answered, PERIOD).expect_err("an answer that nothing gives");
    assert!(found.iter().any(|found| found.message.contains("ACK")), "{found:#?}");
}
