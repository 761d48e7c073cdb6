//! What CODESYS and TwinCAT export: an application with its parts in additional data.

use understudy_interchange::plcopen::read;
use understudy_interchange::{Source, Wanted, read_source};
use understudy_text::has_errors;

use crate::numbers::{Scans, typed};
use crate::support::PERIOD;

const TASK: &str = r#"<task name="PlcTask" interval="PT0.01S" priority="20"><pouInstance name="MAIN" typeName=""><documentation/></pouInstance><addData><data name="http://www.3s-software.com/plcopenxml/tasksettings" handleUnknown="implementation"><TaskSettings KindOfTask="Cyclic"/></data></addData></task>"#;

fn data(word: &str, content: &str) -> String {
    format!(
        r#"<data name="http://www.3s-software.com/plcopenxml/{word}" handleUnknown="implementation">{content}</data>"#
    )
}

fn unit(name: &str, kind: &str, interface: &str, body: &str) -> String {
    format!(
        r#"<pou name="{name}" pouType="{kind}"><interface>{interface}</interface><body><ST><xhtml xmlns="http://www.w3.org/1999/xhtml">{body}</xhtml></ST></body></pou>"#
    )
}

fn variable(name: &str, of: &str) -> String {
    format!(r#"<variable name="{name}"><type>{of}</type></variable>"#)
}

/// The places where tools put an application and its parts.
#[derive(Debug, Clone, Copy)]
enum Place {
    Application,
    Configuration,
    Instances,
    Project,
}

const PLACES: [Place; 4] =
    [Place::Application, Place::Configuration, Place::Instances, Place::Project];

fn project(place: Place, parts: &[String], globals: &str) -> String {
    let parts = format!("<addData>{}</addData>", parts.concat());
    let resource = |more: &str| format!(r#"<resource name="Plc">{TASK}{globals}{more}</resource>"#);
    let configured =
        |resource: String| format!(r#"<configuration name="c">{resource}</configuration>"#);
    let (instances, added) = match place {
        Place::Application => (
            String::new(),
            format!("<addData>{}</addData>", data("application", &resource(&parts))),
        ),
        Place::Configuration => {
            let application = data("application", &configured(resource(&parts)));
            (String::new(), format!("<addData>{application}</addData>"))
        }
        Place::Instances => (configured(resource(&parts)), String::new()),
        Place::Project => (configured(resource("")), parts),
    };
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><dataTypes/><pous/></types><instances><configurations>{instances}</configurations></instances>{added}</project>"#
    )
}

fn main_unit(body: &str, more: &str) -> String {
    let interface = format!(
        "<inputVars>{}</inputVars><outputVars>{}</outputVars>{more}",
        variable("a", "<BOOL/>"),
        variable("q", "<BOOL/>")
    );
    data("pou", &unit("MAIN", "program", &interface, body))
}

#[test]
fn the_program_of_an_application_is_read_with_its_task() {
    for place in PLACES {
        let text = project(place, &[main_unit("q := NOT a;", "")], "");
        let found = read_source("export.xml", &text, Wanted::default());
        assert!(!has_errors(&found.diagnostics), "{place:?}: {:#?}", found.diagnostics);
        assert!(matches!(found.source, Some(Source::Program(_))), "{place:?}");
        assert_eq!(read(&text, None).period, Some(std::time::Duration::from_millis(10)));
        let mut scans = Scans::new(typed(&text, PERIOD).expect("a program"));
        assert_eq!([scans.scan(&[0]), scans.scan(&[1])], [[1], [0]], "{place:?}");
    }
}

#[test]
fn types_blocks_and_globals_of_an_application_are_read() {
    let mode = data(
        "datatype",
        r#"<dataType name="Mode"><baseType><enum><values><value name="off"/><value name="on"/></values></enum></baseType></dataType>"#,
    );
    let interface = format!(
        "<inputVars>{}</inputVars><outputVars>{}</outputVars>",
        variable("set", "<BOOL/>"),
        variable("now", r#"<derived name="Mode"/>"#)
    );
    let block = data(
        "pou",
        &unit(
            "Switch",
            "functionBlock",
            &interface,
            "IF set THEN now := on; ELSE now := off; END_IF",
        ),
    );
    let locals = format!("<localVars>{}</localVars>", variable("s", r#"<derived name="Switch"/>"#));
    let main = main_unit(
        "s(set := a); count := count + 1; q := s.now = Mode#on AND count &gt; 1;",
        &locals,
    );
    let globals = format!("<globalVars name=\"GVL\">{}</globalVars>", variable("count", "<INT/>"));
    for place in PLACES {
        for is_added in [false, true] {
            let mut parts = vec![main.clone(), block.clone(), mode.clone()];
            let own = if is_added {
                parts.push(data("globalvars", &globals));
                ""
            } else {
                globals.as_str()
            };
            let text = project(place, &parts, own);
            let program = typed(&text, PERIOD);
            let program = program.unwrap_or_else(|found| panic!("{place:?} {found:#?}"));
            let mut scans = Scans::new(program);
            let shown = [1, 1, 0, 1].map(|a| scans.scan(&[a])[0]);
            assert_eq!(shown, [0, 1, 0, 1], "{place:?}");
            let found = read_source("export.xml", &text, Wanted::default());
            assert!(found.source.is_some(), "{place:?}: {:#?}", found.diagnostics);
        }
    }
}

#[test]
fn what_of_an_application_is_not_read_is_refused_by_its_name() {
    for word in ["method", "property", "union", "mixedattrsvarlist", "application"] {
        let parts = [main_unit("q := a;", ""), data(word, "<Part/>")];
        let text = project(Place::Application, &parts, "");
        let found = typed(&text, PERIOD).expect_err("a refusal");
        assert!(found.iter().any(|found| found.message.contains(word)), "{word}: {found:#?}");
    }
    // Within a unit everything is a part of it.
    let main = main_unit("q := a;", "");
    let added = format!("<addData>{}</addData></pou>", data("pou", "<Method/>"));
    let text = project(Place::Application, &[main.replace("</pou>", &added)], "");
    let found = typed(&text, PERIOD).expect_err("a refusal");
    assert!(found.iter().any(|found| found.code == "U1010"), "{found:#?}");
}

/// A program of one network with an element of a vendor in front of it.
fn network(element: &str) -> String {
    let variables = |name: &str| variable(name, "<BOOL/>");
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0200"><types><dataTypes/><pous><pou name="MAIN" pouType="program"><interface><inputVars>{}</inputVars><outputVars>{}</outputVars></interface><body><FBD>{element}<inVariable localId="1"><position x="0" y="0"/><connectionPointOut/><expression>a</expression></inVariable><outVariable localId="2"><position x="0" y="0"/><connectionPointIn><connection refLocalId="1"/></connectionPointIn><expression>q</expression></outVariable></FBD></body></pou></pous></types><instances><configurations/></instances></project>"#,
        variables("a"),
        variables("q")
    )
}

#[test]
fn the_title_of_a_network_is_a_comment() {
    let element = |kind: &str, title: &str, more: &str| {
        let kind =
            data("fbdelementtype", &format!(r#"<ElementType xmlns="">{kind}</ElementType>"#));
        format!(
            r#"<vendorElement localId="9"><position x="0" y="0"/><alternativeText><xhtml xmlns="http://www.w3.org/1999/xhtml">{title}</xhtml></alternativeText>{more}<addData>{kind}</addData></vendorElement>"#
        )
    };
    for title in ["", "the lamp"] {
        let text = network(&element("networktitle", title, ""));
        let reading = read(&text, None);
        assert!(reading.diagnostics.is_empty(), "{:?}", reading.diagnostics);
        assert!(reading.fidelity.notes.is_empty(), "{:?}", reading.fidelity.notes);
        let program = reading.program.expect("a program");
        let comments: Vec<&str> = title.split_terminator('\n').collect();
        assert_eq!(program.rungs[0].comments, comments);
        assert!(typed(&text, PERIOD).is_ok());
    }
    let pins = r#"<inputVariables><variable formalParameter="x"><connectionPointIn><connection refLocalId="1"/></connectionPointIn></variable></inputVariables>"#;
    for (kind, more) in [("call", ""), ("networktitle", pins)] {
        let text = network(&element(kind, "", more));
        let found = read(&text, None).diagnostics;
        let codes: Vec<&str> = found.iter().map(|found| found.code).collect();
        assert_eq!(codes, ["U1010"], "{found:?}");
        let found = typed(&text, PERIOD).expect_err("an unknown element");
        assert_eq!(found.len(), 1, "{found:?}");
    }
}
