//! The interval of a task is kept or told, in each language, however the task is declared and whatever the period is.

use std::time::Duration;

use understudy_executable::{Executable, Interface, Scratch, declared};
use understudy_interchange::{
    Bodies, Copies, Format, Joined, Source, SourceFile, Wanted, read_apart, read_ladder,
    read_source, typed_text,
};
use understudy_text::{Diagnostic, has_errors};

/// When a program runs: in a task with an interval in milliseconds, in a task with neither interval nor event, at an event, or in no task.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Runs {
    Every(u64),
    Plain,
    Event,
    NoTask,
}
use Runs::{Event, Every, NoTask, Plain};

/// What a file runs: one program, or two.
const WAYS: [&[Runs]; 13] = [
    &[Every(100)],
    &[Every(20)],
    &[Plain],
    &[NoTask],
    &[Event],
    &[Every(100), Every(100)],
    &[Every(10), Every(25)],
    &[Every(25), Every(10)],
    &[Every(40), NoTask],
    &[NoTask, Every(40)],
    &[Every(40), Plain],
    &[Every(40), Event],
    &[Event, NoTask],
];

/// Milliseconds: those that divide intervals, those that do not, and longer ones; 0 for none.
const PERIODS: [u64; 11] = [0, 1, 5, 10, 20, 25, 30, 50, 100, 130, 250];

/// The languages in which the two programs are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Language {
    Text,
    TextWithNumbers,
    Document,
    Ladder,
    TwinCat,
}

const LANGUAGES: [Language; 5] = [
    Language::Text,
    Language::TextWithNumbers,
    Language::Document,
    Language::Ladder,
    Language::TwinCat,
];

/// The program at a place: its output changes each time it runs.
fn unit(language: Language, at: usize) -> String {
    let (name, output) = (["first", "second"][at], ["y", "z"][at]);
    let body = format!("{output} := NOT {output};");
    let address = format!("%QX0.{at}");
    match language {
        Language::TextWithNumbers => format!(
            "PROGRAM {name} VAR {output} AT %QW{at} : INT; END_VAR {output} := {output} + 1; END_PROGRAM\n"
        ),
        Language::Text => {
            format!("PROGRAM {name} VAR {output} AT {address} : BOOL; END_VAR {body} END_PROGRAM\n")
        }
        Language::TwinCat => format!(
            "<TcPlcObject><POU Name=\"{name}\"><Declaration>PROGRAM {name} VAR {output} AT {address} : BOOL; END_VAR</Declaration><Implementation><ST>{body}</ST></Implementation></POU></TcPlcObject>"
        ),
        Language::Document | Language::Ladder => {
            let body = match language {
                Language::Document => format!("<ST><p>{body}</p></ST>"),
                _ => format!(
                    r#"<LD><leftPowerRail localId="1"><connectionPointOut/></leftPowerRail><contact localId="2" negated="true"><connectionPointIn><connection refLocalId="1"/></connectionPointIn><connectionPointOut/><variable>{output}</variable></contact><coil localId="3"><connectionPointIn><connection refLocalId="2"/></connectionPointIn><connectionPointOut/><variable>{output}</variable></coil></LD>"#
                ),
            };
            format!(
                r#"<pou name="{name}" pouType="program"><interface><localVars><variable name="{output}" address="{address}"><type><BOOL/></type></variable></localVars></interface><body>{body}</body></pou>"#
            )
        }
    }
}

/// A file, with its name; none where the language cannot say it.
fn file(language: Language, runs: &[Runs]) -> Option<(String, String)> {
    let names = ["first", "second"];
    let units: Vec<String> = (0..runs.len()).map(|at| unit(language, at)).collect();
    let mut tasks = String::new();
    let mut free = String::new();
    match language {
        Language::Text | Language::TextWithNumbers => {
            for (at, run) in runs.iter().enumerate() {
                tasks += &match run {
                    Every(time) => {
                        format!("TASK t{at}(INTERVAL := T#{time}ms, PRIORITY := {at});\n")
                    }
                    Plain => format!("TASK t{at}(PRIORITY := {at});\n"),
                    Event => format!("TASK t{at}(SINGLE := go, PRIORITY := {at});\n"),
                    NoTask => String::new(),
                };
                let with = if *run == NoTask { String::new() } else { format!(" WITH t{at}") };
                free += &format!("PROGRAM i{at}{with} : {};\n", names[at]);
            }
            let text = format!(
                "{}CONFIGURATION c VAR_GLOBAL go AT %IX0.0 : BOOL; END_VAR RESOURCE r ON plc\n{tasks}{free}END_RESOURCE END_CONFIGURATION\n",
                units.concat()
            );
            Some(("plant.st".to_owned(), text))
        }
        Language::Document | Language::Ladder => {
            for (at, run) in runs.iter().enumerate() {
                let instance = format!(r#"<pouInstance name="i{at}" typeName="{}"/>"#, names[at]);
                let attribute = match run {
                    Every(time) => format!(r#"interval="T#{time}ms""#),
                    Event => r#"single="go""#.to_owned(),
                    Plain => String::new(),
                    NoTask => {
                        free += &instance;
                        continue;
                    }
                };
                tasks +=
                    &format!(r#"<task name="t{at}" priority="{at}" {attribute}>{instance}</task>"#);
            }
            let text = format!(
                r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous>{}</pous></types><instances><configurations><configuration name="c"><resource name="r">{tasks}<globalVars><variable name="go" address="%IX0.0"><type><BOOL/></type></variable></globalVars>{free}</resource></configuration></configurations></instances></project>"#,
                units.concat()
            );
            Some(("plant.xml".to_owned(), text))
        }
        Language::TwinCat => {
            let mut files = Vec::new();
            for (at, (run, unit)) in runs.iter().zip(units).enumerate() {
                let Every(time) = run else {
                    return None;
                };
                let name = names[at];
                files.push((format!("{name}.TcPOU"), unit));
                files.push((format!("t{at}.TcTTO"), format!("<TcPlcObject><Task Name=\"t{at}\"><CycleTime>{}</CycleTime><Priority>{at}</Priority><PouCall><Name>{name}</Name></PouCall></Task></TcPlcObject>", time * 1000)));
            }
            let joined = Joined::of(files).expect("files of TwinCAT");
            Some(("plant.plcproj".to_owned(), joined.text))
        }
    }
}

fn divisor(one: u64, other: u64) -> u64 {
    if other == 0 { one } else { divisor(other, one % other) }
}

/// In how many scans each program runs, whether the intervals are kept, and the period of the file.
fn expected(runs: &[Runs], period: u64) -> (Vec<u64>, bool, Option<u64>) {
    let intervals = runs.iter().filter_map(|run| match run {
        Every(interval) => Some(*interval),
        _ => None,
    });
    let common = intervals.reduce(divisor);
    let used = if period == 0 { common.unwrap_or(10) } else { period };
    let every = runs.iter().map(|run| match run {
        Every(interval) => ((*interval as f64 / used as f64).round() as u64).max(1),
        _ => 1,
    });
    (every.collect(), common.is_none_or(|common| common % used == 0), common)
}

fn milliseconds(period: u64) -> Option<Duration> {
    (period > 0).then(|| Duration::from_millis(period))
}

/// The outputs of 40 scans, by their names; the input `go` is on in every third one.
fn outputs(source: &Source) -> Vec<Vec<(String, u64)>> {
    let (executable, interface): (Executable, Interface) = match source {
        Source::Program(program) => (program.as_ref().into(), program.as_ref().into()),
        Source::Library(units) => panic!("a library: {units:?}"),
    };
    let mut state = executable.initial().to_vec();
    let mut read = vec![0; interface.inputs.width().div_ceil(64)];
    let mut driven = vec![0; interface.outputs.width().div_ceil(64)];
    let mut scratch = Scratch::default();
    let scans = (0..40).map(|scan| {
        if let Some(go) = interface.inputs.find("go") {
            go.set(&mut read, u64::from(scan % 3 == 1));
        }
        executable.step(&mut scratch, &mut state, &read, &mut driven);
        let points = declared(&interface.outputs);
        points.map(|point| (point.name.to_lowercase(), point.get(&driven))).collect()
    });
    scans.collect()
}

/// Checks that the outputs of a source are those of programs that run so often.
fn check(source: &Source, runs: &[(Runs, u64, &str)], about: &str) {
    for (scan, found) in (0_u64..).zip(outputs(source)) {
        for (run, every, output) in runs {
            let count = match run {
                // On in the scans 1, 4, 7 …
                Event => scan.div_ceil(3),
                _ => scan / every + 1,
            };
            let (_, value) = found.iter().find(|(name, _)| name == output).expect("the output");
            let is_right = *value == count % 2 || *value == count;
            assert!(is_right, "{about}: `{output}` is {value} after {count} runs in scan {scan}");
        }
    }
}

fn named(source: &Source) -> &str {
    match source {
        Source::Program(program) => &program.name,
        Source::Library(_) => "",
    }
}

fn told(found: &[Diagnostic]) -> bool {
    found.iter().any(|found| found.code == "U1084")
}

/// All ways to run programs, all languages, all periods: each program runs as often as its task says, or it is told that it does not.
#[test]
fn the_interval_of_a_task_is_kept_or_told() {
    let mut checked = 0;
    for language in LANGUAGES {
        for runs in WAYS {
            let Some((name, text)) = file(language, runs) else {
                continue;
            };
            for period in PERIODS {
                let about = format!("{language:?} {runs:?} at {period} ms");
                let wanted = Wanted { period: milliseconds(period), program: None };
                let read = read_source(&name, &text, wanted);
                assert!(!has_errors(&read.diagnostics), "{about}: {:#?}\n{text}", read.diagnostics);
                let (every, is_kept, common) = expected(runs, period);
                assert_eq!(told(&read.diagnostics), !is_kept, "{about}: {:?}", read.diagnostics);
                assert_eq!(read.period, common.and_then(milliseconds), "{about}");
                let source = read.source.expect("a program");
                let each = runs.iter().zip(every).zip(["y", "z"]);
                let each: Vec<_> = each.map(|((run, every), name)| (*run, every, name)).collect();
                check(&source, &each, &about);
                checked += 1;
            }
        }
    }
    assert!(checked > 500, "{checked} cases");
}

/// A program that was chosen of a file, and one that was written for a controller of its own, runs as often as in the file.
#[test]
fn a_program_alone_keeps_its_interval() {
    for language in LANGUAGES {
        for runs in WAYS {
            let Some((name, text)) = file(language, runs) else {
                continue;
            };
            let (apart, found) = read_apart(&name, &text, Copies::AsRead);
            assert!(!has_errors(&found), "{language:?} {runs:?}: {found:#?}");
            assert_eq!(apart.len(), runs.len(), "{language:?} {runs:?}");
            for period in PERIODS {
                for (at, run) in runs.iter().enumerate() {
                    let about = format!("{language:?} {runs:?} program {at} at {period} ms");
                    let (every, is_kept, common) = expected(&[*run], period);
                    let wanted = milliseconds(period);
                    let name_of = ["first", "second"][at];
                    let program = Some(name_of);
                    let chosen = read_source(&name, &text, Wanted { program, period: wanted });
                    let own = apart.iter().find(|one| named(&one.source) == name_of);
                    let alone = match &own.expect("the program").written {
                        None => read_source(&name, &text, Wanted { period: wanted, program: None }),
                        Some(written) => {
                            let (format, written) = written.as_ref().expect("written");
                            assert_eq!(written.losses, [], "{about}");
                            let name = format!("alone.{}", format.ending());
                            read_source(
                                &name,
                                &written.text,
                                Wanted { period: wanted, program: None },
                            )
                        }
                    };
                    for SourceFile { source, period, diagnostics, .. } in [chosen, alone] {
                        assert!(!has_errors(&diagnostics), "{about}: {diagnostics:#?}");
                        assert_eq!(told(&diagnostics), !is_kept, "{about}: {diagnostics:?}");
                        assert_eq!(period, common.and_then(milliseconds), "{about}");
                        let one = (*run, every[0], ["y", "z"][at]);
                        check(&source.expect("a program"), &[one], &about);
                    }
                }
            }
        }
    }
}

/// What is written in another form has the same tasks.
#[test]
fn another_form_has_the_same_intervals() {
    for language in LANGUAGES {
        for runs in WAYS {
            let Some((name, text)) = file(language, runs) else {
                continue;
            };
            for form in [Format::StructuredText, Format::PlcOpen] {
                let about = format!("{language:?} {runs:?} as {form:?}");
                let written = typed_text(&name, &text, Wanted::default(), form, Bodies::AsRead);
                let written = written.unwrap_or_else(|error| panic!("{about}: {error}")).0;
                let again = format!("again.{}", form.ending());
                let read = read_source(&again, &written.expect("a text").text, Wanted::default());
                let (every, _, common) = expected(runs, 0);
                assert_eq!(read.period, common.and_then(milliseconds), "{about}");
                let each = runs.iter().zip(every).zip(["y", "z"]);
                let each: Vec<_> = each.map(|((run, every), name)| (*run, every, name)).collect();
                check(&read.source.expect("a program"), &each, &about);
            }
        }
    }
}

/// A period that is given for a conversion is the interval of the one task; several tasks keep theirs, which is said.
#[test]
fn a_given_period_is_the_interval_of_the_written_task() {
    for language in LANGUAGES {
        for runs in WAYS {
            let Some((name, text)) = file(language, runs) else {
                continue;
            };
            let period = Duration::from_millis(50);
            let wanted = Wanted { period: Some(period), program: None };
            let about = format!("{language:?} {runs:?}");
            let written = typed_text(&name, &text, wanted, Format::StructuredText, Bodies::AsRead);
            let written = written.unwrap_or_else(|error| panic!("{about}: {error}")).0;
            let written = written.expect("a text");
            let again = read_source("again.st", &written.text, Wanted::default());
            let is_given = again.period == Some(period);
            assert_eq!(is_given, written.losses.is_empty(), "{about}: {:?}", written.losses);
        }
    }
}

/// A ladder runs in every scan: where one is read for another period, this is said. Of a document the interval is counted, also where a circuit is
/// wanted.
#[test]
fn a_ladder_of_another_period_is_told() {
    let ld = "LDmicro0.1\nCYCLE=20000\n\nIO LIST\n    Xa at 0\n    Yb at 0\nEND\n\nPROGRAM\nRUNG\n    CONTACTS Xa 0\n    COIL Yb 0 0 0\nEND\n";
    let (name, text) = file(Language::Ladder, &[Every(20)]).expect("a file");
    for (name, text) in [(name.as_str(), text.as_str()), ("blink.ld", ld)] {
        for (period, is_told) in [(0, false), (20, false), (10, false), (40, true)] {
            let read = read_ladder(name, text, milliseconds(period));
            assert!(read.program.is_some(), "{name}: {:?}", read.diagnostics);
            assert_eq!(read.period, milliseconds(20), "{name}");
            assert_eq!(told(&read.diagnostics), is_told, "{name} at {period} ms");
        }
    }
    let told_of = |period| {
        let wanted = Wanted { period: milliseconds(period), program: None };
        told(&read_source("blink.ld", ld, wanted).diagnostics)
    };
    assert_eq!([0, 20, 10, 40].map(told_of), [false, false, false, true]);
}

/// A cycle time that is no number is an error, and no program that runs in every scan.
#[test]
fn a_cycle_time_that_is_none_is_an_error() {
    for written in ["ten", "-1", "0", "1e4", "9223372036854775807"] {
        let unit = unit(Language::TwinCat, 0);
        let task = format!(
            "<TcPlcObject><Task Name=\"t\"><CycleTime>{written}</CycleTime><PouCall><Name>first</Name></PouCall></Task></TcPlcObject>"
        );
        let files = vec![("first.TcPOU".to_owned(), unit), ("t.TcTTO".to_owned(), task)];
        let joined = Joined::of(files).expect("files of TwinCAT");
        let read = read_source("plant.plcproj", &joined.text, Wanted::default());
        assert!(has_errors(&read.diagnostics), "{written}");
        assert!(read.source.is_none(), "{written}");
    }
}

/// A program is the one that was written, whatever its points are; where a ladder is asked for, each of them has one.
#[test]
fn every_language_is_a_typed_program_and_has_a_ladder() {
    for language in LANGUAGES {
        let (name, text) = file(language, &[Every(20)]).expect("a file");
        let source = read_source(&name, &text, Wanted::default()).source;
        assert!(matches!(source, Some(Source::Program(_))), "{language:?}");
        let read = read_ladder(&name, &text, None);
        assert!(read.program.is_some(), "{language:?}: {:?}", read.diagnostics);
    }
}
