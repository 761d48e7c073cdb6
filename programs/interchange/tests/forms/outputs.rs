//! An output is read by the world, and an input is written by it: each one that is declared is a point of its type, whatever the body does with it and
//! whatever the form.

use understudy_interchange::{Source, Wanted, read_source};
use understudy_text::{Severity, has_errors};
use understudy_typed::Points;

/// What the world sees of a source: points and their types, and what is kept in memory.
struct Seen {
    inputs: Vec<(String, &'static str)>,
    outputs: Vec<(String, &'static str)>,
    memory: Vec<String>,
}

fn seen(name: &str, text: &str) -> Seen {
    let read = read_source(name, text, Wanted::default());
    assert!(!has_errors(&read.diagnostics), "{text}\n{:#?}", read.diagnostics);
    let points = |points: &Points| {
        points.iter().map(|point| (point.name.clone(), point.of.name())).collect()
    };
    match read.source.expect("a program") {
        Source::Program(program) => Seen {
            inputs: points(&program.inputs),
            outputs: points(&program.outputs),
            memory: program.variables.iter().map(|variable| variable.name.clone()).collect(),
        },
        Source::Library(units) => panic!("a library: {units:?}"),
    }
}

/// Whether a variable is among names: itself, or the bits of its number.
fn has(names: &[String], variable: &str) -> bool {
    names.iter().any(|name| {
        let rest = name.strip_prefix(variable);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    })
}

/// The type of a point.
fn type_of(points: &[(String, &'static str)], variable: &str) -> Option<&'static str> {
    points.iter().find(|(name, _)| name == variable).map(|(_, of)| *of)
}

/// How the variable `n` is declared where it is an input.
const INPUTS: [&str; 4] =
    ["input", "local at %I", "global at %I", "global at %I that no unit names"];

/// How the variable `n` is declared, and whether it is an output.
const DECLARED: [(&str, bool); 9] = [
    ("output", true),
    ("output at %M", true),
    ("local at %Q", true),
    ("global at %Q", true),
    ("global at %Q that no unit names", true),
    ("local at %M", false),
    ("global at %M", false),
    ("global", false),
    ("retained output", true),
];

/// A row of [`TYPES`].
type Type = (&'static str, char, &'static str, Option<(&'static str, &'static str, &'static str)>);

/// Types, the size of an address, a value, and the output of a standard block that goes there.
const TYPES: [Type; 9] = [
    ("BOOL", 'X', "TRUE", Some(("TON", "IN", "Q"))),
    ("BOOL", 'X', "FALSE", Some(("CTU", "CU", "Q"))),
    ("INT", 'W', "0", Some(("CTU", "CU", "CV"))),
    ("INT", 'W', "-7", Some(("CTUD", "CU", "CV"))),
    ("TIME", 'L', "T#3s", Some(("TON", "IN", "ET"))),
    ("TIME", 'L', "T#0s", Some(("TOF", "IN", "ET"))),
    ("UDINT", 'D', "5", None),
    ("REAL", 'D', "1.5", None),
    ("WORD", 'W', "16#0", None),
];

/// What is wired to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wired {
    Nothing,
    Value,
    Block,
    /// By way of a MOVE.
    Moved,
}

const WIRED: [Wired; 4] = [Wired::Nothing, Wired::Value, Wired::Block, Wired::Moved];

/// The list of variables, its attributes, the address, and the list of the configuration.
fn placed(declared: &str, size: char) -> (&'static str, &'static str, String, bool) {
    let address = |area: char| match size {
        'X' => format!("%{area}X3.1"),
        size => format!("%{area}{size}4"),
    };
    let is_global = declared.starts_with("global");
    let list = match declared {
        "output" | "output at %M" | "retained output" => "outputVars",
        "input" => "inputVars",
        "global at %Q that no unit names" | "global at %I that no unit names" => "",
        _ if is_global => "externalVars",
        _ => "localVars",
    };
    let attributes = if declared.starts_with("retained") { r#" retain="true""# } else { "" };
    let address = match declared.split_once(" at %") {
        Some((_, area)) => address(area.chars().next().unwrap_or('M')),
        None => String::new(),
    };
    (list, attributes, address, is_global)
}

fn document(language: &str, declared: &str, of: usize, wired: Wired) -> String {
    let (kind, size, value, block) = TYPES[of];
    let (list, attributes, address, is_global) = placed(declared, size);
    let variable = |address: &str| {
        let address = match address {
            "" => String::new(),
            address => format!(r#" address="{address}""#),
        };
        format!(r#"<variable name="n"{address}><type><{kind}/></type></variable>"#)
    };
    let own = match list {
        "" => String::new(),
        list if is_global => format!("<{list}>{}</{list}>", variable("")),
        list => format!("<{list}{attributes}>{}</{list}>", variable(&address)),
    };
    let globals = match is_global {
        true => format!("<globalVars>{}</globalVars>", variable(&address)),
        false => String::new(),
    };
    let from = |id: u32, pin: &str| {
        let pin = match pin {
            "" => String::new(),
            pin => format!(r#" formalParameter="{pin}""#),
        };
        format!(r#"<connectionPointIn><connection refLocalId="{id}"{pin}/></connectionPointIn>"#)
    };
    let given = |id: u32, text: &str| {
        format!(
            r#"<inVariable localId="{id}"><connectionPointOut/><expression>{text}</expression></inVariable>"#
        )
    };
    let taken = |id: u32, source: String, text: &str| {
        format!(
            r#"<outVariable localId="{id}">{source}<expression>{text}</expression></outVariable>"#
        )
    };
    let mut body = match language {
        "LD" => format!(
            r#"<leftPowerRail localId="1"><connectionPointOut/></leftPowerRail><contact localId="2">{}<connectionPointOut/><variable>a</variable></contact><coil localId="3">{}<connectionPointOut/><variable>lamp</variable></coil>"#,
            from(1, ""),
            from(2, "")
        ),
        _ => given(2, "a") + &taken(3, from(2, ""), "lamp"),
    };
    let mut source = (5, "");
    if matches!(wired, Wired::Block | Wired::Moved)
        && let Some((word, pin, output)) = block
    {
        body += &format!(
            r#"<block localId="5" typeName="{word}" instanceName="b"><inputVariables><variable formalParameter="{pin}">{}</variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="{output}"><connectionPointOut/></variable></outputVariables></block>"#,
            from(2, "")
        );
        source = (5, output);
    } else if wired != Wired::Nothing {
        body += &given(5, value);
    }
    if wired == Wired::Moved {
        body += &format!(
            r#"<block localId="6" typeName="MOVE"><inputVariables><variable formalParameter="IN">{}</variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#,
            from(source.0, source.1)
        );
        source = (6, "OUT");
    }
    if wired != Wired::Nothing {
        body += &taken(7, from(source.0, source.1), "n");
    }
    let instance = match block {
        Some((word, ..)) => {
            format!(r#"<variable name="b"><type><derived name="{word}"/></type></variable>"#)
        }
        None => String::new(),
    };
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous><pou name="main" pouType="program"><interface>{own}<localVars><variable name="a" address="%IX0.0"><type><BOOL/></type></variable><variable name="lamp" address="%QX0.0"><type><BOOL/></type></variable>{instance}</localVars></interface><body><{language}>{body}</{language}></body></pou></pous></types><instances><configurations><configuration name="c"><resource name="r"><task name="t" interval="T#20ms" priority="0"><pouInstance name="i" typeName="main"/></task>{globals}</resource></configuration></configurations></instances></project>"#
    )
}

fn text(declared: &str, of: usize, wired: Wired) -> String {
    let (kind, size, value, block) = TYPES[of];
    let (list, _, address, is_global) = placed(declared, size);
    let at = |address: &str| match address {
        "" => String::new(),
        address => format!(" AT {address}"),
    };
    let own = match list {
        "outputVars" if declared.starts_with("retained") => {
            format!("VAR_OUTPUT RETAIN n{} : {kind}; END_VAR", at(&address))
        }
        "outputVars" => format!("VAR_OUTPUT n{} : {kind}; END_VAR", at(&address)),
        "inputVars" => format!("VAR_INPUT n : {kind}; END_VAR"),
        "externalVars" => format!("VAR_EXTERNAL n : {kind}; END_VAR"),
        "localVars" => format!("VAR n{} : {kind}; END_VAR", at(&address)),
        _ => String::new(),
    };
    let globals = match is_global {
        true => format!("VAR_GLOBAL n{} : {kind}; END_VAR", at(&address)),
        false => String::new(),
    };
    let (instance, call, value) = match (wired, block) {
        (Wired::Block | Wired::Moved, Some((word, pin, output))) => {
            (format!("b : {word};"), format!("b({pin} := a);"), format!("b.{output}"))
        }
        _ => (String::new(), String::new(), value.to_owned()),
    };
    let write = match wired {
        Wired::Nothing => String::new(),
        Wired::Moved => format!("n := MOVE({value});"),
        _ => format!("n := {value};"),
    };
    format!(
        "PROGRAM main {own} VAR a AT %IX0.0 : BOOL; lamp AT %QX0.0 : BOOL; {instance} END_VAR lamp := a; {call} {write} END_PROGRAM
CONFIGURATION c {globals} RESOURCE r ON plc TASK t(INTERVAL := T#20ms, PRIORITY := 0); PROGRAM i WITH t : main; END_RESOURCE END_CONFIGURATION"
    )
}

#[test]
fn every_declared_output_is_a_point_and_what_is_located_is_kept() {
    let mut checked = 0;
    for (declared, is_output) in DECLARED {
        for (of, (kind, ..)) in TYPES.iter().enumerate() {
            for wired in WIRED {
                if declared.ends_with("no unit names") && wired != Wired::Nothing {
                    continue;
                }
                let texts = [
                    ("p.xml", document("FBD", declared, of, wired)),
                    ("p.xml", document("LD", declared, of, wired)),
                    ("p.st", text(declared, of, wired)),
                ];
                for (name, text) in &texts {
                    let seen = seen(name, text);
                    let case = format!("{name}: {declared}, {kind}, {wired:?}\n{text}");
                    assert_eq!(type_of(&seen.outputs, "lamp"), Some("BOOL"), "{case}");
                    assert_eq!(type_of(&seen.outputs, "n"), is_output.then_some(*kind), "{case}");
                    // Memory that nothing uses is in the account of a conversion; what is always the same needs no
                    // memory, unless others read it at its address.
                    let is_constant = wired == Wired::Value || TYPES[of].3.is_none();
                    let is_used = wired != Wired::Nothing && !(is_constant && declared == "global");
                    assert!(!is_used || is_output || has(&seen.memory, "n"), "{case}");
                    checked += 1;
                }
            }
        }
    }
    assert!(checked > 700, "{checked}");
}

#[test]
fn every_declared_input_is_a_point_of_its_type() {
    for declared in INPUTS {
        for (of, (kind, ..)) in TYPES.iter().enumerate() {
            let texts = [
                ("p.xml", document("FBD", declared, of, Wired::Nothing)),
                ("p.xml", document("LD", declared, of, Wired::Nothing)),
                ("p.st", text(declared, of, Wired::Nothing)),
            ];
            for (name, text) in &texts {
                let seen = seen(name, text);
                let case = format!("{name}: {declared}, {kind}\n{text}");
                assert_eq!(type_of(&seen.inputs, "a"), Some("BOOL"), "{case}");
                assert_eq!(type_of(&seen.inputs, "n"), Some(*kind), "{case}");
                assert_eq!(type_of(&seen.outputs, "n"), None, "{case}");
            }
        }
    }
}

#[test]
fn every_part_of_a_structure_is_a_point() {
    for (body, is_ladder) in
        [("", true), ("s.on := TRUE;", true), ("s.count := 3;", true), ("s.level := 1.0;", false)]
    {
        let level = if is_ladder { "" } else { "level : REAL;" };
        let text = format!(
            "TYPE part : STRUCT on : BOOL; count : INT; {level} END_STRUCT; END_TYPE
PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT s : part; y : BOOL; END_VAR y := a; {body} END_PROGRAM"
        );
        let seen = seen("p.st", &text);
        for (name, of) in [("s.on", "BOOL"), ("s.count", "INT"), ("y", "BOOL")] {
            assert_eq!(type_of(&seen.outputs, name), Some(of), "{name}: {text}");
        }
        assert_eq!(type_of(&seen.outputs, "s.level").is_some(), !is_ladder);
    }
}

#[test]
fn an_output_that_cannot_be_a_point_is_said() {
    for of in ["STRING", "ARRAY[0..3] OF INT", "TON"] {
        let text = format!(
            "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR_OUTPUT n : {of}; y : BOOL; END_VAR y := a; END_PROGRAM"
        );
        let read = read_source("p.st", &text, Wanted::default());
        let names = |found: &&understudy_text::Diagnostic| {
            found.severity >= Severity::Warning && found.message.contains("`n`")
        };
        let is_point = match &read.source {
            Some(Source::Program(program)) => {
                program.outputs.iter().any(|point| point.name.starts_with('n'))
            }
            _ => false,
        };
        assert!(is_point || read.diagnostics.iter().any(|it| names(&it)), "{of}");
    }
}

#[test]
fn outputs_that_nothing_writes_are_kept_in_the_other_forms() {
    let ladder = "program p\ninput a\noutput y\noutput spare\nrung\n    a (y)\n";
    let ldmicro = "LDmicro0.1\nIO LIST\n    Xa at 1\n    Yspare at 2\nEND\nPROGRAM\nRUNG\n    CONTACTS Xa 0\n    COIL Yy 0 0 0\nEND\n";
    assert!(type_of(&seen("p.ladder", ladder).outputs, "spare").is_some());
    assert!(type_of(&seen("p.ld", ldmicro).outputs, "Yspare").is_some());
}
