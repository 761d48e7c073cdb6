//! The rungs of what is drawn as a ladder, the remarks on them, and rungs that are not of the schema.

use std::time::Duration;

use understudy_interchange::{SourceFile, Wanted, read_source};
use understudy_ladder::print;
use understudy_text::Report;

use crate::meaning::{BITS, RAIL, block, coil, contact, file, value, variables};

fn read_at(text: &str, milliseconds: u64) -> SourceFile {
    let period = Some(Duration::from_millis(milliseconds));
    read_source("drawn.xml", text, Wanted { program: None, period })
}

/// Edges of contacts and coils, several coils of one power, a block in the wire and one that is read elsewhere.
fn ladder() -> String {
    let mut declared = variables(&BITS);
    declared += &variables(&[("local", "t", "<derived name=\"TON\"/>"), ("local", "m", "<BOOL/>")]);
    let objects = [
        RAIL.to_owned(),
        contact(1, "a", &[0]).replace("<contact ", "<contact edge=\"rising\" "),
        contact(2, "b", &[1]),
        coil(3, "y", &[2]),
        coil(4, "m", &[2]).replace("negated=\"false\"", "negated=\"true\""),
        value(5, "T#3s"),
        contact(6, "m", &[0]),
        block(7, "TON", "t", &[("IN", 6), ("PT", 5)]),
        coil(8, "z", &[7]),
        contact(9, "t.Q", &[0]),
        coil(10, "y", &[9]).replace("<coil ", "<coil storage=\"set\" "),
    ];
    file(&declared, &objects.concat())
}

#[test]
fn rungs_are_those_of_the_drawing() {
    let read = read_at(&ladder(), 10);
    let rungs = read.rungs.unwrap_or_else(|| panic!("{:?}", read.diagnostics));
    insta::assert_snapshot!(print(&rungs.ladder));
    // Networks are no rungs.
    let network = ladder().replace("<LD>", "<FBD>").replace("</LD>", "</FBD>");
    let network = network.replace(RAIL, "");
    assert!(read_at(&network, 10).rungs.is_none());
}

/// Rungs are executed in every scan, and a program whose task waits longer is not.
#[test]
fn a_task_that_waits_longer_than_a_period_has_no_rungs() {
    let task = "<configurations><configuration name=\"c\"><resource name=\"r\"><task name=\"t\" interval=\"T#20ms\" \
                priority=\"0\"><pouInstance name=\"i\" typeName=\"main\"/></task></resource></configuration></configurations>";
    let text = ladder().replace("<configurations/>", task);
    assert!(read_at(&text, 20).rungs.is_some());
    assert!(read_at(&text, 10).rungs.is_none());
}

#[test]
fn a_remark_stands_at_its_contact_or_coil() {
    let objects = [
        RAIL.to_owned(),
        contact(1, "y", &[0]),
        coil(2, "z", &[1]),
        contact(3, "a", &[0]),
        coil(4, "y", &[3]),
    ];
    let text = file(&variables(&BITS), &objects.concat());
    let diagnostics = read_at(&text, 10).diagnostics;
    let report = Report { name: String::new(), text, diagnostics: Vec::new() };
    let found: Vec<String> = diagnostics
        .iter()
        .map(|found| {
            let related =
                found.related.iter().map(|related| report.line_and_column(related.span.start));
            let related: Vec<String> = related.map(|place| place.to_string()).collect();
            let place = report.line_and_column(found.span.start);
            format!("{place} {} {} {}", found.code, found.message, related.join(" "))
        })
        .collect();
    insta::assert_snapshot!(found.join("\n"));
}

/// A number at PT counts scans, and numbers that nothing reads are left out.
#[test]
fn numbers_of_rungs_that_are_not_of_the_schema() {
    let declared = variables(&BITS)
        + &variables(&[("local", "et", "<INT/>"), ("local", "wait", "<INT/>")]).replacen(
            "<type><INT/></type></variable></localVars><localVars><variable name=\"wait\"><type><INT/></type>",
            "<type><INT/></type><initialValue><simpleValue value=\"none\"/></initialValue></variable></localVars>\
             <localVars><variable name=\"wait\"><type><INT/></type><initialValue><simpleValue value=\"3\"/></initialValue>",
            1,
        )
        + &variables(&[("local", "t", "<derived name=\"TON\"/>")]);
    let rung = "<rung localId=\"1\"><contact variable=\"a\"/><block typeName=\"TON\" instanceName=\"t\">\
                <variable formalParameter=\"PT\">wait</variable><variable formalParameter=\"ET\">et</variable></block>\
                <coil variable=\"y\"/></rung>";
    let read = read_at(&file(&declared, rung), 10);
    let rungs = read.rungs.unwrap_or_else(|| panic!("{:?}", read.diagnostics));
    insta::assert_snapshot!(print(&rungs.ladder));
}
