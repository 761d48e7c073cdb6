//! Nothing is left out in silence: without any one element or attribute of a file, the program or a finding is another.

use std::ops::Range;

use roxmltree::{Document, Node};
use understudy_interchange::Format;
use understudy_interchange::plcopen::{read, write};
use understudy_text::Severity;

use crate::reading::{reading, source};
use crate::support::PERIOD;
use understudy_testing::random::random_program;

/// Elements that only say how a program is drawn; a wire is the `connection` at its end, and the right rail takes no power.
const LAYOUT: [&str; 6] = [
    "position",
    "relPosition",
    "coordinateInfo",
    "connectionPointOut",
    "outputVariables",
    "rightPowerRail",
];

/// Attributes that only say how a program is drawn, or who wrote it.
const LAYOUT_ATTRIBUTES: [&str; 14] = [
    "x",
    "y",
    "width",
    "height",
    "companyName",
    "companyURL",
    "productName",
    "productVersion",
    "productRelease",
    "creationDateTime",
    "contentDescription",
    "version",
    "modificationDateTime",
    "organization",
];

/// Elements and attributes that the schema requires and that have no meaning for a program: the reader does not validate files
/// against the schema, so a file without them is read in the same way. Elements are among them only while they are empty.
const FORMAL: [&str; 10] = [
    "<fileHeader>",
    "<contentHeader>",
    "name of <contentHeader>",
    "<dataTypes>",
    "<inOutVariables>",
    "name of <configuration>",
    "name of <resource>",
    "name of <task>",
    "priority of <task>",
    "name of <pouInstance>",
];

/// Whether a missing part of a file violates its schema and nothing else. Inputs of functions, which have no instance, are read
/// by their order; those of blocks are read by their names.
fn is_formal(node: Node<'_, '_>, what: &str) -> bool {
    let is_function = |node: Node<'_, '_>| {
        node.tag_name().name() == "block" && !node.has_attribute("instanceName")
    };
    match what {
        "formalParameter of <variable>" => node.ancestors().any(is_function),
        "<p>" => node.text().unwrap_or_default().trim().is_empty(),
        _ => {
            let mut children = node.children().filter(Node::is_element);
            let is_empty = children.all(|child| LAYOUT.contains(&child.tag_name().name()));
            FORMAL.contains(&what) && (is_empty || !what.starts_with('<'))
        }
    }
}

/// The elements and attributes of a file without which it is read in the same way.
fn unread(text: &str) -> Vec<String> {
    let whole = reading(Format::PlcOpen, text);
    let document = Document::parse(text).expect("XML");
    let mut unread = Vec::new();
    let mut check = |place: Range<usize>, node: Node<'_, '_>, what: String| {
        if is_formal(node, &what) {
            return;
        }
        let without = format!("{}{}", &text[..place.start], &text[place.end..]);
        if Document::parse(&without).is_ok() && reading(Format::PlcOpen, &without) == whole {
            let around: Vec<&str> =
                node.ancestors().skip(1).map(|node| node.tag_name().name()).collect();
            unread.push(format!("{what} in {}", around.join(" in ")));
        }
    };
    let is_drawing = |node: &Node<'_, '_>| LAYOUT.contains(&node.tag_name().name());
    let found = read(text, None);
    let places: Vec<usize> = found
        .diagnostics
        .iter()
        .map(|found| found.span.start)
        .chain(found.fidelity.notes.iter().map(|note| note.span.start))
        .collect();
    // What an object, a part or another unit is found not to be is found of all that is in it.
    let is_found = |node: &Node<'_, '_>| {
        let is_read = matches!(node.attribute("name"), Some("main" | "random"));
        let start = node.range().start;
        let end = start + text[start..].find('>').unwrap_or(0);
        let has_name = node.has_attribute("localId") || node.has_attribute("name") && !is_read;
        has_name && places.iter().any(|place| (start..end).contains(place))
    };
    for node in document.descendants().filter(Node::is_element) {
        if node.ancestors().any(|node| is_drawing(&node)) {
            continue;
        }
        if node.ancestors().skip(1).any(|node| is_found(&node)) {
            continue;
        }
        let name = node.tag_name().name();
        let says =
            node.descendants().filter_map(|node| node.text()).any(|text| !text.trim().is_empty());
        let is_empty = matches!(name, "documentation" | "comment") && !says;
        // A rail that nothing is connected to.
        let is_rail = name == "leftPowerRail"
            && !text.contains(&format!(
                "refLocalId=\"{}\"",
                node.attribute("localId").unwrap_or_default()
            ));
        if is_empty || is_rail {
            continue;
        }
        check(node.range(), node, format!("<{name}>"));
        for attribute in node.attributes() {
            let is_usual = matches!(attribute.value(), "" | "false" | "none");
            // The output that a wire leaves by itself may be named or not, and rungs are numbered by their order.
            let is_pin = name == "connection" && attribute.name() == "formalParameter"
                || name == "rung" && attribute.name() == "localId";
            if !is_usual && !is_pin && !LAYOUT_ATTRIBUTES.contains(&attribute.name()) {
                let what = format!("{} of <{name}>", attribute.name());
                check(attribute.range(), node, what);
            }
        }
    }
    unread
}

#[test]
fn every_element_of_a_written_program_counts() {
    for seed in 0..3 {
        let text = write(&random_program(seed, 3), PERIOD);
        assert_eq!(unread(&text), Vec::<String>::new(), "seed {seed}\n{text}");
    }
}

#[test]
fn every_element_of_the_examples_counts() {
    for name in ["pump", "probes"] {
        let path = format!("{}/../../examples/plcopen/{name}.xml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).expect("an example");
        assert_eq!(unread(&text), Vec::<String>::new(), "{name}");
    }
}

/// Of one language each, with all that the reader knows.
const BODIES: [(&str, &str); 6] = [
    (
        "a ladder",
        r#"<LD><comment localId="1" height="1" width="1"><position x="0" y="0"/><content><xhtml:p>all of it</xhtml:p></content></comment>
<leftPowerRail localId="2"><position x="0" y="1"/><connectionPointOut formalParameter=""/></leftPowerRail>
<contact localId="3" negated="true" edge="rising"><position x="9" y="1"/><connectionPointIn><connection refLocalId="2"/></connectionPointIn><connectionPointOut/><variable>a</variable></contact>
<block localId="4" typeName="TON" instanceName="t"><position x="19" y="1"/><inputVariables><variable formalParameter="IN"><connectionPointIn><connection refLocalId="3"/></connectionPointIn></variable><variable formalParameter="PT"><connectionPointIn><connection refLocalId="5"/></connectionPointIn></variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="Q"><connectionPointOut/></variable></outputVariables></block>
<inVariable localId="5" negated="false"><position x="9" y="2"/><connectionPointOut/><expression>T#300ms</expression></inVariable>
<coil localId="6" storage="set"><position x="29" y="1"/><connectionPointIn><connection refLocalId="4" formalParameter="Q"/></connectionPointIn><connectionPointOut/><variable>y</variable></coil>
<contact localId="7"><position x="9" y="5"/><connectionPointIn><connection refLocalId="2"/></connectionPointIn><connectionPointOut/><variable>b</variable></contact></LD>"#,
    ),
    (
        "contacts that drive nothing",
        r#"<LD><leftPowerRail localId="2"><position x="0" y="1"/><connectionPointOut formalParameter=""/></leftPowerRail>
<contact localId="3"><position x="9" y="1"/><connectionPointIn><connection refLocalId="2"/></connectionPointIn><connectionPointOut/><variable>a</variable></contact>
<connector localId="4" name="c"><position x="19" y="1"/><connectionPointIn><connection refLocalId="3"/></connectionPointIn></connector>
<rightPowerRail localId="5"><position x="99" y="1"/><connectionPointIn/></rightPowerRail></LD>"#,
    ),
    (
        "rungs",
        r#"<LD><rung localId="1"><contact variable="a" negated="true"/><coil variable="y" storage="set"/></rung><rung localId="2"><block typeName="TON" instanceName="t"><variable formalParameter="IN">b</variable><variable formalParameter="PT">T#1s</variable><variable formalParameter="Q">y</variable></block></rung></LD>"#,
    ),
    ("text", "<ST><xhtml:p><![CDATA[t(IN := a, PT := T#1s); y := t.Q;]]></xhtml:p></ST>"),
    ("a list", "<IL><xhtml:p><![CDATA[LD a\nAND b\nST y]]></xhtml:p></IL>"),
    (
        "functions",
        r#"<FBD><inVariable localId="1"><position x="0" y="0"/><connectionPointOut/><expression>a</expression></inVariable>
<inVariable localId="2"><position x="0" y="9"/><connectionPointOut/><expression>b</expression></inVariable>
<block localId="3" typeName="AND"><position x="9" y="0"/><inputVariables><variable formalParameter="IN1" negated="true"><connectionPointIn><connection refLocalId="1"/></connectionPointIn></variable><variable formalParameter="IN2"><connectionPointIn><connection refLocalId="2"/></connectionPointIn></variable></inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>
<outVariable localId="4"><position x="19" y="0"/><connectionPointIn><connection refLocalId="3" formalParameter="OUT"/></connectionPointIn><expression>y</expression></outVariable></FBD>"#,
    ),
];

fn file(body: &str) -> String {
    format!(
        r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201" xmlns:xhtml="http://www.w3.org/1999/xhtml"><fileHeader companyName="c" productName="p" productVersion="1" creationDateTime="2020-01-01T00:00:00"/><contentHeader name="n"><coordinateInfo><fbd><scaling x="1" y="1"/></fbd><ld><scaling x="1" y="1"/></ld><sfc><scaling x="1" y="1"/></sfc></coordinateInfo></contentHeader><types><dataTypes/><pous>
<pou name="main" pouType="program"><interface><localVars retain="true"><variable name="a" address="%IX0.0"><type><BOOL/></type><documentation><xhtml:p>the first</xhtml:p></documentation></variable><variable name="b" address="%IX0.1"><type><BOOL/></type></variable><variable name="y" address="%QX0.0"><type><BOOL/></type><initialValue><simpleValue value="TRUE"/></initialValue></variable><variable name="t"><type><derived name="TON"/></type></variable><variable name="spare"><type><INT/></type><addData/></variable></localVars></interface>
<actions><action name="once"><body><ST><xhtml:p>y := a;</xhtml:p></ST></body></action></actions><transitions><transition name="go"><body><ST><xhtml:p>a</xhtml:p></ST></body></transition></transitions>
<body>{body}</body></pou>
<pou name="other" pouType="program"><interface><localVars><variable name="o"><type><BOOL/></type></variable></localVars></interface><body><ST><xhtml:p>o := NOT o;</xhtml:p></ST></body></pou></pous></types><instances><configurations><configuration name="c"><resource name="r"><task name="t" interval="T#20ms" priority="1"><pouInstance name="i" typeName="main"/><pouInstance name="j" typeName="other"/></task><globalVars><variable name="g"><type><BOOL/></type></variable></globalVars></resource></configuration></configurations></instances></project>"#
    )
}

#[test]
fn every_element_of_each_language_counts() {
    for (name, body) in BODIES {
        let text = file(body);
        let found = source(Format::PlcOpen, &text);
        assert!(found.source.is_some(), "{name}\n{}", reading(Format::PlcOpen, &text));
        assert_eq!(
            unread(&text),
            Vec::<String>::new(),
            "{name}\n{}",
            reading(Format::PlcOpen, &text)
        );
    }
}

pub(crate) fn codes(text: &str) -> Vec<&'static str> {
    let found = source(Format::PlcOpen, text);
    let errors = found.diagnostics.iter().filter(|found| found.severity == Severity::Error);
    let codes: Vec<&str> = errors.map(|found| found.code).collect();
    assert_eq!(codes.is_empty(), found.source.is_some());
    codes
}

#[test]
fn what_has_no_meaning_here_is_refused_and_not_dropped() {
    let cases = [
        // A block in a rung that nothing says the outputs of.
        (
            r#"<LD><rung localId="1"><block typeName="ADD" instanceName="s"><variable formalParameter="IN1">spare</variable><variable formalParameter="IN2">1</variable><variable formalParameter="OUT">spare</variable></block></rung><rung localId="2"><contact variable="a"/><coil variable="y"/></rung></LD>"#,
            "U1010",
        ),
        (
            r#"<LD><rung localId="1"><contact variable="a"><branch/></contact><coil variable="y"/></rung></LD>"#,
            "U1010",
        ),
        (
            r#"<LD><rung localId="1"><contact variable="a" delay="3"/><coil variable="y"/></rung></LD>"#,
            "U1010",
        ),
        (
            r#"<LD><step localId="1" name="idle" initialStep="true"><position x="0" y="0"/></step></LD>"#,
            "U1010",
        ),
        ("<ST><xhtml:p>y := a;</xhtml:p></ST><IL><xhtml:p>LD b</xhtml:p></IL>", "U1010"),
        (
            r#"<FBD><inVariable localId="1"><position x="0" y="0"/><connectionPointOut><expression>b</expression></connectionPointOut><expression>a</expression></inVariable><outVariable localId="2"><position x="9" y="0"/><connectionPointIn><connection refLocalId="1"/></connectionPointIn><expression>y</expression></outVariable></FBD>"#,
            "U1010",
        ),
        (
            r#"<FBD><block localId="4" typeName="R_TRIG" instanceName="nobody"><position x="9" y="0"/><inputVariables/><inOutVariables/><outputVariables/></block></FBD>"#,
            "U1012",
        ),
        (
            r#"<FBD><block localId="4" typeName="TON" instanceName="t"><position x="9" y="0"/><inputVariables/><inOutVariables/><outputVariables><variable formalParameter="Q" storage="set"><connectionPointOut/></variable></outputVariables></block></FBD>"#,
            "U1010",
        ),
    ];
    for (body, code) in cases {
        assert!(
            codes(&file(body)).contains(&code),
            "{body}\n{}",
            reading(Format::PlcOpen, &file(body))
        );
    }
}

#[test]
fn names_that_differ_by_case_alone_are_named_both() {
    let text = file("<ST><xhtml:p>y := a;</xhtml:p></ST>").replace("name=\"b\"", "name=\"A\"");
    assert!(codes(&text).contains(&"U1042"), "{:?}", codes(&text));
    assert!(
        reading(Format::PlcOpen, &text).contains("`a` and `A`"),
        "{}",
        reading(Format::PlcOpen, &text)
    );
}

#[test]
fn the_interval_of_a_task_is_a_time_within_the_bounds() {
    let text = file("<ST><xhtml:p>y := a;</xhtml:p></ST>");
    let old =
        text.replace("T#20ms", "00:00:00.020").replace("name=\"i\" typeName", "name=\"i\" type");
    assert_eq!(codes(&old), codes(&text), "as 1.0 writes it");
    for interval in ["T#-10ms", "T#0s", "T#2h", "soon", "10"] {
        let text = file("<ST><xhtml:p>y := a;</xhtml:p></ST>").replace("T#20ms", interval);
        let found = codes(&text);
        assert!(
            !found.is_empty() && found.iter().all(|code| *code == "U1011"),
            "{interval}: {found:?}"
        );
    }
}

/// The places of what is wrong in a body are those of the file, whatever stands before it and in it.
#[test]
fn places_in_bodies_are_exact() {
    for (body, wrong) in [
        (
            "<ST>\n        <xhtml:p><![CDATA[\n  IF a &  b THEN\r\n    y := missing;\n  END_IF;]]></xhtml:p></ST>",
            "missing",
        ),
        ("<ST>\n   <xhtml:p>IF a &amp; b THEN y := missing; END_IF;</xhtml:p>\n</ST>", "missing"),
        (
            "<IL>\n        <xhtml:p><![CDATA[\n  LD a\r\n  AND b\n  ST missing]]></xhtml:p></IL>",
            "missing",
        ),
    ] {
        let text = file(body);
        let reading = read(&text, None);
        let found = reading.diagnostics.iter().find(|found| found.severity == Severity::Error);
        let found = found.expect("an error");
        assert_eq!(&text[found.span.clone()], wrong, "{found:?} {body}");
    }
}
